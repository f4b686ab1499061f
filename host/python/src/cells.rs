//! Models and maps with the bytes that they read, and recognizers and locators with their models.

use palpate::locate::{Locating, Maps};
use palpate::onboard::{Model, Recognizer};
use std::sync::Arc;

/// Room for the objects of any model.
pub(crate) type Recognizing<'m> = Recognizer<'m, 256>;

/// A locator of any maps.
pub(crate) type Located<'m> = Box<dyn Locating + 'm>;

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

self_cell::self_cell!(
    /// Maps and their bytes.
    pub(crate) struct OpenedMaps {
        owner: Vec<u8>,
        #[covariant]
        dependent: Maps,
    }
);

self_cell::self_cell!(
    /// A locator and its maps.
    pub(crate) struct OpenedLocator {
        owner: Arc<OpenedMaps>,
        #[covariant]
        dependent: Located,
    }
);
