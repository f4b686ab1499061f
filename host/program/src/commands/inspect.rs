use super::Global;
use super::chips::{core, instructions};
use palpate::chip::inspect::{
    Defaults, Feature, Inspected, Limited, Noise, OnChip, PlanOf, Predicts, Probe, Promised, SomeColumns, Tested,
    Touches, inspect, on_chip,
};
use palpate::compile::{CompiledModel, Core, Memory};
use palpate::locate::MapsFile;
use palpate::wording::{count, counted, rate, scientific};
use palpate::{Error, Result};
use palpate_shared::DIRECTIONS;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Say what is in a compiled model, and what it costs on a chip.
#[derive(clap::Args)]
#[command(after_help = "\
Instructions per touch are estimated, right to 15 %; at one instruction per cycle 4,000 of them take 83 µs at 48 MHz. Memory that makes the processor wait adds to it.

Examples:
  palpate inspect model.palpate
  palpate inspect model.palpate --chip m0+
  palpate inspect model.palpate --json")]
pub(crate) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// The processor, m0+ or m4f; says what the model costs on it
    #[arg(long, value_parser = core, value_name = "NAME")]
    chip: Option<Core>,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    if let Some(maps) = MapsFile::read(&arguments.model)? {
        return match arguments.chip {
            Some(chip) => Err(Error::setting("chip", chip.name(), "it with a model of trees")),
            None => super::table::inspect(&maps, global),
        };
    }
    let compiled = CompiledModel::read(&arguments.model)?;
    let model = compiled.model();
    let mut inspected = inspect(&model);
    inspected.chip = arguments.chip.map(|core| on_chip(&model, core));
    global.print(&inspected, || text(&inspected))
}

/// Prediction of a model over rows, in words.
fn predicts_text(predicts: &Predicts) -> String {
    let of_each = if predicts.what == "targets" { "of each target " } else { "" };
    let formula = super::export::formula(predicts.link, predicts.average, predicts.last_of_ties);
    let what = format!("{of_each}{formula}");
    match predicts.missing {
        Some([low, high]) => format!("{what}; features from {low} to {high} are missing"),
        None => what,
    }
}

/// Lines of a name and a value; a line without a name goes on with the one before.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn line(&mut self, name: &str, value: impl std::fmt::Display) {
        // Writing to a string cannot fail.
        _ = writeln!(self.0, "{name:14} {value}");
    }
}

