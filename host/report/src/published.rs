//! The published numbers compared with ours.

use super::confusion::recall_precision;
use super::context::{Context, NOISE};
use super::cross_validation::{Fold, PAPERS_GROUPS, accuracies, shares};
use super::limit;
use super::measured::Measured;
use super::noise;
use super::promises::{Promises, SHOWN, Stopped};
use super::statistics::{mean_deviation, paired_difference};
use crate::page::table::{Cell, Records, Table};
use palpate::ensemble::{Ensemble, train};
use palpate::error::Result;
use palpate::wording::{count, counted, decimal};
use serde::Serialize;

/// The numbers that `summary.json` holds: accuracies as shares of one. It has those of the parts that were measured.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Summary {
    /// Numbers of the paper's method.
    paper: Method,
    /// Numbers of ours.
    ours: Method,
    /// Accuracy of ours, trained for noise; measured on noisy touches only.
    #[serde(skip_serializing_if = "Option::is_none")]
    ours_for_noise_at_10_with_5_ms: Option<(f64, f64)>,
    /// The difference of accuracies at ten touches, ours less the paper's, and its 95 % interval, paired over folds.
    #[serde(skip_serializing_if = "Option::is_none")]
    difference_at_10: Option<(f64, Option<f64>, Option<f64>)>,
    #[serde(flatten)]
    limit: Option<Limit>,
}

/// The limit, and how far each method is from it.
#[derive(Clone, Debug, Serialize)]
struct Limit {
    /// Its accuracy after ten touches.
    limit_at_10: f64,
    /// After thirty.
    limit_at_30: f64,
    /// Distance of each from the limit at ten touches, with its 95 % interval.
    paper_behind_limit: (f64, f64, f64),
    /// See above.
    ours_behind_limit: (f64, f64, f64),
    /// Change of the limit from doubling the capture.
    limit_doubling: f64,
    /// Full touches of each object that the limit was estimated from.
    limit_touches: usize,
}

/// One method's numbers.
#[derive(Clone, Debug, Serialize)]
struct Method {
    #[serde(flatten)]
    accuracy: Option<Accuracy>,
    /// Accuracy after ten touches, with noise of 5 ms: mean and standard deviation over folds.
    #[serde(skip_serializing_if = "Option::is_none")]
    at_10_with_5_ms: Option<(f64, f64)>,
    #[serde(flatten)]
    until_sure: Option<UntilSure>,
}

/// Accuracy by cross-validation: means and standard deviations over folds.
#[derive(Clone, Debug, Serialize)]
struct Accuracy {
    /// After ten touches.
    at_10: (f64, f64),
    /// After thirty.
    at_30: (f64, f64),
    /// After sixty.
    at_60: (f64, f64),
    /// Mean recall of objects after ten touches.
    recall: f64,
    /// Mean precision.
    precision: f64,
}

/// Touches until sure, for a threshold of [`SHOWN`].
#[derive(Clone, Debug, Serialize)]
struct UntilSure {
    /// Mean touches, and the share of wrong names.
    touches_until_sure: (f64, f64),
}

impl Accuracy {
    fn of(folds: &[Fold], method: usize) -> Self {
        let both = recall_precision(&shares(folds, method));
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| both.iter().map(of).sum::<f64>() / both.len().max(1) as f64;
        let at = |touches| mean_deviation(&accuracies(folds, method, touches));
        Self {
            at_10: at(10),
            at_30: at(30),
            at_60: at(60),
            recall: mean(&|pair| pair.0),
            precision: mean(&|pair| pair.1),
        }
    }
}

impl UntilSure {
    fn of(promises: &Promises, method: usize) -> Self {
        let Stopped { touches, error, .. } = promises.until_sure[method];
        Self { touches_until_sure: (touches, error) }
    }
}

