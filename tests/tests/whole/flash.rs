//! Models in flash: whichever single step of a load fails or loses its power, the chip has the old model or the new one.
//!
//! A step is one word written or one sector erased; every one of a session is tried with every fault, and every read with
//! every misreading.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_write};
use palpate::compile::Leaf;
use palpate_onboard::station::{
    FlashError, FlashStorage, Loaded, MappedFlash, NotStored, Place, Station, Storage, serve,
};
use palpate_shared::link::{CHUNK, Device, Refusal, Request, checksum};
use palpate_tests::desk::{Desk, OBJECTS, PowerCut, Step, expected, load, push};
use palpate_tests::flash::{Cells, Driver, Fault, Misread, SECTOR};
use palpate_tests::random::{self, Shape};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Sectors of records, and of each model.
const LOG: usize = 2;
const MODEL: usize = 4;

fn model(seed: u64) -> &'static [u8] {
    random::model(Shape { objects: 5, thresholds: 40, leaf: 0.3, ..Shape::SMALL }, seed, Leaf::I8).leak()
}

/// Cells of a flash that was never used.
fn cells() -> Cells {
    Cells::new(LOG + 2 * MODEL, 1)
}

/// Runs the chip's program until the script is done or the power goes; the power is on again then.
fn run(cells: &mut Cells, built_in: &[u8], desk: &mut Desk) -> Result<(), PowerCut> {
    desk.power = cells.power.clone();
    let mut storage = FlashStorage::new(Driver(cells)).unwrap();
    let done = serve::<OBJECTS, _, _>(built_in, &mut storage, 7, desk);
    desk.power.set(true);
    done
}

/// The chip's model after a start, of these.
fn model_in<'m>(cells: &mut Cells, built_in: &[u8], models: &[&'m [u8]]) -> Option<&'m [u8]> {
    let mut desk = Desk::new([Step::Ask(Request::Model)], 0);
    run(cells, built_in, &mut desk).unwrap();
    let is = |model: &&&[u8]| {
        let checksum = u32::from_le_bytes(*model.last_chunk().unwrap());
        desk.answers[0].contains(&format!("checksum: {checksum},"))
    };
    models.iter().find(is).copied()
}

/// Content of a chip's flash after a load, in words that are erased to this value.
fn after_a_load(erased: u8) -> Vec<u8> {
    let mut cells = cells().erased_to(erased);
    run(&mut cells, model(1), &mut Desk::new([load(model(2))], 0)).unwrap();
    assert_eq!(model_in(&mut cells, model(1), &[model(2)]), Some(model(2)));
    cells.bytes
}

/// Loads another model into a flash that holds this, with these faults, and looks after that, and after a load without faults, what
/// the chip has. Says whether the power went, whether the model was the new one, and how many steps and reads there were.
fn session(
    (held, erased): (&[u8], u8),
    faults: &[(u64, Fault)],
    misread: Option<(u64, Misread)>,
) -> (bool, bool, [u64; 2]) {
    let (built_in, old, new) = (model(1), model(2), model(3));
    let what = format!("{faults:?} {misread:?}");
    let mut cells = Cells::of(held.to_vec()).erased_to(erased);
    (cells.faults, cells.misread) = (faults.to_vec(), misread);
    let mut desk = Desk::new([load(new)], 0);
    let is_cut = run(&mut cells, built_in, &mut desk).is_err();
    (cells.faults, cells.misread) = (Vec::new(), None);
    let steps = [cells.steps, cells.reads.get()];
    let found = model_in(&mut cells, built_in, &[old, new]);
    let is_new = found == Some(new);
    assert!(found.is_some(), "{what}: neither the old model nor the new one");
    // What the host was told is so, except that what the chip refused may be there.
    match desk.loads.last() {
        Some(Ok(())) if desk.is_done() => assert!(is_new, "{what}"),
        last => assert!(is_cut || matches!(last, Some(Err(_))), "{what}: {last:?}"),
    }
    // Whatever it was, the next load is as the first.
    let next = if is_new { old } else { new };
    run(&mut cells, built_in, &mut Desk::new([load(next)], 0)).unwrap();
    assert_eq!(model_in(&mut cells, built_in, &[next]), Some(next), "{what}");
    (is_cut, is_new, steps)
}

