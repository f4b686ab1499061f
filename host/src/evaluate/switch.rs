//! Effects of exchanging the object while it is being touched, and of forgetting.

use super::Estimate;
use super::margins::{Margins, Values, row};
use super::sequential::SequentialSettings;
use crate::error::{Error, EvaluateProblem, Result};
use crate::evidence::{Given, Outcome, chip, outcome};
use crate::random::{self, Purpose};
use palpate_onboard::Stopping;
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// Sequences with and without a switch of the object, with and without forgetting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Switched {
    /// The evidence in nats against the likeliest object that makes the recognizer forget.
    pub nats: f32,
    /// Without forgetting.
    pub off: Rule,
    /// With it.
    pub on: Rule,
}

/// Results of a rule. Each object is weighted equally.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// The object stays the same: approaches to a verdict.
    pub still: Stopped,
    /// The object is another one from a random approach on, before which nothing was decided: approaches after that, and
    /// the other object is the right one.
    pub switched: Stopped,
    /// Share of the sequences with a switch whose verdict is the object before.
    pub old: f64,
}

/// Outcomes of sequences.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stopped {
    /// Approaches on average, also where no verdict was reached.
    pub mean_approaches: f64,
    /// Standard error of [`Stopped::mean_approaches`].
    pub mean_approaches_standard_error: f64,
    /// Share of sequences with a wrong verdict.
    pub error: f64,
    /// Standard error of [`Stopped::error`].
    pub error_standard_error: f64,
    /// Share of sequences without a verdict.
    pub undecided: f64,
}

/// One sequence's ends: still and switched, without forgetting and with it.
struct Ends {
    still: [Outcome; 2],
    /// When it switched, to which object of the model, and how it ended then; none if one approach decided.
    switched: Option<(usize, usize, [Outcome; 2])>,
}

impl Margins<'_> {
    /// Follows sequences of approaches of each object, and the same sequences with another object from a random approach
    /// on: one of those before the recognizer without forgetting would have decided, each as likely. Both with and without
    /// [`Forgetting`](palpate_onboard::Forgetting) at `nats`.
    ///
    /// # Errors
    /// [`Setting`](crate::error::Setting) as [`Margins::sequential`], and `switch` if `nats` is not above
    /// 0; [`EvaluateProblem::NotCompiled`] for an ensemble, [`EvaluateProblem::NothingToSwitch`] for a data set of one
    /// object.
    pub(crate) fn switched(&self, settings: &SequentialSettings, nats: f32) -> Result<Switched> {
        let stopping = self.stopping(settings)?;
        if !(nats.is_finite() && nats > 0.0) {
            return Err(Error::setting("switch", nats, "a number of nats above 0, such as 5"));
        }
        if self.tested.len() < 2 {
            return Err(EvaluateProblem::NothingToSwitch.into());
        }
        let one = |position, group| self.switch_ends((position, group), stopping, settings.seed, nats);
        let ends = self.each(settings.sequences, one).into_iter().map(|of| of.into_iter().collect());
        let ends: Vec<Vec<Ends>> = ends.collect::<Option<_>>().ok_or(EvaluateProblem::NotCompiled)?;
        let rule = |which: usize| {
            let still = |position: usize| {
                let object = self.tested[position].object;
                ends[position].iter().map(move |ends| (ends.still[which], 0, object)).collect::<Vec<_>>()
            };
            let switched = |position: usize| {
                let switched = ends[position].iter().filter_map(|ends| ends.switched.as_ref());
                switched.map(|(at, object, outcomes)| (outcomes[which], *at, *object)).collect::<Vec<_>>()
            };
            let old = |position: usize| {
                let of = switched(position);
                let own =
                    |(outcome, ..): &&(Outcome, usize, usize)| outcome.recognized == Some(self.tested[position].object);
                Estimate::share(of.iter().filter(own).count(), of.len())
            };
            let positions = 0..self.tested.len();
            let all = positions.clone();
            // An object that one approach always decides has no sequence with a switch.
            let olds: Vec<Estimate> = all.filter(|&position| !switched(position).is_empty()).map(old).collect();
            Rule {
                still: stopped(positions.clone().map(still)),
                switched: stopped(positions.map(switched)),
                old: Estimate::mean_of(olds.into_iter()).value,
            }
        };
        Ok(Switched { nats, off: rule(0), on: rule(1) })
    }

    /// The ends of one sequence; none for a full model.
    fn switch_ends(&self, (position, group): (usize, usize), stopping: Stopping, seed: u64, nats: f32) -> Option<Ends> {
        let Values::Compiled(model, _) = &self.tested[position].values else { return None };
        let run = |forgets: bool, rows: &mut dyn Iterator<Item = Option<&[i32]>>| {
            let Ok(outcome) =
                outcome(&mut Given::new(rows), &mut *chip(model, stopping, None, forgets.then_some(nats)));
            outcome
        };
        let still = [false, true].map(|forgets| run(forgets, &mut self.rows(position, group, seed)));
        let decided = still[0].approaches;
        let name = &self.tested_names[position];
        let mut random = random::generator(seed, Purpose::Switch, name, u64::try_from(group).unwrap_or(u64::MAX));
        let switched = (decided > 1).then(|| {
            let at = random.random_range(1..decided);
            let other = (position + random.random_range(1..self.tested.len())) % self.tested.len();
            let outcomes = [false, true].map(|forgets| {
                let rows = self.rows(position, group, seed).take(at).chain(self.rows(other, group, seed));
                run(forgets, &mut { rows })
            });
            (at, self.tested[other].object, outcomes)
        });
        Some(Ends { still, switched })
    }

    /// The margins of a tested object's approaches in the order of a group; none where one is no evidence.
    fn rows(&self, position: usize, group: usize, seed: u64) -> impl Iterator<Item = Option<&[i32]>> {
        let draws = self.draws(self.most_approaches_of(position, group), position, group, seed);
        draws.map(move |draw| {
            let touch = self.approach(position, group, draw)?;
            match &self.tested[position].values {
                Values::Compiled(_, values) => Some(&values[row(touch as usize, self.objects.len())]),
                Values::Full(_) => None,
            }
        })
    }
}

/// The figures of sequences, for each object: how each ended, after which approach it counts, which object is right.
fn stopped(objects: impl Iterator<Item = Vec<(Outcome, usize, usize)>>) -> Stopped {
    let objects: Vec<_> = objects.filter(|sequences| !sequences.is_empty()).collect();
    let share = |is: &dyn Fn(&(Outcome, usize, usize)) -> bool| {
        let of = |sequences: &Vec<_>| Estimate::share(sequences.iter().filter(|one| is(one)).count(), sequences.len());
        Estimate::mean_of(objects.iter().map(of).collect::<Vec<_>>().into_iter())
    };
    let after = |(outcome, at, _): &(Outcome, usize, usize)| outcome.approaches.saturating_sub(*at) as f64;
    let means: Vec<Estimate> = objects
        .iter()
        .map(|sequences| Estimate::mean(sequences.iter().map(after).collect::<Vec<_>>().into_iter()))
        .collect();
    let mean = Estimate::mean_of(means.into_iter());
    let error = share(&|(outcome, _, right)| outcome.recognized.is_some_and(|object| object != *right));
    Stopped {
        mean_approaches: mean.value,
        mean_approaches_standard_error: mean.standard_error,
        error: error.value,
        error_standard_error: error.standard_error,
        undecided: share(&|(outcome, ..)| outcome.recognized.is_none()).value,
    }
}
