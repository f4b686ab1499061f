//! Instructions a touch of a model that the emulator's loader put into RAM: how `palpate report` measures what models
//! cost. What is loaded is described in the host's `chip::instructions` module.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use palpate_firmware::{chip, exit, fail, meter::Meter, println};
use palpate_onboard::{Model, Recognizer, Stopping};
use palpate_shared::{ContactTime, Pose, Touch};

/// Touches that are averaged over, at most.
const TOUCHES: usize = 64;
/// Objects that a model may have.
const OBJECTS: usize = 256;
/// Never stops, so that every touch costs the same.
const NEVER: Option<Stopping> = Stopping::new(1e-15, u32::MAX);

#[entry]
fn main() -> ! {
    let (Some(peripherals), Some(stopping)) = (cortex_m::Peripherals::take(), NEVER) else { fail() };
    let Some((model, touches)) = split(chip::loaded()) else {
        println!("nothing was loaded");
        fail()
    };
    let Ok(model) = Model::new(model) else {
        println!("what was loaded is no model");
        fail()
    };
    let Ok(mut recognizer) = Recognizer::<OBJECTS>::new(&model, stopping) else { fail() };
    let mut meter = Meter::new(peripherals.SYST);
    let mut all = [Touch::from_micros([0; 3]); TOUCHES];
    let count = touches.len().min(TOUCHES);
    for (touch, bytes) in all.iter_mut().zip(touches) {
        *touch = read(bytes);
    }
    let touches = &all[..count];
    let mut margins = [0; OBJECTS];
    let margins = meter.mean(touches, |touch| model.margins(touch, &mut margins));
    let push = meter.mean(touches, |touch| recognizer.push(touch));
    println!("margins {} push {}", margins, push);
    exit()
}

/// The model and the touches.
fn split(loaded: &[u8]) -> Option<(&[u8], &[[u8; 24]])> {
    let (length, rest) = loaded.split_first_chunk::<4>()?;
    let (count, rest) = rest.split_first_chunk::<4>()?;
    let (model, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    let touches = rest.as_chunks::<24>().0.get(..u32::from_le_bytes(*count) as usize)?;
    (!touches.is_empty()).then_some((model, touches))
}

/// Three times in microseconds, the direction and the alignment in Q15; all zeros where there is no pose.
fn read(bytes: &[u8; 24]) -> Touch {
    let (times, pose) = bytes.split_at(12);
    let (times, pose) = (times.as_chunks::<4>().0, pose.as_chunks::<2>().0);
    let touch = Touch::new([0, 1, 2].map(|finger| ContactTime::from_micros(u32::from_le_bytes(times[finger]))));
    let [direction, alignment] = [0, 3].map(|from| [0, 1, 2].map(|axis| i16::from_le_bytes(pose[from + axis])));
    if direction == [0; 3] { touch } else { touch.with_pose(Pose { direction, alignment }) }
}
