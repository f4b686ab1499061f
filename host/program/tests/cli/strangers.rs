//! Objects that a model does not know: from shapes to figures, as a user does it.

use crate::{palpate, stderr, stdout, succeeds};
use serde_json::Value;
use std::path::Path;

/// Touches of objects that bend by up to so many microseconds; other seeds are other touches.
fn touches(directory: &Path, objects: &[(&str, u64)], count: u64, seed: u64) {
    std::fs::create_dir(directory).unwrap();
    for &(name, most) in objects {
        crate::touches(&directory.join(format!("{name}.txt")), [most, count, seed], false, "");
    }
}

const KNOWN: [(&str, u64); 2] = [("bowl", 100_000), ("fork", 200_000)];
const SHAPES: [(&str, u64); 3] = [("shape-a", 50_000), ("shape-b", 400_000), ("shape-c", 700_000)];

#[test]
fn a_stranger_is_unknown_to_a_model_that_was_calibrated_for_strangers() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    touches(&at.join("data"), &KNOWN, 3_000, 1);
    touches(&at.join("shapes"), &SHAPES, 2_000, 1);
    touches(&at.join("fresh"), &KNOWN, 60_000, 2);
    touches(&at.join("unseen"), &KNOWN, 4_000, 3);
    touches(&at.join("others"), &[("kettle", 550_000)], 4_000, 3);
    let trained =
        succeeds(at, &["train", "data", "-o", "e.json", "--trees", "rounds=10", "--background", "shapes", "--json"]);
    let trained: Value = serde_json::from_str(&trained).unwrap();
    assert_eq!(trained["objects"], 2, "a background is no object");
    succeeds(at, &["export", "e.json", "-o", "m.palpate"]);
    let wanted = ["--strangers", "certain", "--background", "shapes", "--json"];
    let calibrated = succeeds(at, &[&["calibrate", "m.palpate", "fresh", "-o", "c.palpate"][..], &wanted].concat());
    let calibrated: Value = serde_json::from_str(&calibrated).unwrap();
    assert_eq!(calibrated["strangers"]["held"], "certain");
    assert!(calibrated["strangers"]["false_alarms"].as_f64().unwrap() <= 0.02, "{calibrated}");

    let arguments = ["evaluate", "c.palpate", "unseen", "--unknown", "others", "--json"];
    let figures: Value = serde_json::from_str(&succeeds(at, &arguments)).unwrap();
    let strangers = &figures["strangers"];
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(number(&strangers["false_alarms"]) < 0.03, "{strangers}");
    assert!(number(&strangers["detected"]["120"]) > 0.9 && number(&strangers["wrong_name"]) < 0.05, "{strangers}");
    assert!(strangers["detected"]["30"].is_number() && strangers["detected"]["60"].is_number());
    assert!(succeeds(at, &arguments[..5]).contains("kettle"));

    // Line by line: the stranger's first verdict is unknown, and never the background's name.
    let verdicts = succeeds(at, &["recognize", "c.palpate", "others/kettle.txt", "--json"]);
    assert!(!verdicts.contains("background"));
    let first = verdicts.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let first = first.map(|line| line["verdict"].as_str().unwrap().to_owned()).find(|verdict| verdict != "undecided");
    assert_eq!(first.as_deref(), Some("unknown"));

    let inspected: Value = serde_json::from_str(&succeeds(at, &["inspect", "c.palpate", "--json"])).unwrap();
    assert_eq!((&inspected["background"], &inspected["strangers"]["held"]), (&true.into(), &"certain".into()));
    assert_eq!(inspected["objects"].as_array().unwrap().len(), 2);
    assert!(succeeds(at, &["inspect", "c.palpate"]).contains("strangers"));
}

#[test]
fn a_test_is_calibrated_on_recordings_and_those_without_a_sequence_are_named() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    touches(&at.join("data"), &KNOWN, 3_000, 1);
    touches(&at.join("shapes"), &SHAPES, 500, 1);
    touches(&at.join("fresh"), &KNOWN, 40_000, 2);
    // Both objects bend more than they are simulated.
    touches(&at.join("robot"), &[("bowl", 140_000), ("fork", 320_000)], 4_000, 3);
    succeeds(at, &["train", "data", "-o", "e.json", "--trees", "rounds=10"]);
    succeeds(at, &["export", "e.json", "-o", "m.palpate"]);
    let alone =
        ["calibrate", "m.palpate", "fresh", "-o", "c.palpate", "--strangers", "likely", "--background", "shapes"];
    let with = [&alone[..], &["--recorded", "robot"]].concat();
    let json = |arguments: &[&str]| -> Value {
        serde_json::from_str(&succeeds(at, &[arguments, &["--json"]].concat())).unwrap()
    };
    assert!(json(&alone)["strangers"].get("recorded").is_none());
    let made = json(&with);
    let recorded = &made["strangers"]["recorded"];
    assert!(recorded["before"]["sequences"].as_u64().unwrap() > 500, "{made}");
    let [alarms, sequences, supported] =
        ["alarms", "sequences", "supported"].map(|key| recorded[key].as_f64().unwrap());
    assert!(alarms <= supported * sequences, "{made}");
    let text = succeeds(at, &with);
    assert!(text.contains("The test rests on recorded touches"), "{text}");
    touches(&at.join("few"), &KNOWN, 4, 3);
    let message = stderr(palpate(at, &[&alone[..], &["--recorded", "few"]].concat()), 1);
    assert!(
        message.contains("few: the 4 recorded approaches to bowl make no sequence that ends with a name"),
        "{message}"
    );
}

