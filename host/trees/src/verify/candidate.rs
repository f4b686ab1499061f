//! A model of either kind.

use crate::compile;
use crate::ensemble::Ensemble;
use palpate_onboard::Model;
use palpate_shared::Descriptor;
use palpate_shared::format::TrainedTouches;

/// A model that can be evaluated.
#[derive(Clone, Copy, Debug)]
pub enum Candidate<'m> {
    /// The full model: f32 margins.
    Full(&'m Ensemble),
    /// A compiled model, evaluated by the onboard crate.
    Compiled(&'m Model<'m>),
}

impl Candidate<'_> {
    /// True if the model is over touches; otherwise it is over rows of features.
    pub fn is_of_touches(&self) -> bool {
        self.descriptor().is_some()
    }

    /// The descriptor, if the model is over touches.
    pub fn descriptor(&self) -> Option<Descriptor> {
        match self {
            Self::Full(ensemble) => ensemble.descriptor(),
            Self::Compiled(model) => model.descriptor(),
        }
    }

    /// The touches that are evidence to the model.
    pub fn trained_touches(&self) -> TrainedTouches {
        match self {
            Self::Full(ensemble) => ensemble.trained_touches(),
            Self::Compiled(model) => model.trained_touches(),
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
