//! Growth: what more objects and finer meshes cost.

use super::context::{Context, compiled, touch};
use super::instructions::Instructions;
use crate::compile;
use crate::error::Result;
use crate::evaluate::{Candidate, Margins};
use crate::mesh::{Mesh, Object};
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Shape, Side};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use crate::probe::scene::Scene;
use crate::touches::folds;
use crate::touches::{Dataset, Origin};
use palpate_shared::Touch;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// What growth costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Growth {
    /// For each number of objects.
    pub(super) objects: Vec<Objects>,
    /// For each number of triangles.
    pub(super) triangles: Vec<Triangles>,
}

/// What a number of objects costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Objects {
    /// How many.
    pub(super) count: usize,
    /// Seconds of capturing.
    pub(super) capture: f64,
    /// Seconds of training.
    pub(super) train: f64,
    /// Bytes of the compiled model.
    pub(super) bytes: usize,
    /// Instructions per touch on the chips.
    pub(super) instructions: Instructions,
    /// Accuracy after ten touches.
    pub(super) at_10: f64,
    /// Accuracy after sixty touches.
    pub(super) at_60: f64,
}

/// What a number of triangles costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Triangles {
    /// How many.
    pub(super) count: usize,
    /// Seconds of building the scene and its tree.
    pub(super) build: f64,
    /// Approaches per second, all threads.
    pub(super) approaches: f64,
}

/// Touches more and more objects, and finer and finer meshes.
pub(super) fn measure(context: &Context) -> Result<Growth> {
    let settings = context.settings;
    let all: Vec<Object> = context
        .kinds()?
        .iter()
        .enumerate()
        .flat_map(|(instance, kinds)| {
            kinds.iter().map(move |object| Object::new(format!("{}-{instance}", object.name), object.mesh().clone()))
        })
        .collect();
    let grown = settings.growth_objects.iter().map(|&count| objects_cost(context, &all[..count]));
    let triangles = settings.growth_triangles.iter().map(|&count| triangles_cost(context, count));
    Ok(Growth { objects: grown.collect::<Result<_>>()?, triangles: triangles.collect::<Result<_>>()? })
}

fn objects_cost(context: &Context, objects: &[Object]) -> Result<Objects> {
    let settings = context.settings;
    let origin = Origin { seed: settings.seed, ..Origin::default() };
    let began = Instant::now();
    let touched = objects.iter().map(|object| {
        let scene = Scene::new(object.mesh(), origin.length)?;
        Ok(touch(&[scene], &object.name, settings.growth_touches, &origin, context.progress)?.0)
    });
    let mut data = Dataset::new(touched.collect::<Result<_>>()?);
    let capture = began.elapsed().as_secs_f64();
    data.objects.sort_by(|a, b| a.name.cmp(&b.name));
    let split = folds::split(&data, 0.2, settings.seed)?;
    let began = Instant::now();
    let ensemble = context.train(&split.train, &context.ours())?;
    let train = began.elapsed().as_secs_f64();
    let compiled = compiled(&ensemble)?;
    let model = compile::open(&compiled.bytes)?;
    let touches: Vec<Touch> =
        split.test.objects.iter().flat_map(|object| &object.touches).step_by(97).copied().collect();
    let curve = Margins::new(Candidate::Compiled(&model), &split.test)?.curve(60, 100, settings.seed)?;
    Ok(Objects {
        count: objects.len(),
        capture,
        train,
        bytes: compiled.bytes.len(),
        instructions: Instructions::new(&compiled, &touches)?,
        at_10: curve.accuracy(10).value,
        at_60: curve.accuracy(60).value,
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
        "Growth (what more objects and finer meshes cost) and generalization (recognizing objects that were never touched) \
         are measured on built-in objects and say nothing about these. A report on other objects leaves them out unless \
         they are asked for.",
    );
    section
}

/// The figures and the tables.
pub(super) fn section(context: &Context, growth: &Growth) -> Result<Section> {
    let mut section = Section::new("growth", "Growth");
    section.text(format!(
        "More objects: the ten built-in ones, then others of the same kinds with varied proportions, which are harder to \
         distinguish; {} touches each, four fifths of them for training our method. Finer meshes: the same bumpy \
         globe, cut into more and more triangles. Times are of this machine, all threads.",
        context.settings.growth_touches
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
        panel("Size", "bytes", &[("model", color::OURS, Shape::Disc, of(|o| o.bytes as f64))])?,
        panel(
            &format!("Instructions ({source})"),
            "instructions per touch, M4F",
            &[("model", color::OURS, Shape::Disc, of(|o| o.instructions.m4f.number as f64))],
        )?,
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
        "bytes",
        &format!("instructions, M4F ({})", source(growth)),
        "accuracy at 10",
        "accuracy at 60",
    ]);
    for objects in &growth.objects {
        data.push([
            Cell::count(objects.count),
            Cell::Number(objects.capture, 2),
            Cell::Number(objects.train, 2),
            Cell::count(objects.bytes),
            Cell::count(objects.instructions.m4f.number),
            Cell::Percent(objects.at_10, 1),
            Cell::Percent(objects.at_60, 1),
        ]);
    }
    data
}

fn objects_table(context: &Context, growth: &Growth) -> Table {
    Table {
        id: "growth-objects".into(),
        title: "More objects, in numbers".into(),
        caption: "Accuracy is over all objects: beyond ten, a fork can be mistaken for another fork.".into(),
        command: context.settings.command.clone(),
        data: objects_data(growth),
    }
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
            chart.marks.push(Mark::Text { at, text, color: color::INK, side: Side::Above });
        }
        chart.series("", color, Shape::Disc, &points);
        chart.labels.clear();
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
