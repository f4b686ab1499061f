//! First contacts of a swept sphere: Palpate, a plain loop over obvhs's tree, and parry3d, on the same casts in the same run;
//! speed against error; how the cost grows with the mesh; and the ten real objects, where `PALPATE_SHARED` leads to them.
//!
//! ```text
//! cargo bench --manifest-path tests/peers/Cargo.toml --bench sweep
//! cargo bench --manifest-path tests/peers/Cargo.toml --bench sweep -- --peers     only the comparison
//! cargo bench --manifest-path tests/peers/Cargo.toml --bench sweep -- --quick     a few seconds, no rates to rely on
//! ```
//!
//! Rates are of one thread, in processor time where the system reports it, so that other processes do not count: medians of
//! paired rounds against others, elsewhere the best of three rounds, except where it says otherwise.

use glam::DVec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use palpate::capture::{self, Settings};
use palpate::mesh::Mesh;
use palpate::probe::approach::{Approach, Probe};
use palpate::probe::scene::Scene;
use palpate::probe::sweep::Surface;
use palpate::probe::sweep::narrow::{self, Motion, Triangle};
use palpate::touches::Origin;
use palpate_peers::{QUICK, clock, paired};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use std::hint::black_box;
use std::path::{Path, PathBuf};

#[path = "../../src/casts.rs"]
mod known;
#[path = "../../src/precision.rs"]
mod precision;

const RADIUS: f64 = 0.15;

struct Cast {
    origin: DVec3,
    direction: DVec3,
}

fn main() {
    if *QUICK {
        println!("A quick run: its rates mean nothing.\n");
    }
    peers();
    if std::env::args().any(|argument| argument == "--peers") {
        return;
    }
    speed_against_error();
    growth();
    real_objects();
}

fn mesh_of(triangles: f64) -> Mesh {
    Mesh::globe((triangles / 4.0).sqrt().round() as u32)
}

/// Casts as the probe makes them, every sixth turned into one that grazes the surface: tangent to it with a clearance
/// of ±1e-7 to ±1e-2.
fn casts(scene: &Scene, count: usize) -> Vec<Cast> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let triangles: Vec<Triangle> = scene.triangles().collect();
    let cast = |index| {
        let approach = Approach::draw(&mut rng, scene.bounds(), 10.0);
        let Approach { start, direction, .. } = approach;
        if index % 6 != 0 {
            return Cast { origin: approach.fingers(1.5)[index % 3], direction };
        }
        // Through a point beside a triangle's corner, perpendicular to the way from it, clear of the triangle itself.
        let [a, b, c] = triangles[rng.random_range(0..triangles.len())];
        let normal = (b - a).cross(c - a).normalize_or(DVec3::Z);
        let along = normal.cross(direction).normalize_or(DVec3::X);
        let clearance = 10.0_f64.powf(rng.random_range(-7.0..-2.0)) * if rng.random() { 1.0 } else { -1.0 };
        let beside = (a + b + c) / 3.0 + normal * (RADIUS + clearance);
        Cast { origin: beside - along * (start.length() + 1.0), direction: along }
    };
    (0..count).map(cast).collect()
}

/// The best rate of `rounds`, each of at least a quarter of a second unless the run is quick, and the times found.
fn measure<T>(casts: &[T], rounds: usize, contact: impl Fn(&T) -> Option<f64>) -> (f64, Vec<Option<f64>>) {
    let mut best = 0.0_f64;
    let mut times = Vec::new();
    for _ in 0..rounds {
        let (start, mut count) = (clock(), 0);
        while count == 0 || (!*QUICK && clock() - start < 0.25) {
            times = casts.iter().map(|cast| black_box(contact(black_box(cast)))).collect();
            count += casts.len();
        }
        best = best.max(count as f64 / (clock() - start));
    }
    (best, times)
}

/// Whoever finds first contacts.
type Engine<'a> = Box<dyn Fn(usize) -> Option<f64> + 'a>;

