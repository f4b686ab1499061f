use super::Global;
use super::chips::{core, instructions};
use palpate::chip::inspect::{
    Defaults, Feature, Inspected, Limited, Noise, OnChip, PlanOf, Predicts, Probe, Promised, SomeColumns, Tested,
    Touches, inspect, on_chip,
};
use palpate::compile::{CompiledModel, Core, Memory};
use palpate::locate::MapsFile;
use palpate::results::Results;
use palpate::wording::{count, counted, percent, rate, scientific, shares};
use palpate::{Error, Result, row};
use palpate_shared::DIRECTIONS;
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

fn text(inspected: &Inspected<'_>) -> String {
    let mut rows = Results::list();
    what_it_is(&mut rows, inspected);
    if let Some(promise) = &inspected.promise {
        promise_lines(&mut rows, promise, inspected.temperature);
    }
    if inspected.background {
        rows.push(row!["background", "a column for what the model does not know"]);
    }
    if let Some(test) = &inspected.strangers {
        strangers_line(&mut rows, test);
    }
    if let Some(priors) = &inspected.priors {
        let prior = |(name, prior): (&&str, &f64)| format!("{name} {prior:.2}");
        rows.push(row!["priors", format!("nats: {}", priors.iter().map(prior).collect::<Vec<_>>().join(", "))]);
    }
    if inspected.predicts.is_none() {
        probe_lines(&mut rows, &inspected.probe, &inspected.touches);
    }
    training_lines(&mut rows, inspected);
    let each = if inspected.predicts.is_some() { "row" } else { "touch" };
    rows.push(row!["instructions", format!("{} (per {each}, estimated)", instructions(inspected.instructions))]);
    rows.push(row!["bytes", count(inspected.bytes)]);
    for (part, bytes) in &inspected.bytes_by_part {
        rows.push(row!["", format!("{:>9} {}", count(*bytes), part.replace('_', " "))]);
    }
    rows.push(row!["checksum", &inspected.checksum]);
    rows.push(row!["ensemble", &inspected.ensemble]);
    if let Some(chip) = &inspected.chip {
        chip_lines(&mut rows, chip);
    }
    rows.text()
}

/// Its features, objects, trees and when it stops.
fn what_it_is(rows: &mut Results, inspected: &Inspected<'_>) {
    rows.push(row!["format version", format!("{} (palpate {})", inspected.version, inspected.tool_version)]);
    rows.push(row!["descriptor", format!("{}, {} features", inspected.descriptor, inspected.features)]);
    if let Some(features) = &inspected.feature_names {
        let feature = |Feature { name, scale }: &Feature| match scale {
            Some(scale) => format!("{name} × {scale}"),
            None => name.clone(),
        };
        rows.push(row!["features", features.iter().map(feature).collect::<Vec<_>>().join(", ")]);
    }
    if let Some(SomeColumns { all, used }) = &inspected.columns {
        let used: Vec<String> = used.iter().map(ToString::to_string).collect();
        rows.push(row!["columns", format!("{} (from 0) of the library's {all}", used.join(", "))]);
    }
    if let Some(feature) = &inspected.position {
        rows.push(row!["row number", format!("{feature}, which recognizers count")]);
    }
    if let Some(guard) = &inspected.guard {
        guard_lines(rows, guard);
    }
    let objects = inspected.objects.join(", ");
    match &inspected.predicts {
        Some(Predicts { what: "value", .. }) => rows.push(row!["output", objects]),
        Some(_) => rows.push(row!["classes", format!("{}: {objects}", inspected.objects.len())]),
        None => rows.push(row!["objects", format!("{}: {objects}", inspected.objects.len())]),
    }
    if let Some(predicts) = &inspected.predicts {
        rows.push(row!["predicts", predicts_text(predicts)]);
    }
    rows.push(row!["trees", format!("{}, {} splits, {} leaves", inspected.trees, inspected.splits, inspected.leaves)]);
    let shared = inspected.shared_leaves.map_or(String::new(), |count| format!(", {count} different ones, each once"));
    rows.push(row!["layout", format!("{}, {} leaves{shared}", inspected.layout, inspected.leaf)]);
    rows.push(row![
        "margins",
        format!(
            "units of {:.3e} nats, within {} nats of the ensemble's",
            inspected.unit,
            scientific(inspected.margin_error.into())
        )
    ]);
    let things = if inspected.predicts.is_some() { "rows" } else { "touches" };
    let Defaults { error_rate, max_touches } = inspected.stopping;
    match inspected.promise {
        None => rows.push(row!["stopping", format!("error rate {}, at most {max_touches} {things}", rate(error_rate))]),
        Some(_) => rows.push(row!["stopping", format!("at most {max_touches} {things}")]),
    }
}

