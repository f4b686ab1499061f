//! Captures of touches with the hand's position, of objects on a table.

use crate::fixtures::*;
use glam::DVec3;
use palpate::capture::{Settings, capture, in_memory, scenes};
use palpate::probe::approach::FINGERS;

/// A brick of 60 by 40 by 30 mm.
fn brick() -> Object {
    let vertices = (0..8).map(|corner: u8| {
        let side = |axis: u8, length: f32| if corner >> axis & 1 == 0 { 0.0 } else { length };
        [side(0, 60.0), side(1, 40.0), side(2, 30.0)]
    });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let mesh = Mesh { vertices: vertices.collect(), triangles: triangles.collect() };
    let mut brick = Object::new("brick", mesh);
    brick.millimeters = Some(1.0);
    brick
}

fn probe() -> Probe {
    with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 5.0)
}

fn origin(touches: u64) -> Origin {
    Origin {
        touches,
        unit: Length::Millimeter,
        probe: probe(),
        scene: Surroundings::Table { cone: 0.0 },
        pose: true,
        position: true,
        approaches: true,
        ..Origin::default()
    }
}

fn captured(origin: Origin) -> Dataset {
    in_memory(&[brick()], &origin.into(), &()).unwrap().0
}

/// Heights at which the fingers of a touch stopped, and their x and y, in millimeters in the placement's frame.
fn fingers(touch: &Touch) -> [Option<[f64; 3]>; FINGERS] {
    let position = touch.position().unwrap().micrometers.map(|micrometers| f64::from(micrometers) / 1e3);
    let along = touch.pose().unwrap().alignment.map(|cosine| f64::from(cosine) / f64::from(Q15_ONE) * 15.0);
    let mut place = -1.0;
    touch.times().map(|time| {
        let [x, y, z] = std::array::from_fn(|axis| position[axis] + place * along[axis]);
        place += 1.0;
        time.micros().map(|micros| [x, y, z - f64::from(micros) / 1e6 * 100.0])
    })
}

/// The sides of a brick's placement, in the order of the sources.
fn sides(origin: &Origin) -> Vec<DVec3> {
    let scenes = scenes(&[&brick()], origin, &()).unwrap();
    scenes[0].iter().map(|scene| scene.bounds()[1] - scene.bounds()[0]).collect()
}

#[test]
fn every_finger_stops_at_the_top_of_the_brick_or_on_the_table_beside_it() {
    let origin = origin(3_000);
    let (dataset, sides) = (captured(origin.clone()), sides(&origin));
    let object = &dataset.objects[0];
    assert_eq!(object.sources().len(), sides.len());
    let (mut top, mut table) = (0, 0);
    for (index, touch) in object.touches().iter().enumerate() {
        assert_eq!(touch.pose().unwrap().direction, [0, 0, -Q15_ONE]);
        let half = sides[object.source_of(index)] / 2.0;
        // A ball beside an edge meets it, if it is nearer than its radius.
        for [x, y, height] in fingers(touch).map(|finger| finger.expect("nothing ends before the table")) {
            let beside = DVec3::new(x.abs() - half.x, y.abs() - half.y, 0.0).max(DVec3::ZERO).length();
            if beside == 0.0 {
                assert!((height - 2.0 * half.z).abs() < 0.01, "{height} on a brick of {}", 2.0 * half.z);
                top += 1;
            } else if beside > 1.501 {
                assert!(height.abs() < 0.01, "{height} on the table");
                table += 1;
            }
        }
        let [x, y, _] = touch.position().unwrap().micrometers.map(|micrometers| f64::from(micrometers) / 1e3);
        assert!(x.abs() <= half.x + 5.0005 && y.abs() <= half.y + 5.0005, "{x} {y}");
    }
    assert!(top > 3_000 && table > 1_000, "{top} {table}");
}

#[test]
fn a_square_about_the_middle_may_be_aimed_at_instead_of_the_box() {
    let dataset = captured(Origin { within: Some(3.0), ..origin(500) });
    let places = dataset.touches().map(|touch| touch.position().unwrap().micrometers);
    let farthest = places.clone().map(|[x, y, _]| x.abs().max(y.abs())).max().unwrap();
    assert!((2_900..=3_000).contains(&farthest), "{farthest}");
}

#[test]
fn noise_and_lost_contacts_are_added_and_the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let real = with!(Noise::gaussian(5_000.0), position = 1_000.0, missed = [0.05; 3]);
    let origin = Origin { real, ..origin(700) };
    let directories = [1, 3].map(|threads| {
        let directory = tempfile::tempdir().unwrap();
        let settings = with!(Settings::from(origin.clone()), threads = Some(threads));
        capture(&[brick()], &settings, directory.path(), &()).unwrap();
        directory
    });
    let [one, other] =
        directories.each_ref().map(|directory| std::fs::read(directory.path().join("brick.txt")).unwrap());
    assert!(one == other);
    let read = Dataset::read_any(directories[0].path()).unwrap();
    assert_eq!(read, captured(origin.clone()));
    assert!(read.touches().all(|touch| touch.position().is_some()));
    let lost = read.touches().filter(|touch| !touch.is_full()).count();
    assert!((60..140).contains(&lost), "{lost}");
    // Without noise in the capture, the same heights with noise that is added later.
    let mut later = captured(Origin { real: Noise::default(), ..origin });
    later.add_noise(&real, 1, 1);
    let below = |dataset: &Dataset| {
        let heights = dataset.touches().flat_map(fingers).flatten().map(|[.., height]| height);
        heights.filter(|height| *height < 10.0).map(|height| height * height).collect::<Vec<_>>()
    };
    for dataset in [&read, &later] {
        // .5 mm of the time and 1 mm of the position are 1.1 mm on the table, also where the first contact was lost.
        let squares = below(dataset);
        let deviation = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((1.0..1.25).contains(&deviation), "{deviation}");
    }
}

#[test]
fn what_a_position_needs_is_named() {
    for (origin, what) in [
        (Origin { scene: Surroundings::Floating, ..origin(1) }, "scene is floating. Use table with --position"),
        (Origin { scene: Surroundings::Table { cone: 5.0 }, ..origin(1) }, "cone is 5. Use 0 with --position"),
        (Origin { unit: Length::Tenth, ..origin(1) }, "true_size is not given. Use it with --position"),
        (Origin { pose: false, ..origin(1) }, "pose is false. Use it with --position"),
        (Origin { approaches: false, ..origin(1) }, "approaches is false. Use it with --position"),
        (Origin { aim: palpate::probe::Aim::Mass, ..origin(1) }, "aim is mass. Use --within MM"),
        (Origin { within: Some(-1.0), ..origin(1) }, "within is -1. Use a length"),
        (Origin { within: Some(f64::NAN), ..origin(1) }, "within is NaN. Use a length"),
        (Origin { within: Some(1.0), ..Origin::default() }, "within is 1. Use it with --position"),
    ] {
        let error = origin.check().unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
    origin(1).check().unwrap();
}
