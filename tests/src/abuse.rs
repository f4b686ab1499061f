//! Every way to abuse a model file: bytes that a reader must refuse, and why. `shared/FORMAT.md` lists them by name.

use crate::random::{self, Shape};
use crate::replay::groups_and_splits;
use crate::sections::{Trained, trained, with_sections, write_section};
use crate::vectors::{Cut, Run};
use crate::wide::widened;
use palpate::compile::{Layout, Leaf, Settings, compile};
use palpate::with;
use palpate_onboard::{Model, ModelError};
use palpate_shared::format::{
    Axis, Counted, Group, HEADER_LENGTH, Header, Length, Limits, Link, MUST_UNDERSTAND, MisfitTerms, ObjectMisfit,
    OutputScale, Outputs, Plan, Position, Prediction, RAW_FEATURES, Sentinel, Strangers, Tag, TrainedNoise,
    TrainedProbe, TrainedTouches, checksum,
};
use palpate_shared::{Descriptor, Patterns, Poses};

/// Bytes that must be refused.
#[derive(Clone, Debug)]
pub struct Abuse {
    /// Description of the damage done to a model.
    pub name: String,
    /// The kind of error, see [`kind`].
    pub kind: &'static str,
    /// Offset, in bytes from the start.
    pub offset: usize,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// An error's kind, as the vectors name it.
pub fn kind(error: &ModelError) -> &'static str {
    match error {
        ModelError::Length { .. } => "length",
        ModelError::NotAModel => "magic",
        ModelError::Version(_) => "version",
        ModelError::Checksum { .. } => "checksum",
        ModelError::Field { .. } => "field",
        ModelError::Section { .. } => "section",
        ModelError::NotUnderstood { .. } => "not-understood",
        ModelError::MarginRange => "range",
        _ => "not-built-in",
    }
}

/// A small model.
pub fn model(layout: Layout, leaf: Leaf, each: bool) -> Vec<u8> {
    let shape =
        Shape { descriptor: Descriptor::Curvature, objects: 3, trees: 4, depth: 2, each, thresholds: 6, leaf: 1.0 };
    let settings = with!(Settings::default(), leaf);
    let bytes = compile(&random::ensemble(shape, 5), &settings).expect("a small ensemble").bytes;
    if layout == Layout::Wide { widened(&bytes) } else { bytes }
}

/// A small model whose leaves are shared: numbers of one byte, or of two.
pub fn shared(layout: Layout, is_wide: bool) -> Vec<u8> {
    // Leaves of many values repay a table of more than 256.
    let (objects, trees, different) = if is_wide { (8, 240, 400) } else { (3, 16, 5) };
    let shape =
        Shape { descriptor: Descriptor::Curvature, objects, trees, depth: 2, each: true, thresholds: 6, leaf: 1.0 };
    let ensemble = random::with_few_leaves(random::ensemble(shape, 5), different);
    let bytes = compile(&ensemble, &with!(Settings::default(), leaf = Leaf::I8)).expect("a small ensemble").bytes;
    let found = Model::new(&bytes).expect("a model").shared_leaves().map(|leaves| leaves.number_length());
    assert_eq!(found, Some(1 + usize::from(is_wide)), "numbers of leaves");
    if layout == Layout::Wide { widened(&bytes) } else { bytes }
}

/// Puts the checksum right.
pub fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let body = bytes.len() - 4;
    let sum = checksum(&bytes[..body]);
    bytes[body..].copy_from_slice(&sum.to_le_bytes());
    bytes
}

/// The model with these bytes at an offset, and its checksum right.
pub fn changed(model: &[u8], offset: usize, bytes: &[u8]) -> Vec<u8> {
    let mut model = model.to_vec();
    model[offset..offset + bytes.len()].copy_from_slice(bytes);
    sealed(model)
}

/// The model with bytes put in before its checksum, and its length and checksum right.
fn longer(model: &[u8], more: &[u8]) -> Vec<u8> {
    let mut bytes = [&model[..model.len() - 4], more, &[0; 4]].concat();
    let length = u32::try_from(bytes.len()).expect("a small model");
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    sealed(bytes)
}

