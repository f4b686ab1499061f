//! Layout of a chart: the plane, and every text, before anything is drawn. No two texts overlap, and none is
//! cut off by the chart's edge, whatever the data and the names: what would not fit goes elsewhere (names of lines into a
//! legend below), or is shortened or left out (ticks and notes beside points; never a name).

use super::labels::apart;
use super::parts::{Chart, Key, Mark};
use super::text::{ASCENT, DESCENT, LINE, MIDDLE, shortened, width, wrapped};
use crate::page::axis::Axis;
use crate::page::color::{self, GRAY, INK};
use plotters::style::RGBColor;

/// The width of a chart on a phone, in shown pixels.
pub(super) const NARROW: u32 = 340;
/// Between the edge of a chart and any text.
const EDGE: f64 = 3.0;
/// Between two texts in a row.
const GAP: f64 = 6.0;
/// Between the plane and its ticks' texts.
const TICK: f64 = 8.0;
/// The width of a sample in a legend.
pub(super) const SAMPLE: f64 = 18.0;
/// Labels beside the plane take at most this share of a chart that is at least [`WIDE`].
const BESIDE: f64 = 0.34;
const WIDE: f64 = 400.0;

/// A rectangle, in shown pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rect {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Rect {
    fn overlaps(&self, other: &Self, by: f64) -> bool {
        let (across, down) = (self.right.min(other.right) - self.left.max(other.left), self.bottom.min(other.bottom));
        across > by && down - self.top.max(other.top) > by
    }

    fn is_within(&self, other: &Self) -> bool {
        self.left >= other.left && self.right <= other.right && self.top >= other.top && self.bottom <= other.bottom
    }
}

/// The part of a text that is at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A text at its place.
#[derive(Clone, Debug)]
pub(super) struct Text {
    pub(super) text: String,
    /// All of it, if it is shortened.
    pub(super) whole: Option<String>,
    pub(super) x: f64,
    /// Height of the baseline.
    pub(super) y: f64,
    pub(super) anchor: Anchor,
    /// True if it reads from below upwards.
    pub(super) upright: bool,
    pub(super) bold: bool,
    pub(super) color: RGBColor,
}

impl Text {
    fn new(text: impl Into<String>, (x, y): (f64, f64), anchor: Anchor, color: RGBColor) -> Self {
        Self { text: text.into(), whole: None, x, y, anchor, upright: false, bold: false, color }
    }

    /// Rectangle that covers the text.
    pub(super) fn rect(&self) -> Rect {
        let length = width(&self.text, self.bold);
        let before = match self.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5 * length,
            Anchor::End => length,
        };
        let (x, y) = (self.x, self.y);
        if self.upright {
            Rect { left: x - ASCENT, right: x + DESCENT, top: y - length + before, bottom: y + before }
        } else {
            Rect { left: x - before, right: x - before + length, top: y - ASCENT, bottom: y + DESCENT }
        }
    }
}

/// A chart, ready to be drawn.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) width: f64,
    pub(super) height: f64,
    /// The plane.
    pub(super) frame: Rect,
    pub(super) texts: Vec<Text>,
    /// Lines from the ends of a chart's lines to their labels.
    pub(super) leaders: Vec<([(f64, f64); 2], RGBColor)>,
    /// Samples of the legend: where each begins, at its middle height.
    pub(super) samples: Vec<((f64, f64), Key)>,
}

/// The part of a text that fits into `room`.
fn fitted(text: &str, room: f64) -> (String, Option<String>) {
    let short = shortened(text, room, false);
    let whole = (short != text).then(|| text.to_owned());
    (short, whole)
}

/// The width of the widest.
fn widest<'t>(texts: impl IntoIterator<Item = &'t String>) -> f64 {
    texts.into_iter().map(|text| width(text, false)).fold(0.0, f64::max)
}

/// Position of `value` between two places.
fn place(axis: &Axis, value: f64, from: f64, to: f64) -> f64 {
    from + axis.place(value) * (to - from)
}

