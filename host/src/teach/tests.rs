use super::balance::{Groups, Held, Judged, Named};
use super::column::{Part, fit};
use super::held_out::{places, repeated};
use super::rows::{Leaves, Rows};
use super::*;
use crate::ensemble::OverTouches;
use crate::ensemble::train::{self, train};
use crate::probe::noise::Noise;
use crate::tests::repetitions::repetitions;
use crate::tests::synthetic::{self, few_trees, to_teach};
use palpate_shared::Descriptor;
use rand_distr::{Distribution, StandardNormal};

#[test]
fn no_touch_nor_its_copy_is_fitted_on_while_it_is_held_out() {
    let [known, recorded, unseen] = to_teach(200);
    let ensemble = train(&known, &few_trees(), &()).unwrap();
    let descriptor = ensemble.descriptor().unwrap();
    let known: Vec<Vec<Touch>> = known.objects.into_iter().map(|object| object.touches().to_vec()).collect();
    let smoothing = Smoothing { jitter: 1.0, prior: 4.0 };
    let division = Division { parts: 5, used: 4 };
    let place = places("object2", 200, 1);
    let original = recorded.objects[0].touches();
    let held = |touches: &[Touch]| {
        let material = Material::new(&ensemble, descriptor, &known, &[("object2", touches)], 1);
        material.held_out(&[0], &[smoothing], 1, division, &()).unwrap().remove(2)
    };
    let before = held(original);
    for part in 0..5 {
        // Every touch of the part becomes another object's.
        let is_held = |touch: usize| division.part(place[touch]) == part;
        let mut changed = original.to_vec();
        let foreign = unseen.objects[0].touches().iter();
        changed
            .iter_mut()
            .enumerate()
            .filter(|(touch, _)| is_held(*touch))
            .zip(foreign)
            .for_each(|((_, to), from)| *to = *from);
        let after = held(&changed);
        let count = (0..200).filter(|&touch| is_held(touch)).count();
        assert_eq!(count, 40);
        // What others say about touches of their parts changes; what the part's own columns say does not.
        let margins = |held: &Held, touch: usize| held[touch].as_ref().map(|margins| margins[2]);
        let others = (0..200).filter(|&touch| !is_held(touch));
        assert!(others.clone().any(|touch| margins(&before, touch) != margins(&after, touch)));
        let restored: Vec<Touch> =
            (0..200).map(|touch| if is_held(touch) { original[touch] } else { changed[touch] }).collect();
        assert_eq!(restored, *original);
        let columns = |touches: &[Touch]| {
            let material = Material::new(&ensemble, descriptor, &known, &[("object2", touches)], 1);
            material.columns(&[0], &[smoothing], 1, |place| division.uses(division.part(place), part))
        };
        assert_eq!(columns(&changed), columns(original));
    }
}

#[test]
fn copies_stand_for_the_touch_that_they_are_of() {
    let touches = synthetic::dataset(&[50], 1).objects[0].touches().to_vec();
    let copies = repeated("cup", &touches, 1e-9, 1);
    assert_eq!(copies.len(), 50 * 64);
    for (index, copy) in copies.iter().enumerate() {
        assert_eq!(*copy, touches[index % 50]);
    }
    assert_ne!(repeated("cup", &touches, 1.0, 1)[..50], touches[..]);
    assert_eq!(repeated("cup", &[], 1.0, 1), []);
}

#[test]
fn a_prior_counts_touches_and_not_their_copies() {
    let [known, recorded, _] = to_teach(40);
    let ensemble = train(&known, &few_trees(), &()).unwrap();
    let leaves = Leaves::of(&ensemble);
    let rows = |touches: &[Touch], given| Rows::new(&ensemble, &leaves, Descriptor::ContactsCurvature, touches, given);
    let known: Vec<Rows> = known.objects.iter().map(|object| rows(object.touches(), 3_000)).collect();
    let once = recorded.objects[0].touches();
    let columns = |touches: &[Touch]| {
        let own = rows(touches, once.len());
        let part = |rows, column| {
            let rows: &Rows = rows;
            Part { rows, chosen: (0..rows.count() as u32).collect(), column }
        };
        let parts = [part(&known[0], None), part(&known[1], None), part(&own, Some(0))];
        fit(&leaves, &parts, &[4.0]).remove(0)
    };
    let (single, thrice) = (columns(once), columns(&once.repeat(3)));
    assert!(single.iter().zip(&thrice).all(|(a, b)| (a - b).abs() < 1e-9));
    assert!(single.iter().any(|value| value.abs() > 0.1));
}

/// Margins of two objects over approaches: their difference, in steps from `least`.
fn ramp(least: f64, step: f64, of_first: bool) -> Held {
    let margins = |advantage: f64| if of_first { vec![advantage, 0.0] } else { vec![0.0, advantage] };
    (0..100).map(|index| Some(margins(least + step * f64::from(index)))).collect()
}

/// The approaches of an object of one source.
fn one_source(count: usize) -> Vec<Vec<usize>> {
    vec![(0..count).collect()]
}

/// Groups of objects of one source each.
fn groups(
    held: &[balance::Held],
    taught: Vec<usize>,
    background: Option<usize>,
    counts: [usize; 2],
    seed: u64,
) -> Groups {
    let sources: Vec<Vec<Vec<usize>>> = held.iter().map(|held| one_source(held.len())).collect();
    Groups::draw((held, &sources), taught, background, counts, seed)
}

