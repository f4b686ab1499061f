//! Triangle meshes.

/// An indexed triangle mesh, in its file's own units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub vertices: Vec<[f32; 3]>,
    /// Triangles as indices into `vertices`, anticlockwise when seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// An object to recognise: a name and a mesh.
#[derive(Clone, Debug)]
pub struct Object {
    /// The object's name: a class label, and a file's stem.
    pub name: String,
    /// Its mesh, not yet scaled.
    pub mesh: Mesh,
}
