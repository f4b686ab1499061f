//! The figures of a run over objects with several very different meshes agree with fresh touches.

use crate::run::*;
use palpate::evaluate::SequentialSettings;
use palpate::mesh::{Instance, Mesh};

/// Standard error of a share of this many independent cases.
fn standard_error(value: f64, cases: f64) -> f64 {
    // A share of 0 or 1 is not known exactly.
    let spread = value.clamp(1.0 / (cases + 2.0), 1.0 - 1.0 / (cases + 2.0));
    (spread * (1.0 - spread) / cases).sqrt()
}

/// Two shares, each with its cases, are within three standard errors of their difference.
fn agree(what: &str, stated: [f64; 2], measured: [f64; 2]) {
    let [a, b] = [stated, measured].map(|[value, cases]| standard_error(value, cases));
    assert!((stated[0] - measured[0]).abs() <= 3.0 * a.hypot(b), "{what}: {stated:?} stated, {measured:?} measured");
}

/// The cases that groups of `length` of `touches` touches make: as many as do not share any.
fn cases(groups: usize, touches: usize, length: f64) -> f64 {
    (groups as f64).min(touches as f64 / length)
}

/// Three objects of two meshes each.
fn meshes() -> Vec<Object> {
    let sides = [
        ("one", [[1.0, 1.0, 1.0], [1.0, 0.6, 0.7]]),
        ("three", [[1.0, 0.9, 0.1], [1.0, 0.5, 0.12]]),
        ("two", [[1.0, 0.1, 0.1], [1.0, 0.35, 0.25]]),
    ];
    let object = |(name, sides): (&str, [[f32; 3]; 2])| {
        let instance = |(number, sides): (usize, [f32; 3])| Instance {
            name: format!("{name} {number}"),
            mesh: Mesh::globe(10).stretched(sides),
        };
        Object::of_instances(name, sides.into_iter().enumerate().map(instance).collect()).unwrap()
    };
    sides.map(object).into()
}

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
    let margins = Margins::new(Candidate::Compiled(&model), &fresh).unwrap();
    let sequences = SequentialSettings { error_rate: None, max_touches: None, sequences: 500, seed: 9 };
    let measured = margins.approaches(&[20], &sequences).unwrap();
    let stated = summary.ours.evaluation.approaches.unwrap();
    let of_20 = [stated.accuracy[&20], cases(900, 900, 20.0)];
    agree("run, accuracy", of_20, [measured.accuracy[&20], cases(1_500, 18_000, 20.0)]);
    let (own, other) = (&stated.sequential, &measured.sequential);
    let (own_cases, cases) = (cases(900, 900, own.mean().value), cases(1_500, 18_000, other.mean().value));
    agree("run, wrong names", [own.error, own_cases], [other.error, cases]);
    let promised = summary.ours.calibration.ok_or(summary.ours.uncalibrated).unwrap();
    assert!(other.error <= promised.promised + 3.0 * standard_error(other.error, cases), "{}", other.error);
}
