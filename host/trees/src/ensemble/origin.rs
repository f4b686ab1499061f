//! Provenance of an ensemble, if it is known.

use super::nodes::Threshold;
use palpate_shared::format::Prediction;
use std::collections::BTreeMap;

/// Statements of an ensemble about its training. Empty for ensembles from elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// The last object is a background: many other shapes, which stand for everything that the ensemble does not know.
    /// It is a rival of the others, and never named.
    pub background: bool,
    /// The file of another library that it was read from, if it was.
    pub imported: Option<Imported>,
    /// Further statements of whoever trained it, by name: attributes of the file that this crate does not read, kept as they
    /// are.
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
    /// Rule that turns margins into the probabilities that the library predicts.
    pub probability: Probability,
    /// The least and the largest of the numbers that stand for a missing value, beside NaN.
    pub sentinel: Option<[f32; 2]>,
    /// For each node of each tree the threshold as the file has it, of no meaning for leaves; empty where all are the
    /// ensemble's own.
    pub thresholds: Vec<Vec<Threshold>>,
    /// Columns of the library's rows, where there are more than a model can have features: the ensemble has only those that
    /// its trees use.
    pub columns: Option<Columns>,
    /// Categories of columns of the library's rows, by the numbers that stand for them, where the file has them.
    pub categories: BTreeMap<usize, Vec<String>>,
    /// True if the library compares values in f64. One that rounds rows to f32 first goes the same way as a model does.
    pub compares_f64: bool,
    /// A regression's numbers as the library adds them in f64; none where it adds f32.
    pub exact: Option<Exact>,
}

/// Numbers that a library adds in f64, before the [scale](Prediction::scale).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exact {
    /// Starting values of the margins.
    pub base: Vec<f64>,
    /// For each node of each tree the values of a leaf; none of a split.
    pub leaves: Vec<Vec<Vec<f64>>>,
}

/// Rule that turns the margins of classes into the probabilities that a library predicts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Probability {
    /// The softmax of the margins.
    #[default]
    Softmax,
    /// The logistic function of each margin: each class was trained against all others.
    Logistic,
    /// The margins themselves: shares of votes.
    Shares,
    /// None that margins alone determine.
    Unknown,
}

impl Probability {
    /// True for a softmax.
    pub(super) fn is_softmax(&self) -> bool {
        *self == Self::Softmax
    }

    /// Probabilities from a row's margins, in nats or as shares of votes; `None` where there is no rule.
    pub fn of(self, margins: &[f64]) -> Option<Vec<f64>> {
        let most = margins.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let all: f64 = margins.iter().map(|margin| (margin - most).exp()).sum();
        let each = |margin: &f64| match self {
            Self::Softmax => (margin - most).exp() / all,
            Self::Logistic => 1.0 / (1.0 + (-margin).exp()),
            // Shares of the votes; rounded leaves need not add up to 1, here or on a chip.
            Self::Shares | Self::Unknown => *margin,
        };
        (self != Self::Unknown).then(|| margins.iter().map(each).collect())
    }
}

/// Columns of a library's rows, and those that an ensemble has as its features.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Columns {
    /// The names of all columns; those that have none of their own are f0, f1 and so on.
    pub names: Vec<String>,
    /// The column of each feature.
    pub used: Vec<usize>,
}
