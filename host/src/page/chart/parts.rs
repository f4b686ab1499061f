//! What a chart is made of: plain data.

use crate::page::axis::Axis;
use plotters::style::RGBColor;

/// A drawing as SVG text, with its natural size in pixels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Svg {
    /// The `<svg>` element.
    pub(crate) text: String,
    /// Natural width.
    pub(crate) width: u32,
    /// Natural height.
    pub(crate) height: u32,
}

/// One thing drawn in a chart, in the axes' units.
#[derive(Clone, Debug)]
pub(crate) enum Mark {
    /// A line through points.
    Line {
        /// Its points, in order.
        points: Vec<(f64, f64)>,
        /// Its color.
        color: RGBColor,
        /// Solid or dashed.
        stroke: Stroke,
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
        /// Where it is relative to the point.
        side: Side,
    },
    /// A thin line across the chart at an x.
    Vertical(f64),
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stroke {
    /// Unbroken.
    Solid,
    /// Dashed.
    Dashed,
    /// Unbroken and thin.
    Thin,
}

/// What a point looks like, so that series differ without color too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// A filled circle.
    Disc,
    /// An open circle.
    Ring,
    /// A filled triangle.
    Triangle,
    /// A filled square.
    Square,
}

/// Where a text is relative to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// Left of it.
    Left,
    /// Right of it.
    Right,
    /// Above it.
    Above,
    /// Below it, to the right.
    LowerRight,
    /// Above it, to the left.
    UpperLeft,
    /// On it.
    Center,
}

/// A label at the right end of a line.
#[derive(Clone, Debug)]
pub(crate) struct EndLabel {
    /// The line's last y.
    pub(crate) y: f64,
    /// The line's mean y, which decides the order of labels whose lines end together.
    pub(crate) mean: f64,
    /// What the line is.
    pub(crate) text: String,
    /// The line's color.
    pub(crate) color: RGBColor,
}

impl EndLabel {
    /// The label of a line through `points`; off the chart if there are none.
    pub(crate) fn of(text: &str, color: RGBColor, points: &[(f64, f64)]) -> Self {
        let mean = points.iter().map(|point| point.1).sum::<f64>() / points.len().max(1) as f64;
        Self { y: points.last().map_or(f64::NAN, |point| point.1), mean, text: text.to_string(), color }
    }
}

/// A chart.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    /// Above the chart; may be empty.
    pub(crate) title: String,
    /// Width in pixels.
    pub(crate) width: u32,
    /// Height in pixels.
    pub(crate) height: u32,
    /// The horizontal axis.
    pub(crate) x: Axis,
    /// What it shows, with its unit; may be empty.
    pub(crate) x_name: String,
    /// The vertical axis.
    pub(crate) y: Axis,
    /// What it shows, with its unit; may be empty.
    pub(crate) y_name: String,
    /// Whether the horizontal axis's labels are vertical, for names.
    pub(crate) upright_names: bool,
    /// What is drawn, in order.
    pub(crate) marks: Vec<Mark>,
    /// Labels at the right ends of lines; they are moved apart where they would collide.
    pub(crate) labels: Vec<EndLabel>,
}

impl Chart {
    /// An empty chart of 560 × 360 pixels.
    pub(crate) fn new(x_name: impl Into<String>, x: Axis, y_name: impl Into<String>, y: Axis) -> Self {
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
    pub(crate) fn sized(mut self, width: u32, height: u32) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// The same with a title.
    pub(crate) fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Adds a line with a point at each of its places and its name at its right end.
    pub(crate) fn series(&mut self, name: &str, color: RGBColor, shape: Shape, points: &[(f64, f64)]) {
        let points: Vec<(f64, f64)> = points.iter().copied().filter(|point| point.1.is_finite()).collect();
        if points.is_empty() {
            return;
        }
        self.labels.push(EndLabel::of(name, color, &points));
        self.marks.push(Mark::Line { points: points.clone(), color, stroke: Stroke::Solid });
        self.marks.push(Mark::Dots { points, color, shape });
    }

    /// Adds a line, solid or dashed, with its name at its right end.
    pub(crate) fn line(&mut self, name: &str, color: RGBColor, stroke: Stroke, points: &[(f64, f64)]) {
        let points: Vec<(f64, f64)> = points.iter().copied().filter(|point| point.1.is_finite()).collect();
        if points.is_empty() {
            return;
        }
        if !name.is_empty() {
            self.labels.push(EndLabel::of(name, color, &points));
        }
        self.marks.push(Mark::Line { points, color, stroke });
    }
}
