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
from sklearn import base, config_context, ensemble, metrics, model_selection, tree
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


def alone(X: Any) -> npt.NDArray[np.int64]:
    """Each row as a sequence of its own, of an array of any kind."""
    return np.arange(X.shape[0] if hasattr(X, "shape") else len(np.asarray(X)))


class PerRow(palpate.SequenceRecognizer):
    """Callable by scikit-learn's checks: these know no sequences, so each row is one of its own. Their labels are random, so
    nothing can be promised, and here the first column says the class."""

    def fit(self, X: Any, y: Any, *, sequence: Any = None, groups: Any = None, sample_weight: Any = None) -> PerRow:
        if y is not None and not hasattr(X, "toarray") and np.asarray(X).ndim == 2 and np.asarray(X).shape[1] > 0:
            columns = np.asarray(X, dtype=float)[:, 0]
            y = (columns > np.nanmedian(columns)).astype(int)[: len(np.asarray(y))]
        super().fit(X, y, sequence=alone(X) if sequence is None else sequence, groups=groups, sample_weight=sample_weight)
        return self

    def __sklearn_tags__(self) -> Any:
        # They ask for labels of their own.
        tags = super().__sklearn_tags__()
        tags.estimator_type = tags.classifier_tags = None
        return tags

    def predict(self, X: Any, *, sequence: Any = None) -> npt.NDArray[Any]:
        found = super().predict(X, sequence=alone(X) if sequence is None else sequence)
        # They compare numbers.
        return np.array([-1 if one is None else one for one in found])

    def score(self, X: Any, y: Any, *, sequence: Any = None, sample_weight: Any = None) -> float:
        return super().score(X, y, sequence=alone(X) if sequence is None else sequence, sample_weight=sample_weight)


# Rates that the few rows of the checks can promise.
LENIENT: dict[str, Any] = {"error_rate": 0.49, "confidence": 0.5, "train_share": 0.6}


def expected_failures(_: Any) -> dict[str, str]:
    return {
        "check_fit2d_1sample": "one sequence cannot be divided, and the message counts sequences, not samples",
        "check_sample_weight_equivalence_on_dense_data": "a promise counts sequences, whatever their weight",
    }


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


def listed(count: int, seed: int) -> tuple[list[npt.NDArray[np.float32]], Any, Any]:
    """Sequences of 8 to 12 rows, with a class and a group each."""
    X, y, _, groups = streams(count, seed)
    parts = [part[: 8 + number % 5] for number, part in enumerate(X.reshape(count, LENGTH, 2))]
    return parts, y[::LENGTH], groups[::LENGTH]


def lenient(**settings: Any) -> palpate.SequenceRecognizer:
    return palpate.SequenceRecognizer(estimators()[2], **({"error_rate": 0.2, "max_rows": LENGTH} | settings))


# An undecided sequence has the label `undecided_`.
@pytest.mark.filterwarnings("ignore:y_pred contains classes not in y_true")
@pytest.mark.parametrize("kind", ["texts", "numbers", "objects"])
def test_a_list_of_sequences_is_taken_by_splitters_scorers_and_searches_as_it_is(kind: str) -> None:
    X, y, groups = listed(450, 1)
    codes = np.unique(y, return_inverse=True)[1]
    y = {"texts": y, "numbers": codes * 5, "objects": y.astype(object)}[kind]
    shuffled: Any = model_selection.KFold(3, shuffle=True, random_state=1)
    for scoring in (None, "accuracy", "balanced_accuracy", "matthews_corrcoef"):
        scores = model_selection.cross_val_score(lenient(), X, y, cv=shuffled, scoring=scoring, error_score="raise")
        assert scores.min() > 0.4, (scoring, scores)
    by_score, by_name = (
        model_selection.cross_val_score(lenient(), X, y, scoring=scoring, error_score="raise") for scoring in (None, "accuracy")
    )
    np.testing.assert_array_equal(by_score, by_name)
    tried = {"estimator__max_depth": [3, 4], "error_rate": [0.25, 0.3]}
    search = model_selection.GridSearchCV(lenient(), tried, cv=shuffled, error_score="raise").fit(X, y)
    assert search.best_score_ > 0.5 and search.best_estimator_.estimator_.max_depth == search.best_params_["estimator__max_depth"]
    assert search.predict(X[:5]).shape == (5,) and search.score(X, y) > 0.5
    by_group = model_selection.cross_val_score(lenient(), X, y, groups=groups, cv=model_selection.GroupKFold(3), error_score="raise")
    assert by_group.min() > 0.4


