//! From an ensemble to the bytes that the chip reads.
//!
//! ```text
//! Ensemble ──► Forest (checked, whole thresholds) ──► Axes (ranks) ──► units ──► layout ──► bytes
//!                                        └──────────► cells: the worst error of a margin
//! ```
//!
//! [`compile`] does all of it; [`CompiledModel`] is a compiled model read from a file.
//!
//! ```
//! use palpate_trees::compile::{self, compile};
//! use palpate_trees::ensemble::{Ensemble, Node, Origin, Output, Tree};
//! use palpate_shared::{Descriptor, Touch};
//!
//! # fn main() -> palpate_trees::Result<()> {
//! // One split at a curvature of 50 ms: flatter is a bowl, more curved a fork.
//! let nodes = vec![
//!     Node::Split { feature: 0, threshold: 50_000.0, missing_left: true, left: 1, right: 2 },
//!     Node::Leaf(vec![0.5, -0.5]),
//!     Node::Leaf(vec![-0.5, 0.5]),
//! ];
//! let ensemble = Ensemble {
//!     inputs: Descriptor::Curvature.into(),
//!     objects: vec!["bowl".into(), "fork".into()],
//!     base_margins: vec![0.0; 2],
//!     trees: vec![Tree { nodes, output: Output::Each }],
//!     origin: Origin::default(),
//! };
//! let compiled = compile(&ensemble, &compile::Settings::default())?;
//! let model = compile::open(&compiled.bytes)?;
//! let mut margins = [0; 2];
//! model.margins(&Touch::from_micros([0, 0, 80_000]), &mut margins);
//! assert!(margins[1] > margins[0]);
//! # Ok(())
//! # }
//! ```

mod axes;
mod budget;
mod cells;
mod cost;
mod emit;
mod error;
mod forest;
mod groups;
mod layout;
mod model;
mod parts;
mod quantize;
mod range;
mod restate;
mod rounding;
mod share;
mod table;
#[cfg(test)]
mod tests;
mod trees;
mod write;

pub use budget::compile_within;
pub use cost::{Core, Instructions, Memory};
pub use emit::{Language, emit};
pub use error::CompileProblem;
pub use groups::leaves_of_trees;
pub use model::{CompiledModel, longest_time, names, open};
pub use palpate_shared::format::{Layout, LeafType as Leaf};
pub use restate::{Restated, RestatedSection, restate};
pub use share::{different_leaves, unshared};

use crate::ensemble::Ensemble;
use crate::error::{Error, Result};
use axes::Axes;
use cells::Cells;
use forest::Forest;
use palpate_onboard::Stopping;
use palpate_shared::format::{TrainedNoise, TrainedProbe};

/// Settings of compilation.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Type that leaves are stored as.
    pub leaf: Leaf,
    /// Layout of the trees; `None` takes the layout that is best for `goal`.
    pub layout: Option<Layout>,
    /// Goal of the choice of a layout, where none is asked for, and of the choice of a table of leaves.
    pub goal: Goal,
    /// True to store equal leaves once, in a table: `Some(true)` wherever that is possible, `None` where that makes a
    /// model smaller, if it is better for `goal`.
    pub shared_leaves: Option<bool>,
    /// The error rate that recognizers stop at unless told otherwise: above 0, below 0.5.
    pub error_rate: f64,
    /// The touches after which they give up.
    pub max_touches: u32,
    /// Prior probability of each object, in any common unit; `None` makes all equal.
    pub priors: Option<Vec<f64>>,
    /// For an ensemble over rows: compares features as whole numbers, each of which is a feature's value times the
    /// feature's scale; `None` compares f32 values.
    pub scales: Option<Vec<f32>>,
    /// For an ensemble over touches: what the model states of them. The crate `palpate` fills it in from the ensemble.
    pub stated: Stated,
}

