use super::expected::{self, ExpectedArguments};
use super::noise::NoiseArguments;
use super::numbers::share;
use super::percent;
use super::probe::ProbeArguments;
use super::progress::Bar;
use crate::error::{Problem, RowsProblem};
use crate::evaluate::model_file::ModelFile;
use crate::evaluate::{
    self, Active, ActiveFacts, Approaches, Candidate, Classes, Evaluation, LEAST_GROUPS, Margins, PromiseCheck,
    Regression, RowsEvaluation, Rule, Settings, Strangers, Switched, evaluate_rows,
};
use crate::output;
use crate::progress::Progress;
use crate::rows::feature_names;
use crate::touches::Dataset;
use crate::touches::noise::Noise;
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Measure how often a model is right, and after how many touches.
#[derive(clap::Args)]
#[command(after_help = "\
The model is a compiled one (model.palpate), evaluated by the code that runs on the chip, or an ensemble (ensemble.json), evaluated in f32. The same seed draws the same groups of touches for both.

Evaluate on touches that the model was not trained on: capture them with another seed. An ensemble knows its training touches again; a compiled model does not.

With --probe, what the file says under [real] is added to the touches, and the data set must have been captured with the probe of the file.

On a data set of approaches, figures are also given per approach: a touch that the model was not trained for, such as one with a missing contact where it knows full touches only, costs an approach and changes nothing.

Without --error-rate a compiled model stops by its own thresholds. If it was calibrated, the figures show whether it keeps what it promises; with noise, priors or objects other than those of the calibration the promise is void, and the figures show by how much it is broken.

With --active, on approaches with pose, each next approach is drawn from those of the same object in the pose that the model's plan proposes, none twice in a sequence. A pose whose approaches are used up is not proposed again in the sequence; where none is left, it ends without a verdict.

With --label the file has rows of features for a model that was exported from another library's (CSV): each row is classified alone, and compared with the class in the column, its name or its number from 0; or for a model with one output with the number there.

No accuracy is given after a number of touches that fewer than 200 different groups can be drawn of.

Examples:
  palpate capture builtin -o unseen --touches 2000 --seed 2
  palpate evaluate model.palpate unseen
  palpate evaluate ensemble.json unseen --at 10,30 --json
  palpate evaluate model.palpate unseen --noise 5ms
  palpate evaluate model.palpate unseen --timer 1ms --missed 2% --speed-bias 5%
  palpate evaluate model.palpate unseen --probe probe.toml
  palpate evaluate model.palpate unseen --confusion 20
  palpate evaluate model.palpate unseen --prior fork=0.3,spoon=0.3
  palpate evaluate model.palpate unseen --only bowl,fork,spoon
  palpate evaluate model.palpate unseen --strangers others
  palpate capture builtin -o approaches --approaches --touches 5000 --seed 2
  palpate evaluate model.palpate approaches --error-rate 0.02
  palpate evaluate planned.palpate approaches --active
  palpate evaluate model.palpate approaches --switch
  palpate evaluate model.palpate rows.csv --label kind")]
