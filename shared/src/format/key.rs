//! f32 values as integers in the same order.

use crate::MISSING_FEATURE;

/// Integer key of a feature's value, as models compare it: `f32_key(a) < f32_key(b)` exactly if `a < b`. -0 has the key of +0,
/// and NaN the key of a missing value, [`MISSING_FEATURE`].
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
