//! Sequences of rows whose number is a feature, or whose sensors are guarded: export, calibrate, evaluate, recognize, inspect.

use crate::{json, run, stderr, stdout};
use palpate::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use tempfile::TempDir;

/// Files of a test, and the paths of them.
struct Place(TempDir);

impl Place {
    /// Place with an ensemble that distinguishes rising from falling heights by the row number.
    fn new() -> Self {
        let split =
            |feature, threshold, left, right| Node::Split { feature, threshold, missing_left: true, left, right };
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
        let place = Self(tempfile::tempdir().unwrap());
        ensemble.save(place.0.path().join("ramps.json")).unwrap();
        place
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    /// Writes rows without their numbers, and with them as `numbered-`; returns both paths.
    fn write(&self, name: &str, rows: &[Row]) -> [String; 2] {
        let paths = [name.to_owned(), format!("numbered-{name}")].map(|name| self.path(&name));
        let [mut plain, mut numbered] = ["id,kind,height\n", "id,kind,height,number\n"].map(String::from);
        let (mut number, mut last) = (0, None);
        for Row { id, kind, height } in rows {
            number = if last == Some(*id) { number + 1 } else { 1 };
            last = Some(*id);
            writeln!(plain, "{id},{kind},{height}").unwrap();
            writeln!(numbered, "{id},{kind},{height},{number}").unwrap();
        }
        std::fs::write(&paths[0], plain).unwrap();
        std::fs::write(&paths[1], numbered).unwrap();
        paths
    }
}

struct Row {
    id: usize,
    kind: &'static str,
    /// Empty where it is missing.
    height: String,
}

/// Heights that rise from 0.1 to 1 in ten rows, or fall, with noise.
fn ramps(count: usize, mut state: u64) -> Vec<Row> {
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut rows = Vec::new();
    for (id, step) in (0..count).flat_map(|id| (1..=10).map(move |step| (id, f64::from(step) / 10.0))) {
        let noise = 0.4 * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0);
        let (kind, height) = if id % 2 == 0 { ("up", step) } else { ("down", 1.1 - step) };
        rows.push(Row { id, kind, height: format!("{:.6}", height + noise) });
    }
    rows
}

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

const COLUMNS: [&str; 4] = ["--label", "kind", "--sequence-column", "id"];

#[test]
fn a_model_that_counts_rows_gives_the_verdicts_of_the_ensemble_with_the_numbers_added_by_hand() {
    let place = Place::new();
    let (ensemble, plain, counts) = (place.path("ramps.json"), place.path("plain"), place.path("counts"));
    let [fresh, numbered_fresh] = place.write("fresh.csv", &ramps(400, 1));
    let [unseen, numbered_unseen] = place.write("unseen.csv", &ramps(200, 2));
    // By keys of f32 values, and in units.
    for scale in [&[][..], &["--scale", "number=10,height=1000"]] {
        stdout(run([&["export", &ensemble, "-o", &plain][..], scale].concat()));
        stdout(run([&["export", &ensemble, "-o", &counts, "--row-number", "number"][..], scale].concat()));
        let calibrate = |model: &str, rows: &str| {
            let output = format!("{model}-sure");
            let words = ["calibrate", model, rows, "-o", &output, "--error-rate", "10%", "--json"];
            json(run([&words[..], &COLUMNS].concat()))
        };
        let [mut by_hand, mut counted] = [calibrate(&plain, &numbered_fresh), calibrate(&counts, &fresh)];
        for key in ["error", "undecided", "margins"] {
            assert!(!counted[key].is_null(), "{key}");
            assert_eq!(by_hand[key].take(), counted[key].take(), "{key}");
        }
        let sure = [&plain, &counts].map(|model| format!("{model}-sure"));
        let recognize = |model: &str, rows: &str| {
            let words = ["recognize", model, rows, "--features", "--add-up", "--sequence-column", "id", "--json"];
            lines(&stdout(run(words)))
        };
        let said = recognize(&sure[1], &unseen);
        assert_eq!(said, recognize(&sure[0], &numbered_unseen));
        let recognized = said.iter().filter(|line| line["verdict"] == "recognized").count();
        assert!(recognized > 100, "{recognized} of 200 sequences are recognized");
        let evaluate =
            |model: &str, rows: &str| json(run([&["evaluate", model, rows, "--json"][..], &COLUMNS].concat()));
        let found = evaluate(&sure[1], &unseen);
        assert_eq!(found["confusion"], evaluate(&sure[0], &numbered_unseen)["confusion"]);
        // A row by itself has no number other than its own.
        let alone = |model: &str| lines(&stdout(run(["recognize", model, &numbered_unseen, "--features", "--json"])));
        assert_eq!(alone(&sure[1]), alone(&sure[0]));
        let message = stderr(run(["recognize", &sure[1], &unseen, "--features"]), 1);
        assert!(message.contains("no column is named number"), "{message}");
        let inspected = json(run(["inspect", &sure[1], "--json"]));
        assert_eq!((&inspected["position"], inspected.get("guard")), (&json!("number"), None));
        let text = stdout(run(["inspect", &sure[1]]));
        assert!(text.contains("row number     number, which recognizers count\n"), "{text}");
        assert!(!stdout(run(["inspect", &sure[0]])).contains("row number"));
    }
}

