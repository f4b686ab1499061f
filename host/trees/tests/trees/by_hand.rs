//! Ensembles that a program makes, from nodes and from another library's columns, and those that contradict themselves.

use crate::compiling::refusal;
use crate::fixtures::{assert_says, computed, leaf, split, stump};
use palpate_trees::compile::Settings;
use palpate_trees::ensemble::import::{Options, PartTree, Parts};
use palpate_trees::ensemble::{Ensemble, Node, Output, check_names};
use palpate_trees::error::{EnsembleProblem, NameProblem, TreeProblem};
use palpate_trees::shared::Descriptor;

type Change = fn(&mut Ensemble);

fn ensemble() -> Ensemble {
    stump(5.0, [[1.0, 2.0], [3.0, 4.0]])
}

fn changed(change: Change) -> Ensemble {
    let mut changed = ensemble();
    change(&mut changed);
    changed
}

/// Error of saving a changed ensemble, which leaves no file.
fn unsaved(change: Change) -> EnsembleProblem {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("ensemble.json");
    let error = changed(change).save(&path).unwrap_err();
    assert!(error.to_string().contains("ensemble.json: ") && !path.exists(), "{error}");
    error.problem::<EnsembleProblem>().unwrap_or_else(|| panic!("{error}")).clone()
}

fn root(ensemble: &mut Ensemble) -> &mut Node {
    &mut ensemble.trees[0].nodes[0]
}

#[test]
fn a_tree_that_contradicts_itself_is_neither_saved_nor_compiled() {
    let infinite = TreeProblem::LeafValue { node: 2, value: f32::INFINITY };
    let cases: [(Change, TreeProblem); 10] = [
        (|e| e.trees[0].nodes.clear(), TreeProblem::NoNodes),
        (|e| e.trees[0].output = Output::One(2), TreeProblem::Object { object: 2, objects: 2 }),
        (|e| e.trees[0].output = Output::One(1), TreeProblem::LeafValues { node: 1, found: 2, wanted: 1 }),
        (|e| *root(e) = leaf(&[]), TreeProblem::LeafValues { node: 0, found: 0, wanted: 2 }),
        (|e| e.trees[0].nodes[2] = leaf(&[0.0, f32::INFINITY]), infinite),
        (|e| *root(e) = split(0, 5.0, 9, 2), TreeProblem::Child { node: 0, side: "left", child: 9, nodes: 3 }),
        (|e| *root(e) = split(0, 5.0, 1, 7), TreeProblem::Child { node: 0, side: "right", child: 7, nodes: 3 }),
        (|e| *root(e) = split(0, 5.0, 0, 2), TreeProblem::ReachedTwice { node: 0 }),
        (|e| *root(e) = split(2, 5.0, 1, 2), TreeProblem::Feature { node: 0, feature: 2, features: 2 }),
        (|e| *root(e) = split(0, f32::NAN, 1, 2), TreeProblem::Threshold { node: 0, threshold: f32::NAN }),
    ];
    for (change, problem) in cases {
        // As text, since a threshold that is no number is not equal to itself.
        let expected = format!("Tree {{ tree: 0, problem: {problem:?} }}");
        assert_eq!(format!("{:?}", unsaved(change)), expected);
        assert_eq!(format!("{:?}", refusal(&changed(change), &Settings::default())), expected);
    }
}

#[test]
fn saving_an_ensemble_made_by_hand_that_contradicts_itself_is_an_error_and_no_panic() {
    let twice = EnsembleProblem::Tree { tree: 0, problem: TreeProblem::ReachedTwice { node: 1 } };
    assert_eq!(unsaved(|e| *root(e) = split(0, 5.0, 1, 1)), twice);
    assert_eq!(unsaved(|e| e.trees.clear()), EnsembleProblem::NoTrees);
    let margins = EnsembleProblem::BaseMargins { found: 1, objects: 2 };
    assert_eq!(unsaved(|e| e.base_margins = vec![0.0, f32::NAN]), margins);
    assert_eq!(unsaved(|e| e.objects.truncate(1)), EnsembleProblem::ObjectCount { count: 1 });
}

