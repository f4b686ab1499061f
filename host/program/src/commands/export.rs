use super::Global;
use super::chips::{features, instructions};
use super::expected::PriorArguments;
use super::keys::one_of;
use super::numbers::error_rate;
use super::unstated::UnstatedArguments;
use palpate::Result;
use palpate::compile::{self, Compiled, CompiledModel, Instructions, Language, Layout, Leaf, Settings};
use palpate::ensemble::{self, Ensemble, Inputs, TouchOrigin};
use palpate::error::Error;
use palpate::output;
use palpate::rows::scales::{self, Effect, Single};
use palpate::rows::{Rows, notes, warnings};
use palpate::with;
use palpate::wording::count;
use palpate_shared::format::{Link, MAGIC};
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// Compile an ensemble to the bytes that the chip reads.
#[derive(clap::Args)]
#[command(after_help = "\
ENSEMBLE is what `palpate train` saved, or a model of another library: XGBoost's JSON or UBJSON, LightGBM's text, CatBoost's JSON, or ONNX (scikit-learn through skl2onnx).

With --emit c-code or rust-code the trees are code, which is faster and takes more flash (docs/guide/code.md).

Examples:
  palpate export ensemble.json -o model.palpate
  palpate export sure.palpate -o sure.palpate --emit c  # sure.h alone
  palpate export forest.onnx -o forest.palpate --emit c-code")]
pub(crate) struct Arguments {
    /// An ensemble that `palpate train` or another library saved, or a compiled model to be written as source code
    ensemble: PathBuf,
    /// Output; the model
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// The classes' names in order, or a file with one per line [default: the file's own, or 0, 1, …]
    #[arg(long, value_name = "NAME,…")]
    names: Option<String>,
    /// Type of leaves: i8, i16 or f32 [default: i16; i8 for touches of more than 50 objects]
    #[arg(long, value_parser = leaf, value_name = "TYPE")]
    leaf: Option<Leaf>,
    /// Compare whole numbers: width=100 for hundredths, or a CSV file of rows that says which
    #[arg(long, value_name = "SCALES", value_delimiter = ',', value_parser = scale)]
    scale: Vec<Scale>,
    /// The share of wrong names to accept, such as 1%; recognizers stop at it unless told otherwise
    #[arg(long, default_value = "0.01", value_name = "RATE", value_parser = error_rate)]
    error_rate: f64,
    /// Give up after this many touches
    #[arg(long, default_value = "200", value_name = "N")]
    max_touches: u32,
    /// Write beside it: c, rust (source code), c-code, rust-code (trees as code) or json (the trees, as XGBoost's)
    #[arg(long, value_name = "KIND,…", value_delimiter = ',', value_parser = emitted)]
    emit: Vec<Emitted>,
    /// From a regression's margin to its value: identity, logistic, exponential, square or softplus [default: the file's]
    #[arg(long, value_parser = link, value_name = "LINK")]
    link: Option<Link>,
    /// Feature that is a row's number in its sequence, from 1; recognizers count it
    #[arg(long, value_name = "FEATURE")]
    row_number: Option<String>,
    /// Also print the features to build in, and all notes
    #[arg(short, long)]
    verbose: bool,
    #[command(flatten)]
    unstated: UnstatedArguments,
    #[command(flatten)]
    prior: PriorArguments,
}

/// Measure of a feature in whole numbers.
#[derive(Clone)]
enum Scale {
    /// Number of units of this feature that make up 1.
    Units(String, f32),
    /// Scales that the values of these rows need.
    Rows(PathBuf),
}

/// Files written beside the model.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Emitted {
    /// The compiled model as source code.
    Source(Language),
    /// Its trees as code.
    Code(Language),
    /// The ensemble that it was compiled from.
    Ensemble,
}

impl Emitted {
    /// Extension of its file.
    fn extension(self) -> &'static str {
        match self {
            Self::Source(language) | Self::Code(language) => language.extension(),
            Self::Ensemble => "json",
        }
    }
}

