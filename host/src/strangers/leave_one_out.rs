//! Detection rate of a test for strangers: each object in turn is left out of the training.

use super::{Settings, Tested, calibrate};
use crate::compile::{self, compile};
use crate::ensemble::train::{self, train, train_with_background};
use crate::error::Result;
use crate::evaluate::{self, Candidate, Margins, Outcome, Sequential, SequentialSettings};
use crate::progress::{self, Progress};
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::format::Held;

/// Touches to train, to calibrate and to evaluate on: of the same objects, and no touch in two of them.
#[derive(Clone, Copy, Debug)]
pub struct Sets<'d> {
    /// To train on.
    pub train: &'d Dataset,
    /// To calibrate on.
    pub calibrate: &'d Dataset,
    /// To evaluate on.
    pub test: &'d Dataset,
}

/// Results with one object left out.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// The object.
    pub object: String,
    /// Result of the calibration; none without a test.
    pub calibrated: Option<Tested>,
    /// Verdicts on it, and the rate at which a known object was taken for unknown.
    pub strangers: evaluate::OnStrangers,
    /// Outcomes of its sequences.
    pub outcomes: Vec<Outcome>,
    /// Verdicts on the other objects.
    pub known: Sequential,
}

/// Leaves each object out, and measures what a model that was trained without it says to it: for each of `held` one list
/// of all objects, `None` standing for a model without a test. With a `background` models have a background column.
///
/// # Errors
/// As training, [`calibrate`] and an evaluation.
pub fn leave_one_out(
    sets: Sets<'_>,
    background: Option<&Dataset>,
    shapes: &[ObjectTouches],
    training: &train::Settings,
    settings: &Settings,
    held: &[Option<Held>],
    progress: &dyn Progress,
) -> Result<Vec<Vec<LeftOut>>> {
    let names = sets.train.names();
    progress.begin("leaving each object out", u64::try_from(names.len()).ok());
    let mut found = vec![Vec::new(); held.len()];
    for name in &names {
        let others = |dataset: &Dataset| dataset.only(|other| other != name);
        let known = others(sets.train);
        let ensemble = match background {
            None => train(&known, training, &())?,
            Some(background) => train_with_background(&known, background, training, &())?,
        };
        let compiled = compile(&ensemble, &compile::Settings::default())?;
        let model = compile::open(&compiled.bytes)?;
        let (learned, tested) = (others(sets.calibrate), others(sets.test));
        let stranger = sets.test.only(|other| other == name);
        for (held, found) in held.iter().zip(&mut found) {
            let calibrated =
                held.map(|held| calibrate(&model, &learned, shapes, &Settings { held, ..*settings })).transpose()?;
            let bytes = calibrated.as_ref().map_or(&compiled.bytes, |calibrated| &calibrated.bytes);
            let model = compile::open(bytes)?;
            found.push(measure(name, calibrated.clone(), Candidate::Compiled(&model), &tested, &stranger)?);
        }
        progress::advance(progress, 1)?;
    }
    Ok(found)
}

fn measure(
    name: &str,
    calibrated: Option<Tested>,
    candidate: Candidate<'_>,
    known: &Dataset,
    stranger: &Dataset,
) -> Result<LeftOut> {
    let evaluation = evaluate::Settings::default();
    let settings = SequentialSettings { seed: 2, ..evaluation.sequences() };
    let known = Margins::new(candidate, known)?;
    let unknown = Margins::of_strangers(candidate, stranger)?;
    let of_known = known.sequential(&settings)?;
    let strangers = evaluate::strangers((&known, &of_known), &unknown, &settings)?;
    let outcomes = unknown.sequential(&settings)?.outcomes.into_iter().flatten().collect();
    Ok(LeftOut { object: name.into(), calibrated, strangers, outcomes, known: of_known })
}
