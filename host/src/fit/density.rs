//! Likelihood of contact times: tables of densities, smoothed by the noise of the contacts.
//!
//! A full touch is two numbers, the curvature κ = t1 − 2·t2 + t3 and the signed slope t3 − t1. Independent noise σ of the
//! three times is noise of √6·σ on the one and √2·σ on the other, and the two are not correlated. A touch with two
//! contacts is one number, their difference, with noise √2·σ.
//!
//! Each table is a kernel estimate from simulated touches: every touch adds a Gaussian of the noise's width, which grows
//! with the distance from 0, where touches are rare and shapes smooth. Cells grow likewise, so that one table holds flat
//! faces (κ = 0 but for the noise) and the farthest edges. Tables are made for steps of σ as they are needed, and read with
//! interpolation; what a candidate probe does to times (factor, offsets) is undone before a table is read.

use super::candidate::{Candidate, Kept, NOISE};
use super::late::Late;
use crate::random::{self, Purpose};
use palpate_shared::Touch;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Standard deviations of the tables begin at the least of [`NOISE`]: how much larger each is than the one before, and how
/// many there are.
const RATIO: f64 = 1.3;
pub(super) const LEVELS: usize = 22;
/// By how much of its distance from 0 a simulated touch is smoothed.
const SMOOTHING: f64 = 0.03;
/// Growth of cells with the distance from 0, as a share of it.
const GROWTH: f64 = 0.02;
/// Cells to a standard deviation near 0.
const CELLS: f64 = 2.0;
/// Reach of a kernel, in standard deviations.
const REACH: f64 = 3.0;

/// Simulated approaches that are kept as they are.
const SOME: usize = 4_000;

/// Observation of a touch: which fingers touched, and how far apart in time, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Observed {
    /// Bit i: finger i touched.
    pub(super) fingers: u8,
    /// κ of a full touch; of a touch with two contacts the later finger's time less the earlier one's, counted along the
    /// row; else 0.
    pub(super) first: f64,
    /// The signed slope of a full touch, else 0.
    pub(super) second: f64,
}

/// All three fingers.
pub(super) const FULL: u8 = 0b111;
/// The first and the third finger.
pub(super) const OUTER: u8 = 0b101;

impl Observed {
    pub(super) fn of(touch: &Touch) -> Self {
        Self::of_times(touch.times().map(|time| time.micros().map(|micros| f64::from(micros) / 1e3)))
    }

    /// Of contact times on any common clock, in milliseconds.
    fn of_times(times: [Option<f64>; 3]) -> Self {
        let (fingers, first, second) = match times {
            [Some(a), Some(b), Some(c)] => (FULL, a - 2.0 * b + c, c - a),
            [Some(a), Some(b), None] => (0b011, b - a, 0.0),
            [None, Some(b), Some(c)] => (0b110, c - b, 0.0),
            [Some(a), None, Some(c)] => (OUTER, c - a, 0.0),
            [a, b, c] => (u8::from(a.is_some()) | u8::from(b.is_some()) << 1 | u8::from(c.is_some()) << 2, 0.0, 0.0),
        };
        Self { fingers, first, second }
    }

    /// Number of fingers that touched.
    pub(super) fn contacts(self) -> u32 {
        self.fingers.count_ones()
    }
}

/// Cells along one axis, whose width is constant near 0 and grows with the distance from it.
#[derive(Clone, Debug)]
struct Axis {
    width: f64,
    /// Cells to either side of 0.
    half: usize,
}

impl Axis {
    fn new(deviation: f64, farthest: f64) -> Self {
        let width = deviation / CELLS;
        let half = ((GROWTH * farthest / width).asinh() / GROWTH).ceil() as usize + 1;
        Self { width, half }
    }

    fn cells(&self) -> usize {
        2 * self.half + 1
    }

    /// Where x is, in cells from the first.
    fn position(&self, x: f64) -> f64 {
        (GROWTH * x / self.width).asinh() / GROWTH + self.half as f64
    }

