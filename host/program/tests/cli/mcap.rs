//! Robots' logs, as a user meets them: recognized, evaluated, recorded, checked and trained on.

#[allow(dead_code, reason = "the library's tests use the rest")]
#[path = "../../../tests/mcap/files.rs"]
mod files;

use crate::fixtures::ONE_SPLIT;
use crate::{Folder, command, complains, fails, figures, holds, palpate, piped, says, stderr, stdout, succeeds};
use palpate::touches::{Dataset, Log, is_log};
use std::path::Path;
use std::process::Output;

/// A log that MCAP's library for Python wrote: twenty touches of a bowl and twenty of a mug, and another channel.
const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/mcap/json-zstd.mcap");

/// Writes a log with these touches, lines of text, and the objects that they name.
fn log<'a>(path: &Path, touches: impl IntoIterator<Item = (&'a str, Option<&'a str>)>) {
    let message = |(line, object): (&str, Option<&str>)| {
        let times: Vec<Option<f64>> = line.split_whitespace().map(|time| time.parse().ok()).collect();
        serde_json::json!({"times": times, "object": object}).to_string()
    };
    let messages: Vec<String> = touches.into_iter().map(message).collect();
    let messages: Vec<&str> = messages.iter().map(String::as_str).collect();
    std::fs::write(path, files::touches(&messages)).unwrap();
}

