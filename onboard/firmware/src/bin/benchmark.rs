//! Cost of a touch on this chip, from the switches to the host: instructions, stack, flash and RAM.
//!
//! The `evaluator` image measures the evaluator alone, model by model, next to other evaluators.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use palpate_firmware::meter::{self, Meter};
use palpate_firmware::{exit, fail, println, sections::Sections};
use palpate_onboard::effector::{Edge, Effector, EffectorSettings, Finger, Geometry, Scale};
use palpate_onboard::station::{NoStorage, Station, serve};
use palpate_onboard::{Model, Recognizer, Stopping};
use palpate_shared::link::{
    Decoder, Detail, Device, DeviceEnd, FRAME_MAX, Frame, Message, Request, TouchMessage, encode,
};
use palpate_shared::{Descriptor, Pose, Touch};

static MODEL: &[u8] = palpate_onboard::include_model!(env!("PALPATE_MODEL"));
/// Objects that a model may have.
const OBJECTS: usize = 16;

/// Prints instructions and stack of an expression.
macro_rules! cost {
    ($meter:ident, $what:literal, $run:expr) => {{
        let instructions = $meter.measure($run);
        println!("{:44} {:8} {:6}", $what, instructions, meter::stack($run));
    }};
}

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { fail() };
    let mut meter = Meter::new(peripherals.SYST);
    let pose = Pose { direction: [1, 2, -32767], alignment: [30_000, 5_000, 9] };
    let touch = Touch::from_micros([30_000, 0, 50_000]).with_pose(pose);

    println!("{:44} {:>8} {:>6}", "", "instr.", "stack");
    cost!(meter, "features: curvature", || Descriptor::Curvature.features(black_box(&touch)));
    cost!(meter, "features: oriented", || Descriptor::Oriented.features(black_box(&touch)));
    effector(&mut meter, &touch);
    link(&mut meter, &touch);
    match Model::new(MODEL) {
        Ok(model) => recognizer(&mut meter, &model, &touch),
        Err(_) => println!("no model is built in: PALPATE_MODEL=/path/to/model.palpate cargo run --release"),
    }
    let sections = Sections::of_this_image();
    let Sections { text, rodata, data, bss } = sections;
    println!("flash {} (text {}, rodata {}, data {})", sections.flash(), text, rodata, data);
    println!("RAM {} (data {}, bss {}) and the stack", sections.ram(), data, bss);
    exit()
}

fn effector(meter: &mut Meter, touch: &Touch) {
    let mut effector = Effector::new(EffectorSettings::default());
    let mut now = 0_u32;
    let mut poll = |effector: &mut Effector| {
        now = now.wrapping_add(1_000);
        effector.poll(now)
    };
    cost!(meter, "effector: poll, waiting", || poll(&mut effector));
    let mut one_touch = || {
        let mut touched = 0_u32;
        for (delay, closed) in [(20_000, true), (200_000, false)] {
            for finger in Finger::ALL {
                now = now.wrapping_add(delay);
                touched += u32::from(effector.edge(Edge::new(finger, closed, now)) != Ok(None));
            }
        }
        touched
    };
    assert!(one_touch() == 1, "six edges are a touch");
    cost!(meter, "effector: a touch, six edges", &mut one_touch);
    let scale = Scale::new(Geometry { spacing: 15, speed: 100 }, Geometry { spacing: 12, speed: 80 });
    let Some(scale) = scale else { fail() };
    cost!(meter, "effector: another spacing and speed", || scale.apply(black_box(touch)));
}

fn touch_frame<'o>(touch: &Touch, number: u32, detail: bool, out: &'o mut [u8; FRAME_MAX]) -> &'o [u8] {
    let request = Request::Touch { touch: TouchMessage::from(touch), detail };
    encode(&Frame { session: 0, message: Message::Request { number, request } }, out)
}