/// What a model over touches states of the touches that it was trained on; it changes no margin.
#[derive(Clone, Debug, PartialEq)]
pub struct Stated {
    /// Distance between neighboring fingers, in the probe's unit.
    pub spacing: f32,
    /// Speed of an approach, in units per second.
    pub speed: f32,
    /// The probe, where it is known.
    pub probe: Option<TrainedProbe>,
    /// What was added to the touches in training.
    pub noise: Option<TrainedNoise>,
    /// The capture that made the touches: the content of the section [`Tag::Capture`](palpate_shared::format::Tag::Capture).
    pub capture: Option<Vec<u8>>,
}

/// The published probe: a spacing of 1.5, and 10 units per second.
impl Default for Stated {
    fn default() -> Self {
        Self { spacing: 1.5, speed: 10.0, probe: None, noise: None, capture: None }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            leaf: Leaf::I16,
            layout: None,
            goal: Goal::Balanced(Core::M4F),
            shared_leaves: None,
            error_rate: 0.01,
            max_touches: 200,
            priors: None,
            scales: None,
            stated: Stated::default(),
        }
    }
}

impl Settings {
    /// The defaults for a model of touches of this number of objects: leaves of one byte for more than [`MANY`] objects,
    /// where nearly all of a model is leaves, and two bytes for fewer.
    pub fn for_touches(objects: usize) -> Self {
        let leaf = if objects > MANY { Leaf::I8 } else { Leaf::I16 };
        Self { leaf, ..Self::default() }
    }
}

/// Models of more objects than this are usually compiled with leaves of one byte: `docs/measurements/growth.md`
/// has what that saves and what it costs.
pub const MANY: usize = 50;

/// Goal of the choice of a layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// The fewest instructions of those layouts that have at most three times the bytes of the smallest.
    Balanced(Core),
    /// The fewest instructions.
    Speed,
    /// The fewest bytes.
    Size,
}

/// Properties of a layout.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Candidate {
    /// The layout.
    #[serde(serialize_with = "name_of")]
    pub layout: Layout,
    /// True if equal leaves are stored once.
    pub shared_leaves: bool,
    /// Bytes of the model.
    pub bytes: usize,
    /// About how many instructions a touch takes.
    pub instructions: Instructions,
    /// The farthest that a margin can be from the ensemble's, in nats.
    pub margin_error: f32,
}

fn name_of<S: serde::Serializer>(layout: &Layout, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(layout.name())
}

/// Result of [`compile`].
#[derive(Clone, Debug, PartialEq)]
pub struct Compiled {
    /// Bytes of the model, as the chip reads them.
    pub bytes: Vec<u8>,
    /// Splits of the ensemble.
    pub splits: usize,
    /// Leaves of the ensemble.
    pub leaves: usize,
    /// The farthest that a margin can be from the ensemble's, and from that of the library that trained it: in nats, or
    /// the value's own unit.
    pub margin_error: f32,
    /// Layout of the trees.
    pub layout: Layout,
    /// Number of different leaves in the table, if equal ones are stored once.
    pub shared_leaves: Option<usize>,
    /// About how many instructions a touch takes.
    pub instructions: Instructions,
    /// All layouts that were tried.
    pub candidates: Vec<Candidate>,
}

/// When recognizers stop.
///
/// # Errors
/// [`Setting`](crate::error::Setting) `error_rate` or `max_touches`, whichever is out of its range.
pub fn stopping(error_rate: f64, max_touches: u32) -> Result<Stopping> {
    if max_touches == 0 {
        return Err(Error::setting("max_touches", 0, "at least 1"));
    }
    Stopping::new(error_rate, max_touches)
        .ok_or_else(|| Error::setting("error_rate", error_rate, "a number of at least 1e-15 and below 0.5"))
}