/// The parry3d of one precision: mesh and casts are converted here, outside the clock.
macro_rules! parry {
    ($parry:ident, $real:ident, $mesh:expr, $casts:expr) => {{
        use $parry::math::{Pose, Vector};
        use $parry::query::{ShapeCastOptions, cast_shapes};
        use $parry::shape::{Ball, TriMesh};
        let [low, high] = Scene::as_is($mesh).unwrap().bounds();
        let (center, scale) = ((low + high) / 2.0, 10.0 / (high - low).max_element());
        let vector = |v: DVec3| Vector::new(v.x as $real, v.y as $real, v.z as $real);
        let vertex = |&v: &[f32; 3]| vector((glam::Vec3::from(v).as_dvec3() - center) * scale);
        let shape = TriMesh::new($mesh.vertices.iter().map(vertex).collect(), $mesh.triangles.clone()).unwrap();
        let ball = Ball::new(RADIUS as $real);
        let casts: Vec<_> = $casts.iter().map(|cast| (vector(cast.origin), vector(cast.direction))).collect();
        let options = ShapeCastOptions { compute_impact_geometry_on_penetration: false, ..Default::default() };
        Box::new(move |index: usize| {
            let (origin, direction) = casts[index];
            let pose = Pose::from_translation(origin);
            let hit = cast_shapes(&Pose::IDENTITY, Vector::ZERO, &shape, &pose, direction, &ball, options);
            hit.unwrap().map(|hit| f64::from(hit.time_of_impact))
        })
    }};
}

/// A triangle's box, wide enough for a sphere's center.
struct Inflated(Aabb);

impl obvhs::Boundable for Inflated {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Distance by which rounding in f32 moves a box or a ray.
const SLACK: f64 = 1e-5;

/// The obvious implementation: the binary tree of obvhs over inflated boxes, up to eight triangles in a leaf, its own
/// loop, and the exact test of every triangle in the leaves that it comes to.
fn plain<'a>(scene: &Scene, casts: &'a [Cast]) -> Engine<'a> {
    let triangles: Vec<Triangle> = scene.triangles().collect();
    let inflated = |triangle: &Triangle| {
        let [a, b, c] = *triangle;
        let reach = DVec3::splat(RADIUS + SLACK);
        let (min, max) = (a.min(b).min(c) - reach, a.max(b).max(c) + reach);
        Inflated(Aabb { min: min.as_vec3a(), max: max.as_vec3a() })
    };
    let boxes: Vec<Inflated> = triangles.iter().map(inflated).collect();
    let settings = BvhBuildParams { max_prims_per_leaf: 8, ..BvhBuildParams::medium_build() };
    let mut time = std::time::Duration::ZERO;
    let tree = build_bvh2(&boxes, settings, &mut time);
    let triangles: Vec<Triangle> = tree.primitive_indices.iter().map(|&index| triangles[index as usize]).collect();
    Box::new(move |index| {
        let Cast { origin, direction } = casts[index];
        let motion = Motion { origin, direction, radius: RADIUS };
        let mut first = f64::INFINITY;
        let ray = obvhs::ray::Ray::new(origin.as_vec3a(), direction.as_vec3a(), 0.0, f32::INFINITY);
        tree.ray_traverse(ray, &mut obvhs::ray::RayHit::none(), |_, triangle| {
            match narrow::first_contact(&motion, &triangles[triangle], first) {
                Some(distance) => {
                    first = distance;
                    (distance + SLACK) as f32
                }
                None => f32::INFINITY,
            }
        });
        (first < f64::INFINITY).then_some(first)
    })
}

fn peers() {
    println!(
        "Against a plain loop over obvhs's tree and parry3d 0.31: casts of a sphere of radius {RADIUS}, one thread, a"
    );
    println!("sixth of them grazing; medians of {ROUNDS} rounds in which all take turns\n");
    println!(
        "{:12} {:>9}  {:12} {:>12} {:>9} {:>7} {:>7} {:>12}",
        "mesh", "triangles", "engine", "casts/s", "ratio", "missed", "false", "worst time"
    );
    let sizes: &[f64] = if *QUICK { &[1e3] } else { &[1e3, 1e4, 1e5, 1e6] };
    for &triangles in sizes {
        engines("globe", &mesh_of(triangles));
    }
    if let Some(directory) = shared("objects") {
        let real: &[&str] = if *QUICK { &["bowl"] } else { &["bowl", "wristwatch"] };
        for name in real {
            engines(name, &palpate::mesh::obj::read(&directory.join(format!("{name}.obj"))).unwrap());
        }
    }
    println!(
        "\nratio: how many times as long as palpate takes. missed, false: contacts lost or made up; worst time: largest"
    );
    println!("error of a contact's time. Wherever the engines disagree, f64 over all triangles decides.\n");
}

