//! Proofs that a compiled model means what its ensemble means, for every row: any key of every feature, missing,
//! infinite, negative zero and subnormal values among them.
//!
//! Each tree of the model is walked together with the trees of the ensemble that it stands for, over boxes of rows, until
//! each box reaches one leaf of each: the leaves must be equal, or one apart by the rounding of the leaf. That takes time
//! in proportion to the leaves. What the trees' worst leaves add up to bounds the error and the range of each margin.
//!
//! [`prove`] goes from the ensemble's leaves to the model's, which it reads as the chip does. [`check`] goes from the
//! model's leaves to the ensemble's, with a reader of its own that is written from the format's description, and holds what
//! it finds against a [`Certificate`].
//!
//! Not proved: what is not the ensemble's, such as priors and thresholds for stopping; and that the chip executes its code.

mod boxes;
mod certificate;
mod chip;
mod error;
mod format;
mod moves;

pub use certificate::{Certificate, CertifiedTree};
pub use error::ProofProblem;
pub use moves::{Moves, moves};

use crate::compile;
use crate::ensemble::{Ensemble, Inputs, Output};
use crate::error::Result;
use crate::verify::unit;
use boxes::{Keys, Rows, See, Tree, Values, of_ensemble};
use chip::Chip;
use format::Plain;
use palpate_onboard::Model;
use palpate_shared::{Descriptor, MISSING_FEATURE};

/// Result of a proof.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Proof {
    /// The model's trees; 0 for a table.
    pub trees: usize,
    /// The ensemble's trees.
    pub ensemble_trees: usize,
    /// Boxes of rows that were compared.
    pub boxes: u64,
    /// The largest difference of a leaf, or of a table's cell, in the library's margins.
    pub largest_difference: f64,
    /// The largest difference of a margin: in any cell between thresholds, of a table or where [`prove`] can go through
    /// them; otherwise a bound, the sum of the trees' largest differences, without what the library loses by adding in f32.
    pub margin_error: f64,
    /// The difference that the model states, which has what the library loses by adding in f32.
    pub stated: f64,
    /// For each output its name, and bounds of its margin.
    pub ranges: Vec<(String, f64, f64)>,
}

/// CRC-64 (XZ) of a file.
fn checksum(bytes: &[u8]) -> u64 {
    crc::Crc::<u64>::new(&crc::CRC_64_XZ).checksum(bytes)
}

/// Findings about a model.
struct Found {
    trees: Vec<CertifiedTree>,
    table: Option<f64>,
    boxes: u64,
    outputs: Vec<[f64; 3]>,
}

/// Proves that a model, given by its bytes, adds for every row what `ensemble` adds, which was read from `file`.
///
/// # Errors
/// [`CompileProblem::Model`](crate::error::CompileProblem::Model) if the bytes are no model; [`ProofProblem`] that says for
/// which rows it does not.
pub fn prove(bytes: &[u8], ensemble: &Ensemble, file: &[u8]) -> Result<(Proof, Certificate)> {
    let model = compile::open(bytes)?;
    let plain = format::read(bytes)?;
    statements(&plain, ensemble)?;
    let chip = Chip::new(model, unit(&model))?;
    let sources = of_ensemble(ensemble, &plain.keys);
    let found = if chip.is_table() {
        table_of_chip(&chip, &plain, &sources, ensemble)?
    } else {
        trees_of_chip(&chip, &model, &plain, &sources, ensemble)?
    };
    in_order(&found, &plain, ensemble)?;
    let mut proof = proof(&found, &plain, ensemble);
    if proof.margin_error > proof.stated
        && let Some(exact) = error_in_cells(&chip, &plain, &sources, ensemble)?
    {
        // Of three times one is 0, so touches are fewer than rows of their features.
        if exact > proof.stated * (1.0 + 1e-6) && ensemble.descriptor().is_none() {
            return Err(ProofProblem::Beyond { stated: proof.stated, found: exact }.into());
        }
        proof.margin_error = exact;
    }
    let Found { trees, table, outputs, .. } = &found;
    let certificate = Certificate {
        model: checksum(bytes),
        ensemble: checksum(file),
        trees: trees.clone(),
        table: *table,
        outputs: outputs.clone(),
    };
    Ok((proof, certificate))
}

