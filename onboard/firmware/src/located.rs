//! A located approach and what every machine must make of it, as bytes: the same lines for the `located` image and for the host
//! that writes its approaches.

use palpate_onboard::locate::{Approach, Effort, Hand, Locator, Pose};
use palpate_onboard::{Familiarity, Verdict};
use palpate_shared::{ContactTime, Pose as HandPose, Position, Touch};

/// A locator with its touches within 128 KB of RAM: 112 KB of cells.
pub type OnChip<'m> = Locator<'m, 14_336, 32, 16>;

/// Bytes of [`Terms`].
pub const TERMS: usize = 16;
/// Bytes of a [`touch`].
pub const TOUCH: usize = 32;
/// Bytes of a [`record`].
pub const LENGTH: usize = 52;

/// Terms of the approaches: bounds on their work, the workspace in micrometers, and the pose's share in 64ths.
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    /// Bounds on an approach's work.
    pub effort: Effort,
    /// Half of the workspace's side.
    pub within: u32,
    /// Share of the pose in the choice.
    pub pose: u16,
}

impl Terms {
    /// The terms as bytes.
    pub fn to_bytes(self) -> [u8; TERMS] {
        let Self { effort: Effort { lookups, cells, candidates }, within, pose } = self;
        let both = u32::from(candidates) << 16 | u32::from(pose);
        filled([lookups, cells, within, both].into_iter().flat_map(u32::to_le_bytes))
    }

    /// The terms in these bytes.
    pub fn from_bytes(bytes: &[u8; TERMS]) -> Self {
        let [lookups, cells, within, both] = words(bytes);
        Self { effort: Effort { lookups, cells, candidates: (both >> 16) as u16 }, within, pose: both as u16 }
    }
}

/// A touch with pose and position from straight above as bytes.
pub fn to_bytes(touch: &Touch) -> [u8; TOUCH] {
    let times = touch.times().map(|time| time.micros().unwrap_or(u32::MAX)).into_iter();
    let position = touch.position().map_or([0; 3], |position| position.micrometers);
    let alignment = touch.pose().map_or([0; 3], |pose| pose.alignment);
    let numbers = times.chain(position.map(i32::cast_unsigned)).flat_map(u32::to_le_bytes);
    filled(numbers.chain(alignment.into_iter().flat_map(i16::to_le_bytes)))
}

/// The touch in these bytes.
pub fn touch(bytes: &[u8; TOUCH]) -> Touch {
    let [a, b, c, x, y, z, first, second] = words(bytes);
    let alignment = [first as u16, (first >> 16) as u16, second as u16].map(u16::cast_signed);
    Touch::new([a, b, c].map(ContactTime::from_micros))
        .with_pose(HandPose { direction: [0, 0, i16::MIN], alignment })
        .with_position(Position { micrometers: [x, y, z].map(u32::cast_signed) })
}

/// Results of an approach.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// The verdict; none for a touch that is refused.
    pub verdict: Option<Verdict>,
    /// The most likely pose of the recognized object, or else of the leader.
    pub pose: Option<Pose>,
    /// Next approach.
    pub next: Approach,
}

/// Takes in a touch, and chooses the next approach. After a verdict the locator starts again.
pub fn push(locator: &mut OnChip<'_>, touch: &Touch, hand: Hand, terms: &Terms) -> Found {
    let verdict = locator.push(touch, hand);
    let mut pose = [Pose::default()];
    let found = locator.poses(locator.best(), &mut pose);
    let next = locator.choose(hand.spacing, hand.stroke.unwrap_or(u32::MAX), terms.within, terms.pose);
    Found { verdict, pose: pose.into_iter().take(found).next(), next }
}

/// Every bit of the results, and of what they rest on.
pub fn record(locator: &OnChip<'_>, found: &Found) -> [u8; LENGTH] {
    let verdict = match found.verdict {
        Some(Verdict::Undecided) => 0,
        Some(Verdict::Recognized { object, touches, .. }) => 1 << 30 | u32::from(object) << 16 | touches,
        Some(Verdict::Unknown) => 2 << 30,
        Some(Verdict::GaveUp) => 2 << 30 | 1,
        None => 3 << 30,
    };
    let exhausted = u32::from(locator.exhausted().is_some()) << 31;
    let stranger = u32::from(locator.familiarity() == Familiarity::Stranger) << 30;
    let rivals = locator.rivals().q56();
    let [x, y] = found.pose.map_or([0; 2], |pose| pose.position.map(i32::cast_unsigned));
    let yaw = found.pose.map_or(0, |pose| u32::from(pose.yaw) << 16 | u32::from(pose.yaw_within.unwrap_or(u16::MAX)));
    let [within, share] = found.pose.map_or([0; 2], |pose| [pose.within[0] << 16 | pose.within[1], pose.share]);
    let placement = found.pose.map_or(u32::MAX, |pose| u32::from(pose.placement) << 8 | u32::from(found.next.roll));
    let numbers = [
        verdict,
        exhausted | stranger | locator.kept() as u32,
        locator.looked(),
        rivals as u32,
        (rivals >> 32) as u32,
        x,
        y,
        yaw,
        within,
        share,
        placement,
        found.next.x.cast_unsigned(),
        found.next.y.cast_unsigned(),
    ];
    filled(numbers.into_iter().flat_map(u32::to_le_bytes))
}

/// The bytes in an array, with zeros at its end.
fn filled<const N: usize>(from: impl Iterator<Item = u8>) -> [u8; N] {
    let mut bytes = [0; N];
    bytes.iter_mut().zip(from).for_each(|(to, from)| *to = from);
    bytes
}

/// Numbers at the start of bytes.
fn words<const N: usize>(bytes: &[u8]) -> [u32; N] {
    let mut words = [0; N];
    words.iter_mut().zip(bytes.as_chunks().0).for_each(|(to, from)| *to = u32::from_le_bytes(*from));
    words
}
