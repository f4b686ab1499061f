//! Code against the layouts of data: to the bit, on this machine and on emulated chips.

use super::super::groups::groups_and_splits;
use super::super::{Leaf, Settings, compile, open};
use super::{Chip, Form, Program};
use crate::compile::{Compiled, EarlyExit, Language, Layout};
use crate::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree, computed};
use crate::rows::Rows;
use palpate_shared::Descriptor;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{Key, f32_key};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Numbers that look random (SplitMix64).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ z >> 31) % most
    }

    fn value(&mut self, largest: f32) -> f32 {
        largest * (self.below(200_001) as f32 / 100_000.0 - 1.0)
    }
}

/// Ensembles that code is written of in different ways.
#[derive(Clone)]
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) ensemble: Ensemble,
    leaf: Leaf,
}

/// Settings of random trees.
struct Random {
    inputs: Inputs,
    objects: usize,
    trees: usize,
    depth: u32,
    /// A value for each object, or for one.
    each: bool,
    /// One leaf in how many is a vote for one object; 0 for none.
    votes: u64,
    largest: f32,
    threshold: fn(&mut Numbers) -> f32,
}

impl Random {
    fn ensemble(&self, seed: u64) -> Ensemble {
        let mut numbers = Numbers(seed);
        let trees = (0..self.trees).map(|_| {
            let output =
                if self.each { Output::Each } else { Output::One(numbers.below(self.objects as u64) as usize) };
            let mut nodes = Vec::new();
            self.node(&mut numbers, &mut nodes, self.depth);
            Tree { nodes, output }
        });
        Ensemble {
            trees: trees.collect(),
            inputs: self.inputs.clone(),
            objects: (0..self.objects).map(|object| format!("object {object}")).collect(),
            base_margins: (0..self.objects).map(|_| numbers.value(0.5)).collect(),
            origin: Provenance::default(),
        }
    }

    fn node(&self, numbers: &mut Numbers, nodes: &mut Vec<Node>, depth: u32) -> usize {
        let index = nodes.len();
        if depth == 0 || numbers.below(8) == 0 {
            let values = if self.each { self.objects } else { 1 };
            let vote = self.votes > 0 && numbers.below(self.votes) != 0;
            let object = numbers.below(values as u64) as usize;
            nodes.push(Node::Leaf(
                (0..values)
                    .map(|index| match (vote, self.votes) {
                        (true, _) => f32::from(u8::from(index == object)) / 128.0,
                        (false, 0) => numbers.value(self.largest),
                        (false, _) => numbers.below(100) as f32 / 16_384.0,
                    })
                    .collect(),
            ));
            return index;
        }
        let feature = numbers.below(self.inputs.count() as u64) as usize;
        let (threshold, missing_left) = ((self.threshold)(numbers), numbers.below(3) > 0);
        nodes.push(Node::Leaf(Vec::new()));
        let left = self.node(numbers, nodes, depth - 1);
        let right = self.node(numbers, nodes, depth - 1);
        nodes[index] = Node::Split { feature, threshold, missing_left, left, right };
        index
    }
}

