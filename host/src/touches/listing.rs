//! `dataset.json`: the content and origin of a data set.

use super::files::{EXTENSION, begin, check_name, refuse_bag};
use super::{ObjectTouches, Origin, Recorded, Source};
use crate::error::{Error, Place, Result, problem};
use crate::output;
use palpate_shared::Touch;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Contents of a data set's directory. The same capture writes the same bytes: no times of day, no durations. A
/// recording says when it was made.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Listing {
    /// The version of the program that made it.
    pub palpate: String,
    /// Origin of the touches.
    #[serde(rename = "settings")]
    pub origin: Origin,
    /// The objects, sorted by name.
    pub objects: Vec<Entry>,
    /// The recordings that the touches are from, in their order; empty for simulated touches.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub recorded: Vec<Recorded>,
}

/// Entry of one object.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Entry {
    /// The object's name.
    pub name: String,
    /// Number of touches on the disk.
    pub touches: u64,
    /// Number of approaches that they took.
    pub approaches: u64,
    /// The CRC-32 (ISO-HDLC, as in gzip and PNG) of the object's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crc32: Option<u32>,
    /// The names of its instances, if it has several: sample i is of instance i modulo their number, unless `counts` says
    /// otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instances: Vec<String>,
    /// Number of touches of each instance, or of each placement, one after the other in the file, where they are not in turn, such
    /// as after a split.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counts: Vec<u64>,
    /// The placements on a table that it was touched in, those of one instance after those of another: sample i is of number i
    /// modulo their number, unless `counts` has a number of touches for each of them. Empty if it floats.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub placements: Vec<Lying>,
    /// The [checksum](crate::mesh::Mesh::checksum) of each instance's mesh, as it was read, in hexadecimal digits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub meshes: Vec<String>,
    /// Number of millimeters in a unit of its meshes, if it was touched at its true size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub millimeters: Option<f64>,
}

/// A placement that an object was touched in.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lying {
    /// The instance, if the object has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instance: Option<String>,
    /// The placement's name.
    pub name: String,
    /// Its weight among the placements of the object, or of the instance: from 0 to 1, with up to six decimals.
    pub weight: f64,
}

impl Lying {
    /// The source of its touches.
    pub(crate) fn source(&self) -> Source {
        let millionths = (self.weight * 1e6).round().clamp(0.0, 1e6) as u32;
        Source::Placement { instance: self.instance.clone(), placement: self.name.clone(), millionths }
    }

    /// The placement that is a source of touches, if it is one.
    pub(crate) fn of(source: &Source) -> Option<Self> {
        match source {
            Source::Placement { instance, placement, millionths } => {
                Some(Self { instance: instance.clone(), name: placement.clone(), weight: f64::from(*millionths) / 1e6 })
            }
            _ => None,
        }
    }
}

impl Entry {
    /// Sources of its touches in turn: placements, instances, or none.
    pub(crate) fn sources(&self) -> Vec<Source> {
        match self.placements.is_empty() {
            true => self.instances.iter().cloned().map(Source::Instance).collect(),
            false => self.placements.iter().map(Lying::source).collect(),
        }
    }
}

impl Listing {
    /// The file's name.
    pub const FILE: &str = "dataset.json";

    /// A listing of objects without touches so far.
    pub(crate) fn new(origin: &Origin, names: impl IntoIterator<Item = String>) -> Self {
        Self {
            palpate: env!("CARGO_PKG_VERSION").into(),
            origin: origin.clone(),
            objects: names.into_iter().map(|name| Entry { name, ..Entry::default() }).collect(),
            recorded: Vec::new(),
        }
    }

    /// True if a real probe made the touches. Such a data set may grow at any time: what its files hold beyond what is
    /// listed counts, up to the last whole line.
    pub(crate) fn is_recorded(&self) -> bool {
        !self.recorded.is_empty()
    }

    /// Path of a directory's listing.
    pub fn path(directory: &Path) -> PathBuf {
        directory.join(Self::FILE)
    }

