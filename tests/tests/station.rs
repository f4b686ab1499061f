//! A chip's whole program at the end of a link: its verdicts are those of a recognizer, through loading,
//! power cuts and torn records.

use embedded_io::{ErrorKind, ErrorType, Read, Write};
use palpate::compile::{Leaf, Settings, compile};
use palpate_onboard::station::{Memory, ServeError, serve};
use palpate_onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use palpate_shared::format::{Counted, Trained, TrainedTouches};
use palpate_shared::link::{
    CHUNK, Command, Decision, Decoder, Detail, HostEnd, HostSettings, Incoming, LinkError, Message, Outcome, Payload,
    Query, Refusal, checksum,
};
use palpate_shared::{ContactTime, Descriptor, Patterns, Pose, Touch};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::trained;
use rand::rngs::ChaCha8Rng;
use rand::{Rng, RngExt, SeedableRng};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU32, Ordering};

const OBJECTS: usize = 16;

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
};

fn model(seed: u64) -> Vec<u8> {
    let shape = Shape {
        descriptor: Descriptor::Curvature,
        objects: 10,
        trees: 10,
        depth: 4,
        each: true,
        thresholds: 100,
        leaf: 0.05,
    };
    let settings = Settings { leaf: Leaf::I16, ..Settings::default() };
    trained(&compile(&random::ensemble(shape, seed), &settings).unwrap().bytes, &CONTACTS)
}

/// A chip's memory, which outlasts its program.
struct Chip {
    built_in: Vec<u8>,
    models: [Vec<u8>; 2],
    records: [Vec<u8>; 2],
}

impl Chip {
    fn new(built_in: Vec<u8>) -> Self {
        let record = vec![0xff; Memory::record_length(OBJECTS)];
        Self { built_in, models: [vec![0; 20_000], vec![0; 20_000]], records: [record.clone(), record] }
    }

