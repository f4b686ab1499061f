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
use crate::probe::noise::quantity::ANGLE;
use crate::probe::noise::{self, Grazing, Noise};
use palpate_shared::format::Length;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use toml::{Spanned, Value};

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
    timer: Option<Spanned<Value>>,
    #[serde(default)]
    real: BTreeMap<String, Spanned<Value>>,
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
        let unusable = |error: &toml::de::Error, span: Option<Range<usize>>| {
            let before = span.and_then(|span| text.get(..span.start));
            let place = match before {
                Some(before) => Place::line(path, 1 + before.matches('\n').count() as u64),
                None => Place::file(path),
            };
            Self::unusable(error.message()).at(place)
        };
        let document: Document = toml::from_str(text).map_err(|error| unusable(&error, error.span()))?;
        let Document { unit, radius, spacing, speed, tilt, stroke, stroke_tolerance, travel, timer, real } = document;
        let mut noise = Noise::default();
        for (key, value) in timer.map(|timer| ("timer".into(), timer)).into_iter().chain(real) {
            let span = value.span();
            take(&mut noise, speed, &key, value.into_inner()).map_err(|error| unusable(&error, Some(span)))?;
        }
        let probe = Probe { radius, spacing, speed, tilt, stroke, travel, stroke_tolerance };
        let file = Self { probe, unit, real: noise };
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
}

fn tilt() -> f64 {
    Probe::default().tilt
}

fn angle<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    ANGLE.parse(&String::deserialize(deserializer)?).map(Some).map_err(D::Error::custom)
}

/// Takes the setting of a key under `[real]`, of a probe with this nominal speed.
fn take(noise: &mut Noise, speed: f64, key: &str, value: Value) -> std::result::Result<(), toml::de::Error> {
    // A file states how far fingers stand out as `offsets`, and objects move only on a simulated table.
    let known = noise::keys().into_iter().filter(|key| !["bent", "drift"].contains(key));
    let known: Vec<&str> = known.chain(["offsets", "grazing"]).collect();
    if !known.contains(&key) {
        let known = known.join("`, `");
        return Err(toml::de::Error::custom(format!("unknown field `{key}`, expected one of `{known}`")));
    }
    // Lengths become the times that the probe takes for them.
    let micros = |length: f64| length / speed * 1e6;
    let text = match (key, value) {
        ("offsets", value) => {
            // A finger that stands out touches earlier.
            noise.bent = value.try_into::<[f64; FINGERS]>()?.map(micros);
            return Ok(());
        }
        ("grazing", value) => {
            let Aside { angle, bend } = value.try_into()?;
            noise.grazing = Grazing { angle: angle.unwrap_or_default(), bend: micros(bend) };
            return Ok(());
        }
        ("speed_factor", value) => value.try_into::<f64>()?.to_string(),
        ("missed", value @ Value::Array(_)) => {
            let example = "missed is a share such as \"2%\", or one of each finger: [\"1%\", \"2%\", \"0%\"]";
            value.try_into::<[String; FINGERS]>().map_err(|_| toml::de::Error::custom(example))?.join("/")
        }
        (_, value) => value.try_into()?,
    };
    noise.set(key, &text).map_err(toml::de::Error::custom)
}
