mod state_machine;

use super::*;
use crate::{Approach, ContactTime, Pose, TablePose, Touch};
use proptest::prelude::*;
use rand::rngs::ChaCha8Rng;
use rand::{Rng, RngExt, SeedableRng};
use state_machine::{approach, place};
use std::collections::VecDeque;
use std::{vec, vec::Vec};

fn touch(number: u32) -> Touch {
    let touch = Touch::new([
        ContactTime::FIRST,
        ContactTime::from_micros(number),
        if number.is_multiple_of(7) { ContactTime::MISSING } else { ContactTime::from_micros(2 * number) },
    ]);
    match number % 3 {
        0 => touch,
        _ => touch.with_pose(Pose { direction: [-1, i16::MIN, i16::MAX], alignment: [256, 0, -32767] }),
    }
}

const FAULT: Event = Event::Fault { kind: FaultKind::Bouncing, finger: 2 };

const NAMES: [&str; 8] = ["bowl", "wristwatch", "c", "d", "e", "f", "g", "h"];

/// The number of a touch.
fn number_of(touch: &Touch) -> u32 {
    touch.times()[1].micros().expect("a number")
}

/// The command of the touch with this number; every other one asks for details.
fn command(number: u32) -> Command<'static> {
    Command::Touch { touch: (&touch(number)).into(), detail: number.is_multiple_of(2) }
}

/// A chip that records every command; a verdict has the number of its touch.
#[derive(Default)]
struct Notebook {
    touches: Vec<Touch>,
    staged: Vec<u8>,
    announced: (u32, u32),
    model: Vec<u8>,
}

impl Device for Notebook {
    fn touch(&mut self, touch: &Touch, detail: bool) -> Outcome {
        self.touches.push(*touch);
        let touches = number_of(touch);
        let detail = detail.then(|| Detail::new(u64::from(touches) << 40, &[-1, i64::MAX]));
        Outcome::Verdict(VerdictMessage { decision: Decision::Undecided, best: 3, touches, detail })
    }

    fn press(&mut self, touch: &Touch, position: [i32; 3], detail: bool) -> Outcome {
        assert_eq!(position, [number_of(touch).cast_signed(), i32::MIN, -1]);
        self.touch(touch, detail)
    }

    fn reset(&mut self) -> Outcome {
        self.touches.clear();
        Outcome::Done
    }

    fn begin(&mut self, length: u32, checksum: u32) -> Outcome {
        self.announced = (length, checksum);
        self.staged.clear();
        Outcome::Done
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Outcome {
        if offset as usize != self.staged.len() {
            return Outcome::Refused(Refusal::OutOfOrder);
        }
        self.staged.extend_from_slice(bytes);
        Outcome::Done
    }

    fn commit(&mut self) -> Outcome {
        let checksum = crate::format::checksum(&self.staged);
        if (self.staged.len() as u32, checksum) != self.announced {
            return Outcome::Refused(Refusal::Checksum);
        }
        self.model = self.staged.clone();
        Outcome::Done
    }

    fn model(&self) -> Option<ModelInfo> {
        let length = self.model.len() as u32;
        (length > 0).then_some(ModelInfo { checksum: self.announced.1, length, last_object: 9, descriptor: 1 })
    }

    fn name(&self, object: u8) -> Option<&str> {
        NAMES.get(usize::from(object)).copied()
    }

    fn program(&self) -> &str {
        "notebook 1.0"
    }

    fn posterior(&self, object: u8) -> Option<u64> {
        (object < 20).then_some(u64::from(object) << 50)
    }

    fn next_approach(&self, without: &[u8; POSE_BYTES]) -> Result<ApproachMessage, Refusal> {
        Ok(approach(without[0]))
    }

    fn place(&mut self, rank: u8) -> Result<(bool, Option<TablePose>), Refusal> {
        Ok((rank >= 4, Some(place(rank))))
    }

    fn next_press(&mut self, within: Option<u32>) -> Result<Approach, Refusal> {
        Ok(Approach { x: within.map_or(-1, u32::cast_signed), y: i32::MIN, roll: 255 })
    }
}

/// Faults of a line; probabilities are for a byte, or for a frame.
#[derive(Clone, Copy, Debug)]
struct Faults {
    byte_lost: f64,
    byte_changed: f64,
    frame_lost: f64,
    frame_doubled: f64,
    /// At most this many microseconds; frames may overtake each other.
    delay: u64,
}

const CLEAN: Faults = Faults { byte_lost: 0.0, byte_changed: 0.0, frame_lost: 0.0, frame_doubled: 0.0, delay: 0 };

/// One direction of a line: the bytes sent, and their time of arrival.
struct Line {
    faults: Faults,
    rng: ChaCha8Rng,
    under_way: VecDeque<(u64, Vec<u8>)>,
}

impl Line {
    fn new(faults: Faults, seed: u64) -> Self {
        Self { faults, rng: ChaCha8Rng::seed_from_u64(seed), under_way: VecDeque::new() }
    }

