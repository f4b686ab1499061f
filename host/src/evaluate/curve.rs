//! Accuracy after a fixed number of touches.

use super::Estimate;
use super::margins::Margins;
use crate::error::{Error, Result};
use crate::evidence::{Counted, Follower, Sums, follow};
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
        let correct = |position| {
            let run = |group, see: &mut See<'_>| {
                let touches = self.draw(position, group, most, seed).map(Some);
                let Ok(_) =
                    follow(&mut self.steps(position, touches), &mut self.sums(), |sums, counted| see(sums, counted));
            };
            self.recognized(position, groups, [most, 0], run).touches.split_off(1)
        };
        Ok(Curve { groups, correct: (0..self.tested.len()).map(correct).collect() })
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
            self.ends(position, (touches, most), groups, seed, |sums| match self.is_of_any_placement(position) {
                true => sums.leader(),
                false => self.named(position, sums.leader()),
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
        let unit = f64::from(self.model.unit()) / self.model.temperature().value();
        let confidences = |position: usize| {
            let right = self.tested[position].object;
            self.ends(position, (touches, touches), groups, seed, move |sums| {
                let (best, rivals) = sums.leading(unit);
                Confidence { posterior: 1.0 / (1.0 + rivals), correct: self.named(position, best) == right }
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

    /// Sums of a model's margins, with the evidence that there is before any touch.
    pub(super) fn sums(&self) -> Sums<'_> {
        Sums::new(self.model, self.weights.as_deref())
    }

    /// Applies `end` to the sums of the first touches of each group of so many.
    fn ends<T: Send>(
        &self,
        position: usize,
        (touches, most): (usize, usize),
        groups: usize,
        seed: u64,
        end: impl Fn(&Sums<'_>) -> T + Sync,
    ) -> Vec<T> {
        let group = |group| {
            let mut sums = self.sums();
            let first = self.draw(position, group, most, seed).take(touches).map(Some);
            let Ok(_) = follow(&mut self.steps(position, first), &mut sums, |_, _| false);
            end(&sums)
        };
        (0..groups).into_par_iter().map(group).collect()
    }

    /// Counts how often a tested object leads after each number of touches and of approaches, up to the most of each, in
    /// sequences that `run` follows by their numbers. A sequence that ends before keeps what it has; one without any evidence
    /// has recognized nothing.
    pub(super) fn recognized(
        &self,
        position: usize,
        groups: usize,
        most: [usize; 2],
        run: impl Fn(usize, &mut See<'_>) + Sync,
    ) -> Recognized {
        let object = self.tested[position].object;
        let none = || Recognized { touches: vec![0; most[0] + 1], approaches: vec![0; most[1] + 1], made: [0; 2] };
        let add = |counts: &mut [usize], from: usize, to: usize| {
            let end = to.min(counts.len());
            counts[from.min(end)..end].iter_mut().for_each(|count| *count += 1);
        };
        let group = |mut counts: Recognized, group| {
            // Touches and approaches of a state, which counts up to the next one, and whether the object led.
            let mut last = (0, 0, false);
            run(group, &mut |follower, Counted { touches, approaches, .. }| {
                let (touches, approaches) = (touches as usize, approaches as usize);
                if last.2 {
                    add(&mut counts.touches, last.0, touches);
                    add(&mut counts.approaches, last.1, approaches);
                }
                last = (touches, approaches, touches > 0 && follower.is_same(follower.leader(), object));
                touches >= most[0] && approaches >= most[1]
            });
            let (touches, approaches, leads) = last;
            if leads {
                add(&mut counts.touches, touches, usize::MAX);
                add(&mut counts.approaches, approaches, usize::MAX);
            }
            counts.made = [counts.made[0] + approaches, counts.made[1] + touches];
            counts
        };
        let sum = |mut a: Recognized, b: Recognized| {
            a.touches.iter_mut().zip(b.touches).for_each(|(a, b)| *a += b);
            a.approaches.iter_mut().zip(b.approaches).for_each(|(a, b)| *a += b);
            a.made = [a.made[0] + b.made[0], a.made[1] + b.made[1]];
            a
        };
        (0..groups).into_par_iter().fold(none, group).reduce(none, sum)
    }
}

/// Sees a state of a sequence; true if it has seen enough.
pub(super) type See<'s> = dyn FnMut(&dyn Follower<Step = [i32]>, Counted) -> bool + 's;

/// Sequences of a tested object in which it leads.
pub(super) struct Recognized {
    /// After each number of touches.
    pub(super) touches: Vec<usize>,
    /// After each number of approaches.
    pub(super) approaches: Vec<usize>,
    /// Approaches made, and those that were evidence.
    pub(super) made: [usize; 2],
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
