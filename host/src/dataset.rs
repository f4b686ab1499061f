//! Touches on disk: a directory with a text file for each object, one touch a line.
//!
//! A line holds three contact times in seconds, a missing contact as `-`, and optionally the probe's direction and
//! alignment (six numbers). Fields are separated by spaces or commas. The published data set has the same format.

pub mod manifest;
#[cfg(feature = "parquet")]
pub mod parquet;

use crate::error::{Error, Result};
use manifest::Manifest;
use palpate_shared::{ContactTime, Pose, Q15_ONE, Touch};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// The touches of two or more objects.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// The objects, sorted by name.
    pub objects: Vec<ObjectTouches>,
}

/// The touches of one object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectTouches {
    /// The object's name.
    pub name: String,
    /// Its touches, in the order of the file; at least one.
    pub touches: Vec<Touch>,
}

impl Dataset {
    /// Reads every `<object>.txt` and `<object>.parquet` of a directory.
    ///
    /// # Errors
    /// When the directory cannot be read, holds fewer than two objects or an unfinished capture, when a file holds no
    /// touch, and when a line is wrong (file and line named).
    pub fn read(directory: &Path) -> Result<Self> {
        if Manifest::read(directory)?.is_some_and(|manifest| !manifest.complete) {
            let fix = "Repeat the capture's command with --resume.";
            return Err(Error::file(directory, "the capture of these touches is not complete", fix));
        }
        let objects = files(directory)?
            .into_iter()
            .map(|(name, path, format)| Ok(ObjectTouches { name, touches: format.read(&path)? }))
            .collect::<Result<Vec<_>>>()?;
        Ok(Self { objects })
    }

    /// The objects' names, sorted.
    pub fn names(&self) -> Vec<String> {
        self.objects.iter().map(|object| object.name.clone()).collect()
    }

    /// How many touches there are, of all objects together.
    pub fn len(&self) -> usize {
        self.objects.iter().map(|object| object.touches.len()).sum()
    }

    /// Whether there is no touch at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// How touches are kept on the disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// A line a touch.
    #[default]
    Text,
    /// A row a touch, in columns, compressed.
    Parquet,
}

impl Format {
    /// How the files' names end.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Text => "txt",
            Self::Parquet => "parquet",
        }
    }

    /// Refuses a format that this program was built without.
    ///
    /// # Errors
    /// [`Error::Argument`].
    pub fn check(self) -> Result<()> {
        if self == Self::Parquet && !cfg!(feature = "parquet") {
            let fix = "Build it with: cargo build --release --features parquet.";
            return Err(Error::argument("this program was built without Parquet", fix));
        }
        Ok(())
    }

    fn read(self, path: &Path) -> Result<Vec<Touch>> {
        self.check()?;
        #[cfg(feature = "parquet")]
        if self == Self::Parquet {
            return parquet::read(path);
        }
        read_text(path)
    }
}

/// The objects' names and files, sorted by name.
fn files(directory: &Path) -> Result<Vec<(String, PathBuf, Format)>> {
    let io = |source| Error::io(directory, "read the data set", source);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let is_in = |format: &Format| path.extension().is_some_and(|extension| extension == format.extension());
        if let Some(format) = [Format::Text, Format::Parquet].into_iter().find(is_in)
            && let Some(name) = path.file_stem().and_then(|stem| stem.to_str())
        {
            files.push((name.to_owned(), path, format));
        }
    }
    files.sort();
    if let Some(twice) = files.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        let what =
            format!("two files of the object {}: {} and {}", twice[0].0, twice[0].1.display(), twice[1].1.display());
        return Err(Error::file(directory, what, "Remove one of them."));
    }
    match files.as_slice() {
        [] => Err(Error::file(
            directory,
            "no touches here (no .txt file)",
            "Fill it with: palpate capture builtin -o DIR.",
        )),
        [(name, ..)] => Err(Error::file(
            directory,
            format!("only one object here, {name}, and nothing to tell it from"),
            "Capture at least two objects into the directory.",
        )),
        _ => Ok(files),
    }
}

/// Touches of a text file, one after the other.
///
/// # Errors
/// When the file cannot be read; then each line that is wrong.
pub fn lines(path: &Path) -> Result<impl Iterator<Item = Result<Touch>>> {
    let io = move |source| Error::io(path, "read the touches", source);
    let mut reader = BufReader::with_capacity(1 << 16, File::open(path).map_err(io)?);
    let (mut bytes, mut line) = (Vec::new(), 0);
    Ok(std::iter::from_fn(move || {
        loop {
            bytes.clear();
            line += 1;
            match reader.read_until(b'\n', &mut bytes) {
                Err(error) => return Some(Err(io(error))),
                Ok(0) => return None,
                Ok(_) => {}
            }
            let wrong = |what| Error::line(path, line, what, "Correct the line, or capture the object anew.");
            match std::str::from_utf8(&bytes).map(str::trim) {
                Err(_) => return Some(Err(wrong("not text (no UTF-8)".to_owned()))),
                Ok("") => {}
                Ok(text) => return Some(parse_touch(text).map_err(wrong)),
            }
        }
    }))
}

/// Reads the touches of one text file; blank lines are skipped.
///
/// # Errors
/// When the file cannot be read, holds no touch, or has a wrong line.
pub fn read_text(path: &Path) -> Result<Vec<Touch>> {
    let touches = lines(path)?.collect::<Result<Vec<_>>>()?;
    if touches.is_empty() {
        return Err(Error::file(path, "no touches in it", "Capture the object anew, or remove the file."));
    }
    Ok(touches)
}

