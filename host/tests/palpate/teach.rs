use crate::fixtures::*;
use crate::synthetic::{self, few_trees, to_teach};
use palpate::compile::{self, compile};
use palpate::ensemble::train::{train, train_with_background};
use palpate::ensemble::{self, compiled_trained_on};
use palpate::mesh::BACKGROUND;
use palpate::teach::{Settings, alone, teach};

/// Ensemble of the objects that [`to_teach`] gives to train on.
static TRAINED: LazyLock<Ensemble> = LazyLock::new(|| train(&to_teach(60)[0], &few_trees(), &()).unwrap());

fn few_groups() -> Settings {
    with!(Settings::default(), approaches = 30, groups = 100)
}

#[test]
fn a_taught_object_is_recognized_and_the_others_still_are() {
    let [known, recorded, unseen] = to_teach(300);
    let ensemble = &*TRAINED;
    let (extended, taught) = teach(ensemble, &known, &recorded, &few_groups(), &()).unwrap();
    let compiled = compile::exact(&extended).unwrap();
    let model = compiled.model();
    let figures = Margins::new(&model, &unseen).unwrap();
    let curve = figures.curve(30, 400, 1).unwrap();
    for (object, least) in [(0, 0.9), (1, 0.8), (2, 0.9)] {
        let accuracy = curve.object_accuracy(object, 30).value;
        assert!(accuracy > least, "object {object}: {accuracy}");
    }
    let [object] = &taught.objects[..] else { panic!("{taught:?}") };
    assert_eq!((object.name.as_str(), object.approaches, object.touches), ("object2", 300, 300));
    // What was said beforehand came true.
    assert!((object.recognized - curve.object_accuracy(2, 30).value).abs() < 0.08, "{taught:?}");
}

#[test]
fn the_values_of_known_objects_and_the_splits_do_not_change() {
    let [known, recorded, unseen] = to_teach(60);
    let ensemble = train(&known, &with!(few_trees(), leaf_bits = None), &()).unwrap();
    let settings = with!(few_groups(), leaf_bits = None);
    let (extended, _) = teach(&ensemble, &known, &recorded, &settings, &()).unwrap();
    assert_eq!(extended.objects, ["object0", "object1", "object2"]);
    for touch in unseen.touches() {
        assert_eq!(extended.margins(touch)[..2], ensemble.margins(touch));
    }
}

#[test]
fn threads_change_no_bit_and_seeds_do() {
    let [known, recorded, _] = to_teach(60);
    let ensemble = &*TRAINED;
    let with = |threads, seed| teach(ensemble, &known, &recorded, &with!(few_groups(), threads, seed), &()).unwrap();
    let one = with(Some(1), 1);
    assert_eq!(one, with(Some(3), 1));
    assert_eq!(one, with(None, 1));
    assert_ne!(one.0, with(None, 2).0);
}

#[test]
fn a_taught_ensemble_is_saved_loaded_and_compiled_without_error() {
    let [known, recorded, unseen] = to_teach(60);
    let ensemble = &*TRAINED;
    let (extended, _) = teach(ensemble, &known, &recorded, &few_groups(), &()).unwrap();
    let file = tempfile::NamedTempFile::new().unwrap();
    extended.save(file.path()).unwrap();
    assert_eq!(ensemble::load(file.path()).unwrap(), extended);
    let compiled = compile(&extended, &compile::Settings::default()).unwrap();
    assert_eq!(compiled.margin_error, 0.0);
    let compiled = CompiledModel::from_bytes(compiled.bytes).unwrap();
    assert_eq!(compiled_trained_on(&compiled, &recorded), ["object2"]);
    let model = compiled.model();
    for touch in unseen.objects.iter().flat_map(|object| object.touches().iter().take(200)) {
        let mut margins = [0; 3];
        model.margins(touch, &mut margins);
        assert_eq!(extended.margins(touch), margins.map(|units| units as f32 * model.unit()));
    }
}

#[test]
fn a_background_stays_the_last_and_is_no_name() {
    let [known, recorded, _] = to_teach(60);
    let shapes = synthetic::dataset(&[500; 6], 3);
    let ensemble = train_with_background(&known, &shapes, &few_trees(), &()).unwrap();
    let mut all = known.clone();
    all.objects.push(ObjectTouches::joined(BACKGROUND, &shapes.objects));
    let (extended, _) = teach(&ensemble, &all, &recorded, &few_groups(), &()).unwrap();
    assert_eq!(extended.objects, ["object0", "object1", "object2", BACKGROUND]);
    assert_eq!(extended.known_count(), 3);
    // Without the background's touches there is nothing to compare with.
    let error = teach(&ensemble, &known, &recorded, &few_groups(), &()).unwrap_err();
    assert_eq!(error.what(), format!("there are no touches of {BACKGROUND}, which the ensemble knows"));
}

