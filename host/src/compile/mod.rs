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
//! use palpate::compile::{self, compile};
//! use palpate::ensemble::{Ensemble, Node, Origin, Output, Tree};
//! use palpate_shared::{Descriptor, Touch};
//!
//! # fn main() -> palpate::Result<()> {
//! // One split at a curvature of 50 ms: flatter is a bowl, more curved a fork.
//! let nodes = vec![
//!     Node::Split { feature: 0, threshold: 50_000.0, missing_left: true, left: 1, right: 2 },
//!     Node::Leaf(vec![0.5, -0.5]),
//!     Node::Leaf(vec![-0.5, 0.5]),
//! ];
//! let ensemble = Ensemble {
//!     descriptor: Descriptor::Curvature,
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
mod cells;
mod cost;
mod forest;
mod layout;
mod model;
mod parts;
mod quantize;
mod restate;
mod rounding;
mod table;
#[cfg(test)]
mod tests;
mod trees;
mod write;

pub use cost::{Core, Instructions, Memory};
pub use model::{CompiledModel, longest_time, names, open};
pub use palpate_shared::format::{Layout, LeafType as Leaf};
pub use restate::{Restated, restate};

use crate::ensemble::Ensemble;
use crate::error::{CompileProblem, Error, Result};
use axes::Axes;
use cells::Cells;
use forest::Forest;
use palpate_onboard::Stopping;

/// How to compile an ensemble.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What leaves are stored as.
    pub leaf: Leaf,
    /// How trees are laid out; `None` takes the layout with the least bytes² × instructions: a
    /// table that is many times faster may be a few times larger.
    pub layout: Option<Layout>,
    /// The error rate that recognizers stop at unless told otherwise: above 0, below 0.5.
    pub error_rate: f64,
    /// The touches after which they give up.
    pub max_touches: u32,
    /// How likely each object is before any touch, in any common unit; `None` makes all equal.
    pub priors: Option<Vec<f64>>,
    /// Compiles an ensemble over rows of this many f32 features instead of touches, whatever the ensemble's descriptor.
    pub raw_features: Option<usize>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { leaf: Leaf::I16, layout: None, error_rate: 0.01, max_touches: 200, priors: None, raw_features: None }
    }
}

/// What [`compile`] made.
#[derive(Clone, Debug, PartialEq)]
pub struct Compiled {
    /// What the chip reads.
    pub bytes: Vec<u8>,
    /// Splits of the ensemble.
    pub splits: usize,
    /// Leaves of the ensemble.
    pub leaves: usize,
    /// The farthest that a margin of a touch can be from the ensemble's, in nats.
    pub margin_error: f32,
    /// How the trees are laid out.
    pub layout: Layout,
    /// About how many instructions a touch takes.
    pub instructions: Instructions,
}

/// When recognizers stop.
///
/// # Errors
/// [`Problem::Setting`](crate::error::Problem::Setting) `error_rate` or `max_touches`, whichever is out of its range.
pub fn stopping(error_rate: f64, max_touches: u32) -> Result<Stopping> {
    if max_touches == 0 {
        return Err(Error::setting("max_touches", 0, "at least 1"));
    }
    Stopping::new(error_rate, max_touches)
        .ok_or_else(|| Error::setting("error_rate", error_rate, "a number of at least 1e-15 and below 0.5"))
}

/// Compiles an ensemble. The model states the ensemble's own probe, or the published one where the ensemble states none.
///
/// # Errors
/// [`CompileProblem`] for an ensemble that contradicts itself, has leaves that are not finite or too large, thresholds
/// that fall together when rounded to whole numbers, more of something than the format can count, or that does not fit
/// the layout asked for; [`Problem::Setting`](crate::error::Problem::Setting) for settings out of their ranges.
pub fn compile(ensemble: &Ensemble, settings: &Settings) -> Result<Compiled> {
    let stopping = stopping(settings.error_rate, settings.max_touches)?;
    let forest = Forest::new(ensemble, settings.raw_features)?;
    let axes = Axes::new(&forest);
    let cells = Cells::new(&forest);
    let mut candidates = layout::candidates(&forest, &axes, cells.as_ref(), settings.leaf, settings.layout)?;
    // Where some layout holds the ensemble's very numbers, none that rounds them is worth a few bytes.
    if candidates.iter().any(|(_, parts)| parts.margin_error == 0.0) {
        candidates.retain(|(_, parts)| parts.margin_error == 0.0);
    }
    let mut best: Option<(u128, Layout, parts::Parts)> = None;
    for (layout, parts) in candidates {
        let bytes = parts.bytes() as u128;
        let cost = bytes * bytes * u128::from(parts.instructions.m4f);
        if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
            best = Some((cost, layout, parts));
        }
    }
    let Some((_, layout, parts)) = best else {
        return Err(CompileProblem::FitsNoLayout.into());
    };
    let (margin_error, instructions) = (parts.margin_error, parts.instructions);
    let bytes = write::write(ensemble, settings, &forest, stopping, layout, &parts)?;
    Ok(Compiled { bytes, splits: forest.splits(), leaves: forest.leaves(), margin_error, layout, instructions })
}
