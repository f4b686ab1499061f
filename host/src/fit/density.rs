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

use super::candidate::NOISE;
use super::late::Late;
use super::line::{Axis, Kernel, LEVELS, Line, RATIO, deviation_of, interpolate};
use super::observed::{FULL, OUTER, Observed, mirrored};
use palpate_shared::Touch;
use rayon::prelude::*;
use std::sync::OnceLock;

/// A density of two numbers.
#[derive(Clone, Debug)]
struct Plane {
    axes: [Axis; 2],
    /// Row by row: cells of the second axis for each of the first.
    density: Vec<f32>,
}

impl Plane {
    /// A density of these samples and their mirror images, whose second number has the other sign; and that of the second
    /// number alone.
    fn new(samples: &[[f32; 2]], deviation: f64) -> (Self, Line) {
        let deviations = [6.0_f64.sqrt() * deviation, 2.0_f64.sqrt() * deviation];
        let axes = [0, 1].map(|axis| {
            let farthest = samples.iter().fold(1.0_f64, |farthest, sample| farthest.max(f64::from(sample[axis].abs())));
            Axis::new(deviations[axis], 1.2 * farthest + 4.0 * deviations[axis])
        });
        let values = axes.each_ref().map(Axis::values);
        let columns = axes[1].cells();
        let mut density = vec![0.0_f32; axes[0].cells() * columns];
        let mut second = Line::empty(axes[1].clone());
        let (mut down, mut across) = (Kernel::default(), Kernel::default());
        for &[x, y] in samples {
            axes[0].kernel(x.into(), deviations[0], &values[0], &mut down);
            axes[1].kernel(y.into(), deviations[1], &values[1], &mut across);
            let (row, down) = down.plain();
            for (column, across) in [across.plain(), across.mirrored()] {
                second.add((column, across));
                for (row, height) in (row..).zip(down) {
                    let cells = density[row * columns + column..].iter_mut();
                    cells.zip(across).for_each(|(cell, value)| *cell += height * value);
                }
            }
        }
        let per_sample = 0.5 / samples.len().max(1) as f32;
        density.iter_mut().for_each(|cell| *cell *= per_sample);
        (Self { axes, density }, second.scaled(2 * samples.len()))
    }

    /// The density at a point, interpolated between cells; 0 outside of the table.
    fn density(&self, x: f64, y: f64) -> f64 {
        let (Some((row, down)), Some((column, across))) = (self.axes[0].between(x), self.axes[1].between(y)) else {
            return 0.0;
        };
        let columns = self.axes[1].cells();
        let in_row = |row: usize| {
            let first = row * columns + column;
            interpolate(self.density[first].into(), self.density[first + 1].into(), across)
        };
        interpolate(in_row(row), in_row(row + 1), down)
    }
}

/// The tables of one noise.
#[derive(Debug)]
struct Level {
    full: Plane,
    /// Differences of two neighboring fingers, in touches of these two only and in full touches.
    neighbors: [Line; 2],
    /// Differences of the outer fingers, in touches of these two only and in full touches.
    outer: [Line; 2],
}

/// Simulated touches of one object, and the densities of their times.
#[derive(Debug)]
pub(super) struct Densities {
    /// The object's name.
    pub(super) name: String,
    /// κ and slope.
    full: Vec<[f32; 2]>,
    /// The middle finger's time minus the outer one's, like [`Level::neighbors`].
    neighbors: [Vec<f32>; 2],
    /// The third finger's time minus the first one's, where only these two touch.
    outer: Vec<f32>,
    /// The share of each set of fingers among all approaches, a set and its mirror image alike.
    pub(super) shares: [f64; 8],
    levels: [OnceLock<Level>; LEVELS],
    /// Densities cut off by a stroke, if the recordings have one.
    pub(super) late: Option<Late>,
}

