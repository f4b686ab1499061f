//! Sequences of rows, followed by the onboard recognizer.

use super::Rows;
use crate::calibrate::{Limit, Sequence};
use crate::evidence::{self, Follower, Sequences, Supplier, chip};
use palpate_onboard::{Model, Stopping};
use palpate_trees::rows::RowSequence;
use rayon::prelude::*;
use std::convert::Infallible;
use std::ops::Range;

/// Sequences of a task: enough that a thread is not waited for.
const AT_ONCE: usize = 128;

/// Follows each sequence from its first row until the leader is so far ahead, the limit of rows is reached, or its rows end.
/// Evidence, misfit and names are the chip's, to the bit.
pub(super) fn follow(model: &Model<'_>, rows: &Rows<'_>, sequences: &[&RowSequence], limit: Limit) -> Vec<Sequence> {
    let chunk = |sequences: &[&RowSequence]| {
        let mut supply = RowSupply { rows, sequences: sequences.iter(), coming: 0..0 };
        let mut follower = chip(model, Stopping::from_odds(0, u32::MAX), None);
        let Ok(found) = evidence::sequences(&mut supply, &mut *follower, usize::MAX, limit);
        found
    };
    sequences.par_chunks(AT_ONCE).map(chunk).collect::<Vec<_>>().concat()
}

/// Sequences of rows, one after the other.
struct RowSupply<'r> {
    rows: &'r Rows<'r>,
    sequences: std::slice::Iter<'r, &'r RowSequence>,
    /// The rows of the sequence that are left.
    coming: Range<usize>,
}

impl<F: Follower<Step = [i32]> + ?Sized> Supplier<F> for RowSupply<'_> {
    type Error = Infallible;

    fn step(&mut self, _: &F) -> Result<Option<Option<&[i32]>>, Infallible> {
        Ok(self.coming.next().map(|row| Some(self.rows.row(row))))
    }
}

impl<F: Follower<Step = [i32]> + ?Sized> Sequences<F> for RowSupply<'_> {
    fn begin(&mut self) -> Result<Option<Sequence>, Infallible> {
        let Some(next) = self.sequences.next() else { return Ok(None) };
        self.coming = next.rows.clone();
        Ok(Some(Sequence::new(next.class).of_group(next.group)))
    }

    /// A sequence is whole when its rows end.
    fn end(&mut self, _: u32, _: bool) -> bool {
        true
    }
}
