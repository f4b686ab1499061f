//! A simulator of imperfect probes that shares no code with the fit, and the parameters fitted to its touches.

use super::words::Estimate;
use super::*;

use crate::mesh::builtin;
use crate::probe::approach::{FINGERS, Probe};
use crate::probe::noise::Grazing;
use crate::touches::{ObjectTouches, Recorded, Source, Surroundings};
use crate::with;
use palpate_shared::ContactTime;
use std::sync::LazyLock;

/// Faults of a probe. Times are in milliseconds.
#[derive(Clone, Copy)]
struct Crooked {
    /// Times are this many times as long.
    longer: f64,
    late: [f64; 3],
    noise: f64,
    missed: [f64; 3],
    /// Ticks of the timer.
    tick: f64,
}

const STRAIGHT: Crooked = Crooked { longer: 1.0, late: [0.0; 3], noise: 0.0, missed: [0.0; 3], tick: 1.0 };
const BENT: Crooked =
    Crooked { longer: 0.92, late: [0.0, 3.0, -4.0], noise: 3.0, missed: [0.01, 0.03, 0.0], ..STRAIGHT };

impl Fit {
    /// The likeliest values of the noise that the real probe adds to touches.
    fn real(&self) -> Noise {
        let [middle, third] = self.late.map(|late| -1e3 * late.value);
        with!(
            Noise::default(),
            deviation = (1e3 * self.noise.value).into(),
            timer = 1e3 * self.timer.unwrap_or(0.0),
            missed = self.missed.map_or([0.0; FINGERS], |missed| missed.map(|share| share.value)),
            bent = [0.0, middle, third],
            speed = self.speed_factor.value,
            grazing = self.grazing.map_or_else(Grazing::default, |GrazingEstimate { angle, bend }| Grazing {
                angle: angle.value,
                bend: 1e3 * bend.value,
            })
        )
    }
}

impl Estimate {
    /// True if the interval holds a value.
    fn holds(&self, value: f64) -> bool {
        self.low.is_none_or(|low| low <= value) && self.high.is_none_or(|high| value <= high)
    }
}

/// A generator of its own: that of Numerical Recipes, and sums of twelve uniform numbers for normal ones.
struct Numbers(u64);

