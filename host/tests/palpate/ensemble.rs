use crate::fixtures::*;
use crate::synthetic;
use palpate::ensemble::train::{Settings, train};
use palpate::error::Result;
use serde_json::{Value, json};

/// Ensembles of trees of one object, and of trees of all.
static ENSEMBLES: LazyLock<[Ensemble; 2]> = LazyLock::new(|| {
    [false, true].map(|multi_output| {
        let settings = with!(Settings::compact(), multi_output, rounds = 4, depth = 3, counted = Some(Counted::Full));
        train(&synthetic::dataset(&[300, 200, 400], 1), &settings, &()).unwrap()
    })
});

fn ensemble(multi_output: bool) -> Ensemble {
    ENSEMBLES[usize::from(multi_output)].clone()
}

fn document(multi_output: bool) -> Value {
    let file = tempfile::NamedTempFile::new().unwrap();
    ensemble(multi_output).save(file.path()).unwrap();
    serde_json::from_slice(&std::fs::read(file.path()).unwrap()).unwrap()
}

fn load(text: &[u8]) -> Result<Ensemble> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    palpate::ensemble::load(file.path()).map_err(|error| {
        assert!(error.to_string().contains(&file.path().display().to_string()), "{error} names no file");
        assert_eq!(error.exit_code(), 1);
        error
    })
}

/// Error message for the document with the value at `pointer` replaced.
fn complaint(multi_output: bool, pointer: &str, value: Value) -> String {
    let mut changed = document(multi_output);
    *changed.pointer_mut(pointer).unwrap() = value;
    load(changed.to_string().as_bytes()).unwrap_err().to_string()
}

#[test]
fn what_is_saved_loads_again_bit_for_bit() {
    let file = tempfile::NamedTempFile::new().unwrap();
    for multi_output in [false, true] {
        let mut saved = ensemble(multi_output);
        for base_margins in [vec![0.5; 3], vec![0.1, -2.5e-8, 3.0]] {
            saved.base_margins = base_margins;
            saved.save(file.path()).unwrap();
            assert_eq!(palpate::ensemble::load(file.path()).unwrap(), saved);
        }
    }
}

#[test]
fn pruned_nodes_are_left_out() {
    let mut pruned = document(false);
    let tree = pruned.pointer_mut("/learner/gradient_booster/model/trees/0").unwrap();
    for (column, value) in [
        ("left_children", json!(-1)),
        ("right_children", json!(-1)),
        ("split_indices", json!(0)),
        ("split_conditions", json!(9.0)),
        ("default_left", json!(0)),
        ("split_type", json!(0)),
        ("base_weights", json!(9.0)),
    ] {
        tree[column].as_array_mut().unwrap().push(value);
    }
    tree["tree_param"]["num_nodes"] = json!(tree["left_children"].as_array().unwrap().len().to_string());
    assert_eq!(load(pruned.to_string().as_bytes()).unwrap(), ensemble(false));
}

#[test]
fn an_ensemble_with_another_number_of_features_than_its_descriptor_is_refused() {
    let complaint = complaint(true, "/learner/learner_model_param/num_feature", json!("3"));
    assert!(complaint.contains("it has 3 features, but its descriptor curvature has 2 (curvature, slope)"));
}

#[test]
fn what_contradicts_itself_is_refused_and_the_place_named() {
    let model = "/learner/gradient_booster/model";
    let trees = format!("{model}/trees");
    let cases = [
        (true, "/learner/attributes/palpate_descriptor", json!("shape"), "its descriptor \"shape\" is unknown"),
        (true, "/learner/attributes", json!({"palpate_descriptor": "curvature"}), "no attribute palpate_objects"),
        (true, "/learner/attributes/palpate_objects", json!("bowl"), "palpate_objects is not a JSON array"),
        (true, "/learner/attributes/palpate_objects", json!("[\"a\"]"), "names 1 objects"),
        (true, "/learner/attributes/palpate_objects", json!("[\"a\",\"a\",\"b\"]"), "\"a\" twice"),
        (true, "/learner/attributes/palpate_objects", json!("[\"a\",\"b\"]"), "it has 3 classes"),
        (true, "/learner/learner_model_param/base_score", json!("[1,2]"), "base_score"),
        (true, "/learner/learner_model_param/base_score", json!("NaN"), "not finite"),
        (
            true,
            "/learner/objective/name",
            json!("reg:squarederror"),
            "its objective is reg:squarederror. Train with multi:softprob",
        ),
        (true, "/learner/gradient_booster/name", json!("gblinear"), "booster is gblinear"),
        (true, &format!("{model}/tree_info"), json!([0]), "tree_info has 1 entries for 4 trees"),
        (false, &format!("{model}/tree_info/5"), json!(3), "tree 5: it is for object 3 of 3"),
        (true, &trees, json!([]), "no trees"),
        (true, &format!("{trees}/1/right_children/0"), json!(-7), "tree 1: node 0: its right child -7"),
        (true, &format!("{trees}/2/split_indices"), json!([0]), "tree 2: split_indices has 1 entries"),
        (
            true,
            &format!("{trees}/2/split_type/0"),
            json!(1),
            "tree 2: it splits on categories of the feature curvature",
        ),
        (true, &format!("{trees}/0/leaf_weights"), json!([0.5]), "leaf_weights has no 3 values"),
        (true, &format!("{trees}/0/leaf_weights/0"), json!(1e39), "number out of range"),
        (false, &format!("{trees}/0/split_conditions/0"), json!("x"), "expected f32"),
        (true, &format!("{trees}/3/tree_param/size_leaf_vector"), json!("2"), "hold 2 values for 3 objects"),
        (true, &format!("{trees}/3/tree_param/num_nodes"), json!("2"), "instead of 2"),
    ];
    for (multi_output, pointer, value, expected) in cases {
        let complaint = complaint(multi_output, pointer, value);
        assert!(complaint.contains(expected), "{pointer}: {complaint}");
    }
}

