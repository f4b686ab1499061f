//! Touches of a real probe become a data set: from a file of lines, and from a chip whose cable is pulled.

use crate::{command, globe, json, listing, run, stderr, stdout};
use palpate::touches::Dataset;
use palpate_shared::link::{
    Decision, Device, DeviceEnd, Event, FaultKind, ModelInfo, Outcome, Payload, Progress, Refusal, TouchMessage,
    VerdictMessage,
};
use palpate_shared::{ContactTime, Touch};
use serde_json::{Value, json as value};
use std::cell::Cell;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Output, Stdio};

/// Lines as a robot prints them: seconds on a clock of its own, and an approach that missed.
const LINES: &str = "0.000 0.155 -\n1.010,1.000,1.000\n- - -\n";

fn recorded(directory: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(directory.join("dataset.json")).unwrap()).unwrap()
}

/// A run of `data record` that reads these lines.
fn record(lines: &str, directory: &Path, object: &str, more: &[&str]) -> Output {
    let arguments = ["data", "record", "-", "--object", object, "-o", directory.to_str().unwrap()];
    let mut child = command(arguments.iter().chain(more))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A run with wrong options does not read.
    let _ = child.stdin.take().unwrap().write_all(lines.as_bytes());
    child.wait_with_output().unwrap()
}

#[test]
fn lines_become_a_data_set_that_says_what_it_is_and_grows() {
    let place = tempfile::tempdir().unwrap();
    let data = place.path().join("recorded");
    let probe = place.path().join("probe.toml");
    std::fs::write(&probe, "radius = 0.2\nspacing = 2.0\nspeed = 8\n").unwrap();
    let text = stdout(record(LINES, &data, "bowl", &["--probe", probe.to_str().unwrap()]));
    let expected = "recorded 3 touches of bowl into {}, which holds 3 of it now\n\
                    contacts: 1 have three, 1 two, 0 one, 1 none\n";
    assert_eq!(text, expected.replace("{}", data.to_str().unwrap()));
    assert_eq!(
        std::fs::read_to_string(data.join("bowl.txt")).unwrap(),
        "0.000000 0.155000 -\n0.010000 0.000000 0.000000\n- - -\n"
    );
    // Added to, by the probe that is stated there, and another object.
    let summary = json(record("0 0.1 0.2\n", &data, "bowl", &["--json"]));
    assert_eq!((&summary["touches"], &summary["all_touches"]), (&value!(1), &value!(4)));
    stdout(record("0 0.3 0.2\n0 0.3 -\n", &data, "mug", &[]));
    let stated = recorded(&data);
    assert_eq!((&stated["complete"], &stated["settings"]["approaches"]), (&value!(true), &value!(true)));
    assert_eq!(stated["settings"]["probe"]["spacing"], 2.0);
    let sessions = stated["recorded"].as_array().unwrap();
    let said = |index: usize| (&sessions[index]["object"], &sessions[index]["touches"], &sessions[index]["source"]);
    assert_eq!(said(0), (&value!("bowl"), &value!(3), &value!("standard input")));
    assert_eq!((said(1).1, said(2).0), (&value!(1), &value!("mug")));
    let began = sessions[0]["began"].as_str().unwrap();
    assert!(began.starts_with("20") && began.ends_with('Z') && began.len() == 20, "{began}");
    let dataset = Dataset::read(&data).unwrap();
    assert_eq!((dataset.names(), dataset.len()), (vec!["bowl".to_owned(), "mug".to_owned()], 6));
}

#[test]
fn a_recording_trains_and_is_recognized_like_any_other_data_set() {
    let place = tempfile::tempdir().unwrap();
    let data = place.path().join("recorded");
    for (name, late) in [("bowl", 10), ("mug", 60)] {
        let lines: String = (0..60).map(|i| format!("0 0 0.{:03}\n", late + i % 10)).collect();
        stdout(record(&lines, &data, name, &[]));
    }
    let ensemble = place.path().join("model.json");
    let [data, ensemble] = [&data, &ensemble].map(|path| path.to_str().unwrap());
    let model = place.path().join("model.palpate");
    let model = model.to_str().unwrap();
    stdout(run(["train", data, "-o", ensemble, "--trees", "rounds=3,depth=2"]));
    let said = stdout(run(["evaluate", ensemble, data]));
    assert!(said.contains("\nall     100.0 % 100.0 %"), "{said}");
    stdout(run(["export", ensemble, "-o", model]));
    let verdicts = stdout(run(["recognize", model, &format!("{data}/mug.txt")]));
    assert!(verdicts.contains("mug") && !verdicts.contains("bowl"), "{verdicts}");
}

