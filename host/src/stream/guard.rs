//! Limits of the rows that a model takes in a sequence: against sensors that are dead, stuck or at a rail.

use palpate_onboard::Model;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::Limits;
use palpate_trees::rows::{Encoder, RowSequence, Sequences};

/// Room on each side of the values that were learned, in their range.
const GUARD_MARGIN: f64 = 0.5;
/// Rows with equal values that are taken, in those of the longest such run that was learned.
const GUARD_RUN: u32 = 2;

/// The section of a guard that takes every row of these sequences: values up to half of their range beyond them, missing ones
/// if there is one, and the same value for twice as many rows as in any of them. A feature that stays the same through a whole
/// sequence may stay the same for any time, and one that stays the same in all of them may have any value.
pub(super) fn section(model: &Model<'_>, sequences: &Sequences, learned: &[&RowSequence]) -> Vec<u8> {
    let mut limits: Vec<Limits> =
        (0..sequences.features).map(|feature| limits(model, sequences, learned, feature)).collect();
    if let Some(position) = model.position() {
        limits.insert(position.feature.into(), Limits::NONE);
    }
    limits.into_iter().flat_map(Limits::to_bytes).collect()
}

/// The limits of a measured feature.
fn limits(model: &Model<'_>, sequences: &Sequences, learned: &[&RowSequence], feature: usize) -> Limits {
    let encoder = Encoder::measured(model).only(feature);
    let sentinel = model.sentinel();
    let key = |value: f64| {
        let key = encoder.row(&[value])[0];
        sentinel.map_or(key, |sentinel| sentinel.or_missing(key))
    };
    let (mut low, mut high, mut may_miss) = (f64::INFINITY, f64::NEG_INFINITY, false);
    let (mut longest, mut is_whole) = (0_u32, false);
    for sequence in learned {
        let (mut run, mut last) = (0_u32, None);
        for row in sequence.rows.clone() {
            let value = sequences.values[row * sequences.features + feature];
            let own = key(value);
            if own == MISSING_FEATURE {
                may_miss = true;
            } else {
                (low, high) = (low.min(value), high.max(value));
            }
            run = if last == Some(own) { run.saturating_add(1) } else { 1 };
            last = Some(own);
            longest = longest.max(run);
        }
        // A single row says nothing of runs.
        is_whole |= run > 1 && run as usize == sequence.rows.len();
    }
    let room = GUARD_MARGIN * (high - low);
    let has_range = room.is_finite() && room > 0.0;
    Limits {
        low: if has_range { encoder.row(&[low - room])[0] } else { i32::MIN },
        high: if has_range { encoder.row(&[high + room])[0] } else { i32::MAX },
        may_miss,
        most_equal: if is_whole { 0 } else { longest.saturating_mul(GUARD_RUN) },
    }
}
