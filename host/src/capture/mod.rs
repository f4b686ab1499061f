//! Virtual touches of objects, as many as wanted.
//!
//! Sample i of an object is a pure function of (seed, object's name, i) ([`Sampler`]), so neither the number of threads
//! nor shards nor an interruption changes a data set. Producers compute chunks of samples, one writer puts them on the
//! disk in order, and bounded channels between them keep the memory flat (`pipeline`). What is on the disk is
//! checkpointed every half second, so that an interrupted capture can be resumed (`store`). A capture never replaces
//! touches that it would not write itself, unless it is told to (`admission`).
//!
//! ```
//! use palpate::capture::{self, capture};
//! use palpate::mesh::builtin;
//! use palpate::touches::{Dataset, Origin};
//!
//! # fn main() -> palpate::Result<()> {
//! let directory = tempfile::tempdir().expect("a directory for temporary files");
//! let objects = [builtin::one("bowl")?, builtin::one("mouse")?];
//! let settings: capture::Settings = Origin { touches: 100, pose: true, ..Origin::default() }.into();
//! let summary = capture(&objects, &settings, directory.path(), &())?;
//! assert!(summary.approaches() > summary.touches());
//!
//! let dataset = Dataset::read(directory.path())?;
//! assert_eq!(dataset.names(), ["bowl", "mouse"]);
//! assert_eq!(dataset.probe().map(|probe| probe.spacing), Some(1.5));
//! # Ok(())
//! # }
//! ```

mod admission;
mod error;
mod memory;
mod pipeline;
mod sample;
mod store;
#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use crate::in_order::in_order;
use crate::mesh::{Instance, Object};
use crate::probe::approach::FINGERS;
use crate::probe::scene::Scene;
use crate::progress::{self, Progress};
use crate::touches::{Entry, ObjectTouches, Origin};
pub use error::CaptureProblem;
use palpate_shared::format::Length;
use rayon::prelude::*;
use std::ops::Range;
use std::path::Path;
use std::time::Instant;

pub use memory::in_memory;
pub use sample::{Drawn, MOST_ATTEMPTS, Sampler};

/// Settings of a capture, and how it treats what is already there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Origin of the touches.
    pub origin: Origin,
    /// Go on where an interrupted capture into the same directory stopped.
    pub resume: bool,
    /// Add objects to the data set in the directory, which must have been made in the same way.
    pub add: bool,
    /// Replace the data set in the directory, whatever it holds. Takes precedence over `resume` and `add`.
    pub force: bool,
    /// Number of threads to use, at most 256; by default as many as the machine has.
    pub threads: Option<usize>,
}

impl From<Origin> for Settings {
    fn from(origin: Origin) -> Self {
        Self { origin, ..Self::default() }
    }
}

impl Settings {
    /// Refuses settings that make no capture.
    ///
    /// # Errors
    /// [`Setting`](crate::error::Setting) naming the field.
    pub fn check(&self) -> Result<()> {
        if self.threads == Some(0) {
            return Err(Error::setting("threads", 0, "1 or more, or none for all that the machine has"));
        }
        self.origin.check()
    }

    fn threads(&self) -> usize {
        self.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
    }
}

/// Results of a capture.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Summary {
    /// The objects, sorted by name.
    pub objects: Vec<ObjectSummary>,
    /// Duration in seconds.
    pub seconds: f64,
}

/// Results of a capture for one object, in this run.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ObjectSummary {
    /// The object's name.
    pub name: String,
    /// Number of touches there are now.
    pub touches: u64,
    /// Number of approaches that they took, since the capture was first started.
    pub approaches: u64,
    /// Number of approaches made in this run.
    pub approaches_now: u64,
    /// Contacts of each finger in this run that came later than the stroke, and are missing; see [`Drawn::late`].
    pub late: [u64; FINGERS],
    /// Number of approaches in this run that ended before the first contact, at the end of the travel.
    pub turned_back: u64,
    /// Duration of this run for the object, in seconds.
    pub seconds: f64,
}

impl Summary {
    /// All touches together.
    pub fn touches(&self) -> u64 {
        self.objects.iter().map(|object| object.touches).sum()
    }

