"""Models of other libraries, against the libraries' own predictions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import lightgbm
import numpy as np
import numpy.typing as npt
import palpate
import pytest
import xgboost
from sklearn import ensemble, tree

CLASSES = ["cup", "jug", "pan"]


def rows(count: int, missing: bool, seed: int) -> npt.NDArray[np.float32]:
    generator = np.random.default_rng(seed)
    values = generator.normal(size=(count, 6)).astype(np.float32)
    # Values that occur often, so that some equal thresholds.
    values[:, 3] = np.round(values[:, 3] * 2)
    if missing:
        values[generator.random(values.shape) < 0.1] = np.nan
    return values


def labels(values: npt.NDArray[np.float32], classes: int) -> npt.NDArray[np.int64]:
    known = np.nan_to_num(values)
    score = known[:, 0] + known[:, 1] * known[:, 3] - known[:, 2]
    return np.digitize(score, np.quantile(score, np.arange(1, classes) / classes))


TRAIN, TEST = rows(600, True, 1), rows(2000, True, 2)


@pytest.mark.parametrize("classes", [2, 3])
@pytest.mark.parametrize("booster", ["gbtree", "dart"])
def test_an_xgboost_classifier_gives_its_own_margins_bit_for_bit(classes: int, booster: str) -> None:
    estimator = xgboost.XGBClassifier(n_estimators=12, max_depth=4, booster=booster, n_jobs=2)
    estimator.fit(TRAIN, labels(TRAIN, classes))
    model = palpate.compile(estimator, leaf="f32")
    expected = estimator.predict(TEST, output_margin=True)
    found = model.margins(TEST)
    if classes == 2:
        np.testing.assert_array_equal(found[:, 0], 0.0)
        np.testing.assert_array_equal(found[:, 1], expected)
    else:
        np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(found.argmax(axis=1), estimator.predict(TEST))
    assert model.objects == [str(name) for name in range(classes)] and model.descriptor is None


def test_a_booster_and_its_file_give_the_same_model(tmp_path: Path) -> None:
    matrix = xgboost.DMatrix(TRAIN, label=labels(TRAIN, 3), feature_names=list("abcdef"))
    booster = xgboost.train({"objective": "multi:softprob", "num_class": 3, "max_depth": 3}, matrix, num_boost_round=8)
    model = palpate.compile(booster, leaf="f32", names=CLASSES)
    assert model.features == list("abcdef") and model.objects == CLASSES
    expected = booster.predict(xgboost.DMatrix(TEST, feature_names=list("abcdef")), output_margin=True)
    np.testing.assert_array_equal(model.margins(TEST), expected)
    booster.save_model(tmp_path / "model.json")
    assert palpate.compile(tmp_path / "model.json", leaf="f32", names=CLASSES).to_bytes() == model.to_bytes()
    # Leaves of 16 bits stay within what the model states.
    small = palpate.compile(booster, names=CLASSES)
    assert np.abs(small.margins(TEST) - expected).max() <= small.margin_error and small.size < model.size


def test_trees_after_the_best_round_are_left_out() -> None:
    generator = np.random.default_rng(0)
    estimator = xgboost.XGBClassifier(n_estimators=60, max_depth=4, early_stopping_rounds=3)
    noise = generator.integers(0, 3, 600)
    estimator.fit(TRAIN, noise, eval_set=[(TEST, generator.integers(0, 3, 2000))], verbose=False)
    assert estimator.best_iteration + 1 < estimator.get_booster().num_boosted_rounds()
    model = palpate.compile(estimator, leaf="f32")
    np.testing.assert_array_equal(model.margins(TEST), estimator.predict(TEST, output_margin=True))


def test_a_regression_gives_its_margin() -> None:
    estimator = xgboost.XGBRegressor(n_estimators=10, max_depth=4).fit(TRAIN, np.nan_to_num(TRAIN[:, 0]) ** 2)
    model = palpate.compile(estimator, leaf="f32")
    np.testing.assert_array_equal(model.margins(TEST)[:, 0], estimator.predict(TEST))


@pytest.mark.parametrize("classes", [2, 3])
def test_lightgbm_gives_its_own_scores(classes: int) -> None:
    estimator = lightgbm.LGBMClassifier(n_estimators=12, num_leaves=12, verbose=-1)
    names = np.array(CLASSES)[labels(TRAIN, classes)]
    estimator.fit(TRAIN, names)
    expected = estimator.booster_.predict(TEST, raw_score=True)
    for source in (estimator, estimator.booster_):
        model = palpate.compile(source, leaf="f32")
        found = model.margins(TEST) if classes > 2 else model.margins(TEST)[:, 1]
        assert np.abs(found - expected).max() <= model.margin_error < 1e-4
    assert palpate.compile(estimator).objects == CLASSES[:classes]


def raw(estimator: Any, values: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
    if hasattr(estimator, "decision_function"):
        scores = np.asarray(estimator.decision_function(values))
        return np.stack([np.zeros(len(scores)), scores], axis=1) if scores.ndim == 1 else scores
    if hasattr(estimator, "predict_proba"):
        return np.asarray(estimator.predict_proba(values))
    return np.asarray(estimator.predict(values)).reshape(-1, 1)


ESTIMATORS = [
    ensemble.RandomForestClassifier(n_estimators=12, max_depth=6, random_state=1),
    ensemble.ExtraTreesClassifier(n_estimators=12, max_depth=6, random_state=1),
    ensemble.HistGradientBoostingClassifier(max_iter=12, max_depth=4, random_state=1),
    ensemble.GradientBoostingClassifier(n_estimators=12, max_depth=3, random_state=1),
    tree.DecisionTreeClassifier(max_depth=5, random_state=1),
    ensemble.RandomForestRegressor(n_estimators=12, max_depth=6, random_state=1),
    ensemble.HistGradientBoostingRegressor(max_iter=12, random_state=1),
    ensemble.GradientBoostingRegressor(n_estimators=12, random_state=1),
]


@pytest.mark.parametrize("classes", [2, 3])
@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda estimator: type(estimator).__name__)
def test_scikit_learn_gives_its_own_answers(estimator: Any, classes: int) -> None:
    # Only these take missing values.
    missing = not type(estimator).__name__.startswith("GradientBoosting")
    train, test = rows(600, missing, 3), rows(2000, missing, 4)
    target = labels(train, classes)
    estimator.fit(train, np.array(CLASSES)[target] if hasattr(estimator, "predict_proba") else target.astype(float))
    expected = raw(estimator, test)
    if type(estimator).__name__ == "ExtraTreesClassifier" and classes == 2:
        # At a threshold, its trees go as the others do.
        test[:, :3] = train[:, :3][np.arange(2000) % 600]
        expected = raw(estimator, test)
    full = palpate.to_ensemble(estimator)
    assert np.abs(full.margins(test) - expected).max() < 1e-5
    model = palpate.compile(estimator, leaf="f32")
    assert np.abs(model.margins(test) - expected).max() <= model.margin_error < 1e-4
    if hasattr(estimator, "classes_"):
        assert model.objects == CLASSES[:classes]


def test_thresholds_of_histograms_are_compared_exactly() -> None:
    # Values at the very thresholds, beside them, infinite and missing.
    estimator = ensemble.HistGradientBoostingClassifier(max_iter=8, random_state=1).fit(TRAIN, labels(TRAIN, 3))
    cuts = np.concatenate([p.nodes["num_threshold"] for stage in estimator._predictors for p in stage])
    cuts = np.unique(cuts[np.isfinite(cuts)].astype(np.float32))
    near = [cuts, np.nextafter(cuts, np.float32(np.inf)), np.nextafter(cuts, np.float32(-np.inf))]
    values = np.concatenate([*near, np.array([np.inf, -np.inf, np.nan], dtype=np.float32)])
    for feature in range(6):
        test = np.repeat(TEST[:1], len(values), axis=0)
        test[:, feature] = values
        model = palpate.compile(estimator, leaf="f32")
        assert np.abs(model.margins(test) - estimator.decision_function(test)).max() <= model.margin_error


def test_what_has_no_trees_that_can_be_read_is_refused_by_name() -> None:
    from sklearn.linear_model import LogisticRegression

    categories = ensemble.HistGradientBoostingClassifier(categorical_features=[3], max_iter=2)
    categories.fit(np.abs(rows(200, False, 5)), np.arange(200) % 2)
    for model, message in [
        (LogisticRegression().fit(rows(50, False, 6), np.arange(50) % 2), "LogisticRegression has no trees"),
        (ensemble.RandomForestClassifier(), "not fitted"),
        (categories, "splits on categories"),
        (object(), "builtins.object is no model"),
    ]:
        with pytest.raises(palpate.InputError, match=message):
            palpate.compile(model)


def test_a_model_over_features_recognizes_rows() -> None:
    estimator = xgboost.XGBClassifier(n_estimators=12, max_depth=4).fit(TRAIN, labels(TRAIN, 3))
    model = palpate.compile(estimator)
    recognizer = palpate.Recognizer(model)
    of_jugs = TEST[labels(TEST, 3) == 1]
    for row in of_jugs:
        verdict = recognizer.push_row(row)
        if verdict.decided:
            break
    assert verdict.object == "1"
    refused = palpate.Recognizer(model).push((0.0, 0.0, 0.0))
    assert refused.refused == "the model is over rows of features, not touches"
    with pytest.raises(palpate.InputError, match="4 columns for 6 features"):
        model.margins(TEST[:, :4])
    with pytest.raises(ValueError, match="1 dimensions"):
        model.margins(TEST[0])