impl Chart {
    /// The chart at a width; as much wider and higher as an axis of names needs, and as much higher as a legend does.
    pub(super) fn layout(&self, wanted: u32) -> Layout {
        let (mut width_, mut height) = (f64::from(wanted), f64::from(self.height));
        if wanted < self.width {
            height *= (width_ / f64::from(self.width)).max(0.72);
        }
        let ticks = |axis: &Axis, room: f64| -> Vec<(f64, String, Option<String>)> {
            let fitted = |text: &str| fitted(text, room);
            axis.ticks.iter().map(|(value, text)| (fitted(text), *value)).map(|((s, w), v)| (v, s, w)).collect()
        };
        let x_ticks = ticks(&self.x, if self.upright_names { 0.3 * height } else { 0.5 * width_ });
        let y_ticks = ticks(&self.y, 0.3 * width_);

        let title = wrapped(&self.title, width_ - 2.0 * EDGE, true, 2);
        let top = 12.0 + LINE * title.len() as f64;
        let x_name = wrapped(&self.x_name, width_ - 2.0 * EDGE, false, 3);
        // Between the title and the name of the other axis.
        let y_name = wrapped(&self.y_name, height - top - LINE * x_name.len() as f64 - 2.0 * EDGE, false, 2);
        let tick_height =
            if self.upright_names { widest(x_ticks.iter().map(|tick| &tick.1)) } else { ASCENT + DESCENT };
        let left = EDGE + LINE * y_name.len() as f64 + widest(y_ticks.iter().map(|tick| &tick.1)) + TICK + 1.0;
        let mut below = TICK + tick_height + LINE * x_name.len() as f64 + EDGE;

        let beside = widest(self.labels.iter().map(|label| &label.text)) + SAMPLE + GAP;
        let is_beside = width_ >= WIDE
            && beside <= BESIDE * width_
            && self.labels.iter().all(|label| label.end.is_some())
            && self.labels.len() as f64 * LINE <= height - top - below;
        let right = if is_beside && !self.labels.is_empty() { beside } else { 14.0 };
        if self.x.is_names {
            width_ = width_.max(left + right + LINE * x_ticks.len() as f64);
        }
        if self.y.is_names {
            height = height.max(top + below + LINE * y_ticks.len() as f64);
        }
        let (legend, legend_rows) = if is_beside { (Vec::new(), 0) } else { self.legend_places(width_) };
        let legend_top = height;
        if legend_rows > 0 {
            let more = LINE * legend_rows as f64 + 4.0;
            height += more;
            below += more;
        }
        let frame = Rect { left, top, right: width_ - right, bottom: height - below };
        let mut layout =
            Layout { width: width_, height, frame, texts: Vec::new(), leaders: Vec::new(), samples: Vec::new() };
        layout.put_names(title, &x_name, y_name, legend_top);
        layout.put_ticks(self, x_ticks, y_ticks);
        if is_beside {
            layout.put_labels(self);
        }
        for ((x, row, text, whole), label) in legend.into_iter().zip(&self.labels) {
            let y = legend_top + LINE * (row as f64 + 0.5);
            layout.samples.push(((x, y), label.key));
            let place = (x + SAMPLE + 4.0, y + MIDDLE);
            layout.texts.push(Text { whole, ..Text::new(text, place, Anchor::Start, color::text(label.key.color)) });
        }
        layout.put_cells(self);
        layout.put_notes(self);
        layout
    }

    /// Positions of the labels in the legend: left edge, row, and text of each; and the number of rows.
    fn legend_places(&self, chart: f64) -> (Vec<InLegend>, usize) {
        let (mut x, mut row) = (EDGE, 0);
        let mut places = Vec::new();
        for label in &self.labels {
            let (text, whole) = fitted(&label.text, chart - 2.0 * EDGE - SAMPLE - 4.0);
            let needed = SAMPLE + 4.0 + width(&text, false);
            if x > EDGE && x + needed > chart - EDGE {
                (x, row) = (EDGE, row + 1);
            }
            places.push((x, row, text, whole));
            x += needed + 2.0 * GAP;
        }
        let rows = if places.is_empty() { 0 } else { row + 1 };
        (places, rows)
    }
}

