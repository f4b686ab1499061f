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
//! use palpate_trees::ensemble::{Ensemble, Node, Provenance, Output, Tree};
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
//!     origin: Provenance::default(),
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
pub mod code;
mod cost;
mod early;
mod emit;
mod error;
mod forest;
mod groups;
mod layout;
mod merge;
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
pub use early::{EarlyExit, EarlyExitFound};
pub use emit::{Language, emit, emit_code};
pub use error::CompileProblem;
pub use groups::{ends_of_walks, leaves_of_trees};
pub use merge::Source;
pub use model::{CompiledModel, longest_time, names, open, open_with_code};
pub use palpate_shared::format::{Layout, LeafType as Leaf};
pub use restate::{Restated, RestatedSection, restate};
pub use share::{different_leaves, unshared};

use crate::ensemble::Ensemble;
use crate::error::{Error, Result};
use cells::Cells;
use code::{Form, Program, Statements};
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
    /// Forms of code that may be chosen beside the layouts of data; of one that is chosen the model has no trees.
    pub forms: Vec<Form>,
    /// For an ensemble over rows: compares features as whole numbers, each of which is a feature's value times the
    /// feature's scale; `None` compares f32 values.
    pub scales: Option<Vec<f32>>,
    /// For classes of rows: walks for a class alone end where the class is known. Nothing else changes.
    pub early_exit: Option<EarlyExit>,
    /// For an ensemble over touches: what the model states of them. The crate `palpate` fills it in from the ensemble.
    pub stated: Stated,
}

/// Statements of a model over touches about the touches that it was trained on; it changes no margin.
#[derive(Clone, Debug, PartialEq)]
pub struct Stated {
    /// Distance between neighboring fingers, in the probe's unit.
    pub spacing: f32,
    /// Speed of an approach, in units per second.
    pub speed: f32,
    /// The probe, where it is known.
    pub probe: Option<TrainedProbe>,
    /// Noise added to the touches in training.
    pub noise: Option<TrainedNoise>,
    /// The capture that made the touches: the content of the section [`Tag::Capture`](palpate_shared::format::Tag::Capture).
    pub capture: Option<Vec<u8>>,
    /// For each output the number of its object, and its share of the object's prior, where several belong to one: the content
    /// of the section [`Tag::Outputs`](palpate_shared::format::Tag::Outputs).
    pub outputs: Option<Vec<(u8, f64)>>,
}

