//! Virtual touches of objects, as many as wanted.
//!
//! Sample i of an object is a pure function of (seed, object's name, i) (`sample`), so neither the number of threads
//! nor shards nor an interruption changes a data set. Producers compute chunks of samples, one writer puts them on the
//! disk in order, and bounded channels between them keep the memory flat (`pipeline`). What is on the disk is
//! accounted for every half second, so that an interrupted capture can be resumed (`store`).

mod pipeline;
mod sample;
mod store;

use crate::error::{Error, Result};
use crate::mesh::Object;
use crate::probe::approach::Probe;
use crate::probe::scene::Scene;
use crate::progress::Progress;
use crate::touches::Format;
use palpate_shared::Touch;
use rayon::prelude::*;
use std::ops::Range;
use std::path::Path;
use std::time::Instant;

pub use sample::{MOST_ATTEMPTS, Sampler};

/// How objects are touched. The default is the published method: 21,000 full touches an object, longest side 10 units.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// How many touches of each object; with `approaches`, how many approaches.
    pub touches: u64,
    /// The seed of all that is random.
    pub seed: u64,
    /// The longest side of an object's bounding box, in units.
    pub length: f64,
    /// The probe's measures.
    pub probe: Probe,
    /// Whether the probe's direction and alignment are written too.
    pub pose: bool,
    /// Whether every approach is kept, not only full touches: sample i is then approach i.
    pub approaches: bool,
    /// How the touches are kept; Parquet keeps the pose in any case.
    pub format: Format,
    /// Which part of the samples to compute.
    pub shard: Shard,
    /// Whether to go on where an interrupted capture into the same directory stopped.
    #[serde(skip)]
    pub resume: bool,
    /// How many threads to use; all that the machine has by default.
    #[serde(skip)]
    pub threads: Option<usize>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            touches: 21_000,
            seed: 1,
            length: 10.0,
            probe: Probe::default(),
            pose: false,
            approaches: false,
            format: Format::Text,
            shard: Shard::WHOLE,
            resume: false,
            threads: None,
        }
    }
}

impl Settings {
    /// Refuses settings that make no capture.
    ///
    /// # Errors
    /// [`Error::Argument`] naming the setting.
    pub fn check(&self) -> Result<()> {
        if self.touches == 0 {
            return Err(Error::argument("0 touches were asked for", "Ask for at least 1."));
        }
        if self.threads == Some(0) {
            return Err(Error::argument("0 threads were asked for", "Ask for at least 1, or leave the option out."));
        }
        self.format.check()?;
        self.probe.check(self.length)
    }

    /// Whether the pose is written.
    fn writes_pose(&self) -> bool {
        self.pose || self.format == Format::Parquet
    }

    /// The samples that are to be computed: the shard's part of all.
    pub fn samples(&self) -> Range<u64> {
        self.shard.part(self.touches)
    }

    fn threads(&self) -> usize {
        self.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
    }
}

/// One of several equal parts of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Shard {
    number: u64,
    of: u64,
}

impl Shard {
    /// All samples.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    fn part(self, samples: u64) -> Range<u64> {
        let before = |number: u64| u64::try_from(u128::from(samples) * u128::from(number) / u128::from(self.of));
        // At most `samples`, so the conversion cannot fail.
        before(self.number - 1).unwrap_or(samples)..before(self.number).unwrap_or(samples)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}/{}", self.number, self.of)
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    /// Reads `K/N`: the K-th of N parts, counted from 1.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((number, of)) if 1 <= number && number <= of => Ok(Self { number, of }),
            _ => Err(format!("{text:?} is no shard: give K/N with K from 1 to N, like 2/5")),
        }
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

impl TryFrom<String> for Shard {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

/// What a capture did.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Summary {
    /// The objects, sorted by name.
    pub objects: Vec<ObjectSummary>,
    /// How long it took, in seconds.
    pub seconds: f64,
}

/// What a capture did to one object, in this run.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ObjectSummary {
    /// The object's name.
    pub name: String,
    /// How many touches there are now.
    pub touches: u64,
    /// How many approaches it took to get them, since the capture was first started.
    pub approaches: u64,
    /// How many approaches were made in this run.
    pub approaches_now: u64,
    /// How long this run took for the object, in seconds.
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
/// When a setting is wrong, a mesh cannot be touched, the directory cannot be written to or another capture is writing
/// to it. Whatever was written at the last of the half-second accounts can be resumed.
pub fn capture(objects: &[Object], settings: &Settings, directory: &Path, progress: &dyn Progress) -> Result<Summary> {
    settings.check()?;
    let start = Instant::now();
    let scenes = scenes(objects, settings)?;
    let samplers: Vec<Sampler<'_>> =
        objects.iter().zip(&scenes).map(|(object, scene)| Sampler::new(scene, &object.name, settings)).collect();
    let mut store = store::Store::open(directory, settings, objects.iter().map(|object| object.name.clone()))?;
    let objects = pipeline::run(&samplers, settings, &mut store, progress)?;
    store.finish()?;
    Ok(Summary { objects, seconds: start.elapsed().as_secs_f64() })
}

