//! Seconds to train an ensemble: Palpate's trainer and `hessboost` 0.4, whose trees have to be the same, bit for bit, on the
//! same rows.
//!
//! ```text
//! cargo bench --manifest-path tests/peers/Cargo.toml --bench trainer
//! cargo bench --manifest-path tests/peers/Cargo.toml --bench trainer -- --quick     a few seconds, no times to rely on
//! PALPATE_BENCH_DATA=data cargo bench ...                                    on touches that `palpate capture` made
//! ```
//!
//! Without captured touches, they are made up: the times between contacts of ten objects that bend differently. On one thread
//! its processor time counts, on two the time of day.

use hessboost::config::MultiStrategy;
use hessboost::data::DMatrix;
use hessboost::objective::Multiclass;
use hessboost::prelude::{Objective, Trainer, TrainingParams, TreeMethod};
use palpate::ensemble::train::{BASE_MARGIN, Settings, train};
use palpate::ensemble::{Node, Output, Tree, feature_row};
use palpate::touches::{Dataset, ObjectTouches, Source};
use palpate::with;
use palpate_peers::{QUICK, paired};
use palpate_shared::format::Counted;
use palpate_shared::{ContactTime, Descriptor, Touch};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use std::time::Instant;

/// Made-up objects, and touches of each.
const OBJECTS: u32 = 10;
const TOUCHES: [usize; 3] = [2_100, 6_300, 18_900];

fn main() {
    // The thread that is timed does all the work of one thread.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().expect("a thread");
    let given = std::env::var_os("PALPATE_BENCH_DATA").map(|data| Dataset::read(data.as_ref()).expect("touches"));
    let datasets = match given {
        Some(data) => vec![data],
        None => TOUCHES.iter().take(if *QUICK { 1 } else { 3 }).map(|&count| made_up(count)).collect(),
    };
    for dataset in &datasets {
        let touches = dataset.touches().count();
        for (name, settings) in presets() {
            for threads in [1, 2] {
                let settings = with!(settings.clone(), threads = (threads > 1).then_some(threads));
                println!("\n{name}, {touches} touches, {threads} threads");
                if threads == 1 { pool.install(|| compare(dataset, &settings)) } else { compare(dataset, &settings) }
            }
        }
    }
}

/// Models trained: both presets, on full touches and on every contact.
fn presets() -> Vec<(&'static str, Settings)> {
    let each = with!(Settings::compact(), leaf_bits = None, counted = Some(Counted::Full));
    let one = with!(Settings::paper(), rounds = 20);
    let contacts = |settings: &Settings| {
        with!(settings.clone(), descriptor = Descriptor::ContactsCurvature, counted = Some(Counted::Contacts))
    };
    vec![
        ("30 trees of all objects, full touches", each.clone()),
        ("30 trees of all objects, every contact", contacts(&each)),
        ("20 trees for each object, full touches", one.clone()),
        ("20 trees for each object, every contact", contacts(&one)),
    ]
}

fn compare(dataset: &Dataset, settings: &Settings) {
    let settings = settings.resolved(dataset);
    let ours = || train(dataset, &settings, &()).expect("an ensemble").trees;
    let theirs = || hessboost(dataset, &settings);
    assert!(same(&ours(), &theirs()), "trees that differ");
    let seconds = if settings.threads.is_none() {
        let paired = paired(
            7,
            0.2,
            &mut [&mut |times| (0..times).for_each(|_| drop(ours())), &mut |times| {
                (0..times).for_each(|_| drop(theirs()))
            }],
        );
        (paired.seconds[0], paired.ratios[1])
    } else {
        by_the_clock(ours, theirs)
    };
    println!("  the same trees; ours {:.4} s, hessboost {:.2} times as long", seconds.0, seconds.1);
}

/// Ours in seconds of the day, and how many times as long theirs take: medians over rounds.
fn by_the_clock(ours: impl Fn() -> Vec<Tree>, theirs: impl Fn() -> Vec<Tree>) -> (f64, f64) {
    let time = |train: &dyn Fn() -> Vec<Tree>| {
        let start = Instant::now();
        drop(train());
        start.elapsed().as_secs_f64()
    };
    let rounds = if *QUICK { 1 } else { 7 };
    let times: Vec<[f64; 2]> = (0..rounds).map(|_| [time(&ours), time(&theirs)]).collect();
    let median = |mut numbers: Vec<f64>| {
        numbers.sort_by(f64::total_cmp);
        numbers[numbers.len() / 2]
    };
    (
        median(times.iter().map(|times| times[0]).collect()),
        median(times.iter().map(|times| times[1] / times[0]).collect()),
    )
}

