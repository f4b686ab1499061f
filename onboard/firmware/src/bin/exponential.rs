//! Speed against error of the exponential and the logarithm on this chip: fixed point (ours), micromath and libm.
//! Errors are relative to libm's f64, over -20 to 0 for the exponential and 1e-9 to 1 for the logarithm.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use micromath::F32Ext;
use palpate_firmware::{exit, meter::Meter, println};
use palpate_onboard::exp2_negative;

const POINTS: usize = 64;

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { palpate_firmware::fail() };
    let mut meter = Meter::new(peripherals.SYST);
    let mut exponents = [0.0_f32; POINTS];
    let mut arguments = [0.0_f32; POINTS];
    for (index, (exponent, argument)) in exponents.iter_mut().zip(&mut arguments).enumerate() {
        *exponent = -20.0 * index as f32 / POINTS as f32;
        *argument = libm::expf(-20.7 * (index + 1) as f32 / POINTS as f32);
    }
    let bits = exponents.map(|exponent| (f64::from(-exponent) * core::f64::consts::LOG2_E * 4_294_967_296.0) as u64);
    println!("exponential        instructions  largest error (1e-9)");
    let cost = meter.mean(&bits, |bits| exp2_negative(*bits));
    let error =
        largest(&exponents, |x, index| exp2_negative(bits[index]) as f64 / 72_057_594_037_927_936.0 / libm::exp(x));
    println!("fixed point Q56    {:12}  {:12}", cost, error);
    let cost = meter.mean(&exponents, |x| F32Ext::exp(*x));
    let error = largest(&exponents, |x, _| f64::from(F32Ext::exp(x as f32)) / libm::exp(x));
    println!("micromath f32      {:12}  {:12}", cost, error);
    let cost = meter.mean(&exponents, |x| libm::expf(*x));
    let error = largest(&exponents, |x, _| f64::from(libm::expf(x as f32)) / libm::exp(x));
    println!("libm f32           {:12}  {:12}", cost, error);
    let cost = meter.mean(&exponents, |x| libm::exp(black_box(f64::from(*x))));
    println!("libm f64           {:12}  {:12}", cost, 0);

    println!("logarithm          instructions  largest error (1e-9)");
    let cost = meter.mean(&arguments, |x| F32Ext::ln(*x));
    let error = largest(&arguments, |x, _| f64::from(F32Ext::ln(x as f32)) / libm::log(x));
    println!("micromath f32      {:12}  {:12}", cost, error);
    let cost = meter.mean(&arguments, |x| libm::logf(*x));
    let error = largest(&arguments, |x, _| f64::from(libm::logf(x as f32)) / libm::log(x));
    println!("libm f32           {:12}  {:12}", cost, error);
    let cost = meter.mean(&arguments, |x| libm::log(black_box(f64::from(*x))));
    println!("libm f64           {:12}  {:12}", cost, 0);
    println!("none               {:12}  margins are summed: no logarithm is taken", 0);
    exit()
}

/// The largest difference of a ratio from 1, in billionths.
fn largest(points: &[f32; POINTS], ratio: impl Fn(f64, usize) -> f64) -> u64 {
    let errors = points.iter().enumerate().map(|(index, point)| (ratio(f64::from(*point), index) - 1.0).abs());
    (errors.fold(0.0, f64::max) * 1e9) as u64
}
