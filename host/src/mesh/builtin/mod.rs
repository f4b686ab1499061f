//! The ten built-in objects, made from implicit functions.
//!
//! Each object is a function from its proportions to an implicit shape (in centimeters, z up, lying or standing as it
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

/// A name, and the shape that proportions give.
type Kind = (&'static str, fn(&mut Proportions) -> Form);

/// The built-in objects' names and shapes, in the order in which [`builtin`] gives them.
const KINDS: [Kind; 10] = [
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

/// The ten built-in objects: closed, their triangles anticlockwise seen from outside, in centimeters with z up.
///
/// The same meshes on any number of threads. A few seconds of work for one thread.
pub fn all() -> Vec<Object> {
    make_all(&KINDS, None)
}

/// The built-in object `name`, as [`builtin`] makes it.
///
/// # Errors
/// [`Error::Argument`] if there is no such object.
pub fn one(name: &str) -> Result<Object> {
    Ok(make_one(&kind(name)?, None))
}

/// Another object of the kind `name`: its lengths, radii, curvatures and angles each vary by up to a fifth or so. The
/// same seed gives the same object. Its name is the kind's.
///
/// # Errors
/// [`Error::Argument`] if there is no such kind.
pub fn varied(name: &str, seed: u64) -> Result<Object> {
    Ok(make_one(&kind(name)?, Some(seed)))
}

/// The objects `names`, in that order: canonical, or with a seed [`varied`].
///
/// # Errors
/// [`Error::Argument`] if there is no object of one of the names.
pub fn make(names: &[&str], seed: Option<u64>) -> Result<Vec<Object>> {
    let kinds = names.iter().map(|name| kind(name)).collect::<Result<Vec<_>>>()?;
    Ok(make_all(&kinds, seed))
}

fn make_all(kinds: &[Kind], seed: Option<u64>) -> Vec<Object> {
    kinds.par_iter().map(|kind| make_one(kind, seed)).collect()
}

fn make_one(&(name, form): &Kind, seed: Option<u64>) -> Object {
    let mut proportions = seed.map_or(Proportions::canonical(), Proportions::varied);
    Object { name: name.into(), mesh: mesh(&form(&mut proportions)) }
}

fn kind(name: &str) -> Result<Kind> {
    KINDS.into_iter().find(|kind| kind.0 == name).ok_or_else(|| {
        Error::argument(format!("no built-in object \"{name}\""), format!("Choose one of {}.", names().join(", ")))
    })
}

#[cfg(test)]
mod tests;
