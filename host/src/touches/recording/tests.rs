use super::*;

use crate::touches::{Dataset, ObjectTouches, Pool, Source};
use std::fs;

/// The second of October 2026, around noon.
fn noon() -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_secs(1_790_942_400)
}

fn touch(number: u32) -> Touch {
    Touch::from_micros([0, 1_000 * number, 30_000])
}

fn touches(numbers: std::ops::Range<u32>) -> Vec<Touch> {
    numbers.map(touch).collect()
}

fn open(directory: &Path, object: &str) -> Result<Recording> {
    Recording::open(directory, object, None, "/dev/ttyACM0", noon())
}

/// Records touches one by one, and ends as a killed program does: without a last listing, and without one on the way, however
/// slow the machine is.
fn killed(directory: &Path, object: &str, numbers: std::ops::Range<u32>) {
    let mut recording = open(directory, object).unwrap();
    recording.checkpointed = Instant::now() + Duration::from_secs(3600);
    touches(numbers).iter().for_each(|touch| recording.add(touch).unwrap());
}

fn whole(directory: &Path, object: &str, numbers: std::ops::Range<u32>) {
    let mut recording = open(directory, object).unwrap();
    touches(numbers).iter().for_each(|touch| recording.add(touch).unwrap());
    recording.checkpoint().unwrap();
}

/// Fails unless the error says this.
#[track_caller]
fn says<T>(refused: Result<T>, what: &str) {
    let said = refused.err().unwrap().to_string();
    assert!(said.contains(what), "{said}");
}

fn read(directory: &Path) -> Dataset {
    let dataset = Dataset::read_any(directory).unwrap();
    assert_eq!(dataset.warnings, []);
    dataset
}

/// The recordings of an object, with their numbers of touches.
fn recorded(dataset: &Dataset, object: usize) -> Vec<(Recorded, usize)> {
    let of = |pool: &Pool| match &pool.source {
        Source::Recording(recorded) => (recorded.clone(), pool.range.len()),
        other => panic!("{other:?}"),
    };
    dataset.objects[object].pools().iter().map(of).collect()
}

/// The touches of an object.
fn all(dataset: &Dataset, object: usize) -> Vec<Touch> {
    dataset.objects[object].touches().to_vec()
}

#[test]
fn a_recording_is_a_data_set_whose_listing_says_when_from_where_and_by_what() {
    let directory = tempfile::tempdir().unwrap();
    let mut recording = open(directory.path(), "spoon").unwrap();
    assert_eq!(recording.made_by(Some("gpio 1.0".into()), Some(7)).unwrap(), None);
    touches(0..3).iter().for_each(|touch| recording.add(touch).unwrap());
    recording.checkpoint().unwrap();
    drop(recording);
    whole(directory.path(), "fork", 5..6);
    let dataset = read(directory.path());
    assert_eq!(dataset.names(), ["fork", "spoon"]);
    assert_eq!(all(&dataset, 1), touches(0..3));
    assert!(dataset.is_recorded() && dataset.holds_approaches());
    let expected = Recorded {
        placement: None,
        began: "2026-10-02T12:00:00Z".into(),
        source: "/dev/ttyACM0".into(),
        firmware: Some("gpio 1.0".into()),
        model: Some(7),
        number: 0,
    };
    assert_eq!(recorded(&dataset, 1), [(expected, 3)]);
    assert_eq!(recorded(&dataset, 0)[0].0.firmware, None);
    let listing = Listing::read(directory.path()).unwrap().unwrap();
    let text = fs::read(directory.path().join("spoon.txt")).unwrap();
    let entry = &listing.objects[1];
    assert_eq!((entry.pools[0].touches, entry.approaches), (3, 3));
    assert_eq!(entry.pools[0].crc32, Some(CRC.checksum(&text)));
}

#[test]
fn nothing_is_written_before_the_first_touch() {
    let directory = tempfile::tempdir().unwrap();
    open(directory.path(), "spoon").unwrap().checkpoint().unwrap();
    let names: Vec<_> = fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, [".lock"]);
}

#[test]
fn every_touch_counts_although_the_recorder_was_killed_after_it() {
    let directory = tempfile::tempdir().unwrap();
    killed(directory.path(), "fork", 0..5);
    let listing = Listing::read(directory.path()).unwrap().unwrap();
    assert!(listing.objects[0].touches() < 5, "this test needs a listing that lags behind");
    assert_eq!(all(&read(directory.path()), 0), touches(0..5));
    // The next recording lists them as they are.
    whole(directory.path(), "fork", 5..7);
    let dataset = read(directory.path());
    assert_eq!(all(&dataset, 0), touches(0..7));
    assert_eq!(recorded(&dataset, 0).iter().map(|(_, touches)| *touches).collect::<Vec<_>>(), [5, 2]);
    let listing = Listing::read(directory.path()).unwrap().unwrap();
    assert_eq!((listing.objects[0].touches(), listing.objects[0].approaches), (7, 7));
}

