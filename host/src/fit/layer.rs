//! Fingers that bend aside, found beside the probe's other numbers.
//!
//! Their effect on a touch depends on the angles of its contacts, so simulated touches are made again for each candidate:
//! the same approaches with the same random numbers, so that candidates differ by nothing else. There are fewer of them than
//! of the approaches that the rest of the fit uses.

use super::candidate::{Hypothesis, NUMBERS};
use super::density::Densities;
use super::likelihood::Plate;
use super::recording::Recording;
use super::search::{self, Best};
use super::stroke::Stroke;
use super::touched::Touched;
use super::{Evidence, FitSettings};
use crate::capture::Sampler;
use crate::error::Result;
use crate::probe::approach::{Approach, FINGERS, Probe};
use crate::probe::noise::{Grazing, Noise};
use crate::probe::scene::Scene;
use crate::probe::sweep::Contact;
use crate::progress::{self, Progress};
use crate::random::{self, Purpose};
use crate::touches::Origin;
use crate::with;
use nalgebra::{Matrix2, SMatrix, SymmetricEigen};
use palpate_shared::Touch;
use rand_distr::{Distribution, Exp1};
use rayon::prelude::*;

/// Simulated approaches to each object.
const APPROACHES: u64 = 20_000;
/// Gain of log-likelihood from which fingers bend for certain: a fit to touches of rigid fingers gains a little by chance.
const CERTAIN_GAIN: f64 = 4.0;
/// Gain from which fingers may bend, and the intervals of the probe's numbers allow for it.
const POSSIBLE_GAIN: f64 = 1.0;

/// Approaches to an object, and what rigid fingers would touch.
pub(super) struct Samples<'a> {
    name: &'a str,
    probe: Probe,
    scenes: &'a [Scene],
    approaches: Vec<Sample>,
}

struct Sample {
    /// The number of the scene.
    scene: usize,
    approach: Approach,
    contacts: [Option<Contact>; FINGERS],
    /// Exponential numbers of mean 1: by how much each finger bends.
    bends: [f64; FINGERS],
}

impl<'a> Samples<'a> {
    fn new(Touched { name, scenes, .. }: &'a Touched, shares: &[f64], settings: &FitSettings) -> Self {
        let origin = Origin { seed: settings.seed, ..settings.origin.clone() };
        let sampler = Sampler::of_instances(scenes, name, &origin);
        let probe = origin.probe;
        let count = APPROACHES.min(settings.approaches);
        // Each scene keeps a part of its approaches that is proportional to its share.
        let per_scene = count as f64 / scenes.len().max(1) as f64;
        let is_kept = |index: &u64| {
            let [turn, rank] = [index % scenes.len() as u64, index / scenes.len() as u64];
            rank as f64 <= per_scene * shares[turn as usize]
        };
        let sample = |index: u64| {
            let scene_number = index as usize % scenes.len();
            let scene = &scenes[scene_number];
            let mut random = random::generator(settings.seed, Purpose::Fit, name, index | 1 << 40);
            let approach = sampler.approach(scene, index);
            let contact = |finger| scene.contact(finger, approach.direction, probe.radius);
            Sample {
                scene: scene_number,
                approach,
                contacts: approach.fingers(probe.spacing).map(contact),
                bends: std::array::from_fn(|_| Exp1.sample(&mut random)),
            }
        };
        let approaches = (0..count).into_par_iter().filter(is_kept).map(sample).collect();
        Self { name, probe, scenes, approaches }
    }

    /// The touches of fingers that bend like that.
    pub(super) fn touches(&self, real: &Noise) -> Vec<Touch> {
        let touch = |sample: &Sample| {
            let scene = &self.scenes[sample.scene];
            let fingers = sample.approach.fingers(self.probe.spacing);
            let distances = std::array::from_fn(|finger| {
                let cast = [fingers[finger], sample.approach.direction];
                let contact = sample.contacts[finger].as_ref()?;
                real.grazing.distance(cast, contact, sample.bends[finger], scene, &self.probe)
            });
            let distances = sample.approach.above_table(distances, scene, &self.probe);
            sample.approach.touch(distances, &self.probe)
        };
        self.approaches.par_iter().map(touch).collect()
    }
}

