//! Models of maps in a station: loaded, touched and asked over the link.

use super::table::Locates;
use super::*;
use crate::locate::tests::{BOTH, Heights, heights, locator, wedge};
use crate::locate::{Approach, Hand, Maps, POSE, Pose};
use crate::{Model, Verdict};
use palpate_shared::link::*;
use palpate_shared::{ContactTime, Pose as HandPose, Position, Q15_ONE, Touch};
use proptest::prelude::*;
use std::vec::Vec;
use std::{format, string::String, vec};

const TREES: &[u8] = include_bytes!("../../../models/household.palpate");

type Room = Table<4096, 32, 2>;

/// A chip's memory, which outlasts its program.
struct Kept {
    models: [Vec<u8>; 2],
    records: [[u8; RECORD_LENGTH]; 2],
}

impl Kept {
    fn new() -> Self {
        Self { models: [vec![0; 60_000], vec![0; 60_000]], records: [[0xff; RECORD_LENGTH]; 2] }
    }

    fn memory(&mut self) -> Memory<'_> {
        let Self { models: [a, b], records: [c, d] } = self;
        Memory { models: [a, b], records: [c, d] }
    }
}

/// A host and a chip on a line that loses one of so many bytes, 0 for none.
struct Line<'m> {
    host: HostEnd,
    end: DeviceEnd,
    station: Station<'m, 16, Memory<'m>, &'m mut Room>,
    loses: usize,
    bytes: usize,
    now: u64,
    open: bool,
    answers: Vec<String>,
}

impl<'m> Line<'m> {
    fn new(built_in: &'m [u8], kept: &'m mut Kept, room: &'m mut Room, loses: usize) -> Self {
        let station = Station::open_with(built_in, kept.memory(), room);
        let host = HostEnd::new(HostSettings { retry: 10_000, attempts: 1_000 });
        let end = DeviceEnd::new(1);
        let mut line = Self { host, end, station, loses, bytes: 0, now: 0, open: false, answers: Vec::new() };
        let mut sent = Vec::new();
        line.host.connect(7, 0, |frame| sent.extend_from_slice(frame));
        line.settle(sent);
        line
    }

    /// Bytes that arrive.
    fn arriving(&mut self, sent: Vec<u8>) -> Vec<u8> {
        let is_there = |_: &u8| {
            self.bytes += 1;
            self.loses == 0 || !self.bytes.is_multiple_of(self.loses)
        };
        let mut sent = sent;
        sent.retain(is_there);
        sent
    }

    /// Lets both talk until nothing is under way.
    fn settle(&mut self, mut sent: Vec<u8>) {
        for _ in 0..100_000 {
            let down = self.arriving(std::mem::take(&mut sent));
            let mut up = Vec::new();
            self.end.receive(&down, &mut self.station, |frame| up.extend_from_slice(frame));
            let up = self.arriving(up);
            self.now += 3_000;
            let Self { host, now, open, answers, .. } = self;
            host.receive(
                &up,
                *now,
                |frame| sent.extend_from_slice(frame),
                |incoming| match incoming {
                    Incoming::Opened => *open = true,
                    Incoming::Answer(answer) => answers.push(format!("{answer:?}")),
                    Incoming::Event { .. } | Incoming::Stranger => {}
                },
            );
            host.tick(*now, |frame| sent.extend_from_slice(frame)).unwrap();
            if self.open && self.host.is_idle() {
                return;
            }
        }
        panic!("{:?}", self.host.statistics());
    }

    fn ask(&mut self, request: Request<'_>) -> String {
        let mut sent = Vec::new();
        assert!(self.host.request(request, self.now, |frame| sent.extend_from_slice(frame)));
        self.settle(sent);
        self.answers.pop().unwrap()
    }

    fn press(&mut self, touch: &Touch) -> String {
        self.ask(Request::of_touch(touch, true))
    }

    /// Loads a model; the last answer.
    fn load(&mut self, bytes: &[u8]) -> String {
        self.ask(Request::Begin { length: bytes.len() as u32, checksum: checksum(bytes) });
        let chunks = bytes.chunks(CHUNK).enumerate();
        chunks.map(|(at, bytes)| self.ask(Request::Chunk { offset: (at * CHUNK) as u32, bytes })).last().unwrap()
    }
}

