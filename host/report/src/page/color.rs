//! Colors that survive color blindness and printing: Okabe and Ito, "Color Universal Design" (2008).
//!
//! A stand-alone SVG is drawn in these on white. Inside the page, `page.css` gives each its counterpart on a dark
//! ground, and turns [`INK`] into the page's own text color.

use plotters::style::RGBColor;

/// Color of text, axes, and everything else that is not a series.
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

/// The color for text about something drawn in `color`: the same, or a darker one where that would be hard to read.
pub(crate) fn text(color: RGBColor) -> RGBColor {
    DARKER.iter().find(|(pale, _)| *pale == color).map_or(color, |&(_, dark)| dark)
}

/// Colors too pale for text on white, and what text has instead. `page.css` gives these, too, their counterparts on a dark
/// ground.
const DARKER: [(RGBColor, RGBColor); 5] = [
    (VERMILION, RGBColor(178, 76, 0)),
    (GREEN, RGBColor(0, 117, 85)),
    (PURPLE, RGBColor(158, 74, 118)),
    (ORANGE, RGBColor(138, 94, 0)),
    (SKY, RGBColor(0, 104, 156)),
];

/// The color of the `index`-th of several series without a fixed meaning.
pub(crate) fn series(index: usize) -> RGBColor {
    const ORDER: [RGBColor; 6] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY];
    ORDER[index % ORDER.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small::contrast;

    #[test]
    fn text_in_charts_has_a_contrast_of_at_least_four_and_a_half_and_a_counterpart_in_the_dark() {
        for color in [INK, GRAY, BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY].map(text) {
            let RGBColor(r, g, b) = color;
            let contrast = contrast([r, g, b].map(f64::from), [255.0; 3]);
            assert!(contrast >= 4.5, "{color:?}: {contrast}");
            let rule = format!("svg [fill=\"#{r:02X}{g:02X}{b:02X}\"]");
            assert!(include_str!("page.css").contains(&rule), "{rule}");
        }
    }
}