/// Offsets of the parts of a model: optional sections, base margins, axes, thresholds, groups, splits, leaves, checksum.
pub fn places(model: &[u8]) -> [usize; 8] {
    let (header, _) = Header::split(model).expect("a model");
    let objects = usize::from(header.last_object()) + 1;
    let mut end = HEADER_LENGTH;
    [
        header.text_length() as usize,
        header.optional_length() as usize,
        8 * objects,
        4 * usize::from(header.axes()),
        header.cuts_length() as usize,
        8 * usize::from(header.groups()),
        header.nodes_length() as usize,
        header.leaves_length() as usize,
    ]
    .map(|length| {
        end += length;
        end
    })
}

/// Statements of the models in these tests.
pub const TRAINED: Trained = Trained {
    probe: Some(TrainedProbe {
        radius: 0.15,
        spacing: 1.5,
        speed: 10.0,
        length: Length::Millimeter,
        stroke: None,
        travel: None,
        cone: 0,
        stroke_tolerance: None,
    }),
    touches: Some(TrainedTouches {
        patterns: Patterns::CONTACTS,
        counted: Counted::Contacts,
        needs_pose: false,
        largest_spread: 1_050_000,
    }),
    noise: Some(TrainedNoise { least: 0, largest: 5_000, timer: 1_000, pose: 0 }),
    shares: None,
};

/// A section of any tag.
pub fn section(tag: u16, content: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_section(Tag::FeatureNames, false, content, &mut |part| bytes.extend_from_slice(part));
    bytes[..2].copy_from_slice(&tag.to_le_bytes());
    bytes
}

/// All of them, in the order of the table in `FORMAT.md`.
pub fn cases() -> Vec<Abuse> {
    let mut cases = Vec::new();
    let mut put = |name: &str, kind, offset, bytes| cases.push(Abuse { name: name.into(), kind, offset, bytes });
    whole(&mut put);
    header(&mut put);
    parts(&mut put);
    sections(&mut put);
    axes(&mut put);
    groups(&mut put);
    predictions(&mut put);
    sequences(&mut put);
    shared_leaves(&mut put);
    cases
}

