//! How a chart becomes lines, shapes and text.
//!
//! Everything is drawn four times as large as it is shown, since the plotting library rounds to whole pixels.

use super::labels::apart;
use super::parts::{Chart, Mark, Shape, Side, Stroke, Svg};
use crate::error::{PageProblem, Result};
use crate::page::axis::Axis;
use crate::page::color::{self, GRAY, GRID, INK};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::element::{Circle, DashedPathElement, PathElement, Polygon, Rectangle, Text, TriangleMarker};
use plotters::prelude::{DrawingArea, IntoDrawingArea, IntoFont, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, RGBColor, ShapeStyle, TextStyle};

/// Pixels drawn for each pixel shown.
const FINE: i32 = 4;
/// The height of text, in shown pixels.
const TEXT: i32 = 13;
/// The mean width of a character, in shown pixels.
const CHARACTER: f64 = 6.9;

impl Chart {
    /// Draws the chart.
    ///
    /// # Errors
    /// If the plotting library refuses, which it has no reason to.
    pub(crate) fn svg(&self) -> Result<Svg> {
        let mut text = String::new();
        {
            let size = (self.width * FINE as u32, self.height * FINE as u32);
            let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
            self.draw(&root)
                .and_then(|()| root.present().map_err(|e| e.to_string()))
                .map_err(|reason| PageProblem::Chart { title: self.title.clone(), reason })?;
        }
        Ok(Svg { text: with_natural_size(&text, self.width, self.height), width: self.width, height: self.height })
    }

    fn draw(&self, root: &Root) -> Result<(), String> {
        let label_width = self.labels.iter().map(|label| label.text.chars().count()).max().unwrap_or(0);
        let top = if self.title.is_empty() { 10 } else { 30 };
        let tick_width = (self.y.longest() as f64 * CHARACTER) as i32 + 10;
        let left = tick_width + if self.y_name.is_empty() { 4 } else { 22 };
        let tick_height = if self.upright_names { (self.x.longest() as f64 * CHARACTER) as i32 + 10 } else { 22 };
        let bottom = tick_height + if self.x_name.is_empty() { 4 } else { 20 };
        let right = if label_width == 0 { 18 } else { (label_width as f64 * CHARACTER * 1.12) as i32 + 24 };
        let (width, height) = (self.width as i32, self.height as i32);
        let spec = Cartesian2d::<Axis, Axis>::new(
            self.x.clone(),
            self.y.clone(),
            (left * FINE..(width - right) * FINE, (height - bottom) * FINE..top * FINE),
        );
        let area = root.apply_coord_spec(spec);
        let frame = Frame { left, right: width - right, top, bottom: height - bottom };

        self.draw_axes(root, &area, &frame)?;
        for mark in &self.marks {
            draw_mark(root, &area, &frame, mark)?;
        }
        self.draw_labels(root, &area, &frame)?;
        if !self.title.is_empty() {
            draw_text(root, &self.title, (frame.left, 8), HPos::Left, VPos::Top, &INK, true)?;
        }
        Ok(())
    }

    fn draw_axes(&self, root: &Root, area: &Plane, frame: &Frame) -> Result<(), String> {
        for (value, text) in &self.x.ticks {
            let x = area.map_coordinate(&(*value, self.y.ticks.first().map_or(0.0, |tick| tick.0))).0 / FINE;
            if self.x.grid {
                draw_line(root, &[(x, frame.top), (x, frame.bottom)], &GRID, 1)?;
            }
            if self.upright_names {
                draw_upright(root, text, (x, frame.bottom + 6), HPos::Right, &GRAY)?;
            } else {
                draw_text(root, text, (x, frame.bottom + 6), HPos::Center, VPos::Top, &GRAY, false)?;
            }
        }
        for (value, text) in &self.y.ticks {
            let y = area.map_coordinate(&(self.x.ticks.first().map_or(0.0, |tick| tick.0), *value)).1 / FINE;
            if self.y.grid {
                draw_line(root, &[(frame.left, y), (frame.right, y)], &GRID, 1)?;
            }
            draw_text(root, text, (frame.left - 6, y), HPos::Right, VPos::Center, &GRAY, false)?;
        }
        draw_line(root, &[(frame.left, frame.bottom), (frame.right, frame.bottom)], &GRAY, 1)?;
        let middle = ((frame.left + frame.right) / 2, self.height as i32 - 6);
        draw_text(root, &self.x_name, middle, HPos::Center, VPos::Bottom, &INK, false)?;
        draw_upright(root, &self.y_name, (14, (frame.top + frame.bottom) / 2), HPos::Center, &INK)
    }

    fn draw_labels(&self, root: &Root, area: &Plane, frame: &Frame) -> Result<(), String> {
        let x = self.x.ticks.first().map_or(0.0, |tick| tick.0);
        let pixel = |y| f64::from(area.map_coordinate(&(x, y)).1 / FINE);
        let wanted: Vec<f64> = self.labels.iter().map(|label| pixel(label.y)).collect();
        // A twentieth of the way to the mean is enough to keep the order of lines that end within a pixel or two.
        let ordered: Vec<f64> = self.labels.iter().map(|label| pixel(label.y) + pixel(label.mean) / 20.0).collect();
        let places = apart(&wanted, &ordered, f64::from(TEXT) + 2.0, f64::from(frame.top), f64::from(frame.bottom));
        for ((label, wanted), place) in self.labels.iter().zip(wanted).zip(places) {
            let (from, to) = ((frame.right + 3, wanted as i32), (frame.right + 15, place as i32));
            if (wanted - place).abs() > 2.0 {
                draw_line(root, &[from, to], &label.color, 1)?;
            }
            draw_text(root, &label.text, (to.0 + 3, to.1), HPos::Left, VPos::Center, &color::text(label.color), false)?;
        }
        Ok(())
    }
}