impl Numbers {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A touch as the imperfect probe records it, from times in milliseconds.
fn record(times: [Option<f64>; 3], probe: &Crooked, numbers: &mut Numbers) -> Touch {
    let mut ticks = [None; 3];
    let phase = numbers.uniform();
    for finger in 0..3 {
        let (chance, normal) = (numbers.uniform(), numbers.normal());
        if let Some(time) = times[finger].filter(|_| chance >= probe.missed[finger]) {
            let seen = time * probe.longer + probe.late[finger] + probe.noise * normal + 1e3;
            ticks[finger] = Some((seen / probe.tick + phase).floor() * probe.tick * 1e3);
        }
    }
    Touch::new(ticks.map(|tick| tick.map_or(ContactTime::MISSING, |tick| ContactTime::from_micros(tick as u32))))
}

/// The objects that were recorded, made only once.
static OBJECTS: LazyLock<[Object; 3]> =
    LazyLock::new(|| ["bowl", "mouse", "wristwatch"].map(|name| builtin::one(name).unwrap()));

fn objects() -> Vec<Object> {
    OBJECTS.to_vec()
}

/// Approaches to an object, by a probe with deviations.
fn approaches(object: &Object, count: usize, seed: u64, probe: &Crooked) -> Vec<Touch> {
    approaches_of(object, count, seed, probe, Noise::default())
}

/// Like [`approaches`], with fingers that bend.
fn approaches_of(object: &Object, count: usize, seed: u64, probe: &Crooked, real: Noise) -> Vec<Touch> {
    let origin = Origin { approaches: true, seed: 1_000 + seed, real, ..Origin::default() };
    let scenes = capture::scenes(&[object], &origin, &()).unwrap();
    let touches = capture::touches(&scenes[0], &object.name, &origin, 0..count as u64).unwrap();
    let mut numbers = Numbers(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ object.name.len() as u64);
    let times = |touch: &Touch| touch.times().map(|time| time.micros().map(|micros| f64::from(micros) / 1e3));
    touches.touches().iter().map(|touch| record(times(touch), probe, &mut numbers)).collect()
}

fn recorded(objects: &[Object], count: usize, seed: u64, probe: &Crooked) -> Dataset {
    let one =
        |object: &Object| ObjectTouches::new(&object.name, approaches(object, count, seed, probe), Source::Object);
    Dataset::new(objects.iter().map(one).collect())
}

/// Presses on a plate that is not quite square to the motion, with half a turn after each.
fn plate(count: usize, probe: &Crooked) -> Vec<Touch> {
    let mut numbers = Numbers(7);
    let press = |index: usize| {
        let slope = if index.is_multiple_of(2) { 2.5 } else { -2.5 };
        record([Some(10.0 - slope), Some(10.0), Some(10.0 + slope)], probe, &mut numbers)
    };
    (0..count).map(press).collect()
}

fn settings() -> FitSettings {
    FitSettings { approaches: 20_000, ..FitSettings::default() }
}

/// Touches of rigid fingers, made once for all fits to them, and their densities where no stroke ends them.
static SIMULATED: LazyLock<(Simulated, Vec<Densities>)> = LazyLock::new(|| {
    let (objects, settings) = (objects(), settings());
    let scenes = scenes(&objects, &settings, &()).unwrap();
    let touched = touched::touched(&objects, scenes, &Dataset::default());
    let simulated = Simulated::new(touched, Layer::default(), &settings, &()).unwrap();
    let densities = simulated.densities(Stroke::default());
    (simulated, densities)
});
/// Touches of the bent probe, and presses on a plate.
static RECORDED: LazyLock<Dataset> = LazyLock::new(|| recorded(&objects(), 400, 1, &BENT));
static PLATE: LazyLock<Vec<Touch>> = LazyLock::new(|| plate(60, &BENT));
/// The bent probe, found from these.
static FOUND: LazyLock<Fit> = LazyLock::new(|| fitted(&RECORDED, Some(&PLATE)));

/// The fit of a probe whose fingers are known to be rigid, and whose objects to stay.
fn fitted(recorded: &Dataset, plate: Option<&[Touch]>) -> Fit {
    let ((simulated, endless), settings) = (&*SIMULATED, settings());
    let own = |own: &ObjectTouches| {
        let object = place(&own.name, simulated.touches.iter().map(|own| own.name.as_str())).unwrap();
        simulated.touches[object].touches()
    };
    let touches: Vec<&[Touch]> = recorded.objects.iter().map(own).collect();
    let stroke = stroke::stroke(recorded, &touches, kept(recorded), &settings.origin.probe).unwrap();
    let ended = stroke.window.map(|_| simulated.densities(stroke));
    fit_to(simulated, ended.as_ref().unwrap_or(endless), stroke, recorded, plate, &settings, &()).unwrap()
}

/// The fit of an unknown probe.
fn layered(recorded: &Dataset, plate: Option<&[Touch]>) -> Fit {
    fit(recorded, &objects(), plate, &FitSettings { approaches: 12_000, ..settings() }, &()).unwrap()
}

/// Asserts that the values are near the probe's, and within the intervals except for an error of the simulation.
fn near(fit: &Fit, probe: &Crooked, [factor, offset, noise]: [f64; 3]) {
    let told = format!("{:?} {:?} {:?} {:?}", fit.speed_factor, fit.late, fit.noise, fit.missed);
    assert!((fit.speed_factor.value * probe.longer - 1.0).abs() < factor, "{told}");
    for (late, finger) in fit.late.iter().zip([1, 2]) {
        assert!((late.value - probe.late[finger] + probe.late[0]).abs() < offset, "finger {finger}: {told}");
    }
    assert!((fit.noise.value / probe.noise.max(0.3)).ln().abs() < noise, "{told}");
    for (missed, share) in fit.missed.iter().flatten().zip(probe.missed) {
        assert!((missed.value - share).abs() < 0.03, "{told}");
    }
}

#[test]
fn a_crooked_probe_is_found_from_touches_and_a_plate() {
    let found = &*FOUND;
    near(found, &BENT, [0.04, 1.2, 0.5]);
    assert_eq!((found.timer, found.presses, found.recorded), (Some(1.0), 60, 1_200));
    assert!(found.speed_factor.holds(1.0 / BENT.longer) && !found.speed_factor.holds(1.0), "{:?}", found.speed_factor);
    assert!(!found.late[0].holds(0.0) && !found.late[1].holds(0.0), "{:?}", found.late);
    assert!(found.late.iter().all(|late| late.width().unwrap() < 3.0), "{:?}", found.late);
}

#[test]
fn a_plate_that_repeats_better_or_worse_than_touches_tells_offsets_and_leaves_their_noise_alone() {
    let touches = recorded(&objects(), 400, 20, &BENT);
    for (noise, width) in [(0.1, 1.0), (6.0, 8.0)] {
        let pressed = Crooked { noise, missed: [0.0, 0.2, 0.0], ..BENT };
        let found = fitted(&touches, Some(&plate(60, &pressed)));
        near(&found, &BENT, [0.04, 0.2 + 0.4 * noise, 0.5]);
        assert!(found.late.iter().all(|late| late.width().unwrap() < width), "{:?}", found.late);
    }
}

#[test]
fn fingers_that_bend_aside_are_found_and_rigid_ones_are_not_said_to_bend() {
    let grazing = Grazing { angle: 20.0, bend: 10_000.0 };
    let real = with!(Noise::default(), grazing);
    let one =
        |object: &Object| ObjectTouches::new(&object.name, approaches_of(object, 300, 21, &BENT, real), Source::Object);
    let soft = Dataset::new(objects().iter().map(one).collect());
    let found = layered(&soft, Some(&PLATE));
    // Noise and bend are hardly told apart: the one makes up for the other.
    near(&found, &BENT, [0.05, 1.5, 1.2]);
    assert!(found.speed_factor.holds(1.0 / BENT.longer), "{:?}", found.speed_factor);
    assert!(found.late[0].holds(3.0) && found.late[1].holds(-4.0), "{:?}", found.late);
    let GrazingEstimate { bend, .. } = found.grazing.expect("fingers that bend");
    assert!((4.0..25.0).contains(&bend.value), "{bend:?}");
    let file = crate::probe::file::ProbeFile::parse(&found.toml(), "probe.toml".as_ref()).unwrap();
    assert!((file.real.grazing.bend / found.real().grazing.bend - 1.0).abs() < 1e-2, "{:?}", file.real);
    let rigid = layered(&recorded(&objects(), 200, 21, &BENT), Some(&PLATE));
    assert_eq!(rigid.grazing, None);
}

#[test]
fn without_a_plate_curvature_is_told_and_the_slope_hardly() {
    let found = fitted(&recorded(&objects(), 400, 2, &BENT), None);
    near(&found, &BENT, [0.05, 12.0, 0.5]);
    // κ is what the trees use: late by −2 × the middle finger's and the third one's.
    let curvature = found.late[1].value - 2.0 * found.late[0].value;
    assert!((curvature - (-4.0 - 2.0 * 3.0)).abs() < 2.5, "{curvature}");
    let asked = found.warnings.iter().find(|warning| warning.what.contains("offset")).expect("a warning");
    assert!(asked.record.contains("flat plate"), "{asked}");
}

/// Touches of the bent probe with their poses.
fn posed() -> Dataset {
    let mut posed = recorded(&objects(), 250, 2, &BENT);
    let origin = Origin { approaches: true, seed: 1_002, ..Origin::default() };
    for (own, object) in posed.objects.iter_mut().zip(&objects()) {
        let scenes = capture::scenes(&[object], &origin, &()).unwrap();
        let poses = capture::touches(&scenes[0], &object.name, &origin, 0..250).unwrap();
        let with = |(touch, posed): (&Touch, &Touch)| touch.with_pose(posed.pose().unwrap());
        own.edit(|touches| *touches = touches.iter().zip(poses.touches()).map(with).collect());
    }
    posed
}

#[test]
fn recorded_poses_tell_the_slope_as_well() {
    let plain = fitted(&recorded(&objects(), 250, 2, &BENT), None);
    let found = fitted(&posed(), None);
    near(&found, &BENT, [0.06, 3.0, 0.5]);
    let width = |fit: &Fit| fit.late[1].width().unwrap();
    assert!(width(&found) < 0.6 * width(&plain), "{:?} {:?}", found.late, plain.late);
}

#[test]
fn a_slow_arm_and_a_bent_outer_finger_are_told_apart() {
    let slow = Crooked { longer: 1.13, noise: 2.0, ..STRAIGHT };
    let bent = Crooked { late: [0.0, 0.0, -7.0], noise: 2.0, ..STRAIGHT };
    // A first finger that is bent is the other two bent the other way.
    let first = Crooked { late: [5.0, 0.0, 0.0], noise: 2.0, ..STRAIGHT };
    for (seed, probe) in (3..).zip([slow, bent, first]) {
        let found = fitted(&recorded(&objects(), 400, seed, &probe), Some(&plate(60, &probe)));
        // Gaps between simulated touches count as noise, which is estimated at up to 4.5 ms where it is 2.
        near(&found, &probe, [0.04, 1.2, 1.0]);
    }
}

#[test]
fn what_each_finger_misses_is_told_apart() {
    let chatter = Crooked { noise: 1.5, missed: [0.0, 0.12, 0.05], ..STRAIGHT };
    let found = fitted(&recorded(&objects(), 600, 6, &chatter), None);
    let missed = found.missed.unwrap();
    assert!(missed[0].value < 0.03 && (missed[1].value - 0.12).abs() < 0.03, "{missed:?}");
    assert!((missed[2].value - 0.05).abs() < 0.03, "{missed:?}");
}

#[test]
fn a_coarse_timer_is_found_and_hides_noise() {
    let coarse = Crooked { noise: 1.0, tick: 10.0, ..STRAIGHT };
    let found = fitted(&recorded(&objects(), 400, 7, &coarse), None);
    assert_eq!(found.timer, Some(10.0));
    assert!(found.noise.value < 4.0, "{:?}", found.noise);
    let fine = Crooked { noise: 2.0, tick: 0.001, ..STRAIGHT };
    assert_eq!(fitted(&recorded(&objects(), 300, 8, &fine), None).timer, None);
}

#[test]
fn one_object_is_enough_for_a_fit_with_wider_intervals() {
    let all = objects();
    let found = fitted(&recorded(&all[..1], 400, 9, &BENT), Some(&PLATE));
    near(&found, &BENT, [0.08, 1.5, 0.4]);
}

#[test]
fn full_touches_alone_do_not_tell_what_is_missed() {
    let mut full = recorded(&objects(), 900, 10, &BENT);
    full.objects.iter_mut().for_each(|object| *object = object.filtered(Touch::is_full));
    let found = fitted(&full, None);
    assert_eq!(found.missed, None);
    assert!(
        found.warnings.iter().any(|warning| warning.record.contains("Record every approach")),
        "{:?}",
        found.warnings
    );
    assert!((found.speed_factor.value * BENT.longer - 1.0).abs() < 0.06, "{:?}", found.speed_factor);
    assert_eq!(found.real().missed, [0.0; 3]);
}

#[test]
fn approaches_that_touched_nothing_need_not_be_recorded() {
    let mut contacts = recorded(&objects(), 500, 11, &BENT);
    contacts.objects.iter_mut().for_each(|object| *object = object.filtered(|touch| !touch.is_empty()));
    near(&fitted(&contacts, Some(&PLATE)), &BENT, [0.05, 1.2, 0.5]);
}

#[test]
fn a_few_touches_give_warnings_and_too_few_an_error() {
    let found = fitted(&recorded(&objects(), 25, 12, &BENT), None);
    assert!(found.warnings.len() >= 3, "{:?}", found.warnings);
    assert!(found.warnings.iter().any(|warning| warning.record.contains("approaches")), "{:?}", found.warnings);
    let few = recorded(&objects()[..1], 12, 12, &BENT);
    let error = fit(&few, &objects(), None, &settings(), &()).unwrap_err();
    assert!(error.to_string().starts_with("only 11 recorded touches with two or three contacts"), "{error}");
}

#[test]
fn a_recorded_object_without_a_mesh_is_named() {
    let error = fit(&recorded(&objects(), 30, 13, &BENT), &objects()[..2], None, &settings(), &()).unwrap_err();
    assert!(
        error.to_string().contains("wristwatch was recorded, but is not among the objects: bowl, mouse"),
        "{error}"
    );
}

#[test]
fn a_fit_is_the_same_on_any_number_of_threads_and_read_back_as_written() {
    let (recorded, plate) = (recorded(&objects()[..2], 80, 19, &BENT), plate(30, &BENT));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| layered(&recorded, Some(&plate)))
    };
    let found = with(1);
    assert_eq!(found, with(3));
    {
        let file = crate::probe::file::ProbeFile::parse(&found.toml(), "probe.toml".as_ref()).unwrap();
        let (written, real) = (file.real, found.real());
        assert_eq!(file.probe, found.probe);
        assert!(
            (written.speed - real.speed).abs() < 1e-4 && (written.deviation.least - real.deviation.least).abs() < 1.0
        );
        for finger in 0..3 {
            assert!((written.bent[finger] - real.bent[finger]).abs() < 2.0, "{written:?} {real:?}");
            assert!((written.missed[finger] - real.missed[finger]).abs() < 1e-4, "{written:?} {real:?}");
        }
        assert_eq!(written.timer, real.timer);
    }
}