#[test]
fn a_saved_ensemble_is_read_as_it_was_where_its_schema_is_known() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("ensemble.json");
    ensemble().save(&path).unwrap();
    let schemas = [computed(Descriptor::Curvature)];
    let options = Options { schemas: &schemas, ..Options::default() };
    assert_eq!(Ensemble::load_with(&path, &options).unwrap(), ensemble());
    assert_says(Ensemble::load(&path).unwrap_err(), &["its descriptor \"curvature\" is unknown"]);
}

#[test]
fn names_that_no_file_or_model_can_hold_are_refused() {
    for (name, why) in [
        ("", NameProblem::Empty),
        ("fo\trk", NameProblem::Control),
        ("fork\n", NameProblem::Control),
        ("bowl", NameProblem::Twice),
        (&"x".repeat(256), NameProblem::Long),
    ] {
        let problem = check_names(&["bowl".into(), name.into()]).unwrap_err();
        assert_eq!(problem, EnsembleProblem::ObjectName { name: name.into(), why });
    }
    check_names(&["große Schüssel".into(), "x".repeat(255)]).unwrap();
    assert!(check_names(&vec!["x".into(); 257]).is_err());
}

fn part() -> PartTree {
    PartTree {
        output: Some(0),
        left: vec![1, -1, -1],
        right: vec![2, -1, -1],
        feature: vec![0, 0, 0],
        threshold: vec![0.1, 0.0, 0.0],
        missing_left: vec![true, false, false],
        values: vec![9.0, 1.0, 2.0],
    }
}

fn parts(tree: PartTree) -> Parts {
    Parts { kind: "a test".into(), features: vec!["x".into()], base: vec![0.5], trees: vec![tree], ..Parts::default() }
}

#[test]
fn at_or_below_the_threshold_is_left_for_every_number() {
    let ensemble = parts(part()).into_ensemble(None).unwrap();
    let margin = |ensemble: &Ensemble, x: f32| ensemble.margins_of_features(&[x])[0];
    for x in [0.1_f32, 0.1_f32.next_down(), 0.1_f32.next_up(), f32::NEG_INFINITY, f32::INFINITY] {
        assert_eq!(margin(&ensemble, x), if f64::from(x) <= 0.1 { 1.5 } else { 2.5 }, "{x}");
    }
    assert_eq!(margin(&ensemble, f32::NAN), 1.5);
    let infinite = PartTree { threshold: vec![f64::INFINITY, 0.0, 0.0], missing_left: vec![false; 3], ..part() };
    let ensemble = parts(infinite).into_ensemble(None).unwrap();
    for x in [f32::NEG_INFINITY, 0.0, f32::MAX, f32::INFINITY] {
        assert_eq!(margin(&ensemble, x), 1.5, "{x}");
    }
    assert_eq!(margin(&ensemble, f32::NAN), 2.5);
}

#[test]
fn trees_that_contradict_themselves_are_refused() {
    let column = TreeProblem::Column { column: "right", found: 2, wanted: 3 };
    for (tree, problem) in [
        (PartTree { right: vec![2, -1], ..part() }, column),
        (PartTree { left: vec![0, -1, -1], ..part() }, TreeProblem::ReachedTwice { node: 0 }),
        (
            PartTree { right: vec![3, -1, -1], ..part() },
            TreeProblem::Child { node: 0, side: "right", child: 3, nodes: 3 },
        ),
        (PartTree { feature: vec![1, 0, 0], ..part() }, TreeProblem::Feature { node: 0, feature: 1, features: 1 }),
        (PartTree { output: Some(1), ..part() }, TreeProblem::Object { object: 1, objects: 1 }),
        (PartTree::default(), TreeProblem::NoNodes),
    ] {
        let tree = if tree.left.is_empty() { PartTree { output: Some(0), ..tree } } else { tree };
        assert_eq!(parts(tree).into_ensemble(None), Err(EnsembleProblem::Tree { tree: 0, problem }));
    }
    let nan = PartTree { threshold: vec![f64::NAN, 0.0, 0.0], ..part() };
    let error = parts(nan).into_ensemble(None).unwrap_err();
    assert!(matches!(error, EnsembleProblem::Tree { problem: TreeProblem::Threshold { node: 0, .. }, .. }), "{error}");
}
