//! `palpate recognize --features`: rows instead of touches.

use super::verify::read_rows;
use crate::Result;
use crate::error::RowsProblem;
use crate::evaluate::verify::{best, margins};
use crate::output;
use crate::rows::{Encoder, feature_names};
use palpate_onboard::{Recognizer, Verdict};
use std::path::Path;

/// What is said about a row.
#[derive(serde::Serialize)]
struct Line<'a> {
    /// Counted from 1.
    row: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    object: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    posterior: Option<f64>,
    /// Rows of the same object so far, where their evidence is added.
    #[serde(skip_serializing_if = "Option::is_none")]
    rows: Option<u32>,
    /// The row's own.
    margins: Vec<f64>,
}

/// Prints a verdict for each row: of that row alone, or where `adds_up` of it and those before it since the last verdict.
pub(super) fn run(recognizer: Recognizer<'_, 256>, path: &Path, adds_up: bool, json: bool) -> Result<()> {
    let mut recognizer = recognizer;
    let model = *recognizer.model();
    if model.descriptor().is_some() {
        return Err(RowsProblem::Touches.into());
    }
    let names = feature_names(&model);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let path = if path.as_os_str() == "-" { Path::new("/dev/stdin") } else { path };
    let rows = read_rows(path, &names, None)?;
    let encoder = Encoder::of(&model);
    for (number, row) in (1..).zip(rows.iter()) {
        let encoded = encoder.row(row);
        let own = margins(&model, &encoded);
        if !adds_up || recognizer.verdict() != Verdict::Undecided {
            recognizer.reset();
        }
        recognizer.push_features(&encoded).map_err(|_| RowsProblem::Touches)?;
        // The row's own margins are not rounded where the model adds f32; evidence is.
        let object = if adds_up { recognizer.best() } else { best(&own) };
        let verdict = match recognizer.verdict() {
            Verdict::Undecided => "undecided",
            Verdict::Recognized { .. } => "recognized",
            Verdict::Unknown => "unknown",
            Verdict::GaveUp => "gave-up",
        };
        let has_classes = model.object_count() > 1;
        let line = Line {
            row: number,
            verdict: has_classes.then_some(verdict),
            object: has_classes.then(|| model.object_name(object)),
            posterior: has_classes.then(|| recognizer.posterior(object).to_f64()),
            rows: (has_classes && adds_up).then(|| recognizer.touches()),
            margins: own,
        };
        print(&line, json)?;
    }
    Ok(())
}

fn print(line: &Line<'_>, json: bool) -> Result<()> {
    if json {
        // Numbers and strings are always JSON.
        let text = serde_json::to_string(line).unwrap_or_default();
        return output::print(&format!("{text}\n"));
    }
    match (line.verdict, line.object, line.posterior) {
        (Some(verdict), Some(object), Some(posterior)) => {
            output::print(&format!("{:4}  {verdict:10}  {object} {posterior:.4}\n", line.row))
        }
        _ => output::print(&format!("{:4}  {}\n", line.row, line.margins.first().copied().unwrap_or_default())),
    }
}
