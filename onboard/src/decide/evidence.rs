//! Evidence of the touches so far for each object.

use crate::exponential::exp2_negative;
use palpate_shared::format::Weights;

/// A posterior probability, in Q56: fine enough to distinguish 1 − 1e-16 from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Posterior(pub(super) u64);

pub(super) const ONE: u64 = 1 << 56;

impl Posterior {
    /// The probability in Q56: 2^56 is 1.
    pub const fn q56(self) -> u64 {
        self.0
    }

    /// 1 for true, 0 for false.
    pub(super) const fn of(is_certain: bool) -> Self {
        Self(if is_certain { ONE } else { 0 })
    }

    /// The probability, rounded to f32. Cost: a conversion; in software on a chip without an FPU.
    pub const fn to_f32(self) -> f32 {
        self.0 as f32 / ONE as f32
    }

    /// The probability as f64.
    pub const fn to_f64(self) -> f64 {
        self.0 as f64 / ONE as f64
    }

    /// 1 − the probability as f64, exact where the probability itself is close to 1.
    pub const fn complement(self) -> f64 {
        ONE.saturating_sub(self.0) as f64 / ONE as f64
    }
}

/// Sum of the weights of all objects but one, that one's weight being 1: the number that a posterior is computed from, at no cost
/// until it is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rivals(u64);

impl Rivals {
    /// Rivals of this weight in Q56.
    pub const fn from_q56(weight: u64) -> Self {
        Self(weight)
    }

    /// Their weight in Q56.
    pub const fn q56(self) -> u64 {
        self.0
    }

    /// The posterior of the object that they are the rivals of: 1 / (1 + their weight).
    ///
    /// Cost: a long division, which an image that does not call this does not hold. Cannot fail.
    pub fn posterior(self) -> Posterior {
        Posterior(ONE - ratio(self.0, ONE.saturating_add(self.0)))
    }
}

/// Conversion of units of evidence into bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unit {
    pub(crate) bits: u32,
    pub(crate) shift: u8,
    /// Factor applied to bits, in Q16: one over the temperature.
    pub(crate) sharpness: u32,
}

/// Sharpness at a temperature of 1.
pub(crate) const SHARPNESS: u32 = 1 << 16;
/// The most bits that are multiplied, in Q32: there a weight is 0 at any sharpness, which is 2^12 to 2^20.
const MOST_BITS: u64 = 1 << 42;

impl Unit {
    /// The unit of evidence with a weight in Q16 that is at most 1, rounded down: in products of 32 bits.
    pub(crate) const fn weighed(self, weight: u32) -> Self {
        if !cfg!(feature = "row-evidence") || weight >= Weights::ONE {
            return self;
        }
        // Below 2^32 each, and together.
        let (high, low) = ((self.bits >> 16).wrapping_mul(weight), (self.bits & 0xffff).wrapping_mul(weight) >> 16);
        Self { bits: high.wrapping_add(low), ..self }
    }

    /// e^-(`ahead` units) in Q56.
    pub(super) fn weight(self, ahead: u64) -> u64 {
        // 2^32 units are at least 256 nats.
        let Ok(ahead) = u32::try_from(ahead).map(u64::from) else { return 0 };
        let bits = (ahead * u64::from(self.bits)) >> (self.shift & 63);
        if self.sharpness == SHARPNESS {
            return exp2_negative(bits);
        }
        exp2_negative((bits.min(MOST_BITS) * u64::from(self.sharpness)) >> 16)
    }
}

/// The object with the most evidence; the first of several.
///
/// Cost: a few instructions for each object.
pub(crate) fn best(evidence: &[i64]) -> (usize, i64) {
    let mut best = (0, i64::MIN);
    for (object, &evidence) in evidence.iter().enumerate() {
        if evidence > best.1 {
            best = (object, evidence);
        }
    }
    best
}

/// Sum of the weights of all objects but the best, the best one's weight being 1; `None` if that is more than `limit`
/// (Q56): if its posterior does not pass the threshold.
///
/// Cost: an exponential for each object, until it is clear that the answer is `None`; usually after the first rival.
// Where there is one call, it takes less flash there.
#[inline]
pub(crate) fn rivals(evidence: &[i64], (winner, most): (usize, i64), limit: u64, unit: Unit) -> Option<Rivals> {
    let mut left = limit;
    for (object, &evidence) in evidence.iter().enumerate() {
        if object != winner {
            left = left.checked_sub(unit.weight(most.abs_diff(evidence)))?;
        }
    }
    Some(Rivals(limit - left))
}

/// The posterior of one object.
///
/// Cost: an exponential for each object, and a long division. Error: at most 2e-8 of the smaller
/// one of the posterior and its complement, and 2^-55.
pub(crate) fn posterior(evidence: &[i64], object: usize, unit: Unit) -> Posterior {
    let best = best(evidence);
    // Of at most 255 rivals, each of which weighs 1 at most.
    let (Some(&own), Some(rivals)) = (evidence.get(object), rivals(evidence, best, u64::MAX, unit)) else {
        return Posterior(0);
    };
    if object == best.0 {
        return rivals.posterior();
    }
    Posterior(ratio(unit.weight(best.1.abs_diff(own)), ONE.saturating_add(rivals.0)))
}

