use crate::fixtures::*;
use crate::synthetic::{self, ENSEMBLE, MODEL};
use palpate::compile::{self, compile};
use palpate::ensemble::train;
use palpate::evaluate::{Settings, evaluate};

fn trained(dataset: &Dataset, counted: Counted) -> Ensemble {
    let settings = with!(train::Settings::compact(), rounds = 20, depth = 4, counted = Some(counted));
    train::train(dataset, &settings, &()).unwrap()
}

/// The ensemble, compiled with its own leaves.
static EXACT: LazyLock<CompiledModel> = LazyLock::new(|| compile::exact(&ENSEMBLE).unwrap());

/// A model that takes full touches only.
static OF_FULL_TOUCHES: LazyLock<CompiledModel> = LazyLock::new(|| {
    let ensemble = trained(&synthetic::dataset(&[2_000; 3], 1), Counted::Full);
    CompiledModel::from_bytes(compile(&ensemble, &compile::Settings::default()).unwrap().bytes).unwrap()
});

fn test_touches() -> Dataset {
    synthetic::dataset(&[400, 300, 500], 2)
}

fn quick() -> Settings {
    with!(Settings::default(), at = vec![1, 5, 20], groups = 200)
}

fn exact_and_rounded(check: impl Fn(&Margins<'_>)) {
    for model in [&*EXACT, &*MODEL] {
        check(&Margins::new(&model.model(), &test_touches()).unwrap());
    }
}

#[test]
fn accuracy_after_one_touch_is_what_counting_touches_gives() {
    let touches = test_touches();
    let model = EXACT.model();
    let margins = Margins::new(&model, &touches).unwrap();
    let groups = 20_000;
    let curve = margins.curve(1, groups, 1).unwrap();
    for (position, object) in touches.objects.iter().enumerate() {
        let right = |touch: &&Touch| {
            let m = ENSEMBLE.margins(touch);
            (0..3).all(|other| other == position || m[other] < m[position])
        };
        let share = object.touches().iter().filter(right).count() as f64 / object.len() as f64;
        let estimate = curve.object_accuracy(position, 1);
        // Five standard errors: drawn 20,000 times with the same seed, it cannot fail by chance later.
        assert!((estimate.value - share).abs() < 5.0 * (0.25 / groups as f64).sqrt(), "{estimate:?} {share}");
    }
}

#[test]
fn more_touches_make_fewer_errors_and_confusion_agrees_with_the_curve() {
    exact_and_rounded(|margins| {
        let curve = margins.curve(60, 300, 1).unwrap();
        let [one, ten, sixty] = [1, 10, 60].map(|touches| curve.accuracy(touches).value);
        assert!(one < ten && ten < sixty && sixty > 0.95, "{one} {ten} {sixty}");
        let confusion = margins.confusion(60, 300, 1).unwrap();
        for (object, row) in confusion.iter().enumerate() {
            assert_eq!(row.iter().sum::<usize>(), 300);
            assert_eq!(row[object] as f64 / 300.0, curve.object_accuracy(object, 60).value);
        }
        let confidences = margins.confidences(60, 300, 1).unwrap();
        let correct = confidences.iter().filter(|confidence| confidence.correct).count();
        assert!((correct as f64 / 900.0 - sixty).abs() < 1e-9);
        assert!(confidences.iter().all(|c| c.posterior > 1.0 / 3.0 - 1e-9 && c.posterior <= 1.0));
    });
}

#[test]
fn confusion_after_the_first_touches_of_longer_groups_is_of_the_groups_of_the_curve() {
    exact_and_rounded(|margins| {
        let curve = margins.curve(60, 300, 1).unwrap();
        let confusion = margins.confusion_of_first(10, 60, 300, 1).unwrap();
        for (object, row) in confusion.iter().enumerate() {
            assert!((row[object] as f64 / 300.0 - curve.object_accuracy(object, 10).value).abs() < 1e-12, "{row:?}");
        }
        assert_eq!(margins.confusion_of_first(10, 0, 300, 1).unwrap(), margins.confusion(10, 300, 1).unwrap());
    });
}

#[test]
fn touches_to_an_error_rate_is_where_the_curve_passes_for_good() {
    exact_and_rounded(|margins| {
        let curve = margins.curve(100, 300, 1).unwrap();
        let touches = curve.touches_to_error(0.05).unwrap();
        assert!(curve.accuracy(touches).value >= 0.95);
        assert!(touches == 1 || curve.accuracy(touches - 1).value < 0.95);
        assert!((touches..=100).all(|more| curve.accuracy(more).value >= 0.95));
        assert_eq!(margins.curve(1, 300, 1).unwrap().touches_to_error(1e-9), None);
    });
}

#[test]
fn the_sequential_errors_stay_below_the_error_rate() {
    exact_and_rounded(|margins| {
        for error_rate in [0.2, 0.05, 0.01] {
            let settings =
                SequentialSettings { error_rate: Some(error_rate), max_touches: None, sequences: 500, seed: 3 };
            let sequential = margins.sequential(&settings).unwrap();
            assert!(sequential.error <= error_rate + 3.0 * sequential.error_standard_error, "{sequential:?}");
            assert!(sequential.undecided < 0.05);
            assert_eq!(sequential.outcomes.iter().map(Vec::len).collect::<Vec<_>>(), [500; 3]);
        }
    });
}

#[test]
fn models_with_exact_and_with_rounded_leaves_are_measured_on_the_same_groups() {
    let evaluated =
        |model: &CompiledModel| evaluate(&Margins::new(&model.model(), &test_touches()).unwrap(), &quick()).unwrap();
    let (full, compiled) = (evaluated(&EXACT), evaluated(&MODEL));
    // Sixteen bits change hardly a verdict; other groups would change a percent of them.
    assert!((full.accuracy[&20] - compiled.accuracy[&20]).abs() < 0.003, "{full:?} {compiled:?}");
    assert!((full.sequential.mean_touches - compiled.sequential.mean_touches).abs() < 0.05);
}

#[test]
fn a_recognizer_that_runs_out_of_touches_is_undecided() {
    exact_and_rounded(|margins| {
        let settings = SequentialSettings { error_rate: Some(1e-12), max_touches: Some(2), sequences: 20, seed: 1 };
        let sequential = margins.sequential(&settings).unwrap();
        assert_eq!((sequential.undecided, sequential.mean_touches, sequential.max_touches), (1.0, 2.0, 2));
        let settings = SequentialSettings { max_touches: Some(100_000), error_rate: Some(1e-15), ..settings };
        let all = margins.sequential(&settings).unwrap();
        assert!(all.outcomes[1].iter().all(|outcome| outcome.touches <= 300));
    });
}

#[test]
fn how_many_groups_differ_is_counted() {
    let touches = synthetic::dataset(&[30, 40, 30], 2);
    let model = EXACT.model();
    let margins = Margins::new(&model, &touches).unwrap();
    let expected = [(0, 1), (1, 30), (2, 435), (15, 155_117_520), (28, 435), (29, 30), (30, 1), (31, 0)];
    for (at, groups) in expected {
        assert_eq!(margins.distinct_groups(at), groups, "{at}");
    }
    let margins = Margins::new(&model, &test_touches()).unwrap();
    assert_eq!(margins.distinct_groups(150), u64::MAX);
}

#[test]
fn errors_and_undecided_sequences_of_objects_average_to_those_of_all() {
    exact_and_rounded(|margins| {
        let settings = SequentialSettings { error_rate: Some(0.2), max_touches: Some(4), sequences: 300, seed: 3 };
        let sequential = margins.sequential(&settings).unwrap();
        let mean = |shares: &BTreeMap<String, f64>| shares.values().sum::<f64>() / 3.0;
        assert!((mean(&sequential.error_per_object) - sequential.error).abs() < 1e-12);
        assert!((mean(&sequential.undecided_per_object) - sequential.undecided).abs() < 1e-12);
        assert!(sequential.error > 0.0 && sequential.undecided > 0.0);
    });
}

#[test]
fn the_same_seed_gives_the_same_figures_on_any_number_of_threads() {
    exact_and_rounded(|margins| {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| evaluate(margins, &quick()).unwrap())
        };
        assert_eq!(with(1), with(3));
        assert_ne!(with(1), evaluate(margins, &with!(quick(), seed = 2)).unwrap());
    });
}

