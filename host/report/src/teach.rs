//! The page of objects that were learned from recorded touches: their accuracy, and the benefit of more approaches.

use crate::page::axis::Axis;
use crate::page::chart::{Chart, Shape};
use crate::page::color;
use crate::page::document::{Figure, Page, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::error::Result;
use palpate::teach::{self, LEAST, Needed, Taught, TaughtObject};
use palpate::wording::{count, percent, rate};

/// The page. `command` is what remakes it.
///
/// # Errors
/// If a chart cannot be drawn.
pub fn page(taught: &Taught, command: &str) -> Result<Page> {
    let mut result = Section::new("result", "Accuracy for taught objects");
    result.text(
        "Recorded touches were held out in parts: no part, nor a copy of one of its touches, was learned from while it \
         was held out. A constant is added to an object's margin with every touch, so that misses and false \
         recognitions are equally frequent.",
    );
    result.table(objects(taught, command)).text(promise(taught));
    let mut more = Section::new("more", "Benefit of more approaches");
    more.figure(curve(taught, command)?);
    taught.objects.iter().for_each(|object| {
        more.text(more_approaches(object));
    });
    let names: Vec<&str> = taught.objects.iter().map(|object| object.name.as_str()).collect();
    Ok(Page {
        title: "Learned from recorded touches".into(),
        summary: format!("{}: figures after {} approaches.", names.join(", "), taught.approaches),
        sections: vec![result, more],
        facts: vec![("Command".into(), command.into()), ("palpate".into(), env!("CARGO_PKG_VERSION").into())],
        files: false,
    })
}

fn objects(taught: &Taught, command: &str) -> Table {
    let mut data = Records::new([
        "object",
        "approaches",
        "evidence",
        "jitter",
        "prior (touches)",
        "constant (nats)",
        "recognized",
        "others taken for it",
    ]);
    for object in &taught.objects {
        data.push([
            object.name.as_str().into(),
            Cell::count(object.approaches),
            Cell::count(object.touches),
            Cell::Number(object.smoothing.jitter, 1),
            Cell::Number(object.smoothing.prior, 0),
            Cell::Number(object.constant, 3),
            Cell::Percent(object.recognized, 1),
            Cell::Percent(object.taken_for_it, 1),
        ]);
    }
    let others = taught
        .others
        .map_or_else(String::new, |others| format!(" Of the other objects {} are recognized.", percent(others, 1)));
    Table {
        id: "taught".into(),
        title: "Objects and how they were smoothed".into(),
        caption: format!(
            "Shares of groups of {} approaches; false recognitions of an object are summed over all other objects. \
             Jitter is in multiples of {}.{others}",
            taught.approaches,
            teach::jitter(1.0)
        ),
        command: command.into(),
        data,
    }
}

fn curve(taught: &Taught, command: &str) -> Result<Figure> {
    let mut data = Records::new(["object", "approaches", "recognized", "error"]);
    let points = || taught.objects.iter().flat_map(|object| &object.curve.points);
    for object in &taught.objects {
        for point in &object.curve.points {
            data.push([
                object.name.as_str().into(),
                Cell::count(point.approaches),
                Cell::Percent(point.recognized, 1),
                Cell::Percent(point.error, 1),
            ]);
        }
    }
    let counts = || points().map(|point| point.approaches.max(1) as f64);
    let worst = points().map(|point| point.error).fold(0.05, f64::max);
    let mut chart = Chart::new(
        "approaches learned from",
        Axis::logarithmic(counts().fold(f64::INFINITY, f64::min), 2.2 * counts().fold(1.0, f64::max)),
        "error",
        Axis::percent(0.0, 1.1 * worst),
    )
    .sized(760, 420);
    for (index, object) in taught.objects.iter().enumerate() {
        let measured = object.curve.points.iter().map(|point| (point.approaches.max(1) as f64, point.error));
        let expected = (2.0 * object.approaches as f64, object.curve.with_twice);
        let line: Vec<(f64, f64)> = measured.chain([expected]).collect();
        chart.series(&object.name, color::series(index), Shape::Disc, &line);
    }
    Ok(Figure {
        id: "learning-curve".into(),
        title: "Errors against approaches".into(),
        caption: format!(
            "The mean of the share of groups of {} approaches that are missed, and of those of other objects that are \
             taken for the object, on touches that were held out. The last point of each line is not measured: it \
             extrapolates the errors to twice as many approaches by a power law.",
            taught.approaches
        ),
        command: command.into(),
        panels: vec![chart.svg()?],
        data,
    })
}

/// Says in a sentence if more approaches to an object would help.
pub fn more_approaches(object: &TaughtObject) -> String {
    let Some(last) = object.curve.points.last() else { return String::new() };
    let (now, then) = (last.error, object.curve.with_twice);
    if now - then < 0.005 {
        return format!("Recording more approaches to {} would hardly help.", object.name);
    }
    format!(
        "With {} approaches to {} the error would be about {} instead of {}.",
        count(2 * object.approaches),
        object.name,
        percent(then, 1),
        percent(now, 1)
    )
}

/// Says in two sentences if enough was recorded for a promise.
pub fn promise(taught: &Taught) -> String {
    let Needed { sequences, of_each, approaches } = taught.promise;
    let recorded = taught.objects.iter().map(|object| object.approaches).min().unwrap_or(0);
    let what = format!(
        "To promise {} wrong names takes {sequences} sequences that end with a name, none of them a wrong one, {of_each} of \
         each object: about {} approaches that the object was not taught with, or more",
        rate(teach::RATE),
        count(approaches)
    );
    if recorded < approaches + LEAST {
        format!("No promise can be made yet. {what}, and {} were recorded in all.", count(recorded))
    } else {
        format!("{what}. Teach with the others only, and keep these for palpate calibrate.")
    }
}
