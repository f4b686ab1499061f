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

/// A share, such as an error rate: `0.05` or `5%`.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    let (number, percent) = match text.trim().strip_suffix('%') {
        Some(number) => (number.trim_end(), 100.0),
        None => (text, 1.0),
    };
    let share: f64 = number.parse().map_err(|_| "give a share such as 0.05, or percent such as 5%".to_owned())?;
    Ok(share / percent)
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
    fn shares_may_be_percentages() {
        for text in ["0.05", "5%", "5 %"] {
            assert_eq!(share(text), Ok(0.05), "{text}");
        }
        for text in ["few", "%", "5%%"] {
            assert_eq!(share(text), Err("give a share such as 0.05, or percent such as 5%".into()), "{text}");
        }
    }
}
