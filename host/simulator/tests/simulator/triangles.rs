use glam::Vec3;
use palpate_simulator::mesh::Mesh;
use std::collections::HashMap;

#[test]
fn a_globe_is_closed_and_right_side_out() {
    let globe = Mesh::globe(9);
    assert_eq!(globe.triangles.len(), 4 * 9 * 8);
    let mut edges = HashMap::new();
    let mut volume = 0.0;
    for &[a, b, c] in &globe.triangles {
        [(a, b), (b, c), (c, a)].into_iter().for_each(|edge| *edges.entry(edge).or_insert(0) += 1);
        let [a, b, c] = [a, b, c].map(|index| Vec3::from(globe.vertices[index as usize]));
        volume += a.dot(b.cross(c)) / 6.0;
    }
    assert!(edges.iter().all(|(&(a, b), &count)| count == 1 && edges.contains_key(&(b, a))));
    assert!((3.0..5.0).contains(&volume), "{volume}");
}
