//! A probe as a file: `probe.toml`.
//!
//! ```toml
//! unit = "mm"       # or "unit", a tenth of the object's longest side: the default
//! radius = 1.5      # of a finger
//! spacing = 15.0    # between neighboring fingers
//! speed = 100.0     # per second
//! tilt = 10.0       # degrees; the default
//! stroke = 30.0     # how far the hand goes on after the first contact; later ones are missing. By default past the object
//! stroke_tolerance = 1.0 # how much later recorded contacts may be and count as missing; by default 2 % of the stroke
//! travel = 200.0    # how far it goes from its start before an approach is a miss; by default past the object
//! timer = "1ms"     # the timer's resolution; by default none
//!
//! [real]                          # what the real probe adds; all of it may be left out
//! speed_factor = 0.98             # its speed over the nominal one
//! offsets = [0.0, 0.3, 0.0]       # how far each finger stands out, toward the object
//! noise = "0..5ms"                # Gaussian, on every contact time
//! debounce = "2ms"
//! missed = "2%"                   # of the contacts; or of each finger's: ["1%", "2%", "0%"]
//! speed_error = "5%"              # off per touch
//! speed_bias = "1%"               # off per robot
//! pose_noise = "2deg"
//! pose_bias = "1deg"
//! position = "1mm"               # off in each coordinate, where touches state the hand's position
//! grazing = { angle = "30deg", bend = 0.5 } # beyond this angle, fingers bend aside by bend · tan(angle − this)
//! ```
//!
//! Radius, spacing, speed, stroke and unit are what a data set and a model state and what is compared. What the real probe adds
//! is not compared: it is added to touches by a capture with this file or else in training and testing, and never twice.

use crate::error::{Error, Place, ProbeProblem, Problem, Result};
use crate::probe::approach::{FINGERS, Probe};
use crate::probe::noise::{Deviation, Grazing, Noise, quantity};
use palpate_shared::format::Length;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use std::path::Path;

/// Contents of a probe file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeFile {
    /// The probe's measures.
    pub probe: Probe,
    /// Unit of the lengths.
    pub unit: Length,
    /// Noise that the real probe adds.
    pub real: Noise,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(default = "super::unit::tenth", with = "super::unit")]
    unit: Length,
    radius: f64,
    spacing: f64,
    speed: f64,
    #[serde(default = "tilt")]
    tilt: f64,
    stroke: Option<f64>,
    stroke_tolerance: Option<f64>,
    travel: Option<f64>,
    #[serde(default, deserialize_with = "duration")]
    timer: Option<f64>,
    #[serde(default)]
    real: Real,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Real {
    speed_factor: Option<f64>,
    offsets: [f64; FINGERS],
    #[serde(deserialize_with = "deviation")]
    noise: Option<Deviation>,
    #[serde(deserialize_with = "duration")]
    timer: Option<f64>,
    #[serde(deserialize_with = "duration")]
    debounce: Option<f64>,
    #[serde(deserialize_with = "shares")]
    missed: [f64; FINGERS],
    #[serde(deserialize_with = "share")]
    speed_error: Option<f64>,
    #[serde(deserialize_with = "share")]
    speed_bias: Option<f64>,
    #[serde(deserialize_with = "angle")]
    pose_noise: Option<f64>,
    #[serde(deserialize_with = "angle")]
    pose_bias: Option<f64>,
    #[serde(deserialize_with = "length")]
    position: Option<f64>,
    grazing: Option<Aside>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Aside {
    #[serde(default, deserialize_with = "angle")]
    angle: Option<f64>,
    bend: f64,
}

impl ProbeFile {
    /// Reads a probe file.
    ///
    /// # Errors
    /// If it cannot be read; with file and line [`ProbeProblem::BadFile`] if it is not TOML, lacks a measure or has what
    /// a probe does not; with the file [`Setting`](crate::error::Setting) if a number is out of its
    /// range.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, "read the probe", error))?;
        Self::parse(&text, path)
    }

    /// Reads the text of a probe file; errors name `path`.
    ///
    /// # Errors
    /// Errors of [`read`](Self::read).
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let document: Document = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start));
            let message = error.message().to_owned();
            let place = match before {
                Some(before) => Place::line(path, 1 + before.matches('\n').count() as u64),
                None => Place::file(path),
            };
            Error::at(place, ProbeProblem::BadFile { message })
        })?;
        let file = Self::of(&document);
        let length = match file.unit {
            Length::Tenth => 10.0,
            Length::Millimeter => 1.0,
        };
        let checked = file.probe.check(length).and_then(|()| file.real.check());
        checked.map(|()| file).map_err(|error| error.in_file(path))
    }

    fn of(document: &Document) -> Self {
        let Document { unit, radius, spacing, speed, tilt, stroke, stroke_tolerance, travel, timer, ref real } =
            *document;
        let real = Noise {
            deviation: real.noise.unwrap_or_default(),
            timer: real.timer.or(timer).unwrap_or_default(),
            debounce: real.debounce.unwrap_or_default(),
            missed: real.missed,
            // A finger that stands out by a length touches earlier by the time that the probe takes for it.
            bent: real.offsets.map(|offset| offset / speed * 1e6),
            speed: real.speed_factor.unwrap_or(1.0),
            speed_error: real.speed_error.unwrap_or_default(),
            speed_bias: real.speed_bias.unwrap_or_default(),
            pose: real.pose_noise.unwrap_or_default(),
            pose_bias: real.pose_bias.unwrap_or_default(),
            position: real.position.unwrap_or_default(),
            drift: [0.0; 2],
            // Lengths become the times that the probe takes for them.
            grazing: real.grazing.map_or_else(Grazing::default, |Aside { angle, bend }| Grazing {
                angle: angle.unwrap_or_default(),
                bend: bend / speed * 1e6,
            }),
        };
        Self { probe: Probe { radius, spacing, speed, tilt, stroke, travel, stroke_tolerance }, unit, real }
    }
}

