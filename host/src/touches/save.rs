//! A data set in memory, to the disk.

use super::{Dataset, Format, Listing, checksum, files, write_touch};
use crate::error::{CaptureProblem, Error, Place, Result};
use crate::output;
use std::path::Path;

impl Dataset {
    /// Writes the data set into a directory that holds none: a file for each object and, if the origin of the touches is
    /// known, `dataset.json`, which is written last and says that the data set is complete. Text holds poses only if the
    /// origin says so, or is unknown.
    ///
    /// `approaches` says how many approaches each object took, where that is known: it is written down as 0 where it is
    /// not, such as for a part of a capture.
    ///
    /// # Errors
    /// [`CaptureProblem::HoldsFiles`] if the directory holds touches; when a file cannot be written.
    pub fn write(&self, directory: &Path, format: Format, approaches: Option<&[u64]>) -> Result<()> {
        if !format.is_built_in() {
            return Err(Error::at(Place::file(directory), crate::error::TouchesProblem::NoParquet));
        }
        std::fs::create_dir_all(directory).map_err(|error| Error::io(directory, "make the directory", error))?;
        let there = files(directory)?;
        let mut names: Vec<String> = there.iter().filter_map(|(_, path, _)| path.file_name()).map(lossy).collect();
        if Listing::path(directory).exists() {
            names.push(Listing::FILE.into());
        }
        if !names.is_empty() {
            return Err(Error::at(Place::file(directory), CaptureProblem::HoldsFiles { files: names }));
        }
        let origin = self.origin.clone().map(|origin| super::Origin { format, ..origin });
        let poses = origin.as_ref().is_none_or(super::Origin::writes_pose);
        let mut listing = Listing::new(&origin.clone().unwrap_or_default(), self.names());
        for (index, (object, entry)) in self.objects.iter().zip(&mut listing.objects).enumerate() {
            let path = entry.file(directory, format);
            match format {
                Format::Text => output::write_whole(&path, |out| {
                    let mut line = String::new();
                    for touch in &object.touches {
                        line.clear();
                        write_touch(&mut line, touch, poses);
                        out.write_all(line.as_bytes())?;
                    }
                    Ok(())
                })?,
                Format::Parquet => write_parquet(&path, &object.name, &object.touches)?,
            }
            entry.touches = object.touches.len() as u64;
            entry.bytes = std::fs::metadata(&path).map_err(|error| Error::io(&path, "read the touches", error))?.len();
            entry.crc32 = Some(checksum(&path)?);
            entry.approaches = match (approaches.and_then(|approaches| approaches.get(index)), &origin) {
                (Some(&approaches), _) => approaches,
                (None, Some(origin)) if origin.approaches => entry.touches,
                (None, _) => 0,
            };
        }
        if origin.is_none() {
            return Ok(());
        }
        listing.complete = true;
        listing.write(directory)
    }
}

fn lossy(name: &std::ffi::OsStr) -> String {
    name.to_string_lossy().into_owned()
}

#[cfg(feature = "parquet")]
fn write_parquet(path: &Path, object: &str, touches: &[palpate_shared::Touch]) -> Result<()> {
    let unfinished = path.with_extension("parquet.part");
    let io = |error| Error::io(&unfinished, "write the touches", error);
    let file = std::fs::File::create(&unfinished).map_err(io)?;
    super::parquet::write(&unfinished, &file, object, touches.iter().copied().map(Ok))?;
    file.sync_all().map_err(io)?;
    std::fs::rename(&unfinished, path).map_err(io)
}

#[cfg(not(feature = "parquet"))]
fn write_parquet(path: &Path, _: &str, _: &[palpate_shared::Touch]) -> Result<()> {
    Err(Error::at(Place::file(path), crate::error::TouchesProblem::NoParquet))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Problem;
    use crate::touches::{ObjectTouches, Origin, parse_touch};

    fn dataset(origin: Option<Origin>) -> Dataset {
        let lines = ["0 0.001 -", "- - 0", "0.000000 0.123456 12.000001 1 0 0 0 1 0"];
        let touches: Vec<_> = lines.iter().map(|line| parse_touch(line).unwrap()).collect();
        let objects = ["cup", "fork"].map(|name| ObjectTouches { name: name.into(), touches: touches.clone() });
        Dataset { origin, ..Dataset::new(objects.into()) }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let origin = Origin { touches: 3, approaches: true, pose: true, ..Origin::default() };
        for format in Format::ALL.into_iter().filter(|format| format.is_built_in()) {
            for origin in [None, Some(Origin { format, ..origin.clone() })] {
                let (dataset, directory) = (dataset(origin), tempfile::tempdir().unwrap());
                dataset.write(directory.path(), format, None).unwrap();
                assert_eq!(Dataset::read(directory.path()).unwrap(), dataset);
            }
        }
    }

    #[test]
    fn nothing_is_written_over_touches_that_are_there() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("spoon.txt"), "0 0 0\n").unwrap();
        let error = dataset(None).write(directory.path(), Format::Text, None).unwrap_err();
        let holds = CaptureProblem::HoldsFiles { files: vec!["spoon.txt".into()] };
        assert_eq!(error.problem(), Some(&Problem::Capture(holds)));
        assert!(!directory.path().join("cup.txt").exists());
    }
}
