//! Contents of a compiled model, and its cost on a chip.

mod stated;

pub use stated::{Defaults, Feature, Limited, Noise, PlanOf, Predicts, Probe, Promised, SomeColumns, Tested, Touches};

use crate::compile::{self, Core, Instructions, Memory};
use crate::evaluate;
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::{CHECKSUM_LENGTH, HEADER_LENGTH};
use stated::{evidence, features, guard, noise, pattern, plan, position, predicts, priors, probe, promised, tested};
use std::collections::BTreeMap;

/// Contents and statements of a compiled model.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Inspected<'a> {
    /// The format's version.
    pub version: u16,
    /// The version of the program that wrote it.
    pub tool_version: &'a str,
    /// 16 hexadecimal digits that identify the ensemble.
    pub ensemble: String,
    /// The name of its descriptor.
    pub descriptor: &'static str,
    /// Number of features.
    pub features: usize,
    /// For a model over rows: each feature's name, and how many units make up 1 (null where f32 values are compared).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feature_names: Option<Vec<Feature>>,
    /// Numbers of the columns of the library's rows, for a model over some of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<SomeColumns>,
    /// Name of the feature that is a row's number in its sequence, for a model with one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<String>,
    /// Limits of each feature in the rows of a sequence, for a model that states them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub guard: Option<Vec<Limited>>,
    /// The objects' names.
    pub objects: Vec<&'a str>,
    /// Predictions of a model over rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predicts: Option<Predicts>,
    /// The layout's name.
    pub layout: &'static str,
    /// The type of leaves.
    pub leaf: &'static str,
    /// Number of different leaves, if equal ones are stored once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shared_leaves: Option<usize>,
    /// Trees.
    pub trees: u32,
    /// Splits.
    pub splits: u32,
    /// Leaves.
    pub leaves: u32,
    /// All bytes.
    pub bytes: usize,
    /// The bytes of each part.
    pub bytes_by_part: BTreeMap<&'static str, usize>,
    /// 8 hexadecimal digits.
    pub checksum: String,
    /// The unit of margins, in nats.
    pub unit: f32,
    /// The largest rounding error of a margin, in nats.
    pub margin_error: f32,
    /// Default end of recognizers' sequences.
    pub stopping: Defaults,
    /// Promise of the model; null if it was not calibrated.
    pub promise: Option<Promised>,
    /// True if it has a column for unknown objects.
    pub background: bool,
    /// Its test of whether touches fit any object that it knows; null without one.
    pub strangers: Option<Tested>,
    /// Divisor of the evidence before it is shown as a posterior.
    pub temperature: f64,
    /// The logarithm of each object's prior, the largest 0; null if all are equal.
    pub priors: Option<BTreeMap<&'a str, f64>>,
    /// The probe that it was trained for.
    pub probe: Probe,
    /// The touches that are evidence.
    pub touches: Touches,
    /// The noise in the training; null if the model does not state it.
    pub noise: Option<Noise>,
    /// Share of each contact pattern among the approaches of the training; null if the model does not state it.
    pub pattern: Option<BTreeMap<&'static str, f64>>,
    /// The plan of approaches; null if the model has none.
    pub plan: Option<PlanOf>,
    /// Per touch, estimated.
    pub instructions: Instructions,
    /// The cost on a chip, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chip: Option<OnChip>,
}

/// The cost of a model on a chip.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct OnChip {
    /// The processor.
    pub core: Core,
    /// Flash, memory and stack.
    #[serde(flatten)]
    pub memory: Memory,
    /// From contact times to margins, estimated.
    pub margin_instructions: Option<u64>,
    /// From contact times to the verdict, estimated.
    pub verdict_instructions: Option<u64>,
    /// Up to the margins, if features lead the longest way through every tree; estimated.
    pub most_instructions: Option<u64>,
}

/// Instructions of a verdict beyond the margins: between 500 and 1,400.
const VERDICT: u64 = 1_000;

/// Contents and statements of a model, without its cost on a chip.
pub fn inspect<'a>(model: &Model<'a>) -> Inspected<'a> {
    let header = model.header();
    let stopping = Stopping::from_model(model);
    Inspected {
        version: header.version(),
        tool_version: model.tool_version(),
        ensemble: format!("{:016x}", header.ensemble()),
        descriptor: model.descriptor().map_or("none (rows of features)", palpate_shared::Descriptor::name),
        features: model.feature_count(),
        feature_names: model.descriptor().is_none().then(|| features(model)),
        columns: palpate_trees::rows::columns_of(model).map(|(all, used)| SomeColumns { all, used }),
        position: position(model),
        guard: guard(model),
        objects: (0..model.known_count()).map(|object| model.object_name(object)).collect(),
        predicts: predicts(model),
        layout: model.layout().name(),
        leaf: model.leaf_type().name(),
        shared_leaves: compile::different_leaves(model),
        trees: header.trees(),
        splits: header.splits(),
        leaves: header.leaves(),
        bytes: model.bytes().len(),
        bytes_by_part: parts(model),
        checksum: format!("{:08x}", model.checksum()),
        unit: crate::trees::verify::unit(model) as f32,
        margin_error: crate::trees::verify::bound(model) as f32,
        stopping: Defaults {
            error_rate: evaluate::significant(stopping.error_rate()),
            max_touches: stopping.max_touches(),
        },
        promise: promised(model),
        background: model.background().is_some(),
        strangers: model.strangers().and_then(|strangers| strangers.test).map(|test| tested(&test.terms)),
        temperature: model.temperature().value(),
        priors: priors(model),
        probe: probe(model),
        touches: evidence(model),
        noise: noise(model),
        pattern: pattern(model),
        plan: plan(model),
        instructions: Instructions::of_model(model),
        chip: None,
    }
}

fn parts(model: &Model<'_>) -> BTreeMap<&'static str, usize> {
    let header = model.header();
    let objects = model.object_count();
    let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
    BTreeMap::from([
        ("header", HEADER_LENGTH),
        ("text", length(header.text_length())),
        ("optional_sections", length(header.optional_length())),
        ("base_margins", 4 * objects),
        ("priors", 4 * objects),
        ("axes", 4 * usize::from(header.axes())),
        ("thresholds", length(header.cuts_length())),
        ("groups", 8 * usize::from(header.groups())),
        ("splits", length(header.nodes_length())),
        ("leaves", length(header.leaves_length())),
        ("checksum", CHECKSUM_LENGTH),
    ])
}

/// The estimated cost of a model on a processor.
pub fn on_chip(model: &Model<'_>, core: Core) -> OnChip {
    let margins = Instructions::of_model(model).on(core);
    OnChip {
        core,
        memory: Memory::of_model(model, core, &compile::features(model)),
        margin_instructions: margins,
        verdict_instructions: margins.map(|margins| margins + VERDICT),
        most_instructions: Instructions::of_longest_ways(model).on(core),
    }
}
