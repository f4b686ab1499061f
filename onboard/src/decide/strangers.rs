//! Misfit test: do the touches so far fit the object with the most evidence, or none that the model knows?

use super::evidence::best;
use super::expected::is_possible;
use crate::exponential::exp2_negative;
use crate::model::Model;
use palpate_shared::format::{MisfitTerms, MisfitTest, ObjectMisfit};

/// Result of a model's misfit test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Familiarity {
    /// The object with the most evidence may be named: its touches fit, and enough were made. Always without a test.
    Known,
    /// No name yet: too few touches.
    Doubtful,
    /// The touches do not fit the object with the most evidence: the model does not know the touched one.
    Stranger,
}

/// The object with the most evidence among those that can be named.
pub(crate) fn leader(model: &Model<'_>, evidence: &[i64]) -> (usize, i64) {
    best(evidence.get(..model.known_count()).unwrap_or(evidence))
}

/// True if the background has more evidence than any other object.
pub(crate) fn is_background(model: &Model<'_>, evidence: &[i64], most: i64) -> bool {
    model.background().and_then(|background| evidence.get(background)).is_some_and(|&background| background > most)
}

/// Result of the model's test about evidence, priors included, that is the sum of `touches` touches.
///
/// Cost: without a test a few instructions for each optional section; with one some more for each rival, a
/// multiplication for each number of the triangle (45 for nine rivals, 55 for ten), an exponential and a 64-bit division.
/// Cannot fail or overflow: sums saturate.
pub(crate) fn familiarity(model: &Model<'_>, evidence: &[i64], leader: usize, touches: u32) -> Familiarity {
    let Some(test) = model.strangers().and_then(|strangers| strangers.test) else { return Familiarity::Known };
    if touches < test.terms.first {
        return Familiarity::Doubtful;
    }
    let Some(misfit) = misfit(&test, model, evidence, leader, touches) else { return Familiarity::Known };
    let most = early(&test.terms, touches).saturating_add(test.terms.threshold.into());
    if misfit > most { Familiarity::Stranger } else { Familiarity::Known }
}

impl Model<'_> {
    /// Misfit of the evidence for each object, priors included, of `touches` touches with the object with the most, in
    /// 2^-16 nats: the number that the model's test compares with its limits. `None` without a test.
    ///
    /// Cost: as the test in [`Recognizer::push`](crate::Recognizer::push). Cannot fail.
    pub fn misfit(&self, evidence: &[i64], touches: u32) -> Option<i64> {
        let test = self.strangers()?.test?;
        misfit(&test, self, evidence, leader(self, evidence).0, touches)
    }
}

/// Misfit of the touches with the leader, in 2^-16 nats. `None` for an object without a record, which no valid model
/// has.
fn misfit(test: &MisfitTest<'_>, model: &Model<'_>, evidence: &[i64], leader: usize, touches: u32) -> Option<i64> {
    let object = test.object(leader)?;
    // Of an object that cannot be there nothing is known: as if it had its mean.
    let sum = |object: usize| evidence.get(object).copied().filter(|&sum| is_possible(sum));
    let own = |object: usize| sum(object).map(|sum| sum.saturating_sub(i64::from(model.prior(object))));
    let mut ahead = [0_i32; MisfitTest::MOST_RIVALS];
    for ((ahead, &rival), index) in ahead.iter_mut().zip(object.rivals).zip(0..) {
        let mean = i64::from(object.mean(index)) << (object.mean_shift & 63).min(ObjectMisfit::MOST_SHIFT);
        // 2^15 · 2^40 does not overflow; times the number of touches it may, and saturates.
        let expected = mean.saturating_mul(touches.into());
        if let (Some(rival), Some(leader)) = (own(rival.into()), own(leader)) {
            *ahead = held(rival.saturating_sub(leader).saturating_sub(expected));
        }
    }
    let ahead = ahead.get(..object.rivals.len()).unwrap_or_default();
    let (mut squares, mut slope) = (0_u64, 0_i64);
    for (row, &own) in ahead.iter().enumerate() {
        // Of at most 16 products below 2^46 each.
        let sum: i64 =
            ahead.iter().take(row + 1).zip(0..).map(|(&r, column)| product(object.weight(row, column), r)).sum();
        let whitened = u64::from(held(sum >> (object.weight_shift & 63)).unsigned_abs());
        squares = squares.saturating_add(whitened * whitened);
        slope += product(object.slope(row), own);
    }
    let mean = squares / u64::from(touches.max(1));
    let constant = i64::from(object.constant).saturating_mul(touches.into());
    Some(
        i64::try_from(mean)
            .unwrap_or(i64::MAX)
            .saturating_add(slope >> (object.slope_shift & 63))
            .saturating_sub(constant),
    )
}

fn product(weight: i16, number: i32) -> i64 {
    i64::from(weight) * i64::from(number)
}

/// Within ±(2^31 − 1).
fn held(number: i64) -> i32 {
    const MOST: i64 = i32::MAX as i64;
    i32::try_from(number.clamp(-MOST, MOST)).unwrap_or(i32::MAX)
}

/// Amount by which the limits are higher after this number of touches, in 2^-16 nats.
fn early(terms: &MisfitTerms, touches: u32) -> i64 {
    let left = exp2_negative(u64::from(touches) * u64::from(terms.halving)) >> 24;
    // Below 2^31 · 2^32.
    i64::try_from((u64::from(terms.early) * left) >> 32).unwrap_or(i64::MAX)
}
