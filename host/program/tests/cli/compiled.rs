//! The commands around a compiled model, as a user calls them: export, inspect, parity, recognize.

use palpate::ensemble::{Ensemble, Node, Output, Provenance, Tree, inputs};
use palpate_shared::Descriptor;
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Output as Finished, Stdio};

fn palpate(arguments: &[&str]) -> Finished {
    crate::run(arguments)
}

#[track_caller]
fn json(arguments: &[&str]) -> Value {
    crate::json(palpate(arguments))
}

/// The exit code and what was said on stderr.
fn refusal(arguments: &[&str]) -> (i32, String) {
    let finished = palpate(arguments);
    assert!(finished.stdout.is_empty(), "{}", String::from_utf8_lossy(&finished.stdout));
    (finished.status.code().unwrap(), String::from_utf8(finished.stderr).unwrap())
}

/// One split: flat is a bowl, curved a fork.
pub(crate) fn ensemble() -> Ensemble {
    let leaf = |bowl: f32, fork: f32| Node::Leaf(vec![bowl, fork]);
    let split = Node::Split { feature: 0, threshold: 50_000.0, missing_left: true, left: 1, right: 2 };
    let nodes = vec![split, leaf(0.7, -0.7), leaf(-0.7, 0.7)];
    Ensemble {
        inputs: inputs(Descriptor::Curvature),
        objects: vec!["bowl".into(), "fork".into()],
        base_margins: vec![0.0, 0.0],
        trees: vec![Tree { nodes, output: Output::Each }],
        origin: Provenance::default(),
    }
}

pub(crate) struct Place {
    directory: tempfile::TempDir,
}

impl Place {
    /// A directory with `ensemble.json`, `model.palpate` and touches in `data`.
    pub(crate) fn new() -> Self {
        let place = Self { directory: tempfile::tempdir().unwrap() };
        ensemble().save(place.path("ensemble.json")).unwrap();
        std::fs::create_dir(place.path("data")).unwrap();
        std::fs::write(place.path("data/bowl.txt"), "0 0 0.01\n0 0.001 0\n").unwrap();
        std::fs::write(place.path("data/fork.txt"), "0 0 0.08\n0.09 0 0.01\n").unwrap();
        json(&["export", &place.text("ensemble.json"), "-o", &place.text("model.palpate"), "--json"]);
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    pub(crate) fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }
}

