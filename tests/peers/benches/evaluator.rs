//! Nanoseconds per touch on this machine: the compiled model, `hessboost`'s own predictor, `gbdt` and `irithyll-core`,
//! on the same ensemble and the same rows.
//!
//! ```text
//! cargo bench --manifest-path tests/peers/Cargo.toml --bench evaluator
//! cargo bench --manifest-path tests/peers/Cargo.toml --bench evaluator -- --quick     a few seconds, no times to rely on
//! PALPATE_BENCH_DATA=data cargo bench ...                                    on touches that `palpate capture` made
//! ```
//!
//! Without captured touches, both ensembles are random, of the shape that training gives. All margins are compared
//! before anything is timed. `gbdt` and `irithyll-core` have no trees with one value per object, so for them each
//! multi-output tree is split into one tree per object.

use hessboost::prelude::{BoostedModel, Iterations, ModelFormat};
use palpate::compile::{Leaf, Settings, compile};
use palpate::ensemble::train;
use palpate::ensemble::{Ensemble, Node, Output, OverTouches, Tree, feature_row, inputs};
use palpate::touches::Dataset;
use palpate::with;
use palpate_onboard::{Batch, Model};
use palpate_peers::{QUICK, paired};
use palpate_shared::Touch;
use std::fmt::Write as _;
use std::hint::black_box;
use std::sync::LazyLock;
use std::time::Instant;

/// Rows that are timed.
const ROWS: usize = 2000;

/// Types of leaves that are timed.
const LEAVES: [Leaf; 3] = [Leaf::I16, Leaf::I8, Leaf::F32];

/// Number of runs; the fastest one counts, since the others were disturbed.
static RUNS: LazyLock<usize> = LazyLock::new(|| if *QUICK { 1 } else { 7 });

fn main() {
    let data = std::env::var_os("PALPATE_BENCH_DATA").map(|data| Dataset::read(data.as_ref()).expect("touches"));
    let touches = touches(data.as_ref());
    let paper = train::Settings::paper();
    let compact = with!(train::Settings::compact(), rounds = 100);
    for (name, settings) in
        [("1000 one-output trees, depth 6, times", paper), ("100 multi-output trees, depth 6, curvature", compact)]
    {
        let ensemble = match &data {
            Some(data) => train::train(data, &settings, &()).expect("a trained ensemble"),
            None => random(&settings),
        };
        compare(name, &ensemble, &touches);
    }
}

