//! A model's shape, thresholds and promise, from sequences of rows.

use super::copies::copies;
use super::folds::{Learned, moved};
use super::follow::follow;
use super::parts::Parts;
use super::settings::Settings;
use super::shape::{self, Fitted, STRICTEST, shaped};
use super::{Rows, check, check_columns, guard, rows_of, taken};
use crate::calibrate::{
    Begin, Calibrated, Chosen, Guarded, Limit, Odds, OfRows, Stated, Stop, Terms, Used, Way, promise, share_tested,
};
use crate::compile::{self, Restated, restate};
use crate::error::{Result, problem};
use crate::progress::Progress;
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::{PromisedNoise, Tag};
use palpate_trees::rows::{RowSequence, Sequences};

/// Sets a model's thresholds so that it keeps a promised error rate and uses it up, on sequences of rows that nothing was
/// trained on; also what a row adds to the evidence, and how much rows count together, where that saves rows. Sequences of a
/// group are used together, and the promise is then for new groups; without groups they must be independent of each other.
///
/// # Errors
/// [`Kind::NotKept`](crate::error::Kind::NotKept) if no threshold keeps the promise;
/// [`Kind::TooFew`](crate::error::Kind::TooFew) if too few names are given to know, or there are too few sequences; a model
/// without classes of rows; a class without a sequence; [`Kind::Setting`](crate::error::Kind::Setting) for settings out of
/// their ranges.
pub fn calibrate(
    model: &Model<'_>,
    sequences: &Sequences,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    calibrate_from(model, sequences, None, settings, progress)
}

/// Like [`calibrate`], with what is learned from sequences of the model's training, so that all other sequences are tested on.
///
/// # Errors
/// Errors of [`calibrate`]; another model than that of `learned`.
pub fn calibrate_with(
    model: &Model<'_>,
    sequences: &Sequences,
    learned: &Learned,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    calibrate_from(model, sequences, Some(learned), settings, progress)
}

fn calibrate_from(
    model: &Model<'_>,
    sequences: &Sequences,
    learned: Option<&Learned>,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    progress.begin("computing margins", None);
    let (bytes, guarded) = guarded(model, sequences, learned, settings)?;
    let model = &compile::open(&bytes)?;
    let rows = taken(model, sequences)?;
    let margins = Rows::new(model, &rows);
    progress.begin("calibrating", None);
    let calibrated = match learned {
        None => calibrate_margins(model, &margins, &rows.sequences, settings)?,
        Some(learned) => {
            check_classes(model, &rows.sequences)?;
            let mut both = margins.margins.into_owned();
            both.extend(learned.units(model)?);
            let own = learned.sequences.sequences.iter();
            let own: Vec<_> = own.map(|sequence| moved(sequence, rows.len(), rows.groups.len())).collect();
            let parts = Parts::of(&own, &rows.sequences, settings)?;
            calibrate_parts(model, &Rows::of(model, both.into()), parts, settings)?
        }
    };
    let all = rows_of(sequences);
    let guard = guarded.map(|learned| Guarded { rows: all - learned, refused: all - rows_of(&rows) });
    let (copies, all) = (copies(sequences), sequences.sequences.len());
    let note = (copies > 0).then(|| {
        format!(
            "{copies} of {all} sequences are copies, value by value, of others under another id. Copies are not independent, so that \
             the promise may not hold: leave them out, or name what they come from as their group."
        )
    });
    Ok(Calibrated { note, guard, ..calibrated })
}

/// The model with a guard, if one is wanted, and without one of an earlier calibration; and the number of these rows that the
/// guard was learned from.
fn guarded(
    model: &Model<'_>,
    sequences: &Sequences,
    others: Option<&Learned>,
    settings: &Settings,
) -> Result<(Vec<u8>, Option<usize>)> {
    check(model)?;
    settings.check()?;
    let without = restate(model, &Restated { sections: vec![(Tag::Guard, None)], ..Restated::default() })?;
    if !settings.guard {
        return Ok((without, None));
    }
    let model = compile::open(&without)?;
    check_columns(&model, sequences)?;
    let (section, rows) = match others {
        Some(others) => {
            let learned: Vec<&RowSequence> = others.sequences.sequences.iter().collect();
            (guard::section(&model, &others.sequences, &learned), 0)
        }
        None => {
            // Of the same sequences and seed the parts are the same again.
            let learned = Parts::new(&sequences.sequences, settings)?.learned;
            let rows = learned.iter().map(|sequence| sequence.rows.len()).sum();
            (guard::section(&model, sequences, &learned), rows)
        }
    };
    let section = (Tag::Guard, Some((true, section)));
    Ok((restate(&model, &Restated { sections: vec![section], ..Restated::default() })?, Some(rows)))
}

