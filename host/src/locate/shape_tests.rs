//! Maps of objects that stand still, from few touches.

use super::register::recorded;
use super::*;
use crate::mesh::{Mesh, Object};
use crate::probe::approach::Probe;
use crate::touches::{Dataset, ObjectTouches, Origin, Source};
use crate::with;
use palpate_shared::format::Length;
use palpate_shared::{ContactTime, Pose, Position, Q15_ONE, Touch};

fn probe() -> Probe {
    with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0))
}

/// A touch straight down with the row along x, which states what the three fingers met.
fn touch([x, y]: [f64; 2], heights: [Option<f64>; 3]) -> Touch {
    let first = heights.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    let time = |height: f64| ContactTime::from_micros(((first - height) / 100.0 * 1e6).round() as u32);
    let z = if first.is_finite() { first } else { 0.0 };
    let position = Position { micrometers: [x, y, z].map(|place| (place * 1e3).round() as i32) };
    let pose = Pose { direction: [0, 0, -Q15_ONE], alignment: [Q15_ONE, 0, 0] };
    Touch::new(heights.map(|height| height.map_or(ContactTime::MISSING, time))).with_pose(pose).with_position(position)
}

/// An L of 20 mm height, with a foot of 10 mm: it looks like itself from one side alone.
fn ell([x, y]: [f64; 2]) -> f64 {
    match () {
        () if (0.0..=60.0).contains(&x) && (0.0..=20.0).contains(&y) => 20.0,
        () if (0.0..=20.0).contains(&x) && (0.0..=50.0).contains(&y) => 10.0,
        () => 0.0,
    }
}

/// Touches of the L where it lies at `place` turned by `yaw`.
fn pressed(place: [f64; 2], yaw: f64, count: usize, surface: impl Fn([f64; 2]) -> f64) -> Vec<Touch> {
    let (sin, cos) = yaw.sin_cos();
    let at = |number: usize| {
        let share = |step: f64| (number as f64 * step).fract() * 2.0 - 1.0;
        let [u, v] = [25.0 + 42.0 * share(0.754_877_666), 25.0 + 36.0 * share(0.569_840_291)];
        let [x, y] = [place[0] + cos * u - sin * v, place[1] + sin * u + cos * v];
        let heights = [-15.0, 0.0, 15.0].map(|finger| {
            let [dx, dy] = [x + finger - place[0], y - place[1]];
            surface([cos * dx + sin * dy, cos * dy - sin * dx])
        });
        let first = heights.into_iter().fold(0.0, f64::max);
        touch([x, y], heights.map(|height| (height >= first - 20.0).then_some(height)))
    };
    (0..count).map(at).collect()
}

fn relief(touches: &[Touch]) -> Relief {
    let mut shape = Shape::within(&probe(), [70.0, 60.0], 0.5);
    touches.iter().for_each(|touch| shape.push(touch).unwrap());
    shape.relief()
}

fn height(relief: &Relief, [x, y]: [i32; 2]) -> f64 {
    relief.heights[grid::index(relief.half, [x, y]).unwrap()]
}

#[test]
fn a_step_stays_a_step_between_few_touches() {
    let relief = relief(&pressed([0.0; 2], 0.0, 200, ell));
    let off = |at: [i32; 2]| (height(&relief, at) - ell(at.map(f64::from))).abs();
    for at in [[40, 10], [10, 10], [10, 40], [40, 40], [-10, -5]] {
        assert!(off(at) < 1.0, "{at:?}: {}", height(&relief, at));
    }
    let all = grid::places([60, 50]).filter(|[x, y]| *x >= -5 && *y >= -5);
    let (sum, count) = all.fold((0.0, 0.0), |(sum, count), at| (sum + off(at), count + 1.0));
    assert!(sum / count < 1.0, "{}", sum / count);
}

#[test]
fn intervals_hold_the_truth_in_nineteen_of_twenty_cells() {
    let relief = relief(&pressed([0.0; 2], 0.0, 100, ell));
    let all: Vec<bool> = grid::places(relief.half)
        .enumerate()
        .filter(|(_, at)| ell(at.map(f64::from)) > 0.0)
        .map(|(cell, at)| (relief.bounds[cell][0]..=relief.bounds[cell][1]).contains(&ell(at.map(f64::from))))
        .collect();
    let holds = all.iter().filter(|holds| **holds).count();
    assert!(holds * 20 >= all.len() * 19, "{holds} of {}", all.len());
}

#[test]
fn one_approach_makes_a_map_that_is_known_nowhere_else() {
    let relief = relief(&[touch([0.0; 2], [Some(5.0), Some(6.0), Some(7.0)])]);
    assert!((height(&relief, [0, 0]) - 6.0).abs() < 1.0);
    assert!(relief.known(2.0) < 0.1, "{}", relief.known(2.0));
}

