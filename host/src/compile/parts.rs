//! The parts of a compiled model, before they are written.

use super::cost::Instructions;
use palpate_shared::format::{Axis, Group, HEADER_LENGTH};

/// What a layout makes of a forest.
pub(super) struct Parts {
    pub(super) axes: Vec<Axis>,
    pub(super) cuts: Vec<u8>,
    pub(super) groups: Vec<Group>,
    pub(super) nodes: Vec<u8>,
    pub(super) leaves: Vec<u8>,
    /// What margins start from: in units, or f32 bits.
    pub(super) base: Vec<i32>,
    pub(super) unit: f32,
    pub(super) margin_error: f32,
    pub(super) instructions: Instructions,
}

impl Parts {
    /// Bytes of the model, but for its text and what is the same in all layouts.
    pub(super) fn bytes(&self) -> usize {
        let records = Axis::LENGTH * self.axes.len() + Group::LENGTH * self.groups.len() + 8 * self.base.len();
        HEADER_LENGTH + records + self.cuts.len() + self.nodes.len() + self.leaves.len()
    }
}
