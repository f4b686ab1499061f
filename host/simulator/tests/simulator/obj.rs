use crate::assert_says;
use palpate_simulator::error::Result;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::obj::{parse, read, write};
use std::path::Path;

fn parse_text(text: impl AsRef<[u8]>) -> Result<Mesh> {
    parse(text.as_ref(), Path::new("cup.obj"))
}

fn area(mesh: &Mesh) -> f64 {
    let corner = |index: u32| glam::Vec3::from(mesh.vertices[index as usize]).as_dvec3();
    let double = |&[a, b, c]: &[u32; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length();
    mesh.triangles.iter().map(double).sum::<f64>() / 2.0
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn a_mesh_survives_writing_and_reading() {
    let mesh = Mesh {
        vertices: vec![[0.1, -1e-30, 3e30], [1.0, 0.0, 0.33333334], [f32::MIN_POSITIVE, 5.0, -0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 1]],
    };
    let mut text = Vec::new();
    write(&mesh, &mut text).unwrap();
    assert_eq!(parse_text(text).unwrap(), mesh);
}

#[test]
fn everything_that_real_files_have_is_read_or_skipped() {
    let text = "\u{feff}# exported\r\nmtllib cup.mtl\r\no body\r\ng a b\r\nv 0 0 0 1 0.5 0.5\r\nv 1 0 0\r\n\
        v\t1 1 0 # corner\r\nvn 0 0 1\r\nvt 0.5\r\nvt 0.5 0.5\r\nusemtl gone\r\ns off\r\nf 1/1/1 2/2/1 3//1\r\n\
        \r\ng c\r\nv 0 1 0 1.0\r\nf -4 -2 \\\r\n  -1\r\nl 1 2 3 4\r\np 1\r\nf 1 2\r\nusemtl\r\nf 1/9/9 3/-7 4";
    let mesh = parse_text(text).unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 3));
    assert_eq!(mesh.triangles[1], mesh.triangles[2]);
    assert_eq!(area(&mesh), 1.5);
    // A byte order mark before the first vertex, a name that is no UTF-8, a vertex after its face.
    assert_eq!(parse_text(format!("\u{feff}{SQUARE}f 1 2 3\n")).unwrap().vertices[0], [0.0; 3]);
    assert_eq!(parse_text([b"o caf\xe9\n", SQUARE.as_bytes(), b"f 1 2 3\n"].concat()).unwrap().triangles.len(), 1);
    assert_eq!(parse_text("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 1 1 0\n").unwrap().triangles.len(), 1);
}

#[test]
fn a_backslash_at_the_end_of_a_comment_or_a_name_does_not_join_the_next_line() {
    for line in ["# in C:\\parts\\", "usemtl steel\\", "mtllib C:\\", "g one\\", "v 9 9 9 # C:\\", "o \\"] {
        let text = format!("{SQUARE}{line}\nf 1 2 3\n{line}\r\nf 1 3 4\n{line}");
        assert_eq!(parse_text(&text).unwrap().triangles.len(), 2, "{text}");
    }
    let text = "\u{feff}v 0 \\\n0 0\nv 1 0 0\nv 1 1 0\nf \\\n1 2 \\\n3";
    assert_eq!(parse_text(text).unwrap().triangles.len(), 1);
}

#[test]
fn polygons_become_triangles_of_the_same_area() {
    assert_eq!(area(&parse_text(format!("{SQUARE}f 1 2 3 4\n")).unwrap()), 1.0);
    // An L, starting next to its inner corner, where a fan would cover too much; and tilted, and tiny.
    let corners = [[2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0], [0, 0, 0], [2, 0, 0]];
    for (scale, slope) in [(1.0, 0.0), (1.0, 1.0), (1e-20, 0.5), (1e15, 3.0)] {
        let vertex = |&[x, y, _]: &[i32; 3]| {
            let [x, y] = [x, y].map(|c| f64::from(c) * scale);
            format!("v {x} {y} {}\n", slope * x)
        };
        let text: String = corners.iter().map(vertex).collect();
        let mesh = parse_text(text + "f 1 2 3 4 5 6\n").unwrap();
        let expected = 3.0 * scale * scale * f64::sqrt(1.0 + slope * slope);
        assert!((area(&mesh) / expected - 1.0).abs() < 1e-6, "{scale} {slope}: {}", area(&mesh) / expected);
    }
}

#[test]
fn polygons_without_area_become_segments_and_those_without_extent_are_left_out() {
    let mesh = parse_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3 4\nf 1 1 1 1 1\n").unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn wrong_lines_are_named() {
    for (text, expected) in [
        ("v 0 0 0\nv 1 0\n", "cup.obj:2: a vertex without z"),
        ("v 0 0 nan\n", "cup.obj:1: the coordinate z = \"nan\" is not finite"),
        ("v 0 1e39 0\n", "cup.obj:1: the coordinate y = \"1e39\" is not finite"),
        ("v 0 zero 0\n", "cup.obj:1: \"zero\" is not a number"),
        ("v 0 0 0\nf 1 1 2\nf 1 1 1\n", "cup.obj:2: vertex 2 of a face is out of range: the file has 1"),
        ("v 0 0 0\nf 1 1 -2\n", "cup.obj:2: vertex -2 of a face is out of range"),
        ("v 0 0 0\nf 1 0 1\n", "cup.obj:2: vertex 0 of a face is out of range"),
        ("v 0 0 0\nf 1 1 -9223372036854775808\n", "out of range"),
        ("v 0 0 0\nf 1 1 9223372036854775807\n", "out of range"),
        ("v 0 0 0\n\n# ok\nf 1 x 1\n", "cup.obj:4: \"x\" is not a vertex of a face"),
        ("v 0 0 0\nf 1 1.5 1\n", "cup.obj:2: \"1.5\" is not a vertex"),
    ] {
        let error = parse_text(text).unwrap_err();
        assert!(error.to_string().contains(expected), "{text:?}: {error}");
        assert!(error.to_string().ends_with("Correct the line, or export the mesh again."), "{error}");
        assert_eq!(error.exit_code(), 1);
    }
}

#[test]
fn meshes_without_faces_or_extent_are_refused() {
    for text in ["", "\0\0\0", SQUARE, "v 0 0 0\nf 1 1\n", "solid ascii stl\n"] {
        assert!(parse_text(text).unwrap_err().to_string().contains("cup.obj: the mesh has no faces"), "{text:?}");
    }
    let point = "v 1 2 3\nv 1 2 3\nv 5 5 5\nf 1 2 1\n";
    assert!(parse_text(point).unwrap_err().to_string().contains("no extent"));
    assert_says(read(Path::new("nowhere/cup.obj")).unwrap_err(), &["nowhere/cup.obj: cannot read the mesh"]);
}
