//! Layouts and types of leaves that this build reads: they are features of the crate, so that only what is used is
//! linked.

use palpate_shared::format::{Layout, LeafType};

/// True if models of a layout are read.
pub(crate) const fn layout(layout: Layout) -> bool {
    match layout {
        Layout::Compact => cfg!(feature = "compact"),
        Layout::Wide => cfg!(feature = "wide"),
        Layout::Code => cfg!(feature = "code"),
    }
}

/// True if models with trees are read, and not only those whose trees are code.
pub(crate) const TREES: bool = layout(Layout::Compact) || layout(Layout::Wide);

/// True if trees with leaves in a table are read.
pub(crate) const SHARED_LEAVES: bool = TREES && cfg!(feature = "shared-leaves");

/// True if models with a type of leaf are read.
pub(crate) const fn leaf(leaf: LeafType) -> bool {
    match leaf {
        LeafType::I8 => cfg!(feature = "i8-leaves"),
        LeafType::I16 => cfg!(feature = "i16-leaves"),
        LeafType::F32 => cfg!(feature = "f32-leaves"),
    }
}
