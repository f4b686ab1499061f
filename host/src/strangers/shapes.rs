//! Touches of many other shapes.

use crate::error::Result;
#[cfg(feature = "objects")]
use crate::touches::Origin;
use crate::touches::{Dataset, Listing};
use palpate_shared::Touch;
use std::path::Path;

/// Touches of a number of shapes in turn: touch i is of shape i modulo their number.
#[derive(Clone, Debug, PartialEq)]
pub struct Shapes {
    /// The touches.
    pub touches: Vec<Touch>,
    /// How many shapes.
    pub count: usize,
}

impl Shapes {
    /// The touches of each shape.
    pub(super) fn each(&self) -> impl Iterator<Item = impl Iterator<Item = &Touch>> {
        let count = self.count.max(1);
        (0..count).map(move |shape| self.touches.iter().skip(shape).step_by(count))
    }
}

/// The shapes in a directory that `palpate capture` filled: every instance of every object is one.
///
/// # Errors
/// As [`Dataset::read_any`].
pub fn of_dataset(directory: &Path) -> Result<(Dataset, Vec<Shapes>)> {
    let dataset = Dataset::read_any(directory)?;
    let listing = Listing::read(directory)?;
    let count = |name: &str| {
        let entry = listing.as_ref().and_then(|listing| listing.objects.iter().find(|entry| entry.name == name));
        entry.map_or(1, |entry| entry.instances.len().max(1))
    };
    let shapes =
        dataset.objects.iter().map(|object| Shapes { touches: object.touches.clone(), count: count(&object.name) });
    let shapes = shapes.collect();
    Ok((dataset, shapes))
}

/// Touches of each shape that are captured.
#[cfg(feature = "objects")]
const TOUCHES: u64 = 300;

/// Captures `count` shapes of [`builtin::background`](crate::mesh::builtin::background) as a data set was captured: with
/// its probe, aim and scale, with poses and with approaches where it holds them. Usually
/// [`BACKGROUND_SHAPES`](crate::mesh::builtin::BACKGROUND_SHAPES) of them.
///
/// # Errors
/// As a capture; none of the shapes cannot be touched at usual settings.
#[cfg(feature = "objects")]
pub fn captured(count: usize, origin: &Origin, progress: &dyn crate::progress::Progress) -> Result<Shapes> {
    use crate::capture::Sampler;
    use crate::mesh::builtin::background;
    use crate::probe::Scene;
    use rayon::prelude::*;

    // Other shapes than a background column is usually trained on.
    let object = background(count, origin.seed.wrapping_add(1_000))?;
    let instances: Vec<_> = object.instances().collect();
    progress.begin("touching other shapes", u64::try_from(instances.len()).ok());
    let of = |instance: &&crate::mesh::Instance| -> Result<Vec<Touch>> {
        crate::progress::advance(progress, 1)?;
        let length = origin.length_of(&object, instance).unwrap_or(origin.length);
        let scene = Scene::new(&instance.mesh, length)?;
        // A shape that only the middle finger can reach has no full touch: it says nothing about those.
        let sampler = Sampler::new(&scene, &instance.name, origin);
        Ok((0..TOUCHES).map_while(|sample| sampler.sample(sample).ok()).map(|(touch, _)| touch).collect())
    };
    let each: Vec<Vec<Touch>> = instances.par_iter().map(of).collect::<Result<_>>()?;
    let whole: Vec<Vec<Touch>> = each.into_iter().filter(|touches| touches.len() == TOUCHES as usize).collect();
    let touches = (0..TOUCHES as usize).flat_map(|sample| whole.iter().map(move |touches| touches[sample])).collect();
    Ok(Shapes { touches, count: whole.len() })
}
