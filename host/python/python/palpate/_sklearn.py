"""Trees of scikit-learn, taken from its estimators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputError
from ._native import Ensemble

_Floats = npt.NDArray[np.float64]
_Integers = npt.NDArray[np.int64]
_Tree = tuple["int | None", _Integers, _Integers, _Integers, _Floats, npt.NDArray[np.bool_], _Floats]

_VOTES = (
    "The margins are shares of the trees' votes: classes are right, posteriors are not calibrated, and evidence of "
    "several rows adds up slowly."
)


def read(model: Any, names: list[str] | None) -> Ensemble:
    """The trees of a forest, a decision tree, or boosted trees."""
    kind = type(model).__name__
    if not hasattr(model, "n_features_in_"):
        raise InputError(f"the {kind} is not fitted. Call its `fit` first.")
    if getattr(model, "n_outputs_", 1) > 1:
        raise InputError(f"the {kind} has several targets, which are no classes of one object. Train a model for each target.")
    notes: list[str] = []
    if hasattr(model, "_predictors"):
        base, trees = _histogram(model)
    elif kind.startswith("GradientBoosting"):
        base, trees = _gradient(model)
    elif hasattr(model, "estimators_") and all(hasattr(tree, "tree_") for tree in np.ravel(model.estimators_)):
        base, trees = _forest(model, list(np.ravel(model.estimators_)))
    elif hasattr(model, "tree_"):
        base, trees = _forest(model, [model])
    else:
        raise InputError(
            f"scikit-learn's {kind} has no trees that can be read. Give a forest, a decision tree or boosted trees; of a "
            "pipeline its last step, and transform the rows as its first steps do."
        )
    is_classifier = hasattr(model, "classes_")
    if is_classifier and not hasattr(model, "_predictors") and not kind.startswith("GradientBoosting"):
        notes.append(_VOTES)
    features = [str(name) for name in getattr(model, "feature_names_in_", [""] * model.n_features_in_)]
    return Ensemble.from_trees(
        f"scikit-learn {kind}", features, base, trees, names=names if is_classifier else None, notes=notes
    )


def _forest(model: Any, estimators: Sequence[Any]) -> tuple[list[float], list[_Tree]]:
    """Every tree says the share of each class, or a value; the forest's answer is their mean."""
    is_classifier = hasattr(model, "classes_")
    trees: list[_Tree] = []
    for estimator in estimators:
        values = np.asarray(estimator.tree_.value, dtype=np.float64)[:, 0, :]
        if is_classifier:
            values = values / values.sum(axis=1, keepdims=True)
        trees.append(_tree(estimator.tree_, None if is_classifier else 0, values / len(estimators)))
    outputs = len(model.classes_) if is_classifier else 1
    return [0.0] * outputs, trees


def _gradient(model: Any) -> tuple[list[float], list[_Tree]]:
    """Trees of a learning rate, on what a constant model says first."""
    init = getattr(model, "init_", None)
    if type(init).__name__ not in ("DummyClassifier", "DummyRegressor", "str"):
        raise InputError("the model's `init` is an estimator of its own, which is no tree. Train without `init`.")
    first = np.ravel(model._raw_predict_init(np.zeros((1, model.n_features_in_), dtype=np.float32)))
    estimators = np.asarray(model.estimators_)
    outputs = estimators.shape[1]
    is_binary = outputs == 1 and hasattr(model, "classes_")
    trees = [
        _tree(estimator.tree_, output + is_binary, model.learning_rate * estimator.tree_.value[:, 0, :])
        for stage in estimators
        for output, estimator in enumerate(stage)
    ]
    return ([0.0] if is_binary else []) + [float(value) for value in first], trees


def _tree(tree: Any, output: int | None, values: _Floats) -> _Tree:
    missing = getattr(tree, "missing_go_to_left", np.zeros(tree.node_count))
    return (
        output,
        np.asarray(tree.children_left, dtype=np.int64),
        np.asarray(tree.children_right, dtype=np.int64),
        np.asarray(tree.feature, dtype=np.int64),
        np.asarray(tree.threshold, dtype=np.float64),
        np.asarray(missing).astype(bool),
        np.ascontiguousarray(values, dtype=np.float64).ravel(),
    )


def _histogram(model: Any) -> tuple[list[float], list[_Tree]]:
    """Boosted trees over histograms, which no file format of scikit-learn's holds."""
    categories = getattr(model, "is_categorical_", None)
    if categories is not None and np.any(categories):
        raise InputError(
            "the model splits on categories. Encode categories as numbers before training, one column of 0 and 1 for each "
            "(one-hot)."
        )
    first = np.ravel(model._baseline_prediction)
    is_binary = len(first) == 1 and hasattr(model, "classes_")
    trees: list[_Tree] = []
    for stage in model._predictors:
        for output, predictor in enumerate(stage):
            nodes = predictor.nodes
            leaf = nodes["is_leaf"].astype(bool)
            trees.append(
                (
                    output + is_binary,
                    np.where(leaf, -1, nodes["left"].astype(np.int64)),
                    nodes["right"].astype(np.int64),
                    nodes["feature_idx"].astype(np.int64),
                    nodes["num_threshold"].astype(np.float64),
                    nodes["missing_go_to_left"].astype(bool),
                    nodes["value"].astype(np.float64),
                )
            )
    return ([0.0] if is_binary else []) + [float(value) for value in first], trees
