//! First contact of a moving sphere with one triangle.
//!
//! The region that the sphere's center must not enter is the triangle thickened by the radius: two faces, three
//! cylinders about the edges, three spheres about the corners. The first contact is the earliest entry into any of
//! them. Where two of them meet, both give the same time up to rounding, so a contact that one loses to rounding the
//! other finds. What is not really a triangle (a needle, a segment, a point) is left to its edges and corners.

use super::budget::{CLEAR, EARLY, FLAT, NARROW, PARALLEL, PLANE, Real, STEEP, Vector};

/// A triangle's corners.
pub type Triangle = [Vector; 3];

/// A moving sphere.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Start of its center.
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
    let may_touch = match face(&corners, &edges, direction, radius, limit) {
        Face::Touched(time) => return (time < limit).then_some(start + time),
        Face::Missed => return None,
        Face::Edges(may_touch) => may_touch,
    };
    let mut border = Border { corners, edges, direction, radius, is_corner_done: [false; 3] };
    for (edge, may_touch) in may_touch.into_iter().enumerate() {
        if may_touch {
            border.capsule(edge, &mut first);
        }
    }
    (first < limit).then_some(start + first)
}

enum Face {
    /// The sphere touches the face itself: no other contact comes earlier.
    Touched(Real),
    /// The sphere does not touch the triangle before the limit.
    Missed,
    /// The sphere may touch the border: these edges, or one of their ends.
    Edges([bool; 3]),
}

/// Contact with the two faces of the thickened triangle.
#[inline]
fn face(corners: &Triangle, edges: &[Vector; 3], direction: Vector, radius: Real, limit: Real) -> Face {
    let normal = edges[0].cross(edges[1]);
    let longest = edges[0].length_squared().max(edges[1].length_squared()).max(edges[2].length_squared());
    let double_area = normal.length();
    if double_area <= FLAT * longest {
        return Face::Edges([true; 3]);
    }
    // Distance of the center from the plane, on the side it starts on, and how fast it shrinks; both times |normal|.
    let height = -normal.dot(corners[0]);
    let (height, approach) = (height.abs(), -normal.dot(direction) * height.signum());
    let gap = height - radius * double_area;
    let is_between = gap < 0.0;
    if !is_between && approach <= 0.0 {
        return Face::Missed;
    }
    let time = if is_between { 0.0 } else { gap / approach };
    // The plane itself is off by rounding: a little less.
    if time - PLANE >= limit {
        return Face::Missed;
    }
    let center = direction * time;
    // How far the center is inside each edge, and how fast that grows; both times |normal| and the edge's length.
    let inward = edges.map(|edge| normal.cross(edge));
    let inside: [Real; 3] = std::array::from_fn(|edge| inward[edge].dot(center - corners[edge]));
    if !is_between && inside.iter().all(|&inside| inside >= 0.0) {
        return Face::Touched(time);
    }
    // The sphere touches an edge, or one of its ends, only while its center is outside of that edge: not where it is inside
    // and stays there. What is as narrow as a needle has no inside that rounding leaves alone.
    if double_area <= NARROW * longest {
        return Face::Edges([true; 3]);
    }
    let clear = NARROW * longest * longest;
    Face::Edges(std::array::from_fn(|edge| inside[edge] <= clear || inward[edge].dot(direction) < 0.0))
}

/// The edges and corners of a triangle, as a sphere meets them.
struct Border {
    corners: Triangle,
    /// Each starts at the corner of the same index.
    edges: [Vector; 3],
    direction: Vector,
    radius: Real,
    is_corner_done: [bool; 3],
}

impl Border {
    /// Entry into the capsule about an edge: the cylinder between its ends, and the spheres about them. Lowers `first` to it.
    ///
    /// Where the path enters the infinite cylinder beyond an end, it can enter the capsule only through the sphere about that
    /// end.
    #[inline]
    fn capsule(&mut self, index: usize, first: &mut Real) {
        let Self { direction, radius, .. } = *self;
        let (corner, edge) = (self.corners[index], self.edges[index]);
        let across = direction.cross(edge);
        let sine_squared = across.length_squared();
        let length_squared = edge.length_squared();
        let is_along = sine_squared <= STEEP * length_squared;
        if is_along {
            // Rounding hides where on the edge the path enters.
            self.sphere(index, first);
            self.sphere((index + 1) % 3, first);
        }
        if sine_squared <= PARALLEL * PARALLEL * length_squared {
            return;
        }
        // Distance of the two lines, times |across|; the factored difference of squares stays exact for grazing paths.
        let miss = edge.dot(corner.cross(direction));
        if miss * miss > radius * radius * sine_squared * CLEAR {
            return;
        }
        let reach = radius * sine_squared.sqrt();
        let square = (reach - miss) * (reach + miss);
        if square < 0.0 {
            return;
        }
        let time = (corner.cross(edge).dot(across) - (length_squared * square).sqrt()) / sine_squared;
        let along = (direction * time - corner).dot(edge);
        if along >= 0.0 && along <= length_squared {
            lower(first, time);
        } else if !is_along {
            self.sphere(if along < 0.0 { index } else { (index + 1) % 3 }, first);
        }
    }

    /// Entry into the sphere about a corner. Lowers `first` to it.
    #[inline]
    fn sphere(&mut self, index: usize, first: &mut Real) {
        if std::mem::replace(&mut self.is_corner_done[index], true) {
            return;
        }
        let Self { direction, radius, .. } = *self;
        let corner = self.corners[index];
        let square = corner.cross(direction).length_squared();
        if square > radius * radius * CLEAR {
            return;
        }
        let miss = square.sqrt();
        if miss <= radius {
            lower(first, corner.dot(direction) - ((radius - miss) * (radius + miss)).sqrt());
        }
    }
}

/// Lowers `first` to this time, unless that lies before the start.
#[inline]
fn lower(first: &mut Real, time: Real) {
    if time >= -EARLY {
        *first = first.min(time.max(0.0));
    }
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
