//! A heat map of shares.

use super::axis::Axis;
use super::chart::{Chart, Mark, Svg};
use palpate::error::Result;
use plotters::style::RGBColor;

/// A square matrix of shares with the same `names` along both axes, the first row on top. Shares are written into their
/// cells as whole percentages, where cells are large enough; one that rounds to 0 % is left blank.
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
        for (column, &share) in shares.iter().enumerate().filter(|(_, share)| percent(**share) > 0.0) {
            let (x, y) = (column as f64, row as f64);
            // Never solid, so that text stays legible on light and dark ground.
            let opacity = 0.75 * share.sqrt();
            chart.marks.push(Mark::Box { from: (x, y), to: (x + 1.0, y + 1.0), color, opacity });
            chart.marks.push(Mark::Cell { at: (x + 0.5, y + 0.5), text: percent(share).to_string() });
        }
    }
    chart.svg()
}

/// Whole percent, a half rounded up.
fn percent(share: f64) -> f64 {
    (100.0 * share).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::color;

    #[test]
    fn a_heat_map_writes_percentages_and_leaves_only_shares_below_half_a_percent_blank() {
        let names = ["fork".to_string(), "spoon".to_string()];
        for (shares, written) in [
            ([vec![0.9, 0.1], vec![0.001, 0.999]], &[">90<", ">10<", ">100<", "fork", "spoon", "touched"][..]),
            ([vec![0.995, 0.005], vec![0.004, 0.996]], &[">1<"]),
        ] {
            let svg = heat_map("ours", ["recognized as", "touched"], &names, &shares, color::OURS).unwrap();
            for text in written {
                assert!(svg.text.contains(text), "{text} {}", svg.text);
            }
            assert!(!svg.text.contains(">0<"), "{}", svg.text);
        }
    }
}
