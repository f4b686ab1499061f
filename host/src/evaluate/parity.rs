//! A compiled model compared with its ensemble: margins touch by touch, verdicts sequence by sequence.

use super::Candidate;
use super::full::FullRecognizer;
use super::margins::{OfTouches, best, row};
use super::together::margins_of_touches;
use super::unfit::{raw_features, too_many_objects};
use crate::ensemble::{Ensemble, OverTouches};
use crate::error::{Result, problem};
use crate::evidence::Follower;
use crate::progress::{self, Progress};
use crate::random::{self, Purpose};
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use palpate_shared::Touch;
use rand::RngExt;
use rayon::prelude::*;

/// Distance between two models.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Parity {
    /// Number of touches compared.
    pub touches: usize,
    /// The largest difference of a margin, in nats.
    pub max_margin_error: f64,
    /// The largest difference that the model states, in nats.
    pub stated_bound: f64,
    /// Touches after which another object is the best.
    pub best_differs: usize,
    /// Number of random sequences compared.
    pub sequences: usize,
    /// Sequences with another verdict: another object, or a decision by one model only.
    pub verdict_differs: usize,
    /// Sequences with the same verdict after another number of touches.
    pub touches_differ: usize,
}

/// Room for the objects of any model.
const CAPACITY: usize = 256;

/// Compares a compiled model with its ensemble: on every touch of a data set, and on `sequences` sequences, each of
/// touches drawn at random from those of one object's source, such as an instance, until there is a verdict. Both models stop by the compiled model's own rule.
///
/// # Errors
/// When the two are not of the same objects and descriptor, their margins differ by more than the model
/// states (it was exported from another ensemble), or an object of the data set has no touches; [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn parity(
    ensemble: &Ensemble,
    model: &Model<'_>,
    dataset: &Dataset,
    sequences: usize,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Parity> {
    if dataset.objects.is_empty() || dataset.objects.iter().any(ObjectTouches::is_empty) {
        return Err(
            problem!("there are no touches to compare the models on").fix("Give at least one touch of each object.")
        );
    }
    let delivered = Candidate::Compiled(model).delivered(dataset);
    let dataset = delivered.as_ref();
    let touches: Vec<&Touch> = dataset.touches().collect();
    check(ensemble, model)?;
    let full = FullMargins::new(ensemble, &touches, progress)?;
    let compiled = margins_of_touches(model, &touches);
    let objects = model.object_count();
    let rows = compiled.par_chunks_exact(objects).enumerate();
    let margins = rows.map(|(index, compiled)| compare_margins(full.of(index), model, compiled));
    let Difference { max_margin_error, best_differs } = margins.reduce(Difference::default, Difference::worse);
    let stated_bound = f64::from(model.margin_error());
    if max_margin_error > stated_bound {
        return Err(problem!(
            "not exported from this ensemble: margins differ by up to {max_margin_error:.2e} nats, where the model states \
             {stated_bound:.2e} at most"
        )
        .fix(OTHER_ENSEMBLE));
    }
    // Sequences draw the same touches again and again: whether each is evidence, and its margins, are found once.
    let trained = model.trained_touches();
    let is_evidence: Vec<bool> = touches.iter().map(|touch| Refused::check(&trained, touch).is_ok()).collect();
    let firsts: Vec<usize> =
        dataset.objects.iter().scan(0, |next, object| Some(std::mem::replace(next, *next + object.len()))).collect();
    progress.begin("verdicts", Some(sequences as u64));
    let runs = (0..sequences).into_par_iter().map(|index| -> Result<_> {
        progress::advance(progress, 1)?;
        let mut rng = random::generator(seed, Purpose::Sequences, "", index as u64);
        let object = rng.random_range(0..dataset.objects.len());
        let pools = dataset.objects[object].pools();
        let pool = &pools[index % pools.len()].range;
        let draw = std::iter::repeat_with(|| {
            let index = firsts[object] + rng.random_range(pool.clone());
            is_evidence[index].then(|| (full.of(index), &compiled[row(index, objects)]))
        });
        compare_verdicts::<CAPACITY>(ensemble, model, draw)
    });
    let (verdict_differs, touches_differ) = runs.try_reduce(|| (0, 0), |a, b| Ok((a.0 + b.0, a.1 + b.1)))?;
    Ok(Parity {
        touches: touches.len(),
        max_margin_error,
        stated_bound,
        best_differs,
        sequences,
        verdict_differs,
        touches_differ,
    })
}