pub(crate) struct Arguments {
    /// Compiled model or ensemble
    model: PathBuf,
    /// Directory that `palpate capture` filled; with --label a CSV file of rows
    directory: PathBuf,
    /// Column of the rows' classes, or of the numbers that a regression should give
    #[arg(long, value_name = "COLUMN", conflicts_with_all = ["at", "confusion"])]
    label: Option<String>,
    /// Touches of objects that the model does not know, a directory as DIR: say as well how many are found out
    #[arg(long, value_name = "DIR2")]
    strangers: Option<PathBuf>,
    /// Numbers of touches after which to give the accuracy [default: 5,10,20,30,60, as far as the touches go]
    #[arg(long, value_delimiter = ',', value_name = "TOUCHES,…")]
    at: Option<Vec<usize>>,
    /// Groups of touches, and sequences, to draw at random for each object
    #[arg(long, default_value_t = 1000)]
    groups: usize,
    /// Stop touching when the posterior passes one less this, such as 0.05 or 5%, which nothing promises [default: the
    /// model's own thresholds; 1% for an ensemble]
    #[arg(long, value_name = "RATE", value_parser = share)]
    error_rate: Option<f64>,
    /// Give up after this many touches [default: the model's own limit; 200 for an ensemble]
    #[arg(long, value_name = "TOUCHES")]
    max_touches: Option<u32>,
    /// Say as well how often each object was taken for each, after this many touches
    #[arg(long, value_name = "TOUCHES")]
    confusion: Option<usize>,
    /// Seed of the drawing, and of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Make every approach where the model's plan says, instead of one drawn at random (see `palpate plan`)
    #[arg(long)]
    active: bool,
    /// Say as well what an object that is exchanged at a random approach comes to, with and without forgetting: restarting
    /// once recent touches speak by this many nats against the likeliest object
    #[arg(long, value_name = "NATS", num_args = 0..=1, default_missing_value = "5")]
    switch: Option<f32>,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    probe: ProbeArguments,
    #[command(flatten)]
    expected: ExpectedArguments,
    #[command(flatten)]
    noise: NoiseArguments,
}

/// An evaluation, and what was asked for beside it.
#[derive(serde::Serialize)]
struct Evaluated {
    #[serde(flatten)]
    evaluation: Evaluation,
    /// Robots that made the touches in turn, each with its own bias.
    robots: usize,
    /// How many instances the objects have that have several: each group is of touches of one.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    instances: BTreeMap<String, usize>,
    /// Objects whose touches are those that the model was trained on.
    trained_on: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    confusion: Option<Confusion>,
    /// What the plan proposed approaches from, where it did.
    #[serde(skip_serializing_if = "Option::is_none")]
    active: Option<ActiveFacts>,
    /// Sequences in which the object is exchanged.
    #[serde(skip_serializing_if = "Option::is_none")]
    switch: Option<Switched>,
    /// What is said to objects that the model does not know.
    #[serde(skip_serializing_if = "Option::is_none")]
    strangers: Option<Strangers>,
}

/// How often each object was taken for each.
#[derive(serde::Serialize)]
struct Confusion {
    touches: usize,
    /// Rows.
    touched: Vec<String>,
    /// Columns.
    recognized: Vec<String>,
    /// Groups.
    counts: Vec<Vec<usize>>,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let file = ModelFile::load(&arguments.model)?;
    if let Some(label) = &arguments.label {
        return rows(&arguments, &file, label);
    }
    let mut dataset = super::dataset(&arguments.directory)?;
    let trained_on: Vec<String> = match &file {
        ModelFile::Full(ensemble) => ensemble.origin.trained_on(&dataset).into_iter().map(String::from).collect(),
        ModelFile::Compiled(_) => Vec::new(),
    };
    let probe = arguments.probe.read()?;
    arguments.probe.of_dataset(probe.as_ref(), &dataset)?;
    let noise = arguments.noise.over(probe.map_or_else(Noise::default, |file| file.real));
    let robots = evaluate::add_noise(&mut dataset, &noise, arguments.seed)?;
    let progress = Bar::new();
    progress.begin("evaluating", None);
    let unknown = arguments.strangers.as_deref().map(|directory| -> Result<_> {
        let mut dataset = super::checked(Dataset::read_any(directory)?);
        evaluate::add_noise(&mut dataset, &noise, arguments.seed)?;
        Ok((directory, dataset))
    });
    let unknown = unknown.transpose()?;
    let evaluated = file.with(|candidate| {
        let mut margins = Margins::new(candidate, &dataset)?.of_robots(robots);
        let own = match candidate {
            Candidate::Compiled(model) => expected::own_weights(model),
            Candidate::Full(ensemble) => vec![1.0; ensemble.objects.len()],
        };
        if let Some(weights) = arguments.expected.weights(margins.objects(), &own)? {
            margins = margins.expecting(weights)?;
        }
        let at = numbers_of_touches(&margins, arguments.at.as_deref())?;
        let settings = Settings {
            at,
            at_approaches: numbers_of_approaches(&margins, arguments.at.as_deref()),
            groups: arguments.groups,
            error_rate: arguments.error_rate,
            max_touches: arguments.max_touches,
            seed: arguments.seed,
            noise,
        };
        let confusion = arguments.confusion.map(|touches| -> Result<_> {
            Ok(Confusion {
                touches,
                touched: margins.tested_names().to_vec(),
                recognized: margins.objects().to_vec(),
                counts: margins.confusion(touches, arguments.groups, arguments.seed)?,
            })
        });
        let active = arguments.active.then(|| Active::new(&margins, &dataset)).transpose()?;
        let evaluation = match &active {
            Some(active) => evaluate::evaluate_active(&margins, active, &settings)?,
            None => evaluate::evaluate(&margins, &settings)?,
        };
        let switch = arguments.switch.map(|nats| margins.switched(&settings.sequences(), nats)).transpose()?;
        let strangers = unknown.as_ref().map(|(directory, dataset)| {
            let unknown = Margins::of_strangers(candidate, dataset).map_err(|error| error.in_file(directory))?;
            let known = (&margins, &evaluation.sequential);
            evaluate::strangers(known, &unknown.of_robots(robots), &settings.sequences())
        });
        let (confusion, strangers) = (confusion.transpose()?, strangers.transpose()?);
        let (instances, active) = (dataset.instances.clone(), active.map(|active| active.facts()));
        Ok(Evaluated { evaluation, robots, instances, trained_on, confusion, active, switch, strangers })
    })?;
    drop(progress);
    if arguments.json {
        return output::print_json(&evaluated);
    }
    output::print(&text(&evaluated))
}

