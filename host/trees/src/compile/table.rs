//! The layouts without trees: a table of margins over two features, or one for each contact pattern.

use super::axes::{cuts_bytes, width};
use super::cells::Cells;
use super::cost::{Instructions, Shape};
use super::parts::Parts;
use super::quantize::Scale;
use super::rounding::{Sums, round_up};
use super::trees::Leaves;
use palpate_shared::format::{Axis, Columns, HEADER_LENGTH, Layout, LeafType};

/// A table may have this many bytes.
const MAX_TABLE: usize = 1 << 24;

/// A table that is not written yet.
pub(super) struct Table {
    pub(super) layout: Layout,
    leaf: LeafType,
    axes: Vec<Axis>,
    cuts: Vec<u8>,
    sums: Sums,
    scale: Scale,
    /// The farthest that a margin can be from the ensemble's.
    pub(super) margin_error: f32,
}

impl Table {
    /// True if a table of these cells would be small enough.
    pub(super) fn fits(cells: &Cells, objects: usize, leaf: LeafType) -> bool {
        let is_small = cells.count().is_some_and(|count| count * objects * leaf.size() <= MAX_TABLE);
        is_small && cells.table().is_some_and(|(_, axes)| axes.iter().all(|(_, cuts)| cuts.len() <= 255))
    }

    /// The table of cells with these sums; `None` if they are too large for its leaves.
    pub(super) fn new(cells: &Cells, sums: Sums, leaf: LeafType) -> Option<Self> {
        let (layout, dimensions) = cells.table()?;
        let scale = Scale::for_table(&sums, leaf)?;
        let unit = f64::from(scale.unit);
        let error = |sum: &f32| (f64::from(*sum) - f64::from(scale.integer(*sum, 0)) * unit).abs();
        let worst = match leaf {
            LeafType::F32 => unit / 2.0,
            LeafType::I8 | LeafType::I16 => sums.iter().flatten().map(error).fold(0.0, f64::max),
        };
        let mut bytes = Vec::new();
        let axes = dimensions.iter().map(|(feature, cuts)| {
            let axis =
                Axis { feature: *feature, columns: Columns::MissingLeft, width: width(cuts), count: cuts.len() as u8 };
            bytes.extend(cuts_bytes(axis, cuts));
            axis
        });
        Some(Self { layout, leaf, axes: axes.collect(), cuts: bytes, sums, scale, margin_error: round_up(worst) })
    }

    /// Bytes of the model, except those that all layouts share.
    pub(super) fn bytes(&self) -> usize {
        let cells: usize = self.sums.iter().map(Vec::len).sum();
        let records = Axis::LENGTH * self.axes.len() + 8 * self.sums.len();
        HEADER_LENGTH + records + self.cuts.len() + cells * self.leaf.size()
    }

    /// About how many instructions a row takes.
    pub(super) fn instructions(&self) -> Instructions {
        let Self { layout, leaf, axes, .. } = self;
        let (layout, leaf, objects) = (*layout, *leaf, self.sums.len());
        Instructions::new(&Shape { layout, leaf, objects, axes: axes.len(), groups: &[], steps: &[], is_shared: false })
    }

    /// All cells one after the other, and an axis for each of the dimensions.
    pub(super) fn write(self) -> Parts {
        let mut leaves = Leaves::new(self.leaf, &self.scale);
        for cell in 0..self.sums.first().map_or(0, Vec::len) {
            self.sums.iter().for_each(|sums| leaves.push(&[sums[cell]], 0, 1));
        }
        Parts {
            leaves: leaves.into_bytes(),
            axes: self.axes,
            cuts: self.cuts,
            base: vec![0; self.sums.len()],
            unit: self.scale.unit,
            margin_error: self.margin_error,
            ..Parts::default()
        }
    }
}