#[test]
fn what_cannot_be_evaluated_says_so() {
    let model = EXACT.model();
    let margins = Margins::new(&model, &test_touches()).unwrap();
    for (settings, expected) in [
        (with!(quick(), at = vec![301]), "at is 301. Use fewer touches, or capture more: object1 has only 300."),
        (with!(quick(), at = vec![0]), "at is 0. Use numbers of touches of at least 1."),
        (with!(quick(), at = vec![0, 5]), "at is 0. Use numbers of touches of at least 1."),
        (with!(quick(), groups = 0), "groups is 0. Use at least 1."),
        (with!(quick(), error_rate = Some(0.5)), "error_rate is 0.5. Use a number of at least 1e-15 and below 0.5."),
        (with!(quick(), error_rate = Some(f64::NAN)), "error_rate is NaN."),
        (with!(quick(), max_touches = Some(0)), "max_touches is 0. Use at least 1."),
    ] {
        let error = evaluate(&margins, &settings).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(expected), "{error}");
        assert!(matches!(error.kind(), Kind::Setting { .. }), "{error:?}");
    }
    let unknown = synthetic::dataset(&[9, 9, 9, 9], 1);
    let error = Margins::new(&model, &unknown).err().unwrap();
    assert!(error.to_string().contains("does not know the object object3, only object0, object1, object2"), "{error}");
}

