//! Scalar field whose level set is the surface: Poisson's equation on a grid, solved by multigrid.

use super::smooth::Smoothed;
use glam::DVec3;
use rayon::prelude::*;

/// Cells of the grid along the longest side of the points' box.
const CELLS: f64 = 112.0;

/// Cells around the box.
const AROUND: f64 = 16.0;

/// Weight of the term that draws the field to its level at the points, for the area of a cell's side.
const SCREENING: f32 = 0.25;

/// Cycles of multigrid: each leaves about a tenth of the error.
const CYCLES: usize = 6;

/// Values at the nodes of a grid: about 1 inside, 0 outside.
pub(super) struct Field {
    grid: Grid,
    pub(super) values: Vec<f32>,
    pub(super) level: f32,
    low: DVec3,
    pub(super) cell: f64,
}

/// Numbers of nodes along each axis; x varies fastest.
#[derive(Clone, Copy)]
pub(super) struct Grid(pub(super) [usize; 3]);

impl Grid {
    pub(super) fn steps(self) -> [usize; 3] {
        [1, self.0[0], self.0[0] * self.0[1]]
    }

    fn size(self) -> usize {
        self.0.iter().product()
    }
}

impl Field {
    /// The field of smoothed points.
    pub(super) fn new(points: &Smoothed) -> Self {
        let Smoothed { places, normals, areas, .. } = points;
        let low = places.iter().fold(DVec3::INFINITY, |low, &place| low.min(place));
        let high = places.iter().fold(DVec3::NEG_INFINITY, |high, &place| high.max(place));
        let cell = (high - low).max_element() / CELLS;
        let low = low - AROUND * cell;
        // Whole numbers of the cells of four coarser grids.
        let nodes = ((high - low) / cell + AROUND).to_array().map(|cells| (cells as usize).div_ceil(16) * 16 + 1);
        let grid = Grid(nodes);
        let mut field = Self { grid, values: vec![0.0; grid.size()], level: 0.5, low, cell };
        let (mut right, mut screen) = (vec![0.0; grid.size()], vec![0.0; grid.size()]);
        for ((&place, normal), area) in places.iter().zip(normals).zip(areas) {
            let weight = area / (cell * cell);
            for (axis, step) in grid.steps().into_iter().enumerate() {
                // On faces, half a cell from the nodes: differences are then those of neighboring nodes.
                let mut half = DVec3::ZERO;
                half[axis] = cell / 2.0;
                for (node, share) in field.around(place - half) {
                    let flux = (share * weight * normal[axis]) as f32;
                    right[node] += flux;
                    right[node + step] -= flux;
                }
            }
            for (node, share) in field.around(place) {
                let pull = SCREENING * (weight * share) as f32;
                screen[node] += pull;
                right[node] += pull * field.level;
            }
        }
        let mut values = vec![0.0; grid.size()];
        for _ in 0..CYCLES {
            cycle(grid, &mut values, &right, &screen);
        }
        field.values = values;
        let (sum, total) = places.iter().zip(areas).fold((0.0, 0.0), |(sum, total), (&place, area)| {
            let value: f64 = field.around(place).map(|(node, share)| share * f64::from(field.values[node])).sum();
            (sum + area * value, total + area)
        });
        field.level = (sum / total) as f32;
        field
    }

    pub(super) fn grid(&self) -> Grid {
        self.grid
    }

    /// The place of a point in cells from the first node.
    pub(super) fn place(&self, cells: DVec3) -> DVec3 {
        self.low + cells * self.cell
    }

    /// The eight nodes around a place, with their shares of it.
    fn around(&self, place: DVec3) -> impl Iterator<Item = (usize, f64)> + use<> {
        let cells = (place - self.low) / self.cell;
        let (whole, part) = (cells.floor(), cells - cells.floor());
        let [x, y, z] = self.grid.steps();
        let first = whole.x as usize * x + whole.y as usize * y + whole.z as usize * z;
        (0..8).map(move |corner| {
            let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
            let share = |axis: usize| if bits[axis] == 1 { part[axis] } else { 1.0 - part[axis] };
            (first + bits[0] * x + bits[1] * y + bits[2] * z, share(0) * share(1) * share(2))
        })
    }
}