#[derive(serde::Serialize)]
struct Exported {
    bytes: usize,
    layout: &'static str,
    leaf: &'static str,
    /// Number of different leaves, if equal ones are stored once.
    #[serde(skip_serializing_if = "Option::is_none")]
    shared_leaves: Option<usize>,
    trees: usize,
    splits: usize,
    leaves: usize,
    margin_error: f32,
    instructions: Instructions,
    /// Features, by name, for a model over rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    features: Option<Vec<String>>,
    classes: Vec<String>,
    /// The prediction of a model over rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    predicts: Option<Predicts>,
    /// Features whose values can send a row another way in f32 than in the library.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    in_f32: Vec<Single>,
    /// The kind of file, if another library wrote it.
    #[serde(skip_serializing_if = "Option::is_none")]
    imported: Option<String>,
    /// Notes after which an option may have to be chosen.
    #[serde(skip)]
    warnings: Vec<String>,
    /// Facts about it that a user should know.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    /// Effects of whole numbers on each feature.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    scales: Vec<Effect>,
    /// Files with source code.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    sources: Vec<PathBuf>,
    /// The file with the trees as XGBoost's JSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    ensemble: Option<PathBuf>,
}

/// Sources written of a compiled model.
#[derive(serde::Serialize)]
struct Sources {
    bytes: usize,
    layout: &'static str,
    leaf: &'static str,
    sources: Vec<PathBuf>,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    if is_compiled(&arguments.ensemble) {
        return emit_compiled(&arguments, global);
    }
    output::admit(&arguments.output, arguments.inputs())?;
    let emitted = places(&arguments)?;
    let outputs = emitted.iter().map(|(_, path)| path).chain([&arguments.output]);
    if let Some(directory) = outputs.into_iter().find(|path| path.is_dir()) {
        return Err(Error::setting("output", directory.display(), "another file: this is a directory"));
    }
    let names = arguments.names.as_deref().map(names).transpose()?;
    let mut ensemble = ensemble::load_with(&arguments.ensemble, &arguments.unstated.options(names.as_deref()))?;
    set_link(&mut ensemble, arguments.link)?;
    let (scales, fitted) = scales(&arguments, &ensemble)?;
    let code = arguments.is_code()?;
    let usual = compile::usual(&ensemble);
    let leaf = arguments.leaf.unwrap_or(usual.leaf);
    let settings = with!(
        usual,
        leaf,
        code,
        error_rate = arguments.error_rate,
        max_touches = arguments.max_touches,
        scales,
        priors = arguments.prior.of(&ensemble.objects, &shares_of(&ensemble)?)?,
        position = arguments.row_number.clone()
    );
    let compiled = compile::compile(&ensemble, &settings).map_err(|error| match error.exit_code() {
        1 => error.in_file(&arguments.ensemble),
        _ => error,
    })?;
    output::write_bytes(&arguments.output, &compiled.bytes)?;
    let written = write_emitted(&emitted, &compiled, &ensemble, &arguments.output)?;
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
        features: match &ensemble.inputs {
            Inputs::Rows(names) => Some(names.clone()),
            Inputs::Computed(_) => None,
        },
        classes: ensemble.objects.clone(),
        predicts: Predicts::of(&ensemble),
        in_f32: if settings.scales.is_some() { Vec::new() } else { scales::singles(&ensemble) },
        imported: imported.map(|imported| imported.kind.clone()),
        warnings: [warnings(&ensemble, settings.scales.as_deref()), compiled.notes.clone()].concat(),
        notes: [notes(&ensemble, settings.scales.as_deref()), compiled.notes.clone()].concat(),
        scales: settings
            .scales
            .as_ref()
            .map(|scales| scales::effects(&ensemble, scales, fitted.as_ref()))
            .unwrap_or_default(),
        sources: written,
        ensemble: emitted.into_iter().find(|(kind, _)| *kind == Emitted::Ensemble).map(|(_, path)| path),
    };
    if global.json {
        return output::print_json_about(&arguments.output, &exported);
    }
    // Trees that are code are built with the model.
    let features = match (arguments.verbose, code) {
        (false, _) => None,
        (true, true) => Some(String::new()),
        (true, false) => Some(features(&compile::open(&compiled.bytes)?)),
    };
    output::print_about(&arguments.output, &text(&arguments.output, &exported, features.as_deref()))
}

