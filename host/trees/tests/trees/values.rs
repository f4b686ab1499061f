//! Regressions of targets far from 0 and of different sizes, and features that f32 does not hold, with the libraries' own
//! arithmetic made here: trees are grown on a table of the test's own.

use crate::calls::{initializers, printed};
use crate::fixtures::predicted;
use palpate_base::with;
use palpate_onboard::{C_HEADER, Model};
use palpate_trees::compile::{self, Compiled, Language, Leaf, Settings};
use palpate_trees::ensemble::Ensemble;
use palpate_trees::ensemble::import::{PartTree, Parts};
use palpate_trees::prove::prove;
use palpate_trees::rows::{Encoder, Rows, notes, scales};
use palpate_trees::shared::format::Prediction;
use palpate_trees::verify::predict::{Predicted, predict};
use palpate_trees::verify::{Library, margins, verify};

/// Features of a row.
const FEATURES: usize = 4;
/// Rows that trees are grown on; as many others are predicted.
const ROWS: usize = 400;
const TREES: usize = 60;
/// Share of the predictions' deviation that values may be off, in the root mean square.
const ALLOWED: f64 = 0.002;

/// Numbers from 0 to 1 that look random.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Rows, and what their targets vary by: deviations of about 1.
fn table(rows: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut numbers = Numbers(7);
    let rows: Vec<Vec<f64>> =
        (0..rows).map(|_| (0..FEATURES).map(|_| f64::from((numbers.next() * 6.0 - 3.0) as f32)).collect()).collect();
    let of = |row: &Vec<f64>| (row[0] + (2.0 * row[1]).sin() + 0.5 * row[2] * row[3]) / 2.4 + 0.1 * numbers.next();
    let varied = rows.iter().map(of).collect();
    (rows, varied)
}

/// A way of a library to make and to add trees.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// Leaves of means, over the number of trees.
    Forest,
    /// The mean of the target is in the leaves of the first tree.
    LightGbm,
    /// It is where margins start, in f64.
    Histogram,
    /// Likewise, in shallow trees.
    CatBoost,
    /// It is where margins start, in f32, and all sums are f32.
    XgBoost,
}

const KINDS: [Kind; 5] = [Kind::Forest, Kind::LightGbm, Kind::Histogram, Kind::CatBoost, Kind::XgBoost];

/// Means of targets over some rows.
fn means(targets: &[Vec<f64>], rows: &[usize]) -> Vec<f64> {
    let mean = |of: &Vec<f64>| rows.iter().map(|&row| of[row]).sum::<f64>() / rows.len() as f64;
    targets.iter().map(mean).collect()
}

/// A tree of this depth below some rows: parted at the middle row of a feature.
fn grow(
    rows: &[Vec<f64>],
    targets: &[Vec<f64>],
    own: &mut [usize],
    (depth, feature): (usize, usize),
    tree: &mut PartTree,
) -> usize {
    let at = tree.left.len();
    tree.left.push(-1);
    tree.right.push(-1);
    tree.feature.push(feature as i64);
    tree.threshold.push(0.0);
    tree.missing_left.push(true);
    tree.values.extend(means(targets, own));
    let half = own.len() / 2;
    if depth > 0 && half > 4 {
        own.sort_by(|&a, &b| rows[a][feature].total_cmp(&rows[b][feature]));
        tree.threshold[at] = f64::midpoint(rows[own[half - 1]][feature], rows[own[half]][feature]);
        let (left, right) = own.split_at_mut(half);
        let next = (depth - 1, (feature + 1) % FEATURES);
        tree.left[at] = grow(rows, targets, left, next, tree) as i64;
        tree.right[at] = grow(rows, targets, right, next, tree) as i64;
    }
    at
}

/// The leaf that a row reaches.
fn leaf(tree: &PartTree, row: &[f64]) -> usize {
    let mut at = 0;
    while tree.left[at] >= 0 {
        let is_left = row[tree.feature[at] as usize] <= tree.threshold[at];
        at = (if is_left { tree.left[at] } else { tree.right[at] }) as usize;
    }
    at
}

