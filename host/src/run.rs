//! The main job: capture, train, compile, recognize, report.

use crate::calibrate::{self, Calibrated};
use crate::capture;
use crate::compile::{self, Compiled, CompiledModel};
use crate::ensemble::{StatedProbe, train};
use crate::error::{Problem, ReportProblem, Result};
use crate::evaluate::parity::{self, Parity};
use crate::evaluate::{self, Approaches, Candidate, Curve, Evaluation, Margins, SequentialSettings};
use crate::mesh::Object;
use crate::output;
use crate::page::document::Picture;
use crate::page::render;
use crate::page::table::{Cell, Records};
use crate::progress::{self, Progress};
use crate::report::play::{self, Contender, Expected};
use crate::report::results;
use crate::report::run_page::{RunMethod, RunResults, run_page};
use crate::report::statistics::{LEAST_GROUPS, distinct_groups, largest_group};
use crate::touches::folds::{self, Split};
use crate::touches::noise::Noise;
use crate::touches::{Dataset, Listing, Origin};
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::format::Counted;
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Numbers of touches after which accuracy is reported.
const AT: [usize; 6] = [1, 5, 10, 20, 30, 60];
/// Those of them that the table shows.
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

/// How to run.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Where the objects come from; the results state it.
    pub sources: Vec<String>,
    /// Whether to replace another run's or a report's results.
    pub replace: bool,
    /// How objects are touched.
    pub capture: capture::Settings,
    /// How many approaches of each object are captured besides, each kept whatever it touched: the compact method is
    /// trained on them, and all methods are tested on them.
    pub approaches: u64,
    /// What a real sensor adds: ours is trained for it, the paper's method is not, and both are tested with it.
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
            sequences: 10_000,
            command: "palpate run".into(),
        }
    }
}

/// What a run measured; `summary.json`. Shares are between 0 and 1, times in seconds.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// What it was made from: another run with the same may replace it unasked.
    pub made_from: serde_json::Value,
    /// The program's version.
    pub tool_version: &'static str,
    /// The command that remakes it.
    pub command: String,
    /// Seed of all that is random.
    pub seed: u64,
    /// What was added to the touches that ours was trained on, and to all that are tested on.
    pub noise: Noise,
    /// The capture of full touches.
    pub capture: capture::Summary,
    /// The capture of approaches.
    pub approach_capture: capture::Summary,
    /// Full touches trained on and tested on, of all objects together.
    pub touches: Touches,
    /// The same of approaches.
    pub approaches: Touches,
    /// The published method: contact times of full touches.
    pub paper: Method,
    /// The compact one on full touches: it waits for them.
    pub full: Method,
    /// The compact one on every approach with a contact: the model to use.
    pub ours: Method,
    /// One sequence of test approaches per object, as the model to use recognizes it.
    pub recognized: Vec<Recognition>,
    /// The whole run.
    pub seconds: f64,
}

