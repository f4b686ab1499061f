//! The sequences of a calibration, divided into those that are learned from and those that are tested on.

use super::settings::Settings;
use crate::calibrate::{Stop, at_best, needed, share_tested};
use crate::error::{Error, Result};
use crate::evidence::Drawer;
use crate::random::Purpose;
use palpate_trees::rows::RowSequence;
use rand::seq::SliceRandom;
use std::collections::BTreeSet;

/// One sequence, or group, in this many is learned from, and not tested on.
const LEARNED: usize = 4;

/// Sequences that are learned from, and those that are tested on: whole groups, in a random order.
#[derive(Clone, Debug)]
pub(super) struct Parts<'s> {
    pub(super) learned: Vec<&'s RowSequence>,
    pub(super) tested: Vec<&'s RowSequence>,
    pub(super) has_groups: bool,
    /// Groups, or sequences without groups, of both parts.
    #[cfg(feature = "train")]
    pub(super) units: usize,
}

impl<'s> Parts<'s> {
    pub(super) fn new(sequences: &'s [RowSequence], settings: &Settings) -> Result<Self> {
        let mut all: Vec<&RowSequence> = sequences.iter().collect();
        let mut random = drawer(settings).random(0);
        all.shuffle(&mut random);
        let has_groups = all.iter().any(|sequence| sequence.group.is_some());
        let mut order: Vec<usize> = if has_groups {
            let groups: BTreeSet<usize> = all.iter().filter_map(|sequence| sequence.group).collect();
            let mut groups: Vec<usize> = groups.into_iter().collect();
            groups.shuffle(&mut random);
            groups
        } else {
            (0..all.len()).collect()
        };
        // Whole groups, whatever their size: as many as have so many sequences on average.
        order.truncate((order.len() as u128 * settings.sequences as u128 / all.len().max(1) as u128) as usize);
        if has_groups {
            let taken: BTreeSet<usize> = order.iter().copied().collect();
            all.retain(|sequence| sequence.group.is_some_and(|group| taken.contains(&group)));
        } else {
            all.truncate(order.len());
        }
        let units = order.len();
        let least = needed(settings.rate, settings.confidence) as usize;
        if units < least {
            return Err(too_few(units as u64, least as u64, has_groups, settings));
        }
        // As many as a promise takes are tested on, if there are no more.
        let learned = (units / LEARNED).min(units - least);
        let (learned, tested) = if has_groups {
            let own: BTreeSet<usize> = order.into_iter().take(learned).collect();
            all.into_iter().partition(|sequence| sequence.group.is_some_and(|group| own.contains(&group)))
        } else {
            let tested = all.split_off(learned);
            (all, tested)
        };
        Ok(Self {
            learned,
            tested,
            has_groups,
            #[cfg(feature = "train")]
            units,
        })
    }

    /// All sequences tested, and others learned from.
    pub(super) fn of(learned: &'s [RowSequence], tested: &'s [RowSequence], settings: &Settings) -> Result<Self> {
        let mut all: Vec<&RowSequence> = tested.iter().collect();
        drawer(settings).shuffle(0, &mut all);
        let parts = Self {
            learned: learned.iter().collect(),
            has_groups: all.iter().any(|sequence| sequence.group.is_some()),
            tested: all,
            #[cfg(feature = "train")]
            units: 0,
        };
        let (units, least) = (parts.units_tested(), needed(settings.rate, settings.confidence));
        if (units as u64) < least {
            return Err(too_few(units as u64, least, parts.has_groups, settings));
        }
        Ok(Self {
            #[cfg(feature = "train")]
            units,
            ..parts
        })
    }

    /// Groups, or sequences without groups, that are tested on.
    pub(super) fn units_tested(&self) -> usize {
        let groups: BTreeSet<usize> = self.tested.iter().filter_map(|sequence| sequence.group).collect();
        if self.has_groups { groups.len() } else { self.tested.len() }
    }

    /// A share of the tested sequences, and the parts without it: whole groups.
    #[cfg(feature = "train")]
    pub(super) fn divided(self, share: f64) -> (Vec<&'s RowSequence>, Self) {
        let mut units: Vec<Option<usize>> = Vec::new();
        let mut seen = BTreeSet::new();
        let groups = self.tested.iter().map(|sequence| sequence.group).filter(|group| seen.insert(*group));
        units.extend(groups);
        let count = |all: usize| (all as f64 * share) as usize;
        let (taken, tested) = if self.has_groups {
            let own: BTreeSet<Option<usize>> = units.iter().take(count(units.len())).copied().collect();
            self.tested.into_iter().partition(|sequence| own.contains(&sequence.group))
        } else {
            let mut taken = self.tested;
            let tested = taken.split_off(count(taken.len()));
            (taken, tested)
        };
        (taken, Self { tested, ..self })
    }

    /// The share of groups, or sequences, that are not learned from.
    #[cfg(feature = "train")]
    pub(super) fn share_tested(&self) -> f64 {
        1.0 - 1.0 / LEARNED as f64
    }

    /// The problem that a walk ended with.
    pub(super) fn problem(&self, stop: &Stop, names: &[String], settings: &Settings) -> Error {
        // Thresholds by name are learned on some of them.
        let share = if self.has_groups { 1.0 } else { share_tested(settings.per) };
        let units = (share * self.units_tested() as f64).round() as u64;
        let cases = stop.cases("names given", names, settings.per);
        let cases = match stop {
            // It is groups that are too few.
            Stop::TooFew { .. } if self.has_groups => format!("of {units} groups of sequences with {cases}"),
            _ => format!("{cases} in {units} {}", what(self.has_groups)),
        };
        let problem = stop.problem(settings.rate, &cases, "wrong");
        match *stop {
            Stop::TooFew { found, .. } => problem.fix(more(found, self.has_groups, settings)),
            Stop::TooMany { .. } if stop.is_too_few(settings.rate) => {
                problem.fix("Record more sequences, or promise a higher error rate.")
            }
            Stop::TooMany { .. } => problem.fix(
                "Promise a higher error rate, give sequences of more rows, or train the model on rows like these.",
            ),
            Stop::Looser => problem,
        }
    }

    /// The first sequence of each group; all of those without one.
    #[cfg(feature = "train")]
    pub(super) fn once(sequences: &[&'s RowSequence]) -> Vec<&'s RowSequence> {
        let mut seen = BTreeSet::new();
        sequences.iter().copied().filter(|sequence| sequence.group.is_none_or(|group| seen.insert(group))).collect()
    }
}

fn drawer(settings: &Settings) -> Drawer<'static> {
    Drawer { purpose: Purpose::Calibration, name: "sequences", seed: settings.seed }
}

pub(super) fn what(groups: bool) -> &'static str {
    if groups { "groups of sequences" } else { "sequences" }
}

/// Too few sequences, or groups, even if no name is wrong.
fn too_few(found: u64, needed: u64, groups: bool, settings: &Settings) -> Error {
    let stop = Stop::TooFew { position: 0, found, needed };
    stop.problem(settings.rate, what(groups), "wrong").fix(more(found, groups, settings))
}

/// The remedy for too few names, sequences or groups.
fn more(found: u64, groups: bool, settings: &Settings) -> String {
    let at_best = at_best(found, settings.confidence);
    let more = match groups {
        true => "groups, or promise a higher error rate; more sequences of the same groups do not help.",
        false => "sequences, or promise a higher error rate.",
    };
    format!("As many support {at_best}. Record more {more}")
}
