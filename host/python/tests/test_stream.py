"""Verdicts on streams of rows."""

from __future__ import annotations

import warnings
from typing import Any

import lightgbm
import numpy as np
import numpy.typing as npt
import palpate
import pandas as pd
import pytest
import xgboost
from sklearn import base, ensemble, tree
from sklearn.exceptions import NotFittedError
from sklearn.frozen import FrozenEstimator
from sklearn.utils.estimator_checks import parametrize_with_checks

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
    # A forest's shares of votes are no log-probabilities: a scale makes evidence of them.
    assert sure.raw["scale"]["kept"] or kind != 2


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


def test_a_second_fit_with_the_same_estimator_trains_a_clone_again_and_calibrates_on_other_rows() -> None:
    X, y, sequence, _ = streams(900, 1)
    own = estimators()[2]
    recognizer = palpate.SequenceRecognizer(own, error_rate=0.1, max_rows=LENGTH)
    first = recognizer.fit(X, y, sequence=sequence)
    models = [first.model_.checksum]
    assert not hasattr(own, "classes_") and hasattr(first.estimator_, "classes_")
    sequences = [first.calibrated_.sequences]
    # Like a cell that is run twice, and a loop over rates.
    again = recognizer.set_params(error_rate=0.1).fit(X, y, sequence=sequence)
    models.append(again.model_.checksum)
    sequences.append(again.calibrated_.sequences)
    assert models[0] == models[1] and sequences[0] == sequences[1] < 450
    # A fitted one is trained again, too, unless it is said that it is fitted.
    fitted = base.clone(own).fit(X, y)
    refitted = palpate.SequenceRecognizer(fitted, error_rate=0.1, max_rows=LENGTH).fit(X, y, sequence=sequence)
    assert refitted.model_.checksum == models[0]


def test_a_fitted_estimator_is_taken_as_it_is_where_that_is_said() -> None:
    X, y, sequence, _ = streams(300, 1)
    fitted = estimators()[2].fit(X, y)
    X, y, sequence, _ = streams(300, 2)
    prefit = palpate.SequenceRecognizer(fitted, error_rate=0.2, prefit=True).fit(X, y, sequence=sequence)
    frozen = palpate.SequenceRecognizer(FrozenEstimator(fitted), error_rate=0.2).fit(X, y, sequence=sequence)
    assert prefit.estimator_ is fitted and frozen.estimator_ is fitted
    assert prefit.model_.checksum == frozen.model_.checksum
    assert prefit.calibrated_.sequences + prefit.calibrated_.raw["learned"] == 300
    with pytest.raises(palpate.InputError, match="the RandomForestClassifier is not fitted"):
        palpate.SequenceRecognizer(estimators()[2], prefit=True).fit(X, y, sequence=sequence)


def test_rows_and_what_they_belong_to_agree_in_every_call() -> None:
    X, y, sequence, persons = streams(300, 1)
    recognizer = palpate.SequenceRecognizer(estimators()[2], error_rate=0.2, max_rows=LENGTH)
    with pytest.raises(palpate.SettingError, match="y is 3599 values. Use 3600, one for each row"):
        recognizer.fit(X, y[1:], sequence=sequence)
    with pytest.raises(palpate.SettingError, match="sequence is 3599 values"):
        recognizer.fit(X, y, sequence=sequence[1:])
    with pytest.raises(palpate.SettingError, match="groups is 3599 values"):
        recognizer.fit(X, y, sequence=sequence, groups=persons[1:])
    with pytest.raises(NotFittedError, match="Call its `fit` first"):
        recognizer.predict(X, sequence=sequence)
    recognizer.fit(X, y, sequence=sequence)
    for call in (recognizer.predict, recognizer.verdicts):
        with pytest.raises(palpate.SettingError, match="sequence is 3599 values"):
            call(X, sequence=sequence[1:])
        with pytest.raises(palpate.SettingError, match="sequence is 3600 values"):
            call(X[1:], sequence=sequence)
    assert len(recognizer.predict(X[:0], sequence=[])) == 0


