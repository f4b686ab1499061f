//! Problems with chips, real and emulated, and the line to them.

use crate::error::Variant;
use palpate_shared::link::{LinkError, Refusal};
use std::path::PathBuf;

/// Problems with chips, real and emulated, and the line to them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChipProblem {
    /// A port is written in a way that means nothing.
    #[error("`{text}` is not a port")]
    NotAPort {
        /// Text that was given.
        text: String,
    },
    /// This build of the library has no serial ports.
    #[error("this build of Palpate has no serial ports")]
    NoSerialPorts,
    /// The operating system cannot open a serial port.
    #[error("cannot open the serial port: {reason}")]
    CannotOpen {
        /// The operating system's message.
        reason: String,
        /// The available serial ports.
        ports: Vec<String>,
    },
    /// Nobody answers at a TCP address.
    #[error("cannot connect to the chip: {reason}")]
    CannotConnect {
        /// The operating system's message.
        reason: String,
    },
    /// The line to a chip broke while it was used.
    #[error("the connection to the chip was lost: {reason}")]
    Lost {
        /// The operating system's message.
        reason: String,
    },
    /// The chip does not answer.
    #[error("the chip does not answer: {answered} commands were executed, {uncertain} may have been")]
    Silent {
        /// Commands whose outcome is known.
        answered: u32,
        /// Commands that may have been executed or not.
        uncertain: u32,
    },
    /// The chip was reset.
    #[error("the chip was reset and kept nothing: {answered} commands are lost, and up to {uncertain} more")]
    Forgotten {
        /// Commands whose outcome was known, and whose effect is lost.
        answered: u32,
        /// Commands that may have been executed or not; if so, their effect is lost.
        uncertain: u32,
    },
    /// The chip was reset, and has another model now, or none.
    #[error("the chip was reset and has another model than before")]
    Replaced,
    /// The chip has no model.
    #[error("the chip has no model")]
    NoModel,
    /// The line to a chip has no message for a row of features.
    #[error("the model is over rows of features, and the line to a chip carries touches")]
    Rows,
    /// The chip does not obey a command.
    #[error("the chip refuses: {0}")]
    Refused(Refusal),
    /// The chip refuses a model, and keeps the one it had.
    #[error("the chip refuses the model: {0}")]
    ModelRefused(Refusal),
    /// An answer or outcome does not belong to a question or command.
    #[error("the chip's answer does not match the question")]
    UnexpectedAnswer,
    /// The chip's model is not the one that its verdicts are compared with.
    #[error("the chip's model is not the one to compare with: checksum {chip:08x} instead of {expected:08x}")]
    OtherModel {
        /// The checksum of the chip's model.
        chip: u32,
        /// The checksum of the host's model.
        expected: u32,
    },
    /// The chip's verdicts are not the host's.
    #[error("{differences} of {compared} touches differ; the first: {first}")]
    Differs {
        /// Touches with another verdict, posterior or evidence.
        differences: u64,
        /// Touches that were compared.
        compared: u64,
        /// The first difference.
        first: String,
    },
    /// The emulator is not installed.
    #[error("the emulator is not installed")]
    NoEmulator,
    /// A firmware image has not been built.
    #[error("the firmware image {} does not exist", path.display())]
    NoImage {
        /// Expected path.
        path: PathBuf,
    },
    /// The emulator ended by itself.
    #[error("the emulator ended{}", after_colon(said))]
    EmulatorEnded {
        /// Its standard error.
        said: String,
    },
    /// The emulated chip did not finish.
    #[error("the emulated chip did not finish within {seconds} s{}", after_colon(said))]
    EmulatorTimeout {
        /// Time that it was given, in seconds.
        seconds: u64,
        /// Its output.
        said: String,
    },
    /// The emulated chip says nothing about a touch's instructions.
    #[error("the emulated chip did not report the instructions of a touch{}", after_colon(said))]
    NoCost {
        /// Its output instead.
        said: String,
    },
    /// A chip that cannot be reset from here.
    #[error("the chip cannot be reset from here")]
    NoReset,
}

fn after_colon(said: &str) -> String {
    if said.trim().is_empty() { String::new() } else { format!(": {}", said.trim()) }
}

impl Variant for ChipProblem {
    fn fix(&self) -> String {
        match self {
            Self::NotAPort { .. } => "Give a serial port, tcp://HOST:PORT or emulator.",
            Self::NoSerialPorts => "Build it with the feature `serial`, or reach the chip through tcp://HOST:PORT.",
            Self::CannotOpen { ports, .. } => {
                let ports = match ports.as_slice() {
                    [] => "This machine has no serial port".to_owned(),
                    ports => format!("Serial ports of this machine: {}", ports.join(", ")),
                };
                return format!("{ports}. Check the cable, and that no other program has the port open.");
            }
            Self::CannotConnect { .. } => "Check the address, and that a program serves the chip there.",
            Self::Lost { .. } => {
                "Check the cable and the chip's power, or the program at the other end of a TCP connection; then start \
                 again."
            }
            Self::Silent { .. } => {
                return format!(
                    "Check the port, its speed and the cable, and that the chip's program speaks link version {}.",
                    palpate_shared::link::VERSION
                );
            }
            Self::Forgotten { .. } => "Start again.",
            Self::Replaced => {
                "Load the model again. The chip's flash may be worn, or its program may have been replaced by one without \
                 the model's features."
            }
            Self::NoModel | Self::Refused(Refusal::NoModel) => "Load a model into it.",
            Self::Rows => {
                "Recognize rows here with `palpate recognize MODEL ROWS.csv --features`; on the chip the program itself \
                 passes them to push_features, and its verdicts are the same."
            }
            Self::Refused(Refusal::NoObject) => "Load the model again.",
            Self::Refused(Refusal::Position) => {
                "Load maps, which `palpate train` makes of touches with a position, or leave positions out."
            }
            Self::Refused(_) | Self::UnexpectedAnswer => {
                "Flash the chip again: its program speaks another version of the link."
            }
            Self::ModelRefused(_) => "Load another model; the chip still uses the one it had.",
            Self::OtherModel { .. } => "Load the model into the chip first.",
            Self::Differs { .. } => "Report this as a bug, with the model and the touches.",
            Self::NoEmulator => "Install it: apt-get install qemu-system-arm, brew install qemu.",
            Self::NoImage { .. } => "Build it: cd onboard/firmware && cargo build --release.",
            Self::EmulatorEnded { .. } => "Check that the firmware image is an ELF file for the emulated machine.",
            Self::EmulatorTimeout { .. } | Self::NoCost { .. } => {
                "Build its image again: cd onboard/firmware && cargo build --release --bin cost."
            }
            Self::NoReset => "Reset it by hand, or use the emulator on Linux or macOS.",
        }
        .into()
    }
}

impl From<LinkError> for ChipProblem {
    fn from(error: LinkError) -> Self {
        match error {
            LinkError::Silent { answered, uncertain } => Self::Silent { answered, uncertain },
            LinkError::Forgotten { answered, uncertain } => Self::Forgotten { answered, uncertain },
            _ => Self::UnexpectedAnswer,
        }
    }
}
