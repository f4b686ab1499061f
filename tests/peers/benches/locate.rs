//! Objects on a table, located by Palpate and by a particle filter of the literature's kind: tempered sequential Monte Carlo for
//! each object, over (placement, x, y, yaw), on the same maps, hand and noise. Prints approaches to a posterior of .99, wrong names,
//! and the time of an approach with the choice of the next one.

use palpate::locate::{self, Approach, Hand, Maps, Real, Settings, Standing, Surface, Truth, World, locating};
use palpate::probe::approach::Probe;
use palpate::shared::Touch;
use palpate::shared::format::Length;
use palpate::touches::{Dataset, ObjectTouches, Origin, Source};
use palpate::with;
use palpate_onboard::Verdict;
use palpate_peers::{QUICK, clock};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::error::Error;
use std::f64::consts::TAU;

const PARTICLES: usize = 3_000;
/// Noise of heights and of maps, in millimeters.
const NOISE: f64 = 0.8;
const OUTLIERS: f64 = 0.05;
const LOST: f64 = 0.03;
/// Approaches that are compared to choose the next, and hypotheses that they are compared on.
const CANDIDATES: usize = 60;
const HYPOTHESES: f64 = 120.0;
const MOST: usize = 25;

fn main() -> Result<(), Box<dyn Error>> {
    let shared = std::env::var("PALPATE_SHARED").unwrap_or_else(|_| "../../../shared".into());
    let folder = format!("{shared}/objects");
    let source = if std::path::Path::new(&folder).exists() { folder } else { "builtin".into() };
    let mut objects = palpate::mesh::source::objects(&[source.into()])?;
    for object in &mut objects {
        object.millimeters = Some(1.0);
        let length = object.instances().filter_map(|instance| object.true_length(instance)).fold(0.0, f64::max);
        object.millimeters = Some(100.0 / length);
    }
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0));
    let standing = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, &())?;
    let settings = Settings::default();
    let surfaces = locate::learn(&taught(&standing, &probe, if *QUICK { 4_000 } else { 60_000 }), &settings)?;
    let names: Vec<String> = standing.iter().map(|object| object.name.clone()).collect();
    let bytes = locate::write(&surfaces, &names, &probe, &settings)?;
    let maps = Maps::new(&bytes).map_err(|error| error.to_string())?;
    let hand = Hand::of(&maps).ok_or("no hand")?;
    let world = World { standing: &standing, probe: &probe, real: Real::default(), range: 29.0, seed: 1 };
    let sequences = if *QUICK { 2 } else { 5 * standing.len() as u64 };
    // Approaches, wrong names, sequences without a name, seconds.
    let mut results = [(0, 0, 0, 0.0); 2];
    for index in 0..sequences {
        let mut locator = locating(maps, maps.stopping(), None);
        locator.begin(index as u32 + 1);
        let mut filter = Filter::new(&surfaces, standing.len(), settings.range, index);
        let mut ours = |touch: &Touch| {
            let name = match locator.push(hand.seen(touch).unwrap_or_default()) {
                Verdict::Recognized { object, .. } => Some(usize::from(object)),
                _ => None,
            };
            (name, locator.choose(&hand, 60_000, 10))
        };
        let mut theirs = |touch: &Touch| {
            filter.push(Seen::of(touch, &probe));
            (filter.name(0.99), filter.choose(&probe))
        };
        let followers: [&mut dyn FnMut(&Touch) -> (Option<usize>, Approach); 2] = [&mut ours, &mut theirs];
        for (follower, (approaches, wrong, undecided, seconds)) in followers.into_iter().zip(&mut results) {
            let mut drawn = world.draw(index);
            let (mut at, mut name) = (Approach::default(), None);
            for _ in 0..MOST {
                let touch = drawn.press(at);
                let start = clock();
                (name, at) = follower(&touch);
                *seconds += clock() - start;
                *approaches += 1;
                if name.is_some() {
                    break;
                }
            }
            *wrong += u64::from(name.is_some_and(|name| name != drawn.truth.object));
            *undecided += u64::from(name.is_none());
        }
    }
    for ((approaches, wrong, undecided, seconds), name) in results.into_iter().zip(["palpate", "a particle filter"]) {
        println!(
            "{name}: {:.2} approaches, {wrong} wrong and {undecided} undecided of {sequences}, {:.1} ms an approach",
            approaches as f64 / sequences as f64,
            seconds * 1e3 / approaches as f64
        );
    }
    let [ours, theirs] = results.map(|(approaches, _, _, seconds)| seconds / approaches as f64);
    println!("the particle filter's time over Palpate's: {:.2}", theirs / ours);
    Ok(())
}

