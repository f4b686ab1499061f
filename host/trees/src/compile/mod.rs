//! From an ensemble to the bytes that the chip reads.
//!
//! ```text
//! Ensemble ──► Forest (checked, whole thresholds) ──► Lowered (merged trees, units, ranks, order) ──► bytes, or code
//!                                        └──────────► cells: the worst error of a margin
//! ```
//!
//! [`compile`] does all of it; [`CompiledModel`] is a compiled model read from a file.
//!
//! ```
//! use palpate_trees::compile::{self, compile};
//! use palpate_trees::ensemble::{Ensemble, Inputs, Node, Provenance, Output, Tree};
//! use palpate_trees::rows::Encoder;
//!
//! # fn main() -> palpate_trees::Result<()> {
//! // One split: narrow things are forks, wide ones bowls.
//! let nodes = vec![
//!     Node::Split { feature: 0, threshold: 50.0, missing_left: true, left: 1, right: 2 },
//!     Node::Leaf(vec![-0.5, 0.5]),
//!     Node::Leaf(vec![0.5, -0.5]),
//! ];
//! let ensemble = Ensemble {
//!     inputs: Inputs::Rows(vec!["width".into()]),
//!     objects: vec!["bowl".into(), "fork".into()],
//!     base_margins: vec![0.0; 2],
//!     trees: vec![Tree { nodes, output: Output::Each }],
//!     origin: Provenance::default(),
//! };
//! let compiled = compile(&ensemble, &compile::Settings::default())?;
//! let model = compile::open(&compiled.bytes)?;
//! let mut margins = [0; 2];
//! model.margins_of(&Encoder::of(&model).row(&[80.0]), &mut margins);
//! assert!(margins[0] > margins[1]);
//! # Ok(())
//! # }
//! ```

mod axes;
mod budget;
mod calls;
mod cells;
pub(crate) mod code;
mod container;
mod cost;
mod emit;
mod forest;
mod legend;
mod lower;
mod lowered;
mod merge;
mod model;
mod notes;
mod parts;
mod quantize;
mod range;
mod restate;
mod rounding;
mod share;
mod trees;
mod write;

pub use budget::compile_within;
pub use container::{OwnedSection, file};
pub use cost::{Core, Instructions, Memory, code_flash, features};
pub use emit::{HEADER, Language, NO_CODE, check_place, emit, identifier, write_sources};
pub use legend::label_numbers;
pub(crate) use merge::Source;
pub(crate) use model::bound_of;
pub use model::{CompiledModel, names, open, thresholds};
pub use palpate_shared::format::{Layout, LeafType as Leaf};
pub use restate::{Restated, RestatedSection, restate, restated_file};
pub use share::different_leaves;

use crate::ensemble::{Ensemble, Probability};
use crate::error::{Error, Result, problem};
use cells::Cells;
use code::{Program, Statements};
use forest::Forest;
use lowered::Lowered;
use palpate_onboard::Stopping;
use parts::Parts;
use range::Held;
use std::collections::BTreeMap;

/// Settings of compilation.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Type that leaves are stored as.
    pub leaf: Leaf,
    /// The error rate that recognizers stop at unless told otherwise: above 0, below 0.5.
    pub error_rate: f64,
    /// Steps after which they give up.
    pub max_touches: u32,
    /// Prior probability of each object, in any common unit; `None` makes all equal.
    pub priors: Option<Vec<f64>>,
    /// True if the trees become code, in C or Rust: the model has no trees then.
    pub code: bool,
    /// For an ensemble over rows: compares features as whole numbers, each of which is a feature's value times the
    /// feature's scale; `None` compares f32 values.
    pub scales: Option<Vec<f32>>,
    /// For classes of rows: the feature, by name, that is the number of a row in its sequence, counted from 1. Recognizers
    /// count it themselves.
    pub position: Option<String>,
    /// Statements of whoever defines the features. The crate `palpate` fills them in from the ensemble.
    pub stated: Stated,
}

/// Statements that a model carries and no tree depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct Stated {
    /// The header's spacing.
    pub spacing: f32,
    /// The header's speed.
    pub speed: f32,
    /// Optional sections.
    pub sections: Vec<OwnedSection>,
}

/// A spacing of 1.5, and a speed of 10.
impl Default for Stated {
    fn default() -> Self {
        Self { spacing: 1.5, speed: 10.0, sections: Vec::new() }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            leaf: Leaf::I16,
            error_rate: 0.01,
            max_touches: 200,
            priors: None,
            code: false,
            scales: None,
            position: None,
            stated: Stated::default(),
        }
    }
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
    /// About how many instructions the margins take.
    pub instructions: Instructions,
    /// The trees as code, if that was asked for: the bytes are a model without trees then.
    pub code: Option<Program>,
    /// Rule that turns margins into the probabilities of the library that trained it.
    pub probability: Probability,
    /// Notes for the user on how close a regression's values are to the library's, each a sentence.
    pub notes: Vec<String>,
    /// Categories of the library's columns, by the numbers that stand for them, as far as they are known.
    pub categories: BTreeMap<usize, Vec<String>>,
}

