//! Meshes far from the origin of their coordinates, in files of every kind.

use crate::full_touches;
use crate::samples::{self, cuboid};
use glam::DVec3;
use palpate_simulator::mesh::facts::Facts;
use palpate_simulator::mesh::{Mesh, builtin, file, source};
use serde_ply::PlyFormat;
use std::fmt::Write as _;
use std::path::Path;

/// The bowl, each file with its coordinates in f64 moved by `by`.
fn moved(by: [f64; 3]) -> Vec<(&'static str, String)> {
    let bowl = builtin::one("bowl").unwrap().mesh().clone();
    let place = |vertex: &[f32; 3]| -> [f64; 3] { std::array::from_fn(|axis| f64::from(vertex[axis]) + by[axis]) };
    let (mut obj, mut ply) = (
        String::new(),
        format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty float y\nproperty float32 z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            bowl.vertices.len(),
            bowl.triangles.len()
        ),
    );
    for [x, y, z] in bowl.vertices.iter().map(place) {
        writeln!(obj, "v {x} {y} {z}").unwrap();
        writeln!(ply, "{x} {y} {z}").unwrap();
    }
    let mut stl = "solid bowl\n".to_owned();
    let (mut places, mut corners) = (String::new(), String::new());
    bowl.vertices.iter().flat_map(place).for_each(|x| write!(places, "{x} ").unwrap());
    for triangle in &bowl.triangles {
        let [a, b, c] = triangle;
        writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
        writeln!(ply, "3 {a} {b} {c}").unwrap();
        write!(corners, "{a} {b} {c} ").unwrap();
        stl += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in triangle.map(|index| place(&bowl.vertices[index as usize])) {
            writeln!(stl, "vertex {x} {y} {z}").unwrap();
        }
        stl += "endloop\nendfacet\n";
    }
    stl += "endsolid\n";
    let dae = format!(
        "<COLLADA><asset><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id=\"g\"><mesh><source id=\"s\">\
         <float_array id=\"a\" count=\"{}\">{places}</float_array><technique_common><accessor source=\"#a\" \
         count=\"{}\" stride=\"3\"><param name=\"X\"/><param name=\"Y\"/><param name=\"Z\"/></accessor>\
         </technique_common></source><vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>\
         <triangles count=\"{}\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>{corners}</p></triangles>\
         </mesh></geometry></library_geometries></COLLADA>",
        3 * bowl.vertices.len(),
        bowl.vertices.len(),
        bowl.triangles.len()
    );
    vec![("bowl.obj", obj), ("bowl.ply", ply), ("bowl.stl", stl), ("bowl.dae", dae)]
}

/// Contact times of the first touches.
fn times(mesh: &Mesh) -> Vec<u32> {
    full_touches(mesh, 40).iter().flat_map(|touch| touch.times().map(|time| time.micros().unwrap())).collect()
}

#[test]
fn a_mesh_far_from_its_origin_is_read_as_if_it_were_there() {
    let bowl = builtin::one("bowl").unwrap().mesh().clone();
    let (own, expected) = (Facts::of(&bowl), times(&bowl));
    assert!(own.is_closed());
    for by in [[1e5, 0.0, 0.0], [4e6, -4e6, 4e6]] {
        for (name, text) in moved(by) {
            let contents = file::parse(text.as_bytes(), Path::new(name)).unwrap();
            let facts = Facts::of(&contents.mesh);
            assert_eq!(
                [facts.open_edges, facts.branching_edges, facts.contrary_edges, facts.triangles],
                [0, 0, 0, own.triangles],
                "{name} moved by {by:?}"
            );
            assert!((facts.volume / own.volume - 1.0).abs() < 1e-5, "{name} moved by {by:?}");
            let middle = DVec3::from(contents.moved) - DVec3::from(by);
            assert!(middle.abs().max_element() < f64::from((own.high - own.low).max_element()), "{middle}");
            let found = times(&contents.mesh);
            let worst = found.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(found.len() == expected.len() && worst <= Some(2), "{name} moved by {by:?}: {worst:?} µs");
        }
    }
    for (name, text) in moved([0.0; 3]) {
        let contents = file::parse(text.as_bytes(), Path::new(name)).unwrap();
        assert_eq!((contents.moved, times(&contents.mesh)), ([0.0; 3], expected.clone()), "{name}");
    }
}

/// A mesh moved by `by`, in files that hold it in 32-bit numbers.
fn in_f32(mesh: &Mesh, by: [f64; 3]) -> Vec<(&'static str, Vec<u8>)> {
    let mut mesh = mesh.clone();
    for vertex in &mut mesh.vertices {
        *vertex = std::array::from_fn(|axis| (f64::from(vertex[axis]) + by[axis]) as f32);
    }
    vec![
        ("cup.stl", samples::stl_binary(&mesh)),
        ("cup.ply", samples::ply(&mesh, PlyFormat::BinaryLittleEndian)),
        ("big.ply", samples::ply(&mesh, PlyFormat::BinaryBigEndian)),
        ("cup.glb", samples::glb(&mesh)),
        ("cup.gltf", samples::gltf(&mesh)),
    ]
}

