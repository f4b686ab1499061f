//! Evidence that no verdict ends.

use super::Follower;
use palpate_onboard::{Familiarity, Model, Recognizer, Stopping, Verdict};

/// A model's margins, summed as on a chip, without thresholds: for what is known after any number of steps.
pub(crate) struct Sums<'m> {
    model: &'m Model<'m>,
    priors: Vec<i64>,
    evidence: Vec<i64>,
    /// The number of each output's object, where several belong to one.
    numbers: Option<Vec<u8>>,
}

impl<'m> Sums<'m> {
    /// Sums that begin with the model's priors, or with those of weights that say how often each object is touched.
    pub(crate) fn new(model: &'m Model<'m>, weights: Option<&[u32]>) -> Self {
        let own = || (0..model.object_count()).map(|object| model.prior(object).into()).collect();
        let told = weights.and_then(|weights| {
            let mut recognizer = Recognizer::<256>::new(model, Stopping::from_odds(0, u32::MAX)).ok()?;
            recognizer.reset_to(weights).ok()?;
            Some(recognizer.evidence().to_vec())
        });
        let priors: Vec<i64> = told.unwrap_or_else(own);
        let numbers = model.outputs().map(|outputs| outputs.objects().collect());
        Self { model, evidence: priors.clone(), priors, numbers }
    }

    /// The sums, in the model's units.
    #[cfg(feature = "train")]
    pub(crate) fn evidence(&self) -> &[i64] {
        &self.evidence
    }

    /// The output with the most evidence of the object that leads, and the sum of the other objects' weights, its own being 1.
    /// `unit` is a unit of evidence in nats.
    pub(crate) fn leading(&self, unit: f64) -> (usize, f64) {
        leading(&self.evidence, self.model.known_count(), self.numbers.as_deref(), unit)
    }
}

impl Follower for Sums<'_> {
    type Step = [i32];

    fn reset(&mut self) {
        self.evidence.clone_from(&self.priors);
    }

    fn push(&mut self, margins: &[i32]) -> Verdict {
        // The sum of an object that is not expected is the least number there is.
        let sums = self.evidence.iter_mut().zip(margins);
        sums.for_each(|(sum, &margin)| *sum = sum.saturating_add(margin.into()));
        Verdict::Undecided
    }

    fn leader(&self) -> usize {
        match self.numbers {
            None => best(&self.evidence[..self.model.known_count()]),
            Some(_) => self.leading(self.model.unit().into()).0,
        }
    }

    fn rivals(&self) -> u64 {
        // A conversion saturates.
        (self.leading(self.model.unit().into()).1 * (1_u64 << 56) as f64) as u64
    }

    fn familiarity(&self) -> Familiarity {
        Familiarity::Known
    }

    fn is_same(&self, one: usize, other: usize) -> bool {
        self.model.is_same_object(one, other)
    }
}

/// The object with the most evidence; the first of several, as on the chip.
pub(crate) fn best<T: PartialOrd>(evidence: &[T]) -> usize {
    (1..evidence.len()).fold(0, |best, object| if evidence[object] > evidence[best] { object } else { best })
}

/// The output with the most evidence of the object that leads, and the sum of the other objects' weights, its own being 1. The
/// first `known` outputs can be named; `numbers` are those of their objects, where several belong to one.
fn leading(evidence: &[i64], known: usize, numbers: Option<&[u8]>, unit: f64) -> (usize, f64) {
    let ahead = |output: usize, of: i64| (evidence[output].saturating_sub(of) as f64 * unit).exp();
    let Some(numbers) = numbers else {
        let best = best(&evidence[..known]);
        let others = (0..evidence.len()).filter(|&object| object != best);
        return (best, others.map(|object| ahead(object, evidence[best])).sum());
    };
    let most = evidence.iter().copied().max().unwrap_or(0);
    let object = |number: u8| (0..known).filter(move |&output| numbers[output] == number);
    let last = numbers[..known].last().copied().unwrap_or(0);
    let sums: Vec<f64> = (0..=last).map(|number| object(number).map(|output| ahead(output, most)).sum()).collect();
    let leader = best(&sums);
    let outputs: Vec<usize> = object(leader as u8).collect();
    let strongest = best(&outputs.iter().map(|&output| evidence[output]).collect::<Vec<_>>());
    let all: f64 = (0..evidence.len()).map(|output| ahead(output, most)).sum();
    (outputs[strongest], (all - sums[leader]) / sums[leader])
}
