//! `onboard/c/palpate.h` gives the bits that the crate gives: on this machine, under sanitizers, and on emulated chips.

use palpate::compile::{Language, emit};
use palpate_onboard::Model;
use palpate_shared::format::{
    FitTerms, Held, MUST_UNDERSTAND, ObjectFit, OddsByObject, Plan, Section, Strangers, Tag, Temperature, f32_key,
    write_section,
};
use palpate_shared::{ContactTime, MISSING_FEATURE, Pose, Poses, Touch};
use palpate_tests::replay::{Script, is_specified};
use palpate_tests::sections::with_sections;
use palpate_tests::vectors;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const VECTORS: &str = include_str!("../../shared/vectors/vectors.txt");

/// The test vectors' models: every layout, type of leaf, and descriptor, and rows of features; and the real one.
fn models() -> Vec<Vec<u8>> {
    let words = VECTORS.lines().filter_map(|line| line.strip_prefix("model "));
    let models = words.map(|words| vectors::bytes(words.split(' ').next().expect("bytes")));
    let mut models: Vec<Vec<u8>> = models.collect();
    assert!(models.len() > 60, "{} models", models.len());
    models.push(std::fs::read(Path::new(ROOT).join("models/household.palpate")).expect("the committed model"));
    models
}

/// The model with sections that the header has to understand or to leave alone.
fn with_all_sections(bytes: &[u8], rng: &mut SmallRng) -> Vec<u8> {
    let model = Model::new(bytes).expect("a model");
    let objects = model.object_count();
    let odds: Vec<u8> = (0..objects).flat_map(|_| OddsByObject::to_bytes(rng.random_range(0..1 << 56))).collect();
    let poses = Poses::with_rolls(2).expect("rolls");
    let mut plan = Plan::header(poses).to_vec();
    plan.extend((0..Plan::pairs(objects) * usize::from(poses.count())).map(|_| rng.random::<u8>()));
    let temperature = Temperature::new(rng.random_range(0.1..10.0)).expect("a temperature");
    let mut sections = Vec::new();
    let mut put = |bytes: &[u8]| sections.extend_from_slice(bytes);
    let own = model.optional_sections().filter(|section| section.tag < Tag::ThresholdsByObject.code());
    own.for_each(|section| section.write(&mut put));
    write_section(Tag::ThresholdsByObject, true, &odds, &mut put);
    let background = rng.random_bool(0.5) && objects > 1;
    if rng.random_bool(0.7) {
        write_section(Tag::Strangers, true, &strangers(objects, background, rng), &mut put);
    }
    if objects > 1 {
        write_section(Tag::Plan, false, &plan, &mut put);
    }
    write_section(Tag::Temperature, false, &temperature.to_bytes(), &mut put);
    Section { tag: 300, must_understand: false, content: b"later" }.write(&mut put);
    with_sections(bytes, &sections)
}

/// A background, and mostly a test of fit, with limits that some touches pass and some do not.
fn strangers(objects: usize, background: bool, rng: &mut SmallRng) -> Vec<u8> {
    let has_test = rng.random_bool(0.8);
    let mut content = Strangers::header(background, has_test).to_vec();
    if !has_test {
        return content;
    }
    let rivals: u8 = rng.random_range(1..=16);
    let first = rng.random_range(1..4);
    let doubt = rng.random_range(-(1 << 20)..1 << 20);
    let terms = FitTerms {
        held: Held::Likely,
        rivals,
        first,
        least: first + rng.random_range(0..3),
        threshold: doubt + rng.random_range(0..1 << 20),
        early: rng.random_range(0..1 << 20),
        doubt,
        halving: rng.random_range(0..u32::MAX),
        alarms: 10_000,
        sequences: 1_000,
        confidence: 950_000,
    };
    content.extend(terms.to_bytes());
    for _ in 0..objects - usize::from(background) {
        let shifts = [rng.random_range(0..12), rng.random_range(8..24), rng.random_range(8..24)];
        let own: Vec<u8> = (0..rivals).map(|_| rng.random_range(0..objects) as u8).collect();
        let count = usize::from(rivals);
        let numbers: Vec<i16> = (0..2 * count + count * (count + 1) / 2).map(|_| rng.random()).collect();
        let constant = rng.random_range(-100_000..100_000);
        ObjectFit::write(shifts, constant, &own, numbers.into_iter(), &mut |part| content.extend_from_slice(part));
    }
    content
}

/// A touch, now and then a partial one, or one at the limits of features.
fn touch(rng: &mut SmallRng) -> Touch {
    let common = rng.random_range(0..3) * 1_000_000_000;
    let mut time = || match rng.random_range(0..12) {
        0 => ContactTime::MISSING,
        1 => ContactTime::from_micros(common),
        2 => ContactTime::from_micros(rng.random_range(0..50)),
        3 => ContactTime::from_micros(rng.random_range(0..u32::MAX)),
        _ => ContactTime::from_micros(common + rng.random_range(0..150_000)),
    };
    let touch = Touch::new([time(), time(), time()]);
    if rng.random_bool(0.1) {
        return touch;
    }
    let mut vector = || {
        [(); 3].map(|()| match rng.random_range(0..5) {
            0 => 0,
            1 => i16::MIN,
            _ => rng.random_range(-32_767..=32_767),
        })
    };
    touch.with_pose(Pose { direction: vector(), alignment: vector() })
}

