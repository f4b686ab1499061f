//! From touches to an ensemble.
//!
//! The trainer ([`palpate_trees::train`]) is gradient boosting with softmax loss over histograms, XGBoost's algorithm and parameters.
//! Presets: the published method; and a compact one, whose trees hold one leaf value for each object, so that one walk through a
//! tree serves all objects, with two of fewer trees for less flash.
//!
//! Every object is weighted equally, however many touches it has: touches are weighted by the inverse of their object's
//! share. Otherwise each margin would hold the log of that share, and summing margins over touches would count that prior
//! once per touch instead of once.

use crate::ensemble::{
    Ensemble, MAX_OBJECTS, Node, Provenance, StatedProbe, TouchOrigin, Trained, check_names, feature_row, inputs,
};
use crate::error::{Error, Kind, Result, problem};
use crate::mesh::BACKGROUND;
use crate::probe::noise::Noise;
use crate::progress::Progress;
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::format::{Counted, TrainedTouches};
use palpate_shared::{Descriptor, Patterns, Touch};
use palpate_trees::train as boost;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::ControlFlow;

#[cfg(feature = "xgboost")]
mod xgboost;

/// Starting value of every margin; the same for all objects, so it changes no verdict. XGBoost's default.
pub(crate) const BASE_MARGIN: f32 = 0.5;

/// The trainer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Engine {
    /// Palpate's own.
    #[default]
    Palpate,
    /// XGBoost 1.6.2, if the cargo feature `xgboost` built it in. It has no multi-output trees.
    Xgboost,
}

/// Settings of training. Parameters have XGBoost's names and meanings.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Features that a touch is turned into. With partial touches its form for those is used
    /// ([`Descriptor::for_contacts`]), without them its form for full touches.
    pub descriptor: Descriptor,
    /// Touches that are trained on, and so evidence; `None` takes those with a contact from a data set of approaches,
    /// full ones from others.
    pub counted: Option<Counted>,
    /// True if a leaf holds one value for each object (one tree per round) or one value (one tree per object and
    /// round).
    pub multi_output: bool,
    /// Boosting rounds.
    pub rounds: usize,
    /// `max_depth`: the most splits between root and leaf.
    pub depth: usize,
    /// `eta`: the share of each tree that is added.
    pub eta: f64,
    /// `min_child_weight`: the least sum of second derivatives in a leaf.
    pub min_child_weight: f64,
    /// `max_bin`: the most bins of a feature's histogram: at most `bins − 1` different thresholds per feature, and one
    /// more where contacts are missing.
    pub bins: usize,
    /// Rounds the leaves to whole multiples of a power of two, so that the largest leaf takes at most this many bits
    /// with its sign; `None` leaves them as the trainer made them.
    pub leaf_bits: Option<u32>,
    /// Noise added to the touches before training, every touch made by a robot of its own; on top of what the data set
    /// states that they have already ([`Dataset::real`]).
    pub noise: Noise,
    /// Seed of the noise.
    pub seed: u64,
    /// Threads, or all of the machine's; the ensemble is the same for any number.
    pub threads: Option<usize>,
    /// The trainer.
    pub trainer: Engine,
    /// The probe that made the touches, to be stated by the ensemble and every model compiled from it; changes no tree.
    pub probe: Option<StatedProbe>,
    /// Outputs of objects that were touched in placements on a table.
    pub outputs: Outputs,
}

/// Trees of a descriptor with a pose: at most and at least, and their number times that of the outputs in between.
const MOST_TREES: usize = 60;
const FEWEST_TREES: usize = 20;
const MOST_VALUES: usize = 825;

/// Outputs of an ensemble, where objects were touched in several placements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outputs {
    /// One for each placement, called `object/placement`.
    #[default]
    Placements,
    /// One for each object, of touches in placements that are as frequent as their weights say.
    Objects,
}

impl Settings {
    /// The published method: 100 rounds of one tree per object, depth 6, eta 0.3, on contact times.
    pub fn paper() -> Self {
        Self {
            descriptor: Descriptor::Times,
            counted: Some(Counted::Full),
            multi_output: false,
            rounds: 100,
            depth: 6,
            eta: 0.3,
            min_child_weight: 1.0,
            bins: 256,
            leaf_bits: None,
            noise: Noise::default(),
            seed: 1,
            threads: None,
            trainer: Engine::Palpate,
            probe: None,
            outputs: Outputs::Placements,
        }
    }

