//! The convex hull of points on a grid of integers. All decisions are exact, so that no hull has a gap, regardless of
//! the points.

use glam::I64Vec3;
use std::collections::BTreeMap;

/// Largest absolute value of a coordinate: determinants of differences then fit in 64 bits.
pub(super) const REACH: i64 = 1 << 18;

/// A triangle of a hull.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Its corners, anticlockwise when seen from outside.
    pub(super) corners: [I64Vec3; 3],
    /// The facet across each edge; edge k goes from corner k to the next one.
    pub(super) neighbors: [usize; 3],
}

/// A facet while the hull grows.
struct Growing {
    corners: [usize; 3],
    neighbors: [usize; 3],
    /// Points that see it, and no earlier facet that was tried.
    outside: Vec<usize>,
    is_alive: bool,
}

/// The facets of the hull of at least four points; none if all of them are in one plane.
pub(super) fn facets(points: &[I64Vec3]) -> Option<Vec<Facet>> {
    let mut hull = Hull { points, facets: Vec::new() };
    hull.begin()?;
    let mut next = 0;
    while next < hull.facets.len() {
        match hull.farthest(next) {
            Some(point) => hull.add(next, point),
            None => next += 1,
        }
    }
    let mut places = vec![0; hull.facets.len()];
    let mut count = 0;
    for (place, facet) in places.iter_mut().zip(&hull.facets) {
        *place = count;
        count += usize::from(facet.is_alive);
    }
    let alive = hull.facets.iter().filter(|facet| facet.is_alive);
    let facet = |facet: &Growing| Facet {
        corners: facet.corners.map(|corner| points[corner]),
        neighbors: facet.neighbors.map(|neighbor| places[neighbor]),
    };
    Some(alive.map(facet).collect())
}

struct Hull<'a> {
    points: &'a [I64Vec3],
    facets: Vec<Growing>,
}

impl Hull<'_> {
    /// Six times the volume of the tetrahedron of a facet and a point: positive if the point is outside of the facet.
    fn height(&self, corners: [usize; 3], point: usize) -> i64 {
        let [a, b, c] = corners.map(|corner| self.points[corner]);
        (b - a).cross(c - a).dot(self.points[point] - a)
    }

    /// A tetrahedron that is not flat.
    fn begin(&mut self) -> Option<()> {
        let all = 0..self.points.len();
        let at = |point: usize| self.points[point];
        let a = all.clone().min_by_key(|&point| at(point).to_array())?;
        let b = all.clone().max_by_key(|&point| (at(point) - at(a)).length_squared())?;
        let off = |point: usize| (at(b) - at(a)).cross(at(point) - at(a)).as_dvec3().length_squared();
        let c = all.clone().max_by(|&one, &other| off(one).total_cmp(&off(other)))?;
        let d = all.clone().max_by_key(|&point| self.height([a, b, c], point).abs())?;
        let corners = match self.height([a, b, c], d).signum() {
            0 => return None,
            1 => [a, c, b, d],
            _ => [a, b, c, d],
        };
        let [a, b, c, d] = corners;
        // The first triangle faces away from d; the others meet at d.
        for (corners, neighbors) in
            [([a, b, c], [1, 2, 3]), ([b, a, d], [0, 3, 2]), ([c, b, d], [0, 1, 3]), ([a, c, d], [0, 2, 1])]
        {
            self.facets.push(Growing { corners, neighbors, outside: Vec::new(), is_alive: true });
        }
        self.share_out(all, 0..4);
        Some(())
    }

    /// Gives each point to the first of these facets that it sees.
    fn share_out(&mut self, points: impl IntoIterator<Item = usize>, facets: std::ops::Range<usize>) {
        for point in points {
            if let Some(facet) = facets.clone().find(|&facet| self.height(self.facets[facet].corners, point) > 0) {
                self.facets[facet].outside.push(point);
            }
        }
    }

    /// The point that is farthest outside of a facet.
    fn farthest(&self, facet: usize) -> Option<usize> {
        let facet = self.facets.get(facet).filter(|facet| facet.is_alive)?;
        facet.outside.iter().copied().max_by_key(|&point| (self.height(facet.corners, point), point))
    }

    /// Replaces the facets that a point sees, including `first`, by those from their outline to the point.
    fn add(&mut self, first: usize, point: usize) {
        let (mut visible, mut outline) = (vec![first], Vec::new());
        self.facets[first].is_alive = false;
        let mut next = 0;
        while let Some(&facet) = visible.get(next) {
            next += 1;
            for edge in 0..3 {
                let Growing { corners, neighbors, .. } = &self.facets[facet];
                let (from, to, neighbor) = (corners[edge], corners[(edge + 1) % 3], neighbors[edge]);
                if !self.facets[neighbor].is_alive {
                    continue;
                }
                if self.height(self.facets[neighbor].corners, point) > 0 {
                    self.facets[neighbor].is_alive = false;
                    visible.push(neighbor);
                } else {
                    outline.push((from, to, neighbor));
                }
            }
        }
        let begin = self.facets.len();
        let starts: BTreeMap<usize, usize> =
            outline.iter().enumerate().map(|(index, &(from, ..))| (from, begin + index)).collect();
        let ends: BTreeMap<usize, usize> =
            outline.iter().enumerate().map(|(index, &(_, to, _))| (to, begin + index)).collect();
        for (index, &(from, to, beyond)) in outline.iter().enumerate() {
            // A strictly convex outline is one circle: each of its corners begins an edge and ends one.
            let [after, before] = [starts.get(&to), ends.get(&from)].map(|facet| facet.copied().unwrap_or(begin));
            let other = &mut self.facets[beyond];
            for edge in 0..3 {
                if other.corners[edge] == to && other.corners[(edge + 1) % 3] == from {
                    other.neighbors[edge] = begin + index;
                }
            }
            self.facets.push(Growing {
                corners: [from, to, point],
                neighbors: [beyond, after, before],
                outside: Vec::new(),
                is_alive: true,
            });
        }
        let orphans: Vec<usize> =
            visible.iter().flat_map(|&facet| std::mem::take(&mut self.facets[facet].outside)).collect();
        self.share_out(orphans, begin..self.facets.len());
    }
}
