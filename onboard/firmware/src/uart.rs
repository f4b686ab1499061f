//! The mps2 machines' UARTs as [`embedded_io`] transports: received by interrupt, sent by waiting.

use crate::chip::{self, Interrupt, UartRegisters};
use core::cell::RefCell;
use core::convert::Infallible;
use critical_section::Mutex;
use embedded_io::{ErrorType, Read, Write};
use heapless::spsc::{Consumer, Producer, Queue};

/// Bytes that may wait for the main loop: 22 ms at 115,200 baud.
const WAITING: usize = 256;

/// Cycles of the 25 MHz clock for a bit at 115,200 baud.
const BAUD_DIVIDER: u32 = 217;

/// One of the machine's UARTs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// The link to the host.
    Link,
    /// Pins that a host plays.
    Pins,
}

type Receiver = Mutex<RefCell<Option<Producer<'static, u8>>>>;

/// The interrupts' ends of the queues.
static LINK: Receiver = Mutex::new(RefCell::new(None));
static PINS: Receiver = Mutex::new(RefCell::new(None));

impl Port {
    const fn registers(self) -> UartRegisters {
        match self {
            Self::Link => UartRegisters::FIRST,
            Self::Pins => UartRegisters::SECOND,
        }
    }

    const fn interrupt(self) -> Interrupt {
        match self {
            Self::Link => chip::LINK_RECEIVED,
            Self::Pins => chip::PINS_RECEIVED,
        }
    }

    const fn receiver(self) -> &'static Receiver {
        match self {
            Self::Link => &LINK,
            Self::Pins => &PINS,
        }
    }

    /// The receive interrupt.
    pub fn received(self) {
        critical_section::with(|cs| {
            let mut receiver = self.receiver().borrow_ref_mut(cs);
            let Some(queue) = receiver.as_mut() else { return };
            self.registers().clear_received();
            while queue.ready() {
                match self.registers().read() {
                    Some(byte) => drop(queue.enqueue(byte)),
                    None => return,
                }
            }
            // The queue is full: the byte waits in the UART until the main loop has made room.
            chip::mask(self.interrupt());
        });
    }
}

/// A UART in use.
pub struct Uart {
    port: Port,
    received: Consumer<'static, u8>,
}

impl Uart {
    /// Sets a UART up, once.
    ///
    /// # Panics
    /// The second time.
    pub fn take(port: Port) -> Self {
        let queue = match port {
            Port::Link => cortex_m::singleton!(: Queue<u8, WAITING> = Queue::new()),
            Port::Pins => cortex_m::singleton!(: Queue<u8, WAITING> = Queue::new()),
        };
        let (producer, received) = queue.expect("a UART is taken once").split();
        critical_section::with(|cs| port.receiver().replace(cs, Some(producer)));
        port.registers().enable(BAUD_DIVIDER);
        chip::unmask(port.interrupt());
        Self { port, received }
    }

    /// A received byte, without waiting.
    pub fn receive(&mut self) -> Option<u8> {
        let byte = self.received.dequeue();
        if byte.is_none() {
            chip::unmask(self.port.interrupt());
        }
        byte
    }

    /// Reads the received bytes without waiting; returns their number.
    pub fn receive_all(&mut self, buffer: &mut [u8]) -> usize {
        let mut count = 0;
        while let Some(slot) = buffer.get_mut(count)
            && let Some(byte) = self.receive()
        {
            *slot = byte;
            count += 1;
        }
        count
    }

    /// True if a byte has been received.
    pub fn is_ready(&self) -> bool {
        self.received.ready()
    }
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
            let count = self.receive_all(buffer);
            if count > 0 {
                return Ok(count);
            }
            chip::sleep_unless(|| self.is_ready());
        }
    }
}

impl embedded_io::ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.is_ready())
    }
}

impl Write for Uart {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Infallible> {
        let Some(&byte) = buffer.first() else { return Ok(0) };
        while !self.port.registers().write(byte) {}
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