/// Checks a certificate of a model, given by its bytes, and of `ensemble`, which was read from `file`, in another way than
/// [`prove`] made it.
///
/// # Errors
/// [`CompileProblem::Model`](crate::error::CompileProblem::Model) if the bytes are no model; [`ProofProblem`] that says what
/// is not as the certificate states.
pub fn check(certificate: &Certificate, bytes: &[u8], ensemble: &Ensemble, file: &[u8]) -> Result<Proof> {
    for (what, stated, bytes) in [("a model", certificate.model, bytes), ("an ensemble", certificate.ensemble, file)] {
        let found = checksum(bytes);
        if found != stated {
            return Err(ProofProblem::OtherFile { what, stated, found }.into());
        }
    }
    // Only what may run on a chip is certified.
    compile::open(bytes)?;
    let plain = format::read(bytes)?;
    statements(&plain, ensemble)?;
    let sources = of_ensemble(ensemble, &plain.keys);
    let found = match &plain.cells {
        Some(cells) => table_of_format(cells, &plain, &sources, ensemble)?,
        None => trees_of_format(&plain, &certificate.trees, &sources, ensemble)?,
    };
    in_order(&found, &plain, ensemble)?;
    let understated = |what: String, stated: f64, found: f64| {
        let is_within = found <= stated + 1e-9 * stated.abs() + 1e-12;
        if is_within { Ok(()) } else { Err(ProofProblem::Understated { what, stated, found }) }
    };
    for (number, (tree, stated)) in found.trees.iter().zip(&certificate.trees).enumerate() {
        understated(format!("the largest difference of tree {number}"), stated.error, tree.error)?;
    }
    if let Some(error) = found.table {
        let stated = certificate.table.unwrap_or(-1.0);
        understated("the largest difference in a cell".into(), stated, error)?;
    }
    for (object, &[error, least, most]) in found.outputs.iter().enumerate() {
        let name = &ensemble.objects[object];
        let stated = certificate.outputs.get(object).copied().unwrap_or([-1.0, 0.0, 0.0]);
        understated(format!("the largest difference of {name}"), stated[0], error)?;
        understated(format!("the largest margin of {name}"), stated[2], most)?;
        understated(format!("the smallest margin of {name}, negated,"), -stated[1], -least)?;
    }
    Ok(proof(&found, &plain, ensemble))
}

fn proof(found: &Found, plain: &Plain, ensemble: &Ensemble) -> Proof {
    let largest = found.trees.iter().map(|tree| tree.error).fold(found.table.unwrap_or(0.0), f64::max);
    Proof {
        trees: found.trees.len(),
        ensemble_trees: ensemble.trees.len(),
        boxes: found.boxes,
        largest_difference: largest,
        margin_error: found.outputs.iter().map(|[error, ..]| *error).fold(0.0, f64::max),
        stated: plain.stated,
        ranges: ensemble
            .objects
            .iter()
            .zip(&found.outputs)
            .map(|(name, &[_, least, most])| (name.clone(), least, most))
            .collect(),
    }
}

