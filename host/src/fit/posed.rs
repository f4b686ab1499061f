//! Likelihood from the pose of a recorded touch: simulated approaches in the very pose, aimed anywhere.
//!
//! A touch whose pose is known is compared with approaches to its object in that pose, instead of in all. A flat face is
//! then touched at a known slope, which tells offsets and speed far better. Poses are never exact and such approaches few,
//! so a share of the density stays that of all poses.

use super::FitSettings;
use super::candidate::Hypothesis;
use super::likelihood::{Explained, product};
use super::observed::{FULL, Observed};
use super::touched::Touched;
use crate::probe::approach::Approach;
use crate::probe::noise::Noise;
use crate::probe::scene::Scene;
use crate::random::{self, Purpose};
use glam::{DMat3, DVec3};
use palpate_shared::format::Counted;
use palpate_shared::{Pose, Q15_ONE, Touch};
use rand::{Rng, RngExt};
use rayon::prelude::*;

/// Simulated approaches in the pose of each recorded touch.
const APPROACHES: usize = 160;
/// The share of a touch's density that comes from approaches in its pose.
const TRUSTED: f64 = 0.8;
/// Width that simulated times are smoothed by, as a share of their distance from 0: poses are not exact.
const SMOOTHING: f64 = 0.06;
/// Number of the neighbor that an approach is smoothed toward: there are few, and gaps between them must not be taken
/// for noise.
const NEIGHBOR: usize = 3;

/// Approaches in the pose of one recorded touch.
#[derive(Debug)]
pub(super) struct InPose {
    /// Approaches with contacts of all fingers that were recorded: no others explain the touch.
    explaining: Vec<Simulated>,
    /// Number of approaches.
    count: f64,
}

#[derive(Clone, Copy, Debug)]
struct Simulated {
    /// Set of the fingers that touched.
    touched: u8,
    /// Contact times in milliseconds.
    times: [f32; 3],
    /// Width by which the differences of times are smoothed, in milliseconds: half the distance to its third neighbor with
    /// the same contacts. Method: Breiman, Meisel and Purcell, Variable kernel estimates of multivariate densities,
    /// Technometrics 19 (1977).
    gap: f32,
}

/// For each recorded touch of an object, approaches in its pose; none for a touch without a pose. Nothing if no touch has
/// one.
pub(super) fn in_poses(
    name: &str,
    touches: &[Touch],
    touched: &Touched,
    layer: &Noise,
    settings: &FitSettings,
) -> Vec<Option<InPose>> {
    if touches.iter().all(|touch| touch.pose().is_none()) || touched.scenes.is_empty() {
        return Vec::new();
    }
    let order = order(&touched.shares());
    let in_pose = |(index, touch): (usize, &Touch)| {
        let mut random = random::generator(settings.seed, Purpose::Fit, name, 1 + index as u64);
        let pose = touch.pose()?;
        let approaches = order.iter().map(|&scene| {
            let scene = &touched.scenes[scene];
            let approach = aimed(&mut random, &pose, scene, settings);
            let probe = &settings.origin.probe;
            let distances = match layer.grazing.is_none() {
                true => approach.distances(scene, probe),
                false => layer.grazing.distances(&approach, scene, probe, &mut random),
            };
            let touch = approach.touch(distances, probe);
            let times = touch.times().map(|time| time.micros().map_or(0.0, |micros| micros as f32 / 1e3));
            Simulated { touched: Observed::of(&touch).fingers, times, gap: 0.0 }
        });
        let mut approaches: Vec<Simulated> = approaches.collect();
        let gaps: Vec<f32> = approaches.iter().map(|approach| gap(approach, &approaches)).collect();
        approaches.iter_mut().zip(gaps).for_each(|(approach, gap)| approach.gap = gap);
        let (fingers, count) = (Observed::of(touch).fingers, approaches.len() as f64);
        approaches.retain(|approach| approach.touched & fingers == fingers);
        Some(InPose { explaining: approaches, count })
    };
    touches.par_iter().enumerate().map(in_pose).collect()
}

