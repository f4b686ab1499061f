//! `onboard/c/palpate.h` gives the bits that the crate gives: on this machine, under sanitizers, and on emulated chips.

use palpate::compile::{Language, Layout, Leaf, Restated, Settings, emit, restate};
use palpate_onboard::{Model, Verdict};
use palpate_shared::format::{Tag, Temperature};
use palpate_tests::abuse::{self, cuts};
use palpate_tests::mutants::{Parts, mutant, sweep};
use palpate_tests::random::{self, Shape};
use palpate_tests::replay::{MARGINS_LEFT_OPEN, NAMES_LEFT_OPEN, Script, is_specified};
use palpate_tests::scripts::{all_models, models, play, script};
use palpate_tests::streams::{Stream, streams};
use palpate_tests::vectors::{self, Cut};
use palpate_tests::{HOUSEHOLD, ROOT};
use rand::SeedableRng;
use rand::rngs::SmallRng;
use std::collections::BTreeSet;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

const VECTORS: &str = include_str!("../../../shared/vectors/vectors.txt");

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

/// The C compiler of this machine.
fn cc() -> String {
    std::env::var("CC").unwrap_or_else(|_| "cc".into())
}

fn here(name: &str, flags: &[&str]) -> Result<PathBuf, String> {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    compile(&cc(), flags, "host.c", &program).map(|()| program)
}

/// The test program of this machine.
static PROGRAM: LazyLock<PathBuf> = LazyLock::new(|| here("replay", &[]).unwrap());

/// Same program under sanitizers, with every layout, including code, which is not one of the header's defaults.
static SANITIZED: LazyLock<PathBuf> = LazyLock::new(|| {
    let layouts = "-DPALPATE_LAYOUTS=7";
    let sanitizers = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", layouts];
    here("sanitized", &sanitizers).unwrap_or_else(|error| {
        println!("SKIPPED: this compiler has no sanitizers, so only answers are compared: {error}");
        here("sanitized", &[layouts]).unwrap()
    })
});

/// Output of the program, or its error.
fn answers(program: &mut Command, commands: &[u8]) -> Result<String, String> {
    program.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = program.spawn().map_err(|error| format!("{program:?}: {error}"))?;
    let mut input = child.stdin.take().expect("a pipe");
    let output = std::thread::scope(|scope| {
        // A program that fails does not read everything.
        scope.spawn(move || _ = input.write_all(commands));
        child.wait_with_output().expect("it ends")
    });
    if output.status.success() {
        return Ok(String::from_utf8(output.stdout).expect("text"));
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(format!("{}: {}", output.status, said.lines().take(12).collect::<Vec<_>>().join("\n")))
}

/// Output of a program that does not fail.
fn run(program: &mut Command, commands: &[u8]) -> String {
    answers(program, commands).unwrap_or_else(|error| panic!("{error}"))
}

/// Asserts that it wrote the expected output; otherwise reports the first line that differs.
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
    let mut rng = SmallRng::seed_from_u64(1);
    let models = all_models(&mut rng);
    let script = script(&models, 30_000, 30_000, &mut rng);
    compare(&run(&mut Command::new(&*PROGRAM), &script.commands), &script);
    let counted = [count(&script, "touch"), count(&script, "features"), count(&script, "verdict")];
    println!("{counted:?} touches, features, verdicts; {} sums in f32", count(&script, "sums"));
    let verdicts = |verdict: &str| script.expected.lines().filter(|line| line.starts_with(verdict)).count();
    let verdicts =
        ["verdict 0", "verdict 1", "verdict 2", "verdict 3", "refused 1", "refused 2", "refused 3"].map(verdicts);
    assert!(counted[0] >= 20_000 && counted[1] >= counted[0] + 20_000, "{counted:?}");
    assert!(verdicts.iter().all(|&count| count > 10), "{verdicts:?}");
    let (guarded, next) = (count(&script, "guarded"), script.next_rows);
    println!("{guarded} of {next} rows of sequences are not taken");
    assert!(guarded > 200 && next > 2 * guarded, "{guarded} of {next}");
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
    let streams = streams(3_000);
    for stream in &streams {
        let mut script = Script::default();
        play_stream(&mut script, stream);
        compare(&run(&mut Command::new(&*PROGRAM), &script.commands), &script);
        let given = script.expected.lines().filter(|line| line.starts_with("verdict 1")).count();
        let model = Model::new(&stream.bytes).unwrap();
        println!(
            "{}: {} rows, {given} names, a table: {}",
            stream.kind,
            stream.rows.len(),
            model.row_evidence().is_some()
        );
        assert!(given > 90 && count(&script, "verdict") >= 3_000, "{}: {given}", stream.kind);
        // Shares of votes are no log-probabilities.
        assert!(model.row_evidence().is_some() || stream.kind != "votes of a forest");
    }
}

