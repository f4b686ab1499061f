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

/// A byte is this much more than the value that it stands for.
pub(crate) const BIAS: i32 = 128;

impl Sum<'_> {
    /// Bytes of a leaf in the present group.
    pub(crate) fn leaf_length(&self) -> usize {
        self.leaf.size() * if self.object.is_some() { 1 } else { self.margins.len() }
    }

    /// Adds one leaf; bytes with their bias.
    ///
    /// Cost: eight instructions a value, and 15.
    pub(crate) fn add(&mut self, leaf: &[u8]) {
        let leaf_type = self.leaf;
        let margins = self.of_group();
        match leaf_type {
            LeafType::I8 => add_values(margins, leaf, add_i8),
            LeafType::I16 => add_values(margins, leaf, add_i16),
            LeafType::F32 => add_f32_leaves(margins, leaf, &[0]),
        }
    }

    /// Adds the leaves with these numbers; bytes with their bias.
    ///
    /// Cost: four or five instructions a value and twelve a leaf.
    pub(crate) fn add_reached(&mut self, leaves: &[u8], reached: &[u16]) {
        let leaf_type = self.leaf;
        let margins = self.of_group();
        match leaf_type {
            LeafType::I8 => add_i8_leaves(margins, leaves, reached),
            LeafType::I16 => add_i16_leaves(margins, leaves, reached),
            LeafType::F32 => add_f32_leaves(margins, leaves, reached),
        }
    }

    /// Takes the bias of `count` leaves off, or says how much it is where every object has it.
    pub(crate) fn settle(&mut self, count: u32) -> i32 {
        let bias = if self.leaf == LeafType::I8 { BIAS.wrapping_mul(count.cast_signed()) } else { 0 };
        if self.object.is_none() {
            return bias;
        }
        self.of_group().iter_mut().for_each(|margin| *margin = margin.wrapping_sub(bias));
        0
    }

    /// The margins that leaves of the present group add to.
    fn of_group(&mut self) -> &mut [i32] {
        match self.object {
            Some(object) => self.margins.get_mut(usize::from(object)..=usize::from(object)).unwrap_or_default(),
            None => self.margins,
        }
    }
}

fn add_i8(sum: i32, [value]: [u8; 1]) -> i32 {
    sum.wrapping_add(i32::from(value))
}

fn add_i16(sum: i32, value: [u8; 2]) -> i32 {
    sum.wrapping_add(i32::from(i16::from_le_bytes(value)))
}

fn add_values<const SIZE: usize>(margins: &mut [i32], leaf: &[u8], add: impl Fn(i32, [u8; SIZE]) -> i32) {
    for (margin, value) in margins.iter_mut().zip(leaf.as_chunks().0) {
        *margin = add(*margin, *value);
    }
}

#[inline(never)]
fn add_i8_leaves(margins: &mut [i32], leaves: &[u8], reached: &[u16]) {
    add_leaves(margins, leaves, reached, add_i8, add_ten_i8);
}

#[inline(never)]
fn add_i16_leaves(margins: &mut [i32], leaves: &[u8], reached: &[u16]) {
    add_leaves(margins, leaves, reached, add_i16, add_ten_i16);
}

/// Whether the chip loads words from anywhere (Cortex-M3 and up: the same that have atomic operations), and takes them
/// apart while it adds; a Cortex-M0+ puts words together byte by byte.
const WORDS: bool = cfg!(target_has_atomic = "32");

#[inline(always)]
fn add_ten_i8(margins: &mut [i32; 10], values: &[u8; 10]) {
    let (&[first, second], &[s, t]) = values.as_chunks() else { return };
    let &[k, l, m, n, o, p, q, r, ..] = values;
    let (first, second) = (u32::from_le_bytes(first), u32::from_le_bytes(second));
    let byte = |word: u32, shift: u32, alone: u8| {
        if WORDS { (word >> shift & 0xff).cast_signed() } else { i32::from(alone) }
    };
    let [a, b, c, d, e, f, g, h, i, j] = margins;
    *a = a.wrapping_add(byte(first, 0, k));
    *b = b.wrapping_add(byte(first, 8, l));
    *c = c.wrapping_add(byte(first, 16, m));
    *d = d.wrapping_add(byte(first, 24, n));
    *e = e.wrapping_add(byte(second, 0, o));
    *f = f.wrapping_add(byte(second, 8, p));
    *g = g.wrapping_add(byte(second, 16, q));
    *h = h.wrapping_add(byte(second, 24, r));
    *i = i.wrapping_add(i32::from(s));
    *j = j.wrapping_add(i32::from(t));
}