/// Compiles an ensemble. The model states the probe of the settings.
///
/// # Errors
/// [`CompileProblem`] for an ensemble that contradicts itself, has leaves that are not finite or too large, thresholds
/// that fall together when rounded to whole numbers, more of something than the format can count, or that does not fit
/// the layout asked for; [`Setting`](crate::error::Setting) for settings out of their ranges.
pub fn compile(ensemble: &Ensemble, settings: &Settings) -> Result<Compiled> {
    let original = ensemble;
    let ensemble = &*range::scaled(ensemble);
    let stopping = stopping(settings.error_rate, settings.max_touches)?;
    let forest = Forest::new(ensemble, settings.scales.as_deref())?;
    write::check_sentinel(ensemble, settings)?;
    let axes = Axes::new(&forest);
    let cells = Cells::new(&forest);
    let made =
        layout::candidates(&forest, &axes, cells.as_ref(), settings.leaf, settings.layout, settings.shared_leaves)?;
    let overhead = write::overhead(ensemble, settings, &forest)?;
    let candidate = |(layout, parts): &(Layout, parts::Parts)| Candidate {
        layout: *layout,
        shared_leaves: parts.shared.is_some(),
        bytes: parts.bytes() + overhead,
        instructions: parts.instructions,
        margin_error: rounding::round_up(f64::from(parts.margin_error) * f64::from(ensemble.prediction().scale)),
    };
    let candidates: Vec<Candidate> = made.iter().map(candidate).collect();
    let chosen = chosen(&candidates, settings.goal);
    let Some((layout, mut parts)) = chosen.and_then(|chosen| made.into_iter().nth(chosen)) else {
        return Err(CompileProblem::FitsNoLayout.into());
    };
    let instructions = parts.instructions;
    let rounding = ensemble.origin.imported.as_ref().map_or(0.0, |imported| imported.rounding);
    let scale = f64::from(ensemble.prediction().scale);
    parts.margin_error = rounding::round_up(f64::from(parts.margin_error) + rounding / scale);
    let bytes = write::write(ensemble, write::hash(original), settings, &forest, stopping, layout, &parts)?;
    let (splits, leaves) = (forest.splits(), forest.leaves());
    let shared_leaves = open(&bytes).ok().and_then(|model| different_leaves(&model));
    let margin_error = rounding::round_up(f64::from(parts.margin_error) * scale);
    Ok(Compiled { bytes, splits, leaves, margin_error, layout, shared_leaves, instructions, candidates })
}

/// The best of the candidates.
fn chosen(candidates: &[Candidate], goal: Goal) -> Option<usize> {
    // Where some layout holds the ensemble's very numbers, none that rounds them is worth a few bytes.
    let is_exact = candidates.iter().any(|candidate| candidate.margin_error == 0.0);
    let eligible = || {
        let all = candidates.iter().enumerate();
        all.filter(move |(_, candidate)| !is_exact || candidate.margin_error == 0.0)
    };
    let smallest = eligible().map(|(_, candidate)| candidate.bytes).min()?;
    let instructions =
        |candidate: &Candidate, core: Core| candidate.instructions.on(core).unwrap_or(candidate.instructions.m4f);
    let best = match goal {
        Goal::Size => eligible().min_by_key(|(_, candidate)| (candidate.bytes, candidate.instructions.m4f)),
        Goal::Speed => eligible().min_by_key(|(_, candidate)| (candidate.instructions.m4f, candidate.bytes)),
        Goal::Balanced(core) => eligible()
            .filter(|(_, candidate)| candidate.bytes <= 3 * smallest)
            .min_by_key(|(_, candidate)| (instructions(candidate, core), candidate.bytes)),
    };
    best.map(|(index, _)| index)
}

/// The ensemble's trees in the order in which a model with such leaves has them.
pub fn order_of_trees(ensemble: &Ensemble, leaf: Leaf) -> Result<Vec<usize>> {
    let ensemble = range::scaled(ensemble);
    let forest = Forest::new(&ensemble, None)?;
    let scale = quantize::Scale::for_trees(&forest, leaf).ok_or(CompileProblem::FitsNoLayout)?;
    Ok(trees::order(&forest, leaf, &scale))
}