fn change(path: &Path, change: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = std::fs::read(path).unwrap();
    change(&mut bytes);
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn export_says_size_splits_leaves_and_error_and_the_file_has_that_size() {
    let place = Place::new();
    for leaf in ["i8", "i16", "f32"] {
        for layout in ["balanced", "compact", "complete", "grid"] {
            let output = place.text("other.palpate");
            let exported = json(&[
                "export",
                &place.text("ensemble.json"),
                "-o",
                &output,
                "--leaf",
                leaf,
                "--layout",
                layout,
                "--json",
            ]);
            assert_eq!(exported["bytes"], std::fs::metadata(&output).unwrap().len());
            assert_eq!(
                (&exported["splits"], &exported["leaves"], &exported["trees"]),
                (&1.into(), &2.into(), &1.into())
            );
            assert!(exported["margin_error"].as_f64().unwrap() < 0.01);
        }
    }
}

#[test]
fn inspect_tells_what_was_exported() {
    let place = Place::new();
    let inspected = json(&["inspect", &place.text("model.palpate"), "--json"]);
    assert_eq!(inspected["version"], 1);
    assert_eq!(inspected["descriptor"], "curvature");
    assert_eq!(inspected["objects"], serde_json::json!(["bowl", "fork"]));
    assert_eq!(inspected["stopping"], serde_json::json!({"error_rate": 0.01, "max_touches": 200}));
    let parts = inspected["bytes_by_part"].as_object().unwrap().values();
    assert_eq!(inspected["bytes"], parts.map(|bytes| bytes.as_u64().unwrap()).sum::<u64>());
    let text = palpate(&["inspect", &place.text("model.palpate")]);
    assert!(String::from_utf8(text.stdout).unwrap().contains("bowl, fork"));
}

#[test]
fn parity_of_a_model_with_its_own_ensemble_has_no_difference() {
    let place = Place::new();
    let (ensemble, model, data) = (place.text("ensemble.json"), place.text("model.palpate"), place.text("data"));
    let parity = json(&["verify", &model, &ensemble, &data, "--sequences", "200", "--json"]);
    assert_eq!(
        (&parity["touches"], &parity["best_differs"], &parity["verdict_differs"]),
        (&4.into(), &0.into(), &0.into())
    );
    assert!(parity["max_margin_error"].as_f64() <= parity["stated_bound"].as_f64(), "{parity}");
}

#[test]
fn parity_refuses_a_model_of_other_objects() {
    let place = Place::new();
    let other = Ensemble { objects: vec!["bowl".into(), "spoon".into()], ..ensemble() };
    other.save(place.path("other.json")).unwrap();
    let (code, message) =
        refusal(&["verify", &place.text("model.palpate"), &place.text("other.json"), &place.text("data")]);
    assert_eq!(code, 1);
    assert!(message.contains("model.palpate") && message.contains("not compiled from this ensemble"), "{message}");
}

#[test]
fn recognize_starts_afresh_after_each_verdict() {
    let place = Place::new();
    std::fs::write(place.path("touches.txt"), "0 0 0.08\n".repeat(9) + &"0 0 0.01\n".repeat(4)).unwrap();
    let finished = palpate(&["recognize", &place.text("model.palpate"), &place.text("touches.txt"), "--json"]);
    assert!(finished.status.success());
    let lines: Vec<Value> = finished.stdout.lines().map(|line| serde_json::from_str(&line.unwrap()).unwrap()).collect();
    let verdicts: Vec<_> = lines
        .iter()
        .map(|line| {
            (line["touch"].as_u64().unwrap(), line["verdict"].as_str().unwrap(), line["object"].as_str().unwrap())
        })
        .collect();
    let three = |object| [(1, "undecided", object), (2, "undecided", object), (3, "undecided", object)];
    let recognized = |object| [(4, "recognized", object)];
    let fork = [&three("fork")[..], &recognized("fork")].concat();
    // The ninth touch is the first of the third object, which the bowl's touches then pull back.
    let mixed =
        [(1, "undecided", "fork"), (2, "undecided", "bowl"), (3, "undecided", "bowl"), (4, "undecided", "bowl")];
    assert_eq!(verdicts[..8], [fork.clone(), fork].concat());
    assert_eq!((verdicts[8], verdicts[10], verdicts[11]), (mixed[0], mixed[2], mixed[3]));
    let keys: Vec<_> = lines[0].as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(keys.len(), 4);
    assert!(["touch", "verdict", "object", "posterior"].iter().all(|key| keys.contains(key)));
    let posterior = lines[0]["posterior"].as_f64().unwrap();
    assert!((posterior - 1.0 / (1.0 + (-1.4_f64).exp())).abs() < 1e-4, "{posterior}");
}

#[test]
fn recognize_answers_each_line_of_a_slow_pipe_before_the_next_comes() {
    let place = Place::new();
    for json in [true, false] {
        let mut command = crate::command(["recognize", &place.text("model.palpate")]);
        command.args(json.then_some("--json"));
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let mut input = child.stdin.take().unwrap();
        let mut output = BufReader::new(child.stdout.take().unwrap());
        // The next touch is only written once the verdict of the one before was read: no answer, no progress.
        for number in 1..=10 {
            input.write_all(b"0 0 0.08\n").unwrap();
            input.flush().unwrap();
            let mut line = String::new();
            output.read_line(&mut line).unwrap();
            assert!(line.contains(if number % 4 == 0 { "recognized" } else { "undecided" }), "{number}: {line}");
        }
        drop(input);
        assert!(child.wait().unwrap().success());
    }
}

#[test]
fn six_touches_of_one_outer_finger_give_no_name_with_a_model_of_full_touches() {
    let place = Place::new();
    let household = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");
    for model in [household.to_owned(), place.text("model.palpate")] {
        let bytes = std::fs::read(&model).unwrap();
        let opened = palpate_onboard::Model::new(&bytes).unwrap();
        if opened.trained_touches().patterns != palpate_shared::Patterns::FULL {
            println!("SKIPPED: {model} was trained on partial touches");
            continue;
        }
        for touch in ["0 - -\n", "0 - 0.015\n", "- - -\n"] {
            std::fs::write(place.path("touches.txt"), touch.repeat(6)).unwrap();
            let finished = palpate(&["recognize", &model, &place.text("touches.txt")]);
            assert_eq!(finished.status.code(), Some(0));
            let text = String::from_utf8(finished.stdout).unwrap();
            assert_eq!(text.lines().filter(|line| line.contains("not counted")).count(), 6, "{text}");
            for object in 0..opened.object_count() {
                assert!(!text.contains(opened.object_name(object)), "{text}");
            }
            let finished = palpate(&["recognize", &model, &place.text("touches.txt"), "--json"]);
            for line in finished.stdout.lines() {
                let line: Value = serde_json::from_str(&line.unwrap()).unwrap();
                let verdict = (line["touch"].as_u64(), line["verdict"].as_str(), line["object"].as_str());
                assert_eq!(verdict, (Some(0), Some("undecided"), Some("")));
                assert!(line["refused"].is_string(), "{line}");
            }
        }
    }
}

#[test]
fn recognize_gives_up_after_the_limit_of_touches() {
    let place = Place::new();
    std::fs::write(place.path("touches.txt"), "0 0 0.08\n0 0 0.01\n".repeat(3)).unwrap();
    let arguments = ["recognize", &place.text("model.palpate"), &place.text("touches.txt"), "--max-touches", "4"];
    let text = String::from_utf8(palpate(&arguments).stdout).unwrap();
    let verdicts: Vec<&str> = text.lines().map(|line| line.split_whitespace().nth(1).unwrap()).collect();
    assert_eq!(verdicts, ["undecided", "undecided", "undecided", "gave-up", "undecided", "undecided"]);
}

#[test]
fn recognize_names_the_line_that_is_wrong_after_answering_those_before() {
    let place = Place::new();
    for wrong in ["0 0", "0 0 -1", "0 0 nan", "0 0 x", "0 0 0 0"] {
        std::fs::write(place.path("touches.txt"), format!("0 0 0.08\n\n{wrong}\n")).unwrap();
        let finished = palpate(&["recognize", &place.text("model.palpate"), &place.text("touches.txt")]);
        assert_eq!(finished.status.code(), Some(1), "{wrong}");
        assert_eq!(finished.stdout.lines().count(), 1);
        let message = String::from_utf8(finished.stderr).unwrap();
        assert!(message.contains("touches.txt:3: "), "{message}");
    }
}

#[test]
fn models_that_are_truncated_changed_or_of_another_version_are_refused_with_the_byte() {
    let place = Place::new();
    let whole = std::fs::read(place.path("model.palpate")).unwrap();
    let refuse = |expected: &str| {
        for command in ["inspect", "recognize"] {
            let (code, message) = refusal(&[command, &place.text("model.palpate")]);
            assert_eq!(code, 1);
            assert!(message.contains("model.palpate: byte ") && message.contains(expected), "{message}");
        }
        std::fs::write(place.path("model.palpate"), &whole).unwrap();
    };
    change(&place.path("model.palpate"), |bytes| bytes.truncate(100));
    refuse("truncated");
    change(&place.path("model.palpate"), Vec::clear);
    refuse("truncated");
    change(&place.path("model.palpate"), |bytes| bytes[4] = 9);
    refuse("format version 9");
    change(&place.path("model.palpate"), |bytes| bytes[120] ^= 1);
    refuse("checksum");
    change(&place.path("model.palpate"), |bytes| bytes[0] = b'X');
    refuse("not a Palpate model");
}

#[test]
fn a_missing_model_is_named_with_what_to_do() {
    let (code, message) = refusal(&["inspect", "no/such.palpate"]);
    assert_eq!(code, 1);
    assert!(message.contains("no/such.palpate") && message.contains("Check the path"), "{message}");
}

#[test]
fn bad_arguments_of_export_exit_with_2_and_leave_the_old_model() {
    let place = Place::new();
    let before = std::fs::read(place.path("model.palpate")).unwrap();
    for wrong in [
        ["--leaf", "i4"],
        ["--layout", "spiral"],
        ["--error-rate", "0.7"],
        ["--error-rate", "0"],
        ["--max-touches", "0"],
        ["--frobnicate", "1"],
    ] {
        let (ensemble, model) = (place.text("ensemble.json"), place.text("model.palpate"));
        let (code, message) = refusal(&[&["export", &ensemble, "-o", &model], &wrong[..]].concat());
        assert_eq!(code, 2, "{message}");
        assert_eq!(std::fs::read(place.path("model.palpate")).unwrap(), before);
    }
}

#[test]
fn leaves_beyond_reason_are_refused_at_export_and_nothing_is_written() {
    let place = Place::new();
    let mut huge = ensemble();
    huge.trees[0].nodes[1] = Node::Leaf(vec![1e30, 0.0]);
    huge.save(place.path("huge.json")).unwrap();
    let (code, message) =
        refusal(&["export", &place.text("huge.json"), "-o", &place.text("huge.palpate"), "--leaf", "f32"]);
    assert_eq!(code, 1);
    assert!(message.contains("huge.json") && message.contains("1e30"), "{message}");
    assert!(!place.path("huge.palpate").exists());
}

#[test]
fn recognize_refuses_a_limit_of_no_touches_with_and_without_an_error_rate() {
    let place = Place::new();
    std::fs::write(place.path("touches.txt"), "0 0 0.08\n").unwrap();
    let arguments = ["recognize", &place.text("model.palpate"), &place.text("touches.txt"), "--max-touches", "0"];
    let (code, without) = refusal(&arguments);
    assert_eq!(code, 2, "{without}");
    let (code, with) = refusal(&[&arguments[..], &["--error-rate", "0.05"]].concat());
    assert_eq!(code, 2, "{with}");
    assert_eq!(without, with);
    assert!(with.contains("touches is 0. Use at least 1."), "{with}");
}

#[test]
fn recognize_refuses_times_in_milliseconds_and_names_the_unit() {
    let place = Place::new();
    std::fs::write(place.path("touches.txt"), "0 0 0.08\n62.2 0 2.2\n").unwrap();
    let finished = palpate(&["recognize", &place.text("model.palpate"), &place.text("touches.txt")]);
    assert_eq!(finished.status.code(), Some(1));
    assert_eq!(finished.stdout.lines().count(), 1, "the touch before is answered");
    let message = String::from_utf8(finished.stderr).unwrap();
    assert!(message.contains("touches.txt:2: a finger touched 62.2 s after the first"), "{message}");
    assert!(message.contains("Give times in seconds, not in milliseconds"), "{message}");
}

#[test]
fn an_empty_line_begins_another_object_in_recognize_as_in_link() {
    let place = Place::new();
    std::fs::write(place.path("touches.txt"), "0 0 0.08\n0 0 0.08\n\n0 0 0.08\n").unwrap();
    let finished = palpate(&["recognize", &place.text("model.palpate"), &place.text("touches.txt"), "--json"]);
    let lines = finished.stdout.lines().map(|line| serde_json::from_str::<Value>(&line.unwrap()).unwrap());
    assert_eq!(lines.map(|line| line["touch"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 2, 1]);
}

#[test]
fn error_rates_may_be_percent_and_one_half_is_outside_their_range() {
    let place = Place::new();
    let (ensemble, model) = (place.text("ensemble.json"), place.text("percent.palpate"));
    json(&["export", &ensemble, "-o", &model, "--error-rate", "5%", "--json"]);
    assert_eq!(json(&["inspect", &model, "--json"])["stopping"]["error_rate"], 0.05);
    let (code, message) = refusal(&["export", &ensemble, "-o", &model, "--error-rate", "0.5"]);
    assert_eq!(code, 2);
    assert!(message.contains("'0.5' for '--error-rate") && message.contains("below one half"), "{message}");
    let (code, message) = refusal(&["export", &ensemble, "-o", &model, "--error-rate", "five"]);
    assert!(code == 2 && message.contains("0.05, or percent such as 5%"), "{message}");
}

#[test]
fn export_and_inspect_state_instructions_for_both_processors() {
    let place = Place::new();
    let exported = json(&["export", &place.text("ensemble.json"), "-o", &place.text("model.palpate"), "--json"]);
    let instructions = &exported["instructions"];
    assert!(
        instructions["m4f"].as_u64() > Some(200) && instructions["m0_plus"].as_u64() > instructions["m4f"].as_u64()
    );
    let inspected = json(&["inspect", &place.text("model.palpate"), "--json"]);
    assert_eq!(&inspected["instructions"], instructions);
    let export = palpate(&["export", &place.text("ensemble.json"), "-o", &place.text("other.palpate")]);
    let export = String::from_utf8(export.stdout).unwrap();
    let inspect = String::from_utf8(palpate(&["inspect", &place.text("model.palpate")]).stdout).unwrap();
    for text in [export, inspect] {
        assert!(text.contains("on a Cortex-M4F") && text.contains("on a Cortex-M0+"), "{text}");
        assert!(text.contains("estimated"), "{text}");
    }
}

#[test]
fn inspect_says_what_a_model_costs_on_a_chip_and_how_it_knows() {
    let place = Place::new();
    let model = place.text("model.palpate");
    for (chip, name) in [("m0+", "Cortex-M0+"), ("m4f", "Cortex-M4F")] {
        let inspected = json(&["inspect", &model, "--chip", chip, "--mhz", "48", "--json"]);
        let cost = &inspected["chip"];
        assert_eq!((&cost["core"], &cost["how"]), (&chip.into(), &"estimated".into()));
        assert_eq!(cost["model_flash"], inspected["bytes"]);
        for bytes in ["code_flash", "ram", "stack", "margin_instructions"] {
            assert!(cost[bytes].as_u64() > Some(0), "{bytes} in {cost}");
        }
        let time = cost["verdict_instructions"].as_f64().unwrap() / 48.0;
        assert_eq!(cost["microseconds"].as_f64(), Some(time));
        let text = String::from_utf8(palpate(&["inspect", &model, "--chip", chip, "--mhz", "48"]).stdout).unwrap();
        for part in [name, "flash", "RAM", "stack", "(per touch, estimated)", "µs per touch at 48 MHz"] {
            assert!(text.contains(part), "{part} in {text}");
        }
    }
    assert_eq!(refusal(&["inspect", &model, "--chip", "z80"]).0, 2);
    assert_eq!(refusal(&["inspect", &model, "--mhz", "48"]).0, 2);
}

#[test]
fn an_ensemble_trained_on_seconds_is_refused_at_export_with_its_feature() {
    let place = Place::new();
    let mut seconds = ensemble();
    let tree = seconds.trees[0].clone();
    seconds.trees = (1..9)
        .map(|number| {
            let mut tree = tree.clone();
            if let Node::Split { threshold, .. } = &mut tree.nodes[0] {
                *threshold = number as f32 * 0.037;
            }
            tree
        })
        .collect();
    seconds.save(place.path("seconds.json")).unwrap();
    let (code, message) = refusal(&["export", &place.text("seconds.json"), "-o", &place.text("seconds.palpate")]);
    assert_eq!(code, 1);
    assert!(message.contains("seconds.json: ") && message.contains("of curvature is neither whole"), "{message}");
    assert!(!place.path("seconds.palpate").exists());
}

#[test]
fn a_compiled_model_such_as_a_calibrated_one_becomes_an_array() {
    let place = Place::new();
    let model = place.text("model.palpate");
    let bytes = std::fs::read(&model).unwrap();
    let exported = json(&["export", &model, "-o", &model, "--emit", "c,rust", "--json"]);
    assert_eq!(exported["sources"], serde_json::json!([place.text("model.h"), place.text("model.rs")]));
    let source = std::fs::read_to_string(place.path("model.h")).unwrap();
    let array = source.split("= {").nth(1).unwrap().split('}').next().unwrap();
    let array: Vec<u8> = array.split(',').filter_map(|byte| byte.trim().parse().ok()).collect();
    assert_eq!(array, bytes);
    assert!(place.path("palpate.h").exists());
    assert_eq!(std::fs::read(&model).unwrap(), bytes, "it is what it was");
    json(&["export", &model, "-o", &place.text("copy.palpate"), "--emit", "c", "--json"]);
    assert_eq!(std::fs::read(place.path("copy.palpate")).unwrap(), bytes);
    assert!(place.path("copy.h").exists());
    for (more, expected) in [
        (&[][..], "--emit is not given. Use c or rust"),
        (&["--emit", "json"], "--emit is json. Use it with an ensemble"),
        (&["--emit", "c", "--leaf", "i8"], "--leaf is given. Use it with an ensemble"),
        (&["--emit", "c", "--error-rate", "5%"], "--error-rate is given"),
    ] {
        let (code, message) = refusal(&[&["export", &model, "-o", &place.text("other.palpate")], more].concat());
        assert!(code == 2 && message.contains(expected), "{message}");
        assert!(!place.path("other.palpate").exists());
    }
}

#[test]
fn export_emits_sources_beside_the_model_and_refuses_a_name_that_leaves_no_room_for_them() {
    let place = Place::new();
    let (ensemble, model) = (place.text("ensemble.json"), place.text("cup.palpate"));
    let exported = json(&["export", &ensemble, "-o", &model, "--emit", "c,rust", "--json"]);
    let sources: Vec<&str> =
        exported["sources"].as_array().unwrap().iter().map(|path| path.as_str().unwrap()).collect();
    assert_eq!(sources, [place.text("cup.h"), place.text("cup.rs")]);
    let read = |name: &str| std::fs::read_to_string(place.path(name)).unwrap();
    assert!(read("cup.h").contains(&format!("cup_model[{}]", std::fs::read(&model).unwrap().len())));
    assert!(read("cup.rs").contains("pub static CUP:"));
    assert_eq!(read("palpate.h"), palpate_onboard::C_HEADER);
    let exported = json(&["export", &ensemble, "-o", &model, "--emit", "json", "--json"]);
    assert_eq!(exported["ensemble"].as_str(), Some(&*place.text("cup.json")));
    assert_eq!(palpate::ensemble::load(place.path("cup.json")).unwrap(), palpate::ensemble::load(&ensemble).unwrap());
    // The file that it is made of stays.
    let own = ("ensemble.palpate", "json");
    for (output, language) in
        [("model.h", "c"), ("palpate.palpate", "c"), (".palpate", "c"), ("-", "rust"), own, ("model.palpate", "cobol")]
    {
        let output = if output == "-" { output.to_owned() } else { place.text(output) };
        let (code, message) = refusal(&["export", &ensemble, "-o", &output, "--emit", language]);
        assert_eq!(code, 2, "{message}");
    }
    assert!(!place.path("model.h").exists() && !place.path("palpate.palpate").exists());
}

#[test]
fn leaves_of_touches_of_more_than_fifty_objects_take_a_byte_unless_told_otherwise() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let leaf = |objects: usize, more: &[&str]| {
        let mut many = ensemble();
        for node in many.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
            if let Node::Leaf(values) = node {
                *values = (0..objects).map(|object| values[object % 2]).collect();
            }
        }
        many.objects = (0..objects).map(|object| format!("object-{object:03}")).collect();
        many.base_margins = vec![0.5; objects];
        many.save(path("many.json")).unwrap();
        let (from, to) = (path("many.json"), path("many.palpate"));
        let exported = json(&[&["export", &from, "-o", &to, "--json"], more].concat());
        exported["leaf"].as_str().unwrap().to_owned()
    };
    assert_eq!(leaf(50, &[]), "i16");
    assert_eq!(leaf(51, &[]), "i8");
    assert_eq!(leaf(51, &["--leaf", "i16"]), "i16");
    assert_eq!(leaf(50, &["--leaf", "i8"]), "i8");
}

