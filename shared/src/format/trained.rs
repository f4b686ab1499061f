//! Statements of a model about its training, and the optional sections that hold it.

use super::codes::{Counted, Length};
use crate::pattern::Patterns;

/// An optional section's tag. The tag in the model also has [`MUST_UNDERSTAND`] set if a reader that does not know the
/// section has to refuse the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Tag {
    /// [`TrainedProbe`].
    Probe = 1,
    /// [`TrainedTouches`].
    Touches = 2,
    /// [`TrainedNoise`].
    Noise = 3,
    /// Weights of evidence by the number of touches: [`Weights`](super::Weights).
    Weights = 4,
    /// Stopping thresholds by object: [`OddsByObject`](super::OddsByObject).
    ThresholdsByObject = 5,
    /// A test for objects that the model does not know: [`Strangers`](super::Strangers).
    Strangers = 6,
    /// [`Plan`](super::Plan).
    Plan = 7,
    /// The features' names and scales, for models over rows of features: see [`take_feature`].
    FeatureNames = 8,
    /// [`PatternShares`].
    PatternShares = 9,
    /// [`Promise`](super::Promise).
    Promise = 10,
    /// [`Temperature`](super::Temperature).
    Temperature = 11,
    /// The values of leaves that stand for many: [`SharedLeaves`](super::SharedLeaves).
    SharedLeaves = 12,
    /// Rule that turns margins of rows into a class or a value: [`Prediction`](super::Prediction).
    Prediction = 13,
    /// Features that stand for a missing value: [`Sentinel`](super::Sentinel).
    Sentinel = 14,
    /// [`Fingerprints`].
    Fingerprints = 15,
    /// Evidence of a row by its margins: [`RowEvidence`](super::RowEvidence).
    RowEvidence = 16,
    /// Outputs that belong to one object: [`Outputs`](super::Outputs).
    Outputs = 18,
    /// Columns of the library's rows that a model over some of them has: how many there were, and the number of each, as u32.
    Columns = 19,
    /// Maps of the heights that a fingertip meets on objects on a table, for a model of [`MAPS_LAYOUT`](super::MAPS_LAYOUT).
    Maps = 20,
    /// Feature that is the number of a row in its sequence: [`Position`](super::Position).
    Position = 21,
    /// Rows that a model takes in a sequence: [`Guard`](super::Guard).
    Guard = 22,
}

impl Tag {
    /// The tag's number.
    pub const fn code(self) -> u16 {
        self as u16
    }
}

/// Set in the tag of a section that a reader has to understand.
pub const MUST_UNDERSTAND: u16 = 1 << 15;

/// Bytes before a section's content: tag, two zeros, length.
pub const SECTION_HEADER_LENGTH: usize = 8;

/// The probe that a model was trained for: 16 bytes, 24 if it states stroke and travel, 28 if it also states the
/// stroke's tolerance.
///
/// The header's `spacing` and `speed` are those of the simulated training; here they are as the user stated them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainedProbe {
    /// Radius of a finger, in lengths.
    pub radius: f32,
    /// Between neighboring fingers, in lengths.
    pub spacing: f32,
    /// Nominal speed, in lengths per second.
    pub speed: f32,
    /// Unit of a length.
    pub length: Length,
    /// Way that the hand goes on after the first contact, in lengths; none: past the object.
    pub stroke: Option<f32>,
    /// Way that it goes from its start before an approach is a miss, in lengths; none: past the object.
    pub travel: Option<f32>,
    /// Largest angle between approaches and straight down, in hundredths of a degree, where objects lie on a table; 0: they
    /// float, and approaches come from every direction.
    pub cone: u16,
    /// Length by which a recorded contact may be later than the stroke and is still of this hand, in lengths; none: as
    /// much as clocks and lengths are usually off.
    pub stroke_tolerance: Option<f32>,
}

impl TrainedProbe {
    /// The largest cone: directions from the upper half sphere.
    pub(crate) const LARGEST_CONE: u16 = 9_000;

    /// Bytes of the section without stroke and travel: the least that it has.
    pub const LENGTH: usize = 16;

    /// Bytes of the section with them.
    pub(crate) const WITH_HAND: usize = 24;

    /// Bytes of the section with them and the tolerance of the stroke: the most that it has.
    pub(crate) const WITH_TOLERANCE: usize = 28;

