//! The objects' surfaces, small enough for a page.

use crate::page::scene::SimplifiedMesh;
use palpate::error::Result;
use palpate::in_order::in_order;
use palpate::mesh::{Mesh, Object};
use palpate::play::{pack, unpack};
use palpate::touches::Origin;
use rayon::prelude::*;

/// Largest size of all packed meshes of a page, in bytes. As text a third more.
const MOST_BYTES: usize = 1_300_000;

/// The most triangles of an object to begin with.
const MOST_TRIANGLES: usize = 120_000;

/// An object as a page holds it.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name.
    pub name: String,
    /// The longest side of its bounding box, in units.
    pub length: f64,
    /// The mesh, packed: what is drawn and what is touched.
    pub packed: Vec<u8>,
    /// Its triangles.
    pub triangles: usize,
    /// Triangles of the object's own mesh.
    pub of: usize,
    /// Number of meshes of the object; this is the first.
    pub instances: usize,
}

impl Surface {
    /// The mesh that the page touches.
    pub fn mesh(&self) -> Mesh {
        unpack(&self.packed).unwrap_or_default()
    }
}

/// The surfaces of objects: of each the first mesh, its corners on a grid of 2¹⁶ steps along the longest side. Where all of
/// them would take more than 1.3 MB, the largest are simplified until they do not.
///
/// # Errors
/// When an object is to have its true size, and that is not known.
pub fn surfaces(objects: &[Object], origin: &Origin) -> Result<Vec<Surface>> {
    let mut most = MOST_TRIANGLES;
    loop {
        let surface = |object: &Object| surface(object, origin, most);
        let surfaces = in_order(objects.par_iter().map(surface))?;
        let bytes: usize = surfaces.iter().map(|surface| surface.packed.len()).sum();
        let largest = surfaces.iter().map(|surface| surface.triangles).max().unwrap_or(0);
        // Hundreds of objects may not fit: then the page is larger.
        if bytes <= MOST_BYTES || largest <= 500 {
            return Ok(surfaces);
        }
        let share = (MOST_BYTES as f64 / bytes as f64).clamp(0.5, 0.95);
        most = (most.min(largest) as f64 * share) as usize;
    }
}

fn surface(object: &Object, origin: &Origin, most: usize) -> Result<Surface> {
    let length = super::length(object, origin)?;
    let mesh = SimplifiedMesh::with_at_most(object.mesh(), length, most);
    Ok(Surface {
        name: object.name.clone(),
        length,
        packed: pack(&mesh.points, &mesh.triangles),
        triangles: mesh.triangles.len(),
        of: object.mesh().triangles.len(),
        instances: object.instances().len(),
    })
}