type Put<'a> = &'a mut dyn FnMut(&str, &'static str, usize, Vec<u8>);

/// Damage to the bytes as a whole.
fn whole(put: Put<'_>) {
    let good = model(Layout::Compact, Leaf::I8, true);
    let length = good.len();
    put("nothing at all", "length", 0, Vec::new());
    put("something else", "magic", 0, b"{\"learner\":{}}".to_vec());
    put("cut in the header", "length", 95, good[..95].to_vec());
    put("cut at the end", "length", length - 1, good[..length - 1].to_vec());
    put("a byte after the end", "length", length, [&good[..], &[0]].concat());
    put("a length of 4 GB", "length", length, changed(&good, 8, &[0xff; 4]));
    put("version 0", "version", 4, changed(&good, 4, &[0, 0]));
    put("version 2", "version", 4, changed(&good, 4, &[2, 0]));
    put("a later version", "version", 4, changed(&good, 4, &[4, 0]));
    let mut bytes = good.clone();
    bytes[length - 5] ^= 1;
    put("a bit that has changed", "checksum", 8, bytes);
}

/// Numbers of the header.
fn header(put: Put<'_>) {
    let good = model(Layout::Compact, Leaf::I8, true);
    let mut at = |name: &str, offset, bytes: &[u8]| put(name, "field", offset, changed(&good, offset, bytes));
    at("an unknown layout", 6, &[5]);
    at("an unknown type of leaf", 7, &[3]);
    at("an unknown descriptor", 12, &[7]);
    at("another number of features than the descriptor's", 15, &[2]);
    at("keys of f32 values with a descriptor", 13, &[1]);
    at("a unit that never decides", 32, &1e-9_f32.to_le_bytes());
    at("a unit that is too coarse", 32, &1.0_f32.to_le_bytes());
    at("a unit that is not a number", 32, &f32::NAN.to_le_bytes());
    at("a negative unit", 32, &(-0.01_f32).to_le_bytes());
    at("unit bits of another unit", 36, &[good[36] ^ 0x10]);
    at("a unit shift beyond 63", 40, &[64]);
    at("a threshold that a tie passes", 48, &(1_u64 << 56).to_le_bytes());
    at("no touch at all", 56, &[0; 4]);
    let raw = changed(&good, 12, &[255]);
    put("an unknown key of rows of features", "field", 13, changed(&raw, 13, &[2]));
}

/// Lengths of parts.
fn parts(put: Put<'_>) {
    let good = trained(&model(Layout::Compact, Leaf::I8, true), &TRAINED);
    let [optional, base, axes, _, groups, splits, leaves, end] = places(&good);
    let huge = u32::MAX.to_le_bytes();
    put("a text beyond the end", "section", HEADER_LENGTH, changed(&good, 68, &huge));
    put("optional sections beyond the end", "section", optional, changed(&good, 92, &huge));
    put("objects beyond the end", "section", base, changed(&good, 14, &[255]));
    put("axes beyond the end", "section", axes, changed(&good, 16, &[0xff; 2]));
    // Axes and thresholds are one part.
    put("thresholds beyond the end", "section", axes, changed(&good, 80, &huge));
    put("groups beyond the end", "section", groups, changed(&good, 18, &[0xff; 2]));
    put("splits beyond the end", "section", splits, changed(&good, 84, &huge));
    put("leaves beyond the end", "section", leaves, changed(&good, 88, &huge));
    put("bytes between leaves and checksum", "section", end, longer(&good, &[0; 4]));
    let more = |field: usize| {
        let length = u32::from_le_bytes(good[field..field + 4].try_into().expect("four bytes")) + 4;
        changed(&longer(&good, &[0; 4]), field, &length.to_le_bytes())
    };
    put("leaves that belong to no tree", "section", end, more(88));
    let wide = model(Layout::Wide, Leaf::I8, true);
    let [.., splits, leaves, _] = places(&wide);
    put("splits that belong to no tree", "section", leaves, {
        let mut bytes = wide.clone();
        bytes.splice(leaves..leaves, [0; 6]);
        let splits_length = (leaves - splits + 6) as u32;
        bytes[84..88].copy_from_slice(&splits_length.to_le_bytes());
        longer(&bytes, &[])
    });
    put("a tree with more splits than there are", "section", splits, changed(&wide, splits, &[0xff, 0xff]));
}

/// Optional sections.
fn sections(put: Put<'_>) {
    let plain = model(Layout::Compact, Leaf::I8, true);
    let [optional, ..] = places(&plain);
    let [probe, touches, noise] = [
        TRAINED.probe.expect("stated").to_bytes().to_vec(),
        TRAINED.touches.expect("stated").to_bytes().to_vec(),
        TRAINED.noise.expect("stated").to_bytes().to_vec(),
    ];
    let touches_tag = Tag::Touches.code() | MUST_UNDERSTAND;
    let with = |sections: &[Vec<u8>]| with_sections(&plain, &sections.concat());
    let [touches_section, noise_section] = [section(touches_tag, &touches), section(3, &noise)];
    put(
        "sections in the wrong order",
        "field",
        optional + noise_section.len(),
        with(&[noise_section.clone(), touches_section.clone()]),
    );
    put(
        "a section twice",
        "field",
        optional + noise_section.len(),
        with(&[noise_section.clone(), noise_section.clone()]),
    );
    put("a section with tag 0", "field", optional, with(&[section(0, &[])]));
    put("a section that is cut in its head", "section", optional, with(&[noise_section[..7].to_vec()]));
    put("a section that is cut in its content", "section", optional, with(&[noise_section[..20].to_vec()]));
    put("a section without its last zeros", "section", optional, with(&[section(77, &[1; 5])[..14].to_vec()]));
    put("a section of 4 GB", "section", optional, {
        let mut bytes = noise_section.clone();
        bytes[4..8].copy_from_slice(&[0xff; 4]);
        with(&[bytes])
    });
    put(
        "an unknown section that must be understood",
        "not-understood",
        optional,
        with(&[section(77 | MUST_UNDERSTAND, &[])]),
    );
    put("a probe that is too short", "field", optional, with(&[section(1, &probe[..15])]));
    put("a noise that is too short", "field", optional, with(&[section(3, &noise[..15])]));
    let stated = |position: usize, value: u8| {
        let mut bytes = touches.clone();
        bytes[position] = value;
        with(&[section(touches_tag, &bytes)])
    };
    let by_object = section(Tag::ThresholdsByObject.code() | MUST_UNDERSTAND, &[1; 11]);
    put("thresholds for fewer objects than there are", "field", optional, with(&[by_object]));
    put("a plan in poses that do not exist", "field", optional, with(&[section(7, &[1; 200])]));
    put("a plan that is too short", "field", optional, with(&[section(7, &[0, 1, 0, 0, 5])]));
    put("touches that are too short", "field", optional, with(&[section(touches_tag, &touches[..7])]));
    put("touches of no pattern", "field", optional, stated(0, 0));
    put("touches of a pattern that does not exist", "field", optional, stated(0, 64));
    put("touches of a pattern that does not count", "field", optional, stated(0, 0b11_1111));
    put("touches that count in an unknown way", "field", optional, stated(1, 3));
    put("touches that need two poses", "field", optional, stated(2, 2));
}

/// Axes and thresholds.
fn axes(put: Put<'_>) {
    let good = model(Layout::Compact, Leaf::I8, true);
    let [_, _, axes, cuts, ..] = places(&good);
    put("an axis of a feature that does not exist", "field", axes, changed(&good, axes, &[2]));
    put("an axis without columns", "field", axes, changed(&good, axes + 1, &[0]));
    put("an axis with unknown columns", "field", axes, changed(&good, axes + 1, &[4]));
    put("thresholds of no byte", "field", axes, changed(&good, axes + 2, &[0]));
    put("thresholds of five bytes", "field", axes, changed(&good, axes + 2, &[5]));
    put("more thresholds than there are", "section", cuts, changed(&good, axes + 3, &[255]));
    let count = good[axes + 3];
    let width = usize::from(good[axes + 2]);
    let second = cuts + width;
    let mut turned = good.clone();
    turned[second..second + width].copy_from_slice(&good[cuts..second]);
    put("thresholds that do not ascend", "field", axes, changed(&turned, cuts, &good[second..second + width]));
    let last = usize::from(good[axes + 7]) * usize::from(good[axes + 6]);
    put(
        "thresholds that belong to no axis",
        "section",
        cuts + (usize::from(count) - 1) * width + last,
        changed(&good, axes + 3, &[count - 1]),
    );
    let mut many = vec![0_u8; 0];
    for _ in 0..129 {
        many.extend([0, 3, 1, 0]);
    }
    let mut bytes = good.clone();
    bytes.splice(axes..axes, many);
    bytes[16..18].copy_from_slice(&(u16::from_le_bytes([good[16], good[17]]) + 129).to_le_bytes());
    put("more than 256 columns", "field", axes + 4 * 128, longer(&bytes, &[]));
    let wide = model(Layout::Wide, Leaf::I8, true);
    let [_, _, axes, cuts, groups, ..] = places(&wide);
    let mut bytes = wide.clone();
    bytes.splice(axes..axes, [0, 1, 1, 0]);
    bytes[16] = 1;
    put("axes of wide trees", "section", cuts + 4, longer(&bytes, &[]));
    let mut bytes = wide.clone();
    bytes.splice(groups..groups, [0; 2]);
    bytes[80..84].copy_from_slice(&((groups - cuts + 2) as u32).to_le_bytes());
    put("a threshold of wide trees that is cut", "section", cuts, longer(&bytes, &[]));
}

/// Groups and their contributions.
fn groups(put: Put<'_>) {
    for (layout, name) in [(Layout::Compact, "compact"), (Layout::Wide, "wide")] {
        let good = model(layout, Leaf::I8, true);
        let [.., groups, splits, _, _] = places(&good);
        let few = [0, 0, 1, 0];
        put(&format!("65,536 {name} trees"), "section", splits, changed(&good, groups + 4, &few));
    }
    let good = model(Layout::Compact, Leaf::I8, false);
    let [_, base, _, _, groups, ..] = places(&good);
    put("a leaf for an object that does not exist", "field", groups, changed(&good, groups + 3, &[3]));
    put("a leaf with an unknown number of values", "field", groups, changed(&good, groups + 2, &[2]));
    put("a shift beyond 24", "field", groups, changed(&good, groups + 1, &[25]));
    put("a shift above the one before", "field", groups + 8, changed(&good, groups + 9, &[24]));
    put("leaves beyond the range of margins", "range", 8, changed(&good, groups + 1, &[24]));
    put("4 billion trees", "range", 8, changed(&good, groups + 4, &[0xff; 4]));
    put("a base margin beyond the range", "range", 8, changed(&good, base, &(1_i32 << 30).to_le_bytes()));
    put("the least base margin", "range", 8, changed(&good, base, &i32::MIN.to_le_bytes()));
    let good = model(Layout::Compact, Leaf::F32, true);
    let [.., groups, _, _, _] = places(&good);
    put("a shift of f32 leaves", "field", groups, changed(&good, groups + 1, &[1]));
}

/// Damage to a model's prediction and its missing values.
fn predictions(put: Put<'_>) {
    let plain = model(Layout::Compact, Leaf::I8, true);
    let [optional, ..] = places(&plain);
    let content = |average: u32| {
        let mut content = Vec::new();
        let prediction =
            Prediction { link: Link::Exponential, last_of_ties: true, scale: 64.0, targets: false, average };
        prediction.write(&[], &mut |part| content.extend_from_slice(part));
        content
    };
    let prediction = content(1);
    let mut with = |name: &str, tag: Tag, content: &[u8]| {
        put(name, "field", optional, with_sections(&plain, &section(tag.code() | MUST_UNDERSTAND, content)));
    };
    let changed = |at: usize, value: u8| {
        let mut bytes = prediction.clone();
        bytes[at] = value;
        bytes
    };
    with("a prediction that is too short", Tag::Prediction, &prediction[..7]);
    with("a link that does not exist", Tag::Prediction, &changed(0, 5));
    with("a rule for ties that does not exist", Tag::Prediction, &changed(1, 2));
    with("a scale of nothing", Tag::Prediction, &[&prediction[..4], &[0; 4]].concat());
    with("a mean of trees without their number", Tag::Prediction, &content(50)[..11]);
    with("a mean of no trees", Tag::Prediction, &[&content(50)[..8], &[0; 4]].concat());
    let mut scaled = Vec::new();
    let own = OutputScale { scale: 2.0, offset: 1.0 };
    let outputs = usize::from(plain[14]) + 1;
    Prediction::default().write(&vec![own; outputs], &mut |part| scaled.extend_from_slice(part));
    let last = scaled.len() - OutputScale::LENGTH;
    with("scales of fewer outputs than there are", Tag::Prediction, &scaled[..scaled.len() - 1]);
    with("an output's scale of nothing", Tag::Prediction, &[&scaled[..last], &[0; 8]].concat());
    let infinite = f32::NEG_INFINITY.to_le_bytes();
    with("an offset that is no number", Tag::Prediction, &[&scaled[..last + 4], &infinite].concat());
    let sentinel = Sentinel { low: 1, high: 0 }.to_bytes();
    with("a sentinel that is too short", Tag::Sentinel, &sentinel[..7]);
    with("a sentinel that ends before it begins", Tag::Sentinel, &sentinel);
    with("no weight by the number of touches", Tag::Weights, &[0, 0]);
    with("weights by the number of touches that are cut", Tag::Weights, &[3, 0, 1, 0, 1, 0, 1]);
    with("more weights than there are doublings", Tag::Weights, &[&[65, 0][..], &[1; 130]].concat());
    let outputs = |most: u8, numbers: &[u8]| {
        let records = numbers.iter().flat_map(|&number| [number, 0, 0, 0]);
        [most, 0, 0, 0].into_iter().chain(records).collect::<Vec<u8>>()
    };
    let objects = usize::from(plain[14]) + 1;
    let each: Vec<u8> = (0..objects as u8).collect();
    with("outputs that are cut", Tag::Outputs, &outputs(0, &each[1..]));
    with("outputs whose numbers do not begin with 0", Tag::Outputs, &outputs(objects as u8 - 1, &vec![1; objects]));
    with("more outputs of an object than are stated", Tag::Outputs, &outputs(0, &vec![0; objects]));
    let table = [0, 0, 0, 0, 4, 3, 0, 1, 1, 2];
    with("evidence of a row in a model over touches", Tag::RowEvidence, &table);
    let rows = changed_to_rows(&plain);
    let mut with = |name: &str, content: &[u8]| {
        let bytes = with_sections(&rows, &section(Tag::RowEvidence.code() | MUST_UNDERSTAND, content));
        put(name, "field", optional, bytes);
    };
    let at = |place: usize, value: u8| {
        let mut table = table;
        table[place] = value;
        table
    };
    with("evidence of a row that is cut", &table[..9]);
    with("evidence of a row by one value", &at(7, 0));
    with("evidence of a row that falls", &at(9, 0));
    with("evidence of a row in steps that are too wide", &at(4, 24));
    with("evidence of a row in units that are too large", &at(6, 20));
    with("evidence of a row that starts beyond all margins", &at(3, 0x41));
}

/// Damage to what a model says about rows of sequences.
fn sequences(put: Put<'_>) {
    let plain = model(Layout::Compact, Leaf::I8, true);
    let rows = changed_to_rows(&plain);
    let [optional, ..] = places(&plain);
    let features = plain[15] + 1;
    let position = Position { feature: features - 1, step: 1 };
    let guard = Limits::NONE.to_bytes().repeat(features.into());
    let mut with = |name: &str, model: &[u8], tag: Tag, content: &[u8]| {
        put(name, "field", optional, with_sections(model, &section(tag.code() | MUST_UNDERSTAND, content)));
    };
    with("numbers of rows in a model over touches", &plain, Tag::Position, &position.to_bytes());
    with("numbers of rows that are cut", &rows, Tag::Position, &position.to_bytes()[..7]);
    let beyond = Position { feature: features, ..position };
    with("numbers of rows as a feature that does not exist", &rows, Tag::Position, &beyond.to_bytes());
    for (name, step) in [("numbers of rows that count nothing", 0), ("numbers of rows that fall", -1)] {
        with(name, &rows, Tag::Position, &Position { step, ..position }.to_bytes());
    }
    with("a guard in a model over touches", &plain, Tag::Guard, &guard);
    with("a guard of fewer features than there are", &rows, Tag::Guard, &guard[1..]);
}

/// The model over touches as one over rows of as many features.
fn changed_to_rows(model: &[u8]) -> Vec<u8> {
    changed(model, 12, &[RAW_FEATURES])
}

/// Leaves that are numbers of a table.
fn shared_leaves(put: Put<'_>) {
    let good = shared(Layout::Compact, false);
    let [optional, base, .., end] = places(&good);
    let content = optional + 8;
    let values = &good[content + 4..base];
    let number = values.len() / 3;
    put("leaves numbered by no byte", "field", optional, changed(&good, content, &[0]));
    put("leaves numbered by three bytes", "field", optional, changed(&good, content, &[3]));
    let alone = with_sections(&good, &[]);
    put("leaves without their table", "section", splits_of(&alone), alone);
    let tag = Tag::SharedLeaves.code() | MUST_UNDERSTAND;
    put("a table of leaves that is too short", "field", optional, with_sections(&good, &section(tag, &[1, 0, 0])));
    // The greatest number is one that was given.
    put("the number of a leaf that does not exist", "field", end - 1, changed(&good, end - 1, &[number as u8]));
    let cut = with_sections(&good, &section(tag, &[&[1, 0, 0, 0][..], &values[..2]].concat()));
    let [.., first, _] = places(&cut);
    put("a leaf that is cut", "field", first, cut);
    put("numbers of leaves that are twice as long", "section", splits_of(&good), changed(&good, content, &[2]));
    let wide = shared(Layout::Compact, true);
    let [.., end] = places(&wide);
    put("a long number of a leaf that does not exist", "field", end - 2, changed(&wide, end - 1, &[0xff]));
}

/// Offset of a model's splits.
fn splits_of(model: &[u8]) -> usize {
    let [.., splits, _, _] = places(model);
    splits
}

/// Models, by name, and how each part and each optional section of them is cut.
///
/// # Panics
/// Never.
pub fn cuts() -> Vec<(String, Vec<u8>, Vec<Cut>)> {
    let mut all = vec![touches_with_all_sections(), rows_with_all_sections()];
    for layout in [Layout::Compact, Layout::Wide] {
        let base = model(layout, Leaf::I8, true);
        let cuts = cuts_of_parts(&base);
        all.push((format!("cut, {}", layout.name()), base, cuts));
    }
    all
}

/// A section's tag, its content, and the fewest bytes of it that can be read: 0 if no verdict depends on it.
type Whole = (u16, Vec<u8>, usize);

/// Puts sections in, and cuts each.
fn with_cuts(model: &[u8], sections: &[Whole]) -> (Vec<u8>, Vec<Cut>) {
    let all: Vec<u8> = sections.iter().flat_map(|(tag, content, _)| section(*tag, content)).collect();
    let base = with_sections(model, &all);
    let [mut at, ..] = places(&base);
    let cut = |(_, content, least): &Whole| {
        let place = at + 8;
        let refused = (0..*least).map(|length| (length..=length, "field".into(), at));
        let cut = Cut { field: at + 4, place, length: content.len(), refused: runs(refused) };
        at = place + content.len().next_multiple_of(4);
        cut
    };
    let cuts = sections.iter().map(cut).collect();
    (base, cuts)
}

/// Neighboring lengths with the same error at the same place as one.
fn runs(lengths: impl Iterator<Item = Run>) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (own, kind, place) in lengths {
        match runs.last_mut() {
            Some((lengths, last, at)) if *last == kind && *at == place && lengths.end() + 1 == *own.start() => {
                *lengths = *lengths.start()..=*own.end();
            }
            _ => runs.push((own, kind, place)),
        }
    }
    runs
}