fn compare(name: &str, ensemble: &Ensemble, touches: &[Touch]) {
    let rows: Vec<Vec<f32>> =
        touches.iter().filter_map(|touch| Some(feature_row(ensemble.descriptor()?, touch))).collect();
    let expected: Vec<Vec<f32>> = touches.iter().map(|touch| ensemble.margins(touch)).collect();
    println!("\n{name}: {} touches", touches.len());
    let mut ours = f64::INFINITY;
    let mut margins = vec![0; ensemble.objects.len()];
    for leaf in LEAVES {
        let compiled = compile(ensemble, &with!(Settings::default(), leaf)).expect("a compiled ensemble");
        let model = Model::new(&compiled.bytes).expect("a valid model");
        for (touch, expected) in touches.iter().zip(&expected) {
            model.margins(touch, &mut margins);
            let errors = margins
                .iter()
                .zip(expected)
                .map(|(&m, e)| (f64::from(m) * f64::from(model.unit()) - f64::from(*e)).abs());
            assert!(errors.fold(0.0, f64::max) <= f64::from(model.margin_error()));
        }
        let time = nanoseconds(touches, |touch| model.margins(touch, black_box(&mut margins)));
        ours = if leaf == Leaf::I16 { time } else { ours };
        let label = format!("palpate {}", leaf.name());
        println!("  {label:26} {time:9.0} ns {:9} bytes", compiled.bytes.len());
    }
    let mut out = vec![0.0; ensemble.objects.len()];
    let hessboost = hessboost(ensemble);
    check("hessboost", &rows, &expected, |row| {
        hessboost.predict_margin_row_into(row, Iterations::Best, &mut out).expect("margins");
        out.clone()
    });
    let time =
        nanoseconds(&rows, |row| hessboost.predict_margin_row_into(row, Iterations::Best, black_box(&mut out)).is_ok());
    report("hessboost, row by row", time, ours);
    all_at_once(ensemble, touches, &rows, &hessboost);

    let single = taken_apart(ensemble);
    let bytes: Vec<Words> = (0..ensemble.objects.len()).map(|object| irithyll(&single, object)).collect();
    let views: Vec<_> = bytes
        .iter()
        .map(|bytes| irithyll_core::EnsembleView::from_bytes(bytes.bytes()).expect("packed trees"))
        .collect();
    check("irithyll-core", &rows, &expected, |row| views.iter().map(|view| view.predict(row)).collect());
    let time = nanoseconds(&rows, |row| views.iter().map(|view| view.predict(row)).sum::<f32>());
    report("irithyll-core", time, ours);

    let gbdts: Vec<_> = (0..ensemble.objects.len()).map(|object| gbdt(&single, object)).collect();
    let data: Vec<_> = rows.iter().map(|row| gbdt::decision_tree::Data::new_test_data(row.clone(), None)).collect();
    for (object, gbdt) in gbdts.iter().enumerate() {
        let errors = gbdt.predict(&data).into_iter().zip(&expected).map(|(a, b)| (a - b[object]).abs());
        assert!(errors.fold(0.0, f32::max) < 1e-3, "gbdt is off");
    }
    let time = best(|| gbdts.iter().for_each(|gbdt| drop(black_box(gbdt.predict(&data))))) / rows.len() as f64;
    report("gbdt, all at once", time, ours);
}

/// All rows at once, in paired rounds of one thread: Palpate, Palpate row by row, and hessboost.
fn all_at_once(ensemble: &Ensemble, touches: &[Touch], rows: &[Vec<f32>], hessboost: &BoostedModel) {
    let flat: Vec<f32> = rows.concat();
    let descriptor = ensemble.descriptor().expect("a descriptor");
    let (objects, mut batch) = (ensemble.objects.len(), Batch::new());
    println!("  all at once, one thread, medians of {PAIRED} paired rounds:");
    for leaf in LEAVES {
        let compiled = compile(ensemble, &with!(Settings::default(), leaf)).expect("a compiled ensemble");
        let model = Model::new(&compiled.bytes).expect("a valid model");
        let mut singly = vec![0; objects * touches.len()];
        let row_by_row = |margins: &mut [i32]| {
            for (touch, margins) in touches.iter().zip(margins.chunks_exact_mut(objects)) {
                model.margins(touch, margins);
            }
        };
        row_by_row(&mut singly);
        let mut together = vec![0; objects * touches.len()];
        let mut features = Vec::new();
        let mut batched = |margins: &mut [i32]| {
            features.clear();
            touches.iter().for_each(|touch| features.extend(descriptor.features(touch).as_slice()));
            assert!(model.margins_of_rows(&features, margins, &mut batch));
        };
        batched(&mut together);
        assert!(singly == together, "rows at once give other margins");
        let mut ours = |items: usize| (0..items).for_each(|_| batched(black_box(&mut together)));
        let mut one_by_one = |items: usize| (0..items).for_each(|_| row_by_row(black_box(&mut singly)));
        let mut theirs = |items: usize| {
            let predict = || drop(black_box(hessboost.predict_margin_rows(black_box(&flat), Iterations::Best)));
            POOL.install(|| (0..items).for_each(|_| predict()));
        };
        let paired = paired(PAIRED, 0.1, &mut [&mut ours, &mut one_by_one, &mut theirs]);
        let names = ["palpate", "palpate, row by row", "hessboost"];
        for ((name, seconds), ratio) in names.iter().zip(&paired.seconds).zip(&paired.ratios) {
            let leaf = leaf.name();
            println!("    {leaf:4} {name:20} {:9.1} ns {ratio:6.2} ×", 1e9 * seconds / touches.len() as f64);
        }
    }
}

