//! Located objects, from touches to verdicts.

use crate::fixtures::*;
use palpate::calibrate as promises;
use palpate::locate::{
    Aimed, Approach, CastSettings, Maps, Real, Standing, TOUCHES, Terms, Until, World, calibrate, cast, evaluate,
    learn, locating, standing, write,
};
use palpate::onboard::locate::{Contact, Seen};
use palpate::play::Hidden;

fn probe() -> Probe {
    with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0))
}

/// A long box without corners, and one that is round from above.
fn objects() -> [Object; 2] {
    [("bar", [40.0, 15.0, 10.0]), ("puck", [25.0, 25.0, 8.0])].map(|(name, half)| {
        let mut mesh = Mesh::globe(12);
        for vertex in &mut mesh.vertices {
            let longest = vertex.iter().fold(0.0_f32, |longest, axis| longest.max(axis.abs()));
            let length = vertex.iter().map(|axis| axis * axis).sum::<f32>().sqrt();
            // The bar is a globe that is made square, and the puck one without its bumps.
            let scale = if name == "bar" { longest } else { length };
            *vertex = [0, 1, 2].map(|axis| half[axis] * vertex[axis] / scale);
        }
        sized(name, mesh)
    })
}

/// An object whose mesh is in millimeters.
fn sized(name: &str, mesh: Mesh) -> Object {
    let mut object = Object::new(name, mesh);
    object.millimeters = Some(1.0);
    object
}

/// The objects as they stand.
static STANDING: LazyLock<Vec<Standing>> = LazyLock::new(|| stands(&objects()));

fn stands(objects: &[Object]) -> Vec<Standing> {
    standing(&objects.iter().collect::<Vec<_>>(), &probe(), 0.5, &()).unwrap()
}

fn names(standing: &[Standing]) -> Vec<String> {
    standing.iter().map(|object| object.name.clone()).collect()
}

fn model(settings: &CastSettings) -> Vec<u8> {
    write(&cast(&STANDING, &probe(), settings).unwrap(), &names(&STANDING), &probe(), settings).unwrap()
}

/// Maps with the usual settings.
static MODEL: LazyLock<Vec<u8>> = LazyLock::new(|| model(&CastSettings::default()));
/// Coarser ones.
static COARSE: LazyLock<Vec<u8>> = LazyLock::new(|| model(&with!(CastSettings::default(), fine = false)));

fn terms(sequences: usize) -> Terms {
    Terms {
        promise: promises::Terms { rate: 0.1, confidence: 0.9, per: Per::Average },
        sequences,
        max_touches: 20,
        aimed: Aimed::Chosen,
        real: Real::default(),
        unknown: false,
        until: None,
        pose: 10,
        within: 60_000,
        seed: 7,
        effort: None,
    }
}

#[test]
fn an_object_is_named_and_found_in_a_few_approaches_chosen_or_at_random() {
    let maps = Maps::new(&MODEL).unwrap();
    assert_eq!([0, 1].map(|object| maps.object_name(object)), ["bar", "puck"]);
    for aimed in [Aimed::Chosen, Aimed::Random] {
        let found = evaluate(maps, &STANDING, &probe(), &Terms { aimed, ..terms(40) }, &()).unwrap();
        assert!(found.wrong <= 1 && found.given >= 35, "{found:?}");
        assert!(found.mean_approaches < 12.0, "{found:?}");
    }
    let until = Some(Until { millimeters: 6.0, degrees: 10.0 });
    let sure = evaluate(maps, &STANDING, &probe(), &Terms { until, ..terms(40) }, &()).unwrap();
    assert!(sure.poses_within * 10 >= sure.poses * 9 && sure.poses >= 30, "{sure:?}");
}

