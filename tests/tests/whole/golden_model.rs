//! Pins the model format: these bytes are what version 1 means (`shared/FORMAT.md`).

use palpate::compile::{Layout, Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Node, Output, Provenance, Tree, inputs};
use palpate::with;
use palpate_onboard::Model;
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

fn compiled(ensemble: &Ensemble, leaf: Leaf, layout: Layout, shared: bool) -> Vec<u8> {
    let settings = with!(Settings::default(), leaf, layout = Some(layout), shared_leaves = Some(shared));
    compile(ensemble, &settings).unwrap().bytes
}

/// All after the version, up to the checksum.
fn body(bytes: &[u8]) -> String {
    let (version, text) = (env!("CARGO_PKG_VERSION"), 96);
    assert_eq!(&bytes[text + 1..text + 1 + version.len()], version.as_bytes());
    let bytes = &bytes[text + 1 + version.len()..bytes.len() - 4];
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_bytes_of_every_layout_are_pinned() {
    let mut header = compiled(&ensemble(), Leaf::I8, Layout::Complete, false)[..96].to_vec();
    // The ensemble's hash has the version in it.
    header[72..80].fill(0);
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    assert_eq!(header.chunks(16).map(hex).collect::<Vec<_>>(), HEADER);
    let bodies = SECTIONS.map(|(leaf, layout, _)| body(&compiled(&ensemble(), leaf, layout, false)));
    assert_eq!(bodies, SECTIONS.map(|(.., expected)| expected));
    assert_eq!(body(&compiled(&over_patterns(), Leaf::I8, Layout::Patterns, false)), PATTERNS);
    assert_eq!(body(&compiled(&ensemble(), Leaf::I8, Layout::Compact, true)), SHARED);
}

#[test]
fn tables_by_contact_pattern_give_the_margins_worked_out_by_hand() {
    let bytes = compiled(&over_patterns(), Leaf::I8, Layout::Patterns, false);
    let model = Model::new(&bytes).unwrap();
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
