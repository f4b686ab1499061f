//! The published numbers compared with ours.

use super::confusion::recall_precision;
use super::context::Context;
use super::cross_validation::{Fold, accuracies, shares};
use super::limit::{self, Limit};
use super::noise;
use super::sequential::Sequences;
use super::statistics::{mean_deviation, paired_difference};
use crate::page::table::{Cell, Records, Table};
use serde::Serialize;

/// The numbers that `summary.json` holds: accuracies as shares of one.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Summary {
    /// Accuracy of the paper's method.
    pub(super) paper: Method,
    /// Accuracy of ours.
    pub(super) ours: Method,
    /// Accuracy of ours, trained for noise; measured on noisy touches only.
    pub(super) ours_for_noise_at_10_with_5_ms: (f64, f64),
    /// The difference of accuracies at ten touches, ours less the paper's, and its 95 % interval, paired over folds.
    pub(super) difference_at_10: (f64, Option<f64>, Option<f64>),
    /// The limit's accuracy after 10 and 30 touches.
    pub(super) limit_at_10: f64,
    /// See above.
    pub(super) limit_at_30: f64,
    /// Distance of each from the limit at ten touches, with its 95 % interval.
    pub(super) paper_behind_limit: (f64, f64, f64),
    /// See above.
    pub(super) ours_behind_limit: (f64, f64, f64),
    /// Change of the limit from doubling the capture.
    pub(super) limit_doubling: f64,
    /// Full touches of each object that the limit was estimated from.
    pub(super) limit_touches: usize,
}

/// One method's numbers: means and standard deviations over folds.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Method {
    /// After ten touches.
    pub(super) at_10: (f64, f64),
    /// After thirty.
    pub(super) at_30: (f64, f64),
    /// After sixty.
    pub(super) at_60: (f64, f64),
    /// After ten, with noise of 5 ms.
    pub(super) at_10_with_5_ms: (f64, f64),
    /// Mean recall of objects after ten touches.
    pub(super) recall: f64,
    /// Mean precision.
    pub(super) precision: f64,
    /// Mean touches until sure, for a threshold of 0.01, and the errors made.
    pub(super) touches_until_sure: (f64, f64),
    /// The fixed number of touches that errs no more often.
    pub(super) fixed: Option<usize>,
}

/// Gathers the numbers.
pub(super) fn summary(
    context: &Context,
    folds: &[Fold],
    noisy: &[noise::Fold],
    limit: &Limit,
    sequences: &Sequences,
) -> Summary {
    let method = |index: usize| {
        let both = recall_precision(&shares(folds, index));
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| both.iter().map(of).sum::<f64>() / both.len().max(1) as f64;
        let stopped = sequences.methods[index].iter().find(|stopped| stopped.rate == 0.01);
        Method {
            at_10: mean_deviation(&accuracies(folds, index, 10)),
            at_30: mean_deviation(&accuracies(folds, index, 30)),
            at_60: mean_deviation(&accuracies(folds, index, 60)),
            at_10_with_5_ms: noise::accuracy_at(context, noisy, index, 5.0),
            recall: mean(&|pair| pair.0),
            precision: mean(&|pair| pair.1),
            touches_until_sure: stopped.map_or((0.0, 0.0), |stopped| (stopped.touches, stopped.error)),
            fixed: stopped.and_then(|stopped| stopped.fixed),
        }
    };
    let (mean, low, high) = paired_difference(&accuracies(folds, 0, 10), &accuracies(folds, 1, 10));
    let finite = |value: f64| value.is_finite().then_some(value);
    let best = &limit.candidates[limit.best].curve;
    Summary {
        paper: method(0),
        ours: method(1),
        ours_for_noise_at_10_with_5_ms: noise::accuracy_at(context, noisy, 2, 5.0),
        difference_at_10: (mean, finite(low), finite(high)),
        limit_at_10: best[9],
        limit_at_30: best[29],
        paper_behind_limit: limit.gap_at_10(limit::PAPER),
        ours_behind_limit: limit.gap_at_10(limit::OURS),
        limit_doubling: limit.doubling(),
        limit_touches: limit.captured,
    }
}

