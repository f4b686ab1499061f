//! Ensembles that a program makes, from nodes and from another library's columns, and those that contradict themselves.

use crate::fixtures::computed;
use palpate_trees::ensemble::import::{Options, PartTree, Parts};
use palpate_trees::ensemble::{Ensemble, Node, Output, Provenance, Tree, check_names};
use palpate_trees::error::{EnsembleProblem, NameProblem, TreeProblem};
use palpate_trees::shared::Descriptor;

fn ensemble() -> Ensemble {
    let split = Node::Split { feature: 0, threshold: 5.0, missing_left: true, left: 1, right: 2 };
    let nodes = vec![split, Node::Leaf(vec![1.0, 2.0]), Node::Leaf(vec![3.0, 4.0])];
    Ensemble {
        inputs: computed(Descriptor::Curvature).into(),
        objects: vec!["bowl".into(), "fork".into()],
        base_margins: vec![0.0; 2],
        trees: vec![Tree { nodes, output: Output::Each }],
        origin: Provenance::default(),
    }
}

#[test]
fn saving_an_ensemble_made_by_hand_that_contradicts_itself_is_an_error_and_no_panic() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("ensemble.json");
    let refused = |change: &dyn Fn(&mut Ensemble)| {
        let mut changed = ensemble();
        change(&mut changed);
        let error = changed.save(&path).unwrap_err();
        assert!(error.to_string().contains("ensemble.json: ") && !path.exists(), "{error}");
        error.problem::<EnsembleProblem>().unwrap_or_else(|| panic!("{error}")).clone()
    };
    let split = |left, right, feature, threshold| Node::Split { feature, threshold, missing_left: true, left, right };
    let tree = |problem| EnsembleProblem::Tree { tree: 0, problem };
    let root = |node: Node| move |e: &mut Ensemble| e.trees[0].nodes[0] = node.clone();
    assert_eq!(
        refused(&root(split(1, 7, 0, 5.0))),
        tree(TreeProblem::Child { node: 0, side: "right", child: 7, nodes: 3 })
    );
    assert_eq!(refused(&root(split(1, 1, 0, 5.0))), tree(TreeProblem::ReachedTwice { node: 1 }));
    assert_eq!(refused(&root(split(0, 2, 0, 5.0))), tree(TreeProblem::ReachedTwice { node: 0 }));
    assert_eq!(refused(&root(split(1, 2, 2, 5.0))), tree(TreeProblem::Feature { node: 0, feature: 2, features: 2 }));
    assert!(matches!(
        refused(&root(split(1, 2, 0, f32::NAN))),
        EnsembleProblem::Tree { problem: TreeProblem::Threshold { .. }, .. }
    ));
    assert_eq!(refused(&root(Node::Leaf(vec![]))), tree(TreeProblem::LeafValues { node: 0, found: 0, wanted: 2 }));
    assert_eq!(
        refused(&|e| e.trees[0].nodes[2] = Node::Leaf(vec![0.0, f32::INFINITY])),
        tree(TreeProblem::LeafValue { node: 2, value: f32::INFINITY })
    );
    assert_eq!(refused(&|e| e.trees[0].nodes.clear()), tree(TreeProblem::NoNodes));
    assert_eq!(refused(&|e| e.trees[0].output = Output::One(2)), tree(TreeProblem::Object { object: 2, objects: 2 }));
    assert_eq!(refused(&|e| e.trees.clear()), EnsembleProblem::NoTrees);
    assert_eq!(
        refused(&|e| e.base_margins = vec![0.0, f32::NAN]),
        EnsembleProblem::BaseMargins { found: 1, objects: 2 }
    );
    assert_eq!(refused(&|e| e.objects.truncate(1)), EnsembleProblem::ObjectCount { count: 1 });
    ensemble().save(&path).unwrap();
    let schemas = [computed(Descriptor::Curvature)];
    let options = Options { schemas: &schemas, ..Options::default() };
    assert_eq!(Ensemble::load_with(&path, &options).unwrap(), ensemble());
    let unknown = Ensemble::load(&path).unwrap_err();
    assert!(unknown.to_string().contains("its descriptor \"curvature\" is unknown"), "{unknown}");
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