    fn value(&self, cell: usize) -> f64 {
        (GROWTH * (cell as f64 - self.half as f64)).sinh() / GROWTH * self.width
    }

    /// The first of the two cells that x lies between, and how far it is from the first to the second; none outside.
    fn between(&self, x: f64) -> Option<(usize, f64)> {
        let position = self.position(x);
        let cell = position.floor();
        (cell >= 0.0 && position < (self.cells() - 1) as f64).then_some((cell as usize, position - cell))
    }

    /// The kernel of a sample at x: its first cell, and its density at this and the following cells.
    fn kernel(&self, x: f64, deviation: f64, values: &[f64], kernel: &mut Vec<f32>) -> usize {
        let width = deviation.hypot(SMOOTHING * x);
        let last = (self.cells() - 1) as f64;
        let cell = |x: f64| self.position(x).clamp(0.0, last);
        let (from, to) = (cell(x - REACH * width).ceil() as usize, cell(x + REACH * width).floor() as usize);
        let height = 1.0 / (width * std::f64::consts::TAU.sqrt());
        kernel.clear();
        let density = |value: &f64| (height * (-0.5 * ((value - x) / width).powi(2)).exp()) as f32;
        kernel.extend(values[from..=to.max(from)].iter().map(density));
        from
    }
}

/// A density of one number.
#[derive(Clone, Debug)]
pub(super) struct Line {
    axis: Axis,
    density: Vec<f32>,
}

impl Line {
    pub(super) fn new(samples: &[f32], deviation: f64) -> Self {
        let farthest = samples.iter().fold(1.0_f64, |most, x| most.max(f64::from(x.abs())));
        let axis = Axis::new(deviation, 1.2 * farthest + 4.0 * deviation);
        let values: Vec<f64> = (0..axis.cells()).map(|cell| axis.value(cell)).collect();
        let (mut density, mut kernel) = (vec![0.0; axis.cells()], Vec::new());
        for &x in samples {
            let from = axis.kernel(x.into(), deviation, &values, &mut kernel);
            density[from..].iter_mut().zip(&kernel).for_each(|(cell, height)| *cell += height);
        }
        let share = 1.0 / samples.len().max(1) as f32;
        density.iter_mut().for_each(|cell| *cell *= share);
        Self { axis, density }
    }

    pub(super) fn at(&self, x: f64) -> f64 {
        let Some((cell, share)) = self.axis.between(x) else { return 0.0 };
        let [one, other] = [cell, cell + 1].map(|cell| f64::from(self.density[cell]));
        one + share * (other - one)
    }
}

/// A density of two numbers.
#[derive(Clone, Debug)]
struct Plane {
    axes: [Axis; 2],
    /// Row by row: cells of the second axis for each of the first.
    density: Vec<f32>,
}

impl Plane {
    /// Of these samples and their mirror images, whose second number has the other sign.
    fn new(samples: &[[f32; 2]], deviation: f64) -> Self {
        let deviations = [6.0_f64.sqrt() * deviation, 2.0_f64.sqrt() * deviation];
        let axes = [0, 1].map(|axis| {
            let farthest = samples.iter().fold(1.0_f64, |most, sample| most.max(f64::from(sample[axis].abs())));
            Axis::new(deviations[axis], 1.2 * farthest + 4.0 * deviations[axis])
        });
        let values = [0, 1]
            .map(|axis: usize| -> Vec<f64> { (0..axes[axis].cells()).map(|cell| axes[axis].value(cell)).collect() });
        let columns = axes[1].cells();
        let mut density = vec![0.0_f32; axes[0].cells() * columns];
        let (mut down, mut across) = (Vec::new(), Vec::new());
        for &[x, y] in samples {
            let row = axes[0].kernel(x.into(), deviations[0], &values[0], &mut down);
            for y in [y, -y] {
                let column = axes[1].kernel(y.into(), deviations[1], &values[1], &mut across);
                for (row, height) in (row..).zip(&down) {
                    let cells = density[row * columns + column..].iter_mut();
                    cells.zip(&across).for_each(|(cell, own)| *cell += height * own);
                }
            }
        }
        let share = 0.5 / samples.len().max(1) as f32;
        density.iter_mut().for_each(|cell| *cell *= share);
        Self { axes, density }
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        let [Some((row, down)), Some((column, across))] = [self.axes[0].between(x), self.axes[1].between(y)] else {
            return 0.0;
        };
        let columns = self.axes[1].cells();
        let at = |row: usize| {
            let first = row * columns + column;
            let [one, other] = [first, first + 1].map(|cell| f64::from(self.density[cell]));
            one + across * (other - one)
        };
        let [one, other] = [at(row), at(row + 1)];
        one + down * (other - one)
    }
}

