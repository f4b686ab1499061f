//! One row's margins: of the ensemble as a compiled model compares, and of the model.

use crate::ensemble::{Ensemble, Node, Output, Tree};
use crate::rows::Encoder;
use palpate_onboard::Model;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{LeafType, OutputScale, Sentinel};

/// The ensemble as a model compares: values as f32, or as whole numbers of the features' units.
pub(super) struct Reference<'a> {
    pub(super) ensemble: &'a Ensemble,
    pub(super) encoder: Encoder,
    /// The features that stand for a missing value in the model.
    pub(super) sentinel: Option<Sentinel>,
    /// True if the model adds the ensemble's f32 values in their order.
    is_f32: bool,
}

impl<'a> Reference<'a> {
    /// The ensemble as `model` compares.
    pub(super) fn new(ensemble: &'a Ensemble, model: &Model<'_>) -> Self {
        let is_f32 = model.leaf_type() == LeafType::F32;
        Self { ensemble, encoder: Encoder::of(model), sentinel: model.sentinel(), is_f32 }
    }

    /// True if the first of two classes has the remainder to 1 of the second one's leaves, as in a vote.
    pub(super) fn is_share(&self) -> bool {
        self.ensemble.trees.iter().any(|tree| tree.output != Output::One(1))
    }

    /// The farthest that the file's trees in f32 can be from the library's margins.
    pub(super) fn rounding(&self) -> f64 {
        self.ensemble.origin.imported.as_ref().map_or(0.0, |imported| imported.rounding)
    }

    /// True if each tree votes for the classes, so that sums of votes are whole and may be equal.
    pub(super) fn is_vote(&self) -> bool {
        let is_each = self.ensemble.trees.iter().all(|tree| tree.output == Output::Each);
        is_each && self.ensemble.objects.len() > 1 && self.ensemble.prediction().scale != 1.0
    }

    /// The margins of the model's input, added as the model states how close its own are.
    pub(super) fn margins(&self, row: &[f64], encoded: &[i32]) -> Vec<f64> {
        if !self.is_f32 {
            return self.measured(row, encoded);
        }
        let known = self.known(row);
        let leaf =
            |number, tree: &'a Tree| tree.nodes[self.node(number, tree, &known, encoded)].leaf().unwrap_or_default();
        self.ensemble.margins_of_leaves(leaf).into_iter().map(f64::from).collect()
    }

    /// The margins of the model's input, added as the library does.
    pub(super) fn measured(&self, row: &[f64], encoded: &[i32]) -> Vec<f64> {
        let known = self.known(row);
        self.ensemble.library_margins(|number, tree| self.node(number, tree, &known, encoded))
    }

    /// A row's f32 values, NaN where one is missing.
    fn known(&self, row: &[f64]) -> Vec<f32> {
        let singles: Vec<f32> = row.iter().map(|&value| value as f32).collect();
        self.ensemble.known_features(&singles).into_owned()
    }

    /// The margins of a row that is compared as the library does, in f64 or in f32.
    pub(super) fn library_margins(&self, row: &[f64]) -> Vec<f64> {
        let known = self.known(row);
        let is_f64 = self.ensemble.compares_f64();
        self.ensemble.library_margins(|number, tree| match is_f64 {
            false => tree.leaf_node(&known),
            true => walk(tree, |index, feature, missing_left| match self.ensemble.threshold(number, index) {
                Some(threshold) if !known[feature].is_nan() => threshold.is_left(row[feature]),
                _ => missing_left,
            }),
        })
    }

    /// The node of a tree's leaf, given its number, that a row reaches.
    pub(super) fn leaf_node(&self, number: usize, row: &[f64], encoded: &[i32]) -> usize {
        self.node(number, &self.ensemble.trees[number], &self.known(row), encoded)
    }

