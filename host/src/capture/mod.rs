//! Virtual touches of objects, as many as wanted.
//!
//! Sample i of an object is a pure function of (seed, object's name, i) ([`Sampler`]), so neither the number of threads
//! nor a division into [parts](crate::touches::Samples) changes a touch. Producers compute chunks of samples, one writer puts
//! them on the disk in order, and bounded channels between them keep the memory flat (`pipeline`). The data set's directory
//! appears as a whole or not at all.
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

mod memory;
mod pipeline;
mod sample;
#[cfg(test)]
mod table_tests;
#[cfg(test)]
mod tests;

use crate::error::{Error, Kind, Place, Result, problem};
use crate::in_order::in_order;
use crate::mesh::{Instance, Object, placements};
use crate::probe::approach::FINGERS;
use crate::probe::scene::{Scene, Table};
use crate::progress::{self, Progress};
use crate::touches::{Entry, Listing, ObjectTouches, Origin, PoolFile, Source, Writer, write_touch};
use crate::wording::first_ten;
use palpate_shared::Touch;
use palpate_shared::format::Length;
use rayon::prelude::*;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub use memory::in_memory;
pub use sample::Sampler;

/// Settings of a capture.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Origin of the touches.
    pub origin: Origin,
    /// Replace simulated touches in the directory, however they were made; what else is in it stays.
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
    /// [`Kind::Setting`] naming the field.
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

/// Results of a capture for one object.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct ObjectSummary {
    /// The object's name.
    pub name: String,
    /// Number of touches.
    pub touches: u64,
    /// Number of approaches that they took.
    pub approaches: u64,
    /// Contacts of each finger that came later than the stroke, and are missing; where only full touches are kept, in
    /// approaches in which all fingers would have touched.
    pub late: [u64; FINGERS],
    /// Number of approaches in which a finger touched; if only full touches are kept, of full touches.
    pub touching: u64,
    /// Number of approaches that ended before the first contact, at the end of the travel.
    pub turned_back: u64,
    /// Duration for the object, in seconds.
    pub seconds: f64,
}

impl ObjectSummary {
    /// Adds the counts of more touches.
    fn add(&mut self, more: &Self) {
        self.touches += more.touches;
        self.approaches += more.approaches;
        self.late.iter_mut().zip(more.late).for_each(|(late, more)| *late += more);
        self.touching += more.touching;
        self.turned_back += more.turned_back;
    }
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

/// Touches the objects and writes `DIR/<object>.txt` for each, or a file for each of its instances or placements
/// (`DIR/<object>/1.txt` and so on), and `DIR/dataset.json`. The directory appears when all is done.
/// The same capture may be repeated.
///
/// # Errors
/// When a setting is wrong, a mesh cannot be touched, the directory cannot be written, or it holds anything else and
/// [`Settings::force`] is not set, or recorded touches; [`Kind::Cancelled`] if `progress` cancels it.
pub fn capture(objects: &[Object], settings: &Settings, directory: &Path, progress: &dyn Progress) -> Result<Summary> {
    let start = Instant::now();
    let (objects, scenes) = sampled(objects, settings, progress)?;
    let samplers = samplers(&objects, &scenes, &settings.origin);
    untouched(&samplers, &settings.origin).map_or(Ok(()), Err)?;
    let entry = |(object, scenes): (&&Object, &Vec<Scene>)| entry(object, scenes, &settings.origin);
    let entries: Vec<Entry> = objects.iter().zip(&scenes).map(entry).collect();
    let listing = Listing { objects: entries.clone(), ..Listing::new(&settings.origin, []) };
    let replaced = replaced(directory, &listing, settings.force)?;
    let mut writer = Writer::begin(directory, listing)?;
    let pools = |object: usize| entries[object].pools.len();
    // Touches of sources in turn, as lines of each.
    let to_lines = |object: usize, samples: Range<u64>, touches: Vec<Touch>| {
        let mut pools = vec![(String::new(), 0); pools(object)];
        for (sample, touch) in samples.zip(&touches) {
            let turn = (sample % pools.len() as u64) as usize;
            write_touch(&mut pools[turn].0, touch, settings.origin.pose);
            pools[turn].1 += 1;
        }
        pools
    };
    let to_files = |object: usize, chunks: &mut pipeline::Chunks<'_, Vec<(String, u64)>>| {
        let mut files = writer.object(object)?;
        let mut approaches = 0;
        for chunk in chunks {
            let pipeline::Chunk { packed, counts } = chunk?;
            approaches += counts.approaches;
            for (pool, (lines, touches)) in packed.into_iter().enumerate() {
                files.write(pool, &lines, touches)?;
            }
        }
        files.close(approaches)
    };
    let objects = pipeline::run(&samplers, settings, to_lines, to_files, progress)?;
    writer.finish(true, &replaced)?;
    Ok(Summary { objects, seconds: start.elapsed().as_secs_f64() })
}

