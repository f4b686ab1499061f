//! Sequences of rows whose number is a feature, or whose sensors are guarded: export, calibrate, evaluate, recognize, inspect.

use crate::{Folder, fails, figures, lines, normal, says, succeeds};
use palpate::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree};
use serde_json::json;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// A folder with an ensemble that distinguishes rising from falling heights by the row number.
fn place() -> Folder {
    let split = |feature, threshold, left, right| Node::Split { feature, threshold, missing_left: true, left, right };
    let leaf = |up: f32| Node::Leaf(vec![up, -up]);
    let splits = [split(0, 5.5, 1, 2), split(1, 0.55, 3, 4), split(1, 0.55, 5, 6)];
    let nodes = splits.into_iter().chain([0.7, -0.7, -0.7, 0.7].map(leaf)).collect();
    let ensemble = Ensemble {
        inputs: Inputs::Rows(["number", "height"].map(String::from).to_vec()),
        objects: ["up", "down"].map(String::from).to_vec(),
        base_margins: vec![0.0; 2],
        trees: vec![Tree { nodes, output: Output::Each }],
        origin: Provenance::default(),
    };
    let place = Folder::new();
    ensemble.save(place.join("ramps.json")).unwrap();
    place
}

/// Writes rows without their numbers, and with them as `numbered-`.
fn write(at: &Path, name: &str, rows: &[Row]) {
    let [mut plain, mut numbered] = ["id,kind,height\n", "id,kind,height,number\n"].map(String::from);
    let (mut number, mut last) = (0, None);
    for Row { id, kind, height } in rows {
        number = if last == Some(*id) { number + 1 } else { 1 };
        last = Some(*id);
        writeln!(plain, "{id},{kind},{height}").unwrap();
        writeln!(numbered, "{id},{kind},{height},{number}").unwrap();
    }
    fs::write(at.join(name), plain).unwrap();
    fs::write(at.join(format!("numbered-{name}")), numbered).unwrap();
}

struct Row {
    id: usize,
    kind: &'static str,
    /// Empty where it is missing.
    height: String,
}

/// Heights that rise from 0.1 to 1 in ten rows, or fall, with noise.
fn ramps(count: usize, mut state: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    for (id, step) in (0..count).flat_map(|id| (1..=10).map(move |step| (id, f64::from(step) / 10.0))) {
        let noise = 0.4 * normal(&mut state);
        let (kind, height) = if id % 2 == 0 { ("up", step) } else { ("down", 1.1 - step) };
        rows.push(Row { id, kind, height: format!("{:.6}", height + noise) });
    }
    rows
}

const COLUMNS: &str = "--label kind --sequence-column id";

#[test]
fn a_model_that_counts_rows_gives_the_verdicts_of_the_ensemble_with_the_numbers_added_by_hand() {
    let at = &place();
    write(at, "fresh.csv", &ramps(400, 1));
    write(at, "unseen.csv", &ramps(200, 2));
    // By keys of f32 values, and in units.
    for scale in ["", "--scale number=10,height=1000"] {
        succeeds(at, &format!("export ramps.json -o plain {scale}"));
        succeeds(at, &format!("export ramps.json -o counts --row-number number {scale}"));
        let [mut by_hand, mut counted] = ["plain numbered-fresh.csv -o by-hand", "counts fresh.csv -o counted"]
            .map(|files| figures(at, &format!("calibrate {files} --error-rate 10% {COLUMNS}")));
        for key in ["error", "undecided", "margins"] {
            assert!(!counted[key].is_null(), "{key}");
            assert_eq!(by_hand[key].take(), counted[key].take(), "{key}");
        }
        let recognize = |files: &str| {
            let words = format!("recognize {files} --features --add-up --sequence-column id --json");
            lines(&succeeds(at, &words))
        };
        let said = recognize("counted unseen.csv");
        assert_eq!(said, recognize("by-hand numbered-unseen.csv"));
        let recognized = said.iter().filter(|line| line["verdict"] == "recognized").count();
        assert!(recognized > 100, "{recognized} of 200 sequences are recognized");
        let confusion = |files: &str| figures(at, &format!("evaluate {files} {COLUMNS}"))["confusion"].take();
        assert_eq!(confusion("counted unseen.csv"), confusion("by-hand numbered-unseen.csv"));
        // A row by itself has no number other than its own.
        let [own, other] = ["counted", "by-hand"]
            .map(|model| succeeds(at, &format!("recognize {model} numbered-unseen.csv --features --json")));
        assert_eq!(own, other);
        fails(at, "recognize counted unseen.csv --features", 1, "no column is named number");
        let inspected = figures(at, "inspect counted");
        assert_eq!((&inspected["position"], inspected.get("guard")), (&json!("number"), None));
        says(at, "inspect counted", &["row number      number, which recognizers count\n"]);
        assert!(!succeeds(at, "inspect by-hand").contains("row number"));
    }
}

