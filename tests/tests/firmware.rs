//! The firmware in an emulator: the chip decides as the host does, over good and bad lines, through resets, from pins.
//!
//! Needs `qemu-system-arm` and the targets thumbv7em-none-eabihf and thumbv6m-none-eabi, so it is asked for:
//! `cargo test -p palpate-tests --test firmware -- --ignored`. It builds the images itself.

use palpate::chip::{Connection, Emulator, Faults, Steps, Summary, Update, stream};
use palpate::compile::{Leaf, Settings, compile};
use palpate::touches::{Dataset, ObjectTouches};
use palpate_onboard::Model;
use palpate_onboard::station::Station;
use palpate_shared::format::{Counted, Trained, TrainedTouches};
use palpate_shared::link::{
    Decision, Decoder, Device, Event, FaultKind, HostSettings, Message, TouchMessage, VerdictMessage,
};
use palpate_shared::{ContactTime, Descriptor, Patterns, Touch};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::trained;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::io::{Read, Write};
use std::net::TcpListener;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

const M4F: &str = "thumbv7em-none-eabihf";
const M0: &str = "thumbv6m-none-eabi";
const OBJECTS: usize = 10;

/// Builds an image, with a model in it where one is given.
fn build(image: &str, target: &str, model: Option<&Path>) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../onboard/firmware").canonicalize().unwrap();
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--release", "--quiet", "--bin", image, "--target", target]).current_dir(&folder);
    // What this test was built with is not what the firmware is built with.
    cargo.env_remove("CARGO_TARGET_DIR").env_remove("RUSTFLAGS").env_remove("PALPATE_MODEL");
    if let Some(model) = model {
        cargo.env("PALPATE_MODEL", model);
    }
    assert!(cargo.status().unwrap().success(), "the firmware does not build");
    folder.join("target").join(target).join("release").join(image)
}

fn model(descriptor: Descriptor, seed: u64) -> Vec<u8> {
    let shape = Shape { descriptor, objects: OBJECTS, trees: 20, depth: 5, each: true, thresholds: 200, leaf: 0.05 };
    let touches = TrainedTouches {
        patterns: Patterns::CONTACTS,
        counted: Counted::Contacts,
        needs_pose: descriptor.needs_pose(),
        largest_spread: 1_000_000,
    };
    let compiled =
        compile(&random::ensemble(shape, seed), &Settings { leaf: Leaf::I8, ..Settings::default() }).unwrap();
    trained(&compiled.bytes, &Trained { touches: Some(touches), ..Trained::default() })
}

fn dataset(count: usize) -> Dataset {
    let object =
        |index: usize| ObjectTouches { name: format!("object {index}"), touches: random::touches(count, index as u64) };
    Dataset::new((0..OBJECTS).map(object).collect())
}

/// On a good line nothing has to be sent again, however busy the machine that emulates the chip.
const PATIENT: HostSettings = HostSettings { retry: 5_000_000, attempts: 10 };
/// Where something is lost now and then.
const BRISK: HostSettings = HostSettings { retry: 500_000, attempts: 50 };
/// Where much is lost.
const HASTY: HostSettings = HostSettings { retry: 50_000, attempts: 200 };

