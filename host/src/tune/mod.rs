//! Searches for the best model that fits a chip, and for the probe that needs the fewest approaches ([`probe`]).
//!
//! A family of ensembles is trained (trees, depth, eta; for the table layout, bins of each feature). Each is compiled with
//! 8- and 16-bit leaves in every layout that fits, and measured on touches held out from training. Among them are trees for
//! little flash ([`crate::ensemble::train::Small`]), with shared 8-bit leaves. Of the models within the limits, the one that
//! stops after the fewest touches at the wanted error rate is kept. It is calibrated to that rate on another part of the
//! touches, and its own figures come from yet another.
//!
//! Instructions per touch are the compiler's estimate ([`crate::compile::Instructions`]).
//!
//! ```no_run
//! use palpate::touches::Dataset;
//! use palpate::tune::{self, tune};
//!
//! # fn main() -> palpate::Result<()> {
//! let dataset = Dataset::read("data".as_ref())?;
//! let settings = palpate::with!(tune::Settings::default(), max_bytes = Some(16 << 10));
//! let tuned = tune(&dataset, &settings, &())?;
//! std::fs::write("model.palpate", &tuned.model).map_err(|e| palpate::Error::io("model.palpate", "write", e))?;
//! # Ok(())
//! # }
//! ```

pub(crate) mod error;
mod family;
pub mod probe;
#[cfg(test)]
mod tests;

use crate::calibrate::{self, Calibrated};
use crate::compile::{self, Compiled, Core, Layout, Leaf, compile};
use crate::ensemble::{Ensemble, OverTouches, StatedProbe, train};
use crate::error::{CalibrateProblem, CompileProblem, Result, TuneProblem};
use crate::evaluate::{self, Candidate, Evaluation, Margins};
use crate::probe::noise::Noise;
use crate::progress::{self, Progress};
use crate::touches::Dataset;
use crate::touches::folds;
use crate::with;
use palpate_shared::Descriptor;
use serde::Serialize;
use std::collections::BTreeMap;

/// Limits that a model has to fit, and settings for measuring candidates.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Features that a touch is turned into.
    pub descriptor: Descriptor,
    /// The most bytes of a model.
    pub max_bytes: Option<usize>,
    /// The most instructions per touch on `core`.
    pub max_instructions: Option<u64>,
    /// The processor that the limit of instructions is for.
    pub core: Core,
    /// The probe that made the touches, to be stated by the model.
    pub probe: Option<StatedProbe>,
    /// Noise added to the touches, in training as well as where models are measured.
    pub noise: Noise,
    /// The error rate that recognizers stop at.
    pub error_rate: f64,
    /// Groups, and sequences, drawn for each object.
    pub groups: usize,
    /// Seed of the split and of the drawing.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            descriptor: Descriptor::Curvature,
            max_bytes: None,
            max_instructions: None,
            core: Core::M4F,
            probe: None,
            noise: Noise::default(),
            error_rate: 0.01,
            groups: 1000,
            seed: 1,
        }
    }
}

/// Training settings of an ensemble of the family.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recipe {
    /// Multi-output trees.
    pub trees: usize,
    /// The most splits between root and leaf.
    pub depth: usize,
    /// The share of each tree that is added.
    pub eta: f64,
    /// Bins of each feature's histogram: one number, or one for each feature.
    pub bins: Vec<usize>,
    /// The most different leaves that all trees share, for trees of little flash ([`crate::ensemble::train::Small`]).
    pub different_leaves: Option<usize>,
}

/// A compiled model of the family, and its results on held-out touches.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Training settings of its ensemble.
    #[serde(flatten)]
    pub recipe: Recipe,
    /// Type that leaves are stored as; `None` for the full model without limits that all are compared with.
    pub leaf: Option<&'static str>,
    /// Layout of the trees.
    pub layout: Option<&'static str>,
    /// Size of the model with what a calibration adds, also where there are too few touches for one.
    pub bytes: Option<usize>,
    /// Instructions per touch on a Cortex-M4F, estimated.
    pub instructions: Option<u64>,
    /// Instructions on a Cortex-M0+.
    pub instructions_m0_plus: Option<u64>,
    /// Accuracy after 10 and 30 touches, as far as the held-out touches go.
    pub accuracy: BTreeMap<usize, f64>,
    /// Touches that are evidence until it stops, on average.
    pub mean_touches: f64,
    /// Approaches until it stops, on average, where the data set holds approaches.
    pub mean_approaches: Option<f64>,
    /// Share of wrong verdicts when it stops by itself.
    pub error: f64,
    /// True if no other model is at least as small, as fast (on the processor of the limit) and as quick to stop, and
    /// better in one of them.
    pub frontier: bool,
}