def test_rows_without_a_sequence_and_sequences_that_come_back_are_refused_in_every_call() -> None:
    X, y, sequence, _ = streams(300, 1)
    recognizer = palpate.SequenceRecognizer(estimators()[2], error_rate=0.2, max_rows=LENGTH).fit(X, y, sequence=sequence)
    texts = [f"s{number}" for number in sequence]
    back = sequence.copy()
    back[-1] = 0
    calls: list[Any] = [
        lambda ids: recognizer.predict(X, sequence=ids),
        lambda ids: recognizer.verdicts(X, sequence=ids),
        lambda ids: palpate.SequenceRecognizer(estimators()[2]).fit(X, y, sequence=ids),
        lambda ids: palpate.calibrate(recognizer.estimator_, X, y, sequence=ids),
        lambda ids: palpate.evaluate_sequences(recognizer.model_, X, y, sequence=ids),
    ]
    for call in calls:
        for missing in (None, float("nan"), "", pd.NA, pd.NaT):
            for ids in (texts[:5] + [missing] + texts[6:], pd.Series(texts[:5] + [missing] + texts[6:], dtype=object)):
                with pytest.raises(palpate.InputError, match="row 6: the sequence is missing"):
                    call(ids)
        with pytest.raises(palpate.InputError, match="row 6: the sequence is missing"):
            call(np.where(np.arange(len(sequence)) == 5, np.nan, sequence))
        with pytest.raises(palpate.InputError, match='row 3600: the sequence "0" comes back'):
            call(back)
    with pytest.raises(palpate.InputError, match="row 2: the group is missing"):
        palpate.calibrate(recognizer.estimator_, X, y, sequence=sequence, groups=[1, None, *sequence[2:]])


def test_copies_of_sequences_under_other_ids_are_noted() -> None:
    X, y, sequence, _ = streams(300, 1)
    fitted = estimators()[2].fit(X, y)
    X, y, sequence, _ = streams(100, 2)
    four = [np.concatenate([part] * 4) for part in (X, y)]
    ids = np.concatenate([sequence + 1000 * copy for copy in range(4)])
    with pytest.warns(UserWarning, match="300 of 400 sequences are copies, value by value, of others"):
        noted = palpate.calibrate(fitted, *four, sequence=ids, error_rate=0.2)
    assert noted.raw["note"].startswith("300 of 400 sequences")
    # Within a group that is what groups are for.
    palpate.calibrate(fitted, *four, sequence=ids, groups=ids % 1000, error_rate=0.2)


def test_a_limit_of_no_rows_is_called_by_its_name() -> None:
    X, y, sequence, _ = streams(300, 1)
    fitted = estimators()[2].fit(X, y)
    with pytest.raises(palpate.SettingError, match="max_rows is 0. Use at least 1"):
        palpate.calibrate(fitted, X, y, sequence=sequence, max_rows=0)
    model = palpate.compile(fitted)
    with pytest.raises(palpate.SettingError, match="max_rows is 0. Use at least 1"):
        palpate.evaluate_sequences(model, X, y, sequence=sequence, max_rows=0)


class PerRow(palpate.SequenceRecognizer):
    """Callable by scikit-learn's checks: these know no sequences, so each row is one of its own. Their labels are random, so
    nothing can be promised, and here the first column says the class."""

    def fit(self, X: Any, y: Any, *, sequence: Any = None, groups: Any = None) -> PerRow:
        if y is not None and np.ndim(X) == 2 and not hasattr(X, "toarray") and np.shape(X)[1] > 0:
            columns = np.asarray(X, dtype=float)[:, 0]
            y = (columns > np.nanmedian(columns)).astype(int)[: len(y)]
        super().fit(X, y, sequence=np.arange(np.shape(X)[0]) if sequence is None else sequence, groups=groups)
        return self

    def predict(self, X: Any, *, sequence: Any = None) -> npt.NDArray[Any]:
        found = super().predict(X, sequence=np.arange(np.shape(X)[0]) if sequence is None else sequence)
        # They compare numbers.
        return np.array([-1 if one is None else one for one in found])


# Rates that the few rows of the checks can promise.
LENIENT: dict[str, Any] = {"error_rate": 0.49, "confidence": 0.5, "train_share": 0.6}


def expected_failures(_: Any) -> dict[str, str]:
    return {"check_fit2d_1sample": "one sequence cannot be divided, and the message counts sequences, not samples"}


