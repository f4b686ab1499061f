//! A touch from numbers, as tables and arrays hold them.

use super::text::{contact_time, position, unit_vector};
use crate::error::TouchesProblem;
use palpate_shared::{ContactTime, Pose, Touch};

/// The touch of three contact times in seconds on any common clock, none for a finger that never touched, and the probe's
/// direction and alignment (unit vectors) if they are known. They are rounded and checked like
/// [a line of text](super::parse_touch).
///
/// # Errors
/// Describes the wrong number, or says that only one of direction and alignment is there.
pub fn touch_of_seconds(
    times: [Option<f64>; 3],
    direction: Option<[f64; 3]>,
    alignment: Option<[f64; 3]>,
) -> Result<Touch, TouchesProblem> {
    let time = |time: Option<f64>| time.map_or(Ok(ContactTime::MISSING), contact_time);
    let [first, middle, last] = times;
    let touch = Touch::new([time(first)?, time(middle)?, time(last)?]);
    match (direction, alignment) {
        (None, None) => Ok(touch),
        (Some(direction), Some(alignment)) => Ok(touch.with_pose(Pose {
            direction: unit_vector("direction", direction)?,
            alignment: unit_vector("alignment", alignment)?,
        })),
        (Some(_), None) => Err(TouchesProblem::HalfPose { there: "direction", missing: "alignment" }),
        (None, Some(_)) => Err(TouchesProblem::HalfPose { there: "alignment", missing: "direction" }),
    }
}

/// The touch with the hand's position, which is in millimeters and is rounded and checked like
/// [a line of text](super::parse_touch).
///
/// # Errors
/// Describes the wrong number, or says that the touch has no pose.
pub fn located(touch: Touch, millimeters: [f64; 3]) -> Result<Touch, TouchesProblem> {
    if let Some(wrong) = millimeters.iter().find(|coordinate| !coordinate.is_finite()) {
        return Err(TouchesProblem::NotFinite { text: format!("the coordinate {wrong}") });
    }
    let position = position(millimeters)?;
    touch.pose().map(|_| touch.with_position(position)).ok_or(TouchesProblem::PositionWithoutPose)
}
