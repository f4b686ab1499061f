//! Approaches as numbers, and their limits: the same for touches of a file and for heights of a program.

use super::refused::{BELOW, reachable, too_low};
use super::shape::Sample;
use super::{Hand, Seen};
use crate::error::{Error, Result};
use crate::touches::touch_of_seconds;
use palpate_onboard::locate::Contact;

/// Heights above the table that three fingertips met, all lengths in millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heights {
    /// The heights; none for a finger that met nothing.
    pub met: [Option<f64>; 3],
    /// Place of the middle finger.
    pub place: [f64; 2],
    /// Direction from the first finger to the third, a unit vector.
    pub row: [f64; 3],
    /// Height down to which the hand went; 0 or less where it would have met the table.
    pub lowest: f64,
}

impl Heights {
    /// The approach of a hand, for a locator.
    ///
    /// # Errors
    /// A place or height that is too far from the table's origin or below the table, and a row that is no unit vector.
    pub fn seen(&self, hand: &Hand) -> Result<Seen> {
        self.check()?;
        let micrometers = |millimeters: f64| (millimeters * 1e3).round() as i32;
        let [across, along, _] = self.row.map(|share| (share * f64::from(hand.spacing)).round() as i32);
        let contacts = self.met.map(|met| met.map_or(Contact::Nothing, |height| Contact::At(micrometers(height))));
        Ok(Seen::new(self.place.map(micrometers), [across, along], contacts, micrometers(self.lowest)))
    }

    /// Samples of a shape, with this distance between fingers.
    ///
    /// # Errors
    /// Errors of [`seen`](Self::seen).
    pub fn samples(&self, spacing: f64) -> Result<[Sample; 3]> {
        self.check()?;
        let ([x, y], [across, along, _]) = (self.place, self.row.map(|share| share * spacing));
        let sample = |(finger, met): (f64, Option<f64>)| Sample {
            place: [x + finger * across, y + finger * along],
            height: met.unwrap_or(self.lowest.max(0.0)),
            is_contact: met.is_some(),
        };
        let [first, middle, last] = self.met;
        Ok([(-1.0, first), (0.0, middle), (1.0, last)].map(sample))
    }

    fn check(&self) -> Result<()> {
        let [x, y] = self.place;
        let heights = self.met.into_iter().flatten();
        let stated = [("x", x), ("y", y), ("lowest", self.lowest)].into_iter();
        reachable(stated.chain(heights.clone().map(|height| ("a height", height))))?;
        if let Some(height) = heights.into_iter().find(|height| *height < -BELOW) {
            return Err(too_low(-height));
        }
        touch_of_seconds([None; 3], Some([0.0, 0.0, -1.0]), Some(self.row))?;
        Ok(())
    }
}

/// Direction of the row of fingers at an angle from the x axis, in degrees.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) beyond a full turn to either side.
pub fn row(degrees: f64) -> Result<[f64; 3]> {
    if !(-360.0..=360.0).contains(&degrees) {
        return Err(Error::setting("alignment", degrees, "degrees from -360 to 360, or a unit vector"));
    }
    let (sin, cos) = degrees.to_radians().sin_cos();
    Ok([cos, sin, 0.0])
}
