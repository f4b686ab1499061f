//! The files of a data set: their names, and what they are by how they begin.

use crate::error::{Error, Result, problem};
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// The extension of a file of touches.
pub(crate) const EXTENSION: &str = "txt";

/// The objects' names and files in a directory, sorted by name, regardless of any listing.
pub(crate) fn files(directory: &Path) -> Result<Vec<(String, PathBuf)>> {
    let io = |source| Error::io(directory, "read the data set", source);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.extension().is_some_and(|extension| extension == EXTENSION)
            && let Some(name) = path.file_stem().and_then(|stem| stem.to_str())
        {
            files.push((name.to_owned(), path));
        }
    }
    files.sort();
    Ok(files)
}

/// Refuses the name of an object that files of a directory cannot have.
pub(super) fn check_name(name: &str) -> Result<()> {
    let mut components = Path::new(name).components();
    let is_file_name = !name.is_empty()
        && !name.contains(['/', '\\', '\0'])
        && matches!((components.next(), components.next()), (Some(Component::Normal(_)), None));
    if is_file_name {
        return Ok(());
    }
    Err(problem!("no file can be named after the object {name:?}").fix(
        "Give a name that a file can have, for an object on a table OBJECT/PLACEMENT. If it stands in a dataset.json from \
         elsewhere, remove that file.",
    ))
}

/// The first byte of an MCAP file. No text in UTF-8 begins with it.
const FIRST: u8 = 0x89;

/// True if a file, or a stream, is a log, by how it begins.
pub fn begins_log(bytes: &[u8]) -> bool {
    bytes.first() == Some(&FIRST)
}

/// True if the file at `path` is a log, by its first byte; false for a file that cannot be read.
pub fn is_log(path: &Path) -> bool {
    begin(path).is_some_and(|bytes| begins_log(&bytes))
}

/// Refuses a file that begins like a bag of ROS that is not in MCAP.
pub(super) fn refuse_bag(bytes: &[u8]) -> Result<()> {
    match bytes.starts_with(b"#ROSBAG V") || bytes.starts_with(b"SQLite format 3\0") {
        true => Err(problem!("a bag of ROS 1, or of ROS 2 in SQLite, is not read")
            .fix("Convert it to MCAP: mcap convert BAG OUT.mcap.")),
        false => Ok(()),
    }
}

/// The first bytes of a file; none of one that cannot be read.
pub(super) fn begin(path: &Path) -> Option<Vec<u8>> {
    let mut first = Vec::new();
    let file = path.is_file().then(|| File::open(path))?.ok()?;
    file.take(16).read_to_end(&mut first).ok()?;
    Some(first)
}
