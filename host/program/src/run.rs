//! The main job: capture, train, compile, recognize, report.

mod shown;

pub use shown::text;

use palpate::calibrate::{self, Calibrated};
use palpate::capture;
use palpate::compile::{self, Compiled, CompiledModel};
use palpate::ensemble::{StatedProbe, train};
use palpate::error::{Kind, Result, problem};
use palpate::evaluate::parity::{self, Parity};
use palpate::evaluate::{self, Curve, Evaluation, Margins, PromiseCheck};
use palpate::mesh::Object;
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::progress::{self, Progress};
use palpate::touches::folds::{self, Split};
use palpate::touches::{Dataset, Listing, ObjectTouches, Origin};
use palpate::with;
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_report::play::{self, Contender};
use palpate_report::results;
use palpate_report::run_page::{RunResults, run_page};
use palpate_report::statistics::{LEAST_GROUPS, distinct_groups, largest_group};
use palpate_shared::format::Counted;
use serde::Serialize;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Numbers of touches after which accuracy is reported.
const AT: [usize; 6] = [1, 5, 10, 20, 30, 60];
/// Numbers of these that the table shows.
const TABLE_AT: [usize; 2] = [10, 30];
/// Numbers of approaches after which accuracy is reported.
const AT_APPROACHES: [usize; 3] = [10, 20, 60];
/// The most touches that accuracy is followed to.
const MOST: usize = 200;
/// Random sequences whose verdicts are compared with the full model's.
const PARITY_SEQUENCES: usize = 10_000;
/// The width and height of a picture in the page, in pixels.
const PICTURE: u32 = 160;

/// Files in the output directory besides `data/`, `approaches/` and `summary.json`.
const FILES: [&str; 8] =
    ["paper.json", "paper.palpate", "full.json", "full.palpate", "ensemble.json", "model.palpate", "report.html", PLAY];

/// The page on which the objects can be touched, of [`FILES`].
const PLAY: &str = "play.html";

/// Settings of a run.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Sources of the objects; the results state them.
    pub sources: Vec<String>,
    /// True to replace another run's or a report's results.
    pub replace: bool,
    /// Settings of the capture.
    pub capture: capture::Settings,
    /// Number of approaches of each object captured besides, each kept whatever it touched: the compact method is
    /// trained on them, and all methods are tested on them.
    pub approaches: u64,
    /// Noise that a real sensor adds: ours is trained for it, the paper's method is not, and both are tested with it.
    pub noise: Noise,
    /// The share of touches that is kept from training, to test on.
    pub test_share: f64,
    /// Groups, and also sequences, drawn for each object.
    pub groups: usize,
    /// The error rate that models promise.
    pub error_rate: f64,
    /// The most sequences, of all objects together, that a promise rests on.
    pub sequences: usize,
    /// The command line that remakes the result, as the report shows it.
    pub command: String,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            sources: vec!["builtin".into()],
            replace: false,
            capture: capture::Settings::default(),
            approaches: 63_000,
            noise: Noise::switch(),
            test_share: 0.1,
            groups: 1000,
            error_rate: 0.01,
            sequences: 4_000,
            command: "palpate run".into(),
        }
    }
}

/// Results of a run; `summary.json`. Shares are between 0 and 1, times in seconds.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Settings and objects that it was made from: another run with the same may replace it unasked.
    pub made_from: serde_json::Value,
    /// The program's version.
    pub tool_version: &'static str,
    /// The command that remakes it.
    pub command: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Noise added to the touches that ours was trained on, and to all that are tested on.
    pub noise: Noise,
    /// The capture of full touches.
    pub capture: capture::Summary,
    /// The capture of approaches.
    pub approach_capture: capture::Summary,
    /// Full touches trained on and tested on, of all objects together.
    pub touches: Touches,
    /// Approaches trained on and tested on, of all objects together.
    pub approaches: Touches,
    /// The published method: contact times of full touches.
    pub paper: Method,
    /// The compact one on full touches: it waits for them.
    pub full: Method,
    /// The compact one on every approach with a contact: the model to use.
    pub ours: Method,
    /// One sequence of test approaches per object, as the model to use recognizes it.
    pub recognized: Vec<Recognition>,
    /// Time that each stage took, in order: captures, then of each method training, compiling, its promise (with the
    /// capture that it rests on), testing, and the comparison with the full model.
    pub stages: Vec<Stage>,
    /// The whole run.
    pub seconds: f64,
}

