//! Models that the chip's owner has signed.

use super::storage::{Place, Storage};
use palpate_shared::format::{SIGNATURE_LENGTH, SignedModel};
use palpate_shared::link::{NotStored, Refusal};

/// Storage whose models from a host have to be signed, as `FORMAT.md` specifies under *Signed models*.
///
/// A model is checked once, after it has arrived and before it is used. Its counter may not be below that of the model in use,
/// nor below `least`, which also holds while the built-in model is in use. The signature remains in flash behind the model.
/// Not signed are snapshots, touches, and whatever can write to the flash without the link.
#[derive(Clone, Copy, Debug)]
pub struct Signed<S, V> {
    /// The storage of models and records.
    pub storage: S,
    /// The lowest counter of a model.
    pub least: u32,
    /// True if the signature is one of these bytes, by the chip's key.
    pub verify: V,
}

impl<S: Storage, V: Fn(&[u8], &[u8; SIGNATURE_LENGTH]) -> bool> Storage for Signed<S, V> {
    fn admit(&self, loaded: &[u8], current: &[u8]) -> Result<usize, Refusal> {
        let new = SignedModel::read(loaded).filter(|new| {
            new.signed.len() + SIGNATURE_LENGTH == loaded.len() && (self.verify)(new.signed, new.signature)
        });
        let new = new.ok_or(Refusal::Signature)?;
        let current = SignedModel::read(current).map_or(0, |current| current.counter);
        if new.counter < current.max(self.least) { Err(Refusal::Older) } else { Ok(new.model.len()) }
    }

    fn room(&self) -> usize {
        self.storage.room()
    }

    fn model(&self, place: Place) -> &[u8] {
        self.storage.model(place)
    }

    fn write_model(&mut self, place: Place, offset: usize, bytes: &[u8]) -> Result<(), NotStored> {
        self.storage.write_model(place, offset, bytes)
    }

    fn sector(&self) -> usize {
        self.storage.sector()
    }

    fn record_length(&self) -> usize {
        self.storage.record_length()
    }

    fn newest(&self) -> Option<(u32, &[u8])> {
        self.storage.newest()
    }

    fn store(&mut self, fill: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<(), NotStored> {
        self.storage.store(fill)
    }
}
