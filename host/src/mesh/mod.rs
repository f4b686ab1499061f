//! Triangle meshes: from files, or built in.
//!
//! - [`source`] finds objects by what a user names: `builtin`, a built-in object, an OBJ file, a directory of them.
//! - [`obj`] reads and writes one file; [`builtin`] makes the ten objects that need no file.
//! - [`Mesh`] is what comes out: vertices and triangles, in the file's own units. [`Object`] gives it a name.
//! - [`facts`] says whether a mesh is closed and right side out, how large it is and what volume it encloses.
//!
//! From here a mesh goes to [`Scene::new`](crate::probe::Scene::new), which scales it to the units of the probe.
//!
//! ```
//! use palpate::mesh::facts::Facts;
//! use palpate::mesh::{Mesh, obj};
//! use palpate::probe::Scene;
//! use palpate::probe::glam::DVec3;
//!
//! # fn main() -> palpate::Result<()> {
//! // A tetrahedron, as it would stand in a file.
//! let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
//! let mesh: Mesh = obj::parse(text.as_bytes(), "tetrahedron.obj".as_ref())?;
//!
//! let facts = Facts::of(&mesh);
//! assert!(facts.is_closed() && facts.is_right_side_out());
//! assert!((facts.volume - 1.0 / 6.0).abs() < 1e-9);
//!
//! // The bounding box's longest side becomes 10 units. A finger of radius 0.15 that comes from above meets the face at
//! // the bottom of the box, or the slope before it.
//! let scene = Scene::new(&mesh, 10.0)?;
//! let time = scene.first_contact(DVec3::new(-4.0, -4.0, 9.0), DVec3::NEG_Z, 0.15);
//! assert!(time.is_some_and(|time| time > 4.0 && time < 14.0));
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "objects")]
pub mod builtin;
#[cfg(not(feature = "objects"))]
#[path = "no_builtin.rs"]
mod builtin;
pub mod facts;
pub mod obj;
pub mod source;
mod triangles;

pub use triangles::Mesh;

/// An object to recognize: a named mesh, one class of a model.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its name: the label of its touches and of its output in a model, and the stem of its files.
    pub name: String,
    /// Its mesh, in the units of its file.
    pub mesh: Mesh,
}
