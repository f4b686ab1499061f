//! Recorded objects beside the outputs of a model of simulated ones.

use crate::ensemble::object_of;

/// A recorded object, and the outputs of the model that its touches may be of: one or, where they state no placement, several,
/// each with its share.
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) outputs: Vec<(String, f64)>,
}

impl Entry {
    pub(super) fn new(name: &str, outputs: Vec<(String, f64)>) -> Self {
        Self { name: name.to_owned(), outputs }
    }

    /// The share of tested touches of this name, recorded or simulated, in the object's.
    pub(super) fn share_of(&self, name: &str) -> f64 {
        let own = self.outputs.iter().find(|(output, _)| output == name).map(|(_, share)| *share);
        own.unwrap_or(f64::from(u8::from(self.name == name)))
    }

    /// The true object, regardless of its placement.
    pub(super) fn object(&self, has_placements: bool) -> &str {
        if has_placements && self.outputs.len() == 1 { object_of(&self.name) } else { &self.name }
    }
}