fn text(inspected: &Inspected<'_>) -> String {
    let mut lines = Lines::default();
    what_it_is(&mut lines, inspected);
    if let Some(promise) = &inspected.promise {
        promise_lines(&mut lines, promise, inspected.temperature);
    }
    if inspected.background {
        lines.line("background", "a column for what the model does not know");
    }
    if let Some(test) = &inspected.strangers {
        strangers_line(&mut lines, test);
    }
    if let Some(priors) = &inspected.priors {
        let prior = |(name, prior): (&&str, &f64)| format!("{name} {prior:.2}");
        lines.line("priors", format!("nats: {}", priors.iter().map(prior).collect::<Vec<_>>().join(", ")));
    }
    if inspected.predicts.is_none() {
        probe_lines(&mut lines, &inspected.probe, &inspected.touches);
    }
    training_lines(&mut lines, inspected);
    let each = if inspected.predicts.is_some() { "row" } else { "touch" };
    lines.line("instructions", format!("{} (per {each}, estimated)", instructions(inspected.instructions)));
    lines.line("bytes", count(inspected.bytes));
    for (part, bytes) in &inspected.bytes_by_part {
        lines.line("", format!("{:>9} {}", count(*bytes), part.replace('_', " ")));
    }
    lines.line("checksum", &inspected.checksum);
    lines.line("ensemble", &inspected.ensemble);
    if let Some(chip) = &inspected.chip {
        chip_lines(&mut lines, chip);
    }
    // Empty lines end without blanks.
    lines.0.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// Its features, objects, trees and when it stops.
fn what_it_is(lines: &mut Lines, inspected: &Inspected<'_>) {
    lines.line("format version", format!("{} (palpate {})", inspected.version, inspected.tool_version));
    lines.line("descriptor", format!("{}, {} features", inspected.descriptor, inspected.features));
    if let Some(features) = &inspected.feature_names {
        let feature = |Feature { name, scale }: &Feature| match scale {
            Some(scale) => format!("{name} × {scale}"),
            None => name.clone(),
        };
        lines.line("features", features.iter().map(feature).collect::<Vec<_>>().join(", "));
    }
    if let Some(SomeColumns { all, used }) = &inspected.columns {
        let used: Vec<String> = used.iter().map(ToString::to_string).collect();
        lines.line("columns", format!("{} (from 0) of the library's {all}", used.join(", ")));
    }
    if let Some(feature) = &inspected.position {
        lines.line("row number", format!("{feature}, which recognizers count"));
    }
    if let Some(guard) = &inspected.guard {
        guard_lines(lines, guard);
    }
    let objects = inspected.objects.join(", ");
    match &inspected.predicts {
        Some(Predicts { what: "value", .. }) => lines.line("output", objects),
        Some(_) => lines.line("classes", format!("{}: {objects}", inspected.objects.len())),
        None => lines.line("objects", format!("{}: {objects}", inspected.objects.len())),
    }
    if let Some(predicts) = &inspected.predicts {
        lines.line("predicts", predicts_text(predicts));
    }
    lines.line("trees", format!("{}, {} splits, {} leaves", inspected.trees, inspected.splits, inspected.leaves));
    let shared = inspected.shared_leaves.map_or(String::new(), |count| format!(", {count} different ones, each once"));
    lines.line("layout", format!("{}, {} leaves{shared}", inspected.layout, inspected.leaf));
    lines.line(
        "margins",
        format!(
            "units of {:.3e} nats, within {} nats of the ensemble's",
            inspected.unit,
            scientific(inspected.margin_error.into())
        ),
    );
    let things = if inspected.predicts.is_some() { "rows" } else { "touches" };
    let Defaults { error_rate, max_touches } = inspected.stopping;
    match inspected.promise {
        None => lines.line("stopping", format!("error rate {}, at most {max_touches} {things}", rate(error_rate))),
        Some(_) => lines.line("stopping", format!("at most {max_touches} {things}")),
    }
}

fn guard_lines(lines: &mut Lines, guard: &[Limited]) {
    let limited: Vec<&Limited> = guard.iter().filter(|limited| limited.is_limited()).collect();
    lines.line("guard", format!("{} of {} have limits", limited.len(), counted(guard.len(), "feature", "features")));
    for Limited { feature, low, high, may_miss, most_equal } in limited {
        // As precise as the values that most models compare.
        let values = match (low, high) {
            (Some(low), Some(high)) => format!("{} to {}", *low as f32, *high as f32),
            (Some(low), None) => format!("from {}", *low as f32),
            (None, Some(high)) => format!("up to {}", *high as f32),
            (None, None) => "any value".into(),
        };
        let missing = if *may_miss { "may be missing" } else { "never missing" };
        let equal = most_equal.map_or_else(String::new, |most| format!(", the same in at most {most} rows"));
        lines.line("", format!("{feature}: {values}, {missing}{equal}"));
    }
}

fn promise_lines(lines: &mut Lines, promise: &Promised, temperature: f64) {
    lines.line(
        "promise",
        format!(
            "at most {} % of {} wrong{}, {} % sure; {} sequences of {:.1} {}, {} names given, {} wrong, {:.2} % undecided",
            super::percent(promise.error_rate),
            match promise.per {
                "name" => "each name, when it is given,",
                "object" => "the names given to each object",
                _ => "all names given",
            },
            if promise.groups { " in new groups" } else { "" },
            super::percent(promise.confidence),
            promise.sequences,
            promise.mean,
            if promise.active { "approaches as planned" } else { promise.counted },
            promise.given,
            promise.wrong,
            100.0 * promise.undecided,
        ),
    );
    lines.line(
        "",
        match promise.counted {
            "rows" => format!("at most {} rows", promise.max_touches),
            _ => format!("for touches with {}, at most {} of them", promise.noise, promise.max_touches),
        },
    );
    let margins: Vec<f64> = promise.margins.values().copied().collect();
    let is_one = margins.iter().all(|margin| *margin == margins[0]);
    let margin = |(name, margin): (&String, &f64)| format!("{name} {margin:.2}");
    let margins = match margins.first().filter(|_| is_one) {
        Some(margin) => format!("{margin:.2}"),
        None => promise.margins.iter().map(margin).collect::<Vec<_>>().join(", "),
    };
    lines.line("thresholds", format!("nats ahead of all others: {margins}"));
    lines.line("posteriors", format!("at a temperature of {temperature:.2}"));
}

fn strangers_line(lines: &mut Lines, test: &Tested) {
    lines.line(
        "strangers",
        format!(
            "at most {} % of known objects are taken for unknown, {} % sure; {} sequences; names after {} touches at the \
             earliest",
            super::percent(test.promised),
            super::percent(test.confidence),
            test.sequences,
            test.first_touches
        ),
    );
}

fn probe_lines(lines: &mut Lines, probe: &Probe, touches: &Touches) {
    let text = match probe {
        Probe { radius: Some(radius), spacing, speed, unit, stroke, travel, cone, .. } => {
            let unit = if *unit == "unit" { "units" } else { unit };
            let way = [("stroke", stroke), ("travel", travel)];
            let way = way.into_iter().filter_map(|(name, length)| Some(format!(", {name} {} {unit}", (*length)?)));
            format!("radius {radius}, spacing {spacing} {unit}, speed {speed} {unit} per second")
                + &way.collect::<String>()
                + &cone.map_or_else(String::new, |cone| {
                    format!("; objects on a table, approaches within {cone} degrees of straight down")
                })
        }
        Probe { spacing, speed, .. } => {
            format!("not stated; assumed: spacing {spacing} units, speed {speed} units per second")
        }
    };
    lines.line("probe", text);
    let Touches { counted, patterns, needs_pose, largest_spread } = touches;
    lines.line(
        "touches",
        format!(
            "{counted} ({}){}{}",
            patterns.join(", "),
            if *needs_pose { ", with a pose" } else { "" },
            largest_spread.map_or(String::new(), |spread| format!(", within {:.3} s", f64::from(spread) / 1e6))
        ),
    );
}

/// Its training, and its plan.
fn training_lines(lines: &mut Lines, inspected: &Inspected<'_>) {
    if let Some(Noise { least, largest, timer, pose_degrees }) = &inspected.noise {
        let ms = |micros: &u32| f64::from(*micros) / 1e3;
        let text =
            format!("{} to {} ms, a timer of {} ms, {pose_degrees}° of the pose", ms(least), ms(largest), ms(timer));
        lines.line("noise", text);
    }
    if let Some(pattern) = &inspected.pattern {
        let shares = pattern.iter().map(|(name, share)| format!("{name} {:.1} %", 100.0 * share));
        lines.line("approaches", shares.collect::<Vec<_>>().join(", "));
    }
    if let Some(PlanOf { rolls, poses, left_out }) = &inspected.plan {
        let rolls = counted(usize::from(*rolls), "roll", "rolls");
        let text = format!("{poses} poses: {DIRECTIONS} directions, {rolls} of the row each; {left_out} never touch");
        lines.line("plan", text);
    }
}

fn chip_lines(lines: &mut Lines, chip: &OnChip) {
    let known = |number: Option<u64>| {
        number.map_or("unknown (f32 leaves, or code for an M4F)".into(), |number| number.to_string())
    };
    let Memory { model_flash, code_flash, ram, stack, .. } = chip.memory;
    lines.line("", "");
    lines.line("on a", chip.core.name());
    lines.line(
        "flash",
        format!("{model_flash} bytes of model, about {code_flash} bytes of code (1300 of them start-up)"),
    );
    lines.line("RAM", format!("{ram} bytes, estimated (the opened model, and a recognizer of just its objects)"));
    lines.line("stack", format!("{stack} bytes, estimated"));
    let [margins, verdict] = [chip.margin_instructions, chip.verdict_instructions].map(known);
    lines.line("instructions", format!("{margins} to the margins, {verdict} to the verdict (per touch, estimated)"));
    lines.line(
        "worst case",
        format!("{} to the margins, the longest way through all trees, estimated", known(chip.most_instructions)),
    );
}