/// When recognizers stop.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) `error_rate` or `max_touches`, whichever is out of its range.
pub fn stopping(error_rate: f64, max_touches: u32) -> Result<Stopping> {
    if max_touches == 0 {
        return Err(Error::setting("max_touches", 0, "at least 1"));
    }
    Stopping::new(error_rate, max_touches)
        .ok_or_else(|| Error::setting("error_rate", error_rate, "a number of at least 1e-15 and below 0.5"))
}

/// Compiles an ensemble.
///
/// # Errors
/// For an ensemble that contradicts itself, has leaves that are not finite or too large, thresholds
/// that fall together when rounded to whole numbers, more of something than the format can count, or that no code can be
/// written of, if that is asked for; [`Kind::Setting`](crate::error::Kind::Setting) for settings out of their ranges.
pub fn compile(ensemble: &Ensemble, settings: &Settings) -> Result<Compiled> {
    let original = ensemble;
    let Held { ensemble, scales, rounding } = range::held(ensemble, settings.leaf);
    let ensemble = &*ensemble;
    let stopping = stopping(settings.error_rate, settings.max_touches)?;
    let forest = Forest::new(ensemble, settings.scales.as_deref())?;
    write::check_sentinel(ensemble, settings)?;
    let lowered = lowered(&forest, settings.leaf)?;
    let cells = Cells::new(&forest);
    let trees_error = rounding::margin_error(&forest, cells.as_ref(), settings.leaf, &lowered.rounding);
    let scale = f64::from(ensemble.prediction().scale);
    let margin_error = rounding::round_up(f64::from(trees_error) + rounding);
    let (layout, parts, code) = if settings.code {
        let program = Program::new(&lowered, &stated(ensemble, settings)).ok_or_else(|| {
            problem!(
                "the ensemble cannot become code: its leaves are f32 or beyond two bytes, or it has more thresholds than 256 \
                 columns hold"
            )
            .fix("Choose leaves of i16 or i8, or a model with its trees.")
        })?;
        let parts = Parts { base: vec![0; forest.objects()], unit: lowered.scale.unit, ..Parts::default() };
        (Layout::Code, parts, Some(program))
    } else {
        let layout = lowered.layout()?;
        (layout, lowered.write(layout), None)
    };
    let parts = Parts { margin_error, scales, ..parts };
    let bytes = write::write(ensemble, write::hash(original), settings, &forest, stopping, layout, &parts)?;
    let model = model::open_any(&bytes)?;
    let imported = original.origin.imported.as_ref();
    Ok(Compiled {
        splits: forest.splits(),
        leaves: forest.leaves(),
        margin_error: rounding::round_up(f64::from(margin_error) * scale),
        layout,
        shared_leaves: different_leaves(&model),
        instructions: code.as_ref().map_or_else(|| Instructions::of_model(&model), Program::instructions),
        code,
        probability: imported.map(|imported| imported.probability).unwrap_or_default(),
        categories: imported.map(|imported| imported.categories.clone()).unwrap_or_default(),
        notes: notes::of_values(original, &model, settings.leaf, [rounding, trees_error.into()]),
        bytes,
    })
}

/// A forest lowered for leaves of one type.
fn lowered<'f>(forest: &Forest<'f>, leaf: Leaf) -> Result<Lowered<'f>> {
    Lowered::new(forest, leaf).ok_or_else(|| {
        let (trees, leaf) = (forest.trees.len(), leaf.name());
        problem!("margins of {trees} trees are too large for sums of {leaf} leaves")
            .fix("Choose leaves of f32, or train fewer trees.")
    })
}

/// Statements of the model that code depends on.
fn stated(ensemble: &Ensemble, settings: &Settings) -> Statements {
    Statements {
        sentinel: write::sentinel(ensemble, settings),
        known: ensemble.known_count(),
        last_of_ties: ensemble.prediction().last_of_ties,
    }
}

/// Trees of the ensemble that each tree of a model with such leaves stands for, in the model's order. `scales` are those of
/// features of rows that are whole numbers.
pub(crate) fn order(ensemble: &Ensemble, leaf: Leaf, scales: Option<&[f32]>) -> Result<Vec<Source>> {
    let ensemble = range::held(ensemble, leaf).ensemble;
    let forest = Forest::new(&ensemble, scales.filter(|_| ensemble.schema().is_none()))?;
    Ok(lowered(&forest, leaf)?.order())
}
