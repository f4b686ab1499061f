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

    /// Adds the leaves with these numbers.
    pub(crate) fn add_complete(&mut self, leaves: &[u8], reached: &[u16]) {
        let each = self.object.is_none();
        let leaf_type = self.leaf;
        let margins = self.of_group();
        if each {
            match leaf_type {
                LeafType::I8 => add_each_i8(margins, leaves, reached),
                LeafType::I16 => add_each(margins, leaves, reached, add_i16),
                LeafType::F32 => add_each(margins, leaves, reached, add_f32),
            }
        } else if let Some(margin) = margins.first_mut() {
            *margin = match leaf_type {
                LeafType::I8 => add_reached(*margin, leaves.as_chunks().0, reached, 1, add_i8),
                LeafType::I16 => add_reached(*margin, leaves.as_chunks().0, reached, 1, add_i16),
                LeafType::F32 => add_reached(*margin, leaves.as_chunks().0, reached, 1, add_f32),
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

/// A byte is 128 more than its value.
fn add_i8(sum: i32, [value]: [u8; 1]) -> i32 {
    sum.wrapping_add(i32::from(value) - 128)
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

/// Adds the leaves that were reached, a few objects at a time.
fn add_each<const SIZE: usize>(
    margins: &mut [i32],
    leaves: &[u8],
    reached: &[u16],
    add: impl Fn(i32, [u8; SIZE]) -> i32 + Copy,
) {
    let (mut leaves, _) = leaves.as_chunks();
    let row = margins.len();
    let (fives, rest) = margins.as_chunks_mut();
    for margins in fives {
        *margins = add_five(*margins, leaves, reached, row, add);
        leaves = leaves.get(5..).unwrap_or_default();
    }
    for margin in rest {
        *margin = add_reached(*margin, leaves, reached, row, add);
        leaves = leaves.get(1..).unwrap_or_default();
    }
}

/// As [`add_each`], ten objects at a time as pairs of 16-bit sums: half the registers, and a word a load.
fn add_each_i8(margins: &mut [i32], leaves: &[u8], reached: &[u16]) {
    let row = margins.len();
    let mut values = leaves;
    let (tens, rest) = margins.as_chunks_mut();
    for margins in tens {
        for block in reached.chunks(PACKED) {
            add_ten(margins, values, block, row);
        }
        values = values.get(10..).unwrap_or_default();
    }
    let (fives, rest) = rest.as_chunks_mut();
    for margins in fives {
        *margins = add_five(*margins, values.as_chunks().0, reached, row, add_i8);
        values = values.get(5..).unwrap_or_default();
    }
    for margin in rest {
        *margin = add_reached(*margin, values.as_chunks().0, reached, row, add_i8);
        values = values.get(1..).unwrap_or_default();
    }
}

/// As many bytes as 16 bits can add up.
const PACKED: usize = 256;

/// Adds ten objects' values of the leaves that were reached, at most [`PACKED`]. Bytes are 128 more than their
/// values, so they add up without a sign, two sums to a word.
#[inline(never)]
fn add_ten(margins: &mut [i32; 10], leaves: &[u8], reached: &[u16], row: usize) {
    const EVEN: u32 = 0x00ff_00ff;
    // Sums of whole words, and of every other byte: their difference is the rest, and no word is taken apart twice.
    let (mut abcd, mut bd, mut efgh, mut fh, mut i, mut j) = (0_u32, 0_u32, 0_u32, 0_u32, 0_u32, 0_u32);
    for &leaf in reached {
        let Some(values) = leaves.get(usize::from(leaf) * row..).and_then(<[_]>::first_chunk::<10>) else { break };
        // Taken as words: byte by byte the compiler would load them so.
        let ([first, second], rest) = values.as_chunks::<4>() else { break };
        let Some(&[v8, v9]) = rest.first_chunk() else { break };
        let word = u32::from_le_bytes(*first);
        abcd = abcd.wrapping_add(word);
        bd = bd.wrapping_add(word >> 8 & EVEN);
        let word = u32::from_le_bytes(*second);
        efgh = efgh.wrapping_add(word);
        fh = fh.wrapping_add(word >> 8 & EVEN);
        i = i.wrapping_add(u32::from(v8));
        j = j.wrapping_add(u32::from(v9));
    }
    let ac = abcd.wrapping_sub(bd << 8);
    let eg = efgh.wrapping_sub(fh << 8);
    let bias = i32::try_from(reached.len()).unwrap_or(0).wrapping_mul(128);
    let sums =
        [low(ac), low(bd), high(ac), high(bd), low(eg), low(fh), high(eg), high(fh), i.cast_signed(), j.cast_signed()];
    for (margin, sum) in margins.iter_mut().zip(sums) {
        *margin = margin.wrapping_add(sum).wrapping_sub(bias);
    }
}

/// The sum in the lower half of a word.
fn low(pair: u32) -> i32 {
    (pair & 0xffff).cast_signed()
}

/// The sum in the upper half of a word.
fn high(pair: u32) -> i32 {
    (pair >> 16).cast_signed()
}

/// Adds five objects' values of the leaves that were reached. Not inlined, so that the sums stay in registers.
#[inline(never)]
fn add_five<const SIZE: usize>(
    [mut a, mut b, mut c, mut d, mut e]: [i32; 5],
    leaves: &[[u8; SIZE]],
    reached: &[u16],
    row: usize,
    add: impl Fn(i32, [u8; SIZE]) -> i32,
) -> [i32; 5] {
    for &leaf in reached {
        let Some(values) = leaves.get(usize::from(leaf) * row..).and_then(<[_]>::first_chunk) else { break };
        let [v, w, x, y, z] = *values;
        (a, b, c, d, e) = (add(a, v), add(b, w), add(c, x), add(d, y), add(e, z));
    }
    [a, b, c, d, e]
}

/// Adds one object's values of the leaves that were reached.
#[inline(never)]
fn add_reached<const SIZE: usize>(
    margin: i32,
    leaves: &[[u8; SIZE]],
    reached: &[u16],
    row: usize,
    add: impl Fn(i32, [u8; SIZE]) -> i32,
) -> i32 {
    let mut sum = margin;
    for &leaf in reached {
        let Some(&value) = leaves.get(usize::from(leaf) * row) else { break };
        sum = add(sum, value);
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
        sum.add(&[0, 255]);
        sum.leaf = LeafType::I16;
        sum.add(&[0x00, 0x80, 0xff, 0x7f]);
        sum.object = Some(1);
        sum.add(&[0xff, 0xff]);
        sum.object = Some(9);
        sum.add(&[1, 0]);
        assert_eq!(margins, [-128 - 32768, 5 + 127 + 32767 - 1]);
    }
}
