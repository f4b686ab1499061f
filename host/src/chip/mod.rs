//! The host's end of a link to a chip that recognizes.
//!
//! ```text
//! touches ──► stream ──► Connection ──► Transport ──► (bad line) ──► serial port, TCP or emulator
//!                │
//!                └──► mirror: the host's own recognizer, which the chip is compared with
//! ```
//!
//! The messages, and why no touch is counted twice: [`palpate_shared::link`].

mod bad_line;
mod connection;
mod emulator;
pub(crate) mod error;
pub mod inspect;
pub mod instructions;
mod journal;
mod port;
mod qemu;
mod record;
mod steps;
mod stream;
mod transport;
pub mod watch;

use bad_line::BadLine;
pub use bad_line::Faults;
pub use connection::{ChipModel, Connection, Received};
pub use emulator::Emulator;
pub use journal::{Entry, Journal};
pub use port::Port;
pub use record::{RecordEvent, RecordSummary, record};
pub use steps::{Step, Steps};
pub use stream::{Asks, Located, Summary, Update, probability, stream};
pub use transport::Transport;
