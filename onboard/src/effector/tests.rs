use super::*;
use core::cell::Cell;
use embedded_hal::digital::ErrorKind;
use embedded_hal_mock::eh1::digital::{Mock, State as Level, Transaction};
use palpate_shared::format::{HeaderBuilder, Section, Tag, TrainedProbe, TrainedTouches, checksum};
use palpate_shared::{ContactTime, Touch};
use proptest::prelude::*;
use std::{rc::Rc, vec, vec::Vec};

const SETTINGS: EffectorSettings = EffectorSettings {
    debounce: 5_000,
    settle: 25_000,
    timeout: 400_000,
    release: 100_000,
    rest: 10_000,
    stuck: 5_000_000,
    silent_after: 4,
};

/// Outcomes of a run: touches and faults, in order.
type Outcomes = Vec<Result<Touch, Fault>>;

/// Edges: finger, closed, time.
type Edges = [(Finger, bool, u32)];

/// An effector, and what it has told.
struct Bench {
    effector: Effector,
    outcomes: Outcomes,
}

impl Bench {
    fn new(settings: EffectorSettings) -> Self {
        Self { effector: Effector::new(settings), outcomes: Outcomes::new() }
    }

    /// One whose fingers have been open for long enough since power-up, at this time.
    fn rested(settings: EffectorSettings, at: u32) -> Self {
        let mut bench = Self::new(settings);
        bench.poll(at.wrapping_sub(SETTINGS.release));
        bench.poll(at);
        bench
    }

    fn poll(&mut self, now: u32) {
        while let Some(outcome) = self.effector.poll(now).transpose() {
            self.outcomes.push(outcome);
        }
    }

    fn edges(&mut self, edges: &Edges) {
        for &(finger, closed, at) in edges {
            self.outcomes.extend(self.effector.edge(Edge::new(finger, closed, at)).transpose());
        }
    }

    /// Plays edges from `start` on, polling at the given times after it as well.
    fn play(&mut self, start: u32, edges: &Edges, polls: &[u32], end: u32) {
        let mut moments: Vec<(u32, Option<(Finger, bool)>)> =
            edges.iter().map(|&(finger, closed, at)| (at, Some((finger, closed)))).collect();
        moments.extend(polls.iter().filter(|&&at| at < end).map(|&at| (at, None)));
        moments.push((end, None));
        moments.sort_by_key(|&(at, _)| at);
        for (at, edge) in moments {
            let now = start.wrapping_add(at);
            if let Some((finger, closed)) = edge {
                self.edges(&[(finger, closed, now)]);
            }
            self.poll(now);
        }
    }
}

/// Plays edges from `start` on, when the fingers have been open for long enough since power-up.
fn play(start: u32, edges: &Edges, polls: &[u32], end: u32) -> (Outcomes, State) {
    let mut bench = Bench::rested(SETTINGS, start);
    bench.play(start, edges, polls, end);
    (bench.outcomes, bench.effector.state())
}

/// Plays edges from power-up on.
fn play_from_power_up(edges: &Edges, end: u32) -> Bench {
    let mut bench = Bench::new(SETTINGS);
    bench.poll(0);
    bench.play(0, edges, &[], end);
    bench
}

/// All fingers at once.
fn all(closed: bool, at: u32) -> [(Finger, bool, u32); 3] {
    Finger::ALL.map(|finger| (finger, closed, at))
}

/// A touch of all fingers at once.
fn at_once() -> Result<Touch, Fault> {
    Ok(Touch::from_micros([0; 3]))
}

use Finger::{First, Last, Middle};

/// A touch of one finger.
fn alone(finger: usize) -> Touch {
    let mut times = [ContactTime::MISSING; 3];
    times[finger] = ContactTime::FIRST;
    Touch::new(times)
}

/// A touch of the outer fingers, the last one so much later.
fn without_middle(last: u32) -> Touch {
    Touch::new([ContactTime::FIRST, ContactTime::MISSING, ContactTime::from_micros(last)])
}

#[test]
fn contacts_are_first_closing_edges_that_last_and_begin_before_the_timeout() {
    let two = [(First, true, 100_000), (Last, true, 180_000)];
    let three = |last| [(First, true, 100_000), (Middle, true, 200_000), (Last, true, last)];
    let partial = Touch::new([ContactTime::FIRST, ContactTime::from_micros(100_000), ContactTime::MISSING]);
    let lets_go = [(First, true, 50_000), (First, false, 90_000), (First, true, 120_000)];
    let given_up = [(First, true, 50_000), (First, false, 110_000), (Middle, true, 400_000), (Middle, false, 450_000)];
    let cases: [(&str, &Edges, u32, &[Touch], State); 10] = [
        (
            "three contacts in any order",
            &[(Middle, true, 100_000), (Last, true, 150_000), (First, true, 130_000)],
            160_000,
            &[Touch::from_micros([30_000, 0, 50_000])],
            State::Complete,
        ),
        ("a finger that may still come", &two, 499_999, &[], State::Touching),
        ("a finger that is missing", &two, 500_000, &[without_middle(80_000)], State::TimedOut),
        (
            "a contact in the last moment",
            &three(499_999),
            510_000,
            &[Touch::from_micros([0, 100_000, 399_999])],
            State::Complete,
        ),
        ("a contact that is too late", &three(500_000), 510_000, &[partial], State::TimedOut),
        (
            "a finger that lets go before the others touch",
            &[&lets_go[..], &[(Middle, true, 130_000), (Last, true, 140_000)]].concat(),
            200_000,
            &[Touch::from_micros([0, 80_000, 90_000])],
            State::Complete,
        ),
        (
            "glitches shorter than the debounce",
            &[(First, true, 50_000), (First, false, 54_000), (Last, true, 70_000), (Last, false, 74_999)],
            2_000_000,
            &[],
            State::Waiting,
        ),
        // The next approach's middle finger comes before the first one's time is up.
        ("an approach given up, and the next", &given_up, 600_000, &[alone(0), alone(1)], State::Waiting),
        // Over 100 ms after the finger has settled open.
        ("an approach that may go on", &given_up[..2], 214_999, &[], State::Touching),
        ("an approach that was given up", &given_up[..2], 215_000, &[alone(0)], State::Waiting),
    ];
    for (what, edges, end, touches, state) in cases {
        let (outcomes, ended) = play(0, edges, &[], end);
        assert_eq!(outcomes, touches.iter().copied().map(Ok).collect::<Vec<_>>(), "{what}");
        assert_eq!(ended, state, "{what}");
    }
}

