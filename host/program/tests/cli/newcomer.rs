//! Guidance for someone who uses the program for the first time.

use crate::fixtures::{BOWL_AND_FORK, spread};
use crate::{Folder, fails, figures, globe, palpate, says, stderr, succeeds};
use serde_json::Value;
use std::fs;

#[test]
fn a_training_that_learned_nothing_and_numbers_below_0_are_called_what_they_are() {
    let at = &BOWL_AND_FORK.folder();
    let said = |words: &str| String::from_utf8(palpate(at, words).stderr).unwrap();
    let none = "no tree has a split: all touches look alike to it. Give thousands of touches";
    let hidden = "noise of 5.000 s on contact times hides all touches: the longest takes";
    assert!(!said("train data -o some.json --trees rounds=2").contains("warning"));
    assert!(said("train data -o noisy.json --trees rounds=2 --real noise=5s").contains(hidden));
    fs::create_dir(at.join("few")).unwrap();
    for name in ["bowl", "fork"] {
        fs::write(at.join(format!("few/{name}.txt")), "0 0.1 0.2\n".repeat(9)).unwrap();
    }
    assert!(said("train few -o few.json --trees rounds=2").contains(none));
    for words in ["capture bowl mouse -o out --approaches -5", "capture bowl mouse -o out --touches -1"] {
        fails(at, words, 2, "give a whole number, such as 21000");
    }
    fails(at, "capture bowl mouse -o out --seed -1", 2, "invalid value '-1' for '--seed");
}

#[test]
fn a_promise_that_is_tested_on_other_data_than_it_was_made_for_says_so_and_whether_it_is_kept() {
    let at = &Folder::new();
    // Their curvature often distinguishes them.
    let objects = [("bowl", 100_000), ("cup", 160_000), ("jug", 260_000)];
    for (name, numbers) in [
        ("train", 0..2_000),
        ("fresh", 1_000_000..1_020_000),
        ("unseen", 2_000_000..2_004_000),
        ("full", 3_000_000..3_004_000),
    ] {
        spread(&at.join(name), &objects, numbers, name == "full");
    }
    succeeds(at, "train train -o e.json --trees rounds=10");
    succeeds(at, "export e.json -o m.palpate");
    succeeds(at, "calibrate m.palpate fresh -o c.palpate --error-rate 5%");
    let json = |data: &str| figures(at, &format!("evaluate c.palpate {data}"));
    let own = json("unseen");
    assert_eq!(own["promise"]["void"], serde_json::json!([]));
    assert_eq!(own["promise"]["finding"], "kept", "{}", own["promise"]);
    says(at, "evaluate c.palpate unseen", &["the promise is kept."]);
    // All touches are full, which the model takes for evidence.
    let other = json("full");
    let void = other["promise"]["void"].as_array().unwrap();
    assert_eq!(void[0], "promised for every approach, tested on full touches only", "{void:?}");
    assert!(["kept", "unclear", "broken"].contains(&other["promise"]["finding"].as_str().unwrap()));
    // Of which noise is the worst: what differs is said, and that it broke.
    let noisy = json("unseen --real noise=60ms");
    assert_eq!(noisy["promise"]["finding"], "broken", "{}", noisy["promise"]);
    // One of the objects is never touched.
    std::fs::create_dir(at.join("two")).unwrap();
    for name in ["cup.txt", "jug.txt"] {
        std::fs::copy(at.join("unseen").join(name), at.join("two").join(name)).unwrap();
    }
    let two = json("two");
    assert_eq!(two["promise"]["void"][0], "promised for all 3 objects of the model, tested on 2", "{two}");

    // The share of wrong names is of the names given, where it is of all sequences as well.
    let sequential = &own["approaches"]["sequential"];
    let number = |of: &Value| of.as_f64().unwrap();
    for name in ["bowl", "cup", "jug"] {
        let given = 1.0 - number(&sequential["undecided_per_object"][name]);
        let expected = number(&sequential["error_per_object"][name]) / given;
        let shown = number(&sequential["error_of_given_per_object"][name]);
        assert!((shown - expected).abs() < 1e-12, "{name}: {shown} {expected}");
    }
    let text = succeeds(at, "evaluate c.palpate unseen --max-touches 2");
    assert!(text.contains("of names  undecided") && text.contains("of names: of those that got a name"), "{text}");
    // A model without a test for strangers says that it has none, instead of a table of noughts.
    std::fs::create_dir(at.join("others")).unwrap();
    std::fs::copy(at.join("full/cup.txt"), at.join("others/vase.txt")).unwrap();
    let strangers = succeeds(at, "evaluate c.palpate unseen --unknown others");
    assert!(strangers.contains("has no test") && !strangers.contains("detected by"), "{strangers}");
}

#[test]
fn every_approach_is_not_summed_up_as_a_touch_and_a_mesh_gets_a_verdict() {
    let at = &Folder::new();
    globe(at, "cup", 6);
    globe(at, "jug", 8);
    let said = succeeds(at, "capture cup.obj jug.obj -o data --approaches 300");
    assert!(said.contains("touching") && said.contains("Every approach was kept"), "{said}");
    says(at, "view cup.obj -o cup.html", &["cup: usable"]);
    succeeds(at, "train data -o e.json --trees rounds=3");
    succeeds(at, "export e.json -o m.palpate");
    std::fs::write(at.join("rows.csv"), "a,b,c\n1,2,3\n").unwrap();
    let error = stderr(palpate(at, "verify m.palpate e.json rows.csv"), 1);
    assert!(error.contains("the model is over touches") && !error.contains("inspect"), "{error}");
}
