//! A chip's whole program at the end of a link: its verdicts are those of a recognizer, also under a model that was loaded.

use embedded_io::{ErrorKind, ErrorType, Read, Write};
use palpate::compile::{Leaf, Settings, compile};
use palpate_onboard::station::{ERRORS_IN_A_ROW, Memory, NoStorage, RECORD_LENGTH, serve};
use palpate_shared::format::{Counted, TrainedTouches};
use palpate_shared::link::{FRAME_MAX, Frame, LinkError, Message, Refusal, Request, encode};
use palpate_shared::{ContactTime, Patterns, Pose, Touch};
use palpate_tests::desk::{Desk, OBJECTS, PowerCut, Step, expected, load, push};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::{Trained, trained};
use rand::{Rng, RngExt};

/// Most touches count; those without any contact, and those that spread too far, do not.
const CONTACTS: Trained = Trained {
    probe: None,
    touches: Some(TrainedTouches {
        patterns: Patterns::CONTACTS,
        counted: Counted::Contacts,
        needs_pose: false,
        largest_spread: 1_000_000,
    }),
    noise: None,
    shares: None,
};

fn model(seed: u64) -> Vec<u8> {
    let shape = Shape { objects: 10, trees: 10, depth: 4, thresholds: 100, leaf: 0.05, ..Shape::SMALL };
    trained(&random::model(shape, seed, Leaf::I16), &CONTACTS)
}

/// A chip's memory, which outlasts its program.
struct Chip {
    built_in: Vec<u8>,
    models: [Vec<u8>; 2],
    records: [[u8; RECORD_LENGTH]; 2],
    /// Starts so far.
    starts: u32,
}

impl Chip {
    fn new(built_in: Vec<u8>) -> Self {
        let (models, records) = ([vec![0; 20_000], vec![0; 20_000]], [[0xff; RECORD_LENGTH]; 2]);
        Self { built_in, models, records, starts: 0 }
    }

    fn run(&mut self, desk: &mut Desk) -> Result<(), PowerCut> {
        let Self { built_in, models: [a, b], records: [c, d], starts } = self;
        desk.power.set(true);
        *starts += 1;
        serve::<OBJECTS, _, _>(built_in, &mut Memory { models: [a, b], records: [c, d] }, *starts, desk)
    }
}

fn touches(count: usize) -> Vec<Touch> {
    random::touches(count, 3)
}

#[test]
fn touches_that_the_model_was_not_trained_for_are_refused_counted_and_reported_over_the_link() {
    let bytes = model(1);
    let pose = Pose { direction: [0, 0, -32_767], alignment: [32_767, 0, 0] };
    let missing = ContactTime::MISSING;
    let touches = [
        Touch::from_micros([0, 5, 9]),
        Touch::new([missing; 3]).with_pose(pose),
        Touch::from_micros([0, 1_000_001, 9]),
        Touch::new([ContactTime::FIRST, missing, missing]),
    ];
    let mut desk = Desk::new(touches.iter().map(push).chain([Step::Ask(Request::Counts)]), 0);
    Chip::new(bytes.clone()).run(&mut desk).unwrap();
    assert_eq!(desk.verdicts, expected(&bytes, &touches));
    assert_eq!(desk.verdicts[1..3], [Err(Refusal::Pattern), Err(Refusal::Spread)]);
    assert!(desk.answers[0].contains("refused: 2"), "{}", desk.answers[0]);
}

#[test]
fn without_a_model_touches_are_refused_and_nothing_else_happens() {
    let mut desk = Desk::new([push(&touches(1)[0]), Step::Ask(Request::Reset), Step::Ask(Request::Model)], 0);
    Chip::new(Vec::new()).run(&mut desk).unwrap();
    assert_eq!((desk.verdicts, desk.answers), (vec![Err(Refusal::NoModel)], vec!["Refused(NoModel)".into(); 2]));
}