/// Thresholds of every kind of column, leaves of every kind of sum; and models that other libraries trained.
pub(crate) static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let usual = || random_of(3);
    let positive: fn(&mut Numbers) -> f32 = |numbers| numbers.value(50.0).abs() + 0.25;
    let halves: fn(&mut Numbers) -> f32 = |numbers| (numbers.below(31) as f32 + 1.0) / 2.0;
    let wide: fn(&mut Numbers) -> f32 = |numbers| (numbers.below(60) as f32 + 1.0) * 64.0;
    let after: fn(&mut Numbers) -> f32 = |numbers| (numbers.below(15) as f32 + 0.5).next_up();
    let whole: fn(&mut Numbers) -> f32 = |numbers| numbers.value(50_000.0).round();
    let computed_random = || Random { inputs: computed(Descriptor::Oriented).into(), threshold: whole, ..usual() };
    let random = [
        ("keys", usual()),
        ("ranks", Random { trees: 150, ..usual() }),
        ("positive", Random { threshold: positive, ..usual() }),
        ("halves", Random { threshold: halves, trees: 120, ..usual() }),
        ("steps of 64", Random { threshold: wide, trees: 60, ..usual() }),
        ("at or below", Random { threshold: after, trees: 120, ..usual() }),
        ("many columns", Random { inputs: Inputs::unnamed(90), trees: 300, ..usual() }),
        ("thresholds past 255", Random { inputs: Inputs::unnamed(2), trees: 300, depth: 6, ..usual() }),
        ("deep", Random { trees: 12, depth: 11, ..usual() }),
        ("computed", computed_random()),
        ("computed, vectors", Random { each: true, objects: 10, ..computed_random() }),
        ("vectors of two", Random { each: true, objects: 2, ..usual() }),
        ("vectors of eleven", Random { each: true, objects: 11, ..usual() }),
        ("vectors of seventy", Random { each: true, objects: 70, trees: 10, ..usual() }),
        ("votes", Random { each: true, votes: 4, objects: 10, depth: 7, threshold: after, ..usual() }),
        ("only votes", Random { each: true, votes: u64::MAX, objects: 4, depth: 3, ..usual() }),
        ("one output", Random { objects: 1, ..usual() }),
        ("no split", Random { depth: 0, ..usual() }),
        ("large leaves", Random { largest: 300.0, ..usual() }),
    ];
    let mut cases = Vec::new();
    for (seed, (name, random)) in random.into_iter().enumerate() {
        for leaf in [Leaf::I8, Leaf::I16] {
            let name = format!("{name}, {}", leaf.name());
            cases.push(Case { name, ensemble: random.ensemble(seed as u64), leaf });
        }
    }
    cases.extend(imported());
    cases
});

/// Some of them, which a compiler takes a few seconds for.
fn few() -> Vec<Case> {
    let is_slow = |case: &&Case| {
        ["many columns", "thresholds past", "deep", "seventy"].iter().any(|name| case.name.contains(name))
    };
    CASES.iter().skip(5).step_by(6).filter(|case| !is_slow(case)).cloned().collect()
}

/// Models that other libraries trained.
fn imported() -> Vec<Case> {
    let folder = Path::new(ROOT).join("tests/data/import");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.retain(|path| {
        path.extension().is_some_and(|end| end == "json" || end == "txt" || end == "onnx" || end == "ubj")
    });
    let ensembles = paths.into_iter().filter_map(|path| {
        // Some are there to be refused, or need an option.
        let ensemble = Ensemble::load_with(&path, &Default::default()).ok()?;
        Some((path.file_stem()?.to_str()?.to_owned(), ensemble))
    });
    let cases: Vec<Case> = ensembles.map(|(name, ensemble)| Case { name, ensemble, leaf: Leaf::I16 }).collect();
    assert!(cases.len() > 40, "{}", cases.len());
    cases
}

impl Case {
    fn compiled(&self, form: Option<Form>) -> Compiled {
        self.compiled_with(form, None)
    }

    /// True if it has classes of rows.
    pub(crate) fn has_classes(&self) -> bool {
        self.ensemble.schema().is_none() && self.ensemble.objects.len() > 1
    }

    /// True if assembly of it has leaves that are added two to a register, or row by row.
    pub(crate) fn has_packed_leaves(&self) -> bool {
        let compiled = self.compiled(Some(Form::C));
        let program = program(&compiled);
        program.has_vectors() && program.vote().is_none()
    }

    /// Its model and assembly.
    pub(crate) fn assembly(&self, chip: Chip, early_exit: bool) -> (Vec<u8>, String) {
        let wanted = early_exit.then_some(EarlyExit::Always);
        let compiled = self.compiled_with(Some(Form::Thumb(chip)), wanted);
        let files = compiled.sources("m", &[]).unwrap();
        let text = files.into_iter().find(|file| file.0 == "s").unwrap().1;
        (compiled.bytes, text)
    }

    fn compiled_with(&self, form: Option<Form>, early_exit: Option<EarlyExit>) -> Compiled {
        let layout = if form.is_some() { Some(Layout::Code) } else { None };
        let forms = form.into_iter().collect();
        let settings = Settings { layout, forms, leaf: self.leaf, early_exit, ..Settings::default() };
        let compiled = compile(&self.ensemble, &settings);
        if form.is_some() || self.ensemble.trees.is_empty() {
            return compiled.unwrap_or_else(|error| panic!("{}: {error}", self.name));
        }
        // Tables have other leaves.
        let walked = [Layout::Complete, Layout::Compact, Layout::Wide].into_iter().find_map(|layout| {
            let settings = Settings { layout: Some(layout), leaf: self.leaf, ..Settings::default() };
            compile(&self.ensemble, &settings).ok()
        });
        walked.unwrap_or_else(|| panic!("{} fits no layout", self.name))
    }

