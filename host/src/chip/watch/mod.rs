//! Following a chip that recognizes: the posterior of each object, the last touches, the state of the link.
//!
//! ```text
//! port ──► updates ──┐
//!                    ├──► entries of a journal ──► Status ──► a screen of the program's
//! file ──► lines ────┘
//! ```

mod follow;
mod status;

pub use follow::Follow;
pub use status::Status;
