//! Pins the model format: these bytes are what version 1 means (`shared/FORMAT.md`).

use palpate::compile::{Layout, Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Node, Output, Provenance, Tree, inputs};
use palpate::with;
use palpate_onboard::{Model, ModelError};
use palpate_shared::{ContactTime, Descriptor, Touch};

/// Two trees over curvature: κ < 1000.5 (missing left), then slope < -3 (missing right) on the right; and one split.
fn ensemble() -> Ensemble {
    let split =
        |feature, threshold, missing_left, left, right| Node::Split { feature, threshold, missing_left, left, right };
    let leaf = |a: f32, b: f32| Node::Leaf(vec![a, b]);
    let first = vec![
        split(0, 1000.5, true, 1, 2),
        leaf(1.0, -1.0),
        split(1, -3.0, false, 3, 4),
        leaf(0.5, 0.25),
        leaf(-0.5, 0.0),
    ];
    let second = vec![split(0, 70000.0, true, 1, 2), leaf(0.125, 0.0), leaf(-0.125, 0.0625)];
    Ensemble {
        inputs: inputs(Descriptor::Curvature),
        objects: vec!["ab".into(), "c".into()],
        base_margins: vec![0.5, -0.5],
        trees: [first, second].into_iter().map(|nodes| Tree { nodes, output: Output::Each }).collect(),
        origin: Provenance::default(),
    }
}

/// Two trees over contact patterns: pattern < 3, then κ < 1000.5 (missing left) on the right; and pair < 70000 (missing
/// right).
fn over_patterns() -> Ensemble {
    let split =
        |feature, threshold, missing_left, left, right| Node::Split { feature, threshold, missing_left, left, right };
    let leaf = |a: f32, b: f32| Node::Leaf(vec![a, b]);
    let first = vec![
        split(0, 3.0, true, 1, 2),
        leaf(1.0, -1.0),
        split(1, 1000.5, true, 3, 4),
        leaf(0.5, 0.25),
        leaf(-0.5, 0.0),
    ];
    let second = vec![split(3, 70000.0, false, 1, 2), leaf(0.125, 0.0), leaf(-0.125, 0.0625)];
    let trees = [first, second].into_iter().map(|nodes| Tree { nodes, output: Output::Each }).collect();
    Ensemble { inputs: inputs(Descriptor::ContactsCurvature), trees, ..ensemble() }
}

