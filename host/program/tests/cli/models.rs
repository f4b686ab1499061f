//! The commands that make and measure models, as a user calls them: train, tune, evaluate.

use crate::{fails, succeeds};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

/// A directory of touches of two objects: one bends by up to 0.1 s, the other by up to 0.2 s.
fn touches(directory: &Path) {
    for (name, bend) in [("bowl", 100_000), ("fork", 200_000)] {
        // Golden-ratio steps spread evenly, without chance.
        let spread = |index: u64, range: u64| (index * 618_033 + 7) % range;
        let line = |index| {
            let (slope, bend) = (spread(index, 300_007), spread(index * index + 3, bend));
            let times = [0, slope / 2 + bend, slope].map(|micros| micros as f64 * 1e-6);
            format!("{:.6} {:.6} {:.6}\n", times[0], times[1], times[2])
        };
        let text = (0..400).fold(String::new(), |mut text, index| {
            _ = write!(text, "{}", line(index));
            text
        });
        std::fs::write(directory.join(format!("{name}.txt")), text).unwrap();
    }
}

fn set_up() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    std::fs::create_dir(directory.path().join("data")).unwrap();
    touches(&directory.path().join("data"));
    directory
}

#[test]
fn an_ensemble_and_its_compiled_model_evaluate_side_by_side() {
    let directory = set_up();
    let at = directory.path();
    let trained = succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", "rounds=5", "--json"]);
    let trained: Value = serde_json::from_str(&trained).unwrap();
    assert_eq!((&trained["trees"], &trained["touches"]), (&5.into(), &800.into()));
    succeeds(at, &["export", "ensemble.json", "-o", "model.palpate"]);
    let figures = ["ensemble.json", "model.palpate"].map(|model| -> Value {
        let json = succeeds(at, &["evaluate", model, "data", "--at", "5,20", "--sequences", "100", "--json"]);
        serde_json::from_str(&json).unwrap()
    });
    for figures in &figures {
        assert!(figures["accuracy"]["20"].as_f64() >= figures["accuracy"]["5"].as_f64());
        assert!(figures["per_object"]["fork"]["5"].is_number());
        assert!(figures["sequential"]["mean_touches"].as_f64() >= Some(1.0));
    }
    let noisy =
        ["evaluate", "model.palpate", "data", "--at", "5,20", "--sequences", "100", "--json", "--real", "noise=200ms"];
    let noisy: Value = serde_json::from_str(&succeeds(at, &noisy)).unwrap();
    assert!(noisy["accuracy"]["20"].as_f64() < figures[1]["accuracy"]["20"].as_f64());
    let table = succeeds(at, &["evaluate", "model.palpate", "data"]);
    assert!(table.contains("bowl") && table.contains("Stopping at an error rate of 1 %"), "{table}");
}

#[test]
fn noise_of_every_kind_is_added_to_the_touches_that_are_evaluated() {
    let directory = set_up();
    let at = directory.path();
    succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", "rounds=5"]);
    let evaluate = ["evaluate", "ensemble.json", "data", "--at", "10", "--sequences", "100", "--json"];
    let accuracy = |more: &[&str]| -> (f64, u64) {
        let figures: Value = serde_json::from_str(&succeeds(at, &[&evaluate[..], more].concat())).unwrap();
        (figures["accuracy"]["10"].as_f64().unwrap(), figures["robots"].as_u64().unwrap())
    };
    let (clean, robots) = accuracy(&[]);
    assert_eq!(robots, 1);
    for more in [
        &["--real", "noise=0..400ms"][..],
        &["--real", "timer=200ms"],
        &["--real", "debounce=400ms"],
        &["--real", "bent=0ms/150ms/0ms"],
        &["--real", "speed_error=90%"],
    ] {
        assert!(accuracy(more).0 < clean, "{more:?}: {clean}");
    }
    let evaluate: Vec<&str> = evaluate.iter().copied().filter(|word| *word != "--json").collect();
    fails(at, &[&evaluate[..], &["--real", "missed=200%"]].concat(), 2, "missed is \"200%\"; use a share from 0 to 1");
    fails(at, &[&evaluate[..], &["--real", "bent=9:1ms"]].concat(), 2, "bent is \"9:1ms\"; use a duration");
    fails(at, &[&evaluate[..], &["--real", "noise=5"]].concat(), 2, "such as 0..10ms");
}