fn tilt() -> f64 {
    Probe::default().tilt
}

/// A quantity that is written as text with its unit.
fn read<'de, D: Deserializer<'de>, T>(
    deserializer: D,
    parse: impl Fn(&str) -> Result<T, ProbeProblem>,
) -> Result<Option<T>, D::Error> {
    let text = String::deserialize(deserializer)?;
    parse(&text).map(Some).map_err(|problem| D::Error::custom(format!("{problem}. {}", problem.fix())))
}

fn duration<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    read(deserializer, quantity::duration)
}

fn deviation<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Deviation>, D::Error> {
    read(deserializer, str::parse)
}

fn share<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    read(deserializer, quantity::share)
}

/// A share of all fingers' contacts, or one of each finger's.
fn shares<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; FINGERS], D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Shares {
        One(String),
        Each([String; FINGERS]),
    }
    let given = Shares::deserialize(deserializer).map_err(|_| {
        D::Error::custom("missed is a share such as \"2%\", or one of each finger: [\"1%\", \"2%\", \"0%\"]")
    })?;
    let texts = match given {
        Shares::One(text) => std::array::from_fn(|_| text.clone()),
        Shares::Each(texts) => texts,
    };
    let mut shares = [0.0; FINGERS];
    for (share, text) in shares.iter_mut().zip(texts) {
        *share = quantity::share(&text).map_err(|problem| D::Error::custom(format!("{problem}. {}", problem.fix())))?;
    }
    Ok(shares)
}

fn length<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    read(deserializer, quantity::length)
}

