//! Fit of a probe to recorded touches: its speed, its fingers' offsets, its noise, the contacts that it misses, its timer,
//! and fingers that bend aside at flat angles.
//!
//! The recorded touches are of objects with known meshes. Each object is touched in the simulator once, many times, with
//! the nominal probe. The distortion of a candidate probe is then applied to the density of the simulated touches, which
//! is cheap. The fit is the candidate under which the recorded touches are likeliest (maximum likelihood with a weak
//! preference for probes with small errors, by Nelder–Mead from several starts). Full and partial touches count, and
//! approaches that touched nothing; if the pose was recorded, each touch is compared with approaches in its pose.
//! Intervals are those of 95 % by profile likelihood (Wilks' theorem), widened empirically, since the tables are simulated
//! and smoothed. They do not cover deviations that the simulation does not know, such as a finger that is
//! bent aside.
//!
//! Only differences of contact times are recorded, so an offset that all three fingers share cannot be found, and changes
//! nothing: offsets are relative to the first finger's.
//!
//! A contact later than the hand's stroke is missing, and counts as such: the likelihood is that of censored times. If the
//! probe states no stroke, it is estimated from the recordings.
//!
//! Presses on a flat plate, with half a turn of the probe after each, say more about offsets than touches of objects: on a
//! plate κ is 0, and the slope changes its sign. They say nothing else: their noise and their misses are their own.
//!
//! ```no_run
//! use palpate::mesh::source;
//! use palpate::touches::Dataset;
//! use palpate::fit::{self, fit};
//!
//! # fn main() -> palpate::Result<()> {
//! let objects = source::objects(&["meshes".into()])?;
//! let recorded = Dataset::read_any("recorded".as_ref())?;
//! let fit = fit(&recorded, &objects, None, &fit::FitSettings::default(), &())?;
//! println!("{}", fit.toml());
//! # Ok(())
//! # }
//! ```

mod advice;
mod candidate;
mod density;
mod late;
mod layer;
mod likelihood;
mod line;
mod observed;
mod outcome;
mod posed;
mod recording;
#[cfg(test)]
mod robots;
mod search;
mod stroke;
#[cfg(all(test, feature = "objects"))]
mod tests;
mod timer;
mod touched;
mod words;
pub use outcome::{Fit, GrazingEstimate};
pub use words::{NOT_TOLD, between, offset, offset_between};

use crate::capture;
use crate::error::{Error, Result, problem};
use crate::mesh::Object;
use crate::probe::noise::Noise;
use crate::probe::scene::Scene;
use crate::progress::{self, Progress};
use crate::touches::{Dataset, Longest, ObjectTouches, Origin};
use crate::with;
use candidate::Hypothesis;
use density::Densities;
use layer::Layer;
use likelihood::{Explained, Plate};
use observed::{FULL, Observed};
use palpate_shared::Touch;
use palpate_shared::format::Counted;
use rayon::prelude::*;
use recording::Recording;
use search::Best;
use stroke::Stroke;
use timer::Timer;
use touched::Touched;

/// Settings of a fit.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FitSettings {
    /// The probe as it should be, the objects' size, and where its approaches aim. How many touches, the seed, the format
    /// and what a real probe adds make no difference.
    pub origin: Origin,
    /// Simulated approaches to each object.
    pub approaches: u64,
    /// Seed of the simulated approaches.
    pub seed: u64,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self { origin: Origin::default(), approaches: 200_000, seed: 1 }
    }
}

/// The fewest recorded touches with two or three contacts from which a probe is fitted.
pub(crate) const MIN_TOUCHES: usize = 20;

/// Recordings and simulated touches, with which a candidate is compared.
struct Evidence<'a> {
    recordings: &'a [Recording<'a>],
    /// Simulated touches of all objects.
    objects: &'a [Densities],
    /// For each recording the index of its object.
    object_of: Vec<usize>,
    plate: Option<Plate>,
    stroke: Stroke,
}

impl Evidence<'_> {
    /// The logarithm of the likelihood of the recordings and of the plate, with how usual the candidate is.
    fn log_likelihood(&self, candidate: &Hypothesis) -> f64 {
        let likelihood = |(recording, object): (&Recording<'_>, &usize)| {
            recording.log_likelihood(&Explained::new(candidate, &self.objects[*object], recording.kept))
        };
        let plate = self.plate.as_ref().map_or(0.0, |plate| plate.log_likelihood(candidate));
        self.recordings.iter().zip(&self.object_of).map(likelihood).sum::<f64>() + plate + candidate.usual()
    }
}

