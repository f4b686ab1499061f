mod located;

use crate::fixtures::*;
use palpate::capture::{Sampler, Settings, capture, in_memory, scenes, touches};
use palpate::error::{CaptureProblem, Error, Result};
use palpate::mesh::Instance;
use palpate::probe::approach::Approach;
use palpate::probe::hand;
use palpate::probe::scene::Scene;
use palpate::progress::Progress;
use palpate::touches::{Listing, Shard, write_touch};

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
fn shards_put_together_are_the_whole() {
    for approaches in [false, true] {
        let origin = Origin { approaches, ..origin(1000) };
        let whole = files(&with(origin.clone()));
        let mut joined = BTreeMap::new();
        for number in 1..=7 {
            for (name, text) in files(&with(Origin { shard: shard(number), ..origin.clone() })) {
                *joined.entry(name).or_insert_with(String::new) += &text;
            }
        }
        assert_eq!(joined["disc.txt"], whole["disc.txt"]);
        assert_eq!(joined["globe.txt"], whole["globe.txt"]);
    }
}

fn shard(number: u64) -> Shard {
    format!("{number}/7").parse().unwrap()
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
    assert!(listing.complete);
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
fn what_an_interruption_left_behind_is_cut_off_and_the_rest_is_the_same() {
    let whole = files(&settings());
    let mut listing: Listing = serde_json::from_str(&whole["dataset.json"]).unwrap();
    let objects = objects();
    let scenes = scenes(&objects.iter().collect::<Vec<_>>(), &Origin::default(), &()).unwrap();
    for (object, kept) in [(0, 0), (0, 1), (0, 777), (0, 1500), (1, 0), (1, 1499), (1, 1500)] {
        // As if it had been killed after a checkpoint at N touches of this object.
        let directory = tempfile::tempdir().unwrap();
        listing.complete = false;
        for (index, entry) in listing.objects.iter_mut().enumerate() {
            let kept = [kept, if index < object { 1500 } else { 0 }][usize::from(index != object)];
            let text = &whole[&format!("{}.txt", entry.name)];
            let sampler = Sampler::of_instances(&scenes[index], &entry.name, &listing.origin);
            entry.crc32 = None;
            entry.touches = kept;
            entry.approaches = (0..kept).map(|sample| sampler.sample(sample).unwrap().1).sum();
            entry.bytes = text.lines().take(kept as usize).map(|line| line.len() as u64 + 1).sum();
            let end = if index == object { "part" } else { "txt" };
            if index <= object {
                let mut left = text[..entry.bytes as usize].to_owned();
                left += if index == object { "0.000000 0.1" } else { "" };
                std::fs::write(directory.path().join(format!("{}.{end}", entry.name)), left).unwrap();
            }
        }
        listing.write(directory.path()).unwrap();
        capture(&objects, &with!(settings(), resume = true), directory.path(), &()).unwrap();
        assert!(read_files(directory.path()) == whole, "object {object}, {kept} touches");
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
fn refusal(objects: &[Object], settings: &Settings, directory: &Path) -> CaptureProblem {
    let before = read_files(directory);
    let error = capture(objects, settings, directory, &()).unwrap_err();
    assert_eq!(error.exit_code(), 1);
    assert_eq!(read_files(directory), before, "what is there must stay");
    error.problem::<CaptureProblem>().unwrap_or_else(|| panic!("{error}")).clone()
}

fn globe_called(name: &str) -> Object {
    Object::new(name, Mesh::globe(6))
}

#[test]
fn a_capture_into_a_directory_with_other_objects_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let settings = with(origin(20));
    capture(&[globe_called("mug")], &settings, directory.path(), &()).unwrap();
    let boxed = [globe_called("box")];
    let holds = CaptureProblem::HoldsOtherObjects { objects: vec!["mug".into()], touches: 20 };
    assert_eq!(refusal(&boxed, &settings, directory.path()), holds);
    capture(&boxed, &with!(settings, force = true), directory.path(), &()).unwrap();
    assert_eq!(read_files(directory.path()).keys().collect::<Vec<_>>(), ["box.txt", "dataset.json"]);
}

#[test]
fn a_capture_over_touches_of_other_settings_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    capture(&objects(), &with(origin(20)), directory.path(), &()).unwrap();
    match refusal(&objects(), &with(Origin { seed: 2, ..origin(10) }), directory.path()) {
        CaptureProblem::HoldsOtherSettings { objects, differences } => {
            assert_eq!(objects, ["disc", "globe"]);
            assert_eq!(differences, "seed is 1 there and 2 here, touches is 20 there and 10 here");
        }
        other => panic!("{other}"),
    }
    let replaced = with!(with(origin(10)), force = true);
    capture(&objects(), &replaced, directory.path(), &()).unwrap();
    assert_eq!(read_files(directory.path())["globe.txt"].lines().count(), 10);
}

#[test]
fn touches_of_a_mesh_that_was_replaced_are_not_mixed_with_those_of_the_old_one() {
    let changed: Vec<Object> = objects()
        .into_iter()
        .map(|object| match object.name.as_str() {
            "globe" => Object::new("globe", Mesh::globe(13)),
            _ => object,
        })
        .collect();
    let said = "globe's mesh is another one there than here";
    // Resumed: before, the file went on with touches of the other mesh, and the data set was called complete.
    let directory = tempfile::tempdir().unwrap();
    cancelled(&settings(), directory.path());
    let resume = with!(settings(), resume = true);
    match refusal(&changed, &resume, directory.path()) {
        CaptureProblem::ResumesOtherSettings { differences } => assert_eq!(differences, said),
        other => panic!("{other}"),
    }
    capture(&objects(), &resume, directory.path(), &()).unwrap();
    // Repeated, which would delete the touches of the old mesh.
    match refusal(&changed, &settings(), directory.path()) {
        CaptureProblem::HoldsOtherSettings { differences, .. } => assert_eq!(differences, said),
        other => panic!("{other}"),
    }
    // Added to, after an interruption.
    let of = |name: &str, rings| Object::of_instances("cups", vec![instance("one", 5), instance(name, rings)]);
    let add = with!(settings(), add = true);
    capture(&[of("two", 6).unwrap()], &add, directory.path(), &CancelAfter(1.into())).unwrap_err();
    match refusal(&[of("two", 7).unwrap()], &with!(add.clone(), resume = true), directory.path()) {
        CaptureProblem::ResumesOtherSettings { differences } => {
            assert_eq!(differences, "cups's mesh of instance two is another one there than here");
        }
        other => panic!("{other}"),
    }
    capture(&[of("two", 6).unwrap()], &with!(add, resume = true), directory.path(), &()).unwrap();
    capture(&changed, &with!(settings(), force = true), directory.path(), &()).unwrap();
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
    let holds = CaptureProblem::HoldsFiles { files: vec!["fork.txt".into(), "globe.txt".into()] };
    assert_eq!(refusal(&objects(), &with(origin(20)), directory.path()), holds);
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

#[test]
fn an_unfinished_capture_repeated_without_resuming_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    cancelled(&settings(), directory.path());
    match refusal(&objects(), &settings(), directory.path()) {
        CaptureProblem::HoldsUnfinished { objects, .. } => assert_eq!(objects, ["disc", "globe"]),
        other => panic!("{other}"),
    }
    capture(&objects(), &with!(settings(), force = true), directory.path(), &()).unwrap();
    assert!(read_files(directory.path()) == files(&settings()));
}

#[test]
fn a_kill_while_old_touches_are_deleted_leaves_no_complete_listing() {
    // The first file to delete cannot be deleted: it stands for the moment of the kill.
    let directory = tempfile::tempdir().unwrap();
    capture(&objects(), &with(origin(20)), directory.path(), &()).unwrap();
    let obstacle = directory.path().join("globe.txt");
    std::fs::remove_file(&obstacle).unwrap();
    std::fs::create_dir(&obstacle).unwrap();
    let forced = with!(with(origin(30)), force = true);
    let error = capture(&objects(), &forced, directory.path(), &()).unwrap_err().to_string();
    assert!(error.contains("globe.txt: cannot remove the old touches"), "{error}");
    assert!(!directory.path().join("disc.txt").exists(), "deleted before the obstacle");
    assert!(Dataset::read(directory.path()).unwrap_err().to_string().contains("not complete"));
    std::fs::remove_dir(&obstacle).unwrap();
    capture(&objects(), &forced, directory.path(), &()).unwrap();
    assert_eq!(Dataset::read(directory.path()).unwrap().len(), 60);
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

/// Captures until the first chunk is written.
fn cancelled(settings: &Settings, directory: &Path) {
    let error = capture(&objects(), settings, directory, &CancelAfter(1.into())).unwrap_err();
    assert!(matches!(error, Error::Cancelled), "{error}");
}

#[test]
fn a_cancelled_capture_stops_and_can_be_resumed() {
    let directory = tempfile::tempdir().unwrap();
    cancelled(&settings(), directory.path());
    let listing = Listing::read(directory.path()).unwrap().unwrap();
    assert!(!listing.complete);
    assert!(Dataset::read(directory.path()).unwrap_err().to_string().contains("not complete"));
    assert!(!directory.path().join("globe.txt").exists(), "the second object was never begun");
    capture(&objects(), &with!(settings(), resume = true), directory.path(), &()).unwrap();
    assert!(read_files(directory.path()) == files(&settings()));
}

#[test]
fn objects_added_later_are_as_if_captured_together() {
    let together = files(&settings());
    let directory = tempfile::tempdir().unwrap();
    let [disc, globe] = objects().try_into().unwrap();
    let add = with!(settings(), add = true);
    for object in [globe.clone(), disc.clone()] {
        capture(&[object], &add, directory.path(), &()).unwrap();
    }
    assert!(read_files(directory.path()) == together);
    // What cannot be added.
    let there = CaptureProblem::AlreadyThere { objects: vec!["disc".into()] };
    assert_eq!(refusal(&[disc.clone(), globe_called("cup")], &add, directory.path()), there);
    let other = with!(with(origin(9)), add = true);
    let problem = refusal(&[globe_called("cup")], &other, directory.path());
    assert!(matches!(problem, CaptureProblem::AddsOtherSettings { .. }), "{problem}");
    // An interrupted addition can be resumed, and nothing else be added before it is.
    let error = capture(&[globe_called("cup")], &add, directory.path(), &CancelAfter(1.into())).unwrap_err();
    assert!(matches!(error, Error::Cancelled), "{error}");
    let problem = refusal(&[globe_called("jug")], &add, directory.path());
    assert!(matches!(problem, CaptureProblem::HoldsUnfinished { .. }), "{problem}");
    let resume = with!(add, resume = true);
    let problem = refusal(&[globe_called("jug")], &resume, directory.path());
    assert!(matches!(problem, CaptureProblem::ResumesOtherObjects { .. }), "{problem}");
    capture(&[globe_called("cup")], &resume, directory.path(), &()).unwrap();
    let dataset = Dataset::read(directory.path()).unwrap();
    assert_eq!((dataset.names(), dataset.len()), (["cup", "disc", "globe"].map(String::from).into(), 4500));
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
    // Written by `palpate capture` of that version: data sets are resumed, added to and compared across versions.
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
    assert_eq!(listing.objects[1].instances, ["fine", "coarse"]);
    assert!(listing.objects[0].instances.is_empty());
    assert_eq!(Dataset::read(directory.path()).unwrap().len(), 600);
}

#[test]
fn an_object_at_its_true_size_is_scaled_to_millimeters() {
    let unit = Length::Millimeter;
    let probe = with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0);
    let origin = Origin { unit, probe, ..origin(50) };
    let mut object = Object::new("globe", Mesh::globe(12));
    let problem = |result: Result<Vec<Vec<Scene>>>| result.unwrap_err().problem::<CaptureProblem>().cloned();
    let unknown = problem(scenes(&[&object], &origin, &()));
    assert_eq!(unknown, Some(CaptureProblem::NoTrueSize { name: "globe".into() }));
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
