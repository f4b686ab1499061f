//! Objects to expect, and their frequencies, in whole numbers.

use super::evidence::Unit;
use core::fmt;

/// The evidence for an object that cannot be there: no number of touches makes it the best, and its weight is 0.
pub(crate) const IMPOSSIBLE: i64 = i64::MIN;

/// True unless the evidence for an object began as [`IMPOSSIBLE`], regardless of touches since.
pub(crate) const fn is_possible(evidence: i64) -> bool {
    evidence > IMPOSSIBLE / 2
}

/// No object is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NothingExpected;

impl fmt::Display for NothingExpected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("no object that the model knows is expected")
    }
}

impl core::error::Error for NothingExpected {}

/// The evidence before any touch, in units, for an object of this weight where the largest weight is `most`: the
/// logarithm of their ratio, rounded down.
///
/// Cost: two logarithms and a division, bit by bit. Cannot fail; a weight of 0 is [`IMPOSSIBLE`].
pub(crate) fn prior(weight: u32, most: u32, unit: Unit) -> i64 {
    if weight == 0 {
        return IMPOSSIBLE;
    }
    let bits = log2(most).saturating_sub(log2(weight));
    // The largest number of units that are at most that number of bits: at least 2^-24 nats each, so below 2^29. Found bit by
    // bit, since a division of 64 bits is dear on chips without one.
    let mut units = 0_u64;
    for bit in (0..30).rev() {
        let more = units | 1 << bit;
        if (more * u64::from(unit.bits)) >> (unit.shift & 63) <= bits {
            units = more;
        }
    }
    -(units.cast_signed())
}

/// The binary logarithm in Q32, rounded down; of 0 it is 0.
fn log2(number: u32) -> u64 {
    let Some(whole) = number.checked_ilog2() else { return 0 };
    // From 1 to 2 in Q31. Each squaring gives a bit of the fraction: whether the square is 2 or more.
    let mut rest = u64::from(number) << (31 - whole);
    let mut logarithm = u64::from(whole);
    for _ in 0..32 {
        rest = (rest * rest) >> 31;
        let bit = rest >> 32;
        rest >>= bit;
        logarithm = logarithm << 1 | bit;
    }
    logarithm
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decide::evidence::SHARPNESS;

    #[test]
    fn logarithms_are_within_a_billionth() {
        for number in [1, 2, 3, 7, 10, 1_000, 65_535, 65_536, 1 << 31, u32::MAX] {
            let exact = f64::from(number).log2();
            let found = log2(number) as f64 / 4_294_967_296.0;
            assert!((found - exact).abs() < 4e-9 && found <= exact + 1e-12, "{number}: {found} {exact}");
        }
        assert_eq!(log2(0), 0);
    }

    #[test]
    fn priors_are_logarithms_of_ratios_in_units() {
        for unit in [0.5, 1e-3, 2.0_f64.powi(-24)] {
            let bits = unit * core::f64::consts::LOG2_E * 4_294_967_296.0;
            let shift = (0..=63_u8).rev().find(|&shift| bits * f64::from(shift).exp2() < 4_294_967_295.0).unwrap();
            let of = |weight, most| {
                let unit = Unit { bits: (bits * f64::from(shift).exp2()).round() as u32, shift, sharpness: SHARPNESS };
                prior(weight, most, unit)
            };
            for (weight, most) in [(1, 1), (1, 2), (3, 10), (999, 1_000), (1, u32::MAX), (u32::MAX, u32::MAX)] {
                let exact = (f64::from(weight) / f64::from(most)).ln() / unit;
                assert!((of(weight, most) as f64 - exact).abs() <= 1.01 + 1e-8 / unit, "{weight}/{most}: {exact}");
            }
            assert_eq!(of(0, 5), i64::MIN);
        }
    }
}
