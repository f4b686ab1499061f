//! Placements of an object: the stable ways of lying on a table.
//!
//! An object that comes to rest stands on a face of its convex hull, with its center of mass above that face. Where the
//! center of mass is not above a face, the object rolls over to the next one. A placement's weight is the solid angle of
//! the faces that end in it, seen from the center of mass: its share if the object is dropped in a random orientation and
//! rolls without momentum. People put things down in other shares.
//!
//! ```
//! use palpate_simulator::mesh::{Mesh, obj, placements};
//!
//! # fn main() -> palpate_simulator::Result<()> {
//! let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
//! let tetrahedron: Mesh = obj::parse(text.as_bytes(), "tetrahedron.obj".as_ref())?;
//! let placements = placements::placements(&tetrahedron)?;
//! assert_eq!(placements.center, placements::Center::OfVolume);
//! let names: Vec<&str> = placements.placements.iter().map(|placement| placement.name.as_str()).collect();
//! // On one of three faces that are alike, and on the large one.
//! assert_eq!(names, ["+z", "-x-y-z"]);
//! # Ok(())
//! # }
//! ```

mod alike;
mod center;
mod hull;

use crate::error::{Result, problem};
use crate::mesh::no_extent;
use crate::mesh::{Mesh, Object};
use alike::Shape;
use glam::{DMat3, DVec3, I64Vec3, Vec3};

/// Placements whose upward directions differ by at most this angle, in degrees, are one.
pub(crate) const SAME: f64 = 10.0;

/// Placements of less weight are left out, except the second of an object that would have only one.
pub(crate) const LEAST: f64 = 0.03;

/// The second placement of an object is left out if it has less weight than this, regardless of the others.
pub(crate) const LEAST_OF_TWO: f64 = 0.01;

/// Directions that differ by at most this angle, in degrees, are of one face, up to rounding.
const LEVEL: f64 = 0.1;

/// Weights are whole multiples of one in this many, so that they are the same in every file.
const PARTS: f64 = 1e6;

/// A stable way of lying on the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// The direction in the mesh's own frame that points up, as its nearest axis or diagonal: `+z`, `-x`, `+x-y`; a second
    /// placement of the same name gets `.2`.
    pub name: String,
    /// Its weight among all of the object.
    pub weight: f64,
    /// The rotation from the mesh's frame to that of the table, whose z axis points up.
    pub rotation: DMat3,
}

impl Placement {
    /// The mesh as it lies on the table, z pointing up.
    #[must_use]
    pub fn placed(&self, mesh: &Mesh) -> Mesh {
        let place = |&vertex: &[f32; 3]| (self.rotation * Vec3::from(vertex).as_dvec3()).as_vec3().to_array();
        Mesh { vertices: mesh.vertices.iter().map(place).collect(), triangles: mesh.triangles.clone() }
    }
}

/// The placements of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Placements {
    /// The placements that are kept, by descending weight; their weights sum to 1.
    pub placements: Vec<Placement>,
    /// Placements left out because they are rare, with the weights that they would have among all.
    pub left_out: Vec<Placement>,
    /// Basis of the center of mass.
    pub center: Center,
}

/// Basis of the center of mass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Center {
    /// The volume that the mesh encloses.
    OfVolume,
    /// The convex hull, since the mesh is open, or its triangles face opposite sides.
    OfHullSinceOpen,
    /// The convex hull, since the mesh's volume is greater than the hull's: parts overlap.
    OfHullSinceTooLarge,
    /// The convex hull, since the mesh encloses next to nothing, or parts of it cancel each other.
    OfHullSinceHollow,
}

impl std::fmt::Display for Center {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::OfVolume => "of its volume",
            Self::OfHullSinceOpen => "of its convex hull, since the mesh is open or partly inside out",
            Self::OfHullSinceTooLarge => "of its convex hull, since the mesh's volume is greater than the hull's",
            Self::OfHullSinceHollow => "of its convex hull, since the mesh encloses next to no volume",
        })
    }
}

/// The placements of a mesh: the same on every machine. Cost: about 0.1 s for 100,000 triangles.
///
/// # Errors
/// When the mesh has no triangles, a triangle names a vertex that is missing or not finite, or all vertices are at the
/// same point.
pub fn placements(mesh: &Mesh) -> Result<Placements> {
    found(mesh).map(|(placements, _)| placements)
}

