//! Trees that split by sets of categories decide as those of the file.

use super::draft::{Draft, DraftTree};
use super::draft_node::DraftNode;
use super::set::Set;
use super::spelled_out::spelled_out;
use crate::ensemble::{Ensemble, Output, Threshold};

fn ensemble(nodes: Vec<DraftNode>) -> Ensemble {
    let trees = vec![DraftTree { nodes, output: Output::One(0) }];
    let features = vec!["kind".into(), "size".into()];
    Draft { features, base: vec![0.0], trees, ..Draft::default() }.finish(None).unwrap()
}

fn set(feature: usize, set: &Set, missing_inside: bool, inside: usize, outside: usize) -> DraftNode {
    DraftNode::Set { feature, set: set.clone(), missing_inside, inside, outside }
}

fn leaf(value: f64) -> DraftNode {
    DraftNode::Leaf(vec![value])
}

#[test]
fn a_set_holds_the_values_that_truncate_to_its_categories_and_no_other_f32() {
    for truncates in [false, true] {
        let categories = [0_u32, 1, 3, 7, 8, 9, (1 << 24) - 1, 1 << 24, (1 << 24) + 2];
        let own = Set::of_categories(categories, truncates).unwrap();
        for missing in [false, true] {
            let ensemble = ensemble(vec![set(0, &own, missing, 1, 2), leaf(1.0), leaf(2.0)]);
            let mut values = vec![f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, -0.0, -0.5, -1.0, -1.5];
            for category in 0..12 {
                let category = category as f32;
                values.extend([category, category.next_down(), category.next_up(), category + 0.5]);
            }
            values.extend((-4..6).map(|step| (16_777_216 + step) as f32));
            for x in values {
                let below = if truncates { -1.0 } else { 0.0_f32.next_down() };
                let category = f64::from(x).trunc();
                let is_inside = x > below && categories.iter().any(|own| f64::from(*own) == category);
                let expected = if is_inside { 1.0 } else { 2.0 };
                assert_eq!(ensemble.margins_of_features(&[x, 0.0]), [expected], "{x:e}, {truncates}");
            }
            let expected = if missing { 1.0 } else { 2.0 };
            assert_eq!(ensemble.margins_of_features(&[f32::NAN, 0.0]), [expected]);
        }
    }
}

#[test]
fn sets_under_sets_and_thresholds_decide_as_the_tree_of_the_file_for_every_category_and_missing_values() {
    let sets = [
        Set::of_categories([0, 2, 3, 6], false).unwrap(),
        Set::of_categories([1, 2, 5, 6], true).unwrap(),
        Set::of_categories([], false).unwrap(),
        Set::of_numbers(vec![-3, 2, 3, 4]),
        Set::of_categories([0, 3, 7], false).unwrap().and_beyond(8.0),
    ];
    for first in &sets {
        for (second, missing) in sets.iter().flat_map(|set| [0, 1, 2, 3].map(|bits| (set, bits))) {
            let [of_first, of_second] = [missing & 1 != 0, missing & 2 != 0];
            let size = DraftNode::Split {
                feature: 1,
                threshold: Threshold::at_or_below(0.5),
                missing_left: true,
                left: 3,
                right: 4,
            };
            let nodes = vec![
                set(0, first, of_first, 1, 2),
                size,
                set(0, second, of_second, 5, 6),
                set(0, second, of_second, 7, 8),
                leaf(1.0),
                leaf(2.0),
                leaf(3.0),
                leaf(4.0),
                leaf(5.0),
            ];
            let ensemble = ensemble(nodes);
            let is_inside = |set: &Set, missing: bool, x: f32| match x.is_nan() {
                true => missing,
                false => (set.ends.iter().filter(|end| **end <= f64::from(x)).count() % 2 == 1) != set.begins,
            };
            for kind in (-10..20).map(|half| half as f32 / 2.0).chain([f32::NAN]) {
                for size in [0.0, 1.0, f32::NAN] {
                    let [a, b] = [is_inside(first, of_first, kind), is_inside(second, of_second, kind)];
                    let expected = match (a, size > 0.5, b) {
                        (true, true, _) => 1.0,
                        (false, _, true) => 2.0,
                        (false, _, false) => 3.0,
                        (true, false, true) => 4.0,
                        (true, false, false) => 5.0,
                    };
                    assert_eq!(ensemble.margins_of_features(&[kind, size]), [expected], "{kind}, {size}");
                }
            }
        }
    }
}

#[test]
fn a_tree_that_would_grow_without_end_is_refused_by_its_feature() {
    // Sets of every other category, of features of their own so that nothing is known of them.
    let every_other = Set::of_categories((0..200).map(|number| 2 * number), false).unwrap();
    let mut nodes = Vec::new();
    for feature in 0..6 {
        let inside = nodes.len() + 1;
        nodes.push(set(feature, &every_other, false, inside, 6));
    }
    nodes.push(leaf(1.0));
    let error = spelled_out(nodes, 3, |feature| format!("f{feature}")).unwrap_err().to_string();
    assert!(error.contains("tree 3") && error.contains("\"f0\"") && error.contains("64 times"), "{error}");
}
