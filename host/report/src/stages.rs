//! The whole report: measures every stage, then writes one page.

use super::context::{Context, get_or_try};
use super::measured::Measured;
use super::settings::{Part, Settings};
use super::{cost, cross_validation, limit, noise, objects, promises, published, results};
use crate::page::document::{Figure, Page, Section};
use palpate::error::{Result, problem};
use palpate::mesh::Object;
use palpate::output::write_json;
use palpate::progress::{self, Progress};
use palpate::results::Results;
use palpate::row;
use palpate::wording::count;
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
    /// Seconds of the stages.
    pub stages: Vec<(String, f64)>,
    /// A sentence or two about the result.
    pub sentence: String,
    /// The contents of `summary.json`.
    pub summary: serde_json::Value,
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

/// Stages that are measured.
struct Stages<'a> {
    parts: &'a [Part],
    progress: &'a Named<'a>,
    /// Names and seconds of those that were.
    seconds: Vec<(String, f64)>,
}

impl Stages<'_> {
    /// The result of the part, if it is to be measured; progress is told its name before it begins.
    fn part<T>(&mut self, part: Part, measure: impl FnOnce() -> Result<T>) -> Result<Option<T>> {
        if !self.parts.contains(&part) {
            return Ok(None);
        }
        progress::check(self.progress)?;
        self.progress.enter(part.name());
        let began = Instant::now();
        let result = measure()?;
        self.seconds.push((part.name().to_owned(), began.elapsed().as_secs_f64()));
        Ok(Some(result))
    }
}

/// Measures the chosen parts on the objects that `objects` gives, sorted by name, and writes `directory/index.html`, the
/// figures' and tables' files and `summary.json`. Another report's or run's results are replaced only if `replace` is true.
///
/// # Errors
/// Errors of `objects`, of measuring and of writing; fewer than two objects; a directory that holds other results, unless
/// `replace`;
/// [`Kind::Cancelled`](palpate::error::Kind::Cancelled).
pub fn report(
    objects: &dyn Fn() -> Result<Vec<Object>>,
    settings: &Settings,
    directory: &Path,
    replace: bool,
    progress: &dyn Progress,
) -> Result<Report> {
    // The command makes no difference to the results.
    let made_from = json!({ "job": "report", "settings": Settings { command: String::new(), ..settings.clone() } });
    if !replace {
        results::refuse_others(directory, &made_from, &["index.html"], None)?;
    }
    let objects = objects()?;
    if objects.len() < 2 {
        let one = problem!("there is only one object, and nothing to distinguish it from");
        return Err(one.fix("Give at least two objects."));
    }
    let began = Instant::now();
    let progress = &Named { progress, stage: Mutex::new("objects".into()) };
    let context = Context::new(settings, &objects, progress)?;
    let mut stages = Stages { parts: &settings.parts, progress, seconds: Vec::new() };
    let measured = measured(&context, &mut stages)?;
    let stages = stages.seconds;
    progress.enter("drawing");

    let sections = sections(&context, &measured)?;
    let sentence = published::sentence(&context, &measured);
    let page = Page {
        title: "Recognizing objects by touch".into(),
        summary: sentence.clone(),
        command: settings.command.clone(),
        sections,
        facts: facts(settings, &stages, began.elapsed().as_secs_f64()),
        files: true,
    };
    let summary = json!({
        "made_from": made_from,
        "settings": settings,
        "version": env!("CARGO_PKG_VERSION"),
        "tables": page.tables(),
        "stages": stages,
    });
    let path = directory.join("summary.json");
    write_json(&path, &summary)?;
    let mut files = vec![path];
    files.extend(page.write(&directory.join("index.html"))?);
    Ok(Report { files, stages, sentence, summary })
}

/// Measures the chosen parts.
fn measured(context: &Context, stages: &mut Stages<'_>) -> Result<Measured> {
    let folds = stages.part(Part::Accuracy, || cross_validation::measure(context))?;
    let noisy = stages.part(Part::Noise, || noise::measure(context))?;
    // The large capture is needed by three stages.
    let large = OnceCell::new();
    let get_large = || get_or_try(&large, || limit::large(context));
    let limit = stages.part(Part::Limit, || limit::measure(context, get_large()?))?;
    let promises = stages.part(Part::Promises, || promises::measure(context, get_large()?))?;
    let members = stages.part(Part::Cost, || cost::measure(context, get_large()?))?;
    Ok(Measured { folds, noisy, limit, promises, members })
}

