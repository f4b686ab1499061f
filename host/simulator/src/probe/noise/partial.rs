//! Settings of noise as users write them in one text: `noise=0..5ms,timer=1ms,missed=2%`.

use super::{Deviation, Noise, quantity};
use crate::error::{Error, Kind, Result, problem};
use crate::probe::approach::FINGERS;
use std::fmt;
use std::str::FromStr;

/// Some settings of [`Noise`], as one text of `key=value` with commas between them; the others are left open.
///
/// The keys are those of `[real]` in a probe file: `noise`, `timer`, `debounce`, `missed`, `bent`, `speed_factor`,
/// `speed_error`, `speed_bias`, `pose_noise`, `pose_bias` and `position`, and `drift` such as
/// `1mm/1deg`, which a file does not state. Fingers that bend aside have no key: only a capture adds that, from a probe file. `missed` and `bent` also take a value for each finger, such as
/// `bent=3ms/0ms/-1ms`; `bent` says how much earlier a finger touches. `none`, which comes first, sets everything to
/// nothing. [`Display`](fmt::Display) writes a text that reads as the same.
///
/// ```
/// use palpate_simulator::probe::noise::{Noise, PartialNoise};
///
/// let given: PartialNoise = "timer=0ms,missed=2%".parse()?;
/// let noise = given.over(Noise::switch());
/// assert_eq!((noise.deviation.largest, noise.timer, noise.missed), (5_000.0, 0.0, [0.02; 3]));
/// assert!("none".parse::<PartialNoise>()?.over(Noise::switch()).is_none());
/// # Ok::<_, palpate_simulator::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartialNoise {
    /// See [`Noise::deviation`].
    pub deviation: Option<Deviation>,
    /// See [`Noise::timer`].
    pub timer: Option<f64>,
    /// See [`Noise::debounce`].
    pub debounce: Option<f64>,
    /// See [`Noise::missed`].
    pub missed: Option<[f64; FINGERS]>,
    /// See [`Noise::bent`].
    pub bent: Option<[f64; FINGERS]>,
    /// See [`Noise::speed`].
    pub speed: Option<f64>,
    /// See [`Noise::speed_error`].
    pub speed_error: Option<f64>,
    /// See [`Noise::speed_bias`].
    pub speed_bias: Option<f64>,
    /// See [`Noise::pose`].
    pub pose: Option<f64>,
    /// See [`Noise::pose_bias`].
    pub pose_bias: Option<f64>,
    /// See [`Noise::position`].
    pub position: Option<f64>,
    /// See [`Noise::drift`].
    pub drift: Option<[f64; 2]>,
}

/// The value of a key cannot be used; the key is `real` where it is a part of the text without one.
fn wrong(key: &'static str, value: &str, wanted: &str) -> Error {
    let (value, allowed) = (value.to_owned(), wanted.to_owned());
    problem!("{key} is {value:?}; use {wanted}").as_kind(Kind::Setting { name: key, value, allowed })
}

impl From<Noise> for PartialNoise {
    fn from(noise: Noise) -> Self {
        Self {
            deviation: Some(noise.deviation),
            timer: Some(noise.timer),
            debounce: Some(noise.debounce),
            missed: Some(noise.missed),
            bent: Some(noise.bent),
            speed: Some(noise.speed),
            speed_error: Some(noise.speed_error),
            speed_bias: Some(noise.speed_bias),
            pose: Some(noise.pose),
            pose_bias: Some(noise.pose_bias),
            position: Some(noise.position),
            drift: Some(noise.drift),
        }
    }
}

impl PartialNoise {
    /// All keys, in the order in which they are written.
    pub const KEYS: [&str; 12] = [
        "noise",
        "timer",
        "debounce",
        "missed",
        "bent",
        "speed_factor",
        "speed_error",
        "speed_bias",
        "pose_noise",
        "pose_bias",
        "position",
        "drift",
    ];

