//! Options for objects that a model does not know.

use super::progress::Bar;
use palpate::Result;
use palpate::mesh::builtin::BACKGROUND_SHAPES;
use palpate::strangers::{self, Calibrated, Settings};
use palpate::touches::{Dataset, ObjectTouches};
use palpate_shared::format::Held;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Whether, and how, a model is to find out what it does not know.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct StrangersArguments {
    /// Detect objects that the model does not know; certain also holds names back until strangers would be detected
    #[arg(long, value_parser = held, value_name = "off|likely|certain")]
    strangers: Option<Wanted>,
    /// Touches of many other shapes; they tell what strangers are like [default: of 200 shapes, captured as DIR was]
    #[arg(long, value_name = "DIR", requires = "strangers")]
    background: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug)]
struct Wanted(Option<Held>);

/// What a calibration found out about strangers.
#[derive(serde::Serialize)]
pub(crate) struct Found {
    /// "likely" or "certain".
    held: &'static str,
    /// The promised share of known objects' sequences that end as unknown.
    promised: f64,
    /// That share of the sequences that it was tested on, under thresholds for names that are at least as strict.
    false_alarms: f64,
    sequences: u32,
    /// Touches before which no name is given.
    least_touches: u32,
    /// Touches used on average with known objects, and without the test.
    mean_touches: f64,
    mean_touches_without: f64,
    /// Share of known objects' sequences found out after 30, 60 and 120 touches when their columns are not used.
    left_out: std::collections::BTreeMap<String, std::collections::BTreeMap<u32, f64>>,
}

impl StrangersArguments {
    /// The test that is wanted, if one is.
    pub(crate) fn held(&self) -> Option<Held> {
        self.strangers.and_then(|Wanted(held)| held)
    }

    /// The other shapes: those that are given, or as the data set was captured; none for one of unknown origin.
    pub(crate) fn shapes(&self, dataset: &Dataset) -> Result<Vec<ObjectTouches>> {
        match (&self.background, &dataset.origin) {
            (Some(directory), _) => Ok(super::checked(Dataset::read_any(directory)?).objects),
            (None, Some(origin)) => Ok(vec![strangers::captured(BACKGROUND_SHAPES, origin, &Bar::new())?]),
            (None, None) => Ok(Vec::new()),
        }
    }
}

impl Found {
    pub(crate) fn new(settings: &Settings, calibrated: &Calibrated) -> Self {
        let terms = &calibrated.terms;
        Self {
            held: settings.held.name(),
            promised: settings.alarms,
            false_alarms: calibrated.alarms as f64 / f64::from(terms.sequences.max(1)),
            sequences: terms.sequences,
            least_touches: terms.least,
            mean_touches: calibrated.mean_touches,
            mean_touches_without: calibrated.mean_touches_without,
            left_out: calibrated.left_out.clone(),
        }
    }

    /// As text.
    pub(crate) fn text(&self) -> String {
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);
        let mut text = format!(
            "\nStrangers ({}): at most {} of known objects are taken for unknown; {} were, of {} sequences under thresholds at \
             least as strict.\n\
             Names are given after {} touches at the earliest; {:.1} on average, {:.1} without the test.\n",
            self.held,
            percent(self.promised),
            percent(self.false_alarms),
            self.sequences,
            self.least_touches,
            self.mean_touches,
            self.mean_touches_without,
        );
        let width = self.left_out.keys().map(|name| name.chars().count()).max().unwrap_or(0).max("left out".len());
        // Writing to a string cannot fail.
        _ = writeln!(text, "{:width$} {:>8} {:>8} {:>8}", "left out", "30", "60", "120");
        for (name, shares) in &self.left_out {
            _ = write!(text, "{name:width$}");
            shares.values().for_each(|share| _ = write!(text, " {:>8}", percent(*share)));
            text.push('\n');
        }
        text + "The share found out after each number of touches when the model does not use the object's column: about what \
                happens to strangers.\n"
    }
}

fn held(name: &str) -> Result<Wanted, String> {
    let known = Held::ALL.iter().copied().find(|held| held.name() == name);
    match name {
        "off" => Ok(Wanted(None)),
        _ => known.map(|held| Wanted(Some(held))).ok_or_else(|| "use one of off, likely, certain".to_owned()),
    }
}
