//! Distance between recorded and simulated touches, feature by feature and as a whole.
//!
//! The one figure is the accuracy of a classifier that divides an object's touches into recorded and simulated ones: trees
//! are trained for just that, and tested on touches that they were not trained on (cross-validation). Guessing is right half
//! of the time. This is a classifier two-sample test: Lopez-Paz and Oquab, Revisiting Classifier Two-Sample Tests,
//! 1610.06545. Each feature is also compared alone, by the largest difference of its distributions (Kolmogorov, Smirnov).
//!
//! The cost of the difference is measured with a model trained on simulated touches: how often it is right on recorded
//! ones, how many more approaches it takes there to be right as often as on simulated ones, and whether a promise that
//! simulated touches support is kept.

mod cost;
mod entry;
mod features;
mod promise;

pub use cost::{Confused, Cost};
pub use features::FeatureComparison;
pub use promise::Promised;

use crate::ensemble::{OverTouches, feature_row, train};
use crate::error::{Error, EvaluateProblem, Result};
use crate::evaluate::{Estimate, Finding};
use crate::in_order::in_order;
use crate::progress::{self, Progress};
use crate::touches::{Dataset, ObjectTouches, folds};
use palpate_shared::format::Counted;
use palpate_shared::{ContactPattern, Descriptor, Touch};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Settings of a comparison of data sets.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// The features that touches are compared by, and that the model is trained on.
    pub descriptor: Descriptor,
    /// Folds of the cross-validation.
    pub folds: usize,
    /// Groups of approaches drawn for each object.
    pub groups: usize,
    /// Seed of the folds and of the drawing.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { descriptor: Descriptor::Curvature, folds: 5, groups: 1_000, seed: 1 }
    }
}

/// The most simulated touches for each recorded one: more say no more.
const MOST: usize = 5;
/// The fewest recorded touches of an object that are compared.
pub const LEAST: usize = 30;
/// Standard errors to either side of an interval of 95 %.
const QUANTILE: f64 = 1.96;
/// A share and its 95 % interval, by the normal approximation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// The share.
    pub value: f64,
    /// The lower end of the interval.
    pub low: f64,
    /// The upper end.
    pub high: f64,
}

impl Share {
    fn of(estimate: Estimate) -> Self {
        let Estimate { value, standard_error } = estimate;
        let end = |sign: f64| (value + sign * QUANTILE * standard_error).clamp(0.0, 1.0);
        Self { value, low: end(-1.0), high: end(1.0) }
    }
}

/// Loss of accuracy below which a simulation is nearly correct, if it is measured after [`ENOUGH`] approaches.
const NEARLY: f64 = 0.02;
/// Approaches after which the loss of accuracy decides.
const ENOUGH: usize = 60;
/// The part of a loss that pairs of objects make for it to be theirs.
const MOSTLY: f64 = 0.5;
/// Loss of accuracy that shows a fault of the simulation.
const STRONGLY: f64 = 0.1;

/// Comparison of recorded and simulated touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The features that they were compared by.
    pub descriptor: String,
    /// Accuracy of a classifier that distinguishes recorded from simulated touches of the same object: 0.5 is guessing.
    /// Each object weighted equally.
    pub told_apart: Share,
    /// The objects that both data sets hold, by name.
    pub objects: Vec<ObjectComparison>,
    /// Cost of the difference; none for fewer than two objects.
    pub cost: Option<Cost>,
    /// True if the simulated touches have the deviations of a real probe, as a fit finds them.
    #[serde(default)]
    pub is_fitted: bool,
    /// Recorded objects whose placement is not stated, and which were simulated in several: compared with all of them, by their
    /// weights.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unstated: Vec<String>,
}

/// Comparison of recorded and simulated touches of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectComparison {
    /// The object's name.
    pub name: String,
    /// Recorded touches, and the simulated ones that they are compared with.
    pub touches: [usize; 2],
    /// Accuracy of a classifier that distinguishes the two: 0.5 is guessing.
    pub told_apart: Share,
    /// The share of each contact pattern among recorded and among simulated touches.
    pub patterns: BTreeMap<String, [f64; 2]>,
    /// Every other feature.
    pub features: Vec<FeatureComparison>,
}

