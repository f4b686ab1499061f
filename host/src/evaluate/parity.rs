//! A compiled model compared with its ensemble: margins touch by touch, verdicts sequence by sequence.

use super::margins::{OfTouches, row};
use super::together::margins_of_touches;
use super::unfit::{raw_features, too_many_objects};
use crate::ensemble::{Ensemble, OverTouches};
use crate::error::{Error, Result, problem};
use crate::evidence::{Drawer, best};
use crate::progress::{self, Progress};
use crate::random::Purpose;
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::{Model, Recognizer, Refused, Stopping, Verdict};
use palpate_shared::Touch;
use palpate_trees::verify::plain::{Ended, Plain};
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
/// touches drawn at random from those of one object's source, such as an instance, until there is a verdict. The ensemble's
/// margins are added up in [plain numbers](Plain), none of which the chip's code computes, and stop by the compiled model's own
/// rule.
///
/// # Errors
/// When the two are not of the same objects and descriptor, their margins differ by more than the model
/// states (it was exported from another ensemble), a posterior or a verdict of the chip's code differs from the plain one by more
/// than that explains, or an object of the data set has no touches; [`Kind::Cancelled`](crate::error::Kind::Cancelled).
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
    let delivered = model.delivered(dataset);
    let dataset = delivered.as_ref();
    let touches: Vec<&Touch> = dataset.touches().collect();
    check(ensemble, model)?;
    let full = margins_of_ensemble(ensemble, &touches, progress)?;
    let compiled = margins_of_touches(model, &touches);
    let Difference { max_margin_error, best_differs } = largest(model, &full, &compiled);
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
        let mut rng = Drawer { purpose: Purpose::Sequences, name: "", seed }.random(index as u64);
        let object = rng.random_range(0..dataset.objects.len());
        let pools = dataset.objects[object].pools();
        let pool = &pools[index % pools.len()].range;
        let draw = std::iter::repeat_with(|| {
            let index = firsts[object] + rng.random_range(pool.clone());
            let row = row(index, model.object_count());
            is_evidence[index].then(|| (&full[row.clone()], &compiled[row]))
        });
        compare_verdicts::<CAPACITY>(model, draw)
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

/// The ensemble's margins of touches, row by row.
fn margins_of_ensemble(ensemble: &Ensemble, touches: &[&Touch], progress: &dyn Progress) -> Result<Vec<f32>> {
    progress.begin("margins", Some(touches.len() as u64));
    let objects = ensemble.objects.len();
    let mut values = vec![0.0; objects * touches.len()];
    values.par_chunks_mut(objects).zip(touches).try_for_each(|(row, touch)| -> Result<()> {
        progress::advance(progress, 1)?;
        row.copy_from_slice(&ensemble.margins(touch));
        Ok(())
    })?;
    Ok(values)
}

/// The largest difference of the margins of all touches.
fn largest(model: &Model<'_>, full: &[f32], compiled: &[i32]) -> Difference {
    let rows = full.par_chunks_exact(model.object_count()).zip(compiled.par_chunks_exact(model.object_count()));
    rows.map(|(full, compiled)| compare_margins(full, model, compiled)).reduce(Difference::default, Difference::worse)
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
    let full = margins_of_ensemble(ensemble, touches, progress)?;
    Ok(largest(model, &full, &margins_of_touches(model, touches)))
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
/// When the model has more than `N` objects, or rounding explains no difference as large as that.
fn compare_verdicts<'t, const N: usize>(
    model: &Model<'_>,
    mut draw: impl Iterator<Item = Option<(&'t [f32], &'t [i32])>>,
) -> Result<(usize, usize)> {
    let stopping = Stopping::from_model(model);
    let mut chip = Recognizer::<N>::new(model, stopping).map_err(too_many_objects)?;
    let mut plain = plain(model, stopping);
    // Both take the same touches for as long as one of them wants more; afterwards each keeps its verdict. Where hardly
    // any touch is one that the model was trained for, there may never be a verdict.
    let mut draws = 100 * u64::from(stopping.max_touches());
    while let Some(margins) = draw.next()
        && draws > 0
        && (chip.verdict() == Verdict::Undecided || plain.ended.is_none())
    {
        draws -= 1;
        if let Some((of_full, of_compiled)) = margins {
            let takes_more = chip.verdict() == Verdict::Undecided;
            chip.push_margins(of_compiled);
            plain.push(of_full);
            if takes_more {
                check_decision(model, &chip, &plain)?;
            }
        }
    }
    Ok(match (chip.verdict(), plain.ended) {
        (Verdict::Undecided, None) | (Verdict::GaveUp, Some(Ended { named: None, .. })) => (0, 0),
        (Verdict::Recognized { object, touches, .. }, Some(Ended { named: Some(named), steps }))
            if usize::from(object) == named =>
        {
            (0, usize::from(touches != steps))
        }
        _ => (1, 0),
    })
}