    /// Rows on and beside thresholds, with missing values, infinities, zeros of both signs and denormals: as f32 values.
    fn rows(&self, count: usize) -> Vec<Vec<f32>> {
        let features = self.ensemble.inputs.count();
        let is_real = self.ensemble.schema().is_none();
        let mut thresholds: Vec<Vec<f32>> = vec![Vec::new(); features];
        for node in self.ensemble.trees.iter().flat_map(|tree| &tree.nodes) {
            if let Node::Split { feature, threshold, .. } = node {
                thresholds[*feature].push(*threshold);
            }
        }
        let mut numbers = Numbers(7);
        let special =
            [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, f32::from_bits(1), -1e-40, 3e38];
        let mut value = |own: &[f32]| {
            let near = if own.is_empty() { 0.0 } else { own[numbers.below(own.len() as u64) as usize] };
            match numbers.below(12) {
                0 => special[numbers.below(special.len() as u64) as usize],
                1 => f32::NAN,
                2 | 3 => numbers.value(120.0),
                4..=7 => near,
                8 => near.next_down(),
                9 => near.next_up(),
                _ => near + numbers.value(3.0),
            }
        };
        let mut row = || -> Vec<f32> {
            let whole = |value: f32| if is_real || value.is_nan() { value } else { value.clamp(-1e7, 1e7).round() };
            thresholds.iter().map(|own| whole(value(own))).collect()
        };
        let mut rows: Vec<Vec<f32>> = (0..count).map(|_| row()).collect();
        // Zeros of both signs in every column: before them there is nothing on a grid.
        rows[0].fill(-0.0);
        rows[1].fill(0.0);
        rows
    }
}

/// A row as keys, or as whole numbers.
fn keys(row: &[f32], key: Key) -> Vec<i32> {
    let whole = |value: f32| if value.is_nan() { MISSING_FEATURE } else { value as i32 };
    row.iter().map(|&value| if key == Key::Real { f32_key(value) } else { whole(value) }).collect()
}

/// Margins of the layout of data.
fn expected(compiled: &Compiled, rows: &[Vec<i32>]) -> Vec<Vec<i32>> {
    let model = open(&compiled.bytes).unwrap();
    let margins = |row: &Vec<i32>| {
        let mut margins = vec![0; model.object_count()];
        assert!(model.margins_of(row, &mut margins));
        margins
    };
    rows.iter().map(margins).collect()
}

fn program(compiled: &Compiled) -> &Program {
    &compiled.code.as_ref().unwrap().0
}

#[test]
fn programs_give_the_margins_of_the_layouts_of_data_at_every_threshold() {
    for case in CASES.iter() {
        let compiled = case.compiled(Some(Form::C));
        let program = program(&compiled);
        let rows: Vec<Vec<i32>> = case.rows(150).iter().map(|row| keys(row, program.key)).collect();
        let expected = expected(&case.compiled(None), &rows);
        for (row, expected) in rows.iter().zip(expected) {
            assert_eq!(program.margins(row), expected, "{}: {row:?}", case.name);
        }
    }
}

/// Cases whose margins are often equal, and the others that have classes.
fn with_ties() -> Vec<Case> {
    let coarse: fn(&mut Numbers) -> f32 = |numbers| numbers.below(5) as f32;
    let random = |each: bool, objects: usize, seed: u64| {
        let inputs = Inputs::unnamed(4);
        let random = Random { inputs, objects, trees: 30, depth: 3, each, votes: 40, largest: 0.5, threshold: coarse };
        Ensemble { base_margins: vec![0.0; objects], ..random.ensemble(seed) }
    };
    let mut cases: Vec<Case> = [(true, 2), (true, 5), (false, 2), (false, 3), (false, 12)]
        .into_iter()
        .zip(50..)
        .map(|((each, objects), seed)| Case {
            name: format!("ties of {objects}, {each}"),
            ensemble: random(each, objects, seed),
            leaf: Leaf::I16,
        })
        .collect();
    cases.extend(CASES.iter().cloned());
    cases.retain(Case::has_classes);
    cases
}

