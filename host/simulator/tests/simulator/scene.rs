use crate::assert_says;
use glam::DVec3;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::placements::placements;
use palpate_simulator::probe::{Aim, Scene};

#[test]
fn the_longest_side_gets_the_length_and_the_box_is_centered() {
    let vertices = vec![[1.0, 10.0, 0.0], [3.0, 10.0, 0.5], [2.0, 6.0, 0.25], [900.0; 3]];
    let scene = Scene::new(&Mesh { vertices, triangles: vec![[0, 1, 2]] }, 10.0).unwrap();
    assert_eq!(scene.bounds(), [DVec3::new(-2.5, -5.0, -0.625), DVec3::new(2.5, 5.0, 0.625)]);
    assert_eq!(scene.triangles().next().unwrap()[0], DVec3::new(-2.5, 5.0, -0.625));
}

#[test]
fn approaches_aim_about_the_center_of_mass_that_weighs_triangles_by_their_area() {
    let center = |scene: &Scene| {
        let [low, high] = Aim::Mass.target(scene);
        (low + high) / 2.0
    };
    // A large triangle and one of a quarter of its area.
    let vertices = vec![[0.0; 3], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 4.0], [3.0, 0.0, 4.0], [0.0, 3.0, 4.0]];
    let scene = Scene::as_is(&Mesh { vertices, triangles: vec![[0, 1, 2], [3, 4, 5]] }).unwrap();
    let expected = (DVec3::new(2.0, 2.0, 0.0) * 4.0 + DVec3::new(1.0, 1.0, 4.0)) / 5.0;
    assert!(center(&scene).distance(expected) < 1e-12);
    let flat = Scene::as_is(&Mesh { vertices: vec![[0.0; 3], [2.0, 0.0, 0.0]], triangles: vec![[0, 1, 1]] }).unwrap();
    assert_eq!(center(&flat), DVec3::new(1.0, 0.0, 0.0));
}

#[test]
fn meshes_that_can_be_neither_touched_nor_placed_are_refused() {
    let vertices = vec![[1.0; 3], [f32::NAN; 3], [2.0; 3]];
    for (triangles, what) in [
        (vec![], "no faces"),
        (vec![[0, 0, 0]], "no extent"),
        (vec![[0, 1, 2]], "not finite"),
        (vec![[0, 2, 3]], "vertex 3"),
    ] {
        let mesh = Mesh { vertices: vertices.clone(), triangles };
        for error in [Scene::new(&mesh, 10.0).map(drop), placements(&mesh).map(drop)] {
            assert_says(error.unwrap_err(), &[what]);
        }
    }
    assert!(Scene::as_is(&Mesh::default()).unwrap_err().to_string().contains("no faces"));
}
