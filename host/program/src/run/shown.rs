//! Output of a run: the text that it prints, and its page.

use super::{AT_APPROACHES, METHODS, Method, PICTURE, PLAY, Recognition, Summary, TABLE_AT, Trial};
use palpate::capture;
use palpate::evaluate::{Approaches, Evaluation, Finding, PromiseCheck, Sequential};
use palpate::mesh::Object;
use palpate::results::{Results, Value};
use palpate::row;
use palpate::wording::{count, decimal, percent, rate};
use palpate_report::page::document::Picture;
use palpate_report::page::render;
use palpate_report::run_page::RunMethod;
use palpate_report::statistics::{LEAST_GROUPS, distinct_groups};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

pub(super) fn pictures(objects: &[Object], captured: &capture::Summary) -> Vec<Picture> {
    let captured_as = |name: &str| captured.objects.iter().find(|object| object.name == name);
    let picture = |object: &Object| Picture {
        name: object.name.clone(),
        png: render::thumbnail(object.mesh(), PICTURE),
        line: captured_as(&object.name).map_or_else(String::new, |c| {
            format!("{} of approaches are full touches", percent(c.touches as f64 / c.approaches.max(1) as f64, 1))
        }),
    };
    objects.iter().map(picture).collect()
}

pub(super) fn shown(name: &str, Trial { curve, method, fewest, .. }: &Trial) -> RunMethod {
    let touches: Vec<usize> = [1, 2, 3, 5, 7, 10, 14, 20, 30, 42, 60, 85, 120]
        .into_iter()
        .filter(|&n| n <= curve.most() && distinct_groups(*fewest, n) >= LEAST_GROUPS)
        .collect();
    let objects = method.evaluation.per_object.keys().enumerate();
    RunMethod {
        name: name.into(),
        curve: touches
            .iter()
            .map(|&n| {
                let accuracy = curve.accuracy(n);
                (n, accuracy.value, accuracy.standard_error)
            })
            .collect(),
        bytes: method.model_bytes,
        per_object: objects
            .map(|(position, name)| {
                (name.clone(), touches.iter().map(|&n| (n, curve.object_accuracy(position, n).value)).collect())
            })
            .collect(),
    }
}

