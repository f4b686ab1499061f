//! Remarks about an ensemble for its user.

use super::scales::{self, Effect};
use crate::ensemble::Ensemble;
use crate::ensemble::import::asks;

/// Notes for the user, each a sentence: those of the file that it was read from, and the features of which rows go another way
/// in f32, or of which thresholds become equal in whole numbers of units if it is compiled with `scales`.
pub fn notes(ensemble: &Ensemble, scales: Option<&[f32]>) -> Vec<String> {
    let mut notes = ensemble.origin.imported.as_ref().map(|imported| imported.notes.clone()).unwrap_or_default();
    notes.extend(of_thresholds(ensemble, scales));
    notes
}

/// The part of the [`notes`] after which a user may have to choose an option.
pub fn warnings(ensemble: &Ensemble, scales: Option<&[f32]>) -> Vec<String> {
    let imported = ensemble.origin.imported.iter().flat_map(|imported| &imported.notes);
    imported.filter(|note| asks(note)).cloned().chain(of_thresholds(ensemble, scales)).collect()
}

/// Notes about thresholds that a model compares otherwise.
fn of_thresholds(ensemble: &Ensemble, scales: Option<&[f32]>) -> Vec<String> {
    match scales {
        _ if ensemble.origin.imported.is_none() => Vec::new(),
        None => scales::singles(ensemble).iter().map(ToString::to_string).collect(),
        Some(scales) => {
            let effects = scales::effects(ensemble, scales, None);
            effects.iter().filter(|effect| effect.different < effect.thresholds).map(Effect::to_string).collect()
        }
    }
}
