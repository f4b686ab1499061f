//! The figures of an evaluation as JSON and as text.

use palpate::evaluate::{
    ActiveFacts, AlarmCheck, Approaches, Evaluated, Evaluation, Finding, OnStrangers, PromiseCheck, Sequential,
};
use palpate::results::{Results, Value};
use palpate::row;
use palpate::wording::{count, counted, decimal, percent, percent_within, rate, shares};
use palpate_shared::DIRECTIONS;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Output of `palpate evaluate`: tables, then sentences about what was asked for beside them.
pub(super) fn text(evaluated: &Evaluated) -> String {
    let mut text = table(&evaluated.evaluation);
    if let Some(approaches) = &evaluated.evaluation.approaches {
        text += &approaches_table(approaches, &evaluated.evaluation.patterns);
    }
    if let Some(promise) = &evaluated.evaluation.promise {
        text += &promise_text(promise);
    }
    text += &above_text(&evaluated.evaluation);
    if let Some(alarms) = &evaluated.evaluation.false_alarms {
        text += &alarms_text(alarms);
    }
    if let Some(ActiveFacts { rolls, poses, left_out, without_approaches }) = &evaluated.active {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "Each approach is in the pose that the plan proposed, of {poses} ({DIRECTIONS} directions, {} each; {left_out} never \
             touch, {without_approaches} have no approach here).",
            counted(usize::from(*rolls), "roll", "rolls")
        );
    }
    if evaluated.robots > 1 {
        // Writing to a string cannot fail.
        _ = writeln!(text, "Each group is of touches by one of {} robots, each with its own bias.", evaluated.robots);
    }
    if let Some(most) = evaluated.instances.values().max() {
        _ = writeln!(text, "Objects have up to {most} instances or recordings; each group is of touches of one.");
    }
    if let Some(strangers) = &evaluated.strangers {
        text += &strangers_table(strangers);
        if strangers.has_test && evaluated.evaluation.approaches.is_some() {
            text += "That is of sequences of touches that are evidence; the promise was tested on sequences of approaches.\n";
        }
    }
    if !evaluated.trained_on.is_empty() {
        let objects = evaluated.trained_on.join(", ");
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "\nThe model was trained on these touches of {objects}: on others it is right less often. Capture them with \
             another seed."
        );
    }
    text
}

/// At what recognizers stop.
fn stops(error_rate: f64, promised: Option<f64>) -> String {
    match promised {
        Some(promised) => format!("at a promised error rate of {}", rate(promised)),
        None => format!("at an error rate of {}", rate(error_rate)),
    }
}

/// Names that are wrong more often than the rate that was asked for or promised of all together.
fn above_text(evaluation: &Evaluation) -> String {
    let of = evaluation.approaches.as_ref().map_or(&evaluation.sequential, |approaches| &approaches.sequential);
    let share = |name| (name, of.error_of_given_per_object.get(name).copied().unwrap_or(f64::NAN));
    if of.above.is_empty() {
        return String::new();
    }
    let promise = " The promise is of all names together; palpate calibrate --per object makes one of each object.";
    format!(
        "More than {} are wrong of the names given to: {}.{}\n",
        rate(of.error_rate),
        shares(of.above.iter().map(share)),
        of.promised.map_or("", |_| promise)
    )
}

/// The promise, the measurement, the outcome, and what makes the promise void.
fn promise_text(check: &PromiseCheck) -> String {
    let of = match (check.per, &check.of) {
        ("name", Some(name)) => format!(" of {name}, the name that is wrong most often"),
        ("object", Some(name)) => format!(" of the names given to {name}, the object that is mistaken most often"),
        _ => " of the names given".to_owned(),
    };
    let mut text = format!(
        "\nPromised: at most {} wrong ({}, {} sure, from {} sequences). Measured: {}{of}: {}.\n",
        rate(check.promised),
        match check.per {
            "name" => "each name, when it is given",
            "object" => "each object",
            _ => "on average",
        },
        rate(check.confidence),
        count(check.sequences),
        percent_within(check.error, check.standard_error, 2),
        found(check.finding, check.exceeded_by, "no name was given")
    );
    if let Some(noise) = &check.recorded {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "It was made for simulated touches with {noise}; recorded ones hold the noise of their probe."
        );
    }
    if !check.void.is_empty() {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "It was made for other touches than these, for which it is void: {}.",
            check.void.join("; ")
        );
        if let Some(most) = check.by_theory {
            _ = writeln!(
                text,
                "By theory it is at most {} with any priors, if posteriors can be believed.",
                percent(most, 1)
            );
        }
    }
    text
}

