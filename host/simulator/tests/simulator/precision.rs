use palpate_simulator::mesh::Mesh;
use palpate_simulator::probe::approach::Approach;
use palpate_simulator::probe::scene::Scene;
use palpate_simulator::probe::sweep::precision::{DoubleWithoutReject, SingleAfterReject, first_contact};
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
            assert_eq!(first_contact::<DoubleWithoutReject>(surface, start, direction, radius), used);
            let single = first_contact::<SingleAfterReject>(surface, start, direction, radius);
            if let Some((single, used)) = single.zip(used) {
                assert!((single - used).abs() < 0.01, "{single} {used}");
                contacts += 1;
            }
        }
    }
    assert!((500..1000).contains(&contacts), "{contacts}");
}