impl Row {
    /// Cost of a verdict to a robot: approaches, or touches where nothing else is known.
    fn cost(&self) -> f64 {
        self.mean_approaches.unwrap_or(self.mean_touches)
    }
}

/// The outcome of tuning.
#[derive(Clone, Debug, Serialize)]
pub struct Tuned {
    /// The full model without limits.
    pub unlimited: Row,
    /// All models of the family, by size.
    pub rows: Vec<Row>,
    /// The one kept: its position in `rows`.
    pub chosen: usize,
    /// Calibration of its thresholds, on touches that neither trained nor chose it; null if there is none.
    pub calibration: Option<Calibrated>,
    /// Reason for the lack of a calibration.
    pub uncalibrated: Option<String>,
    /// Its figures on touches that neither trained, calibrated nor chose it.
    pub test: Evaluation,
    /// Its bytes.
    #[serde(skip)]
    pub model: Vec<u8>,
    /// Its ensemble.
    #[serde(skip)]
    pub ensemble: Ensemble,
}

/// Trains the family on seven tenths of the touches, chooses on one tenth, calibrates the choice on one, and measures it
/// on the last. Of objects on a table each placement is an output, as [`crate::ensemble::train::Outputs`] says.
///
/// # Errors
/// Errors of [`crate::ensemble::train::train`], [`compile`](fn@crate::compile::compile) (except for layouts that do not fit) and
/// [`evaluate::evaluate`]; [`TuneProblem::NothingFits`] if no model is within the limits.
pub fn tune(dataset: &Dataset, settings: &Settings, progress: &dyn Progress) -> Result<Tuned> {
    let shares = dataset.placement_shares();
    let placed = (!shares.is_empty()).then(|| dataset.by_placement());
    let dataset = placed.as_ref().unwrap_or(dataset);
    let outer = folds::split(dataset, 0.3, settings.seed)?;
    let held_out = folds::split(&outer.test, 1.0 / 3.0, settings.seed)?;
    let halves = folds::split(&held_out.train, 0.5, settings.seed)?;
    let (mut choose, fresh, mut test) = (halves.train, halves.test, held_out.test);
    // Other seeds than that of the training.
    let robots = [(&mut choose, 1), (&mut test, 2)]
        .map(|(part, other)| evaluate::add_noise(part, &settings.noise, settings.seed.wrapping_add(other)));
    robots.into_iter().try_for_each(|robots| robots.map(drop))?;
    let mut family = family::train(&outer.train, settings, progress)?;
    for (_, ensemble) in &mut family {
        train::state_placements(ensemble, &shares)?;
    }
    progress.begin("measuring", Some(family.len() as u64));
    let mut models = Vec::new();
    let mut unlimited = None;
    for (recipe, ensemble) in &family {
        if unlimited.is_none() {
            // The family's first is the largest one.
            unlimited = Some(measure(Candidate::Full(ensemble), recipe, None, &choose, settings)?);
        } else {
            models.extend(compiled_models(recipe, ensemble, &choose, settings)?);
        }
        progress::advance(progress, 1)?;
    }
    let Some(unlimited) = unlimited else { return Err(TuneProblem::NothingCompiles.into()) };
    models.sort_by_key(|(row, ..)| (row.bytes, row.instructions));
    mark_frontier(&mut models, settings.core);
    let chosen = choose_from(&models, settings)?;
    let (_, ensemble, compiled) = &models[chosen];
    let (ensemble, mut model) = ((*ensemble).clone(), compiled.bytes.clone());
    let calibration = calibrated(&model, fresh, settings, progress)?;
    if let Ok(calibrated) = &calibration {
        model.clone_from(&calibrated.model);
    }
    let opened = compile::open(&model)?;
    let test = evaluated(Candidate::Compiled(&opened), &test, None, settings)?;
    let rows = models.into_iter().map(|(row, ..)| row).collect();
    let fewest = dataset.objects.iter().map(|object| object.len()).min().unwrap_or(0);
    let uncalibrated = calibration.as_ref().err().map(|problem| why(problem, fewest));
    Ok(Tuned { unlimited, rows, chosen, calibration: calibration.ok(), uncalibrated, test, model, ensemble })
}