/// Distance between the margins of two models.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// The largest difference of a margin, in nats.
    pub max_margin_error: f64,
    /// Touches after which another object is the best.
    pub best_differs: usize,
}

impl Difference {
    fn worse(self, other: Self) -> Self {
        Self {
            max_margin_error: self.max_margin_error.max(other.max_margin_error),
            best_differs: self.best_differs + other.best_differs,
        }
    }
}

/// The full model's margins of every touch of a data set. Sequences draw the same touches again and again.
struct FullMargins {
    objects: usize,
    /// Row by row, one row per touch.
    values: Vec<f32>,
}

impl FullMargins {
    fn new(ensemble: &Ensemble, touches: &[&Touch], progress: &dyn Progress) -> Result<Self> {
        progress.begin("margins", Some(touches.len() as u64));
        let objects = ensemble.objects.len();
        let mut values = vec![0.0; objects * touches.len()];
        values.par_chunks_mut(objects).zip(touches).try_for_each(|(row, touch)| -> Result<()> {
            progress::advance(progress, 1)?;
            row.copy_from_slice(&ensemble.margins(touch));
            Ok(())
        })?;
        Ok(Self { objects, values })
    }

    fn of(&self, touch: usize) -> &[f32] {
        &self.values[touch * self.objects..(touch + 1) * self.objects]
    }
}

/// Compares a compiled model's margins with its ensemble's, touch by touch, on all threads.
///
/// # Errors
/// When the two are not of the same objects and descriptor, or over rows; [`Kind::Cancelled`](crate::error::Kind::Cancelled).
pub fn difference(
    ensemble: &Ensemble,
    model: &Model<'_>,
    touches: &[&Touch],
    progress: &dyn Progress,
) -> Result<Difference> {
    check(ensemble, model)?;
    progress.begin("margins", Some(touches.len() as u64));
    let compiled = margins_of_touches(model, touches);
    let compiled = compiled.par_chunks_exact(model.object_count());
    let compared = touches.par_iter().zip(compiled).map(|(touch, compiled)| -> Result<_> {
        progress::advance(progress, 1)?;
        Ok(compare_margins(&ensemble.margins(touch), model, compiled))
    });
    compared.try_reduce(Difference::default, |a, b| Ok(a.worse(b)))
}

/// Remedy for a model of another ensemble.
const OTHER_ENSEMBLE: &str = "Give the ensemble that the model was exported from.";

fn check(ensemble: &Ensemble, model: &Model<'_>) -> Result<()> {
    if ensemble.descriptor().is_none() {
        return Err(raw_features());
    }
    let names = (0..model.object_count()).map(|object| model.object_name(object));
    if model.descriptor() != ensemble.descriptor() || !names.eq(ensemble.objects.iter().map(String::as_str)) {
        return Err(problem!("the model was not compiled from this ensemble: its objects or its descriptor differ")
            .fix(OTHER_ENSEMBLE));
    }
    Ok(())
}

fn compare_margins(full: &[f32], model: &Model<'_>, compiled: &[i32]) -> Difference {
    let unit = f64::from(model.unit());
    let errors = full.iter().zip(compiled).map(|(full, &int)| (f64::from(*full) - f64::from(int) * unit).abs());
    let best_differs = usize::from(best(full) != best(compiled));
    Difference { max_margin_error: errors.fold(0.0, f64::max), best_differs }
}

