use super::bins::Side;
use super::*;
use crate::ensemble::Node;

/// Rows with labels, and how trees are grown on them.
struct Case {
    features: Vec<f32>,
    columns: usize,
    labels: Vec<u32>,
    weights: Option<Vec<f32>>,
    classes: usize,
    parameters: Parameters,
}

impl Case {
    /// This many rows of a column for each of these kinds: `w`hole numbers, `f`ew different ones, a `c`onstant, `m`issing half
    /// the time, `n`egative numbers and zeros of both signs.
    fn new(kinds: &str, rows: usize, classes: usize, parameters: Parameters) -> Self {
        let mut state = 1_u64;
        let mut random = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        let (mut features, mut labels) = (Vec::new(), Vec::new());
        for row in 0..rows {
            let label = (row * classes / rows) as u64;
            labels.push(label as u32);
            for kind in kinds.bytes() {
                features.push(match kind {
                    b'w' => (random(30_000) + random(4_000 * (label + 1))) as f32,
                    b'f' => random(4 + label) as f32,
                    b'm' if random(2) == 0 => f32::NAN,
                    b'm' => (random(900) + 40 * label) as f32,
                    b'n' => [-(random(50 + 10 * label) as f32), 0.0, -0.0][random(3) as usize],
                    _ => 3.0,
                });
            }
        }
        Self { features, columns: kinds.len(), labels, weights: None, classes, parameters }
    }

    /// The data with a weight for each class.
    fn weighted(self) -> Self {
        let weights = self.labels.iter().map(|&label| 0.3 + 0.7 * label as f32).collect();
        Self { weights: Some(weights), ..self }
    }

    fn rows(&self) -> Rows<'_> {
        let Self { features, columns, labels, weights, .. } = self;
        Rows { features, columns: *columns, labels, weights: weights.as_deref() }
    }

    fn trees(&self, threads: Option<usize>) -> Vec<Tree> {
        train(self.rows(), self.classes, &self.parameters, threads, &|| ControlFlow::Continue(())).unwrap().1
    }
}

const EACH: Parameters = Parameters {
    multi_output: true,
    rounds: 4,
    depth: 5,
    eta: 0.3,
    min_child_weight: 2.0,
    bins: 256,
    base_margin: 0.5,
};
const ONE: Parameters = Parameters { multi_output: false, ..EACH };

/// Cases with the hash of their trees.
fn cases() -> Vec<(&'static str, u64, Case)> {
    let coarse = Parameters { bins: 12, ..ONE };
    let steep = Parameters { eta: 1.0, depth: 3, min_child_weight: 0.0, rounds: 12, ..EACH };
    vec![
        ("each, complete", 0xA886_7659_2312_B2F8, Case::new("ww", 3_000, 10, EACH)),
        ("each, missing, ties, a constant", 0x3769_B91E_E238_1EA7, Case::new("wfcmn", 2_000, 5, EACH)),
        ("each, weighted", 0x68BD_C7AA_74BB_3B83, Case::new("wm", 2_500, 3, EACH).weighted()),
        ("each, only missing or not", 0x9DE9_1253_AF54_EA8F, Case::new("cm", 500, 3, Parameters { bins: 2, ..EACH })),
        ("one, complete", 0x0652_F6FD_84E6_0220, Case::new("ww", 3_000, 10, ONE)),
        ("one, missing, ties, a constant", 0x56A1_9F5C_3FD6_B236, Case::new("wfcmn", 2_000, 5, ONE)),
        ("one, weighted", 0x5DCB_16C0_90ED_E502, Case::new("wf", 2_500, 3, ONE).weighted()),
        ("one, few bins", 0x33CF_402C_F9A4_5CD1, Case::new("wwn", 2_500, 6, coarse)),
        (
            "one, more bins than a byte numbers",
            0xAC74_BCFC_D039_10CB,
            Case::new("wm", 2_500, 3, Parameters { bins: 700, ..ONE }),
        ),
        ("one, blocks of rows", 0xE4EF_09DB_4321_510D, Case::new("wm", 20_000, 3, ONE)),
        ("two classes, far apart", 0xD580_3AB1_F9D6_0753, Case::new("wf", 1_001, 2, steep)),
        ("four classes", 0x35A2_A1AA_C2A4_F3B4, Case::new("wm", 1_003, 4, Parameters { multi_output: false, ..steep })),
    ]
}

