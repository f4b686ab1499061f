//! Speed against error: one row for each precision or approximation that can be chosen. The table of
//! `docs/measurements/speed.md`, which `docs/measurements/tables/speed.sh` remakes with what chips and reports add to it.
//!
//! ```text
//! cargo run --release -p palpate-tests --bin speed             about a minute
//! cargo run --release -p palpate-tests --bin speed -- --quick  a few seconds, no times to rely on
//! ```
//!
//! Times are the least of rounds in which the choices of a kind take turns, on one thread: others were disturbed.

use palpate::capture::{self, Settings as Capture};
use palpate::compile::{self, Compiled, Leaf, compile};
use palpate::ensemble::Ensemble;
use palpate::ensemble::train::{self, train};
use palpate::error::Result;
use palpate::evaluate::{
    Margins, parity,
    together::{Together, TouchesTogether},
};
use palpate::mesh::{obj, source};
use palpate::probe::scene::Scene;
use palpate::probe::sweep::Surface;
use palpate::touches::{Dataset, Origin};
use palpate::with;
use palpate_onboard::{Model, exp2_negative};
use palpate_shared::Touch;
use palpate_tests::{casts, precision};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<()> {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let (rounds, touches) = if quick { (1, 300) } else { (15, 21_000) };
    println!("| choice | speed | error |");
    println!("|---|---|---|");
    sweep(rounds)?;
    let objects = source::objects(&["builtin".to_owned()])?;
    let dataset = |seed| -> Result<Dataset> {
        let settings: Capture = Origin { touches, seed, ..Origin::default() }.into();
        Ok(capture::in_memory(&objects, &settings, &())?.0)
    };
    let (trained, test) = (dataset(1)?, dataset(2)?);
    leaves(rounds, &trained, &test)?;
    exponentials(rounds);
    Ok(())
}

fn row(choice: &str, speed: &str, error: &str) {
    println!("| {choice} | {speed} | {error} |");
}

/// Seconds of each contestant: the least over rounds in which all take turns.
fn in_turns(rounds: usize, contestants: &mut [Box<dyn FnMut() + '_>]) -> Vec<f64> {
    let mut times = vec![Vec::new(); contestants.len()];
    for round in 0..rounds {
        for turn in 0..contestants.len() {
            let index = (round + turn) % contestants.len();
            let start = Instant::now();
            contestants[index]();
            times[index].push(start.elapsed().as_secs_f64());
        }
    }
    times.into_iter().map(|times| times.into_iter().fold(f64::INFINITY, f64::min)).collect()
}

type Contact = fn(&Surface, glam::DVec3, glam::DVec3, f64) -> Option<f64>;

/// The sweep's narrow phase, on slivers whose contacts were computed in quad precision.
fn sweep(rounds: usize) -> Result<()> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let mesh = obj::read(&data.join("slivers.obj"))?;
    let casts = casts::read(&data.join("slivers.casts.csv"));
    let scene = Scene::as_is(&mesh)?;
    let surface = scene.surface();
    let choices: [(&str, Contact); 3] = [
        ("sweep in f64 after f32 (what Palpate does)", Surface::first_contact),
        ("sweep in f64 only", precision::double_without_reject),
        ("sweep in f32 after f32", precision::single_after_reject),
    ];
    let radius = f64::from(0.15_f32);
    let times = |contact: Contact| casts.iter().map(move |cast| contact(surface, cast.origin, cast.direction, radius));
    let mut turns: Vec<Box<dyn FnMut()>> = Vec::new();
    for (_, contact) in choices {
        turns.push(Box::new(move || (0..20).for_each(|_| times(contact).for_each(|time| _ = black_box(time)))));
    }
    let seconds = in_turns(rounds, &mut turns);
    for ((name, contact), seconds) in choices.into_iter().zip(seconds) {
        let sets = casts::agreement(&casts, &times(contact).collect::<Vec<_>>());
        let missed: usize = sets.iter().map(|set| set.missed).sum();
        let false_contacts: usize = sets.iter().map(|set| set.false_contacts).sum();
        let error = sets.iter().map(|set| set.largest_error).fold(0.0, f64::max);
        let speed = format!("{:.0} ns a cast", 1e9 * seconds / (20 * casts.len()) as f64);
        let count = casts.len();
        row(name, &speed, &format!("{missed} missed and {false_contacts} false of {count}; time off by {error:.0e}"));
    }
    Ok(())
}