/// Trees of a library, and what it predicts for the rows that it was not given.
fn trained(kind: Kind, places: &[(f64, f64)]) -> (Ensemble, Rows, Vec<Vec<f64>>) {
    let (rows, varied) = table(2 * ROWS);
    let targets = |&(mean, deviation): &(f64, f64)| varied.iter().map(|own| mean + deviation * own).collect();
    let mut left: Vec<Vec<f64>> = places.iter().map(targets).collect();
    let outputs = places.len();
    let start = means(&left, &(0..ROWS).collect::<Vec<_>>());
    let is_boosted = kind != Kind::Forest;
    if is_boosted {
        left.iter_mut().zip(&start).for_each(|(own, start)| own.iter_mut().for_each(|value| *value -= start));
    }
    let mut numbers = Numbers(3);
    let mut trees = Vec::new();
    for number in 0..TREES {
        let mut own: Vec<usize> = match kind {
            Kind::Forest => (0..ROWS).filter(|_| numbers.next() < 0.6).collect(),
            _ => (0..ROWS).collect(),
        };
        let mut tree = PartTree { output: (outputs == 1).then_some(0), ..PartTree::default() };
        let depth = if kind == Kind::CatBoost { 3 } else { 5 };
        grow(&rows[..ROWS], &left, &mut own, (depth, number % FEATURES), &mut tree);
        let rate = if is_boosted { 0.1 } else { 1.0 / TREES as f64 };
        tree.values.iter_mut().for_each(|value| *value *= rate);
        if is_boosted {
            for (row, values) in rows.iter().enumerate() {
                let leaf = leaf(&tree, values);
                (0..outputs).for_each(|output| left[output][row] -= tree.values[leaf * outputs + output]);
            }
        }
        if kind == Kind::LightGbm && number == 0 {
            tree.values.iter_mut().enumerate().for_each(|(at, value)| *value += start[at % outputs]);
        }
        trees.push(tree);
    }
    let starts_at_0 = matches!(kind, Kind::Forest | Kind::LightGbm);
    let base = if starts_at_0 { vec![0.0; outputs] } else { start };
    let add = |row: &Vec<f64>| -> Vec<f64> {
        let mut sums = base.clone();
        for tree in &trees {
            let leaf = leaf(tree, row);
            sums.iter_mut().zip(&tree.values[leaf * outputs..]).for_each(|(sum, value)| *sum += value);
        }
        sums
    };
    let own = &rows[ROWS..];
    let mut said: Vec<Vec<f64>> = own.iter().map(add).collect();
    let parts = Parts {
        kind: format!("{kind:?}"),
        features: vec![String::new(); FEATURES],
        base,
        trees,
        prediction: Prediction { targets: outputs > 1, ..Prediction::default() },
        compares_f64: matches!(kind, Kind::LightGbm | Kind::Histogram),
        ..Parts::default()
    };
    let mut ensemble = parts.into_ensemble(None).unwrap();
    if kind == Kind::XgBoost {
        let imported = ensemble.origin.imported.as_mut().unwrap();
        (imported.exact, imported.rounding) = (None, 0.0);
        let in_f32 = |row: &Vec<f64>| {
            let row: Vec<f32> = row.iter().map(|&value| value as f32).collect();
            ensemble.margins_of_features(&row).into_iter().map(f64::from).collect()
        };
        said = own.iter().map(in_f32).collect();
    }
    let rows = Rows { features: FEATURES, values: own.concat(), labels: Vec::new(), by_position: false };
    (ensemble, rows, said)
}

fn compiled(ensemble: &Ensemble, leaf: Leaf) -> Compiled {
    compile::compile(ensemble, &with!(Settings::default(), leaf)).unwrap()
}

/// Values as a chip gives them, and as its margins have them in f64, row by row.
fn own(model: &Model<'_>, rows: &Rows) -> (Vec<f32>, Vec<f64>) {
    let predicted = predict(model, &rows.values, FEATURES, false).unwrap();
    let Predicted::Values(values) = predicted else { panic!("values") };
    let in_f64 = rows.values.chunks(FEATURES).flat_map(|row| margins(model, &Encoder::of(model).row(row)));
    (values, in_f64.collect())
}

/// The root of the mean square of numbers.
fn root_mean_square(numbers: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = numbers.clone().count() as f64;
    (numbers.map(|number| number * number).sum::<f64>() / count).sqrt()
}