    /// Thirty multi-output trees on curvature: more accurate than the published method, and small enough for a chip with
    /// 16-bit leaves (37 KB for ten objects). Twice as many trees at half the eta are no better, and twice the size.
    pub fn compact() -> Self {
        Self {
            descriptor: Descriptor::Curvature,
            counted: None,
            multi_output: true,
            rounds: 30,
            min_child_weight: 30.0,
            leaf_bits: Some(16),
            ..Self::paper()
        }
    }

    /// The compact preset with fewer trees, each with a larger share, and leaves of one byte: 15 KB for ten objects.
    pub fn small() -> Self {
        Self { rounds: 22, eta: 0.4, min_child_weight: 60.0, leaf_bits: Some(8), ..Self::compact() }
    }

    /// Eleven shallow trees with leaves of one byte: 5.5 KB for ten objects.
    pub fn tiny() -> Self {
        Self { rounds: 11, depth: 5, eta: 0.65, leaf_bits: Some(8), ..Self::compact() }
    }

    /// The compact preset for a descriptor and a number of outputs, on a chip with 64 KB: with a pose 60 trees, or fewer where
    /// there are more than 13 outputs, with leaves of one byte. For ten objects twice the trees with half the bytes of a leaf
    /// take 52 KB instead of 46, and a fifth fewer approaches (`docs/measurements/tables/pose.sh`).
    pub fn compact_for(descriptor: Descriptor, outputs: usize) -> Self {
        let compact = Self { descriptor, ..Self::compact() };
        if !descriptor.needs_pose() {
            return compact;
        }
        let rounds = (MOST_VALUES / outputs.max(1)).clamp(FEWEST_TREES, MOST_TREES);
        Self { rounds, leaf_bits: Some(8), ..compact }
    }

    /// The settings that [`train`] uses for `dataset`: which touches are evidence is decided, and the descriptor is the
    /// form for those.
    #[must_use]
    pub(crate) fn resolved(&self, dataset: &Dataset) -> Self {
        let usual = if dataset.holds_approaches() { Counted::Contacts } else { Counted::Full };
        let counted = self.counted.unwrap_or(usual);
        let descriptor = match counted {
            Counted::Full => self.descriptor.for_full_touches(),
            Counted::Contacts | Counted::All => self.descriptor.for_contacts().unwrap_or(self.descriptor),
        };
        Self { counted: Some(counted), descriptor, ..self.clone() }
    }
}

/// Trains an ensemble on all touches of `dataset`. The same touches and settings give the same ensemble on any number
/// of threads. Progress is counted in rounds.
///
/// # Errors
/// [`Kind::Setting`] if a setting is out of its range; if there are fewer than two objects or more than 256, a name that no file can hold, an object without touches, or the descriptor
/// needs a pose that no touch has. All of it is found before the training starts. [`Kind::Cancelled`].
pub fn train(dataset: &Dataset, settings: &Settings, progress: &dyn Progress) -> Result<Ensemble> {
    let shares = dataset.placement_shares();
    if shares.is_empty() {
        return train_outputs(dataset, settings, progress);
    }
    match settings.outputs {
        Outputs::Objects => train_outputs(&dataset.each(ObjectTouches::as_often_as_placed), settings, progress),
        Outputs::Placements => {
            let mut ensemble = train_outputs(&dataset.by_placement(), settings, progress)?;
            state_placements(&mut ensemble, &shares)?;
            Ok(ensemble)
        }
    }
}

/// States the weights of placements in an ensemble whose outputs are placements; without weights it stays as it is.
pub(crate) fn state_placements(ensemble: &mut Ensemble, shares: &BTreeMap<String, f64>) -> Result<()> {
    if !shares.is_empty() {
        let stated = TouchOrigin { placements: shares.clone(), ..TouchOrigin::of(&ensemble.origin)? };
        stated.state(&mut ensemble.origin);
    }
    Ok(())
}

/// Trains one output for each object.
fn train_outputs(dataset: &Dataset, settings: &Settings, progress: &dyn Progress) -> Result<Ensemble> {
    check(dataset, settings.descriptor)?;
    let settings = &settings.resolved(dataset);
    let parameters = parameters(settings)?;
    let evidence = Evidence::new(dataset, settings)?;
    let rows = Rows::new(&evidence, settings);
    let mut ensemble = match settings.trainer {
        Engine::Palpate => with_palpate(&rows, settings, &parameters, dataset.names(), progress)?,
        Engine::Xgboost => with_xgboost(&rows, settings, dataset.names(), progress)?,
    };
    if let Some(bits) = settings.leaf_bits {
        round_leaves(&mut ensemble, bits);
    }
    ensemble.origin = origin(dataset, settings, &evidence);
    Ok(ensemble)
}

