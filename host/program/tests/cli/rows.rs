//! Models of other libraries, as a user calls the commands: export, verify, recognize.

use crate::fixtures::ONE_SPLIT;
use crate::{
    Folder, complains, fails, figures, holds, json, lines, palpate, parts_are_all_bytes, run, says, stderr, stdout,
    succeeds,
};
use serde_json::Value;
use std::fs;
use std::path::Path;
use table::cells;

#[path = "../../../../tests/data/import/table.rs"]
mod table;

/// Real files of other libraries, and the tables of their rows; see `make.py` there.
fn data(name: &str) -> String {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/import");
    directory.join(name).to_str().unwrap().to_owned()
}

/// A folder with a file of a library as `source`, with its own ending, and the table of its rows as `rows.csv`.
fn library(file: &str) -> Folder {
    let at = Folder::new();
    let (name, ending) = file.rsplit_once('.').unwrap();
    fs::copy(data(file), at.join(format!("source.{ending}"))).unwrap();
    fs::copy(data(&format!("{name}.csv")), at.join("rows.csv")).unwrap();
    at
}

/// Such a folder of a model of three classes, which is exported as `model.palpate`.
fn three_classes(file: &str) -> Folder {
    let at = library(file);
    succeeds(&at, "export source.ubj -o model.palpate --names cup,jug,pan");
    at
}

/// The library's cells of one kind for each row: `margin` or `prediction`.
fn of_library(at: &Path, kind: &str) -> Vec<String> {
    let table = fs::read_to_string(at.join("rows.csv")).unwrap();
    cells(&table, kind).into_iter().map(|row| row.join(",")).collect()
}

/// Writes these cells, as `margin.csv` or `prediction.csv`.
fn write_of_library(at: &Path, kind: &str) {
    fs::write(at.join(format!("{kind}.csv")), of_library(at, kind).join("\n") + "\n").unwrap();
}

/// For each row the class with the library's largest margin, and all of its margins.
fn best_and_margins(at: &Path) -> Vec<(usize, Vec<f64>)> {
    let best =
        |margins: &[f64]| (0..3).fold(0, |best, class| if margins[class] > margins[best] { class } else { best });
    let row = |row: String| row.split(',').map(|margin| margin.parse().unwrap()).collect::<Vec<f64>>();
    of_library(at, "margin").into_iter().map(row).map(|margins| (best(&margins), margins)).collect()
}

/// The JSON document of `source.json`.
fn document(at: &Path) -> Value {
    crate::read(&at.join("source.json"))
}

