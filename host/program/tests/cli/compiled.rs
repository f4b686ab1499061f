//! The commands around a compiled model, as a user calls them: export, inspect, parity, recognize.

use crate::fixtures::ONE_SPLIT;
use crate::{Folder, complains, fails, figures, lines, palpate, parts_are_all_bytes, says, stderr, succeeds};
use palpate::ensemble::{Ensemble, Node, Output, Provenance, Tree, inputs};
use palpate_shared::Descriptor;
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::Stdio;

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

const HOUSEHOLD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");

/// Verdicts of a model on lines of touches.
fn recognized(at: &Path, touches: &str, more: &str) -> Vec<Value> {
    fs::write(at.join("touches.txt"), touches).unwrap();
    lines(&succeeds(at, &format!("recognize model.palpate touches.txt --json {more}")))
}

/// The number of a touch and its verdict.
fn verdict(line: &Value) -> (u64, &str, &str) {
    (line["touch"].as_u64().unwrap(), line["verdict"].as_str().unwrap(), line["object"].as_str().unwrap())
}

#[test]
fn export_and_inspect_say_size_splits_leaves_error_and_cost_of_the_file() {
    let at = &ONE_SPLIT.folder();
    for leaf in ["i8", "i16", "f32"] {
        let exported = figures(at, &format!("export ensemble.json -o other.palpate --leaf {leaf}"));
        assert_eq!(exported["bytes"], fs::metadata(at.join("other.palpate")).unwrap().len());
        let of_each = ["splits", "leaves", "trees"].map(|key| exported[key].as_u64().unwrap());
        assert_eq!(of_each, [1, 2, 1]);
        assert!(exported["margin_error"].as_f64().unwrap() < 0.01);
    }
    let export = "export ensemble.json -o other.palpate --error-rate 5%";
    let exported = figures(at, export);
    let inspected = figures(at, "inspect other.palpate");
    assert_eq!(inspected["version"], 3);
    assert_eq!(inspected["descriptor"], "curvature");
    assert_eq!(inspected["objects"], json!(["bowl", "fork"]));
    assert_eq!(inspected["stopping"], json!({"error_rate": 0.05, "max_touches": 200}));
    parts_are_all_bytes(&inspected);
    let instructions = &inspected["instructions"];
    assert_eq!(&exported["instructions"], instructions);
    assert!(
        instructions["m4f"].as_u64() > Some(200) && instructions["m0_plus"].as_u64() > instructions["m4f"].as_u64()
    );
    for words in [export, "inspect other.palpate"] {
        says(at, words, &["on a Cortex-M4F", "on a Cortex-M0+", "estimated"]);
    }
    says(at, "inspect model.palpate", &["bowl, fork"]);
    assert_eq!(figures(at, "inspect model.palpate")["stopping"]["error_rate"], 0.01);
}

#[test]
fn inspect_says_what_a_model_costs_on_a_chip() {
    let at = &ONE_SPLIT.folder();
    for (chip, name) in [("m0+", "Cortex-M0+"), ("m4f", "Cortex-M4F")] {
        let inspect = format!("inspect model.palpate --chip {chip}");
        let inspected = figures(at, &inspect);
        let cost = &inspected["chip"];
        assert_eq!(cost["core"], chip);
        assert_eq!(cost["model_flash"], inspected["bytes"]);
        for bytes in ["code_flash", "ram", "stack", "margin_instructions", "verdict_instructions"] {
            assert!(cost[bytes].as_u64() > Some(0), "{bytes} in {cost}");
        }
        says(at, &inspect, &[name, "flash", "RAM", "stack", "(per touch, estimated)"]);
    }
    fails(at, "inspect model.palpate --chip z80", 2, "z80");
}

#[test]
fn parity_of_a_model_with_its_own_ensemble_has_no_difference_and_another_ensemble_is_refused() {
    let at = &ONE_SPLIT.folder();
    let parity = figures(at, "verify model.palpate ensemble.json data --sequences 200");
    assert_eq!(
        (&parity["touches"], &parity["best_differs"], &parity["verdict_differs"]),
        (&4.into(), &0.into(), &0.into())
    );
    assert!(parity["max_margin_error"].as_f64() <= parity["stated_bound"].as_f64(), "{parity}");
    let other = Ensemble { objects: vec!["bowl".into(), "spoon".into()], ..ensemble() };
    other.save(at.join("other.json")).unwrap();
    let expected = "model.palpate: the model was not compiled from this ensemble";
    fails(at, "verify model.palpate other.json data", 1, expected);
}

