//! Settings of noise as users write them in one text: `noise=0..5ms,timer=1ms,missed=2%`.

use super::table::{ROWS, Row};
use super::{Noise, quantity};
use crate::error::{Error, Kind, Result, problem};
use std::str::FromStr;

/// Some settings of [`Noise`], as one text of `key=value` with commas between them; the others are left open.
///
/// The keys are those of `[real]` in a probe file, except `bent`, which a file states as lengths, and `drift`, which it does
/// not state. Fingers that bend aside have no key: only a capture adds that, from a probe file. `missed` and `bent` also
/// take a value for each finger, such as `bent=3ms/0ms/-1ms`; `bent` says how much earlier a finger touches. `none`, which
/// comes first, sets everything to nothing. [`Noise::settings`] writes such a text.
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
#[derive(Clone, Debug, Default)]
pub struct PartialNoise {
    /// True if the text starts with `none`: then it leaves nothing open.
    starts_with_none: bool,
    given: Vec<(&'static Row, Vec<f64>)>,
}

/// The keys of all settings, in the order in which they are written.
pub fn keys() -> Vec<&'static str> {
    ROWS.iter().map(|row| row.key).collect()
}

impl Noise {
    /// Takes the setting of a key from a text. Its range is left to [`check`](Self::check).
    ///
    /// # Errors
    /// If there is no such key, or its values are written in another way.
    pub fn set(&mut self, key: &str, text: &str) -> Result<()> {
        let row = Row::of_key(key).ok_or_else(|| wrong("key", key, &format!("one of {}", keys().join(", "))))?;
        let numbers = row.read(text).map_err(|example| quantity::not_such(text, example))?;
        row.set(self, &numbers);
        Ok(())
    }

    /// The settings that add something as one text, from which [`PartialNoise`] reads the same numbers to the last bit; `none`
    /// if nothing does. Fingers that bend aside are not among them.
    pub fn settings(&self) -> String {
        let there = ROWS.iter().filter(|row| row.adds_to(self));
        let parts: Vec<String> = there.map(|row| format!("{}={}", row.key, row.written(&row.of(self)))).collect();
        if parts.is_empty() { "none".into() } else { parts.join(",") }
    }
}

impl PartialNoise {
    /// The settings that are given, and `base` where they are open.
    #[must_use]
    pub fn over(&self, base: Noise) -> Noise {
        let mut noise = if self.starts_with_none { Noise::default() } else { base };
        self.given.iter().for_each(|(row, numbers)| row.set(&mut noise, numbers));
        noise
    }
}

/// The value of a key cannot be used; the key is `real` where a part of the text has none that is known.
fn wrong(key: &'static str, value: &str, wanted: &str) -> Error {
    let (value, allowed) = (value.to_owned(), wanted.to_owned());
    problem!("{key} is {value:?}; use {wanted}").as_kind(Kind::Setting { name: key, value, allowed })
}

impl FromStr for PartialNoise {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut noise = Self::default();
        for (index, part) in text.split(',').enumerate() {
            if index == 0 && part.trim() == "none" {
                noise.starts_with_none = true;
                continue;
            }
            let whole = |wanted: &str| wrong("real", part.trim(), wanted);
            let (key, value) = part
                .split_once('=')
                .ok_or_else(|| whole("settings such as noise=0..5ms,timer=1ms,missed=2%, or none"))?;
            let row = Row::of_key(&key.trim().replace('-', "_"));
            let row = row.ok_or_else(|| whole(&format!("one of {}", keys().join(", "))))?;
            let bad = |wanted: &str| wrong(row.key, value.trim(), wanted);
            if noise.given.iter().any(|(earlier, _)| earlier.key == row.key) {
                return Err(wrong(row.key, value, "each key once"));
            }
            let numbers = row.read(value.trim()).map_err(bad)?;
            if let Some((_, allowed)) = row.wrong(&numbers) {
                return Err(bad(allowed));
            }
            noise.given.push((row, numbers));
        }
        Ok(noise)
    }
}
