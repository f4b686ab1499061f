//! The simulator's speed against its error, for several ways to decide a contact.

use super::context::Context;
use crate::page::axis::{Axis, short_number};
use crate::page::chart::{Chart, Mark, Shape};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use glam::DVec3;
use palpate::error::Result;
use palpate::probe::approach::{Approach, Probe};
use palpate::probe::scene::Scene;
use palpate::probe::sweep::narrow::{self, Motion, Triangle};
use palpate::probe::sweep::precision::{self, DoubleWithoutReject, Precision, SingleAfterReject};
use palpate::random::{self, Purpose};
use rand::RngExt;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::hint::black_box;
use std::time::Instant;

/// One cast in so many grazes a triangle.
const GRAZING: usize = 6;
/// Logarithms of the distances, in units, at which they pass it.
const CLEARANCES: std::ops::Range<f64> = -7.0..-2.0;
/// The logarithm of the time, in seconds, at which an error of 0 is drawn: it has none of its own.
const NO_ERROR: i32 = -17;

/// Results of one way of deciding contacts, all objects together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Engine {
    /// Description of the way.
    pub(super) name: String,
    /// Casts per second, one thread.
    pub(super) rate: f64,
    /// Casts compared with a decision over every triangle.
    pub(super) casts: usize,
    /// Contacts missed.
    pub(super) missed: usize,
    /// Contacts where there are none.
    pub(super) false_contacts: usize,
    /// The largest difference in time, in seconds.
    pub(super) largest_error: f64,
}

/// A finger on its way.
struct Cast {
    origin: DVec3,
    direction: DVec3,
}

/// Casts fingers at the objects, some so that they graze.
pub(super) fn measure(context: &Context) -> Result<Vec<Engine>> {
    let count = if context.settings.quick { 90 } else { 600 };
    let probe = context.settings.capture.probe;
    let scenes = context.scenes();
    let casts: Vec<Vec<Cast>> = scenes
        .iter()
        .zip(context.objects)
        .map(|(scene, object)| casts(scene, &object.name, count, context.settings.seed, &probe))
        .collect();
    let all = |contact: &dyn Fn(&Scene, &Cast) -> Option<f64>| -> (Vec<Option<f64>>, f64) {
        let began = Instant::now();
        let mut times = Vec::new();
        for (scene, casts) in scenes.iter().zip(&casts) {
            times.extend(casts.iter().map(|cast| black_box(contact(scene, black_box(cast)))));
        }
        let rate = times.len() as f64 / began.elapsed().as_secs_f64();
        (times, rate)
    };
    // Every triangle in f64, without a tree: slow, and correct by construction.
    let began = Instant::now();
    let truth: Vec<Option<f64>> = scenes
        .par_iter()
        .zip(&casts)
        .flat_map_iter(|(scene, casts)| {
            let triangles: Vec<Triangle> = scene.triangles().collect();
            casts.iter().map(|cast| every_triangle(&triangles, cast, probe.radius)).collect::<Vec<_>>()
        })
        .collect();
    let threads = rayon::current_num_threads() as f64;
    let slow = truth.len() as f64 / began.elapsed().as_secs_f64() / threads;

    let engine = |name: &str, times: &[Option<f64>], rate: f64| {
        let mut engine =
            Engine { name: name.into(), rate, casts: truth.len(), missed: 0, false_contacts: 0, largest_error: 0.0 };
        for (truth, time) in truth.iter().zip(times) {
            match (truth, time) {
                (Some(truth), Some(time)) => {
                    engine.largest_error = engine.largest_error.max((truth - time).abs() / probe.speed);
                }
                (Some(_), None) => engine.missed += 1,
                (None, Some(_)) => engine.false_contacts += 1,
                (None, None) => {}
            }
        }
        engine
    };
    let fast = |name: &str, contact: &dyn Fn(&Scene, &Cast) -> Option<f64>| {
        let passes: Vec<(Vec<Option<f64>>, f64)> = (0..5).map(|_| all(contact)).collect();
        let rate = passes.iter().map(|pass| pass.1).fold(0.0, f64::max);
        engine(name, &passes[0].0, rate)
    };
    Ok(vec![
        fast("f32 after the f32 reject", &|scene, cast| decide::<SingleAfterReject>(scene, cast, probe.radius)),
        fast("f64 after the f32 reject (used)", &|scene, cast| {
            scene.first_contact(cast.origin, cast.direction, probe.radius)
        }),
        fast("f64 for each triangle of a leaf", &|scene, cast| {
            decide::<DoubleWithoutReject>(scene, cast, probe.radius)
        }),
        engine("f64 for every triangle, no tree", &truth, slow),
    ])
}