/// Reads one line: three contact times in seconds on any common clock (`-` where missing), rounded to whole
/// microseconds and shifted so that the first contact is 0, and optionally direction and alignment.
///
/// # Errors
/// What is wrong with the line, without a full stop.
pub fn parse_touch(line: &str) -> Result<Touch, String> {
    let mut fields = [""; 9];
    let mut count = 0;
    for field in line.split(|c: char| c == ',' || c.is_whitespace()).filter(|field| !field.is_empty()) {
        if let Some(slot) = fields.get_mut(count) {
            *slot = field;
        }
        count += 1;
    }
    if count != 3 && count != 9 {
        return Err(format!("{count} fields where a touch has three times, or three times and six direction cosines"));
    }
    let [a, b, c, pose @ ..] = fields;
    let touch = Touch::new([parse_time(a)?, parse_time(b)?, parse_time(c)?]);
    if count == 3 {
        return Ok(touch);
    }
    let [dx, dy, dz, ax, ay, az] = pose;
    let direction = parse_unit("direction", [dx, dy, dz])?;
    let alignment = parse_unit("alignment", [ax, ay, az])?;
    Ok(touch.with_pose(Pose { direction, alignment }))
}

/// The longest contact time that a touch can hold, in microseconds.
const LONGEST: f64 = (u32::MAX - 1) as f64;

fn parse_time(field: &str) -> Result<ContactTime, String> {
    if field == "-" {
        return Ok(ContactTime::MISSING);
    }
    contact_time(parse_number(field)?)
}

/// Finite seconds as whole microseconds.
fn contact_time(seconds: f64) -> Result<ContactTime, String> {
    if seconds < 0.0 {
        return Err(format!("the time {seconds} is negative"));
    }
    let micros = (seconds * 1e6).round();
    if micros > LONGEST {
        return Err(format!("the time {seconds} is longer than the 4294 s that a touch can hold"));
    }
    Ok(ContactTime::from_micros(micros as u32))
}

/// A unit vector in Q15. Vectors shorter or longer than 1 by more than 1 % are refused.
fn parse_unit(what: &str, fields: [&str; 3]) -> Result<[i16; 3], String> {
    let [x, y, z] = fields;
    let vector = [parse_number(x)?, parse_number(y)?, parse_number(z)?];
    let length = vector.iter().map(|c| c * c).sum::<f64>().sqrt();
    if (length - 1.0).abs() > 0.01 {
        return Err(format!("the {what} has length {length:.3} where a unit vector has 1"));
    }
    Ok(vector.map(to_q15))
}

fn parse_number(field: &str) -> Result<f64, String> {
    let number: f64 = field.parse().map_err(|_| format!("{field:?} is not a number"))?;
    if number.is_finite() { Ok(number) } else { Err(format!("{field} is not finite")) }
}

/// A direction cosine as the nearest Q15 number.
pub fn to_q15(cosine: f64) -> i16 {
    let one = f64::from(Q15_ONE);
    (cosine * one).round().clamp(-one, one) as i16
}

/// Appends the line of a touch with its line end: times with six decimals, and with `pose` the direction and alignment
/// (six decimals, enough to find each Q15 number again). [`parse_touch`] gives the same touch back.
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
            ("0 0 0 1 1 0 1 0 0", "the direction has length 1.414"),
            ("0 0 0 1 0 0 0 0 0", "the alignment has length 0.000"),
            ("0 0 0 - 0 0 0 0 0", "\"-\" is not a number"),
        ] {
            let error = parse_touch(line).unwrap_err();
            assert!(error.contains(what), "{line:?}: {error}");
        }
    }

    #[test]
    fn objects_are_sorted_by_name_and_other_files_ignored() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["spoon.txt", "fork.txt", "notes.md", "cup.part"] {
            std::fs::write(directory.path().join(name), "0 0.1 0.2\r\n\n0.000000,0.3,-").unwrap();
        }
        let dataset = Dataset::read(directory.path()).unwrap();
        assert_eq!(dataset.names(), ["fork", "spoon"]);
        assert_eq!(dataset.len(), 4);
    }

    #[test]
    fn a_directory_that_is_missing_empty_or_of_one_object_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let error = |path: &Path| Dataset::read(path).unwrap_err().to_string();
        assert!(error(&directory.path().join("nowhere")).contains("cannot read the data set"));
        assert!(error(directory.path()).contains("no touches here"));
        std::fs::write(directory.path().join("fork.txt"), "0 0 0\n").unwrap();
        assert!(error(directory.path()).contains("only one object here, fork"));
    }

    #[test]
    fn a_wrong_line_is_named_with_its_file() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("cup.txt"), "0 0 0\n").unwrap();
        let path = directory.path().join("fork.txt");
        for (text, place) in
            [(&b"0 0 0\n\n0 0 -1\n"[..], "fork.txt:3: the time -1"), (b"0 0 0\n\xff\n", "fork.txt:2: not text")]
        {
            std::fs::write(&path, text).unwrap();
            let error = Dataset::read(directory.path()).unwrap_err();
            assert!(error.to_string().contains(place), "{error}");
            assert_eq!(error.exit_code(), 1);
        }
        std::fs::write(&path, "\n").unwrap();
        assert!(Dataset::read(directory.path()).unwrap_err().to_string().contains("fork.txt: no touches"));
    }
}
