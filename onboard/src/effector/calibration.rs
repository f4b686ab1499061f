//! Measuring a probe's speed on a flat plate.

use core::fmt;
use palpate_shared::{Descriptor, MISSING_FEATURE, Touch};

/// Touches that a calibration takes at least.
const LEAST_TOUCHES: u32 = 8;

/// Measures the probe's speed from touches of a flat plate of known tilt.
///
/// Put a flat plate in front of the probe, tilted along the row of fingers by a known gradient `rise / run` (a wedge),
/// and touch it at least 8 times, more if the switches are noisy. The fingers at the ends touch `2 · spacing · rise /
/// run` apart in the direction of motion; that distance by the time between them is the speed.
///
/// ```
/// use palpate_onboard::effector::{Calibration, Geometry, Scale};
/// use palpate_shared::Touch;
///
/// // Fingers 12000 µm apart on a wedge of 1 : 6; the ends touch 50 ms apart.
/// let mut calibration = Calibration::new(12_000, 1, 6);
/// for _ in 0..8 {
///     calibration.push(&Touch::from_micros([0, 25_000, 50_000]));
/// }
/// assert_eq!(calibration.speed(), Ok(80_000));
///
/// let model = Geometry { spacing: 12_000, speed: 100_000 };
/// let scale = Scale::new(model, Geometry { spacing: 12_000, speed: 80_000 }).ok_or("out of range")?;
/// assert_eq!(scale.apply(&Touch::from_micros([0, 1_000, 9_000])), Touch::from_micros([0, 800, 7_200]));
/// # Ok::<(), &str>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Calibration {
    spacing: u32,
    rise: u16,
    run: u16,
    touches: u32,
    /// Sum of `|t3 − t1|`.
    slope: u64,
    /// Sum of `t1 − 2·t2 + t3`.
    curvature: i64,
}

/// Reason why a calibration has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CalibrationError {
    /// Fewer than 8 touches with all three fingers.
    TooFew,
    /// The middle finger was on average more than a quarter of the slope early or late.
    NotFlat,
    /// The ends touched at the same time: the plate is not tilted along the row, or the gradient given is 0.
    NotTilted,
}

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooFew => "too few touches: touch the plate at least 8 times with all three fingers",
            Self::NotFlat => "the surface is not flat, or a finger is longer than the others: check plate and fingers",
            Self::NotTilted => "the plate is not tilted along the row of fingers: put it on a wedge",
        })
    }
}

impl core::error::Error for CalibrationError {}

impl Calibration {
    /// A calibration for fingers `spacing` apart (in any unit of length) on a plate that rises by `rise` in `run`.
    pub const fn new(spacing: u32, rise: u16, run: u16) -> Self {
        Self { spacing, rise, run, touches: 0, slope: 0, curvature: 0 }
    }

    /// Counts a touch in and says whether it did: one with a missing contact has no slope to measure.
    pub fn push(&mut self, touch: &Touch) -> bool {
        let features = Descriptor::Curvature.features(touch);
        let [curvature, slope] = features.as_slice() else { return false };
        if *curvature == MISSING_FEATURE || self.touches == u32::MAX {
            return false;
        }
        self.touches += 1;
        // 2³² touches of 2²⁴ µs: far from overflow.
        self.slope += u64::from(slope.unsigned_abs());
        self.curvature += i64::from(*curvature);
        true
    }

    /// Touches counted so far.
    pub const fn touches(&self) -> u32 {
        self.touches
    }

    /// The probe's speed, in the unit of the spacing a second, rounded.
    ///
    /// # Errors
    /// [`CalibrationError`]; a speed too high for u32 is [`CalibrationError::NotTilted`].
    pub fn speed(&self) -> Result<u32, CalibrationError> {
        if self.touches < LEAST_TOUCHES {
            return Err(CalibrationError::TooFew);
        }
        if self.slope == 0 || self.rise == 0 || self.run == 0 {
            return Err(CalibrationError::NotTilted);
        }
        if self.curvature.unsigned_abs() > self.slope / 4 {
            return Err(CalibrationError::NotFlat);
        }
        // 33 + 16 + 20 + 32 bits over 56 + 16 bits.
        let way = 2_000_000 * u128::from(self.spacing) * u128::from(self.rise) * u128::from(self.touches);
        let time = u128::from(self.slope) * u128::from(self.run);
        u32::try_from((way + time / 2) / time).map_err(|_| CalibrationError::NotTilted)
    }
}