fn decide<P: Precision>(scene: &Scene, cast: &Cast, radius: f64) -> Option<f64> {
    precision::first_contact::<P>(scene.surface(), cast.origin, cast.direction, radius)
}

fn every_triangle(triangles: &[Triangle], cast: &Cast, radius: f64) -> Option<f64> {
    // Far starts lose digits, so the sphere is first moved to where it cannot have touched anything yet.
    let reach = triangles.iter().flatten().map(|corner| corner.length()).fold(0.0, f64::max) + radius;
    let skipped = (-cast.origin.dot(cast.direction) - reach).max(0.0);
    let motion = Motion { origin: cast.origin + cast.direction * skipped, direction: cast.direction, radius };
    let first = triangles
        .iter()
        .fold(f64::INFINITY, |first, triangle| narrow::first_contact(&motion, triangle, first).unwrap_or(first));
    first.is_finite().then_some(first + skipped)
}

/// Fingers as the probe moves them; one in [`GRAZING`] passes a triangle's middle at a distance of the radius, give or take
/// a clearance.
fn casts(scene: &Scene, name: &str, count: usize, seed: u64, probe: &Probe) -> Vec<Cast> {
    let triangles: Vec<Triangle> = scene.triangles().collect();
    let mut random = random::generator(seed, Purpose::Casts, name, 0);
    (0..count)
        .map(|index| {
            let approach = Approach::draw(&mut random, scene.bounds(), probe.tilt);
            let direction = approach.direction;
            if index % GRAZING != 0 {
                return Cast { origin: approach.fingers(probe.spacing)[index % 3], direction };
            }
            let [a, b, c] = triangles[random.random_range(0..triangles.len())];
            let normal = (b - a).cross(c - a).normalize_or(DVec3::Z);
            let along = normal.cross(direction).normalize_or(DVec3::X);
            let clearance = 10f64.powf(random.random_range(CLEARANCES)) * if random.random() { 1.0 } else { -1.0 };
            let beside = (a + b + c) / 3.0 + normal * (probe.radius + clearance);
            Cast { origin: beside - along * (approach.start.length() + 1.0), direction: along }
        })
        .collect()
}

/// Adds the figure and the table to the section on speed against error.
pub(super) fn add(context: &Context, engines: &[Engine], section: &mut Section) -> Result<()> {
    section.text(format!(
        "The same for the simulator: fingers cast at the objects, one thread, compared with a decision in f64 over every triangle. \
         One cast in {GRAZING} grazes a triangle at a clearance of {} to {} units.",
        short_number(10f64.powf(CLEARANCES.start)),
        short_number(10f64.powf(CLEARANCES.end))
    ));
    let rates = || engines.iter().map(|engine| engine.rate);
    let x = Axis::logarithmic(rates().fold(f64::INFINITY, f64::min) * 0.5, rates().fold(0.0, f64::max) * 8.0);
    let shown = |error: f64| error.max(10f64.powi(NO_ERROR));
    let top = engines.iter().map(|engine| shown(engine.largest_error)).fold(1e-6, f64::max);
    let mut chart = Chart::new(
        "casts per second",
        x,
        "largest time error (s)",
        Axis::logarithmic(0.3 * 10f64.powi(NO_ERROR), top * 10.0),
    )
    .sized(660, 330);
    let mut data = Records::new([
        "decided in",
        "casts per second",
        "casts compared",
        "missed",
        "false contacts",
        "largest error (s)",
    ]);
    for (index, engine) in engines.iter().enumerate() {
        let at = (engine.rate, shown(engine.largest_error));
        let (color, shape) = [
            (color::GREEN, Shape::Triangle),
            (color::OURS, Shape::Disc),
            (color::PURPLE, Shape::Square),
            (color::PAPER, Shape::Ring),
        ][index % 4];
        chart.marks.push(Mark::Dots { points: vec![at], color, shape });
        chart.legend(&engine.name, color, None, Some(shape));
        data.push([
            engine.name.as_str().into(),
            Cell::Number(engine.rate, 0),
            Cell::count(engine.casts),
            Cell::count(engine.missed),
            Cell::count(engine.false_contacts),
            Cell::Text(format!("{:.1e}", engine.largest_error)),
        ]);
    }
    section.figure(Figure {
        id: "simulator-figure".into(),
        title: "Casts per second against time error".into(),
        caption: format!(
            "Farther right is faster, farther down more exact; errors of 0 are drawn at {}.",
            short_number(10f64.powi(NO_ERROR))
        ),
        command: context.settings.command.clone(),
        panels: vec![chart.svg()?],
        data: data.clone(),
    });
    section.table(Table {
        id: "simulator".into(),
        title: "The simulator's choices".into(),
        caption: "The last row is the reference for the others.".into(),
        command: context.settings.command.clone(),
        data,
    });
    Ok(())
}