/// Rounds in which all engines take turns.
const ROUNDS: usize = 21;

fn engines(name: &str, mesh: &Mesh) {
    let scene = Scene::new(mesh, 10.0).unwrap();
    let casts = casts(&scene, if *QUICK { 600 } else { 12_000 });
    let ours = |index: usize| scene.first_contact(casts[index].origin, casts[index].direction, RADIUS);
    let engines: [(&str, Engine<'_>); 4] = [
        ("palpate", Box::new(ours)),
        ("plain obvhs", plain(&scene, &casts)),
        ("parry3d f32", parry!(parry3d, f32, mesh, casts)),
        ("parry3d f64", parry!(parry3d_f64, f64, mesh, casts)),
    ];
    let times: [Vec<Option<f64>>; 4] = engines.each_ref().map(|(_, engine)| (0..casts.len()).map(engine).collect());
    let mut turns = engines.each_ref().map(|(_, engine)| {
        let mut next = 0;
        let (engine, casts) = (engine, casts.len());
        move |items: usize| {
            for _ in 0..items {
                next = (next + 1) % casts;
                black_box(engine(black_box(next)));
            }
        }
    });
    let paired = paired(ROUNDS, 0.1, &mut turns.each_mut().map(|turn| turn as &mut dyn FnMut(usize)));
    let truth = truth(&scene, &casts, times.each_ref().map(Vec::as_slice));
    for (index, (engine, _)) in engines.iter().enumerate() {
        let [missed, false_contacts, worst] = compare(&truth, &times[index]);
        let (count, rate, ratio) = (mesh.triangles.len(), 1.0 / paired.seconds[index], paired.ratios[index]);
        println!(
            "{name:12} {count:>9}  {engine:12} {rate:>12.0} {ratio:>8.2}x {missed:>7} {false_contacts:>7} {worst:>12.1e}"
        );
    }
}

/// The correct results: ours where all agree on contact or none and, to 1e-9, on its time (parry3d f32 only on
/// contact); else the earliest contact over all triangles.
fn truth(scene: &Scene, casts: &[Cast], engines: [&[Option<f64>]; 4]) -> Vec<Option<f64>> {
    let triangles: Vec<Triangle> = scene.triangles().collect();
    let brute = |cast: &Cast| {
        let motion = Motion { origin: cast.origin, direction: cast.direction, radius: RADIUS };
        let contact = |triangle| narrow::first_contact(&motion, triangle, f64::INFINITY);
        triangles.iter().filter_map(contact).min_by(f64::total_cmp)
    };
    let agree = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() < 1e-9,
        (a, b) => a == b,
    };
    let decide = |(index, cast): (usize, &Cast)| {
        let [ours, plain, single, double] = engines.map(|times| times[index]);
        let all = agree(ours, plain) && agree(ours, double) && single.is_some() == ours.is_some();
        if all { ours } else { brute(cast) }
    };
    casts.iter().enumerate().map(decide).collect()
}

fn compare(truth: &[Option<f64>], times: &[Option<f64>]) -> [f64; 3] {
    let mut result = [0.0; 3];
    for (truth, time) in truth.iter().zip(times) {
        match (truth, time) {
            (Some(truth), Some(time)) => result[2] = f64::max(result[2], (truth - time).abs()),
            (Some(_), None) => result[0] += 1.0,
            (None, Some(_)) => result[1] += 1.0,
            (None, None) => {}
        }
    }
    result
}