/// Models of a batch.
const BATCH: usize = 4_000;
/// Differences after which it looks for no more.
const ENOUGH: usize = 20;

/// The number in a variable of the environment.
fn set(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|value| value.parse().unwrap_or_else(|_| panic!("{name} is no number: {value}")))
}

/// Damaged models, and what was done to each: all of it follows from the seed and the batch's number. The first batch is a sweep.
fn batch(models: &[Parts], seed: u64, number: u64) -> Vec<(Vec<u8>, String)> {
    if number == 0 {
        let of_i8 = cuts().into_iter().map(|(_, base, _)| base);
        let of_i16 = [Layout::Compact, Layout::Wide].map(|layout| abuse::model(layout, Leaf::I16, false));
        let models: Vec<Parts> = of_i8.chain(of_i16).map(|base| Parts::of(&base)).collect();
        return sweep(&models, &mut SmallRng::seed_from_u64(seed));
    }
    let mut rng = SmallRng::seed_from_u64(seed.wrapping_mul(1 << 32).wrapping_add(number));
    (0..BATCH).map(|_| mutant(models, &mut rng)).collect()
}

/// Commands for damaged models and what has to come out, where those of each model end, and how many are refused for each reason.
struct Batch<'m> {
    mutants: &'m [(Vec<u8>, String)],
    script: Script<'m>,
    ends: Vec<[usize; 2]>,
    refused: [usize; 13],
}

impl<'m> Batch<'m> {
    fn new(mutants: &'m [(Vec<u8>, String)]) -> Self {
        let (mut script, mut ends, mut refused) = (Script::default(), vec![[0; 2]], [0; 13]);
        let mut rng = SmallRng::seed_from_u64(7);
        for (bytes, _) in mutants {
            if script.open(bytes) {
                let model = *script.recognizer().model();
                if !NAMES_LEFT_OPEN.1(&model) {
                    script.names();
                }
                if is_specified(&model) {
                    play(&mut script, 3, &mut rng);
                }
            }
            let [_, start] = ends[ends.len() - 1];
            let code = script.expected[start..].strip_prefix("open ").and_then(|line| line.split(' ').next());
            refused[usize::from_str_radix(code.unwrap(), 16).unwrap()] += 1;
            ends.push([script.commands.len(), script.expected.len()]);
        }
        Self { mutants, script, ends, refused }
    }

    /// Puts the models among these that the program does not answer as the crate does, and its answers, into `differences`.
    fn differences(&self, program: &Path, models: Range<usize>, differences: &mut Vec<(usize, String)>) {
        if differences.len() > ENOUGH {
            return;
        }
        let ([from, start], [to, end]) = (self.ends[models.start], self.ends[models.end]);
        let expected = &self.script.expected[start..end];
        let found = answers(&mut Command::new(program), &self.script.commands[from..to]);
        if found.as_deref() == Ok(expected) {
            return;
        }
        if models.len() > 1 {
            let middle = usize::midpoint(models.start, models.end);
            self.differences(program, models.start..middle, differences);
            self.differences(program, middle..models.end, differences);
            return;
        }
        let found = match found {
            Err(error) => error,
            Ok(found) => {
                let mut lines = found.lines().zip(expected.lines());
                let line = lines.find(|(found, expected)| found != expected);
                line.map_or("another number of lines".into(), |(found, expected)| format!("{found}, not {expected}"))
            }
        };
        differences.push((models.start, found));
    }
}

