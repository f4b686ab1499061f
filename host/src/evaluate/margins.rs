//! A model's margins for every test touch, computed once.

use super::Candidate;
use super::together::margins_of_touches;
use super::unfit::raw_features;
use crate::ensemble::{OverTouches, StatedProbe, TouchOrigin, feature_row, object_of, stroke_of};
use crate::error::{Error, Result, problem};
use crate::probe::hand;
use crate::random::{self, Purpose};
use crate::touches::{Dataset, ObjectTouches, Pool};
use palpate_onboard::{Model, Recognizer, Refused, Stopping};
use palpate_shared::format::{TrainedProbe, TrainedTouches};
use palpate_shared::{Descriptor, Touch};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// A model's margins for every touch of a data set.
pub struct Margins<'m> {
    pub(super) candidate: Candidate<'m>,
    pub(super) descriptor: Descriptor,
    /// The objects that the model has margins for, in its order; the last one may be a background.
    pub(crate) objects: Vec<String>,
    /// Number of them that can be named: all but a background.
    known: usize,
    /// The number of each output's object, where several belong to one.
    numbers: Option<Vec<u8>>,
    /// The data set's objects.
    pub(super) tested: Vec<Tested<'m>>,
    pub(crate) tested_names: Vec<String>,
    pub(super) hold_approaches: bool,
    /// True if a real probe made the touches.
    pub(super) is_recorded: bool,
    /// The share of each contact pattern in the data set, in the order of the patterns' codes.
    pub(crate) shares: [f64; 6],
    /// Weights of the objects that the model knows, if not as the model says.
    pub(super) weights: Option<Vec<u32>>,
}

/// In place of the index of an object that the model does not know.
const STRANGER: usize = usize::MAX;

/// The margins of one object's test touches.
pub(super) struct Tested<'m> {
    /// The object's index in the model, or [`STRANGER`]; of several outputs that it may be of, the first.
    pub(super) object: usize,
    /// The outputs that it may be of: several where nothing says which of its placements was touched.
    pub(super) outputs: Vec<usize>,
    /// Number of touches that are evidence to the model.
    pub(super) touches: usize,
    /// For each touch of the data set its position among those that are evidence, if it is.
    pub(super) approaches: Vec<Option<u32>>,
    /// One for each source and robot: group i, and sequence i, is of pool i modulo their number.
    pub(super) pools: Vec<TestedPool>,
    /// Margins of the touches that are evidence.
    pub(super) values: Values<'m>,
}

/// Touches of one source, such as an instance, by one robot.
pub(super) struct TestedPool {
    /// Their positions in the data set.
    pub(super) touches: Vec<u32>,
    /// The positions of those that are evidence, among all that are.
    evidence: Vec<u32>,
    /// The fewest touches of a pool of this source, and the fewest that are evidence: as many are drawn from each.
    fewest: usize,
    fewest_evidence: usize,
}

/// Margins of touch after touch, one for each object that the model knows.
pub(super) enum Values<'m> {
    Full(Vec<f32>),
    /// In the model's units.
    Compiled(&'m Model<'m>, Vec<i32>),
}

/// A [`Candidate`] and touches.
pub(crate) trait OfTouches {
    /// The descriptor, if the model is over touches.
    fn descriptor(&self) -> Option<Descriptor>;
    /// The touches that are evidence to the model.
    fn trained_touches(&self) -> TrainedTouches;
    /// The probe that the model states, if it states one.
    fn probe(&self) -> Result<Option<TrainedProbe>>;
    /// The descriptor, if the data set's touches can be evidence; see [`Margins::new`].
    fn takes(&self, dataset: &Dataset) -> Result<Descriptor>;
    /// The number of each output's object, where several belong to one.
    fn numbers(&self) -> Option<Vec<u8>>;
    /// The outputs of the object with this name: its own or, where it has one for each placement, all of them. None if the model
    /// does not know it.
    fn outputs_of(&self, name: &str) -> Vec<usize>;
    /// The descriptor as [`takes`](Self::takes), and for each object of a data set its index in the model; of an object that
    /// has several outputs, and touches that state no placement, the first.
    fn of(&self, dataset: &Dataset) -> Result<(Descriptor, Vec<usize>)>;
    /// The data set as an effector would report it: of a model for a probe with a stroke, contacts that are later are missing.
    fn delivered<'d>(&self, dataset: &'d Dataset) -> Cow<'d, Dataset>;
}

