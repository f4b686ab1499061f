use crate::samples::{assert_closed, volume};
use glam::Vec3;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::Object;
use palpate_simulator::mesh::builtin::{all, background, make, many, names, one, varied};
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::sync::LazyLock;

/// The canonical objects, made only once.
static CANONICAL: LazyLock<Vec<Object>> = LazyLock::new(|| all().unwrap());

/// Number of separate pieces of the surface.
fn pieces(mesh: &Mesh) -> usize {
    fn root(parents: &mut [u32], mut i: u32) -> u32 {
        while parents[i as usize] != i {
            parents[i as usize] = parents[parents[i as usize] as usize];
            i = parents[i as usize];
        }
        i
    }
    let mut parents: Vec<u32> = (0..).take(mesh.vertices.len()).collect();
    for &[a, b, c] in &mesh.triangles {
        for other in [b, c] {
            let (a, other) = (root(&mut parents, a), root(&mut parents, other));
            parents[a as usize] = other;
        }
    }
    mesh.triangles.iter().map(|&[a, ..]| root(&mut parents, a)).collect::<std::collections::HashSet<_>>().len()
}

/// Checks that a mesh is closed, right side out, and has a number of triangles in the range.
fn assert_sound(name: &str, mesh: &Mesh, counts: RangeInclusive<usize>) {
    assert_closed(name, mesh);
    assert!(volume(mesh) > 0.0, "{name} is inside out");
    assert!(counts.contains(&mesh.triangles.len()), "{name}: {} triangles", mesh.triangles.len());
}

#[test]
fn there_are_ten_in_the_agreed_order() {
    let names: Vec<_> = CANONICAL.iter().map(|object| object.name.as_str()).collect();
    let agreed =
        ["bowl", "camera", "paperclip", "fork", "hammer", "mouse", "scissors", "spoon", "wristwatch", "winebottle"];
    assert_eq!(names, agreed);
}

#[test]
fn every_object_is_one_closed_piece_right_side_out_of_5000_to_60000_triangles() {
    for object in &*CANONICAL {
        assert_sound(&object.name, object.mesh(), 5_000..=60_000);
        assert_eq!(pieces(object.mesh()), 1, "{}", object.name);
    }
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    for (a, b) in CANONICAL.iter().zip(pool.install(|| make(&names()[..4], None)).unwrap()) {
        assert_eq!(a.mesh(), b.mesh(), "{}", a.name);
    }
}

#[test]
fn varied_objects_are_closed_and_right_side_out_and_another_than_the_canonical_one() {
    for object in &*CANONICAL {
        let varied = varied(&object.name, 3).unwrap();
        let name = &object.name;
        assert_sound(name, varied.mesh(), 5_000..=70_000);
        assert_eq!(pieces(varied.mesh()), 1, "{name}");
        let (size, canonical) = (volume(varied.mesh()), volume(object.mesh()));
        assert!(size > 0.3 * canonical && size < 3.0 * canonical, "{name}: {size}, canonical {canonical}");
        assert!((size / canonical - 1.0).abs() > 1e-4, "{name} is the canonical one");
    }
}

#[test]
fn the_same_seed_gives_the_same_object_and_another_seed_another() {
    let [one, again, other] = [7, 7, 1].map(|seed| varied("spoon", seed).unwrap());
    assert_eq!(one.mesh(), again.mesh());
    assert!((volume(one.mesh()) / volume(other.mesh()) - 1.0).abs() > 1e-4);
}

#[test]
fn no_triangle_faces_inwards_where_surfaces_are_smooth() {
    // The angle between a triangle and the mean of its three neighbors: folds show as more than a right angle.
    for object in &*CANONICAL {
        let mesh = object.mesh();
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| Vec3::from(mesh.vertices[i as usize]));
            (b - a).cross(c - a).normalize_or_zero()
        };
        let mut owner = HashMap::new();
        for (i, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            owner.extend([((a, b), i), ((b, c), i), ((c, a), i)]);
        }
        let area = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| Vec3::from(mesh.vertices[i as usize]));
            (b - a).cross(c - a).length()
        };
        let folded = mesh.triangles.iter().filter(|&&[a, b, c]| {
            let around: Vec3 = [(b, a), (c, b), (a, c)].iter().map(|edge| normal(&mesh.triangles[owner[edge]])).sum();
            normal(&[a, b, c]).dot(around) < 0.0
        });
        let share = folded.map(area).sum::<f32>() / mesh.triangles.iter().map(area).sum::<f32>();
        assert!(share < 1e-3, "{}: {share} of the surface is folded", object.name);
    }
}

#[test]
fn an_unknown_name_is_an_argument_error_that_lists_the_known_ones() {
    let error = one("teapot").unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("teapot") && error.to_string().contains("winebottle"), "{error}");
}

#[test]
fn shapes_of_a_background_are_closed_right_side_out_and_of_their_own() {
    let object = background(10, 5).unwrap();
    assert_eq!(object.instances().len(), 10);
    let mut volumes: Vec<f64> = Vec::new();
    for instance in object.instances() {
        assert_sound(&instance.name, &instance.mesh, 200..=200_000);
        let size = volume(&instance.mesh);
        assert!(volumes.iter().all(|other| (size / other - 1.0).abs() > 1e-4), "{} is another", instance.name);
        volumes.push(size);
    }
    let again = background(2, 5).unwrap();
    assert!(again.instances().zip(object.instances()).all(|(a, b)| a.mesh == b.mesh), "the same seed, other shapes");
    let other = background(2, 6).unwrap();
    assert!(other.instances().zip(object.instances()).all(|(a, b)| a.mesh != b.mesh), "another seed, the same shapes");
}

#[test]
fn many_objects_begin_with_the_built_in_ones_and_all_have_names_of_their_own() {
    let (few, more) = (many(2).unwrap(), many(21).unwrap());
    let names_of = |objects: &[Object]| objects.iter().map(|object| object.name.clone()).collect::<Vec<_>>();
    assert_eq!(names_of(&few), names_of(&more)[..2]);
    assert_eq!(names_of(&more)[..10], names());
    assert_eq!(names_of(&more)[10], "shape-0");
    assert_eq!(names_of(&more)[20], format!("{}-1", names()[0]));
    assert_ne!(more[20].mesh(), more[0].mesh());
    let different: std::collections::BTreeSet<String> = names_of(&more).into_iter().collect();
    assert_eq!(different.len(), 21);
}
