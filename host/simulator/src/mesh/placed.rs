//! Meshes that a file places by transforms, some of them several times: common code of the readers of scenes.

use super::Mesh;
use super::exact::{Moved, step_of_decimals, step_of_f32};
use super::triangles::too_many_vertices;
use super::words::not_finite;
use crate::error::{Error, Result, problem};
use glam::{DAffine3, DVec3};

/// The mesh of a scene, grown instance by instance, never beyond a bound that the length of the file sets: a file of a few
/// kilobytes could place meshes a trillion times.
#[derive(Debug)]
pub(super) struct Placed {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// The step in which 32-bit numbers round the coordinates.
    step: f64,
    /// The most bytes that vertices and triangles may take.
    limit: u64,
}

impl Placed {
    /// An empty scene of a file of `length` bytes. With the growth of vectors, its mesh, and one that is to be placed, take
    /// less than 192 bytes for each byte of the file and 768 KB.
    pub(super) fn new(length: u64) -> Self {
        Self { vertices: Vec::new(), triangles: Vec::new(), step: 0.0, limit: (3 << 16) + 48 * length }
    }

    /// Refuses a mesh if its vertices or triangles would make the scene too large.
    pub(super) fn check(&self, vertices: usize, triangles: usize) -> Result<()> {
        let sum = |own: usize, more: usize| own as u64 + more as u64;
        let bytes = 24 * sum(self.vertices.len(), vertices) + 12 * sum(self.triangles.len(), triangles);
        if bytes > self.limit { Err(too_large(self.limit)) } else { Ok(()) }
    }

    /// Appends a mesh, placed by `transform`: `vertices`, and triangles among them. A transform that mirrors turns the
    /// triangles, so that outside stays outside.
    ///
    /// # Errors
    /// If the scene becomes too large, or a vertex is not finite. The triangles' indices must be in range.
    pub(super) fn place(
        &mut self,
        vertices: impl ExactSizeIterator<Item = DVec3>,
        triangles: &[[u32; 3]],
        transform: &DAffine3,
    ) -> Result<()> {
        self.check(vertices.len(), triangles.len())?;
        let Self { vertices: own, triangles: all, .. } = self;
        let base = u32::try_from(own.len()).map_err(|_| too_many_vertices())?;
        u32::try_from(own.len() + vertices.len()).map_err(|_| too_many_vertices())?;
        for vertex in vertices {
            // As it stands where nothing moves it, every bit.
            let place = if *transform == DAffine3::IDENTITY { vertex } else { transform.transform_point3(vertex) };
            for (axis, value) in ['x', 'y', 'z'].into_iter().zip(place.as_vec3().to_array()) {
                if !value.is_finite() {
                    return Err(not_finite(axis, value.to_string()));
                }
            }
            own.push(place.to_array());
        }
        let mirrors = transform.matrix3.determinant() < 0.0;
        all.extend(triangles.iter().map(|&[a, b, c]| if mirrors { [a, c, b] } else { [a, b, c] }.map(|i| base + i)));
        Ok(())
    }

    /// Takes note of 32-bit numbers in which the file holds vertices that `transform` places.
    pub(super) fn note_f32(&mut self, vertices: &[[f32; 3]], transform: &DAffine3) {
        let longest = transform.matrix3.to_cols_array_2d().map(|axis| DVec3::from(axis).length());
        let step = step_of_f32(vertices.iter().map(|vertex| vertex.map(f64::from)));
        self.step = self.step.max(step * DVec3::from(longest).max_element());
    }

    /// The mesh of the whole scene.
    pub(super) fn into_mesh(self) -> Moved {
        let step = self.step.max(step_of_decimals(&self.vertices, &self.triangles));
        let (mesh, moved) = Mesh::from_f64(&self.vertices, self.triangles);
        (mesh, moved, step)
    }
}

/// A mesh, placed as often as its file says, is too large for a file of its length; or a pipe does not end.
pub(super) fn too_large(limit: u64) -> Error {
    problem!("the mesh would take more than {limit} bytes")
        .fix("Simplify the mesh, or export it without instances or in parts.")
}
