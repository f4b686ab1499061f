//! A model of either kind.

use crate::compile;
use crate::ensemble::Ensemble;
use palpate_onboard::Model;

/// A model that can be evaluated.
#[derive(Clone, Copy, Debug)]
pub enum Candidate<'m> {
    /// The full model: f32 margins.
    Full(&'m Ensemble),
    /// A compiled model, evaluated by the onboard crate.
    Compiled(&'m Model<'m>),
}

impl Candidate<'_> {
    /// True if the model is over rows of features; otherwise it computes its features.
    pub fn is_of_rows(&self) -> bool {
        match self {
            Self::Full(ensemble) => ensemble.schema().is_none(),
            Self::Compiled(model) => model.descriptor().is_none(),
        }
    }

    /// Number of objects that can be named: all but a background.
    pub fn known_count(&self) -> usize {
        match self {
            Self::Full(ensemble) => ensemble.known_count(),
            Self::Compiled(model) => model.known_count(),
        }
    }

    /// The names of the objects, in the order of the margins.
    pub fn objects(&self) -> Vec<String> {
        match self {
            Self::Full(ensemble) => ensemble.objects.clone(),
            Self::Compiled(model) => compile::names(model),
        }
    }
}
