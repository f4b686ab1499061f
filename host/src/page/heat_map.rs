//! A heat map of shares.

use super::axis::Axis;
use super::chart::{Chart, Mark, Side, Svg};
use super::color;
use crate::error::Result;
use plotters::style::RGBColor;

/// A square matrix of shares with the same `names` along both axes, the first row on top. A share below half a percent
/// is left blank; up to twelve names, the others are written into their cells as percentages.
///
/// # Errors
/// If the chart cannot be drawn.
pub(crate) fn heat_map(
    title: &str,
    [columns, rows]: [&str; 2],
    names: &[String],
    shares: &[Vec<f64>],
    color: RGBColor,
) -> Result<Svg> {
    let axis = || Axis::names(names.iter().map(String::as_str));
    let mut chart = Chart::new(columns, axis(), rows, axis().reversed()).sized(560, 540).titled(title);
    chart.upright_names = true;
    for (row, shares) in shares.iter().enumerate() {
        for (column, &share) in shares.iter().enumerate().filter(|(_, share)| **share >= 0.005) {
            let (x, y) = (column as f64, row as f64);
            // Never solid, so that text stays legible on light and dark ground.
            let opacity = 0.75 * share.sqrt();
            chart.marks.push(Mark::Box { from: (x, y), to: (x + 1.0, y + 1.0), color, opacity });
            if names.len() <= 12 {
                let text = format!("{:.0}", share * 100.0);
                chart.marks.push(Mark::Text { at: (x + 0.5, y + 0.5), text, color: color::INK, side: Side::Center });
            }
        }
    }
    chart.svg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heat_map_writes_percentages_and_leaves_only_small_shares_blank() {
        let names = ["fork".to_string(), "spoon".to_string()];
        let shares = [vec![0.9, 0.1], vec![0.001, 0.999]];
        let svg = heat_map("ours", ["recognized as", "touched"], &names, &shares, color::OURS).unwrap();
        for text in [">\n90\n<", ">\n10\n<", ">\n100\n<", "fork", "spoon", "touched"] {
            assert!(svg.text.contains(text), "{text} {}", svg.text);
        }
        assert!(!svg.text.contains(">\n0\n<"));
    }
}
