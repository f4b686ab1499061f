use crate::samples::cuboid;
use glam::Vec3;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::facts::{Facts, sides};

fn cube() -> Mesh {
    cuboid([1.0; 3])
}

#[test]
fn a_cube_is_closed_and_right_side_out_until_it_is_turned_over_or_opened() {
    let words = |mesh: &Mesh| {
        let facts = Facts::of(mesh);
        (facts.closed(), facts.side())
    };
    let complaint = |mesh: &Mesh| Facts::of(mesh).complaints(None).into_iter().next();
    let mut mesh = cube();
    assert_eq!(words(&mesh), ("yes".into(), "yes".into()));
    assert_eq!(complaint(&mesh), None);
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    assert_eq!(words(&mesh), ("yes".into(), "no: inside out".into()));
    assert!(complaint(&mesh).unwrap().starts_with("The mesh is inside out"));
    mesh.triangles[0].swap(0, 1);
    assert_eq!(words(&mesh), ("yes".into(), "no: at 3 edges the two triangles face opposite sides".into()));
    assert!(complaint(&mesh).unwrap().contains("partly inside out: at 3 edges"));
    mesh.triangles.remove(0);
    assert_eq!(words(&mesh).0, "no: 3 open edges");
    assert!(words(&mesh).1.contains("open surface"));
    assert!(complaint(&mesh).unwrap().starts_with("The mesh is open: 3 edges belong to one triangle only"));
}

#[test]
fn a_mesh_far_from_its_origin_keeps_its_size_and_volume() {
    let mut mesh = cube();
    mesh.vertices.iter_mut().flatten().for_each(|x| *x += 1000.0);
    let facts = Facts::of(&mesh);
    assert_eq!((facts.low, facts.high, facts.triangles), (Vec3::splat(1000.0), Vec3::splat(1001.0), 12));
    assert!((facts.volume - 1.0).abs() < 1e-9, "{}", facts.volume);
}

#[test]
fn vertices_that_differ_by_rounding_alone_leave_no_gap() {
    let mut mesh = cube().stretched([2.0; 3]);
    // One side has its own corners, on which an exporter left 1e-16 of the size where 0 belongs.
    for vertex in mesh.triangles[8..10].iter_mut().flatten() {
        let place = mesh.vertices[*vertex as usize].map(|x| if x == 0.0 { 2.73e-16 } else { x });
        *vertex = mesh.vertices.len() as u32;
        mesh.vertices.push(place);
    }
    let facts = Facts::of(&mesh);
    assert!(facts.is_right_side_out() && (facts.volume - 8.0).abs() < 1e-6, "{facts:?}");
    assert!(facts.complaints(None).is_empty());
    assert_eq!(facts.verdict(0.03), "usable");
    // A millionth of the size is a gap.
    mesh.vertices.iter_mut().skip(8).for_each(|vertex| vertex[0] = vertex[0].max(2e-6));
    assert_eq!(Facts::of(&mesh).open_edges, 8);
}

