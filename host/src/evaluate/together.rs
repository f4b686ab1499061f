//! A compiled model's margins of many touches at once, on all threads.

pub use palpate_trees::verify::together::*;

use palpate_onboard::Model;
use palpate_shared::{MISSING_FEATURE, Touch};
use palpate_trees::verify::unit;
use rayon::prelude::*;
use std::borrow::Borrow;

/// Fewer touches than this go one after the other.
const FEW: usize = 16;

/// Margins of many touches at once.
pub trait TouchesTogether {
    /// The margins of touches in the model's units, as [`Model::margins`] gives them: one row for each touch, one number for
    /// each object. `margins` is as long as that.
    fn touches<T: Borrow<Touch>>(&mut self, model: &Model<'_>, touches: &[T], margins: &mut [i32]);

    /// Margins of touches in nats.
    fn touches_in_nats<T: Borrow<Touch>>(&mut self, model: &Model<'_>, touches: &[T], margins: &mut [f64]) {
        let mut units = vec![0; margins.len()];
        self.touches(model, touches, &mut units);
        let unit = unit(model);
        margins.iter_mut().zip(&units).for_each(|(margin, units)| *margin = f64::from(*units) * unit);
    }
}

impl TouchesTogether for Together {
    fn touches<T: Borrow<Touch>>(&mut self, model: &Model<'_>, touches: &[T], margins: &mut [i32]) {
        if touches.len() < FEW {
            let margins = margins.chunks_exact_mut(model.object_count());
            margins.zip(touches).for_each(|(margins, touch)| _ = model.margins(touch.borrow(), margins));
            return;
        }
        let put = |features: &mut Vec<i32>| match model.descriptor() {
            Some(descriptor) => {
                let rows = touches.iter().map(|touch| descriptor.features(touch.borrow()));
                rows.for_each(|row| features.extend_from_slice(row.as_slice()));
            }
            None => features.resize(touches.len() * model.feature_count(), MISSING_FEATURE),
        };
        self.units(model, put, margins);
    }
}

/// The margins of touches in the model's units, one row for each touch, on all threads.
pub(crate) fn margins_of_touches<T: Borrow<Touch> + Sync>(model: &Model<'_>, touches: &[T]) -> Vec<i32> {
    let objects = model.object_count();
    let mut margins = vec![0; touches.len() * objects];
    let tasks = margins.par_chunks_mut(AT_ONCE * objects).zip(touches.par_chunks(AT_ONCE));
    tasks.for_each_init(Together::new, |together, (margins, touches)| together.touches(model, touches, margins));
    margins
}
