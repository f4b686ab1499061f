//! An ensemble of recorded touches and nothing else.

use super::balance::Held;
use super::held_out::{Division, loss, places, repeated};
use super::{JITTERS, Settings, Smoothing, Taught, TaughtObject, check, on_threads};
use crate::ensemble::train::{self, train};
use crate::ensemble::{Ensemble, OverTouches, TouchOrigin};
use crate::error::Result;
use crate::progress::{self, Progress};
use crate::touches::{Dataset, ObjectTouches, Source};
use palpate_onboard::Refused;
use palpate_shared::Touch;
use palpate_shared::format::Counted;
use palpate_shared::format::TrainedTouches;

/// Division by which jitters are compared and errors counted. Trees are grown for each part.
const COMPARED: Division = Division { parts: 5, used: 4 };

/// Trains an ensemble on the objects of `recorded` alone. Its touches are repeated under jitter, and how much is chosen by
/// cross-validation, one jitter for all objects: the figures come from the touches that chose it among three. There are
/// no constants: no object has been seen much more than others.
/// The noise of `training` is not added, since the touches have their own.
///
/// # Errors
/// Errors of [`train`](fn@train) and [`teach`](fn@super::teach).
pub fn alone(
    recorded: &Dataset,
    training: &train::Settings,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Ensemble, Taught)> {
    check::settings(settings)?;
    let training = train::Settings { threads: None, ..training.resolved(recorded) };
    check::approaches(training.counted.unwrap_or(Counted::Full), recorded)?;
    check::poses(training.descriptor, recorded)?;
    let all = recorded.objects.len();
    on_threads(settings.threads, || {
        let places: Vec<Vec<f64>> =
            recorded.objects.iter().map(|object| places(&object.name, object.len(), settings.seed)).collect();
        let fitted = |jitter: f64, is_used: &dyn Fn(f64) -> bool| -> Result<Ensemble> {
            let object = |(object, places): (&ObjectTouches, &Vec<f64>)| {
                let used = object.touches().iter().zip(places).filter(|(_, place)| is_used(**place));
                let used: Vec<Touch> = used.map(|(touch, _)| *touch).collect();
                // Copies to train on; no sequence is drawn from them.
                let touches = repeated(&object.name, &used, jitter, settings.seed);
                ObjectTouches::new(&object.name, touches, Source::Object)
            };
            let objects = recorded.objects.iter().zip(&places).map(object).collect();
            train(&Dataset { origin: recorded.origin.clone(), ..Dataset::new(objects) }, &training, &())
        };
        let held_out = |jitter: f64| -> Result<Vec<Held>> {
            let mut held: Vec<Held> = recorded.objects.iter().map(|object| vec![None; object.len()]).collect();
            for part in 0..COMPARED.parts {
                let ensemble = fitted(jitter, &|place| COMPARED.uses(COMPARED.part(place), part))?;
                let trained = ensemble.trained_touches();
                for (object, (held, places)) in recorded.objects.iter().zip(held.iter_mut().zip(&places)) {
                    let touches = object.touches().iter().zip(places).zip(held);
                    for ((touch, _), held) in touches.filter(|((_, place), _)| COMPARED.part(**place) == part) {
                        *held = margins(&ensemble, &trained, touch);
                    }
                }
                progress::advance(progress, 1)?;
            }
            Ok(held)
        };
        let trainings = JITTERS.len() * COMPARED.parts;
        // Too few touches are found before any training.
        let evidence = evidence(recorded, &training)?;
        progress.begin("cross-validating", Some(trainings as u64));
        let compared = JITTERS.map(|jitter| held_out(jitter).map(|held| (jitter, held)));
        let compared = compared.into_iter().collect::<Result<Vec<_>>>()?;
        let best = compared.into_iter().min_by(|a, b| loss(&a.1).total_cmp(&loss(&b.1)));
        let (jitter, held) = best.unwrap_or((1.0, Vec::new()));
        let approaches = settings.approaches.min(recorded.fewest_in_sequence() / 2).max(1);
        let sources: Vec<Vec<Vec<usize>>> = recorded.objects.iter().map(super::by_source).collect();
        let sizes = [settings.groups, approaches];
        let drawn = super::Groups::draw((&held, &sources), (0..all).collect(), None, sizes, settings.seed);
        let none = vec![0.0; all];
        let objects = recorded.objects.iter().enumerate().map(|(index, object)| {
            let named = drawn.named(index, &none);
            TaughtObject {
                name: object.name.clone(),
                approaches: object.len(),
                touches: evidence[index],
                smoothing: Smoothing { jitter, prior: 0.0 },
                constant: 0.0,
                recognized: named.right,
                taken_for_it: named.wrong,
            }
        });
        let taught = Taught { approaches, objects: objects.collect(), others: None };
        progress.begin("training", None);
        let mut ensemble = fitted(jitter, &|_| true)?;
        // What is stated is what was recorded, not its copies.
        let trained = TouchOrigin::of(&ensemble.origin)?.trained;
        ensemble.origin = TouchOrigin { trained, ..TouchOrigin::new(recorded, training.probe) }.origin();
        Ok((ensemble, taught))
    })
}

fn margins(ensemble: &Ensemble, trained: &TrainedTouches, touch: &Touch) -> Option<Vec<f64>> {
    let is_evidence = Refused::check(trained, touch).is_ok();
    is_evidence.then(|| ensemble.margins(touch).into_iter().map(f64::from).collect())
}

/// Number of touches of each object that are evidence.
fn evidence(recorded: &Dataset, training: &train::Settings) -> Result<Vec<usize>> {
    let patterns = training.counted.unwrap_or(Counted::Full).patterns();
    let is_evidence = |touch: &&Touch| patterns.contains(touch.pattern());
    let count = |object: &ObjectTouches| object.touches().iter().filter(is_evidence).count();
    let evidence: Vec<usize> = recorded.objects.iter().map(count).collect();
    check::enough(recorded, &evidence)?;
    Ok(evidence)
}
