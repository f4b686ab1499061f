//! Choosing a model: the best that fits a chip.
//!
//! A family of ensembles is trained (trees, depth, eta; for the table layout bins of each feature), each compiled with
//! 8- and 16-bit leaves in every layout that fits, and measured on touches held out from training. Kept is the model
//! that stops after the fewest touches at the wanted error rate, of those within the limits. Its own figures come from a
//! third share of the touches, which chose nothing.
//!
//! Instructions a touch are those of the exporter's model of the evaluator on a Cortex-M4F
//! ([`crate::compile::Compiled::instructions`]).

mod family;
#[cfg(test)]
mod tests;

use crate::compile::{self, Compiled, Layout, Leaf, compile};
use crate::ensemble::Ensemble;
use crate::error::{Error, Result};
use crate::evaluate::{self, Candidate, Evaluation, Margins};
use crate::progress::{self, Progress};
use crate::touches::Dataset;
use crate::touches::folds;
use palpate_onboard::Model;
use palpate_shared::Descriptor;
use serde::Serialize;
use std::collections::BTreeMap;

/// What a model has to fit, and how candidates are measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Which features a touch is turned into.
    pub descriptor: Descriptor,
    /// The most bytes of a model.
    pub max_bytes: Option<usize>,
    /// The most instructions a touch.
    pub max_instructions: Option<u64>,
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
            error_rate: 0.01,
            groups: 1000,
            seed: 1,
        }
    }
}

/// How an ensemble of the family was trained.
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
}

/// A compiled model of the family, and what it achieves on held-out touches.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// How its ensemble was trained.
    #[serde(flatten)]
    pub recipe: Recipe,
    /// What leaves are stored as; `None` for the full model without limits that all are held against.
    pub leaf: Option<&'static str>,
    /// How trees are laid out.
    pub layout: Option<&'static str>,
    /// Size of the model.
    pub bytes: Option<usize>,
    /// Instructions a touch on a Cortex-M4F, from the exporter's model of the evaluator.
    pub instructions: Option<u64>,
    /// Accuracy after 10 and 30 touches, as far as the held-out touches go.
    pub accuracy: BTreeMap<usize, f64>,
    /// Touches until it stops, on average.
    pub mean_touches: f64,
    /// Share of wrong verdicts when it stops by itself.
    pub error: f64,
    /// Whether no other model is at least as small, as fast and as quick to stop, and better in one of them.
    pub frontier: bool,
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
    /// Its figures on touches that neither trained nor chose it.
    pub test: Evaluation,
    /// Its bytes.
    #[serde(skip)]
    pub model: Vec<u8>,
    /// Its ensemble.
    #[serde(skip)]
    pub ensemble: Ensemble,
}

/// Trains the family on eight tenths of the touches, chooses on one tenth, and measures the choice on the last.
///
/// # Errors
/// As [`crate::ensemble::train::train`] and [`evaluate::evaluate`]; [`Error::Data`] if no model is within the limits.
pub fn tune(dataset: &Dataset, settings: &Settings, progress: &dyn Progress) -> Result<Tuned> {
    let outer = folds::split(dataset, 0.2, settings.seed)?;
    let held_out = folds::split(&outer.test, 0.5, settings.seed)?;
    let (choose, test) = (held_out.train, held_out.test);
    let family = family::train(&outer.train, settings, progress)?;
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
    let Some(unlimited) = unlimited else { return Err(nothing_fits(None)) };
    models.sort_by_key(|(row, ..)| (row.bytes, row.instructions));
    mark_frontier(&mut models);
    let chosen = choose_from(&models, settings)?;
    let (_, ensemble, compiled) = &models[chosen];
    let (ensemble, model) = ((*ensemble).clone(), compiled.bytes.clone());
    let test = evaluate::evaluate(&Margins::new(Candidate::Compiled(&open(&model)?), &test)?, &of(settings, &test))?;
    Ok(Tuned { unlimited, rows: models.into_iter().map(|(row, ..)| row).collect(), chosen, test, model, ensemble })
}

type Measured<'e> = (Row, &'e Ensemble, Compiled);

