//! Guidance for someone who uses the program for the first time.

use crate::{fails, figures, globe, palpate, stderr, succeeds};
use serde_json::Value;
use std::path::Path;

/// Data sets of three objects with `count` approaches each: a third of them misses the last finger, unless only `full`
/// touches are wanted. The curvature of the rest often distinguishes the objects.
fn approaches(directory: &Path, count: u64, first: u64, full: bool) {
    std::fs::create_dir_all(directory).unwrap();
    for (name, bend) in [("bowl", 100_000), ("cup", 160_000), ("jug", 260_000)] {
        let spread = |index: u64, prime: u64, range: u64| (index.wrapping_mul(prime) >> 7) % range;
        let lines = (first..first + count).map(|index| {
            let slope = spread(index, 0x9e37_79b9_7f4a_7c15, 300_007);
            let bend = spread(index, 0xd134_2543_de82_ef95, bend);
            let [a, b, c] = [0, slope / 2 + bend, slope].map(|micros| format!("{:.6}", micros as f64 * 1e-6));
            if !full && index % 3 == 0 { format!("{a} {b} -\n") } else { format!("{a} {b} {c}\n") }
        });
        std::fs::write(directory.join(format!("{name}.txt")), lines.collect::<String>()).unwrap();
    }
}

#[test]
fn a_promise_that_is_tested_on_other_data_than_it_was_made_for_says_so_and_whether_it_is_kept() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    approaches(&at.join("train"), 2_000, 0, false);
    approaches(&at.join("fresh"), 20_000, 1_000_000, false);
    approaches(&at.join("unseen"), 4_000, 2_000_000, false);
    approaches(&at.join("full"), 4_000, 3_000_000, true);
    succeeds(at, "train train -o e.json --trees rounds=10");
    succeeds(at, "export e.json -o m.palpate");
    succeeds(at, "calibrate m.palpate fresh -o c.palpate --error-rate 5%");
    let json = |data: &str| figures(at, &format!("evaluate c.palpate {data}"));
    let own = json("unseen");
    assert_eq!(own["promise"]["void"], serde_json::json!([]));
    assert_eq!(own["promise"]["finding"], "kept", "{}", own["promise"]);
    assert!(succeeds(at, "evaluate c.palpate unseen").contains("the promise is kept."));
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
    assert!(text.contains("of names undecided") && text.contains("of names: of those that got a name"), "{text}");
    // A model without a test for strangers says that it has none, instead of a table of noughts.
    std::fs::create_dir(at.join("others")).unwrap();
    std::fs::copy(at.join("full/cup.txt"), at.join("others/vase.txt")).unwrap();
    let strangers = succeeds(at, "evaluate c.palpate unseen --unknown others");
    assert!(strangers.contains("has no test") && !strangers.contains("detected by"), "{strangers}");
}

#[test]
fn messages_name_the_option_that_is_wrong_and_what_to_write() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    globe(at, "cup", 6);
    for (words, expected) in [
        ("calibrate m.palpate fresh -o c.palpate --error-rate 2", "for 2 percent write 2%"),
        ("evaluate m.palpate fresh --error-rate 2", "for 2 percent write 2%"),
        ("tune data --error-rate 2", "for 2 percent write 2%"),
        ("capture cup.obj -o data --true-size mm", "unit = \"mm\", radius = 1.5, spacing = 15, speed = 100"),
    ] {
        fails(at, words, 2, expected);
    }
    let error = stderr(palpate(at, "report --touches 5"), 2);
    assert!(error.contains("unexpected argument '--touches'") && !error.contains("-- --touches"), "{error}");
}

#[test]
fn every_approach_is_not_summed_up_as_a_touch_and_a_mesh_gets_a_verdict() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    globe(at, "cup", 6);
    globe(at, "jug", 8);
    let said = succeeds(at, "capture cup.obj jug.obj -o data --approaches 300");
    assert!(!said.contains("share") && said.contains("Every approach was kept"), "{said}");
    assert!(succeeds(at, "view cup.obj -o cup.html").contains("cup: usable"));
    succeeds(at, "train data -o e.json --trees rounds=3");
    succeeds(at, "export e.json -o m.palpate");
    std::fs::write(at.join("rows.csv"), "a,b,c\n1,2,3\n").unwrap();
    let error = stderr(palpate(at, "verify m.palpate e.json rows.csv"), 1);
    assert!(error.contains("the model is over touches") && !error.contains("inspect"), "{error}");
}
