//! A model that the node serves: trees, or maps.

use crate::thresholds::Thresholds;
use palpate::compile::CompiledModel;
use palpate::locate::{MapsFile, TOUCHES};
use palpate::onboard::Stopping;
use std::path::Path;
use std::sync::Arc;

/// A model that was checked.
#[derive(Clone)]
pub(crate) enum Served {
    /// It knows objects by touches in any pose.
    Trees(Arc<CompiledModel>),
    /// It knows objects on a table, and where they lie, by touches with a position.
    Maps(Arc<MapsFile>),
}

impl Served {
    /// Reads a model.
    ///
    /// # Errors
    /// Why it cannot be used.
    pub(crate) fn read(path: &Path) -> Result<Self, String> {
        if let Some(maps) = MapsFile::read(path).map_err(|error| error.to_string())? {
            return Ok(Self::Maps(Arc::new(maps)));
        }
        let model = CompiledModel::read(path).map_err(|error| error.to_string())?;
        match model.model().descriptor() {
            Some(_) => Ok(Self::Trees(Arc::new(model))),
            None => Err("the model is over rows of features, not touches: give one that `palpate run` made".into()),
        }
    }

    /// The stopping rule under `thresholds`.
    ///
    /// # Errors
    /// The number that is out of range, and the range.
    pub(crate) fn stopping(&self, thresholds: Thresholds) -> Result<Stopping, String> {
        match self {
            Self::Trees(model) => thresholds.over(Stopping::from_model(&model.model())),
            Self::Maps(file) => match thresholds.over(file.maps().stopping())? {
                stopping if stopping.max_touches() as usize <= TOUCHES => Ok(stopping),
                _ => Err(format!("max_touches is at most {TOUCHES} for a model of maps")),
            },
        }
    }

    /// The model for a chip.
    ///
    /// # Errors
    /// It is one of maps.
    pub(crate) fn for_chip(self) -> Result<Arc<CompiledModel>, String> {
        match self {
            Self::Trees(model) => Ok(model),
            Self::Maps(_) => Err("a chip does not load a model of maps: give one of trees, or leave out --port".into()),
        }
    }
}
