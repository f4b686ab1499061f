//! Instructions per touch that a compiled model takes on the chips.

use palpate::chip::instructions::Chip;
use palpate::compile::{self, Compiled};
use palpate::error::Result;
use palpate_shared::Touch;

/// Instructions per touch, from contact times to margins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Instructions {
    /// On a Cortex-M4F.
    pub(super) m4f: Count,
    /// On a Cortex-M0+.
    pub(super) m0_plus: Count,
}

/// A number of instructions, and where it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Count {
    /// Instructions per touch.
    pub(super) number: u64,
    /// True if an emulated chip counted them; else they are an estimate.
    pub(super) measured: bool,
}

/// Instructions on a Cortex-M0+ for each on a Cortex-M4F, where the compiler has no estimate: the largest ratio that
/// emulation showed, from 1.30 on.
const M0_RATIO: f64 = 1.46;

impl Instructions {
    /// Measured on these touches where the emulator and the firmware's `cost` image for the chip are there, else
    /// estimated.
    ///
    /// # Errors
    /// When the emulated chip does not run the model.
    pub(super) fn new(compiled: &Compiled, touches: &[Touch]) -> Result<Self> {
        let measured = |chip: Chip| -> Result<Option<u64>> {
            Ok(if chip.is_there() { Some(chip.measure(&compiled.bytes, touches)?.margins) } else { None })
        };
        Ok(Self::from_measured(compiled.instructions, measured(Chip::M4F)?, measured(Chip::M0Plus)?))
    }

    /// Returns the measured numbers; where nothing was, the compiler's `estimate`, and where that has none for the M0+,
    /// the M4F's number times [`M0_RATIO`].
    fn from_measured(estimate: compile::Instructions, m4f: Option<u64>, m0_plus: Option<u64>) -> Self {
        let count = |measured: Option<u64>, estimate: u64| Count {
            number: measured.unwrap_or(estimate),
            measured: measured.is_some(),
        };
        let m4f = count(m4f, estimate.m4f);
        let by_ratio = || (m4f.number as f64 * M0_RATIO).round() as u64;
        Self { m4f, m0_plus: count(m0_plus, estimate.m0_plus.unwrap_or_else(by_ratio)) }
    }

    /// Source of the numbers, as a sentence.
    pub(super) fn explanation(self) -> String {
        let [m4f, m0_plus] = [self.m4f, self.m0_plus].map(|count| match count.measured {
            true => "counted while an emulated chip ran the compiled models",
            false => "the compiler's estimate",
        });
        let chip = if self.m4f.measured { Chip::M0Plus } else { Chip::M4F };
        let missing = match self.m4f.measured && self.m0_plus.measured {
            true => String::new(),
            false => format!(
                " ({}onboard/firmware says how to build what is needed)",
                chip.obstacle().map_or_else(String::new, |problem| format!("{}; ", problem.what()))
            ),
        };
        format!(
            "Instructions, from contact times to margins, are {m4f} on a Cortex-M4F and {m0_plus} on a Cortex-M0+{missing}."
        )
    }
}

impl Count {
    /// Source of the number, for a column's title.
    pub(super) fn source(self) -> &'static str {
        if self.measured { "measured" } else { "estimated" }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_on_an_m0_plus_that_were_not_measured_are_labeled_as_estimated() {
        let estimate = compile::Instructions { m4f: 100, m0_plus: None };
        let both = Instructions::from_measured(estimate, Some(110), Some(150));
        assert_eq!([both.m4f.number, both.m0_plus.number], [110, 150]);
        assert_eq!([both.m4f.source(), both.m0_plus.source()], ["measured", "measured"]);
        let one = Instructions::from_measured(estimate, Some(110), None);
        assert_eq!([one.m4f.source(), one.m0_plus.source()], ["measured", "estimated"]);
        assert_eq!(one.m0_plus.number, 161);
        assert!(one.explanation().contains("the compiler's estimate"), "{}", one.explanation());
        let none = Instructions::from_measured(estimate, None, None);
        assert_eq!([none.m4f.number, none.m0_plus.number], [100, 146]);
        assert_eq!([none.m4f.source(), none.m0_plus.source()], ["estimated", "estimated"]);
        assert!(!none.explanation().contains("counted"), "{}", none.explanation());
    }
}
