//! Touches as text: one line per touch.
//!
//! A line holds three contact times in seconds, a missing contact as `-`, and optionally the probe's direction and
//! alignment (six numbers), and behind these optionally the hand's position (three numbers, in millimeters). Either all lines
//! have a position or none has one. Fields are separated by spaces or commas. Times are on any clock, also one that counts from
//! 1970. A byte-order mark, a first line of names and lines that begin with # are skipped. The published data set has the same
//! format.

use super::alike::Alike;
use super::files::refuse_bag;
use super::finding::{Sink, Strict};
use super::seconds::{Longest, contact_times, position, unit_vector};
use crate::error::{Error, Kind, Place, Result, problem};
use palpate_shared::{Pose, Q15_ONE, Touch};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// The lines of a text of touches as they come: each with its number, and its touch, or none if it is blank. Lines that hold no
/// touch by design are skipped; errors name `path`.
///
/// Memory: that of the longest line.
pub struct Lines<R> {
    text: R,
    path: PathBuf,
    line: u64,
    /// True behind the first line that is neither blank nor a comment: names of columns can only stand there.
    has_begun: bool,
}

impl<R: BufRead> Lines<R> {
    /// The lines of `text`, which is called `path`.
    pub fn new(text: R, path: &Path) -> Self {
        Self { text, path: path.into(), line: 0, has_begun: false }
    }

    /// The touch of a line; none of a blank one. The outer none: nothing is to be read in it.
    fn touch(&mut self, bytes: &[u8]) -> Result<Option<Option<Touch>>> {
        if self.line == 1 {
            refuse_bag(bytes)?;
        }
        let text = std::str::from_utf8(bytes).map_err(|_| problem!("not text (no UTF-8)").fix(CORRECT))?;
        let text = text.trim_start_matches('\u{feff}').trim();
        if text.is_empty() || text.starts_with('#') {
            return Ok(text.is_empty().then_some(None));
        }
        let is_first = !std::mem::replace(&mut self.has_begun, true);
        let is_word = |field: &str| field != "-" && field.parse::<f64>().is_err();
        if is_first && fields(text).all(is_word) {
            return Ok(None);
        }
        parse_touch(text).map(|touch| Some(Some(touch)))
    }
}

impl<R: BufRead> Iterator for Lines<R> {
    type Item = Result<(u64, Option<Touch>)>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut bytes = Vec::new();
        loop {
            bytes.clear();
            self.line += 1;
            match self.text.read_until(b'\n', &mut bytes) {
                Err(error) => return Some(Err(Error::io(&self.path, "read the touches", error))),
                Ok(0) => return None,
                Ok(_) => {}
            }
            let touch = self.touch(&bytes).map_err(|error| error.at(Place::line(&self.path, self.line)));
            match touch.transpose() {
                None => {}
                Some(touch) => return Some(touch.map(|touch| (self.line, touch))),
            }
        }
    }
}

/// The touches in a text, one after the other; blank lines are skipped, and errors name `path`. A line with a position after
/// lines without, or the other way round, is an error.
///
/// Memory: that of the longest line.
pub fn touches(text: impl BufRead, path: &Path) -> impl Iterator<Item = Result<Touch>> {
    numbered(text, path).map(|read| read.map(|(_, touch)| touch))
}

/// The touches in a text, as [`touches`], with the numbers of their lines.
pub(super) fn numbered(text: impl BufRead, path: &Path) -> impl Iterator<Item = Result<(u64, Touch)>> {
    let mut alike = Alike::default();
    Lines::new(text, path).filter_map(move |read| {
        let (line, touch) = match read {
            Ok((line, touch)) => (line, touch?),
            Err(error) => return Some(Err(error)),
        };
        let admitted = alike.admit(&touch).map_err(|error| error.at(Place::line(path, line)));
        Some(admitted.map(|()| (line, touch)))
    })
}

