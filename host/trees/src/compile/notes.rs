//! Notes on how close a regression's values are to the library's.

use super::Leaf;
use crate::ensemble::{Ensemble, TOLERATED};
use crate::verify;
use palpate_onboard::Model;

/// Notes for the user, where the bound that a model states, or a step of f32, is not small against what the trees add up to.
/// `is_before` if more is lost before leaves are rounded than by that.
pub(super) fn of_values(ensemble: &Ensemble, model: &Model<'_>, leaf: Leaf, is_before: bool) -> Vec<String> {
    let mut notes = Vec::new();
    if !ensemble.is_regression() {
        return notes;
    }
    for (output, reach) in ensemble.reach().into_iter().enumerate().filter(|(_, reach)| *reach > 0.0) {
        let of =
            if ensemble.objects.len() == 1 { "Values" } else { &*format!("Values of {}", ensemble.objects[output]) };
        let bound = verify::bound_of(model, output);
        if bound > TOLERATED * reach {
            let advice = match leaf {
                Leaf::F32 if !ensemble.adds_f32() => {
                    "The library adds in f64: leaves of i16 are closer (--leaf i16, in Python leaf=\"i16\")."
                }
                Leaf::F32 => "Subtract their mean from the targets before training.",
                Leaf::I8 | Leaf::I16 if ensemble.adds_f32() && is_before => {
                    "The library itself rounds to f32 after each tree: leaves of f32 give its own values (--leaf f32, in \
                     Python leaf=\"f32\")."
                }
                Leaf::I8 => "Leaves of i16 are closer (--leaf i16, in Python leaf=\"i16\").",
                Leaf::I16 => "Leaves of f32 are closer (--leaf f32, in Python leaf=\"f32\").",
            };
            let share = 100.0 * bound / reach;
            notes.push(format!(
                "{of} are only known to be within {bound:.2e} of the library's, {share:.2} % of the farthest that its trees \
                 lead from their middle. {advice}"
            ));
        }
        let offset = model.output_scale(output).map_or(0.0, |own| own.offset.abs());
        let step = offset.next_up() - offset;
        if f64::from(step) > TOLERATED * reach {
            notes.push(format!(
                "{of} are f32, which steps by {step} near {offset}: in C, a function whose name ends in _without_offset gives \
                 what is added to {offset}, and in Python `margins` has f64."
            ));
        }
    }
    notes
}