#[test]
fn states_follow_a_touch_from_waiting_to_waiting() {
    let mut bench = Bench::new(SETTINGS);
    let mut state_at = |at: u32, edges: &[(Finger, bool)]| {
        edges.iter().for_each(|&(finger, closed)| bench.edges(&[(finger, closed, at)]));
        bench.poll(at);
        bench.effector.state()
    };
    let power_up = 10_000_u32.wrapping_sub(SETTINGS.release);
    assert_eq!(state_at(power_up, &[]), State::Released, "at power-up an approach may be going on");
    assert_eq!(state_at(9_999, &[]), State::Released);
    assert_eq!(state_at(10_000, &[]), State::Waiting);
    assert_eq!(state_at(20_000, &[(First, true)]), State::Waiting, "not settled yet");
    assert_eq!(state_at(25_000, &[]), State::Touching);
    assert_eq!(state_at(30_000, &[(Middle, true), (Last, true)]), State::Touching);
    assert_eq!(state_at(35_000, &[]), State::Complete);
    assert_eq!(state_at(50_000, &[(First, false), (Middle, false), (Last, false)]), State::Complete);
    assert_eq!(state_at(55_000, &[]), State::Released);
    assert_eq!(state_at(64_999, &[]), State::Released);
    assert_eq!(state_at(65_000, &[]), State::Waiting);
    assert_eq!(state_at(70_000, &[(First, true)]), State::Waiting);
    assert_eq!(state_at(470_000, &[]), State::TimedOut);
}

#[test]
fn a_probe_that_rests_too_shortly_after_a_touch_has_to_open_again() {
    // The fingers have settled at 105 ms and rested at 115 ms.
    let changes = [(true, 50_000), (false, 100_000), (true, 114_999), (false, 150_000), (true, 165_000)];
    let edges = changes.map(|(closed, at)| all(closed, at)).concat();
    assert_eq!(play(0, &edges, &[], 200_000).0, [at_once(); 2]);
}

#[test]
fn fault_stuck_names_the_finger_once_and_the_others_go_on_when_it_opens() {
    let mut edges = all(true, 50_000).to_vec();
    edges.extend([(First, false, 100_000), (Last, false, 100_000)]);
    let stuck = [at_once(), Err(Fault::Stuck(Middle))];
    assert_eq!(play(0, &edges, &[], 60_000_000), (stuck.to_vec(), State::Complete));
    edges.push((Middle, false, 60_000_000));
    edges.extend(all(true, 61_000_000));
    assert_eq!(play(0, &edges, &[], 61_010_000).0, [&stuck[..], &[at_once()]].concat());
}

#[test]
fn a_finger_stuck_since_power_up_for_longer_than_the_clock_goes_round_still_opens() {
    let mut bench = play_from_power_up(&[(Last, true, 0)], 5_000_000);
    assert_eq!(bench.outcomes, [Err(Fault::Stuck(Last))]);
    assert_eq!(bench.effector.state(), State::Released);
    for (closed, at) in [(false, 3_000_000_000), (true, 3_001_000_000)] {
        bench.edges(&all(closed, at));
        bench.poll(at + 900_000);
    }
    assert_eq!(bench.outcomes, [Err(Fault::Stuck(Last)), at_once()]);
}

#[test]
fn fault_bouncing_names_the_finger_and_drops_the_touch() {
    let mut edges = vec![(First, true, 50_000), (Last, true, 60_000)];
    edges.extend((0..20).map(|i| (Middle, i % 2 == 0, 70_000 + i * 2_000)));
    assert_eq!(play(0, &edges, &[], 2_000_000), (vec![Err(Fault::Bouncing(Middle))], State::Released));
}

#[test]
fn bouncing_for_an_hour_is_told_once_and_ends() {
    let mut bench = Bench::new(SETTINGS);
    let mut now = 0_u32;
    // Ends closed, more than half a turn of the clock after the bouncing began.
    for change in 0..750_001 {
        now = now.wrapping_add(4_000);
        bench.edges(&[(First, change % 2 == 0, now)]);
    }
    assert_eq!(bench.outcomes, [Err(Fault::Bouncing(First))]);
    now = now.wrapping_add(6_000_000);
    bench.poll(now);
    for settled in [false, true] {
        bench.edges(&all(settled, now));
        now = now.wrapping_add(1_000_000);
        bench.poll(now);
    }
    assert_eq!(bench.outcomes, [Err(Fault::Bouncing(First)), Err(Fault::Stuck(First)), at_once()]);
}

