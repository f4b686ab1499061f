use glam::DVec3;
use palpate_shared::format::TrainedNoise;
use palpate_shared::{ContactTime, Pose, Q15_ONE, Touch};
use palpate_simulator::error::Kind;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::probe::approach::FINGERS;
use palpate_simulator::probe::approach::{Approach, Probe};
use palpate_simulator::probe::noise::{Deviation, Grazing, Noise, PartialNoise};
use palpate_simulator::probe::scene::Scene;
use palpate_simulator::random::{self, Purpose};
use rand_distr::{Distribution, StandardNormal};

/// Touches with Gaussian noise of one deviation.
fn noisy(name: &str, touches: &[Touch], deviation: f64, seed: u64) -> Vec<Touch> {
    Noise::gaussian(deviation).add(name, touches, seed)
}

/// Touches of this number of robots in turn.
fn by_robots(noise: Noise, name: &str, touches: &[Touch], seed: u64, robots: u64) -> Vec<Touch> {
    let stream = noise.stream(name, touches.len(), seed);
    (0..).zip(touches).map(|(index, touch)| stream.add(touch, index, index as u64 % robots)).collect()
}

/// The deviation that a text states.
fn of_range(text: &str) -> Option<Deviation> {
    format!("noise={text}").parse::<PartialNoise>().ok().map(|given| given.over(Noise::default()).deviation)
}

fn touches(count: u32) -> Vec<Touch> {
    (0..count).map(|i| Touch::from_micros([i % 977, 500_000, 900_000 + i])).collect()
}

/// Time from the first finger's contact to the last one's.
fn lag(touch: &Touch) -> f64 {
    let [first, _, last] = touch.times().map(|t| f64::from(t.micros().unwrap()));
    last - first
}

#[test]
fn noise_has_the_deviation_asked_for_and_no_drift() {
    let clean = touches(40_000);
    let noisy = noisy("fork", &clean, 5_000.0, 1);
    let differences: Vec<f64> = noisy.iter().zip(&clean).map(|(a, b)| lag(a) - lag(b)).collect();
    let count = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / count;
    let deviation = (differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count).sqrt();
    // The difference of two independent noises has the root of two times the deviation.
    assert!((deviation / 5_000.0 - 2.0_f64.sqrt()).abs() < 0.03, "{deviation}");
    assert!(mean.abs() < 5.0 * 7_071.0 / count.sqrt(), "{mean}");
}

#[test]
fn the_first_contact_is_zero_again_and_missing_ones_stay_missing() {
    let partial = Touch::new([ContactTime::MISSING, ContactTime::from_micros(70), ContactTime::FIRST]);
    for touch in noisy("fork", &vec![partial; 200], 5_000.0, 1) {
        let [missing, first, second] = touch.times().map(|t| t.micros());
        assert_eq!(missing, None);
        assert_eq!(first.min(second), Some(0));
    }
}

#[test]
fn names_and_seeds_make_other_noise_and_the_same_ones_the_same() {
    let clean = touches(50);
    let noise = |name, seed| noisy(name, &clean, 5_000.0, seed);
    assert_eq!(noise("fork", 1), noise("fork", 1));
    assert_ne!(noise("fork", 1), noise("spoon", 1));
    assert_ne!(noise("fork", 1), noise("fork", 2));
    assert_eq!(noisy("fork", &clean, 0.0, 1), clean.iter().map(|t| Touch::new(t.times())).collect::<Vec<_>>());
}

#[test]
fn one_level_is_the_noise_of_version_0_1_0() {
    let clean = touches(300);
    let noisy = noisy("fork", &clean, 5_000.0, 1);
    let mut random = random::generator(1, Purpose::Noise, "fork", 0);
    for (noisy, clean) in noisy.iter().zip(&clean) {
        let times = clean.times().map(|time| {
            let normal: f64 = StandardNormal.sample(&mut random);
            f64::from(time.micros().unwrap()) + 5_000.0 * normal
        });
        let earliest = times.into_iter().fold(f64::INFINITY, f64::min);
        assert_eq!(*noisy, Touch::from_micros(times.map(|time| (time - earliest).round() as u32)));
    }
    // Nothing else that is asked for changes the Gaussian part.
    let also = with!(Noise::gaussian(5_000.0); bent: [1.0, 1.0, 1.0]);
    assert_eq!(also.add("fork", &clean, 1), noisy);
}

