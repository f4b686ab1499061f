//! Comparison of a calibration's noise with that of the training.

use crate::probe::noise::Noise;
use palpate_onboard::Model;

/// Says that a calibration on touches with this noise makes a promise for other touches than those that the model was
/// trained on, and what to give for such; nothing where the noise is the same, or where the model states none.
pub fn unlike_training(model: &Model<'_>, noise: &Noise) -> Option<String> {
    let trained = model.noise().filter(|trained| *trained != noise.trained())?;
    let simulated = Noise::of_training(&trained);
    Some(format!(
        "the model was trained on touches with {simulated}, and the promise is for touches with {noise}. For touches like those \
         of the training give --real {}.",
        simulated.settings()
    ))
}
