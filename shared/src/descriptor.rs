//! Which features a touch is turned into.
//!
//! A touch and its mirror image (fingers counted from the other end) are the same touch, so every descriptor but the
//! paper's own [`Descriptor::Times`] gives the same features for both.

use crate::touch::{ContactTime, Pose, Touch};

/// The most features that a built-in descriptor has.
pub const MAX_FEATURES: usize = 8;

/// The value of a feature that a missing contact or an unknown pose leaves open.
pub const MISSING_FEATURE: i32 = i32::MIN;

/// Features are clamped to ± this many units: the largest range in which every whole number is exact in f32, so that
/// trainers that work in f32 see what the chip sees.
pub const FEATURE_LIMIT: i32 = (1 << 24) - 1;

/// Which features a touch is turned into. Times in microseconds, direction cosines in Q15.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Descriptor {
    /// `t1, t2, t3`: the published method's own; the baseline.
    Times,
    /// `κ = t1 − 2·t2 + t3` and the slope `|t3 − t1|`: all that three times say about a surface under an unknown pose.
    Curvature,
    /// Curvature, and the vertical (z) components of direction and alignment: an object on a table.
    Gravity,
    /// Curvature, direction and alignment in the object's frame: an object whose orientation is known.
    Oriented,
}

/// The features of one touch: at most [`MAX_FEATURES`] whole numbers, [`MISSING_FEATURE`] where one is missing.
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

impl Descriptor {
    /// Every descriptor, in the order of their codes in the model format.
    pub const ALL: [Self; 4] = [Self::Times, Self::Curvature, Self::Gravity, Self::Oriented];

    /// The descriptor's name in files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Times => "times",
            Self::Curvature => "curvature",
            Self::Gravity => "gravity",
            Self::Oriented => "oriented",
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
        }
    }

    /// The descriptor with this [`code`](Self::code).
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|d| d.code() == code)
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
        }
    }

    /// How many features a touch has.
    pub const fn feature_count(self) -> usize {
        self.feature_names().len()
    }

    /// Whether the features need the probe's pose; without one those features are missing.
    pub const fn needs_pose(self) -> bool {
        matches!(self, Self::Gravity | Self::Oriented)
    }

    /// The features of a touch, clamped to ±[`FEATURE_LIMIT`].
    ///
    /// Cost: about 50 instructions on a Cortex-M without a pose. Cannot fail.
    pub fn features(self, touch: &Touch) -> Features {
        const NONE: i32 = MISSING_FEATURE;
        let [first, middle, last] = touch.times();
        let (first, middle, last) = (within_limit(first), within_limit(middle), within_limit(last));
        if self == Self::Times {
            return Features {
                values: [clamp(first), clamp(middle), clamp(last), NONE, NONE, NONE, NONE, NONE],
                len: 3,
            };
        }
        let (mut curvature, mut slope) = (NONE, NONE);
        if first != NONE && last != NONE {
            slope = clamp((last - first).abs());
            if middle != NONE {
                curvature = clamp(first - 2 * middle + last);
            }
        }
        if let (true, Some(Pose { direction, alignment })) = (self.needs_pose(), touch.pose()) {
            let [x, y, z] = direction.map(i32::from);
            let [u, v, w] = canonical_alignment(alignment, touch.times()).map(i32::from);
            return match self {
                Self::Gravity => Features { values: [curvature, slope, z, w, NONE, NONE, NONE, NONE], len: 4 },
                _ => Features { values: [curvature, slope, x, y, z, u, v, w], len: 8 },
            };
        }
        let len = match self {
            Self::Gravity => 4,
            Self::Oriented => 8,
            _ => 2,
        };
        Features { values: [curvature, slope, NONE, NONE, NONE, NONE, NONE, NONE], len }
    }
}

/// A contact time in microseconds; what is later than 2^28 (268 s) counts as that, so that sums of times fit an i32; a
/// missing one is [`MISSING_FEATURE`].
fn within_limit(time: ContactTime) -> i32 {
    const LIMIT: u32 = 1 << 28;
    time.micros().map_or(MISSING_FEATURE, |micros| micros.min(LIMIT).cast_signed())
}

