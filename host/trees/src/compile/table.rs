//! The layouts without trees: a table of margins over two features, or one for each contact pattern.

use super::axes::{cuts_bytes, width};
use super::cells::Cells;
use super::cost::{Instructions, Shape, on_average};
use super::forest::Forest;
use super::parts::Parts;
use super::quantize::Scale;
use super::rounding::round_up;
use super::trees::Leaves;
use palpate_shared::format::{Axis, Columns, Layout, LeafType};

/// A table may have this many bytes.
const MAX_TABLE: usize = 1 << 24;

/// The table of a forest, if it is one of two features and small enough.
pub(super) fn grid(forest: &Forest<'_>, cells: &Cells, leaf: LeafType) -> Option<Parts> {
    if cells.is_table() { table(forest, cells, &cells.dimensions, Layout::Grid, leaf) } else { None }
}

/// The tables of a forest over contact patterns, if they are small enough.
pub(super) fn patterns(forest: &Forest<'_>, cells: &Cells, leaf: LeafType) -> Option<Parts> {
    // Which table it is takes no axis: it is the pattern's own.
    let dimensions = cells.dimensions.get(1..).filter(|_| cells.is_by_pattern())?;
    table(forest, cells, dimensions, Layout::Patterns, leaf)
}

/// All cells one after the other, and an axis for each of the dimensions.
fn table(
    forest: &Forest<'_>,
    cells: &Cells,
    dimensions: &[(u8, Vec<i32>)],
    layout: Layout,
    leaf: LeafType,
) -> Option<Parts> {
    let objects = forest.objects();
    let count = cells.count()?;
    if dimensions.iter().any(|(_, cuts)| cuts.len() > 255) || count * objects * leaf.size() > MAX_TABLE {
        return None;
    }
    let sums: Vec<Vec<f32>> =
        (0..objects).map(|object| cells.sums(forest, object, forest.base[object], |_, value| value)).collect();
    let scale = Scale::for_table(&sums, leaf)?;
    let mut leaves = Leaves::new(leaf, &scale);
    let mut worst = if leaf == LeafType::F32 { f64::from(scale.unit) / 2.0 } else { 0.0 };
    for cell in 0..count {
        for sum in &sums {
            leaves.push(&[sum[cell]], 0);
            if leaf != LeafType::F32 {
                let compiled = f64::from(scale.integer(sum[cell], 0)) * f64::from(scale.unit);
                worst = worst.max((f64::from(sum[cell]) - compiled).abs());
            }
        }
    }
    let (axes, cuts) = axes(dimensions);
    let shape =
        Shape { layout, leaf, objects, axes: axes.len(), groups: &[], nodes: &[], is_shared: false, below: on_average };
    Some(Parts {
        instructions: Instructions::new(&shape),
        axes,
        cuts,
        groups: Vec::new(),
        nodes: Vec::new(),
        leaves: leaves.into_bytes(),
        shared: None,
        exits: Vec::new(),
        base: vec![0; objects],
        unit: scale.unit,
        margin_error: round_up(worst),
    })
}

fn axes(dimensions: &[(u8, Vec<i32>)]) -> (Vec<Axis>, Vec<u8>) {
    let mut bytes = Vec::new();
    let axes = dimensions.iter().map(|(feature, cuts)| {
        let axis =
            Axis { feature: *feature, columns: Columns::MissingLeft, width: width(cuts), count: cuts.len() as u8 };
        bytes.extend(cuts_bytes(axis, cuts));
        axis
    });
    (axes.collect(), bytes)
}
