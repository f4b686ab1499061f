//! Checks of an ensemble that was not read from a file: a reader checks while it reads.

use super::columns::MAX_NAME;
use super::{Ensemble, Inputs, Node, Output, Tree};
use crate::error::{EnsembleProblem, NameProblem, TreeProblem};
use std::collections::HashSet;

/// The most objects that a compiled model can distinguish.
pub const MAX_OBJECTS: usize = 256;
/// The most features that a compiled model can have.
pub const MAX_FEATURES: usize = 256;

impl Ensemble {
    /// Checks an ensemble that was put together by hand: 2 to 256 objects (over rows of 1 to 256 features also one) with
    /// names that a file can hold, a base margin for each, at least one tree; in each tree a root, children and features in range, no node reached twice, finite
    /// leaves, thresholds that are numbers (finite ones where the model computes its features), and as many values in a leaf as the tree's [`Output`] says.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), EnsembleProblem> {
        match &self.inputs {
            Inputs::Computed(_) => check_names(&self.objects)?,
            Inputs::Rows(features) => {
                if self.objects.len() != 1 {
                    check_names(&self.objects)?;
                }
                check_features(features, self)?;
            }
        }
        let objects = self.objects.len();
        let finite = self.base_margins.iter().filter(|margin| margin.is_finite()).count();
        if finite != objects || self.base_margins.len() != objects {
            return Err(EnsembleProblem::BaseMargins { found: finite, objects });
        }
        if self.trees.is_empty() {
            return Err(EnsembleProblem::NoTrees);
        }
        let features = self.inputs.count();
        let infinite = self.schema().is_none();
        for (number, tree) in self.trees.iter().enumerate() {
            tree.check(features, objects, infinite)
                .map_err(|problem| EnsembleProblem::Tree { tree: number, problem })?;
        }
        Ok(())
    }
}

impl Tree {
    fn check(&self, features: usize, objects: usize, infinite: bool) -> Result<(), TreeProblem> {
        let nodes = self.nodes.len();
        let wanted = match self.output {
            Output::One(object) if object >= objects => {
                return Err(TreeProblem::Object { object: object as u64, objects });
            }
            Output::One(_) => 1,
            Output::Each => objects,
        };
        if nodes == 0 {
            return Err(TreeProblem::NoNodes);
        }
        let mut reached = vec![false; nodes];
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            if std::mem::replace(&mut reached[node], true) {
                return Err(TreeProblem::ReachedTwice { node });
            }
            match &self.nodes[node] {
                Node::Leaf(values) => check_leaf(node, values, wanted)?,
                &Node::Split { feature, threshold, left, right, .. } => {
                    if feature >= features {
                        return Err(TreeProblem::Feature { node, feature: feature as u64, features });
                    }
                    if threshold.is_nan() || !(infinite || threshold.is_finite()) {
                        return Err(TreeProblem::Threshold { node, threshold });
                    }
                    for (side, child) in [("right", right), ("left", left)] {
                        if child >= nodes {
                            let child = i64::try_from(child).unwrap_or(i64::MAX);
                            return Err(TreeProblem::Child { node, side, child, nodes });
                        }
                        waiting.push(child);
                    }
                }
            }
        }
        Ok(())
    }
}

/// Returns an error unless a leaf has as many values as wanted, all of them finite.
pub(crate) fn check_leaf(node: usize, values: &[f32], wanted: usize) -> Result<(), TreeProblem> {
    if values.len() != wanted {
        return Err(TreeProblem::LeafValues { node, found: values.len(), wanted });
    }
    match values.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(TreeProblem::LeafValue { node, value }),
        None => Ok(()),
    }
}

/// Returns an error unless these can be the names of an ensemble's features.
fn check_features(names: &[String], ensemble: &Ensemble) -> Result<(), EnsembleProblem> {
    if !(1..=MAX_FEATURES).contains(&names.len()) {
        let splits = ensemble.trees.iter().flat_map(|tree| &tree.nodes).filter_map(|node| match node {
            Node::Split { feature, .. } => Some(feature),
            Node::Leaf(_) => None,
        });
        let used = splits.collect::<HashSet<_>>().len();
        return Err(EnsembleProblem::FeatureCount { count: names.len(), used, most: MAX_FEATURES });
    }
    for name in names {
        if name.len() > MAX_NAME || name.chars().any(char::is_control) {
            return Err(EnsembleProblem::FeatureName { name: name.clone() });
        }
    }
    Ok(())
}

