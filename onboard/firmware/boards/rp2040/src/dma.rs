//! The UART through DMA, with the feature `dma`: bytes arrive while nothing may run, including while the flash is erased, and
//! frames leave while the chip sleeps.
//!
//! A channel writes what arrives into a ring and never ends. The edge of a start bit wakes the chip, which then looks every
//! two milliseconds until the line is quiet.

use crate::shared::{Uart, WAITING, with};
use core::sync::atomic::{AtomicU8, Ordering, fence};
use hal::dma::{CH0, CH1, Channel, DMAExt, SingleChannel};
use hal::pac::{self, interrupt};
use rp2040_hal as hal;

/// Microseconds between two looks at a line that is not quiet.
const LOOK: u32 = 2_000;
/// Request of the UART for a byte to send, by the data sheet's number.
const SEND: u8 = 20;
/// Request of the UART to take a byte that it has received.
const RECEIVE: u8 = 21;
/// The falling edge of GP1, in the registers of the first eight pins' interrupts.
const EDGE: u32 = 1 << 6;

/// A ring for DMA starts at a multiple of its length.
#[repr(align(2048))]
struct Ring([AtomicU8; WAITING]);

static RECEIVED: Ring = Ring([const { AtomicU8::new(0) }; WAITING]);
static SENT: [AtomicU8; 64] = [const { AtomicU8::new(0) }; 64];

/// Bytes that have come.
pub(crate) struct Line {
    channel: Channel<CH0>,
    /// Place in the ring of the first byte that nobody has taken.
    taken: usize,
    /// End of what had come at the last look, and when that was new, while the line is not quiet.
    heard: Option<(usize, u32)>,
}

/// The way out.
pub(crate) struct Sender(Channel<CH1>);

/// The interrupt of a frame that has left, or of a ring that was written for 2³² bytes.
pub(crate) const INTERRUPT: pac::Interrupt = pac::Interrupt::DMA_IRQ_0;

/// Begins to listen. The UART goes on without its owner.
pub(crate) fn open(_: Uart, dma: pac::DMA, resets: &mut pac::RESETS) -> (Line, Sender) {
    let channels = dma.split(resets);
    let (mut line, mut sender) = (Line { channel: channels.ch0, taken: 0, heard: None }, Sender(channels.ch1));
    line.channel.enable_irq0();
    sender.0.enable_irq0();
    line.start();
    line.watch_edge(true);
    (line, sender)
}

/// Starts a transfer of bytes between memory and the UART.
#[allow(unsafe_code)] // Addresses and lengths are plain numbers to the registers.
fn start(channel: &impl SingleChannel, from: u32, to: u32, count: u32, request: u8) {
    let registers = channel.ch();
    let is_received = request == RECEIVE;
    // What was written to memory is there before the channel reads it.
    fence(Ordering::SeqCst);
    // SAFETY: both ends are the UART's data register and statics of atomic bytes, whose length the ring or the count keeps to.
    unsafe {
        registers.ch_read_addr().write(|w| w.bits(from));
        registers.ch_write_addr().write(|w| w.bits(to));
        registers.ch_trans_count().write(|w| w.bits(count));
        registers.ch_ctrl_trig().write(|w| {
            w.treq_sel().bits(request).chain_to().bits(channel.id()).data_size().size_byte();
            w.incr_read().bit(!is_received).incr_write().bit(is_received);
            if is_received {
                w.ring_sel().set_bit().ring_size().bits(WAITING.ilog2() as u8);
            }
            w.en().set_bit()
        });
    }
}

/// The UART's data register.
fn data() -> u32 {
    pac::UART0::ptr() as u32
}

impl Line {
    /// Starts the channel at the ring's beginning, or goes on where it ended.
    fn start(&mut self) {
        let to = RECEIVED.0.as_ptr() as u32 + self.end() as u32;
        start(&self.channel, data(), to, u32::MAX, RECEIVE);
    }

    /// Place in the ring of the next byte to come.
    fn end(&self) -> usize {
        self.channel.ch().ch_write_addr().read().bits() as usize % WAITING
    }

    /// Takes a byte.
    pub(crate) fn pop(&mut self) -> Option<u8> {
        if self.is_empty() {
            return None;
        }
        let byte = RECEIVED.0.get(self.taken)?.load(Ordering::Acquire);
        self.taken = (self.taken + 1) % WAITING;
        Some(byte)
    }

    /// True if no byte waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.taken == self.end()
    }

    /// Returns how many of `wait` microseconds the chip may sleep from `now`: until the next look, while the line is not quiet.
    pub(crate) fn longest_sleep(&mut self, wait: u32, now: u32) -> u32 {
        let Some((heard, since)) = self.heard else { return wait };
        let end = self.end();
        if heard != end {
            self.heard = Some((end, now));
        } else if now.wrapping_sub(since) >= LOOK {
            self.heard = None;
            self.watch_edge(true);
        }
        // Also after the last look: a byte that began just now has no edge to come.
        wait.min(LOOK)
    }

    /// A byte begins: looks follow, since its further edges would all wake the chip.
    #[allow(unsafe_code)] // See `watch_edge`.
    pub(crate) fn edge(&mut self, now: u32) {
        // SAFETY: a bit of a pin that is nobody's but the UART's.
        let has_edge = unsafe { (*pac::IO_BANK0::ptr()).proc0_ints(0).read().bits() } & EDGE != 0;
        if has_edge {
            self.watch_edge(false);
            self.heard = Some((self.end(), now));
        }
    }

    /// Begins or ends the interrupt of the wire's falling edge, without those so far.
    #[allow(unsafe_code)] // The pin went into the UART.
    fn watch_edge(&mut self, is_watched: bool) {
        // SAFETY: the bit of a pin that is nobody's but the UART's; others in the register change only in critical sections.
        critical_section::with(|_| unsafe {
            let bank = &*pac::IO_BANK0::ptr();
            bank.intr(0).write(|w| w.bits(EDGE));
            bank.proc0_inte(0).modify(|r, w| w.bits(r.bits() & !EDGE | if is_watched { EDGE } else { 0 }));
        });
    }
}

impl Sender {
    /// Sleeps until the frame before has left, and starts this one.
    pub(crate) fn send(&mut self, frame: &[u8]) {
        for part in frame.chunks(SENT.len()) {
            self.wait();
            part.iter().zip(&SENT).for_each(|(byte, to)| to.store(*byte, Ordering::Release));
            start(&self.0, SENT.as_ptr() as u32, data(), part.len() as u32, SEND);
        }
    }

    fn wait(&self) {
        while critical_section::with(|_| {
            let is_busy = self.0.ch().ch_ctrl_trig().read().busy().bit_is_set();
            // With interrupts held back none can come between the look and the sleep; a pending one ends the sleep.
            if is_busy {
                cortex_m::asm::wfi();
            }
            is_busy
        }) {}
    }
}

/// A frame has left. Or the ring's channel has counted to its end, which takes four days without a pause.
#[interrupt]
#[allow(unsafe_code)] // Flags of the two channels, which nothing else clears.
fn DMA_IRQ_0() {
    with(|shared| {
        let is_over = shared.line.channel.check_irq0();
        // SAFETY: as above.
        unsafe { (*pac::DMA::ptr()).ints0().write(|w| w.bits(0xffff)) };
        if is_over {
            shared.line.start();
        }
    });
}
