//! A board with its own fingers, at the end of a link: touches, poses and verdicts, through losses of host and power.

use palpate_onboard::effector::{Edge, Finger, Sensed};
use palpate_onboard::station::{
    Board, Happened, LONGEST_WAIT, LinkFailed, NoStorage, ProbeSettings, ProbeStation, Storage,
};
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::link::{
    Answer, Decision, Decoder, Event, FRAME_MAX, Frame, HostEnd, HostSettings, Incoming, Message, Refusal, Request,
    VerdictMessage, encode,
};
use palpate_shared::{Pose, Touch};
use palpate_tests::HOUSEHOLD as MODEL;
use std::collections::VecDeque;

const OBJECTS: usize = 16;

/// From the beginning of one approach to that of the next.
const APPROACH: u32 = 2_000_000;

/// The link is unplugged.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Unplugged;

/// Switches that move when they are told to, a line, and a robot that announces poses; one clock for all.
#[derive(Default)]
struct Bench {
    now: u32,
    edges: VecDeque<Edge>,
    to_chip: VecDeque<u8>,
    /// Bytes that the chip has sent.
    said: Vec<u8>,
    /// Events in them, and the number of the next one.
    told: Vec<Event>,
    next: u32,
    is_unplugged: bool,
    /// Every receive is an error of the line.
    is_garbled: bool,
    /// Poses, and when they are announced.
    poses: Vec<(u32, Pose)>,
    asked: u32,
    /// From when to when a signal says that no approach is under way.
    over: Vec<(u32, u32)>,
}

impl Board for Bench {
    type Error = Unplugged;

    fn sense(&mut self) -> Sensed {
        match self.edges.front() {
            Some(edge) if edge.at <= self.now => Sensed::Edge(self.edges.pop_front().unwrap()),
            _ => Sensed::Nothing(self.now),
        }
    }

    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Unplugged> {
        if self.is_unplugged || self.is_garbled {
            return Err(Unplugged);
        }
        let count = buffer.len().min(self.to_chip.len());
        buffer.iter_mut().zip(self.to_chip.drain(..count)).for_each(|(to, from)| *to = from);
        Ok(count)
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), Unplugged> {
        if self.is_unplugged {
            return Err(Unplugged);
        }
        self.said.extend(frame);
        self.hear(frame);
        Ok(())
    }

    fn pose(&mut self) -> Option<(Pose, u32)> {
        self.asked += 1;
        let announced = self.poses.iter().rev().find(|(at, _)| *at <= self.now);
        announced.map(|(at, pose)| (*pose, self.now - at))
    }

    fn is_over(&mut self) -> bool {
        self.over.iter().any(|(from, to)| (*from..*to).contains(&self.now))
    }
}

impl Bench {
    /// The next change of the signal.
    fn changes(&self) -> Option<u32> {
        let changes = self.over.iter().flat_map(|(from, to)| [*from, *to]);
        changes.filter(|at| *at > self.now).min()
    }

    /// The fingers touch at these times after `at`, and let go `held` after that.
    fn approach(&mut self, at: u32, times: [Option<u32>; 3], held: u32) {
        let contacts = Finger::ALL.into_iter().zip(times).filter_map(|(finger, time)| Some((finger, at + time?)));
        let mut edges: Vec<Edge> = contacts
            .flat_map(|(finger, at)| [Edge::new(finger, true, at), Edge::new(finger, false, at + held)])
            .collect();
        edges.sort_by_key(|edge| edge.at);
        self.edges.extend(edges);
    }

    /// Hears an event as a host does, and says so.
    fn hear(&mut self, frame: &[u8]) {
        let mut decoder = Decoder::new();
        for &byte in frame {
            if let Some(Ok(Frame { session, message: Message::Event { number, event } })) = decoder.feed(byte) {
                let heard = Frame { session, message: Message::Heard { number } };
                self.to_chip.extend(encode(&heard, &mut [0; FRAME_MAX]));
                if number >= self.next {
                    self.next = number + 1;
                    self.told.push(event);
                }
            }
        }
    }

