//! Outcomes of sequences, which every figure is a function of.

use palpate_shared::format::Per;
use std::collections::BTreeMap;

/// Outcome of a sequence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Touches, or rows, used that were evidence.
    pub touches: usize,
    /// Approaches used: these touches, and those in between that were no evidence.
    pub approaches: usize,
    /// The object recognized (its index in the model), or none.
    pub recognized: Option<usize>,
    /// The output that was recognized: how the object lies, if outputs are placements.
    pub output: Option<usize>,
    /// True if the touches fitted no object. Neither this nor recognized: the recognizer gave up.
    pub unknown: bool,
}

impl Outcome {
    /// True if the name is wrong for a sequence of this class.
    pub(crate) fn is_wrong(&self, class: usize) -> bool {
        self.recognized.is_some_and(|name| name != class)
    }
}

/// Sums over sequences.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Totals {
    pub(crate) sequences: usize,
    /// Names given.
    pub(crate) given: usize,
    /// Wrong names among those.
    pub(crate) wrong: usize,
    /// Sequences that ended as unknown.
    pub(crate) unknown: usize,
    touches: usize,
    approaches: usize,
}

impl Totals {
    /// Totals over sequences by class and outcome.
    pub(crate) fn of(outcomes: impl IntoIterator<Item = (usize, Outcome)>) -> Self {
        outcomes.into_iter().fold(Self::default(), |sum, (class, outcome)| Self {
            sequences: sum.sequences + 1,
            given: sum.given + usize::from(outcome.recognized.is_some()),
            wrong: sum.wrong + usize::from(outcome.is_wrong(class)),
            unknown: sum.unknown + usize::from(outcome.unknown),
            touches: sum.touches + outcome.touches,
            approaches: sum.approaches + outcome.approaches,
        })
    }

    /// A number as a share of all sequences, or as a mean over them.
    pub(crate) fn share(&self, number: usize) -> f64 {
        number as f64 / self.sequences.max(1) as f64
    }

    /// Share of wrong names among those given.
    pub(crate) fn error(&self) -> f64 {
        self.wrong as f64 / self.given.max(1) as f64
    }

    /// Sequences without a verdict.
    pub(crate) fn undecided(&self) -> usize {
        self.sequences - self.given - self.unknown
    }

    /// Touches, or rows, used on average that were evidence.
    pub(crate) fn mean_touches(&self) -> f64 {
        self.share(self.touches)
    }

    /// Approaches used on average.
    pub(crate) fn mean_approaches(&self) -> f64 {
        self.share(self.approaches)
    }
}

/// Sequences that count together: a group of them, or one that is independent of the others.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Unit {
    /// Wrong names.
    pub(crate) wrong: f64,
    /// Names.
    pub(crate) named: f64,
    /// Sequences.
    pub(crate) all: f64,
}

/// The units of each case that a rate is of, from sequences by class, unit and outcome.
pub(crate) fn units(
    outcomes: impl IntoIterator<Item = (usize, usize, Outcome)>,
    per: Per,
) -> BTreeMap<usize, BTreeMap<usize, Unit>> {
    let mut cases = BTreeMap::<usize, BTreeMap<usize, Unit>>::new();
    for (class, unit, outcome) in outcomes {
        let case = match per {
            Per::Average => Some(0),
            Per::Object => Some(class),
            Per::Name => outcome.recognized,
        };
        let Some(case) = case else { continue };
        let unit = cases.entry(case).or_default().entry(unit).or_default();
        unit.wrong += f64::from(u8::from(outcome.is_wrong(class)));
        unit.named += f64::from(u8::from(outcome.recognized.is_some()));
        unit.all += 1.0;
    }
    cases
}