/// The largest margin less the second largest.
fn lead(margins: &[i32]) -> u32 {
    let mut sorted = margins.to_vec();
    sorted.sort_unstable();
    sorted[sorted.len() - 1].abs_diff(sorted[sorted.len() - 2])
}

/// Rows that are changed, feature by feature, until their largest margins are close to each other.
fn close_rows(case: &Case, program: &Program, count: usize) -> Vec<Vec<i32>> {
    let rows: Vec<Vec<i32>> = case.rows(40).iter().map(|row| keys(row, program.key)).collect();
    let mut numbers = Numbers(11);
    let close = |start: &Vec<i32>| {
        let mut row = start.clone();
        for _ in 0..60 {
            let feature = numbers.below(row.len() as u64) as usize;
            let before = row[feature];
            let was = lead(&program.margins(&row));
            row[feature] = rows[numbers.below(rows.len() as u64) as usize][feature];
            if lead(&program.margins(&row)) > was {
                row[feature] = before;
            }
        }
        row
    };
    rows.iter().take(count).map(close).collect()
}

#[test]
fn walks_that_end_early_give_the_class_of_all_trees_and_the_others_change_no_difference_by_more_than_their_bound() {
    let (mut ended, mut ties, mut walked) = (0, 0, 0);
    for case in with_ties() {
        let compiled = case.compiled_with(Some(Form::C), Some(EarlyExit::Always));
        let program = program(&compiled);
        let plain = case.compiled(None);
        let last_of_ties = open(&plain.bytes).unwrap().prediction().last_of_ties;
        let mut rows: Vec<Vec<i32>> = case.rows(60).iter().map(|row| keys(row, program.key)).collect();
        rows.extend(close_rows(&case, program, 20));
        let data: Vec<Compiled> = [Layout::Complete, Layout::Compact, Layout::Wide]
            .into_iter()
            .flat_map(|layout| [false, true].map(|shared| (layout, shared)))
            .filter_map(|(layout, shared)| {
                let early_exit = Some(EarlyExit::Always);
                let (layout, shared_leaves) = (Some(layout), Some(shared));
                let settings = Settings { layout, shared_leaves, leaf: case.leaf, early_exit, ..Settings::default() };
                compile(&case.ensemble, &settings).ok()
            })
            .collect();
        for (row, expected) in rows.iter().zip(expected(&plain, &rows)) {
            let most = expected.iter().max().unwrap();
            let mut best = (0..expected.len()).filter(|&class| expected[class] == *most);
            let class = if last_of_ties { best.next_back() } else { best.next() }.unwrap();
            ties += usize::from(lead(&expected) == 0);
            assert_eq!(program.class(row), class, "{}: {row:?}", case.name);
            assert_eq!(program.margins(row), expected, "{}: {row:?}", case.name);
            let ranks = program.ranks(row);
            let mut margins = program.base.clone();
            for (trees, bound) in program.parts() {
                trees.iter().for_each(|tree| tree.add(&ranks, &mut margins));
                walked += 1;
                let Some(bound) = bound else { break };
                ended += usize::from(lead(&margins) > bound);
                let changes: Vec<i32> = expected.iter().zip(&margins).map(|(all, so_far)| all - so_far).collect();
                let most = changes.iter().max().unwrap().abs_diff(*changes.iter().min().unwrap());
                assert!(most <= bound, "{}: {most} of {bound}, {row:?}", case.name);
            }
            for compiled in &data {
                let model = open(&compiled.bytes).unwrap();
                let mut margins = vec![0; model.object_count()];
                assert_eq!(model.class_of(row, &mut margins), Some(class), "{}: {row:?}", case.name);
                model.margins_of(row, &mut margins);
                assert_eq!(margins, expected, "{}: {row:?}", case.name);
            }
        }
    }
    println!("{walked} parts, {ended} ends of which a class was known at, {ties} rows with a tie");
    assert!(ended > walked / 40 && ties > 100, "{walked} {ended} {ties}");
}