    /// The events that the chip has told.
    fn told(&mut self) -> Vec<Event> {
        self.said.clear();
        std::mem::take(&mut self.told)
    }
}

type Station<S> = ProbeStation<'static, OBJECTS, S>;

/// Lets time pass until `end` as a board does: awake at each edge, and when something is due.
fn run<S: Storage>(station: &mut Station<S>, bench: &mut Bench, end: u32) -> Vec<Happened> {
    let mut all = Vec::new();
    loop {
        while let Some(happened) = station.step(bench).unwrap_or_else(|failed| failed.happened) {
            all.push(happened);
        }
        if bench.now == end {
            return all;
        }
        let wait = station.wait(bench.now);
        assert!(wait <= LONGEST_WAIT);
        let edge = bench.edges.front().map_or(end, |edge| edge.at).min(bench.changes().unwrap_or(end));
        bench.now = end.min(edge).min(bench.now + wait.max(1));
    }
}

fn started() -> (Station<NoStorage>, Bench) {
    let mut station = ProbeStation::open(MODEL, NoStorage, ProbeSettings::default());
    let mut bench = Bench::default();
    // It says that it has started, and the host that it has heard so.
    assert_eq!(run(&mut station, &mut bench, APPROACH), [Happened::Heard]);
    bench.told();
    (station, bench)
}

fn touches(happened: &[Happened]) -> Vec<(Touch, Result<VerdictMessage, Refusal>)> {
    let touch = |happened: &Happened| match happened {
        Happened::Touched { touch, outcome, .. } => Some((*touch, *outcome)),
        _ => None,
    };
    happened.iter().filter_map(touch).collect()
}

/// A touch that decides when it is made again and again, and how often that takes.
fn deciding() -> ([u32; 3], u32) {
    let model = Model::new(MODEL).unwrap();
    let mut recognizer = Recognizer::<OBJECTS>::new(&model, Stopping::from_model(&model)).unwrap();
    for second in (1_000..200_000).step_by(1_000) {
        recognizer.reset();
        let times = [0, second, 30_000];
        for count in 1..=20 {
            if let Ok(Verdict::Recognized { .. }) = recognizer.push(&Touch::from_micros(times))
                && count > 1
            {
                return (times, count);
            }
        }
    }
    panic!("no touch decides");
}

/// Everything that a host has sent and heard.
struct Desk {
    host: HostEnd,
    verdicts: Vec<VerdictMessage>,
    events: Vec<Event>,
}

impl Desk {
    fn connected<S: Storage>(station: &mut Station<S>, bench: &mut Bench) -> Self {
        let mut host = HostEnd::new(HostSettings { retry: 1_000_000, attempts: 100 });
        host.connect(1, 0, |frame| bench.to_chip.extend(frame));
        let mut desk = Self { host, verdicts: Vec::new(), events: Vec::new() };
        desk.talk(station, bench);
        desk
    }

    /// Lets host and chip talk until both are silent.
    fn talk<S: Storage>(&mut self, station: &mut Station<S>, bench: &mut Bench) -> Vec<Happened> {
        let mut all = Vec::new();
        loop {
            while let Some(happened) = station.step(bench).unwrap() {
                all.push(happened);
            }
            let said = std::mem::take(&mut bench.said);
            if said.is_empty() {
                return all;
            }
            self.hear(&said, bench);
        }
    }

    fn hear(&mut self, said: &[u8], bench: &mut Bench) {
        let Self { host, verdicts, events } = self;
        host.receive(
            said,
            0,
            |frame| bench.to_chip.extend(frame),
            |incoming| match incoming {
                Incoming::Answer(Answer::Verdict(verdict)) => verdicts.push(verdict),
                Incoming::Event { event, .. } => events.push(event),
                _ => {}
            },
        );
    }

