//! Writes the inputs of the firmware's benchmarks and of its test of bit-identity:
//!
//! ```text
//! cargo run --release -- run ../shared/objects -o RUN
//! cargo run --release -p palpate-tests --bin bench_models -- OUT RUN     what `palpate run` trained, and its kin
//! cargo run --release -p palpate-tests --bin bench_models -- OUT         random ensembles of the same shapes
//! ```
//!
//! The 1000 one-output trees are the run's own (`paper.json`); the multi-output ensembles are trained on its touches
//! with its settings, except the number of trees and their depth.
//!
//! `OUT` then holds models, what the exporter's model of the evaluator says that they cost, touches (three times of four
//! bytes), the same trees for other evaluators, and for `identity.palpate` what this machine makes of ten thousand touches.

use palpate::Error;
use palpate::Result;
use palpate::compile::{Instructions, Leaf, Settings, compile};
use palpate::ensemble::train::{self, train};
use palpate::ensemble::{Ensemble, Node, Output};
use palpate::touches::Dataset;
use palpate::touches::folds::{self, Split};
use palpate::with;
use palpate_onboard::{Model, Recognizer, Stopping};
use palpate_shared::{Descriptor, Touch};
use palpate_tests::identity;
use palpate_tests::random::{self, Shape};
use palpate_tests::wide::widened;
use std::path::{Path, PathBuf};

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let usage = || Error::setting("output", "missing", "bench_models OUT [RUN]");
    let out = arguments.next().ok_or_else(usage)?;
    let run = arguments.next();
    let data = run.as_ref().map(|run| split(run)).transpose()?;
    let trained = data.as_ref().map(|data| &data.train);
    let one = match &run {
        Some(run) => palpate::ensemble::load(run.join("paper.json"))?,
        None => ensemble(None, train::Settings::paper(), Descriptor::Times)?,
    };
    let compact = |rounds, depth, bins| with!(train::Settings::compact(), rounds, depth, bins);
    let each100 = ensemble(trained, compact(100, 6, 256), Descriptor::Curvature)?;
    let each40 = ensemble(trained, compact(40, 5, 256), Descriptor::Curvature)?;
    let deep = ensemble(trained, compact(20, 7, 256), Descriptor::Curvature)?;
    let few = with!(train::Settings::paper(), rounds = 20, depth = 3);
    let shallow = ensemble(trained, few, Descriptor::Times)?;
    let compiled = |ensemble, leaf| compile(ensemble, &with!(Settings::default(), leaf)).map(|compiled| compiled.bytes);
    let models = [
        ("one-i16", compiled(&one, Leaf::I16)?),
        ("one-i8", compiled(&one, Leaf::I8)?),
        ("one-d3", compiled(&shallow, Leaf::I16)?),
        ("each100-i16", compiled(&each100, Leaf::I16)?),
        ("each100-i8", compiled(&each100, Leaf::I8)?),
        ("each40-i16", compiled(&each40, Leaf::I16)?),
        ("each40-i8", compiled(&each40, Leaf::I8)?),
        ("each20-d7", compiled(&deep, Leaf::I8)?),
        ("each40-wide", widened(&compiled(&each40, Leaf::I16)?)),
        ("identity", compiled(&each40, Leaf::I16)?),
    ];
    let touches = touches(data.as_ref().map(|data| &data.test));
    write(&out.join("touches.bin"), &touches.iter().flat_map(times).collect::<Vec<u8>>())?;
    let mut estimates = Vec::new();
    for (name, bytes) in models {
        let instructions = Instructions::of_model(&Model::new(&bytes).expect("a compiled model"));
        let Instructions { m4f, m0_plus } = instructions;
        println!(
            "{name:16} {:7} bytes, {m4f} instructions on a Cortex-M4F, {:?} on a Cortex-M0+",
            bytes.len(),
            m0_plus
        );
        write(&out.join(format!("{name}.palpate")), &bytes)?;
        for stated in [m4f, m0_plus.unwrap_or(0)] {
            estimates.extend((stated as u32).to_le_bytes());
        }
        if name == "identity" {
            write(&out.join("identity.bin"), &expected(&bytes, &touches)?)?;
        }
    }
    write(&out.join("estimates.bin"), &estimates)?;
    write(&out.join("one-nodes.bin"), &eight_byte_nodes(&one))?;
    write(&out.join("one-irithyll.bin"), &irithyll(&one))
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    palpate::output::write_whole(path, |out| out.write_all(bytes))
}

/// A run's touches, trained and tested on.
fn split(run: &Path) -> Result<Split> {
    // As `palpate run` divides them.
    folds::split(&Dataset::read(&run.join("data"))?, 0.1, 1)
}

