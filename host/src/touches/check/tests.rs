use super::*;
use crate::touches::checksum::CRC;
use crate::touches::{Dataset, text, write_touch};

/// Thirty touches that differ, of an object with this number.
fn touches(object: u32) -> Vec<Touch> {
    (0..30).map(|i| Touch::from_micros([0, 1_000 * i + object, 77 * i])).collect()
}

fn lines(touches: &[Touch]) -> String {
    let mut text = String::new();
    touches.iter().for_each(|touch| write_touch(&mut text, touch, true));
    text
}

/// A directory with a fork and a spoon, and its listing.
fn captured() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let mut listing = Listing::new(&Origin { touches: 30, ..Origin::default() }, ["fork".into(), "spoon".into()]);
    for (index, entry) in listing.objects.iter_mut().enumerate() {
        let path = directory.path().join(format!("{}.txt", entry.name));
        let text = lines(&touches(index as u32));
        std::fs::write(&path, &text).unwrap();
        entry.approaches = 90;
        (entry.pools[0].touches, entry.pools[0].crc32) = (30, Some(CRC.checksum(text.as_bytes())));
    }
    listing.write(directory.path()).unwrap();
    directory
}

fn change(directory: &Path, listing: impl FnOnce(&mut Listing)) {
    let mut read = Listing::read(directory).unwrap().unwrap();
    listing(&mut read);
    read.write(directory).unwrap();
}

/// Messages of findings that are wrong, and of those that are only noted.
fn said(directory: &Path) -> (Vec<String>, Vec<String>) {
    let (wrong, notes): (Vec<_>, Vec<_>) =
        Check::of(directory).unwrap().findings.into_iter().partition(|finding| finding.is_wrong);
    (wrong.into_iter().map(|one| one.what).collect(), notes.into_iter().map(|one| one.what).collect())
}

#[track_caller]
fn wrong(directory: &Path, expected: &str) {
    let (wrong, _) = said(directory);
    assert!(wrong.iter().any(|what| what.contains(expected)), "{wrong:?}");
}

#[test]
fn a_good_data_set_is_summed_up_and_nothing_is_wrong() {
    let directory = captured();
    let check = Check::of(directory.path()).unwrap();
    assert_eq!((check.wrong(), check.summary.touches()), (0, 60));
    let fork = &check.summary.objects[0];
    assert_eq!((fork.name.as_str(), fork.touches, fork.approaches), ("fork", 30, Some(90)));
    assert_eq!((fork.patterns, fork.duplicates, fork.posed), ([0, 0, 0, 0, 0, 30], 0, 0));
    assert_eq!(fork.longest, 0.029);
    // Slope: 77 i microseconds, for i from 0 to 29.
    assert_eq!(fork.slope.unwrap()[..2], [0.0, 0.077]);
    assert_eq!(fork.slope.unwrap()[6], 2.233);
    // The same touches as training reads.
    assert_eq!(Dataset::read(directory.path()).unwrap().len(), 60);
}

#[test]
fn every_wrong_line_is_named_and_more_than_twenty_are_counted() {
    let directory = captured();
    std::fs::remove_file(Listing::path(directory.path())).unwrap();
    let path = directory.path().join("fork.txt");
    std::fs::write(&path, lines(&touches(0)) + "0 0\n0 0 -1\n0 x 0\n\n0 0 0\n").unwrap();
    let (wrong, _) = said(directory.path());
    assert_eq!(wrong.len(), 3, "{wrong:?}");
    for (line, (what, expected)) in (31..).zip(wrong.iter().zip(["2 fields", "negative", "\"x\" is not a number"])) {
        assert!(what.contains(&format!("fork.txt:{line}: ")) && what.contains(expected), "{what}");
    }
    std::fs::write(&path, lines(&touches(0)) + &"0\n".repeat(50)).unwrap();
    let (wrong, _) = said(directory.path());
    assert_eq!(wrong.len(), 21);
    assert!(wrong[20].ends_with("30 more lines are wrong"), "{}", wrong[20]);
}