/// Gathers the numbers.
pub(super) fn summary(context: &Context, measured: &Measured) -> Summary {
    let Measured { folds, noisy, limit, promises, .. } = measured;
    let with_noise = |method| Some(noise::accuracy_at(context, noisy.as_ref()?, method, NOISE / 1e3));
    let method = |index: usize| Method {
        accuracy: folds.as_ref().map(|folds| Accuracy::of(folds, index)),
        at_10_with_5_ms: with_noise(index),
        until_sure: promises.as_ref().map(|promises| UntilSure::of(promises, index)),
    };
    let finite = |value: f64| value.is_finite().then_some(value);
    let difference = |folds: &Vec<Fold>| {
        let (mean, low, high) = paired_difference(&accuracies(folds, 0, 10), &accuracies(folds, 1, 10));
        (mean, finite(low), finite(high))
    };
    Summary {
        paper: method(0),
        ours: method(1),
        ours_for_noise_at_10_with_5_ms: with_noise(2),
        difference_at_10: folds.as_ref().map(difference),
        limit: limit.as_ref().map(|limit| {
            let best = &limit.candidates[limit.best].curve;
            Limit {
                limit_at_10: best[9],
                limit_at_30: best[29],
                paper_behind_limit: limit.gap_at_10(limit::PAPER),
                ours_behind_limit: limit.gap_at_10(limit::OURS),
                limit_doubling: limit.doubling(),
                limit_touches: limit.captured,
            }
        }),
    }
}

