//! Objects that a model does not know: from shapes to figures, as a user does it.

use crate::fixtures::STRANGERS;
use crate::{cut, fails, figures, lines, palpate, says, stdout, succeeds};
use serde_json::Value;

#[test]
fn a_stranger_is_unknown_to_a_model_that_was_calibrated_for_strangers() {
    let at = &STRANGERS.folder();
    let trained = figures(at, "train data -o e.json --trees rounds=10 --background shapes");
    assert_eq!(trained["objects"], 2, "a background is no object");
    succeeds(at, "export e.json -o m.palpate");
    let calibrated = figures(at, "calibrate m.palpate fresh -o c.palpate --detect-unknown --background shapes");
    assert!(calibrated["strangers"]["false_alarms"].as_f64().unwrap() <= 0.02, "{calibrated}");

    let evaluate = "evaluate c.palpate unseen --unknown others";
    let strangers = &figures(at, evaluate)["strangers"];
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(number(&strangers["detected"]["120"]) > number(&strangers["wrong_name"]), "{strangers}");
    assert!(strangers["detected"]["30"].is_number() && strangers["detected"]["60"].is_number());
    assert!(strangers["false_alarms"].is_number() && succeeds(at, evaluate).contains("kettle"));

    // Line by line: the stranger's first verdict is unknown, and never the background's name.
    let verdicts = succeeds(at, "recognize c.palpate others/kettle.txt --json");
    assert!(!verdicts.contains("background"));
    let first = lines(&verdicts).into_iter().find(|line| line["verdict"] != "undecided").unwrap();
    assert_eq!(first["verdict"], "unknown");

    let inspected = figures(at, "inspect c.palpate");
    assert_eq!(inspected["background"], true);
    assert_eq!(inspected["objects"].as_array().unwrap().len(), 2);
    says(at, "inspect c.palpate", &["strangers"]);
}

#[test]
fn strangers_and_backgrounds_that_cannot_be_are_refused_and_nothing_is_written() {
    let at = &STRANGERS.folder();
    for (from, to) in [("fork", "named/fork"), ("bowl", "named/background"), ("bowl", "partial/shape")] {
        cut(&at.join(format!("data/{from}.txt")), &at.join(format!("{to}.txt")), 100);
    }
    std::fs::write(at.join("partial/more.txt"), "0 - 0.1\n".repeat(100)).unwrap();
    for (words, code, expected) in [
        ("evaluate ensemble.json data --unknown data", 1, "data: the model knows the object bowl"),
        ("calibrate model.palpate data -o x.palpate --strangers likely", 2, "was removed: use --detect-unknown"),
        ("calibrate model.palpate data -o x.palpate --background data", 2, "--detect-unknown"),
        ("calibrate model.palpate data -o x.palpate --detect-unknown --recorded data", 2, "--recorded"),
        ("train data -o x.json --background partial", 1, "palpate capture background"),
        ("train named -o x.json --background shapes", 1, "called background"),
    ] {
        fails(at, words, code, expected);
    }
    assert!(!at.join("x.palpate").exists() && !at.join("x.json").exists());
}

#[test]
fn shares_of_strangers_are_dashes_where_touches_run_out_before_a_verdict() {
    let at = &STRANGERS.folder();
    cut(&at.join("others/kettle.txt"), &at.join("few/kettle.txt"), 4);
    let evaluate = "evaluate model.palpate unseen --sequences 200 --error-rate 0.01% --unknown";
    let text = says(at, &format!("{evaluate} few"), &["kettle –", "A dash (–): not known"]);
    assert!(text.contains("drawn from 2 at least"), "{text}");
    let strangers = &figures(at, &format!("{evaluate} few"))["strangers"];
    assert!(strangers["wrong_name"].is_null() && strangers["detected"]["30"].is_null(), "{strangers}");
    assert_eq!(
        strangers["fewest_touches"], 2,
        "two of the four are later than any that the model was trained on: {strangers}"
    );
    assert!(strangers["used_up"].as_f64().unwrap() > 0.01, "{strangers}");
    let text = succeeds(at, &format!("{evaluate} others"));
    assert!(!text.contains("A dash") && text.contains("Got a name: kettle "), "{text}");
}

#[test]
fn a_promise_for_other_noise_than_that_of_the_training_is_noted() {
    let at = &STRANGERS.folder();
    succeeds(at, "train data -o e.json --trees rounds=5 --real noise=0..5ms,timer=1ms");
    succeeds(at, "export e.json -o m.palpate");
    let calibrated = |more: &str| {
        let output = palpate(at, &format!("calibrate m.palpate fresh -o c.palpate --error-rate 10%{more}"));
        let said = String::from_utf8(output.stderr.clone()).unwrap();
        stdout(output);
        said
    };
    let note = calibrated("");
    assert!(note.contains("trained on touches with noise of 0 to 5 ms, a timer of 1 ms"), "{note}");
    assert!(note.contains("for touches with no noise") && note.contains("--real noise=0..5ms,timer=1ms"), "{note}");
    assert!(!calibrated(" --real noise=0..5ms,timer=1ms").contains("note:"));
    assert!(calibrated(" --quiet").is_empty());
}
