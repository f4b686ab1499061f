//! Problems with proofs and certificates.

use crate::error::Problem;

/// Problems with proofs and certificates.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProofProblem {
    /// A certificate has no end.
    #[error("the certificate is cut off: it states {stated} of {outputs} outputs")]
    Cut {
        /// Number of outputs that it states.
        stated: usize,
        /// Number of the ensemble's outputs.
        outputs: usize,
    },
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
    /// A cell of a table holds something else than the ensemble for some rows.
    #[error("for some rows the model's table has {model:e} for {output} where the ensemble has {ensemble:e}: {rows}")]
    Cell {
        /// The output's name.
        output: String,
        /// The model's.
        model: f64,
        /// The ensemble's.
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
    /// A walk may end although a class is not known yet.
    #[error(
        "after {trees} trees a walk may end with a lead of {stated:e}, although the other trees can change {found:e}"
    )]
    Exit {
        /// Trees before it.
        trees: usize,
        /// The lead with which it ends, in the library's margins.
        stated: f64,
        /// The most that the following trees change.
        found: f64,
    },
    /// Assembly that is not understood, or does something else than adding up trees.
    #[error("line {line} of the assembly: {what}")]
    Assembly {
        /// The line.
        line: usize,
        /// The fault.
        what: String,
    },
    /// The model has one output.
    #[error("the model has one output, and no class that could change")]
    NoClass,
    /// Bytes that are accepted as a model break the format.
    #[error("the model does not follow its format: {what}")]
    Format {
        /// The fault.
        what: &'static str,
    },
    /// A line of a certificate is invalid.
    #[error("not a line of a certificate: {line:?}")]
    Line {
        /// The line.
        line: String,
    },
    /// The certificate is about another file.
    #[error("the certificate is about {what} with the checksum {stated:016x}, not {found:016x}")]
    OtherFile {
        /// The kind of file.
        what: &'static str,
        /// Its checksum in the certificate.
        stated: u64,
        /// Checksum of the file.
        found: u64,
    },
    /// The certificate states less than there is.
    #[error("the certificate states {stated:e} as {what}, which is {found:e}")]
    Understated {
        /// The statement's name.
        what: String,
        /// The number in the certificate.
        stated: f64,
        /// The true number.
        found: f64,
    },
}

impl Problem for ProofProblem {
    fn fix(&self) -> String {
        match self {
            Self::Assembly { .. } => "Export the code again. Leaves with a value for each class are read only where they are votes.",
            Self::Line { .. } | Self::Cut { .. } => "Give the file that `palpate verify --prove FILE` wrote, unchanged.",
            Self::OtherFile { .. } | Self::Understated { .. } => {
                "Give the files that the certificate was made of, or make another with `palpate verify --prove FILE`."
            }
            Self::NoClass => "Give no rows with a regression.",
            Self::Format { .. } => "Export the model again.",
            _ => {
                "Give the file that the model was exported from, with the same --missing and --all-trees; if it is that, export the model again."
            }
        }
        .into()
    }
}
