//! Meshes far from the origin of their coordinates, in files of every kind.

use crate::full_touches;
use glam::DVec3;
use palpate_simulator::mesh::facts::Facts;
use palpate_simulator::mesh::{Mesh, builtin, file};
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
