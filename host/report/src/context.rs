//! Data that the stages of a report share: objects, touches, folds, and the models of the first fold.

use super::settings::Settings;
use palpate::capture::{self, Sampler};
use palpate::compile;
use palpate::ensemble::Ensemble;
use palpate::ensemble::train;
use palpate::error::Result;
use palpate::in_order::in_order;
use palpate::mesh::Object;
use palpate::probe::scene::Scene;
use palpate::progress::{self, Progress};
use palpate::touches::folds::{self, Split};
use palpate::touches::{Dataset, ObjectTouches, Origin};
use palpate::with;
use palpate_shared::Touch;
use rayon::prelude::*;
use std::cell::OnceCell;
use std::time::Instant;

/// The objects' scenes and names, and what is computed from them once.
pub(super) struct Context<'a> {
    pub(super) settings: &'a Settings,
    pub(super) objects: &'a [Object],
    pub(super) progress: &'a dyn Progress,
    /// Scenes of each object's instances.
    scenes: Vec<Vec<Scene>>,
    captured: OnceCell<Captured>,
    first: OnceCell<Split>,
    models: OnceCell<Models>,
}

/// The touches that folds are made of, and what they took.
pub(super) struct Captured {
    pub(super) data: Dataset,
    /// Approaches tried, for each object.
    pub(super) approaches: Vec<u64>,
    pub(super) seconds: f64,
}

/// The first fold's ensembles.
pub(super) struct Models {
    pub(super) paper: Ensemble,
    pub(super) ours: Ensemble,
    pub(super) noise: Ensemble,
}

/// The noise that the paper's confusion matrices are for, in microseconds.
pub(super) const NOISE: f64 = 5_000.0;

impl<'a> Context<'a> {
    pub(super) fn new(settings: &'a Settings, objects: &'a [Object], progress: &'a dyn Progress) -> Result<Self> {
        let scenes = capture::scenes(&objects.iter().collect::<Vec<_>>(), &settings.capture, progress)?;
        let (captured, first, models) = Default::default();
        Ok(Self { settings, objects, progress, scenes, captured, first, models })
    }

    /// The touches that folds are made of.
    pub(super) fn captured(&self) -> Result<&Captured> {
        get_or_try(&self.captured, || {
            let began = Instant::now();
            let touched = self.touch(self.settings.touches, self.settings.seed)?;
            let (objects, approaches) = touched.into_iter().unzip();
            let origin = Origin {
                touches: self.settings.touches as u64,
                seed: self.settings.seed,
                ..self.settings.capture.clone()
            };
            let data = Dataset { origin: Some(origin), ..Dataset::new(objects) };
            Ok(Captured { data, approaches, seconds: began.elapsed().as_secs_f64() })
        })
    }

    /// `count` full touches of each object, and the approaches that they took.
    pub(super) fn touch(&self, count: usize, seed: u64) -> Result<Vec<(ObjectTouches, u64)>> {
        self.progress.begin("touching", Some((count * self.objects.len()) as u64));
        let origin = Origin { seed, ..self.settings.capture.clone() };
        let one = |(object, scenes): (&Object, &Vec<Scene>)| touch(scenes, &object.name, count, &origin, self.progress);
        self.objects.iter().zip(&self.scenes).map(one).collect()
    }

    /// Fold `fold`.
    pub(super) fn fold(&self, fold: usize) -> Result<Split> {
        folds::fold(&self.captured()?.data, fold, self.settings.folds, self.settings.seed)
    }

    /// The first fold.
    pub(super) fn first(&self) -> Result<&Split> {
        get_or_try(&self.first, || self.fold(0))
    }

    /// The first fold's ensembles.
    pub(super) fn models(&self) -> Result<&Models> {
        get_or_try(&self.models, || {
            let trained = |settings: &train::Settings| self.train(&self.first()?.train, settings);
            Ok(Models {
                paper: trained(&self.paper())?,
                ours: trained(&self.ours())?,
                noise: trained(&self.ours_for_noise())?,
            })
        })
    }

    /// Trains an ensemble; the context's progress is told, and may cancel it.
    pub(super) fn train(&self, data: &Dataset, settings: &train::Settings) -> Result<Ensemble> {
        train::train(data, settings, self.progress)
    }

    /// Stops the stage if the report was cancelled.
    pub(super) fn check(&self) -> Result<()> {
        progress::check(self.progress)
    }