#[test]
fn touches_of_nothing_and_of_the_table_alone_are_no_object() {
    for heights in [[None; 3], [Some(0.0); 3], [Some(0.4), Some(-0.6), None]] {
        let touches: Vec<Touch> = (0..50).map(|number| touch([f64::from(number), 0.0], heights)).collect();
        assert!(relief(&touches).heights.iter().all(|height| *height < 0.5), "{heights:?}");
        let all = shape::all_samples(&touches, &probe()).unwrap();
        let error = Shape::of(all, &probe(), 0.5, "pot").unwrap_err().to_string();
        assert!(error.contains("pot: no touch met it"), "{error}");
    }
}

#[test]
fn a_finger_that_met_nothing_lowers_the_guess_below_it() {
    let mut touches = pressed([0.0; 2], 0.0, 60, |at| if at[0] < 20.0 { 40.0 } else { 0.0 });
    let relief = relief(&touches);
    assert!(height(&relief, [35, 10]) <= 20.5, "{}", height(&relief, [35, 10]));
    // Fingers beside it that met the table itself say more.
    touches.extend((0..20).map(|number| touch([55.0, 3.0 * f64::from(number)], [Some(0.0); 3])));
    assert!(height(&self::relief(&touches), [55, 10]) < 1.0);
}

#[test]
fn contradicting_contacts_do_not_move_a_surface_that_most_agree_on() {
    let mut touches = pressed([0.0; 2], 0.0, 200, ell);
    touches.push(touch([40.0, 10.0], [Some(20.0), Some(3.0), Some(20.0)]));
    assert!((height(&relief(&touches), [44, 10]) - 20.0).abs() < 2.0);
}

#[test]
fn exploring_knows_more_than_as_many_touches_at_random_and_ends() {
    let about = |[x, y]: [f64; 2]| ell([x + 30.0, y + 25.0]);
    let mut shape = Shape::within(&probe(), [36.0, 31.0], 1.0);
    let mut relief = shape.relief();
    let mut approaches = 0;
    while relief.known(2.0) < 0.7 && approaches < 120 {
        let next = shape.next(&relief);
        assert!(next.x.abs() <= 36_000 && next.y.abs() <= 31_000);
        let [x, y] = [next.x, next.y].map(|micrometers| f64::from(micrometers) / 1e3);
        let (sin, cos) = (f64::from(next.roll) / 256.0 * std::f64::consts::TAU).sin_cos();
        let place = |finger: f64| [x + finger * cos, y + finger * sin];
        shape.add([-15.0, 0.0, 15.0].map(place).map(|place| Sample { place, height: about(place), is_contact: true }));
        relief = shape.relief();
        approaches += 1;
    }
    assert!(relief.known(2.0) >= 0.7, "{} after {approaches}", relief.known(2.0));
    let mut random = Shape::within(&probe(), [36.0, 31.0], 1.0);
    pressed([-30.0, -25.0], 0.0, approaches, ell).iter().for_each(|touch| random.push(touch).unwrap());
    assert!(random.relief().known(2.0) < relief.known(2.0));
}

#[test]
fn the_surface_is_closed_to_the_table_and_as_large_as_the_object() {
    let relief = relief(&pressed([0.0; 2], 0.0, 300, ell));
    let mesh = relief.solid(0.0);
    let facts = crate::mesh::facts::Facts::of(&mesh);
    assert!(facts.is_closed() && facts.is_right_side_out(), "{facts:?}");
    let volume = facts.volume;
    assert!((volume / (60.0 * 20.0 * 20.0 + 20.0 * 30.0 * 10.0) - 1.0).abs() < 0.1, "{volume}");
    let slimmer = crate::mesh::facts::Facts::of(&relief.solid(1.5)).volume;
    assert!(slimmer < volume, "{slimmer}");
}

#[test]
fn recordings_of_several_places_are_one_surface_where_the_follower_is_sure() {
    let settings = CastSettings::default();
    let once = recorded("pot", &[pressed([0.0; 2], 0.0, 150, ell)], &probe(), &settings).unwrap();
    let places = [pressed([0.0; 2], 0.0, 150, ell), pressed([12.0, -9.0], 0.9, 150, ell)];
    let both = recorded("pot", &places, &probe(), &settings).unwrap();
    assert_eq!((once.len(), both.len()), (1, 1));
    assert!(both[0].known >= once[0].known, "{} {}", both[0].known, once[0].known);
    assert!(both[0].differs(&once[0], 0.0) < 2.0, "{}", both[0].differs(&once[0], 0.0));
}

#[test]
fn recordings_are_not_merged_where_the_pose_is_not_sure() {
    let settings = CastSettings::default();
    // The same from both ends, and another placement.
    let bar = |[x, y]: [f64; 2]| if (0.0..=60.0).contains(&x) && (0.0..=20.0).contains(&y) { 15.0 } else { 0.0 };
    for surface in [bar, |at: [f64; 2]| ell(at) / 2.0] {
        let first = if surface([40.0, 10.0]) > 12.0 {
            pressed([0.0; 2], 0.0, 150, bar)
        } else {
            pressed([0.0; 2], 0.0, 150, ell)
        };
        let both = recorded("pot", &[first, pressed([5.0, 5.0], 0.5, 150, surface)], &probe(), &settings).unwrap();
        assert_eq!(both.len(), 2);
        assert_eq!(both.iter().map(|surface| surface.share).sum::<f64>(), 1.0);
        assert_eq!(both[1].placement, " 2");
    }
}

