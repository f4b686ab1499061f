"""Touches as scikit-learn takes rows."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import numpy.typing as npt

from ._estimator import Estimator
from ._import import compile
from ._native import DataSet, train
from ._stream import _agree, _flat, _Ids, _ids, _not_fitted, _stretches


class TouchRecognizer(Estimator):
    """An estimator of scikit-learn's kind that recognizes objects by touch.

    A row of `X` is a touch: three contact times in seconds, NaN where a finger did not touch; with the probe's direction and
    alignment nine numbers. `fit` trains an ensemble, `ensemble_`, and compiles it to `model_`, which is for a chip; arguments are
    as for `palpate.train` and `palpate.compile`. With a `sequence`, touches that have the same value of it follow each other, are
    of one object, and have one answer together.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=1000)
    >>> recognizer = palpate.TouchRecognizer(rounds=10).fit(data.times[::2], data.objects[::2])
    >>> recognizer.score(data.times[1::2], data.objects[1::2]) > 0.6
    True
    """

    def __init__(
        self,
        *,
        preset: str = "compact",
        descriptor: str | None = None,
        rounds: int | None = None,
        noise: str = "",
        timer: str = "",
        leaf: str | None = None,
        seed: int = 1,
    ) -> None:
        self.preset = preset
        self.descriptor = descriptor
        self.rounds = rounds
        self.noise = noise
        self.timer = timer
        self.leaf = leaf
        self.seed = seed

    def fit(self, X: npt.ArrayLike, y: _Ids) -> TouchRecognizer:
        """Trains on touches and the object of each."""
        touches = np.asarray(X, dtype=np.float64)
        labels = _flat(y, "label")
        _agree(len(touches), y=len(_ids(y, "label")))
        self.classes_, objects = np.unique(labels, return_inverse=True)
        names = [str(name) for name in self.classes_.tolist()]
        posed: dict[str, Any] = {"direction": touches[:, 3:6], "alignment": touches[:, 6:9]} if touches.shape[1] == 9 else {}
        is_partial = bool(np.isnan(touches[:, :3]).any())
        data = DataSet.from_arrays(touches[:, :3], objects, names, approaches=is_partial, **posed)
        given = {name: value for name, value in self.get_params().items() if name != "leaf"}
        self.ensemble_ = train(data, **given)
        self.model_ = compile(self.ensemble_, leaf=self.leaf)
        return self

    def decision_function(self, X: npt.ArrayLike, *, sequence: _Ids | None = None) -> npt.NDArray[np.float64]:
        """The evidence in nats for each object, in the order of `classes_`: of each touch, or sequence."""
        if not hasattr(self, "model_"):
            raise _not_fitted(self)
        margins = self.model_.margins(X)[:, [self.model_.objects.index(str(name)) for name in self.classes_.tolist()]]
        if sequence is None:
            return margins
        ids = _ids(sequence, "sequence")
        _agree(len(margins), sequence=len(ids))
        return np.array([margins[stretch].sum(axis=0) for stretch in _stretches(ids)]).reshape(-1, margins.shape[1])

    def predict_proba(self, X: npt.ArrayLike, *, sequence: _Ids | None = None) -> npt.NDArray[np.float64]:
        """The probability of each object, all being as likely before: of each touch, or sequence."""
        evidence = self.decision_function(X, sequence=sequence)
        weights = np.exp(evidence - evidence.max(axis=1, keepdims=True, initial=-np.inf))
        shares: npt.NDArray[np.float64] = weights / weights.sum(axis=1, keepdims=True)
        return shares

    def predict(self, X: npt.ArrayLike, *, sequence: _Ids | None = None) -> npt.NDArray[Any]:
        """The likeliest object of each touch, or sequence."""
        evidence = self.decision_function(X, sequence=sequence)
        objects: npt.NDArray[Any] = self.classes_[evidence.argmax(axis=1)]
        return objects

    def score(self, X: npt.ArrayLike, y: _Ids, *, sequence: _Ids | None = None) -> float:
        """The share of touches, or sequences, whose object is found."""
        labels = _flat(y, "label")
        _agree(len(np.asarray(X)), y=len(labels))
        if sequence is not None:
            labels = labels[[stretch.start for stretch in _stretches(_ids(sequence, "sequence"))]]
        return float(np.mean(self.predict(X, sequence=sequence) == labels))

    def __sklearn_tags__(self) -> Any:
        """Tags that scikit-learn reads from estimators."""
        utils = importlib.import_module("sklearn.utils")
        return utils.Tags(
            estimator_type="classifier",
            target_tags=utils.TargetTags(required=True),
            classifier_tags=utils.ClassifierTags(),
            input_tags=utils.InputTags(allow_nan=True),
        )
