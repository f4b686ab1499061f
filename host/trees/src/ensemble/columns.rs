//! Features of an ensemble among the columns of its file: with names that a model can hold, and no more than it can have.

use super::faults::{damaged, feature_count};
use super::{Columns, Inputs, MAX_FEATURES, Node, Tree};
use crate::error::{Result, problem};
use std::collections::BTreeSet;

/// The most bytes of a feature's name: a compiled model has one byte for its length.
pub(super) const MAX_NAME: usize = 255;
/// The most columns of a file's rows: a compiled model has two bytes for the number of one.
const MAX_COLUMNS: usize = 1 << 16;

/// Returns an error if rows have more columns than can be numbered.
pub(super) fn check_count(columns: usize) -> Result<()> {
    if columns <= MAX_COLUMNS {
        return Ok(());
    }
    Err(problem!("its rows have {columns} columns, more than {MAX_COLUMNS}").fix("Train on fewer columns."))
}

/// The features of trees that split on columns with these names; empty names do not count. If there are more columns
/// than a model can have features, the trees are numbered again by those that they use.
pub(super) fn features(
    names: Vec<String>,
    trees: &mut [Tree],
    notes: &mut Vec<String>,
) -> Result<(Vec<String>, Option<Columns>)> {
    check_count(names.len())?;
    let names = held(names, notes);
    let count = names.len();
    if count <= MAX_FEATURES {
        return Ok((names, None));
    }
    let mut used: BTreeSet<usize> = trees.iter_mut().flat_map(splits).map(|feature| *feature).collect();
    if used.len() > MAX_FEATURES {
        return Err(feature_count(count, used.len()));
    }
    if let Some(&feature) = used.last().filter(|&&feature| feature >= count) {
        return Err(damaged("trees", format_args!("a split is of feature {feature} of {count}")));
    }
    if used.is_empty() {
        used.insert(0);
    }
    let used: Vec<usize> = used.into_iter().collect();
    for feature in trees.iter_mut().flat_map(splits) {
        // All of them are among those used.
        *feature = used.partition_point(|column| column < feature);
    }
    let own = used.iter().filter_map(|&column| names.get(column).cloned()).collect();
    notes.push(format!(
        "A row has {} of the library's {count} columns, those that its trees split on: {}.",
        used.len(),
        Columns::first(used.iter().filter_map(|&column| names.get(column).map(String::as_str)), 10)
    ));
    Ok((own, Some(Columns { names, used })))
}

impl Columns {
    /// The first names of many, in words.
    pub(crate) fn first<'n>(names: impl Iterator<Item = &'n str>, most: usize) -> String {
        let names: Vec<&str> = names.collect();
        let shown = names.get(..most).unwrap_or(&names).join(", ");
        match names.len().checked_sub(most) {
            None | Some(0) => shown,
            Some(others) => format!("{shown} and {others} more"),
        }
    }
}

/// The features of a tree's splits.
fn splits(tree: &mut Tree) -> impl Iterator<Item = &mut usize> {
    tree.nodes.iter_mut().filter_map(|node| match node {
        Node::Split { feature, .. } => Some(feature),
        Node::Leaf(_) => None,
    })
}

/// Names that a model can hold, with defaults for missing ones. A name that it cannot hold is changed as
/// [`holdable`] does, unless it would equal another one then.
pub(super) fn held(mut names: Vec<String>, notes: &mut Vec<String>) -> Vec<String> {
    let all: BTreeSet<String> = names.iter().cloned().collect();
    let mut changed = BTreeSet::new();
    for (index, name) in names.iter_mut().enumerate() {
        if name.is_empty() {
            *name = Inputs::default_name(index);
        }
        let held = holdable(name);
        if held != *name && !all.contains(&held) && changed.insert(held.clone()) {
            *name = held;
        }
    }
    if let Some(example) = changed.first() {
        notes.push(format!(
            "Names of features have _ for tabs and line ends and at most {MAX_NAME} bytes, such as {example:?}; rows may have \
             the library's names."
        ));
    }
    names
}

/// The name with `_` for control characters, and its first bytes where it is longer than a model can hold.
pub(crate) fn holdable(name: &str) -> String {
    let plain: String = name.chars().map(|character| if character.is_control() { '_' } else { character }).collect();
    let end = (0..=MAX_NAME.min(plain.len())).rev().find(|&end| plain.is_char_boundary(end));
    plain.get(..end.unwrap_or(0)).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Output;

    fn tree(feature: usize) -> Tree {
        let split = Node::Split { feature, threshold: 0.0, missing_left: true, left: 1, right: 2 };
        Tree { nodes: vec![split, Node::Leaf(vec![1.0]), Node::Leaf(vec![2.0])], output: Output::One(0) }
    }

    fn feature(tree: &Tree) -> usize {
        let Node::Split { feature, .. } = tree.nodes[0] else { panic!("a split") };
        feature
    }

    #[test]
    fn of_many_columns_those_that_are_used_become_the_features() {
        let mut trees = [tree(299), tree(7), tree(299)];
        let mut notes = Vec::new();
        let mut names = vec![String::new(); 300];
        names[7] = "height".into();
        let (own, columns) = features(names.clone(), &mut trees, &mut notes).unwrap();
        assert_eq!(own, ["height", "f299"]);
        assert_eq!(trees.each_ref().map(feature), [1, 0, 1]);
        let columns = columns.unwrap();
        assert_eq!((columns.used, columns.names.len(), &columns.names[299][..]), (vec![7, 299], 300, "f299"));
        assert_eq!(notes, ["A row has 2 of the library's 300 columns, those that its trees split on: height, f299."]);
        // As many as fit stay as they are, used or not.
        let mut trees = [tree(255)];
        let (own, columns) = features(vec![String::new(); 256], &mut trees, &mut notes).unwrap();
        assert_eq!((own.len(), columns, feature(&trees[0])), (256, None, 255));
        let mut many: Vec<Tree> = (0..257).map(tree).collect();
        let refused = features(vec![String::new(); 300], &mut many, &mut notes).unwrap_err();
        let said = refused.to_string();
        assert!(said.contains("its trees use 257 of its 300 features, and not 1 to 256"), "{said}");
        assert!(features(vec![String::new(); MAX_COLUMNS + 1], &mut [tree(0)], &mut notes).is_err());
        assert!(features(vec![String::new(); 300], &mut [tree(300)], &mut notes).is_err(), "there is no such column");
    }

    #[test]
    fn names_that_no_model_can_hold_are_changed_and_that_is_noted() {
        let mut notes = Vec::new();
        let long = "ä".repeat(200);
        let names = ["plain", "two\twords", "a\nb", "a_b", &long].map(String::from).to_vec();
        // Two of them would have the same name: that stays as it is, and is refused by the check.
        assert_eq!(held(names, &mut notes)[1..4], ["two_words", "a\nb", "a_b"]);
        assert_eq!(held(vec![long], &mut notes)[0].len(), 254);
        assert!(notes[0].contains("rows may have the library's names"), "{notes:?}");
    }
}