/// Returns an error unless names, features and predictions are the ensemble's.
fn statements(plain: &Plain, ensemble: &Ensemble) -> Result<(), ProofProblem> {
    let same = |what, model: String, ensemble: String| {
        if model == ensemble { Ok(()) } else { Err(ProofProblem::Statement { what, model, ensemble }) }
    };
    same("outputs", plain.names.join(", "), ensemble.objects.join(", "))?;
    same("features", plain.features.to_string(), ensemble.inputs.count().to_string())?;
    let descriptor = ensemble.descriptor().map_or(255, |descriptor| descriptor.code());
    same("descriptor codes", plain.descriptor.to_string(), descriptor.to_string())?;
    if let Inputs::Rows(names) = &ensemble.inputs
        && !plain.feature_names.is_empty()
    {
        same("names of features", plain.feature_names.join(", "), names.join(", "))?;
    }
    let own = ensemble.prediction();
    let link =
        |(link, last): (u8, bool)| format!("link {link}, the {} of equal classes", if last { "last" } else { "first" });
    same("predictions", link(plain.link), link((own.link.code(), own.last_of_ties)))?;
    let missing = ensemble.origin.imported.as_ref().and_then(|imported| imported.sentinel);
    let number = |end: f32| match &plain.keys {
        Keys::Scaled(scales) => (f64::from(end) * f64::from(scales[0])).round() as i32,
        Keys::Real | Keys::Whole => palpate_shared::format::f32_key(end),
    };
    let missing = missing.map(|ends| ends.map(|end| i64::from(number(end))));
    same("missing values", format!("{:?}", plain.sentinel), format!("{missing:?}"))
}

/// Trees of the ensemble that stand alone: each one of the model's takes some of the others, and none twice.
fn alone(sources: &[Tree], taken: impl IntoIterator<Item = usize>) -> Result<Vec<usize>, ProofProblem> {
    let mut is_taken = vec![false; sources.len()];
    for source in taken {
        match is_taken.get_mut(source) {
            Some(is_taken) if !*is_taken => *is_taken = true,
            Some(_) => return Err(ProofProblem::Trees { what: format!("tree {source} is there twice") }),
            None => return Err(ProofProblem::Trees { what: format!("there is no tree {source}") }),
        }
    }
    Ok((0..sources.len()).filter(|&source| !is_taken[source]).collect())
}

/// Values that leaves of the ensemble add for some rows: from the least to the most, and the numbers of whole steps, from
/// the first to the second, that each of them may be rounded to.
#[derive(Clone, Copy, Debug)]
struct Span {
    low: f64,
    high: f64,
    steps: [f64; 2],
}

impl Span {
    const NONE: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY, steps: [f64::NEG_INFINITY, f64::INFINITY] };

    /// A value that is a whole number of steps.
    fn whole(steps: f64, step: f64) -> Self {
        Self { low: steps * step, high: steps * step, steps: [steps; 2] }
    }

    /// Another value of the same tree.
    fn or(&mut self, value: f64, step: f64) {
        (self.low, self.high) = (self.low.min(value), self.high.max(value));
        if step > 0.0 {
            // Halves may be rounded to either side.
            let [low, high] = format::steps(value, step);
            self.steps = [self.steps[0].max(low), self.steps[1].min(high)];
        }
    }

    /// The sum with a span of another tree.
    fn add(&mut self, other: Self) {
        (self.low, self.high) = (self.low + other.low, self.high + other.high);
        let is_none = |steps: [f64; 2]| steps[0] > steps[1];
        self.steps = if is_none(self.steps) || is_none(other.steps) {
            [f64::INFINITY, f64::NEG_INFINITY]
        } else {
            [self.steps[0] + other.steps[0], self.steps[1] + other.steps[1]]
        };
    }

    /// True if `model` is what all these values are rounded to, or all of them where nothing is rounded.
    fn is(&self, model: f64, step: f64) -> bool {
        if step > 0.0 {
            let steps = (model / step).round();
            (self.steps[0]..=self.steps[1]).contains(&steps)
        } else {
            self.low == model && self.high == model
        }
    }

    /// The value that is farthest from `model`.
    fn farthest(&self, model: f64) -> f64 {
        if (model - self.low).abs() > (self.high - model).abs() { self.low } else { self.high }
    }
}

/// Differences of a tree's leaves, and the range of each of its values.
struct Compared {
    error: f64,
    ranges: Vec<[f64; 2]>,
    /// For each value, the largest difference.
    errors: Vec<f64>,
}

