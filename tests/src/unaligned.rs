//! A model that the exporter does not write.

/// A model whose numbers are not aligned.
///
/// # Panics
/// Never.
pub fn model() -> Vec<u8> {
    let bytes = BYTES.iter().flat_map(|row| row.split(' '));
    let mut model: Vec<u8> = bytes.map(|byte| u8::from_str_radix(byte, 16).expect("two digits")).collect();
    model.extend(palpate_shared::format::checksum(&model).to_le_bytes());
    model
}

/// No zeros after the text, and thresholds of three bytes and of one.
const BYTES: [&str; 7] = [
    "50 4c 50 54 03 00 00 00 ad 00 00 00 01 00 01 01",
    "02 00 01 00 02 00 00 00 03 00 00 00 05 00 00 00",
    "00 00 80 3c 29 3b aa b8 05 00 00 00 00 00 00 00",
    "eb 57 0a d4 fa 95 02 00 c8 00 00 00 00 00 c0 3f",
    "00 00 20 41 0b 00 00 00 00 00 00 00 00 00 00 00",
    "07 00 00 00 0d 00 00 00 0a 00 00 00 00 00 00 00",
    // The version, "0.1.0", and the sections.
    "05 30 2e 31 2e 30 02 61 62 01 63 20 00 00 00 e0 ff ff ff 00 00 00 00 00 00 00 00 00 01 03 02 01 02 01 01 e9 03 00 70 11 01 fd 00 00 00 00 02 00 00 00 01 00 00 01 00 02 00 00 00 00 01 00 00 88 80 78 84 c0 40 a0 90 60 80",
];
