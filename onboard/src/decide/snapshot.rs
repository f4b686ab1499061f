//! A recognizer's state as bytes, so that a power cut loses no touch.
//!
//! The bytes are postcard's: the model's checksum, the number of touches, the verdict (0 undecided, 1 recognized,
//! 2 unknown, 3 gave up; and 4 where touches were forgotten) and its object; the number of touches that were forgotten, if
//! any were; then the evidence for each object; then the CRC-32 of these, four bytes, little endian.

use super::recognizer::{Recognizer, State, Verdict};
use crate::Model;
use core::fmt;
use palpate_shared::format::checksum;

/// Reason why a snapshot was not written or taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SnapshotError {
    /// The buffer is too short; [`SNAPSHOT_LENGTH`] bytes and ten for each object are always enough.
    Short,
    /// The bytes are not a whole, unchanged snapshot.
    Damaged,
    /// The snapshot is from another model.
    OtherModel,
}

/// Bytes of a snapshot without its evidence, at most.
pub const SNAPSHOT_LENGTH: usize = 21;

impl fmt::Display for SnapshotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Short => "the buffer is too short for a snapshot",
            Self::Damaged => "the snapshot is incomplete or was changed",
            Self::OtherModel => "the snapshot is from another model",
        })
    }
}

impl core::error::Error for SnapshotError {}

/// Model, touches, verdict, object.
type Head = (u32, u32, u8, u8);

/// Beside the code of a verdict: how many touches were forgotten comes next.
const FORGOTTEN: u8 = 4;

impl<const N: usize> Recognizer<'_, N> {
    /// Writes the state to the start of `buffer`, and gives the bytes that it took.
    ///
    /// Cost: some instructions for each byte. Cannot panic.
    ///
    /// # Errors
    /// [`SnapshotError::Short`].
    pub fn snapshot<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], SnapshotError> {
        self.state().snapshot(self.model(), buffer)
    }

    /// Takes over the state of a snapshot, and forgets the touches before. On an error nothing changes.
    ///
    /// Cost: some instructions for each byte. Cannot panic.
    ///
    /// # Errors
    /// [`SnapshotError::Damaged`] or [`SnapshotError::OtherModel`].
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        let (body, sum) = snapshot.split_last_chunk().ok_or(SnapshotError::Damaged)?;
        if checksum(body) != u32::from_le_bytes(*sum) {
            return Err(SnapshotError::Damaged);
        }
        let (head, mut rest): (Head, _) = postcard::take_from_bytes(body).map_err(|_| SnapshotError::Damaged)?;
        let (model, touches, verdict, object) = head;
        if model != self.model().checksum() {
            return Err(SnapshotError::OtherModel);
        }
        let mut forgotten = 0;
        if verdict & FORGOTTEN != 0 {
            (forgotten, rest) = postcard::take_from_bytes(rest).map_err(|_| SnapshotError::Damaged)?;
            // The last touch is part of the evidence.
            if !(1..touches).contains(&forgotten) {
                return Err(SnapshotError::Damaged);
            }
        }
        let mut evidence = [0; N];
        for evidence in evidence.iter_mut().take(self.model().object_count()) {
            (*evidence, rest) = postcard::take_from_bytes(rest).map_err(|_| SnapshotError::Damaged)?;
        }
        if !rest.is_empty() {
            return Err(SnapshotError::Damaged);
        }
        let verdict = match verdict & !FORGOTTEN {
            0 => Verdict::Undecided,
            _ if touches == 0 => return Err(SnapshotError::Damaged),
            1 => {
                let covered = touches.saturating_sub(forgotten);
                let rivals = State::rivals(self.model(), &evidence, object.into(), covered);
                let rivals = rivals.ok_or(SnapshotError::Damaged)?;
                Verdict::Recognized { object, touches, rivals }
            }
            2 => Verdict::Unknown,
            3 => Verdict::GaveUp,
            _ => return Err(SnapshotError::Damaged),
        };
        self.state_mut().set(evidence, touches, forgotten, verdict);
        // Without a touch, what was told of priors, or nothing at all.
        let mut priors = self.model().priors().iter().map(|prior| i64::from(i32::from_le_bytes(*prior)));
        if touches == 0 && evidence.iter().take(self.model().object_count()).all(|own| priors.next() == Some(*own)) {
            self.reset();
        }
        Ok(())
    }
}

impl<const N: usize> State<N> {
    /// Writes the state under its model to the start of `buffer`; see [`Recognizer::snapshot`].
    pub(crate) fn snapshot<'b>(&self, model: &Model<'_>, buffer: &'b mut [u8]) -> Result<&'b [u8], SnapshotError> {
        let (verdict, object) = match self.verdict() {
            Verdict::Undecided => (0, 0),
            Verdict::Recognized { object, .. } => (1, object),
            Verdict::Unknown => (2, 0),
            Verdict::GaveUp => (3, 0),
        };
        let forgotten = self.forgotten();
        let mark = if forgotten == 0 { 0 } else { FORGOTTEN };
        let head: Head = (model.checksum(), self.touches(), verdict | mark, object);
        let mut length = postcard::to_slice(&head, buffer).map_err(|_| SnapshotError::Short)?.len();
        if forgotten != 0 {
            let rest = buffer.get_mut(length..).ok_or(SnapshotError::Short)?;
            length += postcard::to_slice(&forgotten, rest).map_err(|_| SnapshotError::Short)?.len();
        }
        let mut priors = [0; N];
        for evidence in self.evidence_or_priors(model, &mut priors) {
            let rest = buffer.get_mut(length..).ok_or(SnapshotError::Short)?;
            length += postcard::to_slice(evidence, rest).map_err(|_| SnapshotError::Short)?.len();
        }
        let sum = checksum(buffer.get(..length).ok_or(SnapshotError::Short)?);
        let end = buffer.get_mut(length..).and_then(<[u8]>::first_chunk_mut).ok_or(SnapshotError::Short)?;
        *end = sum.to_le_bytes();
        buffer.get(..length + 4).ok_or(SnapshotError::Short)
    }
}