#[test]
fn damaged_models_are_taken_or_refused_alike_at_the_same_place_and_give_the_same_answers() {
    // With the sweep, which is the first batch, they are 100,000.
    damaged(52_000, None);
}

#[test]
fn every_section_of_the_format_is_among_those_that_are_cut_at_every_length() {
    let format = include_str!("../../../shared/FORMAT.md");
    let table = format.split("| tag | must understand | content |").nth(1).expect("the sections");
    let tag = |line: &str| line.strip_prefix("| ")?.split(' ').next()?.parse().ok();
    let stated: BTreeSet<u16> = table.lines().skip(2).map_while(tag).collect();
    let of = |base: &[u8]| Model::new(base).unwrap().optional_sections().map(|section| section.tag).collect::<Vec<_>>();
    let mut cut: BTreeSet<u16> = cuts().iter().flat_map(|(_, base, _)| of(base)).collect();
    // Maps are no trees: the header does not read them.
    cut.insert(Tag::Maps.code());
    assert_eq!(cut, stated);
}

/// An hour of it is `PALPATE_FUZZ_SECONDS=3600 cargo test --release -p palpate-tests --test whole damaged_models -- --ignored --nocapture`.
#[test]
#[ignore = "takes a minute, or PALPATE_FUZZ_SECONDS"]
fn damaged_models_of_a_minute_are_taken_or_refused_alike_and_give_the_same_answers() {
    damaged(u64::MAX, Some(set("PALPATE_FUZZ_SECONDS").unwrap_or(60)));
}

/// Every damaged model is taken by both, or refused by both for the same reason at the same place; answers are the same except where
/// `MARGINS_LEFT_OPEN` and `NAMES_LEFT_OPEN` say that FORMAT.md leaves them open. PALPATE_FUZZ_SEED gives other models, the same seed
/// the same.
fn damaged(most: u64, seconds: Option<u64>) {
    let seed = set("PALPATE_FUZZ_SEED").unwrap_or(1);
    let mut models = all_models(&mut SmallRng::seed_from_u64(2));
    models.extend(cuts().into_iter().map(|(_, base, _)| base));
    // Of small ones a change often hits what is checked; one large model is there for lengths beyond two bytes.
    models.retain(|bytes| bytes.len() < 3_000);
    let parts: Vec<Parts> = models.iter().map(Vec::as_slice).chain([HOUSEHOLD]).map(Parts::of).collect();
    let (next, began) = (AtomicU64::new(0), Instant::now());
    let is_over = |number: u64| {
        number.saturating_mul(BATCH as u64) >= most
            || seconds.is_some_and(|seconds| began.elapsed().as_secs() >= seconds)
    };
    let work = || {
        let (mut count, mut refused, mut differences) = (0, [0; 13], Vec::new());
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if is_over(number) || differences.len() > ENOUGH {
                return (count, refused, differences);
            }
            let mutants = batch(&parts, seed, number);
            let batch = Batch::new(&mutants);
            let mut found = Vec::new();
            batch.differences(&SANITIZED, 0..mutants.len(), &mut found);
            for (index, answer) in found {
                let (bytes, what) = &batch.mutants[index];
                let path =
                    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("differs-{seed}-{number}-{index}.palpate"));
                std::fs::write(&path, bytes).unwrap();
                differences.push(format!("{}: {what}: {answer}", path.display()));
            }
            count += mutants.len();
            refused.iter_mut().zip(batch.refused).for_each(|(all, own)| *all += own);
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, |count| count.get().min(8));
    let (mut count, mut refused, mut differences) = (0, [0; 13], Vec::new());
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            let (own_count, own_refused, own_differences): (usize, [usize; 13], Vec<String>) = worker.join().unwrap();
            count += own_count;
            refused.iter_mut().zip(own_refused).for_each(|(all, own)| *all += own);
            differences.extend(own_differences);
        }
    });
    let [accepted, ref reasons @ ..] = refused;
    let rate = count as f64 / began.elapsed().as_secs_f64();
    println!("seed {seed}: {count} damaged models, {rate:.0} per second; {accepted} taken; by reason: {reasons:?}");
    assert!(differences.is_empty(), "{} models differ:\n{}", differences.len(), differences.join("\n"));
    assert!(count < 50_000 || 10 * accepted > count, "{accepted} of {count}");
    // The rarest are met about once in 4,400; how many there are in a minute depends on the machine.
    assert!(count < 50_000 || reasons[..8].iter().all(|&own| own > count / 10_000), "{reasons:?}");
}

