//! Measurements that a report is written from.

use super::{cost, cross_validation, limit, noise, promises};

/// Results that the sections show; none of a part that was not chosen.
pub(super) struct Measured {
    pub(super) folds: Option<Vec<cross_validation::Fold>>,
    pub(super) noisy: Option<Vec<noise::Fold>>,
    pub(super) limit: Option<limit::Limit>,
    pub(super) promises: Option<promises::Promises>,
    pub(super) members: Option<Vec<cost::Member>>,
}