impl Compared {
    fn new(values: usize) -> Self {
        Self { error: 0.0, ranges: vec![[f64::INFINITY, f64::NEG_INFINITY]; values], errors: vec![0.0; values] }
    }

    fn add(&mut self, value: usize, model: f64, error: f64) {
        self.error = self.error.max(error);
        let [least, most] = self.ranges[value];
        self.ranges[value] = [least.min(model), most.max(model)];
        self.errors[value] = self.errors[value].max(error);
    }
}

/// Rows in words: one of them.
fn example(rows: &Rows, keys: &Keys, ensemble: &Ensemble) -> String {
    let names = ensemble.inputs.names();
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

/// The first output of a tree.
fn first_output(object: Option<usize>, value: usize) -> usize {
    object.unwrap_or(value)
}

/// Trees of the model as the chip reads them, from the ensemble's leaves on.
fn trees_of_chip(
    chip: &Chip<'_>,
    model: &Model<'_>,
    plain: &Plain,
    sources: &[Tree],
    ensemble: &Ensemble,
) -> Result<Found> {
    let order = compile::order_of_trees(ensemble, model.leaf_type())?;
    let trees = chip.trees()?;
    if order.len() != trees.len() {
        let what = format!("the model has {} trees, and should have {}", trees.len(), order.len());
        return Err(ProofProblem::Trees { what }.into());
    }
    let mut found = Found { trees: Vec::new(), table: None, boxes: 0, outputs: Vec::new() };
    let mut totals = Totals::new(plain, ensemble);
    for (number, (tree, source)) in trees.iter().zip(order).enumerate() {
        let own: Vec<&Tree> = source.trees.iter().map(|&source| &sources[source]).collect();
        if own.iter().any(|own| own.object != tree.object) {
            let what = format!("tree {number} adds to other outputs than tree {} of the ensemble", source.trees[0]);
            return Err(ProofProblem::Trees { what }.into());
        }
        let offset = f64::from(source.offset) * tree.step;
        let values = if tree.object.is_some() { 1 } else { plain.names.len() };
        let mut compared = Compared::new(values);
        let mut rows = plain.keys.all(plain.features);
        let mut sum = vec![Span::whole(f64::from(-source.offset), tree.step); values];
        together(&own, tree.step, &mut sum, &mut rows, &mut |sum, rows| {
            chip.reach(tree, rows, &mut |leaf, rows| {
                found.boxes += 1;
                compare(leaf, sum, tree.step, &mut compared).map_err(|(value, model, ensemble_value)| {
                    ProofProblem::Leaf {
                        tree: number,
                        source_tree: source.trees[0],
                        output: ensemble.objects[first_output(tree.object, value)].clone(),
                        model,
                        ensemble: ensemble_value,
                        rows: example(rows, &plain.keys, ensemble),
                    }
                })
            })
        })?;
        totals.add(tree.object, &compared, offset);
        found.trees.push(CertifiedTree { error: compared.error, offset: source.offset, sources: source.trees });
    }
    totals.alone(sources, &alone(sources, found.trees.iter().flat_map(|tree| tree.sources.iter().copied()))?)?;
    found.outputs = totals.finish(ensemble)?;
    Ok(found)
}

/// Compares a leaf with what the ensemble adds; an error has the value's number and both values.
fn compare(leaf: &[f64], spans: &[Span], step: f64, compared: &mut Compared) -> Result<(), (usize, f64, f64)> {
    for (value, (&model, span)) in leaf.iter().zip(spans).enumerate() {
        let farthest = span.farthest(model);
        if !span.is(model, step) {
            return Err((value, model, farthest));
        }
        compared.add(value, model, (model - farthest).abs());
    }
    Ok(())
}

/// Handler of sums of leaves, and of the rows that reach them.
type SeeSums<'s> = dyn FnMut(&[Span], &mut Rows) -> Result<(), ProofProblem> + 's;

/// Calls `see` with the sum of the leaves of all `trees` that some rows reach together.
fn together(
    trees: &[&Tree],
    step: f64,
    sum: &mut [Span],
    rows: &mut Rows,
    see: &mut SeeSums<'_>,
) -> Result<(), ProofProblem> {
    let [first, others @ ..] = trees else { return see(sum, rows) };
    first.leaves(rows, &mut |values, rows| {
        let before = sum.to_vec();
        for (sum, &value) in sum.iter_mut().zip(values) {
            let mut own = Span::NONE;
            own.or(value, step);
            sum.add(own);
        }
        let done = together(others, step, sum, rows, see);
        sum.copy_from_slice(&before);
        done
    })
}

/// Trees of the model as its format describes them, from their leaves on to the ensemble's.
fn trees_of_format(
    plain: &Plain,
    certified: &[CertifiedTree],
    sources: &[Tree],
    ensemble: &Ensemble,
) -> Result<Found, ProofProblem> {
    if certified.len() != plain.trees.len() {
        let what = format!("the model has {} trees, the certificate {}", plain.trees.len(), certified.len());
        return Err(ProofProblem::Trees { what });
    }
    let others = alone(sources, certified.iter().flat_map(|tree| tree.sources.iter().copied()))?;
    let mut found = Found { trees: Vec::new(), table: None, boxes: 0, outputs: Vec::new() };
    let mut totals = Totals::new(plain, ensemble);
    for (number, ((tree, step), certified)) in plain.trees.iter().zip(certified).enumerate() {
        let own: Vec<&Tree> = certified.sources.iter().map(|&source| &sources[source]).collect();
        if own.is_empty() || own.iter().any(|own| own.object != tree.object) {
            let what = format!("tree {number} adds to other outputs than what it stands for");
            return Err(ProofProblem::Trees { what });
        }
        let offset = f64::from(certified.offset) * step;
        let values = if tree.object.is_some() { 1 } else { plain.names.len() };
        let mut compared = Compared::new(values);
        let mut rows = plain.keys.all(plain.features);
        tree.leaves(&mut rows, &mut |leaf, rows| {
            found.boxes += 1;
            let start = Span::whole(f64::from(-certified.offset), *step);
            let spans = spans(&own, values, start, *step, rows);
            compare(leaf, &spans, *step, &mut compared).map_err(|(value, model, ensemble_value)| ProofProblem::Leaf {
                tree: number,
                source_tree: certified.sources[0],
                output: ensemble.objects[first_output(tree.object, value)].clone(),
                model,
                ensemble: ensemble_value,
                rows: example(rows, &plain.keys, ensemble),
            })
        })?;
        totals.add(tree.object, &compared, offset);
        let CertifiedTree { offset, sources, .. } = certified.clone();
        found.trees.push(CertifiedTree { error: compared.error, offset, sources });
    }
    totals.alone(sources, &others)?;
    found.outputs = totals.finish(ensemble)?;
    Ok(found)
}

/// Sums of the leaves that `rows` reach, of every tree by itself, from `start` on.
fn spans(trees: &[&Tree], values: usize, start: Span, step: f64, rows: &mut Rows) -> Vec<Span> {
    let mut sums = vec![start; values];
    for tree in trees {
        let mut own = vec![Span::NONE; values];
        let done: Result<(), std::convert::Infallible> = tree.leaves(rows, &mut |leaf, _| {
            own.iter_mut().zip(leaf).for_each(|(own, &value)| own.or(value, step));
            Ok(())
        });
        let Ok(()) = done;
        sums.iter_mut().zip(own).for_each(|(sum, own)| sum.add(own));
    }
    sums
}

/// The sums of trees for each output.
struct Totals<'p> {
    plain: &'p Plain,
    outputs: Vec<Sums>,
}

