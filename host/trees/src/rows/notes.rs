//! Remarks about an ensemble for its user.

use super::scales::{self, Effect};
use crate::ensemble::Ensemble;

/// Notes for the user, each a sentence: those of the file that it was read from, and the features with thresholds that
/// become equal, in f32 or in whole numbers of units if it is compiled with `scales`.
pub fn notes(ensemble: &Ensemble, scales: Option<&[f32]>) -> Vec<String> {
    let imported = ensemble.origin.imported.as_ref();
    let mut notes = imported.map(|imported| imported.notes.clone()).unwrap_or_default();
    match scales {
        _ if imported.is_none() => {}
        None => notes.extend(scales::merged(ensemble).iter().map(ToString::to_string)),
        Some(scales) => {
            let effects = scales::effects(ensemble, scales, None);
            notes.extend(effects.iter().filter(|effect| effect.different < effect.thresholds).map(Effect::to_string));
        }
    }
    notes
}
