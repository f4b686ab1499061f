//! PCD files of the Point Cloud Library, version 0.7: text, binary, and binary compressed by LZF.
//!
//! The [format](https://pointclouds.org/documentation/tutorials/pcd_file_format.html) lists the fields of a point, their
//! bytes and kinds, and the place of the sensor. Fields other than `x y z`, `normal_x normal_y normal_z` and `vp_x vp_y vp_z`
//! are skipped, but must be whole. A point whose coordinates are not numbers is one that the sensor did not measure.

use super::{Point, Points, Sensors};
use crate::error::{Error, MeshProblem, Place, Result};
use crate::mesh::words::{number, shown};
use std::io::{BufRead, Read};
use std::path::Path;

/// The most bytes of a header: real ones have some hundred.
const MOST: u64 = 1 << 16;

#[derive(Clone, Copy, PartialEq)]
enum Data {
    Text,
    Binary,
    Compressed,
}

struct Field {
    name: String,
    size: usize,
    kind: u8,
    count: usize,
}

struct Header {
    fields: Vec<Field>,
    points: usize,
    /// Place of the sensor, and its direction as a quaternion.
    viewpoint: [f64; 7],
    data: Data,
    bytes: u64,
    lines: u64,
}

fn damaged(place: Place, what: impl Into<String>) -> Error {
    Error::at(place, MeshProblem::Damaged { format: "PCD", what: what.into() })
}

