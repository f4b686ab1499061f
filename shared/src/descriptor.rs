//! Descriptors: the features that a touch is turned into.
//!
//! A touch and its mirror image (fingers counted from the other end) are the same touch, so every descriptor but the
//! paper's own [`Descriptor::Times`] gives the same features for both.

use crate::touch::{ContactTime, Pose, Touch};

/// The most features that a built-in descriptor has.
pub(crate) const MAX_FEATURES: usize = 10;

/// The value of a feature that a missing contact or an unknown pose leaves open.
pub const MISSING_FEATURE: i32 = i32::MIN;

/// Features are clamped to ± this many units: the largest range in which every whole number is exact in f32, so that
/// trainers that work in f32 see what the chip sees.
pub(crate) const FEATURE_LIMIT: i32 = (1 << 24) - 1;

/// Features that a touch is turned into. Times in microseconds, direction cosines in Q15.
///
/// The first four were made for full touches; of a partial touch they know the slope of both outer fingers at most. The
/// `Contacts` forms are for touches with any contacts: they begin with the contact pattern, and a pair of neighboring
/// fingers gives its time difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Descriptor {
    /// `t1, t2, t3`: the published method's own; the baseline.
    Times,
    /// `κ = t1 − 2·t2 + t3` and the slope `|t3 − t1|`: everything that three times say about a surface under an unknown
    /// pose.
    Curvature,
    /// Curvature, and the vertical (z) components of direction and alignment: an object on a table.
    Gravity,
    /// Curvature, direction and alignment in the object's frame: an object whose orientation is known.
    Oriented,
    /// The [contact pattern](crate::ContactPattern), κ where all three fingers touched, the slope where both outer
    /// fingers did, and `t2 − t` where the middle finger and one outer finger (at time t) did.
    ContactsCurvature,
    /// [`Descriptor::ContactsCurvature`], and the vertical components of direction and alignment.
    ContactsGravity,
    /// [`Descriptor::ContactsCurvature`], direction and alignment in the object's frame.
    ContactsOriented,
}

/// The features of one touch: at most ten whole numbers, [`MISSING_FEATURE`] where one is missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Features {
    values: [i32; MAX_FEATURES],
    len: u8,
}

impl Features {
    /// The features in the descriptor's order.
    pub fn as_slice(&self) -> &[i32] {
        self.values.get(..usize::from(self.len)).unwrap_or(&self.values)
    }
}

/// The part of the pose that a descriptor uses.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Frame {
    Nothing,
    Vertical,
    Object,
}

impl Descriptor {
    /// Every descriptor, in the order of their codes in the model format.
    pub const ALL: [Self; 7] = [
        Self::Times,
        Self::Curvature,
        Self::Gravity,
        Self::Oriented,
        Self::ContactsCurvature,
        Self::ContactsGravity,
        Self::ContactsOriented,
    ];

