//! The ten built-in objects, made from implicit functions.
//!
//! Each object is a function from its proportions to an implicit shape (in centimetres, z up, lying or standing as it
//! does on a table), meshed by manifold dual contouring ([`fidget_mesh`]). The canonical proportions are those of a
//! real thing; [`varied`] makes other members of the same family.

mod bowl;
mod camera;
mod fork;
mod hammer;
mod mouse;
mod paperclip;
mod proportions;
mod scissors;
mod shape;
mod spoon;
mod winebottle;
mod wristwatch;

use crate::error::{Error, Result};
use crate::mesh::{Mesh, Object};
use fidget_core::context::Tree;
use glam::Vec3;
use proportions::Proportions;
use rayon::prelude::*;
use shape::Shape;

/// An implicit shape, where it is, and how finely it is to be meshed.
struct Form {
    /// Negative inside.
    shape: Shape,
    /// The corners of a box that holds it, in centimetres.
    bounds: [Vec3; 2],
    /// How many of the meshing's smallest cells go along the longest side of `bounds`: enough that the thinnest feature
    /// is three of them thick.
    cells: f32,
}

/// The depth of the octree in which shapes are meshed.
const DEPTH: u8 = 9;

/// The built-in objects' names and shapes, in the order in which [`builtin`] gives them.
const KINDS: [(&str, fn(&mut Proportions) -> Form); 10] = [
    ("bowl", bowl::form),
    ("camera", camera::form),
    ("paperclip", paperclip::form),
    ("fork", fork::form),
    ("hammer", hammer::form),
    ("mouse", mouse::form),
    ("scissors", scissors::form),
    ("spoon", spoon::form),
    ("wristwatch", wristwatch::form),
    ("winebottle", winebottle::form),
];

/// The names of the built-in objects, in the order of [`builtin`].
pub fn names() -> [&'static str; 10] {
    KINDS.map(|(name, _)| name)
}

/// The ten built-in objects: closed, their triangles anticlockwise seen from outside, in centimetres with z up.
///
/// The same meshes on any number of threads. About a second of work.
pub fn builtin() -> Vec<Object> {
    KINDS
        .into_par_iter()
        .map(|(name, form)| Object { name: name.into(), mesh: mesh(&form(&mut Proportions::canonical())) })
        .collect()
}

/// Another object of the kind `name`: its lengths, radii, curvatures and angles each vary by up to a fifth or so. The
/// same seed gives the same object. Its name is the kind's.
///
/// # Errors
/// [`Error::Argument`] if there is no such kind.
pub fn varied(name: &str, seed: u64) -> Result<Object> {
    let form = kind(name)?;
    Ok(Object { name: name.into(), mesh: mesh(&form(&mut Proportions::varied(seed))) })
}

/// The built-in object `name`, as [`builtin`] makes it.
///
/// # Errors
/// [`Error::Argument`] if there is no such object.
pub fn one(name: &str) -> Result<Object> {
    let form = kind(name)?;
    Ok(Object { name: name.into(), mesh: mesh(&form(&mut Proportions::canonical())) })
}

fn kind(name: &str) -> Result<fn(&mut Proportions) -> Form> {
    KINDS.iter().find(|kind| kind.0 == name).map(|kind| kind.1).ok_or_else(|| {
        Error::argument(format!("no built-in object \"{name}\""), format!("Choose one of {}.", names().join(", ")))
    })
}

/// Meshes a form in one thread, so that the order of vertices and triangles is always the same.
fn mesh(form: &Form) -> Mesh {
    let centre = (form.bounds[0] + form.bounds[1]) / 2.0;
    // The mesher works in a cube of 2^DEPTH cells a side, of which the bounds fill only a part. It merges cells as long
    // as the surface stays within about a thousandth of that cube, so flat parts get large triangles.
    let side = (form.bounds[1] - form.bounds[0]).max_element();
    let reach = side / form.cells * f32::from(1_u16 << DEPTH) / 2.0;
    let (x, y, z) = Tree::axes();
    let tree = form.shape.0.remap_xyz(x * reach + centre.x, y * reach + centre.y, z * reach + centre.z) / reach;
    let settings = fidget_mesh::Settings { depth: DEPTH, threads: None, ..Default::default() };
    // Neither can fail: the shapes have no variables but x, y and z, and nobody cancels.
    let Ok(shape) = fidget_core::vm::VmShape::from(tree).try_into() else { return Mesh::default() };
    let Some(octree) = fidget_mesh::Octree::build(&shape, &settings) else { return Mesh::default() };
    let contoured = octree.walk_dual();
    let place = |v: [f32; 3]| (Vec3::from(v) * reach + centre).to_array();
    let index = |i: usize| u32::try_from(i).unwrap_or(u32::MAX);
    Mesh {
        vertices: contoured.vertices.iter().map(|v| place([v.x, v.y, v.z])).collect(),
        triangles: contoured.triangles.iter().map(|t| [index(t.x), index(t.y), index(t.z)]).collect(),
    }
}

#[cfg(test)]
mod tests;
