//! Findings of a calibration of strangers, as they are shown.

use super::{Calibrated, OnRecordings, Settings};

/// A calibrated test of strangers in figures.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Found {
    /// "likely" or "certain".
    pub held: &'static str,
    /// The promised share of known objects' sequences that end as unknown.
    pub promised: f64,
    /// That share of the sequences that it was tested on, under thresholds for names that are at least as strict.
    pub false_alarms: f64,
    /// The sequences that it was tested on.
    pub sequences: u32,
    /// Touches before which no name is given.
    pub least_touches: u32,
    /// Touches used on average with known objects.
    pub mean_touches: f64,
    /// The same without the test.
    pub mean_touches_without: f64,
    /// Share of known objects' sequences detected after 30, 60 and 120 touches when their columns are not used.
    pub left_out: std::collections::BTreeMap<String, std::collections::BTreeMap<u32, f64>>,
    /// Results of recorded sequences, where the test was calibrated on recordings too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recorded: Option<OnRecordings>,
}

impl Found {
    /// The figures of a test that was calibrated with these settings.
    pub fn new(settings: &Settings, calibrated: &Calibrated) -> Self {
        let terms = &calibrated.terms;
        Self {
            held: settings.held.name(),
            promised: calibrated.recorded.as_ref().map_or(settings.alarms, |recorded| recorded.supported),
            false_alarms: calibrated.alarms as f64 / f64::from(terms.sequences.max(1)),
            sequences: terms.sequences,
            least_touches: terms.least,
            mean_touches: calibrated.mean_touches,
            mean_touches_without: calibrated.mean_touches_without,
            left_out: calibrated.left_out.clone(),
            recorded: calibrated.recorded.clone(),
        }
    }
}