/// Deals approaches to scenes in proportion to their shares, in turn where all shares are equal.
fn order(shares: &[f64]) -> Vec<usize> {
    let mut due: Vec<f64> = shares.to_vec();
    let mut next = || {
        // The scene whose approaches are the most overdue, the first of several.
        let scene = (0..due.len()).fold(0, |best, scene| if due[scene] > due[best] { scene } else { best });
        due[scene] -= shares.iter().sum::<f64>();
        due.iter_mut().zip(shares).for_each(|(due, share)| *due += share);
        scene
    };
    (0..APPROACHES).map(|_| next()).collect()
}

/// Half the distance to the third nearest approach with the same contacts; 0 if there are fewer.
fn gap(approach: &Simulated, all: &[Simulated]) -> f32 {
    // Times of fingers that did not touch are 0, and so is their contribution here.
    let away = |other: &Simulated| {
        let [a, b, c]: [f32; 3] = std::array::from_fn(|finger| other.times[finger] - approach.times[finger]);
        let touched = |fingers: u8| approach.touched & fingers == fingers;
        let differences = [(0b011, b - a), (0b110, c - b), (0b101, c - a)];
        differences.iter().map(|(fingers, away)| if touched(*fingers) { away.abs() } else { 0.0 }).fold(0.0, f32::max)
    };
    let mut neighbors: Vec<f32> = all.iter().filter(|other| other.touched == approach.touched).map(away).collect();
    // The nearest is the approach itself.
    if neighbors.len() <= NEIGHBOR {
        return 0.0;
    }
    *neighbors.select_nth_unstable_by(NEIGHBOR, f32::total_cmp).1 / 2.0
}

/// Draws an approach in this pose, aimed like those of the robot.
fn aimed(random: &mut impl Rng, pose: &Pose, scene: &Scene, settings: &FitSettings) -> Approach {
    let vector = |cosines: [i16; 3]| {
        DVec3::from_array(cosines.map(|cosine| f64::from(cosine) / f64::from(Q15_ONE))).normalize_or(DVec3::Z)
    };
    // On a table the angle of the object about the vertical is unknown.
    let turn = match scene.table() {
        Some(_) => DMat3::from_rotation_z(random.random_range(0.0..std::f64::consts::TAU)),
        None => DMat3::IDENTITY,
    };
    let [low, high] = settings.origin.aim.target(scene);
    let shares = DVec3::new(random.random(), random.random(), random.random());
    let [bottom, top] = scene.bounds();
    let away = (top - bottom).length() + settings.origin.clearance([bottom, top]);
    let [direction, alignment] = [pose.direction, pose.alignment].map(|cosines| turn * vector(cosines));
    // Farther away than the robot starts, which changes no difference of times.
    Approach { start: low + (high - low) * shares - direction * away, direction, alignment }
}

/// For each finger the probability that its contact is missing, though it touches: missed, or later than the stroke. What was
/// recorded was not late. Where the fingers that were recorded are all that count, the first of them begins the stroke.
fn unreached(missed: &[f64; 3], touched: u8, recorded: u8, seen: &[f64; 3], window: f64, noise: f64) -> [f64; 3] {
    let fingers = if recorded == 0 || recorded & touched != recorded { touched } else { recorded };
    let first =
        (0..3).filter(|finger| fingers >> finger & 1 == 1).map(|finger| seen[finger]).fold(f64::INFINITY, f64::min);
    std::array::from_fn(|finger| match touched >> finger & 1 == 1 && recorded >> finger & 1 == 0 {
        true => missed[finger] + (1.0 - missed[finger]) * late_share(seen[finger] - first, window, noise),
        false => missed[finger],
    })
}

/// The probability that a contact simulated this long after the first comes later than the stroke.
fn late_share(after: f64, window: f64, noise: f64) -> f64 {
    // About a standard deviation of a simulated time: the end of the stroke is no sharper.
    let width = (SMOOTHING * window).hypot(2.0 * noise);
    (0.5 + (after - window) / (2.0 * width)).clamp(0.0, 1.0)
}

/// The logarithm of the density of a recorded touch, given approaches in its pose.
pub(super) fn log_density(explained: &Explained<'_>, observed: &Observed, in_pose: &InPose) -> f64 {
    let all = explained.log_density(observed);
    let Some(density) = density(explained, observed, in_pose) else { return all };
    let posed = density.ln() - explained.recorded;
    let larger = posed.max(all);
    larger + (TRUSTED * (posed - larger).exp() + (1.0 - TRUSTED) * (all - larger).exp()).ln()
}