/// Reads the touches of one text file, whose origin is not stated; blank lines are skipped.
///
/// # Errors
/// When the file cannot be read, holds no touch, has a wrong line, or times that are not in seconds.
pub fn read(path: &Path) -> Result<Vec<Touch>> {
    read_file(path, &mut Strict::default())
}

/// Reads a text file as [`read`]; wrong lines are left out, if the sink takes the faults.
pub(super) fn read_file(path: &Path, sink: &mut dyn Sink) -> Result<Vec<Touch>> {
    let file = File::open(path).map_err(|source| Error::io(path, "read the touches", source))?;
    let (touches, is_right) = read_lines(BufReader::with_capacity(1 << 16, file), path, &Longest::default(), sink)?;
    if touches.is_empty() && is_right {
        sink.fault(no_touches().at(Place::file(path)))?;
    }
    Ok(touches)
}

/// The problem of a file without touches.
pub(super) fn no_touches() -> Error {
    problem!("no touches in it").fix("Capture the object again, or remove the file.")
}

/// All touches in a text, as [`touches`]. Where many of them take longer than `longest`, they are refused.
///
/// # Errors
/// When a line is wrong, or times are not in seconds.
pub fn within(text: impl BufRead, path: &Path, longest: &Longest) -> Result<Vec<Touch>> {
    read_lines(text, path, longest, &mut Strict::default()).map(|(touches, _)| touches)
}

/// Largest number of wrong lines of a file that a sink is given; the others are counted.
const MOST_LINES: usize = 20;

/// The touches of the right lines of a text; true if all are right.
pub(super) fn read_lines(
    text: impl BufRead,
    path: &Path,
    longest: &Longest,
    sink: &mut dyn Sink,
) -> Result<(Vec<Touch>, bool)> {
    let (mut touches, mut wrong) = (Vec::new(), 0);
    for touch in numbered(text, path) {
        match touch {
            Ok(touch) => touches.push(touch),
            Err(error) if error.is(&Kind::Io) => return Err(error),
            Err(error) => {
                wrong += 1;
                if wrong <= MOST_LINES {
                    sink.fault(error)?;
                }
            }
        }
    }
    if wrong > MOST_LINES {
        let more = problem!("{} more lines are wrong", wrong - MOST_LINES).fix("Correct them, or capture again.");
        sink.fault(more.at(Place::file(path)))?;
    }
    let checked = longest.check_all(touches.iter().map(|(line, touch)| (*line, touch)));
    let is_right = wrong == 0 && checked.is_ok();
    if let Err((line, error)) = checked {
        sink.fault(error.at(Place::line(path, line)))?;
    }
    Ok((touches.into_iter().map(|(_, touch)| touch).collect(), is_right))
}

/// Reads one line: three contact times in seconds on any common clock (`-` where missing), rounded to whole
/// microseconds and shifted so that the first contact is 0, optionally direction and alignment, and behind them optionally
/// the position in millimeters.
///
/// # Errors
/// Fault of the line.
pub fn parse_touch(line: &str) -> Result<Touch> {
    touch(line).map_err(|error| error.fix(CORRECT))
}

/// Remedy for a wrong line.
const CORRECT: &str = "Correct the line: three times in seconds, - for a missing contact, and optionally direction and \
                       alignment, and behind them the position in millimeters.";

fn touch(line: &str) -> Result<Touch> {
    let mut found = [""; 12];
    let mut count = 0;
    for field in fields(line) {
        if let Some(slot) = found.get_mut(count) {
            *slot = field;
        }
        count += 1;
    }
    if ![3, 9, 12].contains(&count) {
        return Err(problem!(
            "{count} fields where a touch has three times, three times and six direction cosines, or these and three coordinates"
        ));
    }
    let [a, b, c, pose @ ..] = found;
    let touch = Touch::new(contact_times([parse_time(a)?, parse_time(b)?, parse_time(c)?])?);
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

/// The fields of a line.
fn fields(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c == ',' || c.is_whitespace()).filter(|field| !field.is_empty())
}