fn touches_with_all_sections() -> (String, Vec<u8>, Vec<Cut>) {
    let plain = shared(Layout::Compact, false);
    let objects = usize::from(plain[14]) + 1;
    let own = Model::new(&plain).expect("a model");
    let table = own.optional_sections().find(|section| section.tag == Tag::SharedLeaves.code()).expect("its leaves");
    let table = table.content.to_vec();
    let must = |tag: Tag| tag.code() | MUST_UNDERSTAND;
    let mut strangers = Strangers::header(true, true).to_vec();
    let terms = MisfitTerms {
        rivals: 1,
        first: 1,
        threshold: 1 << 18,
        early: 1 << 16,
        halving: 1 << 28,
        alarms: 10_000,
        sequences: 1_000,
        confidence: 950_000,
    };
    strangers.extend(terms.to_bytes());
    for object in 1..objects as u8 {
        let numbers = [100, -100, 50].into_iter();
        ObjectMisfit::write([1, 8, 8], 500, &[object], numbers, &mut |part| strangers.extend_from_slice(part));
    }
    let poses = Poses::with_rolls(1).expect("a roll");
    let mut plan = Plan::header(poses).to_vec();
    plan.extend((0..Plan::pairs(objects) * usize::from(poses.count())).map(|number| number as u8));
    let weights = [[3, 0], [0xff, 0xff], [0, 0xc0], [0, 0xa0]].concat();
    let odds = [1_u32 << 31, 1 << 29, 1 << 28].map(u32::to_le_bytes).concat();
    let stated = [
        TRAINED.probe.expect("stated").to_bytes().to_vec(),
        TRAINED.touches.expect("stated").to_bytes().to_vec(),
        TRAINED.noise.expect("stated").to_bytes().to_vec(),
    ];
    let [probe, touches, noise] = stated;
    let whole = |tag: u16, content: Vec<u8>| {
        let least = content.len();
        (tag, content, least)
    };
    let sections = [
        (Tag::Probe.code(), probe, 16),
        whole(must(Tag::Touches), touches),
        whole(Tag::Noise.code(), noise),
        whole(must(Tag::Weights), weights),
        whole(must(Tag::ThresholdsByObject), odds),
        whole(must(Tag::Strangers), strangers),
        whole(Tag::Plan.code(), plan),
        (Tag::PatternShares.code(), vec![1; 12], 0),
        (Tag::Promise.code(), vec![0; 48], 0),
        (Tag::Temperature.code(), vec![0, 0, 2, 0], 0),
        (must(Tag::SharedLeaves), table.clone(), 4),
        (Tag::Fingerprints.code(), vec![7; 6], 0),
    ];
    let (base, mut cuts) = with_cuts(&plain, &sections);
    // Beyond its head, a table that is cut lacks the values of a leaf, whose number is at fault.
    let [.., leaves, end] = places(&base);
    let cut = cuts.get_mut(10).expect("the table");
    for length in 4..table.len() {
        let is_there = |number: u8| (usize::from(number) + 1) * objects <= length - 4;
        if let Some(first) = base[leaves..end].iter().position(|&number| !is_there(number)) {
            let shorter = table.len().next_multiple_of(4) - length.next_multiple_of(4);
            cut.refused.push((length..=length, "field".into(), leaves + first - shorter));
        }
    }
    ("cut, touches with all sections".into(), base, cuts)
}