/// Every fault at every `stride`th step of a load, alone and with a power cut soon after it, and every misreading at every such read.
fn every_fault(erased: u8, stride: usize) {
    let held = (&after_a_load(erased)[..], erased);
    let (_, is_new, [steps, reads]) = session(held, &[], None);
    assert!(is_new && steps > 100 && reads > 30, "{steps} steps, {reads} reads");
    let (mut cuts, mut olds) = (0, 0);
    for step in (0..steps).step_by(stride) {
        for fault in Fault::ALL {
            let (is_cut, is_new, _) = session(held, &[(step, fault)], None);
            cuts += u32::from(is_cut);
            olds += u32::from(!is_new);
            if !is_a_cut(fault) {
                session(held, &[(step, fault), (step + 1 + step % 50, Fault::CutDuring)], None);
            }
        }
    }
    println!("{steps} steps, {reads} reads: {cuts} power cuts, after {olds} of all faults the old model");
    assert!(cuts > 0 && olds > 0);
    for read in (0..reads).step_by(stride) {
        for misread in [Misread::Flipped, Misread::Erased] {
            session(held, &[], Some((read, misread)));
        }
    }
}

fn is_a_cut(fault: Fault) -> bool {
    matches!(fault, Fault::CutBefore | Fault::CutDuring | Fault::CutAfter)
}

#[test]
fn a_load_during_which_any_step_fails_or_loses_its_power_leaves_the_old_model_or_the_new_one() {
    every_fault(0xff, 1);
}

#[test]
fn a_load_into_flash_whose_erased_bytes_are_0_leaves_the_old_model_or_the_new_one() {
    every_fault(0, 7);
}

/// `PALPATE_REPETITIONS=100000 cargo test --release -p palpate-tests --test whole several_faults` tries more.
#[test]
fn several_faults_in_a_load_leave_the_old_model_or_the_new_one() {
    let repetitions = palpate_tests::repetitions(300);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let held = (&after_a_load(0xff)[..], 0xff);
    let steps = session(held, &[], None).2[0];
    for _ in 0..repetitions {
        let first = rng.random_range(0..steps);
        // Close together, so that one meets what is done about another.
        let mut fault = || (first + rng.random_range(0..60), Fault::ALL[rng.random_range(0..Fault::ALL.len())]);
        let faults: Vec<(u64, Fault)> = (0..6).map(|_| fault()).filter(|(_, fault)| !is_a_cut(*fault)).collect();
        let misread = rng.random_bool(0.5).then(|| (rng.random_range(0..70), Misread::Flipped));
        session(held, &faults, misread);
    }
}

#[test]
fn touches_after_a_load_are_those_of_the_model_also_after_a_start() {
    let (first, second) = (model(1), model(2));
    let touches = random::touches(9, 3);
    let mut cells = cells();
    let mut desk = Desk::new(touches.iter().map(push).chain([load(second)]).chain(touches.iter().map(push)), 0);
    run(&mut cells, first, &mut desk).unwrap();
    assert_eq!(desk.verdicts, [expected(first, &touches), expected(second, &touches)].concat());
    let mut desk = Desk::new(touches.iter().map(push), 0);
    run(&mut cells, first, &mut desk).unwrap();
    assert_eq!(desk.verdicts, expected(second, &touches));
}