#[derive(Clone, Copy)]
struct Sums {
    error: f64,
    least: f64,
    most: f64,
    /// The base margin that the ensemble's is, with what is folded into it.
    base: f64,
    /// The same in whole units, to which each part was rounded.
    units: [f64; 2],
}

impl<'p> Totals<'p> {
    fn new(plain: &'p Plain, ensemble: &Ensemble) -> Self {
        let scale = f64::from(ensemble.prediction().scale);
        let sums = |(&base, &own): (&f64, &f32)| {
            let own = f64::from(own) * scale;
            Sums { error: 0.0, least: base, most: base, base: own, units: plain.steps(own, plain.rounded_to()) }
        };
        Self { plain, outputs: plain.base.iter().zip(&ensemble.base_margins).map(sums).collect() }
    }

    fn add(&mut self, object: Option<usize>, compared: &Compared, offset: f64) {
        let unit = self.plain.rounded_to();
        let units = if unit > 0.0 { (offset / unit).round() } else { 0.0 };
        for (value, (range, error)) in compared.ranges.iter().zip(&compared.errors).enumerate() {
            let sums = &mut self.outputs[first_output(object, value)];
            sums.error += error;
            sums.least += range[0];
            sums.most += range[1];
            sums.base += offset;
            sums.units = sums.units.map(|own| own + units);
        }
    }

