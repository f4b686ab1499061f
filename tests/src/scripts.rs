//! Models, touches and rows that the C header is compared on.

use crate::HOUSEHOLD;
use crate::replay::Script;
use crate::sections::with_sections;
use crate::sections::write_section;
use crate::vectors;
use palpate_onboard::Model;
use palpate_shared::format::{
    Limits, Link, MisfitTerms, ObjectMisfit, OddsByObject, OutputScale, Outputs, Plan, Position, Prediction,
    RowEvidence, Section, Sentinel, Shifts, Strangers, Tag, Temperature, Weights, f32_key,
};
use palpate_shared::{ContactTime, MISSING_FEATURE, Pose, Poses, Touch};
use rand::RngExt;
use rand::rngs::SmallRng;

const VECTORS: &str = include_str!("../../shared/vectors/vectors.txt");

/// The test vectors' models: every layout, type of leaf, and descriptor, and rows of features; and the real one.
///
/// # Panics
/// If a model is invalid.
pub fn models() -> Vec<Vec<u8>> {
    let words = VECTORS.lines().filter_map(|line| line.strip_prefix("model "));
    let models = words.map(|words| vectors::bytes(words.split(' ').next().expect("bytes")));
    let mut models: Vec<Vec<u8>> = models.collect();
    assert!(models.len() > 60, "{} models", models.len());
    models.push(HOUSEHOLD.to_vec());
    models
}

/// Objects that outputs belong to: some of one output, some of several.
fn outputs(outputs: usize, rng: &mut SmallRng) -> Vec<u8> {
    let mut number = 0;
    let objects: Vec<(u8, f64)> = (0..outputs)
        .map(|output| {
            number += u8::from(output > 0 && rng.random_bool(0.4));
            (number, rng.random_range(0.0..1.0))
        })
        .collect();
    let mut content = Vec::new();
    Outputs::write(objects.into_iter(), &mut |bytes| content.extend_from_slice(bytes));
    content
}

/// The model with sections that the header has to understand or to leave alone.
fn with_all_sections(bytes: &[u8], rng: &mut SmallRng) -> Vec<u8> {
    let model = Model::new(bytes).expect("a model");
    let objects = model.object_count();
    let odds: Vec<u8> = (0..objects).flat_map(|_| OddsByObject::to_bytes(rng.random_range(0..1 << 56))).collect();
    let poses = Poses::with_rolls(2).expect("rolls");
    let mut plan = Plan::header(poses).to_vec();
    plan.extend((0..Plan::pairs(objects) * usize::from(poses.count())).map(|_| rng.random::<u8>()));
    let temperature = Temperature::new(rng.random_range(0.1..10.0)).expect("a temperature");
    let mut sections = Vec::new();
    let mut put = |bytes: &[u8]| sections.extend_from_slice(bytes);
    let own = model.optional_sections().filter(|section| section.tag < Tag::Weights.code());
    own.for_each(|section| section.write(&mut put));
    if rng.random_bool(0.6) {
        write_section(Tag::Weights, true, &weights(rng), &mut put);
    }
    write_section(Tag::ThresholdsByObject, true, &odds, &mut put);
    let background = rng.random_bool(0.5) && objects > 1;
    if rng.random_bool(0.7) {
        write_section(Tag::Strangers, true, &strangers(objects, background, rng), &mut put);
    }
    if objects > 1 {
        write_section(Tag::Plan, false, &plan, &mut put);
    }
    write_section(Tag::Temperature, false, &temperature.to_bytes(), &mut put);
    let own = model.optional_sections().filter(|section| section.tag == Tag::SharedLeaves.code());
    own.for_each(|section| section.write(&mut put));
    if rng.random_bool(0.7) {
        let link = Link::ALL[rng.random_range(0..Link::ALL.len())];
        let scale = [1.0, 0.5, 4096.0, 0.7][rng.random_range(0..4)];
        let last_of_ties = rng.random_bool(0.5);
        let average = if last_of_ties { 1 } else { 7 };
        let prediction = Prediction { link, last_of_ties, scale, targets: false, average };
        let mut content = Vec::new();
        let count = if rng.random_bool(0.5) { objects } else { 0 };
        let own = (0..count).map(|_| OutputScale { scale, offset: rng.random_range(-1e6..1e6) });
        let scales: Vec<OutputScale> = own.collect();
        prediction.write(&scales, &mut |part| content.extend_from_slice(part));
        write_section(Tag::Prediction, scale != 1.0 || !scales.is_empty(), &content, &mut put);
    }
    if rng.random_bool(0.5) {
        let low = rng.random_range(-300..300);
        let sentinel = Sentinel { low, high: low + rng.random_range(0..100_000) };
        write_section(Tag::Sentinel, true, &sentinel.to_bytes(), &mut put);
    }
    if model.descriptor().is_none() && rng.random_bool(0.7) {
        write_section(Tag::RowEvidence, true, &row_evidence(rng), &mut put);
    }
    if rng.random_bool(0.5) {
        write_section(Tag::Outputs, true, &outputs(objects, rng), &mut put);
    }
    if model.descriptor().is_none() {
        if rng.random_bool(0.5) {
            write_section(Tag::Position, true, &position(model.feature_count(), rng).to_bytes(), &mut put);
        }
        if rng.random_bool(0.5) {
            write_section(Tag::Guard, true, &guard(model.feature_count(), rng), &mut put);
        }
    }
    Section { tag: 300, must_understand: false, content: b"later" }.write(&mut put);
    with_sections(bytes, &sections)
}

