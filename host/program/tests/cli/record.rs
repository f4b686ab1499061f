//! Touches of a real probe become a data set: from a file of lines, and from a chip whose cable is pulled.

use crate::{
    Folder, command, complains, fails, globe, json, listen, listing, palpate, piped, read, says, stdout, succeeds,
};
use palpate::touches::Dataset;
use palpate_shared::link::{
    Decision, Device, DeviceEnd, EVENTS, Event, FaultKind, ModelInfo, Refusal, TouchMessage, VerdictMessage,
};
use palpate_shared::{ContactTime, Touch};
use serde_json::json as value;
use std::cell::Cell;
use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Output;

/// Lines as a robot prints them: seconds on a clock of its own, and an approach that missed.
const LINES: &str = "0.000 0.155 -\n1.010,1.000,1.000\n- - -\n";

/// A run of `data record` that reads these lines.
fn record(at: &Path, lines: &str, words: &str) -> Output {
    let mut command = command(["data", "record", "-"]);
    command.args(words.split(' ')).current_dir(at);
    piped(command, lines.as_bytes())
}

#[test]
fn lines_become_a_data_set_that_says_what_it_is_and_grows() {
    let at = &Folder::new();
    fs::write(at.join("probe.toml"), "radius = 0.2\nspacing = 2.0\nspeed = 8\n").unwrap();
    let text = stdout(record(at, LINES, "--object bowl -o recorded --probe probe.toml"));
    let expected = "recorded 3 touches of bowl into recorded, which holds 3 of it now\n\
                    contacts: 1 have three, 1 two, 0 one, 1 none\n";
    assert_eq!(text, expected);
    assert_eq!(
        fs::read_to_string(at.join("recorded/bowl.txt")).unwrap(),
        "0.000000 0.155000 -\n0.010000 0.000000 0.000000\n- - -\n"
    );
    // Added to, by the probe that is stated there, and another object.
    let summary = json(record(at, "0 0.1 0.2\n", "--object bowl -o recorded --json"));
    assert_eq!((&summary["touches"], &summary["all_touches"]), (&value!(1), &value!(4)));
    stdout(record(at, "0 0.3 0.2\n0 0.3 -\n", "--object mug -o recorded"));
    let stated = read(&at.join("recorded/dataset.json"));
    assert_eq!(stated["settings"]["approaches"], true);
    assert_eq!(stated["settings"]["probe"]["spacing"], 2.0);
    let sessions = stated["recorded"].as_array().unwrap();
    let said = |index: usize| (&sessions[index]["object"], &sessions[index]["touches"], &sessions[index]["source"]);
    assert_eq!(said(0), (&value!("bowl"), &value!(3), &value!("standard input")));
    assert_eq!((said(1).1, said(2).0), (&value!(1), &value!("mug")));
    let began = sessions[0]["began"].as_str().unwrap();
    assert!(began.starts_with("20") && began.ends_with('Z') && began.len() == 20, "{began}");
    let dataset = Dataset::read(&at.join("recorded")).unwrap();
    assert_eq!((dataset.names(), dataset.len()), (vec!["bowl".to_owned(), "mug".to_owned()], 6));
}

#[test]
fn a_recording_trains_and_is_recognized_like_any_other_data_set() {
    let at = &Folder::new();
    for (name, late) in [("bowl", 10), ("mug", 60)] {
        let lines: String = (0..60).map(|i| format!("0 0 0.{:03}\n", late + i % 10)).collect();
        stdout(record(at, &lines, &format!("--object {name} -o recorded")));
    }
    succeeds(at, "train recorded -o model.json --trees rounds=3,depth=2");
    says(at, "evaluate model.json recorded", &["\nall      100.0 %  100.0 %"]);
    succeeds(at, "export model.json -o model.palpate");
    let verdicts = says(at, "recognize model.palpate recorded/mug.txt", &["mug"]);
    assert!(!verdicts.contains("bowl"), "{verdicts}");
}

