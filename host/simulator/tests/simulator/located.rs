use crate::samples::cuboid;
use glam::DMat3;
use glam::DVec3;
use palpate_shared::ContactTime;
use palpate_shared::Touch;
use palpate_simulator::probe::noise::Grazing;
use palpate_simulator::probe::noise::Noise;
use palpate_simulator::probe::scene::Table;
use palpate_simulator::probe::{Approach, Located, Probe, Scene};
use palpate_simulator::random::{Purpose, generator};

/// A brick of 60 by 40 by 30 mm on a table.
fn brick() -> Scene {
    let mut mesh = cuboid([60.0, 40.0, 30.0]);
    mesh.vertices.iter_mut().for_each(|[x, y, z]| (*x, *y, *z) = (*x - 30.0, *y - 20.0, *z - 15.0));
    let table = Table { instance: 0, placement: "+z".into(), weight: 1.0, cone: 0.0 };
    Scene::on_table(&mesh, 60.0, DMat3::IDENTITY, table).unwrap()
}

fn probe() -> Probe {
    with!(Probe::default(); radius: 1.5, spacing: 15.0, speed: 100.0, tilt: 0.0)
}

fn at(place: [f64; 2], roll: f64, probe: &Probe) -> Located {
    Approach::straight_down(&brick(), probe, place, roll, 50.0).locate(&brick(), probe, None)
}

fn seen(touch: &Touch) -> ([Option<u32>; 3], [i32; 3]) {
    (touch.times().map(|time| time.micros()), touch.position().unwrap().micrometers)
}

#[test]
fn fingers_stop_at_the_top_of_a_brick_and_on_the_table_beside_it() {
    let top = at([3.0, -4.0], 0.0, &probe());
    assert_eq!(seen(&top.touch), ([Some(0); 3], [3_000, -4_000, 30_000]));
    let pose = top.touch.pose().unwrap();
    assert_eq!((pose.direction, pose.alignment), ([0, 0, -32_767], [32_767, 0, 0]));
    // The third finger is 5 mm beside the brick, and comes to the table 30 mm below its top: .3 s later.
    let beside = at([20.0, 0.0], 0.0, &probe());
    assert_eq!(seen(&beside.touch), ([Some(0), Some(0), Some(300_000)], [20_000, 0, 30_000]));
    // Turned around, it is the first one; turned by a quarter, all are on top.
    assert_eq!(seen(&at([20.0, 0.0], 180.0, &probe()).touch).0, [Some(300_000), Some(0), Some(0)]);
    assert_eq!(seen(&at([20.0, 0.0], 90.0, &probe()).touch).0, [Some(0); 3]);
    // Nothing but the table.
    assert_eq!(seen(&at([80.0, 0.0], 90.0, &probe()).touch), ([Some(0); 3], [80_000, 0, 0]));
}

#[test]
fn contacts_later_than_the_stroke_are_missing_and_travel_ends_where_nothing_is_met() {
    let short = with!(probe(); stroke: Some(20.0));
    let beside = at([20.0, 0.0], 0.0, &short);
    assert_eq!(seen(&beside.touch), ([Some(0), Some(0), None], [20_000, 0, 30_000]));
    assert_eq!((beside.late, beside.is_turned_back), ([false, false, true], false));
    let high = with!(probe(); travel: Some(12.5));
    let missed = at([20.0, 0.0], 0.0, &high);
    assert_eq!(seen(&missed.touch), ([None; 3], [20_000, 0, 37_500]));
    assert!(missed.is_turned_back && missed.touch.pose().is_some());
}

#[test]
fn a_row_that_is_tilted_states_its_tilt_and_touches_with_the_lower_finger_first() {
    let probe = with!(probe(); tilt: 10.0);
    let mut random = generator(1, Purpose::Synthetic, "", 0);
    for _ in 0..200 {
        let approach = Approach::draw_down(&mut random, &brick(), &probe, [[-3.0; 2], [3.0; 2]], 20.0);
        let touch = approach.locate(&brick(), &probe, None).touch;
        let rise = approach.alignment.z * probe.spacing;
        let z = f64::from(touch.position().unwrap().micrometers[2]) / 1e3;
        assert!((z - 30.0 - rise.abs()).abs() < 2e-3, "{z} {rise}");
        assert!(rise.abs() <= 15.0 * 10_f64.to_radians().sin() + 1e-9);
    }
}

