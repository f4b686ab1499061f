//! Promises of a model are read back, thresholds by object decide on the chip as on the host, and priors and subsets
//! are exact.

use palpate::compile::{Leaf, Restated, RestatedSection, restate};
use palpate_onboard::{Model, ModelError, NothingExpected, Recognizer, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_shared::format::{OddsByObject, Per, Promise, PromisedNoise, Tag, Temperature, TrainedNoise};
use palpate_tests::random::{self, Shape};

const OBJECTS: usize = 4;
const ONE: u64 = 1 << 56;

fn plain() -> Vec<u8> {
    let shape = Shape { objects: OBJECTS, trees: 6, depth: 4, thresholds: 30, leaf: 0.5, ..Shape::SMALL };
    random::model(shape, 1, Leaf::I16)
}

/// Full touches, which such a model takes.
fn touches(count: usize, seed: u64) -> Vec<Touch> {
    palpate_tests::random::touches(4 * count, seed).into_iter().filter(Touch::is_full).take(count).collect()
}

fn with(plain: &[u8], sections: Vec<RestatedSection>) -> palpate::Result<Vec<u8>> {
    restate(&Model::new(plain).unwrap(), &Restated { sections, ..Restated::default() })
}

fn by_object(odds: &[u64]) -> RestatedSection {
    (Tag::ThresholdsByObject, Some((true, odds.iter().flat_map(|&odds| OddsByObject::to_bytes(odds)).collect())))
}

fn promise() -> Promise {
    Promise {
        rate: 0.005,
        confidence: 0.95,
        per: Per::Name,
        approaches: false,
        active: false,
        groups: false,
        sequences: 50_000,
        given: 49_000,
        wrong: 201,
        mean_thousandths: 24_230,
        max_touches: 200,
        noise: PromisedNoise {
            touch: TrainedNoise { timer: 1_000, ..TrainedNoise::default() },
            ..PromisedNoise::default()
        },
    }
}

#[test]
fn a_promise_and_a_temperature_are_read_back_and_change_no_margin_and_no_verdict() {
    let plain = plain();
    let sections = vec![
        (Tag::Promise, Some((false, promise().write(<[u8]>::to_vec)))),
        (Tag::Temperature, Some((false, Temperature::new(1.6).unwrap().to_bytes().to_vec()))),
    ];
    let stated = with(&plain, sections).unwrap();
    let models = [Model::new(&plain).unwrap(), Model::new(&stated).unwrap()];
    assert_eq!((models[0].promise(), models[0].temperature()), (None, Temperature::ONE));
    assert_eq!(models[1].promise(), Some(promise()));
    assert!((models[1].temperature().value() - 1.6).abs() < 1e-3);
    let mut recognizers = models.map(|model| Recognizer::<OBJECTS>::new(&model, Stopping::from_model(&model)).unwrap());
    for touch in touches(300, 1) {
        let [a, b] = recognizers.each_mut().map(|recognizer| recognizer.push(&touch).unwrap());
        assert_eq!(a, b);
        let [a, b] = recognizers.each_ref().map(|recognizer| recognizer.evidence().to_vec());
        assert_eq!(a, b);
        // The posterior is that of the evidence divided by the temperature.
        let [exact, shown] = recognizers.each_ref().map(|recognizer| recognizer.posterior(recognizer.best()).to_f64());
        assert!(shown <= exact + 1e-9, "{shown} {exact}");
        if recognizers[0].verdict() != Verdict::Undecided {
            recognizers.iter_mut().for_each(Recognizer::reset);
        }
    }
}

#[test]
fn every_object_has_its_own_threshold_and_an_error_rate_replaces_them_all() {
    let plain = plain();
    let odds = [ONE / 10, ONE / 1_000, ONE / 3, 0].map(|odds: u64| odds >> 24 << 24);
    let stated = with(&plain, vec![by_object(&odds)]).unwrap();
    let (plain, model) = (Model::new(&plain).unwrap(), Model::new(&stated).unwrap());
    assert_eq!(std::array::from_fn(|object| model.odds_of(object).unwrap()), odds);
    assert_eq!((model.odds_of(OBJECTS), plain.odds_of(0)), (None, None));
    let (own, rate) = (Stopping::from_model(&model), Stopping::new(0.01, 60).unwrap());
    assert_eq!(own.odds_of(2, &model), odds[2]);
    assert_eq!((rate.odds_of(2, &model), own.odds_of(2, &plain)), (rate.odds(), own.odds()));
    assert_eq!(own.with_max_touches(5).odds_of(1, &model), odds[1]);
    let mut seen = [0; OBJECTS];
    let mut recognizer = Recognizer::<OBJECTS>::new(&model, own.with_max_touches(40)).unwrap();
    for touch in touches(4_000, 2) {
        let verdict = recognizer.push(&touch).unwrap();
        let (best, rivals) = (recognizer.best(), recognizer.rivals());
        if rivals <= odds[best] {
            assert!(
                matches!(verdict, Verdict::Recognized { object, touches, .. }
                    if usize::from(object) == best && touches == recognizer.touches()),
                "{verdict:?}"
            );
            seen[best] += 1;
        } else {
            assert!(matches!(verdict, Verdict::Undecided | Verdict::GaveUp), "{verdict:?}");
        }
        if verdict != Verdict::Undecided {
            recognizer.reset();
        }
    }
    assert!(seen[2] > 10 && seen[3] == 0, "{seen:?}");
}

#[test]
fn thresholds_may_grow_and_damaged_statements_are_not_believed() {
    let plain = plain();
    // Grown by a later release.
    let grown = (Tag::ThresholdsByObject, Some((true, vec![1; 4 * OBJECTS + 4])));
    let grown = with(&plain, vec![grown]).unwrap();
    assert_eq!(Model::new(&grown).unwrap().odds_of(OBJECTS), None);
    let wrong =
        with(&plain, vec![(Tag::Promise, Some((false, vec![0; 48]))), (Tag::Temperature, Some((false, vec![0; 4])))]);
    let wrong = wrong.unwrap();
    let model = Model::new(&wrong).unwrap();
    assert_eq!((model.promise(), model.temperature()), (None, Temperature::ONE));
}

#[test]
fn restated_models_keep_all_other_sections_and_can_lose_what_they_got() {
    let plain = plain();
    let noise = (Tag::Noise, Some((false, vec![0; 16])));
    let first = with(&plain, vec![by_object(&[5 << 24; OBJECTS]), noise]).unwrap();
    let second = with(&first, vec![(Tag::Promise, Some((false, promise().write(<[u8]>::to_vec))))]).unwrap();
    let tags = |bytes: &[u8]| -> Vec<u16> { Model::new(bytes).unwrap().optional_sections().map(|s| s.tag).collect() };
    assert_eq!(tags(&second), [3, 5, 10]);
    let nothing = [Tag::Noise, Tag::ThresholdsByObject, Tag::Promise].map(|tag| (tag, None));
    assert_eq!(with(&second, nothing.to_vec()).unwrap(), plain);
    let restated =
        Restated { odds: Some(77), max_touches: Some(9), priors: Some(vec![-3, 0, -1, 0]), ..Restated::default() };
    let bytes = restate(&Model::new(&second).unwrap(), &restated).unwrap();
    let model = Model::new(&bytes).unwrap();
    assert_eq!((model.header().odds(), model.header().max_touches()), (77, 9));
    assert_eq!(std::array::from_fn(|object| model.prior(object)), [-3, 0, -1, 0]);
    let refused = restate(&model, &Restated { odds: Some(u64::MAX), ..Restated::default() }).unwrap_err();
    assert_eq!(refused.what(), ModelError::Field { offset: 48 }.to_string());
}

#[test]
fn weights_are_priors_and_an_object_without_one_is_never_recognized() {
    let bytes = plain();
    let model = Model::new(&bytes).unwrap();
    let mut recognizer = Recognizer::<OBJECTS>::new(&model, Stopping::new(0.05, 60).unwrap()).unwrap();
    recognizer.reset_to(&[30, 10, 0, 60]).unwrap();
    for (object, share) in [0.3, 0.1, 0.0, 0.6].into_iter().enumerate() {
        let posterior = recognizer.posterior(object).to_f64();
        assert!((posterior - share).abs() < 1e-3, "{object}: {posterior}");
    }
    let mut recognized = 0;
    for touch in touches(3_000, 3) {
        let verdict = recognizer.push(&touch).unwrap();
        assert!(recognizer.best() != 2 && recognizer.posterior(2).q56() == 0);
        if verdict != Verdict::Undecided {
            recognized += u32::from(matches!(verdict, Verdict::Recognized { .. }));
            recognizer.reset_to(&[30, 10, 0, 60]).unwrap();
        }
    }
    assert!(recognized > 20);
    // The only one that can be there is recognized at once; without a weight for them the others cannot.
    recognizer.reset_to(&[0, 7]).unwrap();
    let touch = touches(1, 3).into_iter().next().unwrap();
    let verdict = recognizer.push(&touch).unwrap();
    assert!(matches!(verdict, Verdict::Recognized { object: 1, touches: 1, .. }), "{verdict:?}");
    assert_eq!(recognizer.reset_to(&[0; OBJECTS]), Err(NothingExpected));
    assert_eq!(recognizer.reset_to(&[]), Err(NothingExpected));
    assert_eq!(recognizer.reset_to(&[0, 0, 0, 0, 9]), Err(NothingExpected));
    assert_eq!(recognizer.verdict(), verdict, "nothing changes");
    recognizer.reset();
    assert_eq!((recognizer.evidence(), recognizer.posterior(2).to_f64()), (&[][..], 0.25));
}

#[test]
fn equal_weights_are_the_priors_of_a_model_without_any() {
    let bytes = plain();
    let model = Model::new(&bytes).unwrap();
    let stopping = Stopping::from_model(&model);
    let mut told = Recognizer::<OBJECTS>::new(&model, stopping).unwrap();
    told.reset_to(&[5; OBJECTS]).unwrap();
    assert_eq!(told.evidence(), [0; OBJECTS]);
    let own = Recognizer::<OBJECTS>::new(&model, stopping).unwrap();
    assert_eq!(told.posterior(3), own.posterior(3));
}
