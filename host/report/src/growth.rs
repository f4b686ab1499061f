//! Growth: what more objects and finer meshes cost.

use super::context::{Context, touch};
use super::instructions::Instructions;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Shape};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::capture;
use palpate::compile::{self, Leaf};
use palpate::error::Result;
use palpate::evaluate::{Candidate, Margins, SequentialSettings};
use palpate::mesh::{Mesh, Object, builtin};
use palpate::probe::scene::Scene;
use palpate::progress;
use palpate::touches::{Dataset, ObjectTouches, Origin};
use palpate::wording::{count, rate};
use palpate_onboard::Refused;
use palpate_shared::Touch;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Cost of growth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Growth {
    /// For each number of objects.
    pub(super) objects: Vec<Objects>,
    /// For each number of triangles.
    pub(super) triangles: Vec<Triangles>,
}

/// Cost of a number of objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Objects {
    /// Number of objects.
    pub(super) count: usize,
    /// Seconds of capturing.
    pub(super) capture: f64,
    /// Seconds of training.
    pub(super) train: f64,
    /// Bytes of the model with leaves of two bytes.
    pub(super) two_bytes: usize,
    /// Bytes of the model that is usual for so many objects; the rest is about this one.
    pub(super) bytes: usize,
    /// Instructions per touch on the chips.
    pub(super) instructions: Instructions,
    /// Accuracy after each of [`AT`] approaches; none where an object has fewer to test.
    pub(super) accuracy: Vec<Option<f64>>,
    /// Approaches to a verdict, on average.
    pub(super) approaches: f64,
    /// The share of wrong verdicts.
    pub(super) wrong: f64,
    /// The share of sequences without a verdict.
    pub(super) undecided: f64,
}

/// Numbers of approaches after which accuracy is shown.
const AT: [usize; 3] = [20, 60, 200];
/// Touches after which a recognizer gives up: twice the usual, since many objects take more.
const MAX_TOUCHES: u32 = 400;

/// Cost of a number of triangles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Triangles {
    /// Number of triangles.
    pub(super) count: usize,
    /// Seconds of building the scene and its tree.
    pub(super) build: f64,
    /// Approaches per second, all threads.
    pub(super) approaches: f64,
}

/// Touches more and more objects, and finer and finer meshes.
pub(super) fn measure(context: &Context) -> Result<Growth> {
    let settings = context.settings;
    let most = settings.growth_objects.iter().copied().max().unwrap_or(0);
    context.progress.begin("making objects", None);
    let all = builtin::many(most)?;
    context.progress.begin("touching", u64::try_from(most).ok());
    let touched: Vec<Touched> = all.iter().map(|object| touched(context, object)).collect::<Result<_>>()?;
    let grown = settings.growth_objects.iter().map(|&count| objects_cost(context, &touched[..count]));
    let triangles = settings.growth_triangles.iter().map(|&count| triangles_cost(context, count));
    Ok(Growth { objects: grown.collect::<Result<_>>()?, triangles: triangles.collect::<Result<_>>()? })
}

/// An object's approaches, to train on and to test on, and the seconds that they took.
struct Touched {
    train: ObjectTouches,
    test: ObjectTouches,
    seconds: f64,
}

fn origin(context: &Context) -> Origin {
    Origin { seed: context.settings.seed, approaches: true, ..Origin::default() }
}

fn touched(context: &Context, object: &Object) -> Result<Touched> {
    progress::advance(context.progress, 1)?;
    let origin = origin(context);
    let began = Instant::now();
    let scene = Scene::new(object.mesh(), origin.length)?;
    let count = context.settings.growth_approaches;
    let touches = capture::touches(&[scene], &object.name, &origin, 0..count + count / 4)?;
    let seconds = began.elapsed().as_secs_f64();
    let count = usize::try_from(count).unwrap_or(usize::MAX).min(touches.len());
    Ok(Touched { train: touches.select(0..count), test: touches.select(count..touches.len()), seconds })
}

