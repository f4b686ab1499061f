//! The layout without trees: a table of margins over two features.

use super::axes::{cuts_bytes, width};
use super::cells::Cells;
use super::cost::{Instructions, Shape};
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
    let objects = forest.objects();
    let sides: Vec<usize> = cells.dimensions.iter().map(|(_, cuts)| cuts.len() + 2).collect();
    let table: usize = sides.iter().product::<usize>() * objects * leaf.size();
    if !cells.is_table() || sides.iter().any(|&side| side > 257) || table > MAX_TABLE {
        return None;
    }
    let sums: Vec<Vec<f32>> =
        (0..objects).map(|object| cells.sums(forest, object, forest.base[object], |_, value| value)).collect();
    let scale = Scale::for_table(&sums, leaf)?;
    let mut leaves = Leaves::new(leaf, &scale);
    let mut worst = if leaf == LeafType::F32 { f64::from(scale.unit) / 2.0 } else { 0.0 };
    for cell in 0..sides.iter().product() {
        for sum in &sums {
            leaves.push(&[sum[cell]], 0);
            if leaf != LeafType::F32 {
                let compiled = f64::from(scale.integer(sum[cell], 0)) * f64::from(scale.unit);
                worst = worst.max((f64::from(sum[cell]) - compiled).abs());
            }
        }
    }
    let (axes, cuts) = axes(cells);
    let shape = Shape { layout: Layout::Grid, leaf, objects, axes: axes.len(), groups: &[], nodes: &[] };
    Some(Parts {
        instructions: Instructions::new(&shape),
        axes,
        cuts,
        groups: Vec::new(),
        nodes: Vec::new(),
        leaves: leaves.into_bytes(),
        base: vec![0; objects],
        unit: scale.unit,
        margin_error: round_up(worst),
    })
}

fn axes(cells: &Cells) -> (Vec<Axis>, Vec<u8>) {
    let mut bytes = Vec::new();
    let axes = cells.dimensions.iter().map(|(feature, cuts)| {
        let axis =
            Axis { feature: *feature, columns: Columns::MissingLeft, width: width(cuts), count: cuts.len() as u8 };
        bytes.extend(cuts_bytes(axis, cuts));
        axis
    });
    (axes.collect(), bytes)
}
