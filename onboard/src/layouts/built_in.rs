//! Layouts and types of leaves that this build reads: they are features of the crate, so that only what is used is
//! linked.

use palpate_shared::format::{Layout, LeafType};

/// True if models of a layout are read.
pub(crate) const fn layout(layout: Layout) -> bool {
    match layout {
        Layout::Compact => cfg!(feature = "compact"),
        Layout::Complete => cfg!(feature = "complete"),
        Layout::Grid => cfg!(feature = "grid"),
        Layout::Wide => cfg!(feature = "wide"),
        Layout::Patterns => cfg!(feature = "patterns"),
        Layout::Code => cfg!(feature = "code"),
    }
}

/// True if models with trees are read, and not only tables.
pub(crate) const TREES: bool = layout(Layout::Compact) || layout(Layout::Complete) || layout(Layout::Wide);

/// True if tables are read, where a search for a rank takes a large part of the time: it is written out then.
pub(crate) const TABLES: bool = layout(Layout::Grid) || layout(Layout::Patterns);

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
