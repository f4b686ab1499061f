//! A chip's whole program at the end of a link: its verdicts are those of a recognizer, through loading,
//! power cuts and torn records.

use embedded_io::{ErrorKind, ErrorType, Read, Write};
use palpate::compile::{Leaf, Settings, compile};
use palpate_onboard::station::{
    ERRORS_IN_A_ROW, Memory, NoStorage, RecordsTooShort, ServeError, Station, record_length, serve,
};
use palpate_shared::format::{Counted, Trained, TrainedTouches};
use palpate_shared::link::{
    Command, DeviceEnd, FRAME_MAX, Frame, HostEnd, HostSettings, Incoming, LinkError, Message, Outcome, Payload,
    Progress, Query, Refusal, encode,
};
use palpate_shared::{ContactTime, Patterns, Pose, Touch};
use palpate_tests::desk::{Desk, OBJECTS, PowerCut, Step, answers_to_touches, expected, load, push};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::trained;
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
    records: [Vec<u8>; 2],
}

impl Chip {
    fn new(built_in: Vec<u8>) -> Self {
        let record = vec![0xff; record_length(OBJECTS)];
        Self { built_in, models: [vec![0; 20_000], vec![0; 20_000]], records: [record.clone(), record] }
    }

    fn run(&mut self, desk: &mut Desk) -> Result<(), PowerCut> {
        let Self { built_in, models: [a, b], records: [c, d] } = self;
        desk.power.set(true);
        match serve::<OBJECTS, _, _>(built_in, &mut Memory { models: [a, b], records: [c, d] }, 0, desk) {
            Ok(()) => Ok(()),
            Err(ServeError::Transport(cut)) => Err(cut),
            Err(error) => panic!("{error}"),
        }
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
    let mut desk = Desk::new(touches.iter().map(push).chain([Step::Ask(Query::Statistics)]), 0);
    Chip::new(bytes.clone()).run(&mut desk).unwrap();
    assert_eq!(desk.outcomes, expected(&bytes, &touches));
    let refusals = [Outcome::Refused(Refusal::Pattern), Outcome::Refused(Refusal::Spread)];
    assert_eq!(desk.outcomes[1..3], refusals);
    assert!(desk.answers[0].contains("refused: 2"), "{}", desk.answers[0]);
}

#[test]
fn without_a_model_touches_are_refused_and_nothing_else_happens() {
    let mut desk = Desk::new([push(&touches(1)[0]), Step::Do(Command::Reset), Step::Ask(Query::Model)], 0);
    Chip::new(Vec::new()).run(&mut desk).unwrap();
    assert_eq!(desk.outcomes, [Outcome::Refused(Refusal::NoModel); 2]);
    assert_eq!(desk.answers, ["Refused(NoModel)"]);
}

#[test]
fn a_loaded_model_is_used_from_its_commit_on_and_after_a_restart() {
    let (first, second): (&[u8], &[u8]) = (model(1).leak(), model(2).leak());
    let touches = touches(40);
    let (before, after) = touches.split_at(20);
    let mut script: Vec<Step> = load(first, Payload::Model);
    script.extend(before.iter().map(push));
    script.extend(load(second, Payload::Model));
    script.extend(after.iter().map(push));
    let mut chip = Chip::new(Vec::new());
    let mut desk = Desk::new(script, 0);
    chip.run(&mut desk).unwrap();
    assert_eq!(answers_to_touches(&desk), [expected(first, before), expected(second, after)].concat());
    let mut desk = Desk::new([Step::Ask(Query::Model), Step::Do(Command::Reset), push(&after[0])], 0);
    chip.run(&mut desk).unwrap();
    assert!(desk.answers[0].contains(&format!("length: {}", second.len())), "{}", desk.answers[0]);
    assert_eq!(desk.outcomes[1], expected(second, after)[0]);
}

#[test]
fn a_model_that_arrives_wrong_is_refused_and_the_old_one_stays() {
    let (good, bad): (Vec<u8>, &[u8]) = (model(1), model(2).leak());
    let touches = touches(20);
    let wrong_checksum = Command::Begin { payload: Payload::Model, length: bad.len() as u32, checksum: 1 };
    let mut script = load(bad, Payload::Model);
    script[0] = Step::Do(wrong_checksum);
    // No model at all, a chunk missing, a chunk without a beginning, too long, nothing.
    script.extend(load(&[7; 400], Payload::Model));
    let mut holed = load(bad, Payload::Model);
    holed.remove(2);
    script.extend(holed);
    script.push(Step::Do(Command::Chunk { offset: 0, bytes: &[1] }));
    script.push(Step::Do(Command::Begin { payload: Payload::Model, length: 30_000, checksum: 0 }));
    script.push(Step::Do(Command::Commit));
    script.extend(touches.iter().map(push));
    let mut desk = Desk::new(script, 0);
    Chip::new(good.clone()).run(&mut desk).unwrap();
    let refused: Vec<Refusal> = desk
        .outcomes
        .iter()
        .filter_map(|o| if let Outcome::Refused(r) = o { Some(*r).filter(|r| !r.is_of_a_touch()) } else { None })
        .collect();
    assert_eq!(refused[..2], [Refusal::Checksum, Refusal::Invalid]);
    let mut rest = refused[2..].to_vec();
    rest.dedup();
    assert_eq!(rest, [Refusal::OutOfOrder, Refusal::TooLong, Refusal::OutOfOrder]);
    assert!(desk.outcomes.ends_with(&expected(&good, &touches)));
}

#[test]
fn a_snapshot_taken_over_the_link_goes_on_in_another_chip_and_not_under_another_model() {
    let bytes = model(1);
    let touches = touches(30);
    let mut script: Vec<Step> = touches[..10].iter().map(push).collect();
    script.push(Step::Ask(Query::Snapshot { offset: 0 }));
    let mut desk = Desk::new(script, 0);
    Chip::new(bytes.clone()).run(&mut desk).unwrap();
    let (_, list) = desk.answers[0].split_once('[').unwrap();
    let snapshot: Vec<u8> = list.trim_end_matches([' ', ']', '}']).split(", ").map(|b| b.parse().unwrap()).collect();
    let snapshot: &[u8] = snapshot.leak();
    let mut script = load(snapshot, Payload::Snapshot);
    script.extend(touches[10..].iter().map(push));
    let mut desk = Desk::new(script.clone(), 0);
    Chip::new(bytes.clone()).run(&mut desk).unwrap();
    assert!(desk.outcomes.ends_with(&expected(&bytes, &touches)[10..]));
    let mut desk = Desk::new(script, 0);
    let other = model(2);
    Chip::new(other.clone()).run(&mut desk).unwrap();
    assert!(desk.outcomes.contains(&Outcome::Refused(Refusal::Invalid)));
    assert!(desk.outcomes.ends_with(&expected(&other, &touches[10..])));
}

#[test]
fn places_for_records_that_are_too_short_are_refused_at_once() {
    let mut chip = Chip::new(model(1));
    chip.records[1].truncate(record_length(8));
    let mut desk = Desk::new(touches(3).iter().map(push), 0);
    let Chip { built_in, models: [a, b], records: [c, d] } = &mut chip;
    let mut memory = Memory { models: [a, b], records: [c, d] };
    let (needed, found) = (record_length(OBJECTS), record_length(8));
    let too_short = ServeError::Records(RecordsTooShort { needed, found });
    assert_eq!(serve::<OBJECTS, _, _>(built_in, &mut memory, 0, &mut desk), Err(too_short));
    assert!(desk.outcomes.is_empty());
}

#[test]
fn a_record_of_another_model_is_dropped_with_its_evidence_and_its_session() {
    let touches = touches(10);
    let (before, after) = touches.split_at(5);
    let mut chip = Chip::new(model(1));
    let mut desk = Desk::new(before.iter().map(push), 0);
    chip.run(&mut desk).unwrap();
    // Another model was flashed. The host goes on, and has to be told that the chip does not.
    chip.built_in = model(2);
    desk.may_fail = true;
    desk.script.extend(after.iter().map(push));
    chip.run(&mut desk).unwrap();
    assert!(matches!(desk.failed, Some(LinkError::Forgotten { answered: 5, .. })), "{:?}", desk.failed);
    let mut desk = Desk::new(after.iter().map(push), 0);
    chip.run(&mut desk).unwrap();
    assert_eq!(desk.outcomes, expected(&model(2), after));
}

#[test]
fn a_chip_without_room_for_models_does_not_ask_for_a_smaller_one() {
    let mut chip = Chip::new(model(1));
    chip.models = [Vec::new(), Vec::new()];
    let begin = Command::Begin { payload: Payload::Model, length: 100, checksum: 0 };
    let mut desk = Desk::new([Step::Do(begin)], 0);
    chip.run(&mut desk).unwrap();
    assert_eq!(desk.outcomes, [Outcome::Refused(Refusal::Unsupported)]);
}

#[test]
fn through_power_cuts_and_torn_records_no_touch_is_lost_or_doubled() {
    let loaded: &[u8] = model(1).leak();
    let touches = touches(2_000);
    // A fresh start for the recognizer now and then, so that it does not rest on its first verdict.
    let mut script = load(loaded, Payload::Model);
    let mut verdicts = Vec::new();
    for touches in touches.chunks(17) {
        script.push(Step::Do(Command::Reset));
        script.extend(touches.iter().map(push));
        verdicts.extend(expected(loaded, touches));
    }
    let mut chip = Chip::new(Vec::new());
    let mut desk = Desk::new(script, 12);
    let (mut cuts, mut torn) = (0, 0);
    while let Err(PowerCut) = chip.run(&mut desk) {
        cuts += 1;
        // The power may have gone while the newest record was being written.
        if std::mem::take(&mut desk.untold) && desk.rng.random_bool(0.5) {
            torn += 1;
            let newest = newest(&chip.records);
            let length = usize::from(u16::from_le_bytes([chip.records[newest][0], chip.records[newest][1]]));
            let from = desk.rng.random_range(0..length);
            chip.records[newest][from] ^= 0x55;
            let rest = from + 1..6 + length;
            desk.rng.fill_bytes(&mut chip.records[newest][rest]);
        }
    }
    assert!(cuts > 100 && torn > 30, "{cuts} {torn}");
    assert_eq!(answers_to_touches(&desk), verdicts);
    let is_refused = |outcome: &Outcome| matches!(outcome, Outcome::Refused(refusal) if !refusal.is_of_a_touch());
    assert!(!desk.outcomes.iter().any(is_refused), "loading continues after a power cut");
}

/// The place of the newest record, by its counter: postcard's first number.
fn newest(records: &[Vec<u8>; 2]) -> usize {
    let counter = |record: &Vec<u8>| {
        record[6..].iter().take(5).enumerate().try_fold(0_u64, |sum, (i, &byte)| {
            let sum = sum | u64::from(byte & 0x7f) << (7 * i);
            if byte & 0x80 == 0 { Err(sum) } else { Ok(sum) }
        })
    };
    let [even, odd] = records.each_ref().map(|record| counter(record).unwrap_err());
    usize::from(odd > even)
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
    let Chip { built_in, models: [a, b], records: [c, d] } = &mut chip;
    let mut desk = Desk::new(touches.iter().map(push), 0);
    let mut uart = Uart::new(&mut desk, loses, errs);
    serve::<OBJECTS, _, _>(built_in, &mut Memory { models: [a, b], records: [c, d] }, 0, &mut uart).unwrap();
    let calls = [uart.reads, uart.writes];
    assert_eq!(desk.outcomes, expected(&bytes, touches));
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
fn a_uart_that_only_errs_ends_the_program_and_its_storage_serves_on_over_another() {
    let (bytes, touches) = (model(1), touches(20));
    let mut chip = Chip::new(bytes.clone());
    let Chip { built_in, models: [a, b], records: [c, d] } = &mut chip;
    let mut storage = Memory { models: [a, b], records: [c, d] };
    let mut desk = Desk::new(touches.iter().map(push), 0);
    let mut uart = Uart::new(&mut desk, true, |call| matches!(call, Call::Read(number) if number >= 500));
    let ended = serve::<OBJECTS, _, _>(built_in, &mut storage, 0, &mut uart);
    assert_eq!((ended, uart.reads), (Err(ServeError::Transport(GARBLED)), 500 + u32::from(ERRORS_IN_A_ROW)));
    let before = desk.outcomes.len();
    assert!((1..touches.len()).contains(&before), "{before}");
    let mut uart = Uart::new(&mut desk, true, |_| false);
    assert_eq!(serve::<OBJECTS, _, _>(built_in, &mut storage, 0, &mut uart), Ok(()));
    assert_eq!(desk.outcomes, expected(&bytes, &touches));
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
    let message = Message::Query { tag: 1, query: Query::Hello };
    let frame = encode(&Frame { session: 1, message }, &mut [0; FRAME_MAX]).to_vec();
    let mut uart = Mute { frame, writes: 0 };
    let ended = serve::<OBJECTS, _, _>(&[], &mut NoStorage, 0, &mut uart);
    assert_eq!((ended, uart.writes), (Err(ServeError::Transport(GARBLED)), u32::from(ERRORS_IN_A_ROW)));
}

/// A wire whose read is an error before every byte, and that is ready.
#[derive(Default)]
struct Wire {
    bytes: std::collections::VecDeque<u8>,
    written: Vec<u8>,
    is_garbled: bool,
}

impl ErrorType for Wire {
    type Error = ErrorKind;
}

impl Read for Wire {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        self.is_garbled = !self.is_garbled;
        if self.is_garbled {
            return Err(GARBLED);
        }
        let byte = self.bytes.pop_front();
        byte.into_iter().zip(buffer).for_each(|(from, to)| *to = from);
        Ok(usize::from(byte.is_some()))
    }
}

impl embedded_io::ReadReady for Wire {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.bytes.is_empty())
    }
}

