//! Touches as a fit sees them: which fingers touched, and differences of their times.

use palpate_shared::Touch;
use std::f64::consts::TAU;

/// Observation of a touch: which fingers touched, and how far apart in time, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Observed {
    /// Bit i: finger i touched.
    pub(super) fingers: u8,
    /// κ of a full touch; of a touch with two contacts the later finger's time less the earlier one's, counted along the
    /// row; else 0.
    pub(super) first: f64,
    /// The signed slope of a full touch, else 0.
    pub(super) second: f64,
    /// The density of these times if they come from nowhere; 1 without times.
    pub(super) odd: f64,
}

/// Spread of the times of odd touches, in milliseconds.
const ODD_SPREAD: f64 = 150.0;

/// All three fingers.
pub(super) const FULL: u8 = 0b111;
/// The first and the third finger.
pub(super) const OUTER: u8 = 0b101;

impl Observed {
    pub(super) fn of(touch: &Touch) -> Self {
        Self::of_times(touch.times().map(|time| time.micros().map(|micros| f64::from(micros) / 1e3)))
    }

    /// Observation from contact times on any common clock, in milliseconds.
    pub(super) fn of_times(times: [Option<f64>; 3]) -> Self {
        let (fingers, first, second) = match times {
            [Some(a), Some(b), Some(c)] => (FULL, a - 2.0 * b + c, c - a),
            [Some(a), Some(b), None] => (0b011, b - a, 0.0),
            [None, Some(b), Some(c)] => (0b110, c - b, 0.0),
            [Some(a), None, Some(c)] => (OUTER, c - a, 0.0),
            [a, b, c] => (u8::from(a.is_some()) | u8::from(b.is_some()) << 1 | u8::from(c.is_some()) << 2, 0.0, 0.0),
        };
        let odd = match fingers {
            FULL => wide(first) * wide(second),
            0b011 | 0b110 | OUTER => wide(first),
            _ => 1.0,
        };
        Self { fingers, first, second, odd }
    }

    /// Observation of fingers, at most one of which touched.
    pub(super) fn without_times(fingers: u8) -> Self {
        Self { fingers, first: 0.0, second: 0.0, odd: 1.0 }
    }

    /// Number of fingers that touched.
    pub(super) fn contacts(self) -> u32 {
        self.fingers.count_ones()
    }
}

/// A density that is nowhere small: Cauchy's.
pub(super) fn wide(x: f64) -> f64 {
    2.0 / (TAU * ODD_SPREAD * (1.0 + (x / ODD_SPREAD).powi(2)))
}

/// The share of each set of fingers, a set and its mirror image alike, of these counts among `all` approaches.
pub(super) fn mirrored(counts: &[u32; 8], all: usize) -> [f64; 8] {
    let mirror = |fingers: usize| fingers & 0b010 | (fingers & 1) << 2 | fingers >> 2;
    let all = all.max(1) as f64;
    std::array::from_fn(|fingers| f64::from(counts[fingers] + counts[mirror(fingers)]) / (2.0 * all))
}
