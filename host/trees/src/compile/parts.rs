//! The parts of a compiled model, before they are written.

use super::container::OwnedSection;
use palpate_shared::format::{Axis, Group, OutputScale, Tag};

/// Parts of a forest.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) axes: Vec<Axis>,
    pub(super) cuts: Vec<u8>,
    pub(super) groups: Vec<Group>,
    pub(super) nodes: Vec<u8>,
    pub(super) leaves: Vec<u8>,
    /// The section with the leaves' values, where leaves are numbers.
    pub(super) shared: Option<Vec<u8>>,
    /// Starting values of the margins: in units, or f32 bits.
    pub(super) base: Vec<i32>,
    pub(super) unit: f32,
    pub(super) margin_error: f32,
    /// The scale and the offset of each output, where leaves are centered.
    pub(super) scales: Vec<OutputScale>,
}

impl Parts {
    /// The optional section with the values of leaves.
    pub(super) fn sections(&self) -> Option<OwnedSection> {
        self.shared.as_ref().map(|content| OwnedSection::new(Tag::SharedLeaves, true, content.clone()))
    }

    /// Trees, as the chip reads them.
    pub(super) fn content(&self, priors: &[i32]) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.base.iter().chain(priors).flat_map(|number| number.to_le_bytes()).collect();
        bytes.extend(self.axes.iter().flat_map(|axis| axis.to_bytes()));
        bytes.extend(&self.cuts);
        bytes.extend(self.groups.iter().flat_map(|group| group.to_bytes()));
        bytes.extend(&self.nodes);
        bytes.extend(&self.leaves);
        bytes
    }
}
