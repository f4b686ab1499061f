//! PLY files: text, or binary in either byte order; polygons and triangle strips.
//!
//! `serde-ply` reads the numbers. In front of it, [`header`] checks the header, so that an error names its line and no
//! element can be endless, and a counter says at which line or byte a number is damaged. Elements and properties other
//! than vertices' places and faces' corners are skipped, but must be whole.

mod counted;
mod header;

use super::Mesh;
use super::exact::{Bounds, Moved, rounded, step_of_decimals, step_of_f32};
use super::polygon::Cutter;
use super::triangles::too_many_vertices;
use super::{unread, words};
use crate::error::{Error, Place, Result};
use counted::{Counted, Counts};
use header::Header;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_ply::{DeserializeError, PlyFormat, PlyReader};
use std::fmt;
use std::io::{BufRead, ErrorKind, Read};
use std::marker::PhantomData;
use std::path::Path;

/// Reads the mesh of a PLY file; errors name `path`.
///
/// # Errors
/// If the header is invalid, the file ends too early or too late, a number is damaged or not finite, a face names a vertex
/// that is not there, or no face is left.
pub(super) fn parse(mut reader: impl BufRead, path: &Path) -> Result<Moved> {
    let Header { format, text, bytes, lines, is_cloud } = Header::read(&mut reader, path)?;
    if is_cloud {
        return Err(unread::cloud().at(Place::file(path)));
    }
    let is_text = format == PlyFormat::Ascii;
    let counts = Counts::starting_at(bytes, lines);
    let damaged = |what: String| {
        let place = if is_text { Place::line(path, counts.line.get()) } else { Place::byte(path, counts.byte.get()) };
        words::damaged("PLY", what).at(place)
    };
    // The end of a text ends its last number too.
    let end: &[u8] = if is_text { b"\n" } else { b"" };
    let mut reader = text.as_bytes().chain(Counted::new(reader.chain(end), &counts));
    let mut ply = PlyReader::from_reader(&mut reader).map_err(|error| damaged(error.0.to_string()))?;
    let (mut vertices, mut faces, mut strips) = (Vertices::default(), Corners::default(), Corners::default());
    while let Some(element) = ply.current_element() {
        let (name, rows) = (element.name.clone(), element.count);
        let read = match name.as_str() {
            "vertex" => ply.next_element().map(|Rows(read, _)| vertices = read),
            "face" => ply.next_element().map(|Rows(read, _)| faces = read),
            "tristrips" => ply.next_element().map(|Rows(read, _)| strips = read),
            _ => ply.next_element().map(|Rows(Skipped, _)| ()),
        };
        read.map_err(|DeserializeError(error)| match error.kind() {
            ErrorKind::UnexpectedEof => damaged(format!("it ends before the {rows} rows of the element {name:?} do")),
            ErrorKind::InvalidData => damaged(format!("{error}, in a row of the element {name:?}")),
            _ => Error::io(path, "read the mesh", error),
        })?;
    }
    loop {
        let rest = reader.fill_buf().map_err(|source| Error::io(path, "read the mesh", source))?;
        if rest.iter().any(|byte| !byte.is_ascii_whitespace() && *byte != 0) {
            return Err(damaged("more stands after the rows that its header states".into()));
        }
        match rest.len() {
            0 => break,
            length => reader.consume(length),
        }
    }
    let offset = Bounds::of(faces.used(&vertices.0).chain(strips.used(&vertices.0))).offset();
    let rounded = vertices.0.iter().map(|&vertex| rounded(vertex, offset)).collect();
    let mut mesh = Mesh { vertices: rounded, triangles: Vec::new() };
    faces.cut(&mut mesh).and_then(|()| strips.cut_strips(&mut mesh)).map_err(|error| error.at(Place::file(path)))?;
    let step = match is_text {
        true => step_of_decimals(&vertices.0, &mesh.triangles),
        false => step_of_f32(vertices.0.iter().copied()),
    };
    Ok((mesh, offset, step))
}

/// Receiver of the rows of an element, one by one.
trait Collect: Default {
    type Row: for<'de> Deserialize<'de>;

    /// Takes a row, or returns the problem with it.
    fn take(&mut self, row: Self::Row) -> Result<(), String>;
}

/// All rows of an element.
struct Rows<C>(C, PhantomData<C>);

impl<'de, C: Collect> Deserialize<'de> for Rows<C> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(RowVisitor(PhantomData))
    }
}

