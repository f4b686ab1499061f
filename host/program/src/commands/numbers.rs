//! Numbers as users write them.

/// A whole number of at least 0. What is a whole number in another notation is refused with how to write it.
pub(crate) fn count(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| match whole(text) {
        Some(number) => format!("write the number out: {number}"),
        None => "give a whole number, such as 21000".to_owned(),
    })
}

/// A number of sequences, as [`count`].
pub(crate) fn sequences(text: &str) -> Result<usize, String> {
    count(text).map(|count| usize::try_from(count).unwrap_or(usize::MAX))
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

/// An error rate: `0.05` or `5%`, above 0 and below one half.
pub(crate) fn error_rate(text: &str) -> Result<f64, String> {
    match share(text)? {
        rate if rate > 0.0 && rate < 0.5 => Ok(rate),
        _ => Err("give an error rate above 0 and below one half, such as 1% or 0.01".to_owned()),
    }
}

/// A share of a whole: `0.95` or `95%`.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    match number_or_percent(text)? {
        share if (0.0..=1.0).contains(&share) => Ok(share),
        number if (1.0..=100.0).contains(&number) => {
            Err(format!("a share is at most 1: for {number} percent write {number}%"))
        }
        _ => Err("give a share from 0 to 1 such as 0.05, or percent such as 5%".to_owned()),
    }
}

/// A number, or hundredths of one: `0.05` or `5%`.
pub(crate) fn number_or_percent(text: &str) -> Result<f64, String> {
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
    fn percent_without_their_sign_are_refused_with_what_to_write() {
        for of in [share, error_rate] {
            assert_eq!(of("2"), Err("a share is at most 1: for 2 percent write 2%".into()));
            assert_eq!(of("2%"), Ok(0.02));
        }
        for text in ["0", "0.5", "60%", "1"] {
            let error = error_rate(text).unwrap_err();
            assert!(error.contains("below one half"), "{text}: {error}");
        }
        for text in ["-1%", "101", "inf"] {
            assert!(share(text).unwrap_err().contains("from 0 to 1"), "{text}");
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