/// Compares two verdicts: (1, 0) if they differ, (0, 1) if only the numbers of touches do. `draw` gives each touch's
/// margins by the full and by the compiled model, and nothing for a touch that the model was not trained for: it is not
/// counted by either.
///
/// # Errors
/// When the model has more than `N` objects.
fn compare_verdicts<'t, const N: usize>(
    ensemble: &Ensemble,
    model: &Model<'_>,
    mut draw: impl Iterator<Item = Option<(&'t [f32], &'t [i32])>>,
) -> Result<(usize, usize)> {
    let stopping = Stopping::from_model(model);
    let mut compiled = Recognizer::<N>::new(model, stopping).map_err(too_many_objects)?;
    let prior = |object| f64::from(model.prior(object)) * f64::from(model.unit());
    let priors = (0..ensemble.objects.len()).map(prior).collect();
    let mut full = {
        let numbers = model.outputs().map(|outputs| outputs.objects().collect());
        FullRecognizer::new(priors, (ensemble.known_count(), numbers), stopping, Some(model))
    };
    // Both take the same touches for as long as one of them wants more; afterwards each keeps its verdict. Where hardly
    // any touch is one that the model was trained for, there may never be a verdict.
    let mut draws = 100 * u64::from(stopping.max_touches());
    while let Some(margins) = draw.next()
        && draws > 0
        && (compiled.verdict() == Verdict::Undecided || full.verdict == Verdict::Undecided)
    {
        draws -= 1;
        if let Some((of_full, of_compiled)) = margins {
            compiled.push_margins(of_compiled);
            full.push(of_full);
        }
    }
    Ok(match (compiled.verdict(), full.verdict) {
        (a, b) if a == b => (0, 0),
        (
            Verdict::Recognized { object: a, touches: first, .. },
            Verdict::Recognized { object: b, touches: second, .. },
        ) if a == b => (0, usize::from(first != second)),
        _ => (1, 0),
    })
}

#[cfg(all(test, feature = "train"))]
mod tests {
    use super::*;
    use crate::compile::{self, compile};
    use crate::ensemble::train::{self, train};

    use crate::tests::synthetic;

    fn ensemble() -> Ensemble {
        let settings = train::Settings { rounds: 5, depth: 3, ..train::Settings::compact() };
        train(&synthetic::dataset(&[200, 200, 200], 1), &settings, &()).unwrap()
    }

    fn error<T>(result: Result<T>) -> String {
        result.err().unwrap().what().to_owned()
    }

    #[test]
    fn verdicts_that_no_recognizer_has_room_for_are_an_error_and_not_equal() {
        let ensemble = ensemble();
        let bytes = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
        let model = compile::open(&bytes).unwrap();
        let touch = Touch::from_micros([0, 0, 9]);
        let margins = ensemble.margins(&touch);
        let mut compiled = [0; 3];
        model.margins(&touch, &mut compiled);
        let touches = || std::iter::repeat(Some((&margins[..], &compiled[..])));
        let error = error(compare_verdicts::<2>(&ensemble, &model, touches()));
        assert_eq!(error, "the model has 3 objects, and the recognizer has room for 2");
        assert_eq!(compare_verdicts::<3>(&ensemble, &model, touches()).unwrap(), (0, 0));
    }

    #[test]
    fn parity_on_an_empty_data_set_is_an_error_and_no_panic() {
        let ensemble = ensemble();
        let bytes = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
        let model = compile::open(&bytes).unwrap();
        for counts in [&[][..], &[0, 0], &[5, 0]] {
            let dataset = synthetic::dataset(counts, 1);
            let error = error(parity(&ensemble, &model, &dataset, 10, 1, &()));
            assert_eq!(error, "there are no touches to compare the models on");
        }
    }

    #[test]
    fn an_ensemble_of_the_same_objects_that_the_model_was_not_exported_from_is_refused() {
        let ensemble = ensemble();
        let other = train(
            &synthetic::dataset(&[200, 200, 200], 2),
            &train::Settings { rounds: 5, depth: 3, ..train::Settings::compact() },
            &(),
        );
        let bytes = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
        let model = compile::open(&bytes).unwrap();
        let dataset = synthetic::dataset(&[50, 50, 50], 3);
        let error = parity(&other.unwrap(), &model, &dataset, 10, 1, &()).unwrap_err();
        assert!(error.to_string().contains("not exported from this ensemble: margins differ by up to"), "{error}");
        assert_eq!(error.exit_code(), 1);
        assert!(parity(&ensemble, &model, &dataset, 10, 1, &()).is_ok());
    }

    #[test]
    fn another_ensembles_model_is_refused() {
        let ensemble = ensemble();
        let other = Ensemble { objects: ["a", "b", "c"].map(String::from).into(), ..ensemble.clone() };
        let bytes = compile(&other, &compile::Settings::default()).unwrap().bytes;
        let model = compile::open(&bytes).unwrap();
        let dataset = synthetic::dataset(&[5, 5, 5], 1);
        let error = error(parity(&ensemble, &model, &dataset, 10, 1, &()));
        assert!(error.starts_with("the model was not compiled from this ensemble"), "{error}");
    }
}
