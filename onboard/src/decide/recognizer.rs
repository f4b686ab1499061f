//! Touch by touch to a verdict.

use super::evidence::{self, Posterior, Rivals, SHARPNESS, Unit};
use super::expected::{self, NothingExpected};
use super::stopping::Stopping;
use super::strangers::{self, Familiarity};
use super::together::{self, Leading};
use crate::bytes::AlignedTo8;
use crate::model::{Model, Refused};
use core::fmt;
use palpate_shared::format::Outputs;
use palpate_shared::{MISSING_FEATURE, Touch};

/// Result of the touches so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// No object is sure enough yet.
    Undecided,
    /// An object was recognized. Further touches change nothing until [`Recognizer::reset`].
    Recognized {
        /// The object's index in the model; of an object with several [outputs](Model::outputs), that of the one with the most
        /// evidence: how the object lies, if outputs are placements.
        object: u8,
        /// Number of touches taken.
        touches: u32,
        /// Weights of all other objects, relative to this one; its [`posterior`](Rivals::posterior) is computed when it
        /// is asked for.
        rivals: Rivals,
    },
    /// The touches fit no object that the model knows, which stays so until [`Recognizer::reset`]. Only of a model with a
    /// [misfit test](Model::strangers).
    Unknown,
    /// The limit of touches was reached without a decision, which stays so until [`Recognizer::reset`]: the touches said
    /// too little.
    GaveUp,
}

impl Verdict {
    /// Its name in lines for programs. Cost: a few instructions; never fails.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Undecided => "undecided",
            Self::Recognized { .. } => "recognized",
            Self::Unknown => "unknown",
            Self::GaveUp => "gave-up",
        }
    }

    /// The posterior of the object that was recognized, when it was; `None` if none was.
    ///
    /// Cost: that of [`Rivals::posterior`]. It is that of the evidence as it is, which the threshold is for; for the model's
    /// [temperature](Model::temperature), other objects, and before a decision: [`Recognizer::posterior`].
    pub fn posterior(&self) -> Option<Posterior> {
        match self {
            Self::Recognized { rivals, .. } => Some(rivals.posterior()),
            Self::Undecided | Self::Unknown | Self::GaveUp => None,
        }
    }
}

/// A model with more objects than a recognizer has room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CapacityError {
    /// The model's objects.
    pub objects: usize,
    /// The recognizer's room.
    pub capacity: usize,
}

impl fmt::Display for CapacityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the model has {} objects, and the recognizer has room for {}", self.objects, self.capacity)
    }
}

impl core::error::Error for CapacityError {}

/// Recognizes an object by touch; has room for up to `N` objects.
///
/// State: a number of 64 bits for each object, a few more, and the model, which is copied: where its parts are, not the bytes
/// that it is read from. The README of this crate states its size.
#[derive(Clone, Debug)]
pub struct Recognizer<'m, const N: usize> {
    model: Model<'m>,
    state: State<N>,
}

/// State of a recognizer, without its model.
#[derive(Clone, Debug)]
pub(crate) struct State<const N: usize> {
    /// Margins summed over touches, and the prior, in units of a margin; anything while nothing is [`Decided::Fresh`].
    evidence: [i64; N],
    stopping: Stopping,
    /// Rivals of the object that was recognized.
    rivals: Rivals,
    touches: u32,
    decided: Decided,
}

/// A verdict without what else is known of it, so that it takes a few instructions to copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Decided {
    /// Nothing, and the evidence is yet to be set to the priors.
    Fresh,
    Nothing,
    Object(u8),
    Unknown,
    GaveUp,
}

impl<'m, const N: usize> Recognizer<'m, N> {
    /// A recognizer that has touched nothing yet.
    ///
    /// # Errors
    /// [`CapacityError`] when the model has more than `N` objects.
    pub fn new(model: &Model<'m>, stopping: Stopping) -> Result<Self, CapacityError> {
        let objects = model.object_count();
        if objects > N {
            return Err(CapacityError { objects, capacity: N });
        }
        Ok(Self {
            model: *model,
            state: State {
                // Not the priors yet: written into, it would be copied to its place, and a copy of this length is a call
                // to a routine that most programs have no other use for.
                evidence: [0; N],
                stopping,
                rivals: Rivals::from_q56(0),
                touches: 0,
                decided: Decided::Fresh,
            },
        })
    }

    /// A recognizer that continues from a state under the same model.
    pub(crate) const fn continued(model: Model<'m>, state: State<N>) -> Self {
        Self { model, state }
    }

    /// Returns the state, for [`Recognizer::continued`].
    pub(crate) fn into_state(self) -> State<N> {
        self.state
    }

