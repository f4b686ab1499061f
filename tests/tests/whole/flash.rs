//! Records and models in flash: whichever single step fails or loses its power, no touch is lost, doubled or changed.
//!
//! A step is one word written or one sector erased; every one of a session is tried with every fault, and every read with
//! every misreading.

use ed25519_compact::{KeyPair, Signature};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_write};
use palpate::compile::Leaf;
use palpate_onboard::station::{
    FlashError, FlashStorage, MappedFlash, Place, ServeError, Signed, Station, Storage, record_length, serve,
};
use palpate_shared::link::{
    CHUNK, Command, Decision, Device, DeviceEnd, Event, NotStored, Outcome, Payload, Query, Refusal,
};
use palpate_tests::HOUSEHOLD;
use palpate_tests::desk::{Desk, OBJECTS, PowerCut, Step, answers_to_touches, expected, load, push};
use palpate_tests::flash::{Cells, Driver, Fault, Misread, SECTOR};
use palpate_tests::random::{self, Shape};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

const RECORD: usize = record_length(OBJECTS);
/// Sectors of the log, and of each model.
const LOG: usize = 3;
const MODEL: usize = 4;

fn model(seed: u64) -> &'static [u8] {
    random::model(Shape { objects: 5, thresholds: 40, leaf: 0.3, ..Shape::SMALL }, seed, Leaf::I8).leak()
}

/// Runs the chip's program until the script is done, with the power switched on again whenever it went; says how often.
fn run(cells: &mut Cells, built_in: &[u8], desk: &mut Desk) -> u32 {
    desk.power = cells.power.clone();
    for cuts in 0..10 {
        cells.power.set(true);
        let mut storage = FlashStorage::<_, RECORD>::new(Driver(cells), LOG * SECTOR).unwrap();
        match serve::<OBJECTS, _, _>(built_in, &mut storage, 7, desk) {
            Ok(()) => return cuts,
            Err(ServeError::Transport(PowerCut)) => {}
            Err(error) => panic!("{error}"),
        }
    }
    panic!("the power goes again and again");
}

/// Touches under the built-in model, another model, touches under that: with these faults. Also the number of power cuts, and
/// where the load went on.
fn session(faults: &[(u64, Fault)]) -> (Cells, u32, Vec<u32>) {
    let (first, second) = (model(1), model(2));
    let touches = random::touches(9, 3);
    let (before, after) = touches.split_at(5);
    let mut cells = Cells::new(LOG + 2 * MODEL, 1);
    cells.faults = faults.to_vec();
    let mut desk = Desk::new(before.iter().map(push).chain(load(second, Payload::Model)), 0);
    let mut cuts = run(&mut cells, first, &mut desk);
    // A step that failed may cost what the load wrote into one sector, and nothing else.
    assert_eq!(desk.outcomes.last(), Some(&Outcome::Done), "{faults:?}: {:?}", desk.outcomes);
    assert!(
        desk.continued.iter().all(|&from| (from as usize).is_multiple_of(SECTOR)),
        "{faults:?}: {:?}",
        desk.continued
    );
    desk.script.extend(after.iter().map(push));
    desk.script.push_back(Step::Ask(Query::Statistics));
    cuts += run(&mut cells, first, &mut desk);
    assert_eq!(answers_to_touches(&desk), [expected(first, before), expected(second, after)].concat(), "{faults:?}");
    assert!(desk.answers[0].contains("unstored: 0"), "{faults:?}: {}", desk.answers[0]);
    (cells, cuts, desk.continued)
}

