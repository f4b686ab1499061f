//! XYZ files: a point on each line, as three numbers, or as six with its normal.

use super::{Point, Points};
use crate::error::{Error, MeshProblem, Place, Result};
use crate::mesh::words::{coordinate, shown};
use std::io::BufRead;
use std::path::Path;

/// Reads the points of an XYZ text; errors name `path`. Numbers may be separated by blanks, commas or semicolons; what
/// follows `#` or `//` on a line is skipped.
pub(in crate::mesh) fn parse(mut reader: impl BufRead, path: &Path) -> Result<Points> {
    let mut points = Points::default();
    let (mut line, mut columns, mut raw) = (0, 0, Vec::new());
    loop {
        raw.clear();
        if reader.read_until(b'\n', &mut raw).map_err(|source| Error::io(path, "read the points", source))? == 0 {
            return Ok(points);
        }
        line += 1;
        let text = raw.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&raw);
        let text = text.split(|&byte| byte == b'#').next().unwrap_or_default();
        let end = text.windows(2).position(|pair| pair == b"//").unwrap_or(text.len());
        let is_gap = |byte: &u8| byte.is_ascii_whitespace() || b",;".contains(byte);
        let words: Vec<&[u8]> = text[..end].split(is_gap).filter(|word| !word.is_empty()).collect();
        let at = |problem| Error::at(Place::line(path, line), problem);
        if words.is_empty() {
            continue;
        }
        if columns == 0 {
            columns = words.len();
        }
        if words.len() != columns || ![3, 6].contains(&columns) {
            let wanted = if [3, 6].contains(&columns) {
                format!("{columns}, as on the first line")
            } else {
                "3, or 6 with a normal".into()
            };
            let what =
                format!("{} numbers where there should be {wanted}: {:?}", words.len(), shown(text.trim_ascii()));
            return Err(at(MeshProblem::Damaged { format: "XYZ", what }));
        }
        let mut values = [0.0; 6];
        for ((value, word), axis) in values.iter_mut().zip(&words).zip("xyzxyz".chars()) {
            *value = coordinate(word, axis).map_err(at)?;
        }
        let [x, y, z, normal @ ..] = values;
        points.add(Point { place: [x, y, z], normal: (columns == 6).then_some(normal), viewpoint: None });
    }
}