/// A model's recognizer in plain numbers.
fn plain(model: &Model<'_>, stopping: Stopping) -> Plain {
    let outputs = 0..model.object_count();
    let object = |output: usize| match model.outputs().and_then(|outputs| outputs.object(output)) {
        Some(object) => object.into(),
        // An object of its own, as a background is.
        None => CAPACITY + output,
    };
    Plain {
        evidence: outputs.clone().map(|output| f64::from(model.prior(output)) * f64::from(model.unit())).collect(),
        objects: outputs.clone().map(object).collect(),
        known: model.known_count(),
        thresholds: outputs.map(|output| stopping.odds_of(output, model) as f64 / (1_u64 << 56) as f64).collect(),
        most: stopping.max_touches(),
        steps: 0,
        ended: None,
    }
}

/// Weights and probabilities up to which the chip does not tell them apart.
const RESOLUTION: f64 = 1e-14;
/// The share of a weight, as a logarithm, by which the chip's exponential and its temperature may be off.
const ARITHMETIC: f64 = 1e-3;

/// Refuses a posterior or a verdict of the chip's code that is farther from that in plain numbers than rounded margins explain.
fn check_decision<const N: usize>(model: &Model<'_>, chip: &Recognizer<'_, N>, plain: &Plain) -> Result<()> {
    let beyond = |weight: f64, other: f64| ((weight + RESOLUTION) / (other + RESOLUTION)).ln();
    // Each touch may put both of two margins off by the error that the model states.
    let rounded = 2.0 * f64::from(plain.steps) * f64::from(model.margin_error());
    let named = match chip.verdict() {
        Verdict::Recognized { object, .. } => Some(usize::from(object)),
        _ => None,
    };
    let output = named.unwrap_or_else(|| chip.best());
    let temperature = model.temperature().value();
    let posterior = chip.posterior_together(output).0;
    let rivals = plain.rivals(output, temperature);
    let expected = 1.0 / (1.0 + rivals);
    let against = if rivals > 1.0 { 1.0 - expected } else { rivals * expected };
    let off = beyond(posterior.complement(), posterior.to_f64()) - beyond(against, expected);
    let is_off = off.abs() > rounded / temperature + ARITHMETIC;
    let above = beyond(plain.rivals(output, 1.0), plain.thresholds[output]);
    // A test of strangers holds names back, and plain numbers have none.
    let has_test = model.strangers().is_some_and(|strangers| strangers.test.is_some());
    let is_odd = match named {
        Some(_) => above > rounded + ARITHMETIC,
        None => above < -rounded - ARITHMETIC && !has_test,
    };
    if is_off || is_odd {
        Err(wrong_decision(model, output, plain.steps, [posterior.to_f64(), expected]))
    } else {
        Ok(())
    }
}

/// The problem of code of the chip that decides wrongly.
fn wrong_decision(model: &Model<'_>, output: usize, touches: u32, [found, expected]: [f64; 2]) -> Error {
    let object = model.object_name(output);
    problem!(
        "after {touches} touches the chip's code gives {object} a posterior of {found:.6}, and a plain sum of the ensemble's \
         margins {expected:.6}, or its verdict does not follow from that: rounding does not explain it"
    )
    .fix("Export the model again with this version of palpate, and report it if that does not help.")
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
        let error = error(compare_verdicts::<2>(&model, touches()));
        assert_eq!(error, "the model has 3 objects, and the recognizer has room for 2");
        assert_eq!(compare_verdicts::<3>(&model, touches()).unwrap(), (0, 0));
    }

    #[test]
    fn a_decision_that_rounding_does_not_explain_is_an_error() {
        let ensemble = ensemble();
        let bytes = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
        let model = compile::open(&bytes).unwrap();
        let touches = synthetic::dataset(&[20, 20, 20], 3);
        for touch in touches.touches() {
            let full = ensemble.margins(touch);
            let mut compiled = [0; 3];
            model.margins(touch, &mut compiled);
            let both = |compiled: &[i32; 3]| {
                let (full, compiled) = (full.clone(), *compiled);
                compare_verdicts::<3>(&model, std::iter::repeat(Some((&full[..], &compiled[..]))))
            };
            assert_eq!(both(&compiled).unwrap(), (0, 0));
            // A hundredth of a nat more than the chip's margins are off by.
            let more = ((f64::from(model.margin_error()) * 2.0 + 0.01) / f64::from(model.unit())) as i32;
            compiled[1] += more;
            assert!(error(both(&compiled)).contains("a plain sum of the ensemble's margins"));
        }
    }

    #[test]
    fn the_chips_decisions_follow_from_plain_sums_of_the_ensembles_margins() {
        let ensemble = ensemble();
        let bytes = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
        let model = compile::open(&bytes).unwrap();
        // Few touches go down the trees one by one, many together.
        for count in [5, 100] {
            let found = parity(&ensemble, &model, &synthetic::dataset(&[count; 3], 1), 200, 1, &()).unwrap();
            assert_eq!((found.verdict_differs, found.touches_differ), (0, 0), "{found:?}");
        }
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
