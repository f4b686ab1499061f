//! `onboard/c/palpate.h` gives the bits that the crate gives: on this machine, under sanitizers, and on emulated chips.

use palpate::compile::{Language, Restated, emit, restate};
use palpate_onboard::{Model, Verdict};
use palpate_shared::format::{MUST_UNDERSTAND, Tag, Temperature};
use palpate_tests::abuse::{forgetful, snapshot};
use palpate_tests::replay::{Script, is_specified};
use palpate_tests::scripts::{all_models, models, play, script, sealed};
use palpate_tests::sections::with_sections;
use palpate_tests::streams::{Stream, streams};
use palpate_tests::vectors;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const VECTORS: &str = include_str!("../../shared/vectors/vectors.txt");

/// The test program of a machine.
fn compile(compiler: &str, flags: &[&str], source: &str, program: &Path) -> Result<(), String> {
    let mut command = Command::new(compiler);
    command.args(["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"]).args(flags);
    command.arg("-I").arg(Path::new(ROOT).join("onboard/c")).arg("-o").arg(program);
    let last = match source {
        "chip.c" => "-lgcc",
        // For speed the program alone would take 79 KB.
        "avr.c" => "-Os",
        _ => "-O2",
    };
    command.arg(Path::new(ROOT).join("tests/c").join(source)).arg(last);
    let output = command.output().map_err(|error| format!("{compiler}: {error}"))?;
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

fn here(flags: &[&str], directory: &Path) -> Result<PathBuf, String> {
    let program = directory.join("replay");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    compile(&compiler, flags, "host.c", &program).map(|()| program)
}

/// Output of the program.
fn run(program: &mut Command, commands: &[u8]) -> String {
    let mut child = program.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it runs");
    let mut input = child.stdin.take().expect("a pipe");
    let output = std::thread::scope(|scope| {
        scope.spawn(move || input.write_all(commands).expect("it reads everything"));
        child.wait_with_output().expect("it ends")
    });
    assert!(output.status.success(), "{}", output.status);
    String::from_utf8(output.stdout).expect("text")
}

/// That it wrote what it has to; otherwise the first line that differs.
fn compare(found: &str, script: &Script<'_>) {
    let mut model = 0;
    for (number, (found, expected)) in found.lines().zip(script.expected.lines()).enumerate() {
        model += usize::from(expected.starts_with("open"));
        assert_eq!(found, expected, "line {number}, model {model}");
    }
    assert_eq!(found.lines().count(), script.expected.lines().count());
    assert_eq!(found.len(), script.expected.len());
}

fn count(script: &Script<'_>, word: &str) -> usize {
    script.expected.lines().filter(|line| line.split(' ').next() == Some(word)).count()
}

#[test]
fn touches_and_rows_give_the_bits_of_the_crate() {
    let directory = tempfile::tempdir().unwrap();
    let program = here(&[], directory.path()).unwrap();
    let mut rng = SmallRng::seed_from_u64(1);
    let models = all_models(&mut rng);
    let script = script(&models, 150_000, 100_000, &mut rng);
    compare(&run(&mut Command::new(&program), &script.commands), &script);
    let counted = [count(&script, "touch"), count(&script, "features"), count(&script, "verdict")];
    println!("{counted:?} touches, features, verdicts; {} sums in f32", count(&script, "sums"));
    let verdicts = |verdict: &str| script.expected.lines().filter(|line| line.starts_with(verdict)).count();
    let verdicts =
        ["verdict 0", "verdict 1", "verdict 2", "verdict 3", "refused 1", "refused 2", "refused 3"].map(verdicts);
    assert!(counted[0] >= 100_000 && counted[1] >= counted[0] + 100_000, "{counted:?}");
    assert!(verdicts.iter().all(|&count| count > 100), "{verdicts:?}");
}

/// Verdict after verdict on a stream of rows.
fn play_stream<'m>(script: &mut Script<'m>, stream: &'m Stream) {
    assert!(script.open(&stream.bytes), "{}", stream.kind);
    for row in &stream.rows {
        script.row(row);
        if script.recognizer().verdict() != Verdict::Undecided {
            script.posteriors();
            script.reset();
        }
    }
}