#[test]
fn the_constant_lets_an_object_be_missed_as_often_as_others_are_taken_for_it() {
    // Groups of one approach. Without a constant 40 of 100 are missed, and 10 are taken for it.
    let held = [ramp(-0.0995, 0.01, true), ramp(-0.3995, 0.01, false)];
    let drawn = groups(&held, vec![1], None, [20_000, 1], 1);
    let near = |named: Named, right: f64, wrong: f64| {
        assert!((named.right - right).abs() < 0.02 && (named.wrong - wrong).abs() < 0.02, "{named:?}");
    };
    near(drawn.named(0, &[0.0]), 0.6, 0.1);
    let constants = drawn.balanced();
    assert!((constants[0] - 0.15).abs() < 0.01, "{constants:?}");
    near(drawn.named(0, &constants), 0.75, 0.25);
    assert!((drawn.others(&constants) - 0.75).abs() < 0.02);
    // The other way round it is negative.
    let drawn = groups(&held, vec![0], None, [20_000, 1], 1);
    assert!((drawn.balanced()[0] + 0.15).abs() < 0.01);
}

/// Margins of this many touches of two objects, the second taught: normal, the right one ahead by `ahead` on average.
fn normal(count: usize, ahead: f64, run: u64) -> [Held; 2] {
    let mut random = crate::random::generator(run, crate::random::Purpose::Synthetic, "teach", 0);
    [[1.0, 0.0], [0.0, 1.0]].map(|right| {
        let margins = |_| {
            let noise: f64 = StandardNormal.sample(&mut random);
            let [own, other] = [ahead + noise, 0.0];
            Some(vec![right[0] * own + right[1] * other, right[1] * own + right[0] * other])
        };
        (0..count).map(margins).collect()
    })
}

/// `PALPATE_REPETITIONS=1000 cargo test --release -p palpate --lib errors_stated_of_taught -- --nocapture` repeats it as often; by
/// default 200 times.
#[test]
fn errors_stated_of_taught_objects_are_those_of_fresh_groups_and_not_of_the_groups_that_chose() {
    let (touches, approaches, ahead) = (30, 10, 0.35);
    let repetitions = repetitions(200);
    let error = |named: Named| f64::midpoint(1.0 - named.right, named.wrong);
    // Of groups of the same size from many touches that nothing was chosen on.
    let fresh = groups(&normal(40_000, ahead, u64::MAX), vec![1], None, [2_000, approaches], 1);
    let (mut stated, mut chosen) = (Vec::new(), Vec::new());
    for run in 0..repetitions {
        let held = normal(touches, ahead, run);
        let drawn = groups(&held, vec![1], None, [100, approaches], run);
        let constants = drawn.balanced();
        let truth = error(fresh.named(0, &constants));
        let judged =
            Judged::new((&held, &[one_source(touches), one_source(touches)]), &[1], None, [100, approaches], run);
        stated.push(error(judged.named(0)) - truth);
        chosen.push(error(drawn.named(0, &constants)) - truth);
    }
    let mean = |values: &[f64]| {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count * (count - 1.0))).sqrt())
    };
    let ((stated, spread), (chosen, _)) = (mean(&stated), mean(&chosen));
    println!("stated less true: {stated:.4} ± {spread:.4}; of the groups that chose: {chosen:.4}");
    // Not smaller than the truth; and larger by no more than constants from two thirds of the touches cost.
    assert!(stated > -3.0 * spread && stated < 0.02 + 3.0 * spread, "{stated} ± {spread}");
    assert!(chosen < -0.015, "groups that chose a constant look better than they are: {chosen}");
}

#[test]
fn where_nothing_is_wrong_no_constant_is_added_and_where_a_range_balances_the_nearest_to_0_is() {
    let clear = [ramp(5.0, 0.1, true), ramp(5.0, 0.1, false)];
    assert_eq!(groups(&clear, vec![1], None, [100, 1], 1).balanced(), [0.0]);
    // All are missed by at most 1 nat; the other object could spare 5.
    let shy = [ramp(5.0, 0.1, true), ramp(-1.0, 0.01, false)];
    let constant = groups(&shy, vec![1], None, [2_000, 1], 1).balanced()[0];
    assert!((0.98..1.01).contains(&constant), "{constant}");
}

#[test]
fn groups_without_evidence_recognize_nothing() {
    let held = [vec![None; 10], ramp(1.0, 1.0, false)];
    let drawn = groups(&held, vec![1], None, [10, 5], 1);
    assert_eq!(drawn.named(0, &[0.0]), Named { right: 1.0, wrong: 0.0 });
    assert_eq!(drawn.others(&[0.0]), 0.0);
}

#[test]
fn known_touches_get_the_noise_that_the_ensemble_was_trained_for_once() {
    let [known, _, _] = to_teach(60);
    let ensemble = train(&known, &train::Settings { noise: Noise::gaussian(5_000.0), ..few_trees() }, &()).unwrap();
    let noise = |ensemble: &Ensemble, known: &Dataset| super::check::missing_noise(ensemble, known);
    let added = noise(&ensemble, &known).unwrap();
    let touches = known_touches(&ensemble, &known, &added, 1);
    assert_eq!(touches[0].touches(), Noise::gaussian(5_000.0).add("object0", known.objects[0].touches(), 1));
    let clean = train(&known, &few_trees(), &()).unwrap();
    assert!(noise(&clean, &known).unwrap().is_none());
    assert_eq!(known_touches(&clean, &known, &Noise::default(), 1)[1], known.objects[1]);
    // Touches that have it already get it once only, and other noise is named.
    let real = |deviation| crate::touches::Origin { real: Noise::gaussian(deviation), ..Default::default() };
    let there = Dataset { origin: Some(real(5_000.0)), ..known.clone() };
    assert!(noise(&ensemble, &there).unwrap().is_none());
    let other = Dataset { origin: Some(real(3_000.0)), ..known };
    let error = noise(&ensemble, &other).unwrap_err().to_string();
    assert!(error.contains("noise of 5 ms") && error.contains("noise of 3 ms already"), "{error}");
}
