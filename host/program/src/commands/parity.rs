//! `palpate verify` of a model of touches.

use super::Global;
use super::progress::Bar;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::ensemble::Ensemble;
use palpate::evaluate::parity;
use palpate::wording::{count, scientific};
use std::path::Path;

/// Compares a compiled model with its ensemble, touch by touch and in a number of sequences.
pub(super) fn run(
    (model, compiled): (&Path, &CompiledModel),
    ensemble: &Ensemble,
    (data, sequences): (&Path, usize),
    global: &Global,
) -> Result<()> {
    let dataset = super::dataset(data)?.matching(&ensemble.objects);
    let parity = parity::parity(ensemble, &compiled.model(), &dataset, sequences, global.seed(), &Bar::new())
        .map_err(|error| error.in_file(model))?;
    let text = || {
        format!(
            "{} touches: margins differ by at most {} nats (the model states {}); another best object after {}\n\
         {} sequences: {} with another verdict; {} with the same verdict at another touch\n",
            count(parity.touches),
            scientific(parity.max_margin_error),
            scientific(parity.stated_bound),
            count(parity.best_differs),
            count(parity.sequences),
            count(parity.verdict_differs),
            count(parity.touches_differ)
        )
    };
    global.print(&parity, text)
}
