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

use crate::error::{Error, Place, Result, problem};
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
    /// If it cannot be read; with file and line if it is not TOML, lacks a measure or has what a probe does not; with the
    /// file [`Kind::Setting`](crate::error::Kind::Setting) if a number is out of its range.
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
            let place = match before {
                Some(before) => Place::line(path, 1 + before.matches('\n').count() as u64),
                None => Place::file(path),
            };
            Self::unusable(error.message()).at(place)
        })?;
        let file = Self::of(&document);
        let length = match file.unit {
            Length::Tenth => 10.0,
            Length::Millimeter => 1.0,
        };
        let checked = file.probe.check(length).and_then(|()| file.real.check());
        checked.map(|()| file).map_err(|error| error.in_file(path))
    }

    /// A probe file cannot be used.
    pub fn unusable(message: &str) -> Error {
        problem!("not a usable probe file: {message}").fix(
            "Give unit (\"unit\" or \"mm\"), radius, spacing, speed, and optionally tilt, stroke, travel, timer and [real].",
        )
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
    parse: impl Fn(&str) -> Result<T>,
) -> Result<Option<T>, D::Error> {
    let text = String::deserialize(deserializer)?;
    parse(&text).map(Some).map_err(D::Error::custom)
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
        *share = quantity::share(&text).map_err(D::Error::custom)?;
    }
    Ok(shares)
}

fn length<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    read(deserializer, quantity::length)
}

fn angle<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    read(deserializer, quantity::angle)
}
