//! Whether there are enough recorded touches for a promise.

use crate::calibrate;
use serde::Serialize;

/// The error rate that is promised, and the probability with which it is kept: `palpate calibrate`'s own.
const RATE: f64 = 0.01;
const CONFIDENCE: f64 = 0.95;

/// What `palpate calibrate` needs at least, to promise 1 % wrong names of all that are given: so many sequences without
/// any error, equally many of each object, of touches that the model was not taught with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Needed {
    /// Sequences of all objects together.
    pub sequences: usize,
    /// Sequences of each object.
    pub of_each: usize,
    /// Approaches that these take for one object.
    pub approaches: usize,
}

impl Needed {
    /// For so many objects, and sequences of so many approaches.
    pub(super) fn new(objects: usize, approaches: usize) -> Self {
        let sequences = usize::try_from(calibrate::needed(RATE, CONFIDENCE)).unwrap_or(usize::MAX);
        let of_each = sequences.div_ceil(objects.max(1));
        Self { sequences, of_each, approaches: of_each * approaches }
    }
}