fn objects_cost(context: &Context, touched: &[Touched]) -> Result<Objects> {
    let settings = context.settings;
    let data = |of: fn(&Touched) -> &ObjectTouches| {
        let mut objects: Vec<ObjectTouches> = touched.iter().map(|touched| of(touched).clone()).collect();
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        Dataset { origin: Some(origin(context)), ..Dataset::new(objects) }
    };
    let (train, test) = (data(|touched| &touched.train), data(|touched| &touched.test));
    let began = Instant::now();
    let ensemble = context.train(&train, &context.ours())?;
    let seconds = began.elapsed().as_secs_f64();
    let usual = compile::Settings { max_touches: MAX_TOUCHES, ..compile::Settings::for_touches(touched.len()) };
    let compiled = compile::compile(&ensemble, &usual)?;
    let two_bytes = match usual.leaf {
        Leaf::I16 => compiled.bytes.len(),
        Leaf::I8 | Leaf::F32 => compile::compile(&ensemble, &compile::Settings::default())?.bytes.len(),
    };
    let model = compile::open(&compiled.bytes)?;
    let touches: Vec<Touch> = test.touches().step_by(97).copied().collect();
    let touches: Vec<Touch> =
        touches.into_iter().filter(|touch| Refused::check(&model.trained_touches(), touch).is_ok()).collect();
    let margins = Margins::new(Candidate::Compiled(&model), &test)?;
    let at: Vec<usize> = AT.into_iter().filter(|&at| at <= margins.fewest_approaches()).collect();
    let sequences = (if settings.quick { 2_000 } else { 20_000 } / touched.len()).clamp(20, 1_000);
    let drawn = SequentialSettings { error_rate: None, max_touches: None, sequences, seed: settings.seed };
    let measured = margins.approaches(&at, &drawn)?;
    Ok(Objects {
        count: touched.len(),
        capture: touched.iter().map(|touched| touched.seconds).sum(),
        train: seconds,
        two_bytes,
        bytes: compiled.bytes.len(),
        instructions: Instructions::new(&compiled, &touches)?,
        accuracy: AT.iter().map(|at| measured.accuracy.get(at).copied()).collect(),
        approaches: measured.sequential.mean().value,
        wrong: measured.sequential.error,
        undecided: measured.sequential.undecided,
    })
}

fn triangles_cost(context: &Context, count: usize) -> Result<Triangles> {
    let mesh = Mesh::globe((count as f64 / 4.0).sqrt().round() as u32);
    let began = Instant::now();
    let origin = Origin { seed: context.settings.seed, ..Origin::default() };
    let scene = Scene::new(&mesh, origin.length)?;
    let build = began.elapsed().as_secs_f64();
    let touches = if context.settings.quick { 5_000 } else { 40_000 };
    let began = Instant::now();
    let (_, approaches) = touch(&[scene], "globe", touches, &origin, context.progress)?;
    let seconds = began.elapsed().as_secs_f64();
    Ok(Triangles { count: mesh.triangles.len(), build, approaches: approaches as f64 / seconds })
}

/// Replaces growth and generalization where they were not measured.
pub(super) fn left_out() -> Section {
    let mut section = Section::new("left-out", "Not measured");
    section.text(
        "Growth (the cost of more objects and finer meshes) and generalization (recognizing objects that were never \
         touched) are measured on built-in objects and say nothing about the objects of this report. A report on other \
         objects leaves them out unless they are asked for.",
    );
    section
}

/// The figures and the tables.
pub(super) fn section(context: &Context, growth: &Growth) -> Result<Section> {
    let mut section = Section::new("growth", "Growth");
    section.text(format!(
        "More objects, in this order: the built-in ones, then in turn as many shapes of no kind and others of the same kinds \
         with varied proportions; {} approaches to each train our method on every contact, {} test it. With more than {} \
         objects leaves are of one byte, as is usual then. Finer meshes: the same bumpy globe, cut into more and more \
         triangles. Times are of this machine, all threads.",
        count(context.settings.growth_approaches),
        count(context.settings.growth_approaches / 4),
        compile::MANY
    ));
    section.figure(objects_figure(context, growth)?);
    section.table(objects_table(context, growth));
    section.figure(triangles_figure(context, growth)?);
    Ok(section)
}

fn objects_figure(context: &Context, growth: &Growth) -> Result<Figure> {
    let counts: Vec<f64> = growth.objects.iter().map(|objects| objects.count as f64).collect();
    let most = counts.iter().copied().fold(2.0, f64::max);
    let x = || {
        let ticks = growth.objects.iter().map(|objects| (objects.count as f64, objects.count.to_string())).collect();
        Axis::logarithmic(2.0, most).with_ticks(ticks)
    };
    let panel = |title: &str, unit: &str, lines: &[(&str, plotters::style::RGBColor, Shape, Vec<f64>)]| {
        let all = || lines.iter().flat_map(|line| line.3.iter().copied());
        let y = Axis::logarithmic(all().fold(f64::INFINITY, f64::min) * 0.7, all().fold(0.0, f64::max) * 1.4);
        let mut chart = Chart::new("objects", x(), unit, y).sized(370, 270).titled(title);
        for (name, color, shape, values) in lines {
            let points: Vec<(f64, f64)> = counts.iter().copied().zip(values.iter().copied()).collect();
            chart.series(name, *color, *shape, &points);
        }
        chart.svg()
    };
    let of = |value: fn(&Objects) -> f64| growth.objects.iter().map(value).collect::<Vec<f64>>();
    let source = source(growth);
    let panels = vec![
        panel(
            "Time",
            "seconds",
            &[
                ("capture", color::GREEN, Shape::Triangle, of(|o| o.capture)),
                ("training", color::OURS, Shape::Disc, of(|o| o.train)),
            ],
        )?,
        panel(
            "Size",
            "bytes",
            &[
                ("leaves of two bytes", color::GREEN, Shape::Triangle, of(|o| o.two_bytes as f64)),
                ("usual", color::OURS, Shape::Disc, of(|o| o.bytes as f64)),
            ],
        )?,
        panel(
            &format!("Instructions ({source})"),
            "instructions per touch, M4F",
            &[("usual", color::OURS, Shape::Disc, of(|o| o.instructions.m4f.number as f64))],
        )?,
        panel("Approaches to a verdict", "approaches", &[("usual", color::OURS, Shape::Disc, of(|o| o.approaches))])?,
    ];
    Ok(Figure {
        id: "growth-objects-figure".into(),
        title: "More objects".into(),
        caption: "All axes are logarithmic.".into(),
        command: context.settings.command.clone(),
        panels,
        data: objects_data(growth),
    })
}