    /// The section's content: of these bytes the first [`length`](Self::length).
    pub fn to_bytes(self) -> [u8; Self::WITH_TOLERANCE] {
        let [radius, spacing, speed] = [self.radius, self.spacing, self.speed].map(f32::to_le_bytes);
        let [stroke, travel, tolerance] =
            [self.stroke, self.travel, self.stroke_tolerance].map(|length| length.unwrap_or_default().to_le_bytes());
        let [low, high] = self.cone.to_le_bytes();
        let numbers = [radius, spacing, speed, [self.length.code(), 0, low, high], stroke, travel, tolerance];
        let mut bytes = [0; Self::WITH_TOLERANCE];
        bytes.iter_mut().zip(numbers.into_iter().flatten()).for_each(|(to, from)| *to = from);
        bytes
    }

    /// Bytes of the section's content; fewer without stroke and travel.
    pub const fn length(&self) -> usize {
        match (self.stroke_tolerance, self.stroke, self.travel) {
            (Some(_), ..) => Self::WITH_TOLERANCE,
            (None, None, None) => Self::LENGTH,
            _ => Self::WITH_HAND,
        }
    }

    /// Reads a section; `None` if a number is not positive and finite (stroke, travel and tolerance may be 0, or not there), the unit of
    /// length does not exist, or the cone is above 90 degrees. Bytes after the known ones are ignored.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let ([radius, spacing, speed, [length, _, low, high]], rest) =
            bytes.as_chunks::<4>().0.split_first_chunk::<4>()?;
        let cone = u16::from_le_bytes([*low, *high]);
        let number = |bytes: &[u8; 4]| {
            let bits = u32::from_le_bytes(*bytes);
            // Positive and finite, without floating point.
            (bits.wrapping_sub(1) < f32::INFINITY.to_bits() - 1).then(|| f32::from_bits(bits))
        };
        let stated = |bytes: &[u8; 4]| if *bytes == [0; 4] { Some(None) } else { number(bytes).map(Some) };
        let [stroke, travel] = rest.first_chunk::<2>().unwrap_or(&[[0; 4]; 2]);
        let tolerance = rest.get(2).unwrap_or(&[0; 4]);
        Some(Self {
            radius: number(radius)?,
            spacing: number(spacing)?,
            speed: number(speed)?,
            length: Length::from_code(*length)?,
            stroke: stated(stroke)?,
            travel: stated(travel)?,
            cone: (cone <= Self::LARGEST_CONE).then_some(cone)?,
            stroke_tolerance: stated(tolerance)?,
        })
    }
}

/// The touches that a model was trained on, and so the only ones that it can take as evidence: 8 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrainedTouches {
    /// The contact patterns that occurred.
    pub patterns: Patterns,
    /// Approaches that count as evidence.
    pub counted: Counted,
    /// True if a touch must have a pose.
    pub needs_pose: bool,
    /// The largest time between the first and the last contact of a touch, in microseconds; `u32::MAX` if it is not
    /// known. An effector that waits for less turns full touches into partial ones. Of a probe with a stroke it is the time
    /// that the stroke takes: an effector waits no longer, and what comes later is missing.
    pub largest_spread: u32,
}

impl TrainedTouches {
    /// Bytes of the section.
    pub(crate) const LENGTH: usize = 8;

    /// Full touches only, without a limit of their spread: what a model without this section was trained on.
    pub const fn full(needs_pose: bool) -> Self {
        Self { patterns: Patterns::FULL, counted: Counted::Full, needs_pose, largest_spread: u32::MAX }
    }

    /// The section's content.
    pub fn to_bytes(self) -> [u8; Self::LENGTH] {
        let [a, b, c, d] = self.largest_spread.to_le_bytes();
        [self.patterns.bits(), self.counted.code(), self.needs_pose.into(), 0, a, b, c, d]
    }

    /// Reads a section; `None` if there is no pattern, one that does not exist or one that does not count, or if a code
    /// does not exist. Bytes after the known ones are ignored.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (&[patterns, counted, pose, _, a, b, c, d], _) = bytes.split_first_chunk()?;
        let (patterns, counted) = (Patterns::from_bits(patterns)?, Counted::from_code(counted)?);
        if patterns.is_empty() || patterns.and(counted.patterns()) != patterns || pose > 1 {
            return None;
        }
        Some(Self { patterns, counted, needs_pose: pose == 1, largest_spread: u32::from_le_bytes([a, b, c, d]) })
    }
}

/// The noise that was added to touches in training: 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrainedNoise {
    /// The least standard deviation of the Gaussian noise of contact times, in microseconds.
    pub least: u32,
    /// The largest one.
    pub largest: u32,
    /// The timer's resolution in microseconds; 0 for none.
    pub timer: u32,
    /// The standard deviation of the pose in thousandths of a degree; 0 for none.
    pub pose: u32,
}

