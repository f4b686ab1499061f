//! Where a chip keeps what has to last.

/// Where a chip keeps what has to last. Every slice may be empty: then the chip does without.
#[derive(Debug)]
pub struct Memory<'a> {
    /// A model in flash, in use until another is loaded.
    pub built_in: &'a [u8],
    /// Two places for models from the host: one in use, one being filled.
    pub models: [&'a mut [u8]; 2],
    /// Two places for records, of [`Memory::record_length`] bytes each.
    pub records: [&'a mut [u8]; 2],
}

impl Memory<'_> {
    /// The most bytes that a record takes for models of up to `objects` objects.
    pub const fn record_length(objects: usize) -> usize {
        // Header; counter, model, source and staging; session; an outcome takes up to 26 bytes; the snapshot.
        6 + 45 + 18 + 26 * palpate_shared::link::WINDOW + crate::SNAPSHOT_LENGTH + 10 * objects
    }
}
