//! Colors that survive color blindness and printing: Okabe and Ito, "Color Universal Design" (2008).
//!
//! A stand-alone SVG is drawn in these on white. Inside the page, `page.css` gives each its counterpart on a dark
//! ground, and turns [`INK`] into the page's own text color.

use plotters::style::RGBColor;

/// Text, axes, and what is no series.
pub(crate) const INK: RGBColor = RGBColor(0, 0, 0);
/// Grid lines and what should stay in the background.
pub(crate) const GRID: RGBColor = RGBColor(221, 221, 221);
/// Axis text and leader lines.
pub(crate) const GRAY: RGBColor = RGBColor(102, 102, 102);
/// The paper's method, everywhere.
pub(crate) const PAPER: RGBColor = VERMILION;
/// Our method, everywhere.
pub(crate) const OURS: RGBColor = BLUE;
/// Okabe–Ito blue.
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
/// Okabe–Ito vermilion.
pub(crate) const VERMILION: RGBColor = RGBColor(213, 94, 0);
/// Okabe–Ito bluish green.
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);
/// Okabe–Ito reddish purple.
pub(crate) const PURPLE: RGBColor = RGBColor(204, 121, 167);
/// Okabe–Ito orange.
pub(crate) const ORANGE: RGBColor = RGBColor(230, 159, 0);
/// Okabe–Ito sky blue.
pub(crate) const SKY: RGBColor = RGBColor(86, 180, 233);

/// The color of the `index`-th of several series without a fixed meaning.
pub(crate) fn series(index: usize) -> RGBColor {
    const ORDER: [RGBColor; 6] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY];
    ORDER[index % ORDER.len()]
}
