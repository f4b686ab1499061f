//! Meaning of margins under XGBoost's objectives.

use crate::ensemble::import::options::unknown_objective;
use crate::error::Result;
use palpate_shared::format::Link as Inverse;

/// An objective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Objective {
    pub(super) kind: Kind,
    pub(super) link: Link,
    /// Function that turns a margin into a prediction.
    pub(super) inverse: Inverse,
}

/// Kind of the outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A margin for each class.
    Classes,
    /// A margin for the second class of two; that of the first is 0.
    Binary,
    /// One number: a regression or a ranking.
    One,
}

/// Function that turns the base score, which is in the space of predictions, into a margin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Link {
    Identity,
    Logit,
    Log,
}

impl Objective {
    /// The objective with XGBoost's name.
    pub(super) fn named(name: &str) -> Result<Self> {
        let (kind, link) = match name {
            "multi:softprob" | "multi:softmax" => (Kind::Classes, Link::Identity),
            "binary:logistic" => (Kind::Binary, Link::Logit),
            "binary:logitraw" | "binary:hinge" => (Kind::Binary, Link::Identity),
            "reg:logistic" => (Kind::One, Link::Logit),
            "count:poisson" | "reg:gamma" | "reg:tweedie" | "survival:cox" | "survival:aft" => (Kind::One, Link::Log),
            "reg:squarederror"
            | "reg:linear"
            | "reg:squaredlogerror"
            | "reg:pseudohubererror"
            | "reg:absoluteerror"
            | "reg:quantileerror"
            | "reg:expectileerror"
            | "rank:pairwise"
            | "rank:ndcg"
            | "rank:map" => (Kind::One, Link::Identity),
            _ => return Err(unknown_objective(name, None)),
        };
        let inverse = match (kind, link) {
            (Kind::One, Link::Logit) => Inverse::Logistic,
            (Kind::One, Link::Log) => Inverse::Exponential,
            _ => Inverse::Identity,
        };
        Ok(Self { kind, link, inverse })
    }
}

/// The least probability of a base score.
const LEAST: f32 = 1e-6;

impl Link {
    /// The margin of a base score, in f32 as XGBoost computes it. C libraries' logarithms of f32 are the nearest f32
    /// nearly always; that of an f64, rounded, is always.
    pub(super) fn margin(self, base_score: f32) -> f32 {
        let ln = |value: f32| f64::from(value).ln() as f32;
        match self {
            Self::Identity => base_score,
            // XGBoost keeps probabilities this far from 0 and 1: of a class that all labels have.
            Self::Logit => -ln(1.0 / base_score.clamp(LEAST, 1.0 - LEAST) - 1.0),
            Self::Log => ln(base_score),
        }
    }
}
