//! Pins read in an interrupt, touches made in the main loop, a lock-free queue between them.

use super::{Clock, Edge, Effector, Fault, Finger, Fingers};
use embedded_hal::digital::InputPin;
use heapless::spsc::{Consumer, Producer};
use palpate_shared::Touch;

/// The interrupt's side: reads the pins and queues what changed.
///
/// A queue of 64 holds 20 bounces of each finger; an edge takes 8 bytes.
#[derive(Debug)]
pub struct Watcher<A, B, C> {
    fingers: Fingers<A, B, C>,
    /// An edge did not fit into the queue.
    lost: bool,
    /// Pins that could not be read, and that nobody has been told of.
    unreadable: [bool; 3],
}

impl<A: InputPin, B: InputPin, C: InputPin> Watcher<A, B, C> {
    /// Watches three pins. They are read at once, so that a switch that is closed already is seen.
    pub fn start(fingers: Fingers<A, B, C>, clock: &impl Clock, queue: &mut Producer<'_, Edge>) -> Self {
        let mut watcher = Self { fingers, lost: false, unreadable: [false; 3] };
        watcher.interrupt(clock, queue);
        watcher
    }

    /// The pins, to clear the interrupt's cause.
    pub const fn pins(&mut self) -> (&mut A, &mut B, &mut C) {
        self.fingers.pins()
    }

    /// Call it in the interrupt of any of the three pins, after clearing the interrupt's cause.
    ///
    /// Cost: about 100 instructions and the reading of three pins; never waits.
    pub fn interrupt(&mut self, clock: &impl Clock, queue: &mut Producer<'_, Edge>) {
        let Self { fingers, lost, unreadable } = self;
        // One at a time, so that none is missed where several cannot be read.
        while let Err(fault) = fingers.read(clock.micros(), |edge| {
            let taken = queue.enqueue(Edge { after_loss: *lost, ..edge }).is_ok();
            *lost = !taken;
            taken
        }) {
            if let Some(finger) = fault.finger() {
                *finger.of(unreadable) = true;
            }
        }
    }

    /// Call it in the main loop, before [`drain`] and with the pins' interrupt held off: an edge that did not fit into
    /// the queue is offered again, and [`Effector::edge`] then says [`Fault::Overrun`]. Returns a pin's fault, which is
    /// for [`Effector::report`]; call it until there is none.
    pub fn service(&mut self, clock: &impl Clock, queue: &mut Producer<'_, Edge>) -> Option<Fault> {
        if self.lost {
            self.interrupt(clock, queue);
        }
        Finger::ALL.into_iter().find(|finger| core::mem::take(finger.of(&mut self.unreadable))).map(Fault::Unreadable)
    }
}

/// The main loop's side: takes edges from the queue until there is a touch or a fault, or, when the queue is empty, lets
/// the time pass. Call it until it returns `Ok(None)`, then sleep until the next interrupt or the next millisecond.
///
/// # Errors
/// A [`Fault`].
pub fn drain(
    effector: &mut Effector,
    queue: &mut Consumer<'_, Edge>,
    clock: &impl Clock,
) -> Result<Option<Touch>, Fault> {
    loop {
        // The time is read before the queue is found empty: an edge that comes in between is drained first, one that
        // comes later is later.
        let now = clock.micros();
        let Some(edge) = queue.dequeue() else { return effector.poll(now) };
        match effector.edge(edge) {
            Ok(None) => {}
            outcome => return outcome,
        }
    }
}
