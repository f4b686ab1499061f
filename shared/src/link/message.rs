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
    /// Host: a question; the tag comes back with the answer.
    Query {
        /// Any number.
        tag: u8,
        /// The question.
        query: Query,
    },
    /// Chip: the answer to the question with this tag.
    Answer {
        /// The session of the question's frame: that of the host that asked, whichever is open.
        asker: u32,
        /// The question's number.
        tag: u8,
        /// The answer.
        #[serde(borrow)]
        answer: Answer<'a>,
    },
    /// Host: do this.
    Command {
        /// Counts commands from 0 in a session.
        sequence: u32,
        /// The command.
        #[serde(borrow)]
        command: Command<'a>,
    },
    /// Chip: the result of a command.
    Outcome {
        /// The command's number.
        sequence: u32,
        /// The result.
        outcome: Outcome,
    },
    /// Chip: a command came that is not the next one, or not of the session that this frame is of.
    Expected {
        /// The number of the next command.
        sequence: u32,
    },
    /// Chip: something happened without a command.
    Event {
        /// The chip's boot number, another one after each start.
        boot: u32,
        /// Counts events from 0 since that start.
        sequence: u32,
        /// The event.
        event: Event,
    },
}

/// A question, which changes nothing on the chip; only [`Query::Open`] does, once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Query {
    /// Asks for the current session.
    Hello,
    /// Open the session of this frame if the current one is `previous`.
    Open {
        /// The session that the host believes to be current.
        previous: u32,
        /// The chip's boot number as the host knows it: a late copy opens nothing after a reset.
        boot: u32,
    },
    /// Asks for the model in use.
    Model,
    /// Asks for the name of an object.
    Name {
        /// The object's index in the model.
        object: u8,
    },
    /// Asks for the counts of the link.
    Statistics,
    /// Asks for the posteriors of up to [`CHUNK`](super::CHUNK) / 8 objects.
    Posteriors {
        /// From this object on.
        first: u8,
    },
    /// Asks for the pose of the next approach. A chip whose program is older than this question does not answer it.
    NextApproach {
        /// Poses that the robot cannot reach: pose n is bit n % 8 of byte n / 8. Zeros: it can reach all.
        without: [u8; POSE_BYTES],
    },
    /// Asks for the program that the chip runs. A chip whose program is older than this question does not answer it.
    Program,
    /// Asks for a place where the most likely object lies. Only a chip that [has maps](ModelInfo::has_maps) answers this and the
    /// two that follow, which take no flash without the feature `position`.
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

/// The answer to a [`Query`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Answer<'a> {
    /// To [`Query::Hello`] and [`Query::Open`]: the current session is that of this frame.
    Session {
        /// The number of its next command.
        next: u32,
        /// The chip's boot number.
        boot: u32,
    },
    /// To [`Query::Model`].
    Model(ModelInfo),
    /// To [`Query::Name`].
    Name(&'a str),
    /// To [`Query::Statistics`].
    Statistics(Statistics),
    /// To [`Query::Posteriors`]: u64 in Q56, little endian, one after another.
    Posteriors(&'a [u8]),
    /// There is no answer.
    Refused(Refusal),
    /// To [`Query::NextApproach`].
    NextApproach(ApproachMessage),
    /// To [`Query::Program`]: name and version; empty if it does not say.
    Program(&'a str),
    /// To [`Query::Place`].
    #[cfg(any(test, feature = "position"))]
    Place {
        /// True if no finger met more than the table so far.
        table_alone: bool,
        /// The place; none before the first touch, and if there are not as many.
        place: Option<TablePose>,
    },
    /// To [`Query::NextPress`].
    #[cfg(any(test, feature = "position"))]
    NextPress(Approach),
}

/// Something to do, exactly once.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Command<'a> {
    /// Take a touch into account.
    Touch {
        /// The touch.
        touch: TouchMessage,
        /// True if the outcome should have a [`Detail`].
        detail: bool,
    },
    /// Forget all touches: another object comes.
    Reset,
    /// A model is about to come, in chunks.
    Begin {
        /// Its bytes in all.
        length: u32,
        /// Its CRC-32 (ISO-HDLC).
        checksum: u32,
    },
    /// Part of it; chunks come in order.
    Chunk {
        /// Offset of the part.
        offset: u32,
        /// At most [`CHUNK`](super::CHUNK) bytes.
        bytes: &'a [u8],
    },
    /// It is complete: check it and use it. Until then, and if the check fails, what was there before stays in use.
    Commit,
    /// Take a touch with a position into account. Only a chip that [has maps](ModelInfo::has_maps) is sure to understand it.
    Press {
        /// The touch; its pose is in the table's frame.
        touch: TouchMessage,
        /// The hand's position in the table's frame: x, y and z in micrometers, i32 little endian.
        position: [u8; 12],
        /// True if the outcome should have a [`Detail`].
        detail: bool,
    },
}

#[cfg(feature = "position")]
impl Command<'_> {
    /// The command that takes a touch into account, with its position if it has one.
    pub fn of_touch(touch: &Touch, detail: bool) -> Self {
        let (message, mut position) = (TouchMessage::from(touch), [0; 12]);
        let Some(crate::Position { micrometers }) = touch.position() else {
            return Self::Touch { touch: message, detail };
        };
        position.iter_mut().zip(micrometers.into_iter().flat_map(i32::to_le_bytes)).for_each(|(to, from)| *to = from);
        Self::Press { touch: message, position, detail }
    }
}

/// The result of a [`Command`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Outcome {
    /// The command is done; for commands without a touch.
    Done,
    /// Verdict after a touch.
    Verdict(VerdictMessage),
    /// It was not done.
    Refused(Refusal),
    /// To [`Command::Begin`] and [`Command::Chunk`]: all before this offset has arrived. Chunks from it on are to come, once those
    /// under way were refused; so no chunk goes out before the outcome of its beginning. A chip answers so when a load that was
    /// interrupted begins again, and when a chunk could not be written: flash is written again from the start of a sector.
    Continue {
        /// Offset of the next chunk.
        offset: u32,
    },
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
    /// A chunk came without a beginning, or not in order.
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

/// Something that happened on the chip without a command.
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
    /// Nothing, and the limit of touches is reached. Chips whose programs are older said unknown then.
    GaveUp,
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
    /// Commands that had been executed before: repetitions and duplicate frames.
    pub repeated: u32,
    /// Commands that came before the one that was expected: something was lost in between.
    pub early: u32,
    /// Commands of another session.
    pub foreign: u32,
    /// Touches that were not counted because the model was not trained for them.
    pub refused: u32,
}