impl TrainedNoise {
    /// Bytes of the section.
    pub const LENGTH: usize = 16;

    /// The section's content.
    pub fn to_bytes(self) -> [u8; Self::LENGTH] {
        let numbers = [self.least, self.largest, self.timer, self.pose].map(u32::to_le_bytes);
        let mut bytes = [0; Self::LENGTH];
        bytes.iter_mut().zip(numbers.into_iter().flatten()).for_each(|(to, from)| *to = from);
        bytes
    }

    /// Reads a section; `None` if it is too short or its largest noise is less than its least. Bytes after the known
    /// ones are ignored.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (numbers, _) = bytes.as_chunks::<4>().0.split_first_chunk::<4>()?;
        let [least, largest, timer, pose] = numbers.map(u32::from_le_bytes);
        (least <= largest).then_some(Self { least, largest, timer, pose })
    }
}

/// Frequency of each contact pattern among the approaches of the training: 12 bytes. Nothing on the chip uses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatternShares(
    /// For each pattern, in the order of the codes, its share in units of 1/65535.
    pub [u16; 6],
);

impl PatternShares {
    /// Bytes of the section.
    pub(crate) const LENGTH: usize = 12;

    /// The section's content.
    pub fn to_bytes(self) -> [u8; Self::LENGTH] {
        let mut bytes = [0; Self::LENGTH];
        bytes.iter_mut().zip(self.0.into_iter().flat_map(u16::to_le_bytes)).for_each(|(to, from)| *to = from);
        bytes
    }

    /// Reads a section; `None` if it is too short. Bytes after the known ones are ignored.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (shares, _) = bytes.as_chunks::<2>().0.split_first_chunk::<6>()?;
        Some(Self(shares.map(u16::from_le_bytes)))
    }
}

/// Fingerprints of the touches that a model was trained on, so that a host knows them again: 2 bytes for each object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fingerprints<'a>(&'a [[u8; 2]]);

impl<'a> Fingerprints<'a> {
    /// Reads a section; `None` if it is too short for this many objects. Bytes after the known ones are ignored.
    ///
    /// Cost: a few instructions.
    pub fn from_bytes(bytes: &'a [u8], objects: usize) -> Option<Self> {
        bytes.as_chunks().0.get(..objects).map(Self)
    }

    /// 16 bits of a checksum of an object's first touches; none if nothing is known.
    ///
    /// Cost: a few instructions. Cannot fail.
    pub fn object(&self, object: usize) -> Option<u16> {
        self.0.get(object).map(|bytes| u16::from_le_bytes(*bytes)).filter(|&object| object != 0)
    }
}

/// Statement of a model over rows about one of its features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature<'a> {
    /// Factor applied to a value, which is then rounded to the nearest whole number; 1 where f32 values are compared.
    pub scale: f32,
    /// Its name.
    pub name: &'a str,
}

/// Splits the first feature off the content of the section of features' names; `None` if it is not whole. What is left is
/// in `bytes`.
///
/// Cost: a few instructions, and the check that the name is UTF-8. Cannot fail.
pub fn take_feature<'a>(bytes: &mut &'a [u8]) -> Option<Feature<'a>> {
    let (&[a, b, c, d, length], rest) = bytes.split_first_chunk()?;
    let (name, rest) = rest.split_at_checked(usize::from(length))?;
    let name = core::str::from_utf8(name).ok()?;
    *bytes = rest;
    Some(Feature { scale: f32::from_le_bytes([a, b, c, d]), name })
}

/// An optional section of a model.
///
/// ```
/// use palpate_shared::format::{HeaderBuilder, Section, Tag, TrainedTouches};
///
/// let content = TrainedTouches::full(false).to_bytes();
/// let mut sections = Vec::new();
/// // A reader that does not know the tag would take other touches for evidence.
/// let section = Section { tag: Tag::Touches.code(), must_understand: true, content: &content };
/// section.write(&mut |bytes| sections.extend_from_slice(bytes));
/// let header = HeaderBuilder::default().with_optional_length(sections.len() as u32);
/// // Header, text, these sections, base margins, and so on.
/// # assert_eq!(sections.len(), 16);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section<'a> {
    /// The tag without [`MUST_UNDERSTAND`].
    pub tag: u16,
    /// True if a reader that does not know the tag must refuse the model.
    pub must_understand: bool,
    /// The content, without the zeros after it.
    pub content: &'a [u8],
}