#[test]
fn a_loaded_model_is_used_from_its_last_part_on_and_after_a_restart() {
    let (first, second): (&[u8], &[u8]) = (model(1).leak(), model(2).leak());
    let touches = touches(40);
    let (before, after) = touches.split_at(20);
    let mut script = vec![load(first)];
    script.extend(before.iter().map(push));
    script.push(load(second));
    script.extend(after.iter().map(push));
    let mut chip = Chip::new(Vec::new());
    let mut desk = Desk::new(script, 0);
    chip.run(&mut desk).unwrap();
    assert_eq!(desk.verdicts, [expected(first, before), expected(second, after)].concat());
    let mut desk = Desk::new([Step::Ask(Request::Model), Step::Ask(Request::Reset), push(&after[0])], 0);
    chip.run(&mut desk).unwrap();
    assert!(desk.answers[0].contains(&format!("length: {}", second.len())), "{}", desk.answers[0]);
    assert_eq!(desk.verdicts, expected(second, &after[..1]));
}

#[test]
fn a_model_that_arrives_wrong_is_refused_and_the_old_one_stays() {
    let (good, bad): (Vec<u8>, &[u8]) = (model(1), model(2).leak());
    let touches = touches(20);
    let chunk = |offset, bytes| Step::Ask(Request::Chunk { offset, bytes });
    let begin = |length, checksum| Step::Ask(Request::Begin { length, checksum });
    // Another checksum, no model at all, no beginning, too long, nothing, a part missing, more than was announced.
    let mut script = vec![Step::Load(bad, 1), load(&[7; 400]), chunk(0, &[1]), begin(30_000, 0), begin(0, 0)];
    script.extend([begin(300, 0), chunk(256, &[1]), chunk(0, &[7; 256]), chunk(256, &[7; 45])]);
    script.extend(touches.iter().map(push));
    let mut desk = Desk::new(script, 0);
    Chip::new(good.clone()).run(&mut desk).unwrap();
    assert_eq!(desk.loads, [Err(Refusal::Checksum), Err(Refusal::Invalid)]);
    let refused = |refusal: Refusal| format!("Refused({refusal:?})");
    let wanted = |offset: u32| format!("Wanted {{ offset: {offset} }}");
    let expected_answers = [
        refused(Refusal::OutOfOrder),
        refused(Refusal::TooLong),
        refused(Refusal::Invalid),
        wanted(0),
        refused(Refusal::OutOfOrder),
        wanted(256),
        refused(Refusal::TooLong),
    ];
    assert_eq!(desk.answers, expected_answers);
    assert_eq!(desk.verdicts, expected(&good, &touches));
}

#[test]
fn a_chip_that_was_reset_has_its_model_and_tells_the_host_that_evidence_and_session_are_gone() {
    let touches = touches(10);
    let (before, after) = touches.split_at(5);
    let (built_in, loaded): (Vec<u8>, &[u8]) = (model(1), model(2).leak());
    let mut chip = Chip::new(built_in);
    let mut desk = Desk::new([load(loaded)].into_iter().chain(before.iter().map(push)), 0);
    chip.run(&mut desk).unwrap();
    assert_eq!((desk.loads.len(), desk.verdicts.len()), (1, 5));
    // The host goes on, and nothing of its session counts.
    desk.may_fail = true;
    desk.script.extend(after.iter().map(push));
    chip.run(&mut desk).unwrap();
    assert_eq!((desk.verdicts.len(), desk.failed), (5, Some(LinkError::Forgotten)));
    let mut desk = Desk::new(after.iter().map(push), 0);
    chip.run(&mut desk).unwrap();
    assert_eq!(desk.verdicts, expected(loaded, after));
}

#[test]
fn a_chip_without_room_for_models_does_not_ask_for_a_smaller_one() {
    let mut chip = Chip::new(model(1));
    chip.models = [Vec::new(), Vec::new()];
    let mut desk = Desk::new([load(&[7; 100])], 0);
    chip.run(&mut desk).unwrap();
    assert_eq!(desk.loads, [Err(Refusal::Unsupported)]);
}

