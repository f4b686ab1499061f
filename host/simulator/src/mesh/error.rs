//! Problems with meshes and where they come from.

use crate::error::Variant;
use std::path::PathBuf;

/// Problems with meshes and where they come from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshProblem {
    /// A source does not exist, and is not the name of a built-in object.
    #[error("cannot read the mesh: this is neither a file, a directory nor a built-in object")]
    NoSuchSource {
        /// The names of the built-in objects.
        builtin: Vec<&'static str>,
    },
    /// A directory holds no mesh.
    #[error("no mesh here: no file ends in .obj, .stl, .ply, .gltf, .glb or .dae")]
    NoMeshes,
    /// A directory holds no mesh, but files of formats that are not read.
    #[error("no mesh that is read here: {files}")]
    NoneRead {
        /// The files, and what reads them.
        files: String,
    },
    /// Some of several files cannot be read.
    #[error("{} of {count} meshes cannot be read:\n  {}", errors.len(), errors.join("\n  "))]
    Unread {
        /// Number of files.
        count: usize,
        /// Error of each unreadable one, with its name.
        errors: Vec<String>,
    },
    /// Git LFS left a pointer in the place of a file.
    #[error("this is a pointer of Git LFS, and not the file itself")]
    LfsPointer,
    /// Several objects where one is asked for.
    #[error("{count} objects, where one is needed")]
    SeveralObjects {
        /// Number of objects.
        count: usize,
    },
    /// Two sources give objects of one name.
    #[error("two objects are called {name}: {first} and {second}")]
    SameName {
        /// The name.
        name: String,
        /// Source of the first: a file, or `builtin`.
        first: PathBuf,
        /// Source of the second.
        second: PathBuf,
    },
    /// A vertex line has fewer than three coordinates.
    #[error("a vertex without {axis}")]
    MissingCoordinate {
        /// The first one that is missing: `x`, `y` or `z`.
        axis: char,
    },
    /// A coordinate is no number.
    #[error("{text:?} is not a number")]
    NotANumber {
        /// Text that is there instead, shortened.
        text: String,
    },
    /// A coordinate is infinite, not a number, or beyond the range of an `f32`.
    #[error("the coordinate {axis} = {text:?} is not finite")]
    NotFinite {
        /// The axis: `x`, `y` or `z`.
        axis: char,
        /// Text that is there, shortened.
        text: String,
    },
    /// A face has something else than vertex indices.
    #[error("{text:?} is not a vertex of a face")]
    NotAnIndex {
        /// Text that is there instead, shortened.
        text: String,
    },
    /// A face's index is 0, or counts back to before the first vertex.
    #[error("vertex {index} of a face is out of range: {vertices} vertices before it")]
    IndexBeforeFirst {
        /// The index as it stands in the file: negative ones count back from the last vertex.
        index: i64,
        /// Number of vertices before the face in the file.
        vertices: u64,
    },
    /// A face's index is larger than the number of vertices.
    #[error("vertex {index} of a face is out of range: the file has {vertices} vertices")]
    IndexAfterLast {
        /// The index, counted from 1.
        index: u64,
        /// Number of vertices of the file.
        vertices: u64,
    },
    /// A face's index is negative, or larger than the number of vertices.
    #[error("vertex {index} of a face is missing: there are {vertices} vertices, counted from 0")]
    NoSuchVertex {
        /// The index as it stands in the file, counted from 0.
        index: i64,
        /// Number of vertices.
        vertices: u64,
    },
    /// A file breaks the rules of its kind.
    #[error("the {format} file is damaged: {what}")]
    Damaged {
        /// The kind of file: `STL`.
        format: &'static str,
        /// Description of the fault.
        what: String,
    },
    /// A file uses a feature that is not read and would change the surface.
    #[error("{what} is not read")]
    Unsupported {
        /// Name of the feature.
        what: String,
        /// Remedy, as a sentence without its full stop.
        instead: &'static str,
    },
    /// A file holds points or depth images, which are not read any more.
    #[error("{what} are not read")]
    Points {
        /// Contents of the file: "points in PCD".
        what: &'static str,
        /// Remedy, as the rest of a sentence that begins with "Instead".
        instead: &'static str,
    },
    /// The meshes of a file, placed as often as it says, are too large for a file of its length; or a pipe does not end.
    #[error("the mesh would take more than {limit} bytes")]
    TooLarge {
        /// Largest number of bytes allowed.
        limit: u64,
    },
    /// More vertices than an index can tell apart.
    #[error("the mesh has more than 4294967295 vertices")]
    TooManyVertices,
    /// The parser refuses the file for another reason.
    #[error("cannot be read as a mesh ({reason})")]
    Unreadable {
        /// The parser's message.
        reason: String,
    },
    /// The mesh has no triangles.
    #[error("the mesh has no faces")]
    NoFaces,
    /// Each triangle of the mesh is a single point.
    #[error("the mesh has no extent: each of its faces is a single point")]
    NoExtent,
    /// A triangle names a vertex that the mesh does not have.
    #[error("vertex {index} of the mesh is missing: it has {vertices} vertices, counted from 0")]
    MissingVertex {
        /// The index, counted from 0.
        index: u32,
        /// Number of vertices of the mesh.
        vertices: usize,
    },
    /// A triangle has a vertex that is infinite or not a number.
    #[error("vertex {index} of the mesh is not finite")]
    VertexNotFinite {
        /// The index, counted from 0.
        index: u32,
    },
    /// An object has no placement of a name.
    #[error("{object} has no placement {name}: it has {}", known.join(", "))]
    NoSuchPlacement {
        /// The object.
        object: String,
        /// The name.
        name: String,
        /// The names of its placements.
        known: Vec<String>,
    },
    /// None of the placements that an instance of an object has is to be used.
    #[error("no placement of {object}{} has a weight above 0: it has {}", of_instance(object, instance), known.join(", "))]
    NoPlacement {
        /// The object.
        object: String,
        /// The instance.
        instance: String,
        /// The names of its placements.
        known: Vec<String>,
    },
    /// A built-in object cannot be meshed without gaps at any resolution that is tried.
    #[error("the built-in object {name} {} has no closed mesh", variation(seed))]
    NotMeshed {
        /// The object's name.
        name: String,
        /// The seed of its proportions; none for the canonical ones.
        seed: Option<u64>,
    },
}