/// Asserts that recorded objects cannot be taught, for this reason.
fn refused(ensemble: &Ensemble, known: &Dataset, recorded: &Dataset, reason: &str) {
    let error = teach(ensemble, known, recorded, &few_groups(), &()).unwrap_err();
    assert!(error.what().starts_with(reason), "{error}");
}

#[test]
fn what_cannot_be_taught_says_why() {
    let [known, recorded, _] = to_teach(60);
    let ensemble = &*TRAINED;
    let one_value = train(&known, &with!(few_trees(), multi_output = false), &()).unwrap();
    refused(&one_value, &known, &recorded, "a leaf of the ensemble holds one value");
    let mut renamed = recorded.clone();
    renamed.objects[0].name = "object1".into();
    refused(ensemble, &known, &renamed, "object1 is known already");
    let first = known.only(|name| name == "object0");
    refused(ensemble, &first, &recorded, "there are no touches of object1, which the ensemble knows");
    refused(ensemble, &known, &Dataset::default(), "there are no recorded touches");
    let mut few = recorded.clone();
    few.objects[0] = few.objects[0].part(0..19, few.objects[0].len());
    let too_few = "only 19 recorded touches of object2 are evidence, and at least 20 are needed";
    refused(ensemble, &known, &few, too_few);
    let mut full = recorded.clone();
    full.objects[0] = filtered(&full.objects[0], Touch::is_full);
    let only_full = "only full touches were recorded, but the model takes every touch with a contact as evidence";
    refused(ensemble, &known, &full, only_full);
    let groups = with!(few_groups(), groups = 0);
    let error = teach(ensemble, &known, &recorded, &groups, &()).unwrap_err();
    assert_eq!(error.exit_code(), 2);
}

#[test]
fn another_probe_and_a_missing_pose_are_refused() {
    let [mut known, mut recorded, _] = to_teach(60);
    let with_pose = |dataset: &mut Dataset| {
        let pose = Pose { direction: [0, 0, Q15_ONE], alignment: [Q15_ONE, 0, 0] };
        *dataset = dataset.each(|object| changed(object, |touch| touch.with_pose(pose)));
    };
    let origin = |spacing| {
        let probe = with!(Probe::default(), spacing);
        Some(Origin { probe, approaches: true, ..Default::default() })
    };
    with_pose(&mut known);
    known.origin = origin(1.5);
    let settings = with!(few_trees(), descriptor = Descriptor::Oriented);
    let probe = StatedProbe::of(&known);
    let ensemble = train(&known, &with!(settings, probe), &()).unwrap();
    let descriptor = Descriptor::ContactsOriented.name();
    let no_pose = format!("touches of object2 have no pose, which the descriptor {descriptor} needs");
    refused(&ensemble, &known, &recorded, &no_pose);
    with_pose(&mut recorded);
    teach(&ensemble, &known, &recorded, &few_groups(), &()).unwrap();
    recorded.origin = origin(2.0);
    let different = teach(&ensemble, &known, &recorded, &few_groups(), &()).unwrap_err();
    assert!(different.to_string().contains("spacing 1.5 and 2"), "{different}");
}

#[test]
fn recorded_touches_alone_make_an_ensemble_that_states_them() {
    let recorded = synthetic::dataset(&[150, 150], 1);
    let unseen = synthetic::dataset(&[2_000, 2_000], 2);
    let (ensemble, taught) = alone(&recorded, &few_trees(), &few_groups(), &()).unwrap();
    let compiled = compile::exact(&ensemble).unwrap();
    let model = compiled.model();
    let margins = Margins::new(&model, &unseen).unwrap();
    let accuracy = margins.curve(20, 300, 1).unwrap().accuracy(20).value;
    assert!(accuracy > 0.85, "{accuracy}");
    let bytes = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
    assert_eq!(compiled_trained_on(&CompiledModel::from_bytes(bytes).unwrap(), &recorded).len(), 2);
    assert!(TouchOrigin::of(&ensemble.origin).unwrap().noise.is_none() && taught.others.is_none());
    let again = alone(&recorded, &few_trees(), &with!(few_groups(), threads = Some(1)), &()).unwrap();
    assert_eq!(again, (ensemble, taught));
    let few = synthetic::dataset(&[150, 10], 1);
    let error = alone(&few, &few_trees(), &few_groups(), &()).unwrap_err();
    assert!(error.to_string().contains("only 10 recorded touches of object1"), "{error}");
}
