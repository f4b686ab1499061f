//! Charts as SVG: axes with units, marks, and labels beside what they name instead of a legend.
//!
//! Everything is drawn four times as large as it is shown, since the plotting library rounds to whole pixels.

use super::colour::{GREY, GRID, INK};
use super::scale::Scale;
use crate::error::{Error, Result};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text, TriangleMarker};
use plotters::prelude::{DrawingArea, IntoDrawingArea, IntoFont, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, RGBColor, ShapeStyle, TextStyle};

/// Pixels drawn for each pixel shown.
const FINE: i32 = 4;
/// The height of text, in shown pixels.
const TEXT: i32 = 13;
/// The mean width of a character, in shown pixels.
const CHARACTER: f64 = 6.9;

/// A drawing as SVG text, with its natural size in pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Svg {
    /// The `<svg>` element.
    pub text: String,
    /// Natural width.
    pub width: u32,
    /// Natural height.
    pub height: u32,
}

/// One thing drawn in a chart, in the axes' units.
#[derive(Clone, Debug)]
pub enum Mark {
    /// A line through points.
    Line {
        /// Its points, in order.
        points: Vec<(f64, f64)>,
        /// Its colour.
        colour: RGBColor,
        /// Solid or dashed.
        stroke: Stroke,
    },
    /// A translucent band between a lower and an upper line: `(x, low, high)`.
    Band {
        /// The band's ends at each x, in order.
        points: Vec<(f64, f64, f64)>,
        /// Its colour.
        colour: RGBColor,
    },
    /// Error bars: `(x, low, high)`.
    Spread {
        /// The bars' ends.
        points: Vec<(f64, f64, f64)>,
        /// Their colour.
        colour: RGBColor,
    },
    /// Points.
    Dots {
        /// Where.
        points: Vec<(f64, f64)>,
        /// Their colour.
        colour: RGBColor,
        /// Their shape.
        shape: Shape,
    },
    /// A filled rectangle between two opposite corners.
    Box {
        /// One corner.
        from: (f64, f64),
        /// The other.
        to: (f64, f64),
        /// Its colour.
        colour: RGBColor,
        /// 0 nothing to 1 solid.
        opacity: f64,
    },
    /// The area between a line and a base.
    Area {
        /// The line's points, in order.
        points: Vec<(f64, f64)>,
        /// The base's y.
        base: f64,
        /// Its colour.
        colour: RGBColor,
        /// 0 nothing to 1 solid.
        opacity: f64,
    },
    /// Text at a point, moved by whole shown pixels.
    Text {
        /// Where.
        at: (f64, f64),
        /// What.
        text: String,
        /// Its colour.
        colour: RGBColor,
        /// Which side of the point it stands on.
        side: Side,
    },
    /// A thin line across the chart at an x.
    Vertical(f64),
    /// A thin line across the chart at a y.
    Horizontal(f64),
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    /// Unbroken.
    Solid,
    /// Dashed.
    Dashed,
    /// Unbroken and thin.
    Thin,
}

/// What a point looks like, so that series differ without colour too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A filled circle.
    Disc,
    /// An open circle.
    Ring,
    /// A filled triangle.
    Triangle,
    /// A filled square.
    Square,
}

/// Which side of a point a text stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Left of it.
    Left,
    /// Right of it.
    Right,
    /// Above it.
    Above,
    /// Below it.
    Below,
    /// Below it, to the right.
    LowerRight,
    /// Above it, to the left.
    UpperLeft,
    /// On it.
    Centre,
}

/// A label at the right end of a line.
#[derive(Clone, Debug)]
pub struct EndLabel {
    /// The line's last y.
    pub y: f64,
    /// The line's mean y, which decides the order of labels whose lines end together.
    pub mean: f64,
    /// What the line is.
    pub text: String,
    /// The line's colour.
    pub colour: RGBColor,
}