/// The files in the directory that a capture with this listing replaces, by their paths in it.
///
/// # Errors
/// When recorded touches are there; [`Kind::Exists`] if something else than this capture's own touches is there, unless it is
/// forced.
fn replaced(directory: &Path, wanted: &Listing, force: bool) -> Result<Vec<PathBuf>> {
    let found = match Listing::read(directory) {
        // What cannot be read says nothing of other files.
        Err(error) if force && !error.is(&Kind::Io) => None,
        found => found?,
    };
    let mut own = vec![PathBuf::from(Listing::FILE)];
    if let Some(found) = &found {
        if found.is_recorded() {
            // No capture could make them again.
            let touches: u64 = found.objects.iter().map(Entry::touches).sum();
            return Err(problem!("holds {touches} recorded touches of {}", first_ten(&found.names()))
                .fix("Give another directory: recorded and simulated touches are not mixed.")
                .at(Place::file(directory)));
        }
        own.extend(found.paths(Path::new("")));
    }
    // Regardless of the version, and of what only the capture tells.
    let stated = |listing: &Listing| {
        let pool = |pool: &PoolFile| PoolFile { touches: 0, crc32: None, ..pool.clone() };
        let of = |entry: &Entry| {
            let pools = entry.pools.iter().map(pool).collect();
            Entry { approaches: 0, pools, ..entry.clone() }
        };
        (listing.origin.clone(), listing.objects.iter().map(of).collect::<Vec<_>>())
    };
    let is_same = found.is_some_and(|found| stated(&found) == stated(wanted));
    let mut others = Vec::new();
    list_others(directory, Path::new(""), if is_same { &own } else { &[] }, &mut others)?;
    others.sort();
    if !force && !others.is_empty() {
        return Err(problem!("holds {}, which this capture would not write", first_ten(&others))
            .fix("Give another directory, move these away, or replace the touches that are there.")
            .as_kind(Kind::Exists)
            .at(Place::file(directory)));
    }
    Ok(own)
}

/// Appends what the directory `inner` below `directory` holds besides these files.
fn list_others(directory: &Path, inner: &Path, own: &[PathBuf], others: &mut Vec<String>) -> Result<()> {
    let io = |source| Error::io(directory, "list", source);
    let entries = match std::fs::read_dir(directory.join(inner)) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(io)?,
    };
    for entry in entries {
        let path = inner.join(entry.map_err(io)?.file_name());
        if own.contains(&path) {
            continue;
        }
        match own.iter().any(|own| own.starts_with(&path)) {
            true => list_others(directory, &path, own, others)?,
            false => others.push(path.to_string_lossy().into_owned()),
        }
    }
    Ok(())
}

/// The objects of these that cannot be touched with all fingers, as [`Kind::Untouchable`]; none if all can, or if every approach
/// is kept.
///
/// # Errors
/// Errors of [`scenes`].
pub fn untouchable(objects: &[Object], origin: &Origin, progress: &dyn Progress) -> Result<Option<Error>> {
    let objects: Vec<&Object> = objects.iter().collect();
    let scenes = scenes(&objects, origin, progress)?;
    Ok(untouched(&samplers(&objects, &scenes, origin), origin))
}

/// The objects of a capture, sorted by name, and their scenes.
fn sampled<'o>(
    objects: &'o [Object],
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Vec<&'o Object>, Vec<Vec<Scene>>)> {
    settings.check()?;
    let mut objects: Vec<&Object> = objects.iter().collect();
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    let scenes = scenes(&objects, &settings.origin, progress)?;
    Ok((objects, scenes))
}

/// A sampler of each object.
fn samplers<'a>(objects: &[&'a Object], scenes: &'a [Vec<Scene>], origin: &'a Origin) -> Vec<Sampler<'a>> {
    let of = |(object, scenes): (&&'a Object, &'a Vec<Scene>)| Sampler::of_instances(scenes, &object.name, origin);
    objects.iter().zip(scenes).map(of).collect()
}

