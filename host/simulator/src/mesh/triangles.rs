//! The triangle mesh itself.

use super::weld::Places;
use crate::error::{Error, Result, problem};
use glam::Vec3;

/// An indexed triangle mesh, in its file's own units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub vertices: Vec<[f32; 3]>,
    /// Triangles as indices into `vertices`, anticlockwise when seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The remedy for a file without a surface.
pub(super) const WITH_FACES: &str = "Export the mesh as a file with faces: OBJ, STL, PLY, GLB or COLLADA.";

/// Each triangle of a mesh is a single point.
pub(crate) fn no_extent() -> Error {
    problem!("the mesh has no extent: each of its faces is a single point").fix(WITH_FACES)
}

/// The problem of a mesh with more vertices than an index can number.
pub(super) fn too_many_vertices() -> Error {
    problem!("the mesh has more than 4294967295 vertices").fix("Simplify the mesh, or export it in parts.")
}

impl Mesh {
    /// The bounding box of the triangles: its lowest and highest corner. Both are zero if there are no triangles.
    ///
    /// # Panics
    /// If a triangle names a vertex that the mesh does not have.
    pub fn bounds(&self) -> [Vec3; 2] {
        let corners = self.triangles.iter().flatten().map(|&i| Vec3::from(self.vertices[i as usize]));
        corners.map(|v| [v, v]).reduce(|[low, high], [v, _]| [low.min(v), high.max(v)]).unwrap_or([Vec3::ZERO; 2])
    }

    /// A checksum (CRC-64 XZ) of vertices and triangles: it identifies the mesh regardless of the files it was read from.
    pub fn checksum(&self) -> u64 {
        const CRC: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
        let mut digest = CRC.digest();
        digest.update(&(self.vertices.len() as u64).to_le_bytes());
        self.vertices.iter().flatten().for_each(|coordinate| digest.update(&coordinate.to_bits().to_le_bytes()));
        self.triangles.iter().flatten().for_each(|index| digest.update(&index.to_le_bytes()));
        digest.finalize()
    }

    /// The mesh with vertices at the same place (closer than a billionth of the longest side) merged into one, without the
    /// triangles that thereby lose a corner. Files often repeat a vertex for each triangle, and some round it differently;
    /// merged, neighbors share their edges.
    ///
    /// # Panics
    /// If a triangle names a vertex that the mesh does not have.
    pub fn welded(&self) -> Self {
        let mut places = Places::new(self.bounds());
        let merged: Vec<u32> = self.vertices.iter().map(|&vertex| places.of(vertex)).collect();
        let triangles = self.triangles.iter().map(|triangle| triangle.map(|i| merged[i as usize]));
        let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        Self { vertices: places.vertices, triangles }
    }

    /// The mesh without the triangles whose corners are one point: they are no surface. Left in, they could still be
    /// touched where they float, and would stretch the bounding box.
    ///
    /// # Errors
    /// Without triangles, and if none is left.
    pub(super) fn usable(mut self) -> Result<Self> {
        self.check_faces()?;
        let Self { vertices, triangles } = &mut self;
        let vertex = |index: u32| vertices[index as usize];
        triangles.retain(|&[a, b, c]| vertex(a) != vertex(b) || vertex(b) != vertex(c));
        if triangles.is_empty() { Err(no_extent()) } else { Ok(self) }
    }

    /// Refuses a mesh without triangles.
    pub(crate) fn check_faces(&self) -> Result<()> {
        if self.triangles.is_empty() { Err(problem!("the mesh has no faces").fix(WITH_FACES)) } else { Ok(()) }
    }

    /// The place of the vertex of this index, which a triangle names.
    ///
    /// # Errors
    /// If the vertex is missing or not finite.
    pub(crate) fn vertex(&self, index: u32) -> Result<Vec3> {
        const FINITE: &str = "Give a mesh whose faces have finite vertices.";
        let vertex = self.vertices.get(index as usize).map(|vertex| Vec3::from(*vertex));
        let vertex = vertex.ok_or_else(|| {
            let vertices = self.vertices.len();
            problem!("vertex {index} of the mesh is missing: it has {vertices} vertices, counted from 0").fix(FINITE)
        })?;
        let not_finite = || problem!("vertex {index} of the mesh is not finite").fix(FINITE);
        vertex.is_finite().then_some(vertex).ok_or_else(not_finite)
    }

    /// A globe with hills, for tests and benchmarks that need a mesh of a certain size: closed, right side out, about 2
    /// units wide, with 4 · `rings` · (`rings` − 1) triangles; none for fewer than 2 rings.
    ///
    /// # Panics
    /// If `rings` is more than 40,000: indices would not fit in a `u32`.
    pub fn globe(rings: u32) -> Self {
        assert!(rings <= 40_000, "a globe of {rings} rings has too many vertices");
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

    /// The mesh with each axis scaled.
    #[must_use]
    pub fn stretched(mut self, factors: [f32; 3]) -> Self {
        self.vertices.iter_mut().for_each(|vertex| (0..3).for_each(|axis| vertex[axis] *= factors[axis]));
        self
    }
}
