//! A data set in memory, to the disk.

use super::{Dataset, Entry, Listing, Lying, ObjectTouches, Source, Writer, files, write_touch};
use crate::error::{Place, Result, problem};
use crate::wording::first_ten;
use std::path::Path;

/// Number of touches that are written in one piece.
const CHUNK: usize = 4096;

impl Dataset {
    /// Writes the data set into a directory that holds none, whole or not at all: a file for each object and, if the origin of
    /// the touches is known, `dataset.json`, which says which touches are of which instance, and which recordings they are
    /// from. Text holds poses only if the origin says so or is unknown, or the
    /// touches are recorded.
    ///
    /// Touches of instances that are not in turn, such as a part of a capture, are written one instance after the other,
    /// those of recordings one recording after the other.
    ///
    /// `approaches` says how many approaches each object took, if known: it is written down as 0 where it is
    /// not, such as for a part of a capture.
    ///
    /// # Errors
    /// When the directory holds touches; when an object has several instances or logs, and there would be no `dataset.json`
    /// to say so, or has touches of robots that differ; when a file cannot be written.
    pub fn write(&self, directory: &Path, approaches: Option<&[u64]>) -> Result<()> {
        let there = if directory.exists() { files(directory)? } else { Vec::new() };
        let mut names: Vec<String> = there.iter().filter_map(|(_, path)| path.file_name()).map(lossy).collect();
        if Listing::path(directory).exists() {
            names.push(Listing::FILE.into());
        }
        if !names.is_empty() {
            return Err(problem!("holds {}, and touches are not saved over others", first_ten(&names))
                .fix("Give another directory, or move the files away.")
                .at(Place::file(directory)));
        }
        let origin = &self.origin;
        let of_several = |object: &&ObjectTouches| object.sources().len() > 1;
        if let (None, Some(several)) = (origin, self.objects.iter().find(of_several)) {
            let (name, sources) = (&several.name, several.sources().len());
            return Err(problem!(
                "{name} has {sources} instances or logs, and without a known probe no dataset.json states the source of each touch"
            )
            .fix(
                "Say which probe made them (from Python `probe=`), or record each log with `palpate data record`.",
            )
            .at(Place::file(directory)));
        }
        if let Some(object) = self.objects.iter().find(|object| object.has_robots()) {
            let name = &object.name;
            return Err(problem!(
                "the touches of {name} are of robots with different biases, and no file states the robot of each touch"
            )
            .fix("Write them without noise, and add it where they are read.")
            .at(Place::file(directory)));
        }
        let poses = origin.as_ref().is_none_or(|origin| origin.pose) || self.is_recorded();
        let mut listing = Listing::new(&origin.clone().unwrap_or_default(), self.names());
        listing.recorded = self.recorded();
        let first = origin.as_ref().map_or(0, |origin| origin.samples().start);
        let mut writer = Writer::begin(directory, listing)?;
        for (index, object) in self.objects.iter().enumerate() {
            let mut file = writer.file(index)?;
            let object = arranged(object, first, file.entry);
            for touches in object.touches().chunks(CHUNK) {
                let mut lines = String::new();
                touches.iter().for_each(|touch| write_touch(&mut lines, touch, poses));
                file.write(&lines, touches.len() as u64, 0)?;
            }
            file.entry.approaches = match (approaches.and_then(|approaches| approaches.get(index)), origin) {
                (Some(&approaches), _) => approaches,
                (None, Some(origin)) if origin.approaches => object.len() as u64,
                (None, _) => 0,
            };
            file.close()?;
        }
        writer.finish(origin.is_some(), &[])
    }
}

/// An object's touches in the order in which a listing can say what each is of, which it then says. Sample `first` is the
/// first one.
fn arranged(object: &ObjectTouches, first: u64, entry: &mut Entry) -> ObjectTouches {
    let name = |source: &Source| match source {
        Source::Object => object.name.clone(),
        Source::Instance(name) => name.clone(),
        Source::Placement { instance, .. } => instance.clone().unwrap_or_default(),
        Source::Log(path) => path.display().to_string(),
        Source::Recording(_) => String::new(),
    };
    let count = object.sources().len() as u64;
    let is_recorded = object.sources().iter().any(|source| matches!(source, Source::Recording(_)));
    entry.placements = object.sources().iter().filter_map(Lying::of).collect();
    if count > 1 && !is_recorded {
        entry.instances = object.sources().iter().map(name).filter(|name| !name.is_empty()).collect();
        if !entry.placements.is_empty() {
            entry.instances.dedup();
        }
        let is_in_turn = |touch: usize| object.source_of(touch) as u64 == (first % count + touch as u64) % count;
        if (0..object.len()).all(is_in_turn) {
            return object.clone();
        }
        entry.counts = object.by_source().iter().map(|touches| touches.len() as u64).collect();
    }
    let mut by_source: Vec<_> = object.sources().iter().zip(object.by_source()).collect();
    // As the data set lists its recordings.
    by_source.sort_by_key(|(source, _)| match source {
        Source::Recording(recorded) => recorded.began.clone(),
        _ => String::new(),
    });
    object.select(by_source.into_iter().flat_map(|(_, touches)| touches))
}

