//! The object's place.

use super::cell::{Cell, Pool, YAWS, turn};
use super::locator::Locator;
use super::number::quotient;
use palpate_shared::TablePose as Pose;

/// Largest distance from the most likely cell of those that are of its mode, in 1/16 mm, and 1/256 turn.
const APART: i32 = 10 * 16;
const TURNED_APART: i32 = 16;
/// Poses of an object that are told apart at most.
const MOST: usize = 4;
/// Bins of a distance.
const BINS: usize = 64;

impl<const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize, P: Pool> Locator<'_, CELLS, TOUCHES, OBJECTS, P> {
    /// Places of an object: its poses by their share, the largest first, up to four and as many as there is room for; returns their
    /// number. Cells within 10 mm and 22.5° of the most likely one are of a mode; those of the next mode are about the most likely
    /// one of the rest. An interval holds 95 % of a mode's weight.
    ///
    /// Cost: for each of four poses a few passes over the kept cells. Cannot fail.
    pub fn poses(&self, object: usize, poses: &mut [Pose]) -> usize {
        let is_of = |cell: &Cell| usize::from(self.maps.object_of(cell.placement)) == object;
        let all: u64 = self.cells().iter().filter(|cell| is_of(cell)).map(|cell| u64::from(self.weight(cell))).sum();
        let mut modes = [None; MOST];
        for number in 0..MOST {
            let is_free = |cell: &Cell| is_of(cell) && !modes.iter().flatten().any(|pose| self.is_near(cell, pose));
            let Some(best) = self.cells().iter().filter(|cell| is_free(cell)).max_by_key(|cell| cell.likely) else {
                break;
            };
            let mode = self.mode(best, all, &is_free);
            if let Some(slot) = modes.get_mut(number) {
                *slot = Some(mode);
            }
        }
        let mut found = 0;
        for slot in poses {
            // The first of several with the same share: the last of all in reverse.
            let largest = modes.iter_mut().rev().max_by_key(|mode| mode.map(|mode| mode.share));
            let Some(mode) = largest.and_then(Option::take) else { break };
            *slot = mode;
            found += 1;
        }
        found
    }

    fn place(&self, cell: &Cell) -> [i32; 2] {
        [cell.x, cell.y].map(|place| self.maps.middle(place, cell.level))
    }

    fn is_near(&self, cell: &Cell, pose: &Pose) -> bool {
        let [x, y] = self.place(cell);
        let [far_x, far_y] = [x * 125 / 2 - pose.position[0], y * 125 / 2 - pose.position[1]];
        let limit = APART * 125 / 2;
        let [_, yaw] = pose.yaw.to_le_bytes();
        cell.placement == pose.placement
            && far_x.abs() <= limit
            && far_y.abs() <= limit
            && (pose.yaw_within.is_none() || turned(turn(cell.yaw, cell.level), yaw.into(), 256).abs() <= TURNED_APART)
    }

    /// The mode about a cell.
    fn mode(&self, best: &Cell, all: u64, is_free: &dyn Fn(&Cell) -> bool) -> Pose {
        let is_round = self.maps.placement(best.placement).is_round;
        let ([at_x, at_y], at_yaw) = (self.place(best), turn(best.yaw, best.level));
        let near = |cell: &&Cell| {
            let [x, y] = self.place(cell);
            cell.placement == best.placement
                && (x - at_x).abs() <= APART
                && (y - at_y).abs() <= APART
                && (is_round || turned(turn(cell.yaw, cell.level), at_yaw, 256).abs() <= TURNED_APART)
                && is_free(cell)
        };
        let cells = || self.cells().iter().filter(near);
        // Offsets from the most likely cell, weighted; yaw in 1/65,536 turn.
        let (mut sum, mut sums) = (0_i64, [0_i64; 3]);
        for cell in cells() {
            let (weight, [x, y]) = (i64::from(self.weight(cell)), self.place(cell));
            sum += weight;
            let yaw = turned(fine(cell), fine(best), 65_536);
            for (sum, offset) in sums.iter_mut().zip([x - at_x, y - at_y, yaw]) {
                *sum += weight * i64::from(offset);
            }
        }
        let mean = sums.map(|of| i32::try_from(of.checked_div(sum).unwrap_or(0)).unwrap_or(0));
        let [mean_x, mean_y, mean_yaw] = mean;
        let mut widths = [0_i32; 3];
        for (axis, width) in widths.iter_mut().enumerate() {
            // A quarter of a millimeter in a bin, or 0.35°.
            let mut bins = [0_i64; BINS];
            for cell in cells() {
                let [x, y] = self.place(cell);
                let offset = match axis {
                    0 => x - at_x - mean_x,
                    1 => y - at_y - mean_y,
                    _ => (turned(fine(cell), fine(best), 65_536) - mean_yaw) >> 4,
                };
                let bin = usize::try_from(offset.abs() >> 2).unwrap_or(0).min(BINS - 1);
                if let Some(bin) = bins.get_mut(bin) {
                    *bin += i64::from(self.weight(cell));
                }
            }
            let mut passed = 0;
            let bin = bins.iter().position(|weight| {
                passed += weight;
                passed * 20 >= sum * 19
            });
            // Half of a cell is added to what the middles of cells are apart.
            let half = if axis == 2 {
                quotient(32_768, i32::from(YAWS) << best.level) >> 4
            } else {
                self.maps.half(best.level)
            };
            *width = 4 * i32::try_from(bin.unwrap_or(BINS - 1) + 1).unwrap_or(0) + half;
        }
        let micrometers = |sixteenths: i32| sixteenths * 125 / 2;
        let stretched = |width: u32| width.saturating_mul(self.maps.stretch()) >> 8;
        let [x, y, yaw] = widths;
        let share = (sum.unsigned_abs() << 16).checked_div(all).unwrap_or(0);
        let [low, high, ..] = (fine(best) + mean_yaw).to_le_bytes();
        Pose {
            placement: best.placement,
            position: [micrometers(at_x + mean_x), micrometers(at_y + mean_y)],
            yaw: if is_round { 0 } else { u16::from_le_bytes([low, high]) },
            within: [x, y].map(|width| stretched(micrometers(width).unsigned_abs())),
            yaw_within: (!is_round).then(|| u16::try_from(stretched((yaw << 4).unsigned_abs())).unwrap_or(u16::MAX)),
            share: u32::try_from(share).unwrap_or(u32::MAX),
        }
    }
}

/// Middle of a cell's yaw, in 1/65,536 turn.
fn fine(cell: &Cell) -> i32 {
    quotient((2 * i32::from(cell.yaw) + 1) * 32_768, i32::from(YAWS) << cell.level)
}

/// Difference of two angles in units of a turn divided by `whole`: between minus and plus half a turn.
fn turned(one: i32, other: i32, whole: i32) -> i32 {
    let apart = one - other;
    (apart + whole + whole / 2).checked_rem_euclid(whole).unwrap_or(0) - whole / 2
}