/// Cost of a compiled model, and its distance from the ensemble.
fn models(rounds: usize, models: &[(String, &Ensemble, Compiled)], test: &Dataset) -> Result<()> {
    let touches: Vec<&Touch> = test.objects.iter().flat_map(|object| object.touches().iter().take(1000)).collect();
    let opened: Vec<Model<'_>> =
        models.iter().map(|(.., compiled)| compile::open(&compiled.bytes)).collect::<Result<_>>()?;
    let mut turns: Vec<Box<dyn FnMut()>> = Vec::new();
    for model in &opened {
        let mut margins = vec![0; model.object_count()];
        let touches = &touches;
        turns
            .push(Box::new(move || touches.iter().for_each(|touch| _ = black_box(model.margins(touch, &mut margins)))));
        let (mut margins, mut together) = (vec![0; model.object_count() * touches.len()], Together::new());
        turns.push(Box::new(move || together.touches(model, touches, black_box(&mut margins))));
    }
    let seconds = in_turns(rounds, &mut turns);
    for (((name, ensemble, compiled), model), seconds) in models.iter().zip(&opened).zip(seconds.chunks(2)) {
        let [one, all] = [seconds[0], seconds[1]].map(|seconds| 1e9 * seconds / touches.len() as f64);
        let chip = |instructions: Option<u64>| instructions.map_or("–".into(), |count| count.to_string());
        let speed = format!(
            "{one:.0} ns a touch, {all:.0} of many; {} instructions on an M4F, {} on an M0+; {} bytes",
            compiled.instructions.m4f,
            chip(compiled.instructions.m0_plus),
            compiled.bytes.len()
        );
        let off = parity::difference(ensemble, model, &touches, &())?.max_margin_error;
        let margins = Margins::new(model, test)?;
        let at_10 = margins.curve(10.min(margins.fewest_touches()), 5_000, 1)?.accuracy(10).value;
        row(name, &speed, &format!("margins off by {off:.0e} nats; {:.2} % right after 10 touches", 100.0 * at_10));
    }
    Ok(())
}

/// Types of leaves compared.
fn leaves(rounds: usize, trained: &Dataset, test: &Dataset) -> Result<()> {
    let ensemble = train(trained, &with!(train::Settings::compact(), leaf_bits = None), &())?;
    let compiled = [Leaf::F32, Leaf::I16, Leaf::I8].map(|leaf| {
        let settings = with!(compile::Settings::default(), leaf);
        Ok((format!("leaves as {}", leaf.name()), &ensemble, compile(&ensemble, &settings)?))
    });
    models(rounds, &compiled.into_iter().collect::<Result<Vec<_>>>()?, test)
}

/// The exponential of evidence, over -20 to 0 nats.
fn exponentials(rounds: usize) {
    const POINTS: u32 = 500_000;
    let exponents: Vec<f64> = (0..POINTS).map(|index| 20.0 * f64::from(index) / f64::from(POINTS)).collect();
    let fixed: Vec<u64> = exponents.iter().map(|x| (x * std::f64::consts::LOG2_E * 4_294_967_296.0) as u64).collect();
    let single: Vec<f32> = exponents.iter().map(|x| -*x as f32).collect();
    let mut turns: Vec<Box<dyn FnMut()>> = vec![
        Box::new(|| fixed.iter().for_each(|x| _ = black_box(exp2_negative(black_box(*x))))),
        Box::new(|| single.iter().for_each(|x| _ = black_box(black_box(*x).exp()))),
        Box::new(|| exponents.iter().for_each(|x| _ = black_box((-black_box(*x)).exp()))),
    ];
    let seconds = in_turns(rounds, &mut turns);
    let off = |of: &dyn Fn(usize) -> f64, at: &dyn Fn(usize) -> f64| {
        let errors = (0..exponents.len()).map(|index| (of(index) / at(index).exp() - 1.0).abs());
        errors.fold(0.0, f64::max)
    };
    let errors = [
        off(&|index| exp2_negative(fixed[index]) as f64 / 72_057_594_037_927_936.0, &|index| -exponents[index]),
        off(&|index| f64::from(single[index].exp()), &|index| f64::from(single[index])),
    ];
    let names = ["exponential in fixed point, Q56 (what chips do)", "exponential in f32", "exponential in f64"];
    for (index, (name, seconds)) in names.into_iter().zip(seconds).enumerate() {
        let speed = format!("{:.1} ns", 1e9 * seconds / f64::from(POINTS));
        row(name, &speed, &errors.get(index).map_or("taken as exact".into(), |error| format!("off by {error:.0e}")));
    }
}
