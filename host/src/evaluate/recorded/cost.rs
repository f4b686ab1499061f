//! The accuracy that a model trained on simulated touches loses on recorded ones.

use super::{Settings, Share};
use crate::ensemble::train;
use crate::error::Result;
use crate::evaluate::{Candidate, Estimate, Margins, SequentialSettings};
use crate::progress::Progress;
use crate::touches::{Dataset, folds};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Numbers of approaches after which accuracy is given.
const AT: [usize; 5] = [5, 10, 20, 30, 60];
/// Approaches whose accuracy on simulated touches is asked for on recorded ones.
const COST_AT: usize = 20;

/// What it costs a model that recorded touches are not as simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Objects that the model knows; all of the simulated ones.
    pub known: usize,
    /// Accuracy after a number of approaches, on simulated touches that the model was not trained on.
    pub simulated: BTreeMap<usize, Share>,
    /// The same on recorded touches of the same objects.
    pub recorded: BTreeMap<usize, Share>,
    /// How many approaches the accuracy on simulated touches is of.
    pub after: usize,
    /// After how many approaches the model is right as often on recorded touches; none if it never is.
    pub needed: Option<f64>,
}

impl Cost {
    /// What it costs, in a sentence.
    pub fn sentence(&self) -> String {
        let Self { after, needed, .. } = self;
        match needed {
            Some(needed) if needed - *after as f64 > 0.5 => format!(
                "To be right as often as on simulated touches after {after} approaches takes {needed:.0} on recorded ones: {:.0} more.",
                (needed - *after as f64).max(1.0)
            ),
            Some(_) => format!("It is right as often on recorded touches: after {after} approaches nothing is lost."),
            None => {
                format!("On recorded touches it is never right as often as on simulated ones after {after} approaches.")
            }
        }
    }
}

/// What a model that is trained on simulated touches makes of recorded ones; none for fewer than two recorded objects.
pub(super) fn cost(
    recorded: &Dataset,
    simulated: &Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Option<Cost>> {
    if recorded.objects.len() < 2 {
        return Ok(None);
    }
    let split = folds::split(simulated, 0.25, settings.seed)?;
    let recipe = train::Settings { descriptor: settings.descriptor, ..train::Settings::compact() };
    let model = train::train(&split.train, &recipe, progress)?;
    let names = recorded.names();
    let tested = split.test.only(|name| names.iter().any(|own| own == name));
    progress.begin("measuring", None);
    let accuracy = |dataset: &Dataset, at: &[usize]| -> Result<BTreeMap<usize, Estimate>> {
        let margins = Margins::new(Candidate::Full(&model), dataset)?;
        let at: Vec<usize> = at.iter().copied().filter(|at| *at <= margins.fewest_approaches()).collect();
        let sequences =
            SequentialSettings { error_rate: None, max_touches: None, sequences: settings.groups, seed: settings.seed };
        let measured = margins.approaches(&at, &sequences)?;
        let both = measured.accuracy.iter().zip(measured.accuracy_standard_error.values());
        Ok(both.map(|((at, value), error)| (*at, Estimate { value: *value, standard_error: *error })).collect())
    };
    let all: Vec<usize> = (1..=*AT.last().unwrap_or(&1)).collect();
    let [own, other] = [&tested, recorded].map(|dataset| accuracy(dataset, &all));
    let (own, other) = (own?, other?);
    let shown = |of: &BTreeMap<usize, Estimate>| -> BTreeMap<usize, Share> {
        AT.iter().filter_map(|at| Some((*at, Share::of(*of.get(at)?)))).collect()
    };
    let after = COST_AT.min(own.len()).min(other.len()).max(1);
    let wanted = own.get(&after).map_or(1.0, |estimate| estimate.value);
    Ok(Some(Cost {
        known: model.known_count(),
        simulated: shown(&own),
        recorded: shown(&other),
        after,
        needed: needed(&other, wanted),
    }))
}

/// The number of approaches after which this accuracy is reached, in between two of them by a straight line.
fn needed(accuracy: &BTreeMap<usize, Estimate>, wanted: f64) -> Option<f64> {
    let (mut before, mut least) = (0.0, 0.0);
    for (&at, estimate) in accuracy {
        if estimate.value >= wanted {
            let share = (wanted - least) / (estimate.value - least).max(1e-12);
            return Some(before + share.clamp(0.0, 1.0) * (at as f64 - before));
        }
        (before, least) = (at as f64, estimate.value);
    }
    None
}
