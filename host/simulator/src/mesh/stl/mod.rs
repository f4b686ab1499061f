//! STL files, binary and text. Corners at the same place become one vertex.
//!
//! A reader of our own: a file is binary if its length is that of the triangles that it counts, or cannot be text. Then
//! the count must hold: after the last triangle there may be a few bytes, or zeros, but not another one. All solids of a text file
//! are read. One that is not closed may be of a program that does not close them, or of a file that was cut between two facets:
//! a note says so. Normals, colors and attributes say nothing that the corners do not.

use super::Mesh;
use super::exact::{Moved, step_of_decimals, step_of_f32};
use super::triangles::too_many_vertices;
use super::words::{coordinate, damaged, missing, not_finite, shown};
use crate::error::{Error, Place, Result};
use std::collections::HashMap;
use std::io::{BufRead, ErrorKind, Read};
use std::path::Path;

/// The bytes of a binary file before its triangles; the last four are their number.
const HEADER: usize = 84;
/// The bytes of a triangle: normal, three corners, two bytes of attributes.
const TRIANGLE: usize = 50;

/// True if a file of `length` bytes that starts with `head` is a binary STL file: it has as many triangles as it
/// counts.
pub(super) fn is_binary(head: &[u8], length: u64) -> bool {
    stated(head).is_some_and(|count| length == bytes_of(count))
}

/// Number of triangles that the header states.
fn stated(head: &[u8]) -> Option<u32> {
    head.get(HEADER - 4..HEADER)?.try_into().ok().map(u32::from_le_bytes)
}

fn bytes_of(count: u32) -> u64 {
    HEADER as u64 + TRIANGLE as u64 * u64::from(count)
}

/// Reads the mesh of an STL file of `length` bytes, with remarks on the file; errors name `path`.
///
/// # Errors
/// If the number of triangles is not the one that the file states, a word or a number of a text is not what must stand
/// there, a coordinate is not finite, or no face is left.
pub(super) fn parse(mut reader: impl BufRead, length: u64, path: &Path) -> Result<(Moved, Vec<String>)> {
    let head = reader.fill_buf().map_err(|source| Error::io(path, "read the mesh", source))?;
    let (welder, note, step) = if !is_binary(head, length) && is_text(head) {
        let (welder, note) = Text { reader, path, line: 0, raw: Vec::new(), next: 0 }.parse()?;
        let step = step_of_decimals(&welder.vertices, &welder.triangles);
        (welder, note, step)
    } else {
        let (welder, note) = binary(reader, length, path)?;
        let step = step_of_f32(welder.vertices.iter().copied());
        (welder, note, step)
    };
    let (mesh, moved) = Mesh::from_f64(&welder.vertices, welder.triangles);
    let notes = note.into_iter().map(|note| format!("{} {note}", path.display())).collect();
    Ok(((mesh, moved, step), notes))
}

/// True if a file that starts with `head`, and is not binary by its length, is meant as text.
fn is_text(head: &[u8]) -> bool {
    let start = head.get(..HEADER).unwrap_or(head);
    let word = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start).trim_ascii_start();
    // The name of a solid may be in any encoding.
    let is_solid = word.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    !head.is_empty() && !start.contains(&0) && (is_solid || start.is_ascii())
}

/// Content of a file, and a remark on it.
type Noted = (Welder, Option<String>);

