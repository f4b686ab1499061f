//! The messages. The order of variants and fields is the format: add at the end, or raise
//! [`VERSION`](super::VERSION).

use super::POSE_BYTES;
use crate::checksum::checksum_of;
#[cfg(any(test, feature = "position"))]
use crate::{Approach, TablePose};
use crate::{ContactTime, Descriptor, Pose, Touch};
use serde::{Deserialize, Serialize};

/// A message of either side.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Message<'a> {
    /// Host: do or say this.
    Request {
        /// One more than the request before; the same where it is repeated.
        number: u32,
        /// The request.
        #[serde(borrow)]
        request: Request<'a>,
    },
    /// Chip: the answer to the request of this number.
    Answer {
        /// The request's number.
        number: u32,
        /// The answer.
        #[serde(borrow)]
        answer: Answer<'a>,
    },
    /// Chip: something happened without a request; repeated until the host has heard it.
    Event {
        /// Counts events from 0 since the chip's start.
        number: u32,
        /// The event.
        event: Event,
    },
    /// Host: the event of this number has arrived.
    Heard {
        /// The event's number.
        number: u32,
    },
}

/// Something for the chip to do or to say, exactly once.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Request<'a> {
    /// Asks for the current session, and opens that of this frame if the current one is `previous`.
    Hello {
        /// The session that the host believes to be current.
        previous: u32,
        /// The chip's boot number as the host knows it: a late copy opens nothing after a reset.
        boot: u32,
    },
    /// Asks for the model in use.
    Model,
    /// A model is about to come: asks which byte to begin with.
    Begin {
        /// Its bytes in all.
        length: u32,
        /// Its CRC-32 (ISO-HDLC).
        checksum: u32,
    },
    /// Part of it; the last one has the chip check it and use it. Until then, and if the check fails, what was there before
    /// stays in use.
    Chunk {
        /// Offset of the part: the one that the chip asked for.
        offset: u32,
        /// At most [`CHUNK`](super::CHUNK) bytes.
        bytes: &'a [u8],
    },
    /// Take a touch into account.
    Touch {
        /// The touch.
        touch: TouchMessage,
        /// True if the answer should have a [`Detail`].
        detail: bool,
    },
    /// Take a touch with a position into account. This and all others of maps are for a chip that
    /// [has maps](ModelInfo::has_maps) alone.
    Press {
        /// The touch; its pose is in the table's frame.
        touch: TouchMessage,
        /// The hand's position in the table's frame: x, y and z in micrometers, i32 little endian.
        position: [u8; 12],
        /// True if the answer should have a [`Detail`].
        detail: bool,
    },
    /// Forget all touches: another object comes.
    Reset,
    /// Asks for the name of an object.
    Name {
        /// The object's index in the model.
        object: u8,
    },
    /// Asks for the program that the chip runs.
    Program,
    /// Asks for the counts of the link.
    Counts,
    /// Asks for the posteriors of as many objects as fit into an answer.
    Posteriors {
        /// The first of them.
        first: u8,
    },
    /// Asks for the pose of the next approach.
    NextApproach {
        /// Poses that the robot cannot reach: pose n is bit n % 8 of byte n / 8. Zeros: it can reach all.
        without: [u8; POSE_BYTES],
    },
    /// Asks for a place where the most likely object lies. Like the two that follow, it takes no flash without the feature
    /// `position`.
    #[cfg(any(test, feature = "position"))]
    Place {
        /// Rank of the place, from 0.
        rank: u8,
    },
    /// Asks for the name of a placement.
    #[cfg(any(test, feature = "position"))]
    Placement {
        /// The placement's index in the model.
        placement: u8,
    },
    /// Asks for the next approach straight down.
    #[cfg(any(test, feature = "position"))]
    NextPress {
        /// Half the side of the square about the table's origin in which the middle finger may go, in micrometers; none: twice
        /// the maps' range.
        within: Option<u32>,
    },
}

