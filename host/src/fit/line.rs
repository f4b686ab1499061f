//! Tables of densities along one axis, for steps of noise.

use super::candidate::NOISE;

/// Ratio of the standard deviations of neighboring tables, which begin at the smallest of [`NOISE`].
pub(super) const RATIO: f64 = 1.3;
/// Number of tables.
pub(super) const LEVELS: usize = 22;
/// Standard deviation that a simulated touch is smoothed by, as a share of its distance from 0.
const SMOOTHING: f64 = 0.03;
/// Growth of cells with the distance from 0, as a share of it.
const GROWTH: f64 = 0.02;
/// Cells to a standard deviation near 0.
const CELLS: f64 = 2.0;
/// Reach of a kernel, in standard deviations.
const REACH: f64 = 3.0;

/// Cells along one axis, whose width is constant near 0 and grows with the distance from it.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    width: f64,
    /// Cells to either side of 0.
    half: usize,
    /// Growth over the width of a cell at 0.
    scale: f64,
}

impl Axis {
    pub(super) fn new(deviation: f64, farthest: f64) -> Self {
        let width = deviation / CELLS;
        let half = ((GROWTH * farthest / width).asinh() / GROWTH).ceil() as usize + 1;
        Self { width, half, scale: GROWTH / width }
    }

    pub(super) fn cells(&self) -> usize {
        2 * self.half + 1
    }

    /// Position of x, in cells from 0: on all axes of the same deviation the same.
    fn away(&self, x: f64) -> f64 {
        // The standard library's asinh takes three times as long, for digits near 0 that no cell needs.
        let x = self.scale * x;
        (x.abs() + (x * x + 1.0).sqrt()).ln().copysign(x) / GROWTH
    }

    fn value(&self, cell: usize) -> f64 {
        (GROWTH * (cell as f64 - self.half as f64)).sinh() / GROWTH * self.width
    }

    /// The first of the two cells that x lies between, and how far it is from the first to the second; none outside.
    pub(super) fn between(&self, x: f64) -> Option<(usize, f64)> {
        self.between_cells(self.away(x))
    }

    /// Like [`Axis::between`], for a position in cells from 0.
    fn between_cells(&self, away: f64) -> Option<(usize, f64)> {
        let position = away + self.half as f64;
        let cell = position.floor();
        (cell >= 0.0 && position < (self.cells() - 1) as f64).then_some((cell as usize, position - cell))
    }

    /// Makes the kernel of a sample at x, and of its mirror image.
    pub(super) fn kernel(&self, x: f64, deviation: f64, values: &[f64], kernel: &mut Kernel) {
        let width = deviation.hypot(SMOOTHING * x);
        let (low, high) = (self.away(x - REACH * width), self.away(x + REACH * width));
        let last = self.cells() - 1;
        let cell = |away: f64| (away + self.half as f64).clamp(0.0, last as f64);
        let range = |low: f64, high: f64| {
            let (from, to) = (cell(low).ceil() as usize, cell(high).floor() as usize);
            from..=to.max(from)
        };
        let (plain, mirrored) = (range(low, high), range(-high, -low));
        // Rounding may make one of them longer.
        let [from, to] = [*plain.start().min(&(last - mirrored.end())), *plain.end().max(&(last - mirrored.start()))];
        let height = 1.0 / (width * std::f64::consts::TAU.sqrt());
        kernel.first = [*plain.start(), *mirrored.start()];
        let density = |value: &f64| (height * (-0.5 * ((value - x) / width).powi(2)).exp()) as f32;
        kernel.both.clear();
        kernel.both.extend(values[from..=to].iter().map(density));
        kernel.mirrored.clear();
        kernel.mirrored.extend(kernel.both[last - mirrored.end() - from..=last - mirrored.start() - from].iter().rev());
        kernel.plain = plain.start() - from..plain.end() + 1 - from;
    }

    /// The value of each cell.
    pub(super) fn values(&self) -> Vec<f64> {
        (0..self.cells()).map(|cell| self.value(cell)).collect()
    }
}

/// The kernel of a sample and that of its mirror image, whose number has the other sign.
#[derive(Default)]
pub(super) struct Kernel {
    first: [usize; 2],
    both: Vec<f32>,
    plain: std::ops::Range<usize>,
    mirrored: Vec<f32>,
}

impl Kernel {
    /// The first cell, and the density at this and the following cells.
    pub(super) fn plain(&self) -> (usize, &[f32]) {
        (self.first[0], &self.both[self.plain.clone()])
    }

    /// Like [`Kernel::plain`], for the mirror image.
    pub(super) fn mirrored(&self) -> (usize, &[f32]) {
        (self.first[1], &self.mirrored)
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
        let farthest = samples.iter().fold(1.0_f64, |farthest, x| farthest.max(f64::from(x.abs())));
        let axis = Axis::new(deviation, 1.2 * farthest + 4.0 * deviation);
        let values = axis.values();
        let (mut line, mut kernel) = (Self::empty(axis), Kernel::default());
        for &x in samples {
            line.axis.kernel(x.into(), deviation, &values, &mut kernel);
            line.add(kernel.plain());
        }
        line.scaled(samples.len())
    }

    /// A density of no samples.
    pub(super) fn empty(axis: Axis) -> Self {
        Self { density: vec![0.0; axis.cells()], axis }
    }

    /// Adds a sample's kernel.
    pub(super) fn add(&mut self, (from, kernel): (usize, &[f32])) {
        self.density[from..].iter_mut().zip(kernel).for_each(|(cell, height)| *cell += height);
    }

    /// The density where this many samples were added.
    pub(super) fn scaled(mut self, samples: usize) -> Self {
        let per_sample = 1.0 / samples.max(1) as f32;
        self.density.iter_mut().for_each(|cell| *cell *= per_sample);
        self
    }

    /// Position of x, in cells from 0: in all lines of the same deviation the same.
    pub(super) fn away(&self, x: f64) -> f64 {
        self.axis.away(x)
    }

    /// The density at a position in cells from 0.
    pub(super) fn density(&self, away: f64) -> f64 {
        let Some((cell, fraction)) = self.axis.between_cells(away) else { return 0.0 };
        interpolate(self.density[cell].into(), self.density[cell + 1].into(), fraction)
    }
}

/// Interpolates linearly: `first` at the fraction 0, `second` at 1.
pub(super) fn interpolate(first: f64, second: f64, fraction: f64) -> f64 {
    first + fraction * (second - first)
}

/// The standard deviation of a level, in milliseconds.
pub(super) fn deviation_of(level: usize) -> f64 {
    NOISE[0] * RATIO.powi(i32::try_from(level).unwrap_or(0))
}
