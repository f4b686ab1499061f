//! Imports that most tests need, and helpers for touches.

pub(crate) use crate::repetitions::repetitions;
pub(crate) use palpate::compile::CompiledModel;
pub(crate) use palpate::ensemble::{
    Ensemble, Inputs, Node, Output, OverTouches, Provenance, StatedProbe, TouchOrigin, Tree,
};
pub(crate) use palpate::error::Kind;
pub(crate) use palpate::evaluate::{Margins, SequentialSettings};
pub(crate) use palpate::mesh::{Mesh, Object};
pub(crate) use palpate::onboard::{Model, Recognizer, Stopping, Verdict};
pub(crate) use palpate::probe::approach::Probe;
pub(crate) use palpate::probe::noise::Noise;
pub(crate) use palpate::random::{Purpose, generator};
pub(crate) use palpate::shared::format::{Counted, Length, Per};
pub(crate) use palpate::shared::{ContactTime, Descriptor, Pose, Q15_ONE, Touch};
pub(crate) use palpate::touches::{Dataset, ObjectTouches, Origin, Recorded, Source};
pub(crate) use palpate::with;
pub(crate) use std::collections::BTreeMap;
pub(crate) use std::path::Path;
pub(crate) use std::sync::LazyLock;

/// Asserts that what fails with a probability of at most `share` did not fail more often than that: a binomial test at 1 %.
pub(crate) fn assert_rare(what: &str, failures: u64, repetitions: u64, share: f64) {
    // Of 40 at most 6, of 200 at most 18, where the share is 5 %.
    let (mut most, all) = (0, repetitions as f64);
    let mut exactly = (1.0 - share).powf(all);
    let mut at_most = exactly;
    while at_most < 0.99 {
        exactly *= (all - most as f64) / (most as f64 + 1.0) * share / (1.0 - share);
        at_most += exactly;
        most += 1;
    }
    println!("{what}: {failures} of {repetitions} failed; at most {most} may");
    assert!(failures <= most, "{what}: {failures} of {repetitions} failed; at most {most} may");
}

/// The touches that `keep` says.
pub(crate) fn filtered(object: &ObjectTouches, keep: impl Fn(&Touch) -> bool) -> ObjectTouches {
    object.each_pool(|_, touches| touches.iter().copied().filter(&keep).collect())
}

/// Touches of an object of one source, each changed.
pub(crate) fn changed(object: &ObjectTouches, change: impl FnMut(&Touch) -> Touch) -> ObjectTouches {
    ObjectTouches::new(&object.name, object.touches().iter().map(change).collect(), Source::Object)
}