#[test]
fn a_guard_names_the_sensor_that_is_stuck_missing_or_out_of_its_range() {
    let place = Place::new();
    let (counts, sure) = (place.path("counts"), place.path("sure"));
    stdout(run(["export", &place.path("ramps.json"), "-o", &counts, "--row-number", "number"]));
    let [fresh, _] = place.write("fresh.csv", &ramps(400, 1));
    let calibrate = ["calibrate", &counts, &fresh, "-o", &sure, "--error-rate", "10%", "--guard"];
    let text = stdout(run([&calibrate[..], &COLUMNS].concat()));
    assert!(text.contains("Guard: refuses ") && text.contains(" that it was not learned from\n"), "{text}");
    let guard = json(run(["inspect", &sure, "--json"]))["guard"].take();
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
    let text = stdout(run(["inspect", &sure]));
    let line = format!(
        "guard          1 of 2 features have limits\n{:15}height: {} to {}, never missing, the same in at most 2 rows\n",
        "", low as f32, high as f32
    );
    assert!(text.contains(&line), "{text}");
    // Heights that contradict each other, so that there is no verdict before a sensor fails in row 6.
    let contrary = ["0.1", "0.9", "0.1", "0.9", "0.1"].map(String::from);
    let failing = |id, value: &str| {
        let heights = contrary.clone().into_iter().chain([(); 4].map(|()| value.to_owned()));
        heights.map(move |height| Row { id, kind: "up", height }).collect::<Vec<_>>()
    };
    let broken = [failing(1, "0.1"), failing(2, ""), failing(3, "40"), failing(4, "-40")].into_iter().flatten();
    let broken: Vec<Row> = broken.collect();
    let [broken, _] = place.write("broken.csv", &broken);
    let words = ["recognize", &sure, &broken, "--features", "--add-up", "--sequence-column", "id"];
    let said = lines(&stdout(run([&words[..], &["--json"]].concat())));
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
    let text = stdout(run(words));
    assert!(text.contains(&format!("  2  refused: {missing}\n")), "{text}");
    let evaluate = ["evaluate", &sure, &broken];
    let text = stdout(run([&evaluate[..], &COLUMNS].concat()));
    assert!(text.starts_with("4 sequences, 21 rows, 15 others refused\n"), "{text}");
    assert_eq!(json(run([&evaluate[..], &COLUMNS, &["--json"]].concat()))["refused"], 15);
    // Without one nothing is refused.
    let plain = place.path("plain");
    let calibrate = ["calibrate", &sure, &fresh, "-o", &plain, "--error-rate", "10%"];
    assert!(!stdout(run([&calibrate[..], &COLUMNS].concat())).contains("Guard"));
    assert!(!stdout(run(["inspect", &plain])).contains("guard"));
}

