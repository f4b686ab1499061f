//! `palpate verify` of a model of touches.

use super::Global;
use super::progress::Bar;
use super::verify::Arguments;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::ensemble::Ensemble;
use palpate::evaluate::parity;
use palpate::output;

/// Compares a compiled model with its ensemble, touch by touch and sequence by sequence.
pub(super) fn run(arguments: &Arguments, ensemble: &Ensemble, compiled: &CompiledModel, global: &Global) -> Result<()> {
    let dataset = super::dataset(&arguments.data)?;
    let parity = parity::parity(ensemble, &compiled.model(), &dataset, arguments.sequences, global.seed(), &Bar::new())
        .map_err(|error| error.in_file(&arguments.model))?;
    if global.json {
        return output::print_json(&parity);
    }
    output::print(&format!(
        "{} touches: margins differ by at most {:.2e} nats (the model states {:.2e}); another best object after {}\n\
         {} sequences: another verdict in {}, the same after another number of touches in {}\n",
        parity.touches,
        parity.max_margin_error,
        parity.stated_bound,
        parity.best_differs,
        parity.sequences,
        parity.verdict_differs,
        parity.touches_differ
    ))
}
