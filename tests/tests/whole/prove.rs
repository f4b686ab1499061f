//! Proofs: every model of an ensemble is proved, and no change of a model's meaning is.

use palpate::compile::{Instructions, Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Node, Tree};
use palpate::prove::prove;
use palpate::with;
use palpate_onboard::Model;
use palpate_shared::format::Header;
use palpate_shared::{Descriptor, MISSING_FEATURE};
use palpate_tests::random::{self, Shape};
use palpate_tests::scripts::sealed;
use proptest::prelude::*;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use std::collections::BTreeMap;

fn is_proved(bytes: &[u8], ensemble: &Ensemble) -> Result<(), TestCaseError> {
    let model = Model::new(bytes).unwrap();
    let proof = prove(bytes, ensemble)
        .map_err(|error| TestCaseError::fail(format!("{:?} {:?}: {error}", model.layout(), model.leaf_type())))?;
    let (average, longest) = (Instructions::of_model(&model), proof.estimated);
    prop_assert!(longest.m4f >= average.m4f && longest.m0_plus >= average.m0_plus, "{longest:?} {average:?}");
    // Trees of one split over one feature may be one deeper tree, with as many splits or fewer.
    let splits = |tree: &Tree| tree.nodes.iter().filter(|node| matches!(node, Node::Split { .. })).count();
    let all: usize = ensemble.trees.iter().map(splits).sum();
    prop_assert!(proof.splits <= all.max(ensemble.trees.len() * 6), "{} of {all}", proof.splits);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn models_of_touches_are_proved_in_every_layout(shape in crate::shapes(8, 30, 6, 60), seed: u64) {
        let ensemble = random::ensemble(shape, seed);
        for bytes in random::models(&ensemble, None) {
            is_proved(&bytes, &ensemble)?;
        }
    }

    #[test]
    fn models_of_rows_are_proved_by_keys_and_in_units(shape in crate::shapes(8, 30, 6, 60), features in 1..=40_usize, seed: u64) {
        let ensemble = random::over_rows(random::ensemble(shape, seed), features, 0.1);
        for scales in [None, Some(vec![100.0; features])] {
            for bytes in random::models(&ensemble, scales) {
                is_proved(&bytes, &ensemble)?;
            }
        }
    }
}

/// Rows near what trees compare with.
fn rows(ensemble: &Ensemble, model: &Model<'_>) -> Vec<i32> {
    let mut random = SmallRng::seed_from_u64(3);
    let mut cuts = vec![0, i32::MAX, -i32::MAX];
    for node in ensemble.trees.iter().flat_map(|tree| &tree.nodes) {
        if let Node::Split { threshold, .. } = node {
            cuts.extend([-1, 0, 1].map(|step| (threshold.ceil() as i32).saturating_add(step)));
        }
    }
    let width = model.feature_count();
    let value = |_| if random.random_bool(0.1) { MISSING_FEATURE } else { cuts[random.random_range(0..cuts.len())] };
    (0..500 * width).map(value).collect()
}

fn margins(model: &Model<'_>, rows: &[i32]) -> Vec<Vec<i32>> {
    let row = |row: &[i32]| {
        let mut margins = vec![0; model.object_count()];
        model.margins_of(row, &mut margins);
        margins
    };
    rows.chunks(model.feature_count()).map(row).collect()
}

/// A model and its margins of rows.
struct Original {
    bytes: Vec<u8>,
    rows: Vec<i32>,
    margins: Vec<Vec<i32>>,
    sizes: [usize; 2],
    name: String,
}

impl Original {
    fn new(bytes: Vec<u8>, ensemble: &Ensemble) -> Self {
        prove(&bytes, ensemble).unwrap();
        let model = Model::new(&bytes).unwrap();
        let rows = rows(ensemble, &model);
        let margins = margins(&model, &rows);
        let name = format!("{:?} {:?}", model.layout(), model.leaf_type());
        let sizes = [model.object_count(), model.feature_count()];
        Self { rows, margins, sizes, name, bytes }
    }
}

