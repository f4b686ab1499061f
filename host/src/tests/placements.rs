//! Models with an output for each placement of objects on a table.

use crate::calibrate::{self, Per, calibrate, calibrate_recorded};
use crate::capture::{self, Settings};
use crate::compile::{self, CompiledModel, compile};
use crate::ensemble::train::{self, Outputs, train};
use crate::ensemble::{Ensemble, StatedProbe, TouchOrigin};
use crate::evaluate::{Margins, SequentialSettings, parity};
use crate::mesh::{Mesh, Object};
use crate::teach;
use crate::touches::{Dataset, ObjectTouches, Origin, Recorded, Source, Surroundings};
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
fn touches_of_another_scene_are_refused() {
    let ensemble = trained(Outputs::Objects);
    let compiled = compiled(&ensemble);
    let model = compiled.model();
    assert_eq!(model.probe().unwrap().cone, 6_000);
    for (scene, expected) in [
        (Surroundings::Floating, "scene table with approaches within 60 degrees of straight down and floating"),
        (Surroundings::Table { cone: 30.0 }, "and table with approaches within 30 degrees of straight down"),
    ] {
        let other = in_scene(scene, 3, 200);
        let refused = Margins::new(&model, &other).err().expect("refused").to_string();
        assert!(refused.contains(expected), "{refused}");
        let refused = calibrate(&model, other, &calibrate::Settings::default(), &()).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    }
    assert!(Margins::new(&model, &touched(3, 200)).is_ok());
}

