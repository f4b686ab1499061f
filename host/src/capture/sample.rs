//! Sample i of an object: a pure function of (seed, object's name, i).
//!
//! The stream of random numbers must stay the same, byte for byte: data sets are put together from parts and compared
//! across versions. It is therefore not one of the streams of `random`.

use crate::error::{Error, Kind, Result, problem};
use crate::mesh::facts::sides;
use crate::probe::Probe;
use crate::probe::approach::{Approach, FINGERS};
use crate::probe::hand;
use crate::probe::noise::Noise;
use crate::probe::scene::Scene;
use crate::random::{self, Purpose};
use crate::touches::Origin;
use glam::DVec3;
use palpate_shared::Touch;
use palpate_shared::format::Length;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// After this many approaches without a full touch, an object counts as one that cannot be touched with three fingers.
/// Real objects need 2 to 36; a wire as thin as a hundredth of the fingers needs a few thousand.
pub(crate) const MOST_ATTEMPTS: u64 = 1 << 22;

/// A sample, and the number of approaches for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drawn {
    /// The touch.
    pub(crate) touch: Touch,
    /// Number of approaches that it took.
    pub(crate) approaches: u64,
    /// Contacts of each finger in these approaches that came later than the stroke, and are missing; where only full touches
    /// are kept, of approaches in which all fingers would have touched.
    pub(crate) late: [u64; FINGERS],
    /// Number of these approaches that ended before the first contact, at the end of the travel.
    pub(crate) turned_back: u64,
}

/// Draws the samples of one object.
#[derive(Debug)]
pub struct Sampler<'a> {
    /// One for each instance, or placement of each.
    scenes: &'a [Scene],
    name: &'a str,
    origin: &'a Origin,
    stream: u64,
}

impl<'a> Sampler<'a> {
    /// The samples of the object with this scene and name, made as `origin` says.
    pub(crate) fn new(scene: &'a Scene, name: &'a str, origin: &'a Origin) -> Self {
        Self::of_instances(std::slice::from_ref(scene), name, origin)
    }

    /// The samples of the object with these scenes, of its instances or placements: sample i is of scene i modulo their number. Without a
    /// scene there is no sample: [`sample`](Self::sample) finds the object untouchable.
    pub fn of_instances(scenes: &'a [Scene], name: &'a str, origin: &'a Origin) -> Self {
        let stream = name.bytes().fold(mix(origin.seed), |hash, byte| mix(hash ^ u64::from(byte)));
        Self { scenes, name, origin, stream }
    }

    /// The object's name.
    pub(crate) fn name(&self) -> &str {
        self.name
    }

    /// Sample `index`, and how many approaches it took. Each sample has its own stream of random numbers, from which
    /// approaches are drawn until one is a full touch; when every approach is kept, the first one is the sample.
    ///
    /// # Errors
    /// [`Kind::Untouchable`] when 4 million approaches give no full touch.
    pub fn sample(&self, index: u64) -> Result<(Touch, u64)> {
        self.drawn(index).map(|drawn| (drawn.touch, drawn.approaches))
    }

    /// Sample `index`, with the contacts that the hand did not reach.
    ///
    /// # Errors
    /// Errors of [`sample`](Self::sample).
    pub(crate) fn drawn(&self, index: u64) -> Result<Drawn> {
        self.attempt(index).map_err(|size| untouchable(&[(self.name, size)], self.origin))
    }

