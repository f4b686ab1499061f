//! Part of the samples of each object.

use crate::error::{Error, Result, problem};
use std::ops::Range;

/// Samples of each object, from one up to another that does not belong to them: a part that one of several machines captures.
/// The parts' files one after the other are the whole's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Samples {
    /// The first one, counted from 0.
    pub first: u64,
    /// The one after the last.
    pub end: u64,
}

impl From<Samples> for Range<u64> {
    fn from(Samples { first, end }: Samples) -> Self {
        first..end
    }
}

impl std::fmt::Display for Samples {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}..{}", self.first, self.end)
    }
}

impl std::str::FromStr for Samples {
    type Err = Error;

    /// Reads `A..B`.
    fn from_str(text: &str) -> Result<Self> {
        let ends = text.split_once("..").and_then(|(first, end)| Some((first.parse().ok()?, end.parse().ok()?)));
        match ends {
            Some((first, end)) if first < end => Ok(Self { first, end }),
            _ => Err(problem!("{text:?} is not a range of samples")
                .fix("Give A..B with A below B: 0..5000 are the first 5000.")),
        }
    }
}

impl From<Samples> for String {
    fn from(samples: Samples) -> Self {
        samples.to_string()
    }
}

impl TryFrom<String> for Samples {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_read_as_they_are_written_and_wrong_ones_refused() {
        assert_eq!("20..51".parse::<Samples>().unwrap(), Samples { first: 20, end: 51 });
        assert_eq!(Samples { first: 0, end: u64::MAX }.to_string().parse::<Samples>().unwrap().end, u64::MAX);
        for wrong in ["", "5..5", "6..5", "1", "..5", "1..", "-1..2", "a..b", "1..2..3", "1..=2"] {
            let error = wrong.parse::<Samples>().unwrap_err().to_string();
            assert!(error.contains("is not a range of samples"), "{error}");
        }
    }
}
