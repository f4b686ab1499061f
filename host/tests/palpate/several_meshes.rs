//! Statements about objects with several very different meshes agree with fresh touches: every call that states a
//! figure or a promise, on the same three objects.
//!
//! A sequence is of one mesh. Sequences of touches of several would agree with each other, and with nothing that a robot
//! meets: an object would be known from the mean of its meshes.

use crate::fixtures::*;
use crate::shares::{Share, cases};
use crate::synthetic;
use palpate::calibrate::{self};
use palpate::compile::{self, compile};
use palpate::ensemble::train::{self, train};
use palpate::error::Result;
use palpate::evaluate::{self, Evaluation, Sequential};
use palpate::touches::folds;
use palpate::{strangers, teach};

/// The instances of each object: none is like the others of its object, and some are nearer to another object's.
const KINDS: [&[usize]; 3] = [&[5, 8], &[28, 39], &[15, 24]];
/// Touches that are evidence after which sequences end.
const MOST: u32 = 100;
/// The rate that is promised of all names, and a larger one: of the names given to each object, and beside a test for
/// strangers.
const RATE: f64 = 0.05;
const LARGER_RATE: f64 = 0.1;

/// Touches of the objects, of their instances in turn.
fn touches(count: usize, seed: u64) -> Dataset {
    let object = |(index, kinds): (usize, &&[usize])| {
        let name = format!("object{index}");
        let mut random = generator(seed, Purpose::Synthetic, &name, 1);
        let touches = (0..count).map(|turn| synthetic::touch(kinds[turn % kinds.len()], &mut random)).collect();
        let names: Vec<String> = kinds.iter().map(|kind| format!("kind {kind}")).collect();
        ObjectTouches::in_turn(name, touches, &names, 0)
    };
    Dataset::new(KINDS.iter().enumerate().map(object).collect())
}

/// Touches as if all of an object were of one mesh.
fn forgotten(dataset: &Dataset) -> Dataset {
    dataset.each(|object| ObjectTouches::new(&object.name, object.touches().to_vec(), Source::Object))
}

fn recipe() -> train::Settings {
    with!(train::Settings::compact(), rounds = 20, depth = 4)
}

static ENSEMBLE: LazyLock<Ensemble> = LazyLock::new(|| train(&touches(4_000, 1), &recipe(), &()).unwrap());

static EXACT: LazyLock<CompiledModel> = LazyLock::new(|| compile::exact(&ENSEMBLE).unwrap());

static MODEL: LazyLock<CompiledModel> = LazyLock::new(|| {
    let bytes = compile(&ENSEMBLE, &compile::Settings::default()).unwrap().bytes;
    CompiledModel::from_bytes(bytes).unwrap()
});

/// Touches that nothing was trained, chosen or calibrated on.
static FRESH: LazyLock<Dataset> = LazyLock::new(|| touches(20_000, 77));

/// Results of a model on touches of `dataset`: its accuracy after ten, and wrong and unknown ends of its sequences.
fn measured(model: &Model<'_>, dataset: &Dataset) -> [Share; 3] {
    let margins = Margins::new(model, dataset).unwrap();
    let settings = with!(evaluate::Settings::default(), at = vec![10], at_approaches = vec![10]);
    figures(&evaluate::evaluate(&margins, &settings).unwrap(), dataset)
}

/// The figures that an evaluation on touches of `dataset` states.
fn figures(evaluation: &Evaluation, dataset: &Dataset) -> [Share; 3] {
    let (groups, all) = (evaluation.groups, dataset.len());
    let objects = dataset.objects.len();
    let Sequential { error, unknown, mean_touches, .. } = evaluation.sequential;
    let of = |value, length| Share::of(value, cases(groups * objects, all, length));
    [of(evaluation.accuracy[&10], 10.0), of(error, mean_touches), of(unknown, mean_touches)]
}

fn agree(what: &str, stated: [Share; 3], fresh: [Share; 3]) {
    for ((stated, fresh), figure) in stated.into_iter().zip(fresh).zip(["accuracy", "wrong names", "unknown"]) {
        stated.agrees(&format!("{what}, {figure}"), fresh);
    }
}

