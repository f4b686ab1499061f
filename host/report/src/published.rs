//! The published numbers compared with ours.

use super::confusion::{mean, recall_precision};
use super::context::{Context, NOISE};
use super::cross_validation::{Fold, PAPERS_GROUPS, accuracies, shares};
use super::limit;
use super::measured::Measured;
use super::noise;
use super::promises::SHOWN;
use super::statistics::{mean_deviation, paired_difference};
use crate::page::document::Figure;
use palpate::ensemble::{Ensemble, train};
use palpate::error::Result;
use palpate::results::{Results, Value};
use palpate::row;
use palpate::wording::{count, counted, decimal};

/// Accuracy of the paper's method (0) or ours (1) after so many touches: mean and standard deviation over folds.
fn accuracy(folds: &[Fold], method: usize, touches: usize) -> (f64, f64) {
    mean_deviation(&accuracies(folds, method, touches))
}

/// The table that the report opens with: accuracies over groups of test touches of the folds. None where no fold was
/// tested.
pub(super) fn table(context: &Context, measured: &Measured) -> Result<Option<Figure>> {
    let mut data = Results::new(["measure", "paper, as published", "paper's method here", "ours here"]);
    let spread = |(value, deviation): (f64, f64)| Value::PercentSpread(value, deviation, 1);
    let percent = |value: f64| Value::Percent(value, 1);
    let settings = context.settings;
    let (mut tested, mut compared) = (Vec::new(), String::new());
    if let Some(folds) = &measured.folds {
        let published = [spread((0.907, 0.025)), "about 99\u{a0}%".into(), Value::Missing];
        for (touches, published) in [10, 30, 60].into_iter().zip(published) {
            let [paper, ours] = [0, 1].map(|method| spread(accuracy(folds, method, touches)));
            data.push(row![format!("accuracy after {touches} touches"), published, paper, ours]);
        }
        tested.push(counted(settings.folds_used, "fold", "folds"));
    }
    if let Some(noisy) = &measured.noisy {
        let at_5_ms = |method| spread(noise::accuracy_at(context, noisy, method, NOISE / 1e3));
        data.push(row!["accuracy after 10, noise of 5 ms", percent(0.821), at_5_ms(0), at_5_ms(1)]);
        data.push(row!["the same, trained for noise", Value::Missing, Value::Missing, at_5_ms(2)]);
        tested.push(format!("with noise over {}", counted(noisy.len(), "fold", "folds")));
    }
    if let Some(folds) = &measured.folds {
        let [paper, ours] = [0, 1].map(|method| mean(&recall_precision(&shares(folds, method))));
        data.push(row!["recall after 10 touches", percent(0.895), percent(paper.0), percent(ours.0)]);
        data.push(row!["precision after 10 touches", Value::Missing, percent(paper.1), percent(ours.1)]);
        compared = format!(
            " With equally many groups of each object, mean recall is the accuracy. {}",
            difference(paired_difference(&accuracies(folds, 0, 10), &accuracies(folds, 1, 10)))
        );
    }
    if tested.is_empty() {
        return Ok(None);
    }
    let caption = format!(
        "The paper is the publication of the method that is compared with ours. {} The paper's meshes are not ours: it used ten \
         ShapeNet models that are not available here, so its numbers cannot be compared with the others directly; the columns beside \
         them share their objects and touches. Published: ± over the paper's folds, of {PAPERS_GROUPS} groups per object. Here: {} \
         groups per object and fold; ± is one standard deviation over {}.{compared}",
        method(&context.models()?.paper, settings.paper_rounds),
        count(settings.many_groups),
        tested.join(", ")
    );
    Ok(Some(Figure::new("published", "Accuracy and recall", caption, data)))
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

/// The difference of accuracies after ten touches, ours less the paper's, with its interval, in words.
fn difference((mean, low, high): (f64, f64, f64)) -> String {
    let points = |value: f64| decimal(value * 100.0, 1);
    let side = if mean < 0.0 { "below" } else { "above" };
    let interval = match low.is_finite() && high.is_finite() {
        true => format!(
            " (95 % interval of the difference {} to {}, paired over folds, which share training touches)",
            points(low),
            points(high)
        ),
        false => String::new(),
    };
    format!(
        "After ten touches our accuracy is {} points {side} that of the paper's method{interval}.",
        points(mean.abs())
    )
}

/// Figures that the large capture gives: the limit, and touches until sure. None where neither was measured.
pub(super) fn large(context: &Context, measured: &Measured) -> Option<Figure> {
    let limits = measured.limit.as_ref();
    let columns = ["measure", "paper's method", "ours"].into_iter().chain(limits.map(|_| "limit"));
    let (mut data, mut groups) = (Results::new(columns), Vec::new());
    if let Some(limit) = limits {
        groups.push(format!("accuracies over {} groups per object", count(limit.groups)));
        for at in [10, 30] {
            let [paper, ours, best] = [limit::PAPER, limit::OURS, limit.best]
                .map(|candidate| limit.candidates[candidate].curve.get(at - 1).map(|&share| Value::Percent(share, 1)));
            data.push(row![format!("accuracy after {at} touches"), paper, ours, best]);
        }
    }
    if let Some(promises) = &measured.promises {
        groups
            .push(format!("touches until sure over the {} sequences that test promises", count(promises.sequences[1])));
        let [paper, ours] = promises.until_sure;
        let limit = || limits.map(|_| Value::Missing);
        let [touches, wrong] = [format!("touches until sure (threshold {SHOWN})"), "wrong names then".into()];
        let touches = row![touches, Value::Number(paper.touches, 1), Value::Number(ours.touches, 1)];
        data.push(touches.into_iter().chain(limit()));
        data.push(
            row![wrong, Value::Percent(paper.error, 2), Value::Percent(ours.error, 2)].into_iter().chain(limit()),
        );
    }
    if groups.is_empty() {
        return None;
    }
    let limit = match limits {
        Some(_) => " The limit is the best that any classifier could do, as far as it can be estimated.",
        None => "",
    };
    let caption = format!(
        "Of the first fold's models, on the {} full touches of each object of a separate capture that none was trained on: {}.{limit}",
        count(limit::tested(context.settings)),
        groups.join(", ")
    );
    Some(Figure::new("published-large", "On the large capture", caption, data))
}

/// Summary in a sentence for each way of testing.
pub(super) fn sentence(context: &Context, measured: &Measured) -> String {
    let percent = |value: f64| Value::Percent(value, 1).shown();
    let mut sentences = Vec::new();
    if let Some(folds) = &measured.folds {
        let [paper, ours] = [0, 1].map(|method| percent(accuracy(folds, method, 10).0));
        sentences.push(format!(
            "After ten touches the paper's method recognizes the object {paper} of the time, and ours {ours}."
        ));
    }
    if let Some(noisy) = &measured.noisy {
        let [paper, ours] = [0, 1].map(|method| percent(noise::accuracy_at(context, noisy, method, NOISE / 1e3).0));
        sentences.push(format!(
            "With noise of {} ms on contact times, the paper's method recognizes {paper} after ten touches, and ours {ours}.",
            NOISE / 1e3
        ));
    }
    if let Some(limit) = &measured.limit {
        sentences.push(format!(
            "About {} is the best that any classifier could do after ten touches, with three contact times each.",
            percent(limit.candidates[limit.best].curve[9])
        ));
    }
    if let Some(promises) = &measured.promises {
        let [_, ours] = promises.until_sure;
        sentences.push(format!(
            "Stopping when sure, ours takes {} touches on average for {} wrong names.",
            decimal(ours.touches, 1),
            Value::Percent(ours.error, 2).shown()
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
        assert_says(difference((-0.012, -0.02, 0.004)), &["1.2 points below", "\u{2212}2.0 to 0.4"]);
        assert_eq!(
            difference((0.122, f64::NAN, f64::NAN)),
            "After ten touches our accuracy is 12.2 points above that of the paper's method."
        );
    }
}