#[test]
fn a_range_draws_a_level_for_every_touch() {
    let clean = touches(40_000);
    let deviation = |noise: Noise| {
        let noisy = noise.add("fork", &clean, 1);
        let squares = noisy.iter().zip(&clean).map(|(a, b)| (lag(a) - lag(b)).powi(2));
        (squares.sum::<f64>() / (2.0 * clean.len() as f64)).sqrt()
    };
    let mixture = deviation(with!(Noise::default(); deviation: Deviation { least: 0.0, largest: 9_000.0 }));
    // The mean of the third power of a uniform number from 0 to 1 is a quarter.
    assert!((mixture / 9_000.0 - 0.5).abs() < 0.02, "{mixture}");
}

#[test]
fn a_timer_rounds_down_from_a_phase_of_every_touch() {
    let clean = vec![Touch::from_micros([0, 400, 2_000]); 10_000];
    let noisy = with!(Noise::default(); timer: 1_000.0).add("fork", &clean, 1);
    let micros = |touch: &Touch, finger: usize| touch.times()[finger].micros().unwrap();
    assert!(noisy.iter().all(|touch| micros(touch, 0) == 0 && micros(touch, 2) == 2_000));
    // 400 µs later is a tick later in four touches of ten.
    let later = noisy.iter().filter(|touch| micros(touch, 1) == 1_000).count();
    assert!(noisy.iter().all(|touch| micros(touch, 1) % 1_000 == 0) && (3_800..4_200).contains(&later), "{later}");
}

#[test]
fn missed_contacts_are_as_many_as_asked_for_and_the_others_start_at_zero() {
    let noisy = with!(Noise::default(); missed: [0.25; 3]).add("fork", &touches(10_000), 1);
    let missing = noisy.iter().flat_map(|touch| touch.times()).filter(|time| time.is_missing()).count();
    assert!((7_200..7_800).contains(&missing), "{missing}");
    assert!(noisy.iter().all(|touch| touch.is_empty() || touch.times().contains(&ContactTime::FIRST)));
    let none = with!(Noise::default(); missed: [1.0; 3]).add("fork", &touches(10), 1);
    assert_eq!(none, vec![Touch::new([ContactTime::MISSING; 3]); 10]);
}

#[test]
fn a_bent_finger_is_early_and_a_fast_robot_has_short_times() {
    let touch = [Touch::from_micros([0, 10_000, 20_000])];
    let micros = |noise: Noise| noise.add("fork", &touch, 1)[0].times().map(|time| time.micros().unwrap());
    assert_eq!(micros(with!(Noise::default(); bent: [0.0, 3_000.0, 0.0])), [0, 7_000, 20_000]);
    assert_eq!(micros(with!(Noise::default(); bent: [0.0, 13_000.0, 0.0])), [3_000, 0, 23_000]);
    assert_eq!(micros(with!(Noise::default(); speed: 2.0)), [0, 5_000, 10_000]);
    let [_, middle, last] = micros(with!(Noise::default(); speed_error: 0.1));
    assert!(last != 20_000 && last.abs_diff(2 * middle) <= 1 && last.abs_diff(20_000) < 2_300, "{last}");
    let debounced = micros(with!(Noise::default(); debounce: 500.0));
    assert!(debounced != [0, 10_000, 20_000] && debounced[2].abs_diff(20_000) <= 500, "{debounced:?}");
}

#[test]
fn a_robots_bias_is_the_same_for_all_its_touches_and_objects() {
    let clean = vec![Touch::from_micros([0, 500_000, 1_000_000]); 30];
    let noise = with!(Noise::default(); speed_bias: 0.1);
    let fork = by_robots(noise, "fork", &clean, 1, 3);
    assert_eq!(fork, by_robots(noise, "spoon", &clean, 1, 3));
    assert!(fork.iter().zip(&fork[3..]).all(|(one, later)| one == later));
    assert!(fork[0] != fork[1] && fork[1] != fork[2]);
    assert_ne!(fork, by_robots(noise, "fork", &clean, 2, 3));
    // In training every touch is made by another robot.
    let distinct: std::collections::HashSet<_> = noise.add("fork", &clean, 1).into_iter().collect();
    assert_eq!(distinct.len(), 30);
}

