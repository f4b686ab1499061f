//! An emulated chip.

use super::Transport;
use super::transport::Running;
use crate::error::{Error, Result};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// What to start for the port `emulator`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Emulator {
    /// The program: QEMU for Arm.
    pub program: PathBuf,
    /// The firmware image, an ELF file.
    pub firmware: PathBuf,
    /// The emulated machine.
    pub machine: String,
}

impl Default for Emulator {
    /// QEMU from the path, with the firmware where `cargo build --release` in `onboard/firmware` puts it, seen from the
    /// project's folder.
    fn default() -> Self {
        Self::for_firmware("onboard/firmware/target/thumbv7em-none-eabihf/release/uart".into())
    }
}

impl Emulator {
    /// QEMU from the path with a Cortex-M4F, or a Cortex-M3 if the image's folder says that it is for thumbv6m.
    pub fn for_firmware(firmware: PathBuf) -> Self {
        let small = firmware.iter().any(|part| part == "thumbv6m-none-eabi");
        let machine = if small { "mps2-an385" } else { "mps2-an386" };
        Self { program: "qemu-system-arm".into(), firmware, machine: machine.into() }
    }

    /// Starts it; its UART is the transport.
    ///
    /// # Errors
    /// When the firmware has not been built, or the emulator is not installed.
    pub fn start(&self) -> Result<Transport> {
        if !self.firmware.is_file() {
            let fix = "Build it: cd onboard/firmware && cargo build --release; or name one with --firmware.";
            return Err(Error::file(&self.firmware, "the firmware is not there", fix));
        }
        let directory = tempfile::tempdir().map_err(|source| Error::io("the emulator's folder", "make", source))?;
        let mut command = Command::new(&self.program);
        command.args(["-machine", &self.machine, "-display", "none", "-serial", "stdio"]);
        command.args(["-semihosting-config", "enable=on,target=native"]);
        let monitor = if cfg!(unix) {
            format!("unix:{},server=on,wait=off", directory.path().join(MONITOR).display())
        } else {
            "none".into()
        };
        command.args(["-monitor", "none", "-qmp"]).arg(monitor).arg("-kernel").arg(&self.firmware);
        let spawned = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut child = spawned.map_err(|source| match source.kind() {
            ErrorKind::NotFound => {
                let fix = "Install it: apt-get install qemu-system-arm, brew install qemu.";
                Error::file(&self.program, "the emulator is not installed", fix)
            }
            _ => Error::io(&self.program, "start the emulator", source),
        })?;
        let (Some(stdin), Some(stdout)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(Error::data("the emulator has no serial line", "Report this as a bug."));
        };
        let running = Running { child, directory: Some(directory) };
        // The emulated UART writes each byte by itself: waking up for each would cost more than all the rest.
        let gather = Duration::from_micros(300);
        Ok(Transport::new("emulator".into(), stdout, stdin, gather).with_emulator(running))
    }
}

const MONITOR: &str = "monitor";

/// Resets the chip, as its reset button does, and returns when that has happened: over QEMU's machine protocol, a line of
/// JSON for each command, answer and event.
#[cfg(unix)]
pub(super) fn reset(directory: &Path) -> Result<()> {
    use std::io::{BufRead, BufReader, Write};
    let path = directory.join(MONITOR);
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
pub(super) fn reset(_: &Path) -> Result<()> {
    Err(Error::data("the emulator cannot be reset from here", "Run this on Linux or macOS."))
}
