//! The page of verdicts on sequences of rows: rows to a verdict against the error rate, confusion, and how evidence grows.

use crate::page::axis::{Axis, number};
use crate::page::chart::{Chart, Mark, Shape};
use crate::page::color;
use crate::page::document::{Figure, Page, Section};
use palpate::error::Result;
use palpate::evaluate::Finding;
use palpate::results::{Results, Value};
use palpate::row;
use palpate::stream::{Evaluated, Grown, Point};
use palpate::wording::{compared, count, percent, rate};

/// The most classes whose posteriors are drawn.
const MOST_CLASSES: usize = 8;

/// The page. `command` is what remakes it.
///
/// # Errors
/// If a chart cannot be drawn.
pub fn page(evaluated: &Evaluated, command: &str) -> Result<Page> {
    let mut rows = Section::new("rows", "Rows to a verdict");
    rows.text(promise(evaluated)).figure(curves(evaluated)?).text(fewer(evaluated));
    let mut confusion = Section::new("confusion", "Confusion");
    confusion.figure(matrix(evaluated));
    let mut sections = vec![rows, confusion];
    if let Some(grown) = &evaluated.grown {
        let mut one = Section::new("one", "One sequence");
        one.figure(posteriors(evaluated, grown)?);
        sections.push(one);
    }
    let groups = evaluated.groups.map_or_else(String::new, |groups| format!(" of {groups} groups"));
    Ok(Page {
        title: "Verdicts on streams of rows".into(),
        summary: format!(
            "{} sequences{groups}: {} of the names given are wrong, after {} rows on average.",
            count(evaluated.sequences),
            percent(evaluated.error, 2),
            number(evaluated.mean_rows, 1),
        ),
        command: command.into(),
        sections,
        facts: vec![("Command".into(), command.into()), ("palpate".into(), env!("CARGO_PKG_VERSION").into())],
        files: false,
    })
}

fn promise(evaluated: &Evaluated) -> String {
    let ends = format!(
        "Of all sequences {} end with a wrong name, {} without a verdict, and {} as unknown.",
        percent(evaluated.wrong, 2),
        percent(evaluated.undecided, 2),
        percent(evaluated.unknown, 2)
    );
    let Some(promise) = &evaluated.promise else {
        return format!("{ends} The model was not calibrated for these thresholds, and promises nothing.");
    };
    let of = promise.of.as_ref().map_or_else(String::new, |of| format!(" ({of})"));
    let kept = match promise.finding {
        Finding::Broken => "That breaks the promise, by more than chance explains.",
        Finding::Unclear => "That is above it, but no more than chance explains.",
        Finding::Kept => "The promise is kept.",
        Finding::Untested => "No name was given.",
    };
    format!(
        "The model promises at most {} of wrong names; found here: {}{of}. {kept} {ends}",
        rate(promise.promised),
        percent(promise.found, 2)
    )
}

fn fewer(evaluated: &Evaluated) -> String {
    format!(
        "{} {}",
        instead("A fixed number of rows", evaluated.mean_rows, evaluated.comparison.fixed_rows),
        instead("A majority vote of rows", evaluated.mean_rows, evaluated.comparison.vote_rows)
    )
}

/// The rows that another way needs for the same error rate, and what stopping early saves.
fn instead(way: &str, mean: f64, rows: Option<f64>) -> String {
    let Some(rows) = rows else {
        return format!("{way} does not reach the same error rate, not even with all rows of these sequences.");
    };
    format!("{way} needs {} for the same error rate; stopping early needs {}.", number(rows, 1), compared(mean, rows))
}

/// An error rate of nothing has no place on a logarithmic axis: half an error.
fn shown(evaluated: &Evaluated, error: f64) -> f64 {
    error.max(0.5 / evaluated.sequences.max(1) as f64)
}

