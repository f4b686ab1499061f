//! What this build reads: layouts and types of leaves are features of the crate, so that none is linked in vain.

use palpate_shared::format::{Layout, LeafType};

/// The feature that reads models of a layout, and whether it is built in.
pub(crate) const fn layout(layout: Layout) -> (&'static str, bool) {
    match layout {
        Layout::Compact => ("compact", cfg!(feature = "compact")),
        Layout::Complete => ("complete", cfg!(feature = "complete")),
        Layout::Grid => ("grid", cfg!(feature = "grid")),
        Layout::Wide => ("wide", cfg!(feature = "wide")),
    }
}

/// The feature that reads models of a type of leaf, and whether it is built in.
pub(crate) const fn leaf(leaf: LeafType) -> (&'static str, bool) {
    match leaf {
        LeafType::I8 => ("i8-leaves", cfg!(feature = "i8-leaves")),
        LeafType::I16 => ("i16-leaves", cfg!(feature = "i16-leaves")),
        LeafType::F32 => ("f32-leaves", cfg!(feature = "f32-leaves")),
    }
}
