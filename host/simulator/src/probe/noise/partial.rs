//! Settings of noise as users write them in one text: `noise=0..5ms,timer=1ms,missed=2%`.

use super::{Deviation, Noise, quantity};
use crate::error::{ProbeProblem, Setting};
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
/// # Ok::<_, palpate_simulator::probe::noise::BadNoise>(())
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

/// A text that is not noise: the key, its value, and what to write instead.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key} is {value:?}; use {wanted}")]
pub struct BadNoise {
    /// The key, such as `timer`; `real` where it is the text as a whole.
    pub key: String,
    /// The text as written.
    pub value: String,
    /// Values that can be written, such as "a duration such as 5ms".
    pub wanted: String,
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
    fn set(&mut self, key: &str, value: &str) -> Result<(), BadNoise> {
        let bad = |problem: ProbeProblem| {
            let wanted = match problem {
                ProbeProblem::BadQuantity { example, .. } => example.to_owned(),
                other => other.to_string(),
            };
            BadNoise { key: key.into(), value: value.into(), wanted }
        };
        match key {
            "noise" => self.deviation = Some(value.parse().map_err(bad)?),
            "timer" => self.timer = Some(quantity::duration(value).map_err(bad)?),
            "debounce" => self.debounce = Some(quantity::duration(value).map_err(bad)?),
            "missed" => self.missed = Some(each(value, quantity::share).map_err(bad)?),
            "bent" => self.bent = Some(each(value, signed).map_err(bad)?),
            "speed_factor" => {
                let speed = value.trim().parse::<f64>().ok().filter(|speed| *speed > 0.0 && speed.is_finite());
                let example = "a number greater than 0 such as 0.98";
                self.speed = Some(speed.ok_or_else(|| bad(ProbeProblem::BadQuantity { text: value.into(), example }))?);
            }
            "speed_error" => self.speed_error = Some(quantity::share(value).map_err(bad)?),
            "speed_bias" => self.speed_bias = Some(quantity::share(value).map_err(bad)?),
            "pose_noise" => self.pose = Some(quantity::angle(value).map_err(bad)?),
            "pose_bias" => self.pose_bias = Some(quantity::angle(value).map_err(bad)?),
            "position" => self.position = Some(quantity::length(value).map_err(bad)?),
            _ => {
                let example = "a length and an angle such as 1mm/1deg";
                let parts = value.split_once('/').ok_or(ProbeProblem::BadQuantity { text: value.into(), example });
                let (moved, turned) = parts.map_err(bad)?;
                self.drift = Some([quantity::length(moved).map_err(bad)?, quantity::angle(turned).map_err(bad)?]);
            }
        }
        // Ranges are those of any noise.
        match self.over(Noise::default()).check() {
            Ok(()) => Ok(()),
            Err(error) => {
                let wanted =
                    error.problem::<Setting>().map_or_else(|| error.to_string(), |wrong| wrong.allowed.clone());
                Err(BadNoise { key: key.into(), value: value.into(), wanted })
            }
        }
    }
}

/// One value for all fingers, or one for each with slashes between them.
fn each(text: &str, read: impl Fn(&str) -> Result<f64, ProbeProblem>) -> Result<[f64; FINGERS], ProbeProblem> {
    let example = "one value for all fingers, or one for each such as 1%/2%/0% or 3ms/0ms/-1ms";
    let values = text.split('/').map(read).collect::<Result<Vec<f64>, _>>()?;
    match values[..] {
        [one] => Ok([one; FINGERS]),
        [first, second, third] => Ok([first, second, third]),
        _ => Err(ProbeProblem::BadQuantity { text: text.into(), example }),
    }
}

/// A duration that may be negative.
fn signed(text: &str) -> Result<f64, ProbeProblem> {
    match text.trim().strip_prefix('-') {
        Some(late) => quantity::duration(late).map(|late| -late),
        None => quantity::duration(text),
    }
}

impl FromStr for PartialNoise {
    type Err = BadNoise;

