//! Maps made by hand: which bytes are maps, and which object lies where on them.

use super::*;
use crate::{CapacityError, Familiarity, ModelError, Stopping, Verdict};
use palpate_shared::format::{HEADER_LENGTH, HeaderBuilder, Length, MAPS_LAYOUT, Section, Tag, TrainedProbe, checksum};
use palpate_shared::{ContactTime, Pose as HandPose, Position, Touch};
use proptest::prelude::*;
use std::sync::LazyLock;
use std::vec::Vec;
use std::{format, vec};

/// An object's height in millimeters at a point in millimeters.
pub(crate) type Heights = fn(f64, f64) -> f64;

/// A placement: its object, its heights, cells on each side of the middle one, and whether it is round.
#[derive(Clone, Copy)]
pub(crate) struct Placed(u8, Heights, [i32; 2], bool);

const SPACING: u32 = 15_000;
const STROKE: u32 = 20_000;
const HAND: Hand = Hand { spacing: SPACING, speed: 100_000, stroke: Some(STROKE) };

pub(crate) fn wedge(x: f64, y: f64) -> f64 {
    if x.abs() > 22.0 || y.abs() > 12.0 {
        0.0
    } else if x < 0.0 {
        16.0
    } else {
        28.0
    }
}

pub(crate) fn cylinder(x: f64, y: f64) -> f64 {
    if x.hypot(y) < 16.0 { 28.0 } else { 0.0 }
}

fn bar(x: f64, y: f64) -> f64 {
    if x.abs() > 25.0 || y.abs() > 9.0 { 0.0 } else { 20.0 + 6.0 * f64::from(x.abs() > 12.0) }
}

fn pin(x: f64, y: f64) -> f64 {
    if x.hypot(y) < 3.0 { 12.0 } else { 0.0 }
}

pub(crate) const WEDGE: Placed = Placed(0, wedge, [25, 15], false);
pub(crate) const CYLINDER: Placed = Placed(1, cylinder, [19, 19], true);
const BAR: Placed = Placed(0, bar, [28, 12], false);
const PINS: [Placed; 2] = [Placed(0, pin, [4, 4], true), Placed(1, wedge, [3, 3], false)];

/// Logarithms of likelihoods of a noise of half a millimeter and 2 % of lost contacts.
fn likelihoods() -> Vec<i16> {
    let log = |likelihood: f64| (likelihood.ln() * 64.0).round() as i16;
    let gauss = |eighths: usize| (-0.5 * (eighths as f64 / 8.0 / 0.7).powi(2)).exp();
    let mut all = Vec::new();
    for near in [0.0, 0.011] {
        for width in [0.0, 0.75, 1.25, 1.75, 2.5, 3.5, 5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 56.0, 80.0, 150.0] {
            let own = |eighths| gauss(eighths) / (width + 1.75) * 0.98;
            all.extend((0..DISTANCES).map(|eighths| log(own(eighths) + 1e-4 + near)));
        }
    }
    all.extend((0..WITHIN).map(|share| log((share as f64 / 64.0).max(0.02) * 0.98 + 0.02)));
    all.extend((0..BEYOND).map(|eighths| log(0.3 * gauss(eighths) + 0.02)));
    all.push(log(0.02));
    all
}