#[test]
fn a_model_exports_and_verifies_against_its_librarys_own_margins() {
    let at = &library("lightgbm-4.7-zero-as-missing.txt");
    write_of_library(at, "margin");
    for leaf in ["f32", "i16"] {
        let exported = figures(at, &format!("export source.txt -o model.palpate --leaf {leaf}"));
        assert_eq!(exported["features"], serde_json::json!(["width", "height", "count", "angle"]));
        let verified = figures(at, "verify model.palpate source.txt rows.csv --library-margins margin.csv");
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
    let at = &library("xgboost-3.4-binary.json");
    // Another leaf in tree 1, as a library of another version may have.
    let mut document = document(at);
    let tree = document.pointer_mut("/learner/gradient_booster/model/trees/1").unwrap();
    let leaf = tree["left_children"].as_array().unwrap().iter().position(|child| *child == -1).unwrap();
    tree["split_conditions"][leaf] = 0.75.into();
    fs::write(at.join("changed.json"), document.to_string()).unwrap();
    succeeds(at, "export source.json -o model.palpate");
    let verify = "verify model.palpate changed.json rows.csv --json";
    let refused = palpate(at, verify);
    let verified: Value = serde_json::from_slice(&refused.stdout).unwrap();
    assert!(verified["max_margin_error"].as_f64() > verified["stated_bound"].as_f64());
    assert_eq!(verified["library_max_margin_error"], Value::Null);
    complains(refused, verify, 1, "where tree 1 is the first that adds another leaf");
    fs::copy(data("xgboost-3.4-softprob.ubj"), at.join("other.ubj")).unwrap();
    let expected = "4 features, 2 outputs and 3 trees, the ensemble 4 features, 3 outputs";
    fails(at, "verify model.palpate other.ubj rows.csv", 1, expected);
    fs::write(at.join("margins.csv"), "0.5\n").unwrap();
    let expected = "margins.csv: it has margins of 1 rows, but there are 60 rows";
    fails(at, "verify model.palpate source.json rows.csv --library-margins margins.csv", 1, expected);
}

#[test]
fn each_row_gets_a_verdict_of_its_own_or_adds_to_the_last() {
    let at = &three_classes("xgboost-2.1-softprob.ubj");
    let said = lines(&succeeds(at, "rows recognize model.palpate rows.csv --json"));
    let margins = best_and_margins(at);
    assert_eq!(said.len(), margins.len());
    for (line, (best, margins)) in said.iter().zip(margins) {
        assert_eq!(line["class"], ["cup", "jug", "pan"][best], "{line}");
        assert_eq!(line.get("verdict"), None, "a row alone has a class");
        let sum: f64 = margins.iter().map(|margin| (margin - margins[best]).exp()).sum();
        assert!((line["posterior"].as_f64().unwrap() - 1.0 / sum).abs() < 1e-3, "{line}");
    }
    let added = lines(&succeeds(at, "rows recognize model.palpate rows.csv --add-up --json"));
    assert_eq!(added.len(), said.len());
    assert!(added.iter().map(|line| line["rows"].as_u64().unwrap()).max() > Some(1));
}

#[test]
fn columns_are_found_by_their_names_in_every_command_and_by_position_only_where_there_are_none() {
    let at = &three_classes("xgboost-2.1-softprob.ubj");
    let margins = |text: &str| {
        fs::write(at.join("asked.csv"), text).unwrap();
        let said = palpate(at, "rows recognize model.palpate asked.csv --json");
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
    fs::write(at.join("labeled.csv"), "width,Height,count,angle,kind,id\n1,990,2,0.5,cup,1\n").unwrap();
    for words in [
        "rows recognize model.palpate labeled.csv",
        "verify model.palpate source.ubj labeled.csv",
        "rows evaluate model.palpate labeled.csv --label kind",
        "rows evaluate model.palpate labeled.csv --label kind --sequence-column id",
        "rows calibrate model.palpate labeled.csv -o no.palpate --label kind --sequence-column id",
        "export source.ubj -o no.palpate --scale labeled.csv",
    ] {
        let expected =
            "labeled.csv:1: no column is named height; its columns are width, Height, count, angle, kind, id";
        fails(at, words, 1, expected);
    }
}

#[test]
fn what_the_library_predicts_is_compared_too() {
    for file in ["lightgbm-4.7-forest-gamma.txt", "sklearn-1.9-forest.onnx"] {
        let at = &library(file);
        let is_value = file.ends_with("txt");
        let source = if is_value { "source.txt" } else { "source.onnx" };
        ["margin", "prediction"].iter().for_each(|kind| write_of_library(at, kind));
        let exported = succeeds(at, &format!("export {source} -o model.palpate --verbose"));
        let verify = format!("verify model.palpate {source} rows.csv");
        let with = format!("{verify} --library-margins margin.csv --library-values prediction.csv");
        if is_value {
            let expected = "Predicts the value e^x of the mean x of the trees, the margin / 5";
            assert!(exported.contains(expected), "{exported}");
            says(at, &with, &["largest difference to the library's values", "another value than the library's"]);
            says(at, "inspect model.palpate", &["the mean x of the trees, the margin / 5"]);
        } else {
            says(at, &with, &["another class than the library's", "0  rows, 0 not explained"]);
        }
        // The proof beside it, in one run.
        let prove = format!("{with} --prove");
        let proved = succeeds(at, &prove);
        assert!(
            proved.starts_with("rows ")
                && proved.contains(" 60  and ")
                && proved.contains("Proved: on every possible row"),
            "{proved}"
        );
        let all = figures(at, &prove);
        assert_eq!((&all["verified"]["rows"], all["proof"]["boxes"].as_u64() > Some(0)), (&60.into(), true), "{all}");
        let text = fs::read_to_string(at.join("prediction.csv")).unwrap();
        fs::write(at.join("others.csv"), text.replace(text.lines().nth(4).unwrap(), "17")).unwrap();
        let others = format!("{verify} --library-values others.csv");
        let [values, class] = ["the library predicts other values", "others.csv: the prediction \"17\" of row"];
        complains(palpate(at, &others), &others, 1, if is_value { values } else { class });
        fails(at, &format!("verify model.palpate {source} --library-values prediction.csv"), 2, "DATA");
    }
}

#[test]
fn a_model_with_names_or_another_link_of_its_own_is_proved() {
    let at = &three_classes("xgboost-3.4-softprob.ubj");
    let prove = "verify model.palpate source.ubj --prove";
    assert!(says(at, prove, &["\njug  "]).starts_with("Proved: on every possible row"));
    // The same names in another order are other classes.
    succeeds(at, "export source.ubj -o model.palpate --names 2,1,0");
    fails(at, prove, 1, "the model's outputs are not the ensemble's: 2, 1, 0, and not 0, 1, 2");
    let at = &library("lightgbm-4.7-poisson.txt");
    succeeds(at, "export source.txt -o model.palpate --link identity");
    let expected = "its link is identity, the file's exponential";
    says(at, "verify model.palpate source.txt --prove", &[expected]);
}

#[test]
fn models_of_rows_and_of_touches_are_not_taken_for_each_other() {
    let at = &library("xgboost-2.1-softprob.ubj");
    ONE_SPLIT.put(at);
    succeeds(at, "export source.ubj -o of-rows.palpate");
    fs::write(at.join("touches.txt"), "0 0 0.08\n").unwrap();
    fs::write(at.join("other.csv"), "curvature,slope\n1,2\n").unwrap();
    let on_a_chip = "of-rows.palpate: the model is over rows of features … palpate rows recognize MODEL ROWS.csv";
    for (words, expected) in [
        ("recognize of-rows.palpate touches.txt", "of-rows.palpate: a model of rows … Use `palpate rows recognize`."),
        ("evaluate of-rows.palpate data", "of-rows.palpate: a model of rows … Use `palpate rows evaluate`."),
        ("plan of-rows.palpate data -o x", "of-rows.palpate: a model of rows … Give a model of touches."),
        ("rows recognize model.palpate other.csv", "model.palpate: a model of touches … Use `palpate recognize`."),
        (
            "rows calibrate model.palpate other.csv -o x --label a --sequence-column b",
            "model.palpate: a model of touches … Use `palpate calibrate`.",
        ),
        ("link emulator --load of-rows.palpate rows.csv", on_a_chip),
    ] {
        fails(at, words, 1, expected);
    }
}

#[test]
fn labeled_rows_are_evaluated_one_by_one() {
    let at = &three_classes("xgboost-2.1-softprob.ubj");
    // Labels by name and by number; the first row's are wrong.
    let rows = fs::read_to_string(at.join("rows.csv")).unwrap();
    let mut labeled = format!("{},kind\n", rows.lines().next().unwrap());
    for (number, (row, (best, _))) in rows.lines().skip(1).zip(best_and_margins(at)).enumerate() {
        let label = (best + usize::from(number == 0)) % 3;
        let label = if number % 2 == 0 { ["cup", "jug", "pan"][label] } else { ["0", "1", "2"][label] };
        labeled += &format!("{row},{label}\n");
    }
    fs::write(at.join("labeled.csv"), labeled).unwrap();
    let evaluated = figures(at, "rows evaluate model.palpate labeled.csv --label kind");
    assert_eq!(evaluated["rows"], 60);
    assert!((evaluated["accuracy"].as_f64().unwrap() - 59.0 / 60.0).abs() < 1e-12, "{evaluated}");
    // The file's own classes have no such names.
    let expected = "labeled.csv: the label … none of the model's classes";
    fails(at, "rows evaluate source.ubj labeled.csv --label kind", 1, expected);
}

#[test]
fn a_regression_gives_its_value_and_no_verdict_and_its_labels_are_numbers() {
    let at = &library("catboost-1.2-regression.json");
    succeeds(at, "export source.json -o model.palpate --leaf f32");
    let said = lines(&succeeds(at, "rows recognize model.palpate rows.csv --json"));
    for (line, margin) in said.iter().zip(of_library(at, "margin")) {
        assert!((line["margins"][0].as_f64().unwrap() - margin.parse::<f64>().unwrap()).abs() < 1e-5);
        assert_eq!(line["value"].as_f64().unwrap() as f32, line["margins"][0].as_f64().unwrap() as f32);
        assert_eq!(line.get("verdict"), None);
    }
    fs::write(at.join("labeled.csv"), "width,height,count,angle,amount\n1,990,2,0.5,2\n").unwrap();
    let evaluated = figures(at, "rows evaluate model.palpate labeled.csv --label amount");
    assert_eq!(evaluated["mean_absolute_error"], evaluated["root_mean_square_error"]);
}

#[test]
fn what_cannot_be_taken_over_is_refused_by_name_with_the_way_round() {
    let at = &library("xgboost-3.4-softmax.json");
    // Trees of fractions that are said to be of touches are not rounded.
    let mut document = document(at);
    // Four features, as gravity has.
    document["learner"]["attributes"] =
        serde_json::json!({"palpate_descriptor": "gravity", "palpate_objects": "[\"a\",\"b\",\"c\"]"});
    fs::write(at.join("labeled.json"), document.to_string()).unwrap();
    let expected = "not trained on whole numbers … remove its attribute";
    fails(at, "export labeled.json -o model.palpate", 1, expected);
    for (bytes, expected) in [
        (&b"\x80\x04\x95pickle"[..], "a Python pickle … skl2onnx"),
        (b"CBM1....", "CatBoost's binary format … format=\"json\""),
        (b"PLPT....", "the model is truncated: 8 bytes … foreign"),
        (b"binf....", "XGBoost's old binary format … model.json"),
        (b"\x1f\x8b....", "compressed … Unpack"),
        (b"<?xml version=\"1.0\"?>", "not an ensemble in a readable format … ONNX"),
        (b"{\"name\": \"tree\", \"tree_info\": []}", "LightGBM's dump_model … model.txt"),
        (b"{\"learner\": {\"gradient_booster\": {\"name\": \"gblinear\"}}}", "gblinear, which has no trees … gbtree"),
    ] {
        fs::write(at.join("foreign"), bytes).unwrap();
        fails(at, "export foreign -o model.palpate", 1, expected);
    }
    for (file, more, expected) in [
        ("catboost-1.2-statistics.json", "", "statistics of the target by category (count) … one_hot_max_size"),
        ("catboost-1.2-one-hot-words.json", "", "a category of feature 2 … Number the categories"),
        ("lightgbm-4.7-linear.txt", "", "tree 0 has linear functions … linear_tree=false"),
        ("lightgbm-4.7-binary.txt", "--names a,b,c", "3 names were given for 2 outputs"),
    ] {
        fails(at, &format!("export {} -o model.palpate {more}", data(file)), 1, expected);
    }
    assert!(!at.join("model.palpate").exists());
}

#[test]
fn whole_numbers_in_the_users_units_split_as_the_values_do_and_say_what_they_change() {
    let at = &library("xgboost-3.4-softprob.ubj");
    let exported = figures(at, "export source.ubj -o m --scale width=10000,height=1000,count=1,angle=10000");
    let effects = exported["scales"].as_array().unwrap();
    let height = effects.iter().find(|effect| effect["feature"] == "height").unwrap();
    assert_eq!((height["scale"].as_f64(), &height["different"]), (Some(1000.0), &height["thresholds"]));
    assert!(height["largest_step"].as_f64() <= Some(0.000_5), "{height}");
    let verified = figures(at, "verify m source.ubj rows.csv");
    assert_eq!(verified["class_differs"], 0, "{verified}");
    assert!(verified["max_margin_error"].as_f64() <= verified["stated_bound"].as_f64(), "{verified}");
    let inspected = figures(at, "inspect m");
    assert_eq!(inspected["feature_names"][1], serde_json::json!({"name": "height", "scale": 1000.0}));
    parts_are_all_bytes(&inspected);
    let fitted = figures(at, "export source.ubj -o m --scale rows.csv");
    assert!(fitted["scales"].as_array().unwrap().iter().any(|effect| effect["scale"].as_f64() > Some(1.0)), "{fitted}");
    succeeds(at, "verify m source.ubj rows.csv");
    // A feature with fractions, unmentioned, and one that does not exist; units beyond 32 bits.
    for (scale, expected) in [
        ("width=100", "a scale for height too"),
        ("depth=100", "--scale is depth=100. Use a feature: width, height, count, angle"),
        ("width=1,height=1e9,count=1,angle=1", "--scale is 1000000000 for height"),
    ] {
        fails(at, &format!("export source.ubj -o m --scale {scale}"), 2, expected);
    }
    // A split on missing values has whole units as others do.
    let at = &library("catboost-1.2-max-missing.json");
    for scale in ["width=1000,height=100,count=10,angle=1000", "rows.csv"] {
        let text = succeeds(at, &format!("export source.json -o m --scale {scale}"));
        assert!(!text.contains("e38"), "{text}");
        succeeds(at, "verify m source.json rows.csv --prove");
    }
}

#[test]
fn equal_leaves_of_a_forest_stand_once_and_that_is_said_everywhere() {
    let at = &library("sklearn-1.9-ties-three.onnx");
    let shared = figures(at, "export source.onnx -o m --leaf i8");
    let different = shared["shared_leaves"].as_u64().unwrap();
    assert!(different >= 2 && different <= shared["leaves"].as_u64().unwrap(), "{shared}");
    let verified = figures(at, "verify m source.onnx rows.csv");
    assert_eq!(verified["class_differs"], 0, "{verified}");
    let inspected = figures(at, "inspect m");
    assert_eq!(inspected["shared_leaves"], different);
    parts_are_all_bytes(&inspected);
    says(at, "inspect m", &[&format!("{different} different ones, each once")]);
    says(at, "export source.onnx -o m --leaf i8 -v", &["i8-leaves, shared-leaves"]);
}

#[test]
fn verify_fails_where_the_library_has_another_class_that_no_rounding_explains() {
    let at = &library("xgboost-3.4-binary.json");
    // Margins of a millionth, within what f32 leaves state but above zero without rounding.
    let mut document = document(at);
    document["learner"]["learner_model_param"]["base_score"] = "5E-1".into();
    let trees = document.pointer_mut("/learner/gradient_booster/model/trees").unwrap().as_array_mut().unwrap();
    for (number, tree) in trees.iter_mut().enumerate() {
        let leaves: Vec<bool> = tree["left_children"].as_array().unwrap().iter().map(|child| *child == -1).collect();
        for (node, _) in leaves.into_iter().enumerate().filter(|(_, is_leaf)| *is_leaf) {
            tree["split_conditions"][node] = if number == 0 { 1e-6.into() } else { 0.0.into() };
        }
    }
    fs::write(at.join("small.json"), document.to_string()).unwrap();
    fs::write(at.join("rows.csv"), "width,height,count,angle\n0,990,1,0\n1,991,2,\n").unwrap();
    succeeds(at, "export small.json -o m --leaf f32");
    let verify = "verify m small.json rows.csv --library-margins margins.csv";
    fs::write(at.join("margins.csv"), "1e-6\n1e-6\n").unwrap();
    succeeds(at, verify);
    let another = "1 rows get another class … the first is row 2 … of \"1\", and \"0\" by the library";
    // The second is what onnxruntime and predict_proba give.
    let probabilities = "look like probabilities … raw scores";
    for (margins, expected) in [("1e-6\n-1e-6\n", another), ("0.4,0.6\n0.5,0.5\n", probabilities)] {
        fs::write(at.join("margins.csv"), margins).unwrap();
        complains(palpate(at, verify), verify, 1, expected);
    }
}

#[test]
fn what_a_file_does_not_say_is_said_at_export_and_can_be_stated() {
    let at = &library("xgboost-3.2-missing-0.json");
    let export = "export source.json -o m --leaf f32 --verbose";
    let verify = "verify m source.json rows.csv --library-margins margin.csv";
    write_of_library(at, "margin");
    let stood = "the number that stood for a missing value in training";
    let text = says(at, &format!("{export} --missing 0"), &["0 stands for a missing value", "f32-leaves, sentinel"]);
    assert!(!text.contains("the number that stood for"), "{text}");
    succeeds(at, &format!("{verify} --missing 0"));
    says(at, export, &[stood]);
    complains(palpate(at, verify), verify, 1, "");
    fails(at, "export source.json -o m --link exponential", 2, "only a regression has one");

    let at = &library("xgboost-3.2-early-stopping.json");
    write_of_library(at, "margin");
    says(at, export, &["up to the best iteration"]);
    succeeds(at, verify);
    says(at, &format!("{export} --all-trees"), &["as asked"]);
    let all = format!("{verify} --all-trees");
    complains(palpate(at, &all), &all, 1, "");
    let text = says(
        at,
        "export source.json -o m.palpate",
        &["--emit c", "stood for a missing value", "up to the best iteration"],
    );
    assert_eq!(text.lines().count(), 5, "{text}");

    let at = &library("lightgbm-4.7-poisson.txt");
    let export = "export source.txt -o m --leaf f32 --verbose";
    says(at, export, &["Predicts the value e^x of the margin x"]);
    let predicted = || {
        let text = succeeds(at, "rows recognize m rows.csv");
        text.lines().map(|line| line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()).collect::<Vec<_>>()
    };
    let after = predicted();
    for (value, library) in after.iter().zip(of_library(at, "prediction")) {
        let library: f64 = library.parse().unwrap();
        assert!((value - library).abs() < 2e-6 * library, "{value} instead of {library}");
    }
    says(at, &format!("{export} --link identity"), &["Predicts the value, which is the margin"]);
    assert!(predicted().into_iter().zip(after).all(|(margin, value)| (margin.exp() - value).abs() < 2e-6 * value));

    let at = &library("lightgbm-4.7-seconds.txt");
    says(at, export, &["stay different in f32", "--scale height=1"]);
    says(at, "export source.txt -o m.palpate", &["stay different in f32"]);
    // One line for what whole numbers hold exactly.
    let scaled = format!("{export} --scale rows.csv");
    says(at, &scaled, &["Whole units hold every value of these rows", "height × 1"]);
    let text = says(at, "inspect m", &["(per row, estimated)", "200 rows"]);
    assert!(!text.contains("touch"), "{text}");
}

#[test]
fn export_says_in_three_lines_what_was_written() {
    for (file, call) in [
        ("lightgbm-4.7-multiclass.txt", "m_predict(row)"),
        ("lightgbm-4.7-poisson.txt", "m_value(row)"),
        ("sklearn-1.9-forest.onnx", "m_predict(row)"),
    ] {
        let at = &library(file);
        let export = format!("export source.{} -o m.palpate", file.rsplit_once('.').unwrap().1);
        let text = says(at, &format!("{export} --emit c"), &[call, "m.h"]);
        assert!(text.lines().count() == 3 && text.split_whitespace().count() <= 35, "{text}");
        assert!(fs::read_to_string(at.join("m.h")).unwrap().contains(call.split('(').next().unwrap()));
        assert!(succeeds(at, &format!("{export} --verbose")).lines().count() > 4);
    }
}

/// Sequences of rows of the model's own classes, five of six rows such that the model itself takes for the class; as CSV.
fn sequences(at: &Path, count: usize, first: usize) -> String {
    let text = fs::read_to_string(at.join("rows.csv")).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().collect();
    let said = lines(&succeeds(at, "rows recognize model.palpate rows.csv --json"));
    let mut text = format!("id,kind,{header}\n");
    for number in first..first + count {
        let name = ["cup", "jug", "pan"][number % 3];
        let own: Vec<usize> = (0..rows.len()).filter(|&row| said[row]["class"] == name).collect();
        for step in 0..6 {
            let row =
                if step == 3 { (number * 7 + step) % rows.len() } else { own[(number * 5 + step * 3) % own.len()] };
            text += &format!("{number},{name},{}\n", rows[row]);
        }
    }
    text
}

/// The columns of such a file.
const COLUMNS: &str = "--label kind --sequence-column id";

#[test]
fn sequences_of_rows_are_calibrated_evaluated_and_recognized_verdict_after_verdict() {
    let at = &three_classes("xgboost-3.4-softprob.ubj");
    fs::write(at.join("fresh.csv"), sequences(at, 300, 0)).unwrap();
    fs::write(at.join("unseen.csv"), sequences(at, 300, 300)).unwrap();
    let calibrate = format!("rows calibrate model.palpate fresh.csv -o sure.palpate {COLUMNS} --error-rate 10%");
    let found = figures(at, &calibrate);
    assert_eq!(
        (&found["promised"], &found["per"], &found["learned"]),
        (&Value::from(0.1), &"average".into(), &75.into())
    );
    assert_eq!(found["sequences"], 225);
    let text = succeeds(at, &calibrate);
    assert!(text.starts_with("At most 10 % of the names are wrong, on average. Confidence 95 %: of all"), "{text}");
    let evaluate = format!("rows evaluate sure.palpate unseen.csv {COLUMNS}");
    let found = figures(at, &format!("{evaluate} --page page.html"));
    assert!(found["error"].as_f64() < Some(0.15) && found["promise"]["promised"] == 0.1, "{found}");
    assert_eq!(found["confusion"].as_array().unwrap().len(), 3);
    let html = fs::read_to_string(at.join("page.html")).unwrap();
    holds(&html, &["Rows to a verdict", "early stopping", "majority vote", "Confusion", "as it grows"]);
    says(at, &evaluate, &["promised: at most 10 % wrong", "no name"]);
    let streamed = palpate(at, "rows recognize sure.palpate unseen.csv --add-up");
    let note = String::from_utf8_lossy(&streamed.stderr).into_owned();
    let about =
        "nothing says where a sequence ends (--sequence-column), so the promise of 10 % is for the first verdict alone";
    assert_eq!(note.matches(about).count(), 1, "{note}");
    let said = stdout(streamed);
    assert!(said.lines().filter(|line| line.contains("recognized")).count() > 100, "{said}");
    let only = succeeds(at, "rows recognize sure.palpate unseen.csv --add-up --only cup,pan");
    assert!(!only.lines().any(|line| line.contains("recognized") && line.contains("jug")), "{only}");
}

#[test]
fn evidence_ends_where_a_sequence_does_and_nothing_is_said_of_one_after_its_verdict() {
    let at = &three_classes("xgboost-3.4-softprob.ubj");
    let text = sequences(at, 300, 300);
    // Every other sequence is cut short, so that many are undecided.
    let (header, rows) = text.split_once('\n').unwrap();
    let is_kept = |(at, _): &(usize, &str)| (at / 6) % 2 == 0 || at % 6 < 1;
    let rows: Vec<&str> = rows.lines().enumerate().filter(is_kept).map(|(_, line)| line).collect();
    let text = format!("{header}\n{}\n", rows.join("\n"));
    fs::write(at.join("unseen.csv"), &text).unwrap();
    // A rate that takes two rows or more.
    let found = figures(at, &format!("rows evaluate model.palpate unseen.csv {COLUMNS} --error-rate 20%"));
    let recognize = "rows recognize model.palpate unseen.csv --add-up --sequence-column id";
    let said = lines(&succeeds(at, &format!("{recognize} --error-rate 20% --json")));
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
    for (row, instead, expected) in [
        ("\n301,", "\n,", "row 7: the sequence is missing"),
        ("\n302,", "\n300,", "row 8: the sequence \"300\" comes back"),
    ] {
        fs::write(at.join("unseen.csv"), text.replacen(row, instead, 1)).unwrap();
        fails(at, recognize, 1, expected);
    }
    fails(at, "rows recognize model.palpate unseen.csv --sequence-column id", 2, "--add-up");
}

#[test]
fn a_promise_for_groups_says_when_none_are_given_and_copies_are_noted() {
    let at = &three_classes("xgboost-3.4-softprob.ubj");
    let made = sequences(at, 300, 0);
    let (header, rows) = made.split_once('\n').unwrap();
    // A person for each two sequences.
    let person = |line: &str| line.split(',').next().unwrap().parse::<u32>().unwrap() / 2;
    let with: Vec<String> = rows.lines().map(|line| format!("{line},{}", person(line))).collect();
    fs::write(at.join("fresh.csv"), format!("{header},person\n{}\n", with.join("\n"))).unwrap();
    let calibrate = format!("rows calibrate model.palpate fresh.csv -o sure.palpate --error-rate 20% {COLUMNS}");
    let expected = "Confidence 95 %: of all calibrations at most 5 % state a promise that fails.";
    let text = says(at, &format!("{calibrate} --group-column person"), &[expected]);
    assert!(text.starts_with("At most 20 % of the names are wrong in new groups, on average."), "{text}");
    let evaluate = format!("rows evaluate sure.palpate fresh.csv {COLUMNS}");
    says(at, &format!("{evaluate} --group-column person"), &[" were, each group weighing the same: "]);
    let alone = " were, each sequence as a group of its own, as none are given (--group-column): ";
    says(at, &evaluate, &[alone]);
    // There are as many different rows as the fixture has, so that sequences repeat.
    let copies: String = rows.lines().take(600).map(|line| format!("c{line}\n")).collect();
    fs::write(at.join("fresh.csv"), made.clone() + &copies).unwrap();
    let copied = " of 400 sequences are copies, value by value, of others under another id";
    says(at, &calibrate, &["\nnote: ", copied]);
}

#[test]
fn what_cannot_be_promised_of_sequences_of_rows_is_refused_with_what_to_do() {
    let at = &three_classes("xgboost-3.4-softprob.ubj");
    succeeds(at, &format!("export {} -o value.palpate", data("xgboost-2.1-squarederror.ubj")));
    let good = &sequences(at, 240, 0);
    let few = "240 sequences are too few to promise 1 %: at least 299 are needed … As many support 1.3 % at best";
    let all = "model.palpate --sequence-column id";
    for (text, more, code, expected) in [
        (good.clone(), all, 1, few),
        (good.clone(), "model.palpate", 2, "--sequence-column"),
        (good.clone(), "value.palpate --sequence-column id", 1, "predicts a value"),
    ] {
        fs::write(at.join("fresh.csv"), text).unwrap();
        let (model, more) = more.split_once(' ').unwrap_or((more, ""));
        fails(at, &format!("rows calibrate {model} fresh.csv -o no.palpate --label kind {more}"), code, expected);
        assert!(!at.join("no.palpate").exists());
    }
}

/// A directory, and a file's path in it.
fn place() -> (Folder, impl Fn(&str) -> String) {
    let directory = Folder::new();
    let root = directory.to_path_buf();
    (directory, move |name: &str| root.join(name).to_str().unwrap().to_owned())
}

#[test]
fn a_model_is_proved_for_every_row_or_what_differs_is_said() {
    let (_directory, path) = place();
    let (model, source) = (path("model.palpate"), data("xgboost-3.4-binary.json"));
    stdout(run(["export", &source, "-o", &model]));
    let proved = json(run(["verify", &model, &source, "--prove", "--json"]));
    let number = |key: &str| proved[key].as_f64().unwrap();
    assert_eq!(proved["ensemble_trees"], 3, "{proved}");
    assert!(number("margin_error") <= number("stated"), "{proved}");
    let text = stdout(run(["verify", &model, &source, "--prove"]));
    assert!(text.starts_with("Proved: on every possible row the model's"), "{text}");
    // Another missing number, in the rows as in the proof.
    let other = path("missing.palpate");
    stdout(run(["export", &source, "-o", &other, "--missing=-999"]));
    for arguments in [&data("xgboost-3.4-binary.csv"), "--prove"] {
        let message = stderr(run(["verify", &other, &source, arguments]), 1);
        assert!(message.contains("NaN and -999") && message.contains("NaN alone"), "{message}");
    }
    let message = stderr(run(["verify", &model, &data("xgboost-3.4-softprob.ubj"), "--prove"]), 1);
    assert!(message.contains("model.palpate: the model's outputs are not the ensemble's"), "{message}");
    stderr(run(["verify", &model, &source]), 2);
    // Trees that are code are neither proved nor taken for data.
    for emit in ["c-code", "rust-code"] {
        stdout(run(["export", &source, "-o", &model, "--emit", emit]));
        let message = stderr(run(["verify", &model, &source, "--prove"]), 1);
        assert!(message.contains("export the model without --emit"), "{message}");
    }
    let message = stderr(run(["export", &source, "-o", &model, "--emit", "c,rust-code"]), 2);
    assert!(message.contains("each in a run of its own"), "{message}");
}
