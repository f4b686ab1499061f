//! The margins of many rows at once.

use super::{Model, fixed};
use crate::layouts::batch::Batch;
use palpate_shared::format::Layout;

/// With fewer rows than this, one after the other is as fast.
const FEW: usize = 16;

impl Model<'_> {
    /// The margins of rows of features, row by row: those of [`Model::margins_of`], to the bit, several times as fast where
    /// there are hundreds of rows. For hosts: a chip has one touch at a time, and not the room.
    ///
    /// `features` are [`feature_count`](Model::feature_count) numbers for each row, `margins`
    /// [`object_count`](Model::object_count). If they are not for the same number of whole rows, nothing is written and the
    /// answer is `false`. Cannot fail otherwise.
    pub fn margins_of_rows(&self, features: &[i32], margins: &mut [i32], batch: &mut Batch) -> bool {
        if !self.sum_rows(features, margins, batch) {
            return false;
        }
        if self.is_float() {
            fixed::make_q16(margins);
        }
        true
    }

    /// The margins of rows of features as the trainer's own f32 values: those of [`Model::f32_margins_of`], to the bit.
    /// `false`, and nothing written, unless the model has f32 leaves and `features` and `margins` are for the same number
    /// of whole rows.
    #[cfg(feature = "f32-leaves")]
    pub fn f32_margins_of_rows(&self, features: &[i32], margins: &mut [f32], batch: &mut Batch) -> bool {
        // The bits of f32 values, in the same place.
        let bits = bytemuck::try_cast_slice_mut(margins);
        self.is_float() && bits.is_ok_and(|bits| self.sum_rows(features, bits, batch))
    }

    /// Adds up all trees for every row, in units or in f32 values' bits.
    fn sum_rows(&self, features: &[i32], margins: &mut [i32], batch: &mut Batch) -> bool {
        let (width, objects) = (self.feature_count(), self.object_count());
        let rows = margins.len().checked_div(objects).unwrap_or(0);
        if rows.checked_mul(objects) != Some(margins.len()) || rows.checked_mul(width) != Some(features.len()) {
            return false;
        }
        // Leaves that are numbers are not made ready, nor rows in which numbers stand for missing values.
        let is_special = self.shared_leaves().is_some() || self.sentinel().is_some();
        if rows < FEW || is_special || self.layout() == Layout::Code {
            for (row, margins) in features.chunks_exact(width).zip(margins.chunks_exact_mut(objects)) {
                margins.fill(0);
                self.sum(row, margins);
            }
            return true;
        }
        // Blocks of about the same size, so that none is too small to be worth it.
        let blocks = rows.div_ceil(Batch::rows(&self.sections));
        let most = rows.div_ceil(blocks);
        for (features, margins) in features.chunks(most * width).zip(margins.chunks_mut(most * objects)) {
            batch.sum(&self.sections, features, width, margins);
        }
        true
    }
}