#[test]
fn a_turned_pose_keeps_its_lengths_and_its_angle() {
    let pose = Pose { direction: [0, 0, Q15_ONE], alignment: [Q15_ONE, 0, 0] };
    let clean = vec![Touch::from_micros([0, 1, 2]).with_pose(pose); 4_000];
    let dot = |a: [i16; 3], b: [i16; 3]| -> f64 {
        a.iter().zip(b).map(|(&a, b)| f64::from(a) * f64::from(b)).sum::<f64>() / f64::from(Q15_ONE).powi(2)
    };
    for (noise, robots) in [(with!(Noise::default(); pose: 5.0), 1), (with!(Noise::default(); pose_bias: 5.0), 2_000)] {
        let poses = by_robots(noise, "fork", &clean, 1, robots);
        let poses: Vec<Pose> = poses.iter().map(|touch| touch.pose().unwrap()).collect();
        for Pose { direction, alignment } in &poses {
            assert!(dot(*direction, *alignment).abs() < 1e-4);
            assert!(
                (dot(*direction, *direction) - 1.0).abs() < 1e-4 && (dot(*alignment, *alignment) - 1.0).abs() < 1e-4
            );
        }
        // Two thirds of a turn's square are seen in each vector, on average.
        let squares =
            poses.iter().map(|turned| dot(turned.direction, pose.direction).min(1.0).acos().to_degrees().powi(2));
        let deviation = (1.5 * squares.sum::<f64>() / poses.len() as f64).sqrt();
        assert!((deviation - 5.0).abs() < 0.4, "{deviation}");
    }
    // Without a pose there is nothing to turn.
    assert_eq!(with!(Noise::default(); pose: 5.0).add("fork", &touches(5), 1), touches(5));
}

#[test]
fn noise_of_a_touch_depends_on_its_position_and_on_no_other_touch() {
    let noise = with!(Noise::default(); deviation: Deviation { least: 0.0, largest: 10_000.0 }, timer: 1_000.0, debounce: 2_000.0, missed: [0.1; 3], speed_error: 0.05);
    let (long, short) = (noise.add("fork", &touches(500), 1), noise.add("fork", &touches(200), 1));
    assert_eq!(long[..200], short);
    let others = vec![Touch::new([ContactTime::MISSING; 3]); 100]
        .into_iter()
        .chain(touches(200).drain(100..))
        .collect::<Vec<_>>();
    assert_eq!(noise.add("fork", &others, 1)[100..], short[100..]);
}

#[test]
fn noise_that_cannot_be_is_refused_by_the_name_of_its_setting() {
    let base = Noise::default();
    for (noise, name) in [
        (Noise::gaussian(-1.0), "noise"),
        (Noise::gaussian(f64::INFINITY), "noise"),
        (with!(base; deviation: Deviation { least: 2.0, largest: 1.0 }), "noise"),
        (with!(base; timer: f64::NAN), "timer"),
        (with!(base; debounce: -1.0), "debounce"),
        (with!(base; missed: [0.0, 1.5, 0.0]), "missed"),
        (with!(base; bent: [f64::NAN, 0.0, 0.0]), "bent"),
        (with!(base; speed: 0.0), "speed_factor"),
        (with!(base; speed_error: 1.0), "speed_error"),
        (with!(base; speed_bias: -0.1), "speed_bias"),
        (with!(base; pose: 181.0), "pose_noise"),
        (with!(base; pose_bias: f64::NAN), "pose_bias"),
        (with!(base; grazing: Grazing { angle: 20.0, bend: f64::NAN }), "grazing"),
        (with!(base; grazing: Grazing { angle: 90.0, bend: 1.0 }), "grazing"),
    ] {
        let error = noise.check().unwrap_err();
        assert!(matches!(error.kind(), Kind::Setting { name: found, .. } if *found == name), "{error}");
    }
    assert!(base.check().is_ok() && base.is_none() && !Noise::gaussian(1.0).is_none());
}

#[test]
fn a_model_states_the_noise_that_it_was_trained_with() {
    let noise =
        with!(Noise::default(); deviation: of_range("0..10ms").unwrap(), timer: 1_000.0, pose: 3.0, pose_bias: 4.0);
    assert_eq!(noise.trained(), TrainedNoise { least: 0, largest: 10_000, timer: 1_000, pose: 5_000 });
    assert_eq!(Noise::default().trained(), TrainedNoise::default());
}

