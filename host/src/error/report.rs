//! What can be wrong with the report and the main job.

/// What can be wrong with the report and the main job.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReportProblem {}

impl ReportProblem {
    /// What to do about it, as a sentence.
    pub fn fix(&self) -> String {
        match *self {}
    }
}
