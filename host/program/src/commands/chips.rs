//! Chips on the command line: their names, what a touch costs on them, and what they have to be built with.

use palpate::compile::{self, Core, Instructions};
use palpate::onboard::Model;

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
    let m0_plus = instructions
        .m0_plus
        .map_or_else(|| "unknown (f32 leaves, or code for an M4F)".into(), |instructions| instructions.to_string());
    format!("{} on a Cortex-M4F, {m0_plus} on a Cortex-M0+", instructions.m4f)
}

/// The line that names the cargo features that a chip needs.
pub(super) fn features(model: &Model<'_>) -> String {
    format!("To read only this model, build palpate-onboard with: {}\n", compile::features(model).join(", "))
}
