use crate::fixtures::*;
use palpate::capture::{Sampler, Settings, capture, in_memory, scenes, touches};
use palpate::mesh::Instance;
use palpate::probe::approach::Approach;
use palpate::probe::hand;
use palpate::probe::scene::Scene;
use palpate::progress::Progress;
use palpate::touches::{Listing, Samples, write_touch};

fn objects() -> Vec<Object> {
    [("disc", 0.1), ("globe", 1.0)]
        .map(|(name, height)| Object::new(name, Mesh::globe(12).stretched([1.0, 1.0, height])))
        .into()
}

fn origin(touches: u64) -> Origin {
    Origin { touches, ..Origin::default() }
}

/// The settings of `settings()` with another origin.
fn with(origin: Origin) -> Settings {
    with!(settings(), origin)
}

fn settings() -> Settings {
    with!(Settings::from(origin(1500)), threads = Some(2))
}

/// The files of a captured data set.
fn files(settings: &Settings) -> BTreeMap<String, String> {
    let directory = tempfile::tempdir().unwrap();
    capture(&objects(), settings, directory.path(), &()).unwrap();
    read_files(directory.path())
}

fn read_files(directory: &Path) -> BTreeMap<String, String> {
    let entries = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap());
    let file = |entry: std::fs::DirEntry| {
        (entry.file_name().into_string().unwrap(), std::fs::read_to_string(entry.path()).unwrap())
    };
    entries.map(file).filter(|(name, _)| name != ".lock").collect()
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let one = files(&with!(settings(), threads = Some(1)));
    assert_eq!(one.keys().collect::<Vec<_>>(), ["dataset.json", "disc.txt", "globe.txt"]);
    assert_eq!(one["disc.txt"].lines().count(), 1500);
    for threads in [2, 7] {
        assert_eq!(files(&with!(settings(), threads = Some(threads))), one);
    }
}

#[test]
fn another_seed_or_name_gives_other_touches() {
    let one = files(&settings());
    let other = files(&with(Origin { seed: 2, ..origin(1500) }));
    assert_ne!(one["disc.txt"], other["disc.txt"]);
    let scene = [Scene::new(objects()[0].mesh(), 10.0).unwrap()];
    let disc = touches(&scene, "disc", &origin(1500), 0..9).unwrap();
    assert_ne!(disc, touches(&scene, "disk", &origin(1500), 0..9).unwrap());
}

#[test]
fn parts_put_together_are_the_whole() {
    for approaches in [false, true] {
        let origin = Origin { approaches, ..origin(1000) };
        let whole = files(&with(origin.clone()));
        let mut joined = BTreeMap::new();
        for (first, end) in [(0, 1), (1, 142), (142, 700), (700, 1000)] {
            for (name, text) in files(&with(Origin { samples: Some(Samples { first, end }), ..origin.clone() })) {
                *joined.entry(name).or_insert_with(String::new) += &text;
            }
        }
        assert_eq!(joined["disc.txt"], whole["disc.txt"]);
        assert_eq!(joined["globe.txt"], whole["globe.txt"]);
    }
}

#[test]
fn touches_in_memory_are_those_on_the_disk() {
    let directory = tempfile::tempdir().unwrap();
    let origin = Origin { pose: true, ..origin(1500) };
    let settings = with(origin.clone());
    let summary = capture(&objects(), &settings, directory.path(), &()).unwrap();
    let dataset = Dataset::read(directory.path()).unwrap();
    for (object, read) in objects().iter().zip(&dataset.objects) {
        let scene = [Scene::new(object.mesh(), origin.length).unwrap()];
        assert!(read.touches() == touches(&scene, &object.name, &origin, 0..1500).unwrap().touches());
        assert!(read.touches().iter().all(|touch| touch.is_full() && touch.pose().is_some()));
    }
    let listing = Listing::read(directory.path()).unwrap().unwrap();
    assert_eq!(listing.objects[0].approaches, summary.objects[0].approaches);
    assert!(summary.objects[0].approaches > 2 * summary.objects[0].touches, "a disc is often missed");
}

