//! Accuracy after a fixed number of touches.

use super::Candidate;
use super::Estimate;
use super::margins::Margins;
use crate::error::{Error, Result};
use rayon::prelude::*;

/// Share of groups in which the object with the most evidence was the right one, after 1, 2, 3 … touches.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    groups: usize,
    /// For each tested object, and each number of touches less one: groups recognized.
    correct: Vec<Vec<usize>>,
}

/// Confidence of a model in the object with the most evidence, and its correctness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    /// The posterior of the best object.
    pub posterior: f64,
    /// True if it was the right one.
    pub correct: bool,
}

impl Margins<'_> {
    /// Accuracy after 1 to `most` touches, over `groups` groups drawn for each object. With a `most` of 0 it is empty.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting): `groups` if there are none, `at` if an object has fewer
    /// touches.
    pub fn curve(&self, most: usize, groups: usize, seed: u64) -> Result<Curve> {
        if most > 0 || groups == 0 {
            self.check(most, groups)?;
        }
        let correct = (0..self.tested.len()).map(|position| {
            let group = |mut correct: Vec<usize>, group| {
                self.follow(position, group, most, seed, |touches, evidence| {
                    correct[touches - 1] += usize::from(self.best(position, evidence) == self.tested[position].object);
                });
                correct
            };
            let none = || vec![0; most];
            let add = |a: Vec<usize>, b: Vec<usize>| a.iter().zip(b).map(|(a, b)| a + b).collect();
            (0..groups).into_par_iter().fold(none, group).reduce(none, add)
        });
        Ok(Curve { groups, correct: correct.collect() })
    }

    /// Confusion matrix after `touches` touches: number of groups of each tested object (rows) recognized as each known
    /// one (columns). Where an object has several outputs, a right one is that of the placement that was touched, if the touches
    /// state it.
    ///
    /// # Errors
    /// Errors of [`Margins::curve`], and `at` if `touches` is 0.
    pub fn confusion(&self, touches: usize, groups: usize, seed: u64) -> Result<Vec<Vec<usize>>> {
        self.confusion_of_first(touches, touches, groups, seed)
    }

    /// Confusion matrix after the first `touches` touches of groups of `most`: of the groups that [`Margins::curve`] of
    /// `most` follows, so that the share on its diagonal is the curve's accuracy.
    ///
    /// # Errors
    /// Errors of [`Margins::confusion`].
    pub fn confusion_of_first(&self, touches: usize, most: usize, groups: usize, seed: u64) -> Result<Vec<Vec<usize>>> {
        self.check(touches, groups)?;
        let most = most.max(touches);
        self.check(most, groups)?;
        let row = |position| {
            let mut row = vec![0; self.objects.len()];
            self.ends(position, (touches, most), groups, seed, |evidence| match self.is_of_any_placement(position) {
                true => self.output(evidence),
                false => self.best(position, evidence),
            })
            .into_iter()
            .for_each(|object| row[object] += 1);
            row
        };
        Ok((0..self.tested.len()).map(row).collect())
    }

    /// Confidence of the model after `touches` touches, for each group of each object; for calibration.
    ///
    /// # Errors
    /// Errors of [`Margins::curve`], and `at` if `touches` is 0.
    pub fn confidences(&self, touches: usize, groups: usize, seed: u64) -> Result<Vec<Confidence>> {
        self.check(touches, groups)?;
        // What is shown is a posterior at the model's temperature.
        let unit = match self.candidate {
            Candidate::Compiled(model) => self.unit() / model.temperature().value(),
            Candidate::Full(_) => self.unit(),
        };
        let confidences = |position: usize| {
            let right = self.tested[position].object;
            self.ends(position, (touches, touches), groups, seed, move |evidence| {
                let (best, rivals) = self.leading(position, evidence, unit);
                Confidence { posterior: 1.0 / (1.0 + rivals), correct: best == right }
            })
        };
        Ok((0..self.tested.len()).flat_map(confidences).collect())
    }

    fn check(&self, most: usize, groups: usize) -> Result<()> {
        if groups == 0 {
            return Err(Error::setting("groups", 0, "at least 1"));
        }
        if most == 0 {
            return Err(Error::setting("at", 0, "numbers of touches of at least 1"));
        }
        let touches = (0..self.tested.len()).map(|position| self.most_touches(position));
        match touches.zip(&self.tested_names).find(|(touches, _)| *touches < most) {
            Some((touches, name)) => {
                let allowed =
                    format!("fewer touches, or capture more: {name} has only {touches}{}", self.of_what(name));
                Err(Error::setting("at", most, allowed))
            }
            None => Ok(()),
        }
    }

    /// Adds up the margins of a group, and shows the evidence after each touch.
    fn follow(&self, position: usize, group: usize, most: usize, seed: u64, mut see: impl FnMut(usize, &[f64])) {
        let mut evidence = self.prior();
        for (index, touch) in self.draw(position, group, most, seed).into_iter().enumerate() {
            self.tested[position].add(touch, &mut evidence);
            see(index + 1, &evidence);
        }
    }

    /// Applies `end` to the evidence after the first touches of each group of so many.
    fn ends<T: Send>(
        &self,
        position: usize,
        (touches, most): (usize, usize),
        groups: usize,
        seed: u64,
        end: impl Fn(&[f64]) -> T + Sync,
    ) -> Vec<T> {
        let group = |group| {
            let mut evidence = self.prior();
            self.draw(position, group, most, seed).into_iter().take(touches).for_each(|touch| {
                self.tested[position].add(touch, &mut evidence);
            });
            end(&evidence)
        };
        (0..groups).into_par_iter().map(group).collect()
    }
}

impl Curve {
    /// The largest number of touches.
    pub fn most(&self) -> usize {
        self.correct.first().map_or(0, Vec::len)
    }

    /// Accuracy after `touches` touches (1 to [`Curve::most`]), each object weighted equally.
    ///
    /// # Panics
    /// If `touches` is out of range.
    pub fn accuracy(&self, touches: usize) -> Estimate {
        Estimate::mean_of((0..self.correct.len()).map(|position| self.object_accuracy(position, touches)))
    }

    /// Accuracy for the tested object at `position` after `touches` touches.
    ///
    /// # Panics
    /// If `position` or `touches` is out of range.
    pub fn object_accuracy(&self, position: usize, touches: usize) -> Estimate {
        Estimate::share(self.correct[position][touches - 1], self.groups)
    }

    /// The smallest number of touches from which on accuracy stays at or above 1 − `error_rate`, if there is one.
    /// An empty curve has none.
    pub fn touches_to_error(&self, error_rate: f64) -> Option<usize> {
        let fails = |touches: &usize| self.accuracy(*touches).value < 1.0 - error_rate;
        match (1..=self.most()).rev().find(fails) {
            Some(last) if last == self.most() => None,
            Some(last) => Some(last + 1),
            None => (self.most() > 0).then_some(1),
        }
    }
}
