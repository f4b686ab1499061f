//! Models of other libraries, as a user calls the commands: export, verify, recognize.

use crate::{json, run, stderr, stdout};
use serde_json::Value;
use std::path::{Path, PathBuf};
use table::cells;
use tempfile::TempDir;

#[path = "../../../../tests/data/import/table.rs"]
mod table;

/// Real files of other libraries, and the tables of their rows; see `make.py` there.
fn data(name: &str) -> String {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/import");
    directory.join(name).to_str().unwrap().to_owned()
}

/// A directory, and a file's path in it.
fn place() -> (TempDir, impl Fn(&str) -> String) {
    let directory = tempfile::tempdir().unwrap();
    let root: PathBuf = directory.path().into();
    (directory, move |name: &str| root.join(name).to_str().unwrap().to_owned())
}

/// The library's cells of one kind for each row of a model: `margin` or `prediction`.
fn of_library(name: &str, kind: &str) -> Vec<String> {
    let table = std::fs::read_to_string(data(&format!("{name}.csv"))).unwrap();
    cells(&table, kind).into_iter().map(|row| row.join(",")).collect()
}

/// Path of a file with these rows.
fn written(name: &str, kind: &str, path: String) -> String {
    std::fs::write(&path, of_library(name, kind).join("\n") + "\n").unwrap();
    path
}

#[test]
fn a_model_exports_and_verifies_against_its_librarys_own_margins() {
    let (_directory, path) = place();
    let name = "lightgbm-4.7-zero-as-missing";
    let (source, rows, output) = (data(&format!("{name}.txt")), data(&format!("{name}.csv")), path("model.palpate"));
    let margins = written(name, "margin", path("margins.csv"));
    for leaf in ["f32", "i16"] {
        let exported = json(run(["export", &source, "-o", &output, "--leaf", leaf, "--json"]));
        assert_eq!(exported["features"], serde_json::json!(["width", "height", "count", "angle"]));
        let verified = json(run(["verify", &output, &source, &rows, "--library-margins", &margins, "--json"]));
        let mut keys: Vec<&str> = verified.as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        let expected = [
            "class_differs",
            "generated_rows",
            "library_class_differs",
            "library_class_unexplained",
            "library_max_margin_error",
            "max_margin_error",
            "rows",
            "stated_bound",
        ];
        assert_eq!(keys, expected);
        assert_eq!(verified["rows"], 60);
        assert!(verified["generated_rows"].as_u64() > Some(50), "{verified}");
        let number = |key: &str| verified[key].as_f64().unwrap();
        assert!(number("library_max_margin_error") <= number("stated_bound"), "{leaf}: {verified}");
        assert_eq!(verified["library_class_differs"], 0, "{leaf}: {verified}");
        if leaf == "f32" {
            assert_eq!((number("max_margin_error"), &verified["class_differs"]), (0.0, &Value::from(0)));
        }
    }
}

#[test]
fn a_model_of_another_file_is_told_with_the_first_tree_that_differs() {
    let (_directory, path) = place();
    let model = data("xgboost-3.4-binary.json");
    let rows = data("xgboost-3.4-binary.csv");
    stdout(run(["export", &model, "-o", &path("model.palpate"), "--layout", "compact"]));
    // Another leaf in tree 1, as a library of another version may have.
    let mut document: Value = serde_json::from_str(&std::fs::read_to_string(&model).unwrap()).unwrap();
    let tree = document.pointer_mut("/learner/gradient_booster/model/trees/1").unwrap();
    let leaf = tree["left_children"].as_array().unwrap().iter().position(|child| *child == -1).unwrap();
    tree["split_conditions"][leaf] = 0.75.into();
    std::fs::write(path("changed.json"), document.to_string()).unwrap();
    for layout in ["compact", "complete", "wide"] {
        stdout(run(["export", &model, "-o", &path("model.palpate"), "--layout", layout]));
        let refused = run(["verify", &path("model.palpate"), &path("changed.json"), &rows, "--json"]);
        let verified: Value = serde_json::from_slice(&refused.stdout).unwrap();
        assert!(verified["max_margin_error"].as_f64() > verified["stated_bound"].as_f64());
        assert_eq!(verified["library_max_margin_error"], Value::Null);
        let message = stderr(refused, 1);
        assert!(message.contains("where tree 1 is the first that adds another leaf"), "{message}");
    }
    let other = data("xgboost-3.4-softprob.ubj");
    let message = stderr(run(["verify", &path("model.palpate"), &other, &rows]), 1);
    assert!(message.contains("4 features, 2 outputs and 3 trees, the ensemble 4 features, 3 outputs"), "{message}");
    // Margins of other rows.
    std::fs::write(path("margins.csv"), "0.5\n").unwrap();
    let with = ["verify", &path("model.palpate"), &model, &rows, "--library-margins", &path("margins.csv")];
    let message = stderr(run(with), 1);
    assert!(message.contains("margins.csv: it has margins of 1 rows, but there are 60 rows"), "{message}");
}

#[test]
fn each_row_gets_a_verdict_of_its_own_or_adds_to_the_last() {
    let (_directory, path) = place();
    let name = "xgboost-2.1-softprob";
    let model = path("model.palpate");
    stdout(run(["export", &data(&format!("{name}.ubj")), "-o", &model, "--names", "cup,jug,pan"]));
    let rows = data(&format!("{name}.csv"));
    let text = stdout(run(["recognize", &model, &rows, "--features", "--json"]));
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let margins = of_library(name, "margin");
    assert_eq!(lines.len(), margins.len());
    for (line, margins) in lines.iter().zip(&margins) {
        let margins: Vec<f64> = margins.split(',').map(|margin| margin.parse().unwrap()).collect();
        let best = (0..3).fold(0, |best, object| if margins[object] > margins[best] { object } else { best });
        assert_eq!(line["class"], ["cup", "jug", "pan"][best], "{line}");
        assert_eq!(line.get("verdict"), None, "a row alone has a class");
        let sum: f64 = margins.iter().map(|margin| (margin - margins[best]).exp()).sum();
        assert!((line["posterior"].as_f64().unwrap() - 1.0 / sum).abs() < 1e-3, "{line}");
    }
    let text = stdout(run(["recognize", &model, &rows, "--features", "--add-up", "--json"]));
    assert_eq!(text.lines().count(), lines.len());
    let most = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()["rows"].as_u64().unwrap()).max();
    assert!(most > Some(1));
}