#[test]
fn full_touches_are_the_full_ones_of_all_approaches_however_they_are_found() {
    // The early way out must lose or change no touch: drawn from one stream, the plain way finds the same.
    use rand::SeedableRng;
    for object in objects() {
        let scene = Scene::new(object.mesh(), 10.0).unwrap();
        let (mut rng, probe) = (rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1), Probe::default());
        let mut full = 0;
        for _ in 0..20_000 {
            let approach = Approach::draw(&mut rng, scene.bounds(), probe.tilt);
            let plain = match approach.distances(&scene, &probe) {
                [Some(a), Some(b), Some(c)] => Some([a, b, c]),
                _ => None,
            };
            assert_eq!(approach.full_distances(&scene, &probe), plain);
            full += u32::from(plain.is_some());
        }
        assert!(full > 100);
    }
}

#[test]
fn an_object_that_three_fingers_cannot_touch_is_named() {
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let speck = Object::new("speck", Mesh { vertices, triangles: vec![[0, 1, 2]] });
    let settings = with(Origin { length: 0.5, ..origin(1) });
    let directory = tempfile::tempdir().unwrap();
    let error = capture(&[speck], &settings, directory.path(), &()).unwrap_err().to_string();
    assert!(error.contains("speck (0.5 × 0.5 × 0 units): none of 4194304 approaches"), "{error}");
    assert!(!directory.path().join("dataset.json").exists(), "something was captured");
}

#[test]
fn wrong_settings_are_wrong_arguments() {
    let probe = Probe::default();
    for wrong in [
        with(origin(0)),
        with!(settings(), threads = Some(0)),
        with(Origin { length: 0.0, ..origin(9) }),
        with(Origin { length: f64::INFINITY, ..origin(9) }),
        with(Origin { probe: with!(probe, radius = -0.15), ..origin(9) }),
        with(Origin { probe: with!(probe, spacing = f64::NAN), ..origin(9) }),
        with(Origin { probe: with!(probe, speed = 0.0), ..origin(9) }),
        with(Origin { probe: with!(probe, speed = 1e-3), ..origin(9) }),
        with(Origin { probe: with!(probe, tilt = 90.0), ..origin(9) }),
    ] {
        let directory = tempfile::tempdir().unwrap();
        assert_eq!(capture(&objects(), &wrong, directory.path(), &()).unwrap_err().exit_code(), 2, "{wrong:?}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}

/// Reason why a capture of these objects into the directory is refused.
fn refusal(objects: &[Object], settings: &Settings, directory: &Path) -> String {
    let before = read_files(directory);
    let error = capture(objects, settings, directory, &()).unwrap_err();
    assert_eq!(error.exit_code(), 1);
    assert_eq!(read_files(directory), before, "what is there must stay");
    error.what().to_owned()
}

fn globe_called(name: &str) -> Object {
    Object::new(name, Mesh::globe(6))
}

#[test]
fn the_same_capture_may_be_repeated_and_gives_the_same_bytes() {
    let directory = tempfile::tempdir().unwrap();
    capture(&objects(), &with(origin(20)), directory.path(), &()).unwrap();
    let before = read_files(directory.path());
    std::fs::write(directory.path().join("globe.txt"), "0 0 0\n").unwrap();
    capture(&objects(), &with(origin(20)), directory.path(), &()).unwrap();
    assert_eq!(read_files(directory.path()), before);
}

#[test]
fn a_capture_into_a_directory_with_touches_from_elsewhere_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    for name in ["fork.txt", "globe.txt"] {
        std::fs::write(directory.path().join(name), "0 0 0\n").unwrap();
    }
    let refused = refusal(&objects(), &with(origin(20)), directory.path());
    assert_eq!(refused, "holds fork.txt, globe.txt, which this capture would not write");
}

#[test]
fn a_listing_that_cannot_be_read_is_not_written_over() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("dataset.json"), "{").unwrap();
    let error = capture(&objects(), &with(origin(20)), directory.path(), &()).unwrap_err().to_string();
    assert!(error.contains("dataset.json:1: not the listing of a data set"), "{error}");
    capture(&objects(), &with!(with(origin(20)), force = true), directory.path(), &()).unwrap();
    assert_eq!(Dataset::read(directory.path()).unwrap().len(), 40);
}

/// Cancels once this many touches are reported.
struct CancelAfter(std::sync::atomic::AtomicI64);

