//! Warnings about a data set.

use super::Listing;
use std::path::PathBuf;

/// Warning about a data set: it looks wrong, but may be meant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// A text file has as many touches as `dataset.json` states, but was changed since its capture.
    #[error("{}: changed since its capture: its checksum is not the one in {}", path.display(), Listing::FILE)]
    Changed {
        /// The file.
        path: PathBuf,
    },
    /// A log has channels without touches and verdicts.
    #[error("{}: skipped {}", path.display(), channels_said(channels))]
    SkippedChannels {
        /// The log.
        path: PathBuf,
        /// The channels: topics, with the names of their schemas.
        channels: Vec<String>,
    },
    /// The last line of a recorded file is not whole.
    #[error("{}: its last line is not whole and was not read: a recording was interrupted", path.display())]
    HalfLine {
        /// The file.
        path: PathBuf,
    },
}

/// Some channels by name, and how many others.
pub(super) fn channels_said(channels: &[String]) -> String {
    const SHOWN: usize = 8;
    let shown = channels.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
    let count = match channels.len() {
        1 => "1 other channel".to_owned(),
        count => format!("{count} other channels"),
    };
    let more = if channels.len() > SHOWN { ", …" } else { "" };
    format!("{count}: {shown}{more}")
}