    fn from_str(text: &str) -> Result<Self, BadNoise> {
        let mut noise = Self::default();
        for (index, part) in text.split(',').enumerate() {
            if index == 0 && part.trim() == "none" {
                noise = Noise::default().into();
                continue;
            }
            let whole = |wanted: String| BadNoise { key: "real".into(), value: part.trim().into(), wanted };
            let Some((key, value)) = part.split_once('=') else {
                let wanted = "settings such as noise=0..5ms,timer=1ms,missed=2%, or none".to_owned();
                return Err(whole(wanted));
            };
            let key = key.trim().replace('-', "_");
            let Some(key) = Self::KEYS.into_iter().find(|known| *known == key) else {
                return Err(whole(format!("one of {}", Self::KEYS.join(", "))));
            };
            let earlier = text.split(',').take(index).filter_map(|part| part.split_once('='));
            if earlier.into_iter().any(|(earlier, _)| earlier.trim().replace('-', "_") == key) {
                return Err(BadNoise { key: key.into(), value: value.into(), wanted: "each key once".into() });
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

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> PartialNoise {
        text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn every_key_sets_its_own_setting_and_leaves_the_others_open() {
        let deviation = Deviation { least: 0.0, largest: 5_000.0 };
        for (text, expected) in [
            ("noise=0..5ms", PartialNoise { deviation: Some(deviation), ..PartialNoise::default() }),
            ("noise=5ms", PartialNoise { deviation: Some(5_000.0.into()), ..PartialNoise::default() }),
            ("timer=1ms", PartialNoise { timer: Some(1_000.0), ..PartialNoise::default() }),
            ("debounce=300us", PartialNoise { debounce: Some(300.0), ..PartialNoise::default() }),
            ("missed=2%", PartialNoise { missed: Some([0.02; 3]), ..PartialNoise::default() }),
            ("missed=1%/0.02/0%", PartialNoise { missed: Some([0.01, 0.02, 0.0]), ..PartialNoise::default() }),
            ("bent=3ms/0ms/-500us", PartialNoise { bent: Some([3_000.0, 0.0, -500.0]), ..PartialNoise::default() }),
            ("speed_factor=0.98", PartialNoise { speed: Some(0.98), ..PartialNoise::default() }),
            ("speed_error=5%", PartialNoise { speed_error: Some(0.05), ..PartialNoise::default() }),
            ("speed-bias=0.1", PartialNoise { speed_bias: Some(0.1), ..PartialNoise::default() }),
            ("pose-noise=5deg", PartialNoise { pose: Some(5.0), ..PartialNoise::default() }),
            ("drift=1mm/0.5deg", PartialNoise { drift: Some([1_000.0, 0.5]), ..PartialNoise::default() }),
            ("position=0.5mm", PartialNoise { position: Some(500.0), ..PartialNoise::default() }),
            (" pose_bias = 1.5° ", PartialNoise { pose_bias: Some(1.5), ..PartialNoise::default() }),
        ] {
            assert_eq!(read(text), expected, "{text}");
        }
        assert_eq!(read("none"), Noise::default().into());
        assert_eq!(read("none,missed=2%").over(Noise::switch()), Noise { missed: [0.02; 3], ..Noise::default() });
        assert_eq!(read("timer=0ms").over(Noise::switch()), Noise { timer: 0.0, ..Noise::switch() });
    }

    #[test]
    fn what_is_written_reads_as_the_same_to_the_last_bit() {
        for text in [
            "noise=0ms..5ms,timer=1ms,debounce=2ms,missed=2%,bent=3ms/0ms/-0.5ms,speed_factor=0.98",
            "speed_error=5%,speed_bias=10%,pose_noise=5deg,pose_bias=1.5deg,position=0.3mm,drift=1mm/1deg",
            "none",
            "none,timer=1ms",
            "missed=1%/2%/0%",
        ] {
            assert_eq!(read(text).to_string(), text);
        }
        let mut random = crate::random::generator(1, crate::random::Purpose::Noise, "text", 0);
        for _ in 0..200 {
            use rand::RngExt;
            let mut number = || random.random::<f64>();
            let noise = Noise {
                deviation: Deviation { least: 100.0 * number(), largest: 100.0 + 9e3 * number() },
                timer: 1e4 * number(),
                debounce: number(),
                missed: [number(), number(), number()],
                bent: [-1e3 * number(), number(), 0.0],
                speed: 0.5 + number(),
                speed_error: 0.9 * number(),
                speed_bias: 0.9 * number(),
                pose: 180.0 * number(),
                pose_bias: number(),
                position: 1e4 * number(),
                drift: [1e3 * number(), number()],
                grazing: super::super::Grazing::default(),
            };
            let given = PartialNoise::from(noise);
            assert_eq!(read(&given.to_string()), given, "{given}");
        }
    }

    #[test]
    fn what_is_no_noise_is_refused_by_key_and_value_with_what_to_use() {
        for (text, expected) in [
            ("", "real is \"\"; use settings such as noise=0..5ms"),
            ("5ms", "real is \"5ms\"; use settings such as"),
            ("noise", "real is \"noise\"; use settings"),
            ("noise=5", "noise is \"5\"; use a duration with its unit such as 5ms, or a range such as 0..10ms"),
            ("noise=9..5ms", "noise is \"9..5ms\"; use a duration"),
            ("timer=", "timer is \"\"; use a duration such as 5ms"),
            ("timer=-1ms", "timer is \"-1ms\"; use a duration"),
            ("timer=1e999s", "timer is \"1e999s\"; use a duration"),
            ("jitter=5ms", "real is \"jitter=5ms\"; use one of noise, timer, debounce, missed, bent"),
            ("missed=few", "missed is \"few\"; use a share such as 2% or 0.02"),
            ("missed=200%", "missed is \"200%\"; use a share from 0 to 1"),
            ("missed=1%/2%", "missed is \"1%/2%\"; use one value for all fingers, or one for each"),
            ("missed=1%/2%/3%/4%", "missed is \"1%/2%/3%/4%\"; use one value"),
            ("bent=1:3ms", "bent is \"1:3ms\"; use a duration"),
            ("speed_factor=0", "speed_factor is \"0\"; use a number greater than 0"),
            ("speed_factor=nan", "speed_factor is \"nan\"; use a number greater than 0"),
            ("speed_error=95%", "speed_error is \"95%\"; use a share from 0 to 0.9"),
            ("pose_noise=5", "pose_noise is \"5\"; use an angle such as 5deg"),
            ("position=1", "position is \"1\"; use a length such as 1mm"),
            ("drift=1mm", "drift is \"1mm\"; use a length and an angle such as 1mm/1deg"),
            ("position=-1mm", "position is \"-1mm\"; use a length"),
            ("pose_bias=181deg", "pose_bias is \"181deg\"; use degrees from 0 to 180"),
            ("timer=1ms,timer=2ms", "timer is \"2ms\"; use each key once"),
            ("timer=1ms,none", "real is \"none\"; use settings"),
            ("timer=1ms,", "real is \"\"; use settings"),
            ("noise=5ms\u{0}", "noise is \"5ms\\0\"; use a duration"),
        ] {
            let error = text.parse::<PartialNoise>().unwrap_err().to_string();
            assert!(error.starts_with(expected), "{text}: {error}");
        }
        // Hostile lengths end at once.
        assert!("noise=5ms,".repeat(1_000).parse::<PartialNoise>().is_err());
        assert!("=".repeat(100_000).parse::<PartialNoise>().is_err());
    }
}
