use palpate_simulator::random::{Purpose, generator};
use rand::RngExt;
use std::collections::BTreeSet;

#[test]
fn seed_name_and_index_each_change_the_numbers() {
    let draw = |seed, name, index| generator(seed, Purpose::Noise, name, index).random::<u64>();
    assert_eq!(draw(1, "fork", 0), draw(1, "fork", 0));
    for other in [draw(2, "fork", 0), draw(1, "spoon", 0), draw(1, "fork", 1)] {
        assert_ne!(other, draw(1, "fork", 0));
    }
}

#[test]
fn purposes_of_one_seed_share_no_stream() {
    use Purpose::*;
    let purposes = [
        Folds,
        Noise,
        Sensor,
        Robot,
        Groups,
        Sequences,
        View,
        Casts,
        Approaches,
        Calibration,
        Active,
        Misfit,
        Capture,
        Fit,
        Teach,
        Synthetic,
    ];
    let draw = |purpose| generator(1, purpose, "fork", 0).random::<u64>();
    assert_eq!(purposes.map(draw).into_iter().collect::<BTreeSet<_>>().len(), purposes.len());
}
