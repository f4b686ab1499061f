//! Captures of objects on a table.

use super::*;
use crate::mesh::Mesh;
use crate::probe::noise::Noise;
use crate::touches::{Dataset, Listing, Surroundings, folds};
use crate::with;
use glam::DVec3;

/// A flat object, and one that lies in several ways.
fn objects() -> [Object; 2] {
    [("brick", [1.0, 0.6, 0.3]), ("disc", [1.0, 1.0, 0.1])]
        .map(|(name, sides)| Object::new(name, Mesh::globe(12).stretched(sides)))
}

fn origin(touches: u64) -> Origin {
    let scene = Surroundings::Table { cone: 50.0 };
    Origin { touches, scene, approaches: true, pose: true, ..Origin::default() }
}

fn of_instances() -> Object {
    let instance =
        |(name, sides): (&str, [f32; 3])| Instance { name: name.into(), mesh: Mesh::globe(10).stretched(sides) };
    Object::of_instances("stone", [("flat", [1.0, 0.8, 0.2]), ("long", [1.0, 0.3, 0.4])].map(instance).into()).unwrap()
}

#[test]
fn an_approach_ends_when_a_finger_reaches_the_table_and_no_contact_is_below_it() {
    let (origin, objects) = (origin(1), objects());
    let grazing = crate::probe::noise::Grazing { angle: 20.0, bend: 50_000.0 };
    let mut random = crate::random::generator(1, crate::random::Purpose::Synthetic, "", 0);
    let (mut ended, mut touched) = (0, 0);
    for (object, scenes) in objects.iter().zip(&scenes(&objects.each_ref(), &origin, &()).unwrap()) {
        let sampler = Sampler::of_instances(scenes, &object.name, &origin);
        for index in 0..2_000_u64 {
            let scene = &scenes[index as usize % scenes.len()];
            let (approach, probe) = (sampler.approach(scene, index), &origin.probe);
            let fingers = approach.fingers(probe.spacing);
            let lowest = scene.triangles().flatten().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
            let end = (0..FINGERS)
                .map(|finger| (fingers[finger].z - probe.radius - lowest) / -approach.direction.z)
                .fold(f64::INFINITY, f64::min);
            let distances = approach.distances(scene, probe);
            for finger in 0..FINGERS {
                let free = scene.first_contact(fingers[finger], approach.direction, probe.radius);
                let expected = free.filter(|distance| *distance <= end);
                assert_eq!(distances[finger], expected, "{} {index}", object.name);
                ended += usize::from(free.is_some() && expected.is_none());
                if let Some(distance) = distances[finger] {
                    touched += 1;
                    let bottom = fingers[finger].z + distance * approach.direction.z - probe.radius;
                    assert!(bottom >= lowest - 1e-9, "{bottom} is below the table at {lowest}");
                }
            }
            let bent = grazing.distances(&approach, scene, probe, &mut random);
            assert!(bent.iter().flatten().all(|distance| *distance <= end), "fingers that bend touch the table too");
            let full = distances.iter().all(Option::is_some);
            assert_eq!(approach.full_distances(scene, probe).is_some(), full);
            let missing = sampler.sample(index).unwrap().0.times().map(|time| time.micros().is_none());
            assert_eq!(missing, distances.map(|distance| distance.is_none()));
        }
    }
    assert!(ended > 100 && touched > 1_000, "{ended} contacts too late, {touched} in time");
}

#[test]
fn directions_are_uniform_within_the_cone_and_seen_from_the_tables_frame() {
    for cone in [10.0, 60.0, 90.0] {
        let origin = Origin { scene: Surroundings::Table { cone }, ..origin(1) };
        let objects = objects();
        let scenes = scenes(&[&objects[0]], &origin, &()).unwrap();
        let sampler = Sampler::of_instances(&scenes[0], "brick", &origin);
        let count = 20_000;
        let directions: Vec<DVec3> = (0..count).map(|index| sampler.approach(&scenes[0][0], index).direction).collect();
        let least = f64::to_radians(cone).cos();
        let down: Vec<f64> = directions.iter().map(|direction| -direction.z).collect();
        assert!(down.iter().all(|down| *down >= least - 1e-12 && *down <= 1.0));
        assert!(directions.iter().all(|direction| (direction.length() - 1.0).abs() < 1e-12));
        // Equal areas of the cap: bands of equal height, and quadrants.
        for band in 0..4 {
            let low = least + (1.0 - least) * f64::from(band) / 4.0;
            let share = down.iter().filter(|down| (low..low + (1.0 - least) / 4.0).contains(*down)).count();
            assert!((4_600..5_400).contains(&share), "{share} in band {band} of {cone} degrees");
        }
        for [x, y] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let share = directions.iter().filter(|direction| direction.x * x > 0.0 && direction.y * y > 0.0).count();
            assert!((4_600..5_400).contains(&share), "{share} of {cone} degrees");
        }
        let (touch, _) = sampler.sample(0).unwrap();
        let expected = sampler.approach(&scenes[0][0], 0).pose();
        assert_eq!(touch.pose(), Some(expected));
    }
}

