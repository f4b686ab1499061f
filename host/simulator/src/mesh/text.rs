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

#[cfg(test)]
mod tests {
    use crate::mesh::Mesh;
    use crate::mesh::file::{Format, parse};
    use crate::mesh::tests::samples::{self, corners};
    use std::path::Path;

    /// The files that are text.
    fn texts(globe: &Mesh) -> Vec<(&'static str, String)> {
        let text = |(name, bytes): (&'static str, Vec<u8>)| Some((name, String::from_utf8(bytes).ok()?));
        samples::all(globe).into_iter().filter_map(text).filter(|(_, text)| !text.contains('\0')).collect()
    }

    #[test]
    fn text_in_utf16_is_read_as_in_utf8_in_every_format() {
        let globe = Mesh::globe(4);
        let texts = texts(&globe);
        assert_eq!(texts.len(), 5);
        for (name, text) in texts {
            let units: Vec<u16> = std::iter::once(0xfeff).chain(text.encode_utf16()).collect();
            for swap in [u16::to_le_bytes, u16::to_be_bytes] {
                let bytes: Vec<u8> = units.iter().flat_map(|&unit| swap(unit)).collect();
                let read = parse(&bytes, Path::new(name)).unwrap_or_else(|error| panic!("{error}"));
                assert!(corners(&read.mesh) == corners(&globe), "{name}");
                assert_eq!(Format::of(&bytes, bytes.len() as u64, None), read.format, "{name}");
            }
        }
    }

    #[test]
    fn lines_that_end_as_on_old_macs_are_lines() {
        let globe = Mesh::globe(4);
        for (name, text) in texts(&globe) {
            let text = text.replace('\n', "\r");
            let read = parse(text.as_bytes(), Path::new(name)).unwrap_or_else(|error| panic!("{error}"));
            assert!(corners(&read.mesh) == corners(&globe), "{name}");
            // Errors name the line.
            if name == "cup.obj" {
                let wrong = text.replacen("\rv ", "\rv x", 2);
                assert!(parse(wrong.as_bytes(), Path::new(name)).unwrap_err().to_string().starts_with("cup.obj:2: "));
            }
        }
    }
}
