//! Stated numbers of instructions, stack and bytes equal the measured ones.
//!
//! Measured by an emulator and by compilers for chips, so most of it is asked for:
//! `cargo test --release -p palpate-tests --test stated -- --ignored --test-threads 1`, which `.ci/firmware` and `.ci/c` do. With
//! `PALPATE_RESTATE=1` it writes what it measures into the READMEs, as `--test images` does. Other compilers give other code, so a number may be a few percent off.

use palpate_tests::ROOT;
use palpate_tests::stated::{Readme, measured_in};
use std::path::Path;
use std::process::{Command, Stdio};

const M4F: &str = "thumbv7em-none-eabihf";
const M0: &str = "thumbv6m-none-eabi";
/// Tolerance of a number, in percent.
const PERCENT: u64 = 3;

/// Cargo in the firmware's workspace, with the release profile.
fn cargo(what: &str, image: &str, target: &str) -> Command {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args([what, "--locked", "--release", "--quiet", "--bin", image, "--target", target]);
    cargo.current_dir(Path::new(ROOT).join("onboard/firmware"));
    cargo.env_remove("CARGO_TARGET_DIR").env_remove("RUSTFLAGS").env_remove("PALPATE_MODEL").stdin(Stdio::null());
    cargo
}

/// Output of an image in the emulator, line by line in words.
fn printed(image: &str, target: &str) -> Vec<Vec<String>> {
    let output = cargo("run", image, target).output().expect("cargo runs");
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
const BENCHMARK: [(&str, &str, usize); 8] = [
    ("margins of a touch", "recognizer: margins", 0),
    ("a touch with its verdict", "recognizer: a touch with its verdict", 0),
    ("a posterior", "recognizer: a posterior", 0),
    ("a snapshot", "recognizer: a snapshot", 0),
    ("effector: six edges of a touch", "effector: a touch, six edges", 0),
    ("a touch's frame in, its outcome out", "link: a touch, there and back", 0),
    ("… and posteriors and evidence for parity", "link: a touch, there and back", 1),
    ("the whole program: that, and a record of the state", "serve: a touch with detail, and its record", 0),
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
            readme.after("an\noutcome ", numbers(&lines, "without detail: an outcome of", 0)[0], 0);
        }
    }
    readme.finish();
}

#[test]
#[ignore = "needs targets for chips; see the top of tests/tests/whole/stated.rs"]
fn the_firmwares_readme_states_the_flash_and_ram_of_its_images() {
    let mut readme = Readme::open("onboard/firmware/README.md");
    for (image, row) in [("uart", "`uart`, no model in it"), ("gpio", "`gpio`, its model included")] {
        let [m4f, m0] = [M4F, M0].map(|target| {
            assert!(cargo("build", image, target).status().expect("cargo runs").success(), "{image} does not build");
            let path = format!("{ROOT}/onboard/firmware/target/{target}/release/{image}");
            Sizes::read(&std::fs::read(path).expect("the image"))
        });
        println!("{image}: {m4f:?} {m0:?}");
        readme.cell(row, 1, m4f.flash, PERCENT);
        readme.cell(row, 2, m0.flash, PERCENT);
        readme.cell(row, 3, m4f.ram, PERCENT);
        assert!(m4f.ram.abs_diff(m0.ram) * 100 <= PERCENT * m0.ram, "one number is not enough: {m4f:?} {m0:?}");
    }
    readme.finish();
}

/// Sizes of an image.
#[derive(Debug)]
struct Sizes {
    flash: u64,
    ram: u64,
}

impl Sizes {
    /// Reads a 32-bit little-endian ELF file: loaded bytes count as flash, written ones as RAM.
    fn read(elf: &[u8]) -> Self {
        let half = |at: usize| usize::from(u16::from_le_bytes([elf[at], elf[at + 1]]));
        let word = |at: usize| u32::from_le_bytes(elf[at..at + 4].try_into().expect("four bytes"));
        let names = word(word(32) as usize + half(50) * half(46) + 16) as usize;
        let (mut flash, mut ram) = (0, 0);
        for section in (0..half(48)).map(|index| word(32) as usize + index * half(46)) {
            let name = &elf[names + word(section) as usize..];
            let name = name.split(|&byte| byte == 0).next().unwrap_or_default();
            let (kind, flags, length) = (word(section + 4), word(section + 8), u64::from(word(section + 20)));
            // PROGBITS and ALLOC; `uart` keeps models and state in memory of its own.
            flash += if kind == 1 && flags & 2 != 0 { length } else { 0 };
            ram += if matches!(name, b".data" | b".bss" | b".uninit") { length } else { 0 };
        }
        Self { flash, ram }
    }
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
    readme.cell("state for ten objects", 1, state[0], 0);
    readme.after("bytes, including ", state[1], 0);
    readme.finish();
}

