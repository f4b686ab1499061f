//! Proposals of the next approach, and the weight of recent touches against the evidence.

use palpate::compile::{Leaf, Restated, restate};
use palpate_onboard::station::{NoStorage, Station, serve};
use palpate_onboard::{Model, Proposal, Recognizer, Stopping};
use palpate_shared::format::{Plan, Tag};
use palpate_shared::link::{ApproachMessage, Device, POSE_BYTES, Refusal, Request};
use palpate_shared::{Descriptor, Poses};
use palpate_tests::desk::{Desk, OBJECTS, Step, push};
use palpate_tests::random::{self, Shape};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

fn model(objects: usize) -> Vec<u8> {
    let descriptor = Descriptor::ContactsOriented;
    let shape = Shape { descriptor, objects, trees: 8, depth: 4, thresholds: 100, leaf: 0.1, ..Shape::SMALL };
    random::model(shape, 1, Leaf::I16)
}

/// The model with a plan of random separations; every pose whose number is 3 modulo 10 never touches.
fn planned(model: &[u8], rolls: u8, seed: u64) -> Vec<u8> {
    let mut rng = SmallRng::seed_from_u64(seed);
    let poses = Poses::with_rolls(rolls).unwrap();
    let model = Model::new(model).unwrap();
    let mut content = Plan::header(poses).to_vec();
    for _ in 0..Plan::pairs(model.object_count()) {
        content.extend((0..poses.count()).map(|pose| match pose % 10 {
            3 => Plan::UNTOUCHED.cast_unsigned(),
            _ => rng.random_range(-127..=127_i8).cast_unsigned(),
        }));
    }
    with_section(&model, content)
}

fn with_section(model: &Model<'_>, content: Vec<u8>) -> Vec<u8> {
    let sections = vec![(Tag::Plan, Some((false, content)))];
    restate(model, &Restated { sections, ..Restated::default() }).unwrap()
}

fn recognizer<'m, const N: usize>(model: &Model<'m>) -> Recognizer<'m, N> {
    Recognizer::new(model, Stopping::new(1e-15, u32::MAX).unwrap()).unwrap()
}

/// The mean separation of each pose, the others weighted by their posteriors, in f64.
fn scores<const N: usize>(recognizer: &Recognizer<'_, N>) -> Vec<f64> {
    let model = recognizer.model();
    let (plan, evidence) = (model.plan().unwrap(), recognizer.evidence());
    let leader = recognizer.best();
    let others = || (0..evidence.len()).filter(|&object| object != leader);
    let strongest = others().map(|object| evidence[object]).max().unwrap();
    let weight = |object: usize| ((evidence[object] - strongest) as f64 * f64::from(model.unit())).exp();
    let all: f64 = others().map(weight).sum();
    let score = |pose: usize| {
        let separation =
            |object: usize| f64::from(plan.separations(leader, object)[pose].cast_signed()) / 128.0 * weight(object);
        others().map(separation).sum::<f64>() / all
    };
    (0..usize::from(plan.poses().count())).map(score).collect()
}

#[test]
fn the_proposed_approach_is_the_best_of_the_candidates_by_posterior_weights() {
    for (objects, rolls) in [(2, 1), (3, 2), (10, 4), (200, 4)] {
        let bytes = planned(&model(objects), rolls, 7);
        let model = Model::new(&bytes).unwrap();
        let mut recognizer = recognizer::<256>(&model);
        let mut rng = SmallRng::seed_from_u64(3);
        for touch in random::touches(200, 5) {
            // Some of the touches have no pose or no contact: what is refused changes nothing.
            let _ = recognizer.push(&touch);
            let scores = scores(&recognizer);
            let candidates: Vec<u16> = (0..130).filter(|_| rng.random_bool(0.5)).collect();
            let may_touch = |pose: &u16| pose % 10 != 3 && usize::from(*pose) < scores.len();
            let best = candidates.iter().filter(|pose| may_touch(pose)).map(|&pose| scores[usize::from(pose)]);
            let best = best.fold(f64::NEG_INFINITY, f64::max);
            let Some(Proposal { index, pose, score }) = recognizer.next_approach(candidates.iter().copied()) else {
                assert_eq!(best, f64::NEG_INFINITY);
                continue;
            };
            assert!(may_touch(&pose) && candidates[index] == pose);
            // Weights are in Q15, and there are up to 255 of them.
            let tolerance = 1e-4 * objects as f64;
            assert!((f64::from(score) / 32_768.0 - scores[usize::from(pose)]).abs() < tolerance);
            assert!(scores[usize::from(pose)] > best - tolerance, "{pose}: {} of {best}", scores[usize::from(pose)]);
        }
    }
}

