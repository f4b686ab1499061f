//! Problems with recognition of objects with a place.

use super::pose::Until;
use super::stated::FARTHEST;
use crate::error::Variant;
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
    /// There is nothing to learn from.
    #[error("there are no objects to make maps of")]
    NoObjects,
    /// No touch met an object, or it is too flat.
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
    /// A place or height is beyond what a locator keeps.
    #[error("{what} is {millimeters} mm, and places and heights are at most {} mm from the table's origin", FARTHEST)]
    Far {
        /// Coordinate or height.
        what: &'static str,
        /// Its value.
        millimeters: f64,
    },
    /// A hand comes from another direction.
    #[error("it does not come straight down")]
    NotDown,
    /// A finger met the bare table too rarely.
    #[error("finger {finger} met the table in only {presses} presses, of at least {least}")]
    FewPresses {
        /// Finger, from 1.
        finger: usize,
        /// Number of presses.
        presses: usize,
        /// Number of presses needed.
        least: usize,
    },
    /// Presses met something else than the bare table.
    #[error(
        "a contact is {:.1} mm {} the table, and {aside} of {contacts} contacts are not with it",
        off.abs(),
        if *off > 0.0 { "above" } else { "below" }
    )]
    NotBare {
        /// Distance of the farthest contact.
        off: f64,
        /// Number of contacts with something else.
        aside: usize,
        /// Number of all.
        contacts: usize,
    },
    /// Presses do not show the slope of the table.
    #[error("from these presses the slope of the table cannot be told from offsets of the fingertips")]
    OnePlace,
    /// The table is not level.
    #[error("the table rises by {rise:.1} mm in {reach:.0} mm, toward {toward:.0}° from the x axis")]
    Slanted {
        /// Rise.
        rise: f64,
        /// Distance.
        reach: f64,
        /// Direction.
        toward: f64,
    },
    /// Meshes were given for a model of trees.
    #[error("a model of trees, not of maps")]
    Trees,
    /// There is noise that a simulated table does not have.
    #[error("a simulated table has other noise")]
    Noise,
    /// Places do not become as sure as they are to be.
    #[error(
        "of {right} objects that were named rightly only {placed} had a place as sure as {} mm and {}° within {approaches} approaches",
        until.millimeters, until.degrees
    )]
    NeverPlaced {
        /// Objects that were named rightly.
        right: usize,
        /// Objects whose place became as sure.
        placed: usize,
        /// Place that was asked for.
        until: Until,
        /// Limit of approaches.
        approaches: u32,
    },
    /// A test for unknown objects finds too few of them.
    #[error(
        "a test for unknown objects is worth little here: of {sequences} sequences of objects that were left out in turn, {unknown} \
         ended as unknown"
    )]
    Untold {
        /// Sequences.
        sequences: usize,
        /// Sequences that ended as unknown.
        unknown: usize,
    },
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

impl Variant for LocateProblem {
    fn fix(&self) -> String {
        match self {
            Self::NoPosition { .. } => {
                "State the position of every touch, or of none: the last three columns of a line."
            }
            Self::Unit => "State the probe in millimeters.",
            Self::NoObjects => "Give at least one mesh, or touches of one object.",
            Self::NotMet { .. } => "Touch it, or leave it out.",
            Self::Placements { .. } => "Leave objects out, or placements that are rare.",
            Self::Large { .. } => "Use maps of 2 mm, or leave it out: a map reaches 250 cells from its middle.",
            Self::NameTooLong { .. } => "Give it a shorter name.",
            Self::Refused { .. } => "Train it again; models of trees are for `recognize` without positions.",
            Self::NoHand => "Train it on a data set whose probe is in millimeters.",
            Self::Nowhere => {
                "Give twelve columns: times, direction, alignment, and the hand's position in millimeters."
            }
            Self::Below { .. } => "Give times in seconds, and the position in millimeters above the table.",
            Self::Far { .. } => "State it in millimeters, in a frame whose origin is on the table.",
            Self::NotDown => {
                "Come straight down, and state the direction in the table's frame: its z is at most -0.95."
            }
            Self::FewPresses { .. } => "Record 20 presses, and look for a finger that often stays open.",
            Self::NotBare { .. } => "Press beside the object, on one level table.",
            Self::OnePlace => "Press all over the table, and turn the hand by half a turn after each press.",
            Self::Slanted { .. } => "Level the table, or turn the frame of positions so that z is 0 all over it.",
            Self::Trees => "Give a directory of touches, or a model that was trained on touches with a position.",
            Self::Noise => "Use noise, timer, missed (one share for all fingers), position and drift.",
            Self::Untold { .. } => {
                "Train maps on more approaches, of less noise or with smaller cells, or calibrate without the test."
            }
            Self::NeverPlaced { .. } => "Ask for less, such as 3 mm and 5 degrees, or allow more approaches.",
            Self::Missing { .. } | Self::Unknown { .. } => {
                "Give the objects that the model was trained on, all of them and no others."
            }
        }
        .into()
    }
}
