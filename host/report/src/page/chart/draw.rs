//! Drawing of a chart: lines, shapes and text.
//!
//! Everything is drawn four times as large as it is shown, since the plotting library rounds to whole pixels. Texts are
//! written here, at the places that the layout gave them: the library's own depend on the fonts of this machine.

use super::layout::{Anchor, Layout, NARROW, SAMPLE, Text};
use super::parts::{Chart, Key, Mark, Shape, Stroke, Svg};
use super::text::SIZE;
use crate::bug;
use crate::page::axis::Axis;
use crate::page::color::{GRAY, GRID};
use maud::html;
use palpate::error::Result;
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::element::{Circle, DashedPathElement, PathElement, Polygon, Rectangle, TriangleMarker};
use plotters::prelude::{DrawingArea, IntoDrawingArea, SVGBackend};
use plotters::style::{Color, RGBColor, ShapeStyle};
use std::fmt::Write as _;

/// Pixels drawn for each pixel shown.
const FINE: i32 = 4;

impl Chart {
    /// Draws the chart: in its own width, and if that is more than a phone's, in a phone's.
    ///
    /// # Errors
    /// If the plotting library refuses, which it has no reason to.
    pub(crate) fn svg(&self) -> Result<Svg> {
        let layout = self.layout(self.width);
        let text = self.drawn(&layout)?;
        let narrow = if layout.width > f64::from(NARROW) {
            let layout = self.layout(NARROW);
            // An axis of many names may need more room than a phone has.
            if layout.width > f64::from(NARROW) { None } else { Some(self.drawn(&layout)?) }
        } else {
            None
        };
        Ok(Svg { text, width: layout.width.ceil() as u32, height: layout.height.ceil() as u32, narrow })
    }

    fn drawn(&self, layout: &Layout) -> Result<String> {
        let (width, height) = (layout.width.ceil() as u32, layout.height.ceil() as u32);
        let mut text = String::new();
        {
            let size = (width * FINE as u32, height * FINE as u32);
            let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
            self.draw(&root, layout)
                .and_then(|()| root.present().map_err(|e| e.to_string()))
                .map_err(|reason| bug(format!("cannot draw the chart \"{}\": {reason}", self.title)))?;
        }
        let written: String = layout.texts.iter().map(written).collect();
        let text = text.replacen("</svg>", &format!("{written}</svg>"), 1);
        Ok(with_natural_size(&text, width, height))
    }

    fn draw(&self, root: &Root, layout: &Layout) -> Result<(), String> {
        let frame = &layout.frame;
        let [left, right, top, bottom] = [frame.left, frame.right, frame.top, frame.bottom].map(fine);
        let spec = Cartesian2d::<Axis, Axis>::new(self.x.clone(), self.y.clone(), (left..right, bottom..top));
        let area = root.apply_coord_spec(spec);
        let start = |axis: &Axis| axis.ticks.first().map_or(0.0, |tick| tick.0);
        for (value, _) in self.x.ticks.iter().filter(|_| self.x.grid) {
            let x = area.map_coordinate(&(*value, start(&self.y))).0;
            draw_line(root, [(x, top), (x, bottom)], &GRID)?;
        }
        for (value, _) in self.y.ticks.iter().filter(|_| self.y.grid) {
            let y = area.map_coordinate(&(start(&self.x), *value)).1;
            draw_line(root, [(left, y), (right, y)], &GRID)?;
        }
        draw_line(root, [(left, bottom), (right, bottom)], &GRAY)?;
        for mark in &self.marks {
            draw_mark(root, &area, [top, bottom], mark)?;
        }
        for ([from, to], color) in &layout.leaders {
            draw_line(root, [from, to].map(|&(x, y)| (fine(x), fine(y))), color)?;
        }
        for (at, key) in &layout.samples {
            draw_sample(root, *at, key)?;
        }
        Ok(())
    }
}

type Root<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plane<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<Axis, Axis>>;

/// Drawn pixels of shown ones.
fn fine(shown: f64) -> i32 {
    (shown * f64::from(FINE)).round() as i32
}

fn draw_mark(root: &Root, area: &Plane, [top, bottom]: [i32; 2], mark: &Mark) -> Result<(), String> {
    let to = |element: Result<(), _>| element.map_err(|e: plotters::drawing::DrawingAreaErrorKind<_>| e.to_string());
    match mark {
        Mark::Line { points, color, stroke } => {
            let pixels: Vec<(i32, i32)> = points.iter().map(|point| area.map_coordinate(point)).collect();
            draw_path(root, pixels, color, *stroke)
        }
        Mark::Spread { points, color } => {
            let style = ShapeStyle::from(color).stroke_width(FINE as u32);
            points
                .iter()
                .try_for_each(|&(x, low, high)| to(area.draw(&PathElement::new(vec![(x, low), (x, high)], style))))
        }
        Mark::Dots { points, color, shape } => {
            points.iter().try_for_each(|point| draw_dot(root, area.map_coordinate(point), color, *shape))
        }
        Mark::Box { from, to: corner, color, opacity } => {
            to(area.draw(&Rectangle::new([*from, *corner], color.mix(*opacity).filled())))
        }
        Mark::Area { points, base, color, opacity } => {
            let (Some(first), Some(last)) = (points.first(), points.last()) else { return Ok(()) };
            let mut outline = points.clone();
            outline.extend([(last.0, *base), (first.0, *base)]);
            to(area.draw(&Polygon::new(outline, color.mix(*opacity))))
        }
        // Texts are written where the layout put them.
        Mark::Note { .. } | Mark::Cell { .. } => Ok(()),
        Mark::Vertical(x) => {
            let x = area.map_coordinate(&(*x, area.get_y_range().start)).0;
            draw_line(root, [(x, top), (x, bottom)], &GRAY)
        }
    }
}

