use super::*;
use crate::mesh::Mesh;
use glam::Vec3;
use std::collections::HashMap;

/// The signed volume, in cubic centimetres: positive if the triangles are anticlockwise seen from outside.
fn volume(mesh: &Mesh) -> f64 {
    let at = |i: u32| Vec3::from(mesh.vertices[i as usize]).as_dvec3();
    mesh.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum()
}

/// How often every directed edge occurs.
fn edges(mesh: &Mesh) -> HashMap<(u32, u32), usize> {
    let mut count = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *count.entry(edge).or_insert(0) += 1;
        }
    }
    count
}

fn assert_closed(name: &str, mesh: &Mesh) {
    let edges = edges(mesh);
    for (&(a, b), &count) in &edges {
        assert_ne!(a, b, "{name}: a triangle uses a vertex twice");
        assert_eq!(count, 1, "{name}: an edge is used {count} times in one direction");
        assert_eq!(edges.get(&(b, a)), Some(&1), "{name}: an edge has no opposite");
    }
    assert!(mesh.vertices.iter().flatten().all(|x| x.is_finite()), "{name}: a vertex is not finite");
}

#[test]
fn there_are_ten_in_the_agreed_order() {
    let names: Vec<_> = builtin().into_iter().map(|object| object.name).collect();
    let agreed =
        ["bowl", "camera", "paperclip", "fork", "hammer", "mouse", "scissors", "spoon", "wristwatch", "winebottle"];
    assert_eq!(names, agreed);
}

#[test]
fn every_edge_is_shared_by_two_triangles_that_agree_which_side_is_out() {
    for object in builtin() {
        assert_closed(&object.name, &object.mesh);
        assert!(volume(&object.mesh) > 0.0, "{} is inside out", object.name);
    }
}

#[test]
fn every_mesh_has_5000_to_60000_triangles() {
    let counts: Vec<_> = builtin().into_iter().map(|object| (object.name, object.mesh.triangles.len())).collect();
    assert!(counts.iter().all(|(_, count)| (5_000..=60_000).contains(count)), "{counts:?}");
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let on = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(builtin);
    for (a, b) in on(1).iter().zip(&on(3)) {
        assert_eq!(a.mesh, b.mesh, "{}", a.name);
    }
}