/// Finding about a promise, in words; `untested` is why there is none.
fn found(finding: Finding, above: f64, untested: &str) -> String {
    let points = decimal(100.0 * above, 2);
    match finding {
        Finding::Kept => "the promise is kept".to_owned(),
        Finding::Unclear => format!("{points} points above what is promised, which may be chance"),
        Finding::Broken => format!("the promise is broken by {points} points"),
        Finding::Untested => format!("{untested}, so nothing is known of the promise"),
    }
}

/// The promised share of false alarms beside the one that was found.
fn alarms_text(check: &AlarmCheck) -> String {
    let above = shares(check.above.iter().map(|(name, share)| (name, *share)));
    format!(
        "\nKnown objects taken for unknown. Promised: at most {} ({} sure, from {} sequences). Measured: {}: {}.{}\n",
        rate(check.promised),
        rate(check.confidence),
        count(check.sequences),
        percent_within(check.found, check.standard_error, 2),
        found(check.finding, check.found - check.promised, "there was no sequence"),
        if above.is_empty() { String::new() } else { format!(" More than promised of: {above}.") }
    )
}

/// Figures by touches: rows, then the sequential figures.
fn table(evaluation: &Evaluation) -> String {
    let sequential = &evaluation.sequential;
    let spread = Some(&evaluation.accuracy_standard_error);
    let rows = rows("touches", sequential, (&evaluation.accuracy, &evaluation.per_object), None, spread);
    format!(
        "{rows}\nStopping {}: {} touches on average, {} wrong, {} undecided after {}.\nWrong: of all sequences; of names: of those \
         that got a name.\n{} groups per object of {} touches in all; ± is a standard error.\n",
        stops(sequential.error_rate, sequential.promised),
        decimal(sequential.mean_touches, 1),
        percent_within(sequential.error, sequential.error_standard_error, 2),
        percent(sequential.undecided, 2),
        sequential.max_touches,
        count(evaluation.groups),
        count(evaluation.touches),
    )
}

/// Shares by numbers of touches or approaches.
type ByNumber = BTreeMap<usize, f64>;

/// Accuracies in percent: one row per object, one column per number of what `head` names; beside them when recognizers stopped
/// and, if given, the share that was evidence. Below them standard errors, if given.
fn rows(
    head: &str,
    sequential: &Sequential,
    (accuracy, per_object): (&ByNumber, &BTreeMap<String, ByNumber>),
    used: Option<(f64, &BTreeMap<String, f64>)>,
    spread: Option<&ByNumber>,
) -> String {
    let titles = ["to stop", "wrong", "of names", "undecided"].into_iter().chain(used.map(|_| "used"));
    let numbers = accuracy.keys().map(ToString::to_string);
    let mut rows = Results::new([head.to_owned()].into_iter().chain(numbers).chain(titles.map(String::from)));
    let mut push = |name: &str, accuracy: &ByNumber, touches: f64, ends: Vec<f64>| {
        let share = |share: f64| Value::Percent(share, 1);
        let accuracy = accuracy.values().copied().map(share);
        let ends = ends.into_iter().map(share);
        rows.push(row![name].into_iter().chain(accuracy).chain([Value::Number(touches, 1)]).chain(ends));
    };
    for (name, accuracy) in per_object {
        let of = |shares: &BTreeMap<String, f64>| shares.get(name).copied().unwrap_or(f64::NAN);
        let Sequential { error_per_object, error_of_given_per_object, undecided_per_object, .. } = sequential;
        let ends = [error_per_object, error_of_given_per_object, undecided_per_object];
        let ends = ends.into_iter().chain(used.map(|(_, used)| used)).map(of);
        push(name, accuracy, of(&sequential.per_object), ends.collect());
    }
    let Sequential { error, error_of_given, undecided, error_standard_error, .. } = *sequential;
    let mean = sequential.mean();
    let ends = [error, error_of_given, undecided].into_iter().chain(used.map(|(used, _)| used));
    push("all", accuracy, mean.value, ends.collect());
    if let Some(spread) = spread {
        push("±", spread, mean.standard_error, vec![error_standard_error]);
    }
    rows.text()
}