/// The model with thresholds that keep the error rate, or the reason for their lack.
fn calibrated(
    model: &[u8],
    fresh: Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Result<Calibrated, CalibrateProblem>> {
    let terms = calibrate::Settings {
        rate: settings.error_rate,
        noise: settings.noise,
        seed: settings.seed.wrapping_add(3),
        ..calibrate::Settings::default()
    };
    match calibrate::calibrate(&compile::open(model)?, fresh, &terms, progress) {
        Err(error) => match error.problem() {
            Some(problem) => Ok(Err(CalibrateProblem::clone(problem))),
            _ => Err(error),
        },
        Ok(calibrated) => Ok(Ok(calibrated)),
    }
}

/// Reason why a model promises nothing, with the number of touches of each object that it would take, if there are
/// `fewest` of one of them.
fn why(problem: &CalibrateProblem, fewest: usize) -> String {
    match *problem {
        CalibrateProblem::TooFew { ref object, rate, found, needed, .. } if found > 0 => {
            // Of the whole data set, not of the part that was calibrated on.
            let problem = CalibrateProblem::TooFew { object: object.clone(), rate, found, needed, supplied: None };
            // Names grow with the touches; a tenth more, since some are wrong.
            let touches = 1.1 * fewest as f64 * needed as f64 / found as f64;
            let step = 10_f64.powf(touches.log10().floor() - 1.0);
            let touches = (touches / step).ceil() * step;
            format!("{problem}; about {touches:.0} touches of each object would do, where there are {fewest} now")
        }
        _ => problem.to_string(),
    }
}

type Measured<'e> = (Row, &'e Ensemble, Compiled);

/// The ensemble in every leaf width and layout. A layout changes no margin unless it is a table, so trees are measured
/// once for all layouts.
fn compiled_models<'e>(
    recipe: &Recipe,
    ensemble: &'e Ensemble,
    choose: &Dataset,
    settings: &Settings,
) -> Result<Vec<Measured<'e>>> {
    let mut models: Vec<Measured<'e>> = Vec::new();
    // A table for each contact pattern where partial touches are evidence, one table otherwise.
    let table = if ensemble.descriptor().is_some_and(palpate_shared::Descriptor::uses_partial_touches) {
        Layout::Patterns
    } else {
        Layout::Grid
    };
    let layouts: &[Layout] = if recipe.bins.len() > 1 { &[table] } else { &[Layout::Compact, Layout::Complete] };
    // Trees for little flash are trained for leaves of a byte, and exact with them.
    let is_small = recipe.different_leaves.is_some();
    for &leaf in if is_small { &[Leaf::I8][..] } else { &[Leaf::I8, Leaf::I16] } {
        let mut measured: Option<Row> = None;
        for &layout in layouts {
            let how = with!(
                compile::Settings::default(),
                leaf,
                layout = Some(layout),
                shared_leaves = Some(is_small),
                error_rate = settings.error_rate
            );
            let Some(compiled) = unless_unfit(compile(ensemble, &how))? else { continue };
            let row = match &measured {
                Some(row) => Row {
                    layout: Some(compiled.layout.name()),
                    bytes: Some(bytes(&compiled, settings)),
                    instructions: Some(compiled.instructions.m4f),
                    instructions_m0_plus: compiled.instructions.m0_plus,
                    ..row.clone()
                },
                None => {
                    let model = compile::open(&compiled.bytes)?;
                    measure(Candidate::Compiled(&model), recipe, Some((leaf, &compiled)), choose, settings)?
                }
            };
            measured = Some(row.clone());
            models.push((row, ensemble, compiled));
        }
    }
    Ok(models)
}

/// Not every ensemble fits every layout; all else that compiling refuses is an error.
fn unless_unfit(compiled: Result<Compiled>) -> Result<Option<Compiled>> {
    match compiled {
        Err(error) if matches!(error.problem::<CompileProblem>(), Some(CompileProblem::DoesNotFit { .. })) => Ok(None),
        compiled => compiled.map(Some),
    }
}

