//! A model in use, and the requests it answers.

use super::message::{decision, refusal};
use super::storage::{Loaded, NoStorage, NotStored, Place, Storage};
use super::table::Locates;
use crate::decide::State;
use crate::model::Opened;
use crate::{Model, Recognizer, Stopping, Verdict};
#[cfg(feature = "locate")]
use palpate_shared::Approach;
use palpate_shared::Touch;
#[cfg(feature = "locate")]
use palpate_shared::link::PlaceMessage;
use palpate_shared::link::{ApproachMessage, Detail, Device, ModelInfo, POSE_BYTES, Refusal, VerdictMessage, checksum};

/// Default name of programs on the link: this crate and its version.
pub(crate) const PROGRAM: &str = concat!("palpate-onboard ", env!("CARGO_PKG_VERSION"));

/// Model in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    BuiltIn,
    Loaded(Loaded),
}

impl Source {
    /// True if the model is in this place.
    fn is_in(self, place: Place) -> bool {
        matches!(self, Self::Loaded(loaded) if loaded.place == place)
    }
}

/// A model that arrives in chunks, and the length that has arrived.
#[derive(Clone, Copy, Debug)]
struct Staged {
    length: u32,
    checksum: u32,
    received: u32,
}

/// A recognizer with room for `N` objects, as a [`Device`] at the end of a link, and what it keeps in `S`. A model of maps is
/// used instead of trees where `L` has room for one.
#[derive(Debug)]
pub struct Station<'m, const N: usize, S = NoStorage, L = ()> {
    built_in: &'m [u8],
    storage: S,
    /// The model in use, and the state of recognition under it.
    opened: Option<Opened>,
    state: Option<State<N>>,
    located: L,
    source: Source,
    staged: Option<Staged>,
    /// Touches that were not counted.
    refused: u32,
    /// Name of the program on the link.
    program: &'static str,
}

impl<'m, const N: usize> Station<'m, N> {
    /// A station that has one model and no storage: nothing can be loaded, nothing lasts.
    pub fn new(model: &Model<'m>) -> Self {
        let mut station = Self::empty(model.bytes(), NoStorage, ());
        station.use_model(Some(model.opened()));
        station
    }
}

impl<'m, const N: usize, S, L> Station<'m, N, S, L> {
    const fn empty(built_in: &'m [u8], storage: S, located: L) -> Self {
        let (opened, state, staged, refused, program) = (None, None, None, 0, PROGRAM);
        Self { built_in, storage, opened, state, located, source: Source::BuiltIn, staged, refused, program }
    }
}

impl<'m, const N: usize, S: Storage> Station<'m, N, S> {
    /// A station that begins with the model that was loaded last into `storage`, if it is still whole. `built_in` is a model in
    /// flash, in use until another is loaded; it may be empty.
    pub fn open(built_in: &'m [u8], storage: S) -> Self {
        Self::open_with(built_in, storage, ())
    }
}

impl<'m, const N: usize, S: Storage, L: Locates> Station<'m, N, S, L> {
    /// A station as of [`open`](Self::open), with room for a model of maps.
    pub fn open_with(built_in: &'m [u8], storage: S, located: L) -> Self {
        let mut station = Self::empty(built_in, storage, located);
        let loaded = station.storage.loaded().map(Source::Loaded);
        if !loaded.is_some_and(|source| station.use_source(source)) {
            station.use_source(Source::BuiltIn);
        }
        station
    }

