//! State that a station keeps through resets and power cuts, in any kind of memory.

use palpate_shared::link::{NotStored, Refusal};

/// One of the two places for models: one in use, the other being filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The first.
    First,
    /// The second.
    Second,
}

/// State that a station keeps through resets and power cuts: [`Memory`](super::Memory) in RAM or FRAM,
/// [`FlashStorage`](super::FlashStorage) in flash, or [`NoStorage`].
///
/// The power may go at any moment of any call; what was there before the call has to be there after it, or what the call
/// was to write.
pub trait Storage {
    /// Bytes of each place for models; 0 where no model can be loaded.
    fn room(&self) -> usize;

    /// All bytes of a place for models, to be read in place.
    fn model(&self, place: Place) -> &[u8];

    /// Writes part of a model. Parts come in order from 0 on, each at a multiple of [`CHUNK`](palpate_shared::link::CHUNK)
    /// bytes; the last part that came may come again after a power cut.
    ///
    /// # Errors
    /// [`NotStored`]: the sector then holds something else, which nobody asks for.
    fn write_model(&mut self, place: Place, offset: usize, bytes: &[u8]) -> Result<(), NotStored>;

    /// Bytes of a sector of the places for models: after [`NotStored`] parts come again from the start of the last sector on.
    fn sector(&self) -> usize {
        1
    }

    /// Decides about a model that has arrived, before it is used: the length of the model at the start of `loaded`. `current`
    /// starts with the model in use. [`Signed`](super::Signed) checks signatures; by default everything is a model.
    ///
    /// # Errors
    /// A [`Refusal`] to send.
    fn admit(&self, loaded: &[u8], current: &[u8]) -> Result<usize, Refusal> {
        let _ = current;
        Ok(loaded.len())
    }

    /// The most bytes of a record, see [`record_length`](super::record_length); 0 where nothing is kept.
    fn record_length(&self) -> usize;

    /// The newest whole record, and how many were written up to it.
    fn newest(&self) -> Option<(u32, &[u8])>;

    /// Keeps another record: `fill` writes it and returns its length, or `None` where it does not fit. Once this has
    /// returned, [`Storage::newest`] returns the record, also after a power cut.
    ///
    /// # Errors
    /// [`NotStored`]: the newest record is the one from before.
    fn store(&mut self, fill: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<(), NotStored>;
}

/// Storage that its owner keeps, as after [`serve`](super::serve) has ended.
impl<S: Storage> Storage for &mut S {
    fn room(&self) -> usize {
        (**self).room()
    }

    fn model(&self, place: Place) -> &[u8] {
        (**self).model(place)
    }

    fn write_model(&mut self, place: Place, offset: usize, bytes: &[u8]) -> Result<(), NotStored> {
        (**self).write_model(place, offset, bytes)
    }

    fn sector(&self) -> usize {
        (**self).sector()
    }

    fn admit(&self, loaded: &[u8], current: &[u8]) -> Result<usize, Refusal> {
        (**self).admit(loaded, current)
    }

    fn record_length(&self) -> usize {
        (**self).record_length()
    }

    fn newest(&self) -> Option<(u32, &[u8])> {
        (**self).newest()
    }

    fn store(&mut self, fill: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<(), NotStored> {
        (**self).store(fill)
    }
}

/// Keeps nothing: every start is the first, and no model can be loaded.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoStorage;

impl Storage for NoStorage {
    fn room(&self) -> usize {
        0
    }

    fn model(&self, _: Place) -> &[u8] {
        &[]
    }

    fn write_model(&mut self, _: Place, _: usize, _: &[u8]) -> Result<(), NotStored> {
        Err(NotStored)
    }

    fn record_length(&self) -> usize {
        0
    }

    fn newest(&self) -> Option<(u32, &[u8])> {
        None
    }

    fn store(&mut self, _: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<(), NotStored> {
        Ok(())
    }
}
