//! The Arduino sketch on this machine, over stubs: it finds the crate's touches and verdicts in the same edges.

use palpate_onboard::effector::{Edge, Effector, Fault, Finger, Scale, Settings};
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_tests::ROOT;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A model of ten objects, whose fingers may touch a second apart.
const HOUSEHOLD: &[u8] = include_bytes!("../../../models/household.palpate");
/// The time between two looks of the sketch at its switches, in microseconds. Edges are at its multiples, so that the sketch
/// sees each when it happens.
const LOOK: u32 = 50;

/// A closing or an opening: finger, whether it closes, when.
type Moves = Vec<(usize, bool, u32)>;

/// The sketch with the model of its folder, or another, for this machine; `None` without a C++ compiler.
fn sketch(model: Option<&[u8]>, directory: &Path) -> Option<PathBuf> {
    let folder = Path::new(ROOT).join("onboard/c/examples/Recognize");
    let (sketch, program) = (directory.join("Recognize.ino"), directory.join("sketch"));
    std::fs::copy(folder.join("Recognize.ino"), &sketch).unwrap();
    match model {
        None => drop(std::fs::copy(folder.join("model.h"), directory.join("model.h")).unwrap()),
        Some(bytes) => {
            let bytes: String = bytes.iter().map(|byte| format!("{byte},")).collect();
            let array = "alignas(4) static const uint8_t model_model[]";
            let guard = "#pragma once\n#include \"palpate.h\"\n";
            std::fs::write(directory.join("model.h"), format!("{guard}{array} = {{{bytes}}};\n")).unwrap();
        }
    }
    let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".into());
    let mut command = Command::new(&compiler);
    command.args(["-std=c++11", "-O1", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-o"]).arg(&program);
    command.arg(format!("-DSKETCH=\"{}\"", sketch.display())).arg("-I").arg(directory);
    command.arg("-I").arg(Path::new(ROOT).join("onboard/c")).arg("-I").arg(Path::new(ROOT).join("tests/c"));
    match command.arg(Path::new(ROOT).join("tests/c/arduino.cpp")).output() {
        Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
        Err(error) => {
            println!("SKIPPED: no C++ compiler `{compiler}`, which the variable CXX names: {error}");
            return None;
        }
    }
    Some(program)
}

/// Output of the sketch when its switches make these moves from `start` on, by its clock.
fn printed(program: &Path, start: u32, end: u32, moves: &Moves) -> String {
    let mut input = format!("{start} {end}\n");
    for (finger, closed, at) in moves {
        writeln!(input, "{} {} {at}", finger + 2, u8::from(*closed)).unwrap();
    }
    let mut child = Command::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut pipe = child.stdin.take().unwrap();
    let output = std::thread::scope(|scope| {
        scope.spawn(move || pipe.write_all(input.as_bytes()).unwrap());
        child.wait_with_output().unwrap()
    });
    assert!(output.status.success(), "{}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// The touches that the crate's effector makes of it.
fn touches(model: &Model<'_>, start: u32, end: u32, moves: &Moves) -> Vec<Touch> {
    let mut effector = Effector::new(Settings::default().for_model(model, &Scale::IDENTITY));
    let mut touches = Vec::new();
    let mut take = |outcome: Result<Option<Touch>, Fault>| match outcome {
        Ok(Some(touch)) => {
            touches.push(touch);
            true
        }
        Ok(None) => false,
        Err(_) => true,
    };
    while take(effector.poll(start)) {}
    for &(finger, closed, at) in moves {
        take(effector.edge(Edge::new(Finger::ALL[finger], closed, start.wrapping_add(at))));
        while take(effector.poll(start.wrapping_add(at))) {}
    }
    while take(effector.poll(start.wrapping_add(end))) {}
    touches
}

/// Output that the sketch must print for these touches.
fn expected(model: &Model<'_>, touches: &[Touch]) -> String {
    let mut recognizer = Recognizer::<16>::new(model, Stopping::from_model(model)).unwrap();
    let mut text = String::new();
    for touch in touches {
        let [a, b, c] = touch.times().map(|time| time.micros().unwrap_or(u32::MAX));
        writeln!(text, "touch {a} {b} {c}").unwrap();
        match recognizer.push(touch) {
            Err(_) => text.push_str("The model was not trained on such touches.\n"),
            Ok(Verdict::Recognized { object, .. }) => {
                writeln!(text, "{}", model.object_name(usize::from(object))).unwrap();
            }
            Ok(Verdict::Unknown) => text.push_str("unknown\n"),
            Ok(_) => {}
        }
        if recognizer.verdict() != Verdict::Undecided {
            recognizer.reset();
        }
    }
    text
}

/// Plays moves to the sketch and to the crate; the touches.
fn compare(program: &Path, model: &Model<'_>, start: u32, moves: &Moves) -> (Vec<Touch>, String) {
    let end = moves.last().map_or(0, |(.., at)| at + 2_000_000);
    let touches = touches(model, start, end, moves);
    let text = printed(program, start, end, moves);
    let expected = expected(model, &touches);
    if text != expected {
        let differs = text.lines().zip(expected.lines()).position(|(found, expected)| found != expected);
        panic!("line {differs:?} of\n{text}\nexpected:\n{expected}\nmoves from {start}: {moves:?}");
    }
    (touches, text)
}

/// Moves of the effector's own tests, from a second after power-up on; their names, and how many contacts each touch has.
fn cases() -> Vec<(&'static str, Moves, Vec<usize>)> {
    let all = |closed: bool, at: u32| (0..3).map(move |finger| (finger, closed, at));
    let bouncing = (0..20).map(|i| (1, i % 2 == 0, 70_000 + i * 2_000));
    let rested_too_shortly = [(true, 50_000), (false, 100_000), (true, 114_950), (false, 150_000), (true, 165_000)];
    vec![
        (
            "an approach that was given up does not merge with the next one",
            vec![(0, true, 50_000), (0, false, 110_000), (1, true, 400_000), (1, false, 450_000)],
            vec![1, 1],
        ),
        (
            "a third finger may come as late as the model allows",
            vec![(0, true, 50_000), (1, true, 60_000), (2, true, 1_090_000)],
            vec![3],
        ),
        (
            "a glitch is no contact",
            vec![(0, true, 50_000), (0, false, 54_000), (2, true, 70_000), (2, false, 74_950)],
            vec![],
        ),
        (
            "a finger that lets go before the others touch keeps its first contact",
            vec![(0, true, 50_000), (0, false, 90_000), (0, true, 120_000), (1, true, 130_000), (2, true, 140_000)],
            vec![3],
        ),
        (
            "a finger that does not settle drops the touch",
            [(0, true, 50_000), (2, true, 60_000)].into_iter().chain(bouncing).collect(),
            vec![],
        ),
        (
            "a probe that rests too shortly after a touch has to open again",
            rested_too_shortly.into_iter().flat_map(|(closed, at)| all(closed, at)).collect(),
            vec![3, 3],
        ),
        (
            "a switch that is closed at power-up is no contact",
            vec![
                (1, true, 0),
                (0, true, 2_000_000),
                (0, false, 2_100_000),
                (1, false, 2_100_000),
                (2, true, 3_000_000),
            ],
            vec![1],
        ),
    ]
}

/// Approaches whose switches bounce, one after the other.
fn approaches(count: u32, rng: &mut ChaCha8Rng) -> Moves {
    let (mut moves, mut now) = (Moves::new(), 300_000);
    let mut times = [0; 3];
    for number in 0..count {
        if number % 8 == 0 {
            // Another object; its touches are alike, so that some are recognized.
            times = [0, 1, 2].map(|_| rng.random_range(0..60_000));
        }
        for (finger, time) in times.into_iter().enumerate() {
            if rng.random_ratio(1, 10) {
                continue;
            }
            let mut at = now + time + rng.random_range(0..2_000);
            moves.push((finger, true, at));
            for _ in 0..rng.random_range(0..4) {
                for closed in [false, true] {
                    at += rng.random_range(50..1_000);
                    moves.push((finger, closed, at));
                }
            }
            moves.push((finger, false, now + 400_000 + rng.random_range(0..100_000)));
        }
        now += 1_700_000 + rng.random_range(0..100_000);
    }
    moves
}

/// Anything: pauses from bounces to seconds.
fn anything(count: u32, rng: &mut ChaCha8Rng) -> Moves {
    let mut now = 0;
    let mut levels = [false; 3];
    let mut moves = Moves::new();
    for _ in 0..count {
        let longest = [3_000, 3_000, 30_000, 30_000, 600_000, 2_000_000][rng.random_range(0..6)];
        now += rng.random_range(LOOK..longest);
        let finger = rng.random_range(0..3);
        levels[finger] = !levels[finger];
        moves.push((finger, levels[finger], now));
    }
    moves
}

/// At multiples of the time between two looks, in order, and no finger twice at one of them.
fn on_grid(moves: Moves) -> Moves {
    let mut moves: Moves = moves.into_iter().map(|(finger, closed, at)| (finger, closed, at / LOOK * LOOK)).collect();
    moves.sort_by_key(|&(finger, _, at)| (at, finger));
    let mut last = [None; 3];
    moves.retain_mut(|(finger, _, at)| {
        let is_another = last[*finger] != Some(*at);
        last[*finger] = Some(*at);
        is_another
    });
    // Of what was left out, levels may come twice.
    let mut levels = [false; 3];
    moves.retain(|&(finger, closed, _)| std::mem::replace(&mut levels[finger], closed) != closed);
    moves
}

/// `PALPATE_REPETITIONS=200 cargo test --release -p palpate-tests --test arduino` plays more.
#[test]
fn the_sketch_makes_the_crates_touches_and_verdicts_of_the_same_edges() {
    let repetitions = palpate_tests::repetitions(6);
    let header = std::fs::read_to_string(Path::new(ROOT).join("onboard/c/examples/Recognize/model.h")).unwrap();
    let (_, array) = header.split_once("= {").unwrap();
    let (array, _) = array.split_once('}').unwrap();
    let toy: Vec<u8> = array.split(',').filter_map(|byte| byte.trim().parse().ok()).collect();
    for (bytes, given) in [(toy.as_slice(), None), (HOUSEHOLD, Some(HOUSEHOLD))] {
        let directory = tempfile::tempdir().unwrap();
        let Some(program) = sketch(given, directory.path()) else { return };
        let model = Model::new(bytes).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        if given.is_some() {
            for (case, moves, contacts) in cases() {
                let later = |(finger, closed, at)| (finger, closed, if at == 0 { 0 } else { at + 1_000_000 });
                let (touches, _) = compare(&program, &model, 7, &moves.into_iter().map(later).collect());
                let found: Vec<usize> = touches
                    .iter()
                    .map(|touch| touch.times().iter().filter(|time| !time.is_missing()).count())
                    .collect();
                assert_eq!(found, contacts, "{case}: {touches:?}");
            }
        }
        let (mut count, mut named, mut dropped) = (0, 0, 0);
        for repetition in 0..repetitions {
            // The clock goes round now and then.
            let start = if repetition % 2 == 0 { rng.random() } else { 0_u32.wrapping_sub(20_000_000) };
            let (touches, text) = compare(&program, &model, start, &on_grid(approaches(50, &mut rng)));
            count += touches.len();
            named += text.lines().filter(|line| !line.starts_with("touch") && !line.starts_with("The model")).count();
            let moves = on_grid(anything(300, &mut rng));
            dropped += usize::from(compare(&program, &model, start, &moves).0.len() < moves.len() / 4);
        }
        assert!(count > 40 * repetitions && named >= repetitions && dropped > 0, "{count}, {named}, {dropped}");
    }
}