with warnings.catch_warnings():
    # It is of scikit-learn's kind, and does not import it.
    warnings.filterwarnings("ignore", message=".*does not inherit from `sklearn.base.BaseEstimator`")
    CHECKS = parametrize_with_checks(
        [PerRow(tree.DecisionTreeClassifier(max_depth=2, random_state=1), **LENIENT)],
        expected_failed_checks=expected_failures,
    )


@CHECKS
def test_scikit_learns_checks_hold(estimator: Any, check: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check(estimator)


def ramps(count: int, seed: int) -> tuple[npt.NDArray[np.float64], Any, Any]:
    """Ramps that rise or fall: a row tells the class only with its number."""
    generator = np.random.default_rng(seed)
    classes = np.arange(count) % 2
    rise = np.arange(1, 11) / 10
    rows = np.where(classes[:, None] == 0, rise, 1.1 - rise) + 0.2 * generator.normal(size=(count, 10))
    return rows.reshape(-1, 1), np.repeat(np.array(["up", "down"])[classes], 10), np.repeat(np.arange(count), 10)


@pytest.mark.parametrize("kind", ["array", "pandas"])
def test_a_row_number_is_added_in_training_and_counted_by_whoever_follows_a_sequence(kind: str) -> None:
    def table(values: npt.NDArray[np.float64]) -> Any:
        return values if kind == "array" else pd.DataFrame(values, columns=["height"])

    X, y, sequence = ramps(800, 1)
    estimator = ensemble.HistGradientBoostingClassifier(max_iter=10, max_depth=3, random_state=1)
    recognizer = palpate.SequenceRecognizer(estimator, error_rate=0.1, position=True)
    recognizer.fit(table(X), y, sequence=sequence)
    assert recognizer.n_features_in_ == 1 and recognizer.estimator_.n_features_in_ == 2
    X, y, sequence = ramps(600, 2)
    found = recognizer.predict(table(X), sequence=sequence)
    named = found != None  # noqa: E711
    ends = palpate.evaluate_sequences(recognizer.model_, table(X), y, sequence=sequence)
    assert named.mean() > 0.8 and np.isclose((found[named] != y[::10][named]).mean(), ends.error) and ends.error < 0.13
    # The same rows in one sequence each have the number 1.
    assert ends.error < palpate.evaluate_sequences(recognizer.model_, table(X), y, sequence=np.arange(len(X))).error
    with pytest.raises(palpate.InputError, match="2"):
        palpate.evaluate_sequences(recognizer.model_, np.column_stack([X, X]), y, sequence=sequence)
    if kind == "pandas":
        with pytest.raises(palpate.InputError, match="has a column 'position'"):
            recognizer.fit(table(X).assign(position=1), y, sequence=sequence)


def test_a_guard_names_the_feature_of_a_dead_sensor_and_its_row_adds_nothing() -> None:
    X, y, sequence, _ = streams(900, 1)
    recognizer = palpate.SequenceRecognizer(estimators()[2], error_rate=0.1, guard=True).fit(X, y, sequence=sequence)
    assert recognizer.calibrated_.raw["guard"]["refused"] <= 0.001 * recognizer.calibrated_.raw["guard"]["rows"] + 1
    dead = palpate.Recognizer(recognizer.model_)
    for row, why in [([np.nan, 0.0], "f0: a feature is missing"), ([0.5, 99.0], "f1: a feature is outside")]:
        verdict = dead.push_row(np.array(row))
        assert verdict.refused is not None and verdict.refused.startswith(why) and dead.touches == 0
    answers = [dead.push_row(np.array([0.5, 0.1 * number])).refused for number in range(5)]
    assert answers[-1] is not None and answers[-1].startswith("f0: a feature stayed the same"), answers
    broken = X.copy()
    broken[np.arange(len(X)) % LENGTH > 0] = np.nan
    ends = palpate.evaluate_sequences(recognizer.model_, broken, y, sequence=sequence)
    assert ends.raw["refused"] == 900 * (LENGTH - 1)


def test_a_sequence_of_two_labels_or_groups_is_named_by_its_row_wherever_it_falls() -> None:
    X, y, sequence, _ = streams(60, 1)
    groups = sequence // 2
    for number in range(60):
        row = number * LENGTH + 5
        labels, owners = y.copy(), groups.copy()
        labels[row], owners[row] = "cup" if y[row] != "cup" else "jug", 99
        recognizer = palpate.SequenceRecognizer(estimators()[2], error_rate=0.3)
        with pytest.raises(palpate.InputError, match=f'row {row + 1}: the sequence "{number}" has the labels'):
            recognizer.fit(X, labels, sequence=sequence)
        with pytest.raises(palpate.InputError, match=f'row {row + 1}: the sequence "{number}" belongs to the groups'):
            recognizer.fit(X, y, sequence=sequence, groups=owners)


@pytest.mark.parametrize("given", [{"strangers": "likely"}, {"per": "name"}, {"confidence": 0.9}])
def test_an_estimate_refuses_what_only_a_promise_has(given: dict[str, Any]) -> None:
    X, y, sequence, _ = streams(60, 1)
    with pytest.raises(palpate.SettingError, match=next(iter(given))):
        palpate.SequenceRecognizer(estimators()[2], promise=False, **given).fit(X, y, sequence=sequence)


def test_a_position_that_is_no_feature_or_no_class_is_an_error() -> None:
    X, y, _ = ramps(100, 1)
    own = ensemble.HistGradientBoostingClassifier(max_iter=3).fit(np.column_stack([X, X]), y)
    with pytest.raises(palpate.SettingError, match="row_number is row"):
        palpate.compile(own, row_number="row")
    value = ensemble.HistGradientBoostingRegressor(max_iter=3).fit(np.column_stack([X, X]), np.arange(len(X)))
    with pytest.raises(palpate.SettingError, match="row_number is f1"):
        palpate.compile(value, row_number="f1")


def test_folds_leave_all_other_sequences_to_the_test_and_estimate_where_nothing_can_be_promised() -> None:
    X, y, sequence, _ = streams(160, 1)
    own = palpate.SequenceRecognizer(estimators()[2], error_rate=0.2, max_rows=LENGTH, guard=True)
    plain = own.fit(X, y, sequence=sequence).calibrated_
    folded = own.set_params(folds=4).fit(X, y, sequence=sequence).calibrated_
    assert plain.sequences + plain.raw["learned"] == folded.sequences == folded.raw["learned"] == 80
    again = base.clone(own).fit(X, y, sequence=sequence)
    assert again.model_.checksum == own.model_.checksum
    estimated = own.set_params(promise=False, error_rate=0.1).fit(X, y, sequence=sequence)
    assert estimated.estimated_.sequences == 160 and not hasattr(estimated, "calibrated_")
    X, y, sequence, _ = streams(1500, 2)
    ends = palpate.evaluate_sequences(estimated.model_, X, y, sequence=sequence)
    assert "promise" not in ends.raw and abs(ends.error - estimated.estimated_.error) < 0.08, (ends, estimated.estimated_)
    with pytest.raises(palpate.SettingError, match="folds is 1"):
        palpate.SequenceRecognizer(estimators()[2], folds=1).fit(X, y, sequence=sequence)


def test_a_class_with_few_sequences_is_in_every_fold_or_named() -> None:
    X, y, sequence, _ = streams(160, 1)
    rare = np.isin(sequence, [5, 8])
    few = np.where(rare, "rare", y)
    codes = np.unique(few, return_inverse=True)[1]
    own = palpate.SequenceRecognizer(estimators()[0], error_rate=0.3, folds=5, promise=False)
    for seed in range(5):
        assert own.set_params(seed=seed).fit(X, codes, sequence=sequence).estimated_.sequences == 160
    alone = np.where(sequence == 5, "rare", y)
    with pytest.raises(palpate.InputError, match="a fold has all sequences of a class"):
        palpate.SequenceRecognizer(estimators()[2], folds=5, promise=False).fit(X, alone, sequence=sequence)
    errors = []
    for seed in range(8):
        try:
            palpate.SequenceRecognizer(estimators()[2], error_rate=0.3, seed=seed).fit(X, alone, sequence=sequence)
        except palpate.InputError as error:
            errors.append(str(error))
    assert any(error.startswith("no sequence of rare is among those to train on") for error in errors), errors
