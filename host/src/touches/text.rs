//! Touches as text: one line per touch.
//!
//! A line holds three contact times in seconds, a missing contact as `-`, and optionally the probe's direction and
//! alignment (six numbers), and behind these optionally the hand's position (three numbers, in millimeters). Either all lines
//! have a position or none has one. Fields are separated by spaces or commas. The published data set has the same format.

use super::checksum::Checked;
use crate::error::{Error, Place, Result, TouchesProblem};
use crate::probe::approach::to_q15;
use palpate_shared::{ContactTime, Pose, Position, Q15_ONE, Touch};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// The touches in a text, one after the other; blank lines are skipped, and errors name `path`. A line with a position after
/// lines without, or the other way round, is an error.
///
/// Memory: that of the longest line.
pub fn touches(mut text: impl BufRead, path: &Path) -> impl Iterator<Item = Result<Touch>> {
    let (mut bytes, mut line, mut alike) = (Vec::new(), 0, Alike::default());
    std::iter::from_fn(move || {
        loop {
            bytes.clear();
            line += 1;
            match text.read_until(b'\n', &mut bytes) {
                Err(error) => return Some(Err(Error::io(path, "read the touches", error))),
                Ok(0) => return None,
                Ok(_) => {}
            }
            let wrong = |problem| Error::at(Place::line(path, line), problem);
            match std::str::from_utf8(&bytes).map(str::trim) {
                Err(_) => return Some(Err(wrong(TouchesProblem::NotText))),
                Ok("") => {}
                Ok(text) => return Some(parse_touch(text).and_then(|touch| alike.admit(touch)).map_err(wrong)),
            }
        }
    })
}

/// Reads the touches of one text file; blank lines are skipped.
///
/// # Errors
/// When the file cannot be read, holds no touch, or has a wrong line.
pub fn read(path: &Path) -> Result<Vec<Touch>> {
    read_with_checksum(path).map(|(touches, _)| touches)
}

/// Reads the touches, and the file's checksum.
pub(super) fn read_with_checksum(path: &Path) -> Result<(Vec<Touch>, u32)> {
    let file = File::open(path).map_err(|source| Error::io(path, "read the touches", source))?;
    let mut text = BufReader::with_capacity(1 << 16, Checked::new(file));
    let touches = touches(&mut text, path).collect::<Result<Vec<_>>>()?;
    if touches.is_empty() {
        return Err(Error::at(Place::file(path), TouchesProblem::NoTouches));
    }
    Ok((touches, text.into_inner().checksum()))
}

/// Reads one line: three contact times in seconds on any common clock (`-` where missing), rounded to whole
/// microseconds and shifted so that the first contact is 0, optionally direction and alignment, and behind them optionally
/// the position in millimeters.
///
/// # Errors
/// Fault of the line.
pub fn parse_touch(line: &str) -> Result<Touch, TouchesProblem> {
    let mut fields = [""; 12];
    let mut count = 0;
    for field in line.split(|c: char| c == ',' || c.is_whitespace()).filter(|field| !field.is_empty()) {
        if let Some(slot) = fields.get_mut(count) {
            *slot = field;
        }
        count += 1;
    }
    if ![3, 9, 12].contains(&count) {
        return Err(TouchesProblem::Fields { count });
    }
    let [a, b, c, pose @ ..] = fields;
    let touch = Touch::new([parse_time(a)?, parse_time(b)?, parse_time(c)?]);
    if count == 3 {
        return Ok(touch);
    }
    let [dx, dy, dz, ax, ay, az, x, y, z] = pose;
    let direction = parse_unit("direction", [dx, dy, dz])?;
    let alignment = parse_unit("alignment", [ax, ay, az])?;
    let touch = touch.with_pose(Pose { direction, alignment });
    if count == 9 {
        return Ok(touch);
    }
    Ok(touch.with_position(position([parse_number(x)?, parse_number(y)?, parse_number(z)?])?))
}

/// Touches that all have a position, or all have none.
#[derive(Default)]
pub(super) struct Alike {
    /// True if those so far have one.
    has_position: Option<bool>,
}

impl Alike {
    /// The touch, if it is like those before.
    pub(super) fn admit(&mut self, touch: Touch) -> Result<Touch, TouchesProblem> {
        let has_position = touch.position().is_some();
        match *self.has_position.get_or_insert(has_position) == has_position {
            true => Ok(touch),
            false => Err(TouchesProblem::OtherPosition { has_position, others: "the touches before it" }),
        }
    }
}

/// The longest contact time that a touch can hold, in microseconds.
const LONGEST: f64 = (u32::MAX - 1) as f64;

