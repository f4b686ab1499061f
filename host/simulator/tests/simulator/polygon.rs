use palpate_simulator::mesh::obj;
use rand::{RngExt, SeedableRng};

fn cut(corners: &[[f64; 3]]) -> Vec<[u32; 3]> {
    let vertices: String = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let face: String = (1..=corners.len()).map(|number| format!(" {number}")).collect();
    obj::parse(format!("{vertices}f{face}\n").as_bytes(), "polygon.obj".as_ref()).unwrap().triangles
}

fn area(corners: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let corner = |index: u32| glam::DVec3::from(corners[index as usize]);
    let double = |&[a, b, c]: &[u32; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length();
    triangles.iter().map(double).sum::<f64>() / 2.0
}

/// Checks that the triangles are as many as they must be and that inside the polygon each edge is shared: with its outline
/// they are closed.
fn check(corners: &[[f64; 3]]) -> Vec<[u32; 3]> {
    let triangles = cut(corners);
    assert_eq!(triangles.len(), corners.len() - 2, "{corners:?}");
    let mut edges = std::collections::BTreeMap::new();
    for &[a, b, c] in &triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((from.min(to), from.max(to))).or_insert(0) += if from < to { 1 } else { -1 };
        }
    }
    let count = corners.len() as u32;
    for corner in 0..count {
        let next = (corner + 1) % count;
        *edges.entry((corner.min(next), corner.max(next))).or_insert(0) -= if corner < next { 1 } else { -1 };
    }
    assert!(edges.values().all(|&sum| sum == 0), "{corners:?}: {triangles:?}");
    triangles
}

#[test]
fn a_polygon_has_two_triangles_fewer_than_corners_however_it_is_warped() {
    let mut random = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(2);
    for count in 4..14 {
        for warp in [0.0, 1e-3, 0.1, 1.0, 5.0] {
            for _ in 0..60 {
                let corner = |index: usize| {
                    let (sin, cos) = libm::sincos(std::f64::consts::TAU * index as f64 / count as f64);
                    let radius = random.random_range(0.1..1.0);
                    [radius * cos, radius * sin, warp * random.random_range(-1.0..1.0)]
                };
                check(&(0..count).map(corner).collect::<Vec<_>>());
            }
        }
    }
}

#[test]
fn a_concave_polygon_keeps_its_winding_its_area_and_corners_in_line_with_their_neighbors() {
    // An L with further corners on its sides, one of them twice, in a plane and in a tilted one.
    let outline = [
        [2.0, 1.0],
        [1.5, 1.0],
        [1.0, 1.0],
        [1.0, 1.5],
        [1.0, 2.0],
        [0.0, 2.0],
        [0.0, 2.0],
        [0.0, 1.0],
        [0.0, 0.0],
        [1.0, 0.0],
        [2.0, 0.0],
    ];
    for slope in [0.0, 0.7] {
        let corners: Vec<[f64; 3]> = outline.iter().map(|&[x, y]| [x, y, slope * x]).collect();
        let triangles = check(&corners);
        let expected = 3.0 * f64::sqrt(1.0 + slope * slope);
        assert!((area(&corners, &triangles) - expected).abs() < 1e-9, "{slope}: {triangles:?}");
    }
}

#[test]
fn a_polygon_that_crosses_itself_when_it_is_flattened_is_a_fan() {
    let corners = [[0.0, 0.0, 0.0], [-0.06, -0.02, 0.06], [0.06, 0.06, -0.8], [0.0, -0.1, -0.85]];
    assert_eq!(check(&corners), [[0, 1, 2], [0, 2, 3]]);
}