/// The published probe: a spacing of 1.5, and 10 units per second.
impl Default for Stated {
    fn default() -> Self {
        Self { spacing: 1.5, speed: 10.0, probe: None, noise: None, capture: None, outputs: None }
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
            forms: Vec::new(),
            scales: None,
            early_exit: None,
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
    /// The form of code, of the layout code.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub form: Option<&'static str>,
    /// True if equal leaves are stored once.
    pub shared_leaves: bool,
    /// Bytes of the model, and of the code beside it.
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
    /// The trees as code, and its form, if that was chosen: the bytes are a model without trees then.
    pub code: Option<(Program, Form)>,
    /// Places where a walk for a class alone may end, if that was asked for.
    pub early_exit: Option<EarlyExitFound>,
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
    check_early_exit(ensemble, settings)?;
    write::check_sentinel(ensemble, settings)?;
    let cells = Cells::new(&forest);
    let wants_code = settings.layout == Some(Layout::Code);
    let made = if wants_code {
        Vec::new()
    } else {
        layout::candidates(&forest, cells.as_ref(), settings.leaf, settings.layout, settings.shared_leaves)?
    };
    let may_be_code = !settings.forms.is_empty() && (wants_code || settings.layout.is_none());
    let code = if may_be_code {
        layout::code(&forest, cells.as_ref(), settings.leaf, &stated(ensemble, settings))
    } else {
        None
    };
    let overhead = write::overhead(ensemble, settings, &forest)?;
    let scale = f64::from(ensemble.prediction().scale);
    let candidate = |layout: Layout, parts: &parts::Parts| Candidate {
        layout,
        form: None,
        shared_leaves: parts.shared.is_some(),
        bytes: parts.bytes() + overhead,
        instructions: parts.instructions,
        margin_error: rounding::round_up(f64::from(parts.margin_error) * scale),
    };
    let mut candidates: Vec<Candidate> = made.iter().map(|(layout, parts)| candidate(*layout, parts)).collect();
    if let Some((program, parts)) = &code {
        candidates.extend(settings.forms.iter().map(|&form| {
            let cost = program.cost(form);
            let model = candidate(Layout::Code, parts);
            let bytes = model.bytes + cost.bytes;
            Candidate { form: Some(form.name()), bytes, instructions: cost.instructions, ..model }
        }));
    }
    let Some(chosen) = chosen(&candidates, settings.goal) else {
        return Err(match wants_code {
            true => CompileProblem::DoesNotFit { layout: Layout::Code }.into(),
            false => CompileProblem::FitsNoLayout.into(),
        });
    };
    let mut instructions = candidates[chosen].instructions;
    let form = settings.forms.iter().copied().find(|form| Some(form.name()) == candidates[chosen].form);
    let (layout, mut parts, code) = match (code.zip(form), made.into_iter().nth(chosen)) {
        (Some(((program, parts), form)), _) => (Layout::Code, parts, Some((program, form))),
        (None, Some((layout, parts))) => (layout, parts, None),
        (None, None) => return Err(CompileProblem::FitsNoLayout.into()),
    };
    let (mut code, mut early_exit) = (code, None);
    if let Some(wanted) = &settings.early_exit {
        let features = (settings.scales.as_deref(), write::sentinel(ensemble, settings));
        if let Some((program, form)) = code {
            let (program, found) =
                layout::code_with_early_exit(&forest, settings.leaf, (program, form), wanted, features);
            instructions = program.cost(form).instructions;
            (code, early_exit) = (Some((program, form)), found);
        } else if let Some((planned, found)) =
            layout::with_early_exit(&forest, settings.leaf, layout, &parts, wanted, features)
        {
            // Groups of their own cost bytes only where they are used.
            if !planned.exits.is_empty() {
                (parts, instructions) = (planned.clone(), planned.instructions);
            }
            early_exit = Some(found);
        }
        early_exit = Some(early_exit.unwrap_or_default());
    }
    let rounding = ensemble.origin.imported.as_ref().map_or(0.0, |imported| imported.rounding);
    parts.margin_error = rounding::round_up(f64::from(parts.margin_error) + rounding / scale);
    let bytes = write::write(ensemble, write::hash(original), settings, &forest, stopping, layout, &parts)?;
    let (splits, leaves) = (forest.splits(), forest.leaves());
    let shared_leaves = open(&bytes).ok().and_then(|model| different_leaves(&model));
    let margin_error = rounding::round_up(f64::from(parts.margin_error) * scale);
    Ok(Compiled {
        bytes,
        splits,
        leaves,
        margin_error,
        layout,
        shared_leaves,
        instructions,
        candidates,
        code,
        early_exit,
    })
}

/// Returns an error where a walk may not end early.
fn check_early_exit(ensemble: &Ensemble, settings: &Settings) -> Result<()> {
    let why = if settings.early_exit.is_none() {
        return Ok(());
    } else if ensemble.descriptor().is_some() {
        "none with a model of touches, whose recognizer takes all margins"
    } else if ensemble.objects.len() < 2 {
        "none with a model of one output, which has no class"
    } else if settings.leaf == Leaf::F32 {
        "leaves of i8 or i16 with it: sums of f32 depend on their order"
    } else {
        return Ok(());
    };
    Err(Error::setting("early_exit", "given", why))
}

/// Statements of the model that code depends on.
fn stated(ensemble: &Ensemble, settings: &Settings) -> Statements {
    Statements {
        sentinel: write::sentinel(ensemble, settings),
        known: ensemble.known_count(),
        last_of_ties: ensemble.prediction().last_of_ties,
    }
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

/// The trees of a model with such leaves, in its order, and which trees of the ensemble each stands for. `ends` are the
/// numbers of trees after which a walk may end.
///
/// # Errors
/// As [`compile`].
pub fn order_of_trees(ensemble: &Ensemble, leaf: Leaf, ends: &[usize]) -> Result<Vec<Source>> {
    let ensemble = range::scaled(ensemble);
    let forest = Forest::new(&ensemble, None)?;
    let scale = quantize::Scale::for_trees(&forest, leaf).ok_or(CompileProblem::FitsNoLayout)?;
    let parts = |forest: &Forest<'_>, scale: &quantize::Scale| match ends {
        [] => Vec::new(),
        _ => early::parts(&early::order(forest, scale), ends.iter().copied()),
    };
    Ok(match merge::merge(&forest, leaf, &scale) {
        Some(merged) => {
            let parts = parts(&merged.forest, &merged.scale);
            let order = trees::order(&merged.forest, leaf, &merged.scale, &parts);
            order.into_iter().map(|tree| merged.sources[tree].clone()).collect()
        }
        None => trees::order(&forest, leaf, &scale, &parts(&forest, &scale)).into_iter().map(Source::of).collect(),
    })
}

/// The trees of code with such leaves, in the order in which assembly has them, and which trees of the ensemble each stands for.
/// `ends` are the numbers of trees after which a walk may end; `is_m4f` says for which processor it is.
///
/// # Errors
/// As [`compile`].
pub fn order_of_code(ensemble: &Ensemble, leaf: Leaf, ends: &[usize], is_m4f: bool) -> Result<Vec<Source>> {
    let ensemble = range::scaled(ensemble);
    let forest = Forest::new(&ensemble, None)?;
    let scale = quantize::Scale::for_trees(&forest, leaf).ok_or(CompileProblem::FitsNoLayout)?;
    let merged = merge::merge(&forest, leaf, &scale);
    let (forest, scale) = merged.as_ref().map_or((&forest, &scale), |merged| (&merged.forest, &merged.scale));
    let stated = Statements { sentinel: None, known: forest.objects(), last_of_ties: false };
    let program = Program::new(forest, scale, vec![0; forest.objects()], &stated);
    let program = program.ok_or(CompileProblem::DoesNotFit { layout: Layout::Code })?;
    let (order, program) = match ends {
        [] => ((0..forest.trees.len()).collect(), program),
        _ => {
            let order = early::order(forest, scale);
            let program = program.with_exits(&order, ends.iter().map(|&end| (end, 0)).collect());
            (order, program)
        }
    };
    let source = |(tree, zero): (usize, i32)| {
        let tree = order[tree];
        let source = merged.as_ref().map_or_else(|| Source::of(tree), |merged| merged.sources[tree].clone());
        Source { offset: source.offset + (zero >> scale.shifts[tree]), ..source }
    };
    let chip = if is_m4f { code::Chip::M4F } else { code::Chip::M0Plus };
    Ok(program.in_assembly(chip).into_iter().map(source).collect())
}