impl EndLabel {
    /// The label of a line through `points`; off the chart if there are none.
    pub fn of(text: &str, colour: RGBColor, points: &[(f64, f64)]) -> Self {
        let mean = points.iter().map(|point| point.1).sum::<f64>() / points.len().max(1) as f64;
        Self { y: points.last().map_or(f64::NAN, |point| point.1), mean, text: text.to_string(), colour }
    }
}

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Stands above the chart; may be empty.
    pub title: String,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The horizontal axis.
    pub x: Scale,
    /// What it shows, with its unit; may be empty.
    pub x_name: String,
    /// The vertical axis.
    pub y: Scale,
    /// What it shows, with its unit; may be empty.
    pub y_name: String,
    /// Whether the horizontal axis's texts stand upright, for names.
    pub upright_names: bool,
    /// What is drawn, in order.
    pub marks: Vec<Mark>,
    /// Labels at the right ends of lines; they are moved apart where they would collide.
    pub labels: Vec<EndLabel>,
}

impl Chart {
    /// An empty chart of 560 × 360 pixels.
    pub fn new(x_name: impl Into<String>, x: Scale, y_name: impl Into<String>, y: Scale) -> Self {
        Self {
            title: String::new(),
            width: 560,
            height: 360,
            x,
            x_name: x_name.into(),
            y,
            y_name: y_name.into(),
            upright_names: false,
            marks: Vec::new(),
            labels: Vec::new(),
        }
    }

    /// The same in another size.
    pub fn sized(mut self, width: u32, height: u32) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// The same with a title.
    pub fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// The same with another mark on top.
    pub fn with(mut self, mark: Mark) -> Self {
        self.marks.push(mark);
        self
    }

    /// Adds a line with a point at each of its places and its name at its right end.
    pub fn series(&mut self, name: &str, colour: RGBColor, shape: Shape, points: &[(f64, f64)]) {
        let points: Vec<(f64, f64)> = points.iter().copied().filter(|point| point.1.is_finite()).collect();
        if points.is_empty() {
            return;
        }
        self.labels.push(EndLabel::of(name, colour, &points));
        self.marks.push(Mark::Line { points: points.clone(), colour, stroke: Stroke::Solid });
        self.marks.push(Mark::Dots { points, colour, shape });
    }

    /// Adds a line, solid or dashed, with its name at its right end.
    pub fn line(&mut self, name: &str, colour: RGBColor, stroke: Stroke, points: &[(f64, f64)]) {
        let points: Vec<(f64, f64)> = points.iter().copied().filter(|point| point.1.is_finite()).collect();
        if points.is_empty() {
            return;
        }
        if !name.is_empty() {
            self.labels.push(EndLabel::of(name, colour, &points));
        }
        self.marks.push(Mark::Line { points, colour, stroke });
    }

    /// Draws the chart.
    ///
    /// # Errors
    /// If the plotting library refuses, which it has no reason to.
    pub fn svg(&self) -> Result<Svg> {
        let mut text = String::new();
        {
            let size = (self.width * FINE as u32, self.height * FINE as u32);
            let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
            self.draw(&root).and_then(|()| root.present().map_err(|e| e.to_string())).map_err(|what| {
                Error::data(format!("cannot draw the chart \"{}\": {what}", self.title), "Report this as a bug.")
            })?;
        }
        Ok(Svg { text: with_natural_size(&text, self.width, self.height), width: self.width, height: self.height })
    }

