//! Measures recognition of objects with a place on a simulated table: approaches, wrong names, bytes and time.
//!
//!     cargo run --release -p palpate-tests --bin located -- [KEY=VALUE ...] [+ KEY=VALUE ...]...
//!
//! After each `+` are the keys of a run beyond the first ones; without one there is one run. `keep=1` takes the model of the run
//! before, `row=NAME` prints a row of a table, `write=DIRECTORY` writes the files of the firmware's image `located`.
//! `explored=NAME,NAME` have no mesh, and are learned from `teaching=300` touches each where the map is least known.

use palpate::calibrate;
use palpate::locate::{
    self, Aimed, Approach, CastSettings, Effort, Hand, Maps, Real, Shape, Standing, Surface, Truth, Until, World,
};
use palpate::mesh::Object;
use palpate::probe::approach::Probe;
use palpate::shared::format::{Length, Per};
use palpate::touches::{Dataset, ObjectTouches, Origin, Source};
use palpate::with;
use palpate_onboard::Verdict;
use palpate_tests::located::{self, OnChip, Terms};
use std::collections::HashMap;
use std::error::Error;
use std::time::Instant;

/// Keys and values.
#[derive(Clone, Default)]
struct Given(HashMap<String, String>);

impl Given {
    fn number(&self, key: &str, default: f64) -> f64 {
        self.0.get(key).map_or(default, |value| value.parse().expect("a number"))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let all: Vec<String> = std::env::args().skip(1).collect();
    let mut groups = all.split(|word| word == "+").map(|words| {
        words.iter().filter_map(|word| word.split_once('=')).map(|(key, value)| (key.to_owned(), value.to_owned()))
    });
    let base = Given(groups.next().into_iter().flatten().collect());
    let mut runs: Vec<Given> = groups.map(|own| Given(base.0.clone().into_iter().chain(own).collect())).collect();
    if runs.is_empty() {
        runs.push(base.clone());
    }
    let shared = std::env::var("PALPATE_SHARED").unwrap_or_else(|_| "../shared".into());
    let folder = base.0.get("objects").cloned().unwrap_or(format!("{shared}/objects"));
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0));
    let began = Instant::now();
    let sizes: Vec<f64> = [1.0, 0.8, 0.9, 1.1, 1.2][..base.number("sizes", 1.0) as usize].to_vec();
    let mut standing: Vec<Standing> = Vec::new();
    for size in &sizes {
        let objects = meshes(&folder, 100.0 * size)?;
        let more = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, base.number("noise", 0.5), &())?;
        standing.extend(more.into_iter().map(|object| Standing {
            name: if sizes.len() > 1 { format!("{} {size}", object.name) } else { object.name },
            ..object
        }));
    }
    standing.sort_by(|a, b| a.name.cmp(&b.name));
    // Objects that have no mesh: each is explored in its most likely pose, and stands in no other.
    let explored = base.0.get("explored").cloned().unwrap_or_default();
    let is_explored = |name: &str| explored.split(',').any(|own| own == name);
    for object in standing.iter_mut().filter(|object| is_explored(&object.name)) {
        object.placements.truncate(1);
    }
    // Objects that the model does not know.
    let unknown = base.0.get("unknown").cloned().unwrap_or_default();
    let known: Vec<Standing> =
        standing.iter().filter(|object| !unknown.split(',').any(|name| name == object.name)).cloned().collect();
    let touches = |(object, stands): (usize, &Standing)| {
        let touches = match is_explored(&stands.name) {
            true => explore(&known, object, &probe, base.number("teaching", 300.0) as usize),
            false => Vec::new(),
        };
        ObjectTouches::new(stands.name.clone(), touches, Source::Object)
    };
    let origin = Origin { unit: Length::Millimeter, probe, pose: true, position: true, ..Origin::default() };
    let dataset = Dataset { origin: Some(origin), ..Dataset::new(known.iter().enumerate().map(touches).collect()) };
    eprintln!("touches {:.1} s", began.elapsed().as_secs_f64());
    let mut model = Vec::new();
    for given in &runs {
        if given.number("keep", 0.0) == 0.0 {
            model = learned(given, &known, &dataset, &probe)?;
        }
        run(given, &mut model, [&standing, &known], &probe)?;
    }
    Ok(())
}