impl Layout {
    /// Puts the title and the axes' names.
    fn put_names(&mut self, title: Vec<String>, x_name: &[String], y_name: Vec<String>, legend_top: f64) {
        for (line, text) in (1..).map(f64::from).zip(title) {
            // Above the plane's edge, or further left if it is long.
            let x = self.frame.left.min(self.width - EDGE - width(&text, true)).max(EDGE);
            let place = (x, LINE * line);
            self.texts.push(Text { bold: true, ..Text::new(text, place, Anchor::Start, INK) });
        }
        let middle = 0.5 * (self.frame.left + self.frame.right);
        for (line, text) in (0..).map(f64::from).zip(x_name.iter().rev()) {
            let half = 0.5 * width(text, false) + EDGE;
            let x = middle.min(self.width - half).max(half);
            self.texts.push(Text::new(text, (x, legend_top - EDGE - DESCENT - LINE * line), Anchor::Middle, INK));
        }
        let middle = 0.5 * (self.frame.top + self.frame.bottom);
        let lowest = legend_top - 2.0 * EDGE - LINE * x_name.len() as f64;
        for (line, text) in (0..).map(f64::from).zip(y_name) {
            let half = 0.5 * width(&text, false);
            let place = (EDGE + ASCENT + LINE * line, middle.min(lowest - half).max(self.frame.top + half));
            self.texts.push(Text { upright: true, ..Text::new(text, place, Anchor::Middle, INK) });
        }
    }

    /// Puts the ticks' texts, as far as they leave each other room.
    fn put_ticks(&mut self, chart: &Chart, x: Vec<Tick>, y: Vec<Tick>) {
        let frame = self.frame;
        let mut before = f64::NEG_INFINITY;
        let mut of_x: Vec<(f64, Tick)> =
            x.into_iter().map(|tick| (place(&chart.x, tick.0, frame.left, frame.right), tick)).collect();
        of_x.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (at, (_, text, whole)) in of_x {
            if chart.upright_names {
                let place = (at + MIDDLE, frame.bottom + TICK);
                if at - before >= LINE - 1e-6 {
                    before = at;
                    let text = Text::new(text, place, Anchor::End, GRAY);
                    self.texts.push(Text { upright: true, whole, ..text });
                }
                continue;
            }
            let half = 0.5 * width(&text, false);
            let middle = at.min(self.width - EDGE - half).max(EDGE + half);
            if middle - half >= before {
                before = middle + half + GAP;
                let place = (middle, frame.bottom + TICK + ASCENT);
                self.texts.push(Text { whole, ..Text::new(text, place, Anchor::Middle, GRAY) });
            }
        }
        let mut before = f64::INFINITY;
        let mut of_y: Vec<(f64, Tick)> =
            y.into_iter().map(|tick| (place(&chart.y, tick.0, frame.bottom, frame.top), tick)).collect();
        of_y.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (at, (_, text, whole)) in of_y {
            if before - at >= LINE - 1e-6 {
                before = at;
                let place = (frame.left - TICK, at + MIDDLE);
                self.texts.push(Text { whole, ..Text::new(text, place, Anchor::End, GRAY) });
            }
        }
    }

    /// Puts the names of lines at their right ends.
    fn put_labels(&mut self, chart: &Chart) {
        let frame = self.frame;
        let pixel = |y| place(&chart.y, y, frame.bottom, frame.top);
        let ends = || chart.labels.iter().filter_map(|label| Some((label, label.end?)));
        let wanted: Vec<f64> = ends().map(|(_, (end, _))| pixel(end)).collect();
        // A twentieth of the way to the mean is enough to keep the order of lines that end within a pixel or two.
        let ordered: Vec<f64> = ends().map(|(_, (end, mean))| pixel(end) + pixel(mean) / 20.0).collect();
        let places = apart(&wanted, &ordered, LINE, frame.top, frame.bottom);
        for (((label, _), wanted), place) in ends().zip(wanted).zip(places) {
            let (from, to) = ((frame.right + 3.0, wanted), (frame.right + 15.0, place));
            if (wanted - place).abs() > 2.0 {
                self.leaders.push(([from, to], label.key.color));
            }
            let place = (to.0 + 3.0, place + MIDDLE);
            self.texts.push(Text::new(&label.text, place, Anchor::Start, color::text(label.key.color)));
        }
    }

    fn pixel(&self, chart: &Chart, at: (f64, f64)) -> (f64, f64) {
        let frame = self.frame;
        (place(&chart.x, at.0, frame.left, frame.right), place(&chart.y, at.1, frame.bottom, frame.top))
    }

