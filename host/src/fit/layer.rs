//! Fingers that bend aside and objects that give way, found beside the probe's other numbers.
//!
//! What they do to a touch depends on the angles of its contacts, so simulated touches are made again for each candidate:
//! the same approaches with the same random numbers, so that candidates differ by nothing else. There are fewer of them than
//! of the approaches that the rest of the fit uses.

use super::candidate::Candidate;
use super::density::Densities;
use super::likelihood::Plate;
use super::recording::Recording;
use super::search::{self, Best};
use super::stroke::Stroke;
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
use nalgebra::{Matrix3, SymmetricEigen};
use palpate_shared::Touch;
use rand_distr::{Distribution, Exp1};
use rayon::prelude::*;

/// Simulated approaches to each object.
const APPROACHES: u64 = 10_000;
/// Gain of log-likelihood from which fingers bend and objects give way: a fit to touches without either finds a little of
/// them by chance.
const CERTAIN: f64 = 4.0;

/// Approaches to an object, and what would be touched if nothing gave way.
struct Samples<'a> {
    name: &'a str,
    probe: Probe,
    scenes: &'a [Scene],
    approaches: Vec<Sample>,
}

struct Sample {
    approach: Approach,
    contacts: [Option<Contact>; FINGERS],
    /// Exponential numbers of mean 1: by how much each finger bends, and the object gives way at its contact.
    bends: [f64; FINGERS],
    gives: [f64; FINGERS],
}

impl<'a> Samples<'a> {
    fn new(name: &'a str, scenes: &'a [Scene], settings: &Settings) -> Self {
        let origin = Origin { seed: settings.seed, ..settings.origin.clone() };
        let sampler = Sampler::of_instances(scenes, name, &origin);
        let probe = origin.probe;
        let one = |index: u64| {
            let scene = &scenes[index as usize % scenes.len()];
            let mut random = random::generator(settings.seed, Purpose::Fit, name, index | 1 << 40);
            let approach = sampler.approach(scene, index);
            let contact = |finger| scene.contact(finger, approach.direction, probe.radius);
            Sample {
                approach,
                contacts: approach.fingers(probe.spacing).map(contact),
                bends: std::array::from_fn(|_| Exp1.sample(&mut random)),
                gives: std::array::from_fn(|_| Exp1.sample(&mut random)),
            }
        };
        let approaches = (0..APPROACHES.min(settings.approaches)).into_par_iter().map(one).collect();
        Self { name, probe, scenes, approaches }
    }

    /// The touches of fingers that bend and objects that give way like that.
    fn touches(&self, real: &Noise) -> Vec<Touch> {
        let one = |(index, sample): (usize, &Sample)| {
            let scene = &self.scenes[index % self.scenes.len()];
            let fingers = sample.approach.fingers(self.probe.spacing);
            let distances = std::array::from_fn(|finger| {
                let cast = [fingers[finger], sample.approach.direction];
                let contact = sample.contacts[finger].as_ref()?;
                real.grazing.distance(cast, contact, sample.bends[finger], scene, &self.probe)
            });
            real.given(&sample.approach.touch(distances, &self.probe), sample.gives)
        };
        self.approaches.par_iter().enumerate().map(one).collect()
    }
}

/// Fingers that bend and objects that give way, and the probe that explains the recordings best with them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    pub(super) real: Noise,
    /// The ends of the intervals; none where nothing bends or gives way.
    pub(super) ends: Option<[Noise; 2]>,
    pub(super) candidate: Candidate,
}

/// Angle, bend and give as numbers of about the same scale.
type Numbers = [f64; 3];

/// Nothing bends and nothing gives way; the angle is that from which the search starts.
const NOTHING: Numbers = [2.0, f64::NEG_INFINITY, 0.0];
/// The bend from which the search starts, 4 ms, and the least one.
const BEND: [f64; 2] = [2.0, -4.0];
/// The first and the last step of the search.
const STEPS: [f64; 2] = [1.0, 0.2];
/// How far to either side curvatures are measured.
const CURVATURE: f64 = 0.5;

fn real_of([angle, bend, give]: Numbers) -> Noise {
    let bends = Grazing { angle: 10.0 * angle.clamp(0.0, 8.0), bend: 1e3 * bend.clamp(BEND[1], 8.0).exp2() };
    let grazing = if bend == f64::NEG_INFINITY { Grazing::default() } else { bends };
    Noise { grazing, give: 1e3 * give.max(0.0).powi(2), ..Noise::default() }
}

/// Recordings and approaches to their objects.
struct Layers<'a> {
    recordings: &'a [Recording<'a>],
    samples: Vec<Samples<'a>>,
    plate: Option<&'a Plate>,
    stroke: &'a Stroke,
    progress: &'a dyn Progress,
}

