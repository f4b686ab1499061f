//! Robots' logs: reading, and rejected logs with their errors.

#[path = "../mcap/files.rs"]
mod files;

use files::{channel, chunk, file, message, python, record, schema, touches};
use palpate::chip::{Step, Steps};
use palpate::error::{Error, Place};
use palpate::shared::Touch;
use palpate::touches::check::Check;
use palpate::touches::mcap::TOUCH;
use palpate::touches::{Dataset, Log, is_log, parse_touch, read_touches, touch_of_seconds};
use std::path::Path;

fn read(bytes: &[u8]) -> Result<Log, Error> {
    Log::of(bytes, Path::new("robot.mcap"))
}

/// The text of the error that these bytes end in.
#[track_caller]
fn error(bytes: &[u8]) -> String {
    read(bytes).map(|log| log.touches().len()).unwrap_err().to_string()
}

/// The touches that make.py wrote, with and without their poses.
fn expected(pose: bool) -> Vec<(Touch, &'static str)> {
    let touch = |i: usize| {
        let (name, late) = if i.is_multiple_of(2) { ("bowl", 0.010) } else { ("mug", 0.060) };
        let middle = (i % 10 != 7).then_some(0.0015 * i as f64);
        let (sin, cos) = (i as f64 / 7.0).sin_cos();
        let vectors = pose.then_some(([cos, sin, 0.0], [-sin, cos, 0.0]));
        let times = [Some(0.0), middle, Some(late + i as f64 * 1e-4)];
        let (direction, alignment) = vectors.unzip();
        (touch_of_seconds(times, direction, alignment).unwrap(), name)
    };
    (0..40).map(touch).collect()
}

#[test]
fn logs_of_the_usual_library_are_read_however_they_are_compressed() {
    for name in ["json.mcap", "json-lz4.mcap", "json-zstd.mcap", "ros2.mcap"] {
        let log = Log::read(&python(name)).unwrap();
        let found: Vec<_> = log.touches().iter().map(|logged| (logged.touch, log.object(logged).unwrap())).collect();
        assert_eq!(found, expected(true), "{name}");
        assert!(log.touches().is_sorted_by(|a, b| a.time + 1_000_000_000 == b.time), "{name}");
        let channels = log.channels();
        let (topic, schema) = match name {
            "ros2.mcap" => ("/touch", "palpate_msgs/msg/Touch"),
            _ => ("/probe/touch", "palpate.Touch"),
        };
        assert_eq!(channels.touches, [format!("{topic} ({schema})")]);
        let said = log.skipped().unwrap().to_string();
        let skipped = match name {
            "ros2.mcap" => "2 other channels: /joints (std_msgs/msg/String), /verdict (palpate_msgs/msg/Verdict)",
            _ => "1 other channel: /joints (robot.Joints)",
        };
        assert!(said.ends_with(&format!("{name}: skipped {skipped}")), "{said}");
    }
}

#[test]
fn touches_come_in_the_order_of_their_log_times_from_any_clock() {
    let path = python("plain.mcap");
    let log = Log::read(&path).unwrap();
    let found: Vec<_> = log.touches().iter().map(|logged| logged.touch).collect();
    assert_eq!(found, expected(false).into_iter().map(|(touch, _)| touch).collect::<Vec<_>>());
    // No message names an object: that is for the log's name to say.
    let objects = log.by_object("plain").unwrap();
    assert_eq!((objects.len(), objects[0].name.as_str(), objects[0].touches().len()), (1, "plain", 40));
    assert_eq!(read_touches(&path).unwrap(), found);
}

/// A CDR message from hexadecimal digits.
fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.bytes().filter(u8::is_ascii_hexdigit).collect();
    digits.chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

const LITTLE: &str = "00010000 0000000000000000 000000000000d03f 000000000000f87f 01 00000000000000
    000000000000f03f 0000000000000000 0000000000000000 0000000000000000 000000000000f03f 0000000000000000
    05000000 626f776c00 01 000000000000
    000000000000f03f 000000000000e0bf 41b8020af5f4213f";
const BIG: &str = "00000000 0000000000000000 3fd0000000000000 7ff8000000000000 01 00000000000000
    3ff0000000000000 0000000000000000 0000000000000000 0000000000000000 3ff0000000000000 0000000000000000
    00000005 626f776c00 01 000000000000
    3ff0000000000000 bfe0000000000000 3f21f4f50a02b841";

/// A log with one touch in CDR.
fn cdr(message_bytes: &[u8]) -> Vec<u8> {
    file(&[
        schema(1, "palpate_msgs/msg/Touch", "ros2msg", TOUCH),
        channel(1, 1, "/touch", "cdr"),
        message(1, 5, message_bytes),
    ])
}