    /// Puts the texts of cells, if all of them fit.
    fn put_cells(&mut self, chart: &Chart) {
        let cells = || {
            chart
                .marks
                .iter()
                .filter_map(|mark| if let Mark::Cell { at, text } = mark { Some((*at, text)) } else { None })
        };
        let across = (self.frame.right - self.frame.left) / chart.x.ticks.len().max(1) as f64;
        let down = (self.frame.bottom - self.frame.top) / chart.y.ticks.len().max(1) as f64;
        if widest(cells().map(|(_, text)| text)) + 1.0 > across || ASCENT + DESCENT > down {
            return;
        }
        for (at, text) in cells() {
            let (x, y) = self.pixel(chart, at);
            self.texts.push(Text::new(text, (x, y + MIDDLE), Anchor::Middle, INK));
        }
    }

    /// Puts each note where it covers no text and no point, and stays in the plane; leaves it out where there is no such
    /// place beside its point.
    fn put_notes(&mut self, chart: &Chart) {
        let mut points = Vec::new();
        for mark in &chart.marks {
            if let Mark::Dots { points: dots, .. } = mark {
                points.extend(dots.iter().map(|&at| self.pixel(chart, at)));
            }
        }
        let covered = |rect: &Rect| {
            points.iter().any(|&(x, y)| {
                rect.overlaps(&Rect { left: x - 4.0, right: x + 4.0, top: y - 4.0, bottom: y + 4.0 }, 0.0)
            })
        };
        let inside = Rect { left: self.frame.left + 2.0, right: self.width - EDGE, top: 0.0, ..self.frame };
        for mark in &chart.marks {
            let Mark::Note { at, text, color } = mark else { continue };
            let (x, y) = self.pixel(chart, *at);
            let (above, under) = (y - 6.0 - DESCENT, y + 6.0 + ASCENT);
            let tried = [
                (x + 5.0, under, Anchor::Start),
                (x - 5.0, above, Anchor::End),
                (x + 8.0, y + MIDDLE, Anchor::Start),
                (x - 8.0, y + MIDDLE, Anchor::End),
                (x, above, Anchor::Middle),
                (x, under, Anchor::Middle),
                (x + 5.0, above, Anchor::Start),
                (x - 5.0, under, Anchor::End),
            ];
            let texts = tried.map(|(x, y, anchor)| Text::new(text, (x, y), anchor, color::text(*color)));
            let fits = |text: &Text| {
                let rect = text.rect();
                rect.is_within(&inside)
                    && !covered(&rect)
                    && !self.texts.iter().any(|other| rect.overlaps(&other.rect(), -2.0))
            };
            if let Some(text) = texts.into_iter().find(fits) {
                self.texts.push(text);
            }
        }
    }

    /// Texts that overlap or are cut off by the edge: there must be none.
    #[cfg(test)]
    fn faults(&self) -> Vec<String> {
        let whole = Rect { left: 0.0, top: 0.0, right: self.width, bottom: self.height };
        let mut faults = Vec::new();
        for (index, text) in self.texts.iter().enumerate() {
            if !text.rect().is_within(&whole) {
                faults.push(format!("\"{}\" is cut off: {:?} of {whole:?}", text.text, text.rect()));
            }
            for other in &self.texts[..index] {
                if text.rect().overlaps(&other.rect(), 0.01) {
                    faults.push(format!("\"{}\" covers \"{}\"", text.text, other.text));
                }
            }
        }
        faults
    }
}

/// A name in a legend: its left edge, its row, what is shown of it, and all of it if that is less.
type InLegend = (f64, usize, String, Option<String>);

/// A tick: its value, what is shown of its text, and all of the text if that is less.
type Tick = (f64, String, Option<String>);

#[cfg(test)]
mod tests {
    use super::super::parts::{Shape, Stroke};
    use super::*;
    use crate::page::color::{BLUE, GREEN, series};

    fn check(chart: &Chart) {
        for width in [chart.width, NARROW] {
            let layout = chart.layout(width);
            assert!(layout.faults().is_empty(), "{width}: {:#?}", layout.faults());
            let frame = layout.frame;
            assert!(frame.right - frame.left > 80.0 && frame.bottom - frame.top > 60.0, "{width}: {frame:?}");
        }
    }

