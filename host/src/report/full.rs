//! The whole report: every stage measured or taken from what was measured before, then written as one page.

use super::cache::Cache;
use super::context::Context;
use super::settings::Settings;
use super::{
    calibration, cost, cross_validation, generalization, growth, limit, noise, objects, published, sequential,
    simulator,
};
use crate::capture;
use crate::compile;
use crate::ensemble::train;
use crate::error::{Error, Result};
use crate::mesh::source;
use crate::output::write_json;
use crate::page::document::{Page, Section};
use crate::progress::Progress;
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
pub fn full(settings: &Settings, directory: &Path, resume: bool, progress: &dyn Progress) -> Result<Written> {
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
    let context = Context::new(settings, &objects, &cache, progress)?;
    let mut stages: Vec<(String, f64)> = Vec::new();
    progress.begin("report", None);
    let mut note = |name: &str, seconds: f64| {
        stages.push((name.to_string(), seconds));
        progress.begin(&format!("report: {name} took {seconds:.1} s"), None);
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
    let engines = cache.stage("simulator", || simulator::measure(&context))?;
    note("simulator", engines.seconds);
    let growth = cache.stage("growth", || growth::measure(&context))?;
    note("growth", growth.seconds);
    let instances = cache.stage("generalization", || generalization::measure(&context))?;
    note("generalization", instances.seconds);

    let summary = published::summary(&context, &folds.result, &noisy.result, &limit.result, &sequences.result);
    let mut first = Section::new("summary", "The paper's numbers beside ours");
    first.table(published::table(&context, &summary));
    let mut costs = cost::section(&context, &members.result)?;
    simulator::add(&context, &engines.result, &mut costs)?;
    let sections = vec![
        first,
        objects::section(&context)?,
        cross_validation::section(&context, &folds.result)?,
        noise::section(&context, &noisy.result)?,
        limit::section(&context, &limit.result)?,
        sequential::section(&context, &sequences.result)?,
        calibration::section(&context, &calibration.result)?,
        costs,
        growth::section(&context, &growth.result)?,
        generalization::section(&context, &instances.result)?,
    ];
    let sentence = published::sentence(&summary);
    let page = Page {
        title: "Recognizing objects by touch".into(),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::obj;
    use crate::output::write_whole;
    use std::collections::BTreeSet;

    /// Three ellipsoids with hills, as OBJ files.
    fn meshes(directory: &Path) -> Vec<String> {
        for (name, sides) in [("ball", [1.0, 1.0, 1.0]), ("cigar", [1.0, 0.3, 0.3]), ("disc", [1.0, 1.0, 0.2])] {
            let mut mesh = Mesh::globe(10);
            mesh.vertices.iter_mut().for_each(|vertex| (0..3).for_each(|axis| vertex[axis] *= sides[axis]));
            write_whole(&directory.join(format!("{name}.obj")), |out| obj::write(&mesh, out)).unwrap();
        }
        vec![directory.to_str().unwrap().to_string()]
    }

    fn tiny(sources: Vec<String>) -> Settings {
        Settings {
            touches: 400,
            folds_used: 2,
            paper_rounds: 3,
            levels: 4,
            many_groups: 20,
            noise_levels: 3,
            limit_touches: 1_000,
            limit_rounds: 3,
            growth_objects: vec![2, 3],
            growth_triangles: vec![100, 1_000],
            growth_touches: 400,
            instances: vec![1],
            test_instances: 1,
            instance_touches: 200,
            ..Settings::quick(sources, 1)
        }
    }

    #[test]
    fn a_report_has_every_figure_and_its_files_and_resumes_without_measuring_again() {
        let place = tempfile::tempdir().unwrap();
        let sources = meshes(&place.path().join("meshes"));
        let directory = place.path().join("report");
        let settings = tiny(sources);
        let written = full(&settings, &directory, false, &()).unwrap();
        let html = std::fs::read_to_string(directory.join("index.html")).unwrap();
        let files: BTreeSet<String> =
            written.files.iter().map(|file| file.file_name().unwrap().to_string_lossy().into_owned()).collect();
        for figure in [
            "curvature",
            "accuracy",
            "accuracy-objects",
            "confusion",
            "signal-to-noise",
            "noise",
            "noise-objects",
            "noise-confusion",
            "limit-curves",
            "sequential-trade",
            "sequential-objects",
            "reliability",
            "cost-bytes",
            "cost-time",
            "simulator-figure",
            "growth-objects-figure",
            "growth-triangles",
            "generalization",
        ] {
            assert!(html.contains(&format!("<figure id=\"{figure}\">")), "{figure}");
            for extension in ["svg", "csv"] {
                assert!(files.contains(&format!("{figure}.{extension}")), "{figure}.{extension}");
            }
        }
        assert!(files.contains("published.csv") && files.contains("summary.json"));
        assert!(!html.contains("NaN"), "a number is none");
        assert_eq!(html.matches("<img ").count(), 3);

        // Stages are taken as they are, their times too; a cut-off stage is measured again, and nothing else.
        let again = full(&settings, &directory, true, &()).unwrap();
        assert_eq!((&again.stages, &again.summary), (&written.stages, &written.summary));
        let kept = |name: &str| {
            let stages = std::fs::read_dir(directory.join(".stages")).unwrap().map(|entry| entry.unwrap().path());
            stages.into_iter().find(|path| path.file_name().unwrap().to_string_lossy().starts_with(name)).unwrap()
        };
        std::fs::remove_file(kept("growth-")).unwrap();
        let cut = full(&settings, &directory, true, &()).unwrap();
        let differ = written.stages.iter().zip(&cut.stages).filter(|(a, b)| a != b).map(|(a, _)| a.0.as_str());
        assert_eq!(differ.collect::<Vec<_>>(), ["growth"]);
    }

    #[test]
    fn one_object_is_refused_before_anything_is_written() {
        let place = tempfile::tempdir().unwrap();
        let sources = meshes(place.path());
        let one = vec![format!("{}/ball.obj", sources[0])];
        let directory = place.path().join("report");
        let error = full(&tiny(one), &directory, false, &()).unwrap_err();
        assert!(error.to_string().contains("only one object"), "{error}");
        assert!(!directory.exists());
    }
}
