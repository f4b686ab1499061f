//! `palpate watch`.

use super::kinds::{self, ModelKind};
use super::{Global, shell};
use palpate::Result;
use palpate::output;
use palpate_report::watch;
use std::path::PathBuf;

/// Make a page that shows what a chip at a serial port touches and recognizes.
#[derive(clap::Args)]
#[command(after_help = "\
The chip is at the reader's computer, and the browser has Web Serial; the page needs no program and no network. With MODEL it also loads the model into the chip.

Examples:
  palpate watch -o chip.html
  palpate watch model.palpate -o chip.html")]
pub(crate) struct Arguments {
    /// A compiled model for the page
    model: Option<PathBuf>,
    /// Output; the page
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
}

pub(crate) fn run(Arguments { model, output }: Arguments, global: &Global) -> Result<()> {
    output::admit(&output, &model)?;
    let read = |path: &PathBuf| kinds::compiled(path, ModelKind::Touches, "watch");
    let model = model.as_ref().map(read).transpose()?;
    global.write_page(&output, &watch::page(model.as_ref(), &shell::typed())?)
}
