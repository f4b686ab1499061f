//! The figures of an evaluation as JSON and as text.

use palpate::evaluate::{
    ActiveFacts, AlarmCheck, Approaches, Evaluated, Evaluation, Finding, OnStrangers, PromiseCheck, Sequential,
};
use palpate::wording::{self, count, counted, rate};
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
    let share = |name: &String| {
        format!("{name} {:.1} %", 100.0 * of.error_of_given_per_object.get(name).copied().unwrap_or(f64::NAN))
    };
    if of.above.is_empty() {
        return String::new();
    }
    let promise = " The promise is of all names together; palpate calibrate --per object makes one of each object.";
    format!(
        "More than {} are wrong of the names given to: {}.{}\n",
        rate(of.error_rate),
        of.above.iter().map(share).collect::<Vec<_>>().join(", "),
        of.promised.map_or("", |_| promise)
    )
}

/// The promise, the measurement, the outcome, and what makes the promise void.
fn promise_text(check: &PromiseCheck) -> String {
    let of = match (check.per, &check.of) {
        ("name", Some(name)) => format!(" of {name}, the name that is wrong most often,"),
        ("object", Some(name)) => format!(" of the names given to {name}, the object that is mistaken most often,"),
        _ => " of the names given".to_owned(),
    };
    let mut text = format!(
        "\nPromised: at most {} wrong ({}, {} sure, from {} sequences). Measured: {:.2} %{of} ± {:.2}: {}.\n",
        rate(check.promised),
        match check.per {
            "name" => "each name, when it is given",
            "object" => "each object",
            _ => "on average",
        },
        rate(check.confidence),
        count(check.sequences),
        100.0 * check.error,
        100.0 * check.standard_error,
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
                "By theory it is at most {:.1} % with any priors, if posteriors can be believed.",
                100.0 * most
            );
        }
    }
    text
}

/// Finding about a promise, in words; `untested` is why there is none.
fn found(finding: Finding, above: f64, untested: &str) -> String {
    let points = 100.0 * above;
    match finding {
        Finding::Kept => "the promise is kept".to_owned(),
        Finding::Unclear => format!("{points:.2} points above what is promised, which may be chance"),
        Finding::Broken => format!("the promise is broken by {points:.2} points"),
        Finding::Untested => format!("{untested}, so nothing is known of the promise"),
    }
}