/// The share of wrong names among those that a calibrated model gives, of all and of the object that is mistaken most often.
fn wrong_names(model: &[u8]) -> [f64; 2] {
    static TOUCHED: LazyLock<Dataset> = LazyLock::new(|| touches(120_000, 78));
    let model = compile::open(model).unwrap();
    let mut recognizer = Recognizer::<{ KINDS.len() }>::new(&model, Stopping::from_model(&model)).unwrap();
    let mut tallies = [[0.0; 2]; KINDS.len()];
    for (object, touched) in TOUCHED.objects.iter().enumerate() {
        // As many sequences of each mesh, however long they take.
        for turn in 0..KINDS[object].len() {
            let of_mesh: Vec<&Touch> = touched.touches().iter().skip(turn).step_by(KINDS[object].len()).collect();
            for sequence in of_mesh.chunks_exact(MOST as usize) {
                recognizer.reset();
                sequence.iter().for_each(|touch| _ = recognizer.push(touch));
                if let Verdict::Recognized { object: name, .. } = recognizer.verdict() {
                    tallies[object][0] += f64::from(u8::from(usize::from(name) != object));
                    tallies[object][1] += 1.0;
                }
            }
        }
    }
    let all = tallies.iter().fold([0.0, 0.0], |[wrong, given], of| [wrong + of[0], given + of[1]]);
    let worst = tallies.iter().map(|[wrong, given]| wrong / given).fold(0.0, f64::max);
    [all[0] / all[1], worst]
}

fn promise(per: Per, seed: u64) -> calibrate::Settings {
    let max_touches = Some(MOST);
    let rate = if per == Per::Average { RATE } else { LARGER_RATE };
    with!(calibrate::Settings::default(), rate, per, sequences = 1_500, max_touches, seed)
}

fn calibrated(dataset: Dataset, per: Per, seed: u64) -> calibrate::Calibrated {
    calibrate::calibrate(&MODEL.model(), dataset, &promise(per, seed), &()).unwrap()
}

/// The promise; none where no threshold keeps the rate on these touches, which is said and breaks nothing.
fn promised<T>(calibrated: Result<T>) -> Option<T> {
    calibrated.map_err(|error| assert!(matches!(error.kind(), Kind::NotKept | Kind::TooFew), "{error}")).ok()
}

/// Promises of `calibrate` and of `calibrate --detect-unknown`, repeated: `PALPATE_REPETITIONS=40 cargo test --release -p palpate --test
/// palpate several_meshes::promises -- --nocapture` says how many were broken.
#[test]
fn promises_are_kept_where_objects_have_several_meshes() {
    let repetitions = repetitions(2);
    let (mut broken, mut refused) = ([0_u64; 4], 0);
    for seed in 0..repetitions {
        let fresh = touches(12_000, 1_000 + seed);
        let calibrated = |per| calibrate::calibrate(&MODEL.model(), fresh.clone(), &promise(per, seed), &());
        let average = promised(calibrated(Per::Average)).map(|average| wrong_names(&average.model)[0]);
        broken[0] += u64::from(average > Some(RATE));
        let each = promised(calibrated(Per::Object)).map(|each| wrong_names(&each.model)[1]);
        broken[1] += u64::from(each > Some(LARGER_RATE));
        // Of a model with the test also known objects that are taken for unknown.
        let settings = with!(strangers::Settings::default(), sequences = 1_500, seed);
        let shapes = synthetic::dataset(&[400; 30], 5).objects;
        let terms = with!(promise(Per::Average, seed), rate = LARGER_RATE);
        let (model, other) = (MODEL.model(), touches(16_000, 2_000 + seed));
        let tested = strangers::calibrate_with_promise(&model, &other, &shapes, &settings, &terms, &());
        let tested = promised(tested).map(|(tested, _)| ends(&tested.model));
        broken[2] += u64::from(tested.is_some_and(|[unknown, _]| unknown > settings.alarms));
        broken[3] += u64::from(tested.is_some_and(|[_, wrong]| wrong > LARGER_RATE));
        refused += [average.is_none(), each.is_none(), tested.is_none()].map(u64::from).iter().sum::<u64>();
        println!("{seed}: {average:?} wrong, {each:?} of the worst object; tested {tested:?} unknown and wrong");
    }
    println!("{refused} of {} calibrations refused", 3 * repetitions);
    assert!(2 * refused <= 3 * repetitions, "{refused} of {} calibrations refused", 3 * repetitions);
    let what = ["on average", "of each object", "of false alarms", "on average with the test for strangers"];
    for (what, broken) in what.into_iter().zip(broken) {
        assert_rare(what, broken, repetitions, 0.05);
    }
}

/// The share of fresh sequences that end as unknown, and that of wrong names among those given.
fn ends(model: &[u8]) -> [f64; 2] {
    let model = compile::open(model).unwrap();
    let margins = Margins::new(&model, &FRESH).unwrap();
    let settings = SequentialSettings { error_rate: None, max_touches: None, sequences: 1_000, seed: 3 };
    let Sequential { unknown, error, undecided, .. } = margins.sequential(&settings).unwrap();
    [unknown, error / (1.0 - unknown - undecided)]
}