/// Like [`calibrate`], from margins that were computed before.
pub(super) fn calibrate_margins(
    model: &Model<'_>,
    rows: &Rows<'_>,
    sequences: &[RowSequence],
    settings: &Settings,
) -> Result<Calibrated> {
    check(model)?;
    settings.check()?;
    check_classes(model, sequences)?;
    calibrate_parts(model, rows, Parts::new(sequences, settings)?, settings)
}

/// Refuses sequences without one of every class.
fn check_classes(model: &Model<'_>, sequences: &[RowSequence]) -> Result<()> {
    let names = names(model).into_iter().enumerate();
    let missing = names.filter(|(class, _)| !sequences.iter().any(|sequence| sequence.class == *class));
    let objects: Vec<String> = missing.map(|(_, name)| name).collect();
    match objects.is_empty() {
        true => Ok(()),
        false => Err(problem!("there is no sequence of {}", objects.join(", ")).fix("Add sequences of them.")),
    }
}

/// Like [`calibrate`], of parts.
fn calibrate_parts(model: &Model<'_>, rows: &Rows<'_>, parts: Parts<'_>, settings: &Settings) -> Result<Calibrated> {
    let max_rows = settings.max_rows.unwrap_or(Stopping::from_model(model).max_touches());
    compile::stopping(settings.rate, max_rows)?;
    let names = names(model);
    let fitted = shape::fit(rows, &parts.learned, settings.rate, max_rows);
    let shaped = shaped(model, &fitted, max_rows)?;
    let followed = Followed { rows, names: names.len(), terms: settings.terms(), max_rows };
    let begin = begin(&compile::open(&shaped)?, rows, &parts, settings, max_rows);
    #[cfg(feature = "train")]
    if let Some(wanted) = &settings.strangers {
        // Names that the test holds back are wrong less often, which no looser threshold is to use up.
        let without = followed.choose(&compile::open(&shaped)?, &parts, &begin.starts, None).ok();
        let (shaped, parts, found) = super::background::test(&shaped, rows, parts, wanted, begin.loosest)?;
        let model = compile::open(&shaped)?;
        let loosest = without.as_ref().map(|without| &without.odds);
        let chosen = followed.choose(&model, &parts, &[begin.loosest], loosest);
        let chosen = chosen.map_err(|stop| parts.problem(&stop, &names, settings))?;
        let calibrated = finished(&model, &chosen, &parts, settings, max_rows, &fitted)?;
        return Ok(Calibrated { strangers: Some(found), ..calibrated });
    }
    let model = compile::open(&shaped)?;
    let chosen = followed.choose(&model, &parts, &begin.starts, None);
    let chosen = chosen.map_err(|stop| parts.problem(&stop, &names, settings))?;
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
        let limit = Limit { margin, max_touches: self.max_rows };
        let tested = follow(model, self.rows, &parts.tested, limit);
        let learned = if parts.has_groups { follow(model, self.rows, &parts.learned, limit) } else { Vec::new() };
        promise(&learned, &tested, self.names, &way, &self.terms)
    }
}

fn names(model: &Model<'_>) -> Vec<String> {
    let mut names = compile::names(model);
    names.truncate(model.known_count());
    names
}

/// The thresholds at which a walk begins.
fn begin(model: &Model<'_>, rows: &Rows<'_>, parts: &Parts<'_>, settings: &Settings, max_rows: u32) -> Begin {
    let limit = Limit { margin: STRICTEST, max_touches: max_rows };
    let followed = follow(model, rows, &parts.learned, limit);
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
    Begin::new(&followed, &units.collect::<Vec<_>>(), tested, &settings.terms(), STRICTEST)
}

fn finished(
    model: &Model<'_>,
    chosen: &Chosen,
    parts: &Parts<'_>,
    settings: &Settings,
    max_rows: u32,
    fitted: &Fitted,
) -> Result<Calibrated> {
    let noise = PromisedNoise::default();
    let stated = Stated { approaches: false, active: false, groups: parts.has_groups, max_touches: max_rows, noise };
    let calibrated = Calibrated::new(model, &names(model), chosen, &settings.terms(), stated, Vec::new())?;
    let weights_by_doubling = shape::stated(model);
    Ok(Calibrated {
        counted: "rows",
        groups: parts.has_groups.then(|| parts.units_tested()),
        learned: Some(parts.learned.len()),
        used: Used::Rows { mean_rows: chosen.mean_touches, max_rows },
        rows: Some(OfRows { row_evidence: fitted.table, weights: fitted.weights, weights_by_doubling }),
        ..calibrated
    })
}