/// The bytes of a model of these placements, as `FORMAT.md` describes them, with cells of 1 mm and within 30 mm; `least` is the
/// least fit, 0 for no test.
pub(crate) fn model(placed: &[Placed], least: i16) -> Vec<u8> {
    let (mut records, mut heights) = (Vec::new(), Vec::<u8>::new());
    for &Placed(object, height, half, is_round) in placed {
        let in_grid = |x: i32, y: i32| {
            if x.abs() <= half[0] && y.abs() <= half[1] { height(f64::from(x), f64::from(y)) } else { 0.0 }
        };
        // Counts of 1/8 mm.
        let count = |height: f64| (height * 8.0) as u8;
        records.extend([object, u8::from(is_round), 0, 0, 128, 0]);
        records.extend((16 * (half[0] + half[1]) as u16).to_le_bytes());
        records.extend((heights.len() as u32).to_le_bytes());
        records.extend(half.map(|half| half as u8));
        for y in -half[1]..=half[1] {
            heights.extend((-half[0]..=half[0]).map(|x| count(in_grid(x, y))));
        }
        for window in [4, 8, 16, 32] {
            let half = half.map(|half| half / window + 2);
            records.extend(half.map(|half| half as u8));
            for (y, x) in (-half[1]..=half[1]).flat_map(|y| (-half[0]..=half[0]).map(move |x| (y, x))) {
                let mut range = [255, 0];
                for (v, u) in (-window..=window).flat_map(|v| (-window..=window).map(move |u| (v, u))) {
                    if (u * u + v * v) * 10 <= window * window * 13 {
                        let met = count(in_grid(x * window + u, y * window + v));
                        range = [range[0].min(met), range[1].max(met)];
                    }
                }
                heights.extend(range);
            }
        }
        records.extend(least.to_le_bytes());
    }
    let mut content = vec![4, 4, placed.len() as u8, 0, 224, 1, 0, 0, 0, 0];
    content.extend([0, 0, 0, 1, 0, 0]);
    // Noise of half a millimeter, and 2 % of lost contacts.
    content.extend([25, 0, 200, 0]);
    assert_eq!(content.len(), MAPS_LENGTH);
    content.extend(records);
    content.extend(likelihoods().into_iter().flat_map(i16::to_le_bytes));
    content.extend(heights);
    let last = placed.iter().map(|placed| placed.0).max().unwrap();
    let mut text = vec![1, b'1'];
    for name in (0..=last).map(|object| format!("object {object}")).chain(["flat".into(), "up".into()]) {
        text.push(name.len() as u8);
        text.extend(name.bytes());
    }
    text.resize(text.len().next_multiple_of(4), 0);
    let probe = TrainedProbe {
        radius: 1.5,
        spacing: 15.0,
        speed: 100.0,
        length: Length::Millimeter,
        cone: 0,
        stroke: Some(20.0),
        travel: Some(100.0),
        stroke_tolerance: None,
    };
    let mut sections = Vec::new();
    let probe = probe.to_bytes()[..probe.length()].to_vec();
    for (tag, must_understand, content) in [(Tag::Probe, false, &probe), (Tag::Maps, true, &content)] {
        let section = Section { tag: tag.code(), must_understand, content };
        section.write(&mut |bytes| sections.extend(bytes));
    }
    let header = HeaderBuilder::default()
        .with_layout(MAPS_LAYOUT)
        .with_last_object(last)
        .with_odds((1 << 56) / 99)
        .with_max_touches(25)
        .with_text_length(text.len() as u32)
        .with_optional_length(sections.len() as u32)
        .with_length((HEADER_LENGTH + text.len() + sections.len() + 4) as u32);
    let mut bytes = [&header.bytes()[..], &text, &sections, &[0; 4]].concat();
    make_right(&mut bytes);
    bytes
}

/// Puts the checksum right.
fn make_right(bytes: &mut [u8]) {
    let body = bytes.len() - 4;
    let right = checksum(&bytes[..body]).to_le_bytes();
    bytes[body..].copy_from_slice(&right);
}

/// The model of a wedge and a cylinder.
pub(crate) static BOTH: LazyLock<Vec<u8>> = LazyLock::new(|| model(&[WEDGE, CYLINDER], 0));

/// A model of two pins, and its maps' place in it.
fn pins(least: i16) -> (Vec<u8>, usize) {
    let bytes = model(&PINS, least);
    let content = Maps::new(&bytes).unwrap().section(Tag::Maps).unwrap().len();
    let place = bytes.len() - 4 - content.next_multiple_of(4);
    (bytes, place)
}

/// The model with these bytes at a place, under a right checksum.
fn changed(bytes: &[u8], at: usize, new: &[u8]) -> Vec<u8> {
    let mut changed = bytes.to_vec();
    changed[at..at + new.len()].copy_from_slice(new);
    make_right(&mut changed);
    changed
}

pub(crate) type Small<'m> = Locator<'m, 4096, 32, 2>;

pub(crate) fn locator(bytes: &[u8]) -> Small<'_> {
    let maps = Maps::new(bytes).unwrap();
    Locator::new(maps.try_into().unwrap(), maps.stopping(), Effort::default(), 1)
}

/// The row of an approach's fingers, and the heights that an object at a place in millimeters, turned by this many radians,
/// gives them.
pub(crate) fn heights(height: Heights, at: Approach, [x, y]: [f64; 2], yaw: f64) -> ([f64; 2], [f64; 3]) {
    let roll = f64::from(at.roll) / 256.0 * std::f64::consts::TAU;
    let row = [roll.cos(), roll.sin()];
    let heights = [-15.0, 0.0, 15.0].map(|finger| {
        let (u, v) = (f64::from(at.x) / 1e3 + finger * row[0] - x, f64::from(at.y) / 1e3 + finger * row[1] - y);
        height(yaw.cos() * u + yaw.sin() * v, yaw.cos() * v - yaw.sin() * u)
    });
    (row, heights)
}

/// Contacts of an approach to an object.
fn met(height: Heights, at: Approach, place: [f64; 2], yaw: f64) -> Seen {
    let (row, heights) = heights(height, at, place, yaw);
    let limit = heights.into_iter().fold(0.0, f64::max) - f64::from(STROKE) / 1e3;
    let micrometers = |millimeters: f64| (millimeters * 1e3) as i32;
    let contacts =
        heights.map(|height| if height >= limit { Contact::At(micrometers(height)) } else { Contact::Nothing });
    Seen::new([at.x, at.y], row.map(|axis| micrometers(axis * 15.0)), contacts, micrometers(limit))
}

