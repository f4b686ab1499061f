use super::*;
use palpate_shared::ContactTime;
use palpate_shared::link::{Device, DeviceEnd, EVENTS, FaultKind};

const NAMES: [&str; 18] = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "m", "n", "o", "p", "q", "r"];

/// A chip with a model of 18 objects, more than have room in one answer, or without one.
#[derive(Default)]
struct Chip {
    has_model: bool,
    resets: u32,
}

impl Device for Chip {
    fn touch(&mut self, _: &Touch, _: bool) -> Result<VerdictMessage, Refusal> {
        Err(Refusal::NoModel)
    }

    fn reset(&mut self) -> Result<(), Refusal> {
        self.resets += 1;
        Ok(())
    }

    fn model(&self) -> Option<ModelInfo> {
        self.has_model.then_some(ModelInfo { checksum: 7, length: 1_000, last_object: 17, descriptor: 1 })
    }

    fn name(&self, object: u8) -> Option<&str> {
        NAMES.get(usize::from(object)).copied()
    }

    fn program(&self) -> &str {
        "chip 1.0"
    }

    fn posterior(&self, object: u8) -> Option<u64> {
        (object < 18).then_some(u64::from(object) << 51)
    }
}

/// A watch and a chip with a line between them.
struct Desk {
    watch: Watch,
    end: DeviceEnd,
    chip: Chip,
    now: u64,
    /// Number of the last session, another each time, as pages draw them.
    session: u32,
}

impl Desk {
    fn new(has_model: bool) -> Self {
        let chip = Chip { has_model, resets: 0 };
        Self { watch: Watch::default(), end: DeviceEnd::new(1), chip, now: 0, session: 0 }
    }

    /// Has the watch do something, and both ends talk until they have nothing more to say.
    fn act(&mut self, act: impl FnOnce(&mut Watch, u64, &mut Vec<u8>)) -> Vec<Happening> {
        let Self { watch, end, chip, now, .. } = self;
        let mut line = Vec::new();
        act(watch, *now, &mut line);
        while !line.is_empty() {
            let mut back = Vec::new();
            end.receive(&line, chip, |frame| back.extend(frame));
            line.clear();
            watch.receive(&back, *now, &mut line);
        }
        watch.take()
    }

    fn connect(&mut self) -> Vec<Happening> {
        self.session += 5;
        let session = self.session;
        self.act(|watch, now, line| watch.connect(session, now, line))
    }

    /// Lets time pass while the line is cut, and counts how often the silence is told.
    fn wait(&mut self, seconds: u64) -> usize {
        let mut silent = 0;
        for _ in 0..10 * seconds {
            self.now += 100_000;
            self.watch.tick(self.now, &mut Vec::new());
            silent += self.watch.take().iter().filter(|happened| **happened == Happening::Silent).count();
        }
        silent
    }

    /// Has the chip tell something, which arrives.
    fn tell(&mut self, event: Event) -> Vec<Happening> {
        let mut told = Vec::new();
        self.end.tell(event, |frame| told.extend(frame));
        self.act(|watch, now, line| watch.receive(&told, now, line))
    }
}

fn message(times: [u32; 3]) -> TouchMessage {
    TouchMessage::from(&Touch::new(times.map(ContactTime::from_micros)))
}

fn touch(decision: Decision) -> Event {
    let verdict = VerdictMessage { decision, best: 2, touches: 3, detail: None };
    Event::Touch { touch: message([0, 4, u32::MAX]), pose_age: None, verdict }
}

fn touched(verdict: &'static str, object: u8) -> Happening {
    Happening::Touch { times: [Some(0), Some(4), None], verdict, object, touches: 3 }
}

fn posteriors() -> Happening {
    Happening::Posteriors { of: (0..18).map(|object| f64::from(object) / 32.0).collect() }
}

#[test]
fn a_chip_is_asked_for_model_names_program_and_posteriors_in_this_order() {
    let objects = NAMES.map(str::to_owned).to_vec();
    let expected = [
        Happening::Connected,
        Happening::Model { checksum: 7, length: 1_000, objects },
        Happening::Program { name: "chip 1.0".into() },
        posteriors(),
    ];
    assert_eq!(Desk::new(true).connect(), expected);
}

#[test]
fn posteriors_are_asked_for_again_after_each_touch_that_counts() {
    let mut desk = Desk::new(true);
    desk.connect();
    for (decision, verdict, object) in [
        (Decision::Undecided, "undecided", 2),
        (Decision::Recognized(9), "recognized", 9),
        (Decision::Unknown, "unknown", 2),
        (Decision::GaveUp, "gave-up", 2),
    ] {
        assert_eq!(desk.tell(touch(decision)), [touched(verdict, object), posteriors()]);
    }
    let fault = Event::Fault { kind: FaultKind::Stuck, finger: 1 };
    assert_eq!(desk.tell(fault), [Happening::Fault { finger: Some(1), what: "stuck closed".into() }]);
}

#[test]
fn a_chip_without_a_model_tells_its_touches_and_is_asked_for_no_posteriors() {
    let mut desk = Desk::new(false);
    let why = Refusal::NoModel.to_string();
    let program = Happening::Program { name: "chip 1.0".into() };
    assert_eq!(desk.connect(), [Happening::Connected, Happening::NoModel { why: why.clone() }, program]);
    let refused = Event::Refused { touch: message([0, 4, 5]), refusal: Refusal::NoModel };
    assert_eq!(desk.tell(refused), [Happening::Refused { times: [0, 4, 5].map(Some), why }]);
}

