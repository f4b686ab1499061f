use super::super::train;
use super::*;
use crate::tests::synthetic;

fn settings(leaves: usize) -> Settings {
    let small = Some(Small { leaves, threshold_cost: 2e-5 });
    Settings { rounds: 10, depth: 4, min_child_weight: 5.0, leaf_bits: Some(8), small, ..Settings::compact() }
}

fn dataset(seed: u64) -> Dataset {
    synthetic::dataset(&[1_500, 1_500, 1_500], seed)
}

#[test]
fn threads_change_no_bit_and_more_trees_change_none_of_the_first() {
    let with = |threads| train(&dataset(1), &Settings { threads, ..settings(24) }, &()).unwrap();
    assert_eq!(with(Some(1)), with(Some(3)));
    assert_eq!(with(Some(1)), with(None));
    let how = Settings { small: None, ..settings(24) };
    let each = train_each(&dataset(1), &how, 2e-5, &[(4, 8), (10, 24)], &()).unwrap();
    assert_eq!(each[1], with(None));
    assert_eq!(each[0], train(&dataset(1), &Settings { rounds: 4, ..settings(8) }, &()).unwrap());
}