#[test]
fn an_object_that_lies_hidden_is_found_among_its_ghosts() {
    let maps = Maps::new(&COARSE).unwrap();
    let world = World { standing: &STANDING, probe: &probe(), real: Real::default(), range: 28.0, seed: 3 };
    let mut hidden = Hidden::new(&world, maps, 0).unwrap();
    assert!(hidden.ghosts().is_empty());
    let first = hidden.choose();
    assert_eq!([first.x, first.y], [0; 2]);
    for _ in 0..10 {
        let at = hidden.choose();
        assert!(at.x.abs() <= 60_000 && at.y.abs() <= 60_000, "{at:?}");
        let pressed = hidden.press(at).unwrap();
        let heights: Vec<f64> = pressed.heights.into_iter().flatten().collect();
        assert!(heights.iter().all(|height| (pressed.lowest - 3.0..45.0).contains(height)), "{pressed:?}");
    }
    let (ghosts, truth) = (hidden.ghosts(), hidden.truth());
    assert_eq!((ghosts[0].object, truth.object), (0, 0));
    assert!(ghosts.iter().map(|ghost| ghost.share).sum::<f64>() <= 1.001);
    let is_near = |(found, place): (&i32, f64)| (f64::from(*found) / 1_000.0 - place).abs() < 12.0;
    assert!(ghosts[0].pose.position.iter().zip(truth.place).all(is_near), "{ghosts:?}, {truth:?}");
    while hidden.press(Approach::default()).is_some() {}
    assert_eq!(hidden.locating.touches(), TOUCHES);
}

#[test]
fn the_same_seed_gives_the_same_sequences_on_any_number_of_threads() {
    let found = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let evaluate = || evaluate(Maps::new(&COARSE).unwrap(), &STANDING, &probe(), &terms(12), &()).unwrap();
        format!("{:?}", pool.install(evaluate))
    };
    assert_eq!(found(1), found(4));
}

#[test]
fn a_calibrated_model_states_its_promise_and_how_approaches_were_aimed() {
    for (aimed, unknown) in [(Aimed::Chosen, false), (Aimed::Random, true)] {
        let terms = Terms { aimed, unknown, ..terms(80) };
        let calibrated = calibrate(Maps::new(&MODEL).unwrap(), &STANDING, &probe(), &terms, &()).unwrap();
        let maps = Maps::new(&calibrated.model).unwrap();
        let promise = maps.promise().unwrap();
        assert_eq!((promise.rate, promise.active), (0.1, aimed == Aimed::Chosen));
        assert_eq!((promise.given as usize, promise.wrong as usize), (calibrated.given, calibrated.wrong));
        let other = Terms { seed: 8, ..terms };
        let found = evaluate(maps, &STANDING, &probe(), &other, &()).unwrap();
        assert!(found.wrong * 4 <= found.given, "{found:?}");
        assert_eq!(Maps::new(&MODEL).unwrap().promise(), None);
    }
}

#[test]
fn an_object_that_moves_in_each_approach_takes_a_few_more() {
    let real = Real { drift: 1.0, drift_yaw: 1.0, ..Real::default() };
    let [still, moving] = [Real::default(), real].map(|real| {
        let bytes = model(&CastSettings::default().expecting(&real));
        evaluate(Maps::new(&bytes).unwrap(), &STANDING, &probe(), &Terms { real, ..terms(60) }, &()).unwrap()
    });
    assert!(moving.mean_approaches < 2.0 * still.mean_approaches && moving.given >= 55, "{moving:?}, still {still:?}");
    assert!(moving.wrong <= 2, "{moving:?}");
}

#[test]
fn a_hand_that_may_not_leave_the_middle_aims_otherwise_chosen_or_at_random() {
    for aimed in [Aimed::Chosen, Aimed::Random] {
        let mean = |within, sequences| {
            let terms = Terms { aimed, within, ..terms(sequences) };
            evaluate(Maps::new(&MODEL).unwrap(), &STANDING, &probe(), &terms, &()).unwrap().mean_approaches
        };
        let [kept, free] = [0, 60_000].map(|within| mean(within, 30));
        // A bar as long as the table is met from the middle more often than at random.
        let expected = if aimed == Aimed::Chosen { kept > 1.2 * free } else { kept < free };
        assert!(expected, "{aimed:?}: {kept} in the middle, {free} anywhere");
        assert_eq!(mean(u32::MAX, 6), mean(10_000_000, 6));
    }
}

