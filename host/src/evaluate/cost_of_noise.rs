//! Cost of noise to a model that was trained without it.

use super::{Margins, add_noise};
use crate::compile;
use crate::ensemble::train::{self, train};
use crate::error::Result;
use crate::probe::noise::Noise;
use crate::touches::{Dataset, folds};
use serde::Serialize;

/// Touches after which accuracy is compared.
const AT: usize = 10;
/// Groups for each object: enough for a standard error of about 3 % for one object, 1 % for ten.
const GROUPS: usize = 200;
/// Touches of each object that are trained on at most, and tested on at most.
const MOST: [usize; 2] = [6_000, 1_500];
/// Touches of each object that are needed at least.
pub const LEAST: usize = 100;
/// Rounds at most.
const ROUNDS: usize = 30;

/// Accuracy without and with noise, of a model that was trained without.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CostOfNoise {
    /// After this many touches.
    pub touches: usize,
    /// Without noise.
    pub clean: f64,
    /// With it.
    pub noisy: f64,
}

/// Trains on a part of the touches as `settings` say, but without noise and with 30 rounds at most, and tests on
/// others, without and with `noise`. A rough figure: 6,000 touches of each object at most, and few groups. `None` if an
/// object has fewer than 100 touches.
///
/// # Errors
/// Errors of [`train`](fn@train) and [`Margins::new`].
pub fn cost_of_noise(dataset: &Dataset, settings: &train::Settings, noise: &Noise) -> Result<Option<CostOfNoise>> {
    if dataset.objects.iter().any(|object| object.len() < LEAST) {
        return Ok(None);
    }
    let split = folds::split(dataset, 0.2, settings.seed)?;
    let [train_part, mut test] = [(&split.train, MOST[0]), (&split.test, MOST[1])]
        .map(|(part, most)| part.each(|object| object.part(0..most, object.len().max(most))));
    let clean = train::Settings { noise: Noise::default(), rounds: settings.rounds.min(ROUNDS), ..settings.clone() };
    let ensemble = train(&train_part, &clean, &())?;
    let compiled = compile::exact(&ensemble)?;
    let model = compiled.model();
    let accuracy = |test: &Dataset| -> Result<f64> {
        let margins = Margins::new(&model, test)?;
        Ok(margins.curve(AT, GROUPS, settings.seed)?.accuracy(AT).value)
    };
    let clean = accuracy(&test)?;
    // Another seed than that of noise in training.
    add_noise(&mut test, noise, settings.seed.wrapping_add(1))?;
    Ok(Some(CostOfNoise { touches: AT, clean, noisy: accuracy(&test)? }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::synthetic;

    #[test]
    fn much_noise_costs_much_and_none_costs_nothing() {
        let dataset = synthetic::dataset(&[600, 600], 1);
        let settings = train::Settings { rounds: 8, ..train::Settings::compact() };
        let cost = |noise: &Noise| cost_of_noise(&dataset, &settings, noise).unwrap().unwrap();
        let none = cost(&Noise::default());
        assert_eq!(none.clean, none.noisy);
        let much = cost(&Noise::gaussian(200_000.0));
        assert_eq!(much.clean, none.clean);
        assert!(much.noisy < much.clean - 0.1, "{much:?}");
        assert_eq!(cost_of_noise(&synthetic::dataset(&[600, 99], 1), &settings, &Noise::default()).unwrap(), None);
    }
}