#[test]
fn an_approach_without_a_contact_is_said_to_be_one() {
    let event = Event::Refused { touch: message([u32::MAX; 3]), refusal: Refusal::Pattern };
    let Happening::Refused { times: [None, None, None], why, .. } = told(&event) else { panic!("{event:?}") };
    assert!(why.starts_with("no finger touched"), "{why}");
}

#[test]
fn reports_made_while_the_line_was_gone_come_late_and_those_that_the_chip_gave_up_are_counted() {
    let mut desk = Desk::new(true);
    desk.connect();
    desk.tell(touch(Decision::Undecided));
    (0..EVENTS + 2).for_each(|_| desk.end.tell(touch(Decision::Undecided), |_| {}));
    let heard = desk.connect();
    let touches = heard.iter().filter(|heard| **heard == touched("undecided", 2)).count();
    assert_eq!(touches, EVENTS as usize, "{heard:?}");
    assert!(heard.contains(&Happening::Missed { count: 2 }), "{heard:?}");
}

#[test]
fn a_chip_that_was_started_is_asked_for_its_model_again() {
    let mut desk = Desk::new(true);
    desk.connect();
    desk.end = DeviceEnd::new(2);
    let heard = desk.tell(Event::Started);
    assert_eq!(heard[..2], [Happening::Connected, Happening::Started]);
    assert!(heard.contains(&posteriors()) && heard.iter().any(|heard| matches!(heard, Happening::Model { .. })));
}

#[test]
fn another_object_is_begun_once_and_posteriors_are_asked_for_again() {
    let mut desk = Desk::new(true);
    desk.connect();
    let heard = desk.act(|watch, now, line| watch.reset(now, line));
    assert_eq!((heard, desk.chip.resets), (vec![Happening::Reset, posteriors()], 1));
}

#[test]
fn a_silent_chip_is_told_once_in_half_a_minute_and_asked_again() {
    let mut desk = Desk::new(true);
    desk.watch.connect(5, 0, &mut Vec::new());
    assert_eq!([desk.wait(26), desk.wait(4)], [0, 1]);
    desk.now += 2_000_000;
    assert_eq!(desk.act(|watch, now, line| watch.tick(now, line))[0], Happening::Connected);
}

#[test]
fn a_chip_that_was_silent_in_a_session_is_connected_again_whether_it_heard_the_last_request_or_not() {
    for is_heard in [false, true] {
        let mut desk = Desk::new(true);
        desk.connect();
        let mut line = Vec::new();
        desk.watch.reset(desk.now, &mut line);
        if is_heard {
            desk.end.receive(&line, &mut desk.chip, |_| {});
        }
        assert_eq!((desk.wait(30), desk.chip.resets), (1, u32::from(is_heard)));
        // What it tells without the line comes late.
        desk.end.tell(touch(Decision::Undecided), |_| {});
        desk.now += 2_000_000;
        let heard = desk.act(|watch, now, line| watch.tick(now, line));
        assert!(heard[0] == Happening::Connected && heard.contains(&touched("undecided", 2)), "{is_heard}: {heard:?}");
        assert!(!heard.iter().any(|heard| matches!(heard, Happening::Missed { .. })), "{is_heard}: {heard:?}");
    }
}

#[test]
fn a_frame_of_another_version_is_named_and_noise_is_counted() {
    let mut desk = Desk::new(true);
    // The version before, session 0, no message, with its checksum.
    let mut plain = vec![VERSION - 1, 0, 0, 0, 0];
    plain.extend(palpate_shared::link::checksum(&plain).to_le_bytes());
    let mut frame = vec![0, 2, plain[0], 1, 1, 1];
    frame.extend([plain.len() as u8 - 4]);
    frame.extend(&plain[5..]);
    frame.push(0);
    let heard = desk.act(|watch, now, line| watch.receive(&frame, now, line));
    assert_eq!(heard, [Happening::Version { theirs: VERSION - 1, ours: VERSION }]);
    let garbled = desk.watch.garbled();
    desk.act(|watch, now, line| watch.receive(&[9, 9, 9, 0], now, line));
    assert_eq!(desk.watch.garbled(), garbled + 1);
    assert_eq!(desk.connect()[0], Happening::Connected);
}

#[test]
fn what_the_emulated_chip_said_is_heard_as_the_page_showed_it() {
    let (mut watch, mut line) = (Watch::default(), Vec::new());
    watch.connect(0x5eed_0001, 0, &mut line);
    watch.receive(include_bytes!("../../../../tests/data/port/recorded-1.bin"), 0, &mut line);
    let heard = watch.take();
    let touches = include_str!("../../../../tests/data/port/touches-1.txt").lines().count();
    let is_touch = |happened: &&Happening| matches!(happened, Happening::Touch { .. } | Happening::Refused { .. });
    assert_eq!(heard.iter().filter(is_touch).count(), touches);
    assert!(heard.iter().any(|happened| matches!(happened, Happening::Model { objects, .. } if objects[0] == "bowl")));
}