/// A cycle of multigrid for (6 + screen) · x − neighbors = right; zero at the border.
fn cycle(grid: Grid, x: &mut Vec<f32>, right: &[f32], screen: &[f32]) {
    const FINEST: usize = 3;
    if grid.0.iter().any(|nodes| *nodes < 6) {
        (0..40).for_each(|_| relax(grid, x, right, screen));
        return;
    }
    (0..FINEST).for_each(|_| relax(grid, x, right, screen));
    let coarse = Grid(grid.0.map(|nodes| nodes.div_ceil(2)));
    let rest = map(grid, |node, [_, y, z]| {
        let around = x[node - 1] + x[node + 1] + x[node - y] + x[node + y] + x[node - z] + x[node + z];
        right[node] - (6.0 + screen[node]) * x[node] + around
    });
    // Four times: the square of the ratio of the cells.
    let coarse_right = map(coarse, |node, _| 4.0 * gathered(grid, coarse, node, &rest));
    let coarse_screen = map(coarse, |node, _| 4.0 * gathered(grid, coarse, node, screen));
    let mut correction = vec![0.0; coarse.size()];
    cycle(coarse, &mut correction, &coarse_right, &coarse_screen);
    let [_, row, slab] = coarse.steps();
    let corrected = map(grid, |node, [_, y, z]| {
        let at = [node % y, node / y % (z / y), node / z];
        let sides = at.map(|index| [index / 2, index.div_ceil(2)]);
        let corners =
            (0..8).map(|bits| sides[0][bits & 1] + sides[1][bits >> 1 & 1] * row + sides[2][bits >> 2] * slab);
        x[node] + corners.map(|corner| correction[corner]).sum::<f32>() / 8.0
    });
    *x = corrected;
    (0..FINEST).for_each(|_| relax(grid, x, right, screen));
}

/// A damped step of Jacobi's method.
fn relax(grid: Grid, x: &mut Vec<f32>, right: &[f32], screen: &[f32]) {
    *x = map(grid, |node, [_, y, z]| {
        let around = x[node - 1] + x[node + 1] + x[node - y] + x[node + y] + x[node - z] + x[node + z];
        let wanted = (around + right[node]) / (6.0 + screen[node]);
        x[node] + 0.8 * (wanted - x[node])
    });
}

/// Values of the 27 nodes of a finer grid about a node, weighted by their closeness: 1 in sum.
fn gathered(fine: Grid, coarse: Grid, node: usize, values: &[f32]) -> f32 {
    let ([_, y, z], [_, row, slab]) = (fine.steps(), coarse.steps());
    let first = 2 * (node % row) + 2 * (node / row % (slab / row)) * y + 2 * (node / slab) * z;
    const SHARES: [f32; 3] = [0.25, 0.5, 0.25];
    let mut sum = 0.0;
    for (k, c) in SHARES.iter().enumerate() {
        for (j, b) in SHARES.iter().enumerate() {
            for (i, a) in SHARES.iter().enumerate() {
                sum += a * b * c * values[first + i + j * y + k * z - 1 - y - z];
            }
        }
    }
    sum
}

/// Values for the inner nodes of a grid; zeros at its border.
fn map(grid: Grid, of: impl Fn(usize, [usize; 3]) -> f32 + Sync) -> Vec<f32> {
    let mut values = vec![0.0; grid.size()];
    let [width, height, depth] = grid.0;
    let steps = grid.steps();
    values.par_chunks_mut(width * height).enumerate().for_each(|(k, slab)| {
        if k == 0 || k == depth - 1 {
            return;
        }
        for j in 1..height - 1 {
            for i in 1..width - 1 {
                let own = i + j * width;
                slab[own] = of(own + k * width * height, steps);
            }
        }
    });
    values
}