/// A recorded touch as an effector would report it to a model: of one for a probe with a stroke, a contact that is later, by no more
/// than a hand with this stroke explains, is missing. Other touches are as they were, and a model refuses those that are later.
pub fn delivered(model: &Model<'_>, touch: &Touch) -> Touch {
    let allowed = model.probe().and_then(|probe| stroke_of(&probe)).map(|[_, latest]| latest);
    match allowed {
        Some(latest) if f64::from(touch.spread()) <= latest => {
            hand::within(touch, Some(model.trained_touches().largest_spread))
        }
        _ => *touch,
    }
}

/// The objects that a model with these outputs knows, in the order of the outputs.
fn objects_of(outputs: &[String], has_placements: bool) -> Vec<String> {
    let mut names: Vec<String> = match has_placements {
        true => outputs.iter().map(|output| object_of(output).to_owned()).collect(),
        false => outputs.to_vec(),
    };
    names.dedup();
    names
}

impl OfTouches for Candidate<'_> {
    fn descriptor(&self) -> Option<Descriptor> {
        match self {
            Self::Full(ensemble) => ensemble.descriptor(),
            Self::Compiled(model) => model.descriptor(),
        }
    }

    fn trained_touches(&self) -> TrainedTouches {
        match self {
            Self::Full(ensemble) => ensemble.trained_touches(),
            Self::Compiled(model) => model.trained_touches(),
        }
    }

    fn probe(&self) -> Result<Option<TrainedProbe>> {
        Ok(match self {
            Self::Full(ensemble) => TouchOrigin::of(&ensemble.origin)?.probe.as_ref().map(StatedProbe::trained),
            Self::Compiled(model) => model.probe(),
        })
    }

    fn numbers(&self) -> Option<Vec<u8>> {
        match self {
            Self::Full(ensemble) => {
                let outputs = TouchOrigin::of(&ensemble.origin).ok()?.outputs(&ensemble.objects)?;
                Some(outputs.into_iter().map(|(number, _)| number).collect())
            }
            Self::Compiled(model) => model.outputs().map(|outputs| outputs.objects().collect()),
        }
    }

    fn takes(&self, dataset: &Dataset) -> Result<Descriptor> {
        let descriptor = self.descriptor().ok_or_else(raw_features)?;
        let mut touches = dataset.touches();
        if descriptor.needs_pose() && !touches.any(|touch| touch.pose().is_some()) {
            return Err(problem!("the descriptor {} needs the probe's pose, which no touch has", descriptor.name())
                .fix("Capture the touches with their pose."));
        }
        let longest = self.trained_touches().largest_spread;
        StatedProbe::compare_with(["the model", "the data set"], self.probe()?, longest, dataset)?;
        Ok(descriptor)
    }

    fn outputs_of(&self, name: &str) -> Vec<usize> {
        let mut known = self.objects();
        known.truncate(self.known_count());
        if let Some(own) = known.iter().position(|known| known == name) {
            return vec![own];
        }
        let has_placements = self.numbers().is_some();
        (0..known.len()).filter(|&output| has_placements && object_of(&known[output]) == name).collect()
    }

    fn of(&self, dataset: &Dataset) -> Result<(Descriptor, Vec<usize>)> {
        let descriptor = self.takes(dataset)?;
        let index = |touched: &ObjectTouches| {
            let unknown = || {
                let mut known = self.objects();
                known.truncate(self.known_count());
                // Of an object that is known in other placements, these.
                let object = object_of(&touched.name);
                let is_placed = object != touched.name && !self.outputs_of(object).is_empty();
                let known = match is_placed {
                    true => self.outputs_of(object).into_iter().map(|output| known[output].clone()).collect(),
                    false => objects_of(&known, self.numbers().is_some()),
                };
                unknown_object(&touched.name, &known)
            };
            self.outputs_of(&touched.name).first().copied().ok_or_else(unknown)
        };
        Ok((descriptor, dataset.objects.iter().map(index).collect::<Result<_>>()?))
    }

    fn delivered<'d>(&self, dataset: &'d Dataset) -> Cow<'d, Dataset> {
        let window = self.trained_touches().largest_spread;
        let has_stroke = self.probe().is_ok_and(|probe| probe.is_some_and(|probe| probe.stroke.is_some()));
        dataset.within(has_stroke.then_some(window))
    }
}

