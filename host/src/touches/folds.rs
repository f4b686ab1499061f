//! Training and test touches that share none: splits and cross-validation.

use crate::error::{Error, Result, problem};
use crate::random::{self, Purpose};
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Touch;
use rand::seq::SliceRandom;
use std::ops::Range;

/// Splits the touches of every object at random: `test_share` of them for testing, the others for training, at least one
/// for each. Every instance or recording of an object gives the same share, give or take a touch. The same data set and
/// seed give the same split.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) unless `test_share` is between 0 and 1; when an object has fewer than two touches.
pub fn split(dataset: &Dataset, test_share: f64, seed: u64) -> Result<Split> {
    if !(test_share > 0.0 && test_share < 1.0) {
        return Err(Error::setting("test_share", test_share, "a number between 0 and 1"));
    }
    enough(dataset, 2)?;
    Ok(divide(dataset, seed, |touches| {
        // Rounded to the nearest whole touch; `as` saturates.
        let test = (touches as f64 * test_share).round() as usize;
        0..test.clamp(1, touches - 1)
    }))
}

/// Fold `fold` of `folds`: every touch is a test touch in exactly one fold, and every fold tests equally many touches of
/// an object, give or take one; so it is with each of its instances or recordings, give or take two.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) unless there are at least two folds, and `fold` is one of them; when an
/// object has fewer touches than there are folds.
pub fn fold(dataset: &Dataset, fold: usize, folds: usize, seed: u64) -> Result<Split> {
    if folds < 2 {
        return Err(Error::setting("folds", folds, "2 or more"));
    }
    if fold >= folds {
        return Err(Error::setting("fold", fold, format!("0 to {}", folds - 1)));
    }
    enough(dataset, folds)?;
    Ok(divide(dataset, seed, |touches| touches * fold / folds..touches * (fold + 1) / folds))
}

/// Training and test touches of the same objects.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// Touches to train on.
    pub train: Dataset,
    /// Touches to test on; none is in `train`.
    pub test: Dataset,
}

fn enough(dataset: &Dataset, least: usize) -> Result<()> {
    match dataset.objects.iter().find(|object| object.len() < least) {
        Some(object) => Err(problem!("{} has only {} touches, too few to split", object.name, object.len())
            .fix(format!("Capture at least {least} touches of each object."))),
        None => Ok(()),
    }
}

/// Shuffles each object's touches and takes those at the positions that `test` chooses for testing.
fn divide(dataset: &Dataset, seed: u64, test: impl Fn(usize) -> Range<usize>) -> Split {
    let parts = dataset.objects.iter().map(|object| {
        let order = shuffled(object, seed);
        let Range { start, end } = test(order.len());
        (picked(object, order[..start].iter().chain(&order[end..])), picked(object, &order[start..end]))
    });
    let (train, test) = parts.unzip();
    let with = |objects| Dataset { objects, origin: dataset.origin.clone(), warnings: Vec::new() };
    Split { train: with(train), test: with(test) }
}

/// The object with these touches, each with the number of its pool.
fn picked<'t>(object: &ObjectTouches, touches: impl IntoIterator<Item = &'t (usize, Touch)>) -> ObjectTouches {
    let mut pools = vec![Vec::new(); object.pools().len()];
    touches.into_iter().for_each(|(pool, touch)| pools[*pool].push(*touch));
    let mut pools = pools.into_iter();
    object.each_pool(|_, _| pools.next().unwrap_or_default())
}

