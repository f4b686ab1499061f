//! A live view of a chip that recognizes: the posterior of each object, the last touches, the state of the link.
//!
//! ```text
//! port ──► updates ──┐
//!                    ├──► entries of a journal ──► View ──► a screen, or plain lines
//! file ──► lines ────┘
//! ```

mod follow;
mod lines;
mod screen;
mod view;

pub use follow::Follow;
pub use lines::line;
pub use screen::{Screen, draw};
pub use view::View;