#[test]
fn what_may_differ_is_what_the_specification_leaves_open() {
    let format = include_str!("../../../shared/FORMAT.md").split_whitespace().collect::<Vec<_>>().join(" ");
    for (sentence, _) in MARGINS_LEFT_OPEN.into_iter().chain([NAMES_LEFT_OPEN]) {
        assert!(format.contains(sentence), "{sentence}");
    }
}

#[test]
fn posteriors_at_the_highest_temperature_are_those_of_the_crate_however_far_objects_are_apart() {
    // The highest temperature there is.
    let temperature = (Tag::Temperature, Some((false, Temperature::new(16.0).unwrap().to_bytes().to_vec())));
    let restated = Restated { sections: vec![temperature], ..Restated::default() };
    let bytes = restate(&Model::new(HOUSEHOLD).unwrap(), &restated).unwrap();
    let model = Model::new(&bytes).unwrap();
    let mut script = Script::default();
    assert!(script.open(&bytes));
    for behind in [0, 1, 1 << 10, 1 << 20, (1 << 30) - 1, 1 << 30] {
        let margins: Vec<i32> = (0..model.object_count()).map(|object| if object == 3 { 0 } else { -behind }).collect();
        script.reset();
        script.margins(&margins);
        script.posteriors();
    }
    compare(&run(&mut Command::new(&*PROGRAM), &script.commands), &script);
}

#[test]
fn the_bytes_of_the_vectors_that_are_no_models_are_refused() {
    let words = VECTORS.lines().filter_map(|line| line.strip_prefix("refuse "));
    let abuses: Vec<Vec<u8>> = words.map(|words| vectors::bytes(words.split(' ').next().unwrap())).collect();
    let mut script = Script::default();
    assert!(abuses.len() > 60 && abuses.iter().all(|bytes| !script.open(bytes)));
    compare(&run(&mut Command::new(&*PROGRAM), &script.commands), &script);
}

#[test]
fn models_of_the_vectors_with_sections_and_parts_of_every_length_are_taken_or_refused_as_they_say() {
    let (mut models, mut expected, mut base) = (Vec::new(), String::new(), Vec::new());
    for line in VECTORS.lines() {
        let (word, words) = line.split_once(' ').unwrap_or((line, ""));
        match word {
            "model" => base = vectors::bytes(words.split(' ').next().unwrap()),
            "cut" => {
                let cut = Cut::read(words);
                for length in 0..cut.length {
                    models.push(cut.model(&base, length));
                    let (code, place) = match cut.expected(length) {
                        None => (0, 0),
                        Some(("field", place)) => (5, place),
                        Some(("section", place)) => (6, place),
                        Some((kind, _)) => panic!("{kind}"),
                    };
                    expected += &format!("open {code} {place:x}\n");
                }
            }
            _ => {}
        }
    }
    let mut commands = Vec::new();
    for bytes in &models {
        commands.push(b'M');
        commands.extend((bytes.len() as u32).to_le_bytes());
        commands.extend(bytes);
    }
    let found = run(&mut Command::new(&*SANITIZED), &commands);
    assert!(models.len() > 600, "{}", models.len());
    assert_eq!(found.lines().zip(expected.lines()).position(|(found, expected)| found != expected), None);
    assert_eq!(found.len(), expected.len());
}

