//! A model's margins for every test touch, computed once.

use super::together::margins_of_touches;
use super::unfit::raw_features;
use crate::compile;
use crate::ensemble::{StatedProbe, object_of, stroke_of};
use crate::error::{Error, Result, problem};
use crate::evidence::{Drawer, Given};
use crate::probe::hand;
use crate::random::Purpose;
use crate::touches::{Dataset, ObjectTouches, Pool};
use palpate_onboard::{Model, Refused};
use palpate_shared::{Descriptor, Touch};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;

/// A model's margins for every touch of a data set.
pub struct Margins<'m> {
    pub(super) model: &'m Model<'m>,
    pub(super) descriptor: Descriptor,
    /// The objects that the model has margins for, in its order; the last one may be a background.
    pub(crate) objects: Vec<String>,
    /// The data set's objects.
    pub(super) tested: Vec<Tested>,
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
pub(super) struct Tested {
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
    /// Margins of the touches that are evidence, touch after touch one for each output, in the model's units.
    pub(super) values: Vec<i32>,
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

/// A [`Model`] and touches.
pub(crate) trait OfTouches {
    /// The descriptor, if the data set's touches can be evidence; see [`Margins::new`].
    fn takes(&self, dataset: &Dataset) -> Result<Descriptor>;
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

impl OfTouches for Model<'_> {
    fn takes(&self, dataset: &Dataset) -> Result<Descriptor> {
        let descriptor = self.descriptor().ok_or_else(raw_features)?;
        let mut touches = dataset.touches();
        if descriptor.needs_pose() && !touches.any(|touch| touch.pose().is_some()) {
            return Err(problem!("the descriptor {} needs the probe's pose, which no touch has", descriptor.name())
                .fix("Capture the touches with their pose."));
        }
        let longest = self.trained_touches().largest_spread;
        StatedProbe::compare_with(["the model", "the data set"], self.probe(), longest, dataset)?;
        Ok(descriptor)
    }

    fn outputs_of(&self, name: &str) -> Vec<usize> {
        let known = known(self);
        if let Some(own) = known.iter().position(|known| known == name) {
            return vec![own];
        }
        let has_placements = self.outputs().is_some();
        (0..known.len()).filter(|&output| has_placements && object_of(&known[output]) == name).collect()
    }

    fn of(&self, dataset: &Dataset) -> Result<(Descriptor, Vec<usize>)> {
        let descriptor = self.takes(dataset)?;
        let index = |touched: &ObjectTouches| {
            let unknown = || {
                let known = known(self);
                // Of an object that is known in other placements, these.
                let object = object_of(&touched.name);
                let is_placed = object != touched.name && !self.outputs_of(object).is_empty();
                let known = match is_placed {
                    true => self.outputs_of(object).into_iter().map(|output| known[output].clone()).collect(),
                    false => objects_of(&known, self.outputs().is_some()),
                };
                unknown_object(&touched.name, &known)
            };
            self.outputs_of(&touched.name).first().copied().ok_or_else(unknown)
        };
        Ok((descriptor, dataset.objects.iter().map(index).collect::<Result<_>>()?))
    }

    fn delivered<'d>(&self, dataset: &'d Dataset) -> Cow<'d, Dataset> {
        let window = self.trained_touches().largest_spread;
        let has_stroke = self.probe().is_some_and(|probe| probe.stroke.is_some());
        dataset.within(has_stroke.then_some(window))
    }
}