fn parse_time(field: &str) -> Result<ContactTime, TouchesProblem> {
    if field == "-" {
        return Ok(ContactTime::MISSING);
    }
    contact_time(parse_number(field)?)
}

/// Seconds as whole microseconds.
pub(super) fn contact_time(seconds: f64) -> Result<ContactTime, TouchesProblem> {
    if !seconds.is_finite() {
        return Err(TouchesProblem::NotFinite { text: format!("the time {seconds}") });
    }
    if seconds < 0.0 {
        return Err(TouchesProblem::NegativeTime { seconds });
    }
    let micros = (seconds * 1e6).round();
    if micros > LONGEST {
        return Err(TouchesProblem::LongTime { seconds });
    }
    Ok(ContactTime::from_micros(micros as u32))
}

fn parse_unit(name: &'static str, fields: [&str; 3]) -> Result<[i16; 3], TouchesProblem> {
    let [x, y, z] = fields;
    unit_vector(name, [parse_number(x)?, parse_number(y)?, parse_number(z)?])
}

/// A unit vector in Q15. Vectors that are not finite, or whose length is off by more than 1 %, are refused.
pub(super) fn unit_vector(name: &'static str, vector: [f64; 3]) -> Result<[i16; 3], TouchesProblem> {
    let length = vector.iter().map(|cosine| cosine * cosine).sum::<f64>().sqrt();
    if (length - 1.0).abs() <= 0.01 {
        return Ok(vector.map(to_q15));
    }
    Err(TouchesProblem::NotUnit { vector: name, length })
}

/// A position from millimeters, rounded to whole micrometers.
pub(super) fn position(millimeters: [f64; 3]) -> Result<Position, TouchesProblem> {
    let mut micrometers = [0; 3];
    for (whole, millimeters) in micrometers.iter_mut().zip(millimeters) {
        let rounded = (1e3 * millimeters).round();
        if !(f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&rounded) {
            return Err(TouchesProblem::FarPosition { millimeters });
        }
        *whole = rounded as i32;
    }
    Ok(Position { micrometers })
}

fn parse_number(field: &str) -> Result<f64, TouchesProblem> {
    let number: f64 = field.parse().map_err(|_| TouchesProblem::NotANumber { text: field.into() })?;
    if number.is_finite() { Ok(number) } else { Err(TouchesProblem::NotFinite { text: field.into() }) }
}