#[test]
fn training_says_what_a_millisecond_of_noise_would_cost() {
    let directory = set_up();
    let at = directory.path();
    let text = succeeds(at, &["train", "data", "-o", "clean.json", "--trees", "rounds=5"]);
    assert!(text.contains("1 ms of noise on contact times would cost") && text.contains("--real noise=1ms"), "{text}");
    let json = succeeds(at, &["train", "data", "-o", "clean.json", "--trees", "rounds=5", "--json"]);
    let json: Value = serde_json::from_str(&json).unwrap();
    assert!(json["cost_of_noise"]["clean"].as_f64() > Some(0.5) && json["cost_of_noise"]["touches"] == 10, "{json}");
    let text = succeeds(at, &["train", "data", "-o", "robust.json", "--trees", "rounds=5", "--real", "noise=0..10ms"]);
    assert!(!text.contains("would cost"), "{text}");
    for object in ["bowl", "fork"] {
        let path = at.join(format!("data/{object}.txt"));
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.lines().take(99).map(|line| format!("{line}\n")).collect::<String>()).unwrap();
    }
    let text = succeeds(at, &["train", "data", "-o", "small.json", "--trees", "rounds=5"]);
    assert!(text.contains("was not measured: an object has fewer than 100 touches"), "{text}");
}

#[test]
fn an_ensemble_states_the_noise_that_it_was_trained_with() {
    let directory = set_up();
    let at = directory.path();
    let attribute = |more: &[&str]| -> Value {
        succeeds(at, &[&["train", "data", "-o", "ensemble.json", "--trees", "rounds=3"], more].concat());
        let json: Value = serde_json::from_slice(&std::fs::read(at.join("ensemble.json")).unwrap()).unwrap();
        match json["learner"]["attributes"]["palpate_noise"].as_str() {
            Some(text) => serde_json::from_str(text).unwrap(),
            None => Value::Null,
        }
    };
    assert_eq!(attribute(&[]), Value::Null);
    let noise = attribute(&["--real", "noise=0..10ms,timer=1ms"]);
    assert_eq!((&noise["deviation"]["largest"], &noise["timer"]), (&10_000.0.into(), &1_000.0.into()));
    // The model that it is compiled to is read again.
    succeeds(at, &["export", "ensemble.json", "-o", "model.palpate"]);
}

#[test]
fn training_twice_writes_the_same_bytes_whatever_the_threads() {
    let directory = set_up();
    let read = |name| std::fs::read(directory.path().join(name)).unwrap();
    for (name, threads) in [("one.json", "1"), ("three.json", "3")] {
        succeeds(directory.path(), &["train", "data", "-o", name, "--real", "noise=5ms", "--threads", threads]);
    }
    assert_eq!(read("one.json"), read("three.json"));
}

#[test]
fn trees_of_few_different_leaves_make_a_smaller_model_that_is_exact() {
    let directory = set_up();
    let at = directory.path();
    let export = |more: &str| -> Value {
        let trees = format!("rounds=10,leaf_bits=8{more}");
        succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", &trees]);
        let export = ["export", "ensemble.json", "-o", "model.palpate", "--leaf", "i8", "--layout", "size", "--json"];
        serde_json::from_str(&succeeds(at, &export)).unwrap()
    };
    let usual = export("");
    let small = export(",different_leaves=16");
    let dear = export(",different_leaves=16,threshold_cost=0.01");
    let number = |exported: &Value, key: &str| exported[key].as_f64().unwrap();
    assert!(number(&small, "shared_leaves") <= 16.0 && number(&small, "margin_error") == 0.0, "{small:#}");
    let bytes = [&usual, &small, &dear].map(|exported| number(exported, "bytes"));
    assert!(bytes[0] > bytes[1] && bytes[1] > bytes[2], "{bytes:?}");
    fails(at, &["train", "data", "-o", "x.json", "--trees", "different_leaves=0"], 2, "different_leaves is 0");
    fails(at, &["train", "data", "-o", "x.json", "--trees", "threshold_cost=1"], 2, "use it with different_leaves");
    let one = ["train", "data", "-o", "x.json", "--trees", "different_leaves=8,leaves=one"];
    fails(at, &one, 2, "leaves");
}

#[test]
fn tuning_writes_a_model_within_the_limit() {
    let directory = set_up();
    let tune = [
        "tune",
        "data",
        "--max-bytes",
        "2K",
        "--sequences",
        "20",
        "-o",
        "tuned.palpate",
        "--real",
        "noise=1ms",
        "--json",
    ];
    let tuned: Value = serde_json::from_str(&succeeds(directory.path(), &tune)).unwrap();
    let chosen = usize::try_from(tuned["chosen"].as_u64().unwrap()).unwrap();
    let bytes = std::fs::metadata(directory.path().join("tuned.palpate")).unwrap().len();
    assert!(bytes <= 2048);
    // With the bytes of a promise, for which there are too few touches here.
    assert!(tuned["calibration"].is_null(), "{tuned:#}");
    let stated = tuned["rows"][chosen]["bytes"].as_u64().unwrap();
    assert!((bytes..=2048).contains(&stated), "{stated} for {bytes}");
    succeeds(directory.path(), &["evaluate", "tuned.palpate", "data", "--sequences", "20"]);
}