#[test]
fn fault_silent_names_the_finger_after_so_many_touches_without_it() {
    let edges = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|touch| {
        let at = 50_000 + touch * 1_000_000;
        [(First, true, at), (Last, true, at + 7), (First, false, at + 500_000), (Last, false, at + 500_000)]
    });
    let (outcomes, _) = play(0, edges.as_flattened(), &[], 10_000_000);
    let silent: Vec<usize> =
        outcomes.iter().enumerate().filter(|(_, o)| **o == Err(Fault::Silent(Middle))).map(|(i, _)| i).collect();
    assert_eq!((outcomes.len(), silent), (11, vec![4, 9]), "after the fourth and the eighth touch");
}

/// Three pins and a clock.
#[derive(Clone)]
struct Pins {
    levels: [Rc<Cell<Option<bool>>>; 3],
    clock: TestClock,
}

impl Pins {
    fn open() -> Self {
        Self::new([Some(false); 3])
    }

    /// Pins with these levels; without one, a pin cannot be read.
    fn new(levels: [Option<bool>; 3]) -> Self {
        Self { levels: levels.map(|level| Rc::new(Cell::new(level))), clock: TestClock::default() }
    }

    fn fingers(&self) -> Fingers<TestPin, TestPin, TestPin> {
        let [a, b, c] = self.levels.clone().map(TestPin);
        Fingers::new(a, b, c, Active::High)
    }
}

/// Pins, their watcher with a queue of `N` edges, and what the main loop makes of them.
struct Board<const N: usize> {
    pins: Pins,
    watcher: Watcher<TestPin, TestPin, TestPin, N>,
    effector: Effector,
    outcomes: Outcomes,
}

impl<const N: usize> Board<N> {
    fn open(steps: &[u32]) -> Self {
        Self::start(Pins::open(), steps)
    }

    /// A board whose main loop has run at these times.
    fn start(pins: Pins, steps: &[u32]) -> Self {
        let watcher = Watcher::start(pins.fingers(), &pins.clock);
        let Bench { effector, outcomes } = Bench::new(SETTINGS);
        let mut board = Self { pins, watcher, effector, outcomes };
        steps.iter().for_each(|&at| board.step(at));
        board
    }

    /// Pins change.
    fn change(&mut self, at: u32, changes: &[(Finger, bool)]) {
        self.pins.clock.0.set(at);
        for &(finger, closed) in changes {
            finger.of(&mut self.pins.levels).set(Some(closed));
        }
    }

    /// Pins change, and interrupt.
    fn set(&mut self, at: u32, changes: &[(Finger, bool)]) {
        self.change(at, changes);
        self.watcher.interrupt(&self.pins.clock);
    }

    /// All pins change at once, and interrupt.
    fn set_all(&mut self, at: u32, closed: bool) {
        self.set(at, &Finger::ALL.map(|finger| (finger, closed)));
    }

    /// An interrupt that was held off.
    fn interrupt_late(&mut self) {
        self.watcher.interrupt_late(&self.pins.clock);
    }

    /// The main loop, once.
    fn step(&mut self, at: u32) {
        self.pins.clock.0.set(at);
        let Self { pins, watcher, effector, outcomes } = self;
        while let Some(outcome) = drain(effector, || watcher.sense(&pins.clock)).transpose() {
            outcomes.push(outcome);
        }
    }
}

#[test]
fn a_lost_pulse_drops_its_own_touch_at_once_and_no_later_one_and_the_chip_sleeps_again() {
    let mut board = Board::<3>::open(&[0, 150_000]);
    // The first finger bounces until the queue is full; then the middle one touches and lets go.
    board.set(200_000, &[(First, true)]);
    board.set(200_500, &[(First, false)]);
    board.set(201_000, &[(First, true)]);
    board.set(210_000, &[(Middle, true)]);
    board.set(240_000, &[(Middle, false)]);
    assert!(!board.watcher.is_idle(), "the loss is to be told");
    board.step(250_000);
    assert_eq!(board.outcomes, [Err(Fault::Overrun)], "at once, though nothing more is to be read");
    assert!(board.watcher.is_idle(), "the chip may sleep");
    // Without a middle contact the rest would be another touch than the one that was made.
    board.set(260_000, &[(Last, true)]);
    board.step(300_000);
    board.set(400_000, &[(First, false), (Last, false)]);
    board.step(401_000);
    assert!(board.watcher.is_idle());
    // The next one is whole.
    for (finger, at) in [(First, 600_000), (Last, 620_000), (Middle, 640_000)] {
        board.set(at, &[(finger, true)]);
        board.step(at);
    }
    board.step(700_000);
    assert_eq!(board.outcomes[1..], [Ok(Touch::from_micros([0, 40_000, 20_000]))]);
    assert!(board.watcher.is_idle());
}

#[test]
fn a_first_contact_that_is_lost_while_the_probe_rests_drops_its_touch() {
    let mut board = Board::<3>::open(&[0, 150_000]);
    board.set_all(200_000, true);
    board.step(210_000);
    // The openings fill the queue, and the first contact of the next approach is lost, while the main loop is busy.
    board.set_all(300_000, false);
    board.set(330_000, &[(First, true)]);
    board.set(340_000, &[(First, false)]);
    board.step(350_000);
    board.set(360_000, &[(Middle, true), (Last, true)]);
    board.step(390_000);
    board.set(400_000, &[(Middle, false), (Last, false)]);
    board.step(900_000);
    assert_eq!(board.outcomes, [at_once(), Err(Fault::Overrun)]);
}

