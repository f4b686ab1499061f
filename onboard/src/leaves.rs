//! Adding up leaves.

use palpate_shared::format::LeafType;

/// Margins under construction, in units (integer leaves) or as the bits of f32 values.
pub(crate) struct Sum<'a> {
    /// One for each object.
    pub(crate) margins: &'a mut [i32],
    /// What leaves are stored as.
    pub(crate) leaf: LeafType,
    /// The object that leaves of the present group are for; `None` when they have a value for each.
    pub(crate) object: Option<u8>,
}

impl Sum<'_> {
    /// Bytes of a leaf in the present group.
    pub(crate) fn leaf_length(&self) -> usize {
        self.leaf.size() * if self.object.is_some() { 1 } else { self.margins.len() }
    }

    /// Adds one leaf.
    pub(crate) fn add(&mut self, leaf: &[u8]) {
        let leaf_type = self.leaf;
        let margins = self.of_group();
        match leaf_type {
            LeafType::I8 => add_values(margins, leaf, add_i8),
            LeafType::I16 => add_values(margins, leaf, add_i16),
            LeafType::F32 => add_values(margins, leaf, add_f32),
        }
    }

    /// Adds the leaf that was reached in each of some trees of 2^`depth` leaves.
    pub(crate) fn add_complete(&mut self, depth: u8, leaves: &[u8], reached: &[u8]) {
        let each = self.object.is_none();
        let leaf_type = self.leaf;
        let margins = self.of_group();
        if each {
            match leaf_type {
                LeafType::I8 => add_each(margins, depth, leaves, reached, add_i8),
                LeafType::I16 => add_each(margins, depth, leaves, reached, add_i16),
                LeafType::F32 => add_each(margins, depth, leaves, reached, add_f32),
            }
        } else if let Some(margin) = margins.first_mut() {
            *margin = match leaf_type {
                LeafType::I8 => add_one(*margin, depth, leaves, reached, add_i8),
                LeafType::I16 => add_one(*margin, depth, leaves, reached, add_i16),
                LeafType::F32 => add_one(*margin, depth, leaves, reached, add_f32),
            };
        }
    }

    /// The margins that leaves of the present group add to.
    fn of_group(&mut self) -> &mut [i32] {
        match self.object {
            Some(object) => self.margins.get_mut(usize::from(object)..=usize::from(object)).unwrap_or_default(),
            None => self.margins,
        }
    }
}

fn add_i8(sum: i32, value: [u8; 1]) -> i32 {
    sum.wrapping_add(i32::from(i8::from_le_bytes(value)))
}

fn add_i16(sum: i32, value: [u8; 2]) -> i32 {
    sum.wrapping_add(i32::from(i16::from_le_bytes(value)))
}

#[cfg(feature = "f32-leaves")]
fn add_f32(sum: i32, value: [u8; 4]) -> i32 {
    (f32::from_bits(sum.cast_unsigned()) + f32::from_le_bytes(value)).to_bits().cast_signed()
}

/// Models with f32 leaves are refused when they are opened.
#[cfg(not(feature = "f32-leaves"))]
const fn add_f32(sum: i32, _: [u8; 4]) -> i32 {
    sum
}

fn add_values<const SIZE: usize>(margins: &mut [i32], leaf: &[u8], add: impl Fn(i32, [u8; SIZE]) -> i32) {
    for (margin, value) in margins.iter_mut().zip(leaf.as_chunks().0) {
        *margin = add(*margin, *value);
    }
}

fn add_each<const SIZE: usize>(
    margins: &mut [i32],
    depth: u8,
    leaves: &[u8],
    reached: &[u8],
    add: impl Fn(i32, [u8; SIZE]) -> i32,
) {
    let values = margins.len();
    let mut first = 0;
    let (leaves, _) = leaves.as_chunks();
    for &leaf in reached {
        let row = (first + usize::from(leaf)) * values;
        if let Some(row) = leaves.get(row..).and_then(|row| row.get(..values)) {
            for (margin, value) in margins.iter_mut().zip(row) {
                *margin = add(*margin, *value);
            }
        }
        first += 1 << depth;
    }
}

fn add_one<const SIZE: usize>(
    margin: i32,
    depth: u8,
    leaves: &[u8],
    reached: &[u8],
    add: impl Fn(i32, [u8; SIZE]) -> i32,
) -> i32 {
    let (leaves, _) = leaves.as_chunks();
    let mut sum = margin;
    let mut first = 0;
    for &leaf in reached {
        if let Some(&value) = leaves.get(first + usize::from(leaf)) {
            sum = add(sum, value);
        }
        first += 1 << depth;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_of_every_type_keep_their_sign() {
        let mut margins = [0, 5];
        let mut sum = Sum { margins: &mut margins, leaf: LeafType::I8, object: None };
        sum.add(&[0x80, 0x7f]);
        sum.leaf = LeafType::I16;
        sum.add(&[0x00, 0x80, 0xff, 0x7f]);
        sum.object = Some(1);
        sum.add(&[0xff, 0xff]);
        sum.object = Some(9);
        sum.add(&[1, 0]);
        assert_eq!(margins, [-128 - 32768, 5 + 127 + 32767 - 1]);
    }
}
