//! Coordinates in f64, as files hold them, on their way to the f32 of a [`Mesh`](super::Mesh).
//!
//! An `f32` has 24 bits: a cup of 0.1 m in the coordinates of a country would come out in steps of centimeters. So the
//! center of a mesh that is far from the origin is subtracted before its coordinates are rounded.

use super::Mesh;
use glam::DVec3;

/// A mesh as it was read, and what was subtracted from its coordinates.
pub(super) type Moved = (Mesh, [f64; 3]);

/// Largest distance of a mesh's center from the origin, along an axis and in longest sides, at which its coordinates
/// stay as they are. So far out, rounding moves a surface by less than a probe moves in a microsecond.
const FAR: f64 = 16.0;

/// The bounding box of vertices, one after the other. What is not finite is left out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY }
    }
}

impl Bounds {
    pub(super) fn of(vertices: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let mut bounds = Self::default();
        vertices.into_iter().for_each(|vertex| bounds.add(vertex));
        bounds
    }

    pub(super) fn add(&mut self, vertex: [f64; 3]) {
        let vertex = DVec3::from(vertex);
        if vertex.is_finite() {
            (self.low, self.high) = (self.low.min(vertex), self.high.max(vertex));
        }
    }

    /// Offset to subtract from the coordinates: the center, if it is far from the origin, else nothing.
    pub(super) fn offset(&self) -> [f64; 3] {
        let (center, side) = (self.low.midpoint(self.high), (self.high - self.low).max_element());
        // Without a vertex, neither is a number.
        if center.is_finite() && side > 0.0 && center.abs().max_element() > FAR * side {
            center.to_array()
        } else {
            [0.0; 3]
        }
    }
}

impl Mesh {
    /// A mesh of coordinates in f64, and what was subtracted from them: the center of a mesh that is far from the origin, so
    /// that rounding to f32 does not damage it; zeros for one that is not. Indices are not checked.
    pub fn from_f64(vertices: &[[f64; 3]], triangles: Vec<[u32; 3]>) -> (Self, [f64; 3]) {
        let used = triangles.iter().flatten().filter_map(|&index| vertices.get(index as usize).copied());
        let offset = Bounds::of(used).offset();
        (Self { vertices: vertices.iter().map(|&vertex| rounded(vertex, offset)).collect(), triangles }, offset)
    }
}

/// A vertex in f32, counted from `offset`.
pub(super) fn rounded(vertex: [f64; 3], offset: [f64; 3]) -> [f32; 3] {
    std::array::from_fn(|axis| (vertex[axis] - offset[axis]) as f32)
}

#[cfg(all(test, feature = "objects"))]
mod tests {
    use super::*;
    use crate::mesh::facts::Facts;
    use crate::mesh::tests::full_touches;
    use crate::mesh::{Mesh, builtin, file};
    use std::fmt::Write as _;
    use std::path::Path;

    #[test]
    fn only_what_is_far_from_the_origin_is_moved() {
        let cube = |at: f64| [[at, 0.0, 0.0], [at + 1.0, 1.0, 1.0]];
        assert_eq!(Bounds::of(cube(15.5)).offset(), [0.0; 3]);
        assert_eq!(Bounds::of(cube(-17.5)).offset(), [-17.0, 0.5, 0.5]);
        assert_eq!(Bounds::of(cube(f64::NAN)).offset(), [0.0; 3]);
        assert_eq!(Bounds::of([[5.0; 3]]).offset(), [0.0; 3], "a point has no side");
        assert_eq!(Bounds::default().offset(), [0.0; 3]);
        assert_eq!(rounded([0.1, -0.0, 1e-50], [0.0; 3]).map(f32::to_bits), [0.1, -0.0, 0.0].map(f32::to_bits));
    }

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
}
