//! Mesh files of every kind: which kind a file is, by its content, and its mesh.

use super::placed::too_large;
use super::text::Written;
use super::{Mesh, collada, gltf, obj, ply, stl, unread};
use crate::error::{Error, Place, Result};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// The kinds of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// STL, binary or text.
    Stl,
    /// PLY: text, or binary in either byte order.
    Ply,
    /// glTF 2.0, as JSON or as GLB.
    Gltf,
    /// COLLADA.
    Collada,
}

/// The extensions of mesh files, in the order in which they are preferred where a folder holds one name with several.
pub const EXTENSIONS: [&str; 6] = ["obj", "stl", "ply", "gltf", "glb", "dae"];

impl Format {
    /// The kind of file that starts with `head` (a few hundred bytes or more, or all of it) and has `length` bytes. Its
    /// content decides; `extension` only where the content says nothing, so that errors speak of what the user meant.
    pub fn of(head: &[u8], length: u64, extension: Option<&str>) -> Self {
        match Written::of(head, length) {
            Some(written) => Self::of_usual(&written.usual(head.to_vec()), length, extension),
            None => Self::of_usual(head, length, extension),
        }
    }

    /// Kind of text as it is usually written.
    fn of_usual(head: &[u8], length: u64, extension: Option<&str>) -> Self {
        if stl::is_binary(head, length) {
            return Self::Stl;
        }
        let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
        let first = text.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        let rest = text.get(first.len()..).unwrap_or_default();
        if head.starts_with(b"glTF") || text.first() == Some(&b'{') {
            Self::Gltf
        } else if first == b"ply" {
            Self::Ply
        } else if text.first() == Some(&b'<') {
            Self::Collada
        } else if first.eq_ignore_ascii_case(b"solid") {
            Self::Stl
        } else if !rest.is_empty() && (obj::KEYWORDS.contains(&first) || first.starts_with(b"#")) {
            Self::Obj
        } else {
            match extension.map(str::to_ascii_lowercase).as_deref() {
                Some("stl") => Self::Stl,
                Some("ply") => Self::Ply,
                Some("gltf" | "glb") => Self::Gltf,
                Some("dae") => Self::Collada,
                _ => Self::Obj,
            }
        }
    }
}

/// Contents of a file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Contents {
    /// Its mesh, in the units of the file. Of a COLLADA file it is turned so that z is up.
    pub mesh: Mesh,
    /// Offset subtracted from its coordinates: the center of a mesh that is so far from the origin (more than 16 times
    /// its longest side) that f32 would damage it; else zeros.
    pub moved: [f64; 3],
    /// The step in which the file rounds its coordinates, in its units; 0 if that is not known.
    pub step: f64,
    /// Number of millimeters in its unit, where the file says: COLLADA with a unit, glTF (meters, by its standard).
    pub millimeters: Option<f64>,
    /// Format of the file.
    pub format: Format,
    /// Remarks on the file.
    pub notes: Vec<String>,
}

/// Read limit for pipes and other files that are not regular: 1 GiB.
const MOST_OF_A_PIPE: u64 = 1 << 30;

/// Reads a mesh file of any kind: all its meshes together, polygons cut into triangles, without faces that are a single
/// point.
///
/// Memory: at most 256 bytes for each byte of the file (and of those that a glTF file names), and 1 MB.
///
/// # Errors
/// [`Kind::Io`](crate::error::Kind::Io) when the file cannot be read; with its line or byte where the file is damaged or
/// uses unsupported features, and with the file when there is no face or each is a single point.
pub fn read(path: &Path) -> Result<Contents> {
    let io = |source| Error::io(path, "read the mesh", source);
    let file = File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_file() {
        return parse_buffered(BufReader::with_capacity(1 << 18, file), metadata.len(), path, path.parent());
    }
    let mut bytes = Vec::new();
    file.take(MOST_OF_A_PIPE + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > MOST_OF_A_PIPE {
        return Err(too_large(MOST_OF_A_PIPE).at(Place::file(path)));
    }
    parse_buffered(bytes.as_slice(), bytes.len() as u64, path, path.parent())
}

/// Reads the bytes of a mesh file of any kind; errors name `path`, and its extension serves where the bytes do not say
/// what they are.
///
/// # Errors
/// Errors of [`read`]; and where a glTF file needs other files, which it cannot have.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Contents> {
    parse_buffered(bytes, bytes.len() as u64, path, None)
}

/// Reads a mesh of `length` bytes, however its text is written. Files that it names are looked for in `folder`.
fn parse_buffered(mut reader: impl BufRead, length: u64, path: &Path, folder: Option<&Path>) -> Result<Contents> {
    let io = |source| Error::io(path, "read the mesh", source);
    let head = reader.fill_buf().map_err(io)?;
    let Some(written) = Written::of(head, length) else { return parse_usual(reader, length, path, folder) };
    let mut bytes = Vec::new();
    reader.take(length).read_to_end(&mut bytes).map_err(io)?;
    let text = written.usual(bytes);
    parse_usual(text.as_slice(), text.len() as u64, path, folder)
}

fn parse_usual(mut reader: impl BufRead, length: u64, path: &Path, folder: Option<&Path>) -> Result<Contents> {
    let io = |source| Error::io(path, "read the mesh", source);
    let head = reader.fill_buf().map_err(io)?;
    if !stl::is_binary(head, length)
        && let Some(problem) = unread::problem(head, path)
    {
        return Err(problem.at(Place::file(path)));
    }
    let mut notes = Vec::new();
    let format = Format::of_usual(head, length, path.extension().and_then(|extension| extension.to_str()));
    let ((mesh, moved, step), millimeters) = match format {
        Format::Obj => (obj::parse_moved(reader, path)?, None),
        Format::Stl => {
            let (moved, odd) = stl::parse(reader, length, path)?;
            notes = odd;
            (moved, None)
        }
        Format::Ply => (ply::parse(reader, path)?, None),
        Format::Gltf | Format::Collada => {
            let mut bytes = Vec::new();
            // A file that grows while it is read is cut: its end is missing, as its parser says.
            reader.take(length).read_to_end(&mut bytes).map_err(io)?;
            let (moved, millimeters, remarks) = match format {
                Format::Gltf => {
                    let (moved, remarks) = gltf::parse(&bytes, path, folder)?;
                    (moved, Some(1_000.0), remarks)
                }
                _ => collada::parse(&bytes, path)?,
            };
            notes = remarks;
            (moved, millimeters)
        }
    };
    // A text is read as OBJ because it is nothing else.
    let is_called_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    if format == Format::Obj && mesh.triangles.is_empty() && !is_called_obj {
        let what = "a file that is neither OBJ, STL, PLY, glTF nor COLLADA";
        return Err(unread::unsupported(what, "Export a mesh as one of these").at(Place::file(path)));
    }
    let mesh = mesh.usable().map_err(|error| error.at(Place::file(path)))?;
    Ok(Contents { mesh, moved, step, millimeters, format, notes })
}
