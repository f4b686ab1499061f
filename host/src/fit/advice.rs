//! Advice on what recordings cannot determine, and what to record next.

use super::layer::MAX_ANGLE;
use super::outcome::{Fit, Warning};
use super::timer::Timer;
use super::words::{Estimate, NOT_TOLD, between, offset_between};

/// Width of an interval above which there is a warning: of the speed, of offsets in milliseconds, of shares of missed contacts.
const SPEED: f64 = 0.08;
const OFFSET: f64 = 5.0;
const MISSED: f64 = 0.08;
/// Amount in milliseconds by which the noise may be above its likeliest value without a warning: a model that is trained for that
/// much too little loses half a point after 60 approaches, and one that is trained for too much loses a tenth
/// (`docs/measurements/fit.md`).
const NOISE: f64 = 2.5;
/// Largest noise in milliseconds for which training was measured to cost little.
const MUCH_NOISE: f64 = 5.0;
/// Largest proposed length of a recording, as a multiple of the present one.
const MOST: f64 = 30.0;

pub(super) fn warnings(fit: &Fit, timer: Timer) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |what: &str, told: String, record: String| {
        warnings.push(Warning { what: what.into(), told, record });
    };
    let said = |estimate: &Estimate, scale, digits, unit: &str| {
        let between = between(estimate, scale, digits);
        if between == NOT_TOLD { between } else { format!("{between}{unit}") }
    };
    let all = fit.recorded.max(1) as f64;
    // An interval shrinks with the root of the number of touches.
    let more = |width: Option<f64>, wanted: f64| match width.map(|width| (width / wanted).powi(2)) {
        Some(times) if times * all <= MOST * all.max(200.0) => {
            // Two digits: it is no more than an estimate.
            let needed = (times * all).max(all + 50.0);
            let digit = 10.0_f64.powf(needed.log10().floor() - 1.0);
            format!("about {:.0} approaches in all", (needed / digit).ceil() * digit)
        }
        _ => "many more approaches, and to more objects".to_owned(),
    };
    let is_wide = |estimate: &Estimate, most: f64| estimate.width().is_none_or(|width| width > most);
    if is_wide(&fit.speed_factor, SPEED) {
        let record = format!(
            "Record {}, to objects of known size with curved and slanted surfaces; presses on a plate do not determine \
             it.",
            more(fit.speed_factor.width(), SPEED)
        );
        warn("the speed's factor", said(&fit.speed_factor, 1.0, 2, ""), record);
    }
    for (finger, late) in ["second", "third"].into_iter().zip(&fit.late) {
        if is_wide(late, OFFSET) {
            let record = match fit.presses {
                0 => "Press the probe on a flat plate 60 times, with half a turn after each, and give the file as the plate.".into(),
                presses => format!("Press the plate more often than {presses} times."),
            };
            warn(&format!("the {finger} finger's offset"), offset_between(late, 1), record);
        }
    }
    let coarse = fit.timer.is_some_and(|timer| fit.noise.high.is_some_and(|high| high < 0.35 * timer));
    if coarse {
        let record = "It is below the timer's resolution; a finer timer would show it.".into();
        warn("the noise", said(&fit.noise, 1.0, 2, " ms"), record);
    } else if fit.noise.high.is_none_or(|high| high > fit.noise.value + NOISE) {
        let above = fit.noise.high.map(|high| high - fit.noise.value);
        let record = match fit.noise.high.filter(|high| *high <= MUCH_NOISE) {
            None => format!("Record {}.", more(above, NOISE)),
            Some(high) => format!(
                "Train for the upper end (noise = \"{high:.2}ms\" in the file): too much noise in training costs hardly any accuracy, \
                 too little does. Or record {}.",
                more(above, NOISE)
            ),
        };
        warn("the noise", said(&fit.noise, 1.0, 2, " ms"), record);
    }
    match &fit.missed {
        None => {
            let record = "Record every approach, also those that not all fingers touch.".into();
            warn("missed contacts", "only full touches were recorded".into(), record);
        }
        Some(missed) => {
            for (finger, share) in ["first", "second", "third"].into_iter().zip(missed) {
                if is_wide(share, MISSED) {
                    let record = format!("Record {}.", more(share.width(), MISSED));
                    warn(&format!("what the {finger} finger misses"), said(share, 100.0, 1, " %"), record);
                }
            }
        }
    }
    if let Some(grazing) = fit.grazing.filter(|grazing| grazing.angle.low.is_none() && grazing.angle.high.is_none()) {
        let record = format!(
            "Record {}. If the fingers are rigid, take the line grazing out of the probe file.",
            more(grazing.angle.width(), MAX_ANGLE)
        );
        warn("the angle beyond which fingers bend", NOT_TOLD.into(), record);
    }
    if timer == Timer::Unknown {
        let record = "Record more touches with two or three contacts.".into();
        warn("the timer's resolution", "too few times".into(), record);
    }
    warnings
}
