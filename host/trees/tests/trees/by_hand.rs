//! Ensembles that a program makes, from nodes and from another library's columns, and those that contradict themselves.

use crate::compiling::refusal;
use crate::fixtures::{assert_says, computed, leaf, split, stump};
use palpate_trees::compile::Settings;
use palpate_trees::ensemble::import::{Options, PartTree, Parts};
use palpate_trees::ensemble::{Ensemble, Node, Output, check_names};
use palpate_trees::error::Error;
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
fn unsaved(change: Change) -> Error {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("ensemble.json");
    let error = changed(change).save(&path).unwrap_err();
    assert!(error.to_string().contains("ensemble.json: ") && !path.exists(), "{error}");
    error
}

fn root(ensemble: &mut Ensemble) -> &mut Node {
    &mut ensemble.trees[0].nodes[0]
}

#[test]
fn a_tree_that_contradicts_itself_is_neither_saved_nor_compiled() {
    let cases: [(Change, &str); 10] = [
        (|e| e.trees[0].nodes.clear(), "it has no nodes"),
        (|e| e.trees[0].output = Output::One(2), "it is for object 2 of 2"),
        (|e| e.trees[0].output = Output::One(1), "leaf 1 has 2 values instead of 1"),
        (|e| *root(e) = leaf(&[]), "leaf 0 has 0 values instead of 2"),
        (|e| e.trees[0].nodes[2] = leaf(&[0.0, f32::INFINITY]), "leaf 2 has the value inf, which is not finite"),
        (|e| *root(e) = split(0, 5.0, 9, 2), "node 0: its left child 9 is not one of 3 nodes"),
        (|e| *root(e) = split(0, 5.0, 1, 7), "node 0: its right child 7 is not one of 3 nodes"),
        (|e| *root(e) = split(0, 5.0, 0, 2), "node 0 is reached twice: the tree has a cycle or a shared branch"),
        (|e| *root(e) = split(2, 5.0, 1, 2), "node 0: it splits on feature 2, but there are 2"),
        (|e| *root(e) = split(0, f32::NAN, 1, 2), "node 0: its threshold NaN is not finite"),
    ];
    for (change, problem) in cases {
        let (unsaved, refused) = (unsaved(change), refusal(&changed(change), &Settings::default()));
        assert_eq!(unsaved.what(), format!("tree 0: {problem}"));
        assert_eq!(unsaved.remedy(), "The ensemble is damaged or was changed by hand; train or export it again.");
        assert_eq!(refused.what(), format!("cannot compile the ensemble: tree 0: {problem}"));
        assert_eq!(refused.remedy(), "Train it again, or check the program that wrote it.");
    }
}

#[test]
fn saving_an_ensemble_made_by_hand_that_contradicts_itself_is_an_error_and_no_panic() {
    assert_says(unsaved(|e| *root(e) = split(0, 5.0, 1, 1)), &["tree 0: node 1 is reached twice"]);
    assert_says(unsaved(|e| e.trees.clear()), &["it has no trees"]);
    let margins = "it has 1 finite base margins for 2 objects";
    assert_says(unsaved(|e| e.base_margins = vec![0.0, f32::NAN]), &[margins]);
    assert_says(unsaved(|e| e.objects.truncate(1)), &["it names 1 objects"]);
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
        ("", "an object has an empty name"),
        ("fo\trk", "the object's name \"fo\\trk\" has a control character in it"),
        ("fork\n", "the object's name \"fork\\n\" has a control character in it"),
        ("bowl", "it has the object \"bowl\" twice"),
        (&"x".repeat(256), "xx\" has more than 255 bytes"),
    ] {
        assert_says(check_names(&["bowl".into(), name.into()]).unwrap_err(), &[why, "Use 2 to 256 different names"]);
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
    for (tree, problem) in [
        (PartTree { right: vec![2, -1], ..part() }, "right has 2 entries instead of 3"),
        (PartTree { left: vec![0, -1, -1], ..part() }, "node 0 is reached twice"),
        (PartTree { right: vec![3, -1, -1], ..part() }, "node 0: its right child 3 is not one of 3 nodes"),
        (PartTree { feature: vec![1, 0, 0], ..part() }, "node 0: it splits on feature 1, but there are 1"),
        (PartTree { output: Some(1), ..part() }, "it is for object 1 of 1"),
        (PartTree { threshold: vec![f64::NAN, 0.0, 0.0], ..part() }, "node 0: its threshold NaN is not finite"),
        (PartTree { output: Some(0), ..PartTree::default() }, "it has no nodes"),
    ] {
        let error = parts(tree).into_ensemble(None).unwrap_err();
        assert!(error.what().starts_with(&format!("tree 0: {problem}")), "{error}");
    }
}