impl Progress for CancelAfter {
    fn advance(&self, steps: u64) {
        self.0.fetch_sub(steps as i64, std::sync::atomic::Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.0.load(std::sync::atomic::Ordering::Relaxed) <= 0
    }
}

#[test]
fn a_cancelled_capture_leaves_nothing_and_what_was_there_as_it_was() {
    let place = tempfile::tempdir().unwrap();
    let directory = place.path().join("data");
    let cancelled = |settings: &Settings| {
        let error = capture(&objects(), settings, &directory, &CancelAfter(1.into())).unwrap_err();
        assert!(error.is(&palpate::error::Kind::Cancelled), "{error}");
    };
    cancelled(&settings());
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
    capture(&objects(), &with(origin(20)), &directory, &()).unwrap();
    let before = read_files(&directory);
    cancelled(&with!(settings(), force = true));
    assert_eq!(read_files(&directory), before);
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1);
}

#[test]
fn a_directory_is_replaced_by_the_same_capture_or_by_force_only() {
    let place = tempfile::tempdir().unwrap();
    let directory = place.path().join("data");
    let holds = |files: &[&str]| format!("holds {}, which this capture would not write", files.join(", "));
    capture(&objects(), &with(origin(20)), &directory, &()).unwrap();
    let all = holds(&["dataset.json", "disc.txt", "globe.txt"]);
    let [disc, globe] = objects().try_into().unwrap();
    for other in [with(Origin { seed: 2, ..origin(20) }), with(origin(21)), with(Origin { pose: true, ..origin(20) })] {
        assert_eq!(refusal(&objects(), &other, &directory), all);
    }
    // Another mesh, and other objects.
    for objects in [vec![disc.clone(), globe_called("globe")], vec![disc], vec![globe_called("mug")]] {
        assert_eq!(refusal(&objects, &with(origin(20)), &directory), all);
    }
    std::fs::write(directory.join("mug.txt"), "0 0 0\n").unwrap();
    assert_eq!(refusal(&objects(), &with(origin(20)), &directory), holds(&["mug.txt"]));
    capture(&[globe], &with!(with(origin(30)), force = true), &directory, &()).unwrap();
    let files = read_files(&directory);
    assert_eq!(files.keys().collect::<Vec<_>>(), ["dataset.json", "globe.txt", "mug.txt"]);
    assert_eq!(files["globe.txt"].lines().count(), 30);
}

#[test]
fn a_hundred_thousand_threads_are_as_many_as_there_is_work_for() {
    assert!(files(&with!(settings(), threads = Some(100_000))) == files(&settings()));
}

#[test]
fn a_mesh_that_makes_no_scene_is_named_once_with_one_remedy() {
    let dot = Object::new("dot", Mesh { vertices: vec![[1.0; 3]], triangles: vec![[0; 3]] });
    let directory = tempfile::tempdir().unwrap();
    let error = capture(&[dot], &settings(), directory.path(), &()).unwrap_err().to_string();
    assert!(error.starts_with("dot: ") && !error.contains("..") && error.matches("dot").count() == 1, "{error}");
}

#[test]
fn the_samples_are_those_of_version_0_1_0() {
    // Written by `palpate capture` of that version: data sets are put together from parts and compared across versions.
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mesh = Mesh { vertices, triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] };
    let scene = [Scene::new(&mesh, 10.0).unwrap()];
    let text = |origin: &Origin, samples| {
        let mut text = String::new();
        for touch in touches(&scene, "tetrahedron", origin, samples).unwrap().touches() {
            write_touch(&mut text, touch, origin.pose);
        }
        text
    };
    assert_eq!(
        text(&Origin { pose: true, ..Origin::default() }, 0..3),
        "0.210317 0.105158 0.000000 0.787042 -0.398328 0.471084 0.551744 0.809778 -0.199530\n\
         0.000000 0.156403 0.312806 0.657857 0.255989 -0.708304 -0.685934 0.613666 -0.391034\n\
         0.000000 0.141773 0.366983 0.253578 -0.123203 -0.959441 -0.380718 0.893521 -0.238075\n"
    );
    assert_eq!(
        text(&Origin { approaches: true, seed: 7, ..Origin::default() }, 0..4),
        "0.110923 0.000000 -\n- - -\n- - 0.000000\n0.000000 0.028569 0.057137\n"
    );
}

fn instance(name: &str, rings: u32) -> Instance {
    Instance { name: name.into(), mesh: Mesh::globe(rings) }
}

