//! A data set: a directory with one file per object.

use super::files::{EXTENSION, PARQUET};
use super::finding::Strict;
use super::read::{Content, parquet, read};
use super::{Finding, ObjectTouches, Origin, Pool, Source, text};
use crate::error::{Place, Result, problem};
use crate::probe::approach::Probe;
use crate::probe::hand;
use crate::probe::noise::Noise;
use palpate_shared::Touch;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

/// The touches of two or more objects, and how they were made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dataset {
    /// The objects, sorted by name.
    pub objects: Vec<ObjectTouches>,
    /// Origin of the touches, if known: a directory without `dataset.json` does not say.
    pub origin: Option<Origin>,
    /// Warnings from reading the data set: things that look wrong, but may be meant.
    pub warnings: Vec<Finding>,
}

impl Dataset {
    /// Touches that nothing is known about but their sources: no origin, no warnings. The objects must be sorted by
    /// name.
    pub fn new(objects: Vec<ObjectTouches>) -> Self {
        Self { objects, ..Self::default() }
    }

    /// Touches of the same origin: what `of` makes of each object's.
    #[must_use]
    pub fn each(&self, of: impl FnMut(&ObjectTouches) -> ObjectTouches) -> Self {
        Self { objects: self.objects.iter().map(of).collect(), origin: self.origin.clone(), warnings: Vec::new() }
    }

    /// The touches of the objects whose names `keep` says.
    #[must_use]
    pub fn only(&self, keep: impl Fn(&str) -> bool) -> Self {
        let objects = self.objects.iter().filter(|object| keep(&object.name)).cloned().collect();
        Self { objects, origin: self.origin.clone(), warnings: Vec::new() }
    }

    /// This data set, with each placement of an object as an object of its own, called `object/placement`: for a model with
    /// an output for each placement is trained on. Objects without placements stay as they are.
    #[must_use]
    #[cfg(feature = "train")]
    pub(crate) fn by_placement(&self) -> Self {
        let objects = self.objects.iter().flat_map(ObjectTouches::by_placement).collect();
        Self { objects, origin: self.origin.clone(), warnings: Vec::new() }
    }

    /// Divides objects for a model with outputs of these names: each object that has placements among them into its own.
    /// Others stay as they are, such as recordings that state no placement, which are of all outputs of their object.
    #[must_use]
    pub fn matching(self, outputs: &[String]) -> Self {
        let is_placed = |object: &ObjectTouches| {
            let is_of = |output: &String| output.rsplit_once('/').is_some_and(|(name, _)| name == object.name);
            !outputs.contains(&object.name) && object.placement_weights().is_some() && outputs.iter().any(is_of)
        };
        let of = |object: ObjectTouches| if is_placed(&object) { object.by_placement() } else { vec![object] };
        Self { objects: self.objects.into_iter().flat_map(of).collect(), ..self }
    }