#[test]
fn a_load_whose_host_went_away_goes_on_where_it_was_for_the_same_bytes_and_no_others() {
    let (first, second) = (model(1), model(2));
    for (bytes, goes_on) in [(second, CHUNK as u32), (first, 0)] {
        let mut cells = cells();
        let mut station = Station::<OBJECTS, _>::open(first, FlashStorage::new(Driver(&mut cells)).unwrap());
        // Its beginning and one chunk, then another host.
        let mut next = station.begin(second.len() as u32, checksum(second)).unwrap();
        for chunk in second.chunks(CHUNK).take(1) {
            next = station.chunk(next, chunk).unwrap();
        }
        let mut next = station.begin(bytes.len() as u32, checksum(bytes)).unwrap();
        assert_eq!(next, goes_on);
        for chunk in bytes[next as usize..].chunks(CHUNK) {
            next = station.chunk(next, chunk).unwrap();
        }
        assert_eq!(next as usize, bytes.len());
        assert_eq!(Station::model(&station).unwrap().bytes(), bytes);
    }
}

#[test]
fn a_flash_that_never_takes_a_chunk_asks_for_it_again_and_again_and_keeps_the_model_in_use() {
    let mut cells = cells();
    cells.endurance[LOG..].fill(0);
    let mut station = Station::<OBJECTS, _>::open(model(1), FlashStorage::new(Driver(&mut cells)).unwrap());
    let new = model(2);
    assert_eq!(station.begin(new.len() as u32, checksum(new)), Ok(0));
    assert_eq!([0; 3].map(|_| station.chunk(0, &new[..CHUNK])), [Ok(0); 3]);
    assert_eq!(station.chunk(CHUNK as u32, &new[CHUNK..2 * CHUNK]), Err(Refusal::OutOfOrder));
    assert_eq!(Station::model(&station).unwrap().bytes(), model(1));
}

#[test]
fn a_load_that_cannot_be_kept_is_refused_and_the_model_from_before_stays() {
    let (first, second) = (model(1), model(2));
    let mut cells = cells();
    run(&mut cells, first, &mut Desk::new([load(second)], 0)).unwrap();
    // From here on the sectors of records are worn out, and nothing can be written into what is left of them.
    cells.endurance[..LOG].fill(0);
    cells.bytes[16..SECTOR].fill(0);
    let touch = random::touches(1, 3);
    let script = touch.iter().map(push).chain([load(first)]).chain(touch.iter().map(push));
    let mut desk = Desk::new(script, 0);
    run(&mut cells, first, &mut desk).unwrap();
    assert_eq!(desk.loads, [Err(Refusal::Unwritable)]);
    // The touch before counts still.
    assert_eq!(desk.verdicts, expected(second, &[touch[0], touch[0]]));
    assert_eq!(model_in(&mut cells, first, &[first, second]), Some(second));
}

/// Storage with a check of its own: a model has to be followed by a byte that is its number, not below that of the one in use.
struct Checked<S>(S);

impl<S: Storage> Storage for Checked<S> {
    fn room(&self) -> usize {
        self.0.room()
    }

    fn model(&self, place: Place) -> &[u8] {
        self.0.model(place)
    }

    fn write_model(&mut self, place: Place, offset: usize, bytes: &[u8]) -> Result<(), NotStored> {
        self.0.write_model(place, offset, bytes)
    }

    fn sector(&self) -> usize {
        self.0.sector()
    }

    fn admit(&self, loaded: &[u8], current: &[u8]) -> Result<usize, Refusal> {
        let (number, own) = loaded.split_last().ok_or(Refusal::NotAdmitted)?;
        let before = current.get(own.len()).unwrap_or(&0);
        if number < before { Err(Refusal::NotAdmitted) } else { Ok(own.len()) }
    }

    fn loaded(&self) -> Option<Loaded> {
        self.0.loaded()
    }

    fn keep(&mut self, loaded: Loaded) -> Result<(), NotStored> {
        self.0.keep(loaded)
    }
}

#[test]
fn a_check_of_ones_own_sees_a_model_before_it_is_used_and_what_is_behind_it() {
    let (built_in, new) = (model(1), model(2));
    let mut cells = cells();
    let mut outcome = |number: u8| {
        let bytes = [new, &[number]].concat().leak();
        let mut desk = Desk::new([load(bytes)], 0);
        let mut storage = Checked(FlashStorage::new(Driver(&mut cells)).unwrap());
        serve::<OBJECTS, _, _>(built_in, &mut storage, 7, &mut desk).unwrap();
        desk.loads[0]
    };
    assert_eq!([5, 4, 6].map(&mut outcome), [Ok(()), Err(Refusal::NotAdmitted), Ok(())]);
    assert_eq!(model_in(&mut cells, built_in, &[new]), Some(new));
}

