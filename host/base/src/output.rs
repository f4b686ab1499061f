//! Files that appear whole or not at all, and replace nothing that Palpate did not write.

use crate::error::{Error, Foreign, Place, Result};
use palpate_shared::format::MAGIC;
use std::fs::{File, TryLockError};
use std::io::{BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Prefix and suffix of the temporary names.
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

/// Locks a directory for one writer, by the file `.lock` in it; none if another has it. The operating system takes the
/// lock back when the file is closed, even from a process that is killed.
///
/// # Errors
/// [`Error::Io`] naming the file.
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

/// True if files that Palpate did not write are replaced.
static REPLACES_FOREIGN: AtomicBool = AtomicBool::new(false);

/// Lets files be replaced that Palpate did not write, or not: for the whole process, as a program's option `--force` does.
pub fn replace_foreign(replaces: bool) {
    REPLACES_FOREIGN.store(replaces, Ordering::Relaxed);
}

/// Beginnings of files that Palpate writes.
const BEGINNINGS: [&[u8]; 9] = [
    // A compiled model, and the header that reads it in C.
    &MAGIC,
    b"/* palpate.h: recognize objects by touch",
    // A probe file, a mesh.
    b"# Found by `palpate probe ",
    b"# Written by Palpate.",
    // A page; those of versions up to 0.3.
    b"<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"generator\" content=\"Palpate ",
    b"<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, \
      initial-scale=1\"><meta name=\"color-scheme\" content=\"light dark\"><meta http-equiv=\"Content-Security-Policy\" \
      content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'",
    // The listing of a data set, the summary of a run or of a report, a journal.
    b"{\n  \"palpate\": \"",
    b"{\n  \"made_from\": {",
    b"{\"is\":\"",
];

/// Beginnings of files of which other programs write the same, and what only those of Palpate have soon after.
const WITH_MARKS: [(&[u8], &[u8], usize); 3] = [
    // An ensemble as XGBoost's JSON.
    (b"{\"learner\":{\"attributes\":{", b"\"palpate_objects\":", HEAD),
    // A log, and a picture.
    (b"\x89MCAP0\r\n", b"palpate ", 64),
    (b"\x89PNG\r\n", b"Software\0Palpate", 128),
];

/// Words in one of the first two lines of source code.
const IN_SOURCE: &[u8] = b"Written by `palpate export`; not to be edited.";

/// Number of bytes that are looked at.
const HEAD: usize = 1 << 16;

/// True if a file that starts with `head` is one of Palpate's.
fn is_own(head: &[u8]) -> bool {
    let has = |bytes: &[u8], mark: &[u8]| bytes.windows(mark.len()).any(|part| part == mark);
    BEGINNINGS.iter().any(|beginning| head.starts_with(beginning))
        || WITH_MARKS
            .iter()
            .any(|(beginning, mark, within)| head.starts_with(beginning) && has(&head[..head.len().min(*within)], mark))
        || head.split(|&byte| byte == b'\n').take(2).any(|line| has(line, IN_SOURCE))
}

/// Refuses to replace a file that Palpate did not write, unless [`replace_foreign`] allows it: its first bytes say who wrote
/// it. An empty file is nobody's.
///
/// # Errors
/// [`Foreign`] naming `path`, or [`Error::Io`].
pub fn refuse_foreign(path: &Path) -> Result<()> {
    refuse_unless(path, is_own)
}

/// Refuses to replace a file by `bytes`, of a format that has no room for a mark of Palpate's, unless its first line is the
/// same or [`replace_foreign`] allows it.
///
/// # Errors
/// Errors of [`refuse_foreign`].
pub fn refuse_unlike(path: &Path, bytes: &[u8]) -> Result<()> {
    let line = |bytes: &[u8]| bytes.split(|&byte| byte == b'\n').next().unwrap_or_default().to_vec();
    refuse_unless(path, |head| line(head) == line(bytes))
}

fn refuse_unless(path: &Path, is_own: impl Fn(&[u8]) -> bool) -> Result<()> {
    let io = |source| Error::io(path, "read what is there", source);
    if REPLACES_FOREIGN.load(Ordering::Relaxed) {
        return Ok(());
    }
    let Ok(Target::File(file)) = target(path) else { return Ok(()) };
    let mut head = Vec::new();
    match File::open(file) {
        Ok(file) if file.metadata().map_err(io)?.is_file() => {
            file.take(HEAD as u64).read_to_end(&mut head).map_err(io)?;
        }
        // A directory is refused where it is written to.
        Ok(_) => return Ok(()),
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Ok(()),
        Err(error) => return Err(io(error)),
    }
    if head.is_empty() || is_own(&head) { Ok(()) } else { Err(Error::at(Place::file(path), Foreign)) }
}

/// Writes `path` through `fill`: to a temporary name beside it, flushed to the disk, then renamed, so that neither an
/// error nor a power cut leaves a half-written file, and an older file stays until the new one is complete. Missing
/// directories above it are made. A file that Palpate did not write is [not replaced](refuse_foreign).
///
/// A symbolic link stays one: what it leads to is written. Devices and pipes are written directly, and `-` is standard
/// output.
///
/// # Errors
/// Errors of `fill`; [`Error::Io`] naming `path`; [`Foreign`]; [`Error::Closed`] if the reader of standard output went
/// away.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    refuse_foreign(path)?;
    replace_whole(path, fill)
}

