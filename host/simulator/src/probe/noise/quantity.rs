//! Quantities as users write them: durations, lengths, angles and shares, each with its unit.

use crate::error::{Error, Result, problem};

/// A duration of at least 0 such as `5ms`, `300us` or `0.005s`, in microseconds.
///
/// # Errors
/// With what can be written, if the text is something else.
pub fn duration(text: &str) -> Result<f64> {
    // Longest unit first: every one of them ends in `s`.
    let units = [("us", 1.0), ("ms", 1e3), ("s", 1e6)];
    let found = units.into_iter().find_map(|(name, unit)| Some((text.trim().strip_suffix(name)?, unit)));
    found
        .and_then(|(text, unit)| number(text, unit))
        .ok_or_else(|| bad(text, "a duration such as 5ms, 300us or 0.005s"))
}

/// A length of at least 0 such as `1mm` or `300um`, in micrometers.
///
/// # Errors
/// With what can be written, if the text is something else.
pub fn length(text: &str) -> Result<f64> {
    let units = [("um", 1.0), ("mm", 1e3)];
    let found = units.into_iter().find_map(|(name, unit)| Some((text.trim().strip_suffix(name)?, unit)));
    found.and_then(|(text, unit)| number(text, unit)).ok_or_else(|| bad(text, "a length such as 1mm or 300um"))
}

/// An angle of at least 0 such as `5deg` or `5°`, in degrees.
///
/// # Errors
/// With what can be written, if the text is something else.
pub fn angle(text: &str) -> Result<f64> {
    let trimmed = text.trim();
    let found = trimmed.strip_suffix("deg").or_else(|| trimmed.strip_suffix('°'));
    found.and_then(|text| number(text, 1.0)).ok_or_else(|| bad(text, "an angle such as 5deg"))
}

/// A share of at least 0 such as `2%` or `0.02`.
///
/// # Errors
/// With what can be written, if the text is something else.
pub fn share(text: &str) -> Result<f64> {
    let found = match text.trim().strip_suffix('%') {
        Some(percent) => number(percent, 1.0).map(|percent| percent / 100.0),
        None => number(text, 1.0),
    };
    found.ok_or_else(|| bad(text, "a share such as 2% or 0.02"))
}

fn number(text: &str, unit: f64) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| *number >= 0.0 && number.is_finite()).map(|number| number * unit)
}

/// A text is not a quantity such as this.
pub(super) fn bad(text: &str, example: &str) -> Error {
    problem!("{text:?} is not a quantity with its unit").fix(format!("Give {example}."))
}
