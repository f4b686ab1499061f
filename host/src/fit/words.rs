//! Estimates, and how they are said.

use serde::Serialize;

/// A value and its interval, which holds the true one in about 95 of 100 fits, if probe and objects are as they are
/// simulated; an end is none if the recordings do not determine it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The likeliest value.
    pub value: f64,
    /// The lower end of the interval.
    pub low: Option<f64>,
    /// The upper end.
    pub high: Option<f64>,
}

impl Estimate {
    /// The width of the interval; none if it has no end.
    pub(crate) fn width(&self) -> Option<f64> {
        Some(self.high? - self.low?)
    }
}

/// Words for an interval without an end.
pub const NOT_TOLD: &str = "not told";

/// An interval in words: "1.0 to 1.2", "at most 3".
pub fn between(estimate: &Estimate, scale: f64, digits: usize) -> String {
    let number = |value: f64| {
        let text = format!("{:.digits$}", scale * value);
        // No minus before a zero.
        if text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.')) {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    };
    match (estimate.low, estimate.high) {
        (Some(low), Some(high)) => format!("{} to {}", number(low), number(high)),
        (Some(low), None) => format!("at least {}", number(low)),
        (None, Some(high)) => format!("at most {}", number(high)),
        (None, None) => NOT_TOLD.into(),
    }
}

/// An offset in milliseconds in words: "4.3 ms late", "3.1 ms early".
pub fn offset(late: f64, digits: usize) -> String {
    let text = format!("{:.digits$} ms", late.abs());
    let is_none = text.chars().all(|c| !matches!(c, '1'..='9'));
    let side = if late > 0.0 { "late" } else { "early" };
    if is_none { text } else { format!("{text} {side}") }
}

/// The interval of an offset in words: "2.9 to 4.7 ms late", "0.4 ms early to 0.8 ms late".
pub fn offset_between(late: &Estimate, digits: usize) -> String {
    match (late.low, late.high) {
        (Some(low), Some(high)) if low >= 0.0 => format!("{low:.digits$} to {}", offset(high, digits)),
        (Some(low), Some(high)) if high <= 0.0 => format!("{:.digits$} to {}", high.abs(), offset(low, digits)),
        (Some(low), Some(high)) => format!("{} to {}", offset(low, digits), offset(high, digits)),
        (Some(low), None) => format!("{} or later", offset(low, digits)),
        (None, Some(high)) => format!("{} or earlier", offset(high, digits)),
        (None, None) => NOT_TOLD.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_early_or_late_and_never_below_zero() {
        let said = |value, low, high| {
            let late = Estimate { value, low, high };
            format!("{}; {}", offset(late.value, 1), offset_between(&late, 1))
        };
        for (value, low, high, expected) in [
            (4.311, Some(2.9), Some(4.7), "4.3 ms late; 2.9 to 4.7 ms late"),
            (-4.311, Some(-4.7), Some(-2.9), "4.3 ms early; 2.9 to 4.7 ms early"),
            (0.2, Some(-0.4), Some(0.8), "0.2 ms late; 0.4 ms early to 0.8 ms late"),
            (0.0, Some(0.0), Some(0.0), "0.0 ms; 0.0 to 0.0 ms"),
            (-0.01, Some(-2.0), Some(0.0), "0.0 ms; 0.0 to 2.0 ms early"),
            (1.0, None, Some(3.0), "1.0 ms late; 3.0 ms late or earlier"),
            (1.0, Some(-1.0), None, "1.0 ms late; 1.0 ms early or later"),
            (1.0, None, None, "1.0 ms late; not told"),
        ] {
            assert_eq!(said(value, low, high), expected);
        }
    }
}
