//! Thresholds of a calibration, as text.

use palpate::calibrate::{Per, Worse};
use palpate::results::{Results, Value};
use palpate::row;
use palpate::wording::{self, percent};
use std::collections::BTreeMap;

/// The promise in words: its rate, its cases, and the meaning of its confidence.
pub(super) fn promised(rate: f64, per: Per, cases: &str, confidence: f64) -> String {
    let rate = wording::rate(rate);
    let promised = match per {
        Per::Average => format!("At most {rate} of the names are wrong{cases}, on average."),
        Per::Name => format!("Each name is wrong{cases} at most {rate} of the times that it is given."),
        Per::Object => format!("At most {rate} of the names given to each object are wrong{cases}."),
    };
    format!(
        "{promised} Confidence {}: of all calibrations at most {} state a promise that fails.\n",
        wording::rate(confidence),
        wording::rate(1.0 - confidence),
    )
}

/// Leads in nats at which names are given, and would be without calibration; with the share of wrong names of each case, if the
/// rate is promised for cases.
pub(super) fn text(margins: &BTreeMap<String, f64>, errors: &BTreeMap<String, f64>, uncalibrated: f64) -> String {
    if errors.is_empty() {
        let margin = margins.values().next().copied().unwrap_or(f64::NAN);
        return format!(
            "An object is named once it leads by {margin:.2} nats (before calibration: {uncalibrated:.2}).\n"
        );
    }
    let mut rows = Results::new(["name", "wrong", "nats"]);
    for (name, &margin) in margins {
        let error = errors.get(name).map(|&error| Value::Percent(error, 2));
        rows.push(row![name, error, Value::Number(margin, 2)]);
    }
    format!("\n{}An object is named once it leads by its nats (before calibration: {uncalibrated:.2}).\n", rows.text())
}

/// A warning of objects that a rate of other names hides; `hidden` if one has few names.
pub(super) fn worse(worse: &[Worse], rate: f64, per: Per, hidden: bool) -> String {
    let given = |of: &Worse| of.given.map(|share| format!("{} of those given to {}", percent(share, 1), of.object));
    let named = |of: &Worse| of.named.map(|share| format!("{} where {} is named", percent(share, 1), of.object));
    let shares: Vec<String> = worse.iter().flat_map(|of| [given(of), named(of)]).flatten().collect();
    if shares.is_empty() {
        return String::new();
    }
    let rate = wording::rate(rate);
    let what = match per {
        Per::Average => "of all names, and not of each object's",
        Per::Name => "of each name when it is given, and not of those given to each object",
        Per::Object => "of the names given to each object, and not of each name",
    };
    let undecided = if hidden { " An object that mostly stays undecided has few names among all." } else { "" };
    format!(
        "warning: the {rate} are {what}: {} are wrong.{undecided} Promise it of each with --per object or --per name.\n",
        shares.join(", ")
    )
}
