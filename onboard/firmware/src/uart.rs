//! The mps2 machines' first UART as an [`embedded_io`] transport: received by interrupt, sent by waiting.

use crate::chip::{self, UartRegisters};
use core::cell::RefCell;
use core::convert::Infallible;
use critical_section::Mutex;
use embedded_io::{ErrorType, Read, Write};
use heapless::spsc::{Consumer, Producer, Queue};

/// Bytes that may wait for the main loop: 22 ms at 115,200 baud.
const WAITING: usize = 256;

/// Cycles of the 25 MHz clock for a bit at 115,200 baud.
pub const BAUD_DIVIDER: u32 = 217;

const LINK: UartRegisters = UartRegisters::FIRST;

/// The interrupt's end of the queue.
static RECEIVER: Mutex<RefCell<Option<Producer<'static, u8>>>> = Mutex::new(RefCell::new(None));

/// The UART.
pub struct Uart {
    received: Consumer<'static, u8>,
}

impl Uart {
    /// Sets the UART up, once.
    ///
    /// # Panics
    /// The second time.
    pub fn take() -> Self {
        let queue = cortex_m::singleton!(: Queue<u8, WAITING> = Queue::new()).expect("the UART is taken once");
        let (producer, received) = queue.split();
        critical_section::with(|cs| RECEIVER.replace(cs, Some(producer)));
        LINK.enable(BAUD_DIVIDER);
        chip::unmask(chip::UART_RECEIVED);
        Self { received }
    }
}

/// The UART's receive interrupt.
pub fn received() {
    critical_section::with(|cs| {
        let mut receiver = RECEIVER.borrow_ref_mut(cs);
        let Some(queue) = receiver.as_mut() else { return };
        LINK.clear_received();
        while queue.ready() {
            match LINK.read() {
                Some(byte) => drop(queue.enqueue(byte)),
                None => return,
            }
        }
        // The queue is full: the byte waits in the UART until the main loop has made room.
        chip::mask(chip::UART_RECEIVED);
    });
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        if buffer.is_empty() {
            return Ok(0);
        }
        loop {
            let mut count = 0;
            while let Some(slot) = buffer.get_mut(count)
                && let Some(byte) = self.received.dequeue()
            {
                *slot = byte;
                count += 1;
            }
            chip::unmask(chip::UART_RECEIVED);
            if count > 0 {
                return Ok(count);
            }
            // With interrupts held back none can come between the look and the sleep; a pending one ends the sleep.
            critical_section::with(|_| {
                if !self.received.ready() {
                    cortex_m::asm::wfi();
                }
            });
        }
    }
}

impl embedded_io::ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.received.ready())
    }
}

impl Write for Uart {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Infallible> {
        let Some(&byte) = buffer.first() else { return Ok(0) };
        while !LINK.write(byte) {}
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
