use super::chips::{features, instructions};
use super::expected::PriorArguments;
use super::numbers::share;
use crate::Result;
use crate::compile::{self, Candidate, Goal, Instructions, Language, Layout, Leaf, Settings};
use crate::ensemble::{Ensemble, Inputs};
use crate::error::Error;
use crate::output;
use crate::rows::scales::{self, Effect};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Compile an ensemble to the bytes that the chip reads.
#[derive(clap::Args)]
#[command(after_help = "\
ENSEMBLE is what `palpate train` saved, or a model of another library over features of any kind: XGBoost's JSON or UBJSON, LightGBM's text, CatBoost's JSON, or ONNX (scikit-learn through skl2onnx). Its content says which. `palpate verify` compares the model with it, and with the library.

Leaves:
  i16  two bytes per value: verdicts as the full model's
  i8   one byte per value: half the size, margins within hundredths of a nat
  f32  four bytes per value, added as the trainer adds them: the same margins

Layouts: without --layout all that fit are tried, and --for decides. `balanced` takes the fastest on a Cortex-M4F of those that have at most three times the bytes of the smallest, `m4f` and `m0+` the same for that processor, `speed` the fastest of all, and `size` the smallest. But none that rounds leaves is taken where another does not.

Shared leaves: where many leaves are equal, as in forests, each stands once in a table, and a leaf is its number there; margins are the same. It is tried with every layout that walks trees.

Instructions per touch are estimated, right to 15 %. `palpate inspect MODEL --chip m0+ --mhz 48` says more.

Whole numbers: --scale says in which units a chip without a float unit measures a feature: --scale width=100 for hundredths. A value is its whole number of units, the nearest one; thresholds become whole numbers, too. Values beyond ±(2^31 - 1) units count as that. --fit-scales chooses the scales that hold the values of rows exactly, or to seven digits, as powers of ten.

Examples:
  palpate export ensemble.json -o model.palpate
  palpate export ensemble.json -o small.palpate --leaf i8 --layout compact
  palpate export ensemble.json -o strict.palpate --error-rate 0.1%
  palpate export ensemble.json -o kitchen.palpate --prior fork=0.3,spoon=0.3
  palpate export xgboost.ubj -o model.palpate --names cup,jug,pan --leaf f32
  palpate export lightgbm.txt -o model.palpate --for speed
  palpate export forest.onnx -o model.palpate --scale width=100,height=10
  palpate export ensemble.json -o model.palpate --emit c  # also model.h
  palpate export lightgbm.txt -o model.palpate --emit json
                                                  # also model.json, for XGBoost")]
pub(crate) struct Arguments {
    /// Ensemble that `palpate train` or another library saved
    ensemble: PathBuf,
    /// Where to write the model
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The classes' names, in the order of the labels, or a file with one per line [default: the file's own, or 0, 1, …]
    #[arg(long, value_name = "A,B,…|FILE")]
    names: Option<String>,
    /// What leaves are stored as [default: i16; i8 for touches of more than 50 objects]
    #[arg(long, value_parser = leaf, value_name = "i8|i16|f32")]
    leaf: Option<Leaf>,
    /// How trees are laid out; auto lets --for decide
    #[arg(long, value_parser = layout, default_value = "auto", value_name = "auto|compact|complete|grid|wide|patterns")]
    layout: LayoutChoice,
    /// What the layout is chosen for
    #[arg(
        long = "for",
        value_parser = goal,
        default_value = "balanced",
        value_name = "balanced|speed|size|m4f|m0+",
        conflicts_with = "layout"
    )]
    goal: Goal,
    /// Whether equal leaves stand once, in a table that a leaf is a number of: `auto` where that is smaller, and better
    /// for what --for says
    #[arg(long, value_parser = sharing, default_value = "auto", value_name = "auto|yes|no")]
    shared_leaves: Sharing,
    /// Compare whole numbers: how many units of a feature make up 1
    #[arg(long, value_name = "FEATURE=UNITS,…", value_delimiter = ',', value_parser = scale)]
    scale: Vec<(String, f32)>,
    /// Compare whole numbers, in the units that the values of these rows need (CSV)
    #[arg(long, value_name = "ROWS.csv")]
    fit_scales: Option<PathBuf>,
    /// The error rate, such as 0.05 or 5%, at which recognizers stop unless told otherwise
    #[arg(long, default_value = "0.01", value_name = "RATE", value_parser = share)]
    error_rate: f64,
    /// The touches after which they give up
    #[arg(long, default_value_t = 200, value_name = "N")]
    max_touches: u32,
    /// Write beside it, too: an array in FILE.h with palpate.h to read it, or in FILE.rs; the trees in FILE.json, as
    /// XGBoost's JSON
    #[arg(long, value_name = "c|rust|json,…", value_delimiter = ',', value_parser = emitted)]
    emit: Vec<Emitted>,
    /// Print what was exported as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    prior: PriorArguments,
}

