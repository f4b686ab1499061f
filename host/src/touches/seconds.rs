//! A touch from numbers, as tables and arrays hold them, and times that are plausible.

use crate::error::{Error, Result, problem};
use crate::probe::approach::to_q15;
use palpate_shared::format::Length;
use palpate_shared::{ContactTime, Pose, Position, Touch};
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
) -> Result<Touch> {
    let half = |there, missing| Err(problem!("{there} without {missing}").fix("Give both or neither."));
    let touch = Touch::new(contact_times(times)?);
    match (direction, alignment) {
        (None, None) => Ok(touch),
        (Some(direction), Some(alignment)) => Ok(touch.with_pose(Pose {
            direction: unit_vector("direction", direction)?,
            alignment: unit_vector("alignment", alignment)?,
        })),
        (Some(_), None) => half("a direction", "an alignment"),
        (None, Some(_)) => half("an alignment", "a direction"),
    }
}

/// The touch with the hand's position, which is in millimeters and is rounded and checked like
/// [a line of text](super::parse_touch).
///
/// # Errors
/// Describes the wrong number, or says that the touch has no pose.
pub fn located(touch: Touch, millimeters: [f64; 3]) -> Result<Touch> {
    if let Some(wrong) = millimeters.iter().find(|coordinate| !coordinate.is_finite()) {
        return Err(wrong_number(format_args!("the coordinate {wrong} is not finite")));
    }
    let position = position(millimeters)?;
    let unposed = || problem!("a position without a pose").fix("Give direction and alignment, too.");
    touch.pose().map(|_| touch.with_position(position)).ok_or_else(unposed)
}

/// The problem of a touch with a wrong number.
fn wrong_number(what: impl fmt::Display) -> Error {
    problem!("{what}").fix(
        "Give three times in seconds, and optionally direction and alignment as unit vectors, and behind them the position in \
         millimeters.",
    )
}

/// A unit vector in Q15. Vectors that are not finite, or whose length is off by more than 1 %, are refused.
pub(super) fn unit_vector(name: &str, vector: [f64; 3]) -> Result<[i16; 3]> {
    let length = vector.iter().map(|cosine| cosine * cosine).sum::<f64>().sqrt();
    if (length - 1.0).abs() <= 0.01 {
        return Ok(vector.map(to_q15));
    }
    Err(wrong_number(format_args!("the {name} has length {length:.3} where a unit vector has 1")))
}

/// A position from millimeters, rounded to whole micrometers.
pub(super) fn position(millimeters: [f64; 3]) -> Result<Position> {
    let mut micrometers = [0; 3];
    for (whole, millimeters) in micrometers.iter_mut().zip(millimeters) {
        let rounded = (1e3 * millimeters).round();
        if !(f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&rounded) {
            let what = format_args!("the coordinate {millimeters} mm is farther than the 2147 m that a touch can hold");
            return Err(wrong_number(what));
        }
        *whole = rounded as i32;
    }
    Ok(Position { micrometers })
}

/// The longest contact time that a touch can hold, in microseconds.
const MOST: f64 = (u32::MAX - 1) as f64;

/// Seconds on any common clock as whole microseconds after the first contact.
pub(super) fn contact_times(seconds: [Option<f64>; 3]) -> Result<[ContactTime; 3]> {
    for seconds in seconds.into_iter().flatten() {
        if !seconds.is_finite() {
            return Err(wrong_number(format_args!("the time {seconds} is not finite")));
        }
        if seconds < 0.0 {
            return Err(wrong_number(format_args!("the time {seconds} is negative")));
        }
    }
    // Whole in f64, also where a clock counts from 1970.
    let micros = seconds.map(|seconds| seconds.map(|seconds| (seconds * 1e6).round()));
    let first = micros.into_iter().flatten().fold(f64::INFINITY, f64::min);
    let mut times = [ContactTime::MISSING; 3];
    for (time, micros) in times.iter_mut().zip(micros) {
        let Some(later) = micros.map(|micros| micros - first) else { continue };
        if later > MOST {
            let seconds = later / 1e6;
            let what = format_args!("a finger touched {seconds} s after the first, and a touch can hold 4294 s");
            return Err(wrong_number(what));
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
    /// The time, and the longest one.
    pub fn check(&self, touch: &Touch) -> Result<()> {
        let seconds = f64::from(touch.spread()) * 1e-6;
        if seconds <= self.seconds {
            return Ok(());
        }
        Err(problem!("a finger touched {seconds:.1} s after the first, but {}", self.why).fix(
            "Give times in seconds, not in milliseconds: 0.0622 for 62.2 ms. If they are in seconds, say which probe made them.",
        ))
    }

    /// Refuses touches of an object if half of those with two contacts at different times or more take longer, with the place of
    /// the first. Those with a position are compared by it instead.
    ///
    /// Cost: a pass over the touches.
    pub(super) fn check_all<'t, P>(&self, touches: impl Iterator<Item = (P, &'t Touch)>) -> Result<(), (P, Error)> {
        let (mut first, mut long, mut all) = (None, 0, 0);
        for (place, touch) in touches.filter(|(_, touch)| touch.spread() > 0 && touch.position().is_none()) {
            all += 1;
            if let Err(error) = self.check(touch) {
                long += 1;
                first.get_or_insert((place, error));
            }
        }
        first.filter(|_| 2 * long >= all).map_or(Ok(()), Err)
    }
}