#[test]
fn what_is_no_touch_is_refused_with_its_line_and_nothing_is_written() {
    let place = tempfile::tempdir().unwrap();
    let data = place.path().join("recorded");
    let error = stderr(record("0 0.1 0.2\n0 x 0\n", &data, "bowl", &[]), 1);
    assert!(error.contains("standard input:2: \"x\" is not a number"), "{error}");
    let error = stderr(record("\n\n", &data, "bowl", &[]), 1);
    assert!(error.contains("standard input: no touches in it"), "{error}");
    assert!(!data.exists());
    let error = stderr(record(LINES, &data, "bowl", &["--pose"]), 1);
    assert!(error.contains("no pose, but this data set is recorded with one. Give direction and alignment"), "{error}");
    let error = stderr(record(LINES, &data, "../bowl", &[]), 1);
    assert!(error.contains("no file can be named after the object \"..\""), "{error}");
    let error = stderr(run(["data", "record", "no-such-file", "--object", "bowl", "-o", data.to_str().unwrap()]), 1);
    assert!(error.contains("no-such-file: cannot read the touches"), "{error}");
    assert_eq!(listing(&data), [".lock"]);
}

#[test]
fn recorded_and_simulated_touches_are_never_mixed() {
    let place = tempfile::tempdir().unwrap();
    let [simulated, data] = ["simulated", "recorded"].map(|name| place.path().join(name));
    let bowl = globe(place.path(), "bowl", 4);
    let capture = |directory: &Path, more: &[&str]| {
        let arguments = ["capture", bowl.to_str().unwrap(), "--touches", "20", "-o", directory.to_str().unwrap()];
        command(arguments.iter().chain(more)).output().unwrap()
    };
    stdout(capture(&simulated, &[]));
    let error = stderr(record(LINES, &simulated, "mug", &[]), 1);
    assert!(error.contains("holds 20 simulated touches of bowl. Give another directory"), "{error}");
    stdout(record(LINES, &data, "mug", &[]));
    // Nobody could make them again, so they are not replaced either.
    for more in [&[][..], &["--add"], &["--resume"], &["--force"]] {
        let error = stderr(capture(&data, more), 1);
        assert!(error.contains("holds 3 recorded touches of mug. Give another directory"), "{more:?}: {error}");
    }
    assert_eq!(Dataset::read_any(&data).unwrap().len(), 3);
    let error = stderr(record(LINES, &data, "mug", &[]), 1);
    assert!(error.contains("standard input: the same 3 touches of mug were recorded before, on 20"), "{error}");
    let probe = place.path().join("probe.toml");
    std::fs::write(&probe, "unit = \"mm\"\nradius = 2\nspacing = 20\nspeed = 80\n").unwrap();
    let error = stderr(record("0 0 0\n", &data, "mug", &["--probe", probe.to_str().unwrap()]), 1);
    assert!(error.contains("cannot add to these recorded touches: unit is unit there and mm here"), "{error}");
    assert!(error.contains("Record as these touches were, or into another directory."), "{error}");
}

/// A chip without a model whose fingers touch when this test says so.
struct Fingers {
    /// True once the host has asked for the model, its last question.
    greeted: Cell<bool>,
}

impl Device for Fingers {
    fn touch(&mut self, _: &Touch, _: bool) -> Outcome {
        Outcome::Refused(Refusal::NoModel)
    }

    fn reset(&mut self) -> Outcome {
        Outcome::Refused(Refusal::NoModel)
    }

    fn begin(&mut self, _: Payload, _: u32, _: u32) -> Outcome {
        Outcome::Refused(Refusal::Unsupported)
    }

    fn chunk(&mut self, _: u32, _: &[u8]) -> Outcome {
        Outcome::Refused(Refusal::Unsupported)
    }

    fn commit(&mut self) -> Outcome {
        Outcome::Refused(Refusal::Unsupported)
    }

    fn model(&self) -> Option<ModelInfo> {
        self.greeted.set(true);
        None
    }