/// Origin stated by an ensemble that was trained so.
fn origin(dataset: &Dataset, settings: &Settings, evidence: &Evidence<'_>) -> Provenance {
    let trained = Trained { touches: evidence.trained(), shares: dataset.holds_approaches().then(|| dataset.shares()) };
    let noise = Some(dataset.real().and(&settings.noise)).filter(|noise| !noise.is_none());
    TouchOrigin { noise, trained: Some(trained), ..TouchOrigin::new(dataset, settings.probe) }.origin()
}

/// Trains an ensemble with a background column: one more object, with the touches of all objects of `background` together.
/// These should be of as many and as different shapes as possible, and none may be one of `dataset`'s. It stands for
/// objects that the ensemble does not know, and is called [`BACKGROUND`].
///
/// # Errors
/// Errors of [`train`]; data sets that were captured with different probes; if only one of them holds approaches, or an object
/// has the
/// background's name.
pub fn train_with_background(
    dataset: &Dataset,
    background: &Dataset,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Ensemble> {
    if let Some((own, other)) = StatedProbe::of(dataset).zip(StatedProbe::of(background)) {
        StatedProbe::compare(["the data set", "the background"], [own.trained(), other.trained()])?;
    }
    if dataset.holds_approaches() != background.holds_approaches() {
        return Err(other_background("one of the data sets holds approaches and the other full touches only"));
    }
    if dataset.objects.iter().any(|object| object.name == BACKGROUND) {
        return Err(other_background("an object of the data set is called background"));
    }
    let mut both = dataset.clone();
    both.objects.push(ObjectTouches::joined(BACKGROUND, &background.objects));
    let mut ensemble = train(&both, settings, progress)?;
    ensemble.origin.background = true;
    let mut stated = TouchOrigin::of(&ensemble.origin)?;
    if let Some(trained) = &mut stated.trained {
        trained.shares = dataset.holds_approaches().then(|| dataset.shares());
        stated.state(&mut ensemble.origin);
    }
    Ok(ensemble)
}

/// Rounds every leaf, and what margins start from, to a whole multiple of a power of two (the unit, at most 2⁻¹ and at least 2⁻¹⁵ nats), the smallest
/// with which the largest leaf still fits `bits` bits, its sign included.
///
/// A 16-bit unit is about 10⁻⁴ nats, far below what a finite number of touches can teach a leaf. In exchange, f32 sums
/// of leaves are exact in any order while they stay below 2²⁴ units, a compiled model with leaves of that width holds
/// the very same numbers, and full and compiled model cannot differ.
pub(crate) fn round_leaves(ensemble: &mut Ensemble, bits: u32) {
    let unit = leaf_unit(ensemble, bits);
    // Multiplying and dividing by a power of two is exact.
    let rounded = |value: &mut f32| *value = (*value / unit).round() * unit;
    ensemble.base_margins.iter_mut().for_each(rounded);
    for node in ensemble.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
        if let Node::Leaf(values) = node {
            values.iter_mut().for_each(rounded);
        }
    }
}

/// True if [rounding](Settings::leaf_bits) to this many bits changes no leaf: a compiled model then loses nothing in leaves of
/// that width.
pub(crate) fn is_rounded(ensemble: &Ensemble, bits: u32) -> bool {
    let unit = leaf_unit(ensemble, bits);
    leaves(ensemble).all(|value| (value / unit).fract() == 0.0)
}

/// The unit of [`round_leaves`], in nats.
fn leaf_unit(ensemble: &Ensemble, bits: u32) -> f32 {
    let largest = leaves(ensemble).fold(0.0_f32, |most, value| most.max(value.abs()));
    let most = 2.0_f32.powi(i32::try_from(bits).unwrap_or(32) - 1) - 1.0;
    let fits = |digits: &i32| (largest * 2.0_f32.powi(*digits)).round() <= most;
    2.0_f32.powi(-(1..=15).rev().find(fits).unwrap_or(1))
}

fn leaves(ensemble: &Ensemble) -> impl Iterator<Item = f32> {
    ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(Node::leaf).flatten().copied()
}