fn curves(evaluated: &Evaluated) -> Result<Figure> {
    let comparison = &evaluated.comparison;
    let early: Vec<Point> = comparison.early.iter().copied().filter(|point| point.named > 0.0).collect();
    let all = [("early stopping", &early), ("fixed number", &comparison.fixed), ("majority vote", &comparison.vote)];
    let mut data = Results::new(["method", "rows", "error", "named"]);
    let points = || all.iter().flat_map(|(_, points)| points.iter());
    let most = points().map(|point| point.rows).fold(1.0, f64::max);
    let worst = points().map(|point| point.error).fold(0.1, f64::max).min(1.0);
    let least = shown(evaluated, 0.0);
    let mut chart = Chart::new(
        "rows, on average",
        Axis::logarithmic(0.9, 1.1 * most.max(2.0)),
        "wrong names",
        Axis::logarithmic(0.8 * least, (1.3 * worst).min(1.0)),
    )
    .sized(760, 440);
    for (index, (name, points)) in all.iter().enumerate() {
        let line: Vec<(f64, f64)> = points.iter().map(|point| (point.rows, shown(evaluated, point.error))).collect();
        chart.series(name, color::series(index), Shape::Disc, &line);
        for point in points.iter() {
            let (error, named) = (Value::Percent(point.error, 2), Value::Percent(point.named, 1));
            data.push(row![*name, Value::Number(point.rows, 2), error, named]);
        }
    }
    // Last, over the lines, and named where it is.
    let own = (evaluated.mean_rows, shown(evaluated, evaluated.error));
    chart.marks.push(Mark::Dots { points: vec![own], color: color::INK, shape: Shape::Square });
    chart.marks.push(Mark::Note { at: own, text: "this model".into(), color: color::INK });
    let caption = "Early stopping at thresholds from strict to loose, the same for all names; the class with the most evidence after a \
                   fixed number of rows, and the class that most of as many rows are recognized as, each row taken alone. A sequence \
                   with fewer rows uses all that it has. Zero errors are drawn as half an error (the axis is logarithmic). The square \
                   is this model, with its own thresholds.";
    Ok(Figure::new("rows-to-a-verdict", "Wrong names against rows", caption, data).drawn(vec![chart.svg()?]))
}

fn matrix(evaluated: &Evaluated) -> Figure {
    let head = std::iter::once("class".to_owned()).chain(evaluated.names.iter().cloned()).chain(["no name".to_owned()]);
    let mut data = Results::new(head);
    for (name, counts) in evaluated.names.iter().zip(&evaluated.confusion) {
        data.push(row![name].into_iter().chain(counts.iter().map(|&count| count.into())));
    }
    let title = "Sequences of each class, by the name that they were given";
    Figure::new("confusion", title, "Row by row the class, column by column the name.", data)
}

fn posteriors(evaluated: &Evaluated, grown: &Grown) -> Result<Figure> {
    let rows = grown.posteriors.len().max(2);
    let mut chart = Chart::new("rows", Axis::linear(1.0, rows as f64, 8), "posterior", Axis::share()).sized(760, 380);
    let mut data = Results::new(["rows", "class", "posterior"]);
    // The classes that matter most, in the model's order.
    let mut order: Vec<usize> = (0..evaluated.names.len()).collect();
    let most = |class: usize| grown.posteriors.iter().map(|row| row[class]).fold(0.0, f64::max);
    order.sort_by(|&a, &b| most(b).total_cmp(&most(a)));
    order.truncate(MOST_CLASSES);
    for (index, &class) in order.iter().enumerate() {
        let name = &evaluated.names[class];
        let line: Vec<(f64, f64)> =
            (1_u32..).map(f64::from).zip(grown.posteriors.iter().map(|row| row[class])).collect();
        chart.series(name, color::series(index), Shape::Disc, &line);
        for (row, posterior) in &line {
            data.push(row![Value::Number(*row, 0), name, Value::Percent(*posterior, 2)]);
        }
    }
    let name = |class: usize| evaluated.names.get(class).map_or("", String::as_str);
    let ended = match grown.ended {
        Some((row, Some(class))) => format!("After row {row} it is recognized as {}.", name(class)),
        Some((row, None)) => format!("After row {row} it is called unknown."),
        None => "It ends without a verdict.".into(),
    };
    let longer = grown
        .longer
        .map_or_else(String::new, |share| format!(" Of the sequences with a name, {} take longer.", percent(share, 0)));
    let title = format!("The evidence of one sequence of {} as it grows", name(grown.class));
    let caption = format!("{ended} Later rows are shown as if there had been no verdict.{longer}");
    Ok(Figure::new("one-sequence", title, caption, data).drawn(vec![chart.svg()?]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_way_needs_more_or_fewer_rows_as_was_measured() {
        assert_eq!(
            instead("A fixed number of rows", 3.54, Some(6.0)),
            "A fixed number of rows needs 6.0 for the same error rate; stopping early needs 41 % fewer."
        );
        assert!(instead("A vote", 6.6, Some(6.0)).ends_with("stopping early needs 10 % more."));
        assert!(instead("A vote", 6.0, Some(6.0)).ends_with("stopping early needs as many."));
        assert!(instead("A vote", 6.0, None).contains("does not reach"));
    }
}
