//! The smallest model and a small object, for tests of pages.

use palpate::compile::{self, CompiledModel, compile};
use palpate::ensemble::{self, Ensemble, Node, Output, Tree, inputs};
use palpate::mesh::{Object, builtin};
use palpate_shared::Descriptor;
use std::sync::LazyLock;

/// A built-in object, made once.
pub(crate) static BOWL: LazyLock<Object> = LazyLock::new(|| builtin::one("bowl").unwrap());

/// One split between two objects of these names.
pub(crate) fn model(names: [&str; 2]) -> CompiledModel {
    let nodes = vec![
        Node::Split { feature: 0, threshold: 9_000.0, missing_left: true, left: 1, right: 2 },
        Node::Leaf(vec![0.5, -0.5]),
        Node::Leaf(vec![-0.5, 0.5]),
    ];
    let ensemble = Ensemble {
        inputs: inputs(Descriptor::Curvature),
        objects: names.map(String::from).into(),
        base_margins: vec![0.0; 2],
        trees: vec![Tree { nodes, output: Output::Each }],
        origin: ensemble::Provenance::default(),
    };
    let bytes = compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
    CompiledModel::from_bytes(bytes).unwrap()
}
