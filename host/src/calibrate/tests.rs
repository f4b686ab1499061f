use super::*;
use crate::compile;
use crate::evaluate::{Margins, SequentialSettings};
use crate::evidence::{Chip, Sequences, Supplier, chip, sequences};
use crate::probe::noise::Noise;
use crate::random::{Purpose, generator};
use crate::tests::synthetic::{self, MODEL};
use crate::touches::{Dataset, ObjectTouches};
use crate::with;
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use std::collections::BTreeSet;

const OBJECTS: usize = 3;

fn fresh(count: usize, seed: u64) -> Dataset {
    synthetic::dataset(&[count; OBJECTS], seed)
}

fn supplies(dataset: &Dataset) -> Vec<TouchSupply<'_>> {
    let objects = dataset.objects.iter().enumerate();
    objects.map(|(object, of)| TouchSupply::new(object, of, 1)).collect()
}

/// A supply, and for each sequence the positions of the touches that it used.
struct Watched<'w, 'd, 'm> {
    drawn: MarginSupply<'w, 'd, 'm>,
    used: Vec<Vec<u32>>,
    margins: Option<Vec<i32>>,
}

impl Supplier<Chip<'_>> for Watched<'_, '_, '_> {
    type Error = crate::Error;

    fn step(&mut self, follower: &Chip<'_>) -> crate::Result<Option<Option<&[i32]>>> {
        let Some(step) = self.drawn.step(follower)? else { return Ok(None) };
        self.margins = step.map(<[i32]>::to_vec);
        self.used.last_mut().unwrap().push(self.drawn.last());
        Ok(Some(self.margins.as_deref()))
    }
}

impl Sequences<Chip<'_>> for Watched<'_, '_, '_> {
    fn begin(&mut self) -> crate::Result<Option<Sequence>> {
        self.used.push(Vec::new());
        Sequences::<Chip<'_>>::begin(&mut self.drawn)
    }

    fn end(&mut self, steps: u32, is_whole: bool) -> bool {
        Sequences::<Chip<'_>>::end(&mut self.drawn, steps, is_whole)
    }
}

/// For each sequence of a supply the positions of the touches that it uses.
fn used(model: &Model<'_>, supply: &mut TouchSupply<'_>, limit: Limit) -> Vec<Vec<u32>> {
    let mut watched = Watched { drawn: MarginSupply::new(model, supply, &()), used: Vec::new(), margins: None };
    let mut follower = chip(model, Stopping::from_odds(0, u32::MAX), None);
    let found = sequences(&mut watched, &mut *follower, usize::MAX, limit).unwrap();
    watched.used.truncate(found.len());
    assert!(watched.used.iter().map(Vec::len).eq(found.iter().map(|sequence| sequence.approaches as usize)));
    watched.used
}

/// The pools that the touches of each sequence are of.
fn pools_of(used: Vec<Vec<u32>>, touched: &ObjectTouches) -> Vec<BTreeSet<usize>> {
    let of = |touch: u32| touched.pools().iter().position(|pool| pool.range.contains(&(touch as usize))).unwrap();
    used.into_iter().map(|used| used.into_iter().map(of).collect()).collect()
}

/// Equal touches, made by `robots` robots in turn, whose biases change nothing.
fn of_robots(mut dataset: Dataset, robots: usize) -> Dataset {
    dataset.add_noise(&with!(Noise::default(), pose_bias = 1.0), 1, robots);
    dataset
}

#[test]
fn an_object_that_is_wrong_more_often_than_all_names_together_is_named() {
    // Three objects are recognized; of the fourth few sequences end with a name, and of these many with a wrong one.
    let sequence = |index: usize| {
        let object = index % 4;
        let mut sequence = Sequence::new(object);
        let name = match (object, index / 4 % 10) {
            (3, 0) => 0,
            (3, 1..3) => 3,
            (3, _) => return sequence,
            _ => object,
        };
        sequence.take(Lead { name, odds: odds_of(9.0), touches: 5, approaches: 5 }, true);
        sequence
    };
    let names = ["object0", "object1", "object2", "object3"].map(String::from);
    let sequences: Vec<Sequence> = (0..8_000).map(sequence).collect();
    let chosen = choose(&sequences, &names, 8.0, &Terms { rate: 0.05, confidence: 0.95, per: Per::Average }).unwrap();
    assert_eq!(chosen.touched[3], Tally { wrong: 200, all: 600 });
    assert_eq!(chosen.named[0], Tally { wrong: 200, all: 2_200 });
    assert_eq!(chosen.touched[0].wrong + chosen.touched[1].wrong + chosen.touched[2].wrong, 0);
    let of = |object: usize| OfObject {
        given: chosen.touched[object].all,
        wrong: chosen.touched[object].wrong,
        named: chosen.named[object].all,
        named_wrongly: chosen.named[object].wrong,
    };
    let worse = calibrated::worse(&names.into_iter().zip((0..4).map(of)).collect(), 0.05);
    let [first, last] = &worse[..] else { panic!("{worse:?}") };
    assert_eq!((first.object.as_str(), first.given, first.named), ("object0", None, Some(200.0 / 2_200.0)));
    assert_eq!((last.object.as_str(), last.given, last.named), ("object3", Some(200.0 / 600.0), None));
}

