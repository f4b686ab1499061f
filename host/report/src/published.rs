//! The published numbers compared with ours.

use super::confusion::recall_precision;
use super::context::Context;
use super::cross_validation::{Fold, PAPERS_GROUPS, accuracies, shares};
use super::limit::{self, Limit};
use super::noise;
use super::sequential::Sequences;
use super::statistics::{mean_deviation, paired_difference};
use crate::page::table::{Cell, Records, Table};
use palpate::ensemble::{Ensemble, train};
use palpate::error::Result;
use palpate::wording::{count, counted, decimal};
use serde::Serialize;

/// The threshold of touches until sure.
const SURE: f64 = 0.01;

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
    /// Mean touches until sure, for a threshold of [`SURE`], and the errors made.
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
        let stopped = sequences.methods[index].iter().find(|stopped| stopped.rate == SURE);
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

/// The table that the report opens with: accuracies over groups of test touches of the folds.
pub(super) fn table(context: &Context, summary: &Summary, noisy: &[noise::Fold]) -> Result<Table> {
    let mut data = Records::new(["measure", "paper, as published", "paper's method here", "ours here"]);
    let spread = |(value, deviation): (f64, f64)| Cell::PercentSpread(value, deviation, 1);
    let percent = |value| Cell::Percent(value, 1);
    let (paper, ours) = (&summary.paper, &summary.ours);
    data.push([
        "accuracy after 10 touches".into(),
        Cell::PercentSpread(0.907, 0.025, 1),
        spread(paper.at_10),
        spread(ours.at_10),
    ]);
    data.push([
        "accuracy after 30 touches".into(),
        Cell::from("about 99\u{a0}%"),
        spread(paper.at_30),
        spread(ours.at_30),
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
    let settings = context.settings;
    Ok(Table {
        id: "published".into(),
        title: "Accuracy and recall".into(),
        caption: format!(
            "The paper is the publication of the method that is compared with ours. {} The paper's meshes are not ours: it used \
             ten ShapeNet models that are not available here, so its numbers cannot be compared with the others directly; the \
             columns beside them share their objects and touches. Published: ± over the paper's folds, of \
             {PAPERS_GROUPS} groups per object. Here: {} groups per object and fold; ± is one standard deviation over {}, with \
             noise over {}. With equally many groups of each object, mean recall is the accuracy. {}",
            method(&context.models()?.paper, settings.paper_rounds),
            count(settings.many_groups),
            counted(settings.folds_used, "fold", "folds"),
            counted(noisy.len(), "fold", "folds"),
            difference(summary.difference_at_10)
        ),
        command: context.settings.command.clone(),
        data,
    })
}

/// The trees of the paper's method as it is measured here, compared with the published ones.
fn method(paper: &Ensemble, rounds: usize) -> String {
    let trees = paper.trees.len();
    let published = trees / rounds.max(1) * train::Settings::paper().rounds;
    let fewer = match trees == published {
        true => String::new(),
        false => format!(
            " ({} as published: {} boosting rounds instead of {rounds})",
            count(published),
            train::Settings::paper().rounds
        ),
    };
    format!(
        "Here it is {} trees{fewer} on the three contact times of full touches, grown by Palpate's own trainer with XGBoost's \
         loss (see `docs/reference/words.md`).",
        count(trees)
    )
}

/// The difference of accuracies after ten touches, ours less the paper's, in words.
fn difference((mean, low, high): (f64, Option<f64>, Option<f64>)) -> String {
    let points = |value: f64| decimal(value * 100.0, 1);
    let side = if mean < 0.0 { "below" } else { "above" };
    let interval = match (low, high) {
        (Some(low), Some(high)) => format!(
            " (95 % interval of the difference {} to {}, paired over folds, which share training touches)",
            points(low),
            points(high)
        ),
        _ => String::new(),
    };
    format!(
        "After ten touches our accuracy is {} points {side} that of the paper's method{interval}.",
        points(mean.abs())
    )
}

/// Figures that the large capture gives: the limit, and touches until sure.
pub(super) fn large(context: &Context, summary: &Summary, limit: &Limit, sequences: &Sequences) -> Table {
    let mut data = Records::new(["measure", "paper's method", "ours", "limit"]);
    for at in [10, 30] {
        let of = |candidate: usize| limit.candidates[candidate].curve.get(at - 1).copied();
        let cell = |candidate: usize| of(candidate).map_or(Cell::Missing, |share| Cell::Percent(share, 1));
        data.push([
            format!("accuracy after {at} touches").into(),
            cell(limit::PAPER),
            cell(limit::OURS),
            cell(limit.best),
        ]);
    }
    let (paper, ours) = (&summary.paper, &summary.ours);
    let sure = |method: &Method| Cell::Number(method.touches_until_sure.0, 1);
    data.push([format!("touches until sure (threshold {SURE})").into(), sure(paper), sure(ours)]);
    let wrong = |method: &Method| Cell::Percent(method.touches_until_sure.1, 2);
    data.push(["errors then".into(), wrong(paper), wrong(ours)]);
    let fixed = |method: &Method| method.fixed.map_or(Cell::Missing, Cell::count);
    data.push(["fixed number of touches with no more errors".into(), fixed(paper), fixed(ours)]);
    Table {
        id: "published-large".into(),
        title: "Touches until sure, and the limit".into(),
        caption: format!(
            "Of the first fold's models, on the {} full touches of each object of a separate capture that none was trained on: \
             accuracies over {} groups per object, touches until sure over {} sequences per object. The limit is the best that \
             any classifier could do, as far as it can be estimated.",
            count(limit.tested),
            count(limit.groups),
            count(sequences.count)
        ),
        command: context.settings.command.clone(),
        data,
    }
}

/// Summary in two sentences.
pub(super) fn sentence(summary: &Summary) -> String {
    let percent = |value: f64| decimal(value * 100.0, 1);
    format!(
        "After ten touches the paper's method recognizes the object {}\u{a0}% of the time, ours {}\u{a0}%, and the best that any classifier could \
         do with three contact times is about {}\u{a0}%. Stopping when sure, ours takes {} touches on average \
         for {}\u{a0}% errors.",
        percent(summary.paper.at_10.0),
        percent(summary.ours.at_10.0),
        percent(summary.limit_at_10),
        decimal(summary.ours.touches_until_sure.0, 1),
        decimal(summary.ours.touches_until_sure.1 * 100.0, 2),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::ensemble::{self, Node, Output, Tree};
    use palpate_shared::Descriptor;

    #[test]
    fn a_method_of_500_trees_is_not_called_one_of_1000() {
        let of = |trees: usize| Ensemble {
            inputs: palpate::ensemble::inputs(Descriptor::Times),
            objects: (0..10).map(|k| k.to_string()).collect(),
            base_margins: vec![0.0; 10],
            trees: vec![Tree { nodes: vec![Node::Leaf(vec![0.5; 10])], output: Output::Each }; trees],
            origin: ensemble::Origin::default(),
        };
        let quick = method(&of(500), 50);
        assert!(
            quick.contains("Here it is 500 trees (1,000 as published: 100 boosting rounds instead of 50)"),
            "{quick}"
        );
        let full = method(&of(1_000), 100);
        assert!(full.contains("Here it is 1,000 trees on the three"), "{full}");
    }

    #[test]
    fn a_difference_below_zero_is_below() {
        let said = difference((-0.012, Some(-0.02), Some(0.004)));
        assert!(said.contains("1.2 points below") && said.contains("\u{2212}2.0 to 0.4"), "{said}");
        assert_eq!(
            difference((0.122, None, None)),
            "After ten touches our accuracy is 12.2 points above that of the paper's method."
        );
    }
}
