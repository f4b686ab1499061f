//! A plan of approaches: how well every pose of the probe distinguishes every pair of objects.

use crate::poses::Poses;

/// A plan of approaches, read in place: for each pose of the probe and each two objects their *separation*, 1 − the mean
/// of e^(−evidence/2) of an approach in this pose, evidence being that for the object that is touched against the other
/// one, in nats; of the two objects, the one with the smaller separation counts. It is 1 minus the Bhattacharyya
/// coefficient (Bhattacharyya 1943) as far as the model knows the distributions: 0 where an approach says nothing, 1 where
/// it says everything.
///
/// Separations are stored in 128ths as an i8, −127 to 127; −128 for every two objects: no approach in this pose touches
/// anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan<'a> {
    poses: Poses,
    /// Pair by pair, for each pose one.
    separations: &'a [u8],
}

impl<'a> Plan<'a> {
    /// Stored where no approach touches anything.
    pub const UNTOUCHED: i8 = i8::MIN;

    /// Bytes in front of the separations.
    pub const fn header(poses: Poses) -> [u8; 4] {
        [0, poses.rolls(), 0, 0]
    }

    /// Reads a section of a model with this many objects; `None` if there are fewer than two, if the poses are counted in
    /// another way than this crate knows, or if there are too few bytes. Bytes after the known ones are ignored.
    ///
    /// Cost: a few instructions. Cannot fail otherwise.
    pub fn from_bytes(bytes: &'a [u8], objects: usize) -> Option<Self> {
        let (&[kind, rolls, _, _], rest) = bytes.split_first_chunk::<4>()?;
        let poses = Poses::with_rolls(rolls).filter(|_| kind == 0)?;
        // `pairs`, without overflow: a model has at most 256 objects, which nine bits hold.
        let objects = objects & 0x1ff;
        let length = objects.wrapping_mul(objects.wrapping_sub(1)) / 2 * usize::from(poses.count());
        let separations = rest.get(..length).filter(|separations| !separations.is_empty())?;
        Some(Self { poses, separations })
    }

    /// Number of pairs of this many objects.
    pub const fn pairs(objects: usize) -> usize {
        // No model has more than 256, so nothing here needs 64 bits.
        let objects = if objects < 1 << 16 { objects } else { (1 << 16) - 1 };
        objects.wrapping_mul(objects.saturating_sub(1)) / 2
    }

    /// The number of a pair of two different objects: (0, 1), (0, 2), (1, 2), (0, 3) and so on, in any order of the two.
    pub(crate) const fn pair(a: usize, b: usize) -> usize {
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        Self::pairs(high).saturating_add(low)
    }

    /// The poses that it is over.
    pub const fn poses(&self) -> Poses {
        self.poses
    }

    /// The separations of two different objects in 128ths, for each pose one; none for objects that the model does not
    /// know.
    ///
    /// Cost: a few instructions. Cannot fail.
    pub fn separations(&self, a: usize, b: usize) -> &'a [u8] {
        let poses = usize::from(self.poses.count());
        let start = Self::pair(a, b).saturating_mul(poses);
        self.separations.get(start..start.saturating_add(poses)).unwrap_or_default()
    }

    /// True if an approach in the pose with this number may touch something.
    ///
    /// Cost: a few instructions. Cannot fail.
    pub fn may_touch(&self, pose: u16) -> bool {
        let known = pose < self.poses.count();
        known && self.separations.get(usize::from(pose)).is_some_and(|&byte| byte.cast_signed() != Self::UNTOUCHED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::tests::assert_refused;
    use std::vec::Vec;

    fn section(rolls: u8, objects: usize) -> Vec<u8> {
        let poses = Poses::with_rolls(rolls).unwrap();
        let mut bytes = Plan::header(poses).to_vec();
        let count = Plan::pairs(objects) * usize::from(poses.count());
        bytes.extend((0..count).map(|index| (index / usize::from(poses.count())) as u8));
        bytes
    }

    #[test]
    fn every_pair_has_its_separations_in_either_order() {
        for rolls in [1, 2, 4] {
            let bytes = section(rolls, 10);
            assert_eq!(bytes.len(), 4 + 45 * 26 * usize::from(rolls));
            let plan = Plan::from_bytes(&bytes, 10).unwrap();
            let mut number = 0;
            for high in 0..10 {
                for low in 0..high {
                    assert_eq!(Plan::pair(low, high), usize::from(number));
                    for separations in [plan.separations(low, high), plan.separations(high, low)] {
                        assert_eq!(separations.len(), usize::from(plan.poses().count()));
                        assert!(separations.iter().all(|&byte| byte == number));
                    }
                    number += 1;
                }
            }
            assert!(plan.separations(0, 10).is_empty() && plan.separations(usize::MAX, 0).is_empty());
        }
    }

    #[test]
    fn a_pose_that_never_touches_is_known_and_others_do_not_exist() {
        let mut bytes = section(1, 3);
        bytes[4 + 5] = Plan::UNTOUCHED.cast_unsigned();
        let plan = Plan::from_bytes(&bytes, 3).unwrap();
        let may_touch: Vec<u16> = (0..40).filter(|&pose| plan.may_touch(pose)).collect();
        assert_eq!(may_touch, (0..26).filter(|&pose| pose != 5).collect::<Vec<_>>());
    }

    #[test]
    fn sections_that_make_no_sense_are_refused_and_grown_ones_read() {
        let bytes = section(2, 4);
        assert!(Plan::from_bytes(&[&bytes[..], &[1, 2, 3]].concat(), 4).is_some());
        for length in [0, 3, 4, bytes.len() - 1] {
            assert_eq!(Plan::from_bytes(&bytes[..length], 4), None, "{length} bytes");
        }
        for objects in [0, 1, 5, 256, usize::MAX] {
            assert_eq!(Plan::from_bytes(&bytes, objects), None, "{objects} objects");
        }
        let wrong: [(usize, &[u8]); 5] = [(0, &[1]), (1, &[0]), (1, &[3]), (1, &[4]), (1, &[8])];
        assert_refused(&bytes, &wrong, |bytes| Plan::from_bytes(bytes, 4).is_some());
    }
}