    /// This data set without the contacts that are later than `window` microseconds, such as by the stroke of the probe that a
    /// model is for: what an effector takes for missing.
    pub(crate) fn within(&self, window: Option<u32>) -> Cow<'_, Self> {
        match self.touches().any(|touch| hand::late(touch, window).contains(&true)) {
            true => Cow::Owned(self.each(|own| own.changed(|touch| hand::within(touch, window)))),
            false => Cow::Borrowed(self),
        }
    }

    /// Removes contacts by the stroke of a probe, if a hand with this stroke explains all of them; else changes nothing.
    #[cfg(feature = "train")]
    pub(crate) fn delivered_by(&self, probe: &Probe) -> Cow<'_, Self> {
        let is_explained = |latest: f64| self.touches().all(|touch| f64::from(touch.spread()) <= latest);
        self.within(probe.window().filter(|_| probe.latest().is_some_and(is_explained)))
    }

    /// The weight of each placement among those of its object, by the name of its output; empty where objects have none.
    pub fn placement_shares(&self) -> BTreeMap<String, f64> {
        let of = |object: &ObjectTouches| {
            let named = |(placement, weight): (String, f64)| (format!("{}/{placement}", object.name), weight);
            object.placement_weights().unwrap_or_default().into_iter().map(named).collect::<Vec<_>>()
        };
        self.objects.iter().flat_map(of).collect()
    }

    /// Adds noise to all touches, made by `robots` robots in turn; the origin then states it
    /// too.
    pub fn add_noise(&mut self, noise: &Noise, seed: u64, robots: usize) {
        if noise.is_none() {
            return;
        }
        self.objects.iter_mut().for_each(|object| *object = object.noisy(noise, seed, robots));
        if let Some(origin) = &mut self.origin {
            origin.real = origin.real.and(noise);
        }
    }

    /// True if a real probe made touches, as far as the data set states it.
    pub fn is_recorded(&self) -> bool {
        self.pools().any(|pool| matches!(pool.source, Source::Recording(_)))
    }

    /// Number of instances, recordings or logs of the objects that have several, by name: all touches of a sequence are
    /// from one.
    pub fn several(&self) -> BTreeMap<String, usize> {
        let several = self.objects.iter().filter(|object| object.sources().len() > 1);
        several.map(|object| (object.name.clone(), object.sources().len())).collect()
    }

    /// The most touches that a sequence of any object can have: as many as there are of one source, such as an instance, by
    /// one robot.
    pub fn fewest_in_sequence(&self) -> usize {
        self.pools().map(|pool| pool.range.len()).min().unwrap_or(0)
    }

    fn pools(&self) -> impl Iterator<Item = &Pool> {
        self.objects.iter().flat_map(|object| object.pools())
    }

    /// Reads the data set in a directory: the files that its `dataset.json` names and no other, or, without one, every
    /// `<object>.txt` and log (`<name>.mcap`, see [`Log::by_object`](super::Log::by_object); its content decides that a file is one). Touches of one object in several logs are joined in the order of the logs' names. The path of a log is a data
    /// set too.
    ///
    /// A text file that was changed since its capture but has as many touches as stated is a warning.
    ///
    /// # Errors
    /// When the directory cannot be read, or holds fewer than two objects; when a listed file is
    /// missing or has another number of touches than stated; when a file holds no touch, and when a line or row is wrong, or a row is of another object (it is named); when some touches have a
    /// position and others have none, or `dataset.json` states otherwise.
    pub fn read(directory: &Path) -> Result<Self> {
        let dataset = Self::read_any(directory)?;
        match dataset.objects.as_slice() {
            [one] => Err(problem!("only one object here, {}, and nothing to distinguish it from", one.name)
                .fix("Capture at least two objects into the directory.")
                .at(Place::file(directory))),
            _ => Ok(dataset),
        }
    }

    /// Reads a data set that may hold a single object: a background, or a stranger.
    ///
    /// # Errors
    /// Errors of [`read`](Self::read), except that one object is enough.
    pub fn read_any(directory: &Path) -> Result<Self> {
        let mut sink = Strict::default();
        let Content { objects, listing } = read(directory, &mut sink)?;
        let objects = objects.into_iter().map(|found| found.touches).collect();
        Ok(Self { objects, origin: listing.map(|listing| listing.origin), warnings: sink.0 })
    }

    /// The touches of one file, as an object that is called like it.
    ///
    /// # Errors
    /// When the file's name says neither what it holds nor of which object; when the file cannot be read, holds no touch, or
    /// has a wrong line.
    pub fn read_file(path: &Path) -> Result<ObjectTouches> {
        let extension = path.extension().unwrap_or_default();
        match path.file_stem().and_then(|stem| stem.to_str()) {
            Some(name) if extension == EXTENSION => Ok(ObjectTouches::new(name, text::read(path)?, Source::Object)),
            _ if extension == PARQUET => Err(parquet(path)),
            _ => Err(problem!("not a file of touches by its name")
                .fix("Name it after the object, with the extension .txt.")
                .at(Place::file(path))),
        }
    }

    /// The probe that made the touches, if known.
    pub fn probe(&self) -> Option<&Probe> {
        self.origin.as_ref().map(|origin| &origin.probe)
    }

    /// True if every approach is kept, including those that were not full touches: what the origin says or, without one,
    /// whether any touch is partial.
    pub fn holds_approaches(&self) -> bool {
        let any_partial = || self.touches().any(|touch| !touch.is_full());
        self.origin.as_ref().map_or_else(any_partial, |origin| origin.approaches)
    }

    /// Noise that a real probe added to the touches, as far as the data set states it: noise that they have already.
    pub fn real(&self) -> Noise {
        self.origin.as_ref().map_or_else(Noise::default, |origin| origin.real)
    }

    /// The share of each contact pattern among all touches, in the order of the patterns' codes, each object weighted
    /// equally.
    pub(crate) fn shares(&self) -> [f64; 6] {
        let mut shares = [0.0; 6];
        for touches in self.objects.iter().map(ObjectTouches::touches) {
            let mut counts = [0_usize; 6];
            touches.iter().for_each(|touch| counts[usize::from(touch.pattern().code())] += 1);
            let all = (touches.len() * self.objects.len()).max(1) as f64;
            shares.iter_mut().zip(counts).for_each(|(share, count)| *share += count as f64 / all);
        }
        shares
    }

    /// All touches, object after object.
    pub fn touches(&self) -> impl Iterator<Item = &Touch> + Clone {
        self.objects.iter().flat_map(ObjectTouches::touches)
    }

    /// The objects' names, sorted.
    pub fn names(&self) -> Vec<String> {
        self.objects.iter().map(|object| object.name.clone()).collect()
    }

    /// Number of touches of all objects together.
    pub fn len(&self) -> usize {
        self.objects.iter().map(ObjectTouches::len).sum()
    }

    /// True if there is no touch at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touches::Listing;
    use crate::touches::checksum::CRC;

    /// A data set of two objects, with its listing.
    fn captured() -> tempfile::TempDir {
        let directory = tempfile::tempdir().unwrap();
        let origin = Origin { touches: 3, ..Origin::default() };
        let mut listing = Listing::new(&origin, ["fork".into(), "spoon".into()]);
        for (index, entry) in listing.objects.iter_mut().enumerate() {
            let path = entry.path(directory.path(), &entry.pools[0]);
            let touch = |i: u32| Touch::from_micros([0, i, index as u32]);
            let mut text = String::new();
            (0..3).for_each(|i| super::super::write_touch(&mut text, &touch(i), false));
            entry.pools[0].touches = 3;
            entry.pools[0].crc32 = Some(CRC.checksum(text.as_bytes()));
            std::fs::write(&path, text).unwrap();
        }
        listing.write(directory.path()).unwrap();
        directory
    }

    /// True if the directory is refused for this reason.
    fn is_refused(directory: &Path, why: &str) -> bool {
        Dataset::read(directory).unwrap_err().what() == why
    }

    #[test]
    fn objects_are_sorted_by_name_and_other_files_ignored() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["spoon.txt", "fork.txt", "notes.md", "cup.part"] {
            std::fs::write(directory.path().join(name), "0 0.1 0.2\r\n\n0.000000,0.3,-").unwrap();
        }
        let dataset = Dataset::read(directory.path()).unwrap();
        assert_eq!(dataset.names(), ["fork", "spoon"]);
        assert_eq!(dataset.len(), 4);
        assert_eq!(dataset.probe(), None);
    }

    #[test]
    fn a_directory_that_is_missing_empty_or_of_one_object_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let error = |path: &Path| Dataset::read(path).unwrap_err().to_string();
        assert!(error(&directory.path().join("nowhere")).contains("cannot read the data set"));
        assert!(error(directory.path()).contains("no touches here"));
        std::fs::write(directory.path().join("fork.txt"), "0 0 0\n").unwrap();
        assert!(error(directory.path()).contains("only one object here, fork"));
    }

    #[test]
    fn a_wrong_line_is_named_with_its_file() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("cup.txt"), "0 0 0\n").unwrap();
        let path = directory.path().join("fork.txt");
        for (text, place) in
            [(&b"0 0 0\n\n0 0 -1\n"[..], "fork.txt:3: the time -1"), (b"0 0 0\n\xff\n", "fork.txt:2: not text")]
        {
            std::fs::write(&path, text).unwrap();
            let error = Dataset::read(directory.path()).unwrap_err();
            assert!(error.to_string().contains(place), "{error}");
            assert_eq!(error.exit_code(), 1);
        }
        std::fs::write(&path, "\n").unwrap();
        assert!(Dataset::read(directory.path()).unwrap_err().to_string().contains("fork.txt: no touches"));
    }

    #[test]
    fn objects_with_and_without_positions_are_refused_and_so_are_others_than_the_listing_states() {
        let directory = captured();
        let path = directory.path().join("spoon.txt");
        std::fs::write(&path, "0 0 0 0 0 -1 1 0 0 1 2 3\n".repeat(3)).unwrap();
        let stated = "a position, where the touches that dataset.json states have none";
        assert!(is_refused(directory.path(), stated));
        let mut listing = Listing::read(directory.path()).unwrap().unwrap();
        listing.origin.position = true;
        listing.write(directory.path()).unwrap();
        let stated = "no position, where the touches that dataset.json states have one";
        assert!(is_refused(directory.path(), stated));
        std::fs::remove_file(Listing::path(directory.path())).unwrap();
        let error = Dataset::read(directory.path()).unwrap_err().to_string();
        assert!(error.contains("spoon.txt: a position, where the touches before it have none"), "{error}");
    }

    #[test]
    fn a_parquet_file_is_refused_with_what_to_use_instead() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["fork.txt", "fork.parquet", "spoon.txt"] {
            std::fs::write(directory.path().join(name), "0 0 0\n").unwrap();
        }
        let file = Dataset::read_file(&directory.path().join("fork.parquet")).unwrap_err();
        for error in [Dataset::read(directory.path()).unwrap_err(), file] {
            let said = error.to_string();
            assert!(said.contains("fork.parquet: Parquet is not read. Instead, write text or CSV"), "{said}");
        }
    }

    #[test]
    fn a_data_set_knows_the_probe_that_its_listing_states() {
        let dataset = Dataset::read(captured().path()).unwrap();
        assert_eq!(dataset.probe(), Some(&Probe::default()));
        assert_eq!(dataset.only(|_| false).probe(), dataset.probe());
        assert_eq!(dataset.warnings, []);
    }

    #[test]
    fn an_old_file_that_the_listing_does_not_name_is_never_used() {
        let directory = captured();
        std::fs::write(directory.path().join("cup.txt"), "0 0 0\n").unwrap();
        std::fs::write(directory.path().join("fork.parquet"), "no touches").unwrap();
        assert_eq!(Dataset::read(directory.path()).unwrap().names(), ["fork", "spoon"]);
    }

    #[test]
    fn a_missing_file_of_a_listed_object_is_an_error() {
        let directory = captured();
        std::fs::remove_file(directory.path().join("spoon.txt")).unwrap();
        assert!(is_refused(directory.path(), "missing, although dataset.json lists the object spoon"));
    }

    #[test]
    fn a_file_cut_at_a_line_end_is_an_error() {
        let directory = captured();
        let path = directory.path().join("spoon.txt");
        let text = std::fs::read_to_string(&path).unwrap();
        for touches in [2, 1] {
            let cut: String = text.split_inclusive('\n').take(touches).collect();
            std::fs::write(&path, cut).unwrap();
            assert!(is_refused(directory.path(), &format!("{touches} touches where dataset.json states 3")));
        }
        std::fs::write(&path, text.clone() + "0 0 0\n").unwrap();
        assert!(is_refused(directory.path(), "4 touches where dataset.json states 3"));
    }

    #[test]
    fn an_edited_text_file_is_a_warning_that_names_it() {
        let directory = captured();
        let path = directory.path().join("spoon.txt");
        let text = std::fs::read_to_string(&path).unwrap().replace("0.000002", "0.000003");
        std::fs::write(&path, text).unwrap();
        let dataset = Dataset::read(directory.path()).unwrap();
        assert_eq!(dataset.warnings.len(), 1);
        assert!(dataset.warnings[0].to_string().contains("spoon.txt: changed since its capture"));
        assert_eq!(dataset.objects[1].touches()[2].times()[1].micros(), Some(3));
    }

    #[test]
    fn checksums_are_those_of_gzip() {
        assert_eq!(CRC.checksum(b"123456789"), 0xcbf4_3926);
    }
}
