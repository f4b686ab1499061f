//! The ten built-in objects, made from implicit functions.
//!
//! Each object is a function from its proportions to an implicit shape (in centimetres, z up, lying or standing as it
//! does on a table), meshed by manifold dual contouring ([`fidget_mesh`]). The canonical proportions are those of a
//! real thing; [`varied`] makes other members of the same family.

mod bowl;
mod camera;
mod contour;
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
use crate::mesh::Object;
use contour::{Form, mesh};
use proportions::Proportions;
use rayon::prelude::*;

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

#[cfg(test)]
mod tests;