#[derive(Clone)]
struct LayoutChoice(Option<Layout>);

/// Whether leaves are shared; `None` leaves it open.
#[derive(Clone)]
struct Sharing(Option<bool>);

/// What is written beside the model.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Emitted {
    /// The compiled model as source code.
    Source(Language),
    /// The ensemble that it was compiled from.
    Ensemble,
}

impl Emitted {
    const fn extension(self) -> &'static str {
        match self {
            Self::Source(language) => language.extension(),
            Self::Ensemble => "json",
        }
    }
}

#[derive(serde::Serialize)]
struct Exported {
    bytes: usize,
    layout: &'static str,
    leaf: &'static str,
    /// How many different leaves there are, if equal ones stand once.
    #[serde(skip_serializing_if = "Option::is_none")]
    shared_leaves: Option<usize>,
    trees: usize,
    splits: usize,
    leaves: usize,
    margin_error: f32,
    instructions: Instructions,
    /// What the layouts come to that were tried, in the same order every time.
    candidates: Vec<Candidate>,
    /// Features, by name, for a model over rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    features: Option<Vec<String>>,
    classes: Vec<String>,
    /// The kind of file, if another library wrote it.
    #[serde(skip_serializing_if = "Option::is_none")]
    imported: Option<String>,
    /// What a user should know about it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    /// What whole numbers do to each feature.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    scales: Vec<Effect>,
    /// Files with source code.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    sources: Vec<PathBuf>,
    /// The file with the trees as XGBoost's JSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    ensemble: Option<PathBuf>,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    output::refuse_input(
        &arguments.output,
        [Some(&arguments.ensemble), arguments.fit_scales.as_ref()].into_iter().flatten(),
    )?;
    let emitted = places(&arguments)?;
    let names = arguments.names.as_deref().map(names).transpose()?;
    let ensemble = Ensemble::load_named(&arguments.ensemble, names.as_deref())?;
    let scales = scales(&arguments, &ensemble)?;
    let usual = match ensemble.inputs {
        Inputs::Touches(_) => Settings::for_touches(ensemble.objects.len()),
        Inputs::Rows(_) => Settings::default(),
    };
    let settings = Settings {
        leaf: arguments.leaf.unwrap_or(usual.leaf),
        layout: arguments.layout.0,
        goal: arguments.goal,
        shared_leaves: arguments.shared_leaves.0,
        error_rate: arguments.error_rate,
        max_touches: arguments.max_touches,
        scales,
        priors: arguments.prior.of(&ensemble.objects)?,
    };
    let compiled = compile::compile(&ensemble, &settings).map_err(|error| match error.exit_code() {
        1 => error.in_file(&arguments.ensemble),
        _ => error,
    })?;
    output::write_bytes(&arguments.output, &compiled.bytes)?;
    write_emitted(&emitted, &compiled.bytes, &ensemble)?;
    let imported = ensemble.origin.imported.as_ref();
    let exported = Exported {
        bytes: compiled.bytes.len(),
        layout: compiled.layout.name(),
        leaf: settings.leaf.name(),
        shared_leaves: compiled.shared_leaves,
        trees: ensemble.trees.len(),
        splits: compiled.splits,
        leaves: compiled.leaves,
        margin_error: compiled.margin_error,
        instructions: compiled.instructions,
        candidates: compiled.candidates,
        features: match &ensemble.inputs {
            Inputs::Rows(names) => Some(names.clone()),
            Inputs::Touches(_) => None,
        },
        classes: ensemble.objects.clone(),
        imported: imported.map(|imported| imported.kind.clone()),
        notes: imported.map(|imported| imported.notes.clone()).unwrap_or_default(),
        scales: settings.scales.as_ref().map(|scales| scales::effects(&ensemble, scales)).unwrap_or_default(),
        sources: emitted.iter().filter(|(kind, _)| *kind != Emitted::Ensemble).map(|(_, path)| path.clone()).collect(),
        ensemble: emitted.into_iter().find(|(kind, _)| *kind == Emitted::Ensemble).map(|(_, path)| path),
    };
    if arguments.json {
        return output::print_json_about(&arguments.output, &exported);
    }
    output::print_about(&arguments.output, &text(&arguments.output, &exported))
}