    fn push(&mut self, times: [u32; 3], bench: &mut Bench) {
        let touch = (&Touch::from_micros(times)).into();
        assert!(self.host.request(Request::Touch { touch, detail: false }, 0, |frame| bench.to_chip.extend(frame)));
    }
}

#[test]
fn the_first_own_touch_after_touches_from_a_host_have_decided_begins_another_object() {
    let (mut station, mut bench) = started();
    let (times, count) = deciding();
    let mut desk = Desk::connected(&mut station, &mut bench);
    for _ in 0..count {
        desk.push(times, &mut bench);
        desk.talk(&mut station, &mut bench);
    }
    let Some(VerdictMessage { decision: Decision::Recognized(_), .. }) = desk.verdicts.last() else {
        panic!("{:?}", desk.verdicts)
    };
    // The touches that decided are not forgotten for one that does not count.
    let spread = Model::new(MODEL).unwrap().trained_touches().largest_spread;
    bench.approach(bench.now, [Some(0), Some(spread + spread / 32), None], 1_190_000);
    let end = bench.now + 2 * APPROACH;
    let happened = run(&mut station, &mut bench, end);
    assert!(matches!(touches(&happened)[..], [(_, Err(_))]), "{happened:?}");
    bench.approach(bench.now, times.map(Some), 300_000);
    let end = bench.now + APPROACH;
    let happened = run(&mut station, &mut bench, end);
    let [(_, Ok(VerdictMessage { decision, touches, .. }))] = touches(&happened)[..] else { panic!("{happened:?}") };
    assert_eq!((decision, touches), (Decision::Undecided, 1));
}

#[test]
fn a_link_that_fails_hides_no_touch_and_no_verdict_from_the_chips_own_program() {
    let (mut station, mut bench) = started();
    let (times, count) = deciding();
    bench.is_unplugged = true;
    let (mut happened, mut failures) = (Vec::new(), 0);
    for _ in 0..5 * count {
        bench.approach(bench.now, times.map(Some), 300_000);
        let end = bench.now + APPROACH;
        while bench.now < end {
            bench.now += 1_000;
            match station.step(&mut bench) {
                Err(LinkFailed { happened: what, error: Unplugged }) => {
                    failures += 1;
                    happened.extend(what);
                }
                fine => panic!("{fine:?}"),
            }
        }
    }
    let touches = touches(&happened);
    assert_eq!((touches.len() as u32, failures), (5 * count, 5 * count * APPROACH / 1_000));
    assert_eq!(happened.iter().filter(|happened| happened.recognized().is_some()).count(), 5);
    // Plugged in again, the next touch is told.
    bench.is_unplugged = false;
    bench.approach(bench.now, times.map(Some), 300_000);
    let end = bench.now + APPROACH;
    run(&mut station, &mut bench, end);
    assert!(matches!(bench.told()[..], [Event::Touch { .. }]));
}

#[test]
fn a_byte_that_is_garbled_while_a_touch_ends_does_not_keep_the_touch_from_being_told() {
    let (mut station, mut bench) = started();
    bench.is_garbled = true;
    bench.approach(bench.now, deciding().0.map(Some), 300_000);
    let end = bench.now + APPROACH;
    while bench.now < end {
        bench.now += 1_000;
        station.step(&mut bench).unwrap_err();
    }
    assert!(matches!(bench.told()[..], [Event::Touch { .. }]));
}

#[test]
fn a_touch_is_seen_while_bytes_come_from_the_host_without_a_pause() {
    let (mut station, mut bench) = started();
    let (times, _) = deciding();
    bench.approach(bench.now, times.map(Some), 300_000);
    let end = bench.now + APPROACH;
    let mut seen = Vec::new();
    while bench.now < end {
        bench.now += 1_000;
        // As many as a step takes.
        bench.to_chip.resize(32, 0xaa);
        let happened = station.step(&mut bench).unwrap().unwrap();
        seen.extend((happened != Happened::Heard).then_some((bench.now, happened)));
    }
    let [(at, Happened::Touched { touch, .. })] = seen[..] else { panic!("{seen:?}") };
    assert_eq!(touch, Touch::from_micros(times));
    assert!(at < end - APPROACH + 50_000, "as soon as it is over: {at}");
}