    /// The node that whole numbers reach: left if the number is below the threshold in the feature's units. `known` are the
    /// row's f32 values.
    fn node(&self, number: usize, tree: &Tree, known: &[f32], encoded: &[i32]) -> usize {
        let Encoder::Scaled(scales) = &self.encoder else { return tree.leaf_node(known) };
        walk(tree, |index, feature, missing_left| {
            let value = encoded[feature];
            let value = self.sentinel.map_or(value, |sentinel| sentinel.or_missing(value));
            match (value, self.ensemble.threshold(number, index)) {
                (MISSING_FEATURE, _) | (_, None) => missing_left,
                (value, Some(threshold)) => f64::from(value) < threshold.units(scales[feature]),
            }
        })
    }
}

/// The node of the leaf that is reached where `goes_left` answers for a split, its feature, and a missing value's side.
fn walk(tree: &Tree, goes_left: impl Fn(usize, usize, bool) -> bool) -> usize {
    let mut index = 0;
    while let Node::Split { feature, missing_left, left, right, .. } = &tree.nodes[index] {
        index = if goes_left(index, *feature, *missing_left) { *left } else { *right };
    }
    index
}

/// Rounding that may put two classes into another order than the library's.
#[derive(Clone, Copy)]
pub(super) struct Rounding {
    /// The farthest that a margin can be from the library's.
    largest: f64,
    /// True if sums of votes are exact, so that equal ones are equal in the library.
    ties_are_exact: bool,
}

impl Rounding {
    /// Rounding of a model's margins, and of its file's in f32.
    pub(super) fn of(model: &Model<'_>, reference: &Reference<'_>) -> Self {
        let (of_import, stated) = (reference.rounding(), bound(model));
        let is_f32 = model.leaf_type() == LeafType::F32;
        let ties_are_exact = reference.is_vote() && (is_f32 || stated <= of_import * (1.0 + 1e-6));
        Self { largest: if is_f32 { of_import } else { stated }, ties_are_exact }
    }

    /// True if it explains another class than the library's, if their margins are this far apart.
    pub(super) fn explains(self, gap: f64) -> bool {
        self.largest > 0.0 && gap <= 2.0 * self.largest && !(gap == 0.0 && self.ties_are_exact)
    }
}

/// A model's margins as the library has them: in nats, the trainer's own f32 if the model adds those, times the scale that
/// the model states.
pub fn margins(model: &Model<'_>, encoded: &[i32]) -> Vec<f64> {
    let objects = model.object_count();
    if model.leaf_type() == LeafType::F32 {
        let mut margins = vec![0.0_f32; objects];
        model.f32_margins_of(encoded, &mut margins);
        let scale = model.prediction().scale;
        return margins.into_iter().map(|margin| f64::from(margin * scale)).collect();
    }
    let mut margins = vec![0; objects];
    model.margins_of(encoded, &mut margins);
    let scales = scales(model);
    margins.into_iter().zip(scales).map(|(margin, [unit, offset])| f64::from(margin) * unit + offset).collect()
}

/// Size of one unit of a margin in the library, in nats, where all outputs have the same: the model's unit times the scale that
/// it states.
pub fn unit(model: &Model<'_>) -> f64 {
    f64::from(model.unit()) * f64::from(model.prediction().scale)
}

/// For each output the size of a unit of its margin in the library, and what is added: the model's unit times the scale that it
/// states, and the offset.
pub(super) fn scales(model: &Model<'_>) -> Vec<[f64; 2]> {
    let scale = model.prediction().scale;
    let of = |output| {
        let own = model.output_scale(output).unwrap_or(OutputScale { scale, offset: 0.0 });
        [f64::from(model.unit()) * f64::from(own.scale), f64::from(own.offset)]
    };
    (0..model.object_count()).map(of).collect()
}

/// The farthest that a margin of any output can be from the library's own.
pub fn bound(model: &Model<'_>) -> f64 {
    f64::from(model.margin_error()) * f64::from(model.prediction().scale)
}
