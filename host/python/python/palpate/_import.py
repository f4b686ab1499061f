"""Models of other libraries, as they are in memory, and compiling."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import _native, _pipeline, _sklearn
from ._errors import InputError, ModelWarning, SettingError
from ._native import Ensemble, Model


def to_ensemble(
    model: object, names: Sequence[str] | None = None, *, all_trees: bool = False, missing: float | None = None
) -> Ensemble:
    """The trees of a model of another library: a booster or estimator of XGBoost, LightGBM or CatBoost, a forest or
    boosted trees of scikit-learn, a model of ONNX; a pipeline of scikit-learn whose scalers come before one of these; or a file
    that one of them wrote, as a path.

    A pipeline's scalers (StandardScaler, MinMaxScaler, MaxAbsScaler, RobustScaler) go into the thresholds, so that the model takes
    rows as they are before scaling, and decides as the pipeline does on rows in f64 (an array of float32 is scaled in f32). The
    features have the names of the table that the pipeline was fitted on.

    `names` are the classes', in the order of the labels. Where training stopped early, the trees up to the best round are
    taken, as the library predicts with them; with `all_trees` all of them. `missing` is the number that stood for a missing
    value in training, beside NaN: XGBoost's boosters and files do not hold it, its estimators do. `Ensemble.notes` says what
    to know about the trees.

    Models are identified by their exact class. Any other class, and one that is derived from these, is refused by name: it may
    predict in another way.
    """
    given = None if names is None else list(names)
    if isinstance(model, Ensemble):
        if given is not None:
            raise InputError("the model has names for its objects already. Leave `names` out.")
        return model
    if isinstance(model, (str, os.PathLike)):
        return Ensemble.load(model, given, all_trees=all_trees, missing=missing)
    if isinstance(model, type):
        raise InputError(f"{model.__qualname__} is a class, not a model. Give an object of it that is fitted.")
    library, name = _class(type(model))
    reader = _READERS.get(library, {}).get(name)
    if reader is None:
        raise _refusal(model)
    is_fitted = model.is_fitted() if hasattr(model, "is_fitted") else hasattr(model, "n_features_in_")
    if hasattr(model, "fit") and name != "Pipeline" and not is_fitted:
        raise InputError(f"the {name} is not fitted. Call its `fit` first.")
    if missing is not None and library != "xgboost":
        raise SettingError(f"missing is {missing}. Leave it out: a model of {library} says itself what is missing.")
    ensemble = reader(model, _Asked(_classes(model) if given is None else given, all_trees, missing))
    labels = getattr(model, "classes_", ())
    # `predict` gives the classifier's own labels, unless the classes have other names.
    is_own = given is None and len(labels) == len(ensemble.objects)
    return ensemble._with_labels(np.asarray(labels)) if is_own else ensemble


@dataclass(frozen=True)
class _Asked:
    """Statements of a caller about a model."""

    names: list[str] | None
    all_trees: bool
    missing: float | None


def compile(
    model: object,
    *,
    max_bytes: int | None = None,
    names: Sequence[str] | None = None,
    leaf: str | None = None,
    error_rate: float = 0.01,
    max_touches: int = 200,
    priors: Sequence[float] | None = None,
    scales: Sequence[float] | None = None,
    all_trees: bool = False,
    missing: float | None = None,
    row_number: str | None = None,
) -> Model:
    """Compiles an ensemble, or a model of another library, to the bytes that a microcontroller reads.

    `model`, `names`, `all_trees` and `missing` are as for `to_ensemble`. `leaf` is "i8", "i16" or "f32": what leaves are stored
    as, by default what `palpate export` chooses; with "f32" the margins of an XGBoost model stay its own, bit for bit. What to know about the model is a `ModelWarning`,
    and is in its `notes`.

    With `max_bytes`, leaves are stored in fewer bits where the model would be larger; if it still is, that is an error: no
    tree is left out. `error_rate` and `max_touches` are where recognizers stop, `priors` say how likely each object is,
    `scales` how many units make up 1 of each feature for a chip that measures in whole numbers. `row_number` names the
    feature that is a row's number in its sequence, counted from 1: recognizers count it.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=300)
    >>> model = palpate.compile(palpate.train(data, rounds=5), max_bytes=4000)
    >>> model.size <= 4000
    True
    """
    compiled = _native.compile(
        to_ensemble(model, names, all_trees=all_trees, missing=missing),
        max_bytes=max_bytes,
        leaf=leaf,
        error_rate=error_rate,
        max_touches=max_touches,
        priors=None if priors is None else list(priors),
        scales=None if scales is None else list(scales),
        row_number=row_number,
    )
    for note in compiled.notes:
        warnings.warn(note, ModelWarning, stacklevel=2)
    return compiled


def _class(kind: type) -> tuple[str, str]:
    """The library that a class is of, and its name there."""
    return kind.__module__.partition(".")[0], kind.__qualname__


def _refusal(model: object) -> InputError:
    """The reason why an object of an unknown class is refused, and what to do."""
    what = f"{type(model).__module__}.{type(model).__qualname__}"
    for kind in type(model).__mro__[1:]:
        library, name = _class(kind)
        if name in _READERS.get(library, {}):
            return InputError(
                f"{what} is derived from {library}'s {name} and may predict in another way. {_INSIDE.get(library, '')}Give "
                f"the trees as a {name} itself, or as a file of the library."
            )
    library, name = _class(type(model))
    if library in _READERS:
        known = ", ".join(sorted(_READERS[library]))
        return InputError(
            f"{library}'s {name} has no trees that can be read: what it predicts is not known to be the sum of its trees. "
            f"{_INSIDE.get(library, '')}Of {library} these are taken: {known}."
        )
    return InputError(
        f"{what} is not a model whose trees can be read. Give a model of XGBoost, LightGBM, CatBoost, scikit-learn or ONNX, an "
        "Ensemble, or a file."
    )


def _classes(model: object) -> list[str] | None:
    """The names of a classifier's classes, where it has some."""
    classes = getattr(model, "classes_", None)
    if classes is None:
        return None
    names = [str(name) for name in classes]
    # For a single class, 0, XGBoost and LightGBM have a margin for the other one as well.
    if len(names) == 1 and names != ["0"]:
        raise InputError(f"the {type(model).__name__} knows one class, {names[0]}, and nothing to distinguish. Train on two or more.")
    return names if len(names) > 1 else None


