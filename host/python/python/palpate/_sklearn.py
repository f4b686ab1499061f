"""Trees of scikit-learn, taken from its estimators."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputError
from ._native import Ensemble

_Floats = npt.NDArray[np.float64]
_Integers = npt.NDArray[np.int64]
_Tree = tuple["int | None", _Integers, _Integers, _Integers, _Floats, npt.NDArray[np.bool_], _Floats]

@dataclass(frozen=True)
class _Parts:
    """Base margins, trees, and caveats."""

    base: list[float]
    trees: list[_Tree]
    notes: list[str]
    link: str = "identity"
    """The function from a margin to a value."""
    last_of_ties: bool = False
    """True if the last of several largest margins names the class, and not the first."""


_VOTES = (
    "The margins are shares of the trees' votes: classes are right, posteriors are not calibrated, and evidence of "
    "several rows adds up slowly."
)


def read(model: Any, names: list[str] | None) -> Ensemble:
    """The trees of an estimator whose class is in `KNOWN`."""
    kind = type(model).__name__
    if not hasattr(model, "n_features_in_"):
        raise InputError(f"the {kind} is not fitted. Call its `fit` first.")
    if getattr(model, "n_outputs_", 1) > 1:
        raise InputError(f"the {kind} has several targets, which are not classes of one object. Train a model for each target.")
    parts = KNOWN[kind](model)
    features = [str(name) for name in getattr(model, "feature_names_in_", [""] * model.n_features_in_)]
    return Ensemble.from_trees(
        f"scikit-learn {kind}",
        features,
        parts.base,
        parts.trees,
        names=names if _is_classifier(model) else None,
        notes=parts.notes,
        link=parts.link,
        last_of_ties=parts.last_of_ties,
    )


def _is_classifier(model: Any) -> bool:
    return hasattr(model, "classes_")


def _single(model: Any) -> _Parts:
    return _votes(model, [model])


def _forest(model: Any) -> _Parts:
    return _votes(model, model.estimators_)


def _votes(model: Any, estimators: Sequence[Any]) -> _Parts:
    """Every tree gives the share of each class, or a value; the forest's prediction is their mean."""
    is_classifier = _is_classifier(model)
    trees: list[_Tree] = []
    for estimator in estimators:
        values = np.asarray(estimator.tree_.value, dtype=np.float64)[:, 0, :]
        if is_classifier:
            values = values / values.sum(axis=1, keepdims=True)
        trees.append(_tree(estimator.tree_, None if is_classifier else 0, values / len(estimators)))
    outputs = len(model.classes_) if is_classifier else 1
    return _Parts([0.0] * outputs, trees, [_VOTES] if is_classifier else [])


def _gradient(model: Any) -> _Parts:
    """Trees scaled by a learning rate, on top of a constant model."""
    if not _is_constant(model.init_):
        raise InputError(
            f"the model's `init` is a {type(model.init_).__name__} whose prediction is no constant. Train without `init`."
        )
    first = np.ravel(model._raw_predict_init(np.zeros((1, model.n_features_in_), dtype=np.float32)))
    estimators = np.asarray(model.estimators_)
    outputs = estimators.shape[1]
    is_binary = outputs == 1 and _is_classifier(model)
    notes: list[str] = []
    scale = 1.0
    if type(model._loss).__name__ == "ExponentialLoss":
        # The loss is of half the log-odds. Twice the scores are exact in floats.
        scale = 2.0
        notes.append(
            'The loss is "exponential": margins are twice the values of `decision_function`, so that posteriors are those of '
            "`predict_proba`."
        )
    trees = [
        _tree(estimator.tree_, output + is_binary, scale * model.learning_rate * estimator.tree_.value[:, 0, :])
        for stage in estimators
        for output, estimator in enumerate(stage)
    ]
    base = ([0.0] if is_binary else []) + [scale * float(value) for value in first]
    # Of two classes the second one is that of a score of exactly 0.
    return _Parts(base, trees, notes, last_of_ties=is_binary)


def _is_constant(init: Any) -> bool:
    """True if boosting starts from the same value for every row, at every call."""
    kind = (type(init).__module__, type(init).__name__)
    if kind == ("sklearn.dummy", "DummyClassifier"):
        return bool(init.strategy != "stratified")
    return isinstance(init, str) or kind == ("sklearn.dummy", "DummyRegressor")


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


def _histogram(model: Any) -> _Parts:
    """Boosted trees over histograms, which no file format of scikit-learn's holds."""
    categories = getattr(model, "is_categorical_", None)
    if categories is not None and np.any(categories):
        raise InputError(
            "the model splits on categories. Encode categories as numbers before training, one column of 0 and 1 for each "
            "(one-hot)."
        )
    first = np.ravel(model._baseline_prediction)
    is_binary = len(first) == 1 and _is_classifier(model)
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
    link = _LINKS.get(type(model._loss.link).__name__)
    if _is_classifier(model):
        if type(model._loss).__name__ not in ("HalfBinomialLoss", "HalfMultinomialLoss"):
            raise InputError("the model's `loss` is an object of its own. Train with loss=\"log_loss\".")
        link = "identity"
    elif link is None:
        name = type(model._loss.link).__name__
        raise InputError(f"the model's loss has the link {name}, which is not known. Train with a loss of scikit-learn's by name.")
    return _Parts(([0.0] if is_binary else []) + [float(value) for value in first], trees, [], link)


_LINKS = {"IdentityLink": "identity", "LogLink": "exponential"}
"""The function from a margin to a prediction, by scikit-learn's class of the link."""

KNOWN: dict[str, Callable[[Any], _Parts]] = {
    "DecisionTreeClassifier": _single,
    "DecisionTreeRegressor": _single,
    "ExtraTreeClassifier": _single,
    "ExtraTreeRegressor": _single,
    "ExtraTreesClassifier": _forest,
    "ExtraTreesRegressor": _forest,
    "GradientBoostingClassifier": _gradient,
    "GradientBoostingRegressor": _gradient,
    "HistGradientBoostingClassifier": _histogram,
    "HistGradientBoostingRegressor": _histogram,
    "RandomForestClassifier": _forest,
    "RandomForestRegressor": _forest,
}
"""The estimators whose predictions are a sum of their trees. Others may hold the same trees and weigh, pick or combine them."""