#[test]
fn a_recording_cut_off_at_any_byte_keeps_its_whole_lines_and_the_next_one_goes_on() {
    let lines = lines(&touches(0..2), true);
    let line = lines.len() / 2;
    for cut in line..lines.len() {
        let directory = tempfile::tempdir().unwrap();
        killed(directory.path(), "fork", 0..2);
        let path = directory.path().join("fork.txt");
        fs::write(&path, &lines[..cut]).unwrap();
        let dataset = Dataset::read_any(directory.path()).unwrap();
        assert_eq!(all(&dataset, 0), touches(0..1), "{cut}");
        let said: Vec<String> = dataset.warnings.iter().map(ToString::to_string).collect();
        let half = "its last line is not whole and was not read: a recording was interrupted";
        assert_eq!(said, if cut == line { vec![] } else { vec![format!("{}: {half}", path.display())] }, "{cut}");
        let mut recording = open(directory.path(), "fork").unwrap();
        assert_eq!(recording.warnings(), dataset.warnings);
        recording.add(&touch(8)).unwrap();
        recording.checkpoint().unwrap();
        let dataset = Dataset::read_any(directory.path()).unwrap();
        assert_eq!((all(&dataset, 0), dataset.warnings.len()), (vec![touch(0), touch(8)], usize::from(cut > line)));
    }
}

#[test]
fn an_interruption_before_the_first_touch_leaves_the_other_objects_readable() {
    let directory = tempfile::tempdir().unwrap();
    whole(directory.path(), "fork", 0..3);
    let mut recording = open(directory.path(), "spoon").unwrap();
    Open::new(directory.path(), &mut recording.listing, "spoon", &recording.recorded).unwrap();
    drop(recording);
    assert_eq!(read(directory.path()).names(), ["fork"]);
    fs::write(directory.path().join("spoon.txt"), "0.0").unwrap();
    assert_eq!(Dataset::read_any(directory.path()).unwrap().names(), ["fork"]);
    whole(directory.path(), "spoon", 0..2);
    let dataset = Dataset::read_any(directory.path()).unwrap();
    assert_eq!((all(&dataset, 1), dataset.warnings.len()), (touches(0..2), 1));
}

#[test]
fn a_file_that_lost_recorded_touches_is_neither_read_nor_added_to() {
    let directory = tempfile::tempdir().unwrap();
    whole(directory.path(), "fork", 0..5);
    let path = directory.path().join("fork.txt");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, &text[..text.len() - 1]).unwrap();
    let lost = "4 touches where dataset.json states 5";
    says(Dataset::read_any(directory.path()), lost);
    says(open(directory.path(), "fork"), lost);
    fs::remove_file(&path).unwrap();
    says(open(directory.path(), "fork"), "missing, although dataset.json lists the object fork");
    // As many, but others: somebody edited them.
    fs::write(&path, text.replacen("0.001000", "0.009000", 1)).unwrap();
    let warnings = Dataset::read_any(directory.path()).unwrap().warnings;
    assert!(warnings.len() == 1 && warnings[0].what.contains("fork.txt: changed since its capture"), "{warnings:?}");
}

#[test]
fn another_program_on_the_chip_is_a_recording_of_its_own_and_is_said() {
    let directory = tempfile::tempdir().unwrap();
    let mut recording = open(directory.path(), "fork").unwrap();
    recording.made_by(Some("gpio 1.0".into()), None).unwrap();
    recording.add(&touch(0)).unwrap();
    // The same after the cable was out.
    assert_eq!(recording.made_by(Some("gpio 1.0".into()), None).unwrap(), None);
    recording.add(&touch(1)).unwrap();
    assert_eq!(recording.made_by(Some("gpio 2.0".into()), None).unwrap().as_deref(), Some("gpio 1.0"));
    recording.add(&touch(2)).unwrap();
    recording.checkpoint().unwrap();
    assert_eq!((recording.touches(), recording.all_touches()), (3, 3));
    drop(recording);
    let dataset = read(directory.path());
    assert_eq!(all(&dataset, 0), touches(0..3));
    let recorded = recorded(&dataset, 0);
    let said: Vec<_> =
        recorded.iter().map(|(recorded, touches)| (recorded.firmware.as_deref().unwrap(), *touches)).collect();
    assert_eq!(said, [("gpio 1.0", 2), ("gpio 2.0", 1)]);
}

