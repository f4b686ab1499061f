//! One row's margins: of the ensemble as a compiled model compares, and of the model.

use crate::ensemble::{Ensemble, Node, Output, Tree};
use crate::rows::Encoder;
use palpate_onboard::Model;
use palpate_shared::format::LeafType;

/// The ensemble as a model compares: values as they are, or as whole numbers of the features' units.
pub(super) struct Reference<'a> {
    pub(super) ensemble: &'a Ensemble,
    pub(super) encoder: Encoder,
}

impl Reference<'_> {
    /// The margins of what the model gets.
    pub(super) fn margins(&self, row: &[f32], encoded: &[i32]) -> Vec<f32> {
        let Encoder::Scaled(scales) = &self.encoder else { return self.ensemble.margins_of_features(row) };
        let mut margins = self.ensemble.base_margins.clone();
        for tree in &self.ensemble.trees {
            let leaf = scaled_leaf(tree, encoded, scales);
            match tree.output {
                Output::One(object) => margins[object] += leaf[0],
                Output::Each => margins.iter_mut().zip(leaf).for_each(|(margin, value)| *margin += value),
            }
        }
        margins
    }

    /// The leaf of a tree that a row reaches.
    pub(super) fn leaf<'t>(&self, tree: &'t Tree, row: &[f32], encoded: &[i32]) -> &'t [f32] {
        match &self.encoder {
            Encoder::Real => tree.leaf(row),
            Encoder::Scaled(scales) => scaled_leaf(tree, encoded, scales),
        }
    }
}

/// The leaf that whole numbers reach: left if the number is below the threshold in the feature's units.
fn scaled_leaf<'t>(tree: &'t Tree, encoded: &[i32], scales: &[f32]) -> &'t [f32] {
    let mut index = 0;
    loop {
        match &tree.nodes[index] {
            Node::Leaf(values) => return values,
            Node::Split { feature, threshold, missing_left, left, right } => {
                let goes_left = match encoded[*feature] {
                    palpate_shared::MISSING_FEATURE => *missing_left,
                    number => f64::from(number) < f64::from(*threshold) * f64::from(scales[*feature]),
                };
                index = if goes_left { *left } else { *right };
            }
        }
    }
}

/// A model's margins in nats: the trainer's own f32, if the model adds those.
pub fn margins(model: &Model<'_>, encoded: &[i32]) -> Vec<f64> {
    let objects = model.object_count();
    if model.leaf_type() == LeafType::F32 {
        let mut margins = vec![0.0_f32; objects];
        model.f32_margins_of(encoded, &mut margins);
        return margins.into_iter().map(f64::from).collect();
    }
    let mut margins = vec![0; objects];
    model.margins_of(encoded, &mut margins);
    margins.into_iter().map(|margin| f64::from(margin) * f64::from(model.unit())).collect()
}
