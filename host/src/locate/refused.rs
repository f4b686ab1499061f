//! Touches and maps that are refused: limits, and problems that several files find.

use crate::error::{Error, Kind, Result, problem};
use palpate_onboard::ModelError;

/// Farthest place and greatest height, in millimeters: a locator keeps no farther ones.
pub(crate) const FARTHEST: f64 = 2_000.0;
/// Distance below the table at which a finger cannot have stopped, in millimeters.
pub(crate) const BELOW: f64 = 15.0;

/// Refuses places and heights in millimeters that no locator keeps.
pub(super) fn reachable(stated: impl IntoIterator<Item = (&'static str, f64)>) -> Result<()> {
    match stated.into_iter().find(|(_, millimeters)| millimeters.is_nan() || millimeters.abs() > FARTHEST) {
        Some((what, millimeters)) => Err(problem!(
            "{what} is {millimeters} mm, and places and heights are at most {FARTHEST} mm from the table's origin"
        )
        .fix("State it in millimeters, in a frame whose origin is on the table.")),
        None => Ok(()),
    }
}

/// The problem of a touch without a position.
pub(super) fn nowhere() -> Error {
    problem!("the touch has no position")
        .fix("Give twelve columns: times, direction, alignment, and the hand's position in millimeters.")
}

/// The problem of a finger that stopped below the table.
pub(super) fn too_low(millimeters: f64) -> Error {
    problem!("a finger stopped {millimeters:.0} mm below the table")
        .fix("Give times in seconds, and the position in millimeters above the table.")
}

/// The problem of a hand that comes from another direction.
pub(super) fn not_down() -> Error {
    problem!("it does not come straight down")
        .fix("Come straight down, and state the direction in the table's frame: its z is at most -0.95.")
        .as_kind(Kind::NotDown)
}

/// The problem of an object, or of its placement where there is one, that no touch met.
pub(super) fn not_met(object: &str, placement: &str) -> Error {
    problem!("{object}: no touch met it{}", in_placement(placement)).fix("Touch it, or leave it out.")
}

/// The placement in words, if there is one.
fn in_placement(placement: &str) -> String {
    if placement.is_empty() { String::new() } else { format!(" in the placement {placement:?}") }
}

/// The problem of bytes that are no model of maps.
pub fn refused(error: ModelError) -> Error {
    problem!("{error}")
        .fix("Make the maps again (`palpate maps train`); models of trees are for `recognize` without positions.")
}

/// The problem of maps that state no hand in millimeters.
pub fn no_hand() -> Error {
    problem!("the maps do not state the hand that they were made with")
        .fix("Make them again with a probe in millimeters (`palpate maps train --probe`).")
}

/// The problem of a model of trees where one of maps is needed.
pub fn not_maps() -> Error {
    problem!("a model of trees, not of maps")
        .fix("Make maps (`palpate maps train`), or give what recognizes without positions.")
}

/// The problem of a placement that is too large for a map.
pub(super) fn too_large(object: &str, placement: &str) -> Error {
    problem!("{object}: it is too large for a map{}", in_placement(placement))
        .fix("Use maps of 2 mm, or leave it out: a map reaches 250 cells from its middle.")
}