/// The density among the approaches in its pose; none if none of them can explain the touch, whatever the candidate. Where one
/// could but hardly does, it is close to 0, so that the likelihood has no steps.
fn density(explained: &Explained<'_>, observed: &Observed, in_pose: &InPose) -> Option<f64> {
    if in_pose.explaining.is_empty() {
        return None;
    }
    let (Hypothesis { factor, late, noise, missed }, kept) = (&explained.candidate, explained.kept);
    // Of full touches alone it counts how many approaches would be full.
    let (mut sum, mut weights) = (0.0, if kept == Counted::Full { 0.0 } else { in_pose.count });
    for Simulated { touched, times, gap } in &in_pose.explaining {
        let seen = |finger: usize| factor * f64::from(times[finger]) + late[finger];
        let weight = match (kept, explained.window()) {
            (Counted::Full, _) => f64::from(u8::from(*touched == FULL)),
            (_, None) => explained.product(*touched, observed.fingers),
            // A contact that is late, by what is known of its time, is missing.
            (_, Some(window)) => {
                let seen = std::array::from_fn(seen);
                let missed = unreached(missed, *touched, observed.fingers, &seen, window, *noise);
                product(*touched, observed.fingers, &missed)
            }
        };
        weights += match (kept, explained.window()) {
            (Counted::Full, Some(window)) => {
                let times = [seen(0), seen(1), seen(2)];
                let [first, last] =
                    [times.iter().copied().fold(f64::INFINITY, f64::min), times.into_iter().fold(0.0, f64::max)];
                weight * (1.0 - late_share(last - first, window, *noise))
            }
            (Counted::Full, None) => weight,
            _ => 0.0,
        };
        if weight <= 0.0 {
            continue;
        }
        // Squared distance and variance.
        let apart = |expected: f64, found: f64, variance: f64| {
            let variance =
                variance * noise * noise + (SMOOTHING * expected).powi(2) + (factor * f64::from(*gap)).powi(2);
            ((found - expected).powi(2) / variance, std::f64::consts::TAU * variance)
        };
        let kernel = |expected: f64, found: f64| {
            let (square, variance) = apart(expected, found, 2.0);
            (-0.5 * square).exp() / variance.sqrt()
        };
        sum += weight
            * match observed.fingers {
                FULL => {
                    let [a, b, c] = [seen(0), seen(1), seen(2)];
                    let (curvature, slope) = (a - 2.0 * b + c, c - a);
                    let (bend, tilt) = (apart(curvature, observed.first, 6.0), apart(slope, observed.second, 2.0));
                    (-0.5 * (bend.0 + tilt.0)).exp() / (bend.1 * tilt.1).sqrt()
                }
                0b011 => kernel(seen(1) - seen(0), observed.first),
                0b110 => kernel(seen(2) - seen(1), observed.first),
                0b101 => kernel(seen(2) - seen(0), observed.first),
                _ => 1.0,
            };
    }
    Some(if weights > 0.0 { sum / weights } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::super::density::Densities;
    use super::*;
    use palpate_shared::ContactTime;

    #[test]
    fn the_likelihood_has_no_step_where_a_share_of_missed_contacts_reaches_zero() {
        // Every approach in this pose touches with three fingers, the recorded touch has two: a contact was missed.
        let touch = |i: u32| Touch::from_micros([0, 10_000 + 10 * (i % 500), 20_000]);
        let touches: Vec<Touch> = (0..3_000).map(touch).collect();
        let densities = Densities::new("one", &touches, None);
        let explaining = vec![Simulated { touched: FULL, times: [0.0, 12.0, 20.0], gap: 1.0 }; 10];
        let in_pose = InPose { explaining, count: 10.0 };
        let observed = Observed::of(&Touch::new([
            ContactTime::from_micros(0),
            ContactTime::from_micros(12_000),
            ContactTime::MISSING,
        ]));
        let at = |missed: f64, noise: f64| {
            let candidate = Hypothesis { factor: 1.0, late: [0.0; 3], noise, missed: [0.0, 0.0, missed] };
            log_density(&Explained::new(&candidate, &densities, Counted::Contacts), &observed, &in_pose)
        };
        let (none, hardly) = (at(0.0, 2.0), at(1e-12, 2.0));
        assert!((none - hardly).abs() < 1e-6, "{none} {hardly}");
        assert!(at(0.01, 2.0) > none + 1.0);
    }
}