fn lossy(name: &std::ffi::OsStr) -> String {
    name.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::with;

    use crate::probe::noise::Noise;
    use crate::touches::{ObjectTouches, Origin, Recorded, folds, parse_touch};

    fn dataset(origin: Option<Origin>) -> Dataset {
        let lines = ["0 0.001 -", "- - 0", "0.000000 0.123456 1.200001 1 0 0 0 1 0"];
        let touches: Vec<_> = lines.iter().map(|line| parse_touch(line).unwrap()).collect();
        let objects = ["cup", "fork"].map(|name| ObjectTouches::new(name, touches.clone(), Source::Object));
        Dataset { origin, ..Dataset::new(objects.into()) }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let origin = Origin { touches: 3, approaches: true, pose: true, ..Origin::default() };
        for origin in [None, Some(origin)] {
            let (dataset, directory) = (dataset(origin), tempfile::tempdir().unwrap());
            dataset.write(directory.path(), None).unwrap();
            assert_eq!(Dataset::read(directory.path()).unwrap(), dataset);
        }
    }

    /// Touches that are known by their times, of two instances and of three recordings.
    fn of_several(origin: &Origin) -> [Dataset; 2] {
        let touches =
            |count: u32| (0..count).map(|i| palpate_shared::Touch::from_micros([0, i, 9])).collect::<Vec<_>>();
        let names = ["mug", "glass"].map(String::from);
        let instances = ["cup", "vase"].map(|name| ObjectTouches::in_turn(name, touches(31), &names, 0));
        let recordings = ["cup", "vase"].map(|object| {
            let recorded = |(began, touches): (&str, u64)| {
                let (object, began, crc32) = (object.into(), began.into(), Some(7));
                Recorded { object, touches, began, crc32, ..Recorded::default() }
            };
            let runs = [("2026-11-22T11:00:00Z", 20), ("2026-11-22T12:00:00Z", 4), ("2026-11-22T13:00:00Z", 7)];
            let runs = runs.map(recorded).map(|one| (one.touches, Source::Recording(one))).map(|(n, one)| (one, n));
            ObjectTouches::in_runs(object, touches(31), runs.into())
        });
        [instances, recordings].map(|objects| Dataset { origin: Some(origin.clone()), ..Dataset::new(objects.into()) })
    }

    /// A key of each source's touches, for each object, regardless of their order.
    fn by_source(dataset: &Dataset) -> Vec<(String, Vec<palpate_shared::Touch>)> {
        let mut all = Vec::new();
        for object in &dataset.objects {
            for (source, touches) in object.sources().iter().zip(object.by_source()) {
                let source = match source {
                    Source::Recording(recorded) => recorded.began.clone(),
                    other => format!("{other:?}"),
                };
                let mut touches: Vec<_> = touches.into_iter().map(|touch| object.touches()[touch]).collect();
                touches.sort_by_key(|touch| touch.times()[1].micros());
                all.push((format!("{} {source}", object.name), touches));
            }
        }
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all
    }

    #[test]
    fn a_copy_on_the_disk_knows_instances_and_recordings() {
        let origin = Origin { touches: 31, ..Origin::default() };
        for dataset in of_several(&origin) {
            let folds::Split { train, test } = folds::split(&dataset, 0.3, 1).unwrap();
            for (part, is_whole) in [(&dataset, true), (&train, false), (&test, false)] {
                let directory = tempfile::tempdir().unwrap();
                part.write(directory.path(), None).unwrap();
                let read = Dataset::read(directory.path()).unwrap();
                assert_eq!(by_source(&read), by_source(part));
                assert_eq!((read.recorded(), read.is_recorded()), (part.recorded(), part.is_recorded()));
                assert!(!is_whole || read == *part);
                // What a real probe made is never replaced.
                let settings = crate::capture::Settings { force: true, ..origin.clone().into() };
                let objects = ["cup", "vase"].map(|name| crate::mesh::Object::new(name, crate::mesh::Mesh::globe(6)));
                let again = crate::capture::capture(&objects, &settings, directory.path(), &());
                assert_eq!(again.is_err(), part.is_recorded(), "{again:?}");
            }
        }
    }

    #[test]
    fn noise_is_stated_by_what_it_was_added_to() {
        let origin = Origin { touches: 31, real: Noise::gaussian(3_000.0), ..Origin::default() };
        let [mut dataset, _] = of_several(&origin);
        dataset.add_noise(&Noise::gaussian(4_000.0), 1, 1);
        let directory = tempfile::tempdir().unwrap();
        dataset.write(directory.path(), None).unwrap();
        assert_eq!(Dataset::read(directory.path()).unwrap().real(), Noise::gaussian(5_000.0));
    }

    #[test]
    fn what_no_listing_could_say_is_not_written() {
        let [instances, _] = of_several(&Origin::default());
        let directory = tempfile::tempdir().unwrap();
        let refused = |dataset: &Dataset| dataset.write(directory.path(), None).unwrap_err().to_string();
        let unknown = Dataset { origin: None, ..instances.clone() };
        assert!(refused(&unknown).contains("cup has 2 instances or logs"), "{}", refused(&unknown));
        let mut robots = instances;
        robots.add_noise(&with!(Noise::default(), speed_bias = 0.1), 1, 3);
        assert!(refused(&robots).contains("the touches of cup are of robots"), "{}", refused(&robots));
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }

    #[test]
    fn nothing_is_written_over_touches_that_are_there() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("spoon.txt"), "0 0 0\n").unwrap();
        let error = dataset(None).write(directory.path(), None).unwrap_err();
        assert!(error.to_string().contains("holds spoon.txt, and touches are not saved over others"), "{error}");
        assert!(!directory.path().join("cup.txt").exists());
    }
}
