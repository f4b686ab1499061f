//! An axis: where its values are drawn, and which of them get a tick.

pub(crate) use palpate::wording::decimal as number;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// A linear or logarithmic axis with its ticks.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
    /// Values that get a tick, with its label.
    pub(crate) ticks: Vec<(f64, String)>,
    /// True if lines are drawn across the chart at the ticks.
    pub(crate) grid: bool,
    /// True if ticks are names. Names are never left out.
    pub(crate) is_names: bool,
}

impl Axis {
    /// From `low` to `high`, with about `count` ticks at multiples of 1, 2, 2.5 or 5 times a power of ten.
    pub(crate) fn linear(low: f64, high: f64, count: usize) -> Self {
        let (low, high) = ordered(low, high);
        let step = nice_step((high - low) / count.max(1) as f64);
        let decimals = decimals_of(step);
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        let ticks = (first..=last).map(|k| k as f64 * step).map(|value| (value, number(value, decimals))).collect();
        Self { low, high, logarithmic: false, ticks, grid: true, is_names: false }
    }

    /// From `low` to `high`, both positive, logarithmic, with ticks at 1, 2 and 5 times the powers of ten, or at the
    /// powers alone over more than two and a half decades.
    pub(crate) fn logarithmic(low: f64, high: f64) -> Self {
        let low = low.max(f64::MIN_POSITIVE);
        let (low, high) = ordered(low, high.max(low * 1.001));
        let decades = (high / low).log10();
        let steps: &[f64] = match decades {
            ..0.6 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
            ..2.5 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let every = (decades / 7.0).ceil().max(1.0) as i32;
        let mut ticks = Vec::new();
        for exponent in (low.log10().floor() as i32)..=(high.log10().ceil() as i32) {
            if exponent.rem_euclid(every) != 0 {
                continue;
            }
            for step in steps {
                let value = step * 10f64.powi(exponent);
                if value >= low * 0.999 && value <= high * 1.001 {
                    ticks.push((value, short_number(value)));
                }
            }
        }
        Self { low, high, logarithmic: true, ticks, grid: true, is_names: false }
    }

    /// From 0 to 1, written as percentages.
    pub(crate) fn share() -> Self {
        Self::percent(0.0, 1.0)
    }

    /// From `low` to `high`, written as percentages.
    pub(crate) fn percent(low: f64, high: f64) -> Self {
        let mut scale = Self::linear(low, high, 6);
        let step = scale.ticks.get(1).map_or(1.0, |second| second.0 - scale.ticks[0].0);
        let decimals = decimals_of(step * 100.0);
        scale.ticks.iter_mut().for_each(|(value, text)| *text = format!("{} %", number(*value * 100.0, decimals)));
        scale
    }

    /// One place for each name, at 0.5, 1.5, …; without lines across the chart.
    pub(crate) fn names<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        let ticks: Vec<(f64, String)> =
            names.into_iter().enumerate().map(|(index, name)| (index as f64 + 0.5, name.to_string())).collect();
        Self { low: 0.0, high: ticks.len().max(1) as f64, logarithmic: false, ticks, grid: false, is_names: true }
    }

    /// Axis upside down, or right to left.
    pub(crate) fn reversed(mut self) -> Self {
        std::mem::swap(&mut self.low, &mut self.high);
        self
    }

    /// This axis with other ticks.
    pub(crate) fn with_ticks(mut self, ticks: Vec<(f64, String)>) -> Self {
        self.ticks = ticks;
        self
    }

    /// Axis without lines across the chart.
    pub(crate) fn without_grid(mut self) -> Self {
        self.grid = false;
        self
    }