/// For each target the differences of values and of margins to the library's, and a step of f32, in shares of the predictions'
/// deviation.
fn differences(model: &Model<'_>, rows: &Rows, said: &[Vec<f64>]) -> Vec<[f64; 3]> {
    let ((values, in_f64), outputs) = (own(model, rows), said[0].len());
    let of_output = |output: usize| {
        let said = || said.iter().map(|said| said[output]);
        let mean = said().sum::<f64>() / ROWS as f64;
        let deviation = root_mean_square(said().map(|said| said - mean));
        let own = || values.iter().skip(output).step_by(outputs).map(|&value| f64::from(value));
        let in_f64 = || in_f64.iter().skip(output).step_by(outputs).copied();
        let value = root_mean_square(own().zip(said()).map(|(own, said)| own - said));
        let margin = root_mean_square(in_f64().zip(said()).map(|(own, said)| own - said));
        [value, margin, f64::from((mean as f32).next_up() - mean as f32)].map(|number| number / deviation)
    };
    (0..outputs).map(of_output).collect()
}

/// Targets: their means, and what they vary by.
const PLACES: [&[(f64, f64)]; 8] = [
    &[(0.0, 1.0)],
    &[(0.5, 1e-4)],
    &[(101_325.0, 3.0)],
    &[(2024.0, 1.0)],
    &[(273.0, 2.0)],
    &[(1.7e9, 3600.0)],
    &[(-3e-9, 1e-12)],
    &[(20.0, 5.0), (101_325.0, 300.0), (0.5, 0.1)],
];

#[test]
fn values_of_targets_far_from_0_and_of_different_sizes_stay_the_librarys() {
    let mut noted = 0;
    for kind in KINDS {
        for places in PLACES {
            let (ensemble, rows, said) = trained(kind, places);
            for leaf in [Leaf::I16, Leaf::I8] {
                let compiled = compiled(&ensemble, leaf);
                let model = Model::new(&compiled.bytes).unwrap();
                let name = format!("{kind:?}, {places:?}, {leaf:?}");
                prove(&compiled.bytes, &ensemble).unwrap_or_else(|error| panic!("{name}: {error}"));
                for (output, [value, margin, step]) in differences(&model, &rows, &said).into_iter().enumerate() {
                    println!("{name} {output}: {value:.5}, without f32 {margin:.5}, a step {step:.5}");
                    // An even distribution over a step.
                    let of_f32 = 1.1 * step / 12.0_f64.sqrt();
                    let is_close = margin <= ALLOWED && value <= margin.hypot(of_f32) + ALLOWED;
                    let is_noted = compiled.notes.iter().any(|note| note.contains("are only known"));
                    assert!(is_close || is_noted, "{name} {output}: {value}, {margin}, {step}");
                    assert!(is_close || leaf == Leaf::I8 || kind == Kind::XgBoost, "{name} {output}");
                    // A library that adds f32 loses more than leaves of i16, and its own bits are to be had.
                    let advises =
                        compiled.notes.iter().any(|note| note.contains("and leaves of f32 give its own values"));
                    assert_eq!(advises && leaf == Leaf::I16, is_noted && leaf == Leaf::I16, "{:?}", compiled.notes);
                    noted += usize::from(is_noted && leaf == Leaf::I16);
                    let is_coarse = compiled.notes.iter().any(|note| note.contains("_without_offset"));
                    // At 101325 it depends on the trees.
                    if places.iter().all(|(mean, _)| *mean != 101_325.0) {
                        assert_eq!(is_coarse, places[0].0 == 1.7e9, "{name}: {:?}", compiled.notes);
                    }
                }
                let texts: Vec<Vec<String>> =
                    said.iter().map(|row| row.iter().map(ToString::to_string).collect()).collect();
                let library = Library { margins: Some(&said), values: Some(&texts) };
                let verified = verify(&model, &ensemble, &rows, library, &()).unwrap();
                assert!(verified.max_margin_error <= verified.stated_bound, "{name}: {verified:?}");
                if compiled.notes.iter().all(|note| !note.contains("are only known")) {
                    verified.check().unwrap_or_else(|problem| panic!("{name}: {problem}"));
                }
            }
            let compiled = compiled(&ensemble, Leaf::F32);
            let full = predicted(&ensemble, &rows.values);
            let model = Model::new(&compiled.bytes).unwrap();
            assert_eq!(predict(&model, &rows.values, FEATURES, false).unwrap(), full, "{kind:?}");
            assert_eq!(model.output_scale(0), None);
            assert!(kind != Kind::XgBoost || !compiled.notes.iter().any(|note| note.contains("are only known")));
            prove(&compiled.bytes, &ensemble).unwrap();
        }
    }
    assert!((1..=6).contains(&noted), "{noted} models of i16 with a note");
}

