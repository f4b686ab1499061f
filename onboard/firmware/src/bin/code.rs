//! Trees as code beside the same trees in a model: the same margins for every row, and the instructions of each.
//!
//! `src/code` has what `palpate export tests/data/import/xgboost-3.4-softmax.json --emit thumb` writes; a test of palpate-trees
//! holds that it still does.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use palpate_firmware::{exit, fail, meter::Meter, println};
use palpate_onboard::{Model, include_model};
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::f32_key;

#[allow(unsafe_code)]
#[path = "../code/softmax.rs"]
mod softmax;

const ROWS: usize = 500;

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { fail() };
    let Ok(data) = Model::new(include_model!("../code/data.palpate")) else { fail() };
    let bytes = include_model!("../code/softmax.palpate");
    let Ok(code) = Model::with_code(bytes, softmax::margins) else { fail() };
    if code.checksum() != softmax::CHECKSUM {
        println!("the trees are of another export than the model");
        fail()
    }
    if Model::new(bytes).is_ok() {
        println!("a model without its trees was opened");
        fail()
    }
    let mut rows = [[0.0_f32; 4]; ROWS];
    let mut state = 1_u32;
    for value in rows.as_flattened_mut() {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *value = if state >> 28 == 0 { f32::NAN } else { (state >> 16) as f32 / 8_192.0 - 4.0 };
    }
    let mut seen = [0; 3];
    for row in &rows {
        let keys = row.map(|value| if value.is_nan() { MISSING_FEATURE } else { f32_key(value) });
        let (mut expected, mut found, mut alone) = ([0; 3], [0; 3], [0; 3]);
        data.margins_of(&keys, &mut expected);
        code.margins_of(&keys, &mut found);
        softmax::softmax_margins(row, &mut alone);
        if expected != found || expected != alone {
            println!("margins differ: {:?} {:?} {:?}", expected, found, alone);
            fail()
        }
        if let Some(class) = code.predict_class(&keys, &mut found)
            && let Some(count) = seen.get_mut(class)
        {
            *count += 1;
        }
    }
    // Rows that all reach the same leaves would say nothing.
    if seen.iter().filter(|count| **count > ROWS / 20).count() < 2 {
        println!("of these rows all are of one class: {:?}", seen);
        fail()
    }
    let mut meter = Meter::new(peripherals.SYST);
    let mut margins = [0; 3];
    let keys = rows.map(|row| row.map(f32_key));
    let layout = meter.mean(&keys[..64], |row| data.margins_of(row, &mut margins));
    let opened = meter.mean(&keys[..64], |row| code.margins_of(row, &mut margins));
    let function = meter.mean(&rows[..64], |row| softmax::softmax_margins(row, &mut margins));
    println!(
        "{} rows the same; instructions: layout {}, code in a model {}, code alone {}",
        ROWS, layout, opened, function
    );
    exit()
}