/// The touch of an approach to an object at a place in millimeters, turned by this many radians.
fn touch(height: Heights, at: Approach, place: [f64; 2], yaw: f64) -> Touch {
    let ([cosine, sine], heights) = heights(height, at, place, yaw);
    let highest = heights.into_iter().fold(0.0, f64::max);
    let times = heights.map(|height| match highest - height {
        // A hand of 100 mm per second, with a stroke of 20 mm.
        way if way <= 20.0 => ContactTime::from_micros((way * 1e4) as u32),
        _ => ContactTime::MISSING,
    });
    let alignment = [cosine, sine, 0.0].map(|share| (share * f64::from(Q15_ONE)) as i16);
    let position = Position { micrometers: [at.x, at.y, (highest * 1e3) as i32] };
    Touch::new(times).with_pose(HandPose { direction: [0, 0, -Q15_ONE], alignment }).with_position(position)
}

#[test]
fn verdicts_places_and_approaches_over_a_line_that_loses_bytes_are_those_of_a_locator() {
    let maps = Maps::new(&BOTH).unwrap();
    let hand = Hand::of(&maps).unwrap();
    for loses in [0, 157] {
        let (mut kept, mut room, mut locator) = (Kept::new(), Room::new(), locator(&BOTH));
        let mut line = Line::new(&BOTH, &mut kept, &mut room, loses);
        for (place, yaw) in [([12.0, -9.0], 0.6), ([-20.0, 17.0], 2.4)] {
            let nowhere = PlaceMessage { table_alone: false, exhausted: false, place: None };
            assert_eq!(line.ask(Request::Place { rank: 0 }), format!("Place({nowhere:?})"));
            let mut at = Approach { x: 0, y: 0, roll: 40 };
            let mut verdict = Verdict::Undecided;
            while verdict == Verdict::Undecided {
                let touch = touch(wedge, at, place, yaw);
                verdict = locator.push(&touch, hand).unwrap();
                let best = locator.leader();
                let evidence = [0, 1].map(|object| locator.posterior(object));
                let said = VerdictMessage {
                    decision: message::decision(verdict),
                    best: best as u8,
                    touches: locator.touches() as u32,
                    detail: Some(Detail::new(u64::from(evidence[best]) << 40, &locator.evidence()[..2])),
                };
                assert_eq!(line.press(&touch), format!("Verdict({said:?})"));
                let posteriors = evidence.map(|posterior| (u64::from(posterior) << 40).to_le_bytes()).concat();
                assert_eq!(line.ask(Request::Posteriors { first: 0 }), format!("Posteriors({posteriors:?})"));
                let mut poses = [Pose::default(); 4];
                let found = locator.poses(best, &mut poses);
                for rank in 0..5 {
                    let said = line.ask(Request::Place { rank });
                    match poses[..found].get(usize::from(rank)) {
                        Some(pose) => {
                            let [x, y] = pose.position;
                            let expected =
                                format!("placement: {}, position: [{x}, {y}], yaw: {},", pose.placement, pose.yaw);
                            assert!(said.contains(&expected), "{said}, not {expected}");
                        }
                        None => assert!(said.ends_with("place: None })"), "{said}"),
                    }
                }
                at = locator.choose(hand.spacing, hand.stroke.unwrap(), 2 * maps.range().unsigned_abs(), POSE);
                let next = line.ask(Request::NextPress { within: None });
                assert_eq!(next, format!("NextPress(Approach {{ x: {}, y: {}, roll: {} }})", at.x, at.y, at.roll));
                // A question that is repeated has the same answer.
                assert_eq!(line.ask(Request::NextPress { within: None }), next);
            }
            assert_eq!(verdict, locator.verdict());
            assert!(matches!(verdict, Verdict::Recognized { .. }), "{verdict:?}");
            assert_eq!(line.ask(Request::Reset), "Done");
            locator.reset();
        }
        assert_eq!(line.ask(Request::Placement { placement: 1 }), "Name(\"up\")");
        assert_eq!(line.ask(Request::Placement { placement: 2 }), "Refused(NoObject)");
        assert_eq!(line.ask(Request::Name { object: 1 }), "Name(\"object 1\")");
        assert_eq!(line.ask(Request::Name { object: 2 }), "Refused(NoObject)");
        let info = format!("length: {}, last_object: 1, descriptor: 254 }})", BOTH.len());
        assert!(line.ask(Request::Model).ends_with(&info), "{info}");
        assert_eq!(line.end.statistics().garbled > 0, loses > 0);
    }
}