#[test]
fn an_edge_found_after_the_interrupt_was_held_off_is_no_contact_time() {
    let mut board = Board::<8>::open(&[0, 50_000]);
    // Flash is erased: nothing changes, then a finger closes meanwhile.
    board.interrupt_late();
    board.set(100_000, &[(First, true)]);
    board.change(120_000, &[(Middle, true)]);
    board.change(145_000, &[]);
    board.interrupt_late();
    board.set(150_000, &[(Last, true)]);
    board.step(300_000);
    board.set_all(400_000, false);
    board.step(900_000);
    assert_eq!(board.outcomes, [Err(Fault::Overrun)]);
    // The next touch counts, also after a pause in which nothing changed.
    board.interrupt_late();
    board.set_all(1_000_000, true);
    board.step(1_200_000);
    assert_eq!(board.outcomes[1..], [at_once()]);
}

#[test]
fn the_time_until_something_is_due_is_the_time_until_something_happens() {
    let mut board = Board::<8>::open(&[50_000_u32.wrapping_sub(SETTINGS.release), 50_000]);
    assert_eq!(board.effector.due(50_000), None);
    board.set(100_000, &[(First, true)]);
    board.step(100_000);
    // Asleep in between, it sees the touch end in the same microsecond as one that never sleeps.
    let mut now = 100_000;
    while board.outcomes.is_empty() {
        let due = board.effector.due(now).unwrap();
        assert!(due > 0);
        board.step(now + due - 1);
        assert_eq!(board.outcomes.len(), 0);
        now += due;
        board.step(now);
    }
    assert_eq!(now, 500_000);
}

#[test]
fn a_switch_that_is_closed_at_power_up_is_seen_before_any_interrupt_and_is_no_contact_of_a_later_touch() {
    let mut board = Board::<64>::start(Pins::new([false, true, false].map(Some)), &[0, 1_000_000]);
    // The first finger's interrupt must not read the middle one as touching at the same time.
    board.set(1_000_000, &[(First, true)]);
    board.step(1_500_000);
    board.step(6_000_000);
    assert!(!board.outcomes.iter().any(|outcome| outcome.is_ok()), "{:?}", board.outcomes);
    assert!(board.outcomes.contains(&Err(Fault::Stuck(Middle))), "{:?}", board.outcomes);
}

#[test]
fn an_opening_that_did_not_fit_into_the_queue_is_read_again_without_another_interrupt() {
    // Room for four edges.
    let mut board = Board::<4>::open(&[0, 50_000]);
    board.set_all(100_000, true);
    // The main loop is busy: of three openings one fits.
    board.set_all(200_000, false);
    board.step(201_000);
    board.step(300_000);
    for finger in Finger::ALL {
        board.set(400_000, &[(finger, true)]);
    }
    board.step(500_000);
    assert_eq!(
        board.outcomes.last(),
        Some(&at_once()),
        "no finger's next closing looks unchanged: {:?}",
        board.outcomes
    );
    board.set_all(600_000, false);
    board.step(20_000_000);
    assert!(board.outcomes.contains(&Err(Fault::Overrun)), "{:?}", board.outcomes);
    assert!(!board.outcomes.iter().any(|outcome| matches!(outcome, Err(Fault::Stuck(_)))), "{:?}", board.outcomes);
}

#[test]
fn unreadable_pins_are_all_reported_although_a_touch_comes_at_the_same_time() {
    let mut board = Board::<8>::start(Pins::new([Some(false), None, None]), &[]);
    Bench { effector: board.effector, outcomes: board.outcomes } = Bench::rested(SETTINGS, 100_000);
    board.set(100_000, &[(First, true)]);
    // Touch and faults are there at the same time.
    board.step(600_000);
    assert_eq!(board.outcomes, [Err(Fault::Unreadable(Middle)), Ok(alone(0)), Err(Fault::Unreadable(Last))]);
}

#[test]
fn an_approach_that_goes_on_through_a_power_cut_is_no_touch_though_no_finger_was_closed_at_power_up() {
    // A finger has touched and let go; the others touch within the same approach, 90 ms after power-up.
    let rest = [(Middle, true, 90_000), (Last, true, 95_000), (Middle, false, 200_000), (Last, false, 200_000)];
    let next = [(First, true, 400_000), (First, false, 500_000)];
    let Bench { effector, outcomes } = play_from_power_up(&[&rest[..], &next].concat(), 700_000);
    assert_eq!((outcomes, effector.state()), (vec![Ok(alone(0))], State::Waiting));
}

#[test]
fn an_approach_that_goes_on_after_its_touch_was_dropped_is_no_other_touch() {
    // Edges are lost while the first finger lets go for a while; then the last one touches.
    let mut bench = Bench::rested(SETTINGS, 0);
    bench.play(0, &[(First, true, 50_000)], &[], 90_000);
    let opened = Edge { after_loss: true, ..Edge::new(First, false, 100_000) };
    bench.outcomes.extend(bench.effector.edge(opened).transpose());
    bench.edges(&[(Last, true, 160_000), (Last, false, 300_000), (Last, true, 600_000)]);
    bench.poll(2_000_000);
    assert_eq!(bench.outcomes, [Err(Fault::Overrun), Ok(alone(2))]);
}

/// Touch that an effector makes of fingers at these times after the first contact.
fn touched(settings: EffectorSettings, times: [u32; 3]) -> Outcomes {
    let mut bench = Bench::rested(settings, 50_000);
    Finger::ALL.into_iter().zip(times).for_each(|(finger, at)| bench.edges(&[(finger, true, 50_000 + at)]));
    bench.poll(100_000 + times[2]);
    bench.outcomes
}

