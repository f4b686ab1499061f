//! The whole way: capture, train, compile, recognize, report.

use crate::capture;
use crate::compile::{self, Compiled};
use crate::ensemble::{StatedProbe, train};
use crate::error::{Error, Result};
use crate::evaluate::parity::{self, Parity};
use crate::evaluate::{self, Candidate, Curve, Evaluation, Margins};
use crate::mesh::Object;
use crate::output;
use crate::page::render;
use crate::progress::Progress;
use crate::report::{self, Cell, Data, Picture, RunMethod, RunResults};
use crate::touches::Dataset;
use crate::touches::folds::{self, Split};
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Numbers of touches after which accuracy is reported.
const AT: [usize; 6] = [1, 5, 10, 20, 30, 60];
/// The most touches that accuracy is followed to.
const MOST: usize = 200;
/// Random sequences whose verdicts are compared with the full model's.
const PARITY_SEQUENCES: usize = 10_000;
/// Pictures in the page, in pixels.
const PICTURE: u32 = 160;

/// How to run.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How objects are touched.
    pub capture: capture::Settings,
    /// The share of touches that is kept from training, to test on.
    pub test_share: f64,
    /// Groups, and sequences, drawn for each object.
    pub groups: usize,
    /// The error rate that recognizers stop at.
    pub error_rate: f64,
    /// The command line that remakes the result, as the report shows it.
    pub command: String,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            capture: capture::Settings::default(),
            test_share: 0.1,
            groups: 1000,
            error_rate: 0.01,
            command: "palpate run".into(),
        }
    }
}

/// What a run measured; `summary.json`. Shares are between 0 and 1, times in seconds.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// The program's version.
    pub tool_version: &'static str,
    /// The command that remakes it.
    pub command: String,
    /// Seed of all that is random.
    pub seed: u64,
    /// Touching the objects.
    pub capture: capture::Summary,
    /// Touches trained on and tested on, of all objects together.
    pub touches: Touches,
    /// The published method.
    pub paper: Method,
    /// The compact one.
    pub ours: Method,
    /// One sequence of test touches an object, as the compiled compact model recognizes it.
    pub recognized: Vec<Recognition>,
    /// All of it.
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
    /// The least fixed number of touches from which on the error is at most the error rate; none within reach is null.
    pub fixed_touches: Option<usize>,
    /// The compiled model held against the ensemble, on the test touches.
    pub parity: Parity,
}

/// A sequence of touches of one object, pushed until the verdict.
#[derive(Clone, Debug, Serialize)]
pub struct Recognition {
    /// The object that was touched.
    pub touched: String,
    /// The object that was recognized; null if the recognizer stayed undecided.
    pub recognized: Option<String>,
    /// Touches used.
    pub touches: u32,
    /// Posterior of the object with the most evidence.
    pub posterior: f64,
}

/// Runs all of it on `objects` and writes into `out`: `data/` (the touches), `paper.json`, `paper.palpate`,
/// `ensemble.json`, `model.palpate`, `summary.json` and `report.html`.
///
/// # Errors
/// What capture, training, compiling, evaluating or writing return.
pub fn run(objects: &[Object], settings: &Settings, out: &Path, progress: &dyn Progress) -> Result<Summary> {
    let began = Instant::now();
    let data = out.join("data");
    let captured = capture::capture(objects, &settings.capture, &data, progress)?;
    let seed = settings.capture.seed;
    let split = folds::split(&Dataset::read(&data)?, settings.test_share, seed)?;
    let probe = Some(StatedProbe { probe: settings.capture.probe, length: settings.capture.length });
    let method = |name, files, preset| Trial::new(name, files, preset, &split, settings, out, progress);
    let paper = method("paper", "paper", train::Settings { seed, probe, ..train::Settings::paper() })?;
    let ours = method("ours", "ensemble", train::Settings { seed, probe, ..train::Settings::compact() })?;
    let model = compile::open(&ours.compiled.bytes)?;
    let summary = Summary {
        tool_version: env!("CARGO_PKG_VERSION"),
        command: settings.command.clone(),
        seed,
        capture: captured,
        touches: Touches { train: split.train.len(), test: split.test.len() },
        recognized: split.test.objects.iter().map(|o| recognize(&model, &o.name, &o.touches)).collect::<Result<_>>()?,
        paper: paper.method,
        ours: ours.method,
        seconds: began.elapsed().as_secs_f64(),
    };
    let page = report::short(&RunResults {
        command: settings.command.clone(),
        pictures: pictures(objects, &summary.capture),
        methods: vec![shown("paper", &paper.curve, &summary.paper), shown("ours", &ours.curve, &summary.ours)],
        table: table(&summary),
        facts: facts(&summary),
    })?;
    report::write(&page, &out.join("report.html"))?;
    output::write_json(&out.join("summary.json"), &summary)?;
    Ok(summary)
}

