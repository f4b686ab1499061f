//! The commands that talk to a chip, with a chip's whole program behind a TCP connection.

use crate::chip_wire::Wire;
use crate::fixtures::{LOCATED, ONE_SPLIT, pressed_box};
use crate::locate::recognized;
use crate::{command, complains, fails, figures, json, lines, listen, piped, run, says, stderr, stdout, succeeds};
use palpate_onboard::Model;
use palpate_onboard::station::{Memory, NoStorage, RECORD_LENGTH, Station, Table, serve, serve_with};
use palpate_shared::Touch;
use palpate_shared::link::{DeviceEnd, Event, FaultKind, Refusal, TouchMessage};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::time::Duration;

const OBJECTS: usize = 2;

/// A port at which `chip` gets the first connection.
fn port(chip: impl FnOnce(TcpStream) + Send + 'static) -> String {
    listen(|listener| chip(listener.accept().unwrap().0)).0
}

/// A chip with this room for a model and these maps, until its first connection ends.
fn chip_of(room: usize, serve: impl FnOnce(&mut Memory<'_>, &mut Wire) + Send + 'static) -> String {
    port(move |stream| {
        stream.set_nodelay(true).unwrap();
        let [mut a, mut b] = [(); 2].map(|()| vec![0; room]);
        let [mut c, mut d] = [[0; RECORD_LENGTH]; 2];
        // It ends with an error where the host hangs up in the middle of something.
        serve(&mut Memory { models: [&mut a, &mut b], records: [&mut c, &mut d] }, &mut Wire(stream));
    })
}

/// A chip without a model.
fn chip() -> String {
    chip_of(10_000, |memory, wire| _ = serve::<OBJECTS, _, _>(&[], memory, 0, wire))
}

/// A chip with room for maps, as a Cortex-M4F with 128 KB has.
fn chip_with_table() -> String {
    chip_of(60_000, |memory, wire| {
        let mut table = Box::new(Table::<14_336, 32, 16>::new());
        let _ = serve_with::<OBJECTS, _, _, _>(&[], memory, &mut *table, 0, wire);
    })
}

#[test]
fn a_chip_with_maps_says_verdicts_places_and_approaches_as_the_host_does() {
    let at = &LOCATED.folder();
    // An empty line begins another object.
    let mut touches = pressed_box([60.0, 40.0, 30.0], 12);
    touches.insert(2, "\n".into());
    let said = recognized(at, "maps.palpate --next", &touches.concat());
    assert!(said.iter().any(|line| line["verdict"] == "recognized"), "{said:?}");
    let link = |chip: String, words: &str| succeeds(at, &format!("link {chip} {words}"));
    let text = link(chip_with_table(), "lines.txt --load maps.palpate --next");
    assert_eq!(lines(&text), said);
    let words = "--parity data --stop-after 12 --next --workspace 15";
    let text = link(chip_with_table(), &format!("--load maps.palpate {words}"));
    assert!(text.contains("compared with the host: 12 touches and 12 proposed approaches, 0 differences"), "{text}");
    assert!(link(chip_with_table(), "--load maps.palpate").contains(", maps, 2 objects: brick, slab"));
}

#[test]
fn touches_with_a_position_and_a_chip_without_maps_do_not_go_together() {
    let at = &LOCATED.folder();
    std::fs::copy(ONE_SPLIT.folder().join("model.palpate"), at.join("trees.palpate")).unwrap();
    std::fs::write(at.join("located.txt"), "0 0 0 0 0 -1 1 0 0 0 0 20\n").unwrap();
    std::fs::write(at.join("free.txt"), "0 0 0.08\n0 0 0 0 0.6 -0.8 1 0 0 0 0 20\n").unwrap();
    std::fs::write(at.join("nan.txt"), "0 0 0 0 0 -1 1 0 0 nan 0 20\n").unwrap();
    let of_trees = "the chip refuses: the touch has a position, and the chip has no model of maps. Load maps";
    for (chip, words, code, expected) in [
        (chip(), "located.txt --load trees.palpate", 1, of_trees),
        (chip_with_table(), "located.txt --load trees.palpate", 1, of_trees),
        (
            chip(),
            "free.txt --load trees.palpate --next --workspace 9",
            2,
            "--workspace is given. Use it with a model of maps",
        ),
        (chip(), "--load maps.palpate", 1, "the chip refuses the model: "),
        (chip_with_table(), "nan.txt --load maps.palpate", 1, "nan.txt:1: "),
        (chip_with_table(), "located.txt --load maps.palpate --next --workspace 2000", 2, "--workspace"),
    ] {
        fails(at, &format!("link {chip} {words}"), code, expected);
    }
    let text = succeeds(at, &format!("link {} free.txt --load maps.palpate", chip_with_table()));
    let refused = "not counted: the chip's model is of maps, and the touch has no position\nnot counted: it does not come straight down\n";
    assert!(text.starts_with(refused), "{text}");
}

#[test]
fn link_loads_a_model_and_says_what_is_on_the_chip() {
    let at = &ONE_SPLIT.folder();
    let length = std::fs::metadata(at.join("model.palpate")).unwrap().len();
    let link = || format!("link {} --load model.palpate", chip());
    let text = says(at, &link(), &[&format!(": a model of {length} bytes, checksum ")]);
    assert!(text.starts_with("tcp://127.0.0.1:"), "{text}");
    assert!(text.ends_with(", curvature, 2 objects: bowl, fork\n"), "{text}");
    let described = figures(at, &link());
    assert_eq!(described["objects"], serde_json::json!(["bowl", "fork"]));
    assert_eq!(described["length"], length);
}

#[test]
fn link_recognizes_as_the_host_does() {
    let place = ONE_SPLIT.folder();
    let arguments = ["--load", &place.text("model.palpate"), "--parity", &place.text("data"), "--stop-after", "240"];
    let mut command = command(["link", &chip()]);
    let summary = json(command.args(arguments).arg("--json").output().unwrap());
    assert_eq!(
        (&summary["touches"], &summary["compared"], &summary["differences"]),
        (&240.into(), &240.into(), &0.into())
    );
    assert_eq!((&summary["right"], &summary["wrong"], &summary["undecided"]), (&4.into(), &0.into(), &0.into()));
}

#[test]
fn each_line_is_a_touch_an_empty_one_begins_another_object_and_a_wrong_one_is_named() {
    let place = ONE_SPLIT.folder();
    let link = |input: &[u8]| piped(command(["link", &chip(), "-", "--load", &place.text("model.palpate")]), input);
    let text = stdout(link(b"0 0 0.08\n0 0 0.08\n\n0 0 0.01\n"));
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("most likely fork after 1 touch, posterior 0.8"), "{text}");
    assert!(lines[1].starts_with("most likely fork after 2 touches, posterior 0.9"), "{text}");
    assert!(lines[2].starts_with("most likely bowl after 1 touch, posterior 0.8"), "{text}");
    assert!(lines[3].starts_with("3 touches in "), "{text}");
    let expected = "standard input:2: 1 fields … three times in seconds";
    complains(link(b"0 0 0.08\nnonsense\n"), "link", 1, expected);
}

