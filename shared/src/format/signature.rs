//! A signature behind a model.

/// Bytes of a signature.
pub const SIGNATURE_LENGTH: usize = 64;

/// Bytes between a model and its signature start with these.
const SIGNED: &[u8; 4] = b"PLPS";

/// A model with a signature behind it, as `FORMAT.md` specifies under *Signed models*.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SignedModel<'b> {
    /// The model, which was not checked.
    pub model: &'b [u8],
    /// Signed bytes: the model and the counter.
    pub signed: &'b [u8],
    /// A later model has a higher counter.
    pub counter: u32,
    /// The signature, which was not checked.
    pub signature: &'b [u8; SIGNATURE_LENGTH],
}

impl<'b> SignedModel<'b> {
    /// The signed model that `bytes` start with; `None` if there is no signature behind the length that the model states.
    ///
    /// Cost: a few comparisons.
    pub fn read(bytes: &'b [u8]) -> Option<Self> {
        let length = u32::from_le_bytes(*bytes.get(8..)?.first_chunk()?);
        let (model, rest) = bytes.split_at_checked(usize::try_from(length).ok()?)?;
        let (counter, rest) = rest.strip_prefix(SIGNED)?.split_first_chunk()?;
        let signed = bytes.get(..model.len() + SIGNED.len() + counter.len())?;
        let counter = u32::from_le_bytes(*counter);
        Some(Self { model, signed, counter, signature: rest.first_chunk()? })
    }
}
