//! Three switches, each on a topic of its own, to touches.
//!
//! `std_msgs/Bool` has no stamp: an edge happened when it was published, which the middleware says. Edges of three topics
//! arrive in any order; they wait until those that are older have had time to come.

use palpate::onboard::effector::{Edge, Effector, EffectorSettings, Fault, Finger};
use palpate::onboard::shared::Touch;
use std::collections::BTreeMap;

/// Nanoseconds that an edge may take to arrive longer than others.
const LAG: u64 = 100_000_000;

/// Microseconds before the first edge in which the switches are taken to have been open: as long as the effector waits at
/// power-up, and more.
const BEFORE: u32 = 1_000_000;

/// Three switches, open before the first message.
pub(crate) struct Switches {
    effector: Effector,
    /// Edges that wait, by their time; of several at one time in their order.
    waiting: BTreeMap<(u64, u64), (Finger, bool)>,
    arrived: u64,
    /// The clock here less that of the publisher, as small as it was seen; none before the first edge.
    ahead: Option<i128>,
}

impl Switches {
    /// Switches that wait as `settings` say.
    pub(crate) fn new(settings: EffectorSettings) -> Self {
        Self { effector: Effector::new(settings), waiting: BTreeMap::new(), arrived: 0, ahead: None }
    }

    /// Takes in a message that was published at `stamp` and arrived at `now`, nanoseconds on either clock.
    pub(crate) fn message(&mut self, finger: Finger, closed: bool, stamp: u64, now: u64) {
        let ahead = i128::from(now) - i128::from(stamp);
        if self.ahead.is_none() {
            let first = micros(stamp);
            // Nothing is there to be returned yet.
            let _ = self.effector.poll(first.wrapping_sub(BEFORE));
            let _ = self.effector.poll(first.wrapping_sub(1));
        }
        self.ahead = Some(self.ahead.map_or(ahead, |least| least.min(ahead)));
        self.arrived += 1;
        self.waiting.insert((stamp, self.arrived), (finger, closed));
    }

    /// Touches that were over by `now`, and faults, in their order. Call it often.
    pub(crate) fn poll(&mut self, now: u64) -> Vec<Result<Touch, Fault>> {
        let mut found = Vec::new();
        let Some(ahead) = self.ahead else { return found };
        let until = u64::try_from(i128::from(now) - ahead).unwrap_or(0).saturating_sub(LAG);
        while let Some(entry) = self.waiting.first_entry().filter(|entry| entry.key().0 <= until) {
            let ((stamp, _), (finger, closed)) = entry.remove_entry();
            keep(self.effector.edge(Edge::new(finger, closed, micros(stamp))), &mut found);
        }
        while keep(self.effector.poll(micros(until)), &mut found) {}
        found
    }
}

/// Keeps the outcomes of an effector; true if there were any.
fn keep(outcome: Result<Option<Touch>, Fault>, found: &mut Vec<Result<Touch, Fault>>) -> bool {
    let outcome = outcome.transpose();
    let is_something = outcome.is_some();
    found.extend(outcome);
    is_something
}

/// The effector's clock, which wraps.
fn micros(nanos: u64) -> u32 {
    // Wraps: only differences count.
    (nanos / 1_000) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;
    /// Publishers' clocks begin here, and are half a second behind.
    const START: u64 = 1_790_000_000 * SECOND;
    const AHEAD: u64 = SECOND / 2;

    /// Messages at times in milliseconds, each with its delay in milliseconds, in the order of arrival.
    fn touches(messages: &[(u64, u64, Finger, bool)]) -> Vec<Result<Touch, Fault>> {
        let mut switches = Switches::new(EffectorSettings::default());
        let mut sorted = messages.to_vec();
        sorted.sort_by_key(|(at, late, ..)| at + late);
        let mut found = Vec::new();
        let mut sorted = sorted.into_iter().peekable();
        for millisecond in 0..6_000 {
            let now = START + AHEAD + millisecond * 1_000_000;
            while let Some((at, _, finger, closed)) = sorted.next_if(|(at, late, ..)| at + late <= millisecond) {
                switches.message(finger, closed, START + at * 1_000_000, now);
            }
            found.extend(switches.poll(now));
        }
        found
    }

    #[test]
    fn three_switches_are_a_touch_with_the_times_of_their_publication() {
        let [first, middle, last] = Finger::ALL;
        let messages = [
            (30, 0, first, true),
            (0, 5, middle, true),
            (50, 1, last, true),
            (200, 0, first, false),
            (201, 0, middle, false),
            (202, 0, last, false),
        ];
        assert_eq!(touches(&messages), [Ok(Touch::from_micros([30_000, 0, 50_000]))]);
    }

    #[test]
    fn an_edge_that_another_overtook_keeps_its_time() {
        let [first, middle, last] = Finger::ALL;
        let messages = [
            (0, 0, middle, true),
            (30, 95, first, true),
            (50, 0, last, true),
            (200, 0, first, false),
            (201, 0, middle, false),
            (202, 0, last, false),
        ];
        assert_eq!(touches(&messages), [Ok(Touch::from_micros([30_000, 0, 50_000]))]);
    }

    #[test]
    fn a_finger_that_stays_open_is_missing() {
        let [first, middle, _] = Finger::ALL;
        let messages = [(0, 0, first, true), (20, 0, middle, true), (300, 0, first, false), (300, 0, middle, false)];
        let found = touches(&messages);
        let [Ok(touch)] = found[..] else { panic!("{found:?}") };
        assert_eq!(touch.times().map(|time| time.micros()), [Some(0), Some(20_000), None]);
    }

    #[test]
    fn a_switch_that_stays_closed_is_a_fault_and_a_repeated_level_is_none() {
        let [first, ..] = Finger::ALL;
        let messages: Vec<_> = (0..500).map(|tenth| (tenth * 10, 0, first, true)).collect();
        let found = touches(&messages);
        assert!(found.contains(&Err(Fault::Stuck(first))), "{found:?}");
        assert_eq!(found.iter().filter(|found| found.is_ok()).count(), 1);
    }

    #[test]
    fn two_touches_are_two() {
        let fingers = Finger::ALL;
        let at = |start: u64, closed| fingers.map(|finger| (start, 0, finger, closed));
        let messages = [at(0, true), at(100, false), at(500, true), at(700, false)].concat();
        assert_eq!(touches(&messages), [Ok(Touch::from_micros([0, 0, 0])); 2]);
    }
}
