//! Problems with compiling, and compiled models.

use crate::error::TreeProblem;
use crate::error::Variant;
use palpate_onboard::ModelError;

/// Problems with compiling, and compiled models.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompileProblem {
    /// Bytes are not a model.
    #[error("{0}")]
    Model(ModelError),
    /// It is a model of maps.
    #[error("a model of maps, not of trees")]
    Maps,
    /// There are too few or too many objects, or other base margins than objects.
    #[error("cannot compile an ensemble of {objects} objects and {base_margins} base margins")]
    Objects {
        /// Objects.
        objects: usize,
        /// Base margins.
        base_margins: usize,
    },
    /// A tree contradicts itself.
    #[error("cannot compile the ensemble: tree {tree}: {problem}")]
    Tree {
        /// The tree, counted from 0.
        tree: usize,
        /// Description of the fault.
        problem: TreeProblem,
    },
    /// Leaves or base margins are too large.
    #[error(
        "cannot compile the ensemble: the margin of {of} can reach {range:e} (the largest single value is {largest:e}), beyond the {most} that a model can hold"
    )]
    MarginRange {
        /// The object or class, by name.
        of: String,
        /// Largest distance of its margin from 0.
        range: f64,
        /// The largest single value.
        largest: f32,
        /// The most that there may be, in nats.
        most: f64,
    },
    /// There are too few or too many features.
    #[error("cannot compile an ensemble over {features} features, which is not 1 to {most}")]
    Features {
        /// Features.
        features: usize,
        /// The most that there may be.
        most: usize,
    },
    /// Thresholds change when they are rounded up to whole numbers.
    #[error(
        "the ensemble was not trained on whole numbers: the threshold {example} of {feature} is neither whole nor halfway between two, and of {thresholds} thresholds {rounded} stay different when rounded to {whole}"
    )]
    Thresholds {
        /// The feature.
        feature: &'static str,
        /// Different thresholds.
        thresholds: usize,
        /// Different thresholds after rounding.
        rounded: usize,
        /// One that changes.
        example: f32,
        /// Name of what features are of, numbers that thresholds are rounded to, and units to train in, as in the
        /// [schema](crate::ensemble::Schema).
        of: &'static str,
        /// See `of`.
        whole: &'static str,
        /// See `of`.
        units: &'static str,
    },
    /// Sums of leaves do not fit integers.
    #[error("margins of {trees} trees are too large for sums of {leaf} leaves")]
    LeavesTooLarge {
        /// Trees.
        trees: usize,
        /// The leaves' type.
        leaf: &'static str,
    },
    /// There are more thresholds than two bytes number.
    #[error("the ensemble has {thresholds} different thresholds, and a model can have 65,536")]
    TooManyThresholds {
        /// Different thresholds.
        thresholds: usize,
    },
    /// A tree has more splits than two bytes number.
    #[error("the ensemble has a tree with {splits} splits, and a model's can have 65,535")]
    TooManySplits {
        /// Splits of the largest tree.
        splits: usize,
    },
    /// No code can be written of the trees.
    #[error(
        "the ensemble cannot become code: its leaves are f32 or beyond two bytes, or it has more thresholds than 256 columns hold"
    )]
    NoCode,
    /// A name is too long.
    #[error("the name {name:?} is too long for a model")]
    NameTooLong {
        /// The name.
        name: String,
    },
    /// There is more of something than the format can count.
    #[error("the ensemble is too large for the model format")]
    TooLarge,
    /// There is no room for the model.
    #[error("the model has {bytes} bytes at least, more than the {most} that fit")]
    OverBudget {
        /// The fewest bytes that were found.
        bytes: usize,
        /// The most that were asked for.
        most: usize,
    },
}

impl Variant for CompileProblem {
    fn fix(&self) -> String {
        match self {
            Self::Maps => {
                "`palpate inspect` and `recognize` take it, and `evaluate` with --objects and `calibrate` with --objects or --recorded alone; other commands take models of trees."
            }
            Self::Model(ModelError::NotAModel) => "Give a file that `palpate export` wrote.",
            Self::Model(ModelError::Version(_)) => "Export the ensemble again with this version of palpate.",
            Self::Model(ModelError::Length { .. } | ModelError::Checksum { .. }) => {
                "Copy the model again, or export it again."
            }
            Self::Model(ModelError::NeedsCode) => {
                "Trees as code can be neither proved nor inspected: export the model without --emit c-code or rust-code for that."
            }
            Self::Model(_) => "Export the model again with `palpate export`.",
            Self::Objects { .. } => "Give 1 to 256 objects, and one base margin for each.",
            Self::Tree { .. } => "Train it again, or check the program that wrote it.",
            Self::MarginRange { .. } => {
                "Margins are log-probabilities, and a few dozen nats already mean certainty: train it again, or check the program that wrote it."
            }
            Self::Features { .. } => "Train on the features that matter, at most 256.",
            Self::Thresholds { of, units, .. } => {
                return format!(
                    "Train on features in whole units: {units}. If it is not a model of {of}, remove its attribute palpate_descriptor: then its features are compared as they are."
                );
            }
            Self::NoCode => "Choose leaves of i16 or i8, or a model with its trees.",
            Self::TooManyThresholds { .. } => {
                "Round the features to the sensor's resolution before training, or compare whole numbers (`export --scale`, in Python `scales`), which makes thresholds equal; or train fewer trees. Splits may be as many."
            }
            Self::TooManySplits { .. } => "Train with fewer leaves in a tree.",
            Self::LeavesTooLarge { .. } => "Choose leaves of f32, or train fewer trees.",
            Self::TooLarge | Self::OverBudget { .. } => "Train fewer trees, or trees with fewer splits.",
            Self::NameTooLong { .. } => "Use names of at most 255 bytes.",
        }
        .into()
    }
}
