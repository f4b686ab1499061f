//! Files and directories that appear whole or not at all.

use crate::error::{Error, Result};
use std::fs::{File, TryLockError};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Prefix and suffix of the temporary names.
const PREFIX: &str = ".palpate-";
const SUFFIX: &str = ".tmp";

/// Removes the temporary files that killed writers left in a directory. Only for one who knows that nobody else is
/// writing into it.
///
/// # Errors
/// [`Kind::Io`](crate::error::Kind::Io) naming the directory or the file.
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

/// Locks a directory for one writer, by the file `.lock` in it; none if another has it. The operating system takes the
/// lock back when the file is closed, even from a process that is killed.
///
/// # Errors
/// [`Kind::Io`](crate::error::Kind::Io) naming the file.
pub fn lock(directory: &Path) -> Result<Option<File>> {
    let path = directory.join(".lock");
    let io = |error| Error::io(&path, "lock the directory", error);
    let file = File::options().write(true).create(true).truncate(false).open(&path).map_err(io)?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(io(error)),
    }
}

/// Destination of writing to a path.
enum Target {
    /// The program's own standard output: `-`, `/dev/stdout`.
    Stdout,
    /// A device, a pipe, or another open file (`/dev/fd/3`): written as it goes.
    Stream(PathBuf),
    /// A regular file, or none yet: replaced as a whole.
    File(PathBuf),
}

/// Follows symbolic links, so that what they lead to is written and they stay. A link may lead to nothing yet.
fn target(path: &Path) -> std::io::Result<Target> {
    let mut path = path.to_owned();
    // As many links as Linux follows.
    for _ in 0..40 {
        if is_stdout(&path) {
            return Ok(Target::Stdout);
        }
        // These look like links to the files that are open, which must not be replaced under their readers.
        if path.starts_with("/dev/fd") || path.starts_with("/proc/self/fd") || path == Path::new("/dev/stderr") {
            return Ok(Target::Stream(path));
        }
        match std::fs::symlink_metadata(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Target::File(path)),
            Err(error) => return Err(error),
            Ok(metadata) if metadata.is_symlink() => path = directory_of(&path).join(std::fs::read_link(&path)?),
            Ok(metadata) if metadata.is_file() || metadata.is_dir() => return Ok(Target::File(path)),
            Ok(_) => return Ok(Target::Stream(path)),
        }
    }
    Err(std::io::Error::other("a circle of symbolic links"))
}

fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// True if writing to this path means the program's standard output: `-`, and what systems call it.
pub fn is_stdout(path: &Path) -> bool {
    ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].iter().any(|stdout| path == Path::new(stdout))
}

/// Writes `path` through `fill`: to a temporary name beside it, flushed to the disk, then renamed, so that neither an
/// error nor a power cut leaves a half-written file, and an older file stays until the new one is complete. Missing
/// directories above it are made.
///
/// A symbolic link stays one: what it leads to is written. Devices and pipes are written directly, and `-` is standard
/// output.
///
/// # Errors
/// Errors of `fill`; [`Kind::Io`](crate::error::Kind::Io) naming `path`; [`Kind::Closed`](crate::error::Kind::Closed) if the reader of standard output went away.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let io = |source| Error::io(path, "write", source);
    match target(path).map_err(io)? {
        Target::Stdout => {
            let mut writer = BufWriter::with_capacity(1 << 16, std::io::stdout().lock());
            fill(&mut writer).and_then(|()| writer.flush()).map_err(to_stdout)
        }
        Target::Stream(stream) => {
            let file = File::options().append(true).open(stream).map_err(io)?;
            let mut writer = BufWriter::with_capacity(1 << 16, file);
            fill(&mut writer).and_then(|()| writer.flush()).map_err(io)
        }
        Target::File(file) => replace(&file, fill).map_err(io),
    }
}