    fn texts(chart: &Chart, width: u32) -> Vec<String> {
        chart.layout(width).texts.into_iter().map(|text| text.text).collect()
    }

    #[test]
    fn notes_beside_points_that_lie_close_together_do_not_cover_each_other() {
        // As in a figure of models by cost: most of them within a few pixels.
        let mut chart = Chart::new("bytes", Axis::logarithmic(1e3, 1e6), "accuracy", Axis::percent(0.5, 1.0));
        for k in 0..30 {
            let at = (2e3 * 1.2_f64.powi(k), 0.94 - 0.3 / f64::from(k + 1));
            chart.marks.push(Mark::Dots { points: vec![at], color: BLUE, shape: Shape::Disc });
            chart.marks.push(Mark::Note { at, text: format!("{k} trees, complete"), color: BLUE });
        }
        check(&chart);
        let shown = texts(&chart, 560).iter().filter(|text| text.contains("trees")).count();
        assert!((5..30).contains(&shown), "{shown}");
    }

    #[test]
    fn lines_that_end_together_and_long_names_are_legible_and_none_is_left_out() {
        let names = ["paper's method", "flat plate with a long name", "ours, trained for noise", "x"];
        for (count, size) in [(3, (660, 400)), (40, (620, 400)), (3, (270, 200))] {
            let mut chart =
                Chart::new("touches", Axis::logarithmic(10.0, 120.0), "accuracy after 10 touches", Axis::share());
            chart = chart.sized(size.0, size.1).titled("A title that is rather long, as an object's name may be.obj");
            for index in 0..count {
                let points: Vec<(f64, f64)> = (10..120).map(|n| (f64::from(n), 0.999)).collect();
                chart.line(&format!("{} {index}", names[index % 4]), series(index), Stroke::Solid, &points);
            }
            check(&chart);
            for width in [size.0, NARROW] {
                let shown = texts(&chart, width);
                for index in 0..count {
                    assert!(shown.contains(&format!("{} {index}", names[index % 4])), "{index} of {count} at {width}");
                }
            }
        }
    }

    #[test]
    fn an_axis_of_many_names_grows_and_short_cells_hold_their_numbers() {
        for count in [2, 6, 12, 60] {
            let names: Vec<String> = (0..count).map(|k| format!("an object with a long name {k}")).collect();
            let axis = || Axis::names(names.iter().map(String::as_str));
            let mut chart = Chart::new("recognized as", axis(), "touched", axis().reversed()).sized(560, 540);
            chart.upright_names = true;
            for row in 0..count {
                chart.marks.push(Mark::Cell { at: (f64::from(row) + 0.5, f64::from(row) + 0.5), text: "100".into() });
            }
            check(&chart);
            let layout = chart.layout(560);
            assert_eq!(layout.texts.iter().filter(|text| text.whole.is_some()).count(), 2 * count as usize);
            assert_eq!(
                layout.texts.iter().filter(|text| text.text == "100").count(),
                if count < 60 { count } else { 0 } as usize
            );
        }
    }

    #[test]
    fn names_of_axes_do_not_cover_numbers() {
        for unit in ["instructions per touch, Cortex-M4F (measured under emulation)", "s"] {
            for (low, high) in [(1e-9, 1e-3), (12_345.0, 9_876_543.0), (0.98, 1.02)] {
                let axis = || Axis::logarithmic(low, high);
                check(&Chart::new(unit, axis(), unit, axis()).sized(280, 190).titled(unit));
                check(&Chart::new(unit, axis(), unit, Axis::linear(low, high, 12)).sized(660, 400));
            }
        }
    }

    #[test]
    fn a_legend_names_every_series_below_the_chart() {
        let mut chart =
            Chart::new("casts per second", Axis::logarithmic(1e3, 1e6), "error", Axis::logarithmic(1e-18, 1.0));
        for name in ["f32 after the f32 reject", "f64 after the f32 reject (used)", "f64 for every triangle, no tree"] {
            chart.legend(name, GREEN, None, Some(Shape::Square));
        }
        check(&chart);
        let layout = chart.layout(NARROW);
        assert_eq!((layout.samples.len(), layout.height > chart.layout(560).height * 0.72), (3, true));
        assert!(texts(&chart, NARROW).contains(&"f64 after the f32 reject (used)".to_owned()));
    }
}