/// A program that includes the header of a model, with the files that it needs, as `cc` compiles it; what the compiler says is an
/// error.
fn program_of(
    directory: &Path,
    name: &str,
    model: &Model<'_>,
    source: &str,
    flags: &[&str],
) -> Result<PathBuf, String> {
    let put = |file: &str, text: &str| std::fs::write(directory.join(file), text).unwrap();
    put("palpate.h", palpate_onboard::C_HEADER);
    put(&format!("{name}.h"), &emit(model, name, Language::C));
    put("program.c", source);
    let program = directory.join("program");
    compile(&cc(), flags, directory.join("program.c").to_str().unwrap(), &program).map(|()| program)
}

/// Calls with less room than there are objects, then with enough; returns 0 if all of them answered rightly.
const CALLS: &str = r#"#include "m.h"

static palpate_model model;
static int32_t margins[OBJECTS] = {5, 6};
static const int32_t row[3] = {1, 2, 3};
static const palpate_touch touch = {{0, 1, 2}, 0, {0, 0, 0}, {0, 0, 0}};

/* How many calls do not answer as they should. */
static int wrong(size_t room, palpate_error expected, int is_class, int has_sums)
{
    int count = palpate_margins_of(&model, row, 3, margins, room) != expected;
    count += palpate_margins(&model, &touch, margins, room) != expected;
    count += (palpate_predict_class(&model, row, 3, margins, room) != PALPATE_NO_CLASS) != is_class;
#if PALPATE_LEAVES & PALPATE_F32
    {
        float sums[OBJECTS] = {7.0f};
        count += palpate_f32_margins_of(&model, row, 3, sums, room) != has_sums;
        count += !has_sums && (sums[0] < 7.0f || sums[0] > 7.0f);
    }
#else
    (void)has_sums;
#endif
    return count;
}

int main(void)
{
    if (palpate_open(&model, m_model, sizeof m_model) != PALPATE_OK) {
        return 100;
    }
    if (wrong(OBJECTS - 1, PALPATE_TOO_MANY_OBJECTS, 0, 0) != 0 || margins[0] != 5 || margins[1] != 6) {
        return 50;
    }
    return wrong(OBJECTS, PALPATE_OK, 1, 1);
}
"#;

#[test]
fn calls_that_write_for_each_class_write_nothing_where_there_is_less_room_and_say_so() {
    let directory = tempfile::tempdir().unwrap();
    let all = models();
    let of = |leaf: u8, is_rows: bool| {
        let is_such = |bytes: &&Vec<u8>| (bytes[7], bytes[12] == 255) == (leaf, is_rows) && bytes[14] > 1;
        all.iter().find(is_such).expect("a model")
    };
    for bytes in [of(0, true), of(2, true), of(0, false)] {
        let model = Model::new(bytes).unwrap();
        let source = CALLS.replace("OBJECTS", &model.object_count().to_string());
        // The error's name has the word as well.
        let source = source.replace(&format!("TOO_MANY_{}", model.object_count()), "TOO_MANY_OBJECTS");
        let program = program_of(directory.path(), "m", &model, &source, &[]).unwrap();
        let status = Command::new(&program).status().unwrap();
        assert!(status.success(), "{status}: {:?} {:?}", model.leaf_type(), model.descriptor());
    }
}

