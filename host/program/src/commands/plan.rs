//! `palpate calibrate --plan`.

use super::Global;
use super::probe::ProbeArguments;
use super::progress::Bar;
use super::real::RealArguments;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::evaluate::{self, Planned};
use palpate::output;
use palpate::probe::noise::Noise;
use palpate::progress::Progress;
use palpate::wording::{count, counted, decimal};
use palpate_shared::DIRECTIONS;
use std::path::{Path, PathBuf};

#[derive(serde::Serialize)]
struct Written {
    bytes: usize,
    #[serde(flatten)]
    planned: Planned,
}

/// A plan to be made.
pub(super) struct Wanted<'a> {
    /// The model that gets it.
    pub(super) model: &'a PathBuf,
    /// Approaches with pose.
    pub(super) directory: &'a Path,
    pub(super) output: &'a Path,
    /// The number of rolls of the row of fingers for each direction.
    pub(super) rolls: u8,
    pub(super) probe: &'a ProbeArguments,
    pub(super) real: &'a RealArguments,
}

/// Adds a plan to a model.
pub(super) fn run(wanted: &Wanted<'_>, global: &Global) -> Result<()> {
    let Wanted { directory, output: path, .. } = *wanted;
    let inputs = super::files_of(directory);
    output::admit(path, inputs.iter().chain([wanted.model]))?;
    let compiled = CompiledModel::read(wanted.model)?;
    let mut dataset = super::dataset(directory)?.matching(&compiled.names());
    let file = wanted.probe.read()?;
    wanted.probe.of_dataset(file.as_ref(), &dataset)?;
    let noise = wanted.real.over(wanted.probe.noise(file.as_ref(), &dataset, Noise::default())?)?;
    evaluate::add_noise(&mut dataset, &noise, global.seed())?;
    let progress = Bar::new();
    progress.begin("planning", None);
    let planned = evaluate::plan(&compiled.model(), &dataset, wanted.rolls).map_err(|error| match error {
        error if error.exit_code() == 1 => error.in_file(directory),
        _ => error,
    })?;
    drop(progress);
    output::write_bytes(path, &planned.bytes)?;
    let written = Written { bytes: planned.bytes.len(), planned };
    let Written { bytes, planned: Planned { plan_bytes, poses, rolls, left_out, fewest, hardest, .. } } = &written;
    let [first, second] = &hardest.objects;
    let text = format!(
        "{}: {} bytes; {} of them are a plan of {poses} poses: {DIRECTIONS} directions, {} each; {left_out} never touch\n\
         Hardest to distinguish: {first} and {second}, separated by {} in the best pose (1 = fully). Means are of {} approaches \
         or more.\n",
        path.display(),
        count(*bytes),
        count(*plan_bytes),
        counted(usize::from(*rolls), "roll", "rolls"),
        decimal(hardest.separation, 3),
        count(*fewest),
    );
    global.print_about(path, &written, || text)
}