/// Every pose in which a mesh rests on its hull, with its own weight: none is merged with another or left out. The ones of
/// [`placements`] come first and have the same names; the others follow by descending weight, with the next numbers. Cost: as for
/// [`placements`].
///
/// # Errors
/// Errors of [`placements`].
pub fn resting(mesh: &Mesh) -> Result<Vec<Placement>> {
    let (Placements { placements, left_out, .. }, settled) = found(mesh)?;
    let mut rest = merged_by_direction(&settled, LEVEL);
    let mut all: Vec<Placement> = Vec::with_capacity(rest.len());
    for placement in placements.into_iter().chain(left_out) {
        let off = |(up, _): &(DVec3, f64)| 1.0 - up.dot(placement.rotation.row(2));
        let own = (0..rest.len()).min_by(|&a, &b| off(&rest[a]).total_cmp(&off(&rest[b])));
        let weight = own.map_or(0.0, |own| rounded(rest.remove(own).1));
        all.push(Placement { weight, ..placement });
    }
    for (up, weight) in rest {
        let name = numbered(name(up), &all);
        all.push(Placement { name, weight: rounded(weight), rotation: upright(up) });
    }
    Ok(all)
}

/// Number of the first placements that are kept of those with these weights, by descending weight: the others are rare.
pub fn kept(weights: &[f64]) -> usize {
    // A bottle stands less often than that if it is dropped, and yet it is a bottle that stands.
    let at_least = |least: f64| weights.iter().filter(|weight| **weight >= least).count();
    at_least(LEAST).max(at_least(LEAST_OF_TWO).min(2)).max(1).min(weights.len())
}

/// The placements of a mesh, and all directions that point up as it rests, with their weights.
fn found(mesh: &Mesh) -> Result<(Placements, Vec<(DVec3, f64)>)> {
    mesh.check_faces()?;
    mesh.triangles.iter().flatten().try_for_each(|&index| mesh.vertex(index).map(drop))?;
    let mesh = mesh.welded();
    let [low, high] = mesh.bounds();
    let longest = f64::from((high - low).max_element());
    if longest <= 0.0 {
        return Err(no_extent());
    }
    let (middle, scale) = ((low.as_dvec3() + high.as_dvec3()) / 2.0, 2.0 * (hull::REACH - 1) as f64 / longest);
    let mut at: Vec<DVec3> =
        mesh.vertices.iter().map(|&vertex| (Vec3::from(vertex).as_dvec3() - middle) * scale).collect();
    let facets = facets(&mesh, &at);
    let mut corners: Vec<[DVec3; 3]> =
        facets.iter().map(|facet| facet.corners.map(|corner| corner.as_dvec3())).collect();
    let (mass, center) = center::center(&mesh, &at, &corners);
    corners.iter_mut().flatten().for_each(|corner| *corner -= mass);
    at.iter_mut().for_each(|vertex| *vertex -= mass);

    let settled = settled(&facets, &corners);
    let shape = Shape::new(&mesh, &at, longest * scale);
    let mut different: Vec<(DMat3, f64)> = Vec::new();
    for (up, weight) in merged_by_direction(&settled, SAME) {
        let rotation = upright(up);
        match different.iter_mut().find(|(other, _)| shape.is_alike(rotation, *other)) {
            Some((_, sum)) => *sum += weight,
            None => different.push((rotation, weight)),
        }
    }
    // Equal weights stay in their order.
    different.sort_by(|a, b| rounded(b.1).total_cmp(&rounded(a.1)));
    Ok((named(different, center), settled))
}

/// The placements of each instance of an object, with the weights that the [object states](Object::placement_weights).
///
/// # Errors
/// Errors of [`placements`]; a stated name that no instance has; and an instance without a placement of a weight above 0.
pub fn of_object(object: &Object) -> Result<Vec<Placements>> {
    const GIVE: &str = "Give the weights of placements that it has; those that are not named are left out.";
    let mut all: Vec<Placements> =
        object.instances().map(|instance| placements(&instance.mesh)).collect::<Result<_>>()?;
    let stated = &object.placement_weights;
    if stated.is_empty() {
        return Ok(all);
    }
    let mut known: Vec<String> = all.iter().flat_map(Placements::names).collect();
    known.sort();
    known.dedup();
    if let Some((name, _)) = stated.iter().find(|(name, _)| !known.contains(name)) {
        let known = known.join(", ");
        return Err(problem!("{} has no placement {name}: it has {known}", object.name).fix(GIVE));
    }
    for (one, instance) in all.iter_mut().zip(object.instances()) {
        one.weigh(stated);
        if one.placements.is_empty() {
            let of = match &instance.name {
                name if *name == object.name => String::new(),
                name => format!(", instance {name},"),
            };
            let known = one.names().collect::<Vec<_>>().join(", ");
            let error = problem!("no placement of {}{of} has a weight above 0: it has {known}", object.name);
            return Err(error.fix(GIVE));
        }
    }
    Ok(all)
}

