//! Chips on the command line: their names, what a touch costs on them, and what they have to be built with.

use palpate::compile::{Core, Instructions};
use palpate::onboard::Model;
use palpate_shared::format::Weights;

/// The processor of this name.
pub(super) fn core(name: &str) -> Result<Core, String> {
    match name.to_lowercase().as_str() {
        "m0+" | "m0plus" | "cortex-m0+" => Ok(Core::M0Plus),
        "m4f" | "cortex-m4f" => Ok(Core::M4F),
        _ => Err("use m0+ or m4f".into()),
    }
}

/// The estimates as a text.
pub(super) fn instructions(instructions: Instructions) -> String {
    let m0_plus =
        instructions.m0_plus.map_or_else(|| "unknown (f32 leaves)".into(), |instructions| instructions.to_string());
    format!("{} on a Cortex-M4F, {m0_plus} on a Cortex-M0+", instructions.m4f)
}

/// The line that names the cargo features that a chip needs.
pub(super) fn features(model: &Model<'_>) -> String {
    let sections = [
        ("shared-leaves", model.shared_leaves().is_some()),
        ("sentinel", model.sentinel().is_some()),
        ("strangers", model.strangers().is_some()),
        ("row-evidence", model.row_evidence().is_some() || model.weight_of(u32::MAX) != Weights::ONE),
        ("sequences", model.position().is_some() || model.guard().is_some()),
        ("outputs", model.outputs().is_some()),
    ];
    let needed: String =
        sections.iter().filter(|section| section.1).map(|section| format!(", {}", section.0)).collect();
    format!(
        "To read only this model, build palpate-onboard with: {}, {}-leaves{needed}\n",
        model.layout().name(),
        model.leaf_type().name(),
    )
}
