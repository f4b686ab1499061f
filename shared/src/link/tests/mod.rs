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

const NAMES: [&str; 8] = ["bowl", "wristwatch", "c", "d", "e", "f", "g", "h"];

/// The number of a touch.
fn number_of(touch: &Touch) -> u32 {
    touch.times()[1].micros().expect("a number")
}

/// The request of the touch with this number; every other one asks for details.
fn request(number: u32) -> Request<'static> {
    Request::Touch { touch: (&touch(number)).into(), detail: number.is_multiple_of(2) }
}

/// A fault with this number.
fn fault(finger: u8) -> Event {
    Event::Fault { kind: FaultKind::Bouncing, finger }
}

/// A chip that records every touch; a verdict has the number of its touch.
#[derive(Default)]
struct Notebook {
    touches: Vec<Touch>,
    staged: Vec<u8>,
    announced: (u32, u32),
    model: Vec<u8>,
}

impl Device for Notebook {
    fn touch(&mut self, touch: &Touch, detail: bool) -> Result<VerdictMessage, Refusal> {
        self.touches.push(*touch);
        let touches = number_of(touch);
        let detail = detail.then(|| Detail::new(u64::from(touches) << 40, &[-1, i64::MAX]));
        Ok(VerdictMessage { decision: Decision::Undecided, best: 3, touches, detail })
    }

    fn press(&mut self, touch: &Touch, position: [i32; 3], detail: bool) -> Result<VerdictMessage, Refusal> {
        assert_eq!(position, [number_of(touch).cast_signed(), i32::MIN, -1]);
        self.touch(touch, detail)
    }

    fn reset(&mut self) -> Result<(), Refusal> {
        self.touches.clear();
        Ok(())
    }

