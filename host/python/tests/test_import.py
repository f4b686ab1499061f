"""Models of other libraries, against the libraries' own predictions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import catboost
import lightgbm
import numpy as np
import numpy.typing as npt
import palpate
import pytest
import xgboost
from sklearn.frozen import FrozenEstimator
from sklearn import (
    calibration,
    dummy,
    ensemble,
    linear_model,
    metrics,
    model_selection,
    multiclass,
    pipeline,
    tree,
)

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


@pytest.mark.parametrize("kind", ["gbtree", "dart", "forests"])
def test_trees_after_the_best_round_are_left_out_unless_all_are_asked_for(kind: str, tmp_path: Path) -> None:
    generator = np.random.default_rng(0)
    estimator = xgboost.XGBClassifier(
        n_estimators=60,
        max_depth=4,
        learning_rate=0.5,
        early_stopping_rounds=3,
        booster="dart" if kind == "dart" else "gbtree",
        rate_drop=0.3 if kind == "dart" else None,
        num_parallel_tree=3 if kind == "forests" else None,
        n_jobs=1,
    )
    noisy = [np.where(generator.random(len(x)) < 0.3, generator.integers(0, 3, len(x)), labels(x, 3)) for x in (TRAIN, TEST)]
    estimator.fit(TRAIN, noisy[0], eval_set=[(TEST, noisy[1])], verbose=False)
    booster = estimator.get_booster()
    taken, rounds = estimator.best_iteration + 1, booster.num_boosted_rounds()
    assert 1 < taken < rounds
    # The booster states the best round too, and so does its file.
    booster.save_model(tmp_path / "model.json")
    for source in (estimator, booster, tmp_path / "model.json"):
        full = palpate.to_ensemble(source)
        per_round = 9 if kind == "forests" else 3
        assert full.trees == taken * per_round
        said = f"Training stopped early: the {taken * per_round} trees up to the best iteration, {taken - 1}, are used"
        assert any(note.startswith(said) for note in full.notes)
        model = palpate.compile(source, leaf="f32")
        # For dart, the estimator, which takes no DMatrix, adds in another order.
        found = model.margins(TEST)
        expected = booster.predict(xgboost.DMatrix(TEST), output_margin=True, iteration_range=(0, taken))
        np.testing.assert_array_equal(found, expected)
        assert np.abs(found - estimator.predict(TEST, output_margin=True)).max() < 1e-6
        every = palpate.compile(source, leaf="f32", all_trees=True)
        expected = booster.predict(xgboost.DMatrix(TEST), output_margin=True)
        np.testing.assert_array_equal(every.margins(TEST), expected)
        assert palpate.to_ensemble(source, all_trees=True).trees == rounds * per_round
    assert np.abs(every.margins(TEST) - model.margins(TEST)).max() > 0.01


def test_trees_after_lightgbms_best_round_are_left_out_unless_all_are_asked_for() -> None:
    generator = np.random.default_rng(0)
    train = lightgbm.Dataset(TRAIN, generator.integers(0, 2, 600))
    booster = lightgbm.train(
        {"objective": "binary", "verbose": -1, "num_threads": 1},
        train,
        60,
        valid_sets=[lightgbm.Dataset(TEST, generator.integers(0, 2, 2000), reference=train)],
        callbacks=[lightgbm.early_stopping(5, verbose=False)],
        keep_training_booster=True,
    )
    taken, rounds = booster.best_iteration, booster.current_iteration()
    assert 0 < taken < rounds
    said = f"Training stopped early: the best {taken} of {rounds} rounds are taken"
    assert palpate.to_ensemble(booster).notes[-1].startswith(said)
    for all_trees in (False, True):
        model = palpate.compile(booster, leaf="f32", all_trees=all_trees)
        expected = booster.predict(TEST, raw_score=True, num_iteration=-1 if all_trees else None)
        assert np.abs(model.margins(TEST)[:, 1] - expected).max() <= model.margin_error < 1e-4
    assert palpate.to_ensemble(booster, all_trees=True).trees == rounds > palpate.to_ensemble(booster).trees


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


def test_whole_numbers_that_f32_does_not_hold_go_where_lightgbm_sends_them() -> None:
    generator = np.random.default_rng(7)
    # LightGBM rounds whole numbers to f32, and not f64.
    seconds = 1.7e9 + generator.integers(0, 600, (600, 2))
    kinds = ((seconds[:, 0] % 60 // 20 + seconds[:, 1] % 30 // 15) % 3).astype(int)
    estimator = lightgbm.LGBMClassifier(n_estimators=12, num_leaves=31, min_child_samples=2, verbose=-1, n_jobs=1)
    estimator.fit(seconds, kinds)
    model = palpate.compile(estimator, leaf="f32", scales=[1.0, 1.0])
    expected = estimator.predict(seconds, raw_score=True)
    for given in (seconds, seconds.astype(np.int64)):
        assert np.abs(model.margins(given) - expected).max() <= model.margin_error < 1e-4
        np.testing.assert_array_equal(model.predict(given), estimator.predict(seconds))
    recognizer = palpate.Recognizer(model)
    recognizer.push_row(seconds[0])
    assert recognizer.best == str(expected[0].argmax())


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
    tree.ExtraTreeClassifier(max_depth=5, random_state=1),
    ensemble.RandomForestRegressor(n_estimators=12, max_depth=6, random_state=1),
    ensemble.ExtraTreesRegressor(n_estimators=12, max_depth=6, random_state=1),
    ensemble.HistGradientBoostingRegressor(max_iter=12, random_state=1),
    ensemble.GradientBoostingRegressor(n_estimators=12, random_state=1),
    tree.DecisionTreeRegressor(max_depth=5, random_state=1),
    tree.ExtraTreeRegressor(max_depth=5, random_state=1),
]


def test_every_estimator_that_is_taken_is_tested() -> None:
    # Wrappers around other estimators have tests of their own.
    others = ["CalibratedClassifierCV", "IsolationForest"]
    tested = [type(estimator).__name__ for estimator in ESTIMATORS] + others
    assert sorted(tested) == sorted(palpate._sklearn.KNOWN)


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


def test_posteriors_of_exponential_loss_are_those_of_predict_proba() -> None:
    train, test = rows(600, False, 3), rows(2000, False, 4)
    estimator = ensemble.GradientBoostingClassifier(n_estimators=12, loss="exponential", random_state=1)
    estimator.fit(train, labels(train, 2))
    full = palpate.to_ensemble(estimator)
    assert len(full.notes) == 1 and "twice the values of `decision_function`" in full.notes[0]
    margins = full.margins(test).astype(np.float64)
    posterior = 1.0 / (1.0 + np.exp(margins[:, 0] - margins[:, 1]))
    assert np.abs(posterior - estimator.predict_proba(test)[:, 1]).max() < 1e-6
    np.testing.assert_array_equal(margins.argmax(axis=1), estimator.predict(test))
    model = palpate.compile(estimator, leaf="f32")
    assert np.abs(model.margins(test)[:, 1] - 2 * estimator.decision_function(test)).max() <= model.margin_error


@pytest.mark.parametrize("init", ["zero", dummy.DummyClassifier(strategy="uniform"), dummy.DummyClassifier(strategy="prior")])
def test_boosting_may_start_from_any_constant(init: Any) -> None:
    train, test = rows(600, False, 3), rows(500, False, 4)
    estimator = ensemble.GradientBoostingClassifier(n_estimators=5, init=init, random_state=1).fit(train, labels(train, 3))
    model = palpate.compile(estimator, leaf="f32")
    assert np.abs(model.margins(test) - estimator.decision_function(test)).max() <= model.margin_error


@pytest.mark.parametrize("init", [dummy.DummyClassifier(strategy="stratified"), tree.DecisionTreeClassifier(max_depth=2)])
def test_boosting_that_starts_from_another_prediction_is_refused(init: Any) -> None:
    train = rows(600, False, 3)
    estimator = ensemble.GradientBoostingClassifier(n_estimators=5, init=init, random_state=1).fit(train, labels(train, 3))
    with pytest.raises(palpate.InputError, match=f"`init` is a {type(init).__name__} whose prediction is no constant"):
        palpate.compile(estimator)


@pytest.mark.parametrize("loss", ["poisson", "gamma", "squared_error"])
def test_a_regression_predicts_the_librarys_value_after_its_link(loss: str) -> None:
    estimator = ensemble.HistGradientBoostingRegressor(loss=loss, max_iter=12, random_state=1)
    estimator.fit(TRAIN, 1.0 + labels(TRAIN, 3))
    model = palpate.compile(estimator, leaf="f32")
    np.testing.assert_allclose(model.predict(TEST), estimator.predict(TEST), rtol=1e-5)


def combining() -> list[Any]:
    """Estimators of which each holds trees and does something else than to add them up."""
    stump = tree.DecisionTreeClassifier(max_depth=1)
    deep, regression = tree.DecisionTreeClassifier(max_depth=4), tree.DecisionTreeRegressor(max_depth=4)
    return [
        ensemble.AdaBoostClassifier(stump, n_estimators=10, random_state=1),
        ensemble.AdaBoostRegressor(regression, n_estimators=10, random_state=1),
        ensemble.BaggingClassifier(deep, n_estimators=10, max_features=0.5, random_state=1),
        ensemble.BaggingRegressor(regression, n_estimators=10, max_features=0.5, random_state=1),
        ensemble.VotingClassifier([("a", deep), ("b", stump)], voting="soft", weights=[9, 1]),
        ensemble.VotingClassifier([("a", deep), ("b", stump)], voting="hard"),
        ensemble.VotingRegressor([("a", regression), ("b", regression)], weights=[9, 1]),
        ensemble.StackingClassifier([("a", deep), ("b", stump)]),
        ensemble.StackingRegressor([("a", regression), ("b", regression)]),
        ensemble.RandomTreesEmbedding(n_estimators=10, random_state=1),
        model_selection.FixedThresholdClassifier(deep, threshold=0.8),
        model_selection.GridSearchCV(deep, {"max_depth": [2, 3]}),
        multiclass.OneVsRestClassifier(deep),
        linear_model.LogisticRegression(),
    ]


@pytest.mark.parametrize("estimator", combining(), ids=lambda estimator: type(estimator).__name__)
def test_estimators_that_combine_trees_in_their_own_way_are_refused_by_name(estimator: Any) -> None:
    train = rows(300, False, 6)
    estimator.fit(train, labels(train, 2))
    name = type(estimator).__name__
    with pytest.raises(palpate.InputError, match=f"^sklearn's {name} has no trees that can be read.*RandomForestClassifier"):
        palpate.compile(estimator)


class Doubtful(ensemble.RandomForestClassifier):
    """A forest that refuses to decide."""

    def predict(self, rows: Any) -> Any:
        return np.zeros(len(rows))


class Shifted(xgboost.XGBClassifier):
    """XGBoost with another threshold."""

    def predict(self, rows: Any, **options: Any) -> Any:
        return self.predict_proba(rows)[:, 1] > 0.8


@pytest.mark.parametrize(
    ("estimator", "base"), [(Doubtful(5), "sklearn's RandomForestClassifier"), (Shifted(n_estimators=3), "xgboost's XGBClassifier")]
)
def test_classes_derived_from_others_are_refused_by_name(estimator: Any, base: str) -> None:
    estimator.fit(TRAIN, labels(TRAIN, 2))
    with pytest.raises(palpate.InputError, match=f"{type(estimator).__name__} is derived from {base} and may predict in another way"):
        palpate.compile(estimator)


@pytest.mark.parametrize("kind", [ensemble.RandomForestRegressor, ensemble.ExtraTreesRegressor, tree.DecisionTreeRegressor])
def test_each_target_of_a_forest_has_the_value_that_scikit_learn_predicts(kind: Any) -> None:
    targets = np.stack([np.nan_to_num(TRAIN[:, 0]) * 3, 1000 + labels(TRAIN, 3), np.nan_to_num(TRAIN[:, 1])], axis=1)
    estimator = kind(max_depth=5, random_state=1).fit(TRAIN, targets)
    model = palpate.compile(estimator, leaf="f32")
    found = model.predict(TEST)
    assert isinstance(found, np.ndarray) and found.shape == (len(TEST), 3)
    np.testing.assert_allclose(found, estimator.predict(TEST), rtol=1e-5, atol=1e-5)
    assert model.objects == ["target0", "target1", "target2"]


def test_each_target_of_a_booster_has_the_value_that_the_library_predicts() -> None:
    train = np.nan_to_num(TRAIN)
    targets = np.stack([train[:, 0] * 3, train[:, 1] + train[:, 2]], axis=1)
    for strategy in ["one_output_per_tree", "multi_output_tree"]:
        estimator = xgboost.XGBRegressor(n_estimators=6, max_depth=3, multi_strategy=strategy).fit(TRAIN, targets)
        np.testing.assert_array_equal(palpate.compile(estimator, leaf="f32").predict(TEST), estimator.predict(TEST))
    regressor = catboost.CatBoostRegressor(loss_function="MultiRMSE", iterations=6, depth=3, verbose=False, allow_writing_files=False)
    regressor.fit(TRAIN, targets)
    np.testing.assert_allclose(palpate.compile(regressor, leaf="f32").predict(TEST), regressor.predict(TEST), atol=1e-5)


def regressors() -> list[Any]:
    """A regressor of each library and kind."""
    return [
        lightgbm.LGBMRegressor(n_estimators=60, verbose=-1, n_jobs=1),
        xgboost.XGBRegressor(n_estimators=60, n_jobs=1),
        catboost.CatBoostRegressor(iterations=60, verbose=0, thread_count=1, allow_writing_files=False),
        ensemble.RandomForestRegressor(30, max_depth=8, random_state=1),
        ensemble.GradientBoostingRegressor(n_estimators=60, random_state=1),
        ensemble.HistGradientBoostingRegressor(max_iter=60, random_state=1),
    ]


@pytest.mark.parametrize(("mean", "deviation"), [(101325.0, 3.0), (2024.0, 1.0), (273.0, 2.0), (1.7e9, 3600.0)])
@pytest.mark.parametrize("estimator", regressors(), ids=lambda estimator: type(estimator).__name__)
def test_values_of_targets_far_from_0_stay_the_librarys(estimator: Any, mean: float, deviation: float) -> None:
    train, test = rows(600, False, 5), rows(1000, False, 6)
    estimator.fit(train, mean + deviation * (train[:, 0] + np.sin(2 * train[:, 1])))
    expected = np.asarray(estimator.predict(test), dtype=np.float64)
    spread = expected.std()
    model = palpate.compile(estimator)
    off = np.sqrt(np.mean((model.margins(test)[:, 0] - expected) ** 2)) / spread
    step = float(np.spacing(np.float32(mean))) / spread
    if type(estimator) is xgboost.XGBRegressor and any("and leaves of f32 give its own values" in note for note in model.notes):
        # It rounds to f32 after each tree.
        np.testing.assert_array_equal(palpate.compile(estimator, leaf="f32").predict(test), estimator.predict(test))
    else:
        assert off <= 0.002
        assert np.sqrt(np.mean((np.asarray(model.predict(test)) - expected) ** 2)) / spread <= 0.002 + step / 3
    assert any("_without_offset" in note for note in model.notes) or mean < 1e9


def test_targets_of_different_sizes_keep_their_digits() -> None:
    train, test = rows(600, False, 5), rows(1000, False, 6)
    targets = np.stack([20 + 5 * train[:, 0], 101325 + 300 * train[:, 1], 0.5 + 0.1 * np.tanh(train[:, 2])], axis=1)
    for estimator in (ensemble.RandomForestRegressor(30, max_depth=8, random_state=1), xgboost.XGBRegressor(n_estimators=60, n_jobs=1)):
        expected = np.asarray(estimator.fit(train, targets).predict(test), dtype=np.float64)
        off = np.asarray(palpate.compile(estimator).predict(test)) - expected
        assert (np.sqrt((off**2).mean(axis=0)) <= 0.002 * expected.std(axis=0)).all()


def test_a_note_on_f32_is_for_libraries_that_compare_f64_alone() -> None:
    generator = np.random.default_rng(3)
    seconds = 1_700_000_000 + generator.integers(0, 86400 * 3, 2000)
    # LightGBM rounds arrays of whole numbers to f32.
    train, target = np.stack([seconds, generator.integers(0, 50, 2000)], axis=1).astype(np.float64), seconds // 3600 % 3
    for estimator in (
        lightgbm.LGBMClassifier(n_estimators=40, verbose=-1, n_jobs=1),
        ensemble.HistGradientBoostingClassifier(max_iter=20),
    ):
        estimator.fit(train, target)
        with pytest.warns(palpate.ModelWarning, match="of .* stay different in f32, and about 1 row in"):
            palpate.compile(estimator)
        model = palpate.compile(estimator, leaf="f32", scales=[1, 1])
        assert [str(own) for own in model.predict(train)] == [str(own) for own in estimator.predict(train)]
    for estimator in (
        ensemble.RandomForestClassifier(20, max_depth=10, random_state=1),
        ensemble.ExtraTreesClassifier(20, max_depth=10, random_state=1),
        tree.DecisionTreeClassifier(random_state=1),
        ensemble.GradientBoostingClassifier(n_estimators=20),
        xgboost.XGBClassifier(n_estimators=20, n_jobs=1),
    ):
        model = palpate.compile(estimator.fit(train, target), leaf="f32")
        assert not any("f32" in note for note in model.notes)
        assert [str(own) for own in model.predict(train)] == [str(own) for own in estimator.predict(train)]


@pytest.mark.parametrize("settings", [{}, {"max_features": 0.5, "bootstrap": True}, {"max_samples": 30, "contamination": 0.1}])
def test_an_isolation_forest_gives_its_anomaly_score_and_states_where_outliers_begin(settings: dict[str, Any]) -> None:
    estimator = ensemble.IsolationForest(n_estimators=30, random_state=1, **settings).fit(np.nan_to_num(TRAIN))
    test = np.nan_to_num(TEST) * 2
    ours = palpate.to_ensemble(estimator)
    found = palpate.compile(ours, leaf="f32").predict(test)
    scores = -estimator.score_samples(test)
    np.testing.assert_allclose(found, scores, atol=2e-6)
    threshold = float(ours.notes[0].split()[-1].rstrip("."))
    clear = np.abs(scores + estimator.offset_) > 1e-5
    outliers = estimator.predict(test) == -1
    assert 0 < outliers.sum() < len(test) and clear.mean() > 0.9
    np.testing.assert_array_equal((np.asarray(found) > threshold)[clear], outliers[clear])


@pytest.mark.parametrize("method", ["sigmoid", "isotonic"])
@pytest.mark.parametrize("classes", [2, 3])
@pytest.mark.parametrize(
    "inner",
    [
        ensemble.GradientBoostingClassifier(n_estimators=8),
        ensemble.GradientBoostingClassifier(n_estimators=8, loss="exponential"),
        ensemble.HistGradientBoostingClassifier(max_iter=8),
        ensemble.RandomForestClassifier(12, max_depth=5, random_state=1),
    ],
)
def test_a_calibrated_classifier_gives_its_classes_and_by_a_sigmoid_its_probabilities(inner: Any, classes: int, method: str) -> None:
    train, test = np.nan_to_num(TRAIN), np.nan_to_num(TEST)
    if classes == 3 and getattr(inner, "loss", "") == "exponential":
        return
    estimator = calibration.CalibratedClassifierCV(inner, method=method, ensemble=False).fit(train, labels(train, classes))
    if classes == 3 and method == "isotonic":
        with pytest.raises(palpate.InputError, match="IsotonicRegression of 3 classes"):
            palpate.to_ensemble(estimator)
        return
    model = palpate.compile(estimator, leaf="f32")
    shares = estimator.predict_proba(test)
    ordered = np.sort(shares, axis=1)
    clear = ordered[:, -1] - ordered[:, -2] > 1e-4
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(model.predict(test)[clear], estimator.predict(test)[clear])
    if classes == 2 and method == "sigmoid":
        margins = model.margins(test)
        np.testing.assert_allclose(1 / (1 + np.exp(margins[:, 0] - margins[:, 1])), shares[:, 1], atol=1e-5)


@pytest.mark.parametrize("kind", ["words", "numbers", "floats", "flags", "objects"])
def test_classes_are_predicted_as_labels_of_the_classifiers_own_type(kind: str) -> None:
    train, codes = np.nan_to_num(TRAIN), labels(TRAIN, 2)
    y: Any = {
        "words": np.array(CLASSES)[codes],
        "numbers": codes * 7 - 3,
        "floats": codes * 2.0,
        "flags": codes > 0,
        "objects": np.array(CLASSES, dtype=object)[codes],
    }[kind]
    for estimator in (
        ensemble.RandomForestClassifier(4, random_state=1),
        lightgbm.LGBMClassifier(n_estimators=4, num_leaves=5, verbose=-1, n_jobs=1),
        pipeline.make_pipeline("passthrough", ensemble.HistGradientBoostingClassifier(max_iter=4)),
    ):
        estimator.fit(train, y)
        expected = estimator.predict(train)
        for source in (estimator, palpate.to_ensemble(estimator)):
            found = palpate.compile(source, leaf="f32").predict(train)
            assert found.dtype == expected.dtype and metrics.accuracy_score(expected, found) == 1.0
            assert np.mean(found == expected) == 1.0 and len(palpate.compile(source).predict(train[:0])) == 0
        # Bytes hold names alone, and whoever gives names means them.
        loaded = palpate.Model(palpate.compile(estimator, leaf="f32").to_bytes())
        np.testing.assert_array_equal(loaded.predict(train), expected.astype(str))
        named = palpate.compile(estimator, leaf="f32", names=["no", "yes"]).predict(train)
        assert named.tolist() == ["yes" if label == y[codes == 1][0] else "no" for label in expected]


def test_an_objective_of_ones_own_that_predicts_no_classes_is_refused() -> None:
    def own(truth: Any, score: Any) -> Any:
        share = 1 / (1 + np.exp(-score))
        return share - truth, share * (1 - share)

    estimator = lightgbm.LGBMClassifier(n_estimators=3, objective=own, verbose=-1, n_jobs=1).fit(TRAIN, labels(TRAIN, 2))
    with pytest.raises(palpate.InputError, match="predicts scores, and no classes. Give `model.booster_`"):
        palpate.compile(estimator)
    expected = estimator.booster_.predict(TEST, raw_score=True)
    assert np.abs(palpate.compile(estimator.booster_, leaf="f32").predict(TEST) - expected).max() < 1e-4


def test_a_frozen_model_is_taken_calibrated_and_several_that_are_averaged_are_refused() -> None:
    train = np.nan_to_num(TRAIN)
    forest = ensemble.RandomForestClassifier(5, random_state=1).fit(train, labels(train, 2))
    frozen = calibration.CalibratedClassifierCV(FrozenEstimator(forest), method="sigmoid").fit(train, labels(train, 2))
    model = palpate.compile(frozen, leaf="f32")
    np.testing.assert_array_equal(model.predict(train), frozen.predict(train))
    averaged = calibration.CalibratedClassifierCV(forest, cv=3).fit(train, labels(train, 2))
    with pytest.raises(palpate.InputError, match="averages 3 calibrated models"):
        palpate.to_ensemble(averaged)


def test_categories_are_decided_as_the_library_decides_them() -> None:
    generator = np.random.default_rng(4)
    train = np.nan_to_num(TRAIN)
    train[:, 3] = generator.integers(0, 30, len(train))
    own = (train[:, 3] * 7 % 5 > 2) ^ (train[:, 0] > 0)
    test = np.nan_to_num(TEST)
    test[:, 3] = generator.choice([*range(32), -1, np.nan], len(test))
    types = ["c" if index == 3 else "q" for index in range(6)]
    matrix = xgboost.DMatrix(train, own, feature_types=types, enable_categorical=True)
    booster = xgboost.train({"objective": "binary:logistic", "max_cat_to_onehot": 2, "max_depth": 4}, matrix, 6)
    expected = booster.predict(xgboost.DMatrix(test, feature_types=types, enable_categorical=True), output_margin=True)
    np.testing.assert_array_equal(palpate.compile(booster, leaf="f32").margins(test)[:, 1], expected)
    data = lightgbm.Dataset(train, own, categorical_feature=[3])
    lights = lightgbm.train({"objective": "binary", "verbose": -1, "num_threads": 1}, data, 6)
    np.testing.assert_allclose(
        palpate.compile(lights, leaf="f32").margins(test)[:, 1], lights.predict(test, raw_score=True), atol=1e-5
    )


def test_what_has_no_trees_that_can_be_read_is_refused_by_name() -> None:
    categories = ensemble.HistGradientBoostingClassifier(categorical_features=[3], max_iter=2)
    categories.fit(np.abs(rows(200, False, 5)), np.abs(rows(200, False, 5))[:, 3] % 2)
    several = ensemble.RandomForestClassifier(3).fit(rows(50, False, 6), np.stack([np.arange(50) % 2, np.arange(50) % 3], axis=1))
    halves = {"objective": "binary", "verbose": -1, "num_threads": 1}
    folds = lightgbm.cv(halves, lightgbm.Dataset(TRAIN, labels(TRAIN, 2)), 2, return_cvbooster=True)["cvbooster"]
    for model, message in [
        (ensemble.RandomForestClassifier(), "the RandomForestClassifier is not fitted"),
        (lightgbm.LGBMClassifier(), "the LGBMClassifier is not fitted"),
        (xgboost.XGBClassifier(), "the XGBClassifier is not fitted"),
        (catboost.CatBoostClassifier(), "the CatBoostClassifier is not fitted"),
        (lightgbm.LGBMClassifier, "LGBMClassifier is a class, not a model. Give an object of it"),
        (categories, "splits on categories"),
        (several, "classes of several kinds"),
        (folds, "lightgbm's CVBooster has no trees that can be read"),
        (xgboost.XGBModel(n_estimators=2).fit(TRAIN, TRAIN[:, 3] > 0), "xgboost's XGBModel has no trees that can be read"),
        (object(), "builtins.object is not a model"),
    ]:
        with pytest.raises(palpate.InputError, match=message):
            palpate.compile(model)


@pytest.mark.parametrize("missing", [0.0, -1, np.float32(2.0), None])
def test_the_number_that_stands_for_a_missing_value_is_the_estimators(missing: float | None, tmp_path: Path) -> None:
    # The trees do not hold it: as a number it would go by comparisons, and not where missing values go.
    train, test = np.round(TRAIN), np.round(TEST)
    test[::7] *= -0.0
    settings = {} if missing is None else {"missing": missing}
    estimator = xgboost.XGBClassifier(n_estimators=12, n_jobs=1, **settings).fit(train, labels(train, 3))
    expected = estimator.predict(test, output_margin=True)
    full, model = palpate.to_ensemble(estimator), palpate.compile(estimator, leaf="f32")
    np.testing.assert_array_equal(full.margins(test), expected)
    np.testing.assert_array_equal(model.margins(test), expected)
    assert full.notes == []
    # A booster and its file do not hold the number, either: they say so, and take it.
    estimator.save_model(tmp_path / "model.json")
    for source in (estimator.get_booster(), tmp_path / "model.json"):
        assert "does not state the number that stood for a missing value" in palpate.to_ensemble(source).notes[0]
        same = palpate.compile(source, leaf="f32", missing=np.nan if missing is None else missing)
        np.testing.assert_array_equal(same.margins(test), expected)
        if missing is not None:
            assert (palpate.compile(source, leaf="f32").margins(test) != expected).any()
    with pytest.raises(palpate.SettingError, match="missing is 5.0. Leave it out: the XGBClassifier says"):
        palpate.compile(estimator, missing=5.0)


def test_only_xgboost_is_told_what_is_missing() -> None:
    forest = ensemble.RandomForestClassifier(2).fit(TRAIN, labels(TRAIN, 2))
    with pytest.raises(palpate.SettingError, match="missing is 0.0. Leave it out: a model of sklearn"):
        palpate.compile(forest, missing=0.0)


@pytest.mark.parametrize("estimator", [
    ensemble.GradientBoostingClassifier(n_estimators=1, max_depth=1),
    ensemble.HistGradientBoostingClassifier(max_iter=1, max_depth=1),
    ensemble.RandomForestClassifier(2, max_depth=1, bootstrap=False, random_state=1),
], ids=lambda estimator: type(estimator).__name__)
@pytest.mark.parametrize("leaf", ["f32", "i16"])
def test_exact_ties_break_as_in_scikit_learn(estimator: Any, leaf: str) -> None:
    # Each half of the rows has as many of either class: no split says anything, and scores are 0.
    grid = np.repeat(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]], dtype=np.float32), 50, axis=0)
    estimator.fit(grid, (grid[:, 0] != grid[:, 1]).astype(int))
    model = palpate.compile(estimator, leaf=leaf)
    assert np.ptp(model.margins(grid), axis=1).max() == 0.0
    np.testing.assert_array_equal(model.predict(grid), estimator.predict(grid))


def test_classes_by_another_threshold_than_the_posterior_are_refused() -> None:
    estimator = xgboost.XGBClassifier(n_estimators=5, objective="binary:logitraw").fit(TRAIN, labels(TRAIN, 2))
    with pytest.raises(palpate.InputError, match="compares margins with 0.5"):
        palpate.compile(estimator)
    model = palpate.compile(estimator.get_booster(), leaf="f32")
    np.testing.assert_array_equal(model.margins(TEST)[:, 1], estimator.predict(TEST, output_margin=True))


@pytest.mark.parametrize("classes", [2, 3])
def test_catboost_gives_its_own_scores(classes: int) -> None:
    estimator = catboost.CatBoostClassifier(iterations=12, depth=4, verbose=0, thread_count=1, allow_writing_files=False)
    estimator.fit(TRAIN, np.array(CLASSES)[labels(TRAIN, classes)])
    model = palpate.compile(estimator, leaf="f32")
    expected = estimator.predict(TEST, prediction_type="RawFormulaVal")
    found = model.margins(TEST) if classes > 2 else model.margins(TEST)[:, 1]
    assert np.abs(found - expected).max() <= model.margin_error < 1e-4
    assert model.objects == CLASSES[:classes]
    if classes == 2:
        estimator.set_probability_threshold(0.8)
        with pytest.raises(palpate.InputError, match="probability threshold 0.8"):
            palpate.compile(estimator)


@pytest.mark.parametrize("objective", ["regression_l1", "huber", "fair", "quantile", "mape", "poisson"])
@pytest.mark.parametrize("boosting", ["gbdt", "rf"])
def test_lightgbms_values_are_those_of_its_link_and_of_the_mean_of_a_forest(objective: str, boosting: str) -> None:
    target = 1.0 + labels(TRAIN, 3)
    forest = {"bagging_freq": 1, "bagging_fraction": 0.6} if boosting == "rf" else {}
    estimator = lightgbm.LGBMRegressor(
        n_estimators=9, objective=objective, boosting_type=boosting, reg_sqrt=True, verbose=-1, n_jobs=1, **forest
    ).fit(TRAIN, target)
    model = palpate.compile(estimator, leaf="f32")
    np.testing.assert_allclose(model.predict(TEST), estimator.predict(TEST), rtol=1e-5)
    assert np.abs(model.margins(TEST)[:, 0] - estimator.predict(TEST, raw_score=True)).max() <= 1e-4


def test_catboosts_values_are_what_it_predicts_by_default() -> None:
    for loss in ("LogLinQuantile", "Poisson", "Tweedie:variance_power=1.5", "Quantile:alpha=0.7"):
        estimator = catboost.CatBoostRegressor(
            iterations=9, depth=3, loss_function=loss, verbose=0, thread_count=1, allow_writing_files=False
        ).fit(TRAIN, 1.0 + labels(TRAIN, 3))
        model = palpate.compile(estimator, leaf="f32")
        np.testing.assert_allclose(model.predict(TEST), estimator.predict(TEST), rtol=1e-5, atol=1e-6)


def test_histograms_over_columns_of_categories_that_no_tree_splits_on_are_read() -> None:
    train, test = rows(600, False, 1), rows(500, False, 2)
    # The third column is a category, and the only one that is the same in all rows of the training.
    train[:, 2], test[:, 2] = 1.0, 1.0
    estimator = ensemble.HistGradientBoostingClassifier(max_iter=8, categorical_features=[2], random_state=1)
    estimator.fit(train, labels(train, 3))
    model = palpate.compile(estimator, leaf="f32")
    assert np.abs(model.margins(test) - estimator.decision_function(test)).max() <= model.margin_error


def test_classifiers_of_one_class_are_refused_or_have_the_other_ones_margin() -> None:
    for estimator in (
        ensemble.RandomForestClassifier(2).fit(TRAIN, np.full(len(TRAIN), 3)),
        lightgbm.LGBMClassifier(n_estimators=2, verbose=-1).fit(TRAIN, np.full(len(TRAIN), "cup")),
    ):
        with pytest.raises(palpate.InputError, match="knows one class, (3|cup), and nothing to distinguish"):
            palpate.compile(estimator)
    estimator = xgboost.XGBClassifier(n_estimators=2).fit(TRAIN, np.zeros(len(TRAIN), int))
    model = palpate.compile(estimator, leaf="f32")
    np.testing.assert_array_equal(model.margins(TEST)[:, 1], estimator.predict(TEST, output_margin=True))


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
    with pytest.raises(ValueError, match="a 1-dimensional array, where a 2-dimensional one is needed"):
        model.margins(TEST[0])