def _cut(taken: int, rounds: int) -> list[str]:
    """The note on trees that are left out, where some are."""
    if taken >= rounds:
        return []
    return [
        f"Training stopped early: the best {taken} of {rounds} rounds are taken, as the library predicts with them. "
        "all_trees=True takes all."
    ]


def _xgboost(model: Any, asked: _Asked) -> Ensemble:
    booster, missing = model, asked.missing
    if hasattr(model, "get_booster"):
        own = np.nan if model.missing is None else float(model.missing)
        if missing is not None and not np.array_equal(missing, own, equal_nan=True):
            raise SettingError(f"missing is {missing}. Leave it out: the {type(model).__name__} says that it is {own}.")
        missing = own
        if hasattr(model, "classes_") and model.objective == "binary:logitraw":
            raise InputError(
                "with objective=\"binary:logitraw\" the XGBClassifier compares margins with 0.5, not with 0, for its classes. "
                "Train with binary:logistic, or give `model.get_booster()`, which has no classes."
            )
        booster = model.get_booster()
    content = bytes(booster.save_raw("ubj"))
    return Ensemble.from_bytes(content, asked.names, all_trees=asked.all_trees, missing=missing)


def _lightgbm(model: Any, asked: _Asked) -> Ensemble:
    booster = getattr(model, "booster_", model)
    if hasattr(model, "classes_") and callable(model.objective):
        raise InputError(
            "with an objective of its own the LGBMClassifier predicts scores, and no classes. Give `model.booster_`, whose values "
            'are those scores, or train with objective="binary" or "multiclass".'
        )
    rounds = booster.current_iteration()
    taken = booster.best_iteration if booster.best_iteration > 0 and not asked.all_trees else rounds
    text = booster.model_to_string(num_iteration=taken)
    return Ensemble.from_bytes(text.encode(), asked.names, notes=_cut(taken, rounds))


def _catboost(model: Any, asked: _Asked) -> Ensemble:
    # CatBoost predicts with every tree that it kept.
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "model.json"
        model.save_model(str(path), format="json")
        return Ensemble.from_bytes(path.read_bytes(), asked.names)


def _onnx(model: Any, asked: _Asked) -> Ensemble:
    return Ensemble.from_bytes(model.SerializeToString(), asked.names)


def _sklearn_trees(model: Any, asked: _Asked) -> Ensemble:
    # Its boosted trees stop early by leaving trees out themselves, or predict with all of them.
    return _sklearn.read(model, asked.names)


def _of_pipeline(model: Any, asked: _Asked) -> Ensemble:
    scalers, last = _pipeline.steps_of(model)
    ensemble = to_ensemble(last, asked.names, all_trees=asked.all_trees)
    is_f64 = type(last).__name__.startswith("HistGradientBoosting") or _class(type(last))[0] == "lightgbm"
    return _pipeline.fold(ensemble, scalers, not is_f64) if scalers else ensemble


_Reader = Callable[[Any, _Asked], Ensemble]

_READERS: dict[str, dict[str, _Reader]] = {
    "catboost": dict.fromkeys(["CatBoost", "CatBoostClassifier", "CatBoostRanker", "CatBoostRegressor"], _catboost),
    "lightgbm": dict.fromkeys(["Booster", "LGBMClassifier", "LGBMRanker", "LGBMRegressor"], _lightgbm),
    "onnx": {"ModelProto": _onnx},
    "sklearn": dict.fromkeys(_sklearn.KNOWN, _sklearn_trees) | {"Pipeline": _of_pipeline},
    "xgboost": dict.fromkeys(
        ["Booster", "XGBClassifier", "XGBRFClassifier", "XGBRFRegressor", "XGBRanker", "XGBRegressor"], _xgboost
    ),
}
"""The readers, by library and class. A class that is not here is refused."""

_INSIDE = {
    "lightgbm": "A booster inside it may be `model.booster_`. ",
    "sklearn": "Of a search give `best_estimator_`. ",
    "xgboost": "A booster inside it may be `model.get_booster()`. ",
}
"""Attributes in which a readable model may be found inside one that is not."""
