//! Test touches with noise.

use crate::error::Result;
use crate::probe::noise::Noise;
use crate::touches::{Dataset, ObjectTouches};

/// The most robots whose biases are drawn.
pub(crate) const ROBOTS: usize = 20;

/// The touches of each object that a robot makes at least, where there are enough.
const LEAST: usize = 250;

/// Adds noise to test touches and returns how many robots made them in turn: one, unless the noise has a bias. Every group
/// and sequence is then of one robot's touches. Touches that no noise changes stay as they are.
///
/// # Errors
/// Errors of [`Noise::check`].
pub fn add_noise(dataset: &mut Dataset, noise: &Noise, seed: u64) -> Result<usize> {
    noise.check()?;
    let fewest = dataset.objects.iter().map(ObjectTouches::len).min().unwrap_or(0);
    let robots = if noise.has_bias() { (fewest / LEAST).clamp(1, ROBOTS) } else { 1 };
    dataset.add_noise(noise, seed, robots);
    Ok(robots)
}

#[cfg(all(test, feature = "train"))]
mod tests {
    use super::*;
    use crate::compile;
    use crate::ensemble::train::{Settings, train};
    use crate::evaluate::Margins;
    use crate::tests::synthetic;
    use crate::with;
    use std::collections::BTreeSet;

    #[test]
    fn every_group_is_of_one_robots_touches() {
        let mut dataset = synthetic::dataset(&[1_000, 760], 1);
        let ensemble = train(&dataset, &Settings { rounds: 2, ..Settings::compact() }, &()).unwrap();
        let compiled = compile::exact(&ensemble).unwrap();
        let model = compiled.model();
        let noise = with!(Noise::default(), speed_bias = 0.05);
        let robots = add_noise(&mut dataset, &noise, 1).unwrap();
        assert_eq!(robots, 3);
        let margins = Margins::new(&model, &dataset).unwrap();
        assert_eq!(margins.fewest_touches(), 253);
        for position in [0, 1] {
            let mut seen = BTreeSet::new();
            for group in 0..30 {
                let drawn: Vec<usize> = margins.draw(position, group, 100, 1).map(|touch| touch as usize).collect();
                let pool = &dataset.objects[position].pools()[group % robots];
                assert!(drawn.iter().all(|touch| pool.range.contains(touch)));
                assert_eq!(drawn.iter().collect::<BTreeSet<_>>().len(), 100);
                seen.insert(pool.robot);
            }
            assert_eq!(seen.len(), robots);
        }
        assert!(margins.curve(254, 10, 1).is_err());
    }

    #[test]
    fn every_group_is_of_one_instances_touches_and_one_robots() {
        let mut dataset = synthetic::dataset(&[1_000, 760], 1);
        let ensemble = train(&dataset, &Settings { rounds: 2, ..Settings::compact() }, &()).unwrap();
        let compiled = compile::exact(&ensemble).unwrap();
        let model = compiled.model();
        let names = ["a", "b", "c", "d"].map(String::from);
        let object = &dataset.objects[1];
        dataset.objects[1] = ObjectTouches::in_turn(object.name.clone(), object.touches().to_vec(), &names, 0);
        let bias = with!(Noise::default(), pose_bias = 1.0);
        for (robots, turns) in [(1, [1, 4]), (3, [3, 12]), (2, [2, 4])] {
            let mut of_robots = dataset.clone();
            of_robots.add_noise(&bias, 1, robots);
            let margins = Margins::new(&model, &of_robots).unwrap();
            for (position, turns) in turns.into_iter().enumerate() {
                for group in 0..30 {
                    let mut drawn = margins.draw(position, group, 20, 1).map(|touch| touch as usize);
                    let pools = of_robots.objects[position].pools();
                    let pool = &pools[group % turns].range;
                    assert!(pools.len() == turns && drawn.all(|touch| pool.contains(&touch)), "{robots} robots");
                }
            }
        }
    }

    #[test]
    fn without_a_bias_nothing_is_divided_and_no_noise_changes_nothing() {
        let clean = synthetic::dataset(&[1_000, 1_000], 1);
        let mut noisy = clean.clone();
        assert_eq!(add_noise(&mut noisy, &Noise::default(), 1).unwrap(), 1);
        assert_eq!(noisy, clean);
        assert_eq!(add_noise(&mut noisy, &Noise::gaussian(1_000.0), 1).unwrap(), 1);
        assert_ne!(noisy, clean);
        assert!(add_noise(&mut noisy, &Noise::gaussian(-1.0), 1).is_err());
    }
}