#[test]
fn a_chip_without_a_model_and_a_chip_that_is_gone_say_what_to_do() {
    // Nobody listens there: the listener is gone again.
    let nobody = format!("tcp://{}", TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap());
    for (port, expected) in [
        (chip(), "the chip has no model. Load a model into it."),
        (port(drop), "the connection to the chip was lost … Check the cable"),
        (nobody, "cannot connect to the chip … Check the address"),
    ] {
        fails(Path::new("."), &format!("link {port}"), 1, expected);
    }
}

#[test]
fn bad_arguments_of_link_exit_with_2() {
    let place = ONE_SPLIT.folder();
    let error = stderr(run(["link", "emulator", "--parity", &place.text("data")]), 2);
    assert!(error.contains("--load"), "{error}");
    let error = stderr(run(["link", "http://host:1"]), 2);
    assert!(error.contains("`http://host:1` is not a port. Give a serial port"), "{error}");
}

/// A chip with this model whose own fingers touch once the host has asked what it wants to know.
fn chip_with_fingers(bytes: Vec<u8>) -> String {
    port(move |mut stream| {
        let mut station = Station::<OBJECTS>::new(&Model::new(&bytes).unwrap());
        let mut end = DeviceEnd::new(1);
        let mut buffer = [0; 256];
        stream.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            end.receive(&buffer[..count], &mut station, |frame| stream.write_all(frame).unwrap());
        }
        let touch = Touch::from_micros([0, 1_000, 80_000]);
        for _ in 0..2 {
            let verdict = station.push(&touch, false).unwrap();
            let event = Event::Touch { touch: TouchMessage::from(&touch), pose_age: None, verdict };
            end.tell(event, |frame| stream.write_all(frame).unwrap());
        }
        let fault = Event::Fault { kind: FaultKind::Silent, finger: 2 };
        end.tell(fault, |frame| stream.write_all(frame).unwrap());
        let refused = Event::Refused { touch: TouchMessage::from(&touch), refusal: Refusal::NoPose };
        end.tell(refused, |frame| stream.write_all(frame).unwrap());
        stream.set_read_timeout(None).unwrap();
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            end.receive(&buffer[..count], &mut station, |frame| _ = stream.write_all(frame));
        }
    })
}

