//! Models with splits of six bytes, made of those with three: the compiler writes them for large ensembles alone.

use crate::abuse::{places, sealed};
use palpate_shared::format::{Axis, Columns, Layout};

/// A compact model's trees with wide splits.
///
/// # Panics
/// If it is no compact model.
pub fn widened(model: &[u8]) -> Vec<u8> {
    let [_, _, axes, cuts, groups, splits, leaves, _] = places(model);
    let (mut columns, mut all, mut rest) = (Vec::new(), Vec::new(), &model[cuts..groups]);
    for axis in model[axes..cuts].as_chunks().0 {
        let axis = Axis::from_bytes(*axis).expect("an axis");
        let (own, after) = rest.split_at(axis.cuts_length());
        rest = after;
        let cuts: Vec<i32> = own.chunks(axis.width.into()).map(number).collect();
        all.extend_from_slice(&cuts);
        let sides: &[bool] = match axis.columns {
            Columns::MissingLeft => &[true],
            Columns::MissingRight => &[false],
            Columns::Both => &[true, false],
        };
        columns.extend(sides.iter().map(|&missing_left| (axis.feature, missing_left, cuts.clone())));
    }
    all.sort_unstable();
    all.dedup();
    let mut wide = Vec::new();
    let mut nodes = &model[splits..leaves];
    while let Some((count, rest)) = nodes.split_first_chunk() {
        wide.extend(count);
        let (own, rest) = rest.split_at(3 * usize::from(u16::from_le_bytes(*count)));
        nodes = rest;
        for &[column, at, left] in own.as_chunks().0 {
            let (feature, missing_left, cuts) = &columns[usize::from(column)];
            let number = all.partition_point(|cut| *cut < cuts[usize::from(at)]) as u16;
            wide.extend([*feature, u8::from(*missing_left)]);
            wide.extend(number.to_le_bytes());
            wide.extend([left, 0]);
        }
    }
    let thresholds: Vec<u8> = all.iter().flat_map(|cut| cut.to_le_bytes()).collect();
    let mut bytes = [&model[..axes], &thresholds, &model[groups..splits], &wide, &model[leaves..]].concat();
    bytes[6] = Layout::Wide.code();
    bytes[16..18].fill(0);
    for (at, length) in [(8, bytes.len()), (80, thresholds.len()), (84, wide.len())] {
        bytes[at..at + 4].copy_from_slice(&(length as u32).to_le_bytes());
    }
    sealed(bytes)
}

/// A signed number of one to four bytes.
fn number(bytes: &[u8]) -> i32 {
    let sign = if bytes.last().is_some_and(|byte| byte & 0x80 != 0) { 0xff } else { 0 };
    i32::from_le_bytes(std::array::from_fn(|index| bytes.get(index).copied().unwrap_or(sign)))
}
