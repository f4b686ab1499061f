//! Two hosts and three chips against a simple specification, through everything that a line and resets can do:
//! each touch counts at most once; every touch that a host believes to be counted is counted, or the host is told; no host
//! hears of a chip's own touch twice, or misses one that is not reported as missed.
//!
//! Frames are delivered in any order, twice, late (also after resets), or not at all. Both hosts hear what a chip says that
//! they are connected to. `PALPATE_LINK_STEPS=1000000` sets the number of steps; without it there are 60,000.

use super::{NAMES, Notebook, number_of};
use crate::link::*;
use crate::{Approach, Pose, TablePose, Touch};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::vec::Vec;

const HOSTS: usize = 2;
const CHIPS: usize = 3;
/// Steps in one history.
const LENGTH: usize = 300;
#[derive(Clone, Copy, Debug)]
enum Action {
    /// A host gives a touch.
    Submit(usize),
    /// A host asks for a name, an approach or a place, whose number is the question's.
    Ask(usize),
    /// A host opens a session.
    Connect(usize),
    /// A host is plugged into a chip, and opens no session.
    Plug(usize, usize),
    /// The frame in this place arrives, and stays under way if it was doubled.
    Deliver(u16, bool),
    /// The next frame of those under way arrives.
    DeliverOldest,
    /// The frame in this place is lost.
    Lose(u16),
    /// A chip is reset.
    Reset(usize),
    /// A chip's own fingers touch.
    Touch(usize),
    /// Time passes: due messages are sent again.
    Wait(u32),
}

fn action() -> impl Strategy<Value = Action> {
    let (host, chip) = (0..HOSTS, 0..CHIPS);
    prop_oneof![
        16 => host.clone().prop_map(Action::Submit),
        4 => host.clone().prop_map(Action::Ask),
        1 => host.clone().prop_map(Action::Connect),
        1 => (host, chip.clone()).prop_map(|(host, chip)| Action::Plug(host, chip)),
        14 => (any::<u16>(), proptest::bool::weighted(0.2)).prop_map(|(place, again)| Action::Deliver(place, again)),
        24 => Just(Action::DeliverOldest),
        4 => any::<u16>().prop_map(Action::Lose),
        2 => chip.clone().prop_map(Action::Reset),
        4 => chip.prop_map(Action::Touch),
        8 => (1..60_000_u32).prop_map(Action::Wait),
    ]
}

/// A chip, and everything that it was told in this life.
struct Chip {
    end: DeviceEnd,
    notebook: Notebook,
    life: u32,
    touches: u32,
}

/// The place of this rank.
pub(super) fn place(rank: u8) -> PlaceMessage {
    let position = [i32::from(rank), -1];
    let pose =
        TablePose { placement: rank, position, yaw: 65_535, within: [0, u32::MAX], yaw_within: None, share: 65_536 };
    PlaceMessage { table_alone: rank >= 4, exhausted: rank % 2 == 1, place: Some(pose) }
}

/// The answer to the question with this number.
pub(super) fn approach(number: u8) -> ApproachMessage {
    let middle = Pose { direction: [number.into(), -1, i16::MAX], alignment: [i16::MIN, 0, 7] };
    ApproachMessage::new(number.into(), -i32::from(number), &middle)
}

/// A host, and what its program knows.
struct Host {
    end: HostEnd,
    chip: usize,
    connected: bool,
    /// Touches of this session, in order.
    given: Vec<u32>,
    /// Number of these that are answered.
    answered: usize,
    /// The number of what was asked for.
    asked: Option<u8>,
    /// The next event of each life of a chip that was heard.
    events: BTreeMap<u32, u32>,
}

#[derive(Clone, Copy, Debug)]
enum To {
    Chip(usize),
    Host(usize),
}

#[derive(Clone)]
struct Frame {
    to: To,
    bytes: Vec<u8>,
}

struct World {
    hosts: [Host; HOSTS],
    chips: [Chip; CHIPS],
    under_way: Vec<Frame>,
    now: u64,
    next_touch: u32,
    next_session: u32,
    resets: u32,
    /// Number of times that each touch of a host was counted, on any chip, in any life.
    counted: BTreeMap<u32, u32>,
    names: u8,
}

/// Numbers that do not come again, in no order.
fn scatter(number: u32) -> u32 {
    number.wrapping_mul(0x9e37_79b1) ^ 0x5bd1_e995
}

impl World {
    fn new() -> Self {
        let chip = |number: u32| {
            let end = DeviceEnd::new(scatter(number));
            Chip { end, notebook: Notebook::default(), life: number, touches: 0 }
        };
        let host = |chip| Host {
            end: HostEnd::new(HostSettings { retry: 20_000, attempts: 12 }),
            chip,
            connected: false,
            given: Vec::new(),
            answered: 0,
            asked: None,
            events: BTreeMap::new(),
        };
        Self {
            hosts: [host(0), host(1)],
            chips: [chip(0), chip(1), chip(2)],
            under_way: Vec::new(),
            now: 0,
            next_touch: 0,
            next_session: 0,
            resets: 0,
            counted: BTreeMap::new(),
            names: 0,
        }
    }

