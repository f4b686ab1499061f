//! The nearest point of a triangle: where a sphere in contact touches it.

use super::narrow::Triangle;
use glam::DVec3 as Vector;

/// The point of a triangle that is nearest to `point`. If the triangle has no area, a point of one of its edges. Method:
/// Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
pub(super) fn nearest_point([a, b, c]: &Triangle, point: Vector) -> Vector {
    let edges = [(*a, b - a), (*b, c - b), (*c, a - c)];
    let normal = edges[0].1.cross(edges[1].1);
    let is_above = |(corner, edge): &(Vector, Vector)| edge.cross(point - corner).dot(normal) >= 0.0;
    let square = normal.length_squared();
    if square > 0.0 && edges.iter().all(is_above) {
        return point - normal * ((point - a).dot(normal) / square);
    }
    let on_edge = |(corner, edge): (Vector, Vector)| {
        let length_squared = edge.length_squared();
        let along =
            if length_squared > 0.0 { ((point - corner).dot(edge) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
        corner + edge * along
    };
    let [one, two, three] = edges.map(on_edge);
    let nearer = |one: Vector, other: Vector| {
        if one.distance_squared(point) <= other.distance_squared(point) { one } else { other }
    };
    nearer(nearer(one, two), three)
}