/// Time of a stage of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Stage {
    /// Description of the stage.
    pub name: String,
    /// Wall-clock time.
    pub seconds: f64,
}

/// Times stages: each ends where the next is noted.
struct Stages {
    last: Instant,
    stages: Vec<Stage>,
}

impl Stages {
    fn new() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    /// Ends a stage, which began when the last one ended, and returns its time in seconds.
    fn end(&mut self, name: impl Into<String>) -> f64 {
        let seconds = self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
        self.stages.push(Stage { name: name.into(), seconds });
        seconds
    }
}

/// Numbers of touches by use.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Touches {
    /// Trained on.
    pub train: usize,
    /// Tested on; none of them was trained on.
    pub test: usize,
}

/// One method: what it costs and how good it is. All figures are the compiled model's, by the onboard crate.
#[derive(Clone, Debug, Serialize)]
pub struct Method {
    /// Trees of the ensemble.
    pub trees: usize,
    /// Training.
    pub train_seconds: f64,
    /// Bytes of the compiled model.
    pub model_bytes: usize,
    /// Layout of the compiled model.
    pub layout: String,
    /// Type that leaves are stored as.
    pub leaf: String,
    /// Accuracies, and the recognizer that stops by itself.
    #[serde(flatten)]
    pub evaluation: Evaluation,
    /// The least fixed number of touches from which on the error is at most the error rate; null if there is none up to
    /// `followed_to`.
    pub fixed_touches: Option<usize>,
    /// The most touches that accuracy was followed to: as many as still make enough distinct groups of test touches.
    pub followed_to: usize,
    /// The compiled model compared with the ensemble, on the test touches.
    pub parity: Parity,
    /// Check of its promise on the test approaches; null if it promises nothing.
    pub promise_of_approaches: Option<PromiseCheck>,
    /// Calibration of its thresholds, on touches captured for that; null if there is none.
    pub calibration: Option<Calibrated>,
    /// Reason why there is none.
    pub uncalibrated: Option<String>,
}

/// A sequence of approaches to one object, pushed until the verdict.
#[derive(Clone, Debug, Serialize)]
pub struct Recognition {
    /// The object that was touched.
    pub touched: String,
    /// The object that was recognized; null if the recognizer stayed undecided.
    pub recognized: Option<String>,
    /// Touches used that were evidence.
    pub touches: u32,
    /// Approaches used.
    pub approaches: usize,
    /// Posterior of the object with the most evidence.
    pub posterior: f64,
}

