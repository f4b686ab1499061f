use crate::samples::{assert_closed, volume};
use palpate_simulator::mesh::Mesh;

#[test]
fn a_globe_is_closed_and_right_side_out() {
    let globe = Mesh::globe(9);
    assert_eq!(globe.triangles.len(), 4 * 9 * 8);
    assert_closed("globe", &globe);
    assert!((3.0..5.0).contains(&volume(&globe)), "{}", volume(&globe));
}
