//! QEMU as a child process: started, its messages kept, reset, ended.

use crate::error::{Error, Place, Result, problem};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// QEMU for Arm, found on the path.
pub(super) const PROGRAM: &str = "qemu-system-arm";

/// Bytes of standard error that are kept.
const KEPT: usize = 4096;

/// A running emulator, ended when it is dropped.
pub(super) struct Qemu {
    child: Child,
    /// Reads standard error until it ends.
    messages: Option<JoinHandle<String>>,
    /// The folder of the monitor's socket.
    #[cfg_attr(not(unix), allow(dead_code, reason = "there it only has to be removed in the end"))]
    directory: tempfile::TempDir,
}

impl Qemu {
    /// Starts `command` with pipes to its standard streams, and a monitor where the system has Unix sockets.
    ///
    /// # Errors
    /// When the program is not installed or cannot be started.
    pub(super) fn start(mut command: Command) -> Result<(Self, ChildStdin, ChildStdout)> {
        let directory = tempfile::tempdir().map_err(|source| Error::io("the emulator's folder", "create", source))?;
        let monitor = match cfg!(unix) {
            true => format!("unix:{},server=on,wait=off", monitor(directory.path()).display()),
            false => "none".into(),
        };
        command.args(["-monitor", "none", "-qmp"]).arg(monitor);
        let mut child = spawn(command.stdin(Stdio::piped()))?;
        let streams = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(stdin), Some(stdout), Some(stderr)) = streams else {
            unreachable!("the command was given three pipes");
        };
        let messages = std::thread::spawn(move || read_last(stderr, KEPT));
        Ok((Self { child, messages: Some(messages), directory }, stdin, stdout))
    }

    /// Ends it, and returns the last it wrote to standard error.
    pub(super) fn end(&mut self) -> String {
        // An error means that it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
        self.messages.take().and_then(|thread| thread.join().ok()).unwrap_or_default()
    }

    /// Resets the chip, as its reset button does, and returns when that has happened: over QEMU's machine protocol, one
    /// line of JSON for each command, answer and event.
    ///
    /// # Errors
    /// When the monitor does not answer, or the system has no Unix sockets.
    #[cfg(unix)]
    pub(super) fn reset(&self) -> Result<()> {
        use std::io::{BufRead, BufReader, Write};
        let path = monitor(self.directory.path());
        let io = |source| Error::io(&path, "reset the emulated chip", source);
        let mut monitor = std::os::unix::net::UnixStream::connect(&path).map_err(io)?;
        monitor.set_read_timeout(Some(Duration::from_secs(30))).map_err(io)?;
        let mut lines = BufReader::new(monitor.try_clone().map_err(io)?).lines();
        let mut wait_for = |key: &str, value: Option<&str>| -> std::io::Result<()> {
            for line in &mut lines {
                let message: serde_json::Value = serde_json::from_str(&line?)?;
                if message.get(key).is_some_and(|found| value.is_none_or(|value| found == value)) {
                    return Ok(());
                }
            }
            Err(ErrorKind::UnexpectedEof.into())
        };
        wait_for("QMP", None).map_err(io)?;
        writeln!(monitor, r#"{{"execute":"qmp_capabilities"}}"#).map_err(io)?;
        wait_for("return", None).map_err(io)?;
        writeln!(monitor, r#"{{"execute":"system_reset"}}"#).map_err(io)?;
        wait_for("event", Some("RESET")).map_err(io)
    }

    #[cfg(not(unix))]
    pub(super) fn reset(&self) -> Result<()> {
        Err(no_reset())
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        self.end();
    }
}

/// Runs `command` to its end, and returns its standard output and standard error.
///
/// # Errors
/// When it cannot be started, or has not ended after `patience`.
pub(super) fn output(mut command: Command, patience: Duration) -> Result<String> {
    let mut child = spawn(command.stdin(Stdio::null()))?;
    // Both pipes are read while the program runs: it would wait forever once one of them is full.
    let stdout = child.stdout.take().map(|pipe| std::thread::spawn(|| read_last(pipe, usize::MAX)));
    let stderr = child.stderr.take().map(|pipe| std::thread::spawn(|| read_last(pipe, usize::MAX)));
    let io = |source| Error::io(command.get_program(), "wait for the emulator", source);
    let began = Instant::now();
    let mut late = false;
    while child.try_wait().map_err(io)?.is_none() {
        if began.elapsed() > patience {
            late = true;
            child.kill().and_then(|()| child.wait()).map_err(io)?;
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let text: String = [stdout, stderr].into_iter().flatten().filter_map(|thread| thread.join().ok()).collect();
    if late {
        let (seconds, said) = (patience.as_secs(), after_colon(&text));
        return Err(problem!("the emulated chip did not finish within {seconds} s{said}").fix(BUILD_AGAIN));
    }
    Ok(text)
}

/// Remedy where the image that reports instructions does not.
pub(super) const BUILD_AGAIN: &str = "Build its image again: cd onboard/firmware && cargo build --release --bin cost.";

/// Words of a program after a colon; nothing if it said nothing.
pub(super) fn after_colon(said: &str) -> String {
    if said.trim().is_empty() { String::new() } else { format!(": {}", said.trim()) }
}

pub(super) fn no_reset() -> Error {
    problem!("the chip cannot be reset from here").fix("Reset it by hand, or use the emulator on Linux or macOS.")
}

pub(super) fn no_emulator() -> Error {
    problem!("the emulator is not installed").fix("Install it: apt-get install qemu-system-arm, brew install qemu.")
}

pub(super) fn no_image(path: &Path) -> Error {
    problem!("the firmware image {} does not exist", path.display())
        .fix("Build it: cd onboard/firmware && cargo build --release.")
}

/// True if `program` can be started.
pub(super) fn is_installed(program: &Path) -> bool {
    let version = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    version.is_ok_and(|status| status.success())
}

fn spawn(command: &mut Command) -> Result<Child> {
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().map_err(|source| {
        let program = PathBuf::from(command.get_program());
        match source.kind() {
            ErrorKind::NotFound => no_emulator().at(Place::file(program)),
            _ => Error::io(program, "start the emulator", source),
        }
    })
}

/// Reads until the end, and returns the last `kept` bytes as text.
fn read_last(mut pipe: impl Read, kept: usize) -> String {
    let mut text = Vec::new();
    let mut buffer = [0; 4096];
    while let Ok(count @ 1..) = pipe.read(&mut buffer) {
        text.extend_from_slice(buffer.get(..count).unwrap_or_default());
        text.drain(..text.len().saturating_sub(kept));
    }
    String::from_utf8_lossy(&text).into_owned()
}

fn monitor(directory: &Path) -> PathBuf {
    directory.join("monitor")
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_writes_more_than_a_pipe_holds_does_not_stall() {
        let mut command = Command::new("sh");
        command.args(["-c", "head -c 300000 /dev/zero; head -c 300000 /dev/zero >&2; echo done >&2"]);
        let text = output(command, Duration::from_secs(60)).unwrap();
        assert_eq!(text.len(), 600_000 + "done\n".len());
        assert!(text.ends_with("done\n"));
    }

    #[test]
    fn a_program_that_does_not_end_is_ended() {
        let mut command = Command::new("sleep");
        command.arg("1000");
        let error = output(command, Duration::ZERO).unwrap_err().to_string();
        assert!(error.starts_with("the emulated chip did not finish within 0 s. Build its image again"), "{error}");
    }

    #[test]
    fn only_the_last_messages_are_kept() {
        assert_eq!(read_last(&[b'a'; 10_000][..], 100), "a".repeat(100));
        assert_eq!(read_last(&b"all of it"[..], 100), "all of it");
    }

    #[test]
    fn a_program_that_is_not_installed_is_named() {
        let error = output(Command::new("no-such-emulator"), Duration::ZERO).unwrap_err().to_string();
        assert!(error.starts_with("no-such-emulator: the emulator is not installed. Install it"), "{error}");
        assert!(!is_installed(Path::new("no-such-emulator")));
    }
}