/// Appends the line of a touch with its line end: times with six decimals, and with `pose` the direction and alignment
/// (six decimals, enough to find each Q15 number again) and the position (three decimals), if it has them. [`parse_touch`] gives the same touch back.
pub fn write_touch(line: &mut String, touch: &Touch, pose: bool) {
    let mut separator = "";
    for time in touch.times() {
        // Writing to a string cannot fail.
        let _ = match time.micros() {
            Some(micros) => write!(line, "{separator}{}.{:06}", micros / 1_000_000, micros % 1_000_000),
            None => write!(line, "{separator}-"),
        };
        separator = " ";
    }
    if let (true, Some(Pose { direction, alignment })) = (pose, touch.pose()) {
        for cosine in direction.into_iter().chain(alignment) {
            let _ = write!(line, " {:.6}", f64::from(cosine) / f64::from(Q15_ONE));
        }
        for micrometers in touch.position().into_iter().flat_map(|position| position.micrometers) {
            let (sign, size) = (if micrometers < 0 { "-" } else { "" }, micrometers.unsigned_abs());
            let _ = write!(line, " {sign}{}.{:03}", size / 1_000, size % 1_000);
        }
    }
    line.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(touch: &Touch, pose: bool) -> String {
        let mut line = String::new();
        write_touch(&mut line, touch, pose);
        line
    }

    #[test]
    fn times_are_rounded_to_whole_microseconds_and_start_at_zero() {
        let touch = parse_touch("0.0300005 0.01, 0.5").unwrap();
        assert_eq!(touch.times().map(|t| t.micros()), [Some(20_001), Some(0), Some(490_000)]);
        assert_eq!(parse_touch("0,1e-6,-").unwrap().times().map(|t| t.micros()), [Some(0), Some(1), None]);
    }

    #[test]
    fn lines_are_written_as_the_published_data_set_has_them() {
        assert_eq!(written(&Touch::from_micros([0, 123_456, 12_000_001]), true), "0.000000 0.123456 12.000001\n");
        assert_eq!(written(&parse_touch("- - -").unwrap(), false), "- - -\n");
    }

    #[test]
    fn every_q15_cosine_survives_a_round_trip() {
        for q in -Q15_ONE..=Q15_ONE {
            let rest = to_q15((1.0 - (f64::from(q) / f64::from(Q15_ONE)).powi(2)).max(0.0).sqrt());
            let touch = Touch::from_micros([0, 1, 4_294_967_294])
                .with_pose(Pose { direction: [q, rest, 0], alignment: [0, rest, q] });
            assert_eq!(parse_touch(&written(&touch, true)).unwrap(), touch);
        }
    }

    #[test]
    fn positions_survive_a_round_trip_to_the_micrometer() {
        let pose = Pose { direction: [0, 0, -Q15_ONE], alignment: [Q15_ONE, 0, 0] };
        let touch = Touch::from_micros([0, 1, 2]).with_pose(pose);
        let ends = [0, 1, -1, 999, -999, 1_000, -1_001, i32::MIN, i32::MAX];
        for x in ends.into_iter().chain((0..3_000).map(|step: i32| step.wrapping_mul(1_234_567_891))) {
            let placed = touch.with_position(Position { micrometers: [x, -5, x.wrapping_neg()] });
            assert_eq!(parse_touch(&written(&placed, true)).unwrap(), placed, "{x}");
            assert_eq!(parse_touch(&written(&placed, false)).unwrap(), Touch::from_micros([0, 1, 2]));
        }
        let line = "0.000000 - - 0.000000 0.000000 -1.000000 1.000000 0.000000 0.000000 -0.005 12.000 -2147483.648\n";
        assert_eq!(written(&parse_touch(line).unwrap(), true), line);
        let rounded = parse_touch("0 0 0 0 0 -1 1 0 0 0.0004 1.23456 -1e-3").unwrap();
        assert_eq!(rounded.position(), Some(Position { micrometers: [0, 1_235, -1] }));
    }

    #[test]
    fn a_text_in_which_some_lines_have_a_position_is_refused_at_the_line() {
        let (with, without) = ("0 0 0 0 0 -1 1 0 0 1 2 3\n", "0 0 0 0 0 -1 1 0 0\n");
        let error = |lines: &[&str]| {
            let text = lines.concat();
            let read: Result<Vec<Touch>> = touches(text.as_bytes(), Path::new("cup.txt")).collect();
            read.map(|read| read.len()).map_err(|error| error.to_string())
        };
        assert_eq!((error(&[with, with]), error(&[without, "0 0 -\n"])), (Ok(2), Ok(2)));
        let mixed = error(&[with, "\n", with, without]).unwrap_err();
        assert!(mixed.starts_with("cup.txt:4: no position, where the touches before it have one."), "{mixed}");
        let mixed = error(&["0 0 -\n", with]).unwrap_err();
        assert!(mixed.starts_with("cup.txt:2: a position, where the touches before it have none."), "{mixed}");
    }

    #[test]
    fn wrong_lines_are_refused_with_what_is_wrong() {
        for (line, what) in [
            ("", "0 fields"),
            ("0 1", "2 fields"),
            ("0 1 2 3", "4 fields"),
            ("0 0 0 1 0 0 1 0 0 0", "10 fields"),
            ("0 -0.1 0", "the time -0.1 is negative"),
            ("0 nan 0", "nan is not finite"),
            ("0 inf 0", "inf is not finite"),
            ("0 1e9 0", "longer than"),
            ("0 x 0", "\"x\" is not a number"),
            ("0 0 0 1 0 0 0 1 0 1 2", "11 fields"),
            ("0 0 0 1 0 0 0 1 0 1 2 3 4", "13 fields"),
            ("0 0 0 1 0 0 0 1 0 1 2 x", "\"x\" is not a number"),
            ("0 0 0 1 0 0 0 1 0 1 nan 3", "nan is not finite"),
            ("0 0 0 1 0 0 0 1 0 -inf 2 3", "-inf is not finite"),
            ("0 0 0 1 0 0 0 1 0 1 2 2147483.648", "2147483.648 mm is farther than the 2147 m"),
            ("0 0 0 1 0 0 0 1 0 1 -2147483.649 0", "-2147483.649 mm is farther"),
            ("0 0 0 1 1 0 1 0 0", "the direction has length 1.414"),
            ("0 0 0 1 0 0 0 0 0", "the alignment has length 0.000"),
            ("0 0 0 - 0 0 0 0 0", "\"-\" is not a number"),
        ] {
            let error = parse_touch(line).unwrap_err().to_string();
            assert!(error.contains(what), "{line:?}: {error}");
        }
    }
}
