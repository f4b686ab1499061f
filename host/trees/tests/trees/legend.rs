//! Rows and classes as the source code of a model explains them.

use crate::calls::printed;
use crate::fixtures::{directory, fixture};
use palpate_base::with;
use palpate_onboard::C_HEADER;
use palpate_trees::compile::{Language, Settings, compile};
use palpate_trees::ensemble::import::{Options, read};
use palpate_trees::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// Names that end comments, splice lines, hide text, are words of the language, or are the same once only letters are left.
const HARD: [&str; 20] = [
    "bowl",
    "Bowl",
    "a b",
    "a_b",
    "a-b",
    "a b 2",
    "int",
    "3d",
    "größe",
    "ключ",
    "чаша",
    "\"quoted\"",
    "end */ #error \"ended\" /*",
    "**//",
    "trigraph??/",
    "splice\\",
    "hidden \u{202e}text\u{2066}",
    "line\u{2028}end",
    "// -- //",
    "features",
];

/// A class for each row from 0 on, by its first feature.
fn ensemble(features: &[&str], objects: &[&str]) -> Ensemble {
    let count = objects.len();
    let tree = |object: usize| Tree {
        nodes: vec![
            Node::Split { feature: 0, threshold: object as f32, missing_left: true, left: 1, right: 2 },
            Node::Leaf(vec![0.0; count]),
            Node::Leaf((0..count).map(|own| f32::from(u8::from(own == object))).collect()),
        ],
        output: Output::Each,
    };
    Ensemble {
        inputs: Inputs::Rows(features.iter().map(ToString::to_string).collect()),
        objects: objects.iter().map(ToString::to_string).collect(),
        base_margins: vec![0.0; count],
        // Each adds the same: the last class that is reached adds it twice.
        trees: (0..count).flat_map(|object| vec![tree(object); object + 1]).collect(),
        origin: Provenance::default(),
    }
}

/// The source code of an ensemble, as data or as code.
fn source(ensemble: &Ensemble, language: Language, code: bool) -> String {
    let compiled = compile(ensemble, &with!(Settings::default(), code)).unwrap();
    compiled.sources("m", &[language]).unwrap().remove(0).1
}

/// Constants of classes in a source, and the number of each.
fn constants(source: &str, before: &str) -> BTreeMap<String, usize> {
    let constant = |line: &str| {
        let (name, number) = line.trim().strip_prefix(before)?.split_once('=')?;
        let name = name.split(':').next()?.trim();
        let number: String = number.trim().chars().take_while(char::is_ascii_digit).collect();
        Some((name.to_owned(), number.parse().ok()?))
    };
    source.lines().filter_map(constant).collect()
}

#[test]
fn hard_names_of_features_and_classes_become_comments_and_constants_that_compile() {
    let hard = ensemble(&HARD, &HARD);
    let directory = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
    put("palpate.h", C_HEADER);
    for code in [false, true] {
        let header = source(&hard, Language::C, code);
        let found = constants(&header, "M_");
        assert_eq!(found.values().copied().collect::<BTreeSet<_>>(), (0..HARD.len()).collect());
        let is_plain =
            |name: &String| name.bytes().all(|byte| byte.is_ascii_uppercase() || byte.is_ascii_digit() || byte == b'_');
        assert!(
            found.keys().all(|name| name.starts_with("CLASS_") && is_plain(name) && !name.contains("__")),
            "{found:?}"
        );
        for (name, index) in
            [("BOWL", 0), ("BOWL_2", 1), ("A_B", 2), ("A_B_2", 3), ("A_B_3", 4), ("A_B_2_2", 5), ("9", 9), ("INT", 6)]
        {
            assert_eq!(found.get(&format!("CLASS_{name}")), Some(&index), "{found:?}");
        }
        put("m.h", &header);
        // Every constant is what the model predicts for its row.
        let mut calls = "    float row[M_FEATURES] = {0};\n    printf(\"%d\\n\", M_FEATURES);\n".to_owned();
        for (name, index) in &found {
            calls += &format!("    row[0] = {index}.0f;\n    printf(\"%d\\n\", m_predict(row) == M_{name});\n");
        }
        let text = printed(directory.path(), "#include \"m.h\"\n", &calls, &[]);
        assert_eq!(text, format!("{}\n{}", HARD.len(), "1\n".repeat(HARD.len())));
        // C++ and Rust compile it, too; Rust refuses text that is shown in another order.
        put("m.cpp", "#include \"m.h\"\nint main() { return M_CLASS_BOWL; }\n");
        let mut cpp = Command::new(std::env::var("CXX").unwrap_or_else(|_| "c++".into()));
        cpp.args([
            "-std=c++11",
            "-Wall",
            "-Wextra",
            "-pedantic",
            "-Werror",
            "-Wno-unused-function",
            "-fsyntax-only",
            "m.cpp",
        ]);
        succeed(cpp, directory.path());
        let text = source(&hard, Language::Rust, code);
        let of_rust = constants(&text, if code { "pub const " } else { "pub const M_" });
        assert!(found.iter().all(|(name, index)| of_rust.get(name) == Some(index)), "{of_rust:?}");
        put("m.rs", &text);
        let aligned =
            "#![allow(dead_code)]\nextern crate self as palpate_onboard;\npub struct Aligned<T>(pub T);\nmod m;\n";
        put("main.rs", &format!("{aligned}fn main() {{}}\n"));
        let mut rust = Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into()));
        rust.args(["--edition", "2024", "-D", "warnings", "--emit", "metadata", "main.rs"]);
        succeed(rust, directory.path());
    }
}

