//! Models with an output for each placement of objects on a table.

use crate::calibrate::{self, Per, calibrate};
use crate::capture::{self, Settings};
use crate::compile::{self, CompiledModel, compile};
use crate::ensemble::train::{self, Outputs, train};
use crate::ensemble::{Ensemble, StatedProbe, TouchOrigin};
use crate::evaluate::{Candidate, Margins, SequentialSettings, parity};
use crate::mesh::{Mesh, Object};
use crate::teach;
use crate::touches::{Dataset, ObjectTouches, Origin, Source, Surroundings};
use crate::tune;
use palpate_shared::Descriptor;

/// Touches of two objects that lie in several ways and of one that lies in one.
fn touched(seed: u64, touches: u64) -> Dataset {
    in_scene(Surroundings::Table { cone: 60.0 }, seed, touches)
}

fn in_scene(scene: Surroundings, seed: u64, touches: u64) -> Dataset {
    let shapes = [("brick", [1.0, 0.6, 0.3]), ("disc", [1.0, 1.0, 0.2]), ("rod", [1.0, 0.3, 0.3])];
    let objects = shapes.map(|(name, sides)| Object::new(name, Mesh::globe(12).stretched(sides)));
    let origin = Origin { touches, seed, scene, approaches: true, pose: true, ..Origin::default() };
    capture::in_memory(&objects, &Settings { origin, ..Settings::default() }, &()).unwrap().0
}

fn trained(outputs: Outputs) -> Ensemble {
    let dataset = touched(1, 12_000);
    let probe = StatedProbe::of(&dataset);
    let descriptor = Descriptor::Gravity;
    let settings = train::Settings { descriptor, rounds: 12, outputs, probe, ..train::Settings::compact() };
    train(&dataset, &settings, &()).unwrap()
}

fn compiled(ensemble: &Ensemble) -> CompiledModel {
    let bytes = compile(ensemble, &compile::Settings::default()).unwrap().bytes;
    CompiledModel::from_bytes(bytes).unwrap()
}

#[test]
fn outputs_are_placements_of_objects_with_their_weights_as_priors() {
    let dataset = touched(1, 12_000);
    let shares = dataset.placement_shares();
    assert!(shares.len() > 3, "{shares:?}");
    let ensemble = trained(Outputs::Placements);
    assert_eq!(ensemble.objects, shares.keys().cloned().collect::<Vec<_>>());
    assert_eq!(TouchOrigin::of(&ensemble.origin).unwrap().placements, shares);
    let compiled = compiled(&ensemble);
    let model = compiled.model();
    let outputs = model.outputs().unwrap();
    for (output, (name, share)) in shares.iter().enumerate() {
        let object = name.split('/').next().unwrap();
        let expected = ["brick", "disc", "rod"].iter().position(|own| *own == object).unwrap();
        assert_eq!(outputs.object(output), Some(expected as u8), "{name}");
        assert!((f64::from(outputs.share(output)) / 65_536.0 - share).abs() < 1e-4);
        let prior = (f64::from(model.prior(output)) * f64::from(model.unit())).exp();
        let most = shares.values().copied().fold(0.0, f64::max);
        assert!((prior - share / most).abs() < 1e-3, "{name}: {prior} for {share}");
    }
    let single = self::compiled(&trained(Outputs::Objects));
    assert_eq!(single.names(), ["brick", "disc", "rod"]);
    assert!(single.model().outputs().is_none());
}

#[test]
fn touches_of_another_scene_are_refused_by_ensembles_and_models() {
    let ensemble = trained(Outputs::Objects);
    let compiled = compiled(&ensemble);
    let model = compiled.model();
    assert_eq!(model.probe().unwrap().cone, 6_000);
    for (scene, expected) in [
        (Surroundings::Floating, "scene table with approaches within 60 degrees of straight down and floating"),
        (Surroundings::Table { cone: 30.0 }, "and table with approaches within 30 degrees of straight down"),
    ] {
        let other = in_scene(scene, 3, 200);
        for candidate in [Candidate::Full(&ensemble), Candidate::Compiled(&model)] {
            let refused = Margins::new(candidate, &other).err().expect("refused").to_string();
            assert!(refused.contains(expected), "{refused}");
        }
        let refused = calibrate(&model, other, &calibrate::Settings::default(), &()).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    }
    assert!(Margins::new(Candidate::Compiled(&model), &touched(3, 200)).is_ok());
}

