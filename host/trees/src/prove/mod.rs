//! Proofs that a compiled model means what its ensemble means, for every row: any key of every feature, missing,
//! infinite, negative zero and subnormal values among them.
//!
//! The proof has its own reader of models, written from the format's description alone. Each tree of the model is followed
//! together with the trees of the ensemble that it replaces, over boxes of rows, until each box reaches one leaf of each:
//! the leaves must be equal, or one apart by the rounding of the leaf. That takes time in proportion to the leaves. What the
//! trees' worst leaves add up to bounds the error and the range of each margin. One row of each box also goes through the
//! chip's own code, whose margins must be those of the leaves.
//!
//! Which trees were merged is taken from the compiler, and not trusted: another answer is refused.
//!
//! Not proved: anything outside the ensemble, such as priors and thresholds for stopping; and that the chip executes its code.

mod boxes;
mod cells;
mod format;
mod numbers;
mod span;
mod trees;

use crate::compile::{self, Instructions, Source};
use crate::ensemble::{Ensemble, Inputs};
use crate::error::{Error, Result, problem};
use crate::rows::{Encoder, missing_text};
use boxes::{Keys, Rows, Tree, Values};
use format::Plain;
use numbers::Numbers;
use palpate_onboard::Model;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{LeafType, Link, f32_key};
use std::fmt::Display;

/// Result of a proof.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Proof {
    /// The model's trees.
    pub trees: usize,
    /// The ensemble's trees.
    pub ensemble_trees: usize,
    /// Boxes of rows that were compared.
    pub boxes: u64,
    /// The largest difference of a leaf, in the library's margins.
    pub largest_difference: f64,
    /// The largest difference of a margin: in any cell between thresholds, where [`prove`] can go through them; otherwise a bound, the sum of the trees' largest differences, without what the library loses by adding in f32.
    pub margin_error: f64,
    /// The difference that the model states, including the library's loss by adding in f32.
    pub stated: f64,
    /// For each output its name, and bounds of its margin.
    pub ranges: Vec<(String, f64, f64)>,
    /// Largest number of splits that a row passes: the sum of the depths of all trees.
    pub splits: usize,
    /// Estimate of the largest number of instructions for a row: see [`Instructions`].
    pub estimated: Instructions,
    /// The links of the model and of the ensemble, if `export --link` set another one: the proof is about margins.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_link: Option<[&'static str; 2]>,
}

/// Findings about a model.
struct Found {
    trees: Vec<Matched>,
    boxes: u64,
    outputs: Vec<[f64; 3]>,
}

/// A tree of a model that was matched with the ensemble's.
struct Matched {
    /// The largest difference of a leaf.
    error: f64,
    /// The ensemble's trees that it replaces.
    sources: Vec<usize>,
}

/// Proves that a model, given by its bytes, adds for every row what `ensemble` adds.
///
/// # Errors
/// If the bytes are no model; if it does not, for which rows.
pub fn prove(bytes: &[u8], ensemble: &Ensemble) -> Result<Proof> {
    let model = compile::open(bytes)?;
    let plain = format::read(bytes)?;
    statements(&plain, ensemble)?;
    let numbers = Numbers::new(&plain, ensemble);
    let (sources, base) = (numbers.trees()?, numbers.base());
    let subject = Subject { model, plain: &plain, sources: &sources, base: &base, ensemble };
    let found = trees::compare(subject, &plain.order(ensemble, model.leaf_type())?)?;
    let mut proof = subject.proof(&found);
    if proof.margin_error > proof.stated
        && let Some(exact) = cells::error_in_cells(subject)?
    {
        // Features that a model computes have fewer values than rows of them.
        if exact > proof.stated * (1.0 + 1e-6) && ensemble.schema().is_none() {
            let stated = proof.stated;
            return Err(problem!(
                "a margin differs by {exact:e} for some row, more than the {stated:e} that the model states"
            )
            .fix(OTHER_FILE));
        }
        proof.margin_error = exact;
    }
    Ok(proof)
}

/// The leaf of a model's tree that a row reaches.
pub(crate) struct Reached {
    /// Trees of the ensemble that the model's tree should replace.
    pub(crate) source: Source,
    /// Size of a step of its leaves.
    pub(crate) step: f64,
    /// Values of the leaf.
    pub(crate) values: Vec<f64>,
    /// Values that the trees of the ensemble add.
    pub(crate) expected: Vec<f64>,
}