/// Touches where the locator proposes, until it is done, or as often as said; returns the verdict.
fn touch(locator: &mut Small<'_>, height: Heights, place: [f64; 2], yaw: f64, least: usize) -> Verdict {
    let mut at = Approach { x: 0, y: 0, roll: 40 };
    loop {
        let verdict = locator.push_seen(met(height, at, place, yaw));
        if locator.touches() >= least && verdict != Verdict::Undecided {
            return verdict;
        }
        at = locator.choose(SPACING, STROKE, 60_000, 20);
    }
}

fn poses(locator: &Small<'_>, object: usize) -> Vec<Pose> {
    let mut poses = vec![Pose { placement: 9, ..Pose::default() }; 4];
    let found = locator.poses(object, &mut poses);
    poses.truncate(found);
    poses
}

/// Degrees between a pose's yaw and another.
fn turned(pose: &Pose, yaw: f64) -> f64 {
    let apart = f64::from(pose.yaw) / 65_536.0 * 360.0 - yaw.to_degrees();
    (apart + 540.0).rem_euclid(360.0) - 180.0
}

fn far(pose: &Pose, [x, y]: [f64; 2]) -> f64 {
    let [at_x, at_y] = pose.position.map(|micrometers| f64::from(micrometers) / 1e3);
    (at_x - x).hypot(at_y - y)
}

#[test]
fn a_wedge_and_a_cylinder_are_told_apart_with_place_and_yaw() {
    let mut locator = locator(&BOTH);
    for (place, yaw) in [([12.0, -9.0], 0.6), ([-20.0, 17.0], 2.4), ([3.0, 5.0], 4.9)] {
        let mut find = |object: u8, height: Heights| {
            locator.reset();
            // The first name may be another.
            let verdict = touch(&mut locator, height, place, yaw, 8);
            assert!(matches!(verdict, Verdict::Recognized { .. }), "{verdict:?}");
            assert_eq!(locator.leader(), usize::from(object));
            poses(&locator, usize::from(object))[0]
        };
        let pose = find(0, wedge);
        assert!(far(&pose, place) < 2.0 && turned(&pose, yaw).abs() < 6.0, "{pose:?} at {place:?}, {yaw}");
        let turn = pose.yaw_within.expect("a wedge has a yaw");
        assert!(pose.within.iter().all(|&within| (400..4_000).contains(&within)) && turn < 3_000, "{pose:?}");
        assert!(pose.placement == 0 && pose.share > 50_000, "{pose:?}");
        let pose = find(1, cylinder);
        assert!(far(&pose, place) < 2.0, "{pose:?} at {place:?}");
        assert_eq!((pose.placement, pose.yaw, pose.yaw_within), (1, 0, None));
        assert!(locator.posterior(1) > 64_000 && locator.posterior(0) < 1_000 && locator.posterior(usize::MAX) == 0);
    }
}

#[test]
fn a_window_that_reaches_into_the_map_from_beside_it_holds_the_object() {
    let slab: Heights = |x, y| if x.abs() <= 10.0 && y.abs() <= 10.0 { 24.0 } else { 0.0 };
    let bytes = model(&[Placed(0, slab, [11, 11], false)], 0);
    let maps = Maps::new(&bytes).unwrap();
    let placement = maps.placement(0);
    // Cells end at 11 mm; windows of 3.75 mm are those of two cells to each side.
    for (x, high) in [(0, 24), (10, 24), (11, 24), (12, 24), (14, 0), (40, 0)] {
        for [x, y] in [[x, 0], [-x, 0], [0, x], [0, -x]] {
            let [_, highest] = maps.heights(&placement, 16 * x, 16 * y, 60);
            assert_eq!(highest, 16 * high, "{x}, {y}");
        }
    }
}

#[test]
fn an_object_that_looks_the_same_from_behind_has_two_poses() {
    let bytes = model(&[BAR, CYLINDER], 0);
    let mut locator = locator(&bytes);
    let (place, yaw) = ([8.0, 4.0], 0.4);
    touch(&mut locator, bar, place, yaw, 8);
    let [one, other, ..] = poses(&locator, 0)[..] else { panic!("fewer than two poses") };
    let turns = [one, other].map(|pose| turned(&pose, yaw).abs());
    assert!([one, other].iter().all(|pose| far(pose, place) < 2.0), "{one:?} {other:?}");
    assert!(turns.iter().any(|&turn| turn < 6.0) && turns.iter().any(|&turn| turn > 174.0), "{one:?} {other:?}");
    assert!(one.share + other.share > 60_000 && one.share < 50_000, "{one:?} {other:?}");
    // The largest share comes first, however many are asked for.
    let shares: Vec<u32> = poses(&locator, 0).iter().map(|pose| pose.share).collect();
    assert!(shares.is_sorted_by(|one, next| one >= next), "{shares:?}");
    let mut first = [Pose::default()];
    assert_eq!((locator.poses(0, &mut first), first), (1, [one]));
    assert!(poses(&locator, usize::MAX).is_empty() && locator.poses(0, &mut []) == 0);
}