#[test]
fn touches_of_another_probe_or_scale_or_without_their_pose_are_not_added() {
    let directory = tempfile::tempdir().unwrap();
    whole(directory.path(), "fork", 0..2);
    let usual = Origin::recorded(Origin::default().probe, Length::Tenth, false);
    let mut wider = usual.clone();
    wider.probe.spacing = 2.0;
    let others = [
        (wider, "spacing is 1.5 there and 2 here"),
        (Origin { unit: Length::Millimeter, ..usual.clone() }, "unit is unit there and mm here"),
        (Origin { pose: true, ..usual.clone() }, "without the pose there and with it here"),
    ];
    for (origin, differences) in others {
        let refused = Recording::open(directory.path(), "fork", Some(&origin), "", noon());
        says(refused, &format!("cannot add to these recorded touches: {differences}"));
    }
    Recording::open(directory.path(), "fork", Some(&usual), "", noon()).unwrap();
    let posed = tempfile::tempdir().unwrap();
    let origin = Origin { pose: true, ..usual };
    let mut recording = Recording::open(posed.path(), "fork", Some(&origin), "", noon()).unwrap();
    assert!(recording.lacks_pose(&touch(0)));
    says(recording.add(&touch(0)), "no pose, but this data set is recorded with one");
    let pose = palpate_shared::Pose { direction: [0, 0, -32767], alignment: [32767, 0, 0] };
    recording.add(&touch(0).with_pose(pose)).unwrap();
    assert_eq!(all(&read(posed.path()), 0), [touch(0).with_pose(pose)]);
    let position = palpate_shared::Position { micrometers: [1, -2, 3] };
    let located = touch(0).with_pose(pose).with_position(position);
    says(recording.add(&located), "a position, where the touches recorded here have none");
    let directory = tempfile::tempdir().unwrap();
    let origin = Origin { position: true, ..origin };
    let mut recording = Recording::open(directory.path(), "fork", Some(&origin), "", noon()).unwrap();
    says(recording.add(&touch(0).with_pose(pose)), "no position, where the touches recorded here have one");
    recording.add(&located).unwrap();
    assert_eq!(all(&read(directory.path()), 0), [located]);
}

#[test]
fn a_directory_with_simulated_or_unlisted_touches_or_another_recorder_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let _first = open(directory.path(), "fork").unwrap();
    says(open(directory.path(), "spoon"), "another program is writing into this directory");
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("cup.txt"), "0 0 0\n").unwrap();
    says(open(directory.path(), "fork"), "holds cup.txt, which dataset.json does not list");
    Listing::new(&Origin::default(), ["cup".into()]).write(directory.path()).unwrap();
    says(open(directory.path(), "fork"), "holds 0 simulated touches of cup");
    for name in ["", "../fork", "a/b/c", "a/..", "/b"] {
        says(open(directory.path(), name), "no file can be named after the object");
    }
}

#[test]
fn a_file_where_the_next_recording_would_be_is_refused_and_never_listed() {
    let directory = tempfile::tempdir().unwrap();
    whole(directory.path(), "fork", 0..2);
    let listed = fs::read(Listing::path(directory.path())).unwrap();
    fs::create_dir(directory.path().join("fork")).unwrap();
    for (object, file) in [("spoon", "spoon.txt"), ("fork", "fork/2.txt")] {
        let path = directory.path().join(file);
        fs::write(&path, "0 0 0\n").unwrap();
        says(open(directory.path(), object), &format!("holds {file}, which dataset.json does not list"));
        fs::remove_file(&path).unwrap();
        // One that appears after the recording was opened.
        let mut recording = open(directory.path(), object).unwrap();
        fs::write(&path, "0 0 0\n").unwrap();
        says(recording.add(&touch(7)), &format!("holds {file}, which dataset.json does not list"));
    }
    assert_eq!(fs::read(Listing::path(directory.path())).unwrap(), listed);
    assert_eq!(all(&read(directory.path()), 0), touches(0..2));
}

#[test]
fn the_touches_of_a_file_are_added_once() {
    let directory = tempfile::tempdir().unwrap();
    let add = |object: &str, numbers| open(directory.path(), object).unwrap().add_all(&touches(numbers));
    add("fork", 0..5).unwrap();
    says(add("fork", 0..5), "the same 5 touches of fork were recorded before");
    add("fork", 0..4).unwrap();
    add("spoon", 0..5).unwrap();
    let dataset = read(directory.path());
    assert_eq!(dataset.objects.iter().map(ObjectTouches::len).collect::<Vec<_>>(), [9, 5]);
}
