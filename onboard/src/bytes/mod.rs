//! Fast reading of bytes without a way to panic, and reasons why bytes are not a model.

mod aligned;
mod error;

pub use aligned::Aligned;
pub(crate) use aligned::AlignedTo8;
pub use error::ModelError;
pub(crate) use error::Wrong;

/// The element at `index`; the default beyond the end, which validated indices never reach.
#[inline(always)]
pub(crate) fn at<T: Copy + Default>(slice: &[T], index: usize) -> T {
    slice.get(index).copied().unwrap_or_default()
}

/// Splits `count` bytes off the front of `bytes`, or returns `None` if there are fewer.
#[inline(never)]
pub(crate) fn take<'a>(bytes: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (front, rest) = bytes.split_at_checked(count)?;
    *bytes = rest;
    Some(front)
}