fn error_of(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn a_log_is_recognized_like_lines_and_another_object_begins_where_the_name_changes() {
    let at = &ONE_SPLIT.folder();
    let touches = [("0 0 0.08", "fork"), ("0 0 0.08", "fork"), ("0 0 0.01", "bowl"), ("0 0 0.02", "bowl")];
    log(&at.join("monday.mcap"), touches.map(|(line, object)| (line, Some(object))));
    std::fs::write(at.join("lines.txt"), "0 0 0.08\n0 0 0.08\n\n0 0 0.01\n0 0 0.02\n").unwrap();
    let expected = succeeds(at, "recognize model.palpate lines.txt --json");
    assert_eq!(succeeds(at, "recognize model.palpate monday.mcap --json"), expected);
    assert_eq!(expected.matches("\"touch\":2").count(), 2, "{expected}");
    // The content says what it is, not the name; standard input has none.
    std::fs::rename(at.join("monday.mcap"), at.join("monday.txt")).unwrap();
    assert_eq!(succeeds(at, "recognize model.palpate monday.txt --json"), expected);
    let piped = piped(
        command(["recognize", &at.text("model.palpate"), "--json"]),
        &std::fs::read(at.join("monday.txt")).unwrap(),
    );
    assert_eq!(stdout(piped), expected);
}

#[test]
fn channels_that_are_skipped_are_named_and_a_damaged_log_is_refused_with_its_byte() {
    let at = &ONE_SPLIT.folder();
    let output = palpate(at, &format!("recognize model.palpate {PYTHON}"));
    let said = error_of(&output);
    assert_eq!(stdout(output).lines().count(), 40);
    assert_eq!(said, format!("palpate: {PYTHON}: skipped 1 other channel: /joints (robot.Joints)\n"));
    std::fs::write(at.join("cut.mcap"), &std::fs::read(PYTHON).unwrap()[..3000]).unwrap();
    let said = stderr(palpate(at, "recognize model.palpate cut.mcap"), 1);
    assert!(said.starts_with("palpate: cut.mcap: byte "), "{said}");
    assert!(said.ends_with("it ends early. Repair it with `mcap recover`, or copy the log again.\n"), "{said}");
    // Times in milliseconds.
    log(&at.join("cut.mcap"), [("0 0 0.08", None), ("0 0 80", None)]);
    let recognize = "recognize model.palpate cut.mcap";
    complains(palpate(at, recognize), recognize, 1, "cut.mcap: byte … 80");
}

#[test]
fn a_log_is_a_data_set_to_evaluate_and_to_train_on_and_so_is_a_directory_with_logs() {
    let at = &ONE_SPLIT.folder();
    let lines =
        |late: usize| -> Vec<String> { (0..60).map(|i| format!("0 0.00{} 0.{:03}", i % 7, late + i % 10)).collect() };
    let (bowl, fork) = (lines(10), lines(80));
    std::fs::write(at.join("data/bowl.txt"), bowl.join("\n")).unwrap();
    std::fs::write(at.join("data/fork.txt"), fork.join("\n")).unwrap();
    // By turns, with names; and in a directory, without.
    let both: Vec<(String, &str)> =
        bowl.iter().zip(&fork).flat_map(|(bowl, fork)| [(bowl.clone(), "bowl"), (fork.clone(), "fork")]).collect();
    log(&at.join("monday.mcap"), both.iter().map(|(line, object)| (line.as_str(), Some(*object))));
    std::fs::create_dir(at.join("mixed")).unwrap();
    std::fs::copy(at.join("data/bowl.txt"), at.join("mixed/bowl.txt")).unwrap();
    log(&at.join("mixed/fork.mcap"), fork.iter().map(|line| (line.as_str(), None)));
    let expected = succeeds(at, "evaluate model.palpate data --json");
    for logs in ["monday.mcap", "mixed"] {
        assert_eq!(succeeds(at, &format!("evaluate model.palpate {logs} --json")), expected);
    }
    let trained = |data: &str, name: &str| {
        succeeds(at, &format!("train {data} -o {name} --trees rounds=3,depth=2"));
        Dataset::read(&at.join(data)).unwrap()
    };
    let touches = |dataset: Dataset| -> Vec<_> {
        dataset.objects.iter().map(|object| (object.name.clone(), object.touches().to_vec())).collect()
    };
    assert_eq!(touches(trained("data", "a.json")), touches(trained("monday.mcap", "b.json")));
    assert!(std::fs::read(at.join("a.json")).unwrap() == std::fs::read(at.join("b.json")).unwrap());
    // And taught, as recorded touches are.
    succeeds(at, "train --teach monday.mcap -o taught.json --trees rounds=3,depth=2");
    fails(at, "train monday.mcap -o monday.mcap", 2, "another file than what is read");
    assert!(is_log(&at.join("monday.mcap")));
}

#[test]
fn a_log_is_recorded_into_a_data_set_object_by_object() {
    let at = &Folder::new();
    let record = |object: &str| format!("data record {PYTHON} -o recorded --object {object}");
    let output = palpate(at, &record("bowl"));
    let said = error_of(&output);
    holds(&said, &["json-zstd.mcap: skipped 1 other channel", "skipped 20 touches of other objects"]);
    assert!(stdout(output).starts_with("recorded 20 touches of bowl into "));
    succeeds(at, &record("mug"));
    let dataset = Dataset::read(&at.join("recorded")).unwrap();
    let log = Log::read(Path::new(PYTHON)).unwrap().by_object("-").unwrap();
    let touches = |objects: &[palpate::touches::ObjectTouches]| -> Vec<_> {
        objects.iter().map(|object| object.touches().iter().map(|touch| touch.times()).collect::<Vec<_>>()).collect()
    };
    assert_eq!(touches(&dataset.objects), touches(&log));
    let palpate::touches::Source::Recording(recorded) = &dataset.objects[0].pools()[0].source else { panic!() };
    assert_eq!(recorded.source, PYTHON);
    fails(at, &record("bowl"), 1, "the same 20 touches of bowl were recorded before");
    fails(at, &record("spoon"), 1, "json-zstd.mcap: no touch of spoon in this log, only of bowl, mug.");
}

#[test]
fn a_log_is_checked_like_a_directory() {
    let at = &Folder::new();
    let check = format!("data check {PYTHON}");
    let expected = [
        "note: ",
        "json-zstd.mcap/bowl: only 20 touches",
        "json-zstd.mcap: skipped 1 other channel: /joints (robot.Joints)",
        "probe: unknown, since there is no dataset.json",
        "2 objects, 40 touches",
    ];
    says(at, &check, &expected);
    let checked = figures(at, &check);
    assert_eq!(checked["summary"]["objects"][1]["patterns"], serde_json::json!([0, 0, 0, 0, 4, 16]));
    std::fs::write(at.join("fork.mcap"), &std::fs::read(PYTHON).unwrap()[..2000]).unwrap();
    let output = palpate(at, "data check fork.mcap");
    assert!(String::from_utf8_lossy(&output.stdout).contains("fork.mcap: byte "), "{output:?}");
    complains(output, "data check", 1, "training on these touches would be wrong, for 1 reason.");
}
