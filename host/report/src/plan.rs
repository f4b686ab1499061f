//! Where to touch next: approaches at random and under a plan; and the effect of exchanging the object.

use super::approaches::approaches;
use super::context::Context;
use crate::page::axis::{Axis, short_number};
use crate::page::chart::{Chart, Shape};
use crate::page::color;
use crate::page::document::{Figure, Section};
use crate::page::table::{Cell, Records, Table};
use palpate::compile::{self, Leaf, compile};
use palpate::ensemble::train;
use palpate::error::{EvaluateProblem, Result};
use palpate::evaluate::{self, Active, Candidate, Evaluation, Margins, Rule, Sequential, SequentialSettings, Switched};
use palpate::probe::noise::Noise;
use palpate::touches::{Dataset, Origin};
use palpate::wording::{self, list};
use palpate_shared::Descriptor;
use palpate_shared::format::Counted;
use serde::{Deserialize, Serialize};

/// Thresholds: the recognizer stops when the posterior exceeds 1 minus one of these.
const RATES: [f64; 9] = [0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.01, 0.003];
/// The errors at which policies are compared.
const ERRORS: f64 = 0.01;
/// Rolls of the plans that are compared.
const ROLLS: [u8; 3] = [1, 2, 4];
/// Where forgetting is measured, in nats, and the threshold.
const FORGETTING: [f32; 4] = [3.0, 5.0, 8.0, 12.0];
const FORGETTING_RATE: f64 = 0.01;

/// Benefit of planning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Plans {
    /// Approaches to each object in each of three captures.
    count: u64,
    /// At random, then with a plan of each number of rolls that there were enough approaches for.
    policies: Vec<Policy>,
    /// Forgetting at each of [`FORGETTING`].
    switched: Vec<Switched>,
}

/// A policy at every threshold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Policy {
    /// Rolls of the plan; none at random.
    rolls: Option<u8>,
    /// Bytes of the model with its plan.
    bytes: usize,
    /// For each of [`RATES`].
    stopped: Vec<Stopped>,
}

/// The results for one threshold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Stopped {
    approaches: f64,
    approaches_error: f64,
    /// Wrong verdicts and sequences without one.
    error: f64,
    error_error: f64,
    /// Approaches for each object.
    per_object: Vec<f64>,
}

impl Policy {
    fn name(&self) -> String {
        match self.rolls {
            None => "at random".into(),
            Some(1) => "planned, direction".into(),
            Some(rolls) => format!("planned, direction and {rolls} rolls"),
        }
    }

    /// A figure where errors pass [`ERRORS`], between the two thresholds about it.
    fn at_errors(&self, of: impl Fn(&Stopped) -> f64) -> Option<f64> {
        let pairs = self.stopped.windows(2);
        let (loose, strict) = pairs
            .filter_map(|pair| Some((pair.first()?, pair.get(1)?)))
            .find(|(loose, strict)| loose.error > ERRORS && strict.error <= ERRORS)?;
        let part = (loose.error - ERRORS) / (loose.error - strict.error);
        Some(of(loose) + part * (of(strict) - of(loose)))
    }
}

/// Trains on approaches with pose, plans on others, and tests on a third lot.
pub(super) fn measure(context: &Context) -> Result<Plans> {
    let settings = context.settings;
    let origin = Origin { approaches: true, pose: true, ..settings.capture.clone() };
    let [training, test] = approaches(context, context.all_scenes(), &origin)?;
    let other = Origin { seed: origin.seed.wrapping_add(0x91_a2), ..origin };
    let [fresh, _] = approaches(context, context.all_scenes(), &other)?;
    let recipe = train::Settings {
        descriptor: Descriptor::Oriented,
        counted: Some(Counted::All),
        leaf_bits: Some(8),
        ..context.ours()
    };
    let ensemble = context.train(&training, &recipe)?;
    let compiled = compile(&ensemble, &compile::Settings { leaf: Leaf::I8, ..compile::Settings::default() })?;
    let model = compile::open(&compiled.bytes)?;
    let mut policies = vec![Policy {
        rolls: None,
        bytes: compiled.bytes.len(),
        stopped: at_rates(context, &compiled.bytes, &test, false)?,
    }];
    for rolls in ROLLS {
        let planned = match evaluate::plan(&model, &fresh, rolls) {
            Err(error) if matches!(error.problem(), Some(EvaluateProblem::FewInPose { .. })) => continue,
            planned => planned?,
        };
        policies.push(Policy {
            rolls: Some(rolls),
            bytes: planned.bytes.len(),
            stopped: at_rates(context, &planned.bytes, &test, true)?,
        });
    }
    let margins = Margins::new(Candidate::Compiled(&model), &test)?;
    let sequences = SequentialSettings {
        error_rate: Some(FORGETTING_RATE),
        max_touches: None,
        sequences: count(context),
        seed: settings.seed,
    };
    let switched = FORGETTING.iter().map(|&nats| margins.switched(&sequences, nats)).collect::<Result<_>>()?;
    Ok(Plans { count: settings.approaches, policies, switched })
}

