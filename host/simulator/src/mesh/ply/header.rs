//! The header of a PLY file, checked line by line.

use crate::error::{Error, Place, Result};
use crate::mesh::words::{self, number, shown};
use serde_ply::PlyFormat;
use std::io::{BufRead, Read};
use std::path::Path;

/// The most bytes of a header: real ones have some hundred.
const MOST: u64 = 1 << 20;

/// A header that was checked: its elements have different names and at least one property each.
pub(super) struct Header {
    pub(super) format: PlyFormat,
    /// The header without comments, for the parser. A text has its coordinates to all digits, whatever kind is stated.
    pub(super) text: String,
    /// Its number of bytes and lines in the file.
    pub(super) bytes: u64,
    pub(super) lines: u64,
    /// True if it states vertices and nothing that connects them.
    pub(super) is_cloud: bool,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
    line: u64,
}

struct Property {
    name: String,
    /// Type as the file states it: a kind of number, or a list of them.
    kind: String,
    /// True if it is a list of whole numbers, false if of any.
    list: Option<bool>,
}

/// The names of a face's list of corners.
pub(super) const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

impl Header {
    /// Reads a header, and no byte more.
    pub(super) fn read(reader: &mut impl BufRead, path: &Path) -> Result<Self> {
        let mut limited = reader.take(MOST);
        let (mut format, mut elements, mut raw) = (None, Vec::<Element>::new(), Vec::new());
        let (mut bytes, mut lines) = (0, 0);
        loop {
            raw.clear();
            let read = limited.read_until(b'\n', &mut raw);
            let read = read.map_err(|source| Error::io(path, "read the mesh", source))?;
            bytes += read as u64;
            lines += 1;
            let damaged = |what: String| words::damaged("PLY", what).at(Place::line(path, lines));
            let words: Vec<&[u8]> = raw.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
            if lines == 1 && words != [b"ply"] {
                let is_of_old_mac = raw.starts_with(b"ply\r") && !raw.ends_with(b"\r\n");
                let what = match is_of_old_mac {
                    true => "its header's lines end in CR alone, as on old Macs, which is read in text only",
                    false => "its first line is not \"ply\"",
                };
                return Err(damaged(what.into()));
            }
            if !raw.ends_with(b"\n") {
                let what = if bytes == MOST { "its header has more than 1 MB" } else { "it ends in its header" };
                return Err(damaged(what.into()));
            }
            match words.as_slice() {
                // The last one stands in files of Blender 2.4.
                [] | [b"ply" | b"comment" | b"obj_info", ..] | [b"Created", b"by", ..] => {}
                [b"end_header"] => break,
                [b"format", kind, b"1.0"] if format.is_none() => {
                    format = Some(match *kind {
                        b"ascii" => PlyFormat::Ascii,
                        b"binary_little_endian" => PlyFormat::BinaryLittleEndian,
                        b"binary_big_endian" => PlyFormat::BinaryBigEndian,
                        other => return Err(damaged(format!("{:?} is not a PLY format", shown(other)))),
                    });
                }
                [b"element", name, count] => {
                    let count = number(count).ok_or_else(|| damaged(format!("{:?} is not a count", shown(count))))?;
                    let name = shown(name);
                    if elements.iter().any(|element| element.name == name) {
                        return Err(damaged(format!("there are two elements {name:?}")));
                    }
                    elements.push(Element { name, count, properties: Vec::new(), line: lines });
                }
                [b"property", kind @ .., name] => {
                    let property = Property::new(kind, name).map_err(damaged)?;
                    let element = elements.last_mut().ok_or_else(|| damaged("a property before any element".into()))?;
                    if element.properties.iter().any(|other| other.name == property.name) {
                        return Err(damaged(format!("{} has two properties {:?}", element.name, property.name)));
                    }
                    element.properties.push(property);
                }
                _ => return Err(damaged(format!("{:?} is not a header line", shown(raw.trim_ascii())))),
            }
        }
        let whole = |line: u64, what: &str| words::damaged("PLY", what).at(Place::line(path, line));
        let format = format.ok_or_else(|| whole(lines, "its header has no line \"format ... 1.0\""))?;
        elements.retain(|element| element.count > 0 || !element.properties.is_empty());
        for element in &elements {
            element.check().map_err(|what| whole(element.line, &what))?;
        }
        let has = |name: &str| elements.iter().any(|element| element.name == name && element.count > 0);
        let is_cloud = has("vertex") && !has("face") && !has("tristrips");
        Ok(Self { format, text: text(format, &elements), bytes, lines, is_cloud })
    }
}

impl Property {
    fn new(kind: &[&[u8]], name: &[u8]) -> Result<Self, String> {
        let is_number = |kind: &[u8]| match kind {
            b"char" | b"uchar" | b"short" | b"ushort" | b"int" | b"uint" => Some(true),
            b"int8" | b"uint8" | b"int16" | b"uint16" | b"int32" | b"uint32" => Some(true),
            b"float" | b"double" | b"float32" | b"float64" => Some(false),
            _ => None,
        };
        let unknown = |kind: &[u8]| format!("{:?} is not a number type", shown(kind));
        let list = match kind {
            [kind] => {
                is_number(kind).ok_or_else(|| unknown(kind))?;
                None
            }
            [b"list", count, kind] => match is_number(count) {
                Some(true) => Some(is_number(kind).ok_or_else(|| unknown(kind))?),
                _ => return Err(format!("{:?} cannot count", shown(count))),
            },
            _ => return Err("a property has neither a kind of number nor \"list\" and two kinds".into()),
        };
        let kind = kind.iter().map(|word| String::from_utf8_lossy(word)).collect::<Vec<_>>().join(" ");
        let name = std::str::from_utf8(name).map_err(|_| "the name of a property is not UTF-8")?;
        Ok(Self { name: name.into(), kind, list })
    }
}

impl Element {
    /// Rejects elements whose rows have no end, and vertices and faces without their required properties.
    fn check(&self) -> Result<(), String> {
        let Self { name, properties, count, .. } = self;
        if properties.is_empty() {
            return Err(format!("the element {name:?} has {count} rows without a property"));
        }
        let find = |name: &str| properties.iter().find(|property| property.name == name);
        match name.as_str() {
            "vertex" => match ["x", "y", "z"].iter().find(|axis| find(axis).is_none_or(|found| found.list.is_some())) {
                Some(axis) => Err(format!("vertices have no number {axis}")),
                None => Ok(()),
            },
            "face" | "tristrips" => match CORNERS.map(find) {
                [Some(_), Some(_)] => Err(format!("the element {name:?} has two lists of vertices")),
                [Some(Property { list: Some(true), .. }), None] | [None, Some(Property { list: Some(true), .. })] => {
                    Ok(())
                }
                _ if *count == 0 => Ok(()),
                _ => Err(format!("the element {name:?} has no list of whole numbers {:?}", CORNERS[0])),
            },
            _ => Ok(()),
        }
    }
}

fn text(format: PlyFormat, elements: &[Element]) -> String {
    let mut text = format!("ply\nformat {format} 1.0\n");
    for Element { name, count, properties, .. } in elements {
        text += &format!("element {name} {count}\n");
        for Property { name: property, kind, .. } in properties {
            let is_exact =
                format == PlyFormat::Ascii && name == "vertex" && ["x", "y", "z"].contains(&property.as_str());
            let kind = if is_exact { "double" } else { kind };
            text += &format!("property {kind} {property}\n");
        }
    }
    text + "end_header\n"
}
