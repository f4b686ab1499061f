//! Sequences that are copies of others.

use palpate_trees::rows::{RowSequence, Sequences};
use std::collections::HashMap;

/// Number of sequences whose rows are, value by value, those of an earlier one that is independent of it as far as is stated: of
/// another group, or where there are no groups.
pub(super) fn copies(sequences: &Sequences) -> usize {
    let bits = |sequence: &RowSequence| {
        let range = sequence.rows.start * sequences.features..sequence.rows.end * sequences.features;
        let values = sequences.values.get(range).unwrap_or_default().iter();
        // Missing is missing, whatever its bits are.
        values.map(|value| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() }).collect::<Vec<u64>>()
    };
    let mut groups: HashMap<Vec<u64>, Option<usize>> = HashMap::new();
    let mut count = 0;
    for sequence in &sequences.sequences {
        match groups.get(&bits(sequence)) {
            Some(group) => count += usize::from(group.is_none() || *group != sequence.group),
            None => _ = groups.insert(bits(sequence), sequence.group),
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequences(of: &[(&[f64], Option<usize>)]) -> Sequences {
        let mut made = Sequences { features: 2, ..Sequences::default() };
        for (values, group) in of {
            let start = made.len();
            made.values.extend_from_slice(values);
            made.sequences.push(RowSequence { rows: start..made.len(), class: 0, group: *group });
        }
        made
    }

    #[test]
    fn sequences_are_copies_if_all_values_are_the_same_and_groups_are_not() {
        let one: &[f64] = &[1.0, 2.0, f64::NAN, 4.0];
        let longer: &[f64] = &[1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0];
        let other: &[f64] = &[1.0, 2.0, f64::NAN, 4.5];
        for (of, expected) in [
            (&[(one, None), (longer, None), (other, None)][..], 0),
            (&[(one, None), (longer, None), (one, None), (one, None)], 2),
            (&[(one, Some(0)), (one, Some(0)), (one, Some(1))], 1),
        ] {
            assert_eq!(copies(&sequences(of)), expected);
        }
    }
}