#[test]
fn calibrated_models_of_five_kinds_give_the_same_verdicts_at_the_same_rows() {
    let directory = tempfile::tempdir().unwrap();
    let program = here(&[], directory.path()).unwrap();
    let streams = streams(10_000);
    for stream in &streams {
        let mut script = Script::default();
        play_stream(&mut script, stream);
        compare(&run(&mut Command::new(&program), &script.commands), &script);
        let given = script.expected.lines().filter(|line| line.starts_with("verdict 1")).count();
        let model = Model::new(&stream.bytes).unwrap();
        println!(
            "{}: {} rows, {given} names, a table: {}",
            stream.kind,
            stream.rows.len(),
            model.row_evidence().is_some()
        );
        assert!(given > 300 && count(&script, "verdict") >= 10_000, "{}: {given}", stream.kind);
        // Shares of votes are no log-probabilities.
        assert!(model.row_evidence().is_some() || stream.kind != "votes of a forest");
    }
}

/// A model with some bytes changed, moved, cut or put in; its length and checksum nearly always right.
fn mutant(models: &[Vec<u8>], rng: &mut SmallRng) -> Vec<u8> {
    let mut bytes = models[rng.random_range(0..models.len())].clone();
    for _ in 0..rng.random_range(1..5) {
        let at = match rng.random_range(0..4) {
            0 => rng.random_range(0..bytes.len().min(96)),
            1 => rng.random_range(bytes.len().min(96)..bytes.len().clamp(97, 200)).min(bytes.len() - 1),
            _ => rng.random_range(0..bytes.len()),
        };
        match rng.random_range(0..10) {
            0 => bytes[at] = rng.random(),
            1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => bytes[at] = [0, 1, 2, 127, 128, 255][rng.random_range(0..6)],
            3..5 => bytes[at] = bytes[at].wrapping_add(1),
            5..7 => bytes[at] = bytes[at].wrapping_sub(1),
            7 => {
                let number: u32 =
                    [0, u32::MAX, 1 << 31, rng.random(), rng.random_range(0..300)][rng.random_range(0..5)];
                let at = at & !3;
                bytes.iter_mut().skip(at).zip(number.to_le_bytes()).for_each(|(to, from)| *to = from);
            }
            8 => bytes.truncate(at.max(1)),
            _ => {
                let more: Vec<u8> = (0..rng.random_range(1..9)).map(|_| rng.random::<u8>() >> 4).collect();
                bytes.splice(at..at, more);
            }
        }
    }
    let seal = !rng.random_ratio(1, 30);
    let length = (bytes.len() as u32).to_le_bytes();
    if let Some(field) = bytes.get_mut(8..12).filter(|_| seal) {
        field.copy_from_slice(&length);
        sealed(&mut bytes);
    }
    bytes
}

/// A model with other sections, valid ones and others, that must be understood or not.
fn other_sections(bytes: &[u8], rng: &mut SmallRng) -> Vec<u8> {
    let mut sections = Vec::new();
    let mut tag = 0;
    for _ in 0..rng.random_range(1..4) {
        // Now and then the same tag again.
        let repeat = tag > 0 && rng.random_ratio(1, 20);
        tag += if repeat { 0 } else { rng.random_range(1..5) };
        let content: Vec<u8> = (0..rng.random_range(0..40)).map(|_| rng.random_range(0..3)).collect();
        let length = (content.len() as u32).to_le_bytes();
        let stated = tag | if rng.random_ratio(1, 4) { MUST_UNDERSTAND } else { 0 };
        sections.extend(stated.to_le_bytes().into_iter().chain([0; 2]).chain(length).chain(content));
        sections.resize(sections.len().next_multiple_of(4), 0);
    }
    with_sections(bytes, &sections)
}