/// An object's touches, each with the number of its pool: those of each pool in a random order, spread evenly over the whole, so
/// that any stretch has the same share of each pool.
fn shuffled(object: &ObjectTouches, seed: u64) -> Vec<(usize, Touch)> {
    let mut order = Vec::with_capacity(object.len());
    for (number, pool) in object.pools().iter().enumerate() {
        let mut touches = object.of_pool(pool).to_vec();
        touches.shuffle(&mut random::generator(seed, Purpose::Folds, &object.name, number as u64));
        let all = touches.len() as u128;
        let place = |(rank, touch): (usize, Touch)| ((2 * rank as u128 + 1, all), (number, touch));
        order.extend(touches.into_iter().enumerate().map(place));
    }
    // By (rank + ½) / number, as fractions.
    order.sort_by(|(a, (one, _)), (b, (other, _))| (a.0 * b.1).cmp(&(b.0 * a.1)).then(one.cmp(other)));
    order.into_iter().map(|(_, touch)| touch).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Kind;
    use crate::touches::{Origin, Source};

    /// Objects whose touches are each identified by their own time.
    fn dataset(counts: &[u32]) -> Dataset {
        let object = |(index, &count): (usize, &u32)| {
            let touches = (0..count).map(|i| Touch::from_micros([0, i, 9])).collect();
            ObjectTouches::new(format!("object{index}"), touches, Source::Object)
        };
        Dataset::new(counts.iter().enumerate().map(object).collect())
    }

    fn sorted(touches: impl IntoIterator<Item = Touch>) -> Vec<Option<u32>> {
        let mut times: Vec<_> = touches.into_iter().map(|touch| touch.times()[1].micros()).collect();
        times.sort_unstable();
        times
    }

    #[test]
    fn a_split_shares_no_touch_and_loses_none() {
        let all = dataset(&[100, 7, 2]);
        let split = split(&all, 0.1, 1).unwrap();
        for ((train, test), object) in split.train.objects.iter().zip(&split.test.objects).zip(&all.objects) {
            assert_eq!(sorted([train.touches(), test.touches()].concat()), sorted(object.touches().to_vec()));
        }
        let tested: Vec<usize> = split.test.objects.iter().map(|object| object.len()).collect();
        assert_eq!(tested, [10, 1, 1]);
    }

    #[test]
    fn every_touch_is_tested_in_exactly_one_fold() {
        let all = dataset(&[103, 10]);
        let folds: Vec<Split> = (0..10).map(|index| fold(&all, index, 10, 1).unwrap()).collect();
        for (object, touches) in all.objects.iter().enumerate() {
            let tested = folds.iter().flat_map(|fold| fold.test.objects[object].touches().to_vec());
            assert_eq!(sorted(tested), sorted(touches.touches().to_vec()));
            for fold in &folds {
                let both = [fold.train.objects[object].touches(), fold.test.objects[object].touches()].concat();
                assert_eq!(sorted(both), sorted(touches.touches().to_vec()));
            }
        }
    }

    #[test]
    fn seeds_choose_the_split_and_the_order_does_not_leak() {
        let all = dataset(&[200, 200]);
        assert_eq!(split(&all, 0.1, 1).unwrap(), split(&all, 0.1, 1).unwrap());
        let first = split(&all, 0.1, 1).unwrap();
        assert_ne!(first, split(&all, 0.1, 2).unwrap());
        // Sweeps along an object would make neighbors alike: the test touches must not be a block.
        assert_ne!(sorted(first.test.objects[0].touches().to_vec()), (0..20).map(Some).collect::<Vec<_>>());
    }

    #[test]
    fn the_parts_of_a_data_set_keep_its_origin() {
        let origin = Origin { seed: 7, ..Origin::default() };
        let split = split(&Dataset { origin: Some(origin.clone()), ..dataset(&[9, 9]) }, 0.1, 1).unwrap();
        assert_eq!((split.train.origin, split.test.origin), (Some(origin.clone()), Some(origin)));
    }

    #[test]
    fn a_split_does_not_forget_which_touch_is_of_which_instance() {
        let names: Vec<String> = ["mug", "cup", "bowl"].map(String::from).into();
        let touches = |count: u32| (0..count).map(|i| Touch::from_micros([0, i, 9])).collect::<Vec<_>>();
        let vessel = ObjectTouches::in_turn("vessel", touches(300), &names, 0);
        let logs = [("first", 0..200), ("second", 200..250)];
        let logs = logs.map(|(log, times)| (Source::Log(log.into()), None, touches(250)[times].to_vec()));
        let all = Dataset::new(vec![ObjectTouches::of_parts("fork", logs), vessel]);
        let parts = (0..5).flat_map(|index| {
            let Split { train, test } = fold(&all, index, 5, 1).unwrap();
            [(train, 4), (test, 1)]
        });
        let Split { train, test } = split(&all, 0.2, 1).unwrap();
        for (part, fifths) in parts.chain([(train, 4), (test, 1)]) {
            for (object, whole) in part.objects.iter().zip(&all.objects) {
                for (pool, all_of) in object.pools().iter().zip(whole.pools()) {
                    assert_eq!(pool.source, all_of.source);
                    let [own, all] = [object.of_pool(pool), whole.of_pool(all_of)];
                    assert!(own.iter().all(|touch| all.contains(touch)));
                    assert!(own.len().abs_diff(all.len() * fifths / 5) <= 1, "{fifths} fifths");
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_split_says_so() {
        for share in [0.0, 1.0, -0.5, f64::NAN] {
            let error = split(&dataset(&[9, 9]), share, 1).unwrap_err();
            assert!(matches!(error.kind(), Kind::Setting { name: "test_share", .. }), "{error}");
            assert_eq!(error.exit_code(), 2);
        }
        let error = split(&dataset(&[9, 1]), 0.1, 1).unwrap_err();
        assert!(error.to_string().contains("object1 has only 1 touches"), "{error}");
        let setting = |result: Result<Split>| match result.unwrap_err().kind() {
            Kind::Setting { name, .. } => *name,
            other => panic!("{other:?}"),
        };
        assert_eq!(setting(fold(&dataset(&[9, 9]), 10, 10, 1)), "fold");
        assert_eq!(setting(fold(&dataset(&[9, 9]), 0, 1, 1)), "folds");
        let error = fold(&dataset(&[9, 9]), 0, 10, 1).unwrap_err().to_string();
        assert!(error.contains("object0 has only 9 touches") && error.contains("at least 10 touches"), "{error}");
    }
}