/// Writes `path` as [`write_whole`] does, whoever wrote what is there: for a file that is known to be Palpate's, such as one
/// that another file of Palpate's names.
///
/// # Errors
/// Errors of [`write_whole`], except [`Foreign`].
pub fn replace_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
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

/// Refuses to write onto what is being read: the file `output` must be none of the `inputs`.
///
/// # Errors
/// [`Setting`](crate::error::Setting), `output`.
pub fn refuse_input<P: AsRef<Path>>(output: &Path, inputs: impl IntoIterator<Item = P>) -> Result<()> {
    let Ok(written) = output.canonicalize() else { return Ok(()) };
    let is_written = |input: P| written.is_file() && input.as_ref().canonicalize().is_ok_and(|input| input == written);
    if inputs.into_iter().any(is_written) {
        return Err(Error::setting("output", output.display(), "another file than what is read"));
    }
    Ok(())
}

/// Refuses an output before any work is done: what is being read, as [`refuse_input`] does, and what Palpate did not write, as
/// [`refuse_foreign`] does.
///
/// # Errors
/// Errors of both.
pub fn admit<P: AsRef<Path>>(output: &Path, inputs: impl IntoIterator<Item = P>) -> Result<()> {
    refuse_input(output, inputs)?;
    refuse_foreign(output)
}

/// Refuses `-` where a directory belongs.
///
/// # Errors
/// [`Setting`](crate::error::Setting), `output`.
pub fn refuse_stdout(directory: &Path) -> Result<()> {
    if is_stdout(directory) {
        return Err(Error::setting("output", "standard output", "a directory: several files are written"));
    }
    Ok(())
}

/// Writes `bytes` to `path` as [`write_whole`] does.
///
/// # Errors
/// [`Error::Io`] naming `path`.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |out| out.write_all(bytes))
}

/// Writes `bytes`, of a format that has no room for a mark of Palpate's, to `path` as [`write_whole`] does. What is there is
/// replaced if its first line is the same.
///
/// # Errors
/// Errors of [`write_whole`].
pub fn write_unmarked(path: &Path, bytes: &[u8]) -> Result<()> {
    refuse_unlike(path, bytes)?;
    replace_whole(path, |out| out.write_all(bytes))
}

/// Writes `value` to `path` as indented JSON with a final newline, as [`write_whole`] does.
///
/// # Errors
/// Errors of [`write_whole`].
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    write_whole(path, |out| fill_json(out, value))
}

/// Writes `value` to `path` as [`write_json`] does, and replaces what is there as [`replace_whole`] does.
///
/// # Errors
/// Errors of [`replace_whole`].
pub fn replace_json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    replace_whole(path, |out| fill_json(out, value))
}

