//! The statement of a data set about a recording.

/// A recording of one object: when, from where and by what its touches came.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Recorded {
    /// The placement that the object lay in on a table, where the recording states one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placement: Option<String>,
    /// Its position among the recordings of the object, which tells those apart that began in the same second.
    #[serde(skip)]
    pub number: usize,
    /// Time at which it began, in UTC: `2026-11-22T11:00:00Z`.
    pub began: String,
    /// Source of the touches: a port or a file.
    pub source: String,
    /// Name and version of the chip's program, if it says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub firmware: Option<String>,
    /// The checksum of the chip's model, which says how long the chip waits for a finger; none without a model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<u32>,
}
