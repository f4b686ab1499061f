//! Heights of a placement on a grid.

use super::Lying;
use super::grid::{count, index, mean, pieces, places};

/// Heights above this are the object's, in millimeters: what is below may be noise on the table.
pub(super) const TABLE: f64 = 0.3;
/// Two placements of an object are the same where their heights differ by less than this on average, in millimeters.
pub(super) const SAME: f64 = 0.8;
/// A placement is round where its heights differ from their mean at the same distance by less than this, in millimeters.
const ROUND: f64 = 1.2;
/// Cells about the footprint.
const MARGIN: i32 = 3;

/// The heights of a placement on a grid about its origin.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Position of the object among the data set's.
    pub object: usize,
    /// Name of the placement; empty for an object without.
    pub placement: String,
    /// Share of the object.
    pub share: f64,
    /// Millimeters between cells.
    pub cell: f64,
    /// Cells on each side of the middle one.
    pub half: [i32; 2],
    /// Heights in millimeters, row by row.
    pub heights: Vec<f64>,
    /// Share of the cells within the footprint that a touch met.
    pub known: f64,
    /// True if it looks the same from all sides.
    pub is_round: bool,
}

impl Surface {
    /// One with these heights, without a name.
    pub(super) fn of(object: usize, half: [i32; 2], cell: f64, height: impl Fn([i32; 2]) -> f64) -> Self {
        let heights = places(half).map(height).collect();
        let (placement, share, known, is_round) = (String::new(), 1.0, 1.0, false);
        Self { object, placement, share, cell, half, heights, known, is_round }
    }

    /// The heights that a fingertip of this radius meets in the middle of each cell.
    pub(super) fn cast(lying: &Lying, radius: f64, cell: f64) -> Self {
        let half = lying.half();
        let reach = [half.x, half.y].map(|half| ((half + radius) / cell).ceil() as i32 + 1);
        Self::of(0, reach, cell, |at| lying.height(at.map(|place| f64::from(place) * cell), radius))
    }

    /// The height of a cell; 0 outside.
    pub(super) fn at(&self, i: i32, j: i32) -> f64 {
        index(self.half, [i, j]).map_or(0.0, |cell| self.heights[cell])
    }

    /// The height of the cell nearest to a point, in millimeters.
    pub(super) fn near(&self, [x, y]: [f64; 2]) -> f64 {
        self.at((x / self.cell).round() as i32, (y / self.cell).round() as i32)
    }

    /// Each cell's place, in millimeters, and height.
    fn cells(&self) -> impl Iterator<Item = ([f64; 2], f64)> + '_ {
        places(self.half).map(|[i, j]| ([i, j].map(|place| f64::from(place) * self.cell), self.at(i, j)))
    }

    /// Farthest point that is higher than the table.
    pub(super) fn radius(&self) -> f64 {
        self.cells().filter(|(_, height)| *height > TABLE).map(|([x, y], _)| x.hypot(y)).fold(0.0, f64::max)
    }

    /// Greatest height.
    pub(super) fn top(&self) -> f64 {
        self.heights.iter().copied().fold(0.0, f64::max)
    }

    /// The middle of what rises from the table.
    pub(super) fn middle(&self) -> [f64; 2] {
        let add =
            |[u, v, sum]: [f64; 3], ([x, y], height): ([f64; 2], f64)| [u + x * height, v + y * height, sum + height];
        let [x, y, sum] = self.cells().fold([0.0; 3], add);
        [x / sum.max(f64::MIN_POSITIVE), y / sum.max(f64::MIN_POSITIVE)]
    }

    /// Mean difference of heights from others at the same places, where either rises from the table.
    pub(super) fn off(&self, other: impl Fn([f64; 2]) -> f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for (place, height) in self.cells() {
            let other = other(place);
            sum += (height - other).abs();
            count += f64::from(u8::from(height > TABLE || other > TABLE));
        }
        sum / count.max(1.0)
    }

    /// Mean difference of heights from another's that is turned.
    pub(super) fn differs(&self, other: &Self, turn: f64) -> f64 {
        let (sin, cos) = turn.sin_cos();
        self.off(|[x, y]| other.near([cos * x + sin * y, cos * y - sin * x]))
    }

    /// True if heights depend on the distance from the origin alone.
    pub(super) fn looks_round(&self) -> bool {
        let reach = self.radius() / self.cell + 2.0;
        let mut rings = vec![(0.0, 0.0); reach as usize + 2];
        let ring = |[x, y]: [f64; 2]| (x.hypot(y) / self.cell).round() as usize;
        for (place, height) in self.cells() {
            if let Some((sum, count)) = rings.get_mut(ring(place)) {
                *sum += height;
                *count += 1.0;
            }
        }
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for (place, height) in self.cells() {
            let Some((all, cells)) = rings.get(ring(place)) else { continue };
            sum += (height - all / cells).abs();
            count += f64::from(u8::from(height > TABLE));
        }
        sum / count.max(1.0) < ROUND
    }
}

/// The part of a grid that an object stands on.
pub(super) fn footprint(half: [i32; 2], cell: f64, heights: &[f64], own: &[bool]) -> Surface {
    // What rises from the table with its neighbors; one cell alone is noise.
    let is_object = |at: [i32; 2]| {
        let about = places([2, 2]).filter_map(|by| Some(heights[index(half, [at[0] + by[0], at[1] + by[1]])?]));
        mean(about).is_some_and(|mean| mean > TABLE)
    };
    let footprint = pieces(half, places(half).filter(|at| is_object(*at)).collect());
    let reach = |axis: usize| footprint.iter().map(|at| at[axis].abs()).max().unwrap_or(0) + MARGIN;
    let cropped = [reach(0), reach(1)];
    let mut surface = vec![0.0; count(cropped)];
    for at in &footprint {
        if let (Some(to), Some(from)) = (index(cropped, *at), index(half, *at)) {
            surface[to] = heights[from];
        }
    }
    let known = footprint.iter().filter(|at| index(half, **at).is_some_and(|cell| own[cell])).count();
    let known = known as f64 / footprint.len().max(1) as f64;
    let (object, placement, is_round) = (0, String::new(), false);
    Surface { object, placement, share: 1.0, cell, half: cropped, heights: surface, known, is_round }
}
