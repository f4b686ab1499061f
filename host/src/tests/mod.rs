//! Tests of several rooms together, and helpers of all tests, which `tests/palpate` has too.

mod placements;
pub(crate) mod repetitions;
pub(crate) mod synthetic;
