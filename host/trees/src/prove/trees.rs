//! Trees of a model beside the trees of the ensemble that they stand for.

use super::boxes::{Rows, Step, Tree, Values, between, cuts_of};
use super::certificate::CertifiedTree;
use super::chip::Chip;
use super::format::Exit;
use super::span::{Span, spans};
use super::{Found, ProofProblem, Subject, output_of};
use crate::compile::Source;
use crate::ensemble::Output;

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

/// Handler of a leaf of the model, of the ensemble's addition there, and of the rows that reach both.
type Visit<'v> = dyn FnMut(&[f64], &[Span], &Rows) -> Result<(), ProofProblem> + 'v;

impl Pair<'_> {
    /// Amount that the base has instead of this tree.
    fn offset(&self) -> f64 {
        f64::from(self.stands_for.offset) * self.step
    }

    /// Calls `see` with the rows between the thresholds of merged trees, one interval after the other: what two of them change
    /// at a threshold may cancel out, and then the model has none there.
    fn each_part(
        &self,
        rows: &mut Rows,
        see: &mut dyn FnMut(&mut Rows) -> Result<(), ProofProblem>,
    ) -> Result<(), ProofProblem> {
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
    ) -> Result<(), ProofProblem> {
        compared.leaf(leaf);
        for (value, (&model, span)) in leaf.iter().zip(spans).enumerate() {
            let farthest = span.farthest(model);
            if !span.is(model, self.step) {
                return Err(ProofProblem::Leaf {
                    tree: self.number,
                    source_tree: self.stands_for.trees[0],
                    output: subject.ensemble.objects[output_of(self.object, value)].clone(),
                    model,
                    ensemble: farthest,
                    rows: subject.example(rows),
                });
            }
            compared.add(value, model, (model - farthest).abs());
        }
        Ok(())
    }
}

/// Trees as the chip reads them. One that stands for a tree alone is walked from that tree's leaves on, a merged one from its
/// own.
pub(super) fn of_chip(chip: &Chip<'_>, subject: Subject<'_>, order: &[Source]) -> Result<Found, ProofProblem> {
    let trees = chip.trees()?;
    let heads: Vec<_> = trees.iter().map(|tree| (tree.object, tree.step)).collect();
    compare_all(subject, &heads, order, &chip.exits(), &mut |pair, rows, visit| match pair.trees.as_slice() {
        [source] => source.leaves(rows, &mut |_, rows| {
            let spans = pair.spans(rows);
            chip.reach(&trees[pair.number], rows, &mut |leaf, rows| visit(leaf, &spans, rows))
        }),
        _ => chip.reach(&trees[pair.number], rows, &mut |leaf, rows| {
            pair.each_part(rows, &mut |rows| visit(leaf, &pair.spans(rows), rows))
        }),
    })
}

/// Trees as the format describes them, from their leaves on to the ensemble's.
pub(super) fn of_format(subject: Subject<'_>, certified: &[CertifiedTree]) -> Result<Found, ProofProblem> {
    let trees = &subject.plain.trees;
    let heads: Vec<_> = trees.iter().map(|(tree, step)| (tree.object, *step)).collect();
    let order: Vec<Source> =
        certified.iter().map(|tree| Source { trees: tree.sources.clone(), offset: tree.offset }).collect();
    compare_all(subject, &heads, &order, &subject.plain.exits, &mut |pair, rows, visit| {
        trees[pair.number]
            .0
            .leaves(rows, &mut |leaf, rows| pair.each_part(rows, &mut |rows| visit(leaf, &pair.spans(rows), rows)))
    })
}