/// Weights by the number of touches, now and then up to the most.
fn weights(rng: &mut SmallRng) -> Vec<u8> {
    let mut content = Vec::new();
    let count = [1, 2, 7, 16, Weights::MOST][rng.random_range(0..5)];
    let weights: Vec<u32> = (0..count).map(|_| rng.random_range(1..=Weights::ONE)).collect();
    Weights::write(&weights, &mut |part| content.extend_from_slice(part));
    content
}

/// A table from margins to evidence, about margins that occur.
fn row_evidence(rng: &mut SmallRng) -> Vec<u8> {
    let mut content = Vec::new();
    let between = rng.random_range(0..=Shifts::MOST_BETWEEN);
    let dropped = rng.random_range(0..=Shifts::MOST_STEP - between);
    let scale = rng.random_range(0..=Shifts::MOST_SCALE - between);
    let mut values: Vec<u8> = (0..rng.random_range(2..=RowEvidence::MOST)).map(|_| rng.random()).collect();
    values.sort_unstable();
    let step = dropped + between;
    let start = -(1_i32 << rng.random_range(0..=30)).min(1 << rng.random_range(step..27).min(30));
    let shifts = Shifts { dropped, between, scale };
    RowEvidence::write(start, shifts, &values, &mut |part| content.extend_from_slice(part));
    content
}

/// The number of a row as any feature, in steps that now and then reach the largest number.
fn position(features: usize, rng: &mut SmallRng) -> Position {
    let step = [1, 1_000, rng.random_range(1..=i32::MAX)][rng.random_range(0..3)];
    Position { feature: rng.random_range(0..features) as u8, step }
}

/// Limits, in part of the features, that most rows keep and some do not.
fn guard(features: usize, rng: &mut SmallRng) -> Vec<u8> {
    let limits = |_| {
        // Of many features hardly a row would keep all.
        if !rng.random_bool((1.0 / features as f64).clamp(0.01, 0.5)) {
            return Limits::NONE;
        }
        let most = [i32::MAX, 1 << 30, f32_key(190.0), 150_000, 250][rng.random_range(0..5)];
        let low = if rng.random_bool(0.5) { i32::MIN } else { -most };
        Limits { low, high: most, may_miss: rng.random_bool(0.7), most_equal: rng.random_range(0..4) }
    };
    (0..features).map(limits).flat_map(Limits::to_bytes).collect()
}

/// A background, and mostly a misfit test, with limits that some touches pass and some do not.
fn strangers(objects: usize, background: bool, rng: &mut SmallRng) -> Vec<u8> {
    let has_test = rng.random_bool(0.8);
    let mut content = Strangers::header(background, has_test).to_vec();
    if !has_test {
        return content;
    }
    let rivals: u8 = rng.random_range(1..=16);
    let terms = MisfitTerms {
        rivals,
        first: rng.random_range(1..4),
        threshold: rng.random_range(-(1 << 20)..1 << 21),
        early: rng.random_range(0..1 << 20),
        halving: rng.random_range(0..u32::MAX),
        alarms: 10_000,
        sequences: 1_000,
        confidence: 950_000,
    };
    content.extend(terms.to_bytes());
    for _ in 0..objects - usize::from(background) {
        let shifts = [rng.random_range(0..12), rng.random_range(8..24), rng.random_range(8..24)];
        let own: Vec<u8> = (0..rivals).map(|_| rng.random_range(0..objects) as u8).collect();
        let count = usize::from(rivals);
        let numbers: Vec<i16> = (0..2 * count + count * (count + 1) / 2).map(|_| rng.random()).collect();
        let constant = rng.random_range(-100_000..100_000);
        ObjectMisfit::write(shifts, constant, &own, numbers.into_iter(), &mut |part| content.extend_from_slice(part));
    }
    content
}