#[test]
fn a_bound_that_is_large_against_the_trees_explains_no_difference() {
    let (ensemble, rows, said) = trained(Kind::XgBoost, &[(1.7e9, 3600.0)]);
    let compiled = compiled(&ensemble, Leaf::I16);
    let model = Model::new(&compiled.bytes).unwrap();
    let texts: Vec<Vec<String>> = said.iter().map(|row| vec![row[0].to_string()]).collect();
    let library = Library { margins: None, values: Some(&texts) };
    let verified = verify(&model, &ensemble, &rows, library, &()).unwrap();
    assert!(verified.library_max_value_error.unwrap() < verified.stated_bound, "{verified:?}");
    let problem = verified.check().unwrap_err().to_string();
    assert!(problem.contains("a thousandth of what its trees add up to"), "{problem}");
}

#[test]
fn offsets_are_added_in_c_by_the_same_bits_and_left_out_where_that_is_asked_for() {
    let directory = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
    put("palpate.h", C_HEADER);
    let (mut functions, mut calls, mut expected) = (String::new(), String::new(), Vec::new());
    for (number, (kind, places, code)) in [
        (Kind::LightGbm, PLACES[5], false),
        (Kind::Forest, PLACES[2], true),
        (Kind::Forest, PLACES[7], false),
        (Kind::XgBoost, PLACES[7], true),
    ]
    .into_iter()
    .enumerate()
    {
        let (ensemble, rows, _) = trained(kind, places);
        let plain = compiled(&ensemble, Leaf::I16);
        let name = format!("v{number}");
        let written = compile::compile(&ensemble, &with!(Settings::default(), code)).unwrap();
        let header = written.sources(&name, &[Language::C]).unwrap().remove(0).1;
        put(&format!("{name}.h"), &header);
        let model = Model::new(&plain.bytes).unwrap();
        let ((values, _), outputs) = (own(&model, &rows), places.len());
        let table: Vec<Vec<f64>> = rows.values.chunks(FEATURES).map(<[f64]>::to_vec).collect();
        let [whole, without] = ["", "_without_offset"].map(|end| match outputs {
            1 => format!("v[0] = {name}_value{end}(rows[i]);"),
            _ => format!("{name}_values{end}(rows[i], v);"),
        });
        let print = format!("for (j = 0; j < {outputs}; j++) {{ printf(\"%.9g \", (double)v[j]); }}");
        functions += &format!(
            "#include \"{name}.h\"\nstatic void run_{name}(void)\n{{\n    static const float rows[][{FEATURES}] = {{{}}};\n    \
             unsigned i, j;\n    float v[{outputs}];\n    for (i = 0; i < {ROWS}; i++) {{\n        {whole} {print}\n        \
             {without} {print}\n        puts(\"\");\n    }}\n}}\n",
            initializers(&table, None),
        );
        calls += &format!("    run_{name}();\n");
        let scales: Vec<_> = (0..outputs).map(|output| model.output_scale(output).unwrap()).collect();
        for (row, values) in table.iter().zip(values.chunks(outputs)) {
            let mut units = vec![0; outputs];
            model.margins_of(&Encoder::of(&model).row(row), &mut units);
            let less = units.iter().zip(&scales).map(|(&units, own)| units as f32 * (model.unit() * own.scale));
            expected.push(values.iter().copied().chain(less).collect::<Vec<f32>>());
        }
    }
    let wide = ["LAYOUTS=127", "LEAVES=7", "SHARED=1", "MAX_OBJECTS=4"];
    let text = printed(directory.path(), &functions, &calls, &wide);
    assert_eq!(text.lines().count(), expected.len());
    for (line, expected) in text.lines().zip(&expected) {
        let found: Vec<f32> = line.split_whitespace().map(|number| number.parse().unwrap()).collect();
        assert_eq!(&found, expected);
    }
}

