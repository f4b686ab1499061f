//! Margins of the touches that come next, computed together: that is several times as fast as one by one.

use crate::evaluate::together::{AT_ONCE, Together};
use palpate_onboard::{Model, Refused};
use palpate_shared::Touch;
use palpate_shared::format::TrainedTouches;

/// As many touches as a robot's sequence often needs; each robot makes only one.
const AT_ONCE_OF_A_ROBOT: usize = 128;

/// The margins of the next touches of each of a supply's pools.
pub(super) struct Ahead<'m> {
    model: &'m Model<'m>,
    trained: TrainedTouches,
    together: Together,
    /// Number of touches drawn from a pool at once.
    size: usize,
    blocks: Vec<Block>,
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
        }
    }

    /// The margins of the touch at position `next` of the order of pool `pool`, as [`Model::margins`]; none if it is no
    /// evidence to the model.
    pub(super) fn margins(&mut self, pool: usize, next: usize, order: &[u32], touches: &[Touch]) -> Option<&[i32]> {
        let block = self.blocks.get_mut(pool)?;
        if !(block.first..block.first + block.rows.len()).contains(&next) {
            let coming = order.get(next..order.len().min(next + self.size))?;
            let coming = coming.iter().filter_map(|&touch| touches.get(touch as usize));
            let is_evidence = |touch: &Touch| Refused::check(&self.trained, touch).is_ok();
            let mut row = 0..;
            block.first = next;
            block.rows = coming.clone().map(|touch| if is_evidence(touch) { row.next() } else { None }).collect();
            let evidence: Vec<&Touch> = coming.filter(|touch| is_evidence(touch)).collect();
            block.margins.resize(evidence.len() * self.model.object_count(), 0);
            self.together.touches(self.model, &evidence, &mut block.margins);
        }
        let row = block.rows.get(next - block.first).copied().flatten()?;
        block.margins.chunks_exact(self.model.object_count()).nth(row)
    }
}