    /// Takes in a touch.
    ///
    /// Cost: the margins, then a few instructions for each object and one exponential, rarely more; and that of a misfit test, if
    /// the model has one. Cannot fail: evidence
    /// that reaches the limits of 64 bits (after 2^33 touches at the earliest) stays there, which brings objects closer
    /// together and never makes one recognized.
    ///
    /// # Errors
    /// [`Refused`], for a touch that the model was not trained for: it is not counted and changes nothing.
    pub fn push(&mut self, touch: &Touch) -> Result<Verdict, Refused> {
        self.model.accepts(touch)?;
        let mut margins = AlignedTo8([0; N]);
        self.model.touch_in_zeros(touch, &mut margins.0);
        Ok(self.add(&margins.0))
    }

    /// Takes in a row of features, as [`Model::margins_of`]. Of a model with a [position](Model::position) the row is the
    /// other features: its number is counted since the last [`reset`](Self::reset).
    ///
    /// # Errors
    /// [`Refused::NeedsTouches`], for a model over touches; [`Refused::NeedsSeen`], for one that states which rows it takes.
    pub fn push_features(&mut self, features: &[i32]) -> Result<Verdict, Refused> {
        let mut margins = self.margins_of_next(features)?;
        self.model.make_evidence(&mut margins);
        Ok(self.add(&margins))
    }

    /// Margins of the next row of a sequence, as [`push_features`](Self::push_features) takes it.
    pub(super) fn margins_of_next(&self, features: &[i32]) -> Result<[i32; N], Refused> {
        if self.model.descriptor().is_some() {
            return Err(Refused::NeedsTouches);
        }
        let mut margins = [0; N];
        if !self.model.has_sequences() {
            self.model.margins_of(features, &mut margins);
        } else if self.model.guard().is_some() {
            return Err(Refused::NeedsSeen);
        } else {
            self.margins_numbered(features, &mut margins);
        }
        Ok(margins)
    }

    // Apart: only a model with a position takes the room for its features on the stack.
    #[inline(never)]
    fn margins_numbered(&self, measured: &[i32], margins: &mut [i32]) {
        let mut features = [MISSING_FEATURE; 256];
        self.model.number(measured, self.touches().saturating_add(1), &mut features);
        self.model.margins_of(&features, margins);
    }

    /// Takes in a touch by its margins, computed beforehand with [`Model::margins`]; missing ones count as 0. For
    /// replaying the same touches in many orders.
    pub fn push_margins(&mut self, margins: &[i32]) -> Verdict {
        if self.model.row_evidence().is_none() {
            return self.add(margins);
        }
        let mut evidence = [0; N];
        evidence.iter_mut().zip(margins).for_each(|(evidence, &margin)| *evidence = margin);
        self.model.make_evidence(&mut evidence);
        self.add(evidence.get(..margins.len()).unwrap_or(&evidence))
    }

    /// The verdict after the last touch.
    pub const fn verdict(&self) -> Verdict {
        self.state.verdict()
    }

    /// Number of touches taken in since the last [`reset`](Self::reset).
    pub const fn touches(&self) -> u32 {
        self.state.touches
    }

    /// The object with the most evidence among those that can be named; the first of several. For an object with several
    /// [outputs](Model::outputs), whose weights add up, the output with the most evidence.
    ///
    /// Cost: a few instructions for each object; with several outputs an exponential for each.
    pub fn best(&self) -> usize {
        self.state.best(&self.model)
    }

    /// Result of the model's misfit test of the touches so far with the [best](Self::best) object; [`Familiarity::Known`]
    /// without one, and before the first touch.
    ///
    /// Cost: as the test in [`push`](Self::push).
    pub fn familiarity(&self) -> Familiarity {
        match self.state.touches {
            0 => Familiarity::Known,
            touches => {
                let leader = strangers::leader(&self.model, self.evidence()).0;
                strangers::familiarity(&self.model, self.evidence(), leader, touches)
            }
        }
    }

    /// Sum of the weights of all objects but the [best](Self::best), the best one's being 1, in Q56; the largest value
    /// where the background has more. The best object is recognized once this is at most its
    /// [threshold](Stopping::odds_of), and its touches [fit](Self::familiarity).
    ///
    /// Cost: an exponential for each object.
    pub fn rivals(&self) -> u64 {
        let mut priors = [0; N];
        let evidence = self.state.evidence_or_priors(&self.model, &mut priors);
        let unit = unit_of(&self.model, self.state.touches);
        if let Some(outputs) = self.model.outputs() {
            let leading = Leading::of(evidence, self.model.known_count(), outputs, unit);
            return leading.rivals().map_or(u64::MAX, Rivals::q56);
        }
        let best = strangers::leader(&self.model, evidence);
        match strangers::is_background(&self.model, evidence, best.1) {
            true => u64::MAX,
            false => evidence::rivals(evidence, best, u64::MAX, unit).map_or(u64::MAX, Rivals::q56),
        }
    }