#[test]
fn rows_decide_where_walks_may_end_and_models_without_a_place_are_as_before() {
    let mut case = CASES[0].clone();
    // As of a boosted ensemble: later trees change less.
    for (number, tree) in case.ensemble.trees.iter_mut().enumerate() {
        for node in &mut tree.nodes {
            if let Node::Leaf(values) = node {
                values.iter_mut().for_each(|value| *value *= 0.8_f32.powi(number as i32));
            }
        }
    }
    let rows = |values: Vec<Vec<f32>>| Rows {
        features: values[0].len(),
        values: values.into_iter().flatten().map(f64::from).collect(),
        labels: Vec::new(),
        by_position: false,
    };
    let some = rows(case.rows(100));
    let of = |ensemble: &Ensemble, early_exit| {
        let settings = Settings { layout: Some(Layout::Compact), early_exit, ..Settings::default() };
        compile(ensemble, &settings).unwrap()
    };
    let with = of(&case.ensemble, Some(EarlyExit::IfItPays(some.clone())));
    let found = with.early_exit.clone().unwrap();
    assert!(!found.ends.is_empty() && found.walked.unwrap() < 0.95 * found.trees as f64, "{found:?}");
    let model = open(&with.bytes).unwrap();
    let groups = groups_and_splits(&model).0;
    let trees = |exit: palpate_shared::format::EarlyExit| {
        groups[..exit.groups.into()].iter().map(|group| group.trees as usize).sum()
    };
    assert_eq!(model.early_exits().map(trees).collect::<Vec<usize>>(), found.ends);
    // Two classes with the same trees: nothing is ever known.
    let mut level =
        Ensemble { objects: vec!["a".into(), "b".into()], base_margins: vec![0.0; 2], ..case.ensemble.clone() };
    level.trees = (level.trees.iter())
        .flat_map(|tree| [0, 1].map(|object| Tree { output: Output::One(object), ..tree.clone() }))
        .collect();
    let tried = of(&level, Some(EarlyExit::IfItPays(some)));
    let found = tried.early_exit.clone().unwrap();
    assert_eq!((found.ends, found.walked), (Vec::new(), Some(found.trees as f64)));
    assert_eq!(tried.bytes, of(&level, None).bytes);
    for (leaf, outputs) in [(Leaf::F32, 3), (Leaf::I16, 1)] {
        let random = Random { objects: outputs, ..random_of(outputs) };
        let settings = Settings { leaf, early_exit: Some(EarlyExit::Always), ..Settings::default() };
        let error = compile(&random.ensemble(1), &settings).unwrap_err().to_string();
        assert!(error.contains("early_exit"), "{error}");
    }
}

/// Random trees of one output each.
fn random_of(objects: usize) -> Random {
    let threshold: fn(&mut Numbers) -> f32 = |numbers| numbers.value(100.0);
    Random { inputs: Inputs::unnamed(6), objects, trees: 40, depth: 5, each: false, votes: 0, largest: 0.5, threshold }
}

#[test]
fn columns_are_made_by_conversion_where_thresholds_are_on_a_grid() {
    let kinds = |name: &str| {
        let case = CASES.iter().find(|case| case.name == name).unwrap();
        let compiled = case.compiled(Some(Form::C));
        program(&compiled).columns.iter().map(|column| format!("{:?}", column.kind)).collect::<Vec<_>>()
    };
    let all = |name: &str, start: &str| kinds(name).iter().all(|kind| kind.starts_with(start));
    assert!(all("halves, i16", "Grid { bits: 1, before: false }"));
    assert!(all("steps of 64, i16", "Grid { bits: -6, before: false }"));
    assert!(all("at or below, i16", "Grid { bits: 1, before: true }"));
    assert!(all("keys, i16", "Search") && all("computed, i16", "Search"));
}

#[test]
fn f32_leaves_are_no_code() {
    let case = Case { leaf: Leaf::F32, ..CASES[0].clone() };
    let settings =
        Settings { layout: Some(Layout::Code), forms: vec![Form::C], leaf: Leaf::F32, ..Settings::default() };
    let error = compile(&case.ensemble, &settings).unwrap_err().to_string();
    assert!(error.contains("its leaves are f32"), "{error}");
}