fn link(meter: &mut Meter, touch: &Touch) {
    let mut out = [0; FRAME_MAX];
    let bytes = touch_frame(touch, 1_000, true, &mut out);
    let bare = Touch::new(touch.times());
    for (name, touch) in [("with a pose", touch), ("without", &bare)] {
        // Ten bits per byte; the answer's frame, 18 bytes without detail, comes after it.
        let length = touch_frame(touch, 1_000, true, &mut [0; FRAME_MAX]).len();
        println!("a touch's frame {}: {} bytes, {} touches per second at 115,200 baud", name, length, 11_520 / length);
    }
    let mut decoder = Decoder::new();
    cost!(meter, "link: decode a touch's frame", || {
        bytes.iter().filter(|&&byte| decoder.feed(byte).is_some()).count()
    });
    cost!(meter, "link: encode a touch's frame", || {
        touch_frame(black_box(touch), 1_000, true, &mut [0; FRAME_MAX]).len()
    });
}

fn recognizer(meter: &mut Meter, model: &Model<'_>, touch: &Touch) {
    // Never sure, so that every touch costs the same.
    let never = Stopping::new(1e-15, u32::MAX).and_then(|never| Recognizer::<OBJECTS>::new(model, never).ok());
    let Some(mut recognizer) = never else { fail() };
    println!("the model: {} bytes, {} objects", MODEL.len(), model.object_count());
    let mut margins = [0; OBJECTS];
    cost!(meter, "recognizer: margins", || model.margins(black_box(touch), &mut margins));
    cost!(meter, "recognizer: a touch with its verdict", || {
        // There and back, so that the evidence stays small.
        recognizer.push(black_box(touch))
    });
    cost!(meter, "recognizer: a posterior", || recognizer.posterior(black_box(3)));

    let mut station = Station::<OBJECTS>::new(model);
    let evidence = [1_i64; 10];
    cost!(meter, "station: detail for parity", || Detail::new(black_box(5), black_box(&evidence)));
    cost!(meter, "station: a touch", || station.touch(black_box(touch), false));
    let mut end = DeviceEnd::new(0);
    let mut number = 0;
    for (name, detail) in [("without detail", false), ("with detail", true)] {
        let mut by_link = || {
            let mut out = [0; FRAME_MAX];
            number += 1;
            let bytes = touch_frame(touch, number, detail, &mut out);
            let mut sent = 0;
            end.receive(bytes, &mut station, |frame| sent += frame.len());
            sent
        };
        let sent = by_link();
        let instructions = meter.measure(&mut by_link);
        println!("{:44} {:8} {:6}", "link: a touch, there and back", instructions, meter::stack(&mut by_link));
        println!("  {}: an answer of {} bytes", name, sent);
    }
    whole(meter, touch);
}

/// The whole program.
fn whole(meter: &mut Meter, touch: &Touch) {
    let run = |touches: u32| {
        let mut wire = Wire { touch, touches, number: 0, frame: [0; FRAME_MAX], at: 0, length: 0 };
        match serve::<OBJECTS, _, _>(MODEL, &mut NoStorage, 0, &mut wire) {
            Ok(()) => wire.number,
            Err(_) => fail(),
        }
    };
    let stack = meter::stack(|| run(2));
    let [few, many] = [100, 300].map(|touches| meter.measure(|| run(touches)));
    let touch = (many - few) / 200;
    println!("{:44} {:8} {:6}", "serve: start, the model checked", few.saturating_sub(100 * touch), stack);
    println!("{:44} {:8} {:6}", "serve: a touch with detail", touch, stack);

    /// A host that sends touches, each once.
    struct Wire<'t> {
        touch: &'t Touch,
        touches: u32,
        number: u32,
        frame: [u8; FRAME_MAX],
        at: usize,
        length: usize,
    }

    impl embedded_io::ErrorType for Wire<'_> {
        type Error = core::convert::Infallible;
    }

    impl embedded_io::Read for Wire<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
            if self.at == self.length {
                if self.number == self.touches {
                    return Ok(0);
                }
                self.number += 1;
                self.length = touch_frame(self.touch, self.number, true, &mut self.frame).len();
                self.at = 0;
            }
            let rest = self.frame.get(self.at..self.length).unwrap_or_default();
            let count = rest.len().min(buffer.len());
            buffer.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            self.at += count;
            Ok(count)
        }
    }

    impl embedded_io::Write for Wire<'_> {
        fn write(&mut self, buffer: &[u8]) -> Result<usize, Self::Error> {
            Ok(black_box(buffer).len())
        }

        fn flush(&mut self) -> Result<(), Self::Error> {
            Ok(())
        }
    }
}
