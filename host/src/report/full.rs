//! The whole report: every stage measured or taken from what was measured before, then written as one page.

use super::cache::Cache;
use super::context::Context;
use super::page::{Page, Section};
use super::settings::Settings;
use super::{
    calibration, cost, cross_validation, generalisation, growth, limit, noise, objects, published, sequential,
};
use crate::error::{Error, Result};
use crate::output::write_json;
use crate::{capture, compile, progress, source, train};
use serde::Serialize;
use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What was written, and how long it took.
#[derive(Clone, Debug)]
pub struct Written {
    /// All files, the page last.
    pub files: Vec<PathBuf>,
    /// Seconds of the stages, as they were measured.
    pub stages: Vec<(String, f64)>,
    /// A sentence or two about the result.
    pub sentence: String,
    /// The numbers of `summary.json`.
    pub summary: serde_json::Value,
}

/// Measures everything and writes `directory/index.html`, the figures' and tables' files and `summary.json`. With
/// `resume`, stages that an earlier run with the same settings, tool version and objects finished are taken from it.
///
/// # Errors
/// What reading the sources, measuring and writing return; [`Error::Data`] for fewer than two objects.
pub fn full(settings: &Settings, directory: &Path, resume: bool) -> Result<Written> {
    let objects = source::objects(&settings.sources)?;
    if objects.len() < 2 {
        return Err(Error::data("there is only one object, and nothing to tell it from", "Give at least two objects."));
    }
    let began = Instant::now();
    let presets = format!(
        "{:?} {:?} {:?} {:?}",
        train::Settings::paper(),
        train::Settings::compact(),
        capture::Settings::default(),
        compile::Settings::default()
    );
    let cache = Cache::open(directory, &(settings, presets), &objects, resume)?;
    let context = Context::new(settings, &objects, &cache)?;
    let mut stages: Vec<(String, f64)> = Vec::new();
    let spinner = progress::spinner("report");
    let mut note = |name: &str, seconds: f64| {
        stages.push((name.to_string(), seconds));
        spinner.set_message(format!("report: {name} took {seconds:.1} s"));
    };

    let folds = cache.stage("cross-validation", || cross_validation::measure(&context))?;
    note("cross-validation", folds.seconds);
    let noisy = cache.stage("noise", || noise::measure(&context))?;
    note("noise", noisy.seconds);
    // The large capture is needed by four stages, and by none if all were measured before.
    let large = OnceCell::new();
    let get_large = || -> Result<&limit::Large> {
        if large.get().is_none() {
            let _ = large.set(limit::large(&context)?);
        }
        large.get().ok_or_else(|| Error::data("the large capture is missing", "Report this as a bug."))
    };
    let limit = cache.stage("limit", || limit::measure(&context, get_large()?))?;
    note("limit", limit.seconds);
    let sequences = cache.stage("sequential", || sequential::measure(&context, get_large()?))?;
    note("sequential", sequences.seconds);
    let calibration = cache.stage("calibration", || calibration::measure(&context, get_large()?))?;
    note("calibration", calibration.seconds);
    let members = cache.stage("cost", || cost::measure(&context, get_large()?))?;
    note("cost", members.seconds);
    drop(large);
    let growth = cache.stage("growth", || growth::measure(&context))?;
    note("growth", growth.seconds);
    let instances = cache.stage("generalisation", || generalisation::measure(&context))?;
    note("generalisation", instances.seconds);

    let summary = published::summary(&context, &folds.result, &noisy.result, &limit.result, &sequences.result);
    let mut first = Section::new("summary", "The paper's numbers beside ours");
    first.table(published::table(&context, &summary));
    let sections = vec![
        first,
        objects::section(&context)?,
        cross_validation::section(&context, &folds.result)?,
        noise::section(&context, &noisy.result)?,
        limit::section(&context, &limit.result)?,
        sequential::section(&context, &sequences.result)?,
        calibration::section(&context, &calibration.result)?,
        cost::section(&context, &members.result)?,
        growth::section(&context, &growth.result)?,
        generalisation::section(&context, &instances.result)?,
    ];
    drop(spinner);
    let sentence = published::sentence(&summary);
    let page = Page {
        title: "Recognising objects by touch".into(),
        summary: sentence.clone(),
        sections,
        facts: facts(settings, &stages, began.elapsed().as_secs_f64()),
        files: true,
    };
    let mut files = Vec::new();
    let everything = Everything { settings, version: env!("CARGO_PKG_VERSION"), summary: &summary, stages: &stages };
    let path = directory.join("summary.json");
    write_json(&path, &everything)?;
    files.push(path);
    files.extend(super::write(&page, &directory.join("index.html"))?);
    let summary = serde_json::to_value(&everything)
        .map_err(|e| Error::data(format!("cannot write the summary as JSON: {e}"), "Report this as a bug."))?;
    Ok(Written { files, stages, sentence, summary })
}

/// What `summary.json` holds.
#[derive(Serialize)]
struct Everything<'a> {
    settings: &'a Settings,
    version: &'a str,
    summary: &'a published::Summary,
    stages: &'a [(String, f64)],
}

/// Settings, version and times for the page's foot.
fn facts(settings: &Settings, stages: &[(String, f64)], seconds: f64) -> Vec<(String, String)> {
    let mut facts = vec![
        ("command".to_string(), settings.command()),
        ("version".to_string(), env!("CARGO_PKG_VERSION").to_string()),
        ("seed".to_string(), settings.seed.to_string()),
        ("touches an object".to_string(), settings.touches.to_string()),
        ("folds".to_string(), format!("{} of {}", settings.folds_used, settings.folds)),
        ("large capture, touches an object".to_string(), settings.limit_touches.to_string()),
        ("threads".to_string(), rayon::current_num_threads().to_string()),
        ("this run".to_string(), format!("{seconds:.0} s")),
    ];
    facts.extend(stages.iter().map(|(name, seconds)| (name.clone(), format!("{seconds:.1} s"))));
    facts
}