/// Evaluates a model on labeled rows.
fn rows(arguments: &Arguments, file: &ModelFile, label: &str) -> Result<()> {
    let names = match file {
        ModelFile::Full(ensemble) => ensemble.inputs.names().into_iter().map(String::from).collect(),
        ModelFile::Compiled(compiled) => feature_names(&compiled.model()),
    };
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let rows = super::verify::read_rows(&arguments.directory, &names, Some(label))?;
    let evaluated = file.with(|candidate| evaluate_rows(candidate, &rows)).map_err(|error| match error.problem() {
        Some(Problem::Rows(RowsProblem::Label { .. })) => error.in_file(&arguments.directory),
        _ => error.in_file(&arguments.model),
    })?;
    if arguments.json {
        return output::print_json(&evaluated);
    }
    let RowsEvaluation { rows, classes, regression } = evaluated;
    let mut text = String::new();
    if let Some(Classes { accuracy, accuracy_standard_error, names, confusion, .. }) = classes {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "{rows} rows, each taken alone: {:.1} % right (± {:.1}, a standard error)",
            100.0 * accuracy,
            100.0 * accuracy_standard_error
        );
        text +=
            &confusion_table(&Confusion { touches: 1, touched: names.clone(), recognized: names, counts: confusion });
    }
    if let Some(Regression { mean_absolute_error, root_mean_square_error }) = regression {
        text = format!(
            "{rows} rows: margins are off by {mean_absolute_error:.4} on average, {root_mean_square_error:.4} in the root \
             mean square\n"
        );
    }
    output::print(&text)
}

/// The numbers of touches to give the accuracy after: those asked for, or the usual ones that enough groups can be drawn
/// of.
fn numbers_of_touches(margins: &Margins<'_>, wanted: Option<&[usize]>) -> Result<Vec<usize>> {
    let few = |at: usize| margins.distinct_groups(at) < LEAST_GROUPS;
    let Some(wanted) = wanted else {
        return Ok(Settings::default().at.into_iter().filter(|&at| !few(at)).collect());
    };
    // None at all is said by the evaluation, with the object that has too few touches.
    match wanted.iter().find(|&&at| at > 0 && at <= margins.fewest_touches() && few(at)) {
        Some(&at) => {
            let (groups, touches) = (margins.distinct_groups(at), margins.fewest_touches());
            let allowed = format!(
                "another number, or capture more: of {touches} touches only {groups} different groups of {at} can be drawn, \
                 too few for an accuracy"
            );
            Err(Error::setting("at", at, allowed))
        }
        None => Ok(wanted.to_vec()),
    }
}

