//! Pins read in an interrupt, touches made in the main loop, a queue between them.

use super::{Clock, Edge, Effector, Fault, Finger, Fingers};
use embedded_hal::digital::InputPin;
use heapless::Deque;
use palpate_shared::Touch;

/// Message of the pins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sensed {
    /// A switch has closed or opened.
    Edge(Edge),
    /// A pin cannot be read, or edges were lost.
    Fault(Fault),
    /// Nothing more has happened until this time on the [`Clock`].
    Nothing(u32),
}

/// The pins and a queue of their edges, shared by the pins' interrupt and the main loop, as in a
/// `critical_section::Mutex<RefCell<Option<Watcher<…>>>>`.
///
/// 64 edges are 20 bounces of each finger.
#[derive(Debug)]
pub struct Watcher<A, B, C, const EDGES: usize = 64> {
    fingers: Fingers<A, B, C>,
    edges: Deque<Edge, EDGES>,
    /// An edge did not fit into the queue.
    lost: bool,
    /// Pins that could not be read, and that nobody has been told of.
    unreadable: [bool; 3],
}

impl<A: InputPin, B: InputPin, C: InputPin, const EDGES: usize> Watcher<A, B, C, EDGES> {
    /// Watches three pins. They are read at once, so that a switch that is closed already is seen.
    pub fn start(fingers: Fingers<A, B, C>, clock: &impl Clock) -> Self {
        let mut watcher = Self { fingers, edges: Deque::new(), lost: false, unreadable: [false; 3] };
        watcher.interrupt(clock);
        watcher
    }

    /// The pins, to clear the interrupt's cause.
    pub const fn pins(&mut self) -> (&mut A, &mut B, &mut C) {
        self.fingers.pins()
    }

    /// The level of each pin when it was last read, to wait for another level: true is high.
    pub const fn is_high(&self) -> [bool; 3] {
        self.fingers.is_high()
    }

    /// Call it in the interrupt of any of the three pins, after clearing the interrupt's cause.
    ///
    /// Cost: a few instructions and the reading of three pins; never waits.
    pub fn interrupt(&mut self, clock: &impl Clock) {
        self.look(clock, false);
    }

    /// Call it instead of [`Watcher::interrupt`] where the interrupt was held off for longer than a contact time may be
    /// wrong, as while flash is erased: a change that is found now has happened at a time that nobody knows, and
    /// the touch is dropped with [`Fault::Overrun`].
    pub fn interrupt_late(&mut self, clock: &impl Clock) {
        self.look(clock, true);
    }

    /// Reads the pins. Changes that are found `late` count as those after a loss.
    fn look(&mut self, clock: &impl Clock, late: bool) {
        let Self { fingers, edges, lost, unreadable } = self;
        let mut after_loss = *lost || late;
        // One at a time, so that none is missed where several cannot be read.
        while let Err(fault) = fingers.read(clock.micros(), |edge| {
            let taken = edges.push_back(Edge { after_loss, ..edge }).is_ok();
            after_loss = !taken;
            *lost = after_loss;
            taken
        }) {
            if let Some(finger) = fault.finger() {
                *finger.of(unreadable) = true;
            }
        }
    }

    /// Edges that wait for the main loop.
    pub fn waiting(&self) -> usize {
        self.edges.len()
    }

    /// True if no edge waits for the main loop: it may sleep.
    pub fn is_idle(&self) -> bool {
        self.edges.is_empty() && !self.lost
    }

    /// Call it in the main loop, with the pins' interrupt held off: what has happened, in its order. Of an edge that did not
    /// fit into the queue, what is left to be seen is offered again, and [`Effector::edge`] then says [`Fault::Overrun`];
    /// where nothing is left, as of a switch that has closed and opened again, this says so itself.
    pub fn sense(&mut self, clock: &impl Clock) -> Sensed {
        if self.lost && self.edges.is_empty() {
            self.interrupt(clock);
        }
        if let Some(finger) = Finger::ALL.into_iter().find(|finger| core::mem::take(finger.of(&mut self.unreadable))) {
            return Sensed::Fault(Fault::Unreadable(finger));
        }
        if self.edges.is_empty() && core::mem::take(&mut self.lost) {
            return Sensed::Fault(Fault::Overrun);
        }
        // With the interrupt held off no edge can come between the look and the clock.
        self.edges.pop_front().map_or_else(|| Sensed::Nothing(clock.micros()), Sensed::Edge)
    }
}

/// The main loop's side: takes what `sense` says until there is a touch or a fault, or, when nothing more has happened, lets
/// the time pass. Call it until it returns `Ok(None)`, then sleep until the next interrupt or until [`Effector::due`].
///
/// # Errors
/// A [`Fault`].
pub fn drain(effector: &mut Effector, mut sense: impl FnMut() -> Sensed) -> Result<Option<Touch>, Fault> {
    loop {
        let edge = match sense() {
            Sensed::Edge(edge) => edge,
            Sensed::Fault(fault) => {
                effector.report(fault);
                continue;
            }
            Sensed::Nothing(now) => return effector.poll(now),
        };
        match effector.edge(edge) {
            Ok(None) => {}
            outcome => return outcome,
        }
    }
}