#[test]
fn cdr_is_read_in_both_orders_of_bytes() {
    let expected = parse_touch("0 0.25 - 1 0 0 0 1 0 1000 -500 0.137").unwrap();
    for hex in [LITTLE, BIG] {
        let whole = bytes(hex);
        // What fills the last word belongs to it.
        for fill in 0..4 {
            let log = read(&cdr(&[&whole[..], &vec![0; fill]].concat())).unwrap();
            let [logged] = log.touches() else { panic!("{}", log.touches().len()) };
            assert_eq!((logged.touch, logged.time, log.object(logged)), (expected, 5, Some("bowl")));
        }
        for cut in 0..whole.len() {
            assert!(error(&cdr(&whole[..cut])).contains("message 1 on /touch: no touch in CDR: "), "{cut}");
        }
        assert!(error(&cdr(&[&whole[..], &[0; 4]].concat())).contains("4 bytes more than the definition has"));
    }
    let wrong = |at: usize, value: u8| {
        let mut message = bytes(LITTLE);
        message[at] = value;
        error(&cdr(&message))
    };
    assert!(wrong(1, 7).contains("the header 00 07, where plain CDR has 00 00 or 00 01"));
    assert!(wrong(28, 2).contains("as Boolean, got: 2"), "{}", wrong(28, 2));
    assert!(wrong(84, 0xff).contains("unexpected end of input"), "{}", wrong(84, 0xff));
    assert!(wrong(88, 0xff).contains("UTF-8 error"), "{}", wrong(88, 0xff));
    let mut infinite = bytes(LITTLE);
    infinite[12..20].copy_from_slice(&f64::INFINITY.to_le_bytes());
    assert!(error(&cdr(&infinite)).contains("message 1 on /touch: the time inf is not finite"));
    // No pose: what stands in its place is not looked at.
    let mut without = bytes(LITTLE);
    without[28..84].fill(0);
    assert!(error(&cdr(&without)).contains("message 1 on /touch: a position without a pose. Correct the program"));
    without[93..].fill(0);
    assert_eq!(read(&cdr(&without)).unwrap().touches()[0].touch, parse_touch("0 0.25 -").unwrap());
    let mut far = bytes(LITTLE);
    far[100..108].copy_from_slice(&3e3_f64.to_le_bytes());
    assert!(error(&cdr(&far)).contains("the coordinate 3000000 mm is farther than the 2147 m"));
    far[100..108].copy_from_slice(&f64::NAN.to_le_bytes());
    assert!(error(&cdr(&far)).contains("the coordinate NaN is not finite"), "{}", error(&cdr(&far)));
}

#[test]
fn a_definition_counts_without_its_comments_and_another_one_is_refused() {
    let log = |definition: &str| {
        let schema = schema(1, "palpate_msgs/msg/Touch", "ros2msg", definition);
        file(&[schema, channel(1, 1, "/touch", "cdr"), message(1, 5, &bytes(LITTLE))])
    };
    let bare = "float64[3]   times\nbool has_pose\r\nfloat64[3] direction\nfloat64[3] alignment\nstring object\n\
                bool has_position\nfloat64[3] position\n====\nMSG: another\nint8 x\n";
    assert_eq!(read(&log(bare)).unwrap().touches().len(), 1);
    let said = error(&log(&TOUCH.replace("float64[3] times", "float32[3] times")));
    assert!(said.contains("/touch (palpate_msgs/msg/Touch) is defined as \"float32[3] times; bool"), "{said}");
    assert!(said.contains("where Palpate has \"float64[3] times; bool has_pose;"), "{said}");
}

#[test]
fn a_log_by_the_definition_of_earlier_versions_is_read() {
    let before = "float64[3] times\nbool has_pose\nfloat64[3] direction\nfloat64[3] alignment\nstring object\n";
    let log = |definition: &str, length: usize| {
        let schema = schema(1, "palpate_msgs/msg/Touch", "ros2msg", definition);
        file(&[schema, channel(1, 1, "/touch", "cdr"), message(1, 5, &bytes(LITTLE)[..length])])
    };
    assert_eq!(read(&log(before, 93)).unwrap().touches()[0].touch, parse_touch("0 0.25 - 1 0 0 0 1 0").unwrap());
    // Each definition has its own length.
    assert!(error(&log(before, bytes(LITTLE).len())).contains("31 bytes more than the definition has"));
    assert!(error(&log(TOUCH, 93)).contains("no touch in CDR: "));
    assert!(error(&log(&before.replace("string object\n", ""), 93)).contains("is defined as"));
}

