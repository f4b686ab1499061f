//! Waiting times of the driver.

use super::Scale;
use crate::model::Model;

/// The longest duration of any setting: 2³⁰ µs, 18 minutes, so that differences of wrapping times keep their sign.
const LONGEST: u32 = 1 << 30;

/// Waiting times of the driver, in microseconds. Anything above 2³⁰ (18 minutes) counts as 2³⁰.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectorSettings {
    /// Time that a level must hold before the switch has settled: longer than the longest pause in its bouncing.
    pub debounce: u32,
    /// Time that a switch may take to settle before it counts as bouncing. More than `debounce`.
    pub settle: u32,
    /// After the first contact, fingers that have not touched within this time are missing. Longer than the largest
    /// time between contacts that the model was trained on, or full touches become partial ones; see
    /// [`EffectorSettings::for_model`].
    pub timeout: u32,
    /// Time that all fingers must be open before a touch in progress ends without its missing contacts. Longer than a
    /// finger loses contact within one approach, and shorter than the way from one approach to the next takes. Also how
    /// long they must be open at power-up, and after a touch was dropped, before a touch can begin.
    pub release: u32,
    /// Time that all fingers must be open after a touch before the next one can begin.
    pub rest: u32,
    /// Time that a finger may stay closed before it counts as stuck. More than `timeout` and the time a touch is held.
    pub stuck: u32,
    /// After this many touches in a row without a finger, that finger is reported as silent. 0 disables the report.
    pub silent_after: u16,
}

impl Default for EffectorSettings {
    /// For micro-switches (which bounce for 1 to 5 ms) and the paper's probe: 5 ms to debounce, 25 ms to settle, 1.2 s
    /// for the other fingers (of 200,000 simulated touches the contacts were up to 1.05 s apart), 100 ms release, 10 ms
    /// rest, 5 s until stuck, silent after 100 touches.
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl EffectorSettings {
    /// The default, for a static.
    pub const DEFAULT: Self = Self {
        debounce: 5_000,
        settle: 25_000,
        timeout: 1_200_000,
        release: 100_000,
        rest: 10_000,
        stuck: 5_000_000,
        silent_after: 100,
    };

    /// Settings with the timeout that a model needs, as `scale`'s probe takes it: the time that the stroke of the model's
    /// probe takes, after which contacts were missing in training; of a model without a stroke a sixteenth more than the
    /// largest time between contacts that it was trained on. The timeout stays if the model states neither.
    ///
    /// Cost: a look for two sections. Cannot fail.
    pub fn for_model(self, model: &Model<'_>, scale: &Scale) -> Self {
        let spread = model.trained_touches().largest_spread;
        if spread == u32::MAX {
            return self;
        }
        if model.probe().is_some_and(|probe| probe.stroke.is_some()) {
            return Self { timeout: scale.shortest(spread).saturating_add(1), ..self };
        }
        let spread = scale.longest(spread);
        Self { timeout: spread.saturating_add(spread / 16).saturating_add(1), ..self }
    }

    /// Settings with every duration in range, and `settle` and `stuck` long enough to make sense.
    pub(super) const fn in_range(self) -> Self {
        let [debounce, settle, timeout] = [within(self.debounce), within(self.settle), within(self.timeout)];
        let [release, rest, stuck] = [within(self.release), within(self.rest), within(self.stuck)];
        let settle = longer(settle, debounce.saturating_add(1));
        let stuck = longer(longer(stuck, timeout.saturating_add(1)), settle.saturating_add(1));
        Self { debounce, settle, timeout, release, rest, stuck, silent_after: self.silent_after }
    }
}

const fn within(duration: u32) -> u32 {
    if duration < LONGEST { duration } else { LONGEST }
}

const fn longer(one: u32, other: u32) -> u32 {
    if one > other { one } else { other }
}