#[test]
fn bytes_that_the_crate_refuses_are_refused_at_the_same_place_and_no_others() {
    let directory = tempfile::tempdir().unwrap();
    // The crate is built with every layout, code among them, which is none of the header's defaults.
    let layouts = "-DPALPATE_LAYOUTS=95";
    let sanitizers = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", layouts];
    let program = here(&sanitizers, directory.path()).unwrap_or_else(|error| {
        println!("SKIPPED: this compiler has no sanitizers, so only answers are compared: {error}");
        here(&[layouts], directory.path()).unwrap()
    });
    let mut rng = SmallRng::seed_from_u64(2);
    // Small ones, so that a change often hits what is checked.
    let mut models = all_models(&mut rng);
    models.retain(|bytes| bytes.len() < 3_000);
    let (mut accepted, mut refused) = (0, [0; 12]);
    for _ in 0..20 {
        let mutants: Vec<Vec<u8>> = (0..10_000)
            .map(|index| match index % 10 {
                0 => other_sections(&models[rng.random_range(0..models.len())], &mut rng),
                _ => mutant(&models, &mut rng),
            })
            .collect();
        let mut script = Script::default();
        for bytes in &mutants {
            if script.open(bytes) {
                accepted += 1;
                if is_specified(script.recognizer().model()) {
                    play(&mut script, 3, &mut rng);
                }
            }
        }
        for line in script.expected.lines().filter_map(|line| line.strip_prefix("open ")) {
            refused[line.split(' ').next().unwrap().parse::<usize>().unwrap()] += 1;
        }
        compare(&run(&mut Command::new(&program), &script.commands), &script);
    }
    println!("{accepted} of 200,000 mutants accepted; by error: {refused:?}");
    assert!(accepted > 10_000 && refused[..9].iter().all(|&count| count > 100), "{accepted} {refused:?}");
}

#[test]
fn posteriors_at_the_highest_temperature_are_those_of_the_crate_however_far_objects_are_apart() {
    let directory = tempfile::tempdir().unwrap();
    let program = here(&[], directory.path()).unwrap();
    // The highest temperature there is.
    let temperature = (Tag::Temperature, Some((false, Temperature::new(16.0).unwrap().to_bytes().to_vec())));
    let restated = Restated { sections: vec![temperature], ..Restated::default() };
    let household = std::fs::read(Path::new(ROOT).join("models/household.palpate")).unwrap();
    let bytes = restate(&Model::new(&household).unwrap(), &restated).unwrap();
    let model = Model::new(&bytes).unwrap();
    let mut script = Script::default();
    assert!(script.open(&bytes));
    for behind in [0, 1, 1 << 20, (1 << 32) - 1, 1 << 32, (1 << 32) + 1, 1 << 40, i64::MAX] {
        let evidence: Vec<i64> =
            (0..model.object_count()).map(|object| if object == 3 { 0 } else { -behind }).collect();
        script.restore(&snapshot(&model, 7, 0, 0, &evidence));
        script.posteriors();
    }
    compare(&run(&mut Command::new(&program), &script.commands), &script);
}

#[test]
fn a_snapshot_with_forgotten_touches_is_taken_over_and_the_touches_after_it_give_the_bits_of_the_crate() {
    let directory = tempfile::tempdir().unwrap();
    let program = here(&[], directory.path()).unwrap();
    let mut rng = SmallRng::seed_from_u64(6);
    let models = all_models(&mut rng);
    let mut script = Script::default();
    let mut taken = 0;
    for bytes in models.iter().filter(|bytes| bytes[12] != 255) {
        assert!(script.open(bytes));
        let model = *script.recognizer().model();
        let evidence = vec![0; model.object_count()];
        for (touches, forgotten) in [(9, 8), (9, 1), (200, 150), (u32::MAX, u32::MAX - 1), (9, 0), (9, 9), (1, 1)] {
            let with = forgetful(&model, touches, forgotten, &evidence);
            script.restore(&with);
            if script.recognizer().touches() == touches && (1..touches).contains(&forgotten) {
                taken += 1;
                assert_eq!(script.snapshot(), with);
            }
            play(&mut script, 3, &mut rng);
        }
    }
    assert!(taken > 4 * 40, "{taken}");
    compare(&run(&mut Command::new(&program), &script.commands), &script);
}