impl Placements {
    /// The names of all, including those that are left out.
    pub fn names(&self) -> impl Iterator<Item = String> + '_ {
        self.placements.iter().chain(&self.left_out).map(|placement| placement.name.clone())
    }

    /// Keeps the placements that `weights` names, with these weights.
    fn weigh(&mut self, weights: &[(String, f64)]) {
        let weight = |placement: &Placement| {
            let stated = weights.iter().find(|(name, _)| *name == placement.name);
            stated.map(|(_, weight)| *weight).filter(|weight| *weight > 0.0)
        };
        let all = self.placements.drain(..).chain(self.left_out.drain(..)).collect::<Vec<_>>();
        for placement in all {
            match weight(&placement) {
                Some(weight) => self.placements.push(Placement { weight, ..placement }),
                None => self.left_out.push(placement),
            }
        }
        self.placements.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        share(&mut self.placements);
    }
}

/// The facets of the hull of the vertices that triangles have. A flat mesh gets a little thickness.
fn facets(mesh: &Mesh, at: &[DVec3]) -> Vec<hull::Facet> {
    let mut points: Vec<[i64; 3]> = mesh
        .triangles
        .iter()
        .flatten()
        .map(|&index| at[index as usize].round().to_array().map(|along| along as i64))
        .collect();
    points.sort_unstable();
    points.dedup();
    let points: Vec<I64Vec3> = points.into_iter().map(I64Vec3::from).collect();
    hull::facets(&points).unwrap_or_else(|| {
        let thick = |&point: &I64Vec3| I64Vec3::AXES.into_iter().flat_map(move |axis| [point - axis, point + axis]);
        hull::facets(&points.iter().flat_map(thick).collect::<Vec<_>>()).unwrap_or_default()
    })
}

/// The stable facets: the upward direction on each, and the weight with which the object ends on it. `corners` are about the
/// center of mass.
fn settled(facets: &[hull::Facet], corners: &[[DVec3; 3]]) -> Vec<(DVec3, f64)> {
    let normals: Vec<DVec3> = corners.iter().map(|&[a, b, c]| (b - a).cross(c - a).normalize_or(DVec3::Z)).collect();
    let next = |facet: usize| -> Option<usize> {
        let normal = normals[facet];
        let beyond = |edge: usize| {
            let [from, to] = [corners[facet][edge], corners[facet][(edge + 1) % 3]];
            // How far the center of mass, the origin, is outside of the edge.
            (to - from).normalize_or(DVec3::ZERO).cross(normal).dot(-from)
        };
        let (edge, most) = (0..3).map(|edge| (edge, beyond(edge))).max_by(|a, b| a.1.total_cmp(&b.1))?;
        // On a grid of integers, a hundredth is nothing.
        (most > 0.01).then(|| facets[facet].neighbors[edge])
    };
    let mut ends: Vec<Option<usize>> = vec![None; facets.len()];
    let mut weights = vec![0.0; facets.len()];
    for start in 0..facets.len() {
        let (mut way, mut facet) = (Vec::new(), start);
        let end = loop {
            if let Some(end) = ends[facet] {
                break end;
            }
            if let Some(place) = way.iter().position(|&passed| passed == facet) {
                // Facets of one plane, up to rounding, may send it around: it ends on the lowest.
                let height = |facet: usize| normals[facet].dot(corners[facet][0]);
                let lowest = way[place..].iter().copied().min_by(|&a, &b| height(a).total_cmp(&height(b)));
                break lowest.unwrap_or(facet);
            }
            way.push(facet);
            match next(facet) {
                Some(neighbor) => facet = neighbor,
                None => break facet,
            }
        };
        ends[end] = Some(end);
        way.iter().for_each(|&passed| ends[passed] = Some(end));
        weights[end] += solid_angle(corners[start]);
    }
    let whole: f64 = weights.iter().sum();
    (0..facets.len())
        .filter(|&facet| weights[facet] > 0.0)
        .map(|facet| (-normals[facet], weights[facet] / whole))
        .collect()
}