/// Runs all of it on `objects` and writes into `out`: `data/` (full touches), `approaches/`, `paper.json`,
/// `paper.palpate`, `full.json`, `full.palpate`, `ensemble.json`, `model.palpate`, `report.html` and, last,
/// `summary.json`.
///
/// # Errors
/// Results in `out` that were made from something else, unless
/// [`Settings::replace`]; [`Kind::Cancelled`]; and what capture, training, compiling,
/// evaluating or writing return.
pub fn run(objects: &[Object], settings: &Settings, out: &Path, progress: &dyn Progress) -> Result<Summary> {
    let began = Instant::now();
    let made_from = made_from(objects, settings)?;
    if !settings.replace {
        results::refuse_others(out, &made_from, &FILES, Some("data/dataset.json"))?;
    }
    let mut stages = Stages::new();
    let data = out.join("data");
    // A run replaces what an earlier run on the same objects left, finished or not, and no other touches.
    let names: BTreeSet<&str> = objects.iter().map(|object| object.name.as_str()).collect();
    let is_same = |listing: &Listing| listing.objects.iter().map(|entry| entry.name.as_str()).eq(names.iter().copied());
    let force = settings.capture.force || settings.replace || Listing::read(&data)?.as_ref().is_some_and(is_same);
    let captured = capture::capture(objects, &with!(settings.capture.clone(), force), &data, progress)?;
    let seed = settings.capture.origin.seed;
    stages.end("capture of full touches");
    let mut split = folds::split(&Dataset::read(&data)?, settings.test_share, seed)?;
    // Of another seed, so that no test approach is one of the full touches that the others were trained on.
    let origin = &settings.capture.origin;
    let origin =
        Origin { touches: settings.approaches, approaches: true, seed: seed.wrapping_add(1), ..origin.clone() };
    let directory = out.join("approaches");
    let force = settings.capture.force || settings.replace || Listing::read(&directory)?.as_ref().is_some_and(is_same);
    let approach_settings = with!(settings.capture.clone(), origin, force);
    let approached = capture::capture(objects, &approach_settings, &directory, progress)?;
    stages.end("capture of approaches");
    let mut approaches = folds::split(&Dataset::read(&directory)?, settings.test_share, seed)?;
    // Another seed than that of the training.
    evaluate::add_noise(&mut split.test, &settings.noise, seed.wrapping_add(1))?;
    evaluate::add_noise(&mut approaches.test, &settings.noise, seed.wrapping_add(1))?;
    let probe = Some(StatedProbe::from(&settings.capture.origin));
    let kept = RefCell::new(calibrate::Fresh::default());
    let job = Job { settings, objects, approaches: &approaches.test, kept: &kept, out, progress };
    stages.end("reading and dividing touches");
    let mut method = |name, files, preset, split| Trial::new(name, files, preset, split, job, &mut stages);
    let compact = with!(train::Settings::compact(), seed, probe, noise = settings.noise);
    let full = with!(compact.clone(), counted = Some(Counted::Full));
    let contacts = with!(compact, counted = Some(Counted::Contacts));
    let paper = method(METHODS[0], "paper", with!(train::Settings::paper(), seed, probe), &split)?;
    let full = method(METHODS[1], "full", full, &split)?;
    let ours = method(METHODS[2], "ensemble", contacts, &approaches)?;
    let model = compile::open(&ours.compiled.bytes)?;
    progress.begin("writing the page to play on", None);
    output::write_bytes(&out.join(PLAY), play_page(objects, [&paper, &full, &ours], settings)?.as_bytes())?;
    let summary = Summary {
        made_from,
        tool_version: env!("CARGO_PKG_VERSION"),
        command: settings.command.clone(),
        seed,
        noise: settings.noise,
        capture: captured,
        approach_capture: approached,
        touches: Touches { train: split.train.len(), test: split.test.len() },
        approaches: Touches { train: approaches.train.len(), test: approaches.test.len() },
        recognized: approaches.test.objects.iter().map(|object| recognize(&model, object)).collect::<Result<_>>()?,
        paper: paper.method.clone(),
        full: full.method.clone(),
        ours: ours.method.clone(),
        stages: stages.stages,
        seconds: began.elapsed().as_secs_f64(),
    };
    let page = run_page(&RunResults {
        command: settings.command.clone(),
        play: PLAY.into(),
        pictures: shown::pictures(objects, &summary.capture),
        methods: METHODS
            .into_iter()
            .zip([&paper, &full, &ours])
            .map(|(name, trial)| shown::shown(name, trial))
            .collect(),
        table: shown::table(&summary),
        note: shown::note(&summary),
        facts: shown::facts(&summary),
    })?;
    page.write(&out.join("report.html"))?;
    output::write_json(&out.join("summary.json"), &summary)?;
    Ok(summary)
}

/// The names of the methods in the table, on both pages and in messages.
const METHODS: [&str; 3] = ["paper, full touches", "ours, full touches", "ours, every contact"];

/// Everything that the results depend on.
fn made_from(objects: &[Object], settings: &Settings) -> Result<serde_json::Value> {
    Ok(serde_json::json!({
        "job": "run",
        "sources": settings.sources,
        "objects": objects.iter().map(|object| &object.name).collect::<Vec<_>>(),
        "capture": results::json("capture's settings", &settings.capture.origin)?,
        "approaches": settings.approaches,
        "noise": results::json("the noise", &settings.noise)?,
        "test_share": settings.test_share,
        "groups": settings.groups,
        "error_rate": settings.error_rate,
        "sequences": settings.sequences,
    }))
}

