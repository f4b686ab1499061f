//! A journal that may still be growing.

use crate::chip::Entry;
use crate::error::{ChipProblem, Error, Place, Result};
use std::fs::{File, Metadata};
use std::io::{BufRead, BufReader, Seek};
use std::path::{Path, PathBuf};

/// Reads a journal's entries as they come.
#[derive(Debug)]
pub struct Follow {
    path: PathBuf,
    reader: BufReader<File>,
    /// A line that is not complete yet.
    partial: String,
    line: u64,
}

impl Follow {
    /// Begins at the journal's first line.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|source| Error::io(path, "read the journal", source))?;
        Ok(Self { path: path.into(), reader: BufReader::new(file), partial: String::new(), line: 0 })
    }

    /// The next entry; `None` while there is no further line. Where another journal has taken this one's place, its first
    /// entry follows the last of the old one.
    ///
    /// # Errors
    /// When a line is not an entry.
    pub fn next_entry(&mut self) -> Result<Option<Entry>> {
        if let Some(entry) = self.read()? {
            return Ok(Some(entry));
        }
        if self.is_replaced()? {
            *self = Self::open(&self.path)?;
            return self.read();
        }
        Ok(None)
    }

    fn read(&mut self) -> Result<Option<Entry>> {
        let read = self.reader.read_line(&mut self.partial);
        read.map_err(|source| Error::io(&self.path, "read the journal", source))?;
        if !self.partial.ends_with('\n') {
            return Ok(None);
        }
        self.line += 1;
        let entry = serde_json::from_str(&self.partial).map_err(|error| {
            Error::at(Place::line(&self.path, self.line), ChipProblem::NotAnEntry { reason: error.to_string() })
        })?;
        self.partial.clear();
        Ok(Some(entry))
    }

    /// True if the path now names another file, or the file is shorter than the part already read.
    fn is_replaced(&mut self) -> Result<bool> {
        let io = |source| Error::io(&self.path, "read the journal", source);
        // Between the old file and the new one there may be none.
        let Ok(named) = std::fs::metadata(&self.path) else { return Ok(false) };
        let open = self.reader.get_ref().metadata().map_err(io)?;
        let position = self.reader.stream_position().map_err(io)?;
        Ok(!is_same(&open, &named) || open.len() < position)
    }
}

#[cfg(unix)]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    a.created().ok() == b.created().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::Journal;
    use std::io::Write;

    fn object(name: &str) -> Entry {
        Entry::Object { name: Some(name.into()) }
    }

    #[test]
    fn lines_are_read_once_they_are_complete_and_wrong_ones_are_named() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let mut follow = Follow::open(file.path()).unwrap();
        assert_eq!(follow.next_entry().unwrap(), None);
        write!(file, r#"{{"is":"object","na"#).unwrap();
        assert_eq!(follow.next_entry().unwrap(), None);
        writeln!(file, r#"me":"spoon"}}"#).unwrap();
        assert_eq!(follow.next_entry().unwrap(), Some(object("spoon")));
        assert_eq!(follow.next_entry().unwrap(), None);
        writeln!(file, "nonsense").unwrap();
        assert!(follow.next_entry().unwrap_err().to_string().contains(":2: not an entry of a journal"));
    }

    #[test]
    fn a_journal_that_is_begun_again_while_it_is_followed_is_read_from_its_first_line() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal.jsonl");
        let mut old = Journal::create(&path).unwrap();
        old.write(&object("a long name, so that the old journal is longer")).unwrap();
        let mut follow = Follow::open(&path).unwrap();
        assert!(follow.next_entry().unwrap().is_some());
        old.write(&object("last")).unwrap();
        let mut new = Journal::create(&path).unwrap();
        new.write(&object("first")).unwrap();
        new.write(&object("second")).unwrap();
        let seen: Vec<Entry> = std::iter::from_fn(|| follow.next_entry().unwrap()).collect();
        assert_eq!(seen, [object("last"), object("first"), object("second")]);
    }

    #[test]
    fn a_journal_that_is_truncated_while_it_is_followed_is_read_from_its_first_line() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let line = |entry: &Entry| serde_json::to_string(entry).unwrap() + "\n";
        file.write_all((line(&object("a long name, so that the old journal is longer")) + "{\"half").as_bytes())
            .unwrap();
        let mut follow = Follow::open(file.path()).unwrap();
        assert!(follow.next_entry().unwrap().is_some());
        assert_eq!(follow.next_entry().unwrap(), None);
        std::fs::write(file.path(), line(&object("first"))).unwrap();
        assert_eq!(follow.next_entry().unwrap(), Some(object("first")));
        assert_eq!(follow.next_entry().unwrap(), None);
    }

    #[test]
    fn a_journal_that_is_removed_is_waited_for() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal.jsonl");
        drop(Journal::create(&path).unwrap());
        let mut follow = Follow::open(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(follow.next_entry().unwrap(), None);
        Journal::create(&path).unwrap().write(&object("first")).unwrap();
        assert_eq!(follow.next_entry().unwrap(), Some(object("first")));
    }

    #[cfg(unix)]
    #[test]
    fn a_journal_through_a_link_leaves_the_link() {
        let directory = tempfile::tempdir().unwrap();
        let (target, link) = (directory.path().join("target"), directory.path().join("link"));
        Journal::create(&target).unwrap().write(&object("old")).unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        Journal::create(&link).unwrap().write(&object("first")).unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(Follow::open(&target).unwrap().next_entry().unwrap(), Some(object("first")));
        assert!(Journal::create(Path::new("/dev/null")).is_ok() && !Path::new("/dev/null").is_file());
    }
}