#[test]
fn what_cannot_be_recorded_is_refused_with_its_line_and_nothing_is_written() {
    let at = &Folder::new();
    let no_touch = "standard input:2: \"x\" is not a number";
    for (lines, more, code, expected) in [
        ("", "--object bowl", 2, "--output"),
        ("", "-o recorded", 2, "--object"),
        ("0 0.1 0.2\n0 x 0\n", "--object bowl -o none", 1, no_touch),
        ("\n\n", "--object bowl -o none", 1, "standard input: no touches in it"),
        (
            LINES,
            "--object bowl -o recorded --pose",
            1,
            "no pose, but this data set is recorded with one. Give direction and alignment",
        ),
        (LINES, "--object ../bowl -o recorded", 1, "no file can be named after the object \"..\""),
    ] {
        complains(record(at, lines, more), more, code, expected);
        assert!(!at.join("none").exists());
    }
    let expected = "no-such-file: cannot read the touches";
    fails(at, "data record no-such-file --object bowl -o recorded", 1, expected);
    assert_eq!(listing(&at.join("recorded")), [".lock"]);
    fails(at, "data", 2, "Usage: palpate data");
}

#[test]
fn recorded_and_simulated_touches_are_never_mixed() {
    let at = &Folder::new();
    globe(at, "bowl", 4);
    succeeds(at, "capture bowl.obj --touches 20 -o simulated");
    let refuses = |lines: &str, more: &str, expected: &str| {
        complains(record(at, lines, &format!("--object mug {more}")), more, 1, expected);
    };
    refuses(LINES, "-o simulated", "holds 20 simulated touches of bowl. Give another directory");
    stdout(record(at, LINES, "--object mug -o recorded"));
    // Nobody could make them again, so they are not replaced either.
    for more in ["", "--force"] {
        let expected = "holds 3 recorded touches of mug. Give another directory";
        fails(at, &format!("capture bowl.obj --touches 20 -o recorded {more}"), 1, expected);
    }
    assert_eq!(Dataset::read_any(&at.join("recorded")).unwrap().len(), 3);
}

/// A chip without a model whose fingers touch when this test says so.
struct Fingers {
    /// True once the host has asked for the model, its last question.
    greeted: Cell<bool>,
}

impl Device for Fingers {
    fn touch(&mut self, _: &Touch, _: bool) -> Result<VerdictMessage, Refusal> {
        Err(Refusal::NoModel)
    }

    fn reset(&mut self) -> Result<(), Refusal> {
        Err(Refusal::NoModel)
    }