/// How many touches were used for what.
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
    /// How the compiled model is laid out.
    pub layout: String,
    /// What leaves are stored as.
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
    /// How its thresholds were found, on touches captured for that; null if they were not.
    pub calibration: Option<Calibrated>,
    /// Why they were not.
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
/// [`ReportProblem::OtherResults`] if `out` holds results that were made from something else, unless
/// [`Settings::replace`]; [`Error::Cancelled`](crate::Error::Cancelled); and what capture, training, compiling,
/// evaluating or writing return.
pub fn run(objects: &[Object], settings: &Settings, out: &Path, progress: &dyn Progress) -> Result<Summary> {
    let began = Instant::now();
    let made_from = made_from(objects, settings)?;
    if !settings.replace {
        results::refuse_others(out, &made_from, &FILES, "data/dataset.json")?;
    }
    let data = out.join("data");
    // A run replaces what an earlier run on the same objects left, finished or not, and no other touches.
    let names: BTreeSet<&str> = objects.iter().map(|object| object.name.as_str()).collect();
    let is_same = |listing: &Listing| listing.objects.iter().map(|entry| entry.name.as_str()).eq(names.iter().copied());
    let force = settings.capture.force || settings.replace || Listing::read(&data)?.as_ref().is_some_and(is_same);
    let captured =
        capture::capture(objects, &capture::Settings { force, ..settings.capture.clone() }, &data, progress)?;
    let seed = settings.capture.origin.seed;
    let mut split = folds::split(&Dataset::read(&data)?, settings.test_share, seed)?;
    // Of another seed, so that no test approach is one of the full touches that the others were trained on.
    let origin = &settings.capture.origin;
    let origin =
        Origin { touches: settings.approaches, approaches: true, seed: seed.wrapping_add(1), ..origin.clone() };
    let directory = out.join("approaches");
    let force = settings.capture.force || settings.replace || Listing::read(&directory)?.as_ref().is_some_and(is_same);
    let approach_settings = capture::Settings { origin, force, ..settings.capture.clone() };
    let approached = capture::capture(objects, &approach_settings, &directory, progress)?;
    let mut approaches = folds::split(&Dataset::read(&directory)?, settings.test_share, seed)?;
    // Another seed than that of the training.
    let robots = evaluate::add_noise(&mut split.test, &settings.noise, seed.wrapping_add(1))?;
    evaluate::add_noise(&mut approaches.test, &settings.noise, seed.wrapping_add(1))?;
    let probe = Some(StatedProbe::from(&settings.capture.origin));
    let job = Job { settings, objects, approaches: &approaches.test, robots, out, progress };
    let method = |name, files, preset, split| Trial::new(name, files, preset, split, job);
    let compact = train::Settings { seed, probe, noise: settings.noise, ..train::Settings::compact() };
    let full = train::Settings { counted: Some(Counted::Full), ..compact.clone() };
    let contacts = train::Settings { counted: Some(Counted::Contacts), ..compact };
    let paper =
        method("the paper's method", "paper", train::Settings { seed, probe, ..train::Settings::paper() }, &split)?;
    let full = method("ours on full touches", "full", full, &split)?;
    let ours = method("ours on every contact", "ensemble", contacts, &approaches)?;
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
        recognized: approaches
            .test
            .objects
            .iter()
            .map(|o| recognize(&model, &o.name, &o.touches))
            .collect::<Result<_>>()?,
        paper: paper.method.clone(),
        full: full.method.clone(),
        ours: ours.method.clone(),
        seconds: began.elapsed().as_secs_f64(),
    };
    let page = run_page(&RunResults {
        command: settings.command.clone(),
        play: PLAY.into(),
        pictures: pictures(objects, &summary.capture),
        methods: vec![
            shown("paper", &paper),
            shown("ours on full touches", &full),
            shown("ours on every contact", &ours),
        ],
        table: table(&summary),
        note: note(&summary),
        facts: facts(&summary),
    })?;
    page.write(&out.join("report.html"))?;
    output::write_json(&out.join("summary.json"), &summary)?;
    Ok(summary)
}

/// What the results depend on.
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