/// Touches of a hand that stops this many milliseconds after the first contact.
fn stopped(recorded: &Dataset, after: u32) -> Dataset {
    recorded.each(|own| own.changed(|touch| crate::probe::hand::within(touch, Some(1_000 * after))))
}

#[test]
fn a_stroke_is_found_and_contacts_later_than_it_bend_no_estimate() {
    let short = stopped(&RECORDED, 250);
    let found = fitted(&short, Some(&PLATE));
    assert_eq!((FOUND.stroke, FOUND.probe.stroke), (None, None), "no stroke where contacts come as late as they can");
    let stroke = found.stroke.unwrap();
    assert!(stroke.holds(2.5) && (stroke.value - 2.5).abs() < 0.1 && stroke.low.unwrap() > 2.3, "{stroke:?}");
    assert!((found.speed_factor.value * BENT.longer - 1.0).abs() < 0.05, "{:?}", found.speed_factor);
    for (late, expected) in found.late.iter().zip([3.0, -4.0]) {
        assert!((late.value - expected).abs() < 1.5, "{:?}", found.late);
    }
    // Each finger lost tens of contacts to the stroke, and these do not count as missed.
    for (missed, share) in found.missed.iter().flatten().zip(BENT.missed) {
        assert!((missed.value - share).abs() < 0.05, "{:?}", found.missed);
    }
    let lost = |finger: usize| {
        let missing = |dataset: &Dataset| dataset.touches().filter(|touch| touch.times()[finger].is_missing()).count();
        missing(&short) - missing(&RECORDED)
    };
    assert!((0..3).all(|finger| lost(finger) > 50), "{:?}", [lost(0), lost(1), lost(2)]);
    let text = found.toml();
    assert!(text.contains("stroke = 2.") && text.contains("no recorded contact is later"), "{text}");
    let file = crate::probe::file::ProbeFile::parse(&text, "probe.toml".as_ref()).unwrap();
    assert_eq!(file.probe.stroke, found.probe.stroke);
}

