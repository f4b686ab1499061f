use super::Global;
use super::chips::{core, instructions};
use super::stated::{
    Defaults, Feature, Noise, PlanOf, Predicts, Probe, Promised, Tested, Touches, TrainedOn, evidence, features, noise,
    pattern, plan, predicts, priors, probe, promised, tested, trained_on,
};
use palpate::Result;
use palpate::chip::instructions::Chip;
use palpate::compile::{self, CompiledModel, Core, Instructions, Memory};
use palpate::evaluate;
use palpate::output;
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::{CHECKSUM_LENGTH, HEADER_LENGTH};
use palpate_shared::{Pose, Q15_ONE, Touch};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Say what is in a compiled model, and what it costs on a chip.
#[derive(clap::Args)]
#[command(after_help = "\
With --chip, instructions per touch are measured where QEMU is installed and the firmware's `cost` image is built (onboard/firmware, seen from the current directory); otherwise they are estimated, right to 15 %. The time is that of one instruction per cycle: memory that makes the processor wait adds to it.

Examples:
  palpate inspect model.palpate
  palpate inspect model.palpate --chip m0+ --mhz 48
  palpate inspect model.palpate --json")]
pub(crate) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// The processor; says what the model costs on it
    #[arg(long, value_parser = core, value_name = "m0+|m4f")]
    chip: Option<Core>,
    /// The processor's clock in MHz, to give the time per touch
    #[arg(long, requires = "chip", value_name = "MHZ", value_parser = megahertz)]
    mhz: Option<f64>,
}

#[derive(serde::Serialize)]
struct Inspected<'a> {
    version: u16,
    tool_version: &'a str,
    ensemble: String,
    descriptor: &'static str,
    features: usize,
    /// Of a model over rows: each feature's name, and how many units make up 1 (null where f32 values are compared).
    #[serde(skip_serializing_if = "Option::is_none")]
    feature_names: Option<Vec<Feature>>,
    objects: Vec<&'a str>,
    /// Of a model over rows: what it predicts.
    #[serde(skip_serializing_if = "Option::is_none")]
    predicts: Option<Predicts>,
    layout: &'static str,
    leaf: &'static str,
    /// How many different leaves there are, if equal ones stand once.
    #[serde(skip_serializing_if = "Option::is_none")]
    shared_leaves: Option<usize>,
    trees: u32,
    splits: u32,
    leaves: u32,
    bytes: usize,
    bytes_by_part: BTreeMap<&'static str, usize>,
    checksum: String,
    unit: f32,
    margin_error: f32,
    stopping: Defaults,
    /// What the model promises; null if it was not calibrated.
    promise: Option<Promised>,
    /// Whether it has a column for what it does not know.
    background: bool,
    /// Its test of whether touches fit any object that it knows; null without one.
    strangers: Option<Tested>,
    /// What evidence is divided by before it is shown as a posterior.
    temperature: f64,
    /// The logarithm of each object's prior, the largest 0; null if all are equal.
    priors: Option<BTreeMap<&'a str, f64>>,
    probe: Probe,
    /// The touches that are evidence.
    touches: Touches,
    /// The noise in the training; null if the model does not state it.
    noise: Option<Noise>,
    /// Share of each contact pattern among the approaches of the training; null if the model does not state it.
    pattern: Option<BTreeMap<&'static str, f64>>,
    /// The touches that it was trained on; null if the model does not state it.
    trained_on: Option<TrainedOn>,
    /// The plan of approaches; null if the model has none.
    plan: Option<PlanOf>,
    /// Per touch, estimated.
    instructions: Instructions,
    #[serde(skip_serializing_if = "Option::is_none")]
    chip: Option<OnChip>,
}

/// What the model costs on a chip.
#[derive(serde::Serialize)]
struct OnChip {
    core: Core,
    #[serde(flatten)]
    memory: Memory,
    /// "measured" or "estimated".
    how: &'static str,
    /// From contact times to margins.
    margin_instructions: Option<u64>,
    /// From contact times to the verdict.
    verdict_instructions: Option<u64>,
    mhz: Option<f64>,
    /// From contact times to the verdict, at one instruction per cycle.
    microseconds: Option<f64>,
}

