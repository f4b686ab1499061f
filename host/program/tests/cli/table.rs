//! A robot over a table, as its user goes: recordings of objects in their placements, and of objects that lie in any, through every
//! command that takes recordings.

use crate::{json, stderr, stdout};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The program in a directory.
fn palpate(at: &Path, words: &str) -> std::process::Output {
    crate::command(words.split_whitespace()).current_dir(at).output().unwrap()
}

/// Two objects on a table, their model, and other touches of them as lines: a file for each placement.
fn table(at: &Path) -> Vec<(String, PathBuf)> {
    let capture = |name: &str, seed: u32, count: u32| {
        let words = format!(
            "capture bowl mouse -o {name} --scene table --pose --approaches {count} --seed {seed} --format text"
        );
        stdout(palpate(at, &words));
    };
    capture("data", 1, 2_000);
    capture("robot", 2, 1_200);
    stdout(palpate(at, "train data -o e.json --descriptor gravity --evidence all --trees rounds=8,leaf_bits=16"));
    stdout(palpate(at, "export e.json -o m.palpate"));
    let listing: Value = serde_json::from_slice(&std::fs::read(at.join("robot/dataset.json")).unwrap()).unwrap();
    let mut files = Vec::new();
    for object in listing["objects"].as_array().unwrap() {
        let name = object["name"].as_str().unwrap();
        let placements = object["placements"].as_array().unwrap();
        let text = std::fs::read_to_string(at.join(format!("robot/{name}.txt"))).unwrap();
        for (number, placement) in placements.iter().enumerate() {
            let placement = placement["name"].as_str().unwrap();
            let lines = text.lines().skip(number).step_by(placements.len());
            let lines = lines.fold(String::new(), |mut text, line| {
                _ = writeln!(text, "{line}");
                text
            });
            let file = at.join(format!("{name}{placement}.txt"));
            std::fs::write(&file, lines).unwrap();
            files.push((format!("{name}/{placement}"), file));
        }
    }
    assert!(files.len() > 2, "{files:?}");
    files
}

#[test]
fn recordings_on_a_table_are_taken_by_every_command_with_their_placements_or_without() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    let files = table(at);
    for (named, file) in &files {
        let whole = named.split('/').next().unwrap();
        let file = file.file_name().unwrap().to_str().unwrap();
        let said = stdout(palpate(at, &format!("data record {file} -o stated --object {named} --pose")));
        let [begin, end] = [format!("touches of {named} into stated, which holds "), format!(" of {whole} now\n")];
        assert!(said.contains(&begin) && said.contains(&end), "{said}");
        stdout(palpate(at, &format!("data record {file} -o unstated --object {whole} --pose")));
    }
    let listing: Value = serde_json::from_slice(&std::fs::read(at.join("stated/dataset.json")).unwrap()).unwrap();
    assert_eq!(listing["objects"].as_array().unwrap().len(), 2, "a file for each object");
    let placements: Vec<&str> =
        listing["recorded"].as_array().unwrap().iter().map(|one| one["placement"].as_str().unwrap()).collect();
    assert_eq!(placements.len(), files.len());

    for (recorded, names) in [("stated", files.len()), ("unstated", 2)] {
        let evaluated = json(palpate(at, &format!("evaluate m.palpate {recorded} --at 20 --sequences 100 --json")));
        let found = evaluated["per_object"].as_object().unwrap();
        assert_eq!(found.len(), names, "{evaluated}");
        assert!(evaluated["accuracy"]["20"].as_f64().unwrap() > 0.8, "{evaluated}");
        let checked =
            json(palpate(at, &format!("data check {recorded} data --descriptor gravity --sequences 100 --json")));
        assert_eq!(checked["objects"].as_array().unwrap().len(), names, "{checked}");
        stdout(palpate(at, &format!("data check {recorded}")));
        let calibrate = format!(
            "calibrate m.palpate fresh -o c.palpate --recorded {recorded} --error-rate 20% --max-touches 60 --sequences 2000 --json"
        );
        if !at.join("fresh").exists() {
            stdout(palpate(at, "capture bowl mouse -o fresh --scene table --pose --approaches 8000 --seed 3"));
        }
        let calibrated = json(palpate(at, &calibrate));
        assert_eq!(calibrated["objects"].as_object().unwrap().len(), names, "{calibrated}");
        let lines = palpate(at, &format!("recognize m.palpate {recorded}/bowl.txt --only bowl,mouse --json"));
        assert!(stdout(lines).lines().count() > 1_000);
    }
    let text = stdout(palpate(at, "data check unstated data --descriptor gravity --sequences 100"));
    assert!(text.contains("note: the recordings of bowl, mouse state no placement"), "{text}");
}

#[test]
fn a_probe_over_a_table_is_fitted_from_objects_that_stand_on_it() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    for (named, file) in table(at) {
        let file = file.file_name().unwrap().to_str().unwrap();
        stdout(palpate(at, &format!("data record {file} -o recorded --object {named} --pose")));
    }
    let error = stderr(palpate(at, "probe fit recorded bowl mouse -o probe.toml"), 2);
    assert!(
        error.contains("scene is floating. Use table: the recordings state placements on one, such as bowl/"),
        "{error}"
    );
    let error = stderr(palpate(at, "probe fit recorded bowl mouse -o probe.toml --cone 45"), 2);
    assert!(error.contains("--scene table"), "{error}");
    let said = stdout(palpate(at, "probe fit recorded bowl mouse -o probe.toml --scene table --approaches 8000"));
    assert!(said.contains(" on a table: ") && said.contains("Wrote probe.toml"), "{said}");
    let speed = said.lines().find_map(|line| line.strip_prefix("speed over nominal")).unwrap();
    let speed: f64 = speed.split_whitespace().next().unwrap().parse().unwrap();
    assert!((speed - 1.0).abs() < 0.05, "{said}");
    // Densities of so few are too coarse to find touches of other objects.
    assert!(said.contains("fewer than 12,000 approaches to each object were simulated: bowl/"), "{said}");
}

#[test]
fn names_of_placements_that_cannot_be_are_refused_by_name() {
    let place = tempfile::tempdir().unwrap();
    let at = place.path();
    std::fs::write(at.join("lines.txt"), "0 0.1 -\n0 0.2 0.3\n").unwrap();
    for object in ["bowl/", "/+z", "bowl/+z/2", "bowl/..", "a\\b/+z"] {
        let words = ["data", "record", "lines.txt", "-o", "out", "--object", object];
        let error = stderr(crate::command(words).current_dir(at).output().unwrap(), 1);
        assert!(
            error.contains("no file can be named after") && error.contains("OBJECT/PLACEMENT"),
            "{object}: {error}"
        );
    }
    assert!(!at.join("out/dataset.json").exists());
}
