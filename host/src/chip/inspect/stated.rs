//! Statements of a compiled model: its features, its training, its promise.

use crate::rows::{Encoder, feature_names};
use crate::{calibrate, compile, evaluate, probe};
use palpate_onboard::{Model, Stopping};
use palpate_shared::ContactPattern;
use palpate_shared::format::{Length, Limits, MisfitTerms, TrainedNoise, TrainedProbe};
use std::collections::BTreeMap;

/// A feature of a model over rows.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Feature {
    /// The name.
    pub name: String,
    /// Units that make up 1; null where f32 values are compared.
    pub scale: Option<f32>,
}

/// The values of a feature that a model takes in a row of a sequence, as a program measures them.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Limited {
    /// The feature's name.
    pub feature: String,
    /// The least value; null for any.
    pub low: Option<f64>,
    /// The largest value; null for any.
    pub high: Option<f64>,
    /// True if the feature may be missing.
    pub may_miss: bool,
    /// The most rows one after the other with the same value, or without one; null for any number.
    pub most_equal: Option<u32>,
}

impl Limited {
    /// True if a row is refused for some value of the feature.
    pub const fn is_limited(&self) -> bool {
        self.low.is_some() || self.high.is_some() || !self.may_miss || self.most_equal.is_some()
    }
}

/// Default end of recognizers' sequences.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Defaults {
    /// The error rate at which recognizers stop.
    pub error_rate: f64,
    /// The touches after which they give up.
    pub max_touches: u32,
}

/// A promise, and its basis.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Promised {
    /// The promised share of wrong names.
    pub error_rate: f64,
    /// "average", "name" or "object".
    pub per: &'static str,
    /// The probability that the promise is kept.
    pub confidence: f64,
    /// "touches", "approaches" or "rows".
    pub counted: &'static str,
    /// True if each approach was in the pose that the plan proposed.
    pub active: bool,
    /// True if the promise is for new groups of sequences, such as persons.
    pub groups: bool,
    /// The sequences that it rests on.
    pub sequences: u32,
    /// Names given in these sequences.
    pub given: u32,
    /// Wrong ones of them.
    pub wrong: u32,
    /// The share of sequences that ended without a name.
    pub undecided: f64,
    /// Touches, approaches or rows of a sequence on average.
    pub mean: f64,
    /// The touches after which they give up.
    pub max_touches: u32,
    /// Noise added to the touches.
    pub noise: probe::noise::Noise,
    /// Nats by which an object has to be ahead of all others for its name to be given.
    pub margins: BTreeMap<String, f64>,
    /// Largest error rate by theory, with any priors.
    pub by_theory: f64,
}

/// A test of whether touches fit any object that a model knows.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Tested {
    /// The promised share of known objects' sequences that end as unknown.
    pub promised: f64,
    /// The probability that the promise is kept.
    pub confidence: f64,
    /// The sequences that it rests on.
    pub sequences: u32,
    /// Touches before which nothing is tested, and no name is given.
    pub first_touches: u32,
    /// The misfit above which an object is unknown, after many touches, in nats.
    pub threshold: f64,
}

pub(super) fn tested(terms: &MisfitTerms) -> Tested {
    Tested {
        promised: f64::from(terms.alarms) / 1e6,
        confidence: f64::from(terms.confidence) / 1e6,
        sequences: terms.sequences,
        first_touches: terms.first,
        threshold: f64::from(terms.threshold) / 65_536.0,
    }
}

/// A probe.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Probe {
    /// Radius of a finger; null if the model does not state its probe.
    pub radius: Option<f32>,
    /// The distance between neighboring fingers.
    pub spacing: f32,
    /// The speed, per second.
    pub speed: f32,
    /// Unit of lengths: "unit", a tenth of the object's longest side, or "mm".
    pub unit: &'static str,
    /// Way that the hand goes on after the first contact; null: past the object.
    pub stroke: Option<f32>,
    /// Way that it goes from its start before an approach is a miss; null: past the object.
    pub travel: Option<f32>,
    /// Length by which a recorded contact may be later than the stroke; null: two hundredths of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stroke_tolerance: Option<f32>,
    /// Largest angle between approaches and straight down, in degrees, where objects lie on a table; null: they float.
    pub cone: Option<f64>,
    /// True if the model states its probe; otherwise the published one is assumed.
    pub stated: bool,
}

