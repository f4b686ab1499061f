//! Problems with data sets and files of touches.

use crate::error::Variant;
use std::borrow::Cow;
use std::path::PathBuf;

/// Problems with data sets and files of touches.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TouchesProblem {
    /// A line has neither three, nor nine, nor twelve fields.
    #[error(
        "{count} fields where a touch has three times, three times and six direction cosines, or these and three coordinates"
    )]
    Fields {
        /// Number of fields.
        count: usize,
    },
    /// A field is not a number.
    #[error("{text:?} is not a number")]
    NotANumber {
        /// The field.
        text: String,
    },
    /// A field is infinite or not a number.
    #[error("{text} is not finite")]
    NotFinite {
        /// The field.
        text: String,
    },
    /// A contact time is before the clock's start.
    #[error("the time {seconds} is negative")]
    NegativeTime {
        /// The time.
        seconds: f64,
    },
    /// A contact time is beyond the range of a touch.
    #[error("a finger touched {seconds} s after the first, and a touch can hold 4294 s")]
    LongTime {
        /// The time after the first contact.
        seconds: f64,
    },
    /// A contact time is longer than an object can make it.
    #[error("{of}a finger touched {seconds:.1} s after the first, but {why}")]
    TimeTooLong {
        /// The touch, where no place says it: "touch 3 of bowl: ".
        of: String,
        /// Seconds after the first contact.
        seconds: f64,
        /// The most seconds that make sense, in words.
        why: Cow<'static, str>,
    },
    /// A direction or alignment is not a unit vector.
    #[error("the {vector} has length {length:.3} where a unit vector has 1")]
    NotUnit {
        /// The vector: "direction" or "alignment".
        vector: &'static str,
        /// Its length.
        length: f64,
    },
    /// A row has one half of a pose.
    #[error("{} without {}", with_article(there), with_article(missing))]
    HalfPose {
        /// The vector that is there.
        there: &'static str,
        /// The vector that is missing.
        missing: &'static str,
    },
    /// A position is beyond the range of a touch.
    #[error("the coordinate {millimeters} mm is farther than the 2147 m that a touch can hold")]
    FarPosition {
        /// The coordinate.
        millimeters: f64,
    },
    /// A position without the pose in whose frame it is.
    #[error("a position without a pose")]
    PositionWithoutPose,
    /// A touch has a position and others have none, or the other way round.
    #[error("{} position, where {others} {}", with(*has_position), if *has_position { "have none" } else { "have one" })]
    OtherPosition {
        /// True if this touch has a position.
        has_position: bool,
        /// The others.
        others: &'static str,
    },
    /// A file is a bag of ROS that is not in MCAP.
    #[error("a bag of ROS 1, or of ROS 2 in SQLite, is not read")]
    Bag,
    /// A line is not UTF-8.
    #[error("not text (no UTF-8)")]
    NotText,
    /// A row of a table is wrong.
    #[error("row {row}: {problem}")]
    Row {
        /// The row, counted from 1.
        row: u64,
        /// Description of the fault.
        problem: Box<Self>,
    },
    /// A file is Parquet.
    #[error("Parquet is not read")]
    Parquet,
    /// A file is no log in MCAP, or is damaged.
    #[error("not a usable MCAP file: {message}")]
    NotMcap {
        /// Description of the fault.
        message: String,
    },
    /// A log, for a build without MCAP.
    #[error("this program was built without MCAP")]
    NoMcap,
    /// Something in a log exceeds a limit.
    #[error("{what} of {bytes} bytes, where at most {most} are read")]
    TooLarge {
        /// The thing that is too large: "a record".
        what: String,
        /// Its size.
        bytes: u64,
        /// Largest size allowed.
        most: u64,
    },
    /// A log has more touches than are read.
    #[error("more than {most} touches")]
    TooMany {
        /// Largest number that is read.
        most: usize,
    },
    /// A chunk of a log is compressed by something that nobody here knows.
    #[error("a chunk is compressed as {name:?}, where zstd and lz4 are known")]
    OtherCompression {
        /// Its name.
        name: String,
    },
    /// A channel with touches or verdicts is in an encoding that is not read.
    #[error("{channel} is in the encoding {encoding:?} with a schema in {schema:?}")]
    OtherEncoding {
        /// The channel: its topic, with the name of its schema.
        channel: String,
        /// The messages' encoding.
        encoding: String,
        /// The schema's encoding.
        schema: String,
    },
    /// A channel with touches or verdicts has a schema of another definition.
    #[error("{channel} is defined as {found:?}, where Palpate has {expected:?}")]
    OtherDefinition {
        /// The channel: its topic, with the name of its schema.
        channel: String,
        /// Content of the log.
        found: String,
        /// Content that was expected.
        expected: String,
    },
    /// A log has no channel of touches.
    #[error("no channel of touches in this log: {}", channels_or_none(channels))]
    NoTouchChannel {
        /// The channels that it has: topics, with the names of their schemas.
        channels: Vec<String>,
    },
    /// A message of a log is wrong.
    #[error("message {number} on {topic}: {problem}")]
    Message {
        /// The channel's topic.
        topic: String,
        /// The message among those of its channel, counted from 1.
        number: u64,
        /// Description of the fault.
        problem: Box<Self>,
    },
    /// A message of a log is not what its schema says.
    #[error("no {what}: {message}")]
    BadMessage {
        /// Description of the expected content: "touch in JSON".
        what: &'static str,
        /// Description of the fault.
        message: String,
    },
    /// Some touches of a log name an object and others do not.
    #[error("this touch names no object, and others of the log do")]
    NamelessTouch,
    /// A log has no touch of an object.
    #[error("no touch of {object} in this log, only of {objects}")]
    NotInLog {
        /// The object.
        object: String,
        /// The objects that it has.
        objects: String,
    },
    /// A file holds no touch.
    #[error("no touches in it")]
    NoTouches,
    /// A directory holds no file of touches.
    #[error("no touches here (no .txt or .mcap file)")]
    NoObjects,
    /// A directory holds one object.
    #[error("only one object here, {name}, and nothing to distinguish it from")]
    OneObject {
        /// The object.
        name: String,
    },
    /// An object is in a log and in a file of lines, and no listing says which counts.
    #[error("two files of the object {name}: {} and {}", file.display(), other.display())]
    TwoFiles {
        /// The object.
        name: String,
        /// One file.
        file: PathBuf,
        /// The other.
        other: PathBuf,
    },
    /// `dataset.json` is no listing.
    #[error("not the listing of a data set ({message})")]
    BadListing {
        /// The parser's message.
        message: String,
    },
    /// Touches of several instances or logs, without an origin that `dataset.json` could state.
    #[error(
        "{name} has {sources} instances or logs, and without a known probe no dataset.json states the source of each \
         touch"
    )]
    Unsaid {
        /// The object's name.
        name: String,
        /// Number of sources.
        sources: usize,
    },
    /// Touches of robots that differ, which no file can say.
    #[error("the touches of {name} are of robots with different biases, and no file states the robot of each touch")]
    OfRobots {
        /// The object's name.
        name: String,
    },
    /// `dataset.json` names an object that no file of the directory can be called after.
    #[error("no file can be named after the object {name:?}")]
    BadName {
        /// The name.
        name: String,
    },
    /// `dataset.json` names an object twice.
    #[error("the object {name} is listed twice")]
    ListedTwice {
        /// The object.
        name: String,
    },
    /// A listed object's file is not there.
    #[error("missing, although dataset.json lists the object {name}")]
    Missing {
        /// The object.
        name: String,
    },
    /// A file has another number of touches than listed.
    #[error("{found} touches where dataset.json states {stated}")]
    OtherCount {
        /// Number of touches listed.
        stated: u64,
        /// Number of touches found.
        found: u64,
    },
    /// Another program has locked the directory.
    #[error("another program is writing into this directory")]
    Busy,
    /// Recording into a directory that holds simulated ones.
    #[error("holds {touches} simulated touches of {objects}")]
    HoldsSimulated {
        /// The objects.
        objects: String,
        /// Number of touches of them.
        touches: u64,
    },
    /// Recording into a directory with files of touches that no listing names.
    #[error("holds {files}, which dataset.json does not list")]
    Unlisted {
        /// The files' names.
        files: String,
    },
    /// Adding recorded touches to others that were made in another way.
    #[error("cannot add to these recorded touches: {differences}")]
    OtherRecording {
        /// The settings that differ, with both values.
        differences: String,
    },
    /// These lines were recorded before.
    #[error("the same {touches} touches of {object} were recorded before, on {began}")]
    RecordedBefore {
        /// The object.
        object: String,
        /// Number of touches.
        touches: u64,
        /// Time at which they were recorded.
        began: String,
    },
    /// A touch has no pose, but the data set is recorded with one.
    #[error("no pose, but this data set is recorded with one")]
    NoPose,
    /// A touch has a contact that the hand cannot have reached.
    #[error("a contact {latest} after the first, and this data set is recorded with a stroke of {stroke}")]
    LaterThanStroke {
        /// The stroke as a length and as a time.
        stroke: String,
        /// The latest contact's time.
        latest: String,
    },
    /// A text names no samples.
    #[error("{text:?} is not a range of samples")]
    BadSamples {
        /// The text.
        text: String,
    },
    /// A directory that touches are to be saved in holds others, or a listing.
    #[error("holds {}, and touches are not saved over others", shown(files))]
    HoldsFiles {
        /// The files' names.
        files: Vec<String>,
    },
    /// A file whose name does not reveal its format.
    #[error("not a file of touches by its name")]
    NoFormat,
    /// An object was recorded in two places.
    #[error("the object {name} was given twice")]
    RecordedTwice {
        /// The object.
        name: String,
    },
    /// A check of a data set found errors that would make training wrong.
    #[error("training on these touches would be wrong, for {count} reason{}", if *count == 1 { "" } else { "s" })]
    WouldTrainWrong {
        /// Number of reasons.
        count: usize,
    },
    /// An object has too few touches to be divided.
    #[error("{name} has only {touches} touches, too few to split")]
    TooFew {
        /// The object.
        name: String,
        /// Number of touches of the object.
        touches: usize,
        /// Number of touches needed.
        least: usize,
    },
}

