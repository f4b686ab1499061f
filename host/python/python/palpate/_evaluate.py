"""Accuracy of a model, and its agreement with its ensemble."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from . import _native
from ._native import DataSet, Ensemble, Model
from ._types import Progress


@dataclass(frozen=True)
class Sequential:
    """Figures of a recognizer that stops by itself, each object weighted by its prior."""

    error_rate: float
    """The error rate that was requested."""
    mean: float
    """Touches (or approaches) used on average."""
    mean_standard_error: float
    error: float
    """Share of sequences with a wrong verdict."""
    error_standard_error: float
    undecided: float
    """Share of sequences without a verdict."""
    per_object: dict[str, float] = field(repr=False)
    """Touches (or approaches) used on average, for each object."""


@dataclass(frozen=True)
class Evaluation:
    """Accuracy of a model, and touches to a verdict. Shares are between 0 and 1."""

    descriptor: str
    touches: int
    """Test touches that are evidence to the model."""
    groups: int
    """Groups drawn for each object."""
    accuracy: dict[int, float]
    """Accuracy after a number of touches."""
    accuracy_standard_error: dict[int, float] = field(repr=False)
    per_object: dict[str, dict[int, float]] = field(repr=False)
    """Accuracy of each object after a number of touches."""
    sequential: Sequential
    """Figures when it stops by itself."""
    approach_accuracy: dict[int, float] = field(repr=False)
    """Accuracy after a number of approaches, where the data set holds those."""
    approach_sequential: Sequential | None = field(repr=False)
    """Figures when it stops by itself, counted in approaches."""
    patterns: dict[str, float] = field(repr=False)
    """Share of each contact pattern among the touches."""
    raw: dict[str, object] = field(repr=False)
    """All figures, as `palpate evaluate --json` prints them."""


@dataclass(frozen=True)
class Parity:
    """Agreement of a compiled model with its ensemble."""

    touches: int
    """The number of touches compared."""
    max_margin_error: float
    """The largest difference of a margin, in nats."""
    stated_bound: float
    """The largest difference that the model states."""
    best_differs: int
    """Touches after which another object is the best."""
    sequences: int
    """The number of random sequences compared."""
    verdict_differs: int
    """Sequences with another verdict."""
    touches_differ: int
    """Sequences with the same verdict after another number of touches."""


def evaluate(
    model: Model | Ensemble,
    data: DataSet,
    *,
    at: Sequence[int] | None = None,
    groups: int = 1000,
    error_rate: float | None = None,
    max_touches: int | None = None,
    noise: str = "",
    timer: str = "",
    seed: int = 1,
) -> Evaluation:
    """Measures the accuracy of a model on touches that it was not trained on.

    Accuracies are given after the numbers of touches (and approaches) in `at`, over `groups` groups drawn for each object.
    The recognizer stops at a posterior of 1 - `error_rate`, or where the model says. `noise` and `timer` are added to the
    touches.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=500)
    >>> ensemble = palpate.train(data, rounds=10)
    >>> unseen = palpate.capture(["bowl", "mouse"], touches=200, seed=2)
    >>> evaluation = palpate.evaluate(palpate.compile(ensemble), unseen, at=[5, 10], groups=200)
    >>> 0.5 < evaluation.accuracy[5] <= evaluation.accuracy[10] <= 1.0
    True
    """
    text = _native.evaluate(
        model,
        data,
        at=None if at is None else list(at),
        groups=groups,
        error_rate=error_rate,
        max_touches=max_touches,
        noise=noise,
        timer=timer,
        seed=seed,
    )
    found: dict[str, Any] = json.loads(text)
    approaches: dict[str, Any] = found.get("approaches") or {}
    return Evaluation(
        descriptor=found["descriptor"],
        touches=found["touches"],
        groups=found["groups"],
        accuracy=_numbered(found["accuracy"]),
        accuracy_standard_error=_numbered(found["accuracy_standard_error"]),
        per_object={name: _numbered(values) for name, values in found["per_object"].items()},
        sequential=_sequential(found["sequential"], "touches"),
        approach_accuracy=_numbered(approaches.get("accuracy", {})),
        approach_sequential=_sequential(approaches["sequential"], "approaches") if approaches else None,
        patterns=found["patterns"],
        raw=found,
    )


def parity(
    ensemble: Ensemble,
    model: Model,
    data: DataSet,
    *,
    sequences: int = 10_000,
    seed: int = 1,
    progress: Progress | None = None,
) -> Parity:
    """Compares a compiled model with its ensemble, on every touch of a data set and on random sequences of touches.

    >>> import palpate
    >>> data = palpate.capture(["bowl", "mouse"], touches=500)
    >>> ensemble = palpate.train(data, rounds=10)
    >>> palpate.parity(ensemble, palpate.compile(ensemble), data, sequences=100).verdict_differs
    0
    """
    found: dict[str, Any] = json.loads(
        _native.parity(ensemble, model, data, sequences=sequences, seed=seed, progress=progress)
    )
    return Parity(**found)


def _numbered(values: dict[str, float]) -> dict[int, float]:
    return {int(number): value for number, value in values.items()}


def _sequential(found: dict[str, Any], unit: str) -> Sequential:
    return Sequential(
        error_rate=found["error_rate"],
        mean=found[f"mean_{unit}"],
        mean_standard_error=found[f"mean_{unit}_standard_error"],
        error=found["error"],
        error_standard_error=found["error_standard_error"],
        undecided=found["undecided"],
        per_object=found["per_object"],
    )
