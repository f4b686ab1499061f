//! Checksums of files of touches, as listings state them.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

pub(super) static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);