/// Where the rest is to be written: beside the model, under its name.
fn places(arguments: &Arguments) -> Result<Vec<(Emitted, PathBuf)>> {
    let (output, mut places) = (&arguments.output, Vec::new());
    for &emitted in &arguments.emit {
        let path = output.with_extension(emitted.extension());
        let taken = path == *output || path.file_name().is_some_and(|name| name == HEADER);
        if output::is_stdout(output) || taken {
            return Err(Error::setting(
                "output",
                output.display(),
                format!(
                    "a file beside which another one can have the extension .{} (but not {HEADER}), for --emit",
                    emitted.extension()
                ),
            ));
        }
        output::refuse_input(&path, [Some(&arguments.ensemble), arguments.fit_scales.as_ref()].into_iter().flatten())?;
        places.push((emitted, path));
    }
    Ok(places)
}

/// The header that reads models in C.
const HEADER: &str = "palpate.h";

fn write_emitted(emitted: &[(Emitted, PathBuf)], bytes: &[u8], ensemble: &Ensemble) -> Result<()> {
    for (emitted, path) in emitted {
        let Emitted::Source(language) = *emitted else {
            ensemble.save(path)?;
            continue;
        };
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        output::write_bytes(path, compile::emit(&compile::open(bytes)?, &name, language).as_bytes())?;
        if language == Language::C {
            output::write_bytes(&path.with_file_name(HEADER), palpate_onboard::C_HEADER.as_bytes())?;
        }
    }
    Ok(())
}

fn emitted(name: &str) -> Result<Emitted, String> {
    if name == "json" {
        return Ok(Emitted::Ensemble);
    }
    let language = Language::ALL.into_iter().find(|language| language.name() == name);
    language.map(Emitted::Source).ok_or_else(|| "use c, rust or json".to_owned())
}

/// Names from the command line: a file's lines, if there is such a file, else what commas separate.
fn names(text: &str) -> Result<Vec<String>> {
    let path = Path::new(text);
    if !path.is_file() {
        return Ok(text.split(',').map(|name| name.trim().to_owned()).collect());
    }
    let text = std::fs::read_to_string(path).map_err(|source| Error::io(path, "read the names", source))?;
    Ok(text.lines().map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect())
}

/// The scale of each feature, if whole numbers are asked for.
fn scales(arguments: &Arguments, ensemble: &Ensemble) -> Result<Option<Vec<f32>>> {
    if arguments.scale.is_empty() && arguments.fit_scales.is_none() {
        return Ok(None);
    }
    let names = ensemble.inputs.names();
    let mut scales = match &arguments.fit_scales {
        Some(path) => scales::fit(ensemble, &super::verify::read_rows(path, &names, None)?),
        None => vec![1.0; names.len()],
    };
    for (name, scale) in &arguments.scale {
        let Some(index) = names.iter().position(|own| own == name) else {
            return Err(Error::setting("scale", format!("{name}={scale}"), format!("a feature: {}", names.join(", "))));
        };
        scales[index] = *scale;
    }
    // A feature that nothing was said about is taken as it is, which only whole thresholds can be.
    for (index, name) in names.iter().enumerate() {
        let is_named = arguments.scale.iter().any(|(own, _)| own == name);
        if let Some(threshold) =
            scales::fraction(ensemble, index).filter(|_| arguments.fit_scales.is_none() && !is_named)
        {
            let allowed = format!("a scale for {name} too, which has the threshold {threshold}, or --fit-scales");
            return Err(Error::setting("scale", "incomplete", allowed));
        }
    }
    Ok(Some(scales))
}