/// Writes a regular file, whole or not at all.
fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> std::io::Result<()> {
    let directory = directory_of(path);
    std::fs::create_dir_all(directory)?;
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.prefix(PREFIX).suffix(SUFFIX).tempfile_in(directory)?;
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    fill(&mut writer)?;
    let file = writer.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// A directory that is written beside its place, and appears there as a whole. What is dropped unfinished is removed.
pub struct Folder {
    unfinished: tempfile::TempDir,
    place: PathBuf,
}

impl Folder {
    /// Begins what is to become the directory `place`; missing directories above it are made.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting), `output`, if the program runs in that directory; [`Kind::Io`](crate::error::Kind::Io) naming it.
    pub fn begin(place: &Path) -> Result<Self> {
        let io = |error| Error::io(place, "make the directory", error);
        // A symbolic link stays one.
        let place = match place.canonicalize() {
            Err(error) if error.kind() == ErrorKind::NotFound => place.to_owned(),
            place => place.map_err(io)?,
        };
        if std::env::current_dir().is_ok_and(|current| current.starts_with(&place)) {
            return Err(Error::setting("output", place.display(), "another directory than the current one"));
        }
        let parent = directory_of(&place);
        std::fs::create_dir_all(parent).map_err(io)?;
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o777));
        }
        let unfinished = builder.prefix(PREFIX).suffix(".unfinished").tempdir_in(parent).map_err(io)?;
        Ok(Self { unfinished, place })
    }

    /// Its path until it is finished.
    pub fn path(&self) -> &Path {
        self.unfinished.path()
    }

    /// Puts the directory in its place. Of one that is there, these files are removed, by their paths in it, and others stay.
    ///
    /// # Errors
    /// [`Kind::Io`](crate::error::Kind::Io) naming the directory.
    pub fn finish(self, replaced: &[PathBuf]) -> Result<()> {
        let Self { unfinished, place } = self;
        let put = || {
            if place.is_dir() {
                keep_others(&place, unfinished.path(), Path::new(""), replaced)?;
                std::fs::remove_dir_all(&place)?;
            }
            std::fs::rename(unfinished.path(), &place)
        };
        put().map_err(|error| Error::io(&place, "put the directory in its place", error))?;
        // There is nothing left to remove.
        _ = unfinished.keep();
        Ok(())
    }
}

/// Moves what the directory `inner` below `from` holds to where it is below `to`, except the files `replaced` and what is there
/// already.
fn keep_others(from: &Path, to: &Path, inner: &Path, replaced: &[PathBuf]) -> std::io::Result<()> {
    for entry in std::fs::read_dir(from.join(inner))? {
        let path = inner.join(entry?.file_name());
        let moved = to.join(&path);
        if replaced.contains(&path) {
            continue;
        }
        if replaced.iter().any(|own| own.starts_with(&path)) {
            std::fs::create_dir_all(&moved)?;
            keep_others(from, to, &path, replaced)?;
            // Of a directory that held nothing else, nothing stays.
            _ = std::fs::remove_dir(&moved);
        } else if !moved.exists() {
            std::fs::rename(from.join(&path), moved)?;
        }
    }
    Ok(())
}

/// Refuses to write onto what is being read, before any work is done: the file `output` must be none of the `inputs`.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting), `output`.
pub fn admit<P: AsRef<Path>>(output: &Path, inputs: impl IntoIterator<Item = P>) -> Result<()> {
    let Ok(written) = output.canonicalize() else { return Ok(()) };
    let is_written = |input: P| written.is_file() && input.as_ref().canonicalize().is_ok_and(|input| input == written);
    if inputs.into_iter().any(is_written) {
        return Err(Error::setting("output", output.display(), "another file than what is read"));
    }
    Ok(())
}

/// Refuses `-` where a directory belongs.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting), `output`.
pub fn refuse_stdout(directory: &Path) -> Result<()> {
    if is_stdout(directory) {
        return Err(Error::setting("output", "standard output", "a directory: several files are written"));
    }
    Ok(())
}

