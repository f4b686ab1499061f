//! A misfit test and a promised error rate together.
//!
//! Which names are given depends on the test: it holds some back and ends sequences. How often known objects are taken
//! for unknown depends on the thresholds: the later names are given, the longer there is for a false alarm. So both are
//! found in an order in which neither makes the other untrue, each on touches of its own:
//!
//! ```text
//! an eighth ─────► where thresholds begin: where as many names as there will be pass the test, most probably
//! three eighths ─► the test under these: at most so many false alarms, by Learn-then-Test
//! half ──────────► looser thresholds under the test: at most so many wrong names, by Learn-then-Test
//! ```
//!
//! A looser threshold gives a name no later, in every single sequence, so there are no more false alarms than were tested.
//!
//! Names that are held back for the test come later, with more evidence, and fewer of them are wrong: so the last step alone
//! would go on to looser thresholds than without the test, at which more strangers get a name as soon as the test lets them.
//! It ends where the same calibration without the test ends, on all touches; then every sequence that gets a name has one
//! without the test too.

use super::{Settings, Tested, calibrate, tested_means, without};
use crate::calibrate::{self, Start, add_noise, begin, calibrate_from, odds_of};
use crate::compile::{self, Restated, restate};
use crate::error::{Kind, Result};
use crate::mesh::BACKGROUND;
use crate::progress::Progress;
use crate::touches::folds::split;
use crate::touches::{Dataset, ObjectTouches};
use palpate_onboard::{Model, Stopping};
use palpate_shared::format::Tag;

/// The share of touches that the promise is tested on, and of the others the share that thresholds begin with.
const PROMISED: f64 = 0.5;
const BEGUN: f64 = 0.25;

/// Gives a model a misfit test, or replaces the one that it has, and thresholds that keep a promised error rate with that
/// test: a sequence that ends as unknown is one without a name, and a name is given when the test lets it be. `promise.noise`
/// is added to touches and shapes. Each of the two shares is kept with its own confidence.
///
/// # Errors
/// Errors of [`strangers::calibrate`](fn@super::calibrate) and [`calibrate::calibrate`](fn@crate::calibrate::calibrate).
pub fn calibrate_with_promise(
    model: &Model<'_>,
    dataset: &Dataset,
    shapes: &[ObjectTouches],
    settings: &Settings,
    promise: &calibrate::Settings,
    progress: &dyn Progress,
) -> Result<(calibrate::Calibrated, Tested)> {
    let untested = without(model)?;
    let untested = compile::open(&untested)?;
    let halves = split(dataset, PROMISED, promise.seed)?;
    let parts = split(&halves.train, BEGUN, promise.seed)?;
    let without = without_test(calibrate::calibrate(&untested, dataset.clone(), promise, progress))?;
    // As many times the touches say where to begin.
    let times = PROMISED / ((1.0 - PROMISED) * BEGUN);
    let strictest = begin(&untested, parts.test, times, promise, progress)?;
    let max_touches = promise.max_touches.unwrap_or(Stopping::from_model(&untested).max_touches());
    let begun = Restated {
        odds: Some(odds_of(strictest)),
        max_touches: Some(max_touches),
        sections: vec![(Tag::ThresholdsByObject, None)],
        ..Restated::default()
    };
    let begun = restate(&untested, &begun)?;
    let mut learned = parts.train;
    add_noise(&untested, &mut learned, &promise.noise, max_touches, promise.seed);
    let noisy = |shapes: &ObjectTouches| {
        // Each touch is by a robot of its own: only the means of shapes count.
        let robots = shapes.len().max(1);
        shapes.clone().renamed(BACKGROUND).noisy(&promise.noise, promise.seed, robots)
    };
    let shapes: Vec<ObjectTouches> =
        if promise.noise.is_none() { shapes.to_vec() } else { shapes.iter().map(noisy).collect() };
    let begun = compile::open(&begun)?;
    let tested = calibrate(&begun, &learned, &shapes, settings)?;
    let loosest = without.map(|without| without.odds);
    let start = Start { margin: strictest, loosest, share: PROMISED };
    let promised = calibrate_from(&compile::open(&tested.bytes)?, halves.test, promise, Some(start), progress)?;
    let [mean_touches, mean_touches_without] = tested_means(&compile::open(&promised.model)?, &learned, settings)?;
    let tested = Tested { bytes: promised.model.clone(), mean_touches, mean_touches_without, ..tested };
    Ok((promised, tested))
}

/// A calibration without a test; none where it promises nothing.
fn without_test(calibrated: Result<calibrate::Calibrated>) -> Result<Option<calibrate::Calibrated>> {
    match calibrated {
        Ok(calibrated) => Ok(Some(calibrated)),
        Err(error) if matches!(error.kind(), Kind::TooFew | Kind::NotKept) => Ok(None),
        Err(error) => Err(error),
    }
}