#[test]
fn what_cannot_be_trained_is_refused_and_an_older_ensemble_stays() {
    let directory = set_up();
    let at = directory.path();
    let older = "{\"learner\":{\"attributes\":{\"palpate_objects\":\"older\"}}}";
    std::fs::write(at.join("ensemble.json"), older).unwrap();
    let train = |data, more: &[&'static str]| [&["train", data, "-o", "ensemble.json"], more].concat();
    std::fs::create_dir(at.join("lonely")).unwrap();
    std::fs::copy(at.join("data/bowl.txt"), at.join("lonely/bowl.txt")).unwrap();
    std::fs::create_dir(at.join("broken")).unwrap();
    std::fs::copy(at.join("data/bowl.txt"), at.join("broken/bowl.txt")).unwrap();
    std::fs::write(at.join("broken/fork.txt"), "0.0 0.1 0.2\n0.0 -0.1 inf\n").unwrap();
    std::fs::create_dir(at.join("empty")).unwrap();
    fails(at, &train("lonely", &[]), 1, "lonely");
    fails(at, &train("empty", &[]), 1, "empty");
    fails(at, &train("broken", &[]), 1, "fork.txt:2:");
    fails(at, &train("missing", &[]), 1, "missing");
    fails(at, &train("data", &["--descriptor", "gravity"]), 1, "with their pose");
    fails(at, &train("data", &["--descriptor", "shape"]), 2, "curvature");
    fails(at, &train("data", &["--trees", "rounds=0"]), 2, "rounds is 0");
    fails(at, &train("data", &["--real", "noise=5"]), 2, "unit");
    fails(at, &train("data", &["--trees", "bins=9/9/9"]), 2, "bins is ");
    fails(at, &train("data", &["--no-such-option"]), 2, "--no-such-option");
    fails(at, &["tune", "data", "--max-bytes", "9", "--sequences", "5", "-o", "ensemble.json"], 1, "the smallest has");
    fails(at, &["tune", "data", "--max-bytes", "many"], 2, "16K");
    assert_eq!(std::fs::read_to_string(at.join("ensemble.json")).unwrap(), older);
    assert_eq!(std::fs::read_dir(at).unwrap().count(), 5, "something was left behind");
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let directory = set_up();
    let at = directory.path();
    succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", "rounds=3"]);
    succeeds(at, &["export", "ensemble.json", "-o", "model.palpate"]);
    let text = std::fs::read_to_string(at.join("ensemble.json")).unwrap();
    std::fs::write(at.join("times.json"), text.replace("\"curvature\"", "\"times\"")).unwrap();
    let bytes = std::fs::read(at.join("model.palpate")).unwrap();
    std::fs::write(at.join("cut.palpate"), &bytes[..100]).unwrap();
    std::fs::create_dir(at.join("others")).unwrap();
    touches(&at.join("others"));
    std::fs::rename(at.join("others/fork.txt"), at.join("others/spoon.txt")).unwrap();
    fails(at, &["evaluate", "times.json", "data"], 1, "times.json: it has 2 features, but its descriptor times has 3");
    fails(at, &["evaluate", "cut.palpate", "data"], 1, "cut.palpate: byte 100:");
    fails(at, &["evaluate", "missing.palpate", "data"], 1, "missing.palpate: cannot read");
    fails(at, &["evaluate", "data/bowl.txt", "data"], 1, "bowl.txt");
    fails(at, &["evaluate", "model.palpate", "others"], 1, "does not know the object spoon");
    fails(at, &["evaluate", "model.palpate", "data", "--at", "401"], 2, "bowl has only 400");
    fails(at, &["evaluate", "model.palpate", "data", "--error-rate", "0.7"], 2, "--error-rate");
    fails(at, &["evaluate", "model.palpate", "data", "--sequences", "0"], 2, "--sequences");
}

fn json(directory: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&succeeds(directory, arguments)).unwrap()
}