/// Parts that all methods share: also the approaches that they are tested on besides their own kind of touches.
#[derive(Clone, Copy)]
struct Job<'d> {
    settings: &'d Settings,
    objects: &'d [Object],
    approaches: &'d Dataset,
    /// Touches on which an earlier method was calibrated.
    kept: &'d RefCell<calibrate::Fresh>,
    out: &'d Path,
    progress: &'d dyn Progress,
}

/// A method, trained, compiled and tested.
struct Trial {
    compiled: Compiled,
    /// The fewest test touches that an object has.
    fewest: usize,
    curve: Curve,
    method: Method,
}

impl Trial {
    fn new(
        name: &str,
        stem: &str,
        preset: train::Settings,
        split: &Split,
        job: Job<'_>,
        stages: &mut Stages,
    ) -> Result<Self> {
        let Job { settings, approaches, out, progress, .. } = job;
        let ensemble = train::train(&split.train, &preset, progress)?;
        let train_seconds = stages.end(format!("{name}: training"));
        progress::check(progress)?;
        progress.begin(&format!("compiling and testing {name}"), None);
        let compile = with!(compile::usual(&ensemble), error_rate = settings.error_rate);
        let mut compiled = compile::compile(&ensemble, &compile)?;
        stages.end(format!("{name}: compiling"));
        let calibration = calibrated(&compiled.bytes, split, &job)?;
        if let Ok(calibrated) = &calibration {
            compiled.bytes.clone_from(&calibrated.model);
        }
        stages.end(format!("{name}: promise"));
        ensemble.save(out.join(stem).with_extension("json"))?;
        output::write_bytes(&model_path(out, stem), &compiled.bytes)?;
        let model = compile::open(&compiled.bytes)?;
        let margins = Margins::new(&model, &split.test)?;
        let fewest = margins.fewest_touches();
        let seed = settings.capture.origin.seed;
        let evaluated = |margins: &Margins<'_>, at: Vec<usize>, at_approaches: Vec<usize>| {
            let (groups, noise) = (settings.groups, settings.noise);
            let own = evaluate::Settings::default();
            evaluate::evaluate(margins, &with!(own, at, at_approaches, groups, seed, noise))
        };
        let at = AT.into_iter().filter(|&at| distinct_groups(fewest, at) >= LEAST_GROUPS);
        let mut evaluation = evaluated(&margins, at.collect(), Vec::new())?;
        let approached = Margins::new(&model, approaches)?;
        let at = AT_APPROACHES.into_iter().filter(|&at| at <= approached.fewest_approaches());
        let by_approach = evaluated(&approached, Vec::new(), at.collect())?;
        evaluation.approaches = by_approach.approaches;
        let curve = margins.curve(MOST.min(largest_group(fewest)), settings.groups, seed)?;
        stages.end(format!("{name}: testing"));
        let parity = parity::parity(&ensemble, &model, &split.test, PARITY_SEQUENCES, seed, progress)?;
        stages.end(format!("{name}: comparison with the full model"));
        let method = Method {
            trees: ensemble.trees.len(),
            train_seconds,
            model_bytes: compiled.bytes.len(),
            layout: compiled.layout.name().into(),
            leaf: compile.leaf.name().into(),
            fixed_touches: curve.touches_to_error(settings.error_rate),
            followed_to: curve.most(),
            evaluation,
            promise_of_approaches: by_approach.promise,
            parity,
            uncalibrated: calibration.as_ref().err().cloned(),
            calibration: calibration.ok(),
        };
        Ok(Self { compiled, fewest, curve, method })
    }
}