    fn model(&self) -> Option<ModelInfo> {
        self.greeted.set(true);
        None
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

/// Answers what the host asks next, until it hangs up; says whether it has not.
fn answer(stream: &mut TcpStream, end: &mut DeviceEnd, fingers: &mut Fingers) -> bool {
    let mut buffer = [0; 64];
    let count = stream.read(&mut buffer).unwrap_or(0);
    end.receive(&buffer[..count], fingers, |frame| _ = stream.write_all(frame));
    count > 0
}

/// Answers the host until it has asked for everything, then reports these events, each once the one before is heard.
fn serve(stream: &mut TcpStream, end: &mut DeviceEnd, events: &[Event]) {
    let mut fingers = Fingers { greeted: Cell::new(false) };
    while !fingers.greeted.get() {
        assert!(answer(stream, end, &mut fingers), "the host hung up");
    }
    for event in events {
        end.tell(*event, |frame| _ = stream.write_all(frame));
        while end.wait(0).is_some() && answer(stream, end, &mut fingers) {}
    }
}

/// Until the host hangs up.
fn wait(stream: &mut TcpStream) {
    while !matches!(stream.read(&mut [0; 64]), Ok(0) | Err(_)) {}
}

/// Records touches of a bowl by a chip: its port, what the program says on stderr, and its output.
fn record_chip(at: &Path, chip: impl FnOnce(&TcpListener) + Send + 'static, more: &str) -> (String, String, Output) {
    let (port, chip) = listen(move |listener| chip(&listener));
    let output = palpate(at, &format!("data record {port} -o recorded --object bowl {more}"));
    chip.join().unwrap();
    (port, String::from_utf8_lossy(&output.stderr).into_owned(), output)
}

/// A chip of one connection that reports these events.
fn chip(events: Vec<Event>) -> impl FnOnce(&TcpListener) + Send + 'static {
    move |listener: &TcpListener| {
        let (mut stream, _) = listener.accept().unwrap();
        serve(&mut stream, &mut DeviceEnd::new(1), &events);
        wait(&mut stream);
    }
}

#[test]
fn a_pulled_cable_neither_loses_a_touch_that_the_chip_keeps_nor_doubles_one() {
    let at = &Folder::new();
    let chip = |listener: &TcpListener| {
        let mut end = DeviceEnd::new(5);
        let (mut stream, _) = listener.accept().unwrap();
        let before: Vec<Event> = (1..=5).map(event).collect();
        serve(&mut stream, &mut end, &before);
        // In the middle of a frame.
        end.tell(event(6), |frame| stream.write_all(&frame[..frame.len() / 2]).unwrap());
        drop(stream);
        // Nobody hears these: the chip keeps the last of them.
        (7..=7 + EVENTS).for_each(|number| end.tell(event(number), |_| ()));
        let (mut stream, _) = listener.accept().unwrap();
        let fault = Event::Fault { kind: FaultKind::Silent, finger: 2 };
        serve(&mut stream, &mut end, &[fault, miss(), event(12), event(13)]);
        wait(&mut stream);
    };
    let (port, said, output) = record_chip(at, chip, "--stop-after 11 --json");
    // The thirteenth was told, but eleven were wanted.
    let mut expected: Vec<Touch> = (1..=5).chain(8..=12).map(touch).collect();
    expected.insert(9, Touch::new([ContactTime::MISSING; 3]));
    assert_eq!(Dataset::read_any(&at.join("recorded")).unwrap().objects[0].touches(), expected);
    let expected = value!({
        "object": "bowl", "touches": 11, "all_touches": 11, "contacts": [1, 0, 5, 5], "without_pose": 0, "missed": 2,
        "faults": 1, "lost": 1, "firmware": "three fingers 1.0",
    });
    assert_eq!(json(output), expected);
    assert!(said.contains("the connection to the chip was lost") && said.contains("Waiting for it."), "{said}");
    assert!(said.contains("warning: finger 3: silent") && said.contains("2 reports of the chip were lost"), "{said}");
    let stated = read(&at.join("recorded/dataset.json"));
    assert_eq!(stated["recorded"].as_array().unwrap().len(), 1, "{stated}");
    assert_eq!(stated["recorded"][0]["firmware"], "three fingers 1.0");
    assert_eq!((&stated["recorded"][0]["source"], &stated["objects"][0]["touches"]), (&value!(port), &value!(11)));
}

#[test]
fn each_touch_is_printed_and_a_second_recording_of_the_object_is_added() {
    let at = &Folder::new();
    for round in 0..2 {
        let (_, _, output) = record_chip(at, chip(vec![event(1), event(4), miss()]), "--stop-after 3");
        let [first, second, all] = [1, 2, 3].map(|number| number + 3 * round);
        let expected = format!(
            "recording bowl into recorded: three fingers 1.0; 3 touches\n\
             {first:5}     0.000     1.000    40.000 ms\n\
             {second:5}     0.000     4.000         - ms\n\
             {all:5}         -         -         - ms\n\
             recorded 3 touches of bowl into recorded, which holds {all} of it now\n\
             contacts: 1 have three, 1 two, 0 one, 1 none\n"
        );
        assert_eq!(stdout(output), expected);
    }
    assert_eq!(Dataset::read_any(&at.join("recorded")).unwrap().len(), 6);
}

#[test]
fn with_the_pose_wanted_touches_without_one_are_said_and_not_recorded() {
    let at = &Folder::new();
    let pose = palpate_shared::Pose { direction: [0, 0, -32767], alignment: [32767, 0, 0] };
    let posed = Event::Refused { touch: TouchMessage::from(&touch(3).with_pose(pose)), refusal: Refusal::NoModel };
    let (_, said, output) = record_chip(at, chip(vec![event(1), posed]), "--stop-after 1 --pose");
    let text = stdout(output);
    assert!(said.contains("warning: a touch without a pose was not recorded"), "{said}");
    assert!(text.ends_with("not recorded: 1 touches without a pose, 0 reports lost on the way\n"), "{text}");
    let dataset = Dataset::read_any(&at.join("recorded")).unwrap();
    assert_eq!(dataset.objects[0].touches(), [touch(3).with_pose(pose)]);
    assert!(dataset.origin.unwrap().pose);
}
