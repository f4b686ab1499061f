//! Objects that are learned from recorded touches: `palpate train --teach`.

use crate::fixtures::TAUGHT;
use crate::{complains, fails, figures, holds, palpate, succeeds};
use std::fs;
use std::path::Path;

/// Touches of an object that bends by at most this number of microseconds; some miss a finger.
fn touches(path: &Path, most: u64, count: u64, seed: u64) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    crate::touches(path, [most, count, seed], true, "");
}

#[test]
fn a_recorded_object_is_taught_exported_and_recognized() {
    let at = &TAUGHT.folder();
    let text = succeeds(at, "train data --teach pot.txt -o t.json --trees rounds=6,depth=4");
    holds(&text, &["recorded touches that were held out", "Of the other objects"]);
    let pot = text.lines().find(|line| line.starts_with("pot ")).unwrap();
    assert!(pot.split_whitespace().take(3).eq(["pot", "300", "300"]), "{text}");
    succeeds(at, "export t.json -o t.palpate");
    let extend = "train data --extend t.json --teach cup.txt -o u.json";
    touches(&at.join("cup.txt"), 20_000, 100, 9);
    complains(palpate(at, extend), extend, 1, "there are no touches of pot, which the ensemble knows");
    fs::copy(at.join("unseen/pot.txt"), at.join("data/pot.txt")).unwrap();
    succeeds(at, extend);
    let found = figures(at, "evaluate t.palpate unseen --at 20 --sequences 300");
    for object in ["bowl", "fork", "pot"] {
        assert!(found["per_object"][object]["20"].as_f64() > Some(0.8), "{object}: {}", found["per_object"]);
    }
    // The ensemble knows the recorded touches again.
    fs::create_dir(at.join("same")).unwrap();
    fs::copy(at.join("pot.txt"), at.join("same/pot.txt")).unwrap();
    fs::copy(at.join("unseen/bowl.txt"), at.join("same/bowl.txt")).unwrap();
    let output = palpate(at, "evaluate t.json same --at 20");
    let warning = String::from_utf8(output.stderr).unwrap() + &String::from_utf8(output.stdout).unwrap();
    assert!(warning.contains("pot") && warning.contains("trained"), "{warning}");
}

#[test]
fn teaching_an_ensemble_that_is_there_gives_what_training_it_again_gives() {
    let at = &TAUGHT.folder();
    succeeds(at, "train data --extend ensemble.json --teach pot.txt -o extended.json");
    succeeds(at, "train data --teach pot.txt -o again.json --trees rounds=6,depth=4 --threads 1");
    assert!(fs::read(at.join("again.json")).unwrap() == fs::read(at.join("extended.json")).unwrap());
}

#[test]
fn several_recordings_are_taught_at_once_and_alone() {
    let at = &TAUGHT.folder();
    touches(&at.join("more/cup.txt"), 20_000, 120, 7);
    let trained = figures(at, "train data --teach pot.txt --teach more -o both.json --trees rounds=6,depth=4");
    assert_eq!(trained["objects"], 4);
    let taught = trained["taught"]["objects"].as_array().unwrap();
    assert_eq!(taught.iter().map(|object| object["name"].as_str().unwrap()).collect::<Vec<_>>(), ["cup", "pot"]);
    assert!(taught[1]["recognized"].as_f64() > Some(0.7), "{taught:?}");
    let trained = figures(at, "train --teach pot.txt --teach more/cup.txt -o alone.json --trees rounds=6,depth=4");
    assert_eq!((&trained["objects"], &trained["touches"]), (&2.into(), &420.into()));
    assert!(trained["taught"]["objects"][0]["recognized"].as_f64() > Some(0.8), "{trained}");
}

#[test]
fn what_does_not_go_together_is_named_and_nothing_is_written() {
    let at = &TAUGHT.folder();
    touches(&at.join("few/pot.txt"), 500_000, 12, 5);
    fs::write(at.join("cup.txt"), "0 0.1 0.2\n0 0.1 -\n0 zero 0.2\n").unwrap();
    touches(&at.join("known/bowl.txt"), 170_000, 100, 5);
    fs::write(at.join("cup.csv"), "0 0.1 0.2\n").unwrap();
    // Every line has all three contacts: not every approach was recorded.
    fs::write(at.join("full.txt"), "0 0.1 0.2\n0 0.2 0.3\n".repeat(50)).unwrap();
    for (words, code, expected) in [
        ("train data --teach few -o t.json --trees rounds=2", 1, "only 12 recorded touches of pot are evidence"),
        ("train data --teach cup.txt -o t.json", 1, "cup.txt:3: \"zero\" is not a number"),
        ("train data --teach cup.csv -o t.json", 1, "cup.csv: not a file of touches by its name"),
        ("train data --teach nowhere.txt -o t.json", 1, "nowhere.txt: cannot read"),
        ("train data --teach full.txt -o t.json --trees rounds=2", 1, "only full touches were recorded"),
        ("train data --teach pot.txt -o t.json --preset paper", 1, "a leaf of the ensemble holds one value"),
        ("train data --teach pot.txt --teach unseen -o t.json", 1, "pot was given twice"),
        ("train data --teach known -o t.json --trees rounds=2", 1, "bowl is known already"),
        ("train --teach pot.txt -o t.json", 1, "there is only one object to train on"),
        ("train --teach pot.txt --teach known -o t.json --real noise=5ms", 2, "recorded ones have noise of their own"),
        ("train -o t.json", 2, "<DIRECTORY>"),
        ("train data --extend ensemble.json -o t.json", 2, "--teach"),
        ("train data --extend ensemble.json --teach pot.txt -o t.json --trees rounds=2", 2, "--trees"),
        // A recording is never written over.
        ("train data --teach pot.txt -o pot.txt", 2, "another file than what is read"),
    ] {
        fails(at, words, code, expected);
    }
    assert!(!at.join("t.json").exists(), "something was written");
    succeeds(at, "train data --teach full.txt -o full.json --trees rounds=2 --evidence full");
}
