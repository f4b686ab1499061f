//! Touches as an imperfect probe would make them, where there are no recorded ones: for `.ci/probe`.
//!
//! ```sh
//! crooked DIR     # DIR/known, DIR/test, DIR/plate.txt, DIR/meshes
//! ```
//!
//! The probe's faults stand in [`CROOKED`]. None of this is shared with what fits a probe: it goes from the
//! simulated contact times to the probe's by its own few lines.

use palpate::capture;
use palpate::mesh::{builtin, obj};
use palpate::probe::scene::Scene;
use palpate::touches::Origin;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Faults of a probe; times in seconds.
struct Crooked {
    /// The speed over the nominal one.
    factor: f64,
    /// Delay of each finger.
    late: [f64; 3],
    /// The standard deviation of the noise of each contact.
    noise: f64,
    /// The share of contacts that each finger misses.
    missed: [f64; 3],
    /// Error of the plate's squareness, in seconds from one finger to the next.
    slope: f64,
}

const CROOKED: Crooked =
    Crooked { factor: 0.9, late: [0.0, 0.005, -0.003], noise: 0.003, missed: [0.01, 0.0, 0.03], slope: 0.002 };

/// Objects whose touches are recorded to fit the probe.
const KNOWN: [&str; 4] = ["bowl", "camera", "mouse", "winebottle"];

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args().nth(1).ok_or("give a directory")?;
    let directory = Path::new(&directory);
    for name in ["known", "test", "meshes"] {
        fs::create_dir_all(directory.join(name))?;
    }
    for name in builtin::names() {
        let object = builtin::one(name)?;
        let mut mesh = Vec::new();
        obj::write(object.mesh(), &mut mesh)?;
        fs::write(directory.join(format!("meshes/{name}.obj")), mesh)?;
        let scene = [Scene::new(object.mesh(), 10.0)?];
        let record = |folder: &str, count, seed| -> Result<(), Box<dyn Error>> {
            let origin = Origin { approaches: true, seed, ..Origin::default() };
            let touches = capture::touches(&scene, name, &origin, 0..count)?;
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut lines = String::new();
            for touch in touches.touches() {
                let times = touch.times().map(|time| time.micros().map(|micros| f64::from(micros) / 1e6));
                CROOKED.write(times, &mut lines, &mut rng)?;
            }
            Ok(fs::write(directory.join(format!("{folder}/{name}.txt")), lines)?)
        };
        record("test", 3_000, 77)?;
        if KNOWN.contains(&name) {
            record("known", 300, 78)?;
        }
    }
    let (mut plate, mut rng) = (String::new(), ChaCha8Rng::seed_from_u64(79));
    for press in 0..60 {
        // Rolled by half a turn after each.
        let slope = if press % 2 == 0 { CROOKED.slope } else { -CROOKED.slope };
        // Late enough that none is before the clock's start.
        CROOKED.write([0.1, 0.1 + slope, 0.1 + 2.0 * slope].map(Some), &mut plate, &mut rng)?;
    }
    fs::write(directory.join("plate.txt"), plate)?;
    Ok(())
}

impl Crooked {
    /// The line of an approach with these contact times.
    fn write(&self, times: [Option<f64>; 3], line: &mut String, rng: &mut ChaCha8Rng) -> Result<(), Box<dyn Error>> {
        let mut crooked = [None; 3];
        for (finger, time) in times.into_iter().enumerate() {
            // Box and Muller, 1958.
            let [radius, angle]: [f64; 2] = [1.0 - rng.random::<f64>(), rng.random()];
            let normal = (-2.0 * radius.ln()).sqrt() * (TAU * angle).cos();
            let is_missed = rng.random::<f64>() < self.missed[finger];
            let time = time.filter(|_| !is_missed);
            crooked[finger] = time.map(|time| time / self.factor + self.late[finger] + self.noise * normal);
        }
        let first = crooked.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        // A timer of 1 ms, at a phase of its own.
        let phase: f64 = rng.random();
        let ticks = crooked.map(|time| time.map(|time| ((time - first) * 1e3 + phase).floor()));
        let fields = ticks.map(|ticks| ticks.map_or_else(|| "-".into(), |ticks| format!("{:.3}", ticks / 1e3)));
        Ok(writeln!(line, "{}", fields.join(" "))?)
    }
}