impl Layers<'_> {
    fn evidence(&self, real: &Noise) -> Evidence<'_> {
        Evidence {
            recordings: self.recordings.iter().map(Recording::without_poses).collect(),
            objects: (self.samples.iter())
                .map(|samples| Densities::new(samples.name, &samples.touches(real), self.stroke.window))
                .collect(),
            of: (0..self.recordings.len()).collect(),
            plate: self.plate.cloned(),
            stroke: *self.stroke,
        }
    }

    /// The best probe with these numbers, near another one.
    fn explained(&self, numbers: Numbers, from: &Candidate) -> Result<Best> {
        progress::check(self.progress)?;
        let evidence = self.evidence(&real_of(numbers));
        Ok(search::again(&|candidate: &Candidate| evidence.log_likelihood(candidate, |_| true), from))
    }

    /// Compass search among the numbers `open`: a step to either side of each, and half of it where none is better.
    fn climb(&self, (mut numbers, mut best): (Numbers, Best), open: &[usize]) -> Result<(Numbers, Best)> {
        let [mut step, last] = STEPS;
        while step > last {
            let mut moved = false;
            for &index in open {
                for way in [step, -step] {
                    let mut there = numbers;
                    there[index] += way;
                    if there[0] < 0.0 || there[2] < 0.0 || index == 1 && there[1] < BEND[1] {
                        continue;
                    }
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

    /// Half the widths of the intervals of the numbers `open`, from the curvatures of the likelihood.
    fn widths(&self, numbers: Numbers, best: &Best, open: &[usize]) -> Result<Numbers> {
        let at = |ways: &[(usize, f64)]| -> Result<f64> {
            let mut there = numbers;
            ways.iter().for_each(|(index, way)| there[*index] += way * CURVATURE);
            Ok(self.explained(there, &best.candidate)?.log_likelihood)
        };
        let mut curvatures = Matrix3::identity();
        let mut up = [0.0; 3];
        for &index in open {
            up[index] = at(&[(index, 1.0)])?;
            curvatures[(index, index)] = 2.0 * best.log_likelihood - up[index] - at(&[(index, -1.0)])?;
        }
        for (one, other) in [(0, 1), (0, 2), (1, 2)] {
            if open.contains(&one) && open.contains(&other) {
                let both = up[one] + up[other] - at(&[(one, 1.0), (other, 1.0)])? - best.log_likelihood;
                (curvatures[(one, other)], curvatures[(other, one)]) = (both, both);
            }
        }
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(curvatures);
        let spread = eigenvectors
            * Matrix3::from_diagonal(&eigenvalues.map(|curved| CURVATURE.powi(2) / curved.max(0.05)))
            * eigenvectors.transpose();
        let width = |index: usize| (search::QUANTILE * spread[(index, index)]).sqrt();
        Ok([0, 1, 2].map(|index| if open.contains(&index) { width(index) } else { 0.0 }))
    }
}

/// Finds fingers that bend and objects that give way, if the recordings show them.
pub(super) fn layer(
    recordings: &[Recording<'_>],
    objects: &[(&str, &[Scene])],
    plate: Option<&Plate>,
    stroke: &Stroke,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Layer> {
    let samples = objects.iter().map(|(name, scenes)| Samples::new(name, scenes, settings)).collect();
    let layers = Layers { recordings, samples, plate, stroke, progress };
    let plain = {
        let evidence = layers.evidence(&Noise::default());
        search::best(&|candidate: &Candidate| evidence.log_likelihood(candidate, |_| true), None)
    };
    // What gives way is tried first: it takes no casts. Fingers bend only if that says more still.
    let (mut numbers, mut best, mut open): (Numbers, Best, &[usize]) = (NOTHING, plain, &[]);
    let (giving, with) = layers.climb((numbers, best), &[2])?;
    if with.log_likelihood > best.log_likelihood + CERTAIN {
        (numbers, best, open) = (giving, with, &[2]);
    }
    let start = [NOTHING[0], BEND[0], numbers[2]];
    let (bending, with) = layers.climb((start, layers.explained(start, &best.candidate)?), &[1, 0, 2])?;
    if with.log_likelihood > best.log_likelihood + CERTAIN {
        (numbers, best, open) = (bending, with, &[0, 1, 2]);
    }
    let ends = match open {
        [] => None,
        _ => {
            let widths = layers.widths(numbers, &best, open)?;
            let end = |side: f64| real_of(std::array::from_fn(|index| numbers[index] + side * widths[index]));
            Some([-1.0, 1.0].map(end))
        }
    };
    Ok(Layer { real: real_of(numbers), ends, candidate: best.candidate })
}
