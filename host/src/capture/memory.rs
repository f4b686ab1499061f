//! A capture that stays in memory.

use super::pipeline::{self, Chunks};
use super::{Settings, sampled, samplers, sources};
use crate::error::Result;
use crate::mesh::Object;
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Touch;

/// Touches the objects as [`capture`](super::capture) does, and returns what reading its directory would: the same touches,
/// with a pose only where the capture would write one. The second value says how many
/// approaches each object took, in the data set's order. Settings about directories are ignored.
///
/// # Errors
/// When a setting is wrong or a mesh cannot be touched; [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn in_memory(objects: &[Object], settings: &Settings, progress: &dyn Progress) -> Result<(Dataset, Vec<u64>)> {
    let (objects, scenes) = sampled(objects, settings, progress)?;
    let samplers = samplers(&objects, &scenes, &settings.origin);
    let mut all = Vec::with_capacity(objects.len());
    let to_memory = |_: usize, chunks: &mut Chunks<'_, Vec<Touch>>| {
        let mut touches = Vec::new();
        for chunk in chunks {
            touches.extend(chunk?.packed);
        }
        all.push(touches);
        Ok(())
    };
    let summaries = pipeline::run(&samplers, settings, |_, _, touches| touches, to_memory, progress)?;
    let (origin, first) = (&settings.origin, settings.origin.samples().start);
    let touched = objects.iter().zip(&scenes).zip(all).map(|((object, scenes), touches)| {
        ObjectTouches::in_turn(&object.name, touches, &sources(object, scenes), first).of_origin(origin)
    });
    let touched = touched.collect();
    let approaches = summaries.iter().map(|summary| summary.approaches).collect();
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