/// Touches of each placement, at random about its box.
fn taught(standing: &[Standing], probe: &Probe, touches: usize) -> Dataset {
    let real = Real { lost: 0.0, height: 0.2, ..Real::default() };
    let world = World { standing, probe, real, range: 0.0, seed: 77 };
    let of = |(object, stands): (usize, &Standing)| {
        let (mut sources, mut all) = (Vec::new(), Vec::new());
        let mut drawn = Vec::new();
        for (placement, (scene, share)) in stands.placements.iter().enumerate() {
            let truth = Truth { object, placement, place: [0.0; 2], yaw: 0.0 };
            drawn.push((world.draw((object * 1_000 + placement) as u64).at(truth), scene.bounds()));
            let millionths = (share * 1e6) as u32;
            sources.push(Source::Placement { instance: None, placement: placement.to_string(), millionths });
        }
        for _ in 0..touches {
            for (drawn, [low, high]) in &mut drawn {
                let at = drawn.anywhere([0.0; 2], 1.0);
                let scaled = |share: i32, side: f64| (f64::from(share) * (side / 2.0 + 5.0)) as i32;
                let (x, y) = (scaled(at.x, high.x - low.x), scaled(at.y, high.y - low.y));
                all.push(drawn.press(Approach { x, y, ..at }));
            }
        }
        ObjectTouches::in_turn(stands.name.clone(), all, &sources, 0)
    };
    let objects = standing.iter().enumerate().map(of).collect();
    let origin = Origin { unit: Length::Millimeter, probe: *probe, pose: true, approaches: true, ..Origin::default() };
    Dataset { origin: Some(origin), ..Dataset::new(objects) }
}

/// Places and heights of an approach, in millimeters; no height down to the limit.
struct Seen {
    at: [[f64; 2]; 3],
    heights: [Option<f64>; 3],
    limit: f64,
}

impl Seen {
    fn of(touch: &Touch, probe: &Probe) -> Self {
        let [x, y, z] = touch.position().map_or([0; 3], |position| position.micrometers).map(|at| f64::from(at) / 1e3);
        let row = touch.pose().map_or([0; 3], |pose| pose.alignment).map(|axis| f64::from(axis) / 32_767.0);
        let at = [-1.0, 0.0, 1.0].map(|finger| finger * probe.spacing).map(|way| [x + way * row[0], y + way * row[1]]);
        let heights = touch.times().map(|time| Some(z - f64::from(time.micros()?) * 1e-6 * probe.speed));
        Self { at, heights, limit: z - probe.stroke.unwrap_or(f64::INFINITY) }
    }
}

#[derive(Clone, Copy)]
struct Particle {
    surface: usize,
    x: f64,
    y: f64,
    yaw: f64,
    /// Logarithm of the likelihood of all touches but the last.
    likely: f64,
}

struct Filter<'s> {
    surfaces: &'s [Surface],
    range: f64,
    particles: Vec<Vec<Particle>>,
    /// Logarithm of the evidence for each object.
    evidence: Vec<f64>,
    seen: Vec<Seen>,
    random: ChaCha8Rng,
}

impl<'s> Filter<'s> {
    fn new(surfaces: &'s [Surface], objects: usize, range: f64, seed: u64) -> Self {
        let (seen, random) = (Vec::new(), ChaCha8Rng::seed_from_u64(seed));
        let mut filter = Self { surfaces, range, particles: Vec::new(), evidence: vec![0.0; objects], seen, random };
        for object in 0..objects {
            let fresh = (0..PARTICLES).map(|_| filter.fresh(object)).collect();
            filter.particles.push(fresh);
        }
        filter
    }

    fn uniform(&mut self, half: f64) -> f64 {
        (2.0 * self.random.random::<f64>() - 1.0) * half
    }

    fn normal(&mut self) -> f64 {
        let (radius, angle): (f64, f64) = (self.random.random(), self.random.random());
        (-2.0 * (1.0 - radius).ln()).sqrt() * (TAU * angle).cos()
    }

    /// A particle from the prior.
    fn fresh(&mut self, object: usize) -> Particle {
        let mut left = self.random.random::<f64>();
        let own = self.surfaces.iter().enumerate().filter(|(_, surface)| surface.object == object);
        let mut surface = 0;
        for (index, own) in own {
            surface = index;
            left -= own.share;
            if left < 0.0 {
                break;
            }
        }
        let (x, y, yaw) = (self.uniform(self.range), self.uniform(self.range), self.uniform(TAU / 2.0));
        Particle { surface, x, y, yaw, likely: 0.0 }
    }