impl Write for Wire {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, ErrorKind> {
        self.written.extend(buffer);
        Ok(buffer.len())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

#[test]
fn both_ends_of_the_link_go_on_after_an_error_before_every_byte() {
    let (mut host, mut end) = (HostEnd::new(HostSettings::default()), DeviceEnd::new(Progress::NONE, 1));
    let bytes = model(1);
    let model = palpate_onboard::Model::new(&bytes).unwrap();
    let mut station = Station::<OBJECTS>::new(&model);
    let (mut to_chip, mut to_host) = (Wire::default(), Wire::default());
    host.connect(1, 0, |frame| to_chip.bytes.extend(frame));
    let (mut opened, mut errors) = (false, 0);
    for now in 0..1_000 {
        while !to_chip.bytes.is_empty() {
            errors += u32::from(end.serve(&mut to_chip, &mut station).is_err());
        }
        to_host.bytes.extend(to_chip.written.drain(..));
        match host.exchange(&mut to_host, now, |incoming| opened |= matches!(incoming, Incoming::Opened)) {
            Ok(ticked) => ticked.unwrap(),
            Err(_) => errors += 1,
        }
        to_chip.bytes.extend(to_host.written.drain(..));
    }
    assert!(opened && errors > 50, "{opened}, {errors} errors");
}

#[test]
fn a_loaded_model_of_more_objects_than_the_next_program_has_room_for_falls_back_to_the_built_in_one() {
    let shape = Shape { thresholds: 40, leaf: 0.3, ..Shape::SMALL };
    let small = compile(&random::ensemble(shape, 1), &Settings::default()).unwrap().bytes;
    let mut chip = Chip::new(small.clone());
    let mut desk = Desk::new(load(model(1).leak(), Payload::Model), 0);
    chip.run(&mut desk).unwrap();
    assert_eq!(desk.outcomes.last(), Some(&Outcome::Done));
    let touches = touches(3);
    let Chip { built_in, models: [a, b], records: [c, d] } = &mut chip;
    let mut desk = Desk::new(touches.iter().map(push), 0);
    serve::<4, _, _>(built_in, &mut Memory { models: [a, b], records: [c, d] }, 0, &mut desk).unwrap();
    assert_eq!(desk.outcomes, expected(&small, &touches));
}