#[test]
fn without_a_plan_or_a_candidate_that_may_touch_nothing_is_proposed() {
    let bytes = model(5);
    let plain = Model::new(&bytes).unwrap();
    assert_eq!(recognizer::<5>(&plain).next_approach(0..104), None);
    let bytes = planned(&bytes, 4, 1);
    let with_plan = Model::new(&bytes).unwrap();
    let recognizer = recognizer::<5>(&with_plan);
    assert_eq!(recognizer.next_approach([]), None);
    assert_eq!(recognizer.next_approach([3, 13, 103, 104, u16::MAX]), None);
    assert_eq!(recognizer.next_approach([3, 104, 50]).map(|proposal| (proposal.index, proposal.pose)), Some((2, 50)));
    // Of several that are as good, the first.
    let flat = with_section(&plain, [&Plan::header(Poses::with_rolls(1).unwrap())[..], &[5; 260]].concat());
    let flat = Model::new(&flat).unwrap();
    let proposal = self::recognizer::<5>(&flat).next_approach([9, 2, 4]).unwrap();
    assert_eq!((proposal.index, proposal.pose, proposal.score), (0, 9, 5 * 256));
}

#[test]
fn evidence_beyond_every_limit_weighs_without_overflow() {
    let bytes = planned(&model(256), 4, 2);
    let model = Model::new(&bytes).unwrap();
    let mut recognizer = recognizer::<256>(&model);
    let mut margins = [i32::MIN; 256];
    for leader in [0, 255, 17] {
        margins.fill(i32::MIN);
        margins[leader] = i32::MAX;
        recognizer.reset();
        (0..3).for_each(|_| _ = recognizer.push_margins(&margins));
        // All others are level, and count alike.
        assert!(recognizer.next_approach(0..104).is_some());
    }
    let all = Plan::header(Poses::with_rolls(4).unwrap());
    let full = with_section(&model, all.into_iter().chain(std::iter::repeat_n(127, 104 * 256 * 255 / 2)).collect());
    let full = Model::new(&full).unwrap();
    assert_eq!(self::recognizer::<256>(&full).next_approach(0..104).map(|best| best.score), Some(127 * 256));
}

/// Answer of a chip, as the desk keeps it.
fn answered(approach: Result<ApproachMessage, Refusal>) -> String {
    approach.map_or_else(|refusal| format!("Refused({refusal:?})"), |approach| format!("NextApproach({approach:?})"))
}

#[test]
fn a_chip_proposes_over_the_link_what_the_hosts_recognizer_proposes() {
    let bytes = planned(&model(10), 4, 4);
    let host = Model::new(&bytes).unwrap();
    let mut mirror = Station::<OBJECTS>::new(&host);
    let mut without = [0; POSE_BYTES];
    let (mut script, mut expected) = (Vec::new(), Vec::new());
    for (number, touch) in random::touches(60, 9).iter().enumerate() {
        script.push(push(touch));
        let _ = mirror.push(touch, false);
        // Fewer and fewer poses can be reached, in the end none.
        without[number % POSE_BYTES] |= 0x1f << (number / POSE_BYTES);
        script.push(Step::Ask(Request::NextApproach { without }));
        expected.push(answered(mirror.next_approach(&without)));
    }
    script.push(Step::Ask(Request::NextApproach { without: [0xff; POSE_BYTES] }));
    expected.push(answered(Err(Refusal::NoPlan)));
    let mut desk = Desk::new(script, 0);
    serve::<OBJECTS, _, _>(&bytes, &mut NoStorage, 0, &mut desk).unwrap();
    assert_eq!(desk.answers, expected);
    let different: std::collections::BTreeSet<&String> = desk.answers.iter().collect();
    assert!(different.len() > 5, "{different:?}");
}

#[test]
fn a_chip_without_a_plan_refuses_to_propose() {
    let bytes = model(3);
    let mut desk = Desk::new([Step::Ask(Request::NextApproach { without: [0; POSE_BYTES] })], 0);
    serve::<OBJECTS, _, _>(&bytes, &mut NoStorage, 0, &mut desk).unwrap();
    assert_eq!(desk.answers, ["Refused(NoPlan)"]);
}
