//! The words of test vectors; `shared/vectors/README.md` describes them.

use crate::scripts::sealed;
use palpate_onboard::Refused;
use palpate_shared::format::{Axis, Group, HEADER_LENGTH};
use palpate_shared::{ContactTime, MISSING_FEATURE, Pose, Touch};

/// Bytes as two digits each; none as `-`.
pub fn hex(bytes: &[u8]) -> String {
    if bytes.is_empty() { "-".into() } else { bytes.iter().map(|byte| format!("{byte:02x}")).collect() }
}

/// The bytes again.
///
/// # Panics
/// If they are malformed.
pub fn bytes(hex: &str) -> Vec<u8> {
    if hex == "-" {
        return Vec::new();
    }
    let digits = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).expect("two digits");
    (0..hex.len()).step_by(2).map(digits).collect()
}

/// Numbers, `-` for a missing one.
pub fn numbers(numbers: &[i32]) -> String {
    let word = |&number: &i32| if number == MISSING_FEATURE { "-".into() } else { number.to_string() };
    if numbers.is_empty() { ".".into() } else { numbers.iter().map(word).collect::<Vec<_>>().join(" ") }
}

/// The numbers again.
///
/// # Panics
/// If they are malformed.
pub fn read_numbers(words: &str) -> Vec<i32> {
    let number = |word: &str| if word == "-" { MISSING_FEATURE } else { word.parse().expect("a number") };
    if words == "." { Vec::new() } else { words.split(' ').map(number).collect() }
}

/// Three times, `-` for a missing one, and the pose, if there is one.
pub fn touch_words(touch: &Touch) -> String {
    let times = touch.times().map(|time| time.micros().map_or("-".into(), |micros| micros.to_string())).join(" ");
    let pose = touch
        .pose()
        .map_or([None; 6], |Pose { direction: [x, y, z], alignment: [u, v, w] }| [x, y, z, u, v, w].map(Some));
    pose.into_iter().flatten().fold(times, |words, part| format!("{words} {part}"))
}

/// The touch again.
///
/// # Panics
/// If it is malformed.
pub fn read_touch(words: &str) -> Touch {
    let words: Vec<&str> = words.split(' ').collect();
    let time = |word: &str| match word {
        "-" => ContactTime::MISSING,
        micros => ContactTime::from_micros(micros.parse().expect("a time")),
    };
    let touch = Touch::new([time(words[0]), time(words[1]), time(words[2])]);
    let part = |index: usize| words[index].parse().expect("a cosine");
    match words.len() {
        3 => touch,
        _ => touch.with_pose(Pose { direction: [3, 4, 5].map(part), alignment: [6, 7, 8].map(part) }),
    }
}

/// Reason why a touch was not counted.
pub const fn refusal(refused: Refused) -> &'static str {
    match refused {
        Refused::Pattern(_) => "pattern",
        Refused::Spread => "spread",
        Refused::NoPose => "pose",
        Refused::NeedsFeatures => "features",
        _ => "touches",
    }
}

/// A run of lengths, the kind of the error, and its place.
pub type Run = (std::ops::RangeInclusive<usize>, String, usize);

/// A part of a model that is cut at every length.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cut {
    /// Place of its length in the model, in bytes or pieces.
    pub field: usize,
    /// Its own place.
    pub place: usize,
    /// Its length.
    pub length: usize,
    /// Shorter lengths that are refused.
    pub refused: Vec<Run>,
}

impl Cut {
    /// Reads the words of a line.
    ///
    /// # Panics
    /// If they are malformed.
    pub fn read(words: &str) -> Self {
        let words: Vec<&str> = words.split(' ').collect();
        let number = |word: &str| word.parse().expect("a number");
        let run = |run: &str| {
            let [lengths, kind, place] = run.split(':').collect::<Vec<_>>()[..] else { panic!("no run: {run}") };
            let (first, last) = lengths.split_once('-').unwrap_or((lengths, lengths));
            (number(first)..=number(last), kind.to_owned(), number(place))
        };
        let refused = if words[3] == "-" { Vec::new() } else { words[3].split(',').map(run).collect() };
        Self { field: number(words[0]), place: number(words[1]), length: number(words[2]), refused }
    }

    /// The words.
    pub fn words(&self) -> String {
        let run = |(lengths, kind, place): &Run| match (lengths.start(), lengths.end()) {
            (first, last) if first == last => format!("{first}:{kind}:{place}"),
            (first, last) => format!("{first}-{last}:{kind}:{place}"),
        };
        let refused: Vec<String> = self.refused.iter().map(run).collect();
        let refused = if refused.is_empty() { "-".into() } else { refused.join(",") };
        format!("{} {} {} {refused}", self.field, self.place, self.length)
    }

    /// Kind and place of the error of a length; `None` if it has to be read.
    pub fn expected(&self, length: usize) -> Option<(&str, usize)> {
        let run = self.refused.iter().find(|(lengths, ..)| lengths.contains(&length));
        run.map(|(_, kind, place)| (kind.as_str(), *place))
    }

    /// The model with the part cut to a length.
    pub fn model(&self, base: &[u8], length: usize) -> Vec<u8> {
        let piece = match self.field {
            16 => Axis::LENGTH,
            18 => Group::LENGTH,
            _ => 1,
        };
        let (mut left, mut whole) = (piece * length, piece * self.length);
        let mut bytes = base[..self.place + left].to_vec();
        if self.field >= HEADER_LENGTH {
            // An optional section: with zeros up to a multiple of four.
            (left, whole) = (left.next_multiple_of(4), whole.next_multiple_of(4));
            bytes.resize(self.place + left, 0);
            let sections = u32::from_le_bytes(bytes[92..96].try_into().expect("four bytes")) - (whole - left) as u32;
            bytes[92..96].copy_from_slice(&sections.to_le_bytes());
        }
        bytes.extend(&base[self.place + whole..]);
        let size = if piece == 1 { 4 } else { 2 };
        bytes[self.field..self.field + size].copy_from_slice(&(length as u32).to_le_bytes()[..size]);
        let all = (bytes.len() as u32).to_le_bytes();
        bytes[8..12].copy_from_slice(&all);
        sealed(&mut bytes);
        bytes
    }
}
