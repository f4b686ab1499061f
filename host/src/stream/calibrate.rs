//! A model's shape, thresholds and promise, from sequences of rows.

use super::copies::copies;
use super::parts::Parts;
use super::settings::Settings;
use super::shape::{self, Fitted, Gain, STRICTEST};
use super::{Rows, check, follow};
use crate::calibrate::{
    Begin, Chosen, Grouped, Odds, OfObject, Per, Sequence, Stop, Tally, Terms, Until, Way, Worse, choose_groups,
    choose_independent, margin_of, share_tested, worse,
};
use crate::compile::{self, Restated, restate};
use crate::error::{CalibrateProblem, Result};
use crate::progress::Progress;
#[cfg(feature = "train")]
use crate::strangers;
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::{OddsByObject, Promise, PromisedNoise, Tag};
use palpate_trees::rows::{RowSequence, Sequences};
use serde::Serialize;
use std::collections::BTreeMap;

/// A calibrated model, and what its calibration found.
#[derive(Clone, Debug, Serialize)]
pub struct Calibrated {
    /// Bytes of the model, as the chip reads them.
    #[serde(skip)]
    pub model: Vec<u8>,
    /// Its promise.
    #[serde(skip)]
    pub promise: Promise,
    /// The promised error rate.
    pub promised: f64,
    /// Of what: "average", "name" or "object".
    pub per: &'static str,
    /// The probability that it is kept.
    pub confidence: f64,
    /// Sequences that the promise rests on.
    pub sequences: usize,
    /// Groups that the promise rests on, and is for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groups: Option<usize>,
    /// Sequences that were learned from, which the promise does not rest on.
    pub learned: usize,
    /// Share of the names given that were wrong.
    pub error: f64,
    /// Share of the sequences that ended without a name.
    pub undecided: f64,
    /// Rows used on average, also where no name was given.
    pub mean_rows: f64,
    /// The limit of rows.
    pub max_rows: u32,
    /// Where an uncalibrated recognizer stops at this rate: nats of evidence ahead of all other classes.
    pub uncalibrated_margin: f64,
    /// Where this one stops, in weighed evidence: for each name.
    pub margins: BTreeMap<String, f64>,
    /// For each name, or class, that the rate is promised for: the share that was wrong. Empty for an average.
    pub errors: BTreeMap<String, f64>,
    /// Each class, whatever the rate is promised of.
    pub objects: BTreeMap<String, OfObject>,
    /// Gain of a table from margins to evidence; `None` where there are too few sequences to know.
    pub row_evidence: Option<Gain>,
    /// Gain of weights of evidence by the number of rows; likewise.
    pub weights: Option<Gain>,
    /// The weights that are kept: of 1, 2, 4, 8 and so on rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights_by_doubling: Option<Vec<f64>>,
    /// The test for what the model does not know.
    #[cfg(feature = "train")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strangers: Option<strangers::Found>,
    /// Doubts about the sequences, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

impl Calibrated {
    /// The classes whose names are wrong more often than promised, though the promise is kept; see
    /// [`calibrate::Calibrated::worse`](crate::calibrate::Calibrated::worse).
    pub fn worse(&self) -> Vec<Worse> {
        worse(&self.objects, self.promised)
    }
}

/// Sets a model's thresholds so that it keeps a promised error rate and uses it up, on sequences of rows that nothing was
/// trained on; also what a row adds to the evidence, and how much rows count together, where that saves rows. Sequences of a
/// group are used together, and the promise is then for new groups; without groups they must be independent of each other.
///
/// # Errors
/// [`CalibrateProblem`], if no threshold keeps the promise, too few names are given to know, or there are too few sequences;
/// [`RowsProblem`](crate::error::RowsProblem) for a model without classes of rows; [`Setting`](crate::error::Setting) for
/// settings out of their ranges.
pub fn calibrate(
    model: &Model<'_>,
    sequences: &Sequences,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    progress.begin("computing margins", None);
    let rows = Rows::new(model, sequences)?;
    progress.begin("calibrating", None);
    let calibrated = calibrate_margins(model, &rows, &sequences.sequences, settings)?;
    let (copies, all) = (copies(sequences), sequences.sequences.len());
    let note = (copies > 0).then(|| {
        format!(
            "{copies} of {all} sequences are copies, value by value, of others under another id. Copies are not independent, so that \
             the promise may not hold: leave them out, or name what they come from as their group."
        )
    });
    Ok(Calibrated { note, ..calibrated })
}

/// The same of margins that were computed before.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_margins(
    model: &Model<'_>,
    rows: &Rows<'_>,
    sequences: &[RowSequence],
    settings: &Settings,
) -> Result<Calibrated> {
    check(model)?;
    settings.check()?;
    let max_rows = settings.max_rows.unwrap_or(Stopping::from_model(model).max_touches());
    compile::stopping(settings.rate, max_rows)?;
    let names = names(model);
    let missing = (0..names.len()).filter(|class| !sequences.iter().any(|sequence| sequence.class == *class));
    let missing: Vec<String> = missing.map(|class| names[class].clone()).collect();
    if !missing.is_empty() {
        return Err(CalibrateProblem::MissingSequences { objects: missing }.into());
    }
    let parts = Parts::new(sequences, settings)?;
    let fitted = shape::fit(rows, &parts.learned, settings.rate, max_rows);
    let shaped = shaped(model, &fitted, max_rows)?;
    let followed = Followed { rows, names: names.len(), terms: terms(settings), max_rows };
    let begin = begin(&compile::open(&shaped)?, rows, &parts, settings, max_rows);
    #[cfg(feature = "train")]
    if let Some(wanted) = &settings.strangers {
        // Names that the test holds back are wrong less often, which no looser threshold is to use up.
        let without = followed.choose(&compile::open(&shaped)?, &parts, &begin.starts, None).ok();
        let (shaped, parts, found) = super::background::test(&shaped, rows, parts, wanted, begin.loosest)?;
        let model = compile::open(&shaped)?;
        let loosest = without.as_ref().map(|without| &without.odds);
        let chosen = followed.choose(&model, &parts, &[begin.loosest], loosest);
        let chosen = chosen.map_err(|stop| parts.problem(stop, &names, settings, found.least_touches))?;
        let calibrated = finished(&model, &chosen, &parts, settings, max_rows, &fitted)?;
        return Ok(Calibrated { strangers: Some(found), ..calibrated });
    }
    let model = compile::open(&shaped)?;
    let chosen = followed.choose(&model, &parts, &begin.starts, None);
    let chosen = chosen.map_err(|stop| parts.problem(stop, &names, settings, 0))?;
    finished(&model, &chosen, &parts, settings, max_rows, &fitted)
}

