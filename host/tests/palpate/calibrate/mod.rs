mod recorded;

use crate::fixtures::*;
use crate::synthetic::{self, MODEL};
use palpate::calibrate::{Lead, Odds, Sequence, Settings, Terms, calibrate, choose, margin_of, odds_of};
use rand::RngExt;

const OBJECTS: usize = 3;

fn fresh(count: usize, seed: u64) -> Dataset {
    synthetic::dataset(&[count; OBJECTS], seed)
}

/// Asserts that a promise is refused, for a reason with these parts.
fn assert_refused<T>(result: palpate::Result<T>, kind: &Kind, parts: &[&str]) {
    let error = result.err().unwrap();
    assert!(error.is(kind) && parts.iter().all(|part| error.what().contains(part)), "{error}");
}

/// Places of made-up objects; the first two are hard to distinguish.
const PLACES: [[f64; 2]; 4] = [[0.0, 0.0], [0.45, 0.0], [2.0, 0.5], [0.0, 2.0]];

/// Sequences of made-up touches: an object's place with Gaussian noise, and the exact evidence of it.
fn walks(sequences: usize, seed: u64) -> Vec<Sequence> {
    let sequence = |index: usize| {
        let object = index % PLACES.len();
        let mut random = generator(seed, Purpose::Calibration, "walks", index as u64);
        let (mut sequence, mut evidence) = (Sequence::new(object), [0.0_f64; PLACES.len()]);
        for touches in 1..=200 {
            let at = PLACES[object].map(|place| place + (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
            for (evidence, place) in evidence.iter_mut().zip(PLACES) {
                *evidence -= 0.5 * ((at[0] - place[0]).powi(2) + (at[1] - place[1]).powi(2));
            }
            let name = (0..4).max_by(|&a, &b| evidence[a].total_cmp(&evidence[b])).unwrap();
            let others: f64 = (0..4).filter(|&o| o != name).map(|o| (evidence[o] - evidence[name]).exp()).sum();
            let odds = odds_of(-others.ln());
            sequence.take(Lead { name, odds, touches, approaches: touches }, true);
            if odds <= odds_of(10.0) {
                break;
            }
        }
        sequence
    };
    (0..sequences).map(sequence).collect()
}

fn names(objects: usize) -> Vec<String> {
    (0..objects).map(|object| format!("object{object}")).collect()
}

fn terms(rate: f64, per: Per) -> Terms {
    Terms { rate, confidence: 0.95, per }
}

/// Wrong names of those given on fresh sequences: of all, of each name, of each object.
fn errors(sequences: &[Sequence], odds: &Odds, objects: usize) -> (f64, Vec<f64>, Vec<f64>) {
    let given: Vec<(usize, usize)> = sequences.iter().filter_map(|s| Some((s.object, s.given(odds)?.name))).collect();
    let share = |keep: &dyn Fn(&(usize, usize)) -> bool| {
        let of: Vec<_> = given.iter().filter(|case| keep(case)).collect();
        of.iter().filter(|(object, name)| object != name).count() as f64 / of.len() as f64
    };
    let each =
        |keep: &dyn Fn(&(usize, usize), usize) -> bool| (0..objects).map(|o| share(&|case| keep(case, o))).collect();
    (share(&|_| true), each(&|case, o| case.1 == o), each(&|case, o| case.0 == o))
}

#[test]
fn a_promise_is_kept_on_fresh_sequences_and_used_up() {
    let (sequences, fresh) = (walks(20_000, 1), walks(20_000, 2));
    for rate in [0.1, 0.05, 0.02, 0.01] {
        let chosen = choose(&sequences, &names(4), 10.0, &terms(rate, Per::Average)).unwrap();
        let (error, ..) = errors(&fresh, &chosen.odds, 4);
        // Calibrated to within its 95 % bound, and a standard error of the fresh ones.
        let spread = (rate / 20_000.0).sqrt();
        assert!(error <= rate + 2.0 * spread && error > rate - 5.0 * spread, "{rate}: {error}");
        // Sooner than the posterior's threshold.
        let Odds::All(odds) = chosen.odds else { panic!("{chosen:?}") };
        assert!(margin_of(odds) < ((1.0 - rate) / rate).ln(), "{rate}: {}", margin_of(odds));
        assert!(chosen.wrong as u64 == chosen.tallies[0].wrong && chosen.given > 19_800);
    }
}

#[test]
fn a_promise_per_name_or_object_is_kept_for_each_of_them() {
    let (sequences, fresh) = (walks(40_000, 1), walks(40_000, 2));
    let rate = 0.02;
    let spread = (rate / 10_000.0_f64).sqrt();
    let average = choose(&sequences, &names(4), 10.0, &terms(rate, Per::Average)).unwrap();
    let (_, by_name, by_object) = errors(&fresh, &average.odds, 4);
    assert!(
        by_name[0] > rate + spread && by_object[1] > rate + spread,
        "an average says nothing of each: {by_name:?} {by_object:?}"
    );
    let name = choose(&sequences, &names(4), 10.0, &terms(rate, Per::Name)).unwrap();
    let (_, by_name, _) = errors(&fresh, &name.odds, 4);
    assert!(by_name.iter().all(|error| *error <= rate + 2.0 * spread), "{by_name:?}");
    assert!(by_name.iter().all(|error| *error > 0.6 * rate), "{by_name:?} is not used up");
    let object = choose(&sequences, &names(4), 10.0, &terms(rate, Per::Object)).unwrap();
    let (_, _, by_object) = errors(&fresh, &object.odds, 4);
    assert!(by_object.iter().all(|error| *error <= rate + 2.0 * spread), "{by_object:?}");
    assert!(object.mean_touches > average.mean_touches, "each object costs more than their average");
    assert_eq!((name.tallies.len(), object.tallies.len(), object.sequences), (4, 4, 40_000));
    assert!(name.mean_touches < 1.2 * average.mean_touches, "{} {}", name.mean_touches, average.mean_touches);
}

/// Objects of made-up sequences whose error rates are known.
const KNOWN: usize = 6;

/// The probability that a sequence leads by this margin for a wrong object: for the first wrong one and, if that
/// is not named, for the second. Each name has its own.
fn led_wrongly(name: usize, margin: f64) -> [f64; 2] {
    [0.4, 0.3].map(|share| share * 1.5_f64.powi(name as i32 % 3) * (-margin).exp())
}

/// A sequence of an object: the next object may lead first, then the one after it, and in the end the right one.
fn known(object: usize, random: &mut impl rand::Rng) -> Sequence {
    let mut sequence = Sequence::new(object);
    let wrong = [1, 2].map(|step| (object + step) % KNOWN);
    for (touches, (turn, name)) in (1..).zip(wrong.into_iter().enumerate()) {
        // Where a uniform number is the probability.
        let margin = led_wrongly(name, 0.0)[turn].ln() - random.random::<f64>().ln();
        sequence.take(Lead { name, odds: odds_of(margin), touches, approaches: touches }, true);
    }
    sequence.take(Lead { name: object, odds: odds_of(12.0), touches: 3, approaches: 3 }, true);
    sequence
}

/// The true error rates of thresholds: of all names, of each name, of the names given to each object.
fn known_rates(odds: &Odds) -> (f64, Vec<f64>, Vec<f64>) {
    let margins: Vec<f64> = (0..KNOWN).map(|name| margin_of(odds.of(name))).collect();
    let mut given = vec![[0.0; KNOWN]; KNOWN];
    for (object, given) in given.iter_mut().enumerate() {
        let mut left = 1.0;
        for (turn, name) in [1, 2].map(|step| (object + step) % KNOWN).into_iter().enumerate() {
            given[name] = left * led_wrongly(name, margins[name])[turn];
            left -= given[name];
        }
        given[object] = left;
    }
    let of_object = |object: usize| 1.0 - given[object][object] / given[object].iter().sum::<f64>();
    let of_name = |name: usize| 1.0 - given[name][name] / given.iter().map(|given| given[name]).sum::<f64>();
    let right: f64 = (0..KNOWN).map(|object| given[object][object]).sum();
    let each = |of: &dyn Fn(usize) -> f64| (0..KNOWN).map(of).collect();
    (1.0 - right / given.iter().flatten().sum::<f64>(), each(&of_name), each(&of_object))
}

/// `PALPATE_REPETITIONS=200 cargo test --release -p palpate --test palpate all_rates_promised -- --nocapture` repeats it as often.
#[test]
fn all_rates_promised_are_kept_at_once_in_all_but_one_of_twenty_calibrations() {
    let (rate, repetitions) = (0.05, repetitions(20));
    let mut broken = [0; 3];
    let mut used = [0.0; 3];
    for run in 0..repetitions {
        let mut random = generator(run, Purpose::Synthetic, "known", 0);
        let sequences: Vec<Sequence> = (0..4_800).map(|index| known(index % KNOWN, &mut random)).collect();
        for (way, per) in [Per::Average, Per::Name, Per::Object].into_iter().enumerate() {
            let chosen = choose(&sequences, &names(KNOWN), 6.0, &terms(rate, per)).unwrap();
            let (all, names, objects) = known_rates(&chosen.odds);
            let rates = [vec![all], names, objects][way].clone();
            used[way] += rates.iter().sum::<f64>() / (rates.len() as f64 * rate * repetitions as f64);
            broken[way] += u64::from(rates.iter().any(|of| *of > rate));
        }
    }
    for (way, per) in ["average", "name", "object"].into_iter().enumerate() {
        println!("{per}: {:.0} % of the rate is used on average", 100.0 * used[way]);
        assert_rare(per, broken[way], repetitions, 0.05);
        // A promise that is kept by not giving names is none.
        assert!(used[way] > [0.8, 0.35, 0.35][way], "{per}: {}", used[way]);
    }
}

#[test]
fn thresholds_by_name_are_learned_on_other_sequences_than_they_are_tested_on() {
    let sequences = walks(12_000, 1);
    let chosen = choose(&sequences, &names(4), 10.0, &terms(0.05, Per::Name)).unwrap();
    assert_eq!(chosen.sequences, 8_000);
    // Each object's later sequences, whatever instance or robot they are of in turn.
    let tested: Vec<Sequence> = sequences[4_000..].to_vec();
    let wrong: Vec<_> = tested.iter().filter(|s| s.given(&chosen.odds).is_some_and(|l| l.name != s.object)).collect();
    assert_eq!(wrong.len(), chosen.wrong);
    // What was tested on decides at which of the learned thresholds the walk ends, and no more: with its objects
    // confused nothing is promised, instead of something stricter.
    let mut confused = sequences;
    confused[4_000..].iter_mut().step_by(9).for_each(|sequence| sequence.object = (sequence.object + 1) % 4);
    let chosen = choose(&confused, &names(4), 10.0, &terms(0.05, Per::Name));
    assert_refused(chosen, &Kind::NotKept, &["names given for object"]);
}

#[test]
fn too_few_sequences_promise_nothing_and_say_how_many_it_takes() {
    let sequences = walks(400, 1);
    assert!(choose(&sequences, &names(4), 10.0, &terms(0.05, Per::Average)).is_ok());
    let few = |sequences, rate, per, parts: &[&str]| {
        assert_refused(choose(sequences, &names(4), 10.0, &terms(rate, per)), &Kind::TooFew, parts);
    };
    few(
        &sequences[..],
        0.001,
        Per::Average,
        &["names given are too few to promise 0.1 %: at least 2995 are needed, none"],
    );
    few(
        &sequences[..],
        0.02,
        Per::Object,
        &["100 names given for object", " 2 %: at least 149 are needed, none of them"],
    );
    few(&[], 0.1, Per::Average, &["0 names given are too few"]);
}

#[test]
fn a_model_that_is_wrong_however_sure_it_is_keeps_no_promise() {
    let mut sequences = walks(2_000, 1);
    // Every twentieth is of another object than it seems.
    sequences.iter_mut().step_by(20).for_each(|sequence| sequence.object = (sequence.object + 1) % 4);
    let chosen = choose(&sequences, &names(4), 10.0, &terms(0.01, Per::Average));
    assert_refused(
        chosen,
        &Kind::NotKept,
        &["no threshold that was tested keeps 1 %: at the best ", "names given are wrong"],
    );
}

#[test]
fn a_calibrated_model_states_its_promise_and_keeps_it_on_fresh_touches() {
    for per in [Per::Average, Per::Name, Per::Object] {
        let settings = with!(Settings::default(), rate = 0.05, per, sequences = 4_000, max_touches = Some(60));
        let calibrated = calibrate(&MODEL.model(), fresh(40_000, 2), &settings, &()).unwrap();
        let model = Model::new(&calibrated.model).unwrap();
        assert_eq!(model.promise(), Some(calibrated.promise));
        assert_eq!((calibrated.promise.rate, calibrated.promise.per, calibrated.promise.max_touches), (0.05, per, 60));
        assert_eq!(model.odds_of(0).is_some(), per == Per::Name);
        assert!((model.temperature().value() - calibrated.temperature.unwrap()).abs() < 1e-12);
        assert!(
            calibrated.temperature.is_some_and(|found| (0.8..2.0).contains(&found)),
            "{:?}",
            calibrated.temperature
        );
        // No margin changes.
        let touch = fresh(1, 3).objects[0].touches()[0];
        let mut margins = [[0; OBJECTS]; 2];
        assert!(MODEL.model().margins(&touch, &mut margins[0]) && model.margins(&touch, &mut margins[1]));
        assert_eq!(margins[0], margins[1]);
        let unseen = fresh(4_000, 4);
        let margins = Margins::new(&model, &unseen).unwrap();
        let settings = SequentialSettings { error_rate: None, max_touches: None, sequences: 1_000, seed: 1 };
        let sequential = margins.sequential(&settings).unwrap();
        assert!(sequential.error <= 0.05 + 2.0 * sequential.error_standard_error, "{sequential:?}");
        assert_eq!((sequential.promised, sequential.per), (Some(0.05), Some(per.name())));
        let naive = margins.sequential(&SequentialSettings { error_rate: Some(0.05), ..settings }).unwrap();
        let touches = [sequential.mean_touches, naive.mean_touches];
        assert!(per != Per::Average || touches[0] < touches[1], "{touches:?}");
        assert_eq!((naive.promised, naive.per), (None, None));
    }
}

#[test]
fn calibrating_again_replaces_what_an_earlier_calibration_stated() {
    let settings = |per, rate| with!(Settings::default(), per, rate, sequences = 3_000);
    let once = calibrate(&MODEL.model(), fresh(30_000, 2), &settings(Per::Name, 0.1), &()).unwrap();
    let model = CompiledModel::from_bytes(once.model).unwrap();
    let twice = calibrate(&model.model(), fresh(30_000, 2), &settings(Per::Average, 0.05), &()).unwrap();
    let direct = calibrate(&MODEL.model(), fresh(30_000, 2), &settings(Per::Average, 0.05), &()).unwrap();
    assert_eq!(twice.model, direct.model);
}

#[test]
fn the_same_seed_gives_the_same_model_on_any_number_of_threads() {
    let settings = with!(Settings::default(), rate = 0.05, per = Per::Name, sequences = 3_000);
    let with = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let settings = with!(settings.clone(), seed);
        pool.install(|| calibrate(&MODEL.model(), fresh(30_000, 2), &settings, &()).unwrap().model)
    };
    assert_eq!(with(1, 1), with(3, 1));
    assert_ne!(with(1, 1), with(1, 2));
}

#[test]
fn noise_is_stated_and_a_bias_makes_every_sequence_a_robots() {
    let noise = with!(Noise::gaussian(1_000.0), speed_bias = 0.02);
    let settings = with!(Settings::default(), rate = 0.2, max_touches = Some(20), noise);
    let calibrated = calibrate(&MODEL.model(), fresh(4_000, 2), &settings, &()).unwrap();
    assert_eq!(Noise::of_promise(&calibrated.promise.noise), noise);
    // 190 robots of 20 touches or more that are evidence, less a few for the pilot.
    assert!((3 * 175..3 * 200).contains(&calibrated.sequences), "{}", calibrated.sequences);
}

#[test]
fn what_cannot_be_calibrated_says_so() {
    let refused = |settings: Settings| calibrate(&MODEL.model(), fresh(100, 2), &settings, &()).unwrap_err();
    for (settings, expected) in [
        (with!(Settings::default(), rate = 0.5), "error_rate is 0.5"),
        (with!(Settings::default(), rate = f64::NAN), "error_rate is NaN"),
        (with!(Settings::default(), confidence = 1.0), "confidence is 1"),
        (with!(Settings::default(), sequences = 0), "sequences is 0"),
        (with!(Settings::default(), max_touches = Some(0)), "max_touches is 0"),
        (with!(Settings::default(), noise = Noise::gaussian(-1.0)), "noise is -1"),
    ] {
        let error = refused(settings);
        assert!(error.exit_code() == 2 && error.to_string().contains(expected), "{error}");
    }
    let few = refused(Settings::default());
    assert!(few.exit_code() == 1 && few.to_string().contains("too few to promise 1 %: at least 299"), "{few}");
    assert!(few.to_string().contains(" approaches of each object or more; there are 100 of one"), "{few}");
    let less = synthetic::dataset(&[100, 100], 2);
    let missing = calibrate(&MODEL.model(), less, &Settings::default(), &());
    assert_refused(missing, &Kind::Input, &["the data set has no touches of object2"]);
    let more = synthetic::dataset(&[100; 4], 2);
    assert!(calibrate(&MODEL.model(), more, &Settings::default(), &()).is_err());
}