#[test]
fn full_touches_alone_are_warned_of_where_it_is_evidence_which_fingers_touch() {
    let place = Place::new();
    let household = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");
    let full = "0 0.031 0.012\n".repeat(40);
    let said = |model: &str, touches: &str| {
        std::fs::write(place.path("touches.txt"), touches).unwrap();
        let finished = palpate(&["recognize", model, &place.text("touches.txt")]);
        assert_eq!(finished.status.code(), Some(0));
        String::from_utf8(finished.stderr).unwrap()
    };
    assert!(said(household, &full).contains("all 40 touches are full, and to this model it is evidence which fingers"));
    assert_eq!(said(household, &format!("{full}0 - 0.2\n")), "");
    assert_eq!(said(household, "0 0.031 0.012\n"), "");
    assert_eq!(said(&place.text("model.palpate"), &full), "");
    std::fs::create_dir(place.path("full")).unwrap();
    ["bowl", "fork"].iter().for_each(|name| std::fs::write(place.path(&format!("full/{name}.txt")), &full).unwrap());
    let finished = palpate(&["evaluate", household, &place.text("full"), "--at", "5", "--sequences", "10"]);
    let said = String::from_utf8(finished.stderr).unwrap();
    assert!(said.contains("all 80 touches are full"), "{said}");
}