@pytest.mark.parametrize("table", ["arrays", "lists", "pandas", "pyarrow"])
def test_a_list_of_sequences_and_rows_with_ids_give_the_same_model_and_verdicts(table: str) -> None:
    parts, y, groups = listed(240, 1)
    lengths = [len(part) for part in parts]
    ids = np.repeat(np.arange(240), lengths)
    frames: Any = [pd.DataFrame(part, columns=["a", "b"]) for part in parts]
    given: Any = {"arrays": parts, "lists": [part.tolist() for part in parts], "pandas": frames}.get(table)
    rows: Any = pd.concat(frames, ignore_index=True) if table == "pandas" else np.concatenate(parts)
    if table == "pyarrow":
        pyarrow = pytest.importorskip("pyarrow")
        given = [pyarrow.Table.from_pandas(frame) for frame in frames]
        rows = pyarrow.concat_tables(given)
    for own in ({}, {"groups": groups}):
        of_list = lenient(error_rate=0.3).fit(given, y, **own)
        repeated = {name: np.repeat(value, lengths) for name, value in own.items()}
        of_rows = lenient(error_rate=0.3).fit(rows, np.repeat(y, lengths), sequence=ids, **repeated)
        assert of_list.model_.checksum == of_rows.model_.checksum
    found = of_list.predict(given)
    expected = of_rows.predict(rows, sequence=ids)
    assert found.tolist() == [of_list.undecided_ if one is None else one for one in expected]
    assert of_list.verdicts(given) == of_rows.verdicts(rows, sequence=ids)
    assert of_list.score(given, y) == of_rows.score(rows, np.repeat(y, lengths), sequence=ids) == np.mean(found == y)
    assert len(of_list.predict([])) == 0


def test_a_sequence_without_a_verdict_counts_as_wrong_and_has_a_label_of_the_classes_type() -> None:
    X, y, _ = listed(300, 1)
    hard = [part[:4] for part in X]
    codes = np.unique(y, return_inverse=True)[1]
    for labels, undecided in [(y, ""), (codes, -1), (codes - 2, -3), (codes * 2.0, -1), (codes > 0, -1)]:
        own = lenient(error_rate=0.3).fit(X, labels)
        found = own.predict(hard)
        assert own.undecided_ == undecided and 0 < np.mean(found == undecided) < 1
        assert found.dtype.kind in (np.asarray(labels).dtype.kind, "i")
        assert own.score(hard, labels) == metrics.accuracy_score(labels, found) == np.mean(found == labels)
        weights = np.where(found == labels, 3.0, 1.0)
        assert own.score(hard, labels, sample_weight=weights) == metrics.accuracy_score(labels, found, sample_weight=weights)
        assert own.score(hard, labels, sample_weight=weights) > own.score(hard, labels)


def test_weights_are_those_of_the_classifiers_training() -> None:
    X, y, _ = listed(300, 1)
    own = palpate.SequenceRecognizer(tree.DecisionTreeClassifier(max_depth=3), error_rate=0.4, max_rows=LENGTH)
    plain = own.fit(X, y).estimator_
    np.testing.assert_array_equal(own.fit(X, y, sample_weight=np.ones(300)).estimator_.predict(X[0]), plain.predict(X[0]))
    heavy = own.fit(X, y, sample_weight=np.where(y == "cup", 3.0, 1.0)).estimator_
    assert np.mean(heavy.predict(np.concatenate(X)) == "cup") > np.mean(plain.predict(np.concatenate(X)) == "cup") + 0.1
    with pytest.raises(palpate.SettingError, match="sample_weight is given with a classifier that is fitted"):
        palpate.SequenceRecognizer(plain, prefit=True).fit(X, y, sample_weight=np.ones(300))


