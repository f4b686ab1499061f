"""Verdicts on streams of rows: as early as a promised error rate allows, of any model over rows of features."""

from __future__ import annotations

import copy
import importlib
import importlib.util
import json
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import InputError, ModelWarning, SettingError
from ._estimator import Estimator
from ._import import compile, to_ensemble
from ._native import Model, Recognizer
from ._rows import names_of, numbered, rows_of, take
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
    raw: dict[str, Any] = field(repr=False)
    """All figures, as `palpate rows calibrate --json` prints them."""


@dataclass(frozen=True)
class Estimated:
    """A model whose error rate is estimated, and not promised. Shares are between 0 and 1."""

    model: Model
    """The model with its threshold."""
    error: float
    """Cross-fitted share of the names given that were wrong: each fold under what the others gave."""
    undecided: float
    """Share of the sequences that ended without a name."""
    mean_rows: float
    """Rows used on average."""
    sequences: int
    """Sequences that the estimate is of."""
    raw: dict[str, Any] = field(repr=False)
    """All figures."""


@dataclass(frozen=True)
class Ends:
    """Verdicts on sequences of rows. Shares are between 0 and 1."""

    error: float
    """Share of wrong ones among the names given."""
    undecided: float
    """Share of all sequences without a verdict."""
    unknown: float
    """Share of all sequences that were called unknown."""
    mean_rows: float
    """Rows used on average."""
    fixed_rows: float | None
    """The least fixed number of rows with which no more names are wrong; `None` if all rows are not enough."""
    raw: dict[str, Any] = field(repr=False)
    """All figures, as `palpate rows evaluate --json` prints them."""


def _texts(values: _Ids) -> list[str]:
    return [str(value) for value in np.asarray(values).tolist()]


def _flat(values: Any, what: str) -> npt.NDArray[Any]:
    """One value for each row; of tuples their texts."""
    flat = np.asarray(values)
    if flat.ndim == 2 and flat.shape[1] == 1:
        return flat[:, 0]
    if flat.ndim == 2 and isinstance(values, (list, tuple)):
        return np.array([str(value) for value in values])
    if flat.ndim != 1:
        raise InputError(f"the {what} is given in the shape {flat.shape}. Give one column, with one {what} for each row.")
    return flat


def _ids(values: _Ids, what: str, of: str = "row") -> list[str]:
    """The name of what each row belongs to."""
    flat = _flat(values, what)
    # A list as it is: NumPy would make text of a missing value among texts.
    given = list(values) if isinstance(values, (list, tuple)) else flat.tolist()
    for number, value in enumerate([] if flat.dtype.kind in "biu" else given):
        if _is_missing(value):
            raise InputError(f"{of} {number + 1}: the {what} is missing ({value!r}). Give each {of} its {what}.")
    return _texts(flat)


def _is_missing(value: object) -> bool:
    try:
        return value is None or str(value) == "" or bool(value != value)
    except (TypeError, ValueError):  # pandas.NA is not equal, and not unequal, to itself.
        return True


def _agree(rows: int, of: str = "row", /, **columns: int | None) -> None:
    """Refuses columns of another length than the rows'."""
    for name, length in columns.items():
        if length is not None and length != rows:
            raise SettingError(f"{name} is {length} values. Use {rows}, one for each {of}.")


def _stretches(sequence: list[str]) -> list[slice]:
    """The rows of each sequence."""
    starts = [at for at in range(len(sequence)) if at == 0 or sequence[at] != sequence[at - 1]]
    seen: set[str] = set()
    for at in starts:
        if sequence[at] in seen:
            raise InputError(
                f'row {at + 1}: the sequence "{sequence[at]}" comes back after another. Sort the rows by sequence, each in its '
                "order, or give each stretch of rows an id of its own."
            )
        seen.add(sequence[at])
    return [slice(start, end) for start, end in zip(starts, [*starts[1:], len(sequence)])]