/// What is the same for all methods: also the approaches that they are tested on besides their own kind of touches.
#[derive(Clone, Copy)]
struct Job<'d> {
    settings: &'d Settings,
    objects: &'d [Object],
    approaches: &'d Dataset,
    /// How many robots made the test touches, in turn.
    robots: usize,
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
    fn new(name: &str, stem: &str, preset: train::Settings, split: &Split, job: Job<'_>) -> Result<Self> {
        let Job { settings, approaches, robots, out, progress, .. } = job;
        let began = Instant::now();
        let ensemble = train::train(&split.train, &preset, progress)?;
        let train_seconds = began.elapsed().as_secs_f64();
        progress::check(progress)?;
        progress.begin(&format!("compiling and testing {name}"), None);
        let compile = compile::Settings { error_rate: settings.error_rate, ..compile::Settings::default() };
        let mut compiled = compile::compile(&ensemble, &compile)?;
        let calibration = calibrated(&compiled.bytes, split, &job)?;
        if let Ok(calibrated) = &calibration {
            compiled.bytes.clone_from(&calibrated.model);
        }
        ensemble.save(out.join(stem).with_extension("json"))?;
        output::write_bytes(&model_path(out, stem), &compiled.bytes)?;
        let model = compile::open(&compiled.bytes)?;
        let margins = Margins::new(Candidate::Compiled(&model), &split.test)?.of_robots(robots);
        let fewest = margins.fewest_touches();
        let seed = settings.capture.origin.seed;
        let mut evaluation = evaluate::evaluate(
            &margins,
            &evaluate::Settings {
                at: AT.into_iter().filter(|&at| distinct_groups(fewest, at) >= LEAST_GROUPS).collect(),
                at_approaches: Vec::new(),
                groups: settings.groups,
                error_rate: None,
                max_touches: None,
                seed,
                noise: settings.noise,
            },
        )?;
        let approached = Margins::new(Candidate::Compiled(&model), approaches)?.of_robots(robots);
        let fewest_approaches = approached.fewest_approaches();
        let at: Vec<usize> = AT_APPROACHES.into_iter().filter(|&at| at <= fewest_approaches).collect();
        let stopping = SequentialSettings { error_rate: None, max_touches: None, sequences: settings.groups, seed };
        evaluation.approaches = Some(approached.approaches(&at, &stopping)?);
        let curve = margins.curve(MOST.min(largest_group(fewest)), settings.groups, seed)?;
        let parity = parity::parity(&ensemble, &model, &split.test, PARITY_SEQUENCES, seed, progress)?;
        let method = Method {
            trees: ensemble.trees.len(),
            train_seconds,
            model_bytes: compiled.bytes.len(),
            layout: compiled.layout.name().into(),
            leaf: compile.leaf.name().into(),
            fixed_touches: curve.touches_to_error(settings.error_rate),
            followed_to: curve.most(),
            evaluation,
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
    let terms = calibrate::Settings {
        rate: settings.error_rate,
        sequences: settings.sequences,
        noise: settings.noise,
        seed,
        ..calibrate::Settings::default()
    };
    match calibrate::calibrate_fresh(&compile::open(bytes)?, job.objects, &origin, &terms, job.progress) {
        Err(error) => match error.problem() {
            Some(Problem::Calibrate(problem)) => Ok(Err(problem.to_string())),
            _ => Err(error),
        },
        Ok(calibrated) => Ok(Ok(calibrated)),
    }
}

fn model_path(out: &Path, stem: &str) -> PathBuf {
    out.join(if stem == "ensemble" { "model" } else { stem }).with_extension("palpate")
}

/// Pushes one object's test touches until the recognizer has its verdict.
fn recognize(model: &Model<'_>, touched: &str, touches: &[palpate_shared::Touch]) -> Result<Recognition> {
    let mut recognizer = Recognizer::<256>::new(model, Stopping::from_model(model))
        .map_err(|_| ReportProblem::TooManyObjects { objects: model.object_count() })?;
    let mut approaches = 0;
    let mut push = |touch| {
        approaches += 1;
        recognizer.push(touch).ok().filter(|verdict| *verdict != Verdict::Undecided)
    };
    let verdict = touches.iter().find_map(&mut push);
    let best = recognizer.best();
    let recognized = matches!(verdict, Some(Verdict::Recognized { .. })).then(|| model.object_name(best).into());
    let posterior = recognizer.posterior(best).to_f64();
    Ok(Recognition { touched: touched.into(), recognized, touches: recognizer.touches(), approaches, posterior })
}

fn pictures(objects: &[Object], captured: &capture::Summary) -> Vec<Picture> {
    let captured_as = |name: &str| captured.objects.iter().find(|object| object.name == name);
    let picture = |object: &Object| Picture {
        name: object.name.clone(),
        png: render::thumbnail(object.mesh(), PICTURE),
        line: captured_as(&object.name).map_or_else(String::new, |c| {
            format!("{:.1} % of approaches are full touches", 100.0 * c.touches as f64 / c.approaches.max(1) as f64)
        }),
    };
    objects.iter().map(picture).collect()
}

/// The page on which the objects can be touched, with all models.
fn play_page(objects: &[Object], trials: [&Trial; 3], settings: &Settings) -> Result<String> {
    let contender = |trial: &Trial| {
        let measured = trial.method.evaluation.approaches.as_ref();
        let expected = measured.map(|approaches| Expected::from(&approaches.sequential));
        Contender::new(CompiledModel::from_bytes(trial.compiled.bytes.clone())?, expected)
    };
    let contenders = trials.into_iter().map(contender).collect::<Result<Vec<_>>>()?;
    let origin = settings.capture.origin.clone();
    play::page(
        objects,
        &contenders,
        &play::Settings { origin, noise: settings.noise, command: settings.command.clone() },
    )
}

fn shown(name: &str, Trial { curve, method, fewest, .. }: &Trial) -> RunMethod {
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
        per_object: objects
            .map(|(position, name)| {
                (name.clone(), touches.iter().map(|&n| (n, curve.object_accuracy(position, n).value)).collect())
            })
            .collect(),
    }
}