/// The problem of an object that is not among those that a model knows.
fn unknown_object(object: &str, known: &[String]) -> Error {
    let is_other_placement = |known: &String| known != object_of(known) && object_of(known) == object_of(object);
    let fix = match known.iter().any(is_other_placement) {
        true => {
            "Train it on this placement too (capture with --placements), take it out of the data, or record the object without \
             its placement (--object OBJECT), to test it however it lies."
        }
        false => "Train it on this object too, or take the object out of the data.",
    };
    problem!("the model does not know the object {object}, only {}", known.join(", ")).fix(fix)
}

impl<'m> Margins<'m> {
    /// Computes the margins of all touches that are evidence to the model, on all threads; the others cost an approach
    /// and change nothing. Every group and sequence that is drawn from them is of one source's touches, such as an
    /// instance's, by one robot. Every object of the data set must be known to the model; the
    /// model may know more. Touches of an object with an output for each placement may be of any of them, if they state none.
    ///
    /// # Errors
    /// If model and data set state different probes, or recorded touches show another stroke than the model's; if the model does
    /// not know an object, works on rows of features instead of touches, or needs a pose that no touch has.
    pub fn new(candidate: Candidate<'m>, dataset: &Dataset) -> Result<Self> {
        let (descriptor, _) = candidate.of(dataset)?;
        let outputs = dataset.objects.iter().map(|touched| candidate.outputs_of(&touched.name)).collect();
        Ok(Self::with(candidate, descriptor, outputs, dataset))
    }

    /// Margins for objects that the model does not know: no verdict on them is right.
    ///
    /// # Errors
    /// Errors of [`new`](Self::new), and when the model knows one.
    pub(crate) fn of_strangers(candidate: Candidate<'m>, dataset: &Dataset) -> Result<Self> {
        let descriptor = candidate.takes(dataset)?;
        let is_known = |name: &&String| !candidate.outputs_of(name).is_empty();
        if let Some(object) = dataset.objects.iter().map(|object| &object.name).find(is_known) {
            return Err(problem!("the model knows the object {object}, so it is not a stranger")
                .fix("Take it out of the strangers, or train a model without it."));
        }
        Ok(Self::with(candidate, descriptor, vec![Vec::new(); dataset.objects.len()], dataset))
    }

    /// The outputs of each object; none of a stranger.
    fn with(candidate: Candidate<'m>, descriptor: Descriptor, outputs: Vec<Vec<usize>>, dataset: &Dataset) -> Self {
        let objects = candidate.objects();
        let trained = candidate.trained_touches();
        let delivered = candidate.delivered(dataset);
        let dataset = delivered.as_ref();
        let tested = dataset.objects.iter().zip(outputs).map(|(touched, outputs)| {
            let is_evidence = |touch: &&Touch| Refused::check(&trained, touch).is_ok();
            let evidence: Vec<&Touch> = touched.touches().iter().filter(is_evidence).collect();
            let mut position = 0..;
            let approach = |touch| if is_evidence(&touch) { position.next() } else { None };
            let approaches: Vec<Option<u32>> = touched.touches().iter().map(approach).collect();
            Tested {
                object: outputs.first().copied().unwrap_or(STRANGER),
                outputs,
                touches: evidence.len(),
                pools: pools(touched, &approaches),
                approaches,
                values: values(candidate, descriptor, &evidence),
            }
        });
        let tested = tested.collect();
        let (tested_names, hold_approaches, shares) = (dataset.names(), dataset.holds_approaches(), dataset.shares());
        let known = candidate.known_count();
        Self {
            candidate,
            descriptor,
            objects,
            known,
            numbers: candidate.numbers(),
            tested,
            tested_names,
            hold_approaches,
            is_recorded: dataset.is_recorded(),
            shares,
            weights: None,
        }
    }

