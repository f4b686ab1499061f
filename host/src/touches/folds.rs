//! Training and test touches that share none: splits and cross-validation.

use crate::error::{Error, Result, TouchesProblem};
use crate::random::{self, Purpose};
use crate::touches::{Dataset, ObjectTouches};
use palpate_shared::Touch;
use rand::seq::SliceRandom;
use std::ops::Range;

/// Splits the touches of every object at random: `test_share` of them for testing, the others for training, at least one
/// for each. The same data set and seed give the same split.
///
/// # Errors
/// [`Setting`](crate::error::Problem::Setting) unless `test_share` is between 0 and 1; [`TouchesProblem::TooFew`] if an
/// object has fewer than two touches.
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
/// an object, give or take one.
///
/// # Errors
/// [`Setting`](crate::error::Problem::Setting) unless there are at least two folds, and `fold` is one of them;
/// [`TouchesProblem::TooFew`] if an object has fewer touches than there are folds.
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
    /// Touches to test on, none of which is in `train`.
    pub test: Dataset,
}

fn enough(dataset: &Dataset, least: usize) -> Result<()> {
    match dataset.objects.iter().find(|object| object.touches.len() < least) {
        Some(object) => {
            Err(TouchesProblem::TooFew { name: object.name.clone(), touches: object.touches.len(), least }.into())
        }
        None => Ok(()),
    }
}

/// Shuffles each object's touches and takes those at the positions that `test` chooses for testing.
fn divide(dataset: &Dataset, seed: u64, test: impl Fn(usize) -> Range<usize>) -> Split {
    let mut split = Split { train: dataset.with(Vec::new()), test: dataset.with(Vec::new()) };
    for ObjectTouches { name, touches } in &dataset.objects {
        let mut order: Vec<usize> = (0..touches.len()).collect();
        order.shuffle(&mut random::generator(seed, Purpose::Folds, name, 0));
        let chosen = test(touches.len());
        let of = |positions: &[usize]| positions.iter().map(|&position| touches[position]).collect::<Vec<Touch>>();
        let train = [of(&order[..chosen.start]), of(&order[chosen.end..])].concat();
        split.train.objects.push(ObjectTouches { name: name.clone(), touches: train });
        split.test.objects.push(ObjectTouches { name: name.clone(), touches: of(&order[chosen]) });
    }
    split
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Problem;
    use crate::touches::Origin;

    /// Objects of which each touch is identified by its own time.
    fn dataset(counts: &[u32]) -> Dataset {
        let object = |(index, &count): (usize, &u32)| ObjectTouches {
            name: format!("object{index}"),
            touches: (0..count).map(|i| Touch::from_micros([0, i, 9])).collect(),
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
            assert_eq!(sorted([&train.touches[..], &test.touches].concat()), sorted(object.touches.clone()));
        }
        let tested: Vec<usize> = split.test.objects.iter().map(|object| object.touches.len()).collect();
        assert_eq!(tested, [10, 1, 1]);
    }

    #[test]
    fn every_touch_is_tested_in_exactly_one_fold() {
        let all = dataset(&[103, 10]);
        let folds: Vec<Split> = (0..10).map(|index| fold(&all, index, 10, 1).unwrap()).collect();
        for (object, touches) in all.objects.iter().enumerate() {
            let tested = folds.iter().flat_map(|fold| fold.test.objects[object].touches.clone());
            assert_eq!(sorted(tested), sorted(touches.touches.clone()));
            for fold in &folds {
                let both = [&fold.train.objects[object].touches[..], &fold.test.objects[object].touches].concat();
                assert_eq!(sorted(both), sorted(touches.touches.clone()));
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
        assert_ne!(sorted(first.test.objects[0].touches.clone()), (0..20).map(Some).collect::<Vec<_>>());
    }

    #[test]
    fn the_parts_of_a_data_set_keep_its_origin() {
        let origin = Origin { seed: 7, ..Origin::default() };
        let split = split(&Dataset { origin: Some(origin.clone()), ..dataset(&[9, 9]) }, 0.1, 1).unwrap();
        assert_eq!((split.train.origin, split.test.origin), (Some(origin.clone()), Some(origin)));
    }

    #[test]
    fn what_cannot_be_split_says_so() {
        for share in [0.0, 1.0, -0.5, f64::NAN] {
            let error = split(&dataset(&[9, 9]), share, 1).unwrap_err();
            assert!(matches!(error.problem(), Some(Problem::Setting { name: "test_share", .. })), "{error}");
            assert_eq!(error.exit_code(), 2);
        }
        let error = split(&dataset(&[9, 1]), 0.1, 1).unwrap_err();
        assert!(error.to_string().contains("object1 has only 1 touches"), "{error}");
        let problem = |result: Result<Split>| result.unwrap_err().problem().cloned();
        let setting = |result| match problem(result) {
            Some(Problem::Setting { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        assert_eq!(setting(fold(&dataset(&[9, 9]), 10, 10, 1)), "fold");
        assert_eq!(setting(fold(&dataset(&[9, 9]), 0, 1, 1)), "folds");
        let few = TouchesProblem::TooFew { name: "object0".into(), touches: 9, least: 10 };
        assert_eq!(problem(fold(&dataset(&[9, 9]), 0, 10, 1)), Some(few.into()));
    }
}