/// The objects' scenes, built side by side.
fn scenes(objects: &[Object], settings: &Settings) -> Result<Vec<Scene>> {
    let scene = |object: &Object| {
        Scene::new(&object.mesh, settings.length)
            .map_err(|error| Error::data(format!("{}: {error}", object.name), "Leave the object out."))
    };
    objects.par_iter().map(scene).collect()
}

/// The touches of one object with these sample numbers, in memory: the same that [`capture`] writes.
///
/// # Errors
/// When a setting is wrong, or the object cannot be touched with all three fingers.
pub fn touches(scene: &Scene, name: &str, settings: &Settings, samples: Range<u64>) -> Result<Vec<Touch>> {
    settings.check()?;
    let sampler = Sampler::new(scene, name, settings);
    samples.into_par_iter().map(|sample| sampler.sample(sample).map(|(touch, _)| touch)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::touches::{Dataset, manifest::Manifest};
    use std::collections::BTreeMap;

    fn objects() -> Vec<Object> {
        let globe = Mesh::globe(12);
        let mut disc = globe.clone();
        disc.vertices.iter_mut().for_each(|vertex| vertex[2] *= 0.1);
        [("disc", disc), ("globe", globe)].map(|(name, mesh)| Object { name: name.into(), mesh }).into()
    }

    fn settings() -> Settings {
        Settings { touches: 1500, threads: Some(2), ..Settings::default() }
    }

    /// The files of a captured data set.
    fn files(settings: &Settings) -> BTreeMap<String, String> {
        let directory = tempfile::tempdir().unwrap();
        capture(&objects(), settings, directory.path(), &()).unwrap();
        read_files(directory.path())
    }

    fn read_files(directory: &Path) -> BTreeMap<String, String> {
        let entries = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap());
        let file = |entry: std::fs::DirEntry| {
            (entry.file_name().into_string().unwrap(), std::fs::read_to_string(entry.path()).unwrap())
        };
        entries.map(file).filter(|(name, _)| name != ".lock").collect()
    }

    #[test]
    fn the_number_of_threads_changes_no_byte() {
        let one = files(&Settings { threads: Some(1), ..settings() });
        assert_eq!(one.keys().collect::<Vec<_>>(), ["dataset.json", "disc.txt", "globe.txt"]);
        assert_eq!(one["disc.txt"].lines().count(), 1500);
        for threads in [2, 7] {
            assert_eq!(files(&Settings { threads: Some(threads), ..settings() }), one);
        }
    }

    #[test]
    fn another_seed_or_name_gives_other_touches() {
        let one = files(&settings());
        let other = files(&Settings { seed: 2, ..settings() });
        assert_ne!(one["disc.txt"], other["disc.txt"]);
        let scene = Scene::new(&objects()[0].mesh, 10.0).unwrap();
        let disc = touches(&scene, "disc", &settings(), 0..9).unwrap();
        assert_ne!(disc, touches(&scene, "disk", &settings(), 0..9).unwrap());
    }

    #[test]
    fn shards_put_together_are_the_whole() {
        for approaches in [false, true] {
            let settings = Settings { touches: 1000, approaches, ..settings() };
            let whole = files(&settings);
            let mut joined = BTreeMap::new();
            for number in 1..=7 {
                for (name, text) in files(&Settings { shard: Shard { number, of: 7 }, ..settings.clone() }) {
                    *joined.entry(name).or_insert_with(String::new) += &text;
                }
            }
            assert_eq!(joined["disc.txt"], whole["disc.txt"]);
            assert_eq!(joined["globe.txt"], whole["globe.txt"]);
        }
    }

    #[test]
    fn shards_are_read_as_they_are_written_and_wrong_ones_refused() {
        assert_eq!("2/5".parse::<Shard>().unwrap().to_string(), "2/5");
        assert_eq!("5/5".parse::<Shard>().unwrap().part(u64::MAX).end, u64::MAX);
        for wrong in ["", "0/5", "6/5", "1", "1/0", "-1/2", "a/b", "1/2/3"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn touches_in_memory_are_those_on_the_disk() {
        let directory = tempfile::tempdir().unwrap();
        let settings = Settings { pose: true, ..settings() };
        let summary = capture(&objects(), &settings, directory.path(), &()).unwrap();
        let dataset = Dataset::read(directory.path()).unwrap();
        for (object, read) in objects().iter().zip(&dataset.objects) {
            let scene = Scene::new(&object.mesh, settings.length).unwrap();
            assert_eq!(read.touches, touches(&scene, &object.name, &settings, 0..1500).unwrap());
            assert!(read.touches.iter().all(|touch| touch.is_full() && touch.pose().is_some()));
        }
        let manifest = Manifest::read(directory.path()).unwrap().unwrap();
        assert!(manifest.complete);
        assert_eq!(manifest.objects[0].approaches, summary.objects[0].approaches);
        assert!(summary.objects[0].approaches > 2 * summary.objects[0].touches, "a disc is often missed");
    }

    #[test]
    fn full_touches_are_the_full_ones_of_all_approaches_however_they_are_found() {
        // The early way out must lose or change no touch: drawn from one stream, the plain way finds the same.
        use rand::SeedableRng;
        for object in objects() {
            let scene = Scene::new(&object.mesh, 10.0).unwrap();
            let (mut rng, probe) = (rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1), Probe::default());
            let mut full = 0;
            for _ in 0..20_000 {
                let approach = crate::probe::approach::Approach::draw(&mut rng, scene.bounds(), probe.tilt);
                let plain = match approach.distances(&scene, &probe) {
                    [Some(a), Some(b), Some(c)] => Some([a, b, c]),
                    _ => None,
                };
                assert_eq!(approach.full_distances(&scene, &probe), plain);
                full += u32::from(plain.is_some());
            }
            assert!(full > 100);
        }
    }

    #[test]
    fn what_an_interruption_left_behind_is_cut_off_and_the_rest_is_the_same() {
        let whole = files(&settings());
        let mut manifest: Manifest = serde_json::from_str(&whole["dataset.json"]).unwrap();
        let scenes = scenes(&objects(), &settings()).unwrap();
        for (object, kept) in [(0, 0), (0, 1), (0, 777), (0, 1500), (1, 0), (1, 1499), (1, 1500)] {
            // As if it had been killed after an account of so many touches of this object.
            let directory = tempfile::tempdir().unwrap();
            manifest.complete = false;
            for (index, entry) in manifest.objects.iter_mut().enumerate() {
                let kept = [kept, if index < object { 1500 } else { 0 }][usize::from(index != object)];
                let text = &whole[&format!("{}.txt", entry.name)];
                let sampler = Sampler::new(&scenes[index], &entry.name, &manifest.settings);
                entry.touches = kept;
                entry.approaches = (0..kept).map(|sample| sampler.sample(sample).unwrap().1).sum();
                entry.bytes = text.lines().take(kept as usize).map(|line| line.len() as u64 + 1).sum();
                let end = if index == object { "part" } else { "txt" };
                if index <= object {
                    let mut left = text[..entry.bytes as usize].to_owned();
                    left += if index == object { "0.000000 0.1" } else { "" };
                    std::fs::write(directory.path().join(format!("{}.{end}", entry.name)), left).unwrap();
                }
            }
            manifest.write(directory.path()).unwrap();
            capture(&objects(), &Settings { resume: true, ..settings() }, directory.path(), &()).unwrap();
            assert!(read_files(directory.path()) == whole, "object {object}, {kept} touches");
        }
    }

    #[test]
    fn a_part_that_lost_what_was_accounted_for_is_not_gone_on_with() {
        let directory = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::new(&settings(), ["disc".into(), "globe".into()]);
        manifest.objects[0] =
            crate::touches::manifest::Entry { name: "disc".into(), touches: 9, approaches: 99, bytes: 252 };
        manifest.write(directory.path()).unwrap();
        let error = capture(&objects(), &Settings { resume: true, ..settings() }, directory.path(), &()).unwrap_err();
        assert!(error.to_string().contains("disc.part: shorter than the 252 bytes"), "{error}");
    }

    #[test]
    fn an_object_that_three_fingers_cannot_touch_is_named() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let speck = Object { name: "speck".into(), mesh: Mesh { vertices, triangles: vec![[0, 1, 2]] } };
        let settings = Settings { length: 0.5, touches: 1, ..settings() };
        let directory = tempfile::tempdir().unwrap();
        let error = capture(&[speck], &settings, directory.path(), &()).unwrap_err().to_string();
        assert!(error.contains("speck: none of 4194304 approaches"), "{error}");
        assert!(Dataset::read(directory.path()).unwrap_err().to_string().contains("not complete"));
    }

    #[test]
    fn wrong_settings_are_wrong_arguments() {
        let probe = Probe::default();
        for wrong in [
            Settings { touches: 0, ..settings() },
            Settings { threads: Some(0), ..settings() },
            Settings { length: 0.0, ..settings() },
            Settings { length: f64::INFINITY, ..settings() },
            Settings { probe: Probe { radius: -0.15, ..probe }, ..settings() },
            Settings { probe: Probe { spacing: f64::NAN, ..probe }, ..settings() },
            Settings { probe: Probe { speed: 0.0, ..probe }, ..settings() },
            Settings { probe: Probe { speed: 1e-3, ..probe }, ..settings() },
            Settings { probe: Probe { tilt: 90.0, ..probe }, ..settings() },
        ] {
            let directory = tempfile::tempdir().unwrap();
            assert_eq!(capture(&objects(), &wrong, directory.path(), &()).unwrap_err().exit_code(), 2, "{wrong:?}");
            assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
        }
    }

    #[test]
    fn touches_of_an_earlier_capture_are_replaced() {
        let directory = tempfile::tempdir().unwrap();
        capture(&objects(), &settings(), directory.path(), &()).unwrap();
        let mut others = objects();
        others[0].name = "plate".into();
        capture(&others, &Settings { touches: 10, ..settings() }, directory.path(), &()).unwrap();
        let files = read_files(directory.path());
        assert_eq!(files.keys().collect::<Vec<_>>(), ["dataset.json", "globe.txt", "plate.txt"]);
        assert_eq!(files["globe.txt"].lines().count(), 10);
    }
}
