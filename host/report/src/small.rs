//! The smallest models, a small object and contrasts of colors, for tests of pages.

use palpate::compile::{self, CompiledModel, compile};
use palpate::ensemble::{self, Ensemble, Node, Output, Tree, inputs};
use palpate::mesh::{Object, builtin};
use palpate_shared::Descriptor;
use std::sync::LazyLock;

pub(crate) use meshes::meshes;

#[path = "../../src/tests/meshes.rs"]
mod meshes;

/// A built-in object, made once.
pub(crate) static BOWL: LazyLock<Object> = LazyLock::new(|| builtin::one("bowl").unwrap());

/// An ensemble of trees whose leaves have a value for each of these objects.
pub(crate) fn ensemble(descriptor: Descriptor, names: &[&str], trees: Vec<Vec<Node>>) -> Ensemble {
    Ensemble {
        inputs: inputs(descriptor),
        objects: names.iter().map(ToString::to_string).collect(),
        base_margins: vec![0.0; names.len()],
        trees: trees.into_iter().map(|nodes| Tree { nodes, output: Output::Each }).collect(),
        origin: ensemble::Provenance::default(),
    }
}

/// One split between two objects of these names.
pub(crate) fn model(names: [&str; 2]) -> CompiledModel {
    let nodes = vec![
        Node::Split { feature: 0, threshold: 9_000.0, missing_left: true, left: 1, right: 2 },
        Node::Leaf(vec![0.5, -0.5]),
        Node::Leaf(vec![-0.5, 0.5]),
    ];
    let ensemble = ensemble(Descriptor::Curvature, &names, vec![nodes]);
    let bytes = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
    CompiledModel::from_bytes(bytes).unwrap()
}

/// Checks that a sentence or an error says all of this.
#[track_caller]
pub(crate) fn assert_says(said: impl std::fmt::Display, parts: &[&str]) {
    let said = said.to_string();
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
}

/// The contrast ratio of WCAG 2, of colors whose channels go up to 255.
pub(crate) fn contrast(a: [f64; 3], b: [f64; 3]) -> f64 {
    let luminance = |color: [f64; 3]| {
        let linear = |channel: f64| match channel / 255.0 {
            dark @ ..=0.04045 => dark / 12.92,
            bright => libm::pow((bright + 0.055) / 1.055, 2.4),
        };
        0.2126 * linear(color[0]) + 0.7152 * linear(color[1]) + 0.0722 * linear(color[2])
    };
    let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
    a.max(b) / a.min(b)
}