#[test]
fn the_timeout_is_that_of_the_model_and_so_no_full_touch_becomes_a_partial_one() {
    let spread = 1_050_000;
    let touches = TrainedTouches { largest_spread: spread, ..TrainedTouches::full(false) };
    let bytes = model_of(None, Some(touches));
    let model = crate::Model::new(&bytes).unwrap();
    let half_speed = Scale::new(Geometry { spacing: 10, speed: 10 }, Geometry { spacing: 10, speed: 5 }).unwrap();
    for (scale, spread) in [(Scale::IDENTITY, spread), (half_speed, 2 * spread)] {
        let times = [0, spread / 2, spread];
        assert_eq!(touched(SETTINGS.for_model(&model, &scale), times), [Ok(Touch::from_micros(times))]);
        assert!(model.accepts(&scale.apply(&Touch::from_micros(times))).is_ok());
    }
    let unstated = model_of(None, None);
    let unstated = crate::Model::new(&unstated).unwrap();
    assert_eq!(SETTINGS.for_model(&unstated, &Scale::IDENTITY), SETTINGS);
    assert!(EffectorSettings::default().timeout > spread, "longer than the paper's probe takes");
}

#[test]
fn the_timeout_of_a_model_with_a_stroke_is_the_strokes_time_and_what_comes_later_is_missing() {
    let stroke = 300_000;
    let touches = TrainedTouches { largest_spread: stroke, ..TrainedTouches::full(false) };
    let probe = TrainedProbe {
        radius: 0.15,
        spacing: 1.5,
        speed: 10.0,
        length: palpate_shared::format::Length::Tenth,
        stroke: Some(3.0),
        travel: None,
        cone: 0,
        stroke_tolerance: None,
    };
    let bytes = model_of(Some(probe), Some(touches));
    let model = crate::Model::new(&bytes).unwrap();
    for (last, expected) in [(stroke, Some(stroke)), (stroke + 1, None), (stroke + 9_000, None)] {
        let outcomes = touched(SETTINGS.for_model(&model, &Scale::IDENTITY), [0, 70_000, last]);
        let last = expected.map_or(ContactTime::MISSING, ContactTime::from_micros);
        assert_eq!(outcomes, [Ok(Touch::new([ContactTime::FIRST, ContactTime::from_micros(70_000), last]))]);
    }
    // With another probe, too, no contact that it waits for is later to the model than its stroke.
    for (spacing, speed) in [(7, 10), (10, 5), (19, 3), (5, 31)] {
        let scale = Scale::new(Geometry { spacing: 10, speed: 10 }, Geometry { spacing, speed }).unwrap();
        let longest = SETTINGS.for_model(&model, &scale).timeout - 1;
        for times in [[0, longest / 2, longest], [0, longest, 0], [longest, 0, longest]] {
            let touch = scale.apply(&Touch::from_micros(times));
            assert!(touch.spread() <= stroke, "{spacing} {speed}: {touch:?}");
        }
    }
}

/// A model without a tree that states this probe and these touches.
fn model_of(probe: Option<TrainedProbe>, touches: Option<TrainedTouches>) -> Vec<u8> {
    let mut sections = Vec::new();
    let mut put = |tag: Tag, must_understand: bool, content: &[u8]| {
        let section = Section { tag: tag.code(), must_understand, content };
        section.write(&mut |bytes| sections.extend_from_slice(bytes));
    };
    if let Some(probe) = probe {
        put(Tag::Probe, false, &probe.to_bytes()[..probe.length()]);
    }
    if let Some(touches) = touches {
        put(Tag::Touches, true, &touches.to_bytes());
    }
    let length = 96 + 4 + sections.len() + 4 + 4 + 4;
    let header = HeaderBuilder::default()
        .with_descriptor(1)
        .with_last_feature(1)
        .with_leaf(1)
        .with_unit(0.5)
        .with_unit_bits(3_098_164_010)
        .with_odds(1 << 49)
        .with_max_touches(60)
        .with_text_length(4)
        .with_length(length as u32)
        .with_optional_length(sections.len() as u32);
    let mut bytes = [&header.bytes()[..], &[0, 1, b'a', 0], &sections, &[0; 8]].concat();
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes
}

#[test]
fn fault_unreadable_names_the_pin_once_until_it_can_be_read_again() {
    let pins = Pins::open();
    let mut probe = Probe::new(pins.fingers(), pins.clock.clone(), SETTINGS);
    let outcomes = [Some(false), None, None, Some(false), None].map(|level| {
        pins.levels[1].set(level);
        probe.poll()
    });
    let fault = Err(Fault::Unreadable(Middle));
    assert_eq!(outcomes, [Ok(None), fault, Ok(None), Ok(None), fault]);
}

#[test]
fn each_poll_reads_each_pin_once_and_active_low_switches_close_to_low() {
    // A touch of the fingers at 20, 21 and 23 ms, polled once per millisecond.
    let levels = |contact: usize| {
        let level = move |i| if i >= contact { Level::Low } else { Level::High };
        (0..30).map(|i| Transaction::get(level(i))).collect::<Vec<_>>()
    };
    let [first, middle, last] = [20, 21, 23].map(|contact| Mock::new(&levels(contact)));
    let clock = TestClock::default();
    let settings = EffectorSettings { release: 10_000, ..SETTINGS };
    let mut probe = Probe::new(Fingers::new(first, middle, last, Active::Low), clock.clone(), settings);
    let mut touches = Vec::new();
    for i in 0..30 {
        clock.0.set(i * 1_000);
        touches.extend(probe.poll().unwrap());
    }
    assert_eq!(touches, [Touch::from_micros([0, 1_000, 3_000])]);
    assert_eq!(probe.state(), State::Complete);
    let (a, b, c) = probe.into_parts().0.into_pins();
    [a, b, c].iter_mut().for_each(Mock::done);
}

