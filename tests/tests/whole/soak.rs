//! A day of touches, shortened: the chip's whole program in one process, the host in another, and between them a line that loses,
//! doubles, changes and delays frames.
//!
//! 100,000 touches; `PALPATE_SOAK=1000000 cargo test --release -p palpate-tests --test whole soak:: -- --nocapture` for a million.

use palpate::chip::{Asks, Connection, Emulator, Port, Steps, Update, stream};
use palpate::compile::Leaf;
use palpate::touches::{Dataset, ObjectTouches, Source};
use palpate_onboard::station::{Memory, RECORD_LENGTH, serve};
use palpate_shared::Descriptor;
use palpate_shared::link::HostSettings;
use palpate_tests::random::{self, Shape};
use rand::rngs::ChaCha8Rng;
use rand::{Rng, RngExt, SeedableRng};
use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::ops::ControlFlow;
use std::process::{Command, Stdio};
use wire::Wire;

#[path = "../../../host/program/tests/cli/chip_wire.rs"]
mod wire;

const OBJECTS: usize = 10;
/// Tells the chip's process where its host is.
const HOST: &str = "PALPATE_SOAK_HOST";
/// Tells the test that its process has no other tests, whose memory would count.
const ALONE: &str = "PALPATE_SOAK_ALONE";

/// One in so many frames is lost, one is doubled, one has a bit changed, and one comes after up to eight others.
const FAULTY: u32 = 500;

/// Passes on the frames that it gets, with faults, until either end is gone.
fn pass(mut from: TcpStream, mut to: TcpStream, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut buffer, mut frame, mut late) = ([0; 4096], Vec::new(), VecDeque::new());
    while let Ok(count @ 1..) = from.read(&mut buffer) {
        let mut passed = Vec::new();
        for &byte in &buffer[..count] {
            frame.push(byte);
            // A frame begins and ends with a 0.
            if byte != 0 || frame.len() == 1 {
                continue;
            }
            let mut whole = std::mem::take(&mut frame);
            match rng.random_range(0..FAULTY) {
                0 => continue,
                1 => passed.extend_from_slice(&whole),
                2 => {
                    let at = rng.next_u32() as usize % whole.len();
                    whole[at] ^= 1 << rng.random_range(0..8);
                }
                3 => {
                    late.push_back((rng.random_range(1..=8), whole));
                    continue;
                }
                _ => {}
            }
            passed.extend_from_slice(&whole);
            late.iter_mut().for_each(|(others, _)| *others -= 1);
            while let Some((_, whole)) = late.pop_front_if(|(others, _)| *others <= 0) {
                passed.extend(whole);
            }
        }
        if to.write_all(&passed).is_err() {
            break;
        }
    }
    let _ = to.shutdown(std::net::Shutdown::Both);
}

/// Not a test: this is the chip, when the soak test starts this program again.
#[test]
fn the_chips_process() {
    let Ok(host) = std::env::var(HOST) else { return };
    let mut wire = Wire(TcpStream::connect(host).unwrap());
    wire.0.set_nodelay(true).unwrap();
    let [mut a, mut b] = [(); 2].map(|()| vec![0; 100_000]);
    let [mut c, mut d] = [[0; RECORD_LENGTH]; 2];
    let mut memory = Memory { models: [&mut a, &mut b], records: [&mut c, &mut d] };
    serve::<OBJECTS, _, _>(&[], &mut memory, 0, &mut wire).unwrap();
}

/// Resident memory of a process in bytes, where the system reports it.
fn memory(process: &str) -> Option<u64> {
    let pages = std::fs::read_to_string(format!("/proc/{process}/statm")).ok()?;
    pages.split_whitespace().nth(1)?.parse::<u64>().ok().map(|pages| pages * 4096)
}

