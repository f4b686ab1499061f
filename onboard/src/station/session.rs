//! A model in use, and the commands it can be given.

use super::message::{decision, refusal};
use super::record::{Record, Source, Staged, record_length};
use super::storage::{NoStorage, Place, Storage};
use super::table::Locates;
use crate::decide::State;
use crate::model::Opened;
use crate::{Model, Recognizer, SNAPSHOT_LENGTH, Stopping, Verdict};
use core::fmt;
use palpate_shared::Touch;
use palpate_shared::link::{
    ApproachMessage, Detail, Device, ModelInfo, NotStored, Outcome, POSE_BYTES, Payload, Progress, Refusal,
    VerdictMessage, checksum,
};
#[cfg(feature = "locate")]
use palpate_shared::{Approach, TablePose};

/// Room for a snapshot of `N` objects, where an array's length cannot be computed from `N`: room for a snapshot of
/// one object, `N` times.
type SnapshotBuffer<const N: usize> = [[u8; SNAPSHOT_LENGTH + 10]; N];

/// Default name of programs on the link: this crate and its version.
pub const PROGRAM: &str = concat!("palpate-onboard ", env!("CARGO_PKG_VERSION"));

/// A storage whose records are too short for a station.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordsTooShort {
    /// Bytes that a record needs: [`record_length`].
    pub needed: usize,
    /// Bytes that it can have.
    pub found: usize,
}

impl fmt::Display for RecordsTooShort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { needed, found } = self;
        write!(f, "a record may have {found} bytes and needs {needed}: see station::record_length")
    }
}

impl core::error::Error for RecordsTooShort {}

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
    /// The model of the newest record: it must not be written over.
    kept: Source,
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
        let (source, kept) = (Source::BuiltIn, Source::BuiltIn);
        Self { built_in, storage, opened, state, located, source, kept, staged, refused, program }
    }
}

impl<'m, const N: usize, S: Storage> Station<'m, N, S> {
    /// A station that continues from the newest record in `storage`, if it is of a model that is still there; also the
    /// progress of the link, and how many records have been written. `built_in` is a model in flash, in use until
    /// another is loaded; it may be empty.
    ///
    /// # Errors
    /// [`RecordsTooShort`].
    pub fn open(built_in: &'m [u8], storage: S) -> Result<(Self, Progress, u32), RecordsTooShort> {
        Self::open_with(built_in, storage, ())
    }
}

impl<'m, const N: usize, S: Storage, L: Locates> Station<'m, N, S, L> {
    /// A station as of [`open`](Self::open), with room for a model of maps. Touches under maps are not kept: after a reset a host
    /// hears that they are forgotten.
    ///
    /// # Errors
    /// [`RecordsTooShort`].
    pub fn open_with(built_in: &'m [u8], storage: S, located: L) -> Result<(Self, Progress, u32), RecordsTooShort> {
        let (needed, found) = (record_length(N), storage.record_length());
        if found < needed && found > 0 {
            return Err(RecordsTooShort { needed, found });
        }
        let mut station = Self::empty(built_in, storage, located);
        let newest = station.storage.newest();
        let starts = newest.map_or(0, |(counter, _)| counter);
        let record = newest.and_then(|(_, record)| postcard::from_bytes::<Record<'_>>(record).ok());
        let Some(record) = record else {
            station.use_built_in();
            return Ok((station, Progress::NONE, starts));
        };
        let (bytes, source) = (bytes_at(station.built_in, &station.storage, record.source), record.source);
        let is_of_record = bytes.last_chunk().is_some_and(|stated| u32::from_le_bytes(*stated) == record.model);
        if is_of_record && station.located.open(bytes).is_ok() {
            (station.source, station.kept) = (source, source);
            return Ok((station, Progress::NONE, starts));
        }
        let model = station.model_at(record.source);
        // A record of a model that is not there any more is not of this program: neither its evidence nor its progress.
        if model.map_or(0, |model| model.checksum()) != record.model {
            station.use_built_in();
            return Ok((station, Progress::NONE, starts));
        }
        let (staged, progress) = (record.staged, record.progress.clone());
        let opened = model.map(|model| model.opened());
        let state = model.and_then(|model| {
            let mut recognizer = Recognizer::new(&model, Stopping::from_model(&model)).ok()?;
            // A record without evidence is from the moment of a switch.
            let _ = recognizer.restore(record.evidence);
            Some(recognizer.into_state())
        });
        (station.opened, station.state) = (opened, state);
        (station.source, station.kept, station.staged) = (source, source, staged);
        Ok((station, progress, starts))
    }

    /// The model that a source names, if it is one with no more objects than there is room for.
    fn model_at(&self, source: Source) -> Option<Model<'_>> {
        Model::new(self.bytes_at(source)).ok().filter(|model| model.object_count() <= N)
    }