fn real(given: &Given) -> Real {
    let number = |key: &str, default: f64| given.number(key, default);
    Real {
        height: number("noise", 0.5),
        lost: number("lost", 0.02),
        position: number("position", 0.0),
        drift: number("drift", 0.0),
        drift_yaw: number("drift", 0.0),
        size: number("size", 1.0),
        bent: number("bent", 0.0),
        tips: number("tips", 0.0),
        table: number("table", 0.0),
        turned: number("turned", 0.0),
    }
}

/// The model, cast at objects without touches, and learned of the others.
fn learned(given: &Given, known: &[Standing], touched: &Dataset, probe: &Probe) -> Result<Vec<u8>, Box<dyn Error>> {
    let (number, real) = (|key: &str, default: f64| given.number(key, default), real(given));
    let settings = with!(
        CastSettings::default(),
        fine = number("cell", 1.0) < 1.5,
        noise = number("stated", real.height),
        position = number("stated_position", real.position),
        lost = number("stated_lost", 0.02),
        outliers = number("outliers", 1e-4),
        table_missed = number("table_missed", 0.02),
        drift = number("stated_drift", real.drift),
        drift_yaw = number("stated_drift", real.drift),
        error_rate = 1.0 - number("threshold", 0.99)
    );
    let mut surfaces = Vec::new();
    for (object, own) in touched.objects.iter().enumerate() {
        let made = match own.is_empty() {
            true => locate::cast(&known[object..=object], probe, &settings)?,
            false => locate::learn(&Dataset { objects: vec![own.clone()], ..touched.clone() }, &settings)?,
        };
        surfaces.extend(made.into_iter().map(|surface| Surface { object, ..surface }));
    }
    if number("v", 0.0) > 0.0 {
        for surface in &surfaces {
            let name = &known[surface.object].name;
            let (placement, share, half) = (&surface.placement, surface.share, surface.half);
            let (known, is_round) = (surface.known, surface.is_round);
            println!("{name} {placement} share {share:.3} half {half:?} known {known:.2} round {is_round}");
        }
    }
    let names: Vec<String> = known.iter().map(|object| object.name.clone()).collect();
    let model = locate::write(&surfaces, &names, probe, &settings)?;
    eprintln!("maps: {} placements, {} bytes", surfaces.len(), model.len());
    Ok(model)
}

fn run(
    given: &Given,
    model: &mut Vec<u8>,
    [standing, known]: [&[Standing]; 2],
    probe: &Probe,
) -> Result<(), Box<dyn Error>> {
    let number = |key: &str, default: f64| given.number(key, default);
    let bounded = ["lookups", "cells"].iter().any(|key| given.0.contains_key(*key));
    let bounds = Effort::default();
    let bounds = Effort {
        lookups: number("lookups", bounds.lookups.into()) as u32,
        cells: number("cells", bounds.cells.into()) as u32,
        ..bounds
    };
    let effort = bounded.then_some(bounds);
    let until = given.0.contains_key("until");
    let terms = locate::Terms {
        promise: calibrate::Terms { rate: number("rate", 0.01), confidence: 0.95, per: Per::Average },
        sequences: number("sequences", 300.0) as usize,
        max_touches: 25,
        aimed: if number("random", 0.0) > 0.0 { Aimed::Random } else { Aimed::Chosen },
        real: real(given),
        unknown: number("strangers", 0.0) > 0.0,
        until: until.then(|| Until { millimeters: number("until", 3.0), degrees: number("degrees", 5.0) }),
        pose: number("pose", 10.0) as u16,
        within: locate::within(number("workspace", 60.0))?,
        seed: number("seed", 1.0) as u64,
        effort,
    };
    if number("calibrate", 0.0) > 0.0 && number("keep", 0.0) == 0.0 {
        let maps = Maps::new(model).map_err(|error| error.to_string())?;
        let terms = locate::Terms { sequences: number("calibrate", 0.0) as usize, seed: 1000, ..terms };
        let found = locate::calibrate(maps, known, probe, &terms, &())?;
        println!(
            "promise: margin {:.2}, wrong {} of {}, approaches {:.2}",
            found.margin, found.wrong, found.given, found.mean_approaches
        );
        *model = found.model;
    }
    let maps = Maps::new(model).map_err(|error| error.to_string())?;
    if let Some(directory) = given.0.get("write") {
        let within = maps.range().unsigned_abs();
        let written = Terms { effort: bounds, within: 2 * within, pose: terms.pose };
        let world = World { standing, probe, real: terms.real, range: f64::from(within) / 1e3 - 1.0, seed: 1 };
        let bytes = approaches(maps, &world, &written, number("approaches", 1_000.0))?;
        std::fs::create_dir_all(directory)?;
        std::fs::write(format!("{directory}/located.palpate"), &*model)?;
        std::fs::write(format!("{directory}/located.bin"), bytes)?;
        return Ok(());
    }
    let began = Instant::now();
    let found = locate::evaluate(maps, standing, probe, &terms, &())?;
    let seconds = began.elapsed().as_secs_f64();
    let [median, most] = found.off;
    if let Some(name) = given.0.get("row") {
        println!(
            "| {name} | {:.2} | {} of {} | {} | {} | {median:.1} mm, {most:.1} mm | {} of {} |",
            found.mean_approaches,
            found.wrong,
            found.given,
            found.undecided,
            found.unknown,
            if until { found.poses_within } else { found.poses_in_interval },
            found.poses,
        );
    } else {
        println!(
            "poses {}: {} in their intervals, {} within; approaches {:.2}, wrong {} of {}, undecided {}, unknown {}; off {median:.1} mm, 95 %: {most:.1} mm; lookups {} k, at most {} k; {:.1} ms of wall time per approach",
            found.poses,
            found.poses_in_interval,
            found.poses_within,
            found.mean_approaches,
            found.wrong,
            found.given,
            found.undecided,
            found.unknown,
            found.looked[0] / 1000,
            found.looked[1] / 1000,
            seconds * 1000.0 / (found.mean_approaches * found.sequences as f64)
        );
    }
    if number("v", 0.0) > 0.0 {
        for object in found.objects {
            println!(
                "  {}: {:.1}, {} wrong, {} unknown",
                object.name, object.mean_approaches, object.wrong, object.unknown
            );
        }
    }
    Ok(())
}