/// Stumps of one feature at thresholds that are evenly distributed between two ends.
fn stumps(count: usize, [low, high]: [f64; 2], compares_f64: bool, is_whole: bool) -> (Ensemble, Rows) {
    let mut numbers = Numbers(5);
    let mut at = || {
        let value = low + (high - low) * numbers.next();
        if is_whole { value.floor() } else { value }
    };
    let tree = |number: usize, at: f64| PartTree {
        output: Some(0),
        left: vec![1, -1, -1],
        right: vec![2, -1, -1],
        feature: vec![0; 3],
        threshold: vec![at + if is_whole { 0.5 } else { 0.0 }; 3],
        missing_left: vec![true; 3],
        values: vec![0.0, 1.0 + number as f64, -1.0],
    };
    let trees = (0..count).map(|number| tree(number, at())).collect();
    let features = vec!["x".to_owned()];
    let parts = Parts { features, base: vec![0.0], trees, compares_f64, ..Parts::default() };
    let values = (0..20_000).map(|_| at()).collect();
    let rows = Rows { features: 1, values, labels: Vec::new(), by_position: false };
    (parts.into_ensemble(None).unwrap(), rows)
}

/// The share of rows that reach another leaf than in f64.
fn share_of(ensemble: &Ensemble, rows: &Rows, scales: Option<Vec<f32>>) -> f64 {
    let bytes = compile::compile(ensemble, &with!(Settings::default(), scales)).unwrap().bytes;
    let model = Model::new(&bytes).unwrap();
    let other = rows.iter().filter(|row| {
        let rows = Rows { values: row.to_vec(), labels: Vec::new(), ..*rows };
        let verified = verify(&model, ensemble, &rows, Library::default(), &()).unwrap();
        verified.scaling.is_some_and(|(change, _)| change > 0.0)
    });
    other.count() as f64 / rows.len() as f64
}

#[test]
fn a_note_says_how_many_rows_f32_sends_another_way_than_a_library_that_compares_f64() {
    // Seconds since 1970 within three days, a counter beyond 2^24, degrees within 5 m and within 100 m.
    for (ends, is_whole, scale) in [
        ([1.7e9, 1.7e9 + 259_200.0], true, 1.0),
        ([1e8, 1e8 + 20_000.0], true, 1.0),
        ([47.37, 47.37 + 5e-5], false, 1e7),
        ([47.37, 47.37 + 1e-3], false, 1e7),
    ] {
        let (ensemble, rows) = stumps(40, ends, true, is_whole);
        let [note] = &notes(&ensemble, None)[..] else { panic!("{ends:?}: {:?}", notes(&ensemble, None)) };
        assert!(note.contains("stay different in f32") && note.contains(&format!("--scale x={scale}")), "{note}");
        let [single] = &scales::singles(&ensemble)[..] else { panic!("{ends:?}") };
        let few = Rows { values: rows.values[..2000].to_vec(), labels: Vec::new(), ..rows };
        let other = share_of(&ensemble, &few, None);
        assert!((single.share / 5.0..=single.share * 1.5).contains(&other), "{ends:?}: {other}, not {}", single.share);
        assert!(share_of(&ensemble, &few, single.scale.map(|scale| vec![scale])) <= other / 10.0, "{ends:?}");
        // A library that rounds rows to f32 first, as scikit-learn's forests, XGBoost and CatBoost do.
        let (ensemble, _) = stumps(40, ends, false, is_whole);
        assert_eq!(notes(&ensemble, None), Vec::<String>::new(), "{ends:?}");
    }
    // Halfway between values that are f32 themselves.
    let (mut ensemble, _) = stumps(40, [1.7e9, 1.7e9 + 259_200.0], true, true);
    for own in ensemble.origin.imported.as_mut().unwrap().thresholds.iter_mut().flatten() {
        own.value = f64::midpoint(f64::from(own.value as f32), f64::from((own.value as f32).next_up()));
    }
    assert_eq!(notes(&ensemble, None), Vec::<String>::new());
    // Ordinary numbers, many thresholds; and a counter that is spread far.
    for (ends, is_whole) in [([-3.0, 3.0], false), ([0.0, 6e8], true), ([0.0, 5000.0], true)] {
        let (ensemble, _) = stumps(3000, ends, true, is_whole);
        assert_eq!(notes(&ensemble, None), Vec::<String>::new(), "{ends:?}");
    }
}