    /// The posterior of an object, of the evidence divided by the model's [temperature](Model::temperature); 0 for an
    /// object that the model does not know.
    ///
    /// Cost: an exponential for each object, and a long division.
    pub fn posterior(&self, object: usize) -> Posterior {
        self.state.posterior(&self.model, object)
    }

    /// The posterior of the object that an output belongs to, and the share of it that is the output's: how likely the object
    /// lies as this placement says, if it is the object. Without [outputs](Model::outputs) that belong together the share
    /// is 1. Both are of the evidence divided by the model's [temperature](Model::temperature); 0 for an output that the
    /// model does not have.
    ///
    /// Cost: an exponential for each output, and two long divisions. Cannot fail.
    pub fn posterior_together(&self, output: usize) -> (Posterior, Posterior) {
        self.state.posterior_together(&self.model, output)
    }

    /// The evidence for each object: margins summed over touches, and the prior, in [units](Model::unit). Empty before the
    /// first touch, when there is nothing but the [prior](Model::prior).
    pub fn evidence(&self) -> &[i64] {
        self.state.evidence(&self.model)
    }

    /// Forgets all touches, for the next object.
    pub fn reset(&mut self) {
        self.state.touches = 0;
        self.state.decided = Decided::Fresh;
    }

    /// Forgets all touches, for the next object, which is one of those with a weight: `weights` say how often each
    /// object is touched, in any common unit, and replace the model's priors until the next [`reset`](Self::reset). An
    /// object of weight 0, or beyond the end of `weights`, cannot be recognized; a background keeps its prior. What the
    /// model promises was determined for its own priors, and its misfit test takes the weights' for evidence. The
    /// weights `&[3, 0, 1]` say that there are three of the first object for each of the third, and none of the second. An
    /// object with several [outputs](Model::outputs) has one weight, and each output has the share of it that the model
    /// states; or there is a weight for each output.
    ///
    /// Cost: two logarithms for each object, bit by bit.
    ///
    /// # Errors
    /// [`NothingExpected`], if all weights are 0; nothing changes then.
    pub fn reset_to(&mut self, weights: &[u32]) -> Result<(), NothingExpected> {
        let (known, outputs) = (self.model.known_count(), self.model.outputs());
        let object = |output: usize| match outputs {
            Some(outputs) => outputs.object(output).map_or(usize::MAX, usize::from),
            None => output,
        };
        let objects = known.checked_sub(1).map_or(0, |last| object(last).saturating_add(1));
        // More of them than objects: one for each output, whose shares they hold.
        let is_by_output = outputs.is_some() && weights.len() > objects;
        let outputs = outputs.filter(|_| !is_by_output);
        let object = |output: usize| if is_by_output { output } else { object(output) };
        let weights = weights.get(..if is_by_output { known } else { objects }).unwrap_or(weights);
        let most = weights.iter().copied().max().filter(|&most| most > 0).ok_or(NothingExpected)?;
        let unit = unit(&self.model);
        self.reset();
        // A background's stays.
        start(&self.model, &mut self.state.evidence);
        for (output, evidence) in self.state.evidence.iter_mut().take(known).enumerate() {
            *evidence = expected::prior(weights.get(object(output)).copied().unwrap_or(0), most, unit);
            if let Some(outputs) = outputs {
                *evidence = evidence.saturating_add(expected::prior(outputs.share(output), 1 << 16, unit));
            }
        }
        self.state.decided = Decided::Nothing;
        Ok(())
    }

