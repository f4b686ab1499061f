//! Writes the test vectors of the model format, which `shared/vectors/README.md` describes:
//! `cargo run -p palpate-tests --bin vectors > shared/vectors/vectors.txt`.
//!
//! They are committed, and stay as they are: models that earlier releases made have to give the same. Write them again
//! only where something must be added.

use palpate::compile::{Layout, Leaf, Settings, compile};
use palpate::ensemble::Node;
use palpate::with;
use palpate_onboard::{Model, Recognizer, Refused, RowsSeen, Stopping, Verdict, exp2_negative};
use palpate_shared::format::{
    Counted, Limits, Outputs, PatternShares, Position, Sentinel, TrainedTouches, checksum, f32_key,
};
use palpate_shared::{ContactTime, Descriptor, MISSING_FEATURE, Patterns, Pose, Touch};
use palpate_tests::abuse::{self, changed, section};
use palpate_tests::random::{self, Shape};
use palpate_tests::sections::{Trained, trained, with_sections};
use palpate_tests::vectors::{hex, numbers, refusal, touch_words};
use palpate_tests::wide::widened;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

fn main() {
    let mut text = String::from("# See README.md.\nvectors 1\n");
    functions(&mut text);
    layouts(&mut text);
    descriptors(&mut text);
    sections(&mut text);
    rows(&mut text);
    sequences(&mut text);
    decisions(&mut text);
    shared_leaves(&mut text);
    together(&mut text);
    refused(&mut text);
    cut(&mut text);
    assert!(text.lines().all(|line| line.len() < 16_384), "a line is too long");
    print!("{text}");
}

