//! Features of an ensemble.

use palpate_shared::Descriptor;

/// Features of an ensemble.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Inputs {
    /// Those that a descriptor turns touches into: whole numbers.
    Touches(Descriptor),
    /// Rows of f32 values with these names, NaN where one is missing: an ensemble that was trained elsewhere.
    Rows(Vec<String>),
}

impl Inputs {
    /// Rows of `count` features that have no names of their own: f0, f1 and so on.
    pub fn unnamed(count: usize) -> Self {
        Self::Rows((0..count).map(Self::default_name).collect())
    }

    /// The name of a feature that has none of its own.
    pub(crate) fn default_name(index: usize) -> String {
        format!("f{index}")
    }

    /// The descriptor, if the features are those of touches.
    pub fn descriptor(&self) -> Option<Descriptor> {
        match self {
            Self::Touches(descriptor) => Some(*descriptor),
            Self::Rows(_) => None,
        }
    }

    /// Number of features.
    pub fn count(&self) -> usize {
        match self {
            Self::Touches(descriptor) => descriptor.feature_count(),
            Self::Rows(names) => names.len(),
        }
    }

    /// The features' names, in order.
    pub fn names(&self) -> Vec<&str> {
        match self {
            Self::Touches(descriptor) => descriptor.feature_names().to_vec(),
            Self::Rows(names) => names.iter().map(String::as_str).collect(),
        }
    }

    /// True if features have names.
    pub(crate) fn are_named(&self) -> bool {
        match self {
            Self::Touches(_) => true,
            Self::Rows(names) => Self::has_names(names),
        }
    }

    /// True if some of these names are not the default ones.
    pub(super) fn has_names(names: &[String]) -> bool {
        names.iter().enumerate().any(|(index, name)| *name != Self::default_name(index))
    }
}

impl From<Descriptor> for Inputs {
    fn from(descriptor: Descriptor) -> Self {
        Self::Touches(descriptor)
    }
}
