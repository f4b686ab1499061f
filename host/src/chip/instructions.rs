//! Instructions per touch, measured: a compiled model runs on an emulated chip.
//!
//! The firmware's `cost` image (`onboard/firmware`, `cargo build --release --bin cost`) reads from the machine's external
//! RAM, where QEMU's loader puts it, in little endian: the model's length and the number of touches (u32 each), the
//! model, then 24 bytes per touch: three contact times in microseconds (u32, the largest for a missing one), direction and
//! alignment in Q15 (i16, zeros without a pose).

use super::qemu;
use crate::error::{Error, Result, problem};
use palpate_shared::Touch;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A chip that can be emulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chip {
    /// Code for a Cortex-M4F.
    M4F,
    /// Code for a Cortex-M0+, on a Cortex-M3, which runs it unchanged.
    M0Plus,
}

/// Instructions per touch, on average.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// From contact times to the objects' margins.
    pub margins: u64,
    /// With evidence and stopping: to the verdict.
    pub push: u64,
}

/// Touches that the image averages over, at most.
pub const TOUCHES: usize = 64;

/// Longer than any model takes.
const PATIENCE: Duration = Duration::from_secs(120);

impl Chip {
    /// Path of the image that `cargo build --release` in `onboard/firmware` makes, from the project's folder.
    pub(crate) fn image(self) -> PathBuf {
        let target = match self {
            Self::M4F => "thumbv7em-none-eabihf",
            Self::M0Plus => "thumbv6m-none-eabi",
        };
        ["onboard/firmware/target", target, "release/cost"].iter().collect()
    }

    /// Reason why instructions cannot be measured here: no emulator, or no image. `None` if they can be.
    pub fn obstacle(self) -> Option<Error> {
        if !qemu::is_installed(Path::new(qemu::PROGRAM)) {
            return Some(qemu::no_emulator());
        }
        let path = self.image();
        (!path.is_file()).then(|| qemu::no_image(&path))
    }

    /// True if instructions can be measured here.
    pub fn is_there(self) -> bool {
        self.obstacle().is_none()
    }

    /// Runs the model on the first [`TOUCHES`] of these touches. Takes some tenths of a second.
    ///
    /// # Errors
    /// When the emulator is not installed, the image has not been built, or the image reports an error.
    pub fn measure(self, model: &[u8], touches: &[Touch]) -> Result<Cost> {
        let machine = match self {
            Self::M4F => "mps2-an386",
            Self::M0Plus => "mps2-an385",
        };
        let io = |source| Error::io("the emulator's input", "write", source);
        let mut input = tempfile::NamedTempFile::new().map_err(io)?;
        input.write_all(&loaded(model, touches)).and_then(|()| input.flush()).map_err(io)?;
        let mut command = Command::new(qemu::PROGRAM);
        command.args(["-machine", machine, "-display", "none", "-serial", "none", "-monitor", "none"]);
        command.args(["-icount", "shift=0", "-semihosting-config", "enable=on,target=native"]);
        // A comma in a name is doubled for QEMU.
        let file = input.path().display().to_string().replace(',', ",,");
        command.arg("-device").arg(format!("loader,file={file},addr=0x21000000,force-raw=on"));
        command.arg("-kernel").arg(self.image());
        read_cost(&qemu::output(command, PATIENCE)?)
    }
}

fn loaded(model: &[u8], touches: &[Touch]) -> Vec<u8> {
    let touches = &touches[..touches.len().min(TOUCHES)];
    let mut bytes = Vec::with_capacity(8 + model.len() + 24 * touches.len());
    for length in [model.len(), touches.len()] {
        bytes.extend((length as u32).to_le_bytes());
    }
    bytes.extend(model);
    for touch in touches {
        bytes.extend(touch.times().iter().flat_map(|time| time.micros().unwrap_or(u32::MAX).to_le_bytes()));
        let [direction, alignment] = touch.pose().map_or([[0; 3]; 2], |pose| [pose.direction, pose.alignment]);
        bytes.extend(direction.into_iter().chain(alignment).flat_map(i16::to_le_bytes));
    }
    bytes
}

/// Reads the output of the image, which QEMU passes on to its standard error.
fn read_cost(text: &str) -> Result<Cost> {
    let after = |name: &str| text.split_whitespace().skip_while(|&word| word != name).nth(1)?.parse().ok();
    match (after("margins"), after("push")) {
        (Some(margins), Some(push)) => Ok(Cost { margins, push }),
        _ => {
            let said = qemu::after_colon(text);
            Err(problem!("the emulated chip did not report the instructions of a touch{said}").fix(qemu::BUILD_AGAIN))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_shared::Pose;

    #[test]
    fn what_is_loaded_is_as_long_as_it_says() {
        let pose = Pose { direction: [1, 2, 3], alignment: [-1, -2, -3] };
        let touches = [Touch::from_micros([0, 256, 7]), Touch::from_micros([5, 0, 9]).with_pose(pose)];
        let bytes = loaded(b"model", &touches);
        assert_eq!(bytes.len(), 8 + 5 + 2 * 24);
        assert_eq!(bytes[..13], *b"\x05\0\0\0\x02\0\0\0model");
        assert_eq!(bytes[17..21], [0, 1, 0, 0]);
        assert_eq!(bytes[bytes.len() - 12..], [1, 0, 2, 0, 3, 0, 255, 255, 254, 255, 253, 255]);
        assert_eq!(loaded(b"", &[touches[0]; 100]).len(), 8 + TOUCHES * 24);
    }

    #[test]
    fn an_answer_is_read_and_anything_else_is_refused() {
        assert_eq!(read_cost("margins 12 push 345\n").unwrap(), Cost { margins: 12, push: 345 });
        let error = read_cost("what was loaded is no model\n").unwrap_err().to_string();
        assert!(error.contains("what was loaded is no model"), "{error}");
    }
}