#[test]
fn a_power_cut_at_any_step_of_writing_or_erasing_loses_and_doubles_no_touch() {
    let (steps, none) = {
        let (cells, cuts, continued) = session(&[]);
        (cells.steps, cuts + continued.len() as u32)
    };
    assert!(steps > 500 && none == 0, "{steps} steps");
    let (mut cuts, mut continued) = (0, 0);
    for step in 0..steps {
        for fault in [Fault::CutBefore, Fault::CutDuring, Fault::CutAfter] {
            let (_, cut, from) = session(&[(step, fault)]);
            cuts += u64::from(cut);
            continued += from.len();
            assert!(from.len() <= 1, "{from:?}");
        }
    }
    assert_eq!(cuts, 3 * steps);
    println!("of {cuts} cuts, {continued} had the load go on at the start of a sector, and none from its beginning");
    assert!(continued > 100);
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
fn a_load_whose_host_went_away_goes_on_where_it_was_for_the_same_bytes_and_no_others() {
    let (first, second) = (model(1), model(2));
    let mut cells = Cells::new(LOG + 2 * MODEL, 1);
    // Its beginning and three chunks.
    let begun: Vec<Step> = load(second, Payload::Model).into_iter().take(4).collect();
    for (bytes, continued) in [(second, &[3 * CHUNK as u32][..]), (first, &[])] {
        run(&mut cells, first, &mut Desk::new(begun.clone(), 0));
        let mut desk = Desk::new(load(bytes, Payload::Model).into_iter().chain([Step::Ask(Query::Model)]), 0);
        run(&mut cells, first, &mut desk);
        assert_eq!((desk.outcomes.last(), &desk.continued[..]), (Some(&Outcome::Done), continued));
        let checksum = u32::from_le_bytes(*bytes.last_chunk().unwrap());
        assert!(desk.answers[0].contains(&format!("checksum: {checksum},")), "{}", desk.answers[0]);
    }
}

#[test]
fn a_flash_that_never_takes_a_chunk_is_asked_for_it_again_and_again_and_keeps_the_model_in_use() {
    let mut cells = Cells::new(LOG + 2 * MODEL, 1);
    cells.endurance[LOG..].fill(0);
    let mut desk = Desk::new(load(model(2), Payload::Model).into_iter().take(2), 0);
    let storage = FlashStorage::<_, RECORD>::new(Driver(&mut cells), LOG * SECTOR).unwrap();
    let (mut station, ..) = Station::<OBJECTS, _>::open(model(1), storage).unwrap();
    let mut take = || match desk.script.pop_front().unwrap() {
        Step::Do(Command::Begin { payload, length, checksum }) => station.begin(payload, length, checksum),
        Step::Do(Command::Chunk { offset, bytes }) => [0; 3].map(|_| station.chunk(offset, bytes))[2],
        step => panic!("{step:?}"),
    };
    assert_eq!([take(), take()], [Outcome::Done, Outcome::Continue { offset: 0 }]);
    assert_eq!(station.commit(), Outcome::Refused(Refusal::OutOfOrder));
    assert_eq!(Station::model(&station).unwrap().bytes(), model(1));
}

/// The model with a counter and a signature behind it.
fn signed(model: &[u8], counter: u32, pair: &KeyPair) -> &'static [u8] {
    let signed = [model, b"PLPS", &counter.to_le_bytes()].concat();
    let signature = pair.sk.sign(&signed, None);
    [&signed[..], &signature[..]].concat().leak()
}