/// Where the instructions come from.
fn source(growth: &Growth) -> &'static str {
    growth.objects.first().map_or("estimated", |objects| objects.instructions.m4f.source())
}

fn objects_data(growth: &Growth) -> Records {
    let mut data = Records::new([
        "objects",
        "capture (s)",
        "training (s)",
        "bytes, i16 leaves",
        "bytes, usual",
        &format!("instructions, M4F ({})", source(growth)),
        &format!("accuracy at {}", AT[0]),
        &format!("accuracy at {}", AT[1]),
        &format!("accuracy at {}", AT[2]),
        "approaches to a verdict",
        "wrong",
        "undecided",
    ]);
    for objects in &growth.objects {
        let at = |place: usize| match objects.accuracy.get(place).copied().flatten() {
            Some(share) => Cell::Percent(share, 1),
            None => Cell::Missing,
        };
        data.push([
            Cell::count(objects.count),
            Cell::Number(objects.capture, 2),
            Cell::Number(objects.train, 2),
            Cell::count(objects.two_bytes),
            Cell::count(objects.bytes),
            Cell::count(objects.instructions.m4f.number),
            at(0),
            at(1),
            at(2),
            Cell::Number(objects.approaches, 1),
            Cell::Percent(objects.wrong, 2),
            Cell::Percent(objects.undecided, 2),
        ]);
    }
    data
}

fn objects_table(context: &Context, growth: &Growth) -> Table {
    Table {
        id: "growth-objects".into(),
        title: "More objects, in numbers".into(),
        caption: stopping(growth),
        command: context.settings.command.clone(),
        data: objects_data(growth),
    }
}

/// Meaning of the accuracies, and where a recognizer stops.
fn stopping(growth: &Growth) -> String {
    let kinds = builtin::names().len();
    let several = growth.objects.iter().any(|objects| objects.count > 2 * kinds);
    let mistaken = match several {
        true => format!(": beyond {} objects, an object can be mistaken for another of its kind", 2 * kinds),
        false => String::new(),
    };
    format!(
        "Accuracies are over all objects{mistaken}. A recognizer stops at a posterior of {}, or gives up after {MAX_TOUCHES} \
         touches.",
        rate(1.0 - compile::Settings::default().error_rate)
    )
}

fn triangles_figure(context: &Context, growth: &Growth) -> Result<Figure> {
    let most = growth.triangles.iter().map(|t| t.count as f64).fold(1e4, f64::max);
    let least = growth.triangles.iter().map(|t| t.count as f64).fold(most, f64::min);
    let x = || Axis::logarithmic(least * 0.8, most * 1.2);
    let mut data = Records::new(["triangles", "building (s)", "approaches per second"]);
    let (mut fast, mut build) = (Vec::new(), Vec::new());
    for triangles in &growth.triangles {
        fast.push((triangles.count as f64, triangles.approaches));
        build.push((triangles.count as f64, triangles.build.max(1e-5)));
        data.push([
            Cell::count(triangles.count),
            Cell::Number(triangles.build, 3),
            Cell::Number(triangles.approaches, 0),
        ]);
    }
    let panel = |title: &str, unit: &str, color, points: Vec<(f64, f64)>| {
        let y = || points.iter().map(|point| point.1);
        let scale = Axis::logarithmic(y().fold(f64::INFINITY, f64::min) * 0.5, y().fold(0.0, f64::max) * 2.0);
        let mut chart = Chart::new("triangles", x(), unit, scale).sized(420, 270).titled(title);
        for &at in &points {
            let text = crate::page::axis::short_number(at.1);
            chart.marks.push(Mark::Note { at, text, color: color::INK });
        }
        chart.series("", color, Shape::Disc, &points);
        chart.svg()
    };
    Ok(Figure {
        id: "growth-triangles".into(),
        title: "Finer meshes".into(),
        caption:
            "Approaches per second, full touches and failed ones together, all threads; seconds to scale the mesh and \
                  build its tree."
                .into(),
        command: context.settings.command.clone(),
        panels: vec![
            panel("Speed", "approaches per second", color::OURS, fast)?,
            panel("Building", "seconds", color::GREEN, build)?,
        ],
        data,
    })
}
