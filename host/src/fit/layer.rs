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
use super::{Evidence, Settings};
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
/// Least gain of log-likelihood for bending fingers: a fit to touches of rigid ones finds a little of it by chance.
const CERTAIN: f64 = 4.0;
/// Gain at which they may bend: the probe's intervals allow for it.
const POSSIBLE: f64 = 1.0;

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
    fn new(Touched { name, scenes, .. }: &'a Touched, shares: &[f64], settings: &Settings) -> Self {
        let origin = Origin { seed: settings.seed, ..settings.origin.clone() };
        let sampler = Sampler::of_instances(scenes, name, &origin);
        let probe = origin.probe;
        let count = APPROACHES.min(settings.approaches);
        // Of each scene as many of its approaches as its share says.
        let of_each = count as f64 / scenes.len().max(1) as f64;
        let is_kept = |index: &u64| {
            let [turn, rank] = [index % scenes.len() as u64, index / scenes.len() as u64];
            rank as f64 <= of_each * shares[turn as usize]
        };
        let one = |index: u64| {
            let place = index as usize % scenes.len();
            let scene = &scenes[place];
            let mut random = random::generator(settings.seed, Purpose::Fit, name, index | 1 << 40);
            let approach = sampler.approach(scene, index);
            let contact = |finger| scene.contact(finger, approach.direction, probe.radius);
            Sample {
                scene: place,
                approach,
                contacts: approach.fingers(probe.spacing).map(contact),
                bends: std::array::from_fn(|_| Exp1.sample(&mut random)),
            }
        };
        let approaches = (0..count).into_par_iter().filter(is_kept).map(one).collect();
        Self { name, probe, scenes, approaches }
    }

    /// The touches of fingers that bend like that.
    pub(super) fn touches(&self, real: &Noise) -> Vec<Touch> {
        let one = |sample: &Sample| {
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
        self.approaches.par_iter().map(one).collect()
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
    /// Widths that their uncertainty adds to the intervals of the probe's numbers: half widths, on the scale of a search.
    pub(super) adds: [f64; NUMBERS],
}

/// Angle and bend as numbers of about the same scale.
type Numbers = [f64; LAYER];
/// Count of these numbers.
const LAYER: usize = 2;

/// Numbers from which the search starts: 20° and 4 ms.
const START: Numbers = [2.0, 2.0];
/// The first and the last step of the search.
const STEPS: [f64; 2] = [1.0, 0.2];
/// Factor of what a layer adds to the intervals of the probe's numbers: slopes and curvatures come from simulated touches,
/// and are those of one maximum. With 1, intervals of 21 simulated probes held the speed and the offsets in 18, 18 and 17.
const WIDER: f64 = 1.5;
/// Distance to either side over which curvatures are measured.
const CURVATURE: f64 = 0.5;

/// The largest angle of the search, in degrees. An interval that ends there, or at 0, has no end that the recordings tell.
pub(super) const MOST_ANGLE: f64 = 80.0;

fn real_of([angle, bend]: Numbers) -> Noise {
    let grazing = Grazing { angle: (10.0 * angle).clamp(0.0, MOST_ANGLE), bend: 1e3 * bend.clamp(-4.0, 8.0).exp2() };
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
        let of = |samples: &Samples<'_>| Densities::new(samples.name, &samples.touches(real), self.stroke.window);
        self.samples.iter().map(of).collect()
    }

    fn evidence<'b>(&'b self, objects: &'b [Densities]) -> Evidence<'b> {
        Evidence {
            recordings: self.recordings,
            objects,
            of: (0..self.recordings.len()).collect(),
            plate: self.plate.cloned(),
            stroke: self.stroke,
        }
    }

    /// The best probe with these numbers, near another one.
    fn explained(&self, numbers: Numbers, from: &Hypothesis) -> Result<Best> {
        progress::check(self.progress)?;
        let densities = self.densities(&real_of(numbers));
        let evidence = self.evidence(&densities);
        Ok(search::near(&|candidate: &Hypothesis| evidence.log_likelihood(candidate), from))
    }

    /// Compass search: a step to either side of each number, and half of it where none is better.
    fn best(&self, plain: &Best) -> Result<(Numbers, Best)> {
        let (mut numbers, mut best) = (START, self.explained(START, &plain.candidate)?);
        // What was tried is no better.
        let mut tried = vec![START];
        let [mut step, last] = STEPS;
        while step > last {
            let mut moved = false;
            for index in 0..numbers.len() {
                for way in [step, -step] {
                    let mut there = numbers;
                    there[index] += way;
                    if there[0] < 0.0 || there[1] < -4.0 || tried.contains(&there) {
                        continue;
                    }
                    tried.push(there);
                    let found = self.explained(there, &best.candidate)?;
                    if found.log_likelihood > best.log_likelihood + 0.05 {
                        (numbers, best, moved) = (there, found, true);
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

    /// Half the widths of the intervals, from the curvatures of the likelihood, and what they add to those of the probe's
    /// numbers: these move with the layer, by slopes that are measured along the way.
    fn widths(&self, numbers: Numbers, best: &Best) -> Result<(Numbers, [f64; NUMBERS])> {
        let at = |ways: &[(usize, f64)]| {
            let mut there = numbers;
            ways.iter().for_each(|(index, way)| there[*index] += way * CURVATURE);
            self.explained(there, &best.candidate)
        };
        let center = at(&[])?.log_likelihood;
        let mut curvatures = Matrix2::identity();
        let mut up = [0.0; LAYER];
        let mut slopes = SMatrix::<f64, NUMBERS, LAYER>::zeros();
        for index in 0..LAYER {
            let [above, below] = [at(&[(index, 1.0)])?, at(&[(index, -1.0)])?];
            up[index] = above.log_likelihood;
            curvatures[(index, index)] = 2.0 * center - up[index] - below.log_likelihood;
            let [above, below] = [above, below].map(|best| best.candidate.numbers());
            slopes
                .set_column(index, &SMatrix::from_fn(|number, _| (above[number] - below[number]) / (2.0 * CURVATURE)));
        }
        let both = up[0] + up[1] - at(&[(0, 1.0), (1, 1.0)])?.log_likelihood - center;
        (curvatures[(0, 1)], curvatures[(1, 0)]) = (both, both);
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(curvatures);
        let spread = eigenvectors
            * Matrix2::from_diagonal(&eigenvalues.map(|curved| CURVATURE.powi(2) / curved.max(0.05)))
            * eigenvectors.transpose();
        let adds = WIDER.powi(2) * slopes * spread * slopes.transpose();
        let half = |variance: f64| (search::QUANTILE * variance.max(0.0)).sqrt();
        Ok((
            [0, 1].map(|index| half(spread[(index, index)])),
            std::array::from_fn(|number| half(adds[(number, number)])),
        ))
    }
}

/// Approaches to these objects, or placements, that no stroke ends.
pub(super) fn samples<'a>(touched: &[&'a Touched], settings: &Settings) -> Vec<Samples<'a>> {
    touched.iter().map(|own| Samples::new(own, &own.shares(), settings)).collect()
}

/// Finds fingers that bend, if the recordings show them. `samples` are of the recordings' objects, in their order.
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
    if gain < POSSIBLE {
        return Ok(Layer { candidate: Some(plain.candidate), ..Layer::default() });
    }
    let (widths, adds) = layers.widths(numbers, &best)?;
    if gain < CERTAIN {
        let [bent, rigid] = [best.candidate.numbers(), plain.candidate.numbers()];
        let adds = std::array::from_fn(|number| adds[number].hypot(WIDER * (bent[number] - rigid[number])));
        return Ok(Layer { candidate: Some(plain.candidate), adds, ..Layer::default() });
    }
    let ends = [-1.0, 1.0].map(|side| real_of(std::array::from_fn(|index| numbers[index] + side * widths[index])));
    Ok(Layer { real: real_of(numbers), ends: Some(ends), candidate: Some(best.candidate), adds })
}
