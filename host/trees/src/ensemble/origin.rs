//! Origin of an ensemble, as far as it is known.

use super::nodes::Threshold;
use palpate_shared::format::{Counted, PatternShares, Prediction, TrainedTouches};
use palpate_shared::{ContactPattern, Patterns};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Statements of an ensemble about its training. Empty for ensembles from elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// Kind of touches it was trained on, and so which ones are evidence; of no meaning over rows.
    pub trained: Option<Trained>,
    /// The last object is a background: many other shapes, which stand for everything that the ensemble does not know.
    /// It is a rival of the others, and never named.
    pub background: bool,
    /// The file of another library that it was read from, if it was.
    pub imported: Option<Imported>,
    /// Further statements of whoever trained it, by name: attributes of the file that this crate does not read, kept as they
    /// are. The crate `palpate` states the probe and the touches so.
    pub attributes: BTreeMap<String, String>,
}

/// Facts about an ensemble that another library trained.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// The library and the kind of file, such as "LightGBM text".
    pub kind: String,
    /// The farthest that a margin can be from the library's own, since leaves and sums are f32 here and f64 there; 0
    /// where the library adds the same f32 values in the same order.
    pub rounding: f64,
    /// Notes for the user, each a sentence.
    pub notes: Vec<String>,
    /// Rule that turns margins into a class or a value, as the library's `predict` does it. Its scale makes the
    /// library's margins of what the trees add up to.
    pub prediction: Prediction,
    /// The least and the largest of the numbers that stand for a missing value, beside NaN.
    pub sentinel: Option<[f32; 2]>,
    /// For each node of each tree the threshold as the file has it, of no meaning for leaves; empty where all are the
    /// ensemble's own.
    pub thresholds: Vec<Vec<Threshold>>,
    /// Columns of the library's rows, where there are more than a model can have features: the ensemble has only those that
    /// its trees use.
    pub columns: Option<Columns>,
}

/// Columns of a library's rows, and those that an ensemble has as its features.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Columns {
    /// The names of all columns; those that have none of their own are f0, f1 and so on.
    pub names: Vec<String>,
    /// The column of each feature.
    pub used: Vec<usize>,
}

/// The touches that an ensemble was trained on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stated", into = "Stated")]
pub struct Trained {
    /// Patterns, the largest spread, and whether a pose is needed: what is evidence to every model made of the ensemble.
    pub touches: TrainedTouches,
    /// The share of each contact pattern among all approaches, in the order of the patterns' codes, each object weighted
    /// equally; `None` if the data set holds no approaches.
    pub shares: Option<[f64; 6]>,
}

impl Trained {
    /// Statement of the chip's model about [`Trained::shares`].
    pub fn pattern_shares(&self) -> Option<PatternShares> {
        // `as` saturates.
        self.shares.map(|shares| PatternShares(shares.map(|share| (share * 65_535.0).round() as u16)))
    }
}

/// [`Trained`] in files.
#[derive(Serialize, Deserialize)]
struct Stated {
    counted: String,
    patterns: Vec<String>,
    needs_pose: bool,
    largest_spread: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shares: Option<[f64; 6]>,
}

impl From<Trained> for Stated {
    fn from(Trained { touches, shares }: Trained) -> Self {
        Self {
            counted: touches.counted.name().into(),
            patterns: touches.patterns.iter().map(|pattern| pattern.name().into()).collect(),
            needs_pose: touches.needs_pose,
            largest_spread: touches.largest_spread,
            shares,
        }
    }
}

impl TryFrom<Stated> for Trained {
    type Error = String;

    fn try_from(stated: Stated) -> Result<Self, String> {
        let counted = Counted::ALL.iter().copied().find(|counted| counted.name() == stated.counted);
        let counted = counted.ok_or_else(|| format!("{:?} is not full, contacts or all", stated.counted))?;
        let pattern = |name: &String| {
            let pattern = ContactPattern::ALL.into_iter().find(|pattern| pattern.name() == name);
            pattern.filter(|pattern| counted.patterns().contains(*pattern)).ok_or_else(|| format!("pattern {name:?}"))
        };
        let patterns = stated.patterns.iter().map(pattern).collect::<Result<Patterns, _>>()?;
        if patterns.is_empty() {
            return Err("no pattern".into());
        }
        if let Some(share) = stated.shares.into_iter().flatten().find(|share| !(0.0..=1.0).contains(share)) {
            return Err(format!("the share {share}"));
        }
        let Stated { needs_pose, largest_spread, shares, .. } = stated;
        Ok(Self { touches: TrainedTouches { patterns, counted, needs_pose, largest_spread }, shares })
    }
}
