//! `palpate maps view`.

use crate::commands::Global;
use crate::commands::probe::ProbeArguments;
use crate::commands::shape::{self, Touched};
use palpate::Result;
use palpate::output;
use palpate_report::shape as page;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
The page works in any browser, without a network. A second recording is turned and moved onto the first, and their difference is shown.

Examples:
  palpate maps view pot.txt -o pot.html --probe hand.toml
  palpate maps view monday.txt tuesday.txt -o both.html --probe hand.toml")]
pub(super) struct Arguments {
    /// Touches with a position of an object that stood still (TXT); two recordings are compared
    #[arg(required = true, num_args = 1..=2)]
    touches: Vec<PathBuf>,
    /// Output; the page
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    #[command(flatten)]
    probe: ProbeArguments,
}

pub(super) fn run(Arguments { touches, output: to, probe }: Arguments, global: &Global) -> Result<()> {
    output::admit(&to, &touches)?;
    let file = shape::hand(&probe)?;
    let touched = touches.iter().map(|path| shape::read(path, &file)).collect::<Result<Vec<_>>>()?;
    let mut maps: Vec<page::Map> = Vec::new();
    let mut registered = false;
    for Touched { name, touches, shape } in touched {
        let aligned = maps.first().and_then(|first| first.shape.aligned(&touches));
        registered = aligned.is_some();
        maps.push(page::Map { name, shape: aligned.unwrap_or(shape), radius: file.probe.radius });
    }
    output::write_bytes(&to, page::page(&maps, registered).as_bytes())?;
    let text = || format!("{}: open it in a browser\n", to.display());
    global.print_about(&to, &serde_json::json!({ "page": to, "registered": registered }), text)
}