    /// Trees without a split are in the base. Each was rounded to the steps of a tree of its own.
    fn alone(&mut self, sources: &[Tree], alone: &[usize]) -> Result<(), ProofProblem> {
        for &source in alone {
            let tree = &sources[source];
            let Some(values) = tree.constant() else {
                return Err(ProofProblem::Trees { what: format!("tree {source} is missing") });
            };
            let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            let step = self.plain.step_for(largest);
            for (value, &own) in values.iter().enumerate() {
                let sums = &mut self.outputs[first_output(tree.object, value)];
                sums.base += own;
                if step > 0.0 {
                    let units = self.plain.steps(own, step).map(|steps| steps * (step / self.plain.unit).round());
                    sums.units = [sums.units[0] + units[0], sums.units[1] + units[1]];
                }
            }
        }
        Ok(())
    }

    /// For each output the error and the ends of its margin.
    fn finish(self, ensemble: &Ensemble) -> Result<Vec<[f64; 3]>, ProofProblem> {
        let output = |(object, sums): (usize, Sums)| {
            let (model, unit) = (self.plain.base[object], self.plain.rounded_to());
            let is_same = match unit > 0.0 {
                true => (sums.units[0]..=sums.units[1]).contains(&(model / unit).round()),
                false => model == sums.base,
            };
            if !is_same {
                let output = ensemble.objects[object].clone();
                return Err(ProofProblem::Base { output, model, ensemble: sums.base });
            }
            Ok([sums.error + (model - sums.base).abs(), sums.least, sums.most])
        };
        self.outputs.iter().copied().enumerate().map(output).collect()
    }
}

/// Returns an error if sums of f32 would be added in another order.
fn in_order(found: &Found, plain: &Plain, ensemble: &Ensemble) -> Result<(), ProofProblem> {
    if plain.most == 0.0 {
        let mut last = vec![None; plain.names.len()];
        for tree in &found.trees {
            let &[source] = tree.sources.as_slice() else {
                return Err(ProofProblem::Trees { what: "trees with f32 leaves were merged".into() });
            };
            let outputs = match ensemble.trees[source].output {
                Output::One(object) => object..object + 1,
                Output::Each => 0..last.len(),
            };
            for last in &mut last[outputs] {
                if last.replace(source).is_some_and(|last| last > source) {
                    let what = format!("f32 leaves of tree {source} are added in another order");
                    return Err(ProofProblem::Trees { what });
                }
            }
        }
    }
    Ok(())
}