/// The leaves of a model's trees that a row of keys reaches; in a tree of the ensemble it reaches `node`.
///
/// # Errors
/// If the bytes cannot be read, or the model has another number of trees than it should.
pub(crate) fn leaves_at(
    model: &Model<'_>,
    ensemble: &Ensemble,
    row: &[i32],
    node: impl Fn(usize) -> usize,
) -> Result<Vec<Reached>> {
    let plain = format::read(model.bytes())?;
    let order = plain.order(ensemble, model.leaf_type())?;
    if order.len() != plain.trees.len() {
        return Err(other_trees(format_args!("{} and not {}", plain.trees.len(), order.len())));
    }
    let numbers = Numbers::new(&plain, ensemble);
    let mut row: Vec<Values> = row.iter().map(|key| plain.values(*key)).collect();
    let mut leaf = |(source, (tree, step)): (Source, &(Tree, f64))| {
        let mut values = Vec::new();
        tree.leaves(&mut row, &mut |leaf, _| {
            values = leaf.to_vec();
            Ok::<(), Error>(())
        })?;
        let mut expected = vec![-f64::from(source.offset) * step; values.len()];
        for &tree in &source.trees {
            let leaf = numbers.leaf(tree, node(tree));
            expected.iter_mut().zip(leaf).for_each(|(sum, value)| *sum += value);
        }
        Ok(Reached { source, step: *step, values, expected })
    };
    order.into_iter().zip(&plain.trees).map(&mut leaf).collect()
}

impl Plain {
    /// A key as values of a feature: those that stand for a missing one are missing.
    fn values(&self, key: i32) -> Values {
        match Values::of(key.into(), key.into(), false) {
            values if key == MISSING_FEATURE || self.is_sentinel(&values) => Values::MISSING,
            values => values,
        }
    }

    /// Margins of a row of keys, from the leaves that it reaches.
    fn margins(&self, row: &[i32]) -> Vec<f64> {
        let row: Vec<Values> = row.iter().map(|key| self.values(*key)).collect();
        let mut margins = self.base.clone();
        for (tree, _) in &self.trees {
            for (value, leaf) in tree.leaf(&row).iter().enumerate() {
                let margin = &mut margins[output_of(tree.object, value)];
                *margin = self.sum(*margin, *leaf);
            }
        }
        margins
    }

    /// The sum of a margin and a leaf: of f32 leaves as f32.
    fn sum(&self, margin: f64, leaf: f64) -> f64 {
        if self.most > 0.0 {
            margin + leaf
        } else {
            f64::from((margin / self.scale) as f32 + (leaf / self.scale) as f32) * self.scale
        }
    }

    /// Trees of the ensemble that each tree of the model should stand for, as the compiler has them.
    fn order(&self, ensemble: &Ensemble, leaf: LeafType) -> Result<Vec<Source>> {
        let scales = if let Keys::Scaled(scales) = &self.keys { Some(scales.as_slice()) } else { None };
        compile::order(ensemble, leaf, scales).map_err(other_trees)
    }
}

/// A model's meaning, and the ensemble that it is compared with.
#[derive(Clone, Copy)]
struct Subject<'s> {
    /// Model that the chip reads.
    model: Model<'s>,
    plain: &'s Plain,
    /// The ensemble's trees, over the model's keys.
    sources: &'s [Tree],
    /// The ensemble's base margins.
    base: &'s [f64],
    ensemble: &'s Ensemble,
}

impl Subject<'_> {
    fn proof(self, found: &Found) -> Proof {
        let Self { plain, ensemble, .. } = self;
        let largest = found.trees.iter().map(|tree| tree.error).fold(0.0, f64::max);
        let range = |(output, (name, &[_, low, high])): (usize, (&String, &[f64; 3]))| {
            let [scale, offset] = plain.scales.get(output).copied().unwrap_or([plain.scale, 0.0]);
            let [low, high] = [low, high].map(|end| end * (scale / plain.scale) + offset);
            (name.clone(), low, high)
        };
        Proof {
            trees: found.trees.len(),
            ensemble_trees: ensemble.trees.len(),
            boxes: found.boxes,
            largest_difference: largest,
            margin_error: found.outputs.iter().map(|[error, ..]| *error).fold(0.0, f64::max),
            stated: plain.stated,
            ranges: plain.names.iter().zip(&found.outputs).enumerate().map(range).collect(),
            splits: plain.trees.iter().map(|(tree, _)| tree.depth()).sum(),
            estimated: Instructions::of_longest_ways(&self.model),
            other_link: self.other_link(),
        }
    }

    /// Margins of a row of keys as the chip computes them.
    fn margins(&self, row: &[i32]) -> Vec<f64> {
        let count = self.plain.names.len();
        if self.plain.most == 0.0 {
            let mut margins = vec![0.0; count];
            self.model.f32_margins_of(row, &mut margins);
            return margins.into_iter().map(|margin| f64::from(margin) * self.plain.scale).collect();
        }
        let mut margins = vec![0; count];
        self.model.margins_of(row, &mut margins);
        margins.into_iter().map(|margin| f64::from(margin) * self.plain.unit).collect()
    }

    /// A row of a box, as keys.
    fn row(&self, rows: &Rows) -> Vec<i32> {
        let key = |values: &Values| {
            let known = self.plain.known(*values);
            let is_missing = known.low > known.high;
            if is_missing { MISSING_FEATURE } else { i32::try_from(known.low).unwrap_or(MISSING_FEATURE) }
        };
        rows.iter().map(key).collect()
    }

    /// Returns an error unless the chip's margins of a row are the sums of the leaves that were read.
    fn agrees(&self, row: &[i32]) -> Result<()> {
        let chip_margins = self.margins(row);
        for (object, (chip, read)) in chip_margins.into_iter().zip(self.plain.margins(row)).enumerate() {
            let is_same =
                if self.plain.most > 0.0 { (chip - read).abs() < 0.25 * self.plain.unit } else { chip == read };
            if !is_same {
                let output = &self.ensemble.objects[object];
                let rows: Vec<Values> = row.iter().map(|key| self.plain.values(*key)).collect();
                return Err(problem!(
                    "the chip's code gives {chip:e} for {output} where the model's leaves add up to {read:e}: {}",
                    self.example(&rows)
                )
                .fix(OTHER_FILE));
            }
        }
        Ok(())
    }

    /// The links of the model and of the ensemble, if they differ.
    fn other_link(self) -> Option<[&'static str; 2]> {
        let of_ensemble = self.ensemble.prediction().link;
        let link = Link::from_code(self.plain.link.0).filter(|link| *link != of_ensemble)?;
        Some([link.name(), of_ensemble.name()])
    }

    /// Rows in words: the features that are bound.
    fn example(self, rows: &Rows) -> String {
        let keys = &self.plain.keys;
        let names = self.ensemble.inputs.names();
        let all = keys.all(rows.len());
        let bound = |rows: &(usize, (&Values, &Values))| rows.1.0 != rows.1.1;
        let text = |(feature, (values, _)): (usize, (&Values, &Values))| {
            let name = names.get(feature).copied().unwrap_or("?");
            if values.low > values.high {
                format!("{name} missing")
            } else {
                format!("{name} from {} to {}", keys.value(feature, values.low), keys.value(feature, values.high))
            }
        };
        let texts: Vec<String> = rows.iter().zip(&all).enumerate().filter(bound).map(text).collect();
        if texts.is_empty() { "all rows".into() } else { texts.join(", ") }
    }
}