/// Sequences of each object.
fn count(context: &Context) -> usize {
    if context.settings.quick { 300 } else { 2_000 }
}

fn at_rates(context: &Context, bytes: &[u8], test: &Dataset, active: bool) -> Result<Vec<Stopped>> {
    let model = compile::open(bytes)?;
    let margins = Margins::new(Candidate::Compiled(&model), test)?;
    let active = active.then(|| Active::new(&margins, test)).transpose()?;
    let at = |error_rate| -> Result<Stopped> {
        context.check()?;
        let settings = evaluate::Settings {
            at: Vec::new(),
            at_approaches: Vec::new(),
            groups: count(context),
            error_rate: Some(error_rate),
            max_touches: None,
            seed: context.settings.seed,
            noise: Noise::default(),
        };
        let measured: Evaluation = match &active {
            Some(active) => evaluate::evaluate_active(&margins, active, &settings)?,
            None => evaluate::evaluate(&margins, &settings)?,
        };
        let sequential: Sequential = measured.approaches.ok_or(EvaluateProblem::NoApproaches)?.sequential;
        Ok(Stopped {
            approaches: sequential.mean().value,
            approaches_error: sequential.mean().standard_error,
            error: sequential.error + sequential.undecided,
            error_error: sequential.error_standard_error,
            per_object: sequential.per_object.values().copied().collect(),
        })
    };
    RATES.into_iter().map(at).collect()
}

/// The figure and the tables.
pub(super) fn section(context: &Context, plans: &Plans) -> Result<Section> {
    let mut section = Section::new("plan", "Where to touch next");
    section.text(format!(
        "A robot that knows how the object is turned can choose where it comes from. For each direction, and each roll \
         of the row of fingers about it, the plan states how well an approach distinguishes each pair of objects; the \
         next approach is the one that best distinguishes the likeliest object from the others. The model was trained \
         on {} approaches to each object, misses included, and knows the probe's pose; the plan was made from as many \
         others, and both are tested on a third set. Aims are random in every case.",
        wording::count(plans.count)
    ));
    section.figure(figure(context, plans)?);
    section.table(policies(context, plans));
    section.table(objects(context, plans));
    section.text(
        "An object may be exchanged, or slip, while it is being touched. Forgetting restarts the recognizer once \
         recent touches favor another object over the likeliest one by the number of nats in the table.",
    );
    section.table(switched(context, plans));
    Ok(section)
}

fn figure(context: &Context, plans: &Plans) -> Result<Figure> {
    let points = || plans.policies.iter().flat_map(|policy| &policy.stopped);
    let far = points().map(|stopped| stopped.approaches).fold(2.0, f64::max);
    let near = points().map(|stopped| stopped.approaches).fold(far, f64::min);
    let low = points().map(|stopped| stopped.error).filter(|error| *error > 0.0).fold(0.1, f64::min);
    let ticks = [0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005].into_iter();
    let ticks = ticks.filter(|tick| *tick >= low * 0.9).map(|tick| (tick, format!("{} %", short_number(tick * 100.0))));
    let errors = Axis::logarithmic(low * 0.9, 0.6).with_ticks(ticks.collect());
    let approaches = Axis::logarithmic(near * 0.9, far * 1.1);
    let mut chart = Chart::new("approaches", approaches, "errors", errors).sized(660, 420);
    let mut data = Records::new(["policy", "threshold", "approaches", "errors"]);
    let styles = [
        (color::PAPER, Shape::Ring),
        (color::PURPLE, Shape::Triangle),
        (color::GREEN, Shape::Square),
        (color::OURS, Shape::Disc),
    ];
    for (policy, (color, shape)) in plans.policies.iter().zip(styles) {
        let known = policy.stopped.iter().filter(|stopped| stopped.error > 0.0);
        let points: Vec<(f64, f64)> = known.map(|stopped| (stopped.approaches, stopped.error)).collect();
        let label =
            policy.rolls.map_or("random".into(), |rolls| format!("{rolls} roll{}", if rolls == 1 { "" } else { "s" }));
        chart.series(&label, color, shape, &points);
        for (rate, stopped) in RATES.iter().zip(&policy.stopped) {
            data.push([
                policy.name().into(),
                Cell::Number(*rate, 3),
                Cell::Spread(stopped.approaches, stopped.approaches_error, 2),
                Cell::PercentSpread(stopped.error, stopped.error_error, 2),
            ]);
        }
    }
    Ok(Figure {
        id: "plan-errors".into(),
        title: "Errors against approaches, at random and planned".into(),
        caption: "Both axes are logarithmic. Errors include sequences without a verdict.".into(),
        command: context.settings.command.clone(),
        panels: vec![chart.svg()?],
        data,
    })
}