const POSES: [Pose; 2] = [
    Pose { direction: [0, 0, -32_767], alignment: [32_767, 0, 0] },
    Pose { direction: [0, -32_767, 0], alignment: [0, 0, 32_767] },
];

/// The pose of a touch, and its age.
fn posed(happened: &[Happened]) -> Vec<(Option<Pose>, Option<u32>)> {
    let pose = |happened: &Happened| match happened {
        Happened::Touched { touch, pose_age, .. } => Some((touch.pose(), *pose_age)),
        _ => None,
    };
    happened.iter().filter_map(pose).collect()
}

#[test]
fn a_partial_touch_has_the_pose_of_its_own_approach_though_the_next_one_is_announced_already() {
    let (mut station, mut bench) = started();
    let start = bench.now;
    // One finger touches and lets go; the robot is on its way to the next approach before the touch is over.
    bench.poses = vec![(start - 400_000, POSES[0]), (start + 150_000, POSES[1])];
    bench.approach(start, [None, Some(0), None], 60_000);
    let happened = run(&mut station, &mut bench, start + APPROACH);
    assert_eq!(posed(&happened), [(Some(POSES[0]), Some(400_000))]);
    // The next one has its own; a whole touch within the time of debouncing too.
    let start = bench.now;
    bench.poses.push((start - 3_000, POSES[0]));
    bench.approach(start, [Some(0), Some(1_000), Some(2_000)], 60_000);
    let happened = run(&mut station, &mut bench, start + APPROACH);
    assert_eq!(posed(&happened), [(Some(POSES[0]), Some(3_000))]);
    assert_eq!(bench.asked, 2, "once per touch");
}

#[test]
fn a_pose_is_none_where_the_touch_was_over_before_anybody_looked_and_another_was_announced() {
    let (mut station, mut bench) = started();
    let start = bench.now;
    bench.approach(start, [None, Some(0), None], 60_000);
    bench.poses = vec![(start - 400_000, POSES[0]), (start + 150_000, POSES[1])];
    // The main loop is busy for the whole approach.
    bench.now = start + 500_000;
    let happened = run(&mut station, &mut bench, start + APPROACH);
    assert_eq!(posed(&happened), [(None, None)]);
    // One that is announced again and again, as some robots do, is that of the approach while it goes on.
    let start = bench.now;
    bench.poses = (0..200).map(|i| (start - 1_000_000 + i * 10_000, POSES[1])).collect();
    bench.approach(start, [Some(0), Some(300_000), None], 500_000);
    let happened = run(&mut station, &mut bench, start + APPROACH);
    assert_eq!(posed(&happened), [(Some(POSES[1]), Some(0))]);
    // An old one does not count.
    let start = bench.now;
    bench.poses = vec![(start - ProbeSettings::default().pose_lasts - 1, POSES[1])];
    bench.approach(start, [Some(0), Some(300_000), None], 500_000);
    let happened = run(&mut station, &mut bench, start + APPROACH);
    assert_eq!(posed(&happened), [(None, None)]);
}

/// An approach from `at` on whose end is signaled for a while.
fn approach(bench: &mut Bench, at: u32, times: [Option<u32>; 3]) {
    bench.approach(at, times, 300_000);
    bench.over.push((at + APPROACH - 400_000, at + APPROACH - 200_000));
}

