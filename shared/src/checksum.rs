//! The one checksum of models, frames and records: CRC-32 as in ISO-HDLC, zip and Ethernet.

/// The reflected polynomial.
const POLYNOMIAL: u32 = 0xedb8_8320;

/// Effect of four bits on the checksum: a small table, for a quarter of the time that single bits take.
static TABLE: [u32; 16] = table();

const fn table() -> [u32; 16] {
    let mut table = [0; 16];
    let mut bits = 0_u32;
    while bits < 16 {
        let mut sum = bits;
        let mut step = 0;
        while step < 4 {
            sum = if sum & 1 == 1 { sum >> 1 ^ POLYNOMIAL } else { sum >> 1 };
            step += 1;
        }
        // `bits` stays within the table, or the constant would not compile.
        table[bits as usize] = sum;
        bits += 1;
    }
    table
}

/// The checksum of some bytes.
///
/// Cost: a few instructions for each byte, and a table of 16 numbers in flash. Cannot fail.
pub fn checksum(bytes: &[u8]) -> u32 {
    !update(!0, bytes)
}

/// The [`checksum`] of parts, one after another.
#[cfg(feature = "link")]
pub(crate) fn checksum_of<const N: usize>(parts: impl Iterator<Item = [u8; N]>) -> u32 {
    !parts.fold(!0, |sum, part| update(sum, &part))
}

#[inline(never)]
fn update(sum: u32, bytes: &[u8]) -> u32 {
    let step = |sum: u32| {
        let [low, ..] = sum.to_le_bytes();
        sum >> 4 ^ TABLE.get(usize::from(low & 15)).copied().unwrap_or(0)
    };
    bytes.iter().fold(sum, |sum, &byte| step(step(sum ^ u32::from(byte))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_one_of_the_crc_catalog() {
        const CATALOG: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
        assert_eq!(checksum(b"123456789"), 0xcbf4_3926);
        let bytes: std::vec::Vec<u8> = (0..1_000_u32).map(|i| ((i * i) >> 3) as u8).collect();
        for length in 0..bytes.len() {
            assert_eq!(checksum(&bytes[..length]), CATALOG.checksum(&bytes[..length]), "{length} bytes");
        }
    }

    #[test]
    fn parts_have_the_checksum_of_the_whole() {
        assert_eq!(checksum_of([*b"123", *b"456", *b"789"].into_iter()), checksum(b"123456789"));
        assert_eq!(checksum_of(core::iter::empty::<[u8; 4]>()), checksum(b""));
    }
}
