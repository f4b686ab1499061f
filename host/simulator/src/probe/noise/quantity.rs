//! Quantities as users write them: durations, lengths, angles and shares, each with its unit.

use crate::error::{ProbeProblem, Result};

/// A duration of at least 0 such as `5ms`, `300us` or `0.005s`, in microseconds.
///
/// # Errors
/// [`ProbeProblem::BadQuantity`].
pub fn duration(text: &str) -> Result<f64, ProbeProblem> {
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
/// [`ProbeProblem::BadQuantity`].
pub fn length(text: &str) -> Result<f64, ProbeProblem> {
    let units = [("um", 1.0), ("mm", 1e3)];
    let found = units.into_iter().find_map(|(name, unit)| Some((text.trim().strip_suffix(name)?, unit)));
    found.and_then(|(text, unit)| number(text, unit)).ok_or_else(|| bad(text, "a length such as 1mm or 300um"))
}

/// An angle of at least 0 such as `5deg` or `5°`, in degrees.
///
/// # Errors
/// [`ProbeProblem::BadQuantity`].
pub fn angle(text: &str) -> Result<f64, ProbeProblem> {
    let trimmed = text.trim();
    let found = trimmed.strip_suffix("deg").or_else(|| trimmed.strip_suffix('°'));
    found.and_then(|text| number(text, 1.0)).ok_or_else(|| bad(text, "an angle such as 5deg"))
}

/// A share of at least 0 such as `2%` or `0.02`.
///
/// # Errors
/// [`ProbeProblem::BadQuantity`].
pub fn share(text: &str) -> Result<f64, ProbeProblem> {
    let found = match text.trim().strip_suffix('%') {
        Some(percent) => number(percent, 1.0).map(|percent| percent / 100.0),
        None => number(text, 1.0),
    };
    found.ok_or_else(|| bad(text, "a share such as 2% or 0.02"))
}

fn number(text: &str, unit: f64) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| *number >= 0.0 && number.is_finite()).map(|number| number * unit)
}

fn bad(text: &str, example: &'static str) -> ProbeProblem {
    ProbeProblem::BadQuantity { text: text.into(), example }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Problem;

    #[test]
    fn quantities_have_units() {
        assert_eq!((duration("5ms"), duration("300us"), duration("0.005 s")), (Ok(5e3), Ok(300.0), Ok(5e3)));
        assert_eq!((length("0.5mm"), length("300um")), (Ok(500.0), Ok(300.0)));
        assert_eq!((angle("5deg"), angle("0.5°")), (Ok(5.0), Ok(0.5)));
        assert_eq!((share("2%"), share("0.02"), share("2 %")), (Ok(0.02), Ok(0.02), Ok(0.02)));
    }

    #[test]
    fn what_is_no_quantity_is_refused_with_an_example() {
        for text in ["5", "ms", "-1ms", "1e999s", "5 m", ""] {
            let problem = duration(text).unwrap_err();
            assert!(problem.fix().contains("5ms"), "{text}: {problem}");
        }
        for text in ["5", "mm", "-1mm", "1m", "nanmm"] {
            assert!(length(text).unwrap_err().fix().contains("1mm"), "{text}");
        }
        for text in ["5", "deg", "-1deg", "5rad"] {
            assert!(angle(text).unwrap_err().fix().contains("5deg"), "{text}");
        }
        for text in ["few", "%", "-2%", "2%%", "nan"] {
            assert!(share(text).unwrap_err().fix().contains("2%"), "{text}");
        }
    }
}