#[test]
fn the_firmware_has_the_code_that_is_exported_now() {
    let root = Path::new(ROOT);
    let path = root.join("tests/data/import/xgboost-3.4-softmax.json");
    let ensemble = Ensemble::load_with(&path, &Default::default()).unwrap();
    let case = Case { name: "softmax".into(), ensemble, leaf: Leaf::I16 };
    let compiled = case.compiled(Some(Form::Thumb(Chip::M0Plus)));
    let place = |file: &str| root.join("onboard/firmware/src/code").join(file);
    assert_eq!(std::fs::read(place("softmax.palpate")).unwrap(), compiled.bytes);
    for (extension, text) in compiled.sources("softmax", &[]).unwrap() {
        let path = place(&format!("softmax.{extension}"));
        if std::env::var_os("PALPATE_RESTATE").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        assert_eq!(std::fs::read_to_string(path).unwrap(), text);
    }
}

/// Files of one ensemble in assembly, with the header for C.
fn exported(seed: u64, early_exit: bool) -> Vec<(&'static str, String)> {
    let ensemble = random_of(3).ensemble(seed);
    let case = Case { name: String::new(), ensemble, leaf: Leaf::I16 };
    let form = Form::Thumb(Chip::M0Plus);
    let compiled = case.compiled_with(Some(form), early_exit.then_some(EarlyExit::Always));
    compiled.sources("same", &[Language::C]).unwrap()
}

/// The symbols of a text.
fn symbols(text: &str) -> Vec<&str> {
    let words = text.split(|character: char| !character.is_alphanumeric() && character != '_');
    let is_symbol = |word: &&str| {
        ["same_margins_", "same_early_"].iter().any(|start| word.strip_prefix(start).is_some_and(|end| end.len() == 8))
    };
    let mut found: Vec<&str> = words.filter(is_symbol).collect();
    found.sort_unstable();
    found.dedup();
    found
}

#[test]
fn symbols_of_assembly_are_those_of_the_files_that_were_exported_with_it_and_of_no_others() {
    for early_exit in [false, true] {
        let (one, other) = (exported(1, early_exit), exported(2, early_exit));
        let [assembly, rust, header] = &one[..] else { panic!("three files") };
        let own = symbols(&assembly.1);
        assert_eq!(own.len(), 1 + usize::from(early_exit), "{own:?}");
        assert_eq!((symbols(&rust.1), symbols(&header.1)), (own.clone(), own.clone()));
        assert!(other.iter().all(|(_, text)| symbols(text).iter().all(|symbol| !own.contains(symbol))));
        // Every symbol has its size, and no stack of code is asked for.
        assert_eq!(assembly.1.matches("\t.size same_").count(), own.len());
        assert!(assembly.1.contains(".note.GNU-stack"));
    }
}

#[test]
#[ignore = "needs a compiler for chips"]
fn assembly_of_another_export_does_not_link() {
    let directory = tempfile::tempdir().unwrap();
    let put = |file: &str, text: &str| std::fs::write(directory.path().join(file), text).unwrap();
    let source = "#include \"same.h\"\nint main(void)\n{\n    palpate_model model;\n    return same_open(&model);\n}\n\
                  void reset(void);\nvoid reset(void) { main(); }\n";
    put("program.c", source);
    let link = |one: u64, other: u64| {
        for (file, seed) in [("same.h", one), ("same.s", other)] {
            let files = exported(seed, false);
            put(file, &files.iter().find(|own| file.ends_with(own.0)).unwrap().1);
        }
        let mut command = Command::new("arm-none-eabi-gcc");
        command.args(["-mcpu=cortex-m0plus", "-mthumb", "-ffreestanding", "-nostdlib", "-e", "reset"]);
        command.arg("-I").arg(Path::new(ROOT).join("onboard/c")).args([
            "program.c",
            "same.s",
            "-lgcc",
            "-o",
            "program",
        ]);
        let output = command.current_dir(directory.path()).output().unwrap();
        if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
    };
    assert_eq!(link(1, 1), Ok(()));
    let error = link(1, 2).unwrap_err();
    assert!(error.contains("undefined reference to `same_margins_"), "{error}");
}

