"""Verdicts on streams of rows."""

from __future__ import annotations

from typing import Any

import lightgbm
import numpy as np
import numpy.typing as npt
import palpate
import pytest
import xgboost
from sklearn import base, ensemble

LENGTH = 12


def streams(count: int, seed: int, persons: int | None = None) -> tuple[npt.NDArray[np.float32], Any, Any, Any]:
    """Rows, classes, sequences, and persons of sequences of three classes."""
    generator = np.random.default_rng(seed)
    classes = np.arange(count) % 3
    owners = np.arange(count) // 3 if persons is None else np.arange(count) % persons
    offsets = 0.2 * generator.normal(size=owners.max() + 1)
    rows = classes[:, None] * 0.9 + offsets[owners][:, None] + generator.normal(size=(count, LENGTH))
    features = np.stack([rows, generator.normal(size=rows.shape)], axis=-1).reshape(-1, 2).astype(np.float32)
    names = np.array(["cup", "jug", "pan"])[classes]
    return features, np.repeat(names, LENGTH), np.repeat(np.arange(count), LENGTH), np.repeat(owners, LENGTH)


def estimators() -> list[Any]:
    return [
        xgboost.XGBClassifier(n_estimators=8, max_depth=3, n_jobs=1),
        lightgbm.LGBMClassifier(n_estimators=8, objective="multiclassova", num_leaves=8, verbose=-1, n_jobs=1),
        ensemble.RandomForestClassifier(n_estimators=20, max_depth=4, random_state=1),
    ]


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_a_promise_is_kept_on_fresh_sequences_by_models_of_every_kind(kind: int) -> None:
    estimator = estimators()[kind]
    X, y, sequence, _ = streams(600, 1)
    codes = np.unique(y, return_inverse=True)[1]
    estimator.fit(X, codes if kind == 0 else y)
    names = ["cup", "jug", "pan"] if kind == 0 else None
    model = palpate.compile(estimator, names=names, max_touches=LENGTH)
    X, y, sequence, _ = streams(3000, 2)
    sure = palpate.calibrate(model, X, y, sequence=sequence, error_rate=0.05)
    X, y, sequence, _ = streams(3000, 3)
    ends = palpate.evaluate_sequences(sure.model, X, y, sequence=sequence)
    assert 0.02 < ends.error < 0.06 and ends.mean_rows < LENGTH, ends
    assert ends.raw["promise"]["finding"] != "broken"
    # A forest's shares of votes are no log-probabilities: a table makes evidence of them.
    assert sure.raw["row_evidence"]["kept"] or kind != 2


def test_the_recognizer_gives_the_verdicts_that_the_evaluation_counts() -> None:
    X, y, sequence, _ = streams(2400, 1)
    recognizer = palpate.SequenceRecognizer(estimators()[2], error_rate=0.1, max_rows=LENGTH)
    assert base.clone(recognizer).get_params()["error_rate"] == 0.1
    recognizer.fit(X, y, sequence=sequence)
    X, y, sequence, _ = streams(900, 2)
    found = recognizer.predict(X, sequence=sequence)
    truth = y[::LENGTH]
    named = found != None  # noqa: E711
    ends = palpate.evaluate_sequences(recognizer.model_, X, y, sequence=sequence)
    assert np.isclose((found[named] != truth[named]).mean(), ends.error)
    assert np.isclose(1 - named.mean(), ends.undecided)
    verdicts = recognizer.verdicts(X, sequence=sequence)
    assert np.isclose(np.mean([verdict.touches for verdict in verdicts]), ends.mean_rows)


def test_with_groups_the_promise_is_for_new_ones_and_says_how_many_it_takes() -> None:
    estimator = ensemble.HistGradientBoostingClassifier(max_iter=8, max_depth=3)
    X, y, sequence, _ = streams(600, 1)
    estimator.fit(X, y)
    X, y, sequence, persons = streams(1500, 2)
    sure = palpate.calibrate(estimator, X, y, sequence=sequence, groups=persons, error_rate=0.1)
    assert sure.groups is not None and sure.groups < 500 and sure.raw["promised"] == 0.1
    X, y, sequence, persons = streams(1500, 2, persons=28)
    with pytest.raises(palpate.InputError, match="28 groups of sequences are too few to promise 10 %: at least 29"):
        palpate.calibrate(estimator, X, y, sequence=sequence, groups=persons, error_rate=0.1)


def test_what_is_wrong_with_a_sequence_is_said_with_its_row() -> None:
    estimator = ensemble.HistGradientBoostingClassifier(max_iter=3)
    X, y, sequence, _ = streams(90, 1)
    estimator.fit(X, y)
    wrong = y.copy()
    wrong[5] = "jug"
    with pytest.raises(palpate.InputError, match='row 6: the sequence "0" has the labels "cup" and "jug"'):
        palpate.calibrate(estimator, X, wrong, sequence=sequence)
    back = sequence.copy()
    back[-1] = 0
    with pytest.raises(palpate.InputError, match='row 1080: the sequence "0" comes back'):
        palpate.calibrate(estimator, X, y, sequence=back)
    with pytest.raises(palpate.SettingError, match="sequence is 3 values"):
        palpate.calibrate(estimator, X, y, sequence=sequence[:3])
    value = ensemble.HistGradientBoostingRegressor(max_iter=3).fit(X, np.arange(len(X)))
    with pytest.raises(palpate.InputError, match="predicts a value"):
        palpate.calibrate(value, X, y, sequence=sequence)
