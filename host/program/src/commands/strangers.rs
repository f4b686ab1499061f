//! Options for objects that a model does not know.

use super::progress::Bar;
use palpate::Result;
use palpate::calibrate::{Found, OnRecordings};
use palpate::mesh::builtin::BACKGROUND_SHAPES;
use palpate::strangers;
use palpate::touches::{Dataset, ObjectTouches};
use palpate_shared::format::Held;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Test for objects that the model does not know.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct StrangersArguments {
    /// Detect objects that the model does not know: off, likely or certain [default: off]
    #[arg(long, value_parser = held, value_name = "HOW")]
    strangers: Option<Wanted>,
    /// Touches of many other shapes; or rows [default: of 200 shapes, captured as DIR was]
    #[arg(long, value_name = "DIR", requires = "strangers")]
    background: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug)]
struct Wanted(Option<Held>);

impl StrangersArguments {
    /// The test that is wanted, if one is.
    pub(crate) fn held(&self) -> Option<Held> {
        self.strangers.and_then(|Wanted(held)| held)
    }

    /// The data of others, if it is given.
    pub(crate) fn background(&self) -> Option<&PathBuf> {
        self.background.as_ref()
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

/// Findings, as text.
pub(crate) fn text(found: &Found) -> String {
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let mut text = format!(
        "\nStrangers ({}): at most {} of known objects are taken for unknown; {} were, of {} sequences under thresholds at \
         least as strict.\n\
         Names are given after {} touches at the earliest; {:.1} on average, {:.1} without the test.\n",
        found.held,
        percent(found.promised),
        percent(found.false_alarms),
        found.sequences,
        found.least_touches,
        found.mean_touches,
        found.mean_touches_without,
    );
    text += &found.recorded.as_ref().map_or_else(String::new, on_recordings);
    let width = found.left_out.keys().map(|name| name.chars().count()).max().unwrap_or(0).max("left out".len());
    // Writing to a string cannot fail.
    _ = write!(text, "{:width$}", "left out");
    let numbers = found.left_out.values().next().into_iter().flat_map(std::collections::BTreeMap::keys);
    numbers.for_each(|at| _ = write!(text, " {at:>8}"));
    text.push('\n');
    for (name, shares) in &found.left_out {
        _ = write!(text, "{name:width$}");
        shares.values().for_each(|share| _ = write!(text, " {:>8}", percent(*share)));
        text.push('\n');
    }
    text + "The share detected after each number of touches when the model does not use the object's column: about the \
            detection rate of strangers.\n"
}

fn held(name: &str) -> Result<Wanted, String> {
    let known = Held::ALL.iter().copied().find(|held| held.name() == name);
    match name {
        "off" => Ok(Wanted(None)),
        _ => known.map(|held| Wanted(Some(held))).ok_or_else(|| "use one of off, likely, certain".to_owned()),
    }
}

/// Results of recorded sequences, and a warning where they differ from simulated ones.
fn on_recordings(found: &OnRecordings) -> String {
    let OnRecordings { sequences, alarms, supported, before } = found;
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut text = format!(
        "The test rests on recorded touches: {alarms} of {sequences} sequences ended as unknown, which supports a false alarm rate of {}.\n",
        percent(*supported)
    );
    if before.differs {
        let mut worst: Vec<(&String, &usize)> = before.objects.iter().filter(|(_, alarms)| **alarms > 0).collect();
        worst.sort_by(|a, b| b.1.cmp(a.1));
        let worst: Vec<String> = worst.iter().take(3).map(|(name, alarms)| format!("{alarms} of {name}")).collect();
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "warning: recorded touches fit their objects worse than simulated ones: calibrated on these alone, the test would \
             call {} of {} recorded sequences unknown ({}). Simulate the probe as it is (`palpate probe fit`).",
            before.all(),
            before.sequences,
            worst.join(", ")
        );
    }
    text
}
