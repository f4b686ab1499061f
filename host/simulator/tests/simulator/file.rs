use crate::assert_says;
use crate::full_touches;
use crate::samples::{self, corners};
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::file::{Contents, Format, parse, read};
use std::path::Path;

#[test]
fn one_object_in_every_format_has_the_same_triangles_and_the_same_touches() {
    let globe = Mesh::globe(7);
    let expected = full_touches(&globe, 200);
    for (name, bytes) in samples::all(&globe) {
        let contents = parse(&bytes, Path::new(name)).unwrap_or_else(|error| panic!("{error}"));
        assert!(corners(&contents.mesh) == corners(&globe), "{name}");
        assert!(full_touches(&contents.mesh, 200) == expected, "{name}");
        let unit = match contents.format {
            Format::Gltf => Some(1_000.0),
            Format::Collada => Some(25.4),
            _ => None,
        };
        assert_eq!(contents.millimeters, unit, "{name}");
    }
}

#[test]
fn the_content_says_how_a_file_is_read_whatever_its_name_is() {
    let globe = Mesh::globe(5);
    for (name, bytes) in samples::all(&globe) {
        for other in ["cup", "cup.obj", "cup.stl", "cup.ply", "cup.gltf", "cup.dae", "cup.txt"] {
            let mesh =
                parse(&bytes, Path::new(other)).unwrap_or_else(|error| panic!("{name} as {other}: {error}")).mesh;
            assert!(corners(&mesh) == corners(&globe), "{name} as {other}");
        }
    }
}

#[test]
fn a_text_whose_length_is_that_of_a_binary_file_is_text() {
    let mut text = samples::stl_text(&Mesh::globe(4));
    while !(text.len() - 84).is_multiple_of(50) {
        text.push('\n');
    }
    assert_eq!(parse(text.as_bytes(), Path::new("cup.stl")).unwrap().format, Format::Stl);
}

#[test]
fn what_is_nothing_is_refused_as_what_its_extension_says() {
    for (name, bytes, expected) in [
        ("cup.stl", &b""[..], "cup.stl: byte 0: the STL file is damaged"),
        ("cup.stl", b"\0\0\0", "the STL file is damaged"),
        ("cup.ply", b"", "cup.ply:1: the PLY file is damaged: its first line is not \"ply\""),
        ("cup.glb", b"nothing", "the glTF file is damaged"),
        ("cup.gltf", b"", "cup.gltf:1: the glTF file is damaged"),
        ("cup.dae", b"nothing", "cup.dae:1: the COLLADA file is damaged"),
        ("cup.obj", b"nothing", "cup.obj: the mesh has no faces"),
        (
            "cup",
            b"\x89PNG\r\n",
            "cup: a file that is neither OBJ, STL, PLY, glTF nor COLLADA is not read. Export a mesh",
        ),
        (
            "arm.urdf",
            b"<?xml version=\"1.0\"?>\n<!-- arm --><robot/>",
            "arm.urdf: a description of a robot or a world (<robot>)",
        ),
        ("arm.xml", b"<mujoco/>", "<mujoco>) is not read. Give the meshes that it names, with --true-size"),
        ("scene.dae", b"<X3D></X3D>", "scene.dae: the COLLADA file is damaged: its root is <X3D>, not <COLLADA>"),
        ("page.dae", b"<html></html>", "page.dae: a web page is not read"),
    ] {
        assert_says(parse(bytes, Path::new(name)).unwrap_err(), &[expected]);
    }
}

#[test]
fn damaged_files_of_every_format_give_a_mesh_or_an_error_that_names_them() {
    let globe = Mesh::globe(4);
    for (name, bytes) in samples::all(&globe) {
        let mut refused = 0;
        for seed in 0..400 {
            match parse(&samples::damaged(&bytes, seed), Path::new(name)) {
                Ok(contents) => {
                    let Mesh { vertices, triangles } = contents.mesh;
                    assert!(
                        triangles.iter().flatten().all(|&index| (index as usize) < vertices.len()),
                        "{name} {seed}"
                    );
                    assert!(vertices.iter().flatten().all(|x| x.is_finite()), "{name} {seed}");
                }
                Err(error) => {
                    let text = error.to_string();
                    assert!(text.starts_with(name) && text.ends_with('.') && text.len() < 600, "{name} {seed}: {text}");
                    assert_eq!(error.exit_code(), 1);
                    refused += 1;
                }
            }
        }
        assert!(refused > 100, "{name}: only {refused} of 400 refused");
    }
}

#[test]
fn a_file_that_is_cut_anywhere_is_refused() {
    // A text of OBJ that is cut between two lines is a smaller mesh.
    for (name, bytes) in samples::all(&Mesh::globe(3)).into_iter().skip(1) {
        let text = ["text.stl", "cup.gltf", "cup.dae", "text.ply"].contains(&name);
        // Nothing but white space, or a number that is shorter, is missing.
        let end = bytes.trim_ascii_end().len() - if name == "text.ply" { 2 } else { 0 };
        for length in (0..end).step_by(if text { 7 } else { 1 }) {
            let cut = &bytes[..length];
            // A text of STL that is cut between two facets is as some programs write it.
            let is_said = |read: Contents| read.notes.concat().contains("if it was cut there");
            assert!(parse(cut, Path::new(name)).map_or(true, is_said), "{name} of {length} bytes");
        }
    }
}

#[test]
fn a_pipe_or_a_file_is_read_alike_and_a_missing_one_is_named() {
    let directory = tempfile::tempdir().unwrap();
    for (name, bytes) in samples::all(&Mesh::globe(3)) {
        let path = directory.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        assert_eq!(read(&path).unwrap(), parse(&bytes, &path).unwrap());
    }
    assert_says(read(Path::new("nowhere/cup.glb")).unwrap_err(), &["nowhere/cup.glb: cannot read the mesh"]);
    assert!(read(directory.path()).is_err());
}