/// The page's sections, in order.
fn sections(context: &Context, measured: &Measured) -> Result<Vec<Section>> {
    let mut first = Section::new("summary", "The paper's numbers compared with ours");
    let damaged = objects::to_repair(context);
    if !damaged.is_empty() {
        let chosen = context.settings.parts.contains(&Part::Objects);
        let why = if chosen { " The section on the objects says why." } else { "" };
        first.warning(format!("the figures are of meshes that should be repaired first: {}.{why}", damaged.join(", ")));
    }
    let tables =
        [published::table(context, measured)?, published::large(context, measured), shortened(context.settings)];
    for table in tables.into_iter().flatten() {
        first.figure(table);
    }
    let mut sections = vec![first];
    sections.retain(|section| !section.blocks.is_empty());
    if context.settings.parts.contains(&Part::Objects) {
        sections.push(objects::section(context)?);
    }
    fn shown<T>(of: &Option<T>, section: impl FnOnce(&T) -> Result<Section>) -> Result<Option<Section>> {
        of.as_ref().map(section).transpose()
    }
    let all = [
        shown(&measured.folds, |of| cross_validation::section(context, of))?,
        shown(&measured.noisy, |of| noise::section(context, of))?,
        shown(&measured.limit, |of| limit::section(context, of))?,
        shown(&measured.promises, promises::section)?,
        shown(&measured.members, |of| cost::section(of))?,
    ];
    sections.extend(all.into_iter().flatten());
    Ok(sections)
}