/// Compiles with the version and the ensemble's hash, which may change with a release, set to zero.
fn body(ensemble: &Ensemble, leaf: Leaf, layout: Layout) -> String {
    let compiled = compile(ensemble, &with!(Settings::default(), leaf, layout = Some(layout))).unwrap();
    let version = env!("CARGO_PKG_VERSION");
    let text = 96;
    assert_eq!(&compiled.bytes[text + 1..text + 1 + version.len()], version.as_bytes());
    let bytes = &compiled.bytes[text + 1 + version.len()..compiled.bytes.len() - 4];
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_header_is_pinned() {
    let settings = with!(Settings::default(), leaf = Leaf::I8, layout = Some(Layout::Complete));
    let compiled = compile(&ensemble(), &settings).unwrap();
    let mut header = compiled.bytes[..96].to_vec();
    header[72..80].fill(0);
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    let rows: Vec<String> = header.chunks(16).map(hex).collect();
    assert_eq!(rows, HEADER);
}

#[test]
fn the_sections_of_every_layout_are_pinned() {
    let bodies = SECTIONS.map(|(leaf, layout, _)| body(&ensemble(), leaf, layout));
    assert_eq!(bodies, SECTIONS.map(|(.., expected)| expected));
}

#[test]
fn the_sections_of_tables_by_contact_pattern_are_pinned_and_read_as_worked_out_by_hand() {
    assert_eq!(body(&over_patterns(), Leaf::I8, Layout::Patterns), PATTERNS);
    let settings = with!(Settings::default(), leaf = Leaf::I8, layout = Some(Layout::Patterns));
    let compiled = compile(&over_patterns(), &settings).unwrap();
    let model = Model::new(&compiled.bytes).unwrap();
    let (some, missing) = (ContactTime::from_micros, ContactTime::MISSING);
    for (times, expected) in [
        ([missing; 3], [1.375, -1.4375]),
        ([some(0), missing, missing], [1.375, -1.4375]),
        ([missing, some(0), missing], [1.375, -1.4375]),
        // pair = 69999, then 70000.
        ([some(0), some(69_999), missing], [1.125, -0.25]),
        ([missing, some(70_000), some(0)], [0.875, -0.1875]),
        ([some(5), missing, some(0)], [0.875, -0.1875]),
        // κ = 1000, then 1001.
        ([some(1_000), some(0), some(0)], [0.875, -0.1875]),
        ([some(1_000), some(0), some(1)], [-0.125, -0.4375]),
    ] {
        let mut margins = [0; 2];
        assert!(model.margins(&Touch::new(times), &mut margins));
        assert_eq!(margins.map(|margin| f64::from(margin) * f64::from(model.unit())), expected, "{times:?}");
    }
}

#[test]
fn tables_by_contact_pattern_with_other_axes_are_refused() {
    let settings = with!(Settings::default(), leaf = Leaf::I8, layout = Some(Layout::Patterns));
    let compiled = compile(&over_patterns(), &settings).unwrap().bytes;
    let axes = compiled.windows(4).position(|axis| axis == [1, 1, 4, 1]).unwrap();
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = compiled.clone();
        change(&mut bytes);
        bytes.truncate(bytes.len() - 4);
        bytes.extend(palpate_shared::format::checksum(&bytes).to_le_bytes());
        Model::new(&bytes).map(|_| ()).unwrap_err()
    };
    // Axes of other features, or in another order; another descriptor with as many features.
    assert_eq!(refused(&|bytes| bytes[axes] = 2), ModelError::Section { offset: axes });
    assert_eq!(refused(&|bytes| bytes[axes + 4] = 3), ModelError::Section { offset: axes });
    assert_eq!(refused(&|bytes| bytes[12] = Descriptor::Gravity.code()), ModelError::Section { offset: axes });
    // A layout that no release knows.
    assert_eq!(refused(&|bytes| bytes[6] = 5), ModelError::Field { offset: 6 });
}

#[test]
fn the_sections_of_a_model_with_shared_leaves_are_pinned() {
    let settings =
        with!(Settings::default(), leaf = Leaf::I8, layout = Some(Layout::Compact), shared_leaves = Some(true));
    let compiled = compile(&ensemble(), &settings).unwrap();
    let at = 97 + env!("CARGO_PKG_VERSION").len();
    let body = &compiled.bytes[at..compiled.bytes.len() - 4];
    assert_eq!(body.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" "), SHARED);
    // Who does not know the section must not take numbers for values.
    let tag = u16::from_le_bytes([compiled.bytes[at + 6], compiled.bytes[at + 7]]);
    assert_eq!((compiled.bytes[4], tag), (2, 12 | 1 << 15));
}

#[test]
fn a_golden_model_gives_the_margins_worked_out_by_hand() {
    let touches = [
        // κ = 80000, slope = 20000: right, right; right.
        (Touch::from_micros([30_000, 0, 50_000]), [0.5 - 0.5 - 0.125, -0.5 + 0.0 + 0.0625]),
        // κ = 100, slope = 100: left; left.
        (Touch::from_micros([0, 0, 100]), [0.5 + 1.0 + 0.125, -0.5 - 1.0]),
        // κ missing, slope missing: left; left.
        (Touch::new([ContactTime::FIRST, ContactTime::MISSING, ContactTime::MISSING]), [1.625, -1.5]),
    ];
    let compiled = SECTIONS.map(|(leaf, layout, _)| {
        compile(&ensemble(), &with!(Settings::default(), leaf, layout = Some(layout))).unwrap().bytes
    });
    let shared = [Layout::Compact, Layout::Complete, Layout::Wide].map(|layout| {
        let settings = with!(Settings::default(), layout = Some(layout), shared_leaves = Some(true));
        compile(&ensemble(), &settings).unwrap().bytes
    });
    for bytes in compiled.iter().chain(&shared).chain([&palpate_tests::unaligned::model()]) {
        let model = Model::new(bytes).unwrap();
        for (touch, expected) in touches {
            let mut margins = [0; 2];
            model.margins(&touch, &mut margins);
            for (margin, expected) in margins.into_iter().zip(expected) {
                let margin = f64::from(margin) * f64::from(model.unit());
                assert!((margin - expected).abs() <= f64::from(model.margin_error()), "{margin} for {expected}");
            }
        }
    }
}

