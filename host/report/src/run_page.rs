//! The page of a run: the short form of the report.

use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Shape, Stroke};
use crate::page::color;
use crate::page::document::{Block, Figure, Page, Picture, Section};
use palpate::error::Result;
use palpate::results::{Results, Value};
use palpate::row;
use palpate::wording::count;

/// Results of a run, as its page shows them.
#[derive(Clone, Debug)]
pub struct RunResults {
    /// The command that remakes it.
    pub command: String,
    /// The file of the page on which the objects can be touched.
    pub play: String,
    /// One picture per object, with a line about its capture. May be empty.
    pub pictures: Vec<Picture>,
    /// The methods compared, the paper's first.
    pub methods: Vec<RunMethod>,
    /// The table that the run prints: what was measured in the first column, then one column per method.
    pub table: Results,
    /// Notes about the table, in sentences; may be empty.
    pub note: String,
    /// Settings, times and version, as name and value.
    pub facts: Vec<(String, String)>,
}

/// One method's accuracies.
#[derive(Clone, Debug)]
pub struct RunMethod {
    /// Its name, in one to three words.
    pub name: String,
    /// `(touches, accuracy, standard error)`, by rising number of touches, each a share of one.
    pub curve: Vec<(usize, f64, f64)>,
    /// Bytes of its compiled model.
    pub bytes: usize,
    /// For each object its `(touches, accuracy)`.
    pub per_object: Vec<(String, Vec<(usize, f64)>)>,
}

/// The page of a run.
///
/// # Errors
/// If a chart cannot be drawn.
pub fn run_page(results: &RunResults) -> Result<Page> {
    let mut sections = Vec::new();
    let mut section = Section::new("objects", "The objects");
    section.blocks.push(Block::Link(results.play.clone(), "Touch them yourself".into()));
    section.blocks.push(Block::Pictures(results.pictures.clone()));
    sections.push(section);
    let mut section = Section::new("result", "The result");
    let caption = format!(
        "The first two wait for full touches and were trained on the same; the last takes every approach with at least one contact as \
         evidence. All are tested on the same approaches, which none was trained on. {}",
        results.note
    );
    section.figure(Figure::new("summary", "The paper's method and ours", caption, results.table.clone()));
    sections.push(section);
    let mut section = Section::new("accuracy", "Accuracy, touch by touch");
    section.figure(curves(results)?);
    section.figure(objects(results)?);
    sections.push(section);
    Ok(Page {
        title: "Recognizing objects by touch".into(),
        summary: format!(
            "A probe with three fingers touched each object; trees learned the evidence that a touch gives for each object; \
             {} added it up, touch by touch.",
            models("a compiled model", "compiled models", results.methods.iter().map(|method| method.bytes))
        ),
        command: results.command.clone(),
        sections,
        facts: results.facts.clone(),
        files: false,
    })
}

/// Models, and how many bytes they have.
pub(super) fn models(one: &str, several: &str, bytes: impl Iterator<Item = usize> + Clone) -> String {
    let (least, most) = (bytes.clone().min().unwrap_or(0), bytes.clone().max().unwrap_or(0));
    match bytes.count() {
        0 | 1 => format!("{one} of {} bytes", count(most)),
        _ => format!("{several} of {} to {} bytes", count(least), count(most)),
    }
}

/// The `index`-th method's color and point shape: the paper's first, ours second.
pub(super) fn method_style(index: usize) -> (plotters::style::RGBColor, Shape) {
    const SHAPES: [Shape; 4] = [Shape::Ring, Shape::Disc, Shape::Triangle, Shape::Square];
    let color = match index {
        0 => color::PAPER,
        1 => color::OURS,
        _ => color::series(index),
    };
    (color, SHAPES[index % SHAPES.len()])
}

/// An axis of touches that holds all curves.
fn touches_scale(results: &RunResults) -> Axis {
    let touches = || results.methods.iter().flat_map(|method| method.curve.iter().map(|point| point.0 as f64));
    Axis::logarithmic(touches().fold(f64::INFINITY, f64::min).clamp(1.0, 1e9), touches().fold(2.0, f64::max))
}

