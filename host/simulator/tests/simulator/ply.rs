use crate::samples;
use palpate_simulator::error::Result;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::file::parse;
use serde_ply::PlyFormat;
use std::path::Path;

fn parse_bytes(bytes: impl AsRef<[u8]>) -> Result<Mesh> {
    parse(bytes.as_ref(), Path::new("cup.ply")).map(|contents| contents.mesh)
}

fn complaint(bytes: impl AsRef<[u8]>) -> String {
    parse_bytes(bytes).unwrap_err().to_string()
}

/// A text with these lines of its header after the vertices, and these rows.
fn text(faces: &str, rows: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty double y\nproperty int z\n{faces}end_header\n\
         0 0 0\n1 0 0\n1 1 0\n0 1 0\n{rows}"
    )
}

const FACES: &str = "element face 1\nproperty list uchar int vertex_index\n";

#[test]
fn polygons_strips_and_short_faces_are_cut_and_other_elements_skipped() {
    assert_eq!(parse_bytes(text(FACES, "4 0 1 2 3")).unwrap().triangles, [[0, 1, 2], [0, 2, 3]]);
    let two = "element face 2\nproperty list uchar int vertex_indices\nproperty float quality\n";
    assert_eq!(parse_bytes(text(two, "2 0 1 .5\n3 0 1 2 1.\n")).unwrap().triangles, [[0, 1, 2]]);
    let strips = "element tristrips 1\nproperty list int int vertex_indices\n";
    assert_eq!(parse_bytes(text(strips, "8 0 1 2 3 -1 0 1 2\n")).unwrap().triangles, [[0, 1, 2], [2, 1, 3], [0, 1, 2]]);
    let others = format!("element edge 1\nproperty int a\nproperty list uchar float b\n{FACES}element none 0\n");
    assert_eq!(parse_bytes(text(&others, "7 2 .5 1e3\n3 0 1 2\n")).unwrap().triangles.len(), 1);
}

#[test]
fn a_remark_of_the_exporter_without_the_word_comment_is_skipped() {
    let remark = "format ascii 1.0\nCreated by Blender3D 247 - www.blender.org, source file: ";
    let text = text(FACES, "3 0 1 2\n").replace("format ascii 1.0", remark);
    assert_eq!(parse_bytes(text).unwrap().triangles, [[0, 1, 2]]);
}

#[test]
fn windows_line_ends_are_read_in_text_and_before_binary_rows() {
    let windows = text(FACES, "3 0 1 2\n").replace('\n', "\r\n");
    assert_eq!(parse_bytes(windows).unwrap().triangles, [[0, 1, 2]]);
    let globe = Mesh::globe(4);
    let bytes = samples::ply(&globe, PlyFormat::BinaryBigEndian);
    let end = bytes.windows(11).position(|part| part == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(bytes[..end].to_vec()).unwrap().replace('\n', "\r\n");
    assert_eq!(parse_bytes([header.as_bytes(), &bytes[end..]].concat()).unwrap(), globe);
}

#[test]
fn damage_is_named_with_its_line_or_byte() {
    for (bytes, expected) in [
        (
            text("element face 1\n", "3 0 1 2"),
            "cup.ply:7: the PLY file is damaged: the element \"face\" has 1 rows without",
        ),
        (text("element face 100000000\n", ""), "without a property"),
        (
            text("element face 1\nproperty list float int vertex_indices\n", ""),
            "cup.ply:8: the PLY file is damaged: \"float\" cannot count",
        ),
        (text("element face 1\nproperty list int float vertex_indices\n", ""), "has no list of whole numbers"),
        (text("element face 1\nproperty int vertex_indices\n", ""), "has no list of whole numbers"),
        (text("element face x\n", ""), "cup.ply:7: the PLY file is damaged: \"x\" is not a count"),
        (text("element vertex 1\n", ""), "there are two elements \"vertex\""),
        (text("proprety int a\n", ""), "cup.ply:7: the PLY file is damaged: \"proprety int a\" is not a header line"),
        (text("property float x\n", ""), "vertex has two properties \"x\""),
        (text("property half w\n", ""), "\"half\" is not a number type"),
        (text(FACES, "3 0 1 4"), "cup.ply: vertex 4 of a face is missing: there are 4 vertices"),
        (text(FACES, "3 0 1 -2"), "vertex -2 of a face is missing"),
        (
            text(FACES, "3 0 1"),
            "cup.ply:13: the PLY file is damaged: it ends before the 1 rows of the element \"face\"",
        ),
        (text(FACES, "3 0 1 2\n3 0 1 2"), "more stands after the rows"),
        (text(FACES, "3 0 1 x"), "cup.ply:13: the PLY file is damaged"),
        (text(FACES, "3 0 1 2").replace("1 1 0", "1 1e999 0"), "cup.ply:11: the PLY file is damaged: the coordinate y"),
        (
            text(FACES, "3 0 1 2").replace("property int z\n", ""),
            "cup.ply:3: the PLY file is damaged: vertices have no number z",
        ),
        (text(FACES, "3 0 1 2").replace("format ascii 1.0\n", ""), "has no line \"format"),
        (text(FACES, "3 0 1 2").replace("1.0", "2.0"), "cup.ply:2: the PLY file is damaged"),
    ] {
        let said = complaint(&bytes);
        assert!(said.contains(expected), "{said}\n{bytes}");
    }
    let mut binary = samples::ply(&Mesh::globe(3), PlyFormat::BinaryLittleEndian);
    let header = binary.windows(11).position(|part| part == b"end_header\n").unwrap() + 11;
    let mut old = binary.clone();
    old[..header].iter_mut().filter(|byte| **byte == b'\n').for_each(|byte| *byte = b'\r');
    assert!(complaint(old).contains("its header's lines end in CR alone"));
    binary.pop();
    let said = complaint(&binary);
    assert!(
        said.starts_with(&format!("cup.ply: byte {}: ", binary.len())) && said.contains("it ends before"),
        "{said}"
    );
}

#[test]
fn a_header_without_end_is_not_read_to_the_end() {
    let endless = [b"ply\n".as_slice(), &vec![b'c'; 3 << 20]].concat();
    assert!(complaint(endless).contains("its header has more than 1 MB"));
}
