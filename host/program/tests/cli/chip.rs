//! The commands that talk to a chip: link and watch, with a chip's whole program behind a TCP connection.

use crate::fixtures::{LOCATED, ONE_SPLIT};
use crate::locate::{of_one_placement, recognized};
use crate::{command, complains, fails, figures, json, lines, listen, piped, run, says, stderr, stdout, succeeds};
use palpate_onboard::station::{Memory, NoStorage, Table, record_length, serve, serve_with};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;

const OBJECTS: usize = 2;

/// A stream of the standard library as the chip's transport.
struct Wire(TcpStream);

impl embedded_io::ErrorType for Wire {
    type Error = embedded_io::ErrorKind;
}

impl embedded_io::Read for Wire {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
        self.0.read(buffer).map_err(|_| embedded_io::ErrorKind::Other)
    }
}

impl embedded_io::Write for Wire {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Self::Error> {
        self.0.write(buffer).map_err(|_| embedded_io::ErrorKind::Other)
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        self.0.flush().map_err(|_| embedded_io::ErrorKind::Other)
    }
}

/// A port at which `chip` gets the first connection.
fn port(chip: impl FnOnce(TcpStream) + Send + 'static) -> String {
    listen(|listener| chip(listener.accept().unwrap().0)).0
}

/// A chip with this room for a model and these maps, until its first connection ends.
fn chip_of(room: usize, serve: impl FnOnce(&mut Memory<'_>, &mut Wire) + Send + 'static) -> String {
    port(move |stream| {
        stream.set_nodelay(true).unwrap();
        let [mut a, mut b] = [(); 2].map(|()| vec![0; room]);
        let [mut c, mut d] = [(); 2].map(|()| vec![0; record_length(OBJECTS)]);
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
    let mut touches = of_one_placement(at, 12);
    touches.insert(2, "\n".into());
    let said = recognized(at, "maps.palpate --next", &touches.concat());
    assert!(said.iter().any(|line| line["verdict"] == "recognized"), "{said:?}");
    let link = |chip: String, words: &str| succeeds(at, &format!("link {chip} {words}"));
    let text = link(chip_with_table(), "lines.txt --load maps.palpate --next");
    assert_eq!(lines(&text), said);
    let words = "--parity data --stop-after 12 --per-object 6 --next --workspace 15 --bad-line 0.001,0.001,0.02,0";
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
        (chip(), "free.txt --load trees.palpate --next", 2, "--next is given. Use it with a model of maps"),
        (
            chip_with_table(),
            "located.txt --load maps.palpate --active",
            2,
            "--active is given. Use it with a model of trees",
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
fn link_recognizes_as_the_host_does_and_watch_shows_its_journal() {
    let place = ONE_SPLIT.folder();
    let (model, data, journal) = (place.text("model.palpate"), place.text("data"), place.text("journal.jsonl"));
    let arguments = ["--load", &model, "--parity", &data, "--stop-after", "40", "--per-object", "5"];
    let mut command = command(["link", &chip()]);
    let summary = json(command.args(arguments).args(["--journal", &journal, "--json"]).output().unwrap());
    assert_eq!(
        (&summary["touches"], &summary["compared"], &summary["differences"]),
        (&40.into(), &40.into(), &0.into())
    );
    assert_eq!((&summary["right"], &summary["wrong"], &summary["undecided"]), (&8.into(), &0.into(), &0.into()));

    let entries = lines(&std::fs::read_to_string(&journal).unwrap());
    let kinds = |kind: &str| entries.iter().filter(|entry| entry["is"] == kind).count();
    assert_eq!((kinds("model"), kinds("object"), kinds("touch"), kinds("link")), (1, 8, 40, 1));

    // A journal is replaced by the next one.
    let mut again = crate::command(["link", &chip()]);
    json(again.args(arguments).args(["--journal", &journal, "--json"]).output().unwrap());
    let watched = stdout(run(["link", &journal, "--watch"]));
    let lines: Vec<&str> = watched.lines().collect();
    assert_eq!(lines.len(), entries.len(), "{watched}");
    assert!(lines[0].starts_with("model of ") && lines[0].ends_with(": bowl, fork"), "{watched}");
    assert_eq!(lines[1], "another object: bowl");
    assert!(lines[2].starts_with("    1 ") && lines[2].contains(" ms  perhaps bowl 8"), "{watched}");
    assert!(lines[5].ends_with(" ms  bowl"), "{watched}");
    // A chip that has just started makes the host send again what is under way.
    let resent = &entries[49]["resent"];
    assert_eq!(lines[49], format!("link: {resent} frames sent again, 0 garbled, 0 events missed"));
    assert_eq!(&summary["resent"], resent);
}

#[test]
fn link_counts_every_touch_once_over_a_bad_line() {
    let place = ONE_SPLIT.folder();
    let (model, data) = (place.text("model.palpate"), place.text("data"));
    let arguments = ["--load", &model, "--parity", &data, "--stop-after", "500", "--bad-line", "0.001,0.001,0.02,0"];
    let summary = json(command(["link", &chip(), "--json"]).args(arguments).output().unwrap());
    assert_eq!((&summary["touches"], &summary["differences"]), (&500.into(), &0.into()));
    assert!(summary["resent"].as_u64().unwrap() > 0, "{summary}");
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
fn bad_arguments_of_link_and_watch_exit_with_2() {
    let place = ONE_SPLIT.folder();
    let error = stderr(run(["link", "emulator", "--parity", &place.text("data")]), 2);
    assert!(error.contains("--load") && error.contains("--against"), "{error}");
    for arguments in [&["link", "http://host:1"][..], &["link", "http://host:1", "--watch"]] {
        let error = stderr(run(arguments), 2);
        assert!(error.contains("`http://host:1` is not a port. Give a serial port"), "{error}");
    }
    let error = stderr(run(["link", "emulator", "--bad-line", "often"]), 2);
    assert!(error.contains("Give three probabilities and milliseconds"), "{error}");
}

#[test]
fn watch_shows_a_chip_that_gets_a_data_set() {
    let place = ONE_SPLIT.folder();
    let arguments = ["link", &chip(), &place.text("data"), "--watch", "--load", &place.text("model.palpate")];
    let text = stdout(run(arguments));
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("model of ") && lines[1] == "another object: bowl", "{text}");
    assert_eq!(lines.iter().filter(|line| line.contains(" ms  ")).count(), 4, "{text}");
    assert!(lines.last().unwrap().starts_with("link: "), "{text}");
}

#[test]
fn watch_names_the_line_of_a_journal_that_is_wrong() {
    let place = ONE_SPLIT.folder();
    let journal = place.text("journal.jsonl");
    std::fs::write(&journal, "{\"is\":\"object\",\"name\":\"cup\"}\nnonsense\n").unwrap();
    let output = run(["link", &journal, "--watch"]);
    assert_eq!(String::from_utf8_lossy(&output.stdout), "another object: cup\n");
    let error = stderr(output, 1);
    assert!(error.contains("journal.jsonl:2: not an entry of a journal"), "{error}");
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
fn a_chip_that_is_reset_and_has_another_model_then_is_not_watched_with_the_names_of_the_one_before() {
    let household = include_bytes!("../../../../models/household.palpate").to_vec();
    let own = std::fs::read(ONE_SPLIT.folder().join("model.palpate")).unwrap();
    for after in [own, Vec::new()] {
        let output = run(["link", &chip_that_is_reset(household.clone(), after), "--watch"]);
        assert!(String::from_utf8_lossy(&output.stdout).starts_with("model of 44336 bytes"));
        let error = stderr(output, 1);
        assert!(
            error.contains("the chip was reset and has another model than before. Load the model again"),
            "{error}"
        );
    }
}