    /// The settings that are given, and `base` where they are open.
    #[must_use]
    pub fn over(&self, base: Noise) -> Noise {
        Noise {
            deviation: self.deviation.unwrap_or(base.deviation),
            timer: self.timer.unwrap_or(base.timer),
            debounce: self.debounce.unwrap_or(base.debounce),
            missed: self.missed.unwrap_or(base.missed),
            bent: self.bent.unwrap_or(base.bent),
            speed: self.speed.unwrap_or(base.speed),
            speed_error: self.speed_error.unwrap_or(base.speed_error),
            speed_bias: self.speed_bias.unwrap_or(base.speed_bias),
            pose: self.pose.unwrap_or(base.pose),
            pose_bias: self.pose_bias.unwrap_or(base.pose_bias),
            position: self.position.unwrap_or(base.position),
            drift: self.drift.unwrap_or(base.drift),
            grazing: if self.is_whole() { super::Grazing::default() } else { base.grazing },
        }
    }

    /// True if nothing is left open.
    fn is_whole(&self) -> bool {
        Self::KEYS.iter().all(|key| self.has(key))
    }

    /// True if the setting of this key is given.
    fn has(&self, key: &str) -> bool {
        match key {
            "noise" => self.deviation.is_some(),
            "timer" => self.timer.is_some(),
            "debounce" => self.debounce.is_some(),
            "missed" => self.missed.is_some(),
            "bent" => self.bent.is_some(),
            "speed_factor" => self.speed.is_some(),
            "speed_error" => self.speed_error.is_some(),
            "speed_bias" => self.speed_bias.is_some(),
            "pose_noise" => self.pose.is_some(),
            "pose_bias" => self.pose_bias.is_some(),
            "position" => self.position.is_some(),
            "drift" => self.drift.is_some(),
            _ => false,
        }
    }

    /// Takes the value of a known key.
    fn set(&mut self, key: &'static str, value: &str) -> Result<()> {
        let bad = |error: Error| wrong(key, value, error.remedy().trim_start_matches("Give ").trim_end_matches('.'));
        match key {
            "noise" => self.deviation = Some(value.parse().map_err(bad)?),
            "timer" => self.timer = Some(quantity::duration(value).map_err(bad)?),
            "debounce" => self.debounce = Some(quantity::duration(value).map_err(bad)?),
            "missed" => self.missed = Some(each(value, quantity::share).map_err(bad)?),
            "bent" => self.bent = Some(each(value, signed).map_err(bad)?),
            "speed_factor" => {
                let speed = value.trim().parse::<f64>().ok().filter(|speed| *speed > 0.0 && speed.is_finite());
                let example = "a number greater than 0 such as 0.98";
                self.speed = Some(speed.ok_or_else(|| wrong(key, value, example))?);
            }
            "speed_error" => self.speed_error = Some(quantity::share(value).map_err(bad)?),
            "speed_bias" => self.speed_bias = Some(quantity::share(value).map_err(bad)?),
            "pose_noise" => self.pose = Some(quantity::angle(value).map_err(bad)?),
            "pose_bias" => self.pose_bias = Some(quantity::angle(value).map_err(bad)?),
            "position" => self.position = Some(quantity::length(value).map_err(bad)?),
            _ => {
                let example = "a length and an angle such as 1mm/1deg";
                let (moved, turned) = value.split_once('/').ok_or_else(|| wrong(key, value, example))?;
                self.drift = Some([quantity::length(moved).map_err(bad)?, quantity::angle(turned).map_err(bad)?]);
            }
        }
        // Ranges are those of any noise.
        match self.over(Noise::default()).check() {
            Ok(()) => Ok(()),
            Err(error) => {
                let Kind::Setting { allowed, .. } = error.kind() else { return Err(error) };
                Err(wrong(key, value, allowed))
            }
        }
    }
}

/// One value for all fingers, or one for each with slashes between them.
fn each(text: &str, read: impl Fn(&str) -> Result<f64>) -> Result<[f64; FINGERS]> {
    let example = "one value for all fingers, or one for each such as 1%/2%/0% or 3ms/0ms/-1ms";
    let values = text.split('/').map(read).collect::<Result<Vec<f64>>>()?;
    match values[..] {
        [one] => Ok([one; FINGERS]),
        [first, second, third] => Ok([first, second, third]),
        _ => Err(quantity::bad(text, example)),
    }
}

