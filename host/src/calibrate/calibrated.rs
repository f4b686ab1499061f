//! A calibrated model: its thresholds and its promise, from those that were chosen.

use super::choose::Chosen;
use super::found::Found;
use super::terms::Terms;
use super::{Per, Tally, binomial_tail};
use crate::compile::{Restated, restate};
use crate::error::Result;
use crate::evidence::{Odds, margin_of};
use palpate_onboard::Model;
use palpate_shared::format::{OddsByObject, Promise, PromisedNoise, Tag};
use serde::Serialize;
use std::collections::BTreeMap;

/// The share of rows that a table or weights must save to be kept.
const SAVED: f64 = 0.05;

/// Facts about a promise that was tested on recordings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OfRecorded {
    /// Approaches that were recorded to the object with the fewest.
    pub approaches: usize,
    /// Recordings that the sequences are of, where the data set lists any: sequences of one are not independent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recordings: Option<usize>,
    /// Share of wrong names on simulated sequences at the thresholds that were kept.
    pub simulated_error: f64,
}

/// A calibrated model, and what its calibration found.
#[derive(Clone, Debug, Serialize)]
pub struct Calibrated {
    /// Bytes of the model, as the chip reads them.
    #[serde(skip)]
    pub model: Vec<u8>,
    /// Its promise.
    #[serde(skip)]
    pub promise: Promise,
    /// Its thresholds.
    #[serde(skip)]
    pub odds: Odds,
    /// The promised error rate.
    pub promised: f64,
    /// Cases that the promise covers: "average", "name" or "object".
    pub per: &'static str,
    /// The probability that it is kept.
    pub confidence: f64,
    /// Unit of the counts: "touches", "approaches" or "rows".
    #[serde(skip_serializing_if = "is_rows")]
    pub counted: &'static str,
    /// Sequences that the promise rests on.
    pub sequences: usize,
    /// Groups that the promise rests on, and is for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groups: Option<usize>,
    /// Sequences of rows that were learned from, which the promise does not rest on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learned: Option<usize>,
    /// Share of the names given in these that were wrong.
    pub error: f64,
    /// Share of these that ended without a name: undecided, or unknown to the model's test.
    pub undecided: f64,
    /// Steps used on average, also where no name was given.
    #[serde(flatten)]
    pub used: Used,
    /// Margin at which an uncalibrated recognizer stops at this rate: nats of evidence ahead of all other objects.
    pub uncalibrated_margin: f64,
    /// Margin at which this one stops, for each name.
    pub margins: BTreeMap<String, f64>,
    /// For each name, or object, that the rate is promised for: the share that was wrong. Empty for an average.
    pub errors: BTreeMap<String, f64>,
    /// Each object, regardless of what the rate is promised of.
    pub objects: BTreeMap<String, OfObject>,
    /// Divisor of the evidence before it is shown as a posterior; none for rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<f64>,
    /// Facts about recordings, if the thresholds were tested on some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded: Option<OfRecorded>,
    /// The shape of evidence of rows.
    #[serde(flatten)]
    pub rows: Option<OfRows>,
    /// Rows that a guard refuses, if the model has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guard: Option<Guarded>,
    /// The test for what the model does not know.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strangers: Option<Found>,
    /// Doubts about the sequences, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Results on rows have no unit in JSON: their keys name it.
fn is_rows(counted: &&'static str) -> bool {
    *counted == "rows"
}

/// Steps that sequences used on average.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Used {
    /// Touches.
    Touches {
        /// Touches that were evidence.
        mean_touches: f64,
        /// Approaches, where the data set holds those.
        #[serde(skip_serializing_if = "Option::is_none")]
        mean_approaches: Option<f64>,
    },
    /// Rows.
    Rows {
        /// Rows.
        mean_rows: f64,
        /// The limit of rows.
        max_rows: u32,
    },
}

impl Used {
    /// Mean number of approaches where the data set holds those, otherwise of touches; or of rows.
    pub fn mean(&self) -> f64 {
        match *self {
            Self::Touches { mean_touches, mean_approaches } => mean_approaches.unwrap_or(mean_touches),
            Self::Rows { mean_rows, .. } => mean_rows,
        }
    }
}

/// The shape of evidence of rows, as a calibration found it.
#[derive(Clone, Debug, Serialize)]
pub struct OfRows {
    /// Gain of a table from margins to evidence; `None` where there are too few sequences to know.
    pub row_evidence: Option<Gain>,
    /// Gain of weights of evidence by the number of rows; likewise.
    pub weights: Option<Gain>,
    /// The weights that are kept: of 1, 2, 4, 8 and so on rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights_by_doubling: Option<Vec<f64>>,
}

/// Effect of a guard on the sequences that it was not learned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Guarded {
    /// Their rows.
    pub rows: usize,
    /// Rows of these that it refuses.
    pub refused: usize,
}

/// Rows that a part of the shape saves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// True if it is kept.
    pub kept: bool,
    /// The rows to a verdict without it, at the promised error rate on sequences that it was not fitted to; `None` if no
    /// threshold that a model can store keeps the rate.
    pub rows_without: Option<f64>,
    /// Rows with it.
    pub rows_with: Option<f64>,
}

impl Gain {
    pub(crate) fn new(without: Option<f64>, with: Option<f64>) -> Self {
        let kept = match (without, with) {
            (Some(without), Some(with)) => with <= (1.0 - SAVED) * without,
            (None, Some(_)) => true,
            _ => false,
        };
        Self { kept, rows_without: without, rows_with: with }
    }
}

