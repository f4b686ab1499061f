//! Trees of a model beside the trees of the ensemble that they stand for.

use super::boxes::{Rows, Step, Tree, Values, between, cuts_of};
use super::span::{Span, spans};
use super::{Found, Matched, OTHER_FILE, Subject, other_trees, output_of};
use crate::compile::Source;
use crate::ensemble::Output;
use crate::error::{Result, problem};
use rayon::prelude::*;

/// A tree of a model, and the trees that it stands for.
struct Pair<'p> {
    /// Its number in the model.
    number: usize,
    /// The output of trees with one value in a leaf.
    object: Option<usize>,
    /// Size in margins of one whole step of its leaves; 0 for f32.
    step: f64,
    stands_for: &'p Source,
    trees: Vec<&'p Tree>,
    /// Values of a leaf.
    values: usize,
}

impl Pair<'_> {
    /// Amount that the base has instead of this tree.
    fn offset(&self) -> f64 {
        f64::from(self.stands_for.offset) * self.step
    }

    /// Calls `see` with the rows between the thresholds of merged trees, one interval after the other: what two of them change
    /// at a threshold may cancel out, and then the model has none there.
    fn each_part(&self, rows: &mut Rows, see: &mut dyn FnMut(&mut Rows) -> Result<()>) -> Result<()> {
        let [Step::Split(rule, _), ..] = self.trees[0].nodes.as_slice() else { return see(rows) };
        if self.trees.len() == 1 {
            return see(rows);
        }
        let own = self.trees.iter().copied();
        let before = rows[rule.feature];
        let mut parts = between(before, cuts_of(own, rule.feature).collect());
        parts.extend(before.missing.then_some(Values::MISSING));
        for part in parts {
            rows[rule.feature] = part;
            let done = see(rows);
            rows[rule.feature] = before;
            done?;
        }
        Ok(())
    }

    /// Spans that the ensemble adds for rows.
    fn spans(&self, rows: &mut Rows) -> Vec<Span> {
        spans(&self.trees, self.values, Span::whole(-f64::from(self.stands_for.offset), self.step), self.step, rows)
    }

    /// Compares a leaf with the ensemble's addition.
    fn compare(
        &self,
        leaf: &[f64],
        spans: &[Span],
        rows: &Rows,
        subject: Subject<'_>,
        compared: &mut Compared,
    ) -> Result<()> {
        for (value, (&model, span)) in leaf.iter().zip(spans).enumerate() {
            let farthest = span.farthest(model);
            if !span.is(model, self.step) {
                let (tree, source) = (self.number, self.stands_for.trees[0]);
                let output = &subject.ensemble.objects[output_of(self.object, value)];
                return Err(problem!(
                    "for some rows the model's tree {tree} adds {model:e} to {output} where tree {source} of the ensemble has \
                     {farthest:e}: {}",
                    subject.example(rows)
                )
                .fix(OTHER_FILE));
            }
            compared.add(value, model, (model - farthest).abs());
        }
        Ok(())
    }
}

/// Compares the model's trees with those that they stand for, from their leaves on to the ensemble's.
pub(super) fn compare(subject: Subject<'_>, order: &[Source]) -> Result<Found> {
    let Subject { plain, sources, .. } = subject;
    if order.len() != plain.trees.len() {
        let (found, wanted) = (plain.trees.len(), order.len());
        return Err(other_trees(format_args!("the model has {found} trees, and should have {wanted}")));
    }
    let alone = alone(sources, order.iter().flat_map(|source| source.trees.iter().copied()))?;
    let mut found = Found { trees: Vec::new(), boxes: 0, outputs: Vec::new() };
    let mut totals = Totals::new(subject);
    for (number, ((tree, step), stands_for)) in plain.trees.iter().zip(order).enumerate() {
        let (object, step) = (tree.object, *step);
        let trees: Vec<&Tree> = stands_for.trees.iter().map(|&source| &sources[source]).collect();
        if trees.is_empty() || trees.iter().any(|own| own.object != object) {
            return Err(other_trees(format_args!("tree {number} adds to other outputs than what it stands for")));
        }
        let values = if object.is_some() { 1 } else { plain.names.len() };
        let pair = Pair { number, object, step, stands_for, trees, values };
        let mut compared = Compared::new(values);
        let mut rows_of_boxes = Vec::new();
        tree.leaves(&mut plain.keys.all(plain.features), &mut |leaf, rows| {
            pair.each_part(rows, &mut |rows| {
                if rows.iter().any(|values| plain.is_sentinel(values)) {
                    return Ok(());
                }
                rows_of_boxes.push(subject.row(rows));
                let spans = pair.spans(rows);
                pair.compare(leaf, &spans, rows, subject, &mut compared)
            })
        })?;
        found.boxes += rows_of_boxes.len() as u64;
        rows_of_boxes.par_iter().try_for_each(|row| subject.agrees(row))?;
        totals.add(object, &compared, pair.offset());
        found.trees.push(Matched { error: compared.error, sources: stands_for.trees.clone() });
    }
    totals.alone(&alone)?;
    found.outputs = totals.finish()?;
    in_order(&found, subject)?;
    Ok(found)
}

