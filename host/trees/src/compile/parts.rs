//! The parts of a compiled model, before they are written.

use palpate_shared::format::{Axis, EarlyExit, Group, Tag, write_section};

/// Parts of a layout of a forest.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) axes: Vec<Axis>,
    pub(super) cuts: Vec<u8>,
    pub(super) groups: Vec<Group>,
    pub(super) nodes: Vec<u8>,
    pub(super) leaves: Vec<u8>,
    /// The section with the leaves' values, where leaves are numbers.
    pub(super) shared: Option<Vec<u8>>,
    /// Places where a walk for a class alone may end.
    pub(super) exits: Vec<EarlyExit>,
    /// Starting values of the margins: in units, or f32 bits.
    pub(super) base: Vec<i32>,
    pub(super) unit: f32,
    pub(super) margin_error: f32,
}

impl Parts {
    /// The optional section with the values of leaves; nothing if there is none.
    pub(super) fn section(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        if let Some(content) = &self.shared {
            write_section(Tag::SharedLeaves, true, content, &mut |part| bytes.extend_from_slice(part));
        }
        bytes
    }

    /// The optional section with the places where walks may end; nothing if there are none.
    pub(super) fn exits_section(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        if !self.exits.is_empty() {
            let content: Vec<u8> = self.exits.iter().flat_map(|exit| exit.to_bytes()).collect();
            // Whoever does not know it walks on.
            write_section(Tag::EarlyExit, false, &content, &mut |part| bytes.extend_from_slice(part));
        }
        bytes
    }
}
