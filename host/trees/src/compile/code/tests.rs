//! Code against the trees in bytes: to the bit, on this machine and on emulated chips; and its cost.

use super::super::{Leaf, Settings, compile, open};
use super::Program;
use crate::compile::{Compiled, Core, Language};
use crate::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree, computed};
use palpate_onboard::Model;
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
    /// Its trees as code.
    fn code(&self) -> Compiled {
        let settings = Settings { code: true, leaf: self.leaf, ..Settings::default() };
        compile(&self.ensemble, &settings).unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }

    /// Its trees as data.
    fn data(&self) -> Compiled {
        let settings = Settings { leaf: self.leaf, ..Settings::default() };
        compile(&self.ensemble, &settings).unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }

    /// True if it has classes of rows.
    fn has_classes(&self) -> bool {
        self.ensemble.schema().is_none() && self.ensemble.objects.len() > 1
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

/// Margins of the trees in bytes.
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
    compiled.code.as_ref().unwrap()
}

#[test]
fn programs_give_the_margins_of_the_layouts_of_data_at_every_threshold() {
    for case in CASES.iter() {
        let compiled = case.code();
        let program = program(&compiled);
        let rows: Vec<Vec<i32>> = case.rows(150).iter().map(|row| keys(row, program.key)).collect();
        let expected = expected(&case.data(), &rows);
        for (row, expected) in rows.iter().zip(expected) {
            assert_eq!(program.margins(row), expected, "{}: {row:?}", case.name);
        }
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
        program(&case.code()).columns.iter().map(|column| format!("{:?}", column.kind)).collect::<Vec<_>>()
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
    let settings = Settings { code: true, leaf: Leaf::F32, ..Settings::default() };
    let error = compile(&case.ensemble, &settings).unwrap_err().to_string();
    assert!(error.contains("its leaves are f32"), "{error}");
}

/// The files of a test program: `models.h`, and a header for each model.
fn write(directory: &Path, cases: &[Case], rows: usize) {
    let (mut head, mut body, mut table) = (String::new(), String::new(), String::new());
    head += "#include \"palpate.h\"\nstruct code_test {\n    palpate_error (*open)(palpate_model *);\n    \
             void (*margins)(const void *, int32_t *);\n    int (*class_of)(const void *);\n    \
             const int32_t *keys, *values, *expected, *classes;\n    \
             unsigned rows, features, objects;\n};\n";
    for (index, case) in cases.iter().enumerate() {
        let compiled = case.code();
        let (program, name) = (program(&compiled), format!("m{index}"));
        let values = case.rows(rows);
        let rows: Vec<Vec<i32>> = values.iter().map(|row| keys(row, program.key)).collect();
        for (extension, text) in compiled.sources(&name, &[Language::C]).unwrap() {
            std::fs::write(directory.join(&name).with_extension(extension), text).unwrap();
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
        let plain = case.data();
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
        let class_of = if case.has_classes() && !case.ensemble.prediction().targets {
            _ = writeln!(
                body,
                "static int {name}_known(const void *row) {{ return {name}_predict((const {kind} *)row); }}"
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
}

const CHOICES: [&str; 3] =
    ["-DPALPATE_LAYOUTS=PALPATE_CODE", "-DPALPATE_LEAVES=(PALPATE_I8|PALPATE_I16)", "-DPALPATE_MAX_OBJECTS=256"];

/// Compiles the program; what a compiler says is an error.
fn build(compiler: &str, flags: &[&str], directory: &Path, libraries: &[&str]) -> Result<PathBuf, String> {
    let program = directory.join("program");
    let root = Path::new(ROOT);
    let mut command = Command::new(compiler);
    command.args(flags).args(CHOICES).arg("-I").arg(root.join("onboard/c")).arg("-I").arg(root.join("tests/c"));
    command.arg("-I").arg(directory).arg("-o").arg(&program).arg(root.join("tests/c/code.c")).args(libraries);
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
    write(directory.path(), &cases, 20);
    let program = build(&compiler, &flags, directory.path(), &[]).unwrap();
    let output = Command::new(program).output().unwrap();
    check(&String::from_utf8(output.stdout).unwrap(), &cases);
}

#[test]
#[ignore = "needs compilers for chips and emulators"]
fn c_gives_the_margins_of_the_layouts_of_data_on_emulated_chips() {
    let few = few();
    let root = Path::new(ROOT);
    let (mps2, virt) = (root.join("tests/c/mps2.ld"), root.join("tests/c/virt.ld"));
    let (mps2, virt) = (mps2.to_str().unwrap(), virt.to_str().unwrap());
    let arm = |machine: &'static str| ["qemu-system-arm", "-machine", machine].to_vec();
    for (chip, compiler, flags, script, emulator) in [
        ("Cortex-M0+", "arm-none-eabi-gcc", &M0_PLUS[..], mps2, arm("mps2-an385")),
        ("Cortex-M4F", "arm-none-eabi-gcc", &M4F, mps2, arm("mps2-an386")),
        (
            "rv32imc",
            "riscv64-unknown-elf-gcc",
            &["-march=rv32imc", "-mabi=ilp32"],
            virt,
            ["qemu-system-riscv32", "-machine", "virt", "-bios", "none"].to_vec(),
        ),
    ] {
        println!("{chip}");
        let directory = tempfile::tempdir().unwrap();
        write(directory.path(), &few, 15);
        let flags = [flags, &BARE, &[script]].concat();
        let program = build(compiler, &flags, directory.path(), &["-lgcc"]).unwrap();
        check(&emulate(emulator[0], &emulator[1..], &program), &few);
    }
}

const M0_PLUS: [&str; 2] = ["-mcpu=cortex-m0plus", "-mthumb"];
const M4F: [&str; 4] = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"];
const BARE: [&str; 9] =
    ["-std=c99", "-w", "-Os", "-DBARE", "-ffreestanding", "-nostdlib", "-static", "-Wl,--no-warn-rwx-segments", "-T"];

#[test]
#[ignore = "needs compilers for chips and emulators"]
fn instructions_of_c_are_within_15_percent_of_what_emulated_chips_count() {
    let script = Path::new(ROOT).join("tests/c/mps2.ld");
    let mut off = Vec::new();
    for (core, flags, machine) in [(Core::M0Plus, &M0_PLUS[..], "mps2-an385"), (Core::M4F, &M4F, "mps2-an386")] {
        for case in few() {
            let directory = tempfile::tempdir().unwrap();
            write(directory.path(), std::slice::from_ref(&case), 40);
            let flags = [flags, &["-DCOUNT"], &BARE, &[script.to_str().unwrap()]].concat();
            let program_file = build("arm-none-eabi-gcc", &flags, directory.path(), &["-lgcc"]).unwrap();
            let emulator = ["-machine", machine, "-icount", "shift=0"];
            let output = emulate("qemu-system-arm", &emulator, &program_file);
            let counted: f64 = output.split_whitespace().next().unwrap().parse().unwrap();
            let compiled = case.code();
            let program = program(&compiled);
            let ranks: Vec<_> = case.rows(40).iter().map(|row| program.ranks(&keys(row, program.key))).collect();
            let stated = program.mean_instructions(&ranks).on(core).unwrap() as f64;
            println!("{core:?} {}: {counted} counted, {stated:.0} stated", case.name);
            if (stated - counted).abs() > 0.15 * counted {
                off.push(format!("{core:?} {}: {counted} counted, {stated:.0} stated", case.name));
            }
        }
    }
    assert!(off.is_empty(), "{off:#?}");
}

/// A program in Rust that compares the margins of every model with those of data.
fn write_rust(directory: &Path, cases: &[Case], rows: usize) {
    let mut text = String::new();
    let mut main = String::from("fn main() {\n");
    for (index, case) in cases.iter().enumerate() {
        let compiled = case.code();
        let program = program(&compiled);
        let rows: Vec<Vec<f32>> = case.rows(rows);
        let keys: Vec<Vec<i32>> = rows.iter().map(|row| keys(row, program.key)).collect();
        let (_, source) = compiled.sources("m", &[Language::Rust]).unwrap().remove(0);
        std::fs::write(directory.join(format!("m{index}.rs")), source).unwrap();
        // As the function for models takes them: whole numbers, or the bits of f32 values.
        let bits = |(row, keys): (&Vec<f32>, &Vec<i32>)| match program.key {
            Key::Whole => keys.clone(),
            Key::Real => row.iter().map(|value| value.to_bits().cast_signed()).collect(),
        };
        let given: Vec<Vec<i32>> = rows.iter().zip(&keys).map(bits).collect();
        let expected = expected(&case.data(), &keys);
        _ = writeln!(text, "mod m{index};");
        _ = writeln!(
            main,
            "    let given: &[&[i32]] = &{given:?}.each_ref().map(|row| &row[..]);\n    \
             let expected: &[&[i32]] = &{expected:?}.each_ref().map(|row| &row[..]);\n    \
             for (row, expected) in given.iter().zip(expected) {{\n        \
             let mut margins = [0; {objects}];\n        m{index}::margins(row, &mut margins);\n        \
             assert_eq!(&margins[..], *expected, \"{name}: {{row:?}}\");\n    }}\n    \
             assert_eq!(m{index}::CHECKSUM, {checksum});",
            objects = program.objects(),
            name = case.name,
            checksum = Model::with_code(&compiled.bytes, |_, _| {}).unwrap().checksum(),
        );
    }
    std::fs::write(directory.join("main.rs"), format!("{text}{main}}}\n")).unwrap();
}

#[test]
fn rust_gives_the_margins_of_the_layouts_of_data_without_a_warning() {
    let directory = tempfile::tempdir().unwrap();
    write_rust(directory.path(), &few(), 20);
    let compiler = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    let mut command = Command::new(compiler);
    command.args(["--edition", "2024", "-D", "warnings", "-F", "unsafe_code", "-C", "opt-level=0", "main.rs"]);
    let output = command.current_dir(directory.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let output = Command::new(directory.path().join("main")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
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
