//! Likelihood of contact times: tables of densities, smoothed by the noise of the contacts.
//!
//! A full touch is two numbers, the curvature κ = t1 − 2·t2 + t3 and the signed slope t3 − t1. Independent noise σ of the
//! three times is noise of √6·σ on the one and √2·σ on the other, and the two are not correlated. A touch with two
//! contacts is one number, their difference, with noise √2·σ.
//!
//! Each table is a kernel estimate from simulated touches: every touch adds a Gaussian of the noise's width, which grows
//! with the distance from 0, where touches are rare and shapes smooth. Cells grow likewise, so that one table holds flat
//! faces (κ = 0 except for noise) and the farthest edges. Tables are made for steps of σ as they are needed, and read with
//! interpolation; what a candidate probe does to times (factor, offsets) is undone before a table is read.

use super::candidate::{Hypothesis, NOISE};
use super::late::Late;
use super::line::{Axis, LEVELS, Line, RATIO, deviation_of};
use super::observed::{FULL, OUTER, Observed, mirrored};
use crate::random::{self, Purpose};
use palpate_shared::Touch;
use palpate_shared::format::Counted;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Simulated approaches that are kept as they are.
const SOME: usize = 4_000;

/// A density of two numbers.
#[derive(Clone, Debug)]
struct Plane {
    axes: [Axis; 2],
    /// Row by row: cells of the second axis for each of the first.
    density: Vec<f32>,
}

impl Plane {
    /// A density of these samples and their mirror images, whose second number has the other sign.
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
    /// Densities cut off by a stroke, if the recordings have one.
    pub(super) late: Option<Late>,
}

impl Densities {
    /// Densities of simulated approaches, with contact or without, that no stroke ended; and the recordings' stroke as a time in
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
                    // κ is the sum, the slope the difference, of the outer fingers' delays after the middle one.
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
    pub(super) fn redrawn(&self, candidate: &Hypothesis, kept: Counted) -> Vec<Observed> {
        let mut random = random::generator(1, Purpose::Fit, &self.name, 0);
        let Hypothesis { factor, late, noise, missed } = *candidate;
        let again = |times: &[Option<f64>; 3]| {
            let times: [Option<f64>; 3] = std::array::from_fn(|finger| {
                let (chance, normal): (f64, f64) = (random.random(), StandardNormal.sample(&mut random));
                let time = times[finger].filter(|_| chance >= missed[finger])?;
                Some(factor * time + late[finger] + noise * normal)
            });
            let first = times.iter().flatten().copied().fold(f64::INFINITY, f64::min);
            let end = self.late.as_ref().map_or(f64::INFINITY, |late| first + late.window);
            Observed::of_times(times.map(|time| time.filter(|time| *time <= end)))
        };
        let is_kept = |observed: &Observed| match kept {
            Counted::All => true,
            Counted::Contacts => observed.fingers != 0,
            Counted::Full => observed.fingers == FULL,
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

    /// Density of κ and slope of a full touch, per square millisecond.
    pub(super) fn full(&self, curvature: f64, slope: f64) -> f64 {
        self.between(|level| level.full.at(curvature, slope))
    }

    /// Density of how much later the middle finger is than an outer one, per millisecond, if only these two touch and if all do.
    pub(super) fn neighbors(&self, late: f64) -> [f64; 2] {
        [0, 1].map(|which: usize| self.between(|level| level.neighbors[which].at(late)))
    }

    /// Density of the difference between the outer fingers.
    pub(super) fn outer(&self, late: f64) -> [f64; 2] {
        [0, 1].map(|which: usize| self.between(|level| level.outer[which].at(late)))
    }

    /// [`Late::density`], 0 without a stroke.
    pub(super) fn late(&self, window: f64, which: usize, apart: f64) -> f64 {
        let Some(late) = self.late else { return 0.0 };
        let at = |level: usize| late.density(window, level, 2.0_f64.sqrt() * deviation_of(level), which, apart);
        let [one, other] = [self.level, self.level + 1].map(at);
        one + self.share * (other - one)
    }
}