/// The model with thresholds that keep the error rate, found on touches that are captured for it; or why there are none.
fn calibrated(bytes: &[u8], split: &Split, job: &Job<'_>) -> Result<Result<Calibrated, String>> {
    let settings = job.settings;
    let (origin, approaches) = (&settings.capture.origin, split.test.holds_approaches());
    // Neither training nor tests use these seeds.
    let seed = origin.seed.wrapping_add(if approaches { 3 } else { 2 });
    let origin = Origin { approaches, seed, ..origin.clone() };
    let terms = with!(
        calibrate::Settings::default(),
        rate = settings.error_rate,
        sequences = settings.sequences,
        noise = settings.noise,
        seed
    );
    let kept = &mut *job.kept.borrow_mut();
    match calibrate::calibrate_fresh(&compile::open(bytes)?, job.objects, &origin, &terms, kept, job.progress) {
        Err(error) if matches!(error.kind(), Kind::NotKept | Kind::TooFew) => Ok(Err(error.what().into())),
        Err(error) => Err(error),
        Ok(calibrated) => Ok(Ok(calibrated)),
    }
}

fn model_path(out: &Path, stem: &str) -> PathBuf {
    out.join(if stem == "ensemble" { "model" } else { stem }).with_extension("palpate")
}

/// Pushes one object's test touches, of one instance, until the recognizer has its verdict.
fn recognize(model: &Model<'_>, touched: &ObjectTouches) -> Result<Recognition> {
    let mut recognizer = Recognizer::<256>::new(model, Stopping::from_model(model))
        .map_err(|_| problem!("a model of {} objects", model.object_count()).fix("Use at most 256 objects."))?;
    let mut approaches = 0;
    let mut push = |touch| {
        approaches += 1;
        recognizer.push(touch).ok().filter(|verdict| *verdict != Verdict::Undecided)
    };
    let mut first = touched.pools().iter().take(1).flat_map(|pool| touched.of_pool(pool));
    let verdict = first.find_map(&mut push);
    let best = recognizer.best();
    let recognized = matches!(verdict, Some(Verdict::Recognized { .. })).then(|| model.object_name(best).into());
    let posterior = recognizer.posterior(best).to_f64();
    Ok(Recognition { touched: touched.name.clone(), recognized, touches: recognizer.touches(), approaches, posterior })
}

/// The page on which the objects can be touched, with all models.
fn play_page(objects: &[Object], trials: [&Trial; 3], settings: &Settings) -> Result<String> {
    let contender = |(name, trial): (&str, &Trial)| {
        let model = CompiledModel::from_bytes(trial.compiled.bytes.clone())?;
        Ok(Contender { name: name.into(), model })
    };
    let contenders = METHODS.into_iter().zip(trials).map(contender).collect::<Result<Vec<_>>>()?;
    let origin = settings.capture.origin.clone();
    play::page(
        objects,
        &contenders,
        &play::Settings { origin, noise: settings.noise, command: settings.command.clone() },
    )
}

#[cfg(test)]
mod tests {
    mod several_meshes;

    use super::*;
    use palpate::error::Kind;
    use palpate::mesh::Mesh;

    fn objects() -> Vec<Object> {
        [("ball", [1.0, 1.0, 1.0]), ("cigar", [1.0, 0.3, 0.3]), ("disc", [1.0, 1.0, 0.2])]
            .map(|(name, sides)| Object::new(name, Mesh::globe(10).stretched(sides)))
            .to_vec()
    }

    fn settings(touches: u64) -> Settings {
        Settings {
            sources: vec!["meshes".into()],
            capture: palpate::touches::Origin { touches, ..Default::default() }.into(),
            approaches: 3 * touches,
            groups: 50,
            sequences: 600,
            command: "palpate run 'my meshes'".into(),
            ..Settings::default()
        }
    }