/// Approaches as the image `located` reads them: the terms, then each touch with what this machine makes of it.
fn approaches(maps: Maps<'_>, world: &World<'_>, terms: &Terms, count: f64) -> Result<Vec<u8>, Box<dyn Error>> {
    let hand = Hand::of(&maps).ok_or("the maps state no hand")?;
    let mut locator = OnChip::new(maps.try_into()?, maps.stopping(), terms.effort, 1);
    let mut bytes = terms.to_bytes().to_vec();
    let mut index = 0;
    while bytes.len() < located::TERMS + count as usize * (located::TOUCH + located::LENGTH) {
        let mut drawn = world.draw(index);
        index += 1;
        let mut at = Approach::default();
        locator.reset();
        loop {
            let touch = drawn.press(at);
            let found = located::push(&mut locator, &touch, hand, terms);
            bytes.extend(located::to_bytes(&touch));
            bytes.extend(located::record(&locator, &found));
            at = found.next;
            if found.verdict != Some(Verdict::Undecided) {
                break;
            }
        }
    }
    Ok(bytes)
}

/// The objects of a folder, their longest side of this length in millimeters.
fn meshes(folder: &str, longest: f64) -> Result<Vec<Object>, Box<dyn Error>> {
    let mut objects = palpate::mesh::source::objects(&[folder.into()])?;
    for object in &mut objects {
        object.millimeters = Some(1.0);
        let length = object.instances().filter_map(|instance| object.true_length(instance)).fold(0.0, f64::max);
        object.millimeters = Some(longest / length);
    }
    Ok(objects)
}

/// Touches of an object, each where its map is least known.
fn explore(standing: &[Standing], object: usize, probe: &Probe, touches: usize) -> Vec<palpate::shared::Touch> {
    let real = Real { lost: 0.0, ..Real::default() };
    let world = World { standing, probe, real, range: 0.0, seed: 78 };
    let high = standing[object].placements[0].half();
    let mut drawn = world.draw(object as u64).at(Truth { object, placement: 0, place: [0.0; 2], yaw: 0.0 });
    let mut shape = Shape::within(probe, [high.x + 5.0, high.y + 5.0], real.height);
    let mut all = Vec::new();
    while all.len() < touches {
        let relief = shape.relief();
        let at = shape.next(&relief);
        let touch = drawn.press(at);
        shape.push(&touch).expect("the hand states where it is");
        all.push(touch);
    }
    all
}
