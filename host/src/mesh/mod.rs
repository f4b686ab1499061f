//! Triangle meshes: from files, or built in.

#[cfg(feature = "objects")]
pub mod builtin;
#[cfg(not(feature = "objects"))]
#[path = "no_builtin.rs"]
mod builtin;
pub mod obj;
pub mod source;

/// An indexed triangle mesh, in its file's own units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub vertices: Vec<[f32; 3]>,
    /// Triangles as indices into `vertices`, anticlockwise when seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// An object to recognize: a name and a mesh.
#[derive(Clone, Debug)]
pub struct Object {
    /// The object's name: a class label, and a file's stem.
    pub name: String,
    /// Its mesh, not yet scaled.
    pub mesh: Mesh,
}

impl Mesh {
    /// A globe with hills: closed, with 4 · `rings` · (`rings` − 1) triangles. What tests and measurements touch when
    /// they need a mesh of a certain size.
    pub fn globe(rings: u32) -> Self {
        let columns = 2 * rings;
        let position = |ring: u32, column: u32| {
            let latitude = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let longitude = std::f64::consts::TAU * f64::from(column) / f64::from(columns);
            let height = 1.0 + 0.1 * libm::sin(5.0 * longitude) * libm::sin(7.0 * latitude);
            let ring_radius = height * libm::sin(latitude);
            [ring_radius * libm::cos(longitude), ring_radius * libm::sin(longitude), height * libm::cos(latitude)]
                .map(|coordinate| coordinate as f32)
        };
        let mut mesh = Self { vertices: vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], triangles: Vec::new() };
        for ring in 1..rings {
            mesh.vertices.extend((0..columns).map(|column| position(ring, column)));
        }
        let vertex = |ring: u32, column: u32| match ring {
            0 => 0,
            ring if ring == rings => 1,
            ring => 2 + (ring - 1) * columns + column % columns,
        };
        for ring in 0..rings {
            for column in 0..columns {
                let [a, b] = [vertex(ring, column), vertex(ring, column + 1)];
                let [c, d] = [vertex(ring + 1, column), vertex(ring + 1, column + 1)];
                if ring > 0 {
                    mesh.triangles.push([a, c, b]);
                }
                if ring + 1 < rings {
                    mesh.triangles.push([b, c, d]);
                }
            }
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn a_globe_is_closed_and_right_side_out() {
        let globe = Mesh::globe(9);
        assert_eq!(globe.triangles.len(), 4 * 9 * 8);
        let mut edges = HashMap::new();
        let mut volume = 0.0;
        for &[a, b, c] in &globe.triangles {
            [(a, b), (b, c), (c, a)].into_iter().for_each(|edge| *edges.entry(edge).or_insert(0) += 1);
            let [a, b, c] = [a, b, c].map(|index| glam::Vec3::from(globe.vertices[index as usize]));
            volume += a.dot(b.cross(c)) / 6.0;
        }
        assert!(edges.iter().all(|(&(a, b), &count)| count == 1 && edges.contains_key(&(b, a))));
        assert!((3.0..5.0).contains(&volume), "{volume}");
    }
}
