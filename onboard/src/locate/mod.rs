//! Recognition of an object on a table and of its place: from touches of a hand that comes straight down at a known position.
//!
//! ```text
//! Touch with a position ──► heights of three fingers ──► cells of (placement, yaw, x, y) ──► Verdict, Pose
//!        ▲                                                          │
//!        └──────────────────────── where to touch next ◄────────────┘
//! ```
//!
//! [`Maps`] are opened from bytes, which are checked once. A [`Locator`] keeps the touches, and after each of them searches the
//! cells anew, best first: a coarse cell has the likelihood of the interval of heights in its window (a branch and bound over
//! precomputed pyramids, as in Hess and others, *Real-time loop closure in 2D LIDAR SLAM*, 2016). The sum over all cells,
//! refined or not, is the evidence. [`Locator::choose`] proposes the approach that tells most about the object and its pose.
//!
//! All of it is integer arithmetic, so every machine gives the same bits.

mod belief;
mod cell;
mod choose;
mod locator;
mod maps;
mod number;
mod pose;
mod seen;
#[cfg(test)]
pub(crate) mod tests;

#[cfg(feature = "station")]
pub(crate) use cell::Cell;
pub use choose::POSE;
pub use locator::{AtMost, Effort, Exhausted, Hand, Locator, TESTED};
pub use maps::{BEYOND, DISTANCES, LIKELIHOODS_LENGTH, MAPS_LENGTH, Maps, PLACEMENT_LENGTH, WIDTHS, WITHIN};
pub use palpate_shared::{Approach, TablePose as Pose};
pub use seen::{Contact, Seen};
