//! Changes of class in a stream of rows that are verdicts.

use palpate_shared::format::Events;

/// Class that holds in a stream, and rows for which no verdict follows: which changes of class are verdicts.
///
/// A verdict is a change to another class than the one that holds, unless that is the background. After a verdict there is none
/// for the model's hold-off. State: two numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ongoing {
    class: Option<u8>,
    /// Rows until the next verdict.
    silent: u32,
}

impl Ongoing {
    /// Nothing holds yet.
    pub const fn new() -> Self {
        Self { class: None, silent: 0 }
    }

    /// Class that holds: the last one that was sure, except events within a hold-off. `None` before the first.
    pub const fn class(&self) -> Option<u8> {
        self.class
    }

    /// Takes in the leader after a row, and whether it is sure; returns whether it is a verdict.
    ///
    /// Cost: a few instructions. Cannot fail.
    pub fn take(&mut self, events: &Events, leader: u8, is_sure: bool) -> bool {
        self.silent = self.silent.saturating_sub(1);
        if !is_sure || self.class == Some(leader) {
            return false;
        }
        let is_background = events.background == Some(leader);
        let is_verdict = !is_background && self.silent == 0;
        if is_background || is_verdict {
            self.class = Some(leader);
        }
        if is_verdict {
            self.silent = events.hold_off;
        }
        is_verdict
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const EVENTS: Events = Events {
        background: Some(0),
        hold_off: 3,
        memory: 100,
        rows_per_hour: 3600.0,
        per_hour: 0.0,
        confidence: 0.95,
        grace: 0,
        longest: 0,
    };

    /// The rows after which there is a verdict, for a sure leader in each row; `.` for none.
    fn verdicts(events: &Events, leaders: &str) -> Vec<usize> {
        let mut ongoing = Ongoing::new();
        let mut take = |leader: char| ongoing.take(events, leader.to_digit(10).unwrap_or(9) as u8, leader != '.');
        leaders.chars().enumerate().filter(|(_, leader)| take(*leader)).map(|(row, _)| row).collect()
    }

    #[test]
    fn a_verdict_is_a_change_to_another_class_than_the_background() {
        assert_eq!(verdicts(&EVENTS, "0..111..1.00..1"), [3, 14]);
        assert_eq!(verdicts(&EVENTS, "1111112222221"), [0, 6, 12]);
        assert_eq!(verdicts(&EVENTS, "000000"), []);
        assert_eq!(verdicts(&Events { background: None, ..EVENTS }, "0001110"), [0, 3, 6]);
    }

    #[test]
    fn no_verdict_comes_within_the_hold_off_and_a_class_that_lasts_longer_follows_it() {
        // The 2 is only there in the hold-off; the background is noticed in it.
        assert_eq!(verdicts(&EVENTS, "1201.."), [0, 3]);
        assert_eq!(verdicts(&EVENTS, "122222"), [0, 3]);
        assert_eq!(verdicts(&EVENTS, "1211111"), [0]);
    }
}
