//! Objects that are learned from recorded touches: `palpate train --teach`.

use crate::{palpate, stderr, stdout, succeeds};
use serde_json::Value;
use std::path::Path;

/// Touches of an object that bends by up to so many microseconds; some miss a finger.
fn touches(path: &Path, most: u64, count: u64, seed: u64, pose: &str) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    crate::touches(path, [most, count, seed], true, pose);
}

const POSE: &str = " 0 0 1 1 0 0";

/// Two simulated objects in `data`, other touches of them and of a pot in `unseen`, 300 recorded touches in `pot.txt`.
fn set_up(pose: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    for (folder, count, seed) in [("data", 3_000, 1), ("unseen", 3_000, 2)] {
        for (name, most) in [("bowl", 100_000), ("fork", 200_000)] {
            touches(&at.join(folder).join(format!("{name}.txt")), most, count, seed, pose);
        }
    }
    touches(&at.join("unseen/pot.txt"), 500_000, 3_000, 2, pose);
    touches(&at.join("pot.txt"), 500_000, 300, 5, pose);
    directory
}

#[track_caller]
fn fails(directory: &Path, arguments: &[&str], code: i32, expected: &str) {
    crate::fails(directory, arguments, code, expected);
    assert!(!directory.join("t.json").exists(), "something was written");
}

#[track_caller]
fn fails_with(directory: &Path, arguments: &[&str], expected: &str) {
    let message = stderr(palpate(directory, arguments), 1);
    assert!(message.contains(expected), "{message}");
}

#[track_caller]
fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

const QUICK: [&str; 2] = ["--trees", "rounds=6,depth=4"];

