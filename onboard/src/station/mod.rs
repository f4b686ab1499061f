//! A recognizer at the end of a link: everything that a chip's program needs but the chip itself.
//!
//! ```text
//! transport ──► DeviceEnd ──► Station ──► Recognizer
//!                               │
//!                               └──► Memory: two places for models, two for records
//! ```
//!
//! [`serve`] is the whole program of a chip that recognizes touches from a host. A chip with fingers of its own pushes
//! their touches into a [`Station`] and reports them to the host.
//!
//! # Power cuts
//!
//! After every command the [`Station`] writes a record (evidence, progress of the link, which model is in use) into the
//! older one of two places, with a counter and a checksum. Whenever the power goes, one of the two is whole, and the chip
//! continues from it: the host repeats what is not in it, and the link ensures that nothing is counted twice. That
//! needs memory that keeps its content: battery-backed or FRAM, or RAM where resets but no power cuts are to be survived.

mod flash;
mod memory;
mod record;
mod serve;
mod session;
mod storage;

pub use flash::{FlashError, FlashStorage, MappedFlash};
pub use memory::Memory;
pub use record::record_length;
pub use serve::{ServeError, serve};
pub use session::{RecordsTooShort, Station};
pub use storage::{NoStorage, Place, Storage};
