//! Pins read in an interrupt, touches made in the main loop, a lock-free queue between them.

use super::{Clock, Edge, Effector, Fault, Fingers};
use embedded_hal::digital::InputPin;
use heapless::spsc::{Consumer, Producer};
use palpate_shared::Touch;

/// The interrupt's side: reads the pins and queues what changed.
///
/// A queue of 64 holds 20 bounces of each finger; an edge takes 8 bytes.
#[derive(Debug)]
pub struct Watcher<A, B, C> {
    fingers: Fingers<A, B, C>,
    lost: bool,
}

impl<A: InputPin, B: InputPin, C: InputPin> Watcher<A, B, C> {
    /// Watches three pins.
    pub const fn new(fingers: Fingers<A, B, C>) -> Self {
        Self { fingers, lost: false }
    }

    /// The pins, to clear the interrupt's cause.
    pub const fn pins(&mut self) -> (&mut A, &mut B, &mut C) {
        self.fingers.pins()
    }

    /// Call it in the interrupt of any of the three pins, after clearing the interrupt's cause, and once at the start.
    ///
    /// Cost: about 100 instructions and the reading of three pins; never waits. An edge that does not fit into the
    /// queue is offered again at the next interrupt, and [`Effector::edge`] then says [`Fault::Overrun`].
    ///
    /// # Errors
    /// [`Fault::Unreadable`].
    pub fn interrupt(&mut self, clock: &impl Clock, queue: &mut Producer<'_, Edge>) -> Result<(), Fault> {
        let Self { fingers, lost } = self;
        fingers.read(clock.micros(), |edge| {
            let taken = queue.enqueue(Edge { after_loss: *lost, ..edge }).is_ok();
            *lost = !taken;
            taken
        })
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