fn curves(results: &RunResults) -> Result<Figure> {
    let mut chart = Chart::new("touches", touches_scale(results), "accuracy", Axis::share()).sized(600, 380);
    let mut data = Results::new(["method", "touches", "accuracy", "standard error"]);
    for (index, method) in results.methods.iter().enumerate() {
        let (color, shape) = method_style(index);
        let bars = method.curve.iter().map(|&(n, a, e)| (n as f64, (a - 1.96 * e).max(0.0), (a + 1.96 * e).min(1.0)));
        chart.marks.push(Mark::Spread { points: bars.collect(), color });
        let points: Vec<(f64, f64)> = method.curve.iter().map(|&(n, a, _)| (n as f64, a)).collect();
        chart.series(&method.name, color, shape, &points);
        for &(n, accuracy, error) in &method.curve {
            data.push(row![&method.name, n, Value::Percent(accuracy, 1), Value::Percent(error, 2)]);
        }
    }
    let caption = "Each group holds touches of one object, drawn at random from touches that training never saw; all objects are weighted \
                   equally. Bars are 95 % confidence intervals.";
    let title = "Share of groups recognized after a fixed number of touches";
    Ok(Figure::new("accuracy-curves", title, caption, data).drawn(vec![chart.svg()?]))
}

fn objects(results: &RunResults) -> Result<Figure> {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in results.methods.iter().flat_map(|method| &method.per_object) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let mut data = Results::new(["object", "method", "touches", "accuracy"]);
    let mut panels = Vec::new();
    for name in names {
        let mut chart = Chart::new("touches", touches_scale(results), "", Axis::share()).sized(270, 200).titled(name);
        for (index, method) in results.methods.iter().enumerate() {
            let (color, _) = method_style(index);
            let curve = method.per_object.iter().find(|(object, _)| object == name).map(|found| &found.1);
            let points: Vec<(f64, f64)> = curve.into_iter().flatten().map(|&(n, a)| (n as f64, a)).collect();
            let stroke = if index == 0 { Stroke::Dashed } else { Stroke::Solid };
            chart.line(&method.name, color, stroke, &points);
            for &(n, accuracy) in curve.into_iter().flatten() {
                data.push(row![name, &method.name, n, Value::Percent(accuracy, 1)]);
            }
        }
        panels.push(chart.svg()?);
    }
    let caption = "Percentages are of groups of touches of that object alone.";
    Ok(Figure::new("accuracy-objects", "The same for each object", caption, data).drawn(panels))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results() -> RunResults {
        let method = |name: &str, accuracy: f64| RunMethod {
            name: name.into(),
            curve: vec![(5, accuracy, 0.01), (30, 1.0, 0.0)],
            bytes: if name == "paper" { 259_556 } else { 44_284 },
            per_object: vec![
                ("fork".into(), vec![(5, accuracy), (30, 1.0)]),
                ("bowl".into(), vec![(5, 0.5), (30, 1.0)]),
            ],
        };
        let mut table = Results::new(["", "paper", "ours"]);
        table.push(row!["accuracy at 10", Value::Percent(0.65, 1), Value::Percent(0.75, 1)]);
        RunResults {
            command: "palpate run builtin --seed 1".into(),
            play: "play.html".into(),
            pictures: vec![Picture { name: "fork".into(), png: vec![1, 2, 3], line: "5.6 % of approaches".into() }],
            methods: vec![method("paper", 0.5), method("ours", 0.57)],
            table,
            note: String::new(),
            facts: vec![("seed".into(), "1".into())],
        }
    }

    #[test]
    fn the_short_page_shows_objects_table_and_curves_of_both_methods_and_writes_csv_and_svg_beside_it() {
        let mut page = run_page(&results()).unwrap();
        let html = page.html();
        assert_eq!(page.figures().count(), 3);
        // One of them is drawn for a phone as well.
        assert_eq!(html.matches("<svg ").count(), 4);
        for part in [
            "data:image/png;base64,AQID",
            "65.0\u{a0}%",
            "75.0\u{a0}%",
            "palpate run builtin --seed 1",
            "href=\"play.html\"",
            "5.6 % of approaches",
            "compiled models of 44,284 to 259,556 bytes added it up",
        ] {
            assert!(html.contains(part), "{part}");
        }
        let directory = tempfile::tempdir().unwrap();
        page.files = true;
        let written = page.write(&directory.path().join("index.html")).unwrap();
        let mut names: Vec<_> = written.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
        names.sort_unstable();
        let expected = ["accuracy-curves.csv", "accuracy-curves.svg", "accuracy-objects.csv", "accuracy-objects.svg"];
        assert_eq!(names[..4], expected);
        assert_eq!(names[4..], ["index.html", "summary.csv"]);
        let csv = std::fs::read_to_string(directory.path().join("accuracy-curves.csv")).unwrap();
        assert!(csv.starts_with("method,touches,accuracy,standard error\npaper,5,0.5,0.01\n"), "{csv}");
    }
}
