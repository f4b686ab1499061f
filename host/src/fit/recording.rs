//! Recorded touches of one object, and how likely they are.

use super::likelihood::Explained;
use super::observed::Observed;
use super::posed::{self, InPose};
use palpate_shared::Touch;
use palpate_shared::format::Counted;

/// Recorded touches of one object.
#[derive(Debug)]
pub(super) struct Recording<'a> {
    pub(super) name: &'a str,
    pub(super) touches: Vec<Observed>,
    /// Simulated approaches in the pose of each touch; empty if no touch has one.
    pub(super) in_poses: Vec<Option<InPose>>,
    pub(super) kept: Counted,
}

impl<'a> Recording<'a> {
    /// The recording without its poses.
    pub(super) fn without_poses(name: &'a str, touches: &[Touch], kept: Counted) -> Self {
        Self { name, touches: touches.iter().map(Observed::of).collect(), in_poses: Vec::new(), kept }
    }

    /// The logarithm of its likelihood, of the object and under the candidate that explain it; poses count where there are some.
    pub(super) fn log_likelihood(&self, explained: &Explained<'_>) -> f64 {
        if self.in_poses.is_empty() {
            return explained.log_likelihood(&self.touches);
        }
        let of = |(touch, in_pose): (&Observed, &Option<InPose>)| match in_pose {
            Some(in_pose) => posed::log_density(explained, touch, in_pose),
            None => explained.log_density(touch),
        };
        self.touches.iter().zip(&self.in_poses).map(of).sum()
    }
}