/// Trees of the ensemble that stand alone: each one of the model's takes some of the others, and none twice.
fn alone(sources: &[Tree], taken: impl IntoIterator<Item = usize>) -> Result<Vec<usize>> {
    let mut is_taken = vec![false; sources.len()];
    for source in taken {
        match is_taken.get_mut(source) {
            Some(is_taken) if !*is_taken => *is_taken = true,
            Some(_) => return Err(other_trees(format_args!("tree {source} is there twice"))),
            None => return Err(other_trees(format_args!("there is no tree {source}"))),
        }
    }
    Ok((0..sources.len()).filter(|&source| !is_taken[source]).collect())
}

/// Differences of a tree's leaves, and the range of each of its values.
struct Compared {
    /// The largest difference.
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

/// The sums of trees for each output.
struct Totals<'s> {
    subject: Subject<'s>,
    /// One for each output.
    outputs: Vec<Sums>,
}

#[derive(Clone, Copy)]
struct Sums {
    error: f64,
    least: f64,
    most: f64,
    /// The base margin equivalent to the ensemble's, with everything that is folded into it.
    base: f64,
    /// The sums in whole units, to which each part was rounded.
    units: [f64; 2],
}

impl<'s> Totals<'s> {
    fn new(subject: Subject<'s>) -> Self {
        let Subject { plain, .. } = subject;
        let sums = |(&base, &own): (&f64, &f64)| Sums {
            error: 0.0,
            least: base,
            most: base,
            base: own,
            units: plain.steps(own, plain.rounded_to()),
        };
        Self { subject, outputs: plain.base.iter().zip(subject.base).map(sums).collect() }
    }

    fn add(&mut self, object: Option<usize>, compared: &Compared, offset: f64) {
        let unit = self.subject.plain.rounded_to();
        let units = if unit > 0.0 { (offset / unit).round() } else { 0.0 };
        for (value, (range, error)) in compared.ranges.iter().zip(&compared.errors).enumerate() {
            let sums = &mut self.outputs[output_of(object, value)];
            sums.error += error;
            sums.least += range[0];
            sums.most += range[1];
            sums.base += offset;
            sums.units = sums.units.map(|own| own + units);
        }
    }

    /// Trees without a split are in the base. Each was rounded to the steps of a tree of its own.
    fn alone(&mut self, alone: &[usize]) -> Result<()> {
        for &source in alone {
            let tree = &self.subject.sources[source];
            let Some(values) = tree.constant() else {
                return Err(other_trees(format_args!("tree {source} is missing")));
            };
            let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            let step = self.subject.plain.step_for(largest);
            for (value, &own) in values.iter().enumerate() {
                let sums = &mut self.outputs[output_of(tree.object, value)];
                sums.base += own;
                if step > 0.0 {
                    let units = self
                        .subject
                        .plain
                        .steps(own, step)
                        .map(|steps| steps * (step / self.subject.plain.unit).round());
                    sums.units = [sums.units[0] + units[0], sums.units[1] + units[1]];
                }
            }
        }
        Ok(())
    }

    /// For each output the error and the ends of its margin.
    fn finish(self) -> Result<Vec<[f64; 3]>> {
        let output = |(object, sums): (usize, Sums)| {
            let (model, unit) = (self.subject.plain.base[object], self.subject.plain.rounded_to());
            let is_same = match unit > 0.0 {
                true => (sums.units[0]..=sums.units[1]).contains(&(model / unit).round()),
                false => model == sums.base,
            };
            if !is_same {
                let (output, ensemble) = (&self.subject.ensemble.objects[object], sums.base);
                return Err(problem!(
                    "the model's margin of {output} starts from {model:e}, where the ensemble starts from {ensemble:e}"
                )
                .fix(OTHER_FILE));
            }
            Ok([sums.error + (model - sums.base).abs(), sums.least, sums.most])
        };
        self.outputs.iter().copied().enumerate().map(output).collect()
    }
}

/// Returns an error if sums of f32 would be added in another order.
fn in_order(found: &Found, subject: Subject<'_>) -> Result<()> {
    let Subject { plain, ensemble, .. } = subject;
    if plain.most == 0.0 {
        let mut last = vec![None; plain.names.len()];
        for tree in &found.trees {
            let &[source] = tree.sources.as_slice() else {
                return Err(other_trees("trees with f32 leaves were merged"));
            };
            let outputs = match ensemble.trees[source].output {
                Output::One(object) => object..object + 1,
                Output::Each => 0..last.len(),
            };
            for last in &mut last[outputs] {
                if last.replace(source).is_some_and(|last| last > source) {
                    return Err(other_trees(format_args!("f32 leaves of tree {source} are added in another order")));
                }
            }
        }
    }
    Ok(())
}