/// All bits of trees: their splits and leaves.
fn bits(trees: &[Tree]) -> Vec<u32> {
    let mut bits = Vec::new();
    for node in trees.iter().flat_map(|tree| &tree.nodes) {
        match node {
            Node::Split { feature, threshold, missing_left, left, right } => {
                let numbers = [*feature, usize::from(*missing_left), *left, *right].map(|number| number as u32);
                bits.extend(numbers.into_iter().chain([threshold.to_bits()]));
            }
            Node::Leaf(values) => bits.extend(values.iter().map(|value| value.to_bits())),
        }
    }
    bits
}

/// The FNV-1a hash of numbers.
fn hash(numbers: &[u32]) -> u64 {
    let bytes = numbers.iter().flat_map(|number| number.to_le_bytes());
    bytes.fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3))
}

#[test]
fn trees_keep_the_bits_that_hessboost_gave_them() {
    // With glibc's exponential function, and the standard library's order of equal values: others may differ in the last bit.
    for (name, expected, case) in cases() {
        let trees = case.trees(None);
        let splits = trees.iter().flat_map(|tree| &tree.nodes).filter(|node| node.leaf().is_none()).count();
        assert!(splits > 5, "{name}: {splits} splits");
        assert_eq!(hash(&bits(&trees)), expected, "{name}: {:#x}", hash(&bits(&trees)));
    }
}

#[test]
fn a_small_tree_has_these_thresholds_and_leaves() {
    let features = [1.0, 2.0, f32::NAN, 4.0, 5.0, 6.0, 7.0, 8.0];
    let labels = [0, 0, 0, 0, 1, 1, 2, 2];
    let rows = Rows { features: &features, columns: 1, labels: &labels, weights: None };
    let parameters = Parameters { rounds: 1, depth: 2, min_child_weight: 0.0, ..EACH };
    let (base, trees) = train(rows, 3, &parameters, None, &|| ControlFlow::Continue(())).unwrap();
    assert_eq!(base, [0.5; 3]);
    let split =
        |threshold, missing_left, left| Node::Split { feature: 0, threshold, missing_left, left, right: left + 1 };
    let leaf = |values: [f32; 3]| Node::Leaf(values.to_vec());
    let expected = vec![
        split(5.0, true, 1),
        leaf([0.288_000_02, -0.144_000_01, -0.144_000_01]),
        split(7.0, false, 3),
        leaf([-0.105_882_36, 0.211_764_71, -0.105_882_36]),
        leaf([-0.105_882_36, -0.105_882_36, 0.211_764_71]),
    ];
    assert_eq!(trees, [Tree { nodes: expected, output: Output::Each }]);
}

#[test]
fn threads_change_no_bit_of_any_tree() {
    for (name, _, case) in cases() {
        let alone = bits(&case.trees(Some(1)));
        for threads in [Some(2), Some(5), None] {
            assert!(alone == bits(&case.trees(threads)), "{name}: {threads:?}");
        }
    }
}

