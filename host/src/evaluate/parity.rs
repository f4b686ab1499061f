//! A compiled model against its ensemble: margins touch by touch, verdicts sequence by sequence.

use crate::ensemble::Ensemble;
use crate::error::{Error, Result};
use crate::progress::{self, Progress};
use crate::touches::Dataset;
use palpate_onboard::{Model, Recognizer, Stopping, Verdict};
use palpate_shared::Touch;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

/// How far two models are apart.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Parity {
    /// How many touches were compared.
    pub touches: usize,
    /// The largest difference of a margin, in nats.
    pub max_margin_error: f64,
    /// The largest difference that the model states, in nats.
    pub stated_bound: f64,
    /// Touches after which another object is the best.
    pub best_differs: usize,
    /// How many random sequences were compared.
    pub sequences: usize,
    /// Sequences with another verdict: another object, or a decision by one model only.
    pub verdict_differs: usize,
    /// Sequences with the same verdict after another number of touches.
    pub touches_differ: usize,
}

/// Holds a compiled model against its ensemble: every touch of a data set, and `sequences` sequences, each of touches
/// drawn at random from one object's until there is a verdict. Both models stop by the compiled model's own rule.
///
/// # Errors
/// When the two are not of the same objects and descriptor.
pub fn parity(
    ensemble: &Ensemble,
    model: &Model<'_>,
    dataset: &Dataset,
    sequences: usize,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Parity> {
    check(ensemble, model)?;
    let touches: Vec<&Touch> = dataset.objects.iter().flat_map(|object| &object.touches).collect();
    progress.begin("margins", Some(touches.len() as u64));
    let compared = touches.par_iter().map(|touch| -> Result<_> {
        progress::advance(progress, 1)?;
        Ok(compare(ensemble, model, touch))
    });
    let (max_margin_error, best_differs) =
        compared.try_reduce(|| (0.0, 0), |(error, differs), (e, d)| Ok((f64::max(error, e), differs + d)))?;
    progress.begin("verdicts", Some(sequences as u64));
    let runs = (0..sequences).into_par_iter().map(|index| -> Result<_> {
        progress::advance(progress, 1)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(index as u64));
        let object = &dataset.objects[rng.random_range(0..dataset.objects.len())];
        let draw = std::iter::repeat_with(|| object.touches[rng.random_range(0..object.touches.len())]);
        Ok(differ(ensemble, model, draw))
    });
    let (verdict_differs, touches_differ) = runs.try_reduce(|| (0, 0), |a, b| Ok((a.0 + b.0, a.1 + b.1)))?;
    Ok(Parity {
        touches: touches.len(),
        max_margin_error,
        stated_bound: f64::from(model.margin_error()),
        best_differs,
        sequences,
        verdict_differs,
        touches_differ,
    })
}

fn check(ensemble: &Ensemble, model: &Model<'_>) -> Result<()> {
    let names = (0..model.object_count()).map(|object| model.object_name(object));
    if model.descriptor() != Some(ensemble.descriptor) || !names.eq(ensemble.objects.iter().map(String::as_str)) {
        return Err(Error::data(
            "the model was not compiled from this ensemble: its objects or its descriptor are others",
            "Give the ensemble that the model was exported from.",
        ));
    }
    Ok(())
}

/// The largest difference of a margin of a touch, and 1 if another object is the best.
fn compare(ensemble: &Ensemble, model: &Model<'_>, touch: &Touch) -> (f64, usize) {
    let full = ensemble.margins(touch);
    let mut margins = [0; 256];
    model.margins(touch, &mut margins);
    let compiled = &margins[..full.len()];
    let unit = f64::from(model.unit());
    let errors = full.iter().zip(compiled).map(|(full, &int)| (f64::from(*full) - f64::from(int) * unit).abs());
    let differs = best(&full) != best(compiled);
    (errors.fold(0.0, f64::max), usize::from(differs))
}

/// Whether the verdicts differ (1, 0), or only the numbers of touches (0, 1).
fn differ(ensemble: &Ensemble, model: &Model<'_>, mut draw: impl Iterator<Item = Touch>) -> (usize, usize) {
    let stopping = Stopping::from_model(model);
    let Ok(mut compiled) = Recognizer::<256>::new(model, stopping) else { return (0, 0) };
    let mut full = FullRecognizer::new(ensemble, model, stopping);
    // Both take the same touches for as long as one of them wants more; afterwards each keeps its verdict.
    while let Some(touch) = draw.next()
        && (compiled.verdict() == Verdict::Undecided || full.verdict == Verdict::Undecided)
    {
        // What the model was not trained for is not counted by either.
        if compiled.push(&touch).is_ok() {
            full.push(&touch);
        }
    }
    match (compiled.verdict(), full.verdict) {
        (a, b) if a == b => (0, 0),
        (Verdict::Recognized { object: a, .. }, Verdict::Recognized { object: b, .. }) if a == b => (0, 1),
        _ => (1, 0),
    }
}

/// The full model's recognizer: f32 margins, evidence in f64, the same rule for stopping.
struct FullRecognizer<'a> {
    ensemble: &'a Ensemble,
    stopping: Stopping,
    evidence: Vec<f64>,
    touches: u32,
    verdict: Verdict,
}

impl<'a> FullRecognizer<'a> {
    fn new(ensemble: &'a Ensemble, model: &Model<'_>, stopping: Stopping) -> Self {
        let prior = |object| f64::from(model.prior(object)) * f64::from(model.unit());
        let evidence = (0..ensemble.objects.len()).map(prior).collect();
        Self { ensemble, stopping, evidence, touches: 0, verdict: Verdict::Undecided }
    }

    fn push(&mut self, touch: &Touch) {
        if self.verdict != Verdict::Undecided {
            return;
        }
        for (evidence, margin) in self.evidence.iter_mut().zip(self.ensemble.margins(touch)) {
            *evidence += f64::from(margin);
        }
        self.touches += 1;
        let best = best(&self.evidence);
        let rivals = self.evidence.iter().enumerate().filter(|(object, _)| *object != best);
        let weights: f64 = rivals.map(|(_, evidence)| (evidence - self.evidence[best]).exp()).sum();
        let rate = self.stopping.error_rate();
        if weights <= rate / (1.0 - rate) {
            self.verdict = Verdict::Recognized { object: best as u8, touches: self.touches };
        } else if self.touches >= self.stopping.max_touches() {
            self.verdict = Verdict::Unknown;
        }
    }
}

/// The first of the largest.
fn best<T: PartialOrd + Copy>(values: &[T]) -> usize {
    (0..values.len()).fold(0, |best, index| if values[index] > values[best] { index } else { best })
}