#[test]
fn the_probe_of_the_capture_stands_in_every_model_made_of_it() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    std::fs::write(at.join("probe.toml"), "radius = 0.15\nspacing = 2\nspeed = 20\n").unwrap();
    let capture = ["capture", "builtin", "-o", "data", "--touches", "60", "--probe", "probe.toml"];
    succeeds(at, &capture);
    succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", "rounds=2"]);
    succeeds(at, &["export", "ensemble.json", "-o", "model.palpate"]);
    succeeds(at, &["tune", "data", "-o", "tuned.palpate", "--sequences", "5", "--ensemble", "tuned.json"]);
    succeeds(at, &["export", "tuned.json", "-o", "again.palpate"]);
    for model in ["model.palpate", "tuned.palpate", "again.palpate"] {
        let probe = &json(at, &["inspect", model, "--json"])["probe"];
        assert_eq!((probe["spacing"].as_f64(), probe["speed"].as_f64()), (Some(2.0), Some(20.0)), "{model}");
    }
}

#[test]
fn objects_that_no_model_can_hold_are_refused_before_training_and_nothing_is_written() {
    let directory = set_up();
    let at = directory.path();
    std::fs::copy(at.join("data/fork.txt"), at.join("data/fo\trk.txt")).unwrap();
    fails(
        at,
        &["train", "data", "-o", "ensemble.json"],
        1,
        "data: the object's name \"fo\\trk\" has a control character",
    );
    std::fs::create_dir(at.join("many")).unwrap();
    for number in 0..300 {
        std::fs::write(at.join(format!("many/{number}.txt")), "0 0 0.01\n0 0 0.02\n").unwrap();
    }
    fails(
        at,
        &["train", "many", "-o", "ensemble.json"],
        1,
        "many: there are 300 objects to train on, more than the 256",
    );
    assert!(!at.join("ensemble.json").exists());
}

#[test]
fn evaluating_on_the_training_touches_says_so() {
    let directory = set_up();
    let at = directory.path();
    succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", "rounds=3", "--real", "noise=1ms"]);
    let evaluate = |data, more: &[&str]| {
        let arguments = [&["evaluate", "ensemble.json", data, "--sequences", "50"], more].concat();
        succeeds(at, &arguments)
    };
    let said = "The model was trained on these touches of bowl, fork";
    assert!(evaluate("data", &[]).contains(said));
    assert!(evaluate("data", &["--real", "noise=5ms"]).contains(said));
    let figures: Value = serde_json::from_str(&evaluate("data", &["--json"])).unwrap();
    assert_eq!(figures["trained_on"], serde_json::json!(["bowl", "fork"]));
    // The same touches from the other end: other touches.
    std::fs::create_dir(at.join("unseen")).unwrap();
    for name in ["bowl.txt", "fork.txt"] {
        let text = std::fs::read_to_string(at.join("data").join(name)).unwrap();
        let lines: Vec<&str> = text.lines().rev().collect();
        std::fs::write(at.join("unseen").join(name), lines.join("\n")).unwrap();
    }
    assert!(!evaluate("unseen", &[]).contains("was trained on"));
}