#[test]
fn intervals_of_poses_and_approaches_until_them_are_of_a_calibration_for_places() {
    let within = |bytes: &[u8]| {
        let maps = Maps::new(bytes).unwrap();
        let mut locating = locating(maps, maps.stopping(), None);
        locating.push(Seen::new([0, 0], [15_000, 0], [Contact::At(20_000); 3], 0));
        locating.poses(0)[0].within
    };
    let calibrated = |until, sequences| {
        let terms = Terms { until, ..terms(sequences) };
        calibrate(Maps::new(&MODEL).unwrap(), &STANDING, &probe(), &terms, &()).unwrap()
    };
    // A name is sure long before its pose: intervals that held 95 % of such poses would be as wide as the table.
    let named = calibrated(None, 40);
    assert_eq!(within(&named.model), within(&MODEL));
    let placed = calibrated(Some(Until { millimeters: 20.0, degrees: 90.0 }), 60);
    assert_ne!(within(&placed.model), within(&MODEL));
    // Approaches until the place are stated, too.
    let until = placed.until.unwrap();
    assert!(until.right >= 20 && until.placed * 2 >= until.right, "{until:?}");
    assert!(named.until.is_none() && until.mean_approaches > placed.mean_approaches - 0.5, "{until:?}");
}

#[test]
fn places_that_are_never_as_sure_as_asked_for_are_refused() {
    let terms = Terms { until: Some(Until { millimeters: 0.5, degrees: 0.5 }), ..terms(20) };
    let error = calibrate(Maps::new(&MODEL).unwrap(), &STANDING, &probe(), &terms, &()).unwrap_err().to_string();
    assert!(error.contains("only 0 had a place as sure as 0.5 mm and 0.5° within 20 approaches"), "{error}");
}

#[test]
fn going_on_until_the_place_changes_no_name() {
    let evaluated = |until| {
        let terms = Terms { until, ..terms(60) };
        evaluate(Maps::new(&MODEL).unwrap(), &STANDING, &probe(), &terms, &()).unwrap()
    };
    let plain = evaluated(None);
    // The last one is never met.
    for (millimeters, degrees) in [(4.0, 8.0), (2.0, 4.0), (0.5, 0.5)] {
        let found = evaluated(Some(Until { millimeters, degrees }));
        assert!(found.given >= plain.given && found.wrong <= plain.wrong + 1, "{found:?}");
        assert!(found.poses <= found.given - found.wrong && found.mean_approaches > plain.mean_approaches);
        assert_eq!(found.poses == 0, millimeters < 1.0, "{found:?}");
    }
}

#[test]
fn an_object_that_the_model_does_not_know_is_called_unknown() {
    let mut objects = objects().to_vec();
    let known = stands(&objects);
    let terms = Terms { unknown: true, ..terms(80) };
    let calibrated = calibrate(Maps::new(&MODEL).unwrap(), &known, &probe(), &terms, &()).unwrap();
    // As high as three pucks.
    let mut tower = objects[1].mesh().clone();
    tower.vertices.iter_mut().for_each(|vertex| *vertex = [vertex[0] * 0.7, vertex[1] * 0.7, vertex[2] * 5.0]);
    objects.push(sized("tower", tower));
    let all = stands(&objects);
    let found =
        evaluate(Maps::new(&calibrated.model).unwrap(), &all, &probe(), &Terms { seed: 9, ..terms }, &()).unwrap();
    let unknown: Vec<usize> = found.objects.iter().map(|object| object.unknown).collect();
    assert!(unknown[2] > 20 && unknown[0] + unknown[1] <= 6, "{found:?}");
}

#[test]
fn touches_without_a_position_and_other_units_are_refused() {
    let world = World { standing: &STANDING, probe: &probe(), real: Real::default(), range: 28.0, seed: 3 };
    let touch = world.draw(0).press(Approach::default());
    let bare = Touch::new(touch.times()).with_pose(touch.pose().unwrap());
    let object = ObjectTouches::new("bar", vec![touch, bare], Source::Object);
    let origin = Origin { probe: probe(), unit: Length::Millimeter, ..Origin::default() };
    let mut dataset = Dataset { origin: Some(origin), ..Dataset::new(vec![object]) };
    let error = learn(&dataset, &CastSettings::default()).unwrap_err().to_string();
    assert!(error.contains("bar: touch 2 has no position"), "{error}");
    dataset.origin = None;
    let error = learn(&dataset, &CastSettings::default()).unwrap_err().to_string();
    assert!(error.contains("true size"), "{error}");
}

