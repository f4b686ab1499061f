//! Thresholds at which a recognizer stops.

use palpate::onboard::Stopping;

/// Stopping thresholds; 0 stands for the model's own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Thresholds {
    /// The posterior has to exceed 1 less this.
    pub(crate) error_rate: f64,
    /// Touches after which the recognizer gives up.
    pub(crate) max_touches: i64,
}

impl Thresholds {
    /// Stopping rule for a model whose own is `own`.
    ///
    /// # Errors
    /// The number that is out of range, and the range.
    pub(crate) fn over(self, own: Stopping) -> Result<Stopping, String> {
        let max_touches = match u32::try_from(self.max_touches) {
            Ok(0) => own.max_touches(),
            Ok(most) => most,
            Err(_) => return Err("max_touches is a number from 0, the model's own limit, to 4294967295".into()),
        };
        if self.error_rate == 0.0 {
            return Ok(own.with_max_touches(max_touches));
        }
        Stopping::new(self.error_rate, max_touches)
            .ok_or_else(|| "error_rate is a number from 1e-15 to below 0.5, or 0 for the model's own thresholds".into())
    }
}
