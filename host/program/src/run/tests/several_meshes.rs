//! The figures of a run over objects with several very different meshes agree with fresh touches.

use crate::run::*;
use meshes::meshes;
use palpate::evaluate::SequentialSettings;
use shares::{Share, cases};

#[path = "../../../../src/tests/meshes.rs"]
mod meshes;
#[path = "../../../../src/tests/shares.rs"]
mod shares;

#[test]
fn what_a_run_states_is_what_its_model_does() {
    let objects = meshes();
    let place = tempfile::tempdir().unwrap();
    let origin = palpate::touches::Origin { touches: 900, ..Default::default() };
    let settings = Settings {
        capture: origin.clone().into(),
        approaches: 3_000,
        groups: 300,
        error_rate: 0.1,
        sequences: 1_500,
        ..Settings::default()
    };
    let summary = run(&objects, &settings, place.path(), &()).unwrap();
    let bytes = std::fs::read(place.path().join("model.palpate")).unwrap();
    let model = Model::new(&bytes).unwrap();
    let unseen = palpate::touches::Origin { touches: 6_000, approaches: true, seed: 99, ..origin };
    let (mut fresh, _) = capture::in_memory(&objects, &unseen.into(), &()).unwrap();
    assert_eq!(fresh.several().values().copied().collect::<Vec<_>>(), [2; 3]);
    evaluate::add_noise(&mut fresh, &settings.noise, 98).unwrap();
    let margins = Margins::new(&model, &fresh).unwrap();
    let sequences = SequentialSettings { error_rate: None, max_touches: None, sequences: 500, seed: 9 };
    let measured = margins.approaches(&[20], &sequences).unwrap();
    let stated = summary.ours.evaluation.approaches.unwrap();
    let of_20 = Share::of(measured.accuracy[&20], cases(1_500, 18_000, 20.0));
    Share::of(stated.accuracy[&20], cases(900, 900, 20.0)).agrees("run, accuracy", of_20);
    let (own, other) = (&stated.sequential, &measured.sequential);
    let (own_cases, cases) = (cases(900, 900, own.mean().value), cases(1_500, 18_000, other.mean().value));
    let wrong = Share::of(other.error, cases);
    Share::of(own.error, own_cases).agrees("run, wrong names", wrong);
    let promised = summary.ours.calibration.ok_or(summary.ours.uncalibrated).unwrap();
    assert!(wrong.0 <= promised.promised + 3.0 * wrong.1, "{wrong:?}");
}