#[test]
fn a_stated_stroke_is_kept_and_recordings_of_another_are_refused_with_both() {
    let short = stopped(&RECORDED, 300);
    let stating = |stroke: f64| {
        let probe = with!(Probe::default(), stroke = Some(stroke));
        let origin = Origin { probe, ..Origin::default() };
        fit(&short, &objects(), None, &FitSettings { origin, approaches: 4_000, ..settings() }, &())
    };
    let found = stating(3.0).unwrap();
    assert_eq!((found.stroke, found.probe.stroke), (None, Some(3.0)));
    assert!((found.speed_factor.value * BENT.longer - 1.0).abs() < 0.06, "{:?}", found.speed_factor);
    assert!(found.toml().contains("\nstroke = 3.0\n"), "{}", found.toml());
    for (stroke, parts) in [
        (2.0, ["a stroke of 2 (0.200 s)", "s after the first"]),
        (6.0, ["a stroke of 6 (0.600 s)", "no contact is later than 0."]),
    ] {
        let error = stating(stroke).unwrap_err();
        assert!(parts.iter().all(|part| error.to_string().contains(part)), "{error}");
    }
}

#[test]
fn full_touches_and_poses_of_a_short_stroke_are_fitted_as_well() {
    near(&fitted(&stopped(&posed(), 250), None), &BENT, [0.06, 3.0, 0.5]);
    let mut full = stopped(&recorded(&objects(), 900, 10, &BENT), 250);
    full.objects.iter_mut().for_each(|object| *object = object.filtered(Touch::is_full));
    let found = fitted(&full, None);
    assert!((found.speed_factor.value * BENT.longer - 1.0).abs() < 0.06, "{:?}", found.speed_factor);
    assert!(found.stroke.unwrap().holds(2.5), "{:?}", found.stroke);
}