impl Arguments {
    /// True if the trees become code.
    fn is_code(&self) -> Result<bool> {
        let is_code = self.emit.iter().any(|emitted| matches!(emitted, Emitted::Code(_)));
        if is_code && self.emit.iter().any(|emitted| matches!(emitted, Emitted::Source(_))) {
            let allowed =
                "c or rust for a model of data, or c-code or rust-code for trees as code, each in a run of its own";
            return Err(Error::setting("emit", "both", allowed));
        }
        Ok(is_code)
    }

    /// The files that are read; the output must not be one of them.
    fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        std::iter::once(&self.ensemble).chain(self.rows())
    }

    /// The rows that scales are fitted to.
    fn rows(&self) -> Option<&PathBuf> {
        self.scale.iter().find_map(|scale| match scale {
            Scale::Rows(path) => Some(path),
            Scale::Units(..) => None,
        })
    }
}

/// True if a file is a compiled model, by its first bytes. Where it cannot be read, whoever reads it as an ensemble says so.
fn is_compiled(path: &Path) -> bool {
    let mut head = [0; MAGIC.len()];
    // A pipe must not lose its first bytes, and is read as an ensemble.
    let file = path.metadata().is_ok_and(|metadata| metadata.is_file()).then(|| File::open(path));
    file.is_some_and(|file| file.and_then(|mut file| file.read_exact(&mut head)).is_ok()) && head == MAGIC
}

/// Writes a compiled model as source code.
fn emit_compiled(arguments: &Arguments, global: &Global) -> Result<()> {
    let model = &arguments.ensemble;
    let compiled = CompiledModel::read(model)?;
    let refuse = |name: &'static str, value: &str| {
        Err(Error::setting(name, value, format!("it with an ensemble: {} is a compiled model", model.display())))
    };
    let usual = Settings::default();
    for (name, is_given) in [
        ("names", arguments.names.is_some()),
        ("leaf", arguments.leaf.is_some()),
        ("scale", !arguments.scale.is_empty()),
        ("row_number", arguments.row_number.is_some()),
        ("error_rate", arguments.error_rate != usual.error_rate),
        ("max_touches", arguments.max_touches != usual.max_touches),
        ("prior", arguments.prior.of(&compiled.names(), &[])?.is_some()),
    ] {
        if is_given {
            return refuse(name, "given");
        }
    }
    if arguments.emit.is_empty() {
        return Err(Error::setting(
            "emit",
            "not given",
            format!("c or rust: {} is a compiled model already", model.display()),
        ));
    }
    if arguments.emit.contains(&Emitted::Ensemble) {
        return refuse("emit", "json");
    }
    if arguments.emit.iter().any(|emitted| matches!(emitted, Emitted::Code(_))) {
        return Err(Error::setting("emit", "code", compile::NO_CODE));
    }
    let emitted = places(arguments)?;
    // The model itself may be what the source code is to stand beside.
    if output::admit(&arguments.output, [model]).is_ok() {
        output::write_bytes(&arguments.output, compiled.bytes())?;
    }
    let name = arguments.output.file_stem().unwrap_or_default().to_string_lossy();
    let source = |(emitted, _): &(Emitted, _)| {
        let Emitted::Source(language) = emitted else { return None };
        Some((language.extension(), compile::emit(&compiled.model(), &name, *language)))
    };
    let files: Vec<_> = emitted.iter().filter_map(source).collect();
    compile::write_sources(&arguments.output, &files)?;
    let written = Sources {
        bytes: compiled.bytes().len(),
        layout: compiled.model().layout().name(),
        leaf: compiled.model().leaf_type().name(),
        sources: emitted.into_iter().map(|(_, path)| path).collect(),
    };
    if global.json {
        return output::print_json_about(&arguments.output, &written);
    }
    let mut text = format!("{}: {} bytes, as it was\n", arguments.output.display(), written.bytes);
    text += &sources(&written.sources);
    if arguments.verbose {
        text += &features(&compiled.model());
    }
    output::print_about(&arguments.output, &text)
}

