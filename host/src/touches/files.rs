//! The files of a data set: their names, and what they are by how they begin.

use crate::error::{Error, Result, problem};
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Extension of logs.
pub(super) const LOG: &str = "mcap";

/// The extension of a file of touches.
pub(crate) const EXTENSION: &str = "txt";

/// The objects' names and files in a directory, sorted by name, regardless of any listing.
pub(crate) fn files(directory: &Path) -> Result<Vec<(String, PathBuf)>> {
    let named = |path: PathBuf| Some((path.file_stem()?.to_str()?.to_owned(), path));
    let mut files: Vec<_> = of_extension(directory, EXTENSION)?.into_iter().filter_map(named).collect();
    files.sort();
    Ok(files)
}

/// The extension of tables that are refused with what to use instead.
pub(super) const PARQUET: &str = "parquet";

/// The logs in a directory by their names, which end in `.mcap`, sorted.
pub(crate) fn logs(directory: &Path) -> Result<Vec<PathBuf>> {
    of_extension(directory, LOG)
}

/// The files in a directory whose names end like this, sorted.
pub(super) fn of_extension(directory: &Path, ending: &str) -> Result<Vec<PathBuf>> {
    let io = |source| Error::io(directory, "read the data set", source);
    let entries = std::fs::read_dir(directory).map_err(io)?;
    let mut paths = entries.map(|entry| Ok(entry.map_err(io)?.path())).collect::<Result<Vec<_>>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == ending));
    paths.sort();
    Ok(paths)
}

/// The object that a file is called like.
pub(super) fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// A text up to the end of its last whole line.
pub(super) fn whole_lines(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |last| last + 1);
    &bytes[..end]
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