/// Reads the points of a PCD file of `length` bytes; errors name `path`.
pub(in crate::mesh) fn parse(mut reader: impl BufRead, length: u64, path: &Path) -> Result<Points> {
    let header = Header::read(&mut reader, path)?;
    let columns = NAMES.map(|name| header.offset(name));
    let stride: usize = header.fields.iter().map(|field| field.size * field.count).sum();
    if columns[..3].contains(&None) {
        return Err(damaged(
            Place::line(path, header.lines),
            "its points have no fields x, y and z of one number each",
        ));
    }
    let sensors = match header.viewpoint {
        _ if columns[6..].iter().all(Option::is_some) => Sensors::Points,
        DEFAULT_VIEWPOINT => Sensors::Default,
        _ => Sensors::File,
    };
    let mut points = Points { sensors, ..Points::default() };
    let [x, y, z, ..] = header.viewpoint;
    let mut add = |values: [Option<f64>; 9]| {
        let three = |first: usize| match values[first..first + 3] {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        points.add(Point {
            place: three(0).unwrap_or([f64::NAN; 3]),
            normal: three(3),
            viewpoint: three(6).or(Some([x, y, z])),
        });
    };
    if header.data == Data::Text {
        read_text(reader, &header, columns, path, &mut add)?;
        return Ok(points);
    }
    let expected = (stride as u64).saturating_mul(header.points as u64);
    let io = |source| Error::io(path, "read the points", source);
    let mut bytes = Vec::new();
    // Not more than the file can hold: LZF shortens to a hundredth at best.
    if expected > length.saturating_mul(if header.data == Data::Compressed { 128 } else { 1 }) {
        let what = format!("it ends before its {} points do", header.points);
        return Err(damaged(Place::byte(path, length), what));
    }
    reader.take(length).read_to_end(&mut bytes).map_err(io)?;
    let here = |byte: usize| Place::byte(path, header.bytes + byte as u64);
    let rows = match header.data {
        Data::Compressed => {
            let sizes = bytes.first_chunk::<8>().ok_or_else(|| damaged(here(0), "it ends before its data"))?;
            let [packed, unpacked] = [0, 4].map(|at| u32::from_le_bytes(std::array::from_fn(|i| sizes[at + i])));
            if u64::from(unpacked) != expected {
                let what = format!("it states {unpacked} bytes of data, and its points have {expected}");
                return Err(damaged(here(4), what));
            }
            let packed = bytes.get(8..8 + packed as usize);
            let packed = packed.ok_or_else(|| damaged(here(bytes.len()), "it ends before its compressed data do"))?;
            unpack(packed, unpacked as usize).map_err(|at| damaged(here(8 + at), "its compressed data are damaged"))?
        }
        _ => bytes,
    };
    if (rows.len() as u64) < expected {
        let what = format!("it ends before its {} points do", header.points);
        return Err(damaged(here(rows.len()), what));
    }
    for point in 0..header.points {
        add(columns.map(|column| {
            let (field, before) = column?;
            let Field { size, kind, count, .. } = header.fields[field];
            // Compressed data hold all values of a field one after the other.
            let at = match header.data {
                Data::Compressed => before * header.points + point * size * count,
                _ => point * stride + before,
            };
            Some(value(&rows[at..at + size], kind))
        }));
    }
    Ok(points)
}

/// Viewpoint written by software that does not know the sensor's place.
const DEFAULT_VIEWPOINT: [f64; 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

/// The fields that are read.
const NAMES: [&str; 9] = ["x", "y", "z", "normal_x", "normal_y", "normal_z", "vp_x", "vp_y", "vp_z"];

/// The number of a field and the bytes before it in a point.
type Column = Option<(usize, usize)>;

fn read_text(
    mut reader: impl BufRead,
    header: &Header,
    columns: [Column; 9],
    path: &Path,
    add: &mut impl FnMut([Option<f64>; 9]),
) -> Result<()> {
    let before = |field: usize| header.fields[..field].iter().map(|field| field.count).sum::<usize>();
    let words_of = columns.map(|column| column.map(|(field, _)| before(field)));
    let expected = before(header.fields.len());
    let (mut line, mut found, mut raw) = (header.lines, 0, Vec::new());
    loop {
        raw.clear();
        if reader.read_until(b'\n', &mut raw).map_err(|source| Error::io(path, "read the points", source))? == 0 {
            break;
        }
        line += 1;
        let words: Vec<&[u8]> = raw.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
        if words.is_empty() {
            continue;
        }
        if words.len() != expected {
            let what = format!("{} numbers, where its fields need {expected}", words.len());
            return Err(damaged(Place::line(path, line), what));
        }
        let mut values = [None; 9];
        for (value, word) in values.iter_mut().zip(words_of) {
            let Some(word) = word.map(|word| words[word]) else { continue };
            let parsed: Option<f64> = number(word);
            *value =
                Some(parsed.ok_or_else(|| {
                    Error::at(Place::line(path, line), MeshProblem::NotANumber { text: shown(word) })
                })?);
        }
        found += 1;
        if found > header.points {
            return Err(damaged(
                Place::line(path, line),
                format!("more than the {} points that it states", header.points),
            ));
        }
        add(values);
    }
    if found < header.points {
        return Err(damaged(Place::line(path, line), format!("it ends after {found} of its {} points", header.points)));
    }
    Ok(())
}

impl Header {
    fn read(reader: &mut impl BufRead, path: &Path) -> Result<Self> {
        let mut limited = reader.take(MOST);
        let (mut names, mut sizes, mut kinds, mut counts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut points, mut area) = (None, [None; 2]);
        let mut viewpoint = DEFAULT_VIEWPOINT;
        let (mut bytes, mut lines, mut raw) = (0, 0, Vec::new());
        let data = loop {
            raw.clear();
            let read = limited.read_until(b'\n', &mut raw);
            bytes += read.map_err(|source| Error::io(path, "read the points", source))? as u64;
            lines += 1;
            let wrong = |what: String| damaged(Place::line(path, lines), what);
            let text = raw.split(|&byte| byte == b'#').next().unwrap_or_default();
            let words: Vec<&[u8]> = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
            if !raw.ends_with(b"\n") {
                return Err(wrong("it ends in its header".into()));
            }
            let whole = |word: &[u8]| -> Result<usize> {
                number(word).ok_or_else(|| wrong(format!("{:?} is not a count", shown(word))))
            };
            match words.as_slice() {
                [] | [b"VERSION", ..] => {}
                [b"FIELDS", rest @ ..] => names = rest.iter().map(|word| shown(word)).collect(),
                [b"SIZE", rest @ ..] => sizes = rest.iter().map(|word| whole(word)).collect::<Result<_>>()?,
                [b"TYPE", rest @ ..] => kinds = rest.iter().map(|word| word[0]).collect(),
                [b"COUNT", rest @ ..] => counts = rest.iter().map(|word| whole(word)).collect::<Result<_>>()?,
                [b"WIDTH", width] => area[0] = Some(whole(width)?),
                [b"HEIGHT", height] => area[1] = Some(whole(height)?),
                [b"POINTS", count] => points = Some(whole(count)?),
                [b"VIEWPOINT", place @ ..] if place.len() == 7 => {
                    for (value, word) in viewpoint.iter_mut().zip(place) {
                        let parsed = number::<f64>(word).filter(|value| value.is_finite());
                        *value = parsed.ok_or_else(|| wrong(format!("{:?} is not a coordinate", shown(word))))?;
                    }
                }
                [b"DATA", b"ascii"] => break Data::Text,
                [b"DATA", b"binary"] => break Data::Binary,
                [b"DATA", b"binary_compressed"] => break Data::Compressed,
                _ => return Err(wrong(format!("{:?} is not a header line", shown(raw.trim_ascii())))),
            }
        };
        let wrong = |what: &str| damaged(Place::line(path, lines), what);
        if counts.is_empty() {
            counts = vec![1; names.len()];
        }
        if names.is_empty() || [sizes.len(), kinds.len(), counts.len()] != [names.len(); 3] {
            return Err(wrong("its lines FIELDS, SIZE, TYPE and COUNT do not have the same number of words"));
        }
        let area = area[0].zip(area[1]).and_then(|(width, height)| width.checked_mul(height));
        let points = points.or(area).ok_or_else(|| wrong("its header states neither POINTS nor WIDTH and HEIGHT"))?;
        let columns = names.into_iter().zip(sizes).zip(kinds).zip(counts);
        let fields: Vec<Field> =
            columns.map(|(((name, size), kind), count)| Field { name, size, kind, count }).collect();
        let is_known = |field: &Field| match field.kind {
            b'F' => [4, 8].contains(&field.size),
            b'I' | b'U' => [1, 2, 4, 8].contains(&field.size),
            _ => false,
        };
        if let Some(field) = fields.iter().find(|field| !is_known(field) || field.count > 1 << 16) {
            return Err(wrong(&format!("the field {} is not a number of a known kind", field.name)));
        }
        Ok(Self { fields, points, viewpoint, data, bytes, lines })
    }

    /// The field of a name that holds one number.
    fn offset(&self, name: &str) -> Column {
        let field = self.fields.iter().position(|field| field.name == name && field.count == 1)?;
        Some((field, self.fields[..field].iter().map(|field| field.size * field.count).sum()))
    }
}

/// A number in the order of bytes that all PCD files use.
fn value(bytes: &[u8], kind: u8) -> f64 {
    let mut wide = [0; 8];
    wide[..bytes.len()].copy_from_slice(bytes);
    let unsigned = u64::from_le_bytes(wide);
    match (kind, bytes.len()) {
        (b'F', 4) => f64::from(f32::from_bits(unsigned as u32)),
        (b'F', _) => f64::from_bits(unsigned),
        (b'I', size) => {
            let shift = 64 - 8 * size as u32;
            ((unsigned << shift) as i64 >> shift) as f64
        }
        _ => unsigned as f64,
    }
}

/// Unpacks LZF: runs of literal bytes, and copies of bytes unpacked before.
///
/// # Errors
/// The byte at which the data are damaged.
pub(super) fn unpack(packed: &[u8], length: usize) -> Result<Vec<u8>, usize> {
    let mut unpacked = Vec::with_capacity(length);
    let mut at = 0;
    while at < packed.len() {
        let control = usize::from(packed[at]);
        let start = at;
        at += 1;
        let mut next = || {
            let byte = packed.get(at).copied().ok_or(start);
            at += 1;
            byte
        };
        if control < 32 {
            for _ in 0..=control {
                unpacked.push(next()?);
            }
        } else {
            let count = match control >> 5 {
                7 => 7 + usize::from(next()?),
                short => short,
            };
            let distance = (control & 31) << 8 | usize::from(next()?);
            let from = unpacked.len().checked_sub(distance + 1).ok_or(start)?;
            for byte in from..from + count + 2 {
                unpacked.push(unpacked[byte]);
            }
        }
        if unpacked.len() > length {
            return Err(start);
        }
    }
    if unpacked.len() == length { Ok(unpacked) } else { Err(packed.len()) }
}
