//! A link to an emulated chip.

use super::Transport;
use super::qemu::{self, Qemu};
use crate::error::Result;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

/// Program to start for the port `emulator`.
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
        Self { program: qemu::PROGRAM.into(), firmware, machine: machine.into() }
    }

    /// Starts it; its UART is the transport.
    ///
    /// # Errors
    /// When the firmware has not been built, or the emulator is not installed.
    pub fn start(&self) -> Result<Transport> {
        if !self.firmware.is_file() {
            return Err(qemu::no_image(&self.firmware));
        }
        let mut command = Command::new(&self.program);
        command.args(["-machine", &self.machine, "-display", "none", "-serial", "stdio"]);
        command.args(["-semihosting-config", "enable=on,target=native"]).arg("-kernel").arg(&self.firmware);
        let (qemu, stdin, stdout) = Qemu::start(command)?;
        // The emulated UART writes each byte by itself: waking up for each would cost more than all the rest.
        let gather = Duration::from_micros(300);
        Ok(Transport::new("emulator".into(), stdout, stdin, gather).with_emulator(qemu))
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_the_emulator_complains_about_is_shown() {
        // Stands in for QEMU: it does not know these options either, says so on standard error, and ends.
        let firmware = tempfile::NamedTempFile::new().unwrap();
        let emulator = Emulator { program: "cat".into(), ..Emulator::for_firmware(firmware.path().into()) };
        let mut transport = emulator.start().unwrap();
        let error = loop {
            if let Err(error) = transport.receive(Duration::from_secs(60)) {
                break error.to_string();
            }
        };
        assert!(error.starts_with("emulator: the emulator ended: cat: "), "{error}");
        assert!(error.contains("option") && error.contains("Check that the firmware image"), "{error}");
    }

    #[test]
    fn a_missing_image_and_a_missing_emulator_are_distinguished() {
        let start = |emulator: Emulator| emulator.start().err().unwrap().to_string();
        let error = start(Emulator::for_firmware("no/such/uart".into()));
        assert!(error.starts_with("the firmware image no/such/uart does not exist. Build it: cd onboard"), "{error}");
        let firmware = tempfile::NamedTempFile::new().unwrap();
        let emulator = Emulator::for_firmware(firmware.path().into());
        let error = start(Emulator { program: "no-such-qemu".into(), ..emulator });
        assert!(error.starts_with("no-such-qemu: the emulator is not installed. Install it"), "{error}");
    }
}
