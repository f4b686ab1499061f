//! Random ensembles and the touches that could distinguish them.

use crate::wide::widened;
use palpate::compile::{Compiled, Layout, Leaf, Settings, compile};
use palpate::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree, inputs};
use palpate::with;
use palpate_shared::{ContactTime, Descriptor, Pose, Touch};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

/// Properties of a random ensemble.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Its features.
    pub descriptor: Descriptor,
    /// Number of objects.
    pub objects: usize,
    /// Number of trees.
    pub trees: usize,
    /// Their depth at most.
    pub depth: usize,
    /// One value per leaf for each object, or one for one object.
    pub each: bool,
    /// Largest number of different thresholds.
    pub thresholds: usize,
    /// The largest value of a leaf.
    pub leaf: f32,
}

impl Shape {
    /// Four trees of depth 3 over curvature, for three objects.
    pub const SMALL: Self = Self {
        descriptor: Descriptor::Curvature,
        objects: 3,
        trees: 4,
        depth: 3,
        each: true,
        thresholds: 6,
        leaf: 1.0,
    };
}

/// A random ensemble; thresholds repeat, stand next to whole numbers, and lie between them.
pub fn ensemble(shape: Shape, seed: u64) -> Ensemble {
    let mut rng = SmallRng::seed_from_u64(seed);
    let thresholds: Vec<f32> = (0..shape.thresholds).map(|_| threshold(&mut rng)).collect();
    let trees = (0..shape.trees).map(|index| {
        let output = if shape.each { Output::Each } else { Output::One(index % shape.objects) };
        let mut nodes = Vec::new();
        let eta = 1.0 / (1.0 + index as f32 / 10.0);
        grow(&mut nodes, &mut rng, shape, &thresholds, shape.depth, eta);
        Tree { nodes, output }
    });
    let trees = trees.collect();
    let objects = (0..shape.objects).map(|object| format!("object {object}")).collect();
    let base_margins = (0..shape.objects).map(|_| rng.random_range(-0.5..=0.5)).collect();
    Ensemble { inputs: inputs(shape.descriptor), objects, base_margins, trees, origin: Provenance::default() }
}

/// A random model with leaves of this type, in the layout that is chosen for it.
///
/// # Panics
/// If the shape fits no model.
pub fn model(shape: Shape, seed: u64, leaf: Leaf) -> Vec<u8> {
    compile(&ensemble(shape, seed), &with!(Settings::default(), leaf)).expect("it fits").bytes
}

/// Its models with each type of leaves that it fits, those with splits of three bytes also with splits of six; with these
/// scales of features.
pub fn models(ensemble: &Ensemble, scales: Option<Vec<f32>>) -> Vec<Vec<u8>> {
    let compiled = |&leaf: &Leaf| compile(ensemble, &with!(Settings::default(), leaf, scales = scales.clone())).ok();
    let with_wide = |compiled: Compiled| {
        let wide = (compiled.layout == Layout::Compact).then(|| widened(&compiled.bytes));
        std::iter::once(compiled.bytes).chain(wide)
    };
    Leaf::ALL.iter().filter_map(compiled).flat_map(with_wide).collect()
}

/// The trees over this many features of rows, their thresholds scaled.
pub fn over_rows(mut ensemble: Ensemble, features: usize, scale: f32) -> Ensemble {
    for (number, tree) in ensemble.trees.iter_mut().enumerate() {
        for (index, node) in tree.nodes.iter_mut().enumerate() {
            if let Node::Split { feature, threshold, .. } = node {
                *feature = (*feature * 37 + number * 11 + index) % features;
                *threshold *= scale;
            }
        }
    }
    Ensemble { inputs: Inputs::unnamed(features), ..ensemble }
}

/// The trees with at most this many of their different leaves.
pub fn with_few_leaves(mut ensemble: Ensemble, most: usize) -> Ensemble {
    let nodes = ensemble.trees.iter().flat_map(|tree| &tree.nodes);
    let leaves: Vec<Vec<f32>> =
        nodes.filter_map(|node| if let Node::Leaf(values) = node { Some(values.clone()) } else { None }).collect();
    let mut number = 0;
    for node in ensemble.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
        if let Node::Leaf(values) = node {
            // Spread over the trees, and more often the first ones.
            let picked = (number * 7 + number / 5) % most;
            values.clone_from(&leaves[(picked * picked / most).min(leaves.len() - 1)]);
            number += 1;
        }
    }
    ensemble
}

fn threshold(rng: &mut SmallRng) -> f32 {
    let whole = match rng.random_range(0..4) {
        0 => rng.random_range(-40_i32..40),
        1 => rng.random_range(-33_000..33_000),
        _ => rng.random_range(-200_000..200_000),
    };
    match rng.random_range(0..4) {
        0 => whole as f32,
        1 => whole as f32 + 0.5,
        2 => (whole as f32).next_up(),
        _ => (whole as f32).next_down(),
    }
}

fn grow(nodes: &mut Vec<Node>, rng: &mut SmallRng, shape: Shape, thresholds: &[f32], depth: usize, eta: f32) -> usize {
    let index = nodes.len();
    if depth == 0 || thresholds.is_empty() || rng.random_bool(0.15) {
        let values = if shape.each { shape.objects } else { 1 };
        nodes.push(Node::Leaf((0..values).map(|_| rng.random_range(-1.0..=1.0) * eta * shape.leaf).collect()));
        return index;
    }
    nodes.push(Node::Leaf(Vec::new()));
    let split = (
        rng.random_range(0..shape.descriptor.feature_count()),
        thresholds[rng.random_range(0..thresholds.len())],
        rng.random_bool(0.5),
    );
    let left = grow(nodes, rng, shape, thresholds, depth - 1, eta);
    let right = grow(nodes, rng, shape, thresholds, depth - 1, eta);
    nodes[index] = Node::Split { feature: split.0, threshold: split.1, missing_left: split.2, left, right };
    index
}

/// Random touches, some of them partial, some without a pose.
pub fn touches(count: usize, seed: u64) -> Vec<Touch> {
    let mut rng = SmallRng::seed_from_u64(seed ^ 0x70ac);
    let time = |rng: &mut SmallRng| match rng.random_range(0..8) {
        0 => ContactTime::MISSING,
        1 => ContactTime::FIRST,
        2 => ContactTime::from_micros(rng.random_range(0..50)),
        3 => ContactTime::from_micros(rng.random_range(0..40_000_000)),
        _ => ContactTime::from_micros(rng.random_range(0..150_000)),
    };
    let mut touch = || {
        let touch = Touch::new([time(&mut rng), time(&mut rng), time(&mut rng)]);
        if rng.random_bool(0.2) {
            return touch;
        }
        let mut vector = || [(); 3].map(|()| rng.random_range(-32767..=32767));
        touch.with_pose(Pose { direction: vector(), alignment: vector() })
    };
    (0..count).map(|_| touch()).collect()
}