#[test]
fn a_known_object_is_no_stranger_and_says_so() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    touches(&at.join("data"), &KNOWN, 400, 1);
    succeeds(at, &["train", "data", "-o", "e.json", "--trees", "rounds=3"]);
    let message = stderr(palpate(at, &["evaluate", "e.json", "data", "--unknown", "data"]), 1);
    assert!(message.contains("data: the model knows the object bowl"), "{message}");
    succeeds(at, &["export", "e.json", "-o", "m.palpate"]);
    let arguments = ["calibrate", "m.palpate", "data", "-o", "c.palpate", "--strangers", "maybe"];
    assert!(stderr(palpate(at, &arguments), 2).contains("off, likely, certain"));
    assert!(!at.join("c.palpate").exists());
}

#[test]
fn a_background_that_was_captured_otherwise_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    touches(&at.join("data"), &KNOWN, 400, 1);
    touches(&at.join("shapes"), &SHAPES, 400, 1);
    std::fs::write(at.join("shapes/partial.txt"), "0 - 0.1\n".repeat(100)).unwrap();
    let message = stderr(palpate(at, &["train", "data", "-o", "e.json", "--background", "shapes"]), 1);
    assert!(message.contains("approaches") && message.contains("palpate capture background"), "{message}");
    touches(&at.join("named"), &[("background", 100_000), ("fork", 200_000)], 400, 1);
    std::fs::remove_file(at.join("shapes/partial.txt")).unwrap();
    let message = stderr(palpate(at, &["train", "named", "-o", "e.json", "--background", "shapes"]), 1);
    assert!(message.contains("called background"), "{message}");
    assert!(!at.join("e.json").exists());
}

#[test]
fn shares_of_strangers_are_dashes_where_touches_run_out_before_a_verdict() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    touches(&at.join("data"), &KNOWN, 1_000, 1);
    touches(&at.join("unseen"), &KNOWN, 1_000, 3);
    touches(&at.join("few"), &[("kettle", 550_000)], 4, 3);
    touches(&at.join("many"), &[("kettle", 550_000)], 1_000, 3);
    succeeds(at, &["train", "data", "-o", "e.json", "--trees", "rounds=5"]);
    succeeds(at, &["export", "e.json", "-o", "m.palpate"]);
    let evaluated = |others: &str, more: &[&str]| {
        let wanted =
            ["evaluate", "m.palpate", "unseen", "--sequences", "200", "--error-rate", "0.01%", "--unknown", others];
        succeeds(at, &[&wanted, more].concat())
    };
    let text = evaluated("few", &[]);
    assert!(text.contains("kettle –") && text.contains("A dash (–): not known"), "{text}");
    assert!(text.contains("drawn from 2 at least"), "{text}");
    let figures: Value = serde_json::from_str(&evaluated("few", &["--json"])).unwrap();
    let strangers = &figures["strangers"];
    assert!(strangers["wrong_name"].is_null() && strangers["detected"]["30"].is_null(), "{strangers}");
    assert_eq!(
        strangers["fewest_touches"], 2,
        "two of the four are later than any that the model was trained on: {strangers}"
    );
    assert!(strangers["used_up"].as_f64().unwrap() > 0.01, "{strangers}");
    let text = evaluated("many", &[]);
    assert!(!text.contains("A dash") && text.contains("Got a name: kettle "), "{text}");
}

#[test]
fn a_promise_for_other_noise_than_that_of_the_training_is_noted() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    touches(&at.join("data"), &KNOWN, 1_000, 1);
    touches(&at.join("fresh"), &KNOWN, 30_000, 2);
    succeeds(at, &["train", "data", "-o", "e.json", "--trees", "rounds=5", "--real", "noise=0..5ms,timer=1ms"]);
    succeeds(at, &["export", "e.json", "-o", "m.palpate"]);
    let calibrated = |more: &[&str]| {
        let output = palpate(
            at,
            &[&["calibrate", "m.palpate", "fresh", "-o", "c.palpate", "--error-rate", "10%"], more].concat(),
        );
        let said = String::from_utf8(output.stderr.clone()).unwrap();
        stdout(output);
        said
    };
    let note = calibrated(&[]);
    assert!(note.contains("trained on touches with noise of 0 to 5 ms, a timer of 1 ms"), "{note}");
    assert!(note.contains("for touches with no noise") && note.contains("--real noise=0..5ms,timer=1ms"), "{note}");
    assert!(!calibrated(&["--real", "noise=0..5ms,timer=1ms"]).contains("note:"));
    assert!(calibrated(&["--quiet"]).is_empty());
}