/// The table that the program prints and the page shows: the paper's method, ours where it waits for full touches, and
/// ours where every contact is evidence, side by side.
fn table(summary: &Summary) -> Records {
    let mut table = Records::new(["measure", "paper, full touches", "ours, full touches", "ours, every contact"]);
    let both = |cell: &dyn Fn(&Method) -> Cell| [&summary.paper, &summary.full, &summary.ours].map(cell);
    let mut row = |name: String, [paper, full, ours]: [Cell; 3]| table.push([Cell::Text(name), paper, full, ours]);
    let rate = 100.0 * summary.ours.evaluation.sequential.error_rate;
    let approaches = |cell: &dyn Fn(&Approaches) -> Cell| {
        both(&|method| method.evaluation.approaches.as_ref().map_or(Cell::Missing, cell))
    };
    row(
        format!("approaches to a {rate} % error rate, stopping when sure"),
        approaches(&|of| Cell::Spread(of.sequential.mean_approaches, of.sequential.mean_approaches_standard_error, 1)),
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
        format!("touches to a {rate} % error rate, stopping when sure"),
        both(&|m| {
            let sequential = &m.evaluation.sequential;
            Cell::Spread(sequential.mean_touches, sequential.mean_touches_standard_error, 1)
        }),
    );
    row("  promised".into(), both(&|m| promised(m.evaluation.sequential.promised)));
    row("  wrong verdicts".into(), both(&|m| Cell::Percent(m.evaluation.sequential.error, 2)));
    row("  undecided when touches ran out".into(), both(&|m| Cell::Percent(m.evaluation.sequential.undecided, 2)));
    row(
        format!("touches to a {rate} % error rate, a fixed number"),
        both(&|m| {
            m.fixed_touches.map_or_else(
                || if m.followed_to == 0 { Cell::Missing } else { Cell::Text(format!("over {}", m.followed_to)) },
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

/// What the test touches had, and what a missing accuracy means, if one is missing.
fn note(summary: &Summary) -> String {
    let noise = &summary.noise;
    let noise = match noise.is_none() {
        true => "No noise was added to touches.".to_owned(),
        false => format!("Ours was trained, and all are tested, with {noise}; the paper's method is trained without."),
    };
    [noise, calibration(summary), missing(summary)]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join(" ")
}

/// What the promises rest on, or why there are none.
fn calibration(summary: &Summary) -> String {
    let ours = &summary.ours;
    let promise = match (&ours.calibration, &ours.uncalibrated) {
        (Some(calibrated), _) => format!(
            "The model keeps its promise with a probability of {} %; its thresholds were found on {} sequences of {} \
             captured for that.",
            100.0 * calibrated.confidence,
            calibrated.sequences,
            calibrated.counted
        ),
        (None, why) => format!("The model promises nothing: {}.", why.as_deref().unwrap_or("it was not calibrated")),
    };
    let others = [("paper", &summary.paper), ("full touches", &summary.full)];
    let why = |(name, method): (&str, &Method)| method.uncalibrated.as_ref().map(|why| format!(" {name}: {why}."));
    promise + &others.into_iter().filter_map(why).collect::<String>()
}

/// What a missing accuracy means, if one is missing.
fn missing(summary: &Summary) -> String {
    let missing = |method: &Method| TABLE_AT.iter().any(|at| !method.evaluation.accuracy.contains_key(at));
    if ![&summary.paper, &summary.full, &summary.ours].into_iter().any(missing) {
        return String::new();
    }
    format!(
        "– stands for an accuracy that would rest on fewer than {LEAST_GROUPS} distinct groups of test touches; capture \
         more touches to measure it."
    )
}

fn facts(summary: &Summary) -> Vec<(String, String)> {
    let touches = summary.touches;
    [
        ("command", summary.command.clone()),
        ("version", summary.tool_version.into()),
        ("seed", summary.seed.to_string()),
        ("touches trained on", touches.train.to_string()),
        ("touches tested on", touches.test.to_string()),
        ("seconds in all", format!("{:.1}", summary.seconds)),
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
         every approach. Tested on a tenth of each that training never saw.\n",
        capture.objects.len(),
        capture.touches(),
        capture.approaches(),
        summary.approach_capture.approaches(),
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
        "\n± is a standard error. {:.1} s in all. The page: {}; to touch the objects yourself: {}",
        summary.seconds,
        out.join("report.html").display(),
        out.join(PLAY).display()
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{Error, Problem};
    use crate::mesh::Mesh;

    fn objects() -> Vec<Object> {
        [("ball", [1.0, 1.0, 1.0]), ("cigar", [1.0, 0.3, 0.3]), ("disc", [1.0, 1.0, 0.2])]
            .map(|(name, sides)| Object::new(name, Mesh::globe(10).stretched(sides)))
            .to_vec()
    }

    fn settings(touches: u64) -> Settings {
        Settings {
            sources: vec!["meshes".into()],
            capture: crate::touches::Origin { touches, ..Default::default() }.into(),
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
        assert_eq!(row(&text, "undecided when touches ran out")[1], format!("{:.2}\u{a0}%", 100.0 * undecided));
        assert!(text.contains("fewer than 300 distinct groups"), "{text}");

        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        assert!(page.contains("undecided when touches ran out") && page.contains("fewer than 300 distinct groups"));
        assert!(page.contains("palpate run &#39;my meshes&#39;") || page.contains("palpate run 'my meshes'"));
        let written: serde_json::Value =
            serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
        assert_eq!(written["full"]["sequential"]["undecided"], serde_json::json!(evaluation.sequential.undecided));
        assert_eq!(written["full"]["approaches"]["sequential"]["undecided"], serde_json::json!(undecided));
        for file in FILES {
            assert!(out.join(file).is_file(), "{file}");
        }

        // The same again may replace them, and gives the same models; anything else may not, and changes nothing.
        let model = std::fs::read(out.join("model.palpate")).unwrap();
        let error = run(&objects()[..2], &settings(300), &out, &()).unwrap_err();
        assert!(matches!(error.problem(), Some(Problem::Report(ReportProblem::OtherResults { .. }))), "{error}");
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
        assert!(matches!(error, Error::Cancelled), "{error}");
        assert!(!place.path().join("summary.json").exists());
    }
}