/// The files of a test program: `models.h`, and assembly of every model if the form is assembly.
fn write(directory: &Path, cases: &[Case], form: Form, rows: usize, early_exit: bool) -> Vec<PathBuf> {
    let (mut head, mut body, mut table, mut sources) = (String::new(), String::new(), String::new(), Vec::new());
    head += "#include \"palpate.h\"\nstruct code_test {\n    palpate_error (*open)(palpate_model *);\n    \
             void (*margins)(const void *, int32_t *);\n    int (*class_of)(const void *);\n    \
             const int32_t *keys, *values, *expected, *classes;\n    \
             unsigned rows, features, objects;\n};\n";
    for (index, case) in cases.iter().enumerate() {
        let wanted = (early_exit && case.has_classes()).then_some(EarlyExit::Always);
        let compiled = case.compiled_with(Some(form), wanted);
        let (program, name) = (program(&compiled), format!("m{index}"));
        let values = case.rows(rows);
        let rows: Vec<Vec<i32>> = values.iter().map(|row| keys(row, program.key)).collect();
        for (extension, text) in compiled.sources(&name, &[Language::C]).unwrap() {
            let path = directory.join(&name).with_extension(extension);
            std::fs::write(&path, text).unwrap();
            if extension == "s" {
                sources.push(path);
            }
        }
        // The same bits, whatever the type.
        let bits: Vec<Vec<i32>> = match program.key {
            Key::Whole => rows.clone(),
            Key::Real => {
                values.iter().map(|row| row.iter().map(|value| value.to_bits().cast_signed()).collect()).collect()
            }
        };
        let kind = if program.key == Key::Real { "float" } else { "int32_t" };
        _ = writeln!(body, "#include \"{name}.h\"");
        let plain = case.compiled(None);
        let class = |row: &Vec<i32>| {
            let model = open(&plain.bytes).unwrap();
            vec![model.predict_class(row, &mut vec![0; model.object_count()]).unwrap() as i32]
        };
        let classes: Vec<Vec<i32>> = rows.iter().map(class).collect();
        for (what, numbers) in
            [("keys", &rows), ("given", &bits), ("expected", &expected(&plain, &rows)), ("classes", &classes)]
        {
            // The least number is written as a difference, since a compiler takes its digits as a larger type's.
            let number = |number: &i32| match *number {
                i32::MIN => "-2147483647-1".to_owned(),
                number => number.to_string(),
            };
            let numbers: Vec<String> = numbers.iter().flatten().map(number).collect();
            _ = writeln!(body, "static const int32_t {name}_{what}[] = {{{}}};", numbers.join(","));
        }
        _ = writeln!(
            body,
            "static void {name}_call(const void *row, int32_t *margins) {{ {name}_margins((const {kind} *)row, margins); }}"
        );
        let targets = case.ensemble.prediction().targets;
        let class_of = if case.has_classes() && (!targets || !program.exits.is_empty()) {
            let function = if targets { "class" } else { "predict" };
            _ = writeln!(
                body,
                "static int {name}_known(const void *row) {{ return {name}_{function}((const {kind} *)row); }}"
            );
            format!("{name}_known")
        } else {
            "0".to_owned()
        };
        _ = writeln!(
            table,
            "    {{{name}_open, {name}_call, {class_of}, {name}_keys, {name}_given, {name}_expected, {name}_classes, {}, {}, {}}},",
            rows.len(),
            program.features,
            program.objects(),
        );
    }
    let text = format!("{head}{body}static const struct code_test tests[] = {{\n{table}}};\n");
    std::fs::write(directory.join("models.h"), text).unwrap();
    sources
}

const CHOICES: [&str; 3] =
    ["-DPALPATE_LAYOUTS=PALPATE_CODE", "-DPALPATE_LEAVES=(PALPATE_I8|PALPATE_I16)", "-DPALPATE_MAX_OBJECTS=256"];

