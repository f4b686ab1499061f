//! Descriptors and noise, as Python names them.

use crate::failure::Failure;
use palpate::error::Error;
use palpate::probe::noise::{Noise, quantity};
use palpate::shared::Descriptor;

/// The descriptor with this name.
pub(crate) fn descriptor_of(name: &str) -> palpate::Result<Descriptor> {
    let all = || Descriptor::ALL.map(Descriptor::name).join(", ");
    Descriptor::from_name(name).ok_or_else(|| Error::setting("descriptor", name, format!("one of {}", all())))
}

/// Noise as users write it.
pub(crate) fn noise_of(deviation: &str, timer: &str) -> Result<Noise, Failure> {
    let mut noise = Noise::default();
    if !deviation.is_empty() {
        noise.deviation = deviation.parse()?;
    }
    if !timer.is_empty() {
        noise.timer = quantity::duration(timer)?;
    }
    Ok(noise)
}
