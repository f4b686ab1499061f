//! `palpate data check`.

use crate::commands::Global;
use palpate::Result;
use palpate::error::{Place, problem};
use palpate::results::{Results, Value};
use palpate::row;
use palpate::touches::Origin;
use palpate::touches::check::{Check, ObjectSummary, Summary};
use palpate::wording::{count, counted};
use palpate_shared::format::Length;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
The command names every line that it cannot read, and data that can be read but would train badly: a file appended to itself, one object under two names, times that are not in seconds, an incomplete capture. The exit code is 1 if training would go wrong; anything that may be intended is only a note.

Examples:
  palpate data check recorded
  palpate data check monday.mcap --json")]
pub(super) struct Arguments {
    /// A directory with a file of touches for each object, or a robot's log (MCAP)
    #[arg(value_name = "DIR")]
    directory: PathBuf,
}

pub(super) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let check = Check::of(&arguments.directory)?;
    global.print(&check, || text(&check))?;
    match check.wrong() {
        0 => Ok(()),
        count => Err(problem!("training on these touches would be wrong, for {}", counted(count, "reason", "reasons"))
            .fix("Correct the faults listed above, then check again.")
            .at(Place::file(&arguments.directory))),
    }
}

/// The findings, then the summary.
fn text(check: &Check) -> String {
    let mut text = String::new();
    for finding in &check.findings {
        let kind = if finding.is_wrong { "wrong" } else { "note" };
        let fix = if finding.fix.is_empty() { String::new() } else { format!(". {}", finding.fix) };
        text += &format!("{kind}: {finding}{fix}\n");
    }
    if !check.findings.is_empty() {
        text.push('\n');
    }
    text + &summary(&check.summary)
}

fn summary(summary: &Summary) -> String {
    let Summary { objects, origin, .. } = summary;
    let counts = ["none", "outer", "middle", "outer+mid", "both outer", "all", "duplicates", "with pose"];
    let mut rows = Results::new(["object", "touches", "approaches"].into_iter().chain(counts).chain(["longest / s"]));
    let mut full = Results::new(["object", "feature", "least", "5 %", "25 %", "50 %", "75 %", "95 %", "largest"]);
    for object in objects {
        let ObjectSummary { name, touches, approaches, patterns, duplicates, posed, longest, .. } = object;
        let approaches = approaches.map_or("?".into(), Value::from);
        let counts = patterns.iter().chain([duplicates, posed]).map(|&count| count.into());
        let longest = Value::Number(*longest, 6);
        rows.push(row![name, *touches, approaches].into_iter().chain(counts).chain([longest]));
        for (feature, quantiles) in [("curvature", object.curvature), ("slope", object.slope)] {
            let values = quantiles.iter().flatten().map(|&value| Value::Number(value, 3));
            quantiles.is_some().then(|| full.push(row![name, feature].into_iter().chain(values)));
        }
    }
    let probe = match origin {
        None => "unknown, since there is no dataset.json".to_owned(),
        Some(origin) => {
            let unit = if origin.unit == Length::Millimeter { "mm" } else { "units" };
            let probe = &origin.probe;
            format!(
                "radius {} {unit}, spacing {} {unit}, speed {} {unit}/s, tilt {}°; seed {}, {}",
                probe.radius,
                probe.spacing,
                probe.speed,
                probe.tilt,
                origin.seed,
                match origin {
                    Origin { position: true, .. } => "every approach, with the hand's position",
                    Origin { approaches: true, .. } => "every approach",
                    _ => "full touches only",
                }
            )
        }
    };
    format!(
        "{}\nfull touches, milliseconds: least, quantiles, largest\n{}\nprobe: {probe}\n{}, {} touches\n",
        rows.text(),
        full.text(),
        counted(objects.len(), "object", "objects"),
        count(summary.touches())
    )
}
