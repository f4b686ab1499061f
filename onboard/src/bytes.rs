//! Reading bytes without a way to panic.

/// The element at `index`; the default beyond the end, which validated indices never reach.
#[inline(always)]
pub(crate) fn at<T: Copy + Default>(slice: &[T], index: usize) -> T {
    slice.get(index).copied().unwrap_or_default()
}

/// Splits `count` bytes off the front of `bytes`, or `None` when there are fewer.
pub(crate) fn take<'a>(bytes: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (front, rest) = bytes.split_at_checked(count)?;
    *bytes = rest;
    Some(front)
}

/// A signed little-endian number of one to four bytes.
pub(crate) fn signed<const WIDTH: usize>(bytes: &[u8; WIDTH]) -> i32 {
    match *bytes.as_slice() {
        [a] => i32::from(i8::from_le_bytes([a])),
        [a, b] => i32::from(i16::from_le_bytes([a, b])),
        [a, b, c] => i32::from_le_bytes([0, a, b, c]) >> 8,
        [a, b, c, d] => i32::from_le_bytes([a, b, c, d]),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_width_keep_their_sign() {
        assert_eq!(signed(&[0x80]), -128);
        assert_eq!(signed(&[0xfe, 0xff]), -2);
        assert_eq!(signed(&[0xff, 0xff, 0x7f]), 0x7f_ffff);
        assert_eq!(signed(&[0, 0, 0x80]), -0x80_0000);
        assert_eq!(signed(&i32::MIN.to_le_bytes()), i32::MIN);
    }
}