#[test]
fn the_bytes_of_the_vectors_that_are_no_models_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let program = here(&[], directory.path()).unwrap();
    let words = VECTORS.lines().filter_map(|line| line.strip_prefix("refuse "));
    let abuses: Vec<Vec<u8>> = words.map(|words| vectors::bytes(words.split(' ').next().unwrap())).collect();
    let mut script = Script::default();
    assert!(abuses.len() > 60 && abuses.iter().all(|bytes| !script.open(bytes)));
    compare(&run(&mut Command::new(&program), &script.commands), &script);
}

#[test]
fn a_model_that_export_emits_compiles_without_warnings_and_is_opened() {
    let directory = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
    put("palpate.h", palpate_onboard::C_HEADER);
    for (index, bytes) in models().iter().enumerate().filter(|(index, _)| index % 8 == 0) {
        let model = Model::new(bytes).unwrap();
        put("a_model.h", &emit(&model, "a model", Language::C));
        let checks = "palpate_open(&model, a_model_model, sizeof a_model_model) || palpate_start(&recognizer, &model)";
        put(
            "program.c",
            &format!(
                "#include \"a_model.h\"\nstatic palpate_model model;\nstatic palpate_recognizer recognizer;\n\
                 int main(void)\n{{\n    return {checks} || model.objects != {};\n}}\n",
                model.object_count()
            ),
        );
        let program = directory.path().join("program");
        let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
        compile(&compiler, &[], directory.path().join("program.c").to_str().unwrap(), &program).unwrap();
        assert!(Command::new(&program).status().unwrap().success(), "model {index}");
    }
}

#[test]
fn two_models_in_one_file_say_which_lines_make_room_for_both_and_compile_with_them() {
    let directory = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
    put("palpate.h", palpate_onboard::C_HEADER);
    let of = |layout: u8, leaf: u8, objects: u8| {
        let mut all = models().into_iter();
        all.find(|bytes| (bytes[6], bytes[7]) == (layout, leaf) && bytes[14] >= objects).expect("such a model")
    };
    for (index, bytes) in [of(0, 0, 1), of(2, 1, 2)].iter().enumerate() {
        let name = ["first", "second"][index];
        put(&format!("{name}.h"), &emit(&Model::new(bytes).unwrap(), name, Language::C));
    }
    let includes = "#include \"first.h\"\n#include \"second.h\"\n";
    let uses = "static palpate_model model;\nint main(void)\n{\n    return palpate_open(&model, first_model, sizeof first_model) \
                || palpate_open(&model, second_model, sizeof second_model);\n}\n";
    let program = directory.path().join("program");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let compiled = |lines: &str| {
        put("program.c", &format!("{lines}{includes}{uses}"));
        compile(&compiler, &[], directory.path().join("program.c").to_str().unwrap(), &program)
    };
    // As the messages say, line by line, until there is none.
    let mut lines = String::new();
    let mut said = 0;
    while let Err(message) = compiled(&lines) {
        let (_, rest) =
            message.split_once("model SECOND: before the first model is included, #define ").expect(&message);
        let line = rest.split('"').next().unwrap();
        lines += &format!(
            "#define {}\n",
            line.replace("those of the others", ["PALPATE_COMPACT", "PALPATE_I8"][said.min(1)])
        );
        said += 1;
        assert!(said < 6, "{message}");
    }
    assert!(said >= 2 && lines.contains("PALPATE_LAYOUTS") && lines.contains("PALPATE_LEAVES"), "{lines}");
    assert!(Command::new(&program).status().unwrap().success(), "{lines}");
}