fn binary(mut reader: impl BufRead, length: u64, path: &Path) -> Result<Noted> {
    let cut = |offset: u64| move |source| ended(source, path, offset);
    let mut header = [0; HEADER];
    reader.read_exact(&mut header).map_err(cut(length))?;
    let count = stated(&header).unwrap_or_default();
    let other_length = || {
        let what = format!("it states {count} triangles, which are {} bytes, but has {length} bytes", bytes_of(count));
        damaged("STL", what).at(Place::byte(path, HEADER as u64 - 4))
    };
    let rest = length.checked_sub(bytes_of(count)).filter(|&rest| rest == 0 || count > 0).ok_or_else(other_length)?;
    let mut welder = Welder::default();
    let mut triangle = [0; TRIANGLE];
    for index in 0..count {
        let start = bytes_of(index);
        reader.read_exact(&mut triangle).map_err(cut(start))?;
        let mut corners = [0; 3];
        // After the normal.
        let (corner_bytes, _) = triangle[12..48].as_chunks::<12>();
        for (number, (corner, bytes)) in corners.iter_mut().zip(corner_bytes).enumerate() {
            let mut vertex = [0.0; 3];
            let (axes, _) = bytes.as_chunks::<4>();
            for (axis, (value, bytes)) in vertex.iter_mut().zip(axes).enumerate() {
                *value = f64::from(f32::from_le_bytes(*bytes));
                if !value.is_finite() {
                    let offset = start + 12 + 12 * number as u64 + 4 * axis as u64;
                    return Err(not_finite(AXES[axis], value.to_string()).at(Place::byte(path, offset)));
                }
            }
            *corner = welder.corner(vertex).map_err(|error| error.at(Place::byte(path, start)))?;
        }
        welder.triangles.push(corners);
    }
    let mut others = reader.take(rest).bytes();
    if rest >= TRIANGLE as u64 && others.any(|byte| byte.is_ok_and(|byte| byte != 0)) {
        return Err(other_length());
    }
    let bytes = if rest == 1 { "byte" } else { "bytes" };
    Ok((welder, (rest > 0).then(|| format!("has {rest} {bytes} after its last triangle, left out"))))
}

const AXES: [char; 3] = ['x', 'y', 'z'];

/// An error of reading at `offset`: the end of the file is a damaged file.
fn ended(source: std::io::Error, path: &Path, offset: u64) -> Error {
    if source.kind() == ErrorKind::UnexpectedEof {
        let what = "it ends in the middle of a triangle or of its header";
        return damaged("STL", what).at(Place::byte(path, offset));
    }
    Error::io(path, "read the mesh", source)
}

/// Makes one vertex of corners at the same place; zeros of either sign are the same.
#[derive(Default)]
struct Welder {
    places: HashMap<[u64; 3], u32>,
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Welder {
    /// The index of the vertex at this place.
    fn corner(&mut self, vertex: [f64; 3]) -> Result<u32> {
        let vertices = &mut self.vertices;
        let next = u32::try_from(vertices.len()).map_err(|_| too_many_vertices())?;
        Ok(*self.places.entry(vertex.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            vertices.push(vertex);
            next
        }))
    }
}

/// Position in a text: after which word.
#[derive(Clone, Copy, PartialEq)]
enum State {
    /// Outside of solids.
    Outside,
    /// In a solid, outside of its facets.
    Solid,
    /// In a facet, before its corners.
    Facet,
    /// In a facet's loop, after this many corners.
    Loop(usize),
    /// In a facet, after its corners.
    Closed,
}

impl State {
    /// Description of the element expected next, for an error.
    fn expected(self) -> &'static str {
        match self {
            Self::Outside => "\"solid\" or the end of the file",
            Self::Solid => "\"facet\" or \"endsolid\"",
            Self::Facet => "\"normal\", a number or \"outer loop\"",
            Self::Loop(3) => "\"endloop\", since a facet has three corners",
            Self::Loop(_) => "\"vertex\", since a facet has three corners",
            Self::Closed => "\"endfacet\"",
        }
    }
}

/// The words of a text file.
struct Text<'a, R> {
    reader: R,
    path: &'a Path,
    line: u64,
    raw: Vec<u8>,
    /// Position in `raw` from which the next word is searched.
    next: usize,
}

