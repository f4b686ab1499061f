//! A data set in memory, to the disk.

use super::text::lines;
use super::{Dataset, Entry, Listing, ObjectTouches, Writer, files};
use crate::error::{Place, Result, problem};
use crate::wording::first_ten;
use std::path::Path;

/// Number of touches that are written in one piece.
const CHUNK: usize = 4096;

impl Dataset {
    /// Writes the data set into a directory that holds none, whole or not at all: a file for each pool and, if the origin of
    /// the touches is known, `dataset.json`, which says what each file is of. Text holds poses only if the origin says so or is
    /// unknown, or the touches are recorded.
    ///
    /// `approaches` says how many approaches each object took, if known: it is written down as 0 where it is
    /// not, such as for a part of a capture.
    ///
    /// # Errors
    /// When the directory holds touches; when an object has several pools, and there would be no `dataset.json` to say what
    /// they are of; when a file cannot be written.
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
        let of_several = |object: &&ObjectTouches| object.pools().len() > 1;
        if let (None, Some(several)) = (origin, self.objects.iter().find(of_several)) {
            let (name, pools) = (&several.name, several.pools().len());
            return Err(problem!(
                "{name} has touches of {pools} instances, logs or robots, and without a known probe no dataset.json states which \
                 file is of which"
            )
            .fix(
                "Say which probe made them (from Python `probe=`), or record each log with `palpate data record`.",
            )
            .at(Place::file(directory)));
        }
        let poses = origin.as_ref().is_none_or(|origin| origin.pose) || self.is_recorded();
        let entry = |object: &ObjectTouches| {
            Entry::of(&object.name, object.pools().iter().map(|pool| (&pool.source, pool.robot)))
        };
        let listing = Listing {
            objects: self.objects.iter().map(entry).collect(),
            ..Listing::new(&origin.clone().unwrap_or_default(), [])
        };
        let mut writer = Writer::begin(directory, listing)?;
        for (index, object) in self.objects.iter().enumerate() {
            let mut files = writer.object(index)?;
            for (pool, touches) in object.pools().iter().map(|pool| object.of_pool(pool)).enumerate() {
                for touches in touches.chunks(CHUNK) {
                    files.write(pool, &lines(touches, poses), touches.len() as u64)?;
                }
            }
            files.close(match (approaches.and_then(|approaches| approaches.get(index)), origin) {
                (Some(&approaches), _) => approaches,
                (None, Some(origin)) if origin.approaches => object.len() as u64,
                (None, _) => 0,
            })?;
        }
        writer.finish(origin.is_some(), &[])
    }
}

fn lossy(name: &std::ffi::OsStr) -> String {
    name.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::with;

    use crate::probe::noise::Noise;
    use crate::touches::{ObjectTouches, Origin, Recorded, Source, folds, parse_touch};

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
            let began = [("2026-11-22T11:00:00Z", 20), ("2026-11-22T12:00:00Z", 4), ("2026-11-22T13:00:00Z", 7)];
            let parts = began.into_iter().enumerate().map(|(number, (began, count))| {
                let recorded = Recorded { number, began: began.into(), ..Recorded::default() };
                (Source::Recording(recorded), None, touches(count))
            });
            ObjectTouches::of_parts(object, parts)
        });
        [instances, recordings].map(|objects| Dataset { origin: Some(origin.clone()), ..Dataset::new(objects.into()) })
    }

    #[test]
    fn a_copy_on_the_disk_knows_instances_recordings_and_robots() {
        let origin = Origin { touches: 31, ..Origin::default() };
        for dataset in of_several(&origin) {
            let folds::Split { train, test } = folds::split(&dataset, 0.3, 1).unwrap();
            let mut of_robots = dataset.clone();
            of_robots.add_noise(&with!(Noise::default(), speed_bias = 0.1), 1, 3);
            assert!(of_robots.objects[0].has_robots());
            for part in [&dataset, &train, &test, &of_robots] {
                let directory = tempfile::tempdir().unwrap();
                part.write(directory.path(), None).unwrap();
                let read = Dataset::read(directory.path()).unwrap();
                assert_eq!((&read, read.is_recorded()), (part, part.is_recorded()));
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
        let unknown = Dataset { origin: None, ..instances };
        let refused = unknown.write(directory.path(), None).unwrap_err().to_string();
        assert!(refused.contains("cup has touches of 2 instances, logs or robots"), "{refused}");
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
