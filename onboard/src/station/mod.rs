//! A recognizer at the end of a link: everything that a chip's program needs, except the chip itself.
//!
//! ```text
//! transport ──► DeviceEnd ──► Station ──► Recognizer
//!                               │
//!                               └──► Storage: two places for models, and records
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
//! After every command, and every touch of its own, the [`Station`] stores a record (evidence, progress of the link, the
//! model in use), and only then reports the outcome. After a power cut the chip continues from the newest record: the host
//! repeats all that it lacks, and the link ensures that nothing is counted twice. Commands that cannot be stored are
//! executed and reported. The record also holds the last touch of its own, which is sent again at each start until another
//! record follows; a host recognizes the copy.
//!
//! | storage | where |
//! |---|---|
//! | [`FlashStorage`] | NOR flash: a log that goes round its sectors, and two areas for models, read in place |
//! | [`Memory`] | battery-backed RAM or FRAM, or RAM where it must survive resets but no power cuts |
//! | [`NoStorage`] | nothing is kept, no model can be loaded |
//!
//! A loaded model is written to the place that is not in use and checked there; the record that follows switches to it. A load
//! that was cut goes on at the sector of the cut. [`Signed`] takes signed models alone.

mod flash;
mod memory;
mod message;
mod probe;
mod record;
mod serve;
mod session;
mod signed;
mod storage;
mod table;
#[cfg(all(test, feature = "locate"))]
mod tests;

pub use flash::{FlashError, FlashStorage, MappedFlash};
pub use memory::Memory;
pub use probe::{Board, Happened, LONGEST_WAIT, LinkFailed, ProbeSettings, ProbeStation};
pub use record::record_length;
pub use serve::{ERRORS_IN_A_ROW, ServeError, serve, serve_with};
pub use session::{PROGRAM, RecordsTooShort, Station};
pub use signed::Signed;
pub use storage::{NoStorage, Place, Storage};
pub use table::Locates;
#[cfg(feature = "locate")]
pub use table::Table;
