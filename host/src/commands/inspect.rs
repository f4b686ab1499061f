use palpate::Result;
use palpate::compile::CompiledFile;
use palpate::output;
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::{CHECKSUM_LENGTH, HEADER_LENGTH};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Say what is in a compiled model.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate inspect model.palpate
  palpate inspect model.palpate --json")]
pub(crate) struct Arguments {
    /// Model that `palpate export` wrote
    model: PathBuf,
    /// Print it as JSON
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Inspected<'a> {
    version: u16,
    tool_version: &'a str,
    ensemble: String,
    descriptor: &'static str,
    features: usize,
    objects: Vec<&'a str>,
    layout: &'static str,
    leaf: &'static str,
    trees: u32,
    splits: u32,
    leaves: u32,
    bytes: usize,
    bytes_by_part: BTreeMap<&'static str, usize>,
    checksum: String,
    unit: f32,
    margin_error: f32,
    stopping: Defaults,
    probe: Probe,
}

#[derive(serde::Serialize)]
struct Defaults {
    error_rate: f64,
    max_touches: u32,
}

#[derive(serde::Serialize)]
struct Probe {
    spacing: f32,
    speed: f32,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let file = CompiledFile::read(&arguments.model)?;
    let model = file.model()?;
    let inspected = inspect(&model);
    if arguments.json { output::print_json(&inspected) } else { output::print(&text(&inspected)) }
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
        objects: (0..model.object_count()).map(|object| model.object_name(object)).collect(),
        layout: model.layout().name(),
        leaf: model.leaf_type().name(),
        trees: header.trees(),
        splits: header.splits(),
        leaves: header.leaves(),
        bytes: model.bytes().len(),
        bytes_by_part: parts(model),
        checksum: format!("{:08x}", model.checksum()),
        unit: model.unit(),
        margin_error: model.margin_error(),
        stopping: Defaults { error_rate: significant(stopping.error_rate()), max_touches: stopping.max_touches() },
        probe: Probe { spacing: header.spacing(), speed: header.speed() },
    }
}

/// The stored odds hold an error rate to about sixteen digits; nine say what was meant.
fn significant(rate: f64) -> f64 {
    format!("{rate:.8e}").parse().unwrap_or(rate)
}

fn parts(model: &Model<'_>) -> BTreeMap<&'static str, usize> {
    let header = model.header();
    let objects = model.object_count();
    let length = |field: u32| usize::try_from(field).unwrap_or(usize::MAX);
    BTreeMap::from([
        ("header", HEADER_LENGTH),
        ("text", length(header.text_length())),
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

fn text(inspected: &Inspected<'_>) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{name:14} {value}");
    };
    line("format version", format!("{} (palpate {})", inspected.version, inspected.tool_version));
    line("descriptor", format!("{}, {} features", inspected.descriptor, inspected.features));
    line("objects", format!("{}: {}", inspected.objects.len(), inspected.objects.join(", ")));
    line("trees", format!("{}, {} splits, {} leaves", inspected.trees, inspected.splits, inspected.leaves));
    line("layout", format!("{}, {} leaves", inspected.layout, inspected.leaf));
    line(
        "margins",
        format!("units of {:.3e} nats, within {:.2e} nats of the ensemble's", inspected.unit, inspected.margin_error),
    );
    line(
        "stopping",
        format!("error rate {}, at most {} touches", inspected.stopping.error_rate, inspected.stopping.max_touches),
    );
    line("probe", format!("spacing {}, speed {} a second", inspected.probe.spacing, inspected.probe.speed));
    line("bytes", inspected.bytes.to_string());
    for (part, bytes) in &inspected.bytes_by_part {
        line("", format!("{bytes:>9} {}", part.replace('_', " ")));
    }
    line("checksum", inspected.checksum.clone());
    line("ensemble", inspected.ensemble.clone());
    text
}