/// The touches that are evidence.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Touches {
    /// "full", "contacts" or "all".
    pub counted: &'static str,
    /// The contact patterns that are evidence.
    pub patterns: Vec<&'static str>,
    /// True if touches need the probe's direction and alignment.
    pub needs_pose: bool,
    /// The largest time between the first and the last contact in microseconds; null if the model does not state it.
    pub largest_spread: Option<u32>,
}

/// The noise in a training.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Noise {
    /// The least standard deviation of contact times in microseconds.
    pub least: u32,
    /// The largest standard deviation.
    pub largest: u32,
    /// The timer's resolution in microseconds; 0 for none.
    pub timer: u32,
    /// Standard deviation of the pose in degrees; 0 for none.
    pub pose_degrees: f64,
}

/// Columns of the library's rows that a model has as its features.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct SomeColumns {
    /// Columns of the library's rows.
    pub all: usize,
    /// The number of each feature's column, from 0.
    pub used: Vec<usize>,
}

/// The prediction of a model over rows.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Predicts {
    /// "class", "value" or "targets".
    pub what: &'static str,
    /// Function from a margin to a value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link: Option<&'static str>,
    /// Factor from a margin of the model to the library's: the largest of the outputs'.
    pub scale: f32,
    /// For each output of a regression its own factor and what is added after it; absent where nothing is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scales_and_offsets: Vec<[f32; 2]>,
    /// Number that a margin is divided by before the link; absent if that is 1.
    #[serde(skip_serializing_if = "is_one")]
    pub average: u32,
    /// True if the last of several largest margins names the class.
    pub last_of_ties: bool,
    /// The least and the largest of the features that stand for a missing value: whole numbers, or keys of f32 values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<[i32; 2]>,
}

/// True for 1.
fn is_one(number: &u32) -> bool {
    *number == 1
}

pub(super) fn predicts(model: &Model<'_>) -> Option<Predicts> {
    let prediction = model.prediction();
    let is_value = model.object_count() == 1 || prediction.targets;
    model.descriptor().is_none().then(|| Predicts {
        what: match (prediction.targets, is_value) {
            (true, _) => "targets",
            (false, true) => "value",
            (false, false) => "class",
        },
        link: is_value.then(|| prediction.link.name()),
        scale: prediction.scale,
        scales_and_offsets: (0..model.object_count())
            .filter_map(|output| model.output_scale(output).map(|own| [own.scale, own.offset]))
            .collect(),
        average: prediction.average,
        last_of_ties: prediction.last_of_ties,
        missing: model.sentinel().map(|sentinel| [sentinel.low, sentinel.high]),
    })
}

/// The features of a model over rows.
pub(super) fn features(model: &Model<'_>) -> Vec<Feature> {
    let scales: Vec<Option<f32>> = match Encoder::of(model) {
        Encoder::Real => vec![None; model.feature_count()],
        Encoder::Scaled(scales) => scales.into_iter().map(Some).collect(),
    };
    feature_names(model).into_iter().zip(scales).map(|(name, scale)| Feature { name, scale }).collect()
}

/// The name of the feature that is a row's number in its sequence.
pub(super) fn position(model: &Model<'_>) -> Option<String> {
    let position = model.position()?;
    feature_names(model).into_iter().nth(position.feature.into())
}

/// The limits of each feature in the rows of a sequence.
pub(super) fn guard(model: &Model<'_>) -> Option<Vec<Limited>> {
    let guard = model.guard()?;
    let encoder = Encoder::of(model);
    let limited = |((number, feature), limits): ((usize, String), Limits)| {
        let value = |own: i32, end: i32| {
            Some(own).filter(|own| *own != end).map(|own| encoder.value(number, own)).filter(|value| value.is_finite())
        };
        Limited {
            feature,
            low: value(limits.low, i32::MIN),
            high: value(limits.high, i32::MAX),
            may_miss: limits.may_miss,
            most_equal: Some(limits.most_equal).filter(|most| *most > 0),
        }
    };
    Some(feature_names(model).into_iter().enumerate().zip(guard.limits()).map(limited).collect())
}

