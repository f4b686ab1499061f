//! Scans: points of a surface, as a robot sees it, and the closed surface through them.
//!
//! ```text
//! file ──► Points ──► Cloud ──► smoothed, with normals ──► Poisson field ──► closed mesh
//! pcd, xyz, ply, depth  outside   smooth                    field             contour
//! ```
//!
//! Each point says on which side of it is outside: by its normal, or by the place it was seen from. A cloud that says
//! neither is refused, since a guess turns thin objects inside out. The method and its error: [`surface`].

mod contour;
pub(super) mod depth;
mod field;
mod holes;
pub(super) mod pcd;
mod smooth;
#[cfg(test)]
mod tests;
pub(super) mod xyz;

use super::Mesh;
use super::exact::{Bounds, rounded};
use crate::error::{Error, MeshProblem, Place, Result};
use glam::DVec3;
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

/// The points of a file.
#[derive(Default)]
pub(super) struct Points {
    measured: Vec<Point>,
    unmeasured: usize,
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
    /// Notes: the points that were left out, the noise of the others, and the sizes of the holes that were closed.
    pub(super) notes: Vec<String>,
}

/// Points with outward directions, which are unit vectors.
struct Cloud {
    places: Vec<DVec3>,
    outward: Vec<DVec3>,
}

impl Cloud {
    fn new(points: &Points, offset: DVec3) -> Result<Self, MeshProblem> {
        let places: Vec<DVec3> = points.measured.iter().map(|point| DVec3::from(point.place) - offset).collect();
        let bounds = places
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], &place| [low.min(place), high.max(place)]);
        let outward = |(point, &place): (&Point, &DVec3)| {
            let normal = point.normal.and_then(|normal| DVec3::from(normal).try_normalize());
            let eye = point.viewpoint.map(|eye| DVec3::from(eye) - offset);
            // A sensor among the points is a default that nobody set.
            let eye = eye.filter(|eye| eye.cmplt(bounds[0]).any() || eye.cmpgt(bounds[1]).any());
            let seen = eye.and_then(|eye| (eye - place).try_normalize());
            match (normal, seen) {
                (Some(normal), Some(seen)) if normal.dot(seen) < 0.0 => Some(-normal),
                (normal, seen) => normal.or(seen),
            }
        };
        let outward: Option<Vec<DVec3>> = points.measured.iter().zip(&places).map(outward).collect();
        Ok(Self { places, outward: outward.ok_or(MeshProblem::NoSide)? })
    }
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
/// The same points give the same bytes on any number of threads. Its error is measured in `docs/measurements/scans.md`.
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
    let cloud = Cloud::new(&points, DVec3::from(moved)).map_err(at)?;
    let smoothed = smooth::smoothed(&cloud).ok_or_else(|| at(MeshProblem::OnePlace))?;
    let field = field::Field::new(&smoothed);
    let mesh = contour::contour(&field);
    let mut notes = Vec::new();
    let mut note = |text: String| notes.push(format!("{}: {text}", path.display()));
    if points.unmeasured > 0 {
        note(format!("{} points without coordinates are left out", points.unmeasured));
    }
    if nth > 1 {
        note(format!("every {nth}th of {count} points is used, and the others are left out"));
    }
    let count = points.measured.len();
    if smoothed.outliers > 0 {
        note(format!("{} of {count} points lie apart from the others and are left out", smoothed.outliers));
    }
    let (mesh, specks) = holes::without_specks(mesh);
    if specks > 0 {
        let are = if specks == 1 {
            "speck of the surface, below 1 % of it, is"
        } else {
            "specks of the surface, each below 1 % of it, are"
        };
        note(format!("{specks} {are} left out"));
    }
    let mesh = mesh.usable().map_err(at)?;
    note(format!(
        "a surface of {} triangles through {count} points with a noise of {}",
        mesh.triangles.len(),
        holes::short(smoothed.noise)
    ));
    note(holes::said(&mesh, &smoothed));
    let points = points.measured.iter().map(|point| rounded(point.place, moved)).collect();
    Ok(Scanned { mesh, points, moved, notes })
}