/// The outputs that a model can name.
fn known(model: &Model<'_>) -> Vec<String> {
    let mut names = compile::names(model);
    names.truncate(model.known_count());
    names
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
    pub fn new(model: &'m Model<'m>, dataset: &Dataset) -> Result<Self> {
        let (descriptor, _) = model.of(dataset)?;
        let outputs = dataset.objects.iter().map(|touched| model.outputs_of(&touched.name)).collect();
        Ok(Self::with(model, descriptor, outputs, dataset))
    }

    /// Margins for objects that the model does not know: no verdict on them is right.
    ///
    /// # Errors
    /// Errors of [`new`](Self::new), and when the model knows one.
    pub(crate) fn of_strangers(model: &'m Model<'m>, dataset: &Dataset) -> Result<Self> {
        let descriptor = model.takes(dataset)?;
        let is_known = |name: &&String| !model.outputs_of(name).is_empty();
        if let Some(object) = dataset.objects.iter().map(|object| &object.name).find(is_known) {
            return Err(problem!("the model knows the object {object}, so it is not a stranger")
                .fix("Take it out of the strangers, or train a model without it."));
        }
        Ok(Self::with(model, descriptor, vec![Vec::new(); dataset.objects.len()], dataset))
    }

    /// The outputs of each object; none of a stranger.
    fn with(model: &'m Model<'m>, descriptor: Descriptor, outputs: Vec<Vec<usize>>, dataset: &Dataset) -> Self {
        let trained = model.trained_touches();
        let delivered = model.delivered(dataset);
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
                values: margins_of_touches(model, &evidence),
            }
        });
        let tested = tested.collect();
        let (tested_names, hold_approaches, shares) = (dataset.names(), dataset.holds_approaches(), dataset.shares());
        Self {
            model,
            descriptor,
            objects: compile::names(model),
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
        let is_there = |tested: &Tested| tested.outputs.iter().any(has_weight);
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
        let of = |&output: &usize| match &self.weights {
            Some(weights) => weights.get(output).copied().unwrap_or(0).into(),
            None => (f64::from(self.model.prior(output)) * f64::from(self.model.unit())).exp(),
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
        let outputs: BTreeSet<usize> = self.tested.iter().flat_map(|tested| tested.outputs.iter().copied()).collect();
        outputs.len()
    }

    /// The output that stands for an object that was named: that of the touched placement, if it is one of the tested object.
    pub(super) fn named(&self, position: usize, output: usize) -> usize {
        let touched = self.tested[position].object;
        if self.model.is_same_object(output, touched) { touched } else { output }
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

    /// The touches of group `group` of a tested object, `count` of those that are evidence, drawn at random without replacement.
    pub(super) fn draw(&self, position: usize, group: usize, count: usize, seed: u64) -> impl Iterator<Item = u32> {
        let pool = self.tested[position].pool(group);
        let drawn = self.drawer(Purpose::Groups, position, seed).some(group as u64, pool.fewest_evidence, count);
        drawn.map(|touch| pool.evidence[touch])
    }

    /// The approaches of a group in the order in which it has them: each the position of a touch among those that are evidence,
    /// or none.
    pub(super) fn draw_approaches(
        &self,
        position: usize,
        group: usize,
        seed: u64,
    ) -> impl Iterator<Item = Option<u32>> {
        let tested = &self.tested[position];
        let pool = tested.pool(group);
        let drawn = self.drawer(Purpose::Approaches, position, seed).each(group as u64, pool.fewest);
        drawn.map(|approach| tested.approaches[pool.touches[approach] as usize])
    }

    fn drawer(&self, purpose: Purpose, position: usize, seed: u64) -> Drawer<'_> {
        Drawer { purpose, name: &self.tested_names[position], seed }
    }

    /// Approaches as steps, by the positions of their touches among those that are evidence.
    pub(super) fn steps(
        &self,
        position: usize,
        approaches: impl Iterator<Item = Option<u32>>,
    ) -> Given<'_, impl Iterator<Item = Option<&[i32]>>> {
        let (values, objects) = (&self.tested[position].values, self.objects.len());
        Given::new(approaches.map(move |touch| touch.map(|touch| &values[row(touch as usize, objects)])))
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

impl Tested {
    /// The pool of group `group`.
    pub(super) fn pool(&self, group: usize) -> &TestedPool {
        &self.pools[group % self.pools.len()]
    }
}

/// Range of the margins of touch `touch`.
pub(super) fn row(touch: usize, objects: usize) -> Range<usize> {
    touch * objects..(touch + 1) * objects
}
