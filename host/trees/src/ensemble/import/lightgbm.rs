//! LightGBM's text: `save_model("model.txt")`, versions 3 and 4 of the library.
//!
//! A value goes left if it is at or below the threshold, in f64; one of infinity parts missing values from all others.
//! Each split states its missing values: none (NaN is 0 then), zero (and NaN), or NaN. A category goes left if its
//! bit is set; what is missing or negative goes right, and so does what has no bit.

use super::draft::{Draft, DraftTree};
use super::draft_node::DraftNode;
use super::options::{CATEGORIES, unknown_objective};
use super::set::Set;
use crate::ensemble::check::object_count;
use crate::ensemble::faults;
use crate::ensemble::{Ensemble, Output, Probability, Threshold};
use crate::error::{Error, Place, Result, problem};
use palpate_shared::format::Link;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

/// Zero, to LightGBM: everything up to this.
const ZERO: f32 = 1e-35;
/// Nodes of a tree whose zeros are told from other numbers by splits of their own, for each node in the file.
const MAX_GROWTH: usize = 16;

/// `key=value` lines, each with its number.
struct Block<'a> {
    path: &'a Path,
    line: u64,
    values: BTreeMap<&'a str, (u64, &'a str)>,
}

impl<'a> Block<'a> {
    fn damaged(&self, key: &str, what: &str) -> Error {
        let line = self.values.get(key).map_or(self.line, |(line, _)| *line);
        damaged(Place::line(self.path, line), format_args!("{key} {what}"))
    }

    fn text(&self, key: &str) -> Option<&'a str> {
        self.values.get(key).map(|(_, text)| *text)
    }

    fn count(&self, key: &str) -> Result<usize> {
        let text = self.text(key).ok_or_else(|| self.damaged(key, "is missing"))?;
        text.trim().parse().map_err(|_| self.damaged(key, "is not a count"))
    }

    /// A list of exactly `wanted` numbers.
    fn list<T: std::str::FromStr>(&self, key: &str, wanted: usize) -> Result<Vec<T>> {
        let text = self.text(key).unwrap_or_default();
        let parsed: Option<Vec<T>> = text.split_ascii_whitespace().map(|number| number.parse().ok()).collect();
        let list = parsed.ok_or_else(|| self.damaged(key, "is not a list of numbers"))?;
        if list.len() != wanted {
            return Err(self.damaged(key, &format!("has {} entries instead of {wanted}", list.len())));
        }
        Ok(list)
    }
}

fn damaged(place: Place, what: impl Display) -> Error {
    faults::damaged("LightGBM text", what).at(place)
}

/// Reads LightGBM's text; `path` is for errors only.
pub(super) fn read(path: &Path, bytes: &[u8], names: Option<&[String]>) -> Result<Ensemble> {
    let text = std::str::from_utf8(bytes).map_err(|_| damaged(Place::line(path, 1), "it is not UTF-8"))?;
    let (head, blocks) = blocks(path, text)?;
    let outputs = head.count("num_tree_per_iteration")?;
    if outputs == 0 || outputs > 256 {
        return Err(object_count(outputs));
    }
    let features = head.count("max_feature_idx")?.saturating_add(1);
    let own: Vec<String> = head.text("feature_names").unwrap_or_default().split(' ').map(String::from).collect();
    if own.len() != features {
        return Err(head.damaged("feature_names", &format!("has {} names for {features} features", own.len())));
    }
    let version = head.text("version").unwrap_or_default();
    let kind = format!("LightGBM text {version}");
    let mut draft = Draft { features: own, kind, categories: names_of_categories(text, &head), ..Draft::default() };
    draft.compares_f64 = true;
    // The library divides what such a model's trees add up to by their number before its link.
    let is_averaged = head.values.contains_key("average_output");
    let rounds = if is_averaged { (blocks.len() / outputs).max(1) } else { 1 };
    let first = objective(head.text("objective"), outputs, rounds, &mut draft)?;
    draft.base = vec![0.0; outputs + first];
    let trees: Vec<_> = blocks
        .iter()
        .enumerate()
        .map(|(index, block)| tree(block, index, features, &draft.features))
        .collect::<Result<_>>()?;
    // Where zeros are missing in all of the splits, they are missing in a row.
    let is_zero = |(splits, _): &(Vec<Split>, Vec<f64>)| splits.iter().all(|split| split.missing == Missing::Zero);
    let has_sets = trees.iter().flat_map(|(splits, _)| splits).any(|split| split.set.is_some());
    if has_sets {
        draft.notes.push(CATEGORIES.into());
    }
    // Zero is a category like others.
    let zero_is_missing = !has_sets && trees.iter().all(is_zero) && trees.iter().any(|(splits, _)| !splits.is_empty());
    if zero_is_missing {
        draft.sentinel = Some([-ZERO, ZERO]);
    }
    for (index, (splits, values)) in trees.iter().enumerate() {
        let output = Output::One(index % outputs + first);
        let mut grower = Grower { splits, values, zero_is_missing, nodes: Vec::new() };
        grower.grow(index, &draft.features)?;
        let nodes = grower.nodes;
        draft.trees.push(DraftTree { nodes, output });
    }
    draft.finish(names)
}

