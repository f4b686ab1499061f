//! The host's end of a link to a chip that recognizes.
//!
//! ```text
//! touches ──► stream ──► Connection ──► Transport ──► serial port, TCP or emulator
//!                │
//!                └──► mirror: the host's own recognizer, which the chip is compared with
//! ```
//!
//! The messages, and why no touch is lost or counted twice: [`palpate_shared::link`].

mod connection;
mod emulator;
mod entry;
pub mod inspect;
pub mod instructions;
mod port;
mod qemu;
mod record;
mod steps;
mod stream;
mod transport;

pub use connection::{ChipModel, Connection, no_rows};
pub use emulator::Emulator;
pub use entry::Entry;
pub use port::Port;
pub use record::{RecordEvent, RecordSummary, record};
pub use steps::{Step, Steps};
pub use stream::{Asks, Located, Summary, Update, probability, stream};
pub use transport::Transport;
