//! One switch: from bouncing edges to a settled level and the moment when it left the one before.

use super::EffectorSettings;

/// A switch. All times are on the wrapping clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Debounce {
    settled: bool,
    level: bool,
    /// Time at which `level` last changed.
    since: u32,
    /// The first edge away from the settled level, while the switch has not settled again.
    left: Option<u32>,
    bounce_told: bool,
    stuck_told: bool,
    closed_since: u32,
}

/// Change of a switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// It has closed, its first closing edge was at this time.
    Closed(u32),
    /// It has opened.
    Opened,
    /// It does not settle.
    Bouncing,
    /// It does not open any more.
    Stuck,
}

/// Microseconds from `from` to `to`, which is less than 2³¹ away; 0 if `to` is the earlier one.
pub(super) const fn after(to: u32, from: u32) -> u32 {
    let elapsed = to.wrapping_sub(from);
    if elapsed >> 31 == 0 { elapsed } else { 0 }
}

impl Debounce {
    /// An open switch.
    pub(super) const fn new() -> Self {
        Self {
            settled: false,
            level: false,
            since: 0,
            left: None,
            bounce_told: false,
            stuck_told: false,
            closed_since: 0,
        }
    }

    /// True if the switch has settled open.
    pub(super) const fn is_open(&self) -> bool {
        !self.settled && self.left.is_none()
    }

    /// The level of the last edge.
    pub(super) const fn level(&self) -> bool {
        self.level
    }

    /// Time at which a closing that is not settled yet began.
    pub(super) const fn closing_since(&self) -> Option<u32> {
        if self.settled { None } else { self.left }
    }

    /// The clock starts here: earlier edges happened now.
    pub(super) const fn start(&mut self, now: u32) {
        (self.since, self.closed_since) = (now, now);
        if self.left.is_some() {
            self.left = Some(now);
        }
    }

    /// The level is `closed` from `at` on. An edge to the level that was there already changes nothing.
    pub(super) const fn edge(&mut self, closed: bool, at: u32) {
        if closed == self.level {
            return;
        }
        self.level = closed;
        self.since = at;
        if self.left.is_none() {
            self.left = Some(at);
        }
    }

    /// Microseconds from `now` until [`Debounce::fire`] has something to do, or `None`.
    pub(super) fn due(&self, now: u32, settings: &EffectorSettings) -> Option<u32> {
        let until = |from: u32, wait: u32| after(from.wrapping_add(wait), now);
        match self.left {
            Some(left) => {
                let settles = until(self.since, settings.debounce);
                let bounces = (!self.bounce_told).then(|| until(left, settings.settle));
                Some(bounces.map_or(settles, |bounces| settles.min(bounces)))
            }
            None => (self.settled && !self.stuck_told).then(|| until(self.closed_since, settings.stuck)),
        }
    }

    /// Returns the change of the switch by `now`. Call it until it returns `None`.
    pub(super) fn fire(&mut self, now: u32, settings: &EffectorSettings) -> Option<Change> {
        let Some(left) = self.left else {
            let stuck = self.settled && !self.stuck_told && after(now, self.closed_since) >= settings.stuck;
            self.stuck_told |= stuck;
            return stuck.then_some(Change::Stuck);
        };
        if after(now, self.since) >= settings.debounce {
            // The beginning of endless bouncing may lie too far back for the clock.
            let left = if self.bounce_told { self.since } else { left };
            self.left = None;
            self.bounce_told = false;
            let changed = self.level != self.settled;
            self.settled = self.level;
            return match (changed, self.level) {
                // A glitch: the level came back before it had held for long enough.
                (false, _) => None,
                (true, true) => {
                    self.closed_since = left;
                    self.stuck_told = false;
                    Some(Change::Closed(left))
                }
                (true, false) => Some(Change::Opened),
            };
        }
        let bouncing = !self.bounce_told && after(now, left) >= settings.settle;
        self.bounce_told |= bouncing;
        bouncing.then_some(Change::Bouncing)
    }
}
