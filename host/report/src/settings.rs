//! Extent of a report's measurements.

use palpate::mesh::builtin::BACKGROUND_SHAPES;
use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Settings of a report. A change of any of these but the command starts it from the beginning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Sources of the objects: see [`palpate::mesh::source::objects`].
    pub sources: Vec<String>,
    /// The command that remakes the report, as its page shows it; may be empty.
    pub command: String,
    /// The seed of everything random.
    pub seed: u64,
    /// Fewer folds, levels, touches and trees; the same figures.
    pub quick: bool,
    /// Origin of the touches: the probe, and the unit of its lengths. The settings beside it state the number of
    /// touches and the seed. Growth and generalization use the
    /// published probe.
    pub capture: Origin,
    /// Noise that a real probe adds to simulated touches where they are compared with recorded ones.
    #[serde(default)]
    pub real: Noise,
    /// A data set of recorded touches of these objects, to compare simulated ones with.
    #[serde(default)]
    pub recorded: Option<PathBuf>,
    /// Full touches captured of each object.
    pub touches: usize,
    /// Folds that the touches are divided into.
    pub folds: usize,
    /// Folds that are trained and tested.
    pub folds_used: usize,
    /// Boosting rounds of the paper's method.
    pub paper_rounds: usize,
    /// Numbers of touches at which cross-validation looks, log-spaced from 10 to 120.
    pub levels: usize,
    /// Groups per object and fold, as in the paper.
    pub groups: usize,
    /// Groups per object and fold, for figures with narrower intervals.
    pub many_groups: usize,
    /// Noise levels from 0 to 10 ms, evenly spaced.
    pub noise_levels: usize,
    /// The noise that our model for noisy sensors is trained with.
    pub noise: Noise,
    /// Folds of the noise figures.
    pub noise_folds: usize,
    /// Approaches to each object that models are trained on which use every contact; a third as many test them.
    pub approaches: u64,
    /// Full touches captured of each object, to estimate the limit.
    pub limit_touches: usize,
    /// Boosting rounds of the ensemble that estimates the limit.
    pub limit_rounds: usize,
    /// Shapes that a background column is trained on.
    pub background_shapes: usize,
    /// Other shapes, which the test of whether touches fit any object learns from.
    pub other_shapes: usize,
    /// True to measure growth and generalization, which use built-in objects no matter what the sources are.
    pub growth: bool,
    /// Numbers of objects in the growth figures.
    pub growth_objects: Vec<usize>,
    /// Numbers of triangles in the growth figures.
    pub growth_triangles: Vec<usize>,
    /// Approaches to each object in the growth figures; a quarter as many more test.
    pub growth_approaches: u64,
    /// Numbers of instances of each kind that are trained on, to see how well others are recognized.
    pub instances: Vec<usize>,
    /// Instances of each kind that are tested on.
    pub test_instances: usize,
    /// Touches of each kind in training, and of each instance in testing.
    pub instance_touches: usize,
}

impl Settings {
    /// Everything the paper did, and a capture large enough for the limit. Growth and generalization are measured only
    /// for the source `builtin`, since they say nothing about other objects.
    pub fn full(sources: Vec<String>, seed: u64) -> Self {
        Self {
            growth: sources == ["builtin"],
            sources,
            command: String::new(),
            seed,
            quick: false,
            capture: Origin::default(),
            real: Noise::default(),
            recorded: None,
            touches: 21_000,
            folds: 10,
            folds_used: 10,
            paper_rounds: 100,
            levels: 30,
            groups: 10,
            many_groups: 300,
            noise_levels: 41,
            noise: Noise::gaussian(5_000.0),
            noise_folds: 10,
            approaches: 60_000,
            limit_touches: 300_000,
            limit_rounds: 80,
            background_shapes: BACKGROUND_SHAPES,
            other_shapes: BACKGROUND_SHAPES,
            growth_objects: vec![2, 5, 10, 20, 50, 100, 256],
            growth_triangles: vec![1_000, 10_000, 100_000, 1_000_000],
            growth_approaches: 4_000,
            instances: vec![1, 2, 4, 8],
            test_instances: 3,
            instance_touches: 12_000,
        }
    }

    /// The same figures in a minute or two.
    pub fn quick(sources: Vec<String>, seed: u64) -> Self {
        Self {
            quick: true,
            touches: 5_000,
            folds_used: 2,
            paper_rounds: 50,
            levels: 12,
            many_groups: 200,
            noise_levels: 6,
            noise_folds: 1,
            approaches: 8_000,
            limit_touches: 30_000,
            limit_rounds: 60,
            background_shapes: BACKGROUND_SHAPES / 5,
            other_shapes: BACKGROUND_SHAPES / 5,
            growth_objects: vec![2, 5, 10, 20],
            growth_triangles: vec![1_000, 10_000, 100_000],
            growth_approaches: 1_200,
            instances: vec![1, 2],
            test_instances: 1,
            instance_touches: 2_000,
            ..Self::full(sources, seed)
        }
    }

    /// The numbers of touches at which cross-validation looks: log-spaced from 10 to 120, rounded, without repeats.
    pub fn levels(&self) -> Vec<usize> {
        let last = self.levels.max(2) - 1;
        let level = |k: usize| (10.0 * 12f64.powf(k as f64 / last as f64)).round() as usize;
        let mut levels: Vec<usize> = (0..=last).map(level).collect();
        levels.dedup();
        levels
    }

    /// The noise levels, in milliseconds: 0 to 10.
    pub fn deviations(&self) -> Vec<f64> {
        let last = self.noise_levels.max(2) - 1;
        (0..=last).map(|k| 10.0 * k as f64 / last as f64).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_the_papers() {
        let settings = Settings::full(vec!["builtin".into()], 1);
        let levels = settings.levels();
        assert_eq!(levels.len(), 30);
        assert_eq!((levels[0], levels[29]), (10, 120));
        let deviations = settings.deviations();
        assert_eq!((deviations[1], deviations[20], deviations[40]), (0.25, 5.0, 10.0));
    }

    #[test]
    fn a_report_on_own_meshes_measures_nothing_on_built_in_ones_unless_asked() {
        assert!(Settings::full(vec!["builtin".into()], 1).growth);
        assert!(!Settings::full(vec!["meshes".into()], 1).growth);
        assert!(!Settings::quick(vec!["builtin".into(), "mug.obj".into()], 1).growth);
    }
}
