//! Recognition of an object and its place on a table, from touches of a hand whose position is known.
//!
//! ```text
//!     meshes ──standing──► poses on a table ──cast──┬──► surfaces ──write──► maps ──► locator ──► verdict, poses, next approach
//!  recorded touches with positions ──────────learn──┘                          │           ▲
//!                                           the same poses on a simulated table (world) ───┴──► sequences ──► thresholds, promise
//! ```
//!
//! [`cast`] and [`learn`](fn@learn) make a height map of each placement, [`write`](fn@write) the model that a chip reads, [`locating`] follows
//! approaches with the chip's own code, and [`calibrate`](fn@calibrate) finds thresholds that keep a promise on approaches to
//! objects on a simulated table, chosen or at random.

mod contacts;
mod follow;
mod grid;
mod inspect;
mod learn;
mod lying;
mod pose;
mod promise;
mod refused;
mod register;
mod shape;
#[cfg(test)]
mod shape_tests;
mod stated;
mod surface;
#[cfg(feature = "train")]
mod table;
mod world;
mod write;

pub(crate) use follow::CELLS;
pub use follow::{Locating, TOUCHES, locating, seen, within, workspace};
pub use inspect::{Inspected, MapsFile, OfPlacement, Promised, hand, inspect, names, stated};
pub use learn::{cast, learn, probe_of};
pub use lying::Lying;
pub use palpate_onboard::locate::{Approach, Effort, Hand, Maps, POSE, Pose, Seen, TESTED};
pub use pose::Until;
pub use promise::{Calibrated, Evaluation, LeftOut, Terms, ToPlace, calibrate, calibrate_recorded, evaluate};
pub use refused::{no_hand, not_maps, refused};
pub use shape::{Relief, Sample, Shape, samples};
pub use stated::{Heights, row};
pub use surface::Surface;
#[cfg(feature = "train")]
pub use table::{BareTable, Measured, REACH, bare_table};
pub(crate) use world::Drawn;
pub use world::{Aimed, Real, Standing, Truth, World, standing};
pub use write::write;

use crate::error::{Error, Result};

/// Settings of a model of maps.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CastSettings {
    /// Cells of 1 mm, otherwise of 2 mm: a quarter of the bytes.
    pub fine: bool,
    /// Half of the side of the square in which an object's origin is looked for, in millimeters.
    pub range: f64,
    /// Standard deviation of the height of a contact, in millimeters.
    pub noise: f64,
    /// Standard deviation of the hand's position, in millimeters.
    pub position: f64,
    /// Share of contacts that are lost.
    pub lost: f64,
    /// Density of heights that nothing explains, for each millimeter.
    pub outliers: f64,
    /// Share of contacts with the table that are not felt.
    pub table_missed: f64,
    /// Standard deviation of an object's move in an approach, in millimeters.
    pub drift: f64,
    /// Standard deviation of an object's turn in an approach, in degrees.
    pub drift_yaw: f64,
    /// Factor of the half of poses' intervals, in Q8; 0: 1.
    pub stretch: u16,
    /// Posterior at which an object is named until the model is calibrated: 1 less this.
    pub error_rate: f64,
    /// Limit of touches.
    pub max_touches: u32,
}

impl Default for CastSettings {
    fn default() -> Self {
        Self {
            fine: true,
            range: 30.0,
            noise: 0.5,
            position: 0.0,
            lost: 0.02,
            outliers: 1e-4,
            table_missed: 0.02,
            drift: 0.0,
            drift_yaw: 0.0,
            stretch: 0,
            error_rate: 0.01,
            max_touches: 25,
        }
    }
}

impl CastSettings {
    /// These settings for noise that is stated; what it leaves open stays.
    #[must_use]
    pub fn expecting(self, real: &Real) -> Self {
        let stated = |stated: f64, own: f64| if stated > 0.0 { stated } else { own };
        Self {
            noise: stated(real.height, self.noise),
            lost: stated(real.lost, self.lost),
            position: stated(real.position, self.position),
            drift: stated(real.drift, self.drift),
            drift_yaw: stated(real.drift_yaw, self.drift_yaw),
            ..self
        }
    }

    /// Side of a cell, in millimeters.
    fn cell(&self) -> f64 {
        if self.fine { 1.0 } else { 2.0 }
    }

    /// Root cells along a side: at most 15 mm each, or small objects are missed.
    fn roots(&self) -> u8 {
        ((2.0 * self.range / 15.0).ceil() as u8).max(1)
    }

    /// Standard deviation that rounding to cells adds to heights, and what the position's error does on slopes, in millimeters.
    fn blur(&self) -> f64 {
        0.5_f64.hypot(1.1 * self.position)
    }

    fn margin(&self) -> f64 {
        ((1.0 - self.error_rate) / self.error_rate).ln()
    }

    /// Rejects settings out of range.
    ///
    /// # Errors
    /// [`Kind::Setting`](crate::error::Kind::Setting) naming the field.
    pub fn check(&self) -> Result<()> {
        let within = [
            ("range", self.range, 1.0, 112.0, "a number of millimeters from 1 to 112"),
            ("noise", self.noise, 0.05, 5.0, "a number of millimeters from 0.05 to 5"),
            ("position", self.position, 0.0, 5.0, "a number of millimeters from 0 to 5"),
            ("lost", self.lost, 1e-4, 0.5, "a share from 0.0001 to 0.5"),
            ("outliers", self.outliers, 1e-6, 0.1, "a number from 1e-6 to 0.1"),
            ("table_missed", self.table_missed, 1e-4, 1.0, "a share from 0.0001 to 1"),
            ("drift", self.drift, 0.0, 10.0, "a number of millimeters from 0 to 10"),
            ("drift_yaw", self.drift_yaw, 0.0, 3.0, "a number of degrees from 0 to 3"),
            ("error_rate", self.error_rate, 1e-9, 0.5, "a share from 1e-9 to 0.5"),
        ];
        for (name, value, least, most, allowed) in within {
            if !(least..=most).contains(&value) {
                return Err(Error::setting(name, value, allowed));
            }
        }
        let most = TOUCHES as u32;
        if !(1..=most).contains(&self.max_touches) {
            return Err(Error::setting("max_touches", self.max_touches, format!("1 to {most}")));
        }
        Ok(())
    }
}