/// The ensemble in every leaf width and layout; a layout changes no margin unless it is a table, so trees are measured
/// once for all of theirs.
fn compiled_models<'e>(
    recipe: &Recipe,
    ensemble: &'e Ensemble,
    choose: &Dataset,
    settings: &Settings,
) -> Result<Vec<Measured<'e>>> {
    let mut models: Vec<Measured<'e>> = Vec::new();
    let layouts: &[Layout] = if recipe.bins.len() > 1 { &[Layout::Grid] } else { &[Layout::Compact, Layout::Complete] };
    for leaf in [Leaf::I8, Leaf::I16] {
        let mut measured: Option<Row> = None;
        for &layout in layouts {
            let how = compile::Settings {
                leaf,
                layout: Some(layout),
                error_rate: settings.error_rate,
                ..compile::Settings::default()
            };
            // Not every ensemble fits every layout.
            let Ok(compiled) = compile(ensemble, &how) else { continue };
            let shape = Some((leaf, layout, compiled.bytes.len(), compiled.instructions));
            let row = match &measured {
                Some(row) => Row {
                    layout: Some(layout.name()),
                    bytes: Some(compiled.bytes.len()),
                    instructions: Some(compiled.instructions),
                    ..row.clone()
                },
                None => measure(Candidate::Compiled(&open(&compiled.bytes)?), recipe, shape, choose, settings)?,
            };
            measured = Some(row.clone());
            models.push((row, ensemble, compiled));
        }
    }
    Ok(models)
}

fn measure(
    candidate: Candidate<'_>,
    recipe: &Recipe,
    shape: Option<(Leaf, Layout, usize, u64)>,
    choose: &Dataset,
    settings: &Settings,
) -> Result<Row> {
    let evaluation = evaluate::evaluate(&Margins::new(candidate, choose)?, &of(settings, choose))?;
    Ok(Row {
        recipe: recipe.clone(),
        leaf: shape.map(|(leaf, ..)| leaf.name()),
        layout: shape.map(|(_, layout, ..)| layout.name()),
        bytes: shape.map(|(_, _, bytes, _)| bytes),
        instructions: shape.map(|(.., instructions)| instructions),
        accuracy: evaluation.accuracy,
        mean_touches: evaluation.sequential.mean_touches,
        error: evaluation.sequential.error,
        frontier: false,
    })
}

fn of(settings: &Settings, touches: &Dataset) -> evaluate::Settings {
    let fewest = touches.objects.iter().map(|object| object.touches.len()).min().unwrap_or(0);
    evaluate::Settings {
        at: [10, 30].into_iter().filter(|&at| at <= fewest).collect(),
        groups: settings.groups,
        error_rate: settings.error_rate,
        max_touches: None,
        seed: settings.seed,
    }
}

fn open(bytes: &[u8]) -> Result<Model<'_>> {
    Model::new(bytes)
        .map_err(|error| Error::data(format!("the exporter wrote no model: {error}"), "Report this as a bug."))
}

fn mark_frontier(models: &mut [Measured<'_>]) {
    let figures: Vec<_> = models.iter().map(|(row, ..)| (row.bytes, row.instructions, row.mean_touches)).collect();
    for ((row, ..), own) in models.iter_mut().zip(&figures) {
        let beats = |other: &&(Option<usize>, Option<u64>, f64)| {
            other.0 <= own.0 && other.1 <= own.1 && other.2 <= own.2 && *other != own
        };
        row.frontier = !figures.iter().any(|other| beats(&other));
    }
}

/// The model within the limits that stops first, among those that err no more often than they should.
fn choose_from(models: &[Measured<'_>], settings: &Settings) -> Result<usize> {
    let fits = |row: &Row| {
        settings.max_bytes.is_none_or(|most| row.bytes <= Some(most))
            && settings.max_instructions.is_none_or(|most| row.instructions <= Some(most))
    };
    let fitting = || models.iter().enumerate().filter(|(_, (row, ..))| fits(row));
    let least = |models: &mut dyn Iterator<Item = (usize, &Measured<'_>)>| {
        models.min_by(|(_, (a, ..)), (_, (b, ..))| a.mean_touches.total_cmp(&b.mean_touches)).map(|(index, _)| index)
    };
    // Where even the best errs more often, the quickest to stop would be the worst.
    let sound = |row: &Row| row.error <= settings.error_rate;
    least(&mut fitting().filter(|(_, (row, ..))| sound(row)))
        .or_else(|| fitting().min_by(|(_, (a, ..)), (_, (b, ..))| a.error.total_cmp(&b.error)).map(|(index, _)| index))
        .ok_or_else(|| nothing_fits(models.first().map(|(row, ..)| row)))
}

fn nothing_fits(smallest: Option<&Row>) -> Error {
    let what = match smallest.and_then(|row| row.bytes.zip(row.instructions)) {
        Some((bytes, instructions)) => {
            format!("no model fits; the smallest has {bytes} bytes and takes {instructions} instructions a touch")
        }
        None => "no model fits".into(),
    };
    Error::data(what, "Allow more with --max-bytes or --max-instructions.")
}
