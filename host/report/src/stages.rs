//! The whole report: measures every stage or takes it from an interrupted report, then writes one page.

use super::cache::{self, Cache};
use super::context::{Context, get_or_try};
use super::settings::Settings;
use super::{
    approaches, calibration, cost, cross_validation, generalization, growth, limit, noise, objects, plan, promises,
    published, recorded, results, sequential, simulator, strangers, table,
};
use crate::error::ReportProblem;
use crate::page::document::{Page, Section};
use palpate::capture;
use palpate::compare::Comparison;
use palpate::compile;
use palpate::ensemble::train;
use palpate::error::Result;
use palpate::mesh::{Object, source};
use palpate::output::{refuse_foreign, write_json};
use palpate::progress::{self, Progress};
use palpate::wording::count;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::json;
use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Files that were written, and the time that it took.
#[derive(Clone, Debug)]
pub struct Report {
    /// All files, the page last.
    pub files: Vec<PathBuf>,
    /// Seconds of the stages, as they were measured.
    pub stages: Vec<(String, f64)>,
    /// A sentence or two about the result.
    pub sentence: String,
    /// The contents of `summary.json`.
    pub summary: serde_json::Value,
}

/// Rules for the present contents of a report's directory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Existing {
    /// True to take stages that an interrupted report measured with the same settings, objects and program.
    pub resume: bool,
    /// True to replace another report's or run's results.
    pub replace: bool,
}

/// The progress of a report: whatever begins within a stage is named after it.
struct Named<'a> {
    progress: &'a dyn Progress,
    stage: Mutex<String>,
}

impl Named<'_> {
    /// The stage of all that begins from here on.
    fn enter(&self, stage: &str) {
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = stage.into();
        self.progress.begin(stage, None);
    }
}

impl Progress for Named<'_> {
    fn begin(&self, part: &str, total: Option<u64>) {
        let stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner).clone();
        self.progress.begin(&format!("{stage}: {part}"), total);
    }

    fn advance(&self, steps: u64) {
        self.progress.advance(steps);
    }

    fn is_cancelled(&self) -> bool {
        self.progress.is_cancelled()
    }
}

/// Stages that are measured, or were before.
struct Stages<'a> {
    cache: &'a Cache,
    progress: &'a Named<'a>,
    /// Names and seconds of those that are there.
    seconds: Vec<(String, f64)>,
}

impl Stages<'_> {
    /// The result of the stage; progress is told its name before it begins.
    fn stage<T: Serialize + DeserializeOwned>(&mut self, name: &str, measure: impl FnOnce() -> Result<T>) -> Result<T> {
        progress::check(self.progress)?;
        self.progress.enter(name);
        let stage = self.cache.stage(name, measure)?;
        self.seconds.push((name.to_string(), stage.seconds));
        Ok(stage.result)
    }
}

/// Measures everything and writes `directory/index.html`, the figures' and tables' files and `summary.json`. A report
/// that was interrupted, or cancelled through `progress`, can be resumed with [`Existing::resume`].
///
/// # Errors
/// What reading the sources, measuring and writing return; [`ReportProblem::OneObject`] for fewer than two objects;
/// [`ReportProblem::OtherResults`] for a directory that holds other results, unless [`Existing::replace`];
/// [`Error::Cancelled`](palpate::Error::Cancelled).
pub fn report(settings: &Settings, directory: &Path, existing: Existing, progress: &dyn Progress) -> Result<Report> {
    report_on(&|| source::objects(&settings.sources), settings, directory, existing, progress)
}

