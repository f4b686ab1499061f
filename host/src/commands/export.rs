use super::expected::PriorArguments;
use super::numbers::share;
use crate::Result;
use crate::compile::{self, Instructions, Layout, Leaf, Settings};
use crate::ensemble::Ensemble;
use crate::output;
use std::path::PathBuf;

/// Compile an ensemble to the bytes that the chip reads.
#[derive(clap::Args)]
#[command(after_help = "\
Leaves:
  i16  two bytes per value: verdicts as the full model's (the default)
  i8   one byte per value: half the size, margins within hundredths of a nat
  f32  four bytes per value, added as the trainer adds them: the same margins

Instructions per touch are estimated, right to 15 %. `palpate inspect MODEL --chip m0+ --mhz 48` says more.

Examples:
  palpate export ensemble.json -o model.palpate
  palpate export ensemble.json -o small.palpate --leaf i8 --layout compact
  palpate export ensemble.json -o strict.palpate --error-rate 0.1%
  palpate export ensemble.json -o kitchen.palpate --prior fork=0.3,spoon=0.3")]
pub(crate) struct Arguments {
    /// Ensemble that `palpate train` saved
    ensemble: PathBuf,
    /// Where to write the model
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// What leaves are stored as
    #[arg(long, value_parser = leaf, default_value = "i16", value_name = "i8|i16|f32")]
    leaf: Leaf,
    /// How trees are laid out; auto weighs size and speed
    #[arg(long, value_parser = layout, default_value = "auto", value_name = "auto|compact|complete|grid|wide|patterns")]
    layout: LayoutChoice,
    /// The error rate, such as 0.05 or 5%, at which recognizers stop unless told otherwise
    #[arg(long, default_value = "0.01", value_name = "RATE", value_parser = share)]
    error_rate: f64,
    /// The touches after which they give up
    #[arg(long, default_value_t = 200, value_name = "N")]
    max_touches: u32,
    /// Print what was exported as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    prior: PriorArguments,
}

#[derive(Clone)]
struct LayoutChoice(Option<Layout>);

#[derive(serde::Serialize)]
struct Exported {
    bytes: usize,
    layout: &'static str,
    leaf: &'static str,
    trees: usize,
    splits: usize,
    leaves: usize,
    margin_error: f32,
    instructions: Instructions,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    output::refuse_input(&arguments.output, [&arguments.ensemble])?;
    let ensemble = Ensemble::load(&arguments.ensemble)?;
    let settings = Settings {
        leaf: arguments.leaf,
        layout: arguments.layout.0,
        error_rate: arguments.error_rate,
        max_touches: arguments.max_touches,
        priors: arguments.prior.of(&ensemble.objects)?,
        ..Settings::default()
    };
    let compiled = compile::compile(&ensemble, &settings).map_err(|error| match error.exit_code() {
        1 => error.in_file(&arguments.ensemble),
        _ => error,
    })?;
    output::write_bytes(&arguments.output, &compiled.bytes)?;
    let exported = Exported {
        bytes: compiled.bytes.len(),
        layout: compiled.layout.name(),
        leaf: settings.leaf.name(),
        trees: ensemble.trees.len(),
        splits: compiled.splits,
        leaves: compiled.leaves,
        margin_error: compiled.margin_error,
        instructions: compiled.instructions,
    };
    if arguments.json {
        return output::print_json_about(&arguments.output, &exported);
    }
    let text = format!(
        "{}: {} bytes, {} trees, {} splits, {} leaves ({}, {}), margins within {:.2e} nats\n\
         Instructions per touch, estimated: {}\n{}",
        arguments.output.display(),
        exported.bytes,
        exported.trees,
        exported.splits,
        exported.leaves,
        exported.layout,
        exported.leaf,
        exported.margin_error,
        instructions(exported.instructions),
        features(exported.layout, exported.leaf),
    );
    output::print_about(&arguments.output, &text)
}

/// The estimates as a text.
pub(super) fn instructions(instructions: Instructions) -> String {
    let m0_plus =
        instructions.m0_plus.map_or_else(|| "unknown (f32 leaves)".into(), |instructions| instructions.to_string());
    format!("{} on a Cortex-M4F, {m0_plus} on a Cortex-M0+", instructions.m4f)
}

/// The line that names the cargo features that a chip needs.
pub(super) fn features(layout: &str, leaf: &str) -> String {
    format!("A chip that reads no other models needs these features of palpate-onboard: {layout}, {leaf}-leaves\n")
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
