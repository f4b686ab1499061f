use super::*;
use crate::mesh::Mesh;
use crate::probe::approach::Probe;
use crate::with;

fn objects() -> Vec<Object> {
    [("disc", 0.1), ("globe", 1.0)]
        .map(|(name, height)| Object::new(name, Mesh::globe(12).stretched([1.0, 1.0, height])))
        .into()
}

fn origin(touches: u64) -> Origin {
    Origin { touches, ..Origin::default() }
}

fn settings() -> Settings {
    Settings { threads: Some(2), ..origin(1500).into() }
}

#[test]
fn a_capture_counts_by_finger_what_the_hand_did_not_reach() {
    let directory = tempfile::tempdir().unwrap();
    let probe = with!(Probe::default(), stroke = Some(1.0), travel = Some(9.0));
    let settings = Settings { origin: Origin { approaches: true, probe, ..origin(600) }, ..settings() };
    let summary = capture(&objects(), &settings, directory.path(), &()).unwrap();
    let scenes = scenes(&objects().iter().collect::<Vec<_>>(), &settings.origin, &()).unwrap();
    for (object, scenes) in summary.objects.iter().zip(&scenes) {
        let sampler = Sampler::of_instances(scenes, &object.name, &settings.origin);
        let (mut late, mut turned_back) = ([0; FINGERS], 0);
        for sample in 0..600 {
            let distances = sampler.approach(&scenes[0], sample).distances(&scenes[0], &probe);
            let first = distances.iter().flatten().copied().fold(f64::INFINITY, f64::min);
            turned_back += u64::from(first.is_finite() && first > 9.0);
            let is_late = |distance: &f64| first <= 9.0 && *distance > first + 1.0 + 1e-6;
            for (late, distance) in late.iter_mut().zip(distances) {
                *late += u64::from(distance.as_ref().is_some_and(is_late));
            }
        }
        assert_eq!((object.late, object.turned_back), (late, turned_back), "{}", object.name);
        assert!(late.iter().all(|late| *late > 0) && turned_back > 0, "{late:?} {turned_back}");
    }
}
