//! Everything that is measured of a model on touches, as one call.

use super::plan::{Active, evaluate_active};
use super::{ActiveFacts, Evaluation, LEAST_GROUPS, Margins, OnStrangers, Settings, evaluate, strangers};
use crate::error::{Error, Result};
use crate::probe::noise::Noise;
use crate::touches::Dataset;
use palpate_onboard::Model;
use std::collections::BTreeMap;
use std::path::Path;

/// Measurements to make.
#[derive(Clone, Debug)]
pub struct Wanted<'d> {
    /// Numbers of touches after which to give the accuracy; `None` for the usual ones, as far as the touches go.
    pub at: Option<Vec<usize>>,
    /// Groups of touches, and sequences, to draw at random for each object.
    pub groups: usize,
    /// The error rate to stop at; `None` for the model's own thresholds.
    pub error_rate: Option<f64>,
    /// The touches after which to give up; `None` for the model's own limit.
    pub max_touches: Option<u32>,
    /// Seed of the drawing.
    pub seed: u64,
    /// Noise of the touches, with which a promise is compared.
    pub noise: Noise,
    /// True if each approach is made where the model's plan says.
    pub active: bool,
    /// Touches of objects that the model does not know, and where they are from.
    pub unknown: Option<(&'d Path, &'d Dataset)>,
}

/// The figures of a model on touches, and what was wanted beside them.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Evaluated {
    /// The usual figures.
    #[serde(flatten)]
    pub evaluation: Evaluation,
    /// Robots that made the touches in turn, each with its own bias.
    pub robots: usize,
    /// Number of instances or recordings of the objects that have several: each group is of touches of one.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub instances: BTreeMap<String, usize>,
    /// Objects whose touches are those that the model was trained on.
    pub trained_on: Vec<String>,
    /// Stock that the plan proposed approaches from, where it did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub active: Option<ActiveFacts>,
    /// Answers to objects that the model does not know.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strangers: Option<OnStrangers>,
}

/// Measures a model on touches that have their noise already. `expecting` gives the weight of each object, of the objects'
/// names and the model's own weights; `None` leaves these.
///
/// # Errors
/// Errors of [`evaluate`] and [`Margins::new`]; for a plan or strangers that cannot be evaluated; [`Kind::Setting`](crate::error::Kind::Setting) `at` for more touches than there are enough
/// different groups of.
pub fn measure(
    model: &Model<'_>,
    dataset: &Dataset,
    wanted: &Wanted<'_>,
    expecting: impl Fn(&[String], &[f64]) -> Result<Option<Vec<u32>>>,
) -> Result<Evaluated> {
    let mut margins = Margins::new(model, dataset)?;
    if let Some(weights) = expecting(&margins.objects, &own_weights(model))? {
        margins = margins.expecting(weights)?;
    }
    let settings = Settings {
        at: numbers_of_touches(&margins, wanted.at.as_deref())?,
        at_approaches: numbers_of_approaches(&margins, wanted.at.as_deref()),
        groups: wanted.groups,
        error_rate: wanted.error_rate,
        max_touches: wanted.max_touches,
        seed: wanted.seed,
        noise: wanted.noise,
    };
    let active = wanted.active.then(|| Active::new(&margins, dataset)).transpose()?;
    let evaluation = match &active {
        Some(active) => evaluate_active(&margins, active, &settings)?,
        None => evaluate(&margins, &settings)?,
    };
    let strangers = wanted.unknown.map(|(directory, dataset)| {
        let unknown = Margins::of_strangers(model, dataset).map_err(|error| error.in_file(directory))?;
        strangers((&margins, &evaluation.sequential), &unknown, &settings.sequences())
    });
    let strangers = strangers.transpose()?;
    let (instances, active) = (dataset.several(), active.map(|active| active.facts()));
    Ok(Evaluated { evaluation, robots: 1, instances, trained_on: Vec::new(), active, strangers })
}

/// The numbers of touches to give the accuracy after: those asked for, or the usual ones that enough groups can be drawn
/// of.
fn numbers_of_touches(margins: &Margins<'_>, wanted: Option<&[usize]>) -> Result<Vec<usize>> {
    let few = |at: usize| margins.distinct_groups(at) < LEAST_GROUPS;
    let Some(wanted) = wanted else {
        return Ok(Settings::default().at.into_iter().filter(|&at| !few(at)).collect());
    };
    // None at all is said by the evaluation, with the object that has too few touches.
    match wanted.iter().find(|&&at| at > 0 && at <= margins.fewest_touches() && few(at)) {
        Some(&at) => {
            let (groups, touches) = (margins.distinct_groups(at), margins.fewest_touches());
            let allowed = format!(
                "another number, or capture more: of {touches} touches only {groups} different groups of {at} can be drawn, \
                 too few for an accuracy"
            );
            Err(Error::setting("at", at, allowed))
        }
        None => Ok(wanted.to_vec()),
    }
}

/// The numbers of approaches to give the accuracy after: those asked for, or the usual ones, as far as the approaches go.
fn numbers_of_approaches(margins: &Margins<'_>, wanted: Option<&[usize]>) -> Vec<usize> {
    match wanted {
        Some(wanted) => wanted.to_vec(),
        None => {
            let few = |at: &usize| *at <= margins.fewest_approaches();
            Settings::default().at_approaches.into_iter().filter(few).collect()
        }
    }
}

/// The weights that a model's own priors stand for.
pub fn own_weights(model: &Model<'_>) -> Vec<f64> {
    (0..model.object_count()).map(|object| (f64::from(model.prior(object)) * f64::from(model.unit())).exp()).collect()
}
