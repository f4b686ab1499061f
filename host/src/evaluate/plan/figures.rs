//! The figures of an evaluation under a model's plan.

use super::active::Active;
use crate::error::{Error, Result};
use crate::evaluate::margins::Margins;
use crate::evaluate::{Estimate, Evaluation, Settings};
use crate::evidence::Counted;
use palpate_onboard::Stopping;
use rayon::prelude::*;

/// Counts over sequences of one object without a verdict.
struct Counts {
    /// Sequences recognized after each number of touches.
    touches: Vec<usize>,
    /// Sequences recognized after each number of approaches.
    approaches: Vec<usize>,
    /// Approaches made, and those that were evidence.
    made: [usize; 2],
}

/// Evaluates a model as [`evaluate`](crate::evaluate::evaluate()), with every approach where the model's plan says instead of one
/// drawn at random. Touches, too, are those of such approaches.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) as [`evaluate`](crate::evaluate::evaluate()).
pub(crate) fn evaluate_active(margins: &Margins<'_>, active: &Active, settings: &Settings) -> Result<Evaluation> {
    let Settings { at, at_approaches, groups, seed, .. } = settings;
    let rule = margins.stopping(&settings.sequences())?;
    if at.iter().chain(at_approaches).any(|&at| at == 0) {
        return Err(Error::setting("at", 0, "numbers of touches of at least 1"));
    }
    let positions = 0..margins.tested.len();
    let counts: Vec<Counts> = positions.map(|position| margins.counts(active, position, settings)).collect();
    let share = |counts: &Vec<usize>| counts.iter().map(|&count| Estimate::share(count, *groups)).collect();
    let by_touches: Vec<Vec<Estimate>> = counts.iter().map(|counts| share(&counts.touches)).collect();
    let by_approaches: Vec<Vec<Estimate>> = counts.iter().map(|counts| share(&counts.approaches)).collect();
    let used = counts.iter().map(|counts| counts.made[1] as f64 / counts.made[0].max(1) as f64).collect();
    let run = |position, group| margins.active_outcome(active, (position, group), (rule, *seed));
    let outcomes = margins.each(*groups, run);
    let figures = |outcomes, in_approaches| {
        margins.of_outcomes(outcomes, margins.stated(&settings.sequences(), rule), rule.max_touches(), in_approaches)
    };
    let accuracies = margins.accuracies(at_approaches, &by_approaches);
    let approaches = margins.in_approaches(used, accuracies, figures(outcomes.clone(), true));
    let accuracies = margins.accuracies(at, &by_touches);
    Ok(margins.evaluation(settings, accuracies, figures(outcomes, false), Some(approaches), true))
}

impl Margins<'_> {
    /// Accuracy for a tested object after the numbers of touches and approaches that are asked for. A sequence that
    /// ends before keeps what it has; one without any evidence has recognized nothing.
    fn counts(&self, active: &Active, position: usize, settings: &Settings) -> Counts {
        let Settings { at, at_approaches, groups, seed, .. } = settings;
        let most = |at: &[usize]| at.iter().copied().max().unwrap_or(0);
        let (most_touches, most_approaches) = (most(at), most(at_approaches));
        let object = self.tested[position].object;
        // It stops where nothing could change any more.
        let Some(never) = Stopping::new(1e-15, u32::MAX) else { unreachable!("both are in their ranges") };
        let none = || Counts { touches: vec![0; at.len()], approaches: vec![0; at_approaches.len()], made: [0; 2] };
        let add = |counts: &mut [usize], at: &[usize], numbers: std::ops::Range<usize>| {
            for (count, _) in counts.iter_mut().zip(at).filter(|(_, at)| numbers.contains(at)) {
                *count += 1;
            }
        };
        let group = |mut counts: Counts, group| {
            // Touches, approaches, and whether the object had the most evidence then.
            let mut last = (0, 0, false);
            self.follow_plan(
                active,
                (position, group),
                (never, *seed),
                |follower, Counted { touches, approaches, .. }| {
                    // A state counts up to the next one.
                    let (touches, approaches) = (touches as usize, approaches as usize);
                    if last.2 {
                        add(&mut counts.touches, at, last.0..touches);
                        add(&mut counts.approaches, at_approaches, last.1..approaches);
                    }
                    last = (touches, approaches, touches > 0 && follower.leader() == object);
                    touches >= most_touches && approaches >= most_approaches
                },
            );
            let (touches, approaches, is_right) = last;
            if is_right {
                add(&mut counts.touches, at, touches..usize::MAX);
                add(&mut counts.approaches, at_approaches, approaches..usize::MAX);
            }
            counts.made[0] += approaches;
            counts.made[1] += touches;
            counts
        };
        let sum = |mut a: Counts, b: Counts| {
            a.touches.iter_mut().zip(b.touches).for_each(|(a, b)| *a += b);
            a.approaches.iter_mut().zip(b.approaches).for_each(|(a, b)| *a += b);
            a.made.iter_mut().zip(b.made).for_each(|(a, b)| *a += b);
            a
        };
        (0..*groups).into_par_iter().fold(none, group).reduce(none, sum)
    }
}
