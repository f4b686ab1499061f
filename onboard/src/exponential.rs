//! Powers of two with a negative exponent, in fixed point: the only transcendental function on the chip.

/// 2^(-i/16) in Q31.
const SIXTEENTHS: [u32; 16] = [
    2_147_483_648,
    2_056_437_387,
    1_969_251_188,
    1_885_761_398,
    1_805_811_301,
    1_729_250_827,
    1_655_936_265,
    1_585_730_000,
    1_518_500_250,
    1_454_120_821,
    1_392_470_869,
    1_333_434_672,
    1_276_901_417,
    1_222_764_986,
    1_170_923_762,
    1_121_280_436,
];

/// 1 − x · (`LINEAR` − x · (`QUADRATIC` − x · `CUBIC`)), all in Q32, is the cubic closest to 2^-(x/16) for x from 0 to 1
/// among those that are 1 at 0; it is off by at most 1.5e-9.
const LINEAR: u32 = 186_065_157;
const QUADRATIC: u32 = 4_029_616;
const CUBIC: u32 = 56_985;

/// 2^-`exponent` in Q56, for an exponent in Q32. Beyond 57 it is 0.
///
/// Error: at most 1e-8 of the result, and 2^-57. Cost: five products, less than micromath and libm take for a coarser result
/// (the firmware's `exponential` prints the table, which the README of this crate has). Cannot fail.
pub fn exp2_negative(exponent: u64) -> u64 {
    let whole = exponent >> 32;
    if whole > 57 {
        return 0;
    }
    let fraction = low(exponent);
    let sixteenth = usize::try_from(fraction >> 28).unwrap_or(0);
    let rest = fraction << 4;
    let slope = LINEAR - high_product(rest, QUADRATIC - high_product(rest, CUBIC));
    let power = SIXTEENTHS.get(sixteenth).copied().unwrap_or(0);
    let power = power - high_product(power, high_product(rest, slope));
    (u64::from(power) << 25) >> whole
}

/// The low half.
fn low(number: u64) -> u32 {
    let [a, b, c, d, ..] = number.to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

/// The product's high half: that of two fractions in Q32.
fn high_product(a: u32, b: u32) -> u32 {
    low((u64::from(a) * u64::from(b)) >> 32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_within_the_stated_error() {
        let q32 = 4_294_967_296.0;
        let exponents = (0..64_u64 << 32).step_by(1_234_577);
        for exponent in exponents.chain([0, 1, (1 << 28) - 1, 1 << 28, (1 << 32) - 1, 1 << 32, 57 << 32]) {
            let exact = (-(exponent as f64) / q32).exp2() * 72_057_594_037_927_936.0;
            let error = (exp2_negative(exponent) as f64 - exact).abs();
            assert!(error <= exact * 1e-8 + 1.0, "2^-{}: {error}", exponent as f64 / q32);
        }
        assert_eq!(exp2_negative(0), 1 << 56);
        assert_eq!(exp2_negative(u64::MAX), 0);
    }

    #[test]
    fn powers_never_grow_with_the_exponent() {
        let mut previous = u64::MAX;
        for exponent in (0..3_u64 << 32).step_by(65_537) {
            let power = exp2_negative(exponent);
            assert!(power <= previous, "at {exponent}");
            previous = power;
        }
    }

    #[test]
    fn the_table_holds_the_nearest_values() {
        for (i, &power) in SIXTEENTHS.iter().enumerate() {
            assert_eq!(f64::from(power), ((-(i as f64) / 16.0).exp2() * 2_147_483_648.0).round(), "{i}");
        }
    }
}