    /// Sends frames from a host.
    fn down(&mut self, host: usize, frames: Vec<Vec<u8>>) {
        let to = To::Chip(self.hosts[host].chip);
        self.under_way.extend(frames.into_iter().map(|bytes| Frame { to, bytes }));
    }

    /// Sends frames from a chip: every host that is plugged in hears it.
    fn up(&mut self, chip: usize, frames: Vec<Vec<u8>>) {
        for bytes in frames {
            for (number, _) in self.hosts.iter().enumerate().filter(|(_, host)| host.chip == chip) {
                self.under_way.push(Frame { to: To::Host(number), bytes: bytes.clone() });
            }
        }
    }

    fn act(&mut self, action: Action) {
        let now = self.now;
        let mut frames = Vec::new();
        match action {
            Action::Submit(host) => {
                let (touch, number) = (Touch::from_micros([0, self.next_touch, 0]), self.next_touch);
                let Host { end, given, connected, .. } = &mut self.hosts[host];
                // Every other one has a position.
                let touch = (&touch).into();
                let [a, b, c, d] = number.to_le_bytes();
                let position = [a, b, c, d, 0, 0, 0, 128, 255, 255, 255, 255];
                let request = match number % 2 {
                    0 => Request::Touch { touch, detail: false },
                    _ => Request::Press { touch, position, detail: false },
                };
                if *connected && end.request(request, now, |frame| frames.push(frame.to_vec())) {
                    given.push(self.next_touch);
                    self.next_touch += 1;
                }
                self.down(host, frames);
            }
            Action::Ask(host) => {
                self.names = (self.names + 1) % 8;
                let (name, Host { end, asked, connected, .. }) = (self.names, &mut self.hosts[host]);
                // In turn: the answer has the question's number.
                let request = match name % 4 {
                    0 => Request::Name { object: name },
                    1 => {
                        Request::NextApproach { without: std::array::from_fn(|byte| if byte == 0 { name } else { 0 }) }
                    }
                    2 => Request::Place { rank: name },
                    _ => Request::NextPress { within: Some(name.into()) },
                };
                if *connected && end.request(request, now, |frame| frames.push(frame.to_vec())) {
                    *asked = Some(name);
                }
                self.down(host, frames);
            }
            Action::Connect(host) => self.connect(host),
            Action::Plug(host, chip) => self.hosts[host].chip = chip,
            Action::Deliver(..) | Action::DeliverOldest | Action::Lose(_) if self.under_way.is_empty() => {}
            Action::Deliver(place, again) => {
                let place = usize::from(place) % self.under_way.len();
                let frame = match again {
                    true => self.under_way[place].clone(),
                    false => self.under_way.swap_remove(place),
                };
                self.deliver(frame);
            }
            Action::DeliverOldest => {
                let frame = self.under_way.remove(0);
                self.deliver(frame);
            }
            Action::Lose(place) => {
                self.under_way.swap_remove(usize::from(place) % self.under_way.len());
            }
            Action::Reset(chip) => self.start(chip),
            Action::Touch(chip) => {
                let frames = self.touch(chip);
                self.up(chip, frames);
            }
            Action::Wait(micros) => {
                self.now += u64::from(micros);
                for host in 0..HOSTS {
                    self.tick(host);
                }
                for chip in 0..CHIPS {
                    let mut frames = Vec::new();
                    self.chips[chip].end.tick(self.now as u32, |frame| frames.push(frame.to_vec()));
                    self.up(chip, frames);
                }
            }
        }
    }

    /// A chip starts.
    fn start(&mut self, chip: usize) {
        self.resets += 1;
        let life = u32::try_from(CHIPS).unwrap() + self.resets;
        let mut end = DeviceEnd::new(scatter(life));
        let mut frames = Vec::new();
        end.start(|frame| frames.push(frame.to_vec()));
        self.chips[chip] = Chip { end, notebook: Notebook::default(), life, touches: 0 };
        self.up(chip, frames);
    }

    /// A chip's own fingers touch; returns its report.
    fn touch(&mut self, chip: usize) -> Vec<Vec<u8>> {
        let Chip { end, life, touches, .. } = &mut self.chips[chip];
        *touches += 1;
        // The event says which life it is from.
        let touch = TouchMessage::from(&Touch::from_micros([0, *life, *touches]));
        let verdict = VerdictMessage { decision: Decision::Undecided, best: 0, touches: *touches, detail: None };
        let mut frames = Vec::new();
        end.tell(Event::Touch { touch, pose_age: None, verdict }, |frame| frames.push(frame.to_vec()));
        frames
    }

    fn connect(&mut self, host: usize) {
        self.next_session += 1;
        let session = scatter(self.next_session ^ 0x4000_0000);
        let mut frames = Vec::new();
        let Host { end, given, answered, asked, connected, .. } = &mut self.hosts[host];
        end.connect(session, self.now, |frame| frames.push(frame.to_vec()));
        // What was given before and has no outcome is in doubt: the program knows, since it began again.
        (*answered, *asked, *connected) = (0, None, true);
        given.clear();
        self.down(host, frames);
    }