/// The sums of the ensemble's leaves that `rows` reach, rounded to f32 at each addition, as libraries do.
fn sums(sources: &[Tree], ensemble: &Ensemble, rows: &mut Rows) -> Vec<Span> {
    let scale = f64::from(ensemble.prediction().scale);
    let start = |&base: &f32| Span { low: f64::from(base) * scale, high: f64::from(base) * scale, ..Span::NONE };
    let mut sums: Vec<Span> = ensemble.base_margins.iter().map(start).collect();
    let add = |sum: f64, value: f64| f64::from((sum / scale) as f32 + (value / scale) as f32) * scale;
    for tree in sources {
        let values = if tree.object.is_some() { 1 } else { sums.len() };
        for (value, own) in spans(&[tree], values, Span::whole(0.0, 0.0), 0.0, rows).into_iter().enumerate() {
            let sum = &mut sums[first_output(tree.object, value)];
            (sum.low, sum.high) = (add(sum.low, own.low), add(sum.high, own.high));
        }
    }
    sums
}

/// Compares the margins of a cell with the ensemble's.
fn cell(
    margins: &[f64],
    rows: &mut Rows,
    found: &mut Found,
    plain: &Plain,
    sources: &[Tree],
    ensemble: &Ensemble,
) -> Result<(), ProofProblem> {
    found.boxes += 1;
    let step = plain.rounded_to();
    for (object, (&model, span)) in margins.iter().zip(sums(sources, ensemble, rows)).enumerate() {
        let farthest = span.farthest(model);
        let error = (model - farthest).abs();
        let mut rounded = Span::NONE;
        rounded.or(span.low, step);
        rounded.or(span.high, step);
        if !rounded.is(model, step) || error > plain.stated * (1.0 + 1e-6) {
            return Err(ProofProblem::Cell {
                output: ensemble.objects[object].clone(),
                model,
                ensemble: farthest,
                rows: example(rows, &plain.keys, ensemble),
            });
        }
        found.table = found.table.map(|worst| worst.max(error));
        let output = &mut found.outputs[object];
        *output = [output[0].max(error), output[1].min(model), output[2].max(model)];
    }
    Ok(())
}

fn no_table(plain: &Plain) -> Found {
    let outputs = vec![[0.0, f64::INFINITY, f64::NEG_INFINITY]; plain.names.len()];
    Found { trees: Vec::new(), table: Some(0.0), boxes: 0, outputs }
}

/// Cells of a table as its format describes them.
fn table_of_format(
    cells: &[(Vec<Values>, Vec<f64>)],
    plain: &Plain,
    sources: &[Tree],
    ensemble: &Ensemble,
) -> Result<Found, ProofProblem> {
    let mut found = no_table(plain);
    for (rows, margins) in cells {
        // Thresholds may be there twice: nothing is between them.
        let is_empty = rows.iter().any(|values| values.low > values.high && !values.missing);
        if !is_empty {
            cell(margins, &mut rows.clone(), &mut found, plain, sources, ensemble)?;
        }
    }
    Ok(found)
}

/// Cells of a table as the chip looks them up: between the ensemble's own thresholds.
fn table_of_chip(chip: &Chip<'_>, plain: &Plain, sources: &[Tree], ensemble: &Ensemble) -> Result<Found, ProofProblem> {
    let mut found = no_table(plain);
    let choices = choices(chip, plain, sources, ensemble);
    each_cell(chip, plain, &choices, &mut |margins, rows| cell(margins, rows, &mut found, plain, sources, ensemble))?;
    Ok(found)
}

/// The most trees in all cells together that are added up for the error of margins that the trees' worst only bound.
const MOST: usize = 2_000_000;

