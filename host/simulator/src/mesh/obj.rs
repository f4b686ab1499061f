//! Wavefront OBJ files: vertices and faces; everything else is skipped.
//!
//! `tobj` parses and indexes. In front of it, `FacesOnly` lets through only vertices and faces, and checks them: so an
//! error names its line, and what does not shape the surface (normals, materials, groups, lines) cannot break a mesh.

use crate::error::{Error, Place, Result, problem};
use crate::mesh::Mesh;
use crate::mesh::exact::{Bounds, Moved, rounded, step_of_decimals};
use crate::mesh::polygon::Cutter;
use crate::mesh::triangles::WITH_FACES;
use crate::mesh::words::{CORRECT, coordinate, missing, number, shown};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;

/// The words that lines of OBJ files begin with, as far as they may be the first of a file.
pub(super) const KEYWORDS: [&[u8]; 11] =
    [b"v", b"vn", b"vt", b"vp", b"f", b"o", b"g", b"s", b"l", b"mtllib", b"usemtl"];

/// Reads the mesh of an OBJ file: all its objects and groups together, polygons cut into triangles, without faces that
/// are a single point. Coordinates stay in the units of the file; those of a mesh that is far from the origin (its center
/// more than 16 times its longest side) count from its center, since f32 would damage it:
/// [`file::read`](super::file::read) says so.
///
/// # Errors
/// [`Kind::Io`](crate::error::Kind::Io) when the file cannot be read; with its line when a vertex is not three finite
/// numbers or a face's index is not a whole number or out of range, and with the file when there is no face or each is a
/// single point.
pub fn read(path: &Path) -> Result<Mesh> {
    let file = File::open(path).map_err(|source| Error::io(path, "read the mesh", source))?;
    parse(BufReader::with_capacity(1 << 18, file), path)
}

/// Reads the mesh of an OBJ text; errors name `path`.
///
/// Memory: at most 256 bytes for each byte of the text, and 1 MB.
///
/// # Errors
/// Errors of [`read`].
pub fn parse(text: impl BufRead, path: &Path) -> Result<Mesh> {
    let (mesh, ..) = parse_moved(text, path)?;
    mesh.usable().map_err(|error| error.at(Place::file(path)))
}

/// Parses a mesh, which may have no face, and returns the offset subtracted from its coordinates and the step in which
/// they are rounded.
pub(super) fn parse_moved(text: impl BufRead, path: &Path) -> Result<Moved> {
    let mut filter = FacesOnly::new(text, path);
    let loaded = tobj::load_obj_buf(&mut filter, &tobj::LoadOptions::default(), |_| Ok(Default::default()));
    if let Some(error) = filter.error.take() {
        return Err(error);
    }
    filter.check_indices()?;
    let (models, _) = loaded
        .map_err(|reason| problem!("cannot be read as a mesh ({reason})").fix(WITH_FACES).at(Place::file(path)))?;
    let vertices: Vec<[f64; 3]> = models.iter().flat_map(|model| model.mesh.positions.as_chunks().0).copied().collect();
    let offset = Bounds::of(vertices.iter().copied()).offset();
    let mut mesh = Mesh::default();
    for model in models {
        append(&mut mesh, model.mesh, offset);
    }
    let step = step_of_decimals(&vertices, &mesh.triangles);
    Ok((mesh, offset, step))
}

fn append(mesh: &mut Mesh, part: tobj::Mesh, offset: [f64; 3]) {
    let base = mesh.vertices.len() as u32;
    mesh.vertices.extend(part.positions.as_chunks().0.iter().map(|&vertex| rounded(vertex, offset)));
    if part.face_arities.is_empty() {
        let faces = part.indices.as_chunks().0;
        mesh.triangles.extend(faces.iter().map(|face: &[u32; 3]| face.map(|index| base + index)));
        return;
    }
    let mut cutter = Cutter::default();
    let mut indices = part.indices;
    let mut rest = indices.as_mut_slice();
    for arity in part.face_arities {
        let (face, others) = rest.split_at_mut(arity as usize);
        rest = others;
        face.iter_mut().for_each(|index| *index += base);
        let Mesh { vertices, triangles } = &mut *mesh;
        cutter.cut(face, |index| vertices[index as usize].map(f64::from), triangles);
    }
}

/// The vertices and faces of an OBJ text, checked, as clean lines for `tobj`. Faces keep only their vertex indices, all
/// counted from the first vertex.
struct FacesOnly<'a, R> {
    text: R,
    path: &'a Path,
    line: u64,
    raw: Vec<u8>,
    clean: Vec<u8>,
    taken: usize,
    vertices: u64,
    /// The largest vertex index and its line. Checked at the end: a face may precede its vertices.
    largest: (u64, u64),
    error: Option<Error>,
}

