//! Functions in C that `palpate export` writes with a model, against the libraries that trained it.

use crate::fixtures::{Fixture, fixture};
use palpate_base::with;
use palpate_onboard::{C_HEADER, Model, Recognizer, Refused, RowsSeen, Stopping, Verdict};
use palpate_shared::format::{Limits, Tag};
use palpate_trees::compile::{Language, Leaf, Restated, Settings, compile, emit, restate};
use palpate_trees::ensemble::Probability;
use palpate_trees::rows::Encoder;
use palpate_trees::verify::predict::{Predicted, predict};
use std::path::Path;
use std::process::Command;

/// Rows as C initializers: with an encoder as the whole numbers that it makes of them.
pub(crate) fn initializers(rows: &[Vec<f64>], whole: Option<&Encoder>) -> String {
    let cell = |value: f64| match value {
        value if value.is_nan() => "NAN".to_owned(),
        value if value.is_infinite() => format!("{}INFINITY", if value < 0.0 { "-" } else { "" }),
        value => format!("{:e}f", value as f32),
    };
    let key = |key: i32| if key == i32::MIN { "INT32_MIN".to_owned() } else { key.to_string() };
    let cells = |row: &Vec<f64>| -> Vec<String> {
        match whole {
            Some(encoder) => encoder.row(row).into_iter().map(key).collect(),
            None => row.iter().copied().map(cell).collect(),
        }
    };
    rows.iter().map(|row| format!("{{{}}}", cells(row).join(","))).collect::<Vec<_>>().join(",")
}

/// Output of a C program with these functions and calls, built beside the headers in `directory` with warnings denied.
pub(crate) fn printed(directory: &Path, functions: &str, calls: &str, macros: &[&str]) -> String {
    let source =
        format!("#include <math.h>\n#include <stdio.h>\n{functions}int main(void)\n{{\n{calls}    return 0;\n}}\n");
    std::fs::write(directory.join("program.c"), source).unwrap();
    let program = directory.join("program");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let mut command = Command::new(compiler);
    command.args(["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-O1"]);
    command.args(macros.iter().map(|macros| format!("-DPALPATE_{macros}"))).arg("program.c").arg("-o").arg(&program);
    let built = command.current_dir(directory).output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    String::from_utf8(Command::new(&program).output().unwrap().stdout).unwrap()
}

/// Models of every library and kind of prediction.
const CALLED: [&str; 16] = [
    "xgboost-3.4-softmax",
    "xgboost-3.4-binary",
    "xgboost-3.2-hinge",
    "xgboost-3.2-missing-0",
    "xgboost-3.2-targets-vector",
    "xgboost-3.2-reg-logistic",
    "lightgbm-4.7-binary",
    "lightgbm-4.7-multiclassova",
    "lightgbm-4.7-forest-multiclass",
    "lightgbm-4.7-forest-gamma",
    "lightgbm-4.7-categorical-zero-as-missing",
    "catboost-1.2-multiclass",
    "catboost-1.2-onevsall",
    "catboost-1.2-tweedie",
    "sklearn-1.9-forest",
    "sklearn-1.9-forest-binary",
];