#[test]
fn cpp_has_no_warning_of_old_style_casts() {
    let directory = tempfile::tempdir().unwrap();
    let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".into());
    for defined in ["EVERYTHING", "ROWS", "PALPATE_MAX_OBJECTS=256"] {
        let mut command = Command::new(&compiler);
        command.args(["-std=c++11", "-x", "c++", "-Wall", "-Wextra", "-Wconversion", "-Wold-style-cast", "-pedantic"]);
        command.args(["-Werror", "-O1", "-D", defined, "-I"]).arg(Path::new(ROOT).join("onboard/c")).arg("-c");
        command.arg(Path::new(ROOT).join("tests/c/size.c")).arg("-o").arg(directory.path().join("o"));
        let Ok(output) = command.output() else { return println!("SKIPPED: there is no {compiler}") };
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

/// A bare chip: compiler, flags, emulator.
const CHIPS: [(&str, &str, &str, &str); 3] = [
    (
        "Cortex-M0+",
        "arm-none-eabi-gcc",
        "-mcpu=cortex-m0plus -mthumb -T tests/c/mps2.ld",
        "qemu-system-arm -machine mps2-an385",
    ),
    (
        "Cortex-M4F",
        "arm-none-eabi-gcc",
        "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -T tests/c/mps2.ld",
        "qemu-system-arm -machine mps2-an386",
    ),
    (
        "RISC-V rv32imc",
        "riscv64-unknown-elf-gcc",
        "-march=rv32imc -mabi=ilp32 -T tests/c/virt.ld",
        "qemu-system-riscv32 -machine virt -bios none",
    ),
];

#[test]
#[ignore = "needs cross compilers and emulators: .ci/run c"]
fn emulated_chips_give_the_bits_of_the_crate() {
    let mut rng = SmallRng::seed_from_u64(3);
    let mut models = all_models(&mut rng);
    // 256 objects are hundreds of numbers to write.
    models.retain(|bytes| bytes[14] < 20);
    let touches = std::env::var("PALPATE_C_TOUCHES").map_or(2_000, |count| count.parse().expect("a number of touches"));
    let streams = streams(touches);
    let mut script = script(&models, touches, touches, &mut rng);
    streams.iter().for_each(|stream| play_stream(&mut script, stream));
    for (chip, compiler, flags, emulator) in CHIPS {
        let directory = tempfile::tempdir().unwrap();
        let program = directory.path().join("replay");
        let linker: Vec<String> =
            flags.split(' ').map(|flag| flag.replace("tests/c", &format!("{ROOT}/tests/c"))).collect();
        let mut all = vec!["-Os", "-ffreestanding", "-nostdlib", "-static", "-Wl,--no-warn-rwx-segments"];
        all.extend(linker.iter().map(String::as_str));
        compile(compiler, &all, "chip.c", &program).unwrap();
        std::fs::write(directory.path().join("commands"), &script.commands).unwrap();
        let mut words = emulator.split(' ');
        let mut command = Command::new(words.next().unwrap());
        command.args(words).args(["-nographic", "-semihosting-config", "enable=on,target=native", "-kernel"]);
        let status = command.arg(&program).current_dir(directory.path()).stdin(Stdio::null()).status().unwrap();
        assert!(status.success(), "{chip}: {status}");
        compare(&std::fs::read_to_string(directory.path().join("results")).unwrap(), &script);
        println!("{chip}: {} touches, {} results", count(&script, "touch"), count(&script, "verdict"));
    }
}

#[test]
#[ignore = "needs a cross compiler and an emulator: .ci/run c"]
fn a_big_endian_machine_gives_the_bits_of_the_crate() {
    let directory = tempfile::tempdir().unwrap();
    let program = directory.path().join("replay");
    // With strict C99 this machine would add in f64, which the header refuses.
    compile("s390x-linux-gnu-gcc", &["-fexcess-precision=fast", "-static"], "host.c", &program).unwrap();
    let mut rng = SmallRng::seed_from_u64(5);
    let models = all_models(&mut rng);
    let script = script(&models, 20_000, 20_000, &mut rng);
    compare(&run(Command::new("qemu-s390x").arg(&program), &script.commands), &script);
    println!("s390x: {} touches, {} results", count(&script, "touch"), count(&script, "verdict"));
}

/// Bytes of exporters are those beyond an empty image: a routine in that image would be missing from all of them that call it.
#[test]
#[ignore = "needs a cross compiler: .ci/run c"]
fn the_empty_image_of_the_peers_harness_hides_no_routine_of_the_compiler() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(
        directory.path().join("rows.h"),
        "enum { ROWS = 1, FEATURES = 1, PLAIN = 1 };\nstatic const float rows[] = {0.0f};\n",
    )
    .unwrap();
    let root = Path::new(ROOT);
    let mut command = Command::new("arm-none-eabi-gcc");
    command.args(["-std=gnu99", "-mcpu=cortex-m0plus", "-mthumb", "-Os", "-static", "-Wl,--no-warn-rwx-segments"]);
    // No library: a routine that is called has no definition.
    command.args(["-nostdlib", "-ffunction-sections", "-Wl,--gc-sections", "-T"]).arg(root.join("tests/c/mps2.ld"));
    command.arg("-I").arg(directory.path()).arg("-I").arg(root.join("tests/c"));
    for file in ["harness.c", "nothing.c"] {
        command.arg(root.join("tests/peers/exporters").join(file));
    }
    let output = command.arg("-o").arg(directory.path().join("image")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Output of an ATmega2560 until the 0 at the end.
fn run_avr(program: &Path, directory: &Path) -> String {
    let results = directory.join("results");
    std::fs::write(&results, []).unwrap();
    let serial = format!("file:{}", results.display());
    let mut command = Command::new("qemu-system-avr");
    command.args(["-machine", "mega2560", "-nographic", "-monitor", "none", "-serial", &serial, "-bios"]).arg(program);
    let mut child = command.stdin(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    loop {
        let found = std::fs::read(&results).unwrap();
        if let Some((0, text)) = found.split_last() {
            // The machine has no end of its own.
            child.kill().and_then(|()| child.wait()).unwrap();
            return String::from_utf8(text.to_vec()).unwrap();
        }
        assert!(child.try_wait().unwrap().is_none(), "it ended early");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}

#[test]
#[ignore = "needs avr-gcc and an emulator: .ci/run c"]
fn an_emulated_avr_gives_the_bits_of_the_crate() {
    let directory = tempfile::tempdir().unwrap();
    let program = directory.path().join("replay");
    let mut rng = SmallRng::seed_from_u64(4);
    let mut models = all_models(&mut rng);
    models.retain(|bytes| bytes.len() < 3_000 && bytes[14] < 12);
    // With the program below 64 KB: beyond, the emulated chip does not find what its variables begin with.
    let mut batches: Vec<Vec<Vec<u8>>> = vec![Vec::new()];
    for model in models {
        let taken: usize = batches.last().unwrap().iter().map(|model| model.len() + 2_500).sum();
        if taken + model.len() + 2_500 > 12_000 {
            batches.push(Vec::new());
        }
        batches.last_mut().unwrap().push(model);
    }
    let mut counted = [0; 2];
    for batch in &batches {
        let script = script(batch, 25 * batch.len(), 25 * batch.len(), &mut rng);
        let bytes: Vec<String> = script.commands.iter().map(u8::to_string).collect();
        let source = format!("static const uint8_t commands[] PROGMEM = {{{}}};\n", bytes.join(","));
        std::fs::write(directory.path().join("commands.h"), source).unwrap();
        let include = format!("-I{}", directory.path().display());
        compile("avr-gcc", &["-mmcu=atmega2560", &include], "avr.c", &program).unwrap();
        compare(&run_avr(&program, directory.path()), &script);
        counted = [counted[0] + count(&script, "touch"), counted[1] + count(&script, "verdict")];
    }
    println!("AVR: {} touches, {} results, {} images", counted[0], counted[1], batches.len());
}
