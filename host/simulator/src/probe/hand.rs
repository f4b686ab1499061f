//! The end of an approach: how far the hand goes, and the contacts that it therefore never makes.
//!
//! A hand goes on after the first contact, while that finger gives way or is drawn back, until it has moved by its stroke.
//! Another finger's later contact never happens: it is missing, like one that does not exist. Without any
//! contact the hand goes on for its travel, and the approach is a miss.
//!
//! The stroke counts at the nominal speed, so that it is a time on the clock of every part that measures contacts: of an
//! effector, which stops waiting for a finger, as well as of a recording, in which no contact is later. Speeds ripple, clocks
//! and lengths are a little off, and a stroke that was estimated is known to its interval: a recorded contact that is later by
//! no more than that is late, and missing like any other; one that is later still was made by a hand with another stroke.

use super::approach::{FINGERS, Probe};
use palpate_shared::{ContactTime, Touch};

/// A recorded contact may be later than the stroke by this share of it: speeds ripple, clocks and lengths are a little off.
pub const TOLERANCE: f64 = 0.02;

/// Reason why a finger has no contact, though the object lies in its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Unreached {
    /// The hand had stopped: the contact is farther behind the first one than the stroke.
    Stroke,
    /// The hand had turned back without a contact: the object is farther away than the travel.
    Travel,
}

impl Probe {
    /// The stroke as a time: the latest contact after the first one, in microseconds. None without a stroke.
    pub fn window(&self) -> Option<u32> {
        let micros = |stroke: f64| (stroke / self.speed * 1e6).round().clamp(0.0, f64::from(u32::MAX - 1)) as u32;
        self.stroke.map(micros)
    }

    /// The latest recorded contact that a hand with this stroke can have made, as a time after the first one, in microseconds.
    /// None without a stroke.
    pub fn latest(&self) -> Option<f64> {
        let tolerance = self.stroke_tolerance.map(|length| length / self.speed * 1e6);
        self.window().map(f64::from).map(|window| window + tolerance.unwrap_or(TOLERANCE * window))
    }

    /// The distances of an approach without those behind the end of the travel: all, if the first contact is. The second
    /// value is true for an approach that ends there.
    pub fn within_travel(&self, distances: [Option<f64>; FINGERS]) -> ([Option<f64>; FINGERS], bool) {
        let first = distances.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        match self.travel {
            Some(travel) if first.is_finite() && first > travel => ([None; FINGERS], true),
            _ => (distances, false),
        }
    }
}

/// The fingers whose contact in a touch is later than `window` microseconds.
pub fn late(touch: &Touch, window: Option<u32>) -> [bool; FINGERS] {
    let is_late = |time: ContactTime| time.micros().zip(window).is_some_and(|(micros, window)| micros > window);
    touch.times().map(is_late)
}

/// The touch without the contacts that are later than `window` microseconds; the same without a window.
#[must_use]
pub fn within(touch: &Touch, window: Option<u32>) -> Touch {
    let late = late(touch, window);
    if late == [false; FINGERS] {
        return *touch;
    }
    let mut times = touch.times();
    times.iter_mut().zip(late).filter(|(_, late)| *late).for_each(|(time, _)| *time = ContactTime::MISSING);
    touch.with_times(times)
}