/// Instructions of a verdict beyond the margins, where nothing is measured: between 500 and 1,400.
const VERDICT: u64 = 1_000;

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    let compiled = CompiledModel::read(&arguments.model)?;
    let model = compiled.model();
    let mut inspected = inspect(&model);
    inspected.chip = arguments.chip.map(|core| on_chip(&model, core, arguments.mhz)).transpose()?;
    if global.json { output::print_json(&inspected) } else { output::print(&text(&inspected)) }
}

fn inspect<'a>(model: &Model<'a>) -> Inspected<'a> {
    let header = model.header();
    let stopping = Stopping::from_model(model);
    Inspected {
        version: header.version(),
        tool_version: model.tool_version(),
        ensemble: format!("{:016x}", header.ensemble()),
        descriptor: model.descriptor().map_or("none (rows of features)", palpate_shared::Descriptor::name),
        features: model.feature_count(),
        feature_names: model.descriptor().is_none().then(|| features(model)),
        objects: (0..model.known_count()).map(|object| model.object_name(object)).collect(),
        predicts: predicts(model),
        layout: model.layout().name(),
        leaf: model.leaf_type().name(),
        shared_leaves: compile::different_leaves(model),
        trees: header.trees(),
        splits: header.splits(),
        leaves: header.leaves(),
        bytes: model.bytes().len(),
        bytes_by_part: parts(model),
        checksum: format!("{:08x}", model.checksum()),
        unit: model.unit(),
        margin_error: model.margin_error(),
        stopping: Defaults {
            error_rate: evaluate::significant(stopping.error_rate()),
            max_touches: stopping.max_touches(),
        },
        promise: promised(model),
        background: model.background().is_some(),
        strangers: model.strangers().and_then(|strangers| strangers.test).map(|test| tested(&test.terms)),
        temperature: model.temperature().value(),
        priors: priors(model),
        probe: probe(model),
        touches: evidence(model),
        noise: noise(model),
        pattern: pattern(model),
        trained_on: trained_on(model),
        plan: plan(model),
        instructions: Instructions::of_model(model),
        chip: None,
    }
}