    fn draw(&self, root: &DrawingArea<SVGBackend, Shift>) -> Result<(), String> {
        let label_width = self.labels.iter().map(|label| label.text.chars().count()).max().unwrap_or(0);
        let top = if self.title.is_empty() { 10 } else { 30 };
        let tick_width = (self.y.longest() as f64 * CHARACTER) as i32 + 10;
        let left = tick_width + if self.y_name.is_empty() { 4 } else { 22 };
        let tick_height = if self.upright_names { (self.x.longest() as f64 * CHARACTER) as i32 + 10 } else { 22 };
        let bottom = tick_height + if self.x_name.is_empty() { 4 } else { 20 };
        let right = if label_width == 0 { 18 } else { (label_width as f64 * CHARACTER * 1.12) as i32 + 24 };
        let (width, height) = (self.width as i32, self.height as i32);
        let spec = Cartesian2d::<Scale, Scale>::new(
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
                draw_upright(root, text, (x, frame.bottom + 6), HPos::Right, &GREY)?;
            } else {
                draw_text(root, text, (x, frame.bottom + 6), HPos::Center, VPos::Top, &GREY, false)?;
            }
        }
        for (value, text) in &self.y.ticks {
            let y = area.map_coordinate(&(self.x.ticks.first().map_or(0.0, |tick| tick.0), *value)).1 / FINE;
            if self.y.grid {
                draw_line(root, &[(frame.left, y), (frame.right, y)], &GRID, 1)?;
            }
            draw_text(root, text, (frame.left - 6, y), HPos::Right, VPos::Center, &GREY, false)?;
        }
        draw_line(root, &[(frame.left, frame.bottom), (frame.right, frame.bottom)], &GREY, 1)?;
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
                draw_line(root, &[from, to], &label.colour, 1)?;
            }
            draw_text(root, &label.text, (to.0 + 3, to.1), HPos::Left, VPos::Center, &label.colour, false)?;
        }
        Ok(())
    }
}

type Root<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plane<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<Scale, Scale>>;

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
        Mark::Line { points, colour, stroke } => {
            let width = if *stroke == Stroke::Thin { 1 } else { 2 };
            let style = ShapeStyle::from(colour).stroke_width(fine(width));
            if *stroke == Stroke::Dashed {
                let pixels: Vec<(i32, i32)> = points.iter().map(|point| area.map_coordinate(point)).collect();
                for dash in dashes(&pixels, f64::from(6 * FINE), f64::from(4 * FINE)) {
                    to(root.draw(&PathElement::new(dash, style)))?;
                }
                Ok(())
            } else {
                to(area.draw(&PathElement::new(points.clone(), style)))
            }
        }
        Mark::Band { points, colour } => {
            let outline = points.iter().map(|point| (point.0, point.1));
            let back = points.iter().rev().map(|point| (point.0, point.2));
            let outline: Vec<(f64, f64)> = outline.chain(back).collect();
            to(area.draw(&Polygon::new(outline, colour.mix(0.18))))
        }
        Mark::Spread { points, colour } => {
            let style = ShapeStyle::from(colour).stroke_width(fine(1));
            points
                .iter()
                .try_for_each(|&(x, low, high)| to(area.draw(&PathElement::new(vec![(x, low), (x, high)], style))))
        }
        Mark::Dots { points, colour, shape } => points.iter().try_for_each(|&point| match shape {
            Shape::Disc => to(area.draw(&Circle::new(point, 3 * FINE, colour.filled()))),
            Shape::Ring => to(area.draw(&Circle::new(point, 3 * FINE, ShapeStyle::from(colour).stroke_width(fine(2))))),
            Shape::Triangle => to(area.draw(&TriangleMarker::new(point, 4 * FINE, colour.filled()))),
            Shape::Square => {
                let (x, y) = area.map_coordinate(&point);
                let half = 3 * FINE;
                to(root.draw(&Rectangle::new([(x - half, y - half), (x + half, y + half)], colour.filled())))
            }
        }),
        Mark::Box { from, to: corner, colour, opacity } => {
            to(area.draw(&Rectangle::new([*from, *corner], colour.mix(*opacity).filled())))
        }
        Mark::Area { points, base, colour, opacity } => {
            let (Some(first), Some(last)) = (points.first(), points.last()) else { return Ok(()) };
            let mut outline = points.clone();
            outline.extend([(last.0, *base), (first.0, *base)]);
            to(area.draw(&Polygon::new(outline, colour.mix(*opacity))))
        }
        Mark::Text { at, text, colour, side } => {
            let (x, y) = area.map_coordinate(at);
            let (x, y) = (x / FINE, y / FINE);
            let (place, h, v) = match side {
                Side::Left => ((x - 6, y), HPos::Right, VPos::Center),
                Side::Right => ((x + 6, y), HPos::Left, VPos::Center),
                Side::Above => ((x, y - 6), HPos::Center, VPos::Bottom),
                Side::Below => ((x, y + 6), HPos::Center, VPos::Top),
                Side::LowerRight => ((x + 5, y + 10), HPos::Left, VPos::Center),
                Side::UpperLeft => ((x - 5, y - 10), HPos::Right, VPos::Center),
                Side::Centre => ((x, y), HPos::Center, VPos::Center),
            };
            draw_text(root, text, place, h, v, colour, false)
        }
        Mark::Vertical(x) => {
            let x = area.as_coord_spec().get_x_axis_pixel(*x);
            draw_line(root, &[(x, frame.top), (x, frame.bottom)], &GREY, 1)
        }
        Mark::Horizontal(y) => {
            let y = area.as_coord_spec().get_y_axis_pixel(*y);
            draw_line(root, &[(frame.left, y), (frame.right, y)], &GREY, 1)
        }
    }
}

