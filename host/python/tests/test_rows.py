"""Rows with names: each feature from its own column; and what models note."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import lightgbm
import numpy as np
import numpy.typing as npt
import palpate
import pandas
import pyarrow
import pytest
import xgboost
from sklearn import ensemble

NAMES = ["width", "height", "count", "mean angle"]


def table(count: int, seed: int) -> pandas.DataFrame:
    generator = np.random.default_rng(seed)
    values = generator.normal(size=(count, 4)) * [1, 100, 3, 0.1]
    values[generator.random(values.shape) < 0.05] = np.nan
    return pandas.DataFrame(values, columns=NAMES)


def classes(rows: pandas.DataFrame) -> npt.NDArray[np.int64]:
    known = np.nan_to_num(rows.to_numpy())
    return (known[:, 0] + known[:, 1] / 50 > 0).astype(int) + (known[:, 2] > 1)


TRAIN, TEST = table(600, 1), table(300, 2)


def estimators() -> list[Any]:
    return [
        xgboost.XGBClassifier(n_estimators=6, max_depth=3, n_jobs=1),
        lightgbm.LGBMClassifier(n_estimators=6, num_leaves=6, verbose=-1, n_jobs=1),
        ensemble.HistGradientBoostingClassifier(max_iter=6, max_depth=3),
    ]


@pytest.mark.parametrize("estimator", estimators(), ids=lambda estimator: type(estimator).__name__)
def test_columns_of_a_table_are_found_by_their_names_in_any_order(estimator: Any) -> None:
    estimator.fit(TRAIN, classes(TRAIN))
    model = palpate.compile(estimator, leaf="f32")
    expected = estimator.predict(TEST)
    more = TEST.assign(person="ann")[["person", *NAMES[::-1]]]
    margins = model.margins(TEST.to_numpy())
    for rows in (TEST, TEST[NAMES[::-1]], more, pyarrow.Table.from_pandas(more)):
        np.testing.assert_array_equal(model.predict(rows), expected)
        np.testing.assert_array_equal(model.margins(rows), margins)
    np.testing.assert_array_equal(palpate.to_ensemble(estimator).margins(more), palpate.to_ensemble(estimator).margins(TEST))
    recognizer = palpate.Recognizer(model)
    verdict = recognizer.push_row(more.iloc[3].drop("person"))
    recognizer.reset()
    assert recognizer.push_row(TEST.to_numpy()[3]) == verdict
    # LightGBM has underscores where there were blanks.
    with pytest.raises(palpate.InputError, match="no column is named height; its columns are width, Height, count, mean angle"):
        model.predict(TEST.rename(columns={"height": "Height"}))
    with pytest.raises(palpate.InputError, match='two columns are named "width"'):
        model.predict(TEST[[*NAMES, "width"]])
    with pytest.raises(palpate.InputError, match="3 columns for 4 features"):
        model.predict(TEST.to_numpy()[:, :3])


def test_columns_are_taken_by_position_only_where_one_side_has_no_names_and_that_is_a_warning() -> None:
    estimator = lightgbm.LGBMClassifier(n_estimators=6, num_leaves=6, verbose=-1, n_jobs=1)
    unnamed = palpate.compile(estimator.fit(TRAIN.to_numpy(), classes(TRAIN)))
    expected = unnamed.predict(TEST.to_numpy())
    with pytest.warns(palpate.ModelWarning, match="columns are taken by their position"):
        np.testing.assert_array_equal(unnamed.predict(TEST), expected)
    numbered = pandas.DataFrame(TEST.to_numpy())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Numbers are found by themselves.
        np.testing.assert_array_equal(unnamed.predict(numbered), expected)
        np.testing.assert_array_equal(unnamed.predict(numbered.add_prefix("Column_").iloc[:, ::-1]), expected)
    named = palpate.compile(estimator.fit(TRAIN, classes(TRAIN)))
    with pytest.warns(palpate.ModelWarning, match="columns are taken by their position"):
        np.testing.assert_array_equal(named.predict(numbered), expected)
    for model, others in [(named, numbered.rename(columns=lambda name: name + 1)), (unnamed, numbered[[3, 1, 0, 2]])]:
        with pytest.raises(palpate.InputError, match="numbers alone"):
            model.predict(others)


def test_columns_of_numbers_are_read_whatever_they_are_made_of_and_others_are_refused_in_a_sentence() -> None:
    estimator = xgboost.XGBClassifier(n_estimators=6, max_depth=3, n_jobs=1)
    train, test = (rows.assign(count=rows["count"].round()) for rows in (TRAIN, TEST))
    model = palpate.compile(estimator.fit(train, classes(train)))
    expected = model.predict(test)
    same = test.assign(
        width=test["width"].astype("Float64"),
        height=test["height"].astype(object).where(test["height"].notna(), None),
        count=test["count"].astype("Int64"),
    )
    assert str(same.dtypes["count"]) == "Int64" and same["height"].isna().any()
    np.testing.assert_array_equal(model.predict(same), expected)
    words = test["width"].astype(object)
    words.iloc[7] = "wide"
    for column, message in [
        (words, "the column 'width' has 'wide' in row 8, which is no number"),
        (test["count"].astype("category"), "the column 'width' is of categories. Give the numbers that they had in training"),
        (pandas.Series(pandas.date_range("2026-01-01", periods=len(test))), "the column 'width' is of datetime64"),
    ]:
        with pytest.raises(palpate.InputError, match=message):
            model.predict(test.assign(width=column))


def test_sequences_of_a_table_are_of_its_named_columns() -> None:
    generator = np.random.default_rng(1)
    kinds = np.repeat(np.arange(900) % 3, 10)
    values = kinds[:, None] * [1.5, 0.0] + generator.normal(size=(len(kinds), 2))
    rows, sequence = pandas.DataFrame(values, columns=["ax", "ay"]), np.repeat(np.arange(900), 10)
    recognizer = palpate.SequenceRecognizer(ensemble.HistGradientBoostingClassifier(max_iter=6), error_rate=0.1)
    recognizer.fit(rows, kinds, sequence=sequence)
    assert recognizer.model_.features == ["ax", "ay"]
    found = recognizer.predict(rows, sequence=sequence)
    assert (recognizer.predict(rows[["ay", "ax"]], sequence=sequence) == found).all()
    ends = palpate.evaluate_sequences(recognizer.model_, rows, kinds, sequence=sequence)
    assert palpate.evaluate_sequences(recognizer.model_, rows[["ay", "ax"]], kinds, sequence=sequence).raw == ends.raw
    for call in (
        lambda: recognizer.predict(rows[["ax"]], sequence=sequence),
        lambda: palpate.evaluate_sequences(recognizer.model_, rows[["ax"]], kinds, sequence=sequence),
        lambda: palpate.calibrate(recognizer.model_, rows[["ax"]], kinds, sequence=sequence),
    ):
        with pytest.raises(palpate.InputError, match="no column is named ay; its columns are ax"):
            call()


@pytest.mark.parametrize("named", [True, False])
def test_of_many_columns_a_model_has_those_that_its_trees_use(named: bool, tmp_path: Path) -> None:
    generator = np.random.default_rng(3)
    values = generator.normal(size=(500, 400)).astype(np.float32)
    labels = (values[:, 7] + values[:, 399] > 0).astype(int)
    rows = pandas.DataFrame(values, columns=[f"sensor {column}" for column in range(400)])
    rows = rows if named else pandas.DataFrame(values)
    # Every other column says nothing.
    still = rows.copy()
    still.iloc[:, [column for column in range(400) if column not in (7, 399)]] = 0.0
    estimator = xgboost.XGBClassifier(n_estimators=6, max_depth=3, n_jobs=1).fit(still, labels)
    with pytest.warns(palpate.ModelWarning, match="A row has 2 of the library's 400 columns"):
        model = palpate.compile(estimator, leaf="f32")
    assert model.features == (["sensor 7", "sensor 399"] if named else ["7", "399"])
    expected = estimator.predict(rows)
    model.save(tmp_path / "model.palpate")
    for own in (model, palpate.Model.load(tmp_path / "model.palpate")):
        for given in (rows, rows.iloc[:, ::-1], values, values[:, [7, 399]]):
            np.testing.assert_array_equal(own.predict(given).astype(int), expected)
        with pytest.raises(palpate.InputError, match="399 columns for 2 features of the library's 400"):
            own.predict(values[:, :399])
    assert palpate.Recognizer(model).push_row(values[0]) == palpate.Recognizer(model).push_row(values[0, [7, 399]])


def test_what_the_program_notes_is_a_warning_and_stands_in_the_notes() -> None:
    seconds = np.c_[1.7e9 + np.arange(600) * 7.0, np.random.default_rng(1).normal(size=600)]
    labels = (np.arange(600) // 5) % 2
    estimator = lightgbm.LGBMClassifier(n_estimators=20, min_child_samples=2, verbose=-1, n_jobs=1).fit(seconds, labels)
    with pytest.warns(palpate.ModelWarning, match="Column_0: of .* stay different in f32") as caught:
        model = palpate.compile(estimator, leaf="f32")
    assert [str(warning.message) for warning in caught] == model.notes == palpate.to_ensemble(estimator).notes
    assert caught[0].filename == __file__
    scaled = palpate.compile(estimator, leaf="f32", scales=[1.0, 1e6])
    assert scaled.notes == []
    np.testing.assert_array_equal(scaled.predict(seconds), estimator.predict(seconds))
    booster = xgboost.train({"objective": "binary:logistic"}, xgboost.DMatrix(TRAIN, classes(TRAIN) > 0), 2)
    with pytest.warns(palpate.ModelWarning, match="does not state the number that stood for a missing value"):
        palpate.compile(booster)
    assert palpate.Model(model.to_bytes()).notes == []