/// `part` / `whole` in Q56, rounded down, for a part that is at most the whole: long division.
// By this name a test finds out whether an image holds it.
#[inline(never)]
pub(super) fn ratio(part: u64, whole: u64) -> u64 {
    let (mut rest, mut quotient) = (part, 0_u64);
    if rest >= whole {
        return ONE;
    }
    for _ in 0..56 {
        quotient <<= 1;
        // 2 · rest may not fit 64 bits, but 2 · rest − whole is below whole.
        let half = whole - rest;
        if rest >= half {
            rest -= half;
            quotient |= 1;
        } else {
            rest <<= 1;
        }
    }
    quotient
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A unit of a thousandth of a nat.
    pub(in crate::decide) fn unit() -> Unit {
        let bits = core::f64::consts::LOG2_E / 1000.0 * 4_294_967_296.0;
        Unit { bits: (bits * 256.0).round() as u32, shift: 8, sharpness: SHARPNESS }
    }

    #[test]
    fn posteriors_are_those_of_a_softmax_of_the_evidence_divided_by_the_temperature() {
        for sharpness in [1 << 12, 40_960, 59_578, SHARPNESS, 100_000, 1 << 20] {
            let evidence = [1000, 400, -2500, 999, i64::MIN];
            let weights = evidence.map(|e| (e as f64 / 1000.0 * f64::from(sharpness) / 65_536.0).exp());
            let sum: f64 = weights.iter().sum();
            for (object, weight) in weights.iter().enumerate() {
                let posterior = posterior(&evidence, object, Unit { sharpness, ..unit() }).to_f64();
                assert!((posterior - weight / sum).abs() < 2e-8, "{posterior} for {} at {sharpness}", weight / sum);
            }
            assert_eq!(posterior(&evidence, 5, Unit { sharpness, ..unit() }), Posterior(0));
        }
    }

    #[test]
    fn weighed_units_are_the_product_rounded_down() {
        for bits in [0, 1, 65_535, 65_536, 65_537, 123_456_789, 1 << 31, u32::MAX] {
            for weight in [1, 2, 3_333, 32_768, 65_535, 65_536] {
                let exact = (u64::from(bits) * u64::from(weight)) >> 16;
                assert_eq!(u64::from(Unit { bits, ..unit() }.weighed(weight).bits), exact, "{bits} {weight}");
            }
        }
    }

    #[test]
    fn posteriors_of_weighed_evidence_are_those_of_its_part() {
        let unit = unit().weighed(6_554);
        let posterior = posterior(&[46_000, 0], 0, unit).to_f64();
        let exact = 1.0 / (1.0 + (-46.0 * 6_554.0 / 65_536.0_f64).exp());
        assert!((posterior - exact).abs() < 2e-5, "{posterior} for {exact}");
    }

    #[test]
    fn rivals_are_what_a_decision_compares_with_the_odds() {
        for evidence in [&[0, 3_000, -400][..], &[5], &[7, 7, 7], &[i64::MAX, i64::MIN], &[100; 256]] {
            let best = best(evidence);
            let all = rivals(evidence, best, u64::MAX, unit()).unwrap();
            assert_eq!(rivals(evidence, best, all.q56(), unit()), Some(all));
            assert!(all.q56() == 0 || rivals(evidence, best, all.q56() - 1, unit()).is_none());
        }
    }

    #[test]
    fn posteriors_beyond_nine_nines_are_told_apart() {
        for nats in [20, 21, 25, 30, 34] {
            let posterior = posterior(&[nats * 1000, 0], 0, unit());
            let exact = 1.0 / (1.0 + (nats as f64).exp());
            assert!((posterior.complement() / exact - 1.0).abs() < 1e-6 + 6e-17 / exact, "{nats}: {posterior:?}");
            let loser = super::posterior(&[nats * 1000, 0], 1, unit()).to_f64();
            assert!((loser / exact - 1.0).abs() < 1e-6 + 6e-17 / exact);
        }
        assert_eq!(posterior(&[i64::MAX, i64::MIN], 0, unit()).q56(), ONE);
        assert_eq!(posterior(&[i64::MAX, i64::MIN], 1, unit()).q56(), 0);
    }

    #[test]
    fn a_tie_is_never_decided_and_splits_the_posterior() {
        for objects in [2, 3, 10, 256] {
            let evidence = std::vec![77; objects];
            assert_eq!(rivals(&evidence, best(&evidence), ONE - 1, unit()), None);
            for object in [0, objects - 1] {
                let posterior = posterior(&evidence, object, unit()).to_f64();
                assert!((posterior - 1.0 / objects as f64).abs() < 1e-9);
            }
        }
        assert_eq!(best(&[1, 5, 5]), (1, 5));
    }

    #[test]
    fn the_only_object_is_decided() {
        assert_eq!(rivals(&[0], best(&[0]), 0, unit()), Some(Rivals(0)));
        assert_eq!(posterior(&[-5], 0, unit()).q56(), ONE);
    }

    #[test]
    fn a_decision_is_where_the_posterior_passes() {
        for rate in [0.3, 0.1, 0.01, 1e-4, 1e-9] {
            let odds = rate / (1.0 - rate);
            let q56 = (odds * ONE as f64) as u64;
            let passes = |ahead: i64| rivals(&[0, ahead, -400], (1, ahead), q56, unit()).is_some();
            let exact = |ahead: i64| {
                let nats = |e: i64| (e as f64 / 1000.0).exp();
                (nats(0) + nats(-400)) / nats(ahead) <= odds
            };
            for ahead in 0..30_000 {
                assert_eq!(passes(ahead), exact(ahead), "{ahead} at {rate}");
            }
        }
    }
}
