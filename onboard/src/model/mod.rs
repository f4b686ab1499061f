//! Bytes to a model to the margins of a touch.

mod check;
#[cfg(feature = "code")]
mod code;
mod fixed;
mod header;
mod margins;
mod optional;
mod predict;
mod refused;
#[cfg(feature = "rows")]
mod rows;

#[cfg(feature = "code")]
pub use code::Code;
#[cfg(feature = "locate")]
pub(crate) use header::whole;
pub use predict::predicted_value;
pub use refused::Refused;

use crate::bytes::{ModelError, at, take};
use crate::layouts::{Places, Sections, built_in};
use palpate_shared::format::{
    Counted, Feature, Fingerprints, Guard, HEADER_LENGTH, Header, Key, Layout, LeafType, OddsByObject, Outputs,
    PatternShares, Plan, Position, Promise, RowEvidence, Section, Sentinel, SharedLeaves, Strangers, Tag, Temperature,
    TrainedNoise, TrainedProbe, TrainedTouches, Weights, take_feature, take_section,
};
use palpate_shared::{Descriptor, MISSING_FEATURE, Patterns};

/// A compiled model, read in place from bytes that stay where they are (flash, at any alignment).
///
/// `FORMAT.md` of `palpate-shared` describes the bytes.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    sections: Sections<'a>,
    stated: Stated,
    /// The trees of a model of the layout code.
    #[cfg(feature = "code")]
    code: Option<Code>,
}

/// Statements of a model that recognition depends on. Small, as [`Sections`] is: a model of more than 64 bytes is
/// copied by a call, to a routine that most programs have no other use for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stated {
    descriptor: Option<Descriptor>,
    /// The fields of [`TrainedTouches`].
    patterns: Patterns,
    counted: Counted,
    needs_pose: bool,
    largest_spread: u32,
    /// Offset of thresholds by object; 0 if there are none. The seven highest bits are flags of
    /// sections about strangers, of shared leaves, of features that stand for a missing value, of weights by the number of
    /// touches, of the evidence of a row, of outputs that belong together, and of rows that are numbered or guarded.
    by_object: u32,
}

/// See [`Stated::by_object`]: no model is as long.
const HAS_STRANGERS: u32 = 1 << 31;
/// Flag of shared leaves, as above.
const HAS_SHARED_LEAVES: u32 = 1 << 30;
/// Flag of features that stand for a missing value.
const HAS_SENTINEL: u32 = 1 << 29;
/// Flag of weights by the number of touches.
const HAS_WEIGHTS: u32 = 1 << 28;
/// Flag of the evidence of a row.
const HAS_ROW_EVIDENCE: u32 = 1 << 27;
/// Flag of outputs that belong together.
const HAS_OUTPUTS: u32 = 1 << 26;
/// Flag of rows that are numbered or guarded.
const HAS_SEQUENCES: u32 = 1 << 25;
/// Flags that are not a place in [`Stated::by_object`].
const MARKS: u32 =
    HAS_STRANGERS | HAS_SHARED_LEAVES | HAS_SENTINEL | HAS_WEIGHTS | HAS_ROW_EVIDENCE | HAS_OUTPUTS | HAS_SEQUENCES;

impl Stated {
    /// Statements of a model without optional sections.
    fn new(descriptor: Option<Descriptor>) -> Self {
        let TrainedTouches { patterns, counted, needs_pose, largest_spread } =
            TrainedTouches::full(descriptor.is_some_and(Descriptor::needs_pose));
        Self { descriptor, patterns, counted, needs_pose, largest_spread, by_object: 0 }
    }

    fn set_touches(&mut self, touches: TrainedTouches) {
        let TrainedTouches { patterns, counted, needs_pose, largest_spread } = touches;
        (self.patterns, self.counted, self.needs_pose) = (patterns, counted, needs_pose);
        self.largest_spread = largest_spread;
    }

    const fn touches(&self) -> TrainedTouches {
        let &Self { patterns, counted, needs_pose, largest_spread, .. } = self;
        TrainedTouches { patterns, counted, needs_pose, largest_spread }
    }
}