/// Sequences to follow, and what is to be promised of them.
struct Followed<'f> {
    rows: &'f Rows<'f>,
    /// Number of names.
    names: usize,
    terms: Terms,
    max_rows: u32,
}

impl Followed<'_> {
    /// Thresholds from these starts on, margins in nats, that are no looser than others.
    fn choose(
        &self,
        model: &Model<'_>,
        parts: &Parts<'_>,
        starts: &[f64],
        loosest: Option<&Odds>,
    ) -> Result<Chosen, Stop> {
        let way = Way { starts, loosest };
        let margin = starts.first().copied().unwrap_or(STRICTEST);
        let until = Until { margin, max_touches: self.max_rows };
        let tested = follow(model, self.rows, &parts.tested, until);
        if !parts.has_groups {
            return choose_independent(&tested, self.names, &way, &self.terms);
        }
        let learned = follow(model, self.rows, &parts.learned, until);
        let [learned, tested] = [(&learned, &parts.learned), (&tested, &parts.tested)].map(grouped);
        choose_groups(&learned, &tested, self.names, &way, &self.terms)
    }
}

fn names(model: &Model<'_>) -> Vec<String> {
    let mut names = compile::names(model);
    names.truncate(model.known_count());
    names
}

fn grouped<'s>((followed, of): (&'s Vec<Sequence>, &Vec<&RowSequence>)) -> Vec<Grouped<'s>> {
    let group = |(sequence, of): (&'s Sequence, &&RowSequence)| Grouped { sequence, group: of.group.unwrap_or(0) };
    followed.iter().zip(of).map(group).collect()
}