/// A duration that may be negative.
fn signed(text: &str) -> Result<f64> {
    match text.trim().strip_prefix('-') {
        Some(late) => quantity::duration(late).map(|late| -late),
        None => quantity::duration(text),
    }
}

impl FromStr for PartialNoise {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut noise = Self::default();
        for (index, part) in text.split(',').enumerate() {
            if index == 0 && part.trim() == "none" {
                noise = Noise::default().into();
                continue;
            }
            let whole = |wanted: &str| wrong("real", part.trim(), wanted);
            let Some((key, value)) = part.split_once('=') else {
                return Err(whole("settings such as noise=0..5ms,timer=1ms,missed=2%, or none"));
            };
            let key = key.trim().replace('-', "_");
            let Some(key) = Self::KEYS.into_iter().find(|known| *known == key) else {
                return Err(whole(&format!("one of {}", Self::KEYS.join(", "))));
            };
            let earlier = text.split(',').take(index).filter_map(|part| part.split_once('='));
            if earlier.into_iter().any(|(earlier, _)| earlier.trim().replace('-', "_") == key) {
                return Err(wrong(key, value, "each key once"));
            }
            noise.set(key, value.trim())?;
        }
        Ok(noise)
    }
}

/// A text that, when read, gives the same value to the last bit.
impl fmt::Display for PartialNoise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nothing = Noise::default();
        let noise = self.over(nothing);
        let is_whole = self.is_whole();
        let mut parts: Vec<String> = is_whole.then(|| "none".into()).into_iter().collect();
        let usual = Self::from(nothing);
        for key in Self::KEYS.into_iter().filter(|key| self.has(key)) {
            let value = value_of(&noise, key);
            if !is_whole || value != value_of(&usual.over(nothing), key) {
                parts.push(format!("{key}={value}"));
            }
        }
        f.write_str(&parts.join(","))
    }
}

/// The setting of a key as it is written.
fn value_of(noise: &Noise, key: &str) -> String {
    let fingers = |values: [f64; FINGERS], written: fn(f64) -> String| {
        let all = values.iter().all(|value| *value == values[0]);
        let count = if all { 1 } else { FINGERS };
        values[..count].iter().map(|value| written(*value)).collect::<Vec<_>>().join("/")
    };
    match key {
        "noise" => match noise.deviation {
            Deviation { least, largest } if least == largest => duration(least),
            Deviation { least, largest } => format!("{}..{}", duration(least), duration(largest)),
        },
        "timer" => duration(noise.timer),
        "debounce" => duration(noise.debounce),
        "missed" => fingers(noise.missed, share),
        "bent" => fingers(noise.bent, duration),
        "speed_factor" => noise.speed.to_string(),
        "speed_error" => share(noise.speed_error),
        "speed_bias" => share(noise.speed_bias),
        "pose_noise" => format!("{}deg", noise.pose),
        "pose_bias" => format!("{}deg", noise.pose_bias),
        "position" => length(noise.position),
        _ => format!("{}/{}deg", length(noise.drift[0]), noise.drift[1]),
    }
}

/// Microseconds as milliseconds, where that reads back as the same.
fn duration(micros: f64) -> String {
    let text = format!("{}ms", micros / 1e3);
    match signed(&text) {
        Ok(read) if read == micros => text,
        _ => format!("{micros}us"),
    }
}

/// Micrometers as millimeters, where that reads back as the same.
fn length(micrometers: f64) -> String {
    let text = format!("{}mm", micrometers / 1e3);
    match quantity::length(&text) {
        Ok(read) if read == micrometers => text,
        _ => format!("{micrometers}um"),
    }
}

/// A share as percent, where that reads back as the same.
fn share(share: f64) -> String {
    let text = format!("{}%", 100.0 * share);
    match quantity::share(&text) {
        Ok(read) if read == share => text,
        _ => share.to_string(),
    }
}
