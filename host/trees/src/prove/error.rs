//! Problems with proofs.

use crate::error::Variant;

/// Problems with proofs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProofProblem {
    /// A statement of the model is not the ensemble's.
    #[error("the model's {what} are not the ensemble's: {model}, and not {ensemble}")]
    Statement {
        /// The statements that differ, in the plural.
        what: &'static str,
        /// The model's.
        model: String,
        /// The ensemble's.
        ensemble: String,
    },
    /// A tree adds something else for some rows.
    #[error(
        "for some rows the model's tree {tree} adds {model:e} to {output} where tree {source_tree} of the ensemble has {ensemble:e}: {rows}"
    )]
    Leaf {
        /// The model's tree, counted from 0.
        tree: usize,
        /// The ensemble's tree, or the first of those that were merged.
        source_tree: usize,
        /// The output's name.
        output: String,
        /// The model's addend.
        model: f64,
        /// The ensemble's addend.
        ensemble: f64,
        /// The rows.
        rows: String,
    },
    /// Base margins differ.
    #[error("the model's margin of {output} starts from {model:e}, where the ensemble starts from {ensemble:e}")]
    Base {
        /// The output's name.
        output: String,
        /// The model's.
        model: f64,
        /// The ensemble's.
        ensemble: f64,
    },
    /// Trees of the ensemble are missing, or there are too many.
    #[error("the model's trees stand for other trees than the ensemble's: {what}")]
    Trees {
        /// The trees, and the fault.
        what: String,
    },
    /// Margins are farther from the ensemble's than the model states.
    #[error("a margin differs by {found:e} for some row, more than the {stated:e} that the model states")]
    Beyond {
        /// The model's statement.
        stated: f64,
        /// The largest difference.
        found: f64,
    },
    /// The chip's code computes another margin than the model's leaves add up to.
    #[error("the chip's code gives {chip:e} for {output} where the model's leaves add up to {read:e}: {rows}")]
    Chip {
        /// The output's name.
        output: String,
        /// The chip's margin.
        chip: f64,
        /// The sum of the leaves.
        read: f64,
        /// The row.
        rows: String,
    },
    /// Bytes that are accepted as a model break the format.
    #[error("the model does not follow its format: {what}")]
    Format {
        /// The fault.
        what: &'static str,
    },
}

impl Variant for ProofProblem {
    fn fix(&self) -> String {
        match self {
            Self::Format { .. } => "Export the model again.",
            _ => {
                "Give the file that the model was exported from, with the same --missing and --all-trees; if it is that, export the model again."
            }
        }
        .into()
    }
}
