//! `dataset.json`: the content and origin of a data set.

use super::files::{EXTENSION, begin, check_name, refuse_bag};
use super::{Origin, Recorded, Source};
use crate::error::{Error, Place, Result, problem};
use crate::output;
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
}

/// Entry of one object.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Entry {
    /// The object's name.
    pub name: String,
    /// Number of approaches that its touches took.
    pub approaches: u64,
    /// Its files, one for each pool of touches.
    pub pools: Vec<PoolFile>,
    /// The [checksum](crate::mesh::Mesh::checksum) of each instance's mesh, as it was read, in hexadecimal digits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub meshes: Vec<String>,
    /// Number of millimeters in a unit of its meshes, if it was touched at its true size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub millimeters: Option<f64>,
}

/// File of the touches of an object that may be mixed in a sequence.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoolFile {
    /// The file's name without the extension, in a directory that is called like the object; none for the file beside
    /// `dataset.json` that is called like the object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Number of touches in the file.
    pub touches: u64,
    /// The CRC-32 (ISO-HDLC, as in gzip and PNG) of the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crc32: Option<u32>,
    /// The instance, if the object has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instance: Option<String>,
    /// The placement on a table that the object was touched in; none if it floats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placement: Option<Lying>,
    /// Number of the robot that made the touches, if robots differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<u32>,
    /// The recording that the touches are from; none for simulated touches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded: Option<Recorded>,
}

/// A placement that an object was touched in.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lying {
    /// The placement's name.
    pub name: String,
    /// Its weight among the placements of the object, or of the instance: from 0 to 1, with up to six decimals.
    pub weight: f64,
}

impl PoolFile {
    /// The file of touches of a source, so far without touches.
    pub(crate) fn of(source: &Source, robot: Option<u32>) -> Self {
        let none = Self { robot, ..Self::default() };
        match source.clone() {
            Source::Object => none,
            Source::Instance(instance) => Self { instance: Some(instance), ..none },
            Source::Placement { instance, placement, millionths } => {
                let placement = Some(Lying { name: placement, weight: f64::from(millionths) / 1e6 });
                Self { instance, placement, ..none }
            }
            Source::Recording(recorded) => Self { recorded: Some(recorded), ..none },
            Source::Log(path) => Self { instance: Some(path.display().to_string()), ..none },
        }
    }

    /// The source of the touches, of the file at this position among those of the object.
    pub(crate) fn source(&self, number: usize) -> Source {
        match (&self.recorded, &self.placement, &self.instance) {
            (Some(recorded), ..) => Source::Recording(Recorded { number, ..recorded.clone() }),
            (_, Some(Lying { name, weight }), instance) => Source::placed(instance.clone(), name.clone(), *weight),
            (.., Some(instance)) => Source::Instance(instance.clone()),
            _ => Source::Object,
        }
    }
}

impl Entry {
    /// The entry of an object with a file for each source and robot, so far without touches.
    pub(crate) fn of<'s>(name: &str, pools: impl IntoIterator<Item = (&'s Source, Option<u32>)>) -> Self {
        let mut pools: Vec<PoolFile> = pools.into_iter().map(|(source, robot)| PoolFile::of(source, robot)).collect();
        if pools.len() > 1 {
            (1..).zip(&mut pools).for_each(|(number, pool)| pool.file = Some(number.to_string()));
        }
        Self { name: name.into(), pools, ..Self::default() }
    }

    /// Number of touches on the disk.
    pub fn touches(&self) -> u64 {
        self.pools.iter().map(|pool| pool.touches).sum()
    }

    /// The path of a pool's file in the directory of the data set.
    pub fn path(&self, directory: &Path, pool: &PoolFile) -> PathBuf {
        match &pool.file {
            Some(file) => directory.join(&self.name).join(format!("{file}.{EXTENSION}")),
            None => directory.join(format!("{}.{EXTENSION}", self.name)),
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
            objects: names.into_iter().map(|name| Entry::of(&name, [(&Source::Object, None)])).collect(),
        }
    }

    /// True if a real probe made the touches. Such a data set may grow at any time: what its files hold beyond what is
    /// listed counts, up to the last whole line.
    pub(crate) fn is_recorded(&self) -> bool {
        self.objects.iter().flat_map(|entry| &entry.pools).any(|pool| pool.recorded.is_some())
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
        let files = listing.objects.iter().flat_map(|entry| &entry.pools).filter_map(|pool| pool.file.as_deref());
        let all = names.iter().copied().chain(files);
        all.map(check_name).collect::<Result<Vec<_>>>().map_err(|error| error.at(Place::file(path)))?;
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(problem!("the object {} is listed twice", pair[0]).fix(FROM_ELSEWHERE).at(Place::file(path)));
        }
        let mut paths: Vec<PathBuf> = listing.paths(Path::new("")).collect();
        paths.sort_unstable();
        if let Some(pair) = paths.windows(2).find(|pair| pair[0] == pair[1]) {
            let twice = problem!("the file {} is listed twice", pair[0].display());
            return Err(twice.fix(FROM_ELSEWHERE).at(Place::file(path)));
        }
        Ok(listing)
    }

    /// The paths of all files of touches in the directory.
    pub(crate) fn paths(&self, directory: &Path) -> impl Iterator<Item = PathBuf> {
        self.objects.iter().flat_map(move |entry| entry.pools.iter().map(move |pool| entry.path(directory, pool)))
    }

    /// Writes the listing, whole or not at all, over an existing one.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, directory: &Path) -> Result<()> {
        output::write_json(&Self::path(directory), self)
    }

    /// The objects' names.
    pub(crate) fn names(&self) -> Vec<String> {
        self.objects.iter().map(|entry| entry.name.clone()).collect()
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
    {"name": "fork", "approaches": 31, "pools": [{"touches": 2}]}
  ]
}"#;

    #[test]
    fn a_listing_without_checksums_can_be_read() {
        let listing = Listing::parse(PLAIN.as_bytes(), Path::new("dataset.json")).unwrap();
        assert_eq!(listing.origin.probe.spacing, 2.0);
        assert_eq!(listing.names(), ["fork"]);
        assert_eq!(listing.objects[0].pools[0].crc32, None);
    }

    #[test]
    fn a_listing_is_read_as_it_was_written() {
        let directory = tempfile::tempdir().unwrap();
        assert_eq!(Listing::read(directory.path()).unwrap(), None);
        let mut listing = Listing::new(&Origin::default(), ["fork".into(), "spoon".into()]);
        listing.objects[0].pools[0].crc32 = Some(u32::MAX);
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
    fn a_listing_that_names_a_file_twice_or_outside_of_the_objects_directory_is_refused() {
        let refused = |pools: &str| {
            let text = PLAIN.replace(r#"[{"touches": 2}]"#, pools);
            Listing::parse(text.as_bytes(), Path::new("dataset.json")).unwrap_err().to_string()
        };
        for pools in
            [r#"[{"touches": 2}, {"touches": 3}]"#, r#"[{"file": "1", "touches": 2}, {"file": "1", "touches": 1}]"#]
        {
            assert!(refused(pools).contains("is listed twice"), "{}", refused(pools));
        }
        let outside = refused(r#"[{"file": "../fork", "touches": 2}]"#);
        assert!(outside.contains("no file can be named after"), "{outside}");
    }

    #[test]
    fn a_listing_that_names_an_object_twice_is_refused() {
        let entry = r#"{"name": "fork", "approaches": 31, "pools": [{"touches": 2}]}"#;
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