#[test]
fn a_contact_that_strays_above_the_table_moves_no_objects_middle() {
    let puck = |[x, y]: [f64; 2]| if x.hypot(y) < 30.0 { 18.0 } else { 0.0 };
    let of = |place: [f64; 2], stray: Option<[f64; 2]>| {
        // The pattern of touches is about a point that is 25 mm from the place in x and y.
        let mut touches = pressed([place[0] - 25.0, place[1] - 25.0], 0.0, 300, |at| puck(at.map(|axis| axis - 25.0)));
        if let Some([x, y]) = stray {
            touches.push(touch([x, y], [Some(0.1), Some(1.9), Some(0.0)]));
        }
        touches
    };
    let settings = CastSettings::default();
    for (place, stray) in [([0.0; 2], [-53.7, -6.9]), ([4.0, -9.0], [10.0, 50.0]), ([4.0, -9.0], [-40.0, -40.0])] {
        let [clean, strayed] = [None, Some(stray)].map(|stray| {
            let samples = shape::all_samples(&of(place, stray), &probe()).unwrap();
            Shape::of(samples, &probe(), 0.5, "puck").unwrap()
        });
        assert_eq!(strayed.middle, clean.middle, "{stray:?}");
        assert!((0..2).all(|axis| (clean.middle[axis] - place[axis]).abs() <= 2.0), "{:?}", clean.middle);
        let learned = recorded("puck", &[of(place, Some(stray))], &probe(), &settings).unwrap();
        assert!(learned.len() == 1 && learned[0].looks_round(), "{stray:?}");
    }
    // All parts of the object are on the map, not the largest alone.
    let two = |[x, y]: [f64; 2]| {
        let is_small = (50.0..62.0).contains(&x) && (0.0..30.0).contains(&y);
        if puck([x - 10.0, y - 25.0]) > 0.0 || is_small { 18.0 } else { 0.0 }
    };
    let samples = shape::all_samples(&pressed([0.0; 2], 0.0, 300, two), &probe()).unwrap();
    let both = Shape::of(samples, &probe(), 0.5, "two").unwrap();
    assert!((both.middle[0] - 10.0).abs() <= 2.0, "{:?}", both.middle);
    let relief = both.relief();
    let at = [56 - both.middle[0] as i32, 15 - both.middle[1] as i32];
    assert!(height(&relief, at) > 15.0);
}

/// A data set that states the hand.
fn dataset(objects: Vec<ObjectTouches>) -> Dataset {
    let origin = Origin { unit: Length::Millimeter, probe: probe(), pose: true, position: true, ..Origin::default() };
    Dataset { origin: Some(origin), ..Dataset::new(objects) }
}

#[test]
fn an_object_learned_on_the_table_is_recognized_beside_one_with_a_mesh() {
    let mut puck = Mesh::globe(12);
    puck.vertices.iter_mut().for_each(|vertex| *vertex = [25.0 * vertex[0], 25.0 * vertex[1], 8.0 * vertex[2]]);
    let mut puck = Object::new("puck", puck);
    puck.millimeters = Some(1.0);
    let pot = ObjectTouches::new("pot", pressed([0.0; 2], 0.0, 300, ell), Source::Object);
    let settings = CastSettings::default();
    let standing = standing(&[&puck], &probe(), settings.noise, &()).unwrap();
    let mut surfaces = cast(&standing, &probe(), &settings).unwrap();
    surfaces.iter_mut().for_each(|surface| surface.object = 1);
    surfaces.extend(learn(&dataset(vec![pot]), &settings).unwrap());
    let model = write(&surfaces, &["pot".into(), "puck".into()], &probe(), &settings).unwrap();
    let maps = Maps::new(&model).unwrap();
    let mut locating = locating(maps, maps.stopping(), None);
    let hand = Hand::of(&maps).unwrap();
    for touch in pressed([-20.0, -10.0], 0.3, 8, ell) {
        locating.push(seen(&hand, &touch).unwrap());
    }
    assert_eq!(maps.object_name(locating.leader()), "pot");
    assert!(locating.posteriors()[0] > 0.99, "{:?}", locating.posteriors());
}

#[test]
fn a_touch_without_a_position_is_named() {
    let mut touches = pressed([0.0; 2], 0.0, 3, ell);
    touches[1] = Touch::new([ContactTime::MISSING; 3]);
    let pot = dataset(vec![ObjectTouches::new("pot", touches, Source::Object)]);
    let error = learn(&pot, &CastSettings::default()).unwrap_err();
    assert_eq!(error.what(), "pot: touch 2 has no position");
}