type Root<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plane<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<Axis, Axis>>;

/// The edges of the plane, in shown pixels.
struct Frame {
    left: i32,
    right: i32,
    top: i32,
    bottom: i32,
}

fn draw_mark(root: &Root, area: &Plane, frame: &Frame, mark: &Mark) -> Result<(), String> {
    let to = |element: Result<(), _>| element.map_err(|e: plotters::drawing::DrawingAreaErrorKind<_>| e.to_string());
    let fine = |width: i32| (width * FINE) as u32;
    match mark {
        Mark::Line { points, color, stroke } => {
            let width = if *stroke == Stroke::Thin { 1 } else { 2 };
            let style = ShapeStyle::from(color).stroke_width(fine(width));
            if *stroke == Stroke::Dashed {
                let pixels: Vec<(i32, i32)> = points.iter().map(|point| area.map_coordinate(point)).collect();
                to(root.draw(&DashedPathElement::new(pixels, 6 * FINE, 4 * FINE, style)))
            } else {
                to(area.draw(&PathElement::new(points.clone(), style)))
            }
        }
        Mark::Spread { points, color } => {
            let style = ShapeStyle::from(color).stroke_width(fine(1));
            points
                .iter()
                .try_for_each(|&(x, low, high)| to(area.draw(&PathElement::new(vec![(x, low), (x, high)], style))))
        }
        Mark::Dots { points, color, shape } => points.iter().try_for_each(|&point| match shape {
            Shape::Disc => to(area.draw(&Circle::new(point, 3 * FINE, color.filled()))),
            Shape::Ring => to(area.draw(&Circle::new(point, 3 * FINE, ShapeStyle::from(color).stroke_width(fine(2))))),
            Shape::Triangle => to(area.draw(&TriangleMarker::new(point, 4 * FINE, color.filled()))),
            Shape::Square => {
                let (x, y) = area.map_coordinate(&point);
                let half = 3 * FINE;
                to(root.draw(&Rectangle::new([(x - half, y - half), (x + half, y + half)], color.filled())))
            }
        }),
        Mark::Box { from, to: corner, color, opacity } => {
            to(area.draw(&Rectangle::new([*from, *corner], color.mix(*opacity).filled())))
        }
        Mark::Area { points, base, color, opacity } => {
            let (Some(first), Some(last)) = (points.first(), points.last()) else { return Ok(()) };
            let mut outline = points.clone();
            outline.extend([(last.0, *base), (first.0, *base)]);
            to(area.draw(&Polygon::new(outline, color.mix(*opacity))))
        }
        Mark::Text { at, text, color, side } => {
            let (x, y) = area.map_coordinate(at);
            let (x, y) = (x / FINE, y / FINE);
            let (place, h, v) = match side {
                Side::Left => ((x - 6, y), HPos::Right, VPos::Center),
                Side::Right => ((x + 6, y), HPos::Left, VPos::Center),
                Side::Above => ((x, y - 6), HPos::Center, VPos::Bottom),
                Side::LowerRight => ((x + 5, y + 10), HPos::Left, VPos::Center),
                Side::UpperLeft => ((x - 5, y - 10), HPos::Right, VPos::Center),
                Side::Center => ((x, y), HPos::Center, VPos::Center),
            };
            draw_text(root, text, place, h, v, &color::text(*color), false)
        }
        Mark::Vertical(x) => {
            let x = area.map_coordinate(&(*x, area.get_y_range().start)).0 / FINE;
            draw_line(root, &[(x, frame.top), (x, frame.bottom)], &GRAY, 1)
        }
    }
}

fn draw_line(root: &Root, points: &[(i32, i32)], color: &RGBColor, width: i32) -> Result<(), String> {
    let points: Vec<(i32, i32)> = points.iter().map(|&(x, y)| (x * FINE, y * FINE)).collect();
    let style = ShapeStyle::from(color).stroke_width((width * FINE) as u32);
    root.draw(&PathElement::new(points, style)).map_err(|e| e.to_string())
}

fn draw_text(
    root: &Root,
    text: &str,
    (x, y): (i32, i32),
    h: HPos,
    v: VPos,
    color: &RGBColor,
    bold: bool,
) -> Result<(), String> {
    if text.is_empty() {
        return Ok(());
    }
    let size = f64::from(TEXT * FINE) * 1.24;
    let font = ("sans-serif", size).into_font();
    let font = if bold { font.style(plotters::style::FontStyle::Bold) } else { font };
    let style = TextStyle::from(font).color(color).pos(Pos::new(h, v));
    root.draw(&Text::new(text.to_string(), (x * FINE, y * FINE), style)).map_err(|e| e.to_string())
}

/// Text that reads from below upwards.
fn draw_upright(root: &Root, text: &str, (x, y): (i32, i32), h: HPos, color: &RGBColor) -> Result<(), String> {
    if text.is_empty() {
        return Ok(());
    }
    let font = ("sans-serif", f64::from(TEXT * FINE) * 1.24).into_font().transform(FontTransform::Rotate270);
    let style = TextStyle::from(font).color(color).pos(Pos::new(h, VPos::Center));
    root.draw(&Text::new(text.to_string(), (x * FINE, y * FINE), style)).map_err(|e| e.to_string())
}

/// The same drawing shown in its natural size; the plotting library states the size that it drew in.
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
        for part in ["touches", "accuracy", "ours &amp; theirs", "100 %", "Accuracy", "#0072B2", "</svg>"] {
            assert!(svg.text.contains(part), "{part}\n{}", svg.text);
        }
        assert!(svg.text.starts_with("<svg width=\"560\" height=\"360\" viewBox=\"0 0 2240 1440\""), "{}", svg.text);
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