/// The tables of one noise.
#[derive(Debug)]
struct Level {
    full: Plane,
    /// Two neighboring fingers: alone, and of full touches.
    neighbors: [Line; 2],
    /// The outer fingers: alone, and of full touches.
    outer: [Line; 2],
}

/// Simulated touches of one object, and the densities of their times.
#[derive(Debug)]
pub(super) struct Densities {
    /// The object's name.
    pub(super) name: String,
    /// κ and slope.
    full: Vec<[f32; 2]>,
    /// The middle finger's time less the outer one's.
    neighbors: [Vec<f32>; 2],
    outer: [Vec<f32>; 2],
    /// The share of each set of fingers among all approaches, a set and its mirror image alike.
    pub(super) shares: [f64; 8],
    /// Contact times of some of the approaches, in milliseconds.
    some: Vec<[Option<f64>; 3]>,
    levels: [OnceLock<Level>; LEVELS],
    /// The same as a stroke makes them, if the recordings have one.
    pub(super) late: Option<Late>,
}

/// The share of each set of fingers, a set and its mirror image alike, of these counts among `all` approaches.
pub(super) fn mirrored(counts: &[u32; 8], all: usize) -> [f64; 8] {
    let mirror = |fingers: usize| fingers & 0b010 | (fingers & 1) << 2 | fingers >> 2;
    let all = all.max(1) as f64;
    std::array::from_fn(|fingers| f64::from(counts[fingers] + counts[mirror(fingers)]) / (2.0 * all))
}