#[test]
fn maps_of_no_object_and_of_one_without_a_surface_are_refused_by_name() {
    let settings = CastSettings::default();
    let error = write(&[], &[], &probe(), &settings).unwrap_err().to_string();
    assert!(error.contains("no objects"), "{error}");
    let surfaces = cast(&STANDING, &probe(), &settings).unwrap();
    let names = ["bar", "puck", "cup"].map(String::from);
    let error = write(&surfaces, &names, &probe(), &settings).unwrap_err().to_string();
    assert!(error.contains("cup: no touch met it"), "{error}");
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let settings = CastSettings::default();
    for (wrong, name) in [
        (with!(settings.clone(), range = 200.0), "range"),
        (with!(settings.clone(), noise = f64::NAN), "noise"),
        (with!(settings.clone(), lost = 0.0), "lost"),
        (with!(settings.clone(), max_touches = 33), "max_touches"),
    ] {
        let error = wrong.check().unwrap_err().to_string();
        assert!(error.starts_with(name), "{error}");
    }
}

/// A solid of revolution about z of this many sides: radii at heights, from below, in millimeters.
fn turned(name: &str, sides: u32, profile: &[[f32; 2]]) -> Object {
    let ring = |&[radius, height]: &[f32; 2]| {
        (0..sides).map(move |side| {
            let (sin, cos) = (std::f32::consts::TAU * side as f32 / sides as f32).sin_cos();
            [radius * cos, radius * sin, height]
        })
    };
    let ends = [profile[0], profile[profile.len() - 1]].map(|[_, height]| [0.0, 0.0, height]);
    let vertices: Vec<[f32; 3]> = profile.iter().flat_map(ring).chain(ends).collect();
    let (rings, first) = (profile.len() as u32, vertices.len() as u32 - 2);
    let mut triangles = Vec::new();
    for side in 0..sides {
        let next = (side + 1) % sides;
        for below in (0..rings - 1).map(|ring| ring * sides) {
            let above = below + sides;
            triangles.extend([[below + side, below + next, above + next], [below + side, above + next, above + side]]);
        }
        let top = (rings - 1) * sides;
        triangles.extend([[next, side, first], [top + side, top + next, first + 1]]);
    }
    sized(name, Mesh { vertices, triangles })
}

#[test]
fn poses_on_many_facets_have_one_map_and_none_is_lost_since_each_is_rare() {
    let barrel = turned("barrel", 64, &[[24.0, 0.0], [30.0, 25.0], [30.0, 55.0], [24.0, 80.0]]);
    let bottle = turned("bottle", 64, &[[30.0, 0.0], [30.0, 55.0], [11.0, 75.0], [11.0, 100.0]]);
    for object in [barrel, bottle] {
        let standing = stands(std::slice::from_ref(&object));
        let lying: Vec<f64> =
            standing[0].placements.iter().map(|lying| lying.share).filter(|share| *share < 0.03).collect();
        assert!(lying.len() >= 64 && lying[..64].iter().all(|share| *share > 0.009), "{lying:?}");
        let looks: Vec<(&str, f64)> = standing[0].looks().map(|(lying, share)| (lying.name.as_str(), share)).collect();
        assert!((2..=3).contains(&looks.len()) && looks[0].1 > 0.6, "{} {looks:?}", object.name);
        assert!((looks.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-9);
        let of_trees = palpate::mesh::placements::placements(object.mesh()).unwrap().placements;
        assert_eq!(looks[0].0, of_trees[0].name);
        let maps = cast(&standing, &probe(), &CastSettings::default()).unwrap();
        assert_eq!(maps.len(), looks.len());
        // What is played is each facet as it is, and it is found.
        let names = names(&standing);
        let bytes = write(&maps, &names, &probe(), &CastSettings::default()).unwrap();
        let until = Some(Until { millimeters: 6.0, degrees: 10.0 });
        let found =
            evaluate(Maps::new(&bytes).unwrap(), &standing, &probe(), &Terms { until, ..terms(20) }, &()).unwrap();
        assert!(found.wrong == 0 && found.poses_within + 2 >= found.poses && found.poses >= 15, "{found:?}");
    }
}

#[test]
fn poses_are_one_where_their_surfaces_agree_to_the_noise_that_is_stated() {
    // Two ends that differ by a few millimeters of their rim.
    let spool = turned("spool", 48, &[[26.0, 0.0], [26.0, 12.0], [27.5, 24.0]]);
    let count = |noise| standing(&[&spool], &probe(), noise, &()).unwrap()[0].looks().count();
    assert!(count(0.1) > count(3.0), "{} {}", count(0.1), count(3.0));
    // Whatever is stated, what differs by less than .2 mm is one.
    let cylinder = turned("cylinder", 48, &[[26.0, 0.0], [26.02, 24.0]]);
    assert_eq!(standing(&[&cylinder], &probe(), 0.01, &()).unwrap()[0].looks().count(), 2);
}

#[test]
fn a_symmetric_object_without_a_middle_of_its_box_lies_in_one_way() {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0_f32]];
    let vertices = corners.map(|corner| corner.map(|axis| 30.0 * axis)).to_vec();
    let object = sized("tetrahedron", Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] });
    let standing = stands(&[object]);
    assert_eq!((standing[0].placements.len(), standing[0].looks().count()), (4, 1));
}

