//! Models with the bytes that they read, and recognizers with their models.

use palpate::onboard::{Model, Recognizer};
use std::sync::Arc;

/// Room for the objects of any model.
pub(crate) type Recognizing<'m> = Recognizer<'m, 256>;

self_cell::self_cell!(
    /// A model and its bytes.
    pub(crate) struct OpenedModel {
        owner: Vec<u8>,
        #[covariant]
        dependent: Model,
    }
);

self_cell::self_cell!(
    /// A recognizer and its model.
    pub(crate) struct OpenedRecognizer {
        owner: Arc<OpenedModel>,
        #[covariant]
        dependent: Recognizing,
    }
);