#[test]
fn sequences_are_whole_and_use_no_touch_twice() {
    let dataset = fresh(3_000, 2);
    let limit = Limit { margin: 6.0, max_touches: 50 };
    let sequences = follow(&MODEL.model(), &mut supplies(&dataset), &[90; 3], limit, &()).unwrap();
    assert_eq!(sequences.len(), 270);
    for mut supply in supplies(&dataset) {
        let used = used(&MODEL.model(), &mut supply, limit).concat();
        assert_eq!(used.iter().collect::<BTreeSet<_>>().len(), used.len());
    }
    for sequence in &sequences {
        let is_sure = sequence.given(&Odds::All(odds_of(6.0))).is_some();
        assert!(is_sure || sequence.touches == 50, "{sequence:?}");
        assert_eq!(sequence.touches, sequence.approaches);
    }
    // Fewer touches make fewer sequences, equally many of each object.
    let few = synthetic::dataset(&[300, 3_000, 3_000], 2);
    let sequences = follow(&MODEL.model(), &mut supplies(&few), &[90; 3], limit, &());
    let sequences = sequences.unwrap();
    let of = |object| sequences.iter().filter(|sequence| sequence.object == object).count();
    assert!(of(0) > 3 && of(0) < 90 && of(0) == of(1) && of(0) == of(2), "{}", of(0));
}

#[test]
fn every_robot_makes_one_sequence() {
    let dataset = of_robots(fresh(1_000, 2), 20);
    let limit = Limit { margin: 6.0, max_touches: 50 };
    let sequences = follow(&MODEL.model(), &mut supplies(&dataset), &[90; 3], limit, &()).unwrap();
    assert_eq!(sequences.len(), 3 * 20);
    for (mut supply, touched) in supplies(&dataset).into_iter().zip(&dataset.objects) {
        let robots = pools_of(used(&MODEL.model(), &mut supply, limit), touched);
        assert!(robots.iter().all(|robots| robots.len() == 1), "{robots:?}");
        assert_eq!(robots.into_iter().flatten().collect::<BTreeSet<_>>().len(), 20);
    }
}

#[test]
fn every_sequence_is_of_one_instance() {
    let dataset = fresh(1_000, 2);
    let names = ["a", "b", "c"].map(String::from);
    let touched = ObjectTouches::in_turn("object0", dataset.objects[0].touches().to_vec(), &names, 0);
    let limit = Limit { margin: 6.0, max_touches: 50 };
    let mut supply = [TouchSupply::new(0, &touched, 1)];
    let sequences = follow(&MODEL.model(), &mut supply, &[30], limit, &()).unwrap();
    assert_eq!(sequences.len(), 30);
    let instances = pools_of(used(&MODEL.model(), &mut TouchSupply::new(0, &touched, 1), limit), &touched);
    assert!(instances.len() > 30 && instances.iter().all(|instances| instances.len() == 1), "{instances:?}");
}

#[test]
fn sequences_stop_where_the_recognizer_stops() {
    let dataset = fresh(3_000, 2);
    let model = MODEL.model();
    let limit = Limit { margin: 8.0, max_touches: 60 };
    let sequences = follow(&model, &mut supplies(&dataset), &[40; 3], limit, &()).unwrap();
    // The same touches in the same order, pushed into a recognizer that stops by itself.
    let own = [0x1000_0000 << 24, 0x0200_0000 << 24, 0x0400_0000 << 24];
    for odds in [Odds::All(odds_of(3.0)), Odds::ByObject(own.to_vec())] {
        let bytes = with_thresholds(&model, &odds);
        let model = Model::new(&bytes).unwrap();
        let stopping = match &odds {
            Odds::All(odds) => Stopping::from_odds(*odds, 60),
            Odds::ByObject(_) => Stopping::from_model(&model).with_max_touches(60),
        };
        for object in 0..OBJECTS {
            let mut order = replay(&dataset, object);
            for sequence in sequences.iter().filter(|sequence| sequence.object == object) {
                let mut recognizer = Recognizer::<OBJECTS>::new(&model, stopping).unwrap();
                let own: Vec<_> = order.by_ref().take(sequence.touches as usize).collect();
                let verdict = own.iter().find_map(|touch| match recognizer.push(touch).unwrap() {
                    Verdict::Recognized { object, touches, .. } => Some((usize::from(object), touches)),
                    _ => None,
                });
                let given = sequence.given(&odds).map(|look| (look.name, look.touches));
                assert_eq!(verdict, given, "{odds:?}");
            }
        }
    }
}