/// Figures by approaches: rows, then the sequential figures.
fn approaches_table(approaches: &Approaches, patterns: &BTreeMap<&str, f64>) -> String {
    let sequential = &approaches.sequential;
    let used = Some((approaches.used, &approaches.used_per_object));
    let rows = rows("approaches", sequential, (&approaches.accuracy, &approaches.per_object), used, None);
    format!(
        "\n{rows}\nStopping {}: {} approaches on average, {} of them evidence, {} wrong, {} undecided.\nFingers that touched: \
         {}.\n",
        stops(sequential.error_rate, sequential.promised),
        Value::Spread(sequential.mean().value, sequential.mean().standard_error, 1).shown(),
        decimal(sequential.mean_touches, 1),
        percent_within(sequential.error, sequential.error_standard_error, 2),
        percent(sequential.undecided, 2),
        shares(patterns.iter().map(|(pattern, share)| (pattern, *share))),
    )
}

/// Answers to strangers, in percent: one row per object.
fn strangers_table(strangers: &OnStrangers) -> String {
    let OnStrangers { detected, detected_per_object, wrong_name, wrong_name_per_object, .. } = strangers;
    let undecided = percent(strangers.undecided, 1);
    if !strangers.has_test {
        return format!(
            "\nObjects that the model does not know: {} got a name, {undecided} no verdict. The model has no test of whether touches \
             fit an object that it knows, so it never says that one is unknown: palpate calibrate --detect-unknown adds one. \
             Got a name: {}.\n{}",
            percent(*wrong_name, 1),
            shares(wrong_name_per_object.iter().map(|(name, share)| (name, *share))),
            used_up(strangers)
        );
    }
    let numbers = detected.keys().map(ToString::to_string);
    let mut rows = Results::new(["detected by".into()].into_iter().chain(numbers).chain(["named".into()]));
    let mut push = |name: &str, detected: &ByNumber, named: f64| {
        let all = detected.values().copied().chain([named]);
        rows.push(row![name].into_iter().chain(all.map(|share| Value::Percent(share, 1))));
    };
    for (name, detected) in detected_per_object {
        push(name, detected, wrong_name_per_object.get(name).copied().unwrap_or(f64::NAN));
    }
    push("all", detected, *wrong_name);
    format!(
        "\n{}\nObjects that the model does not know: the share detected after each number of touches, and the share that got a name; \
         {undecided} got no verdict.\nOf the objects that it knows, {} were taken for unknown.\n{}",
        rows.text(),
        percent(strangers.false_alarms, 1),
        used_up(strangers)
    )
}

/// Meaning of a dash in the shares of strangers; nothing where there is none.
fn used_up(strangers: &OnStrangers) -> String {
    let OnStrangers { used_up, fewest_touches, max_touches, .. } = strangers;
    let shares = || strangers.detected_per_object.values().flat_map(BTreeMap::values);
    if shares().chain(strangers.wrong_name_per_object.values()).all(|share| share.is_finite()) {
        return String::new();
    }
    format!(
        "A dash (–): not known, since touches ran out before a verdict in more than one sequence of a hundred (in {} of all). The \
         model may take {max_touches} touches, and a sequence is drawn from {fewest_touches} at least: capture more approaches to \
         each of these objects, or to each of their instances.\n",
        percent(*used_up, 1)
    )
}

/// A confusion matrix in shares of its rows, under a title: a row for each of these names, a column for each of those.
pub(super) fn shares_table(title: &str, rows: &[String], columns: &[String], counts: &[Vec<usize>]) -> String {
    let mut shares = Results::new([String::new()].iter().chain(columns));
    for (name, counts) in rows.iter().zip(counts) {
        let all = counts.iter().sum::<usize>() as f64;
        let share = |&count: &usize| Value::from((count > 0).then(|| Value::Percent(count as f64 / all, 1)));
        shares.push(row![name].into_iter().chain(counts.iter().map(share)));
    }
    format!("\n{title}\n{}", shares.text())
}