    /// Training settings of the paper's method.
    pub(super) fn paper(&self) -> train::Settings {
        with!(train::Settings::paper(), rounds = self.settings.paper_rounds, seed = self.settings.seed)
    }

    /// Training settings of ours.
    pub(super) fn ours(&self) -> train::Settings {
        with!(train::Settings::compact(), seed = self.settings.seed)
    }

    /// Training settings of ours for noise.
    pub(super) fn ours_for_noise(&self) -> train::Settings {
        with!(self.ours(), noise = self.settings.noise)
    }

    /// The objects, ready to be touched: the scenes of each object's instances.
    pub(super) fn all_scenes(&self) -> &[Vec<Scene>] {
        &self.scenes
    }

    /// The objects' names.
    pub(super) fn names(&self) -> Vec<String> {
        self.objects.iter().map(|object| object.name.clone()).collect()
    }
}

/// Touches between two looks at the progress.
const CHUNK: usize = 1_000;

/// `count` full touches of an object's scenes, and the approaches that they took.
///
/// # Errors
/// If the object cannot be touched with three fingers, or the report was cancelled.
fn touch(
    scenes: &[Scene],
    name: &str,
    count: usize,
    origin: &Origin,
    progress: &dyn Progress,
) -> Result<(ObjectTouches, u64)> {
    let sampler = Sampler::of_instances(scenes, name, origin);
    let chunk = |chunk: usize| -> Result<Vec<(Touch, u64)>> {
        let indices = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
        progress::advance(progress, indices.len() as u64)?;
        indices.map(|index| sampler.sample(index as u64)).collect()
    };
    let chunks = in_order((0..count.div_ceil(CHUNK)).into_par_iter().map(chunk))?;
    let approaches = chunks.iter().flatten().map(|sample| sample.1).sum();
    let touches = chunks.into_iter().flatten().map(|sample| sample.0).collect();
    Ok((ObjectTouches::in_turn(name, touches, &capture::numbered(scenes), 0), approaches))
}

/// The bytes of an ensemble compiled with 16-bit leaves: what the chip would run.
pub(super) fn compiled(ensemble: &Ensemble) -> Result<compile::Compiled> {
    compile::compile(ensemble, &compile::Settings::default())
}

/// Returns the contents of the cell, making them first if it is empty.
pub(super) fn get_or_try<T>(cell: &OnceCell<T>, make: impl FnOnce() -> Result<T>) -> Result<&T> {
    if let Some(value) = cell.get() {
        return Ok(value);
    }
    let value = make()?;
    Ok(cell.get_or_init(|| value))
}

/// The bytes of an ensemble compiled with its leaves in f32: its f32 margins rounded to whole units, which are far finer
/// than any difference that decides, and several times faster to compute than by the trainer's own trees.
pub(super) fn compiled_f32(ensemble: &Ensemble) -> Result<compile::Compiled> {
    compile::compile(ensemble, &with!(compile::Settings::default(), leaf = compile::Leaf::F32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small::meshes;
    use palpate::compile;
    use palpate::evaluate::Margins;

    #[test]
    fn what_a_fold_states_of_objects_with_several_meshes_is_what_fresh_touches_give() {
        let objects = meshes();
        let settings = Settings { touches: 2_000, ..Settings::quick(vec!["meshes".into()], 1) };
        let context = Context::new(&settings, &objects, &()).unwrap();
        let Split { train, test } = context.fold(0).unwrap();
        assert_eq!(test.several().into_values().collect::<Vec<_>>(), [2; 3]);
        let ensemble = context.train(&train, &context.ours()).unwrap();
        let fresh = context.touch(3_000, 9).unwrap().into_iter().map(|(object, _)| object).collect();
        let compiled = compile::exact(&ensemble).unwrap();
        let model = compiled.model();
        let accuracy = |dataset: &Dataset| {
            let margins = Margins::new(&model, dataset).unwrap();
            margins.curve(10, 500, 1).unwrap().accuracy(10).value
        };
        let (stated, measured) = (accuracy(&test), accuracy(&Dataset::new(fresh)));
        // Groups of ten that share no touch.
        let cases = test.len() as f64 / 10.0;
        let error = (measured * (1.0 - measured)).max(1.0 / cases).sqrt() / cases.sqrt();
        assert!((stated - measured).abs() <= 3.0 * error, "{stated} stated, {measured} measured");
    }
}
