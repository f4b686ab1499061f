//! Sequences of rows, followed by the onboard recognizer.

use super::Rows;
use crate::calibrate::{Sequence, Until, odds_of};
use palpate_onboard::{Familiarity, Model, Recognizer, Stopping};
use palpate_trees::rows::RowSequence;
use rayon::prelude::*;

/// Sequences of a task: enough that a thread is not waited for.
const AT_ONCE: usize = 128;

/// Follows each sequence from its first row until the leader is so far ahead, the limit of rows is reached, or its rows end.
/// Evidence, misfit and names are the chip's, to the bit.
pub fn follow(model: &Model<'_>, rows: &Rows<'_>, sequences: &[&RowSequence], until: Until) -> Vec<Sequence> {
    match model.object_count() {
        0..=16 => all::<16>(model, rows, sequences, until),
        17..=64 => all::<64>(model, rows, sequences, until),
        _ => all::<256>(model, rows, sequences, until),
    }
}

fn all<const N: usize>(model: &Model<'_>, rows: &Rows<'_>, sequences: &[&RowSequence], until: Until) -> Vec<Sequence> {
    let chunk = |sequences: &[&RowSequence]| -> Vec<Sequence> {
        // There is room for as many objects as the caller chose this for.
        let Ok(mut recognizer) = Recognizer::<N>::new(model, Stopping::from_odds(0, u32::MAX)) else {
            return Vec::new();
        };
        sequences.iter().map(|sequence| one(&mut recognizer, rows, sequence, until)).collect()
    };
    sequences.par_chunks(AT_ONCE).map(chunk).collect::<Vec<_>>().concat()
}

fn one<const N: usize>(
    recognizer: &mut Recognizer<'_, N>,
    rows: &Rows<'_>,
    sequence: &RowSequence,
    until: Until,
) -> Sequence {
    let strictest = odds_of(until.margin);
    let mut followed = Sequence::new(sequence.class);
    recognizer.reset();
    for (count, row) in (1..=until.max_touches).zip(sequence.rows.clone()) {
        recognizer.push_margins(rows.row(row));
        // What the model's own test says, as on the chip: a name is held back, or there is none.
        let familiarity = recognizer.familiarity();
        let may_name = familiarity == Familiarity::Known;
        let odds = followed.push(recognizer, count, may_name);
        if familiarity == Familiarity::Stranger {
            followed.make_unknown();
            break;
        }
        if may_name && odds <= strictest {
            break;
        }
    }
    followed
}
