use super::probe::SizeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use super::{Global, shell};
use crate::run;
use palpate::Result;
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use palpate::wording::count;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate run                      ten built-in objects; results in out/
  palpate run meshes/ -o mine      your own meshes
  palpate run --touches 2000       a quick look
  palpate run --real noise=0..5ms,timer=1ms
                                   trained and tested with a real switch
  palpate run meshes/ --true-size mm --probe probe.toml
                                   objects of true size, and your probe
  palpate run --json | jq .ours.accuracy

Three methods are trained and compared: the published one, on the times of full touches; ours on full touches; and ours on every approach with a contact, which is the model to use: model.palpate. Models promise an error rate of 1 %.

Touches are disturbed as by a usual switch that is polled every millisecond, unless --real or the probe file says otherwise; --real none adds nothing. docs/reference/options.md lists the files that are written.")]
pub(crate) struct Arguments {
    /// Objects: `builtin` or built-in objects' names, meshes (OBJ, STL, PLY, glTF, COLLADA), directories of them
    #[arg(value_name = "SOURCE", default_value = "builtin")]
    sources: Vec<String>,
    /// Output; a directory for the results
    #[arg(short, long, value_name = "PATH", default_value = "out")]
    output: PathBuf,
    /// Touches of each object; a tenth of them to test on
    #[arg(long, value_name = "N", default_value = "21000", value_parser = touches)]
    touches: u64,
    /// Approaches to each object; all of them kept, a tenth to test on [default: three per touch]
    #[arg(long, value_name = "N", value_parser = touches)]
    approaches: Option<u64>,
    #[command(flatten)]
    size: SizeArguments,
    #[command(flatten)]
    real: RealArguments,
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    output::refuse_stdout(&arguments.output)?;
    let Arguments { sources, output: out, touches, approaches, size, real } = arguments;
    let (seed, json) = (global.seed(), global.json);
    let approaches = approaches.unwrap_or_else(|| touches.saturating_mul(3));
    let stated = size.probe.read()?.map(|file| file.real);
    let origin = size.origin(Origin { touches, seed, ..Origin::default() })?;
    super::probe::refuse_unstated(&size)?;
    let objects = size.touchable(size.objects(&sources, seed)?, &origin)?;
    if !json {
        // At once: the capture takes a while.
        output::print(&format!(
            "Touching {} objects {} times each with all three fingers, approaching each {} times more, then training, \
             compiling and testing three methods. Results in {}\n",
            objects.len(),
            count(touches),
            count(approaches),
            out.display()
        ))?;
    }
    let settings = run::Settings {
        capture: origin.into(),
        approaches,
        replace: global.force,
        command: shell::typed(),
        noise: real
            .over(stated.filter(|real| !real.is_none()).unwrap_or_else(Noise::switch))
            .map_err(|error| size.probe.named(error))?,
        sources: sources.clone(),
        // As many as 21,000 touches are worth it for; enough to promise anything at least.
        sequences: usize::try_from(touches / 2).unwrap_or(usize::MAX).clamp(300, run::Settings::default().sequences),
        ..run::Settings::default()
    };
    let summary = run::run(&objects, &settings, &out, &Bar::new())?;
    if json { output::print_json(&summary) } else { output::print(&run::text(&summary, &out)) }
}

/// Fewest touches that can be divided and trained on.
fn touches(text: &str) -> Result<u64, String> {
    match super::numbers::count(text)? {
        count if count < 100 => Err("give 100 or more".to_owned()),
        count => Ok(count),
    }
}