/// The largest difference of a margin to the ensemble's f32 sum in any cell between its thresholds; `None` if there are too
/// many of them.
fn error_in_cells(
    chip: &Chip<'_>,
    plain: &Plain,
    sources: &[Tree],
    ensemble: &Ensemble,
) -> Result<Option<f64>, ProofProblem> {
    let choices = choices(chip, plain, sources, ensemble);
    let cells = choices.iter().map(|own| own.iter().try_fold(1_usize, |cells, own| cells.checked_mul(own.len())));
    let cells = cells.sum::<Option<usize>>().and_then(|cells| cells.checked_mul(sources.len()));
    if cells.is_none_or(|cells| cells > MOST) {
        return Ok(None);
    }
    let mut worst = 0.0_f64;
    each_cell(chip, plain, &choices, &mut |margins, rows| {
        let sums = sums(sources, ensemble, rows);
        worst =
            margins.iter().zip(sums).fold(worst, |worst, (&model, sum)| worst.max((model - sum.farthest(model)).abs()));
        Ok(())
    })?;
    Ok(Some(worst))
}

/// Values of each feature between thresholds, one list of them for each contact pattern where features depend on it.
fn choices(chip: &Chip<'_>, plain: &Plain, sources: &[Tree], ensemble: &Ensemble) -> Vec<Vec<Vec<Values>>> {
    let all = plain.keys.all(plain.features);
    // Each feature's intervals between thresholds, without a missing value.
    let intervals = |(feature, values): (usize, &Values)| {
        let mut cuts = chip.cuts_of(feature);
        cuts.extend(boxes::cuts_of(sources, feature));
        cuts.sort_unstable();
        cuts.dedup();
        let mut own = Vec::new();
        let mut low = values.low;
        for cut in cuts.into_iter().filter(|&cut| cut > values.low && cut <= values.high) {
            own.push(Values::of(low, cut - 1, false));
            low = cut;
        }
        own.push(Values::of(low, values.high, false));
        own
    };
    let intervals: Vec<Vec<Values>> = all.iter().enumerate().map(intervals).collect();
    if ensemble.descriptor() != Some(Descriptor::ContactsCurvature) {
        let with_missing = |(own, &all): (Vec<Values>, &Values)| {
            if own.len() == 1 { vec![all] } else { own.into_iter().chain([Values::MISSING]).collect() }
        };
        return vec![intervals.into_iter().zip(&all).map(with_missing).collect()];
    }
    // A pattern fixes which differences are there.
    let there = [[false; 3], [false; 3], [false; 3], [false, false, true], [false, true, false], [true, true, false]];
    let of_pattern = |(there, code): ([bool; 3], i64)| {
        let mut choices = intervals.clone();
        choices[0] = vec![Values::of(code, code, false)];
        for (choices, _) in choices[1..].iter_mut().zip(there).filter(|(_, is_there)| !is_there) {
            *choices = vec![Values::MISSING];
        }
        choices
    };
    there.into_iter().zip(0..).map(of_pattern).collect()
}

/// Calls `see` with the margins of each combination of values, as the chip computes them.
fn each_cell(
    chip: &Chip<'_>,
    plain: &Plain,
    choices: &[Vec<Vec<Values>>],
    see: &mut See<'_, ProofProblem>,
) -> Result<(), ProofProblem> {
    let mut rows = plain.keys.all(plain.features);
    choices.iter().try_for_each(|choices| {
        each(choices, 0, &mut rows, &mut |rows| {
            let key = |values: &Values| if values.low > values.high { MISSING_FEATURE } else { values.low as i32 };
            let row: Vec<i32> = rows.iter().map(key).collect();
            let margins = chip.margins(&row).ok_or(ProofProblem::Format { what: "it has no margins of a row" })?;
            see(&margins, rows)
        })
    })
}

/// Calls `see` with every combination of the choices of features from `feature` on.
fn each(
    choices: &[Vec<Values>],
    feature: usize,
    rows: &mut Vec<Values>,
    see: &mut dyn FnMut(&mut Vec<Values>) -> Result<(), ProofProblem>,
) -> Result<(), ProofProblem> {
    let Some(own) = choices.get(feature) else { return see(rows) };
    own.iter().try_for_each(|&values| {
        rows[feature] = values;
        each(choices, feature + 1, rows, see)
    })
}