#[cfg(feature = "position")]
impl Request<'_> {
    /// The request that takes a touch into account, with its position if it has one.
    pub fn of_touch(touch: &Touch, detail: bool) -> Self {
        let (message, mut position) = (TouchMessage::from(touch), [0; 12]);
        let Some(crate::Position { micrometers }) = touch.position() else {
            return Self::Touch { touch: message, detail };
        };
        position.iter_mut().zip(micrometers.into_iter().flat_map(i32::to_le_bytes)).for_each(|(to, from)| *to = from);
        Self::Press { touch: message, position, detail }
    }
}

/// The answer to a [`Request`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Answer<'a> {
    /// To [`Request::Hello`].
    Session {
        /// The current session.
        session: u32,
        /// The chip's boot number, another one after each start.
        boot: u32,
        /// Number of the chip's next event.
        event: u32,
    },
    /// The chip does not know the request's session: it was reset, or another host has opened one.
    Forgotten,
    /// It was not done, or there is no answer.
    Refused(Refusal),
    /// It is done.
    Done,
    /// Verdict after a touch.
    Verdict(VerdictMessage),
    /// To [`Request::Begin`] and [`Request::Chunk`]: all before this offset has arrived; where that is the model's length, it is in
    /// use. The offset is that of an earlier byte where a chunk could not be written: flash is written again from the start of a
    /// sector. It is not 0 where a load that was interrupted begins again.
    Wanted {
        /// Offset of the next chunk.
        offset: u32,
    },
    /// To [`Request::Model`].
    Model(ModelInfo),
    /// A name; that of a program is with its version, or empty if it does not say.
    Name(&'a str),
    /// To [`Request::Counts`].
    Counts(Statistics),
    /// To [`Request::Posteriors`]: u64 in Q56, little endian, one after another.
    Posteriors(&'a [u8]),
    /// To [`Request::NextApproach`].
    NextApproach(ApproachMessage),
    /// To [`Request::Place`].
    #[cfg(any(test, feature = "position"))]
    Place(PlaceMessage),
    /// To [`Request::NextPress`].
    #[cfg(any(test, feature = "position"))]
    NextPress(Approach),
}

/// A place where the most likely object lies.
#[cfg(any(test, feature = "position"))]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlaceMessage {
    /// True if no finger met more than the table so far.
    pub table_alone: bool,
    /// True if the search after the last touch was not finished.
    pub exhausted: bool,
    /// The place; none before the first touch, and if there are not as many.
    pub place: Option<TablePose>,
}

/// Reason why the chip refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// There is no model yet: load one.
    NoModel,
    /// It does not fit into the chip's memory.
    TooLong,
    /// A chunk came without a beginning, or another one than the chip asked for.
    OutOfOrder,
    /// The data that arrived differ from the announcement.
    Checksum,
    /// The data that arrived are no model that this chip can use.
    Invalid,
    /// The chip's program does not do that.
    Unsupported,
    /// There is no such object.
    NoObject,
    /// The model was not trained on touches with this contact pattern: not counted.
    Pattern,
    /// The contacts are further apart in time than in any touch that the model was trained on: not counted.
    Spread,
    /// The model needs the probe's pose, and the touch has none: not counted.
    NoPose,
    /// The model is over rows of features, not touches: not counted.
    Features,
    /// The data that arrived could not be written, or was being written when the power was cut.
    Unwritable,
    /// The model has no plan of approaches, or none for a pose that can be reached.
    NoPlan,
    /// The model is of maps, and the touch has no position: not counted.
    NoPosition,
    /// The model is of trees, and the touch has a position: not counted.
    Position,
    /// The model is of maps, and the hand does not come straight down: not counted.
    NotDown,
    /// A check of the chip's own does not admit the model.
    NotAdmitted,
}

