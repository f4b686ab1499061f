//! A capture that stays in memory.

use super::pipeline::too_few_threads;
use super::{Sampler, Settings, scenes, sources};
use crate::error::Result;
use crate::in_order::in_order;
use crate::mesh::Object;
use crate::progress::{self, Progress};
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Touch;
use rayon::prelude::*;
use std::ops::Range;

/// Number of samples drawn between two updates of the progress.
const CHUNK: u64 = 256;

/// Touches the objects as [`capture`](super::capture) does, and returns what reading its directory would: the same touches,
/// with a pose only where the capture would write one. The second value says how many
/// approaches each object took, in the data set's order. Settings about directories are ignored.
///
/// # Errors
/// When a setting is wrong or a mesh cannot be touched; [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn in_memory(objects: &[Object], settings: &Settings, progress: &dyn Progress) -> Result<(Dataset, Vec<u64>)> {
    settings.check()?;
    let mut objects: Vec<&Object> = objects.iter().collect();
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    let threads = settings.threads();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| too_few_threads(0, threads, &error))?;
    pool.install(|| touch(&objects, settings, progress))
}

fn touch(objects: &[&Object], settings: &Settings, progress: &dyn Progress) -> Result<(Dataset, Vec<u64>)> {
    let origin = &settings.origin;
    let scenes = scenes(objects, origin, progress)?;
    let samples = origin.samples();
    progress.begin("touching", Some((samples.end - samples.start) * objects.len() as u64));
    let (mut touched, mut approaches) = (Vec::with_capacity(objects.len()), Vec::with_capacity(objects.len()));
    for (object, scenes) in objects.iter().zip(&scenes) {
        let sampler = Sampler::of_instances(scenes, &object.name, origin);
        let chunks: Vec<Range<u64>> =
            samples.clone().step_by(CHUNK as usize).map(|start| start..samples.end.min(start + CHUNK)).collect();
        let chunk = |chunk: Range<u64>| -> Result<Vec<(Touch, u64)>> {
            progress::check(progress)?;
            let count = chunk.end - chunk.start;
            let drawn = chunk.map(|index| sampler.sample(index)).collect::<Result<Vec<_>>>()?;
            progress::advance(progress, count)?;
            Ok(drawn)
        };
        let drawn: Vec<Vec<(Touch, u64)>> = in_order(chunks.into_par_iter().map(chunk))?;
        approaches.push(drawn.iter().flatten().map(|(_, approaches)| approaches).sum());
        let kept = |(touch, _): (Touch, u64)| if origin.pose { touch } else { Touch::new(touch.times()) };
        let touches = drawn.into_iter().flatten().map(kept).collect();
        let sources = sources(object, scenes);
        touched.push(ObjectTouches::in_turn(&object.name, touches, &sources, samples.start).of_origin(origin));
    }
    Ok((Dataset { origin: Some(origin.clone()), ..Dataset::new(touched) }, approaches))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::capture;
    use crate::mesh::Mesh;
    use crate::touches::{Listing, Origin};

    #[test]
    fn a_capture_in_memory_is_what_reading_one_from_the_disk_gives() {
        let objects = [("globe", 1.0), ("disc", 0.1)]
            .map(|(name, height)| Object::new(name, Mesh::globe(12).stretched([1.0, 1.0, height])));
        for origin in [
            Origin { touches: 700, ..Origin::default() },
            Origin {
                touches: 700,
                approaches: true,
                pose: true,
                samples: Some("233..466".parse().unwrap()),
                ..Origin::default()
            },
        ] {
            let directory = tempfile::tempdir().unwrap();
            let settings = Settings { threads: Some(3), ..origin.into() };
            capture(&objects, &settings, directory.path(), &()).unwrap();
            let (dataset, approaches) = in_memory(&objects, &settings, &()).unwrap();
            assert_eq!(dataset, Dataset::read(directory.path()).unwrap());
            let listing = Listing::read(directory.path()).unwrap().unwrap();
            assert_eq!(approaches, listing.objects.iter().map(|entry| entry.approaches).collect::<Vec<_>>());
        }
    }
}
