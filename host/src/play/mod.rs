//! A game: objects that are touched one approach after the other, and models that follow, side by side, on the same touches.
//!
//! The page of `palpate play` plays it, with these lines compiled to WebAssembly (`host/web`). Approach k of a round is
//! sample k of a capture with the round's seed: what is touched on the page can be captured again by the program.
//!
//! ```
//! use palpate::compile::CompiledModel;
//! use palpate::mesh::Mesh;
//! use palpate::play::Game;
//! use palpate::touches::Origin;
//!
//! # fn main() -> palpate::Result<()> {
//! # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/household.palpate");
//! # if !std::path::Path::new(path).exists() { return Ok(()) }
//! let compiled = CompiledModel::read(path)?;
//! let mut game = Game::new(&Origin::default());
//! let globe = game.add_object("globe", &Mesh::globe(20), 10.0)?;
//! game.add_model(compiled.model())?;
//! let mut round = game.round(globe, 1).expect("an object of the game");
//! while round.players.iter().any(|player| !player.is_done()) {
//!     let approached = game.touch_at_random(&mut round);
//!     println!("{:?}", approached.touch.times());
//! }
//! println!("{:?} after {} approaches", round.players[0].recognizer.verdict(), round.players[0].approaches);
//! # Ok(())
//! # }
//! ```

mod pack;
mod table;

pub use pack::{compress, decompress, pack, unpack};
pub use table::Hidden;

use crate::capture::Sampler;
use crate::error::Result;
use crate::evaluate::raw_features;
use crate::mesh::Mesh;
use crate::probe::approach::{Approach, FINGERS};
use crate::probe::hand::{self, Unreached};
use crate::probe::noise::Noise;
use crate::probe::scene::Scene;
use crate::touches::Origin;
use glam::DVec3;
use palpate_onboard::{Model, Proposal, Recognizer, Refused, Stopping, Verdict};
use palpate_shared::Touch;

/// The most approaches that are drawn to find one in a pose. Of 104 poses the rarest is one approach in about 300.
const MOST_DRAWN: u64 = 100_000;

/// Parts of a game: objects, models, and the noise that is added to touches.
#[derive(Debug)]
pub struct Game<'m> {
    origin: Origin,
    objects: Vec<Target>,
    models: Vec<Model<'m>>,
    noise: Noise,
}

/// An object to touch.
#[derive(Debug)]
struct Target {
    name: String,
    scene: Scene,
}

/// An object being touched, and what every model knows about it.
#[derive(Clone, Debug)]
pub struct Round<'m> {
    object: usize,
    origin: Origin,
    /// The number of the next sample.
    next: u64,
    /// The models, in the game's order.
    pub players: Vec<Player<'m>>,
}

/// A model in a round.
#[derive(Clone, Debug)]
pub struct Player<'m> {
    /// Its recognizer.
    pub recognizer: Recognizer<'m, 256>,
    /// Approaches up to its verdict, including those that are not evidence to it.
    pub approaches: u32,
    /// Reason why the last approach was no evidence to it, if it was not.
    pub refused: Option<Refused>,
}

/// One approach, and its result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approached {
    /// The probe's approach.
    pub approach: Approach,
    /// Distance that each finger moved to its contact, in units; none for one that missed.
    pub distances: [Option<f64>; FINGERS],
    /// Reason why a finger with an object in its way has no contact: the hand had stopped.
    pub unreached: [Option<Unreached>; FINGERS],
    /// The touch as it was.
    pub exact: Touch,
    /// The touch as the sensor reports it, with noise, for the models.
    pub touch: Touch,
}

impl<'m> Game<'m> {
    /// A game without objects and models, in which objects are touched as `origin` says: of it count unit, probe (with its stroke and travel) and aim.
    pub fn new(origin: &Origin) -> Self {
        let origin = Origin { approaches: true, pose: true, ..origin.clone() };
        Self { origin, objects: Vec::new(), models: Vec::new(), noise: Noise::default() }
    }

    /// Adds an object, scaled so that its longest side has `length` units; returns its number.
    ///
    /// # Errors
    /// Errors of [`Scene::new`], and as [`Probe::check`](crate::probe::Probe::check) for a probe that does not suit it.
    pub fn add_object(&mut self, name: &str, mesh: &Mesh, length: f64) -> Result<usize> {
        self.origin.probe.check(length)?;
        self.objects.push(Target { name: name.into(), scene: Scene::new(mesh, length)? });
        Ok(self.objects.len() - 1)
    }

    /// Adds a model, which takes part in rounds from the next on; returns its number.
    ///
    /// # Errors
    /// When the model is over rows of features.
    pub fn add_model(&mut self, model: Model<'m>) -> Result<usize> {
        if model.descriptor().is_none() {
            return Err(raw_features());
        }
        self.models.push(model);
        Ok(self.models.len() - 1)
    }

    /// Sets the noise of touches from the next one on.
    ///
    /// # Errors
    /// Errors of [`Noise::check`]; nothing changes then.
    pub fn set_noise(&mut self, noise: Noise) -> Result<()> {
        noise.check()?;
        self.noise = noise;
        Ok(())
    }

    /// An object's surface.
    pub fn scene(&self, object: usize) -> Option<&Scene> {
        self.objects.get(object).map(|target| &target.scene)
    }

