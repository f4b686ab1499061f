//! The figures of an evaluation under a model's plan.

use super::active::Active;
use crate::error::{Error, Result};
use crate::evaluate::curve::{Recognized, See};
use crate::evaluate::margins::Margins;
use crate::evaluate::{Estimate, Evaluation, Settings};
use palpate_onboard::Stopping;

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
    // It stops where nothing could change any more.
    let Some(never) = Stopping::new(1e-15, u32::MAX) else { unreachable!("both are in their ranges") };
    let most = [at, at_approaches].map(|at| at.iter().copied().max().unwrap_or(0));
    let counts = |position| {
        let run = |group, see: &mut See<'_>| {
            margins.follow_plan(active, (position, group), (never, *seed), |follower, counted| see(follower, counted));
        };
        margins.recognized(position, *groups, most, run)
    };
    let counts: Vec<Recognized> = (0..margins.tested.len()).map(counts).collect();
    let share = |counts: &[usize], at: &[usize]| -> Vec<Estimate> {
        at.iter().map(|&at| Estimate::share(counts[at], *groups)).collect()
    };
    let by_touches: Vec<_> = counts.iter().map(|counts| share(&counts.touches, at)).collect();
    let by_approaches: Vec<_> = counts.iter().map(|counts| share(&counts.approaches, at_approaches)).collect();
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