#[test]
fn a_search_that_was_not_finished_names_nothing() {
    let maps = Maps::new(&BOTH).unwrap();
    // Any lead would do, and yet there is no name.
    let stopping = Stopping::from_odds(1 << 55, 3);
    for lookups in [0, 1_000] {
        let effort = Effort { lookups, ..Effort::default() };
        let mut locator = Locator::<4096, 32, 2>::new(maps.try_into().unwrap(), stopping, effort, 1);
        for touches in 1..5 {
            let verdict = locator.push_seen(met(wedge, Approach::default(), [0.0; 2], 0.3));
            assert_eq!(locator.exhausted(), Some(Exhausted::Lookups));
            assert!(locator.looked() < lookups + 500, "{}", locator.looked());
            assert_eq!(verdict, if touches < 3 { Verdict::Undecided } else { Verdict::GaveUp });
        }
    }
    let mut locator = Locator::<64, 32, 2>::new(maps.try_into().unwrap(), stopping, Effort::default(), 1);
    assert_eq!(locator.push_seen(met(wedge, Approach::default(), [0.0; 2], 0.3)), Verdict::Undecided);
    assert_eq!((locator.exhausted(), locator.kept() <= 64), (Some(Exhausted::Cells), true));
    // As with room for no more.
    let effort = Effort { cells: 64, ..Effort::default() };
    let mut bounded = Locator::<4096, 32, 2>::new(maps.try_into().unwrap(), stopping, effort, 1);
    bounded.push_seen(met(wedge, Approach::default(), [0.0; 2], 0.3));
    assert_eq!((bounded.kept(), bounded.rivals().q56()), (locator.kept(), locator.rivals().q56()));
    assert_eq!(bounded.exhausted(), Some(Exhausted::Cells));
}

#[test]
fn approaches_are_chosen_within_the_workspace_and_alike_after_a_reset() {
    let mut locator = locator(&BOTH);
    let run = |locator: &mut Small<'_>| {
        let mut all = Vec::new();
        let mut at = Approach::default();
        for _ in 0..4 {
            let verdict = locator.push_seen(met(wedge, at, [25.0, -25.0], 1.0));
            at = locator.choose(SPACING, STROKE, 10_000, 20);
            assert!(at.x.abs() <= 10_000 && at.y.abs() <= 10_000, "{at:?}");
            all.push((format!("{verdict:?} {at:?} {:?}", poses(locator, 0)), locator.looked(), locator.fit()));
        }
        all
    };
    let first = run(&mut locator);
    locator.reset();
    assert_eq!(run(&mut locator), first);
    assert_eq!(run(&mut self::locator(&BOTH)), first);
    assert_eq!(locator.choose(SPACING, STROKE, 0, 20).x, 0);
}

#[test]
fn weights_say_which_objects_there_may_be() {
    let mut locator = locator(&BOTH);
    assert!(!locator.reset_to(&[0, 0]) && !locator.reset_to(&[1]) && !locator.reset_to(&[1; 3]));
    assert!(locator.reset_to(&[3, 1]));
    let share = f64::from(locator.posterior(0)) / 65_536.0;
    assert!((share - 0.75).abs() < 0.03, "{share}");
    assert!(locator.reset_to(&[0, u32::MAX]));
    let verdict = locator.push_seen(met(wedge, Approach::default(), [0.0; 2], 0.0));
    assert!(matches!(verdict, Verdict::Recognized { object: 1, touches: 1, .. }), "{verdict:?}");
    assert!(poses(&locator, 0).is_empty());
    // As often as there are objects, whatever was before.
    assert!(locator.reset_to(&[7, 7]));
    assert!(matches!(touch(&mut locator, wedge, [9.0, 9.0], 2.0, 1), Verdict::Recognized { object: 0, .. }));
}

