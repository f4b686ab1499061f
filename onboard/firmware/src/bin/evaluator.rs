//! Cost of the evaluator on this chip, model by model: instructions and stack a touch, margins alone, as the exporter
//! states them (within 15 %), and with evidence and stopping; and, next to the first model, the same
//! trees in irithyll-core and as a plain array of eight-byte nodes with f32 compares.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use palpate_firmware::{exit, fail, meter, meter::Meter, println};
use palpate_onboard::{Aligned, Model, Recognizer, Stopping, include_model};
use palpate_shared::Touch;

/// Touches that are averaged over.
const TOUCHES: usize = 50;

/// Percentage by which the exporter's statement may be off.
const STATED_WITHIN: u64 = 15;

macro_rules! models {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_model!(concat!(env!("OUT_DIR"), "/bench/", $name, ".palpate")))),*] as [(&str, &'static [u8]); _]
    };
}

/// Never stops, so that every touch costs the same.
const NEVER: Option<Stopping> = Stopping::new(1e-15, u32::MAX);

#[entry]
fn main() -> ! {
    let (Some(peripherals), Some(stopping)) = (cortex_m::Peripherals::take(), NEVER) else { fail() };
    let mut meter = Meter::new(peripherals.SYST);
    let models = models![
        "one-i16",
        "one-i8",
        "one-d3",
        "each100-i16",
        "each100-i8",
        "each40-i16",
        "each40-i8",
        "each20-d7",
        "each40-wide",
    ];
    let bytes = include_bytes!(concat!(env!("OUT_DIR"), "/bench/touches.bin"));
    let mut touches = [Touch::from_micros([0; 3]); TOUCHES];
    for (touch, bytes) in touches.iter_mut().zip(bytes.as_chunks::<12>().0) {
        let (times, _) = bytes.as_chunks::<4>();
        *touch = Touch::from_micros([0, 1, 2].map(|finger| u32::from_le_bytes(times[finger])));
    }
    // For each model, on a Cortex-M4F and on a Cortex-M0+.
    let estimates = include_bytes!(concat!(env!("OUT_DIR"), "/bench/estimates.bin")).as_chunks::<4>().0;
    let is_m0_plus = !cfg!(target_abi = "eabihf");
    println!("model              bytes  margins   stated   verdict  posterior  stack");
    let mut off = 0;
    for (index, (name, bytes)) in models.into_iter().enumerate() {
        let Ok(model) = Model::new(bytes) else {
            println!("{} skipped: PALPATE_BENCH names no directory with models", name);
            continue;
        };
        let Ok(mut recognizer) = Recognizer::<10>::new(&model, stopping) else { fail() };
        let mut margins = [0; 10];
        let margins_cost = meter.mean(&touches, |touch| model.margins(touch, &mut margins));
        let verdict_cost = meter.mean(&touches, |touch| recognizer.push(touch));
        let posterior_cost = meter.measure(|| recognizer.posterior(black_box(3)));
        let stack = meter::stack(|| recognizer.push(&touches[0]));
        let stated =
            estimates.get(2 * index + usize::from(is_m0_plus)).map_or(0, |bytes| u64::from(u32::from_le_bytes(*bytes)));
        off += u32::from(100 * stated.abs_diff(margins_cost) > STATED_WITHIN * margins_cost);
        println!(
            "{:16} {:7} {:8} {:8} {:9} {:10} {:6}",
            name,
            bytes.len(),
            margins_cost,
            stated,
            verdict_cost,
            posterior_cost,
            stack
        );
    }
    peers(&mut meter, &touches);
    println!("state: {} bytes of recognizer, {} of model", size_of::<Recognizer<10>>(), size_of::<Model>());
    if off > 0 {
        println!("the exporter's model of the evaluator is off by more than {} % for {} models", STATED_WITHIN, off);
        fail()
    }
    exit()
}

static NODES: &Aligned<[u8]> = &Aligned(*include_bytes!(concat!(env!("OUT_DIR"), "/bench/one-nodes.bin")));
static IRITHYLL: &Aligned<[u8]> = &Aligned(*include_bytes!(concat!(env!("OUT_DIR"), "/bench/one-irithyll.bin")));

/// The 1000 one-output trees in other evaluators.
fn peers(meter: &mut Meter, touches: &[Touch]) {
    let rows = [0; TOUCHES].map(|_: u8| [0.0_f32; 3]);
    let mut rows = rows;
    for (row, touch) in rows.iter_mut().zip(touches) {
        *row = touch.times().map(|time| time.micros().unwrap_or(0) as f32);
    }
    if NODES.0.is_empty() {
        return;
    }
    let mut margins = [0.0; 10];
    let cost = meter.mean(&rows, |row| eight_byte_nodes(&NODES.0, row, &mut margins));
    println!("8-byte nodes     {:7} {:8}", NODES.0.len(), cost);
    let mut views = [const { None }; 10];
    let mut rest: &'static [u8] = &IRITHYLL.0;
    for view in &mut views {
        let Some((length, bytes)) = rest.split_first_chunk::<4>() else { fail() };
        let (part, after) = bytes.split_at(u32::from_le_bytes(*length) as usize);
        *view = irithyll_core::EnsembleView::from_bytes(part).ok();
        rest = after;
    }
    let cost = meter.mean(&rows, |row| views.iter().flatten().map(|view| view.predict(row)).sum::<f32>());
    println!("irithyll-core    {:7} {:8}", IRITHYLL.0.len(), cost);
}

/// Walks trees of eight-byte nodes, a hundred per object.
fn eight_byte_nodes(mut bytes: &[u8], row: &[f32; 3], margins: &mut [f32; 10]) {
    for margin in margins {
        *margin = 0.5;
        for _ in 0..100 {
            let Some((count, rest)) = bytes.split_first_chunk::<4>() else { return };
            let (nodes, rest) = rest.split_at(8 * u32::from_le_bytes(*count) as usize);
            let (nodes, _) = nodes.as_chunks::<8>();
            bytes = rest;
            let mut index = 0;
            loop {
                let [a, b, c, d, feature, _, e, f] = nodes[index];
                let value = f32::from_le_bytes([a, b, c, d]);
                if feature == 255 {
                    *margin += value;
                    break;
                }
                index =
                    if row[usize::from(feature)] < value { index + 1 } else { usize::from(u16::from_le_bytes([e, f])) };
            }
        }
    }
}
