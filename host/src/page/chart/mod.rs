//! Charts as SVG: axes with units, marks, and labels beside what they name instead of a legend.
//!
//! Everything is drawn four times as large as it is shown, since the plotting library rounds to whole pixels.

mod draw;
mod place;

use super::scale::Scale;
use crate::error::{Error, Result};
use draw::FINE;
use plotters::prelude::{IntoDrawingArea, SVGBackend};
use plotters::style::RGBColor;

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
        /// Its color.
        color: RGBColor,
        /// Solid or dashed.
        stroke: Stroke,
    },
    /// A translucent band between a lower and an upper line: `(x, low, high)`.
    Band {
        /// The band's ends at each x, in order.
        points: Vec<(f64, f64, f64)>,
        /// Its color.
        color: RGBColor,
    },
    /// Error bars: `(x, low, high)`.
    Spread {
        /// The bars' ends.
        points: Vec<(f64, f64, f64)>,
        /// Their color.
        color: RGBColor,
    },
    /// Points.
    Dots {
        /// Where.
        points: Vec<(f64, f64)>,
        /// Their color.
        color: RGBColor,
        /// Their shape.
        shape: Shape,
    },
    /// A filled rectangle between two opposite corners.
    Box {
        /// One corner.
        from: (f64, f64),
        /// The other.
        to: (f64, f64),
        /// Its color.
        color: RGBColor,
        /// 0 nothing to 1 solid.
        opacity: f64,
    },
    /// The area between a line and a base.
    Area {
        /// The line's points, in order.
        points: Vec<(f64, f64)>,
        /// The base's y.
        base: f64,
        /// Its color.
        color: RGBColor,
        /// 0 nothing to 1 solid.
        opacity: f64,
    },
    /// Text at a point, moved by whole shown pixels.
    Text {
        /// Where.
        at: (f64, f64),
        /// What.
        text: String,
        /// Its color.
        color: RGBColor,
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

/// What a point looks like, so that series differ without color too.
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
    Center,
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
    /// The line's color.
    pub color: RGBColor,
}

impl EndLabel {
    /// The label of a line through `points`; off the chart if there are none.
    pub fn of(text: &str, color: RGBColor, points: &[(f64, f64)]) -> Self {
        let mean = points.iter().map(|point| point.1).sum::<f64>() / points.len().max(1) as f64;
        Self { y: points.last().map_or(f64::NAN, |point| point.1), mean, text: text.to_string(), color }
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
    pub fn series(&mut self, name: &str, color: RGBColor, shape: Shape, points: &[(f64, f64)]) {
        let points: Vec<(f64, f64)> = points.iter().copied().filter(|point| point.1.is_finite()).collect();
        if points.is_empty() {
            return;
        }
        self.labels.push(EndLabel::of(name, color, &points));
        self.marks.push(Mark::Line { points: points.clone(), color, stroke: Stroke::Solid });
        self.marks.push(Mark::Dots { points, color, shape });
    }

    /// Adds a line, solid or dashed, with its name at its right end.
    pub fn line(&mut self, name: &str, color: RGBColor, stroke: Stroke, points: &[(f64, f64)]) {
        let points: Vec<(f64, f64)> = points.iter().copied().filter(|point| point.1.is_finite()).collect();
        if points.is_empty() {
            return;
        }
        if !name.is_empty() {
            self.labels.push(EndLabel::of(name, color, &points));
        }
        self.marks.push(Mark::Line { points, color, stroke });
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