/// A row; of any length.
fn row(features: usize, rng: &mut SmallRng) -> Vec<i32> {
    let length = if rng.random_bool(0.95) { features } else { rng.random_range(0..=(features + 2).min(256)) };
    let value = |_| match rng.random_range(0..8) {
        0 => MISSING_FEATURE,
        1 => rng.random_range(i32::MIN..=i32::MAX),
        2 => rng.random_range(-300..300),
        3 => rng.random_range(-200_000..200_000),
        _ => f32_key(rng.random_range(-200.0..200.0_f32)),
    };
    (0..length).map(value).collect()
}

/// Touches, or rows, of a model that is open, and now and then what else there is to ask.
fn play(script: &mut Script<'_>, count: usize, rng: &mut SmallRng) {
    let model = *script.recognizer().model();
    let objects = model.object_count();
    for index in 0..count {
        if model.descriptor().is_some() {
            script.touch(&touch(rng));
        } else {
            script.row(&row(model.feature_count(), rng));
        }
        if rng.random_bool(0.3 / objects as f64) {
            script.posteriors();
        }
        if index == 2 || rng.random_bool(0.1 / objects as f64) {
            let mut snapshot = script.snapshot();
            if rng.random_bool(0.5) {
                script.reset();
            }
            if rng.random_bool(0.5) {
                let at = rng.random_range(0..snapshot.len());
                snapshot[at] ^= 1 << rng.random_range(0..8);
                if rng.random_bool(0.7) {
                    sealed(&mut snapshot);
                }
            }
            script.restore(&snapshot);
        }
        if rng.random_bool(0.05) {
            script.reset();
        }
    }
}

fn sealed(bytes: &mut [u8]) {
    if let Some((body, sum)) = bytes.split_last_chunk_mut() {
        *sum = palpate_shared::format::checksum(body).to_le_bytes();
    }
}

/// Models, and together so many touches and rows.
fn script<'m>(models: &'m [Vec<u8>], touches: usize, rows: usize, rng: &mut SmallRng) -> Script<'m> {
    let is_touches = |bytes: &&Vec<u8>| bytes[12] != 255;
    let of_touches = models.iter().filter(is_touches).count();
    let mut script = Script::default();
    for bytes in models {
        assert!(script.open(bytes));
        script.names();
        script.posteriors();
        script.snapshot();
        // What the other kind of model takes is refused.
        script.touch(&touch(rng));
        script.row(&[1, 2, 3]);
        let (all, of) = if is_touches(&bytes) { (touches, of_touches) } else { (rows, models.len() - of_touches) };
        play(&mut script, all.div_ceil(of), rng);
    }
    script
}

/// Every model as it is and with all sections.
fn all_models(rng: &mut SmallRng) -> Vec<Vec<u8>> {
    let models = models();
    let stated: Vec<Vec<u8>> = models.iter().map(|bytes| with_all_sections(bytes, rng)).collect();
    [models, stated].concat()
}

/// The test program of a machine.
fn compile(compiler: &str, flags: &[&str], source: &str, program: &Path) -> Result<(), String> {
    let mut command = Command::new(compiler);
    command.args(["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"]).args(flags);
    command.arg("-I").arg(Path::new(ROOT).join("onboard/c")).arg("-o").arg(program);
    command.arg(Path::new(ROOT).join("tests/c").join(source)).arg(if source == "chip.c" { "-lgcc" } else { "-O2" });
    let output = command.output().map_err(|error| format!("{compiler}: {error}"))?;
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

fn here(flags: &[&str], directory: &Path) -> Result<PathBuf, String> {
    let program = directory.join("replay");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    compile(&compiler, flags, "host.c", &program).map(|()| program)
}

/// What the program writes.
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
    let script = script(&models, 120_000, 100_000, &mut rng);
    compare(&run(&mut Command::new(&program), &script.commands), &script);
    let counted = [count(&script, "touch"), count(&script, "features"), count(&script, "verdict")];
    println!("{counted:?} touches, features, verdicts; {} sums in f32", count(&script, "sums"));
    let verdicts = |verdict: &str| script.expected.lines().filter(|line| line.starts_with(verdict)).count();
    let verdicts =
        ["verdict 0", "verdict 1", "verdict 2", "verdict 3", "refused 1", "refused 2", "refused 3"].map(verdicts);
    assert!(counted[0] >= 100_000 && counted[1] >= counted[0] + 100_000, "{counted:?}");
    assert!(verdicts.iter().all(|&count| count > 100), "{verdicts:?}");
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
    let sanitizers = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let program = here(&sanitizers, directory.path()).unwrap_or_else(|error| {
        println!("SKIPPED: this compiler has no sanitizers, so only answers are compared: {error}");
        here(&[], directory.path()).unwrap()
    });
    let mut rng = SmallRng::seed_from_u64(2);
    // Small ones, so that a change often hits what is checked.
    let mut models = all_models(&mut rng);
    models.retain(|bytes| bytes.len() < 3_000);
    let (mut accepted, mut refused) = (0, [0; 9]);
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
    assert!(accepted > 10_000 && refused.iter().all(|&count| count > 100), "{accepted} {refused:?}");
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
    let script = script(&models, touches, touches, &mut rng);
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

/// What an ATmega2560 writes until the 0 at the end.
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
        if taken + model.len() + 2_500 > 22_000 {
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