#[test]
fn numbers_of_rows_and_guards_are_refused_where_there_is_no_such_feature_or_no_sequence() {
    let place = Place::new();
    let (ensemble, output) = (place.path("ramps.json"), place.path("no.palpate"));
    let data = |name: &str| format!("{}/../../tests/data/import/{name}", env!("CARGO_MANIFEST_DIR"));
    let regression = data("catboost-1.2-regression.json");
    let export = |more: &[&str]| stderr(run([&["export", &ensemble, "-o", &output][..], more].concat()), 2);
    let message = export(&["--row-number", "Number"]);
    let expected = "--row-number is Number. Use the name of a feature that the trees split on, such as number, height";
    assert!(message.contains(expected), "{message}");
    for scale in ["number=0.5,height=1000", "number=1.5,height=1000"] {
        let message = export(&["--row-number", "number", "--scale", scale]);
        assert!(message.contains("one feature of several, with a whole number as its scale"), "{message}");
    }
    let message = stderr(run(["export", &regression, "-o", &output, "--row-number", "width"]), 2);
    assert!(message.contains("Use it with classes of rows, which a sequence has one of"), "{message}");
    let touches = crate::compiled::Place::new();
    let over_touches = touches.text("ensemble.json");
    let message = stderr(run(["export", &over_touches, "-o", &output, "--row-number", "curvature"]), 2);
    assert!(message.contains("Use it with classes of rows"), "{message}");
    assert!(!Path::new(&output).exists());
    let (model, rows) = (place.path("model.palpate"), place.write("fresh.csv", &ramps(400, 1)));
    stdout(run(["export", &ensemble, "-o", &model, "--row-number", "number"]));
    let message = stderr(run(["export", &model, "-o", &output, "--emit", "c", "--row-number", "number"]), 2);
    assert!(message.contains("model.palpate is a compiled model"), "{message}");
    // Sequences of a model with one output, and none at all.
    let value = place.path("value.palpate");
    stdout(run(["export", &regression, "-o", &value]));
    let calibrate = |model: &str, more: &[&str]| {
        run([&["calibrate", model, &rows[0], "-o", &output, "--error-rate", "10%", "--guard"][..], more].concat())
    };
    let message = stderr(calibrate(&value, &COLUMNS), 1);
    assert!(message.contains("value.palpate"), "{message}");
    assert!(stderr(calibrate(&model, &["--label", "kind"]), 2).contains("--sequence-column"));
    assert!(!Path::new(&output).exists());
}

/// Recordings of 100 rows: `low` between events of `middle` and `high`.
fn recordings(count: usize, mut state: u64) -> String {
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut text = "id,kind,x\n".to_owned();
    for id in 0..count {
        for (class, name) in [(0.0, "low"), (3.0, "high"), (0.0, "low"), (1.5, "middle"), (0.0, "low")] {
            for _ in 0..20 {
                let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                writeln!(text, "{id},{name},{:.5}", class + noise).unwrap();
            }
        }
    }
    text
}

/// Trees whose margins are the log-densities of the classes, in steps.
fn classes_of_recordings(place: &Place) -> String {
    let cuts: Vec<f64> = (-12..=18).map(|step| f64::from(step) * 0.25).collect();
    let leaf = |x: f64| Node::Leaf([0.0, 1.5, 3.0].map(|at: f64| (-0.5 * (x - at).powi(2)) as f32).to_vec());
    let mut nodes = Vec::new();
    for cut in &cuts {
        let here = nodes.len();
        let threshold = *cut as f32;
        nodes.push(Node::Split { feature: 0, threshold, missing_left: true, left: here + 1, right: here + 2 });
        nodes.push(leaf(cut - 0.125));
    }
    nodes.push(leaf(cuts[cuts.len() - 1] + 0.125));
    let ensemble = Ensemble {
        inputs: Inputs::Rows(vec!["x".into()]),
        objects: ["low", "middle", "high"].map(String::from).to_vec(),
        base_margins: vec![0.0; 3],
        trees: vec![Tree { nodes, output: Output::Each }],
        origin: Provenance::default(),
    };
    let (path, model) = (place.path("steps.json"), place.path("steps"));
    ensemble.save(&path).unwrap();
    stdout(run(["export", &path, "-o", &model]));
    model
}