    fn send(&mut self, frame: &[u8], now: u64) {
        let Faults { byte_lost, byte_changed, frame_lost, frame_doubled, delay } = self.faults;
        let rng = &mut self.rng;
        for _ in 0..if rng.random_bool(frame_doubled) { 2 } else { 1 } {
            if rng.random_bool(frame_lost) {
                continue;
            }
            let mut bytes = frame.to_vec();
            bytes.retain(|_| !rng.random_bool(byte_lost));
            for byte in &mut bytes {
                if rng.random_bool(byte_changed) {
                    *byte ^= 1 << rng.random_range(0..8);
                }
            }
            self.under_way.push_back((now + rng.random_range(0..=delay), bytes));
        }
    }

    /// Portions that have arrived, split anywhere.
    fn arrived(&mut self, now: u64) -> Vec<Vec<u8>> {
        let (arrived, rest): (Vec<_>, Vec<_>) = self.under_way.drain(..).partition(|(at, _)| *at <= now);
        self.under_way = rest.into();
        let mut portions = Vec::new();
        for (_, bytes) in arrived {
            let at = self.rng.next_u32() as usize % (bytes.len() + 1);
            let (left, right) = bytes.split_at(at);
            portions.extend([left.to_vec(), right.to_vec()]);
        }
        portions
    }
}

/// Both ends and the lines between them.
struct Rig {
    host: HostEnd,
    chip: DeviceEnd,
    notebook: Notebook,
    down: Line,
    up: Line,
    now: u64,
    outcomes: Vec<(u32, Outcome)>,
    answers: Vec<std::string::String>,
    events: Vec<(Event, u32)>,
    opened: bool,
}

impl Rig {
    fn new(faults: Faults, seed: u64) -> Self {
        Self::with_attempts(1_000, faults, seed)
    }

    fn with_attempts(attempts: u32, faults: Faults, seed: u64) -> Self {
        let mut rig = Self {
            host: HostEnd::new(HostSettings { retry: 20_000, attempts }),
            chip: DeviceEnd::new(1),
            notebook: Notebook::default(),
            down: Line::new(faults, seed),
            up: Line::new(faults, seed ^ 0x5555),
            now: 0,
            outcomes: Vec::new(),
            answers: Vec::new(),
            events: Vec::new(),
            opened: false,
        };
        rig.connect(1);
        rig
    }

    fn connect(&mut self, session: u32) {
        let now = self.now;
        self.opened = false;
        self.host.connect(session, now, |frame| self.down.send(frame, now));
        self.until(|rig| rig.opened);
    }

    fn step(&mut self) -> Result<(), LinkError> {
        let Self { host, chip, notebook, down, up, now, outcomes, answers, events, opened, .. } = self;
        *now += 1_000;
        for bytes in down.arrived(*now) {
            chip.receive(&bytes, notebook, |frame| up.send(frame, *now));
        }
        for bytes in up.arrived(*now) {
            host.receive(
                &bytes,
                *now,
                |frame| down.send(frame, *now),
                |incoming| match incoming {
                    Incoming::Opened => *opened = true,
                    Incoming::Outcome { sequence, outcome } => outcomes.push((sequence, outcome)),
                    Incoming::Answer(answer) => answers.push(std::format!("{answer:?}")),
                    Incoming::Event { event, missed, .. } => events.push((event, missed)),
                },
            );
        }
        host.tick(*now, |frame| down.send(frame, *now))
    }

    fn until(&mut self, done: impl Fn(&Self) -> bool) {
        for _ in 0..2_000_000 {
            if done(self) {
                return;
            }
            self.step().unwrap();
        }
        panic!("no end: {:?} {:?}", self.host.statistics(), self.chip.statistics());
    }

    /// The error that ends the session.
    fn ended(&mut self) -> LinkError {
        (0..10_000).find_map(|_| self.step().err()).unwrap()
    }

    /// Lets the chip report an event whose frame arrives as often as `copies` says; returns that frame.
    fn tell(&mut self, event: Event, copies: usize) -> Vec<u8> {
        let (up, now, mut told) = (&mut self.up, self.now, Vec::new());
        self.chip.tell(event, |frame| {
            (0..copies).for_each(|_| up.send(frame, now));
            told.extend_from_slice(frame);
        });
        self.step().unwrap();
        told
    }

