//! Tables of densities along one axis, for steps of noise.

use super::candidate::NOISE;

/// Standard deviations of the tables begin at the least of [`NOISE`]: how much larger each is than the one before, and how
/// many there are.
pub(super) const RATIO: f64 = 1.3;
pub(super) const LEVELS: usize = 22;
/// By how much of its distance from 0 a simulated touch is smoothed.
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

    /// Position of x, in cells from the first.
    pub(super) fn position(&self, x: f64) -> f64 {
        // The standard library's asinh takes three times as long, for digits near 0 that no cell needs.
        let x = self.scale * x;
        (x.abs() + (x * x + 1.0).sqrt()).ln().copysign(x) / GROWTH + self.half as f64
    }

    pub(super) fn value(&self, cell: usize) -> f64 {
        (GROWTH * (cell as f64 - self.half as f64)).sinh() / GROWTH * self.width
    }

    /// The first of the two cells that x lies between, and how far it is from the first to the second; none outside.
    pub(super) fn between(&self, x: f64) -> Option<(usize, f64)> {
        let position = self.position(x);
        let cell = position.floor();
        (cell >= 0.0 && position < (self.cells() - 1) as f64).then_some((cell as usize, position - cell))
    }

    /// The kernel of a sample at x: its first cell, and its density at this and the following cells.
    pub(super) fn kernel(&self, x: f64, deviation: f64, values: &[f64], kernel: &mut Vec<f32>) -> usize {
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

/// The standard deviation of a level, in milliseconds.
pub(super) fn deviation_of(level: usize) -> f64 {
    NOISE[0] * RATIO.powi(i32::try_from(level).unwrap_or(0))
}
