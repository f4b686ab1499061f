"""Pipelines of scikit-learn: scalers go into the thresholds of the trees behind them."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputError
from ._native import Ensemble

_SCALERS = ("MaxAbsScaler", "MinMaxScaler", "RobustScaler", "StandardScaler")


def steps_of(pipeline: Any) -> tuple[list[Any], Any]:
    """The scalers of a pipeline and of those inside it, and the model at its end."""
    *scalers, last = _flat(pipeline) or [None]
    for step in scalers:
        kind = type(step)
        if kind.__name__ not in _SCALERS or not kind.__module__.startswith("sklearn."):
            raise InputError(
                f"the pipeline has a {kind.__name__}, and only scalers of each column alone can go into thresholds: "
                f"{', '.join(_SCALERS)}. Give the last step, and transform rows as the first steps do."
            )
    return scalers, last


def _flat(pipeline: Any) -> list[Any]:
    """The steps, without those that change nothing."""
    steps: list[Any] = []
    for _, step in pipeline.steps:
        if type(step).__name__ == "Pipeline" and type(step).__module__.startswith("sklearn."):
            steps += _flat(step)
        elif step is not None and not isinstance(step, str):
            steps.append(step)
    return steps


def fold(ensemble: Ensemble, scalers: list[Any], in_f32: bool) -> Ensemble:
    """The ensemble with thresholds of rows that are not scaled: each row of f32 numbers goes the same way as scaled in f64.

    A scaler never puts a larger number before a smaller one, so the numbers that go left are those below one of the f32 numbers:
    it is found by bisection, with the scalers themselves. With `in_f32` the trees round scaled numbers to f32.
    """
    names = getattr(scalers[0], "feature_names_in_", None)
    # With names, they would ask for tables of them.
    scalers = [copy.copy(scaler) for scaler in scalers]
    for scaler in scalers:
        vars(scaler).pop("feature_names_in_", None)
    columns = int(scalers[0].n_features_in_)
    features, thresholds, inclusive = ensemble._splits()
    feature, threshold = np.array(features, dtype=np.int64), np.array(thresholds)
    # Places of the f32 numbers in their order: the number at `low` goes left, or is below all; that at `high` goes right.
    most = int(np.float32(np.finfo(np.float32).max).view(np.int32))
    low, high = np.full(len(feature), -most - 1, dtype=np.int64), np.full(len(feature), most + 1, dtype=np.int64)
    order = np.argsort(feature, kind="stable")
    place = np.empty_like(order)
    counts = np.bincount(feature, minlength=columns)
    # Each column of the rows that are tried has the numbers of its own splits.
    place[order] = np.arange(len(order)) - np.repeat(np.cumsum(counts) - counts, counts)
    for _ in range(33):
        middle = (low + high) // 2
        rows = np.zeros((max(int(counts.max(initial=0)), 1), columns))
        rows[place, feature] = _number(middle)
        for scaler in scalers:
            rows = np.asarray(scaler.transform(rows), dtype=np.float64)
        scaled = rows[place, feature]
        if in_f32:
            with np.errstate(over="ignore"):
                scaled = scaled.astype(np.float32).astype(np.float64)
        goes_left = np.where(inclusive, scaled <= threshold, scaled < threshold)
        is_open = high - low > 1
        low, high = np.where(goes_left & is_open, middle, low), np.where(~goes_left & is_open, middle, high)
    below = np.where(high > most, np.inf, _number(np.minimum(high, most))).tolist()
    return ensemble._with_thresholds(below, None if names is None else [str(name) for name in names])


def _number(place: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """The f32 number at a place in their order; 0 is +0, and the one before it the least number below 0."""
    bits = np.abs(place).astype(np.int32)
    return np.where(place < 0, -1.0, 1.0) * bits.view(np.float32).astype(np.float64)