impl Refusal {
    /// True if this refuses a touch that was not counted because the model was not trained for it.
    pub const fn is_of_a_touch(self) -> bool {
        matches!(
            self,
            Self::Pattern
                | Self::Spread
                | Self::NoPose
                | Self::Features
                | Self::NoPosition
                | Self::Position
                | Self::NotDown
        )
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NoModel => "the chip has no model: load one",
            Self::TooLong => "it does not fit into the chip's memory: load a smaller model",
            Self::OutOfOrder => "the chip missed a part: load it again",
            Self::Checksum => "what arrived is not what was sent: load it again",
            Self::Invalid => "the chip cannot use it: check that it is a model of this version and small enough",
            Self::Unsupported => "the chip's program does not do that: flash another",
            Self::NoObject => "the chip's model has no such object",
            Self::Pattern => "the model was not trained on touches with these contacts",
            Self::Spread => "the contacts are further apart in time than in any touch that the model was trained on",
            Self::NoPose => "the model needs the probe's pose, and the touch has none",
            Self::Unwritable => "the chip could not write it: load it again; its memory may be worn out",
            Self::NoPlan => "the chip's model has no plan of approaches in poses that can be reached",
            Self::Features => "the chip's model is over rows of features, not touches",
            Self::NoPosition => "the chip's model is of maps, and the touch has no position",
            Self::Position => "the touch has a position, and the chip has no model of maps",
            Self::NotDown => "it does not come straight down",
            Self::NotAdmitted => "a check of the chip's own does not admit the model",
        })
    }
}

/// Something that happened on the chip without a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Event {
    /// The chip has started.
    Started,
    /// The chip's own fingers touched.
    Touch {
        /// The touch.
        touch: TouchMessage,
        /// Microseconds between the announcement of its pose and its first contact.
        pose_age: Option<u32>,
        /// The verdict after it.
        verdict: VerdictMessage,
    },
    /// One of the chip's own fingers is faulty.
    Fault {
        /// Kind of the fault.
        kind: FaultKind,
        /// 0, 1 or 2 along the row; 255 if it is not the fault of one finger.
        finger: u8,
    },
    /// The chip's own fingers touched, and the touch was not counted.
    Refused {
        /// The touch.
        touch: TouchMessage,
        /// The reason.
        refusal: Refusal,
    },
}

/// Faults of a chip's own fingers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FaultKind {
    /// A finger stays closed.
    Stuck,
    /// A finger does not settle.
    Bouncing,
    /// A finger has been missing in many touches in a row.
    Silent,
    /// A finger's pin cannot be read.
    Unreadable,
    /// Edges came faster than the main loop took them, and some were lost.
    Overrun,
    /// The clock went back during a touch: it does not count through all 32 bits.
    Clock,
}

impl core::fmt::Display for FaultKind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Stuck => "stuck closed",
            Self::Bouncing => "bouncing",
            Self::Silent => "silent",
            Self::Unreadable => "unreadable",
            Self::Overrun => "edges lost",
            Self::Clock => "the clock went back",
        })
    }
}

/// A [`Touch`] as it travels: missing contacts are `u32::MAX`, the pose is direction and alignment in Q15.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TouchMessage {
    /// Contact times in microseconds.
    pub times: [u32; 3],
    /// Direction and alignment, little endian.
    pub pose: Option<[u8; 12]>,
}

impl From<&Touch> for TouchMessage {
    fn from(touch: &Touch) -> Self {
        let times = touch.times().map(|time| time.micros().unwrap_or(u32::MAX));
        let pose = touch.pose().map(|pose| pose_bytes(&pose));
        Self { times, pose }
    }
}

impl From<&TouchMessage> for Touch {
    fn from(message: &TouchMessage) -> Self {
        let touch = Self::new(message.times.map(ContactTime::from_micros));
        message.pose.map_or(touch, |pose| touch.with_pose(pose_of(pose)))
    }
}

/// Direction and alignment, little endian.
fn pose_bytes(pose: &Pose) -> [u8; 12] {
    let mut bytes = [0; 12];
    let cosines = pose.direction.into_iter().chain(pose.alignment).flat_map(i16::to_le_bytes);
    bytes.iter_mut().zip(cosines).for_each(|(byte, cosine)| *byte = cosine);
    bytes
}

/// Numbers in the bytes of a position.
pub(super) fn micrometers([a, b, c, d, e, f, g, h, i, j, k, l]: [u8; 12]) -> [i32; 3] {
    [[a, b, c, d], [e, f, g, h], [i, j, k, l]].map(i32::from_le_bytes)
}