fn with_palpate(
    rows: &Rows,
    settings: &Settings,
    parameters: &boost::Parameters,
    objects: Vec<String>,
    progress: &dyn Progress,
) -> Result<Ensemble> {
    progress.begin("training", u64::try_from(settings.rounds).ok());
    let on_round = || {
        progress.advance(1);
        if progress.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let trained = boost::train(rows.lent(), objects.len(), parameters, settings.threads, &on_round);
    let (base_margins, trees) = trained.map_err(|error| match error.kind() {
        Kind::Cancelled => error,
        _ => trainer_refused("palpate", &error),
    })?;
    Ok(Ensemble { inputs: inputs(settings.descriptor), objects, base_margins, trees, origin: Provenance::default() })
}

#[cfg(feature = "xgboost")]
fn with_xgboost(rows: &Rows, settings: &Settings, objects: Vec<String>, progress: &dyn Progress) -> Result<Ensemble> {
    if settings.multi_output {
        return Err(Error::setting(
            "leaves",
            "each",
            "one: XGBoost 1.6.2 has no leaves that hold a value for each object",
        ));
    }
    xgboost::train(rows, settings, objects, progress)
}

#[cfg(not(feature = "xgboost"))]
fn with_xgboost(_: &Rows, _: &Settings, _: Vec<String>, _: &dyn Progress) -> Result<Ensemble> {
    let allowed = "palpate; XGBoost is not built in, which needs cmake, g++, libclang and: cargo build --release \
                   --features xgboost";
    Err(Error::setting("trainer", "xgboost", allowed))
}

/// Returns an error if there is nothing to learn from.
fn check(dataset: &Dataset, descriptor: Descriptor) -> Result<()> {
    let objects = &dataset.objects;
    match objects.len() {
        0 | 1 => return Err(problem!("there is only one object to train on").fix("Capture at least two.")),
        2..=MAX_OBJECTS => {}
        objects => return Err(too_many_objects(objects)),
    }
    check_names(&dataset.names())?;
    if let Some(empty) = objects.iter().find(|object| object.is_empty()) {
        return Err(problem!("{} has no touches to train on", empty.name).fix("Capture it again."));
    }
    let posed = || objects.iter().flat_map(ObjectTouches::touches).any(|touch| touch.pose().is_some());
    if descriptor.needs_pose() && !posed() {
        return Err(problem!("the descriptor {} needs the probe's pose, which no touch has", descriptor.name())
            .fix("Capture the touches with their pose, or use the descriptor curvature."));
    }
    Ok(())
}

/// The problem of more objects than a model can hold.
pub(crate) fn too_many_objects(objects: usize) -> Error {
    problem!("there are {objects} objects to train on, more than the {MAX_OBJECTS} that a model can distinguish")
        .fix("Leave some objects out of the data set.")
}

/// The problem of a background that does not go with a data set.
fn other_background(why: &str) -> Error {
    problem!("the background does not match the data set: {why}")
        .fix("Capture the background as the data set: `palpate capture background`.")
}

/// The problem of a trainer that refused what it was given, or failed.
fn trainer_refused(trainer: &str, refusal: &impl Display) -> Error {
    problem!("the trainer {trainer} refused the touches: {refusal}").fix("Report this as a bug, with the data.")
}

/// The problem of an object without touches of those that were to be evidence.
fn no_evidence(object: &str, counted: Counted) -> Error {
    let none = match counted {
        Counted::Full => "none has three contacts",
        Counted::Contacts => "none has a contact",
        Counted::All => "none has what the descriptor needs",
    };
    problem!("no touch of {object} is evidence: {none}")
        .fix("Capture more approaches, or train on touches with any contact.")
}

/// The trainer's parameters.
fn parameters(settings: &Settings) -> Result<boost::Parameters> {
    let Settings { rounds, depth, eta, min_child_weight, bins, .. } = *settings;
    if !(1..=10_000).contains(&rounds) {
        return Err(Error::setting("rounds", rounds, "1 to 10000"));
    }
    if !(1..=16).contains(&depth) {
        return Err(Error::setting("depth", depth, "1 to 16"));
    }
    if !(eta > 0.0 && eta <= 1.0) {
        return Err(Error::setting("eta", eta, "a number above 0, at most 1"));
    }
    if !(min_child_weight >= 0.0 && min_child_weight.is_finite()) {
        return Err(Error::setting("min_child_weight", min_child_weight, "a number of at least 0"));
    }
    if !(2..=65_536).contains(&bins) {
        return Err(Error::setting("bins", bins, "2 to 65536"));
    }
    if let Some(bits) = settings.leaf_bits.filter(|bits| !(4..=24).contains(bits)) {
        return Err(Error::setting("leaf_bits", bits, "4 to 24, or 0 to leave the leaves as they are"));
    }
    settings.noise.check()?;
    if settings.threads == Some(0) {
        return Err(Error::setting("threads", 0, "at least 1"));
    }
    Ok(boost::Parameters {
        multi_output: settings.multi_output,
        rounds,
        depth,
        eta: eta as f32,
        min_child_weight: min_child_weight as f32,
        bins,
        base_margin: BASE_MARGIN,
    })
}

/// The touches of a data set that are evidence, noise added.
struct Evidence<'d> {
    objects: Vec<Cow<'d, [Touch]>>,
    counted: Counted,
    needs_pose: bool,
    /// The stroke as a time, where the probe has one.
    window: Option<u32>,
}

