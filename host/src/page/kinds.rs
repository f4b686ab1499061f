//! Charts that several figures share: heat maps, bars, reliability.

use super::chart::{Chart, Mark, Side, Stroke, Svg};
use super::color;
use super::scale::Scale;
use crate::error::Result;
use plotters::style::RGBColor;

/// A matrix of shares, rows from above: row `i`, column `j` is the share of groups of object `i` that were taken for
/// object `j`. Shares below half a per cent are left blank.
///
/// # Errors
/// If the chart cannot be drawn.
pub fn confusion(title: &str, names: &[String], shares: &[Vec<f64>], color: RGBColor) -> Result<Svg> {
    let names = || names.iter().map(String::as_str);
    let count = names().count() as f64;
    let mut chart = Chart::new("recognized as", Scale::names(names()), "touched", Scale::names(names()).reversed())
        .sized(560, 540)
        .titled(title);
    chart.upright_names = true;
    for (row, shares) in shares.iter().enumerate() {
        for (column, &share) in shares.iter().enumerate() {
            let (x, y) = (column as f64, row as f64);
            // Never solid, so that text stays legible on light and dark ground.
            let opacity = 0.75 * share.sqrt();
            if share >= 0.005 {
                chart.marks.push(Mark::Box { from: (x, y), to: (x + 1.0, y + 1.0), color, opacity });
                if count <= 12.0 {
                    let text = format!("{:.0}", share * 100.0);
                    let at = (x + 0.5, y + 0.5);
                    chart.marks.push(Mark::Text { at, text, color: color::INK, side: Side::Center });
                }
            }
        }
    }
    chart.svg()
}

/// A reliability diagram: how often verdicts with about the same posterior are right. `bins` holds for each bin the mean
/// posterior, the share right, its 95 % interval, and the share of all verdicts in it.
///
/// # Errors
/// If the chart cannot be drawn.
pub fn reliability(title: &str, bins: &[ReliabilityBin], color: RGBColor) -> Result<Svg> {
    let mut chart = Chart::new("posterior of the best object", Scale::share(), "share right", Scale::share())
        .sized(280, 260)
        .titled(title);
    chart.marks.push(Mark::Line { points: vec![(0.0, 0.0), (1.0, 1.0)], color: color::GRAY, stroke: Stroke::Dashed });
    let spread = bins.iter().map(|bin| (bin.posterior, bin.low, bin.high)).collect();
    chart.marks.push(Mark::Spread { points: spread, color });
    let points: Vec<(f64, f64)> = bins.iter().map(|bin| (bin.posterior, bin.right)).collect();
    chart.marks.push(Mark::Line { points: points.clone(), color, stroke: Stroke::Thin });
    chart.marks.push(Mark::Dots { points, color, shape: super::chart::Shape::Disc });
    for bin in bins {
        let half = 0.008;
        let (from, to) = ((bin.posterior - half, 0.0), (bin.posterior + half, 0.3 * bin.share));
        chart.marks.push(Mark::Box { from, to, color: color::GRAY, opacity: 0.6 });
    }
    chart.svg()
}

/// A bin of a reliability diagram.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ReliabilityBin {
    /// Mean posterior of the best object.
    pub posterior: f64,
    /// Share of verdicts that were right.
    pub right: f64,
    /// Lower end of its 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Share of all verdicts that are in this bin.
    pub share: f64,
}

/// Horizontal bars, longest names beside them, values at their ends.
///
/// # Errors
/// If the chart cannot be drawn.
pub fn bars(title: &str, unit: &str, values: &[(String, f64)], decimals: usize, color: RGBColor) -> Result<Svg> {
    let top = values.iter().map(|value| value.1).fold(0.0, f64::max).max(1e-9) * 1.15;
    let names = Scale::names(values.iter().map(|value| value.0.as_str())).reversed();
    let height = 70 + 24 * values.len() as u32;
    let mut chart = Chart::new(unit, Scale::linear(0.0, top, 5), "", names).sized(420, height).titled(title);
    for (row, (_, value)) in values.iter().enumerate() {
        let y = row as f64;
        chart.marks.push(Mark::Box { from: (0.0, y + 0.2), to: (*value, y + 0.8), color, opacity: 0.8 });
        let text = super::scale::number(*value, decimals);
        chart.marks.push(Mark::Text { at: (*value, y + 0.5), text, color: color::INK, side: Side::Right });
    }
    chart.svg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_confusion_matrix_writes_per_cent_and_leaves_nothing_blank_that_counts() {
        let names = ["fork".to_string(), "spoon".to_string()];
        let svg = confusion("ours", &names, &[vec![0.9, 0.1], vec![0.001, 0.999]], color::OURS).unwrap();
        for text in [">\n90\n<", ">\n10\n<", ">\n100\n<", "fork", "spoon", "touched"] {
            assert!(svg.text.contains(text), "{text} {}", svg.text);
        }
        assert!(!svg.text.contains(">\n0\n<"));
    }
}