#[test]
fn a_recorded_object_is_taught_exported_and_recognized() {
    let place = set_up("");
    let at = place.path();
    let text = succeeds(at, &[&["train", "data", "--teach", "pot.txt", "-o", "t.json"], &QUICK[..]].concat());
    for part in [
        "pot: 300 recorded approaches, 300 of them evidence",
        "recorded touches that were held out",
        "approaches  recognized",
        "Of the other objects",
        "No promise can be made yet. To promise 1 % wrong names takes 299 sequences that end with a name, none of them a wrong one, 100 of each object",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(
        text.contains("to pot would hardly help") || text.contains("approaches to pot the error would be"),
        "{text}"
    );
    succeeds(at, &["export", "t.json", "-o", "t.palpate"]);
    let extend = ["train", "data", "--extend", "t.json", "--teach", "cup.txt", "-o", "u.json", "--page", "cup.html"];
    touches(&at.join("cup.txt"), 20_000, 100, 9, "");
    fails_with(at, &extend, "there are no touches of pot, which the ensemble knows");
    std::fs::copy(at.join("unseen/pot.txt"), at.join("data/pot.txt")).unwrap();
    succeeds(at, &extend);
    let page = std::fs::read_to_string(at.join("cup.html")).unwrap();
    for part in ["Errors against approaches", "palpate train data --extend t.json", "<svg", "cup"] {
        assert!(page.contains(part), "{part}");
    }
    let figures =
        json(&succeeds(at, &["evaluate", "t.palpate", "unseen", "--at", "20", "--sequences", "300", "--json"]));
    for object in ["bowl", "fork", "pot"] {
        assert!(figures["per_object"][object]["20"].as_f64() > Some(0.8), "{object}: {}", figures["per_object"]);
    }
    // The ensemble knows the recorded touches again.
    std::fs::create_dir(at.join("same")).unwrap();
    std::fs::copy(at.join("pot.txt"), at.join("same/pot.txt")).unwrap();
    std::fs::copy(at.join("unseen/bowl.txt"), at.join("same/bowl.txt")).unwrap();
    let output = palpate(at, &["evaluate", "t.json", "same", "--at", "20"]);
    let warning = String::from_utf8(output.stderr).unwrap() + &String::from_utf8(output.stdout).unwrap();
    assert!(warning.contains("pot") && warning.contains("trained"), "{warning}");
}

#[test]
fn teaching_an_ensemble_that_is_there_gives_what_training_it_again_gives() {
    let place = set_up("");
    let at = place.path();
    let read = |name: &str| std::fs::read(at.join(name)).unwrap();
    succeeds(at, &[&["train", "data", "-o", "e.json"], &QUICK[..]].concat());
    succeeds(at, &["train", "data", "--extend", "e.json", "--teach", "pot.txt", "-o", "extended.json"]);
    for (name, more) in [("one.json", ["--threads", "1"]), ("three.json", ["--threads", "3"])] {
        succeeds(at, &[&["train", "data", "--teach", "pot.txt", "-o", name], &QUICK[..], &more].concat());
        assert!(read(name) == read("extended.json"), "{name} differs");
    }
    let seed = ["--seed", "2"];
    succeeds(at, &[&["train", "data", "--teach", "pot.txt", "-o", "seed.json"], &QUICK[..], &seed].concat());
    assert!(read("seed.json") != read("one.json"));
}

#[test]
fn several_recordings_are_taught_at_once_and_alone() {
    let place = set_up("");
    let at = place.path();
    touches(&at.join("more/cup.txt"), 20_000, 120, 7, "");
    let trained = json(&succeeds(
        at,
        &[&["train", "data", "--teach", "pot.txt", "--teach", "more", "-o", "both.json", "--json"], &QUICK[..]]
            .concat(),
    ));
    assert_eq!(trained["objects"], 4);
    let taught = trained["taught"]["objects"].as_array().unwrap();
    assert_eq!(taught.iter().map(|object| object["name"].as_str().unwrap()).collect::<Vec<_>>(), ["cup", "pot"]);
    assert!(taught[1]["recognized"].as_f64() > Some(0.7), "{taught:?}");
    let alone = ["train", "--teach", "pot.txt", "--teach", "more/cup.txt", "-o", "alone.json", "--json"];
    let trained = json(&succeeds(at, &[&alone[..], &QUICK].concat()));
    assert_eq!((&trained["objects"], &trained["touches"]), (&2.into(), &420.into()));
    assert!(trained["taught"]["objects"][0]["recognized"].as_f64() > Some(0.8), "{trained}");
    let one = ["train", "--teach", "pot.txt", "-o", "t.json"];
    fails(at, &one, 1, "there is only one object to train on");
    let noisy = [&alone[..5], &["-o", "t.json", "--real", "noise=5ms"]].concat();
    fails(at, &noisy, 2, "recorded ones have noise of their own");
    fails(at, &["train", "data", "--teach", "pot.txt", "--teach", "unseen", "-o", "t.json"], 1, "pot was given twice");
}

#[test]
fn recorded_touches_of_known_objects_adjust_the_model_and_new_ones_are_taught() {
    let place = set_up("");
    let at = place.path();
    // This bowl and fork bend more than the simulated ones.
    touches(&at.join("robot/bowl.txt"), 170_000, 300, 5, "");
    touches(&at.join("robot/fork.txt"), 330_000, 300, 6, "");
    let train = ["train", "data", "--teach", "robot", "-o", "adjusted.json"];
    let made = json(&succeeds(at, &[&train[..], &["--json"], &QUICK].concat()));
    assert_eq!((&made["objects"], &made["adjusted"]["is_better"]), (&2.into(), &true.into()), "{made}");
    assert!(made["adjusted"]["adjusted"]["loss"].as_f64() < made["adjusted"]["given"]["loss"].as_f64(), "{made}");
    assert!(made["taught"].is_null(), "{made}");
    let text = succeeds(at, &[&train[..], &QUICK].concat());
    assert!(text.contains("bowl (300), fork (300)") && text.contains("The adjusted model is better"), "{text}");
    let both = ["train", "data", "--teach", "robot", "--teach", "pot.txt", "-o", "both.json", "--json"];
    let made = json(&succeeds(at, &[&both[..], &QUICK].concat()));
    assert_eq!((&made["objects"], &made["taught"]["objects"][0]["name"]), (&3.into(), &"pot".into()), "{made}");
    // Recordings like the simulation do not improve it.
    touches(&at.join("same/bowl.txt"), 100_000, 60, 8, "");
    let text = succeeds(at, &[&["train", "data", "--teach", "same", "-o", "same.json"][..], &QUICK].concat());
    let is_kept = text.contains("no better than the given one");
    let plain = succeeds(at, &[&["train", "data", "-o", "plain.json"][..], &QUICK].concat());
    assert!(plain.contains("plain.json") && (is_kept || text.contains("is better")), "{text}");
    let is_same = std::fs::read(at.join("same.json")).unwrap() == std::fs::read(at.join("plain.json")).unwrap();
    assert_eq!(is_same, is_kept, "{text}");
    fails(at, &["train", "data", "--teach", "robot", "-o", "t.json", "--page", "p.html"], 2, "page is p.html");
}

#[test]
fn what_does_not_go_together_is_named() {
    let place = set_up("");
    let at = place.path();
    let teach = |recorded: &'static str| ["train", "data", "--teach", recorded, "-o", "t.json", "--trees", "rounds=2"];
    touches(&at.join("few/pot.txt"), 500_000, 12, 5, "");
    fails(at, &teach("few"), 1, "only 12 recorded touches of pot are evidence");
    touches(&at.join("shy/bowl.txt"), 100_000, 12, 5, "");
    fails(at, &teach("shy"), 1, "only 12 recorded touches of bowl are evidence");
    std::fs::write(at.join("cup.txt"), "0 0.1 0.2\n0 0.1 -\n0 zero 0.2\n").unwrap();
    fails(at, &teach("cup.txt"), 1, "cup.txt:3: \"zero\" is not a number");
    std::fs::write(at.join("cup.csv"), "0 0.1 0.2\n").unwrap();
    fails(at, &teach("cup.csv"), 1, "cup.csv: not a file of touches by its name");
    fails(at, &teach("nowhere.txt"), 1, "nowhere.txt: cannot read");
    // Every line has all three contacts: not every approach was recorded.
    std::fs::write(at.join("full.txt"), "0 0.1 0.2\n0 0.2 0.3\n".repeat(50)).unwrap();
    fails(at, &teach("full.txt"), 1, "only full touches were recorded");
    let full = ["train", "data", "--teach", "full.txt", "-o", "full.json", "--trees", "rounds=2", "--evidence", "full"];
    succeeds(at, &full);
    let paper = [&teach("pot.txt")[..], &["--preset", "paper"]].concat();
    fails(at, &paper, 1, "a leaf of the ensemble holds one value");
    fails(at, &["train", "-o", "t.json"], 2, "<DIRECTORY>");
    fails(at, &["train", "data", "--extend", "e.json", "-o", "t.json"], 2, "--teach");
    let both = ["train", "data", "--extend", "e.json", "--teach", "pot.txt", "-o", "t.json", "--trees", "rounds=2"];
    fails(at, &both, 2, "--trees");
    // A recording is never written over.
    fails(at, &["train", "data", "--teach", "pot.txt", "-o", "pot.txt"], 2, "another file than what is read");
}

#[test]
fn a_recording_with_another_probe_or_without_poses_is_refused() {
    let place = set_up(POSE);
    let at = place.path();
    touches(&at.join("plain/cup.txt"), 500_000, 100, 5, "");
    let oriented = |recorded: &'static str| {
        ["train", "data", "--teach", recorded, "-o", "t.json", "--descriptor", "oriented", "--trees", "rounds=2"]
    };
    fails(at, &oriented("plain"), 1, "touches of cup have no pose");
    stdout(palpate(at, &[&oriented("pot.txt")[..4], &["-o", "posed.json", "--descriptor", "oriented"]].concat()));
    // Poses that the model does not need are no obstacle.
    succeeds(at, &["train", "data", "--teach", "pot.txt", "-o", "blind.json", "--trees", "rounds=2"]);
    for (directory, spacing) in [("narrow", "1.5"), ("wide", "2")] {
        let probe = format!("radius = 0.15\nspacing = {spacing}\nspeed = 10.0\n");
        std::fs::write(at.join("probe.toml"), probe).unwrap();
        let objects = if directory == "narrow" { ["bowl", "fork"] } else { ["spoon", "mouse"] };
        let how = ["-o", directory, "--approaches", "300", "--probe", "probe.toml"];
        succeeds(at, &[&["capture"][..], &objects, &how].concat());
    }
    fails(at, &["train", "narrow", "--teach", "wide", "-o", "t.json", "--trees", "rounds=2"], 1, "spacing");
}