#[test]
fn what_is_no_json_is_refused_with_its_line() {
    for (text, expected) in [
        (&b"{\n  \"learner\": [\n"[..], ":3: not an ensemble in XGBoost's JSON format"),
        (b"", "it is empty"),
        (b"[1, 2]", "it is a list"),
        (b"{L\x00\x00\x00learner", "byte 10: not a whole model in the format XGBoost UBJSON"),
        (b"{\"version\":[3,2,0],\"learner\":{}}", "missing field"),
    ] {
        let complaint = load(text).unwrap_err().to_string();
        assert!(complaint.contains(expected), "{complaint}");
    }
    let missing = palpate::ensemble::load("no/such.json").unwrap_err().to_string();
    assert!(missing.contains("no/such.json: cannot read the ensemble"), "{missing}");
}

#[test]
fn weights_of_dropped_trees_are_read_beside_the_model() {
    let plain = ensemble(true);
    let weights = [0.5, 1.0, 0.25, 2.0];
    // Other places are those of the files in `tests/data/import`.
    let mut beside = document(true);
    beside["learner"]["gradient_booster"]["weight_drop"] = json!(weights);
    let weighted = load(beside.to_string().as_bytes()).unwrap();
    let leaf = |ensemble: &Ensemble, tree: usize| ensemble.trees[tree].nodes.last().unwrap().leaf().unwrap()[0];
    for (tree, weight) in weights.into_iter().enumerate() {
        assert_eq!(leaf(&weighted, tree), leaf(&plain, tree) * weight);
    }
    beside["learner"]["gradient_booster"]["weight_drop"] = json!([1.0]);
    let complaint = load(beside.to_string().as_bytes()).unwrap_err().to_string();
    assert!(complaint.contains("weight_drop has 1 entries for 4 trees"), "{complaint}");
}

#[test]
fn finite_values_take_the_same_way_at_infinite_thresholds() {
    for (bound, missing) in
        [(f32::INFINITY, true), (f32::INFINITY, false), (f32::NEG_INFINITY, true), (f32::NEG_INFINITY, false)]
    {
        let mut infinite = ensemble(false);
        infinite.inputs = Inputs::unnamed(2);
        for tree in &mut infinite.trees {
            if let Node::Split { threshold, missing_left, .. } = &mut tree.nodes[0] {
                (*threshold, *missing_left) = (bound, missing);
            }
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        infinite.save(file.path()).unwrap();
        let read = palpate::ensemble::load(file.path()).unwrap();
        for first in [f32::MIN, -3e5, 0.0, 1e5, f32::MAX, f32::NAN] {
            for row in [[first, 0.0], [first, f32::NAN], [9e4, first]] {
                assert_eq!(read.margins_of_features(&row), infinite.margins_of_features(&row), "{bound} {row:?}");
            }
        }
    }
}

#[test]
fn trees_of_one_object_and_of_all_are_written_as_trees_of_all() {
    let (mut mixed, of_all) = (ensemble(false), ensemble(true));
    mixed.trees.extend(of_all.trees);
    let file = tempfile::NamedTempFile::new().unwrap();
    mixed.save(file.path()).unwrap();
    let read = palpate::ensemble::load(file.path()).unwrap();
    assert!(read.trees.iter().all(|tree| tree.output == Output::Each));
    for row in [[-3e5, 0.0], [f32::NAN, 2e4], [1e5, f32::NAN], [7.0, 9e4]] {
        assert_eq!(read.margins_of_features(&row), mixed.margins_of_features(&row));
    }
}