impl Comparison {
    /// Verdict on the simulation, in sentences: by the accuracy that a model trained on it loses on recorded touches and by a
    /// promise that it breaks, since a difference that a classifier finds may cost nothing; by the classifier where there is
    /// no such loss to measure.
    pub fn verdict(&self) -> String {
        if self.told_apart.low <= 0.5 {
            return "No difference was found: the simulation agrees with the recordings.".into();
        }
        let lost = |at, loss: f64| match 100.0 * loss {
            points if points < 0.05 => format!("no accuracy is lost after {at} approaches"),
            points => format!("accuracy after {at} approaches is {points:.1} points lower on recorded touches"),
        };
        let promise = self.cost.as_ref().and_then(|cost| cost.promise);
        let is_broken = promise.is_some_and(|promise| promise.finding == Finding::Broken);
        let broken = if is_broken { ", and a promise is broken" } else { "" };
        match self.cost.as_ref().and_then(Cost::loss) {
            Some((at, loss)) if loss < NEARLY && at >= ENOUGH && !is_broken => {
                format!("The simulation is nearly correct: {}.", lost(at, loss))
            }
            Some((at, loss)) if loss < NEARLY && !is_broken => {
                format!(
                    "They differ slightly: {}. Record {ENOUGH} approaches to each object to see what it costs then.",
                    lost(at, loss)
                )
            }
            Some((at, loss)) if loss < STRONGLY => {
                format!("They differ: {}{broken}. {}", lost(at, loss), self.advice(loss))
            }
            Some((at, loss)) => {
                format!(
                    "They differ strongly: {}{broken}. The simulated probe, a mesh or its size is wrong.",
                    lost(at, loss)
                )
            }
            None if self.told_apart.value < 0.65 => {
                let fit = if self.is_fitted { "" } else { ": fit the probe to recorded touches" };
                format!("They differ{fit}. Two objects or more show what it costs.")
            }
            None => "They differ strongly: the simulated probe, a mesh or its size is wrong.".into(),
        }
    }

    /// Advice where this accuracy is lost: a probe that was fitted is not fitted again for a pair of objects.
    fn advice(&self, loss: f64) -> String {
        if !self.is_fitted {
            return "Fit the probe to recorded touches, or record more of them.".into();
        }
        // Each object weighs the same in the accuracy.
        let objects = self.objects.len().max(1) as f64;
        let confused = self.cost.iter().flat_map(|cost| &cost.confused);
        let by_pairs: f64 = confused.map(|pair| (pair.recorded - pair.simulated) / objects).sum();
        let pair = self.cost.as_ref().and_then(|cost| cost.confused.first());
        match pair.filter(|_| by_pairs >= MOSTLY * loss) {
            Some(Confused { touched, named, .. }) => format!(
                "The simulated probe has a real one's deviations already, and most of the loss is {touched} as {named}: check the mesh \
                 of {touched} and its size, or adjust the model to recordings (`palpate train --teach`)."
            ),
            None => "The simulated probe has a real one's deviations already: check the meshes and their sizes and whether the robot \
                     aims as the simulation does, or adjust the model to recordings (`palpate train --teach`)."
                .into(),
        }
    }
}