#[test]
fn a_name_stays_with_its_place_whatever_is_touched_then() {
    let mut locator = locator(&BOTH);
    let place = [6.0, -3.0];
    let first = touch(&mut locator, wedge, place, 0.8, 1);
    assert!(matches!(first, Verdict::Recognized { object: 0, .. }), "{first:?}");
    let before = poses(&locator, locator.best())[0];
    assert!(locator.best() == 0 && locator.leader() == 0);
    // The wedge is replaced by a cylinder: more touches than there is room for.
    for number in 0..40 {
        let at = Approach { x: 6_000 - 1_000 * (number % 13), y: 1_000 * (number % 7) - 6_000, roll: 19 };
        assert_eq!(locator.push_seen(met(cylinder, at, place, 0.0)), first);
        assert!(locator.verdict() == first && locator.best() == 0);
        assert!(poses(&locator, locator.best()).iter().all(|pose| pose.placement == before.placement));
    }
    assert_eq!((locator.leader(), locator.touches()), (1, 32));
    assert!(locator.posterior(0) < 1_000, "{}", locator.posterior(0));
    locator.reset();
    assert_eq!((locator.verdict(), locator.best()), (Verdict::Undecided, locator.leader()));
    // A verdict without a name stays, too.
    let bytes = model(&[WEDGE, CYLINDER], 0);
    let maps = Maps::new(&bytes).unwrap();
    let stopping = Stopping::from_odds((1 << 56) / 99, 2);
    let mut locator = Locator::<4096, 32, 2>::new(maps.try_into().unwrap(), stopping, Effort::default(), 1);
    let far = Approach { x: 50_000, y: 50_000, roll: 0 };
    let verdicts = [far; 2].map(|at| locator.push_seen(met(wedge, at, place, 0.8)));
    assert_eq!(verdicts, [Verdict::Undecided, Verdict::GaveUp]);
    for _ in 0..8 {
        let at = locator.choose(SPACING, STROKE, 60_000, 20);
        assert_eq!(locator.push_seen(met(wedge, at, place, 0.8)), Verdict::GaveUp);
    }
    assert!(locator.rivals().q56() < locator.stopping.odds());
}

#[test]
fn rivals_are_right_at_any_share_of_the_leader() {
    let lower: Heights = |x, y| if x.hypot(y) < 14.0 { 20.0 } else { 0.0 };
    let box_of: Heights = |x, y| if x.abs().max(y.abs()) < 15.0 { 24.0 } else { 0.0 };
    let placed = [WEDGE, CYLINDER, Placed(2, lower, [17, 17], true), Placed(3, box_of, [18, 18], false)];
    let bytes = model(&placed, 0);
    let maps = Maps::new(&bytes).unwrap();
    let mut locator = Locator::<4096, 32, 4>::new(maps.try_into().unwrap(), maps.stopping(), Effort::default(), 1);
    let (mut at, mut shares) = (Approach { x: 20_000, y: -20_000, roll: 0 }, Vec::new());
    for _ in 0..6 {
        locator.push_seen(met(box_of, at, [4.0, 7.0], 0.4));
        at = locator.choose(SPACING, STROKE, 60_000, 20);
        let share = f64::from(locator.posterior(locator.leader())) / 65_536.0;
        let of_rivals = locator.rivals().posterior().to_f64();
        assert!((of_rivals / share - 1.0).abs() < 0.03, "{of_rivals} for {share}");
        shares.push(share);
    }
    assert!(shares[0] < 0.45 && shares[5] > 0.9, "{shares:?}");
}

#[test]
fn what_fits_no_object_is_unknown() {
    let bytes = model(&[WEDGE, CYLINDER], -500);
    let mut locator = locator(&bytes);
    let verdict = touch(&mut locator, wedge, [5.0, 5.0], 1.0, 1);
    assert!(matches!(verdict, Verdict::Recognized { object: 0, touches: 8, .. }), "{verdict:?}");
    assert_eq!(locator.familiarity(), Familiarity::Known);
    locator.reset();
    let tower: Heights = |x, y| if x.abs().max(y.abs()) < 20.0 { 55.0 } else { 5.0 };
    for _ in 1..TESTED {
        assert_eq!(locator.familiarity(), Familiarity::Doubtful);
        let verdict = locator.push_seen(met(tower, Approach { x: 2_000, y: 9_000, roll: 9 }, [5.0, 5.0], 1.0));
        assert_eq!(verdict, Verdict::Undecided);
    }
    assert_eq!(touch(&mut locator, tower, [5.0, 5.0], 1.0, 1), Verdict::Unknown);
    assert!(locator.familiarity() == Familiarity::Stranger && locator.fit() < -500, "{}", locator.fit());
}

#[test]
fn an_object_that_belongs_to_the_border_is_not_named() {
    // Objects are looked for within 30 mm.
    for (place, named) in [([28.0, -5.0], true), ([31.5, -5.0], false), ([3.0, -32.0], false)] {
        let mut locator = locator(&BOTH);
        assert!(locator.reset_to(&[0, 1]));
        let mut at = Approach { x: 1_000 * place[0] as i32, y: 1_000 * place[1] as i32, roll: 40 };
        for number in 0..12 {
            locator.push_seen(met(cylinder, at, place, 0.0));
            at.roll = 21 * number;
        }
        assert_eq!((locator.leader(), locator.is_at_border()), (1, !named), "{place:?}");
        assert_eq!(locator.may_name(), named, "{place:?}");
    }
}

#[test]
fn on_an_empty_table_nothing_but_the_table_is_met() {
    let mut locator = locator(&BOTH);
    let empty: Heights = |_, _| 0.0;
    assert!(!locator.met_table_alone());
    assert_eq!(touch(&mut locator, empty, [0.0; 2], 0.0, 1), Verdict::GaveUp);
    // The cylinder is easier to miss than the wedge, and yet it is not named.
    assert!(locator.met_table_alone() && locator.rivals().q56() <= locator.stopping.odds());
    // Also where contacts are missing, and heights are a little wrong; not where an object was met once.
    for (contact, alone) in [(Contact::Nothing, true), (Contact::At(1_300), true), (Contact::At(3_000), false)] {
        locator.reset();
        locator.push_seen(Seen::new([0; 2], [15_000, 0], [Contact::At(0), contact, Contact::At(-900)], -20_000));
        assert_eq!(locator.met_table_alone(), alone, "{contact:?}");
    }
}