/// Numbers that a quick report shortens; none of a full one.
fn shortened(settings: &Settings) -> Option<Figure> {
    let numbers = settings.shortened();
    let mut data = Results::new(["number", "here", "in a full report"]);
    for &(name, here, full) in &numbers {
        data.push(row![name, here, full]);
    }
    let caption = "All other numbers are those of a full report.";
    (!numbers.is_empty()).then(|| Figure::new("shortened", "What --quick shortens", caption, data))
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
    use palpate::with;

    use palpate::mesh::{Mesh, obj, source};
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

    fn report(settings: &Settings, directory: &Path, replace: bool, progress: &dyn Progress) -> Result<Report> {
        super::report(&|| source::objects(&settings.sources), settings, directory, replace, progress)
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
            limit_groups: 100,
            promise_sequences: 1_000,
            cost_groups: 100,
            ..Settings::quick(sources, 1)
        }
    }

    /// Asserts that a page of all parts has every figure, and that its files are there.
    fn assert_has_every_figure_and_its_files(html: &str, written: &Report) {
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
            "promises-kept",
            "cost-bytes",
            "cost-time",
            "cost-work",
        ] {
            assert!(html.contains(&format!("<figure id=\"{figure}\">")), "{figure}");
            for extension in ["svg", "csv"] {
                assert!(files.contains(&format!("{figure}.{extension}")), "{figure}.{extension}");
            }
        }
        let figures = html.matches("<figure id=").count();
        assert_eq!(figures, 13, "a figure is not in the list above");
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
        // Pictures are in base64, where it may be any three letters.
        let is_number = |at: usize| !html[..at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '+' || c == '/');
        assert!(!html.match_indices("NaN").any(|(at, _)| is_number(at)), "a number is none");
        assert_eq!(html.matches("<img ").count(), 3);
    }

    /// Asserts that captions state the probe and the settings of the report, and not the published or the usual ones.
    fn assert_states_its_probe_and_its_settings(html: &str) {
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
        for other in [
            "0.15 units",
            "1.5 apart",
            "10 units per second",
            "1000 trees",
            "eleven",
            "kilobytes",
            "a fork",
            "80 rounds",
        ] {
            assert!(!html.contains(other), "{other}");
        }
    }

    #[test]
    fn a_cancelled_report_writes_nothing_and_a_whole_one_has_every_figure() {
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
        let probe = with!(Probe::default(), radius = 0.1, spacing = 1.25, speed = 20.0, tilt = 5.0);
        let capture = Origin { probe, ..Origin::default() };
        let settings = Settings { capture, ..tiny(meshes(&place.path().join("meshes"))) };
        let directory = place.path().join("report");
        let cancel = CancelAt("noise", AtomicBool::new(false), Mutex::default());
        let error = report(&settings, &directory, false, &cancel).unwrap_err();
        assert!(error.is(&palpate::error::Kind::Cancelled), "{error}");
        assert!(!directory.exists());
        // What is long is named with its stage.
        let named = cancel.2.into_inner().unwrap();
        let is_of = |name: &&String, stage: &str| name.split(": ").next() == Some(stage);
        let stages = ["objects", "accuracy", "noise"];
        assert!(named.iter().all(|name| stages.iter().any(|stage| is_of(&name, stage))), "{named:?}");
        assert!(named.iter().any(|name| name.starts_with("accuracy: train")), "{named:?}");
        let written = report(&settings, &directory, false, &()).unwrap();
        let html = std::fs::read_to_string(directory.join("index.html")).unwrap();
        assert_has_every_figure_and_its_files(&html, &written);
        assert_states_its_probe_and_its_settings(&html);
    }

    #[test]
    fn a_report_measures_the_chosen_parts_alone() {
        let place = tempfile::tempdir().unwrap();
        let directory = place.path().join("report");
        let with = |parts: &[Part]| Settings { parts: parts.into(), ..tiny(meshes(&place.path().join("meshes"))) };
        let read = || std::fs::read_to_string(directory.join("index.html")).unwrap();
        let names = |report: &Report| report.stages.iter().map(|stage| stage.0.clone()).collect::<Vec<_>>();
        let noise = report(&with(&[Part::Noise]), &directory, false, &()).unwrap();
        assert_eq!(names(&noise), ["noise"]);
        let html = read();
        assert!(html.contains("<figure id=\"noise\">") && html.contains("noise levels"));
        for other in ["curvature", "accuracy", "limit-curves", "cost-bytes"] {
            assert!(!html.contains(&format!("<figure id=\"{other}\">")), "{other}");
        }
        assert!(!html.contains("After ten touches") && !html.contains("touches until sure"), "{}", noise.sentence);
        let tables = &noise.summary["tables"];
        let accuracy = &tables["published"][0];
        assert!(
            accuracy["measure"] == "accuracy after 10, noise of 5 ms" && accuracy["ours here"].is_array(),
            "{accuracy}"
        );
        assert!(tables.get("limit").is_none());

        // Its sections would be lost, so it is asked for.
        let both = with(&[Part::Objects, Part::Limit]);
        let error = report(&both, &directory, false, &()).unwrap_err();
        assert!(error.to_string().contains("settings: parts was"), "{error}");
        let both = report(&both, &directory, true, &()).unwrap();
        assert_eq!(names(&both), ["limit"]);
        let html = read();
        assert!(html.contains("<figure id=\"limit-curves\">") && html.contains("<figure id=\"curvature\">"));
        assert!(both.summary["tables"]["published-large"][0]["limit"].is_number());
    }

    #[test]
    fn a_report_does_not_replace_other_results_unasked() {
        let place = tempfile::tempdir().unwrap();
        let settings = tiny(meshes(&place.path().join("meshes")));
        let summary = place.path().join("summary.json");
        std::fs::write(&summary, json!({"made_from": {"job": "run"}}).to_string()).unwrap();
        let error = report(&settings, place.path(), false, &()).unwrap_err();
        assert!(error.to_string().contains("summary.json: the directory holds results of another run"), "{error}");
        assert_eq!(std::fs::read_to_string(summary).unwrap(), json!({"made_from": {"job": "run"}}).to_string());
    }

    #[test]
    fn one_object_is_refused_before_anything_is_written() {
        let place = tempfile::tempdir().unwrap();
        let sources = meshes(place.path());
        let one = vec![format!("{}/ball.obj", sources[0])];
        let directory = place.path().join("report");
        let error = report(&tiny(one), &directory, false, &()).unwrap_err();
        assert!(error.to_string().contains("only one object"), "{error}");
        assert!(!directory.exists());
    }
}