#[test]
fn soak_over_a_bad_line_neither_drifts_nor_grows_nor_loses_a_touch_nor_counts_one_twice() {
    if std::env::var_os(ALONE).is_none() {
        let name = "soak::soak_over_a_bad_line_neither_drifts_nor_grows_nor_loses_a_touch_nor_counts_one_twice";
        let mut alone = Command::new(std::env::current_exe().unwrap());
        let output = alone.args(["--exact", name, "--nocapture"]).env(ALONE, "").output().unwrap();
        let said = [output.stdout, output.stderr].concat();
        println!("{}", String::from_utf8_lossy(&said));
        return assert!(output.status.success());
    }
    let count: u64 = std::env::var("PALPATE_SOAK").map_or(100_000, |count| count.parse().unwrap());
    let descriptor = Descriptor::Oriented;
    let shape =
        Shape { descriptor, objects: OBJECTS, trees: 20, depth: 5, thresholds: 200, leaf: 0.02, ..Shape::SMALL };
    let bytes = random::model(shape, 1, Leaf::I16);

    // The chip connects to us, and palpate link connects to what passes its bytes on.
    let chips_end = TcpListener::bind("127.0.0.1:0").unwrap();
    let hosts_end = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut chip = Command::new(std::env::current_exe().unwrap());
    chip.args(["--exact", "soak::the_chips_process"]).env(HOST, chips_end.local_addr().unwrap().to_string());
    let mut chip = chip.stdout(Stdio::null()).spawn().unwrap();
    let (to_chip, _) = chips_end.accept().unwrap();
    to_chip.set_nodelay(true).unwrap();
    let port = Port::Tcp(hosts_end.local_addr().unwrap().to_string());
    let passing = std::thread::spawn(move || {
        let (to_host, _) = hosts_end.accept().unwrap();
        to_host.set_nodelay(true).unwrap();
        let (from_host, from_chip) = (to_host.try_clone().unwrap(), to_chip.try_clone().unwrap());
        let up = std::thread::spawn(move || pass(from_chip, to_host, 1));
        pass(from_host, to_chip, 2);
        up.join().unwrap();
    });

    let transport = port.open(115_200, &Emulator::default()).unwrap();
    let mut connection = Connection::open(transport, HostSettings { retry: 5_000, attempts: 100 }).unwrap();
    connection.load(&bytes, &()).unwrap();
    let described = connection.model().unwrap().unwrap();
    let object = |index: usize| {
        ObjectTouches::new(format!("object {index}"), random::touches(997, index as u64), Source::Object)
    };
    let dataset = Dataset::new((0..OBJECTS).map(object).collect());
    let (mut early, mut done, mut events) = ([None; 2], 0_u64, 0);
    let processes = ["self".to_owned(), chip.id().to_string()];
    let summary = stream(
        &mut connection,
        Steps::sequences(dataset, 300, count),
        &described,
        Some(&bytes),
        Asks::Nothing,
        |_, update| {
            done += u64::from(matches!(update, Update::Touch { .. } | Update::Refused { .. }));
            events += u32::from(matches!(update, Update::Event(..)));
            if done == count / 10 && early[0].is_none() {
                early = processes.each_ref().map(|process| memory(process));
            }
            Ok(ControlFlow::Continue(()))
        },
    )
    .unwrap();
    let late = processes.each_ref().map(|process| memory(process));
    drop(connection);
    passing.join().unwrap();
    assert!(chip.wait().unwrap().success(), "the chip's process");

    eprintln!("{:.0} touches per second; memory {early:?} then {late:?}; {summary:?}", summary.rate());
    assert_eq!(
        (summary.touches + summary.refused, summary.compared, summary.differences),
        (count, count, 0),
        "{summary:?}"
    );
    // Of the frames of each direction, so many were faulty in each way.
    let few = count / u64::from(2 * FAULTY);
    assert!(summary.resent > few && summary.garbled > few && summary.chip_garbled > few, "{summary:?}");
    assert!(summary.chip_repeated > few && summary.chip_late > few / 2 && events == 0, "{summary:?}");
    for (early, late) in early.into_iter().zip(late) {
        let Some((early, late)) = early.zip(late) else { continue };
        assert!(late < early + (1 << 18), "memory grew from {early} to {late} bytes");
    }
}