#[test]
fn the_middle_finger_starts_on_the_sphere_about_the_object_and_moves_to_its_box() {
    let origin = origin(1);
    let objects = objects();
    for scene in &scenes(&objects.each_ref(), &origin, &()).unwrap()[0] {
        let sampler = Sampler::new(scene, "brick", &origin);
        let [low, high] = scene.bounds();
        let radius = (high - low).length() / 2.0 + origin.clearance(scene.bounds());
        for index in 0..500 {
            let approach = sampler.approach(scene, index);
            assert!((approach.start.distance((low + high) / 2.0) - radius).abs() < 1e-9);
            let steps =
                (0..4_000).map(|step| approach.start + approach.direction * (f64::from(step) * radius / 2_000.0));
            assert!(steps.into_iter().any(|at| at.cmpge(low - 0.02).all() && at.cmple(high + 0.02).all()), "{index}");
        }
    }
}

#[test]
fn all_placements_of_an_object_have_its_scale_and_lie_on_the_table() {
    let object = Object::new("brick", Mesh::globe(12).stretched([1.0, 0.6, 0.3]));
    let scenes = &scenes(&[&object], &origin(1), &()).unwrap()[0];
    let floating = Scene::new(object.mesh(), 10.0).unwrap();
    let size = |scene: &Scene| {
        let points: Vec<DVec3> = scene.triangles().flatten().collect();
        points.iter().map(|point| point.distance(points[0])).fold(0.0, f64::max)
    };
    let area = |scene: &Scene| scene.triangles().map(|[a, b, c]| (b - a).cross(c - a).length()).sum::<f64>();
    assert!(scenes.len() > 1);
    for scene in scenes {
        assert!((area(scene) / area(&floating) - 1.0).abs() < 1e-9);
        assert!(size(scene) > 0.0 && scene.table().is_some());
    }
}

