//! Files that appear whole or not at all.

use crate::error::{Error, Result};
use std::io::{BufWriter, Write};
use std::path::Path;

/// How the temporary names begin and end.
const PREFIX: &str = ".palpate-";
const SUFFIX: &str = ".tmp";

/// Removes the temporary files that killed writers left in a directory. Only for one who knows that nobody else is
/// writing into it.
///
/// # Errors
/// [`Error::Io`] naming the directory or the file.
pub fn remove_leftovers(directory: &Path) -> Result<()> {
    for entry in std::fs::read_dir(directory).map_err(|error| Error::io(directory, "list", error))? {
        let entry = entry.map_err(|error| Error::io(directory, "list", error))?;
        let name = entry.file_name();
        if name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX)) {
            std::fs::remove_file(entry.path()).map_err(|error| Error::io(entry.path(), "remove", error))?;
        }
    }
    Ok(())
}

/// Writes `path` through `fill`: to a temporary name beside it, flushed to the disk, then renamed, so that neither an
/// error nor a power cut leaves a half-written file, and an older file stays until the new one is complete. Missing
/// directories above it are made.
///
/// # Errors
/// What `fill` returns, or [`Error::Io`] naming `path`.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let io = |source| Error::io(path, "write", source);
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(directory).map_err(io)?;
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.prefix(PREFIX).suffix(SUFFIX).tempfile_in(directory).map_err(io)?;
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    fill(&mut writer).map_err(io)?;
    let file = writer.into_inner().map_err(|e| io(e.into_error()))?;
    file.as_file().sync_all().map_err(io)?;
    file.persist(path).map_err(|e| io(e.error))?;
    Ok(())
}

/// Writes `bytes` to `path` as [`write_whole`] does.
///
/// # Errors
/// [`Error::Io`] naming `path`.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |out| out.write_all(bytes))
}

/// Writes `value` to `path` as indented JSON with a final newline, as [`write_whole`] does.
///
/// # Errors
/// [`Error::Io`] naming `path`.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    write_whole(path, |out| {
        serde_json::to_writer_pretty(&mut *out, value)?;
        out.write_all(b"\n")
    })
}

/// Prints to standard output; a reader that went away is [`Error::Closed`].
///
/// # Errors
/// [`Error::Closed`], or [`Error::Io`].
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|source| match source.kind() {
        std::io::ErrorKind::BrokenPipe => Error::Closed,
        _ => Error::io("standard output", "write", source),
    })
}

/// Prints `value` to standard output as indented JSON.
///
/// # Errors
/// As [`print()`].
pub fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::data(format!("cannot write the result as JSON: {e}"), "Report this as a bug."))?;
    text.push('\n');
    print(&text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_writer_left_is_removed_and_nothing_else() {
        let directory = tempfile::tempdir().unwrap();
        for name in [".palpate-x1y2.tmp", "fork.txt", ".lock"] {
            std::fs::write(directory.path().join(name), "").unwrap();
        }
        remove_leftovers(directory.path()).unwrap();
        assert!(!directory.path().join(".palpate-x1y2.tmp").exists());
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
    }

    #[test]
    fn an_error_while_writing_keeps_the_old_file_and_leaves_no_other() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("new/model.palpate");
        write_bytes(&path, b"old").unwrap();
        let error = write_whole(&path, |out| {
            out.write_all(b"half")?;
            Err(std::io::Error::from(std::io::ErrorKind::StorageFull))
        })
        .unwrap_err();
        assert!(error.to_string().contains("model.palpate: cannot write"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }
}