    fn name(&self, _: u8) -> Option<&str> {
        None
    }

    fn posterior(&self, _: u8) -> Option<u64> {
        None
    }

    fn snapshot(&mut self, _: u32, _: &mut [u8]) -> Result<(u32, usize), Refusal> {
        Err(Refusal::Unsupported)
    }

    fn program(&self) -> &str {
        "three fingers 1.0"
    }
}

fn touch(number: u32) -> Touch {
    Touch::new(
        [0, 1_000 * number, if number.is_multiple_of(2) { u32::MAX } else { 40_000 }].map(ContactTime::from_micros),
    )
}

/// The chip's report of a touch, counted or not.
fn event(number: u32) -> Event {
    let touch = TouchMessage::from(&touch(number));
    let verdict = VerdictMessage { decision: Decision::Undecided, best: 0, touches: number, detail: None };
    match number % 3 {
        0 => Event::Touch { touch, pose_age: None, verdict },
        _ => Event::Refused { touch, refusal: Refusal::NoModel },
    }
}

/// The chip's report of an approach without a contact.
fn miss() -> Event {
    let touch = TouchMessage::from(&Touch::new([ContactTime::MISSING; 3]));
    Event::Refused { touch, refusal: Refusal::NoModel }
}

/// Answers the host until it has asked for everything, then reports these events.
fn serve(stream: &mut TcpStream, end: &mut DeviceEnd, events: &[Event]) {
    let mut fingers = Fingers { greeted: Cell::new(false) };
    let mut buffer = [0; 64];
    while !fingers.greeted.get() {
        let count = stream.read(&mut buffer).unwrap();
        assert!(count > 0, "the host hung up");
        end.receive(&buffer[..count], &mut fingers, |frame| stream.write_all(frame).unwrap());
    }
    events.iter().for_each(|event| end.tell(*event, |frame| stream.write_all(frame).unwrap()));
}

/// Until the host hangs up.
fn wait(stream: &mut TcpStream) {
    while !matches!(stream.read(&mut [0; 64]), Ok(0)) {}
}

#[test]
fn a_pulled_cable_neither_loses_a_reported_touch_nor_doubles_one() {
    let place = tempfile::tempdir().unwrap();
    let data = place.path().join("recorded");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp://{}", listener.local_addr().unwrap());
    let chip = std::thread::spawn(move || {
        let mut end = DeviceEnd::new(Progress::NONE, 5);
        let (mut stream, _) = listener.accept().unwrap();
        let before: Vec<Event> = (1..=5).map(event).collect();
        serve(&mut stream, &mut end, &before);
        // In the middle of a frame.
        end.tell(event(6), |frame| stream.write_all(&frame[..frame.len() / 2]).unwrap());
        drop(stream);
        // Nobody hears this one.
        end.tell(event(7), |_| ());
        let (mut stream, _) = listener.accept().unwrap();
        let fault = Event::Fault { kind: FaultKind::Silent, finger: 2 };
        serve(&mut stream, &mut end, &[event(8), fault, miss(), event(9), event(10)]);
        wait(&mut stream);
    });
    let arguments =
        ["data", "record", &port, "-o", data.to_str().unwrap(), "--object", "bowl", "--stop-after", "8", "--json"];
    let output = run(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let summary = json(output);
    chip.join().unwrap();
    // The tenth was told, but eight were wanted.
    let mut expected: Vec<Touch> = (1..=5).chain(8..=9).map(touch).collect();
    expected.insert(6, Touch::new([ContactTime::MISSING; 3]));
    assert_eq!(Dataset::read_any(&data).unwrap().objects[0].touches(), expected);
    let expected = value!({
        "object": "bowl", "touches": 8, "all_touches": 8, "contacts": [1, 0, 3, 4], "without_pose": 0, "missed": 2,
        "faults": 1, "lost": 1, "firmware": "three fingers 1.0",
    });
    assert_eq!(summary, expected);
    assert!(said.contains("the connection to the chip was lost") && said.contains("Waiting for it."), "{said}");
    assert!(said.contains("warning: finger 3: silent") && said.contains("2 reports of the chip were lost"), "{said}");
    let stated = recorded(&data);
    assert_eq!(stated["recorded"].as_array().unwrap().len(), 1, "{stated}");
    assert_eq!(stated["recorded"][0]["firmware"], "three fingers 1.0");
    assert_eq!((&stated["recorded"][0]["source"], &stated["objects"][0]["touches"]), (&value!(port), &value!(8)));
}

#[test]
fn each_touch_is_printed_and_a_second_recording_of_the_object_is_added() {
    let place = tempfile::tempdir().unwrap();
    let data = place.path().join("recorded");
    for round in 0..2 {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = format!("tcp://{}", listener.local_addr().unwrap());
        let chip = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            serve(&mut stream, &mut DeviceEnd::new(Progress::NONE, 1), &[event(1), event(4), miss()]);
            wait(&mut stream);
        });
        let directory = data.to_str().unwrap();
        let text = stdout(run(["data", "record", &port, "-o", directory, "--object", "bowl", "--stop-after", "3"]));
        chip.join().unwrap();
        let [first, second, all] = [1, 2, 3].map(|number| number + 3 * round);
        let expected = format!(
            "recording bowl into {directory}: three fingers 1.0; 3 touches\n\
             {first:5}     0.000     1.000    40.000 ms\n\
             {second:5}     0.000     4.000         - ms\n\
             {all:5}         -         -         - ms\n\
             recorded 3 touches of bowl into {directory}, which holds {all} of it now\n\
             contacts: 1 have three, 1 two, 0 one, 1 none\n"
        );
        assert_eq!(text, expected);
    }
    assert_eq!(Dataset::read_any(&data).unwrap().len(), 6);
}

