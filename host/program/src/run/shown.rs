//! Output of a run: the text that it prints, and its page.

use super::{AT_APPROACHES, METHODS, Method, PICTURE, PLAY, Recognition, Summary, TABLE_AT, Trial};
use palpate::capture;
use palpate::evaluate::{Approaches, Finding, PromiseCheck};
use palpate::mesh::Object;
use palpate::wording::{count, decimal, percent, rate};
use palpate_report::page::document::Picture;
use palpate_report::page::render;
use palpate_report::page::table::{Cell, Records};
use palpate_report::run_page::RunMethod;
use palpate_report::statistics::{LEAST_GROUPS, distinct_groups};
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
pub(super) fn table(summary: &Summary) -> Records {
    let mut table = Records::new(["measure"].into_iter().chain(METHODS));
    let both = |cell: &dyn Fn(&Method) -> Cell| [&summary.paper, &summary.full, &summary.ours].map(cell);
    let mut row = |name: String, [paper, full, ours]: [Cell; 3]| table.push([Cell::Text(name), paper, full, ours]);
    let wanted = rate(summary.ours.evaluation.sequential.error_rate);
    let approaches = |cell: &dyn Fn(&Approaches) -> Cell| {
        both(&|method| method.evaluation.approaches.as_ref().map_or(Cell::Missing, cell))
    };
    row(
        format!("approaches to a {wanted} error rate, stopping when sure"),
        approaches(&|of| Cell::Spread(of.sequential.mean().value, of.sequential.mean().standard_error, 1)),
    );
    let promised = |rate: Option<f64>| rate.map_or(Cell::Missing, |rate| Cell::Percent(rate, 2));
    row("  promised".into(), approaches(&|of| promised(of.sequential.promised)));
    row("  wrong verdicts".into(), approaches(&|of| Cell::Percent(of.sequential.error, 2)));
    row("  undecided when touches ran out".into(), approaches(&|of| Cell::Percent(of.sequential.undecided, 2)));
    for at in AT_APPROACHES {
        let cell = |of: &Approaches| match (of.accuracy.get(&at), of.accuracy_standard_error.get(&at)) {
            (Some(&accuracy), Some(&error)) => Cell::PercentSpread(accuracy, error, 1),
            _ => Cell::Missing,
        };
        row(format!("accuracy after {at} approaches"), approaches(&cell));
    }
    row("share of approaches that are evidence".into(), approaches(&|of| Cell::Percent(of.used, 1)));
    for at in TABLE_AT {
        let cell = |method: &Method| {
            let evaluation = &method.evaluation;
            match (evaluation.accuracy.get(&at), evaluation.accuracy_standard_error.get(&at)) {
                (Some(&accuracy), Some(&error)) => Cell::PercentSpread(accuracy, error, 1),
                _ => Cell::Missing,
            }
        };
        row(format!("accuracy after {at} touches"), both(&cell));
    }
    row(
        format!("touches to a {wanted} error rate, stopping when sure"),
        both(&|m| {
            let sequential = &m.evaluation.sequential;
            Cell::Spread(sequential.mean_touches, sequential.mean().standard_error, 1)
        }),
    );
    row("  promised".into(), both(&|m| promised(m.evaluation.sequential.promised)));
    row("  wrong verdicts".into(), both(&|m| Cell::Percent(m.evaluation.sequential.error, 2)));
    row("  undecided when touches ran out".into(), both(&|m| Cell::Percent(m.evaluation.sequential.undecided, 2)));
    row(
        format!("touches to a {wanted} error rate, a fixed number"),
        both(&|m| {
            m.fixed_touches.map_or_else(
                || {
                    if m.followed_to == 0 {
                        Cell::Missing
                    } else {
                        Cell::Text(format!("over {}", count(m.followed_to)))
                    }
                },
                Cell::count,
            )
        }),
    );
    row("model bytes".into(), both(&|m| Cell::count(m.model_bytes)));
    row("trees".into(), both(&|m| Cell::count(m.trees)));
    row("training, seconds".into(), both(&|m| Cell::Number(m.train_seconds, 1)));
    let captures = [&summary.capture, &summary.capture, &summary.approach_capture];
    row("capture, seconds".into(), captures.map(|capture| Cell::Number(capture.seconds, 1)));
    row(
        "approaches captured per second".into(),
        captures.map(|capture| Cell::Number(capture.approaches() as f64 / capture.seconds.max(1e-9), 0)),
    );
    row("largest margin error, nats".into(), both(&|m| Cell::Number(m.parity.max_margin_error, 5)));
    row("  bound that the model states".into(), both(&|m| Cell::Number(m.parity.stated_bound, 5)));
    row("verdicts that differ from the full model's".into(), both(&|m| Cell::count(m.parity.verdict_differs)));
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
    let width = summary.recognized.iter().map(|r| r.touched.chars().count()).max().unwrap_or(0);
    for recognition in &summary.recognized {
        let Recognition { touched, recognized, touches: _, approaches, posterior } = recognition;
        _ = match recognized {
            Some(name) if name == touched => {
                writeln!(
                    text,
                    "  {touched:width$}  recognized after {approaches:>3} approaches, posterior {posterior:.4}"
                )
            }
            Some(name) => {
                writeln!(
                    text,
                    "  {touched:width$}  mistaken for {name} after {approaches} approaches, posterior {posterior:.4}"
                )
            }
            None => writeln!(text, "  {touched:width$}  undecided after {approaches} approaches"),
        };
    }
    let table = table(summary);
    let rows: Vec<Vec<String>> = std::iter::once(table.columns.clone())
        .chain(table.rows.iter().map(|row| row.iter().map(Cell::shown).collect()))
        .collect();
    let widths: Vec<usize> =
        (0..4).map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)).collect();
    _ = writeln!(text);
    for row in &rows {
        _ = writeln!(
            text,
            "{:w0$}  {:>w1$}  {:>w2$}  {:>w3$}",
            row[0],
            row[1],
            row[2],
            row[3],
            w0 = widths[0],
            w1 = widths[1],
            w2 = widths[2],
            w3 = widths[3]
        );
    }
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