fn rows_with_all_sections() -> (String, Vec<u8>, Vec<Cut>) {
    let plain = changed_to_rows(&model(Layout::Compact, Leaf::I8, true));
    let objects = usize::from(plain[14]) + 1;
    let must = |tag: Tag| tag.code() | MUST_UNDERSTAND;
    let mut outputs = Vec::new();
    Outputs::write((0..objects as u8).map(|output| (output / 2, 0.5)), &mut |part| outputs.extend_from_slice(part));
    let names = [0, 0, 0x80, 0x3f, 1, b'a', 0, 0, 0x80, 0x3f, 2, b'b', b'c'];
    let table = [0, 0, 0, 0, 4, 3, 0, 4, 0, 1, 1, 2, 9];
    let limits = Limits { low: -9, high: 1 << 20, may_miss: true, most_equal: 5 };
    let guard = limits.to_bytes().repeat(usize::from(plain[15]) + 1);
    let mut prediction = Vec::new();
    let averaged = Prediction { link: Link::Identity, last_of_ties: true, scale: 0.5, targets: false, average: 5 };
    let own = OutputScale { scale: 0.5, offset: 1e9 };
    averaged.write(&vec![own; objects], &mut |part| prediction.extend_from_slice(part));
    let sections = [
        (Tag::FeatureNames.code(), names.to_vec(), 0),
        (must(Tag::Prediction), prediction.clone(), prediction.len()),
        (must(Tag::Sentinel), Sentinel { low: -1, high: 1 }.to_bytes().to_vec(), 8),
        (must(Tag::RowEvidence), table.to_vec(), table.len()),
        (must(Tag::Outputs), outputs.clone(), outputs.len()),
        (Tag::Columns.code(), vec![4, 0, 0, 0, 3, 0], 0),
        (must(Tag::Position), Position { feature: 0, step: 3 }.to_bytes().to_vec(), Position::LENGTH),
        (must(Tag::Guard), guard.clone(), guard.len()),
    ];
    let (base, cuts) = with_cuts(&plain, &sections);
    ("cut, rows with all sections".into(), base, cuts)
}

