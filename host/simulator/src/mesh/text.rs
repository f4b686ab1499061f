//! Text in another encoding, or with other ends of lines, than meshes have today.

use super::stl;

/// Encoding of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Written {
    /// In UTF-16, the lower byte first or last, as redirection in a Windows shell writes it.
    Utf16 { is_little: bool },
    /// With lines that end in CR alone, as on Macs before 2001.
    OldMac,
}

impl Written {
    /// Encoding of a text that starts with `head`; none if it can be read as it stands, or is not text.
    pub(super) fn of(head: &[u8], length: u64) -> Option<Self> {
        if stl::is_binary(head, length) {
            return None;
        }
        match head {
            [0xff, 0xfe, ..] => Some(Self::Utf16 { is_little: true }),
            [0xfe, 0xff, ..] => Some(Self::Utf16 { is_little: false }),
            _ => (head.contains(&b'\r') && !head.iter().any(|byte| matches!(byte, b'\n' | 0))).then_some(Self::OldMac),
        }
    }

    /// The text in UTF-8 with the usual ends of lines. What is no character becomes the sign for that.
    pub(super) fn usual(self, mut bytes: Vec<u8>) -> Vec<u8> {
        match self {
            Self::Utf16 { is_little } => {
                let (units, _) = bytes.as_chunks::<2>();
                let unit =
                    |unit: &[u8; 2]| if is_little { u16::from_le_bytes(*unit) } else { u16::from_be_bytes(*unit) };
                // After the mark that says which byte is first.
                let decoded = char::decode_utf16(units.iter().skip(1).map(unit));
                decoded.map(|read| read.unwrap_or(char::REPLACEMENT_CHARACTER)).collect::<String>().into_bytes()
            }
            Self::OldMac => {
                bytes.iter_mut().filter(|byte| **byte == b'\r').for_each(|byte| *byte = b'\n');
                bytes
            }
        }
    }
}
