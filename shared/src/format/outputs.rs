//! Outputs that belong together: several of one object, such as its placements.

/// The objects that a model's outputs belong to. Outputs of one object are neighbors. 4 bytes, and 4 for each output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs<'a> {
    most: u8,
    records: &'a [[u8; 4]],
}

impl<'a> Outputs<'a> {
    /// Hands the section's content to `put`: for each output the number of its object, and its share of the object's prior.
    pub fn write(outputs: impl Iterator<Item = (u8, f64)> + Clone, put: &mut impl FnMut(&[u8])) {
        let (mut most, mut count, mut last) = (0_u16, 0_u16, None);
        for (object, _) in outputs.clone() {
            count = if last == Some(object) { count.saturating_add(1) } else { 1 };
            (most, last) = (most.max(count), Some(object));
        }
        put(&[u8::try_from(most.saturating_sub(1)).unwrap_or(u8::MAX), 0, 0, 0]);
        for (object, share) in outputs {
            // A conversion saturates, and rounds down after half was added.
            let share = ((share * 65_536.0 + 0.5) as u32).clamp(1, 65_536) - 1;
            let [low, high, ..] = share.to_le_bytes();
            put(&[object, 0, low, high]);
        }
    }

    /// Reads a section of a model with this number of outputs; `None` if it is too short, objects are not numbered in the
    /// order of the outputs, or the largest number of outputs of an object is not the one stated. Bytes after those that are
    /// known are ignored.
    ///
    /// Cost: a few instructions for each output.
    pub fn from_bytes(content: &'a [u8], outputs: usize) -> Option<Self> {
        let found = Self::opened(content, outputs)?;
        let (mut before, mut count, mut most) = (0_u8, 0_u16, 0_u16);
        for &[object, ..] in found.records {
            count = match object.checked_sub(before) {
                Some(0) => count.saturating_add(1),
                Some(1) if count > 0 => 1,
                _ => return None,
            };
            (before, most) = (object, most.max(count));
        }
        (most == u16::from(found.most).saturating_add(1)).then_some(found)
    }

    /// Reopens a section that was checked.
    ///
    /// Cost: a few instructions.
    pub fn opened(content: &'a [u8], outputs: usize) -> Option<Self> {
        let (&[most, ..], rest) = content.split_first_chunk::<4>()?;
        Some(Self { most, records: rest.as_chunks().0.get(..outputs)? })
    }

    /// The largest number of outputs of an object: 1 to 256. Cost: a few instructions.
    pub const fn most(&self) -> u16 {
        self.most as u16 + 1
    }

    /// The number of the object that an output belongs to; `None` for an output that there is not. Cost: a few
    /// instructions.
    pub fn object(&self, output: usize) -> Option<u8> {
        self.records.get(output).map(|[object, ..]| *object)
    }

    /// The part of its object's prior that an output has, in Q16: 1 to 65,536. Cost: a few instructions.
    pub fn share(&self, output: usize) -> u32 {
        self.records.get(output).map_or(1, |&[_, _, low, high]| u32::from(u16::from_le_bytes([low, high])) + 1)
    }

    /// The numbers of the outputs' objects, in order.
    pub fn objects(self) -> impl Iterator<Item = u8> + 'a {
        self.records.iter().map(|[object, ..]| *object)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::tests::written;

    fn content(outputs: &[(u8, f64)]) -> std::vec::Vec<u8> {
        written(|put| Outputs::write(outputs.iter().copied(), put))
    }

    #[test]
    fn outputs_are_read_back() {
        let written = [(0, 0.75), (0, 0.25), (1, 1.0), (2, 1e-9), (2, 0.5), (2, 0.5)];
        let content = content(&written);
        let outputs = Outputs::from_bytes(&content, 6).unwrap();
        assert!(outputs.objects().eq(written.map(|(object, _)| object)));
        assert_eq!(outputs.most(), 3);
        assert_eq!(
            (0..7).map(|output| outputs.share(output)).collect::<std::vec::Vec<_>>(),
            [49_152, 16_384, 65_536, 1, 32_768, 32_768, 1]
        );
        assert_eq!((outputs.object(5), outputs.object(6)), (Some(2), None));
    }

    #[test]
    fn objects_out_of_order_and_wrong_counts_are_refused() {
        for objects in [&[1, 1][..], &[0, 2], &[0, 1, 0], &[0, 0, 1, 1, 3]] {
            let written: std::vec::Vec<(u8, f64)> = objects.iter().map(|&object| (object, 0.5)).collect();
            assert_eq!(Outputs::from_bytes(&content(&written), objects.len()), None, "{objects:?}");
        }
        let mut right = content(&[(0, 0.5), (0, 0.5), (1, 1.0)]);
        assert!(Outputs::from_bytes(&right, 3).is_some());
        assert_eq!(Outputs::from_bytes(&right[..15], 3), None);
        assert_eq!(Outputs::from_bytes(&right, 4), None);
        right[0] = 2;
        assert_eq!(Outputs::from_bytes(&right, 3), None);
    }
}
