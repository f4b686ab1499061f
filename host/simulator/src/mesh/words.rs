//! Words of text files: numbers, coordinates, what an error shows of them, and the errors that several readers share.

use crate::error::{Error, Result, problem};
use std::fmt::Display;

/// The remedy for a wrong line of a text.
pub(super) const CORRECT: &str = "Correct the line, or export the mesh again.";
const EXPORT: &str = "Export the mesh again, or convert it to another of OBJ, STL, PLY, GLB and COLLADA.";

/// The number that a word is, if it is one.
pub(super) fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A coordinate: a number within the range of an `f32`.
pub(super) fn coordinate(word: &[u8], axis: char) -> Result<f64> {
    let value: f64 = number(word).ok_or_else(|| not_a_number(word))?;
    if (value as f32).is_finite() { Ok(value) } else { Err(not_finite(axis, shown(word))) }
}

/// A word of the file for an error message: its first 40 bytes.
pub(super) fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned()
}

/// A word stands where a number must stand.
pub(super) fn not_a_number(word: &[u8]) -> Error {
    problem!("{:?} is not a number", shown(word)).fix(CORRECT)
}

/// A coordinate is infinite, not a number, or beyond the range of an `f32`.
pub(super) fn not_finite(axis: char, text: String) -> Error {
    problem!("the coordinate {axis} = {text:?} is not finite").fix(CORRECT)
}

/// A vertex ends before this coordinate.
pub(super) fn missing(axis: char) -> Error {
    problem!("a vertex without {axis}").fix(CORRECT)
}

/// The problem of a face that names a vertex, counted from 0, that the mesh does not have.
pub(super) fn no_such_vertex(index: impl Into<i64>, vertices: u64) -> Error {
    let index = index.into();
    problem!("vertex {index} of a face is missing: there are {vertices} vertices, counted from 0").fix(EXPORT)
}

/// A file breaks the rules of its format.
pub(super) fn damaged(format: &str, what: impl Display) -> Error {
    problem!("the {format} file is damaged: {what}").fix(EXPORT)
}