def test_scikit_learns_routing_hands_the_sequence_and_the_groups_on() -> None:
    X, y, sequence, groups = streams(450, 1)
    with config_context(enable_metadata_routing=True):
        own = lenient(error_rate=0.3).set_fit_request(sequence=True, groups=True).set_score_request(sequence=True)
        split: Any = {"cv": model_selection.GroupKFold(3), "params": {"sequence": sequence, "groups": groups}, "error_score": "raise"}
        assert model_selection.cross_val_score(own, X, y, **split).min() > 0.4
        assert model_selection.cross_val_score(base.clone(own), X, y, **split).min() > 0.4
        with pytest.raises(ValueError, match="sequence"):
            model_selection.cross_val_score(lenient(), X, y, **split)
        with pytest.raises(palpate.InputError, match="`score` has no argument person to route. Use .*sequence"):
            lenient().set_score_request(person=True)


def test_what_is_wrong_with_a_list_of_sequences_is_said_with_its_place() -> None:
    X, y, _ = listed(60, 1)
    cases: list[tuple[Any, Any, str]] = [
        (np.concatenate(X), y, r"X\[0\] has no rows and columns. Without `sequence`, X is a list"),
        (pd.DataFrame(np.concatenate(X)), y, "X is one table, and `sequence` is not given. Without `sequence`"),
        ([*X[:3], X[3][:0], *X[4:]], y, r"X\[3\] has no rows"),
        ([*X[:3], X[3][:, :1], *X[4:]], y, r"X\[3\] has other columns than X\[0\]"),
        (X, y[:-1], "y is 59 values. Use 60, one for each sequence"),
        (X, [*y[:4], None, *y[5:]], r"sequence 5: the label is missing \(None\)"),
        (X, np.stack([y, y], axis=1), r"the label is given in the shape \(60, 2\)"),
    ]
    for given, labels, message in cases:
        with pytest.raises(palpate.PalpateError, match=message):
            lenient().fit(given, labels)


def test_columns_of_labels_and_tuples_as_ids_are_taken() -> None:
    X, y, sequence, persons = streams(300, 1)
    plain = lenient().fit(X, y, sequence=sequence, groups=persons).model_.checksum
    for labels in (y.reshape(-1, 1), pd.DataFrame(y), y.tolist()):
        assert lenient().fit(X, labels, sequence=pd.DataFrame(sequence), groups=persons.reshape(-1, 1)).model_.checksum == plain
    pairs = [(int(person), int(own)) for person, own in zip(persons, sequence)]
    named = lenient().fit(X, y, sequence=pairs)
    assert len(named.predict(X, sequence=pairs)) == 300
    wrong = [*y[:3], None, *y[4:]]
    for call in (
        lambda: lenient().fit(X, wrong, sequence=sequence),
        lambda: palpate.calibrate(named.estimator_, X, wrong, sequence=sequence),
        lambda: palpate.evaluate_sequences(named.model_, X, wrong, sequence=sequence),
    ):
        with pytest.raises(palpate.InputError, match=r"row 4: the label is missing \(None\). Give each row its label"):
            call()


def test_estimators_are_shown_with_the_arguments_that_were_given() -> None:
    own = palpate.SequenceRecognizer(tree.DecisionTreeClassifier(max_depth=2), error_rate=0.1, folds=3)
    assert repr(own) == "SequenceRecognizer(estimator=DecisionTreeClassifier(max_depth=2), error_rate=0.1, folds=3)"
    assert repr(palpate.TouchRecognizer(rounds=3)) == "TouchRecognizer(rounds=3)"
    # A new estimator is set before its arguments, whatever the order.
    own.set_params(estimator__max_depth=7, estimator=tree.DecisionTreeClassifier())
    assert own.estimator.max_depth == 7 and own.get_params()["estimator__max_depth"] == 7


def test_an_estimate_above_the_rate_asked_for_is_said() -> None:
    X, y, _ = listed(60, 1)
    own = palpate.SequenceRecognizer(tree.DecisionTreeClassifier(max_depth=2), promise=False, folds=3)
    warned = 0
    for rate in (0.01, 0.02, 0.05, 0.3):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", palpate.ModelWarning)
            error = own.set_params(error_rate=rate).fit([part * np.float32(0.4) for part in X], y).estimated_.error
        said = [str(one.message) for one in caught if "estimated error rate" in str(one.message)]
        assert len(said) == (error > rate) and all(f"above the {rate:g} asked for" in text for text in said)
        warned += len(said)
    assert warned
