//! Models that a station keeps through resets and power cuts, in any kind of memory.

use palpate_shared::link::Refusal;

/// One of the two places for models: one in use, the other being filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The first.
    First,
    /// The second.
    Second,
}

/// A model that was loaded and checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loaded {
    /// Place of the model.
    pub place: Place,
    /// Its bytes.
    pub length: u32,
    /// Their CRC-32.
    pub checksum: u32,
}

/// Memory could not be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotStored;

/// Models that a station keeps through resets and power cuts: [`Memory`](super::Memory) in RAM or FRAM,
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
    /// bytes.
    ///
    /// # Errors
    /// [`NotStored`]: the sector then holds something else, which nobody asks for.
    fn write_model(&mut self, place: Place, offset: usize, bytes: &[u8]) -> Result<(), NotStored>;

    /// Bytes of a sector of the places for models: after [`NotStored`] parts come again from the start of the last sector on.
    fn sector(&self) -> usize {
        1
    }

    /// Decides about a model that has arrived, before it is used: the length of the model at the start of `loaded`. `current`
    /// starts with the model in use. This is the place for a check of your own, such as that of a signature behind the model; by
    /// default everything is a model.
    ///
    /// # Errors
    /// A [`Refusal`] to send, such as [`Refusal::NotAdmitted`].
    fn admit(&self, loaded: &[u8], current: &[u8]) -> Result<usize, Refusal> {
        let _ = current;
        Ok(loaded.len())
    }

    /// The model that was loaded last, of those that are still whole.
    fn loaded(&self) -> Option<Loaded>;

    /// Keeps that a model was loaded, which is whole. Once this has returned, [`Storage::loaded`] returns it, also after a power
    /// cut.
    ///
    /// # Errors
    /// [`NotStored`]: the one from before is kept.
    fn keep(&mut self, loaded: Loaded) -> Result<(), NotStored>;
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

    fn loaded(&self) -> Option<Loaded> {
        (**self).loaded()
    }

    fn keep(&mut self, loaded: Loaded) -> Result<(), NotStored> {
        (**self).keep(loaded)
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

    fn loaded(&self) -> Option<Loaded> {
        None
    }

    fn keep(&mut self, _: Loaded) -> Result<(), NotStored> {
        Err(NotStored)
    }
}
