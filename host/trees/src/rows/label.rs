//! Labels of rows, in the spellings that libraries and pandas give them.

use crate::error::{Error, problem};

/// The position of the class that a label means: its name; another spelling of it, if it is a number or a truth value, such as
/// `1.0` for `1` and `True` for `true` or `1`; or the number of the class, if names are no numbers.
pub(crate) fn class(classes: &[String], label: &str) -> Option<usize> {
    let exact = classes.iter().position(|name| name == label);
    exact.or_else(|| spelled(classes, label)).or_else(|| {
        let names_are_numbers = classes.iter().all(|name| number(name).is_some());
        let by_number = || whole(label).filter(|number| *number < classes.len());
        if names_are_numbers { None } else { by_number() }
    })
}

/// A label that is none of the `known` classes, in a row that is counted from 1.
pub(crate) fn not_a_class(label: &str, row: usize, known: &str) -> Error {
    problem!("the label {label:?} in row {row} is none of the model's classes: {known}")
        .fix("Correct the label, or name the model's classes with `export --names`.")
}

/// The only class whose name means the same as the label.
fn spelled(classes: &[String], label: &str) -> Option<usize> {
    let label = number(label)?;
    let mut same = classes.iter().enumerate().filter(|(_, name)| number(name) == Some(label));
    same.next().filter(|_| same.next().is_none()).map(|(class, _)| class)
}

/// A name's number: 1 and 0 of truth values.
fn number(name: &str) -> Option<f64> {
    match name.to_ascii_lowercase().as_str() {
        "true" => Some(1.0),
        "false" => Some(0.0),
        other => other.parse().ok().filter(|number: &f64| number.is_finite()),
    }
}

/// The whole number of a label, as pandas writes it too: `2.0`.
fn whole(label: &str) -> Option<usize> {
    let digits = label.strip_suffix(".0").unwrap_or(label);
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_found_in_the_spellings_of_pandas() {
        let of = |names: &[&str], label: &str| class(&names.iter().map(ToString::to_string).collect::<Vec<_>>(), label);
        for (names, label, expected) in [
            (&["0", "1"][..], "1.0", Some(1)),
            (&["0", "1"], "True", Some(1)),
            (&["False", "True"], "true", Some(1)),
            (&["false", "true"], "0", Some(0)),
            (&["-1", "1"], "-1.0", Some(0)),
            (&["cup", "jug"], "jug", Some(1)),
            (&["cup", "jug"], "1", Some(1)),
            (&["cup", "jug"], "1.0", Some(1)),
            (&["cup", "jug"], "2", None),
            // Numbers that are names are no positions.
            (&["10", "20", "70"], "20", Some(1)),
            (&["10", "20", "70"], "1", None),
            (&["1", "2"], "0", None),
            // Two names that mean the same.
            (&["1", "1.0"], "1.00", None),
            (&["1", "1.0"], "1.0", Some(1)),
            (&["0", "1"], "", None),
            (&["0", "1"], "nan", None),
        ] {
            assert_eq!(of(names, label), expected, "{label:?} among {names:?}");
        }
    }
}
