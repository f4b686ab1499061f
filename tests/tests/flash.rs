//! Records and models in flash: whatever single step fails or loses its power, no touch is lost, doubled or changed.
//!
//! A step is one word written or one sector erased; every one of a session is tried with every fault.

use palpate::compile::{Leaf, Settings, compile};
use palpate_onboard::station::{FlashStorage, ServeError, Station, Storage, record_length, serve};
use palpate_shared::Descriptor;
use palpate_shared::link::{Command, Decision, Device, Outcome, Payload, Query, Refusal};
use palpate_tests::desk::{Desk, OBJECTS, PowerCut, Step, answers_to_touches, expected, load, push};
use palpate_tests::flash::{Cells, Driver, Fault, SECTOR, WORD};
use palpate_tests::random::{self, Shape};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

const RECORD: usize = record_length(OBJECTS).next_multiple_of(WORD);
/// Sectors of the log, and of each model.
const LOG: usize = 3;
const MODEL: usize = 4;

fn model(seed: u64) -> &'static [u8] {
    let shape = Shape {
        descriptor: Descriptor::Curvature,
        objects: 5,
        trees: 4,
        depth: 3,
        each: true,
        thresholds: 40,
        leaf: 0.3,
    };
    let settings = Settings { leaf: Leaf::I8, ..Settings::default() };
    compile(&random::ensemble(shape, seed), &settings).unwrap().bytes.leak()
}

/// Runs the chip's program until the script is done, with the power switched on again whenever it went; says how often.
fn run(cells: &mut Cells, built_in: &[u8], desk: &mut Desk) -> u32 {
    desk.power = cells.power.clone();
    for cuts in 0..10 {
        cells.power.set(true);
        let storage = FlashStorage::<_, RECORD>::new(Driver(cells), LOG * SECTOR).unwrap();
        match serve::<OBJECTS, _, _>(built_in, storage, 7, desk) {
            Ok(()) => return cuts,
            Err(ServeError::Transport(PowerCut)) => {}
            Err(error) => panic!("{error}"),
        }
    }
    panic!("the power goes again and again");
}

/// Touches under the built-in model, another model, touches under that: with these faults.
fn session(faults: &[(u64, Fault)]) -> (Cells, u32) {
    let (first, second) = (model(1), model(2));
    let touches = random::touches(9, 3);
    let (before, after) = touches.split_at(5);
    let mut cells = Cells::new(LOG + 2 * MODEL, 1);
    cells.faults = faults.to_vec();
    let mut desk = Desk::new(before.iter().map(push).chain(load(second, Payload::Model)), 0);
    let mut cuts = run(&mut cells, first, &mut desk);
    // A step that failed may have cost the load, which says so, but nothing else.
    for _ in 0..2 {
        if desk.outcomes.last() == Some(&Outcome::Done) {
            break;
        }
        assert!(desk.outcomes.contains(&Outcome::Refused(Refusal::Unwritable)), "{faults:?}: {:?}", desk.outcomes);
        desk.script.extend(load(second, Payload::Model));
        cuts += run(&mut cells, first, &mut desk);
    }
    assert_eq!(desk.outcomes.last(), Some(&Outcome::Done), "{faults:?}");
    desk.script.extend(after.iter().map(push));
    desk.script.push_back(Step::Ask(Query::Statistics));
    cuts += run(&mut cells, first, &mut desk);
    assert_eq!(answers_to_touches(&desk), [expected(first, before), expected(second, after)].concat(), "{faults:?}");
    assert!(desk.answers[0].contains("unstored: 0"), "{faults:?}: {}", desk.answers[0]);
    (cells, cuts)
}

#[test]
fn a_power_cut_at_any_step_of_writing_or_erasing_loses_and_doubles_no_touch() {
    let (steps, none) = {
        let (cells, cuts) = session(&[]);
        (cells.steps, cuts)
    };
    assert!(steps > 500 && none == 0, "{steps} steps");
    let mut cuts = 0;
    for step in 0..steps {
        for fault in [Fault::CutBefore, Fault::CutDuring, Fault::CutAfter] {
            cuts += u64::from(session(&[(step, fault)]).1);
        }
    }
    assert_eq!(cuts, 3 * steps);
}

#[test]
fn a_step_that_errs_or_silently_does_nothing_loses_no_touch_even_if_the_power_goes_after_it() {
    let steps = session(&[]).0.steps;
    let faults = [Fault::Refused, Fault::Torn, Fault::RefusedThoughDone, Fault::Nothing, Fault::Half];
    for step in 0..steps {
        // What follows at once, and what follows a record later.
        let later = [step + 1, step + 2 + step % 50];
        for fault in faults {
            session(&[(step, fault)]);
            session(&[(step, fault), (later[step as usize % 2], Fault::CutDuring)]);
        }
    }
}