/// Trees of assembly: from the ensemble's leaves on to theirs, or the other way.
pub(super) fn of_code(subject: Subject<'_>, order: &[Source], from_ensemble: bool) -> Result<Found, ProofProblem> {
    let trees = &subject.plain.trees;
    // Its leaves are in units; of which steps the compiler made them depends on the largest value.
    let largest = |source: &Source| -> f64 {
        let nodes = source.trees.iter().filter_map(|&tree| subject.sources.get(tree)).flat_map(|tree| &tree.nodes);
        let values = nodes.flat_map(|step| if let Step::Leaf(values) = step { values.as_slice() } else { &[] });
        values.fold(0.0, |largest: f64, value| largest.max(value.abs()))
    };
    let heads: Vec<_> = trees
        .iter()
        .zip(order)
        .map(|((tree, _), source)| (tree.object, subject.plain.step_for(largest(source))))
        .collect();
    if trees.len() != order.len() {
        let what = format!("the assembly has {} trees, and should have {}", trees.len(), order.len());
        return Err(ProofProblem::Trees { what });
    }
    compare_all(subject, &heads, order, &subject.plain.exits, &mut |pair, rows, visit| match pair.trees.as_slice() {
        [source] if from_ensemble => source.leaves(rows, &mut |_, rows| {
            let spans = pair.spans(rows);
            trees[pair.number].0.leaves(rows, &mut |leaf, rows| visit(leaf, &spans, rows))
        }),
        _ => trees[pair.number].0.leaves(rows, &mut |leaf, rows| {
            // Code has its thresholds at the ends of what stands for a missing value, where the ensemble has them within.
            let mut known: Vec<Values> = rows.iter().map(|values| subject.plain.known(*values)).collect();
            pair.each_part(&mut known, &mut |rows| visit(leaf, &pair.spans(rows), rows))
        }),
    })
}

/// Walk of a tree of the model and of those that it stands for, over these rows.
type Walk<'w> = dyn FnMut(&Pair<'_>, &mut Rows, &mut Visit<'_>) -> Result<(), ProofProblem> + 'w;

/// Compares trees, each with its output and the size of a step of its leaves, with those that they stand for.
fn compare_all(
    subject: Subject<'_>,
    heads: &[(Option<usize>, f64)],
    order: &[Source],
    exits: &[Exit],
    walk: &mut Walk<'_>,
) -> Result<Found, ProofProblem> {
    let Subject { plain, sources, .. } = subject;
    if order.len() != heads.len() {
        let what = format!("the model has {} trees, and should have {}", heads.len(), order.len());
        return Err(ProofProblem::Trees { what });
    }
    let alone = alone(sources, order.iter().flat_map(|source| source.trees.iter().copied()))?;
    let mut found = Found { trees: Vec::new(), table: None, boxes: 0, outputs: Vec::new() };
    let mut totals = Totals::new(subject);
    let mut changes = Vec::new();
    for (number, (&(object, step), stands_for)) in heads.iter().zip(order).enumerate() {
        let trees: Vec<&Tree> = stands_for.trees.iter().map(|&source| &sources[source]).collect();
        if trees.is_empty() || trees.iter().any(|own| own.object != object) {
            let what = format!("tree {number} adds to other outputs than what it stands for");
            return Err(ProofProblem::Trees { what });
        }
        let values = if object.is_some() { 1 } else { plain.names.len() };
        let pair = Pair { number, object, step, stands_for, trees, values };
        let mut compared = Compared::new(values);
        walk(&pair, &mut plain.keys.all(plain.features), &mut |leaf, spans, rows| {
            if rows.iter().any(|values| plain.is_sentinel(values)) {
                return Ok(());
            }
            found.boxes += 1;
            pair.compare(leaf, spans, rows, subject, &mut compared)
        })?;
        totals.add(object, &compared, pair.offset());
        changes.push(compared.change(object));
        let Source { trees: sources, offset } = stands_for.clone();
        found.trees.push(CertifiedTree { error: compared.error, offset, sources });
    }
    totals.alone(&alone)?;
    found.outputs = totals.finish()?;
    in_order(&found, subject)?;
    exits.iter().try_for_each(|exit| known_after(exit, &changes, plain.names.len()))?;
    Ok(found)
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

/// Differences of a tree's leaves, and the range of each of its values.
struct Compared {
    /// The largest difference.
    error: f64,
    ranges: Vec<[f64; 2]>,
    /// For each value, the largest difference.
    errors: Vec<f64>,
    /// The most by which a leaf changes the difference between two of its values.
    spread: f64,
}

impl Compared {
    fn new(values: usize) -> Self {
        Self {
            error: 0.0,
            ranges: vec![[f64::INFINITY, f64::NEG_INFINITY]; values],
            errors: vec![0.0; values],
            spread: 0.0,
        }
    }

    fn leaf(&mut self, values: &[f64]) {
        let (least, most) =
            values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &value| (a.min(value), b.max(value)));
        self.spread = self.spread.max(most - least);
    }

    /// Change that a tree of this output, or of all, makes.
    fn change(&self, object: Option<usize>) -> Change {
        match object {
            Some(object) => Change::One(object, self.ranges[0]),
            None => Change::Each(self.spread),
        }
    }

    fn add(&mut self, value: usize, model: f64, error: f64) {
        self.error = self.error.max(error);
        let [least, most] = self.ranges[value];
        self.ranges[value] = [least.min(model), most.max(model)];
        self.errors[value] = self.errors[value].max(error);
    }
}