/// The categories of each column that has some, as LightGBM's Python package states those of a pandas table below the trees: of all
/// its columns of categories in their order. Empty where they are not as many as LightGBM's own, or too few for its numbers.
fn names_of_categories(text: &str, head: &Block<'_>) -> BTreeMap<usize, Vec<String>> {
    let stated = |key: &str| text.lines().rev().find_map(|line| line.strip_prefix(key));
    let lists: Option<Vec<Vec<serde_json::Value>>> =
        stated("pandas_categorical:").and_then(|lists| serde_json::from_str(lists).ok());
    let lists = lists.unwrap_or_default();
    let columns = stated("[categorical_feature: ").unwrap_or_default().trim_end_matches(']').split(',');
    let columns: Vec<usize> = columns.filter_map(|column| column.parse().ok()).collect();
    let infos: Vec<&str> = head.text("feature_infos").unwrap_or_default().split(' ').collect();
    let holds = |(column, names): (&usize, &Vec<serde_json::Value>)| {
        let mut numbers = infos.get(*column).copied().unwrap_or_default().split(':');
        let is_held =
            |number: &str| number == "none" || number.parse().is_ok_and(|number: i32| number < names.len() as i32);
        numbers.all(is_held)
    };
    if lists.len() != columns.len() || !columns.iter().zip(&lists).all(holds) {
        return BTreeMap::new();
    }
    let name = |name: serde_json::Value| name.as_str().map_or_else(|| name.to_string(), String::from);
    columns.into_iter().zip(lists).map(|(column, names)| (column, names.into_iter().map(name).collect())).collect()
}

/// The lines before the first tree, and those of each tree.
fn blocks<'a>(path: &'a Path, text: &'a str) -> Result<(Block<'a>, Vec<Block<'a>>)> {
    let mut head = Block { path, line: 0, values: BTreeMap::new() };
    let mut trees: Vec<Block<'_>> = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let text = text.trim_end();
        if text == "end of trees" {
            return Ok((head, trees));
        }
        let (key, value) = text.split_once('=').unwrap_or((text, ""));
        if key == "Tree" {
            trees.push(Block { path, line, values: BTreeMap::new() });
        } else if !key.is_empty() {
            let block = trees.last_mut().unwrap_or(&mut head);
            block.values.insert(key, (line, value));
        }
    }
    let end = Place::line(path, text.lines().count() as u64);
    Err(damaged(end, "it ends before the line \"end of trees\""))
}

/// The first tree's object: 1 for a binary model. Notes peculiarities of the objective; `rounds` are averaged.
fn objective(text: Option<&str>, outputs: usize, rounds: usize, draft: &mut Draft) -> Result<usize> {
    let text = text.unwrap_or("custom");
    let mut words = text.split_ascii_whitespace();
    let name = words.next().unwrap_or("custom");
    let sigmoid = words.find_map(|word| word.strip_prefix("sigmoid:")).unwrap_or("1");
    let sigmoid: f64 = sigmoid.parse().ok().filter(|factor: &f64| factor.is_finite() && *factor > 0.0).unwrap_or(1.0);
    let is_classes = matches!(name, "multiclass" | "multiclassova");
    if name == "custom" {
        draft.probability = Probability::Unknown;
    }
    if outputs > 1 && !is_classes && name != "custom" {
        return Err(unknown_objective(name, None));
    }
    if is_classes || name == "binary" {
        // Of these, and of no others, margins are evidence.
        let sigmoid = if name == "multiclass" { 1.0 } else { sigmoid };
        draft.divisor = Some(rounds as f64 / sigmoid);
    } else {
        draft.prediction.average = u32::try_from(rounds).unwrap_or(u32::MAX);
    }
    if name == "multiclassova" {
        draft.probability = Probability::Logistic;
        draft.notes.push("Posteriors are those of softmax, the model's of one class against all others.".into());
    }
    draft.prediction.link = match name {
        "poisson" | "gamma" | "tweedie" => Link::Exponential,
        "cross_entropy" => Link::Logistic,
        "cross_entropy_lambda" => Link::Softplus,
        // Every objective that is derived from this one may learn the roots of its targets.
        "regression" | "regression_l1" | "huber" | "fair" | "quantile" | "mape"
            if text.split_ascii_whitespace().any(|word| word == "sqrt") =>
        {
            Link::Square
        }
        _ => Link::Identity,
    };
    Ok(usize::from(name == "binary"))
}