#[test]
fn a_call_gives_the_class_value_and_probabilities_with_nothing_prepared() {
    let directory = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
    put("palpate.h", C_HEADER);
    let (mut functions, mut calls, mut expected) = (String::new(), String::new(), Vec::new());
    let forms = [("f32", Leaf::F32), ("i16", Leaf::I16), ("whole", Leaf::I16), ("code", Leaf::I16)];
    for (number, file) in CALLED.iter().enumerate() {
        let Fixture { ensemble, rows: table, margins, .. } = fixture(file);
        let rows: Vec<Vec<f64>> = table.iter().map(<[f64]>::to_vec).collect();
        let imported = ensemble.origin.imported.as_ref().unwrap();
        let (probability, scale) = (imported.probability, f64::from(imported.prediction.scale));
        let is_class = ensemble.objects.len() > 1 && !imported.prediction.targets;
        for (form, leaf) in forms {
            // Every kind once, and two with everything.
            if number > 1 && ["f32", "i16"][number % 2] == form {
                continue;
            }
            let settings =
                with!(Settings::default(), leaf, scales = (form == "whole").then(|| vec![1000.0; rows[0].len()]));
            let Ok(plain) = compile(ensemble, &settings) else { continue };
            let code = with!(settings.clone(), code = true);
            let code = if form == "code" { compile(ensemble, &code).unwrap() } else { plain.clone() };
            let name = format!("m{number}{form}");
            let header = &code.sources(&name, &[Language::C]).unwrap()[0].1;
            put(&format!("{name}.h"), header);
            let model = Model::new(&plain.bytes).unwrap();
            let is_whole = form == "whole";
            let encoder = Encoder::of(&model);
            let given = initializers(&rows, is_whole.then_some(&encoder));
            let has_posteriors = is_class && probability != Probability::Unknown;
            assert_eq!(header.contains(&format!("{name}_posteriors(")), has_posteriors, "{name}");
            let bound = header.split("probabilities, within ").nth(1).map(|text| text.split(' ').next().unwrap());
            let bound: f64 = bound.map_or(0.0, |text| text.parse().unwrap());
            let outputs = ensemble.objects.len();
            let call = match (is_class, outputs) {
                (false, 1) => format!("v[0] = {name}_value(rows[i]);"),
                (false, _) => format!("{name}_values(rows[i], v);"),
                (true, _) if has_posteriors => {
                    format!("{name}_posteriors(rows[i], v); printf(\"%d \", {name}_predict(rows[i]));")
                }
                (true, _) => format!("printf(\"%d \", {name}_predict(rows[i])); v[0] = 0;"),
            };
            functions += &format!(
                "#include \"{name}.h\"\nstatic void run_{name}(void)\n{{\n    static const {} rows[][{}] = {{{}}};\n    \
                 unsigned i, j;\n    float v[{outputs}] = {{0}};\n    for (i = 0; i < {}; i++) {{\n        {call}\n        \
                 for (j = 0; j < {outputs}; j++) {{\n            printf(\"%.9g \", (double)v[j]);\n        }}\n        \
                 puts(\"\");\n    }}\n}}\n",
                if is_whole { "int32_t" } else { "float" },
                rows[0].len(),
                given,
                rows.len(),
            );
            calls += &format!("    run_{name}();\n");
            let predicted = predict(&model, &table.values, rows[0].len(), false).unwrap();
            for (row, margins) in margins.iter().enumerate() {
                let own = match &predicted {
                    Predicted::Classes(classes) => vec![classes[row] as f64],
                    Predicted::Values(values) => {
                        values[outputs * row..outputs * (row + 1)].iter().map(|&value| f64::from(value)).collect()
                    }
                };
                // A binary model has one column in the file: the score of its second class, or its share.
                let other = if probability == Probability::Shares { 1.0 - margins[0] } else { 0.0 };
                let first = vec![other; outputs - margins.len()];
                // Shares are the library's own; all else is in nats.
                let unit = if probability == Probability::Shares { 1.0 } else { scale };
                let own_margins: Vec<f64> = first.iter().chain(margins).map(|margin| margin / unit).collect();
                let shares =
                    if has_posteriors && !is_whole { probability.of(&own_margins).unwrap() } else { Vec::new() };
                expected.push((format!("{name}, row {row}"), own, shares, bound));
            }
        }
    }
    let wide = ["LAYOUTS=127", "LEAVES=7", "SENTINEL=1", "SHARED=1", "MAX_OBJECTS=32"];
    let text = printed(directory.path(), &functions, &calls, &wide);
    assert_eq!(text.lines().count(), expected.len());
    let mut worst = 0.0_f64;
    for (line, (name, own, shares, bound)) in text.lines().zip(&expected) {
        let found: Vec<f64> = line.split_whitespace().map(|number| number.parse().unwrap()).collect();
        let same = |(found, own): (&f64, &f64)| (*found as f32).to_bits() == (*own as f32).to_bits();
        assert!(found.iter().zip(own).all(same), "{name}: {line}, not {own:?}");
        for (found, share) in found[1..].iter().zip(shares) {
            assert!((found - share).abs() <= *bound, "{name}: {line}, not {shares:?} within {bound}");
            worst = worst.max((found - share).abs() / bound);
        }
    }
    assert!(expected.len() > 2000 && worst > 0.1, "{} rows, at most {worst} of the bound", expected.len());
}

/// Limits that some rows break: the lower half of each feature's range, present, at most two rows the same.
fn limits(encoder: &Encoder, rows: &[Vec<f64>], position: usize) -> Vec<u8> {
    let of = |feature: usize| {
        let mut values: Vec<i32> =
            rows.iter().map(|row| encoder.row(row)[feature]).filter(|key| *key != i32::MIN).collect();
        values.sort_unstable();
        let (low, high) = (values[0], values[values.len() * 9 / 10]);
        if feature == position { Limits::NONE } else { Limits { low, high, may_miss: feature == 1, most_equal: 2 } }
    };
    (0..rows[0].len()).flat_map(|feature| of(feature).to_bytes()).collect()
}

