//! Three input pins, read as fingers.

use super::{Edge, Fault, Finger};
use embedded_hal::digital::InputPin;

/// Level of a pin that means contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Active {
    /// The switch pulls the pin up.
    High,
    /// The switch pulls the pin down, against a pull-up: the usual wiring of a micro-switch.
    Low,
}

/// Three pins and their known levels.
#[derive(Debug)]
pub struct Fingers<A, B, C> {
    first: A,
    middle: B,
    last: C,
    active: Active,
    /// Levels reported so far.
    closed: [bool; 3],
    unreadable: [bool; 3],
}

impl<A: InputPin, B: InputPin, C: InputPin> Fingers<A, B, C> {
    /// Three pins in the order of the fingers along the row.
    pub const fn new(first: A, middle: B, last: C, active: Active) -> Self {
        Self { first, middle, last, active, closed: [false; 3], unreadable: [false; 3] }
    }

    /// The pins, to clear an interrupt's cause.
    pub const fn pins(&mut self) -> (&mut A, &mut B, &mut C) {
        (&mut self.first, &mut self.middle, &mut self.last)
    }

    /// The level of each pin when it was last read and its change taken: true is high.
    pub(super) const fn is_high(&self) -> [bool; 3] {
        let [a, b, c] = self.closed;
        let active = matches!(self.active, Active::High);
        [a == active, b == active, c == active]
    }

    /// The pins again.
    pub fn into_pins(self) -> (A, B, C) {
        (self.first, self.middle, self.last)
    }

    /// Reads the three pins and offers every change to `tell`, which says whether it took it: a change that was not
    /// taken is offered again next time. Each pin is read exactly once.
    ///
    /// # Errors
    /// [`Fault::Unreadable`], the first time that a pin cannot be read; the others have been read all the same. Where
    /// several cannot be read, the first of them: the next call returns the next one.
    pub fn read(&mut self, at: u32, mut tell: impl FnMut(Edge) -> bool) -> Result<(), Fault> {
        let levels = [
            self.first.is_high().map_err(drop),
            self.middle.is_high().map_err(drop),
            self.last.is_high().map_err(drop),
        ];
        let mut fault = Ok(());
        for (finger, level) in Finger::ALL.into_iter().zip(levels) {
            let unreadable = finger.of(&mut self.unreadable);
            let known = finger.of(&mut self.closed);
            match level {
                Err(()) if *unreadable => {}
                // Only one of several can be returned.
                Err(()) if fault.is_err() => {}
                Err(()) => {
                    *unreadable = true;
                    fault = Err(Fault::Unreadable(finger));
                }
                Ok(high) => {
                    *unreadable = false;
                    let closed = high == (self.active == Active::High);
                    if closed != *known && tell(Edge::new(finger, closed, at)) {
                        *known = closed;
                    }
                }
            }
        }
        fault
    }
}