#[test]
fn sectors_that_wear_out_are_passed_over_until_none_is_left_and_the_last_record_kept_stays() {
    let mut cells = Cells::new(6, 5);
    cells.endurance.fill(20);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut kept, mut failed) = (None, 0);
    let mut number = 0_u32;
    while failed < 20 {
        let mut storage = FlashStorage::<_, RECORD>::new(Driver(&mut cells), 6 * SECTOR).unwrap();
        let newest = storage.newest().map(|(_, record)| record.to_vec());
        assert_eq!(newest, kept, "after {number} records");
        for _ in 0..rng.random_range(1..30) {
            number += 1;
            let record: Vec<u8> = (0..rng.random_range(0..200)).map(|_| rng.random()).collect();
            let stored = storage.store(|bytes| {
                bytes[..record.len()].copy_from_slice(&record);
                Some(record.len())
            });
            match stored {
                Ok(()) => kept = Some(record),
                Err(_) => failed += 1,
            }
            assert_eq!(storage.newest().map(|(_, record)| record.to_vec()), kept);
        }
    }
    // All but the one that holds the newest record are worn out, each after as many erases.
    let worn = cells.erases.iter().filter(|&&erases| erases >= 20).count();
    assert!(worn >= 5 && number > 600, "{number} records, {:?} erases", cells.erases);
}

#[test]
fn a_record_that_does_not_fit_is_reported_and_leaves_the_newest() {
    let mut cells = Cells::new(2, 5);
    let mut storage = FlashStorage::<_, 64>::new(Driver(&mut cells), 2 * SECTOR).unwrap();
    storage
        .store(|bytes| {
            bytes[0] = 9;
            Some(1)
        })
        .unwrap();
    storage.store(|_| None).unwrap_err();
    assert_eq!(storage.newest().map(|(_, record)| record.to_vec()), Some(vec![9]));
}

#[test]
fn a_switch_that_could_not_be_kept_is_reported_and_the_model_from_before_is_not_written_over() {
    let (first, second) = (model(1), model(2));
    let mut cells = Cells::new(LOG + 2 * MODEL, 1);
    let mut desk = Desk::new(load(second, Payload::Model), 0);
    run(&mut cells, first, &mut desk);
    assert_eq!(desk.outcomes.last(), Some(&Outcome::Done));
    // From here on the log is worn out. Another model arrives and is used, but not kept; and then one more.
    cells.endurance[..LOG].fill(0);
    let script = load(first, Payload::Model).into_iter().chain([Step::Ask(Query::Statistics)]);
    // Touches fill what is left of the sector in use.
    let touches = random::touches(40, 3);
    let mut desk = Desk::new(touches.iter().map(push).chain(script).chain(load(second, Payload::Model)), 0);
    run(&mut cells, first, &mut desk);
    let loads = desk.outcomes[touches.len()..].split_at(load(first, Payload::Model).len());
    let loads = [loads.0, loads.1];
    assert_eq!(loads[0].last(), Some(&Outcome::Done));
    assert!(!desk.answers[0].contains("unstored: 0"), "{}", desk.answers[0]);
    assert_eq!(loads[1][1], Outcome::Refused(Refusal::Unwritable));
    assert!(desk.outcomes.ends_with(&[Outcome::Refused(Refusal::OutOfOrder)]));
    // After a power cut the chip has the model that it kept.
    let mut desk = Desk::new([Step::Ask(Query::Model)], 0);
    run(&mut cells, first, &mut desk);
    let checksum = u32::from_le_bytes(*second.last_chunk().unwrap());
    assert!(desk.answers[0].contains(&format!("checksum: {checksum},")), "{}", desk.answers[0]);
}

/// Erases of sectors of 4 KB, as the RP2040's flash has them, for a million touches.
fn wear(cells: &Cells, touches: usize) -> f64 {
    let erases: u32 = cells.erases.iter().sum();
    let per_million = f64::from(erases) / touches as f64 * 1e6 * SECTOR as f64 / 4096.0;
    // The Pico's log: 256 sectors that are erased 100,000 times each; a touch per second.
    let years = 256.0 * 100_000.0 / (per_million / 1e6) / (365.25 * 86_400.0);
    println!(
        "{per_million:.0} erases of 4 KB per million touches; a log of 1 MB lasts {years:.0} years at one per second"
    );
    let log = &cells.erases[..LOG];
    assert!(log.iter().max().unwrap() - log.iter().min().unwrap() <= 1, "sectors wear alike: {log:?}");
    per_million
}

#[test]
fn the_log_wears_as_little_as_the_readme_states_under_touches_from_a_host() {
    let bytes = include_bytes!("../../models/household.palpate");
    let touches = random::touches(4_000, 3);
    let mut cells = Cells::new(LOG + 2 * 44, 1);
    let mut script: Vec<Step> = Vec::new();
    for (index, touch) in touches.iter().enumerate() {
        if index % 20 == 0 {
            script.push(Step::Do(Command::Reset));
        }
        script.push(push(touch));
    }
    let mut desk = Desk::new(script, 0);
    run(&mut cells, bytes, &mut desk);
    let per_million = wear(&cells, touches.len());
    assert!((40_000.0..47_000.0).contains(&per_million), "{per_million}");
}

#[test]
fn the_log_wears_as_little_as_the_readme_states_under_touches_of_its_own() {
    let bytes = include_bytes!("../../models/household.palpate");
    let touches = random::touches(4_000, 3);
    let mut cells = Cells::new(LOG + 2 * 44, 1);
    let storage = FlashStorage::<_, RECORD>::new(Driver(&mut cells), LOG * SECTOR).unwrap();
    // As a ProbeStation does it.
    let (mut station, progress, _) = Station::<OBJECTS, _>::open(bytes, storage).unwrap();
    for touch in &touches {
        if station.push(touch, true).is_ok_and(|verdict| verdict.decision != Decision::Undecided) {
            station.reset();
        }
        station.store(&progress).unwrap();
    }
    let per_million = wear(&cells, touches.len());
    assert!((10_000.0..20_000.0).contains(&per_million), "{per_million}");
}