fn angle<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    read(deserializer, quantity::angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MEASURES: &str = "radius = 1.5\nspacing = 15\nspeed = 100.0\n";

    fn parse(text: &str) -> Result<ProbeFile> {
        ProbeFile::parse(text, Path::new("probe.toml"))
    }

    #[test]
    fn measures_are_enough_and_a_unit_is_a_tenth_of_the_longest_side() {
        let probe = Probe { radius: 1.5, spacing: 15.0, speed: 100.0, ..Probe::default() };
        assert_eq!(parse(MEASURES).unwrap(), ProbeFile { probe, unit: Length::Tenth, real: Noise::default() });
    }

    #[test]
    fn a_real_probe_adds_what_its_part_says() {
        let text = format!(
            "unit = \"mm\"\n{MEASURES}tilt = 0\ntimer = \"1ms\"\n[real]\nspeed_factor = 0.98\noffsets = [0, 0.3, -0.1]\n\
             noise = \"0..5ms\"\ndebounce = \"2ms\"\nmissed = \"2%\"\nspeed_error = \"5%\"\nspeed_bias = \"1%\"\n\
             pose_noise = \"2deg\"\npose_bias = \"1deg\"\nposition = \"1mm\"\ngrazing = {{ angle = \"30deg\", bend = 0.5 }}\n"
        );
        let file = parse(&text).unwrap();
        assert_eq!((file.unit, file.probe.tilt), (Length::Millimeter, 0.0));
        let real = Noise {
            deviation: Deviation { least: 0.0, largest: 5_000.0 },
            timer: 1_000.0,
            debounce: 2_000.0,
            missed: [0.02; 3],
            bent: [0.0, 3_000.0, -1_000.0],
            speed: 0.98,
            speed_error: 0.05,
            speed_bias: 0.01,
            pose: 2.0,
            pose_bias: 1.0,
            position: 1_000.0,
            drift: [0.0; 2],
            grazing: Grazing { angle: 30.0, bend: 5_000.0 },
        };
        assert_eq!(file.real, real);
        let each = parse(&text.replace("\"2%\"", "[\"1%\", \"0.02\", \"0%\"]")).unwrap();
        assert_eq!(each.real, Noise { missed: [0.01, 0.02, 0.0], ..real });
    }

    #[test]
    fn a_stroke_and_a_travel_are_lengths_in_the_unit_of_the_file() {
        let file = parse(&format!("{MEASURES}stroke = 30\ntravel = 200.5\n")).unwrap();
        assert_eq!((file.probe.stroke, file.probe.travel), (Some(30.0), Some(200.5)));
        assert_eq!(file.probe.window(), Some(300_000));
        let known = parse(&format!("{MEASURES}stroke = 30\nstroke_tolerance = 1.5\n")).unwrap();
        assert_eq!((known.probe.window(), known.probe.latest()), (Some(300_000), Some(315_000.0)));
        let wrong = [
            ("stroke = 0", "stroke"),
            ("travel = -3", "travel"),
            ("stroke_tolerance = 1", "stroke_tolerance is 1"),
            ("stroke = \"3\"", "4: not a usable probe file: invalid type: string \"3\""),
        ];
        for (text, named) in wrong {
            let error = parse(&format!("{MEASURES}{text}\n")).unwrap_err().to_string();
            assert!(error.starts_with("probe.toml:") && error.contains(named), "{error}");
        }
    }

    #[test]
    fn what_is_wrong_in_a_probe_file_is_named_with_its_line() {
        for (text, line, part) in [
            (format!("{MEASURES}weight = 3\n"), 4, "weight"),
            (format!("{MEASURES}[real]\nnoise = 5\n"), 5, "string"),
            (format!("{MEASURES}[real]\nnoise = \"5\"\n"), 5, "0..10ms"),
            (format!("{MEASURES}[real]\njitter = \"5ms\"\n"), 5, "jitter"),
            (format!("{MEASURES}[real]\nmissed = [\"1%\", \"2%\"]\n"), 5, "of each finger"),
            (format!("{MEASURES}[real]\nmissed = [\"1%\", \"2\", \"few\"]\n"), 5, "few"),
            (format!("unit = \"inch\"\n{MEASURES}"), 1, "mm"),
            (format!("{MEASURES}tilt = \"much\"\n"), 4, "much"),
            (format!("{MEASURES}spacing 3\n"), 4, ""),
            ("radius = 1.0\n".into(), 1, "spacing"),
        ] {
            let error = parse(&text).unwrap_err();
            assert!(error.to_string().starts_with(&format!("probe.toml:{line}: not a usable probe file: ")), "{error}");
            assert!(error.to_string().contains(part), "{error}");
            assert_eq!(error.exit_code(), 1);
        }
    }

    #[test]
    fn numbers_out_of_range_are_named_with_the_file() {
        for text in [MEASURES.replace("1.5", "-1"), format!("{MEASURES}[real]\nmissed = \"200%\"\n")] {
            let error = parse(&text).unwrap_err().to_string();
            assert!(error.starts_with("probe.toml: "), "{error}");
        }
    }
}