    fn begin(&mut self, length: u32, checksum: u32) -> Result<u32, Refusal> {
        self.announced = (length, checksum);
        self.staged.clear();
        Ok(0)
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<u32, Refusal> {
        if offset as usize != self.staged.len() {
            return Err(Refusal::OutOfOrder);
        }
        self.staged.extend_from_slice(bytes);
        if self.staged.len() as u32 == self.announced.0 {
            if crate::format::checksum(&self.staged) != self.announced.1 {
                return Err(Refusal::Checksum);
            }
            self.model = self.staged.clone();
        }
        Ok(self.staged.len() as u32)
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

    fn place(&mut self, rank: u8) -> Result<PlaceMessage, Refusal> {
        Ok(place(rank))
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
const BAD: Faults =
    Faults { byte_lost: 0.001, byte_changed: 0.001, frame_lost: 0.15, frame_doubled: 0.1, delay: 40_000 };

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
    answers: Vec<std::string::String>,
    events: Vec<(Event, u32)>,
    opened: bool,
    strangers: u32,
}

impl Rig {
    fn new(attempts: u32, faults: Faults, seed: u64) -> Self {
        let mut rig = Self {
            host: HostEnd::new(HostSettings { retry: 20_000, attempts }),
            chip: DeviceEnd::new(1),
            notebook: Notebook::default(),
            down: Line::new(faults, seed),
            up: Line::new(faults, seed ^ 0x5555),
            now: 0,
            answers: Vec::new(),
            events: Vec::new(),
            opened: false,
            strangers: 0,
        };
        rig.connect(1);
        rig
    }

    fn clean() -> Self {
        Self::new(5, CLEAN, 1)
    }

    fn connect(&mut self, session: u32) {
        let now = self.now;
        self.opened = false;
        self.host.connect(session, now, |frame| self.down.send(frame, now));
        self.until(|rig| rig.opened);
    }

    fn step(&mut self) -> Result<(), LinkError> {
        let Self { host, chip, notebook, down, up, now, answers, events, opened, strangers } = self;
        *now += 1_000;
        for bytes in down.arrived(*now) {
            chip.receive(&bytes, notebook, |frame| up.send(frame, *now));
        }
        chip.tick(*now as u32, |frame| up.send(frame, *now));
        for bytes in up.arrived(*now) {
            host.receive(
                &bytes,
                *now,
                |frame| down.send(frame, *now),
                |incoming| match incoming {
                    Incoming::Opened => *opened = true,
                    Incoming::Answer(answer) => answers.push(std::format!("{answer:?}")),
                    Incoming::Event { event, missed } => events.push((event, missed)),
                    Incoming::Stranger => *strangers += 1,
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

    /// Lets the chip report an event.
    fn tell(&mut self, event: Event) {
        let (up, now) = (&mut self.up, self.now);
        self.chip.tell(event, |frame| up.send(frame, now));
    }

    fn send(&mut self, request: Request<'_>) {
        let now = self.now;
        assert!(self.host.request(request, now, |frame| self.down.send(frame, now)));
    }

    /// The answer to a request.
    fn ask(&mut self, request: Request<'_>) -> std::string::String {
        self.send(request);
        self.until(|rig| rig.host.is_idle());
        self.answers.pop().unwrap()
    }

    /// Sends touches, and asserts that each answer is its own.
    fn send_touches(&mut self, numbers: core::ops::Range<u32>) {
        for number in numbers {
            let answer = self.ask(request(number));
            assert!(answer.contains(&std::format!("touches: {number},")), "{number}: {answer}");
            assert_eq!(answer.contains("Some(Detail"), number % 2 == 0);
        }
        assert!(self.answers.is_empty(), "an answer came twice");
    }
}

#[test]
fn a_clean_line_repeats_nothing() {
    let mut rig = Rig::clean();
    rig.send_touches(0..1_000);
    assert_eq!(rig.notebook.touches, (0..1_000).map(touch).collect::<Vec<_>>());
    let (host, chip) = (rig.host.statistics(), rig.chip.statistics());
    assert_eq!((host.resent, host.garbled, host.repeated, host.sent), (0, 0, 0, 1_002));
    assert_eq!((chip.garbled, chip.repeated, chip.late, chip.frames), (0, 0, 0, 1_002));
}

#[test]
fn ten_thousand_touches_and_events_arrive_exactly_once_over_a_bad_line() {
    let mut rig = Rig::new(HostSettings::default().attempts, BAD, 7);
    let mut events = 0;
    for number in 0..10_000 {
        if number % 4 == 0 {
            // As the host has heard the one before, none is given up.
            rig.until(|rig| rig.events.len() == events);
            rig.tell(fault(events as u8));
            events += 1;
        }
        rig.send_touches(number..number + 1);
    }
    rig.until(|rig| rig.events.len() == events);
    assert_eq!(rig.notebook.touches, (0..10_000).map(touch).collect::<Vec<_>>());
    let expected: Vec<_> = (0..events).map(|number| (fault(number as u8), 0)).collect();
    assert_eq!(rig.events, expected);
    let (host, chip) = (rig.host.statistics(), rig.chip.statistics());
    assert!(host.resent > 100 && host.garbled > 100 && host.repeated > 100, "{host:?}");
    assert!(chip.garbled > 100 && chip.repeated > 100 && chip.late > 100, "{chip:?}");
}

/// Loads a model; the last answer.
fn load(rig: &mut Rig, model: &[u8], checksum: u32) -> std::string::String {
    rig.ask(Request::Begin { length: model.len() as u32, checksum });
    let chunks = model.chunks(CHUNK).enumerate();
    chunks.map(|(at, bytes)| rig.ask(Request::Chunk { offset: (at * CHUNK) as u32, bytes })).last().unwrap()
}

#[test]
fn a_model_arrives_whole_over_a_bad_line_and_a_wrong_one_leaves_the_old() {
    let mut rig = Rig::new(1_000, BAD, 3);
    let model: Vec<u8> = (0..5_000_u32).map(|i| ((i * i) >> 3) as u8).collect();
    let checksum = crate::format::checksum(&model);
    assert_eq!(load(&mut rig, &model, checksum), "Wanted { offset: 5000 }");
    assert_eq!(rig.notebook.model, model);
    assert_eq!(load(&mut rig, &model, checksum ^ 1), "Refused(Checksum)");
    assert_eq!(rig.notebook.model, model);
}

#[test]
fn a_model_of_27_kilobytes_loads_in_less_than_3_42_seconds_at_115_200_baud() {
    let (mut host, mut chip, mut notebook) =
        (HostEnd::new(HostSettings::default()), DeviceEnd::new(1), Notebook::default());
    let model = vec![0x5a; 27_251];
    let mut sent = Vec::new();
    host.connect(1, 0, |frame| sent.extend_from_slice(frame));
    let (mut micros, mut wanted, mut next) = (0, None, 0);
    loop {
        // Ten bits for each byte there and back, and 5 ms until the answer begins.
        let mut answers = Vec::new();
        let down = std::mem::take(&mut sent);
        chip.receive(&down, &mut notebook, |frame| answers.extend_from_slice(frame));
        micros += (down.len() + answers.len()) as u64 * 10_000_000 / 115_200 + 5_000;
        host.receive(
            &answers,
            micros,
            |frame| sent.extend_from_slice(frame),
            |incoming| {
                if let Incoming::Answer(Answer::Wanted { offset }) = incoming {
                    wanted = Some(offset);
                }
            },
        );
        host.tick(micros, |_| panic!("nothing is late")).unwrap();
        if !host.is_idle() {
            continue;
        }
        let request = match wanted {
            None => Request::Begin { length: model.len() as u32, checksum: crate::format::checksum(&model) },
            Some(offset) if offset as usize == model.len() => break,
            Some(offset) => {
                next = offset as usize;
                Request::Chunk { offset, bytes: &model[next..model.len().min(next + CHUNK)] }
            }
        };
        host.request(request, micros, |frame| sent.extend_from_slice(frame));
    }
    assert!(next > 27_000 && notebook.model == model);
    // At most 1.3 times as long as with a window of eight chunks of 128 bytes.
    std::println!("{micros} microseconds");
    assert!((3_100_000..1_300 * 2_630).contains(&micros), "{micros}");
}

#[test]
fn requests_are_answered_and_what_is_not_there_is_refused() {
    let mut rig = Rig::clean();
    assert_eq!(rig.ask(Request::Model), "Refused(NoModel)");
    assert_eq!(rig.ask(Request::Name { object: 1 }), "Name(\"wristwatch\")");
    assert_eq!(rig.ask(Request::Name { object: 8 }), "Refused(NoObject)");
    assert_eq!(rig.ask(Request::Program), "Name(\"notebook 1.0\")");
    rig.send_touches(0..1);
    assert!(rig.ask(Request::Counts).contains("frames: 8"));
    assert_eq!(rig.ask(Request::Posteriors { first: 20 }), "Posteriors([])");
    let posteriors = rig.ask(Request::Posteriors { first: 10 });
    assert_eq!(posteriors.matches(',').count(), 10 * 8 - 1);
    assert_eq!(rig.ask(Request::Reset), "Done");
    assert!(rig.notebook.touches.is_empty());
    // One at a time.
    rig.send(Request::Model);
    assert!(!rig.host.request(Request::Model, rig.now, |_| panic!("two are under way")));
}

#[test]
fn events_while_the_cable_was_out_come_late_and_those_that_the_chip_gave_up_are_missed() {
    let mut rig = Rig::clean();
    rig.tell(fault(0));
    rig.until(|rig| rig.events.len() == 1);
    // Out, and in again: a session of the same end, so that it knows what it has heard.
    rig.up.faults.frame_lost = 1.0;
    for number in 1..=EVENTS as u8 + 2 {
        rig.tell(fault(number));
        (0..300).for_each(|_| rig.step().unwrap());
    }
    rig.up.faults.frame_lost = 0.0;
    rig.connect(2);
    rig.until(|rig| rig.events.len() == 1 + EVENTS as usize);
    let expected: Vec<_> =
        (3..=EVENTS as u8 + 2).map(|number| (fault(number), if number == 3 { 2 } else { 0 })).collect();
    assert_eq!((rig.events[0], &rig.events[1..]), ((fault(0), 0), &expected[..]));
    assert_eq!(rig.host.statistics().missed_events, 2);
    // Another host hears nothing of what was before it.
    rig.host = HostEnd::new(HostSettings::default());
    rig.up.faults.frame_lost = 1.0;
    rig.tell(fault(9));
    rig.up.faults.frame_lost = 0.0;
    rig.events.clear();
    rig.connect(3);
    (0..3_000).for_each(|_| rig.step().unwrap());
    rig.tell(fault(10));
    rig.until(|rig| !rig.events.is_empty());
    assert_eq!(rig.events, [(fault(10), 0)]);
}

#[test]
fn an_event_is_repeated_until_it_is_heard_less_and_less_often_and_not_where_nobody_is() {
    let mut chip = DeviceEnd::new(1);
    let told = |chip: &mut DeviceEnd, seconds: u32| {
        let mut at = Vec::new();
        (0..seconds * 1_000).for_each(|ms| chip.tick(ms * 1_000, |_| at.push(ms)));
        at
    };
    chip.start(|_| ());
    assert_eq!((told(&mut chip, 10), chip.wait(0)), (vec![], None));
    let mut rig = Rig::clean();
    rig.chip.tell(fault(1), |_| ());
    assert_eq!(told(&mut rig.chip, 5), [250, 750, 1_750, 2_750, 3_750, 4_750]);
    assert_eq!(rig.chip.wait(5_000_000), Some(750_000));
}

#[test]
fn a_host_that_has_heard_what_was_never_told_changes_nothing() {
    let mut chip = DeviceEnd::new(1);
    let mut sent = 0;
    for number in 0..3 {
        chip.receive(&framed(0, Message::Heard { number }), &mut Notebook::default(), |_| sent += 1);
    }
    chip.tell(fault(1), |frame| {
        let expected = framed(0, Message::Event { number: 0, event: fault(1) });
        assert_eq!(frame, expected);
    });
    assert_eq!(sent, 0);
}

#[test]
fn a_chip_that_was_reset_executes_nothing_of_the_session_before_and_says_so() {
    let faults = Faults { frame_lost: 0.02, frame_doubled: 0.1, byte_changed: 0.001, delay: 4_000, ..CLEAN };
    for seed in 0..200 {
        let mut rig = Rig::new(1_000, faults, seed);
        rig.send_touches(0..5);
        rig.send(request(5));
        (0..seed % 9).for_each(|_| rig.step().unwrap());
        let counted = rig.notebook.touches.len();
        // What was on its way stays there, and may arrive after the reset.
        rig.chip = DeviceEnd::new(2 + seed as u32);
        let (up, now) = (&mut rig.up, rig.now);
        rig.chip.start(|frame| up.send(frame, now));
        if rig.host.is_idle() {
            rig.send(request(6));
        }
        // An answer that was on its way may still come: then the next request is the one that is forgotten.
        let ended = (0..10_000).find_map(|_| {
            let ended = rig.step().err();
            if ended.is_none() && rig.host.is_idle() {
                rig.send(request(6));
            }
            ended
        });
        assert_eq!(ended, Some(LinkError::Forgotten));
        assert_eq!(rig.notebook.touches.len(), counted, "nothing of the session before counts after the reset");
        // In the next session the chip tells that it has started.
        rig.connect(2);
        rig.chip.tell(fault(3), |_| ());
        rig.until(|rig| rig.events.len() == 2);
        assert_eq!(rig.events, [(Event::Started, 0), (fault(3), 0)]);
    }
}

#[test]
fn a_host_that_only_listens_notices_a_chip_that_was_reset() {
    let mut rig = Rig::clean();
    rig.chip = DeviceEnd::new(2);
    let (up, now) = (&mut rig.up, rig.now);
    rig.chip.start(|frame| up.send(frame, now));
    rig.until(|rig| rig.strangers == 1);
    rig.send(Request::Counts);
    assert_eq!(rig.ended(), LinkError::Forgotten);
}

#[test]
fn a_silent_chip_is_reported() {
    let mut rig = Rig::clean();
    rig.send_touches(0..4);
    rig.down.faults.frame_lost = 1.0;
    rig.send(request(4));
    assert_eq!(rig.ended(), LinkError::Silent);
}

/// The answers of a chip to the frames of a host, until it has no more to say.
fn talk(host: &mut HostEnd, sent: &mut Vec<u8>, chip: &mut DeviceEnd, notebook: &mut Notebook) -> usize {
    let mut answers = 0;
    while !sent.is_empty() {
        let mut back = Vec::new();
        chip.receive(&std::mem::take(sent), notebook, |frame| back.extend_from_slice(frame));
        let count = |incoming: Incoming<'_>| answers += usize::from(matches!(incoming, Incoming::Answer(_)));
        host.receive(&back, 0, |frame| sent.extend_from_slice(frame), count);
    }
    answers
}

#[test]
fn of_two_hosts_the_second_has_the_session_and_the_first_one_is_told() {
    let (mut chip, mut notebook) = (DeviceEnd::new(1), Notebook::default());
    let mut hosts = [0x1234_5678, 0x9abc_def0].map(|session| {
        let (mut host, mut sent) = (HostEnd::new(HostSettings::default()), Vec::new());
        host.connect(session, 0, |frame| sent.extend_from_slice(frame));
        talk(&mut host, &mut sent, &mut chip, &mut notebook);
        assert!(host.is_idle());
        (host, sent)
    });
    for (number, (host, sent)) in hosts.iter_mut().enumerate() {
        assert!(host.request(request(7), 0, |frame| sent.extend_from_slice(frame)));
        assert_eq!(talk(host, sent, &mut chip, &mut notebook), number);
    }
    assert_eq!(notebook.touches.len(), 1);
    assert_eq!(hosts[0].0.tick(0, |_| ()), Err(LinkError::Forgotten));
}

#[test]
fn a_late_copy_of_a_hello_opens_no_session_again() {
    let hello =
        |session, boot| framed(session, Message::Request { number: 1, request: Request::Hello { previous: 0, boot } });
    let late = |chip: &mut DeviceEnd, session| {
        let mut answer = std::string::String::new();
        chip.receive(&hello(session, 1), &mut Notebook::default(), |frame| {
            decode(frame, |frame| answer = std::format!("{:?}", frame.unwrap().message));
        });
        answer
    };
    let mut chip = DeviceEnd::new(1);
    assert!(late(&mut chip, 7).contains("Session { session: 7, boot: 1, event: 0 }"));
    assert!(late(&mut chip, 8).contains("Session { session: 7, boot: 1, event: 0 }"));
    assert!(late(&mut DeviceEnd::new(2), 7).contains("Session { session: 0, boot: 2, event: 0 }"));
}

#[test]
fn a_decoder_says_what_was_no_frame_and_reads_on() {
    let good = framed(7, Message::Heard { number: 1 });
    // With a valid checksum.
    let newer = summed(vec![5, 7, 0, 0, 0, 3, 1]);
    for (bytes, error) in [(newer, FrameError::Version(5)), (vec![0xaa; 10_000], FrameError::TooLong)] {
        assert_eq!(decode(&[bytes, good.clone()].concat(), |frame| frame.map(drop)), [Err(error), Ok(())]);
    }
}

#[test]
fn golden_messages_pin_the_format() {
    let touch = Touch::from_micros([300, 0, 70_000]).with_pose(Pose { direction: [1, 2, 3], alignment: [-1, 0, 256] });
    let detail = Detail { posterior: [8, 7, 6, 5, 4, 3, 2, 1], evidence: [4, 3, 2, 1] };
    let verdict = VerdictMessage { decision: Decision::Recognized(4), best: 4, touches: 17, detail: Some(detail) };
    let (mut without, down) = ([0; POSE_BYTES], Pose { direction: [0, 0, -32767], alignment: [32767, 0, 0] });
    (without[0], without[12]) = (255, 1);
    let pressed = Touch::new([ContactTime::FIRST, ContactTime::MISSING, ContactTime::from_micros(300)]).with_pose(down);
    let pose = TablePose {
        placement: 3,
        position: [12_300, -4_100],
        yaw: 15_838,
        within: [900, 1_000],
        yaw_within: Some(546),
        share: 60_000,
    };
    let place = PlaceMessage { table_alone: false, exhausted: true, place: Some(pose) };
    // In micrometers: -12300, 4100, 25000.
    let position = [244, 207, 255, 255, 4, 16, 0, 0, 168, 97, 0, 0];
    let request = |request| Message::Request { number: 200, request };
    let answer = |answer| Message::Answer { number: 1, answer };
    let event = Event::Fault { kind: FaultKind::Silent, finger: 2 };
    // Written out by hand.
    let messages: [(Message<'_>, &[u8]); 27] = [
        (request(Request::Hello { previous: 513, boot: 7 }), &[0, 200, 1, 0, 129, 4, 7]),
        (request(Request::Model), &[0, 200, 1, 1]),
        (request(Request::Begin { length: 300, checksum: 5 }), &[0, 200, 1, 2, 172, 2, 5]),
        (request(Request::Chunk { offset: 256, bytes: &[9, 8] }), &[0, 200, 1, 3, 128, 2, 2, 9, 8]),
        (
            request(Request::Touch { touch: (&touch).into(), detail: true }),
            &[0, 200, 1, 4, 172, 2, 0, 240, 162, 4, 1, 1, 0, 2, 0, 3, 0, 255, 255, 0, 0, 0, 1, 1],
        ),
        (
            request(Request::Press { touch: (&pressed).into(), position, detail: false }),
            &[
                0, 200, 1, 5, 0, 255, 255, 255, 255, 15, 172, 2, 1, 0, 0, 0, 0, 1, 128, 255, 127, 0, 0, 0, 0, 244, 207,
                255, 255, 4, 16, 0, 0, 168, 97, 0, 0, 0,
            ],
        ),
        (request(Request::Reset), &[0, 200, 1, 6]),
        (request(Request::Name { object: 3 }), &[0, 200, 1, 7, 3]),
        (request(Request::Program), &[0, 200, 1, 8]),
        (request(Request::Counts), &[0, 200, 1, 9]),
        (request(Request::Posteriors { first: 16 }), &[0, 200, 1, 10, 16]),
        (request(Request::NextApproach { without }), &[0, 200, 1, 11, 255, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]),
        (request(Request::Place { rank: 1 }), &[0, 200, 1, 12, 1]),
        (request(Request::Placement { placement: 1 }), &[0, 200, 1, 13, 1]),
        (request(Request::NextPress { within: Some(40_000) }), &[0, 200, 1, 14, 1, 192, 184, 2]),
        (answer(Answer::Session { session: 2, boot: 7, event: 3 }), &[1, 1, 0, 2, 7, 3]),
        (answer(Answer::Forgotten), &[1, 1, 1]),
        (answer(Answer::Refused(Refusal::NotAdmitted)), &[1, 1, 2, 16]),
        (answer(Answer::Done), &[1, 1, 3]),
        (answer(Answer::Verdict(verdict)), &[1, 1, 4, 1, 4, 4, 17, 1, 8, 7, 6, 5, 4, 3, 2, 1, 4, 3, 2, 1]),
        (answer(Answer::Wanted { offset: 4_096 }), &[1, 1, 5, 128, 32]),
        (answer(Answer::Name("spoon")), &[1, 1, 7, 5, 115, 112, 111, 111, 110]),
        (
            answer(Answer::NextApproach(ApproachMessage::new(48, -5, &down))),
            &[1, 1, 10, 48, 9, 0, 0, 0, 0, 1, 128, 255, 127, 0, 0, 0, 0],
        ),
        (
            answer(Answer::Place(place)),
            &[1, 1, 11, 0, 1, 1, 3, 152, 192, 1, 135, 64, 222, 123, 132, 7, 232, 7, 1, 162, 4, 224, 212, 3],
        ),
        (answer(Answer::NextPress(Approach { x: -1_000, y: 0, roll: 64 })), &[1, 1, 12, 207, 15, 0, 64]),
        (Message::Event { number: 300, event }, &[2, 172, 2, 2, 2, 2]),
        (Message::Heard { number: 300 }, &[3, 172, 2]),
    ];
    for (message, golden) in messages {
        // Version and session before it, a checksum after it.
        let framed = framed(2, message.clone());
        let golden = summed([&[VERSION, 2, 0, 0, 0], golden].concat());
        assert_eq!(framed, [&[0], &golden[..]].concat(), "{message:?}");
        assert_eq!(decode(&framed, |frame| frame == Ok(Frame { session: 2, message: message.clone() })), [true]);
    }
}

#[test]
fn a_golden_frame_pins_checksum_and_stuffing() {
    // Version, session, message, CRC-32, in COBS; the checksum is Python's zlib.crc32.
    let golden = [0, 3, 4, 2, 1, 1, 8, 3, 172, 2, 42, 236, 13, 152, 0];
    assert_eq!(framed(2, Message::Heard { number: 300 }), golden);
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
    let text = core::str::from_utf8(&[b'x'; TEXT]).unwrap();
    let answer = |answer| Message::Answer { number: u32::MAX, answer };
    let longest = [
        Message::Request { number: u32::MAX, request: Request::Chunk { offset: u32::MAX, bytes: &[0; CHUNK] } },
        answer(Answer::Posteriors(&[7; 8 * POSTERIORS])),
        answer(Answer::Name(text)),
    ];
    for message in longest {
        let frame = Frame { session: u32::MAX, message };
        let bytes = framed(frame.session, frame.message.clone());
        assert_eq!(decode(&bytes, |decoded| decoded == Ok(frame.clone())), [true]);
    }
    let too_long = Request::Chunk { offset: 0, bytes: &[0; CHUNK + 40] };
    assert!(framed(0, Message::Request { number: 0, request: too_long }).is_empty());
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
        let request = Request::Touch { touch: (&touch).into(), detail: true };
        let arrived = decode(&framed(7, Message::Request { number: 9, request }), |frame| match frame {
            Ok(Frame { message: Message::Request { request: Request::Touch { touch, .. }, .. }, .. }) => Touch::from(&touch),
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