#[test]
fn a_compiled_model_knows_the_capture_that_it_was_trained_on_and_no_promise_is_made_on_it() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let capture = |out, touches, more: &[&str]| {
        succeeds(at, &[&["capture", "bowl", "fork", "mouse", "-o", out, "--touches", touches], more].concat());
    };
    capture("data", "60", &[]);
    capture("more", "90", &["--pose"]);
    capture("unseen", "90", &["--seed", "2"]);
    succeeds(at, &["capture", "fork", "mouse", "-o", "fewer", "--approaches", "70"]);
    succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", "rounds=2"]);
    succeeds(at, &["export", "ensemble.json", "-o", "model.palpate"]);
    for model in ["ensemble.json", "model.palpate"] {
        let trained_on = |data| {
            let figures = json(at, &["evaluate", model, data, "--sequences", "20", "--json"]);
            figures["trained_on"].to_string()
        };
        assert_eq!(trained_on("data"), r#"["bowl","fork","mouse"]"#, "{model}");
        assert_eq!(trained_on("more"), r#"["bowl","fork","mouse"]"#, "{model}");
        assert_eq!(trained_on("fewer"), r#"["fork","mouse"]"#, "{model}");
        assert_eq!(trained_on("unseen"), "[]", "{model}");
    }
    let said =
        "the model was trained on these touches of bowl, fork, mouse: a promise calibrated on them would not hold";
    fails(at, &["calibrate", "model.palpate", "more", "-o", "sure.palpate"], 1, said);
    assert!(!at.join("sure.palpate").exists());
    // Others are too few here, which is another problem.
    fails(at, &["calibrate", "model.palpate", "unseen", "-o", "sure.palpate"], 1, "too few to promise");
    let inspected = json(at, &["inspect", "model.palpate", "--json"]);
    assert_eq!(inspected["trained_on"]["samples"], serde_json::json!([0, 60]));
    assert!(succeeds(at, &["inspect", "model.palpate"]).contains("samples 0 to 59 of each object"));
}

#[test]
fn no_accuracy_rests_on_the_one_group_that_a_small_test_set_has() {
    let directory = set_up();
    let at = directory.path();
    succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", "rounds=3"]);
    std::fs::create_dir(at.join("few")).unwrap();
    for name in ["bowl.txt", "fork.txt"] {
        let text = std::fs::read_to_string(at.join("data").join(name)).unwrap();
        let lines: Vec<&str> = text.lines().take(30).collect();
        std::fs::write(at.join("few").join(name), lines.join("\n")).unwrap();
    }
    let figures = json(at, &["evaluate", "ensemble.json", "few", "--sequences", "50", "--json"]);
    let mut given: Vec<&String> = figures["accuracy"].as_object().unwrap().keys().collect();
    given.sort();
    assert_eq!(given, ["10", "20", "5"]);
    fails(at, &["evaluate", "ensemble.json", "few", "--at", "30"], 2, "of 30 touches only 1 different groups of 30");
    fails(at, &["evaluate", "ensemble.json", "few", "--at", "31"], 2, "has only 30");
}

#[test]
fn evaluate_shows_undecided_sequences_and_the_confusion_of_objects() {
    let directory = set_up();
    let at = directory.path();
    succeeds(at, &["train", "data", "-o", "ensemble.json", "--trees", "rounds=3"]);
    let evaluate =
        ["evaluate", "ensemble.json", "data", "--sequences", "100", "--max-touches", "1", "--confusion", "5"];
    let table = succeeds(at, &evaluate);
    assert!(table.lines().next().unwrap().ends_with("undecided"), "{table}");
    assert!(table.contains("Taken for, after 5 touches"), "{table}");
    let figures = json(at, &[&evaluate[..], &["--json"]].concat());
    let sequential = &figures["sequential"];
    assert!(sequential["undecided"].as_f64() > Some(0.5), "{sequential}");
    assert!(sequential["undecided_per_object"]["bowl"].is_number());
    for row in figures["confusion"]["counts"].as_array().unwrap() {
        assert_eq!(row.as_array().unwrap().iter().map(|count| count.as_u64().unwrap()).sum::<u64>(), 100);
    }
    fails(at, &["evaluate", "ensemble.json", "data", "--max-touches", "0"], 2, "touches is 0. Use at least 1.");
}

#[test]
fn tune_names_the_file_it_wrote_and_the_features_that_the_chip_needs() {
    let directory = set_up();
    let at = directory.path();
    let tune = ["tune", "data", "--max-instructions", "2000", "--chip", "m0+", "--sequences", "20"];
    let written = succeeds(at, &[&tune[..], &["-o", "tuned.palpate"]].concat());
    assert!(written.contains("Wrote the model: tuned.palpate"), "{written}");
    let inspected = json(at, &["inspect", "tuned.palpate", "--json"]);
    assert!(inspected["instructions"]["m0_plus"].as_u64() <= Some(2000), "{inspected}");
    let [layout, leaf] = ["layout", "leaf"].map(|key| inspected[key].as_str().unwrap());
    assert!(written.contains(&format!("build palpate-onboard with: {layout}, {leaf}-leaves")), "{written}");
    assert!(succeeds(at, &tune).contains("The model was not written"));
}

/// Touches of two objects that overlap, drawn without chance; each call with another `first` gives others.
fn many(directory: &Path, count: u64, first: u64) {
    std::fs::create_dir_all(directory).unwrap();
    for (name, bend) in [("bowl", 100_000), ("fork", 200_000)] {
        let spread = |index: u64, prime: u64, range: u64| (index.wrapping_mul(prime) >> 7) % range;
        let lines = (first..first + count).map(|index| {
            let slope = spread(index, 0x9e37_79b9_7f4a_7c15, 300_007);
            let bend = spread(index, 0xd134_2543_de82_ef95, bend);
            let times = [0, slope / 2 + bend, slope].map(|micros| micros as f64 * 1e-6);
            format!("{:.6} {:.6} {:.6}\n", times[0], times[1], times[2])
        });
        std::fs::write(directory.join(format!("{name}.txt")), lines.collect::<String>()).unwrap();
    }
}

/// A model of `many` touches and three directories of others: `train`, `fresh`, `unseen`.
fn uncalibrated() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    many(&at.join("train"), 2_000, 0);
    many(&at.join("fresh"), 20_000, 1_000_000);
    many(&at.join("unseen"), 4_000, 2_000_000);
    succeeds(at, &["train", "train", "-o", "ensemble.json", "--trees", "rounds=10"]);
    succeeds(at, &["export", "ensemble.json", "-o", "model.palpate"]);
    directory
}

#[test]
fn a_calibrated_model_promises_and_evaluate_shows_whether_it_keeps_it() {
    let directory = uncalibrated();
    let at = directory.path();
    let json = |arguments: &[&str]| -> Value { serde_json::from_str(&succeeds(at, arguments)).unwrap() };
    let before = json(&["evaluate", "model.palpate", "unseen", "--json"]);
    assert_eq!((&before["sequential"]["promised"], &before["sequential"]["error_rate"]), (&Value::Null, &0.01.into()));
    assert!(before.get("promise").is_none());
    let calibrate = ["calibrate", "model.palpate", "fresh", "-o", "calibrated.palpate", "--error-rate", "5%", "--json"];
    let calibrated = json(&calibrate);
    assert_eq!((&calibrated["promised"], &calibrated["per"]), (&0.05.into(), &"average".into()));
    assert!(calibrated["error"].as_f64().unwrap() <= 0.05 && calibrated["sequences"].as_u64().unwrap() > 500);
    let given = ["bowl", "fork"].map(|object| calibrated["objects"][object]["given"].as_u64().unwrap());
    assert!(given.iter().sum::<u64>() > 500, "{calibrated}");
    let inspected = json(&["inspect", "calibrated.palpate", "--json"]);
    let promise = &inspected["promise"];
    assert_eq!((&promise["error_rate"], &promise["confidence"]), (&0.05.into(), &0.95.into()));
    assert_eq!(promise["sequences"], calibrated["sequences"]);
    assert_eq!(promise["margins"]["bowl"], promise["margins"]["fork"]);
    let parts = inspected["bytes_by_part"].as_object().unwrap().values();
    assert_eq!(inspected["bytes"], parts.map(|bytes| bytes.as_u64().unwrap()).sum::<u64>());
    assert!(succeeds(at, &["inspect", "calibrated.palpate"]).contains("at most 5 % of all names given wrong"));

    let evaluated = json(&["evaluate", "calibrated.palpate", "unseen", "--json"]);
    let (sequential, promise) = (&evaluated["sequential"], &evaluated["promise"]);
    assert_eq!((&sequential["promised"], &sequential["per"]), (&0.05.into(), &"average".into()));
    assert_eq!((&promise["promised"], promise["void"].as_array().unwrap().len()), (&0.05.into(), 0));
    assert!(sequential["error"].as_f64().unwrap() <= 0.05 + 3.0 * sequential["error_standard_error"].as_f64().unwrap());
    assert!(succeeds(at, &["evaluate", "calibrated.palpate", "unseen"]).contains("Promised: at most 5 % wrong"));
    // Another error rate is that of the posterior, which nothing promises.
    let replaced = json(&["evaluate", "calibrated.palpate", "unseen", "--json", "--error-rate", "0.05"]);
    assert_eq!(replaced["sequential"]["promised"], Value::Null);
    assert!(replaced.get("promise").is_none());
    // Other noise makes the promise void; how far it is broken is said.
    let noisy = json(&["evaluate", "calibrated.palpate", "unseen", "--json", "--real", "noise=50ms"]);
    assert!(noisy["promise"]["void"][0].as_str().unwrap().contains("noise of 50 ms"));
    assert!(noisy["promise"]["exceeded_by"].as_f64().unwrap() > 0.0);
    let text = succeeds(at, &["evaluate", "calibrated.palpate", "unseen", "--real", "noise=50ms"]);
    assert!(text.contains("the promise is broken by ") && text.contains("void: promised with no noise"), "{text}");
}

#[test]
fn a_promise_for_a_robot_is_tested_on_its_recordings_and_too_few_say_what_they_support() {
    let directory = uncalibrated();
    let at = directory.path();
    let record = |lines: usize, to: &str| {
        for object in ["bowl", "fork"] {
            let all = std::fs::read_to_string(at.join(format!("unseen/{object}.txt"))).unwrap();
            let some: Vec<&str> = all.lines().filter(|line| !line.starts_with('#')).take(lines).collect();
            std::fs::write(at.join("some.txt"), some.join("\n") + "\n").unwrap();
            succeeds(at, &["data", "record", "some.txt", "-o", to, "--object", object]);
        }
    };
    record(3_000, "robot");
    record(60, "few");
    let with = |recorded: &'static str, rate: &'static str| {
        ["calibrate", "model.palpate", "fresh", "--recorded", recorded, "-o", "robot.palpate", "--error-rate", rate]
    };
    let made: Value = serde_json::from_str(&succeeds(at, &[&with("robot", "5%")[..], &["--json"]].concat())).unwrap();
    assert_eq!((&made["promised"], &made["recorded"]["recordings"]), (&0.05.into(), &2.into()), "{made}");
    assert_eq!(made["recorded"]["approaches"], 3_000, "{made}");
    let text = succeeds(at, &with("robot", "5%"));
    assert!(text.contains("Tested on recorded touches") && text.contains("are not independent"), "{text}");
    assert!(succeeds(at, &["evaluate", "robot.palpate", "unseen"]).contains("Promised: at most 5 % wrong"));

    std::fs::remove_file(at.join("robot.palpate")).unwrap();
    fails(at, &with("few", "1%"), 1, "60 recorded approaches to each object support about");
    fails(at, &with("few", "1%"), 1, "are too few to promise 1 %: at least 299 are needed");
    fails(at, &with("train", "5%"), 1, "the model was trained on these touches");
    assert!(!at.join("robot.palpate").exists());
}

#[test]
fn a_promise_made_with_noise_is_tested_on_recorded_touches_and_not_void_for_their_own() {
    let directory = uncalibrated();
    let at = directory.path();
    let calibrate = ["calibrate", "model.palpate", "fresh", "-o", "noisy.palpate", "--error-rate", "5%"];
    succeeds(at, &[&calibrate[..], &["--real", "noise=1ms"]].concat());
    for object in ["bowl", "fork"] {
        let lines = format!("unseen/{object}.txt");
        succeeds(at, &["data", "record", &lines, "-o", "recorded", "--object", object]);
    }
    let evaluate = ["evaluate", "noisy.palpate", "recorded"];
    let found: Value = serde_json::from_str(&succeeds(at, &[&evaluate[..], &["--json"]].concat())).unwrap();
    let promise = &found["promise"];
    assert_eq!(
        (&promise["void"], &promise["recorded"]),
        (&serde_json::json!([]), &"noise of 1 ms".into()),
        "{promise}"
    );
    let text = succeeds(at, &evaluate);
    let said = "It was made for simulated touches with noise of 1 ms; recorded ones hold the noise of their probe.";
    assert!(text.contains(said) && !text.contains("void"), "{text}");
    // More noise than they hold is another matter.
    let text = succeeds(at, &[&evaluate[..], &["--real", "noise=9ms"]].concat());
    assert!(text.contains("void: promised with noise of 1 ms, tested on recorded touches with more noise"), "{text}");
}

#[test]
fn thresholds_by_name_are_stated_for_each_and_evaluated_for_each() {
    let directory = uncalibrated();
    let at = directory.path();
    let json = |arguments: &[&str]| -> Value { serde_json::from_str(&succeeds(at, arguments)).unwrap() };
    let per = ["calibrate", "model.palpate", "fresh", "-o", "names.palpate", "--error-rate", "0.1", "--per", "name"];
    assert!(succeeds(at, &per).contains("each name, when it is given"));
    let inspected = json(&["inspect", "names.palpate", "--json"]);
    assert_eq!(inspected["promise"]["per"], "name");
    let evaluated = json(&["evaluate", "names.palpate", "unseen", "--json"]);
    assert_eq!(evaluated["sequential"]["per"], "name");
    let errors = evaluated["sequential"]["error_per_name"].as_object().unwrap();
    assert_eq!(errors.keys().collect::<Vec<_>>(), ["bowl", "fork"]);
    let largest = errors.values().map(|error| error.as_f64().unwrap()).fold(0.0, f64::max);
    assert!((evaluated["promise"]["error"].as_f64().unwrap() - largest).abs() < 1e-12);
}

#[test]
fn priors_and_subsets_are_expected_at_run_time_and_void_the_promise() {
    let directory = uncalibrated();
    let at = directory.path();
    let json = |arguments: &[&str]| -> Value { serde_json::from_str(&succeeds(at, arguments)).unwrap() };
    succeeds(at, &["calibrate", "model.palpate", "fresh", "-o", "calibrated.palpate", "--error-rate", "0.05"]);
    let only = json(&["evaluate", "calibrated.palpate", "unseen", "--json", "--only", "fork", "--at", "1"]);
    assert_eq!((&only["accuracy"]["1"], &only["sequential"]["mean_touches"]), (&1.0.into(), &1.0.into()));
    assert_eq!(only["sequential"]["promised"], Value::Null);
    let void = only["promise"]["void"].as_array().unwrap();
    assert!(void.iter().any(|why| why.as_str().unwrap().contains("priors")), "{void:?}");
    assert_eq!(only["per_object"].as_object().unwrap().keys().collect::<Vec<_>>(), ["fork"]);
    let sooner = |prior: &str| {
        let told = json(&["evaluate", "calibrated.palpate", "unseen", "--json", "--prior", prior]);
        told["sequential"]["per_object"]["fork"].as_f64().unwrap()
    };
    assert!(sooner("fork=0.95") < sooner("fork=0.5"));
    let recognized = succeeds(at, &["recognize", "calibrated.palpate", "unseen/bowl.txt", "--only", "fork"]);
    assert!(recognized.lines().all(|line| line.contains("recognized  fork 1.0000")));
    fails(at, &["recognize", "calibrated.palpate", "unseen/bowl.txt", "--only", "knife"], 2, "--only is knife");
    succeeds(at, &["export", "ensemble.json", "-o", "kitchen.palpate", "--prior", "fork=0.9"]);
    let inspected = json(&["inspect", "kitchen.palpate", "--json"]);
    assert!((inspected["priors"]["bowl"].as_f64().unwrap() + 9.0_f64.ln()).abs() < 0.01);
    fails(at, &["export", "ensemble.json", "-o", "kitchen.palpate", "--prior", "fork=1.5"], 2, "--prior is 1.5");
}

#[test]
fn what_cannot_be_promised_is_said_and_nothing_is_written() {
    let directory = uncalibrated();
    let at = directory.path();
    let calibrate = |more: &[&str]| -> Vec<String> {
        let fixed = ["calibrate", "model.palpate", "unseen", "-o", "none.palpate"];
        fixed.iter().chain(more).map(|word| (*word).to_owned()).collect()
    };
    for (more, code, expected) in [
        (&["--error-rate", "0.001"][..], 1, "too few to promise 0.1 %: at least 2995 are needed"),
        (&["--error-rate", "0.6"], 2, "'0.6' for '--error-rate"),
        (&["--confidence", "1"], 2, "--confidence is 1"),
        (&["--sequences", "0"], 2, "--sequences is 0"),
        (&["--per", "touch"], 2, "use one of average, name, object"),
    ] {
        let words = calibrate(more);
        fails(at, &words.iter().map(String::as_str).collect::<Vec<_>>(), code, expected);
        assert!(!at.join("none.palpate").exists());
    }
    fails(at, &["calibrate", "ensemble.json", "fresh", "-o", "none.palpate"], 1, "ensemble.json");
    // Its own input may be replaced by the calibrated model.
    succeeds(at, &["calibrate", "model.palpate", "fresh", "-o", "model.palpate", "--error-rate", "0.1"]);
}

#[test]
fn a_promise_whatever_the_placements_shares_is_one_of_each_placement_and_says_what_it_takes() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let captured = |name: &str, approaches: &str, seed: &str| {
        let scene = ["--scene", "table", "--approaches", approaches, "--pose", "--seed", seed];
        succeeds(at, &[&["capture", "bowl", "fork", "-o", name][..], &scene].concat());
    };
    captured("touches", "9000", "1");
    captured("fresh", "40000", "2");
    for (outputs, model) in [("placements", "model"), ("objects", "plain")] {
        let (ensemble, compiled) = (format!("{model}.json"), format!("{model}.palpate"));
        let train = ["train", "touches", "-o", &ensemble, "--descriptor", "gravity", "--outputs", outputs];
        succeeds(at, &[&train[..], &["--trees", "rounds=10"]].concat());
        let said = succeeds(at, &["export", &ensemble, "-o", &compiled, "--verbose"]);
        assert_eq!(said.contains("-leaves, outputs\n"), outputs == "placements", "{said}");
    }
    let calibrate = ["calibrate", "model.palpate", "fresh", "-o", "sure.palpate", "--error-rate", "5%"];
    let any = ["--placement-prior", "any"];
    let said = succeeds(at, &[&calibrate[..], &any].concat());
    assert!(said.contains("The rate holds in each of 6 placements"), "{said}");
    assert!(said.contains("5 % takes 59 names of each") && said.contains("2.5 % takes 119"), "{said}");
    let evaluated = succeeds(at, &["inspect", "sure.palpate"]);
    assert!(evaluated.contains("5 % of the names given to each object wrong"), "{evaluated}");
    let name = [&calibrate[..], &any, &["--per", "name"]].concat();
    fails(at, &name, 2, "--placement-prior is any. Use stated with --per name");
    let plain = ["calibrate", "plain.palpate", "fresh", "-o", "no.palpate", "--placement-prior", "any"];
    fails(at, &plain, 2, "a model that has an output for each placement");
    assert!(!at.join("no.palpate").exists());
}