/// A method, trained, compiled and tried.
struct Trial {
    compiled: Compiled,
    curve: Curve,
    method: Method,
}

impl Trial {
    fn new(
        name: &str,
        stem: &str,
        preset: train::Settings,
        split: &Split,
        settings: &Settings,
        out: &Path,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let began = Instant::now();
        let ensemble = train::train(&split.train, &preset, progress)?;
        let train_seconds = began.elapsed().as_secs_f64();
        progress.begin(&format!("compiling and testing {name}"), None);
        let compile = compile::Settings {
            error_rate: settings.error_rate,
            ..compile::Settings::default()
        };
        let compiled = compile::compile(&ensemble, &compile)?;
        ensemble.save(out.join(stem).with_extension("json"))?;
        output::write_bytes(&model_path(out, stem), &compiled.bytes)?;
        let model = compile::open(&compiled.bytes)?;
        let margins = Margins::new(Candidate::Compiled(&model), &split.test)?;
        let fewest = margins.fewest_touches();
        let seed = settings.capture.seed;
        let evaluation = evaluate::evaluate(
            &margins,
            &evaluate::Settings {
                at: AT.into_iter().filter(|&at| at <= fewest).collect(),
                groups: settings.groups,
                error_rate: settings.error_rate,
                max_touches: None,
                seed,
            },
        )?;
        let curve = margins.curve(MOST.min(fewest), settings.groups, seed)?;
        let parity = parity::parity(&ensemble, &model, &split.test, PARITY_SEQUENCES, seed, progress)?;
        let method = Method {
            trees: ensemble.trees.len(),
            train_seconds,
            model_bytes: compiled.bytes.len(),
            layout: compiled.layout.name().into(),
            leaf: compile.leaf.name().into(),
            fixed_touches: curve.touches_to_error(settings.error_rate),
            evaluation,
            parity,
        };
        Ok(Self { compiled, curve, method })
    }
}

fn model_path(out: &Path, stem: &str) -> PathBuf {
    out.join(if stem == "ensemble" { "model" } else { stem }).with_extension("palpate")
}

/// Pushes one object's test touches until the recognizer has its verdict.
fn recognize(model: &Model<'_>, touched: &str, touches: &[palpate_shared::Touch]) -> Result<Recognition> {
    let mut recognizer = Recognizer::<256>::new(model, Stopping::from_model(model))
        .map_err(|_| Error::data(format!("a model of {} objects", model.object_count()), "Use at most 256 objects."))?;
    let verdict = touches.iter().map(|touch| recognizer.push(touch)).find(|verdict| *verdict != Verdict::Undecided);
    let best = recognizer.best();
    let recognized = matches!(verdict, Some(Verdict::Recognized { .. })).then(|| model.object_name(best).into());
    let posterior = recognizer.posterior(best).to_f64();
    Ok(Recognition { touched: touched.into(), recognized, touches: recognizer.touches(), posterior })
}

fn pictures(objects: &[Object], captured: &capture::Summary) -> Vec<Picture> {
    let captured_as = |name: &str| captured.objects.iter().find(|object| object.name == name);
    let picture = |object: &Object| Picture {
        name: object.name.clone(),
        png: render::thumbnail(&object.mesh, PICTURE),
        line: captured_as(&object.name).map_or_else(String::new, |c| {
            format!("{:.1} % of approaches are full touches", 100.0 * c.touches as f64 / c.approaches.max(1) as f64)
        }),
    };
    objects.iter().map(picture).collect()
}

