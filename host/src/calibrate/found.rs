//! Findings of a calibrated test for what a model does not know, as they are shown.

use serde::Serialize;
use std::collections::BTreeMap;

/// A calibrated test of strangers in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// "likely" or "certain".
    pub held: &'static str,
    /// The promised share of known objects' sequences that end as unknown.
    pub promised: f64,
    /// Share of known objects called unknown in the tested sequences, under thresholds for names that are at least as strict.
    pub false_alarms: f64,
    /// The sequences that it was tested on.
    pub sequences: u32,
    /// Touches before which no name is given.
    pub least_touches: u32,
    /// Touches used on average with known objects.
    pub mean_touches: f64,
    /// Touches used on average without the test.
    pub mean_touches_without: f64,
    /// Share of known objects' sequences detected after 30, 60 and 120 touches when their columns are not used.
    pub left_out: BTreeMap<String, BTreeMap<u32, f64>>,
    /// Results of recorded sequences, where the test was calibrated on recordings too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded: Option<OnRecordings>,
}

/// Results of recorded sequences.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OnRecordings {
    /// Sequences that the threshold was tested on: of half of the recordings.
    pub sequences: usize,
    /// Sequences among them that ended as unknown.
    pub alarms: usize,
    /// The share of false alarms that so many sequences support: the promised one, or a higher one.
    pub supported: f64,
    /// Sequences of all recordings under a test that was calibrated on simulated touches alone.
    pub before: Alarms,
}

/// Recorded sequences under a test.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Alarms {
    /// All sequences: equally many of each object.
    pub sequences: usize,
    /// Sequences that ended as unknown, by object.
    pub objects: BTreeMap<String, usize>,
    /// True if they are more than the test's share allows but by chance: recorded and simulated misfit differ.
    pub differs: bool,
}

impl Alarms {
    /// Sequences that ended as unknown.
    pub fn all(&self) -> usize {
        self.objects.values().sum()
    }
}
