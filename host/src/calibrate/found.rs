//! Findings of a calibrated test for what a model does not know, as they are shown.

use serde::Serialize;

/// A calibrated test of strangers in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// The promised share of known objects' sequences that end as unknown.
    pub promised: f64,
    /// Share of known objects called unknown in the tested sequences, under thresholds for names that are at least as strict.
    pub false_alarms: f64,
    /// The sequences that it was tested on.
    pub sequences: u32,
    /// Touches used on average with known objects.
    pub mean_touches: f64,
    /// Touches used on average without the test.
    pub mean_touches_without: f64,
}