/// Compares recorded touches with simulated ones of the same objects. Where approaches that touched nothing were not
/// recorded, simulated ones are left out, and where only full touches were, partial ones.
///
/// Equal touches and settings give equal comparisons on any number of threads.
///
/// # Errors
/// [`EvaluateProblem::Incomparable`] if the data sets share no object, if one holds approaches and the other full touches
/// only, or if an object has fewer than [`LEAST`] touches; as [`train::train`]; [`Error::Cancelled`].
pub fn compare(
    recorded: &Dataset,
    simulated: &Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Comparison> {
    let refuse = |detail: String| Err(Error::from(EvaluateProblem::Incomparable { detail }));
    if settings.folds < 2 {
        return Err(Error::setting("folds", settings.folds, "2 or more"));
    }
    let any = |dataset: &Dataset, is: fn(&Touch) -> bool| dataset.touches().any(is);
    if any(recorded, |touch| !touch.is_full()) && !any(simulated, |touch| !touch.is_full()) {
        return refuse("the recorded touches are of approaches, the simulated ones full touches only".into());
    }
    if !recorded.placement_shares().is_empty() && simulated.placement_shares().is_empty() {
        return refuse("the recordings state placements on a table, and the simulated objects float".into());
    }
    let empties = any(recorded, Touch::is_empty);
    let partial = any(recorded, |touch| !touch.is_full());
    let alike = |touch: &Touch| touch.is_full() || partial && (empties || !touch.is_empty());
    let simulated = simulated.each(|own| own.filtered(alike));
    // By placement, where both sides state it; and without contacts that are late for the stroke that was simulated.
    let recorded = recorded.clone().matching(&simulated.by_placement().names());
    let recorded =
        simulated.probe().map_or(Cow::Borrowed(&recorded), |probe| recorded.delivered_by(probe)).into_owned();
    let pairs: Vec<(&ObjectTouches, ObjectTouches)> =
        recorded.objects.iter().filter_map(|own| Some((own, counterpart(&own.name, &simulated)?))).collect();
    if pairs.is_empty() {
        return refuse("no object is in both".into());
    }
    for (own, other) in &pairs {
        let fewest = own.len().min(other.len());
        if fewest < LEAST {
            return refuse(format!("{} has {fewest} touches to compare, of at least {LEAST}", own.name));
        }
    }
    let counted = if partial { Counted::All } else { Counted::Full };
    let descriptor = match counted {
        Counted::Full => settings.descriptor.for_full_touches(),
        _ => settings.descriptor.for_contacts().unwrap_or(settings.descriptor),
    };
    progress.begin("telling apart", Some(pairs.len() as u64));
    let one = |(own, other): &(&ObjectTouches, ObjectTouches)| {
        let compared = object(own, other, descriptor, counted, settings)?;
        progress::advance(progress, 1)?;
        Ok(compared)
    };
    let compared: Vec<(ObjectComparison, Estimate)> = in_order(pairs.par_iter().map(one))?;
    let told_apart = Share::of(Estimate::mean_of(compared.iter().map(|(_, told)| *told)));
    let recorded = recorded.only(|name| !counterparts(name, &simulated).is_empty());
    let is_unstated = |name: &String| counterparts(name, &simulated).len() > 1;
    Ok(Comparison {
        descriptor: descriptor.name().into(),
        told_apart,
        objects: compared.into_iter().map(|(object, _)| object).collect(),
        cost: cost::cost(&recorded, &simulated, settings, progress)?,
        is_fitted: !simulated.real().is_none(),
        unstated: recorded.names().into_iter().filter(is_unstated).collect(),
    })
}

/// The outputs of a model of the simulated touches that recorded ones of this name may be of, each with its share: one or, of an
/// object that lies on a table in a placement that is not stated, all of its.
fn counterparts(name: &str, simulated: &Dataset) -> Vec<(String, f64)> {
    let of = |object: &ObjectTouches| {
        let Some(weights) = object.placement_weights() else {
            return (object.name == name).then(|| vec![(object.name.clone(), 1.0)]);
        };
        let named = |(placement, weight): (String, f64)| (format!("{}/{placement}", object.name), weight);
        let all: Vec<(String, f64)> = weights.into_iter().map(named).collect();
        match all.iter().find(|(output, _)| output == name) {
            Some((output, _)) => Some(vec![(output.clone(), 1.0)]),
            None => (object.name == name).then_some(all),
        }
    };
    simulated.objects.iter().find_map(of).unwrap_or_default()
}

/// The simulated touches that recorded ones of this name are compared with.
fn counterpart(name: &str, simulated: &Dataset) -> Option<ObjectTouches> {
    let whole = simulated.objects.iter().find(|own| own.name == name).map(ObjectTouches::as_often_as_placed);
    whole.or_else(|| simulated.by_placement().objects.into_iter().find(|own| own.name == name))
}

fn object(
    recorded: &ObjectTouches,
    simulated: &ObjectTouches,
    descriptor: Descriptor,
    counted: Counted,
    settings: &Settings,
) -> Result<(ObjectComparison, Estimate)> {
    let most = (MOST * recorded.len()).max(1_000).min(simulated.len());
    // Of placements as many as their shares say.
    let is_placed = simulated.placement_weights().is_some_and(|weights| weights.len() > 1);
    let simulated = &if is_placed { simulated.thinned(most) } else { first(simulated, most) };
    let told = told_apart([recorded, simulated], counted, settings)?;
    let both = [recorded.touches(), simulated.touches()];
    let share = |pattern: ContactPattern| {
        both.map(|touches| {
            touches.iter().filter(|touch| touch.pattern() == pattern).count() as f64 / touches.len() as f64
        })
    };
    let patterns = ContactPattern::ALL.iter().map(|pattern| (pattern.name().to_owned(), share(*pattern))).collect();
    let rows =
        both.map(|touches| -> Vec<Vec<f32>> { touches.iter().map(|touch| feature_row(descriptor, touch)).collect() });
    let features = (descriptor.feature_names().iter().enumerate()).filter(|(_, name)| **name != "pattern").filter_map(
        |(column, name)| features::feature(name, rows.each_ref().map(|rows| features::values(rows, column))),
    );
    let comparison = ObjectComparison {
        name: recorded.name.clone(),
        touches: both.map(<[Touch]>::len),
        told_apart: Share::of(told),
        patterns,
        features: features.collect(),
    };
    Ok((comparison, told))
}

/// The first touches of an object, equally many of each of its sources, as far as there are.
fn first(object: &ObjectTouches, count: usize) -> ObjectTouches {
    if count >= object.len() {
        return object.clone();
    }
    let mut order: Vec<(usize, usize, usize)> = Vec::new();
    for (source, touches) in object.by_source().into_iter().enumerate() {
        order.extend(touches.into_iter().enumerate().map(|(rank, touch)| (rank, source, touch)));
    }
    order.sort_unstable();
    let mut chosen: Vec<usize> = order.into_iter().take(count).map(|(.., touch)| touch).collect();
    chosen.sort_unstable();
    object.select(chosen)
}

/// Accuracy of trees that distinguish touches of two samples, on touches that they were not trained on; the two samples
/// weigh equally.
fn told_apart([recorded, simulated]: [&ObjectTouches; 2], counted: Counted, settings: &Settings) -> Result<Estimate> {
    let samples = [("recorded", recorded), ("simulated", simulated)].map(|(name, object)| object.clone().renamed(name));
    let both = Dataset::new(samples.into());
    let recipe = train::Settings {
        descriptor: settings.descriptor,
        counted: Some(counted),
        rounds: 40,
        depth: 3,
        eta: 0.1,
        min_child_weight: 4.0,
        bins: 64,
        leaf_bits: None,
        threads: Some(1),
        ..train::Settings::compact()
    };
    let mut right = [0; 2];
    for fold in 0..settings.folds {
        let split = folds::fold(&both, fold, settings.folds, settings.seed)?;
        let trees = train::train(&split.train, &recipe, &())?;
        for (class, object) in split.test.objects.iter().enumerate() {
            let is_right = |touch: &&Touch| {
                let margins = trees.margins(touch);
                margins[class] > margins[1 - class]
            };
            right[class] += object.touches().iter().filter(is_right).count();
        }
    }
    let counts = [recorded.len(), simulated.len()];
    Ok(Estimate::mean_of([0, 1].map(|class: usize| Estimate::share(right[class], counts[class])).into_iter()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::with;

    use crate::probe::noise::Noise;
    use crate::tests::synthetic;

    fn shifted(dataset: &Dataset, noise: &Noise) -> Dataset {
        dataset.each(|own| own.noisy(noise, 3, 1))
    }

    fn quick() -> Settings {
        Settings { groups: 100, ..Settings::default() }
    }

    #[test]
    fn touches_of_one_simulator_are_told_apart_no_better_than_by_guessing() {
        let [one, other] = [1, 2].map(|seed| synthetic::dataset(&[300, 300, 300], seed));
        let compared = compare(&one, &other, &quick(), &()).unwrap();
        assert!(compared.told_apart.low < 0.5 + 0.02 && compared.told_apart.high > 0.48, "{:?}", compared.told_apart);
        assert!(compared.told_apart.value < 0.55, "{:?}", compared.told_apart);
        let alike = compared.objects.iter().flat_map(|own| &own.features).filter(|own| own.words() == "alike").count();
        assert!(alike >= 4, "{compared:?}");
        let cost = compared.cost.unwrap();
        let needed = cost.needed.unwrap();
        assert!(needed < 1.8 * cost.after as f64, "{cost:?}");
        assert_ne!(cost.promise.map(|promise| promise.finding), Some(Finding::Broken), "{cost:?}");
        let again = compare(&one, &other, &quick(), &()).unwrap();
        assert_eq!((again.told_apart, again.cost.unwrap().promise), (compared.told_apart, cost.promise));
    }

    #[test]
    fn a_promise_of_simulated_touches_is_tested_on_recorded_ones() {
        let [one, other] = [1, 2].map(|seed| synthetic::dataset(&[3_000, 3_000, 3_000], seed));
        let promise =
            |recorded: &Dataset| compare(recorded, &other, &quick(), &()).unwrap().cost.unwrap().promise.unwrap();
        let kept = promise(&one);
        assert_eq!(kept.finding, Finding::Kept, "{kept:?}");
        assert!(kept.names > 100.0 && kept.recorded.unwrap() <= kept.rate, "{kept:?}");
        let bent = promise(&shifted(&one, &with!(Noise::default(), bent = [0.0, 40_000.0, 0.0])));
        assert_eq!(bent.finding, Finding::Broken, "{bent:?}");
        assert!(bent.recorded > bent.simulated, "{bent:?}");
    }

    #[test]
    fn a_bent_finger_is_told_apart_and_costs_approaches() {
        let [one, other] = [1, 2].map(|seed| synthetic::dataset(&[300, 300, 300], seed));
        let bent = shifted(&one, &with!(Noise::default(), bent = [0.0, 40_000.0, 0.0]));
        let compared = compare(&bent, &other, &quick(), &()).unwrap();
        assert!(compared.told_apart.low > 0.6, "{:?}", compared.told_apart);
        let worst = |own: &ObjectComparison| own.features.iter().any(|own| own.words().contains("larger"));
        assert!(compared.objects.iter().any(worst), "{compared:?}");
        let cost = compared.cost.unwrap();
        assert!(cost.recorded[&20].value < cost.simulated[&20].value - 0.05, "{cost:?}");
        assert!(cost.needed.is_none_or(|needed| needed > 1.2 * cost.after as f64), "{cost:?}");
    }

    fn blank() -> Comparison {
        Comparison {
            descriptor: "times".into(),
            told_apart: Share { value: 0.53, low: 0.52, high: 0.54 },
            objects: Vec::new(),
            cost: None,
            is_fitted: false,
            unstated: Vec::new(),
        }
    }

    #[test]
    fn a_fitted_probe_is_not_to_be_fitted_again_where_a_pair_of_objects_is_the_matter() {
        let share = |value: f64| Share { value, low: value - 0.01, high: value + 0.01 };
        let object = |name: &str| ObjectComparison {
            name: name.into(),
            touches: [260, 1_300],
            told_apart: share(0.53),
            patterns: BTreeMap::new(),
            features: Vec::new(),
        };
        let said = |is_fitted: bool, recorded: f64| {
            let confused = vec![Confused {
                touched: "scissors".into(),
                named: "hammer".into(),
                touches: 60,
                simulated: 0.08,
                recorded,
            }];
            let cost = Cost {
                known: 9,
                simulated: BTreeMap::from([(60, share(0.881))]),
                recorded: BTreeMap::from([(60, share(0.842))]),
                after: 20,
                needed: None,
                confused,
                promise: None,
            };
            let objects = ["a", "b", "c", "d", "e", "f", "g", "hammer", "scissors"].map(object).into();
            Comparison { cost: Some(cost), objects, is_fitted, ..blank() }.verdict()
        };
        let lost = "They differ: accuracy after 60 approaches is 3.9 points lower on recorded touches.";
        assert_eq!(said(false, 0.6), format!("{lost} Fit the probe to recorded touches, or record more of them."));
        let fitted = said(true, 0.6);
        assert!(fitted.starts_with(lost) && fitted.contains("most of the loss is scissors as hammer"), "{fitted}");
        // A ninth of 5 points does not explain 3.9.
        let elsewhere = said(true, 0.13);
        assert!(elsewhere.contains("check the meshes and their sizes") && !elsewhere.contains("Fit"), "{elsewhere}");
    }

    #[test]
    fn the_verdict_is_of_the_accuracy_lost_and_nearly_correct_takes_sixty_approaches_and_two_points() {
        let share = |value: f64| Share { value, low: value - 0.01, high: value + 0.01 };
        let of = |told: f64, lost: Option<(usize, f64)>, broken: bool| {
            let cost = lost.map(|(at, loss)| Cost {
                known: 2,
                simulated: BTreeMap::from([(5, share(0.5)), (at, share(0.9))]),
                recorded: BTreeMap::from([(5, share(0.1)), (at, share(0.9 - loss))]),
                after: 5,
                needed: None,
                confused: Vec::new(),
                promise: broken.then_some(Promised {
                    rate: 0.01,
                    simulated: Some(0.01),
                    recorded: Some(0.2),
                    names: 100.0,
                    finding: Finding::Broken,
                }),
            });
            Comparison { told_apart: share(told), cost, ..blank() }.verdict()
        };
        let verdict = |told, lost| of(told, lost, false);
        assert!(verdict(0.5, Some((60, 0.5))).starts_with("No difference"));
        // A classifier that is hardly better than chance says nothing of the cost, nor does one that is nearly always right.
        for (told, at, loss, expected) in [
            (0.53, 60, 0.019, "The simulation is nearly correct: accuracy after 60 approaches is 1.9 points lower"),
            (0.95, 60, 0.019, "The simulation is nearly correct: accuracy after 60"),
            (0.53, 60, -0.01, "The simulation is nearly correct: no accuracy is lost after 60 approaches."),
            (0.53, 30, 0.0, "They differ slightly: no accuracy is lost after 30 approaches. Record 60 approaches"),
            (0.53, 60, 0.021, "They differ: accuracy after 60 approaches is 2.1 points lower"),
            (0.53, 20, 0.2, "They differ strongly: accuracy after 20 approaches is 20.0 points lower"),
        ] {
            let found = verdict(told, Some((at, loss)));
            assert!(found.starts_with(expected), "{found}");
        }
        let broken = of(0.53, Some((60, 0.01)), true);
        let expected = "They differ: accuracy after 60 approaches is 1.0 points lower on recorded touches, and a promise is broken.";
        assert!(broken.starts_with(expected), "{broken}");
        assert!(verdict(0.53, None).starts_with("They differ: fit the probe"));
        assert!(verdict(0.7, None).starts_with("They differ strongly"));
    }

    #[test]
    fn objects_that_are_mistaken_for_each_other_on_recorded_touches_only_are_listed() {
        let [one, other] = [1, 2].map(|seed| synthetic::dataset(&[300, 300, 300], seed));
        // What is recorded as object1 feels like object2.
        let mut wrong = one.clone();
        wrong.objects[1] =
            ObjectTouches::new("object1", one.objects[2].touches().to_vec(), crate::touches::Source::Object);
        let cost = compare(&wrong, &other, &quick(), &()).unwrap().cost.unwrap();
        let first = &cost.confused[0];
        assert_eq!((first.touched.as_str(), first.named.as_str()), ("object1", "object2"), "{cost:?}");
        assert!(first.recorded > 0.8 && first.simulated < 0.2, "{first:?}");
        assert!(
            cost.confusions().starts_with(&format!("Mistaken after {} touches: object1 as object2 (", first.touches))
        );
        let same = compare(&one, &other, &quick(), &()).unwrap().cost.unwrap();
        assert_eq!(same.confused, [], "{same:?}");
    }

    #[test]
    fn what_cannot_be_compared_is_refused_with_the_reason() {
        let dataset = synthetic::dataset(&[300, 300], 1);
        let refused = |one: &Dataset, other: &Dataset| match compare(one, other, &quick(), &()).unwrap_err().problem() {
            Some(EvaluateProblem::Incomparable { detail }) => detail.clone(),
            other => panic!("{other:?}"),
        };
        let mut other = dataset.clone();
        other.objects.iter_mut().for_each(|own| own.name += "-other");
        assert!(refused(&dataset, &other).contains("no object"));
        let mut few = dataset.clone();
        few.objects[0] = few.objects[0].select(0..LEAST - 1);
        assert!(refused(&few, &dataset).contains("29 touches"));
        let mut full = dataset.clone();
        full.objects.iter_mut().for_each(|own| *own = own.filtered(Touch::is_full));
        assert!(refused(&dataset, &full).contains("full touches only"));
        let compared = compare(&full, &dataset, &quick(), &()).unwrap();
        assert_eq!(compared.objects[0].patterns["all"], [1.0, 1.0], "partial ones are left out");
    }

    #[test]
    fn one_object_is_compared_without_a_cost() {
        let dataset = synthetic::dataset(&[300, 300], 1);
        let one = dataset.only(|name| name == "object0");
        let noisy = one.each(|own| own.noisy(&Noise::gaussian(1_000.0), 1, 1));
        assert_eq!(compare(&one, &noisy, &quick(), &()).unwrap().cost, None);
    }
}