/// The table that the report opens with: accuracies over groups of test touches of the folds. None where no fold was
/// tested.
pub(super) fn table(context: &Context, summary: &Summary, measured: &Measured) -> Result<Option<Table>> {
    let mut data = Records::new(["measure", "paper, as published", "paper's method here", "ours here"]);
    let spread = |(value, deviation): (f64, f64)| Cell::PercentSpread(value, deviation, 1);
    let percent = |value| Cell::Percent(value, 1);
    let settings = context.settings;
    let (paper, ours) = (&summary.paper, &summary.ours);
    let (mut tested, mut compared) = (Vec::new(), String::new());
    if let Some((paper, ours)) = paper.accuracy.as_ref().zip(ours.accuracy.as_ref()) {
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
        tested.push(counted(settings.folds_used, "fold", "folds"));
    }
    if let Some(((paper, ours), trained)) =
        paper.at_10_with_5_ms.zip(ours.at_10_with_5_ms).zip(summary.ours_for_noise_at_10_with_5_ms)
    {
        data.push(["accuracy after 10, noise of 5 ms".into(), percent(0.821), spread(paper), spread(ours)]);
        data.push(["the same, trained for noise".into(), Cell::Missing, Cell::Missing, spread(trained)]);
        let folds = measured.noisy.as_ref().map_or(0, Vec::len);
        tested.push(format!("with noise over {}", counted(folds, "fold", "folds")));
    }
    if let Some((paper, ours)) = paper.accuracy.as_ref().zip(ours.accuracy.as_ref()) {
        data.push(["recall after 10 touches".into(), percent(0.895), percent(paper.recall), percent(ours.recall)]);
        data.push([
            "precision after 10 touches".into(),
            Cell::Missing,
            percent(paper.precision),
            percent(ours.precision),
        ]);
        compared = " With equally many groups of each object, mean recall is the accuracy.".into();
    }
    compared += &summary.difference_at_10.map_or_else(String::new, |of| format!(" {}", difference(of)));
    if tested.is_empty() {
        return Ok(None);
    }
    Ok(Some(Table {
        id: "published".into(),
        title: "Accuracy and recall".into(),
        caption: format!(
            "The paper is the publication of the method that is compared with ours. {} The paper's meshes are not ours: it used \
             ten ShapeNet models that are not available here, so its numbers cannot be compared with the others directly; the \
             columns beside them share their objects and touches. Published: ± over the paper's folds, of \
             {PAPERS_GROUPS} groups per object. Here: {} groups per object and fold; ± is one standard deviation over \
             {}.{compared}",
            method(&context.models()?.paper, settings.paper_rounds),
            count(settings.many_groups),
            tested.join(", ")
        ),
        command: settings.command.clone(),
        data,
    }))
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

/// Figures that the large capture gives: the limit, and touches until sure. None where neither was measured.
pub(super) fn large(context: &Context, summary: &Summary, measured: &Measured) -> Option<Table> {
    let (mut columns, mut rows, mut groups) = (vec!["measure", "paper's method", "ours"], Vec::new(), Vec::new());
    if let Some(limit) = &measured.limit {
        columns.push("limit");
        groups.push(format!("accuracies over {} groups per object", count(limit.groups)));
        for at in [10, 30] {
            let of = |candidate: usize| limit.candidates[candidate].curve.get(at - 1).copied();
            let cell = |candidate: usize| of(candidate).map_or(Cell::Missing, |share| Cell::Percent(share, 1));
            let name = format!("accuracy after {at} touches").into();
            rows.push(vec![name, cell(limit::PAPER), cell(limit::OURS), cell(limit.best)]);
        }
    }
    if let (Some(promises), Some(paper), Some(ours)) =
        (&measured.promises, &summary.paper.until_sure, &summary.ours.until_sure)
    {
        groups
            .push(format!("touches until sure over the {} sequences that test promises", count(promises.sequences[1])));
        let mut push =
            |name: String, cell: fn(&UntilSure) -> Cell| rows.push(vec![name.into(), cell(paper), cell(ours)]);
        push(format!("touches until sure (threshold {SHOWN})"), |of| Cell::Number(of.touches_until_sure.0, 1));
        push("wrong names then".into(), |of| Cell::Percent(of.touches_until_sure.1, 2));
    }
    if groups.is_empty() {
        return None;
    }
    let mut data = Records::new(columns);
    rows.into_iter().for_each(|row| data.push(row));
    let limit = match measured.limit {
        Some(_) => " The limit is the best that any classifier could do, as far as it can be estimated.",
        None => "",
    };
    Some(Table {
        id: "published-large".into(),
        title: "On the large capture".into(),
        caption: format!(
            "Of the first fold's models, on the {} full touches of each object of a separate capture that none was trained on: \
             {}.{limit}",
            count(limit::tested(context.settings)),
            groups.join(", ")
        ),
        command: context.settings.command.clone(),
        data,
    })
}

/// Summary in a sentence for each way of testing.
pub(super) fn sentence(summary: &Summary) -> String {
    let percent = |value: f64| decimal(value * 100.0, 1);
    let (paper, ours) = (&summary.paper, &summary.ours);
    let mut sentences = Vec::new();
    if let Some((paper, ours)) = paper.accuracy.as_ref().zip(ours.accuracy.as_ref()) {
        sentences.push(format!(
            "After ten touches the paper's method recognizes the object {}\u{a0}% of the time, and ours {}\u{a0}%.",
            percent(paper.at_10.0),
            percent(ours.at_10.0)
        ));
    }
    if let Some((paper, ours)) = paper.at_10_with_5_ms.zip(ours.at_10_with_5_ms) {
        sentences.push(format!(
            "With noise of {} ms on contact times, the paper's method recognizes {}\u{a0}% after ten touches, and ours \
             {}\u{a0}%.",
            NOISE / 1e3,
            percent(paper.0),
            percent(ours.0)
        ));
    }
    if let Some(limit) = &summary.limit {
        sentences.push(format!(
            "About {}\u{a0}% is the best that any classifier could do after ten touches, with three contact times each.",
            percent(limit.limit_at_10)
        ));
    }
    if let Some(UntilSure { touches_until_sure: (touches, errors) }) = ours.until_sure {
        sentences.push(format!(
            "Stopping when sure, ours takes {} touches on average for {}\u{a0}% wrong names.",
            decimal(touches, 1),
            decimal(errors * 100.0, 2)
        ));
    }
    match sentences.is_empty() {
        true => "This page has the sections that were chosen.".into(),
        false => sentences.join(" "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small::{assert_says, ensemble};
    use palpate::ensemble::Node;
    use palpate_shared::Descriptor;

    #[test]
    fn a_method_of_500_trees_is_not_called_one_of_1000() {
        let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j"];
        let of = |trees| ensemble(Descriptor::Times, &names, vec![vec![Node::Leaf(vec![0.5; 10])]; trees]);
        assert_says(
            method(&of(500), 50),
            &["Here it is 500 trees (1,000 as published: 100 boosting rounds instead of 50)"],
        );
        assert_says(method(&of(1_000), 100), &["Here it is 1,000 trees on the three"]);
    }

    #[test]
    fn a_difference_below_zero_is_below() {
        assert_says(difference((-0.012, Some(-0.02), Some(0.004))), &["1.2 points below", "\u{2212}2.0 to 0.4"]);
        assert_eq!(
            difference((0.122, None, None)),
            "After ten touches our accuracy is 12.2 points above that of the paper's method."
        );
    }
}
