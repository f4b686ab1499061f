//! Pins and a clock, read in a loop.

use super::{Clock, Effector, EffectorSettings, Fault, Fingers, State};
use embedded_hal::digital::InputPin;
use palpate_shared::Touch;

/// A probe that is read by calling [`Probe::poll`] in a loop.
#[derive(Debug)]
pub struct Probe<A, B, C, T> {
    fingers: Fingers<A, B, C>,
    clock: T,
    effector: Effector,
}

impl<A: InputPin, B: InputPin, C: InputPin, T: Clock> Probe<A, B, C, T> {
    /// A probe of three pins and a clock.
    pub fn new(fingers: Fingers<A, B, C>, clock: T, settings: EffectorSettings) -> Self {
        Self { fingers, clock, effector: Effector::new(settings) }
    }

    /// Reads the pins once. Contact times are right to the interval between two calls, so call it at least once a
    /// millisecond: on a probe at 10 units per second that is a hundredth of a unit.
    ///
    /// # Errors
    /// A [`Fault`]; go on polling.
    pub fn poll(&mut self) -> Result<Option<Touch>, Fault> {
        let now = self.clock.micros();
        let effector = &mut self.effector;
        let mut outcome = effector.poll(now);
        let read = self.fingers.read(now, |edge| {
            // While there is something to hand over, a change waits for the next call.
            let room = matches!(outcome, Ok(None));
            if room {
                outcome = effector.edge(edge);
            }
            room
        });
        if let Err(fault) = read {
            effector.report(fault);
        }
        match outcome {
            Ok(None) => self.effector.poll(now),
            outcome => outcome,
        }
    }

    /// Phase of the touch.
    pub const fn state(&self) -> State {
        self.effector.state()
    }

    /// The pins and the clock again.
    pub fn into_parts(self) -> (Fingers<A, B, C>, T) {
        (self.fingers, self.clock)
    }
}