#[test]
fn every_fault_says_what_to_do() {
    for finger in Finger::ALL {
        for fault in [Fault::Stuck(finger), Fault::Bouncing(finger), Fault::Silent(finger), Fault::Unreadable(finger)] {
            let text = std::format!("{fault}");
            assert!(text.contains(&std::format!("{finger}")) && text.contains(':'), "{text}");
            assert_eq!(fault.finger(), Some(finger));
        }
    }
    for fault in [Fault::Overrun, Fault::Clock] {
        let text = std::format!("{fault}");
        assert!(text.contains(':') && fault.finger().is_none(), "{text}");
    }
}

/// Touches half a second apart, polled each millisecond, by a counter of this many bits that starts at `start`.
fn by_counter(bits: u32, start: u64, touches: u64) -> Outcomes {
    let mut bench = Bench::new(SETTINGS);
    for at in (0..touches * 500_000).step_by(1_000) {
        let now = u32::try_from((start + at) % (1 << bits)).unwrap();
        for (finger, time) in [(First, 0), (Middle, 20_000), (Last, 35_000)] {
            // The first touch after the rest at power-up.
            for (closed, time) in [(true, 150_000 + time), (false, 210_000)] {
                if at % 500_000 == time {
                    bench.edges(&[(finger, closed, now)]);
                }
            }
        }
        bench.poll(now);
    }
    bench.outcomes
}

#[test]
fn a_counter_of_fewer_than_32_bits_that_wraps_in_a_touch_is_a_fault_and_costs_no_later_touch() {
    let touch = Ok(Touch::from_micros([0, 20_000, 35_000]));
    assert_eq!(by_counter(32, (1 << 32) - 165_000, 3), [touch; 3]);
    for bits in [16, 20, 24, 28] {
        // In the first touch, between its first contact and the next.
        let outcomes = by_counter(bits, (1 << bits) - 165_000 % (1 << bits), 8);
        assert_eq!(outcomes[0], Err(Fault::Clock), "{bits} bits");
        assert!(outcomes.iter().flatten().all(|of| Ok(*of) == touch), "{bits} bits: {outcomes:?}");
        // A counter of 16 bits goes round within each touch.
        assert_eq!(outcomes.iter().flatten().count(), if bits == 16 { 0 } else { 7 }, "{bits} bits: {outcomes:?}");
    }
}

#[test]
fn a_reading_of_the_clock_that_is_ahead_drops_its_touch_and_no_later_one() {
    let mut bench = Bench::new(SETTINGS);
    for (from, ahead) in [(0, 1 << 16), (1_000_000, 0)] {
        bench.poll(from);
        bench.poll(from + 200_000);
        for (finger, time) in [(First, 200_000), (Middle, 220_000), (Last, 235_000)] {
            bench.edges(&[(finger, true, from + time)]);
            bench.poll(from + time + 6_000 + if finger == First { ahead } else { 0 });
        }
        bench.edges(&all(false, from + 300_000));
        bench.poll(from + 900_000);
    }
    assert_eq!(bench.outcomes, [Err(Fault::Clock), Ok(Touch::from_micros([0, 20_000, 35_000]))]);
}

#[test]
fn an_edge_that_is_a_little_older_than_the_last_poll_counts_as_now() {
    let mut bench = Bench::rested(SETTINGS, 200_000);
    bench.edges(&[(First, true, 200_000)]);
    bench.poll(240_000);
    bench.edges(&[(Middle, true, 210_000), (Last, true, 210_000)]);
    bench.poll(250_000);
    assert_eq!(bench.outcomes, [Ok(Touch::from_micros([0, 40_000, 40_000]))]);
}

#[test]
fn settings_out_of_range_are_brought_into_it() {
    let settings = EffectorSettings {
        debounce: u32::MAX,
        settle: 0,
        timeout: u32::MAX,
        release: u32::MAX,
        rest: u32::MAX,
        stuck: 0,
        silent_after: 0,
    };
    let mut effector = Effector::new(settings);
    for at in 0..1_000 {
        let closed = at % 3 == 0;
        assert_eq!(effector.edge(Edge::new(First, closed, at * 1_000)), Ok(None));
    }
    // 2^30 µs each: rest at power-up, the debouncing of a touch, and one more until a finger counts as stuck.
    let longest = 1 << 30;
    let mut effector = Effector::new(settings);
    assert_eq!((effector.poll(0), effector.poll(longest)), (Ok(None), Ok(None)));
    assert_eq!(effector.state(), State::Waiting);
    for finger in Finger::ALL {
        assert_eq!(effector.edge(Edge::new(finger, true, longest)), Ok(None));
    }
    assert_eq!(effector.poll(2 * longest - 1), Ok(None));
    assert_eq!(effector.poll(2 * longest), Ok(Some(Touch::from_micros([0; 3]))));
    assert_eq!(effector.poll(2 * longest + 1), Ok(None));
    assert_eq!(effector.poll(2 * longest + 2), Err(Fault::Stuck(First)));
}