/// The numbers of approaches to give the accuracy after: those asked for, or the usual ones, as far as the approaches go.
fn numbers_of_approaches(margins: &Margins<'_>, wanted: Option<&[usize]>) -> Vec<usize> {
    match wanted {
        Some(wanted) => wanted.to_vec(),
        None => {
            let few = |at: &usize| *at <= margins.fewest_approaches();
            Settings::default().at_approaches.into_iter().filter(few).collect()
        }
    }
}

fn text(evaluated: &Evaluated) -> String {
    let mut text = table(&evaluated.evaluation);
    if let Some(approaches) = &evaluated.evaluation.approaches {
        text += &approaches_table(approaches, &evaluated.evaluation.patterns);
    }
    if let Some(promise) = &evaluated.evaluation.promise {
        text += &promise_text(promise);
    }
    if let Some(ActiveFacts { rolls, poses, left_out, without_approaches }) = &evaluated.active {
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "Each approach is in the pose that the plan proposed, of {poses} (26 directions, {rolls} roll{} each; {left_out} \
             never touch, {without_approaches} have no approach here).",
            if *rolls == 1 { "" } else { "s" }
        );
    }
    if evaluated.robots > 1 {
        // Writing to a string cannot fail.
        _ = writeln!(text, "Each group is of touches by one of {} robots, each with its own bias.", evaluated.robots);
    }
    if let Some(most) = evaluated.instances.values().max() {
        _ = writeln!(text, "Objects have up to {most} instances; each group is of touches of one instance.");
    }
    if let Some(confusion) = &evaluated.confusion {
        text += &confusion_table(confusion);
    }
    if let Some(switch) = &evaluated.switch {
        text += &switch_table(switch);
    }
    if let Some(strangers) = &evaluated.strangers {
        text += &strangers_table(strangers);
    }
    if !evaluated.trained_on.is_empty() {
        let objects = evaluated.trained_on.join(", ");
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "\nThe model was trained on these touches of {objects}: on others it is right less often. Capture them with \
             another seed."
        );
    }
    text
}

/// At what recognizers stop.
fn stops(error_rate: f64, promised: Option<f64>) -> String {
    match promised {
        Some(rate) => format!("at a promised error rate of {rate}"),
        None => format!("at an error rate of {error_rate}"),
    }
}

/// What was promised, what was measured, and what makes the promise void.
fn promise_text(check: &PromiseCheck) -> String {
    let of = match (check.per, &check.of) {
        ("name", Some(name)) => format!(" of {name}, the name that is wrong most often,"),
        ("object", Some(name)) => format!(" of the names given to {name}, the object that is mistaken most often,"),
        _ => " of the names given".to_owned(),
    };
    let mut text = format!(
        "\nPromised: at most {} % wrong ({}, {} % sure, from {} sequences). Measured: {:.2} %{of} ± {:.2}.\n",
        percent(check.promised),
        match check.per {
            "name" => "each name, when it is given",
            "object" => "each object",
            _ => "on average",
        },
        percent(check.confidence),
        check.sequences,
        100.0 * check.error,
        100.0 * check.standard_error,
    );
    if !check.void.is_empty() {
        let (by, side) = (100.0 * check.exceeded_by.abs(), if check.exceeded_by > 0.0 { "above" } else { "below" });
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "The promise is void: {}. The error rate is {by:.2} points {side} the promised one.",
            check.void.join("; ")
        );
        if let Some(most) = check.by_theory {
            _ = writeln!(
                text,
                "By theory it is at most {:.1} % with any priors, if posteriors can be believed.",
                100.0 * most
            );
        }
    }
    text
}

