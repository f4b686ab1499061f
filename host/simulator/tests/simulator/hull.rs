#[path = "../../src/mesh/placements/hull.rs"]
mod source;

use glam::I64Vec3;
use rand::{RngExt, SeedableRng};
use source::{Facet, REACH, facets};

/// Six times the volume, after checking that no point is outside of any facet and that neighbors share their edges.
fn volume(points: &[I64Vec3], facets: &[Facet]) -> i64 {
    for (index, facet) in facets.iter().enumerate() {
        let [a, b, c] = facet.corners;
        let normal = (b - a).cross(c - a);
        assert!(normal != I64Vec3::ZERO, "a facet without area");
        assert!(points.iter().all(|&point| normal.dot(point - a) <= 0), "a point outside of {facet:?}");
        for edge in 0..3 {
            let other = &facets[facet.neighbors[edge]];
            let back = (0..3).find(|&back| other.neighbors[back] == index).unwrap();
            assert_eq!(other.corners[back], facet.corners[(edge + 1) % 3]);
            assert_eq!(other.corners[(back + 1) % 3], facet.corners[edge]);
        }
    }
    facets.iter().map(|Facet { corners: [a, b, c], .. }| a.dot(b.cross(*c))).sum()
}

#[test]
fn a_grid_of_points_has_the_hull_of_its_corners() {
    let steps = || (-2..=2).map(|step| step * 7);
    let points: Vec<I64Vec3> =
        steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| I64Vec3::new(x, y, z)))).collect();
    let facets = facets(&points).unwrap();
    assert_eq!(volume(&points, &facets), 6 * 28_i64.pow(3));
}

#[test]
fn hulls_of_random_points_leave_none_outside_also_at_the_limits_of_the_grid() {
    let mut random = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1);
    for reach in [2, 9, 300, REACH] {
        for count in [5, 40, 400] {
            let mut draw = || random.random_range(-reach..=reach);
            let points: Vec<I64Vec3> = (0..count).map(|_| I64Vec3::new(draw(), draw(), draw())).collect();
            if let Some(facets) = facets(&points) {
                assert!(volume(&points, &facets) > 0);
                let corners: std::collections::BTreeSet<_> =
                    facets.iter().flat_map(|facet| facet.corners.map(|corner| corner.to_array())).collect();
                assert_eq!(facets.len(), 2 * corners.len() - 4, "Euler's formula");
            }
        }
    }
}

#[test]
fn points_in_a_plane_have_no_hull() {
    let points: Vec<I64Vec3> = (0..30).map(|i| I64Vec3::new(i, i * i, 3 * i + 2 * i * i)).collect();
    assert!(facets(&points).is_none());
    assert!(facets(&points[..1]).is_none());
    assert!(facets(&[]).is_none());
}
