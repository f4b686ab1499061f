use crate::samples::cuboid;
use glam::{DMat3, DQuat, DVec3, Vec3};
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::placements::{Center, Placement, placements, resting};
use std::collections::BTreeMap;

/// A solid of revolution about z, closed and right side out: radii at heights, from below.
fn turned(profile: &[[f32; 2]], sides: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let rings = profile.len() as u32;
    for &[radius, height] in profile {
        for side in 0..sides {
            let (sin, cos) = libm::sincosf(std::f32::consts::TAU * side as f32 / sides as f32);
            mesh.vertices.push([radius * cos, radius * sin, height]);
        }
    }
    let vertex = |ring: u32, side: u32| ring * sides + side % sides;
    for side in 0..sides {
        for ring in 0..rings - 1 {
            let [a, b] = [vertex(ring, side), vertex(ring, side + 1)];
            let [c, d] = [vertex(ring + 1, side), vertex(ring + 1, side + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
        let (bottom, top) = (rings * sides, rings * sides + 1);
        mesh.triangles.push([vertex(0, side + 1), vertex(0, side), bottom]);
        mesh.triangles.push([vertex(rings - 1, side), vertex(rings - 1, side + 1), top]);
    }
    mesh.vertices.extend([[0.0, 0.0, profile[0][1]], [0.0, 0.0, profile[profile.len() - 1][1]]]);
    mesh
}

fn bottle() -> Mesh {
    turned(&[[0.38, 0.0], [0.4, 0.05], [0.4, 1.8], [0.15, 2.3], [0.15, 3.0]], 48)
}

fn weights(mesh: &Mesh) -> BTreeMap<String, f64> {
    let placements = placements(mesh).unwrap().placements;
    let sum: f64 = placements.iter().map(|placement| placement.weight).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    placements.into_iter().map(|placement| (placement.name, placement.weight)).collect()
}

fn of(expected: &[(&str, f64)]) -> BTreeMap<String, f64> {
    expected.iter().map(|&(name, weight)| (name.to_owned(), weight)).collect()
}

/// The share of all directions that a rectangle of these half sides takes at this distance, and the one opposite.
fn share_of_faces(a: f64, b: f64, distance: f64) -> f64 {
    let (a, b) = (a / distance, b / distance);
    2.0 * 4.0 * (a * b / (1.0 + a * a + b * b).sqrt()).atan() / (4.0 * std::f64::consts::PI)
}

fn rotated(mesh: &Mesh, rotation: DMat3) -> Mesh {
    let turned = |&vertex: &[f32; 3]| (rotation * Vec3::from(vertex).as_dvec3()).as_vec3().to_array();
    Mesh { vertices: mesh.vertices.iter().map(turned).collect(), triangles: mesh.triangles.clone() }
}

#[test]
fn a_cube_lies_in_one_way() {
    assert_eq!(weights(&cuboid([2.0; 3])), of(&[("+z", 1.0)]));
}

#[test]
fn a_box_lies_on_each_pair_of_faces_as_often_as_its_solid_angle_says() {
    let found = weights(&cuboid([1.0, 2.0, 3.0]));
    let expected = [
        ("+x", share_of_faces(1.0, 1.5, 0.5)),
        ("+y", share_of_faces(0.5, 1.5, 1.0)),
        ("+z", share_of_faces(0.5, 1.0, 1.5)),
    ];
    for (name, share) in expected {
        assert!((found[name] - share).abs() < 1e-4, "{name}: {} and {share}", found[name]);
    }
    assert_eq!(found.len(), 3);
}

#[test]
fn a_cylinder_stands_or_lies_and_a_cone_too_but_not_on_its_tip() {
    let found = weights(&turned(&[[1.0, 0.0], [1.0, 2.0]], 64));
    // The two ends, seen from the middle.
    let standing = 1.0 - 1.0 / 2.0_f64.sqrt();
    assert_eq!(found.len(), 2, "{found:?}");
    assert!((found["+z"] - standing).abs() < 2e-3, "{found:?}");
    let found = weights(&turned(&[[1.0, 0.0], [0.0, 2.0]], 48));
    assert!(found.len() == 2 && found.contains_key("+z"), "{found:?}");
}

#[test]
fn a_bottle_stands_and_lies_and_stands_on_its_head_only_rarely() {
    let all = placements(&bottle()).unwrap();
    let names = |some: &[Placement]| some.iter().map(|placement| placement.name.clone()).collect::<Vec<_>>();
    assert_eq!(all.placements.len() + all.left_out.len(), 3, "{all:?}");
    assert_eq!(names(&all.placements)[1..], ["+z"]);
    assert_eq!(names(&all.left_out), ["-z"]);
    assert_eq!(all.center, Center::OfVolume);
}

#[test]
fn a_ball_lies_in_one_way() {
    let ball: Vec<[f32; 2]> = (0..=24)
        .map(|ring| {
            let (sin, cos) = libm::sincosf(std::f32::consts::PI * ring as f32 / 24.0);
            [sin, -cos]
        })
        .collect();
    assert_eq!(weights(&turned(&ball, 48)).len(), 1);
}

#[test]
fn a_tetrahedron_lies_on_each_of_its_faces_and_equal_ones_are_one_placement() {
    let vertices = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let regular = Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] };
    assert_eq!(weights(&regular).into_values().collect::<Vec<_>>(), [1.0]);
}

#[test]
fn an_unstable_face_rolls_over_to_the_face_that_it_ends_on() {
    // A prism that leans so far that its center of mass is outside of its ends.
    let mut leaning = cuboid([1.0, 1.0, 2.0]);
    leaning.vertices.iter_mut().for_each(|vertex| vertex[0] += 1.2 * vertex[2]);
    let all = placements(&leaning).unwrap();
    for placement in all.placements.iter().chain(&all.left_out) {
        assert!(placement.rotation.row(2).z.abs() < 0.99, "{placement:?} stands on an end");
    }
    let sum: f64 = all.placements.iter().map(|placement| placement.weight).sum();
    assert!((sum - 1.0).abs() < 1e-9);
}

#[test]
fn weights_do_not_depend_on_how_the_file_turns_the_mesh() {
    let solids = [
        cuboid([1.0, 2.0, 3.0]),
        bottle(),
        turned(&[[1.0, 0.0], [1.0, 2.0]], 64),
        Mesh::globe(9).stretched([1.0, 0.6, 0.3]),
    ];
    for mesh in &solids {
        let sorted =
            |mesh: &Mesh| placements(mesh).unwrap().placements.iter().map(|one| one.weight).collect::<Vec<_>>();
        let expected = sorted(mesh);
        for (x, y) in [(0.3, 1.1), (2.0, -0.7), (-1.3, 0.4)] {
            let found = sorted(&rotated(mesh, DMat3::from_rotation_x(x) * DMat3::from_rotation_y(y)));
            assert_eq!(found.len(), expected.len(), "{found:?} and {expected:?}");
            assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 0.01), "{found:?} and {expected:?}");
        }
    }
}

