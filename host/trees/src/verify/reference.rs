//! One row's margins: of the ensemble as a compiled model compares, and of the model.

use crate::ensemble::{Ensemble, Node, Output, Tree};
use crate::rows::Encoder;
use palpate_onboard::Model;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{LeafType, Sentinel};

/// The ensemble as a model compares: values as f32, or as whole numbers of the features' units.
pub(super) struct Reference<'a> {
    pub(super) ensemble: &'a Ensemble,
    pub(super) encoder: Encoder,
    /// The features that stand for a missing value in the model.
    pub(super) sentinel: Option<Sentinel>,
}

impl<'a> Reference<'a> {
    /// The ensemble as `model` compares.
    pub(super) fn new(ensemble: &'a Ensemble, model: &Model<'_>) -> Self {
        Self { ensemble, encoder: Encoder::of(model), sentinel: model.sentinel() }
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

    /// The margins of the model's input.
    pub(super) fn margins(&self, row: &[f64], encoded: &[i32]) -> Vec<f32> {
        match &self.encoder {
            Encoder::Real => self.ensemble.margins_of_features(&singles(row)),
            Encoder::Scaled(scales) => {
                self.ensemble.margins_of_leaves(|number, tree| self.scaled_leaf(number, tree, encoded, scales))
            }
        }
    }

    /// The leaf of a tree, given by its number, that a row reaches.
    pub(super) fn leaf(&self, number: usize, row: &[f64], encoded: &[i32]) -> &'a [f32] {
        let tree = &self.ensemble.trees[number];
        match &self.encoder {
            Encoder::Real => tree.leaf(&self.ensemble.known_features(&singles(row))),
            Encoder::Scaled(scales) => self.scaled_leaf(number, tree, encoded, scales),
        }
    }

    /// The leaf that whole numbers reach: left if the number is below the threshold in the feature's units.
    fn scaled_leaf<'t>(&self, number: usize, tree: &'t Tree, encoded: &[i32], scales: &[f32]) -> &'t [f32] {
        let mut index = 0;
        loop {
            match &tree.nodes[index] {
                Node::Leaf(values) => return values,
                Node::Split { feature, missing_left, left, right, .. } => {
                    let value = encoded[*feature];
                    let value = self.sentinel.map_or(value, |sentinel| sentinel.or_missing(value));
                    let threshold = self.ensemble.threshold(number, index);
                    let goes_left = match (value, threshold) {
                        (MISSING_FEATURE, _) | (_, None) => *missing_left,
                        (value, Some(threshold)) => f64::from(value) < threshold.units(scales[*feature]),
                    };
                    index = if goes_left { *left } else { *right };
                }
            }
        }
    }
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

fn singles(row: &[f64]) -> Vec<f32> {
    row.iter().map(|&value| value as f32).collect()
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
    let unit = unit(model);
    let mut margins = vec![0; objects];
    model.margins_of(encoded, &mut margins);
    margins.into_iter().map(|margin| f64::from(margin) * unit).collect()
}

/// Size of one unit of a margin in the library, in nats: the model's unit times the scale that it states.
pub fn unit(model: &Model<'_>) -> f64 {
    f64::from(model.unit()) * f64::from(model.prediction().scale)
}

/// The farthest that a margin can be from the library's own.
pub fn bound(model: &Model<'_>) -> f64 {
    f64::from(model.margin_error()) * f64::from(model.prediction().scale)
}
