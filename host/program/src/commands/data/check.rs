//! `palpate data check`.

use crate::commands::Global;
use palpate::Result;
use palpate::error::{Place, problem};
use palpate::touches::Origin;
use palpate::touches::check::{Check, ObjectSummary, Quantiles, Summary};
use palpate::wording::counted;
use palpate_shared::format::Length;
use std::fmt::Write as _;
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

/// The findings, then the summary. Writing to a string cannot fail.
fn text(check: &Check) -> String {
    let mut text = String::new();
    for finding in &check.findings {
        let kind = if finding.is_wrong { "wrong" } else { "note" };
        let fix = if finding.fix.is_empty() { String::new() } else { format!(". {}", finding.fix) };
        _ = writeln!(text, "{kind}: {finding}{fix}");
    }
    if !check.findings.is_empty() {
        text.push('\n');
    }
    text + &summary(&check.summary)
}

fn summary(summary: &Summary) -> String {
    let Summary { objects, origin, .. } = summary;
    let mut text = String::new();
    let width = objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).max(6);
    let head = ["none", "outer", "middle", "outer+mid", "both outer", "all"];
    _ = write!(text, "{:width$}  {:>9}  {:>10}", "object", "touches", "approaches");
    head.iter().for_each(|name| _ = write!(text, "  {name:>10}"));
    _ = writeln!(text, "  {:>10}  {:>9}  {:>11}", "duplicates", "with pose", "longest / s");
    for object in objects {
        let ObjectSummary { name, touches, approaches, patterns, duplicates, posed, longest, .. } = object;
        let approaches = approaches.map_or("?".into(), |count| count.to_string());
        _ = write!(text, "{name:width$}  {touches:>9}  {approaches:>10}");
        patterns.iter().for_each(|count| _ = write!(text, "  {count:>10}"));
        _ = writeln!(text, "  {duplicates:>10}  {posed:>9}  {longest:>11.6}");
    }
    _ = writeln!(text, "\nfull touches, milliseconds: least, quantiles of 5, 25, 50, 75, 95 %, largest");
    for object in objects {
        let mut row = |feature: &str, quantiles: Option<Quantiles>| {
            let Some(quantiles) = quantiles else { return };
            _ = write!(text, "{:width$}  {feature:9}", object.name);
            quantiles.iter().for_each(|value| _ = write!(text, "  {value:>9.3}"));
            text.push('\n');
        };
        row("curvature", object.curvature);
        row("slope", object.slope);
    }
    text.push('\n');
    match origin {
        None => text += "probe: unknown, since there is no dataset.json\n",
        Some(origin) => {
            let unit = if origin.unit == Length::Millimeter { "mm" } else { "units" };
            let probe = &origin.probe;
            _ = writeln!(
                text,
                "probe: radius {} {unit}, spacing {} {unit}, speed {} {unit}/s, tilt {}°; seed {}, {}",
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
            );
        }
    }
    let plural = if objects.len() == 1 { "" } else { "s" };
    _ = writeln!(text, "{} object{plural}, {} touches", objects.len(), summary.touches());
    text
}