impl Densities {
    /// Of simulated approaches, whether they touched or not, that no stroke ended; and the recordings' stroke as a time in
    /// milliseconds.
    pub(super) fn new(name: &str, touches: &[Touch], window: Option<f64>) -> Self {
        let (mut full, mut neighbors, mut outer) = (Vec::new(), [Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
        let mut counts = [0_u32; 8];
        for observed in touches.iter().map(Observed::of) {
            counts[usize::from(observed.fingers)] += 1;
            let Observed { first, second, .. } = observed;
            match observed.fingers {
                FULL => {
                    full.push([first as f32, second as f32]);
                    // κ is the sum, the slope the difference of what the outer fingers are later than the middle one.
                    neighbors[1].extend([(first + second) / -2.0, (first - second) / -2.0].map(|late| late as f32));
                    outer[1].extend([second as f32, -second as f32]);
                }
                0b011 => neighbors[0].push(first as f32),
                0b110 => neighbors[0].push(-first as f32),
                OUTER => outer[0].extend([first as f32, -first as f32]),
                _ => {}
            }
        }
        Self {
            name: name.into(),
            full,
            neighbors,
            outer,
            shares: mirrored(&counts, touches.len()),
            some: (touches.iter().take(SOME))
                .map(|touch| touch.times().map(|time| time.micros().map(|micros| f64::from(micros) / 1e3)))
                .collect(),
            levels: std::array::from_fn(|_| OnceLock::new()),
            late: window.map(|window| Late::new(touches, window)),
        }
    }

    /// Touches as a candidate probe would record them, made of some of the simulated ones.
    pub(super) fn redrawn(&self, candidate: &Candidate, kept: Kept) -> Vec<Observed> {
        let mut random = random::generator(1, Purpose::Fit, &self.name, 0);
        let Candidate { factor, late, noise, missed } = *candidate;
        let again = |times: &[Option<f64>; 3]| {
            let times: [Option<f64>; 3] = std::array::from_fn(|finger| {
                let (chance, normal): (f64, f64) = (random.random(), StandardNormal.sample(&mut random));
                let time = times[finger].filter(|_| chance >= missed[finger])?;
                Some(factor * time + late[finger] + noise * normal)
            });
            let first = times.iter().flatten().copied().fold(f64::INFINITY, f64::min);
            let end = self.late.as_ref().map_or(f64::INFINITY, |late| first + late.window());
            Observed::of_times(times.map(|time| time.filter(|time| *time <= end)))
        };
        let is_kept = |observed: &Observed| match kept {
            Kept::All => true,
            Kept::Contacts => observed.fingers != 0,
            Kept::Full => observed.fingers == FULL,
        };
        self.some.iter().map(again).filter(is_kept).collect()
    }

    /// Makes the tables of usual noise, side by side; those of other noise are made when they are needed.
    pub(super) fn prepare(&self) {
        (5..17).into_par_iter().for_each(|level| _ = self.level(level));
    }

    fn level(&self, level: usize) -> &Level {
        self.levels[level].get_or_init(|| {
            let deviation = deviation_of(level);
            let pair = 2.0_f64.sqrt() * deviation;
            let lines = |samples: &[Vec<f32>; 2]| [0, 1].map(|which: usize| Line::new(&samples[which], pair));
            Level {
                full: Plane::new(&self.full, deviation),
                neighbors: lines(&self.neighbors),
                outer: lines(&self.outer),
            }
        })
    }

    /// The densities under this noise, in milliseconds; noise that no table exists for counts as the nearest.
    pub(super) fn under(&self, noise: f64) -> Smoothed<'_> {
        let position = ((noise / NOISE[0]).ln() / RATIO.ln()).clamp(0.0, (LEVELS - 1) as f64);
        let level = (position.floor() as usize).min(LEVELS - 2);
        let levels = [self.level(level), self.level(level + 1)];
        Smoothed { level, levels, share: position - level as f64, late: self.late.as_ref() }
    }
}

/// The standard deviation of a level, in milliseconds.
fn deviation_of(level: usize) -> f64 {
    NOISE[0] * RATIO.powi(i32::try_from(level).unwrap_or(0))
}

/// Densities under a noise between two tables'.
#[derive(Clone, Copy)]
pub(super) struct Smoothed<'a> {
    /// The lower level.
    level: usize,
    levels: [&'a Level; 2],
    share: f64,
    late: Option<&'a Late>,
}

impl Smoothed<'_> {
    fn between(&self, at: impl Fn(&Level) -> f64) -> f64 {
        let [one, other] = self.levels.map(at);
        one + self.share * (other - one)
    }

    /// Of κ and slope of a full touch, per square millisecond.
    pub(super) fn full(&self, curvature: f64, slope: f64) -> f64 {
        self.between(|level| level.full.at(curvature, slope))
    }

    /// Of what the middle finger is later than an outer one, per millisecond, if only these two touch and if all do.
    pub(super) fn neighbors(&self, late: f64) -> [f64; 2] {
        [0, 1].map(|which: usize| self.between(|level| level.neighbors[which].at(late)))
    }

    /// The same of the outer fingers.
    pub(super) fn outer(&self, late: f64) -> [f64; 2] {
        [0, 1].map(|which: usize| self.between(|level| level.outer[which].at(late)))
    }

    /// As [`Late::density`], 0 without a stroke.
    pub(super) fn late(&self, window: f64, which: usize, apart: f64) -> f64 {
        let Some(late) = self.late else { return 0.0 };
        let at = |level: usize| late.density(window, level, 2.0_f64.sqrt() * deviation_of(level), which, apart);
        let [one, other] = [self.level, self.level + 1].map(at);
        one + self.share * (other - one)
    }
}
