//! Numbers as users write them.

/// A whole number of at least 0. What is a whole number in another notation is refused with how to write it.
pub(crate) fn count(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| match whole(text) {
        Some(number) => format!("write the number out: {number}"),
        None => "give a whole number, such as 21000".to_owned(),
    })
}

/// The whole number that `1e6`, `1_000_000`, `1,000,000`, `20k` or `2.0` stand for.
fn whole(text: &str) -> Option<u64> {
    let text = text.trim().to_lowercase().replace(['_', ',', '\'', ' '], "");
    let (number, factor) = match text.strip_suffix(['k', 'm']) {
        Some(number) => (number, if text.ends_with('k') { 1e3 } else { 1e6 }),
        None => (text.as_str(), 1.0),
    };
    let number = number.parse::<f64>().ok()? * factor;
    (number.fract() == 0.0 && (0.0..1e15).contains(&number)).then_some(number as u64)
}

/// A number, such as an error rate. A percentage is refused with how to write it.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| match text.trim().strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok()) {
        Some(percent) => format!("write it as a share: {}", percent / 100.0),
        None => "give a number, such as 0.01".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_in_another_notation_are_refused_with_a_hint() {
        assert_eq!(count("21000"), Ok(21_000));
        for text in ["1e6", "1_000_000", "1,000,000", "1000k", "1M", "1000000.0"] {
            assert_eq!(count(text), Err("write the number out: 1000000".into()), "{text}");
        }
        for text in ["", "many", "-1", "1.5", "1e99", "nan"] {
            assert_eq!(count(text), Err("give a whole number, such as 21000".into()), "{text}");
        }
    }

    #[test]
    fn percentages_are_refused_with_a_hint() {
        assert_eq!(share("0.05"), Ok(0.05));
        for text in ["5%", "5 %"] {
            assert_eq!(share(text), Err("write it as a share: 0.05".into()));
        }
        assert_eq!(share("few"), Err("give a number, such as 0.01".into()));
    }
}
