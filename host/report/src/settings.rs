//! Extent of a report's measurements.

use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use serde::Serialize;

/// A section of the report that can be chosen, with what it measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// Objects, what was captured, and densities of curvature: the paper's figures 5 and 6.
    Objects,
    /// Accuracy and confusion by cross-validation: figures 8 and 9.
    Accuracy,
    /// Noise on contact times: figures 10 to 13.
    Noise,
    /// The best accuracy that any classifier could reach.
    Limit,
    /// Promised error rates, kept or broken.
    Promises,
    /// Speed and bytes against error.
    Cost,
}

impl Part {
    /// All of them, in the order of the page.
    pub const ALL: [Self; 6] = [Self::Objects, Self::Accuracy, Self::Noise, Self::Limit, Self::Promises, Self::Cost];

    /// Its name, which is also that of its stage.
    pub fn name(self) -> &'static str {
        match self {
            Self::Objects => "objects",
            Self::Accuracy => "accuracy",
            Self::Noise => "noise",
            Self::Limit => "limit",
            Self::Promises => "promises",
            Self::Cost => "cost",
        }
    }
}

/// Numbers that a quick report may shorten: the name of each, the parts that depend on it, and its value.
type Extent = (&'static str, &'static [Part], fn(&Settings) -> usize);

const LARGE: &[Part] = &[Part::Limit, Part::Promises, Part::Cost];
const EXTENTS: [Extent; 12] = [
    ("full touches of each object", &Part::ALL, |of| of.touches),
    ("folds", &[Part::Accuracy], |of| of.folds_used),
    ("rounds of the paper's method", &Part::ALL, |of| of.paper_rounds),
    ("numbers of touches looked at", &[Part::Accuracy], |of| of.levels),
    ("groups of each object and fold", &[Part::Accuracy, Part::Noise], |of| of.many_groups),
    ("noise levels", &[Part::Noise], |of| of.noise_levels),
    ("folds with noise", &[Part::Noise], |of| of.noise_folds),
    ("touches of each object in the large capture", LARGE, |of| of.limit_touches),
    ("rounds of the large ensemble", &[Part::Limit], |of| of.limit_rounds),
    ("groups of each object for the limit", &[Part::Limit], |of| of.limit_groups),
    ("sequences for promises", &[Part::Promises], |of| of.promise_sequences),
    ("groups of each object for each model of the family", &[Part::Cost], |of| of.cost_groups),
];

/// Settings of a report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Sources of the objects: see [`palpate::mesh::source::objects`].
    pub sources: Vec<String>,
    /// The command that remakes the report, as its page shows it; may be empty.
    pub command: String,
    /// The seed of everything random.
    pub seed: u64,
    /// Fewer folds, levels, touches and trees; the same figures.
    pub quick: bool,
    /// Sections to measure and show.
    pub parts: Vec<Part>,
    /// Origin of the touches: the probe, and the unit of its lengths. The settings beside it state the number of
    /// touches and the seed.
    pub capture: Origin,
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
    /// Full touches captured of each object, to estimate the limit.
    pub limit_touches: usize,
    /// Boosting rounds of the ensemble that estimates the limit.
    pub limit_rounds: usize,
    /// Groups of each object's touches of the large capture that estimate the limit.
    pub limit_groups: usize,
    /// Sequences of all objects together that promises rest on.
    pub promise_sequences: usize,
    /// Groups of each object that each model of the family is tested on.
    pub cost_groups: usize,
}

impl Settings {
    /// Everything the paper did, and a capture large enough for the limit.
    pub fn full(sources: Vec<String>, seed: u64) -> Self {
        Self {
            sources,
            command: String::new(),
            seed,
            quick: false,
            parts: Part::ALL.into(),
            capture: Origin::default(),
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
            limit_touches: 300_000,
            limit_rounds: 80,
            limit_groups: 3_000,
            promise_sequences: 100_000,
            cost_groups: 1_500,
        }
    }

    /// Settings for all figures on less data: the report says what they shorten.
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
            limit_touches: 30_000,
            limit_rounds: 60,
            limit_groups: 1_000,
            promise_sequences: 4_000,
            cost_groups: 500,
            ..Self::full(sources, seed)
        }
    }

    /// Numbers in which the chosen parts differ from those of a full report: the name of each, here and there.
    pub(super) fn shortened(&self) -> Vec<(&'static str, usize, usize)> {
        let full = Self::full(Vec::new(), self.seed);
        let chosen = |extent: &Extent| extent.1.iter().any(|part| self.parts.contains(part));
        let numbers = |(name, _, of): Extent| (name, of(self), of(&full));
        EXTENTS.into_iter().filter(chosen).map(numbers).filter(|own| own.1 != own.2).collect()
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
    fn a_quick_report_says_what_it_shortens_of_the_parts_that_it_has() {
        let names = |parts: &[Part]| -> Vec<&str> {
            let settings = Settings { parts: parts.into(), ..Settings::quick(vec!["meshes".into()], 1) };
            settings.shortened().into_iter().map(|own| own.0).collect()
        };
        assert_eq!(names(&Part::ALL).len(), EXTENTS.len(), "a number is not shortened, or not listed");
        assert!(names(&[Part::Noise]).contains(&"noise levels") && !names(&[Part::Limit]).contains(&"noise levels"));
        assert!(Settings::full(vec!["builtin".into()], 1).shortened().is_empty());
        assert!(Settings::quick(vec!["a".into()], 1).shortened().contains(&("folds", 2, 10)));
    }
}