#[test]
fn link_without_touches_prints_a_line_for_each_touch_of_the_chips_own_fingers() {
    let at = &ONE_SPLIT.folder();
    let model = std::fs::read(at.join("model.palpate")).unwrap();
    let text = succeeds(at, &format!("link {} --stop-after 3", chip_with_fingers(model.clone())));
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("model of ") && lines[0].ends_with(": bowl, fork"), "{text}");
    let expected = [
        "    1     0.000     1.000    80.000 ms  perhaps fork",
        "    2     0.000     1.000    80.000 ms  perhaps fork",
        "fault: finger 3: silent",
        "fault: a touch was not counted: the model needs the probe's pose, and the touch has none",
    ];
    assert_eq!(lines[1..], expected, "{text}");
    let said = crate::lines(&succeeds(at, &format!("link {} --stop-after 1 --json", chip_with_fingers(model))));
    assert_eq!((&said[0]["is"], &said[1]["is"], &said[1]["best"]), (&"model".into(), &"touch".into(), &"fork".into()));
}

/// A stream that ends where nothing comes for a while.
struct Brief(Wire);

impl embedded_io::ErrorType for Brief {
    type Error = embedded_io::ErrorKind;
}

impl embedded_io::Read for Brief {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
        self.0.0.set_read_timeout(Some(std::time::Duration::from_millis(500))).unwrap();
        Ok(self.0.read(buffer).unwrap_or(0))
    }
}

impl embedded_io::Write for Brief {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Self::Error> {
        self.0.write(buffer)
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        self.0.flush()
    }
}

/// A chip with this model, and after a reset with that one.
fn chip_that_is_reset(before: Vec<u8>, after: Vec<u8>) -> String {
    port(move |stream| {
        let mut wire = Brief(Wire(stream));
        let _ = serve::<16, _, _>(&before, &mut NoStorage, 1, &mut wire);
        let _ = serve::<16, _, _>(&after, &mut NoStorage, 2, &mut wire);
        // Until the host hangs up, so that what was sent last arrives.
        let _ = wire.0.0.read(&mut [0; 100]);
    })
}

#[test]
fn a_chip_that_is_reset_and_has_another_model_then_is_not_shown_with_the_names_of_the_one_before() {
    let household = include_bytes!("../../../../models/household.palpate").to_vec();
    let expected = format!("model of {} bytes", household.len());
    let own = std::fs::read(ONE_SPLIT.folder().join("model.palpate")).unwrap();
    for after in [own, Vec::new()] {
        let output = run(["link", &chip_that_is_reset(household.clone(), after)]);
        assert!(String::from_utf8_lossy(&output.stdout).starts_with(&expected));
        let error = stderr(output, 1);
        assert!(
            error.contains("the chip was reset and has another model than before. Load the model again"),
            "{error}"
        );
    }
}
