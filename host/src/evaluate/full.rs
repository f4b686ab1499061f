//! The full model's recognizer.

use super::margins::leading;
use crate::evidence::Follower;
use palpate_onboard::{Model, Rivals, Stopping, Verdict};

/// Recognizes with a full model: f32 margins, evidence in f64, and the stopping rule of the chip's recognizer.
#[derive(Clone, Debug)]
pub(super) struct FullRecognizer {
    prior: Vec<f64>,
    evidence: Vec<f64>,
    stopping: Stopping,
    /// For each object, the largest sum of the other objects' weights at which it is named, its own being 1.
    odds: Vec<f64>,
    /// Number of objects that can be named.
    known: usize,
    /// The number of each output's object, where several belong to one.
    numbers: Option<Vec<u8>>,
    touches: u32,
    /// The verdict after the last touch.
    pub(super) verdict: Verdict,
}

impl FullRecognizer {
    /// A recognizer that has touched nothing yet; `prior` is the evidence for each object, in nats, and only the first
    /// `known` can be named; `numbers` are those of their objects, where several outputs belong to one. Objects have
    /// thresholds of their own if the model that it is compared with has them.
    pub(super) fn new(
        prior: Vec<f64>,
        (known, numbers): (usize, Option<Vec<u8>>),
        stopping: Stopping,
        compiled: Option<&Model<'_>>,
    ) -> Self {
        let odds = |object| compiled.map_or(stopping.odds(), |model| stopping.odds_of(object, model));
        let odds = (0..prior.len()).map(|object| odds(object) as f64 / 72_057_594_037_927_936.0).collect();
        let evidence = prior.clone();
        Self { prior, evidence, stopping, odds, known, numbers, touches: 0, verdict: Verdict::Undecided }
    }

    /// The output that leads, and the sum of the weights of the others, its own being 1.
    fn leading(&self) -> (usize, f64) {
        leading(&self.evidence, self.known, self.numbers.as_deref(), 1.0)
    }
}

impl Follower for FullRecognizer {
    type Step = [f32];

    fn reset(&mut self) {
        self.evidence.clone_from(&self.prior);
        (self.touches, self.verdict) = (0, Verdict::Undecided);
    }

    fn push(&mut self, margins: &[f32]) -> Verdict {
        if self.verdict != Verdict::Undecided {
            return self.verdict;
        }
        self.evidence.iter_mut().zip(margins).for_each(|(evidence, &margin)| *evidence += f64::from(margin));
        self.touches += 1;
        let (best, weight) = self.leading();
        if weight <= self.odds[best] {
            // There are at most 256 objects.
            let rivals = Rivals::from_q56(self.rivals());
            self.verdict = Verdict::Recognized { object: best as u8, touches: self.touches, rivals };
        } else if self.touches >= self.stopping.max_touches() {
            self.verdict = Verdict::GaveUp;
        }
        self.verdict
    }

    fn leader(&self) -> usize {
        self.leading().0
    }

    fn rivals(&self) -> u64 {
        // Each object weighs 1 at most; a conversion saturates.
        (self.leading().1 * (1_u64 << 56) as f64) as u64
    }
}