/// The model with what a row adds and how much rows count together, and without what an earlier calibration stated.
fn shaped(model: &Model<'_>, fitted: &Fitted, max_rows: u32) -> Result<Vec<u8>> {
    let unit = f64::from(model.unit());
    let shape = &fitted.shape;
    let sections = vec![
        (Tag::Weights, shape.weights.as_ref().map(|weights| (true, shape::weights_section(weights)))),
        (Tag::RowEvidence, shape.table.as_ref().map(|table| (true, table.section(unit)))),
        (Tag::ThresholdsByObject, None),
        (Tag::Promise, None),
        (Tag::Temperature, None),
    ];
    let restated = Restated { max_touches: Some(max_rows), sections, ..Restated::default() };
    let shaped = restate(model, &restated)?;
    #[cfg(feature = "train")]
    let shaped = strangers::without(&compile::open(&shaped)?)?;
    Ok(shaped)
}

/// The thresholds at which a walk begins.
fn begin(model: &Model<'_>, rows: &Rows<'_>, parts: &Parts<'_>, settings: &Settings, max_rows: u32) -> Begin {
    let until = Until { margin: STRICTEST, max_touches: max_rows };
    let followed = follow(model, rows, &parts.learned, until);
    let mut share = 1.0;
    #[cfg(feature = "train")]
    if settings.strangers.is_some() {
        share -= super::background::TESTED;
    }
    if !parts.has_groups {
        share *= share_tested(settings.per);
    }
    let tested = (share * parts.units_tested() as f64) as usize;
    let units = parts.learned.iter().enumerate().map(|(number, sequence)| sequence.group.unwrap_or(number));
    Begin::new(&followed, &units.collect::<Vec<_>>(), tested, &terms(settings), STRICTEST)
}

fn terms(settings: &Settings) -> Terms {
    Terms { rate: settings.rate, confidence: settings.confidence, per: settings.per }
}

fn finished(
    model: &Model<'_>,
    chosen: &Chosen,
    parts: &Parts<'_>,
    settings: &Settings,
    max_rows: u32,
    fitted: &Fitted,
) -> Result<Calibrated> {
    let names = names(model);
    let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    let promise = Promise {
        rate: settings.rate,
        confidence: settings.confidence,
        per: settings.per,
        approaches: false,
        active: false,
        groups: parts.has_groups,
        sequences: count(chosen.sequences),
        given: count(chosen.given),
        wrong: count(chosen.wrong),
        mean_thousandths: (1e3 * chosen.mean_touches).round() as u32,
        max_touches: max_rows,
        noise: PromisedNoise::default(),
    };
    let by_object = match &chosen.odds {
        Odds::All(_) => None,
        Odds::ByObject(odds) => {
            // A background, which is never named, has a place too.
            let all = odds.iter().copied().chain(std::iter::repeat(0)).take(model.object_count());
            Some((true, all.flat_map(OddsByObject::to_bytes).collect()))
        }
    };
    let sections =
        vec![(Tag::ThresholdsByObject, by_object), (Tag::Promise, Some((false, promise.write(<[u8]>::to_vec))))];
    let restated = Restated { odds: Some(chosen.odds.strictest()), sections, ..Restated::default() };
    let share = |tally: &Tally| tally.wrong as f64 / tally.all.max(1) as f64;
    let is_each = settings.per != Per::Average;
    let of_object = |(name, (touched, named)): (&String, (&Tally, &Tally))| {
        let of = OfObject { given: touched.all, wrong: touched.wrong, named: named.all, named_wrongly: named.wrong };
        (name.clone(), of)
    };
    let margin = |(object, name): (usize, &String)| (name.clone(), margin_of(chosen.odds.of(object)));
    Ok(Calibrated {
        model: restate(model, &restated)?,
        promise,
        promised: settings.rate,
        per: settings.per.name(),
        confidence: settings.confidence,
        sequences: chosen.sequences,
        groups: parts.has_groups.then(|| parts.units_tested()),
        learned: parts.learned.len(),
        error: chosen.wrong as f64 / chosen.given.max(1) as f64,
        undecided: 1.0 - chosen.given as f64 / chosen.sequences.max(1) as f64,
        mean_rows: chosen.mean_touches,
        max_rows,
        uncalibrated_margin: ((1.0 - settings.rate) / settings.rate).ln(),
        margins: names.iter().enumerate().map(margin).collect(),
        errors: names.iter().cloned().zip(chosen.tallies.iter().map(share)).filter(|_| is_each).collect(),
        objects: names.iter().zip(chosen.touched.iter().zip(&chosen.named)).map(of_object).collect(),
        row_evidence: fitted.table,
        weights: fitted.weights,
        weights_by_doubling: shape::stated(model),
        #[cfg(feature = "train")]
        strangers: None,
        note: None,
    })
}
