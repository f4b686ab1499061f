//! A page of the map of an object that was touched where it stands: heights, contacts, and what is guessed; of two, the difference.

use crate::page::{html, render};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use palpate::locate::{Relief, Sample, Shape};
use palpate::wording::{count, decimal, percent};
use std::fmt::Write as _;

/// A map with the touches that it was made of.
#[derive(Clone, Debug)]
pub struct Map {
    /// Name of the object.
    pub name: String,
    /// Its touches.
    pub shape: Shape,
    /// Radius of a fingertip, in millimeters.
    pub radius: f64,
}

/// Half of an interval beyond which a cell is hatched, in millimeters.
const KNOWN: f64 = 2.0;
/// Pixels for each millimeter.
const SCALE: i32 = 5;
/// Shades of heights.
const SHADES: f64 = 32.0;

/// The page of a map, or of two and their difference. `registered` says that the second one was turned and moved onto the first.
pub fn page(maps: &[Map], registered: bool) -> String {
    let reliefs: Vec<Relief> = maps.iter().map(|map| map.shape.relief()).collect();
    let title = maps.iter().map(|map| map.name.as_str()).collect::<Vec<_>>().join(" and ");
    let body = html! {
        main {
            h1 { (title) }
            @for (map, relief) in maps.iter().zip(&reliefs) { (one(map, relief)) }
            @if let [one, other] = &reliefs[..] { (difference(one, other, registered)) }
        }
    };
    html::file(&title, &[include_str!("shape.css")], &body)
}

fn one(map: &Map, relief: &Relief) -> Markup {
    let top = relief.heights.iter().copied().fold(1.0, f64::max);
    let samples = map.shape.samples();
    let contacts = samples.iter().filter(|sample| sample.is_contact).count();
    let color = |cell: usize| ramp(relief.heights[cell] / top);
    let hatched = |cell: usize| relief.may_be_object(cell) && relief.is_guessed(cell, KNOWN);
    html! {
        section {
            h2 { (map.name) }
            div.panels {
                figure {
                    (PreEscaped(drawn(relief, &color, &hatched, samples)))
                    figcaption {
                        "Top view, heights from the table (blue) to " (decimal(top, 1)) " mm (yellow). Dots are contacts, rings fingers \
                         that met nothing. Cells whose interval reaches beyond ± " (decimal(KNOWN, 0)) " mm are hatched: they are guessed."
                    }
                }
                figure {
                    img alt="The surface, closed to the table" width="420" height="420"
                        src={ "data:image/png;base64," (STANDARD.encode(render::on_table(&relief.solid(map.radius), 840))) };
                    figcaption { "The surface, closed to the table. Nothing is known of what lies under an overhang." }
                }
            }
            p {
                (count(samples.len() / 3)) " approaches, " (count(contacts)) " contacts. Of the cells that may be the object's, "
                (percent(relief.known(KNOWN), 0)) " are known to " (decimal(KNOWN, 0)) " mm."
            }
        }
    }
}

fn difference(one: &Relief, other: &Relief, registered: bool) -> Markup {
    let off = |cell: usize| one.heights[cell] - one.height_in(cell, other);
    let is_either = |cell: usize| one.may_be_object(cell) || one.height_in(cell, other) > 1.0;
    let all: Vec<f64> = (0..one.heights.len()).filter(|cell| is_either(*cell)).map(|cell| off(cell).abs()).collect();
    let (mean, most) = (all.iter().sum::<f64>() / all.len().max(1) as f64, all.iter().copied().fold(1.0, f64::max));
    let color = |cell: usize| {
        let share = (off(cell) / most).clamp(-1.0, 1.0);
        let pale = |full: f64| (245.0 + (full - 245.0) * share.abs()) as u8;
        if share > 0.0 { [213.0, 94.0, 0.0].map(pale) } else { [0.0, 114.0, 178.0].map(pale) }
    };
    let hatched = |cell: usize| is_either(cell) && one.is_guessed(cell, KNOWN);
    html! {
        section {
            h2 { "Difference" }
            figure {
                (PreEscaped(drawn(one, &color, &hatched, &[])))
                figcaption {
                    "The first map minus the second: from " (decimal(-most, 1)) " mm (blue) to " (decimal(most, 1)) " mm (orange). "
                    @if registered { "The second was moved and turned onto the first. " }
                    @else { "Both as they lie in the table's frame: it is not sure how the second is turned relative to the first. " }
                    "Mean difference: " (decimal(mean, 2)) " mm."
                }
            }
        }
    }
}

