//! From three switches to touches.
//!
//! Each finger of the probe is a switch that closes on contact. Three layers, each usable without the one above it:
//!
//! | layer | what it does |
//! |---|---|
//! | [`Effector`] | edges (finger, closed or open, microsecond) in, touches and faults out; without pins or a clock |
//! | [`Fingers`] | three [`embedded_hal::digital::InputPin`]s, active high or low, read into edges |
//! | [`Probe`], or [`Watcher`] and [`drain`] | pins and clock together: polled in a loop, or fed by interrupts |
//!
//! ```text
//! polled:      pins ──► Fingers ──► Effector ──► touch or fault        (Probe::poll, at least once per millisecond)
//!
//! interrupts:  pins ──► Watcher, with a queue ──► drain ──► Effector ──► touch or fault
//!              └── in the interrupt ──┘       └──────── in the main loop ─────────┘
//! ```
//!
//! A finger's contact time is the moment of its first closing edge, however long it bounces after that; polled, it is
//! right to one polling interval, by interrupts to the interrupt's latency.
//!
//! A probe with another spacing or speed than the one the model was trained for: [`Scale`], and [`Calibration`] to
//! measure its speed.

mod calibration;
mod debounce;
mod driver;
mod fault;
mod interrupt;
mod pins;
mod polled;
mod scale;
mod settings;

pub use calibration::{Calibration, CalibrationError};
pub use driver::{Effector, State};
pub use fault::Fault;
pub use interrupt::{Sensed, Watcher, drain};
pub use pins::{Active, Fingers};
pub use polled::Probe;
pub use scale::{Geometry, Scale};
pub use settings::EffectorSettings;

/// A clock in microseconds that wraps from `u32::MAX` to 0 (every 71 minutes) and never stops. A counter of fewer bits has to
/// be extended by its overflows: read as it is, each of them within a touch drops that touch with [`Fault::Clock`].
pub trait Clock {
    /// Microseconds since any moment.
    fn micros(&self) -> u32;
}

/// One of the probe's three fingers, in their order along the row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Finger {
    /// One end of the row.
    First,
    /// The one between them.
    Middle,
    /// The other end of the row.
    Last,
}

impl Finger {
    /// The three fingers in order.
    pub const ALL: [Self; 3] = [Self::First, Self::Middle, Self::Last];

    /// This finger's element of `three`.
    pub(crate) const fn of<T>(self, three: &mut [T; 3]) -> &mut T {
        let [first, middle, last] = three;
        match self {
            Self::First => first,
            Self::Middle => middle,
            Self::Last => last,
        }
    }
}

impl core::fmt::Display for Finger {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::First => "the first finger",
            Self::Middle => "the middle finger",
            Self::Last => "the last finger",
        })
    }
}

/// A switch closed or opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Edge {
    /// The finger.
    pub finger: Finger,
    /// Closed (contact) or open.
    pub closed: bool,
    /// Time on the [`Clock`], in microseconds.
    pub at: u32,
    /// True if edges before this one were lost because the queue was full, or the interrupt was held off too long.
    pub after_loss: bool,
}

impl Edge {
    /// An edge with nothing lost before it.
    pub const fn new(finger: Finger, closed: bool, at: u32) -> Self {
        Self { finger, closed, at, after_loss: false }
    }
}

#[cfg(test)]
mod tests;
