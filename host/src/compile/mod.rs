//! From an ensemble to the bytes that the chip reads.
//!
//! ```text
//! Ensemble ──► Forest (checked, whole thresholds) ──► Axes (ranks) ──► units ──► layout ──► bytes
//!                                        └──────────► cells: the worst error of a margin
//! ```

mod axes;
mod cells;
mod cost;
mod file;
mod forest;
mod layout;
mod quantize;
mod write;

pub use file::CompiledFile;
pub use palpate_shared::format::{Layout, LeafType as Leaf};

use crate::ensemble::Ensemble;
use crate::error::{Error, Result};
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
    /// The distance between fingers that the model was trained for, in lengths of the scene.
    pub spacing: f32,
    /// The probe's speed that the model was trained for, in lengths of the scene a second.
    pub speed: f32,
    /// Compiles an ensemble over rows of f32 features instead of touches: so many features, whatever the ensemble's
    /// descriptor.
    pub raw_features: Option<usize>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            leaf: Leaf::I16,
            layout: None,
            error_rate: 0.01,
            max_touches: 200,
            priors: None,
            spacing: 1.5,
            speed: 10.0,
            raw_features: None,
        }
    }
}

/// A compiled model.
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
    /// About how many instructions a touch takes on a Cortex-M4F, by a model of the evaluator that the firmware's
    /// `evaluator` holds against what it counts: right to 15 %.
    pub instructions: u64,
}

/// Compiles an ensemble.
///
/// # Errors
/// [`Error::Data`] for an ensemble that contradicts itself, has leaves that are not finite or too large, or more of
/// something than the format can count; [`Error::Argument`] for settings that do not fit it.
pub fn compile(ensemble: &Ensemble, settings: &Settings) -> Result<Compiled> {
    let stopping = Stopping::new(settings.error_rate, settings.max_touches).ok_or_else(|| {
        Error::argument(
            format!("an error rate of {} after at most {} touches", settings.error_rate, settings.max_touches),
            "Give an error rate between 1e-15 and 0.5, and at least one touch.",
        )
    })?;
    let forest = Forest::new(ensemble, settings.raw_features)?;
    let axes = Axes::new(&forest);
    let cells = Cells::new(&forest);
    let mut candidates = layout::candidates(&forest, &axes, cells.as_ref(), settings.leaf, settings.layout)?;
    // Where some layout holds the ensemble's very numbers, none that rounds them is worth a few bytes.
    if candidates.iter().any(|(_, parts)| parts.margin_error == 0.0) {
        candidates.retain(|(_, parts)| parts.margin_error == 0.0);
    }
    let mut best: Option<(u128, Layout, layout::Parts)> = None;
    for (layout, parts) in candidates {
        let bytes = parts.bytes() as u128;
        let cost = bytes * bytes * u128::from(parts.instructions);
        if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
            best = Some((cost, layout, parts));
        }
    }
    let Some((_, layout, parts)) = best else {
        return Err(Error::data(
            "the ensemble fits no layout of the model format",
            "Train fewer trees, or trees with fewer splits.",
        ));
    };
    let (margin_error, instructions) = (parts.margin_error, parts.instructions);
    let bytes = write::write(ensemble, settings, &forest, stopping, layout, &parts)?;
    Ok(Compiled { bytes, splits: forest.splits(), leaves: forest.leaves(), margin_error, layout, instructions })
}