/// Rows of the table of evaluators, and what `evaluator` calls them.
const EVALUATORS: [(&str, &str); 9] = [
    ("1000 one-output, depth 6, i16", "one-i16"),
    ("… in `irithyll-core` 1.0", "irithyll-core"),
    ("… as 8-byte nodes, f32 compares", "8-byte nodes"),
    ("100 multi-output, depth 6, i16", "each100-i16"),
    ("… i8", "each100-i8"),
    ("40 multi-output, depth 5, i16", "each40-i16"),
    ("40 multi-output, depth 5, i8", "each40-i8"),
    ("… i8, compact", "each40-compact"),
    ("a table of 64 × 64 bins, i8", "grid-i8"),
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
        "rows, one layout (complete), i8 leaves",
        "-DROWS -DPALPATE_LAYOUTS=PALPATE_COMPLETE -DPALPATE_LEAVES=PALPATE_I8 -DPALPATE_STRANGERS=0 -DPALPATE_SHARED=0 -DPALPATE_SENTINEL=0 -DPALPATE_ROW_EVIDENCE=0",
    ),
    (
        "touches, one layout (complete), i8 leaves",
        "-DPALPATE_LAYOUTS=PALPATE_COMPLETE -DPALPATE_LEAVES=PALPATE_I8 -DPALPATE_STRANGERS=0 -DPALPATE_SHARED=0 -DPALPATE_SENTINEL=0 -DPALPATE_ROW_EVIDENCE=0",
    ),
    (
        "touches, all layouts and leaves",
        "-DPALPATE_STRANGERS=0 -DPALPATE_SHARED=0 -DPALPATE_SENTINEL=0 -DPALPATE_ROW_EVIDENCE=0",
    ),
    ("… and a misfit test", "-DPALPATE_SHARED=0 -DPALPATE_SENTINEL=0 -DPALPATE_ROW_EVIDENCE=0"),
    (
        "everything: also posteriors, snapshots, names",
        "-DEVERYTHING -DPALPATE_SHARED=0 -DPALPATE_SENTINEL=0 -DPALPATE_ROW_EVIDENCE=0",
    ),
];

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
            command.arg(format!("{ROOT}/onboard/c")).args(defined.split(' ')).arg("-c");
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

/// The comments of a file: of Rust line by line with what follows on the next ones, of C as they are.
fn comments(path: &Path) -> Vec<(usize, String)> {
    let text = std::fs::read_to_string(path).expect("a file");
    let (mut all, mut last): (Vec<(usize, String)>, usize) = (Vec::new(), 0);
    let mut is_inside = false;
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        let starts = if path.extension().is_some_and(|extension| extension == "rs") { "//" } else { "/*" };
        let start = line.find(starts).filter(|_| !line.contains("://"));
        let content = if is_inside {
            Some(line)
        } else {
            start.map(|start| line[start..].trim_start_matches(['/', '!', '*', ' ']))
        };
        is_inside = starts == "/*" && (is_inside || start.is_some()) && !line.ends_with("*/");
        let Some(content) = content else { continue };
        match all.last_mut().filter(|_| last + 1 == number && !content.is_empty()) {
            Some((_, comment)) => *comment += &format!(" {content}"),
            None => all.push((number + 1, content.to_string())),
        }
        last = number;
    }
    all
}

#[test]
fn no_comment_states_instructions_or_memory_that_no_test_measures() {
    let mut folders = vec![Path::new(ROOT).join("shared/src"), Path::new(ROOT).join("onboard/src")];
    let mut files = vec![Path::new(ROOT).join("onboard/c/palpate.h")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() { folders.push(entry) } else { files.push(entry) }
        }
    }
    assert!(files.len() > 60, "{} files", files.len());
    let stated: Vec<String> = files
        .iter()
        .flat_map(|path| comments(path).into_iter().map(move |(line, comment)| (path, line, comment)))
        .flat_map(|(path, line, comment)| {
            measured_in(&comment).into_iter().map(move |words| format!("{}:{line}: {words}", path.display()))
        })
        .collect();
    assert!(
        stated.is_empty(),
        "measure these in tests/tests/whole/stated.rs and state them in a README, or say it without a number:\n{}",
        stated.join("\n")
    );
}

#[test]
fn a_number_of_instructions_in_a_comment_is_found() {
    let found = |comment: &str| !measured_in(comment).is_empty();
    for comment in [
        "Cost: about 30 instructions. Cannot fail.",
        "Cost: about fifteen instructions for each.",
        "takes 700 bytes of flash",
        "RAM: 176 bytes.",
        "State: 8 bytes per object, and 40; and more",
        "RAM: 2 KB.",
        "12 more instructions",
    ] {
        assert!(found(comment), "{comment}");
    }
    for comment in ["Cost: a few instructions.", "a split has three bytes: column", "of 4 bytes each", "in two steps"] {
        assert!(!found(comment), "{comment}: {:?}", measured_in(comment));
    }
}
