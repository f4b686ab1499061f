use palpate_simulator::mesh::Mesh;
use rand::{RngExt, SeedableRng};

#[test]
fn places_are_the_same_up_to_a_billionth_of_the_size_whichever_cells_they_are_in() {
    let mut random = rand::rngs::Xoshiro256PlusPlus::seed_from_u64(1);
    // The box, and triangles that each have one corner to be merged.
    let mut mesh = Mesh { vertices: vec![[0.0; 3], [1.0; 3], [0.5; 3]], triangles: vec![[0, 1, 2]] };
    let mut add = |place: [f64; 3]| {
        mesh.triangles.push([mesh.vertices.len() as u32, 1, 2]);
        mesh.vertices.push(place.map(|x| x as f32));
        mesh.triangles.len() - 1
    };
    let mut cases = Vec::new();
    for _ in 0..5_000 {
        // Where f32 is fine enough to hold such distances.
        let place: [f64; 3] = std::array::from_fn(|_| random.random_range(0.0..1e-3));
        let own = add(place);
        for _ in 0..3 {
            let moved = place.map(|x| x + random.random_range(-0.9e-9..0.9e-9));
            cases.push((own, add(moved), true));
            cases.push((own, add([moved[0] + 3e-9, moved[1], moved[2]]), false));
        }
    }
    let merged = mesh.welded();
    assert_eq!(merged.triangles.len(), mesh.triangles.len());
    for (own, other, is_same) in cases {
        let [one, two] = [own, other].map(|triangle| merged.triangles[triangle][0]);
        assert_eq!(one == two, is_same, "{:?} {:?}", mesh.vertices[own + 2], mesh.vertices[other + 2]);
    }
}

#[test]
fn of_a_point_only_equal_vertices_are_at_the_same_place() {
    let vertices = [0.0, -0.0, 1e-30, 0.0].map(|x| [x, 0.0, 0.0]).to_vec();
    let merged = Mesh { vertices, triangles: vec![[0, 1, 3]] }.welded();
    assert_eq!((merged.vertices, merged.triangles.len()), (vec![[0.0; 3], [1e-30, 0.0, 0.0]], 0));
}