    fn bytes_at(&self, source: Source) -> &[u8] {
        bytes_at(self.built_in, &self.storage, source)
    }

    /// Puts the built-in model into use, if it is one.
    fn use_built_in(&mut self) {
        let opened = self.model_at(Source::BuiltIn).map(|model| model.opened());
        if opened.is_none() {
            // Other bytes are no model either.
            let _ = self.located.open(self.built_in);
        }
        self.use_model(opened);
    }

    /// Puts a model into use, with nothing touched.
    fn use_model(&mut self, opened: Option<Opened>) {
        self.opened = opened;
        self.state = self.model().and_then(|model| {
            let recognizer = Recognizer::new(&model, Stopping::from_model(&model)).ok()?;
            Some(recognizer.into_state())
        });
    }

    /// Sets the name and version of the chip's program on the link; [`PROGRAM`] by default.
    pub const fn set_program(&mut self, program: &'static str) {
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
    pub fn press(&mut self, touch: &Touch, position: [i32; 3], detail: bool) -> Result<VerdictMessage, Refusal> {
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
    pub fn has_decided(&self) -> bool {
        self.state.as_ref().is_some_and(|state| state.verdict() != Verdict::Undecided)
    }

    /// Number of touches, since power-up, that were not counted because the model was not trained for them.
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// The storage again.
    pub fn into_storage(self) -> S {
        self.storage
    }

    /// Place of the next model: neither the one in use, nor the one that a power cut would bring back.
    fn next_place(&self) -> Option<Place> {
        let free = |place: &Place| !self.source.is_in(*place) && !self.kept.is_in(*place);
        [Place::First, Place::Second].into_iter().find(free)
    }

    /// Puts the arrived data into use.
    fn accept(&mut self, staged: Staged) -> Result<(), Refusal> {
        let place = self.next_place().ok_or(Refusal::Unwritable)?;
        let length = usize::try_from(staged.length).unwrap_or(usize::MAX);
        let bytes = self.storage.model(place).get(..length).ok_or(Refusal::TooLong)?;
        if checksum(bytes) != staged.checksum {
            return Err(Refusal::Checksum);
        }
        match staged.payload {
            Payload::Model => {
                let current = match self.source {
                    Source::BuiltIn => self.built_in,
                    Source::First(_) => self.storage.model(Place::First),
                    Source::Second(_) => self.storage.model(Place::Second),
                };
                let length = self.storage.admit(bytes, current)?;
                let bytes = bytes.get(..length).ok_or(Refusal::TooLong)?;
                let opened = match Model::new(bytes) {
                    Ok(model) if model.object_count() > N => return Err(Refusal::TooLong),
                    Ok(model) => Some(model.opened()),
                    Err(_) => None,
                };
                match opened {
                    Some(_) => self.located.close(),
                    None => self.located.open(bytes)?,
                }
                self.source = Source::loaded(place, u32::try_from(length).map_err(|_| Refusal::TooLong)?);
                self.use_model(opened);
                Ok(())
            }
            Payload::Snapshot => {
                let (model, state) = (self.model().ok_or_else(|| self.no_trees())?, self.state.clone());
                let mut recognizer = Recognizer::continued(model, state.ok_or(Refusal::NoModel)?);
                recognizer.restore(bytes).map_err(|_| Refusal::Invalid)?;
                self.state = Some(recognizer.into_state());
                Ok(())
            }
            _ => Err(Refusal::Unsupported),
        }
    }

    /// Takes the next part of the arriving data.
    fn take(&mut self, offset: u32, bytes: &[u8]) -> Result<Outcome, Refusal> {
        let staged = self.staged.filter(|staged| staged.received == offset).ok_or(Refusal::OutOfOrder)?;
        let start = usize::try_from(offset).map_err(|_| Refusal::TooLong)?;
        let end = start.checked_add(bytes.len()).and_then(|end| u32::try_from(end).ok());
        let received = end.filter(|&end| end <= staged.length).ok_or(Refusal::TooLong)?;
        let place = self.next_place().ok_or(Refusal::Unwritable)?;
        if self.storage.write_model(place, start, bytes).is_ok() {
            self.staged = Some(Staged { received, ..staged });
            return Ok(Outcome::Done);
        }
        // Words that are half written cannot be written again before their sector is erased, and what precedes them goes too.
        let before = start.checked_rem(self.storage.sector()).and_then(|before| u32::try_from(before).ok());
        let offset = offset.saturating_sub(before.unwrap_or(0));
        self.staged = Some(Staged { received: offset, ..staged });
        Ok(Outcome::Continue { offset })
    }
}

/// Bytes of the model that a source names.
fn bytes_at<'b>(built_in: &'b [u8], storage: &'b impl Storage, source: Source) -> &'b [u8] {
    let prefix = |place, length| {
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        storage.model(place).get(..length).unwrap_or_default()
    };
    match source {
        Source::BuiltIn => built_in,
        Source::First(length) => prefix(Place::First, length),
        Source::Second(length) => prefix(Place::Second, length),
    }
}

fn outcome(result: Result<(), Refusal>) -> Outcome {
    result.map_or_else(Outcome::Refused, |()| Outcome::Done)
}

impl<const N: usize, S: Storage, L: Locates> Device for Station<'_, N, S, L> {
    fn touch(&mut self, touch: &Touch, detail: bool) -> Outcome {
        self.push(touch, detail).map_or_else(Outcome::Refused, Outcome::Verdict)
    }

    fn press(&mut self, touch: &Touch, position: [i32; 3], detail: bool) -> Outcome {
        Self::press(self, touch, position, detail).map_or_else(Outcome::Refused, Outcome::Verdict)
    }

    fn reset(&mut self) -> Outcome {
        let bytes = bytes_at(self.built_in, &self.storage, self.source);
        let reset = self.located.reset(bytes);
        outcome(reset.or_else(|_| self.with(|recognizer| recognizer.reset())))
    }

    fn begin(&mut self, payload: Payload, length: u32, checksum: u32) -> Outcome {
        if let Some(staged) = self.staged.take()
            && (staged.payload, staged.length, staged.checksum) == (payload, length, checksum)
            && staged.received > 0
        {
            self.staged = Some(staged);
            return Outcome::Continue { offset: staged.received };
        }
        let room = self.storage.room();
        outcome(if room == 0 {
            // No smaller model would fit either.
            Err(Refusal::Unsupported)
        } else if usize::try_from(length).is_ok_and(|length| length <= room) {
            self.staged = Some(Staged { payload, length, checksum, received: 0 });
            Ok(())
        } else {
            Err(Refusal::TooLong)
        })
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Outcome {
        self.take(offset, bytes).unwrap_or_else(Outcome::Refused)
    }

    fn commit(&mut self) -> Outcome {
        let complete = self.staged.take_if(|staged| staged.received == staged.length);
        outcome(complete.ok_or(Refusal::OutOfOrder).and_then(|staged| self.accept(staged)))
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

    fn snapshot(&mut self, offset: u32, buffer: &mut [u8]) -> Result<(u32, usize), Refusal> {
        let mut whole: SnapshotBuffer<N> = [[0; _]; N];
        let whole = self.ask(|model, state| state.snapshot(model, whole.as_flattened_mut()))?;
        let whole = whole.map_err(|_| Refusal::TooLong)?;
        let rest = usize::try_from(offset).ok().and_then(|offset| whole.get(offset..)).ok_or(Refusal::OutOfOrder)?;
        let count = rest.len().min(buffer.len());
        buffer.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        Ok((u32::try_from(whole.len()).unwrap_or(u32::MAX), count))
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
    fn place(&mut self, rank: u8) -> Result<(bool, Option<TablePose>), Refusal> {
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

    fn store(&mut self, progress: &Progress) -> Result<(), NotStored> {
        if self.storage.record_length() == 0 {
            return Ok(());
        }
        let mut buffer: SnapshotBuffer<N> = [[0; _]; N];
        let evidence = self.ask(|model, state| state.snapshot(model, buffer.as_flattened_mut()).ok());
        let evidence = evidence.ok().flatten().unwrap_or_default();
        let model = Device::model(self).map_or(0, |model| model.checksum);
        let (source, staged) = (self.source, self.staged);
        let record = Record { model, source, staged, progress: progress.clone(), evidence };
        self.storage.store(|bytes| postcard::to_slice(&record, bytes).ok().map(|written| written.len()))?;
        self.kept = source;
        Ok(())
    }
}
