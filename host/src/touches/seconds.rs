//! A touch from numbers, as tables and arrays hold them, and times that are plausible.

use super::ObjectTouches;
use super::text::{position, unit_vector};
use crate::error::TouchesProblem;
use palpate_shared::format::Length;
use palpate_shared::{ContactTime, Pose, Touch};
use std::borrow::Cow;
use std::fmt;

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
    let touch = Touch::new(contact_times(times)?);
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

/// The longest contact time that a touch can hold, in microseconds.
const MOST: f64 = (u32::MAX - 1) as f64;

/// Seconds on any common clock as whole microseconds after the first contact.
pub(super) fn contact_times(seconds: [Option<f64>; 3]) -> Result<[ContactTime; 3], TouchesProblem> {
    for seconds in seconds.into_iter().flatten() {
        if !seconds.is_finite() {
            return Err(TouchesProblem::NotFinite { text: format!("the time {seconds}") });
        }
        if seconds < 0.0 {
            return Err(TouchesProblem::NegativeTime { seconds });
        }
    }
    // Whole in f64, also where a clock counts from 1970.
    let micros = seconds.map(|seconds| seconds.map(|seconds| (seconds * 1e6).round()));
    let first = micros.into_iter().flatten().fold(f64::INFINITY, f64::min);
    let mut times = [ContactTime::MISSING; 3];
    for (time, micros) in times.iter_mut().zip(micros) {
        let Some(later) = micros.map(|micros| micros - first) else { continue };
        if later > MOST {
            return Err(TouchesProblem::LongTime { seconds: later / 1e6 });
        }
        *time = ContactTime::from_micros(later as u32);
    }
    Ok(times)
}

/// The longest time between two contacts of a touch that makes sense, and why: longer ones are not in seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Longest {
    seconds: f64,
    why: Cow<'static, str>,
}

/// The limit of features, where nothing else is known.
impl Default for Longest {
    fn default() -> Self {
        Self { seconds: 16.777, why: "features of a touch hold at most 16.8 s".into() }
    }
}

impl Longest {
    /// The time that a probe of this speed takes over the largest object of the scale of `whose`, such as a model.
    pub fn of_scale(whose: &str, seconds: f64, speed: impl fmt::Display, unit: Length) -> Self {
        let unit = if unit == Length::Millimeter { "mm" } else { "units" };
        let why = format!(
            "no object of {whose}'s scale takes longer than {seconds:.2} s at its speed of {speed} {unit} per second"
        );
        Self { seconds, why: why.into() }
    }

    /// Refuses a touch that takes longer.
    ///
    /// # Errors
    /// [`TouchesProblem::TimeTooLong`].
    pub fn check(&self, touch: &Touch) -> Result<(), TouchesProblem> {
        let seconds = f64::from(touch.spread()) * 1e-6;
        if seconds <= self.seconds {
            return Ok(());
        }
        Err(TouchesProblem::TimeTooLong { of: String::new(), seconds, why: self.why.clone() })
    }

    /// Refuses touches of an object if half of those with two contacts at different times or more take longer, with the place of
    /// the first. Those with a position are compared by it instead.
    ///
    /// Cost: a pass over the touches.
    pub(super) fn check_all<'t, P>(
        &self,
        touches: impl Iterator<Item = (P, &'t Touch)>,
    ) -> Result<(), (P, TouchesProblem)> {
        let (mut first, mut long, mut all) = (None, 0, 0);
        for (place, touch) in touches.filter(|(_, touch)| touch.spread() > 0 && touch.position().is_none()) {
            all += 1;
            if let Err(problem) = self.check(touch) {
                long += 1;
                first.get_or_insert((place, problem));
            }
        }
        first.filter(|_| 2 * long >= all).map_or(Ok(()), Err)
    }

    /// Refuses touches in memory that take longer, object by object.
    ///
    /// # Errors
    /// [`TouchesProblem::TimeTooLong`], with the object and the number of the touch.
    pub fn check_objects(&self, objects: &[ObjectTouches]) -> Result<(), TouchesProblem> {
        objects.iter().try_for_each(|object| {
            self.check_all((1..).zip(object.touches())).map_err(|(number, problem)| match problem {
                TouchesProblem::TimeTooLong { seconds, why, .. } => {
                    TouchesProblem::TimeTooLong { of: format!("touch {number} of {}: ", object.name), seconds, why }
                }
                other => other,
            })
        })
    }
}
