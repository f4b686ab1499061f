//! Comparison of a calibration's noise with that of the training.

use crate::probe::noise::Noise;
use palpate_onboard::Model;
use palpate_shared::format::{PromisedNoise, TrainedNoise};

/// Says that a calibration on touches with this noise makes a promise for other touches than those that the model was
/// trained on, and what to give for such; nothing where the noise is the same, or where the model states none.
pub fn unlike_training(model: &Model<'_>, noise: &Noise) -> Option<String> {
    let trained = model.noise().filter(|trained| *trained != noise.trained())?;
    let simulated = Noise::of_promise(&PromisedNoise { touch: trained, ..Noise::default().promised() });
    Some(format!(
        "the model was trained on touches with {simulated}, and the promise is for touches with {noise}. For touches like those \
         of the training give --real {}.",
        option(&trained)
    ))
}

/// The noise as the option that adds it.
fn option(trained: &TrainedNoise) -> String {
    let ms = |micros: u32| f64::from(micros) / 1e3;
    let TrainedNoise { least, largest, timer, pose } = *trained;
    let range = if least == largest { String::new() } else { format!("{}..", ms(least)) };
    let parts = [
        (largest > 0, format!("noise={range}{}ms", ms(largest))),
        (timer > 0, format!("timer={}ms", ms(timer))),
        (pose > 0, format!("pose_noise={}deg", f64::from(pose) / 1e3)),
    ];
    let given: Vec<String> = parts.into_iter().filter(|(is_there, _)| *is_there).map(|(_, part)| part).collect();
    if given.is_empty() { "none".to_owned() } else { given.join(",") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_written_as_the_option_that_adds_it() {
        let switch = TrainedNoise { least: 0, largest: 5_000, timer: 1_000, pose: 0 };
        assert_eq!(option(&switch), "noise=0..5ms,timer=1ms");
        assert_eq!(
            option(&TrainedNoise { least: 2_500, largest: 2_500, timer: 0, pose: 5_000 }),
            "noise=2.5ms,pose_noise=5deg"
        );
        assert_eq!(option(&TrainedNoise::default()), "none");
    }
}