/// Bytes of the model including those that a calibration adds.
fn bytes(compiled: &Compiled, settings: &Settings) -> usize {
    compiled.bytes.len() + calibrate::added_bytes(&settings.noise)
}

fn measure(
    candidate: Candidate<'_>,
    recipe: &Recipe,
    compiled: Option<(Leaf, &Compiled)>,
    choose: &Dataset,
    settings: &Settings,
) -> Result<Row> {
    let evaluation = evaluated(candidate, choose, Some(settings.error_rate), settings)?;
    Ok(Row {
        recipe: recipe.clone(),
        leaf: compiled.map(|(leaf, _)| leaf.name()),
        layout: compiled.map(|(_, compiled)| compiled.layout.name()),
        bytes: compiled.map(|(_, compiled)| bytes(compiled, settings)),
        instructions: compiled.map(|(_, compiled)| compiled.instructions.m4f),
        instructions_m0_plus: compiled.and_then(|(_, compiled)| compiled.instructions.m0_plus),
        accuracy: evaluation.accuracy,
        mean_touches: evaluation.sequential.mean_touches,
        mean_approaches: evaluation.approaches.as_ref().map(|approaches| approaches.sequential.mean().value),
        error: evaluation.approaches.map_or(evaluation.sequential.error, |approaches| approaches.sequential.error),
        frontier: false,
    })
}

/// Evaluation settings with `error_rate` as [`evaluate::Settings::error_rate`].
fn evaluated(
    candidate: Candidate<'_>,
    touches: &Dataset,
    error_rate: Option<f64>,
    settings: &Settings,
) -> Result<Evaluation> {
    let margins = Margins::new(candidate, touches)?;
    let (fewest, approaches) = (margins.fewest_touches(), margins.fewest_approaches());
    let settings = evaluate::Settings {
        at: [10, 30].into_iter().filter(|&at| at <= fewest).collect(),
        at_approaches: [10, 20, 60].into_iter().filter(|&at| at <= approaches).collect(),
        groups: settings.groups,
        error_rate,
        max_touches: None,
        seed: settings.seed,
        noise: settings.noise,
    };
    evaluate::evaluate(&margins, &settings)
}

fn mark_frontier(models: &mut [Measured<'_>], core: Core) {
    let figures: Vec<_> =
        models.iter().map(|(row, _, compiled)| (row.bytes, compiled.instructions.on(core), row.cost())).collect();
    for ((row, ..), own) in models.iter_mut().zip(&figures) {
        let beats = |other: &&(Option<usize>, Option<u64>, f64)| {
            other.0 <= own.0 && other.1 <= own.1 && other.2 <= own.2 && *other != own
        };
        row.frontier = !figures.iter().any(|other| beats(&other));
    }
}

/// The model within the limits that stops first, among those that err no more often than they should.
fn choose_from(models: &[Measured<'_>], settings: &Settings) -> Result<usize> {
    let fits = |(row, _, compiled): &Measured<'_>| {
        settings.max_bytes.is_none_or(|most| row.bytes <= Some(most))
            && settings
                .max_instructions
                .is_none_or(|most| compiled.instructions.on(settings.core).is_some_and(|own| own <= most))
    };
    let fitting = || models.iter().enumerate().filter(|(_, model)| fits(model));
    // Where even the best errs more often, the quickest to stop would be the worst.
    let sound = |row: &Row| row.error <= settings.error_rate;
    let quickest = fitting()
        .filter(|(_, (row, ..))| sound(row))
        .min_by(|(_, (a, ..)), (_, (b, ..))| a.cost().total_cmp(&b.cost()));
    let chosen = quickest.or_else(|| fitting().min_by(|(_, (a, ..)), (_, (b, ..))| a.error.total_cmp(&b.error)));
    match chosen {
        Some((index, _)) => Ok(index),
        None => Err(nothing_fits(models, settings.core).into()),
    }
}

fn nothing_fits(models: &[Measured<'_>], core: Core) -> TuneProblem {
    let bytes = models.iter().filter_map(|(row, ..)| row.bytes).min();
    let instructions = models.iter().filter_map(|(.., compiled)| compiled.instructions.on(core)).min();
    match bytes.zip(instructions) {
        Some((bytes, instructions)) => TuneProblem::NothingFits { bytes, instructions },
        None => TuneProblem::NothingCompiles,
    }
}