#[test]
fn a_locator_that_has_searched_nothing_chooses_as_after_a_reset() {
    let bytes = model(&PINS, 0);
    let mut fresh = locator(&bytes);
    let mut reset = fresh.clone();
    reset.reset();
    assert_eq!(fresh.verdict(), reset.verdict());
    for object in 0..2 {
        assert!(fresh.posterior(object).abs_diff(reset.posterior(object)) <= 1_024, "{}", fresh.posterior(object));
    }
    let [first, other] = [&mut fresh, &mut reset].map(|locator| locator.choose(15_000, 20_000, 40_000, 10));
    assert_eq!(first, other);
    assert_eq!(fresh.leader(), reset.leader());
}

#[test]
fn the_forty_first_touch_is_one_too_many() {
    let bytes = model(&PINS, 0);
    let maps = Maps::new(&bytes).unwrap();
    let effort = Effort { lookups: 5_000, candidates: 1, ..Effort::default() };
    let mut locator = Locator::<64, 32, 2>::new(maps.try_into().unwrap(), Stopping::from_odds(0, 100), effort, 0);
    for touches in 1..=40 {
        let verdict = locator.push_seen(met(pin, Approach::default(), [20.0; 2], 0.0));
        assert_eq!(verdict, if touches < 32 { Verdict::Undecided } else { Verdict::GaveUp });
        assert_eq!(locator.touches(), touches.min(32));
    }
    let small = CapacityError { objects: 2, capacity: 1 };
    assert_eq!(AtMost::<1>::try_from(maps).err(), Some(small));
}

#[test]
fn a_touch_counts_with_a_position_from_straight_above() {
    let bytes = model(&PINS, 0);
    let maps = Maps::new(&bytes).unwrap();
    assert_eq!(Hand::of(&maps), Some(HAND));
    let mut locator = locator(&bytes);
    let down = HandPose { direction: [0, 0, -32_767], alignment: [0, 32_767, 0] };
    let position = Position { micrometers: [1_000, 2_000, 12_000] };
    let touch = Touch::new([ContactTime::MISSING, ContactTime::FIRST, ContactTime::from_micros(50_000)]);
    let askew = HandPose { direction: [32_767, 0, 0], ..down };
    for refused in [touch, touch.with_pose(down), touch.with_pose(askew).with_position(position)] {
        assert_eq!((locator.push(&refused, HAND), locator.touches()), (None, 0));
    }
    let touch = touch.with_pose(down).with_position(position);
    let contacts = [Contact::Nothing, Contact::At(12_000), Contact::At(7_000)];
    let seen = Seen::new([1_000, 2_000], [0, 15_000], contacts, -8_000);
    assert_eq!(HAND.seen(&touch), Some(seen));
    assert!(locator.push(&touch, HAND).is_some() && locator.touches() == 1);
    // Nothing at all: the hand went no lower than its position. Without a stroke: to the table.
    let nothing = touch.with_times([ContactTime::MISSING; 3]);
    assert_eq!(HAND.seen(&nothing), Some(Seen::new([1_000, 2_000], [0, 15_000], [Contact::Nothing; 3], 12_000)));
    let endless = Hand { stroke: None, ..HAND };
    assert_eq!(endless.seen(&touch), Some(Seen::new([1_000, 2_000], [0, 15_000], contacts, i32::MIN)));
}

#[test]
fn names_are_those_of_objects_and_placements() {
    let bytes = model(&PINS, 0);
    let maps = Maps::new(&bytes).unwrap();
    assert_eq!((maps.objects(), maps.placements(), maps.cell(), maps.range()), (2, 2, 1, 30_000));
    let names = [0, 1, 2, usize::MAX].map(|object| maps.object_name(object));
    assert_eq!(names, ["object 0", "object 1", "", ""]);
    assert_eq!([0, 1, 2, 255].map(|placement| maps.placement_name(placement)), ["flat", "up", "", ""]);
    assert_eq!([0, 1, 255].map(|placement| maps.object_of(placement)), [0, 1, 0]);
    assert_eq!(maps.bytes_of(0), 81 + 2 * (49 + 3 * 25));
    assert!(maps.promise().is_none() && maps.model() == bytes);
}

#[test]
fn every_truncation_and_every_changed_byte_is_refused() {
    let bytes = model(&PINS, 0);
    for length in 0..bytes.len() {
        assert!(Maps::new(&bytes[..length]).is_err(), "{length} bytes");
    }
    for at in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[at] ^= 1 << (at % 8);
        assert!(Maps::new(&changed).is_err(), "byte {at}");
    }
    assert!(Maps::new(&[&bytes[..], &[0]].concat()).is_err());
}