fn fill_json(mut out: &mut dyn Write, value: &impl serde::Serialize) -> std::io::Result<()> {
    serde_json::to_writer_pretty(&mut out, value)?;
    out.write_all(b"\n")
}

/// Prints to standard output; a reader that went away is [`Error::Closed`].
///
/// # Errors
/// [`Error::Closed`], or [`Error::Io`].
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
        ErrorKind::BrokenPipe => Error::Closed,
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
        write_bytes(&path, &MAGIC).unwrap();
        let error = write_whole(&path, |out| {
            out.write_all(b"half")?;
            Err(std::io::Error::from(std::io::ErrorKind::StorageFull))
        })
        .unwrap_err();
        assert!(error.to_string().contains("model.palpate: cannot write"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), MAGIC);
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn what_palpate_did_not_write_is_not_replaced_and_what_it_wrote_is() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("there");
        let is_replaced = |there: &[u8]| {
            std::fs::write(&path, there).unwrap();
            let written = write_bytes(&path, b"new");
            match written {
                Ok(()) => assert_eq!(std::fs::read(&path).unwrap(), b"new"),
                Err(error) => {
                    assert!(error.problem::<Foreign>().is_some() && error.exit_code() == 1, "{error}");
                    assert_eq!(std::fs::read(&path).unwrap(), there);
                    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
                }
            }
            std::fs::read(&path).unwrap() == b"new"
        };
        for own in BEGINNINGS {
            assert!(is_replaced(&[own, b" and so on"].concat()), "{}", String::from_utf8_lossy(own));
            assert!(!is_replaced(&[b" ", own].concat()));
        }
        for (beginning, mark, within) in WITH_MARKS {
            assert!(is_replaced(&[beginning, b"0.3", mark].concat()));
            assert!(!is_replaced(beginning) && !is_replaced(mark));
            assert!(!is_replaced(&[beginning, &vec![b'x'; within], mark].concat()));
        }
        assert!(is_replaced(&[b"/* of ten objects\n * ", IN_SOURCE, b" */"].concat()));
        // A program with a model in it, and one that uses it.
        assert!(!is_replaced(&[b"fn main() {}\n\n// of ten objects.", IN_SOURCE].concat()));
        assert!(!is_replaced(b"//! Recognizes with palpate.\nuse palpate_onboard::Model;\n"));
        assert!(is_replaced(b"") && !is_replaced(b"v 0 0 0\n"));
    }

    #[test]
    fn a_file_without_a_mark_is_replaced_if_its_first_line_is_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("table.csv");
        for text in ["set,time\na,1\n", "set,time\na,2\n"] {
            write_unmarked(&path, text.as_bytes()).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
        assert!(write_unmarked(&path, b"set\na\n").unwrap_err().problem::<Foreign>().is_some());
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
        for text in ["# Written by Palpate.", "newer"] {
            write_bytes(&link, text.as_bytes()).unwrap();
            assert!(link.is_symlink() && second.is_symlink());
            assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
        }
        assert!(write_bytes(&link, b"newest").unwrap_err().problem::<Foreign>().is_some());
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
        let error = refuse_input(&roundabout, [&other, &input]).unwrap_err();
        assert!(error.to_string().contains("Use another file than what is read."), "{error}");
        assert_eq!(error.exit_code(), 2);
        refuse_input(&other, [&input]).unwrap();
        std::fs::write(&other, "").unwrap();
        refuse_input(&other, [&input]).unwrap();
        refuse_input(directory.path(), [directory.path()]).unwrap();
    }

    #[test]
    fn a_dash_is_standard_output_and_no_directory() {
        assert!(is_stdout(Path::new("-")) && is_stdout(Path::new("/dev/stdout")));
        assert!(!is_stdout(Path::new("./-")) && !is_stdout(Path::new("model.palpate")));
        assert_eq!(refuse_stdout(Path::new("-")).unwrap_err().exit_code(), 2);
        refuse_stdout(Path::new("data")).unwrap();
    }
}
