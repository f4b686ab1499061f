//! Proofs: every model of an ensemble is proved, and no change of a model's meaning is.

use palpate::compile::{EarlyExit, Instructions, Layout, Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Node, Tree};
use palpate::error::ProofProblem;
use palpate::prove::{Certificate, check, moves, prove};
use palpate::rows::Encoder;
use palpate::with;
use palpate_onboard::Model;
use palpate_shared::format::{Header, Tag};
use palpate_shared::{Descriptor, MISSING_FEATURE};
use palpate_tests::random::{self, Shape};
use palpate_tests::scripts::sealed;
use proptest::prelude::*;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

/// Stands for the ensemble's file.
const FILE: &[u8] = b"an ensemble";

/// Its models whose walks for a class alone may end early.
fn early_exits(ensemble: &Ensemble, scales: Option<Vec<f32>>) -> Vec<Vec<u8>> {
    let all = [Leaf::I8, Leaf::I16]
        .into_iter()
        .flat_map(|leaf| [Layout::Complete, Layout::Compact, Layout::Wide].map(|layout| (leaf, layout)));
    let compiled = all.filter_map(|(leaf, layout)| {
        let (layout, early_exit) = (Some(layout), Some(EarlyExit::Always));
        compile(ensemble, &with!(Settings::default(), leaf, layout, early_exit, scales = scales.clone())).ok()
    });
    compiled.map(|compiled| compiled.bytes).collect()
}

