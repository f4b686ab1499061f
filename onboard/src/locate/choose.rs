//! Choice of the next approach.

use super::cell::{Pool, YAWS, turn};
use super::locator::Locator;
use super::maps::Placement;
use super::number::{NAT, direction, logarithm, of_sum, power, quotient};
use crate::bytes::at;
use palpate_shared::Approach;

/// Default share of the pose in what the next approach is to tell, in 64ths.
pub const POSE: u16 = 10;
/// Cells that are drawn as hypotheses.
const DRAWN: usize = 64;

/// A cell drawn by its weight, somewhere in it.
#[derive(Clone, Copy, Debug, Default)]
struct Drawn {
    placement: Placement,
    x: i32,
    y: i32,
    cos: i32,
    sin: i32,
    /// Share of its object's posterior, in Q16.
    weight: u32,
    /// Heights that the candidate would meet there.
    heights: [i32; 3],
}

impl<const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize, P: Pool> Locator<'_, CELLS, TOUCHES, OBJECTS, P> {
    /// The approach that tells most about the object, and a little about its pose: of a bounded number of candidates on hypotheses
    /// drawn by their weight, the one whose heights have the largest mutual information with them. `spacing` is the distance of
    /// neighboring fingers and `within` half the side of the square about the origin in which the middle finger may go, both in
    /// micrometers. `pose` is the share of the pose in what is to be told, in 64ths.
    ///
    /// Cost: `candidates` × 64 × (3 lookups + 64 differences), and a search if there was none yet. Cannot fail.
    pub fn choose(&mut self, spacing: u32, stroke: u32, within: u32, pose: u16) -> Approach {
        let sixteenths = |micrometers: u32| i32::try_from(micrometers / 125 * 2).unwrap_or(i32::MAX).min(32_000);
        let (spacing, stroke, within) = (sixteenths(spacing), sixteenths(stroke), sixteenths(within));
        if self.count == 0 {
            self.search();
        }
        let mut drawn = [Drawn::default(); DRAWN];
        let count = self.draw(&mut drawn);
        let drawn = drawn.get_mut(..count).unwrap_or_default();
        let [roll, ..] = self.random.next().to_le_bytes();
        let mut best = Approach { roll, ..Approach::default() };
        if drawn.len() < 2 {
            return best;
        }
        let mut own = [0_u32; OBJECTS];
        for hypothesis in drawn.iter() {
            if let Some(own) = own.get_mut(usize::from(hypothesis.placement.object)) {
                *own += hypothesis.weight;
            }
        }
        let mut most = i64::MIN;
        for _ in 0..self.effort.candidates {
            let number = self.random.below(u32::try_from(drawn.len()).unwrap_or(0));
            let on = drawn.get(usize::try_from(number).unwrap_or(0)).copied().unwrap_or_default();
            let reach = on.placement.radius * 3 / 4;
            let (u, v) = (self.random.within(reach), self.random.within(reach));
            let x = (on.x + ((on.cos * u - on.sin * v) >> 14)).clamp(-within, within);
            let y = (on.y + ((on.sin * u + on.cos * v) >> 14)).clamp(-within, within);
            let [roll, ..] = (self.random.next() & 127).to_le_bytes();
            let (cos, sin) = direction(roll.into());
            let row = [(spacing * cos) >> 14, (spacing * sin) >> 14];
            for hypothesis in drawn.iter_mut() {
                self.expect_heights(hypothesis, [x, y], row, stroke);
            }
            let gain = information(drawn, &own, pose);
            if gain > most {
                let micrometers = |sixteenths: i32| sixteenths * 125 / 2;
                (most, best) = (gain, Approach { x: micrometers(x), y: micrometers(y), roll });
            }
        }
        best
    }

    /// Draws hypotheses: for each object a number by the root of its posterior, spread evenly over its cells by their weight.
    fn draw(&mut self, drawn: &mut [Drawn; DRAWN]) -> usize {
        let objects = self.maps.objects();
        let mut roots = [0_u64; OBJECTS];
        for (root, &posterior) in roots.iter_mut().zip(&self.posteriors).take(objects) {
            *root = if posterior < -7 * NAT { 0 } else { u64::from(power(-posterior / 2)) };
        }
        let all = roots.iter().sum::<u64>().max(1);
        let mut count = 0;
        for (object, root) in roots.iter().enumerate().take(objects) {
            let share = (root * DRAWN as u64 + all / 2) / all;
            let is_of = |placement: u8| usize::from(self.maps.object_of(placement)) == object;
            let sum: u64 =
                self.cells().iter().filter(|cell| is_of(cell.placement)).map(|cell| u64::from(self.weight(cell))).sum();
            if share == 0 || sum == 0 {
                continue;
            }
            let step = sum / share + 1;
            let weight =
                power(-at(&self.posteriors, object)).checked_div(u32::try_from(share).unwrap_or(1)).unwrap_or(0);
            let mut next = u64::from(self.random.next()).checked_rem(step).unwrap_or(0);
            let (mut passed, mut took) = (0, 0);
            for index in 0..self.count {
                let cell = at(self.pool.as_ref(), index);
                if usize::from(self.maps.object_of(cell.placement)) != object {
                    continue;
                }
                passed += u64::from(self.weight(&cell));
                while passed > next && took < share {
                    let half_turn = quotient(128, i32::from(YAWS) << cell.level) + 1;
                    let half = self.maps.half(cell.level);
                    let placement = self.maps.placement(cell.placement);
                    let turned = turn(cell.yaw, cell.level) + self.random.within(half_turn);
                    let (cos, sin) = direction(turned);
                    let x = self.maps.middle(cell.x, cell.level) + self.random.within(half);
                    let y = self.maps.middle(cell.y, cell.level) + self.random.within(half);
                    if let Some(slot) = drawn.get_mut(count) {
                        *slot = Drawn { placement, x, y, cos, sin, weight, heights: [0; 3] };
                        count += 1;
                    }
                    took += 1;
                    next += step;
                }
            }
        }
        count
    }

    /// Heights that the fingers of an approach would meet on a hypothesis.
    fn expect_heights(&mut self, on: &mut Drawn, [x, y]: [i32; 2], [row_x, row_y]: [i32; 2], stroke: i32) {
        let mut highest = 0;
        for (height, finger) in on.heights.iter_mut().zip([-1, 0, 1]) {
            let (u, v) = (x + finger * row_x - on.x, y + finger * row_y - on.y);
            let (u, v) = ((on.cos * u + on.sin * v) >> 14, (on.cos * v - on.sin * u) >> 14);
            *height = self.maps.height_at(&on.placement, u, v);
            highest = highest.max(*height);
        }
        self.looked = self.looked.saturating_add(3);
        on.heights.iter_mut().for_each(|height| *height = (*height).max(highest - stroke));
    }
}

