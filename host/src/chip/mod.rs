//! The host's end of a link to a chip that recognizes.
//!
//! ```text
//! touches ──► stream ──► Connection ──► Transport ──► (bad line) ──► serial port, TCP or emulator
//!                │
//!                └──► mirror: the host's own recognizer, which the chip is held against
//! ```
//!
//! What is said, and why nothing is counted twice: [`palpate_shared::link`].

mod bad_line;
mod connection;
pub mod emulated;
mod emulator;
mod journal;
mod port;
mod steps;
mod stream;
mod transport;
pub mod watch;

pub use bad_line::{BadLine, Faults};
pub use connection::{ChipModel, Connection, Owned};
pub use emulator::Emulator;
pub use journal::{Entry, Journal};
pub use port::Port;
pub use steps::{Step, Steps};
pub use stream::{Summary, Update, probability, stream};
pub use transport::Transport;