_ONE = "A sequence is of one class and one group: give the rows of another one another id."


def _of_one(stretches: list[slice], ids: npt.NDArray[Any], owners: npt.NDArray[Any], what: str) -> None:
    """Refuses a sequence whose rows do not all have the same label or group."""
    for rows in stretches:
        first, own = owners[rows.start], owners[rows]
        if len(others := np.flatnonzero(own != first)):
            row = rows.start + int(others[0])
            raise InputError(f'row {row + 1}: the sequence "{ids[row]}" {what} "{first}" and "{owners[row]}". {_ONE}')


def _joined(X: Any) -> tuple[Any, npt.NDArray[np.int64]]:
    """The rows of a list with an array or a table for each sequence, and the number of each row's sequence."""
    hint = "Without `sequence`, X is a list with an array of rows and columns, or a table, for each sequence."
    if names_of(X) is not None:
        raise InputError(f"X is one table, and `sequence` is not given. {hint}")
    parts = list(X)
    for number, part in enumerate(parts):
        if np.ndim(part) != 2 or len(part) == 0:
            raise InputError(f"X[{number}] has no rows and columns. {hint}")
        if (names_of(part), np.shape(part)[1]) != (names_of(parts[0]), np.shape(parts[0])[1]):
            raise InputError(f"X[{number}] has other columns than X[0]. Give all sequences the same ones, in the same order.")
    numbers = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    if not parts or names_of(parts[0]) is None:
        return np.concatenate([np.asarray(part) for part in parts]) if parts else np.empty((0, 0)), numbers
    library = importlib.import_module(type(parts[0]).__module__.partition(".")[0])
    return (library.concat_tables if hasattr(library, "concat_tables") else library.concat)(parts), numbers


def _spread(name: str, values: Any, what: str, numbers: npt.NDArray[np.int64]) -> npt.NDArray[Any] | None:
    """What is given for each sequence, for each of its rows."""
    if values is None:
        return None
    flat = _flat(values, what)
    _agree(int(numbers.max(initial=-1)) + 1, "sequence", **{name: len(flat)})
    _ids(values, what, "sequence")
    return flat[numbers]