fn parts(model: &Model<'_>) -> BTreeMap<&'static str, usize> {
    let header = model.header();
    let objects = model.object_count();
    let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
    BTreeMap::from([
        ("header", HEADER_LENGTH),
        ("text", length(header.text_length())),
        ("optional_sections", length(header.optional_length())),
        ("base_margins", 4 * objects),
        ("priors", 4 * objects),
        ("axes", 4 * usize::from(header.axes())),
        ("thresholds", length(header.cuts_length())),
        ("groups", 8 * usize::from(header.groups())),
        ("splits", length(header.nodes_length())),
        ("leaves", length(header.leaves_length())),
        ("checksum", CHECKSUM_LENGTH),
    ])
}

fn on_chip(model: &Model<'_>, core: Core, mhz: Option<f64>) -> Result<OnChip> {
    let emulated = match core {
        Core::M4F => Chip::M4F,
        Core::M0Plus => Chip::M0Plus,
    };
    // The image makes touches of what it is given; a model over rows of features cannot be measured with it.
    let measured = match model.descriptor() {
        Some(_) if emulated.is_there() => Some(emulated.measure(model.bytes(), &spread_touches(model))?),
        _ => None,
    };
    let (how, margins, verdict) = match measured {
        Some(cost) => ("measured", Some(cost.margins), Some(cost.push)),
        None => {
            let margins = Instructions::of_model(model).on(core);
            ("estimated", margins, margins.map(|margins| margins + VERDICT))
        }
    };
    Ok(OnChip {
        core,
        memory: Memory::of_model(model, core),
        how,
        margin_instructions: margins,
        verdict_instructions: verdict,
        mhz,
        microseconds: mhz.zip(verdict).map(|(mhz, verdict)| verdict as f64 / mhz),
    })
}

/// Touches that spread evenly over what the model's probe can give, the same every time.
fn spread_touches(model: &Model<'_>) -> Vec<Touch> {
    // Most contacts come within a twentieth of the longest time.
    let range = compile::longest_time(model) * 1e6 / 20.0;
    let spread = |index: u32, step: f64| ((f64::from(index) * step).fract() * range) as u32;
    let touch = |index| {
        let pose = Pose { direction: [0, 0, -Q15_ONE], alignment: [Q15_ONE, 0, 0] };
        let times = [spread(index, 0.618_034), spread(index, 0.754_878), spread(index, 0.569_840)];
        Touch::from_micros(times).with_pose(pose)
    };
    (0..64).map(touch).collect()
}

fn text(inspected: &Inspected<'_>) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{name:14} {value}");
    };
    line("format version", format!("{} (palpate {})", inspected.version, inspected.tool_version));
    line("descriptor", format!("{}, {} features", inspected.descriptor, inspected.features));
    if let Some(features) = &inspected.feature_names {
        let feature = |Feature { name, scale }: &Feature| match scale {
            Some(scale) => format!("{name} × {scale}"),
            None => name.clone(),
        };
        line("features", features.iter().map(feature).collect::<Vec<_>>().join(", "));
    }
    let is_rows = inspected.predicts.is_some();
    let (things, each) = if is_rows { ("rows", "row") } else { ("touches", "touch") };
    match &inspected.predicts {
        Some(Predicts { what: "value", .. }) => line("output", inspected.objects.join(", ")),
        Some(_) => line("classes", format!("{}: {}", inspected.objects.len(), inspected.objects.join(", "))),
        None => line("objects", format!("{}: {}", inspected.objects.len(), inspected.objects.join(", "))),
    }
    if let Some(predicts) = &inspected.predicts {
        line("predicts", predicts.text());
    }
    line("trees", format!("{}, {} splits, {} leaves", inspected.trees, inspected.splits, inspected.leaves));
    let shared = inspected.shared_leaves.map_or(String::new(), |count| format!(", {count} different ones, each once"));
    line("layout", format!("{}, {} leaves{shared}", inspected.layout, inspected.leaf));
    line(
        "margins",
        format!("units of {:.3e} nats, within {:.2e} nats of the ensemble's", inspected.unit, inspected.margin_error),
    );
    line(
        "stopping",
        match &inspected.promise {
            None => format!(
                "error rate {}, at most {} {things}",
                inspected.stopping.error_rate, inspected.stopping.max_touches
            ),
            Some(_) => format!("at most {} {things}", inspected.stopping.max_touches),
        },
    );
    if let Some(promise) = &inspected.promise {
        line(
            "promise",
            format!(
                "at most {} % of {} wrong, {} % sure; {} sequences of {:.1} {}, {} names given, {} wrong, {:.2} % \
                 undecided",
                super::percent(promise.error_rate),
                match promise.per {
                    "name" => "each name, when it is given,",
                    "object" => "the names given to each object",
                    _ => "all names given",
                },
                super::percent(promise.confidence),
                promise.sequences,
                promise.mean,
                if promise.active { "approaches as planned" } else { promise.counted },
                promise.given,
                promise.wrong,
                100.0 * promise.undecided,
            ),
        );
        line("", format!("for touches with {}, at most {} of them", promise.noise, promise.max_touches));
        let margins: Vec<f64> = promise.margins.values().copied().collect();
        let is_one = margins.iter().all(|margin| *margin == margins[0]);
        let margin = |(name, margin): (&String, &f64)| format!("{name} {margin:.2}");
        let margins = match margins.first().filter(|_| is_one) {
            Some(margin) => format!("{margin:.2}"),
            None => promise.margins.iter().map(margin).collect::<Vec<_>>().join(", "),
        };
        line("thresholds", format!("nats ahead of all others: {margins}"));
        line("posteriors", format!("at a temperature of {:.2}", inspected.temperature));
    }
    if inspected.background {
        line("background", "a column for what the model does not know".into());
    }
    if let Some(test) = &inspected.strangers {
        line(
            "strangers",
            format!(
                "{}: at most {} % of known objects are taken for unknown, {} % sure; {} sequences; names after {} touches \
                 at the earliest",
                test.held,
                super::percent(test.promised),
                super::percent(test.confidence),
                test.sequences,
                test.least_touches
            ),
        );
    }
    if let Some(priors) = &inspected.priors {
        let prior = |(name, prior): (&&str, &f64)| format!("{name} {prior:.2}");
        line("priors", format!("nats: {}", priors.iter().map(prior).collect::<Vec<_>>().join(", ")));
    }
    if !is_rows {
        line(
            "probe",
            match &inspected.probe {
                Probe { radius: Some(radius), spacing, speed, unit, .. } => {
                    let unit = if *unit == "unit" { "units" } else { unit };
                    format!("radius {radius}, spacing {spacing} {unit}, speed {speed} {unit} per second")
                }
                Probe { spacing, speed, .. } => {
                    format!("not stated; assumed: spacing {spacing} units, speed {speed} units per second")
                }
            },
        );
        let Touches { counted, patterns, needs_pose, largest_spread } = &inspected.touches;
        line(
            "touches",
            format!(
                "{counted} ({}){}{}",
                patterns.join(", "),
                if *needs_pose { ", with a pose" } else { "" },
                largest_spread.map_or(String::new(), |spread| format!(", within {:.3} s", f64::from(spread) / 1e6))
            ),
        );
    }
    if let Some(Noise { least, largest, timer, pose_degrees }) = &inspected.noise {
        line(
            "noise",
            format!(
                "{} to {} ms, a timer of {} ms, {pose_degrees}° of the pose",
                f64::from(*least) / 1e3,
                f64::from(*largest) / 1e3,
                f64::from(*timer) / 1e3
            ),
        );
    }
    if let Some(pattern) = &inspected.pattern {
        let shares = pattern.iter().map(|(name, share)| format!("{name} {:.1} %", 100.0 * share));
        line("approaches", shares.collect::<Vec<_>>().join(", "));
    }
    if let Some(TrainedOn { capture, samples: [first, end] }) = &inspected.trained_on {
        line(
            "trained on",
            match capture {
                Some(capture) => {
                    format!("capture {capture}, samples {first} to {} of each object", end.saturating_sub(1))
                }
                None => "touches that are known again by the first ones".into(),
            },
        );
    }
    if let Some(PlanOf { rolls, poses, left_out }) = &inspected.plan {
        line("plan", format!("{poses} poses: 26 directions, {rolls} of the row's rolls each; {left_out} never touch"));
    }
    line("instructions", format!("{} (per {each}, estimated)", instructions(inspected.instructions)));
    line("bytes", inspected.bytes.to_string());
    for (part, bytes) in &inspected.bytes_by_part {
        line("", format!("{bytes:>9} {}", part.replace('_', " ")));
    }
    line("checksum", inspected.checksum.clone());
    line("ensemble", inspected.ensemble.clone());
    if let Some(chip) = &inspected.chip {
        let known = |number: Option<u64>| number.map_or("unknown (f32 leaves)".into(), |number| number.to_string());
        let Memory { model_flash, code_flash, ram, stack, .. } = chip.memory;
        line("", String::new());
        line("on a", chip.core.name().into());
        line(
            "flash",
            format!("{model_flash} bytes of model, about {code_flash} bytes of code (1300 of them start-up)"),
        );
        line("RAM", format!("{ram} bytes, estimated (the opened model, and a recognizer of just its objects)"));
        line("stack", format!("{stack} bytes, estimated"));
        line(
            "instructions",
            format!(
                "{} to the margins, {} to the verdict (per touch, {})",
                known(chip.margin_instructions),
                known(chip.verdict_instructions),
                chip.how
            ),
        );
        if let (Some(mhz), Some(microseconds)) = (chip.mhz, chip.microseconds) {
            line("time", format!("{microseconds:.0} µs per touch at {mhz} MHz, one instruction per cycle"));
        }
    }
    // Empty lines end without blanks.
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

fn megahertz(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(mhz) if mhz > 0.0 && mhz.is_finite() => Ok(mhz),
        _ => Err("give a number above 0, such as 48".into()),
    }
}