/// True if a backslash joins the next line to this one, which ends in `raw`. In a comment, or in the name of a material or a
/// file, it is part of a path.
fn goes_on(raw: &[u8]) -> bool {
    let line = raw.trim_ascii();
    let first = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    line.ends_with(b"\\") && matches!(without_mark(first), b"v" | b"f") && !line.contains(&b'#')
}

/// Bytes without the mark that some programs write at the beginning of a text.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Clean lines are passed to `tobj` in portions of about this many bytes.
const PORTION: usize = 1 << 16;

impl<'a, R: BufRead> FacesOnly<'a, R> {
    fn new(text: R, path: &'a Path) -> Self {
        let (raw, clean) = (Vec::new(), Vec::new());
        Self { text, path, line: 0, raw, clean, taken: 0, vertices: 0, largest: (0, 0), error: None }
    }

    fn check_indices(&self) -> Result<()> {
        let (index, line) = self.largest;
        if index <= self.vertices {
            return Ok(());
        }
        let problem = problem!("vertex {index} of a face is out of range: the file has {} vertices", self.vertices);
        Err(problem.fix(CORRECT).at(Place::line(self.path, line)))
    }

    /// Reads the next line, with the lines that a backslash joins to it; false at the end of the text.
    fn next_line(&mut self) -> Result<bool> {
        self.raw.clear();
        loop {
            let read = self.text.read_until(b'\n', &mut self.raw);
            let read = read.map_err(|source| Error::io(self.path, "read the mesh", source))?;
            self.line += u64::from(read > 0);
            let end = self.raw.trim_ascii_end().len();
            if read > 0 && goes_on(&self.raw) {
                self.raw.truncate(end - 1);
                self.raw.push(b' ');
            } else {
                return Ok(read > 0 || end > 0);
            }
        }
    }

    /// Appends the line to the clean ones if it is a vertex or a face.
    fn clean_line(&mut self) -> Result<()> {
        let Self { raw, clean, .. } = self;
        let line = raw.split(|&byte| byte == b'#').next().unwrap_or_default();
        let line = without_mark(line);
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        match words.next() {
            Some(b"v") => {
                clean.push(b'v');
                for axis in ['x', 'y', 'z'] {
                    let word = words.next().ok_or_else(|| missing(axis))?;
                    coordinate(word, axis)?;
                    clean.push(b' ');
                    clean.extend_from_slice(word);
                }
                clean.push(b'\n');
                self.vertices += 1;
            }
            Some(b"f") => {
                let start = clean.len();
                clean.push(b'f');
                let mut corners = 0;
                for word in words {
                    let index = word.split(|&byte| byte == b'/').next().and_then(number::<i64>);
                    let not_index = || problem!("{:?} is not a vertex of a face", shown(word)).fix(CORRECT);
                    let index = index.ok_or_else(not_index)?;
                    let absolute = if index < 0 { index.saturating_add_unsigned(self.vertices) + 1 } else { index };
                    let absolute = u64::try_from(absolute).ok().filter(|&absolute| absolute > 0);
                    let absolute = absolute.ok_or_else(|| {
                        let before = format!("{} vertices before it", self.vertices);
                        problem!("vertex {index} of a face is out of range: {before}").fix(CORRECT)
                    })?;
                    if absolute > self.largest.0 {
                        self.largest = (absolute, self.line);
                    }
                    // Writing to a vector cannot fail.
                    let _ = write!(clean, " {absolute}");
                    corners += 1;
                }
                if corners < 3 {
                    clean.truncate(start);
                } else {
                    clean.push(b'\n');
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn refill(&mut self) -> Result<()> {
        self.clean.clear();
        self.taken = 0;
        while self.clean.len() < PORTION && self.next_line()? {
            self.clean_line().map_err(|error| error.at(Place::line(self.path, self.line)))?;
        }
        Ok(())
    }
}

impl<R: BufRead> BufRead for FacesOnly<'_, R> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.taken == self.clean.len()
            && let Err(error) = self.refill()
        {
            self.error = Some(error);
            return Err(std::io::ErrorKind::InvalidData.into());
        }
        Ok(&self.clean[self.taken..])
    }

    fn consume(&mut self, amount: usize) {
        self.taken += amount;
    }
}

impl<R: BufRead> Read for FacesOnly<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.fill_buf()?.read(buffer)?;
        self.consume(read);
        Ok(read)
    }
}

/// The first line of a mesh that [`write`] wrote, by which it is recognized.
const FIRST: &str = "# Written by Palpate.";

/// Writes a mesh as OBJ: a comment, then `v` and `f` lines from which [`read`] gives the same triangles, coordinates bit for
/// bit (vertices in the order in which the triangles use them).
///
/// # Errors
/// Errors of `out`.
pub fn write(mesh: &Mesh, out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(out, "{FIRST}")?;
    for [x, y, z] in &mesh.vertices {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|index| u64::from(index) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