    /// Sample `index`, or the size of the object, if it cannot be touched with all fingers.
    fn attempt(&self, index: u64) -> Result<Drawn, DVec3> {
        let mut rng = self.rng(index);
        let probe = &self.origin.probe;
        let turn = index % self.scenes.len().max(1) as u64;
        let scene = usize::try_from(turn).ok().and_then(|turn| self.scenes.get(turn));
        let scene = scene.ok_or(DVec3::ZERO)?;
        // What the real probe adds has a stream of its own, so that the approaches stay the same with it and without.
        let mut added = (!self.origin.real.is_none())
            .then(|| random::generator(self.origin.seed, Purpose::Capture, self.name, index));
        let Noise { grazing, .. } = self.origin.real;
        let (window, mut late, mut turned_back) = (probe.window(), [0; FINGERS], 0);
        for approaches in 1..=MOST_ATTEMPTS {
            let approach = self.draw(&mut rng, scene);
            let distances = match &mut added {
                Some(random) if !grazing.is_none() => grazing.distances(&approach, scene, probe, random),
                _ if self.origin.approaches => approach.distances(scene, probe),
                _ => approach.full_distances(scene, probe).map_or([None; FINGERS], |distances| distances.map(Some)),
            };
            if !self.origin.approaches && distances.contains(&None) {
                continue;
            }
            let (distances, is_turned_back) = probe.within_travel(distances);
            let touch = approach.touch(distances, probe);
            let touch = added.as_mut().map_or(touch, |random| self.origin.real.add_to(&touch, random));
            // The stroke begins with the first contact that is noticed.
            let is_late = hand::late(&touch, window);
            late.iter_mut().zip(is_late).for_each(|(late, is_late)| *late += u64::from(is_late));
            turned_back += u64::from(is_turned_back);
            let touch = hand::within(&touch, window);
            if self.origin.approaches || touch.is_full() {
                return Ok(Drawn { touch, approaches, late, turned_back });
            }
        }
        let [low, high] = scene.bounds();
        Err(high - low)
    }

    /// The object's name and size, if one of its scenes cannot be touched with all fingers: it then cannot be captured.
    pub(super) fn untouched(&self) -> Option<(&'a str, DVec3)> {
        let mut each = self.origin.samples().take(self.scenes.len().max(1));
        each.find_map(|sample| self.attempt(sample).err()).map(|size| (self.name, size))
    }

    /// The first approach that sample `index` draws, to this scene of the object: the sample itself where every approach is
    /// kept.
    pub(crate) fn approach(&self, scene: &Scene, index: u64) -> Approach {
        self.draw(&mut self.rng(index), scene)
    }

    fn draw(&self, rng: &mut Xoshiro256PlusPlus, scene: &Scene) -> Approach {
        let origin = self.origin;
        let clearance = origin.clearance(scene.bounds());
        Approach::draw_to(rng, scene, origin.aim.target(scene), origin.probe.tilt, clearance)
    }

    fn rng(&self, index: u64) -> Xoshiro256PlusPlus {
        Xoshiro256PlusPlus::seed_from_u64(mix(self.stream ^ mix(index)))
    }
}

/// The problem of objects, by name and size, that cannot be touched with all fingers.
pub(super) fn untouchable(objects: &[(&str, DVec3)], origin: &Origin) -> Error {
    let Probe { radius, spacing, .. } = origin.probe;
    let is_true_size = origin.unit == Length::Millimeter;
    let (unit, fix) = match is_true_size {
        false => (
            "units",
            "Give a larger radius, a smaller spacing or a greater length, keep every approach, also those that miss, or leave \
             the object out.",
        ),
        true => (
            "mm",
            "If that is not the size, state another unit of the mesh. Otherwise give a larger radius or a smaller spacing, keep \
             every approach, also those that miss, or leave the object out.",
        ),
    };
    let sized = |(name, size): &(&str, DVec3)| format!("{name} ({} {unit})", sides(*size));
    problem!(
        "{}: none of {MOST_ATTEMPTS} approaches touched with all three fingers, {} {unit} from the first to the third, of radius \
         {radius} {unit}",
        objects.iter().map(sized).collect::<Vec<_>>().join(", "),
        2.0 * spacing
    )
    .fix(fix)
    .as_kind(Kind::Untouchable { objects: objects.iter().map(|(name, _)| (*name).into()).collect(), is_true_size })
}

/// The finalizer of SplitMix64: every bit of the input changes about half of the output's.
fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}
