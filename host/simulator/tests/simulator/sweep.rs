//! Casts in four classes (listed cases, edges, random, spaced), compared with analytic answers and with brute force.

use glam::DVec3;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::probe::sweep::narrow::{self, Motion, Triangle};
use palpate_simulator::probe::sweep::{Contact, Surface};
use palpate_simulator::probe::{Approach, Probe, Scene};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

const fn at(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A triangle in the plane z = 0, around the origin.
const FLOOR: Triangle = [at(-5.0, -5.0, 0.0), at(5.0, -5.0, 0.0), at(0.0, 7.0, 0.0)];

fn contact(triangles: &[Triangle], origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    Surface::new(triangles.to_vec()).first_contact(origin, direction, radius)
}

fn assert_contact(triangles: &[Triangle], origin: DVec3, direction: DVec3, radius: f64, expected: Option<f64>) {
    let found = contact(triangles, origin, direction, radius);
    let close = match (found, expected) {
        (Some(found), Some(expected)) => (found - expected).abs() <= 1e-12 * (1.0 + expected),
        (found, expected) => found == expected,
    };
    assert!(close, "from {origin} along {direction}: {found:?}, expected {expected:?}");
}

// ---- listed cases, compared with analytic answers

#[test]
fn a_triangle_is_touched_like_a_plane_at_its_face_a_cylinder_at_an_edge_and_a_sphere_at_a_corner() {
    let depth = 0.5 * f64::sqrt(3.0) / 2.0;
    for (origin, direction, expected) in [
        (at(0.0, 0.0, 3.0), at(0.0, 0.0, -1.0), Some(2.5)),
        (at(0.0, 0.0, -3.0), at(0.0, 0.0, 1.0), Some(2.5)),
        (at(0.0, 0.0, 3.0), at(0.0, 0.0, 1.0), None),
        (at(1.0, 0.0, 3.0), at(3.0, 0.0, -4.0), Some(2.5 / 4.0)),
        (at(0.0, 0.0, 3.0), at(0.0, 0.0, -0.125), Some(20.0)),
        (at(0.0, 0.0, 0.5), at(0.0, 0.0, 1.0), Some(0.0)),
        (at(0.0, 0.0, 0.1), at(1.0, 0.0, 0.0), Some(0.0)),
        // Along -z past the edge y = -5, by half a radius; and in the triangle's own plane, against the edge.
        (at(1.0, -5.25, 3.0), at(0.0, 0.0, -1.0), Some(3.0 - depth)),
        (at(1.0, -9.0, 0.0), at(0.0, 1.0, 0.0), Some(3.5)),
        (at(1.0, -5.500001, 3.0), at(0.0, 0.0, -1.0), None),
        // The corner (0, 7, 0), passed beyond it at half a radius; head on; and missed by a hair.
        (at(0.0, 7.25, 3.0), at(0.0, 0.0, -1.0), Some(3.0 - depth)),
        (at(0.0, 12.0, 0.0), at(0.0, -1.0, 0.0), Some(4.5)),
        (at(0.0, 7.5 + 1e-9, 3.0), at(0.0, 0.0, -1.0), None),
        // A path through a corner or along an edge.
        (at(-5.0, -5.0, 4.0), at(0.0, 0.0, -1.0), Some(3.5)),
        (at(-8.0, -5.0, 0.0), at(1.0, 0.0, 0.0), Some(2.5)),
        (at(-8.0, -5.25, 0.0), at(1.0, 0.0, 0.0), Some(3.0 - depth)),
    ] {
        assert_contact(&[FLOOR], origin, direction, 0.5, expected);
    }
    let grazing = contact(&[FLOOR], at(0.0, 7.5 - 1e-9, 3.0), at(0.0, 0.0, -1.0), 0.5).unwrap();
    assert!((grazing - (3.0 - f64::sqrt(1e-9))).abs() < 1e-9, "{grazing}");
}

#[test]
fn zeros_of_either_sign_in_the_direction_make_no_difference() {
    for zero in [0.0, -0.0] {
        assert_contact(&[FLOOR], at(0.0, 0.0, 3.0), at(zero, zero, -1.0), 0.5, Some(2.5));
        assert_contact(&[FLOOR], at(0.0, -0.0, 3.0), at(zero, -zero, -1.0), 0.5, Some(2.5));
        assert_contact(&[FLOOR], at(1.0, -9.0, 0.0), at(zero, 1.0, zero), 0.5, Some(3.5));
        assert_contact(&[FLOOR], at(1.0, -9.0, 0.6), at(zero, 1.0, zero), 0.5, None);
    }
}

#[test]
fn a_sphere_without_direction_touches_only_where_it_is() {
    for direction in [DVec3::ZERO, at(-0.0, 0.0, -0.0), DVec3::splat(f64::NAN), DVec3::splat(f64::INFINITY)] {
        assert_eq!(contact(&[FLOOR], at(0.0, 0.0, 0.4), direction, 0.5), Some(0.0));
        assert_eq!(contact(&[FLOOR], at(0.0, 0.0, 0.6), direction, 0.5), None);
    }
    assert_eq!(contact(&[FLOOR], DVec3::NAN, DVec3::X, 0.5), None);
}

#[test]
fn points_and_segments_behave_as_what_they_are() {
    let (a, b) = (at(1.0, 2.0, 3.0), at(1.0, 6.0, 3.0));
    for point in [vec![[a, a, a]], vec![[a, a, a]; 9]] {
        assert_contact(&point, at(1.0, 2.0, 9.0), at(0.0, 0.0, -1.0), 0.5, Some(5.5));
        assert_contact(&point, at(1.0, 2.6, 9.0), at(0.0, 0.0, -1.0), 0.5, None);
        assert_contact(&point, at(1.0, 2.3, 3.4), at(0.0, 0.0, -1.0), 0.5, Some(0.0));
    }
    for segment in [[a, b, b], [b, a, b], [a, a, b], [a, a.lerp(b, 0.5), b], [b, a, a.lerp(b, 0.25)]] {
        assert_contact(&[segment], at(1.3, 5.0, 9.0), at(0.0, 0.0, -1.0), 0.5, Some(6.0 - 0.4));
        assert_contact(&[segment], at(1.0, 6.3, 9.0), at(0.0, 0.0, -1.0), 0.5, Some(6.0 - 0.4));
        assert_contact(&[segment], at(1.0, 9.0, 3.0), at(0.0, -1.0, 0.0), 0.5, Some(2.5));
        assert_contact(&[segment], at(1.51, 5.0, 9.0), at(0.0, 0.0, -1.0), 0.5, None);
    }
}

#[test]
fn a_needle_is_touched_like_its_edges() {
    for width in [1e-3, 1e-6, 1e-9, 1e-12, 1e-300] {
        let needle = [at(0.0, -5.0, 0.0), at(0.0, 5.0, 0.0), at(width, 0.0, 0.0)];
        let expected = 3.0 - 0.4;
        let found = contact(&[needle], at(-0.3, 0.1, 3.0), at(0.0, 0.0, -1.0), 0.5).unwrap();
        assert!((found - expected).abs() < 1e-12, "{width}: {found}");
        let found = contact(&[needle], at(0.0, 0.1, 3.0), at(0.0, 0.0, -1.0), 0.5).unwrap();
        assert!((found - 2.5).abs() < 1e-12, "{width}: {found}");
    }
}

#[test]
fn winding_and_duplicates_make_no_difference() {
    let [a, b, c] = FLOOR;
    for mesh in [vec![[a, c, b]], vec![FLOOR, [a, c, b]], vec![FLOOR; 100], vec![[b, c, a], [c, b, a], FLOOR]] {
        assert_contact(&mesh, at(0.2, 0.3, 3.0), at(0.0, 0.0, -1.0), 0.5, Some(2.5));
        assert_contact(&mesh, at(0.2, 0.3, -3.0), at(0.0, 0.0, 1.0), 0.5, Some(2.5));
        assert_contact(&mesh, at(1.0, -9.0, 0.0), at(0.0, 1.0, 0.0), 0.5, Some(3.5));
    }
}

#[test]
fn three_hundred_thousand_copies_of_a_triangle_count_as_one() {
    let turned = |index: usize| std::array::from_fn(|corner| FLOOR[(corner * (1 + index % 2) + index) % 3]);
    let mut copies: Vec<Triangle> = (0..300_000).map(turned).collect();
    copies.push(FLOOR.map(|corner| corner + DVec3::Z));
    let surface = Surface::new(copies);
    assert_eq!(surface.triangles().len(), 2);
    assert_eq!(surface.first_contact(at(0.0, 0.0, 3.0), at(0.0, 0.0, -1.0), 0.5), Some(1.5));
    assert_eq!(surface.first_contact(at(0.0, 0.0, -3.0), at(0.0, 0.0, 1.0), 0.5), Some(2.5));
}

#[test]
fn far_starts_keep_their_digits() {
    for distance in [1e3, 1e5, 1e9] {
        let found = contact(&[FLOOR], at(0.25, 0.5, distance), at(0.0, 0.0, -1.0), 0.5).unwrap();
        assert!((found - (distance - 0.5)).abs() <= 1e-15 * distance, "{found}");
        assert_eq!(contact(&[FLOOR], at(7.0, 0.0, distance), at(0.0, 0.0, -1.0), 0.5), None);
    }
}

#[test]
fn size_and_place_of_the_mesh_scale_the_times() {
    let (globe, mut rng) = (globe(8), Xoshiro256PlusPlus::seed_from_u64(5));
    for scale in [1e-30, 1e-6, 1.0, 1e6, 1e30] {
        for offset in [0.0, 1e3] {
            let moved = |point: DVec3| (point + DVec3::splat(offset)) * scale;
            let surface = Surface::new(globe.iter().map(|triangle| triangle.map(moved)).collect());
            for _ in 0..300 {
                let (origin, direction) = random_cast(&mut rng);
                let plain = brute(&globe, origin, direction, 0.15);
                let found = surface.first_contact(moved(origin), direction * scale, 0.15 * scale);
                assert_eq!(found.is_some(), plain.is_some(), "{scale} {offset}");
                if let Some((found, plain)) = found.zip(plain) {
                    assert!((found - plain).abs() < 1e-10 * (1.0 + offset), "{scale} {offset}: {found} {plain}");
                }
            }
        }
    }
}

// ---- compared with brute force

fn globe(rings: u32) -> Vec<Triangle> {
    Scene::new(&Mesh::globe(rings), 10.0).unwrap().triangles().collect()
}

/// The earliest contact over all triangles, without boxes, f32 or a tree.
fn brute(triangles: &[Triangle], origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    let length = direction.length();
    let motion = Motion { origin, direction: direction / length, radius };
    let contact = |triangle| narrow::first_contact(&motion, triangle, f64::INFINITY);
    triangles.iter().filter_map(contact).min_by(f64::total_cmp).map(|distance| distance / length)
}

/// Checks a cast against brute force, up to an error of its time. True for a contact.
fn agrees(surface: &Surface, triangles: &[Triangle], cast: (DVec3, DVec3), radius: f64, error: f64) -> bool {
    let (origin, direction) = cast;
    let found = surface.first_contact(origin, direction, radius);
    let expected = brute(triangles, origin, direction, radius);
    assert_eq!(found.is_some(), expected.is_some(), "{origin} {direction} {radius}");
    if let Some((found, expected)) = found.zip(expected) {
        assert!((found - expected).abs() < error, "{origin} {direction} {radius}: {found} {expected}");
    }
    found.is_some()
}

/// Advances the sphere by its distance from the surface until it touches: slow, and shares nothing with the sweep but
/// the idea of a triangle. None after `limit`.
fn advance(triangles: &[Triangle], origin: DVec3, direction: DVec3, radius: f64, limit: f64) -> Option<f64> {
    let mut time = 0.0;
    while time < limit {
        let center = origin + direction * time;
        let gap = triangles.iter().map(|triangle| distance(center, triangle)).fold(f64::INFINITY, f64::min) - radius;
        if gap < 1e-12 {
            return Some(time);
        }
        time += gap;
    }
    None
}

/// Ericson, Real-Time Collision Detection, 5.1.5: by the Voronoi region that the point is in.
fn distance(point: DVec3, &[a, b, c]: &Triangle) -> f64 {
    let (ab, ac, ap, bp, cp) = (b - a, c - a, point - a, point - b, point - c);
    let (d1, d2, d3, d4, d5, d6) = (ab.dot(ap), ac.dot(ap), ab.dot(bp), ac.dot(bp), ab.dot(cp), ac.dot(cp));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let nearest = if d1 <= 0.0 && d2 <= 0.0 {
        a
    } else if d3 >= 0.0 && d4 <= d3 {
        b
    } else if d6 >= 0.0 && d5 <= d6 {
        c
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        a + ab * (d1 / (d1 - d3))
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        a + ac * (d2 / (d2 - d6))
    } else if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))
    } else {
        let sum = va + vb + vc;
        a + ab * (vb / sum) + ac * (vc / sum)
    };
    point.distance(nearest)
}

