//! The full model's recognizer.

use super::margins::{best, rivals};
use palpate_onboard::{Stopping, Verdict};

/// Recognizes with a full model: f32 margins, evidence in f64, and the stopping rule of the chip's recognizer.
#[derive(Clone, Debug)]
pub(super) struct FullRecognizer {
    evidence: Vec<f64>,
    stopping: Stopping,
    /// What the other objects' weights may come to, the best one's being 1.
    odds: f64,
    /// How many objects can be named.
    known: usize,
    touches: u32,
    verdict: Verdict,
}

impl FullRecognizer {
    /// A recognizer that has touched nothing yet; `prior` is the evidence for each object, in nats.
    /// The first `known` objects can be named.
    pub(super) fn new(prior: Vec<f64>, known: usize, stopping: Stopping) -> Self {
        let odds = stopping.error_rate() / (1.0 - stopping.error_rate());
        Self { evidence: prior, stopping, odds, known, touches: 0, verdict: Verdict::Undecided }
    }

    /// Takes in a touch by its margins, one for each object. After a verdict touches change nothing.
    pub(super) fn push(&mut self, margins: &[f32]) -> Verdict {
        if self.verdict != Verdict::Undecided {
            return self.verdict;
        }
        self.evidence.iter_mut().zip(margins).for_each(|(evidence, &margin)| *evidence += f64::from(margin));
        self.touches += 1;
        let best = best(&self.evidence[..self.known]);
        if rivals(&self.evidence, best, 1.0) <= self.odds {
            // There are at most 256 objects.
            self.verdict = Verdict::Recognized { object: best as u8, touches: self.touches };
        } else if self.touches >= self.stopping.max_touches() {
            self.verdict = Verdict::GaveUp;
        }
        self.verdict
    }

    /// The verdict after the last touch.
    pub(super) fn verdict(&self) -> Verdict {
        self.verdict
    }
}
