//! Shares that a test measures, and whether they agree.

/// A share, and its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Share(pub(crate) f64, pub(crate) f64);

impl Share {
    /// A share of this many independent cases.
    pub(crate) fn of(value: f64, cases: f64) -> Self {
        // One that is 0 or 1 is not known exactly.
        let spread = value.clamp(1.0 / (cases + 2.0), 1.0 - 1.0 / (cases + 2.0));
        Self(value, (spread * (1.0 - spread) / cases).sqrt())
    }

    /// Checks that another one's share is within three standard errors of the difference.
    pub(crate) fn agrees(self, what: &str, measured: Self) {
        let error = self.1.hypot(measured.1);
        assert!((self.0 - measured.0).abs() <= 3.0 * error, "{what}: {self:?} stated, {measured:?} measured");
    }
}

/// Number of cases that `groups` groups of `length` make: at most as many as are disjoint.
pub(crate) fn cases(groups: usize, touches: usize, length: f64) -> f64 {
    (groups as f64).min(touches as f64 / length)
}
