//! Notes on how close a regression's values are to the library's.

use super::{Leaf, bound_of};
use crate::ensemble::{Ensemble, TOLERATED};
use palpate_onboard::Model;

/// Notes for the user, where the bound that a model states, or a step of f32, is not small against what the trees add up to.
/// `errors` are those before leaves are rounded, and by that, in nats.
pub(super) fn of_values(ensemble: &Ensemble, model: &Model<'_>, leaf: Leaf, errors: [f64; 2]) -> Vec<String> {
    let mut notes = Vec::new();
    if !ensemble.is_regression() {
        return notes;
    }
    for (output, reach) in ensemble.reach().into_iter().enumerate().filter(|(_, reach)| *reach > 0.0) {
        let of =
            if ensemble.objects.len() == 1 { "Values" } else { &*format!("Values of {}", ensemble.objects[output]) };
        // Values of f32 leaves are their sums, which nothing rounds further.
        let bound = match leaf {
            Leaf::F32 => errors[0] * f64::from(model.prediction().scale),
            Leaf::I8 | Leaf::I16 => bound_of(model, output),
        };
        if bound > TOLERATED * reach {
            let is_librarys = leaf != Leaf::F32 && ensemble.adds_f32() && errors[0] > errors[1];
            let better = if leaf == Leaf::I16 || is_librarys { Leaf::F32 } else { Leaf::I16 }.name();
            let why = match is_librarys {
                true => "The library itself rounds to f32 after each tree, and leaves of f32 give its own values",
                false => &format!("Leaves of {better} are closer"),
            };
            let share = 100.0 * bound / reach;
            notes.push(format!(
                "{of} are only known to be within {bound:.2e} of the library's, {share:.2} % of half the sum of what each \
                 tree's leaves span. {why} (--leaf {better}, in Python leaf=\"{better}\")."
            ));
        }
        let offset = model.output_scale(output).map_or(0.0, |own| own.offset);
        let step = offset.abs().next_up() - offset.abs();
        if f64::from(step) > TOLERATED * reach {
            notes.push(format!(
                "{of} are f32, which steps by {step} near {offset}: in C, a function whose name ends in _without_offset gives \
                 what is added to {offset}, and in Python `margins` has f64."
            ));
        }
    }
    notes
}