#[test]
fn f32_leaves_are_refused_where_floats_are_evaluated_in_a_wider_type_and_nowhere_else() {
    let directory = tempfile::tempdir().unwrap();
    let source = directory.path().join("program.c");
    std::fs::write(&source, "#include \"palpate.h\"\nint main(void)\n{\n    return 0;\n}\n").unwrap();
    let include = format!("-I{}", directory.path().display());
    for (method, is_taken) in [(0, true), (16, true), (32, true), (-1, false), (1, false), (2, false), (64, false)] {
        let float = format!("#define FLT_EVAL_METHOD {method}\n");
        std::fs::write(directory.path().join("float.h"), float).unwrap();
        for (leaves, is_taken) in [("-DPALPATE_LEAVES=4", is_taken), ("-DPALPATE_LEAVES=3", true)] {
            let found = compile(&cc(), &[&include, leaves], source.to_str().unwrap(), &directory.path().join("o"));
            assert_eq!(found.is_ok(), is_taken, "{method}, {leaves}: {found:?}");
            assert!(found.map_or_else(|error| error.contains("--leaf i16"), |()| true), "{method}");
        }
    }
}

#[test]
fn a_model_that_is_too_long_for_an_array_of_an_avr_says_so_there_and_what_to_do() {
    let directory = tempfile::tempdir().unwrap();
    let shape = Shape { objects: 8, trees: 1_200, depth: 4, each: true, ..Shape::SMALL };
    let long = palpate::compile::compile(&random::ensemble(shape, 1), &Settings::default()).unwrap().bytes;
    let model = Model::new(&long).unwrap();
    let source = "#include \"household.h\"\nint main(void)\n{\n    return household_model[0] != 80;\n}\n";
    // As an AVR's compiler reads it; the header that it would include is missing.
    let error = program_of(directory.path(), "household", &model, source, &["-D__AVR__", "-w"]).unwrap_err();
    assert!(
        error.contains(&format!("model HOUSEHOLD has {} bytes", long.len())) && error.contains("at most 32767"),
        "{error}"
    );
    assert!(program_of(directory.path(), "household", &model, source, &["-Wno-unused"]).is_ok());
}

#[test]
fn lengths_are_subtracted_in_one_place_of_the_header() {
    let code = palpate_onboard::C_HEADER.lines().filter(|line| !line.trim_start().starts_with(['*', '/']));
    let lengths = ["length", "rest", "room", "size", "least"];
    let subtracts = |line: &&str| {
        let words: Vec<&str> = line.split(' ').collect();
        words.windows(2).any(|pair| {
            let name = pair[0].trim_matches(|character: char| !character.is_alphanumeric() && character != '_');
            ["-", "-="].contains(&pair[1]) && (lengths.contains(&name) || pair[0].ends_with("end)"))
        })
    };
    let found: Vec<&str> = code.filter(subtracts).map(str::trim).collect();
    let expected = [
        "return head <= rest && (count >> 18 | size >> 14) == 0 && count * size <= rest - head;",
        // Of a name where there is room.
        "length = length < room ? length : room - 1;",
    ];
    assert_eq!(found, expected);
}