#[test]
fn names_are_of_objects_and_placements_are_named_beside_them() {
    let ensemble = trained(Outputs::Placements);
    let compiled = compiled(&ensemble);
    let model = compiled.model();
    let tested = touched(3, 20_000);
    let by_output = tested.clone().matching(&compiled.names());
    let settings = SequentialSettings { error_rate: Some(0.01), max_touches: Some(200), sequences: 300, seed: 1 };
    let full = Margins::new(Candidate::Full(&ensemble), &by_output).unwrap().sequential(&settings).unwrap();
    let onboard = Margins::new(Candidate::Compiled(&model), &by_output).unwrap().sequential(&settings).unwrap();
    for found in [&full, &onboard] {
        assert!(found.error < 0.05 && found.undecided < 0.5, "{found:?}");
        let placement = found.placement.unwrap();
        assert!(placement > 0.4, "{placement}");
    }
    let parity = parity::parity(&ensemble, &model, &by_output, 300, 1, &()).unwrap();
    assert_eq!((parity.verdict_differs, parity.touches_differ), (0, 0));
    // A model of objects takes the same touches as they are.
    let single = self::compiled(&trained(Outputs::Objects));
    let names = single.names();
    assert_eq!(tested.matching(&names).names(), names);
}

#[test]
fn a_tuned_model_has_an_output_for_each_placement() {
    let dataset = touched(1, 1_500);
    let settings =
        tune::Settings { descriptor: Descriptor::Gravity, max_bytes: Some(24 << 10), groups: 60, ..Default::default() };
    // Threads of its own: a worker that waits takes up other tests' work, and its stack does not hold many of them.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).stack_size(16 << 20).build().unwrap();
    let tuned = pool.install(|| tune::tune(&dataset, &settings, &())).unwrap();
    assert_eq!(tuned.ensemble.objects, dataset.placement_shares().into_keys().collect::<Vec<_>>());
    let model = compile::open(&tuned.model).unwrap();
    assert_eq!(model.outputs().unwrap().most(), 2);
}

#[test]
fn a_promise_of_each_placement_is_kept_on_fresh_touches_whatever_their_shares() {
    let compiled = compiled(&trained(Outputs::Placements));
    let model = compiled.model();
    let dataset = touched(2, 60_000).matching(&compiled.names());
    let settings = |per| calibrate::Settings { rate: 0.05, per, sequences: 4_000, ..Default::default() };
    let refused = calibrate(&model, dataset.clone(), &settings(Per::Name), &()).unwrap_err();
    assert!(refused.to_string().contains("several outputs"), "{refused}");
    let calibrated = calibrate(&model, dataset, &settings(Per::Object), &()).unwrap();
    let kept = compile::open(&calibrated.model).unwrap();
    let fresh = touched(4, 60_000).matching(&compiled.names());
    let margins = Margins::new(Candidate::Compiled(&kept), &fresh).unwrap();
    let settings = SequentialSettings { error_rate: None, max_touches: None, sequences: 2_000, seed: 1 };
    let found = margins.sequential(&settings).unwrap();
    for (placement, wrong) in &found.error_of_given_per_object {
        // Two standard errors of 2,000 sequences above the promise.
        assert!(*wrong < 0.05 + 2.0 * (0.05_f64 * 0.95 / 2_000.0).sqrt(), "{placement}: {wrong}");
    }
}

#[test]
fn a_taught_object_has_one_output_unless_its_recordings_name_placements() {
    let dataset = touched(1, 4_000);
    let known = dataset.only(|name| name != "brick");
    let settings = train::Settings {
        descriptor: Descriptor::Gravity,
        rounds: 8,
        multi_output: true,
        ..train::Settings::compact()
    };
    let ensemble = train(&known, &settings, &()).unwrap();
    let new = touched(5, 1_200).only(|name| name == "brick");
    let mut plain = new.clone();
    plain.objects[0] = ObjectTouches::new("brick", new.objects[0].touches().to_vec(), Source::Object);
    let how = teach::Settings { groups: 40, ..teach::Settings::default() };
    for (recorded, added) in [(new, ["brick/+z", "brick/-y"].as_slice()), (plain, &["brick"])] {
        let (taught, _) = teach::teach(&ensemble, &known, &recorded, &how, &()).unwrap();
        let expected: Vec<&str> = ensemble.objects.iter().map(String::as_str).chain(added.iter().copied()).collect();
        assert_eq!(taught.objects, expected);
        let compiled = compiled(&taught);
        let outputs = compiled.model().outputs().unwrap();
        let last = outputs.object(ensemble.objects.len() - 1).unwrap();
        for output in ensemble.objects.len()..taught.objects.len() {
            assert_eq!(outputs.object(output), Some(last + 1));
        }
        let shares = (ensemble.objects.len()..taught.objects.len()).map(|output| f64::from(outputs.share(output)));
        assert!((shares.sum::<f64>() / 65_536.0 - 1.0).abs() < 1e-4);
    }
}