    /// The descriptor's name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Times => "times",
            Self::Curvature => "curvature",
            Self::Gravity => "gravity",
            Self::Oriented => "oriented",
            Self::ContactsCurvature => "contacts-curvature",
            Self::ContactsGravity => "contacts-gravity",
            Self::ContactsOriented => "contacts-oriented",
        }
    }

    /// The descriptor with this [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|d| d.name() == name)
    }

    /// The code in the model format: the position in [`Descriptor::ALL`].
    pub const fn code(self) -> u8 {
        match self {
            Self::Times => 0,
            Self::Curvature => 1,
            Self::Gravity => 2,
            Self::Oriented => 3,
            Self::ContactsCurvature => 4,
            Self::ContactsGravity => 5,
            Self::ContactsOriented => 6,
        }
    }

    /// The descriptor with this [`code`](Self::code).
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0 => Self::Times,
            1 => Self::Curvature,
            2 => Self::Gravity,
            3 => Self::Oriented,
            4 => Self::ContactsCurvature,
            5 => Self::ContactsGravity,
            6 => Self::ContactsOriented,
            _ => return None,
        })
    }

    /// The features' names, in order.
    pub const fn feature_names(self) -> &'static [&'static str] {
        match self {
            Self::Times => &["t1", "t2", "t3"],
            Self::Curvature => &["curvature", "slope"],
            Self::Gravity => &["curvature", "slope", "direction_z", "alignment_z"],
            Self::Oriented => &[
                "curvature",
                "slope",
                "direction_x",
                "direction_y",
                "direction_z",
                "alignment_x",
                "alignment_y",
                "alignment_z",
            ],
            Self::ContactsCurvature => &["pattern", "curvature", "slope", "pair"],
            Self::ContactsGravity => &["pattern", "curvature", "slope", "pair", "direction_z", "alignment_z"],
            Self::ContactsOriented => &[
                "pattern",
                "curvature",
                "slope",
                "pair",
                "direction_x",
                "direction_y",
                "direction_z",
                "alignment_x",
                "alignment_y",
                "alignment_z",
            ],
        }
    }

    /// Number of features of a touch.
    pub const fn feature_count(self) -> usize {
        self.length() as usize
    }

    /// Not from the names, which would then be linked.
    const fn length(self) -> u8 {
        match self {
            Self::Times => 3,
            Self::Curvature => 2,
            Self::Gravity | Self::ContactsCurvature => 4,
            Self::Oriented => 8,
            Self::ContactsGravity => 6,
            Self::ContactsOriented => 10,
        }
    }

    /// True if the features need the probe's pose; without one those features are missing.
    pub const fn needs_pose(self) -> bool {
        !matches!(self.frame(), Frame::Nothing)
    }

    /// True if touches with missing contacts have features: the `Contacts` forms.
    const fn uses_partial_touches(self) -> bool {
        matches!(self, Self::ContactsCurvature | Self::ContactsGravity | Self::ContactsOriented)
    }

    /// The form of this descriptor for touches with any contacts; `None` for [`Descriptor::Times`], which has none.
    pub const fn for_contacts(self) -> Option<Self> {
        match self {
            Self::Times => None,
            Self::Curvature | Self::ContactsCurvature => Some(Self::ContactsCurvature),
            Self::Gravity | Self::ContactsGravity => Some(Self::ContactsGravity),
            Self::Oriented | Self::ContactsOriented => Some(Self::ContactsOriented),
        }
    }

    /// The form of this descriptor for full touches: the inverse of [`Descriptor::for_contacts`].
    pub const fn for_full_touches(self) -> Self {
        match self {
            Self::ContactsCurvature => Self::Curvature,
            Self::ContactsGravity => Self::Gravity,
            Self::ContactsOriented => Self::Oriented,
            _ => self,
        }
    }

    const fn frame(self) -> Frame {
        match self {
            Self::Times | Self::Curvature | Self::ContactsCurvature => Frame::Nothing,
            Self::Gravity | Self::ContactsGravity => Frame::Vertical,
            Self::Oriented | Self::ContactsOriented => Frame::Object,
        }
    }

    /// The features of a touch, clamped to ±(2^24 − 1).
    ///
    /// Cost: a few instructions for each feature. Cannot fail.
    pub fn features(self, touch: &Touch) -> Features {
        const NONE: i32 = MISSING_FEATURE;
        let [first, middle, last] = touch.times();
        // One by one: as an array they would go through memory.
        let (first, middle, last) = (within_limit(first), within_limit(middle), within_limit(last));
        let (mut curvature, mut slope, mut pair) = (NONE, NONE, NONE);
        if first != NONE && last != NONE {
            slope = (last - first).abs().min(FEATURE_LIMIT);
            if middle != NONE {
                curvature = clamp(first - 2 * middle + last);
            }
        } else if middle != NONE {
            // The one outer finger that touched, if one did: the other is missing, which is the least number.
            let outer = first.max(last);
            if outer != NONE {
                pair = clamp(middle - outer);
            }
        }
        let contacts = self.uses_partial_touches();
        let [a, b, c, d] = if self == Self::Times {
            // A missing time is the least number, and stays.
            [first.min(FEATURE_LIMIT), middle.min(FEATURE_LIMIT), last.min(FEATURE_LIMIT), NONE]
        } else if contacts {
            [touch.pattern().code().into(), curvature, slope, pair]
        } else {
            [curvature, slope, NONE, NONE]
        };
        let mut values = [a, b, c, d, NONE, NONE, NONE, NONE, NONE, NONE];
        if self.needs_pose()
            && let Some(pose) = touch.pose()
        {
            self.put_pose(&pose, [first, last], &mut values);
        }
        Features { values, len: self.length() }
    }

    /// Adds what the pose gives: after the first four features; without a pattern, already where the last two of them are.
    fn put_pose(self, pose: &Pose, ends: [i32; 2], values: &mut [i32; MAX_FEATURES]) {
        const NONE: i32 = MISSING_FEATURE;
        let contacts = self.uses_partial_touches();
        let Some(tail) = values.get_mut(if contacts { 4 } else { 2 }..).and_then(<[i32]>::first_chunk_mut) else {
            return;
        };
        let [x, y, z] = pose.direction.map(i32::from);
        let [u, v, w] = oriented(pose.alignment, ends, contacts).map(i32::from);
        match self.frame() {
            Frame::Nothing => {}
            Frame::Vertical => *tail = [z, w, NONE, NONE, NONE, NONE],
            Frame::Object => *tail = [x, y, z, u, v, w],
        }
    }
}

