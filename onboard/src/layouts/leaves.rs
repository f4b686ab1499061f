//! Adding up leaves.

use super::built_in;
use core::sync::atomic::{Ordering, compiler_fence};
use palpate_shared::format::{LeafType, SharedLeaves};

/// Leaves of a table that are kept before they are added together.
pub(crate) const BLOCK: usize = 64;

/// Margins under construction, in units (integer leaves) or as the bits of f32 values.
pub(crate) struct Sum<'a> {
    /// One for each object.
    pub(crate) margins: &'a mut [i32],
    /// Type that leaves are stored as.
    pub(crate) leaf: LeafType,
    /// The object that leaves of the present group are for; `None` when they have a value for each.
    pub(crate) object: Option<u8>,
    /// The table that leaves are numbers of; always `None` where none is [built in](built_in::SHARED_LEAVES).
    pub(crate) shared: Option<SharedLeaves<'a>>,
}

/// Difference between a stored byte and its value.
pub(crate) const BIAS: i32 = 128;

impl<'a> Sum<'a> {
    /// Bytes of a leaf in the present group.
    pub(crate) fn leaf_length(&self) -> usize {
        self.leaf.size() * if self.object.is_some() { 1 } else { self.margins.len() }
    }

    /// Bytes that stand for a leaf of the present group where the trees' leaves are.
    pub(crate) fn stored_length(&self) -> usize {
        self.shared().map_or_else(|| self.leaf_length(), |shared| shared.number_length())
    }

