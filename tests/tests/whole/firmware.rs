//! The firmware in an emulator: the chip decides as the host does, over good and bad lines, through resets, from pins.
//!
//! Needs `qemu-system-arm` and the targets thumbv7em-none-eabihf and thumbv6m-none-eabi, so it is asked for:
//! `cargo test --release -p palpate-tests --test whole firmware:: -- --ignored`. It builds the images itself. With
//! `PALPATE_SOAK=1000000` a million touches go through the chips instead of ten thousand.

use palpate::chip::{Asks, Connection, Emulator, Port, Steps, Summary, Transport, Update, stream};
use palpate::compile::Leaf;
use palpate::locate::{self, Real, World};
use palpate::mesh::builtin;
use palpate::probe::approach::Probe;
use palpate::touches::{Dataset, ObjectTouches, Source};
use palpate::with;
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::format::{Counted, TrainedTouches};
use palpate_shared::link::{
    Answer, Decision, Decoder, Detail, Event, FRAME_MAX, FaultKind, Frame, HostSettings, Message, Request,
    TouchMessage, VerdictMessage, encode,
};
use palpate_shared::{ContactTime, Descriptor, Patterns, Touch};
use palpate_tests::bad_line::{Faults, relay};
use palpate_tests::chips::{M0, M4F, build, cargo};
use palpate_tests::pins::{APPROACH, Edges, edges};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::{Trained, trained};
use palpate_tests::{HOUSEHOLD, ROOT};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

const OBJECTS: usize = 10;

fn model(descriptor: Descriptor, seed: u64) -> Vec<u8> {
    let shape =
        Shape { descriptor, objects: OBJECTS, trees: 20, depth: 5, thresholds: 200, leaf: 0.05, ..Shape::SMALL };
    let touches = TrainedTouches {
        patterns: Patterns::CONTACTS,
        counted: Counted::Contacts,
        needs_pose: descriptor.needs_pose(),
        largest_spread: 1_000_000,
    };
    trained(&random::model(shape, seed, Leaf::I8), &Trained { touches: Some(touches), ..Trained::default() })
}

fn dataset(count: usize) -> Dataset {
    let object = |index: usize| {
        ObjectTouches::new(format!("object {index}"), random::touches(count, index as u64), Source::Object)
    };
    Dataset::new((0..OBJECTS).map(object).collect())
}

/// On a good line nothing has to be sent again, however busy the machine that emulates the chip.
const PATIENT: HostSettings = HostSettings { retry: 5_000_000, attempts: 10 };
/// Settings for a line that loses something now and then.
const BRISK: HostSettings = HostSettings { retry: 500_000, attempts: 50 };
/// Settings for a line that loses much.
const HASTY: HostSettings = HostSettings { retry: 10_000, attempts: 1_000 };

/// A line that loses and changes bytes now and then, doubles them, and delays them by up to 2 ms.
const BAD: Faults = Faults { lost: 0.0005, changed: 0.0005, doubled: 0.01, delay: Duration::from_millis(2) };

/// An emulator at the other end of a bad line, which ends with this.
struct Emulated(std::process::Child);

impl Drop for Emulated {
    fn drop(&mut self) {
        self.0.kill().and_then(|()| self.0.wait()).unwrap();
    }
}

/// The line to an emulated chip that runs this image.
fn started(image: PathBuf, faults: Option<Faults>) -> (Transport, Option<Emulated>) {
    let emulator = Emulator::for_firmware(image);
    let Some(faults) = faults else { return (emulator.start().unwrap(), None) };
    let [chip, host] = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
    let mut qemu = Command::new(&emulator.program);
    qemu.args(["-machine", &emulator.machine, "-display", "none", "-monitor", "none", "-serial"]);
    qemu.arg(format!("tcp:{}", chip.local_addr().unwrap())).args(["-semihosting-config", "enable=on,target=native"]);
    let child = qemu.arg("-kernel").arg(&emulator.firmware).stdin(Stdio::null()).spawn().unwrap();
    let port = Port::Tcp(host.local_addr().unwrap().to_string());
    relay(host, chip.accept().unwrap().0, faults, 1);
    (port.open(115_200, &emulator).unwrap(), Some(Emulated(child)))
}

