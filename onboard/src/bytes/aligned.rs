//! Models where chips read them fastest.

/// A value that starts at a multiple of four. A model may start anywhere, but a Cortex-M0+ is faster where its numbers
/// are aligned.
#[derive(Clone, Copy, Debug)]
#[repr(align(4))]
pub struct Aligned<T: ?Sized>(pub T);

/// A value that starts at a multiple of eight, as evidence does: one of the compiler's routines then clears all of it,
/// instead of one for each alignment.
#[repr(align(8))]
pub(crate) struct AlignedTo8<T>(pub(crate) T);

/// The bytes of a file, as `include_bytes!`, at a multiple of four: `include_model!("model.palpate")`.
#[macro_export]
macro_rules! include_model {
    ($path:expr) => {{
        const MODEL: &$crate::Aligned<[u8]> = &$crate::Aligned(*include_bytes!($path));
        &MODEL.0
    }};
}

#[cfg(test)]
mod tests {
    #[test]
    fn an_included_file_is_aligned_and_whole() {
        let text: &'static [u8] = include_model!("aligned.rs");
        assert_eq!(text.as_ptr().addr() % 4, 0);
        assert_eq!(text, include_bytes!("aligned.rs"));
    }
}