/// Compiles the program; what a compiler says is an error.
fn build(
    compiler: &str,
    flags: &[&str],
    directory: &Path,
    sources: &[PathBuf],
    libraries: &[&str],
) -> Result<PathBuf, String> {
    let program = directory.join("program");
    let root = Path::new(ROOT);
    let mut command = Command::new(compiler);
    command.args(flags).args(CHOICES).arg("-I").arg(root.join("onboard/c")).arg("-I").arg(root.join("tests/c"));
    command
        .arg("-I")
        .arg(directory)
        .arg("-o")
        .arg(&program)
        .arg(root.join("tests/c/code.c"))
        .args(sources)
        .args(libraries);
    let output = command.output().map_err(|error| format!("{compiler}: {error}"))?;
    if output.status.success() { Ok(program) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

/// That every model had no row that differs.
fn check(output: &str, cases: &[Case]) {
    let words: Vec<&str> = output.split_whitespace().collect();
    let wrong = cases.iter().zip(&words).filter(|(_, word)| **word != "0");
    let wrong: Vec<String> = wrong.map(|(case, word)| format!("{}: {word}", case.name)).collect();
    assert!(wrong.is_empty(), "rows that differ: {wrong:?}");
    assert_eq!(words.len(), cases.len() + 1, "{output}");
}

#[test]
fn c_gives_the_margins_of_the_layouts_of_data_on_this_machine_without_a_warning() {
    let directory = tempfile::tempdir().unwrap();
    let cases = few();
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let flags = ["-std=c99", "-O0", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-Wno-unused-function"];
    for early_exit in [false, true] {
        write(directory.path(), &cases, Form::C, 20, early_exit);
        let program = build(&compiler, &flags, directory.path(), &[], &[]).unwrap();
        let output = Command::new(program).output().unwrap();
        check(&String::from_utf8(output.stdout).unwrap(), &cases);
    }
}

/// Runs an image of Cortex-M or RISC-V.
fn emulate(emulator: &str, machine: &[&str], program: &Path) -> String {
    let mut command = Command::new(emulator);
    command
        .args(machine)
        .args(["-nographic", "-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(program);
    let output = command.stdin(Stdio::null()).output().unwrap();
    String::from_utf8([output.stdout, output.stderr].concat()).unwrap()
}

#[test]
#[ignore = "needs compilers for chips and emulators"]
fn assembly_and_c_give_the_margins_of_the_layouts_of_data_on_emulated_chips() {
    let few = few();
    let root = Path::new(ROOT);
    let (mps2, virt) = (root.join("tests/c/mps2.ld"), root.join("tests/c/virt.ld"));
    let (mps2, virt) = (mps2.to_str().unwrap(), virt.to_str().unwrap());
    let bare = [
        "-std=c99",
        "-w",
        "-Os",
        "-DBARE",
        "-ffreestanding",
        "-nostdlib",
        "-static",
        "-Wl,--no-warn-rwx-segments",
        "-T",
    ];
    let m0_plus = ["-mcpu=cortex-m0plus", "-mthumb"];
    let m4f = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"];
    for (chip, flags, machine, form, early_exit) in [
        ("Cortex-M0+", &m0_plus[..], "mps2-an385", Form::Thumb(Chip::M0Plus), false),
        ("Cortex-M0+, early exit", &m0_plus[..], "mps2-an385", Form::Thumb(Chip::M0Plus), true),
        ("Cortex-M4F", &m4f, "mps2-an386", Form::Thumb(Chip::M4F), false),
        ("Cortex-M4F, early exit", &m4f, "mps2-an386", Form::Thumb(Chip::M4F), true),
        ("Cortex-M4F, the subset", &m4f, "mps2-an386", Form::Thumb(Chip::M0Plus), false),
        ("Cortex-M0+, C", &m0_plus, "mps2-an385", Form::C, false),
        ("Cortex-M4F, C, early exit", &m4f, "mps2-an386", Form::C, true),
    ] {
        println!("{chip}");
        let directory = tempfile::tempdir().unwrap();
        // An assembler takes less time.
        let cases = if form == Form::C { &few } else { &*CASES };
        let sources = write(directory.path(), cases, form, 15, early_exit);
        let flags = [flags, &bare, &[mps2]].concat();
        let program = build("arm-none-eabi-gcc", &flags, directory.path(), &sources, &["-lgcc"]).unwrap();
        check(&emulate("qemu-system-arm", &["-machine", machine], &program), cases);
    }
    println!("rv32imc");
    let directory = tempfile::tempdir().unwrap();
    write(directory.path(), &few, Form::C, 15, false);
    let flags = [&["-march=rv32imc", "-mabi=ilp32"][..], &bare, &[virt]].concat();
    let program = build("riscv64-unknown-elf-gcc", &flags, directory.path(), &[], &["-lgcc"]).unwrap();
    check(&emulate("qemu-system-riscv32", &["-machine", "virt", "-bios", "none"], &program), &few);
}