/// A touch, now and then a partial one, or one at the limits of features.
fn touch(rng: &mut SmallRng) -> Touch {
    let common = rng.random_range(0..3) * 1_000_000_000;
    let mut time = || match rng.random_range(0..12) {
        0 => ContactTime::MISSING,
        1 => ContactTime::from_micros(common),
        2 => ContactTime::from_micros(rng.random_range(0..50)),
        3 => ContactTime::from_micros(rng.random_range(0..u32::MAX)),
        _ => ContactTime::from_micros(common + rng.random_range(0..150_000)),
    };
    let touch = Touch::new([time(), time(), time()]);
    if rng.random_bool(0.1) {
        return touch;
    }
    let mut vector = || {
        [(); 3].map(|()| match rng.random_range(0..5) {
            0 => 0,
            1 => i16::MIN,
            _ => rng.random_range(-32_767..=32_767),
        })
    };
    touch.with_pose(Pose { direction: vector(), alignment: vector() })
}

/// A row; of any length.
fn row(features: usize, rng: &mut SmallRng) -> Vec<i32> {
    let length = if rng.random_bool(0.95) { features } else { rng.random_range(0..=(features + 2).min(256)) };
    let value = |_| match rng.random_range(0..8) {
        0 => MISSING_FEATURE,
        1 => rng.random_range(i32::MIN..=i32::MAX),
        2 => rng.random_range(-300..300),
        3 => rng.random_range(-200_000..200_000),
        _ => f32_key(rng.random_range(-200.0..200.0_f32)),
    };
    (0..length).map(value).collect()
}

/// Touches, or rows, of a model that is open, and now and then what else there is to ask.
///
/// # Panics
/// If a model is invalid.
pub fn play(script: &mut Script<'_>, count: usize, rng: &mut SmallRng) {
    let model = *script.recognizer().model();
    let objects = model.object_count();
    // Of a model that says nothing about sequences, rows in them are the same.
    let in_sequences = if model.position().is_some() || model.guard().is_some() { 0.8 } else { 0.1 };
    let mut measured = Vec::new();
    for _ in 0..count {
        if model.descriptor().is_some() {
            script.touch(&touch(rng));
        } else if rng.random_bool(in_sequences) {
            // Now and then the same again, as of a sensor that is stuck.
            if measured.is_empty() || rng.random_bool(0.7) {
                measured = row(model.measured_count(), rng);
            }
            script.next_row(&measured);
        } else {
            script.row(&row(model.feature_count(), rng));
        }
        if rng.random_bool(0.3 / objects as f64) {
            script.posteriors();
        }
        if rng.random_bool(0.1 / objects as f64) {
            let margins: Vec<i32> =
                (0..rng.random_range(0..=objects)).map(|_| rng.random_range(-(1 << 30)..=1 << 30)).collect();
            script.margins(&margins);
        }
        if rng.random_bool(0.05) {
            script.reset();
        }
    }
}

/// Puts the checksum at the end right.
pub fn sealed(bytes: &mut [u8]) {
    if let Some((body, sum)) = bytes.split_last_chunk_mut() {
        *sum = palpate_shared::format::checksum(body).to_le_bytes();
    }
}

/// Models, and this many touches and rows in all.
///
/// # Panics
/// If a model is invalid.
pub fn script<'m>(models: &'m [Vec<u8>], touches: usize, rows: usize, rng: &mut SmallRng) -> Script<'m> {
    let is_touches = |bytes: &&Vec<u8>| bytes[12] != 255;
    let of_touches = models.iter().filter(is_touches).count();
    let mut script = Script::default();
    for bytes in models {
        assert!(script.open(bytes));
        script.names();
        script.posteriors();
        // What the other kind of model takes is refused.
        script.touch(&touch(rng));
        script.row(&[1, 2, 3]);
        script.next_row(&[1, 2, 3]);
        let (all, of) = if is_touches(&bytes) { (touches, of_touches) } else { (rows, models.len() - of_touches) };
        play(&mut script, all.div_ceil(of), rng);
    }
    script
}

/// Every model as it is and with all sections.
///
/// # Panics
/// If a model is invalid.
pub fn all_models(rng: &mut SmallRng) -> Vec<Vec<u8>> {
    let models = models();
    let stated: Vec<Vec<u8>> = models.iter().map(|bytes| with_all_sections(bytes, rng)).collect();
    [models, stated].concat()
}