fn untouched(samplers: &[Sampler<'_>], origin: &Origin) -> Option<Error> {
    if origin.approaches {
        return None;
    }
    let objects: Vec<_> = samplers.par_iter().filter_map(Sampler::untouched).collect();
    (!objects.is_empty()).then(|| sample::untouchable(&objects, origin))
}

/// Entry of the listing for an object before it is touched.
fn entry(object: &Object, scenes: &[Scene], origin: &Origin) -> Entry {
    let sources = match &sources(object, scenes)[..] {
        [] => vec![Source::Object],
        sources => sources.to_vec(),
    };
    Entry {
        meshes: object.instances().map(|instance| format!("{:016x}", instance.mesh.checksum())).collect(),
        millimeters: object.millimeters.filter(|_| origin.unit == Length::Millimeter),
        ..Entry::of(&object.name, sources.iter().map(|source| (source, None)))
    }
}

/// The names of an object's instances, if it has several.
fn named(object: &Object) -> Vec<String> {
    let has_several = object.instances().len() > 1;
    object.instances().filter(|_| has_several).map(|instance| instance.name.clone()).collect()
}

/// An error of an object's mesh, with the object's name.
pub(crate) fn in_object(object: &Object, error: Error) -> Error {
    error.within(format_args!("{}: ", object.name))
}

/// The scenes of each object, built side by side: one for each instance or, on a table, for each placement of each instance.
///
/// # Errors
/// A mesh that makes no scene, by its object's name.
pub fn scenes(objects: &[&Object], origin: &Origin, progress: &dyn Progress) -> Result<Vec<Vec<Scene>>> {
    let length = |(object, instance): (&Object, &Instance)| -> Result<f64> {
        let length = origin.length_of(object, instance)?;
        // A mesh without extent is refused below, with a better reason. Rotated, its box may be longer.
        if length > 0.0 {
            let longest = if origin.scene.is_floating() { length } else { length * 3_f64.sqrt() };
            origin.probe.check(longest)?;
        }
        Ok(length)
    };
    let floating = |(object, instance): (&Object, &Instance)| {
        progress::check(progress)?;
        Scene::new(&instance.mesh, length((object, instance))?).map_err(|error| in_object(object, error))
    };
    let on_table = |object: &Object, cone: f64| -> Result<Vec<Scene>> {
        let placements = placements::of_object(object).map_err(|error| in_object(object, error))?;
        let mut scenes = Vec::new();
        for (number, (instance, placements)) in object.instances().zip(&placements).enumerate() {
            progress::check(progress)?;
            let length = length((object, instance))?;
            for placements::Placement { name, weight, rotation } in &placements.placements {
                let table = Table { instance: number, placement: name.clone(), weight: *weight, cone };
                let scene = Scene::on_table(&instance.mesh, length, *rotation, table);
                scenes.push(scene.map_err(|error| in_object(object, error))?);
            }
        }
        Ok(scenes)
    };
    let of = |object: &&Object| match origin.scene.cone() {
        None => {
            let instances: Vec<&Instance> = object.instances().collect();
            in_order(instances.into_par_iter().map(|instance| floating((object, instance))))
        }
        Some(cone) => on_table(object, cone),
    };
    in_order(objects.par_iter().map(of))
}

/// Sources of the touches of an object's scenes, in turn: its instances, if it has several, or its placements.
pub(crate) fn sources(object: &Object, scenes: &[Scene]) -> Vec<Source> {
    sources_of(&named(object), scenes)
}

fn sources_of(instances: &[String], scenes: &[Scene]) -> Vec<Source> {
    let placement = |scene: &Scene| {
        scene
            .table()
            .map(|table| Source::placed(instances.get(table.instance).cloned(), table.placement.clone(), table.weight))
    };
    let placements: Vec<Source> = scenes.iter().filter_map(placement).collect();
    if placements.is_empty() { instances.iter().cloned().map(Source::Instance).collect() } else { placements }
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
    Ok(ObjectTouches::in_turn(name, touches, &numbered(scenes), first).of_origin(origin))
}

/// Sources of the touches of an object's scenes, in turn, where the names of its instances are not known: they are called by
/// their numbers.
pub fn numbered(scenes: &[Scene]) -> Vec<Source> {
    let instance = |(index, scene): (usize, &Scene)| scene.table().map_or(index, |table| table.instance);
    let count = scenes.iter().enumerate().map(instance).max().map_or(0, |last| last + 1);
    let names: Vec<String> = (1..=count).filter(|_| count > 1).map(|number| number.to_string()).collect();
    sources_of(&names, scenes)
}