    /// The model.
    pub const fn model(&self) -> &Model<'m> {
        &self.model
    }

    pub(crate) const fn state(&self) -> &State<N> {
        &self.state
    }

    /// Takes in a touch by its evidence: its margins, or their evidence by the model's table.
    pub(super) fn add(&mut self, margins: &[i32]) -> Verdict {
        if matches!(self.state.decided, Decided::Object(_) | Decided::Unknown | Decided::GaveUp) {
            return self.verdict();
        }
        self.state.begin(&self.model);
        for (evidence, &margin) in self.state.evidence.iter_mut().zip(margins) {
            *evidence = evidence.saturating_add(i64::from(margin));
        }
        self.state.touches = self.state.touches.saturating_add(1);
        let best = strangers::leader(&self.model, self.evidence());
        let familiarity = strangers::familiarity(&self.model, self.evidence(), best.0, self.state.touches);
        if let Some(outputs) = self.model.outputs() {
            let named = if familiarity == Familiarity::Known { self.named_together(outputs) } else { None };
            return self.decide(familiarity, named);
        }
        let odds = self.state.stopping.odds_of(best.0, &self.model);
        let may_be_named =
            familiarity == Familiarity::Known && !strangers::is_background(&self.model, self.evidence(), best.1);
        let unit = unit_of(&self.model, self.state.touches);
        let rivals = if may_be_named { evidence::rivals(self.evidence(), best, odds, unit) } else { None };
        self.decide(familiarity, rivals.map(|rivals| (best.0, rivals)))
    }

    /// The object that may be named by the sums over its outputs: its output with the most evidence, and its rivals.
    fn named_together(&self, outputs: Outputs<'_>) -> Option<(usize, Rivals)> {
        let (model, evidence) = (&self.model, self.evidence());
        let (unit, known) = (unit_of(model, self.state.touches), model.known_count());
        if together::is_undecided(evidence, known, outputs, self.state.stopping.loosest(model), unit) {
            return None;
        }
        let leading = Leading::of(evidence, known, outputs, unit);
        let odds = self.state.stopping.odds_of(leading.output, model);
        let rivals = leading.rivals().filter(|rivals| rivals.q56() <= odds)?;
        Some((leading.output, rivals))
    }

    /// Sets the verdict after a touch.
    fn decide(&mut self, familiarity: Familiarity, named: Option<(usize, Rivals)>) -> Verdict {
        if familiarity == Familiarity::Stranger {
            self.state.decided = Decided::Unknown;
        } else if let Some((object, rivals)) = named {
            self.state.decided = Decided::Object(u8::try_from(object).unwrap_or(u8::MAX));
            self.state.rivals = rivals;
        } else if self.state.touches >= self.state.stopping.max_touches {
            self.state.decided = Decided::GaveUp;
        }
        self.verdict()
    }
}

impl<const N: usize> State<N> {
    pub(crate) fn evidence(&self, model: &Model<'_>) -> &[i64] {
        let objects = if self.decided == Decided::Fresh { 0 } else { model.object_count() };
        self.evidence.get(..objects).unwrap_or_default()
    }

    /// Sets the evidence to the priors where nothing was taken in.
    pub(super) fn begin(&mut self, model: &Model<'_>) {
        if self.decided == Decided::Fresh {
            start(model, &mut self.evidence);
            self.decided = Decided::Nothing;
        }
    }

    pub(crate) fn best(&self, model: &Model<'_>) -> usize {
        let mut priors = [0; N];
        let evidence = self.evidence_or_priors(model, &mut priors);
        match model.outputs() {
            Some(outputs) => Leading::of(evidence, model.known_count(), outputs, unit_of(model, self.touches)).output,
            None => strangers::leader(model, evidence).0,
        }
    }

    pub(crate) fn posterior(&self, model: &Model<'_>, object: usize) -> Posterior {
        let unit = Unit { sharpness: model.temperature().sharpness(), ..unit_of(model, self.touches) };
        evidence::posterior(self.evidence_or_priors(model, &mut [0; N]), object, unit)
    }

    pub(crate) fn posterior_together(&self, model: &Model<'_>, output: usize) -> (Posterior, Posterior) {
        let Some(outputs) = model.outputs() else {
            let posterior = self.posterior(model, output);
            return (posterior, Posterior::of(output < model.object_count()));
        };
        let unit = Unit { sharpness: model.temperature().sharpness(), ..unit_of(model, self.touches) };
        let mut priors = [0; N];
        let evidence = self.evidence_or_priors(model, &mut priors);
        together::posterior(evidence, model.known_count(), output, outputs, unit)
    }

    /// The evidence, which before the first touch is the priors; they are put into `priors`.
    pub(crate) fn evidence_or_priors<'e>(&'e self, model: &Model<'_>, priors: &'e mut [i64; N]) -> &'e [i64] {
        let mut evidence = &self.evidence;
        if self.decided == Decided::Fresh {
            start(model, priors);
            evidence = priors;
        }
        evidence.get(..model.object_count()).unwrap_or_default()
    }

    pub(crate) const fn verdict(&self) -> Verdict {
        match self.decided {
            Decided::Fresh | Decided::Nothing => Verdict::Undecided,
            Decided::Object(object) => Verdict::Recognized { object, touches: self.touches, rivals: self.rivals },
            Decided::Unknown => Verdict::Unknown,
            Decided::GaveUp => Verdict::GaveUp,
        }
    }
}

/// Sets evidence to its value before any touch.
fn start(model: &Model<'_>, evidence: &mut [i64]) {
    for (evidence, prior) in evidence.iter_mut().zip(model.priors()) {
        *evidence = i32::from_le_bytes(*prior).into();
    }
}

pub(super) fn unit(model: &Model<'_>) -> Unit {
    let header = model.header();
    Unit { bits: header.unit_bits(), shift: header.unit_shift(), sharpness: SHARPNESS }
}

/// The unit of evidence of this many touches.
fn unit_of(model: &Model<'_>, touches: u32) -> Unit {
    unit(model).weighed(model.weight_of(touches))
}