#[test]
fn places_are_uniform_in_the_region() {
    let mut random = generator(1, Purpose::Synthetic, "", 0);
    let region = [[-10.0, 20.0], [30.0, 24.0]];
    let mut draw = || Approach::draw_down(&mut random, &brick(), &probe(), region, 20.0).start;
    let starts: Vec<DVec3> = (0..4_000).map(|_| draw()).collect();
    assert!(starts.iter().all(|at| (-10.0..30.0).contains(&at.x) && (20.0..24.0).contains(&at.y)));
    // The start's lowest point is 20 mm above the top, which is 15 mm above the middle of the box.
    assert!(starts.iter().all(|at| (at.z - 36.5).abs() < 1e-9));
    let count = |is: &dyn Fn(&DVec3) -> bool| starts.iter().filter(|at| is(at)).count();
    assert!((1_850..2_150).contains(&count(&|at| at.x < 10.0)) && (1_850..2_150).contains(&count(&|at| at.y < 22.0)));
}

/// An approach whose first finger comes down on the brick, and the others beside it.
fn edge() -> Approach {
    Approach::straight_down(&brick(), &probe(), [38.0, 0.0], 0.0, 50.0)
}

#[test]
fn a_lost_first_contact_moves_the_position_on_to_the_next_one() {
    let mut random = generator(1, Purpose::Synthetic, "", 0);
    let lost = |missed| with!(Noise::default(); missed: missed);
    let mut noisy = |noise: Noise| seen(&edge().locate(&brick(), &probe(), Some((&noise, &mut random))).touch);
    assert_eq!(noisy(lost([0.0; 3])), ([Some(0), Some(300_000), Some(300_000)], [38_000, 0, 30_000]));
    assert_eq!(noisy(lost([1.0, 0.0, 0.0])), ([None, Some(0), Some(0)], [38_000, 0, 0]));
    assert_eq!(noisy(lost([0.0, 1.0, 0.0])), ([Some(0), None, Some(300_000)], [38_000, 0, 30_000]));
    // If nothing is noticed, the hand goes down to the table.
    assert_eq!(noisy(lost([1.0; 3])), ([None; 3], [38_000, 0, 0]));
    // A finger that stands out by 2 mm touches 20 ms earlier, and so does the hand stop.
    let bent = with!(Noise::default(); bent: [20_000.0, 0.0, 0.0]);
    assert_eq!(noisy(bent), ([Some(0), Some(320_000), Some(320_000)], [38_000, 0, 32_000]));
}

#[test]
fn errors_of_times_and_positions_have_their_standard_deviation_and_are_independent() {
    let approach = Approach::straight_down(&brick(), &probe(), [0.0, 0.0], 0.0, 50.0);
    let noise = with!(Noise::default(); deviation: 5_000.0.into(), position: 1_000.0);
    let mut random = generator(1, Purpose::Synthetic, "", 0);
    let count = 20_000;
    let (mut x, mut middle, mut outer) = (0.0, 0.0, 0.0);
    for _ in 0..count {
        let (times, position) = seen(&approach.locate(&brick(), &probe(), Some((&noise, &mut random))).touch);
        x += (f64::from(position[0]) / 1e3).powi(2);
        // Heights of fingers, from the position and the times at the nominal speed, in millimeters.
        let height = |finger: usize| f64::from(position[2]) / 1e3 - f64::from(times[finger].unwrap()) / 1e4 - 30.0;
        middle += height(1) * height(1);
        outer += height(0) * height(2);
    }
    let [x, middle, outer] = [x, middle, outer].map(|sum| sum / f64::from(count));
    assert!((x.sqrt() - 1.0).abs() < 0.03, "{x}");
    // .5 mm of the time and 1 mm of the position, which all fingers share.
    assert!((middle.sqrt() - 1.25_f64.sqrt()).abs() < 0.03 && (outer - 1.0).abs() < 0.05, "{middle} {outer}");
}

#[test]
fn a_finger_that_slides_off_the_edge_touches_the_table() {
    // The ball of the first finger meets the upper edge of the brick at a flat angle.
    let approach = Approach::straight_down(&brick(), &probe(), [46.4, 0.0], 0.0, 50.0);
    let noise = with!(Noise::default(); grazing: Grazing { angle: 10.0, bend: 50_000.0 });
    let mut random = generator(1, Purpose::Synthetic, "", 0);
    assert!(seen(&approach.locate(&brick(), &probe(), None).touch).1[2] > 28_000);
    let touches =
        (0..50).map(|_| approach.locate(&brick(), &probe(), Some((&noise, &mut random))).touch).collect::<Vec<_>>();
    let slid = touches.iter().filter(|touch| seen(touch) == ([Some(0); 3], [46_400, 0, 0])).count();
    assert!(slid > 40, "{slid}");
    assert!(touches.iter().all(|touch| touch.times().iter().all(|time| *time != ContactTime::MISSING)));
}
