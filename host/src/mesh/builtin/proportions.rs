//! The lengths that an object is made of, and how they may vary.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// Gives out an object's lengths: as asked for, or varied.
pub(super) struct Proportions(Option<Xoshiro256PlusPlus>);

impl Proportions {
    /// Every length as asked for.
    pub(super) fn canonical() -> Self {
        Self(None)
    }

    /// Every length varied; the same seed gives the same lengths.
    pub(super) fn varied(seed: u64) -> Self {
        Self(Some(Xoshiro256PlusPlus::seed_from_u64(seed)))
    }

    /// A length, angle or ratio that may be up to a fifth smaller or larger.
    pub(super) fn about(&mut self, value: f32) -> f32 {
        self.within(value, 0.2)
    }

    /// A length, angle or ratio that may be smaller or larger by the fraction `spread` at most.
    pub(super) fn within(&mut self, value: f32, spread: f32) -> f32 {
        match &mut self.0 {
            None => value,
            Some(random) => value * (1.0 + spread * random.random_range(-1.0..=1.0)),
        }
    }
}