/// Shown pixels of a value on one axis.
trait AxisPixel {
    fn get_x_axis_pixel(&self, x: f64) -> i32;
    fn get_y_axis_pixel(&self, y: f64) -> i32;
}

impl AxisPixel for Cartesian2d<Scale, Scale> {
    fn get_x_axis_pixel(&self, x: f64) -> i32 {
        use plotters::coord::CoordTranslate;
        self.translate(&(x, self.get_y_range().start)).0 / FINE
    }
    fn get_y_axis_pixel(&self, y: f64) -> i32 {
        use plotters::coord::CoordTranslate;
        self.translate(&(self.get_x_range().start, y)).1 / FINE
    }
}

fn draw_line(root: &Root, points: &[(i32, i32)], colour: &RGBColor, width: i32) -> Result<(), String> {
    let points: Vec<(i32, i32)> = points.iter().map(|&(x, y)| (x * FINE, y * FINE)).collect();
    let style = ShapeStyle::from(colour).stroke_width((width * FINE) as u32);
    root.draw(&PathElement::new(points, style)).map_err(|e| e.to_string())
}

fn draw_text(
    root: &Root,
    text: &str,
    (x, y): (i32, i32),
    h: HPos,
    v: VPos,
    colour: &RGBColor,
    bold: bool,
) -> Result<(), String> {
    if text.is_empty() {
        return Ok(());
    }
    let size = f64::from(TEXT * FINE) * 1.24;
    let font = ("sans-serif", size).into_font();
    let font = if bold { font.style(plotters::style::FontStyle::Bold) } else { font };
    let style = TextStyle::from(font).color(colour).pos(Pos::new(h, v));
    root.draw(&Text::new(text.to_string(), (x * FINE, y * FINE), style)).map_err(|e| e.to_string())
}

/// Text that reads from below upwards.
fn draw_upright(root: &Root, text: &str, (x, y): (i32, i32), h: HPos, colour: &RGBColor) -> Result<(), String> {
    if text.is_empty() {
        return Ok(());
    }
    let font = ("sans-serif", f64::from(TEXT * FINE) * 1.24).into_font().transform(FontTransform::Rotate270);
    let style = TextStyle::from(font).color(colour).pos(Pos::new(h, VPos::Center));
    root.draw(&Text::new(text.to_string(), (x * FINE, y * FINE), style)).map_err(|e| e.to_string())
}

/// Cuts a path into dashes of a length with gaps of another, in its own units.
fn dashes(path: &[(i32, i32)], dash: f64, gap: f64) -> Vec<Vec<(i32, i32)>> {
    let mut out = Vec::new();
    let (mut current, mut drawing, mut left) = (path.first().map(|&p| vec![p]).unwrap_or_default(), true, dash);
    for ends in path.windows(2) {
        let (from, to) = (ends[0], ends[1]);
        let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
        let length = dx.hypot(dy);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = (from.0 + (dx * done / length).round() as i32, from.1 + (dy * done / length).round() as i32);
            if drawing {
                current.push(at);
                out.push(std::mem::take(&mut current));
            } else {
                current = vec![at];
            }
            drawing = !drawing;
            left = if drawing { dash } else { gap };
        }
        left -= length - done;
        if drawing {
            current.push(to);
        }
    }
    if current.len() > 1 {
        out.push(current);
    }
    out
}