fn text(path: &Path, exported: &Exported) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    if let (Some(kind), Some(features)) = (&exported.imported, &exported.features) {
        _ = writeln!(text, "{kind}: {} features, {}", features.len(), classes(&exported.classes));
    }
    let shared = exported.shared_leaves.map_or(String::new(), |count| format!(", {count} different"));
    _ = writeln!(
        text,
        "{}: {} bytes, {} trees, {} splits, {} leaves ({}, {}{shared}), margins within {:.2e} nats",
        path.display(),
        exported.bytes,
        exported.trees,
        exported.splits,
        exported.leaves,
        exported.layout,
        exported.leaf,
        exported.margin_error,
    );
    if exported.candidates.len() > 1 {
        _ = writeln!(text, "{:16} {:>9} {:>12} {:>12}", "layout", "bytes", "Cortex-M4F", "Cortex-M0+");
        for candidate in &exported.candidates {
            let Candidate { layout, shared_leaves, bytes, instructions, .. } = candidate;
            let m0_plus = instructions.m0_plus.map_or_else(|| "unknown".into(), |number| number.to_string());
            let is_chosen = layout.name() == exported.layout && *shared_leaves == exported.shared_leaves.is_some();
            let mark = if is_chosen { " *" } else { "" };
            let name = format!("{}{}", layout.name(), if *shared_leaves { ", shared" } else { "" });
            _ = writeln!(text, "{name:16} {bytes:>9} {:>12} {m0_plus:>12}{mark}", instructions.m4f);
        }
    }
    _ = writeln!(text, "Instructions per touch, estimated: {}", instructions(exported.instructions));
    for Effect { feature, scale, thresholds, different, largest_step } in &exported.scales {
        _ = writeln!(
            text,
            "{feature}: {scale} units make up 1; of {thresholds} thresholds {different} stay different; a value within \
             {largest_step:e} of one may go the other way"
        );
    }
    for source in &exported.sources {
        _ = writeln!(text, "Source code: {}", source.display());
    }
    if let Some(path) = &exported.ensemble {
        _ = writeln!(text, "The trees, as XGBoost's JSON: {}", path.display());
    }
    for note in &exported.notes {
        _ = writeln!(text, "Note: {note}");
    }
    text + &features(exported.layout, exported.leaf, exported.shared_leaves.is_some())
}

fn classes(names: &[String]) -> String {
    match names {
        [name] => format!("one output ({name}): margins only, no verdicts"),
        _ => format!("{} classes ({})", names.len(), names.join(", ")),
    }
}

fn leaf(name: &str) -> Result<Leaf, String> {
    Leaf::ALL.iter().copied().find(|leaf| leaf.name() == name).ok_or_else(|| "use one of i8, i16, f32".to_owned())
}

fn layout(name: &str) -> Result<LayoutChoice, String> {
    if name == "auto" {
        return Ok(LayoutChoice(None));
    }
    let layout = Layout::ALL.iter().copied().find(|layout| layout.name() == name);
    layout
        .map(|layout| LayoutChoice(Some(layout)))
        .ok_or_else(|| "use one of auto, compact, complete, grid, wide, patterns".to_owned())
}

fn sharing(name: &str) -> Result<Sharing, String> {
    match name {
        "auto" => Ok(Sharing(None)),
        "yes" => Ok(Sharing(Some(true))),
        "no" => Ok(Sharing(Some(false))),
        _ => Err("use one of auto, yes, no".into()),
    }
}

fn goal(name: &str) -> Result<Goal, String> {
    match name {
        "balanced" => Ok(Goal::Balanced(compile::Core::M4F)),
        "speed" => Ok(Goal::Speed),
        "size" => Ok(Goal::Size),
        chip => super::chips::core(chip)
            .map(Goal::Balanced)
            .map_err(|_| "use one of balanced, speed, size, m4f, m0+".to_owned()),
    }
}

fn scale(text: &str) -> Result<(String, f32), String> {
    let (name, scale) = text.rsplit_once('=').ok_or("give FEATURE=UNITS, such as width=100")?;
    match scale.parse::<f32>() {
        Ok(scale) if scale.is_finite() && scale > 0.0 => Ok((name.to_owned(), scale)),
        _ => Err("give a positive number of units, such as width=100".into()),
    }
}
