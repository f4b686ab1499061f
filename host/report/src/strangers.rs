//! Objects that a model does not know: each is left out of the training in turn.

use super::context::Context;
use crate::page::axis::{Axis, number};
use crate::page::chart::{Chart, Shape};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::capture;
use palpate::ensemble::train;
use palpate::error::{Error, EvaluateProblem, Result};
use palpate::evaluate::{DETECTED_BY, Outcome};
use palpate::mesh::builtin;
use palpate::strangers::{LeftOut, Sets, Settings, captured, leave_one_out};
use palpate::touches::{Dataset, ObjectTouches, Origin};
use palpate::wording::{self, percent};
use palpate_shared::format::Held;
use serde::{Deserialize, Serialize};

/// Touches of each object to train, calibrate and test on; and the same for a quick report.
const TOUCHES: [usize; 3] = [21_000, 40_000, 10_000];
const QUICK: [usize; 3] = [5_000, 8_000, 3_000];
/// Touches for each shape of the background, on average.
const PER_SHAPE: usize = 300;
/// Touches up to which detection is shown.
const MOST: usize = 120;

/// Ways in which a model can meet strangers, in the order of [`Column::ways`].
const WAYS: [(&str, Option<Held>); 3] =
    [("off", None), ("likely", Some(Held::Likely)), ("certain", Some(Held::Certain))];

/// Measurements: without and with a background column; or why nothing was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Measured {
    Columns([Column; 2]),
    Not(String),
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Column {
    ways: Vec<Way>,
}

/// Results of one way to meet strangers: means over the objects that were left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Way {
    /// The share detected by 1, 2, 3 … touches.
    detected: Vec<f64>,
    wrong_name: f64,
    false_alarms: f64,
    /// Of known objects.
    touches: f64,
    wrong: f64,
    undecided: f64,
    /// For each object left out: its name, the share detected by each of [`DETECTED_BY`], and the share named.
    objects: Vec<(String, Vec<f64>, f64)>,
}

/// Leaves each object out, without and with a background.
pub(super) fn measure(context: &Context) -> Result<Measured> {
    let settings = context.settings;
    if context.objects.len() < 3 {
        let objects = context.objects.len();
        return Ok(Measured::Not(format!(
            "it takes at least three objects, of which one is left out, and there are {objects}"
        )));
    }
    let counts = if settings.quick { QUICK } else { TOUCHES };
    let touched = |index: usize| -> Result<Dataset> {
        // Other touches than those of the other stages.
        let touched = context.touch(counts[index].min(40 * settings.touches), settings.seed + 100 + index as u64)?;
        Ok(Dataset::new(touched.into_iter().map(|(object, _)| object).collect()))
    };
    let [train, calibrate, test] = [touched(0)?, touched(1)?, touched(2)?];
    let sets = Sets { train: &train, calibrate: &calibrate, test: &test };
    let origin = Origin { seed: settings.seed, ..settings.capture.clone() };
    let background = background(context, &origin)?;
    let shapes = [captured(settings.other_shapes, &origin, context.progress)?];
    let column = |background| column(context, sets, background, &shapes);
    // The second is not measured in vain.
    match column(None).and_then(|without| Ok([without, column(Some(&background))?])) {
        Ok(columns) => Ok(Measured::Columns(columns)),
        Err(error) if is_too_few(&error) => Ok(Measured::Not(format!(
            "the misfit test could not be calibrated so that at most {} of known objects are taken for unknown, from {} \
             touches of each object: {}",
            alarms(),
            wording::count(counts[1]),
            error.problem::<EvaluateProblem>().map(ToString::to_string).unwrap_or_default()
        ))),
        Err(error) => Err(error),
    }
}

/// The share of known objects that may be taken for unknown.
fn alarms() -> String {
    wording::rate(Settings::default().alarms)
}

/// The settings of each training.
fn training() -> train::Settings {
    train::Settings { rounds: 40, depth: 5, ..train::Settings::compact() }
}

fn is_too_few(error: &Error) -> bool {
    use EvaluateProblem::{TooFewForAlarms, TooFewForMisfit};
    matches!(error.problem::<EvaluateProblem>(), Some(TooFewForAlarms { .. } | TooFewForMisfit { .. }))
}