#[test]
fn recognize_starts_afresh_after_each_verdict_the_limit_of_touches_and_an_empty_line() {
    let at = &ONE_SPLIT.folder();
    let said = recognized(at, &"0 0 0.08\n0 0 0.01\n".repeat(3), "--max-touches 4");
    let verdicts: Vec<_> = said.iter().map(|line| verdict(line).1).collect();
    assert_eq!(verdicts, ["undecided", "undecided", "undecided", "gave-up", "undecided", "undecided"]);
    let said = recognized(at, "0 0 0.08\n0 0 0.08\n\n0 0 0.08\n", "");
    assert_eq!(said.iter().map(|line| verdict(line).0).collect::<Vec<_>>(), [1, 2, 1]);
    let said = recognized(at, &("0 0 0.08\n".repeat(9) + &"0 0 0.01\n".repeat(4)), "");
    let verdicts: Vec<_> = said.iter().map(verdict).collect();
    let three = |object| [(1, "undecided", object), (2, "undecided", object), (3, "undecided", object)];
    let recognized = |object| [(4, "recognized", object)];
    let fork = [&three("fork")[..], &recognized("fork")].concat();
    // The ninth touch is the first of the third object, which the bowl's touches then pull back.
    let mixed =
        [(1, "undecided", "fork"), (2, "undecided", "bowl"), (3, "undecided", "bowl"), (4, "undecided", "bowl")];
    assert_eq!(verdicts[..8], [fork.clone(), fork].concat());
    assert_eq!((verdicts[8], verdicts[10], verdicts[11]), (mixed[0], mixed[2], mixed[3]));
    let keys: Vec<_> = said[0].as_object().unwrap().keys().collect();
    assert_eq!(keys, ["object", "posterior", "touch", "verdict"]);
    let posterior = said[0]["posterior"].as_f64().unwrap();
    assert!((posterior - 1.0 / (1.0 + (-1.4_f64).exp())).abs() < 1e-4, "{posterior}");
}

#[test]
fn recognize_answers_each_line_of_a_slow_pipe_before_the_next_comes() {
    let place = ONE_SPLIT.folder();
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
    let at = &ONE_SPLIT.folder();
    for touch in ["0 - -\n", "0 - 0.015\n", "- - -\n"] {
        for line in recognized(at, &touch.repeat(6), "") {
            assert_eq!(verdict(&line), (0, "undecided", ""));
            assert!(line["refused"].is_string(), "{line}");
        }
        let text = succeeds(at, "recognize model.palpate touches.txt");
        assert_eq!(text.lines().filter(|line| line.contains("not counted")).count(), 6, "{text}");
        assert!(!text.contains("bowl") && !text.contains("fork"), "{text}");
    }
}

#[test]
fn recognize_names_the_line_that_is_wrong_after_answering_those_before() {
    let at = &ONE_SPLIT.folder();
    let milliseconds = "a finger touched 62.2 s after the first … Give times in seconds, not in milliseconds";
    for wrong in ["0 0", "0 0 -1", "0 0 nan", "0 0 x", "0 0 0 0", "62.2 0 2.2"] {
        fs::write(at.join("touches.txt"), format!("0 0 0.08\n\n{wrong}\n")).unwrap();
        let finished = palpate(at, "recognize model.palpate touches.txt");
        assert_eq!(finished.stdout.lines().count(), 1, "the touch before is answered");
        let why = if wrong.starts_with("62") { milliseconds } else { "" };
        complains(finished, wrong, 1, &format!("touches.txt:3: … {why}"));
    }
}

#[test]
fn what_cannot_be_exported_or_recognized_is_refused_and_the_old_model_stays() {
    let at = &ONE_SPLIT.folder();
    let before = fs::read(at.join("model.palpate")).unwrap();
    fs::write(at.join("touches.txt"), "0 0 0.08\n").unwrap();
    // Trees of times in seconds.
    let mut seconds = ensemble();
    seconds.trees = vec![seconds.trees[0].clone(); 8];
    for (number, tree) in (1..).zip(&mut seconds.trees) {
        let Node::Split { threshold, .. } = &mut tree.nodes[0] else { unreachable!() };
        *threshold = number as f32 * 0.037;
    }
    seconds.save(at.join("seconds.json")).unwrap();
    let no_touches = "touches is 0. Use at least 1.";
    for (words, code, expected) in [
        ("export ensemble.json -o model.palpate --leaf i4", 2, "--leaf"),
        ("export ensemble.json -o model.palpate --error-rate 0.7", 2, "below one half"),
        ("export ensemble.json -o model.palpate --error-rate five", 2, "0.05, or percent such as 5%"),
        ("export ensemble.json -o model.palpate --max-touches 0", 2, "touches"),
        ("export ensemble.json -o model.palpate --frobnicate 1", 2, "--frobnicate"),
        ("export seconds.json -o model.palpate", 1, "seconds.json: … of curvature is neither whole"),
        ("recognize model.palpate touches.txt --max-touches 0", 2, no_touches),
        ("recognize model.palpate touches.txt --max-touches 0 --error-rate 0.05", 2, no_touches),
    ] {
        fails(at, words, code, expected);
    }
    assert_eq!(fs::read(at.join("model.palpate")).unwrap(), before);
}