/// The probe that a model states, or the one that its header assumes.
pub(super) fn probe(model: &Model<'_>) -> Probe {
    match model.probe() {
        Some(TrainedProbe { radius, spacing, speed, length, stroke, travel, cone, stroke_tolerance }) => {
            let (radius, unit) = (Some(radius), length.name());
            let cone = (cone > 0).then(|| f64::from(cone) / 100.0);
            Probe { radius, spacing, speed, unit, stroke, travel, stroke_tolerance, cone, stated: true }
        }
        None => {
            let header = model.header();
            Probe {
                radius: None,
                spacing: header.spacing(),
                speed: header.speed(),
                unit: Length::Tenth.name(),
                stroke: None,
                travel: None,
                stroke_tolerance: None,
                cone: None,
                stated: false,
            }
        }
    }
}

pub(super) fn promised(model: &Model<'_>) -> Option<Promised> {
    let promise = model.promise()?;
    let stopping = Stopping::from_model(model);
    let margin = |object| calibrate::margin_of(stopping.odds_of(object, model));
    Some(Promised {
        error_rate: promise.rate,
        per: promise.per.name(),
        confidence: promise.confidence,
        counted: match () {
            () if model.descriptor().is_none() => "rows",
            () if promise.approaches => "approaches",
            () => "touches",
        },
        active: promise.active,
        groups: promise.groups,
        sequences: promise.sequences,
        given: promise.given,
        wrong: promise.wrong,
        undecided: 1.0 - f64::from(promise.given) / f64::from(promise.sequences.max(1)),
        mean: f64::from(promise.mean_thousandths) / 1e3,
        max_touches: promise.max_touches,
        noise: crate::probe::noise::Noise::of_promise(&promise.noise),
        margins: compile::names(model)
            .into_iter()
            .take(model.known_count())
            .enumerate()
            .map(|(object, name)| (name, margin(object)))
            .collect(),
        by_theory: evaluate::by_theory(model),
    })
}

pub(super) fn priors<'a>(model: &Model<'a>) -> Option<BTreeMap<&'a str, f64>> {
    let objects = 0..model.object_count();
    let prior = |object| f64::from(model.prior(object)) * f64::from(model.unit());
    let is_flat = objects.clone().all(|object| model.prior(object) == model.prior(0));
    (!is_flat).then(|| objects.map(|object| (model.object_name(object), prior(object))).collect())
}

pub(super) fn evidence(model: &Model<'_>) -> Touches {
    let trained = model.trained_touches();
    Touches {
        counted: trained.counted.name(),
        patterns: trained.patterns.iter().map(ContactPattern::name).collect(),
        needs_pose: trained.needs_pose,
        largest_spread: (trained.largest_spread < u32::MAX).then_some(trained.largest_spread),
    }
}

pub(super) fn noise(model: &Model<'_>) -> Option<Noise> {
    let TrainedNoise { least, largest, timer, pose } = model.noise()?;
    Some(Noise { least, largest, timer, pose_degrees: f64::from(pose) / 1000.0 })
}

pub(super) fn pattern(model: &Model<'_>) -> Option<BTreeMap<&'static str, f64>> {
    // Three digits: they are stored in steps of 1/65535.
    let share = |share: u16| (f64::from(share) / 65.535).round() / 1000.0;
    let shares = model.pattern_shares()?.0.map(share);
    Some(ContactPattern::ALL.iter().map(|pattern| pattern.name()).zip(shares).collect())
}

/// The plan of approaches.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PlanOf {
    /// Rolls of the row of fingers for each of 26 directions.
    pub rolls: u8,
    /// All poses.
    pub poses: u16,
    /// Poses in which nothing is ever touched.
    pub left_out: usize,
}

pub(super) fn plan(model: &Model<'_>) -> Option<PlanOf> {
    let plan = model.plan()?;
    let poses = plan.poses();
    let left_out = (0..poses.count()).filter(|&pose| !plan.may_touch(pose)).count();
    Some(PlanOf { rolls: poses.rolls(), poses: poses.count(), left_out })
}
