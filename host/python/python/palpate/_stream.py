"""Verdicts on streams of rows: as early as a promised error rate allows, of any model over rows of features."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import InputError
from ._import import compile
from ._native import Model, Recognizer
from ._rows import rows_of, take
from ._types import Progress, Verdict

_Ids = Sequence[object] | npt.NDArray[Any]


@dataclass(frozen=True)
class Calibrated:
    """A model that keeps a promise, and what its calibration found. Shares are between 0 and 1."""

    model: Model
    """The model with its thresholds."""
    error: float
    """Share of the names given that were wrong, in the sequences that the promise rests on."""
    undecided: float
    """Share of these sequences that ended without a name."""
    mean_rows: float
    """Rows used on average."""
    sequences: int
    """Sequences that the promise rests on."""
    groups: int | None
    """Groups that the promise rests on, and is for."""
    raw: dict[str, Any]
    """All figures, as `palpate calibrate --json` prints them."""


@dataclass(frozen=True)
class Ends:
    """Verdicts on sequences of rows. Shares are between 0 and 1."""

    error: float
    """Of the names given, the share that was wrong."""
    undecided: float
    """Of all sequences, the share without a verdict."""
    unknown: float
    """Of all sequences, the share that was called unknown."""
    mean_rows: float
    """Rows used on average."""
    fixed_rows: float | None
    """The least fixed number of rows with which no more names are wrong; `None` if all rows are not enough."""
    raw: dict[str, Any]
    """All figures, as `palpate evaluate --json` prints them."""


def _texts(values: _Ids) -> list[str]:
    return [str(value) for value in np.asarray(values).tolist()]


def calibrate(
    model: object,
    rows: npt.ArrayLike,
    labels: _Ids,
    *,
    sequence: _Ids,
    groups: _Ids | None = None,
    error_rate: float = 0.01,
    per: str = "average",
    confidence: float = 0.95,
    max_rows: int | None = None,
    strangers: str | None = None,
    background: npt.ArrayLike | None = None,
    background_sequence: _Ids | None = None,
    seed: int = 1,
    progress: Progress | None = None,
) -> Calibrated:
    """Sets a model's thresholds so that it keeps a promised error rate: verdicts of rows as early as that allows.

    `model` is a compiled model over rows, or what `palpate.compile` takes. Rows with the same value of `sequence` follow each
    other, and are of one class. Without `groups` sequences must be independent of each other; with them, such as a person for
    each row, the promise is for new groups. The rows must be others than those of the training. `per` is what the rate is
    promised of: "average", "name" or "object". With `strangers` ("likely" or "certain") the model also tests whether rows fit
    any class; rows of others can be given as a `background`, with their own sequences.

    >>> import numpy as np, palpate
    >>> from sklearn.ensemble import HistGradientBoostingClassifier
    >>> random = np.random.default_rng(1)
    >>> y = random.integers(3, size=3000)
    >>> X = (y + random.normal(size=(8, 3000))).T.reshape(-1, 1)
    >>> sequence, y = np.repeat(np.arange(3000), 8), np.repeat(y, 8)
    >>> estimator = HistGradientBoostingClassifier(max_iter=5).fit(X[:8000], y[:8000])
    >>> sure = palpate.calibrate(estimator, X[8000:], y[8000:], sequence=sequence[8000:], error_rate=0.05)
    >>> sure.error <= 0.05
    True
    """
    compiled = model if isinstance(model, Model) else compile(model, max_touches=max_rows or 200)
    calibrated, text = _native.calibrate(
        compiled,
        rows_of(compiled, rows),
        _texts(labels),
        _texts(sequence),
        groups=None if groups is None else _texts(groups),
        error_rate=error_rate,
        per=per,
        confidence=confidence,
        max_rows=max_rows,
        strangers=strangers,
        background=None if background is None else rows_of(compiled, background),
        background_sequence=None if background_sequence is None else _texts(background_sequence),
        seed=seed,
        progress=progress,
    )
    raw: dict[str, Any] = json.loads(text)
    return Calibrated(
        calibrated, raw["error"], raw["undecided"], raw["mean_rows"], raw["sequences"], raw.get("groups"), raw
    )


def evaluate_sequences(
    model: Model,
    rows: npt.ArrayLike,
    labels: _Ids,
    *,
    sequence: _Ids,
    groups: _Ids | None = None,
    error_rate: float | None = None,
    max_rows: int | None = None,
) -> Ends:
    """Verdicts of a compiled model on sequences of rows that it was neither trained nor calibrated on; arguments are as for
    `calibrate`. Without an `error_rate` the model stops at its own thresholds."""
    text = _native.evaluate_sequences(
        model,
        rows_of(model, rows),
        _texts(labels),
        _texts(sequence),
        groups=None if groups is None else _texts(groups),
        error_rate=error_rate,
        max_rows=max_rows,
    )
    raw: dict[str, Any] = json.loads(text)
    return Ends(
        raw["error"], raw["undecided"], raw["unknown"], raw["mean_rows"], raw["comparison"]["fixed_rows"], raw
    )


class SequenceRecognizer:
    """An estimator of scikit-learn's kind whose verdicts on sequences of rows keep a promised error rate.

    It takes an estimator that `palpate.compile` takes, fitted or not. `fit` trains it on one half of the sequences, or groups
    (unless it is fitted already), and calibrates on the others; `predict` gives a class for each sequence, or `None` without
    a verdict.
    """

    def __init__(
        self,
        estimator: Any,
        *,
        error_rate: float = 0.01,
        per: str = "average",
        confidence: float = 0.95,
        max_rows: int | None = None,
        strangers: str | None = None,
        train_share: float = 0.5,
        seed: int = 1,
    ) -> None:
        self.estimator = estimator
        self.error_rate = error_rate
        self.per = per
        self.confidence = confidence
        self.max_rows = max_rows
        self.strangers = strangers
        self.train_share = train_share
        self.seed = seed

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The arguments, for `sklearn.base.clone` and searches."""
        names = ("estimator", "error_rate", "per", "confidence", "max_rows", "strangers", "train_share", "seed")
        params = {name: getattr(self, name) for name in names}
        if deep and hasattr(self.estimator, "get_params"):
            params |= {f"estimator__{name}": value for name, value in self.estimator.get_params().items()}
        return params

    def set_params(self, **params: Any) -> SequenceRecognizer:
        """Sets arguments by name; `estimator__depth` is the estimator's `depth`."""
        for name, value in params.items():
            if name.startswith("estimator__"):
                self.estimator.set_params(**{name.removeprefix("estimator__"): value})
            elif name in self.get_params(deep=False):
                setattr(self, name, value)
            else:
                raise InputError(f"a SequenceRecognizer has no {name}. Use {', '.join(self.get_params(deep=False))}.")
        return self

    def fit(self, X: npt.ArrayLike, y: _Ids, *, sequence: _Ids, groups: _Ids | None = None) -> SequenceRecognizer:
        """Trains on some sequences, and calibrates on the others."""
        labels, ids = np.asarray(y), np.asarray(sequence)
        units = ids if groups is None else np.asarray(groups)
        calibrated = np.ones(len(labels), dtype=bool)
        if not hasattr(self.estimator, "classes_"):
            names = np.unique(units)
            np.random.default_rng(self.seed).shuffle(names)
            train = np.isin(units, names[: int(len(names) * self.train_share)])
            self.estimator.fit(take(X, train), labels[train])
            calibrated = ~train
        self.calibrated_ = calibrate(
            self.estimator,
            take(X, calibrated),
            labels[calibrated],
            sequence=ids[calibrated],
            groups=None if groups is None else np.asarray(groups)[calibrated],
            error_rate=self.error_rate,
            per=self.per,
            confidence=self.confidence,
            max_rows=self.max_rows,
            strangers=self.strangers,
            seed=self.seed,
        )
        self.model_ = self.calibrated_.model
        self.classes_ = self.estimator.classes_
        return self

    def verdicts(self, X: npt.ArrayLike, *, sequence: _Ids) -> list[Verdict]:
        """The verdict on each sequence, in their order: its class as text, and the rows that it took."""
        recognizer = Recognizer(self.model_)
        rows, ids = rows_of(self.model_, X), np.asarray(sequence)
        starts = [0, *(np.flatnonzero(ids[1:] != ids[:-1]) + 1).tolist(), len(ids)]
        return [_verdict(recognizer, rows[start:end]) for start, end in zip(starts[:-1], starts[1:])]

    def predict(self, X: npt.ArrayLike, *, sequence: _Ids) -> npt.NDArray[Any]:
        """The class of each sequence, in their order; `None` without a verdict, or for what the model does not know."""
        by_name = {str(value): value for value in np.asarray(self.classes_).tolist()}
        found = [by_name.get(verdict.object or "") for verdict in self.verdicts(X, sequence=sequence)]
        return np.array(found, dtype=object)


def _verdict(recognizer: Recognizer, rows: Iterable[npt.NDArray[np.float64]]) -> Verdict:
    recognizer.reset()
    verdict = recognizer.verdict
    for row in rows:
        verdict = recognizer.push_row(row)
        if verdict.decided:
            break
    return verdict