/// Functions that are the same for every model.
fn functions(text: &mut String) {
    let mut put = |line: String| *text += &format!("{line}\n");
    for bytes in [&b"123456789"[..], b"PLPT", &[0], &[0xff; 32]] {
        put(format!("crc {} {:08x}", hex(bytes), checksum(bytes)));
    }
    let mut rng = SmallRng::seed_from_u64(1);
    let edges = [0, 1, 1 << 28, (1 << 28) - 1, (1 << 32) - 1, 1 << 32, (58 << 32) - 1, 58 << 32, 57 << 32, u64::MAX];
    let some = (0..60).map(|_| rng.random_range(0..20_u64 << 32));
    for exponent in edges.into_iter().chain(some) {
        put(format!("exp2 {exponent} {}", exp2_negative(exponent)));
    }
    let special = [0.0, -0.0, 1.0, -1.5, 1e-45, f32::MAX, f32::MIN, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    for value in special {
        let key = f32_key(value);
        put(format!("key {:08x} {}", value.to_bits(), numbers(&[key])));
    }
}

/// A shape of curvature.
const SHAPE: Shape =
    Shape { descriptor: Descriptor::Curvature, objects: 3, trees: 4, depth: 3, each: true, thresholds: 12, leaf: 1.0 };

/// Every approach counts.
const ALL: TrainedTouches =
    TrainedTouches { patterns: Patterns::ALL, counted: Counted::All, needs_pose: false, largest_spread: u32::MAX };

fn stated(model: &[u8], touches: TrainedTouches) -> Vec<u8> {
    trained(model, &Trained { touches: Some(touches), ..Trained::default() })
}

fn compiled(shape: Shape, seed: u64, leaf: Leaf, layout: Layout) -> Vec<u8> {
    in_layout(
        compile(&random::ensemble(shape, seed), &with!(Settings::default(), leaf)).expect("it fits").bytes,
        layout,
    )
}

/// A compact model with splits of six bytes, if that is the layout.
fn in_layout(bytes: Vec<u8>, layout: Layout) -> Vec<u8> {
    if layout == Layout::Wide { widened(&bytes) } else { bytes }
}

/// Touches that reach all over a model, and those at the limits of features.
fn touches(count: usize, seed: u64) -> Vec<Touch> {
    let limits = [
        [u32::MAX; 3],
        [0, 0, 0],
        [0, (1 << 28) + 1, u32::MAX - 1],
        [(1 << 24) + 5, 0, u32::MAX],
        [0, u32::MAX, 1 << 25],
    ];
    let limits = limits.map(|times| Touch::new(times.map(ContactTime::from_micros)));
    random::touches(count, seed).into_iter().chain(limits).collect()
}

/// A model, and its results for touches. After a decision one more touch, then a reset.
fn play(text: &mut String, name: &str, bytes: &[u8], touches: &[Touch]) {
    let model = Model::new(bytes).expect("a model");
    *text += &format!("model {} {name}\n", hex(bytes));
    if model.object_count() <= 4 {
        for object in 0..model.object_count() {
            *text += &format!("name {object} {}\n", model.object_name(object));
        }
    }
    let mut recognizer = Recognizer::<256>::new(&model, Stopping::from_model(&model)).expect("at most 256 objects");
    for touch in touches {
        let decided = recognizer.verdict() != Verdict::Undecided;
        *text += &format!("touch {}\n", touch_words(touch));
        match recognizer.push(touch) {
            Err(refused) => *text += &format!("refused {}\n", refusal(refused)),
            Ok(verdict) => {
                let features = model.descriptor().expect("it takes touches").features(touch);
                known(text, &model, &recognizer, features.as_slice(), verdict);
            }
        }
        if decided {
            recognizer.reset();
            *text += "reset\n";
        }
    }
}

/// State after a touch or a row.
fn known(text: &mut String, model: &Model<'_>, recognizer: &Recognizer<'_, 256>, features: &[i32], verdict: Verdict) {
    let mut sums = vec![0.0; model.object_count()];
    *text += &format!("features {}\n", numbers(features));
    if model.f32_margins_of(features, &mut sums) && sums.iter().all(|sum| sum.is_finite()) {
        let bits: Vec<String> = sums.iter().map(|sum| format!("{:08x}", sum.to_bits())).collect();
        *text += &format!("sums {}\n", bits.join(" "));
    }
    let mut margins = vec![0; model.object_count()];
    model.margins_of(features, &mut margins);
    let evidence: Vec<String> = recognizer.evidence().iter().map(i64::to_string).collect();
    *text += &format!("margins {}\nevidence {}\n", numbers(&margins), evidence.join(" "));
    *text += &match verdict {
        Verdict::Undecided => "verdict undecided\n".to_string(),
        Verdict::Recognized { object, touches, .. } => format!("verdict recognized {object} {touches}\n"),
        Verdict::Unknown => "verdict unknown\n".to_string(),
        Verdict::GaveUp => "verdict gave-up\n".to_string(),
    };
    // The leader's, and now and then the last one's.
    let last = recognizer.touches().is_multiple_of(3).then(|| model.object_count() - 1);
    for object in [Some(recognizer.best()), last].into_iter().flatten() {
        if model.outputs().is_some() {
            let (posterior, share) = recognizer.posterior_together(object);
            *text += &format!("together {object} {} {}\n", posterior.q56(), share.q56());
        } else {
            *text += &format!("posterior {object} {}\n", recognizer.posterior(object).q56());
        }
    }
}

/// Every layout, with every type of leaf.
fn layouts(text: &mut String) {
    for each in [true, false] {
        for &leaf in Leaf::ALL {
            for layout in [Layout::Compact, Layout::Wide] {
                let name = format!("{} {} {}", layout.name(), leaf.name(), if each { "each" } else { "one" });
                let bytes = stated(&compiled(Shape { each, ..SHAPE }, 5, leaf, layout), ALL);
                play(text, &name, &bytes, &touches(5, 1));
            }
        }
    }
    for (objects, leaf, layout) in [
        (1, Leaf::I8, Layout::Compact),
        (11, Leaf::I8, Layout::Compact),
        (13, Leaf::I16, Layout::Compact),
        (7, Leaf::F32, Layout::Wide),
    ] {
        let bytes = compiled(Shape { objects, ..SHAPE }, 6, leaf, layout);
        play(text, &format!("{} {} of {objects} objects", layout.name(), leaf.name()), &bytes, &touches(5, 2));
    }
    let many = Shape { trees: 70, depth: 1, ..SHAPE };
    for layout in [Layout::Compact, Layout::Wide] {
        play(text, &format!("{} of 70 trees", layout.name()), &compiled(many, 8, Leaf::I8, layout), &touches(8, 3));
    }
    let axes = Shape { trees: 60, depth: 4, objects: 2, thresholds: 900, ..SHAPE };
    let bytes = stated(&compiled(axes, 9, Leaf::I8, Layout::Compact), ALL);
    play(text, "several axes of a feature", &bytes, &touches(12, 4));
    let stumps = Shape { thresholds: 0, ..SHAPE };
    play(text, "trees without splits", &compiled(stumps, 10, Leaf::I16, Layout::Compact), &touches(3, 5));
    let most = Shape { objects: 256, trees: 1, depth: 1, ..SHAPE };
    play(text, "256 objects", &compiled(most, 11, Leaf::I8, Layout::Compact), &touches(4, 6));
    let bytes = palpate_tests::unaligned::model();
    // The touch of the worked example comes first.
    let touches: Vec<Touch> = [Touch::from_micros([30_000, 0, 50_000])].into_iter().chain(touches(8, 7)).collect();
    play(text, "not aligned, thresholds of 3 bytes and of 1", &bytes, &touches);
}

/// Every descriptor, with poses.
fn descriptors(text: &mut String) {
    let pose = |direction, alignment| Pose { direction, alignment };
    let poses = [
        // Ends that touched at once: a component says which is first.
        ([5, 0, 5], pose([1, -2, 3], [-4, 5, 6])),
        ([5, 0, 5], pose([1, -2, 3], [4, 5, -6])),
        ([5, 0, 5], pose([-1, 2, -3], [0, 0, -7])),
        ([5, 0, 5], pose([0, 0, 0], [0, -8, 0])),
        ([u32::MAX, 0, u32::MAX], pose([9, 9, 9], [-9, 0, 9])),
        ([u32::MAX, 3, 0], pose([9, 9, 9], [1, 2, 3])),
        ([0, 3, u32::MAX], pose([9, 9, 9], [1, 2, 3])),
        ([7, 3, 0], pose([9, 9, 9], [i16::MIN, 1, i16::MAX])),
    ];
    let poses = poses.map(|(times, pose)| Touch::new(times.map(ContactTime::from_micros)).with_pose(pose));
    for descriptor in Descriptor::ALL {
        let bytes = compiled(Shape { descriptor, trees: 6, ..SHAPE }, 12, Leaf::I16, Layout::Compact);
        let touches: Vec<Touch> = poses.into_iter().chain(touches(8, 8)).collect();
        play(text, descriptor.name(), &stated(&bytes, ALL), &touches);
    }
}

/// Statements of models, and the touches that they reject.
fn sections(text: &mut String) {
    let plain = |descriptor| compiled(Shape { descriptor, ..SHAPE }, 13, Leaf::I16, Layout::Compact);
    let contacts = plain(Descriptor::ContactsCurvature);
    play(text, "no sections", &contacts, &touches(8, 9));
    play(text, "no sections, but a pose", &plain(Descriptor::Gravity), &touches(8, 9));
    let shares = Some(PatternShares([1, 2, 3, 4, 5, 65_520]));
    play(text, "all sections", &trained(&contacts, &Trained { shares, ..abuse::TRAINED }), &touches(12, 10));
    let some = Patterns::from_bits(0b01_0110).expect("patterns");
    let limits = TrainedTouches { patterns: some, needs_pose: true, largest_spread: 20_000, ..ALL };
    let spread = |last: u32| Touch::new([0, last, u32::MAX].map(ContactTime::from_micros));
    let touches: Vec<Touch> = [20_000, 20_001].into_iter().map(spread).chain(touches(12, 11)).collect();
    play(text, "some patterns, a pose, a spread", &stated(&contacts, limits), &touches);
    let pairs =
        TrainedTouches { patterns: Patterns::CONTACTS, counted: Counted::Contacts, needs_pose: false, ..limits };
    play(text, "a largest spread", &stated(&contacts, pairs), &touches);
    let grown = [&ALL.to_bytes()[..], &[1, 2, 3]].concat();
    let sections = [section(2 | 1 << 15, &grown), section(77, b"unknown"), section(78, &[])].concat();
    play(text, "a section that has grown, and unknown ones", &with_sections(&contacts, &sections), &touches);
    let all = section(2 | 1 << 15, &ALL.to_bytes());
    let odds = [1_u32 << 31, 1 << 20, 5].map(u32::to_le_bytes).concat();
    let by_object = [&all[..], &section(5 | 1 << 15, &odds)].concat();
    play(text, "thresholds by object", &with_sections(&contacts, &by_object), &touches);
    for sharpness in [(1 << 16) / 3, 1 << 20, (1 << 20) + 1_u32] {
        let temperature = [&all[..], &section(11, &sharpness.to_le_bytes())].concat();
        let name = format!("a temperature of 65536 / {sharpness}");
        play(text, &name, &with_sections(&contacts, &temperature), &touches[..8]);
    }
}

/// Models over rows of features.
fn rows(text: &mut String) {
    for (layout, leaf) in [(Layout::Compact, Leaf::I16), (Layout::Wide, Leaf::F32), (Layout::Compact, Leaf::I8)] {
        let ensemble = random::over_rows(random::ensemble(SHAPE, 14), 5, 1.000_001e-3);
        let bytes = compile(&ensemble, &with!(Settings::default(), leaf)).expect("it fits").bytes;
        let bytes = in_layout(bytes, layout);
        play_rows(text, &format!("rows of f32 features, {} {}", layout.name(), leaf.name()), &bytes, true);
        play_rows(text, &format!("rows of whole features, {}", layout.name()), &changed(&bytes, 13, &[0]), false);
    }
    let weights = [65_535_u16, 0, 20_000, 9_000].map(u16::to_le_bytes).concat();
    let values: Vec<u8> = (0..33).map(|value| 7 * value).collect();
    let table = [&(-(1_i32 << 17)).to_le_bytes()[..], &[3, 10, 2, 32], &values].concat();
    let sections = [section(4 | 1 << 15, &[&[4, 0][..], &weights].concat()), section(16 | 1 << 15, &table)].concat();
    let settings = with!(Settings::default(), leaf = Leaf::I16);
    let bytes =
        compile(&random::over_rows(random::ensemble(SHAPE, 14), 5, 1.000_001e-3), &settings).expect("it fits").bytes;
    play_rows(text, "rows whose evidence is weighed, by a table", &with_sections(&bytes, &sections), true);
}

fn play_rows(text: &mut String, name: &str, bytes: &[u8], real: bool) {
    let model = Model::new(bytes).expect("a model");
    *text += &format!("model {} {name}\ntouch 0 1 2\nrefused features\n", hex(bytes));
    let mut recognizer = Recognizer::<256>::new(&model, Stopping::from_model(&model)).expect("at most 256 objects");
    let mut rng = SmallRng::seed_from_u64(15);
    for length in [5, 5, 5, 5, 5, 5, 5, 5, 4, 0, 6] {
        let mut value = || match rng.random_range(0..6) {
            0 => f32::NAN,
            1 => 0.0,
            2 => f32::INFINITY,
            _ => rng.random_range(-200.0..200.0_f32),
        };
        let row: Vec<i32> = (0..length)
            .map(|_| {
                let value = value();
                if real {
                    f32_key(value)
                } else if value.is_nan() {
                    MISSING_FEATURE
                } else {
                    value as i32
                }
            })
            .collect();
        *text += &format!("row {}\n", numbers(&row));
        let verdict = recognizer.push_features(&row).expect("it takes rows");
        known(text, &model, &recognizer, &row, verdict);
    }
}

/// Rows of sequences that are numbered, guarded, or both.
fn sequences(text: &mut String) {
    let settings = with!(Settings::default(), leaf = Leaf::I16);
    let real =
        compile(&random::over_rows(random::ensemble(SHAPE, 14), 5, 1.000_001e-3), &settings).expect("it fits").bytes;
    let whole = changed(&real, 13, &[0]);
    let place = |feature, step| section(21 | 1 << 15, &Position { feature, step }.to_bytes());
    let guard = |most: i32| {
        let wide = Limits { low: -most, high: most, may_miss: true, most_equal: 0 };
        let narrow = Limits { low: -most / 2, ..wide };
        let all = [wide, Limits { most_equal: 2, ..wide }, Limits::NONE, narrow, Limits { may_miss: false, ..wide }];
        section(22 | 1 << 15, &all.map(Limits::to_bytes).concat())
    };
    let sentinel = section(14 | 1 << 15, &Sentinel { low: -7, high: 7 }.to_bytes());
    for (name, model, sections) in [
        ("numbered rows of f32 features", &real, place(2, 1)),
        ("numbered rows of whole features up to the largest number", &whole, place(4, 1 << 29)),
        ("guarded rows of f32 features", &real, guard(f32_key(190.0))),
        ("numbered and guarded rows of whole features", &whole, [sentinel, place(2, 30), guard(180)].concat()),
    ] {
        let bytes = with_sections(model, &sections);
        play_sequences(text, name, &bytes);
    }
}

fn play_sequences(text: &mut String, name: &str, bytes: &[u8]) {
    let model = Model::new(bytes).expect("a model");
    *text += &format!("model {} {name}\n", hex(bytes));
    let mut recognizer = Recognizer::<256>::new(&model, Stopping::from_model(&model)).expect("at most 256 objects");
    let (mut seen, mut rng) = (RowsSeen::<256>::new(), SmallRng::seed_from_u64(16));
    let is_real = bytes[13] == 1;
    let mut row = Vec::new();
    let all = model.measured_count();
    for (index, length) in [all, all, all, all, all, all, all, all - 1, all, 0, all + 1, all].into_iter().enumerate() {
        let value = |_| match rng.random_range(0..9) {
            0 => MISSING_FEATURE,
            1 => 0,
            _ if is_real => f32_key(rng.random_range(-200.0..200.0_f32)),
            _ => rng.random_range(-200..200),
        };
        // Three rows with the same features, also where a sequence begins.
        if !(3..6).contains(&index) {
            row = (0..length).map(value).collect();
        }
        if index == 4 {
            *text += "reset\n";
            recognizer.reset();
            seen.reset();
        }
        *text += &format!("next {}\n", numbers(&row));
        let features = seen.clone().next(&model, &row);
        match (features, recognizer.push_seen(&row, &mut seen)) {
            (Ok(features), Ok(verdict)) => {
                known(text, &model, &recognizer, &features[..model.feature_count()], verdict)
            }
            (_, Err(Refused::Guarded(feature, _))) => *text += &format!("guarded {feature}\n"),
            (_, refused) => panic!("{refused:?}"),
        }
    }
}

/// Outputs that belong together, with the model's threshold, with their own, with a temperature, and with level evidence.
fn together(text: &mut String) {
    let all = section(2 | 1 << 15, &ALL.to_bytes());
    let outputs = |objects: [u8; 5]| {
        let mut content = Vec::new();
        Outputs::write(objects.iter().map(|&object| (object, 0.4)), &mut |bytes| content.extend_from_slice(bytes));
        section(18 | 1 << 15, &content)
    };
    let odds = section(5 | 1 << 15, &[1_u32 << 31, 1 << 29, 5, 1 << 30, 1 << 28].map(u32::to_le_bytes).concat());
    let temperature = section(11, &((1_u32 << 16) / 3).to_le_bytes());
    let shape = Shape { objects: 5, leaf: 0.7, ..SHAPE };
    let ensemble = random::ensemble(shape, 27);
    for (name, objects, between, after) in [
        ("two objects of five outputs", [0, 0, 1, 1, 1], &[][..], &[][..]),
        ("four objects of five outputs, thresholds of their own", [0, 1, 2, 2, 3], &odds[..], &[]),
        ("a temperature", [0, 0, 0, 1, 2], &[], &temperature[..]),
        ("one object of all outputs", [0; 5], &[], &[]),
    ] {
        let settings = with!(Settings::default(), leaf = Leaf::I8, error_rate = 0.05, max_touches = 8);
        let bytes = compile(&ensemble, &settings).expect("it fits").bytes;
        let sections = [&all[..], between, after, &outputs(objects)].concat();
        play(text, &format!("outputs together: {name}"), &with_sections(&bytes, &sections), &random::touches(8, 28));
    }
}

/// Ties, thresholds, limits.
fn decisions(text: &mut String) {
    let ensemble = random::ensemble(Shape { leaf: 0.6, ..SHAPE }, 16);
    for (error_rate, max_touches) in [(0.3, 3), (0.01, 200), (1e-9, 200), (1e-15, 6)] {
        let priors = Some(vec![0.5, 0.3, 0.2]);
        let settings = with!(Settings::default(), leaf = Leaf::I8, error_rate, max_touches, priors);
        let bytes = stated(&compile(&ensemble, &settings).expect("it fits").bytes, ALL);
        play(text, &format!("error rate {error_rate}, at most {max_touches} touches"), &bytes, &touches(20, 17));
    }
    let mut level = ensemble.clone();
    level.base_margins.fill(0.0);
    for node in level.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
        if let Node::Leaf(values) = node {
            let first = values[0];
            values.fill(first);
        }
    }
    let settings = with!(Settings::default(), leaf = Leaf::I8, error_rate = 0.49, max_touches = 4);
    let bytes = stated(&compile(&level, &settings).expect("it fits").bytes, ALL);
    play(text, "objects that are level", &bytes, &touches(6, 18));
    // Sums that are not finite numbers, or beyond the range of margins.
    let f32_leaves = stated(&compiled(SHAPE, 19, Leaf::F32, Layout::Compact), ALL);
    let [.., leaves, _] = abuse::places(&f32_leaves);
    let mut wild = f32_leaves.clone();
    for (value, bytes) in wild[leaves..].chunks_mut(4).zip([f32::NAN, f32::INFINITY, 1e30, -1e30, 16_384.1].repeat(3)) {
        value.copy_from_slice(&bytes.to_le_bytes());
    }
    play(text, "f32 leaves beyond reason", &abuse::sealed(wild), &touches(16, 20));
}