/// Places of the other files: beside the model, under its name.
fn places(arguments: &Arguments) -> Result<Vec<(Emitted, PathBuf)>> {
    let (output, mut places) = (&arguments.output, Vec::new());
    for &emitted in &arguments.emit {
        let path = output.with_extension(emitted.extension());
        let taken = output::is_stdout(output) || path == *output;
        compile::check_place(output, if taken { Path::new(compile::HEADER) } else { &path })?;
        output::admit(&path, arguments.inputs())?;
        places.push((emitted, path));
    }
    Ok(places)
}

/// Guide to using code.
const GUIDE: &str = "docs/guide/code.md";

fn write_emitted(
    emitted: &[(Emitted, PathBuf)],
    compiled: &Compiled,
    ensemble: &Ensemble,
    output: &Path,
) -> Result<Vec<PathBuf>> {
    let language = |emitted: &Emitted| match emitted {
        Emitted::Source(language) | Emitted::Code(language) => Some(*language),
        Emitted::Ensemble => None,
    };
    let languages: Vec<Language> = emitted.iter().filter_map(|(emitted, _)| language(emitted)).collect();
    for (_, path) in emitted.iter().filter(|(emitted, _)| *emitted == Emitted::Ensemble) {
        ensemble.save(path)?;
    }
    let name = output.file_stem().unwrap_or_default().to_string_lossy();
    compile::write_sources(output, &compiled.sources(&name, &languages)?)
}

