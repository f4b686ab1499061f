use crate::samples::{self, corners};
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::file::{Format, parse};
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