/// Returns an error unless these names can be an ensemble's objects.
pub fn check_names(names: &[String]) -> Result<(), EnsembleProblem> {
    if !(2..=MAX_OBJECTS).contains(&names.len()) {
        return Err(EnsembleProblem::ObjectCount { count: names.len() });
    }
    let mut seen = HashSet::new();
    for name in names {
        let why = if name.is_empty() {
            NameProblem::Empty
        } else if name.chars().any(char::is_control) {
            NameProblem::Control
        } else if name.len() > MAX_NAME {
            NameProblem::Long
        } else if !seen.insert(name) {
            NameProblem::Twice
        } else {
            continue;
        };
        return Err(EnsembleProblem::ObjectName { name: name.clone(), why });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::import::Options;
    use crate::ensemble::{Provenance, computed};
    use palpate_shared::Descriptor;

    fn ensemble() -> Ensemble {
        let split = Node::Split { feature: 0, threshold: 5.0, missing_left: true, left: 1, right: 2 };
        let nodes = vec![split, Node::Leaf(vec![1.0, 2.0]), Node::Leaf(vec![3.0, 4.0])];
        Ensemble {
            inputs: computed(Descriptor::Curvature).into(),
            objects: vec!["bowl".into(), "fork".into()],
            base_margins: vec![0.0; 2],
            trees: vec![Tree { nodes, output: Output::Each }],
            origin: Provenance::default(),
        }
    }

    #[test]
    fn saving_an_ensemble_made_by_hand_that_contradicts_itself_is_an_error_and_no_panic() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("ensemble.json");
        let refused = |change: &dyn Fn(&mut Ensemble)| {
            let mut changed = ensemble();
            change(&mut changed);
            let error = changed.save(&path).unwrap_err();
            assert!(error.to_string().contains("ensemble.json: ") && !path.exists(), "{error}");
            error.problem::<EnsembleProblem>().unwrap_or_else(|| panic!("{error}")).clone()
        };
        let split =
            |left, right, feature, threshold| Node::Split { feature, threshold, missing_left: true, left, right };
        let tree = |problem| EnsembleProblem::Tree { tree: 0, problem };
        let root = |node: Node| move |e: &mut Ensemble| e.trees[0].nodes[0] = node.clone();
        assert_eq!(
            refused(&root(split(1, 7, 0, 5.0))),
            tree(TreeProblem::Child { node: 0, side: "right", child: 7, nodes: 3 })
        );
        assert_eq!(refused(&root(split(1, 1, 0, 5.0))), tree(TreeProblem::ReachedTwice { node: 1 }));
        assert_eq!(refused(&root(split(0, 2, 0, 5.0))), tree(TreeProblem::ReachedTwice { node: 0 }));
        assert_eq!(
            refused(&root(split(1, 2, 2, 5.0))),
            tree(TreeProblem::Feature { node: 0, feature: 2, features: 2 })
        );
        assert!(matches!(
            refused(&root(split(1, 2, 0, f32::NAN))),
            EnsembleProblem::Tree { problem: TreeProblem::Threshold { .. }, .. }
        ));
        assert_eq!(refused(&root(Node::Leaf(vec![]))), tree(TreeProblem::LeafValues { node: 0, found: 0, wanted: 2 }));
        assert_eq!(
            refused(&|e| e.trees[0].nodes[2] = Node::Leaf(vec![0.0, f32::INFINITY])),
            tree(TreeProblem::LeafValue { node: 2, value: f32::INFINITY })
        );
        assert_eq!(refused(&|e| e.trees[0].nodes.clear()), tree(TreeProblem::NoNodes));
        assert_eq!(
            refused(&|e| e.trees[0].output = Output::One(2)),
            tree(TreeProblem::Object { object: 2, objects: 2 })
        );
        assert_eq!(refused(&|e| e.trees.clear()), EnsembleProblem::NoTrees);
        assert_eq!(
            refused(&|e| e.base_margins = vec![0.0, f32::NAN]),
            EnsembleProblem::BaseMargins { found: 1, objects: 2 }
        );
        assert_eq!(refused(&|e| e.objects.truncate(1)), EnsembleProblem::ObjectCount { count: 1 });
        ensemble().save(&path).unwrap();
        let schemas = [computed(Descriptor::Curvature)];
        let options = Options { schemas: &schemas, ..Options::default() };
        assert_eq!(Ensemble::load_with(&path, &options).unwrap(), ensemble());
        let unknown = Ensemble::load(&path).unwrap_err();
        assert!(unknown.to_string().contains("its descriptor \"curvature\" is unknown"), "{unknown}");
    }

    #[test]
    fn names_that_no_file_or_model_can_hold_are_refused() {
        for (name, why) in [
            ("", NameProblem::Empty),
            ("fo\trk", NameProblem::Control),
            ("fork\n", NameProblem::Control),
            ("bowl", NameProblem::Twice),
            (&"x".repeat(256), NameProblem::Long),
        ] {
            let problem = check_names(&["bowl".into(), name.into()]).unwrap_err();
            assert_eq!(problem, EnsembleProblem::ObjectName { name: name.into(), why });
        }
        check_names(&["große Schüssel".into(), "x".repeat(255)]).unwrap();
        assert!(check_names(&vec!["x".into(); 257]).is_err());
    }
}