#[test]
fn a_value_is_in_the_bins_on_the_side_of_a_threshold_that_a_tree_sends_it_to() {
    for (name, _, case) in cases() {
        let bins = Bins::new(&case.rows(), case.parameters.bins);
        let rows: Vec<u32> = (0..case.labels.len() as u32).collect();
        for (column, ends) in bins.ends.iter().enumerate() {
            assert!(ends.len() <= case.parameters.bins && ends.is_sorted_by(|a, b| a < b), "{name}: {ends:?}");
            for limit in (0..=ends.len()).step_by(1 + ends.len() / 20) {
                for missing_left in [false, true] {
                    let threshold = limit.checked_sub(1).map_or(f32::MIN, |last| ends[last]);
                    let mut left = Vec::new();
                    bins.route(&rows, &Side { column, limit, missing_left }, |row, goes_left| {
                        let value = case.features[row as usize * case.columns + column];
                        let expected = if value.is_nan() { missing_left } else { value < threshold };
                        assert_eq!(goes_left, expected, "{name}: {value} at {threshold}");
                        left.extend(goes_left.then_some(row));
                    });
                    let mut parted = rows.clone();
                    let count = bins.part(&mut parted, &Side { column, limit, missing_left });
                    assert!(parted[..count] == left && parted[count..].is_sorted());
                }
            }
        }
    }
}

#[test]
fn cuts_are_all_values_where_there_are_few_and_quantiles_where_there_are_many() {
    let column = |values: &[f32], bins| cuts::of_column(values.iter().map(|&value| (value, 1.0)), bins);
    assert_eq!(column(&[3.0, 1.0, 2.0, 2.0, 3.0], 8), [2.0, 3.0, 6.00001]);
    assert_eq!(column(&[7.0; 4], 8), [14.00001]);
    assert_eq!(column(&[], 8), [1e-5]);
    let shuffled: Vec<f32> = (0..10_007_u32).map(|index| (index * 4_001 % 10_007) as f32).collect();
    let quarters = column(&shuffled, 4);
    assert_eq!(quarters.len(), 4);
    for (cut, expected) in quarters.iter().zip([2_502.0, 5_003.0, 7_505.0, 20_012.0]) {
        assert!((cut - expected).abs() < 100.0, "{quarters:?}");
    }
    // A weight counts as that many values.
    let heavy = cuts::of_column(shuffled.iter().map(|&value| (value, if value < 100.0 { 1e4 } else { 1.0 })), 4);
    assert!(heavy[1] < 100.0, "{heavy:?}");
}

#[test]
fn the_callback_is_called_after_each_round_and_may_cancel() {
    let case = Case::new("w", 200, 3, EACH);
    let rounds = std::sync::atomic::AtomicUsize::new(0);
    let after = |last| {
        let round = 1 + rounds.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        if round == last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    assert_eq!(train(case.rows(), 3, &EACH, Some(1), &|| after(2)).unwrap_err(), Error::cancelled());
    assert_eq!(rounds.swap(0, std::sync::atomic::Ordering::Relaxed), 2);
    assert_eq!(train(case.rows(), 3, &EACH, None, &|| after(5)).unwrap().1.len(), 4);
}

#[test]
fn rows_that_cannot_be_learned_from_are_refused_by_number() {
    let fails = |change: &dyn Fn(&mut Case)| {
        let mut case = Case::new("wf", 20, 3, EACH).weighted();
        change(&mut case);
        train(case.rows(), 3, &EACH, None, &|| ControlFlow::Continue(())).unwrap_err()
    };
    for infinite in [f32::INFINITY, f32::NEG_INFINITY, 2e38] {
        let failure = fails(&|case| case.features[15] = infinite);
        assert_eq!(failure.to_string(), "row 7 has a feature beyond ±1e38");
    }
    assert_eq!(fails(&|case| case.labels[4] = 3).to_string(), "row 4 has a label that is no class");
    for weight in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let failure = fails(&|case| case.weights.as_mut().unwrap()[9] = weight);
        assert!(failure.what().starts_with("row 9 has a weight"), "{failure}");
    }
    let changes: [&dyn Fn(&mut Case); 4] = [
        &|case| case.columns = 0,
        &|case| case.features.truncate(39),
        &|case| case.weights.as_mut().unwrap().truncate(19),
        &|case| (case.features, case.labels, case.weights) = (Vec::new(), Vec::new(), None),
    ];
    for change in changes {
        assert!(fails(change).what().contains("labels need as many rows"));
    }
}