#[test]
fn a_promise_would_be_broken_by_touches_that_forgot_their_meshes() {
    let average = calibrated(forgotten(&touches(12_000, 3)), Per::Average, 1);
    assert!(average.error <= RATE, "{}", average.error);
    let [wrong, _] = wrong_names(&average.model);
    assert!(wrong > 1.4 * RATE, "the meshes are too much alike to show anything: {wrong}");
    // And what is measured on them is not what a robot meets.
    let model = compile::open(&average.model).unwrap();
    let [mixed, ..] = measured(&model, &forgotten(&FRESH));
    let [fresh, ..] = measured(&model, &FRESH);
    assert!(mixed.0 > fresh.0 + 0.03, "{mixed:?} {fresh:?}");
}

#[test]
fn what_calibrations_count_is_what_fresh_touches_give() {
    let average = calibrated(touches(12_000, 3), Per::Average, 1);
    let [wrong, _] = wrong_names(&average.model);
    let given = (average.sequences as f64) * (1.0 - average.undecided);
    Share::of(average.error, given).agrees("calibrate, wrong names", Share::of(wrong, 2_000.0));
    let model = compile::open(&average.model).unwrap();
    let settings = with!(strangers::Settings::default(), sequences = 1_500);
    let tested = strangers::calibrate(&model, &touches(12_000, 4), &[], &settings).unwrap();
    let sequences = f64::from(tested.terms.sequences);
    let stated = Share::of(tested.alarms as f64 / sequences, sequences);
    stated.agrees("calibrate --detect-unknown, false alarms", Share::of(ends(&tested.bytes)[0], 1_000.0));
}

#[test]
fn figures_of_a_part_of_the_touches_are_those_of_fresh_ones() {
    // As evaluate, Python's calls and the report's cross-validation state them: on a part that was held out.
    let model = &EXACT.model();
    let all = touches(6_000, 5);
    let test = folds::split(&all, 0.3, 1).unwrap().test;
    let fresh = measured(model, &FRESH);
    agree("split", measured(model, &test), fresh);
    agree("fold", measured(model, &folds::fold(&all, 1, 4, 1).unwrap().test), fresh);
    // A copy on the disk is as good.
    let directory = tempfile::tempdir().unwrap();
    let origin = palpate::touches::Origin { approaches: true, ..Default::default() };
    let stated = Dataset { origin: Some(origin), ..test };
    stated.write(directory.path(), None).unwrap();
    agree("a copy", measured(model, &Dataset::read(directory.path()).unwrap()), fresh);
    // With noise too, whose robots differ.
    let noise = with!(Noise::gaussian(5_000.0), speed_bias = 0.1);
    let [mut noisy, mut other] = [stated, FRESH.clone()];
    evaluate::add_noise(&mut noisy, &noise, 1).unwrap();
    evaluate::add_noise(&mut other, &noise, 2).unwrap();
    // Each robot has a bias of its own: the cases are robots of each instance, not sequences.
    let [stated, ..] = measured(model, &noisy);
    let [measured, ..] = measured(model, &other);
    Share(stated.0, 0.04).agrees("with noise, accuracy", Share(measured.0, 0.02));
}

/// An object's figures in a group of `approaches` approaches, and on fresh touches.
fn taught_agrees(what: &str, ensemble: &Ensemble, taught: &teach::Taught) {
    let compiled = compile::exact(ensemble).unwrap();
    let model = compiled.model();
    let margins = Margins::new(&model, &FRESH).unwrap();
    let sequences = SequentialSettings { error_rate: None, max_touches: None, sequences: 1_000, seed: 9 };
    let fresh = margins.approaches(&[taught.approaches], &sequences).unwrap();
    for object in &taught.objects {
        let groups = cases(500, object.approaches, taught.approaches as f64);
        let measured = Share::of(fresh.per_object[&object.name][&taught.approaches], 1_000.0);
        Share::of(object.recognized, groups).agrees(&format!("{what}, {}", object.name), measured);
    }
}

#[test]
fn what_teaching_states_is_what_the_taught_ensemble_does() {
    let mut known = touches(4_000, 1);
    known.objects.truncate(2);
    let recorded = touches(1_200, 10);
    let settings = with!(teach::Settings::default(), approaches = 10, groups = 400);
    let ensemble = train(&known, &recipe(), &()).unwrap();
    let third = recorded.only(|name| name == "object2");
    let (extended, taught) = teach::teach(&ensemble, &known, &third, &settings, &()).unwrap();
    taught_agrees("teach", &extended, &taught);
    let training = with!(recipe(), rounds = 4);
    let (alone, taught) = teach::alone(&recorded, &training, &settings, &()).unwrap();
    taught_agrees("teach alone", &alone, &taught);
}