/// This thread alone: hessboost's blocks of rows are tasks of the pool that it is called in.
static POOL: LazyLock<rayon::ThreadPool> = LazyLock::new(|| {
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().expect("a pool of this thread")
});

/// Rounds in which all take turns.
const PAIRED: usize = 31;

fn check(name: &str, rows: &[Vec<f32>], expected: &[Vec<f32>], mut margins: impl FnMut(&[f32]) -> Vec<f32>) {
    for (row, expected) in rows.iter().zip(expected) {
        let errors = margins(row).into_iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(errors < 1e-3, "{name} is off by {errors}");
    }
}

fn report(name: &str, time: f64, ours: f64) {
    println!("  {name:26} {time:9.0} ns {:9.2} × palpate i16", time / ours);
}

/// Nanoseconds per item.
fn nanoseconds<T, R>(items: &[T], mut f: impl FnMut(&T) -> R) -> f64 {
    best(|| {
        for item in items {
            black_box(f(black_box(item)));
        }
    }) / items.len() as f64
}

fn best(mut f: impl FnMut()) -> f64 {
    let run = |_| {
        let start = Instant::now();
        f();
        start.elapsed().as_secs_f64() * 1e9
    };
    (0..*RUNS).map(run).fold(f64::INFINITY, f64::min)
}

fn touches(data: Option<&Dataset>) -> Vec<Touch> {
    let Some(data) = data else {
        let mut random = Random(7);
        return (0..ROWS).map(|_| Touch::from_micros([0; 3].map(|_: u32| random.below(100_000)))).collect();
    };
    let touch = |index: usize| {
        let touches = data.objects[index % data.objects.len()].touches();
        touches[index * 7 % touches.len()]
    };
    (0..ROWS).map(touch).collect()
}

/// A generator that is good enough to scatter thresholds (xorshift).
struct Random(u32);

impl Random {
    fn below(&mut self, limit: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0 % limit
    }
}

/// Full trees with random splits.
fn random(settings: &train::Settings) -> Ensemble {
    let mut random = Random(1);
    let features = settings.descriptor.feature_count();
    let mut tree = |output: Output| {
        let first_leaf = (1 << settings.depth) - 1;
        let node = |index: usize, random: &mut Random| {
            if index < first_leaf {
                let threshold = (random.below(200) * 500) as f32 + 0.5;
                let feature = random.below(features as u32) as usize;
                return Node::Split {
                    feature,
                    threshold,
                    missing_left: true,
                    left: 2 * index + 1,
                    right: 2 * index + 2,
                };
            }
            let values = if output == Output::Each { 10 } else { 1 };
            Node::Leaf((0..values).map(|_| random.below(20_001) as f32 / 32_768.0 - 0.3).collect())
        };
        let nodes = (0..2 * first_leaf + 1).map(|index| node(index, &mut random)).collect();
        Tree { nodes, output }
    };
    let trees = if settings.multi_output {
        (0..settings.rounds).map(|_| tree(Output::Each)).collect()
    } else {
        (0..10 * settings.rounds).map(|index| tree(Output::One(index % 10))).collect()
    };
    let objects = (0..10).map(|object| object.to_string()).collect();
    Ensemble {
        inputs: inputs(settings.descriptor),
        objects,
        base_margins: vec![0.5; 10],
        trees,
        origin: Default::default(),
    }
}

