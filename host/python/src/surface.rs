//! First contacts of spheres with a mesh.

use crate::arrays::{Input, Output, one, triples};
use crate::capture::mesh;
use crate::failure::Failure;
use numpy::ndarray::{Ix1, Ix2};
use palpate::error::Error;
use palpate::glam::DVec3;
use palpate::probe::scene::Scene;
use pyo3::prelude::*;
use rayon::prelude::*;
use std::sync::Arc;

/// A mesh that spheres are cast at: exact first contacts with its triangles, found through a tree of bounding boxes.
///
/// `vertices` are rows of three numbers, in any unit, and are kept as float32; `faces` are rows of three positions among
/// them.
///
/// >>> import palpate
/// >>> square = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
/// >>> surface = palpate.Surface(square, [[0, 1, 2], [0, 2, 3]])
/// >>> surface.first_contact([[0, 0, 5], [9, 9, 5]], [[0, 0, -1]], radius=0.5)
/// array([4.5, nan])
#[pyo3::pyclass(frozen, module = "palpate._native")]
pub(crate) struct Surface {
    scene: Arc<Scene>,
}

/// With fewer casts than this the lock is kept, and one thread does it all.
const FEW: usize = 64;

/// Number of casts between two checks for signals.
const BATCH: usize = 1 << 16;

#[pyo3::pymethods]
impl Surface {
    #[new]
    fn new(py: Python<'_>, vertices: Input<'_, f32, Ix2>, faces: Input<'_, i64, Ix2>) -> Result<Self, Failure> {
        let mesh = mesh(&vertices, &faces)?;
        let scene = py.detach(|| Scene::as_is(&mesh))?;
        Ok(Self { scene: Arc::new(scene) })
    }

    /// First contact of a sphere that starts at each origin and moves along its direction: the t at which its center is
    /// at origin + t * direction; 0 if it starts in contact, NaN if it never touches. One row of `directions` serves all.
    fn first_contact<'py>(
        &self,
        py: Python<'py>,
        origins: Input<'py, f64, Ix2>,
        directions: Input<'py, f64, Ix2>,
        radius: f64,
    ) -> Result<Output<'py, f64, Ix1>, Failure> {
        let (origins, directions) = (triples(&origins, "origins")?, triples(&directions, "directions")?);
        if directions.len() != origins.len() && directions.len() != 1 {
            let (found, wanted) = (directions.len(), origins.len());
            return Err(Error::setting("directions", format!("{found} rows"), format!("1 row or {wanted}")).into());
        }
        if !(radius.is_finite() && radius >= 0.0) {
            return Err(Error::setting("radius", radius, "a number of 0 or more").into());
        }
        let scene = &self.scene;
        let cast = |index: usize| {
            let direction = directions.get(index).unwrap_or(&directions[0]);
            let contact = scene.first_contact(DVec3::from(origins[index]), DVec3::from(*direction), radius);
            contact.unwrap_or(f64::NAN)
        };
        if origins.len() < FEW {
            return Ok(one(py, (0..origins.len()).map(cast).collect()));
        }
        let mut times = vec![0.0; origins.len()];
        for (number, part) in times.chunks_mut(BATCH).enumerate() {
            py.check_signals()?;
            py.detach(|| {
                let slots = part.par_iter_mut().enumerate().with_min_len(16);
                slots.for_each(|(index, time)| *time = cast(number * BATCH + index));
            });
        }
        Ok(one(py, times))
    }

    /// The lowest and the highest corner of the bounding box.
    #[getter]
    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let [low, high] = self.scene.bounds();
        (low.to_array(), high.to_array())
    }

    /// The number of triangles.
    #[getter]
    fn triangles(&self) -> usize {
        self.scene.triangles().len()
    }

    fn __repr__(&self) -> String {
        format!("Surface({} triangles)", self.scene.triangles().len())
    }
}