/// The sample of a series in a legend.
fn draw_sample(root: &Root, (x, y): (f64, f64), key: &Key) -> Result<(), String> {
    let (from, middle, to) = ((fine(x), fine(y)), (fine(x + 0.5 * SAMPLE), fine(y)), (fine(x + SAMPLE), fine(y)));
    if let Some(stroke) = key.stroke {
        draw_path(root, vec![from, to], &key.color, stroke)?;
    }
    match key.shape {
        Some(shape) => draw_dot(root, middle, &key.color, shape),
        None => Ok(()),
    }
}

fn draw_path(root: &Root, pixels: Vec<(i32, i32)>, color: &RGBColor, stroke: Stroke) -> Result<(), String> {
    let width = if stroke == Stroke::Thin { 1 } else { 2 };
    let style = ShapeStyle::from(color).stroke_width((width * FINE) as u32);
    let drawn = match stroke {
        Stroke::Dashed => root.draw(&DashedPathElement::new(pixels, 6 * FINE, 4 * FINE, style)),
        Stroke::Solid | Stroke::Thin => root.draw(&PathElement::new(pixels, style)),
    };
    drawn.map_err(|e| e.to_string())
}

fn draw_dot(root: &Root, (x, y): (i32, i32), color: &RGBColor, shape: Shape) -> Result<(), String> {
    let half = 3 * FINE;
    let drawn = match shape {
        Shape::Disc => root.draw(&Circle::new((x, y), half, color.filled())),
        Shape::Ring => root.draw(&Circle::new((x, y), half, ShapeStyle::from(color).stroke_width(2 * FINE as u32))),
        Shape::Triangle => root.draw(&TriangleMarker::new((x, y), 4 * FINE, color.filled())),
        Shape::Square => root.draw(&Rectangle::new([(x - half, y - half), (x + half, y + half)], color.filled())),
    };
    drawn.map_err(|e| e.to_string())
}

fn draw_line(root: &Root, points: [(i32, i32); 2], color: &RGBColor) -> Result<(), String> {
    let style = ShapeStyle::from(color).stroke_width(FINE as u32);
    root.draw(&PathElement::new(points.to_vec(), style)).map_err(|e| e.to_string())
}

/// A text as an element; one that is shortened shows all of itself when it is pointed at.
fn written(text: &Text) -> String {
    let (x, y, size) = (fine(text.x), fine(text.y), SIZE * f64::from(FINE));
    let RGBColor(r, g, b) = text.color;
    let anchor = match text.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let mut tag = format!(
        "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" font-size=\"{size}\" \
         fill=\"#{r:02X}{g:02X}{b:02X}\""
    );
    if text.bold {
        tag += " font-weight=\"bold\"";
    }
    if text.upright {
        // Writing to a string cannot fail.
        _ = write!(tag, " transform=\"rotate(270 {x} {y})\"");
    }
    let content = html! { @if let Some(whole) = &text.whole { title { (whole) } } (text.text) };
    format!("{tag}>{}</text>\n", content.into_string())
}

/// Drawing shown in its natural size; the plotting library states the size that it drew in.
fn with_natural_size(text: &str, width: u32, height: u32) -> String {
    let drawn = format!("<svg width=\"{}\" height=\"{}\"", width * FINE as u32, height * FINE as u32);
    text.replacen(&drawn, &format!("<svg width=\"{width}\" height=\"{height}\""), 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::color::BLUE;

    #[test]
    fn a_chart_has_its_axes_names_its_labels_and_its_natural_size() {
        let mut chart = Chart::new("touches", Axis::logarithmic(1.0, 60.0), "accuracy", Axis::share());
        chart.series("ours & theirs", BLUE, Shape::Disc, &[(1.0, 0.2), (10.0, 0.7), (60.0, f64::NAN)]);
        let svg = chart.titled("Accuracy").svg().unwrap();
        let narrow = svg.narrow.unwrap();
        for part in ["touches", "accuracy", "ours &amp; theirs", "100 %", "Accuracy", "#0072B2", "</svg>"] {
            assert!(svg.text.contains(part), "{part}\n{}", svg.text);
            assert!(narrow.contains(part), "{part}\n{narrow}");
        }
        assert!(svg.text.starts_with("<svg width=\"560\" height=\"360\" viewBox=\"0 0 2240 1440\""), "{}", svg.text);
        assert!(narrow.starts_with("<svg width=\"340\""), "{narrow}");
        assert!(!svg.text.contains("NaN"));
    }

    #[test]
    fn a_dashed_line_covers_its_path_with_gaps() {
        let mut chart = Chart::new("", Axis::linear(0.0, 1.0, 1), "", Axis::linear(0.0, 1.0, 1)).sized(220, 100);
        chart.line("", BLUE, Stroke::Dashed, &[(0.0, 0.5), (1.0, 0.5)]);
        let svg = chart.svg().unwrap().text;
        let dashes: Vec<(i32, i32)> = svg
            .split("<polyline ")
            .filter(|line| line.contains("#0072B2"))
            .map(|line| {
                let points = line.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
                let x: Vec<i32> =
                    points.split_whitespace().map(|p| p.split(',').next().unwrap().parse().unwrap()).collect();
                (x[0], *x.last().unwrap())
            })
            .collect();
        assert!(dashes.len() > 10, "{dashes:?}");
        for pair in dashes.windows(2) {
            let ((from, to), (next, _)) = (pair[0], pair[1]);
            assert_eq!((to - from, next - to), (6 * FINE, 4 * FINE), "{dashes:?}");
        }
    }
}