/// Fingers that bend; by default rigid ones.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layer {
    pub(super) real: Noise,
    /// The ends of the intervals; none where nothing bends.
    pub(super) ends: Option<[Noise; 2]>,
    /// The probe that explains the recordings best with them; none if nothing was searched.
    pub(super) candidate: Option<Hypothesis>,
    /// Amount by which the uncertainty of the layer widens the interval of each of the probe's numbers to either side, on the
    /// scale of a search.
    pub(super) widening: [f64; NUMBERS],
}

/// The numbers of a layer, on about the same scale: the angle in units of 10°, and the logarithm to base 2 of the bend in
/// milliseconds.
type LayerNumbers = [f64; LAYER_NUMBERS];
/// Length of [`LayerNumbers`].
const LAYER_NUMBERS: usize = 2;

/// Numbers from which the search starts: 20° and 4 ms.
const START: LayerNumbers = [2.0, 2.0];
/// The first and the last step of the search.
const STEPS: [f64; 2] = [1.0, 0.2];
/// Factor of the widening of the intervals of the probe's numbers: slopes and curvatures come from simulated touches,
/// and are those of one maximum. With 1, intervals of 21 simulated probes held the speed and the offsets in 18, 18 and 17.
const WIDENING: f64 = 1.5;
/// Distance to either side over which curvatures are measured.
const CURVATURE_STEP: f64 = 0.5;

/// Largest angle of the search, in degrees. Where an interval ends there, or at 0, the recordings do not limit it.
pub(super) const MAX_ANGLE: f64 = 80.0;

fn noise_of([angle, bend]: LayerNumbers) -> Noise {
    let grazing = Grazing { angle: (10.0 * angle).clamp(0.0, MAX_ANGLE), bend: 1e3 * bend.clamp(-4.0, 8.0).exp2() };
    with!(Noise::default(), grazing)
}

/// Recordings and approaches to their objects.
struct Layers<'a> {
    recordings: &'a [Recording<'a>],
    samples: Vec<Samples<'a>>,
    plate: Option<&'a Plate>,
    stroke: Stroke,
    progress: &'a dyn Progress,
}

