//! Touches of many other shapes: as of one object, each shape being an instance.

use crate::error::Result;
use crate::in_order::in_order;
use crate::touches::{ObjectTouches, Origin};

/// Touches of each shape that are captured.
const TOUCHES: u64 = 300;

/// Captures `count` shapes of [`builtin::background`](crate::mesh::builtin::background) as a data set was captured: with
/// its probe, aim and scale, with poses and with approaches where it holds them. Usually
/// [`BACKGROUND_SHAPES`](crate::mesh::builtin::BACKGROUND_SHAPES) of them.
///
/// # Errors
/// Errors of a capture; all shapes can be touched at usual settings.
pub fn captured(count: usize, origin: &Origin, progress: &dyn crate::progress::Progress) -> Result<ObjectTouches> {
    use crate::capture::Sampler;
    use crate::mesh::builtin::background;
    use crate::probe::Scene;
    use palpate_shared::Touch;
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
    let each = in_order(instances.par_iter().map(of))?;
    let whole = || instances.iter().zip(&each).filter(|(_, touches)| touches.len() == TOUCHES as usize);
    let names: Vec<String> = whole().map(|(instance, _)| instance.name.clone()).collect();
    let touches = (0..TOUCHES as usize).flat_map(|sample| whole().map(move |(_, touches)| touches[sample])).collect();
    Ok(ObjectTouches::in_turn(&object.name, touches, &names, 0))
}