/// A feature within its limits; a missing one stays missing.
fn clamp(value: i32) -> i32 {
    if value == MISSING_FEATURE { value } else { value.clamp(-FEATURE_LIMIT, FEATURE_LIMIT) }
}

/// The alignment counted from the finger that touched first to the one that touched last (a missing contact counts as
/// later than any other); where both touched at once, from whichever end makes its first non-zero component positive.
fn canonical_alignment(alignment: [i16; 3], times: [ContactTime; 3]) -> [i16; 3] {
    let [first, _, last] = times.map(|t| t.micros().unwrap_or(u32::MAX));
    let flip = match first.cmp(&last) {
        core::cmp::Ordering::Less => false,
        core::cmp::Ordering::Greater => true,
        core::cmp::Ordering::Equal => alignment.into_iter().find(|&c| c != 0).is_some_and(|c| c < 0),
    };
    if flip { alignment.map(i16::saturating_neg) } else { alignment }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn touch() -> Touch {
        Touch::from_micros([30_000, 0, 50_000]).with_pose(Pose { direction: [1, 2, 3], alignment: [-4, 5, 6] })
    }

    #[test]
    fn curvature_is_the_second_difference_and_slope_the_absolute_first() {
        assert_eq!(Descriptor::Curvature.features(&touch()).as_slice(), [80_000, 20_000]);
    }

    #[test]
    fn gravity_and_oriented_append_the_pose() {
        assert_eq!(Descriptor::Gravity.features(&touch()).as_slice(), [80_000, 20_000, 3, 6]);
        assert_eq!(Descriptor::Oriented.features(&touch()).as_slice(), [80_000, 20_000, 1, 2, 3, -4, 5, 6]);
    }

    #[test]
    fn every_descriptor_but_times_is_blind_to_mirroring() {
        let level = Touch::from_micros([7, 0, 7]).with_pose(Pose { direction: [1, 2, 3], alignment: [0, -5, 6] });
        let partial = Touch::new([ContactTime::MISSING, ContactTime::FIRST, ContactTime::from_micros(9)]);
        for descriptor in [Descriptor::Curvature, Descriptor::Gravity, Descriptor::Oriented] {
            for touch in [touch(), level, partial] {
                assert_eq!(descriptor.features(&touch), descriptor.features(&touch.mirrored()));
            }
        }
    }

    #[test]
    fn missing_contacts_leave_features_missing() {
        let partial = Touch::new([ContactTime::FIRST, ContactTime::MISSING, ContactTime::from_micros(9)]);
        assert_eq!(Descriptor::Times.features(&partial).as_slice(), [0, MISSING_FEATURE, 9]);
        assert_eq!(Descriptor::Curvature.features(&partial).as_slice(), [MISSING_FEATURE, 9]);
        let no_pose: Vec<i32> = Descriptor::Gravity.features(&partial).as_slice().to_vec();
        assert_eq!(no_pose, [MISSING_FEATURE, 9, MISSING_FEATURE, MISSING_FEATURE]);
    }

    #[test]
    fn features_are_clamped_to_what_f32_holds_exactly() {
        let slow = Touch::from_micros([0, u32::MAX - 1, 0]);
        assert_eq!(Descriptor::Curvature.features(&slow).as_slice(), [-FEATURE_LIMIT, 0]);
        assert_eq!(FEATURE_LIMIT as f32 as i32, FEATURE_LIMIT);
    }

    #[test]
    fn names_and_codes_find_their_descriptor() {
        for descriptor in Descriptor::ALL {
            assert_eq!(Descriptor::from_name(descriptor.name()), Some(descriptor));
            assert_eq!(Descriptor::from_code(descriptor.code()), Some(descriptor));
            assert_eq!(descriptor.features(&touch()).as_slice().len(), descriptor.feature_count());
        }
        assert_eq!(Descriptor::from_code(9), None);
    }
}