fn parse_time(field: &str) -> Result<Option<f64>> {
    if field == "-" { Ok(None) } else { parse_number(field).map(Some) }
}

fn parse_unit(name: &str, fields: [&str; 3]) -> Result<[i16; 3]> {
    let [x, y, z] = fields;
    unit_vector(name, [parse_number(x)?, parse_number(y)?, parse_number(z)?])
}

fn parse_number(field: &str) -> Result<f64> {
    let number: f64 = field.parse().map_err(|_| problem!("{field:?} is not a number"))?;
    if number.is_finite() { Ok(number) } else { Err(problem!("{field} is not finite")) }
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

/// The lines of touches, each as [`write_touch`] writes it.
pub(crate) fn lines<'t>(touches: impl IntoIterator<Item = &'t Touch>, pose: bool) -> String {
    let mut lines = String::new();
    touches.into_iter().for_each(|touch| write_touch(&mut lines, touch, pose));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::approach::to_q15;
    use palpate_shared::Position;

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
    fn a_mark_names_of_columns_and_comments_are_skipped_and_clocks_may_count_from_1970() {
        let plain = "0.000123 0 -\n0 0.5 0.25\n";
        let read = |text: &str| within(text.as_bytes(), Path::new("cup.txt"), &Longest::default());
        for text in [
            "\u{feff}0.000123 0 -\r\n\r\n0 0.5 0.25",
            "\u{feff}first,middle,last\n0.000123,0,-\n0,0.5,0.25\n",
            "# by hand\n\nt1\tt2\tt3\n0.000123\t0\t-\n#0 0 9\n0 0.5 0.25\n",
            "1732819200.000123 1732819200 -\n1732819201.5 1732819202 1732819201.75\n",
            "5000.000123 5000 -\n1e4 10000.5 10000.25\n",
        ] {
            assert_eq!(read(text).unwrap(), read(plain).unwrap(), "{text}");
        }
        for (text, place) in [
            ("0 0 0\nfirst middle last\n", "cup.txt:2: \"first\" is not a number"),
            ("first middle last\nfirst middle last\n0 0 0", "cup.txt:2: \"first\""),
            ("# t1\nx 0 0\n", "cup.txt:2: \"x\" is not a number"),
            ("nan nan nan\n", "cup.txt:1: nan is not finite"),
            (
                "0 1732819200 0\n",
                "cup.txt:1: a finger touched 1732819200 s after the first, and a touch can hold 4294 s",
            ),
        ] {
            let said = read(text).unwrap_err().to_string();
            assert!(said.starts_with(place), "{said}");
        }
    }

    #[test]
    fn times_of_which_most_are_too_long_are_refused_at_the_line_of_the_first() {
        let longest = Longest::of_scale("the model", 2.0, 10, palpate_shared::format::Length::Tenth);
        let read = |text: &str| within(text.as_bytes(), Path::new("cup.txt"), &longest);
        // Contacts at one time say nothing of the unit.
        let lines = "- 0 -\n0 0 0\n0 1.5 -\n\n0 62 -\n";
        let said = read(lines).unwrap_err().to_string();
        let why = "cup.txt:5: a finger touched 62.0 s after the first, but no object of the model's scale takes longer than 2.00 s at \
                   its speed of 10 units per second. Give times in seconds, not in milliseconds: 0.0622 for 62.2 ms.";
        assert!(said.starts_with(why), "{said}");
        assert_eq!(read(&(lines.to_owned() + "0 1.9 -\n")).unwrap().len(), 5, "one of three may be a slip");
        // With a position heights tell.
        assert!(read("0 62 - 0 0 -1 1 0 0 1 2 3\n").is_ok());
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
            ("0 1e9 0", "a finger touched 1000000000 s after the first"),
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
