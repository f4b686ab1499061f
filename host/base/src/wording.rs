//! Numbers as people read them, on a terminal or on a page: one way to write each kind.

/// A number with this many decimals: commas between thousands, a minus sign (not a hyphen), and none before a zero. A number
/// that is not finite becomes a dash.
///
/// ```
/// use palpate_base::wording::decimal;
///
/// assert_eq!([decimal(1234.5, 1), decimal(-0.04, 1), decimal(-2.0, 0)], ["1,234.5", "0.0", "−2"]);
/// assert_eq!(decimal(f64::NAN, 1), "–");
/// ```
pub fn decimal(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.chars().all(|c| matches!(c, '0' | '.'));
    let sign = if value < 0.0 && !is_zero { "\u{2212}" } else { "" };
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    format!("{sign}{}{rest}", grouped(whole))
}

/// A whole number, with commas between thousands.
///
/// ```
/// assert_eq!(palpate_base::wording::count(44_336_usize), "44,336");
/// ```
pub fn count(number: impl TryInto<u64>) -> String {
    number.try_into().map_or_else(|_| "–".to_owned(), |number: u64| grouped(&number.to_string()))
}

/// A whole number and what it counts: "1 fold", "2 folds".
///
/// ```
/// use palpate_base::wording::counted;
///
/// assert_eq!([counted(1, "fold", "folds"), counted(2_000, "fold", "folds")], ["1 fold", "2,000 folds"]);
/// ```
pub fn counted(number: usize, one: &str, several: &str) -> String {
    format!("{} {}", count(number), if number == 1 { one } else { several })
}

/// Names with commas between them: the first ten, and the number of the others.
pub fn first_ten(names: &[String]) -> String {
    let first = names[..names.len().min(10)].join(", ");
    if names.len() > 10 { format!("{first} and {} more", names.len() - 10) } else { first }
}

/// A share of one in percent, with this many decimals: "12.3 %".
pub fn percent(share: f64, decimals: usize) -> String {
    match decimal(100.0 * share, decimals) {
        dash if dash == "–" => dash,
        number => format!("{number} %"),
    }
}

/// A share of one and its uncertainty in percent, with this many decimals.
///
/// ```
/// assert_eq!(palpate_base::wording::percent_within(0.907, 0.025, 1), "90.7 ± 2.5 %");
/// ```
pub fn percent_within(share: f64, uncertainty: f64, decimals: usize) -> String {
    format!("{} ± {}", decimal(100.0 * share, decimals), percent(uncertainty, decimals))
}

/// Names with their shares in percent: "bowl 1.5 %, fork 98.5 %".
pub fn shares<S: AsRef<str>>(shares: impl IntoIterator<Item = (S, f64)>) -> String {
    let named = |(name, share): (S, f64)| format!("{} {}", name.as_ref(), percent(share, 1));
    shares.into_iter().map(named).collect::<Vec<_>>().join(", ")
}

/// A share of one that somebody chose, in percent as it was meant, without the last bits: 0.07 is "7 %".
///
/// ```
/// use palpate_base::wording::rate;
///
/// assert_eq!([rate(0.07), rate(0.005), rate(1e-3)], ["7 %", "0.5 %", "0.1 %"]);
/// ```
pub fn rate(share: f64) -> String {
    format!("{} %", (share * 1e9).round() / 1e7)
}

/// A number compared with another one: "41 % fewer", "10 % more" or "as many".
///
/// ```
/// use palpate_base::wording::compared;
///
/// assert_eq!([compared(3.54, 6.0), compared(6.6, 6.0), compared(6.0, 6.0)], ["41 % fewer", "10 % more", "as many"]);
/// ```
pub fn compared(number: f64, with: f64) -> String {
    match number / with - 1.0 {
        share if share < 0.0 => format!("{} fewer", percent(-share, 0)),
        share if share > 0.0 => format!("{} more", percent(share, 0)),
        _ => "as many".to_owned(),
    }
}

/// A small number with three digits and an exponent; 0 is "0".
///
/// ```
/// use palpate_base::wording::scientific;
///
/// assert_eq!([scientific(2.279e-4), scientific(0.0)], ["2.28e-4", "0"]);
/// ```
pub fn scientific(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.2e}") }
}

/// An estimate, rounded up to two digits.
///
/// ```
/// use palpate_base::wording::two_digits;
///
/// assert_eq!([two_digits(1_204.0), two_digits(7.2), two_digits(0.0)], [1_300, 8, 0]);
/// ```
pub fn two_digits(number: f64) -> u64 {
    let digit = 10.0_f64.powf((number.max(1.0).log10().floor() - 1.0).max(0.0));
    ((number / digit).ceil() * digit) as u64
}

/// Names or words as a list: "a", "a and b", "a, b and c".
pub fn list<S: AsRef<str>>(words: &[S]) -> String {
    match words {
        [] => String::new(),
        [only] => only.as_ref().to_owned(),
        [first @ .., last] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", first.join(", "), last.as_ref())
        }
    }
}

/// Digits in groups of three.
fn grouped(digits: &str) -> String {
    let first = digits.len() % 3;
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && place % 3 == first {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_rounds_to_zero_has_no_sign_and_thousands_have_commas() {
        for (value, decimals, text) in [
            (-0.4, 0, "0"),
            (-0.000_4, 3, "0.000"),
            (-0.6, 0, "\u{2212}1"),
            (999.0, 0, "999"),
            (1_000.0, 0, "1,000"),
            (259_556.0, 0, "259,556"),
            (-1_234_567.891, 2, "\u{2212}1,234,567.89"),
            (f64::INFINITY, 2, "–"),
        ] {
            assert_eq!(decimal(value, decimals), text);
        }
        assert_eq!(shares([("bowl", 0.015), ("fork", 0.985)]), "bowl 1.5 %, fork 98.5 %");
        assert_eq!([count(7_u8), count(1_234_u16), count(1_234_567_u32)], ["7", "1,234", "1,234,567"]);
        assert_eq!([percent(0.123, 1), percent(-0.000_1, 1), percent(f64::NAN, 1)], ["12.3 %", "0.0 %", "–"]);
        assert_eq!(
            [list::<&str>(&[]), list(&["a"]), list(&["a", "b"]), list(&["a", "b", "c"])],
            ["", "a", "a and b", "a, b and c"]
        );
    }
}