/// A map from above as SVG, with hatched cells and samples.
fn drawn(
    relief: &Relief,
    color: &dyn Fn(usize) -> [u8; 3],
    hatched: &dyn Fn(usize) -> bool,
    samples: &[Sample],
) -> String {
    let [x, y] = relief.half;
    let (width, height) = (2 * x + 1, 2 * y + 1);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {width} {height}\" width=\"{}\" height=\"{}\" role=\"img\" aria-label=\"Map from above\">\
         <defs><pattern id=\"guessed\" width=\"2\" height=\"2\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\">\
         <path d=\"M0 0V2\" stroke=\"#d55e00\" stroke-width=\"0.7\"/></pattern></defs>",
        width * SCALE,
        height * SCALE
    );
    let cell = |i: i32, j: i32| (j * width + i) as usize;
    for j in 0..height {
        // Up is +y.
        let row = height - 1 - j;
        for (from, to, [r, g, b]) in runs(width, &|i| color(cell(i, j))) {
            _ = write!(
                svg,
                "<rect x=\"{from}\" y=\"{row}\" width=\"{}\" height=\"1\" fill=\"#{r:02x}{g:02x}{b:02x}\"/>",
                to - from
            );
        }
        for (from, to, is_hatched) in runs(width, &|i| hatched(cell(i, j))) {
            if is_hatched {
                _ = write!(
                    svg,
                    "<rect x=\"{from}\" y=\"{row}\" width=\"{}\" height=\"1\" fill=\"url(#guessed)\"/>",
                    to - from
                );
            }
        }
    }
    for sample in samples {
        let [u, v] = [0, 1].map(|axis| sample.place[axis] - relief.middle[axis]);
        let (u, v) = (u + f64::from(x) + 0.5, f64::from(y) - v + 0.5);
        let class = if sample.is_contact { "contact" } else { "missed" };
        _ = write!(svg, "<circle class=\"{class}\" cx=\"{u:.1}\" cy=\"{v:.1}\" r=\"0.5\"/>");
    }
    svg + "</svg>"
}

/// Runs of equal values.
fn runs<T: PartialEq>(width: i32, of: &dyn Fn(i32) -> T) -> Vec<(i32, i32, T)> {
    let mut runs: Vec<(i32, i32, T)> = Vec::new();
    for i in 0..width {
        let value = of(i);
        match runs.last_mut() {
            Some((_, to, last)) if *last == value => *to = i + 1,
            _ => runs.push((i, i + 1, value)),
        }
    }
    runs
}

/// Color of a share of the greatest height.
fn ramp(share: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 4] =
        [[32.0, 36.0, 64.0], [38.0, 110.0, 142.0], [80.0, 180.0, 120.0], [250.0, 231.0, 120.0]];
    let at = (share.clamp(0.0, 1.0) * SHADES).round() / SHADES * 3.0;
    let low = (at as usize).min(2);
    [0, 1, 2].map(|part| (STOPS[low][part] + (STOPS[low + 1][part] - STOPS[low][part]) * (at - low as f64)) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_equal_cells_are_one_rectangle() {
        assert_eq!(runs(4, &|i| i / 3), [(0, 3, 0), (3, 4, 1)]);
        assert_eq!(ramp(0.0), [32, 36, 64]);
        assert_eq!(ramp(2.0), [250, 231, 120]);
    }
}