/// Touches of the shapes that a background column is trained on.
fn background(context: &Context, origin: &Origin) -> Result<Dataset> {
    let shapes = context.settings.background_shapes;
    let touches = shapes * PER_SHAPE;
    let object = builtin::background(shapes, origin.seed)?;
    let scenes = capture::scenes(&[&object], origin, context.progress)?;
    let objects = scenes.iter().map(|scenes| capture::touches(scenes, &object.name, origin, 0..touches as u64));
    Ok(Dataset::new(objects.collect::<Result<_>>()?))
}

fn column(context: &Context, sets: Sets<'_>, background: Option<&Dataset>, shapes: &[ObjectTouches]) -> Result<Column> {
    let training = training();
    let held = WAYS.map(|(_, held)| held);
    let settings = Settings { seed: context.settings.seed, ..Settings::default() };
    let found = leave_one_out(sets, background, shapes, &training, &settings, &held, context.progress)?;
    Ok(Column { ways: found.iter().map(|found| way(found)).collect() })
}

fn way(found: &[LeftOut]) -> Way {
    let mean = |of: &dyn Fn(&LeftOut) -> f64| found.iter().map(of).sum::<f64>() / found.len().max(1) as f64;
    let by = |outcomes: &[Outcome], at: usize| {
        let detected = outcomes.iter().filter(|outcome| outcome.unknown && outcome.touches <= at).count();
        detected as f64 / outcomes.len().max(1) as f64
    };
    Way {
        detected: (1..=MOST).map(|at| mean(&|one| by(&one.outcomes, at))).collect(),
        wrong_name: mean(&|one| one.strangers.wrong_name),
        false_alarms: mean(&|one| one.strangers.false_alarms),
        touches: mean(&|one| one.known.mean_touches),
        wrong: mean(&|one| one.known.error),
        undecided: mean(&|one| one.known.undecided),
        objects: found
            .iter()
            .map(|one| {
                (one.object.clone(), one.strangers.detected.values().copied().collect(), one.strangers.wrong_name)
            })
            .collect(),
    }
}

/// The figure and the tables.
pub(super) fn section(context: &Context, measured: &Measured) -> Result<Section> {
    let mut section = Section::new("strangers", "Objects that the model does not know");
    let columns = match measured {
        Measured::Columns(columns) => columns,
        Measured::Not(why) => {
            section.text(format!("Not measured: {why}."));
            return Ok(section);
        }
    };
    let [_, with] = columns;
    let at = |way: &Way, touches: usize| percent(way.detected.get(touches - 1).copied().unwrap_or(f64::NAN), 0);
    let [_, middle, last] = DETECTED_BY;
    let [likely, certain] = [&with.ways[1], &with.ways[2]];
    section.text(format!(
        "Each object is left out of the training in turn, and then touched; a misfit test may declare it unknown. The \
         test is calibrated to a false alarm rate of at most {}: the share of known objects taken for unknown. With \
         names held back until a stranger would have been detected (certain), {} of strangers are detected by {middle} \
         touches and {} by {last}, and {} get a name; a known object takes {} touches. Without holding back (likely), {} get \
         a name, and a known object takes {} touches.",
        alarms(),
        at(certain, middle),
        at(certain, last),
        percent(certain.wrong_name, 0),
        number(certain.touches, 0),
        percent(likely.wrong_name, 0),
        number(likely.touches, 0),
    ));
    section.figure(figure(context, columns)?);
    section.table(ways_table(context, columns));
    section.table(objects_table(context, with));
    Ok(section)
}

const COLUMNS: [&str; 2] = ["fit", "fit and background"];