fn random_point(rng: &mut Xoshiro256PlusPlus, reach: f64) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| rng.random_range(-reach..reach)))
}

/// From around the globe to somewhere in its box.
fn random_cast(rng: &mut Xoshiro256PlusPlus) -> (DVec3, DVec3) {
    let origin = loop {
        let point = random_point(rng, 15.0);
        if point.length() > 9.0 {
            break point;
        }
    };
    (origin, (random_point(rng, 5.5) - origin).normalize())
}

#[test]
fn edges_corners_and_faces_of_a_mesh_are_met_head_on_and_grazing() {
    let globe = globe(8);
    let surface = Surface::new(globe.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    for &[a, b, c] in &globe {
        for target in [a, (a + b) / 2.0, a.lerp(b, 0.1), (a + b + c) / 3.0] {
            let (origin, _) = random_cast(&mut rng);
            let toward = (target - origin).normalize();
            let side = toward.any_orthonormal_vector() * 0.15;
            for clearance in [-1.0, -1e-6, -1e-9, 1e-9, 1e-6, 1.0] {
                let origin = origin + side * (1.0 + clearance);
                agrees(&surface, &globe, (origin, toward), 0.15, 1e-9);
            }
        }
    }
}

#[test]
fn random_casts_agree_with_brute_force_and_with_advancing_step_by_step() {
    let globe = globe(8);
    let surface = Surface::new(globe.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut contacts = 0;
    for round in 0..3_000 {
        let (origin, direction) = random_cast(&mut rng);
        let radius = [0.15, 1e-3, 2.0][round % 3];
        contacts += u32::from(agrees(&surface, &globe, (origin, direction), radius, 1e-12));
        if round % 10 == 0 {
            let advanced = advance(&globe, origin, direction, radius, 40.0);
            match (surface.first_contact(origin, direction, radius), advanced) {
                // Advancing stops 1e-12 short of the surface, which a grazing path feels as 1e-6 at most.
                (Some(found), Some(advanced)) => assert!((found - advanced).abs() < 2e-6, "{found} {advanced}"),
                (found, advanced) => assert_eq!(found, advanced),
            }
        }
    }
    assert!((1_000..2_900).contains(&contacts), "{contacts}");
}

#[test]
fn meshes_that_are_fine_compared_with_the_sphere_agree_with_brute_force() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    // Smooth, bumpy, folded so sharply that mean normals say nothing, and flat.
    let smooth = globe(30);
    let bumpy = smooth.iter().map(|triangle| triangle.map(|corner| corner * (1.0 + 0.03 * libm::sin(1e3 * corner.x))));
    let folded = smooth.iter().map(|triangle| triangle.map(|corner| corner + DVec3::Z * libm::sin(40.0 * corner.x)));
    let flat = smooth.iter().map(|triangle| triangle.map(|corner| corner.with_z(0.25 * corner.x)));
    let meshes: [Vec<Triangle>; 4] = [smooth.clone(), bumpy.collect(), folded.collect(), flat.collect()];
    for mesh in &meshes {
        let surface = Surface::new(mesh.clone());
        let mut contacts = 0;
        for round in 0..600 {
            let radius = [0.3, 1.0, 3.0][round % 3];
            let (mut origin, direction) = random_cast(&mut rng);
            if round % 4 == 0 {
                // Past a corner, hardly.
                let corner = mesh[rng.random_range(0..mesh.len())][0];
                let aside = corner.cross(direction).normalize_or(DVec3::Z).cross(direction);
                let clearance = 10.0_f64.powf(rng.random_range(-9.0..-1.0)) * if rng.random() { 1.0 } else { -1.0 };
                origin = corner + aside * (radius + clearance) - direction * 12.0;
            }
            contacts += u32::from(agrees(&surface, mesh, (origin, direction), radius, 1e-11));
        }
        assert!((200..590).contains(&contacts), "{contacts}");
    }
}

#[test]
fn all_contacts_at_once_are_each_ones_first_contact_bit_for_bit_or_none_if_one_misses() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let (mut all, mut some) = (0, 0);
    // Coarse, about as large as the sphere, and fine: each kind of search; and a single triangle.
    for (triangles, radius) in [(globe(4), 0.05), (globe(12), 0.15), (globe(60), 0.3), (vec![FLOOR], 0.5)] {
        let vertices = triangles.iter().flatten().map(|corner| corner.as_vec3().to_array()).collect();
        let triangles = (0..triangles.len() as u32).map(|index| [0, 1, 2].map(|corner| 3 * index + corner)).collect();
        let scene = Scene::as_is(&Mesh { vertices, triangles }).unwrap();
        let probe = with!(Probe::default(); radius: radius, spacing: 1.0);
        for case in 0..2_000 {
            let (origin, direction) = random_cast(&mut rng);
            // At rest, side by side on a line through the aim, in one place, and not of unit length.
            let direction =
                [direction, direction * 3.0, DVec3::ZERO][usize::from(case % 50 == 0) + usize::from(case % 100 == 0)];
            let side = random_point(&mut rng, 0.4) * f64::from(u8::from(case % 7 != 0));
            let origins = [origin - side, origin, origin + side];
            let each = origins.map(|origin| scene.first_contact(origin, direction, radius));
            let expected = match each {
                [Some(a), Some(b), Some(c)] => Some([a, b, c].map(f64::to_bits)),
                _ => None,
            };
            let found = Approach { start: origin, direction, alignment: side }.full_distances(&scene, &probe);
            assert_eq!(found.map(|found| found.map(f64::to_bits)), expected, "{origins:?} along {direction}");
            all += usize::from(expected.is_some());
            some += usize::from(expected.is_none() && each.iter().any(Option::is_some));
        }
    }
    assert!(all > 500 && some > 500, "{all} {some}");
}

