//! Status of a chip that is watched.

use crate::chip::Entry;
use std::collections::VecDeque;

/// Touches that are kept to be shown.
const KEPT: usize = 200;

/// Status of a chip that is watched.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Its source.
    pub source: String,
    /// The objects' names.
    pub objects: Vec<String>,
    /// The posterior of each object; empty while unknown.
    pub posteriors: Vec<f64>,
    /// The object that is being touched, where its name is known.
    pub truth: Option<String>,
    /// The last touches as lines, the newest first.
    pub touches: VecDeque<String>,
    /// The last verdict: `undecided`, `unknown`, or an object's name.
    pub verdict: String,
    /// The approach that the chip proposes next, as a line.
    pub next: Option<String>,
    /// Touches in all.
    pub count: u64,
    /// Touches per second, over the last second or so.
    pub rate: f64,
    /// Frames sent again.
    pub resent: u64,
    /// Garbled frames.
    pub garbled: u64,
    /// The chip's own events that were lost.
    pub missed: u64,
    /// True if nothing more will come.
    pub ended: bool,
    /// Times of recent touches, for the rate.
    recent: VecDeque<f64>,
}

impl Status {
    /// Nothing is known yet, except where it will come from.
    pub fn new(source: impl Into<String>) -> Self {
        Self { source: source.into(), verdict: "undecided".into(), ..Self::default() }
    }

    /// Learns from an entry. A model resets all the rest: each journal has one, as its first entry.
    pub fn take(&mut self, entry: &Entry) {
        match entry {
            Entry::Model { objects, .. } => {
                let source = std::mem::take(&mut self.source);
                *self = Self { objects: objects.clone(), ..Self::new(source) };
            }
            Entry::Object { name } => {
                self.truth.clone_from(name);
                self.verdict = "undecided".into();
                self.posteriors.clear();
                self.next = None;
            }
            Entry::Touch { verdict, posteriors, at, .. } => {
                self.count += 1;
                self.next = None;
                self.verdict.clone_from(verdict);
                if let Some(posteriors) = posteriors {
                    self.posteriors.clone_from(posteriors);
                }
                self.tick(*at);
                self.keep(entry.to_string());
            }
            Entry::Next { .. } => self.next = Some(entry.to_string()),
            Entry::Fault { .. } => self.keep(entry.to_string()),
            Entry::Link { resent, garbled, missed } => {
                (self.resent, self.garbled, self.missed) = (*resent, *garbled, *missed);
            }
        }
    }

    fn keep(&mut self, line: String) {
        self.touches.push_front(line);
        self.touches.truncate(KEPT);
    }

    /// Counts a touch at `at` seconds into the rate.
    fn tick(&mut self, at: f64) {
        self.recent.push_back(at);
        while self.recent.len() > 2 && self.recent.front().is_some_and(|&first| at - first > 1.0) {
            self.recent.pop_front();
        }
        let span = at - self.recent.front().copied().unwrap_or(at);
        self.rate = if span > 0.0 { (self.recent.len() - 1) as f64 / span } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proposed_approach_is_shown_until_the_next_touch() {
        let next = Entry::Next { pose: 48, direction: [0.0, 0.0, -1.0], alignment: [1.0, 0.0, 0.0], score: 0.25 };
        let mut status = Status::new("chip");
        status.take(&next);
        let line = "next: pose 48, along 0.00 0.00 -1.00, row 1.00 0.00 0.00, separation 0.250";
        assert_eq!(status.next.as_deref(), Some(line));
        status.take(&Entry::Touch {
            times: [Some(0); 3],
            verdict: "undecided".into(),
            best: "cup".into(),
            touches: 1,
            posteriors: None,
            at: 0.0,
        });
        assert_eq!(status.next, None);
    }

    #[test]
    fn another_journal_in_the_same_place_starts_from_nothing() {
        let model = |name: &str| Entry::Model { objects: vec![name.into()], length: 1, checksum: 2 };
        let mut status = Status::new("journal.jsonl");
        for entry in [model("old"), Entry::Object { name: Some("old".into()) }, Entry::Fault { what: "loose".into() }] {
            status.take(&entry);
        }
        status.take(&Entry::Link { resent: 1, garbled: 2, missed: 3 });
        assert_eq!(status.touches.len(), 1);
        status.take(&model("new"));
        let expected = Status { objects: vec!["new".into()], ..Status::new("journal.jsonl") };
        assert_eq!(status, expected);
    }
}