/// The trees of `hessboost` with the same settings.
fn hessboost(dataset: &Dataset, settings: &Settings) -> Vec<Tree> {
    let patterns = settings.counted.expect("settled").patterns();
    let (mut features, mut labels) = (Vec::new(), Vec::new());
    for (label, object) in dataset.objects.iter().enumerate() {
        for touch in object.touches().iter().filter(|touch| patterns.contains(touch.pattern())) {
            features.extend(feature_row(settings.descriptor, touch));
            labels.push(label as f32);
        }
    }
    let objects = dataset.objects.len();
    let counts: Vec<usize> =
        (0..objects).map(|object| labels.iter().filter(|label| **label == object as f32).count()).collect();
    let columns = settings.descriptor.feature_count();
    let mut data = DMatrix::from_dense_vec(features, labels.len(), columns).expect("rows");
    data = data.with_labels(&labels).expect("labels");
    if counts.iter().any(|count| *count != counts[0]) {
        let weight = |label: &f32| (labels.len() as f64 / (counts[*label as usize] * objects) as f64) as f32;
        data = data.with_weights(&labels.iter().map(weight).collect::<Vec<f32>>()).expect("weights");
    }
    let strategy = if settings.multi_output { MultiStrategy::MultiOutputTree } else { MultiStrategy::OneOutputPerTree };
    let parameters = TrainingParams::builder()
        .objective(Objective::Softprob(Multiclass::new(objects).expect("objects")))
        .tree_method(TreeMethod::Hist)
        .multi_strategy(strategy)
        .max_depth(settings.depth)
        .eta(settings.eta)
        .min_child_weight(settings.min_child_weight)
        .max_bin(settings.bins)
        .base_score(f64::from(BASE_MARGIN));
    let parameters = match settings.threads {
        Some(threads) => parameters.nthread(threads).build(),
        None => parameters.global_pool().build(),
    };
    let parameters = parameters.expect("parameters");
    let model = Trainer::new(&parameters, &data, settings.rounds).train().expect("a model").model;
    let trees = model.trees().iter().zip(model.tree_outputs()).map(|(tree, outputs)| Tree {
        output: if tree.is_vector_leaf() { Output::Each } else { Output::One(outputs.start) },
        nodes: (tree.nodes().iter().enumerate())
            .map(|(index, node)| match (usize::try_from(node.left), usize::try_from(node.right)) {
                (Ok(left), Ok(right)) => Node::Split {
                    feature: node.split_feature as usize,
                    threshold: node.split_cond,
                    missing_left: node.default_left,
                    left,
                    right,
                },
                _ => Node::Leaf(tree.leaf_vector(index).to_vec()),
            })
            .collect(),
    });
    trees.collect()
}

/// True if all numbers are the same, zeros' signs included.
fn same(ours: &[Tree], theirs: &[Tree]) -> bool {
    let zeros = |trees: &[Tree]| -> Vec<u32> {
        let leaves = trees.iter().flat_map(|tree| &tree.nodes).filter_map(Node::leaf);
        leaves.flatten().map(|value| value.to_bits()).collect()
    };
    ours == theirs && zeros(ours) == zeros(theirs)
}

/// Objects that bend differently; a touch in five misses a contact.
fn made_up(count: usize) -> Dataset {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut touch = |object: u32| {
        let slope = random.random_range(0..200_000_u32);
        let bend = random.random_range(0..12_000 * (object + 1)) + random.random_range(0..12_000 * (object + 1));
        let mut times = [500_000, 500_000 + slope / 2 + bend, 500_000 + slope].map(ContactTime::from_micros);
        if random.random_range(0..5) == 0 {
            times[random.random_range(0..3)] = ContactTime::MISSING;
        }
        Touch::new(times)
    };
    let object = |object: u32| {
        let touches = (0..count).map(|_| touch(object)).collect();
        ObjectTouches::new(format!("object{object}"), touches, Source::Object)
    };
    Dataset::new((0..OBJECTS).map(object).collect())
}