/// The model with these thresholds.
fn with_thresholds(model: &Model<'_>, odds: &Odds) -> Vec<u8> {
    use palpate_shared::format::{OddsByObject, Tag};
    let Odds::ByObject(each) = odds else { return model.bytes().to_vec() };
    let content = each.iter().flat_map(|&odds| OddsByObject::to_bytes(odds)).collect();
    let sections = vec![(Tag::ThresholdsByObject, Some((true, content)))];
    compile::restate(model, &compile::Restated { sections, ..Default::default() }).unwrap()
}

/// The touches of an object in the order of its supply.
fn replay(dataset: &Dataset, object: usize) -> impl Iterator<Item = palpate_shared::Touch> {
    use rand::seq::SliceRandom;
    let touches = dataset.objects[object].touches().to_vec();
    let mut order: Vec<u32> = (0..touches.len() as u32).collect();
    order.shuffle(&mut generator(1, Purpose::Calibration, &dataset.objects[object].name, 0));
    order.into_iter().map(move |touch| touches[touch as usize])
}

#[test]
fn with_other_priors_or_fewer_objects_errors_stay_below_what_theory_says() {
    let settings = Settings { rate: 0.05, sequences: 6_000, max_touches: Some(60), ..Settings::default() };
    let calibrated = calibrate(&MODEL.model(), fresh(60_000, 2), &settings, &()).unwrap();
    let model = Model::new(&calibrated.model).unwrap();
    let bound = crate::evaluate::by_theory(&model);
    // The threshold is looser than the posterior's, so that is its largest value.
    assert!(bound > 0.05 && bound < 0.3, "{bound}");
    let unseen = fresh(4_000, 4);
    let settings = SequentialSettings { error_rate: None, max_touches: None, sequences: 2_000, seed: 1 };
    let mut errors = Vec::new();
    for weights in [[1, 1, 1], [8, 1, 1], [1, 1, 8], [1, 1, 0], [0, 1, 1], [1, 0, 9]] {
        let margins = Margins::new(&model, &unseen).unwrap().expecting(weights.to_vec()).unwrap();
        let sequential = margins.sequential(&settings).unwrap();
        assert!(sequential.error <= bound + 2.0 * sequential.error_standard_error, "{weights:?}: {}", sequential.error);
        assert_eq!(sequential.promised, None);
        let tested = weights.iter().filter(|weight| **weight > 0).count();
        assert_eq!(sequential.per_object.len(), tested);
        errors.push(sequential.error);
    }
    // Equal weights are what the model was calibrated for.
    let equal = Margins::new(&model, &unseen).unwrap().sequential(&settings).unwrap();
    assert!((equal.error - errors[0]).abs() < 1e-12);
}

#[test]
fn as_many_touches_as_a_refusal_says_keep_the_rate_that_was_refused() {
    let settings = Settings { rate: 0.05, max_touches: Some(60), ..Settings::default() };
    let calibrated = |count: usize, seed: u64, strictest: f64| {
        let start = Start { margin: strictest, loosest: None, share: 1.0 };
        calibrate_from(&MODEL.model(), fresh(count, seed), &settings, Some(start), &())
    };
    // From loose to strict, the first that is refused though fewer names are wrong than promised.
    let refused = (0..60).find_map(|step| {
        let strictest = 0.5 + 0.05 * f64::from(step);
        let error = calibrated(2_000, 2, strictest).err()?;
        let number = error.remedy().strip_prefix("About ")?.split_once(" approaches of each object would do")?.0;
        Some((strictest, number.parse().unwrap()))
    });
    let (strictest, enough): (f64, usize) = refused.expect("a refusal");
    assert!(enough > 2_000, "{enough}");
    let kept = (3..8).filter(|&seed| calibrated(enough, seed, strictest).is_ok()).count();
    assert!(kept >= 3, "{kept} of 5 with {enough}");
    // Touches with another noise are named.
    let noisy = Settings { noise: Noise::gaussian(40_000.0), ..settings.clone() };
    let start = Start { margin: 0.5, loosest: None, share: 1.0 };
    let error = calibrate_from(&MODEL.model(), fresh(6_000, 2), &noisy, Some(start), &()).unwrap_err().to_string();
    assert!(error.contains("it was trained for no noise, and they have noise of 40 ms"), "{error}");
}