/// A clock that stands where the test puts it.
#[derive(Clone, Default)]
struct TestClock(Rc<Cell<u32>>);

impl Clock for TestClock {
    fn micros(&self) -> u32 {
        self.0.get()
    }
}

/// A pin that has the level the test gives it, or cannot be read.
struct TestPin(Rc<Cell<Option<bool>>>);

impl embedded_hal::digital::ErrorType for TestPin {
    type Error = ErrorKind;
}

impl embedded_hal::digital::InputPin for TestPin {
    fn is_high(&mut self) -> Result<bool, Self::Error> {
        self.0.get().ok_or(ErrorKind::Other)
    }

    fn is_low(&mut self) -> Result<bool, Self::Error> {
        self.is_high().map(|is_high| !is_high)
    }
}

fn touches(outcomes: &Outcomes) -> Vec<Touch> {
    outcomes.iter().flatten().copied().collect()
}

fn finger() -> impl Strategy<Value = Finger> {
    prop::sample::select(Finger::ALL.to_vec())
}

/// Random edges in order of time, with pauses from bounces to minutes.
fn edges() -> impl Strategy<Value = Vec<(Finger, bool, u32)>> {
    let pause = prop_oneof![3 => 0..3_000_u32, 3 => 0..30_000_u32, 2 => 0..600_000_u32, 1 => 0..20_000_000_u32];
    prop::collection::vec((finger(), any::<bool>(), pause), 0..80).prop_map(|edges| {
        let mut now = 0;
        edges
            .into_iter()
            .map(|(finger, closed, pause)| {
                now += pause;
                (finger, closed, now)
            })
            .collect()
    })
}

/// One finger's contact in a touch: how long after the first, and the pauses of its bouncing.
fn contact() -> impl Strategy<Value = (u32, Vec<u32>)> {
    (0..300_000_u32, prop::collection::vec(1..4_900_u32, 0..4))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn outcomes_depend_on_the_edges_and_neither_on_the_clock_nor_on_how_often_one_polls(
        edges in edges(),
        polls in prop::collection::vec(0..40_000_000_u32, 0..200),
        dense in prop::collection::vec(0..2_000_000_u32, 0..200),
        start: u32,
    ) {
        let end = edges.last().map_or(0, |e| e.2) + 10_000_000;
        let seldom = play(start, &edges, &[], end);
        prop_assert_eq!(&play(0, &edges, &[], end), &seldom);
        let often = play(start, &edges, &[polls, dense].concat(), end);
        // Faults due at the same time as a touch may be reported before or after it.
        prop_assert_eq!(touches(&seldom.0), touches(&often.0));
        let faults = |outcomes: &Outcomes| {
            let mut faults: Vec<_> = outcomes.iter().filter_map(|o| o.err()).map(|f| std::format!("{f:?}")).collect();
            faults.sort();
            faults.dedup();
            faults
        };
        prop_assert_eq!(faults(&seldom.0), faults(&often.0));
        prop_assert_eq!(seldom.1, often.1);
    }

    #[test]
    fn any_order_of_events_gives_touches_within_the_timeout(
        events in prop::collection::vec((finger(), any::<bool>(), any::<bool>(), any::<u32>(), any::<bool>()), 0..200),
    ) {
        let mut effector = Effector::new(SETTINGS);
        for (finger, closed, after_loss, at, is_poll) in events {
            let outcome = match is_poll {
                true => effector.poll(at),
                false => effector.edge(Edge { after_loss, ..Edge::new(finger, closed, at) }),
            };
            if let Ok(Some(touch)) = outcome {
                let times: Vec<u32> = touch.times().iter().filter_map(|t| t.micros()).collect();
                prop_assert_eq!(times.iter().min(), Some(&0));
                prop_assert!(times.iter().all(|&t| t < SETTINGS.timeout), "{:?}", times);
            }
        }
    }

    #[test]
    fn a_bouncing_touch_has_the_times_of_its_first_edges_at_any_clock(
        contacts in prop::array::uniform3(contact()),
        start: u32,
    ) {
        let mut edges = Vec::new();
        for (finger, (after, bounces)) in Finger::ALL.into_iter().zip(&contacts) {
            let mut at = 50_000 + after;
            edges.push((finger, true, at));
            for (i, pause) in bounces.iter().enumerate() {
                at += pause;
                edges.push((finger, i % 2 == 1, at));
            }
            if bounces.len() % 2 == 1 {
                edges.push((finger, true, at + 100));
            }
        }
        edges.sort_by_key(|&(_, _, at)| at);
        let touch = Touch::from_micros(contacts.map(|(after, _)| after));
        prop_assert_eq!(play(start, &edges, &[], 800_000).0, [Ok(touch)]);
    }

    #[test]
    fn interrupts_and_polling_at_every_edge_agree(edges in edges(), start: u32) {
        let end = edges.last().map_or(0, |e| e.2) + 10_000_000;
        let pins = Pins::open();
        pins.clock.0.set(start);
        let mut probe = Probe::new(pins.fingers(), pins.clock.clone(), SETTINGS);
        let mut polled = Outcomes::new();
        polled.extend(probe.poll().transpose());
        let mut board = Board::<127>::start(pins.clone(), &[start]);
        for (i, &(finger, closed, at)) in edges.iter().enumerate() {
            let now = start.wrapping_add(at);
            // What was due before the edge is handed over before the pin changes, as it is on a chip.
            board.change(now, &[]);
            (0..8).for_each(|_| polled.extend(probe.poll().transpose()));
            board.change(now, &[(finger, closed)]);
            (0..8).for_each(|_| polled.extend(probe.poll().transpose()));
            board.set(now, &[]);
            if i % 3 == 0 {
                board.step(now);
            }
        }
        board.step(start.wrapping_add(end));
        (0..8).for_each(|_| polled.extend(probe.poll().transpose()));
        prop_assert_eq!(touches(&polled), touches(&board.outcomes));
    }

    #[test]
    fn a_scale_there_and_back_gives_the_touch_again(
        times in prop::array::uniform3(0..2_000_000_u32),
        spacing in 800..1_250_u32,
        speed in 500..2_000_u32,
    ) {
        let model = Geometry { spacing: 1_000, speed: 1_000 };
        let probe = Geometry { spacing, speed };
        let touch = Touch::from_micros(times);
        let there = Scale::new(model, probe).unwrap().apply(&touch);
        let back = Scale::new(probe, model).unwrap().apply(&there);
        for (a, b) in touch.times().into_iter().zip(back.times()) {
            let (a, b) = (a.micros().unwrap(), b.micros().unwrap());
            // Rounding to microseconds and the factors' 16 binary places.
            prop_assert!(a.abs_diff(b) <= 400, "{} {}", a, b);
        }
    }
}

