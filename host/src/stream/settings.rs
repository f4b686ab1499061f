//! Settings of a promise on sequences of rows.

#[cfg(feature = "train")]
use super::{Rows, taken};
use crate::calibrate::{Per, Terms};
use crate::error::{Error, Result};
#[cfg(feature = "train")]
use crate::strangers;
#[cfg(feature = "train")]
use palpate_onboard::Model;
#[cfg(feature = "train")]
use palpate_trees::rows::{RowSequence, Sequences};

/// Settings of a promise.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// The error rate: wrong names of those that are given.
    pub rate: f64,
    /// Cases for which the rate is promised.
    pub per: Per,
    /// The probability that the rate is kept.
    pub confidence: f64,
    /// The most sequences that are used.
    pub sequences: usize,
    /// Rows after which a sequence ends undecided; `None` takes the model's own limit.
    pub max_rows: Option<u32>,
    /// True for a guard against dead sensors, learned with the shape of evidence: a row that it refuses adds nothing.
    pub guard: bool,
    /// A test for what the model does not know, if one is wanted.
    #[cfg(feature = "train")]
    pub strangers: Option<StrangerTest>,
    /// Seed of which sequences are learned from.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rate: 0.01,
            per: Per::Average,
            confidence: 0.95,
            sequences: 1_000_000,
            max_rows: None,
            guard: false,
            #[cfg(feature = "train")]
            strangers: None,
            seed: 1,
        }
    }
}

impl Settings {
    /// The terms of the promise.
    pub(super) fn terms(&self) -> Terms {
        Terms { rate: self.rate, confidence: self.confidence, per: self.per }
    }

    /// Refuses settings out of their ranges.
    pub(super) fn check(&self) -> Result<()> {
        self.terms().check()?;
        if self.sequences == 0 {
            return Err(Error::setting("sequences", self.sequences, "at least 1"));
        }
        check_rows(self.max_rows)
    }
}

/// Refuses a limit of no rows.
pub(super) fn check_rows(max_rows: Option<u32>) -> Result<()> {
    if max_rows == Some(0) { Err(Error::setting("max_rows", 0, "at least 1")) } else { Ok(()) }
}

/// A test for what the model does not know.
#[cfg(feature = "train")]
#[derive(Clone, Debug, PartialEq)]
pub struct StrangerTest {
    /// Its settings.
    pub settings: strangers::Settings,
    /// The margins of rows of others, a list for each sequence of them, in the model's units; there may be none.
    pub background: Vec<Vec<i32>>,
}

#[cfg(feature = "train")]
impl StrangerTest {
    /// A test with a background of these sequences, whose classes do not matter.
    ///
    /// # Errors
    /// For a model without classes of rows, and for rows of another number of features.
    pub fn new(settings: strangers::Settings, model: &Model<'_>, others: Option<&Sequences>) -> Result<Self> {
        let Some(others) = others else { return Ok(Self { settings, background: Vec::new() }) };
        let others = taken(model, others)?;
        let rows = Rows::new(model, &others);
        let of = |sequence: &RowSequence| sequence.rows.clone().flat_map(|row| rows.row(row)).copied().collect();
        Ok(Self { settings, background: others.sequences.iter().map(of).collect() })
    }
}