    /// Like [`new`](Self::new), for a recognizer told how often each object is touched, which replaces the model's priors
    /// ([`Recognizer::reset_to`]): `weights` are for the model's objects, in its order. Objects of weight 0 are not there:
    /// they cannot be recognized, and are not tested.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting) `prior` unless there is a weight for each object, and one of
    /// a tested object is above 0.
    pub(crate) fn expecting(mut self, weights: Vec<u32>) -> Result<Self> {
        let objects = self.objects.len();
        let has_weight = |output: &usize| weights.get(*output).is_some_and(|&weight| weight > 0);
        let is_there = |tested: &Tested<'_>| tested.outputs.iter().any(has_weight);
        if weights.len() != objects || !self.tested.iter().any(is_there) {
            let allowed =
                format!("{objects} weights, one for each object, and above 0 for one object of the data set or more");
            return Err(Error::setting("prior", format!("{weights:?}"), allowed));
        }
        let kept: Vec<bool> = self.tested.iter().map(is_there).collect();
        let mut is_kept = kept.iter();
        self.tested.retain(|_| is_kept.next().is_some_and(|kept| *kept));
        let mut is_kept = kept.iter();
        self.tested_names.retain(|_| is_kept.next().is_some_and(|kept| *kept));
        self.weights = Some(weights);
        Ok(self)
    }

    /// Frequency of touches of a tested object, compared with others: that of its placements together.
    pub(crate) fn frequency(&self, position: usize) -> f64 {
        let of = |&output: &usize| match (&self.weights, self.candidate) {
            (Some(weights), _) => weights.get(output).copied().unwrap_or(0).into(),
            (None, Candidate::Compiled(model)) => (f64::from(model.prior(output)) * f64::from(model.unit())).exp(),
            (None, Candidate::Full(_)) => self.full_shares().get(output).copied().unwrap_or(1.0),
        };
        match &self.tested[position].outputs[..] {
            [] => of(&STRANGER),
            outputs => outputs.iter().map(of).sum(),
        }
    }

    /// True if a tested object has several outputs, and nothing says which of them its touches are of.
    pub(super) fn is_of_any_placement(&self, position: usize) -> bool {
        self.tested[position].outputs.len() > 1
    }

    /// Number of outputs that were tested.
    pub(super) fn tested_outputs(&self) -> usize {
        let outputs: std::collections::BTreeSet<usize> =
            self.tested.iter().flat_map(|tested| tested.outputs.iter().copied()).collect();
        outputs.len()
    }

    /// Shares of an ensemble's outputs of their objects; empty where each is an object.
    fn full_shares(&self) -> Vec<f64> {
        let Candidate::Full(ensemble) = self.candidate else { return Vec::new() };
        let outputs = TouchOrigin::of(&ensemble.origin).ok().and_then(|origin| origin.outputs(&ensemble.objects));
        outputs.into_iter().flatten().map(|(_, share)| share).collect()
    }

    /// The object that the model would name, as the right one's output if it is the tested object; and the sum of the weights of
    /// the others, its own being 1.
    pub(super) fn leading(&self, position: usize, evidence: &[f64], unit: f64) -> (usize, f64) {
        let (best, rivals) = leading(evidence, self.known, self.numbers.as_deref(), unit);
        (self.named(position, best), rivals)
    }

    /// The output that stands for an object that was named: that of the touched placement, if it is one of the tested object.
    pub(super) fn named(&self, position: usize, output: usize) -> usize {
        let touched = self.tested[position].object;
        let is_same = self
            .numbers
            .as_ref()
            .is_some_and(|numbers| output < self.known && touched < self.known && numbers[output] == numbers[touched]);
        if is_same { touched } else { output }
    }

    /// The number of each output's object, where several belong to one.
    pub(super) fn numbers(&self) -> Option<&[u8]> {
        self.numbers.as_deref()
    }

    /// The object with the most evidence among those that can be named; as the right output, if it is that of the tested object.
    pub(super) fn best(&self, position: usize, evidence: &[f64]) -> usize {
        match self.numbers {
            None => best(&evidence[..self.known]),
            Some(_) => self.leading(position, evidence, self.unit()).0,
        }
    }

    /// The output with the most evidence of the object that leads.
    pub(super) fn output(&self, evidence: &[f64]) -> usize {
        leading(evidence, self.known, self.numbers.as_deref(), self.unit()).0
    }

    /// The touches of all tested objects together that are evidence to the model.
    pub(crate) fn touch_count(&self) -> usize {
        self.tested.iter().map(|tested| tested.touches).sum()
    }

    /// The fewest approaches that one robot made of a tested object, or of one of its instances or recordings.
    pub fn fewest_approaches(&self) -> usize {
        (0..self.tested.len()).map(|position| self.most_approaches(position)).min().unwrap_or(0)
    }

    /// The most approaches that every group of a tested object can have.
    pub(super) fn most_approaches(&self, position: usize) -> usize {
        self.tested[position].pools.iter().map(|pool| pool.fewest).min().unwrap_or(0)
    }