/// The solid angle of a triangle seen from the origin (Van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let lengths = [a, b, c].map(DVec3::length);
    let below = lengths.iter().product::<f64>() + a.dot(b) * lengths[2] + b.dot(c) * lengths[0] + c.dot(a) * lengths[1];
    2.0 * libm::atan2(a.dot(b.cross(c)), below).abs()
}

/// Directions within some degrees of one of more weight become that one, which gets their weight; by descending weight.
fn merged_by_direction(settled: &[(DVec3, f64)], degrees: f64) -> Vec<(DVec3, f64)> {
    let mut sorted = settled.to_vec();
    // Of equal weights, the one nearest to the mesh's own vertical is first.
    let key = |up: DVec3| [up.z, up.y, up.x].map(|along| (along * 1e4).round() as i64);
    sorted.sort_by(|a, b| rounded(b.1).total_cmp(&rounded(a.1)).then_with(|| key(b.0).cmp(&key(a.0))));
    let near = libm::cos(degrees.to_radians());
    let mut merged: Vec<(DVec3, f64)> = Vec::new();
    for (up, weight) in sorted {
        match merged.iter_mut().find(|(other, _)| other.dot(up) >= near) {
            Some((_, sum)) => *sum += weight,
            None => merged.push((up, weight)),
        }
    }
    merged.sort_by(|a, b| rounded(b.1).total_cmp(&rounded(a.1)));
    merged
}

/// The rotation that makes a direction point up, with the axis that is most level as nearly as possible along x.
fn upright(up: DVec3) -> DMat3 {
    let level = DVec3::AXES.into_iter().min_by(|a, b| {
        let steep = |axis: &DVec3| (axis.dot(up).abs() * 1e6).round();
        steep(a).total_cmp(&steep(b))
    });
    let x = level.unwrap_or(DVec3::X).reject_from_normalized(up).normalize_or(DVec3::X);
    DMat3::from_cols(x, up.cross(x), up).transpose()
}

/// The nearest of an axis, or a diagonal of two or three, in words.
fn name(up: DVec3) -> String {
    let signs = || (0..27).map(|code| [code / 9, code / 3 % 3, code % 3].map(|digit| f64::from(digit - 1)));
    let cosine = |signs: &[f64; 3]| DVec3::from(*signs).normalize_or(DVec3::ZERO).dot(up);
    let nearest = signs().max_by(|a, b| cosine(a).total_cmp(&cosine(b))).unwrap_or_default();
    let word = |(axis, sign): (&str, f64)| match sign {
        0.0 => String::new(),
        sign => format!("{}{axis}", if sign > 0.0 { '+' } else { '-' }),
    };
    ["x", "y", "z"].into_iter().zip(nearest).map(word).collect()
}

/// A name, with a number if placements have it already.
fn numbered(name: String, all: &[Placement]) -> String {
    match all.iter().filter(|other| other.name.split('.').next() == Some(&name)).count() {
        0 => name,
        count => format!("{name}.{}", count + 1),
    }
}

fn rounded(weight: f64) -> f64 {
    (weight * PARTS).round() / PARTS
}

/// Names placements, leaves out rare ones, and makes the weights of the others sum to 1.
fn named(different: Vec<(DMat3, f64)>, center: Center) -> Placements {
    let mut all: Vec<Placement> = Vec::with_capacity(different.len());
    for (rotation, weight) in different {
        let name = numbered(name(rotation.row(2)), &all);
        all.push(Placement { name, weight: rounded(weight), rotation });
    }
    let weights: Vec<f64> = all.iter().map(|placement| placement.weight).collect();
    let left_out = all.split_off(kept(&weights));
    share(&mut all);
    Placements { placements: all, left_out, center }
}

/// Makes weights sum to 1, each a whole number of millionths: the first gets the rest.
fn share(placements: &mut [Placement]) {
    let whole: f64 = placements.iter().map(|placement| placement.weight).sum();
    placements.iter_mut().for_each(|placement| placement.weight = rounded(placement.weight / whole));
    let rest: f64 = placements.iter().skip(1).map(|placement| placement.weight).sum();
    if let Some(first) = placements.first_mut() {
        first.weight = rounded(1.0 - rest);
    }
}