/// The promised share of false alarms beside the one that was found.
fn alarms_text(check: &AlarmCheck) -> String {
    let above = check.above.iter().map(|(name, share)| format!("{name} {:.1} %", 100.0 * share));
    let above = above.collect::<Vec<_>>().join(", ");
    format!(
        "\nKnown objects taken for unknown. Promised: at most {} ({} sure, from {} sequences). Measured: {:.2} % ± {:.2}: {}.{}\n",
        rate(check.promised),
        rate(check.confidence),
        count(check.sequences),
        100.0 * check.found,
        100.0 * check.standard_error,
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
        "{rows}\nStopping {}: {:.1} touches on average, {:.2} % wrong (± {:.2}), {:.2} % undecided after \
         {}.\nWrong: of all sequences; of names: of those that got a name.\n{} groups per object of {} touches in all; ± is \
         a standard error.\n",
        stops(sequential.error_rate, sequential.promised),
        sequential.mean_touches,
        100.0 * sequential.error,
        100.0 * sequential.error_standard_error,
        100.0 * sequential.undecided,
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
    let width = per_object.keys().map(|name| name.chars().count()).max().unwrap_or(0).max(head.len());
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let row = |name: &str, accuracy: Vec<String>, stops: Vec<String>| {
        let accuracy = accuracy.iter().map(|cell| format!(" {cell:>7}"));
        let stops = stops.iter().map(|cell| format!(" {cell:>9}"));
        format!("{name:width$}{}\n", accuracy.chain(stops).collect::<String>())
    };
    let shares = |accuracy: &ByNumber| accuracy.values().copied().map(percent).collect();
    let stops = |stop: f64, wrong: f64, of_given: f64, undecided: f64, used: Option<f64>| {
        let own = [format!("{stop:.1}"), percent(wrong), given(of_given), percent(undecided)];
        own.into_iter().chain(used.map(percent)).collect()
    };
    let titles = ["to stop", "wrong", "of names", "undecided"].into_iter().chain(used.map(|_| "used"));
    let numbers = accuracy.keys().map(ToString::to_string).collect();
    let mut text = row(head, numbers, titles.map(String::from).collect());
    for (name, accuracy) in per_object {
        let of = |shares: &BTreeMap<String, f64>| shares.get(name).copied().unwrap_or(f64::NAN);
        let stops = stops(
            of(&sequential.per_object),
            of(&sequential.error_per_object),
            of(&sequential.error_of_given_per_object),
            of(&sequential.undecided_per_object),
            used.map(|(_, used)| of(used)),
        );
        text += &row(name, shares(accuracy), stops);
    }
    let Sequential { error, error_of_given, undecided, error_standard_error, .. } = *sequential;
    let (mean, used) = (sequential.mean(), used.map(|(used, _)| used));
    text += &row("all", shares(accuracy), stops(mean.value, error, error_of_given, undecided, used));
    let spread = spread.map(|spread| {
        row("±", shares(spread), vec![format!("{:.1}", mean.standard_error), percent(error_standard_error)])
    });
    text + &spread.unwrap_or_default()
}

/// A share of names given: none where no name was given.
fn given(share: f64) -> String {
    if share.is_finite() { format!("{:.1} %", 100.0 * share) } else { "–".into() }
}

/// Figures by approaches: rows, then the sequential figures.
fn approaches_table(approaches: &Approaches, patterns: &BTreeMap<&str, f64>) -> String {
    let sequential = &approaches.sequential;
    let used = Some((approaches.used, &approaches.used_per_object));
    let rows = rows("approaches", sequential, (&approaches.accuracy, &approaches.per_object), used, None);
    let shares = patterns.iter().map(|(pattern, share)| format!("{pattern} {:.1} %", 100.0 * share));
    format!(
        "\n{rows}\nStopping {}: {:.1} approaches on average (± {:.1}), {:.1} of them evidence, {:.2} % \
         wrong (± {:.2}), {:.2} % undecided.\nFingers that touched: {}.\n",
        stops(sequential.error_rate, sequential.promised),
        sequential.mean().value,
        sequential.mean().standard_error,
        sequential.mean_touches,
        100.0 * sequential.error,
        100.0 * sequential.error_standard_error,
        100.0 * sequential.undecided,
        shares.collect::<Vec<_>>().join(", "),
    )
}

/// Answers to strangers, in percent: one row per object.
fn strangers_table(strangers: &OnStrangers) -> String {
    let percent = |share: f64| wording::percent(share, 1);
    if !strangers.has_test {
        let named = strangers.wrong_name_per_object.iter().map(|(name, share)| format!("{name} {}", percent(*share)));
        return format!(
            "\nObjects that the model does not know: {} got a name, {} no verdict. The model has no test of whether touches \
             fit an object that it knows, so it never says that one is unknown: palpate calibrate --detect-unknown adds one. \
             Got a name: {}.\n{}",
            percent(strangers.wrong_name),
            percent(strangers.undecided),
            named.collect::<Vec<_>>().join(", "),
            used_up(strangers)
        );
    }
    let names = strangers.detected_per_object.keys().map(|name| name.chars().count());
    let width = names.max().unwrap_or(0).max("detected by".len());
    let mut text = format!("\n{:width$}", "detected by");
    // Writing to a string cannot fail.
    strangers.detected.keys().for_each(|at| _ = write!(text, " {at:>8}"));
    _ = writeln!(text, " {:>9}", "named");
    let mut line = |name: &str, detected: &BTreeMap<usize, f64>, named: f64| {
        _ = write!(text, "{name:width$}");
        detected.values().for_each(|share| _ = write!(text, " {:>8}", percent(*share)));
        _ = writeln!(text, " {:>9}", percent(named));
    };
    for (name, detected) in &strangers.detected_per_object {
        line(name, detected, strangers.wrong_name_per_object.get(name).copied().unwrap_or(f64::NAN));
    }
    line("all", &strangers.detected, strangers.wrong_name);
    let (alarms, undecided) = (percent(strangers.false_alarms), percent(strangers.undecided));
    _ = writeln!(
        text,
        "\nObjects that the model does not know: the share detected after each number of touches, and the share that got a name; \
         {undecided} got no verdict.\nOf the objects that it knows, {alarms} were taken for unknown."
    );
    text + &used_up(strangers)
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
        wording::percent(*used_up, 1)
    )
}

/// A confusion matrix in shares of its rows, under a title: a row for each of these names, a column for each of those.
pub(super) fn shares_table(title: &str, rows: &[String], columns: &[String], counts: &[Vec<usize>]) -> String {
    let names = rows.iter().chain(columns);
    let width = names.map(|name| name.chars().count()).max().unwrap_or(0).max("7.1 %".len() + 2);
    let mut text = format!("\n{title}\n{:width$}", "");
    // Writing to a string cannot fail.
    columns.iter().for_each(|name| _ = write!(text, " {name:>width$}"));
    text.push('\n');
    for (name, counts) in rows.iter().zip(counts) {
        let groups = counts.iter().sum::<usize>().max(1) as f64;
        _ = write!(text, "{name:width$}");
        for &count in counts {
            let share = if count == 0 { "–".into() } else { format!("{:.1} %", 100.0 * count as f64 / groups) };
            _ = write!(text, " {share:>width$}");
        }
        text.push('\n');
    }
    text
}