@dataclass(frozen=True)
class _Sequences:
    """Rows of sequences, and what is given for each row."""

    table: Any
    labels: npt.NDArray[Any]
    ids: npt.NDArray[Any]
    stretches: list[slice]
    owners: npt.NDArray[Any] | None
    weights: npt.NDArray[Any] | None

    @classmethod
    def of(cls, X: Any, y: Any, sequence: _Ids | None, groups: _Ids | None, sample_weight: Any) -> _Sequences:
        """Checks rows, or a list of sequences, and what is given for each."""
        if y is None:
            raise InputError("a SequenceRecognizer requires y to be passed, but the target y is None. Give a class for each row.")
        if sequence is None:
            X, sequence = _joined(X)
            y, groups = _spread("y", y, "label", sequence), _spread("groups", groups, "group", sequence)
            sample_weight = _spread("sample_weight", sample_weight, "weight", sequence)
        table, labels, ids = _table(X), _flat(y, "label"), _flat(sequence, "sequence")
        owners = None if groups is None else _flat(groups, "group")
        weights = None if sample_weight is None else _flat(sample_weight, "weight").astype(np.float64)
        columns = {"y": labels, "sequence": ids, "groups": owners, "sample_weight": weights}
        _agree(len(table), **{name: None if column is None else len(column) for name, column in columns.items()})
        stretches = _stretches(_ids(sequence, "sequence"))
        _ids(y, "label")
        _of_one(stretches, ids, labels, "has the labels")
        if groups is not None and owners is not None:
            _ids(groups, "group")
            _of_one(stretches, ids, owners, "belongs to the groups")
        return cls(table, labels, ids, stretches, owners, weights)


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
    guard: bool = False,
    seed: int = 1,
    progress: Progress | None = None,
    _folds: list[Any] | None = None,
) -> Calibrated:
    """Sets a model's thresholds so that it keeps a promised error rate: verdicts of rows as early as that allows.

    `model` is a compiled model over rows, or what `palpate.compile` takes. Rows with the same value of `sequence` follow each
    other, and are of one class. Without `groups` sequences must be independent of each other; with them, such as a person for
    each row, the promise is for new groups. The rows must be others than those of the training. `per` is what the rate is
    promised of: "average", "name" or "object". With `strangers` ("likely") the model also tests whether rows fit
    any class; rows of others can be given as a `background`, with their own sequences. With `guard` the model refuses rows of a
    sensor that is dead, stuck or out of its range, which then add nothing. `seed` says which sequences are learned
    from: calibrate once. Of several seeds, rates or models tried on the same sequences, the one that looks best keeps its promise
    less often than stated.

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
    # A recognizer's features are those that someone measures, without a row's number.
    owner = Recognizer(compiled)
    calibrated, text = _native.calibrate(
        compiled,
        rows_of(owner, rows),
        _ids(labels, "label"),
        _ids(sequence, "sequence"),
        groups=None if groups is None else _ids(groups, "group"),
        error_rate=error_rate,
        per=per,
        confidence=confidence,
        max_rows=max_rows,
        strangers=strangers,
        background=None if background is None else rows_of(owner, background),
        background_sequence=None if background_sequence is None else _ids(background_sequence, "sequence"),
        guard=guard,
        learned=_folds,
        seed=seed,
        progress=progress,
    )
    raw: dict[str, Any] = json.loads(text)
    if note := raw.get("note"):
        warnings.warn(note, stacklevel=2)
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
        rows_of(Recognizer(model), rows),
        _ids(labels, "label"),
        _ids(sequence, "sequence"),
        groups=None if groups is None else _ids(groups, "group"),
        error_rate=error_rate,
        max_rows=max_rows,
    )
    raw: dict[str, Any] = json.loads(text)
    return Ends(
        raw["error"], raw["undecided"], raw["unknown"], raw["mean_rows"], raw["comparison"]["fixed_rows"], raw
    )


class SequenceRecognizer(Estimator):
    """An estimator of scikit-learn's kind whose verdicts on sequences of rows keep a promised error rate.

    It takes a classifier that `palpate.compile` takes. `fit` trains a clone of it, `estimator_`, on a share of the sequences, or
    groups, and calibrates on the others; `predict` gives a class for each sequence. A classifier that is fitted already is taken
    as it is with `prefit`, or in scikit-learn's `FrozenEstimator`; all sequences are calibrated on then, and must be others than
    those that it was trained on.

    `X` is a list with an array or a table for each sequence; labels, groups and weights are then one for each sequence, so that
    scikit-learn's splitters, scorers and searches work as they are. Or `X` is one table, with the `sequence` of each row: labels,
    groups and weights are one for each row, and scikit-learn's metadata routing hands `sequence` on (`set_fit_request`,
    `set_score_request`).

    With `position` the classifier also gets the row's number in its sequence, counted from 1, as the last column (`"position"` of a
    table), which whoever follows a sequence counts, also on a chip. `guard` is as for `calibrate`.

    With `folds`, at least 2, what calibration learns (the shape of evidence, where it begins, the guard) comes from that many folds of
    the training, each with the margins of a classifier that was trained on the others: so all other sequences are tested on. With
    `promise=False` besides, all sequences are trained on, `estimated_` has a cross-fitted estimate of the error rate, and the model
    promises nothing: losses of folds depend on each other, and the classifier itself was tested on nothing.
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
        position: bool = False,
        guard: bool = False,
        folds: int | None = None,
        promise: bool = True,
        train_share: float = 0.5,
        prefit: bool = False,
        seed: int = 1,
    ) -> None:
        self.estimator = estimator
        self.error_rate = error_rate
        self.per = per
        self.confidence = confidence
        self.max_rows = max_rows
        self.strangers = strangers
        self.position = position
        self.guard = guard
        self.folds = folds
        self.promise = promise
        self.train_share = train_share
        self.prefit = prefit
        self.seed = seed

    def fit(
        self, X: Any, y: _Ids, *, sequence: _Ids | None = None, groups: _Ids | None = None, sample_weight: Any = None
    ) -> SequenceRecognizer:
        """Trains on some sequences, and calibrates on the others. `sample_weight` is for the training of the classifier alone: a
        promise counts all sequences alike."""
        given = _Sequences.of(X, y, sequence, groups, sample_weight)
        table, labels, ids, owners = given.table, given.labels, given.ids, given.owners
        known = numbered(table, _numbers(_texts(ids))) if self.position else table
        units = ids if owners is None else owners
        fitted, calibrated, folds = self._fitted(), np.ones(len(table), dtype=bool), None
        if fitted is not None and (self.folds is not None or not self.promise or given.weights is not None):
            name = "folds" if given.weights is None else "sample_weight"
            raise SettingError(f"{name} is given with a classifier that is fitted. Give one that the sequences can train.")
        if not self.promise:
            for name, default in (("strangers", None), ("per", "average"), ("confidence", 0.95)):
                if (stated := getattr(self, name)) != default:
                    raise SettingError(f"{name} is {stated}, but an estimate has none. Leave it out, or promise=False.")
        if fitted is None:
            train = self._train(units) if self.promise else calibrated
            if len(missing := np.setdiff1d(labels, labels[train])):
                raise InputError(
                    f"no sequence of {', '.join(_texts(missing))} is among those to train on. Record more of each class, or use a larger train_share."
                )
            fitted = self._trained(known, given, train)
            folds = self._folded(known, given, train)
            calibrated = ~train
        self.estimator_ = fitted
        model = self._compiled(fitted, table)
        for name in ("calibrated_", "estimated_"):
            vars(self).pop(name, None)
        if self.promise:
            self.calibrated_ = calibrate(
                model,
                take(table, calibrated),
                labels[calibrated],
                sequence=ids[calibrated],
                groups=None if owners is None else owners[calibrated],
                error_rate=self.error_rate,
                per=self.per,
                confidence=self.confidence,
                max_rows=self.max_rows,
                strangers=self.strangers,
                guard=self.guard,
                seed=self.seed,
                _folds=folds,
            )
            self.model_ = self.calibrated_.model
        else:
            found, text = _native.estimate_sequences(
                model, folds or [], error_rate=self.error_rate, max_rows=self.max_rows, guard=self.guard
            )
            raw: dict[str, Any] = json.loads(text)
            shares = raw["error"], raw["undecided"], raw["mean_rows"], raw["sequences"]
            self.estimated_ = Estimated(found, *shares, raw)
            if self.estimated_.error > self.error_rate:
                warnings.warn(
                    f"The estimated error rate, {self.estimated_.error:.3g}, is above the {self.error_rate:g} asked for. Record more "
                    "sequences, train a better classifier, or ask for a higher rate.",
                    ModelWarning,
                    stacklevel=2,
                )
            self.model_ = found
        self.classes_ = fitted.classes_
        for name in ("n_features_in_", "feature_names_in_"):
            if hasattr(fitted, name):
                setattr(self, name, getattr(fitted, name))
        if self.position:
            self.n_features_in_ = table.shape[1]
            if hasattr(fitted, "feature_names_in_"):
                self.feature_names_in_ = fitted.feature_names_in_[:-1]
        return self

    def _compiled(self, fitted: Any, table: Any) -> Model:
        """The model of a fitted classifier."""
        if not self.position:
            return compile(fitted, max_touches=self.max_rows or 200)
        ensemble = to_ensemble(fitted)
        if len(ensemble.features) != table.shape[1] + 1:
            raise InputError(
                f"the trees take {len(ensemble.features)} features, and X has {table.shape[1]}, to which position=True adds one. Train on "
                "all of them, at most 256."
            )
        return compile(ensemble, max_touches=self.max_rows or 200, row_number=ensemble.features[-1])

    def _trained(self, known: Any, given: _Sequences, rows: npt.NDArray[np.bool_]) -> Any:
        """A clone of the classifier, trained on some rows."""
        weighted = {} if given.weights is None else {"sample_weight": given.weights[rows]}
        return _clone(self.estimator).fit(take(known, rows), given.labels[rows], **weighted)

    def _folded(self, known: Any, given: _Sequences, train: npt.NDArray[np.bool_]) -> list[Any] | None:
        """Folds of the training, whole sequences or groups, each with the model of the others."""
        if self.folds is None and self.promise:
            return None
        table, labels, ids, owners = given.table, given.labels, given.ids, given.owners
        units = ids if owners is None else owners
        names, first = np.unique(units[train], return_index=True)
        count = 5 if self.folds is None else self.folds
        if not 2 <= count <= len(names):
            raise SettingError(f"folds is {count}. Use at least 2, and at most as many as sequences or groups are trained on: {len(names)}.")
        # Dealt class by class, so that no fold takes all sequences of a class that has several.
        order = np.random.default_rng(self.seed).permutation(len(names))
        classes = np.unique(labels[train][first], return_inverse=True)[1]
        names = names[order[np.argsort(classes[order], kind="stable")]]
        folds = []
        for start in range(count):
            own = train & np.isin(units, names[start::count])
            others = train & ~own
            if len(np.setdiff1d(labels[train], labels[others])):
                raise InputError("a fold has all sequences of a class. Record more of each class, or use fewer folds.")
            model = self._compiled(self._trained(known, given, others), table)
            rows = rows_of(Recognizer(model), take(table, own))
            groups = None if owners is None else _texts(owners[own])
            folds.append((model, rows, _texts(labels[own]), _texts(ids[own]), groups))
        return folds

    def _fitted(self) -> Any:
        """The classifier that is fitted already, if one is given."""
        kind = type(self.estimator)
        is_frozen = kind.__name__ == "FrozenEstimator" and kind.__module__.startswith("sklearn.")
        if not (self.prefit or is_frozen):
            return None
        fitted = self.estimator.estimator if is_frozen else self.estimator
        if not hasattr(fitted, "classes_"):
            raise InputError(f"the {type(fitted).__name__} is not fitted. Call its `fit` first, or leave `prefit` out.")
        return fitted

    def _train(self, units: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """The rows to train on: of whole sequences, or groups."""
        if not 0 < self.train_share < 1:
            raise SettingError(f"train_share is {self.train_share}. Use a share above 0 and below 1.")
        names = np.unique(units)
        count = int(len(names) * self.train_share)
        if count == 0:
            raise InputError(f"too few sequences or groups to train on some and calibrate on others: {len(names)}. Record more.")
        np.random.default_rng(self.seed).shuffle(names)
        return np.isin(units, names[:count])

    def verdicts(self, X: Any, *, sequence: _Ids | None = None) -> list[Verdict]:
        """The verdict on each sequence, in their order: its class as text, and the rows that it took."""
        if not hasattr(self, "model_"):
            raise _not_fitted(self)
        if sequence is None:
            X, sequence = _joined(X)
        table, ids = _table(X), _ids(sequence, "sequence")
        found, wanted = table.shape[1], getattr(self, "n_features_in_", None)
        # The columns of a table are found by their names.
        if len(ids) and wanted is not None and found != wanted and names_of(table) is None:
            kind = type(self).__name__
            raise InputError(f"X has {found} features, but {kind} is expecting {wanted} features as input. Give those of the fit.")
        recognizer = Recognizer(self.model_)
        # The features that someone measures, without a row's number.
        rows = rows_of(recognizer, table)
        _agree(len(rows), sequence=len(ids))
        return [_verdict(recognizer, rows[stretch]) for stretch in _stretches(ids)]

    def predict(self, X: Any, *, sequence: _Ids | None = None) -> npt.NDArray[Any]:
        """The class of each sequence, in their order. Without a verdict, or for what the model does not know, it is `None`; of a list
        of sequences `undecided_`, so that all are of one type, as scikit-learn's metrics need."""
        verdicts = self.verdicts(X, sequence=sequence)
        by_name = {str(value): value for value in np.asarray(self.classes_).tolist()}
        if sequence is not None:
            return np.array([by_name.get(verdict.object or "") for verdict in verdicts], dtype=object)
        found = [by_name.get(verdict.object or "", self.undecided_) for verdict in verdicts]
        # With all classes, the type does not depend on those that were found.
        return np.array([*found, *by_name.values()])[: len(found)]

    @property
    def undecided_(self) -> Any:
        """The label of a sequence without a verdict in a list: "" among texts; among numbers -1, or 1 less than the least class."""
        classes = np.asarray(self.classes_)
        if classes.dtype.kind in "biuf":
            return min(0, classes.min().item()) - 1
        return "" if all(isinstance(value, str) for value in classes.tolist()) else None

    def score(self, X: Any, y: _Ids, *, sequence: _Ids | None = None, sample_weight: Any = None) -> float:
        """The share of the sequences that are named rightly; one without a verdict counts as wrong. The weight of a sequence is the
        mean of its rows'."""
        given = _Sequences.of(X, y, sequence, None, sample_weight)
        found = self.predict(X, sequence=sequence)
        weights = given.weights if given.weights is None else [given.weights[stretch].mean() for stretch in given.stretches]
        return float(np.average(found == given.labels[[stretch.start for stretch in given.stretches]], weights=weights))

    def __sklearn_tags__(self) -> Any:
        """Tags that scikit-learn reads from estimators."""
        utils, base = importlib.import_module("sklearn.utils"), importlib.import_module("sklearn.base")
        has_tags = hasattr(self.estimator, "__sklearn_tags__")
        inputs = base.get_tags(self.estimator).input_tags if has_tags else utils.InputTags()
        return utils.Tags(
            estimator_type="classifier",
            target_tags=utils.TargetTags(required=True),
            classifier_tags=utils.ClassifierTags(),
            input_tags=utils.InputTags(allow_nan=inputs.allow_nan),
        )


def _table(X: Any) -> Any:
    """Rows of features, as they are given or as an array."""
    if hasattr(X, "toarray"):
        raise InputError("X is sparse, which is not supported. Give `X.toarray()`.")
    if names_of(X) is not None:
        return X
    table = np.asarray(X)
    if table.ndim != 2:
        raise InputError(f"X has {table.ndim} dimensions, not 2. Reshape your data: a line for each row, a column for each feature.")
    return table


def _clone(estimator: Any) -> Any:
    """An estimator of the same parameters, which is not fitted."""
    if importlib.util.find_spec("sklearn") is None:
        return copy.deepcopy(estimator)
    return importlib.import_module("sklearn.base").clone(estimator)


def _numbers(sequence: list[str]) -> npt.NDArray[np.float64]:
    """The number of each row in its sequence, from 1."""
    lengths = [stretch.stop - stretch.start for stretch in _stretches(sequence)]
    return np.concatenate([np.arange(1.0, length + 1) for length in lengths])


def _not_fitted(estimator: object) -> Exception:
    text = f"the {type(estimator).__name__} is not fitted. Call its `fit` first."
    if importlib.util.find_spec("sklearn") is None:
        return InputError(text)
    error: Exception = importlib.import_module("sklearn.exceptions").NotFittedError(text)
    return error


def _verdict(recognizer: Recognizer, rows: Iterable[npt.NDArray[np.float64]]) -> Verdict:
    recognizer.reset()
    verdict = recognizer.verdict
    for row in rows:
        verdict = recognizer.push_row(row)
        if verdict.decided:
            break
    return verdict