#[test]
fn an_approach_that_ends_without_a_contact_is_told_as_a_touch_without_any() {
    let (mut station, mut bench) = started();
    let miss = Touch::new([palpate_shared::ContactTime::MISSING; 3]);
    let mut expected = Vec::new();
    // Nobody knows what was before the first signal.
    for (index, times) in
        [[None; 3], [None; 3], [Some(0), None, None], [None; 3], [Some(3), Some(0), Some(9)], [None; 3], [None; 3]]
            .into_iter()
            .enumerate()
    {
        let at = bench.now;
        bench.poses.push((at, POSES[index % 2]));
        approach(&mut bench, at, times);
        let happened = run(&mut station, &mut bench, at + APPROACH);
        let told = touches(&happened);
        expected.push(told.len());
        if times == [None; 3] && index > 0 {
            let [(touch, outcome)] = told[..] else { panic!("{index}: {happened:?}") };
            assert_eq!(touch, miss.with_pose(POSES[index % 2]), "{index}");
            assert!(outcome.is_err(), "the model was not trained on such approaches: {outcome:?}");
            assert_eq!(posed(&happened), [(Some(POSES[index % 2]), Some(APPROACH - 400_000))]);
        }
    }
    assert_eq!(expected, [0, 1, 1, 1, 1, 1, 1]);
    let told = bench.told();
    let misses =
        told.iter().filter(|event| matches!(event, Event::Refused { touch, .. } if Touch::from(touch).is_empty()));
    assert_eq!((told.len(), misses.count()), (6, 4));
}

#[test]
fn no_approach_without_a_contact_is_told_where_there_may_have_been_one() {
    let (mut station, mut bench) = started();
    let at = bench.now;
    approach(&mut bench, at, [None; 3]);
    run(&mut station, &mut bench, at + APPROACH);
    let end = |bench: &mut Bench, from: u32, to: u32| bench.over.push((from, to));
    // A touch that is still going on when its approach is over, and a miss after it.
    let at = bench.now;
    bench.approach(at + 100_000, [Some(0), None, None], 900_000);
    end(&mut bench, at + 200_000, at + 400_000);
    end(&mut bench, at + 1_700_000, at + 1_800_000);
    let happened = run(&mut station, &mut bench, at + APPROACH);
    let contacts: Vec<bool> = touches(&happened).iter().map(|(touch, _)| touch.is_empty()).collect();
    assert_eq!(contacts, [false, true]);
    // A button that bounces when it is pressed, and when it is let go.
    let at = bench.now;
    for (from, to) in [(0, 900), (2_000, 2_500), (4_000, 500_000), (501_000, 501_800), (503_000, 503_100)] {
        end(&mut bench, at + from, at + to);
    }
    let happened = run(&mut station, &mut bench, at + APPROACH);
    assert_eq!(touches(&happened).len(), 1, "{happened:?}");
    // A finger that is stuck, from before the approach on.
    let at = bench.now;
    bench.edges.push_back(Edge::new(Finger::Last, true, at));
    for number in 1..=6 {
        end(&mut bench, at + number * APPROACH - 400_000, at + number * APPROACH - 200_000);
    }
    let happened = run(&mut station, &mut bench, at + 6 * APPROACH);
    assert!(touches(&happened).iter().all(|(touch, _)| !touch.is_empty()), "{happened:?}");
    assert!(happened.iter().any(|happened| matches!(happened, Happened::Faulty(_))), "{happened:?}");
}

#[test]
fn no_wait_is_longer_than_a_second_also_where_nothing_is_due() {
    let (mut station, mut bench) = started();
    assert_eq!(station.wait(bench.now), LONGEST_WAIT);
    // A finger that stays closed: `run` asserts it all the way.
    bench.edges.push_back(Edge::new(Finger::Last, true, bench.now));
    let end = bench.now + 60_000_000;
    run(&mut station, &mut bench, end);
    assert_eq!(station.wait(bench.now), LONGEST_WAIT);
    assert_eq!(bench.told().len(), 2, "a touch and a fault");
}