fn figure(context: &Context, columns: &[Column; 2]) -> Result<Figure> {
    let mut chart = Chart::new("touches", Axis::linear(0.0, MOST as f64, 6), "detected", Axis::share()).sized(660, 420);
    let mut data = Records::new(["test", "names", "touches", "detected"]);
    let styles = [
        [("fit, likely", color::PAPER, Shape::Ring), ("fit, certain", color::PURPLE, Shape::Triangle)],
        [("background, likely", color::GREEN, Shape::Square), ("background, certain", color::OURS, Shape::Disc)],
    ];
    for ((column, test), styles) in columns.iter().zip(COLUMNS).zip(styles) {
        for ((way, (name, _)), (label, color, shape)) in column.ways.iter().zip(WAYS).skip(1).zip(styles) {
            let points: Vec<(f64, f64)> = (1..)
                .zip(&way.detected)
                .filter(|(at, _)| at % 10 == 0)
                .map(|(at, &share)| (f64::from(at), share))
                .collect();
            chart.series(label, color, shape, &points);
            for (at, share) in (1_usize..).zip(&way.detected) {
                data.push([test.into(), name.into(), Cell::count(at), Cell::Percent(*share, 1)]);
            }
        }
    }
    Ok(Figure {
        id: "strangers-detected".into(),
        title: "Detection rate of strangers, against touches".into(),
        caption: format!(
            "The mean over the objects that were left out, at a false alarm rate of at most {} on known objects.",
            alarms()
        ),
        command: context.settings.command.clone(),
        panels: vec![chart.svg()?],
        data,
    })
}

fn ways_table(context: &Context, columns: &[Column; 2]) -> Table {
    let found = DETECTED_BY.map(|at| format!("detected by {at}"));
    let more = ["got a name", "false alarms", "touches, known objects", "wrong", "undecided"];
    let names = ["test", "names"].into_iter().map(String::from).chain(found).chain(more.map(String::from));
    let mut data = Records::new(names);
    for (column, test) in columns.iter().zip(COLUMNS) {
        for (way, (name, _)) in column.ways.iter().zip(WAYS) {
            let found = DETECTED_BY.map(|at| Cell::Percent(way.detected.get(at - 1).copied().unwrap_or(0.0), 1));
            let row = [test.into(), name.into()].into_iter().chain(found).chain([
                Cell::Percent(way.wrong_name, 1),
                Cell::Percent(way.false_alarms, 2),
                Cell::Number(way.touches, 1),
                Cell::Percent(way.wrong, 2),
                Cell::Percent(way.undecided, 2),
            ]);
            data.push(row);
        }
    }
    Table {
        id: "strangers-ways".into(),
        title: "Cost of detecting strangers".into(),
        caption: format!(
            "Off: no test; a background, where there is one, still competes with every name. {} trees of depth {} on {} of \
             full touches.",
            training().rounds,
            training().depth,
            training().descriptor.name()
        ),
        command: context.settings.command.clone(),
        data,
    }
}

fn objects_table(context: &Context, with: &Column) -> Table {
    let found = DETECTED_BY.map(|at| format!("detected by {at}"));
    let names = std::iter::once("left out".to_owned()).chain(found).chain(["got a name".to_owned()]);
    let mut data = Records::new(names);
    for (name, detected, named) in with.ways.last().map_or(&[][..], |way| &way.objects) {
        let detected = detected.iter().map(|&share| Cell::Percent(share, 1));
        data.push(std::iter::once(name.as_str().into()).chain(detected).chain([Cell::Percent(*named, 1)]));
    }
    Table {
        id: "strangers-objects".into(),
        title: "Detection rate of each stranger".into(),
        caption: format!(
            "With a background, names being held back (certain). {}",
            extremes(with.ways.last().map_or(&[], |way| &way.objects))
        ),
        command: context.settings.command.clone(),
        data,
    }
}

/// The strangers that are detected least and most in the end.
fn extremes(objects: &[(String, Vec<f64>, f64)]) -> String {
    let last = || objects.iter().filter_map(|(name, detected, _)| Some((name, *detected.last()?)));
    let by = DETECTED_BY.last().copied().unwrap_or(0);
    let of = |(name, share): (&String, f64)| format!("{name} ({})", percent(share, 1));
    let least = last().min_by(|a, b| a.1.total_cmp(&b.1)).map_or_else(String::new, of);
    let most = last().max_by(|a, b| a.1.total_cmp(&b.1)).map_or_else(String::new, of);
    format!("Detected least by {by} touches: {least}; most: {most}.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caption_names_the_strangers_of_this_run() {
        let of = |name: &str, detected: f64| (name.to_owned(), vec![0.0, 0.0, detected], 0.5);
        assert_eq!(
            extremes(&[of("cup", 0.031), of("jug", 0.98), of("pan", 0.4)]),
            "Detected least by 120 touches: cup (3.1 %); most: jug (98.0 %)."
        );
    }
}
