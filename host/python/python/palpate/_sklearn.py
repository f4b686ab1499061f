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
    probability: str = "softmax"
    """The rule by which `predict_proba` makes probabilities of margins."""
    targets: bool = False
    """True if each output is a target of a regression, and none is a class."""
    compares_f64: bool = False
    """True if values are compared in f64, and not rounded to f32 first."""


def read(model: Any, names: list[str] | None) -> Ensemble:
    """The trees of an estimator whose class is in `KNOWN`."""
    kind = type(model).__name__
    if getattr(model, "n_outputs_", 1) > 1 and _is_classifier(model):
        raise InputError(f"the {kind} has classes of several kinds, each of which is a question of its own. Train a model for each.")
    if _is_classifier(model) and len(model.classes_) < 2:
        raise InputError(f"the {kind} knows one class, {model.classes_[0]}, and nothing to distinguish. Train on two or more.")
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
        targets=parts.targets,
        probability=parts.probability,
        compares_f64=parts.compares_f64,
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
    targets = 1 if is_classifier else int(model.n_outputs_)
    is_each = is_classifier or targets > 1
    trees: list[_Tree] = []
    for estimator in estimators:
        values = np.asarray(estimator.tree_.value, dtype=np.float64)
        if is_classifier:
            values = values[:, 0, :] / values[:, 0, :].sum(axis=1, keepdims=True)
        else:
            values = values[:, :, 0]
        trees.append(_tree(estimator.tree_, None if is_each else 0, values / len(estimators)))
    outputs = len(model.classes_) if is_classifier else targets
    return _Parts([0.0] * outputs, trees, [], probability="shares", targets=targets > 1)


def _isolation(model: Any) -> _Parts:
    """The anomaly score, 2 to the power of minus the mean depth of a row's leaves over that of a random tree's."""
    from sklearn.ensemble._iforest import _average_path_length  # type: ignore[import-untyped]

    usual = float(_average_path_length(np.array([model._max_samples]))[0])
    if usual == 0.0:
        raise InputError("the IsolationForest was trained on one row for each tree: every row has the same score.")
    factor = -np.log(2.0) / (len(model.estimators_) * usual)
    trees: list[_Tree] = []
    for estimator, features in zip(model.estimators_, model.estimators_features_, strict=True):
        own = estimator.tree_
        depth = np.zeros(own.node_count)
        for node in range(own.node_count):
            if own.children_left[node] >= 0:
                depth[[own.children_left[node], own.children_right[node]]] = depth[node] + 1.0
        values = factor * (depth + _average_path_length(own.n_node_samples))
        output, left, right, feature, threshold, missing, values = _tree(own, 0, values)
        # Each tree may have been given some of the columns.
        feature = np.where(left >= 0, np.asarray(features, dtype=np.int64)[np.maximum(feature, 0)], feature)
        trees.append((output, left, right, feature, threshold, missing, values))
    note = (
        f"The value is the anomaly score, from 0 to 1, that is -score_samples(X): the forest calls a row an outlier above "
        f"{-float(model.offset_):.9g}."
    )
    return _Parts([0.0], trees, [note], "exponential")


