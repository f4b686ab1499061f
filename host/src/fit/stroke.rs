//! The stroke of the hand that made recorded touches: stated, or estimated from the recordings.
//!
//! Where the simulated objects would be touched later and no recorded contact is, the hand had stopped. The latest contact is
//! then the likeliest end of the stroke; the true one is later by about the time between two contacts there.

use super::words::Estimate;
use super::{FitProblem, Kept};
use crate::error::Result;
use crate::probe::approach::Probe;
use crate::probe::hand;
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Touch;

/// Contacts that must be expected behind the latest one. None of as many comes by chance with a probability of e⁻¹².
const EXPECTED: f64 = 12.0;
/// A contact counts as expected behind the latest one if it is later by this factor: speeds are off.
const FAR: f64 = 1.2;
/// The part of the stroke from whose contacts their density at its end is taken.
const END: f64 = 0.8;

/// The stroke of the recordings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stroke {
    /// As a time in milliseconds; none if the hand goes on past the objects.
    pub(super) window: Option<f64>,
    /// Where it is not stated, but estimated: in units, with its interval.
    pub(super) estimated: Option<Estimate>,
}

/// The stroke that the probe states or, where it states none, that the recordings show. `simulated` are approaches of the probe
/// as it should be to the object of each recording, which no stroke ended.
///
/// # Errors
/// [`FitProblem::OtherStroke`] if the recordings show another stroke than the probe states.
pub(super) fn stroke(
    recorded: &Dataset,
    simulated: &[&[Touch]],
    kept: Kept,
    probe: &Probe,
) -> Result<Stroke, FitProblem> {
    let stated = probe.window().map(f64::from);
    let spread = |touch: &Touch| f64::from(touch.spread());
    let latest =
        recorded.objects.iter().flat_map(|object| object.touches().iter().map(move |touch| (object, spread(touch))));
    let Some((object, latest)) = latest.max_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(Stroke::default()) };
    let length = |micros: f64| micros / 1e6 * probe.speed;
    let other = |found: String| FitProblem::OtherStroke {
        stated: format!("{} ({:.3} s)", probe.stroke.unwrap_or_default(), stated.unwrap_or_default() / 1e6),
        found,
    };
    if stated.is_some_and(|stated| latest > stated * (1.0 + hand::TOLERANCE)) {
        let found = format!("a contact with {} is {:.3} s after the first", object.name, latest / 1e6);
        return Err(other(found));
    }
    let is_later = |micros: f64| micros > FAR * latest && stated.is_none_or(|stated| micros < stated);
    let expected = |(own, simulated): (&ObjectTouches, &&[Touch])| {
        let is_kept = |touch: &&Touch| match kept {
            Kept::All => true,
            Kept::Contacts => !touch.is_empty(),
            Kept::Full => touch.is_full(),
        };
        let all = simulated.iter().filter(is_kept);
        let later = all.clone().filter(|touch| is_later(spread(touch))).count();
        own.len() as f64 * later as f64 / all.count().max(1) as f64
    };
    let expected: f64 = recorded.objects.iter().zip(simulated).map(expected).sum();
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
    let near = recorded.touches().filter(|touch| spread(touch) > END * latest).count().max(1);
    let gap = (1.0 - END) * latest / near as f64;
    // Three gaps are exceeded by chance in e⁻³ of all cases.
    let [value, high] = [latest + gap, latest + 3.0 * gap].map(length);
    let estimate = Estimate { value, low: Some(length(latest)), high: Some(high) };
    Ok(Stroke { window: Some((latest + gap) / 1e3), estimated: Some(estimate) })
}
