//! The UART with an interrupt: its FIFO of 32 bytes holds 2.8 ms.

use crate::shared::{Uart, WAITING, Wires, with};
use hal::pac::{self, UART0, interrupt};
use hal::uart::{Reader, Writer};
use heapless::Deque;
use rp2040_hal as hal;

/// Bytes that have come.
pub(crate) struct Line {
    reader: Reader<UART0, Wires>,
    received: Deque<u8, WAITING>,
}

/// The way out.
pub(crate) struct Sender(Writer<UART0, Wires>);

/// Begins to listen.
pub(crate) fn open(uart: Uart, _: pac::DMA, _: &mut pac::RESETS) -> (Line, Sender) {
    let (mut reader, writer) = uart.split();
    reader.enable_rx_interrupt();
    (Line { reader, received: Deque::new() }, Sender(writer))
}

/// The interrupt of bytes that have come.
pub(crate) const INTERRUPT: pac::Interrupt = pac::Interrupt::UART0_IRQ;

impl Line {
    /// Takes a byte.
    pub(crate) fn pop(&mut self) -> Option<u8> {
        self.received.pop_front()
    }

    /// True if no byte waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.received.is_empty()
    }

    /// Returns how many of `wait` microseconds the chip may sleep: all, since bytes wake it.
    pub(crate) fn longest_sleep(&mut self, wait: u32, _: u32) -> u32 {
        wait
    }

    /// Does nothing: no edge of this wire has an interrupt.
    pub(crate) fn edge(&mut self, _: u32) {}
}

impl Sender {
    /// Waits until the last bytes are in the FIFO.
    pub(crate) fn send(&mut self, frame: &[u8]) {
        self.0.write_full_blocking(frame);
    }
}

/// There is something to take: also while the main loop sends, or works.
#[interrupt]
fn UART0_IRQ() {
    with(|shared| {
        let Line { reader, received } = &mut shared.line;
        let mut buffer = [0; 32];
        loop {
            let bytes = match reader.read_raw(&mut buffer) {
                Ok(count) => buffer.get(..count).unwrap_or_default(),
                // A garbled byte is missing, and the host sends it again; those before it are here.
                Err(nb::Error::Other(error)) => error.discarded,
                Err(nb::Error::WouldBlock) => break,
            };
            for byte in bytes {
                // No host that waits for answers sends more.
                let _ = received.push_back(*byte);
            }
        }
    });
}