/// Finds the probe that made recorded touches of `objects`, which are matched by their names, and presses on a flat plate
/// if there are any, with a half turn of the probe after each. Where the objects lie on a table, recordings that state their
/// placement are compared with that one, others with all of the object's by their weights; the table is a plate too.
///
/// Equal recordings, objects and settings give equal fits on any number of threads. Cost: half a minute of a
/// processor for ten meshes and 300 recorded approaches to four of them, twice that where touches have poses.
///
/// # Errors
/// A recorded object that is not among the objects; fewer than 20 touches with two or three contacts; recordings that
/// show another stroke than the probe states; errors of [`crate::capture::touches`];
/// [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn fit(
    recorded: &Dataset,
    objects: &[Object],
    plate: Option<&[Touch]>,
    settings: &FitSettings,
    progress: &dyn Progress,
) -> Result<Fit> {
    let scenes = scenes(objects, settings, progress)?;
    check_times(recorded, &scenes, &settings.origin)?;
    let recorded = &recorded.clone().matching(&touched::placements(objects, &scenes));
    // Contacts that are a little later than a stated stroke are missing, as in every model of this probe.
    let delivered = recorded.delivered_by(&settings.origin.probe);
    let recorded = delivered.as_ref();
    let touched = touched::touched(objects, scenes, recorded);
    let object_of = useful(recorded, &touched, plate)?;
    progress.begin("fitting", None);
    let kept = kept(recorded);
    let known: Vec<&Touched> = object_of.iter().map(|&object| &touched[object]).collect();
    let samples = layer::samples(&known, settings);
    let rigid: Vec<Vec<Touch>> = samples.iter().map(|samples| samples.touches(&Noise::default())).collect();
    let rigid: Vec<&[Touch]> = rigid.iter().map(Vec::as_slice).collect();
    let stroke = stroke::stroke(recorded, &rigid, kept, &settings.origin.probe)?;
    let recordings: Vec<Recording<'_>> =
        recorded.objects.iter().map(|object| Recording::without_poses(&object.name, object.touches(), kept)).collect();
    let pressed = plate.map(|touches| Plate::new(touches.iter().map(Observed::of)));
    let layer = layer::layer(&recordings, samples, pressed.as_ref(), stroke, progress)?;
    let simulated = Simulated::new(touched, layer, settings, progress)?;
    let densities = simulated.densities(stroke);
    fit_to(&simulated, &densities, stroke, recorded, plate, settings, progress)
}

/// Refuses recordings whose times are longer than a probe of the nominal speed takes over the largest object.
fn check_times(recorded: &Dataset, scenes: &[Vec<Scene>], origin: &Origin) -> Result<()> {
    let paths = scenes.iter().flatten().map(|scene| {
        let [low, high] = scene.bounds();
        (high - low).length() + 2.0 * origin.clearance([low, high])
    });
    let (speed, seconds) = (origin.probe.speed, paths.fold(0.0, f64::max) / origin.probe.speed);
    let longest = Longest::of_scale("the simulation", seconds, speed, origin.unit);
    recorded.objects.iter().try_for_each(|object| object.check_times(&longest))
}

/// The object or placement of each recording, if there are enough touches.
fn useful(recorded: &Dataset, touched: &[Touched], plate: Option<&[Touch]>) -> Result<Vec<usize>> {
    let place = |object: &ObjectTouches| place(&object.name, touched.iter().map(|touched| touched.name.as_str()));
    let object_of: Vec<usize> = recorded.objects.iter().map(place).collect::<Result<_>>()?;
    let useful = |touch: &&Touch| Observed::of(touch).contacts() >= 2;
    let found = recorded.touches().chain(plate.into_iter().flatten()).filter(useful).count();
    if found < MIN_TOUCHES {
        let few = problem!(
            "only {found} recorded touches with two or three contacts, and a fit needs at least {MIN_TOUCHES}"
        );
        return Err(few
            .fix("Record a few hundred approaches to objects whose meshes you have; 60 presses on a plate help too."));
    }
    Ok(object_of)
}

/// Like [`fit`], to simulated touches and their densities.
fn fit_to(
    simulated: &Simulated,
    objects: &[Densities],
    stroke: Stroke,
    recorded: &Dataset,
    plate: Option<&[Touch]>,
    settings: &FitSettings,
    progress: &dyn Progress,
) -> Result<Fit> {
    let Simulated { touched, layer, .. } = simulated;
    let place = |recording: &ObjectTouches| place(&recording.name, objects.iter().map(|object| object.name.as_str()));
    let object_of: Vec<usize> = recorded.objects.iter().map(place).collect::<Result<_>>()?;
    let kept = kept(recorded);
    let recordings = recorded.objects.iter().zip(&object_of).map(|(recorded, &object)| Recording {
        in_poses: posed::in_poses(&recorded.name, recorded.touches(), &touched[object], &layer.real, settings),
        ..Recording::without_poses(&recorded.name, recorded.touches(), kept)
    });
    let recordings: Vec<Recording<'_>> = recordings.collect();
    let evidence = Evidence {
        recordings: &recordings,
        objects,
        object_of,
        plate: plate.map(|touches| Plate::new(touches.iter().map(Observed::of))),
        stroke,
    };
    progress.begin("fitting", None);
    evidence.object_of.par_iter().for_each(|&object| evidence.objects[object].prepare());
    let all = || recorded.touches().chain(plate.into_iter().flatten());
    let timer = timer::timer(all());
    let (best, ends) = searched(&evidence, layer.candidate, progress)?;
    // The intervals of the search suppose the layer as it was found.
    let center = best.candidate.numbers();
    let widened = |(index, ends): (usize, search::Ends)| ends.widened(index, center[index], layer.widening[index]);
    let ends: Vec<search::Ends> = ends.into_iter().enumerate().map(widened).collect();
    let mut fit = outcome::outcome(&evidence, &best, &ends, layer, timer, settings);
    fit.readings = timer::readings(all(), timer).map(|micros| micros / 1e3);
    fit.warnings = advice::warnings(&fit, timer);
    Ok(fit)
}