#[test]
fn an_edge_of_four_triangles_is_not_that_of_a_manifold() {
    // Two tetrahedra that share an edge.
    let mut mesh = palpate_simulator::mesh::obj::parse(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n".as_bytes(),
        "two.obj".as_ref(),
    )
    .unwrap();
    mesh.vertices.extend([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
    mesh.triangles.extend([[0, 1, 4], [0, 5, 1], [1, 5, 4], [4, 5, 0]]);
    let facts = Facts::of(&mesh);
    assert_eq!((facts.open_edges, facts.branching_edges, facts.parts.len()), (0, 1, 2));
    let said = facts.complaints(None);
    assert_eq!(said, ["The mesh is not a manifold: more than two triangles meet at 1 edge."]);
    assert!(!facts.is_closed());
}

/// Globes and the like beside or inside each other: where, how large, and whether inside out.
fn globes(all: &[([f32; 3], f32, bool)]) -> Mesh {
    let mut mesh = Mesh::default();
    for &(place, size, turned) in all {
        let globe = Mesh::globe(8);
        let base = mesh.vertices.len() as u32;
        let moved = |vertex: [f32; 3]| [0, 1, 2].map(|axis| place[axis] + size * vertex[axis]);
        mesh.vertices.extend(globe.vertices.into_iter().map(moved));
        let turn = |[a, b, c]: [u32; 3]| if turned { [a, c, b] } else { [a, b, c] }.map(|index| base + index);
        mesh.triangles.extend(globe.triangles.into_iter().map(turn));
    }
    mesh
}

/// A pot whose handle and spout stick out of it, inside out or not.
fn pot(handle: bool, spout: bool) -> Mesh {
    globes(&[([0.0; 3], 1.0, false), ([1.0, 0.0, 0.2], 0.4, handle), ([-0.9, 0.3, 0.1], 0.3, spout)])
}

#[test]
fn a_pot_of_which_handle_and_spout_alone_are_inside_out_is_not_right_side_out() {
    let good = Facts::of(&pot(false, false));
    assert!(good.is_right_side_out() && good.complaints(None).is_empty());
    let facts = Facts::of(&pot(true, true));
    assert!(facts.volume > 0.0 && facts.is_closed() && facts.contrary_edges == 0);
    assert!(!facts.is_right_side_out());
    assert_eq!(facts.side(), "no: 2 of 3 parts are inside out");
    let said = facts.complaints(None);
    assert_eq!(said, ["The mesh is partly inside out: 2 of 3 parts. Reverse the vertices of those faces."]);
    assert!(Facts::of(&pot(true, false)).side() == "no: 1 of 3 parts are inside out");
}

#[test]
fn a_cavity_faces_inward_and_a_solid_inside_another_may_face_outward() {
    let hollow = |inner| Facts::of(&globes(&[([0.0; 3], 1.0, false), ([0.1; 3], 0.5, inner)]));
    for facts in [hollow(true), hollow(false)] {
        assert!(facts.is_right_side_out() && facts.complaints(None).is_empty());
        assert_eq!(facts.verdict(0.03), "usable", "no finger reaches what is inside");
    }
    // In the box of the larger one, but not in it.
    let beside = Facts::of(&globes(&[([0.0; 3], 1.0, false), ([0.85; 3], 0.1, true)]));
    assert_eq!(beside.inside_out().count(), 1);
    let turned = Facts::of(&globes(&[([0.0; 3], 1.0, true), ([0.1; 3], 0.5, true)]));
    assert_eq!((turned.side().as_str(), turned.inside_out().count()), ("no: inside out", 2));
}

#[test]
fn a_size_that_is_neither_one_in_meters_nor_in_millimeters_is_said() {
    let said = |size: f32, millimeters| Facts::of(&cube().stretched([size; 3])).complaints(millimeters);
    for (size, millimeters) in [(0.001, None), (1.0, None), (9_999.0, None), (0.2, Some(1_000.0)), (50.0, Some(10.0))] {
        assert_eq!(said(size, millimeters), [""; 0], "{size} {millimeters:?}");
    }
    for (size, millimeters) in [(0.000_9, None), (20_000.0, None), (200.0, Some(1_000.0)), (0.2, Some(1.0))] {
        let said = said(size, millimeters);
        assert!(said.len() == 1 && said[0].contains("an implausible size"), "{size} {millimeters:?}: {said:?}");
    }
}

#[test]
fn sides_have_three_digits_and_no_zeros_after_them() {
    assert_eq!(sides(glam::DVec3::new(90.0, 80.0001, 0.5)), "90 × 80 × 0.5");
    assert_eq!(sides(glam::DVec3::new(100.0, 1234.4, 7.256)), "100 × 1234 × 7.26");
    assert_eq!(sides(glam::DVec3::new(0.0, 1e-5, 1e7)), "0 × 1.00e-5 × 1.00e7");
}

#[test]
fn a_mesh_is_usable_unless_a_finger_fits_through_a_gap() {
    let verdict = |mesh: &Mesh, diameter| Facts::of(mesh).verdict(diameter);
    let mut mesh = cube();
    assert_eq!(verdict(&mesh, 0.03), "usable");
    // Inside out, and fingers feel no difference.
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    assert!(verdict(&mesh, 0.03).starts_with("usable: fingers feel a surface from both sides"));
    // Half a side is missing: a triangle of area 1/2 and perimeter 2 + √2.
    mesh.triangles.remove(0);
    let facts = Facts::of(&mesh);
    assert!((facts.widest_gap - 2.0 / (2.0 + 2.0_f64.sqrt())).abs() < 1e-9, "{}", facts.widest_gap);
    let said = verdict(&mesh, 0.03);
    assert!(said.starts_with("repair first: a gap is 0.586 wide and a finger 0.0300"), "{said}");
    assert!(verdict(&mesh, 0.7).starts_with("usable: "));
    // A crack a thousandth wide all along an edge, which welding does not close.
    let mut mesh = cube();
    mesh.vertices.extend([[0.0, 0.0, 0.001], [1.0, 0.0, 0.001]]);
    for vertex in mesh.triangles[4..6].iter_mut().flatten().filter(|vertex| **vertex < 2) {
        *vertex += 8;
    }
    let facts = Facts::of(&mesh);
    assert!(facts.open_edges > 3 && (1e-4..2e-3).contains(&facts.widest_gap), "{facts:?}");
    assert!(verdict(&mesh, 0.03).starts_with("usable: "));
}