/// The table that the report opens with.
pub(super) fn table(context: &Context, summary: &Summary) -> Table {
    let mut data = Records::new(["measure", "paper, as published", "paper's method here", "ours here", "limit here"]);
    let spread = |(value, deviation): (f64, f64)| Cell::PercentSpread(value, deviation, 1);
    let percent = |value| Cell::Percent(value, 1);
    let (paper, ours) = (&summary.paper, &summary.ours);
    data.push([
        "accuracy after 10 touches".into(),
        Cell::PercentSpread(0.907, 0.025, 1),
        spread(paper.at_10),
        spread(ours.at_10),
        percent(summary.limit_at_10),
    ]);
    data.push([
        "accuracy after 30 touches".into(),
        Cell::from("about 99\u{a0}%"),
        spread(paper.at_30),
        spread(ours.at_30),
        percent(summary.limit_at_30),
    ]);
    data.push(["accuracy after 60 touches".into(), Cell::Missing, spread(paper.at_60), spread(ours.at_60)]);
    data.push([
        "accuracy after 10, noise of 5 ms".into(),
        percent(0.821),
        spread(paper.at_10_with_5_ms),
        spread(ours.at_10_with_5_ms),
    ]);
    data.push([
        "the same, trained for noise".into(),
        Cell::Missing,
        Cell::Missing,
        spread(summary.ours_for_noise_at_10_with_5_ms),
    ]);
    data.push(["recall after 10 touches".into(), percent(0.895), percent(paper.recall), percent(ours.recall)]);
    data.push(["precision after 10 touches".into(), Cell::Missing, percent(paper.precision), percent(ours.precision)]);
    let sure = |method: &Method| Cell::Number(method.touches_until_sure.0, 1);
    data.push(["touches until sure (threshold 0.01)".into(), Cell::Missing, sure(paper), sure(ours)]);
    let wrong = |method: &Method| Cell::Percent(method.touches_until_sure.1, 2);
    data.push(["errors then".into(), Cell::Missing, wrong(paper), wrong(ours)]);
    let fixed = |method: &Method| method.fixed.map_or(Cell::Missing, Cell::count);
    data.push(["fixed number of touches with no more errors".into(), Cell::Missing, fixed(paper), fixed(ours)]);
    let (mean, low, high) = summary.difference_at_10;
    let points = |value: f64| crate::page::axis::number(value * 100.0, 1);
    let interval = match (low, high) {
        (Some(low), Some(high)) => format!(
            " (95 % interval {} to {}, paired over folds, which share training touches)",
            points(low),
            points(high)
        ),
        _ => String::new(),
    };
    Table {
        id: "published".into(),
        title: "Accuracy, recall and touches".into(),
        caption: format!(
            "The paper is the publication of the method that is compared with ours: 1000 trees on the three contact times of \
             full touches (see `docs/reference/words.md`). The paper's meshes are not ours: it used ten ShapeNet models that cannot be had here, so its numbers \
             cannot be compared with the others directly; the columns beside them share their objects and touches. ± is \
             one standard deviation over {} folds. At ten touches ours is right {} points more often than the paper's \
             method{interval}. Touches until sure and the limit are measured on the large capture.",
            context.settings.folds_used,
            points(mean)
        ),
        command: context.settings.command.clone(),
        data,
    }
}

/// Summary in two sentences.
pub(super) fn sentence(summary: &Summary) -> String {
    let percent = |value: f64| crate::page::axis::number(value * 100.0, 1);
    format!(
        "After ten touches the paper's method recognizes the object {}\u{a0}% of the time, ours {}\u{a0}%, and the best that any classifier could \
         do with three contact times is about {}\u{a0}%. Stopping when sure, ours takes {} touches on average \
         for {}\u{a0}% errors.",
        percent(summary.paper.at_10.0),
        percent(summary.ours.at_10.0),
        percent(summary.limit_at_10),
        crate::page::axis::number(summary.ours.touches_until_sure.0, 1),
        crate::page::axis::number(summary.ours.touches_until_sure.1 * 100.0, 2),
    )
}
