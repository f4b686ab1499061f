//! Fixed point.

/// Makes Q16 of f32 values' bits.
///
/// Cost: a few instructions for each. Cannot fail.
#[inline(never)]
pub(crate) fn make_q16(bits: &mut [i32]) {
    for bits in bits {
        *bits = q16_from_f32_bits(bits.cast_unsigned());
    }
}

/// A finite f32, given by its bits, in Q16, rounded half away from zero and held within ±2^30. NaN is 0.
///
/// Cost: a few instructions, none of them in floating point. Cannot fail.
pub(crate) fn q16_from_f32_bits(bits: u32) -> i32 {
    const LIMIT: i32 = 1 << 30;
    let exponent = bits >> 23 & 0xff;
    let mantissa = (bits & 0x7f_ffff | 0x80_0000).cast_signed();
    // The value is mantissa · 2^(exponent − 150), so in Q16 mantissa · 2^(exponent − 134).
    let magnitude = match exponent {
        0..=109 => 0,
        110..=133 => {
            let half = 1 << (133 - exponent);
            (mantissa + half) >> (134 - exponent)
        }
        134..=140 => mantissa.wrapping_shl(exponent - 134).min(LIMIT),
        255 if bits & 0x7f_ffff != 0 => 0,
        _ => LIMIT,
    };
    if bits >> 31 == 0 { magnitude } else { -magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn q16_is_the_nearest_within_limits() {
        let near = [0.0, -1.0, 0.5, 1e-5, -1e-5, 7.6e-6, 7.7e-6, 1e-30, 16383.99, 300.123, -12345.678, 1.5 / 65536.0];
        for bits in near.map(f32::to_bits).into_iter().chain((0..0x4680_0000_u32).step_by(99_991)) {
            let value = f64::from(f32::from_bits(bits));
            assert_eq!(f64::from(q16_from_f32_bits(bits)), (value * 65536.0).round(), "{value}");
        }
        for (value, expected) in [(1e30, 1 << 30), (f32::INFINITY, 1 << 30), (-16384.5, -(1 << 30)), (f32::NAN, 0)] {
            assert_eq!(q16_from_f32_bits(f32::to_bits(value)), expected, "{value}");
        }
    }
}
