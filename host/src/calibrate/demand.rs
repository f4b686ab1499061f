//! Touches that are captured when a sequence gets to them: most sequences of most objects end before the last touch.

use crate::capture::Sampler;
use crate::error::Result;
use crate::in_order::in_order;
use crate::probe::hand;
use crate::probe::noise::{self, Noise};
use palpate_shared::Touch;
use rayon::prelude::*;
use std::sync::OnceLock;

/// The touches of one object, each captured the first time that it is needed, on all threads. What they are depends on the
/// order in which they are needed as little as on the threads: sample i is a pure function of seed, object and i.
#[derive(Debug)]
pub(super) struct Demand<'a> {
    sampler: Sampler<'a>,
    /// The number of the sample at position 0.
    first: u64,
    /// The number of the object's instances, which are touched in turn.
    instances: usize,
    /// The stroke of the probe as a time in microseconds: also with noise, a later contact is missing.
    window: Option<u32>,
    /// Without noise, for other models too.
    kept: &'a [OnceLock<Touch>],
    noise: Option<noise::Stream>,
    /// For each instance the number of touches of those before it.
    starts: Vec<usize>,
}

impl<'a> Demand<'a> {
    /// Touches for all places in `kept`; touch i is sample `first` + i.
    pub(super) fn new(
        sampler: Sampler<'a>,
        first: u64,
        instances: usize,
        window: Option<u32>,
        kept: &'a [OnceLock<Touch>],
    ) -> Self {
        let demand =
            Self { sampler, first, instances: instances.max(1), window, kept, noise: None, starts: Vec::new() };
        let instances = demand.by_instance();
        let starts = instances.iter().scan(0, |next, pool| Some(std::mem::replace(next, *next + pool.len())));
        Self { starts: starts.collect(), ..demand }
    }

    /// Adds noise without a bias to each touch.
    pub(super) fn add_noise(&mut self, noise: &Noise, seed: u64) {
        self.noise = (!noise.is_none()).then(|| noise.stream(self.name(), self.kept.len(), seed));
    }

    /// The object's name.
    pub(super) fn name(&self) -> &str {
        self.sampler.name()
    }

    /// Number of touches.
    pub(super) fn len(&self) -> usize {
        self.kept.len()
    }

    /// The positions of the touches of each instance, ascending; of those instances that have any.
    pub(super) fn pools(&self) -> Vec<Vec<u32>> {
        let mut pools = self.by_instance();
        pools.retain(|pool| !pool.is_empty());
        pools
    }

    fn by_instance(&self) -> Vec<Vec<u32>> {
        let mut pools = vec![Vec::new(); self.instances];
        // Below the number of instances, and of samples, which are counted in 32 bits.
        let offset = (self.first % self.instances as u64) as usize;
        (0..self.len()).for_each(|position| pools[(offset + position) % self.instances].push(position as u32));
        pools
    }

    /// The touches at these positions.
    pub(super) fn touches(&self, positions: &[u32]) -> Result<Vec<Touch>> {
        in_order(positions.par_iter().map(|&position| self.touch(position)))
    }

    /// All touches.
    pub(super) fn all(&self) -> Result<Vec<Touch>> {
        in_order((0..self.len()).into_par_iter().map(|position| self.touch(position as u32)))
    }

    fn touch(&self, position: u32) -> Result<Touch> {
        let kept = &self.kept[position as usize];
        let touch = match kept.get() {
            Some(touch) => *touch,
            None => {
                let (touch, _) = self.sampler.sample(self.first + u64::from(position))?;
                *kept.get_or_init(|| touch)
            }
        };
        // As if the touches of one instance came after those of another.
        let turn = (self.first % self.instances as u64) as usize + position as usize;
        let before = self.starts.get(turn % self.instances).copied().unwrap_or(0);
        let index = before + position as usize / self.instances;
        let noisy = |noise: &noise::Stream| noise.add(&touch, index, index as u64);
        Ok(self.noise.as_ref().map_or(touch, |noise| hand::within(&noisy(noise), self.window)))
    }
}