#[test]
fn what_a_listing_states_must_be_there() {
    let directory = captured();
    change(directory.path(), |listing| listing.objects[0].pools[0].touches = 31);
    wrong(directory.path(), "fork.txt: 30 touches where dataset.json states 31");
    let directory = captured();
    std::fs::remove_file(directory.path().join("spoon.txt")).unwrap();
    wrong(directory.path(), "spoon.txt: missing");
    let directory = captured();
    std::fs::write(directory.path().join("cup.txt"), lines(&touches(5))).unwrap();
    std::fs::write(directory.path().join("fork.txt"), lines(&touches(6))).unwrap();
    let (wrong_ones, notes) = said(directory.path());
    assert_eq!(wrong_ones, [""; 0]);
    assert!(notes[0].contains("fork.txt: changed since its capture"), "{notes:?}");
    assert!(notes[1].contains("cup.txt: not listed in dataset.json, so it is not read"), "{notes:?}");
    std::fs::create_dir(directory.path().join("fork")).unwrap();
    std::fs::write(directory.path().join("fork/2.txt"), lines(&touches(5))).unwrap();
    assert!(said(directory.path()).1.iter().any(|note| note.contains("2.txt: not listed")), "files of an object, too");
    std::fs::write(Listing::path(directory.path()), "{").unwrap();
    wrong(directory.path(), "dataset.json:1: not the listing of a data set");
}

#[test]
fn what_reads_well_and_trains_badly_is_wrong() {
    let with = |spoon: &[Touch], listed: bool| {
        let directory = captured();
        std::fs::write(directory.path().join("spoon.txt"), lines(spoon)).unwrap();
        match listed {
            true => change(directory.path(), |listing| listing.objects[1].pools[0].touches = spoon.len() as u64),
            false => std::fs::remove_file(Listing::path(directory.path())).unwrap(),
        }
        directory
    };
    let spoon = touches(1);
    wrong(with(&[spoon.clone(), spoon.clone()].concat(), false).path(), "it holds every touch at least twice");
    wrong(with(&touches(0), false).path(), "fork and spoon hold the same touches");
    wrong(with(&vec![spoon[3]; 40], false).path(), "all touches are the same");
    let missing = crate::touches::parse_touch("- - -").unwrap();
    wrong(with(&[missing; 25], false).path(), "no touch has a contact");
    wrong(with(&[&spoon[..], &[missing]].concat(), true).path(), "1 of 31 touches miss a contact");
    let posed: Vec<Touch> = spoon
        .iter()
        .map(|touch| touch.with_pose(palpate_shared::Pose { direction: [0, 0, 32767], alignment: [32767, 0, 0] }))
        .collect();
    wrong(with(&posed, false).path(), "30 of 60 touches have a pose and the others have none");
    let located = |touch: &Touch| touch.with_position(palpate_shared::Position { micrometers: [1, 2, 3] });
    let located: Vec<Touch> = posed.iter().map(located).collect();
    wrong(with(&located, false).path(), "spoon.txt: a position, where the touches before it have none");
    wrong(with(&located, true).path(), "a position, where the touches that dataset.json states have none");
    wrong(
        with(&[&posed[..1], &located[..]].concat(), false).path(),
        "spoon.txt:2: a position, where the touches before it",
    );
    let slow: Vec<Touch> = (1..31).map(|i| Touch::from_micros([0, 3_000_000 * i, 9_000_000])).collect();
    let why = "a finger touched 9.0 s after the first, but no object of the data set's scale takes longer than 2.73 s";
    wrong(with(&slow, true).path(), &format!("spoon.txt:1: {why}"));
    let (none, notes) = said(with(&[&spoon[..], &slow[..2]].concat(), true).path());
    assert_eq!(none, [""; 0]);
    assert!(notes.iter().any(|note| note.contains(&format!("2 of 32 touches: {why}"))), "{notes:?}");
    wrong(tempfile::tempdir().unwrap().path(), "no touches here");
    assert!(Check::of(Path::new("nowhere")).is_err());
}

#[test]
fn the_published_format_survives_reading_and_writing_to_the_byte() {
    let text = "0.000000 0.123456 12.000001\n0.031000 0.000000 0.002000\n";
    let read: Vec<Touch> = text::touches(text.as_bytes(), Path::new("cup.txt")).collect::<Result<_>>().unwrap();
    assert_eq!(lines(&read), text);
    let posed =
        lines(&[read[0].with_pose(palpate_shared::Pose { direction: [1, -2, 32767], alignment: [-32767, 0, 3] })]);
    let again: Vec<Touch> = text::touches(posed.as_bytes(), Path::new("cup.txt")).collect::<Result<_>>().unwrap();
    assert_eq!(lines(&again), posed);
}

#[test]
fn a_recording_of_one_object_is_no_reason_to_end_with_1() {
    let directory = captured();
    std::fs::remove_file(directory.path().join("spoon.txt")).unwrap();
    change(directory.path(), |listing| {
        listing.objects.retain(|entry| entry.name == "fork");
        listing.objects[0].pools[0].recorded = Some(crate::touches::Recorded::default());
    });
    let (wrong, notes) = said(directory.path());
    assert_eq!(wrong, [""; 0]);
    assert!(notes.iter().any(|note| note.contains("only fork has been recorded")), "{notes:?}");
}
