//! Words of text files: numbers, coordinates, and what an error shows of them.

use crate::error::MeshProblem;

/// The number that a word is, if it is one.
pub(super) fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A coordinate: a number within the range of an `f32`.
pub(super) fn coordinate(word: &[u8], axis: char) -> Result<f64, MeshProblem> {
    let value: f64 = number(word).ok_or_else(|| MeshProblem::NotANumber { text: shown(word) })?;
    if (value as f32).is_finite() { Ok(value) } else { Err(MeshProblem::NotFinite { axis, text: shown(word) }) }
}

/// A word of the file for an error message: its first 40 bytes.
pub(super) fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned()
}