#[test]
fn a_chip_that_takes_signed_models_alone_refuses_tampered_cut_unsigned_and_older_ones() {
    let (pair, stranger) = [7, 8].map(|seed| KeyPair::from_seed([seed; 32].into())).into();
    let (built_in, new) = (model(1), model(2));
    let mut cells = Cells::new(LOG + 2 * (MODEL + 1), 1);
    let mut outcome = |bytes: &'static [u8], least| {
        let storage = FlashStorage::<_, RECORD>::new(Driver(&mut cells), LOG * SECTOR).unwrap();
        let verify = |bytes: &[u8], signature: &[u8; 64]| pair.pk.verify(bytes, &Signature::new(*signature)).is_ok();
        let mut desk = Desk::new(load(bytes, Payload::Model), 0);
        serve::<OBJECTS, _, _>(built_in, &mut Signed { storage, least, verify }, 0, &mut desk).unwrap();
        *desk.outcomes.last().unwrap()
    };
    let refused = Outcome::Refused;
    let good = signed(new, 7, &pair);
    assert_eq!(outcome(good, 8), refused(Refusal::Older), "below the program's own");
    for (bytes, what) in [(new, "unsigned"), (signed(new, 7, &stranger), "another key"), (&[1; 8], "nothing")] {
        assert_eq!(outcome(bytes, 0), refused(Refusal::Signature), "{what}");
    }
    for at in [6, 8, 100, new.len() - 1, new.len(), new.len() + 4, new.len() + 8, good.len() - 1] {
        let mut tampered = good.to_vec();
        tampered[at] ^= 1;
        assert_eq!(outcome(tampered.leak(), 0), refused(Refusal::Signature), "byte {at}");
    }
    for length in [0, 12, 96, new.len(), new.len() + 8, good.len() - 1] {
        assert_eq!(outcome(&good[..length], 0), refused(Refusal::Signature), "{length} bytes");
    }
    assert_eq!(outcome([good, &[0]].concat().leak(), 0), refused(Refusal::Signature), "a byte behind it");
    assert_eq!(outcome(good, 7), Outcome::Done);
    // From another start on it is in use, and its counter counts.
    assert_eq!(outcome(signed(built_in, 6, &pair), 0), refused(Refusal::Older));
    assert_eq!(outcome(signed(&[7; 200], 9, &pair), 0), refused(Refusal::Signature), "no length");
    assert_eq!(outcome(signed(built_in, 7, &pair), 0), Outcome::Done);
    assert_eq!(outcome(signed(new, u32::MAX, &pair), 0), Outcome::Done);
    assert_eq!(outcome(good, 0), refused(Refusal::Older));
    // The storage without a hook takes no signed model, and finds the one that is in use.
    let mut desk = Desk::new(load(good, Payload::Model).into_iter().chain([Step::Ask(Query::Model)]), 0);
    run(&mut cells, built_in, &mut desk);
    assert_eq!(desk.outcomes.last(), Some(&refused(Refusal::Invalid)));
    assert!(desk.answers[0].contains(&format!("length: {},", new.len())), "{}", desk.answers[0]);
}

/// A record that says which one it is; some are longer.
fn numbered(number: u32) -> Vec<u8> {
    let length = 120 + (number as usize * 53) % 110;
    number.to_le_bytes().into_iter().cycle().take(length).collect()
}

fn storage(cells: &mut Cells) -> FlashStorage<Driver<'_>, RECORD> {
    let sectors = cells.bytes.len();
    FlashStorage::new(Driver(cells), sectors).unwrap()
}

fn store(storage: &mut FlashStorage<Driver<'_>, RECORD>, number: u32) -> Result<(), NotStored> {
    storage.store(|bytes| {
        let record = numbered(number);
        bytes[..record.len()].copy_from_slice(&record);
        Some(record.len())
    })
}

/// The number of the newest record.
fn newest(storage: &FlashStorage<Driver<'_>, RECORD>) -> Option<u32> {
    storage.newest().map(|(_, record)| u32::from_le_bytes(*record.first_chunk().unwrap()))
}

/// Stores records that fill the log more than once, and looks after each what a start would find: of what was acknowledged
/// nothing is lost. Returns how many were not acknowledged.
fn records(cells: &mut Cells, faults: &str) -> u32 {
    let (mirror, erased) = (cells.mirror.clone(), cells.erased_to);
    let (mut kept, mut tried, mut unstored) = (None, None, 0);
    let check = |found: Option<u32>, kept: Option<u32>, tried: Option<u32>| {
        // What was not acknowledged may have been stored.
        assert!(found >= kept && found <= tried, "{faults}: {found:?} found, {kept:?} kept, {tried:?} tried");
        found
    };
    let mut number = 0;
    // Two lives that go around the log; one begins in the midst of it.
    for end in [11, 24] {
        cells.power.set(true);
        let power = cells.power.clone();
        let mut chip = storage(cells);
        kept = check(newest(&chip), kept, tried);
        while number < end && power.get() {
            tried = Some(number);
            match store(&mut chip, number) {
                Ok(()) => kept = tried,
                Err(NotStored) => unstored += 1,
            }
            assert_eq!(newest(&chip), kept, "{faults}");
            // The power may go at any time.
            if number % 3 == 0 || number + 1 == end {
                check(newest(&storage(&mut Cells::like(&mirror).erased_to(erased))), kept, tried);
            }
            number += 1;
        }
    }
    unstored
}