    /// Height that a particle expects at a place, between the four cells about it.
    fn height(&self, particle: &Particle, [x, y]: [f64; 2]) -> f64 {
        let surface = &self.surfaces[particle.surface];
        let ((sin, cos), x, y) = (particle.yaw.sin_cos(), x - particle.x, y - particle.y);
        let [u, v] = [cos * x + sin * y, cos * y - sin * x].map(|place| place / surface.cell);
        let (i, j) = (u.floor(), v.floor());
        let [half_x, half_y] = surface.half.map(f64::from);
        if i < -half_x || j < -half_y || i >= half_x || j >= half_y {
            return 0.0;
        }
        let width = 2 * surface.half[0] as usize + 1;
        let at = (j + half_y) as usize * width + (i + half_x) as usize;
        let (heights, a, b) = (&surface.heights, u - i, v - j);
        (heights[at] * (1.0 - a) + heights[at + 1] * a) * (1.0 - b)
            + (heights[at + width] * (1.0 - a) + heights[at + width + 1] * a) * b
    }

    fn likely(&self, particle: &Particle, seen: &Seen) -> f64 {
        let gauss = |off: f64| 0.398_942 / NOISE * (-0.5 * (off / NOISE).powi(2)).exp();
        let of = |(at, met): (&[f64; 2], &Option<f64>)| {
            let height = self.height(particle, *at);
            let lost = if height > 0.3 { LOST } else { 0.0 };
            match met {
                Some(met) => (1.0 - OUTLIERS - lost) * gauss(met - height) + OUTLIERS / 100.0 + lost * gauss(*met),
                None => OUTLIERS + (1.0 - OUTLIERS) / (1.0 + (1.7 * (height - seen.limit) / NOISE).exp()),
            }
        };
        seen.at.iter().zip(&seen.heights).map(of).product::<f64>().max(1e-30).ln()
    }

    fn posteriors(&self) -> Vec<f64> {
        let most = self.evidence.iter().copied().fold(f64::MIN, f64::max);
        let shares: Vec<f64> = self.evidence.iter().map(|evidence| (evidence - most).exp()).collect();
        let all: f64 = shares.iter().sum();
        shares.into_iter().map(|share| share / all).collect()
    }

    fn name(&self, least: f64) -> Option<usize> {
        self.posteriors().into_iter().position(|posterior| posterior >= least)
    }

    fn push(&mut self, seen: Seen) {
        let posteriors = self.posteriors();
        self.seen.push(seen);
        for object in 0..posteriors.len() {
            if posteriors[object] < 1e-9 {
                self.evidence[object] -= 20.0;
            } else {
                let particles = std::mem::take(&mut self.particles[object]);
                self.particles[object] = self.tempered(object, particles);
            }
        }
    }

    /// Takes in the last touch in steps that leave two fifths of the particles effective, each with three moves.
    fn tempered(&mut self, object: usize, mut particles: Vec<Particle>) -> Vec<Particle> {
        let last = self.seen.len() - 1;
        let own = |filter: &Self, particle: &Particle| filter.likely(particle, &filter.seen[last]);
        let mut news: Vec<f64> = particles.iter().map(|particle| own(self, particle)).collect();
        let mut done = 0.0;
        while done < 1.0 {
            let most = news.iter().copied().fold(f64::MIN, f64::max);
            let weights = |step: f64| news.iter().map(move |new| (step * (new - most)).exp());
            let effective = |step| {
                let (sum, squares) = weights(step).fold((0.0, 0.0), |(sum, all), w| (sum + w, all + w * w));
                sum * sum / squares >= 0.4 * PARTICLES as f64
            };
            let (mut low, mut step) = (0.0, 1.0 - done);
            if !effective(step) {
                let mut high = step;
                for _ in 0..16 {
                    step = (low + high) / 2.0;
                    if effective(step) { low = step } else { high = step }
                }
                step = step.max(1e-3).min(1.0 - done);
            }
            let all: f64 = weights(step).sum();
            self.evidence[object] += (all / PARTICLES as f64).ln() + step * most;
            done += step;
            // Systematic resampling.
            let (mut passed, mut drawn) = (0.0, Vec::with_capacity(PARTICLES));
            let start = self.random.random::<f64>();
            for (weight, (particle, new)) in weights(step).zip(particles.iter().zip(&news)) {
                passed += weight;
                while drawn.len() < PARTICLES && (drawn.len() as f64 + start) * all < passed * PARTICLES as f64 {
                    drawn.push((*particle, *new));
                }
            }
            while drawn.len() < PARTICLES {
                drawn.push(drawn[0]);
            }
            for index in (0..PARTICLES).cycle().take(3 * PARTICLES) {
                let (before, new) = drawn[index];
                let Some(mut moved) = self.moved(object, before, &drawn) else { continue };
                moved.likely = self.seen[..last].iter().map(|seen| self.likely(&moved, seen)).sum();
                let gained = own(self, &moved);
                let better = moved.likely + done * gained - before.likely - done * new;
                if better >= 0.0 || self.random.random::<f64>() < better.exp() {
                    drawn[index] = (moved, gained);
                }
            }
            (particles, news) = drawn.into_iter().unzip();
        }
        particles.iter_mut().zip(news).for_each(|(particle, new)| particle.likely += new);
        particles
    }