impl<R: BufRead> Text<'_, R> {
    fn parse(mut self) -> Result<Noted> {
        let mut welder = Welder::default();
        let mut state = State::Outside;
        let mut corners = [0; 3];
        // The number of triangles before the solid.
        let mut before = 0;
        while let Some(word) = self.word()? {
            let is = |expected: &[u8]| word.eq_ignore_ascii_case(expected);
            state = match state {
                State::Outside if is(b"solid") => {
                    self.skip_line();
                    before = welder.triangles.len();
                    State::Solid
                }
                State::Solid if is(b"facet") => State::Facet,
                State::Solid if is(b"endsolid") => {
                    self.skip_line();
                    State::Outside
                }
                // Some programs write further lines of remarks before the first facet.
                State::Solid | State::Facet | State::Closed if is(b"color") => {
                    self.skip_line();
                    state
                }
                State::Solid if welder.triangles.len() == before => {
                    self.skip_line();
                    State::Solid
                }
                State::Facet if is(b"normal") || !word.first().is_some_and(u8::is_ascii_alphabetic) => State::Facet,
                // Normals of flat triangles, as some exporters write them.
                State::Facet if is(b"nan") || is(b"inf") || is(b"nanf") => State::Facet,
                State::Facet if is(b"outer") => match self.word()? {
                    Some(word) if word.eq_ignore_ascii_case(b"loop") => State::Loop(0),
                    word => return Err(self.unexpected(word, "\"loop\" after \"outer\"")),
                },
                State::Loop(count @ 0..3) if is(b"vertex") => {
                    let mut vertex = [0.0; 3];
                    for (axis, value) in AXES.into_iter().zip(&mut vertex) {
                        let word = self.word()?.ok_or_else(|| missing(axis));
                        *value = word.and_then(|word| coordinate(&word, axis)).map_err(|error| self.here(error))?;
                    }
                    corners[count] = welder.corner(vertex).map_err(|error| self.here(error))?;
                    State::Loop(count + 1)
                }
                State::Loop(3) if is(b"endloop") => State::Closed,
                State::Closed if is(b"endfacet") => {
                    welder.triangles.push(corners);
                    State::Solid
                }
                state => return Err(self.unexpected(Some(word), state.expected())),
            };
        }
        match state {
            State::Outside => Ok((welder, None)),
            State::Solid if welder.triangles.len() > before => {
                let note =
                    "ends after a facet, without \"endsolid\": if it was cut there, the rest of the mesh is missing";
                Ok((welder, Some(note.into())))
            }
            state => Err(self.unexpected(None, state.expected())),
        }
    }

    /// The next word; none at the end of the file.
    fn word(&mut self) -> Result<Option<Vec<u8>>> {
        loop {
            let rest = self.raw.get(self.next..).unwrap_or_default();
            let skipped = rest.len() - rest.trim_ascii_start().len();
            let rest = &rest[skipped..];
            if !rest.is_empty() {
                let word = rest.split(u8::is_ascii_whitespace).next().unwrap_or_default().to_vec();
                self.next += skipped + word.len();
                return Ok(Some(word));
            }
            self.raw.clear();
            self.next = 0;
            let read = self.reader.read_until(b'\n', &mut self.raw);
            if read.map_err(|source| Error::io(self.path, "read the mesh", source))? == 0 {
                return Ok(None);
            }
            self.line += 1;
            if self.line == 1 && self.raw.starts_with(b"\xef\xbb\xbf") {
                self.next = 3;
            }
        }
    }

    /// The name of a solid says nothing about its shape.
    fn skip_line(&mut self) {
        self.next = self.raw.len();
    }

    fn here(&self, error: Error) -> Error {
        error.at(Place::line(self.path, self.line.max(1)))
    }

    fn unexpected(&self, word: Option<Vec<u8>>, expected: &str) -> Error {
        let what = match word {
            Some(word) => format!("{:?} stands where {expected} must stand", shown(&word)),
            None => format!("it ends where {expected} must stand"),
        };
        self.here(damaged("STL", what))
    }
}