#[test]
fn the_direction_of_the_name_points_up_and_the_lowest_vertices_carry_the_object() {
    for placement in placements(&bottle()).unwrap().placements {
        let rotation = placement.rotation;
        assert!((rotation.determinant() - 1.0).abs() < 1e-9);
        assert!((rotation * rotation.transpose() - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-9));
        let mesh = rotated(&bottle(), rotation);
        let [low, _] = mesh.bounds();
        let lowest = mesh.vertices.iter().filter(|vertex| vertex[2] - low.z < 1e-4).count();
        assert!(lowest >= 3, "{}: {lowest}", placement.name);
    }
    assert_eq!(placements(&bottle()).unwrap().placements[1].rotation, DMat3::IDENTITY);
}

#[test]
fn the_center_of_mass_is_the_hulls_where_the_mesh_encloses_no_volume_that_could_be_right() {
    let solid = cuboid([1.0, 2.0, 3.0]);
    let center = |mesh: &Mesh| placements(mesh).unwrap().center;
    assert_eq!(center(&solid), Center::OfVolume);
    let inside_out = Mesh { triangles: solid.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..solid.clone() };
    assert_eq!(center(&inside_out), Center::OfVolume, "the same solid");
    let open = Mesh { triangles: solid.triangles[2..].to_vec(), ..solid.clone() };
    assert_eq!(center(&open), Center::OfHullSinceOpen);
    let twice = Mesh { triangles: solid.triangles.iter().chain(&solid.triangles).copied().collect(), ..solid.clone() };
    assert_eq!(center(&twice), Center::OfHullSinceTooLarge);
    let both = inside_out.triangles.iter().chain(&solid.triangles).copied().collect();
    assert_eq!(center(&Mesh { triangles: both, ..solid.clone() }), Center::OfHullSinceHollow);
    for (mesh, count) in [(&twice, 3), (&inside_out, 3), (&open, 4)] {
        assert_eq!(weights(mesh).len(), count, "a box without its bottom is another one upside down");
    }
}