#[test]
fn names_are_of_objects_and_placements_are_named_beside_them() {
    let ensemble = trained(Outputs::Placements);
    let compiled = compiled(&ensemble);
    let model = compiled.model();
    let tested = touched(3, 20_000);
    let by_output = tested.clone().matching(&compiled.names());
    let settings = SequentialSettings { error_rate: Some(0.01), max_touches: Some(200), sequences: 300, seed: 1 };
    let found = Margins::new(&model, &by_output).unwrap().sequential(&settings).unwrap();
    assert!(found.error < 0.05 && found.undecided < 0.5, "{found:?}");
    let placement = found.placement.unwrap();
    assert!(placement > 0.4, "{placement}");
    let parity = parity::parity(&ensemble, &model, &by_output, 300, 1, &()).unwrap();
    assert_eq!((parity.verdict_differs, parity.touches_differ), (0, 0));
    // A model of objects takes the same touches as they are.
    let single = self::compiled(&trained(Outputs::Objects));
    let names = single.names();
    assert_eq!(tested.matching(&names).names(), names);
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
    let margins = Margins::new(&kept, &fresh).unwrap();
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

/// Touches as a robot's recordings: of each placement one that states it, or of each object one that states none, in
/// which placements have their shares.
fn recorded(dataset: &Dataset, is_stated: bool) -> Dataset {
    let one = |own: &ObjectTouches| {
        let began = |number: usize| format!("2026-11-22T{:02}:00:00Z", 10 + number);
        let recording = |number: usize, placement: Option<String>| {
            Source::Recording(Recorded { began: began(number), placement, ..Recorded::default() })
        };
        if !is_stated {
            return ObjectTouches::new(&own.name, own.as_often_as_placed().touches().to_vec(), recording(0, None));
        }
        let parts = own.pools().iter().enumerate().map(|(number, pool)| {
            let placement = pool.source.placement().map(str::to_owned);
            (recording(number, placement), None, own.of_pool(pool).to_vec())
        });
        ObjectTouches::of_parts(&own.name, parts)
    };
    let probe = dataset.probe().copied().unwrap_or_default();
    let origin = Origin::recorded(probe, palpate_shared::format::Length::Tenth, true);
    Dataset { origin: Some(origin), ..Dataset::new(dataset.objects.iter().map(one).collect()) }
}

#[test]
fn recordings_of_an_object_are_of_all_of_its_placements_unless_they_state_one() {
    let ensemble = trained(Outputs::Placements);
    let compiled = compiled(&ensemble);
    let model = compiled.model();
    let tested = touched(3, 12_000);
    let settings = SequentialSettings { error_rate: Some(0.01), max_touches: Some(200), sequences: 300, seed: 1 };
    for is_stated in [true, false] {
        let recorded = recorded(&tested, is_stated).matching(&compiled.names());
        let expected = if is_stated { compiled.names() } else { vec!["brick".into(), "disc".into(), "rod".into()] };
        assert_eq!(recorded.names(), expected);
        let margins = Margins::new(&model, &recorded).unwrap();
        let found = margins.sequential(&settings).unwrap();
        assert!(found.error < 0.05 && found.undecided < 0.5, "{found:?}");
        // Which placement was touched is known of those that state it.
        assert_eq!(found.placement.is_some(), is_stated);
        let all: f64 = (0..expected.len()).map(|position| margins.frequency(position)).sum();
        let prior = |output| (f64::from(model.prior(output)) * f64::from(model.unit())).exp();
        let known: f64 = (0..compiled.names().len()).map(prior).sum();
        assert!((all / known - 1.0).abs() < 1e-3, "{all} {known}");
        // Named is what the model says, not what stands for the object.
        let confusion = margins.confusion(20, 200, 1).unwrap();
        let brick = confusion[0].iter().filter(|count| **count > 0).count();
        assert!(is_stated || brick > 1, "{confusion:?}");
    }
    // Each object expected or not, whatever its placement.
    let recorded = recorded(&tested, false);
    let only = |weights: Vec<u32>| {
        let margins = Margins::new(&model, &recorded).unwrap().expecting(weights).unwrap();
        margins.tested_names.clone()
    };
    let of = |object: &str| compiled.names().iter().map(|name| u32::from(name.starts_with(object))).collect();
    assert_eq!(only(of("disc")), ["disc"]);
}

#[test]
fn a_placement_that_the_model_does_not_know_is_named_with_those_that_it_does() {
    let compiled = compiled(&trained(Outputs::Placements));
    let model = compiled.model();
    let mut tested = recorded(&touched(3, 600), true);
    let lying = tested.objects[0].pools()[0].source.clone();
    let Source::Recording(lying) = lying else { panic!("{lying:?}") };
    let other = Recorded { placement: Some("+q".into()), ..lying };
    tested.objects[0] = ObjectTouches::new("brick", tested.objects[0].touches().to_vec(), Source::Recording(other));
    let error = Margins::new(&model, &tested.matching(&compiled.names())).err().unwrap();
    let text = error.to_string();
    assert!(text.contains("does not know the object brick/+q, only brick/") && !text.contains("rod"), "{text}");
    assert!(text.contains("--object OBJECT"), "{text}");
    // Of an object that it does not know at all, the objects.
    let mut unknown = recorded(&touched(3, 600), false);
    unknown.objects[2] = unknown.objects[2].clone().renamed("vase");
    let error = Margins::new(&model, &unknown).err().unwrap().to_string();
    assert!(error.contains("the object vase, only brick, disc, rod."), "{error}");
}

#[test]
fn an_object_that_is_known_in_any_placement_is_no_stranger() {
    let compiled = compiled(&trained(Outputs::Placements));
    let model = compiled.model();
    let strangers = touched(3, 600).only(|name| name == "rod");
    let refused = Margins::of_strangers(&model, &strangers).err().unwrap();
    assert_eq!(refused.what(), "the model knows the object rod, so it is not a stranger");
}

#[test]
fn recordings_that_state_placements_are_refused_by_models_of_floating_objects() {
    let dataset = in_scene(Surroundings::Floating, 1, 3_000);
    let recipe = train::Settings {
        descriptor: Descriptor::Gravity,
        rounds: 4,
        probe: StatedProbe::of(&dataset),
        ..train::Settings::compact()
    };
    let ensemble = train(&dataset, &recipe, &()).unwrap();
    let touched = touched(3, 600);
    let compiled = compile::exact(&ensemble).unwrap();
    let model = compiled.model();
    let error = Margins::new(&model, &recorded(&touched, true)).err().unwrap();
    assert!(error.to_string().contains("state different probes: scene floating and table"), "{error}");
    assert!(Margins::new(&model, &recorded(&touched, false)).is_ok(), "nothing says where they are from");
}

#[test]
fn a_promise_for_a_table_is_tested_on_recordings_with_and_without_placements() {
    let compiled = compiled(&trained(Outputs::Placements));
    let model = compiled.model();
    let simulated = touched(2, 30_000).matching(&compiled.names());
    let of_robot = touched(5, 6_000);
    let settings = calibrate::Settings { rate: 0.1, sequences: 3_000, max_touches: Some(150), ..Default::default() };
    for is_stated in [true, false] {
        let recorded = recorded(&of_robot, is_stated).matching(&compiled.names());
        let calibrated = calibrate_recorded(&model, simulated.clone(), &recorded, &settings, &()).unwrap();
        assert!(calibrated.promise.given > 30, "{:?}", calibrated.promise);
        assert_eq!(calibrated.objects.keys().cloned().collect::<Vec<_>>(), recorded.names());
        let named: u64 = calibrated.objects.values().map(|of| of.named).sum();
        assert_eq!(named, u64::from(calibrated.promise.given), "each name is of one object");
        let per = |per| {
            let settings = calibrate::Settings { per, rate: 0.4, ..settings.clone() };
            calibrate_recorded(&model, simulated.clone(), &recorded, &settings, &())
        };
        assert!(per(Per::Name).unwrap_err().to_string().contains("several outputs"));
        match per(Per::Object) {
            Err(error) if !is_stated => assert!(error.to_string().contains("those of brick state none"), "{error}"),
            // Where placements are stated, they are what is counted and named.
            Err(error) => {
                let name =
                    error.what().split_once(" names given for ").and_then(|(_, name)| name.split_once(" on the "));
                assert!(name.is_some_and(|(name, _)| name.contains('/')), "{error}");
            }
            Ok(calibrated) => assert!(is_stated && calibrated.objects.keys().all(|name| name.contains('/'))),
        }
        // Too few: the advice is of what was recorded.
        let few = recorded.each(|own| own.part(0..40, own.len()));
        let error = calibrate_recorded(&model, simulated.clone(), &few, &settings, &()).unwrap_err().to_string();
        assert!(
            error.contains(if is_stated { "to brick/" } else { "to brick" }) || error.contains(" to disc"),
            "{error}"
        );
        assert!(is_stated || !error.contains("/+z"), "{error}");
    }
    let mut partly = recorded(&of_robot, true).matching(&compiled.names());
    let left_out = partly.objects.remove(0).name;
    let error = calibrate_recorded(&model, simulated, &partly, &settings, &()).unwrap_err();
    assert_eq!(error.what(), format!("nothing is recorded of {left_out}"));
    assert!(error.to_string().contains("--object OBJECT where the robot does not know"), "{error}");
}
