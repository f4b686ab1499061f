//! A mesh in the units of the probe, ready to be touched.

use crate::error::Result;
use crate::mesh::{Mesh, no_extent};
use crate::probe::sweep::{Contact, Surface, narrow::Triangle};
use glam::{DMat3, DVec3};

/// A mesh in the units of the probe, with what makes casting spheres at it fast.
#[derive(Clone, Debug)]
pub struct Scene {
    surface: Surface,
    bounds: [DVec3; 2],
    table: Option<Table>,
}

/// A table under an object, and how the object lies on it. Its top is level with the object's lowest point.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The number of the mesh among the object's instances, from 0.
    pub instance: usize,
    /// The name of the placement.
    pub placement: String,
    /// The placement's weight among all of the instance.
    pub weight: f64,
    /// Largest angle between approaches and straight down, in degrees.
    pub cone: f64,
}

impl Scene {
    /// The mesh, scaled so that its bounding box's longest side has `length` units and centered on the box's center.
    ///
    /// # Errors
    /// When the mesh has no triangles, a triangle names a vertex that is missing or not finite, or all vertices are at the
    /// same point.
    pub fn new(mesh: &Mesh, length: f64) -> Result<Self> {
        let mut triangles = corners(mesh)?;
        scale(&mut triangles, length)?;
        Ok(Self::of(triangles))
    }

    /// The mesh as it lies on a table: scaled so that the longest side of its bounding box in its own frame has `length` units,
    /// rotated, and centered on the center of its box then. The z axis points up.
    ///
    /// # Errors
    /// Errors of [`new`](Self::new).
    pub fn on_table(mesh: &Mesh, length: f64, rotation: DMat3, table: Table) -> Result<Self> {
        let mut triangles = corners(mesh)?;
        scale(&mut triangles, length)?;
        triangles.iter_mut().flatten().for_each(|corner| *corner = rotation * *corner);
        let [low, high] = bounds(&triangles);
        let center = (low + high) / 2.0;
        triangles.iter_mut().flatten().for_each(|corner| *corner -= center);
        Ok(Self { table: Some(table), ..Self::of(triangles) })
    }

    /// The mesh in its own units and place.
    ///
    /// # Errors
    /// When the mesh has no triangles, or a triangle names a vertex that is missing or not finite.
    pub fn as_is(mesh: &Mesh) -> Result<Self> {
        Ok(Self::of(corners(mesh)?))
    }

    fn of(triangles: Vec<Triangle>) -> Self {
        let (surface, bounds) = Surface::with_bounds(triangles);
        Self { surface, bounds, table: None }
    }

    /// The table that the object lies on; none if it floats.
    pub fn table(&self) -> Option<&Table> {
        self.table.as_ref()
    }

    /// Distance at which a sphere that moves from `origin` in a direction, a unit vector, reaches the table: 0 if it starts
    /// there, infinite if there is no table or the sphere does not come down to it.
    pub(crate) fn reaches_table(&self, origin: DVec3, direction: DVec3, radius: f64) -> f64 {
        if self.table.is_none() {
            return f64::INFINITY;
        }
        let [low, _] = self.bounds;
        let above = origin.z - radius - low.z;
        if above <= 0.0 {
            0.0
        } else if direction.z < 0.0 {
            above / -direction.z
        } else {
            f64::INFINITY
        }
    }

    /// The surface itself.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The triangles' corners, in no particular order.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = Triangle> + '_ {
        self.surface.triangles()
    }

    /// The bounding box: its lowest and highest corner.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// The center of mass of the surface, as if it were a shell of the same thickness everywhere. Cost: one pass over the
    /// triangles.
    pub(crate) fn center_of_mass(&self) -> DVec3 {
        let add = |(sum, area): (DVec3, f64), [a, b, c]: Triangle| {
            let twice = (b - a).cross(c - a).length();
            (sum + (a + b + c) * (twice / 3.0), area + twice)
        };
        let (sum, area) = self.triangles().fold((DVec3::ZERO, 0.0), add);
        let [low, high] = self.bounds;
        if area > 0.0 { sum / area } else { (low + high) / 2.0 }
    }

    /// The first time t ≥ 0 at which a sphere of this radius, centered at origin + t · direction, touches the object: 0
    /// when it starts in contact, none when it never touches. With a unit vector as direction, t is a distance in units.
    pub fn first_contact(&self, origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
        self.surface.first_contact(origin, direction, radius)
    }

    /// The [first contact](Self::first_contact), and how the surface is oriented there. Cost: about that of one cast.
    pub fn contact(&self, origin: DVec3, direction: DVec3, radius: f64) -> Option<Contact> {
        self.surface.contact(origin, direction, radius)
    }

    /// The [first contacts](Self::first_contact) of these origins if all of them touch; none as soon as one does not.
    pub(crate) fn all_contacts<const N: usize>(
        &self,
        origins: [DVec3; N],
        direction: DVec3,
        radius: f64,
    ) -> Option<[f64; N]> {
        self.surface.all_contacts(origins, direction, radius)
    }
}

fn corners(mesh: &Mesh) -> Result<Vec<Triangle>> {
    mesh.check_faces()?;
    let corner = |index: u32| mesh.vertex(index).map(|vertex| vertex.as_dvec3());
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for &[a, b, c] in &mesh.triangles {
        triangles.push([corner(a)?, corner(b)?, corner(c)?]);
    }
    Ok(triangles)
}

/// Scales triangles so that the longest side of their bounding box has `length` units, and moves its center to the origin.
fn scale(triangles: &mut [Triangle], length: f64) -> Result<()> {
    let [low, high] = bounds(triangles);
    let longest = (high - low).max_element();
    if longest <= 0.0 {
        return Err(no_extent());
    }
    let (center, scale) = ((low + high) / 2.0, length / longest);
    triangles.iter_mut().flatten().for_each(|corner| *corner = (*corner - center) * scale);
    Ok(())
}

fn bounds(triangles: &[Triangle]) -> [DVec3; 2] {
    let grow = |[low, high]: [DVec3; 2], &corner: &DVec3| [low.min(corner), high.max(corner)];
    triangles.iter().flatten().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], grow)
}
