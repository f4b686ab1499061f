//! Results of a fit, and the probe file that states it.

use super::candidate::Hypothesis;
use super::layer::{Layer, MAX_ANGLE};
use super::search::{Best, Ends};
use super::words::{Estimate, NOT_TOLD, between, offset, offset_between};
use super::{Evidence, FitSettings, Timer};
use crate::probe::approach::{FINGERS, Probe};
use crate::probe::hand;
use crate::probe::noise::Noise;
use crate::touches::Surroundings;
use crate::with;
use palpate_shared::format::Counted;
use palpate_shared::format::Length;
use serde::Serialize;
use std::fmt::{self, Write as _};

/// Fingers that bend aside at flat angles: see [`Grazing`](crate::probe::noise::Grazing).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GrazingEstimate {
    /// In degrees.
    pub angle: Estimate,
    /// In milliseconds at the nominal speed.
    pub bend: Estimate,
}

/// Something that the recordings tell badly or not at all.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Warning {
    /// Name of the parameter: "the speed's factor".
    pub what: String,
    /// Its interval: "0.90 to 1.12".
    pub told: String,
    /// Advice on what to record, as a sentence.
    pub record: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}). {}", self.what, self.told, self.record)
    }
}

/// The probe that recorded touches came from. Times are in milliseconds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The probe as it should be.
    pub probe: Probe,
    /// Unit of its lengths.
    #[serde(with = "crate::probe::unit")]
    pub unit: Length,
    /// Its speed over the nominal one.
    pub speed_factor: Estimate,
    /// Delay of the second and the third finger, relative to the first.
    pub late: [Estimate; 2],
    /// Standard deviation of each contact time, without the timer's.
    pub noise: Estimate,
    /// The share of contacts that each finger misses; none where only full touches were recorded.
    pub missed: Option<[Estimate; FINGERS]>,
    /// The stroke where it was not stated, in the probe's unit; none if it was, or if the hand goes on past the objects.
    pub stroke: Option<Estimate>,
    /// Fingers that bend aside at flat angles; none where the recordings do not show it.
    pub grazing: Option<GrazingEstimate>,
    /// The timer's resolution; none if it is finer than 0.02 ms, or there are too few times to tell.
    pub timer: Option<f64>,
    /// Time between readings of the contacts in milliseconds, where contact times cluster about its multiples; none if they do not,
    /// or if it is the timer's resolution.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub readings: Option<f64>,
    /// Recorded touches and approaches.
    pub recorded: usize,
    /// Number of these with three contacts, and with two.
    pub contacts: [usize; 2],
    /// Presses on a flat plate.
    pub presses: usize,
    /// Names of the recorded objects, or placements.
    pub objects: Vec<String>,
    /// Surroundings of the objects.
    #[serde(skip_serializing_if = "Surroundings::is_floating")]
    pub scene: Surroundings,
    /// Warnings about numbers that the recordings cannot determine, and proposals for the next recording.
    pub warnings: Vec<Warning>,
}

/// Gathers results; warnings are still to come.
pub(super) fn outcome(
    evidence: &Evidence<'_>,
    best: &Best,
    ends: &[Ends],
    layer: &Layer,
    timer: Timer,
    settings: &FitSettings,
) -> Fit {
    let resolution = match timer {
        Timer::Found(micros) => Some(micros / 1e3),
        Timer::Fine | Timer::Unknown => None,
    };
    // The ends of the interval of a number, or of what falls where the number rises.
    let estimate = |number: usize, falls: bool, of: &dyn Fn(&Hypothesis) -> f64| {
        let at = |end: usize| ends.get(number).and_then(|ends| ends.ends[end].as_ref()).map(of);
        let (value, [low, high]) = (of(&best.candidate), if falls { [at(1), at(0)] } else { [at(0), at(1)] });
        // An end that falls short of the value, by rounding, is the value.
        Estimate { value, low: low.map(|low| low.min(value)), high: high.map(|high| high.max(value)) }
    };
    // A time rounded down to ticks of a clock with any phase has the variance of a uniform number.
    let ticks = resolution.unwrap_or(0.0) / 12.0_f64.sqrt();
    let noise = |candidate: &Hypothesis| (candidate.noise.powi(2) - ticks.powi(2)).max(0.0).sqrt();
    let only_full = evidence.plate.is_none() && evidence.recordings.iter().all(|own| own.kept == Counted::Full);
    let missed =
        [0, 1, 2].map(|finger: usize| estimate(4 + finger, false, &|candidate: &Hypothesis| candidate.missed[finger]));
    let stroke = evidence.stroke.estimated;
    let written = |length: f64| (1e4 * length).round() / 1e4;
    let probe = with!(
        settings.origin.probe,
        stroke = stroke.map(|stroke| written(stroke.value)).or(settings.origin.probe.stroke),
        stroke_tolerance = stroke.map(|stroke| written(tolerance(&stroke))).or(settings.origin.probe.stroke_tolerance)
    );
    let layered = |of: &dyn Fn(&Noise) -> f64| {
        let [low, high] = [0, 1].map(|end: usize| layer.ends.as_ref().map(|ends| of(&ends[end])));
        Estimate { value: of(&layer.real), low, high }
    };
    let bends = !layer.real.grazing.is_none();
    Fit {
        probe,
        unit: settings.origin.unit,
        speed_factor: estimate(0, true, &|candidate: &Hypothesis| 1.0 / candidate.factor),
        late: [1, 2].map(|finger: usize| estimate(finger, false, &|candidate: &Hypothesis| candidate.late[finger])),
        noise: estimate(3, false, &noise),
        missed: (!only_full).then_some(missed),
        stroke,
        grazing: bends.then_some(GrazingEstimate {
            angle: {
                let Estimate { value, low, high } = layered(&|real| real.grazing.angle);
                Estimate { value, low: low.filter(|low| *low > 0.0), high: high.filter(|high| *high < MAX_ANGLE) }
            },
            bend: layered(&|real| real.grazing.bend / 1e3),
        }),
        timer: resolution,
        readings: None,
        recorded: evidence.recordings.iter().map(|own| own.touches.len()).sum(),
        contacts: super::counts(evidence),
        presses: evidence.plate.as_ref().map_or(0, |plate| plate.count),
        objects: evidence.recordings.iter().map(|own| own.name.to_owned()).collect(),
        scene: settings.origin.scene,
        warnings: Vec::new(),
    }
}

