//! f32 values as integers in the same order.

use crate::MISSING_FEATURE;

/// An integer that stands to the keys of other values as `value` stands to those values: `a < b` in f32 is exactly
/// `f32_key(a) < f32_key(b)`, with -0 equal to +0; NaN is a missing value.
///
/// Cost: a few instructions, none of them in floating point. Cannot fail.
pub const fn f32_key(value: f32) -> i32 {
    let bits = value.to_bits();
    let magnitude = bits & 0x7fff_ffff;
    if magnitude > 0x7f80_0000 {
        return MISSING_FEATURE;
    }
    let magnitude = magnitude.cast_signed();
    if bits >> 31 == 0 { magnitude } else { -magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_ordered_as_their_values() {
        let values = [f32::NEG_INFINITY, f32::MIN, -1.5, -1.0, -f32::MIN_POSITIVE, -1e-45, 0.0, 1e-45, 1.0, f32::MAX];
        for a in values.into_iter().chain([f32::INFINITY, -0.0]) {
            for b in values {
                assert_eq!(a.partial_cmp(&b), Some(f32_key(a).cmp(&f32_key(b))), "{a} and {b}");
            }
            assert_ne!(f32_key(a), MISSING_FEATURE);
        }
        assert_eq!(f32_key(f32::NAN), MISSING_FEATURE);
        assert_eq!(f32_key(-f32::NAN), MISSING_FEATURE);
    }
}