#[test]
fn noise_is_said_in_words_and_a_late_finger_is_not_early_by_a_negative_time() {
    assert_eq!(Noise::default().to_string(), "no noise");
    assert_eq!(Noise::gaussian(5_000.0).to_string(), "noise of 5 ms");
    let noise = with!(Noise::default(); deviation: of_range("0..10ms").unwrap(), timer: 500.0, missed: [0.02; 3]);
    assert_eq!(noise.to_string(), "noise of 0 to 10 ms, a timer of 0.5 ms, 2 % of contacts missed");
    let noise = with!(Noise::default(); bent: [0.0, 3_000.0, 0.0], speed_bias: 0.05, pose: 5.0);
    assert_eq!(
        noise.to_string(),
        "finger 2 is 3 ms early, speed off by up to 5 % per robot, a pose turned by 5° per touch"
    );
    let noise = with!(Noise::default(); bent: [0.0, -4_311.0, 2_000.0]);
    assert_eq!(noise.to_string(), "finger 2 is 4.3 ms late, finger 3 is 2 ms early");
}

#[test]
fn levels_and_ranges_are_read() {
    let range = |least, largest| Some(Deviation { least, largest });
    assert_eq!(of_range("5ms"), range(5_000.0, 5_000.0));
    assert_eq!(of_range("0..10ms"), range(0.0, 10_000.0));
    assert_eq!(of_range("500us..2ms"), range(500.0, 2_000.0));
    for text in ["", "5", "..", "0..", "..5ms", "5ms..1ms", "0..10", "-1ms..2ms", "x..2ms"] {
        assert_eq!(of_range(text), None, "{text}");
    }
}

/// A square of 40 units whose normal is tilted by this angle from the motion along z.
fn slope(degrees: f64) -> Scene {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let corner = |x: f64, y: f64| [(x * cos) as f32, y as f32, (x * sin) as f32];
    let vertices = vec![corner(-20.0, -20.0), corner(20.0, -20.0), corner(20.0, 20.0), corner(-20.0, 20.0)];
    Scene::as_is(&Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] }).unwrap()
}

/// The distances of fingers that move along z, without bending and with.
fn grazed(scene: &Scene, grazing: &Grazing, start: DVec3, run: u64) -> [[Option<f64>; FINGERS]; 2] {
    let (probe, mut random) = (Probe::default(), random::generator(run, Purpose::Capture, "slope", 0));
    let approach = Approach { start, direction: DVec3::Z, alignment: DVec3::Y };
    [approach.distances(scene, &probe), grazing.distances(&approach, scene, &probe, &mut random)]
}

#[test]
fn fingers_bend_aside_at_flat_angles_only_and_touch_late_by_what_the_slope_makes_of_it() {
    let grazing = Grazing { angle: 20.0, bend: 10_000.0 };
    let start = DVec3::new(0.0, 0.0, -30.0);
    for degrees in [0.0, 10.0, 19.9] {
        let [rigid, bent] = grazed(&slope(degrees), &grazing, start, 1);
        assert_eq!(rigid, bent, "{degrees}");
    }
    for degrees in [40.0_f64, 60.0] {
        let scene = slope(degrees);
        let late = |run: u64| {
            let [rigid, bent] = grazed(&scene, &grazing, start, run);
            let late = rigid.iter().zip(bent).map(|(rigid, bent)| bent.unwrap() - rigid.unwrap());
            late.sum::<f64>() / 3.0
        };
        let runs = 4_000;
        let mean = (0..runs).map(late).sum::<f64>() / runs as f64;
        // A tenth of a unit aside at 45 degrees beyond the angle, on a surface that falls away by its tangent.
        let expected = 0.1 * (degrees - 20.0).to_radians().tan() * degrees.to_radians().tan();
        assert!((mean / expected - 1.0).abs() < 0.05, "{degrees}: {mean} {expected}");
    }
}

#[test]
fn a_finger_that_bends_beyond_an_edge_does_not_touch() {
    let scene = slope(60.0);
    let grazing = Grazing { angle: 0.0, bend: 100_000.0 };
    // Near the edge that falls away: one unit aside at 45 degrees leads beyond it as often as not.
    let start = DVec3::new(9.5, 0.0, -30.0);
    let lost = (0..500).flat_map(|run| grazed(&scene, &grazing, start, run)[1]).filter(Option::is_none).count();
    assert!((300..1_500).contains(&lost), "{lost} of 1500");
    let rigid = Grazing { angle: 60.5, bend: 100_000.0 };
    assert!((0..50).all(|run| grazed(&scene, &rigid, start, run)[1].iter().all(Option::is_some)));
}
