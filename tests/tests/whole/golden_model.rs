//! Pins the model format: these bytes are what version 3 means (`shared/FORMAT.md`).

use palpate::compile::{Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Node, Output, Provenance, Tree, inputs};
use palpate::with;
use palpate_shared::Descriptor;
use palpate_tests::wide::widened;

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

fn compiled(ensemble: &Ensemble, leaf: Leaf) -> Vec<u8> {
    compile(ensemble, &with!(Settings::default(), leaf)).unwrap().bytes
}

/// All after the version, up to the checksum.
fn body(bytes: &[u8]) -> String {
    let (version, text) = (env!("CARGO_PKG_VERSION"), 96);
    assert_eq!(&bytes[text + 1..text + 1 + version.len()], version.as_bytes());
    let bytes = &bytes[text + 1 + version.len()..bytes.len() - 4];
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_bytes_of_both_layouts_are_pinned() {
    let bytes = compiled(&ensemble(), Leaf::I8);
    let mut header = bytes[..96].to_vec();
    // The ensemble's hash has the version in it.
    header[72..80].fill(0);
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    assert_eq!(header.chunks(16).map(hex).collect::<Vec<_>>(), HEADER);
    for (leaf, expected) in LEAVES {
        assert_eq!(body(&compiled(&ensemble(), leaf)), expected, "{leaf:?}");
    }
    assert_eq!(body(&widened(&bytes)), WIDE);
    // Enough equal leaves to store each once.
    let repeated = Ensemble { trees: (0..6).flat_map(|_| ensemble().trees).collect(), ..ensemble() };
    assert_eq!(body(&compiled(&repeated, Leaf::I8)), SHARED);
}

const HEADER: [&str; 6] = [
    "50 4c 50 54 03 00 00 00 b3 00 00 00 01 00 01 01",
    "02 00 01 00 02 00 00 00 03 00 00 00 05 00 00 00",
    "00 00 80 3c 29 3b aa b8 05 00 00 00 00 00 00 00",
    "eb 57 0a d4 fa 95 02 00 c8 00 00 00 00 00 c0 3f",
    "00 00 20 41 0c 00 00 00 00 00 00 00 00 00 00 00",
    "0c 00 00 00 0d 00 00 00 0a 00 00 00 00 00 00 00",
];

const LEAVES: [(Leaf, &str); 3] = [
    (
        Leaf::I8,
        "02 61 62 01 63 00 20 00 00 00 e0 ff ff ff 00 00 00 00 00 00 00 00 00 01 04 02 01 02 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff 00 00 00 00 02 00 00 00 02 00 00 00 00 01 00 00 01 00 00 01 00 c0 40 a0 90 60 80 88 80 78 84",
    ),
    (
        Leaf::I16,
        "02 61 62 01 63 00 00 02 00 00 00 fe ff ff 00 00 00 00 00 00 00 00 00 01 04 02 01 02 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff 00 00 00 00 02 00 00 00 02 00 00 00 00 01 00 00 01 00 00 01 00 00 04 00 fc 00 02 00 01 00 fe 00 00 80 00 00 00 80 ff 40 00",
    ),
    (
        Leaf::F32,
        "02 61 62 01 63 00 00 00 00 3f 00 00 00 bf 00 00 00 00 00 00 00 00 00 01 04 02 01 02 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff 00 00 00 00 02 00 00 00 02 00 00 00 00 01 00 00 01 00 00 01 00 00 00 80 3f 00 00 80 bf 00 00 00 3f 00 00 80 3e 00 00 00 bf 00 00 00 00 00 00 00 3e 00 00 00 00 00 00 00 be 00 00 80 3d",
    ),
];

const WIDE: &str = "02 61 62 01 63 00 20 00 00 00 e0 ff ff ff 00 00 00 00 00 00 00 00 fd ff ff ff e9 03 00 00 70 11 01 00 00 00 00 00 02 00 00 00 02 00 00 01 01 00 00 00 01 00 00 00 00 00 01 00 00 01 02 00 00 00 c0 40 a0 90 60 80 88 80 78 84";

const SHARED: &str = "02 61 62 01 63 00 0c 80 00 00 0e 00 00 00 01 00 00 00 c0 40 a0 90 60 80 88 80 78 84 00 00 20 00 00 00 e0 ff ff ff 00 00 00 00 00 00 00 00 00 01 04 02 01 02 04 01 e9 03 00 00 70 11 01 00 fd ff ff ff 00 00 00 00 0c 00 00 00 02 00 00 00 00 01 00 00 01 00 00 01 00 02 00 00 00 00 01 00 00 01 00 00 01 00 02 00 00 00 00 01 00 00 01 00 00 01 00 02 00 00 00 00 01 00 00 01 00 00 01 00 02 00 00 00 00 01 00 00 01 00 00 01 00 02 00 00 00 00 01 00 00 01 00 00 01 00 00 01 02 03 04 00 01 02 03 04 00 01 02 03 04 00 01 02 03 04 00 01 02 03 04 00 01 02 03 04";
