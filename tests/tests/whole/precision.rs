use palpate::mesh::Mesh;
use palpate::probe::approach::Approach;
use palpate::probe::scene::Scene;
use palpate_tests::precision::{double_without_reject, single_after_reject};
use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};

#[test]
fn the_experiments_search_as_the_production_search_does() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut contacts = 0;
    // The second is fine compared with the spheres.
    for (rings, radius) in [(8, 0.15), (60, 1.0)] {
        let scene = Scene::new(&Mesh::globe(rings), 10.0).unwrap();
        for _ in 0..500 {
            let Approach { start, direction, .. } = Approach::draw(&mut rng, scene.bounds(), 10.0);
            let used = scene.first_contact(start, direction, radius);
            let surface = scene.surface();
            assert_eq!(double_without_reject(surface, start, direction, radius), used);
            let single = single_after_reject(surface, start, direction, radius);
            if let Some((single, used)) = single.zip(used) {
                assert!((single - used).abs() < 0.01, "{single} {used}");
                contacts += 1;
            }
        }
    }
    assert!((500..1000).contains(&contacts), "{contacts}");
}