/// Approaches from above to two objects on a table, in a recording of each placement that states it, or in one of each object
/// that states none.
fn tabled(count: usize, seed: u64, probe: &Crooked, is_stated: bool) -> (Dataset, FitSettings) {
    let scene = Surroundings::Table { cone: 60.0 };
    let settings = FitSettings { origin: Origin { scene, ..Origin::default() }, approaches: 12_000, ..settings() };
    let origin = Origin { approaches: true, seed: 1_000 + seed, ..settings.origin.clone() };
    let one = |object: &Object| {
        let scenes = capture::scenes(&[object], &origin, &()).unwrap();
        let touched = capture::touches(&scenes[0], &object.name, &origin, 0..count as u64).unwrap();
        let touched = if is_stated { touched } else { touched.as_often_as_placed() };
        let mut numbers = Numbers(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ object.name.len() as u64);
        let mut recorded = |touch: &Touch| {
            let times = touch.times().map(|time| time.micros().map(|micros| f64::from(micros) / 1e3));
            record(times, probe, &mut numbers)
        };
        let parts = touched.pools().iter().enumerate().map(|(source, pool)| {
            let placement = pool.source.placement().filter(|_| is_stated).map(str::to_owned);
            let recording = Recorded { placement, began: source.to_string(), ..Recorded::default() };
            let touches = touched.of_pool(pool).iter().map(&mut recorded).collect();
            (Source::Recording(recording), None, touches)
        });
        ObjectTouches::of_parts(&object.name, parts.collect::<Vec<_>>())
    };
    (Dataset::new(objects()[..2].iter().map(one).collect()), settings)
}

