//! The lengths, angles and ratios of an object, and how much they may vary.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// Gives an object's lengths, angles and ratios: canonical or varied.
pub(super) struct Proportions(Option<Xoshiro256PlusPlus>);

impl Proportions {
    /// Each value is canonical.
    pub(super) fn canonical() -> Self {
        Self(None)
    }

    /// Each value is varied; the same seed gives the same values.
    pub(super) fn varied(seed: u64) -> Self {
        Self(Some(Xoshiro256PlusPlus::seed_from_u64(seed)))
    }

    /// A value that may be up to a fifth smaller or larger than `value`.
    pub(super) fn about(&mut self, value: f32) -> f32 {
        self.within(value, 0.2)
    }

    /// A value that may be smaller or larger than `value` by at most the fraction `spread`.
    pub(super) fn within(&mut self, value: f32, spread: f32) -> f32 {
        match &mut self.0 {
            None => value,
            Some(random) => value * (1.0 + spread * random.random_range(-1.0..=1.0)),
        }
    }
}
