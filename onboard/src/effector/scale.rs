//! Probes with another spacing or speed than the model's.

use palpate_shared::{ContactTime, Touch};

/// One in Q16.
const ONE: u64 = 1 << 16;
/// The largest ratio of two spacings or speeds, and 1 over the smallest.
const MOST: u64 = 16;

/// A probe's measures, in any unit of length that model and probe share. The object is that of the model: if the object
/// is half as large as the model's, measure in half as large units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Geometry {
    /// Between neighboring fingers.
    pub spacing: u32,
    /// Along the motion, a second.
    pub speed: u32,
}

/// Converts the touches of one probe to those of another.
///
/// Times scale exactly with speed. The time differences of two fingers scale with their distance where the surface is
/// flat, and the curvature with its square where it is a parabola: with another spacing the result is as good as these
/// approximations are over the larger of the two spans. Below 10 % difference that is usually well under the noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Factor for differences of times, Q16: spacing and speed.
    linear: u64,
    /// Factor for the second difference, Q16: spacing twice, and speed.
    square: u64,
}

impl Scale {
    /// The probe is that of the model: changes nothing.
    pub const IDENTITY: Self = Self { linear: ONE, square: ONE };

    /// From the touches of `probe` to those of the probe that the model was trained for. `None` if a measure is 0 or one
    /// is more than 16 times the other.
    pub fn new(model: Geometry, probe: Geometry) -> Option<Self> {
        let spacing = ratio(model.spacing, probe.spacing)?;
        let speed = ratio(probe.speed, model.speed)?;
        // Each at most 16 in Q16, so 60 bits for three of them.
        let linear = (spacing * speed + ONE / 2) / ONE;
        let square = (spacing * spacing * speed + ONE * ONE / 2) / (ONE * ONE);
        Some(Self { linear, square })
    }

    /// The longest that contacts can be apart with this probe if they are at most `micros` apart with the model's.
    pub fn longest(&self, micros: u32) -> u32 {
        // At least 2^-12 in Q16, as three ratios of at least 1/16 are.
        let least = self.linear.min(self.square).max(1);
        u32::try_from((u64::from(micros) * ONE).div_ceil(least)).unwrap_or(u32::MAX)
    }

    /// The longest that contacts can be apart with this probe so that they are never more than `micros` apart with the
    /// model's.
    pub(crate) fn shortest(&self, micros: u32) -> u32 {
        let most = self.linear.max(self.square).max(1);
        u32::try_from(u64::from(micros) * ONE / most).unwrap_or(u32::MAX)
    }

    /// The touch as the model's probe would have made it, rounded to whole microseconds; the pose stays.
    ///
    /// Cost: a few products of 64 bits for each time. Cannot fail: times too long for a [`ContactTime`] become the longest.
    pub fn apply(&self, touch: &Touch) -> Touch {
        if *self == Self::IDENTITY {
            return *touch;
        }
        let linear = i64::try_from(self.linear).unwrap_or(i64::MAX);
        let square = i64::try_from(self.square).unwrap_or(i64::MAX);
        // Twice the times after the middle finger, in Q16: at most 33 + 28 bits.
        let times = touch.times().map(|time| time.micros().map(i64::from));
        let scaled = match times {
            [Some(first), Some(middle), Some(last)] => {
                let even = (first + last - 2 * middle) * square;
                let odd = (last - first) * linear;
                [Some(even - odd), Some(0), Some(even + odd)]
            }
            // With two times there is no curvature to be known.
            _ => times.map(|time| time.map(|time| 2 * time * linear)),
        };
        let least = scaled.into_iter().flatten().min().unwrap_or(0);
        let times = scaled.map(|time| match time {
            Some(time) => {
                let micros = (time.saturating_sub(least) + (1 << 16)) >> 17;
                ContactTime::from_micros(u32::try_from(micros).unwrap_or(u32::MAX).min(u32::MAX - 1))
            }
            None => ContactTime::MISSING,
        });
        match touch.pose() {
            Some(pose) => Touch::new(times).with_pose(pose),
            None => Touch::new(times),
        }
    }
}

/// `over / under` in Q16, rounded, from 1/16 to 16.
fn ratio(over: u32, under: u32) -> Option<u64> {
    let (over, under) = (u64::from(over), u64::from(under));
    if over == 0 || under == 0 || over > under * MOST || under > over * MOST {
        return None;
    }
    Some((over * ONE + under / 2) / under)
}