    /// Lets a host send again what is due; says whether its session has ended.
    fn tick(&mut self, number: usize) -> bool {
        let mut frames = Vec::new();
        let host = &mut self.hosts[number];
        let result = if host.connected { host.end.tick(self.now, |frame| frames.push(frame.to_vec())) } else { Ok(()) };
        let ended = result.is_err();
        host.connected &= !ended;
        self.down(number, frames);
        ended
    }

    fn deliver(&mut self, frame: Frame) {
        let now = self.now;
        let mut frames = Vec::new();
        match frame.to {
            To::Chip(chip) => {
                let Chip { end, notebook, .. } = &mut self.chips[chip];
                let before = notebook.touches.len();
                end.receive(&frame.bytes, notebook, |frame| frames.push(frame.to_vec()));
                for touch in notebook.touches[before..].iter().map(number_of) {
                    let times = self.counted.entry(touch).or_default();
                    *times += 1;
                    assert_eq!(*times, 1, "touch {touch} was counted twice");
                }
                self.up(chip, frames);
            }
            To::Host(number) => {
                let Host { end, given, answered, asked, connected, events, .. } = &mut self.hosts[number];
                if !*connected {
                    return;
                }
                let counted = &self.counted;
                let take = |incoming: Incoming<'_>| match incoming {
                    Incoming::Opened | Incoming::Stranger => {}
                    Incoming::Answer(Answer::Verdict(verdict)) => {
                        assert_eq!(verdict.touches, given[*answered], "the answer is another touch's");
                        assert_eq!(counted.get(&verdict.touches), Some(&1), "a touch that was not counted");
                        *answered += 1;
                    }
                    Incoming::Answer(answer) => {
                        let name = asked.take().expect("something was asked");
                        let expected = match name % 4 {
                            0 => Answer::Name(NAMES[usize::from(name)]),
                            1 => Answer::NextApproach(approach(name)),
                            2 => Answer::Place(place(name)),
                            _ => Answer::NextPress(Approach { x: name.into(), y: i32::MIN, roll: 255 }),
                        };
                        assert_eq!(answer, expected, "the answer is another request's");
                    }
                    Incoming::Event { event: Event::Touch { touch, .. }, missed } => {
                        let [_, life, number] = touch.times;
                        // Started is event 0, except in a chip's first life.
                        let sequence = if life < 3 { number - 1 } else { number };
                        match events.insert(life, sequence + 1) {
                            Some(next) => {
                                assert!(sequence >= next, "event {sequence} of life {life} came twice");
                                assert_eq!(missed, sequence - next, "events of life {life} are not reported");
                            }
                            // What was said before the host listened to anybody is not missed.
                            None => assert!(missed <= sequence, "{missed} before {sequence}"),
                        }
                    }
                    Incoming::Event { .. } => {}
                };
                end.receive(&frame.bytes, now, |frame| frames.push(frame.to_vec()), take);
                self.down(number, frames);
            }
        }
    }

    /// A good line from here on: every host either is told that its session has ended, or all that it was told is true of
    /// the chip.
    fn settle(&mut self) {
        self.under_way.clear();
        for number in 0..HOSTS {
            if !self.hosts[number].connected {
                continue;
            }
            let mut ended = false;
            let mut more = true;
            for _ in 0..2_000 {
                if more && self.hosts[number].end.is_idle() {
                    // One touch more, so that a host that was silent hears what has become of its session.
                    self.act(Action::Submit(number));
                    more = false;
                }
                while !self.under_way.is_empty() {
                    let frame = self.under_way.remove(0);
                    self.deliver(frame);
                }
                ended = self.tick(number);
                if ended || !more && self.hosts[number].end.is_idle() {
                    break;
                }
                self.now += 10_000;
            }
            let host = &self.hosts[number];
            if ended {
                continue;
            }
            assert!(host.end.is_idle() && host.answered == host.given.len(), "host {number} neither ends nor is told");
            let counted: Vec<u32> = self.chips[host.chip].notebook.touches.iter().map(number_of).collect();
            assert!(
                host.given.iter().all(|touch| counted.contains(touch)),
                "host {number} believes {:?} to be counted in life {}, which has {counted:?}",
                host.given,
                self.chips[host.chip].life
            );
        }
    }
}

#[test]
fn each_touch_counts_at_most_once_and_what_a_host_believes_is_so_or_it_is_told() {
    let steps = std::env::var("PALPATE_LINK_STEPS").map_or(60_000, |steps| steps.parse().expect("a number of steps"));
    let cases = u32::try_from(steps / LENGTH).unwrap();
    let config = ProptestConfig { cases, max_shrink_iters: 20_000, failure_persistence: None, ..Default::default() };
    let mut runner = proptest::test_runner::TestRunner::new_with_rng(
        config,
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    );
    let histories = prop::collection::vec(action(), LENGTH);
    let held = runner.run(&histories, |actions| {
        let mut world = World::new();
        world.connect(0);
        for action in actions {
            world.act(action);
        }
        world.settle();
        Ok(())
    });
    held.unwrap_or_else(|error| panic!("{error}"));
}
