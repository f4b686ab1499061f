//! Faults of three switches.

use super::Finger;
use core::fmt;
#[cfg(feature = "link")]
use palpate_shared::link::{Event, FaultKind};

/// A fault of the effector, and which finger has it. The driver goes on: every other touch is still reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Fault {
    /// The finger has been closed for longer than [`EffectorSettings::stuck`](super::EffectorSettings::stuck). Reported once each time;
    /// no touch can begin before it opens.
    Stuck(Finger),
    /// The finger opened and closed for longer than [`EffectorSettings::settle`](super::EffectorSettings::settle). The touch, if there
    /// was one, is dropped.
    Bouncing(Finger),
    /// The finger was missing in [`EffectorSettings::silent_after`](super::EffectorSettings::silent_after) touches in a row.
    Silent(Finger),
    /// The finger's pin cannot be read. Reported once, until it can be read again.
    Unreadable(Finger),
    /// Edges came faster than the main loop drained them, and some were lost. The touch, if there was one, is dropped.
    Overrun,
    /// The [`Clock`](super::Clock) went back by more than 33 ms while a time was running: it has fewer than 32 bits, or two
    /// readings are out of order. The touch, if there was one, is dropped, and time goes on from the new reading.
    Clock,
}

impl Fault {
    /// The finger that has the fault, if it is one finger's.
    pub const fn finger(self) -> Option<Finger> {
        match self {
            Self::Stuck(finger) | Self::Bouncing(finger) | Self::Silent(finger) | Self::Unreadable(finger) => {
                Some(finger)
            }
            Self::Overrun | Self::Clock => None,
        }
    }
}

/// Converts to the link's message.
#[cfg(feature = "link")]
impl From<Fault> for Event {
    fn from(fault: Fault) -> Self {
        let kind = match fault {
            Fault::Stuck(_) => FaultKind::Stuck,
            Fault::Bouncing(_) => FaultKind::Bouncing,
            Fault::Silent(_) => FaultKind::Silent,
            Fault::Unreadable(_) => FaultKind::Unreadable,
            Fault::Overrun => FaultKind::Overrun,
            Fault::Clock => FaultKind::Clock,
        };
        let finger = match fault.finger() {
            Some(Finger::First) => 0,
            Some(Finger::Middle) => 1,
            Some(Finger::Last) => 2,
            None => u8::MAX,
        };
        Self::Fault { kind, finger }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stuck(finger) => {
                write!(f, "{finger} stays closed: free the switch, or check its wiring and active level")
            }
            Self::Bouncing(finger) => {
                write!(f, "{finger} does not settle: check for a loose contact, or raise the settle time")
            }
            Self::Silent(finger) => write!(f, "{finger} has not touched for many touches: check its wiring"),
            Self::Unreadable(finger) => write!(f, "the pin of {finger} cannot be read: check the port"),
            Self::Overrun => f.write_str("edges were lost: drain the queue more often, or make it longer"),
            Self::Clock => f.write_str("the clock went back: extend the counter to 32 bits of microseconds"),
        }
    }
}

impl core::error::Error for Fault {}