/// Offsets of the parts of an opened model: a [`Model`] without its bytes. For callers that keep the bytes somewhere
/// that can also be written, and so cannot keep a reference to them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opened {
    places: Places,
    stated: Stated,
}

impl Opened {
    /// The model in the bytes that it was opened from; `None` if there are fewer or more of them. Cost: a few
    /// instructions. Other bytes of the same length give wrong margins, nothing worse.
    pub(crate) fn model<'a>(&self, bytes: &'a [u8]) -> Option<Model<'a>> {
        Some(Model::of(Sections::at(bytes, &self.places)?, self.stated))
    }
}

impl<'a> Model<'a> {
    /// Offsets of its parts.
    pub(crate) fn opened(&self) -> Opened {
        Opened { places: self.sections.places(), stated: self.stated }
    }

    /// Opens a model, checking everything that reading it later relies on: after this nothing can fail.
    ///
    /// Cost: in proportion to the bytes, nearly all of it for the checksum; call it once and keep the result.
    ///
    /// # Errors
    /// [`ModelError`] for bytes that are truncated, too many, of another version, changed, or meaningless.
    #[inline(never)]
    pub fn new(bytes: &'a [u8]) -> Result<Self, ModelError> {
        let model = Self::opened_with_code(bytes);
        // Only where a model may have code: others need not be copied to look at their layout.
        #[cfg(feature = "code")]
        if model.as_ref().is_ok_and(|model| model.layout() == Layout::Code) {
            return Err(ModelError::NeedsCode);
        }
        model
    }

    /// A model of any layout, also one without its trees.
    #[inline(always)]
    fn opened_with_code(bytes: &'a [u8]) -> Result<Self, ModelError> {
        header::whole(bytes)?;
        header::read(bytes).map_err(|wrong| wrong.in_model(bytes))
    }

    /// A model of sections that were checked.
    const fn of(sections: Sections<'a>, stated: Stated) -> Self {
        Self {
            sections,
            stated,
            #[cfg(feature = "code")]
            code: None,
        }
    }