/// Change that a tree makes to margins.
enum Change {
    /// To the difference between any two of them, at most.
    Each(f64),
    /// To one of them, from the least to the most.
    One(usize, [f64; 2]),
}

/// Returns an error if trees after the first ones can change the difference between two margins by more than a bound.
fn known_after(exit: &Exit, changes: &[Change], outputs: usize) -> Result<(), ProofProblem> {
    let (trees, bound) = (exit.trees, exit.bound);
    let later = exit.later.iter().copied().chain(std::iter::repeat(0.0));
    let (mut each, mut ranges) = (0.0, later.take(outputs).map(|later| [later; 2]).collect::<Vec<_>>());
    for change in changes.iter().skip(trees) {
        match change {
            Change::Each(most) => each += most,
            Change::One(output, [least, most]) => {
                ranges[*output][0] += least;
                ranges[*output][1] += most;
            }
        }
    }
    let mut found = 0.0_f64;
    for (output, [_, most]) in ranges.iter().enumerate() {
        let others = ranges.iter().enumerate().filter(|(other, _)| *other != output);
        found = others.map(|(_, [least, _])| most - least).fold(found, f64::max);
    }
    found += each;
    if found <= bound * (1.0 + 1e-10) { Ok(()) } else { Err(ProofProblem::Exit { trees, stated: bound, found }) }
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
        let Subject { plain, ensemble, .. } = subject;
        let scale = f64::from(ensemble.prediction().scale);
        let sums = |(&base, &own): (&f64, &f32)| {
            let own = f64::from(own) * scale;
            Sums { error: 0.0, least: base, most: base, base: own, units: plain.steps(own, plain.rounded_to()) }
        };
        Self { subject, outputs: plain.base.iter().zip(&ensemble.base_margins).map(sums).collect() }
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
    fn alone(&mut self, alone: &[usize]) -> Result<(), ProofProblem> {
        for &source in alone {
            let tree = &self.subject.sources[source];
            let Some(values) = tree.constant() else {
                return Err(ProofProblem::Trees { what: format!("tree {source} is missing") });
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
    fn finish(self) -> Result<Vec<[f64; 3]>, ProofProblem> {
        let output = |(object, sums): (usize, Sums)| {
            let (model, unit) = (self.subject.plain.base[object], self.subject.plain.rounded_to());
            let is_same = match unit > 0.0 {
                true => (sums.units[0]..=sums.units[1]).contains(&(model / unit).round()),
                false => model == sums.base,
            };
            if !is_same {
                let output = self.subject.ensemble.objects[object].clone();
                return Err(ProofProblem::Base { output, model, ensemble: sums.base });
            }
            Ok([sums.error + (model - sums.base).abs(), sums.least, sums.most])
        };
        self.outputs.iter().copied().enumerate().map(output).collect()
    }
}

/// Returns an error if sums of f32 would be added in another order.
fn in_order(found: &Found, subject: Subject<'_>) -> Result<(), ProofProblem> {
    let Subject { plain, ensemble, .. } = subject;
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