    /// The listing of a directory; none if it has none, as data sets from elsewhere.
    ///
    /// # Errors
    /// When the file cannot be read or is not a listing, and when it names an object twice or by a name that no file can have.
    pub fn read(directory: &Path) -> Result<Option<Self>> {
        begin(directory)
            .map_or(Ok(()), |bytes| refuse_bag(&bytes))
            .map_err(|error| error.at(Place::file(directory)))?;
        let path = Self::path(directory);
        match std::fs::read(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::io(&path, "read the listing of the data set", error)),
            Ok(bytes) => Self::parse(&bytes, &path).map(Some),
        }
    }

    /// Reads the bytes of a listing; errors name `path`.
    ///
    /// # Errors
    /// Errors of [`read`](Self::read).
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let listing: Self = serde_json::from_slice(bytes)
            .map_err(|error| not_a_listing(&error).at(Place::line(path, error.line() as u64)))?;
        let mut names: Vec<&str> = listing.objects.iter().map(|entry| entry.name.as_str()).collect();
        names.sort_unstable();
        names.iter().try_for_each(|name| check_name(name)).map_err(|error| error.at(Place::file(path)))?;
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(problem!("the object {} is listed twice", pair[0]).fix(FROM_ELSEWHERE).at(Place::file(path)));
        }
        Ok(listing)
    }

    /// Writes the listing, whole or not at all, over an existing one.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, directory: &Path) -> Result<()> {
        output::write_json(&Self::path(directory), self)
    }

    /// The touches of a listed object, and what each of them is of.
    pub(super) fn with_sources(&self, entry: &Entry, touches: Vec<Touch>) -> Result<ObjectTouches> {
        let (name, origin) = (entry.name.clone(), &self.origin);
        if self.is_recorded() {
            let recorded = self.recorded.iter().filter(|recorded| recorded.object == name).cloned();
            let mut runs: Vec<_> = recorded.map(|one| (one.touches, Source::Recording(one))).collect();
            if runs.is_empty() {
                // A real probe made the touches, and nothing says when.
                let count = touches.len() as u64;
                let one = Recorded { object: name.clone(), touches: count, ..Recorded::default() };
                runs.push((count, Source::Recording(one)));
            }
            let runs = runs.into_iter().map(|(count, source)| (source, count)).collect();
            return Ok(ObjectTouches::in_runs(name, touches, runs).of_origin(origin));
        }
        if entry.counts.is_empty() {
            let first = origin.samples().start;
            return Ok(ObjectTouches::in_turn(name, touches, &entry.sources(), first).of_origin(origin));
        }
        let stated = entry.counts.iter().try_fold(0_u64, |sum, &count| sum.checked_add(count));
        let sources = entry.sources();
        if entry.counts.len() != sources.len() || stated != Some(touches.len() as u64) {
            return Err(not_a_listing(format_args!(
                "{name} has {} {} and {} touches, and counts that are not for these",
                sources.len(),
                if entry.placements.is_empty() { "instances" } else { "placements" },
                touches.len()
            )));
        }
        let runs = sources.into_iter().zip(entry.counts.iter().copied()).collect();
        Ok(ObjectTouches::in_runs(name, touches, runs).of_origin(origin))
    }

    /// The objects' names.
    pub(crate) fn names(&self) -> Vec<String> {
        self.objects.iter().map(|entry| entry.name.clone()).collect()
    }
}

impl Entry {
    /// The object's file of touches in a directory.
    pub fn file(&self, directory: &Path) -> PathBuf {
        directory.join(format!("{}.{EXTENSION}", self.name))
    }
}

/// Remedy for a `dataset.json` that cannot be read.
const FROM_ELSEWHERE: &str = "Remove the file if the touches are from elsewhere, else capture them again.";

fn not_a_listing(why: impl Display) -> Error {
    problem!("not the listing of a data set ({why})").fix(FROM_ELSEWHERE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A listing without checksums.
    const PLAIN: &str = r#"{
  "palpate": "0.3.0",
  "settings": {
    "touches": 2,
    "seed": 1,
    "length": 10.0,
    "probe": {"radius": 0.15, "spacing": 2.0, "speed": 10.0, "tilt": 10.0},
    "pose": false,
    "approaches": false
  },
  "objects": [
    {"name": "fork", "touches": 2, "approaches": 31}
  ]
}"#;

    #[test]
    fn a_listing_without_checksums_can_be_read() {
        let listing = Listing::parse(PLAIN.as_bytes(), Path::new("dataset.json")).unwrap();
        assert_eq!(listing.origin.probe.spacing, 2.0);
        assert_eq!(listing.names(), ["fork"]);
        assert_eq!(listing.objects[0].crc32, None);
    }

    #[test]
    fn a_listing_is_read_as_it_was_written() {
        let directory = tempfile::tempdir().unwrap();
        assert_eq!(Listing::read(directory.path()).unwrap(), None);
        let mut listing = Listing::new(&Origin::default(), ["fork".into(), "spoon".into()]);
        listing.objects[0].crc32 = Some(u32::MAX);
        listing.write(directory.path()).unwrap();
        assert_eq!(Listing::read(directory.path()).unwrap(), Some(listing));
    }

    #[test]
    fn a_listing_that_names_files_outside_its_directory_is_refused() {
        for name in ["", "..", ".", "../fork", "/etc/fork", "a/b", "a\\\\b", "fork/"] {
            let text = PLAIN.replace("\"fork\"", &format!("\"{name}\""));
            let error = Listing::parse(text.as_bytes(), Path::new("dataset.json")).unwrap_err();
            assert!(error.to_string().contains("no file can be named after the object"), "{error}");
        }
    }

    #[test]
    fn a_listing_that_names_an_object_twice_is_refused() {
        let entry = "{\"name\": \"fork\", \"touches\": 2, \"approaches\": 31}";
        let text = PLAIN.replace(entry, &format!("{entry}, {entry}"));
        let error = Listing::parse(text.as_bytes(), Path::new("dataset.json")).unwrap_err().to_string();
        assert!(error.contains("dataset.json: the object fork is listed twice"), "{error}");
    }

    #[test]
    fn what_is_no_listing_is_refused_with_its_line() {
        for (text, line) in [("", 1), ("{", 1), ("[]", 1), (&PLAIN.replace("seed", "sed"), 5)] {
            let error = Listing::parse(text.as_bytes(), Path::new("dataset.json")).unwrap_err().to_string();
            assert!(error.starts_with(&format!("dataset.json:{line}: not the listing of a data set")), "{error}");
        }
    }
}