impl Section<'_> {
    /// Hands its bytes to `put`: its header, its content, and zeros up to a multiple of four. Sections have to be written in the
    /// order of their tags, each once.
    ///
    /// A content of 4 GB or more is cut there.
    pub fn write(&self, put: &mut impl FnMut(&[u8])) {
        let tag = self.tag | if self.must_understand { MUST_UNDERSTAND } else { 0 };
        let length = u32::try_from(self.content.len()).unwrap_or(u32::MAX);
        let content = self.content.get(..usize::try_from(length).unwrap_or(usize::MAX)).unwrap_or(self.content);
        put(&tag.to_le_bytes());
        put(&[0; 2]);
        put(&length.to_le_bytes());
        put(content);
        let zeros = content.len().wrapping_neg() % 4;
        put([0; 3].get(..zeros).unwrap_or_default());
    }
}

/// Splits the first section off `bytes`; `None` if it is not whole. What is left is in `bytes`.
///
/// Cost: a few instructions. Cannot fail.
pub fn take_section<'a>(bytes: &mut &'a [u8]) -> Option<Section<'a>> {
    let (&[low, high, _, _, a, b, c, d], rest) = bytes.split_first_chunk::<SECTION_HEADER_LENGTH>()?;
    let tag = u16::from_le_bytes([low, high]);
    let length = usize::try_from(u32::from_le_bytes([a, b, c, d])).ok()?;
    let (content, rest) = rest.split_at_checked(length)?;
    *bytes = rest.get(length.wrapping_neg() % 4..)?;
    Some(Section { tag: tag & !MUST_UNDERSTAND, must_understand: tag & MUST_UNDERSTAND != 0, content })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::tests::{assert_refused, written};
    use std::vec::Vec;

    const TOUCHES: TrainedTouches = TrainedTouches {
        patterns: Patterns::CONTACTS,
        counted: Counted::Contacts,
        needs_pose: true,
        largest_spread: 1_050_000,
    };
    const PROBE: TrainedProbe = TrainedProbe {
        radius: 0.15,
        spacing: 1.5,
        speed: 10.0,
        length: Length::Tenth,
        stroke: None,
        travel: None,
        cone: 0,
        stroke_tolerance: None,
    };
    const NOISE: TrainedNoise = TrainedNoise { least: 0, largest: 10_000, timer: 1_000, pose: 5_000 };

    #[test]
    fn sections_are_read_back_as_written() {
        let shares = PatternShares([9, 8, 7, 6, 5, 65_530]);
        let contents: [(Tag, bool, &[u8]); 5] = [
            (Tag::Probe, false, &PROBE.to_bytes()[..PROBE.length()]),
            (Tag::Touches, true, &TOUCHES.to_bytes()),
            (Tag::Noise, false, &NOISE.to_bytes()),
            (Tag::FeatureNames, false, b"seven b"),
            (Tag::PatternShares, false, &shares.to_bytes()),
        ];
        let bytes = written(|put| {
            for (tag, must_understand, content) in contents {
                Section { tag: tag.code(), must_understand, content }.write(&mut *put);
            }
        });
        let mut rest = bytes.as_slice();
        let sections: Vec<Section> = core::iter::from_fn(|| take_section(&mut rest)).collect();
        assert!(rest.is_empty());
        let heads: Vec<_> = sections.iter().map(|s| (s.tag, s.must_understand, s.content.len())).collect();
        assert_eq!(heads, [(1, false, 16), (2, true, 8), (3, false, 16), (8, false, 7), (9, false, 12)]);
        assert_eq!(PatternShares::from_bytes(sections[4].content), Some(shares));
        assert_eq!(PatternShares::from_bytes(&sections[4].content[..11]), None);
        assert_eq!(TrainedProbe::from_bytes(sections[0].content), Some(PROBE));
        assert_eq!(TrainedTouches::from_bytes(sections[1].content), Some(TOUCHES));
        assert_eq!(TrainedNoise::from_bytes(sections[2].content), Some(NOISE));
        assert_eq!(sections[3].content, b"seven b");
        for length in 0..16 {
            assert_eq!(take_section(&mut &bytes[..length]), None, "{length} bytes");
        }
    }

    #[test]
    fn a_probe_is_read_back_and_readers_of_fewer_bytes_know_what_stands_in_them() {
        let stroke = TrainedProbe { stroke: Some(5.25), ..PROBE };
        let tolerance = TrainedProbe { stroke_tolerance: Some(0.25), ..stroke };
        let travel = TrainedProbe { travel: Some(20.0), ..PROBE };
        let both = TrainedProbe { stroke: Some(0.5), ..travel };
        let scene = |cone| TrainedProbe { cone, ..PROBE };
        for (probe, length, shorter, known) in [
            (PROBE, 16, 16, PROBE),
            (stroke, 24, 23, PROBE),
            (travel, 24, 23, PROBE),
            (both, 24, 23, PROBE),
            (tolerance, 28, 24, stroke),
            (scene(1), 16, 16, scene(1)),
            (scene(6_000), 16, 16, scene(6_000)),
            (scene(9_000), 16, 16, scene(9_000)),
        ] {
            assert_eq!(probe.length(), length);
            assert_eq!(TrainedProbe::from_bytes(&probe.to_bytes()), Some(probe));
            assert_eq!(TrainedProbe::from_bytes(&probe.to_bytes()[..shorter]), Some(known));
        }
        assert_eq!(tolerance.to_bytes()[..24], stroke.to_bytes()[..24]);
        assert_eq!(PROBE.to_bytes()[12..16], [0; 4]);
    }

    #[test]
    fn fingerprints_are_read_back_as_written_and_only_whole() {
        let bytes = [0, 0, 0x34, 0x12, 9];
        let read = Fingerprints::from_bytes(&bytes, 2).unwrap();
        assert_eq!([0, 1, 2].map(|object| read.object(object)), [None, Some(0x1234), None]);
        assert_eq!(Fingerprints::from_bytes(&bytes, 3), None);
        assert_eq!(Fingerprints::from_bytes(&[], 1), None);
    }

    #[test]
    fn features_are_read_one_after_the_other_and_only_whole() {
        let bytes = [&1.5_f32.to_le_bytes()[..], b"\x02ab", &1_f32.to_le_bytes(), b"\x00"].concat();
        let mut rest = bytes.as_slice();
        assert_eq!(take_feature(&mut rest), Some(Feature { scale: 1.5, name: "ab" }));
        assert_eq!(take_feature(&mut rest), Some(Feature { scale: 1.0, name: "" }));
        assert_eq!(take_feature(&mut rest), None);
        assert_eq!(take_feature(&mut &bytes[..6]), None);
        assert_eq!(take_feature(&mut &b"\0\0\0\0\x01\xff"[..]), None, "not UTF-8");
    }

    #[test]
    fn contents_that_make_no_sense_are_refused() {
        let wrong: [(usize, &[u8]); 5] = [(0, &[0]), (0, &[1]), (0, &[64]), (1, &[3]), (2, &[2])];
        assert_refused(&TOUCHES.to_bytes(), &wrong, |bytes| TrainedTouches::from_bytes(bytes).is_some());
        for (radius, length) in [(0.0, 0), (-1.0, 0), (f32::NAN, 0), (f32::INFINITY, 0), (0.15, 2)] {
            let mut bytes = TrainedProbe { radius, ..PROBE }.to_bytes();
            bytes[12] = length;
            assert_eq!(TrainedProbe::from_bytes(&bytes), None, "{radius} {length}");
        }
        assert_eq!(TrainedNoise::from_bytes(&TrainedNoise { least: 20_000, ..NOISE }.to_bytes()), None);
        assert_eq!(TrainedTouches::from_bytes(&TOUCHES.to_bytes()[..7]), None);
        assert_eq!(TrainedProbe::from_bytes(&PROBE.to_bytes()[..15]), None);
        let strokes = [-1.0, f32::NAN, f32::INFINITY].map(|stroke| TrainedProbe { stroke: Some(stroke), ..PROBE });
        for probe in strokes.into_iter().chain([TrainedProbe { cone: 9_001, ..PROBE }]) {
            assert_eq!(TrainedProbe::from_bytes(&probe.to_bytes()), None, "{probe:?}");
        }
        assert_eq!(TrainedNoise::from_bytes(&NOISE.to_bytes()[..15]), None);
    }

    #[test]
    fn a_section_that_has_grown_is_read_as_far_as_it_is_known() {
        let grown = |bytes: &[u8]| [bytes, &[1, 2, 3, 4]].concat();
        assert_eq!(TrainedProbe::from_bytes(&grown(&PROBE.to_bytes())), Some(PROBE));
        assert_eq!(TrainedTouches::from_bytes(&grown(&TOUCHES.to_bytes())), Some(TOUCHES));
        assert_eq!(TrainedNoise::from_bytes(&grown(&NOISE.to_bytes())), Some(NOISE));
    }
}