impl Variant for TouchesProblem {
    fn fix(&self) -> String {
        match self {
            Self::Fields { .. }
            | Self::NotANumber { .. }
            | Self::NotFinite { .. }
            | Self::NegativeTime { .. }
            | Self::LongTime { .. }
            | Self::NotUnit { .. }
            | Self::FarPosition { .. }
            | Self::NotText => {
                "Correct the line: three times in seconds, - for a missing contact, and optionally direction and \
                 alignment, and behind them the position in millimeters."
            }
            Self::TimeTooLong { .. } => {
                "Give times in seconds, not in milliseconds: 0.0622 for 62.2 ms. If they are in seconds, say which probe made them."
            }
            Self::Bag => "Convert it to MCAP: mcap convert BAG OUT.mcap.",
            Self::PositionWithoutPose => "Give direction and alignment, too.",
            Self::OtherPosition { .. } => "Give every touch of the data set a position, or none.",
            Self::HalfPose { .. } => "Give both or neither.",
            Self::Row { problem, .. } => match **problem {
                Self::HalfPose { .. } => "Give both or neither.",
                Self::PositionWithoutPose => "Give direction and alignment, too.",
                Self::OtherPosition { .. } => "Give every touch of the data set a position, or none.",
                _ => "Correct the row.",
            },
            Self::Parquet => return format!("Instead, {}.", crate::gone::instead(".parquet").unwrap_or_default()),
            Self::NoTouches => "Capture the object again, or remove the file.",
            Self::NotMcap { .. } => "Repair it with `mcap recover`, or copy the log again.",
            Self::NoMcap => "Build it with the feature mcap, which is on by default.",
            Self::TooLarge { .. } => {
                "If it is meant, keep the touches alone: mcap filter LOG -o TOUCHES.mcap -y TOPIC."
            }
            Self::TooMany { .. } => "Divide the log: mcap filter LOG -o PART.mcap --start TIME --end TIME.",
            Self::OtherCompression { .. } => "Compress it again: mcap compress LOG -o OTHER.mcap --compression zstd.",
            Self::OtherEncoding { .. } | Self::OtherDefinition { .. } => {
                "Log them as docs/reference/mcap.md says: JSON, or CDR by the definitions in host/msg."
            }
            Self::NoTouchChannel { .. } => {
                "Name the schema of the touches palpate.Touch, or in ROS 2 palpate_msgs/msg/Touch: docs/reference/mcap.md."
            }
            Self::Message { .. } | Self::BadMessage { .. } => {
                "Correct the program that logged it: docs/reference/mcap.md says what belongs in a message."
            }
            Self::NamelessTouch => "Name the object in every message, or in none.",
            Self::NotInLog { .. } => "Give one of these names, or the log of the other object.",
            Self::NoObjects => "Fill it with: palpate capture builtin -o DIR.",
            Self::OneObject { .. } => "Capture at least two objects into the directory.",
            Self::TwoFiles { .. } => "Remove one of them.",
            Self::BadName { .. } => {
                "Give a name that a file can have, for an object on a table OBJECT/PLACEMENT. If it stands in a dataset.json from \
                 elsewhere, remove that file."
            }
            Self::BadListing { .. } | Self::ListedTwice { .. } => {
                "Remove the file if the touches are from elsewhere, else capture them again."
            }
            Self::Unsaid { .. } => {
                "Say which probe made them (from Python `probe=`), or record each log with `palpate data record`."
            }
            Self::OfRobots { .. } => "Write them without noise, and add it where they are read.",
            Self::Missing { .. } | Self::OtherCount { .. } => {
                "Restore the file or capture the objects again, or remove dataset.json if this is meant."
            }
            Self::Busy => "Wait until it is done, or give another directory.",
            Self::HoldsSimulated { .. } => "Give another directory: recorded and simulated touches are not mixed.",
            Self::Unlisted { .. } => "Give another directory, or move the files away.",
            Self::OtherRecording { .. } => "Record as these touches were, or into another directory.",
            Self::RecordedBefore { .. } => "Give other lines.",
            Self::NoPose => "Give direction and alignment after the times, or record without the pose.",
            Self::LaterThanStroke { .. } => "Give the probe file the stroke that the hand has, and record into another directory.",
            Self::BadSamples { .. } => "Give A..B with A below B: 0..5000 are the first 5000.",
            Self::HoldsFiles { .. } => "Give another directory, or move the files away.",
            Self::NoFormat => "Name it after the object, with the extension .txt.",
            Self::RecordedTwice { .. } => "Put its touches into one file.",
            Self::WouldTrainWrong { .. } => "Correct the faults listed above, then check again.",
            Self::TooFew { least, .. } => return format!("Capture at least {least} touches of each object."),
        }
        .into()
    }
}

/// Names, the first ten of them.
fn shown(names: &[String]) -> String {
    let first = names[..names.len().min(10)].join(", ");
    if names.len() > 10 { format!("{first} and {} more", names.len() - 10) } else { first }
}

fn channels_or_none(channels: &[String]) -> String {
    const SHOWN: usize = 20;
    match channels.len() {
        0 => "it has no channel at all".into(),
        count => {
            let shown = channels.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
            let more = count.saturating_sub(SHOWN);
            if more == 0 { format!("it has {shown}") } else { format!("it has {shown} and {more} more") }
        }
    }
}

fn with(has_position: bool) -> &'static str {
    if has_position { "a" } else { "no" }
}

fn with_article(noun: &str) -> String {
    format!("{} {noun}", if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" })
}
