use crate::assert_says;
use palpate_simulator::mesh::file::{EXTENSIONS, parse};
use std::path::Path;

fn said(bytes: &[u8], name: &str) -> String {
    parse(bytes, Path::new(name)).unwrap_err().to_string()
}

#[test]
fn a_format_that_is_not_read_is_named_with_what_converts_it() {
    let off = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(said(off, "box.off"), "box.off: OFF is not read. Convert it to PLY or STL, for example with MeshLab.");
    for (bytes, name, expected) in [
        (&off[..], "box.obj", "box.obj: OFF is not read"),
        (
            b"ISO-10303-21;\nHEADER;\n",
            "mug.step",
            "STEP is not read. Export a mesh of it as STL, for example with FreeCAD.",
        ),
        (b"#VRML V2.0 utf8\nShape {}\n", "mug.wrl", "VRML or X3D is not read"),
        (b"PK\x03\x04\x14\x00", "mug.3MF", "3MF is not read. Export it as STL with a slicer"),
        (b"PK\x03\x04\x14\x00", "mug.stl", "a ZIP archive is not read. Unpack it"),
        (b"\x1f\x8b\x08\x00", "mug.stl.gz", "a file compressed by gzip is not read"),
        (b"Kaydara FBX Binary  \x00", "mug.fbx", "FBX is not read. Export it as GLB or STL with Blender."),
        (b"; FBX 7.3.0 project file", "mug", "FBX is not read"),
        (b"#usda 1.0\n", "mug.usda", "USD is not read"),
        (b"LASF\x00\x00", "mug.las", "LAS is not read. Convert it to PLY with normals"),
        (b"12\n0 0 0 1\n", "mug.pts", "PTS or PTX is not read"),
        (b"\n<!DOCTYPE html>\n<html>", "mug.obj", "a web page is not read. Download the file itself"),
        (b"", "mug.fbx", "FBX is not read"),
        (
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n",
            "mug.ply",
            "mug.ply: points in PLY are not read. Instead, make a mesh of the points first (docs/guide/scenes.md).",
        ),
        (b"# .PCD v0.7\n", "mug.PCD", "points in PCD are not read. Instead, make a mesh of the points first"),
        (b"0 0 0\n1 0 0\n", "mug.xyz", "points in XYZ are not read. Instead, make a mesh of the points first"),
        (b"0 0 0\n1 0 0\n", "mug.asc", "points in XYZ are not read"),
        (b"cube(3);", "mug.scad", "OpenSCAD is not read. Export a mesh of it as STL with OpenSCAD."),
        (b"{}", "mug/scene_camera.json", "depth images are not read. Instead, make a mesh of the depth images first"),
    ] {
        assert_says(said(bytes, name), &[expected]);
    }
}

#[test]
fn what_git_lfs_left_is_called_that_in_every_format_that_is_read_and_none_of_them_is_called_unread() {
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:094d\nsize 625707\n";
    for extension in EXTENSIONS {
        let said = said(pointer, &format!("cup.{extension}"));
        assert!(
            said.contains("this is a pointer of Git LFS, and not the file itself. Fetch it: git lfs pull."),
            "{said}"
        );
        let said = self::said(b"", &format!("cup.{extension}"));
        assert!(!said.contains("is not read"), "{said}");
    }
}
