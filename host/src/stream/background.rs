//! A test of whether rows fit any class that the model knows, with a false alarm rate that is kept on sequences.

use super::Rows;
use super::parts::{Parts, what};
use super::settings::StrangerTest;
use crate::calibrate::{Found, needed, odds_of};
use crate::compile::{self, Restated, restate};
use crate::error::{Error, Kind, Result};
use crate::strangers::{self, Pools};
use palpate_shared::format::Tag;
use palpate_trees::rows::RowSequence;

/// The share of the sequences that are not learned from on which the false alarm rate is tested; the promise rests on the
/// others.
pub(super) const TESTED: f64 = 3.0 / 7.0;

/// Adds the test that is wanted to a model: its bytes, the parts of the sequences without those that the test used, and what was
/// found. The test is made under the threshold at which the walk begins, a margin in nats: under looser ones no sequence is
/// longer, so that there are no more false alarms.
pub(super) fn test<'s>(
    shaped: &[u8],
    rows: &Rows<'_>,
    parts: Parts<'s>,
    wanted: &StrangerTest,
    begin: f64,
) -> Result<(Vec<u8>, Parts<'s>, Found)> {
    let model = compile::open(shaped)?;
    let restated =
        Restated { odds: Some(odds_of(begin)), sections: vec![(Tag::ThresholdsByObject, None)], ..Restated::default() };
    let begun = restate(&model, &restated)?;
    let begun = compile::open(&begun)?;
    let (alarms, parts) = parts.divided(TESTED);
    // Of groups one sequence each: these are independent.
    let alarms = Parts::once(&alarms);
    let evidence = |margins: Vec<i32>| {
        let mut margins = margins;
        margins.chunks_exact_mut(begun.object_count()).for_each(|row| begun.make_evidence(row));
        margins
    };
    let pools = |class: usize| {
        let own = alarms.iter().filter(|sequence| sequence.class == class);
        let of =
            |sequence: &&RowSequence| evidence(sequence.rows.clone().flat_map(|row| rows.row(row)).copied().collect());
        Pools::of_rows(own.map(of).collect())
    };
    let supplies = (0..begun.known_count()).map(pools).collect();
    let objects = begun.object_count();
    let mean = |margins: &Vec<i32>| {
        let margins = evidence(margins.clone());
        let count = (margins.len() / objects).max(1) as f64;
        (0..objects)
            .map(|object| margins.iter().skip(object).step_by(objects).map(|&m| f64::from(m)).sum::<f64>() / count)
            .collect()
    };
    let shapes: Vec<Vec<f64>> = wanted.background.iter().filter(|margins| !margins.is_empty()).map(mean).collect();
    let tested = strangers::calibrate_supplies(&begun, supplies, &shapes, &wanted.settings);
    let tested = tested.map_err(|error| problem(error, &parts, &wanted.settings))?;
    let found = tested.found(&wanted.settings);
    Ok((tested.bytes, parts, found))
}

/// The problem of a test, and what to do with sequences of rows.
fn problem(error: Error, parts: &Parts<'_>, settings: &strangers::Settings) -> Error {
    match error.kind() {
        Kind::TooFew => {
            // Three quarters of the part that is for the test are tested on.
            let needed = needed(settings.alarms, settings.confidence) as f64 / (0.75 * TESTED * parts.share_tested());
            let (needed, found, what) = (needed.ceil() as usize, parts.units, what(parts.has_groups));
            let in_all = format!(
                "It takes about {needed} {what} in all, because only a part of them tests for strangers; there are {found}. "
            );
            let in_all = if found < needed { in_all } else { String::new() };
            error.fix(in_all + "Record more, or calibrate without the test.")
        }
        Kind::NotKept => error
            .fix("Train the model on rows like these, so that they fit their classes, or calibrate without the test."),
        _ => error,
    }
}