    /// The table that leaves are numbers of.
    #[inline(always)]
    pub(crate) fn shared(&self) -> Option<SharedLeaves<'a>> {
        self.shared.filter(|_| built_in::SHARED_LEAVES)
    }

    /// Adds one leaf; bytes with their bias.
    ///
    /// Cost: a few instructions for each value.
    pub(crate) fn add(&mut self, leaf: &[u8]) {
        let leaf_type = self.leaf;
        let margins = self.of_group();
        match leaf_type {
            LeafType::I8 if built_in::leaf(LeafType::I8) => add_values(margins, leaf, add_i8),
            LeafType::I16 if built_in::leaf(LeafType::I16) => add_values(margins, leaf, add_i16),
            LeafType::F32 if built_in::leaf(LeafType::F32) => {
                let length = short(leaf.len());
                add_f32_leaves(margins, &Reached { leaves: leaf, reached: &[0], length });
            }
            // Refused when the model was opened.
            _ => {}
        }
    }

    /// Adds the leaves with these numbers, of `length` bytes each; bytes with their bias.
    ///
    /// Cost: a few instructions for each value and each leaf.
    pub(crate) fn add_reached(&mut self, leaves: &[u8], reached: &[u16], length: usize) {
        let leaf_type = self.leaf;
        let margins = self.of_group();
        let reached = Reached { leaves, reached, length: short(length) };
        match leaf_type {
            LeafType::I8 if built_in::leaf(LeafType::I8) => add_i8_leaves(margins, &reached),
            LeafType::I16 if built_in::leaf(LeafType::I16) => add_i16_leaves(margins, &reached),
            LeafType::F32 if built_in::leaf(LeafType::F32) => add_f32_leaves(margins, &reached),
            // Refused when the model was opened.
            _ => {}
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

/// The leaves of a block of trees, and which of them are reached.
struct Reached<'a, T = u8> {
    leaves: &'a [T],
    /// Numbers of leaves.
    reached: &'a [u16],
    /// Bytes, or values, of a leaf.
    length: u16,
}

/// The length of a leaf, which is no more than 1,024 bytes.
#[inline(always)]
fn short(length: usize) -> u16 {
    let [a, b, ..] = length.to_le_bytes();
    u16::from_le_bytes([a, b])
}

impl<'a, T> Reached<'a, T> {
    /// Hands `SIZE` bytes or values of each leaf that is reached, from number `from` of a leaf on, to `each`.
    #[inline(always)]
    fn each<const SIZE: usize>(&self, from: usize, mut each: impl FnMut(&'a [T; SIZE])) {
        let leaves = self.leaves.get(from..).unwrap_or_default();
        for &leaf in self.reached {
            let Some(values) = self.values(leaves, leaf) else { break };
            each(values);
        }
    }

    #[inline(always)]
    fn values<const SIZE: usize>(&self, leaves: &'a [T], leaf: u16) -> Option<&'a [T; SIZE]> {
        // As two bytes: then the compiler sees that ends of leaves cannot overflow.
        let start = usize::from(leaf) * usize::from(self.length);
        leaves.get(start..start + SIZE)?.first_chunk()
    }
}

/// True if the chip loads words from anywhere, and has registers for sums (Cortex-M3 and up: the same that have atomic
/// operations). A Cortex-M0+ puts words together byte by byte, and adds to margins in memory.
const WORDS: bool = cfg!(target_has_atomic = "32");

/// Adds values of `SIZE` bytes, those of `FEW` objects (`BYTES` bytes) together, the last ones object by object.
#[inline(always)]
fn add_leaves<T: Copy, const SIZE: usize, const FEW: usize, const BYTES: usize>(
    mut margins: &mut [i32],
    reached: &Reached<'_, T>,
    add: impl Fn(i32, [T; SIZE]) -> i32,
    add_few: impl Fn(&mut [i32; FEW], usize),
) {
    let mut from = 0;
    while margins.len() >= FEW {
        let Some((few, rest)) = core::mem::take(&mut margins).split_first_chunk_mut() else { return };
        add_few(few, from);
        from += BYTES;
        margins = rest;
    }
    add_last(margins, reached, from, add);
}

/// Adds values of `SIZE` bytes, from number `from` of a leaf on, object by object.
#[inline(always)]
fn add_last<T: Copy, const SIZE: usize>(
    margins: &mut [i32],
    reached: &Reached<'_, T>,
    mut from: usize,
    add: impl Fn(i32, [T; SIZE]) -> i32,
) {
    for margin in margins {
        let mut sum = *margin;
        reached.each(from, |value| sum = add(sum, *value));
        *margin = sum;
        from += SIZE;
    }
}

#[cfg_attr(target_has_atomic = "32", inline(always))]
#[cfg_attr(not(target_has_atomic = "32"), inline(never))]
fn add_i8_leaves(margins: &mut [i32], reached: &Reached<'_>) {
    if WORDS {
        add_leaves::<_, 1, 10, 10>(margins, reached, add_i8, |ten, from| add_ten_i8(ten, reached, from));
    } else {
        add_i8_in_memory(margins, reached);
    }
}

#[inline(always)]
fn add_i8_in_memory(margins: &mut [i32], reached: &Reached<'_>) {
    add_leaves::<_, 1, 10, 10>(margins, reached, add_i8, |ten, from| {
        reached.each(from, |values: &[u8; 10]| add_each(ten, values));
    });
}

/// Adds ten bytes of each leaf, from number `from` of a leaf on.
#[inline(always)]
fn add_ten_i8(margins: &mut [i32; 10], reached: &Reached<'_>, from: usize) {
    if reached.length == 10 {
        let (leaves, _) = reached.leaves.as_chunks();
        return add_whole_i8(margins, leaves, reached.reached);
    }
    let leaves = reached.leaves.get(from..).unwrap_or_default();
    add_lanes(margins, reached.reached.iter().map_while(|&leaf| reached.values(leaves, leaf)));
}

/// Adds leaves that have no more values: their numbers are indices, which takes fewer instructions.
#[inline(never)]
fn add_whole_i8(margins: &mut [i32; 10], leaves: &[[u8; 10]], reached: &[u16]) {
    add_lanes(margins, reached.iter().map_while(|&leaf| leaves.get(usize::from(leaf))));
}

/// Adds bytes in lanes of 16 bits, which hold a block of trees.
///
/// Every second byte of a word has a lane, which takes an instruction to cut out. The others are what is left of the sum of
/// whole words without those lanes.
#[inline(always)]
fn add_lanes<'v>(margins: &mut [i32; 10], leaves: impl Iterator<Item = &'v [u8; 10]>) {
    const { assert!(BLOCK <= 256) };
    const LANES: u32 = 0x00ff_00ff;
    let (mut a, mut b, mut c, mut d, mut e) = (0_u32, 0_u32, 0_u32, 0_u32, 0_u32);
    for values in leaves {
        let (&[first, second], third) = values.as_chunks() else { return };
        let (first, second) = (u32::from_le_bytes(first), u32::from_le_bytes(second));
        // As a number at once: two bytes would take a register more.
        let third = third.first_chunk().map_or(0, |third| u16::from_le_bytes(*third).into());
        a = a.wrapping_add(first);
        b = b.wrapping_add(first >> 8 & LANES);
        c = c.wrapping_add(second);
        d = d.wrapping_add(second >> 8 & LANES);
        e = e.wrapping_add((third | third << 8) & LANES);
    }
    let (a, c) = (a.wrapping_sub(b << 8), c.wrapping_sub(d << 8));
    let [f, g, h, i, j, k, l, m, n, o] = margins;
    let add = |low: &mut i32, high: &mut i32, lanes: u32| {
        *low = low.wrapping_add((lanes & 0xffff).cast_signed());
        *high = high.wrapping_add((lanes >> 16).cast_signed());
    };
    add(f, h, a);
    add(g, i, b);
    add(j, l, c);
    add(k, m, d);
    add(n, o, e);
}

/// Adds a leaf to margins in memory.
#[inline(always)]
fn add_each<T: Copy + Into<i32>>([a, b, c, d, e, f, g, h, i, j]: &mut [i32; 10], values: &[T; 10]) {
    // Otherwise the compiler keeps a copy of each on the stack. No instruction.
    compiler_fence(Ordering::SeqCst);
    let add = |margin: &mut i32, value: &T| *margin = margin.wrapping_add((*value).into());
    let [k, l, m, n, o, p, q, r, s, t] = values;
    add(a, k);
    add(b, l);
    add(c, m);
    add(d, n);
    add(e, o);
    add(f, p);
    add(g, q);
    add(h, r);
    add(i, s);
    add(j, t);
}

#[inline(never)]
fn add_i16_leaves(margins: &mut [i32], reached: &Reached<'_>) {
    if WORDS {
        add_leaves::<_, 2, 5, 10>(margins, reached, add_i16, |five, from| add_five_i16(five, reached, from));
    } else {
        add_i16_in_memory(margins, reached);
    }
}

/// Loads values at once where they are aligned.
#[inline(always)]
fn add_i16_in_memory(margins: &mut [i32], reached: &Reached<'_>) {
    if let Ok(leaves) = bytemuck::try_cast_slice(reached.leaves) {
        let reached = Reached { leaves, reached: reached.reached, length: short(margins.len()) };
        let add = |sum: i32, [value]: [i16; 1]| sum.wrapping_add(i16::from_le(value).into());
        add_leaves::<_, 1, 10, 10>(margins, &reached, add, |ten, from| {
            reached.each(from, |values: &[i16; 10]| add_each(ten, values));
        });
    } else {
        add_last(margins, reached, 0, add_i16);
    }
}

#[inline(always)]
fn add_five_i16(five: &mut [i32; 5], reached: &Reached<'_>, from: usize) {
    let [mut a, mut b, mut c, mut d, mut e] = *five;
    reached.each(from, |values: &[u8; 10]| {
        let (&[first, second], &[q, r]) = values.as_chunks() else { return };
        let (first, second) = (i32::from_le_bytes(first), i32::from_le_bytes(second));
        a = a.wrapping_add(first << 16 >> 16);
        b = b.wrapping_add(first >> 16);
        c = c.wrapping_add(second << 16 >> 16);
        d = d.wrapping_add(second >> 16);
        e = add_i16(e, [q, r]);
    });
    *five = [a, b, c, d, e];
}

#[cfg(feature = "f32-leaves")]
fn add_f32(sum: i32, value: [u8; 4]) -> i32 {
    (f32::from_bits(sum.cast_unsigned()) + f32::from_le_bytes(value)).to_bits().cast_signed()
}

#[cfg(feature = "f32-leaves")]
#[inline(never)]
fn add_f32_leaves(margins: &mut [i32], reached: &Reached<'_>) {
    add_leaves::<_, 4, 5, 20>(margins, reached, add_f32, |five, from| {
        reached.each::<20>(from, |values| {
            let (values, _) = values.as_chunks();
            five.iter_mut().zip(values).for_each(|(margin, value)| *margin = add_f32(*margin, *value));
        });
    });
}

/// Models with f32 leaves are refused when they are opened.
#[cfg(not(feature = "f32-leaves"))]
const fn add_f32_leaves(_: &mut [i32], _: &Reached<'_>) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_of_every_type_keep_their_sign() {
        let mut margins = [0, 5];
        let mut sum = Sum { margins: &mut margins, leaf: LeafType::I8, object: None, shared: None };
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
    fn a_chip_without_registers_for_sums_adds_the_same_aligned_or_not() {
        for objects in 1..23_usize {
            let values: std::vec::Vec<i16> = (0..4 * objects + 1).map(|i| (i * 7919 % 65_521) as i16).collect();
            let bytes: std::vec::Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            let shifted = [&[0; 1], &*bytes].concat();
            let reached = |leaves, length| Reached { leaves, reached: &[2, 0, 3, 3], length: short(length) };
            let sums = |add: &dyn Fn(&mut [i32])| {
                let mut margins = std::vec![7; objects];
                add(&mut margins);
                margins
            };
            let expected = sums(&|margins| add_i16_leaves(margins, &reached(&bytes, 2 * objects)));
            assert_eq!(sums(&|margins| add_i16_in_memory(margins, &reached(&bytes, 2 * objects))), expected);
            assert_eq!(sums(&|margins| add_i16_in_memory(margins, &reached(&shifted[1..], 2 * objects))), expected);
            let expected = sums(&|margins| add_i8_leaves(margins, &reached(&bytes, objects)));
            assert_eq!(sums(&|margins| add_i8_in_memory(margins, &reached(&bytes, objects))), expected);
        }
    }

    #[test]
    fn leaves_of_any_number_of_values_are_added_value_by_value() {
        for objects in 1..23_usize {
            let leaves: std::vec::Vec<u8> = (0..4 * 2 * objects).map(|i| (i * 37 % 251) as u8).collect();
            let mut margins = std::vec![7; objects];
            Sum { margins: &mut margins, leaf: LeafType::I16, object: None, shared: None }.add_reached(
                &leaves,
                &[2, 0, 3],
                2 * objects,
            );
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