fn pose_of([a, b, c, d, e, f, g, h, i, j, k, l]: [u8; 12]) -> Pose {
    Pose {
        direction: [[a, b], [c, d], [e, f]].map(i16::from_le_bytes),
        alignment: [[g, h], [i, j], [k, l]].map(i16::from_le_bytes),
    }
}

/// A verdict, and its basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VerdictMessage {
    /// The decision so far.
    pub decision: Decision,
    /// The object with the most evidence.
    pub best: u8,
    /// Touches since the last reset.
    pub touches: u32,
    /// Data for comparison with another recognizer, if it was asked for.
    pub detail: Option<Detail>,
}

/// Decision after a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Decision {
    /// Nothing yet.
    Undecided,
    /// The object with this index.
    Recognized(u8),
    /// No object of the model: the touches fit none.
    Unknown,
    /// Nothing, and the limit of touches is reached.
    GaveUp,
}

impl Decision {
    /// Its name in lines for programs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Undecided => "undecided",
            Self::Recognized(_) => "recognized",
            Self::Unknown => "unknown",
            Self::GaveUp => "gave-up",
        }
    }
}

/// An approach that a chip proposes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ApproachMessage {
    /// The number of its pose.
    pub pose: u16,
    /// Its score in Q15.
    pub score: i32,
    /// The pose: direction and alignment, as in a [`TouchMessage`].
    pub middle: [u8; 12],
}

impl ApproachMessage {
    /// A proposal of this pose, whose middle is `middle`.
    pub fn new(pose: u16, score: i32, middle: &Pose) -> Self {
        Self { pose, score, middle: pose_bytes(middle) }
    }

    /// Pose to come from: a direction, and the row's alignment.
    pub fn middle(&self) -> Pose {
        pose_of(self.middle)
    }
}

/// Enough to see whether two recognizers agree in every bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Detail {
    /// The posterior of the best object: u64 in Q56, little endian.
    pub posterior: [u8; 8],
    /// CRC-32 (ISO-HDLC) of every object's evidence, i64 little endian, and so of every object's posterior.
    pub evidence: [u8; 4],
}

impl Detail {
    /// From the posterior of the best object in Q56 and the evidence of all. Cost: a checksum of eight bytes for each object.
    pub fn new(posterior: u64, evidence: &[i64]) -> Self {
        let evidence = checksum_of(evidence.iter().map(|evidence| evidence.to_le_bytes()));
        Self { posterior: posterior.to_le_bytes(), evidence: evidence.to_le_bytes() }
    }

    /// The posterior of the best object in Q56.
    pub const fn posterior(&self) -> u64 {
        u64::from_le_bytes(self.posterior)
    }
}

/// The model in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelInfo {
    /// Its checksum.
    pub checksum: u32,
    /// Its bytes.
    pub length: u32,
    /// Objects less one.
    pub last_object: u8,
    /// [`Descriptor::code`], 255 for a model of other features, [`ModelInfo::MAPS`] for one of maps.
    pub descriptor: u8,
}

impl ModelInfo {
    /// In place of a descriptor's code: maps, for touches with a position.
    pub const MAPS: u8 = 254;

    /// True for a model of maps.
    pub const fn has_maps(&self) -> bool {
        self.descriptor == Self::MAPS
    }

    /// Number of objects that the model knows.
    pub fn objects(&self) -> usize {
        usize::from(self.last_object) + 1
    }

    /// Descriptor of the model's touches; none for a model of maps, or of other features.
    pub fn descriptor(&self) -> Option<Descriptor> {
        Descriptor::from_code(self.descriptor)
    }
}

/// Counts kept by the chip's end of the link since power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Statistics {
    /// Whole frames.
    pub frames: u32,
    /// Frames that were garbled or too long, or no message of this version.
    pub garbled: u32,
    /// Requests that had been answered before, and were answered again.
    pub repeated: u32,
    /// Requests that came too late: of another session, or before the last one.
    pub late: u32,
    /// Touches that were not counted because the model was not trained for them.
    pub refused: u32,
}