/// Length by which contacts may be later than an estimated stroke: up to the end of its interval, and beyond it by the ripple of
/// the speed, which is allowed for where a stroke is stated too.
fn tolerance(stroke: &Estimate) -> f64 {
    stroke.high.unwrap_or(stroke.value) * (1.0 + hand::TOLERANCE) - stroke.value
}

impl Fit {
    /// The probe as the text of a `probe.toml`, with the intervals as comments.
    pub fn toml(&self) -> String {
        let Probe { radius, spacing, speed, tilt, stroke, travel, stroke_tolerance, .. } = self.probe;
        let unit = match self.unit {
            Length::Tenth => "# A unit is a tenth of the object's longest side.\nunit = \"unit\"\n",
            Length::Millimeter => "unit = \"mm\"\n",
        };
        let stands_out = |late: &Estimate| -late.value / 1e3 * speed;
        let presses =
            if self.presses > 0 { format!(" and {} presses on a plate", self.presses) } else { String::new() };
        let mut text = format!(
            "# Found by `palpate probe fit` from {} approaches to {}{}{presses}.\n\
             # Behind each value its 95 % interval, which supposes that probe and objects are as they are simulated.\n",
            self.recorded,
            self.objects.join(", "),
            if self.scene.is_floating() { "" } else { " on a table" },
        );
        // Writing to a string cannot fail.
        for warning in &self.warnings {
            _ = writeln!(text, "# Poorly determined: {warning}");
        }
        _ = writeln!(text, "{unit}radius = {radius:?}\nspacing = {spacing:?}\nspeed = {speed:?}\ntilt = {tilt:?}");
        if let Some(stroke) = stroke {
            let estimated = self.stroke.map_or_else(String::new, |stroke| {
                format!("  # {}: no recorded contact is later", between(&stroke, 1.0, 3))
            });
            _ = writeln!(text, "stroke = {stroke:?}{estimated}");
            if let Some(tolerance) = stroke_tolerance {
                let latest = stroke + tolerance;
                _ = writeln!(
                    text,
                    "stroke_tolerance = {tolerance:?}  # contacts up to {latest:.3} are late, and of this hand"
                );
            }
        }
        if let Some(travel) = travel {
            _ = writeln!(text, "travel = {travel:?}");
        }
        _ = write!(
            text,
            "\n[real]\n\
             speed_factor = {:.4}  # {}\n\
             # How far each finger stands out, relative to the first one. Second: {}; third: {}.\n\
             offsets = [0.0, {:.5}, {:.5}]\n\
             noise = \"{:.3}ms\"  # {} ms\n",
            self.speed_factor.value,
            between(&self.speed_factor, 1.0, 3),
            with_interval(&self.late[0]),
            with_interval(&self.late[1]),
            stands_out(&self.late[0]),
            stands_out(&self.late[1]),
            self.noise.value,
            between(&self.noise, 1.0, 2),
        );
        if let Some(missed) = &self.missed {
            let [a, b, c] = missed.map(|share| format!("\"{:.2}%\"", 100.0 * share.value));
            let [d, e, f] = missed.map(|share| format!("{} %", between(&share, 100.0, 1)));
            _ = writeln!(text, "missed = [{a}, {b}, {c}]  # {d}; {e}; {f}");
        }
        // Lengths, as offsets are.
        let length = speed / 1e3;
        if let Some(GrazingEstimate { angle, bend }) = &self.grazing {
            _ = writeln!(
                text,
                "grazing = {{ angle = \"{:.2}deg\", bend = {:.5} }}  # {}, {}",
                angle.value,
                bend.value * length,
                degrees(angle),
                between(bend, length, 4)
            );
        }
        if let Some(timer) = self.timer {
            _ = writeln!(text, "timer = \"{timer}ms\"");
        }
        text
    }
}

/// An interval of an angle in words: "10 to 30 degrees".
fn degrees(angle: &Estimate) -> String {
    match between(angle, 1.0, 0) {
        none if none == NOT_TOLD => format!("an angle that is {none}"),
        told => format!("{told} degrees"),
    }
}

fn with_interval(late: &Estimate) -> String {
    format!("{} ({})", offset(late.value, 2), offset_between(late, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_of_which_the_recordings_tell_no_end_is_not_said_to_be_known() {
        let said = |low, high| degrees(&Estimate { value: 42.0, low, high });
        assert_eq!(said(None, None), "an angle that is not told");
        assert_eq!(said(Some(30.0), Some(50.0)), "30 to 50 degrees");
        assert_eq!(said(Some(30.0), None), "at least 30 degrees");
    }
}
