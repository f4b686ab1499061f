//! The result of one approach of the probe.

use crate::pattern::ContactPattern;

/// Time of a finger's first contact: whole microseconds after the first finger's, or missing when it never touched.
///
/// Four bytes; every bit pattern is valid, so a touch can be read from a stream without a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ContactTime(u32);

impl ContactTime {
    /// The finger never touched.
    pub const MISSING: Self = Self(u32::MAX);
    /// The first finger to touch.
    pub const FIRST: Self = Self(0);

    /// A contact after `micros` microseconds; `u32::MAX` (71 minutes) is the missing contact.
    pub const fn from_micros(micros: u32) -> Self {
        Self(micros)
    }

    /// Microseconds after the first contact, or `None` when the finger never touched.
    pub const fn micros(self) -> Option<u32> {
        if self.0 == u32::MAX { None } else { Some(self.0) }
    }

    /// True if the finger never touched.
    pub const fn is_missing(self) -> bool {
        self.0 == u32::MAX
    }
}

/// One in Q15: a direction cosine of 1 is stored as 32767.
pub const Q15_ONE: i16 = i16::MAX;

/// Direction and alignment of the probe, in the object's frame, or in the table's where a touch has a position: direction cosines in Q15 (-32767 to 32767).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pose {
    /// Unit vector of the probe's motion.
    pub direction: [i16; 3],
    /// Unit vector along the row of fingers, from the first to the third.
    pub alignment: [i16; 3],
}

/// Position of the hand at the first contact, in the table's frame, in whole micrometers.
///
/// It is the lowest point of the middle fingertip at the moment of the first contact with object or table; where nothing was
/// met, the lowest point of the approach. z points up and is 0 on the table.
#[cfg(feature = "position")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Position {
    /// x, y and z.
    pub micrometers: [i32; 3],
}

/// The result of an approach: three contact times, any of which may be missing, and the probe's pose, if known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Touch {
    times: [ContactTime; 3],
    pose: Option<Pose>,
    #[cfg(feature = "position")]
    position: Option<Position>,
}

impl Touch {
    /// A touch from three contact times on any common clock: the earliest becomes 0.
    ///
    /// Cost: a few instructions. Cannot fail; three missing times are an approach that touched nothing.
    pub fn new(times: [ContactTime; 3]) -> Self {
        let earliest = times.iter().map(|t| t.0).min().unwrap_or(0);
        Self {
            times: times.map(|t| if t.is_missing() { t } else { ContactTime(t.0.saturating_sub(earliest)) }),
            pose: None,
            #[cfg(feature = "position")]
            position: None,
        }
    }

    /// A full touch from three times in microseconds on any common clock (each below `u32::MAX`).
    pub fn from_micros(micros: [u32; 3]) -> Self {
        Self::new(micros.map(ContactTime::from_micros))
    }

    /// This touch with the probe's pose.
    pub const fn with_pose(mut self, pose: Pose) -> Self {
        self.pose = Some(pose);
        self
    }

    /// This touch with the hand's position, in the frame that its pose is in: a touch with a position has a pose, too.
    #[cfg(feature = "position")]
    pub const fn with_position(mut self, position: Position) -> Self {
        self.position = Some(position);
        self
    }

    /// This touch with other contact times, on any common clock: the earliest becomes 0. All else stays.
    pub fn with_times(&self, times: [ContactTime; 3]) -> Self {
        Self { times: Self::new(times).times, ..*self }
    }

    /// The three contact times; unless all are missing, the earliest is 0.
    pub const fn times(&self) -> [ContactTime; 3] {
        self.times
    }

    /// The probe's pose, if known.
    pub const fn pose(&self) -> Option<Pose> {
        self.pose
    }

    /// The hand's position, if known.
    #[cfg(feature = "position")]
    pub const fn position(&self) -> Option<Position> {
        self.position
    }

    /// The set of fingers that touched.
    #[inline(never)]
    pub fn pattern(&self) -> ContactPattern {
        let [first, middle, last] = self.times;
        ContactPattern::of([!first.is_missing(), !middle.is_missing(), !last.is_missing()])
    }

    /// Microseconds between the first and the last contact; 0 with fewer than two contacts.
    pub fn spread(&self) -> u32 {
        // A missing contact is the largest number, and so 0 as one more.
        self.times.iter().fold(1, |last, time| time.0.wrapping_add(1).max(last)) - 1
    }

    /// True if all three fingers touched.
    pub fn is_full(&self) -> bool {
        self.times.iter().all(|t| !t.is_missing())
    }

    /// True if no finger touched.
    pub fn is_empty(&self) -> bool {
        self.times.iter().all(|t| t.is_missing())
    }

    /// This physical touch with the fingers counted from the other end.
    pub fn mirrored(&self) -> Self {
        let [a, b, c] = self.times;
        Self {
            times: [c, b, a],
            pose: self.pose.map(|pose| Pose { alignment: pose.alignment.map(i16::saturating_neg), ..pose }),
            #[cfg(feature = "position")]
            position: self.position,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn earliest_contact_becomes_zero() {
        let touch = Touch::from_micros([1_500, 1_000, 4_000_000_000]);
        assert_eq!(touch.times().map(|t| t.micros()), [Some(500), Some(0), Some(3_999_999_000)]);
    }

    #[test]
    fn missing_contacts_stay_missing() {
        let touch = Touch::new([ContactTime::MISSING, ContactTime::from_micros(7), ContactTime::MISSING]);
        assert_eq!(touch.times().map(|t| t.micros()), [None, Some(0), None]);
        assert!(!touch.is_full() && !touch.is_empty());
        assert_eq!((touch.pattern(), touch.spread()), (ContactPattern::Middle, 0));
        assert_eq!(Touch::new([ContactTime::MISSING; 3]).spread(), 0);
        assert_eq!(Touch::new([ContactTime::from_micros(9), ContactTime::MISSING, ContactTime::FIRST]).spread(), 9);
        assert!(Touch::new([ContactTime::MISSING; 3]).is_empty());
    }

    #[test]
    fn mirroring_twice_is_the_same_touch() {
        let pose = Pose { direction: [1, 2, 3], alignment: [-32767, 0, 5] };
        let touch = Touch::from_micros([0, 5, 9]).with_pose(pose);
        assert_eq!(touch.mirrored().mirrored(), touch);
        assert_eq!(touch.mirrored().times().map(|t| t.micros()), [Some(9), Some(5), Some(0)]);
    }

    #[cfg(feature = "position")]
    #[test]
    fn a_position_stays_when_fingers_are_counted_from_the_other_end_and_when_times_change() {
        let pose = Pose { direction: [0, 0, -32767], alignment: [32767, 0, 0] };
        let position = Position { micrometers: [i32::MIN, 0, i32::MAX] };
        let touch = Touch::from_micros([0, 5, 9]).with_pose(pose).with_position(position);
        assert_eq!((touch.mirrored().position(), touch.mirrored().mirrored()), (Some(position), touch));
        let later = touch.with_times([ContactTime::MISSING, ContactTime::from_micros(7), ContactTime::MISSING]);
        assert_eq!((later.pose(), later.position()), (Some(pose), Some(position)));
        assert_eq!(later.times().map(|t| t.micros()), [None, Some(0), None]);
    }
}