#[inline(always)]
fn add_ten_i16([a, b, c, d, e, f, g, h, i, j]: &mut [i32; 10], values: &[u8; 20]) {
    let (&[v, w, x, y, z], _) = values.as_chunks() else { return };
    let add = |even: &mut i32, odd: &mut i32, word: [u8; 4]| {
        let word = i32::from_le_bytes(word);
        *even = even.wrapping_add(word << 16 >> 16);
        *odd = odd.wrapping_add(word >> 16);
    };
    add(a, b, v);
    add(c, d, w);
    add(e, f, x);
    add(g, h, y);
    add(i, j, z);
}

#[cfg(feature = "f32-leaves")]
fn add_f32(sum: i32, value: [u8; 4]) -> i32 {
    (f32::from_bits(sum.cast_unsigned()) + f32::from_le_bytes(value)).to_bits().cast_signed()
}

#[cfg(feature = "f32-leaves")]
#[inline(never)]
fn add_f32_leaves(margins: &mut [i32], leaves: &[u8], reached: &[u16]) {
    add_leaves(margins, leaves, reached, add_f32, |margins, values: &[u8; 40]| {
        let (values, _) = values.as_chunks();
        margins.iter_mut().zip(values).for_each(|(margin, value)| *margin = add_f32(*margin, *value));
    });
}

/// Models with f32 leaves are refused when they are opened.
#[cfg(not(feature = "f32-leaves"))]
const fn add_f32_leaves(_: &mut [i32], _: &[u8], _: &[u16]) {}

/// Adds leaves with a value for each of `margins`, ten objects (`TEN` bytes) at a time.
#[inline(always)]
fn add_leaves<const SIZE: usize, const TEN: usize>(
    mut margins: &mut [i32],
    mut leaves: &[u8],
    reached: &[u16],
    add: impl Fn(i32, [u8; SIZE]) -> i32 + Copy,
    add_ten: impl Fn(&mut [i32; 10], &[u8; TEN]) + Copy,
) {
    // As two bytes: then the compiler sees that ends of leaves cannot overflow.
    let length = usize::from(u16::try_from(margins.len() * SIZE).unwrap_or(0));
    while margins.len() >= 10 {
        let Some((ten, rest)) = core::mem::take(&mut margins).split_first_chunk_mut() else { return };
        for &leaf in reached {
            let start = usize::from(leaf) * length;
            let Some(values) = leaves.get(start..start + TEN).and_then(<[_]>::first_chunk) else { return };
            add_ten(ten, values);
        }
        leaves = leaves.get(TEN..).unwrap_or_default();
        margins = rest;
    }
    for margin in margins {
        let mut sum = *margin;
        for &leaf in reached {
            let start = usize::from(leaf) * length;
            let Some(&value) = leaves.get(start..start + SIZE).and_then(<[_]>::first_chunk) else { return };
            sum = add(sum, value);
        }
        *margin = sum;
        leaves = leaves.get(SIZE..).unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_of_every_type_keep_their_sign() {
        let mut margins = [0, 5];
        let mut sum = Sum { margins: &mut margins, leaf: LeafType::I8, object: None };
        sum.add(&[0, 255]);
        let bias = sum.settle(1);
        sum.leaf = LeafType::I16;
        sum.add(&[0x00, 0x80, 0xff, 0x7f]);
        sum.object = Some(1);
        sum.add(&[0xff, 0xff]);
        sum.object = Some(9);
        sum.add(&[1, 0]);
        sum.settle(1);
        assert_eq!(margins, [bias - 128 - 32768, bias + 5 + 127 + 32767 - 1]);
    }

    #[test]
    fn leaves_of_any_number_of_values_are_added_value_by_value() {
        for objects in 1..23_usize {
            let leaves: std::vec::Vec<u8> = (0..4 * 2 * objects).map(|i| (i * 37 % 251) as u8).collect();
            let mut margins = std::vec![7; objects];
            Sum { margins: &mut margins, leaf: LeafType::I16, object: None }.add_reached(&leaves, &[2, 0, 3]);
            for (object, margin) in margins.iter().enumerate() {
                let value = |leaf: usize| {
                    let at = 2 * (leaf * objects + object);
                    i32::from(i16::from_le_bytes([leaves[at], leaves[at + 1]]))
                };
                assert_eq!(*margin, 7 + value(2) + value(0) + value(3));
            }
        }
    }
}
