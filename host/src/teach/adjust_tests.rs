use super::*;
use crate::compile::{self, CompiledModel};
use crate::ensemble::train::{self, train};
use crate::ensemble::{OverTouches, compiled_trained_on};
use crate::error::TeachProblem;
use crate::evaluate::{Candidate, Margins};
use crate::tests::synthetic;
use crate::with;

fn quick() -> train::Settings {
    train::Settings { rounds: 8, depth: 4, min_child_weight: 5.0, ..train::Settings::compact() }
}

fn few_groups() -> Settings {
    Settings { approaches: 30, groups: 100, ..Settings::default() }
}

/// Touches of a robot that the simulation knows nothing about: it is faster, and its contacts are noisy.
fn of_robot(counts: &[usize], seed: u64) -> Dataset {
    let mut dataset = synthetic::dataset(counts, seed);
    dataset.add_noise(&with!(Noise::gaussian(15_000.0), speed = 1.5), seed, 1);
    dataset
}

fn accuracy(ensemble: &Ensemble, touches: &Dataset) -> f64 {
    Margins::new(Candidate::Full(ensemble), touches).unwrap().curve(20, 500, 1).unwrap().accuracy(20).value
}

#[test]
fn a_model_adjusted_to_recordings_is_better_on_other_touches_of_the_robot() {
    let ensemble = train(&synthetic::dataset(&[3_000; 3], 1), &quick(), &()).unwrap();
    let unseen = of_robot(&[4_000; 3], 9);
    let (changed, adjusted) =
        adjust(&ensemble, &Dataset::default(), &of_robot(&[300; 3], 2), &few_groups(), &()).unwrap();
    assert!(adjusted.is_better && adjusted.adjusted.recognized > adjusted.given.recognized, "{adjusted:?}");
    assert!(adjusted.prior.is_some() && adjusted.adjusted.loss < adjusted.given.loss, "{adjusted:?}");
    let [before, after] = [&ensemble, &changed].map(|ensemble| accuracy(ensemble, &unseen));
    assert!(after > before + 0.03, "{before} {after}");
    // What was said beforehand came true.
    let said = adjusted.adjusted.recognized;
    assert!((said - after).abs() < 0.08, "{said} {after}");
}

#[test]
fn a_model_that_recordings_do_not_improve_stays_as_it_was_given() {
    let ensemble = train(&synthetic::dataset(&[20_000; 3], 1), &quick(), &()).unwrap();
    let unseen = synthetic::dataset(&[8_000; 3], 9);
    let mut kept = 0;
    for seed in 2..10 {
        let recorded = synthetic::dataset(&[200; 3], seed);
        let (changed, adjusted) = adjust(&ensemble, &Dataset::default(), &recorded, &few_groups(), &()).unwrap();
        assert_eq!(adjusted.is_better, changed != ensemble);
        kept += usize::from(!adjusted.is_better);
        let [before, after] = [&ensemble, &changed].map(|ensemble| accuracy(ensemble, &unseen));
        assert!(after > before - 0.02, "{before} {after} {adjusted:?}");
    }
    assert!(kept > 0, "recordings like the simulation improved it always");
}

#[test]
fn objects_without_recordings_keep_their_values_and_all_keep_their_splits() {
    let known = synthetic::dataset(&[3_000; 3], 1);
    let ensemble = train(&known, &train::Settings { leaf_bits: None, ..quick() }, &()).unwrap();
    let recorded = of_robot(&[300; 3], 2).only(|name| name != "object1");
    let settings = Settings { leaf_bits: None, ..few_groups() };
    let (changed, adjusted) = adjust(&ensemble, &known, &recorded, &settings, &()).unwrap();
    assert!(adjusted.is_better, "{adjusted:?}");
    assert_eq!(adjusted.objects.iter().map(|of| of.name.as_str()).collect::<Vec<_>>(), ["object0", "object2"]);
    let mut others = 0;
    for touch in synthetic::dataset(&[300; 3], 4).touches() {
        let [before, after] = [&ensemble, &changed].map(|ensemble| ensemble.margins(touch));
        assert_eq!(before[1], after[1]);
        others += usize::from(before[0] != after[0] && before[2] != after[2]);
    }
    assert!(others > 500, "{others}");
}

#[test]
fn recorded_touches_are_known_again_after_adjusting_and_after_compiling() {
    let known = synthetic::dataset(&[3_000; 3], 1);
    let ensemble = train(&known, &quick(), &()).unwrap();
    let recorded = of_robot(&[300; 3], 2);
    let (changed, adjusted) = adjust(&ensemble, &known, &recorded, &few_groups(), &()).unwrap();
    assert!(adjusted.is_better);
    let stated = TouchOrigin::of(&changed.origin).unwrap();
    assert_eq!(stated.trained_on(&recorded).len(), 3);
    assert_eq!(stated.trained_on(&known).len(), 3);
    assert!(stated.trained_on(&of_robot(&[300; 3], 3)).is_empty());
    let bytes = compile::compile(&changed, &compile::Settings::default()).unwrap().bytes;
    let compiled = CompiledModel::from_bytes(bytes).unwrap();
    assert_eq!(compiled_trained_on(&compiled, &recorded).len(), 3);
    assert_eq!(compiled_trained_on(&compiled, &known).len(), 3);
    assert!(compiled_trained_on(&compiled, &of_robot(&[300; 3], 3)).is_empty());
    let file = tempfile::NamedTempFile::new().unwrap();
    changed.save(file.path()).unwrap();
    assert_eq!(crate::ensemble::load(file.path()).unwrap(), changed);
}

#[test]
fn threads_change_no_bit_of_an_adjusted_model() {
    let known = synthetic::dataset(&[2_000; 3], 1);
    let ensemble = train(&known, &quick(), &()).unwrap();
    let recorded = of_robot(&[100; 3], 2);
    let with = |threads| adjust(&ensemble, &known, &recorded, &Settings { threads, ..few_groups() }, &()).unwrap();
    assert_eq!(with(Some(1)), with(Some(3)));
}

#[test]
fn a_model_that_cannot_be_adjusted_says_why() {
    let known = synthetic::dataset(&[2_000; 2], 1);
    let ensemble = train(&known, &quick(), &()).unwrap();
    let problem = |known: &Dataset, recorded: &Dataset| {
        adjust(&ensemble, known, recorded, &few_groups(), &()).unwrap_err().problem::<TeachProblem>().cloned().unwrap()
    };
    let three = synthetic::dataset(&[100; 3], 2);
    assert_eq!(problem(&known, &three), TeachProblem::NotKnown { object: "object2".into() });
    let one = three.only(|name| name == "object0");
    let missing = TeachProblem::Missing { objects: vec!["object1".into()] };
    assert_eq!(problem(&Dataset::default(), &one), missing);
    let few = synthetic::dataset(&[10, 100], 2);
    assert_eq!(problem(&known, &few), TeachProblem::TooFew { object: "object0".into(), touches: 10, least: LEAST });
    assert_eq!(problem(&known, &Dataset::default()), TeachProblem::Nothing);
}