fn emitted(name: &str) -> Result<Emitted, String> {
    if name == "json" {
        return Ok(Emitted::Ensemble);
    }
    let language = |name: &str| Language::ALL.into_iter().find(|language| language.name() == name);
    let found = match name.strip_suffix("-code") {
        Some(name) => language(name).map(Emitted::Code),
        None => language(name).map(Emitted::Source),
    };
    found.ok_or_else(|| "use c, rust, c-code, rust-code or json".to_owned())
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

/// The prediction of a model over rows.
#[derive(serde::Serialize)]
struct Predicts {
    /// "class" or "value".
    what: &'static str,
    /// Function from a margin to a value.
    #[serde(skip_serializing_if = "Option::is_none")]
    link: Option<&'static str>,
    /// True if the last of several largest margins names the class.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    last_of_ties: bool,
    /// Number that a margin is divided by before the link.
    #[serde(skip_serializing_if = "Option::is_none")]
    average: Option<u32>,
    /// The least and the largest of the numbers that stand for a missing value, beside NaN.
    #[serde(skip_serializing_if = "Option::is_none")]
    missing: Option<[f32; 2]>,
}

impl Predicts {
    fn of(ensemble: &Ensemble) -> Option<Self> {
        let imported = ensemble.origin.imported.as_ref()?;
        let targets = imported.prediction.targets;
        let is_value = targets || ensemble.objects.len() == 1;
        Some(Self {
            what: match (targets, is_value) {
                (true, _) => "targets",
                (false, true) => "value",
                (false, false) => "class",
            },
            link: is_value.then(|| imported.prediction.link.name()),
            last_of_ties: imported.prediction.last_of_ties,
            average: Some(imported.prediction.average).filter(|average| is_value && *average != 1),
            missing: imported.sentinel,
        })
    }

    fn text(&self) -> String {
        let what = match self.what {
            "targets" => format!("the targets, each {}", formula(self.link, 1, false)),
            _ => formula(self.link, self.average.unwrap_or(1), self.last_of_ties),
        };
        let missing = match self.missing {
            None => String::new(),
            Some([low, high]) if low == high => format!("; {low} stands for a missing value"),
            Some([low, high]) => format!("; {low:e} to {high:e} stands for a missing value"),
        };
        format!("Predicts {what}{missing}\n")
    }
}

/// Prediction of a model over rows: a class if there is no link, otherwise the formula of the link, from a margin to a value.
/// `average` is the number of trees whose mean is predicted.
pub(super) fn formula(link: Option<&str>, average: u32, last_of_ties: bool) -> String {
    let Some(link) = link else {
        let which = if last_of_ties { "last" } else { "first" };
        return format!("the class with the largest margin, of several the {which}");
    };
    let formula = match link {
        "logistic" => "1 / (1 + e^-x)",
        "exponential" => "e^x",
        "square" => "x |x|",
        "softplus" => "ln(1 + e^x)",
        _ if average == 1 => return "the value, which is the margin".into(),
        _ => "x",
    };
    match average {
        1 => format!("the value {formula} of the margin x"),
        _ => format!("the value {formula} of the mean x of the trees, the margin / {average}"),
    }
}

/// Takes another link than the file's, of a regression.
fn set_link(ensemble: &mut Ensemble, link: Option<Link>) -> Result<()> {
    let Some(link) = link else { return Ok(()) };
    let is_value = ensemble.objects.len() == 1 || ensemble.prediction().targets;
    match ensemble.origin.imported.as_mut().filter(|_| is_value) {
        Some(imported) => imported.prediction.link = link,
        None => return Err(Error::setting("link", link.name(), "none: only a regression has one")),
    }
    Ok(())
}

fn link(name: &str) -> Result<Link, String> {
    one_of(name, Link::ALL.iter().map(|link| (link.name(), *link)))
}

/// The share that each output has of its object.
fn shares_of(ensemble: &Ensemble) -> Result<Vec<f64>> {
    let placements = TouchOrigin::of(&ensemble.origin)?.placements;
    Ok(ensemble.objects.iter().map(|output| placements.get(output).copied().unwrap_or(1.0)).collect())
}

/// The scale of each feature, if whole numbers are asked for, and the rows that they were fitted to.
fn scales(arguments: &Arguments, ensemble: &Ensemble) -> Result<(Option<Vec<f32>>, Option<Rows>)> {
    if arguments.scale.is_empty() {
        return Ok((None, None));
    }
    let names = ensemble.inputs.names();
    let files = arguments.scale.iter().filter(|scale| matches!(scale, Scale::Rows(_))).count();
    if files > 1 {
        return Err(Error::setting("scale", format!("{files} files of rows"), "one file of rows"));
    }
    let path = arguments.rows();
    let rows = path.map(|path| super::rows::read_rows(path, ensemble, None)).transpose()?;
    let mut scales = rows.as_ref().map_or_else(|| vec![1.0; names.len()], |rows| scales::fit(ensemble, rows));
    let mut named = Vec::new();
    for scale in &arguments.scale {
        let Scale::Units(name, scale) = scale else { continue };
        let Some(index) = names.iter().position(|own| own == name) else {
            return Err(Error::setting("scale", format!("{name}={scale}"), format!("a feature: {}", names.join(", "))));
        };
        scales[index] = *scale;
        named.push(index);
    }
    // A feature that nothing was said about is taken as it is, which only whole thresholds can be.
    for (index, name) in names.iter().enumerate().filter(|(index, _)| path.is_none() && !named.contains(index)) {
        if let Some(threshold) = scales::fraction(ensemble, index) {
            let allowed = format!("a scale for {name} too, which has the threshold {threshold}, or a file of rows");
            return Err(Error::setting("scale", "incomplete", allowed));
        }
    }
    Ok((Some(scales), rows))
}

/// The model, its cost and its call, and notes that may need another option; with `features`, the features to build in, all there
/// is to know.
fn text(path: &Path, exported: &Exported, features: Option<&str>) -> String {
    let of = if exported.predicts.is_some() { "of the library's" } else { "nats" };
    let each = if exported.features.is_some() { "row" } else { "touch" };
    let shared = exported.shared_leaves.map_or(String::new(), |count| format!(", {count} different"));
    let parts = match features {
        None => String::new(),
        Some(_) => {
            let Exported { splits, leaves, layout, leaf, .. } = exported;
            format!(", {splits} splits, {leaves} leaves ({layout}, {leaf}{shared})")
        }
    };
    let mut text = format!(
        "{}: {} bytes, {} trees{parts}, margins within {:.1e} {of}\nInstructions per {each}, estimated: {}\n",
        path.display(),
        count(exported.bytes),
        exported.trees,
        exported.margin_error,
        instructions(exported.instructions),
    );
    let notes = |notes: &[String]| notes.iter().map(|note| format!("Note: {note}\n")).collect::<String>();
    let Some(features) = features else {
        return text + &call(path, exported) + &notes(&exported.warnings);
    };
    if let (Some(kind), Some(features)) = (&exported.imported, &exported.features) {
        text = format!("{kind}: {} features, {}\n{text}", features.len(), classes(&exported.classes));
    }
    text += &exported.predicts.as_ref().map_or(String::new(), Predicts::text);
    text += &effects(&exported.scales);
    text += &sources(&exported.sources);
    if let Some(path) = &exported.ensemble {
        text += &format!("The trees, as XGBoost's JSON: {}\n", path.display());
    }
    text += &notes(&exported.notes);
    match exported.layout == Layout::Code.name() {
        true => text + &format!("The trees are code, which the model has to be built with; see {GUIDE}\n"),
        false => text + features,
    }
}

/// A line for each file of source code.
fn sources(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| format!("Source code: {}\n", path.display())).collect()
}