fn guard_lines(rows: &mut Results, guard: &[Limited]) {
    let limited: Vec<&Limited> = guard.iter().filter(|limited| limited.is_limited()).collect();
    rows.push(row![
        "guard",
        format!("{} of {} have limits", limited.len(), counted(guard.len(), "feature", "features"))
    ]);
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
        rows.push(row!["", format!("{feature}: {values}, {missing}{equal}")]);
    }
}

fn promise_lines(rows: &mut Results, promise: &Promised, temperature: f64) {
    rows.push(row![
        "promise",
        format!(
            "at most {} of {} wrong{}, {} sure; {} sequences of {:.1} {}, {} names given, {} wrong, {} undecided",
            rate(promise.error_rate),
            match promise.per {
                "name" => "each name, when it is given,",
                "object" => "the names given to each object",
                _ => "all names given",
            },
            if promise.groups { " in new groups" } else { "" },
            rate(promise.confidence),
            promise.sequences,
            promise.mean,
            if promise.active { "approaches as planned" } else { promise.counted },
            promise.given,
            promise.wrong,
            percent(promise.undecided, 2),
        )
    ]);
    rows.push(row![
        "",
        match promise.counted {
            "rows" => format!("at most {} rows", promise.max_touches),
            _ => format!("for touches with {}, at most {} of them", promise.noise, promise.max_touches),
        }
    ]);
    let margins: Vec<f64> = promise.margins.values().copied().collect();
    let is_one = margins.iter().all(|margin| *margin == margins[0]);
    let margin = |(name, margin): (&String, &f64)| format!("{name} {margin:.2}");
    let margins = match margins.first().filter(|_| is_one) {
        Some(margin) => format!("{margin:.2}"),
        None => promise.margins.iter().map(margin).collect::<Vec<_>>().join(", "),
    };
    rows.push(row!["thresholds", format!("nats ahead of all others: {margins}")]);
    rows.push(row!["posteriors", format!("at a temperature of {temperature:.2}")]);
}

fn strangers_line(rows: &mut Results, test: &Tested) {
    rows.push(row![
        "strangers",
        format!(
            "at most {} of known objects are taken for unknown, {} sure; {} sequences; names after {} touches at the \
             earliest",
            rate(test.promised),
            rate(test.confidence),
            test.sequences,
            test.first_touches
        )
    ]);
}

fn probe_lines(rows: &mut Results, probe: &Probe, touches: &Touches) {
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
    rows.push(row!["probe", text]);
    let Touches { counted, patterns, needs_pose, largest_spread } = touches;
    rows.push(row![
        "touches",
        format!(
            "{counted} ({}){}{}",
            patterns.join(", "),
            if *needs_pose { ", with a pose" } else { "" },
            largest_spread.map_or(String::new(), |spread| format!(", within {:.3} s", f64::from(spread) / 1e6))
        )
    ]);
}

/// Its training, and its plan.
fn training_lines(rows: &mut Results, inspected: &Inspected<'_>) {
    if let Some(Noise { least, largest, timer, pose_degrees }) = &inspected.noise {
        let ms = |micros: &u32| f64::from(*micros) / 1e3;
        let text =
            format!("{} to {} ms, a timer of {} ms, {pose_degrees}° of the pose", ms(least), ms(largest), ms(timer));
        rows.push(row!["noise", text]);
    }
    if let Some(pattern) = &inspected.pattern {
        rows.push(row!["approaches", shares(pattern.iter().map(|(name, share)| (name, *share)))]);
    }
    if let Some(PlanOf { rolls, poses, left_out }) = &inspected.plan {
        let rolls = counted(usize::from(*rolls), "roll", "rolls");
        let text = format!("{poses} poses: {DIRECTIONS} directions, {rolls} of the row each; {left_out} never touch");
        rows.push(row!["plan", text]);
    }
}

fn chip_lines(rows: &mut Results, chip: &OnChip) {
    let known = |number: Option<u64>| {
        number.map_or("unknown (f32 leaves, or code for an M4F)".into(), |number| number.to_string())
    };
    let Memory { model_flash, code_flash, ram, stack, .. } = chip.memory;
    rows.push(row!["", ""]);
    rows.push(row!["on a", chip.core.name()]);
    rows.push(row![
        "flash",
        format!("{model_flash} bytes of model, about {code_flash} bytes of code (1300 of them start-up)")
    ]);
    rows.push(row!["RAM", format!("{ram} bytes, estimated (the opened model, and a recognizer of just its objects)")]);
    rows.push(row!["stack", format!("{stack} bytes, estimated")]);
    let [margins, verdict] = [chip.margin_instructions, chip.verdict_instructions].map(known);
    rows.push(row![
        "instructions",
        format!("{margins} to the margins, {verdict} to the verdict (per touch, estimated)")
    ]);
    rows.push(row![
        "worst case",
        format!("{} to the margins, the longest way through all trees, estimated", known(chip.most_instructions))
    ]);
}
