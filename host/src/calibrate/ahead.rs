//! Margins of the touches that come next, computed together: that is several times as fast as one by one.

use super::demand::Demand;
use crate::error::Result;
use crate::evaluate::together::{AT_ONCE, Together, TouchesTogether};
use palpate_onboard::{Model, Refused};
use palpate_shared::Touch;
use palpate_shared::format::TrainedTouches;

/// Number of touches that a robot's sequence often needs; each robot makes only one.
const AT_ONCE_OF_A_ROBOT: usize = 128;

/// Source of a supply's touches.
#[derive(Clone, Copy, Debug)]
pub(super) enum Feed<'d> {
    /// They are there.
    Given(&'d [Touch]),
    /// They are captured when they are needed.
    Captured(&'d Demand<'d>),
}

impl Feed<'_> {
    /// The touches at these positions.
    fn touches(&self, positions: &[u32]) -> Result<Vec<Touch>> {
        match self {
            Self::Given(touches) => {
                Ok(positions.iter().filter_map(|&position| touches.get(position as usize).copied()).collect())
            }
            Self::Captured(demand) => demand.touches(positions),
        }
    }

    /// The touch at this position, if it is there without a capture.
    pub(super) fn given(&self, position: u32) -> Option<&Touch> {
        match self {
            Self::Given(touches) => touches.get(position as usize),
            Self::Captured(_) => None,
        }
    }
}

/// The margins of the next touches of each of a supply's pools.
pub(super) struct Ahead<'m> {
    model: &'m Model<'m>,
    trained: TrainedTouches,
    together: Together,
    /// Number of touches drawn from a pool at once.
    size: usize,
    blocks: Vec<Block>,
    /// Margins of a single touch.
    single: Vec<i32>,
}

/// Touches of a pool, in its order.
#[derive(Clone, Debug, Default)]
struct Block {
    /// Position of the first one in the pool's order.
    first: usize,
    /// For each touch the row of its margins; none if it is no evidence.
    rows: Vec<Option<usize>>,
    margins: Vec<i32>,
}

impl<'m> Ahead<'m> {
    /// For this many pools, of each of which a robot makes one sequence (`is_once`), or many are made.
    pub(super) fn new(model: &'m Model<'m>, pools: usize, is_once: bool) -> Self {
        Self {
            model,
            trained: model.trained_touches(),
            together: Together::new(),
            size: if is_once { AT_ONCE_OF_A_ROBOT } else { AT_ONCE },
            blocks: vec![Block::default(); pools],
            single: vec![0; model.object_count()],
        }
    }

    /// The margins of the touch at position `next` of the order of pool `pool`, if there is one, as [`Model::margins`]; nothing
    /// if it is no evidence to the model.
    pub(super) fn next(
        &mut self,
        pool: usize,
        next: usize,
        order: &[u32],
        feed: &Feed<'_>,
    ) -> Result<Option<Option<&[i32]>>> {
        let Some(block) = self.blocks.get_mut(pool) else { return Ok(None) };
        if !(block.first..block.first + block.rows.len()).contains(&next) {
            let Some(coming) = order.get(next..order.len().min(next + self.size)) else { return Ok(None) };
            let is_evidence = |touch: &&Touch| Refused::check(&self.trained, touch).is_ok();
            let mut row = 0..;
            block.first = next;
            let touches = feed.touches(coming)?;
            block.rows = touches.iter().map(|touch| if is_evidence(&touch) { row.next() } else { None }).collect();
            let evidence: Vec<&Touch> = touches.iter().filter(is_evidence).collect();
            block.margins.resize(evidence.len() * self.model.object_count(), 0);
            self.together.touches(self.model, &evidence, &mut block.margins);
        }
        let Some(row) = block.rows.get(next - block.first) else { return Ok(None) };
        Ok(Some(row.and_then(|row| block.margins.chunks_exact(self.model.object_count()).nth(row))))
    }

    /// The margins of a touch; nothing if it is no evidence to the model.
    pub(super) fn one(&mut self, touch: &Touch) -> Option<&[i32]> {
        let is_evidence = Refused::check(&self.trained, touch).is_ok() && self.model.margins(touch, &mut self.single);
        is_evidence.then_some(&self.single[..])
    }
}
