use crate::{assert_says, samples};
use palpate_simulator::error::Result;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::file::parse;
use std::path::Path;

fn parse_bytes(bytes: impl AsRef<[u8]>) -> Result<Mesh> {
    parse(bytes.as_ref(), Path::new("cup.stl")).map(|contents| contents.mesh)
}

fn notes(bytes: impl AsRef<[u8]>) -> Vec<String> {
    parse(bytes.as_ref(), Path::new("cup.stl")).unwrap().notes
}

fn complaint(bytes: impl AsRef<[u8]>) -> String {
    parse_bytes(bytes).unwrap_err().to_string()
}

const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";

#[test]
fn corners_at_one_place_become_one_vertex() {
    let globe = Mesh::globe(6);
    for mesh in [parse_bytes(samples::stl_binary(&globe)), parse_bytes(samples::stl_text(&globe))] {
        let mesh = mesh.unwrap();
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (globe.vertices.len(), globe.triangles.len()));
        assert!(palpate_simulator::mesh::facts::Facts::of(&mesh).is_right_side_out());
    }
    let zeros = format!("solid\n{FACET}{}endsolid", FACET.replace("vertex 0 0 0", "vertex -0 0 -0.0"));
    assert_eq!(parse_bytes(zeros).unwrap().vertices.len(), 3);
}

#[test]
fn a_count_that_disagrees_with_the_length_is_refused_whichever_is_wrong() {
    let whole = samples::stl_binary(&Mesh::globe(4));
    let triangles = (whole.len() - 84) / 50;
    for count in [0, triangles - 1, triangles + 1, 0xFF_FFFF] {
        let mut bytes = whole.clone();
        bytes[80..84].copy_from_slice(&(count as u32).to_le_bytes());
        let expected = format!("cup.stl: byte 80: the STL file is damaged: it states {count} triangles");
        assert_says(complaint(&bytes), &[&expected]);
    }
    for length in [whole.len() - 50, whole.len() - 1, whole.len() - 500] {
        assert!(complaint(&whole[..length]).contains(&format!("it states {triangles} triangles")));
    }
    for rest in [50, 51, 500] {
        assert_says(
            complaint([whole.clone(), vec![b'!'; rest]].concat()),
            &[&format!("it states {triangles} triangles")],
        );
    }
    assert!(complaint(&whole[..84 - 50]).contains("ends in the middle"));
    // A program that writes as it goes may leave no count, and a header without zeros.
    let uncounted = [&[b'x'; 80], [0xff; 4].as_slice(), &whole[84..]].concat();
    assert!(complaint(uncounted).contains("cup.stl: byte 80: the STL file is damaged: it states 4294967295 triangles"));
}

#[test]
fn a_few_bytes_after_the_last_triangle_are_left_out_and_said() {
    let globe = Mesh::globe(4);
    let whole = samples::stl_binary(&globe);
    assert!(notes(&whole).is_empty());
    for (rest, said) in [(1, "1 byte after"), (49, "49 bytes after")] {
        let longer = [whole.clone(), vec![b'\n'; rest]].concat();
        assert_eq!(parse_bytes(&longer).unwrap().triangles.len(), globe.triangles.len());
        assert!(notes(&longer).concat().starts_with(&format!("cup.stl has {said} its last triangle")));
        let text = format!("{}{}", samples::stl_text(&globe), "\n".repeat(rest));
        assert!(notes(text).is_empty());
    }
    // Some programs fill up the last block with zeros.
    let filled = [whole.clone(), vec![0; 2_000]].concat();
    assert_eq!(parse_bytes(&filled).unwrap().triangles.len(), globe.triangles.len());
    assert!(notes(&filled).concat().contains("has 2000 bytes after its last triangle, left out"));
    assert!(complaint([filled, vec![1]].concat()).contains("triangles, which are"));
}

#[test]
fn a_text_without_its_last_word_with_colors_or_with_more_lines_in_front_is_read() {
    let open = format!("solid\n{FACET}{FACET}");
    assert_eq!(parse_bytes(&open).unwrap().triangles.len(), 2);
    assert!(notes(&open).concat().contains("without \"endsolid\": if it was cut there"));
    let color = "color 0.5 0.5 1\n";
    let colored = format!("solid x\n{color}{}endsolid", FACET.replace("outer", &format!("{color}outer")));
    assert_eq!(parse_bytes(&colored).unwrap().triangles.len(), 1);
    let remarks =
        format!("solid x\nCreated by hand\n\nCOMMENT facet\n{FACET}endsolid\nsolid y\n# 2\n{FACET}endsolid x");
    assert_eq!(parse_bytes(&remarks).unwrap().triangles.len(), 2);
    assert!(notes(&remarks).is_empty() && notes(&colored).is_empty());
    let between = format!("solid x\n{FACET}Created by hand\n{FACET}endsolid");
    assert!(complaint(between).contains("cup.stl:9: the STL file is damaged: \"Created\" stands where \"facet\""));
}

#[test]
fn all_solids_of_a_text_are_read_with_names_or_without_in_any_case_and_layout() {
    let text =
        format!("  solid\n{FACET}endsolid\nSOLID solid facet vertex \u{e9}\n{}ENDSOLID x\n", FACET.to_uppercase());
    assert_eq!(parse_bytes(text.replace('\n', "\r\n")).unwrap().triangles.len(), 2);
    let one_line = format!("\u{feff}solid x\n{} endsolid x", FACET.replace('\n', " "));
    assert_eq!(parse_bytes(one_line).unwrap().triangles.len(), 1);
    let normals = FACET.replace("normal 0 0 1", "normal nan -nan 1.#IND");
    assert_eq!(parse_bytes(format!("solid\n{normals}endsolid")).unwrap().triangles.len(), 1);
}

#[test]
fn damage_to_a_text_is_named_with_its_line() {
    for (text, expected) in [
        ("solid x\n".into(), "cup.stl:1: the STL file is damaged: it ends where \"facet\" or \"endsolid\""),
        (
            format!("solid x\n{FACET}endsolid\nrest\n"),
            "cup.stl:10: the STL file is damaged: \"rest\" stands where \"solid\"",
        ),
        (
            format!("solid\n{}endsolid", FACET.replace("vertex 0 1 0\n", "")),
            "cup.stl:6: the STL file is damaged: \"endloop\"",
        ),
        (format!("solid\n{}endsolid", FACET.replace("endloop", "vertex 1 1 1\nendloop")), "a facet has three corners"),
        (
            format!("solid\n{}endsolid", FACET.replace("1 0 0\nv", "1 0 inf\nv")),
            "cup.stl:5: the coordinate z = \"inf\"",
        ),
        (format!("solid\n{}endsolid", FACET.replace("1 0 0\nv", "1 0 x\nv")), "cup.stl:5: \"x\" is not a number"),
        (format!("solid\n{}endsolid", FACET.replace("outer loop", "outer hoop")), "\"hoop\" stands where \"loop\""),
        ("solid\nendsolid\n".into(), "cup.stl: the mesh has no faces"),
    ] {
        assert_says(complaint(&text), &[expected]);
    }
}

#[test]
fn a_corner_that_is_not_finite_is_named_with_its_byte() {
    let mut bytes = samples::stl_binary(&Mesh::globe(4));
    bytes[84 + 50 + 12 + 12 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(complaint(bytes).starts_with("cup.stl: byte 162: the coordinate y = \"NaN\" is not finite"));
}