    /// The most approaches that group `group` of a tested object can have.
    pub(super) fn most_approaches_of(&self, position: usize, group: usize) -> usize {
        self.tested[position].pool(group).fewest
    }

    /// Number, among the touches that are evidence, of the `draw`-th approach of the pool of group `group`; `None` if
    /// it is no evidence.
    pub(super) fn approach(&self, position: usize, group: usize, draw: usize) -> Option<u32> {
        let tested = &self.tested[position];
        tested.approaches[tested.pool(group).touches[draw] as usize]
    }

    /// The fewest touches that are evidence that a tested object has: the longest group that can be drawn from each.
    pub fn fewest_touches(&self) -> usize {
        (0..self.tested.len()).map(|position| self.most_touches(position)).min().unwrap_or(0)
    }

    /// The most touches that every group of a tested object can have.
    pub(super) fn most_touches(&self, position: usize) -> usize {
        self.tested[position].pools.iter().map(|pool| pool.fewest_evidence).min().unwrap_or(0)
    }

    /// The touches that a group of this tested object is drawn from, if not of all of its touches: for messages.
    pub(super) fn of_what(&self, name: &str) -> &'static str {
        let position = self.tested_names.iter().position(|tested| tested == name);
        let pools = position.and_then(|position| self.tested.get(position)).map_or(1, |tested| tested.pools.len());
        if pools > 1 { " of one instance or recording, by one robot" } else { "" }
    }

    /// The most touches that group `group` of a tested object can have.
    pub(super) fn most_touches_of(&self, position: usize, group: usize) -> usize {
        self.tested[position].pool(group).fewest_evidence
    }

    /// Number of different groups of `touches` touches that can be drawn from the object with the fewest, where that is
    /// below 2⁶⁴.
    pub fn distinct_groups(&self, touches: usize) -> u64 {
        let all = self.fewest_touches();
        if touches > all {
            return 0;
        }
        // Each step is a whole number: the ways to choose one touch more.
        let one_more = |groups: u128, chosen: usize| {
            let next = groups.checked_mul((all - chosen) as u128)? / (chosen as u128 + 1);
            (next <= u128::from(u64::MAX)).then_some(next)
        };
        let groups = (0..touches.min(all - touches)).try_fold(1, one_more);
        groups.and_then(|groups| u64::try_from(groups).ok()).unwrap_or(u64::MAX)
    }

    /// Nats in one unit of evidence.
    pub(super) fn unit(&self) -> f64 {
        match self.candidate {
            Candidate::Full(_) => 1.0,
            Candidate::Compiled(model) => f64::from(model.unit()),
        }
    }

    /// The evidence before any touch, in units.
    pub(super) fn prior(&self) -> Vec<f64> {
        if let Some(weights) = &self.weights {
            let most = f64::from(weights.iter().copied().max().unwrap_or(1));
            return match self.candidate {
                Candidate::Full(_) => weights.iter().map(|&weight| (f64::from(weight) / most).ln()).collect(),
                Candidate::Compiled(model) => {
                    let never = Stopping::from_odds(0, u32::MAX);
                    let told = Recognizer::<256>::new(model, never).ok().and_then(|mut recognizer| {
                        recognizer.reset_to(weights).ok()?;
                        Some(recognizer.evidence().iter().map(|&evidence| evidence as f64).collect())
                    });
                    told.unwrap_or_default()
                }
            };
        }
        let shares = self.full_shares();
        let share = |object: usize| shares.get(object).copied().unwrap_or(1.0);
        let prior = |object| match self.candidate {
            Candidate::Full(_) => share(object).ln(),
            Candidate::Compiled(model) => f64::from(model.prior(object)),
        };
        (0..self.objects.len()).map(prior).collect()
    }

    /// The positions of `count` touches of a tested object, drawn at random without replacement for group `group`.
    pub(super) fn draw(&self, position: usize, group: usize, count: usize, seed: u64) -> Vec<usize> {
        let pool = self.tested[position].pool(group);
        let group = u64::try_from(group).unwrap_or(u64::MAX);
        let mut random = random::generator(seed, Purpose::Groups, &self.tested_names[position], group);
        let drawn = rand::seq::index::sample(&mut random, pool.fewest_evidence, count);
        drawn.into_iter().map(|touch| pool.evidence[touch] as usize).collect()
    }
}