#[test]
fn random_soups_of_triangles_agree_with_brute_force() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    for round in 0..300 {
        let count = [1, 2, 3, 8, 9, 40, 100][round % 7];
        let size = [0.01, 1.0, 8.0][round % 3];
        let soup: Vec<Triangle> = (0..count)
            .map(|_| {
                let center = random_point(&mut rng, 4.0);
                // A third of them lie in a plane, so that paths run along them.
                let flat = rng.random_bool(1.0 / 3.0);
                std::array::from_fn(|_| {
                    let corner = center + random_point(&mut rng, size);
                    if flat { corner.with_z(1.0) } else { corner }
                })
            })
            .collect();
        let surface = Surface::new(soup.clone());
        for _ in 0..50 {
            let (mut origin, mut direction) = random_cast(&mut rng);
            if rng.random_bool(0.3) {
                (origin, direction) = (origin.with_z(1.1), direction.with_z(0.0));
            }
            agrees(&surface, &soup, (origin, direction), 0.15, 1e-11);
        }
    }
}

#[test]
fn a_spaced_grid_of_axis_parallel_casts_agrees_with_brute_force() {
    let globe = globe(6);
    let surface = Surface::new(globe.clone());
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            for i in -11..=11 {
                for j in -11..=11 {
                    let mut origin = DVec3::ZERO;
                    origin[(axis + 1) % 3] = f64::from(i) * 0.5;
                    origin[(axis + 2) % 3] = f64::from(j) * 0.5;
                    origin[axis] = -9.0 * sign;
                    let mut direction = DVec3::splat(if i % 2 == 0 { 0.0 } else { -0.0 });
                    direction[axis] = sign;
                    agrees(&surface, &globe, (origin, direction), 0.15, 1e-12);
                }
            }
        }
    }
}

