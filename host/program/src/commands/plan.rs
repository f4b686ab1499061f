//! `palpate calibrate --plan`.

use super::Global;
use super::calibrate::Arguments;
use super::progress::Bar;
use palpate::compile::CompiledModel;
use palpate::evaluate::{self, Planned};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::progress::Progress;
use palpate::{Error, Result};

#[derive(serde::Serialize)]
struct Written {
    bytes: usize,
    #[serde(flatten)]
    planned: Planned,
}

/// Adds a plan with so many rolls of the row of fingers for each direction.
pub(super) fn run(arguments: &Arguments, rolls: u8, global: &Global) -> Result<()> {
    let inputs = super::files_of(&arguments.directory);
    output::refuse_input(&arguments.output, inputs.iter().chain([&arguments.model]))?;
    let compiled = CompiledModel::read(&arguments.model)?;
    let mut dataset = super::dataset(&arguments.directory)?;
    let file = arguments.probe.read()?;
    arguments.probe.of_dataset(file.as_ref(), &dataset)?;
    let noise = arguments.real.over(arguments.probe.noise(file.as_ref(), &dataset, Noise::default())?)?;
    evaluate::add_noise(&mut dataset, &noise, global.seed())?;
    let progress = Bar::new();
    progress.begin("planning", None);
    let planned = evaluate::plan(&compiled.model(), &dataset, rolls).map_err(|error| match error {
        Error::At { .. } if error.exit_code() == 1 => error.in_file(&arguments.directory),
        _ => error,
    })?;
    drop(progress);
    output::write_bytes(&arguments.output, &planned.bytes)?;
    let written = Written { bytes: planned.bytes.len(), planned };
    if global.json {
        return output::print_json_about(&arguments.output, &written);
    }
    let Written { bytes, planned: Planned { plan_bytes, poses, rolls, left_out, fewest, hardest, .. } } = &written;
    let [first, second] = &hardest.objects;
    let text = format!(
        "{}: {bytes} bytes, of which {plan_bytes} are a plan of {poses} poses: 26 directions, {rolls} roll{} each; \
         {left_out} never touch\n\
         Hardest to tell apart: {first} and {second}, by {:.3} of 1 in the best pose. Means are of {fewest} approaches or \
         more.\n",
        arguments.output.display(),
        if *rolls == 1 { "" } else { "s" },
        hardest.separation,
    );
    output::print_about(&arguments.output, &text)
}