/// Streams touches to an emulated chip that gets `model` first, and holds it against the host.
fn parity(
    target: &str,
    model: &[u8],
    touches: u64,
    faults: Option<Faults>,
    settings: HostSettings,
    mut each: impl FnMut(&mut Connection, &Update),
) -> Summary {
    let (transport, _emulator) = started(build("uart", target, &[], None), faults);
    let mut connection = Connection::open(transport, settings).unwrap();
    connection.load(model, &()).unwrap();
    let chip = connection.model().unwrap().unwrap();
    let steps = Steps::sequences(dataset(1_000), 60, touches);
    stream(&mut connection, steps, &chip, Some(model), Asks::Nothing, |connection, update| {
        each(connection, &update);
        Ok(ControlFlow::Continue(()))
    })
    .unwrap()
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/whole/firmware.rs"]
fn ten_thousand_touches_give_the_hosts_verdicts_on_both_chips_and_for_both_descriptors() {
    let touches = std::env::var("PALPATE_SOAK").map_or(10_000, |count| count.parse().unwrap()) / 4;
    for target in [M4F, M0] {
        for descriptor in [Descriptor::Curvature, Descriptor::Oriented] {
            let mut events = 0;
            let summary = parity(target, &model(descriptor, 1), touches, None, PATIENT, |_, update| {
                events += u32::from(matches!(update, Update::Event(..)));
            });
            eprintln!("{target}, {}: {:.0} touches per second", descriptor.name(), summary.rate());
            assert_eq!(
                (summary.touches + summary.refused, summary.compared, summary.differences),
                (touches, touches, 0),
                "{summary:?}"
            );
            let disturbed = (summary.chip_repeated, summary.garbled, summary.chip_garbled, events);
            assert_eq!(disturbed, (0, 0, 0, 0), "{summary:?}");
        }
    }
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/whole/firmware.rs"]
fn ten_thousand_touches_arrive_exactly_once_over_a_bad_line() {
    let summary = parity(M4F, &model(Descriptor::Curvature, 1), 10_000, Some(BAD), HASTY, |_, _| ());
    eprintln!("{summary:?}");
    assert_eq!(
        (summary.touches + summary.refused, summary.compared, summary.differences),
        (10_000, 10_000, 0),
        "{summary:?}"
    );
    assert!(summary.resent > 100 && summary.garbled > 100 && summary.chip_garbled > 100, "{summary:?}");
    assert!(summary.chip_repeated > 100, "{summary:?}");
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/whole/firmware.rs"]
fn touches_with_a_position_give_the_hosts_verdicts_places_and_approaches_over_a_bad_line() {
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0));
    let mut objects = builtin::make(&["bowl", "camera", "mouse"], None).unwrap();
    objects.iter_mut().for_each(|object| object.millimeters = Some(4.0));
    let settings = with!(locate::CastSettings::default(), fine = false);
    let standing = locate::standing(&objects.iter().collect::<Vec<_>>(), &probe, settings.noise, &()).unwrap();
    let surfaces = locate::cast(&standing, &probe, &settings).unwrap();
    let names: Vec<String> = standing.iter().map(|object| object.name.clone()).collect();
    let model = locate::write(&surfaces, &names, &probe, &settings).unwrap();
    let world = World { standing: &standing, probe: &probe, real: Real::default(), range: 28.0, seed: 1 };
    let touches = |object: usize| {
        let mut drawn = world.draw(object as u64);
        let touches = (0..200).map(|_| {
            let at = drawn.anywhere(drawn.truth.place, 30.0);
            drawn.press(at)
        });
        ObjectTouches::new(names[object].clone(), touches.collect(), Source::Object)
    };
    let dataset = Dataset::new((0..names.len()).map(touches).collect());
    for (faults, settings, touches) in [(None, PATIENT, 100), (Some(BAD), BRISK, 40)] {
        let (transport, _emulator) = started(build("uart", M4F, &["--features", "locate"], None), faults);
        let mut connection = Connection::open(transport, settings).unwrap();
        connection.load(&model, &()).unwrap();
        let chip = connection.model().unwrap().unwrap();
        assert!(chip.info.has_maps() && chip.placements.len() == surfaces.len(), "{chip:?}");
        let (steps, asks) = (Steps::sequences(dataset.clone(), 5, touches), Asks::Place { within: None });
        let each = |_: &mut Connection, _| Ok(ControlFlow::Continue(()));
        let summary = stream(&mut connection, steps, &chip, Some(&model), asks, each).unwrap();
        eprintln!("{} bytes of maps, {summary:?}", model.len());
        assert_eq!(
            (summary.touches, summary.compared, summary.approaches, summary.differences),
            (touches, touches, touches, 0),
            "{summary:?}"
        );
        assert_eq!(summary.garbled + summary.chip_garbled > 0, faults.is_some(), "{summary:?}");
    }
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/whole/firmware.rs"]
fn a_chip_that_is_reset_tells_the_host_that_evidence_and_session_are_gone() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let model = model(Descriptor::Curvature, 1);
    for round in 0..10 {
        let (transport, _emulator) = started(build("uart", M4F, &[], None), None);
        let mut connection = Connection::open(transport, BRISK).unwrap();
        connection.load(&model, &()).unwrap();
        let chip = connection.model().unwrap().unwrap();
        let mut wait = rng.random_range(1..90);
        let steps = Steps::sequences(dataset(1_000), 60, 10_000);
        let ended = stream(&mut connection, steps, &chip, Some(&model), Asks::Nothing, |connection, update| {
            wait -= i32::from(matches!(update, Update::Touch { .. }));
            if wait == 0 {
                connection.transport().reset_chip().unwrap();
                wait = i32::MAX;
            }
            Ok(ControlFlow::Continue(()))
        });
        let error = ended.unwrap_err().to_string();
        assert!(error.contains("the chip was reset and kept nothing"), "round {round}: {error}");
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

/// Steps that are played until the power goes, or all is over, and the touches up to there.
struct Segment {
    bytes: Vec<u8>,
    touches: usize,
}

/// Plays touches one after the other; in one of fifty the power goes, at any moment. Ends with a finger that stays closed.
fn segments(touches: &[Touch], rng: &mut ChaCha8Rng) -> Vec<Segment> {
    let (mut segments, mut played) = (Vec::new(), Edges::default());
    // The clock wraps after twenty touches.
    let mut now = 0_u32.wrapping_sub(20 * APPROACH);
    // From power-up at 0 to there in steps that the driver can follow: less than half a turn of the clock.
    [now / 3, now / 3 * 2, now].into_iter().for_each(|at| played.wait(at));
    now = now.wrapping_add(150_000);
    for (index, touch) in touches.iter().enumerate() {
        let edges = edges(touch, rng);
        let cut = rng.random_ratio(1, 50).then(|| rng.random_range(0..1_340_000));
        for &(at, finger, closed) in edges.iter().filter(|(at, ..)| cut.is_none_or(|cut| *at < cut)) {
            played.edge(finger, closed, now.wrapping_add(at));
        }
        if let Some(cut) = cut {
            played.cut(now.wrapping_add(cut));
            segments.push(Segment { bytes: std::mem::take(&mut played.bytes), touches: index + 1 });
            // The approach goes on, and the clock starts again.
            now = 0_u32.wrapping_sub(cut);
            for &(at, finger, closed) in edges.iter().filter(|(at, ..)| *at >= cut) {
                played.edge(finger, closed, now.wrapping_add(at));
            }
        }
        now = now.wrapping_add(APPROACH);
        played.wait(now);
    }
    // A finger that stays closed is a touch with two missing contacts, and stuck.
    played.edge(2, true, now);
    played.wait(now.wrapping_add(1_200_000));
    played.wait(now.wrapping_add(6_000_000));
    segments.push(Segment { bytes: played.bytes, touches: touches.len() + 1 });
    segments
}

/// State of the chip, and the number of touches in it.
struct Known<'m> {
    recognizer: Recognizer<'m, OBJECTS>,
    counted: usize,
}

impl Known<'_> {
    /// The chip's report when it counts a touch. A decision ends an object.
    fn push(&mut self, touch: &Touch) -> VerdictMessage {
        let recognizer = &mut self.recognizer;
        let decision = match recognizer.push(touch).unwrap() {
            Verdict::Undecided => Decision::Undecided,
            Verdict::Recognized { object, .. } => Decision::Recognized(object),
            Verdict::Unknown => Decision::Unknown,
            Verdict::GaveUp => Decision::GaveUp,
        };
        let best = recognizer.best();
        let detail = Some(Detail::new(recognizer.posterior(best).q56(), recognizer.evidence()));
        let message = VerdictMessage { decision, best: best as u8, touches: recognizer.touches(), detail };
        if decision != Decision::Undecided {
            recognizer.reset();
        }
        self.counted += 1;
        message
    }
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/whole/firmware.rs"]
fn edges_and_power_cuts_that_come_at_any_instruction_become_the_hosts_verdicts() {
    let bytes = model(Descriptor::Curvature, 1);
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &bytes).unwrap();
    let model = Model::new(&bytes).unwrap();
    for (target, machine) in [(M4F, "mps2-an386"), (M0, "mps2-an385")] {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let count = std::env::var("PALPATE_EDGES").map_or(5_000, |count| count.parse().unwrap());
        let mut touches: Vec<Touch> = (0..count).map(|_| approach(&mut rng)).collect();
        assert!(touches.iter().any(|t| !t.is_full()) && touches.iter().any(|t| t.spread() > 900_000));
        let segments = segments(&touches, &mut rng);
        touches.push(Touch::new([u32::MAX, u32::MAX, 0].map(ContactTime::from_micros)));
        let ends: Vec<usize> = segments.iter().map(|segment| segment.touches).collect();

        // What the chip has counted it tells once; after a power cut it begins again. A touch whose approach the power ended is not
        // counted.
        let recognizer = Recognizer::new(&model, Stopping::from_model(&model)).unwrap();
        let mut known = Known { recognizer, counted: 0 };
        let (mut starts, mut numbers, mut heard) = (0_usize, 0, 0);
        let image = build("gpio", target, &[], Some(file.path()));
        run_gpio(&image, machine, segments, |number, event| {
            if event == Event::Started {
                if let Some(end) = starts.checked_sub(1).map(|segment| ends[segment]) {
                    heard = end;
                }
                (starts, numbers) = (starts + 1, 0);
                known.recognizer.reset();
            }
            let place = format!("{target}, event {number} of start {starts}, touch {heard}");
            assert_eq!(number, numbers, "{place}");
            numbers += 1;
            match event {
                Event::Started => ControlFlow::Continue(()),
                Event::Touch { touch, pose_age: None, verdict } => {
                    assert!(heard < ends[starts - 1], "{place}: more touches than were made");
                    assert_eq!(touch, TouchMessage::from(&touches[heard]), "{place}");
                    assert_eq!(known.push(&touches[heard]), verdict, "{place}");
                    heard += 1;
                    ControlFlow::Continue(())
                }
                Event::Fault { kind: FaultKind::Stuck, finger: 2 } if heard == touches.len() => ControlFlow::Break(()),
                event => panic!("{place}: {event:?}"),
            }
        });
        assert_eq!((starts, heard), (ends.len(), touches.len()));
        let cuts = ends.len() - 1;
        let lost = touches.len() - known.counted;
        eprintln!(
            "{target}: {} touches, {cuts} power cuts, {lost} touches under way then were not counted",
            touches.len()
        );
        // Only of the approaches in which the power went.
        assert!(lost <= cuts && (count < 1_000 || cuts > count / 100 && lost > cuts / 4), "{lost} at {cuts} cuts");
    }
}

/// Plays segments into the image's pins, each after the chip has started, and hands number and event of all that it says to `each`,
/// until that has heard enough. No host speaks to the chip except for asking for its boot number, which is another one each time.
fn run_gpio(image: &Path, machine: &str, segments: Vec<Segment>, mut each: impl FnMut(u32, Event) -> ControlFlow<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-machine", machine, "-display", "none", "-monitor", "none", "-serial", "stdio", "-serial"]);
    qemu.arg(format!("tcp:{}", listener.local_addr().unwrap())).args(["-semihosting-config", "enable=on"]);
    qemu.arg("-kernel").arg(image).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = qemu.spawn().unwrap();
    let (mut uart, mut to_chip) = (child.stdout.take().unwrap(), child.stdin.take().unwrap());
    let (done, wait) = std::sync::mpsc::channel::<()>();
    let guard = std::thread::spawn(move || {
        // Longer than a busy machine takes; without it a lost event would keep the test waiting forever.
        let in_time = wait.recv_timeout(Duration::from_secs(1_800)) != Err(RecvTimeoutError::Timeout);
        child.kill().unwrap();
        child.wait().unwrap();
        in_time
    });
    let (started, starts) = std::sync::mpsc::channel();
    let player = std::thread::spawn(move || {
        let (mut pins, _) = listener.accept().unwrap();
        for segment in segments {
            // What is on the line when the power goes is lost, so nothing is.
            if starts.recv().is_err() {
                break;
            }
            pins.write_all(&segment.bytes).unwrap();
        }
        pins
    });
    // It opens no session: the chip has none of this number.
    let request = Request::Hello { previous: 1, boot: 0 };
    let hello = Frame { session: 2, message: Message::Request { number: 1, request } };
    let mut boots = BTreeSet::new();
    let mut decoder = Decoder::new();
    let mut buffer = [0; 1024];
    'all: loop {
        let read = uart.read(&mut buffer).unwrap();
        assert!(read > 0, "the emulator has ended, or half an hour is over");
        for &byte in &buffer[..read] {
            // A frame in which the power went does not count.
            let Some(Ok(frame)) = decoder.feed(byte) else { continue };
            let (number, event) = match frame.message {
                Message::Event { number, event } => (number, event),
                Message::Answer { answer: Answer::Session { boot, .. }, .. } => {
                    assert!(boots.insert(boot), "boot number {boot} comes again");
                    continue;
                }
                message => panic!("{message:?}"),
            };
            if each(number, event).is_break() {
                break 'all;
            }
            if event == Event::Started {
                to_chip.write_all(encode(&hello, &mut [0; FRAME_MAX])).unwrap();
                to_chip.flush().unwrap();
                // The player may have nothing left to play.
                let _ = started.send(());
            }
        }
    }
    assert!(!boots.is_empty(), "the chip says no boot number");
    drop(started);
    drop(player.join().unwrap());
    drop(done);
    assert!(guard.join().unwrap(), "half an hour was not enough");
}

#[test]
#[ignore = "needs an emulator; see the top of tests/tests/whole/firmware.rs"]
fn a_core_that_faults_on_unaligned_loads_gives_the_hosts_margins_and_verdicts_wherever_the_model_stands() {
    let digest = palpate_tests::identity::digest(&Model::new(HOUSEHOLD).unwrap());
    // Not among images with another memory.
    let target = Path::new(ROOT).join("onboard/firmware/target/microbit");
    let mut cargo = cargo("build", "alignment", M0, &["--target-dir", target.to_str().unwrap()]);
    assert!(cargo.env("PALPATE_MEMORY", "microbit.x").status().unwrap().success(), "the firmware does not build");
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-machine", "microbit", "-nographic", "-semihosting-config", "enable=on,target=native", "-kernel"]);
    let output = qemu.arg(target.join(M0).join("release/alignment")).stdin(Stdio::null()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}");
    assert_eq!(said.lines().collect::<Vec<_>>(), [format!("at 0: {digest:08x}"), format!("at 1: {digest:08x}")]);
}
