//! Properties of contact times that hold for any object, tried on random approaches.

use glam::{DQuat, DVec3};
use palpate::mesh::Mesh;
use palpate::probe::approach::{Approach, FINGERS, Probe};
use palpate::probe::scene::Scene;
use palpate::probe::sweep::Surface;
use palpate::with;
use proptest::prelude::*;
use rand::SeedableRng;
use std::sync::LazyLock;

/// Something with hills and hollows, 10 units long.
static OBJECT: LazyLock<Scene> = LazyLock::new(|| Scene::new(&Mesh::globe(20), 10.0).unwrap());

fn approach(seed: u64, tilt: f64) -> Approach {
    Approach::draw(&mut rand::rngs::Xoshiro256PlusPlus::seed_from_u64(seed), OBJECT.bounds(), tilt)
}

fn distances(surface: &Surface, approach: &Approach) -> [Option<f64>; FINGERS] {
    let probe = Probe::default();
    approach.fingers(probe.spacing).map(|finger| surface.first_contact(finger, approach.direction, probe.radius))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn curvature_is_unchanged_by_tilting_the_row_against_a_plane(
        slope in 0.0..60.0_f64, roll in 0.0..360.0_f64, tilt in -10.0..10.0_f64,
    ) {
        let plane = Surface::new(vec![
            [DVec3::new(-1e3, -1e3, 0.0), DVec3::new(1e3, -1e3, 0.0), DVec3::new(0.0, 1e3, 0.0)],
        ]);
        let direction = DVec3::new(slope.to_radians().sin(), 0.0, -slope.to_radians().cos());
        let row = DQuat::from_axis_angle(direction, roll.to_radians()) * DVec3::Y;
        let curvature = |tilt: f64| {
            let alignment = row * tilt.to_radians().cos() + direction * tilt.to_radians().sin();
            let approach = Approach { start: DVec3::new(0.0, 0.0, 9.0), direction, alignment };
            let [a, b, c] = distances(&plane, &approach).map(Option::unwrap);
            a - 2.0 * b + c
        };
        prop_assert!((curvature(tilt) - curvature(0.0)).abs() < 1e-11);
    }

    #[test]
    fn doubling_the_speed_halves_the_times(seed: u64, speed in 0.1..1e3_f64) {
        let approach = approach(seed, 10.0);
        let probe = with!(Probe::default(), speed);
        let distances = approach.distances(&OBJECT, &probe);
        let micros = |speed| approach.touch(distances, &with!(probe, speed)).times().map(|time| time.micros());
        for (once, twice) in micros(speed).into_iter().zip(micros(2.0 * speed)) {
            prop_assert_eq!(once.is_some(), twice.is_some());
            if let Some((once, twice)) = once.zip(twice) {
                prop_assert!(once.abs_diff(2 * twice) <= 1, "{} {}", once, twice);
            }
        }
    }

    #[test]
    fn mirroring_the_fingers_mirrors_the_times(seed: u64) {
        let probe = Probe::default();
        let approach = approach(seed, 10.0);
        let mirrored = Approach { alignment: -approach.alignment, ..approach };
        let touch = |approach: &Approach| approach.touch(approach.distances(&OBJECT, &probe), &probe);
        prop_assert_eq!(touch(&mirrored), touch(&approach).mirrored());
        let [a, b, c] = approach.distances(&OBJECT, &probe);
        prop_assert_eq!(mirrored.distances(&OBJECT, &probe), [c, b, a]);
    }

    #[test]
    fn moving_and_turning_scene_and_probe_together_changes_no_time(
        seed: u64, axis in prop::array::uniform3(-1.0..1.0_f64), angle in 0.0..6.3_f64,
        shift in prop::array::uniform3(-100.0..100.0_f64),
    ) {
        let turn = DQuat::from_axis_angle(DVec3::from(axis).normalize_or(DVec3::X), angle);
        let moved = |point: DVec3| turn * point + DVec3::from(shift);
        let surface = Surface::new(OBJECT.triangles().map(|triangle| triangle.map(moved)).collect());
        let here = approach(seed, 10.0);
        let there = Approach {
            start: moved(here.start),
            direction: turn * here.direction,
            alignment: turn * here.alignment,
        };
        let speed = Probe::default().speed;
        for (here, there) in distances(OBJECT.surface(), &here).into_iter().zip(distances(&surface, &there)) {
            prop_assert_eq!(here.is_some(), there.is_some());
            if let Some((here, there)) = here.zip(there) {
                prop_assert!((here - there).abs() / speed < 1e-6, "{} {}", here, there);
            }
        }
    }
}