#[test]
fn maps_of_meshes_are_the_same_on_any_number_of_threads() {
    let maps = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| cast(&stands(&objects()), &probe(), &CastSettings::default()).unwrap())
    };
    let [one, four] = [1, 4].map(|threads| format!("{:?}", maps(threads)));
    assert!(one == four);
}

#[test]
fn a_map_has_what_a_fingertip_meets_in_the_middle_of_each_cell() {
    let disc = turned("disc", 90, &[[20.0, 0.0], [20.0, 10.0]]);
    let standing = stands(&[disc]);
    let maps = cast(&standing, &probe(), &CastSettings::default()).unwrap();
    let flat = maps.iter().find(|surface| surface.is_round).unwrap();
    let height = |i: i32, j: i32| {
        let [x, y] = flat.half;
        flat.heights[((j + y) * (2 * x + 1) + i + x) as usize]
    };
    assert!((height(0, 0) - 10.0).abs() < 1e-6 && (height(13, 13) - 10.0).abs() < 1e-6);
    // The ball's side is at the rim 1 mm beside it.
    assert!((height(21, 0) - (10.0 - 1.5 + 1.25_f64.sqrt())).abs() < 0.05, "{}", height(21, 0));
    assert_eq!((height(22, 0), flat.known), (0.0, 1.0));
}

#[test]
fn an_object_that_is_too_large_or_too_flat_for_a_map_is_named() {
    for (half, expected) in [([600.0, 600.0, 50.0], "slab: it is too large for a map"), ([40.0, 30.0, 0.1], "slab: ")] {
        let mut mesh = Mesh::globe(4);
        mesh.vertices.iter_mut().for_each(|vertex| *vertex = [0, 1, 2].map(|axis| half[axis] * vertex[axis]));
        let standing = stands(&[sized("slab", mesh)]);
        let error = cast(&standing, &probe(), &CastSettings::default()).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn all_poses_of_a_mouse_on_its_back_have_a_map() {
    let Some(mesh) = std::env::var_os("PALPATE_SHARED").map(|shared| Path::new(&shared).join("objects/mouse.obj"))
    else {
        eprintln!("skipped: PALPATE_SHARED is not set");
        return;
    };
    if !mesh.exists() {
        eprintln!("skipped: {} is not there", mesh.display());
        return;
    }
    let mut mouse = palpate::mesh::source::object(mesh.to_str().unwrap()).unwrap();
    mouse.millimeters = Some(1.0);
    let longest = mouse.true_length(mouse.first()).unwrap();
    mouse.millimeters = Some(100.0 / longest);
    let standing = stands(&[mouse]);
    let back: Vec<(&str, f64)> = standing[0]
        .looks()
        .filter(|(lying, _)| lying.name.starts_with("-y"))
        .map(|(lying, share)| (lying.name.as_str(), share))
        .collect();
    assert_eq!(back.len(), 4, "{back:?}");
    assert!(back.iter().all(|(_, share)| *share > 0.08), "{back:?}");
    let maps = cast(&standing, &probe(), &CastSettings::default()).unwrap();
    let has_map = |name: &str| maps.iter().any(|surface| surface.placement == name);
    assert!(back.iter().all(|(name, _)| has_map(name)));
}
