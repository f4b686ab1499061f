//! Problems with recognition of objects with a place.

use crate::error::Problem;
use palpate_onboard::ModelError;

/// Problems with recognition of objects with a place.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LocateProblem {
    /// A touch has no position.
    #[error("{object}: touch {touch} has no position")]
    NoPosition {
        /// The object.
        object: String,
        /// Number of the touch, from 1.
        touch: usize,
    },
    /// The data set is not in millimeters.
    #[error("the touches are not of objects at their true size")]
    Unit,
    /// No touch met an object.
    #[error("{object}: no touch met it{}", named(placement))]
    NotMet {
        /// The object.
        object: String,
        /// The placement.
        placement: String,
    },
    /// There are too many placements.
    #[error("there are {found} placements, and a model has at most 255")]
    Placements {
        /// Number of placements.
        found: usize,
    },
    /// A placement is too large for a map.
    #[error("{object}: it is too large for a map{}", named(placement))]
    Large {
        /// The object.
        object: String,
        /// The placement.
        placement: String,
    },
    /// A name is too long.
    #[error("the name {name:?} is longer than 255 bytes")]
    NameTooLong {
        /// The name.
        name: String,
    },
    /// Bytes are not a model of maps.
    #[error("{error}")]
    Refused {
        /// Reason.
        error: ModelError,
    },
    /// The model states no probe in millimeters.
    #[error("the maps do not state the hand that they were learned with")]
    NoHand,
    /// An object on the table is unknown to the model.
    #[error("the model does not know {object}")]
    Unknown {
        /// The object.
        object: String,
    },
}

fn named(placement: &str) -> String {
    if placement.is_empty() { String::new() } else { format!(" in the placement {placement:?}") }
}

impl Problem for LocateProblem {
    fn fix(&self) -> String {
        match self {
            Self::NoPosition { .. } => {
                "State the position of every touch, or of none: the last three columns of a line."
            }
            Self::Unit => "Capture with `--scene table --position`, or state the probe in millimeters.",
            Self::NotMet { .. } => "Touch it, or leave it out.",
            Self::Placements { .. } => "Leave objects out, or placements that are rare.",
            Self::Large { .. } => "Use maps of 2 mm, or leave it out: a map reaches 250 cells from its middle.",
            Self::NameTooLong { .. } => "Give it a shorter name.",
            Self::Refused { .. } => "Train it again; models of trees are for `recognize` without positions.",
            Self::NoHand => "Train it on a data set whose probe is in millimeters.",
            Self::Unknown { .. } => "Give the objects that the model was trained on.",
        }
        .into()
    }
}