/// Accuracies in percent: one row per object, one column per number of touches; then the sequential figures.
fn table(evaluation: &Evaluation) -> String {
    let width = evaluation.per_object.keys().map(|name| name.chars().count()).max().unwrap_or(0).max("touches".len());
    let sequential = &evaluation.sequential;
    let mut text = format!("{:width$}", "touches");
    // Writing to a string cannot fail.
    let cells = |text: &mut String, numbers: &mut dyn Iterator<Item = String>| {
        numbers.for_each(|number| _ = write!(text, " {number:>7}"));
    };
    let percent = |share: &f64| format!("{:.1} %", 100.0 * share);
    cells(&mut text, &mut evaluation.accuracy.keys().map(ToString::to_string));
    _ = writeln!(text, " {:>9} {:>9} {:>9}", "to stop", "wrong", "undecided");
    for (name, accuracy) in &evaluation.per_object {
        _ = write!(text, "{name:width$}");
        cells(&mut text, &mut accuracy.values().map(percent));
        let of = |shares: &BTreeMap<String, f64>| shares.get(name).copied().unwrap_or(f64::NAN);
        _ = writeln!(
            text,
            " {:>9.1} {:>9} {:>9}",
            of(&sequential.per_object),
            percent(&of(&sequential.error_per_object)),
            percent(&of(&sequential.undecided_per_object))
        );
    }
    _ = write!(text, "{:width$}", "all");
    cells(&mut text, &mut evaluation.accuracy.values().map(percent));
    _ = writeln!(
        text,
        " {:>9.1} {:>9} {:>9}",
        sequential.mean_touches,
        percent(&sequential.error),
        percent(&sequential.undecided)
    );
    _ = write!(text, "{:width$}", "±");
    cells(&mut text, &mut evaluation.accuracy_standard_error.values().map(percent));
    _ = writeln!(
        text,
        " {:>9.1} {:>9}",
        sequential.mean_touches_standard_error,
        percent(&sequential.error_standard_error)
    );
    _ = write!(
        text,
        "\nStopping {}: {:.1} touches on average, {:.2} % wrong (± {:.2}), {:.2} % undecided after \
         {}.\n{} groups per object of {} touches in all; ± is a standard error.\n",
        stops(sequential.error_rate, sequential.promised),
        sequential.mean_touches,
        100.0 * sequential.error,
        100.0 * sequential.error_standard_error,
        100.0 * sequential.undecided,
        sequential.max_touches,
        evaluation.groups,
        evaluation.touches,
    );
    text
}

/// What approaches come to: one row per object, one column per number of approaches; then the sequential figures.
fn approaches_table(approaches: &Approaches, patterns: &BTreeMap<&str, f64>) -> String {
    let names = approaches.per_object.keys().map(|name| name.chars().count());
    let width = names.max().unwrap_or(0).max("approaches".len());
    let sequential = &approaches.sequential;
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut text = format!("\n{:width$}", "approaches");
    // Writing to a string cannot fail.
    approaches.accuracy.keys().for_each(|at| _ = write!(text, " {at:>7}"));
    _ = writeln!(text, " {:>9} {:>9} {:>9} {:>9}", "to stop", "wrong", "undecided", "used");
    let mut line = |name: &str, accuracy: Vec<f64>, [stop, wrong, undecided, used]: [f64; 4]| {
        _ = write!(text, "{name:width$}");
        accuracy.into_iter().for_each(|share| _ = write!(text, " {:>7}", percent(share)));
        _ = writeln!(text, " {stop:>9.1} {:>9} {:>9} {:>9}", percent(wrong), percent(undecided), percent(used));
    };
    for (name, accuracy) in &approaches.per_object {
        let of = |shares: &BTreeMap<String, f64>| shares.get(name).copied().unwrap_or(f64::NAN);
        let stopping = [
            of(&sequential.per_object),
            of(&sequential.error_per_object),
            of(&sequential.undecided_per_object),
            of(&approaches.used_per_object),
        ];
        line(name, accuracy.values().copied().collect(), stopping);
    }
    let stopping = [sequential.mean_approaches, sequential.error, sequential.undecided, approaches.used];
    line("all", approaches.accuracy.values().copied().collect(), stopping);
    let shares = patterns.iter().map(|(pattern, share)| format!("{pattern} {}", percent(*share)));
    _ = writeln!(
        text,
        "\nStopping {}: {:.1} approaches on average (± {:.1}), of which {:.1} were evidence, {:.2} % \
         wrong (± {:.2}), {:.2} % undecided.\nFingers that touched: {}.",
        stops(sequential.error_rate, sequential.promised),
        sequential.mean_approaches,
        sequential.mean_approaches_standard_error,
        sequential.mean_touches,
        100.0 * sequential.error,
        100.0 * sequential.error_standard_error,
        100.0 * sequential.undecided,
        shares.collect::<Vec<_>>().join(", "),
    );
    text
}