/// The object in a file: its notes, and whether it is usable.
fn read(name: &str, bytes: &[u8]) -> (String, String) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let object = source::object(path.to_str().unwrap()).unwrap();
    let facts = object.facts(object.first());
    let verdict = facts.verdict(0.001);
    let is_complaint =
        facts.complaints(None).iter().any(|complaint| complaint.starts_with("The mesh is rounded: its file"));
    assert_eq!(is_complaint, verdict.starts_with("repair first: its file gives coordinates in steps of"), "{verdict}");
    (object.notes.join("\n"), verdict)
}

#[test]
fn coordinates_that_32_bit_numbers_round_are_said_to_be_and_are_to_be_repaired() {
    // Meters, in the coordinates of a country; and a mesh of few corners that all stay apart.
    let globe = Mesh::globe(12).stretched([0.04; 3]);
    for mesh in [globe, cuboid([0.8, 0.6, 0.9])] {
        for (name, bytes) in in_f32(&mesh, [450_000.0, 5_200_000.0, 300.0]) {
            let (notes, verdict) = read(name, &bytes);
            assert!(verdict.starts_with("repair first: its file gives coordinates in steps of 0.500"), "{verdict}");
            assert!(
                notes.contains(&format!("{name} is rounded: its file gives coordinates in steps of 0.500")),
                "{notes}"
            );
            assert!(notes.contains("export it near the origin, or with more digits"), "{notes}");
        }
        // A step of 15 nanometers, and one of a thousandth of the size or so.
        for (by, is_fine) in [(0.2, true), (500.0, true), (20_000.0, false)] {
            for (name, bytes) in in_f32(&mesh, [by, 0.0, 0.0]) {
                let (notes, verdict) = read(name, &bytes);
                assert_eq!(
                    (!notes.contains("rounded"), !verdict.starts_with("repair")),
                    (is_fine, is_fine),
                    "{name} {by}"
                );
            }
        }
    }
}

#[test]
fn a_node_that_places_a_mesh_far_away_rounds_nothing_and_one_that_enlarges_it_enlarges_its_steps() {
    let globe = Mesh::globe(12).stretched([0.04; 3]);
    let placed = |mesh: &Mesh, node: serde_json::Value| {
        let mut document = samples::document(mesh, None);
        document["nodes"][0] = node;
        read("cup.glb", &samples::glb_of(&document, &samples::buffer(mesh)))
    };
    let (notes, verdict) =
        placed(&globe, serde_json::json!({"children": [1, 2], "translation": [450_000, 5_200_000, 300]}));
    assert!(notes.contains("far from its origin") && !notes.contains("rounded"), "{notes}");
    assert!(!verdict.starts_with("repair"), "{verdict}");
    let mut far = globe;
    far.vertices.iter_mut().for_each(|vertex| vertex[1] += 50_000.0);
    let half = 0.5_f64.sqrt();
    let turned = serde_json::json!({"children": [1, 2], "rotation": [0, 0, half, half], "scale": [10, 10, 10]});
    assert!(placed(&far, turned).1.contains("in steps of 0.0391"));
}

#[test]
fn text_with_too_few_digits_is_said_to_be_rounded_and_whole_numbers_that_are_meant_are_not() {
    let globe = Mesh::globe(24).stretched([0.04; 3]);
    let text = |mesh: &Mesh, by: f64, digits: usize| {
        let (mut obj, mut ply) = (String::new(), String::new());
        for [x, y, z] in mesh.vertices.iter().map(|vertex| vertex.map(|x| f64::from(x) + by)) {
            writeln!(obj, "v {x:.digits$} {y:.digits$} {z:.digits$}").unwrap();
            writeln!(ply, "{x:.digits$} {y:.digits$} {z:.digits$}").unwrap();
        }
        for [a, b, c] in &mesh.triangles {
            writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
            writeln!(ply, "3 {a} {b} {c}").unwrap();
        }
        let head = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
             property list uchar int vertex_indices\nend_header\n",
            mesh.vertices.len(),
            mesh.triangles.len()
        );
        [read("cup.obj", obj.as_bytes()), read("cup.ply", (head + &ply).as_bytes())]
    };
    for by in [0.0, 450_000.0] {
        for (notes, verdict) in text(&globe, by, 2) {
            assert!(verdict.starts_with("repair first: its file gives coordinates in steps of 0.0100"), "{verdict}");
            assert!(notes.contains("is rounded: "), "{notes}");
        }
        for (notes, verdict) in text(&globe, by, 6) {
            assert!(!notes.contains("rounded") && !verdict.starts_with("repair"), "{notes} {verdict}");
        }
        for (notes, verdict) in text(&cuboid([40.0, 30.0, 20.0]), by, 0) {
            assert!(!notes.contains("rounded") && !verdict.starts_with("repair"), "{notes} {verdict}");
        }
    }
}