#[test]
fn a_compiled_model_such_as_a_calibrated_one_becomes_an_array() {
    let at = &ONE_SPLIT.folder();
    let bytes = fs::read(at.join("model.palpate")).unwrap();
    let exported = figures(at, "export model.palpate -o model.palpate --emit c,rust");
    assert_eq!(exported["sources"], json!(["model.h", "model.rs"]));
    let source = fs::read_to_string(at.join("model.h")).unwrap();
    let array = source.split("= {").nth(1).unwrap().split('}').next().unwrap();
    let array: Vec<u8> = array.split(',').filter_map(|byte| byte.trim().parse().ok()).collect();
    assert_eq!(array, bytes);
    assert!(at.join("palpate.h").exists());
    assert_eq!(fs::read(at.join("model.palpate")).unwrap(), bytes, "it is what it was");
    succeeds(at, "export model.palpate -o copy.palpate --emit c");
    assert_eq!(fs::read(at.join("copy.palpate")).unwrap(), bytes);
    assert!(at.join("copy.h").exists());
    for (more, expected) in [
        ("", "--emit is not given. Use c or rust"),
        ("--emit json", "--emit is json. Use it with an ensemble"),
        ("--emit c-code", "Use c or rust for a model that was loaded or calibrated: it is bytes"),
        ("--emit c --leaf i8", "--leaf is given. Use it with an ensemble"),
        ("--emit c --error-rate 5%", "--error-rate is given"),
    ] {
        fails(at, &format!("export model.palpate -o other.palpate {more}"), 2, expected);
        assert!(!at.join("other.palpate").exists());
    }
}

#[test]
fn export_emits_sources_beside_the_model_and_refuses_a_name_that_leaves_no_room_for_them() {
    let at = &ONE_SPLIT.folder();
    let exported = figures(at, "export ensemble.json -o cup.palpate --emit c,rust");
    assert_eq!(exported["sources"], json!(["cup.h", "cup.rs"]));
    let read = |name: &str| fs::read_to_string(at.join(name)).unwrap();
    let length = fs::metadata(at.join("cup.palpate")).unwrap().len();
    assert!(read("cup.h").contains(&format!("cup_model[{length}]")));
    assert!(read("cup.rs").contains("pub static CUP:"));
    assert_eq!(read("palpate.h"), palpate_onboard::C_HEADER);
    let exported = figures(at, "export ensemble.json -o cup.palpate --emit json");
    assert_eq!(exported["ensemble"], "cup.json");
    let [cup, own] = ["cup", "ensemble"].map(|name| palpate::ensemble::load(at.join(format!("{name}.json"))).unwrap());
    assert_eq!(cup, own);
    fs::remove_file(at.join("palpate.h")).unwrap();
    for (output, language) in [
        ("model.h", "c"),
        ("palpate.palpate", "c"),
        (".palpate", "c"),
        ("-", "rust"),
        // The file that it is made of stays.
        ("ensemble.palpate", "json"),
        ("model.palpate", "cobol"),
    ] {
        fails(at, &format!("export ensemble.json -o {output} --emit {language}"), 2, "");
    }
    for name in ["model.h", "palpate.h", "palpate.palpate", ".palpate", "ensemble.palpate"] {
        assert!(!at.join(name).exists(), "{name}");
    }
}

#[test]
fn leaves_of_touches_of_more_than_fifty_objects_take_a_byte_unless_told_otherwise() {
    let at = &Folder::new();
    for (objects, more, expected) in
        [(50, "", "i16"), (51, "", "i8"), (51, "--leaf i16", "i16"), (50, "--leaf i8", "i8")]
    {
        let mut many = ensemble();
        for node in many.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
            if let Node::Leaf(values) = node {
                *values = (0..objects).map(|object| values[object % 2]).collect();
            }
        }
        many.objects = (0..objects).map(|object| format!("object-{object:03}")).collect();
        many.base_margins = vec![0.5; objects];
        many.save(at.join("many.json")).unwrap();
        assert_eq!(figures(at, &format!("export many.json -o many.palpate {more}"))["leaf"], expected);
        if more.is_empty() {
            // The library does the same with it.
            let usual = palpate::compile::usual(&many);
            let compiled = palpate::compile::compile(&many, &usual).unwrap();
            assert_eq!(fs::read(at.join("many.palpate")).unwrap(), compiled.bytes);
        }
    }
}

#[test]
fn full_touches_alone_are_warned_of_where_it_is_evidence_which_fingers_touch() {
    let at = &ONE_SPLIT.folder();
    let full = "0 0.031 0.012\n".repeat(40);
    let said = |model: &str, touches: &str| {
        fs::write(at.join("touches.txt"), touches).unwrap();
        stderr(palpate(at, &format!("recognize {model} touches.txt")), 0)
    };
    let warning = "all 40 touches are full, and to this model it is evidence which fingers";
    assert!(said(HOUSEHOLD, &full).contains(warning));
    assert_eq!(said(HOUSEHOLD, &format!("{full}0 - 0.2\n")), "");
    assert_eq!(said(HOUSEHOLD, "0 0.031 0.012\n"), "");
    assert_eq!(said("model.palpate", &full), "");
    fs::create_dir(at.join("full")).unwrap();
    ["bowl", "fork"].iter().for_each(|name| fs::write(at.join(format!("full/{name}.txt")), &full).unwrap());
    let finished = palpate(at, &format!("evaluate {HOUSEHOLD} full --at 5 --sequences 10"));
    let said = String::from_utf8(finished.stderr).unwrap();
    assert!(said.contains("all 80 touches are full"), "{said}");
}