/// Trained where there is data; otherwise random, of the same shape and without missing splits.
fn ensemble(data: Option<&Dataset>, settings: train::Settings, descriptor: Descriptor) -> Result<Ensemble> {
    if let Some(data) = data {
        return train(data, &settings, &());
    }
    let each = settings.multi_output;
    let trees = if each { settings.rounds } else { 10 * settings.rounds };
    let thresholds = settings.bins.min(200);
    let shape = Shape { descriptor, objects: 10, trees, depth: settings.depth, each, thresholds, leaf: 0.3 };
    Ok(random::ensemble(shape, 1))
}

/// Ten thousand touches without a pose: of all objects in turn, or random.
fn touches(data: Option<&Dataset>) -> Vec<Touch> {
    let Some(data) = data else {
        return random::touches(10_000, 1).iter().map(|touch| Touch::new(touch.times())).collect();
    };
    let objects = data.objects.len();
    let touch = |index: usize| {
        let touches = data.objects[index % objects].touches();
        Touch::new(touches[index / objects * 7 % touches.len()].times())
    };
    (0..10_000).map(touch).collect()
}

fn times(touch: &Touch) -> Vec<u8> {
    touch.times().into_iter().flat_map(|time| time.micros().unwrap_or(u32::MAX).to_le_bytes()).collect()
}

fn expected(model: &[u8], touches: &[Touch]) -> Result<Vec<u8>> {
    let wrong = |error: &dyn std::fmt::Display| Error::setting("model", error, "one that this crate compiled");
    let model = Model::new(model).map_err(|error| wrong(&error))?;
    let mut recognizer = Recognizer::<10>::new(&model, Stopping::from_model(&model)).map_err(|error| wrong(&error))?;
    Ok(touches.iter().flat_map(|touch| identity::record(&model, &mut recognizer, touch)).collect())
}

/// A plain array: for each tree (grouped by object) its number of nodes as u32, then nodes of eight bytes: threshold or
/// leaf as f32, feature (255: leaf), 0, index of the right child as u16; the left child is the next node.
fn eight_byte_nodes(ensemble: &Ensemble) -> Vec<u8> {
    let mut bytes = Vec::new();
    for tree in by_object(ensemble) {
        let mut nodes = Vec::new();
        preorder(&tree.nodes, 0, &mut nodes);
        bytes.extend((nodes.len() as u32).to_le_bytes());
        for (value, feature, right) in nodes {
            bytes.extend(f32::to_le_bytes(value));
            bytes.extend([feature, 0]);
            bytes.extend(u16::to_le_bytes(right));
        }
    }
    bytes
}

fn preorder(nodes: &[Node], index: usize, out: &mut Vec<(f32, u8, u16)>) {
    match &nodes[index] {
        Node::Leaf(values) => out.push((values[0], 255, 0)),
        Node::Split { feature, threshold, left, right, .. } => {
            let place = out.len();
            out.push((*threshold, *feature as u8, 0));
            preorder(nodes, *left, out);
            out[place].2 = out.len() as u16;
            preorder(nodes, *right, out);
        }
    }
}

fn by_object(ensemble: &Ensemble) -> Vec<&palpate::ensemble::Tree> {
    let mut trees: Vec<_> = ensemble.trees.iter().collect();
    trees.sort_by_key(|tree| match tree.output {
        Output::One(object) => object,
        Output::Each => 0,
    });
    trees
}

/// An ensemble's trees in irithyll-core's format, an ensemble per object, each after its length as u32. It goes right where a
/// feature is greater than the threshold, so thresholds are the next smaller f32.
fn irithyll(ensemble: &Ensemble) -> Vec<u8> {
    let mut bytes = Vec::new();
    let objects = ensemble.objects.len();
    for object in 0..objects {
        let trees: Vec<_> = ensemble.trees.iter().filter(|tree| tree.output == Output::One(object)).collect();
        let mut table = Vec::new();
        let mut nodes = Vec::new();
        for tree in &trees {
            table.extend((tree.nodes.len() as u32).to_le_bytes());
            table.extend((nodes.len() as u32).to_le_bytes());
            for node in &tree.nodes {
                let (value, left, right, flags) = match node {
                    Node::Leaf(values) => (values[0], 0, 0, 0x8000),
                    Node::Split { feature, threshold, left, right, .. } => {
                        (threshold.next_down(), *left as u16, *right as u16, *feature as u16)
                    }
                };
                nodes.extend(value.to_le_bytes());
                nodes.extend(left.to_le_bytes());
                nodes.extend(right.to_le_bytes());
                nodes.extend(flags.to_le_bytes());
                nodes.extend([0, 0]);
            }
        }
        let mut part = b"IRIT".to_vec();
        for number in [1, trees.len() as u16, ensemble.inputs.count() as u16, 0] {
            part.extend(number.to_le_bytes());
        }
        part.extend(ensemble.base_margins[object].to_le_bytes());
        part.extend(table);
        part.extend(nodes);
        bytes.extend((part.len() as u32).to_le_bytes());
        bytes.extend(part);
    }
    bytes
}
