//! How touches were made.

use super::{Format, Shard};
use crate::error::{Error, Result};
use crate::probe::approach::{Aim, Probe};
use std::ops::Range;

/// How the touches of a data set were made. The same origin and mesh give the same touches. The default is the published
/// method: 21,000 full touches per object, longest side 10 units.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// How many touches of each object; with `approaches`, how many approaches. Of all shards together.
    pub touches: u64,
    /// The seed of all that is random.
    pub seed: u64,
    /// The longest side of an object's bounding box, in units.
    pub length: f64,
    /// The probe's measures.
    pub probe: Probe,
    /// Where approaches aim.
    #[serde(default, skip_serializing_if = "Aim::is_box")]
    pub aim: Aim,
    /// Whether the probe's direction and alignment are written too.
    pub pose: bool,
    /// Whether every approach is kept, not only full touches: sample i is then approach i.
    pub approaches: bool,
    /// How the touches are kept; Parquet keeps the pose in any case.
    pub format: Format,
    /// Which part of the samples this data set holds.
    pub shard: Shard,
}

impl Default for Origin {
    fn default() -> Self {
        Self {
            touches: 21_000,
            seed: 1,
            length: 10.0,
            probe: Probe::default(),
            aim: Aim::Box,
            pose: false,
            approaches: false,
            format: Format::Text,
            shard: Shard::WHOLE,
        }
    }
}

impl Origin {
    /// Refuses what no touches can be made by.
    ///
    /// # Errors
    /// [`Problem::Setting`](crate::error::Problem::Setting) naming the field.
    pub fn check(&self) -> Result<()> {
        if self.touches == 0 {
            return Err(Error::setting("touches", 0, "1 or more"));
        }
        if !self.format.is_built_in() {
            return Err(Error::setting("format", self.format.name(), "text, or build with the feature parquet"));
        }
        self.probe.check(self.length)
    }

    /// The samples of each object: the shard's part of all.
    pub fn samples(&self) -> Range<u64> {
        self.shard.part(self.touches)
    }

    /// Whether the pose is written.
    pub fn writes_pose(&self) -> bool {
        self.pose || self.format == Format::Parquet
    }
}
