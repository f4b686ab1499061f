//! Recorded touches of one object.

use super::observed::Observed;
use palpate_shared::Touch;
use palpate_shared::format::Counted;

/// Recorded touches of one object.
#[derive(Debug)]
pub(super) struct Recording<'a> {
    pub(super) name: &'a str,
    pub(super) touches: Vec<Observed>,
    pub(super) kept: Counted,
}

impl<'a> Recording<'a> {
    pub(super) fn new(name: &'a str, touches: &[Touch], kept: Counted) -> Self {
        Self { name, touches: touches.iter().map(Observed::of).collect(), kept }
    }
}