    /// The model that a source names, if it is one with no more objects than there is room for.
    fn model_at(&self, source: Source) -> Option<Model<'_>> {
        Model::new(self.bytes_at(source)).ok().filter(|model| model.object_count() <= N)
    }

    fn bytes_at(&self, source: Source) -> &[u8] {
        bytes_at(self.built_in, &self.storage, source)
    }

    /// Puts the model that a source names into use, and says whether it is one.
    fn use_source(&mut self, source: Source) -> bool {
        self.source = source;
        let opened = self.model_at(source).map(|model| model.opened());
        let is_one = opened.is_some() || {
            let bytes = bytes_at(self.built_in, &self.storage, source);
            self.located.open(bytes).is_ok()
        };
        self.use_model(opened);
        is_one
    }

    /// Puts a model into use, with nothing touched.
    fn use_model(&mut self, opened: Option<Opened>) {
        if opened.is_some() {
            self.located.close();
        }
        self.opened = opened;
        self.state = self.model().and_then(|model| {
            let recognizer = Recognizer::new(&model, Stopping::from_model(&model)).ok()?;
            Some(recognizer.into_state())
        });
    }

    /// Sets the name and version of the chip's program on the link, by default those of this crate.
    pub(crate) const fn set_program(&mut self, program: &'static str) {
        self.program = program;
    }

    /// The model in use.
    pub fn model(&self) -> Option<Model<'_>> {
        self.opened?.model(self.bytes_at(self.source))
    }

    /// True while maps are in use.
    fn has_maps(&self) -> bool {
        self.located.info(self.bytes_at(self.source)).is_some()
    }

    /// The refusal of what needs trees.
    fn no_trees(&self) -> Refusal {
        if self.has_maps() { Refusal::Unsupported } else { Refusal::NoModel }
    }

    /// Lets the recognizer do something.
    ///
    /// # Errors
    /// [`Refusal::NoModel`] without a usable model.
    fn with<T>(&mut self, act: impl FnOnce(&mut Recognizer<'_, N>) -> T) -> Result<T, Refusal> {
        let state = self.state.take().ok_or(Refusal::NoModel)?;
        let model = self.model().ok_or(Refusal::NoModel)?;
        let mut recognizer = Recognizer::continued(model, state);
        let done = act(&mut recognizer);
        self.state = Some(recognizer.into_state());
        Ok(done)
    }

    /// Asks the recognizer without changing it.
    fn ask<T>(&self, question: impl FnOnce(&Model<'_>, &State<N>) -> T) -> Result<T, Refusal> {
        let both = self.model().zip(self.state.as_ref());
        both.map(|(model, state)| question(&model, state)).ok_or_else(|| self.no_trees())
    }

    /// Takes a touch into account.
    ///
    /// Cost: [`Recognizer::push`], and with a detail a posterior and a checksum of the evidence.
    ///
    /// # Errors
    /// [`Refusal::NoModel`] without a usable model; [`Refusal::Pattern`], [`Refusal::Spread`], [`Refusal::NoPose`] or
    /// [`Refusal::Features`] for a touch that the model was not trained for, and [`Refusal::NoPosition`] for one to a model of maps:
    /// [`Station::refused`] counts those.
    pub fn push(&mut self, touch: &Touch, detail: bool) -> Result<VerdictMessage, Refusal> {
        if self.has_maps() {
            return self.counted(Err(Refusal::NoPosition));
        }
        let pushed = self.with(|recognizer| {
            let decision = decision(recognizer.push(touch)?);
            let best = recognizer.best();
            let detail = detail.then(|| Detail::new(recognizer.posterior(best).q56(), recognizer.evidence()));
            let best = u8::try_from(best).unwrap_or(u8::MAX);
            Ok(VerdictMessage { decision, best, touches: recognizer.touches(), detail })
        })?;
        self.counted(pushed.map_err(refusal))
    }

    /// Takes a touch with a position into account, in micrometers, under a model of maps.
    ///
    /// Cost: a search of the maps, and with a detail a checksum of the evidence.
    ///
    /// # Errors
    /// [`Refusal::NoModel`] without a usable model; [`Refusal::NoPose`], [`Refusal::NotDown`], or [`Refusal::Position`] with a model
    /// of trees: [`Station::refused`] counts those.
    pub(crate) fn press(&mut self, touch: &Touch, position: [i32; 3], detail: bool) -> Result<VerdictMessage, Refusal> {
        let bytes = bytes_at(self.built_in, &self.storage, self.source);
        let pressed = self.located.press(bytes, touch, position, detail);
        // Without maps it says that there is no model.
        self.counted(pressed.map_err(|refusal| if self.state.is_some() { Refusal::Position } else { refusal }))
    }

    /// Counts a touch that is refused.
    fn counted(&mut self, pushed: Result<VerdictMessage, Refusal>) -> Result<VerdictMessage, Refusal> {
        if pushed.is_err() {
            self.refused = self.refused.saturating_add(1);
        }
        pushed
    }

    /// True if the touches so far have decided; no further one counts before a reset.
    pub(crate) fn has_decided(&self) -> bool {
        self.state.as_ref().is_some_and(|state| state.verdict() != Verdict::Undecided)
    }

    /// The storage again.
    pub fn into_storage(self) -> S {
        self.storage
    }

    /// Place of the next model: not the one in use.
    fn next_place(&self) -> Place {
        if self.source.is_in(Place::First) { Place::Second } else { Place::First }
    }

    /// Checks the model that has arrived, keeps that it was loaded, and puts it into use.
    fn accept(&mut self, staged: Staged) -> Result<(), Refusal> {
        let place = self.next_place();
        let length = usize::try_from(staged.length).unwrap_or(usize::MAX);
        let bytes = self.storage.model(place).get(..length).ok_or(Refusal::TooLong)?;
        if checksum(bytes) != staged.checksum {
            return Err(Refusal::Checksum);
        }
        let current = match self.source {
            Source::BuiltIn => self.built_in,
            Source::Loaded(loaded) => self.storage.model(loaded.place),
        };
        let length = self.storage.admit(bytes, current)?;
        let bytes = bytes.get(..length).ok_or(Refusal::TooLong)?;
        let opened = match Model::new(bytes) {
            Ok(model) if model.object_count() > N => return Err(Refusal::TooLong),
            Ok(model) => Some(model.opened()),
            Err(_) => None,
        };
        if opened.is_none() {
            self.located.open(bytes)?;
        }
        let length = u32::try_from(length).map_err(|_| Refusal::TooLong)?;
        let loaded = Loaded { place, length, checksum: checksum(bytes) };
        if self.storage.keep(loaded).is_err() {
            if opened.is_none() {
                self.use_source(self.source);
            }
            return Err(Refusal::Unwritable);
        }
        self.source = Source::Loaded(loaded);
        self.use_model(opened);
        Ok(())
    }

    /// Takes the next part of the arriving model, and says which byte comes next.
    fn take(&mut self, offset: u32, bytes: &[u8]) -> Result<u32, Refusal> {
        let staged = self.staged.filter(|staged| staged.received == offset).ok_or(Refusal::OutOfOrder)?;
        let start = usize::try_from(offset).map_err(|_| Refusal::TooLong)?;
        let end = start.checked_add(bytes.len()).and_then(|end| u32::try_from(end).ok());
        let end = end.filter(|&end| end <= staged.length).ok_or(Refusal::TooLong)?;
        let place = self.next_place();
        let received = match self.storage.write_model(place, start, bytes) {
            Ok(()) => end,
            // Words that are half written cannot be written again before their sector is erased, and what precedes them goes too.
            Err(NotStored) => {
                let before = start.checked_rem(self.storage.sector()).and_then(|before| u32::try_from(before).ok());
                offset.saturating_sub(before.unwrap_or(0))
            }
        };
        let staged = Staged { received, ..staged };
        if received == staged.length {
            self.staged = None;
            self.accept(staged)?;
        } else {
            self.staged = Some(staged);
        }
        Ok(received)
    }
}

/// Bytes of the model that a source names.
fn bytes_at<'b>(built_in: &'b [u8], storage: &'b impl Storage, source: Source) -> &'b [u8] {
    match source {
        Source::BuiltIn => built_in,
        Source::Loaded(Loaded { place, length, .. }) => {
            let length = usize::try_from(length).unwrap_or(usize::MAX);
            storage.model(place).get(..length).unwrap_or_default()
        }
    }
}

impl<const N: usize, S: Storage, L: Locates> Device for Station<'_, N, S, L> {
    fn touch(&mut self, touch: &Touch, detail: bool) -> Result<VerdictMessage, Refusal> {
        self.push(touch, detail)
    }

    fn press(&mut self, touch: &Touch, position: [i32; 3], detail: bool) -> Result<VerdictMessage, Refusal> {
        Self::press(self, touch, position, detail)
    }

    fn reset(&mut self) -> Result<(), Refusal> {
        let bytes = bytes_at(self.built_in, &self.storage, self.source);
        let reset = self.located.reset(bytes);
        reset.or_else(|_| self.with(|recognizer| recognizer.reset()))
    }

    fn begin(&mut self, length: u32, checksum: u32) -> Result<u32, Refusal> {
        let room = self.storage.room();
        if room == 0 {
            // No smaller model would fit either.
            return Err(Refusal::Unsupported);
        }
        if length == 0 {
            return Err(Refusal::Invalid);
        }
        if usize::try_from(length).map_or(true, |length| length > room) {
            return Err(Refusal::TooLong);
        }
        let same = self.staged.filter(|staged| (staged.length, staged.checksum) == (length, checksum));
        let staged = same.unwrap_or(Staged { length, checksum, received: 0 });
        self.staged = Some(staged);
        Ok(staged.received)
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<u32, Refusal> {
        self.take(offset, bytes)
    }

    fn model(&self) -> Option<ModelInfo> {
        let maps = self.located.info(self.bytes_at(self.source));
        if maps.is_some() {
            return maps;
        }
        let model = Self::model(self)?;
        Some(ModelInfo {
            checksum: model.checksum(),
            length: u32::try_from(model.bytes().len()).unwrap_or(u32::MAX),
            last_object: u8::try_from(model.object_count().saturating_sub(1)).unwrap_or(u8::MAX),
            descriptor: model.descriptor().map_or(u8::MAX, |descriptor| descriptor.code()),
        })
    }

    fn name(&self, object: u8) -> Option<&str> {
        let bytes = self.bytes_at(self.source);
        let Some(opened) = self.opened else { return self.located.name(bytes, object) };
        let (object, model) = (usize::from(object), opened.model(bytes)?);
        (object < model.object_count()).then(|| model.object_name(object))
    }

    fn posterior(&self, object: u8) -> Option<u64> {
        if self.opened.is_none() {
            return self.located.posterior(self.bytes_at(self.source), object);
        }
        let object = usize::from(object);
        let known = |model: &Model<'_>, state: &State<N>| {
            (object < model.object_count()).then(|| state.posterior(model, object).q56())
        };
        self.ask(known).ok()?
    }

    fn next_approach(&self, without: &[u8; POSE_BYTES]) -> Result<ApproachMessage, Refusal> {
        let within = |pose: &u16| {
            let byte = without.get(usize::from(*pose / 8)).copied().unwrap_or(0);
            byte >> (pose % 8) & 1 == 0
        };
        let proposal = self.ask(|model, state| {
            let poses = model.plan()?.poses();
            let proposal = state.propose(model, (0..poses.count()).filter(within))?;
            Some(ApproachMessage::new(proposal.pose, proposal.score, &poses.pose(proposal.pose)?))
        })?;
        proposal.ok_or(Refusal::NoPlan)
    }

    #[cfg(feature = "locate")]
    fn place(&mut self, rank: u8) -> Result<PlaceMessage, Refusal> {
        self.located.place(bytes_at(self.built_in, &self.storage, self.source), rank)
    }

    #[cfg(feature = "locate")]
    fn placement(&self, placement: u8) -> Option<&str> {
        self.located.placement(self.bytes_at(self.source), placement)
    }

    #[cfg(feature = "locate")]
    fn next_press(&mut self, within: Option<u32>) -> Result<Approach, Refusal> {
        self.located.next_press(bytes_at(self.built_in, &self.storage, self.source), within)
    }

    fn program(&self) -> &str {
        self.program
    }

    fn refused(&self) -> u32 {
        self.refused
    }
}
