//! The search: likelihoods of cells, best first.

use super::cell::{Cell, FINEST, NEAR, Pool, ROOTS, YAWS, turn};
use super::locator::{Exhausted, Locator};
use super::maps::{Maps, Placement};
use super::number::{NAT, NOTHING, add, direction, of_sum, power, quotient};
use super::seen::Seen;
use crate::bytes::at;

/// Logarithm of the number of parts of a cell.
const PARTS: i32 = 133;
/// Logarithm of the number of parts of a cell of a round placement, which has no yaw.
const ROUND_PARTS: i32 = 89;
/// Logarithm of the number of root cells of yaw.
const OF_YAWS: i32 = 133;
/// Cells less likely than the best by this are dropped, and count.
const CUT: i32 = 30 * NAT;
/// Cells within this of all together are split.
const SPLIT: i32 = 12 * NAT;
/// Search ends when cells that are not fine weigh less than all by this.
const DONE: i32 = 6 * NAT;
/// Share that a pool may lose at once when it is full.
const LOSS: i32 = 9 * NAT;

impl Maps<'_> {
    /// Middle of a cell along an axis, in 1/16 mm.
    #[inline(always)]
    pub(super) fn middle(&self, place: u8, level: u8) -> i32 {
        quotient((2 * i32::from(place) + 1) * self.range, i32::from(self.roots) << level) - self.range
    }

    /// Half of a cell's side, in 1/16 mm.
    pub(super) fn half(&self, level: u8) -> i32 {
        quotient(self.range, i32::from(self.roots) << level)
    }

    /// Likelihood of a cell given the touches, the last first, and given in each interval the height that fits best, beginning with
    /// these; less than `least` may be of some of them alone.
    #[inline(always)]
    fn likely(
        &self,
        cell: &Cell,
        placement: &Placement,
        [mut whole, mut finest]: [i32; 2],
        seen: &[Seen],
        least: i32,
        looked: &mut u32,
    ) -> [i32; 2] {
        let (level, is_finest) = (i32::from(cell.level), cell.level >= FINEST);
        let (cos, sin) = direction(turn(cell.yaw, cell.level));
        let (x, y) = (self.middle(cell.x, cell.level), self.middle(cell.y, cell.level));
        let side = quotient(self.range * 5, (i32::from(self.roots) << level) * 4);
        let [drift, drift_yaw] = self.drift;
        // Half of a cell's turn, in radians in Q14.
        let (angle, drift_yaw) =
            if placement.is_round { (0, 0) } else { (quotient(HALF_TURN, i32::from(YAWS) << level), drift_yaw) };
        for (seen, moves) in seen.iter().rev().zip(ROOTS) {
            // Moves add up as the root of their number.
            let (blur, angle) = (side + ((drift * moves) >> 4), angle + ((drift_yaw * moves) >> 4));
            for finger in 0..3 {
                let (u, v) = (i32::from(at(&seen.x, finger)) - x, i32::from(at(&seen.y, finger)) - y);
                let (u, v) = ((cos * u + sin * v) >> 14, (cos * v - sin * u) >> 14);
                let radius = length(u, v).min(placement.radius);
                let blur = blur + ((radius * angle) >> 14);
                let is_close = is_finest && blur <= CLOSE;
                let interval = match is_close {
                    true => self.close(placement, u, v),
                    false => self.heights(placement, u, v, blur),
                };
                let [of_whole, of_finest] =
                    self.of_finger(i32::from(at(&seen.z, finger)), i32::from(seen.limit), interval);
                // Where the object has moved since, the mean over all that it may have offered says next to nothing.
                whole += if is_finest && !is_close && drift > 0 { of_finest } else { of_whole };
                finest += of_finest;
            }
            *looked = looked.saturating_add(3);
            if whole < least && finest < least {
                break;
            }
        }
        [whole, finest].map(|likely| likely.clamp(NOTHING, -NOTHING))
    }

    /// Likelihood of a finger's height given an interval, and given the height in it that fits best.
    #[inline(always)]
    fn of_finger(&self, z: i32, limit: i32, [low, high]: [i32; 2]) -> [i32; 2] {
        if z >= 0 {
            let distance = (low - z).max(z - high).max(0);
            let (is_near, width) = (z < NEAR, width(high - low));
            [self.of_contact(is_near, width, distance), self.of_contact(is_near, width.min(1), distance)]
        } else if limit <= 0 {
            // The table was within the stroke: it was not felt, or a contact was lost.
            let missed = if low == 0 { self.of_table_missed() } else { self.of_missing_beyond(low - limit) };
            [missed; 2]
        } else if high <= limit {
            [self.of_missing_within(64); 2]
        } else if low > limit {
            [self.of_missing_beyond(low - limit); 2]
        } else {
            [self.of_missing_within(quotient((limit - low + 11) * 64, high - low + 22)), self.of_missing_within(64)]
        }
    }
}