    fn run(&mut self, desk: &mut Desk) -> Result<(), PowerCut> {
        let Self { built_in, models: [a, b], records: [c, d] } = self;
        match serve::<OBJECTS, _>(Memory { built_in, models: [a, b], records: [c, d] }, 0, desk) {
            Ok(()) => Ok(()),
            Err(ServeError::Transport(cut)) => Err(cut),
            Err(error) => panic!("{error}"),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct PowerCut;

impl core::fmt::Display for PowerCut {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("power cut")
    }
}

impl core::error::Error for PowerCut {}

impl embedded_io::Error for PowerCut {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// Something for the host to say.
#[derive(Clone, Debug)]
enum Step {
    Do(Command<'static>),
    Ask(Query),
}

/// The host with its script, as the chip's transport: what the chip reads is what the host has to say. One thread.
struct Desk {
    host: HostEnd,
    script: VecDeque<Step>,
    to_chip: VecDeque<u8>,
    outcomes: Vec<Outcome>,
    answers: Vec<String>,
    open: bool,
    now: u64,
    rng: ChaCha8Rng,
    /// Writes per power cut, on average; 0 for no cuts.
    cut_every: u32,
    /// The outcome of the last executed command had not been sent when the power was cut.
    untold: bool,
    newest: Option<u32>,
    /// The session may end, and how it did.
    may_fail: bool,
    failed: Option<LinkError>,
}

impl Desk {
    fn new(script: impl IntoIterator<Item = Step>, cut_every: u32) -> Self {
        let mut desk = Self {
            host: HostEnd::new(HostSettings { retry: 1_000, attempts: 1_000 }),
            script: script.into_iter().collect(),
            to_chip: VecDeque::new(),
            outcomes: Vec::new(),
            answers: Vec::new(),
            open: false,
            now: 0,
            rng: ChaCha8Rng::seed_from_u64(1),
            cut_every,
            untold: false,
            newest: None,
            may_fail: false,
            failed: None,
        };
        // Another host each time.
        static SESSIONS: AtomicU32 = AtomicU32::new(1);
        let session = SESSIONS.fetch_add(1, Ordering::Relaxed);
        let Self { host, to_chip, .. } = &mut desk;
        host.connect(session, 0, |bytes| to_chip.extend(bytes));
        desk
    }

    fn talk(&mut self) {
        let Self { host, script, to_chip, now, .. } = self;
        while let Some(step) = script.front() {
            let said = match step {
                Step::Do(command) => host.submit(command.clone(), *now, |bytes| to_chip.extend(bytes)).is_some(),
                Step::Ask(query) => host.is_idle() && host.ask(*query, *now, |bytes| to_chip.extend(bytes)),
            };
            if !said {
                break;
            }
            script.pop_front();
        }
    }

    fn is_done(&self) -> bool {
        self.open && self.script.is_empty() && self.host.is_idle()
    }
}

impl ErrorType for Desk {
    type Error = PowerCut;
}

impl Read for Desk {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, PowerCut> {
        for _ in 0..100_000 {
            self.talk();
            if self.is_done() {
                return Ok(0);
            }
            if !self.to_chip.is_empty() {
                let count = buffer.len().min(self.to_chip.len()).min(1 + self.rng.next_u32() as usize % 40);
                buffer[..count].iter_mut().for_each(|byte| *byte = self.to_chip.pop_front().unwrap());
                return Ok(count);
            }
            self.now += 100;
            let Self { host, to_chip, now, .. } = self;
            if let Err(error) = host.tick(*now, |bytes| to_chip.extend(bytes)) {
                assert!(self.may_fail, "{error}");
                self.failed = Some(error);
                return Ok(0);
            }
        }
        panic!("the script does not end: {:?}", self.host.statistics());
    }
}

impl Write for Desk {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, PowerCut> {
        let mut decoder = Decoder::new();
        let outcome = buffer.iter().find_map(|&byte| match decoder.feed(byte) {
            Some(Ok(frame)) => match frame.message {
                Message::Outcome { sequence, .. } => Some(sequence),
                _ => None,
            },
            _ => None,
        });
        let news = outcome.filter(|&sequence| self.newest.is_none_or(|newest| sequence > newest));
        if self.cut_every > 0 && self.rng.random_ratio(1, self.cut_every) {
            self.untold = news.is_some();
            // What was on the line is gone; what is in the host is not.
            self.to_chip.clear();
            return Err(PowerCut);
        }
        self.newest = news.or(self.newest);
        let Self { host, to_chip, outcomes, answers, open, now, .. } = self;
        host.receive(
            buffer,
            *now,
            |bytes| to_chip.extend(bytes),
            |incoming| match incoming {
                Incoming::Opened => *open = true,
                Incoming::Outcome { outcome, .. } => outcomes.push(outcome),
                Incoming::Answer(answer) => answers.push(format!("{answer:?}")),
                Incoming::Event { .. } => {}
            },
        );
        Ok(buffer.len())
    }

    fn flush(&mut self) -> Result<(), PowerCut> {
        Ok(())
    }
}

fn touches(count: usize) -> Vec<Touch> {
    random::touches(count, 3)
}

fn push(touch: &Touch) -> Step {
    Step::Do(Command::Touch { touch: touch.into(), detail: true })
}

fn load(bytes: &'static [u8], payload: Payload) -> Vec<Step> {
    let begin = Command::Begin { payload, length: bytes.len() as u32, checksum: checksum(bytes) };
    let mut steps = vec![Step::Do(begin)];
    for (i, bytes) in bytes.chunks(CHUNK).enumerate() {
        steps.push(Step::Do(Command::Chunk { offset: (i * CHUNK) as u32, bytes }));
    }
    steps.push(Step::Do(Command::Commit));
    steps
}

/// What a recognizer says to these touches.
fn expected(bytes: &[u8], touches: &[Touch]) -> Vec<Outcome> {
    let model = Model::new(bytes).unwrap();
    let mut recognizer = Recognizer::<OBJECTS>::new(&model, Stopping::from_model(&model)).unwrap();
    let verdict = |touch| {
        let decision = match recognizer.push(touch) {
            Ok(Verdict::Undecided) => Decision::Undecided,
            Ok(Verdict::Recognized { object, .. }) => Decision::Recognized(object),
            Ok(Verdict::Unknown) => Decision::Unknown,
            Err(Refused::Pattern(_)) => return Outcome::Refused(Refusal::Pattern),
            Err(Refused::Spread) => return Outcome::Refused(Refusal::Spread),
            Err(refused) => panic!("{refused}"),
        };
        let best = recognizer.best();
        let detail = Some(Detail::new(recognizer.posterior(best).q56(), recognizer.evidence()));
        let touches = recognizer.touches();
        Outcome::Verdict(palpate_shared::link::VerdictMessage { decision, best: best as u8, touches, detail })
    };
    touches.iter().map(verdict).collect()
}

/// Outcomes of touches, counted or not.
fn answers_to_touches(desk: &Desk) -> Vec<Outcome> {
    let is_answer = |outcome: &&Outcome| match outcome {
        Outcome::Verdict(_) => true,
        Outcome::Refused(refusal) => refusal.is_of_a_touch(),
        _ => false,
    };
    desk.outcomes.iter().filter(is_answer).copied().collect()
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
fn verdicts_posteriors_and_evidence_are_those_of_a_recognizer() {
    let touches = touches(300);
    let bytes = model(1);
    let mut desk = Desk::new(touches.iter().map(push), 0);
    Chip::new(bytes.clone()).run(&mut desk).unwrap();
    assert_eq!(desk.outcomes, expected(&bytes, &touches));
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
    chip.records[1].truncate(Memory::record_length(8));
    let mut desk = Desk::new(touches(3).iter().map(push), 0);
    let Chip { built_in, models: [a, b], records: [c, d] } = &mut chip;
    let memory = Memory { built_in, models: [a, b], records: [c, d] };
    let (needed, found) = (Memory::record_length(OBJECTS), Memory::record_length(8));
    assert_eq!(serve::<OBJECTS, _>(memory, 0, &mut desk), Err(ServeError::Records { needed, found }));
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
