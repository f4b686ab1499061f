//! Measures maps of objects that nobody has a mesh of: errors of heights and footprints, and whether intervals hold the truth.
//!
//!     cargo run --release -p palpate-tests --bin shape -- [objects=DIRECTORY] [seeds=1] [noise=0.5] [lost=0] [write=DIRECTORY]
//!
//! Each object stands in its most likely placement and is touched at random in its box and 5 mm about it, and where the map is least
//! known. `write=DIRECTORY` writes the samples and the truth, for docs/measurements/tables/shape.py.

use palpate::locate::{self, Lying, Real, Relief, Shape, Standing, Truth, World};
use palpate::probe::approach::Probe;
use palpate::with;
use std::collections::HashMap;
use std::error::Error;

/// Numbers of approaches after which the map is compared.
const AFTER: [usize; 4] = [50, 100, 200, 300];

/// An object in its pose, and its true heights.
struct Thing {
    lying: Lying,
    radius: f64,
    half: [f64; 2],
}

impl Thing {
    fn truth(&self, relief: &Relief) -> Vec<f64> {
        let [x, y] = relief.half;
        (-y..=y).flat_map(|j| (-x..=x).map(move |i| self.lying.height([i, j].map(f64::from), self.radius))).collect()
    }
}

/// Mean error where the object is higher than .5 mm, intersection over union above 1 mm, share of intervals that hold the truth,
/// and their mean width.
fn compared(relief: &Relief, truth: &[f64]) -> [f64; 4] {
    let footprint: Vec<usize> = (0..truth.len()).filter(|cell| truth[*cell] > 0.5).collect();
    let mean = |of: &dyn Fn(usize) -> f64| footprint.iter().map(|cell| of(*cell)).sum::<f64>() / footprint.len() as f64;
    let above = |cell: &usize| [relief.heights[*cell] > 1.0, truth[*cell] > 1.0];
    let both = (0..truth.len()).filter(|cell| above(cell) == [true; 2]).count();
    let either = (0..truth.len()).filter(|cell| above(cell) != [false; 2]).count();
    let holds =
        |cell: usize| f64::from(u8::from((relief.bounds[cell][0]..=relief.bounds[cell][1]).contains(&truth[cell])));
    [
        mean(&|cell| (relief.heights[cell] - truth[cell]).abs()),
        both as f64 / either as f64,
        mean(&holds),
        mean(&|cell| relief.bounds[cell][1] - relief.bounds[cell][0]),
    ]
}

fn main() -> Result<(), Box<dyn Error>> {
    let given: HashMap<String, String> = std::env::args()
        .skip(1)
        .filter_map(|word| word.split_once('=').map(|(key, value)| (key.to_owned(), value.to_owned())))
        .collect();
    let number = |key: &str, default: f64| given.get(key).map_or(default, |value| value.parse().expect("a number"));
    let shared = std::env::var("PALPATE_SHARED").unwrap_or_else(|_| "../shared".into());
    let folder = given.get("objects").cloned().unwrap_or(format!("{shared}/objects"));
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0));
    let mut objects = palpate::mesh::source::objects(&[folder])?;
    for object in &mut objects {
        object.millimeters = Some(1.0);
        let length = object.instances().filter_map(|instance| object.true_length(instance)).fold(0.0, f64::max);
        object.millimeters = Some(100.0 / length);
    }
    let standing = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, number("noise", 0.5), &())?;
    let real = Real { height: number("noise", 0.5), lost: number("lost", 0.0), ..Real::default() };
    println!("| object | aims | approaches | error, mm | IoU | intervals that hold the truth | their width, mm |");
    println!("|---|---|---|---|---|---|---|");
    let mut sums: HashMap<(bool, usize), Vec<[f64; 4]>> = HashMap::new();
    for (object, stands) in standing.iter().enumerate() {
        for explored in [false, true] {
            let mut own: HashMap<usize, Vec<[f64; 4]>> = HashMap::new();
            for seed in 0..number("seeds", 1.0) as u64 {
                let world = World { standing: &standing, probe: &probe, real, range: 0.0, seed };
                let found = touched(&world, object, explored, given.get("write").filter(|_| seed == 0))?;
                AFTER.iter().zip(found).for_each(|(after, found)| own.entry(*after).or_default().push(found));
            }
            for after in AFTER {
                row(&stands.name, explored, after, &own[&after]);
                sums.entry((explored, after)).or_default().extend(&own[&after]);
            }
        }
    }
    for (explored, after) in [false, true].into_iter().flat_map(|explored| AFTER.map(|after| (explored, after))) {
        row("**mean**", explored, after, &sums[&(explored, after)]);
    }
    Ok(())
}

fn row(name: &str, explored: bool, after: usize, found: &[[f64; 4]]) {
    let mean = |of: usize| found.iter().map(|found| found[of]).sum::<f64>() / found.len() as f64;
    let [error, union, holds, width] = [0, 1, 2, 3].map(mean);
    let aims = if explored { "explored" } else { "random" };
    println!("| {name} | {aims} | {after} | {error:.2} | {union:.3} | {:.1} % | {width:.1} |", 100.0 * holds);
}

/// Touches an object of a world, and compares its map after each number of approaches.
fn touched(
    world: &World<'_>,
    object: usize,
    explored: bool,
    write: Option<&String>,
) -> Result<Vec<[f64; 4]>, Box<dyn Error>> {
    let Standing { name, placements, .. } = &world.standing[object];
    // What it looks like most often comes first.
    let lying = placements.first().ok_or("no placement")?;
    let high = lying.half();
    let thing = Thing { lying: lying.clone(), radius: world.probe.radius, half: [high.x + 5.0, high.y + 5.0] };
    let mut drawn = world.draw(object as u64).at(Truth { object, placement: 0, place: [0.0; 2], yaw: 0.0 });
    let mut shape = Shape::within(world.probe, thing.half, world.real.height);
    let mut relief = shape.relief();
    let truth = thing.truth(&relief);
    let mut found = Vec::new();
    for approach in 1..=300 {
        let at = if explored {
            shape.next(&relief)
        } else {
            let at = drawn.anywhere([0.0; 2], 1.0);
            let scaled = |share: i32, half: f64| (f64::from(share) * half) as i32;
            locate::Approach { x: scaled(at.x, thing.half[0]), y: scaled(at.y, thing.half[1]), ..at }
        };
        shape.push(&drawn.press(at))?;
        if explored || AFTER.contains(&approach) {
            relief = shape.relief();
        }
        if AFTER.contains(&approach) {
            found.push(compared(&relief, &truth));
            if let Some(directory) = write {
                let aims = if explored { "explored" } else { "random" };
                let of = |sample: &locate::Sample| {
                    let [x, y] = sample.place;
                    format!("{x} {y} {} {}\n", sample.height, u8::from(sample.is_contact))
                };
                let path = format!("{directory}/{name} {aims} {approach}.txt");
                std::fs::write(path, shape.samples().iter().map(of).collect::<String>())?;
            }
        }
    }
    if let Some(directory) = write {
        let [x, y] = relief.half;
        let heights: Vec<String> = truth.iter().map(f64::to_string).collect();
        std::fs::write(format!("{directory}/{name} truth.txt"), format!("{x} {y} {}", heights.join(" ")))?;
    }
    Ok(found)
}