/// Radius of a finest cell, in 1/16 mm, within which its middle tells its heights.
const CLOSE: i32 = 26;
/// Half a turn, in radians in Q14.
const HALF_TURN: i32 = 51_472;

/// Length of a vector, at most 6 % off.
fn length(x: i32, y: i32) -> i32 {
    let (longer, shorter) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    longer + (shorter >> 1) - (longer >> 3)
}

/// Bin of an interval's width: half millimeters, then two for each octave.
fn width(sixteenths: i32) -> usize {
    let halves = (sixteenths >> 3).unsigned_abs();
    let bin = match halves.checked_ilog2() {
        Some(octave) if halves >= 4 => 2 * octave + ((halves >> (octave - 1)) & 1),
        _ => halves,
    };
    usize::try_from(bin.min(15)).unwrap_or(0)
}

impl<const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize, P: Pool> Locator<'_, CELLS, TOUCHES, OBJECTS, P> {
    /// The cells in the pool.
    pub(super) fn cells(&self) -> &[Cell] {
        self.pool.as_ref().get(..self.count).unwrap_or_default()
    }

    /// Number of cells that the pool may hold.
    fn room(&self) -> usize {
        usize::try_from(self.effort.cells).unwrap_or(usize::MAX).min(CELLS)
    }

    fn object_of(&self, cell: &Cell) -> usize {
        usize::from(self.maps.object_of(cell.placement))
    }

    /// The most likely cell of the leader; none if it has none in the pool.
    fn most_likely(&self) -> Option<&Cell> {
        let leader = self.leader();
        self.cells().iter().filter(|cell| self.object_of(cell) == leader).max_by_key(|cell| cell.likely)
    }

    /// Least [fit](Self::fit) of a known object that leads; none without a test for unknown objects.
    pub(super) fn least_fit(&self) -> Option<i32> {
        self.maps.least_fit(self.most_likely()?.placement)
    }

    /// Fit of the touches to the leader's most likely cell: the logarithm of their likelihood for each touch, in 1/64 nat, given in
    /// each cell's interval of heights the one that fits best. Cost: a pass over the kept cells, a few instructions for each, and
    /// three lookups of heights for each touch. Cannot fail.
    pub fn fit(&self) -> i32 {
        let Some(best) = self.most_likely() else { return NOTHING };
        let seen = self.seen.get(..self.touches).unwrap_or_default();
        let [_, finest] = self.maps.likely(best, &self.maps.placement(best.placement), [0; 2], seen, i32::MIN, &mut 0);
        finest.checked_div(i32::try_from(self.touches).unwrap_or(1)).unwrap_or(0)
    }

    /// True if half of the leader's kept cells, by their weight, are outermost in the square in which objects are looked for: it may be
    /// something that lies outside. Also true without any such cell. Cost: a pass over the kept cells. Cannot fail.
    pub fn is_at_border(&self) -> bool {
        let leader = self.leader();
        let (mut all, mut outermost) = (0_u64, 0_u64);
        for cell in self.cells().iter().filter(|cell| self.object_of(cell) == leader) {
            let weight = u64::from(self.weight(cell));
            let last = (u32::from(self.maps.roots) << cell.level).saturating_sub(1);
            let is_outermost = [cell.x, cell.y].iter().any(|&place| place == 0 || u32::from(place) == last);
            all += weight;
            outermost += if is_outermost { weight } else { 0 };
        }
        2 * outermost >= all
    }

    /// Logarithm of a cell's share before the first touch.
    pub(super) fn prior(&self, index: u8, placement: &Placement, level: u8) -> i32 {
        let parts = if placement.is_round { ROUND_PARTS } else { PARTS };
        let yaws = if placement.is_round { 0 } else { OF_YAWS };
        self.object_prior(index) + placement.prior - yaws - i32::from(level) * parts
    }

    /// Weight of a cell, relative to the best, in Q16.
    #[inline(always)]
    pub(super) fn weight(&self, cell: &Cell) -> u32 {
        power(self.best - i32::from(cell.likely))
    }

    fn highest(&self) -> i32 {
        self.cells().iter().map(|cell| i32::from(cell.likely)).max().unwrap_or(NOTHING)
    }

    /// Adds a cell's weight to what was dropped of its object.
    fn drop_cell(&mut self, cell: &Cell) {
        let object = self.object_of(cell);
        if let Some(dropped) = self.dropped.get_mut(object) {
            *dropped = add(*dropped, i32::from(cell.likely));
        }
    }

    /// Likelihood of a cell; less than `least` may be of some of the touches alone.
    fn likely(&mut self, cell: &Cell, placement: &Placement, least: i32) -> i32 {
        let seen = self.seen.get(..self.touches).unwrap_or_default();
        let priors = [cell.level, FINEST].map(|level| self.prior(cell.placement, placement, level));
        let [whole, finest] = self.maps.likely(cell, placement, priors, seen, least, &mut self.looked);
        // The best height in each interval bounds a cell that is split. In a finest cell it would fit objects with many edges to
        // anything, more so with each touch.
        if cell.level >= FINEST { whole } else { whole.max(finest) }
    }

    /// Puts a cell into the pool, which has room, or drops it.
    fn put(&mut self, mut cell: Cell, placement: &Placement) {
        let least = self.best - CUT;
        let likely = self.likely(&cell, placement, least);
        cell.likely = i16::try_from(likely).unwrap_or(i16::MIN);
        let has_room = self.count < self.room();
        match self.pool.as_mut().get_mut(self.count) {
            Some(slot) if likely >= least && has_room => {
                *slot = cell;
                self.count += 1;
                self.best = self.best.max(likely);
            }
            _ => self.drop_cell(&cell),
        }
    }

    /// Drops the least likely cells as far as they weigh little together; true if that made room worth having.
    fn prune(&mut self) -> bool {
        let (count, top) = (self.count, self.highest());
        let bin = |cell: &Cell| usize::try_from((top - i32::from(cell.likely)) >> 5).unwrap_or(0).min(63);
        let (mut counts, mut weights) = ([0_usize; 64], [0_u64; 64]);
        for cell in self.cells() {
            if let (Some(count), Some(weight)) = (counts.get_mut(bin(cell)), weights.get_mut(bin(cell))) {
                *count += 1;
                *weight += u64::from(self.weight(cell));
            }
        }
        let may_lose = (weights.iter().sum::<u64>() * u64::from(power(LOSS))) >> 16;
        let (mut first, mut found, mut lost) = (64_usize, 0, 0);
        while first > 1 && found < count / 4 && lost + at(&weights, first - 1) <= may_lose {
            first -= 1;
            lost += at(&weights, first);
            found += at(&counts, first);
        }
        let mut kept = 0;
        for index in 0..count {
            let cell = at(self.pool.as_ref(), index);
            if bin(&cell) >= first {
                self.drop_cell(&cell);
            } else if let Some(slot) = self.pool.as_mut().get_mut(kept) {
                *slot = cell;
                kept += 1;
            }
        }
        self.count = kept;
        kept + count / 16 + 8 <= count
    }

    /// Weighs the cells; returns the weight of those that could be split, as a logarithm.
    fn weigh(&mut self) -> (i32, i32) {
        self.best = self.highest();
        let (mut all, mut coarse) = (0_u64, 0_u64);
        for cell in self.cells() {
            let weight = u64::from(self.weight(cell));
            all += weight;
            if cell.level < FINEST - 1 {
                coarse += weight;
            }
        }
        let of = |sum| if sum == 0 { NOTHING } else { self.best + of_sum(sum) };
        (of(all), of(coarse))
    }

    /// Searches the cells for all touches.
    pub(super) fn search(&mut self) {
        // What was most likely before bounds what is worth keeping, until something is more likely.
        let before = self.cells().iter().max_by_key(|cell| cell.likely).copied();
        (self.count, self.best, self.looked, self.exhausted) = (0, NOTHING, 0, None);
        self.dropped = [NOTHING; OBJECTS];
        if let Some(before) = before.filter(|cell| self.touches > 1 && self.object_prior(cell.placement) > NOTHING) {
            self.best = self.likely(&before, &self.maps.placement(before.placement), NOTHING);
        }
        let roots = self.maps.roots;
        for placement in 0..u8::try_from(self.maps.placements()).unwrap_or(u8::MAX) {
            if self.object_prior(placement) == NOTHING {
                continue;
            }
            let map = self.maps.placement(placement);
            let yaws = if map.is_round { 1 } else { YAWS };
            for root in 0..u32::from(yaws) * u32::from(roots) * u32::from(roots) {
                if self.looked > self.effort.lookups {
                    self.exhausted = Some(Exhausted::Lookups);
                    break;
                }
                if self.count >= self.room() && !self.prune() && self.count >= self.room() {
                    self.exhausted = Some(Exhausted::Cells);
                }
                let number = |value: u32| u8::try_from(value).unwrap_or(0);
                let (rest, roots) = (root / u32::from(yaws), u32::from(roots));
                let [x, y] = [rest.checked_rem(roots), rest.checked_div(roots)].map(|place| number(place.unwrap_or(0)));
                let yaw = number(root % u32::from(yaws));
                self.put(Cell { placement, yaw, x, y, level: 0, likely: 0 }, &map);
            }
        }
        let mut total;
        let mut threshold = self.highest() - NAT / 2;
        loop {
            let mut index = 0;
            while index < self.count {
                let cell = at(self.pool.as_ref(), index);
                if cell.level >= FINEST || i32::from(cell.likely) < threshold {
                    index += 1;
                    continue;
                }
                if self.count + 7 > self.room() {
                    if !self.prune() {
                        self.exhausted = Some(Exhausted::Cells);
                        break;
                    }
                    index = 0;
                    continue;
                }
                if self.looked > self.effort.lookups {
                    self.exhausted = Some(Exhausted::Lookups);
                    break;
                }
                self.split(index, &cell);
            }
            let coarse;
            (total, coarse) = self.weigh();
            threshold -= NAT / 2;
            if self.exhausted.is_some() || coarse < total - DONE || threshold < total - SPLIT {
                break;
            }
        }
        self.sum_up();
    }

    /// Replaces a cell by its parts.
    fn split(&mut self, index: usize, cell: &Cell) {
        self.count -= 1;
        let last = at(self.pool.as_ref(), self.count);
        if let Some(slot) = self.pool.as_mut().get_mut(index) {
            *slot = last;
        }
        let map = self.maps.placement(cell.placement);
        let turns = if map.is_round { 1 } else { 2 };
        for part in 0..4 * turns {
            let (yaw, part) = (part % turns, part / turns);
            let (x, y) = (2 * cell.x + (part & 1), 2 * cell.y + (part >> 1));
            self.put(Cell { yaw: turns * cell.yaw + yaw, x, y, level: cell.level + 1, ..*cell }, &map);
        }
    }

    /// The objects' posteriors.
    fn sum_up(&mut self) {
        let mut sums = [0_u64; OBJECTS];
        for cell in self.cells() {
            if let Some(sum) = sums.get_mut(self.object_of(cell)) {
                *sum += u64::from(self.weight(cell));
            }
        }
        let mut all = NOTHING;
        for ((posterior, sum), dropped) in self.posteriors.iter_mut().zip(sums).zip(self.dropped) {
            let kept = if sum == 0 { NOTHING } else { self.best + of_sum(sum) };
            *posterior = add(kept, dropped);
            all = add(all, *posterior);
        }
        self.posteriors.iter_mut().for_each(|posterior| *posterior -= all);
    }
}
