//! The bytes of a compiled model; `FORMAT.md` beside this crate's sources specifies them one by one.
//!
//! ```text
//! header │ text │ base margins │ priors │ axes │ thresholds │ groups │ splits │ leaves │ CRC-32
//! ```

mod codes;
mod header;
mod key;
mod records;

pub use codes::{Key, Layout, LeafType, RAW_FEATURES};
pub use header::{HEADER_LENGTH, Header, HeaderBuilder, MAGIC, VERSION};
pub use key::f32_key;
pub use records::{Axis, Columns, Group};

/// Bytes of the checksum at the end.
pub const CHECKSUM_LENGTH: usize = 4;

/// Margins stay within ± this many units, by the export's choice of unit and the validation of a model.
pub const MARGIN_LIMIT: i32 = 1 << 30;

/// The largest depth of trees in [`Layout::Complete`].
pub const MAX_COMPLETE_DEPTH: u8 = 8;

/// The checksum of a model's bytes before the checksum: CRC-32 as in ISO-HDLC, zip and Ethernet.
///
/// Cost: about 50 instructions a byte, without a table in flash. Cannot fail.
pub fn checksum(bytes: &[u8]) -> u32 {
    const CRC: crc::Crc<u32, crc::NoTable> = crc::Crc::<u32, crc::NoTable>::new(&crc::CRC_32_ISO_HDLC);
    CRC.checksum(bytes)
}
