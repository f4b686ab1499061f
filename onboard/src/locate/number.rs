//! Fixed-point numbers of the follower: logarithms in 1/64 nat, angles in 1/256 turn, sines in Q14.

use crate::bytes::at;

/// A nat.
pub(super) const NAT: i32 = 64;
/// The logarithm of 0: less than any that a cell can have.
pub(super) const NOTHING: i32 = -32_000;
/// log2(e) / 64 in Q32: turns logarithms into exponents of two.
const BITS: u64 = 96_817_625;
/// ln(2) · 64 / 256 in Q16: turns eighth bits of a logarithm to base two back.
const FROM_BITS: i32 = 11_357;

/// Sines of the first quarter turn.
const QUARTER: [i16; 65] = [
    0, 402, 804, 1205, 1606, 2006, 2404, 2801, 3196, 3590, 3981, 4370, 4756, 5139, 5520, 5897, 6270, 6639, 7005, 7366,
    7723, 8076, 8423, 8765, 9102, 9434, 9760, 10080, 10394, 10702, 11003, 11297, 11585, 11866, 12140, 12406, 12665,
    12916, 13160, 13395, 13623, 13842, 14053, 14256, 14449, 14635, 14811, 14978, 15137, 15286, 15426, 15557, 15679,
    15791, 15893, 15986, 16069, 16143, 16207, 16261, 16305, 16340, 16364, 16379, 16384,
];

/// e^(-i/64) in Q16, less one unit at 0.
const POWERS: [u16; 1024] = {
    // e^(-1/64) in Q62.
    let (factor, mut power, mut powers, mut index) = (4_540_188_453_729_421_605_u64, 1_u64 << 62, [0; 1024], 0);
    while index < powers.len() {
        let rounded = (power + (1 << 45)) >> 46;
        powers[index] = if rounded > 65_535 { 65_535 } else { rounded as u16 };
        power = ((power as u128 * factor as u128) >> 62) as u64;
        index += 1;
    }
    powers
};

/// 256 · log2(1 + i/256).
const LOGARITHMS: [u8; 256] = {
    let (mut logarithms, mut index) = ([0; 256], 0);
    while index < logarithms.len() {
        // Each squaring yields a bit; nine of them, to round.
        let (mut number, mut bits, mut bit) = ((1_u64 << 32) + ((index as u64) << 24), 0_u32, 0);
        while bit < 9 {
            number = ((number as u128 * number as u128) >> 32) as u64;
            bits <<= 1;
            if number >> 33 != 0 {
                number >>= 1;
                bits |= 1;
            }
            bit += 1;
        }
        let rounded = (bits + 1) >> 1;
        logarithms[index] = if rounded > 255 { 255 } else { rounded as u8 };
        index += 1;
    }
    logarithms
};

/// The quotient of two numbers; 0 where that is none, which no maps lead to.
#[inline(always)]
pub(super) fn quotient(number: i32, divisor: i32) -> i32 {
    number.checked_div(divisor).unwrap_or(0)
}

/// The sine of an angle. Cost: a few instructions.
#[inline(always)]
pub(super) fn sine(angle: i32) -> i32 {
    let [angle, ..] = angle.to_le_bytes();
    let (half, half_turns) = (angle & 127, angle >> 7);
    let quarter = if half > 64 { 128 - half } else { half };
    let sine = i32::from(at(&QUARTER, usize::from(quarter)));
    if half_turns == 1 { -sine } else { sine }
}

/// Cosine and sine of an angle.
#[inline(always)]
pub(super) fn direction(angle: i32) -> (i32, i32) {
    (sine(angle.wrapping_add(64)), sine(angle))
}

/// e^-`nats` in Q16, for nats in 1/64; at most 65,535. Cost: a few instructions.
#[inline(always)]
pub(super) fn power(nats: i32) -> u32 {
    match usize::try_from(nats) {
        Ok(nats) => u32::from(at(&POWERS, nats)),
        Err(_) => 65_535,
    }
}

/// The natural logarithm in 1/64, within one of them; [`NOTHING`] of 0.
pub(super) fn logarithm(number: u64) -> i32 {
    let Some(bits) = number.checked_ilog2() else { return NOTHING };
    let fraction = if bits >= 8 { number >> (bits - 8) } else { number << (8 - bits) };
    let [fraction, ..] = fraction.to_le_bytes();
    let eighths = bits.cast_signed() * 256 + i32::from(at(&LOGARITHMS, usize::from(fraction)));
    (eighths * FROM_BITS) >> 16
}

/// The logarithm of a sum in Q16.
pub(super) fn of_sum(sum: u64) -> i32 {
    if sum == 0 { NOTHING } else { logarithm(sum) - 16 * 256 * FROM_BITS / 65_536 }
}

/// ln(e^a + e^b).
pub(super) fn add(a: i32, b: i32) -> i32 {
    let (larger, smaller) = (a.max(b), a.min(b));
    larger + of_sum(65_536 + u64::from(power(larger - smaller)))
}

/// e^-`nats` for a difference of logarithms, in Q56; more than 2^8 counts as much.
pub(super) fn odds(nats: i32) -> u64 {
    let bits = u64::from(nats.unsigned_abs()).saturating_mul(BITS);
    if nats >= 0 {
        return crate::exp2_negative(bits);
    }
    (8_u64 << 32).checked_sub(bits).map_or(u64::MAX, |left| crate::exp2_negative(left).saturating_mul(1 << 8))
}

/// Random numbers for choices that must be the same on every machine: xorshift.
#[derive(Clone, Copy, Debug)]
pub(super) struct Random(pub(super) u32);

impl Random {
    pub(super) fn next(&mut self) -> u32 {
        let Self(state) = self;
        *state ^= *state << 13;
        *state ^= *state >> 17;
        *state ^= *state << 5;
        *state
    }

    /// Between 0 and `end`, which it stays below; 0 if that is 0.
    pub(super) fn below(&mut self, end: u32) -> u32 {
        self.next().checked_rem(end).unwrap_or(0)
    }

    /// Within `half` of 0.
    pub(super) fn within(&mut self, half: i32) -> i32 {
        let half = half.max(1);
        self.below(2 * half.unsigned_abs()).cast_signed() - half
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_powers_and_logarithms_are_those_of_f64() {
        for angle in -300..600 {
            let exact = 16_384.0 * (f64::from(angle) * std::f64::consts::TAU / 256.0).sin();
            assert!((f64::from(sine(angle)) - exact).abs() <= 0.5, "{angle}");
        }
        for nats in 0..1_100 {
            let exact = 65_536.0 * (-f64::from(nats) / 64.0).exp();
            assert!((f64::from(power(nats)) - exact).abs() <= 1.0, "{nats}");
        }
        for number in (1..2_000).chain((0..40).map(|shift| (1 << shift) + 1)) {
            let exact = 64.0 * (number as f64).ln();
            assert!((f64::from(logarithm(number)) - exact).abs() <= 1.3, "{number}");
        }
        assert_eq!((power(-1), logarithm(0), sine(64), sine(-64)), (65_535, NOTHING, 16_384, -16_384));
        assert!((f64::from(add(-100, -100)) - (-100.0 + 64.0 * 2_f64.ln())).abs() <= 1.5);
        assert_eq!(add(0, NOTHING), 0);
        for nats in -354..1_200 {
            let exact = (-f64::from(nats) / 64.0).exp();
            assert!((odds(nats) as f64 / (1_u64 << 56) as f64 / exact - 1.0).abs() < 1e-4, "{nats}");
        }
        assert_eq!(odds(-400), u64::MAX);
    }
}
