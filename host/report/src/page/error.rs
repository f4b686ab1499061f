//! Problems with drawing.

use palpate::error::Variant;

/// Problems with drawing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PageProblem {
    /// The plotting library refused a chart.
    #[error("cannot draw the chart \"{title}\": {reason}")]
    Chart {
        /// The chart's title; may be empty.
        title: String,
        /// The library's message.
        reason: String,
    },
    /// The CSV library refused a table.
    #[error("cannot write CSV: {reason}")]
    Csv {
        /// The library's message.
        reason: String,
    },
    /// A scene cannot be written as JSON.
    #[error("cannot write the scene as JSON: {reason}")]
    Scene {
        /// The JSON library's message.
        reason: String,
    },
}

impl Variant for PageProblem {
    fn fix(&self) -> String {
        match self {
            Self::Chart { .. } | Self::Csv { .. } | Self::Scene { .. } => "Report this as a bug.".into(),
        }
    }
}