#[test]
fn a_probe_is_fitted_to_objects_that_stand_on_a_table() {
    for is_stated in [true, false] {
        let (recorded, settings) = tabled(450, 11, &BENT, is_stated);
        let found = fit(&recorded, &objects(), Some(&PLATE), &settings, &()).unwrap();
        near(&found, &BENT, [0.06, 2.0, 0.8]);
        assert!(found.objects.iter().all(|name| name.contains('/') == is_stated), "{:?}", found.objects);
        assert!(found.toml().contains(" on a table and 60 presses on a plate.\n"), "{}", found.toml());
    }
}

#[test]
fn a_recording_in_an_unknown_placement_is_refused() {
    let (recorded, settings) = tabled(60, 12, &BENT, true);
    let lying = Recorded { placement: Some("+q".into()), ..Recorded::default() };
    let unknown = ObjectTouches::new("bowl", recorded.objects[0].touches().to_vec(), Source::Recording(lying));
    let error = fit(&Dataset::new(vec![unknown]), &objects(), None, &settings, &()).unwrap_err();
    assert!(error.to_string().contains("bowl/+q was recorded, but is not among the objects: bowl/"), "{error}");
}

#[test]
fn the_file_of_an_estimated_stroke_states_how_far_contacts_may_be_behind_it() {
    let found = fitted(&stopped(&RECORDED, 250), None);
    let stroke = found.stroke.unwrap();
    let file = crate::probe::file::ProbeFile::parse(&found.toml(), "probe.toml".as_ref()).unwrap();
    let latest = file.probe.latest().unwrap() / 1e6 * file.probe.speed;
    // The end of the interval, and the ripple of the speed beyond it.
    let end = stroke.high.unwrap();
    assert!((latest / end - 1.0 - crate::probe::hand::TOLERANCE).abs() < 1e-3, "{latest} {end}");
    // A later recording of the same hand, whose clock runs 1.5 % slow, is fitted with the file as well, and its late contacts are none.
    let later = stopped(&recorded(&objects(), 200, 7, &BENT), 253);
    let origin = Origin { probe: file.probe, ..Origin::default() };
    let again = fit(&later, &objects(), None, &FitSettings { origin, approaches: 4_000, ..settings() }, &()).unwrap();
    assert_eq!((again.stroke, again.probe), (None, file.probe));
}