/// The same on the objects that `objects` gives, whatever the settings' sources are, such as objects with several
/// instances or at their true size. They must be sorted by name.
///
/// # Errors
/// As [`report`] and `objects`.
pub fn report_on(
    objects: &dyn Fn() -> Result<Vec<Object>>,
    settings: &Settings,
    directory: &Path,
    existing: Existing,
    progress: &dyn Progress,
) -> Result<Report> {
    // The command makes no difference to the results.
    let made_from = json!({ "job": "report", "settings": Settings { command: String::new(), ..settings.clone() } });
    if !existing.replace {
        results::refuse_others(directory, &made_from, &["index.html"], cache::DIRECTORY)?;
        refuse_foreign(&directory.join("index.html"))?;
    }
    let objects = objects()?;
    if objects.len() < 2 {
        return Err(ReportProblem::OneObject.into());
    }
    let began = Instant::now();
    let presets = format!(
        "{:?} {:?} {:?} {:?}",
        train::Settings::paper(),
        train::Settings::compact(),
        capture::Settings::default(),
        compile::Settings::default()
    );
    let recorded = settings.recorded.as_deref().map(recorded::fingerprint).transpose()?;
    let cache = Cache::open(directory, &(&made_from, presets, recorded), &objects, existing.resume)?;
    let progress = &Named { progress, stage: Mutex::new("objects".into()) };
    let context = Context::new(settings, &objects, &cache, progress)?;
    let mut stages = Stages { cache: &cache, progress, seconds: Vec::new() };
    let measured = measured(&context, &mut stages)?;
    let stages = stages.seconds;
    progress.enter("drawing");

    let Measured { folds, noisy, limit, sequences, .. } = &measured;
    let summary = published::summary(&context, folds, noisy, limit, sequences);
    let sections = sections(&context, &measured, &summary)?;
    let sentence = published::sentence(&summary);
    let page = Page {
        title: "Recognizing objects by touch".into(),
        summary: sentence.clone(),
        sections,
        facts: facts(settings, &stages, began.elapsed().as_secs_f64()),
        files: true,
    };
    let mut files = Vec::new();
    let everything = Everything {
        made_from: &made_from,
        settings,
        version: env!("CARGO_PKG_VERSION"),
        summary: &summary,
        stages: &stages,
    };
    let path = directory.join("summary.json");
    write_json(&path, &everything)?;
    files.push(path);
    files.extend(page.write(&directory.join("index.html"))?);
    let summary = results::json("summary", &everything)?;
    Ok(Report { files, stages, sentence, summary })
}

/// Results that the sections show.
struct Measured {
    folds: Vec<cross_validation::Fold>,
    noisy: Vec<noise::Fold>,
    limit: limit::Limit,
    sequences: sequential::Sequences,
    calibration: calibration::Calibration,
    promises: promises::Promises,
    members: Vec<cost::Member>,
    approaches: approaches::ByApproach,
    plans: plan::Plans,
    table: table::Measured,
    strangers: strangers::Measured,
    recorded: Option<Comparison>,
    engines: Vec<simulator::Engine>,
    /// None if the settings leave it out.
    growth: Option<(growth::Growth, Vec<generalization::Instances>)>,
}

/// Measures all stages.
fn measured(context: &Context, stages: &mut Stages<'_>) -> Result<Measured> {
    let folds = stages.stage("cross-validation", || cross_validation::measure(context))?;
    let noisy = stages.stage("noise", || noise::measure(context))?;
    // The large capture is needed by five stages, and by none if all were measured before.
    let large = OnceCell::new();
    let get_large = || get_or_try(&large, || limit::large(context));
    let limit = stages.stage("limit", || limit::measure(context, get_large()?))?;
    let sequences = stages.stage("sequential", || sequential::measure(context, get_large()?))?;
    let calibration = stages.stage("calibration", || calibration::measure(context, get_large()?))?;
    let promises = stages.stage("promises", || promises::measure(context, get_large()?))?;
    let members = stages.stage("cost", || cost::measure(context, get_large()?))?;
    drop(large);
    let approaches = stages.stage("approaches", || approaches::measure(context))?;
    let plans = stages.stage("plan", || plan::measure(context))?;
    let table = stages.stage("table", || table::measure(context))?;
    let strangers = stages.stage("strangers", || strangers::measure(context))?;
    let recorded = match context.settings.recorded {
        Some(_) => stages.stage("recorded", || recorded::measure(context))?,
        None => None,
    };
    let engines = stages.stage("simulator", || simulator::measure(context))?;
    let growth = if context.settings.growth {
        let growth = stages.stage("growth", || growth::measure(context))?;
        Some((growth, stages.stage("generalization", || generalization::measure(context))?))
    } else {
        None
    };
    Ok(Measured {
        folds,
        noisy,
        limit,
        sequences,
        calibration,
        promises,
        members,
        approaches,
        plans,
        table,
        strangers,
        recorded,
        engines,
        growth,
    })
}