#[test]
fn a_touch_that_the_chip_tells_again_from_before_the_recording_is_said_and_not_recorded() {
    let place = tempfile::tempdir().unwrap();
    let data = place.path().join("recorded");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp://{}", listener.local_addr().unwrap());
    let chip = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        // Another object was touched, and the chip switched off. It starts while the host asks who is there.
        let mut before = DeviceEnd::new(Progress::NONE, 1);
        before.report(event(1), &mut Fingers { greeted: Cell::new(false) }, |_| ());
        let mut end = DeviceEnd::new(before.progress().clone(), 2);
        end.start(|frame| stream.write_all(frame).unwrap());
        serve(&mut stream, &mut end, &[event(4)]);
        wait(&mut stream);
    });
    let directory = data.to_str().unwrap();
    let output = run(["data", "record", &port, "-o", directory, "--object", "bowl", "--stop-after", "1"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    chip.join().unwrap();
    assert!(said.contains("warning: a touch from before this recording was told again, and not recorded"), "{said}");
    assert_eq!(Dataset::read_any(&data).unwrap().objects[0].touches(), [touch(4)]);
}

#[test]
fn with_the_pose_wanted_touches_without_one_are_said_and_not_recorded() {
    let place = tempfile::tempdir().unwrap();
    let data = place.path().join("recorded");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp://{}", listener.local_addr().unwrap());
    let pose = palpate_shared::Pose { direction: [0, 0, -32767], alignment: [32767, 0, 0] };
    let chip = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let touch = TouchMessage::from(&touch(3).with_pose(pose));
        let posed = Event::Refused { touch, refusal: Refusal::NoModel };
        serve(&mut stream, &mut DeviceEnd::new(Progress::NONE, 1), &[event(1), posed]);
        wait(&mut stream);
    });
    let directory = data.to_str().unwrap();
    let arguments = ["data", "record", &port, "-o", directory, "--object", "bowl", "--stop-after", "1", "--pose"];
    let output = run(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let text = stdout(output);
    chip.join().unwrap();
    assert!(said.contains("warning: a touch without a pose was not recorded"), "{said}");
    assert!(text.ends_with("not recorded: 1 touches without a pose, 0 reports lost on the way\n"), "{text}");
    let dataset = Dataset::read_any(&data).unwrap();
    assert_eq!(dataset.objects[0].touches(), [touch(3).with_pose(pose)]);
    assert!(dataset.origin.unwrap().pose);
}

#[test]
fn bad_arguments_of_recordings_exit_with_2() {
    for (arguments, part) in [
        (&["data", "record", "emulator", "-o", "recorded"][..], "--object"),
        (&["data", "record", "x.txt", "--object", "bowl"], "--output"),
        (&["data"], "Usage: palpate data"),
    ] {
        let error = stderr(run(arguments), 2);
        assert!(error.contains(part), "{arguments:?}: {error}");
    }
}
