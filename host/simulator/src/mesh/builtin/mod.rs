//! The ten built-in objects, made from implicit functions.
//!
//! Each object is a function from its proportions to an implicit shape (in centimeters, z up, lying or standing as it
//! would on a table), which manifold dual contouring ([`fidget_mesh`]) turns into a mesh. The canonical proportions are
//! those of a real object; [`varied`] makes others of the same kind.
//!
//! ```
//! # fn main() -> palpate_simulator::Result<()> {
//! let bowl = palpate_simulator::mesh::builtin::one("bowl")?;
//! assert!(palpate_simulator::mesh::facts::Facts::of(bowl.mesh()).is_right_side_out());
//! # Ok(())
//! # }
//! ```

mod background;
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
mod slices;
mod spoon;
mod winebottle;
mod wristwatch;

use crate::error::{Error, Result, problem};
use crate::in_order::in_order;
use crate::mesh::{BACKGROUND, Instance, Object};
use contour::Form;
use proportions::Proportions;
use rayon::prelude::*;

/// An object's name, and the function from its proportions to its shape.
type Kind = (&'static str, fn(&mut Proportions) -> Form);

/// In the order in which [`all`] gives them.
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

/// The built-in objects are made in centimeters.
const MILLIMETERS: f64 = 10.0;

/// The names of the built-in objects, in the order of [`all`].
pub fn names() -> [&'static str; 10] {
    KINDS.map(|(name, _)| name)
}

/// The ten built-in objects: closed, their triangles anticlockwise seen from outside, in centimeters with z up.
///
/// The meshes are the same on any number of threads. Takes a few seconds of one thread's time.
///
/// # Errors
/// If one has no closed mesh, never so far.
pub fn all() -> Result<Vec<Object>> {
    make_all(&KINDS, None)
}

/// The built-in object `name`, the same that [`all`] gives.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) if there is no such object; as [`all`].
pub fn one(name: &str) -> Result<Object> {
    make_one(&kind(name)?, None)
}

/// Another object of the kind `name`: its lengths, radii, curvatures and angles each vary by up to about a fifth. The
/// same seed gives the same object. It has the kind's name.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) if there is no such kind; and if the proportions that the seed gives
/// have no closed mesh.
pub fn varied(name: &str, seed: u64) -> Result<Object> {
    make_one(&kind(name)?, Some(seed))
}

/// The kind `name` with `count` [`varied`] instances, which the seed chooses: other seeds give others. At least one is
/// made.
///
/// # Errors
/// Errors of [`varied`].
pub fn instances(name: &str, count: usize, seed: u64) -> Result<Object> {
    let kind = kind(name)?;
    // A large prime: no two of the seeds that anyone gives share an instance.
    let first = seed.wrapping_mul(1_000_000_007);
    let make = |number: u64| -> Result<Instance> {
        let seed = first.wrapping_add(number);
        Ok(Instance { name: format!("varied-{seed}"), mesh: make_one(&kind, Some(seed))?.mesh().clone() })
    };
    let made = in_order((0..count.max(1) as u64).into_par_iter().map(make))?;
    let object = Object::of_instances(name, made).ok_or_else(|| not_meshed(name, Some(seed)))?;
    Ok(Object { millimeters: Some(MILLIMETERS), ..object })
}

/// Default number of shapes made by [`background`].
pub const BACKGROUND_SHAPES: usize = 200;

/// One object of `count` instances that have nothing in common: lumps, wires, plates, vessels and so on, each a shape of
/// its own, which the seed chooses. What a model's background column is trained on, so that an object that the model
/// does not know is not taken for one that it does. At least one is made. None of them is one of the ten built-in
/// objects.
///
/// Takes about a tenth of a second of one thread's time per shape.
///
/// # Errors
/// If none of many shapes in a row has a closed mesh, never so far.
pub fn background(count: usize, seed: u64) -> Result<Object> {
    let first = seed.wrapping_mul(1_000_000_007);
    let made = in_order((0..count.max(1) as u64).into_par_iter().map(|number| shape(first, number)))?;
    let object = Object::of_instances(BACKGROUND, made).ok_or_else(|| not_meshed(BACKGROUND, Some(seed)))?;
    Ok(Object { millimeters: Some(MILLIMETERS), ..object })
}

/// Shape `number`: the first that has a closed mesh, of those that are tried for it.
fn shape(first: u64, number: u64) -> Result<Instance> {
    // Multiples of the number of families keep the family; a prime times that many, so that numbers share no seed.
    let seeds =
        (0..100_u64).map(|attempt| first.wrapping_add(number).wrapping_add(attempt.wrapping_mul(10_000_019_000)));
    let mut made = seeds.filter_map(|seed| Some((seed, contour::mesh(&background::form(seed))?)));
    match made.next() {
        Some((_, mesh)) => Ok(Instance { name: format!("shape-{number}"), mesh }),
        None => Err(not_meshed(&format!("shape-{number}"), Some(first))),
    }
}

/// Seeds of [`many`]'s shapes: none of a background's at usual seeds.
const MANY_SHAPES: u64 = 7_000_000_049_000;

/// `count` objects that differ: the ten built-in ones, then in turn ten shapes as those of [`background`] (`shape-0` and
/// on), one of each family, and another [`varied`] object of each kind (`bowl-1` and on). Of two numbers, the objects of
/// the smaller are the first of the larger. What more objects cost is measured on them.
///
/// Takes about a tenth of a second of one thread's time per object.
///
/// # Errors
/// Errors of [`background`].
pub fn many(count: usize) -> Result<Vec<Object>> {
    let kinds = KINDS.len();
    let make = |number: usize| -> Result<Object> {
        let (turn, kind) = (number / kinds, number % kinds);
        match (turn, turn.is_multiple_of(2)) {
            (0, _) => make_one(&KINDS[kind], None),
            (_, true) => {
                let instance = turn / 2;
                let seeds = (0..100_u64).map(|attempt| 2_000 + instance as u64 + 1_000 * attempt);
                let made = seeds.map(|seed| make_one(&KINDS[kind], Some(seed))).find(Result::is_ok);
                let name = format!("{}-{instance}", KINDS[kind].0);
                let object = made.ok_or_else(|| not_meshed(&name, None))??;
                Ok(Object { millimeters: Some(MILLIMETERS), ..Object::new(name, object.mesh().clone()) })
            }
            (_, false) => {
                let shape = shape(MANY_SHAPES, (turn / 2 * kinds + kind) as u64)?;
                Ok(Object { millimeters: Some(MILLIMETERS), ..Object::new(shape.name, shape.mesh) })
            }
        }
    };
    in_order((0..count).into_par_iter().map(make))
}

/// The objects `names`, in that order: canonical, or with a seed [`varied`].
///
/// # Errors
/// Errors of [`one`] and [`varied`].
pub fn make(names: &[&str], seed: Option<u64>) -> Result<Vec<Object>> {
    let kinds = names.iter().map(|name| kind(name)).collect::<Result<Vec<_>>>()?;
    make_all(&kinds, seed)
}

fn make_all(kinds: &[Kind], seed: Option<u64>) -> Result<Vec<Object>> {
    in_order(kinds.par_iter().map(|kind| make_one(kind, seed)))
}

fn make_one(&(name, form): &Kind, seed: Option<u64>) -> Result<Object> {
    let mut proportions = seed.map_or(Proportions::canonical(), Proportions::varied);
    match contour::mesh(&form(&mut proportions)) {
        Some(mesh) => Ok(Object { millimeters: Some(MILLIMETERS), ..Object::new(name, mesh) }),
        None => Err(not_meshed(name, seed)),
    }
}

/// An object cannot be meshed without gaps at any resolution that is tried. The seed is that of its proportions.
fn not_meshed(name: &str, seed: Option<u64>) -> Error {
    let (which, fix) = match seed {
        Some(seed) => (format!("with seed {seed}"), "Use another seed."),
        None => ("in its canonical proportions".into(), "Report this as a bug."),
    };
    problem!("the built-in object {name} {which} has no closed mesh").fix(fix)
}

fn kind(name: &str) -> Result<Kind> {
    let found = KINDS.into_iter().find(|kind| kind.0 == name);
    found.ok_or_else(|| {
        Error::setting("name", format!("{name:?}"), format!("the name of a built-in object: {}", names().join(", ")))
    })
}
