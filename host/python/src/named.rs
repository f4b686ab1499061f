//! Descriptors and noise, as Python names them.

use palpate::error::Error;
use palpate::probe::noise::Noise;
use palpate::shared::Descriptor;

/// The descriptor with this name.
pub(crate) fn descriptor_of(name: &str) -> palpate::Result<Descriptor> {
    let all = || Descriptor::ALL.map(Descriptor::name).join(", ");
    Descriptor::from_name(name).ok_or_else(|| Error::setting("descriptor", name, format!("one of {}", all())))
}

/// Noise as users write it: the settings that are not empty.
pub(crate) fn noise_of(deviation: &str, timer: &str) -> palpate::Result<Noise> {
    let mut noise = Noise::default();
    for (key, text) in [("noise", deviation), ("timer", timer)].into_iter().filter(|(_, text)| !text.is_empty()) {
        noise.set(key, text)?;
    }
    Ok(noise)
}