    /// Position of `value`: 0 at the low end, 1 at the high end; clamped to the chart's surroundings.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let place = if self.logarithmic {
            (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        if place.is_finite() { place.clamp(-0.02, 1.02) } else { 0.0 }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        limit.0 + (self.place(*value) * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.iter().map(|tick| tick.0).collect()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        self.ticks.iter().find(|tick| tick.0 == *value).map(|tick| tick.1.clone()).unwrap_or_default()
    }
}

/// A range with an extent, even if none was given.
fn ordered(low: f64, high: f64) -> (f64, f64) {
    match (low.is_finite(), high.is_finite()) {
        (true, true) if low < high => (low, high),
        (true, _) => (low, low + low.abs().max(1.0)),
        _ => (0.0, 1.0),
    }
}

/// The smallest of 1, 2, 2.5, 5 and 10 times a power of ten that is not below `step`.
fn nice_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 2.5, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|nice| *nice >= step * 0.999)
        .unwrap_or(step)
}

/// Number of decimals that a multiple of `step` needs.
fn decimals_of(step: f64) -> usize {
    (0..9)
        .find(|&decimals| {
            let scaled = step * 10f64.powi(decimals);
            (scaled - scaled.round()).abs() < 1e-6
        })
        .unwrap_or(9) as usize
}

/// `value` as short as a tick should be: 0.01, 5, 1,000, 10 k, 2 M, 1e−9.
pub(crate) fn short_number(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        "0".to_string()
    } else if !(1e-4..1e10).contains(&magnitude) {
        let exponent = magnitude.log10().floor() as i32;
        let mantissa = value / 10f64.powi(exponent);
        let sign = if exponent < 0 { "\u{2212}" } else { "" };
        format!("{}e{sign}{}", trimmed(mantissa), exponent.abs())
    } else if magnitude >= 1e6 {
        format!("{} M", trimmed(value / 1e6))
    } else if magnitude >= 1e4 {
        format!("{} k", trimmed(value / 1e3))
    } else {
        trimmed(value)
    }
}

/// Three significant digits, without trailing zeros.
fn trimmed(value: f64) -> String {
    let whole_digits = value.abs().max(1e-12).log10().floor() as i32;
    let decimals = (2 - whole_digits).clamp(0, 9) as usize;
    let text = number(value, decimals);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: &Axis) -> Vec<&str> {
        scale.ticks.iter().map(|tick| tick.1.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_inside() {
        assert_eq!(texts(&Axis::linear(0.0, 10.0, 5)), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(texts(&Axis::linear(-0.5, 0.5, 4)), ["\u{2212}0.50", "\u{2212}0.25", "0.00", "0.25", "0.50"]);
        assert_eq!(texts(&Axis::percent(0.0, 1.0)), ["0 %", "20 %", "40 %", "60 %", "80 %", "100 %"]);
    }

    #[test]
    fn logarithmic_ticks_are_1_2_5_or_powers_alone() {
        assert_eq!(texts(&Axis::logarithmic(10.0, 120.0)), ["10", "20", "50", "100"]);
        assert_eq!(texts(&Axis::logarithmic(1e3, 1e6)), ["1,000", "10 k", "100 k", "1 M"]);
    }

    #[test]
    fn a_value_maps_between_the_limits_and_a_logarithm_of_nothing_stays_near_the_chart() {
        let scale = Axis::logarithmic(1.0, 100.0);
        assert_eq!(scale.map(&10.0, (0, 1000)), 500);
        assert_eq!(scale.map(&0.0, (0, 1000)), -20);
        assert_eq!(Axis::linear(0.0, 4.0, 4).map(&1.0, (100, 0)), 75);
    }

    #[test]
    fn an_axis_without_extent_still_has_one() {
        for (low, high) in [(1.0, 1.0), (0.0, 0.0), (f64::NAN, 1.0), (2.0, f64::INFINITY), (3.0, 2.0)] {
            let scale = Axis::linear(low, high, 5);
            assert!(!scale.ticks.is_empty(), "{low} {high}");
            assert!(scale.ticks.len() < 20, "{low} {high}");
        }
    }

    #[test]
    fn short_numbers_are_short() {
        for (value, text) in
            [(0.0, "0"), (0.05, "0.05"), (1000.0, "1,000"), (16384.0, "16.4 k"), (2e6, "2 M"), (1e-9, "1e\u{2212}9")]
        {
            assert_eq!(short_number(value), text);
        }
    }
}