/// Every approach of `touches` to `full` holds a full touch, in no order that sequences know.
fn with_missing_contacts(dataset: &Dataset, one_in: usize) -> Dataset {
    let mut dataset = dataset.clone();
    for object in &mut dataset.objects {
        let mut index = 0..;
        *object = changed(&filtered(object, Touch::is_full), |touch| {
            let [first, second, _] = touch.times();
            let partial = Touch::new([first, second, palpate::shared::ContactTime::MISSING]);
            if index.next().is_some_and(|index| index % one_in != 0) { partial } else { *touch }
        });
    }
    dataset
}

#[test]
fn touches_that_a_model_does_not_use_cost_an_approach_and_change_nothing() {
    let model = OF_FULL_TOUCHES.model();
    let approaches = with_missing_contacts(&synthetic::dataset(&[3_000; 3], 2), 4);
    let full: Vec<_> = approaches.objects.iter().map(|o| o.touches().iter().filter(|t| t.is_full()).count()).collect();
    let margins = Margins::new(&model, &approaches).unwrap();
    let evaluation = evaluate(&margins, &quick()).unwrap();
    assert_eq!(evaluation.touches, full.iter().sum::<usize>());
    let of = evaluation.approaches.unwrap();
    assert!((of.used - 0.25).abs() < 0.001, "{of:?}");
    let sequential = &of.sequential;
    // Three approaches in four change nothing; the touches that are evidence are as many as without the others.
    let per_touch = sequential.mean().value / sequential.mean_touches;
    assert!((3.7..4.3).contains(&per_touch), "{per_touch}");
    let error = sequential.mean().standard_error + evaluation.sequential.mean().standard_error;
    assert!((sequential.mean_touches - evaluation.sequential.mean_touches).abs() < 3.0 * error, "{sequential:?}");
    assert!(sequential.undecided < 0.05 && sequential.error < 0.03, "{sequential:?}");
    assert_eq!(of.accuracy.keys().copied().collect::<Vec<_>>(), [10, 20, 60]);
    assert!(of.accuracy[&10] < of.accuracy[&60] && of.accuracy[&20] < evaluation.accuracy[&20]);
    assert!((evaluation.patterns["outer and middle"] - 0.75).abs() < 0.001);
}

#[test]
fn a_dead_finger_ends_undecided_where_a_model_knows_full_touches_only() {
    let model = OF_FULL_TOUCHES.model();
    let mut dead = with_missing_contacts(&test_touches(), usize::MAX);
    dead.objects.iter_mut().for_each(|object| *object = object.part(1..object.len(), object.len()));
    let margins = Margins::new(&model, &dead).unwrap();
    let evaluation = evaluate(&margins, &with!(quick(), at = Vec::new())).unwrap();
    assert_eq!(evaluation.touches, 0);
    let of = evaluation.approaches.unwrap();
    assert_eq!((of.sequential.undecided, of.sequential.error, of.sequential.mean_touches), (1.0, 0.0, 0.0));
    assert_eq!(of.accuracy[&60], 0.0, "nothing is recognized without evidence");
}

#[test]
fn every_contact_recognizes_in_fewer_approaches_than_full_touches_alone() {
    let data = with_missing_contacts(&synthetic::dataset(&[4_000; 3], 1), 4);
    let test = with_missing_contacts(&synthetic::dataset(&[2_000; 3], 2), 4);
    let approaches = |counted| {
        let compiled = compile::exact(&trained(&data, counted)).unwrap();
        let model = compiled.model();
        let margins = Margins::new(&model, &test).unwrap();
        let of = evaluate(&margins, &quick()).unwrap().approaches.unwrap();
        assert!(of.sequential.error < 0.03, "{of:?}");
        of.sequential.mean().value
    };
    assert!(approaches(Counted::Contacts) < 0.9 * approaches(Counted::Full));
}