/// An ensemble with the same margins, from trees with one value a leaf.
fn taken_apart(ensemble: &Ensemble) -> Ensemble {
    let objects = ensemble.objects.len();
    let mut trees = Vec::new();
    for tree in &ensemble.trees {
        if tree.output != Output::Each {
            trees.push(tree.clone());
            continue;
        }
        for object in 0..objects {
            let mut nodes = tree.nodes.clone();
            for node in &mut nodes {
                if let Node::Leaf(values) = node {
                    *values = vec![values[object]];
                }
            }
            trees.push(Tree { nodes, output: Output::One(object) });
        }
    }
    Ensemble { trees, ..ensemble.clone() }
}

fn trees_of(ensemble: &Ensemble, object: usize) -> impl Iterator<Item = &Tree> {
    ensemble.trees.iter().filter(move |tree| tree.output == Output::One(object))
}

fn hessboost(ensemble: &Ensemble) -> BoostedModel {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("ensemble.json");
    ensemble.save(&path).expect("a saved ensemble");
    // hessboost reads a list only, as XGBoost 3 writes it.
    let text = std::fs::read_to_string(&path).expect("the saved ensemble");
    let text = text.replace("\"base_score\":\"5E-1\"", "\"base_score\":\"[5E-1]\"");
    BoostedModel::decode(text, ModelFormat::XgboostJson).expect("a model that hessboost reads")
}

/// Bytes that start on a word's boundary, as irithyll-core wants them.
struct Words {
    buffer: Vec<u8>,
    start: usize,
}

impl Words {
    fn new(bytes: &[u8]) -> Self {
        let mut buffer = Vec::<u8>::with_capacity(bytes.len() + 4);
        let start = buffer.as_ptr().align_offset(4);
        buffer.resize(start, 0);
        buffer.extend(bytes);
        Self { buffer, start }
    }

    fn bytes(&self) -> &[u8] {
        &self.buffer[self.start..]
    }
}

/// An object's trees in irithyll-core's format. It goes right where a feature is greater than the threshold, so
/// thresholds are the next smaller f32.
fn irithyll(ensemble: &Ensemble, object: usize) -> Words {
    let (mut table, mut nodes, mut count) = (Vec::new(), Vec::new(), 0_u16);
    for tree in trees_of(ensemble, object) {
        count += 1;
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
            nodes.extend([left, right, flags, 0].into_iter().flat_map(u16::to_le_bytes));
        }
    }
    let mut bytes = b"IRIT".to_vec();
    let features = ensemble.inputs.count() as u16;
    bytes.extend([1, count, features, 0].into_iter().flat_map(u16::to_le_bytes));
    bytes.extend(ensemble.base_margins[object].to_le_bytes());
    bytes.extend(table);
    bytes.extend(nodes);
    Words::new(&bytes)
}

/// An object's trees read by gbdt from XGBoost's text dump.
fn gbdt(ensemble: &Ensemble, object: usize) -> gbdt::gradient_boost::GBDT {
    let mut dump = format!("{}\n[", ensemble.base_margins[object]);
    for (index, tree) in trees_of(ensemble, object).enumerate() {
        dump.push_str(if index > 0 { "," } else { "" });
        describe(&tree.nodes, 0, &mut dump);
    }
    dump.push(']');
    gbdt::gradient_boost::GBDT::from_xgboost_reader(dump.as_bytes(), "reg:linear").expect("a dump that gbdt reads")
}

fn describe(nodes: &[Node], index: usize, dump: &mut String) {
    match &nodes[index] {
        Node::Leaf(values) => _ = write!(dump, "{{\"nodeid\":{index},\"leaf\":{:e}}}", values[0]),
        Node::Split { feature, threshold, missing_left, left, right } => {
            let missing = if *missing_left { left } else { right };
            _ = write!(
                dump,
                "{{\"nodeid\":{index},\"split\":{feature},\"split_condition\":{threshold:e},\"yes\":{left},\"no\":{right},\"missing\":{missing},\"children\":["
            );
            describe(nodes, *left, dump);
            dump.push(',');
            describe(nodes, *right, dump);
            dump.push_str("]}");
        }
    }
}