fn of_instance(object: &str, instance: &str) -> String {
    if object == instance { String::new() } else { format!(", instance {instance},") }
}

fn variation(seed: &Option<u64>) -> String {
    seed.map_or("in its canonical proportions".into(), |seed| format!("with seed {seed}"))
}

impl Variant for MeshProblem {
    fn fix(&self) -> String {
        match self {
            Self::NoSuchSource { builtin } => {
                format!("Check the path, or give one of the built-in objects: {}.", builtin.join(", "))
            }
            Self::NoMeshes => "Give a directory that holds such files.".into(),
            Self::NoneRead { .. } => "Convert them, then give the directory again.".into(),
            Self::Unread { errors, .. } if errors.len() == 1 => "Repair the file, or leave it out.".into(),
            Self::Unread { .. } => "Repair these files, or leave them out.".into(),
            Self::LfsPointer => "Fetch it: git lfs pull.".into(),
            Self::SeveralObjects { .. } => "Give one mesh file, or the name of one built-in object.".into(),
            Self::SameName { .. } => "Rename one of the files, or leave one out.".into(),
            Self::MissingCoordinate { .. }
            | Self::NotANumber { .. }
            | Self::NotFinite { .. }
            | Self::NotAnIndex { .. }
            | Self::IndexBeforeFirst { .. }
            | Self::IndexAfterLast { .. } => "Correct the line, or export the mesh again.".into(),
            Self::NoSuchVertex { .. } | Self::Damaged { .. } => {
                "Export the mesh again, or convert it to another of OBJ, STL, PLY, GLB and COLLADA.".into()
            }
            Self::Unsupported { instead, .. } => format!("{instead}."),
            Self::Points { instead, .. } => format!("Instead, {instead}."),
            Self::TooLarge { .. } => "Simplify the mesh, or export it without instances or in parts.".into(),
            Self::TooManyVertices => "Simplify the mesh, or export it in parts.".into(),
            Self::Unreadable { .. } | Self::NoFaces | Self::NoExtent => {
                "Export the mesh as a file with faces: OBJ, STL, PLY, GLB or COLLADA.".into()
            }
            Self::MissingVertex { .. } | Self::VertexNotFinite { .. } => {
                "Give a mesh whose faces have finite vertices.".into()
            }
            Self::NoSuchPlacement { .. } | Self::NoPlacement { .. } => {
                "Give the weights of placements that it has; those that are not named are left out.".into()
            }
            Self::NotMeshed { seed: Some(_), .. } => "Use another seed.".into(),
            Self::NotMeshed { seed: None, .. } => "Report this as a bug.".into(),
        }
    }
}