#[test]
fn a_load_that_the_power_cuts_anywhere_leaves_the_old_model_or_the_new_one() {
    let (old, new): (&[u8], &[u8]) = (model(1).leak(), model(2).leak());
    let is = |chip: &mut Chip, expected: &[u8]| {
        let mut desk = Desk::new([Step::Ask(Request::Model)], 0);
        chip.run(&mut desk).unwrap();
        let checksum = u32::from_le_bytes(*expected.last_chunk().unwrap());
        desk.answers[0].contains(&format!("checksum: {checksum},"))
    };
    let (mut cuts, mut olds) = (0, 0);
    for seed in 0..300 {
        let mut chip = Chip::new(Vec::new());
        chip.run(&mut Desk::new([load(old)], 0)).unwrap();
        let mut desk = Desk::new([load(new)], 30);
        desk.rng = rand::SeedableRng::seed_from_u64(seed);
        if chip.run(&mut desk).is_ok() {
            assert!(is(&mut chip, new));
            continue;
        }
        cuts += 1;
        // It may have gone in the midst of the newest record.
        if is(&mut chip, new) && desk.rng.random_bool(0.5) {
            let newest = chip.records.iter_mut().max_by_key(|record| record[8]).unwrap();
            desk.rng.fill_bytes(&mut newest[seed as usize % RECORD_LENGTH..]);
        }
        let is_old = is(&mut chip, old);
        olds += u32::from(is_old);
        assert!(is_old || is(&mut chip, new), "seed {seed}");
        // The load begins again.
        chip.run(&mut Desk::new([load(new)], 0)).unwrap();
        assert!(is(&mut chip, new), "seed {seed}");
    }
    assert!(cuts > 50 && olds > 20, "{cuts} cuts, {olds} with the old model");
}

/// The error of a UART that lost or garbled a byte.
const GARBLED: ErrorKind = ErrorKind::Other;

/// A UART that hands out the bytes of a desk one by one, with errors.
struct Uart<'d, F> {
    desk: &'d mut Desk,
    /// True if this read, or this frame to be sent, is an error.
    errs: F,
    /// True if a read that is an error loses the byte.
    loses: bool,
    reads: u32,
    writes: u32,
}

impl<'d, F> Uart<'d, F> {
    fn new(desk: &'d mut Desk, loses: bool, errs: F) -> Self {
        Self { desk, errs, loses, reads: 0, writes: 0 }
    }
}

/// One read or write of a UART, by its number.
enum Call {
    Read(u32),
    Write(u32),
}

impl<F> ErrorType for Uart<'_, F> {
    type Error = ErrorKind;
}

impl<F: FnMut(Call) -> bool> Read for Uart<'_, F> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        self.reads += 1;
        let errs = (self.errs)(Call::Read(self.reads - 1));
        if errs && !self.loses {
            return Err(GARBLED);
        }
        let count = self.desk.read(&mut buffer[..1]).map_err(|PowerCut| GARBLED)?;
        // The end is no byte.
        if errs && count > 0 { Err(GARBLED) } else { Ok(count) }
    }
}

impl<F: FnMut(Call) -> bool> Write for Uart<'_, F> {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, ErrorKind> {
        self.writes += 1;
        if (self.errs)(Call::Write(self.writes - 1)) {
            return Err(GARBLED);
        }
        self.desk.write(buffer).map_err(|PowerCut| GARBLED)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

/// Serves these touches over a UART with errors, and returns its calls.
fn served(touches: &[Touch], loses: bool, errs: impl FnMut(Call) -> bool) -> [u32; 2] {
    let bytes = model(1);
    let mut chip = Chip::new(bytes.clone());
    let Chip { built_in, models: [a, b], records: [c, d], .. } = &mut chip;
    let mut desk = Desk::new(touches.iter().map(push), 0);
    let mut uart = Uart::new(&mut desk, loses, errs);
    serve::<OBJECTS, _, _>(built_in, &mut Memory { models: [a, b], records: [c, d] }, 0, &mut uart).unwrap();
    let calls = [uart.reads, uart.writes];
    assert_eq!(desk.verdicts, expected(&bytes, touches));
    calls
}

#[test]
fn an_error_of_the_uart_at_any_byte_or_frame_ends_nothing_and_costs_no_touch() {
    let touches = touches(4);
    let [reads, writes] = served(&touches, true, |_| false);
    assert!(reads > 100 && writes > 4, "{reads} reads, {writes} writes");
    for at in 0..reads {
        served(&touches, true, |call| matches!(call, Call::Read(number) if number == at));
        served(&touches, false, |call| matches!(call, Call::Read(number) if number == at));
    }
    for at in 0..writes {
        served(&touches, true, |call| matches!(call, Call::Write(number) if number == at));
    }
}