#[test]
fn meaningless_maps_are_refused_at_their_place() {
    let (bytes, maps) = pins(0);
    let section = ModelError::Section { offset: maps - 8 };
    let field = |offset| ModelError::Field { offset };
    let record = maps + MAPS_LENGTH;
    let cases: [(&str, usize, &[u8], ModelError); 16] = [
        ("a layout of trees", 6, &[0], field(6)),
        ("a threshold of 1", 55, &[1], field(48)),
        ("no touch", 56, &[0], field(56)),
        ("a section that nobody knows", maps - 8, &[99, 128], ModelError::NotUnderstood { tag: 99, offset: maps - 8 }),
        ("cells of 4 mm", maps, &[6], section),
        ("no root cells", maps + 1, &[0], section),
        ("16 root cells", maps + 1, &[16], section),
        ("no placements", maps + 2, &[0], section),
        ("placements without records", maps + 2, &[255], section),
        ("a range of 15/16 mm", maps + 4, &[15, 0], section),
        ("a range of 257 mm", maps + 4, &[16, 16], section),
        ("a drift of 64 mm", maps + 6, &[0, 4], section),
        ("an object that is not there", record, &[2], section),
        ("an object without a placement", record, &[1], section),
        ("a scale of 0", record + 4, &[0, 0], section),
        ("heights beyond the end", record + 8, &[0, 0, 1, 0], section),
    ];
    for (what, at, new, error) in cases {
        assert_eq!(Maps::new(&changed(&bytes, at, new)).err(), Some(error), "{what}");
    }
}

/// Touches at which numbers could overflow.
fn extreme() -> Vec<Seen> {
    let ends = [i32::MIN, -1, 0, i32::MAX];
    let contacts = [Contact::Nothing, Contact::At(i32::MIN), Contact::At(0), Contact::At(9_000), Contact::At(i32::MAX)];
    let mut all = vec![Seen::new([0; 2], [15_000, 0], [Contact::At(0); 3], i32::MIN)];
    for (index, &end) in ends.iter().enumerate() {
        for (other, &contact) in contacts.iter().enumerate() {
            let third = contacts[(index + other) % contacts.len()];
            let row = [end, ends[(index + 1) % 4]];
            all.push(Seen::new([end, ends[other % 4]], row, [contact, Contact::Nothing, third], ends[(other + 1) % 4]));
        }
    }
    all
}

/// Opens bytes, and if they are maps follows touches on them with everything that can be asked.
fn follow(bytes: &[u8], touches: &[Seen]) -> bool {
    let Ok(maps) = Maps::new(bytes) else { return false };
    let effort = Effort { lookups: 1_000, candidates: 2, ..Effort::default() };
    let Ok(fitting) = maps.try_into() else { return true };
    let mut locator = Locator::<128, 8, 2>::new(fitting, maps.stopping(), effort, 3);
    for (&seen, end) in touches.iter().zip([0, 10_000, u32::MAX].into_iter().cycle()) {
        locator.push_seen(seen);
        let at = locator.choose(end, u32::MAX - end, end, 64);
        assert!(at.x.unsigned_abs() <= end && at.y.unsigned_abs() <= end);
        let leader = locator.leader();
        locator.poses(leader, &mut [Pose::default(); 3]);
    }
    let names = maps.object_name(locator.leader()).len() + maps.placement_name(0).len() + maps.bytes_of(0);
    let _ = (names, Hand::of(&maps), locator.posterior(0), locator.rivals(), locator.fit(), maps.promise());
    locator.reset_to(&[u32::MAX; 2]);
    locator.push_seen(Seen::default());
    true
}