#[test]
fn columns_are_found_by_their_names_in_every_command_and_by_position_only_where_there_are_none() {
    let (_directory, path) = place();
    let (model, source) = (path("model.palpate"), data("xgboost-2.1-softprob.ubj"));
    stdout(run(["export", &source, "-o", &model, "--names", "cup,jug,pan"]));
    let file = path("rows.csv");
    let asked = |text: &str| {
        std::fs::write(&file, text).unwrap();
        run(["recognize", &model, &file, "--features", "--json"])
    };
    let margins = |text: &str| {
        let said = asked(text);
        let note = String::from_utf8_lossy(&said.stderr).into_owned();
        (json(said)["margins"].clone(), note)
    };
    let (by_name, note) = margins("width,height,count,angle\n1,990,2,0.5\n");
    assert_eq!(note, "");
    // In another order, with more columns.
    assert_eq!(margins("angle,count,who,height,width\n0.5,2,ann,990,1\n"), (by_name.clone(), String::new()));
    let (by_position, note) = margins("0,1,2,3\n1,990,2,0.5\n");
    assert_eq!(by_position, by_name);
    assert_eq!(note.matches("columns are taken by their position").count(), 1, "{note}");
    // One name of four is another one: no column takes its place, in any command.
    let labeled = "width,Height,count,angle,kind,id\n1,990,2,0.5,cup,1\n";
    std::fs::write(path("labeled.csv"), labeled).unwrap();
    let (rows, output) = (path("labeled.csv"), path("no.palpate"));
    let sequences = ["--label", "kind", "--sequence-column", "id"];
    for words in [
        vec!["recognize", &model, &rows, "--features"],
        vec!["verify", &model, &source, &rows],
        vec!["verify", &model, &source, &rows, "--prove", &output],
        vec!["evaluate", &model, &rows, "--label", "kind"],
        [&["evaluate", &model, &rows][..], &sequences].concat(),
        [&["calibrate", &model, &rows, "-o", &output][..], &sequences].concat(),
        vec!["export", &source, "-o", &output, "--scale", &rows],
        vec!["export", &source, "-o", &output, "--early-exit", &rows],
    ] {
        let message = stderr(run(&words), 1);
        let expected =
            "labeled.csv:1: no column is named height; its columns are width, Height, count, angle, kind, id";
        assert!(message.contains(expected), "{words:?}: {message}");
    }
    for (text, expected) in [
        ("1,990,2,0.5\n2,980,1,0.25\n", "rows.csv:1: its columns are named 1, 990, 2, 0.5: numbers alone"),
        ("0,1,2\n1,990,2\n", "rows.csv:1: it has 3 columns for 4 features"),
        ("width,height,count,angle,width\n1,990,2,0.5,1\n", "two columns are named \"width\""),
        ("width;height;count;angle\n1;990;2;0,5\n", "rows.csv:1: its cells are separated by \";\""),
        ("width,height,count,angle\n1,990,2\n", "rows.csv:2: it has 3 cells, where the header has 4"),
        ("width,height,count,angle\n1,990,2,0\n\n1,990,2,0\n", "rows.csv:3: the line is empty"),
    ] {
        let message = stderr(asked(text), 1);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn what_the_library_predicts_is_compared_too() {
    let (_directory, path) = place();
    let model = path("model.palpate");
    for (name, file) in [("lightgbm-4.7-forest-gamma", "txt"), ("sklearn-1.9-forest", "onnx")] {
        let source = data(&format!("{name}.{file}"));
        let of = |kind: &str| written(name, kind, path(&format!("{kind}.csv")));
        let (rows, margins, values) = (data(&format!("{name}.csv")), of("margin"), of("prediction"));
        let exported = stdout(run(["export", &source, "-o", &model, "--verbose"]));
        let with = ["--library-margins", &margins, "--library-values", &values];
        let text = stdout(run([&["verify", &model, &source, &rows][..], &with].concat()));
        if file == "txt" {
            assert!(
                exported.contains("Predicts the value e^x of the mean x of the trees, the margin / 5"),
                "{exported}"
            );
            assert!(text.contains("The library predicts values that differ by at most"), "{text}");
            assert!(stdout(run(["inspect", &model])).contains("the mean x of the trees, the margin / 5"));
        } else {
            assert!(text.contains("The library predicts another class for 0 rows"), "{text}");
        }
        // The proof beside it, in one run.
        let proof = path("proof.txt");
        let proved = stdout(run([&["verify", &model, &source, &rows, "--prove", &proof][..], &with].concat()));
        assert!(proved.starts_with("60 rows and ") && proved.contains("Proved: on every possible row"), "{proved}");
        assert_eq!(proved.contains("changes a row's class"), file == "onnx", "{proved}");
        let all = json(run([&["verify", &model, &source, &rows, "--prove", &proof, "--json"][..], &with].concat()));
        assert_eq!((&all["verified"]["rows"], all["proof"]["boxes"].as_u64() > Some(0)), (&60.into(), true), "{all}");
        let text = std::fs::read_to_string(&values).unwrap();
        std::fs::write(path("others.csv"), text.replace(text.lines().nth(4).unwrap(), "17")).unwrap();
        let message = stderr(run(["verify", &model, &source, &rows, "--library-values", &path("others.csv")]), 1);
        let expected = if file == "txt" {
            "the library predicts other values"
        } else {
            "others.csv: the prediction \"17\" of row"
        };
        assert!(message.contains(expected), "{message}");
    }
    let message = stderr(run(["verify", &model, &data("sklearn-1.9-forest.onnx"), "--library-values", &model]), 2);
    assert!(message.contains("DATA"), "{message}");
}

#[test]
fn a_model_with_names_or_another_link_of_its_own_is_proved() {
    let (_directory, path) = place();
    let (model, proof, source) = (path("model.palpate"), path("proof.txt"), data("xgboost-3.4-softprob.ubj"));
    stdout(run(["export", &source, "-o", &model, "--names", "cup,jug,pan"]));
    let text = stdout(run(["verify", &model, &source, "--prove", &proof]));
    assert!(text.starts_with("Proved: on every possible row") && text.contains("\n  jug: "), "{text}");
    stdout(run(["verify", &model, &source, "--certificate", &proof]));
    let rows = data("xgboost-3.4-softprob.csv");
    let text = stdout(run(["verify", &model, &source, &rows, "--prove", &proof]));
    assert!(text.contains(" makes it cup\n"), "{text}");
    // The same names in another order are other classes.
    stdout(run(["export", &source, "-o", &model, "--names", "2,1,0"]));
    let message = stderr(run(["verify", &model, &source, "--prove", &proof]), 1);
    assert!(message.contains("the model's outputs are not the ensemble's: 2, 1, 0, and not 0, 1, 2"), "{message}");
    let source = data("lightgbm-4.7-poisson.txt");
    stdout(run(["export", &source, "-o", &model, "--link", "identity"]));
    let text = stdout(run(["verify", &model, &source, "--prove", &proof]));
    assert!(text.contains("its link is identity, the file's exponential"), "{text}");
}

#[test]
fn a_split_on_missing_values_has_whole_units_as_others_do() {
    let (_directory, path) = place();
    let (source, rows) = (data("catboost-1.2-max-missing.json"), data("catboost-1.2-max-missing.csv"));
    for scale in ["width=1000,height=100,count=10,angle=1000", &rows] {
        let text = stdout(run(["export", &source, "-o", &path("m"), "--scale", scale]));
        assert!(!text.contains("e38"), "{text}");
        stdout(run(["verify", &path("m"), &source, &rows, "--prove", &path("proof.txt")]));
    }
}

#[test]
fn a_chip_is_sent_no_model_over_rows_since_the_line_carries_touches() {
    let (_place, path) = place();
    let model = path("model.palpate");
    stdout(run(["export", &data("xgboost-3.4-binary.json"), "-o", &model]));
    let message = stderr(run(["link", "emulator", "--load", &model, &data("xgboost-3.4-binary.csv")]), 1);
    assert!(message.contains("model.palpate: the model is over rows of features"), "{message}");
    assert!(message.contains("palpate recognize MODEL ROWS.csv --features"), "{message}");
}

#[test]
fn labeled_rows_are_evaluated_one_by_one() {
    let (_directory, path) = place();
    let name = "xgboost-2.1-softprob";
    let model = path("model.palpate");
    stdout(run(["export", &data(&format!("{name}.ubj")), "-o", &model, "--names", "cup,jug,pan"]));
    // Labels by name and by number; the first row's are wrong.
    let rows = std::fs::read_to_string(data(&format!("{name}.csv"))).unwrap();
    let mut labeled = format!("{},kind\n", rows.lines().next().unwrap());
    for (number, (row, margins)) in rows.lines().skip(1).zip(of_library(name, "margin")).enumerate() {
        let margins: Vec<f64> = margins.split(',').map(|margin| margin.parse().unwrap()).collect();
        let best = (0..3).fold(0, |best, object| if margins[object] > margins[best] { object } else { best });
        let label = (best + usize::from(number == 0)) % 3;
        labeled +=
            &format!("{row},{}\n", if number % 2 == 0 { ["cup", "jug", "pan"][label] } else { ["0", "1", "2"][label] });
    }
    std::fs::write(path("labeled.csv"), labeled).unwrap();
    for file in [model.clone(), data(&format!("{name}.ubj"))] {
        let evaluated = run(["evaluate", &file, &path("labeled.csv"), "--label", "kind", "--json"]);
        if file == model {
            let evaluated = json(evaluated);
            assert_eq!(evaluated["rows"], 60);
            assert!((evaluated["accuracy"].as_f64().unwrap() - 59.0 / 60.0).abs() < 1e-12, "{evaluated}");
        } else {
            // The file's own classes have no such names.
            let message = stderr(evaluated, 1);
            assert!(
                message.contains("labeled.csv: the label") && message.contains("none of the model's classes"),
                "{message}"
            );
        }
    }
    let message = stderr(run(["evaluate", &model, &path("labeled.csv"), "--label", "color"]), 1);
    assert!(message.contains("no column \"color\""), "{message}");
    // A regression's labels are numbers.
    let name = "catboost-1.2-regression";
    stdout(run(["export", &data(&format!("{name}.json")), "-o", &model, "--leaf", "f32"]));
    std::fs::write(path("labeled.csv"), "width,height,count,angle,amount\n1,990,2,0.5,2\n").unwrap();
    let evaluated = json(run(["evaluate", &model, &path("labeled.csv"), "--label", "amount", "--json"]));
    assert_eq!(evaluated["mean_absolute_error"], evaluated["root_mean_square_error"]);
}

#[test]
fn a_regression_gives_its_value_and_no_verdict() {
    let (_directory, path) = place();
    let name = "catboost-1.2-regression";
    stdout(run(["export", &data(&format!("{name}.json")), "-o", &path("model.palpate"), "--leaf", "f32"]));
    let rows = data(&format!("{name}.csv"));
    let text = stdout(run(["recognize", &path("model.palpate"), &rows, "--features", "--json"]));
    for (line, margin) in text.lines().zip(of_library(name, "margin")) {
        let line: Value = serde_json::from_str(line).unwrap();
        assert!((line["margins"][0].as_f64().unwrap() - margin.parse::<f64>().unwrap()).abs() < 1e-5);
        assert_eq!(line["value"].as_f64().unwrap() as f32, line["margins"][0].as_f64().unwrap() as f32);
        assert_eq!(line.get("verdict"), None);
    }
}

#[test]
fn recognize_on_a_model_of_rows_does_not_answer_touches() {
    let (_directory, path) = place();
    stdout(run(["export", &data("xgboost-2.1-softprob.ubj"), "-o", &path("model.palpate")]));
    std::fs::write(path("touches.txt"), "0 0 0.08\n").unwrap();
    let message = stderr(run(["recognize", &path("model.palpate"), &path("touches.txt")]), 1);
    assert!(message.contains("works on rows of features, not on touches"), "{message}");
    // And the other way round.
    let touches = crate::compiled::Place::new();
    std::fs::write(path("rows.csv"), "curvature,slope\n1,2\n").unwrap();
    let message = stderr(run(["recognize", &touches.text("model.palpate"), &path("rows.csv"), "--features"]), 1);
    assert!(message.contains("is over touches, not over rows"), "{message}");
}

#[test]
fn a_model_of_fractions_with_a_touch_descriptor_is_refused_instead_of_rounded() {
    let (_directory, path) = place();
    let text = std::fs::read_to_string(data("xgboost-3.4-softmax.json")).unwrap();
    let mut document: Value = serde_json::from_str(&text).unwrap();
    // Four features, as gravity has.
    document["learner"]["attributes"] =
        serde_json::json!({"palpate_descriptor": "gravity", "palpate_objects": "[\"a\",\"b\",\"c\"]"});
    std::fs::write(path("labeled.json"), document.to_string()).unwrap();
    let message = stderr(run(["export", &path("labeled.json"), "-o", &path("model.palpate")]), 1);
    assert!(message.contains("not trained on whole numbers") && message.contains("remove its attribute"), "{message}");
    assert!(!Path::new(&path("model.palpate")).exists());
}

#[test]
fn what_cannot_be_taken_over_is_refused_by_name_with_the_way_round() {
    let (_directory, path) = place();
    for (bytes, what, way) in [
        (&b"\x80\x04\x95pickle"[..], "a Python pickle", "skl2onnx"),
        (b"CBM1....", "CatBoost's binary format", "format=\"json\""),
        (b"PLPT....", "the model is truncated: 8 bytes", "foreign"),
        (b"binf....", "XGBoost's old binary format", "model.json"),
        (b"\x1f\x8b....", "compressed", "Unpack"),
        (b"<?xml version=\"1.0\"?>", "not an ensemble in a readable format", "ONNX"),
        (b"{\"name\": \"tree\", \"tree_info\": []}", "LightGBM's dump_model", "model.txt"),
        (b"{\"learner\": {\"gradient_booster\": {\"name\": \"gblinear\"}}}", "gblinear, which has no trees", "gbtree"),
    ] {
        std::fs::write(path("foreign"), bytes).unwrap();
        let message = stderr(run(["export", &path("foreign"), "-o", &path("model.palpate")]), 1);
        assert!(message.contains(what) && message.contains(way), "{message}");
    }
    for (model, what, way) in [
        ("catboost-1.2-statistics.json", "statistics of the target by category (count)", "one_hot_max_size"),
        ("catboost-1.2-one-hot-words.json", "a category of feature 2", "Number the categories"),
        ("lightgbm-4.7-linear.txt", "tree 0 has linear functions", "linear_tree=false"),
    ] {
        let message = stderr(run(["export", &data(model), "-o", &path("model.palpate")]), 1);
        assert!(message.contains(what) && message.contains(way), "{message}");
    }
    let message = stderr(run(["export", &data("lightgbm-4.7-binary.txt"), "-o", &path("m"), "--names", "a,b,c"]), 1);
    assert!(message.contains("3 names were given for 2 outputs"), "{message}");
}

#[test]
fn the_layout_is_chosen_for_what_is_asked_and_all_candidates_are_named() {
    let (_directory, path) = place();
    let export = |goal: &str| {
        json(run(["export", &data("xgboost-1.6-softprob.ubj"), "-o", &path("m"), "--layout", goal, "--json"]))
    };
    let (size, speed, balanced) = (export("size"), export("speed"), export("balanced"));
    let candidates = size["candidates"].as_array().unwrap();
    assert!(candidates.len() >= 2, "{size}");
    assert_eq!((&speed["candidates"], &balanced["candidates"]), (&size["candidates"], &size["candidates"]));
    let least = |key: fn(&Value) -> Option<u64>| candidates.iter().min_by_key(|candidate| key(candidate)).unwrap();
    assert_eq!(size["layout"], least(|candidate| candidate["bytes"].as_u64())["layout"]);
    assert_eq!(speed["layout"], least(|candidate| candidate["instructions"]["m4f"].as_u64())["layout"]);
    assert_eq!(size["bytes"], least(|candidate| candidate["bytes"].as_u64())["bytes"]);
    let smallest = least(|candidate| candidate["bytes"].as_u64())["bytes"].as_u64().unwrap();
    let small = candidates.iter().filter(|candidate| candidate["bytes"].as_u64().unwrap() <= 3 * smallest);
    let fastest = small.min_by_key(|candidate| candidate["instructions"]["m4f"].as_u64()).unwrap();
    assert_eq!(balanced["layout"], fastest["layout"]);
    let text = stdout(run(["export", &data("xgboost-1.6-softprob.ubj"), "-o", &path("m"), "--verbose"]));
    assert!(text.contains("compact") && text.contains("complete") && text.contains(" *"), "{text}");
}

#[test]
fn whole_numbers_in_the_users_units_split_as_the_values_do_and_say_what_they_change() {
    let (_directory, path) = place();
    let name = "xgboost-3.4-softprob";
    let (model, rows) = (data(&format!("{name}.ubj")), data(&format!("{name}.csv")));
    let scales = "width=10000,height=1000,count=1,angle=10000";
    let exported = json(run(["export", &model, "-o", &path("m"), "--scale", scales, "--json"]));
    let effects = exported["scales"].as_array().unwrap();
    let height = effects.iter().find(|effect| effect["feature"] == "height").unwrap();
    assert_eq!((height["scale"].as_f64(), &height["different"]), (Some(1000.0), &height["thresholds"]));
    assert!(height["largest_step"].as_f64() <= Some(0.000_5), "{height}");
    let verified = json(run(["verify", &path("m"), &model, &rows, "--json"]));
    assert_eq!(verified["class_differs"], 0, "{verified}");
    assert!(verified["max_margin_error"].as_f64() <= verified["stated_bound"].as_f64(), "{verified}");
    let inspected = json(run(["inspect", &path("m"), "--json"]));
    assert_eq!(inspected["feature_names"][1], serde_json::json!({"name": "height", "scale": 1000.0}));
    let parts = inspected["bytes_by_part"].as_object().unwrap().values();
    assert_eq!(inspected["bytes"], parts.map(|bytes| bytes.as_u64().unwrap()).sum::<u64>());
    let fitted = json(run(["export", &model, "-o", &path("m"), "--scale", &rows, "--json"]));
    assert!(fitted["scales"].as_array().unwrap().iter().any(|effect| effect["scale"].as_f64() > Some(1.0)), "{fitted}");
    json(run(["verify", &path("m"), &model, &rows, "--json"]));
    // A feature with fractions, unmentioned, and one that does not exist; units beyond 32 bits.
    for (scale, expected) in [
        ("width=100", "a scale for height too"),
        ("depth=100", "--scale is depth=100. Use a feature: width, height, count, angle"),
        ("width=1,height=1e9,count=1,angle=1", "--scale is 1000000000 for height"),
    ] {
        let message = stderr(run(["export", &model, "-o", &path("m"), "--scale", scale]), 2);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn equal_leaves_of_a_forest_stand_once_and_that_is_said_everywhere() {
    let (_directory, path) = place();
    let (forest, rows) = (data("sklearn-1.9-forest.onnx"), data("sklearn-1.9-forest.csv"));
    let export = |shared: &str| {
        let leaf = ["--leaf", "i8", "--layout", "compact", "--shared-leaves", shared, "--json"];
        json(run([&["export", &forest, "-o", &path(shared)], &leaf[..]].concat()))
    };
    let (shared, plain) = (export("yes"), export("no"));
    let different = shared["shared_leaves"].as_u64().unwrap();
    assert!(different >= 2 && different <= shared["leaves"].as_u64().unwrap(), "{shared}");
    assert_eq!((&plain["shared_leaves"], &plain["margin_error"]), (&Value::Null, &shared["margin_error"]));
    // A fault that is not in a tree is found in both.
    for model in ["yes", "no"] {
        let verified = json(run(["verify", &path(model), &forest, &rows, "--json"]));
        assert_eq!(verified["class_differs"], 0, "{verified}");
    }
    let inspected = json(run(["inspect", &path("yes"), "--json"]));
    assert_eq!(inspected["shared_leaves"], different);
    let parts = inspected["bytes_by_part"].as_object().unwrap().values();
    assert_eq!(inspected["bytes"], parts.map(|bytes| bytes.as_u64().unwrap()).sum::<u64>());
    let text = stdout(run(["inspect", &path("yes")]));
    assert!(text.contains(&format!("{different} different ones, each once")), "{text}");
    let text = stdout(run(["export", &forest, "-o", &path("m"), "--leaf", "i8", "--shared-leaves", "yes", "-v"]));
    assert!(text.contains(", shared ") && text.contains("i8-leaves, shared-leaves"), "{text}");
    // All candidates are the same whatever is asked for; sharing is one of them only where it is smaller.
    let all = json(run(["export", &forest, "-o", &path("m"), "--leaf", "i8", "--json"]));
    for candidate in all["candidates"].as_array().unwrap() {
        let of = |other: &&Value| other["layout"] == candidate["layout"] && other["shared_leaves"] == false;
        let own = all["candidates"].as_array().unwrap().iter().find(of).unwrap();
        assert!(candidate["shared_leaves"] == false || candidate["bytes"].as_u64() < own["bytes"].as_u64(), "{all}");
    }
    let message = stderr(run(["export", &forest, "-o", &path("m"), "--shared-leaves", "maybe"]), 2);
    assert!(message.contains("use one of auto, yes, no"), "{message}");
}

#[test]
fn verify_fails_where_the_library_has_another_class_that_no_rounding_explains() {
    let (_directory, path) = place();
    // Margins of a millionth, within what f32 leaves state but above zero without rounding.
    let text = std::fs::read_to_string(data("xgboost-3.4-binary.json")).unwrap();
    let mut document: Value = serde_json::from_str(&text).unwrap();
    document["learner"]["learner_model_param"]["base_score"] = "5E-1".into();
    let trees = document.pointer_mut("/learner/gradient_booster/model/trees").unwrap().as_array_mut().unwrap();
    for (number, tree) in trees.iter_mut().enumerate() {
        let leaves: Vec<bool> = tree["left_children"].as_array().unwrap().iter().map(|child| *child == -1).collect();
        for (node, _) in leaves.into_iter().enumerate().filter(|(_, is_leaf)| *is_leaf) {
            tree["split_conditions"][node] = if number == 0 { 1e-6.into() } else { 0.0.into() };
        }
    }
    std::fs::write(path("small.json"), document.to_string()).unwrap();
    std::fs::write(path("rows.csv"), "width,height,count,angle\n0,990,1,0\n1,991,2,\n").unwrap();
    stdout(run(["export", &path("small.json"), "-o", &path("m"), "--leaf", "f32"]));
    let verify = |margins: &str, code: i32| {
        std::fs::write(path("margins.csv"), margins).unwrap();
        let with =
            ["verify", &path("m"), &path("small.json"), &path("rows.csv"), "--library-margins", &path("margins.csv")];
        if code == 0 { stdout(run(with)) } else { stderr(run(with), code) }
    };
    verify("1e-6\n1e-6\n", 0);
    let message = verify("1e-6\n-1e-6\n", 1);
    assert!(message.contains("1 rows get another class") && message.contains("the first is row 2"), "{message}");
    assert!(message.contains("of \"1\", and \"0\" by the library"), "{message}");
    // What onnxruntime and predict_proba give.
    let message = verify("0.4,0.6\n0.5,0.5\n", 1);
    assert!(message.contains("look like probabilities") && message.contains("raw scores"), "{message}");
}

#[test]
fn what_a_file_does_not_say_is_said_at_export_and_can_be_stated() {
    let (_directory, path) = place();
    let export = |model: &str, more: &[&str]| {
        stdout(run([&["export", &data(model), "-o", &path("m"), "--leaf", "f32", "--verbose"], more].concat()))
    };
    let missing = "xgboost-3.2-missing-0.json";
    assert!(export(missing, &[]).contains("the number that stood for a missing value in training"));
    let text = export(missing, &["--missing", "0"]);
    assert!(!text.contains("the number that stood for"), "{text}");
    assert!(text.contains("0 stands for a missing value") && text.contains("f32-leaves, sentinel"), "{text}");
    let verify = |model: &str, more: &[&str], code: i32| {
        let name = model.rsplit_once('.').unwrap().0;
        let (model, rows) = (data(model), data(&format!("{name}.csv")));
        let margins = written(name, "margin", path("margins.csv"));
        let verified = run([&["verify", &path("m"), &model, &rows, "--library-margins", &margins], more].concat());
        assert_eq!(verified.status.code(), Some(code), "{}", String::from_utf8_lossy(&verified.stderr));
    };
    verify(missing, &["--missing", "0"], 0);
    export(missing, &[]);
    verify(missing, &[], 1);
    let stopped = "xgboost-3.2-early-stopping.json";
    assert!(export(stopped, &[]).contains("up to the best iteration"));
    verify(stopped, &[], 0);
    assert!(export(stopped, &["--all-trees"]).contains("as asked"));
    verify(stopped, &["--all-trees"], 1);
    let poisson = "lightgbm-4.7-poisson.txt";
    assert!(export(poisson, &[]).contains("Predicts the value e^x of the margin x"));
    let predicted = || {
        let text = stdout(run(["recognize", &path("m"), &data("lightgbm-4.7-poisson.csv"), "--features"]));
        text.lines().map(|line| line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()).collect::<Vec<_>>()
    };
    for (value, library) in predicted().into_iter().zip(of_library("lightgbm-4.7-poisson", "prediction")) {
        let library: f64 = library.parse().unwrap();
        assert!((value - library).abs() < 2e-6 * library, "{value} instead of {library}");
    }
    let after = predicted();
    assert!(export(poisson, &["--link", "identity"]).contains("Predicts the value, which is the margin"));
    assert!(predicted().into_iter().zip(after).all(|(margin, value)| (margin.exp() - value).abs() < 2e-6 * value));
    let message = stderr(run(["export", &data(missing), "-o", &path("m"), "--link", "exponential"]), 2);
    assert!(message.contains("only a regression has one"), "{message}");
    let text = export("lightgbm-4.7-seconds.txt", &[]);
    assert!(text.contains("stay different in f32") && text.contains("--scale height=UNITS"), "{text}");
    // One line for what whole numbers hold exactly.
    let rows = data("lightgbm-4.7-seconds.csv");
    let text = export("lightgbm-4.7-seconds.txt", &["--scale", &rows]);
    assert!(text.contains("Whole units hold every value of these rows") && text.contains("height × 1"), "{text}");
    let text = stdout(run(["inspect", &path("m")]));
    assert!(text.contains("(per row, estimated)") && text.contains("200 rows") && !text.contains("touch"), "{text}");
}

#[test]
fn export_says_in_three_lines_what_was_written_and_beyond_them_what_may_need_another_option() {
    let (_directory, path) = place();
    let export =
        |model: &str, more: &[&str]| stdout(run([&["export", &data(model), "-o", &path("m.palpate")], more].concat()));
    for (model, call) in [
        ("lightgbm-4.7-multiclass.txt", "m_predict(row)"),
        ("lightgbm-4.7-poisson.txt", "m_value(row)"),
        ("sklearn-1.9-forest.onnx", "m_predict(row)"),
    ] {
        let text = export(model, &["--emit", "c"]);
        assert!(text.lines().count() == 3 && text.split_whitespace().count() <= 35, "{text}");
        assert!(text.contains(call) && text.contains(&path("m.h")), "{text}");
        assert!(std::fs::read_to_string(path("m.h")).unwrap().contains(call.split('(').next().unwrap()));
        assert!(export(model, &["--verbose"]).lines().count() > 4);
    }
    let text = export("xgboost-3.2-early-stopping.json", &[]);
    assert!(text.contains("--emit c") && text.contains("stood for a missing value"), "{text}");
    assert!(text.contains("up to the best iteration") && text.lines().count() == 5, "{text}");
    assert!(export("lightgbm-4.7-seconds.txt", &[]).contains("stay different in f32"));
}

/// Sequences of rows of a model's own classes, five of six rows such that the model itself takes for the class; as CSV.
fn sequences(model: &str, file: &str, count: usize, first: usize) -> String {
    let text = std::fs::read_to_string(file).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().collect();
    let said = stdout(run(["recognize", model, file, "--features", "--json"]));
    let class = |line: &str| serde_json::from_str::<Value>(line).unwrap()["class"].as_str().unwrap().to_owned();
    let classes: Vec<String> = said.lines().map(class).collect();
    let mut text = format!("id,kind,{header}\n");
    for number in first..first + count {
        let name = ["cup", "jug", "pan"][number % 3];
        let own: Vec<usize> = (0..rows.len()).filter(|&row| classes[row] == name).collect();
        for step in 0..6 {
            let row =
                if step == 3 { (number * 7 + step) % rows.len() } else { own[(number * 5 + step * 3) % own.len()] };
            text += &format!("{number},{name},{}\n", rows[row]);
        }
    }
    text
}

#[test]
fn sequences_of_rows_are_calibrated_evaluated_and_recognized_verdict_after_verdict() {
    let (_directory, path) = place();
    let (model, sure, page) = (path("model.palpate"), path("sure.palpate"), path("page.html"));
    let rows = data("xgboost-3.4-softprob.csv");
    stdout(run(["export", &data("xgboost-3.4-softprob.ubj"), "-o", &model, "--names", "cup,jug,pan"]));
    std::fs::write(path("fresh.csv"), sequences(&model, &rows, 300, 0)).unwrap();
    std::fs::write(path("unseen.csv"), sequences(&model, &rows, 300, 300)).unwrap();
    let columns = ["--label", "kind", "--sequence-column", "id"];
    let fresh = path("fresh.csv");
    let calibrate = |more: &[&str]| run([&["calibrate", &model, &fresh, "-o", &sure][..], &columns, more].concat());
    let found = json(calibrate(&["--error-rate", "10%", "--json"]));
    assert_eq!(
        (&found["promised"], &found["per"], &found["learned"]),
        (&Value::from(0.1), &"average".into(), &75.into())
    );
    assert_eq!(found["sequences"], 225);
    let text = stdout(calibrate(&["--error-rate", "10%"]));
    assert!(text.starts_with("Promised: at most 10 % of all names given, on average, wrong"), "{text}");
    let unseen = path("unseen.csv");
    let evaluate = |more: &[&str]| run([&["evaluate", &sure, &unseen][..], &columns, more].concat());
    let found = json(evaluate(&["--json", "--page", &page]));
    assert!(found["error"].as_f64() < Some(0.15) && found["promise"]["promised"] == 0.1, "{found}");
    assert_eq!(found["confusion"].as_array().unwrap().len(), 3);
    let html = std::fs::read_to_string(&page).unwrap();
    for part in ["Rows to a verdict", "early stopping", "majority vote", "Confusion", "as it grows"] {
        assert!(html.contains(part), "{part}");
    }
    let text = stdout(evaluate(&[]));
    assert!(text.contains("promised: at most 10 % wrong") && text.contains("no name"), "{text}");
    let streamed = run(["recognize", &sure, &unseen, "--features", "--add-up"]);
    let note = String::from_utf8_lossy(&streamed.stderr).into_owned();
    let about =
        "nothing says where a sequence ends (--sequence-column), so the promise of 10 % is for the first verdict alone";
    assert_eq!(note.matches(about).count(), 1, "{note}");
    let said = stdout(streamed);
    assert!(said.lines().filter(|line| line.contains("recognized")).count() > 100, "{said}");
    let only = stdout(run(["recognize", &sure, &unseen, "--features", "--add-up", "--only", "cup,pan"]));
    assert!(!only.lines().any(|line| line.contains("recognized") && line.contains("jug")), "{only}");
}

#[test]
fn evidence_ends_where_a_sequence_does_and_nothing_is_said_of_one_after_its_verdict() {
    let (_directory, path) = place();
    let (model, unseen) = (path("model.palpate"), path("unseen.csv"));
    let rows = data("xgboost-3.4-softprob.csv");
    stdout(run(["export", &data("xgboost-3.4-softprob.ubj"), "-o", &model, "--names", "cup,jug,pan"]));
    let text = sequences(&model, &rows, 300, 300);
    // Every other sequence is cut short, so that many are undecided.
    let (header, lines) = text.split_once('\n').unwrap();
    let is_kept = |(at, _): &(usize, &str)| (at / 6) % 2 == 0 || at % 6 < 1;
    let lines: Vec<&str> = lines.lines().enumerate().filter(is_kept).map(|(_, line)| line).collect();
    std::fs::write(&unseen, format!("{header}\n{}\n", lines.join("\n"))).unwrap();
    // A rate that takes two rows or more.
    let columns = ["--label", "kind", "--sequence-column", "id", "--error-rate", "20%"];
    let found = json(run([&["evaluate", &model, &unseen, "--json"][..], &columns].concat()));
    let recognize = ["recognize", &model, &unseen, "--features", "--add-up", "--error-rate", "20%"];
    let said = run([&recognize[..], &["--sequence-column", "id", "--json"]].concat());
    let said: Vec<Value> = stdout(said).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (mut wrong, mut named, mut undecided) = (0, 0, 0);
    for number in 300..600 {
        let id = number.to_string();
        let own: Vec<&Value> = said.iter().filter(|line| line["sequence"] == id).collect();
        let (last, before) = own.split_last().unwrap();
        assert!(before.iter().all(|line| line["verdict"] == "undecided"), "{own:?}");
        assert_eq!(last["rows"], own.len());
        named += u32::from(last["verdict"] == "recognized");
        undecided += u32::from(last["verdict"] == "undecided");
        let is_wrong = last["class"] != ["cup", "jug", "pan"][number % 3];
        wrong += u32::from(last["verdict"] == "recognized" && is_wrong);
    }
    assert!(undecided > 50 && named > 50, "{undecided} {named}");
    assert!((found["error"].as_f64().unwrap() - f64::from(wrong) / f64::from(named)).abs() < 1e-9, "{found}");
    assert!((found["undecided"].as_f64().unwrap() - f64::from(undecided) / 300.0).abs() < 1e-9, "{found}");
    // What evaluate refuses, too.
    let text = std::fs::read_to_string(&unseen).unwrap();
    let recognize = |text: String| {
        std::fs::write(&unseen, text).unwrap();
        stderr(run(["recognize", &model, &unseen, "--features", "--add-up", "--sequence-column", "id"]), 1)
    };
    let missing = recognize(text.replacen("\n301,", "\n,", 1));
    assert!(missing.contains("row 7: the sequence is missing"), "{missing}");
    let back = recognize(text.replacen("\n302,", "\n300,", 1));
    assert!(back.contains("row 8: the sequence \"300\" comes back"), "{back}");
    let alone = stderr(run(["recognize", &model, &unseen, "--features", "--sequence-column", "id"]), 2);
    assert!(alone.contains("--add-up"), "{alone}");
}

#[test]
fn a_promise_for_groups_says_when_none_are_given_and_copies_are_noted() {
    let (_directory, path) = place();
    let (model, sure, fresh) = (path("model.palpate"), path("sure.palpate"), path("fresh.csv"));
    let rows = data("xgboost-3.4-softprob.csv");
    stdout(run(["export", &data("xgboost-3.4-softprob.ubj"), "-o", &model, "--names", "cup,jug,pan"]));
    let made = sequences(&model, &rows, 300, 0);
    let (header, lines) = made.split_once('\n').unwrap();
    // A person for each two sequences.
    let person = |line: &str| line.split(',').next().unwrap().parse::<u32>().unwrap() / 2;
    let with: Vec<String> = lines.lines().map(|line| format!("{line},{}", person(line))).collect();
    std::fs::write(&fresh, format!("{header},person\n{}\n", with.join("\n"))).unwrap();
    let columns = ["--label", "kind", "--sequence-column", "id"];
    let groups = ["--group-column", "person"];
    let calibrate = |more: &[&str]| {
        stdout(run([&["calibrate", &model, &fresh, "-o", &sure, "--error-rate", "20%"][..], &columns, more].concat()))
    };
    let text = calibrate(&groups);
    assert!(
        text.starts_with(
            "Promised: at most 20 % of all names given, on average, wrong in new groups, with a confidence of 95 %"
        ),
        "{text}"
    );
    assert!(
        text.contains(
            "of all calibrations, including those that promise nothing, at most 5 % promise what does not hold"
        ),
        "{text}"
    );
    let evaluate = |more: &[&str]| stdout(run([&["evaluate", &sure, &fresh][..], &columns, more].concat()));
    assert!(evaluate(&groups).contains(" were, each group weighing the same: "), "{}", evaluate(&groups));
    let alone = evaluate(&[]);
    assert!(
        alone.contains(" were, each sequence as a group of its own, as none are given (--group-column): "),
        "{alone}"
    );
    // There are as many different rows as the fixture has, so that sequences repeat.
    let copied =
        format!("{made}{}\n", lines.lines().take(600).map(|line| format!("c{line}")).collect::<Vec<_>>().join("\n"));
    std::fs::write(&fresh, copied).unwrap();
    let text = calibrate(&[]);
    assert!(
        text.contains("\nnote: ")
            && text.contains(" of 400 sequences are copies, value by value, of others under another id"),
        "{text}"
    );
}

#[test]
fn what_is_wrong_with_sequences_of_rows_names_the_line_and_what_to_do() {
    let (_directory, path) = place();
    let model = path("model.palpate");
    let rows = data("xgboost-3.4-softprob.csv");
    stdout(run(["export", &data("xgboost-3.4-softprob.ubj"), "-o", &model, "--names", "cup,jug,pan"]));
    let good = sequences(&model, &rows, 240, 0);
    let file = path("rows.csv");
    let refused = |text: &str, more: &[&str]| {
        std::fs::write(&file, text).unwrap();
        let output = path("no.palpate");
        let words = ["calibrate", &model, &file, "-o", &output, "--label", "kind", "--sequence-column", "id"];
        let complaint = stderr(run([&words[..], more].concat()), 1);
        assert!(!Path::new(&output).exists());
        complaint
    };
    let few = refused(&good, &[]);
    assert!(few.contains("240 sequences are too few to promise 1 %: at least 299 are needed"), "{few}");
    assert!(few.contains("as many could promise 1.3 %"), "{few}");
    let two = refused(&good.replacen("0,cup", "0,jug", 1), &[]);
    assert!(two.contains(":3: the sequence \"0\" has the labels"), "{two}");
    let unknown = refused(&good.replacen("0,cup", "0,bowl", 6), &[]);
    assert!(unknown.contains(":2: the label \"bowl\""), "{unknown}");
    let again = refused(&format!("{good}{}", good.lines().nth(1).unwrap()), &[]);
    assert!(again.contains(":1442: the sequence \"0\" comes back"), "{again}");
    let group = refused(&good, &["--group-column", "person"]);
    assert!(group.contains(":1: it has no column \"person\""), "{group}");
    let alone = stderr(run(["calibrate", &model, &file, "-o", &path("no.palpate"), "--label", "kind"]), 2);
    assert!(alone.contains("--sequence-column"), "{alone}");
    stdout(run(["export", &data("xgboost-2.1-squarederror.ubj"), "-o", &model]));
    let regression = refused(&good, &[]);
    assert!(regression.contains("predicts a value"), "{regression}");
}

#[test]
fn a_model_is_proved_for_every_row_and_its_certificate_holds_or_says_what_changed() {
    let (_directory, path) = place();
    let (model, proof, source) = (path("model.palpate"), path("proof.txt"), data("xgboost-3.4-binary.json"));
    stdout(run(["export", &source, "-o", &model, "--layout", "compact"]));
    let proved = json(run(["verify", &model, &source, "--prove", &proof, "--json"]));
    let checked = json(run(["verify", &model, &source, "--certificate", &proof, "--json"]));
    let number = |proof: &Value, key: &str| proof[key].as_f64().unwrap();
    assert_eq!(proved["ensemble_trees"], 3, "{proved}");
    assert!(number(&proved, "margin_error") <= number(&proved, "stated"), "{proved}");
    let [found, again] = [&proved, &checked].map(|proof| number(proof, "margin_error"));
    assert!(found <= again && again <= 2.0 * found + 1e-9, "{proved} {checked}");
    assert!(
        stdout(run(["verify", &model, &source, "--prove", &proof]))
            .starts_with("Proved: on every possible row the model's")
    );
    let text = stdout(run(["verify", &model, &source, "--certificate", &proof]));
    assert!(text.contains("proof.txt holds: on every possible row"), "{text}");
    // Another missing number, in the rows as in the proof.
    let other = path("missing.palpate");
    stdout(run(["export", &source, "-o", &other, "--missing=-999"]));
    for arguments in [&[&*data("xgboost-3.4-binary.csv")][..], &["--prove", &path("other.txt")]] {
        let message = stderr(run([&["verify", &other, &source], arguments].concat()), 1);
        assert!(message.contains("NaN and -999") && message.contains("NaN alone"), "{message}");
    }
    // A certificate whose end is missing.
    let whole = std::fs::read_to_string(&proof).unwrap();
    let cut = path("cut.txt");
    for lines in [4, whole.lines().count() - 1] {
        std::fs::write(&cut, whole.lines().take(lines).map(|line| format!("{line}\n")).collect::<String>()).unwrap();
        let message = stderr(run(["verify", &model, &source, "--certificate", &cut]), 1);
        assert!(message.contains("the certificate is cut off"), "{message}");
    }
    // Another model, another file, a damaged certificate.
    let message = stderr(run(["verify", &model, &data("xgboost-3.4-softprob.ubj"), "--prove", &proof]), 1);
    assert!(message.contains("model.palpate: the model's outputs are not the ensemble's"), "{message}");
    stdout(run(["export", &source, "-o", &path("other.palpate"), "--layout", "wide"]));
    let message = stderr(run(["verify", &path("other.palpate"), &source, "--certificate", &proof]), 1);
    assert!(message.contains("other.palpate: the certificate is about a model with the checksum"), "{message}");
    std::fs::write(&proof, "palpate certificate 1\nnonsense\n").unwrap();
    let message = stderr(run(["verify", &model, &source, "--certificate", &proof]), 1);
    assert!(message.contains("proof.txt:2: not a line of a certificate: \"nonsense\""), "{message}");
    let message = stderr(run(["verify", &model, &source, "--prove", &source]), 2);
    assert!(message.contains("xgboost-3.4-binary.json"), "{message}");
    stderr(run(["verify", &model, &source]), 2);
    let rows = data("xgboost-3.4-binary.csv");
    let text = stdout(run(["verify", &model, &source, &rows, "--prove", &proof]));
    assert!(text.contains("changes a row's class:\n  row 1: "), "{text}");
    let moved = json(run(["verify", &model, &source, &rows, "--prove", &proof, "--json"]));
    assert_eq!((moved["rows"].as_array().unwrap().len(), moved["rows"][0].as_array().unwrap().len()), (60, 4));
    stderr(run(["verify", &model, &source, &rows, "--certificate", &proof]), 2);
}

#[test]
fn a_class_from_fewer_trees_is_decided_by_rows_and_said_and_proved_in_data_and_in_assembly() {
    let (_directory, path) = place();
    let (model, proof, source) = (path("model.palpate"), path("proof.txt"), data("xgboost-3.4-softmax.json"));
    let rows = data("xgboost-3.4-softmax.csv");
    let plain = json(run(["export", &source, "-o", &model, "--layout", "compact", "--json"]));
    assert_eq!(plain.get("early_exit"), None);
    let before = std::fs::read(&model).unwrap();
    for early_exit in ["yes", rows.as_str()] {
        let options = ["--layout", "compact", "--early-exit", early_exit, "--json"];
        let exported = json(run(["export", source.as_str(), "-o", model.as_str()].into_iter().chain(options)));
        let places = exported["early_exit"]["ends"].as_array().unwrap().len();
        assert!(places > 0 || std::fs::read(&model).unwrap() == before, "{exported}");
        assert_eq!(exported["early_exit"].get("walked").is_some(), early_exit != "yes", "{exported}");
        stdout(run(["verify", &model, &source, &rows]));
        stdout(run(["verify", &model, &source, "--prove", &proof]));
        stdout(run(["verify", &model, &source, "--certificate", &proof]));
    }
    let text = stdout(run(["export", &source, "-o", &model, "--layout", "compact", "--early-exit", "yes", "-v"]));
    assert!(text.contains("A class is known after at most "), "{text}");
    for emit in ["thumb", "thumb-m4f"] {
        for early_exit in [&[][..], &["--early-exit", "yes"]] {
            stdout(run(["export", &source, "-o", &model, "--emit", emit].iter().chain(early_exit)));
            let proved = json(run(["verify", &model, &source, "--prove", &proof, "--json"]));
            assert!(proved["instructions"].as_u64().unwrap() > 50, "{proved}");
            stdout(run(["verify", &model, &source, "--certificate", &proof]));
        }
    }
    // A changed comparison, and assembly that is not there.
    let assembly = path("model.s");
    let text = std::fs::read_to_string(&assembly).unwrap();
    let (head, tail) = text.rsplit_once("\tcmp r3, #").unwrap();
    let (number, rest) = tail.split_once('\n').unwrap();
    let other = number.parse::<u8>().unwrap() + 1;
    std::fs::write(&assembly, format!("{head}\tcmp r3, #{other}\n{rest}")).unwrap();
    let message = stderr(run(["verify", &model, &source, "--prove", &proof]), 1);
    assert!(message.contains("model.palpate: "), "{message}");
    let message = stderr(run(["verify", &model, &source, "--certificate", &proof]), 1);
    assert!(message.contains("a file of assembly"), "{message}");
    std::fs::remove_file(&assembly).unwrap();
    let message = stderr(run(["verify", &model, &source, "--prove", &proof]), 1);
    assert!(message.contains("the .s file beside the model"), "{message}");
    let message = stderr(run(["export", &source, "-o", &model, "--leaf", "f32", "--early-exit", "yes"]), 2);
    assert!(message.contains("sums of f32"), "{message}");
    let one = data("xgboost-2.1-squarederror.ubj");
    let message = stderr(run(["export", &one, "-o", &model, "--early-exit", "yes"]), 2);
    assert!(message.contains("has no class"), "{message}");
}