impl Densities {
    /// Densities of simulated approaches, with contact or without, that no stroke ended; and the recordings' stroke as a time in
    /// milliseconds.
    pub(super) fn new(name: &str, touches: &[Touch], window: Option<f64>) -> Self {
        let (mut full, mut neighbors, mut outer) = (Vec::new(), [Vec::new(), Vec::new()], Vec::new());
        let mut counts = [0_u32; 8];
        for observed in touches.iter().map(Observed::of) {
            counts[usize::from(observed.fingers)] += 1;
            let Observed { first, second, .. } = observed;
            match observed.fingers {
                FULL => {
                    full.push([first as f32, second as f32]);
                    // κ is the sum, the slope the difference, of the outer fingers' delays after the middle one.
                    neighbors[1].extend([(first + second) / -2.0, (first - second) / -2.0].map(|late| late as f32));
                }
                0b011 => neighbors[0].push(first as f32),
                0b110 => neighbors[0].push(-first as f32),
                OUTER => outer.extend([first as f32, -first as f32]),
                _ => {}
            }
        }
        Self {
            name: name.into(),
            full,
            neighbors,
            outer,
            shares: mirrored(&counts, touches.len()),
            levels: std::array::from_fn(|_| OnceLock::new()),
            late: window.map(|window| Late::new(touches, window)),
        }
    }

    /// Makes the tables of usual noise, side by side; those of other noise are made when they are needed.
    pub(super) fn prepare(&self) {
        (9..17).into_par_iter().for_each(|level| _ = self.level(level));
    }

    fn level(&self, level: usize) -> &Level {
        self.levels[level].get_or_init(|| {
            let deviation = deviation_of(level);
            let pair = 2.0_f64.sqrt() * deviation;
            let (full, outer) = Plane::new(&self.full, deviation);
            Level {
                full,
                neighbors: self.neighbors.each_ref().map(|samples| Line::new(samples, pair)),
                outer: [Line::new(&self.outer, pair), outer],
            }
        })
    }

    /// The densities under this noise, in milliseconds; noise that no table exists for counts as the nearest.
    pub(super) fn under(&self, noise: f64) -> Smoothed<'_> {
        let position = ((noise / NOISE[0]).ln() / RATIO.ln()).clamp(0.0, (LEVELS - 1) as f64);
        let level = (position.floor() as usize).min(LEVELS - 2);
        let levels = [self.level(level), self.level(level + 1)];
        Smoothed { level, levels, fraction: position - level as f64, late: self.late.as_ref() }
    }
}

/// Densities under a noise between those of two tables.
#[derive(Clone, Copy)]
pub(super) struct Smoothed<'a> {
    /// The lower level.
    level: usize,
    levels: [&'a Level; 2],
    /// Position of the noise between the two levels, from 0 to 1.
    fraction: f64,
    late: Option<&'a Late>,
}

/// Position of a difference of two fingers' times, in cells from 0 in the tables of both levels.
pub(super) struct Apart([f64; 2]);

impl Smoothed<'_> {
    /// Density of κ and slope of a full touch, per square millisecond.
    pub(super) fn full(&self, curvature: f64, slope: f64) -> f64 {
        let [lower, upper] = self.levels;
        interpolate(lower.full.density(curvature, slope), upper.full.density(curvature, slope), self.fraction)
    }

    /// Position of a difference of two fingers' times in the tables of both levels.
    pub(super) fn apart(&self, late: f64) -> Apart {
        Apart(self.levels.map(|level| level.neighbors[0].away(late)))
    }

    fn pair(&self, Apart([lower, upper]): &Apart, line: impl Fn(&Level) -> &Line) -> f64 {
        let [lower, upper] = [line(self.levels[0]).density(*lower), line(self.levels[1]).density(*upper)];
        interpolate(lower, upper, self.fraction)
    }

    /// Density of how much later the middle finger is than an outer one, per millisecond, if only these two touch and if all do.
    pub(super) fn neighbors(&self, apart: &Apart) -> [f64; 2] {
        [self.pair(apart, |level| &level.neighbors[0]), self.pair(apart, |level| &level.neighbors[1])]
    }

    /// Density of the difference between the outer fingers.
    pub(super) fn outer(&self, apart: &Apart) -> [f64; 2] {
        [self.pair(apart, |level| &level.outer[0]), self.pair(apart, |level| &level.outer[1])]
    }

    /// [`Late::density`], 0 without a stroke.
    pub(super) fn late(&self, window: f64, which: usize, Apart([lower, upper]): &Apart) -> f64 {
        let Some(late) = self.late else { return 0.0 };
        let density =
            |level: usize, away| late.density(window, level, 2.0_f64.sqrt() * deviation_of(level), which, away);
        interpolate(density(self.level, *lower), density(self.level + 1, *upper), self.fraction)
    }
}