#[test]
fn scale_follows_planes_and_parabolas_exactly_and_speed_everywhere() {
    // Height h(x) = 6·x + 4·x² at x = −s, 0, s; times are heights over speed, here in µs.
    let touch = |s: u32, slowness: u32| {
        let [plane, parabola] = [6 * s * slowness, 4 * s * s * slowness];
        let middle = plane; // keeps everything positive
        Touch::from_micros([middle + parabola - plane, middle, middle + parabola + plane])
    };
    let model = Geometry { spacing: 100, speed: 1_000 };
    let probe = Geometry { spacing: 200, speed: 500 };
    let scale = Scale::new(model, probe).unwrap();
    assert_eq!(scale.apply(&touch(200, 2)), touch(100, 1));
    assert_eq!(scale.apply(&without_middle(4_000)), without_middle(1_000));
    assert_eq!(scale.apply(&alone(1)), alone(1));
}

#[test]
fn scale_of_the_models_own_probe_changes_nothing() {
    let geometry = Geometry { spacing: 1_500, speed: 10_000 };
    assert_eq!(Scale::new(geometry, geometry), Some(Scale::IDENTITY));
    let longest = Touch::from_micros([0, u32::MAX - 1, 5]);
    assert_eq!(Scale::IDENTITY.apply(&longest), longest);
}

#[test]
fn scale_takes_extremes_without_overflow_and_refuses_worse() {
    let small = Geometry { spacing: 1, speed: 1 };
    let of = |spacing, speed| {
        let probe = Geometry { spacing, speed };
        [Scale::new(small, probe), Scale::new(probe, small)]
    };
    for scale in [of(16, 16), of(16, 1)].as_flattened() {
        for times in [[0, u32::MAX - 1, 0], [u32::MAX - 1, 0, u32::MAX - 1], [0, 0, u32::MAX - 1]] {
            assert!(scale.unwrap().apply(&Touch::from_micros(times)).is_full());
        }
    }
    assert_eq!([of(17, 1), of(1, 0), of(0, 1)], [[None; 2]; 3]);
}

#[test]
fn calibration_finds_the_speed_under_noise_and_from_both_ends() {
    // 12 mm spacing on a 1 : 6 wedge at 80 mm/s: 50 ms from end to end; deterministic noise of ±5 ms.
    let mut calibration = Calibration::new(12_000, 1, 6);
    for i in 0..200_u32 {
        let noise = [(i * 7_919) % 10_001, (i * 104_729) % 10_001, (i * 1_299_709) % 10_001];
        let [a, b, c] = if i % 2 == 0 { [0, 25_000, 50_000] } else { [50_000, 25_000, 0] };
        assert!(calibration.push(&Touch::from_micros([a + noise[0], b + noise[1], c + noise[2]])));
    }
    let speed = calibration.speed().unwrap();
    assert!(speed.abs_diff(80_000) < 800, "{speed}");
}

#[test]
fn calibration_says_what_is_wrong() {
    let run = |touch: Touch, count: u32, rise: u16| {
        let mut calibration = Calibration::new(12_000, rise, 6);
        for _ in 0..count {
            calibration.push(&touch);
        }
        calibration.speed()
    };
    let tilted = Touch::from_micros([0, 25_000, 50_000]);
    assert_eq!(run(tilted, 7, 1), Err(CalibrationError::TooFew));
    assert_eq!(run(tilted, 8, 0), Err(CalibrationError::NotTilted));
    assert_eq!(run(Touch::from_micros([0; 3]), 8, 1), Err(CalibrationError::NotTilted));
    assert_eq!(run(Touch::from_micros([0, 50_000, 50_000]), 8, 1), Err(CalibrationError::NotFlat));
    assert_eq!(run(Touch::from_micros([0, 0, 1]), 8, u16::MAX), Err(CalibrationError::NotFlat));
    assert_eq!(run(without_middle(5), 100, 1), Err(CalibrationError::TooFew));
}

#[test]
fn the_driver_takes_the_ram_that_its_documentation_states() {
    // 184 bytes, and 200 where touches may have a position.
    assert!(matches!(size_of::<Touch>(), 28 | 44));
    assert_eq!(size_of::<Effector>(), 156 + size_of::<Touch>());
    assert_eq!(size_of::<Edge>(), 8);
}