/// The table that the program prints and the page shows: the paper's method, ours where it waits for full touches, and
/// ours where every contact is evidence, side by side.
pub(super) fn table(summary: &Summary) -> Results {
    let mut table = Results::new(["measure"].into_iter().chain(METHODS));
    let mut row = |name: &str, [paper, full, ours]: [Value; 3]| table.push(row![name, paper, full, ours]);
    let both = |value: &dyn Fn(&Method) -> Value| [&summary.paper, &summary.full, &summary.ours].map(value);
    let approaches =
        |value: &dyn Fn(&Approaches) -> Value| both(&|method| method.evaluation.approaches.as_ref().map(value).into());
    let wanted = rate(summary.ours.evaluation.sequential.error_rate);
    let promised = |of: &Sequential| of.promised.map(|rate| Value::Percent(rate, 2)).into();
    let accuracy = |accuracy: &BTreeMap<usize, f64>, errors: &BTreeMap<usize, f64>, at: usize| {
        accuracy.get(&at).zip(errors.get(&at)).map(|(&share, &error)| Value::PercentSpread(share, error, 1)).into()
    };
    row(
        &format!("approaches to a {wanted} error rate, stopping when sure"),
        approaches(&|of| Value::Spread(of.sequential.mean().value, of.sequential.mean().standard_error, 1)),
    );
    row("  promised", approaches(&|of| promised(&of.sequential)));
    row("  wrong verdicts", approaches(&|of| Value::Percent(of.sequential.error, 2)));
    row("  undecided when touches ran out", approaches(&|of| Value::Percent(of.sequential.undecided, 2)));
    for at in AT_APPROACHES {
        let name = format!("accuracy after {at} approaches");
        row(&name, approaches(&|of| accuracy(&of.accuracy, &of.accuracy_standard_error, at)));
    }
    row("share of approaches that are evidence", approaches(&|of| Value::Percent(of.used, 1)));
    for at in TABLE_AT {
        let of = |of: &Evaluation| accuracy(&of.accuracy, &of.accuracy_standard_error, at);
        row(&format!("accuracy after {at} touches"), both(&|method| of(&method.evaluation)));
    }
    let touches = |value: &dyn Fn(&Sequential) -> Value| both(&|method| value(&method.evaluation.sequential));
    row(
        &format!("touches to a {wanted} error rate, stopping when sure"),
        touches(&|of| Value::Spread(of.mean_touches, of.mean().standard_error, 1)),
    );
    row("  promised", touches(&promised));
    row("  wrong verdicts", touches(&|of| Value::Percent(of.error, 2)));
    row("  undecided when touches ran out", touches(&|of| Value::Percent(of.undecided, 2)));
    let fixed = |method: &Method| match (method.fixed_touches, method.followed_to) {
        (None, 0) => Value::Missing,
        (None, followed) => format!("over {}", count(followed)).into(),
        (touches, _) => touches.into(),
    };
    row(&format!("touches to a {wanted} error rate, a fixed number"), both(&fixed));
    row("model bytes", both(&|method| method.model_bytes.into()));
    row("trees", both(&|method| method.trees.into()));
    row("training, seconds", both(&|method| Value::Number(method.train_seconds, 1)));
    let captures = [&summary.capture, &summary.capture, &summary.approach_capture];
    row("capture, seconds", captures.map(|capture| Value::Number(capture.seconds, 1)));
    let speed = |of: &capture::Summary| Value::Number(of.approaches() as f64 / of.seconds.max(1e-9), 0);
    row("approaches captured per second", captures.map(speed));
    row("largest margin error, nats", both(&|method| Value::Number(method.parity.max_margin_error, 5)));
    row("  bound that the model states", both(&|method| Value::Number(method.parity.stated_bound, 5)));
    row("verdicts that differ from the full model's", both(&|method| method.parity.verdict_differs.into()));
    table
}

/// Note about the test touches, and about a missing accuracy, if one is missing.
pub(super) fn note(summary: &Summary) -> String {
    let noise = &summary.noise;
    let noise = match noise.is_none() {
        true => "No noise was added to touches.".to_owned(),
        false => format!("Ours was trained, and all are tested, with {noise}; the paper's method is trained without."),
    };
    [noise, calibration(summary), above(summary), missing(summary)]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join(" ")
}

/// Basis of the promises, or the reason why there are none.
fn calibration(summary: &Summary) -> String {
    let ours = &summary.ours;
    let promise = match (&ours.calibration, &ours.uncalibrated) {
        (Some(calibrated), _) => format!(
            "The model keeps its promise with a confidence of {}; its thresholds were found on {} sequences of {} captured \
             for that.",
            rate(calibrated.confidence),
            count(calibrated.sequences),
            calibrated.counted
        ),
        (None, why) => format!("The model promises nothing: {}.", why.as_deref().unwrap_or("it was not calibrated")),
    };
    let others = METHODS.into_iter().zip([&summary.paper, &summary.full]);
    let why = |(name, method): (&str, &Method)| method.uncalibrated.as_ref().map(|why| format!(" {name}: {why}."));
    promise + &others.filter_map(why).collect::<String>()
}

/// Promises whose rate was measured to be exceeded, and if chance may be the reason.
fn above(summary: &Summary) -> String {
    let methods = METHODS.into_iter().zip([&summary.paper, &summary.full, &summary.ours]);
    let of = |(name, method): (&str, &Method)| {
        let own =
            method.evaluation.promise.as_ref().filter(|_| method.promise_of_approaches != method.evaluation.promise);
        let checks = [(own, "touches"), (method.promise_of_approaches.as_ref(), "approaches")];
        let said = checks.into_iter().filter_map(|(check, of)| exceeded(name, check?, of));
        said.collect::<Vec<_>>()
    };
    methods.flat_map(of).collect::<Vec<_>>().join(" ")
}