/// Advice on a model that is not the ensemble's.
const OTHER_FILE: &str = "Give the file that the model was exported from, with the same --missing and --all-trees; if it is that, export the model again.";

/// Trees of the ensemble that are missing in the model, or too many.
fn other_trees(what: impl Display) -> Error {
    problem!("the model's trees stand for other trees than the ensemble's: {what}").fix(OTHER_FILE)
}

/// The output that a value of a leaf is for, of a tree of one output or of all.
fn output_of(object: Option<usize>, value: usize) -> usize {
    object.unwrap_or(value)
}

/// Returns an error unless names, features and predictions are the ensemble's.
fn statements(plain: &Plain, ensemble: &Ensemble) -> Result<()> {
    let same = |what: &str, model: String, ensemble: String| {
        if model == ensemble {
            return Ok(());
        }
        Err(problem!("the model's {what} are not the ensemble's: {model}, and not {ensemble}").fix(OTHER_FILE))
    };
    // They are matched by position, since `export --names` names them otherwise; the same names in another order are others.
    let sorted = |names: &[String]| {
        let mut sorted = names.to_vec();
        sorted.sort_unstable();
        sorted
    };
    let [model, expected] = [&plain.names, &ensemble.objects];
    if model.len() != expected.len() || (model != expected && sorted(model) == sorted(expected)) {
        same("outputs", model.join(", "), expected.join(", "))?;
    }
    same("features", plain.features.to_string(), ensemble.inputs.count().to_string())?;
    let descriptor = ensemble.schema().map_or(255, |schema| schema.code);
    same("descriptor codes", plain.descriptor.to_string(), descriptor.to_string())?;
    if let Inputs::Rows(names) = &ensemble.inputs
        && !plain.feature_names.is_empty()
    {
        same("names of features", plain.feature_names.join(", "), names.join(", "))?;
    }
    let prediction = ensemble.prediction();
    let rule = |last: bool, average: u32| {
        format!("the {} of equal classes, values of a margin over {average}", if last { "last" } else { "first" })
    };
    let (_, last, average) = plain.link;
    same("predictions", rule(last, average), rule(prediction.last_of_ties, prediction.average))?;
    let kind = |targets| if targets { "targets" } else { "classes, or one value" };
    same("kinds of outputs", kind(plain.targets).into(), kind(prediction.targets).into())?;
    let missing = ensemble.origin.imported.as_ref().and_then(|imported| imported.sentinel);
    let number = |end: f32| match &plain.keys {
        Keys::Scaled(scales) => (f64::from(end) * f64::from(scales[0])).round() as i32,
        Keys::Real | Keys::Whole => f32_key(end),
    };
    let missing = missing.map(|ends| ends.map(|end| i64::from(number(end))));
    let value = |number: i64| match &plain.keys {
        Keys::Scaled(scales) => number as f64 / f64::from(scales[0]),
        Keys::Real | Keys::Whole => Encoder::Real.value(0, number as i32),
    };
    let text = |ends: Option<[i64; 2]>| missing_text(ends.map(|ends| ends.map(value)));
    same("missing values", text(plain.sentinel), text(missing))
}
