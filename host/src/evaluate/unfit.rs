//! Models that are not for what they are given.

use crate::error::{Error, problem};
use palpate_onboard::CapacityError;

/// The problem of touches for a model over rows of features.
pub fn raw_features() -> Error {
    problem!("the model works on rows of features, not on touches")
        .fix("Give it rows of features, as the commands of `palpate rows` do.")
}

/// The problem of rows of features for a model over touches.
pub fn over_touches() -> Error {
    problem!("the model is over touches, not over rows of features")
        .fix("Use `palpate verify` and `palpate evaluate` for models of touches.")
}

/// The problem of a model with more objects than a recognizer has room for.
pub fn too_many_objects(CapacityError { objects, capacity }: CapacityError) -> Error {
    problem!("the model has {objects} objects, and the recognizer has room for {capacity}")
        .fix("Use a model of fewer objects.")
}
