//! Stated numbers of instructions, stack and bytes equal the measured ones.
//!
//! Measured by an emulator and by compilers for chips, so most of it is asked for:
//! `cargo test --release -p palpate-tests --test whole stated:: -- --ignored --test-threads 1`, which `.ci/firmware` and `.ci/c` do. With
//! `PALPATE_RESTATE=1` it writes what it measures into the READMEs, as those of `images` do. Other compilers give other code, so a number may be a few percent off.

use palpate_tests::ROOT;
use palpate_tests::chips::{M0, M4F, cargo};
use palpate_tests::stated::Readme;
use std::path::Path;
use std::process::{Command, Stdio};

/// Tolerance of a number, in percent.
const PERCENT: u64 = 3;

/// Output of an image in the emulator, line by line in words.
fn printed(image: &str, target: &str) -> Vec<Vec<String>> {
    let output = cargo("run", image, target, &[]).output().expect("cargo runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    print!("{target}, {image}\n{text}");
    text.lines().map(|line| line.split_whitespace().map(str::to_string).collect()).collect()
}

/// The numbers after a label; of several lines with it the one at `index`.
fn numbers(lines: &[Vec<String>], label: &str, index: usize) -> Vec<u64> {
    let label: Vec<&str> = label.split(' ').collect();
    let mut found = lines.iter().filter(|line| line.iter().zip(&label).filter(|(a, b)| a == b).count() == label.len());
    let line = found.nth(index).unwrap_or_else(|| panic!("no line {label:?}"));
    let number = |word: &String| word.trim_end_matches(',').parse().ok();
    line[label.len()..].iter().filter_map(number).collect()
}

/// Rows of the table of instructions and stack in the firmware's README: the row, the benchmark's label, and which of
/// the lines with it.
const BENCHMARK: [(&str, &str, usize); 6] = [
    ("margins of a touch", "recognizer: margins", 0),
    ("a touch with its verdict", "recognizer: a touch with its verdict", 0),
    ("a posterior", "recognizer: a posterior", 0),
    ("effector: six edges of a touch", "effector: a touch, six edges", 0),
    ("a touch's frame in, its outcome out", "link: a touch, there and back", 0),
    ("… and posteriors and evidence for parity", "link: a touch, there and back", 1),
];

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/whole/stated.rs"]
fn the_firmwares_readme_states_what_the_emulator_counts() {
    let mut readme = Readme::open("onboard/firmware/README.md");
    for (column, target) in [(1, M4F), (3, M0)] {
        let lines = printed("benchmark", target);
        for (row, label, index) in BENCHMARK {
            let [instructions, stack] = numbers(&lines, label, index)[..] else { panic!("{label}") };
            readme.cell(row, column, instructions, PERCENT);
            readme.cell(row, column + 1, stack, PERCENT);
        }
        if column == 1 {
            readme.after("`models/household.palpate` (", numbers(&lines, "the model:", 0)[0], 0);
            let frame = numbers(&lines, "a touch's frame without:", 0);
            readme.after("At 115,200 baud ", frame[1], 0);
            let posed = numbers(&lines, "a touch's frame with a pose:", 0);
            readme.after("through the line, ", posed[1], 0);
            readme.after("a frame takes ", frame[0], 0);
            readme.after("bytes, with the pose ", posed[0], 0);
            readme.after("an\noutcome ", numbers(&lines, "without detail: an answer of", 0)[0], 0);
        }
    }
    readme.finish();
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/whole/stated.rs"]
fn the_crates_readme_states_what_exponentials_and_state_cost() {
    let mut readme = Readme::open("onboard/README.md");
    for (column, target) in [(1, M4F), (2, M0)] {
        let lines = printed("exponential", target);
        let rows = [
            ("**fixed point, Q56**", "fixed point Q56", 0),
            ("`micromath` f32", "micromath f32", 0),
            ("`libm` f32", "libm f32", 0),
            ("`libm` f64", "libm f64", 0),
            ("logarithm: `micromath` f32", "micromath f32", 1),
            ("logarithm: `libm` f32", "libm f32", 1),
            ("logarithm: `libm` f64", "libm f64", 1),
        ];
        for (row, label, index) in rows {
            readme.cell(row, column, numbers(&lines, label, index)[0], PERCENT);
        }
    }
    let lines = printed("evaluator", M4F);
    let state = numbers(&lines, "state:", 0);
    readme.after("State for ten objects takes ", state[0], 0);
    readme.after("bytes, including ", state[1], 0);
    readme.finish();
}

/// Rows of the table of evaluators, and what `evaluator` calls them.
const EVALUATORS: [(&str, &str); 8] = [
    ("1000 one-output, depth 6, i16", "one-i16"),
    ("… in `irithyll-core` 1.0", "irithyll-core"),
    ("… as 8-byte nodes, f32 compares", "8-byte nodes"),
    ("100 multi-output, depth 6, i16", "each100-i16"),
    ("… i8", "each100-i8"),
    ("40 multi-output, depth 5, i16", "each40-i16"),
    ("40 multi-output, depth 5, i8", "each40-i8"),
    ("40 multi-output, depth 5, i16, splits of six bytes", "each40-wide"),
];

#[test]
#[ignore = "needs an emulator, and PALPATE_BENCH as .ci/firmware sets it"]
fn the_crates_readme_states_what_evaluators_cost() {
    let shared = std::env::var("PALPATE_SHARED").unwrap_or_else(|_| format!("{ROOT}/../shared"));
    if std::env::var_os("PALPATE_BENCH").is_none() || !Path::new(&shared).join("objects").exists() {
        return println!("SKIPPED: PALPATE_BENCH is not set, or its models are not of {shared}/objects");
    }
    let mut readme = Readme::open("onboard/README.md");
    for (column, target) in [(2, M4F), (3, M0)] {
        let lines = printed("evaluator", target);
        for (row, label) in EVALUATORS {
            let found = numbers(&lines, label, 0);
            readme.cell(row, 1, found[0], PERCENT);
            readme.cell(row, column, found[1], PERCENT);
        }
    }
    readme.finish();
}

/// A chip's column of the C header's table, compiler, and flags.
const CHIPS: [(usize, &str, &str); 4] = [
    (1, "arm-none-eabi", "-mcpu=cortex-m0plus -mthumb"),
    (2, "arm-none-eabi", "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16"),
    (3, "riscv64-unknown-elf", "-march=rv32imc -mabi=ilp32"),
    (4, "avr", "-mmcu=atmega2560"),
];

/// The rows of that table, and the macros defined for them.
const C_ROWS: [(&str, &str); 5] = [
    (
        "rows, compact, i8 leaves",
        "-DROWS -DPALPATE_LAYOUTS=PALPATE_COMPACT -DPALPATE_LEAVES=PALPATE_I8 -DPALPATE_STRANGERS=0",
    ),
    (
        "touches, compact, i8 leaves",
        "-DPALPATE_LAYOUTS=PALPATE_COMPACT -DPALPATE_LEAVES=PALPATE_I8 -DPALPATE_STRANGERS=0",
    ),
    ("touches, compact and wide, all leaves", "-DPALPATE_STRANGERS=0"),
    ("… and a misfit test", "-DPALPATE_STRANGERS=1"),
    ("everything: also posteriors, names", "-DEVERYTHING"),
];

/// Macros of all of these rows.
const C_LEFT_OUT: [&str; 3] = ["-DPALPATE_SHARED=0", "-DPALPATE_SENTINEL=0", "-DPALPATE_ROW_EVIDENCE=0"];

/// The columns of instructions: tools, flags, emulator.
const C_EMULATORS: [(usize, &str, &str, &str); 2] = [
    (1, "arm-none-eabi", "-mcpu=cortex-m0plus -mthumb -T tests/c/mps2.ld", "qemu-system-arm -machine mps2-an385"),
    (
        2,
        "arm-none-eabi",
        "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -T tests/c/mps2.ld",
        "qemu-system-arm -machine mps2-an386",
    ),
];

#[test]
#[ignore = "needs compilers for chips: .ci/run c"]
fn the_c_headers_readme_states_what_it_takes() {
    let mut readme = Readme::open("onboard/c/README.md");
    let directory = tempfile::tempdir().unwrap();
    for (column, tools, flags) in CHIPS {
        for (row, defined) in C_ROWS {
            let object = directory.path().join("o");
            let mut command = Command::new(format!("{tools}-gcc"));
            command.args(flags.split(' ')).args(["-std=c99", "-ffreestanding", "-Os", "-I"]);
            command.arg(format!("{ROOT}/onboard/c")).args(defined.split(' ')).args(C_LEFT_OUT).arg("-c");
            command.arg(format!("{ROOT}/tests/c/size.c")).arg("-o").arg(&object);
            let Ok(status) = command.status() else {
                println!("SKIPPED: there is no {tools}-gcc");
                break;
            };
            assert!(status.success(), "{row}");
            let output = Command::new(format!("{tools}-size")).arg(&object).output().expect("binutils");
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            let sizes: Vec<u64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            println!("{tools} {row}: {}", sizes[0] + sizes[1]);
            readme.cell(row, column, sizes[0] + sizes[1], PERCENT);
            if (column, row) == (1, C_ROWS[0].0) {
                readme.after("State, of a model and a recognizer: ", sizes[2], 0);
            }
        }
    }
    for (column, tools, flags, emulator) in C_EMULATORS {
        // As .ci/c does.
        let mut command = Command::new(format!("{tools}-gcc"));
        command.args(flags.split(' ')).args(["-Os", "-std=c99", "-ffreestanding", "-nostdlib", "-static", "-I"]);
        command
            .arg(format!("{ROOT}/onboard/c"))
            .arg("-Wl,--no-warn-rwx-segments")
            .arg(format!("{ROOT}/tests/c/speed.c"));
        let Ok(status) = command.arg("-lgcc").arg("-o").arg(directory.path().join("speed")).current_dir(ROOT).status()
        else {
            println!("SKIPPED: there is no {tools}-gcc");
            continue;
        };
        assert!(status.success(), "speed.c does not compile with {tools}-gcc");
        std::fs::copy(format!("{ROOT}/models/household.palpate"), directory.path().join("model")).unwrap();
        let mut words = emulator.split(' ');
        let mut command = Command::new(words.next().unwrap());
        command.args(words).args([
            "-nographic",
            "-icount",
            "shift=0",
            "-semihosting-config",
            "enable=on,target=native",
        ]);
        let output =
            command.args(["-kernel", "speed"]).current_dir(directory.path()).stdin(Stdio::null()).output().unwrap();
        let text = [output.stdout, output.stderr].concat();
        let text = String::from_utf8_lossy(&text);
        let (_, number) =
            text.split_once("instructions for a touch or row with its verdict: ").expect("what speed.c prints");
        let number = number.lines().next().unwrap().trim().parse().unwrap();
        println!("{tools}: {number} instructions");
        readme.cell("instructions of a touch with its verdict, `-Os`", column, number, PERCENT);
    }
    readme.finish();
}