/// The page's sections, in order.
fn sections(context: &Context, measured: &Measured, summary: &published::Summary) -> Result<Vec<Section>> {
    let mut first = Section::new("summary", "The paper's numbers compared with ours");
    let damaged = objects::to_repair(context);
    if !damaged.is_empty() {
        first.warning(format!(
            "the figures are of meshes that should be repaired first: {}. The section on the objects says why.",
            damaged.join(", ")
        ));
    }
    first.table(published::table(context, summary, &measured.noisy)?);
    first.table(published::large(context, summary, &measured.limit, &measured.sequences));
    let mut costs = cost::section(context, &measured.members)?;
    simulator::add(context, &measured.engines, &mut costs)?;
    let mut sections = vec![
        first,
        objects::section(context)?,
        cross_validation::section(context, &measured.folds)?,
        approaches::section(context, &measured.approaches)?,
        plan::section(context, &measured.plans)?,
        table::section(context, &measured.table),
        noise::section(context, &measured.noisy)?,
        limit::section(context, &measured.limit)?,
        sequential::section(context, &measured.sequences)?,
        calibration::section(context, &measured.calibration)?,
        promises::section(context, &measured.promises)?,
        strangers::section(context, &measured.strangers)?,
        costs,
    ];
    sections.extend(recorded::section(context, measured.recorded.as_ref())?);
    match &measured.growth {
        Some((growth, instances)) => {
            sections.extend([growth::section(context, growth)?, generalization::section(context, instances)?]);
        }
        None => sections.push(growth::left_out()),
    }
    Ok(sections)
}

/// Contents of `summary.json`.
#[derive(Serialize)]
struct Everything<'a> {
    /// Settings and objects that another report must have been made from for this one to replace it unasked.
    made_from: &'a serde_json::Value,
    settings: &'a Settings,
    version: &'a str,
    summary: &'a published::Summary,
    stages: &'a [(String, f64)],
}

