//! A recognizer at the end of a link: everything that a chip's program needs, except the chip itself.
//!
//! ```text
//! transport ──► DeviceEnd ──► Station ──► Recognizer
//!                               │
//!                               └──► Storage: two places for models
//! ```
//!
//! | program | what |
//! |---|---|
//! | [`serve`] | a chip that recognizes touches from a host |
//! | [`serve_with`] | the same, with models of maps too |
//! | [`ProbeStation`] | a chip with fingers of its own, which also takes touches and models from a host |
//!
//! # Power cuts
//!
//! A model that was loaded stays, through resets and power cuts; evidence and the session of the link do not. They are of one
//! object and seconds old: after a reset another boot number says that they are gone, and a host that repeats a command counts
//! nothing twice.
//!
//! | storage | where |
//! |---|---|
//! | [`FlashStorage`] | NOR flash: two sectors of records, and two areas for models, read in place |
//! | [`Memory`] | battery-backed RAM or FRAM, or RAM where it must survive resets but no power cuts |
//! | [`NoStorage`] | nothing is kept, no model can be loaded |
//!
//! A loaded model is written to the place that is not in use and checked there; a record of it switches to it. A load that was cut
//! leaves the model from before, and begins again. [`Storage::admit`] is the place for a check of your own, such as that of a
//! signature.

mod flash;
mod memory;
mod message;
mod probe;
mod record;
mod serve;
mod session;
mod storage;
mod table;
#[cfg(all(test, feature = "locate"))]
mod tests;

pub use flash::{FlashError, FlashStorage, MappedFlash};
pub use memory::Memory;
pub use probe::{Board, Happened, LONGEST_WAIT, LinkFailed, ProbeSettings, ProbeStation};
pub use record::RECORD_LENGTH;
pub use serve::{ERRORS_IN_A_ROW, serve, serve_with};
pub use session::Station;
pub use storage::{Loaded, NoStorage, NotStored, Place, Storage};
pub use table::Locates;
#[cfg(feature = "locate")]
pub use table::Table;