/// The parts of a model that has no optional sections.
fn cuts_of_parts(base: &[u8]) -> Vec<Cut> {
    let model = Model::new(base).expect("a model");
    let [text, _, axes, cuts, groups, splits, leaves, end] = places(base);
    let error = |length: usize, place: usize| (length..=length, "section".to_owned(), place);
    let cut =
        |field, place, length, refused: Vec<Run>| Cut { field, place, length, refused: runs(refused.into_iter()) };
    // Where the thresholds of each axis end.
    let mut ends = vec![0];
    for axis in base[axes..cuts].as_chunks().0 {
        ends.push(ends[ends.len() - 1] + Axis::from_bytes(*axis).expect("an axis").cuts_length());
    }
    // Thresholds that belong to no axis.
    let axes_count = (cuts - axes) / Axis::LENGTH;
    let of_axes = (0..axes_count).map(|left| error(left, axes + Axis::LENGTH * left + ends[left])).collect();
    let of_cuts = (0..groups - cuts).filter_map(|left| match ends.iter().skip(1).position(|&end| end > left) {
        Some(axis) => Some(error(left, cuts + ends[axis])),
        // Of wide trees they have four bytes.
        None => (left % 4 != 0).then(|| error(left, cuts)),
    });
    // Splits that belong to no group.
    let own: Vec<usize> = groups_and_splits(&model).iter().map(|(_, splits)| splits.len()).collect();
    let groups_count = own.len();
    let of_groups = (0..groups_count).map(|left| {
        let first = splits - Group::LENGTH * (groups_count - left);
        error(left, first + own.iter().take(left).sum::<usize>())
    });
    let trees = |length: usize| (0..length).map(|left| error(left, splits)).collect();
    vec![
        cut(68, HEADER_LENGTH, text - HEADER_LENGTH, Vec::new()),
        cut(16, axes, axes_count, of_axes),
        cut(80, cuts, groups - cuts, of_cuts.collect()),
        cut(18, groups, groups_count, of_groups.collect()),
        cut(84, splits, leaves - splits, trees(leaves - splits)),
        cut(88, leaves, end - leaves, trees(end - leaves)),
    ]
}