/// A split as the file has it.
#[derive(Clone)]
struct Split {
    feature: usize,
    /// Categories that go left, instead of a threshold.
    set: Option<Set>,
    threshold: f64,
    default_left: bool,
    missing: Missing,
    left: i64,
    right: i64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Missing {
    Nothing,
    Zero,
    NaN,
}

/// The splits of a tree, and the values of its leaves.
fn tree(block: &Block<'_>, number: usize, features: usize, names: &[String]) -> Result<(Vec<Split>, Vec<f64>)> {
    let leaves = block.count("num_leaves")?;
    let values: Vec<f64> = block.list("leaf_value", leaves)?;
    if leaves == 0 {
        return Err(block.damaged("num_leaves", "is 0"));
    }
    if block.text("is_linear").is_some_and(|text| text.trim() == "1") {
        return Err(problem!("tree {number} has linear functions of the features at its leaves")
            .fix("Train with linear_tree=false."));
    }
    let splits = leaves - 1;
    let selected: Vec<usize> = block.list("split_feature", splits)?;
    let thresholds: Vec<f64> = block.list("threshold", splits)?;
    let decisions: Vec<u8> = block.list("decision_type", splits)?;
    let lefts: Vec<i64> = block.list("left_child", splits)?;
    let rights: Vec<i64> = block.list("right_child", splits)?;
    let sets = categories(block)?;
    let mut read = Vec::with_capacity(splits);
    for (index, &decision) in decisions.iter().enumerate() {
        let feature = selected[index];
        let Some(name) = names.get(feature).filter(|_| feature < features) else {
            return Err(block.damaged("split_feature", &format!("has {feature}, but there are {features} features")));
        };
        let set = if decision & 1 == 0 {
            None
        } else {
            // `as` saturates; a fraction is the number of no set.
            let number = thresholds[index] as usize;
            let own = sets.get(number).filter(|_| thresholds[index] == number as f64);
            let wrong = || block.damaged("threshold", &format!("has no set of categories of {name}"));
            Some(Set::of_categories(bits(own.ok_or_else(wrong)?), true)?)
        };
        let missing = match decision >> 2 & 3 {
            0 => Missing::Nothing,
            1 => Missing::Zero,
            2 => Missing::NaN,
            _ => return Err(block.damaged("decision_type", &format!("{decision} is unknown"))),
        };
        let default_left = decision & 2 != 0;
        let threshold = thresholds[index];
        if threshold.is_nan() {
            return Err(block.damaged("threshold", "is not a number"));
        }
        let (left, right) = (lefts[index], rights[index]);
        read.push(Split { feature, set, threshold, default_left, missing, left, right });
    }
    check_structure(block, &read, values.len())?;
    Ok((read, values))
}

/// The sets of categories of a tree: of each, a bit for each category, in words of 32.
fn categories(block: &Block<'_>) -> Result<Vec<Vec<u32>>> {
    if block.text("num_cat").is_none_or(|count| count.trim() == "0") {
        return Ok(Vec::new());
    }
    let sets = block.count("num_cat")?;
    let ends: Vec<usize> = block.list("cat_boundaries", sets.saturating_add(1))?;
    let words: Vec<u32> = block.list("cat_threshold", ends.last().copied().unwrap_or(0))?;
    let own = |bounds: &[usize]| match *bounds {
        [from, to] => words.get(from..to).map(<[u32]>::to_vec),
        _ => None,
    };
    let sets: Option<Vec<Vec<u32>>> = ends.windows(2).map(own).collect();
    sets.ok_or_else(|| block.damaged("cat_boundaries", "do not ascend"))
}

/// The categories whose bit is set.
fn bits(words: &[u32]) -> impl Iterator<Item = u32> {
    words.iter().enumerate().flat_map(|(position, word)| {
        let first = u32::try_from(position).unwrap_or(u32::MAX).saturating_mul(32);
        (0..32).filter(move |bit| word >> bit & 1 != 0).map(move |bit| first.saturating_add(bit))
    })
}

/// Returns an error unless every split and every leaf is reached at most once.
fn check_structure(block: &Block<'_>, splits: &[Split], leaves: usize) -> Result<()> {
    let (mut of_splits, mut of_leaves) = (vec![false; splits.len()], vec![false; leaves]);
    let mut waiting: Vec<(&str, i64)> = vec![("num_leaves", if splits.is_empty() { -1 } else { 0 })];
    while let Some((column, child)) = waiting.pop() {
        let position = if child < 0 { child.checked_add(1).and_then(i64::checked_neg) } else { Some(child) };
        let position = position.and_then(|position| usize::try_from(position).ok());
        let seen = if child < 0 { &mut of_leaves } else { &mut of_splits };
        let Some((position, seen)) = position.and_then(|position| Some((position, seen.get_mut(position)?))) else {
            return Err(block.damaged(column, &format!("names the node {child}, which does not exist")));
        };
        if std::mem::replace(seen, true) {
            return Err(block.damaged(column, &format!("leads to the node {child} a second time")));
        }
        if child >= 0 {
            waiting.extend([("right_child", splits[position].right), ("left_child", splits[position].left)]);
        }
    }
    Ok(())
}

/// Copies a tree, and writes splits that only LightGBM has as several splits.
struct Grower<'a> {
    splits: &'a [Split],
    values: &'a [f64],
    /// True if zeros are missing in every feature, so that no split has to distinguish them.
    zero_is_missing: bool,
    nodes: Vec<DraftNode>,
}

