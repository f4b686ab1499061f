//! Sets of categories, as runs of values.

use crate::error::{Result, problem};

/// The most categories of a set: LightGBM's text can state any number in a few bytes.
const MAX_CATEGORIES: usize = 1 << 16;

/// Values of a feature, in runs.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::ensemble) struct Set {
    /// Ends of runs, ascending: every other run is in the set.
    pub(super) ends: Vec<f64>,
    /// True if the first run is.
    pub(super) begins: bool,
}

impl Set {
    /// The values that a library truncates to one of these categories. Values that are not above -1 are never one of them;
    /// of those between -1 and 0 `truncates_to_zero` says whether they are category 0.
    pub(in crate::ensemble) fn of_categories(
        categories: impl IntoIterator<Item = u32>,
        truncates_to_zero: bool,
    ) -> Result<Self> {
        let mut categories: Vec<u32> = categories.into_iter().collect();
        categories.sort_unstable();
        categories.dedup();
        if categories.len() > MAX_CATEGORIES {
            return Err(problem!("it splits by a set of {} categories", categories.len())
                .fix("Train with fewer categories in a set: at most 65,536 are taken."));
        }
        let mut ends: Vec<f64> = Vec::new();
        for category in categories {
            let first = if category == 0 && truncates_to_zero { BELOW_ZERO } else { f64::from(category) };
            if ends.last() == Some(&first) {
                ends.pop();
            } else {
                ends.push(first);
            }
            ends.push(f64::from(category) + 1.0);
        }
        Ok(Self { ends, begins: false })
    }

    /// The set, with all values below 0 and from `end` on, which is beyond all categories.
    pub(in crate::ensemble) fn and_beyond(mut self, end: f64) -> Self {
        for end in [0.0, end] {
            match self.ends.binary_search_by(|own| own.total_cmp(&end)) {
                Ok(place) => _ = self.ends.remove(place),
                Err(place) => self.ends.insert(place, end),
            }
        }
        self.begins = true;
        self
    }

    /// The values that are these whole numbers exactly.
    pub(in crate::ensemble) fn of_numbers(mut numbers: Vec<i32>) -> Self {
        numbers.sort_unstable();
        numbers.dedup();
        let mut ends: Vec<f64> = Vec::new();
        for number in numbers.into_iter().map(f64::from) {
            if ends.last() == Some(&number) {
                ends.pop();
            } else {
                ends.push(number);
            }
            ends.push(number + 1.0);
        }
        Self { ends, begins: false }
    }

    /// The runs that begin above `from` and end at or below `to`: where they end, and whether the first is in the set.
    pub(super) fn between(&self, from: f64, to: f64) -> (&[f64], bool) {
        let first = self.ends.partition_point(|end| *end <= from);
        let last = self.ends.partition_point(|end| *end < to);
        (self.ends.get(first..last).unwrap_or_default(), (first % 2 == 1) != self.begins)
    }
}

/// The least f64 above -1, where values begin that are truncated to 0: no f32 is between -1 and it.
pub(super) const BELOW_ZERO: f64 = -1.0 + f64::EPSILON / 2.0;