#[test]
fn samples_are_of_instances_and_placements_in_turn_and_the_data_set_names_them() {
    let object = of_instances();
    let disc = Object::new("disc", Mesh::globe(12).stretched([1.0, 1.0, 0.1]));
    let (settings, directory) = (Settings::from(origin(700)), tempfile::tempdir().unwrap());
    let scenes = scenes(&[&object], &settings.origin, &()).unwrap().remove(0);
    let summary = capture(&[object.clone(), disc.clone()], &settings, directory.path(), &()).unwrap();
    assert!(summary.objects.iter().all(|one| one.touching > 0 && one.touching < one.approaches));
    let listing = Listing::read(directory.path()).unwrap().unwrap();
    let entry = &listing.objects[1];
    assert_eq!((entry.name.as_str(), entry.pools.len(), entry.touches()), ("stone", scenes.len(), 700));
    for (pool, scene) in entry.pools.iter().zip(&scenes) {
        let table = scene.table().unwrap();
        assert_eq!(pool.instance.as_deref(), Some(["flat", "long"][table.instance]));
        let lying = pool.placement.as_ref().unwrap();
        assert_eq!((lying.name.as_str(), lying.weight), (table.placement.as_str(), table.weight));
    }
    let dataset = Dataset::read(directory.path()).unwrap();
    let stone = &dataset.objects[1];
    assert_eq!(stone.sources(), sources(&object, &scenes).iter().collect::<Vec<_>>());
    assert_eq!(stone.pools().len(), scenes.len(), "no sequence mixes placements");
    let sampler = Sampler::of_instances(&scenes, "stone", &settings.origin);
    for index in [0, 1, 5, 699] {
        let alone = Sampler::new(&scenes[index % scenes.len()], "stone", &settings.origin);
        assert_eq!(sampler.sample(index as u64).unwrap(), alone.sample(index as u64).unwrap());
        // On the disk, poses are rounded to fewer digits than touches in memory have.
        let own = stone.of_pool(&stone.pools()[index % scenes.len()])[index / scenes.len()];
        assert_eq!(own.times(), sampler.sample(index as u64).unwrap().0.times());
    }
    let in_memory = super::in_memory(&[object, disc], &settings, &()).unwrap().0;
    assert_eq!(in_memory, dataset);
    let weights = stone.placement_weights().unwrap();
    assert!((weights.iter().map(|(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-9);
    assert!(weights.windows(2).all(|two| two[0].1 >= two[1].1));
    assert!((stone.source_weights().iter().sum::<f64>() - 1.0).abs() < 1e-9);
}

#[test]
fn parts_and_copies_of_a_data_set_keep_the_placements_and_their_weights() {
    let (settings, place) = (Settings::from(origin(600)), tempfile::tempdir().unwrap());
    let whole = in_memory(&[of_instances(), objects()[0].clone()], &settings, &()).unwrap().0;
    let noisy = whole.each(|object| object.noisy(&with!(Noise::default(), speed_bias = 0.1), 1, 2));
    let folds::Split { train, test } = folds::split(&whole, 0.3, 1).unwrap();
    let thinned = whole.each(|object| object.thinned(100));
    let doubled = whole.each(|object| {
        let mut twice = object.part(0..1, 2);
        twice.append(&object.part(1..2, 2));
        twice
    });
    for part in [&noisy, &train, &test, &thinned, &doubled] {
        for (object, own) in whole.objects.iter().zip(&part.objects) {
            assert_eq!(own.placement_weights(), object.placement_weights());
            assert_eq!(own.source_weights(), object.source_weights());
            assert_eq!(own.sources(), object.sources());
        }
    }
    for (number, part) in [&whole, &train, &test].into_iter().enumerate() {
        let directory = place.path().join(number.to_string());
        part.write(&directory, None).unwrap();
        let read = Dataset::read(&directory).unwrap();
        for (object, own) in part.objects.iter().zip(&read.objects) {
            assert_eq!(own.placement_weights(), object.placement_weights());
            assert_eq!(own.pools(), object.pools());
        }
    }
    let joined = ObjectTouches::joined("background", &whole.objects);
    assert_eq!(joined.sources().len(), whole.objects.iter().map(|object| object.sources().len()).sum::<usize>());
    assert!((joined.source_weights().iter().sum::<f64>() - 1.0).abs() < 1e-9);
}

#[test]
fn stated_weights_replace_solid_angles_and_unknown_placements_are_refused_with_those_that_there_are() {
    let weighed = |weights: &[(&str, f64)]| {
        let mut object = Object::new("brick", Mesh::globe(12).stretched([1.0, 0.6, 0.3]));
        object.placement_weights = weights.iter().map(|&(name, weight)| (name.to_owned(), weight)).collect();
        in_memory(&[object], &origin(20).into(), &())
            .map(|(dataset, _)| dataset.objects[0].placement_weights().unwrap())
    };
    let usual = weighed(&[]).unwrap();
    let [first, second] = [&usual[0].0, &usual[1].0];
    assert_eq!(weighed(&[(first, 1.0), (second, 3.0)]).unwrap(), [(second.clone(), 0.75), (first.clone(), 0.25)]);
    assert_eq!(weighed(&[(first, 0.0), (second, 3.0)]).unwrap(), [(second.clone(), 1.0)]);
    let unknown = weighed(&[("+q", 1.0)]).unwrap_err().to_string();
    assert!(unknown.contains("+q") && unknown.contains(first) && unknown.contains(second), "{unknown}");
    assert!(weighed(&[(first, 0.0)]).unwrap_err().to_string().contains("no placement of brick has a weight above 0"));
    let empty = crate::mesh::placements::placements(&Mesh::default()).unwrap_err();
    assert_eq!(empty.what(), "the mesh has no faces");
}

#[test]
fn a_capture_of_another_scene_or_other_weights_replaces_none_unless_it_is_forced() {
    let (directory, objects) = (tempfile::tempdir().unwrap(), objects());
    let run = |origin: Origin, object: &Object, force| {
        let settings = Settings { force, ..origin.into() };
        capture(std::slice::from_ref(object), &settings, directory.path(), &()).map_err(|error| error.to_string())
    };
    let brick = &objects[0];
    run(origin(50), brick, false).unwrap();
    let floating = Origin { scene: Surroundings::Floating, ..origin(50) };
    let steeper = Origin { scene: Surroundings::Table { cone: 30.0 }, ..origin(50) };
    let mut weighed = brick.clone();
    weighed.placement_weights = vec![("+z".into(), 1.0)];
    for (other, object) in [(&floating, brick), (&steeper, brick), (&origin(50), &weighed)] {
        let again = run(other.clone(), object, false).unwrap_err();
        assert!(again.contains("holds brick, dataset.json, which this capture would not write"), "{again}");
    }
    run(origin(50), brick, false).unwrap();
    run(floating, brick, true).unwrap();
    assert_eq!(Listing::read(directory.path()).unwrap().unwrap().objects[0].pools[0].placement, None);
}

#[test]
fn the_listing_of_a_floating_capture_says_nothing_about_a_table() {
    let directory = tempfile::tempdir().unwrap();
    let origin = Origin { scene: Surroundings::Floating, ..origin(20) };
    capture(&objects(), &origin.into(), directory.path(), &()).unwrap();
    let text = std::fs::read_to_string(Listing::path(directory.path())).unwrap();
    assert!(!text.contains("scene") && !text.contains("placement"), "{text}");
}
