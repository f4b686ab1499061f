use palpate_simulator::mesh::Mesh;

#[test]
fn only_what_is_far_from_the_origin_is_moved() {
    let offset = |at: f64| Mesh::from_f64(&[[at, 0.0, 0.0], [at + 1.0, 1.0, 1.0], [9e9; 3]], vec![[0, 1, 1]]).1;
    assert_eq!(offset(15.5), [0.0; 3]);
    assert_eq!(offset(-17.5), [-17.0, 0.5, 0.5]);
    assert_eq!(offset(f64::NAN), [0.0; 3]);
    assert_eq!(Mesh::from_f64(&[[5.0; 3]], vec![[0; 3]]).1, [0.0; 3], "a point has no side");
    let (mesh, moved) = Mesh::from_f64(&[[0.1, -0.0, 1e-50]], Vec::new());
    assert_eq!(moved, [0.0; 3]);
    assert_eq!(mesh.vertices[0].map(f32::to_bits), [0.1, -0.0, 0.0].map(f32::to_bits));
}