/// Places as near as possible to the `wanted` ones, in the order of `ordered`, at least `distance` apart and within `low..high`
/// if they fit: neighbours that collide are pooled and spread about their mean.
fn apart(wanted: &[f64], ordered: &[f64], distance: f64, low: f64, high: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|&a, &b| ordered[a].total_cmp(&ordered[b]));
    // A pool holds how many labels it has and the sum of where its first one would like to be.
    let mut pools: Vec<(usize, f64)> = Vec::new();
    let start = |pool: &(usize, f64)| {
        let span = (pool.0 - 1) as f64 * distance;
        (pool.1 / pool.0 as f64).min(high - span).max(low)
    };
    for &index in &order {
        let mut pool = (1, wanted[index]);
        while let Some(last) = pools.last() {
            if start(last) + last.0 as f64 * distance <= start(&pool) {
                break;
            }
            let offset = last.0 as f64 * distance;
            pool = (last.0 + pool.0, last.1 + pool.1 - offset * pool.0 as f64);
            pools.pop();
        }
        pools.push(pool);
    }
    let places = pools.iter().flat_map(|pool| {
        let start = start(pool);
        (0..pool.0).map(move |k| start + k as f64 * distance)
    });
    let mut out = vec![0.0; wanted.len()];
    order.iter().zip(places).for_each(|(&index, place)| out[index] = place);
    out
}

/// The same drawing shown in its natural size; the plotting library states the size that it drew in.
fn with_natural_size(text: &str, width: u32, height: u32) -> String {
    let drawn = format!("<svg width=\"{}\" height=\"{}\"", width * FINE as u32, height * FINE as u32);
    text.replacen(&drawn, &format!("<svg width=\"{width}\" height=\"{height}\""), 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::colour::BLUE;

    #[test]
    fn labels_that_would_collide_are_moved_apart_and_stay_inside() {
        let apart = |wanted: &[f64], distance, low, high| apart(wanted, wanted, distance, low, high);
        let places = apart(&[100.0, 101.0, 50.0, 102.0], 10.0, 0.0, 105.0);
        assert_eq!(places[2], 50.0);
        assert_eq!([places[0], places[1], places[3]], [85.0, 95.0, 105.0]);
        assert_eq!(apart(&[5.0, 30.0], 10.0, 0.0, 100.0), [5.0, 30.0]);
        assert_eq!(apart(&[20.0, 20.0], 10.0, 0.0, 100.0), [15.0, 25.0]);
        assert!(apart(&[], 10.0, 0.0, 1.0).is_empty());
    }

    #[test]
    fn dashes_cover_the_path_with_gaps() {
        let cut = dashes(&[(0, 0), (100, 0)], 30.0, 10.0);
        assert_eq!(cut, [vec![(0, 0), (30, 0)], vec![(40, 0), (70, 0)], vec![(80, 0), (100, 0)]]);
        assert_eq!(dashes(&[(0, 0), (10, 0), (10, 10)], 100.0, 5.0), [vec![(0, 0), (10, 0), (10, 10)]]);
    }

    #[test]
    fn a_chart_has_its_axes_names_its_labels_and_its_natural_size() {
        let mut chart = Chart::new("touches", Scale::logarithmic(1.0, 60.0), "accuracy", Scale::share());
        chart.series("ours & theirs", BLUE, Shape::Disc, &[(1.0, 0.2), (10.0, 0.7), (60.0, f64::NAN)]);
        let svg = chart.titled("Accuracy").svg().unwrap();
        for part in ["touches", "accuracy", "ours &amp; theirs", "100 %", "Accuracy", "#0072B2", "</svg>"] {
            assert!(svg.text.contains(part), "{part}\n{}", svg.text);
        }
        assert!(svg.text.starts_with("<svg width=\"560\" height=\"360\" viewBox=\"0 0 2240 1440\""), "{}", svg.text);
        assert!(!svg.text.contains("NaN"));
    }
}