/// Tries a changed model: `None` if it is not accepted as a model, else true if it is refused. Panics if its margins are
/// others, and it is not.
fn is_refused(changed: &mut [u8], original: &Original, ensemble: &Ensemble, what: &str) -> Option<bool> {
    sealed(changed);
    let model = Model::new(changed).ok()?;
    if prove(changed, ensemble).is_err() {
        return Some(true);
    }
    let same_size = [model.object_count(), model.feature_count()] == original.sizes;
    let is_same = same_size && margins(&model, &original.rows) == original.margins;
    assert!(is_same, "{what} of {} changes margins, and is proved", original.name);
    Some(false)
}

#[test]
fn every_bit_that_changes_a_margin_of_a_small_model_is_refused() {
    let mut counts = [0, 0];
    for (number, descriptor) in [Descriptor::Curvature, Descriptor::ContactsCurvature].into_iter().enumerate() {
        let shape = Shape { descriptor, thresholds: 3, trees: 3, depth: 2, ..Shape::SMALL };
        let ensemble = random::ensemble(shape, 7 + number as u64);
        for original in random::models(&ensemble, None) {
            let original = Original::new(original, &ensemble);
            for bit in 0..8 * (original.bytes.len() - 4) {
                let mut changed = original.bytes.clone();
                changed[bit / 8] ^= 1 << (bit % 8);
                let what = format!("bit {bit}");
                if let Some(is_refused) = is_refused(&mut changed, &original, &ensemble, &what) {
                    counts[usize::from(is_refused)] += 1;
                }
            }
        }
    }
    println!("{} bits change no meaning that a proof states, {} are refused", counts[0], counts[1]);
    assert!(counts[1] > 1000, "{counts:?}");
}

#[test]
fn random_changes_of_large_models_that_change_a_margin_are_refused() {
    let mut random = SmallRng::seed_from_u64(5);
    let shape = Shape { objects: 6, trees: 60, depth: 6, thresholds: 90, ..Shape::SMALL };
    let mut refused = 0;
    for each in [false, true] {
        let ensemble = random::ensemble(Shape { each, descriptor: Descriptor::Oriented, ..shape }, 11);
        for original in random::models(&ensemble, None) {
            let original = Original::new(original, &ensemble);
            for _ in 0..20 {
                let mut changed = original.bytes.clone();
                let at = random.random_range(96..changed.len() - 4);
                changed[at] = random.random();
                let what = format!("byte {at}");
                refused += usize::from(is_refused(&mut changed, &original, &ensemble, &what) == Some(true));
            }
        }
    }
    assert!(refused > 50, "{refused}");
}

/// Places of one kind of byte of a model's trees.
fn places(bytes: &[u8], kind: &str) -> Vec<usize> {
    let header = Header::of(bytes);
    let leaves = bytes.len() - 4 - header.leaves_length() as usize;
    let splits = leaves - header.nodes_length() as usize;
    let groups = splits - 8 * usize::from(header.groups());
    match kind {
        "leaves" => (leaves..bytes.len() - 4).collect(),
        "shifts" => (groups..splits).step_by(8).map(|group| group + 1).collect(),
        _ => {
            // A tree begins with its number of splits; the last byte of three is the left subtree's splits.
            let (mut at, mut found) = (splits, Vec::new());
            while at < leaves {
                let count = usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
                let own = (at + 2..at + 2 + 3 * count).filter(|byte| ((byte - at - 2) % 3 == 2) == (kind == "skips"));
                found.extend(own);
                at += 2 + 3 * count;
            }
            found
        }
    }
}