/// The index of the object or placement of a recording with this name.
fn place<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Result<usize> {
    touched::place(name, known.clone()).ok_or_else(|| {
        let known = known.collect::<Vec<_>>().join(", ");
        problem!("{name} was recorded, but is not among the objects: {known}")
            .fix("Give its mesh as well, under the recording's name, or leave the recording out.")
    })
}

/// The approaches that were recorded, as far as the touches say: every one if some touched nothing, only full touches
/// if there are no others.
fn kept(recorded: &Dataset) -> Counted {
    let any = |condition: fn(&Touch) -> bool| recorded.touches().any(condition);
    match (any(Touch::is_empty), any(|touch| !touch.is_full())) {
        (true, _) => Counted::All,
        (false, true) => Counted::Contacts,
        (false, false) => Counted::Full,
    }
}

/// Each object's instances.
fn scenes(objects: &[Object], settings: &FitSettings, progress: &dyn Progress) -> Result<Vec<Vec<Scene>>> {
    if settings.approaches < 1_000 {
        return Err(Error::setting("approaches", settings.approaches, "1000 or more"));
    }
    let origin = Origin { real: Noise::default(), ..settings.origin.clone() };
    capture::scenes(&objects.iter().collect::<Vec<_>>(), &origin, progress)
}

/// Each object, touched by the nominal probe, with a hand that goes on past it; fingers may bend.
struct Simulated {
    touches: Vec<ObjectTouches>,
    touched: Vec<Touched>,
    layer: Layer,
}

impl Simulated {
    fn new(touched: Vec<Touched>, layer: Layer, settings: &FitSettings, progress: &dyn Progress) -> Result<Self> {
        // What the hand does not reach is left out later, when a candidate says how fast it is.
        let probe = with!(settings.origin.probe, stroke = None, stroke_tolerance = None);
        let (touches, seed) = (settings.approaches, settings.seed);
        let origin = Origin { approaches: true, touches, seed, real: layer.real, probe, ..settings.origin.clone() };
        progress.begin("touching", Some(touched.len() as u64));
        let touches_of = |object: &Touched| {
            let touches = capture::touches(&object.scenes, &object.name, &origin, 0..settings.approaches)?;
            progress::advance(progress, 1)?;
            let is_weighed = object.weights.iter().any(|weight| *weight != object.weights[0]);
            Ok(if is_weighed { touches.as_often_as_placed() } else { touches })
        };
        let touches = touched.iter().map(touches_of).collect::<Result<_>>()?;
        Ok(Self { touches, touched, layer })
    }

    /// The densities of the touches where the recordings have this stroke.
    fn densities(&self, stroke: Stroke) -> Vec<Densities> {
        let densities = |object: &ObjectTouches| Densities::new(&object.name, object.touches(), stroke.window);
        self.touches.iter().map(densities).collect()
    }
}

/// The best candidate, and its intervals, number by number.
fn searched(
    evidence: &Evidence<'_>,
    near: Option<Hypothesis>,
    progress: &dyn Progress,
) -> Result<(Best, Vec<search::Ends>)> {
    let likelihood = |candidate: &Hypothesis| match progress.is_cancelled() {
        // The worst likelihood, so that the search ends soon.
        true => f64::NEG_INFINITY,
        false => evidence.log_likelihood(candidate),
    };
    let mut best = search::best(&likelihood, near);
    for _ in 0..4 {
        progress::check(progress)?;
        let interval = |index: usize| search::interval(&likelihood, &best, index);
        let ends: Vec<search::Ends> = (0..candidate::NUMBERS).into_par_iter().map(interval).collect();
        let better = ends.iter().filter_map(|end| end.better);
        let Some(better) = better.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)) else {
            return Ok((best, ends));
        };
        best = search::near(&likelihood, &better.candidate);
    }
    progress::check(progress)?;
    let ends =
        (0..candidate::NUMBERS).into_par_iter().map(|index| search::interval(&likelihood, &best, index)).collect();
    Ok((best, ends))
}

/// Number of the touches with three contacts, and with two.
fn counts(evidence: &Evidence<'_>) -> [usize; 2] {
    let touches = || evidence.recordings.iter().flat_map(|recording| &recording.touches);
    let pairs = touches().filter(|touch| touch.contacts() == 2).count();
    [touches().filter(|touch| touch.fingers == FULL).count(), pairs]
}
