//! A compiled model's margins of many rows at once, on all threads.

use super::reference;
use crate::rows::Encoder;
use palpate_onboard::{Batch, Model};
use palpate_shared::format::LeafType;
use rayon::prelude::*;

/// Rows of a task: as many as go down a tree together.
pub const AT_ONCE: usize = 1024;

/// Fewer than this go one after the other.
const FEW: usize = 16;

/// Room for the margins of many rows at once: the same as one after the other, to the bit, and faster; see
/// [`Model::margins_of_rows`]. For one thread.
#[derive(Debug)]
pub struct Together {
    /// None as long as there were only a few at once.
    batch: Option<Box<Batch>>,
    features: Vec<i32>,
    units: Vec<i32>,
    exact: Vec<f32>,
}

impl Default for Together {
    fn default() -> Self {
        Self::new()
    }
}

impl Together {
    /// Empty room.
    pub fn new() -> Self {
        Self { batch: None, features: Vec::new(), units: Vec::new(), exact: Vec::new() }
    }

    /// Margins in the model's units, as [`Model::margins_of`] gives them, of the features that `put` appends: one row of
    /// `margins` for each row of them.
    pub fn units(&mut self, model: &Model<'_>, put: impl FnOnce(&mut Vec<i32>), margins: &mut [i32]) {
        self.features.clear();
        put(&mut self.features);
        let batch = self.batch.get_or_insert_with(Box::default);
        let is_whole = model.margins_of_rows(&self.features, margins, batch);
        debug_assert!(is_whole, "a row of margins for each row");
    }

    /// The margins of rows of features as the library has them (see [`verify::margins`](super::margins)): one row for each row of
    /// `values`, which has as many as the model has features. `margins` is as long as that.
    pub fn rows<V: Copy + Into<f64>>(
        &mut self,
        model: &Model<'_>,
        encoder: &Encoder,
        values: &[V],
        margins: &mut [f64],
    ) {
        let values = values.chunks_exact(model.feature_count());
        if values.len() < FEW {
            let margins = margins.chunks_exact_mut(model.object_count());
            margins
                .zip(values)
                .for_each(|(slot, row)| slot.copy_from_slice(&reference::margins(model, &encoder.row(row))));
            return;
        }
        self.features.clear();
        values.for_each(|row| self.features.extend(encoder.row(row)));
        let batch = self.batch.get_or_insert_with(Box::default);
        let is_whole = if model.leaf_type() == LeafType::F32 {
            self.exact.resize(margins.len(), 0.0);
            let is_whole = model.f32_margins_of_rows(&self.features, &mut self.exact, batch);
            let scale = model.prediction().scale;
            margins.iter_mut().zip(&self.exact).for_each(|(margin, exact)| *margin = f64::from(*exact * scale));
            is_whole
        } else {
            self.units.resize(margins.len(), 0);
            let is_whole = model.margins_of_rows(&self.features, &mut self.units, batch);
            in_nats(model, &self.units, margins);
            is_whole
        };
        debug_assert!(is_whole, "a row of margins for each row");
    }
}

/// Margins in nats of those in the model's units.
fn in_nats(model: &Model<'_>, units: &[i32], margins: &mut [f64]) {
    let scales = reference::scales(model);
    for ((margin, units), [unit, offset]) in margins.iter_mut().zip(units).zip(scales.iter().cycle()) {
        *margin = f64::from(*units) * unit + offset;
    }
}

/// The margins of rows of features in the model's units, as [`Model::margins_of`] gives them: one row for each, on all
/// threads.
pub fn units_of_rows<V: Copy + Into<f64> + Sync>(model: &Model<'_>, encoder: &Encoder, values: &[V]) -> Vec<i32> {
    let (objects, width) = (model.object_count(), model.feature_count());
    let mut margins = vec![0; values.len() / width * objects];
    let tasks = margins.par_chunks_mut(AT_ONCE * objects).zip(values.par_chunks(AT_ONCE * width));
    tasks.for_each_init(Box::<Batch>::default, |batch, (margins, values)| {
        let features: Vec<i32> = values.chunks_exact(width).flat_map(|row| encoder.row(row)).collect();
        let is_whole = model.margins_of_rows(&features, margins, batch);
        debug_assert!(is_whole, "a row of margins for each row");
    });
    margins
}

/// The margins of rows of features in nats (see [`Together::rows`]), one row for each, on all threads.
pub fn margins_of_rows<V: Copy + Into<f64> + Sync>(model: &Model<'_>, encoder: &Encoder, values: &[V]) -> Vec<f64> {
    let (objects, width) = (model.object_count(), model.feature_count());
    let mut margins = vec![0.0; values.len() / width * objects];
    let tasks = margins.par_chunks_mut(AT_ONCE * objects).zip(values.par_chunks(AT_ONCE * width));
    tasks.for_each_init(Together::new, |together, (margins, values)| together.rows(model, encoder, values, margins));
    margins
}
