use super::progress::Bar;
use palpate::Result;
use palpate::output::{print, print_json, refuse_stdout};
use palpate::report::{self, Settings};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate report                         the built-in objects, in about ten minutes
  palpate report --quick -o quick        the same figures from fewer touches, in half a minute
  palpate report meshes/ -o report       your own OBJ files
  palpate report --resume                go on where an interrupted report was")]
pub(crate) struct Arguments {
    /// Where objects come from: `builtin` or a built-in object's name, an OBJ file, or a directory of OBJ files
    #[arg(default_value = "builtin", value_name = "SOURCE")]
    sources: Vec<String>,
    /// Where the page, its figures and tables go
    #[arg(short, long, default_value = "report", value_name = "DIR")]
    output: PathBuf,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Fewer folds, levels and touches; the same figures
    #[arg(long)]
    quick: bool,
    /// Take what an interrupted report with the same settings and objects has measured
    #[arg(long)]
    resume: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    let Arguments { sources, output, seed, quick, resume, json } = arguments;
    refuse_stdout(&output)?;
    let settings = if quick { Settings::quick(sources, seed) } else { Settings::full(sources, seed) };
    let written = report::full(&settings, &output, resume, &Bar::new())?;
    if json {
        return print_json(&written.summary);
    }
    let times = written.stages.iter().map(|(name, seconds)| format!("  {name:<18}{seconds:8.1} s\n"));
    let page = output.join("index.html");
    print(&format!("{}\n\n{}\n{}\n", written.sentence, times.collect::<String>(), page.display()))
}
