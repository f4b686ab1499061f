//! Scans: points of a surface, as a robot sees it, and the closed surface through them.
//!
//! ```text
//! file ──► Points ──► Cloud ──► smoothed, with normals ──► Poisson field ──► closed mesh
//! pcd, xyz, ply, depth  side      smooth                    field             contour
//! ```
//!
//! Each point says on which side of it is outside: by its normal, or by the place it was seen from; else its neighbors do, or
//! the cloud is refused. The method and its error: [`surface`].

mod contour;
pub(super) mod depth;
mod field;
mod holes;
mod near;
pub(super) mod pcd;
mod side;
mod smooth;
mod table;
mod views;
pub(super) mod xyz;

use super::Mesh;
use super::exact::{Bounds, rounded};
use super::facts::short;
use crate::error::{Error, MeshProblem, Place, Result};
use glam::DVec3;
use holes::Holes;
use std::path::Path;

/// Fewest points of a surface.
const FEWEST: usize = 100;

/// Most points in a file.
const MOST: usize = 50_000_000;

/// Most points that a surface is made of: some ten seconds.
const USED: usize = 200_000;

/// A point as it stands in a file.
pub(super) struct Point {
    /// Its place; not finite if it was not measured.
    pub(super) place: [f64; 3],
    /// A normal that points outward, of any length.
    pub(super) normal: Option<[f64; 3]>,
    /// Place of the sensor that saw it.
    pub(super) viewpoint: Option<[f64; 3]>,
}

/// Reliability of the places of sensors.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) enum Sensors {
    /// Each point states one; 0 0 0 in all of them is a default.
    #[default]
    Points,
    /// The file states one.
    File,
    /// The file has the default of its format, which may be true.
    Default,
    /// They are those of images with poses.
    Images,
}

/// The points of a file.
#[derive(Default)]
pub(super) struct Points {
    measured: Vec<Point>,
    unmeasured: usize,
    sensors: Sensors,
    /// The table that the object stood on: the normal of its plane, upward, and its height along it.
    table: Option<(DVec3, f64)>,
    /// Notes on how the file was read.
    notes: Vec<String>,
}

impl Points {
    pub(super) fn add(&mut self, point: Point) {
        match point.place.iter().all(|&value| (value as f32).is_finite()) {
            true => self.measured.push(point),
            false => self.unmeasured += 1,
        }
    }
}

/// A surface through points.
pub(super) struct Scanned {
    pub(super) mesh: Mesh,
    /// The points, in the coordinates of the mesh.
    pub(super) points: Vec<[f32; 3]>,
    /// Offset subtracted from the coordinates, as of meshes.
    pub(super) moved: [f64; 3],
    /// Share of the surface that closes holes, without the underside of what stood on a table.
    pub(super) guessed: f64,
    /// Notes: the points that were left out, which side is outside where the file does not say it, the noise of the points,
    /// and the sizes of the holes that were closed.
    pub(super) notes: Vec<String>,
}

/// Points with outward directions, which are unit vectors.
struct Cloud {
    places: Vec<DVec3>,
    outward: Vec<DVec3>,
}

/// The closed surface through points.
///
/// 1. Points move onto planes that are fitted to their neighbors on the same side of the object, with as many neighbors as
///    their noise asks for; the planes are their normals.
/// 2. The field whose gradient is that of the normals solves Poisson's equation on a grid (Kazhdan, Bolitho and Hoppe,
///    *Poisson Surface Reconstruction*, 2006), with a term that draws it to its level at the points (Kazhdan and Hoppe,
///    *Screened Poisson Surface Reconstruction*, 2013).
/// 3. The level is contoured by marching tetrahedra: each edge belongs to two triangles, and holes are closed.
///
/// Equal points give equal bytes on any number of threads. Its error is measured in `docs/measurements/scans.md`.
///
/// # Errors
/// [`MeshProblem::PointCount`], [`MeshProblem::NoSide`], [`MeshProblem::OnePlace`].
pub(super) fn surface(mut points: Points, path: &Path) -> Result<Scanned> {
    let at = |problem| Error::at(Place::file(path), problem);
    let count = points.measured.len();
    if !(FEWEST..=MOST).contains(&count) {
        return Err(at(MeshProblem::PointCount { count, fewest: FEWEST, most: MOST }));
    }
    let nth = count.div_ceil(USED);
    let mut number = 0;
    points.measured.retain(|_| {
        number += 1;
        number % nth == 0
    });
    let moved = Bounds::of(points.measured.iter().map(|point| point.place)).offset();
    let mut notes = std::mem::take(&mut points.notes);
    if points.unmeasured > 0 {
        notes.push(format!("{} without coordinates {} left out", counted(points.unmeasured), are(points.unmeasured)));
    }
    if nth > 1 {
        notes.push(format!("every {} of {count} points is used, and the others are left out", ordinal(nth)));
    }
    let shown: Vec<[f32; 3]> = points.measured.iter().map(|point| rounded(point.place, moved)).collect();
    let mut places: Vec<DVec3> =
        points.measured.iter().map(|point| DVec3::from(point.place) - DVec3::from(moved)).collect();
    let is_near = smooth::near_others(&places);
    let mut kept = is_near.iter();
    places.retain(|_| kept.next() == Some(&true));
    let mut kept = is_near.iter();
    points.measured.retain(|_| kept.next() == Some(&true));
    if places.iter().all(|place| Some(place) == places.first()) {
        return Err(at(MeshProblem::OnePlace));
    }
    let side::Sides { outward, notes: said } = side::sides(&points, &places, DVec3::from(moved)).map_err(at)?;
    let smoothed = smooth::smoothed(Cloud { places, outward }).ok_or_else(|| at(MeshProblem::OnePlace))?;
    let (count, outliers) = (shown.len(), shown.len() - smoothed.places.len());
    if outliers > 0 {
        notes.push(format!("{outliers} of {count} points lie apart from the others and are left out"));
    }
    notes.extend(said);
    let field = field::Field::new(&smoothed);
    let mesh = contour::contour(&field);
    let (mesh, specks) = holes::without_specks(mesh);
    if specks > 0 {
        let are = if specks == 1 {
            "speck of the surface, below 1 % of it, is"
        } else {
            "specks of the surface, each below 1 % of it, are"
        };
        notes.push(format!("{specks} {are} left out"));
    }
    let mesh = mesh.usable().map_err(at)?;
    notes.push(format!(
        "a surface of {} triangles through {} with a noise of {}",
        mesh.triangles.len(),
        counted(count),
        short(smoothed.noise)
    ));
    let Holes { note, guessed } = Holes::of(&mesh, &smoothed, &points, moved);
    notes.push(note);
    let notes = notes.into_iter().map(|note| format!("{}: {note}", path.display())).collect();
    Ok(Scanned { mesh, points: shown, moved, guessed, notes })
}

fn counted(points: usize) -> String {
    format!("{points} point{}", if points == 1 { "" } else { "s" })
}

fn ordinal(number: usize) -> String {
    let ending = match (number % 10, number % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{number}{ending}")
}

fn are(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}