/// Writes `bytes` to `path` as [`write_whole`] does.
///
/// # Errors
/// [`Kind::Io`](crate::error::Kind::Io) naming `path`.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |out| out.write_all(bytes))
}

/// Writes `value` to `path` as indented JSON with a final newline, as [`write_whole`] does.
///
/// # Errors
/// Errors of [`write_whole`].
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    write_whole(path, |mut out| {
        serde_json::to_writer_pretty(&mut out, value)?;
        out.write_all(b"\n")
    })
}

/// Prints to standard output; a reader that went away is [`Kind::Closed`](crate::error::Kind::Closed).
///
/// # Errors
/// [`Kind::Closed`](crate::error::Kind::Closed), or [`Kind::Io`](crate::error::Kind::Io).
pub fn print(text: &str) -> Result<()> {
    HAS_PRINTED.store(true, Ordering::Relaxed);
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(to_stdout)
}

/// True once [`print()`] was called.
static HAS_PRINTED: AtomicBool = AtomicBool::new(false);

/// True if something was printed to standard output by this process, or its printing was tried.
pub fn has_printed() -> bool {
    HAS_PRINTED.load(Ordering::Relaxed)
}

fn to_stdout(source: std::io::Error) -> Error {
    match source.kind() {
        ErrorKind::BrokenPipe => Error::closed(),
        _ => Error::io("standard output", "write", source),
    }
}

/// Prints what there is to say about the file at `path`: to standard output, or to standard error where the file itself
/// went to standard output.
///
/// # Errors
/// Errors of [`print()`].
pub fn print_about(path: &Path, text: &str) -> Result<()> {
    if !matches!(target(path), Ok(Target::Stdout)) {
        return print(text);
    }
    std::io::stderr().lock().write_all(text.as_bytes()).map_err(|error| Error::io("standard error", "write", error))
}

/// Prints `value` to standard output as indented JSON.
///
/// # Errors
/// Errors of [`print()`].
pub fn print_json(value: &impl serde::Serialize) -> Result<()> {
    print(&json(value)?)
}

/// Prints `value` as indented JSON where [`print_about`] prints.
///
/// # Errors
/// Errors of [`print()`].
pub fn print_json_about(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    print_about(path, &json(value)?)
}

