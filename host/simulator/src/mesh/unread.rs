//! Files that are not read although they may hold a mesh, and what reads them.

use crate::error::{Error, problem};
use palpate_base::gone;
use std::fmt::Display;
use std::path::Path;

/// A format that is not read.
struct Unread {
    name: &'static str,
    /// In lower case.
    extensions: &'static [&'static str],
    /// First bytes of its files; any of them.
    begins: &'static [&'static [u8]],
    /// Advice, as a sentence without its full stop.
    instead: &'static str,
}

const BLENDER: &str = "Export it as GLB or STL with Blender";
const MESHLAB: &str = "Convert it to PLY or STL, for example with MeshLab";
const FREECAD: &str = "Export a mesh of it as STL, for example with FreeCAD";
const CLOUDCOMPARE: &str = "Convert it to PLY with normals, for example with CloudCompare";
const PARAVIEW: &str = "Convert its surface to PLY or STL, for example with ParaView";

const FORMATS: [Unread; 18] = [
    Unread {
        name: "OFF",
        extensions: &["off", "coff"],
        begins: &[b"OFF\n", b"OFF\r", b"OFF ", b"COFF", b"NOFF"],
        instead: MESHLAB,
    },
    Unread {
        name: "3MF",
        extensions: &["3mf"],
        begins: &[],
        instead: "Export it as STL with a slicer or with FreeCAD",
    },
    Unread { name: "AMF", extensions: &["amf"], begins: &[], instead: "Export it as STL with a slicer" },
    Unread { name: "STEP", extensions: &["step", "stp"], begins: &[b"ISO-10303-21"], instead: FREECAD },
    Unread { name: "IGES", extensions: &["iges", "igs"], begins: &[], instead: FREECAD },
    Unread { name: "BREP", extensions: &["brep", "brp"], begins: &[b"DBRep_DrawableShape"], instead: FREECAD },
    Unread {
        name: "a file of a CAD program",
        extensions: &["sldprt", "sldasm", "ipt", "iam", "catpart", "f3d", "x_t", "x_b", "jt", "fcstd", "skp"],
        begins: &[],
        instead: "Export a mesh of it as STL with that program",
    },
    Unread {
        name: "OpenSCAD",
        extensions: &["scad"],
        begins: &[],
        instead: "Export a mesh of it as STL with OpenSCAD",
    },
    Unread {
        name: "VRML or X3D",
        extensions: &["wrl", "vrml", "x3d", "x3dv"],
        begins: &[b"#VRML", b"#X3D"],
        instead: MESHLAB,
    },
    Unread { name: "FBX", extensions: &["fbx"], begins: &[b"Kaydara FBX", b"; FBX"], instead: BLENDER },
    Unread {
        name: "USD",
        extensions: &["usd", "usda", "usdc", "usdz"],
        begins: &[b"#usda", b"PXR-USDC"],
        instead: BLENDER,
    },
    Unread { name: "a file of Blender", extensions: &["blend"], begins: &[b"BLENDER"], instead: BLENDER },
    Unread { name: "3DS", extensions: &["3ds"], begins: &[], instead: MESHLAB },
    Unread { name: "VTK", extensions: &["vtk", "vtp", "vtu"], begins: &[b"# vtk DataFile"], instead: PARAVIEW },
    Unread {
        name: "a mesh of Gmsh",
        extensions: &["msh"],
        begins: &[b"$MeshFormat"],
        instead: "Export it as STL with Gmsh",
    },
    Unread { name: "LAS", extensions: &["las", "laz"], begins: &[b"LASF"], instead: CLOUDCOMPARE },
    Unread { name: "E57", extensions: &["e57"], begins: &[b"ASTM-E57"], instead: CLOUDCOMPARE },
    Unread { name: "PTS or PTX", extensions: &["pts", "ptx"], begins: &[], instead: CLOUDCOMPARE },
];

/// Files that are not meshes, by their first bytes: their names, and advice.
const OTHERS: [(&[u8], &str, &str); 5] = [
    (b"PK\x03\x04", "a ZIP archive", "Unpack it, then give what is in it"),
    (b"\x1f\x8b", "a file compressed by gzip", "Unpack it"),
    (b"<!doctype html", "a web page", "Download the file itself; on GitHub, what its button Raw gives"),
    (b"<html", "a web page", "Download the file itself; on GitHub, what its button Raw gives"),
    (b"%PDF", "a PDF document", "Give a mesh"),
];

/// Content of a file of points or depth images, by its name, and what to use instead.
fn points(path: &Path) -> Option<(&'static str, &'static str)> {
    let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    let (what, word) = match extension.as_deref() {
        Some("pcd") => ("points in PCD", ".pcd"),
        Some("xyz" | "asc") => ("points in XYZ", ".xyz"),
        _ if path.file_name()? == "scene_camera.json" => ("depth images", "depth image"),
        _ => return None,
    };
    Some((what, gone::instead(word)?))
}

/// A PLY file has no faces.
pub(super) fn cloud() -> Error {
    no_points("points in PLY", gone::instead("points").unwrap_or_default())
}

/// A file holds points or depth images. `instead` is the rest of a sentence that begins with "Instead".
fn no_points(what: &str, instead: &str) -> Error {
    problem!("{what} are not read").fix(format!("Instead, {instead}."))
}

/// A file uses a feature that is not read and would change the surface, or is of a format that is not read. `instead` is a
/// sentence without its full stop.
pub(super) fn unsupported(what: impl Display, instead: &str) -> Error {
    problem!("{what} is not read").fix(format!("{instead}."))
}

/// Git LFS left a pointer in the place of a file.
pub(super) fn pointer() -> Error {
    problem!("this is a pointer of Git LFS, and not the file itself").fix("Fetch it: git lfs pull.")
}

fn by_extension(path: &Path) -> Option<&'static Unread> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    FORMATS.iter().find(|format| format.extensions.contains(&extension.as_str()))
}

/// The format of a file that is not read, by its extension, with what to do.
pub(super) fn of_name(path: &Path) -> Option<(&'static str, &'static str)> {
    by_extension(path).map(|format| (format.name, format.instead)).or_else(|| points(path))
}

/// True if a file starts as one that Git LFS left in the place of another.
pub(super) fn is_pointer(head: &[u8]) -> bool {
    head.starts_with(b"version https://git-lfs.github.com/spec/")
}

/// Problem of a file that starts with `head` and is of a format that is not read, by its content or else by its name; none if
/// it may be read.
pub(super) fn problem(head: &[u8], path: &Path) -> Option<Error> {
    if is_pointer(head) {
        return Some(pointer());
    }
    if let Some((what, instead)) = points(path) {
        return Some(no_points(what, instead));
    }
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let begins = |begin: &&[u8]| text.get(..begin.len()).is_some_and(|start| start.eq_ignore_ascii_case(begin));
    let by_content = FORMATS.iter().find(|format| format.begins.iter().any(begins));
    if let Some(format) = by_content.or_else(|| by_extension(path)) {
        return Some(unsupported(format.name, format.instead));
    }
    let (_, what, instead) = OTHERS.iter().find(|(begin, ..)| begins(begin))?;
    Some(unsupported(what, instead))
}