#[test]
fn rows_of_a_sequence_are_numbered_and_refused_by_the_same_bits_as_in_rust() {
    const LENGTH: usize = 7;
    let directory = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
    put("palpate.h", C_HEADER);
    let Fixture { ensemble, rows, .. } = fixture("xgboost-3.4-softmax");
    let rows: Vec<Vec<f64>> = rows.iter().map(<[f64]>::to_vec).collect();
    let position = rows[0].len() / 2;
    let name_of_position = ensemble.inputs.names()[position].to_owned();
    let (mut functions, mut calls, mut expected) = (String::new(), String::new(), String::new());
    let mut refused = 0;
    for (form, leaf, is_guarded) in
        [("real", Leaf::I16, false), ("float", Leaf::F32, true), ("whole", Leaf::I16, true), ("code", Leaf::I16, false)]
    {
        let settings = with!(
            Settings::default(),
            leaf,
            scales = (form == "whole").then(|| vec![1000.0; rows[0].len()]),
            position = Some(name_of_position.clone())
        );
        let plain = compile(ensemble, &settings).unwrap();
        let code = with!(settings.clone(), code = true);
        let mut bytes = plain.bytes.clone();
        if is_guarded {
            let model = Model::new(&plain.bytes).unwrap();
            let section = (Tag::Guard, Some((true, limits(&Encoder::of(&model), &rows, position))));
            bytes = restate(&model, &Restated { sections: vec![section], ..Restated::default() }).unwrap();
        }
        let model = Model::new(&bytes).unwrap();
        let name = format!("s{form}");
        let header = match form {
            "code" => compile(ensemble, &code).unwrap().sources(&name, &[Language::C]).unwrap().remove(0).1,
            _ => emit(&model, &name, Language::C),
        };
        put(&format!("{name}.h"), &header);
        let encoder = Encoder::measured(&model);
        let is_whole = form == "whole";
        let measured: Vec<Vec<f64>> = rows
            .iter()
            .enumerate()
            .map(|(number, row)| {
                let mut row = row.clone();
                row.remove(position);
                // A sensor that is stuck for a while.
                row[0] = if number % 20 < 5 { 0.5 } else { row[0] };
                row
            })
            .collect();
        let objects = model.object_count();
        let mut recognizer = Recognizer::<32>::new(&model, Stopping::from_odds(1 << 54, 5)).unwrap();
        let mut seen = RowsSeen::<32>::new();
        for (number, row) in measured.iter().enumerate() {
            if number % LENGTH == 0 {
                recognizer.reset();
                seen.reset();
            }
            let row = encoder.row(row);
            let pushed =
                if is_guarded { recognizer.push_seen(&row, &mut seen) } else { recognizer.push_features(&row) };
            let (answer, feature) = match pushed {
                Err(Refused::Guarded(feature, _)) => (-4, u32::from(feature) + 1),
                Err(other) => panic!("{other}"),
                Ok(Verdict::Recognized { object, .. }) => (i32::from(object), 0),
                Ok(Verdict::Undecided) => (-1, 0),
                Ok(Verdict::Unknown) => (-2, 0),
                Ok(Verdict::GaveUp) => (-3, 0),
            };
            refused += u32::from(answer == -4);
            let evidence = (0..objects).map(|object| recognizer.evidence().get(object).copied().unwrap_or_default());
            let numbers: Vec<String> = evidence.map(|number| number.to_string()).collect();
            expected += &format!("{answer} {feature} {}\n", numbers.join(" "));
        }
        let given = initializers(&measured, is_whole.then_some(&encoder));
        let (seen, argument, refused) = match is_guarded {
            true => (format!("{name}_seen seen;"), ", &seen", "seen.refused"),
            false => (String::new(), "", "0"),
        };
        functions += &format!(
            "#include \"{name}.h\"\nstatic void run_{name}(void)\n{{\n    static const {} rows[][{}] = {{{}}};\n    \
             palpate_recognizer state;\n    {seen}\n    int i, j;\n    for (i = 0; i < {}; i++) {{\n        int answer;\n        \
             if (i % {LENGTH} == 0) {{\n            {name}_begin(&state{argument});\n            \
             state.odds = (uint64_t)1 << 54;\n            state.max_touches = 5;\n            state.by_object = 0;\n        }}\n        \
             answer = {name}_push(&state{argument}, rows[i]);\n        printf(\"%d %d\", answer, (int){refused});\n        \
             for (j = 0; j < {objects}; j++) {{\n            \
             printf(\" %lld\", state.touches == 0 ? 0LL : (long long)state.evidence[j]);\n        }}\n        \
             puts(\"\");\n    }}\n}}\n",
            if is_whole { "int32_t" } else { "float" },
            measured[0].len(),
            given,
            measured.len(),
        );
        calls += &format!("    run_{name}();\n");
    }
    let flags = ["LAYOUTS=127", "LEAVES=7", "SEQUENCES=1", "MAX_OBJECTS=32"];
    let text = printed(directory.path(), &functions, &calls, &flags);
    for (number, (found, expected)) in text.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, expected, "line {number}");
    }
    assert_eq!(text.lines().count(), expected.lines().count());
    assert!(refused > 20 && expected.lines().any(|line| !line.starts_with('-')), "{refused} refused");
}
