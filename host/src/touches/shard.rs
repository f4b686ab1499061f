//! One of several equal parts of the samples of a data set.

use crate::error::TouchesProblem;
use std::ops::Range;

/// One of several equal parts of the samples of each object. The parts, one after the other, are the whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Shard {
    number: u64,
    of: u64,
}

impl Shard {
    /// All samples.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Range of `samples` samples that belongs to the part.
    pub(crate) fn part(self, samples: u64) -> Range<u64> {
        let before = |number: u64| u64::try_from(u128::from(samples) * u128::from(number) / u128::from(self.of));
        // At most `samples`, so the conversion cannot fail.
        before(self.number - 1).unwrap_or(samples)..before(self.number).unwrap_or(samples)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}/{}", self.number, self.of)
    }
}

impl std::str::FromStr for Shard {
    type Err = TouchesProblem;

    /// Reads `K/N`: the K-th of N parts, counted from 1.
    fn from_str(text: &str) -> Result<Self, TouchesProblem> {
        let parts = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((number, of)) if 1 <= number && number <= of => Ok(Self { number, of }),
            _ => Err(TouchesProblem::BadShard { text: text.into() }),
        }
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

impl TryFrom<String> for Shard {
    type Error = TouchesProblem;

    fn try_from(text: String) -> Result<Self, TouchesProblem> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_read_as_they_are_written_and_wrong_ones_refused() {
        assert_eq!("2/5".parse::<Shard>().unwrap().to_string(), "2/5");
        assert_eq!("5/5".parse::<Shard>().unwrap().part(u64::MAX).end, u64::MAX);
        for wrong in ["", "0/5", "6/5", "1", "1/0", "-1/2", "a/b", "1/2/3"] {
            assert_eq!(wrong.parse::<Shard>(), Err(TouchesProblem::BadShard { text: wrong.into() }));
        }
    }

    #[test]
    fn the_parts_one_after_the_other_are_the_whole() {
        let mut next = 0;
        for number in 1..=7 {
            let part = Shard { number, of: 7 }.part(1000);
            assert_eq!(part.start, next);
            next = part.end;
        }
        assert_eq!(next, 1000);
    }
}
