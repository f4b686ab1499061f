//! Parts of a chart: plain data.

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
    /// Chart drawn for a phone's width, as an `<svg>` element; none where the drawing is narrow enough as it is, or
    /// cannot be made narrower.
    pub(crate) narrow: Option<String>,
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
        /// Places on the plane.
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
    /// Text beside a point, where there is room for it; otherwise it is left out.
    Note {
        /// The point.
        at: (f64, f64),
        /// The text.
        text: String,
        /// Its color.
        color: RGBColor,
    },
    /// Text in a cell of a table of names; all of a chart's cells have theirs, or none has.
    Cell {
        /// The cell's middle.
        at: (f64, f64),
        /// The text.
        text: String,
    },
    /// A thin line across the chart at an x.
    Vertical(f64),
}

/// Style of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stroke {
    /// Unbroken.
    Solid,
    /// Dashed.
    Dashed,
    /// Unbroken and thin.
    Thin,
}

/// Shape of a point, so that series differ without color too.
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

/// Style of a series: the sample beside its name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Key {
    /// Its color.
    pub(crate) color: RGBColor,
    /// Style of its line, if it has one.
    pub(crate) stroke: Option<Stroke>,
    /// Shape of its points, if it has some.
    pub(crate) shape: Option<Shape>,
}

/// The name of a series: at the right end of its line, or in a legend below the chart.
#[derive(Clone, Debug)]
pub(crate) struct Label {
    /// Name of the series.
    pub(crate) text: String,
    /// Its style.
    pub(crate) key: Key,
    /// The y of the line's right end, and its mean y, which decides the order of labels whose lines end together; without it the name
    /// belongs into the legend.
    pub(crate) end: Option<(f64, f64)>,
}

impl Label {
    /// The label of a line through `points`, which is not empty.
    fn of(text: &str, key: Key, points: &[(f64, f64)]) -> Self {
        let mean = points.iter().map(|point| point.1).sum::<f64>() / points.len().max(1) as f64;
        let last = points.iter().max_by(|a, b| a.0.total_cmp(&b.0));
        Self { text: text.to_string(), key, end: last.map(|last| (last.1, mean)) }
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
    /// Its quantity, with the unit; may be empty.
    pub(crate) x_name: String,
    /// The vertical axis.
    pub(crate) y: Axis,
    /// Its quantity, with the unit; may be empty.
    pub(crate) y_name: String,
    /// True if the horizontal axis's labels are vertical, for names.
    pub(crate) upright_names: bool,
    /// Marks in drawing order.
    pub(crate) marks: Vec<Mark>,
    /// Names of series: at the right ends of lines, moved apart where they would collide, or in a legend below the chart
    /// where they would take too much of it.
    pub(crate) labels: Vec<Label>,
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

    /// The chart in another size.
    pub(crate) fn sized(mut self, width: u32, height: u32) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// The chart with a title.
    pub(crate) fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Adds a line with a point at each of its places, and its name.
    pub(crate) fn series(&mut self, name: &str, color: RGBColor, shape: Shape, points: &[(f64, f64)]) {
        let points: Vec<(f64, f64)> = points.iter().copied().filter(|point| point.1.is_finite()).collect();
        if points.is_empty() {
            return;
        }
        if !name.is_empty() {
            let key = Key { color, stroke: Some(Stroke::Solid), shape: Some(shape) };
            self.labels.push(Label::of(name, key, &points));
        }
        self.marks.push(Mark::Line { points: points.clone(), color, stroke: Stroke::Solid });
        self.marks.push(Mark::Dots { points, color, shape });
    }

    /// Adds a line, solid or dashed, and its name.
    pub(crate) fn line(&mut self, name: &str, color: RGBColor, stroke: Stroke, points: &[(f64, f64)]) {
        let points: Vec<(f64, f64)> = points.iter().copied().filter(|point| point.1.is_finite()).collect();
        if points.is_empty() {
            return;
        }
        if !name.is_empty() {
            self.labels.push(Label::of(name, Key { color, stroke: Some(stroke), shape: None }, &points));
        }
        self.marks.push(Mark::Line { points, color, stroke });
    }

    /// Adds a name to the legend below the chart.
    pub(crate) fn legend(
        &mut self,
        name: impl Into<String>,
        color: RGBColor,
        stroke: Option<Stroke>,
        shape: Option<Shape>,
    ) {
        self.labels.push(Label { text: name.into(), key: Key { color, stroke, shape }, end: None });
    }
}