/// Figures of an object under the thresholds, in the sequences that the promise rests on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct OfObject {
    /// Names given to it, right or wrong.
    pub given: u64,
    /// Wrong ones among them.
    pub wrong: u64,
    /// Times that its name was given, to whatever object.
    pub named: u64,
    /// Wrong ones among them.
    pub named_wrongly: u64,
}

/// An object whose names are wrong more often than all names together may be, which their average does not show.
#[derive(Clone, Debug, PartialEq)]
pub struct Worse {
    /// The object.
    pub object: String,
    /// The share of wrong ones among the names given to it, if that is above the rate.
    pub given: Option<f64>,
    /// The share of wrong ones among the times that its name was given, if that is above the rate.
    pub named: Option<f64>,
}

/// Optional sections of a model: whether a reader must know one, and its content; none to leave it out.
type Sections = Vec<(Tag, Option<(bool, Vec<u8>)>)>;

/// Statements of a promise beside its terms.
pub(crate) struct Stated {
    pub(crate) approaches: bool,
    pub(crate) active: bool,
    pub(crate) groups: bool,
    pub(crate) max_touches: u32,
    pub(crate) noise: PromisedNoise,
}

impl Chosen {
    /// The promise as a model states it.
    pub(crate) fn promise(&self, terms: &Terms, stated: Stated) -> Promise {
        let Terms { rate, confidence, per } = *terms;
        let Stated { approaches, active, groups, max_touches, noise } = stated;
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let mean = if approaches { self.mean_approaches } else { self.mean_touches };
        Promise {
            rate,
            confidence,
            per,
            approaches,
            active,
            groups,
            sequences: count(self.sequences),
            given: count(self.given),
            wrong: count(self.wrong),
            mean_thousandths: (1e3 * mean).round() as u32,
            max_touches,
            noise,
        }
    }
}

impl Calibrated {
    /// The model with thresholds that were chosen, a promise, and further sections.
    pub(crate) fn new(
        model: &Model<'_>,
        names: &[String],
        chosen: &Chosen,
        terms: &Terms,
        stated: Stated,
        further: Sections,
    ) -> Result<Self> {
        let Terms { rate, confidence, per } = *terms;
        let promise = chosen.promise(terms, stated);
        let (approaches, max_touches) = (promise.approaches, promise.max_touches);
        let (mean_touches, mean_approaches) = (chosen.mean_touches, approaches.then_some(chosen.mean_approaches));
        let used = Used::Touches { mean_touches, mean_approaches };
        let by_object = match &chosen.odds {
            Odds::All(_) => None,
            Odds::ByObject(odds) => {
                // A background, which is never named, has a place too.
                let all = odds.iter().copied().chain(std::iter::repeat(0)).take(model.object_count());
                Some((true, all.flat_map(OddsByObject::to_bytes).collect()))
            }
        };
        let mut sections =
            vec![(Tag::ThresholdsByObject, by_object), (Tag::Promise, Some((false, promise.write(<[u8]>::to_vec))))];
        sections.extend(further);
        let odds = Some(chosen.odds.strictest());
        let restated = Restated { odds, max_touches: Some(max_touches), sections, ..Restated::default() };
        let share = |tally: &Tally| tally.wrong as f64 / tally.all.max(1) as f64;
        let is_each = per != Per::Average;
        let margin = |(object, name): (usize, &String)| (name.clone(), margin_of(chosen.odds.of(object)));
        let of_object = |(name, (touched, named)): (&String, (&Tally, &Tally))| {
            let (given, wrong, named_wrongly, named) = (touched.all, touched.wrong, named.wrong, named.all);
            (name.clone(), OfObject { given, wrong, named, named_wrongly })
        };
        Ok(Self {
            model: restate(model, &restated)?,
            promise,
            odds: chosen.odds.clone(),
            promised: rate,
            per: per.name(),
            confidence,
            counted: if approaches { "approaches" } else { "touches" },
            sequences: chosen.sequences,
            groups: None,
            learned: None,
            error: chosen.wrong as f64 / chosen.given.max(1) as f64,
            undecided: 1.0 - chosen.given as f64 / chosen.sequences.max(1) as f64,
            used,
            uncalibrated_margin: terms.margin(),
            margins: names.iter().enumerate().map(margin).collect(),
            errors: names.iter().cloned().zip(chosen.tallies.iter().map(share)).filter(|_| is_each).collect(),
            objects: names.iter().zip(chosen.touched.iter().zip(&chosen.named)).map(of_object).collect(),
            temperature: None,
            recorded: None,
            rows: None,
            guard: None,
            strangers: None,
            note: None,
        })
    }

    /// The objects whose names are wrong more often than promised, though the promise is kept: one that is undecided
    /// mostly has few names in an average. Shares that may be above the rate by chance (a binomial test at 1 %) are left
    /// out.
    pub fn worse(&self) -> Vec<Worse> {
        worse(&self.objects, self.promised)
    }

    /// True if an object is mostly undecided, and so has few names in an average.
    pub fn has_hidden(&self) -> bool {
        let least = self.sequences as u64 / self.objects.len().max(1) as u64;
        self.objects.values().any(|of| 2 * of.given < least)
    }
}

pub(super) fn worse(objects: &BTreeMap<String, OfObject>, rate: f64) -> Vec<Worse> {
    let above = |wrong: u64, all: u64| {
        let below = wrong.checked_sub(1).map_or(0.0, |wrong| binomial_tail(Tally { wrong, all }, rate));
        (all > 0 && below >= 0.99).then(|| wrong as f64 / all as f64)
    };
    let worse = objects.iter().map(|(object, of)| Worse {
        object: object.clone(),
        given: above(of.wrong, of.given),
        named: above(of.named_wrongly, of.named),
    });
    worse.filter(|worse| worse.given.is_some() || worse.named.is_some()).collect()
}