fn succeed(mut command: Command, directory: &Path) {
    let output = command.current_dir(directory).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn labels_that_are_numbers_are_a_table_by_the_index_that_a_call_gives() {
    let labels = ["0", "2", "3", "-4", "50000"];
    let numbered = ensemble(&["width"], &labels);
    let directory = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
    put("palpate.h", C_HEADER);
    for code in [false, true] {
        let header = source(&numbered, Language::C, code);
        assert!(header.contains("The class (the index in: 0, 2, 3, -4, 50000) of a row of 1 features"), "{header}");
        put("m.h", &header);
        let calls = "    float row[M_FEATURES];\n    int i;\n    for (i = 0; i < 5; i++) {\n        row[0] = (float)i;\n        \
                     printf(\"%ld\\n\", (long)m_labels[m_predict(row)]);\n    }\n";
        let text = printed(directory.path(), "#include \"m.h\"\n", calls, &[]);
        assert_eq!(text.lines().collect::<Vec<_>>(), labels);
        assert!(source(&numbered, Language::Rust, code).contains("LABELS: [i32; 5] = [0, 2, 3, -4, 50000];"));
    }
    // Other spellings are words.
    for other in ["007", "+3", "1.0", " 1", "-0", "2147483648", "-2147483648"] {
        let header = source(&ensemble(&["width"], &["0", other]), Language::C, false);
        assert!(header.contains("M_CLASS_0 = 0") && !header.contains("m_labels"), "{other}");
    }
}

#[test]
fn a_row_of_some_columns_says_which_and_that_the_others_are_not_in_it() {
    let file = fixture("xgboost-3.2-binary");
    let text = std::fs::read_to_string(&file.path).unwrap();
    let names: Vec<String> = (0..300).map(|column| format!("\"c{column}\"")).collect();
    let (head, rest) = text.split_once("\"feature_names\":[").unwrap();
    let rest = rest.split_once(']').unwrap().1.replace("\"num_feature\":\"4\"", "\"num_feature\":\"300\"");
    let head = head.replace("\"num_feature\":\"4\"", "\"num_feature\":\"300\"");
    let wide = format!("{head}\"feature_names\":[{}]{rest}", names.join(","));
    let ensemble = read(Path::new("wide.json"), wide.as_bytes(), &Options::default()).unwrap();
    let used = ensemble.inputs.count();
    for (language, comment) in [(Language::C, " * "), (Language::Rust, "/// ")] {
        let text = source(&ensemble, language, false);
        for (feature, name) in ensemble.inputs.names().iter().enumerate() {
            let line = format!("{comment}row[{feature}] = {name} (column {});", &name[1..]);
            assert!(text.contains(&line), "{line}");
        }
        let others = format!("The other {} of the library's 300 columns are not in a row.", 300 - used);
        assert!(text.contains(&others) && used < 300, "{used}");
        // Rows with all columns of the training have nothing to say.
        assert!(!source(&file.ensemble, language, false).contains("are not in a row"));
    }
    // A chip measures in whole numbers, and whoever follows a sequence counts its rows.
    let scales = Some([vec![100.0], vec![1.0; file.rows.features - 1]].concat());
    let position = Some(file.ensemble.inputs.names()[1].to_owned());
    let compiled = compile(&file.ensemble, &with!(Settings::default(), scales, position)).unwrap();
    let header = compiled.sources("m", &[Language::C]).unwrap().remove(0).1;
    let first = file.ensemble.inputs.names()[0];
    assert!(header.contains(&format!("row[0] = {first} times 100;")), "{header}");
    assert!(header.contains("row[1] is the number of a row in its sequence"), "{header}");
}

#[test]
fn the_numbers_of_categories_are_named_where_the_file_names_them() {
    let of = |name: &str, change: &dyn Fn(String) -> String| {
        let path = directory().join(name);
        let text = change(std::fs::read_to_string(&path).unwrap());
        source(&read(&path, text.as_bytes(), &Options::default()).unwrap(), Language::C, false)
    };
    let words: Vec<String> = (0..20).map(|number| format!("\"k{number}\"")).collect();
    let words = words.join(", ").replace("k3", "*/ k3");
    let lightgbm = |lines: String| {
        let text = of("lightgbm-4.7-categorical.txt", &|text| format!("{text}\nparameters:\n{lines}\n"));
        text.lines().find(|line| line.contains("row[2] = count")).unwrap().to_owned()
    };
    let line = lightgbm(format!("[categorical_feature: 2]\nend of parameters\n\npandas_categorical:[[{words}]]"));
    assert!(line.contains(": 0 k0, 1 k1, 2 k2, 3 * / k3, 4 k4,") && line.ends_with("19 k19;"), "{line}");
    // Other values are as the file has them.
    let numbers: Vec<String> = (0..20).map(|number| (number * 5).to_string()).collect();
    let line = lightgbm(format!("[categorical_feature: 2]\n\npandas_categorical:[[{}]]", numbers.join(",")));
    assert!(line.contains(": 0 0, 1 5, 2 10"), "{line}");
    // Lists that may be of other columns, or have too few names, say nothing.
    for lines in [
        format!("[categorical_feature: 2]\npandas_categorical:[[\"low\"], [{words}]]"),
        format!("[categorical_feature: 1]\npandas_categorical:[[{words}]]"),
        "[categorical_feature: 2]\npandas_categorical:[[\"a\", \"b\"]]".into(),
        "[categorical_feature: 2]\npandas_categorical:null".into(),
        "[categorical_feature: 2]\npandas_categorical:[[".into(),
    ] {
        let line = lightgbm(lines);
        assert!(line.ends_with(';') && !line.contains(": 0"), "{line}");
    }
    let xgboost = |cats: &str| {
        of("xgboost-3.2-categorical.json", &|text| {
            let (start, rest) = text.split_once("\"cats\":").unwrap();
            let rest = rest.split_once('}').unwrap().1;
            format!("{start}\"cats\":{cats}{rest}")
        })
    };
    let named = r#"{"enc":[{"offsets":[],"values":[]},{"type":15,"values":[5,7]},{"offsets":[0,4,7],"values":[98,108,117,101,114,101,100]}]}"#;
    let text = xgboost(named);
    assert!(text.contains(": 0 5, 1 7;") && text.contains(": 0 blue, 1 red;"), "{text}");
    // Another form of them is no reason to refuse the model.
    let not_ascii = r#"{"enc":[{"offsets":[0,3],"values":[98,108,-61]}]}"#;
    for cats in [not_ascii, r#"{"enc":3}"#, "[1, 2]", r#"{"enc":[{"offsets":[9,4,99],"values":[1]}]}"#, "null"] {
        let text = xgboost(cats);
        assert!(text.lines().all(|line| !(line.contains("row[") && line.contains(": 0"))), "{cats}");
    }
}