/// A promise whose rate was exceeded, as a sentence.
fn exceeded(name: &str, check: &PromiseCheck, of: &str) -> Option<String> {
    let why = match check.finding {
        Finding::Kept | Finding::Untested => return None,
        Finding::Unclear => "which may be chance",
        Finding::Broken => "by more than chance explains",
    };
    Some(format!(
        "In sequences of {of}, {} (± {}) of the names that “{name}” gave are wrong: above the promised {}, {why}.",
        percent(check.error, 2),
        decimal(100.0 * check.standard_error, 2),
        rate(check.promised)
    ))
}

/// Meaning of a missing accuracy, if one is missing.
fn missing(summary: &Summary) -> String {
    let missing = |method: &Method| TABLE_AT.iter().any(|at| !method.evaluation.accuracy.contains_key(at));
    if ![&summary.paper, &summary.full, &summary.ours].into_iter().any(missing) {
        return String::new();
    }
    format!(
        "A dash (–) replaces an accuracy that would rest on fewer than {LEAST_GROUPS} distinct groups of test touches; \
         capture more touches to measure it."
    )
}

pub(super) fn facts(summary: &Summary) -> Vec<(String, String)> {
    let touches = summary.touches;
    let stages: Vec<_> = summary.stages.iter().map(|stage| format!("{} {:.1}", stage.name, stage.seconds)).collect();
    [
        ("command", summary.command.clone()),
        ("version", summary.tool_version.into()),
        ("seed", summary.seed.to_string()),
        ("touches trained on", count(touches.train)),
        ("touches tested on", count(touches.test)),
        ("seconds in all", decimal(summary.seconds, 1)),
        ("seconds of each stage", stages.join("; ")),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .to_vec()
}

/// The summary as the program prints it.
pub fn text(summary: &Summary, out: &Path) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let capture = &summary.capture;
    _ = writeln!(
        text,
        "Touched {} objects {} times with all three fingers, in {} approaches, and approached them {} times more, keeping \
         every approach. Tested on {} and {} of these, which training never saw.\n",
        capture.objects.len(),
        count(capture.touches()),
        count(capture.approaches()),
        count(summary.approach_capture.approaches()),
        count(summary.touches.test),
        count(summary.approaches.test),
    );
    let mut recognized = Results::list();
    for Recognition { touched, recognized: name, touches: _, approaches, posterior } in &summary.recognized {
        let said = match name {
            Some(name) if name == touched => "recognized".to_owned(),
            Some(name) => format!("mistaken for {name}"),
            None => "undecided".to_owned(),
        };
        let posterior = name.as_ref().map_or_else(String::new, |_| format!(", posterior {posterior:.4}"));
        recognized.push([format!("  {touched}"), format!("{said} after {approaches:>3} approaches{posterior}")]);
    }
    text += &format!("{}\n{}", recognized.text(), table(summary).text());
    let note = note(summary);
    if !note.is_empty() {
        _ = writeln!(text, "\n{note}");
    }
    _ = writeln!(
        text,
        "\n± is a standard error. {} s in all. The page: {}; to touch the objects yourself: {}",
        decimal(summary.seconds, 1),
        out.join("report.html").display(),
        out.join(PLAY).display()
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_promise_that_is_exceeded_is_remarked_on_and_a_kept_one_is_not() {
        let check = |finding: Finding, error: f64| PromiseCheck {
            promised: 0.01,
            per: "average",
            confidence: 0.95,
            sequences: 10_000,
            error,
            standard_error: 0.0011,
            of: None,
            exceeded_by: error - 0.01,
            finding,
            void: Vec::new(),
            recorded: None,
            by_theory: None,
        };
        assert_eq!(exceeded("ours", &check(Finding::Kept, 0.009), "touches"), None);
        assert_eq!(
            exceeded("ours, full touches", &check(Finding::Unclear, 0.0116), "approaches").unwrap(),
            "In sequences of approaches, 1.16 % (± 0.11) of the names that “ours, full touches” gave are wrong: above the \
             promised 1 %, which may be chance."
        );
        let broken = exceeded("ours", &check(Finding::Broken, 0.03), "touches").unwrap();
        assert!(broken.ends_with("by more than chance explains."), "{broken}");
    }
}