#[test]
fn maps_are_loaded_in_place_of_trees_and_each_refuses_the_touches_of_the_other() {
    let maps = &*BOTH;
    let refused = |refusal: Refusal| format!("Refused({refusal:?})");
    let loaded = |bytes: &[u8]| format!("Wanted {{ offset: {} }}", bytes.len());
    let at = Approach { x: 0, y: 0, roll: 40 };
    let located = touch(wedge, at, [0.0; 2], 0.0);
    let free = Request::Touch { touch: (&Touch::from_micros([0, 30_000, 50_000])).into(), detail: false };
    let (mut kept, mut room) = (Kept::new(), Room::new());
    let mut line = Line::new(&[], &mut kept, &mut room, 0);
    assert_eq!(line.press(&located), refused(Refusal::NoModel));
    assert_eq!(line.ask(Request::NextPress { within: None }), "Refused(NoModel)");
    assert_eq!(line.load(TREES), loaded(TREES));
    assert_eq!(line.press(&located), refused(Refusal::Position));
    assert!(line.ask(free.clone()).starts_with("Verdict"));
    assert_eq!(line.load(maps), loaded(maps));
    assert_eq!(line.ask(free.clone()), refused(Refusal::NoPosition));
    let first = line.press(&located);
    assert!(first.contains("touches: 1,"), "{first}");
    // What is no model changes nothing: the touch before still counts.
    assert_eq!(line.load(&maps[..maps.len() - 1]), refused(Refusal::Invalid));
    assert!(line.press(&located).contains("touches: 2,"));
    assert_eq!(line.load(TREES), loaded(TREES));
    assert_eq!(line.press(&located), refused(Refusal::Position));
    assert!(line.ask(Request::Counts).contains("refused: 4 "));
    assert_eq!(line.load(maps), loaded(maps));
    // After a reset the maps are there, and their touches are not: the host's session is not known any more.
    drop(line);
    let mut line = Line::new(&[], &mut kept, &mut room, 0);
    assert!(line.press(&located).contains("touches: 1,"));
    assert_eq!(Device::model(&line.station).map(|info| info.checksum), Some(checksum(&maps[..maps.len() - 4])));
}

#[test]
fn a_station_without_room_for_maps_refuses_them_and_so_does_one_with_too_little() {
    let maps = &*BOTH;
    assert_eq!(().open(maps), Err(Refusal::Invalid));
    assert_eq!((&mut Table::<4096, 32, 1>::new()).open(maps), Err(Refusal::TooLong));
    assert_eq!((&mut Room::new()).open(TREES), Err(Refusal::Invalid));
    let mut room = Table::<64, 1, 2>::new();
    let mut station = Station::<16, _, _>::open_with(maps, NoStorage, &mut room);
    assert!(station.model().is_none() && Device::model(&station).unwrap().has_maps());
    assert_eq!(station.begin(1, 0), Err(Refusal::Unsupported));
    // Trees have no places.
    let mut trees = Station::<16>::new(&Model::new(TREES).unwrap());
    assert_eq!((trees.place(0), trees.placement(0)), (Err(Refusal::NoModel), None));
}

proptest! {
    #[test]
    fn any_touch_at_any_position_is_counted_or_refused(
        touches in prop::collection::vec((any::<[u32; 3]>(), any::<Option<[i16; 6]>>(), any::<[i32; 3]>(), any::<bool>()), 1..6),
        rank: u8,
        within: Option<u32>,
    ) {
        let mut room = Table::<256, 8, 2>::new();
        let mut station = Station::<16, _, _>::open_with(&BOTH, NoStorage, &mut room);
        let mut counted = 0;
        for (times, pose, position, is_down) in touches {
            let touch = Touch::new(times.map(ContactTime::from_micros));
            let touch = match pose {
                Some([x, y, z, a, b, c]) => {
                    let direction = if is_down { [x, y, i16::MIN] } else { [x, y, z.max(-31_127)] };
                    touch.with_pose(HandPose { direction, alignment: [a, b, c] })
                }
                None => touch,
            };
            match station.press(&touch, position, true) {
                Ok(verdict) => {
                    counted += 1;
                    prop_assert_eq!(verdict.touches, counted);
                    prop_assert!(pose.is_some() && is_down);
                }
                Err(Refusal::NoPose) => prop_assert!(pose.is_none()),
                Err(Refusal::NotDown) => prop_assert!(!is_down),
                other => prop_assert!(false, "{:?}", other),
            }
            let place = station.place(rank).unwrap().place;
            prop_assert!(rank < 4 || place.is_none());
            let reach = within.unwrap_or(u32::MAX).max(125);
            let Approach { x, y, .. } = station.next_press(within).unwrap();
            prop_assert!(x.unsigned_abs() <= reach && y.unsigned_abs() <= reach);
        }
    }
}