impl<'d> Evidence<'d> {
    /// The touches that [`Settings::counted`] names, and that have a pose if the descriptor needs one.
    ///
    /// # Errors
    /// When an object has none.
    fn new(dataset: &'d Dataset, settings: &Settings) -> Result<Self> {
        let counted = settings.counted.unwrap_or(Counted::Full);
        let needs_pose = settings.descriptor.needs_pose();
        let counts =
            |touch: &Touch| counted.patterns().contains(touch.pattern()) && (touch.pose().is_some() || !needs_pose);
        let objects = dataset.objects.iter().map(|object| {
            let mut touches: Cow<'_, [Touch]> = if settings.noise.is_none() {
                object.touches().into()
            } else {
                let stream = object.stream(&settings.noise, settings.seed);
                let noisy = (0..).zip(object.touches()).map(|(index, touch)| stream.add(touch, index, index as u64));
                object.within_stroke(noisy.collect()).into()
            };
            if !touches.iter().all(counts) {
                touches.to_mut().retain(counts);
            }
            match touches.len() {
                0 => Err(no_evidence(&object.name, counted)),
                _ => Ok(touches),
            }
        });
        let probe = settings.probe.map(|stated| stated.probe).or(dataset.probe().copied());
        let window = probe.and_then(|probe| probe.window());
        Ok(Self { objects: objects.collect::<Result<_>>()?, counted, needs_pose, window })
    }

    /// Statement of the ensemble about them.
    fn trained(&self) -> TrainedTouches {
        let touches = || self.objects.iter().flat_map(|touches| touches.iter());
        TrainedTouches {
            patterns: touches().map(Touch::pattern).collect::<Patterns>(),
            counted: self.counted,
            needs_pose: self.needs_pose,
            largest_spread: self.window.or_else(|| touches().map(Touch::spread).max()).unwrap_or(u32::MAX),
        }
    }
}

/// The training data as a trainer wants it: one row of features per touch, its object's position as label.
pub(crate) struct Rows {
    pub(crate) features: Vec<f32>,
    pub(crate) labels: Vec<u32>,
    /// One weight per touch, or none where all objects have equally many touches.
    pub(crate) weights: Option<Vec<f32>>,
    pub(crate) columns: usize,
}

impl Rows {
    fn new(evidence: &Evidence<'_>, settings: &Settings) -> Self {
        let objects = &evidence.objects;
        let total: usize = objects.iter().map(|touches| touches.len()).sum();
        let descriptor = settings.descriptor;
        let features = objects.iter().flat_map(|touches| {
            let rows: Vec<Vec<f32>> = touches.par_iter().map(|touch| feature_row(descriptor, touch)).collect();
            rows.into_iter().flatten()
        });
        let counts = || objects.iter().map(|touches| touches.len());
        let equal = objects.windows(2).all(|pair| pair[0].len() == pair[1].len());
        let weight = |count: usize| (total as f64 / (count * objects.len()) as f64) as f32;
        Self {
            features: features.collect(),
            labels: (0..).zip(counts()).flat_map(|(label, count)| std::iter::repeat_n(label, count)).collect(),
            weights: (!equal).then(|| counts().flat_map(|count| std::iter::repeat_n(weight(count), count)).collect()),
            columns: descriptor.feature_count(),
        }
    }

    fn lent(&self) -> boost::Rows<'_> {
        let Self { features, labels, weights, columns } = self;
        boost::Rows { features, columns: *columns, labels, weights: weights.as_deref() }
    }
}

#[cfg(test)]
mod tests;