#[test]
fn two_thousand_changes_of_splits_skips_leaves_and_shifts_with_a_right_checksum_are_refused() {
    let mut random = SmallRng::seed_from_u64(9);
    let mut refused = BTreeMap::from(["splits", "skips", "leaves", "shifts"].map(|kind| (kind, 0)));
    let shape = Shape { objects: 6, trees: 60, depth: 6, thresholds: 90, ..Shape::SMALL };
    for (each, leaf) in [(false, Leaf::I8), (true, Leaf::I16), (true, Leaf::I8), (false, Leaf::I16)] {
        let ensemble = random::ensemble(Shape { each, descriptor: Descriptor::Oriented, ..shape }, 21);
        let settings = with!(Settings::default(), leaf);
        let original = Original::new(compile(&ensemble, &settings).unwrap().bytes, &ensemble);
        for (kind, refused) in &mut refused {
            let places = places(&original.bytes, kind);
            for _ in 0..if *kind == "skips" { 1_500 } else { 250 } {
                let mut changed = original.bytes.clone();
                let at = places[random.random_range(0..places.len())];
                changed[at] =
                    changed[at].wrapping_add(random.random_range(1..=if *kind == "shifts" { 12 } else { 255 }));
                let what = format!("byte {at}, of {kind},");
                *refused += usize::from(is_refused(&mut changed, &original, &ensemble, &what) == Some(true));
            }
        }
    }
    println!("{refused:?}");
    assert!(refused.values().sum::<usize>() >= 2_000 && refused.values().all(|count| *count >= 100), "{refused:?}");
}

#[test]
fn another_ensemble_is_refused_with_the_tree_and_the_rows() {
    let ensemble = random::ensemble(Shape::SMALL, 1);
    let bytes = compile(&ensemble, &Settings::default()).unwrap().bytes;
    let mut other = ensemble.clone();
    let threshold = other.trees[2].nodes.iter_mut().find_map(|node| match node {
        Node::Split { threshold, .. } => Some(threshold),
        Node::Leaf(_) => None,
    });
    *threshold.unwrap() += 1.0;
    let error = prove(&bytes, &other).unwrap_err();
    let (what, rows) = error.what().rsplit_once(": ").unwrap();
    assert!(
        what.starts_with("for some rows the model's tree") && what.contains("where tree 2 of the ensemble"),
        "{error}"
    );
    assert!(!rows.is_empty(), "{error}");
}

#[test]
fn trees_deeper_than_any_ensemble_are_refused_and_not_walked() {
    let shape = Shape { descriptor: Descriptor::Oriented, depth: 13, trees: 1, thresholds: 4_000, ..Shape::SMALL };
    let ensemble = random::ensemble(shape, 3);
    let mut bytes = compile(&ensemble, &Settings::default()).unwrap().bytes;
    let header = Header::of(&bytes);
    let (splits, leaves) = (header.nodes_length() as usize, header.leaves_length() as usize);
    let body = bytes.len() - 4;
    let start = body - leaves - splits;
    let count = (splits - 2) / 6;
    assert!(count > 300, "{count} splits");
    // No split has any in its left subtree: a chain to the right.
    for split in 0..count {
        bytes[start + 2 + 6 * split + 4..][..2].fill(0);
    }
    sealed(&mut bytes);
    Model::new(&bytes).unwrap();
    let error = prove(&bytes, &ensemble).unwrap_err();
    assert!(error.what().ends_with("its format: a tree of more than 256 levels"), "{error}");
}

#[test]
fn thousands_of_merged_trees_are_proved() {
    let mut ensemble =
        random::ensemble(Shape { each: false, depth: 1, trees: 6_000, thresholds: 150, ..Shape::SMALL }, 4);
    // Of one split each, so that they become a few.
    ensemble.trees.retain(|tree| tree.nodes.len() == 3);
    assert!(ensemble.trees.len() > 2_000, "{}", ensemble.trees.len());
    for leaf in [Leaf::I8, Leaf::I16] {
        let settings = with!(Settings::default(), leaf);
        let bytes = compile(&ensemble, &settings).unwrap().bytes;
        let proof = prove(&bytes, &ensemble).unwrap();
        assert!(20 * proof.trees < ensemble.trees.len(), "{} trees", proof.trees);
    }
}