struct RowVisitor<C>(PhantomData<C>);

impl<'de, C: Collect> Visitor<'de> for RowVisitor<C> {
    type Value = Rows<C>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("the rows of an element")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut rows: A) -> Result<Self::Value, A::Error> {
        let mut taken = C::default();
        while let Some(row) = rows.next_element()? {
            taken.take(row).map_err(A::Error::custom)?;
        }
        Ok(Rows(taken, PhantomData))
    }
}

/// Places of vertices.
#[derive(Default)]
struct Vertices(Vec<[f64; 3]>);

#[derive(Deserialize)]
struct Vertex {
    x: f64,
    y: f64,
    z: f64,
}

impl Collect for Vertices {
    type Row = Vertex;

    fn take(&mut self, Vertex { x, y, z }: Vertex) -> Result<(), String> {
        for (axis, value) in [('x', x), ('y', y), ('z', z)] {
            if !(value as f32).is_finite() {
                return Err(words::not_finite(axis, format!("{value:e}")).what().into());
            }
        }
        if self.0.len() >= u32::MAX as usize {
            return Err(too_many_vertices().what().into());
        }
        self.0.push([x, y, z]);
        Ok(())
    }
}

/// Corners of faces or of strips.
#[derive(Default)]
struct Corners {
    indices: Vec<i64>,
    /// Number of indices of each face.
    arities: Vec<u32>,
}

#[derive(Deserialize)]
struct Face {
    #[serde(alias = "vertex_index")]
    vertex_indices: Vec<i64>,
}

impl Collect for Corners {
    type Row = Face;

    fn take(&mut self, Face { vertex_indices }: Face) -> Result<(), String> {
        // Points and lines are no surface.
        if vertex_indices.len() >= 3 {
            let arity = u32::try_from(vertex_indices.len()).map_err(|_| "a face has too many corners")?;
            self.indices.extend(vertex_indices);
            self.arities.push(arity);
        }
        Ok(())
    }
}

impl Corners {
    /// The vertices that faces name, as far as they are there.
    fn used(&self, vertices: &[[f64; 3]]) -> impl Iterator<Item = [f64; 3]> {
        let vertex = |&index: &i64| usize::try_from(index).ok().and_then(|index| vertices.get(index)).copied();
        self.indices.iter().filter_map(vertex)
    }

    fn cut(&self, mesh: &mut Mesh) -> Result<()> {
        let Mesh { vertices, triangles } = mesh;
        let (mut cutter, mut face) = (Cutter::default(), Vec::new());
        let mut rest = self.indices.as_slice();
        for &arity in &self.arities {
            let (corners, others) = rest.split_at_checked(arity as usize).unwrap_or_default();
            rest = others;
            face.clear();
            for &corner in corners {
                face.push(vertex(corner, vertices.len())?);
            }
            cutter.cut(&face, |index| vertices[index as usize].map(f64::from), triangles);
        }
        Ok(())
    }

    /// Triangle strips: each vertex makes a triangle with the two before it, every second one turned; -1 begins another strip.
    fn cut_strips(&self, mesh: &mut Mesh) -> Result<()> {
        let mut rest = self.indices.as_slice();
        for &arity in &self.arities {
            let (strips, others) = rest.split_at_checked(arity as usize).unwrap_or_default();
            rest = others;
            for strip in strips.split(|&index| index == -1) {
                for (number, corners) in strip.windows(3).enumerate() {
                    let mut triangle = [0; 3];
                    for (index, corner) in triangle.iter_mut().zip(corners) {
                        *index = vertex(*corner, mesh.vertices.len())?;
                    }
                    if number % 2 == 1 {
                        triangle.swap(0, 1);
                    }
                    mesh.triangles.push(triangle);
                }
            }
        }
        Ok(())
    }
}

/// The vertex that a face names.
fn vertex(index: i64, vertices: usize) -> Result<u32> {
    let found = u32::try_from(index).ok().filter(|&index| (index as usize) < vertices);
    found.ok_or_else(|| words::no_such_vertex(index, vertices as u64))
}

/// Rows that do not shape the mesh.
#[derive(Default)]
struct Skipped;

#[derive(Deserialize)]
struct AnyRow {}

impl Collect for Skipped {
    type Row = AnyRow;

    fn take(&mut self, AnyRow {}: AnyRow) -> Result<(), String> {
        Ok(())
    }
}