    /// The header.
    pub fn header(&self) -> Header<'a> {
        self.sections.header()
    }

    /// All of the model's bytes.
    pub const fn bytes(&self) -> &'a [u8] {
        self.sections.bytes
    }

    /// Number of objects that the model has margins for: 1 to 256. The last of them may be the
    /// [background](Model::background). Where several outputs belong to one object, this is the number of outputs: see
    /// [`outputs`](Model::outputs).
    pub fn object_count(&self) -> usize {
        self.sections.objects()
    }

    /// The objects that the model's outputs belong to, where several belong to one: such as an object's placements on a table.
    /// Otherwise each output is an object. The background's entry means nothing: it is an object of its own.
    ///
    /// Cost: next to none if the model has none, otherwise a few instructions for each optional section. Cannot fail.
    pub fn outputs(&self) -> Option<Outputs<'a>> {
        if !cfg!(feature = "outputs") || self.stated.by_object & HAS_OUTPUTS == 0 {
            return None;
        }
        Outputs::opened(optional::find(self.optional(), Tag::Outputs), self.object_count())
    }

    /// True if two outputs belong to the same object.
    ///
    /// Cost: as [`outputs`](Model::outputs). Cannot fail.
    pub fn is_same_object(&self, one: usize, other: usize) -> bool {
        let is_background = |output| output >= self.known_count();
        one == other
            || self.outputs().is_some_and(|outputs| {
                !is_background(one) && !is_background(other) && outputs.object(one) == outputs.object(other)
            })
    }

    /// Statements of the model about objects that it does not know, if it has any.
    ///
    /// Cost: a few instructions for each optional section, and more for its own. Cannot fail.
    pub fn strangers(&self) -> Option<Strangers<'a>> {
        if !cfg!(feature = "strangers") || self.stated.by_object & HAS_STRANGERS == 0 {
            return None;
        }
        Strangers::opened(optional::find(self.optional(), Tag::Strangers))
    }

    /// The object that stands for everything that the model does not know: the last one, if the model was trained with
    /// a background. It is a rival of the others, and never named.
    pub fn background(&self) -> Option<usize> {
        self.strangers().filter(|strangers| strangers.background).map(|_| self.known_count())
    }

    /// Number of objects that can be named: all but the background.
    pub fn known_count(&self) -> usize {
        let background = self.strangers().is_some_and(|strangers| strangers.background);
        self.object_count().saturating_sub(background.into())
    }

    /// The table that leaves are indices into, if equal leaves are stored once.
    ///
    /// Cost: a few instructions for each optional section. Cannot fail.
    pub fn shared_leaves(&self) -> Option<SharedLeaves<'a>> {
        if !built_in::SHARED_LEAVES || self.stated.by_object & HAS_SHARED_LEAVES == 0 {
            return None;
        }
        SharedLeaves::from_bytes(optional::find(self.optional(), Tag::SharedLeaves))
    }

    /// The features that stand for a missing value, if the model states some: they are taken as missing in any feature.
    ///
    /// Cost: next to none if there are none, otherwise a few instructions for each optional section. Cannot fail.
    pub fn sentinel(&self) -> Option<Sentinel> {
        if !cfg!(feature = "sentinel") || self.stated.by_object & HAS_SENTINEL == 0 {
            return None;
        }
        Sentinel::from_bytes(optional::find(self.optional(), Tag::Sentinel))
    }

    /// The table that makes evidence of a row's margins, if the model has one; otherwise margins are evidence.
    ///
    /// Cost: next to none if there is none, otherwise a few instructions for each optional section. Cannot fail.
    pub fn row_evidence(&self) -> Option<RowEvidence<'a>> {
        if !cfg!(feature = "row-evidence") || self.stated.by_object & HAS_ROW_EVIDENCE == 0 {
            return None;
        }
        RowEvidence::opened(optional::find(self.optional(), Tag::RowEvidence))
    }

    /// Makes evidence of a row's margins, in units: what the row adds for each object. Without a
    /// [table](Model::row_evidence) margins stay as they are.
    ///
    /// Cost: with a table two of its values and a multiplication for each object, and a search among the optional sections.
    /// Cannot fail.
    pub fn make_evidence(&self, margins: &mut [i32]) {
        if let Some(table) = self.row_evidence() {
            margins.iter_mut().take(self.object_count()).for_each(|margin| *margin = table.of(*margin));
        }
    }

    /// Weight of the evidence of this many touches or rows when it is compared with a threshold, in Q16: 65,536, which is 1,
    /// unless the model states [others](Weights).
    ///
    /// Cost: next to none if it states none, otherwise leading zeros, and a search among the optional sections.
    /// Cannot fail.
    pub fn weight_of(&self, touches: u32) -> u32 {
        if !cfg!(feature = "row-evidence") || self.stated.by_object & HAS_WEIGHTS == 0 {
            return Weights::ONE;
        }
        Weights::from_bytes(optional::find(self.optional(), Tag::Weights))
            .map_or(Weights::ONE, |weights| weights.of(touches))
    }

    /// True if rows of a sequence are numbered or guarded: see [`position`](Model::position) and [`guard`](Model::guard).
    pub(crate) fn has_sequences(&self) -> bool {
        cfg!(feature = "sequences") && self.stated.by_object & HAS_SEQUENCES != 0
    }

    /// The feature that is the number of a row in its sequence, if the model has one. Recognizers count it themselves:
    /// see [`Recognizer::push_features`](crate::Recognizer::push_features). Other calls take it from the row.
    ///
    /// Cost: next to none if there is none, otherwise a few instructions for each optional section. Cannot fail.
    pub fn position(&self) -> Option<Position> {
        if !self.has_sequences() {
            return None;
        }
        Position::from_bytes(optional::find(self.optional(), Tag::Position), self.feature_count())
    }

    /// Limits of each feature in the rows that the model takes in a sequence, if it states them: see
    /// [`RowsSeen`](crate::RowsSeen).
    ///
    /// Cost: as [`position`](Model::position). Cannot fail.
    pub fn guard(&self) -> Option<Guard<'a>> {
        if !self.has_sequences() {
            return None;
        }
        Guard::from_bytes(optional::find(self.optional(), Tag::Guard), self.feature_count())
    }

    /// Number of features of a row that someone measures: all but the [position](Model::position).
    pub fn measured_count(&self) -> usize {
        self.feature_count().saturating_sub(self.position().is_some().into())
    }

    /// The features of row `number` of a sequence, counted from 1, whose measured features are `measured`: these in their
    /// order, and the number in the place of the model's [position](Model::position), or nothing more if it has none. Missing
    /// ones at the end are [`MISSING_FEATURE`](palpate_shared::MISSING_FEATURE); those beyond the end of `features` are left out.
    ///
    /// Cost: a few instructions for each feature. Cannot fail.
    pub fn number(&self, measured: &[i32], number: u32, features: &mut [i32]) {
        features.fill(MISSING_FEATURE);
        let position = self.position();
        let place = position.map_or(usize::MAX, |position| usize::from(position.feature));
        let (before, after) = measured.split_at(place.min(measured.len()));
        features.iter_mut().zip(before).for_each(|(to, from)| *to = *from);
        if let (Some(position), Some((own, rest))) =
            (position, features.get_mut(place..).and_then(<[i32]>::split_first_mut))
        {
            *own = position.of(number, self.key() == Key::Real);
            rest.iter_mut().zip(after).for_each(|(to, from)| *to = *from);
        }
    }

    /// The section about what margins become; empty if there is none.
    fn stated_prediction(&self) -> &'a [u8] {
        optional::find(self.optional(), Tag::Prediction)
    }

    /// Number of features of a row: 1 to 256.
    pub fn feature_count(&self) -> usize {
        usize::from(self.header().last_feature()) + 1
    }

    /// Features that a touch is turned into; `None` for a model over rows of features.
    pub const fn descriptor(&self) -> Option<Descriptor> {
        self.stated.descriptor
    }

    /// Layout of the trees.
    pub const fn layout(&self) -> Layout {
        self.sections.layout
    }

    /// Type that leaves are stored as.
    pub const fn leaf_type(&self) -> LeafType {
        self.sections.leaf
    }

    /// True if margins are added in f32; never without the feature `f32-leaves`, so that no code for it is linked.
    pub(crate) const fn is_float(&self) -> bool {
        built_in::leaf(LeafType::F32) && matches!(self.sections.leaf, LeafType::F32)
    }

    /// Type that features are compared as.
    pub fn key(&self) -> Key {
        Key::from_code(self.header().key()).unwrap_or(Key::Whole)
    }

    /// Nats in one unit of a margin.
    pub fn unit(&self) -> f32 {
        self.header().unit()
    }

    /// The farthest that a margin can be from the full model's, in nats.
    pub fn margin_error(&self) -> f32 {
        self.header().margin_error()
    }

    /// The checksum, which names the model: two models with the same are the same.
    pub fn checksum(&self) -> u32 {
        self.sections.bytes.last_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes))
    }

    /// The version of the program that exported the model.
    pub fn tool_version(&self) -> &'a str {
        self.text(0)
    }

    /// The name of an object; empty for one that the model does not know.
    ///
    /// Cost: a few instructions for each object before it.
    pub fn object_name(&self, object: usize) -> &'a str {
        self.text(object.saturating_add(1))
    }

    /// The evidence for an object before any touch, in units of a margin.
    pub fn prior(&self, object: usize) -> i32 {
        self.priors().get(object).map_or(0, |prior| i32::from_le_bytes(*prior))
    }

    /// The probe that the model was trained for, if it states one.
    pub fn probe(&self) -> Option<TrainedProbe> {
        TrainedProbe::from_bytes(optional::find(self.optional(), Tag::Probe))
    }

    /// The touches that the model was trained on, and so the only ones that count as evidence: full touches, with a pose
    /// if the descriptor needs one, unless the model states others.
    pub const fn trained_touches(&self) -> TrainedTouches {
        self.stated.touches()
    }

    /// Largest sum of the weights of all other objects, this one's being 1, with which it is recognized, in Q56: the
    /// model's own threshold for it. `None` if the model has one threshold for all objects, which its header states.
    ///
    /// Cost: a few instructions. Cannot fail.
    pub fn odds_of(&self, object: usize) -> Option<u64> {
        self.thresholds()?.odds(object)
    }

    /// The loosest threshold, if objects have their own.
    pub(crate) fn loosest_odds(&self) -> Option<u64> {
        let thresholds = self.thresholds()?;
        (0..self.object_count()).filter_map(|object| thresholds.odds(object)).max()
    }

    fn thresholds(&self) -> Option<OddsByObject<'a>> {
        let start = usize::try_from(self.stated.by_object & !MARKS).ok().filter(|&start| start > 0)?;
        let section = self.sections.bytes.get(start..)?;
        Some(OddsByObject::from_bytes(section.get(..OddsByObject::LENGTH * self.object_count())?))
    }

    /// Promise of the model about its verdicts, if it was calibrated.
    pub fn promise(&self) -> Option<Promise> {
        Promise::from_bytes(optional::find(self.optional(), Tag::Promise))
    }

    /// Divisor of the evidence before it becomes a posterior; 1 unless the model states it.
    ///
    /// Cost: a few instructions for each optional section.
    pub fn temperature(&self) -> Temperature {
        Temperature::from_bytes(optional::find(self.optional(), Tag::Temperature)).unwrap_or(Temperature::ONE)
    }

    /// The noise in the training, if the model states it.
    pub fn noise(&self) -> Option<TrainedNoise> {
        TrainedNoise::from_bytes(optional::find(self.optional(), Tag::Noise))
    }

    /// Frequency of each contact pattern among the approaches of the training, if the model states it.
    pub fn pattern_shares(&self) -> Option<PatternShares> {
        PatternShares::from_bytes(optional::find(self.optional(), Tag::PatternShares))
    }

    /// Fingerprints of the touches that the model was trained on, if it states them.
    pub fn fingerprints(&self) -> Option<Fingerprints<'a>> {
        Fingerprints::from_bytes(optional::find(self.optional(), Tag::Fingerprints), self.object_count())
    }

    /// The plan of approaches, if the model has one: what [`Recognizer::next_approach`](crate::Recognizer::next_approach)
    /// proposes poses by.
    ///
    /// Cost: a few instructions for each optional section.
    pub fn plan(&self) -> Option<Plan<'a>> {
        Plan::from_bytes(optional::find(self.optional(), Tag::Plan), self.object_count())
    }

    /// The features of a model over rows, in their order, as far as the model states them.
    pub fn features(&self) -> impl Iterator<Item = Feature<'a>> {
        let mut rest = optional::find(self.optional(), Tag::FeatureNames);
        core::iter::from_fn(move || take_feature(&mut rest))
    }

    /// The optional sections, in the order of their tags; also those that this crate does not know.
    pub fn optional_sections(&self) -> impl Iterator<Item = Section<'a>> {
        let mut rest = self.optional();
        core::iter::from_fn(move || take_section(&mut rest))
    }

    /// The evidence for each object before any touch.
    pub(crate) fn priors(&self) -> &'a [[u8; 4]] {
        self.sections.base_and_priors().1.as_chunks().0
    }

    /// The optional sections.
    fn optional(&self) -> &'a [u8] {
        let length = usize::try_from(self.header().optional_length()).unwrap_or_default();
        let start = HEADER_LENGTH + self.text_length();
        self.sections.bytes.get(start..start + length).unwrap_or_default()
    }

    fn text_length(&self) -> usize {
        usize::try_from(self.header().text_length()).unwrap_or_default()
    }

    fn text(&self, index: usize) -> &'a str {
        let mut text = self.sections.bytes.get(HEADER_LENGTH..).unwrap_or_default();
        text = text.get(..self.text_length()).unwrap_or_default();
        for _ in 0..index {
            if text.is_empty() {
                return "";
            }
            next_text(&mut text);
        }
        core::str::from_utf8(next_text(&mut text)).unwrap_or_default()
    }
}

/// The next string: a byte for its length, then its UTF-8. Where the text ends before the string does, nothing is left of it.
fn next_text<'a>(text: &mut &'a [u8]) -> &'a [u8] {
    let length = usize::from(at(text, 0));
    let string = take(text, 1).and_then(|_| take(text, length));
    if string.is_none() {
        *text = &[];
    }
    string.unwrap_or_default()
}
