//! Recognizes from three switches on three pins, and reports every touch and fault to a host over the UART
//! (`palpate watch`). A verdict ends an object; the next touch begins another.
//!
//! The model is built in; another: `PALPATE_MODEL=/path/to/model.palpate cargo build --release --bin gpio`.
#![no_std]
#![no_main]

use core::cell::RefCell;
use cortex_m_rt::{entry, exception};
use critical_section::Mutex;
use embedded_io::{Read, ReadReady, Write};
use heapless::spsc::{Producer, Queue};
use palpate_firmware::chip::{self, Interrupt};
use palpate_firmware::pins::{Pin, PlayedClock, Player};
use palpate_firmware::uart::{Port, Uart};
use palpate_onboard::Model;
use palpate_onboard::effector::{Active, Edge, Effector, Fault, Fingers, Scale, Settings, Watcher, drain};
use palpate_onboard::station::Station;
use palpate_shared::link::{Decision, Device, DeviceEnd, Event, Progress, TouchMessage};

static MODEL: &[u8] = palpate_onboard::include_model!(env!("PALPATE_MODEL"));
/// Objects that the model may have.
const OBJECTS: usize = 16;

/// What the pin interrupt needs.
struct Interrupted {
    watcher: Watcher<Pin, Pin, Pin>,
    edges: Producer<'static, Edge>,
}

static INTERRUPTED: Mutex<RefCell<Option<Interrupted>>> = Mutex::new(RefCell::new(None));

#[entry]
fn main() -> ! {
    let Ok(model) = Model::new(MODEL) else {
        palpate_firmware::println!("no model is built in: build with PALPATE_MODEL=/path/to/model.palpate");
        palpate_firmware::fail()
    };
    let mut uart = Uart::take(Port::Link);
    let mut player = Player::new();
    let mut station = Station::<OBJECTS>::new(&model);
    let mut end = DeviceEnd::new(Progress::NONE, chip::count_start());
    let mut effector = Effector::new(Settings::default().for_model(&model, &Scale::IDENTITY));

    let Some(queue) = cortex_m::singleton!(: Queue<Edge, 64> = Queue::new()) else { palpate_firmware::fail() };
    let (mut edges, mut received) = queue.split();
    let watcher = Watcher::start(Fingers::new(Pin(0), Pin(1), Pin(2), Active::High), &PlayedClock, &mut edges);
    critical_section::with(|cs| INTERRUPTED.replace(cs, Some(Interrupted { watcher, edges })));
    chip::unmask(chip::PIN_CHANGED);
    end.tell(Event::Started, |frame| send(&mut uart, frame));

    loop {
        let played = player.play();
        if let Ok(true) = uart.read_ready() {
            let mut buffer = [0; 32];
            let count = uart.read(&mut buffer).unwrap_or(0);
            let mut answer = |frame: &[u8]| send(&mut uart, frame);
            end.receive(buffer.get(..count).unwrap_or_default(), &mut station, &mut answer);
        }
        while let Some(fault) = pin_fault() {
            effector.report(fault);
        }
        let event = match drain(&mut effector, &mut received, &PlayedClock) {
            Ok(Some(touch)) => Some(match station.push(&touch, true) {
                Ok(verdict) => {
                    if verdict.decision != Decision::Undecided {
                        station.reset();
                    }
                    Event::Touch { touch: TouchMessage::from(&touch), verdict }
                }
                Err(refusal) => Event::Refused { touch: TouchMessage::from(&touch), refusal },
            }),
            Ok(None) => None,
            Err(fault) => Some(fault.into()),
        };
        match event {
            Some(event) => end.tell(event, |frame| send(&mut uart, frame)),
            // On a board: wake up every millisecond as well, for what is due without an edge.
            None if !played => chip::sleep_unless(|| player.is_ready() || uart.is_ready() || received.ready()),
            None => {}
        }
    }
}

fn send(uart: &mut Uart, frame: &[u8]) {
    match uart.write_all(frame) {
        Ok(()) => {}
    }
}

/// A pin that cannot be read; edges that did not fit into the queue are offered again.
fn pin_fault() -> Option<Fault> {
    critical_section::with(|cs| {
        let mut interrupted = INTERRUPTED.borrow_ref_mut(cs);
        let Interrupted { watcher, edges } = interrupted.as_mut()?;
        watcher.service(&PlayedClock, edges)
    })
}

/// One of the three pins has changed.
fn pin_changed() {
    critical_section::with(|cs| {
        let mut interrupted = INTERRUPTED.borrow_ref_mut(cs);
        let Some(Interrupted { watcher, edges }) = interrupted.as_mut() else { return };
        watcher.interrupt(&PlayedClock, edges);
    });
}

/// Every interrupt is handled here, so that the image needs no interrupt table per chip.
#[allow(unsafe_code)] // cortex-m-rt wants the word; nothing in it needs it.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    match Interrupt::from_number(number) {
        chip::LINK_RECEIVED => Port::Link.received(),
        chip::PINS_RECEIVED => Port::Pins.received(),
        chip::PIN_CHANGED => pin_changed(),
        _ => {}
    }
}
