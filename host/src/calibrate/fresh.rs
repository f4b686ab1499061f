//! Calibrating on touches that are captured for it.

use super::draw::{Supply, Until, follow};
use super::model::{Calibrated, Settings, calibrate};
use crate::capture;
use crate::error::Result;
use crate::evaluate::{Candidate, OfTouches};
use crate::mesh::Object;
use crate::probe::scene::Scene;
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches, Origin, Source};
use palpate_onboard::{Model, Refused, Stopping};

/// Samples of each object from which it is estimated how many a sequence takes.
const FIRST: u64 = 2_000;
/// The most samples of an object.
const MOST: u64 = 4_000_000;
/// Amount captured, relative to the amount expected to be used.
const SPARE: f64 = 1.15;

/// Touches that were captured to calibrate on, kept for another model: of the same objects, touched in the same way, none is
/// captured twice. Touches of other objects replace what was kept.
#[derive(Debug, Default)]
pub struct Fresh {
    origin: Option<Origin>,
    /// From sample [`FIRST`] on.
    objects: Vec<ObjectTouches>,
}

impl Fresh {
    /// The touches kept of these objects, touched like this, in their order.
    fn of(&mut self, objects: &[(&str, &[Scene])], origin: &Origin) -> &mut [ObjectTouches] {
        let names = self.objects.iter().map(|object| object.name.as_str());
        if self.origin.as_ref() != Some(origin) || !names.eq(objects.iter().map(|(name, _)| *name)) {
            self.origin = Some(origin.clone());
            let none = |(name, _): &(&str, &[Scene])| ObjectTouches::new(*name, Vec::new(), Source::Object);
            self.objects = objects.iter().map(none).collect();
        }
        &mut self.objects
    }
}

/// Captures touches of `objects` in memory, as many of each as about `settings.sequences` sequences take, and calibrates
/// on them. `origin` says how objects are touched; its seed must be another than that of the training, and its number of
/// touches does not matter. What is `kept` of an earlier model is not captured again; what of the objects was kept must be
/// of the same meshes.
///
/// # Errors
/// As [`calibrate`] and [`capture::capture`](fn@crate::capture::capture).
pub fn calibrate_fresh(
    model: &Model<'_>,
    objects: &[Object],
    origin: &Origin,
    settings: &Settings,
    kept: &mut Fresh,
    progress: &dyn Progress,
) -> Result<Calibrated> {
    let mut objects: Vec<&Object> = objects.iter().collect();
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    let scenes = capture::scenes(&objects, origin, progress)?;
    let named: Vec<(&str, &[Scene])> =
        objects.iter().zip(&scenes).map(|(object, scenes)| (object.name.as_str(), scenes.as_slice())).collect();
    let dataset = fresh(model, &named, origin, settings, kept, progress)?;
    calibrate(model, dataset, settings, progress)
}

/// The touches of objects, by name and instances' scenes, that [`calibrate_fresh`] calibrates on.
///
/// # Errors
/// As [`calibrate_fresh`].
pub fn fresh(
    model: &Model<'_>,
    objects: &[(&str, &[Scene])],
    origin: &Origin,
    settings: &Settings,
    kept: &mut Fresh,
    progress: &dyn Progress,
) -> Result<Dataset> {
    progress.begin("touching, to calibrate", None);
    let touch = |(name, scenes): &(&str, &[Scene]), samples| -> Result<ObjectTouches> {
        crate::progress::check(progress)?;
        capture::touches(scenes, name, origin, samples)
    };
    let first: Vec<ObjectTouches> = objects.iter().map(|object| touch(object, 0..FIRST)).collect::<Result<_>>()?;
    let dataset = Dataset { origin: Some(Origin { touches: FIRST, ..origin.clone() }), ..Dataset::new(first) };
    let means = means(model, &dataset, settings)?;
    let wanted = settings.sequences as f64 / objects.len().max(1) as f64;
    let counts = means.into_iter().map(|Lengths { longest, pools }| {
        // A few standard errors more, as if lengths were exponentially distributed. Instances get equally many.
        let wanted = wanted / pools as f64;
        let count = SPARE * longest * (wanted + 3.0 * wanted.sqrt()) * pools as f64;
        (count.ceil() as u64).clamp(1, MOST)
    });
    let more = objects.iter().zip(counts).zip(kept.of(objects, origin)).map(|((object, count), kept)| {
        let has = kept.len() as u64;
        if has < count {
            kept.append(&touch(object, FIRST + has..FIRST + count)?);
        }
        // As many as there are, if that is fewer than a machine counts.
        let count = usize::try_from(count).unwrap_or(usize::MAX).min(kept.len());
        Ok(kept.select(0..count))
    });
    Ok(Dataset { objects: more.collect::<Result<_>>()?, ..dataset })
}

/// Lengths of the sequences of an object.
struct Lengths {
    /// The samples that a sequence takes on average, of the instance for which it takes the most.
    longest: f64,
    /// The number of instances.
    pools: usize,
}

/// Mean number of samples of each object in a sequence.
fn means(model: &Model<'_>, dataset: &Dataset, settings: &Settings) -> Result<Vec<Lengths>> {
    let max_touches = settings.max_touches.unwrap_or(Stopping::from_model(model).max_touches());
    let (_, known) = Candidate::Compiled(model).of(dataset)?;
    let trained = model.trained_touches();
    let mean = |(touched, &object): (&ObjectTouches, &usize)| -> Result<Lengths> {
        let touches = touched.touches();
        let used = touches.iter().filter(|touch| Refused::check(&trained, touch).is_ok()).count().max(1);
        let to_the_limit = f64::from(max_touches) * touches.len() as f64 / used as f64;
        let pools = touched.sources().len().max(1);
        if settings.noise.has_bias() {
            return Ok(Lengths { longest: to_the_limit, pools });
        }
        let noisy = touched.noisy(&settings.noise, settings.seed, 1);
        let margin = ((1.0 - settings.rate) / settings.rate).ln() + super::model::STRICTEST[0];
        let mut supply = [Supply::new(object, &noisy, settings.seed)];
        let until = Until { margin, max_touches };
        let found = follow(model, &mut supply, &[usize::MAX], until, || |_: &super::Moment<'_>| true, &())?;
        // Sequences are of the instances in turn.
        let mean = |pool: usize| {
            let own = || found.iter().skip(pool).step_by(pools);
            let approaches: f64 = own().map(|sequence| f64::from(sequence.approaches)).sum();
            if own().len() == 0 { to_the_limit } else { approaches / own().len() as f64 }
        };
        Ok(Lengths { longest: (0..pools).map(mean).fold(0.0, f64::max), pools })
    };
    dataset.objects.iter().zip(&known).map(mean).collect()
}
