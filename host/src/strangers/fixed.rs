//! A misfit in the integers of the chip.

use super::NAT;
use super::misfit::Misfit;
use palpate_shared::format::ObjectMisfit;

/// The most that a number is stored as.
const MOST: f64 = 32_767.0;
/// Unit in which whitened evidence is stored: 2^-8 √nats.
const ROOT: f64 = 256.0;

/// Writes the record of an object's misfit; `unit` is that of margins, in nats.
pub(super) fn write(misfit: &Misfit, unit: f64, section: &mut Vec<u8>) {
    let count = misfit.rivals.len();
    let means: Vec<f64> = misfit.mean.iter().map(|mean| mean / unit).collect();
    let slopes: Vec<f64> = misfit.slope.iter().map(|slope| slope * unit * NAT).collect();
    let weights: Vec<f64> = (0..count)
        .flat_map(|row| (0..=row).map(move |column| (row, column)))
        .map(|at| misfit.weights[at] * unit * ROOT)
        .collect();
    let largest = |numbers: &[f64]| numbers.iter().fold(0.0_f64, |most, number| most.max(number.abs()));
    let shifts = || 0..=ObjectMisfit::MOST_SHIFT;
    // Means are multiples of a power of two; the others are stored as precisely as fits 16 bits.
    let mean_shift = shifts().find(|shift| largest(&means) <= MOST * power(*shift)).unwrap_or(ObjectMisfit::MOST_SHIFT);
    let precise = |numbers: &[f64]| shifts().rev().find(|shift| largest(numbers) * power(*shift) <= MOST).unwrap_or(0);
    let (weight_shift, slope_shift) = (precise(&weights), precise(&slopes));
    // `as` saturates.
    let stored = |number: f64| number.round().clamp(-MOST, MOST) as i16;
    let numbers = means
        .iter()
        .map(|mean| stored(mean / power(mean_shift)))
        .chain(slopes.iter().map(|slope| stored(slope * power(slope_shift))))
        .chain(weights.iter().map(|weight| stored(weight * power(weight_shift))));
    // A model has at most 256 objects.
    let rivals: Vec<u8> = misfit.rivals.iter().map(|&rival| rival as u8).collect();
    let constant = (misfit.constant * NAT).round() as i32;
    let shifts = [mean_shift, weight_shift, slope_shift];
    ObjectMisfit::write(shifts, constant, &rivals, numbers, &mut |part| section.extend_from_slice(part));
}

fn power(shift: u8) -> f64 {
    f64::from(shift).exp2()
}