    fn row<'a>(text: &'a str, name: &str) -> Vec<&'a str> {
        let line =
            text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_else(|| panic!("{name}\n{text}"));
        line.trim_start()
            .strip_prefix(name)
            .unwrap_or_default()
            .split("  ")
            .map(str::trim)
            .filter(|c| !c.is_empty())
            .collect()
    }

    #[test]
    fn a_run_with_few_touches_shows_what_is_undecided_and_no_accuracy_over_a_single_possible_group() {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out");
        // A tenth, 30 touches of each object, are tested on: one group of 30 can be drawn.
        let summary = run(&objects(), &settings(300), &out, &()).unwrap();
        assert_eq!((summary.touches.train, summary.touches.test), (810, 90));
        assert_eq!((summary.approaches.train, summary.approaches.test), (2_430, 270));
        let evaluation = &summary.full.evaluation;
        assert_eq!(evaluation.accuracy.keys().copied().collect::<Vec<_>>(), [5, 10, 20]);
        assert_eq!(summary.full.followed_to, 28);
        let text = text(&summary, &out);
        assert_eq!(row(&text, "accuracy after 30 touches")[..2], ["–", "–"]);
        assert_eq!(row(&text, "accuracy after 10 touches").len(), 3);
        let approaches = row(&text, "approaches to a 1 % error rate, stopping when sure");
        assert_eq!(approaches.len(), 3, "{text}");
        assert!(summary.recognized.iter().all(|recognition| recognition.approaches >= recognition.touches as usize));
        let undecided = evaluation.approaches.as_ref().unwrap().sequential.undecided;
        assert_eq!(row(&text, "undecided when touches ran out")[1], format!("{:.2} %", 100.0 * undecided));
        assert!(text.contains("fewer than 300 distinct groups"), "{text}");

        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        assert!(page.contains("undecided when touches ran out") && page.contains("fewer than 300 distinct groups"));
        assert!(page.contains("palpate run &#39;my meshes&#39;") || page.contains("palpate run 'my meshes'"));
        let written: serde_json::Value =
            serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
        assert_eq!(written["full"]["sequential"]["undecided"], serde_json::json!(evaluation.sequential.undecided));
        assert_eq!(written["full"]["approaches"]["sequential"]["undecided"], serde_json::json!(undecided));
        // Every stage is timed, and the rest takes next to nothing.
        let stages = written["stages"].as_array().unwrap();
        assert_eq!(stages.len(), 3 + 3 * 5, "{stages:#?}");
        assert!(stages.iter().all(|stage| stage["seconds"].as_f64().unwrap() >= 0.0));
        for file in FILES {
            assert!(out.join(file).is_file(), "{file}");
        }

        // The same again may replace them, and gives the same models; anything else may not, and changes nothing.
        let model = std::fs::read(out.join("model.palpate")).unwrap();
        let error = run(&objects()[..2], &settings(300), &out, &()).unwrap_err();
        assert!(error.to_string().contains("the directory holds results of another run"), "{error}");
        let fewer = Settings { approaches: 900, ..settings(200) };
        let error = run(&objects(), &fewer, &out, &()).unwrap_err().to_string();
        assert!(error.contains("summary.json: ") && error.contains("touches was 300, and is 200 now"), "{error}");
        assert_eq!(std::fs::read(out.join("model.palpate")).unwrap(), model);
        assert!(out.join("data/ball.txt").is_file());
        run(&objects(), &settings(300), &out, &()).unwrap();
        assert_eq!(std::fs::read(out.join("model.palpate")).unwrap(), model);
    }

    #[test]
    fn a_run_does_not_replace_a_model_that_somebody_put_there() {
        let place = tempfile::tempdir().unwrap();
        std::fs::write(place.path().join("model.palpate"), "mine").unwrap();
        let error = run(&objects(), &settings(100), place.path(), &()).unwrap_err();
        assert!(error.to_string().contains("model.palpate: "), "{error}");
        assert_eq!(std::fs::read(place.path().join("model.palpate")).unwrap(), b"mine");
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_cancelled_run_stops_and_leaves_no_summary() {
        struct Cancelled;
        impl Progress for Cancelled {
            fn is_cancelled(&self) -> bool {
                true
            }
        }
        let place = tempfile::tempdir().unwrap();
        let error = run(&objects(), &settings(100), place.path(), &Cancelled).unwrap_err();
        assert!(error.is(&Kind::Cancelled), "{error}");
        assert!(!place.path().join("summary.json").exists());
    }
}