#[test]
fn records_fill_both_sectors_in_turn_and_the_last_one_counts() {
    let mut cells = Cells::new(LOG + 2, 1);
    let bytes = [model(1), model(2)].map(|model| &model[..100]);
    let mut number = 0_usize;
    for start in 0..20 {
        let mut storage = FlashStorage::new(Driver(&mut cells)).unwrap();
        for _ in 0..1 + start * 7 {
            let (place, own) = ([Place::First, Place::Second][number % 2], bytes[number % 2]);
            storage.write_model(place, 0, own).unwrap();
            let loaded = Loaded { place, length: 100, checksum: checksum(own) };
            storage.keep(loaded).unwrap();
            assert_eq!(storage.loaded(), Some(loaded), "record {number}");
            number += 1;
        }
    }
    let erases = &cells.erases[..LOG];
    assert!(erases.iter().all(|&erases| erases > 5) && number > 1_000, "{erases:?} erases for {number} records");
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
    type Of<const WORD: usize, const ROW: usize> = FlashStorage<Kind<WORD, ROW>>;
    let what = format!("words of {WORD}, sectors of {ROW}, erased to {erased}");
    assert_eq!(Of::<WORD, ROW>::SECTOR, sector, "{what}");
    let (first, second) = (model(1), model(2));
    let mut flash = Kind::<WORD, ROW>::new(2 * sector / ROW + 2 * second.len().div_ceil(ROW), [erased; 4]);
    let touches = random::touches(30, 3);
    for model in [second, first].repeat(40).into_iter().chain([second]) {
        let mut storage = Of::new(flash).unwrap();
        let mut desk = Desk::new([load(model)].into_iter().chain(touches.iter().map(push)), 0);
        serve::<OBJECTS, _, _>(first, &mut storage, 0, &mut desk).unwrap();
        assert_eq!(desk.verdicts, expected(model, &touches), "{what}");
        flash = storage.into_flash();
    }
    assert_eq!((flash.erases, flash.erases > 1), (flash.announced, true), "{what}");
    let station = Station::<OBJECTS, _>::open(first, Of::new(flash).unwrap());
    assert_eq!(Station::model(&station).unwrap().bytes(), second, "{what}");
}

#[test]
fn flash_of_any_words_and_sectors_erased_to_ones_or_zeros_keeps_models() {
    kind::<1, 4096>(0xff, 4096); // A chip of serial flash.
    kind::<8, 2048>(0xff, 2048); // STM32L4, G4.
    kind::<32, 8192>(0xff, 8192); // STM32H7, with smaller sectors.
    kind::<4, 128>(0, 128); // STM32L0.
    kind::<4, 256>(0, 256); // STM32L1.
    kind::<64, 256>(0xff, 256); // SAMD21.
}

#[test]
fn flash_whose_erased_bytes_are_neither_ones_nor_zeros_is_an_error_at_the_first_start() {
    let new = |pattern| FlashStorage::new(Kind::<2, 256>::new(100, pattern)).map(drop);
    // CH32V203.
    assert_eq!(new([0x39, 0xe3, 0x39, 0xe3]), Err(FlashError::Erased));
    assert_eq!((new([0xff; 4]), new([0; 4])), (Ok(()), Ok(())));
}

#[test]
fn flash_without_two_sectors_is_refused_and_what_is_left_is_room_for_two_models() {
    let new = |rows| FlashStorage::new(Kind::<64, 256>::new(rows, [0xff; 4]));
    assert_eq!(new(1).map(drop), Err(FlashError::Short));
    assert_eq!([2, 3, 100].map(|rows| new(rows).unwrap().room()), [0, 0, 49 * 256]);
    assert_eq!(new(100).unwrap().write_model(Place::Second, 48 * 256 + 128, &[7; 130]), Err(NotStored));
}
