//! How many instructions a touch takes on the chips.

use crate::chip::emulated::Chip;
use crate::compile::{Compiled, Instructions};
use crate::error::Result;
use palpate_shared::Touch;
use serde::{Deserialize, Serialize};

/// Instructions a touch, from contact times to margins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Work {
    /// On a Cortex-M4F.
    pub(super) m4f: u64,
    /// On a Cortex-M0+, if it is known.
    pub(super) m0_plus: Option<u64>,
    /// Whether emulated chips counted them; else they are the compiler's estimate.
    pub(super) measured: bool,
}

impl Work {
    /// Measured on these touches where the emulator and the firmware's `cost` images are there, else estimated.
    ///
    /// # Errors
    /// When the emulated chip does not run the model.
    pub(super) fn of(compiled: &Compiled, touches: &[Touch]) -> Result<Self> {
        if Chip::M4F.is_there() && Chip::M0Plus.is_there() {
            let margins = |chip: Chip| chip.measure(&compiled.bytes, touches).map(|cost| cost.margins);
            return Ok(Self { m4f: margins(Chip::M4F)?, m0_plus: Some(margins(Chip::M0Plus)?), measured: true });
        }
        let Instructions { m4f, m0_plus } = compiled.instructions;
        Ok(Self { m4f, m0_plus, measured: false })
    }

    /// How the figures came about, for a column's title.
    pub(super) fn how(self) -> &'static str {
        if self.measured { "measured" } else { "modelled" }
    }

    /// The same, for a text.
    pub(super) fn explanation(self) -> &'static str {
        if self.measured {
            "Instructions, from contact times to margins, are measured: emulated chips run the compiled models."
        } else {
            "Instructions are the export's own estimate (modelled, not measured: the emulator or the firmware's images \
             are not there; onboard/firmware says how to build them)."
        }
    }
}
