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
    /// A touch of a stream has no position.
    #[error("the touch has no position")]
    Nowhere,
    /// A finger stopped below the table.
    #[error("a finger stopped {millimeters:.0} mm below the table")]
    Below {
        /// Distance.
        millimeters: f64,
    },
    /// A touch came from another direction than straight down.
    #[error("it does not come straight down")]
    Slanted,
    /// Meshes were given for a model of trees.
    #[error("a model of trees, not of maps")]
    Trees,
    /// There is noise that a simulated table does not have.
    #[error("a simulated table has other noise")]
    Noise,
    /// An object of the model is not on the table.
    #[error("{object} is not among the objects to calibrate on")]
    Missing {
        /// The object.
        object: String,
    },
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
            Self::Nowhere => {
                "A model of maps needs twelve columns: times, direction, alignment, and the hand's position in millimeters."
            }
            Self::Below { .. } => "Give times in seconds, and the position in millimeters above the table.",
            Self::Slanted => "Come straight down: the z of its direction is at most -0.95.",
            Self::Trees => "Give a directory of touches, or a model that was trained on touches with a position.",
            Self::Noise => "Use noise, timer, missed (one share for all fingers), position and drift.",
            Self::Missing { .. } | Self::Unknown { .. } => "Give the objects that the model was trained on, all of them and no others.",
        }
        .into()
    }
}