def _calibrated(model: Any) -> _Parts:
    """The margins that a calibrator makes of those of one estimator: a multiple of them and a constant."""
    if len(model.calibrated_classifiers_) != 1:
        raise InputError(
            f"the CalibratedClassifierCV averages {len(model.calibrated_classifiers_)} calibrated models, which is not a sum of "
            "trees. Train with ensemble=False, or calibrate a fitted model (sklearn.frozen.FrozenEstimator)."
        )
    (own,) = model.calibrated_classifiers_
    estimator = own.estimator
    # A model that was fitted before is wrapped.
    estimator = getattr(estimator, "estimator", estimator) if type(estimator).__name__ == "FrozenEstimator" else estimator
    kind = type(estimator).__name__
    if type(estimator).__module__.partition(".")[0] != "sklearn" or kind not in KNOWN or kind == "CalibratedClassifierCV":
        raise InputError(f"what the CalibratedClassifierCV calibrates is a {kind}. Calibrate a forest or boosted trees of scikit-learn.")
    parts = KNOWN[kind](estimator)
    classes = len(model.classes_)
    if len(estimator.classes_) != classes:
        raise InputError("the calibrated estimator knows other classes than the CalibratedClassifierCV.")
    is_vote = not hasattr(estimator, "decision_function")
    # The margins of this loss are twice the values that were calibrated.
    half = 0.5 if not is_vote and type(getattr(estimator, "_loss", None)).__name__ == "ExponentialLoss" else 1.0
    calibrators = [_line(calibrator, classes) for calibrator in own.calibrators]
    if len(calibrators) == 1:
        calibrators = [(0.0, 0.0), calibrators[0]]
    notes = [
        "Margins are calibrated: posteriors of two classes are those of predict_proba."
        if classes == 2 and own.method == "sigmoid"
        else "Margins are those of the calibrated classes: classes are right, posteriors are not the calibrated probabilities."
    ]
    is_known = classes == 2 and own.method == "sigmoid"
    slopes = np.array([slope * half for slope, _ in calibrators])
    base = [slope * first + constant for (_, constant), slope, first in zip(calibrators, slopes, parts.base, strict=True)]
    trees: list[_Tree] = []
    for output, left, right, feature, threshold, missing, values in parts.trees:
        if output is not None:
            scaled = slopes[output] * values
        elif classes == 2:
            # Votes for the second class alone were calibrated.
            output, scaled = 1, slopes[1] * values.reshape(-1, 2)[:, 1]
        else:
            scaled = (values.reshape(-1, classes) * slopes).ravel()
        trees.append((output, left, right, feature, threshold, missing, np.ascontiguousarray(scaled)))
    probability = "softmax" if is_known else "unknown"
    return _Parts(base, trees, notes, probability=probability, compares_f64=parts.compares_f64)


def _line(calibrator: Any, classes: int) -> tuple[float, float]:
    """A slope and a constant that make a margin of what was calibrated: log-odds, or of steps how far it is above one half."""
    kind = type(calibrator).__name__
    if kind == "_SigmoidCalibration":
        return -float(calibrator.a_), -float(calibrator.b_)
    if kind != "IsotonicRegression" or classes > 2:
        raise InputError(
            f"a {kind} of {classes} classes keeps no order between them that trees could add up. Train with method=\"sigmoid\", or "
            "two classes."
        )
    at, share = np.asarray(calibrator.X_thresholds_, np.float64), np.asarray(calibrator.y_thresholds_, np.float64)
    below = np.flatnonzero(share <= 0.5)
    if len(below) == 0 or len(below) == len(share):
        raise InputError("the calibrated probability never crosses one half, so every row gets the same class. Calibrate on more rows.")
    last = int(below[-1])
    crossing = at[last] + (0.5 - share[last]) / (share[last + 1] - share[last]) * (at[last + 1] - at[last])
    return 1.0, -float(crossing)


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
    # With two classes, a score of exactly 0 means the second one.
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
    # Its trees number the columns of categories first, and then the others.
    of_categories = getattr(model, "is_categorical_", None)
    is_category = np.zeros(model.n_features_in_, dtype=bool) if of_categories is None else np.asarray(of_categories, dtype=bool)
    order = np.concatenate([np.flatnonzero(is_category), np.flatnonzero(~is_category)])
    first = np.ravel(model._baseline_prediction)
    is_binary = len(first) == 1 and _is_classifier(model)
    trees: list[_Tree] = []
    for stage in model._predictors:
        for output, predictor in enumerate(stage):
            nodes = predictor.nodes
            leaf = nodes["is_leaf"].astype(bool)
            if np.any(nodes["is_categorical"][~leaf]):
                raise InputError(
                    "the model splits on categories. Encode categories as numbers before training, one column of 0 and 1 for each "
                    "(one-hot)."
                )
            trees.append(
                (
                    output + is_binary,
                    np.where(leaf, -1, nodes["left"].astype(np.int64)),
                    nodes["right"].astype(np.int64),
                    np.where(leaf, 0, order[np.where(leaf, 0, nodes["feature_idx"].astype(np.int64))]),
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
    base = ([0.0] if is_binary else []) + [float(value) for value in first]
    return _Parts(base, trees, [], link, compares_f64=True)


_LINKS = {"IdentityLink": "identity", "LogLink": "exponential"}
"""The function from a margin to a prediction, by scikit-learn's class of the link."""

KNOWN: dict[str, Callable[[Any], _Parts]] = {
    "CalibratedClassifierCV": _calibrated,
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
    "IsolationForest": _isolation,
    "RandomForestClassifier": _forest,
    "RandomForestRegressor": _forest,
}
"""The estimators whose predictions are a sum of their trees. Others may hold the same trees and weigh, pick or combine them."""