#[test]
fn a_uart_that_errs_before_every_byte_serves_all_touches() {
    served(&touches(40), false, |call| matches!(call, Call::Read(number) if number % 2 == 0));
    // As long as a byte comes now and then.
    let most = u32::from(ERRORS_IN_A_ROW);
    served(&touches(1), false, |call| matches!(call, Call::Read(number) if number % most != 0));
}

#[test]
fn a_uart_that_only_errs_ends_the_program_which_begins_again_with_the_same_storage() {
    let (bytes, touches) = (model(1), touches(20));
    let mut chip = Chip::new(bytes.clone());
    let Chip { built_in, models: [a, b], records: [c, d], .. } = &mut chip;
    let mut storage = Memory { models: [a, b], records: [c, d] };
    let mut desk = Desk::new(touches.iter().map(push), 0);
    let mut uart = Uart::new(&mut desk, true, |call| matches!(call, Call::Read(number) if number >= 500));
    let ended = serve::<OBJECTS, _, _>(built_in, &mut storage, 0, &mut uart);
    assert_eq!((ended, uart.reads), (Err(GARBLED), 500 + u32::from(ERRORS_IN_A_ROW)));
    let before = desk.verdicts.len();
    assert!((1..touches.len()).contains(&before), "{before}");
    let mut uart = Uart::new(&mut desk, true, |_| false);
    uart.desk.may_fail = true;
    assert_eq!(serve::<OBJECTS, _, _>(built_in, &mut storage, 1, &mut uart), Ok(()));
    assert!(matches!(desk.failed, Some(LinkError::Forgotten)), "{:?}", desk.failed);
    let mut desk = Desk::new(touches.iter().map(push), 0);
    assert_eq!(serve::<OBJECTS, _, _>(built_in, &mut storage, 2, &mut desk), Ok(()));
    assert_eq!(desk.verdicts, expected(&bytes, &touches));
}

/// A host that asks and asks, at a UART on which nothing can be sent.
struct Mute {
    frame: Vec<u8>,
    writes: u32,
}

impl ErrorType for Mute {
    type Error = ErrorKind;
}

impl Read for Mute {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        self.frame.rotate_left(1);
        buffer[0] = self.frame[self.frame.len() - 1];
        Ok(1)
    }
}

impl Write for Mute {
    fn write(&mut self, _: &[u8]) -> Result<usize, ErrorKind> {
        self.writes += 1;
        Err(GARBLED)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

#[test]
fn a_uart_on_which_nothing_can_be_sent_ends_the_program_although_bytes_come() {
    let message = Message::Request { number: 1, request: Request::Hello { previous: 0, boot: 9 } };
    let frame = encode(&Frame { session: 1, message }, &mut [0; FRAME_MAX]).to_vec();
    let mut uart = Mute { frame, writes: 0 };
    let ended = serve::<OBJECTS, _, _>(&[], &mut NoStorage, 0, &mut uart);
    assert_eq!((ended, uart.writes), (Err(GARBLED), u32::from(ERRORS_IN_A_ROW)));
}

#[test]
fn a_loaded_model_of_more_objects_than_the_next_program_has_room_for_falls_back_to_the_built_in_one() {
    let shape = Shape { thresholds: 40, leaf: 0.3, ..Shape::SMALL };
    let small = compile(&random::ensemble(shape, 1), &Settings::default()).unwrap().bytes;
    let mut chip = Chip::new(small.clone());
    let mut desk = Desk::new([load(model(1).leak())], 0);
    chip.run(&mut desk).unwrap();
    assert_eq!(desk.loads, [Ok(())]);
    let touches = touches(3);
    let Chip { built_in, models: [a, b], records: [c, d], .. } = &mut chip;
    let mut desk = Desk::new(touches.iter().map(push), 0);
    serve::<4, _, _>(built_in, &mut Memory { models: [a, b], records: [c, d] }, 0, &mut desk).unwrap();
    assert_eq!(desk.verdicts, expected(&small, &touches));
}