/// The call of the model from C, as a line.
fn call(path: &Path, exported: &Exported) -> String {
    let header = exported.sources.iter().find(|source| source.extension().is_some_and(|extension| extension == "h"));
    let name = compile::identifier(&path.file_stem().unwrap_or_default().to_string_lossy());
    let call = match exported.predicts.as_ref().map(|predicts| predicts.what) {
        Some("class") if compile::label_numbers(&exported.classes).is_some() => {
            format!("{name}_labels[{name}_predict(row)]")
        }
        Some("class") => format!("{name}_predict(row)"),
        Some("value") => format!("{name}_value(row)"),
        Some(_) => format!("{name}_values(row, values)"),
        None => format!("{name}_push(&state, times)"),
    };
    match (header, exported.sources.first()) {
        (Some(header), _) => format!("In C: {call} of {}. More: --verbose\n", header.display()),
        (None, Some(source)) => format!("Source code: {}. More: --verbose\n", source.display()),
        (None, None) => "A header for C: --emit c. More: --verbose\n".into(),
    }
}

/// Effects of whole numbers; of features that they hold exactly, only the number.
fn effects(all: &[Effect]) -> String {
    let is_exact = |effect: &&Effect| effect.values_are_whole == Some(true) && effect.different == effect.thresholds;
    let exact: Vec<String> =
        all.iter().filter(is_exact).map(|effect| format!("{} × {}", effect.feature, effect.scale)).collect();
    let exact = match exact.is_empty() {
        true => String::new(),
        false => format!(
            "Whole units hold every value of these rows, and all thresholds stay different: {}\n",
            exact.join(", ")
        ),
    };
    // Those of which thresholds fall together are notes.
    let others = all.iter().filter(|effect| !is_exact(effect) && effect.different == effect.thresholds);
    exact + &others.map(|effect| format!("{effect}\n")).collect::<String>()
}

fn classes(names: &[String]) -> String {
    match names {
        [name] => format!("one output ({name})"),
        _ => format!("{} classes ({})", names.len(), names.join(", ")),
    }
}

fn leaf(name: &str) -> Result<Leaf, String> {
    one_of(name, Leaf::ALL.iter().map(|leaf| (leaf.name(), *leaf)))
}

fn scale(text: &str) -> Result<Scale, String> {
    let Some((name, scale)) = text.rsplit_once('=') else {
        let is_file = text.ends_with(".csv") || Path::new(text).is_file();
        let wanted = || "give FEATURE=UNITS, such as width=100, or a file of rows".to_owned();
        return is_file.then(|| Scale::Rows(text.into())).ok_or_else(wanted);
    };
    match scale.parse::<f32>() {
        Ok(scale) if scale.is_finite() && scale > 0.0 => Ok(Scale::Units(name.to_owned(), scale)),
        _ => Err("give a positive number of units, such as width=100".into()),
    }
}