#[test]
fn a_model_that_export_emits_compiles_without_warnings_and_is_opened() {
    let directory = tempfile::tempdir().unwrap();
    for (index, bytes) in models().iter().enumerate().filter(|(index, _)| index % 8 == 0) {
        let model = Model::new(bytes).unwrap();
        let checks = "palpate_open(&model, m_model, sizeof m_model) || palpate_start(&recognizer, &model)";
        // The constant equals what was opened, except the place of the last check.
        let same = "model.wrong = 0, memcmp(&model, &m_opened_, sizeof model) || m_check()";
        let source = format!(
            "#include \"m.h\"\n#include <string.h>\nstatic palpate_model model;\n\
             static palpate_recognizer recognizer;\n\
             int main(void)\n{{\n    return {checks} || model.objects != {} || ({same});\n}}\n",
            model.object_count()
        );
        let program = program_of(directory.path(), "m", &model, &source, &[]).unwrap();
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
    for (index, bytes) in [of(0, 0, 1), of(1, 1, 2)].iter().enumerate() {
        let name = ["first", "second"][index];
        put(&format!("{name}.h"), &emit(&Model::new(bytes).unwrap(), name, Language::C));
    }
    let includes = "#include \"first.h\"\n#include \"second.h\"\n";
    let uses = "static palpate_model model;\nint main(void)\n{\n    return palpate_open(&model, first_model, sizeof first_model) \
                || palpate_open(&model, second_model, sizeof second_model);\n}\n";
    let program = directory.path().join("program");
    let compiled = |lines: &str| {
        put("program.c", &format!("{lines}{includes}{uses}"));
        compile(&cc(), &[], directory.path().join("program.c").to_str().unwrap(), &program)
    };
    // As the messages say, line by line, until there are no more messages.
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

/// A compiler, its flags, and what runs its programs; PALPATE_MACHINES names the compilers of those that are wanted: big-endian machines, those that allow no unaligned loads, other dialects
/// of C, and a compiler that is neither GCC nor Clang. With strict C99 an s390x would add in f64, which the header refuses.
///
/// Two that Debian has compilers for are not among them: under QEMU 7.2 not even an empty program ends for sh4, and one for
/// alpha crashes.
const MACHINES: [(&str, &str, &str); 20] = [
    ("gcc", "-std=gnu17 -O3 -march=native", ""),
    ("gcc", "-std=c17 -Os -flto -fshort-enums", ""),
    ("gcc", "-std=c99 -O0 -funsigned-char", ""),
    ("gcc", "-std=c11 -O2 -ffast-math", ""),
    ("g++", "-std=c++20 -x c++ -O2", ""),
    ("clang", "-std=c99 -O2", ""),
    ("tcc", "", ""),
    ("powerpc-linux-gnu-gcc", "-static -O2", "qemu-ppc"),
    ("s390x-linux-gnu-gcc", "-static -O2", "qemu-s390x"),
    ("mips-linux-gnu-gcc", "-static -O2", "qemu-mips"),
    ("sparc64-linux-gnu-gcc", "-static -O2", "qemu-sparc64"),
    ("hppa-linux-gnu-gcc", "-static -O2", "qemu-hppa"),
    ("arm-linux-gnueabi-gcc", "-static -O2", "qemu-arm"),
    ("arm-linux-gnueabi-gcc", "-static -O2 -mthumb -march=armv5te", "qemu-arm"),
    ("aarch64-linux-gnu-gcc", "-static -O2", "qemu-aarch64"),
    ("aarch64-linux-gnu-gcc", "-static -O2 -march=armv8.2-a+fp16", "qemu-aarch64"),
    ("riscv64-linux-gnu-gcc", "-static -O2", "qemu-riscv64"),
    ("i686-linux-gnu-gcc", "-static -O2 -msse2 -mfpmath=sse", "qemu-i386"),
    // These evaluate floats in wider types, and so have no f32 leaves.
    ("i686-linux-gnu-gcc", "-static -O2 -mfpmath=387 -DPALPATE_LEAVES=3", "qemu-i386"),
    ("m68k-linux-gnu-gcc", "-static -O2 -DPALPATE_LEAVES=3", "qemu-m68k"),
];

#[test]
#[ignore = "needs cross compilers and emulators: .ci/run c"]
fn other_machines_and_dialects_give_the_bits_of_the_crate() {
    let mut rng = SmallRng::seed_from_u64(5);
    let mut models = all_models(&mut rng);
    // 256 objects are hundreds of numbers to write, and the large model comes last.
    models.retain(|bytes| bytes[14] < 20 && bytes.len() < 20_000);
    let script_of = |models: &[Vec<u8>]| {
        let mut rng = SmallRng::seed_from_u64(6);
        let script = script(models, 600, 300, &mut rng);
        (script.commands.clone(), script.expected.clone())
    };
    let of_integers: Vec<Vec<u8>> = models.iter().filter(|bytes| bytes[7] != 2).cloned().collect();
    let scripts = [script_of(&models), script_of(&of_integers)];
    let directory = tempfile::tempdir().unwrap();
    let missing = |program: &str| {
        Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_err()
    };
    let only = std::env::var("PALPATE_MACHINES").ok();
    let is_asked = |compiler: &str| only.as_ref().is_none_or(|only| only.split(' ').any(|own| own == compiler));
    let machines: Vec<_> = MACHINES.into_iter().filter(|machine| is_asked(machine.0)).collect();
    let next = AtomicU64::new(0);
    let work = || {
        let mut said = Vec::new();
        while let Some((number, (compiler, flags, emulator))) = {
            let number = next.fetch_add(1, Ordering::Relaxed) as usize;
            machines.get(number).map(|machine| (number, *machine))
        } {
            if missing(compiler) || !emulator.is_empty() && missing(emulator) {
                said.push(format!("SKIPPED: there is no {compiler} or no {emulator}"));
                continue;
            }
            let began = Instant::now();
            let program = directory.path().join(number.to_string());
            let mut command = Command::new(compiler);
            command
                .args(flags.split_whitespace())
                .arg("-I")
                .arg(Path::new(ROOT).join("onboard/c"))
                .arg("-o")
                .arg(&program);
            let output = command.arg(Path::new(ROOT).join("tests/c/host.c")).output().unwrap();
            assert!(output.status.success(), "{compiler} {flags}: {}", String::from_utf8_lossy(&output.stderr));
            let (commands, expected) = &scripts[usize::from(flags.contains("PALPATE_LEAVES=3"))];
            let mut command = match emulator {
                "" => Command::new(&program),
                emulator => {
                    let mut command = Command::new(emulator);
                    command.arg(&program);
                    command
                }
            };
            let found = run(&mut command, commands);
            let different = found.lines().zip(expected.lines()).find(|(found, expected)| found != expected);
            assert_eq!(different, None, "{compiler} {flags}");
            assert_eq!(found.len(), expected.len(), "{compiler} {flags}");
            said.push(format!(
                "{compiler} {flags}: {} lines, {:.1} s",
                found.lines().count(),
                began.elapsed().as_secs_f64()
            ));
        }
        said
    };
    let said: Vec<String> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..2).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    println!("{}", said.join("\n"));
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
    let [object, source, program] = ["replay.o", "commands.c", "replay"].map(|name| directory.path().join(name));
    compile("avr-gcc", &["-mmcu=atmega2560", "-c"], "avr.c", &object).unwrap();
    let mut rng = SmallRng::seed_from_u64(4);
    let mut models = all_models(&mut rng);
    // At most 12 objects and 64 features, as in avr.c.
    models.retain(|bytes| bytes.len() < 3_000 && bytes[14] < 12 && bytes[15] < 64);
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
        let commands = format!(
            "#include <avr/pgmspace.h>\nextern const uint8_t commands[] PROGMEM;\nextern const uint32_t commands_length;\n\
             const uint8_t commands[] = {{{}}};\nconst uint32_t commands_length = sizeof commands;\n",
            bytes.join(",")
        );
        std::fs::write(&source, commands).unwrap();
        let linked =
            Command::new("avr-gcc").arg("-mmcu=atmega2560").args([&object, &source]).arg("-o").arg(&program).output();
        let linked = linked.unwrap();
        assert!(linked.status.success(), "{}", String::from_utf8_lossy(&linked.stderr));
        compare(&run_avr(&program, directory.path()), &script);
        counted = [counted[0] + count(&script, "touch"), counted[1] + count(&script, "verdict")];
    }
    println!("AVR: {} touches, {} results, {} images", counted[0], counted[1], batches.len());
}