fn shared(folder: &str) -> Option<PathBuf> {
    let shared = std::env::var_os("PALPATE_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let directory = shared.join(folder);
    if directory.is_dir() {
        return Some(directory);
    }
    println!("SKIPPED: {} is not there (set PALPATE_SHARED)", directory.display());
    None
}

fn speed_against_error() {
    println!("Speed against error, on the reference casts (1,400 a mesh, computed in quad precision)\n");
    println!(
        "{:12} {:24} {:>12} {:>7} {:>7} {:>14}",
        "mesh", "narrow phase", "casts/s", "missed", "false", "largest error"
    );
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data");
    let mut meshes = vec![(own, "slivers")];
    if let Some(directory) = shared("reference") {
        meshes.extend(["paperclip", "winebottle", "scissors"].map(|name| (directory.clone(), name)));
    }
    for (directory, name) in meshes {
        let mesh = palpate::mesh::obj::read(&directory.join(format!("{name}.obj"))).unwrap();
        let casts = known::read(&directory.join(format!("{name}.casts.csv")));
        let scene = Scene::as_is(&mesh).unwrap();
        let surface = scene.surface();
        row(name, "f32 after f32 reject", &casts, precision::single_after_reject, surface);
        row(name, "f64", &casts, precision::double_without_reject, surface);
        row(name, "f64 after f32 reject", &casts, Surface::first_contact, surface);
    }
    println!();

    fn row(
        name: &str,
        phase: &str,
        casts: &[known::Cast],
        first_contact: impl Fn(&Surface, DVec3, DVec3, f64) -> Option<f64>,
        surface: &Surface,
    ) {
        let radius = f64::from(0.15_f32);
        let contact = |cast: &known::Cast| first_contact(surface, cast.origin, cast.direction, radius);
        let (rate, times) = measure(casts, 3, contact);
        let sets = known::agreement(casts, &times);
        let missed: usize = sets.iter().map(|set| set.missed).sum();
        let false_contacts: usize = sets.iter().map(|set| set.false_contacts).sum();
        let error = sets.iter().map(|set| set.largest_error).fold(0.0, f64::max);
        println!("{name:12} {phase:24} {rate:>12.0} {missed:>7} {false_contacts:>7} {error:>14.1e}");
    }
}

fn growth() {
    println!("How the cost grows: the same shape in 1 k to 1 M triangles\n");
    println!("{:>9} {:>14} {:>14} {:>9}", "triangles", "scene built in", "approaches/s", "against 1 k");
    let mut first = None;
    let (sizes, count): (&[f64], usize) = if *QUICK { (&[1e3], 300) } else { (&[1e3, 1e4, 1e5, 1e6], 30_000) };
    for &triangles in sizes {
        let mesh = mesh_of(triangles);
        let start = clock();
        let scene = Scene::new(&mesh, 10.0).unwrap();
        let built = clock() - start;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let probe = Probe::default();
        let approaches: Vec<Approach> =
            (0..count).map(|_| Approach::draw(&mut rng, scene.bounds(), probe.tilt)).collect();
        let (rate, _) =
            measure(&approaches, 3, |approach| approach.full_distances(&scene, &probe).map(|distances| distances[0]));
        let against = *first.get_or_insert(rate) / rate;
        println!("{:>9} {built:>13.3}s {rate:>14.0} {against:>8.2}x", mesh.triangles.len());
    }
    println!();
}

fn real_objects() {
    let touches = if *QUICK { 200 } else { 21_000 };
    let settings: Settings = Origin { touches, ..Origin::default() }.into();
    println!("Ten real objects, {touches} full touches of each, all threads\n");
    let Some(directory) = shared("objects") else { return };
    let sources = [directory.to_string_lossy().into_owned()];
    let objects = palpate::mesh::source::objects(&sources).unwrap();
    let output = tempfile::tempdir().unwrap();
    let summary = capture::capture(&objects, &settings, output.path(), &()).unwrap();
    println!("{:12} {:>11} {:>7} {:>14}", "object", "approaches", "share", "approaches/s");
    for object in &summary.objects {
        let share = 100.0 * object.touches as f64 / object.approaches as f64;
        println!(
            "{:12} {:>11} {share:>6.1}% {:>14.0}",
            object.name,
            object.approaches,
            object.approaches as f64 / object.seconds
        );
    }
    println!("{:12} {:>11} in {:.2} s\n", "all", summary.approaches(), summary.seconds);
}