#[test]
fn a_sheet_lies_on_both_sides() {
    let vertices = vec![[0.0, 0.0, 0.0], [3.0, 0.0, 0.5], [3.0, 2.0, 0.5], [0.0, 2.0, 0.0], [1.0, 3.0, 0.166_666_67]];
    let sheet = Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3], [3, 2, 4]] };
    let found = weights(&sheet);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found.values().all(|weight| (weight - 0.5).abs() < 0.01));
}

#[test]
fn names_are_the_nearest_of_the_axes_and_diagonals() {
    for (up, expected) in
        [([0.0, 0.0, 1.0], "+z"), ([0.1, -0.2, -1.0], "-z"), ([1.0, -0.9, 0.1], "+x-y"), ([-1.0, -1.1, 0.8], "-x-y+z")]
    {
        let up = DVec3::from(up).normalize();
        let mesh = rotated(&bottle(), DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, up)));
        let stands = |placement: &Placement| placement.rotation.row(2).distance(up) < 1e-3;
        let standing = placements(&mesh).unwrap().placements.into_iter().find(stands).unwrap();
        assert_eq!(standing.name, expected);
    }
}

#[test]
fn vertices_that_differ_by_rounding_alone_leave_the_center_of_mass_that_of_the_volume() {
    // Each triangle has its own corners, which differ where 0 belongs, as in STL files of CAD programs.
    let whole = bottle();
    let mut apart = Mesh::default();
    for (number, triangle) in (0..).zip(&whole.triangles) {
        let noise = 1e-17 * (number % 7) as f32;
        apart.triangles.push([0, 1, 2].map(|corner| 3 * number + corner));
        apart.vertices.extend(triangle.map(|i| whole.vertices[i as usize].map(|x| if x == 0.0 { noise } else { x })));
    }
    let [whole, apart] = [whole, apart].map(|mesh| placements(&mesh).unwrap());
    assert_eq!(apart.center, Center::OfVolume);
    assert_eq!(apart, whole);
}

#[test]
fn poses_at_rest_are_those_of_the_hull_with_the_names_of_placements_first() {
    for mesh in [bottle(), cuboid([1.0, 2.0, 3.0]), turned(&[[1.0, 0.0], [1.2, 1.0], [1.0, 2.0]], 20)] {
        let (merged, all) = (placements(&mesh).unwrap(), resting(&mesh).unwrap());
        let first: Vec<&Placement> = merged.placements.iter().chain(&merged.left_out).collect();
        for (placement, own) in first.iter().zip(&all) {
            assert_eq!((&own.name, own.rotation), (&placement.name, placement.rotation));
            assert!(own.weight > 0.0 && own.weight <= 1.0);
        }
        assert!((all.iter().map(|pose| pose.weight).sum::<f64>() - 1.0).abs() < 1e-4);
        assert!(all[first.len()..].windows(2).all(|two| two[0].weight >= two[1].weight));
        let names: std::collections::BTreeSet<&str> = all.iter().map(|pose| pose.name.as_str()).collect();
        assert_eq!(names.len(), all.len());
    }
    // Each facet that it lies on, and both ends.
    assert_eq!(resting(&turned(&[[1.0, 0.0], [1.0, 2.0]], 24)).unwrap().len(), 26);
    assert_eq!(resting(&cuboid([1.0, 2.0, 3.0])).unwrap().len(), 6);
}