/// Streams touches to an emulated chip that gets `model` first, and holds it against the host.
fn parity(
    target: &str,
    model: &[u8],
    touches: u64,
    faults: Option<Faults>,
    settings: HostSettings,
    mut each: impl FnMut(&mut Connection, &Update),
) -> Summary {
    let firmware = build("uart", target, None);
    let mut transport = Emulator::for_firmware(firmware).start().unwrap();
    if let Some(faults) = faults {
        transport = transport.with_faults(faults, 1);
    }
    let mut connection = Connection::open(transport, settings).unwrap();
    connection.load(model, &()).unwrap();
    let chip = connection.model().unwrap();
    let host = Model::new(model).unwrap();
    let steps = Steps::sequences(dataset(1_000), 60, touches);
    stream(&mut connection, steps, &chip, Some(&host), false, |connection, update| {
        each(connection, &update);
        Ok(ControlFlow::Continue(()))
    })
    .unwrap()
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/firmware.rs"]
fn ten_thousand_touches_give_the_hosts_verdicts_on_both_chips_and_for_both_descriptors() {
    for target in [M4F, M0] {
        for descriptor in [Descriptor::Curvature, Descriptor::Oriented] {
            let summary = parity(target, &model(descriptor, 1), 10_000, None, PATIENT, |_, _| ());
            eprintln!("{target}, {}: {:.0} touches per second", descriptor.name(), summary.rate());
            assert_eq!(
                (summary.touches + summary.refused, summary.compared, summary.differences),
                (10_000, 10_000, 0),
                "{summary:?}"
            );
            assert_eq!((summary.chip_repeated, summary.garbled, summary.chip_garbled), (0, 0, 0), "{summary:?}");
        }
    }
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/firmware.rs"]
fn ten_thousand_touches_arrive_exactly_once_over_a_bad_line() {
    let faults = "0.0005,0.0005,0.01,2".parse().unwrap();
    let summary = parity(M4F, &model(Descriptor::Curvature, 1), 10_000, Some(faults), HASTY, |_, _| ());
    eprintln!("{summary:?}");
    assert_eq!(
        (summary.touches + summary.refused, summary.compared, summary.differences),
        (10_000, 10_000, 0),
        "{summary:?}"
    );
    assert!(summary.resent > 100 && summary.garbled > 100 && summary.chip_garbled > 100, "{summary:?}");
    assert!(summary.chip_repeated > 10 && summary.chip_early > 10, "{summary:?}");
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/firmware.rs"]
fn a_chip_that_is_reset_a_hundred_times_loses_and_doubles_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut resets, mut wait) = (0, 50);
    let mut started = 0;
    let summary = parity(M4F, &model(Descriptor::Curvature, 1), 20_000, None, BRISK, |connection, update| {
        started += u32::from(matches!(update, Update::Event(Event::Started, _)));
        wait -= 1;
        if wait <= 0 && resets < 100 {
            resets += 1;
            wait = rng.random_range(1..180);
            connection.transport().reset_chip().unwrap();
        }
    });
    eprintln!("{resets} resets, {started} starts, {summary:?}");
    assert_eq!(resets, 100);
    assert!(started > 50, "{started} starts");
    assert_eq!(
        (summary.touches + summary.refused, summary.compared, summary.differences),
        (20_000, 20_000, 0),
        "{summary:?}"
    );
}

#[test]
#[ignore = "a soak: PALPATE_SOAK=1000000 cargo test --release -p palpate-tests --test firmware soak -- --ignored"]
fn soak_the_emulated_chip_neither_drifts_nor_loses_a_frame() {
    let touches = std::env::var("PALPATE_SOAK").map_or(30_000, |count| count.parse().unwrap());
    let mut events = 0;
    let summary = parity(M4F, &model(Descriptor::Curvature, 1), touches, None, PATIENT, |_, update| {
        events += u32::from(matches!(update, Update::Event(..)));
    });
    eprintln!("{:.0} touches per second, {summary:?}", summary.rate());
    assert_eq!(
        (summary.touches + summary.refused, summary.compared, summary.differences),
        (touches, touches, 0),
        "{summary:?}"
    );
    assert_eq!((summary.chip_repeated, summary.garbled, summary.chip_garbled, events), (0, 0, 0, 0), "{summary:?}");
}

/// Edges as a host plays them: finger, level, time.
#[derive(Default)]
struct Recording {
    bytes: Vec<u8>,
}

impl Recording {
    fn edge(&mut self, finger: u8, closed: bool, at: u32) {
        self.bytes.extend([finger, u8::from(closed)]);
        self.bytes.extend(at.to_le_bytes());
    }

    /// Time passes.
    fn wait(&mut self, at: u32) {
        self.edge(3, false, at);
    }
}

/// Contacts of one, two or three fingers, up to a second apart; none is left out later.
fn approach(rng: &mut ChaCha8Rng) -> Touch {
    let first = rng.random_range(0..3);
    let times = [0, 1, 2].map(|finger| match rng.random_range(0..10) {
        _ if finger == first => ContactTime::FIRST,
        0..3 => ContactTime::MISSING,
        // A slow third finger.
        3 => ContactTime::from_micros(rng.random_range(900_000..=1_000_000)),
        _ => ContactTime::from_micros(rng.random_range(0..250_000)),
    });
    Touch::new(times)
}

/// An approach as three switches make it from `start` on, and their release; the time when all is quiet again. Switches
/// bounce; one in ten loses contact for a while and touch again, and a third finger may come as late as the model allows.
fn play(recording: &mut Recording, touch: &Touch, start: u32, rng: &mut ChaCha8Rng) -> u32 {
    let mut edges = Vec::new();
    let again = rng.random_range(0..10);
    for (finger, time) in (0..3).zip(touch.times()) {
        let Some(time) = time.micros() else { continue };
        let mut at = time;
        edges.push((at, finger, true));
        for _ in 0..rng.random_range(0..4) {
            for closed in [false, true] {
                at += rng.random_range(1..1_000);
                edges.push((at, finger, closed));
            }
        }
        if finger == again {
            // Another contact in the same approach: the first one counts.
            at += rng.random_range(10_000..40_000);
            edges.push((at, finger, false));
            at += rng.random_range(10_000..90_000);
            edges.push((at, finger, true));
        }
        edges.push((1_300_000 + rng.random_range(0..1_000), finger, false));
    }
    edges.sort_unstable();
    for (at, finger, closed) in edges {
        recording.edge(finger, closed, start.wrapping_add(at));
    }
    recording.wait(start.wrapping_add(1_450_000));
    start.wrapping_add(1_450_000)
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/firmware.rs"]
fn edges_that_come_at_any_instruction_become_the_hosts_verdicts() {
    let bytes = model(Descriptor::Curvature, 1);
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &bytes).unwrap();
    for (target, machine) in [(M4F, "mps2-an386"), (M0, "mps2-an385")] {
        // The clock wraps after twenty touches.
        let mut now = 0_u32.wrapping_sub(20 * 1_450_000);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut recording = Recording::default();
        let mut expected = vec![Event::Started];
        let model = Model::new(&bytes).unwrap();
        let mut host = Station::<OBJECTS>::new(&model);
        // From power-up at 0 to there in steps that the driver can follow: less than half a turn of the clock.
        [now / 3, now / 3 * 2, now].into_iter().for_each(|at| recording.wait(at));
        now = now.wrapping_add(50_000);
        let count = std::env::var("PALPATE_EDGES").map_or(10_000, |count| count.parse().unwrap());
        let touches: Vec<Touch> = (0..count).map(|_| approach(&mut rng)).collect();
        assert!(touches.iter().any(|t| !t.is_full()) && touches.iter().any(|t| t.spread() > 900_000));
        for touch in &touches {
            now = play(&mut recording, touch, now, &mut rng);
            // What a probe measures has no pose.
            let measured = Touch::new(touch.times());
            let verdict: VerdictMessage = host.push(&measured, true).unwrap();
            if verdict.decision != Decision::Undecided {
                host.reset();
            }
            expected.push(Event::Touch { touch: TouchMessage::from(&measured), pose_age: None, verdict });
        }
        // A finger that stays closed is a touch with two missing contacts, and stuck.
        recording.edge(2, true, now);
        recording.wait(now.wrapping_add(1_200_000));
        recording.wait(now.wrapping_add(6_000_000));
        let measured = Touch::new([u32::MAX, u32::MAX, 0].map(palpate_shared::ContactTime::from_micros));
        let verdict = host.push(&measured, true).unwrap();
        expected.push(Event::Touch { touch: TouchMessage::from(&measured), pose_age: None, verdict });
        expected.push(Event::Fault { kind: FaultKind::Stuck, finger: 2 });

        let heard = run_gpio(&build("gpio", target, Some(file.path())), machine, recording.bytes, expected.len());
        for (number, (heard, expected)) in heard.iter().zip(&expected).enumerate() {
            assert_eq!(heard, &(number as u32, *expected), "{target}, event {number}");
        }
        assert_eq!(heard.len(), expected.len());
    }
}

/// Plays a recording into the image's pins, and listens until it has reported `count` events.
fn run_gpio(image: &Path, machine: &str, recording: Vec<u8>, count: usize) -> Vec<(u32, Event)> {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-machine", machine, "-display", "none", "-monitor", "none", "-serial", "stdio", "-serial"]);
    qemu.arg(format!("tcp:{}", listener.local_addr().unwrap())).args(["-semihosting-config", "enable=on"]);
    qemu.arg("-kernel").arg(image).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = qemu.spawn().unwrap();
    let mut uart = child.stdout.take().unwrap();
    let (done, wait) = std::sync::mpsc::channel::<()>();
    let guard = std::thread::spawn(move || {
        // Longer than a busy machine takes; without it a lost event would keep the test waiting forever.
        let in_time = wait.recv_timeout(Duration::from_secs(600)) != Err(RecvTimeoutError::Timeout);
        child.kill().unwrap();
        child.wait().unwrap();
        in_time
    });
    let player = std::thread::spawn(move || {
        let (mut pins, _) = listener.accept().unwrap();
        pins.write_all(&recording).unwrap();
        pins
    });
    let mut decoder = Decoder::new();
    let (mut events, mut buffer) = (Vec::new(), [0; 1024]);
    while events.len() < count {
        let read = uart.read(&mut buffer).unwrap();
        assert!(read > 0, "the emulator has ended, or 600 s are over, after {} of {count} events", events.len());
        for &byte in &buffer[..read] {
            if let Some(frame) = decoder.feed(byte)
                && let Message::Event { sequence, event, .. } = frame.unwrap().message
            {
                events.push((sequence, event));
            }
        }
    }
    drop(player.join().unwrap());
    drop(done);
    assert!(guard.join().unwrap(), "600 s were not enough");
    events
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/firmware.rs"]
fn a_core_that_faults_on_unaligned_loads_gives_the_hosts_margins_and_verdicts_wherever_the_model_stands() {
    let bytes = include_bytes!("../../models/household.palpate");
    let digest = palpate_tests::identity::digest(&Model::new(bytes).unwrap());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../onboard/firmware").canonicalize().unwrap();
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--release", "--quiet", "--bin", "alignment", "--target", M0, "--target-dir"]);
    // Not among images with another memory.
    let target = folder.join("target/microbit");
    cargo.arg(&target).current_dir(&folder).env("PALPATE_MEMORY", "microbit.x");
    cargo.env_remove("CARGO_TARGET_DIR").env_remove("RUSTFLAGS").env_remove("PALPATE_MODEL");
    assert!(cargo.status().unwrap().success(), "the firmware does not build");
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-machine", "microbit", "-nographic", "-semihosting-config", "enable=on,target=native", "-kernel"]);
    let output = qemu.arg(target.join(M0).join("release/alignment")).stdin(Stdio::null()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}");
    assert_eq!(said.lines().collect::<Vec<_>>(), [format!("at 0: {digest:08x}"), format!("at 1: {digest:08x}")]);
}