#[test]
fn a_mesh_that_approximates_a_cylinder_is_touched_like_one() {
    // 720 corners on a circle of radius 2: the mesh lies within 2 · (1 - cos(π / 720)) = 1.9e-5 of the cylinder.
    let corner = |k: u32, z: f64| {
        let angle = std::f64::consts::TAU * f64::from(k) / 720.0;
        at(2.0 * libm::cos(angle), 2.0 * libm::sin(angle), z)
    };
    let wall = (0..720).flat_map(|k| {
        let [a, b, c, d] = [corner(k, -5.0), corner(k + 1, -5.0), corner(k + 1, 5.0), corner(k, 5.0)];
        [[a, b, c], [a, c, d]]
    });
    let surface = Surface::new(wall.collect());
    for step in 0..40 {
        let offset = f64::from(step) * 0.05;
        let expected = 8.0 - f64::sqrt(2.5 * 2.5 - offset * offset);
        let found = surface.first_contact(at(-8.0, offset, 0.3), at(1.0, 0.0, 0.0), 0.5).unwrap();
        assert!(
            (found - expected).abs() < 2e-5 / (1.0 - offset * offset / 6.25).sqrt() + 1e-9,
            "{offset}: {found} {expected}"
        );
    }
}

#[test]
fn a_million_triangles_are_touched_when_brute_force_says_so() {
    let million = globe(501);
    assert_eq!(million.len(), 1_002_000);
    let surface = Surface::new(million.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
    for _ in 0..30 {
        agrees(&surface, &million, random_cast(&mut rng), 0.15, 1e-12);
    }
}

#[test]
fn the_normal_of_a_contact_leads_from_the_nearest_point_of_the_mesh_to_the_center() {
    let triangles = globe(40);
    let surface = Surface::new(triangles.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let mut found = 0;
    for _ in 0..300 {
        let (origin, direction) = random_cast(&mut rng);
        let contact = surface.contact(origin, direction, 0.15);
        assert_eq!(contact.map(|contact| contact.distance), surface.first_contact(origin, direction, 0.15));
        let Some(Contact { distance: way, normal }) = contact.filter(|contact| contact.distance > 0.0) else {
            continue;
        };
        found += 1;
        let touched = origin + direction * way - normal * 0.15;
        assert!((normal.length() - 1.0).abs() < 1e-9 && normal.dot(direction) < 1e-6, "{normal}");
        let nearest = triangles.iter().map(|triangle| distance(touched, triangle)).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-7, "{nearest}");
    }
    assert!(found > 50, "{found}");
    // A corner, an edge and a face of one triangle.
    let surface = Surface::new(vec![FLOOR]);
    let up = surface.contact(at(0.0, 0.0, 3.0), at(0.0, 0.0, -1.0), 0.5).unwrap();
    assert!(up.normal.distance(DVec3::Z) < 1e-12, "{up:?}");
}

#[test]
#[should_panic(expected = "a surface needs a triangle")]
fn a_surface_without_triangles_is_refused_as_documented() {
    Surface::new(Vec::new());
}

#[test]
#[should_panic(expected = "a surface needs finite corners")]
fn a_surface_with_a_corner_that_is_not_finite_is_refused_as_documented() {
    Surface::new(vec![[DVec3::ZERO, DVec3::X, DVec3::Y * f64::NAN]]);
}