/// Pools of an object's touches; `approaches` says which are evidence.
fn pools(touched: &ObjectTouches, approaches: &[Option<u32>]) -> Vec<TestedPool> {
    let pools = touched.pools();
    let evidence = |pool: &Pool| -> Vec<u32> {
        let own = approaches.get(pool.range.clone()).unwrap_or_default();
        own.iter().copied().flatten().collect()
    };
    let found: Vec<(&Pool, Vec<u32>)> = pools.iter().map(|pool| (pool, evidence(pool))).collect();
    let tested = found.iter().map(|(pool, evidence)| {
        let like = || found.iter().filter(|(other, _)| other.source == pool.source);
        TestedPool {
            // A position is below the number of a file's lines.
            touches: pool.range.clone().map(|touch| touch as u32).collect(),
            fewest: like().map(|(other, _)| other.range.len()).min().unwrap_or_default(),
            fewest_evidence: like().map(|(_, evidence)| evidence.len()).min().unwrap_or_default(),
            evidence: evidence.clone(),
        }
    });
    tested.collect()
}

impl Tested<'_> {
    /// The pool of group `group`.
    pub(super) fn pool(&self, group: usize) -> &TestedPool {
        &self.pools[group % self.pools.len()]
    }

    /// Adds the margins of touch `touch` to `evidence`. Whole numbers stay exact: their sums are far below 2⁵³.
    pub(super) fn add(&self, touch: usize, evidence: &mut [f64]) {
        let row = row(touch, evidence.len());
        match &self.values {
            Values::Full(values) => {
                evidence.iter_mut().zip(&values[row]).for_each(|(e, &margin)| *e += f64::from(margin))
            }
            Values::Compiled(_, values) => {
                evidence.iter_mut().zip(&values[row]).for_each(|(e, &margin)| *e += f64::from(margin));
            }
        }
    }
}

/// Range of the margins of touch `touch`.
pub(super) fn row(touch: usize, objects: usize) -> Range<usize> {
    touch * objects..(touch + 1) * objects
}

fn values<'m>(candidate: Candidate<'m>, descriptor: Descriptor, touches: &[&Touch]) -> Values<'m> {
    match candidate {
        Candidate::Full(ensemble) => {
            let margins = |touch: &&Touch| ensemble.margins_of_features(&feature_row(descriptor, touch));
            Values::Full(touches.par_iter().flat_map_iter(margins).collect())
        }
        Candidate::Compiled(model) => Values::Compiled(model, margins_of_touches(model, touches)),
    }
}

/// The object with the most evidence; the first of several, as on the chip.
pub(crate) fn best<T: PartialOrd>(evidence: &[T]) -> usize {
    (0..evidence.len()).fold(0, |best, object| if evidence[object] > evidence[best] { object } else { best })
}

/// The output with the most evidence of the object that leads, and the sum of the other objects' weights, its own being 1. The
/// first `known` outputs can be named; `numbers` are those of their objects, where several belong to one.
pub(crate) fn leading(evidence: &[f64], known: usize, numbers: Option<&[u8]>, unit: f64) -> (usize, f64) {
    let Some(numbers) = numbers else {
        let best = best(&evidence[..known]);
        return (best, rivals(evidence, best, unit));
    };
    let most = evidence.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weight = |output: usize| ((evidence[output] - most) * unit).exp();
    let object = |number: u8| (0..known).filter(move |&output| numbers[output] == number);
    let last = numbers[..known].last().copied().unwrap_or(0);
    let sum = |number: u8| object(number).map(weight).sum::<f64>();
    let sums: Vec<f64> = (0..=last).map(sum).collect();
    let leader = best(&sums);
    let outputs: Vec<usize> = object(leader as u8).collect();
    let strongest = best(&outputs.iter().map(|&output| evidence[output]).collect::<Vec<_>>());
    let all: f64 = (0..evidence.len()).map(weight).sum();
    (outputs[strongest], (all - sums[leader]) / sums[leader])
}

/// Sum of the other objects' weights, the best one's being 1: its posterior is 1 / (1 + this).
pub(super) fn rivals(evidence: &[f64], best: usize, unit: f64) -> f64 {
    let most = evidence[best];
    let others = evidence.iter().enumerate().filter(|(object, _)| *object != best);
    others.map(|(_, value)| ((value - most) * unit).exp()).sum()
}
