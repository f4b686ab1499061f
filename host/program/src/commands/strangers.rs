//! Options for objects that a model does not know.

use super::progress::Bar;
use palpate::Result;
use palpate::calibrate::Found;
use palpate::mesh::builtin::BACKGROUND_SHAPES;
use palpate::strangers;
use palpate::touches::{Dataset, ObjectTouches};
use palpate::wording::percent;
use std::path::PathBuf;

/// Test for objects that the model does not know.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct StrangersArguments {
    /// Make a test for objects that the model does not know
    #[arg(long)]
    detect_unknown: bool,
    /// Touches of many other shapes; or rows [default: of 200 shapes, captured as DIR was; of rows none]
    #[arg(long, value_name = "DIR", requires = "detect_unknown")]
    background: Option<PathBuf>,
}

impl StrangersArguments {
    /// True if a test is wanted.
    pub(crate) fn is_wanted(&self) -> bool {
        self.detect_unknown
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
    format!(
        "\nStrangers: at most {} of known objects are taken for unknown; {} were, of {} sequences under thresholds at least as \
         strict.\n\
         Names are given after {:.1} touches on average, {:.1} without the test.\n",
        percent(found.promised, 2),
        percent(found.false_alarms, 2),
        found.sequences,
        found.mean_touches,
        found.mean_touches_without,
    )
}
