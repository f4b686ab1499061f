//! Counted in approaches, which is what a robot pays for.

use super::Estimate;
use super::draws::Draws;
use super::margins::Margins;
use super::sequential::{Sequential, SequentialSettings};
use crate::error::{Error, Result};
use crate::random::Purpose;
use rayon::prelude::*;
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
        let positions = 0..self.tested.len();
        let correct: Vec<Vec<Estimate>> =
            positions.map(|position| self.after(position, at, most, groups, seed)).collect();
        let outcomes = self.each(groups, |position, sequence| {
            let draws = self.draws(self.most_approaches_of(position, sequence), position, sequence, seed);
            self.outcome(position, stopping, draws.map(|draw| self.approach(position, sequence, draw)))
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

    /// The numbers of approaches in the order in which a group has them.
    pub(super) fn draws(&self, all: usize, position: usize, group: usize, seed: u64) -> Draws {
        let group = u64::try_from(group).unwrap_or(u64::MAX);
        Draws::new(all, Purpose::Approaches, &self.tested_names[position], group, seed)
    }

    /// The share of groups that are recognized after each of `at` approaches.
    fn after(&self, position: usize, at: &[usize], most: usize, groups: usize, seed: u64) -> Vec<Estimate> {
        let tested = &self.tested[position];
        let group = |mut correct: Vec<usize>, group| {
            let (mut evidence, mut is_evidence) = (self.prior(), false);
            let draws = self.draws(self.most_approaches_of(position, group), position, group, seed);
            for (index, draw) in draws.take(most).enumerate() {
                if let Some(touch) = self.approach(position, group, draw) {
                    tested.add(touch as usize, &mut evidence);
                    is_evidence = true;
                }
                for (count, _) in correct.iter_mut().zip(at).filter(|(_, at)| **at == index + 1) {
                    *count += usize::from(is_evidence && self.best(position, &evidence) == tested.object);
                }
            }
            correct
        };
        let none = || vec![0; at.len()];
        let add = |a: Vec<usize>, b: Vec<usize>| a.iter().zip(b).map(|(a, b)| a + b).collect();
        let correct: Vec<usize> = (0..groups).into_par_iter().fold(none, group).reduce(none, add);
        correct.into_iter().map(|correct| Estimate::share(correct, groups)).collect()
    }
}