/// Settings, version and times for the page's foot.
fn facts(settings: &Settings, stages: &[(String, f64)], seconds: f64) -> Vec<(String, String)> {
    let mut facts = vec![
        ("command".to_string(), settings.command.clone()),
        ("version".to_string(), env!("CARGO_PKG_VERSION").to_string()),
        ("seed".to_string(), settings.seed.to_string()),
        ("touches of each object".to_string(), count(settings.touches)),
        ("folds".to_string(), format!("{} of {}", settings.folds_used, settings.folds)),
        ("large capture, touches of each object".to_string(), count(settings.limit_touches)),
        ("threads".to_string(), rayon::current_num_threads().to_string()),
        ("this run".to_string(), format!("{seconds:.0} s")),
    ];
    facts.extend(stages.iter().map(|(name, seconds)| (name.clone(), format!("{seconds:.1} s"))));
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    use palpate::mesh::Mesh;
    use palpate::mesh::obj;
    use palpate::output::write_whole;
    use palpate::probe::approach::Probe;
    use palpate::touches::Origin;
    use std::collections::BTreeSet;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Three ellipsoids with hills, as OBJ files.
    fn meshes(directory: &Path) -> Vec<String> {
        for (name, sides) in [("ball", [1.0, 1.0, 1.0]), ("cigar", [1.0, 0.3, 0.3]), ("disc", [1.0, 1.0, 0.2])] {
            let mesh = Mesh::globe(10).stretched(sides);
            write_whole(&directory.join(format!("{name}.obj")), |out| obj::write(&mesh, out)).unwrap();
        }
        vec![directory.to_str().unwrap().to_string()]
    }

    const RESUME: Existing = Existing { resume: true, replace: false };

    fn tiny(sources: Vec<String>) -> Settings {
        Settings {
            touches: 400,
            folds_used: 2,
            paper_rounds: 3,
            levels: 4,
            many_groups: 20,
            noise_levels: 3,
            approaches: 900,
            limit_touches: 1_000,
            limit_rounds: 3,
            background_shapes: 10,
            other_shapes: 20,
            growth: true,
            growth_objects: vec![2, 3],
            growth_triangles: vec![100, 1_000],
            growth_approaches: 400,
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
        let written = report(&settings, &directory, Existing::default(), &()).unwrap();
        let html = std::fs::read_to_string(directory.join("index.html")).unwrap();
        let files: BTreeSet<String> =
            written.files.iter().map(|file| file.file_name().unwrap().to_string_lossy().into_owned()).collect();
        for figure in [
            "curvature",
            "accuracy",
            "accuracy-objects",
            "approaches-accuracy",
            "plan-errors",
            "confusion",
            "signal-to-noise",
            "noise",
            "noise-objects",
            "noise-confusion",
            "limit-curves",
            "sequential-trade",
            "sequential-objects",
            "reliability",
            "promises-kept",
            "cost-bytes",
            "cost-time",
            "cost-work",
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
        let figures = html.matches("<figure id=").count();
        assert_eq!(figures, 22, "a figure is not in the list above");
        let mut ids: Vec<&str> = html.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
        let count = ids.len();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), count, "two elements have the same id");
        for section in html.split("href=\"#").skip(1).filter_map(|rest| rest.split('"').next()) {
            assert!(ids.contains(&section), "{section}");
        }
        assert!(files.contains("published.csv") && files.contains("summary.json"));
        for file in written.files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "csv")) {
            let lines = std::fs::read_to_string(file).unwrap().lines().count();
            assert!(lines > 1, "{} has no row", file.display());
        }
        assert!(!html.contains("NaN"), "a number is none");
        assert_eq!(html.matches("<img ").count(), 3);

        // Stages are taken as they are, their times too; a cut-off stage is measured again, and nothing else.
        let again = report(&settings, &directory, RESUME, &()).unwrap();
        assert_eq!((&again.stages, &again.summary), (&written.stages, &written.summary));
        let kept = |name: &str| {
            let stages = std::fs::read_dir(directory.join(".stages")).unwrap().map(|entry| entry.unwrap().path());
            stages.into_iter().find(|path| path.file_name().unwrap().to_string_lossy().starts_with(name)).unwrap()
        };
        std::fs::remove_file(kept("growth-")).unwrap();
        let cut = report(&settings, &directory, RESUME, &()).unwrap();
        let differ = written.stages.iter().zip(&cut.stages).filter(|(a, b)| a != b).map(|(a, _)| a.0.as_str());
        assert_eq!(differ.collect::<Vec<_>>(), ["growth"]);
    }

    #[test]
    fn a_cancelled_report_resumes_where_it_was_and_one_on_own_meshes_leaves_out_built_in_ones() {
        /// Cancels as soon as the stage begins.
        struct CancelAt(&'static str, AtomicBool, Mutex<Vec<String>>);
        impl Progress for CancelAt {
            fn begin(&self, stage: &str, _: Option<u64>) {
                self.2.lock().unwrap().push(stage.into());
                if stage == self.0 {
                    self.1.store(true, Ordering::Relaxed);
                }
            }
            fn is_cancelled(&self) -> bool {
                self.1.load(Ordering::Relaxed)
            }
        }
        let place = tempfile::tempdir().unwrap();
        let probe = Probe { radius: 0.1, spacing: 1.25, speed: 20.0, tilt: 5.0, ..Probe::default() };
        let capture = Origin { probe, ..Origin::default() };
        let settings = Settings { growth: false, capture, ..tiny(meshes(&place.path().join("meshes"))) };
        let directory = place.path().join("report");
        let cancel = CancelAt("noise", AtomicBool::new(false), Mutex::default());
        let error = report(&settings, &directory, Existing::default(), &cancel).unwrap_err();
        assert!(matches!(error, palpate::Error::Cancelled), "{error}");
        assert!(!directory.join("index.html").exists());
        // What is long is named with its stage.
        let named = cancel.2.into_inner().unwrap();
        let is_of = |name: &&String, stage: &str| name.split(": ").next() == Some(stage);
        let stages = ["objects", "cross-validation", "noise"];
        assert!(named.iter().all(|name| stages.iter().any(|stage| is_of(&name, stage))), "{named:?}");
        assert!(named.iter().any(|name| name.starts_with("cross-validation: train")), "{named:?}");
        let kept = std::fs::read_dir(directory.join(".stages")).unwrap().map(|entry| entry.unwrap().path());
        let kept = kept.into_iter().find(|path| path.to_string_lossy().contains("cross-validation-")).unwrap();
        let kept: serde_json::Value = serde_json::from_slice(&std::fs::read(kept).unwrap()).unwrap();
        let resumed = report(&settings, &directory, RESUME, &()).unwrap();
        assert_eq!(resumed.stages[0], ("cross-validation".into(), kept["seconds"].as_f64().unwrap()));
        assert!(!resumed.stages.iter().any(|(name, _)| name == "growth" || name == "generalization"));
        let html = std::fs::read_to_string(directory.join("index.html")).unwrap();
        assert!(!html.contains("<figure id=\"generalization\">") && html.contains("leaves them out unless"));

        // Captions state this probe and these settings, and not the published or the usual ones.
        for said in [
            "fingers of radius 0.1 units are 1.25 units apart and move at 20 units per second, tilted by up to 5°",
            "Here it is 9 trees (300 as published: 100 boosting rounds instead of 3)",
            "by a linear Savitzky–Golay filter over 3 levels",
            "Of 10 folds, 2 were trained",
            "1,000 full touches of each object were captured",
            "20 groups per object and fold",
        ] {
            assert!(html.contains(said), "{said}");
        }
        for other in
            ["0.15", "1.5 apart", "10 units per second", "1000 trees", "eleven", "kilobytes", "a fork", "80 rounds"]
        {
            assert!(!html.contains(other), "{other}");
        }
    }

    #[test]
    fn a_report_does_not_replace_other_results_unasked() {
        let place = tempfile::tempdir().unwrap();
        let settings = tiny(meshes(&place.path().join("meshes")));
        let summary = place.path().join("summary.json");
        std::fs::write(&summary, json!({"made_from": {"job": "run"}}).to_string()).unwrap();
        let error = report(&settings, place.path(), Existing::default(), &()).unwrap_err();
        let problem = error.problem::<ReportProblem>();
        assert!(matches!(problem, Some(ReportProblem::OtherResults { .. })), "{error}");
        assert!(error.to_string().contains("summary.json: "), "{error}");
        assert_eq!(std::fs::read_to_string(summary).unwrap(), json!({"made_from": {"job": "run"}}).to_string());
    }

    #[test]
    fn one_object_is_refused_before_anything_is_written() {
        let place = tempfile::tempdir().unwrap();
        let sources = meshes(place.path());
        let one = vec![format!("{}/ball.obj", sources[0])];
        let directory = place.path().join("report");
        let error = report(&tiny(one), &directory, Existing::default(), &()).unwrap_err();
        assert!(error.to_string().contains("only one object"), "{error}");
        assert!(!directory.exists());
    }
}
