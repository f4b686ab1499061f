//! Counted in approaches, which is what a robot pays for.

use super::Estimate;
use super::curve::See;
use super::margins::Margins;
use super::sequential::{Sequential, SequentialSettings};
use crate::error::{Error, Result};
use crate::evidence::follow;
use serde::Serialize;
use std::collections::BTreeMap;

/// Results of a model on approaches, drawn at random from those of an object. A touch that is no evidence to the model
/// costs an approach and changes nothing. Each object is weighted equally.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Approaches {
    /// Share of approaches that are evidence to the model.
    pub used: f64,
    /// Approaches used, for each object.
    pub used_per_object: BTreeMap<String, f64>,
    /// Accuracy after a number of approaches. A model that has no evidence yet has recognized nothing.
    pub accuracy: BTreeMap<usize, f64>,
    /// Standard error of [`Approaches::accuracy`].
    pub accuracy_standard_error: BTreeMap<usize, f64>,
    /// Accuracy for each object.
    pub per_object: BTreeMap<String, BTreeMap<usize, f64>>,
    /// Results of the recognizer that stops by itself.
    pub sequential: Sequential,
}

/// Accuracies by the number of approaches or touches.
pub(super) struct Accuracies {
    /// Each object weighted equally.
    pub(super) all: BTreeMap<usize, f64>,
    pub(super) standard_error: BTreeMap<usize, f64>,
    pub(super) per_object: BTreeMap<String, BTreeMap<usize, f64>>,
}

impl Margins<'_> {
    /// Accuracy after each of `at` approaches, over groups drawn for each object, and what a recognizer does that stops by
    /// itself, over as many sequences.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting): `at` if an object has fewer approaches or a number is 0, and
    /// as [`Margins::sequential`].
    pub fn approaches(&self, at: &[usize], settings: &SequentialSettings) -> Result<Approaches> {
        let stopping = self.stopping(settings)?;
        let (groups, seed) = (settings.sequences, settings.seed);
        let most = at.iter().copied().max().unwrap_or(0);
        if at.contains(&0) {
            return Err(Error::setting("at", 0, "numbers of approaches of at least 1"));
        }
        if let Some(position) = (0..self.tested.len()).find(|&position| self.most_approaches(position) < most) {
            let (name, has) = (&self.tested_names[position], self.most_approaches(position));
            let allowed = format!("fewer approaches, or capture more: {name} has only {has}{}", self.of_what(name));
            return Err(Error::setting("at", most, allowed));
        }
        let correct = |position| {
            let run = |group, see: &mut See<'_>| {
                let drawn = self.draw_approaches(position, group, seed).take(most);
                let Ok(_) =
                    follow(&mut self.steps(position, drawn), &mut self.sums(), |sums, counted| see(sums, counted));
            };
            let recognized = self.recognized(position, groups, [0, most], run).approaches;
            at.iter().map(|&at| Estimate::share(recognized[at], groups)).collect()
        };
        let correct: Vec<Vec<Estimate>> = (0..self.tested.len()).map(correct).collect();
        let outcomes = self.each(groups, |position, sequence| {
            self.outcome(position, stopping, self.draw_approaches(position, sequence, seed))
        });
        let used = self.tested.iter().map(|tested| tested.touches as f64 / tested.approaches.len().max(1) as f64);
        let sequential = self.of_outcomes(outcomes, self.stated(settings, stopping), stopping.max_touches(), true);
        Ok(self.in_approaches(used.collect(), self.accuracies(at, &correct), sequential))
    }

    /// The figures in approaches: of each tested object the share that are evidence, then the accuracies.
    pub(super) fn in_approaches(&self, used: Vec<f64>, accuracies: Accuracies, sequential: Sequential) -> Approaches {
        Approaches {
            used: used.iter().sum::<f64>() / used.len().max(1) as f64,
            used_per_object: self.tested_names.iter().cloned().zip(used).collect(),
            accuracy: accuracies.all,
            accuracy_standard_error: accuracies.standard_error,
            per_object: accuracies.per_object,
            sequential,
        }
    }

    /// Accuracies after `at` approaches or touches, from those of each tested object after each of them.
    pub(super) fn accuracies(&self, at: &[usize], correct: &[Vec<Estimate>]) -> Accuracies {
        let accuracy = |index: usize| Estimate::mean_of(correct.iter().map(|object| object[index]));
        let by_number = |value: &dyn Fn(usize) -> f64| -> BTreeMap<usize, f64> {
            at.iter().enumerate().map(|(index, &at)| (at, value(index))).collect()
        };
        let names = self.tested_names.iter().cloned();
        Accuracies {
            all: by_number(&|index| accuracy(index).value),
            standard_error: by_number(&|index| accuracy(index).standard_error),
            per_object: names.zip(correct).map(|(name, of)| (name, by_number(&|index| of[index].value))).collect(),
        }
    }
}
