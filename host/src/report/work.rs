//! How many instructions a touch takes on the chips.

use crate::chip::instructions::Chip;
use crate::compile::Compiled;
use crate::error::{ChipProblem, Result};
use palpate_shared::Touch;
use serde::{Deserialize, Serialize};

/// Instructions a touch, from contact times to margins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Work {
    /// On a Cortex-M4F.
    pub(super) m4f: u64,
    /// On a Cortex-M0+.
    pub(super) m0_plus: u64,
    /// Whether emulated chips counted them; else they are the compiler's estimate.
    pub(super) measured: bool,
}

/// Instructions on a Cortex-M0+ for each on a Cortex-M4F, for the estimate.
const M0_RATIO: f64 = 1.48;

impl Work {
    /// Measured on these touches where the emulator and the firmware's `cost` images are there, else estimated.
    ///
    /// # Errors
    /// When the emulated chip does not run the model.
    pub(super) fn of(compiled: &Compiled, touches: &[Touch]) -> Result<Self> {
        if Chip::M4F.is_there() && Chip::M0Plus.is_there() {
            let margins = |chip: Chip| chip.measure(&compiled.bytes, touches).map(|cost| cost.margins);
            return Ok(Self { m4f: margins(Chip::M4F)?, m0_plus: margins(Chip::M0Plus)?, measured: true });
        }
        let m4f = compiled.instructions;
        Ok(Self { m4f, m0_plus: (m4f as f64 * M0_RATIO).round() as u64, measured: false })
    }

    /// How the figures came about, for a column's title.
    pub(super) fn how(self) -> &'static str {
        if self.measured { "measured" } else { "modelled" }
    }

    /// The same, for a text.
    pub(super) fn explanation(self) -> String {
        if self.measured {
            return "Instructions, from contact times to margins, are measured: emulated chips run the compiled models."
                .into();
        }
        let reason = obstacle().map_or_else(String::new, |problem| format!(": {problem}"));
        format!(
            "Instructions are the export's own estimate (modelled, not measured{reason}; onboard/firmware says how to \
             measure them)."
        )
    }
}

/// Why instructions cannot be measured here, if they cannot.
fn obstacle() -> Option<ChipProblem> {
    [Chip::M4F, Chip::M0Plus].into_iter().find_map(Chip::obstacle)
}
