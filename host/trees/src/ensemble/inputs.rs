//! Features of an ensemble.

/// Features that a model computes from measurements: whole numbers. Trees know nothing of their meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Schema {
    /// Code in a model's header.
    pub code: u8,
    /// Name in an ensemble's file.
    pub name: &'static str,
    /// Names of the features, in order.
    pub features: &'static [&'static str],
    /// Name of the measurements, in the plural, for messages.
    pub of: &'static str,
    /// Whole numbers that thresholds are rounded to, for messages.
    pub whole: &'static str,
    /// Units to train in, for messages.
    pub units: &'static str,
    /// Values of the features that occur together, in planes; none if any may.
    pub planes: &'static [&'static [Occurring]],
    /// True if each row is in one plane, which leaves few values for each feature.
    pub has_all_planes: bool,
}

/// Values of a feature in a plane of a [`Schema`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occurring {
    /// Any value, or a missing one.
    Any,
    /// Any value but a missing one.
    Known,
    /// This value alone.
    Only(i32),
    /// A missing value alone.
    Missing,
}

/// Features of an ensemble.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Inputs {
    /// Whole numbers that the model computes.
    Computed(Schema),
    /// Rows of f32 values with these names, NaN where one is missing: an ensemble that was trained elsewhere.
    Rows(Vec<String>),
}

impl Inputs {
    /// Rows of `count` features that have no names of their own: f0, f1 and so on.
    pub fn unnamed(count: usize) -> Self {
        Self::Rows((0..count).map(Self::default_name).collect())
    }

    /// Rows of features with these names, as a file's: where a model cannot hold one it is changed, and a note says so.
    pub fn named(names: Vec<String>, notes: &mut Vec<String>) -> Self {
        Self::Rows(super::columns::held(names, notes))
    }

    /// The name of a feature that has none of its own.
    pub(crate) fn default_name(index: usize) -> String {
        format!("f{index}")
    }

    /// The schema of features that the model computes; none of rows.
    pub(crate) fn schema(&self) -> Option<&Schema> {
        match self {
            Self::Computed(schema) => Some(schema),
            Self::Rows(_) => None,
        }
    }

    /// Number of features.
    pub fn count(&self) -> usize {
        match self {
            Self::Computed(schema) => schema.features.len(),
            Self::Rows(names) => names.len(),
        }
    }

    /// The features' names, in order.
    pub fn names(&self) -> Vec<&str> {
        match self {
            Self::Computed(schema) => schema.features.to_vec(),
            Self::Rows(names) => names.iter().map(String::as_str).collect(),
        }
    }

    /// True if features have names.
    pub(crate) fn are_named(&self) -> bool {
        match self {
            Self::Computed(_) => true,
            Self::Rows(names) => Self::has_names(names),
        }
    }

    /// True if some of these names are not the default ones.
    pub(super) fn has_names(names: &[String]) -> bool {
        names.iter().enumerate().any(|(index, name)| *name != Self::default_name(index))
    }
}

impl From<Schema> for Inputs {
    fn from(schema: Schema) -> Self {
        Self::Computed(schema)
    }
}

/// Schema of a descriptor's features, without planes.
#[cfg(test)]
pub(crate) fn computed(descriptor: palpate_shared::Descriptor) -> Schema {
    Schema {
        code: descriptor.code(),
        name: descriptor.name(),
        features: descriptor.feature_names(),
        of: "things",
        whole: "whole units",
        units: "units",
        planes: &[],
        has_all_planes: false,
    }
}