#[test]
fn every_changed_byte_under_a_right_checksum_is_refused_or_read() {
    let (bytes, maps) = pins(-700);
    let touches = &extreme()[..3];
    let mut read = 0;
    let likelihoods = maps + MAPS_LENGTH + 2 * PLACEMENT_LENGTH;
    for at in (0..likelihoods).chain((likelihoods..bytes.len() - 4).step_by(97)) {
        for change in [0, 1, 127, 128, 255] {
            let new = if bytes[at] == change { change ^ 85 } else { change };
            read += u32::from(follow(&changed(&bytes, at, &[new]), touches));
        }
    }
    assert!(read > 300, "{read}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn the_middle_finger_is_never_sent_out_of_the_workspace(
        touches in 0_usize..4,
        place in [-40_f64..40.0, -40.0..40.0],
        yaw in 0_f64..6.3,
        within in prop_oneof![0_u32..200, 0_u32..60_000, Just(u32::MAX)],
        spacing in prop_oneof![Just(SPACING), any::<u32>()],
        seed in any::<u32>(),
    ) {
        let maps = Maps::new(&BOTH).unwrap();
        let effort = Effort { lookups: 40_000, candidates: 16, ..Effort::default() };
        let mut locator = Locator::<1024, 32, 2>::new(maps.try_into().unwrap(), maps.stopping(), effort, seed);
        for number in 0..=touches {
            let at = locator.choose(spacing, STROKE, within, 20);
            prop_assert!(at.x.unsigned_abs() <= within && at.y.unsigned_abs() <= within, "{at:?} of {within}");
            // Where it was said not to go, touches count too.
            let elsewhere = Approach { x: at.x + 9_000 * number as i32, ..at };
            locator.push_seen(met(wedge, elsewhere, place, yaw));
        }
    }

    #[test]
    fn random_records_and_likelihoods_under_a_right_checksum_are_refused_or_read(
        records in prop::collection::vec(any::<u8>(), 2 * PLACEMENT_LENGTH),
        kept in prop::collection::vec(any::<bool>(), 2 * PLACEMENT_LENGTH),
        fixed in prop::array::uniform8(any::<u8>()),
        likelihood in prop::sample::select(vec![None, Some(i16::MIN), Some(i16::MAX), Some(-1), Some(500)]),
        first in 0_usize..20,
    ) {
        let (mut bytes, maps) = pins(0);
        for ((to, &record), kept) in bytes[maps + MAPS_LENGTH..].iter_mut().zip(&records).zip(kept) {
            *to = if kept { *to } else { record };
        }
        // Halves stay, so that some fit; numbers of the fixed part are such as are read.
        let [roots, range, range_high, drift, drift_high, turn, turn_high, stretch] = fixed;
        let number = [1 + roots % 15, 2, 0, range, range_high % 16, drift, drift_high % 4, turn, turn_high % 4];
        bytes[maps + 1..][..number.len()].copy_from_slice(&number);
        bytes[maps + 12..][..2].copy_from_slice(&[stretch, drift_high]);
        if let Some(likelihood) = likelihood {
            let start = maps + MAPS_LENGTH + 2 * PLACEMENT_LENGTH;
            for to in bytes[start..start + LIKELIHOODS_LENGTH].chunks_exact_mut(2) {
                to.copy_from_slice(&likelihood.to_le_bytes());
            }
        }
        make_right(&mut bytes);
        follow(&bytes, &extreme()[first..][..1]);
    }

    #[test]
    fn records_that_are_read_lead_nowhere_outside(
        scales in prop::array::uniform2(1_u16..),
        radii in prop::array::uniform2(16_u16..),
        priors in prop::array::uniform2(any::<i16>()),
        heights in any::<u64>(),
        touches in prop::collection::vec(
            (any::<[i32; 2]>(), any::<[i32; 2]>(), any::<[i32; 3]>(), any::<u8>(), any::<i32>(), 0_u32..16), 1..4),
    ) {
        let (mut bytes, maps) = pins(0);
        for placement in 0..2 {
            let record = &mut bytes[maps + MAPS_LENGTH + placement * PLACEMENT_LENGTH..];
            record[2..4].copy_from_slice(&priors[placement].to_le_bytes());
            record[4..6].copy_from_slice(&scales[placement].to_le_bytes());
            record[6..8].copy_from_slice(&radii[placement].to_le_bytes());
        }
        let start = maps + MAPS_LENGTH + 2 * PLACEMENT_LENGTH + LIKELIHOODS_LENGTH;
        let end = bytes.len() - 4;
        for (to, at) in bytes[start..end].iter_mut().zip(0_u64..) {
            *to = (heights.wrapping_mul(2 * at + 1) >> 32) as u8;
        }
        make_right(&mut bytes);
        let seen: Vec<Seen> = touches.into_iter().map(|(at, row, heights, met, limit, shift)| {
            let scaled = |number: i32| number >> shift;
            let contacts = [0, 1, 2].map(|finger| {
                if met >> finger & 1 == 1 { Contact::At(scaled(heights[finger])) } else { Contact::Nothing }
            });
            Seen::new(at.map(scaled), row.map(scaled), contacts, scaled(limit))
        }).collect();
        prop_assert!(follow(&bytes, &seen));
    }

    #[test]
    fn any_touch_of_any_hand_is_seen_or_refused(
        times in any::<[u32; 3]>(),
        direction in any::<[i16; 3]>(),
        down in any::<bool>(),
        alignment in any::<[i16; 3]>(),
        micrometers in any::<[i32; 3]>(),
        (spacing, speed, stroke) in any::<(u32, u32, Option<u32>)>(),
    ) {
        let [x, y, z] = direction;
        let direction = [x, y, if down { i16::MIN } else { z }];
        let touch = Touch::new(times.map(ContactTime::from_micros))
            .with_pose(HandPose { direction, alignment })
            .with_position(Position { micrometers });
        let hand = Hand { spacing, speed, stroke };
        prop_assert_eq!(hand.seen(&touch).is_some(), direction[2] <= -31_128);
    }
}
