//! Calibrating on touches that are captured for it.

use super::Limit;
use super::calibrated::Calibrated;
use super::demand::Demand;
use super::draw::{TouchSupply, follow};
use super::model::{Drawn, Material, Settings, calibrate, calibrate_drawn, noise_seed};
use super::temperature::temperature_on_demand;
use crate::capture::{self, Sampler};
use crate::error::Result;
use crate::evaluate::OfTouches;
use crate::mesh::Object;
use crate::probe::scene::Scene;
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches, Origin, Source};
use palpate_onboard::{Model, Refused};
use palpate_shared::Touch;
use std::sync::OnceLock;

/// Samples of each object from which it is estimated how many a sequence takes.
const FIRST: u64 = 2_000;
/// The most samples of an object.
const MOST: usize = 4_000_000;
/// Amount captured, relative to the amount expected to be used.
const SPARE: f64 = 1.15;

/// Touches that were captured to calibrate on, kept for another model: of the same objects, touched in the same way, none is
/// captured twice. Touches of other objects replace what was kept.
#[derive(Debug, Default)]
pub struct Fresh {
    origin: Option<Origin>,
    /// The samples before [`FIRST`].
    first: Vec<ObjectTouches>,
    /// From sample [`FIRST`] on, as far as they were needed.
    rest: Vec<Vec<OnceLock<Touch>>>,
}

impl Fresh {
    /// Forgets what it keeps unless it is of these objects, touched like this. The first samples are there then.
    fn begin(&mut self, objects: &[(&str, &[Scene])], origin: &Origin, progress: &dyn Progress) -> Result<()> {
        let names = self.first.iter().map(|object| object.name.as_str());
        if self.origin.as_ref() == Some(origin) && names.eq(objects.iter().map(|(name, _)| *name)) {
            return Ok(());
        }
        *self = Self::default();
        let touch = |(name, scenes): &(&str, &[Scene])| {
            crate::progress::check(progress)?;
            capture::touches(scenes, name, origin, 0..FIRST)
        };
        self.first = objects.iter().map(touch).collect::<Result<_>>()?;
        self.rest = objects.iter().map(|_| Vec::new()).collect();
        self.origin = Some(origin.clone());
        Ok(())
    }
}

/// Touches of objects to calibrate on, each captured when it is needed.
#[derive(Debug)]
pub struct Captured<'a> {
    /// The first samples of each object, on which nothing is calibrated.
    first: Dataset,
    demands: Vec<Demand<'a>>,
    sources: Vec<Vec<Source>>,
    window: Option<u32>,
}

impl Captured<'_> {
    /// The supplies of the objects' touches; `known` are the objects' indices in the model.
    pub fn supplies(&self, known: &[usize], seed: u64) -> Vec<TouchSupply<'_>> {
        self.demands.iter().zip(known).map(|(demand, &object)| TouchSupply::on_demand(object, demand, seed)).collect()
    }

    /// Captures all of them.
    fn all(self) -> Result<Dataset> {
        let all = |(demand, sources): (&Demand<'_>, &Vec<Source>)| -> Result<ObjectTouches> {
            Ok(ObjectTouches::in_turn(demand.name(), demand.all()?, sources, FIRST).of_stroke(self.window))
        };
        let objects = self.demands.iter().zip(&self.sources).map(all).collect::<Result<_>>()?;
        Ok(Dataset { objects, ..self.first })
    }
}

/// Captures touches of `objects` in memory, as many of each as about `settings.sequences` sequences take, and calibrates
/// on them. `origin` says how objects are touched; its seed must be another than that of the training, and its number of
/// touches does not matter. What is `kept` of an earlier model is not captured again; what of the objects was kept must be
/// of the same meshes.
///
/// # Errors
/// Errors of [`calibrate`] and [`capture::capture`](fn@crate::capture::capture).
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
    let mut captured = fresh(model, &named, origin, settings, kept, progress)?;
    // Where touches are chosen by their poses, or robots differ, all of them must be there.
    if settings.active || settings.noise.has_bias() {
        return calibrate(model, captured.all()?, settings, progress);
    }
    let seed = noise_seed(settings);
    captured.demands.iter_mut().for_each(|demand| demand.add_noise(&settings.noise, seed));
    let material = Material::stated(model, &captured.first, settings)?;
    let drawn = Drawn {
        dataset: &captured.first,
        fewest: captured.demands.iter().map(|demand| demand.len() as u64).min().unwrap_or(0),
        supplies: captured.supplies(&material.known, settings.seed),
    };
    let temperature = || temperature_on_demand(model, &captured.demands, &material.known);
    calibrate_drawn(&material, drawn, None, temperature, progress)
}