/// What an exchanged object comes to: one row per rule.
fn switch_table(switch: &Switched) -> String {
    let mut text = format!(
        "\n{:20} {:>22} {:>8} {:>26} {:>8} {:>8}\n",
        "forgetting", "approaches, same object", "wrong", "approaches after exchange", "wrong", "the old"
    );
    for (name, Rule { still, switched, old }) in
        [("off".to_owned(), &switch.off), (format!("at {} nats", switch.nats), &switch.on)]
    {
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);
        // Writing to a string cannot fail.
        _ = writeln!(
            text,
            "{name:20} {:>22.1} {:>8} {:>26.1} {:>8} {:>8}",
            still.mean_approaches,
            percent(still.error),
            switched.mean_approaches,
            percent(switched.error),
            percent(*old)
        );
    }
    text + "Exchanged at a random approach before the verdict; wrong is any name but that of the object touched last.\n"
}

/// What is said to strangers, in percent: one row per object.
fn strangers_table(strangers: &Strangers) -> String {
    let names = strangers.detected_per_object.keys().map(|name| name.chars().count());
    let width = names.max().unwrap_or(0).max("found out by".len());
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut text = format!("\n{:width$}", "found out by");
    // Writing to a string cannot fail.
    strangers.detected.keys().for_each(|at| _ = write!(text, " {at:>8}"));
    _ = writeln!(text, " {:>9}", "named");
    let mut line = |name: &str, detected: &BTreeMap<usize, f64>, named: f64| {
        _ = write!(text, "{name:width$}");
        detected.values().for_each(|share| _ = write!(text, " {:>8}", percent(*share)));
        _ = writeln!(text, " {:>9}", percent(named));
    };
    for (name, detected) in &strangers.detected_per_object {
        line(name, detected, strangers.wrong_name_per_object.get(name).copied().unwrap_or(f64::NAN));
    }
    line("all", &strangers.detected, strangers.wrong_name);
    let (alarms, undecided) = (percent(strangers.false_alarms), percent(strangers.undecided));
    _ = writeln!(
        text,
        "\nObjects that the model does not know: the share found out by each number of touches, and the share that got a name; \
         {undecided} got no verdict.\nOf the objects that it knows, {alarms} were taken for unknown."
    );
    text
}

/// Shares in percent: one row per touched object, one column per object that it was taken for.
fn confusion_table(confusion: &Confusion) -> String {
    let names = confusion.touched.iter().chain(&confusion.recognized);
    let width = names.map(|name| name.chars().count()).max().unwrap_or(0).max("7.1 %".len() + 2);
    let s = if confusion.touches == 1 { "" } else { "es" };
    let mut text = format!("\nTaken for, after {} touch{s}\n{:width$}", confusion.touches, "");
    // Writing to a string cannot fail.
    confusion.recognized.iter().for_each(|name| _ = write!(text, " {name:>width$}"));
    text.push('\n');
    for (name, counts) in confusion.touched.iter().zip(&confusion.counts) {
        let groups = counts.iter().sum::<usize>().max(1) as f64;
        _ = write!(text, "{name:width$}");
        for &count in counts {
            let share = if count == 0 { "–".into() } else { format!("{:.1} %", 100.0 * count as f64 / groups) };
            _ = write!(text, " {share:>width$}");
        }
        text.push('\n');
    }
    text
}