    /// Missed and repeated events.
    fn missed_and_repeated(&self) -> (u64, u64) {
        let statistics = self.host.statistics();
        (statistics.missed_events, statistics.repeated)
    }

    /// Gives a command as soon as there is room.
    fn command(&mut self, command: Command<'_>) {
        self.until(|rig| rig.host.has_room());
        let now = self.now;
        self.host.submit(command, now, |frame| self.down.send(frame, now)).unwrap();
    }

    fn ask(&mut self, query: Query) -> std::string::String {
        self.until(|rig| rig.host.can_ask());
        let now = self.now;
        assert!(self.host.ask(query, now, |frame| self.down.send(frame, now)));
        let count = self.answers.len();
        self.until(|rig| rig.answers.len() > count);
        self.answers.pop().unwrap()
    }

    fn send_touches(&mut self, numbers: core::ops::Range<u32>) {
        for number in numbers {
            self.command(command(number));
        }
        self.until(|rig| rig.host.is_idle());
    }

    /// Every touch was counted once, in order, and every outcome came once, in order, and is the right one.
    fn assert_exactly_once(&self, count: u32) {
        assert_eq!(self.notebook.touches, (0..count).map(touch).collect::<Vec<_>>());
        assert_eq!(self.outcomes.len(), count as usize);
        for (expected, (sequence, outcome)) in self.outcomes.iter().enumerate() {
            let Outcome::Verdict(verdict) = outcome else { panic!("{outcome:?}") };
            assert_eq!((*sequence as usize, verdict.touches as usize), (expected, expected));
            assert_eq!(verdict.detail.is_some(), expected % 2 == 0);
        }
    }
}

#[test]
fn a_clean_line_repeats_nothing() {
    let mut rig = Rig::new(CLEAN, 1);
    rig.send_touches(0..1_000);
    rig.assert_exactly_once(1_000);
    let (host, chip) = (rig.host.statistics(), rig.chip.statistics());
    assert_eq!((host.resent, host.garbled, host.repeated, host.early), (0, 0, 0, 0));
    assert_eq!((chip.garbled, chip.repeated, chip.early, chip.foreign), (0, 0, 0, 0));
    assert_eq!((host.sent, host.received), (1_002, 1_002));
}

#[test]
fn ten_thousand_touches_arrive_exactly_once_over_a_bad_line_with_the_default_number_of_attempts() {
    let faults = Faults { byte_lost: 0.001, byte_changed: 0.001, frame_lost: 0.15, frame_doubled: 0.1, delay: 40_000 };
    let mut rig = Rig::with_attempts(HostSettings::default().attempts, faults, 7);
    rig.send_touches(0..10_000);
    rig.assert_exactly_once(10_000);
    let (host, chip) = (rig.host.statistics(), rig.chip.statistics());
    assert!(host.resent > 100 && host.garbled > 100 && host.repeated > 100, "{host:?}");
    assert!(chip.garbled > 100 && chip.repeated > 100 && chip.early > 100, "{chip:?}");
}

#[test]
fn a_model_arrives_whole_over_a_bad_line_and_a_wrong_one_leaves_the_old() {
    let faults = Faults { byte_changed: 0.002, frame_lost: 0.05, frame_doubled: 0.05, delay: 5_000, ..CLEAN };
    let mut rig = Rig::new(faults, 3);
    let model: Vec<u8> = (0..5_000_u32).map(|i| ((i * i) >> 3) as u8).collect();
    let checksum = crate::format::checksum(&model);
    let load = |rig: &mut Rig, checksum| {
        let length = model.len() as u32;
        rig.command(Command::Begin { length, checksum });
        for (i, bytes) in model.chunks(CHUNK).enumerate() {
            rig.command(Command::Chunk { offset: (i * CHUNK) as u32, bytes });
        }
        rig.command(Command::Commit);
        rig.until(|rig| rig.host.is_idle());
        rig.outcomes.last().unwrap().1
    };
    assert_eq!(load(&mut rig, checksum), Outcome::Done);
    assert_eq!(rig.notebook.model, model);
    assert_eq!(load(&mut rig, checksum ^ 1), Outcome::Refused(Refusal::Checksum));
    assert_eq!(rig.notebook.model, model);
}

#[test]
fn questions_are_answered_between_commands() {
    let mut rig = Rig::new(CLEAN, 1);
    assert_eq!(rig.ask(Query::Model), "Refused(NoModel)");
    assert_eq!(rig.ask(Query::Name { object: 1 }), "Name(\"wristwatch\")");
    assert_eq!(rig.ask(Query::Name { object: 8 }), "Refused(NoObject)");
    rig.command(command(0));
    assert!(rig.ask(Query::Statistics).contains("frames: 7"));
    assert_eq!(rig.ask(Query::Posteriors { first: 20 }), "Posteriors([])");
    let posteriors = rig.ask(Query::Posteriors { first: 10 });
    assert_eq!(posteriors.matches(',').count(), 10 * 8 - 1);
    rig.command(Command::Reset);
    rig.until(|rig| rig.host.is_idle());
    assert_eq!(rig.outcomes.last().unwrap(), &(1, Outcome::Done));
    assert!(rig.notebook.touches.is_empty());
}

#[test]
fn a_chip_says_which_program_it_runs_and_a_question_that_an_older_one_does_not_answer_is_given_up() {
    let mut rig = Rig::new(CLEAN, 1);
    assert_eq!(rig.ask(Query::Program), "Program(\"notebook 1.0\")");
    // Nothing arrives: as with a chip that does not know the question.
    rig.host.ask(Query::Program, rig.now, |_| ());
    assert!(!rig.host.can_ask());
    rig.host.withdraw();
    assert_eq!(rig.ask(Query::Name { object: 0 }), "Name(\"bowl\")");
    // Its answer is late: it is not taken for that to another question.
    rig.host.ask(Query::Program, rig.now, |frame| rig.down.send(frame, rig.now));
    rig.host.withdraw();
    assert_eq!(rig.ask(Query::Name { object: 1 }), "Name(\"wristwatch\")");
    assert!(rig.answers.is_empty());
}

#[test]
fn events_while_the_cable_was_out_are_missed_and_those_before_are_not_taken_twice() {
    let mut rig = Rig::new(CLEAN, 1);
    let event = |finger: u8| Event::Fault { kind: FaultKind::Stuck, finger };
    let frames = [0, 1, 2, 3].map(|index| rig.tell(event(index), 0));
    rig.up.send(&frames[0], rig.now);
    rig.until(|rig| rig.events.len() == 1);
    // Out, with half of a frame, and in again: a session of the same end, so that it knows what it has heard.
    rig.up.send(&frames[1][..frames[1].len() / 2], rig.now);
    (0..5).for_each(|_| rig.step().unwrap());
    rig.up.send(&frames[0], rig.now);
    rig.connect(2);
    rig.up.send(&frames[3], rig.now);
    rig.until(|rig| rig.events.len() == 2);
    assert_eq!(rig.events, [(event(0), 0), (event(3), 2)]);
    assert_eq!(rig.host.statistics().missed_events, 2);
}

#[test]
fn a_host_that_repeats_what_a_reset_chip_was_told_counts_nothing_twice_and_hears_that_all_is_gone() {
    let faults = Faults { frame_lost: 0.02, frame_doubled: 0.1, byte_changed: 0.001, delay: 4_000, ..CLEAN };
    for seed in 0..200 {
        let mut rig = Rig::new(faults, seed);
        rig.send_touches(0..5);
        let given = 5 + seed as u32 % 4;
        (5..given).for_each(|number| rig.command(command(number)));
        rig.step().unwrap();
        let counted = rig.notebook.touches.len();
        // What was on its way stays there, and may arrive after the reset.
        rig.chip = DeviceEnd::new(scattered(seed));
        let (up, now) = (&mut rig.up, rig.now);
        rig.chip.start(|frame| up.send(frame, now));
        rig.command(command(given));
        let LinkError::Forgotten { answered, uncertain } = rig.ended() else { panic!("silent") };
        assert_eq!((answered as usize, answered + uncertain), (rig.outcomes.len(), given + 1));
        assert_eq!(rig.notebook.touches.len(), counted, "nothing of the session before counts after the reset");
    }
}

/// A boot number.
fn scattered(number: u64) -> u32 {
    (number as u32).wrapping_mul(0x9e37_79b1) ^ 0x5bd1_e995
}

/// The chip's session.
fn session_of(chip: &mut DeviceEnd) -> u32 {
    let mut session = 0;
    chip.tell(FAULT, |frame| {
        decode(frame, |frame| session = frame.unwrap().session);
    });
    session
}

#[test]
fn a_chip_that_forgot_the_session_is_reported_with_the_touches_lost() {
    let mut rig = Rig::new(CLEAN, 1);
    rig.send_touches(0..5);
    rig.chip = DeviceEnd::new(2);
    rig.notebook = Notebook::default();
    rig.command(command(5));
    assert_eq!(rig.ended(), LinkError::Forgotten { answered: 5, uncertain: 1 });
    assert!(rig.notebook.touches.is_empty(), "nothing of an old session is counted in a new one");
}

#[test]
fn a_silent_chip_is_reported_with_the_touches_in_doubt() {
    let mut rig = Rig::with_attempts(5, CLEAN, 1);
    rig.send_touches(0..4);
    rig.down.faults.frame_lost = 1.0;
    (4..7).for_each(|number| rig.command(command(number)));
    assert_eq!(rig.ended(), LinkError::Silent { answered: 4, uncertain: 3 });
}

#[test]
fn a_second_host_opens_a_session_of_its_own_and_late_copies_open_none() {
    let mut rig = Rig::new(CLEAN, 1);
    rig.send_touches(0..3);
    let old_opening = framed(1, Message::Query { tag: 9, query: Query::Open { previous: 0, boot: 1 } });
    rig.connect(2);
    rig.send_touches(3..5);
    assert_eq!((session_of(&mut rig.chip), rig.chip.executed()), (2, 2));
    rig.chip.receive(&old_opening, &mut rig.notebook, |_| ());
    assert_eq!((session_of(&mut rig.chip), rig.chip.executed()), (2, 2));
}

#[test]
fn a_chip_that_starts_again_loses_no_event_although_its_announcement_was_lost() {
    let mut rig = Rig::new(CLEAN, 1);
    rig.tell(Event::Started, 1);
    let late = (1..50).map(|_| rig.tell(FAULT, 1)).last().unwrap();
    assert_eq!(rig.events.len(), 50);
    // After the reset Started and the first fault are lost.
    rig.chip = DeviceEnd::new(2);
    rig.tell(Event::Started, 0);
    rig.tell(FAULT, 0);
    for _ in 0..49 {
        rig.tell(FAULT, 1);
    }
    assert_eq!(rig.events.len(), 99, "nothing counts as repeated");
    assert_eq!(rig.events[50], (FAULT, 2));
    assert!(rig.events[51..].iter().all(|event| *event == (FAULT, 0)));
    assert_eq!(rig.missed_and_repeated(), (2, 0));
    // A late copy from before the reset is neither new nor a loss.
    rig.up.send(&late, rig.now);
    rig.step().unwrap();
    assert_eq!((rig.events.len(), rig.missed_and_repeated()), (99, (2, 1)));
}

/// The frames with which a chip answers some bytes.
fn answers(chip: &mut DeviceEnd, notebook: &mut Notebook, bytes: &[u8]) -> Vec<u8> {
    let mut answers = Vec::new();
    chip.receive(bytes, notebook, |frame| answers.extend_from_slice(frame));
    answers
}

/// Lets a host and a chip talk without delay, and returns the number of outcomes that the host took.
fn talk(host: &mut HostEnd, sent: &mut Vec<u8>, chip: &mut DeviceEnd, notebook: &mut Notebook) -> usize {
    let mut outcomes = 0;
    while !sent.is_empty() {
        let answers = answers(chip, notebook, &std::mem::take(sent));
        let count = |incoming: Incoming<'_>| outcomes += usize::from(matches!(incoming, Incoming::Outcome { .. }));
        host.receive(&answers, 0, |frame| sent.extend_from_slice(frame), count);
    }
    outcomes
}

#[test]
fn two_hosts_that_saw_the_same_session_do_not_take_each_others_outcomes() {
    let (mut chip, mut notebook) = (DeviceEnd::new(1), Notebook::default());
    // Both ask for the current session before either opens its own.
    let mut hosts = [0x1234_5678, 0x9abc_def0].map(|session| {
        let mut host = HostEnd::new(HostSettings::default());
        let mut sent = Vec::new();
        host.connect(session, 0, |frame| sent.extend_from_slice(frame));
        let answers = answers(&mut chip, &mut notebook, &std::mem::take(&mut sent));
        host.receive(&answers, 0, |frame| sent.extend_from_slice(frame), |_| ());
        (host, sent)
    });
    for (host, sent) in &mut hosts {
        talk(host, sent, &mut chip, &mut notebook);
        assert!(host.is_idle());
    }
    // The second one's, under the number after that which it could not open.
    assert_eq!(session_of(&mut chip), 0x9abc_def0_u32.wrapping_add(0x9e37_79b9));
    for (number, (host, sent)) in hosts.iter_mut().enumerate() {
        host.submit(command(7), 0, |frame| sent.extend_from_slice(frame)).unwrap();
        assert_eq!(talk(host, sent, &mut chip, &mut notebook), number);
    }
    assert_eq!(notebook.touches.len(), 1);
    let error = hosts[0].0.tick(0, |_| ()).unwrap_err();
    assert_eq!(error, LinkError::Forgotten { answered: 0, uncertain: 1 });
}

#[test]
fn a_late_copy_of_an_opening_opens_nothing_on_a_chip_that_was_reset() {
    let bytes = framed(7, Message::Query { tag: 1, query: Query::Open { previous: 0, boot: 1 } });
    for (boot, session) in [(1, 7), (2, 0)] {
        let mut chip = DeviceEnd::new(boot);
        chip.receive(&bytes, &mut Notebook::default(), |_| ());
        assert_eq!(session_of(&mut chip), session);
    }
}

#[test]
fn a_decoder_says_what_was_no_frame_and_reads_on() {
    let good = framed(7, Message::Expected { sequence: 1 });
    // With a valid checksum.
    let newer = summed(vec![4, 7, 0, 0, 0, 4, 1]);
    for (bytes, error) in [(newer, FrameError::Version(4)), (vec![0xaa; 10_000], FrameError::TooLong)] {
        assert_eq!(decode(&[bytes, good.clone()].concat(), |frame| frame.map(drop)), [Err(error), Ok(())]);
    }
}

#[test]
fn golden_frames_pin_the_format() {
    let touch = Touch::from_micros([300, 0, 70_000]).with_pose(Pose { direction: [1, 2, 3], alignment: [-1, 0, 256] });
    let detail = Detail { posterior: [8, 7, 6, 5, 4, 3, 2, 1], evidence: [4, 3, 2, 1] };
    let verdict = VerdictMessage { decision: Decision::Recognized(4), best: 4, touches: 17, detail: Some(detail) };
    // Written out by hand, except the checksums: version, session, message, CRC-32, in COBS.
    let (mut without, down) = ([0; POSE_BYTES], Pose { direction: [0, 0, -32767], alignment: [32767, 0, 0] });
    (without[0], without[12]) = (255, 1);
    let pressed = Touch::new([ContactTime::FIRST, ContactTime::MISSING, ContactTime::from_micros(300)]).with_pose(down);
    let place = TablePose {
        placement: 3,
        position: [12_300, -4_100],
        yaw: 15_838,
        within: [900, 1_000],
        yaw_within: Some(546),
        share: 60_000,
    };
    let press = Approach { x: -1_000, y: 0, roll: 64 };
    // In micrometers: -12300, 4100, 25000.
    let position = [244, 207, 255, 255, 4, 16, 0, 0, 168, 97, 0, 0];
    let query = |query| Message::Query { tag: 5, query };
    let answer = |answer| Message::Answer { asker: 2, tag: 5, answer };
    let command = |command| Message::Command { sequence: 1, command };
    let outcome = |sequence, outcome| Message::Outcome { sequence, outcome };
    let frames: [(Message<'_>, &[u8]); 15] = [
        (
            command(Command::Touch { touch: (&touch).into(), detail: true }),
            &[3, 2, 1, 3, 172, 2, 6, 240, 162, 4, 1, 1, 2, 2, 2, 3, 3, 255, 255, 1, 1, 7, 1, 1, 150, 84, 55, 210, 0],
        ),
        (
            outcome(200, Outcome::Verdict(verdict)),
            &[26, 3, 200, 1, 1, 1, 4, 4, 17, 1, 8, 7, 6, 5, 4, 3, 2, 1, 4, 3, 2, 1, 206, 160, 192, 215, 0],
        ),
        (query(Query::Open { previous: 513, boot: 7 }), &[1, 10, 5, 1, 129, 4, 7, 213, 206, 51, 156, 0]),
        (answer(Answer::Name("spoon")), &[15, 1, 2, 5, 2, 5, 115, 112, 111, 111, 110, 220, 237, 239, 183, 0]),
        (
            query(Query::NextApproach { without }),
            &[1, 4, 5, 6, 255, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 6, 1, 233, 120, 120, 113, 0],
        ),
        (
            answer(Answer::NextApproach(ApproachMessage::new(48, -5, &down))),
            &[7, 1, 2, 5, 6, 48, 9, 1, 1, 1, 5, 1, 128, 255, 127, 1, 1, 1, 5, 217, 131, 97, 190, 0],
        ),
        (query(Query::Program), &[1, 7, 5, 7, 69, 168, 33, 159, 0]),
        (answer(Answer::Program("gpio 1")), &[16, 1, 2, 5, 7, 6, 103, 112, 105, 111, 32, 49, 134, 247, 208, 166, 0]),
        (
            command(Command::Press { touch: (&pressed).into(), position, detail: false }),
            &[
                4, 2, 1, 5, 9, 255, 255, 255, 255, 15, 172, 2, 1, 1, 1, 1, 5, 1, 128, 255, 127, 1, 1, 1, 7, 244, 207,
                255, 255, 4, 16, 1, 3, 168, 97, 1, 1, 5, 57, 156, 103, 80, 0,
            ],
        ),
        (query(Query::Place { rank: 1 }), &[1, 8, 5, 8, 1, 99, 87, 180, 36, 0]),
        (
            answer(Answer::Place { table_alone: false, place: Some(place) }),
            &[
                5, 1, 2, 5, 8, 24, 1, 3, 152, 192, 1, 135, 64, 222, 123, 132, 7, 232, 7, 1, 162, 4, 224, 212, 3, 254,
                182, 232, 164, 0,
            ],
        ),
        (query(Query::NextPress { within: Some(40_000) }), &[1, 11, 5, 10, 1, 192, 184, 2, 245, 144, 91, 165, 0]),
        (answer(Answer::NextPress(press)), &[7, 1, 2, 5, 9, 207, 15, 6, 64, 91, 174, 195, 11, 0]),
        (outcome(7, Outcome::Continue { offset: 4_096 }), &[10, 3, 7, 3, 128, 32, 64, 191, 151, 254, 0]),
        (outcome(7, Outcome::Refused(Refusal::NotAdmitted)), &[9, 3, 7, 2, 16, 155, 228, 218, 165, 0]),
    ];
    for (message, golden) in frames {
        // Version and session are the same in all.
        let golden = [&[0, 3, 3, 2, 1, 1], golden].concat();
        assert_eq!(framed(2, message), golden);
        assert_eq!(decode(&golden, |frame| frame.map(drop)), [Ok(())]);
    }
}

/// The bytes of a message's frame.
fn framed(session: u32, message: Message<'_>) -> Vec<u8> {
    encode(&Frame { session, message }, &mut [0; FRAME_MAX]).to_vec()
}

/// A frame of these bytes, with a right checksum.
fn summed(mut plain: Vec<u8>) -> Vec<u8> {
    let checksum = crate::format::checksum(&plain);
    plain.extend(checksum.to_le_bytes());
    let mut encoded = vec![0; 200];
    let length = cobs::encode(&plain, &mut encoded);
    encoded[..=length].to_vec()
}

/// Takes everything that a decoder makes of some bytes.
fn decode<T>(bytes: &[u8], mut take: impl FnMut(Result<Frame<'_>, FrameError>) -> T) -> Vec<T> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|&byte| decoder.feed(byte).map(&mut take)).collect()
}

#[test]
fn the_longest_messages_fit_into_a_frame() {
    let text = core::str::from_utf8(&[b'x'; CHUNK]).unwrap();
    let answer = |answer| Message::Answer { asker: u32::MAX, tag: 255, answer };
    let longest = [
        Message::Command { sequence: u32::MAX, command: Command::Chunk { offset: u32::MAX, bytes: &[0; CHUNK] } },
        answer(Answer::Posteriors(&[7; CHUNK])),
        answer(Answer::Program(text)),
    ];
    for message in longest {
        let frame = Frame { session: u32::MAX, message };
        let bytes = framed(frame.session, frame.message.clone());
        assert_eq!(decode(&bytes, |decoded| decoded == Ok(frame.clone())), [true]);
    }
    let too_long = Message::Command { sequence: 0, command: Command::Chunk { offset: 0, bytes: &[0; CHUNK + 40] } };
    assert!(framed(0, too_long).is_empty());
}

proptest! {
    #[test]
    fn touches_survive_the_journey(times: [u32; 3], pose: Option<([i16; 3], [i16; 3])>) {
        let touch = Touch::from_micros(times);
        let touch = match pose {
            Some((direction, alignment)) => touch.with_pose(Pose { direction, alignment }),
            None => touch,
        };
        prop_assert_eq!(Touch::from(&TouchMessage::from(&touch)), touch);
        let command = Command::Touch { touch: (&touch).into(), detail: true };
        let arrived = decode(&framed(7, Message::Command { sequence: 9, command }), |frame| match frame {
            Ok(Frame { message: Message::Command { command: Command::Touch { touch, .. }, .. }, .. }) => Touch::from(&touch),
            other => panic!("{other:?}"),
        });
        prop_assert_eq!(arrived, [touch]);
    }

    #[test]
    fn no_bytes_make_an_end_panic(
        messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..60), 1..20),
        noise in prop::collection::vec(prop_oneof![Just(0_u8), any::<u8>(), 0..8_u8], 0..600),
    ) {
        let mut host = HostEnd::new(HostSettings::default());
        host.connect(1, 0, |_| ());
        let mut chip = DeviceEnd::new(1);
        let mut notebook = Notebook::default();
        let count = messages.len();
        for message in messages {
            let frame = summed([vec![VERSION, 0, 0, 0, 0], message].concat());
            chip.receive(&frame, &mut notebook, |_| ());
            host.receive(&frame, 1, |_| (), |_| ());
        }
        // Each was counted once by either end, as a message or as none.
        prop_assert_eq!((chip.statistics().garbled + chip.statistics().frames) as usize, count);
        prop_assert_eq!((host.statistics().garbled + host.statistics().received) as usize, count);
        chip.receive(&noise, &mut notebook, |_| ());
        host.receive(&noise, 1, |_| (), |_| ());
    }
}

#[test]
fn late_events_of_an_earlier_start_are_not_counted_twice_and_do_not_confuse_the_count() {
    let mut rig = Rig::new(CLEAN, 1);
    let mut missed = Vec::new();
    // Two starts, and between the events of the last one late copies of the first one's.
    for (boot, sequence) in [(1, 0), (1, 1), (2, 0), (3, 0), (1, 1), (3, 1), (1, 3), (3, 2), (3, 2), (2, 2), (3, 4)] {
        let bytes = framed(1, Message::Event { boot, sequence, event: FAULT });
        rig.host.receive(
            &bytes,
            0,
            |_| (),
            |incoming| {
                let Incoming::Event { missed: before, .. } = incoming else { panic!("{incoming:?}") };
                missed.push((boot, sequence, before));
            },
        );
    }
    assert_eq!(
        missed,
        [(1, 0, 0), (1, 1, 0), (2, 0, 0), (3, 0, 0), (3, 1, 0), (1, 3, 1), (3, 2, 0), (2, 2, 1), (3, 4, 1)]
    );
    assert_eq!(rig.missed_and_repeated(), (3, 2));
}

#[test]
fn an_answer_to_another_hosts_question_is_not_taken_for_ones_own() {
    let mut rig = Rig::new(CLEAN, 1);
    let mut tag = 0;
    rig.host.ask(Query::Name { object: 1 }, 0, |frame| {
        decode(frame, |frame| {
            let Ok(Frame { message: Message::Query { tag: own, .. }, .. }) = frame else { panic!("{frame:?}") };
            tag = own;
        });
    });
    let mut answers = Vec::new();
    for (asker, name) in [(2, "bowl"), (1, "wristwatch")] {
        let bytes = framed(1, Message::Answer { asker, tag, answer: Answer::Name(name) });
        rig.host.receive(&bytes, 0, |_| (), |incoming| answers.push(std::format!("{incoming:?}")));
    }
    assert_eq!(answers, ["Answer(Name(\"wristwatch\"))"]);
}

#[test]
fn a_session_that_one_chip_may_have_opened_late_is_not_opened_on_another_under_the_same_number() {
    let mut host = HostEnd::new(HostSettings { retry: 20_000, attempts: 12 });
    let mut chips = [1, 2].map(|boot| (DeviceEnd::new(boot), Notebook::default()));
    let sent = core::cell::RefCell::new(Vec::new());
    let send = |frame: &[u8]| sent.borrow_mut().extend_from_slice(frame);
    let say = |(chip, notebook): &mut (DeviceEnd, Notebook), bytes: &[u8]| answers(chip, notebook, bytes);
    host.connect(7, 0, send);
    let answer = say(&mut chips[0], &sent.take());
    host.receive(&answer, 0, send, |_| ());
    // The first chip opens the session, and its answer is lost. The host is plugged into the other one and asks again.
    let opening = sent.take();
    say(&mut chips[0], &opening);
    assert_eq!(session_of(&mut chips[0].0), 7);
    let answer = say(&mut chips[1], &opening);
    host.receive(&answer, 0, send, |_| ());
    let answer = say(&mut chips[1], &sent.take());
    let mut opened = false;
    host.receive(&answer, 0, send, |incoming| opened = incoming == Incoming::Opened);
    assert!(opened);
    host.submit(command(0), 0, send).unwrap();
    let touch = sent.take();
    say(&mut chips[1], &touch);
    // The outcome is lost; the host is plugged back and repeats the touch.
    say(&mut chips[0], &touch);
    assert_eq!([chips[0].1.touches.len(), chips[1].1.touches.len()], [0, 1], "counted once");
}