    /// Begins to touch an object; `None` if there is no such object. The seed determines all random numbers.
    pub fn round(&self, object: usize, seed: u64) -> Option<Round<'m>> {
        self.objects.get(object)?;
        let player = |model| {
            let recognizer = Recognizer::new(model, Stopping::from_model(model)).ok()?;
            Some(Player { recognizer, approaches: 0, refused: None })
        };
        // There is room for as many objects as a model can have.
        let players = self.models.iter().filter_map(player).collect();
        Some(Round { object, origin: Origin { seed, ..self.origin.clone() }, next: 0, players })
    }

    /// The next approach at random.
    ///
    /// # Panics
    /// If the round is one of another game, which has more objects.
    pub fn touch_at_random(&self, round: &mut Round<'m>) -> Approached {
        let target = &self.objects[round.object];
        let approach = Sampler::new(&target.scene, &target.name, &round.origin).approach(&target.scene, round.next);
        self.touch(round, approach)
    }

    /// The next approach at random among those in the pose that a model's plan proposes; `None` without a plan, or where
    /// it proposes nothing.
    ///
    /// # Panics
    /// Errors of [`touch_at_random`](Self::touch_at_random).
    pub fn touch_as_planned(&self, round: &mut Round<'m>, player: usize) -> Option<Approached> {
        let player = round.players.get(player)?;
        let (poses, proposal) = (player.recognizer.model().plan()?.poses(), player.proposal()?);
        let target = &self.objects[round.object];
        let sampler = Sampler::new(&target.scene, &target.name, &round.origin);
        for sample in round.next..round.next.saturating_add(MOST_DRAWN) {
            let approach = sampler.approach(&target.scene, sample);
            if poses.number_of(&approach.pose()) == proposal.pose {
                round.next = sample;
                return Some(self.touch(round, approach));
            }
        }
        None
    }

    /// An approach whose middle finger moves along a line, as somebody who looks at the object points at it. The row of
    /// fingers is perpendicular to it and rolled about it by `roll` radians. `None`, and nothing happens, if the middle
    /// finger touches nothing.
    ///
    /// # Panics
    /// Errors of [`touch_at_random`](Self::touch_at_random).
    pub fn touch_along(&self, round: &mut Round<'m>, point: DVec3, direction: DVec3, roll: f64) -> Option<Approached> {
        let scene = &self.objects[round.object].scene;
        let bounds @ [low, high] = scene.bounds();
        let direction = direction.try_normalize()?;
        let center = (low + high) / 2.0;
        let nearest = point + direction * (center - point).dot(direction);
        // As far out as approaches at random start.
        let reach = (high - low).length() / 2.0 + self.origin.clearance(bounds);
        let back = reach * reach - nearest.distance_squared(center);
        let start = nearest - direction * (back > 0.0).then(|| back.sqrt())?;
        let across = direction.any_orthonormal_vector();
        let (sin, cos) = libm::sincos(roll);
        let approach = Approach { start, direction, alignment: across * cos + direction.cross(across) * sin };
        scene.first_contact(start, direction, self.origin.probe.radius)?;
        Some(self.touch(round, approach))
    }

    fn touch(&self, round: &mut Round<'m>, approach: Approach) -> Approached {
        let (target, probe) = (&self.objects[round.object], &self.origin.probe);
        let way = approach.distances(&target.scene, probe);
        let (distances, is_turned_back) = probe.within_travel(way);
        let window = probe.window();
        let whole = approach.touch(distances, probe);
        // As in a capture: contacts later than the stroke are missing, and what is left gets the noise.
        let exact = hand::within(&whole, window);
        // A seed for every approach: its noise does not depend on how many there were before.
        let seed = (round.origin.seed << 32).wrapping_add(round.next);
        let noisy = if self.noise.is_none() { None } else { self.noise.add(&target.name, &[exact], seed).pop() };
        let touch = noisy.unwrap_or(exact);
        let [late, pushed] = [&whole, &touch].map(|touch| hand::late(touch, window));
        let unreached = std::array::from_fn(|finger| match way[finger] {
            Some(_) if is_turned_back => Some(Unreached::Travel),
            _ => (late[finger] || pushed[finger]).then_some(Unreached::Stroke),
        });
        let touch = hand::within(&touch, window);
        let distances = std::array::from_fn(|finger| distances[finger].filter(|_| unreached[finger].is_none()));
        round.next += 1;
        round.players.iter_mut().for_each(|player| player.take(&touch));
        Approached { approach, distances, unreached, exact, touch }
    }
}

impl<'m> Player<'m> {
    fn take(&mut self, touch: &Touch) {
        if !self.is_done() {
            self.approaches = self.approaches.saturating_add(1);
            self.refused = self.recognizer.push(touch).err();
        }
    }

    /// True if it has a verdict, or gave up.
    pub fn is_done(&self) -> bool {
        self.recognizer.verdict() != Verdict::Undecided
    }

    /// The posterior of each object as the thresholds see it: of the evidence as it is, without the model's temperature.
    pub fn posteriors(&self) -> Vec<f64> {
        let model = self.recognizer.model();
        let evidence = self.recognizer.evidence();
        let nats = |object| {
            let units = evidence.get(object).copied().unwrap_or_else(|| model.prior(object).into());
            units as f64 * f64::from(model.unit())
        };
        let nats: Vec<f64> = (0..model.object_count()).map(nats).collect();
        let most = nats.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = nats.iter().map(|nats| libm::exp(nats - most)).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / sum).collect()
    }

    /// The posterior that each object has to reach to be recognized.
    pub fn thresholds(&self) -> Vec<f64> {
        let model = self.recognizer.model();
        let stopping = Stopping::from_model(model);
        let odds = |object| stopping.odds_of(object, model) as f64 / 2.0_f64.powi(56);
        (0..model.object_count()).map(|object| 1.0 / (1.0 + odds(object))).collect()
    }

    /// The approach that its plan proposes next; `None` without a plan.
    pub fn proposal(&self) -> Option<Proposal> {
        let poses = self.recognizer.model().plan()?.poses();
        self.recognizer.next_approach(0..poses.count())
    }
}