#[test]
fn verdicts_go_on_through_recordings_of_events_at_a_promised_rate_and_as_evaluate_counts_them() {
    let place = Place::new();
    let (model, sure) = (classes_of_recordings(&place), place.path("events"));
    let [known, unseen] = [(240, 1), (100, 2)].map(|(count, seed)| {
        let path = place.path(&format!("recordings{seed}.csv"));
        std::fs::write(&path, recordings(count, seed)).unwrap();
        path
    });
    let events = ["--events", "low", "--rows-per-second", "10", "--false-per-hour", "120", "--hold-off", "1.5"];
    let calibrate = [&["calibrate", &model, &known, "-o", &sure][..], &COLUMNS, &events].concat();
    let text = stdout(run(calibrate.clone()));
    assert!(
        text.contains("Promised: at most 120 false or repeated verdicts per hour, with a probability of 95 %"),
        "{text}"
    );
    assert!(text.contains("in the first 10.0 s of a recording") && text.contains("180 recordings"), "{text}");
    let found = json(run([&["evaluate", &sure, &unseen, "--json"][..], &COLUMNS].concat()));
    let number = |key: &str| found[key].as_f64().unwrap();
    assert_eq!([number("recordings"), number("events"), number("too_long")], [100.0, 200.0, 0.0]);
    assert!(number("named") > 150.0 && number("mean_delay") < 1.5 && found["finding"] == "kept", "{found}");
    let text = stdout(run([&["evaluate", &sure, &unseen][..], &COLUMNS].concat()));
    assert!(
        text.contains("promised: at most 120 per hour") && text.contains("as few false by a majority of "),
        "{text}"
    );
    assert!(text.contains("as few false by debouncing of "), "{text}");
    let said =
        stdout(run(["recognize", &sure, &unseen, "--features", "--add-up", "--sequence-column", "id", "--json"]));
    let verdicts: Vec<Value> = lines(&said).into_iter().filter(|line| line["verdict"] == "recognized").collect();
    assert_eq!(verdicts.len() as f64, number("named") + number("false") + number("repeated"));
    assert!(verdicts.iter().all(|line| line["class"] != "low"));
    let inspected = json(run(["inspect", &sure, "--json"]));
    assert_eq!(inspected["events"]["background"], "low");
    assert_eq!([&inspected["events"]["hold_off"], &inspected["events"]["grace"]], [1.5, 1.0]);
    let text = stdout(run(["inspect", &sure]));
    assert!(text.contains("between low, at 10.0 rows per second; 1.5 s from one verdict to the next"), "{text}");
    // The same seed gives the same bytes.
    let first = std::fs::read(&sure).unwrap();
    stdout(run(calibrate));
    assert_eq!(std::fs::read(&sure).unwrap(), first);
}

#[test]
fn what_is_wrong_with_recordings_of_events_is_said_and_nothing_is_written() {
    let place = Place::new();
    let (model, sure, rows) = (classes_of_recordings(&place), place.path("events"), place.path("recordings.csv"));
    std::fs::write(&rows, recordings(20, 1)).unwrap();
    let calibrate =
        |options: &[&str]| run([&["calibrate", &model, &rows, "-o", &sure][..], &COLUMNS, options].concat());
    let message = stderr(calibrate(&["--events", "low", "--rows-per-second", "10"]), 1);
    assert!(
        message.contains("20 recordings")
            && message.contains("are too few to promise 1 false verdicts per hour: about "),
        "{message}"
    );
    let message = stderr(calibrate(&["--events", "none", "--rows-per-second", "10"]), 2);
    assert!(message.contains("a class of the model: low, middle, high"), "{message}");
    let message = stderr(calibrate(&["--events", "low", "--rows-per-second", "0"]), 2);
    assert!(message.contains("--rows-per-second is 0. Use above 0"), "{message}");
    for options in
        [&["--events", "low"][..], &["--hold-off", "1"], &["--events", "low", "--rows-per-second", "9", "--guard"]]
    {
        stderr(calibrate(options), 2);
    }
    assert!(!Path::new(&sure).exists());
    // Sequences have one label, unless they are recordings of events.
    let message = stderr(calibrate(&[]), 1);
    assert!(message.contains("has the labels"), "{message}");
}