fn is_proved(bytes: &[u8], ensemble: &Ensemble) -> Result<(), TestCaseError> {
    let layout = Model::new(bytes).unwrap().layout();
    let (proof, certificate) = prove(bytes, ensemble, FILE).map_err(|error| {
        TestCaseError::fail(format!("{layout:?} {:?}: {error}", Model::new(bytes).unwrap().leaf_type()))
    })?;
    let read: Certificate = {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("proof.txt");
        std::fs::write(&path, certificate.to_string()).unwrap();
        Certificate::read(path).unwrap()
    };
    prop_assert_eq!(&read, &certificate, "written and read");
    let checked = check(&read, bytes, ensemble, FILE)
        .map_err(|error| TestCaseError::fail(format!("the certificate of {layout:?}: {error}")))?;
    prop_assert!(proof.margin_error <= checked.margin_error + 1e-9, "{proof:?} {checked:?}");
    let average = Instructions::of_model(&Model::new(bytes).unwrap());
    let longest = proof.estimated.unwrap();
    prop_assert!(longest.m4f >= average.m4f && longest.m0_plus >= average.m0_plus, "{longest:?} {average:?}");
    prop_assert_eq!((proof.splits, proof.estimated), (checked.splits, checked.estimated));
    // Trees of one split over one feature may be one deeper tree, with as many splits or fewer.
    let splits = |tree: &Tree| tree.nodes.iter().filter(|node| matches!(node, Node::Split { .. })).count();
    let all: usize = ensemble.trees.iter().map(splits).sum();
    prop_assert!(proof.splits <= all.max(ensemble.trees.len() * 6), "{} of {all}", proof.splits);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn models_of_touches_are_proved_in_every_layout_and_their_certificates_hold(shape in crate::shapes(8, 30, 6, 60), seed: u64) {
        let ensemble = random::ensemble(shape, seed);
        for bytes in random::models(&ensemble, None) {
            is_proved(&bytes, &ensemble)?;
        }
    }

    #[test]
    fn a_class_stays_until_the_stated_value_of_a_feature_and_is_another_one_there(
        shape in crate::shapes(8, 30, 6, 60), features in 1..=6_usize, seed: u64,
    ) {
        let ensemble = random::over_rows(random::ensemble(Shape { objects: shape.objects.max(2), ..shape }, seed), features, 0.1);
        let mut random = SmallRng::seed_from_u64(seed);
        for scales in [None, Some(vec![10.0; features])] {
            for bytes in random::models(&ensemble, scales) {
                let model = Model::new(&bytes).unwrap();
                let encoder = Encoder::of(&model);
                let row: Vec<f64> = (0..features).map(|_| f64::from(random.random_range(-40_000..40_000_i32)) / 8.0).collect();
                let class = |row: &[f64]| {
                    let mut margins = vec![0; model.object_count()];
                    model.predict_class(&encoder.row(row), &mut margins).unwrap()
                };
                let own = class(&row);
                for moved in moves(&bytes, [row.as_slice()]).unwrap().remove(0) {
                    let at = |value: f64| {
                        let mut row = row.clone();
                        row[moved.feature] = value;
                        class(&row)
                    };
                    let from = moved.value.unwrap();
                    for (found, end) in [(moved.below, -1e9), (moved.above, 1e9)] {
                        if let Some((value, class)) = found {
                            prop_assert_eq!(at(value), class);
                            prop_assert_ne!(class, own);
                        }
                        let to = found.map_or(end, |(value, _)| value);
                        for _ in 0..30 {
                            let between = from + (to - from) * random.random_range(0.0..1.0);
                            // In whole units what is between may be rounded to the end.
                            let is_end = found.is_some() && encoder.row(&[between]) == encoder.row(&[to]);
                            prop_assert!(is_end || at(between) == own, "{from} {between} {to} {:?}", model.layout());
                        }
                    }
                    prop_assert_eq!(moved.missing.unwrap_or(own), at(f64::NAN));
                }
            }
        }
    }

    #[test]
    fn models_of_rows_are_proved_by_keys_and_in_units(shape in crate::shapes(8, 30, 6, 60), features in 1..=40_usize, seed: u64) {
        let ensemble = random::over_rows(random::ensemble(shape, seed), features, 0.1);
        for scales in [None, Some(vec![100.0; features])] {
            for bytes in random::models(&ensemble, scales.clone()).into_iter().chain(early_exits(&ensemble, scales)) {
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

/// A model with its certificate, and its margins of rows.
struct Original {
    bytes: Vec<u8>,
    certificate: Certificate,
    rows: Vec<i32>,
    margins: Vec<Vec<i32>>,
    sizes: [usize; 2],
    name: String,
}

impl Original {
    fn new(bytes: Vec<u8>, ensemble: &Ensemble) -> Self {
        let certificate = prove(&bytes, ensemble, FILE).unwrap().1;
        let model = Model::new(&bytes).unwrap();
        let rows = rows(ensemble, &model);
        let margins = margins(&model, &rows);
        let name = format!("{:?} {:?}", model.layout(), model.leaf_type());
        let sizes = [model.object_count(), model.feature_count()];
        Self { certificate, rows, margins, sizes, name, bytes }
    }
}

/// Tries a changed model: `None` if it is not accepted as a model, else true if it is refused in both ways. Panics if its
/// margins are others, and it is not.
fn is_refused(changed: &mut [u8], original: &Original, ensemble: &Ensemble, what: &str) -> Option<bool> {
    sealed(changed);
    let model = Model::new(changed).ok()?;
    let proved = prove(changed, ensemble, FILE);
    // A certificate of the original that claims to be about the changed model is judged in the other way.
    let of_changed = crc::Crc::<u64>::new(&crc::CRC_64_XZ).checksum(changed);
    let certificate = Certificate { model: of_changed, ..original.certificate.clone() };
    let checked = check(&certificate, changed, ensemble, FILE);
    if proved.is_err() && checked.is_err() {
        return Some(true);
    }
    let same_size = [model.object_count(), model.feature_count()] == original.sizes;
    let is_same = same_size && margins(&model, &original.rows) == original.margins;
    assert!(is_same || proved.is_err(), "{what} of {} changes margins, and is proved", original.name);
    assert!(is_same || checked.is_err(), "{what} of {} changes margins, and its certificate holds", original.name);
    Some(false)
}

#[test]
fn every_bit_that_changes_a_margin_of_a_small_model_is_refused_in_both_ways() {
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
fn random_changes_of_large_models_that_change_a_margin_are_refused_in_both_ways() {
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

#[test]
fn another_ensemble_is_refused_with_the_tree_and_the_rows() {
    let ensemble = random::ensemble(Shape::SMALL, 1);
    let bytes = compile(&ensemble, &with!(Settings::default(), layout = Some(Layout::Compact))).unwrap().bytes;
    let mut other = ensemble.clone();
    let threshold = other.trees[2].nodes.iter_mut().find_map(|node| match node {
        Node::Split { threshold, .. } => Some(threshold),
        Node::Leaf(_) => None,
    });
    *threshold.unwrap() += 1.0;
    let error = prove(&bytes, &other, FILE).unwrap_err();
    match error.problem() {
        Some(ProofProblem::Leaf { source_tree: 2, rows, .. }) => assert!(!rows.is_empty()),
        problem => panic!("{problem:?}"),
    }
    let (_, certificate) = prove(&bytes, &ensemble, FILE).unwrap();
    let error = check(&certificate, &bytes, &other, FILE).unwrap_err();
    assert!(matches!(error.problem(), Some(ProofProblem::Leaf { source_tree: 2, .. })), "{error}");
    let error = check(&certificate, &bytes, &ensemble, b"another file").unwrap_err();
    assert!(matches!(error.problem(), Some(ProofProblem::OtherFile { .. })), "{error}");
    let mut understated = certificate.clone();
    understated.outputs[1][0] /= 2.0;
    let error = check(&understated, &bytes, &ensemble, FILE).unwrap_err();
    assert!(matches!(error.problem(), Some(ProofProblem::Understated { .. })), "{error}");
}

#[test]
fn a_certificate_with_a_wrong_line_says_which() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("proof.txt");
    for (text, line) in [
        ("", 1),
        ("palpate certificate 2\n", 1),
        ("palpate certificate 1\nmodel 12\nensemble xyz\n", 3),
        ("palpate certificate 1\nmodel 12 13\n", 2),
        ("palpate certificate 1\noutput 1 2\n", 2),
        ("palpate certificate 1\ntree 1e-3 0 -1\n", 2),
    ] {
        std::fs::write(&path, text).unwrap();
        let error = Certificate::read(&path).unwrap_err().to_string();
        assert!(error.contains(&format!("proof.txt:{line}: not a line of a certificate")), "{error}");
    }
}

#[test]
fn certificates_with_absurd_numbers_are_refused() {
    let ensemble = random::ensemble(Shape::SMALL, 1);
    let bytes = compile(&ensemble, &with!(Settings::default(), layout = Some(Layout::Compact))).unwrap().bytes;
    let (_, certificate) = prove(&bytes, &ensemble, FILE).unwrap();
    let tree = certificate.trees[0].clone();
    let with = |change: &dyn Fn(&mut Certificate)| {
        let mut changed = certificate.clone();
        change(&mut changed);
        check(&changed, &bytes, &ensemble, FILE).unwrap_err()
    };
    for sources in [vec![], vec![usize::MAX], vec![tree.sources[0]; 2], certificate.trees[1].sources.clone()] {
        with(&|changed| changed.trees[0].sources.clone_from(&sources));
    }
    for offset in [i32::MIN, i32::MAX, 1] {
        with(&|changed| changed.trees[0].offset = offset);
    }
    for error in [f64::NAN, -1.0, f64::NEG_INFINITY] {
        with(&|changed| changed.trees[0].error = error);
        with(&|changed| changed.outputs[2][0] = error);
    }
    with(&|changed| changed.outputs[0][1] = f64::NAN);
    with(&|changed| changed.outputs[0][2] = f64::NAN);
    with(&|changed| changed.trees.clear());
    with(&|changed| changed.outputs.clear());
}

#[test]
fn trees_deeper_than_any_ensemble_are_refused_and_not_walked() {
    let shape = Shape { descriptor: Descriptor::Oriented, depth: 13, trees: 1, thresholds: 4_000, ..Shape::SMALL };
    let ensemble = random::ensemble(shape, 3);
    let mut bytes = compile(&ensemble, &with!(Settings::default(), layout = Some(Layout::Wide))).unwrap().bytes;
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
    let error = prove(&bytes, &ensemble, FILE).unwrap_err();
    assert!(
        matches!(error.problem(), Some(ProofProblem::Format { what: "a tree of more than 256 levels" })),
        "{error}"
    );
}

#[test]
fn thousands_of_merged_trees_are_proved() {
    let mut ensemble =
        random::ensemble(Shape { each: false, depth: 1, trees: 6_000, thresholds: 150, ..Shape::SMALL }, 4);
    // Of one split each, so that they become a few.
    ensemble.trees.retain(|tree| tree.nodes.len() == 3);
    assert!(ensemble.trees.len() > 2_000, "{}", ensemble.trees.len());
    for leaf in [Leaf::I8, Leaf::I16] {
        let settings = with!(Settings::default(), leaf, layout = Some(Layout::Compact));
        let bytes = compile(&ensemble, &settings).unwrap().bytes;
        let (proof, certificate) = prove(&bytes, &ensemble, FILE).unwrap();
        assert!(20 * proof.trees < ensemble.trees.len(), "{} trees", proof.trees);
        check(&certificate, &bytes, &ensemble, FILE).unwrap();
    }
}

#[test]
fn changed_bounds_of_early_exits_that_change_a_class_are_refused_in_both_ways() {
    let mut random = SmallRng::seed_from_u64(8);
    let [mut refused, mut harmless, mut wrong] = [0; 3];
    for each in [false, true] {
        let shape = Shape { objects: 3, trees: 24, depth: 4, thresholds: 20, each, ..Shape::SMALL };
        let ensemble = random::over_rows(random::ensemble(shape, 12), 3, 0.1);
        for bytes in early_exits(&ensemble, None).into_iter().step_by(2) {
            let (_, certificate) = prove(&bytes, &ensemble, FILE).unwrap();
            let model = Model::new(&bytes).unwrap();
            let section = model.optional_sections().find(|section| section.tag == Tag::EarlyExit.code()).unwrap();
            let at = section.content.as_ptr().addr() - bytes.as_ptr().addr();
            let encoder = Encoder::of(&model);
            let value = |random: &mut SmallRng| match random.random_range(0..10) {
                0 => f64::NAN,
                _ => f64::from(random.random_range(-40_000..40_000_i32)) / 8.0,
            };
            let rows: Vec<Vec<i32>> = (0..1_000).map(|_| encoder.row(&[0; 3].map(|_| value(&mut random)))).collect();
            let mut changes: Vec<Vec<u8>> = (0..8 * section.content.len())
                .step_by(3)
                .map(|bit| {
                    let mut changed = bytes.clone();
                    changed[at + bit / 8] ^= 1 << (bit % 8);
                    changed
                })
                .collect();
            changes.extend((0..section.content.len() / 8).map(|place| {
                let mut changed = bytes.clone();
                changed[at + 8 * place + 4..][..4].fill(0);
                changed
            }));
            for mut changed in changes {
                sealed(&mut changed);
                let model = Model::new(&changed).unwrap();
                let of_changed = crc::Crc::<u64>::new(&crc::CRC_64_XZ).checksum(&changed);
                let certificate = Certificate { model: of_changed, ..certificate.clone() };
                let is_refused = [
                    prove(&changed, &ensemble, FILE).is_err(),
                    check(&certificate, &changed, &ensemble, FILE).is_err(),
                ];
                let mut room = [0; 3];
                let mut class =
                    |row: &Vec<i32>| model.class_of(row, &mut room) != model.predict_class(row, &mut [0; 3]);
                let is_wrong = rows.iter().any(&mut class);
                assert!(!is_wrong || is_refused == [true; 2], "{is_refused:?} of {:?}", model.layout());
                wrong += usize::from(is_wrong);
                refused += usize::from(is_refused == [true; 2]);
                harmless += usize::from(is_refused == [false; 2]);
            }
        }
    }
    println!("{wrong} changes change a class, {refused} are refused, {harmless} are proved");
    assert!(wrong > 5 && refused > 40 && harmless > 100, "{wrong} {refused} {harmless}");
}