#[test]
fn a_step_that_fails_or_a_read_that_is_wrong_loses_no_acknowledged_record_however_many_follow() {
    every_fault(|| Cells::new(LOG, 1), 1);
}

#[test]
fn flash_whose_erased_bytes_are_0_keeps_its_records_through_every_fault() {
    every_fault(|| Cells::new(LOG, 1).erased_to(0), 13);
}

/// Has every fault happen at every `stride`th step, and every misreading at every such read.
fn every_fault(new: impl Fn() -> Cells, stride: usize) {
    let mut cells = new();
    assert_eq!(records(&mut cells, "no fault"), 0);
    let (steps, reads) = (cells.steps, cells.reads.get());
    assert!(cells.erases.iter().sum::<u32>() >= 4 && steps > 900 && reads > 60, "{steps} steps, {reads} reads");
    for step in (0..steps).step_by(stride) {
        for fault in Fault::ALL {
            let mut cells = new();
            cells.faults = vec![(step, fault)];
            let unstored = records(&mut cells, &format!("{fault:?} at step {step}"));
            // The first step erases a sector, to find the value of erased bytes: no record is under way.
            assert_eq!(unstored, u32::from(is_cut(fault) && step > 0), "{fault:?} at step {step}");
        }
    }
    for read in (0..reads).step_by(stride) {
        for misread in [Misread::Flipped, Misread::Erased] {
            let mut cells = new();
            cells.misread = Some((read, misread));
            assert_eq!(records(&mut cells, &format!("{misread:?} at read {read}")), 0);
        }
    }
}

fn is_cut(fault: Fault) -> bool {
    matches!(fault, Fault::CutBefore | Fault::CutDuring | Fault::CutAfter)
}

/// `PALPATE_REPETITIONS=100000 cargo test --release -p palpate-tests --test whole several_faults` tries more.
#[test]
fn several_faults_lose_no_acknowledged_record() {
    let repetitions = palpate_tests::repetitions(300);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut unstored = 0;
    for _ in 0..repetitions {
        let mut cells = Cells::new(LOG, rng.random());
        let first = rng.random_range(0..900);
        // Close together, so that one meets what is done about another.
        let mut fault = || (first + rng.random_range(0..60), Fault::ALL[rng.random_range(0..Fault::ALL.len())]);
        cells.faults = (0..6).map(|_| fault()).filter(|(_, fault)| !is_cut(*fault)).collect();
        cells.misread = rng.random_bool(0.5).then(|| (rng.random_range(0..70), Misread::Flipped));
        let faults = format!("{:?}, {:?}", cells.faults, cells.misread);
        unstored += records(&mut cells, &faults);
    }
    println!("{unstored} records were not stored in {repetitions} sessions");
}

#[test]
fn a_flash_that_erases_but_no_longer_programs_costs_four_erases_then_one_then_none() {
    const SECTORS: usize = 64;
    let mut cells = Cells::new(SECTORS, 1);
    let (programs, erased) = (cells.programs.clone(), cells.erased.clone());
    let mut chip = storage(&mut cells);
    let mut number = 0;
    let mut erases_of_a_store = |chip: &mut FlashStorage<_, RECORD>, expected| {
        let before = erased.get();
        number += 1;
        assert_eq!(store(chip, number), expected, "record {number}");
        erased.get() - before
    };
    assert_eq!(erases_of_a_store(&mut chip, Ok(())), 0, "into the sector that the first start has erased");
    programs.set(false);
    assert_eq!(erases_of_a_store(&mut chip, Err(NotStored)), 4);
    assert_eq!(erases_of_a_store(&mut chip, Err(NotStored)), 1);
    // It may have been a dip of the supply.
    programs.set(true);
    assert_eq!([0; 2].map(|_| erases_of_a_store(&mut chip, Ok(()))), [1, 0]);
    programs.set(false);
    assert_eq!(erases_of_a_store(&mut chip, Err(NotStored)), 4);
    for _ in 4..4 * SECTORS {
        assert_eq!(erases_of_a_store(&mut chip, Err(NotStored)), 1);
    }
    for _ in 0..100 {
        assert_eq!(erases_of_a_store(&mut chip, Err(NotStored)), 0);
    }
    assert_eq!(newest(&chip), Some(5));
    // A start tries again.
    programs.set(true);
    let mut chip = FlashStorage::<_, RECORD>::new(chip.into_flash(), SECTORS * SECTOR).unwrap();
    assert_eq!(newest(&chip), Some(5));
    assert_eq!(erases_of_a_store(&mut chip, Ok(())), 0, "the rest of its sector is erased still");
    assert_eq!(newest(&chip), Some(number));
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
    run(&mut cells, HOUSEHOLD, &mut desk);
    let per_million = wear(&cells, touches.len());
    assert!((42_000.0..48_000.0).contains(&per_million), "{per_million}");
}

