//! The compiled model against the full one: 20,000 touches and 10,000 sequences.
//! `PALPATE_REPETITIONS=50 cargo test --release -p palpate-tests --test whole parity::` compares a million touches.

use palpate::capture::capture;
use palpate::compile::{Leaf, Settings, compile};
use palpate::ensemble::train::{self, train};
use palpate::ensemble::{Ensemble, Node};
use palpate::evaluate::parity::{Parity, parity};
use palpate::touches::{Dataset, ObjectTouches, Origin, Source};
use palpate::with;
use palpate_onboard::Model;
use palpate_shared::Descriptor;
use palpate_tests::random;
use std::sync::LazyLock;

const TOUCHES: usize = 20_000;
const SEQUENCES: usize = 10_000;

/// Bytes of a compiled model.
fn size(ensemble: &Ensemble, leaf: Leaf) -> usize {
    compile(ensemble, &with!(Settings::default(), leaf)).unwrap().bytes.len()
}

/// Touches of the built-in objects, without poses and with them; captured only once, as all tests need them.
static CAPTURED: LazyLock<[Dataset; 2]> = LazyLock::new(|| {
    let objects = palpate::mesh::builtin::all().unwrap();
    [false, true].map(|pose| {
        let directory = tempfile::tempdir().unwrap();
        let settings = Origin { touches: 1_500, pose, ..Origin::default() }.into();
        capture(&objects, &settings, directory.path(), &()).unwrap();
        Dataset::read(directory.path()).unwrap()
    })
});

fn captured(pose: bool) -> &'static Dataset {
    &CAPTURED[usize::from(pose)]
}

/// The published method.
static PUBLISHED: LazyLock<Ensemble> =
    LazyLock::new(|| train(captured(false), &train::Settings::paper(), &()).unwrap());

/// Touches, including partial ones, spread far beyond those of the training.
fn spread(dataset: &Dataset, count: usize) -> Dataset {
    let touches = random::touches(count, 4);
    let share = count / dataset.objects.len();
    let objects = dataset.objects.iter().zip(touches.chunks(share));
    let objects = objects.map(|(object, part)| ObjectTouches::new(&object.name, part.to_vec(), Source::Object));
    Dataset::new(objects.collect())
}

fn hold(ensemble: &Ensemble, dataset: &Dataset) -> (Parity, Parity) {
    let count = TOUCHES * palpate_tests::repetitions(1);
    let compiled = compile(ensemble, &with!(Settings::default(), leaf = Leaf::I16)).unwrap();
    let model = Model::new(&compiled.bytes).unwrap();
    let touches = parity(ensemble, &model, &spread(dataset, count), 0, 1, &()).unwrap();
    let sequences = parity(ensemble, &model, dataset, SEQUENCES, 1, &()).unwrap();
    assert_eq!((touches.touches, sequences.sequences), (count, SEQUENCES));
    println!("{touches:?}\n{sequences:?}");
    (touches, sequences)
}

#[test]
fn the_published_methods_margins_stay_within_a_bound_that_is_near_and_its_verdicts_are_equal() {
    let dataset = captured(false);
    let (touches, sequences) = hold(&PUBLISHED, dataset);
    assert!(touches.max_margin_error > 0.0 && touches.max_margin_error <= touches.stated_bound);
    assert!(touches.stated_bound <= 4.0 * touches.max_margin_error);
    assert!(sequences.max_margin_error <= sequences.stated_bound);
    assert_eq!(sequences.verdict_differs, 0);
}

#[test]
fn the_compact_methods_margins_and_verdicts_are_the_full_models_own() {
    for descriptor in [Descriptor::Curvature, Descriptor::Oriented] {
        let dataset = captured(true);
        let ensemble = train(dataset, &with!(train::Settings::compact(), descriptor), &()).unwrap();
        let (touches, sequences) = hold(&ensemble, dataset);
        assert_eq!((touches.stated_bound, touches.max_margin_error, touches.best_differs), (0.0, 0.0, 0));
        assert_eq!((sequences.verdict_differs, sequences.touches_differ), (0, 0));
    }
}

#[test]
fn leaves_that_were_not_rounded_in_training_stay_within_a_bound_that_is_near() {
    let dataset = captured(true);
    let settings = with!(train::Settings::compact(), descriptor = Descriptor::Oriented, leaf_bits = None);
    let (touches, sequences) = hold(&train(dataset, &settings, &()).unwrap(), dataset);
    assert!(touches.max_margin_error > 0.0 && touches.max_margin_error <= touches.stated_bound);
    assert!(touches.stated_bound <= 4.0 * touches.max_margin_error);
    assert_eq!(sequences.verdict_differs, 0);
}

#[test]
fn a_thousand_one_output_trees_take_six_bytes_a_split_and_forty_multi_output_trees_of_depth_five_17_kb() {
    let dataset = captured(false);
    let one = &*PUBLISHED;
    let nodes = one.trees.iter().flat_map(|tree| &tree.nodes);
    let splits = nodes.filter(|node| matches!(node, Node::Split { .. })).count();
    assert!(one.trees.len() == 1000 && size(one, Leaf::I16) <= 6 * splits, "{splits} splits");
    let each = train(dataset, &with!(train::Settings::compact(), rounds = 40, depth = 5), &()).unwrap();
    let bytes = size(&each, Leaf::I8);
    assert!(each.trees.len() == 40 && bytes <= 17_000, "{bytes} bytes");
}
