//! Meshes in other formats than OBJ, wherever a mesh is read.

use crate::{Folder, holds, palpate, stderr, succeeds};
use palpate::mesh::Mesh;
use std::path::Path;

/// A mesh as binary STL.
fn stl(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        bytes.extend([0; 12]);
        let corners = triangle.map(|index| mesh.vertices[index as usize]);
        corners.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// Messages of a capture of these meshes.
fn capture(at: &Path, source: &str) -> String {
    stderr(palpate(at, &format!("capture {source} -o touches-{source} --touches 50")), 0)
}

#[test]
fn view_says_in_words_what_is_wrong_with_a_mesh_on_the_page_and_in_the_terminal() {
    let at = &Folder::new();
    let view = |mesh: &Mesh| {
        std::fs::write(at.join("cup.stl"), stl(mesh)).unwrap();
        (succeeds(at, "view cup.stl -o page.html"), std::fs::read_to_string(at.join("page.html")).unwrap())
    };
    let good = Mesh::globe(6);
    let (said, _) = view(&good);
    assert!(said.contains("cup: nothing is wrong with the mesh"), "{said}");
    // Another globe beside it, inside out and far away; and a hole in the first.
    let mut bad = good.clone();
    let base = bad.vertices.len() as u32;
    bad.vertices.extend(good.vertices.iter().map(|&[x, y, z]| [x * 0.1 + 9.0, y * 0.1, z * 0.1]));
    bad.triangles.extend(good.triangles.iter().map(|&[a, b, c]| [a + base, c + base, b + base]));
    bad.triangles.remove(0);
    bad.vertices.iter_mut().flatten().for_each(|x| *x *= 1e6);
    let (said, shown) = view(&bad);
    for expected in [
        "The mesh is open: 3 edges belong to one triangle only",
        "The mesh is partly inside out: 1 of 2 parts",
        "The mesh has an implausible size, in meters as well as in millimeters",
    ] {
        assert!(said.contains(expected), "{said}");
        assert!(shown.contains(expected), "the page lacks: {expected}");
    }
    let error = capture(at, "cup.stl");
    let line = error.lines().find(|line| line.starts_with("cup: The mesh is open")).unwrap_or_default();
    holds(line, &["partly inside out", "an implausible size"]);
}

#[test]
fn a_damaged_mesh_of_any_format_is_refused_with_its_place_and_a_cure() {
    let at = &Folder::new();
    let cut = stl(&Mesh::globe(4));
    for (name, bytes, expected) in [
        ("cup.obj", &b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"[..], "cup.obj:4: vertex 4 of a face is out of range"),
        ("cup.stl", &cut[..cut.len() - 50], "cup.stl: byte 80: the STL file is damaged: it states 48 triangles"),
        ("cup.ply", b"ply\nformat ascii 1.0\nelement face 3\nend_header\n", "cup.ply:3: the PLY file is damaged"),
        ("cup.glb", b"glTF\x02\0\0\0\xff\0\0\0", "cup.glb: byte 8: the GLB file is damaged"),
        ("cup.dae", b"<COLLADA>\n<a></b></COLLADA>", "cup.dae:2: the COLLADA file is damaged"),
    ] {
        std::fs::write(at.join(name), bytes).unwrap();
        for command in ["capture", "view", "run"] {
            let error = stderr(palpate(at, &format!("{command} {name} -o out")), 1);
            assert!(error.contains(expected) && error.contains("xport the mesh again"), "{error}");
        }
    }
    assert!(!at.join("out").exists());
}