#[test]
fn touches_of_an_object_are_of_its_instances_in_turn() {
    let two = Object::of_instances("globe", vec![instance("fine", 12), instance("coarse", 3)]).unwrap();
    let origin = origin(300);
    let scenes = scenes(&[&two], &origin, &()).unwrap();
    let both = Sampler::of_instances(&scenes[0], "globe", &origin);
    let alone = [0, 1].map(|turn| Sampler::of_instances(&scenes[0][turn..=turn], "globe", &origin));
    for index in 0..100 {
        assert_eq!(both.sample(index).unwrap(), alone[index as usize % 2].sample(index).unwrap());
    }
    let directory = tempfile::tempdir().unwrap();
    let disc = objects().remove(0);
    capture(&[two, disc], &with(origin), directory.path(), &()).unwrap();
    let listing = Listing::read(directory.path()).unwrap().unwrap();
    let pools =
        |object: usize| listing.objects[object].pools.iter().map(|pool| (pool.instance.as_deref(), pool.touches));
    assert_eq!(pools(1).collect::<Vec<_>>(), [(Some("fine"), 150), (Some("coarse"), 150)]);
    assert_eq!(pools(0).collect::<Vec<_>>(), [(None, 300)]);
    assert_eq!(Dataset::read(directory.path()).unwrap().len(), 600);
}

#[test]
fn an_object_at_its_true_size_is_scaled_to_millimeters() {
    let unit = Length::Millimeter;
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0);
    let origin = Origin { unit, probe, ..origin(50) };
    let mut object = Object::new("globe", Mesh::globe(12));
    let unknown = scenes(&[&object], &origin, &()).unwrap_err();
    assert_eq!(unknown.what(), "globe: the true size is unknown, because the mesh states no unit");
    // Meters: about two of them.
    object.millimeters = Some(1_000.0);
    let [low, high] = scenes(&[&object], &origin, &()).unwrap()[0][0].bounds();
    assert!((1_900.0..2_300.0).contains(&(high - low).max_element()), "{low} {high}");
    // As where an object is 10 units long: half of the longest side.
    assert_eq!(origin.clearance([low, high]), (high - low).max_element() / 2.0);
    object.millimeters = Some(1.0);
    let [low, high] = scenes(&[&object], &origin, &()).unwrap()[0][0].bounds();
    assert_eq!(origin.clearance([low, high]), 16.5, "a probe that is larger than the object");
}

#[test]
fn at_ten_units_a_side_true_size_is_the_normalized_one() {
    let mut object = Object::new("globe", Mesh::globe(12));
    let [low, high] = object.mesh().bounds();
    object.millimeters = Some(10.0 / f64::from((high - low).max_element()));
    let touches = |unit| {
        let origin = Origin { unit, ..origin(100) };
        let scenes = scenes(&[&object], &origin, &()).unwrap();
        touches(&scenes[0], "globe", &origin, 0..100).unwrap()
    };
    assert_eq!(touches(Length::Millimeter), touches(Length::Tenth));
}

#[test]
fn a_stroke_takes_away_late_contacts_and_changes_nothing_else() {
    let approaches = |probe: Probe, real: Noise| {
        let origin = Origin { approaches: true, pose: true, probe, real, ..origin(600) };
        in_memory(&objects(), &with(origin), &()).unwrap().0
    };
    let short = with!(Probe::default(), stroke = Some(1.0));
    // Noise pushes contacts over the end of the stroke, too.
    for real in [Noise::default(), with!(Noise::gaussian(20_000.0), missed = [0.3, 0.0, 0.0])] {
        let (whole, cut) = (approaches(Probe::default(), real), approaches(short, real));
        let expected = whole.each(|own| changed(own, |touch| hand::within(touch, Some(100_000)))).objects;
        let of = |object: &ObjectTouches| object.touches().to_vec();
        assert_eq!(cut.objects.iter().map(of).collect::<Vec<_>>(), expected.iter().map(of).collect::<Vec<_>>());
        assert_ne!(cut.objects[1].touches(), whole.objects[1].touches());
        // What is added later pushes none over it.
        let mut noisy = cut.clone();
        noisy.add_noise(&Noise::gaussian(30_000.0), 1, 1);
        assert!(noisy.touches().all(|touch| touch.spread() <= 100_000));
        assert!(noisy.touches().any(|touch| touch.spread() > 90_000));
    }
    // Full touches are those with all contacts within the stroke.
    let (full, _) = in_memory(&objects(), &with(Origin { probe: short, ..origin(300) }), &()).unwrap();
    assert!(full.touches().all(|touch| touch.is_full() && touch.spread() <= 100_000));
}
