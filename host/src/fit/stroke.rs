//! The stroke of the hand that made recorded touches: stated, or estimated from the recordings.
//!
//! If the simulated objects would be touched later and no recorded contact is, the hand had stopped at the latest contact or
//! after it: by about the time of one more contact, at the rate of the simulated ones there.

use super::words::Estimate;
use crate::error::{Result, problem};
use crate::probe::approach::Probe;
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Touch;
use palpate_shared::format::Counted;

/// Contacts that must be expected behind the latest one. None of as many comes by chance with a probability of e⁻¹².
const EXPECTED: f64 = 12.0;
/// A contact counts as expected behind the latest one if it is later by this factor: speeds are off.
const FAR: f64 = 1.2;
/// Contacts that would be expected between the latest one and the end of the stroke: at its likeliest value, and at the upper end
/// of its interval, which is exceeded by chance in e⁻³ of all cases.
const BEHIND: [f64; 2] = [1.0, 3.0];

/// The stroke of the recordings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stroke {
    /// Duration in milliseconds; none if the hand goes on past the objects.
    pub(super) window: Option<f64>,
    /// Estimate if it is not stated: in units, with its interval.
    pub(super) estimated: Option<Estimate>,
}

/// The stroke that the probe states or, where it states none, that the recordings show. `simulated` are approaches of the probe
/// as it should be to the object of each recording, which no stroke ended.
///
/// # Errors
/// Recordings that show another stroke than the probe states.
pub(super) fn stroke(recorded: &Dataset, simulated: &[&[Touch]], kept: Counted, probe: &Probe) -> Result<Stroke> {
    let stated = probe.window().map(f64::from);
    let spread = |touch: &Touch| f64::from(touch.spread());
    let latest =
        recorded.objects.iter().flat_map(|object| object.touches().iter().map(move |touch| (object, spread(touch))));
    let Some((object, latest)) = latest.max_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(Stroke::default()) };
    let length = |micros: f64| micros / 1e6 * probe.speed;
    let other = |found: String| {
        let (stroke, seconds) = (probe.stroke.unwrap_or_default(), stated.unwrap_or_default() / 1e6);
        problem!("the probe states a stroke of {stroke} ({seconds:.3} s), and in the recordings {found}").fix(
            "Give the stroke that the touches were recorded with, or none: it is then estimated from the recordings.",
        )
    };
    if probe.latest().is_some_and(|allowed| latest > allowed) {
        let found = format!("a contact with {} is {:.3} s after the first", object.name, latest / 1e6);
        return Err(other(found));
    }
    // Simulated contacts behind the latest recorded one, each with how often it would be expected among the recorded.
    let behind = |(own, simulated): (&ObjectTouches, &&[Touch])| -> Vec<(f64, f64)> {
        let is_kept = |touch: &&Touch| match kept {
            Counted::All => true,
            Counted::Contacts => !touch.is_empty(),
            Counted::Full => touch.is_full(),
        };
        let share = own.len() as f64 / simulated.iter().filter(is_kept).count().max(1) as f64;
        let later = simulated.iter().filter(is_kept).map(spread).filter(|micros| *micros > latest);
        later.map(|micros| (micros, share)).collect()
    };
    let mut behind: Vec<(f64, f64)> = recorded.objects.iter().zip(simulated).flat_map(behind).collect();
    behind.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_far = |micros: f64| micros > FAR * latest && stated.is_none_or(|stated| micros < stated);
    let expected: f64 = behind.iter().filter(|(micros, _)| is_far(*micros)).map(|(_, share)| share).sum();
    if expected < EXPECTED {
        return Ok(Stroke { window: stated.map(|stated| stated / 1e3), estimated: None });
    }
    if stated.is_some() {
        let found = format!(
            "no contact is later than {:.3} s after the first, where {expected:.0} would be expected to be",
            latest / 1e6
        );
        return Err(other(found));
    }
    // As many are expected in all: see above.
    let at = |wanted: f64| {
        let sums = behind.iter().scan(0.0, |sum, (micros, share)| {
            *sum += share;
            Some((*micros, *sum))
        });
        sums.filter(|(_, sum)| *sum <= wanted).last().map_or(latest, |(micros, _)| micros)
    };
    let [value, high] = BEHIND.map(at);
    let estimate = Estimate { value: length(value), low: Some(length(latest)), high: Some(length(high)) };
    Ok(Stroke { window: Some(value / 1e3), estimated: Some(estimate) })
}