#[test]
fn the_log_wears_as_little_as_the_readme_states_under_touches_of_its_own() {
    let touches = random::touches(4_000, 3);
    let mut cells = Cells::new(LOG + 2 * 44, 1);
    let storage = FlashStorage::<_, RECORD>::new(Driver(&mut cells), LOG * SECTOR).unwrap();
    // As a ProbeStation does it.
    let (mut station, progress, starts) = Station::<OBJECTS, _>::open(HOUSEHOLD, storage).unwrap();
    let mut end = DeviceEnd::new(progress, starts);
    for touch in &touches {
        let outcome = station.push(touch, true);
        if outcome.is_ok_and(|verdict| verdict.decision != Decision::Undecided) {
            station.reset();
        }
        let touch = touch.into();
        let event = match outcome {
            Ok(verdict) => Event::Touch { touch, pose_age: None, verdict },
            Err(refusal) => Event::Refused { touch, refusal },
        };
        end.report(event, &mut station, |_| ());
    }
    assert_eq!(end.statistics().unstored, 0);
    let per_million = wear(&cells, touches.len());
    assert!((22_000.0..28_000.0).contains(&per_million), "{per_million}");
}

#[test]
fn a_record_that_cannot_be_read_any_more_hides_none_that_was_written_after_it() {
    // Within the first sector, and after the log has gone round.
    for count in [3, 23] {
        let mut cells = Cells::new(LOG, 1);
        let mut chip = storage(&mut cells);
        (0..count).for_each(|number| store(&mut chip, number).unwrap());
        let whole = cells.bytes.clone();
        let starts = |at: usize| (0..count).find(|&number| whole[at + 10..].starts_with(&numbered(number)));
        let records: Vec<(usize, u32)> = (0..whole.len() - 10).filter_map(|at| Some((at, starts(at)?))).collect();
        assert!(records.len() as u32 >= count.min(10), "{records:?}");
        for (at, number) in records {
            cells.bytes.copy_from_slice(&whole);
            cells.bytes[at + 12] ^= 4;
            let mut chip = storage(&mut cells);
            assert_eq!(newest(&chip), Some(count - 1 - u32::from(number == count - 1)), "without {number} of {count}");
            store(&mut chip, 99).unwrap();
            // Nor is it taken for a newer one when it can be read again, if its sector was not erased since.
            if cells.bytes[at..at + 12] == whole[at..at + 12] {
                cells.bytes[at + 12] ^= 4;
            }
            assert_eq!(newest(&storage(&mut cells)), Some(99), "with {number} of {count} again");
        }
    }
}

/// A flash of other words and sectors, in RAM, erased to a pattern of four bytes.
struct Kind<const WORD: usize, const ROW: usize> {
    bytes: Vec<u8>,
    pattern: [u8; 4],
    /// Erases, and how often one was announced.
    erases: usize,
    announced: usize,
}

impl<const WORD: usize, const ROW: usize> Kind<WORD, ROW> {
    fn new(rows: usize, pattern: [u8; 4]) -> Self {
        Self { bytes: vec![0x5a; rows * ROW], pattern, erases: 0, announced: 0 }
    }
}

impl<const WORD: usize, const ROW: usize> ErrorType for Kind<WORD, ROW> {
    type Error = NorFlashErrorKind;
}