/// Leaves that are numbers of a table: of one byte and of two, with a value for each object and for one.
fn shared_leaves(text: &mut String) {
    let compiled = |shape: Shape, different: usize, leaf, layout| {
        let ensemble = random::with_few_leaves(random::ensemble(shape, 23), different);
        let bytes = compile(&ensemble, &with!(Settings::default(), leaf)).expect("it fits").bytes;
        assert!(Model::new(&bytes).expect("a model").shared_leaves().is_some());
        stated(&in_layout(bytes, layout), ALL)
    };
    for layout in [Layout::Compact, Layout::Wide] {
        for (leaf, each) in [(Leaf::I8, true), (Leaf::I16, true), (Leaf::F32, true), (Leaf::F32, false)] {
            let bytes = compiled(Shape { trees: 24, each, ..SHAPE }, if each { 7 } else { 5 }, leaf, layout);
            let name = format!("{} {} {}", layout.name(), leaf.name(), if each { "each" } else { "one" });
            play(text, &format!("shared leaves, {name}"), &bytes, &touches(5, 24));
        }
        // More than a block of trees.
        let bytes = compiled(Shape { trees: 170, objects: 11, ..SHAPE }, 300, Leaf::I8, layout);
        play(text, &format!("shared leaves, numbers of two bytes, {}", layout.name()), &bytes, &touches(5, 25));
    }
}

/// Bytes that are not a model.
fn refused(text: &mut String) {
    for abuse::Abuse { name, kind, offset, bytes } in abuse::cases() {
        *text += &format!("refuse {} {kind} {offset} {name}\n", hex(&bytes));
    }
}

/// Parts and sections at every length.
fn cut(text: &mut String) {
    for (name, base, cuts) in abuse::cuts() {
        Model::new(&base).expect("a model");
        *text += &format!("model {} {name}\n", hex(&base));
        for cut in cuts.iter().filter(|cut| cut.length > 0) {
            *text += &format!("cut {}\n", cut.words());
        }
    }
}
