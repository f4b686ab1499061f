//! Models for a page, where none are given: four methods, trained on the same objects.

use super::{Contender, Expected, Surface, surfaces};
use palpate::calibrate::{self, calibrate_fresh};
use palpate::capture::{capture, touches};
use palpate::compile::{self, CompiledModel, compile};
use palpate::ensemble::train::{self as trainer, Settings};
use palpate::ensemble::{OverTouches, StatedProbe};
use palpate::error::{CalibrateProblem, Error, Result};
use palpate::evaluate::{self, Candidate, Margins, SequentialSettings};
use palpate::in_order::in_order;
use palpate::mesh::Object;
use palpate::probe::noise::Noise;
use palpate::probe::scene::Scene;
use palpate::progress::{self, Progress};
use palpate::touches::{Dataset, ObjectTouches, Origin};
use palpate::with;
use palpate_onboard::Model;
use palpate_shared::Descriptor;
use palpate_shared::format::Counted;
use rayon::prelude::*;

/// Approaches to each object that the expected numbers rest on, and rounds with each.
const TESTED: (u64, usize) = (6_000, 300);
/// Approaches to each object that the plan rests on.
const PLANNED: u64 = 30_000;
/// Sequences that a promise rests on.
const SEQUENCES: usize = 3_000;
/// The promised error rate.
const ERROR_RATE: f64 = 0.01;

/// Training settings of a page's models.
#[derive(Clone, Debug)]
pub struct Training {
    /// Origin of the touches: number of full touches of each object, and the seed.
    pub origin: Origin,
    /// Noise that a real sensor adds: all methods but the published one are trained for it.
    pub noise: Noise,
}

/// Trains, compiles and calibrates the published method (times of full touches), curvature of full touches, curvature of
/// every contact, and oriented on every approach, with a plan. Three approaches are captured for each full touch.
///
/// # Errors
/// Errors of [`capture`](fn@capture), [`train`](fn@trainer::train) and [`compile`](fn@compile).
pub fn train(objects: &[Object], training: &Training, progress: &dyn Progress) -> Result<Vec<Contender>> {
    let Training { origin, noise } = training;
    let scratch = tempfile::tempdir().map_err(|source| Error::io("a folder for touches", "create", source))?;
    let captured = |name: &str, origin: Origin| -> Result<Dataset> {
        let directory = scratch.path().join(name);
        capture(objects, &origin.into(), &directory, progress)?;
        Dataset::read(&directory)
    };
    let approached = |touches, later| Origin {
        touches,
        approaches: true,
        pose: true,
        seed: origin.seed.wrapping_add(later),
        ..origin.clone()
    };
    let full = captured("full", origin.clone())?;
    let approaches = captured("approaches", approached(origin.touches.saturating_mul(3), 1))?;
    let seed = origin.seed;
    let preset = |preset: Settings| with!(preset, seed, probe = Some(StatedProbe::from(origin)));
    let compact = |descriptor, counted, leaf_bits| {
        let counted = Some(counted);
        preset(with!(Settings::compact(), descriptor, counted, leaf_bits = Some(leaf_bits), noise = *noise))
    };
    let methods = [
        (preset(Settings::paper()), &full),
        (compact(Descriptor::Curvature, Counted::Full, 16), &full),
        (compact(Descriptor::Curvature, Counted::Contacts, 16), &approaches),
        (compact(Descriptor::Oriented, Counted::All, 8), &approaches),
    ];
    let mut models = Vec::new();
    for (settings, dataset) in methods {
        let ensemble = trainer::train(dataset, &settings, progress)?;
        progress::check(progress)?;
        let settings = with!(compile::Settings::default(), error_rate = ERROR_RATE);
        let mut bytes = compile(&ensemble, &settings)?.bytes;
        if ensemble.descriptor().is_some_and(Descriptor::needs_pose) {
            let dataset = captured("plan", approached(PLANNED, 4))?;
            progress.begin("planning", None);
            bytes = evaluate::plan(&compile::open(&bytes)?, &dataset, 4)?.bytes;
        }
        let fresh = Origin { approaches: dataset.holds_approaches(), pose: true, ..approached(1, 2) };
        models.push(CompiledModel::from_bytes(promising(bytes, objects, &fresh, noise, progress)?)?);
    }
    expect(models, &surfaces(objects, origin)?, &approached(TESTED.0, 5), noise, progress)
}

/// The model with thresholds that keep the error rate; as it is where no threshold would.
fn promising(
    bytes: Vec<u8>,
    objects: &[Object],
    fresh: &Origin,
    noise: &Noise,
    progress: &dyn Progress,
) -> Result<Vec<u8>> {
    let terms = with!(
        calibrate::Settings::default(),
        rate = ERROR_RATE,
        sequences = SEQUENCES,
        noise = *noise,
        seed = fresh.seed
    );
    match calibrate_fresh(&compile::open(&bytes)?, objects, fresh, &terms, &mut calibrate::Fresh::default(), progress) {
        Ok(calibrated) => Ok(calibrated.model),
        Err(error) if error.problem::<CalibrateProblem>().is_some() => Ok(bytes),
        Err(error) => Err(error),
    }
}

/// The models with what each is expected to cost: measured on approaches to the surfaces of the page, with noise. A model
/// that does not know all of the objects has no expected number.
///
/// # Errors
/// Errors of [`Scene::new`], [`touches`] and [`Margins::new`]; as [`Contender::new`].
pub fn expect(
    models: Vec<CompiledModel>,
    surfaces: &[Surface],
    origin: &Origin,
    noise: &Noise,
    progress: &dyn Progress,
) -> Result<Vec<Contender>> {
    progress.begin("playing", None);
    let origin = Origin { touches: TESTED.0, approaches: true, pose: true, ..origin.clone() };
    let touched = |surface: &Surface| -> Result<ObjectTouches> {
        progress::check(progress)?;
        let scene = [Scene::new(&surface.mesh(), surface.length)?];
        touches(&scene, &surface.name, &origin, 0..TESTED.0)
    };
    let objects = in_order(surfaces.par_iter().map(touched))?;
    let mut dataset = Dataset { origin: Some(origin.clone()), ..Dataset::new(objects) };
    evaluate::add_noise(&mut dataset, noise, origin.seed)?;
    let contender = |model: CompiledModel| {
        let expected = expected(&model.model(), &dataset, origin.seed)?;
        Contender::new(model, expected)
    };
    models.into_iter().map(contender).collect()
}

fn expected(model: &Model<'_>, dataset: &Dataset, seed: u64) -> Result<Option<Expected>> {
    let names = compile::names(model);
    if model.descriptor().is_none() || !dataset.objects.iter().all(|object| names.contains(&object.name)) {
        return Ok(None);
    }
    let margins = Margins::new(Candidate::Compiled(model), dataset)?;
    let settings = SequentialSettings { error_rate: None, max_touches: None, sequences: TESTED.1, seed };
    Ok(Some(Expected::from(&margins.approaches(&[], &settings)?.sequential)))
}