    /// A particle near another, by the difference of two others, or from the prior; none outside of the range.
    fn moved(&mut self, object: usize, from: Particle, all: &[(Particle, f64)]) -> Option<Particle> {
        let kind = self.random.random::<f64>();
        if kind < 0.05 {
            return Some(self.fresh(object));
        }
        let mut to = from;
        if self.random.random::<f64>() < 0.3 {
            let [one, other] = [0; 2].map(|_| all[self.random.random_range(0..all.len())].0);
            if one.surface == other.surface {
                to.x += 0.7 * (one.x - other.x);
                to.y += 0.7 * (one.y - other.y);
                to.yaw += 0.7 * (one.yaw - other.yaw);
            }
        }
        let far = if kind < 0.4 {
            0.25
        } else if kind < 0.75 {
            1.0
        } else {
            4.0
        };
        to.x += far * self.normal();
        to.y += far * self.normal();
        to.yaw += 0.03 * far * self.normal();
        (to.x.abs() <= self.range && to.y.abs() <= self.range).then_some(to)
    }

    /// The approach with the most information about the object, and some about its pose.
    fn choose(&mut self, probe: &Probe) -> Approach {
        let mut drawn = Vec::new();
        for (object, posterior) in self.posteriors().into_iter().enumerate().filter(|(_, share)| *share > 1e-3) {
            let count = (6.0 + posterior * HYPOTHESES).min(60.0) as usize;
            for _ in 0..count {
                let particle = self.particles[object][self.random.random_range(0..PARTICLES)];
                drawn.push((object, posterior / count as f64, particle));
            }
        }
        let of_object = self.posteriors();
        let mut best = (f64::MIN, Approach::default());
        for _ in 0..CANDIDATES {
            let on = drawn[self.random.random_range(0..drawn.len())].2;
            let surface = &self.surfaces[on.surface];
            let [u, v] = surface.half.map(|half| f64::from(half) * surface.cell).map(|half| self.uniform(half));
            let (sin, cos) = on.yaw.sin_cos();
            let (x, y) = (on.x + cos * u - sin * v, on.y + sin * u + cos * v);
            let roll: u8 = self.random.random_range(0..128);
            let (row_sin, row_cos) = (f64::from(roll) / 256.0 * TAU).sin_cos();
            let heights = |particle: &Particle| {
                let met = [-1.0, 0.0, 1.0].map(|finger| {
                    let way = finger * probe.spacing;
                    self.height(particle, [x + way * row_cos, y + way * row_sin])
                });
                let limit = met.into_iter().fold(0.0, f64::max) - probe.stroke.unwrap_or(f64::INFINITY);
                met.map(|height| height.max(limit - 5.0 * f64::from(u8::from(height < limit))))
            };
            let met: Vec<[f64; 3]> = drawn.iter().map(|(_, _, particle)| heights(particle)).collect();
            let mut gain = 0.0;
            for (one, (object, weight, _)) in met.iter().zip(&drawn) {
                let (mut all, mut own) = (1e-9, 1e-9);
                for (other, (of, weight, _)) in met.iter().zip(&drawn) {
                    let squares: f64 = one.iter().zip(other).map(|(a, b)| ((a - b) / (1.2 * NOISE)).powi(2)).sum();
                    let alike = if squares < 40.0 { weight * (-0.25 * squares).exp() } else { 0.0 };
                    all += alike;
                    own += if of == object { alike } else { 0.0 };
                }
                gain += weight * ((own / of_object[*object] / all).ln() - 0.3 * all.ln());
            }
            if gain > best.0 {
                best = (gain, Approach { x: (x * 1e3) as i32, y: (y * 1e3) as i32, roll });
            }
        }
        best.1
    }
}
