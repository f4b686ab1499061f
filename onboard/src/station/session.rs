//! A model in use, and the commands it can be given.

use super::record::{Record, Records, Source, Staged};
use crate::{Model, Recognizer, Refused, SNAPSHOT_LENGTH, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_shared::link::{
    Decision, Detail, Device, ModelInfo, NotStored, Outcome, Payload, Progress, Refusal, VerdictMessage, checksum,
};

/// Room for a snapshot of `N` objects, where an array's length cannot be computed from `N`: for each object what one
/// object alone would take.
type SnapshotBuffer<const N: usize> = [[u8; SNAPSHOT_LENGTH + 10]; N];

/// A recognizer with room for `N` objects, as a [`Device`] at the end of a link.
#[derive(Debug)]
pub struct Station<'m, 'r, const N: usize> {
    model: Option<&'m Model<'m>>,
    recognizer: Option<Recognizer<'m, N>>,
    /// Where models and snapshots arrive.
    staging: &'m mut [u8],
    staged: Option<Staged>,
    source: Source,
    /// What the model that is arriving will be.
    next_source: Source,
    switched: bool,
    /// The checksum of the model that was switched to.
    switched_to: u32,
    /// Touches that were not counted.
    refused: u32,
    records: Option<&'m mut Records<'r>>,
}

impl<'m, 'r, const N: usize> Station<'m, 'r, N> {
    /// A station that has one model and no memory: nothing can be loaded, nothing lasts.
    pub fn new(model: &'m Model<'m>) -> Self {
        Self::with_memory(Some(model), &mut [], (Source::BuiltIn, Source::BuiltIn), None)
    }

    pub(super) fn with_memory(
        model: Option<&'m Model<'m>>,
        staging: &'m mut [u8],
        (source, next_source): (Source, Source),
        records: Option<&'m mut Records<'r>>,
    ) -> Self {
        let recognizer = model.and_then(|model| Recognizer::new(model, Stopping::from_model(model)).ok());
        let mut station = Self {
            model,
            recognizer,
            staging,
            staged: None,
            source,
            next_source,
            switched: false,
            switched_to: 0,
            refused: 0,
            records,
        };
        station.resume();
        station
    }

    /// Continues from the newest record if it is of this model.
    fn resume(&mut self) {
        let model = self.model.map_or(0, |model| model.checksum());
        let Some(record) = self.records.as_ref().and_then(|records| records.newest()) else { return };
        if (record.source, record.model) == (self.source, model) {
            self.staged = record.staged;
            if let Some(recognizer) = &mut self.recognizer {
                // A record without evidence is from the moment of a switch.
                let _ = recognizer.restore(record.evidence);
            }
        }
    }

    /// The model to continue with, once a command has switched to another one.
    pub(super) fn switched(&self) -> Option<Source> {
        self.switched.then_some(self.source)
    }

    /// Takes a touch into account.
    ///
    /// Cost: [`Recognizer::push`], and with a detail a posterior and 400 instructions per object.
    ///
    /// # Errors
    /// [`Refusal::NoModel`] without a usable model; [`Refusal::Pattern`], [`Refusal::Spread`], [`Refusal::NoPose`] or
    /// [`Refusal::Features`] for a touch that the model was not trained for: [`Station::refused`] counts those.
    pub fn push(&mut self, touch: &Touch, detail: bool) -> Result<VerdictMessage, Refusal> {
        let recognizer = self.recognizer.as_mut().ok_or(Refusal::NoModel)?;
        let decision = match recognizer.push(touch) {
            Ok(Verdict::Undecided) => Decision::Undecided,
            Ok(Verdict::Recognized { object, .. }) => Decision::Recognized(object),
            Ok(Verdict::Unknown) => Decision::Unknown,
            Err(refused) => {
                self.refused = self.refused.saturating_add(1);
                return Err(refusal(refused));
            }
        };
        let best = recognizer.best();
        let detail = detail.then(|| Detail::new(recognizer.posterior(best).q56(), recognizer.evidence()));
        let best = u8::try_from(best).unwrap_or(u8::MAX);
        Ok(VerdictMessage { decision, best, touches: recognizer.touches(), detail })
    }

    /// How many touches were not counted because the model was not trained for them, since power-up or the last change
    /// of the model.
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Puts what has arrived into use.
    fn accept(&mut self, staged: Staged) -> Result<(), Refusal> {
        let length = usize::try_from(staged.length).unwrap_or(usize::MAX);
        let bytes = self.staging.get(..length).ok_or(Refusal::TooLong)?;
        if checksum(bytes) != staged.checksum {
            return Err(Refusal::Checksum);
        }
        match staged.payload {
            Payload::Model => {
                let model = Model::new(bytes).map_err(|_| Refusal::Invalid)?;
                if model.object_count() > N {
                    return Err(Refusal::TooLong);
                }
                self.source = self.next_source.with_length(staged.length);
                self.switched = true;
                self.switched_to = model.checksum();
                Ok(())
            }
            Payload::Snapshot => {
                let recognizer = self.recognizer.as_mut().ok_or(Refusal::NoModel)?;
                recognizer.restore(bytes).map_err(|_| Refusal::Invalid)
            }
            _ => Err(Refusal::Unsupported),
        }
    }
}

/// As the link reports it.
const fn refusal(refused: Refused) -> Refusal {
    match refused {
        Refused::Pattern(_) => Refusal::Pattern,
        Refused::Spread => Refusal::Spread,
        Refused::NoPose => Refusal::NoPose,
        Refused::NeedsFeatures | Refused::NeedsTouches => Refusal::Features,
    }
}

fn outcome(result: Result<(), Refusal>) -> Outcome {
    result.map_or_else(Outcome::Refused, |()| Outcome::Done)
}

impl<const N: usize> Device for Station<'_, '_, N> {
    fn touch(&mut self, touch: &Touch, detail: bool) -> Outcome {
        self.push(touch, detail).map_or_else(Outcome::Refused, Outcome::Verdict)
    }

    fn reset(&mut self) -> Outcome {
        match &mut self.recognizer {
            Some(recognizer) => {
                recognizer.reset();
                Outcome::Done
            }
            None => Outcome::Refused(Refusal::NoModel),
        }
    }

    fn begin(&mut self, payload: Payload, length: u32, checksum: u32) -> Outcome {
        if self.staging.is_empty() {
            // No smaller model would fit either.
            return Outcome::Refused(Refusal::Unsupported);
        }
        let fits = usize::try_from(length).is_ok_and(|length| length <= self.staging.len());
        self.staged = fits.then_some(Staged { payload, length, checksum, received: 0 });
        outcome(fits.then_some(()).ok_or(Refusal::TooLong))
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Outcome {
        let mut take = || {
            let staged = self.staged.as_mut().filter(|staged| staged.received == offset).ok_or(Refusal::OutOfOrder)?;
            let start = usize::try_from(offset).map_err(|_| Refusal::TooLong)?;
            let end = start.checked_add(bytes.len()).ok_or(Refusal::TooLong)?;
            let received = u32::try_from(end).ok().filter(|&end| end <= staged.length).ok_or(Refusal::TooLong)?;
            self.staging.get_mut(start..end).ok_or(Refusal::TooLong)?.copy_from_slice(bytes);
            staged.received = received;
            Ok(())
        };
        outcome(take())
    }

    fn commit(&mut self) -> Outcome {
        let complete = self.staged.take().filter(|staged| staged.received == staged.length);
        outcome(complete.ok_or(Refusal::OutOfOrder).and_then(|staged| self.accept(staged)))
    }

    fn model(&self) -> Option<ModelInfo> {
        let model = self.model?;
        Some(ModelInfo {
            checksum: model.checksum(),
            length: u32::try_from(model.bytes().len()).unwrap_or(u32::MAX),
            last_object: u8::try_from(model.object_count().saturating_sub(1)).unwrap_or(u8::MAX),
            descriptor: model.descriptor().map_or(u8::MAX, |descriptor| descriptor.code()),
        })
    }

    fn name(&self, object: u8) -> Option<&str> {
        let model = self.model?;
        (usize::from(object) < model.object_count()).then(|| model.object_name(usize::from(object)))
    }

    fn posterior(&self, object: u8) -> Option<u64> {
        let object = usize::from(object);
        let known = self.model.is_some_and(|model| object < model.object_count());
        self.recognizer.as_ref().filter(|_| known).map(|recognizer| recognizer.posterior(object).q56())
    }

    fn snapshot(&mut self, offset: u32, buffer: &mut [u8]) -> Result<(u32, usize), Refusal> {
        let recognizer = self.recognizer.as_ref().ok_or(Refusal::NoModel)?;
        let mut whole: SnapshotBuffer<N> = [[0; _]; N];
        let whole = recognizer.snapshot(whole.as_flattened_mut()).map_err(|_| Refusal::TooLong)?;
        let rest = usize::try_from(offset).ok().and_then(|offset| whole.get(offset..)).ok_or(Refusal::OutOfOrder)?;
        let count = rest.len().min(buffer.len());
        buffer.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        Ok((u32::try_from(whole.len()).unwrap_or(u32::MAX), count))
    }

    fn refused(&self) -> u32 {
        self.refused
    }

    fn store(&mut self, progress: &Progress) -> Result<(), NotStored> {
        let Some(records) = self.records.as_mut().filter(|records| !records.is_empty()) else { return Ok(()) };
        let mut buffer: SnapshotBuffer<N> = [[0; _]; N];
        // The evidence of the model before is none of the next one's.
        let recognizer = self.recognizer.as_ref().filter(|_| !self.switched);
        let evidence = recognizer.and_then(|recognizer| recognizer.snapshot(buffer.as_flattened_mut()).ok());
        let model = if self.switched { self.switched_to } else { self.model.map_or(0, |model| model.checksum()) };
        let evidence = evidence.unwrap_or_default();
        let progress = progress.clone();
        records.write(Record { counter: 0, model, source: self.source, staged: self.staged, progress, evidence })
    }
}