impl Layers<'_> {
    fn densities(&self, real: &Noise) -> Vec<Densities> {
        let densities =
            |samples: &Samples<'_>| Densities::new(samples.name, &samples.touches(real), self.stroke.window);
        self.samples.iter().map(densities).collect()
    }

    fn evidence<'b>(&'b self, objects: &'b [Densities]) -> Evidence<'b> {
        Evidence {
            recordings: self.recordings,
            objects,
            object_of: (0..self.recordings.len()).collect(),
            plate: self.plate.cloned(),
            stroke: self.stroke,
        }
    }

    /// Finds the likeliest probe whose fingers bend like this, near another probe.
    fn explained(&self, numbers: LayerNumbers, from: &Hypothesis) -> Result<Best> {
        progress::check(self.progress)?;
        let densities = self.densities(&noise_of(numbers));
        let evidence = self.evidence(&densities);
        Ok(search::near(&|candidate: &Hypothesis| evidence.log_likelihood(candidate), from))
    }

    /// Compass search: tries a step to either side of each number, and halves the step where neither is better.
    fn best(&self, plain: &Best) -> Result<(LayerNumbers, Best)> {
        let (mut numbers, mut best) = (START, self.explained(START, &plain.candidate)?);
        // None of the tried numbers is better than the best ones.
        let mut tried = vec![START];
        let [mut step, last] = STEPS;
        while step > last {
            let mut moved = false;
            for index in 0..numbers.len() {
                for change in [step, -step] {
                    let mut moved_numbers = numbers;
                    moved_numbers[index] += change;
                    if moved_numbers[0] < 0.0 || moved_numbers[1] < -4.0 || tried.contains(&moved_numbers) {
                        continue;
                    }
                    tried.push(moved_numbers);
                    let found = self.explained(moved_numbers, &best.candidate)?;
                    if found.log_likelihood > best.log_likelihood + 0.05 {
                        (numbers, best, moved) = (moved_numbers, found, true);
                        break;
                    }
                }
            }
            if !moved {
                step /= 2.0;
            }
        }
        Ok((numbers, best))
    }

    /// Half the widths of the intervals of the layer's numbers, from the curvatures of the likelihood; and the
    /// [widening](Layer::widening) of the intervals of the probe's numbers, which change with the layer by measured slopes.
    fn widths(&self, numbers: LayerNumbers, best: &Best) -> Result<(LayerNumbers, [f64; NUMBERS])> {
        let best_at = |changes: &[(usize, f64)]| {
            let mut changed = numbers;
            changes.iter().for_each(|(index, steps)| changed[*index] += steps * CURVATURE_STEP);
            self.explained(changed, &best.candidate)
        };
        let center = best_at(&[])?.log_likelihood;
        let mut curvatures = Matrix2::identity();
        let mut up = [0.0; LAYER_NUMBERS];
        let mut slopes = SMatrix::<f64, NUMBERS, LAYER_NUMBERS>::zeros();
        for index in 0..LAYER_NUMBERS {
            let [above, below] = [best_at(&[(index, 1.0)])?, best_at(&[(index, -1.0)])?];
            up[index] = above.log_likelihood;
            curvatures[(index, index)] = 2.0 * center - up[index] - below.log_likelihood;
            let [above, below] = [above, below].map(|best| best.candidate.numbers());
            slopes.set_column(
                index,
                &SMatrix::from_fn(|number, _| (above[number] - below[number]) / (2.0 * CURVATURE_STEP)),
            );
        }
        let both = up[0] + up[1] - best_at(&[(0, 1.0), (1, 1.0)])?.log_likelihood - center;
        (curvatures[(0, 1)], curvatures[(1, 0)]) = (both, both);
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(curvatures);
        let spread = eigenvectors
            * Matrix2::from_diagonal(&eigenvalues.map(|curved| CURVATURE_STEP.powi(2) / curved.max(0.05)))
            * eigenvectors.transpose();
        let widening = WIDENING.powi(2) * slopes * spread * slopes.transpose();
        let half = |variance: f64| (search::QUANTILE * variance.max(0.0)).sqrt();
        Ok((
            [0, 1].map(|index| half(spread[(index, index)])),
            std::array::from_fn(|number| half(widening[(number, number)])),
        ))
    }
}

/// Simulates approaches, which no stroke ends, to these objects or placements.
pub(super) fn samples<'a>(touched: &[&'a Touched], settings: &FitSettings) -> Vec<Samples<'a>> {
    touched.iter().map(|object| Samples::new(object, &object.shares(), settings)).collect()
}

/// Finds out by how much fingers bend, if the recordings show it. `samples` are those of the recordings' objects, in the
/// same order.
pub(super) fn layer(
    recordings: &[Recording<'_>],
    samples: Vec<Samples<'_>>,
    plate: Option<&Plate>,
    stroke: Stroke,
    progress: &dyn Progress,
) -> Result<Layer> {
    let layers = Layers { recordings, samples, plate, stroke, progress };
    let plain = {
        let densities = layers.densities(&Noise::default());
        let evidence = layers.evidence(&densities);
        search::best(&|candidate: &Hypothesis| evidence.log_likelihood(candidate), None)
    };
    let (numbers, best) = layers.best(&plain)?;
    let gain = best.log_likelihood - plain.log_likelihood;
    if gain < POSSIBLE_GAIN {
        return Ok(Layer { candidate: Some(plain.candidate), ..Layer::default() });
    }
    let (widths, widening) = layers.widths(numbers, &best)?;
    if gain < CERTAIN_GAIN {
        let [bent, rigid] = [best.candidate.numbers(), plain.candidate.numbers()];
        let widening = std::array::from_fn(|number| widening[number].hypot(WIDENING * (bent[number] - rigid[number])));
        return Ok(Layer { candidate: Some(plain.candidate), widening, ..Layer::default() });
    }
    let ends = [-1.0, 1.0].map(|side| noise_of(std::array::from_fn(|index| numbers[index] + side * widths[index])));
    Ok(Layer { real: noise_of(numbers), ends: Some(ends), candidate: Some(best.candidate), widening })
}
