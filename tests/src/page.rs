//! The trace of a page of `palpate play`: all that it must compute, computed by the program.

use palpate::capture::touches;
use palpate::compile::CompiledModel;
use palpate::error::Result;
use palpate::evaluate::too_many_objects;
use palpate::probe::hand::within;
use palpate::probe::noise::Noise;
use palpate::probe::scene::Scene;
use palpate::touches::Origin;
use palpate_onboard::{Recognizer, Stopping, Verdict};
use palpate_report::play::Surface;
use palpate_shared::Touch;
use std::fmt::Write;

/// Approaches of a round.
const ROUND: u64 = 100;

/// One line for each of `rounds` · 100 approaches to each object: the object, the round's seed, the approach, the three
/// contact times in microseconds; then for each model its verdict (0 undecided, 1 recognized, 2 unknown, 3 gave up), the
/// object with the most evidence, touches that were evidence, and the evidence for each object. Computed as a capture, an
/// evaluation's noise and a recognizer do, not as the page's game does.
///
/// # Errors
/// Errors of [`Scene::new`] and [`touches`]; when there are more than 256 objects.
pub fn trace(surfaces: &[Surface], models: &[CompiledModel], noise: &Noise, rounds: u64) -> Result<String> {
    let mut text = String::new();
    for (number, surface) in surfaces.iter().enumerate() {
        let scene = [Scene::new(&surface.mesh(), surface.length)?];
        for seed in 1..=rounds {
            let origin = Origin { approaches: true, pose: true, seed, ..Origin::default() };
            let captured = touches(&scene, &surface.name, &origin, 0..ROUND)?;
            let noisy = |(index, touch): (u64, &Touch)| {
                let noisy = noise.add(&surface.name, std::slice::from_ref(touch), (seed << 32) + index).pop();
                noisy.map(|touch| within(&touch, origin.probe.window()))
            };
            let sensed: Vec<Touch> = (0..).zip(captured.touches()).filter_map(noisy).collect();
            let opened: Vec<_> = models.iter().map(CompiledModel::model).collect();
            let recognizer = |model| Recognizer::<256>::new(model, Stopping::from_model(model));
            let recognizers: Result<Vec<_>, _> = opened.iter().map(recognizer).collect();
            let mut recognizers = recognizers.map_err(too_many_objects)?;
            for (index, touch) in sensed.iter().enumerate() {
                let times = touch.times().map(|time| time.micros().map_or("-".into(), |micros| micros.to_string()));
                // Writing to a string cannot fail.
                _ = write!(text, "{number} {seed} {index} {}", times.join(" "));
                for recognizer in &mut recognizers {
                    // Refused or not: what it knows is compared.
                    _ = recognizer.push(touch);
                    text += &line(recognizer);
                }
                text.push('\n');
            }
        }
    }
    Ok(text)
}

/// Knowledge of a recognizer, as part of a line.
#[must_use]
pub fn line(recognizer: &Recognizer<'_, 256>) -> String {
    let verdict = match recognizer.verdict() {
        Verdict::Undecided => 0,
        Verdict::Recognized { .. } => 1,
        Verdict::Unknown => 2,
        Verdict::GaveUp => 3,
    };
    let model = recognizer.model();
    let of = |object| recognizer.evidence().get(object).copied().unwrap_or_else(|| model.prior(object).into());
    let evidence: Vec<String> = (0..model.object_count()).map(|object| of(object).to_string()).collect();
    format!(" {verdict} {} {} {}", recognizer.best(), recognizer.touches(), evidence.join(","))
}