    /// All approaches together.
    pub fn approaches(&self) -> u64 {
        self.objects.iter().map(|object| object.approaches).sum()
    }
}

/// Touches the objects and writes `DIR/<object>.txt` (or `.parquet`) for each, and `DIR/dataset.json`.
///
/// # Errors
/// When a setting is wrong, a mesh cannot be touched, the directory cannot be written to, another capture is writing to
/// it, or it holds what this capture would not write; [`Error::Cancelled`] if `progress` cancels it. Whatever was
/// written at the last of the half-second checkpoints can be resumed.
pub fn capture(objects: &[Object], settings: &Settings, directory: &Path, progress: &dyn Progress) -> Result<Summary> {
    settings.check()?;
    let start = Instant::now();
    let mut objects: Vec<&Object> = objects.iter().collect();
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    let scenes = scenes(&objects, &settings.origin, progress)?;
    let samplers: Vec<Sampler<'_>> = objects
        .iter()
        .zip(&scenes)
        .map(|(object, scenes)| Sampler::of_instances(scenes, &object.name, &settings.origin))
        .collect();
    let entries: Vec<Entry> = objects.iter().map(|object| entry(object, &settings.origin)).collect();
    let mut store = store::Store::open(directory, settings, &entries)?;
    let objects = pipeline::run(&samplers, settings, &mut store, progress)?;
    store.finish()?;
    Ok(Summary { objects, seconds: start.elapsed().as_secs_f64() })
}

/// Entry of the listing for an object before it is touched.
fn entry(object: &Object, origin: &Origin) -> Entry {
    let has_several = object.instances().len() > 1;
    Entry {
        name: object.name.clone(),
        instances: object.instances().filter(|_| has_several).map(|instance| instance.name.clone()).collect(),
        meshes: object.instances().map(|instance| format!("{:016x}", instance.mesh.checksum())).collect(),
        millimeters: object.millimeters.filter(|_| origin.unit == Length::Millimeter),
        ..Entry::default()
    }
}

/// The scenes of each object's instances, built side by side.
pub fn scenes(objects: &[&Object], origin: &Origin, progress: &dyn Progress) -> Result<Vec<Vec<Scene>>> {
    let scene = |(object, instance): (&Object, &Instance)| {
        progress::check(progress)?;
        let unknown = || CaptureProblem::NoTrueSize { name: object.name.clone() };
        let length = origin.length_of(object, instance).ok_or_else(unknown)?;
        // A mesh without extent is refused below, with a better reason.
        if length > 0.0 {
            origin.probe.check(length)?;
        }
        Scene::new(&instance.mesh, length).map_err(|error| match error {
            Error::At { problem, .. } => {
                let (detail, fix) = (problem.to_string(), problem.fix());
                CaptureProblem::Object { name: object.name.clone(), detail, fix }.into()
            }
            other => other.in_file(&object.name),
        })
    };
    let of = |object: &&Object| {
        let instances: Vec<&Instance> = object.instances().collect();
        in_order(instances.into_par_iter().map(|instance| scene((object, instance))))
    };
    in_order(objects.par_iter().map(of))
}

/// The touches of one object with these sample numbers, in memory: the same that [`capture`] writes. The object's
/// instances, one scene for each, are touched in turn; they are called by their numbers.
///
/// # Errors
/// When a setting is wrong, or the object cannot be touched with all three fingers.
pub fn touches(scenes: &[Scene], name: &str, origin: &Origin, samples: Range<u64>) -> Result<ObjectTouches> {
    origin.check()?;
    let sampler = Sampler::of_instances(scenes, name, origin);
    let first = samples.start;
    let touches = in_order(samples.into_par_iter().map(|sample| sampler.sample(sample).map(|(touch, _)| touch)))?;
    Ok(ObjectTouches::in_turn(name, touches, &numbered(scenes), first).of_stroke(origin.probe.window()))
}

/// Names for an object's instances of which only the scenes are known.
pub fn numbered(scenes: &[Scene]) -> Vec<String> {
    (1..=scenes.len()).map(|number| number.to_string()).collect()
}