/// The touches of objects, by name and instances' scenes, that [`calibrate_fresh`] calibrates on; the first samples, from
/// which it is estimated how many these are, are captured here.
///
/// # Errors
/// Errors of [`calibrate_fresh`].
pub fn fresh<'a>(
    model: &Model<'_>,
    objects: &[(&'a str, &'a [Scene])],
    origin: &'a Origin,
    settings: &Settings,
    kept: &'a mut Fresh,
    progress: &dyn Progress,
) -> Result<Captured<'a>> {
    progress.begin("touching, to calibrate", None);
    kept.begin(objects, origin, progress)?;
    let origin_of_first = Some(Origin { touches: FIRST, ..origin.clone() });
    let first = Dataset { origin: origin_of_first, ..Dataset::new(kept.first.clone()) };
    let means = means(model, &first, settings)?;
    let wanted = settings.sequences as f64 / objects.len().max(1) as f64;
    let counts = means.into_iter().map(|Lengths { longest, pools }| {
        // A few standard errors more, as if lengths were exponentially distributed. Instances get equally many.
        let wanted = wanted / pools as f64;
        let count = SPARE * longest * (wanted + 3.0 * wanted.sqrt()) * pools as f64;
        (count.ceil() as usize).clamp(1, MOST)
    });
    let mut demands = Vec::with_capacity(objects.len());
    for ((&(name, scenes), count), kept) in objects.iter().zip(counts).zip(&mut kept.rest) {
        kept.resize_with(count.max(kept.len()), OnceLock::new);
        let sampler = Sampler::of_instances(scenes, name, origin);
        demands.push(Demand::new(sampler, FIRST, scenes.len(), origin.probe.window(), &kept[..count]));
    }
    let sources = objects.iter().map(|(_, scenes)| capture::numbered(scenes)).collect();
    Ok(Captured { first, demands, sources, window: origin.probe.window() })
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
    let max_touches = settings.limit(model);
    let (_, known) = model.of(dataset)?;
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
        let margin = settings.terms().margin() + super::model::STRICTEST[0];
        let mut supply = [TouchSupply::new(object, &noisy, settings.seed)];
        let limit = Limit { margin, max_touches };
        let found = follow(model, &mut supply, &[usize::MAX], limit, &())?;
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

#[cfg(all(test, feature = "train"))]
mod tests {
    use super::*;
    use crate::compile::{self, CompiledModel, compile};
    use crate::ensemble::train;
    use crate::mesh::{Instance, Mesh};
    use crate::probe::approach::Probe;
    use crate::probe::noise::Noise;
    use crate::with;

    #[test]
    fn what_is_captured_when_it_is_needed_calibrates_as_if_all_had_been_captured_before() {
        let shape = |sides: [f32; 3]| Mesh::globe(8).stretched(sides);
        let of_two = [("flat", 0.2), ("thick", 0.4)]
            .map(|(name, height)| Instance { name: name.into(), mesh: shape([1.0, 1.0, height]) });
        let objects = [
            Object::new("ball", shape([1.0; 3])),
            Object::new("cigar", shape([1.0, 0.3, 0.3])),
            Object::of_instances("disc", of_two.to_vec()).unwrap(),
        ];
        let scenes = |origin: &Origin| capture::scenes(&objects.each_ref(), origin, &()).unwrap();
        for (approaches, stroke) in [(false, None), (true, None), (true, Some(0.5))] {
            let probe = with!(Probe::default(), stroke);
            let origin = Origin { touches: 1_000, approaches, probe, ..Origin::default() };
            let (dataset, _) = capture::in_memory(&objects, &origin.clone().into(), &()).unwrap();
            let settings = train::Settings { rounds: 8, depth: 3, eta: 0.3, ..train::Settings::compact() };
            let ensemble = train::train(&dataset, &settings, &()).unwrap();
            let compiled = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
            let compiled = CompiledModel::from_bytes(compiled).unwrap();
            let model = compiled.model();
            let origin = Origin { seed: 2, ..origin };
            let settings = Settings {
                rate: 0.1,
                sequences: 2_400,
                max_touches: Some(40),
                noise: Noise::switch(),
                ..Settings::default()
            };

            let scenes = scenes(&origin);
            let named: Vec<(&str, &[Scene])> =
                objects.iter().zip(&scenes).map(|(object, scenes)| (object.name.as_str(), scenes.as_slice())).collect();
            let mut kept = Fresh::default();
            let all = fresh(&model, &named, &origin, &settings, &mut kept, &()).unwrap().all().unwrap();
            let captured = |kept: &Fresh| kept.rest.iter().flatten().filter(|touch| touch.get().is_some()).count();
            assert_eq!(captured(&kept), all.len());
            let expected = calibrate(&model, all, &settings, &()).unwrap();

            let mut on_demand = Fresh::default();
            let once = calibrate_fresh(&model, &objects, &origin, &settings, &mut on_demand, &()).unwrap();
            assert_eq!((&once.model, once.sequences), (&expected.model, expected.sequences));
            let needed = captured(&on_demand);
            assert!(needed < captured(&kept), "{needed} of {}", captured(&kept));
            // None is captured again.
            let twice = calibrate_fresh(&model, &objects, &origin, &settings, &mut on_demand, &()).unwrap();
            assert_eq!((&twice.model, captured(&on_demand)), (&expected.model, needed));
        }
    }
}
