"""Models of other libraries, as they are in memory, and compiling."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import _native, _sklearn
from ._errors import InputError
from ._native import Ensemble, Model


def to_ensemble(model: object, names: Sequence[str] | None = None) -> Ensemble:
    """The trees of a model of another library: a booster or estimator of XGBoost, LightGBM or CatBoost, a forest or
    boosted trees of scikit-learn, a model of ONNX; or a file that one of them wrote, as a path.

    `names` are the classes', in the order of the labels. Where training stopped early, the trees up to the best round are
    taken, as the library predicts with them.
    """
    given = None if names is None else list(names)
    if isinstance(model, Ensemble):
        if given is not None:
            raise InputError("the model has names for its objects already. Leave `names` out.")
        return model
    if isinstance(model, (str, os.PathLike)):
        return Ensemble.load(model, given)
    library = type(model).__module__.partition(".")[0]
    if given is None:
        given = _classes(model)
    for kind in type(model).__mro__:
        library = kind.__module__.partition(".")[0]
        if library in _READERS:
            return _READERS[library](model, given)
    what = f"{type(model).__module__}.{type(model).__qualname__}"
    raise InputError(
        f"{what} is no model whose trees can be read. Give a model of XGBoost, LightGBM, CatBoost, scikit-learn or ONNX, an "
        "Ensemble, or a file."
    )


def compile(
    model: object,
    *,
    max_bytes: int | None = None,
    names: Sequence[str] | None = None,
    leaf: str = "i16",
    layout: str | None = None,
    goal: str = "balanced",
    error_rate: float = 0.01,
    max_touches: int = 200,
    priors: Sequence[float] | None = None,
    scales: Sequence[float] | None = None,
) -> Model:
    """Compiles an ensemble, or a model of another library, to the bytes that a microcontroller reads.

    `model` and `names` are as for `to_ensemble`. `leaf` is "i8", "i16" or "f32": what leaves are stored as; with "f32" the
    margins of an XGBoost model stay its own, bit for bit. `layout` is "compact", "complete", "grid", "wide" or "patterns";
    without one, the best for the `goal` ("balanced", "speed" or "size") is taken.

    With `max_bytes`, the layout is chosen for size and leaves are stored in fewer bits where the model would be larger; if
    it still is, that is an error: no tree is left out. `error_rate` and `max_touches` are where recognizers stop, `priors`
    say how likely each object is, `scales` how many units make up 1 of each feature for a chip that measures in whole
    numbers.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=300)
    >>> model = palpate.compile(palpate.train(data, rounds=5), max_bytes=4000)
    >>> model.size <= 4000
    True
    """
    return _native.compile(
        to_ensemble(model, names),
        max_bytes=max_bytes,
        leaf=leaf,
        layout=layout,
        goal=goal,
        error_rate=error_rate,
        max_touches=max_touches,
        priors=None if priors is None else list(priors),
        scales=None if scales is None else list(scales),
    )


def _classes(model: object) -> list[str] | None:
    """The names of a classifier's classes, where it has some."""
    if getattr(model, "_estimator_type", "classifier") != "classifier":
        return None
    classes = getattr(model, "classes_", None)
    if classes is None or len(classes) < 2:
        return None
    return [str(name) for name in classes]


def _xgboost(model: Any, names: list[str] | None) -> Ensemble:
    booster = model
    if hasattr(model, "get_booster"):
        booster = model.get_booster()
    # The estimator predicts with the trees up to the best round, where training stopped early.
    best = None
    if booster is not model:
        try:
            best = model.best_iteration
        except AttributeError:
            best = None
    if best is not None and best + 1 < booster.num_boosted_rounds():
        booster = booster[: best + 1]
    return Ensemble.from_bytes(bytes(booster.save_raw("ubj")), names)


def _lightgbm(model: Any, names: list[str] | None) -> Ensemble:
    booster = getattr(model, "booster_", model)
    return Ensemble.from_bytes(booster.model_to_string().encode(), names)


def _catboost(model: Any, names: list[str] | None) -> Ensemble:
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "model.json"
        model.save_model(str(path), format="json")
        return Ensemble.load(path, names)


def _onnx(model: Any, names: list[str] | None) -> Ensemble:
    return Ensemble.from_bytes(model.SerializeToString(), names)


_READERS = {
    "catboost": _catboost,
    "lightgbm": _lightgbm,
    "onnx": _onnx,
    "sklearn": _sklearn.read,
    "xgboost": _xgboost,
}