/// Mutual information of the heights with the object, and a share of that with the hypothesis.
fn information<const OBJECTS: usize>(drawn: &[Drawn], own: &[u32; OBJECTS], pose: u16) -> i64 {
    let mut gain = 0;
    for one in drawn {
        let (mut all, mut same) = (0_u32, 0_u32);
        for other in drawn {
            let mut squares = 0_u64;
            for (a, b) in one.heights.iter().zip(&other.heights) {
                let apart = u64::from(a.abs_diff(*b));
                squares += apart * apart;
            }
            // Of two heights with noise of 0.75 mm each: nats in 1/64.
            let nats = (squares * 7) >> 8;
            if nats >= 512 {
                continue;
            }
            let weight = (other.weight * (power(i32::try_from(nats).unwrap_or(512)) >> 4)) >> 12;
            all += weight;
            if other.placement.object == one.placement.object {
                same += weight;
            }
        }
        let [all, same] = [all, same].map(|sum| logarithm(u64::from(sum) + 1));
        let own = of_sum(u64::from(at(own, usize::from(one.placement.object))) + 1);
        let whole = logarithm(65_536);
        gain += i64::from(one.weight) * (i64::from(same - own - all) * 64 + i64::from(pose) * i64::from(whole - all));
    }
    gain
}