/// A contact time in microseconds; what is later than 2^28 (268 s) counts as that, so that sums of times fit an i32; a
/// missing one is [`MISSING_FEATURE`].
#[inline(always)]
fn within_limit(time: ContactTime) -> i32 {
    const LIMIT: u32 = 1 << 28;
    time.micros().map_or(MISSING_FEATURE, |micros| micros.min(LIMIT).cast_signed())
}

/// A feature within its limits.
fn clamp(value: i32) -> i32 {
    value.clamp(-FEATURE_LIMIT, FEATURE_LIMIT)
}

/// The alignment from the outer finger that touched first to the other one; a missing contact counts as later than any
/// other. Where the times do not say which end is first, a component that is not zero is made positive: the last one of
/// touches with any contacts, so that the vertical component is the same whichever way an object is turned about the
/// vertical; otherwise the first one, as the models of full touches have learned it.
fn oriented(alignment: [i16; 3], ends: [i32; 2], contacts: bool) -> [i16; 3] {
    // A missing contact is the least number, and so the largest as one without a sign.
    let [first, last] = ends.map(i32::cast_unsigned);
    let [u, v, w] = alignment;
    let [a, b, c] = if contacts { [w, v, u] } else { [u, v, w] };
    let sign = if a != 0 {
        a
    } else if b != 0 {
        b
    } else {
        c
    };
    let flip = if first == last { sign < 0 } else { first > last };
    if flip { alignment.map(i16::saturating_neg) } else { alignment }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ContactPattern;

    const NONE: i32 = MISSING_FEATURE;

    fn touch() -> Touch {
        Touch::from_micros([30_000, 0, 50_000]).with_pose(Pose { direction: [1, 2, 3], alignment: [-4, 5, 6] })
    }

    /// A touch with one finger.
    fn alone(finger: usize) -> Touch {
        let mut times = [ContactTime::MISSING; 3];
        times[finger] = ContactTime::FIRST;
        Touch::new(times)
    }

    #[test]
    fn every_descriptor_but_times_is_blind_to_mirroring() {
        let level = Touch::from_micros([7, 0, 7]).with_pose(Pose { direction: [1, 2, 3], alignment: [0, -5, 6] });
        let partial = Touch::new([ContactTime::MISSING, ContactTime::FIRST, ContactTime::from_micros(9)]);
        let pose = Pose { direction: [1, 2, 3], alignment: [7, 8, -9] };
        let all =
            [touch(), level, partial, partial.with_pose(pose), alone(1).with_pose(pose), alone(2).with_pose(pose)];
        for descriptor in Descriptor::ALL.into_iter().filter(|&descriptor| descriptor != Descriptor::Times) {
            for touch in all {
                assert_eq!(descriptor.features(&touch), descriptor.features(&touch.mirrored()));
            }
        }
    }

    #[test]
    fn each_descriptor_has_the_features_of_its_contacts_and_pose() {
        let partial = Touch::new([ContactTime::FIRST, ContactTime::MISSING, ContactTime::from_micros(9)]);
        let slow = Touch::from_micros([0, u32::MAX - 1, 0]);
        let late = Touch::new([ContactTime::MISSING, ContactTime::FIRST, ContactTime::from_micros(u32::MAX - 1)]);
        let [lone, outer] = [ContactPattern::Outer, ContactPattern::OuterAndMiddle].map(|of| i32::from(of.code()));
        let pose = Pose { direction: [1, 2, 3], alignment: [4, 5, 6] };
        let cases: [(Descriptor, Touch, &[i32]); 12] = [
            (Descriptor::Curvature, touch(), &[80_000, 20_000]),
            (Descriptor::Gravity, touch(), &[80_000, 20_000, 3, 6]),
            (Descriptor::Oriented, touch(), &[80_000, 20_000, 1, 2, 3, -4, 5, 6]),
            (Descriptor::ContactsOriented, touch(), &[5, 80_000, 20_000, NONE, 1, 2, 3, -4, 5, 6]),
            (Descriptor::ContactsGravity, touch(), &[5, 80_000, 20_000, NONE, 3, 6]),
            (Descriptor::Times, partial, &[0, NONE, 9]),
            (Descriptor::Curvature, partial, &[NONE, 9]),
            (Descriptor::Gravity, partial, &[NONE, 9, NONE, NONE]),
            // The alignment points away from the only outer finger that touched.
            (Descriptor::ContactsOriented, alone(0).with_pose(pose), &[lone, NONE, NONE, NONE, 1, 2, 3, 4, 5, 6]),
            (Descriptor::ContactsOriented, alone(2).with_pose(pose), &[lone, NONE, NONE, NONE, 1, 2, 3, -4, -5, -6]),
            (Descriptor::Curvature, slow, &[-FEATURE_LIMIT, 0]),
            (Descriptor::ContactsCurvature, late, &[outer, NONE, NONE, -FEATURE_LIMIT]),
        ];
        for (descriptor, touch, features) in cases {
            assert_eq!(descriptor.features(&touch).as_slice(), features, "{descriptor:?}");
        }
        assert_eq!(FEATURE_LIMIT as f32 as i32, FEATURE_LIMIT);
    }

    #[test]
    fn contacts_begin_with_the_pattern_and_have_the_differences_that_exist() {
        let some = ContactTime::from_micros;
        let missing = ContactTime::MISSING;
        let cases = [
            (touch(), ContactPattern::All, [80_000, 20_000, NONE]),
            (Touch::new([some(5), missing, some(9)]), ContactPattern::BothOuter, [NONE, 4, NONE]),
            (Touch::new([some(5), some(9), missing]), ContactPattern::OuterAndMiddle, [NONE, NONE, 4]),
            (Touch::new([missing, some(5), some(9)]), ContactPattern::OuterAndMiddle, [NONE, NONE, -4]),
            (alone(1), ContactPattern::Middle, [NONE; 3]),
            (alone(2), ContactPattern::Outer, [NONE; 3]),
            (Touch::new([missing; 3]), ContactPattern::None, [NONE; 3]),
        ];
        for (touch, pattern, [curvature, slope, pair]) in cases {
            let expected = [i32::from(pattern.code()), curvature, slope, pair];
            assert_eq!(Descriptor::ContactsCurvature.features(&touch).as_slice(), expected, "{pattern}");
            for descriptor in [Descriptor::ContactsGravity, Descriptor::ContactsOriented] {
                assert_eq!(descriptor.features(&touch).as_slice()[..4], expected, "{pattern}");
            }
        }
    }

    #[test]
    fn the_vertical_component_of_the_alignment_is_the_same_however_an_object_is_turned_about_the_vertical() {
        // Half a turn about the vertical; both outer fingers touch at once, or neither does.
        let level = Touch::from_micros([7, 0, 7]);
        for touch in [level, alone(1), Touch::new([ContactTime::MISSING; 3])] {
            for alignment in [[20_000, 5, 9_000], [20_000, 5, -9_000], [0, 3, -1], [-4, 0, 0]] {
                let turned = [-alignment[0], -alignment[1], alignment[2]];
                let pose = |alignment| touch.with_pose(Pose { direction: [0, 0, -32_767], alignment });
                let [as_is, turned] =
                    [alignment, turned].map(|alignment| Descriptor::ContactsGravity.features(&pose(alignment)));
                assert_eq!(as_is, turned, "{alignment:?}");
            }
        }
    }

    #[test]
    fn every_descriptor_but_times_has_a_form_for_contacts() {
        for descriptor in Descriptor::ALL {
            let Some(contacts) = descriptor.for_contacts() else {
                assert_eq!(descriptor, Descriptor::Times);
                continue;
            };
            assert!(contacts.uses_partial_touches());
            assert_eq!(contacts.for_full_touches(), descriptor.for_full_touches());
            assert_eq!(contacts.needs_pose(), descriptor.needs_pose());
            assert_eq!(contacts.feature_count(), descriptor.for_full_touches().feature_count() + 2);
        }
    }

    #[test]
    fn names_and_codes_find_their_descriptor() {
        for descriptor in Descriptor::ALL {
            assert_eq!(Descriptor::from_name(descriptor.name()), Some(descriptor));
            assert_eq!(Descriptor::from_code(descriptor.code()), Some(descriptor));
            assert_eq!(descriptor.features(&touch()).as_slice().len(), descriptor.feature_count());
            assert_eq!(descriptor.feature_names().len(), descriptor.feature_count());
        }
        assert_eq!(Descriptor::from_code(9), None);
    }
}