fn shown(name: &str, curve: &Curve, method: &Method) -> RunMethod {
    let touches: Vec<usize> =
        [1, 2, 3, 5, 7, 10, 14, 20, 30, 42, 60, 85, 120].into_iter().filter(|&n| n <= curve.most()).collect();
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

/// The table that the program prints and the page shows: the paper's method and ours, side by side.
pub fn table(summary: &Summary) -> Data {
    let mut table = Data::new(["", "paper", "ours"]);
    let both = |of: &dyn Fn(&Method) -> Cell| [of(&summary.paper), of(&summary.ours)];
    let mut row = |name: String, [paper, ours]: [Cell; 2]| table.push([Cell::Text(name), paper, ours]);
    for at in [10, 30] {
        let cell = |method: &Method| {
            let evaluation = &method.evaluation;
            match (evaluation.accuracy.get(&at), evaluation.accuracy_standard_error.get(&at)) {
                (Some(&accuracy), Some(&error)) => Cell::PercentSpread(accuracy, error, 1),
                _ => Cell::Missing,
            }
        };
        row(format!("accuracy after {at} touches"), both(&cell));
    }
    let rate = 100.0 * summary.ours.evaluation.sequential.error_rate;
    row(
        format!("touches to a {rate} % error rate, stopping when sure"),
        both(&|m| {
            let sequential = &m.evaluation.sequential;
            Cell::Spread(sequential.mean_touches, sequential.mean_touches_standard_error, 1)
        }),
    );
    row("  errors made so".into(), both(&|m| Cell::Percent(m.evaluation.sequential.error, 2)));
    row(
        format!("touches to a {rate} % error rate, a fixed number"),
        both(&|m| m.fixed_touches.map_or_else(|| Cell::Text(format!("over {MOST}")), Cell::count)),
    );
    row("model bytes".into(), both(&|m| Cell::count(m.model_bytes)));
    row("trees".into(), both(&|m| Cell::count(m.trees)));
    row("training, seconds".into(), both(&|m| Cell::Number(m.train_seconds, 1)));
    let capture = &summary.capture;
    let same = |cell: Cell| [cell.clone(), cell];
    row("capture, seconds".into(), same(Cell::Number(capture.seconds, 1)));
    row(
        "touches captured a second".into(),
        same(Cell::Number(capture.touches() as f64 / capture.seconds.max(1e-9), 0)),
    );
    row("largest margin error, nats".into(), both(&|m| Cell::Number(m.parity.max_margin_error, 5)));
    row("  bound that the model states".into(), both(&|m| Cell::Number(m.parity.stated_bound, 5)));
    row("verdicts that differ from the full model's".into(), both(&|m| Cell::count(m.parity.verdict_differs)));
    table
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
        "Touched {} objects {} times in {} approaches; trained on {} touches, tested on the other {}.\n",
        capture.objects.len(),
        capture.touches(),
        capture.approaches(),
        summary.touches.train,
        summary.touches.test
    );
    let width = summary.recognized.iter().map(|r| r.touched.chars().count()).max().unwrap_or(0);
    for recognition in &summary.recognized {
        let Recognition { touched, recognized, touches, posterior } = recognition;
        _ = match recognized {
            Some(name) if name == touched => {
                writeln!(text, "  {touched:width$}  recognized after {touches:>3} touches, posterior {posterior:.4}")
            }
            Some(name) => {
                writeln!(text, "  {touched:width$}  taken for {name} after {touches} touches, posterior {posterior:.4}")
            }
            None => writeln!(text, "  {touched:width$}  undecided after {touches} touches"),
        };
    }
    let table = table(summary);
    let rows: Vec<Vec<String>> = std::iter::once(table.columns.clone())
        .chain(table.rows.iter().map(|row| row.iter().map(Cell::shown).collect()))
        .collect();
    let widths: Vec<usize> =
        (0..3).map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)).collect();
    _ = writeln!(text);
    for row in &rows {
        _ = writeln!(
            text,
            "{:w0$}  {:>w1$}  {:>w2$}",
            row[0],
            row[1],
            row[2],
            w0 = widths[0],
            w1 = widths[1],
            w2 = widths[2]
        );
    }
    _ = writeln!(
        text,
        "\n± is a standard error. {:.1} s in all. The page: {}",
        summary.seconds,
        out.join("report.html").display()
    );
    text
}