const HEADER: [&str; 6] = [
    "50 4c 50 54 01 00 01 00 bc 00 00 00 01 00 01 01",
    "02 00 02 00 02 00 00 00 03 00 00 00 05 00 00 00",
    "00 00 80 3c 29 3b aa b8 05 00 00 00 00 00 00 00",
    "eb 57 0a d4 fa 95 02 00 c8 00 00 00 00 00 c0 3f",
    "00 00 20 41 0c 00 00 00 00 00 00 00 00 00 00 00",
    "0c 00 00 00 0c 00 00 00 0c 00 00 00 00 00 00 00",
];

const PATTERNS: &str = "02 61 62 01 63 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 01 01 04 01 02 01 02 00 03 01 04 01 e9 03 00 00 70 11 01 00 d8 24 d8 24 d8 24 c8 70 b8 74 b8 74 b8 74 78 64";

const SHARED: &str = "02 61 62 01 63 00 0c 80 00 00 0e 00 00 00 01 00 00 00 88 80 78 84 c0 40 a0 90 60 80 00 00 20 00 00 00 e0 ff ff ff 00 00 00 00 00 00 00 00 00 01 04 02 01 02 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff 00 00 00 00 01 00 00 00 00 00 00 00 01 00 00 00 01 00 00 01 00 02 00 00 00 00 01 00 00 00 01 02 03 04";

const SECTIONS: [(Leaf, Layout, &str); 5] = [
    (
        Leaf::I8,
        Layout::Complete,
        "02 61 62 01 63 00 20 00 00 00 e0 ff ff ff 00 00 00 00 00 00 00 00 00 01 04 02 01 02 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff 01 00 00 00 01 00 00 00 02 00 00 00 01 00 00 00 01 00 00 01 01 00 00 01 00 00 00 00 88 80 78 84 c0 40 c0 40 a0 90 60 80",
    ),
    (
        Leaf::I16,
        Layout::Compact,
        "02 61 62 01 63 00 00 02 00 00 00 fe ff ff 00 00 00 00 00 00 00 00 00 01 04 02 01 02 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff 00 00 00 00 01 00 00 00 00 00 00 00 01 00 00 00 01 00 00 01 00 02 00 00 00 00 01 00 00 80 00 00 00 80 ff 40 00 00 04 00 fc 00 02 00 01 00 fe 00 00",
    ),
    (
        Leaf::I8,
        Layout::Wide,
        "02 61 62 01 63 00 20 00 00 00 e0 ff ff ff 00 00 00 00 00 00 00 00 fd ff ff ff e9 03 00 00 70 11 01 00 00 00 00 00 01 00 00 00 00 00 00 00 01 00 00 00 01 00 00 01 02 00 00 00 02 00 00 01 01 00 00 00 01 00 00 00 00 00 88 80 78 84 c0 40 a0 90 60 80",
    ),
    (
        Leaf::I8,
        Layout::Grid,
        "02 61 62 01 63 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 01 04 02 01 01 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff e8 20 e8 20 e8 20 c8 70 88 60 88 60 b8 74 78 64 78 64 e8 20 e8 20 e8 20",
    ),
    (
        Leaf::F32,
        Layout::Compact,
        "02 61 62 01 63 00 00 00 00 3f 00 00 00 bf 00 00 00 00 00 00 00 00 00 01 04 02 01 02 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff 00 00 00 00 02 00 00 00 02 00 00 00 00 01 00 00 01 00 00 01 00 00 00 80 3f 00 00 80 bf 00 00 00 3f 00 00 80 3e 00 00 00 bf 00 00 00 00 00 00 00 3e 00 00 00 00 00 00 00 be 00 00 80 3d",
    ),
];