impl<const WORD: usize, const ROW: usize> ReadNorFlash for Kind<WORD, ROW> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const WORD: usize, const ROW: usize> NorFlash for Kind<WORD, ROW> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = ROW;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to).expect("whole sectors");
        self.erases += 1;
        let pattern = self.pattern.iter().cycle();
        self.bytes[from as usize..to as usize].iter_mut().zip(pattern).for_each(|(byte, erased)| *byte = *erased);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len()).expect("whole words");
        let words = &mut self.bytes[offset as usize..][..bytes.len()];
        assert!(words.iter().zip(self.pattern.iter().cycle()).all(|(byte, erased)| byte == erased), "not erased");
        words.copy_from_slice(bytes);
        Ok(())
    }
}

impl<const WORD: usize, const ROW: usize> MappedFlash for Kind<WORD, ROW> {
    fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn before_erase(&mut self) {
        self.announced += 1;
    }
}

/// Loads a model into a flash of this kind and touches under it, with a start before each touch.
fn kind<const WORD: usize, const ROW: usize>(erased: u8, sector: usize) {
    type Of<const WORD: usize, const ROW: usize> = FlashStorage<Kind<WORD, ROW>, RECORD>;
    let what = format!("words of {WORD}, sectors of {ROW}, erased to {erased}");
    assert_eq!(Of::<WORD, ROW>::SECTOR, sector, "{what}");
    let (first, second) = (model(1), model(2));
    let log = 3 * sector;
    let mut flash = Kind::<WORD, ROW>::new(log / ROW + 2 * second.len().div_ceil(ROW), [erased; 4]);
    let mut desk = Desk::new(load(second, Payload::Model), 0);
    let touches = random::touches(30, 3);
    for touch in 0..=touches.len() {
        let mut storage = Of::new(flash, log).unwrap();
        serve::<OBJECTS, _, _>(first, &mut storage, 0, &mut desk).unwrap();
        flash = storage.into_flash();
        desk.script.extend(touches.get(touch).map(push));
    }
    assert_eq!(answers_to_touches(&desk), expected(second, &touches), "{what}");
    assert_eq!((flash.erases, flash.erases > 1), (flash.announced, true), "{what}");
}

#[test]
fn flash_of_any_words_and_sectors_erased_to_ones_or_zeros_keeps_models_and_records() {
    kind::<1, 4096>(0xff, 4096); // A chip of serial flash.
    kind::<8, 2048>(0xff, 2048); // STM32L4, G4.
    kind::<32, 8192>(0xff, 8192); // STM32H7, with smaller sectors.
    kind::<4, 128>(0, 640); // STM32L0.
    kind::<4, 256>(0, 768); // STM32L1.
    kind::<64, 256>(0xff, 768); // SAMD21.
}

#[test]
fn flash_whose_erased_bytes_are_neither_ones_nor_zeros_is_an_error_at_the_first_start() {
    let new = |pattern| FlashStorage::<_, RECORD>::new(Kind::<2, 256>::new(100, pattern), 7_680).map(drop);
    // CH32V203.
    assert_eq!(new([0x39, 0xe3, 0x39, 0xe3]), Err(FlashError::Erased));
    assert_eq!((new([0xff; 4]), new([0; 4])), (Ok(()), Ok(())));
}

#[test]
fn a_log_of_one_sector_or_part_of_one_is_refused() {
    let new = |log| FlashStorage::<_, RECORD>::new(Kind::<64, 256>::new(100, [0xff; 4]), log).map(drop);
    for log in [0, 256, 768, 1_024, 2_560 * 256] {
        assert_eq!(new(log), Err(FlashError::Log), "{log}");
    }
    assert_eq!(new(1_536), Ok(()));
    let room = |log| FlashStorage::<_, RECORD>::new(Kind::<64, 256>::new(100, [0xff; 4]), log).unwrap().room();
    assert_eq!(room(1_536), 47 * 256);
    let mut storage = FlashStorage::<_, RECORD>::new(Kind::<64, 256>::new(100, [0xff; 4]), 1_536).unwrap();
    assert_eq!(storage.write_model(Place::Second, 46 * 256 + 128, &[7; 130]), Err(NotStored));
}
