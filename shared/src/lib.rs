//! The common language of Palpate's host and chip.
//!
//! A probe with three fingers moves toward an object; each finger reports when it makes contact. The path of one such
//! [`Touch`] through this crate:
//!
//! ```text
//! contact times ──► Touch ──► Descriptor ──► Features (whole numbers)
//! ```
//!
//! The trainer on the host and the recognizer on the chip compute a feature with the same lines of code, here, so that
//! neither rounds where the other did not: times are whole microseconds, direction cosines are Q15 integers.
//!
//! ```
//! use palpate_shared::{Descriptor, Touch};
//!
//! let touch = Touch::from_micros([30_000, 0, 50_000]);
//! assert_eq!(Descriptor::Curvature.features(&touch).as_slice(), [80_000, 20_000]);
//! ```
//!
//! `no_std`, without a heap and without `unsafe`.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

#[cfg(test)]
extern crate std;

mod checksum;
mod descriptor;
pub mod format;
#[cfg(feature = "link")]
pub mod link;
mod pattern;
mod place;
mod poses;
mod touch;

pub use checksum::checksum;
pub use descriptor::{Descriptor, Features, MISSING_FEATURE};
pub use pattern::{ContactPattern, Patterns};
pub use place::{Approach, TablePose};
pub use poses::{DIRECTIONS, MOST_POSES, Poses};
#[cfg(feature = "position")]
pub use touch::Position;
pub use touch::{ContactTime, Pose, Q15_ONE, Touch};