#[test]
fn a_guard_names_the_sensor_that_is_stuck_missing_or_out_of_its_range() {
    let at = &place();
    succeeds(at, "export ramps.json -o counts --row-number number");
    write(at, "fresh.csv", &ramps(400, 1));
    let text = succeeds(at, &format!("calibrate counts fresh.csv -o sure --error-rate 10% --guard {COLUMNS}"));
    assert!(text.contains("Guard: refuses ") && text.contains(" that it was not learned from\n"), "{text}");
    let guard = figures(at, "inspect sure")["guard"].take();
    let (number, height) = (&guard[0], &guard[1]);
    assert_eq!(
        number,
        &json!({"feature": "number", "low": null, "high": null, "may_miss": true, "most_equal": null}),
        "what is counted does not fail"
    );
    assert_eq!((&height["feature"], &height["may_miss"]), (&json!("height"), &json!(false)));
    // No height is there twice in a row, so that twice is taken.
    assert_eq!(height["most_equal"], 2);
    let [low, high] = ["low", "high"].map(|end| height[end].as_f64().unwrap());
    assert!((-6.0..-1.0).contains(&low) && (2.0..7.0).contains(&high), "{height}");
    let text = succeeds(at, "inspect sure");
    let line = format!(
        "guard           1 of 2 features have limits\n{:16}height: {} to {}, never missing, the same in at most 2 rows\n",
        "", low as f32, high as f32
    );
    assert!(text.contains(&line), "{text}");
    // Heights that contradict each other, so that there is no verdict before a sensor fails in row 6.
    let contrary = ["0.1", "0.9", "0.1", "0.9", "0.1"].map(String::from);
    let failing = |id, value: &str| {
        let heights = contrary.clone().into_iter().chain([(); 4].map(|()| value.to_owned()));
        heights.map(move |height| Row { id, kind: "up", height }).collect::<Vec<_>>()
    };
    let broken = [failing(1, "0.1"), failing(2, ""), failing(3, "40"), failing(4, "-40")];
    write(at, "broken.csv", &broken.into_iter().flatten().collect::<Vec<_>>());
    let recognize = "recognize sure broken.csv --features --add-up --sequence-column id";
    let said = lines(&succeeds(at, &format!("{recognize} --json")));
    let refused = |id: &str| -> Vec<(u64, &str)> {
        let own = said.iter().filter(|line| line["sequence"] == id && line.get("refused").is_some());
        own.map(|line| (line["row"].as_u64().unwrap(), line["refused"].as_str().unwrap())).collect()
    };
    let [stuck, missing, outside] = [
        "height: a feature stayed the same for longer than in any sequence of calibration",
        "height: a feature is missing, which never happened in calibration",
        "height: a feature is outside of what the model was calibrated on",
    ];
    // The height in row 5 is the one that stays: rows 5 and 6 are taken.
    assert_eq!(refused("1"), [7, 8, 9].map(|row| (row, stuck)));
    assert_eq!(refused("2"), [15, 16, 17, 18].map(|row| (row, missing)));
    assert_eq!(refused("3"), [24, 25, 26, 27].map(|row| (row, outside)));
    assert_eq!(refused("4"), [33, 34, 35, 36].map(|row| (row, outside)));
    let last = said.iter().rfind(|line| line["sequence"] == "4").unwrap();
    assert_eq!((&last["rows"], &last["margins"]), (&json!(5), &json!([])), "rows that are refused count nothing");
    says(at, recognize, &[&format!("  2  refused: {missing}\n")]);
    let evaluate = format!("evaluate sure broken.csv {COLUMNS}");
    let text = succeeds(at, &evaluate);
    assert!(text.starts_with("4 sequences, 21 rows, 15 others refused\n"), "{text}");
    assert_eq!(figures(at, &evaluate)["refused"], 15);
    // Without one nothing is refused.
    let text = succeeds(at, &format!("calibrate sure fresh.csv -o plain --error-rate 10% {COLUMNS}"));
    assert!(!text.contains("Guard") && !succeeds(at, "inspect plain").contains("guard"));
}

#[test]
fn numbers_of_rows_and_guards_are_refused_where_there_is_no_such_feature_or_no_sequence() {
    let at = &place();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/import/catboost-1.2-regression.json");
    fs::copy(data, at.join("regression.json")).unwrap();
    crate::compiled::ensemble().save(at.join("touches.json")).unwrap();
    write(at, "fresh.csv", &ramps(40, 1));
    succeeds(at, "export ramps.json -o model.palpate --row-number number");
    // A model with one output.
    succeeds(at, "export regression.json -o value.palpate");
    let name = "--row-number is Number. Use the name of a feature that the trees split on, such as number, height";
    let whole = "one feature of several, with a whole number as its scale";
    let classes = "Use it with classes of rows, which a sequence has one of";
    let columns = &format!("fresh.csv -o x --error-rate 10% --guard {COLUMNS}");
    for (words, code, expected) in [
        ("export ramps.json -o x --row-number Number", 2, name),
        ("export ramps.json -o x --row-number number --scale number=0.5,height=1000", 2, whole),
        ("export ramps.json -o x --row-number number --scale number=1.5,height=1000", 2, whole),
        ("export regression.json -o x --row-number width", 2, classes),
        ("export touches.json -o x --row-number curvature", 2, "Use it with classes of rows"),
        ("export model.palpate -o x --emit c --row-number number", 2, "model.palpate is a compiled model"),
        (&format!("calibrate value.palpate {columns}"), 1, "value.palpate"),
        ("calibrate model.palpate fresh.csv -o x --error-rate 10% --guard --label kind", 2, "--sequence-column"),
    ] {
        fails(at, words, code, expected);
    }
    assert!(!at.join("x").exists());
}