impl Grower<'_> {
    /// Copies the file's nodes from the root on, each where its parent expects it.
    fn grow(&mut self, number: usize, names: &[String]) -> Result<()> {
        // Of the file's tree: split i, or leaf -1 - i; and where it goes.
        let root = if self.splits.is_empty() { -1 } else { 0 };
        let mut waiting = vec![(root, self.reserve())];
        let most = MAX_GROWTH * (self.splits.len() + self.values.len());
        while let Some((from, to)) = waiting.pop() {
            // The structure was checked.
            let position = usize::try_from(if from < 0 { -1 - from } else { from }).unwrap_or(usize::MAX);
            let Some(split) = self.splits.get(position).filter(|_| from >= 0) else {
                self.nodes[to] = DraftNode::Leaf(self.values.get(position).copied().into_iter().collect());
                continue;
            };
            self.split(split.clone(), to, &mut waiting);
            if self.nodes.len() > most {
                let name = names.get(split.feature).map_or("", String::as_str);
                return Err(problem!(
                    "tree {number} takes zeros of features such as {name:?} as missing in so many places that it would \
                     become {MAX_GROWTH} times as large"
                )
                .fix("Train with zero_as_missing=false, or with fewer leaves."));
            }
        }
        Ok(())
    }

    fn reserve(&mut self) -> usize {
        self.nodes.push(DraftNode::Leaf(Vec::new()));
        self.nodes.len() - 1
    }

    /// Writes one split, or three where zero goes another way than its neighbors.
    fn split(&mut self, split: Split, to: usize, waiting: &mut Vec<(i64, usize)>) {
        let Split { feature, set, threshold, default_left, missing, left, right } = split;
        if let Some(set) = set {
            let [inside, outside] = [left, right].map(|from| {
                let to = self.reserve();
                waiting.push((from, to));
                to
            });
            self.nodes[to] = DraftNode::Set { feature, set, missing_inside: false, inside, outside };
            return;
        }
        let zero_is_left = threshold >= 0.0;
        // LightGBM reads everything from -ZERO to ZERO as 0: all of it goes one way.
        let zero = f64::from(ZERO);
        let (above_zero, below_zero) = (Threshold::at_or_below(zero), Threshold::below(-zero));
        let as_it_is = Threshold::at_or_below(threshold);
        let whole = match zero_is_left {
            true if threshold < zero => above_zero,
            false if threshold >= -zero => below_zero,
            _ => as_it_is,
        };
        let mut put = |nodes: &mut Self, at: usize, threshold: Threshold, missing_left: bool, sides: [Side; 2]| {
            let [left, right] = sides.map(|side| match side {
                Side::Copy(from) => {
                    let to = nodes.reserve();
                    waiting.push((from, to));
                    to
                }
                Side::At(to) => to,
            });
            nodes.nodes[at] = DraftNode::Split { feature, threshold, missing_left, left, right };
        };
        let (left, right) = (Side::Copy(left), Side::Copy(right));
        match missing {
            _ if self.zero_is_missing => put(self, to, as_it_is, default_left, [left, right]),
            Missing::NaN => put(self, to, whole, default_left, [left, right]),
            Missing::Nothing => put(self, to, whole, zero_is_left, [left, right]),
            // Zeros go where the comparison sends them.
            Missing::Zero if default_left == zero_is_left => put(self, to, whole, default_left, [left, right]),
            Missing::Zero => {
                // Below zero, then zero, then above it: each side of zero is compared with the threshold as usual.
                let (above, zero_or_above) = (self.reserve(), self.reserve());
                let side = |goes_left: bool| if goes_left { left } else { right };
                let (below, over) = if zero_is_left {
                    // Everything below zero goes left.
                    (left, Side::At(above))
                } else {
                    (Side::At(above), right)
                };
                put(self, to, below_zero, false, [below, Side::At(zero_or_above)]);
                put(self, zero_or_above, above_zero, true, [side(default_left), over]);
                put(self, above, as_it_is, default_left, [left, right]);
            }
        }
    }
}

/// A child: a node of the file to be copied, or one that was reserved.
#[derive(Clone, Copy)]
enum Side {
    Copy(i64),
    At(usize),
}