#[test]
fn a_log_in_which_some_touches_have_a_position_is_refused_at_the_message() {
    let pose = r#""times": [0, 0.25, null], "pose": {"direction": [0, 0, -1], "alignment": [1, 0, 0]}"#;
    let with = format!(r#"{{{pose}, "position": [0.001, -0.0000005, 2147.483647]}}"#);
    let without = format!("{{{pose}}}");
    let expected = parse_touch("0 0.25 - 0 0 -1 1 0 0 1 -0.001 2147483.647").unwrap();
    assert_eq!(read(&touches(&[&with])).unwrap().touches()[0].touch, expected);
    let log = touches(&[&with, &without]);
    let place = log.windows(9).rposition(|window| window == record_head(&without)).unwrap();
    let said = error(&log);
    let begin =
        format!("robot.mcap: byte {place}: no position, where the touches before it have one. Give every touch");
    assert!(said.starts_with(&begin), "{said}");
}

#[test]
fn a_message_that_is_no_touch_is_named_with_file_byte_number_topic_and_what_is_wrong() {
    let good = r#"{"times": [0, 0.25, null], "pose": null, "more": [1, {"x": 2}]}"#;
    assert_eq!(read(&touches(&[good])).unwrap().touches()[0].touch, parse_touch("0 0.25 -").unwrap());
    for (text, what) in [
        ("", "no touch in JSON: EOF while parsing"),
        ("{\"times\": [0, 1", "no touch in JSON: EOF"),
        ("{}", "missing field `times`"),
        (r#"{"times": [0, 1]}"#, "invalid length 2"),
        (r#"{"times": [0, 1, 2, 3]}"#, "no touch in JSON: "),
        (r#"{"times": [0, NaN, 1]}"#, "no touch in JSON: expected value"),
        (r#"{"times": [0, 1e999, 1]}"#, "number out of range"),
        (r#"{"times": [0, "1", 1]}"#, "invalid type: string"),
        (r#"{"times": [0, -1, 1]}"#, "the time -1 is negative"),
        (r#"{"times": [0, 5000, 1]}"#, "a finger touched 5000 s after the first, and a touch can hold 4294 s"),
        (r#"{"times": [0, 1, 1], "pose": {"direction": [1, 0, 0]}}"#, "missing field `alignment`"),
        (
            r#"{"times": [0, 1, 1], "pose": {"direction": [1, 0, 0], "alignment": [1, 1, 0]}}"#,
            "the alignment has length 1.414",
        ),
        (r#"{"times": [0, 1, 1], "object": "../../bowl"}"#, "no file can be named after the object"),
    ] {
        let log = touches(&[good, good, text]);
        let found = error(&log);
        let place = log.windows(9).rposition(|window| window == record_head(text)).unwrap();
        let begin = format!("robot.mcap: byte {place}: message 3 on /touch: ");
        assert!(found.starts_with(&begin) && found.contains(what), "{text}: {found}");
        assert!(
            found.ends_with(
                "Correct the program that logged it: docs/reference/mcap.md says what belongs in a message."
            ),
            "{found}"
        );
    }
    let late = file(&[
        schema(1, "palpate.Touch", "jsonschema", ""),
        channel(1, 1, "/touch", "json"),
        message(1, u64::MAX, good.as_bytes()),
    ]);
    assert!(error(&late).contains("no log time: 18446744073709551615 ns, after 2262"));
}

/// First bytes of the record of a message with this text.
fn record_head(text: &str) -> Vec<u8> {
    record(files::MESSAGE, &vec![0; 22 + text.len()])[..9].to_vec()
}

#[test]
fn a_log_without_touches_says_which_channels_there_are() {
    let tf =
        [schema(1, "tf2_msgs/msg/TFMessage", "ros2msg", ""), channel(1, 1, "/tf", "cdr"), channel(2, 0, "/raw", "")];
    let refused = read(&file(&tf)).unwrap_err();
    assert_eq!(refused.place(), &Place::file("robot.mcap"));
    let what = "no channel of touches in this log: it has /tf (tf2_msgs/msg/TFMessage), /raw (no schema)";
    assert_eq!(refused.what(), what);
    assert!(refused.remedy().contains("palpate_msgs/msg/Touch"));
    assert!(error(&file(&[])).contains("it has no channel at all"));
    assert!(error(&touches(&[])).contains("robot.mcap: no touches in it"));
}

#[test]
fn what_cannot_be_read_is_refused_by_name_with_the_way_round() {
    let plain = |schema_encoding: &str, encoding: &str| {
        let schema = schema(1, "palpate_msgs/msg/Touch", schema_encoding, TOUCH);
        file(&[schema, channel(1, 1, "/touch", encoding), message(1, 5, &bytes(LITTLE))])
    };
    for (schema_encoding, encoding) in [("ros2idl", "cdr"), ("protobuf", "protobuf")] {
        let said = error(&plain(schema_encoding, encoding));
        assert!(said.contains(&format!("in the encoding {encoding:?} with a schema in {schema_encoding:?}")), "{said}");
        assert!(said.contains("Log them as docs/reference/mcap.md says"), "{said}");
    }
    let said = error(&file(&[chunk("brotli", 4, 0, b"1234")]));
    assert!(
        said.contains("a chunk is compressed as \"brotli\", where zstd and lz4 are known. Compress it again: "),
        "{said}"
    );
}

#[test]
fn a_file_that_contradicts_itself_is_refused() {
    let touch = || schema(1, "palpate.Touch", "jsonschema", "");
    let says = |records: &[Vec<u8>], what: &str| {
        let said = error(&file(records));
        assert!(said.starts_with("robot.mcap: byte ") && said.contains(what), "{said}");
    };
    says(&[channel(1, 9, "/touch", "json")], "/touch has the schema 9, which is missing");
    says(&[message(3, 1, b"{}")], "a message of channel 3, which is missing");
    says(&[touch(), schema(1, "other", "", "")], "schema 1 is defined twice, and differently");
    says(&[touch(), channel(1, 1, "/a", "json"), channel(1, 1, "/b", "json")], "channel 1 is defined twice");
    says(&[record(files::SCHEMA, &[1, 0, 255, 255, 255, 255])], "not a usable MCAP file: ");
    // A chunk whose last record is longer than it.
    let mut cut = touch();
    cut.pop();
    says(&[chunk("", cut.len() as u64, 0, &cut)], "a record is longer than the chunk");
    says(&[chunk("", 5, 0, b"1234")], "a chunk holds 4 bytes where it states 5");
    // Repeated, as every chunk of some writers does.
    let twice = [touch(), touch(), channel(1, 1, "/a", "json"), channel(1, 1, "/a", "json")];
    let twice = [&twice[..], &[message(1, 1, br#"{"times": [0, 0, 0]}"#)]].concat();
    assert_eq!(read(&file(&twice)).unwrap().touches().len(), 1);
}

#[test]
fn damage_is_found_by_checksums_and_a_file_that_ends_early_is_no_log() {
    for name in ["json.mcap", "json-lz4.mcap", "json-zstd.mcap", "ros2.mcap", "plain.mcap"] {
        let whole = std::fs::read(python(name)).unwrap();
        for end in (0..whole.len()).step_by(13).chain(whole.len() - 9..whole.len()) {
            let said = error(&whole[..end]);
            assert!(said.starts_with("robot.mcap: ") && said.contains("it ends early. Repair it with `mcap"), "{said}");
        }
    }
    let whole = std::fs::read(python("json.mcap")).unwrap();
    let mut damaged = whole.clone();
    let digit = damaged.windows(6).position(|window| window == b"0.0015").unwrap();
    damaged[digit + 5] = b'6';
    let said = error(&damaged);
    assert!(said.contains("a chunk is damaged: its checksum is ") && said.contains(" where it states "), "{said}");
    // Without chunks, the checksum of all data tells.
    let mut damaged = std::fs::read(python("plain.mcap")).unwrap();
    let digit = damaged.windows(11).position(|window| window == b"1767225603.").unwrap();
    damaged[digit + 9] = b'4';
    assert!(error(&damaged).contains("not a usable MCAP file: "), "{}", error(&damaged));
    // One log behind another.
    let said = error(&[&whole[..], &whole].concat());
    assert!(said.contains("not a usable MCAP file: "), "{said}");
    for (begin, what) in [
        (&b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..], "it does not begin or end as one"),
        (b"\x89MCAP", "early"),
        (b"0 0 0\n", "does not begin"),
    ] {
        assert!(error(begin).starts_with("robot.mcap: ") && error(begin).contains(what), "{}", error(begin));
    }
}

#[test]
fn touches_are_of_the_objects_that_their_messages_name_all_or_none() {
    let [bowl, mug] = ["bowl", "mug"].map(|name| format!(r#"{{"times": [0, 0, 0], "object": "{name}"}}"#));
    let log = read(&touches(&[&mug, &bowl, &mug])).unwrap();
    let objects: Vec<_> =
        log.by_object("-").unwrap().into_iter().map(|object| (object.name.clone(), object.len())).collect();
    assert_eq!(objects, [("bowl".to_owned(), 1), ("mug".to_owned(), 2)]);
    let (touches_of, others) = log.of_object("mug").unwrap();
    assert_eq!((touches_of.len(), others), (2, 1));
    let said = log.of_object("fork").unwrap_err().to_string();
    assert!(said.contains("robot.mcap: no touch of fork in this log, only of mug, bowl"), "{said}");
    let mixed = read(&touches(&[&mug, r#"{"times": [0, 0, 0], "object": ""}"#])).unwrap();
    for said in [mixed.by_object("-").unwrap_err(), mixed.of_object("mug").unwrap_err()] {
        let said = said.to_string();
        assert!(
            said.contains(": byte ") && said.contains("this touch names no object, and others of the log do"),
            "{said}"
        );
    }
}

#[test]
fn a_directory_holds_logs_beside_text_and_the_content_says_which_is_which() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let plain = touches(&[r#"{"times": [0, 0.5, 0]}"#]);
    std::fs::write(path("fork.mcap"), &plain).unwrap();
    // A log by its content.
    std::fs::write(path("spoon.txt"), &plain).unwrap();
    std::fs::write(path("cup.txt"), "0 0 0\n0 0 -\n").unwrap();
    // Two more of bowl and mug, which are joined.
    std::fs::copy(python("json.mcap"), path("monday.mcap")).unwrap();
    std::fs::copy(python("ros2.mcap"), path("tuesday.mcap")).unwrap();
    let dataset = Dataset::read(directory.path()).unwrap();
    let found: Vec<_> = dataset.objects.iter().map(|object| (object.name.as_str(), object.touches().len())).collect();
    assert_eq!(found, [("bowl", 40), ("cup", 2), ("fork", 1), ("mug", 40), ("spoon", 1)]);
    assert_eq!(dataset.warnings.len(), 2);
    let check = Check::of(directory.path()).unwrap();
    assert_eq!(check.summary.objects.len(), 5);
    assert!(check.findings.iter().any(|finding| finding.what.contains("mug: it holds every touch at least twice")));
    // A log is a data set by itself.
    assert!(is_log(&python("ros2.mcap")) && is_log(&path("spoon.txt")) && !is_log(&path("cup.txt")));
    assert!(!is_log(directory.path()) && !is_log(&path("nowhere")));
    let alone = Dataset::read(&python("ros2.mcap")).unwrap();
    assert_eq!((alone.names(), alone.len()), (vec!["bowl".to_owned(), "mug".to_owned()], 40));
    assert_eq!(Check::of(&python("ros2.mcap")).unwrap().summary.objects.len(), 2);
    // The same object in a log and in a file of lines.
    std::fs::write(path("mug.txt"), "0 0 0\n").unwrap();
    let said = Dataset::read(directory.path()).unwrap_err().to_string();
    assert!(said.contains("two files of the object mug: ") && said.contains("mug.txt and "), "{said}");
    assert!(said.contains("monday.mcap"), "{said}");
    assert!(Check::of(directory.path()).unwrap().findings.iter().any(|finding| finding.what.contains("two files of")));
    // A file that is called a log and is not one.
    std::fs::write(path("mug.txt"), "").unwrap();
    std::fs::write(path("monday.mcap"), "0 0 0\n").unwrap();
    std::fs::remove_file(path("mug.txt")).unwrap();
    let said = Dataset::read(directory.path()).unwrap_err().to_string();
    assert!(said.contains("monday.mcap: not a usable MCAP file: it does not begin or end as one"), "{said}");
    let finding = Check::of(&path("fork.mcap")).unwrap();
    assert!(finding.wrong() == 0 && finding.findings.iter().any(|finding| finding.what.contains("has been recorded")));
}

#[test]
fn a_log_is_streamed_to_a_chip_with_the_names_of_its_objects() {
    let [fork, bowl] = ["fork", "bowl"].map(|name| format!(r#"{{"times": [0, 0, 0], "object": "{name}"}}"#));
    let mut steps = Steps::logged(&read(&touches(&[&fork, &fork, &bowl])).unwrap());
    assert_eq!(steps.count(), Some(3));
    let touch = Step::Touch(parse_touch("0 0 0").unwrap());
    let object = |name: &str| Step::Object(Some(name.into()));
    for expected in [object("fork"), touch.clone(), touch.clone(), object("bowl"), touch] {
        assert_eq!(steps.next_step().unwrap(), Some(expected));
    }
    assert_eq!((steps.next_step().unwrap(), steps.count()), (None, Some(0)));
}