fn policies(context: &Context, plans: &Plans) -> Table {
    let percent = short_number(100.0 * ERRORS);
    let columns =
        ["policy".into(), format!("approaches to {percent} % errors"), "random over this".into(), "bytes".into()];
    let mut data = Records::new(columns);
    let random = plans.policies.first().and_then(|policy| policy.at_errors(|stopped| stopped.approaches));
    for policy in &plans.policies {
        let approaches = policy.at_errors(|stopped| stopped.approaches);
        let ratio = random.zip(approaches).map(|(random, approaches)| random / approaches);
        data.push([
            policy.name().into(),
            approaches.map_or(Cell::Missing, |approaches| Cell::Number(approaches, 2)),
            ratio.map_or(Cell::Missing, |ratio| Cell::Number(ratio, 2)),
            Cell::count(policy.bytes),
        ]);
    }
    Table {
        id: "plan-policies".into(),
        title: "Approaches at random and planned".into(),
        caption: format!(
            "At thresholds where {percent} % of the sequences are measured to be wrong or undecided.{}",
            left_out(plans)
        ),
        command: context.settings.command.clone(),
        data,
    }
}

/// The plans for which there were too few approaches in a pose; nothing if there were enough for all.
fn left_out(plans: &Plans) -> String {
    let is_there = |rolls: &u8| plans.policies.iter().any(|policy| policy.rolls == Some(*rolls));
    let missing: Vec<String> =
        ROLLS.into_iter().filter(|rolls| !is_there(rolls)).map(|rolls| rolls.to_string()).collect();
    match missing.is_empty() {
        true => String::new(),
        false => format!(" Left out, for too few approaches in a pose: plans of {} rolls.", list(&missing)),
    }
}

fn objects(context: &Context, plans: &Plans) -> Table {
    let columns = std::iter::once("object".to_owned()).chain(plans.policies.iter().map(Policy::name));
    let mut data = Records::new(columns);
    for (index, name) in context.names().into_iter().enumerate() {
        let of = |policy: &Policy| policy.at_errors(|stopped| stopped.per_object.get(index).copied().unwrap_or(0.0));
        let cells = plans.policies.iter().map(|policy| of(policy).map_or(Cell::Missing, |mean| Cell::Number(mean, 1)));
        data.push(std::iter::once(name.into()).chain(cells));
    }
    Table {
        id: "plan-objects".into(),
        title: "Approaches to each object".into(),
        caption: format!(
            "At the threshold where {} % of all sequences are wrong or undecided.",
            short_number(100.0 * ERRORS)
        ),
        command: context.settings.command.clone(),
        data,
    }
}

fn switched(context: &Context, plans: &Plans) -> Table {
    let mut data = Records::new([
        "forgetting",
        "approaches, same object",
        "wrong",
        "approaches after the exchange",
        "wrong",
        "of these, the object before",
    ]);
    let mut row = |name: String, rule: &Rule| {
        let (still, after) = (&rule.still, &rule.switched);
        data.push([
            name.into(),
            Cell::Spread(still.mean_approaches, still.mean_approaches_standard_error, 1),
            Cell::Percent(still.error, 2),
            Cell::Spread(after.mean_approaches, after.mean_approaches_standard_error, 1),
            Cell::Percent(after.error, 2),
            Cell::Percent(rule.old, 2),
        ]);
    };
    if let Some(first) = plans.switched.first() {
        row("off".into(), &first.off);
    }
    plans.switched.iter().for_each(|switched| row(format!("at {} nats", switched.nats), &switched.on));
    Table {
        id: "plan-switch".into(),
        title: "An object that is exchanged".into(),
        caption: format!(
            "Random approaches, threshold {FORGETTING_RATE}. The object is exchanged after a random one of the approaches \
             before the verdict; then the new one is right."
        ),
        command: context.settings.command.clone(),
        data,
    }
}