fn json(value: &impl serde::Serialize) -> Result<String> {
    let text = serde_json::to_string_pretty(value).map_err(|error| to_stdout(error.into()))?;
    Ok(text + "\n")
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

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_stays_one_and_what_it_leads_to_is_written() {
        let directory = tempfile::tempdir().unwrap();
        let [link, second, file] = ["link", "second", "deep/model"].map(|name| directory.path().join(name));
        std::fs::create_dir(directory.path().join("deep")).unwrap();
        std::os::unix::fs::symlink("second", &link).unwrap();
        std::os::unix::fs::symlink("deep/model", &second).unwrap();
        // To nothing yet, then to a file.
        for text in ["new", "newer"] {
            write_bytes(&link, text.as_bytes()).unwrap();
            assert!(link.is_symlink() && second.is_symlink());
            assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
        }
        std::fs::remove_file(&second).unwrap();
        std::os::unix::fs::symlink("link", &second).unwrap();
        assert!(write_bytes(&link, b"lost").unwrap_err().to_string().contains("a circle of symbolic links"));
    }

    /// A link to a device in a directory of its own: should a device ever be replaced, it is only the link.
    #[cfg(target_os = "linux")]
    fn device(name: &str) -> (tempfile::TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let link = directory.path().join("device");
        std::os::unix::fs::symlink(Path::new("/dev").join(name), &link).unwrap();
        (directory, link)
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_is_written_and_not_replaced_by_a_file() {
        let (_directory, null) = device("null");
        write_bytes(&null, &[7; 100_000]).unwrap();
        assert!(!null.metadata().unwrap().is_file() && null.is_symlink());
        let (_directory, full) = device("full");
        let error = write_bytes(&full, b"something").unwrap_err().to_string();
        assert!(error.contains("device: cannot write: No space left on device"), "{error}");
        assert!(!full.metadata().unwrap().is_file() && full.is_symlink());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_pipe_is_written_and_not_replaced_by_a_file() {
        let directory = tempfile::tempdir().unwrap();
        let pipe = directory.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read_to_string(pipe).unwrap()
        });
        write_bytes(&pipe, b"through the pipe").unwrap();
        assert_eq!(reader.join().unwrap(), "through the pipe");
        assert!(!pipe.metadata().unwrap().is_file());
    }

    #[test]
    fn the_file_that_is_read_is_not_written() {
        let directory = tempfile::tempdir().unwrap();
        let [input, other] = ["input.json", "other.json"].map(|name| directory.path().join(name));
        std::fs::write(&input, "").unwrap();
        let roundabout = directory.path().join("..").join(directory.path().file_name().unwrap()).join("input.json");
        let error = admit(&roundabout, [&other, &input]).unwrap_err();
        assert!(error.to_string().contains("Use another file than what is read."), "{error}");
        assert_eq!(error.exit_code(), 2);
        admit(&other, [&input]).unwrap();
        std::fs::write(&other, "").unwrap();
        admit(&other, [&input]).unwrap();
        admit(directory.path(), [directory.path()]).unwrap();
    }

    #[test]
    fn a_folder_appears_as_a_whole_and_keeps_what_it_does_not_replace() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("deep/data");
        let names = |of: &Path| {
            let mut names: Vec<_> = std::fs::read_dir(of).unwrap().map(|entry| entry.unwrap().file_name()).collect();
            names.sort();
            names
        };
        let written = |names: &[&str], replaced: &[&str]| {
            let folder = Folder::begin(&place).unwrap();
            names.iter().for_each(|name| std::fs::write(folder.path().join(name), *name).unwrap());
            folder.finish(&replaced.iter().map(PathBuf::from).collect::<Vec<_>>()).unwrap();
        };
        let unfinished = Folder::begin(&place).unwrap();
        std::fs::write(unfinished.path().join("a.txt"), "").unwrap();
        assert!(!place.exists());
        drop(unfinished);
        assert_eq!(names(place.parent().unwrap()).len(), 0, "nothing is left of what was not finished");
        written(&["a.txt", "b.txt"], &[]);
        std::fs::write(place.join("notes.md"), "mine").unwrap();
        std::fs::write(place.join("c.txt"), "old").unwrap();
        written(&["a.txt", "c.txt"], &["a.txt", "b.txt"]);
        assert_eq!(names(&place), ["a.txt", "c.txt", "notes.md"]);
        assert_eq!(std::fs::read_to_string(place.join("c.txt")).unwrap(), "c.txt");
        assert_eq!(names(place.parent().unwrap()), ["data"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_is_as_readable_as_any_and_a_link_to_one_stays() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let [place, link, plain] = ["data", "link", "plain"].map(|name| directory.path().join(name));
        [&place, &plain].into_iter().for_each(|made| std::fs::create_dir(made).unwrap());
        std::os::unix::fs::symlink("data", &link).unwrap();
        Folder::begin(&link).unwrap().finish(&[]).unwrap();
        assert!(link.is_symlink() && place.is_dir());
        let [mode, usual] = [&place, &plain].map(|made| made.metadata().unwrap().permissions().mode());
        assert_eq!(mode, usual);
    }

    #[test]
    fn a_dash_is_standard_output_and_no_directory() {
        assert!(is_stdout(Path::new("-")) && is_stdout(Path::new("/dev/stdout")));
        assert!(!is_stdout(Path::new("./-")) && !is_stdout(Path::new("model.palpate")));
        assert_eq!(refuse_stdout(Path::new("-")).unwrap_err().exit_code(), 2);
        refuse_stdout(Path::new("data")).unwrap();
    }
}
