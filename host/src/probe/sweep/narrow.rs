//! First contact of a moving sphere with one triangle.
//!
//! The region that the sphere's center must not enter is the triangle thickened by the radius: two faces, three
//! cylinders about the edges, three spheres about the corners. The first contact is the earliest entry into any of
//! them. Where two of them meet, both give the same time up to rounding, so a contact that one loses to rounding the
//! other finds. What is not really a triangle (a needle, a segment, a point) is left to its edges and corners.

use super::budget::{EARLY, FLAT, PARALLEL, PLANE, Real, Vector};

/// A triangle's corners.
pub type Triangle = [Vector; 3];

/// A moving sphere.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Where its center starts.
    pub origin: Vector,
    /// Unit vector of its motion, or zero for a sphere that does not move.
    pub direction: Vector,
    /// Its radius.
    pub radius: Real,
}

/// The distance that the sphere travels until it touches the triangle, if that is less than `limit`.
pub fn first_contact(motion: &Motion, triangle: &Triangle, limit: Real) -> Option<Real> {
    let Motion { direction, radius, .. } = *motion;
    // From here on the triangle stands still at small numbers: corners relative to the sphere, moved up to just before
    // the nearest corner's depth.
    let mut corners = triangle.map(|corner| corner - motion.origin);
    let depths = corners.map(|corner| corner.dot(direction));
    let nearest = depths[0].min(depths[1]).min(depths[2]) - radius;
    if nearest >= limit {
        return None;
    }
    let start = nearest.max(0.0);
    if start > 0.0 {
        corners = corners.map(|corner| corner - direction * start);
    } else if distance_squared(&corners) <= radius * radius {
        return Some(0.0);
    } else if depths.iter().all(|&depth| depth < -radius) {
        return None;
    }
    let limit = limit - start;
    let mut first = limit;
    let [a, b, c] = corners;
    let edges = [b - a, c - b, a - c];
    match face(&corners, &edges, direction, radius) {
        Face::Touched(time) => return (time < limit).then_some(start + time),
        Face::NotBefore(time) if time >= limit => return None,
        _ => {}
    }
    for (corner, edge) in corners.into_iter().zip(edges) {
        if let Some(time) = self::corner(corner, direction, radius)
            && time < first
        {
            first = time;
        }
        if let Some(time) = self::edge(corner, edge, direction, radius)
            && time < first
        {
            first = time;
        }
    }
    (first < limit).then_some(start + first)
}

enum Face {
    /// The sphere touches the face itself: no other contact comes earlier.
    Touched(Real),
    /// The sphere cannot touch the triangle before this.
    NotBefore(Real),
}

/// Contact with the two faces of the thickened triangle.
fn face(corners: &Triangle, edges: &[Vector; 3], direction: Vector, radius: Real) -> Face {
    let normal = edges[0].cross(edges[1]);
    let longest = edges.iter().map(|edge| edge.length_squared()).fold(0.0, Real::max);
    let double_area = normal.length();
    if double_area <= FLAT * longest {
        return Face::NotBefore(0.0);
    }
    // Distance of the center from the plane, on the side it starts on, and how fast it shrinks; both times |normal|.
    let height = -normal.dot(corners[0]);
    let (height, approach) = (height.abs(), -normal.dot(direction) * height.signum());
    let gap = height - radius * double_area;
    if gap < 0.0 {
        return Face::NotBefore(0.0);
    }
    if approach <= 0.0 {
        return Face::NotBefore(Real::INFINITY);
    }
    let time = gap / approach;
    let center = direction * time;
    let inside = |corner: Vector, edge: Vector| edge.cross(center - corner).dot(normal) >= 0.0;
    if corners.iter().zip(edges).all(|(&corner, &edge)| inside(corner, edge)) {
        Face::Touched(time)
    } else {
        // The plane itself is off by rounding: a little less.
        Face::NotBefore(time - PLANE)
    }
}

/// Entry into the sphere about a corner.
fn corner(corner: Vector, direction: Vector, radius: Real) -> Option<Real> {
    let miss = corner.cross(direction).length();
    if miss > radius {
        return None;
    }
    entered(corner.dot(direction) - ((radius - miss) * (radius + miss)).sqrt())
}

/// Entry into the cylinder about the edge that starts at `corner`, between its ends.
fn edge(corner: Vector, edge: Vector, direction: Vector, radius: Real) -> Option<Real> {
    let across = direction.cross(edge);
    let sine_squared = across.length_squared();
    let length_squared = edge.length_squared();
    if sine_squared <= PARALLEL * PARALLEL * length_squared {
        return None;
    }
    // Distance of the two lines, times |across|; the factored difference of squares stays exact for grazing paths.
    let reach = radius * sine_squared.sqrt();
    let miss = edge.dot(corner.cross(direction));
    let square = (reach - miss) * (reach + miss);
    if square < 0.0 {
        return None;
    }
    let time = (corner.cross(edge).dot(across) - (length_squared * square).sqrt()) / sine_squared;
    let along = (direction * time - corner).dot(edge);
    if along < 0.0 || along > length_squared { None } else { entered(time) }
}

fn entered(time: Real) -> Option<Real> {
    (time >= -EARLY).then_some(time.max(0.0))
}

/// The squared distance of a triangle from the coordinates' origin.
fn distance_squared(&[a, b, c]: &Triangle) -> Real {
    let edges = [b - a, c - b, a - c];
    let normal = edges[0].cross(edges[1]);
    let longest = edges.iter().map(|edge| edge.length_squared()).fold(0.0, Real::max);
    let is_above = |corner: Vector, edge: Vector| edge.cross(-corner).dot(normal) >= 0.0;
    let double_area_squared = normal.length_squared();
    if double_area_squared > FLAT * FLAT * longest * longest
        && [a, b, c].into_iter().zip(edges).all(|(corner, edge)| is_above(corner, edge))
    {
        let height = normal.dot(a);
        return height * height / double_area_squared;
    }
    let to_segment = |(corner, edge): (Vector, Vector)| {
        let length_squared = edge.length_squared();
        let along = if length_squared > 0.0 { (-corner.dot(edge) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
        (corner + edge * along).length_squared()
    };
    [a, b, c].into_iter().zip(edges).map(to_segment).fold(Real::INFINITY, Real::min)
}
